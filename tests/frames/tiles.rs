//! Every kind of pixel and tile compression against the values astropy 8.0.2 reads (scripts/make_tiles.py wrote the files).
#![allow(clippy::unwrap_used)]

use crate::frames_support;

use std::path::PathBuf;

use frames_support::*;
use satphot::fits::{Header, wrong_checksum};

/// Name; sum of the finite pixels; sum of pixel times (1 + its number in rows mod 97); undefined pixels. Each image has
/// 31 x 23 px; pixels rounded to f32.
const BY_ASTROPY: [(&str, f64, f64, usize); 52] = [
    ("rice_u16", 784454.0, 37290152.0, 0),
    ("rice_i16", 784454.0, 37290152.0, 0),
    ("rice_i32", 778796542.0, 37268564296.0, 0),
    ("rice_u8", 71363.0, 3434017.0, 0),
    ("rice_f32", 716008.5390014648, 34006180.30419922, 0),
    ("gzip_u16", 784454.0, 37290152.0, 0),
    ("gzip_i16", 784454.0, 37290152.0, 0),
    ("gzip_i32", 778796542.0, 37268564296.0, 0),
    ("gzip_u8", 71363.0, 3434017.0, 0),
    ("gzip_f32", 716008.5390014648, 34006180.30419922, 0),
    ("gzip2_u16", 784454.0, 37290152.0, 0),
    ("gzip2_i16", 784454.0, 37290152.0, 0),
    ("gzip2_i32", 778796542.0, 37268564296.0, 0),
    ("gzip2_u8", 71363.0, 3434017.0, 0),
    ("gzip2_f32", 716008.5390014648, 34006180.30419922, 0),
    ("plio_i16", 784454.0, 37290152.0, 0),
    ("plio_i32", 784454.0, 37290152.0, 0),
    ("plio_u8", 71363.0, 3434017.0, 0),
    ("hcompress_u16", 784454.0, 37290152.0, 0),
    ("hcompress_i16", 784454.0, 37290152.0, 0),
    ("hcompress_i32", 778796542.0, 37268564296.0, 0),
    ("hcompress_u8", 71363.0, 3434017.0, 0),
    ("hcompress_f32", 716010.3294067383, 34006275.326416016, 0),
    ("nocompress_u16", 784454.0, 37290152.0, 0),
    ("nocompress_i16", 784454.0, 37290152.0, 0),
    ("nocompress_i32", 778796542.0, 37268564296.0, 0),
    ("nocompress_u8", 71363.0, 3434017.0, 0),
    ("rice_f32_exact_zeros", 692942.8182983398, 32673389.026489258, 0),
    ("rice_f32_no_dither", 716008.0960693359, 34006124.21160889, 0),
    ("rice_f32_nan", 710998.9460449219, 33991094.502075195, 5),
    ("rice_f64", 716007.3574829102, 34006090.862854004, 0),
    ("gzip_f32_lossless", 710999.061706543, 33991139.12609863, 5),
    ("gzip2_f64_lossless", 7.109990622804522e-25, 3.399113911127625e-23, 5),
    ("rice_f32_fallback", 685094.3335571289, 31717613.648986816, 0),
    ("rice_squares", 784454.0, 37290152.0, 0),
    ("gzip_whole", 784454.0, 37290152.0, 0),
    ("hcompress_squares", 784454.0, 37290152.0, 0),
    ("hcompress_lossy_smooth", 784335.0, 37285199.0, 0),
    ("hcompress_lossy", 784489.0, 37292658.0, 0),
    ("rice_cube", 784454.0, 37290152.0, 0),
    ("plain_u1", 71363.0, 3434017.0, 0),
    ("plain_i2", 784454.0, 37290152.0, 0),
    ("plain_i4", 5491962454.0, 261068354152.0, 0),
    ("plain_i8", 5491962454.0, 261068354152.0, 0),
    ("plain_f4", 5491962454.0, 261068354152.0, 0),
    ("plain_f8", 5491962454.0, 261068354152.0, 0),
    ("plain_u2", 784454.0, 37290152.0, 0),
    ("plain_u4", 54912564576.0, 2610347933128.0, 0),
    ("plain_u8", 54912564576.0, 2610347933128.0, 0),
    ("plain_i1", 43214.0, 2064032.0, 0),
    ("plain_scaled", 183400.75, 8727530.5, 1),
    ("plain_cube", 710999.061706543, 33991139.12609863, 5),
];

