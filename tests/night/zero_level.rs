//! Biases and darks: a camera with a pattern in its bias and with hot pixels gives the magnitudes of one without.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::Path;

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use satphot::fits::{card, write_u16};
use satphot::tables::PhotometryRow;

use crate::support::Night;

const PEDESTAL_ADU: f64 = 500.0;
const DARK_S: f64 = 60.0;

fn demo() -> Night {
    Night::copy_of(&Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/night")).set("night.name=\"tiny\"")
}

/// The value of a card, without quotes.
fn text(bytes: &[u8], key: &str) -> String {
    let at = bytes.chunks(80).find(|c| c.starts_with(format!("{key:<8}=").as_bytes())).unwrap();
    let value = String::from_utf8_lossy(&at[10..]).split('/').next().unwrap().trim().to_owned();
    value.trim_matches('\'').trim().to_owned()
}

/// Bias pattern \[ADU\] and dark current \[ADU/s\] of a pixel: columns that differ, and one pixel in a hundred that is hot.
fn pattern(x: usize, y: usize) -> (f64, f64) {
    let column = 40.0 + 25.0 * (x as f64 / 3.0).sin();
    let n = (x * 7919 + y * 104_729) % 1009;
    (column, if n < 10 { 30.0 + 10.0 * n as f64 } else { 0.0 })
}

/// The demonstration night seen by that camera.
fn patterned() -> Night {
    let night = demo();
    for kind in ["flat", "field", "target"] {
        for path in night.frames(kind) {
            let bytes = std::fs::read(&path).unwrap();
            let number = |key: &str| text(&bytes, key).parse::<f64>().unwrap();
            let (nx, exptime_s) = (number("NAXIS1") as usize, number("EXPTIME"));
            let end = bytes.chunks(80).position(|c| c.starts_with(b"END     ")).unwrap();
            let data = ((end + 1) * 80).div_ceil(2880) * 2880;
            let mut out = bytes.clone();
            let n = nx * number("NAXIS2") as usize;
            for k in 0..n {
                let at = data + 2 * k;
                let stored = i16::from_be_bytes([bytes[at], bytes[at + 1]]);
                let (bias, rate) = pattern(k % nx, k / nx);
                let more = (bias + rate * exptime_s).round() as i16;
                out[at..at + 2].copy_from_slice(&stored.saturating_add(more).to_be_bytes());
            }
            std::fs::write(&path, out).unwrap();
        }
    }
    night
}

/// Adds `n` frames without light of this exposure time.
fn without_light(night: &Night, (kind, gain): (&str, i64), n: usize, exptime_s: f64, seed: u64) {
    let first = std::fs::read(&night.frames("target")[0]).unwrap();
    let size = |key: &str| text(&first, key).parse::<usize>().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for k in 0..n {
        let pixels = Array2::from_shape_fn((size("NAXIS2"), size("NAXIS1")), |(y, x)| {
            let (bias, rate) = pattern(x, y);
            let noise: f64 = (0..12).map(|_| rng.random::<f64>() - 0.5).sum();
            (PEDESTAL_ADU + bias + rate * exptime_s + 6.0 * noise).round() as u16
        });
        let cards = [
            card("IMAGETYP", kind, ""),
            card("EXPTIME", exptime_s, ""),
            card("GAIN", gain, ""),
            card("XBINNING", text(&first, "XBINNING").parse::<i64>().unwrap(), ""),
            card("YBINNING", text(&first, "XBINNING").parse::<i64>().unwrap(), ""),
        ];
        write_u16(&night.path(&format!("{}_{gain}_{k}.fits", kind.to_lowercase())), &pixels, &cards, false).unwrap();
    }
}

/// The same for every gain setting of the night.
fn each_gain(night: &Night, kind: &str, n: usize, exptime_s: f64, seed: u64) {
    let frames = ["field", "target"].into_iter().flat_map(|kind| night.frames(kind));
    let gain = |path: std::path::PathBuf| text(&std::fs::read(path).unwrap(), "GAIN").parse::<i64>().unwrap();
    let gains: std::collections::BTreeSet<i64> = frames.map(gain).collect();
    gains.into_iter().for_each(|gain| without_light(night, (kind, gain), n, exptime_s, seed + gain as u64));
}

/// Largest difference of the magnitudes of two reductions in units of the random error, and how many frames both have.
fn largest(a: &[PhotometryRow], b: &[PhotometryRow]) -> (f64, usize) {
    let of = |(a, b): (&PhotometryRow, &PhotometryRow)| Some((a.v_mag? - b.v_mag?).abs() / a.v_mag_err?.max(0.01));
    let pairs: Vec<f64> = a.iter().zip(b).filter(|(a, b)| a.frame == b.frame).filter_map(of).collect();
    (pairs.iter().copied().fold(0.0, f64::max), pairs.len())
}

