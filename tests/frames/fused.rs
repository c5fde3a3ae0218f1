//! Reading in one pass against the same steps one by one: every storage, odd sizes, circle and flat, hopeless pixels.
#![allow(clippy::unwrap_used)]

use crate::frames_support;

use std::path::{Path, PathBuf};

use frames_support::*;
use ndarray::Array2;
use satphot::base::error::Error;
use satphot::fits::{write_f32, write_u16};
use satphot::frames::flat::MasterFlat;
use satphot::frames::{Buffers, ElectronsPerAdu, Exposure, FrameReader, Gain, mask};

/// Counts over the whole range of 16 bits.
fn counts(nx: usize, ny: usize) -> Array2<u16> {
    Array2::from_shape_fn((ny, nx), |(j, i)| match (j * nx + i) % 11 {
        0 => 0,
        1 => 65_535,
        2 => 60_000,
        3 => 59_999,
        _ => ((j * 7919 + i * 104_729) % 65_536) as u16,
    })
}

fn gain() -> Gain {
    Gain { e_per_adu: ElectronsPerAdu(0.7654321), pedestal_adu: 500.3, saturation_adu: 60_000.0, ..unit_gain() }
}

/// The steps one by one, in plain loops: raw pixels, mask, electrons, flat, circle. Values and bits of a pixel.
fn plain(raw: &Array2<f32>, gain: &Gain, flat: Option<&Array2<f32>>, radius_px: Option<f64>) -> Array2<(f32, u8)> {
    let (ny, nx) = raw.dim();
    let (cx, cy) = ((nx as f64 - 1.0) / 2.0, (ny as f64 - 1.0) / 2.0);
    Array2::from_shape_fn((ny, nx), |(j, i)| {
        let outside = radius_px.is_some_and(|r| (i as f64 - cx).powi(2) + (j as f64 - cy).powi(2) > r * r);
        if outside {
            return (f32::NAN, mask::CLIPPED);
        }
        let n_adu = raw[[j, i]];
        if !n_adu.is_finite() {
            return (f32::NAN, mask::BAD);
        }
        let mut bits = if n_adu >= gain.saturation_adu as f32 { mask::SATURATED } else { 0 };
        let mut n = (gain.e_per_adu.0 * (f64::from(n_adu) - gain.pedestal_adu)) as f32;
        match flat.map(|f| f[[j, i]]) {
            Some(f) if f.is_nan() => bits |= mask::BAD,
            Some(f) => n /= f,
            None => {}
        }
        (n, bits)
    })
}

/// One exposure of each storage with its pixels as they should be read.
fn storages(dir: &Path, nx: usize, ny: usize) -> Vec<(&'static str, PathBuf, Array2<f32>)> {
    let whole = counts(nx, ny);
    let floats = whole.indexed_iter().map(|((j, i), v)| match (j * nx + i) % 13 {
        5 => f32::NAN,
        6 => f32::INFINITY,
        _ => 0.37 * f32::from(*v) - 100.0,
    });
    let floats = Array2::from_shape_vec((ny, nx), floats.collect()).unwrap();
    let cards = [text("IMAGETYP", "LIGHT"), text("OBJECT", "ISS")];
    let more: Vec<String> =
        light().into_iter().filter(|c| !c.starts_with("OBJECT") && !c.starts_with("IMAGETYP")).chain(cards).collect();
    let path = |name: &str| dir.join(name);
    let as_cards: Vec<_> = [("IMAGETYP", "LIGHT"), ("DATE-OBS", "2025-06-09T10:33:00.500"), ("OBJECT", "ISS")]
        .map(|(k, v)| (k.to_string(), satphot::fits::CardValue::Text(v.into()), String::new()))
        .into_iter()
        .chain([("EXPTIME".to_string(), satphot::fits::CardValue::Real(5.0), String::new())])
        .collect();
    write_u16(&path("u16.fits"), &whole, &as_cards, false).unwrap();
    write_u16(&path("u16.fits.fz"), &whole, &as_cards, true).unwrap();
    write_f32(&path("f32.fits"), &floats, &as_cards).unwrap();
    let bytes: Vec<u8> = whole.iter().flat_map(|v| (i32::from(*v) * 3).to_be_bytes()).collect();
    put(dir, "i32.fits", &fits(32, nx, ny, &more, &bytes));
    vec![
        ("u16", path("u16.fits"), whole.mapv(f32::from)),
        ("rice", path("u16.fits.fz"), whole.mapv(f32::from)),
        ("f32", path("f32.fits"), floats),
        ("i32", path("i32.fits"), whole.mapv(|v| f32::from(v) * 3.0)),
    ]
}