fn file(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/tiles")).join(format!("{name}.fits"))
}

/// All pixels of a file \[ADU\], whatever its header lacks.
fn pixels(path: &std::path::Path) -> Result<Vec<f32>, String> {
    let header = Header::read(path).map_err(|e| e.to_string())?;
    let frame = read(&anything(path, header), unit_gain(), None, None).map_err(|e| e.to_string())?;
    Ok(frame.pixels.iter().copied().collect())
}

#[test]
fn every_bitpix_and_every_compression_has_the_values_astropy_reads() {
    for (name, total, weighted, undefined) in BY_ASTROPY {
        let values = pixels(&file(name)).unwrap();
        assert_eq!(values.len(), 31 * 23, "{name}");
        let finite = || values.iter().enumerate().filter(|(_, v)| v.is_finite()).map(|(k, v)| (k, f64::from(*v)));
        let sum: f64 = finite().map(|(_, v)| v).sum();
        let weights: f64 = finite().map(|(k, v)| v * (1 + k % 97) as f64).sum();
        // exact but for the order of the sums, and for one rounding of f32 in dithered floats
        let rounding = if name.contains("f32") || name.contains("f64") { 3e-8 } else { 1e-12 };
        assert!((sum / total - 1.0).abs() < rounding, "{name}: {sum}, astropy {total}");
        assert!((weights / weighted - 1.0).abs() < rounding, "{name}: {weights}, astropy {weighted}");
        assert_eq!(values.len() - finite().count(), undefined, "{name}");
    }
}

#[test]
fn tiles_higher_than_a_band_give_the_values_astropy_reads_to_every_thread() {
    let by_astropy: [(&str, f64, f64); 5] = [
        ("tall_rice_u16", 3904220.0, 191398376.0),
        ("tall_squares_u16", 3904220.0, 191398376.0),
        ("tall_hcompress_u16", 3904220.0, 191398376.0),
        ("tall_gzip_f32", 488027.5, 23924797.0),
        ("tall_rice_f32", 488029.540309906, 23925054.025382996),
    ];
    for (name, total, weighted) in by_astropy {
        let path = file(name);
        let values = pixels(&path).unwrap();
        assert_eq!(values.len(), 24 * 150, "{name}");
        let sum: f64 = values.iter().map(|v| f64::from(*v)).sum();
        let weights: f64 = values.iter().enumerate().map(|(k, v)| f64::from(*v) * (1 + k % 97) as f64).sum();
        let rounding = if name.contains("rice_f32") { 3e-8 } else { 1e-12 };
        assert!((sum / total - 1.0).abs() < rounding, "{name}: {sum}, astropy {total}");
        assert!((weights / weighted - 1.0).abs() < rounding, "{name}: {weights}, astropy {weighted}");
        // many threads that read parts of several files at once
        let exposure = anything(&path, Header::read(&path).unwrap());
        std::thread::scope(|scope| {
            for k in 0..8 {
                let (exposure, values) = (&exposure, &values);
                scope.spawn(move || {
                    let part = satphot::frames::read_box(exposure, (k, 7 * k), (13, 90)).unwrap();
                    assert!((0..90).all(|j| part[13 * j] == values[(7 * k + j) * 24 + k]));
                });
            }
        });
        // a file that changes is decoded again; a damaged tile is an error, not an old picture
        let dir = tempfile::tempdir().unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        let copy = put(dir.path(), "copy.fits", &bytes);
        assert_eq!(pixels(&copy).unwrap(), values, "{name}");
        bytes.truncate(bytes.len() - 2880);
        let copy = put(dir.path(), "copy.fits", &bytes);
        assert!(pixels(&copy).is_err(), "{name}");
    }
}