#[test]
fn a_pattern_in_the_bias_and_hot_pixels_are_subtracted() {
    let clean = demo();
    clean.run().unwrap();
    let night = patterned();
    each_gain(&night, "Bias", 15, 0.0, 1);
    each_gain(&night, "Dark", 5, DARK_S, 2);
    let summary = night.run().unwrap();
    let rows = night.rows();
    let (worst, n) = largest(&rows, &clean.rows());
    // a median of 15 has a third of the noise of a frame, which enters each pixel of the faint targets
    assert!(n >= 22 && worst < 1.0, "{n} frames, worst {worst}");
    let zero: Vec<&str> = rows.iter().map(|r| r.zero_level.as_str()).collect();
    assert!(zero.iter().all(|z| z.starts_with("bias of 15, dark of 5 x 60 s times 0.0")), "{zero:?}");
    assert!(summary.notes.iter().any(|n| n.contains("but detector.pedestal_adu = 500")), "{:?}", summary.notes);
    // without them, the pattern is in the magnitudes
    let without = patterned().set("frames.skip_bias_dark=true");
    each_gain(&without, "Bias", 15, 0.0, 1);
    without.run().unwrap();
    assert!(without.rows().iter().all(|r| r.zero_level == "pedestal"));
    let (left, _) = largest(&without.rows(), &clean.rows());
    assert!(left > 1.5 * worst, "{left} {worst}");
}

#[test]
fn frames_without_light_that_do_not_belong_to_the_night_are_named_and_not_used() {
    let night = demo();
    // the same camera at another gain: plausible, and wrong
    without_light(&night, ("Bias", 77), 5, 0.0, 3);
    let summary = night.run().unwrap();
    assert!(night.rows().iter().all(|r| r.zero_level == "pedestal"));
    let said = |words: &str| summary.notes.iter().any(|note| note.contains(words));
    assert!(said("5 bias and dark frames match no light frame"), "{:?}", summary.notes);
    // two biases are too few, a dark without biases must be as long as the frames
    let night = demo();
    each_gain(&night, "Bias", 2, 0.0, 4);
    each_gain(&night, "Dark", 4, DARK_S, 5);
    let summary = night.run().unwrap();
    assert!(night.rows().iter().all(|r| r.zero_level == "pedestal"));
    let said = |words: &str| summary.notes.iter().any(|note| note.contains(words));
    assert!(said("2 bias frames are too few") && said("dark frames are not used"), "{:?}", summary.notes);
}

#[test]
fn frames_without_light_that_vanish_or_shrink_are_skipped_by_name() {
    use satphot::frames::{Exposure, ZeroLevels, classify};
    let night = demo();
    each_gain(&night, "Bias", 6, 0.0, 6);
    let config = night.config().unwrap();
    let classified = |kind: &str| -> Vec<Exposure> {
        night.frames(kind).iter().map(|path| classify(path, &config, &["ISS".into()]).unwrap()).collect()
    };
    let (biases, lights) = (classified("bias_"), classified("target"));
    let whole = ZeroLevels::make(&biases.iter().collect::<Vec<_>>(), &lights.iter().collect::<Vec<_>>(), None);
    assert!(lights.iter().all(|light| whole.of(light).unwrap().from == "bias of 6"), "{:?}", whole.notes);
    std::fs::remove_file(&biases[1].path).unwrap();
    std::fs::OpenOptions::new().write(true).open(&biases[4].path).unwrap().set_len(20_000).unwrap();
    let zero = ZeroLevels::make(&biases.iter().collect::<Vec<_>>(), &lights.iter().collect::<Vec<_>>(), None);
    for k in [1, 4] {
        let words = format!("{} is not used as bias", biases[k].name);
        assert!(zero.notes.iter().any(|note| note.contains(&words)), "{words}: {:?}", zero.notes);
    }
    // those of their gain setting lack two; the others are as they were
    for light in &lights {
        let gone = [1, 4].iter().filter(|k| biases[**k].setting == light.setting).count();
        assert_eq!(zero.of(light).unwrap().from, format!("bias of {}", 6 - gone), "{}", light.name);
    }
}

/// Columns without light at each side.
const DARK_PX: usize = 12;