/// A master flat with masked pixels, as read back from a file.
fn master(dir: &Path, nx: usize, ny: usize) -> (MasterFlat, Array2<f32>) {
    let response = Array2::from_shape_fn((ny, nx), |(j, i)| match (3 * j + 5 * i) % 17 {
        4 => 0.0,
        k => 0.8 + 0.025 * k as f32,
    });
    write_f32(&dir.join("master.fits"), &response, &[]).unwrap();
    let flat = MasterFlat::read(&dir.join("master.fits"), None, &config(&[]).flat).unwrap();
    let response = flat.response.clone();
    assert!(nx * ny < 20 || response.iter().any(|v| v.is_nan()) && response.iter().any(|v| v.is_finite()));
    (flat, response)
}

#[test]
fn one_pass_is_bit_for_bit_the_steps_one_by_one() {
    for (nx, ny) in [(131, 97), (64, 200), (1, 1), (300, 3), (7, 130)] {
        let dir = tempfile::tempdir().unwrap();
        let (flat, response) = master(dir.path(), nx, ny);
        for (name, path, raw) in storages(dir.path(), nx, ny) {
            let exposure = exposure(&path);
            for radius_px in [None, Some(40.0), Some(12.5), Some(0.8)] {
                for flat in [None, Some((&flat, &response))] {
                    let what = format!("{name} {nx}x{ny} circle {radius_px:?} flat {}", flat.is_some());
                    let expected = plain(&raw, &gain(), flat.map(|f| f.1), radius_px);
                    compare(&exposure, radius_px, flat.map(|f| f.0), &expected, &what);
                }
            }
        }
    }
}

/// The box of the circle, and rectangles of it read alone, on one thread and on several, with memory used before.
fn compare(
    exposure: &Exposure,
    radius_px: Option<f64>,
    flat: Option<&MasterFlat>,
    expected: &Array2<(f32, u8)>,
    what: &str,
) {
    let buffers = Buffers::default();
    let reader = FrameReader::open(exposure, gain(), radius_px, flat).unwrap();
    let (columns, rows) = reader.box_px();
    let parts = [
        (columns.clone(), rows.clone()),
        (columns.start..columns.start + columns.len().div_ceil(2), rows.clone()),
        (columns.start + columns.len() / 3..columns.end + 5, rows.start + rows.len() / 2..rows.end),
    ];
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        for (columns, rows) in parts.clone() {
            let frame = pool.install(|| reader.part(columns, rows, &buffers).unwrap());
            let (x0, y0) = frame.origin_px;
            for ((j, i), value) in frame.pixels.indexed_iter() {
                let (n, bits) = expected[[y0 + j, x0 + i]];
                let same = value.to_bits() == n.to_bits() || value.is_nan() && n.is_nan();
                assert!(
                    same && frame.mask[[j, i]] == bits,
                    "{what}: {value} {} not {n} {bits} at ({i}, {j})",
                    frame.mask[[j, i]]
                );
            }
        }
    }
    // everything inside the circle is in the box
    let kept = expected.iter().filter(|(_, bits)| bits & mask::CLIPPED == 0).count();
    let whole = reader.whole(&buffers).unwrap();
    if kept > 0 {
        assert_eq!(whole.mask.iter().filter(|bits| **bits & mask::CLIPPED == 0).count(), kept, "{what}");
    }
}

#[test]
fn a_rectangle_outside_the_circle_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = &storages(dir.path(), 100, 100)[0].1;
    let exposure = exposure(path);
    let reader = FrameReader::open(&exposure, gain(), Some(20.0), None).unwrap();
    let error = reader.part(0..10, 0..100, &Buffers::default()).unwrap_err();
    assert!(matches!(error, Error::Fits { .. }) && error.to_string().contains("outside the clip circle"), "{error}");
}

#[test]
fn a_file_that_became_shorter_or_vanished_is_reported_with_its_name() {
    let dir = tempfile::tempdir().unwrap();
    for (name, path, _) in storages(dir.path(), 150, 120) {
        let exposure = exposure(&path);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let error = read(&exposure, gain(), Some(40.0), None).unwrap_err().to_string();
        assert!(error.contains(path.file_name().unwrap().to_str().unwrap()), "{name}: {error}");
        std::fs::remove_file(&path).unwrap();
        let error = read(&exposure, gain(), Some(40.0), None).unwrap_err().to_string();
        assert!(error.contains(path.file_name().unwrap().to_str().unwrap()), "{name}: {error}");
    }
}