#[test]
fn a_part_of_an_image_is_that_part_whatever_the_tiles() {
    for name in ["rice_u16", "rice_squares", "gzip_whole", "hcompress_squares", "rice_f32", "plain_i4", "plain_u2"] {
        let path = file(name);
        let whole = pixels(&path).unwrap();
        let exposure = anything(&path, Header::read(&path).unwrap());
        for ((x0, y0), (nx, ny)) in [((0, 0), (31, 23)), ((5, 6), (9, 3)), ((30, 22), (1, 1)), ((7, 0), (17, 23))] {
            let part = satphot::frames::read_box(&exposure, (x0, y0), (nx, ny)).unwrap();
            for (k, value) in part.iter().enumerate() {
                assert_eq!(*value, whole[(y0 + k / nx) * 31 + x0 + k % nx], "{name} at {k}");
            }
        }
        assert!(satphot::frames::read_box(&exposure, (25, 0), (7, 1)).is_err(), "{name}: beyond the edge");
    }
}

#[test]
fn right_checksums_are_silent_and_any_changed_bit_of_the_data_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    for (name, ..) in BY_ASTROPY {
        let path = file(name);
        let header = Header::read(&path).unwrap();
        assert_eq!(wrong_checksum(&path, &header).unwrap(), None, "{name}");
        let mut bytes = std::fs::read(&path).unwrap();
        // the last byte is padding, which belongs to the sum
        *bytes.last_mut().unwrap() ^= 4;
        let changed = put(dir.path(), &format!("{name}.fits"), &bytes);
        let message = wrong_checksum(&changed, &Header::read(&changed).unwrap()).unwrap().unwrap();
        assert!(message.contains("DATASUM"), "{name}: {message}");
        // a comment changed by hand: only the sum over header and data can tell
        let mut bytes = std::fs::read(&path).unwrap();
        let card = bytes.windows(9).rposition(|w| w == b"DATASUM =").unwrap();
        bytes[card + 60] ^= 1;
        let changed = put(dir.path(), &format!("{name}.fits"), &bytes);
        let message = wrong_checksum(&changed, &Header::read(&changed).unwrap()).unwrap().unwrap();
        assert!(message.contains("CHECKSUM is wrong"), "{name}: {message}");
    }
    let none = put(dir.path(), "none.fits", &fits(8, 2, 2, &light(), &[1; 4]));
    assert_eq!(wrong_checksum(&none, &Header::read(&none).unwrap()).unwrap(), None);
}

#[test]
fn a_damaged_tile_is_named_and_what_lies_elsewhere_is_still_read() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["rice_u16", "gzip_i32", "gzip2_i16", "plio_i16", "nocompress_u8"] {
        let bytes = std::fs::read(file(name)).unwrap();
        let header = Header::read(&file(name)).unwrap();
        let number = |key: &str| header.integer(key).unwrap() as usize;
        let heap = bytes.windows(8).rposition(|w| w == b"XTENSION").unwrap();
        let end = bytes[heap..].chunks(80).position(|c| c.starts_with(b"END     ")).unwrap() * 80 + heap;
        let table = (end + 80).div_ceil(2880) * 2880;
        // the descriptor of the tenth tile: its length, one element less or far too many
        for length in [1i32, i32::MAX, -5] {
            let mut bytes = bytes.clone();
            let at = table + 9 * number("NAXIS1");
            bytes[at..at + 4].copy_from_slice(&length.to_be_bytes());
            let path = put(dir.path(), "tile.fits", &bytes);
            let error = pixels(&path).unwrap_err();
            assert!(error.contains("tile 10 of 23") || error.contains("elements at byte"), "{name} {length}: {error}");
            let exposure = anything(&path, Header::read(&path).unwrap());
            satphot::frames::read_box(&exposure, (0, 11), (31, 5)).unwrap();
        }
    }
}

/// `FOLDER=path cargo test --test frames -- tiles:: --ignored --nocapture`: what becomes of every file of a folder.
#[test]
#[ignore = "prints, for files of one's own"]
fn every_file_of_a_folder() {
    let folder = std::env::var("FOLDER").unwrap();
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    for path in paths.iter().filter(|p| p.is_file()) {
        let name = path.file_name().unwrap().to_string_lossy();
        match pixels(path) {
            Ok(values) => {
                let finite: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)).collect();
                let header = Header::read(path).unwrap();
                let sums = wrong_checksum(path, &header).unwrap();
                println!(
                    "{name}\tHDU {}\t{:?}\t{}\t{}\t{sums:?}\t{:?}",
                    header.hdu_index(),
                    header.size_px(),
                    finite.iter().sum::<f64>(),
                    values.len() - finite.len(),
                    header.warnings()
                );
            }
            Err(e) => println!("{name}\t{e}"),
        }
    }
}