/// The demonstration night from a chip with an overscan at both sides, whose bias level drifts from frame to frame; `trimsec` are
/// further cards, of the width of the lit part and the height.
fn overscanned(cards: impl Fn(usize, usize) -> Vec<(&'static str, String)>) -> Night {
    let night = demo();
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let paths: Vec<_> = ["flat", "field", "target"].iter().flat_map(|kind| night.frames(kind)).collect();
    for (k, path) in paths.iter().enumerate() {
        let bytes = std::fs::read(path).unwrap();
        let (nx, ny) =
            (text(&bytes, "NAXIS1").parse::<usize>().unwrap(), text(&bytes, "NAXIS2").parse::<usize>().unwrap());
        let end = bytes.chunks(80).position(|c| c.starts_with(b"END     ")).unwrap();
        let data = ((end + 1) * 80).div_ceil(2880) * 2880;
        let drift = 300.0 + 7.3 * (k % 11) as f64;
        let wide = nx + 2 * DARK_PX;
        let mut out: Vec<u8> = Vec::new();
        for card in bytes[..end * 80].chunks(80) {
            let key = String::from_utf8_lossy(&card[..8]).trim().to_owned();
            let value = match key.as_str() {
                "NAXIS1" => Some(wide as f64),
                "CRPIX1" => Some(text(&bytes, "CRPIX1").parse::<f64>().unwrap() + DARK_PX as f64),
                "CHECKSUM" | "DATASUM" => continue,
                _ => None,
            };
            match value {
                Some(v) => out.extend(format!("{:<80}", format!("{key:<8}= {v:>20}")).bytes()),
                None => out.extend(card),
            }
        }
        for (key, value) in cards(nx, ny) {
            out.extend(format!("{:<80}", format!("{key:<8}= '{value}'")).bytes());
        }
        out.extend(format!("{:<80}", "END").bytes());
        out.resize(out.len().div_ceil(2880) * 2880, b' ');
        for row in bytes[data..data + 2 * nx * ny].chunks(2 * nx) {
            let mut dark = |out: &mut Vec<u8>| {
                for _ in 0..DARK_PX {
                    let noise: f64 = (0..12).map(|_| rng.random::<f64>() - 0.5).sum();
                    let adu = (PEDESTAL_ADU + drift + 5.0 * noise).round() as i32;
                    out.extend(((adu - 32_768) as i16).to_be_bytes());
                }
            };
            dark(&mut out);
            for pixel in row.chunks(2) {
                let stored = i16::from_be_bytes([pixel[0], pixel[1]]);
                out.extend(stored.saturating_add(drift.round() as i16).to_be_bytes());
            }
            dark(&mut out);
        }
        out.resize(out.len().div_ceil(2880) * 2880, 0);
        std::fs::write(path, out).unwrap();
    }
    night
}

fn right_sections(nx: usize, ny: usize) -> Vec<(&'static str, String)> {
    vec![
        ("BIASSEC", format!("[1:{DARK_PX},1:{ny}]")),
        ("TRIMSEC", format!("[{}:{},1:{ny}]", DARK_PX + 1, nx + DARK_PX)),
    ]
}

#[test]
fn the_overscan_of_each_frame_is_its_bias_level_and_is_not_measured() {
    let clean = demo();
    clean.run().unwrap();
    let night = overscanned(right_sections);
    let summary = night.run().unwrap();
    let rows = night.rows();
    assert!(rows.iter().filter(|r| r.v_mag.is_some()).all(|r| r.zero_level.starts_with("overscan at ")), "{rows:?}");
    assert!(
        summary.notes.iter().any(|n| n.contains("of its overscan (8") || n.contains("of its overscan (7")),
        "{:?}",
        summary.notes
    );
    let clean = clean.rows();
    for (a, b) in rows.iter().zip(&clean) {
        // the drift of the bias level is 0 to 73 ADU, 18 e-
        if let (Some(x), Some(y)) = (a.sky_e_px, b.sky_e_px) {
            assert!((x - y).abs() < 0.2 + 0.005 * y, "{}: sky {x} {y}", a.frame);
        }
        // outlines of faint targets follow the noise of the background, whose mesh begins elsewhere
        if let (Some(x), Some(y)) = (a.v_mag.filter(|_| b.v_mag_err.is_some_and(|e| e < 0.03)), b.v_mag) {
            assert!((x - y).abs() < 0.02, "{}: {x} {y}", a.frame);
        }
    }
    // the columns without light are no sky: they are neither measured nor in a background
    let corner = |r: &PhotometryRow| r.sky_corner_ratio;
    let pairs: Vec<_> = rows.iter().zip(&clean).filter_map(|(a, b)| corner(a).zip(corner(b))).collect();
    assert!(pairs.iter().all(|(a, b)| (a - b).abs() < 0.1), "{pairs:?}");
    // 300 to 373 ADU of bias level that are taken for light, and divided by a flat that they are in too
    let without = overscanned(right_sections).set("detector.use_overscan=false");
    without.run().unwrap();
    assert!(without.rows().iter().all(|r| r.zero_level == "pedestal"));
    // biases know more than the overscan: the pattern of columns
    let night = overscanned(right_sections);
    each_gain(&night, "Bias", 5, 0.0, 9);
    night.run().unwrap();
    let zero: Vec<String> = night.rows().into_iter().map(|r| r.zero_level).collect();
    assert!(zero.iter().all(|z| z == "bias of 5"), "{zero:?}");
}

#[test]
fn sections_that_a_program_left_behind_are_named_and_not_used() {
    type Cards = fn(usize, usize) -> Vec<(&'static str, String)>;
    let wrong: [(Cards, &str); 4] = [
        // cut to the lit part, with the sections of the whole chip
        (
            |_, ny| vec![("BIASSEC", format!("[1:10,1:{ny}]")), ("TRIMSEC", format!("[11:5000,1:{ny}]"))],
            "the frame was cut",
        ),
        (|nx, ny| vec![("BIASSEC", format!("[{}:{},1:{ny}]", nx - 20, nx))], "light falls on it"),
        (|nx, ny| vec![("BIASSEC", format!("[1:12,1:{ny}]")), ("DATASEC", format!("[10:{nx},1:{ny}]"))], "overlaps"),
        (|_, _| vec![("BIASSEC", "[N/A]".into())], "BIASSEC = [N/A] is no part of"),
    ];
    for (cards, words) in wrong {
        let night = overscanned(cards);
        let summary = night.run().unwrap();
        assert!(
            summary.notes.iter().any(|n| n.starts_with("warning: ") && n.contains(words)),
            "{words}: {:?}",
            summary.notes
        );
        assert!(night.rows().iter().all(|r| r.zero_level == "pedestal"), "{words}");
    }
}

/// A pixel in 200 is hot at 50 to 950 e-/s (GAIN 0 of the demonstration: about 0.8 e-/ADU), as a camera without darks has them.
fn hot(x: usize, y: usize) -> f64 {
    let n = (x * 7919 + y * 104_729) % 2003;
    if n < 10 { 300.0 + 500.0 * n as f64 } else { 0.0 }
}

pub fn with_hot_pixels(night: Night) -> Night {
    for path in ["field", "target"].into_iter().flat_map(|kind| night.frames(kind)) {
        let mut bytes = std::fs::read(&path).unwrap();
        let number = |key: &str| text(&bytes, key).parse::<f64>().unwrap();
        let (nx, ny, exptime_s) = (number("NAXIS1") as usize, number("NAXIS2") as usize, number("EXPTIME"));
        let end = bytes.chunks(80).position(|c| c.starts_with(b"END     ")).unwrap();
        let data = ((end + 1) * 80).div_ceil(2880) * 2880;
        for k in 0..nx * ny {
            let at = data + 2 * k;
            let stored = i16::from_be_bytes([bytes[at], bytes[at + 1]]);
            let more = (hot(k % nx, k / nx) * exptime_s).min(30_000.0).round() as i16;
            bytes[at..at + 2].copy_from_slice(&stored.saturating_add(more).to_be_bytes());
        }
        std::fs::write(&path, bytes).unwrap();
    }
    night
}

#[test]
fn hot_pixels_are_found_by_the_star_frames_of_a_night_without_darks() {
    let clean = demo();
    clean.run().unwrap();
    assert!(clean.rows().iter().all(|r| r.zero_level == "pedestal"), "stars are no hot pixels");
    let night = with_hot_pixels(demo());
    let summary = night.run().unwrap();
    let notes = |s: &str| summary.notes.iter().any(|n| n.contains(s));
    assert!(notes("hot pixels of") && notes("detector.mask_hot_pixels"), "{:?}", summary.notes);
    let rows = night.rows();
    assert!(rows.iter().all(|r| r.zero_level.contains("hot pixels of")), "{rows:?}");
    let (worst, n) = largest(&rows, &clean.rows());
    let kept = with_hot_pixels(demo()).set("detector.mask_hot_pixels=false");
    kept.run().unwrap();
    let (left, _) = largest(&kept.rows(), &clean.rows());
    // the stars of the zeropoint and the outlines of faint targets move within their errors
    assert!(n >= 22 && worst < 2.5 && left > 4.0 * worst, "{n} frames, worst {worst}, without {left}");
}

#[test]
fn stars_of_one_field_that_is_taken_again_are_no_hot_pixels() {
    let night = demo();
    let fields = night.frames("field");
    let first = std::fs::read(&fields[0]).unwrap();
    fields.iter().for_each(|path| std::fs::remove_file(path).unwrap());
    let date = text(&first, "DATE-OBS");
    let at = first.windows(date.len()).position(|w| w == date.as_bytes()).unwrap();
    for k in 0..5 {
        let mut bytes = first.clone();
        let minutes = format!("{:02}", 10 * k + 5);
        bytes[at + 14..at + 16].copy_from_slice(minutes.as_bytes());
        std::fs::write(fields[0].with_file_name(format!("field_again_{k}.fits")), bytes).unwrap();
    }
    night.run().unwrap();
    let rows = night.rows();
    assert!(rows.len() > 20 && rows.iter().all(|r| r.zero_level == "pedestal"), "{:?}", rows[0].zero_level);
}
