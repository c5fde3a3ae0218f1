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
