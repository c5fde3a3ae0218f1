//! The master flat: median against a plain sort, nothing divided by zero, rejections with reasons, back bit for bit.
#![allow(clippy::unwrap_used)]

use crate::frames_support;

use std::path::Path;

use frames_support::*;
use ndarray::Array2;
use satphot::config::FlatScale;
use satphot::fits::{CardValue, write_f32, write_u16};
use satphot::frames::flat::{BAND_BYTES, MasterFlat};
use satphot::frames::{Detector, Exposure, classify, mask};

const PEDESTAL: f64 = 500.0;

fn detector() -> Detector {
    Detector::from_config(&config(&[]).detector).unwrap()
}

fn flat_cards() -> Vec<(String, CardValue, String)> {
    vec![
        ("IMAGETYP".into(), CardValue::Text("FLAT".into()), String::new()),
        ("EXPTIME".into(), CardValue::Real(1.0), String::new()),
        ("GAIN".into(), CardValue::Integer(0), String::new()),
    ]
}

fn flat(dir: &Path, name: &str, pixels: &Array2<u16>, compress: bool) -> Exposure {
    let path = dir.join(name);
    write_u16(&path, pixels, &flat_cards(), compress).unwrap();
    classify(&path, &config(&[]), &[]).unwrap()
}

/// A vignetted sky of the given level with reproducible noise.
fn sky(nx: usize, ny: usize, level: f64, seed: u64) -> Array2<u16> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    Array2::from_shape_fn((ny, nx), |(j, i)| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        let noise = (state >> 40) as f64 / 2f64.powi(24) - 0.5;
        let r2 = (i as f64 - nx as f64 / 2.0).powi(2) + (j as f64 - ny as f64 / 2.0).powi(2);
        (PEDESTAL + level * (1.0 - 0.3 * r2 / (nx * ny) as f64) * (1.0 + 0.05 * noise)) as u16
    })
}

fn median(mut v: Vec<f64>) -> f64 {
    v.sort_by(f64::total_cmp);
    (v[(v.len() - 1) / 2] + v[v.len() / 2]) / 2.0
}

#[test]
fn the_master_is_the_median_of_the_scaled_flats_by_a_plain_sort() {
    let dir = tempfile::tempdir().unwrap();
    let (nx, ny) = (70, 150);
    for n in [3, 6, 9] {
        let frames: Vec<Array2<u16>> =
            (0..n).map(|k| sky(nx, ny, 20_000.0 + 1_500.0 * k as f64, k as u64 + 1)).collect();
        let flats: Vec<Exposure> =
            frames.iter().enumerate().map(|(k, f)| flat(dir.path(), &format!("{n}_{k}.fits"), f, k % 2 == 1)).collect();
        let master = MasterFlat::make(&flats, &detector(), &config(&[]).flat, None, BAND_BYTES).unwrap();
        let levels: Vec<f64> =
            frames.iter().map(|f| median(f.iter().map(|v| f64::from(*v)).collect()) - PEDESTAL).collect();
        for (m, l) in master.members.iter().zip(&levels) {
            assert!(m.used && (m.level_adu - l).abs() < 1e-9, "{m:?} against {l}");
        }
        let plain = Array2::from_shape_fn((ny, nx), |at| {
            median(frames.iter().zip(&levels).map(|(f, l)| (f64::from(f[at]) - PEDESTAL) / l).collect())
        });
        let norm = median(plain.iter().copied().collect());
        for (at, v) in plain.indexed_iter() {
            // f32 arithmetic: four roundings.
            assert!((f64::from(master.response[at]) - v / norm).abs() < 4e-7, "{at:?}");
        }
        assert_eq!(master.masked_frac, 0.0);
        let whole = median(master.response.iter().map(|v| f64::from(*v)).collect());
        assert!((whole - 1.0).abs() < 1e-7, "the median of the master is 1, not {whole}");
    }
}

#[test]
fn zero_low_and_saturated_pixels_are_masked_or_excluded_and_never_divided_by() {
    let dir = tempfile::tempdir().unwrap();
    let flats: Vec<Exposure> = (0..5)
        .map(|k| {
            let mut f = sky(40, 40, 20_000.0, k + 1);
            f[[3, 3]] = 0; // dead
            f[[4, 4]] = PEDESTAL as u16; // exactly zero response
            f[[5, 5]] = (PEDESTAL + 2_000.0) as u16; // 0.1 of the level
            f[[6, 6]] = 65_535; // hot in all
            f[[7, 7]] = if k < 2 { 65_535 } else { (PEDESTAL + 20_000.0) as u16 }; // hot in two of five
            f[[8, 8]] = if k < 3 { 65_535 } else { (PEDESTAL + 20_000.0) as u16 }; // hot in most
            flat(dir.path(), &format!("{k}.fits"), &f, false)
        })
        .collect();
    let master = MasterFlat::make(&flats, &detector(), &config(&[]).flat, None, BAND_BYTES).unwrap();
    for at in [[3, 3], [4, 4], [5, 5], [6, 6], [8, 8]] {
        assert!(master.response[at].is_nan(), "{at:?}");
    }
    assert!((master.response[[7, 7]] - 1.0).abs() < 0.05);
    assert!((master.masked_frac - 5.0 / 1600.0).abs() < 1e-12);
    let science = flat(dir.path(), "science.fits", &sky(40, 40, 10_000.0, 9), false);
    let frame = read(&science, unit_gain(), None, Some(&master)).unwrap();
    assert!(frame.pixels.iter().all(|v| v.is_finite()), "nothing was divided by zero or NaN");
    assert_eq!(frame.mask[[3, 3]], mask::BAD);
    assert!(!frame.all_bad());
}

#[test]
fn unusable_flats_are_rejected_with_a_reason_and_too_few_stop_the_night() {
    let dir = tempfile::tempdir().unwrap();
    let mut flats: Vec<Exposure> =
        (0..3).map(|k| flat(dir.path(), &format!("good{k}.fits"), &sky(30, 20, 20_000.0, k + 1), false)).collect();
    flats.push(flat(dir.path(), "dark.fits", &Array2::from_shape_fn((20, 30), |(_, x)| 510 + (x % 2) as u16), false));
    flats.push(flat(dir.path(), "bright.fits", &Array2::from_elem((20, 30), 65_535), false));
    flats.push(flat(dir.path(), "zero.fits", &Array2::zeros((20, 30)), false));
    flats.push(flat(dir.path(), "small.fits", &sky(20, 20, 20_000.0, 4), false));
    let path = dir.path().join("nan.fits");
    write_f32(&path, &Array2::from_elem((20, 30), f32::NAN), &flat_cards()).unwrap();
    flats.push(classify(&path, &config(&[]), &[]).unwrap());
    let gone = flat(dir.path(), "gone.fits", &sky(30, 20, 20_000.0, 4), false);
    std::fs::remove_file(&gone.path).unwrap();
    flats.push(gone);
    let master = MasterFlat::make(&flats, &detector(), &config(&[]).flat, None, BAND_BYTES).unwrap();
    let used: Vec<bool> = master.members.iter().map(|m| m.used).collect();
    assert_eq!(used, [true, true, true, false, false, false, false, false, false]);
    for (m, word) in
        master.members[3..].iter().zip(["level 10", "outside", "never filled", "20x20", "no finite pixel", "gone.fits"])
    {
        assert!(m.reason.contains(word), "{m:?}");
    }
    let e = MasterFlat::make(&flats[2..], &detector(), &config(&[]).flat, None, BAND_BYTES).unwrap_err();
    assert!(
        e.exit_code() == 5 && e.to_string().contains("1 of 7 flats are usable") && e.to_string().contains("dark.fits"),
        "{e}"
    );
    let e = MasterFlat::make(&[], &detector(), &config(&[]).flat, None, BAND_BYTES).unwrap_err();
    assert!(e.to_string().contains("no flat was found"), "{e}");
}

#[test]
fn a_master_comes_back_bit_for_bit_and_only_where_it_fits() {
    let dir = tempfile::tempdir().unwrap();
    let flats: Vec<Exposure> = (0..4)
        .map(|k| {
            let mut f = sky(61, 50, 20_000.0, k + 1);
            f[[25, 30]] = 0;
            flat(dir.path(), &format!("{k}.fits"), &f, false)
        })
        .collect();
    let c = config(&[]);
    let path = dir.path().join("master_flat.fits");
    for clip in [None, Some(20.0)] {
        let made = MasterFlat::make(&flats, &detector(), &c.flat, clip, BAND_BYTES).unwrap();
        made.write(&path).unwrap();
        let back = MasterFlat::read(&path, clip, &c.flat).unwrap();
        let bits = |m: &MasterFlat| m.response.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&made), bits(&back));
        assert_eq!((made.origin_px, made.full_size_px), (back.origin_px, back.full_size_px));
        assert_eq!(made.masked_frac, back.masked_frac);
    }
    let e = MasterFlat::read(&path, Some(24.0), &c.flat).unwrap_err().to_string();
    assert!(e.contains("clip_radius_px"), "a clipped master does not cover a larger circle: {e}");
    // A frame of another size names both.
    let master = MasterFlat::read(&path, Some(20.0), &c.flat).unwrap();
    let other = flat(dir.path(), "other.fits", &sky(60, 50, 1_000.0, 1), false);
    let e = read(&other, unit_gain(), Some(20.0), Some(&master)).unwrap_err().to_string();
    assert!(e.contains("60x50") && e.contains("61x50") && e.contains("other.fits"), "{e}");
    // Another program's master, with another normalisation.
    let foreign = dir.path().join("foreign.fits");
    write_f32(&foreign, &Array2::from_shape_fn((9, 9), |(j, i)| if i == 0 && j == 0 { 0.0 } else { 20_000.0 }), &[])
        .unwrap();
    let m = MasterFlat::read(&foreign, None, &c.flat).unwrap();
    assert!(m.response[[0, 0]].is_nan());
    assert_eq!(m.response[[4, 4]], 1.0);
    write_f32(&foreign, &Array2::zeros((9, 9)), &[]).unwrap();
    assert!(MasterFlat::read(&foreign, None, &c.flat).unwrap_err().to_string().contains("not positive"));
}

#[test]
fn the_master_does_not_depend_on_threads_or_on_the_memory_of_the_bands() {
    let dir = tempfile::tempdir().unwrap();
    let plain: Vec<Exposure> = (0..5)
        .map(|k| flat(dir.path(), &format!("{k}.fits"), &sky(90, 300, 20_000.0 + 99.0 * k as f64, k + 1), false))
        .collect();
    let mut mixed = plain.clone();
    mixed[2] = flat(dir.path(), "c.fits", &sky(90, 300, 20_000.0 + 99.0 * 2.0, 3), true);
    for (flats, clip, scale) in [
        (&plain, Some(40.0), FlatScale::Level),
        (&mixed, Some(40.0), FlatScale::Level),
        (&plain, None, FlatScale::None),
        (&mixed, Some(140.0), FlatScale::None),
    ] {
        let settings = satphot::config::Flat { scale, ..config(&[]).flat };
        let make = |threads: usize, band_bytes: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let make = || MasterFlat::make(flats, &detector(), &settings, clip, band_bytes).unwrap();
            pool.install(make).response.mapv(f32::to_bits)
        };
        let one = make(1, BAND_BYTES);
        // 700 bytes do not hold one row of five flats.
        for (threads, band_bytes) in [(2, BAND_BYTES), (3, 20_000), (2, 700), (1, 0)] {
            assert_eq!(one, make(threads, band_bytes), "{threads} threads, {band_bytes} bytes, {clip:?}, {scale:?}");
        }
    }
}

#[test]
fn scaled_flats_are_combined_bit_for_bit_as_by_a_plain_sort_of_the_scaled_values() {
    let dir = tempfile::tempdir().unwrap();
    let (nx, ny) = (120, 110);
    let frames: Vec<Array2<u16>> = (0..6).map(|k| sky(nx, ny, 18_000.0 + 700.0 * k as f64, k as u64 + 1)).collect();
    let flats: Vec<Exposure> =
        frames.iter().enumerate().map(|(k, f)| flat(dir.path(), &format!("{k}.fits"), f, k == 4)).collect();
    for clip in [None, Some(50.0)] {
        let master = MasterFlat::make(&flats, &detector(), &config(&[]).flat, clip, BAND_BYTES).unwrap();
        let (x0, y0) = master.origin_px;
        let kept = |i: usize, j: usize| {
            let r2 = ((x0 + i) as f64 - 59.5).powi(2) + ((y0 + j) as f64 - 54.5).powi(2);
            clip.is_none_or(|r: f64| r2 <= r * r)
        };
        let raw = Array2::from_shape_fn(master.response.dim(), |(j, i)| {
            let at = [y0 + j, x0 + i];
            let scaled = frames.iter().zip(&master.members);
            let scaled = scaled.map(|(f, m)| (f32::from(f[at]) - PEDESTAL as f32) * (1.0 / m.level_adu) as f32);
            median(scaled.map(f64::from).collect()) as f32
        });
        let inside = raw.indexed_iter().filter(|((j, i), _)| kept(*i, *j)).map(|(_, v)| f64::from(*v));
        let norm = median(inside.collect());
        for ((j, i), v) in raw.indexed_iter() {
            let got = master.response[[j, i]];
            if kept(i, j) {
                assert_eq!(got.to_bits(), ((f64::from(*v) / norm) as f32).to_bits(), "({i}, {j}) of clip {clip:?}");
            } else {
                assert!(got.is_nan(), "({i}, {j}) lies outside the circle");
            }
        }
    }
}

#[test]
fn without_scale_the_master_is_the_median_of_the_counts_and_equal_levels_give_it_by_themselves() {
    let dir = tempfile::tempdir().unwrap();
    let base = sky(80, 60, 20_000.0, 1);
    // Turned by whole columns and rows, a frame keeps its median: levels that are equal exactly.
    let turned = |k: usize| Array2::from_shape_fn((60, 80), |(j, i)| base[[(j + 7 * k) % 60, (i + 13 * k) % 80]]);
    let frames: Vec<Array2<u16>> = (0..5).map(turned).collect();
    let flats: Vec<Exposure> =
        frames.iter().enumerate().map(|(k, f)| flat(dir.path(), &format!("{k}.fits"), f, k == 1)).collect();
    let make = |scale: FlatScale| {
        let settings = satphot::config::Flat { scale, ..config(&[]).flat };
        MasterFlat::make(&flats, &detector(), &settings, None, BAND_BYTES).unwrap()
    };
    let (none, level) = (make(FlatScale::None), make(FlatScale::Level));
    assert_eq!(none.response, level.response);
    let plain =
        Array2::from_shape_fn((60, 80), |at| median(frames.iter().map(|f| f64::from(f[at]) - PEDESTAL).collect()));
    let norm = median(plain.iter().copied().collect());
    for (at, v) in plain.indexed_iter() {
        // Counts are exact; one rounding to f32 of the quotient.
        assert_eq!(none.response[at], (v / norm) as f32, "{at:?}");
    }
    // Levels that differ by nothing but rounding: the scaled way, to four roundings of f32.
    let mut nearly = flats.clone();
    nearly.push(flat(dir.path(), "other.fits", &turned(5).mapv(|v| v + 1), false));
    nearly.push(flat(dir.path(), "another.fits", &turned(6).mapv(|v| v - 1), false));
    let make = |scale: FlatScale| {
        let settings = satphot::config::Flat { scale, ..config(&[]).flat };
        MasterFlat::make(&nearly, &detector(), &settings, None, BAND_BYTES).unwrap().response
    };
    let (none, level) = (make(FlatScale::None), make(FlatScale::Level));
    // One ADU of 20 000.
    none.iter().zip(&level).for_each(|(a, b)| assert!((a - b).abs() < 1.2e-4, "{a} {b}"));
}

#[test]
fn flats_of_floats_are_combined_too_and_saturated_pixels_never_vote() {
    let dir = tempfile::tempdir().unwrap();
    let frames: Vec<Array2<u16>> = (0..5)
        .map(|k| {
            let mut f = sky(40, 40, 20_000.0, k + 1);
            f[[7, 7]] = if k < 2 { 65_535 } else { 20_500 };
            f[[8, 8]] = if k < 3 { 65_535 } else { 20_500 };
            f
        })
        .collect();
    let counts: Vec<Exposure> =
        frames.iter().enumerate().map(|(k, f)| flat(dir.path(), &format!("{k}.fits"), f, false)).collect();
    let mut floats = counts.clone();
    let path = dir.path().join("float.fits");
    write_f32(&path, &frames[3].mapv(f32::from), &flat_cards()).unwrap();
    floats[3] = classify(&path, &config(&[]), &[]).unwrap();
    for scale in [FlatScale::Level, FlatScale::None] {
        let settings = satphot::config::Flat { scale, ..config(&[]).flat };
        let make = |flats: &[Exposure]| MasterFlat::make(flats, &detector(), &settings, None, BAND_BYTES).unwrap();
        let (a, b) = (make(&counts), make(&floats));
        let per_level = |k: usize| if scale == FlatScale::Level { 1.0 / a.members[k].level_adu } else { 1.0 };
        let plain = Array2::from_shape_fn((40, 40), |at| {
            let voters = (0..5).filter(|k| frames[*k][at] < 60_000);
            let voters: Vec<f64> = voters.map(|k| (f64::from(frames[k][at]) - PEDESTAL) * per_level(k)).collect();
            if voters.len() > 2 { median(voters) } else { f64::NAN }
        });
        assert!(plain[[8, 8]].is_nan() && plain[[7, 7]] > 0.0);
        let norm = median(plain.iter().copied().filter(|v| !v.is_nan()).collect());
        for (at, v) in plain.indexed_iter() {
            for master in [&a, &b] {
                let (got, want) = (f64::from(master.response[at]), v / norm);
                // f32 arithmetic: four roundings.
                assert!((got - want).abs() < 4e-7 || got.is_nan() && want.is_nan(), "{at:?}: {got} {want}");
            }
        }
    }
}

#[test]
fn a_frame_of_nan_is_all_bad_and_dividing_a_flat_by_itself_is_flat() {
    let dir = tempfile::tempdir().unwrap();
    let flats: Vec<Exposure> =
        (0..3).map(|k| flat(dir.path(), &format!("{k}.fits"), &sky(30, 30, 20_000.0, 1), k == 2)).collect();
    let master = MasterFlat::make(&flats, &detector(), &config(&[]).flat, None, BAND_BYTES).unwrap();
    let mut gain = unit_gain();
    gain.pedestal_adu = PEDESTAL;
    let frame = read(&flats[0], gain.clone(), None, Some(&master)).unwrap();
    let level = master.members[0].level_adu as f32;
    assert!(frame.pixels.iter().all(|v| (v / level - 1.0).abs() < 1e-6));
    let path = dir.path().join("nan.fits");
    write_f32(&path, &Array2::from_elem((30, 30), f32::NAN), &flat_cards()).unwrap();
    let e = classify(&path, &config(&[]), &[]).unwrap();
    let frame = read(&e, gain, None, Some(&master)).unwrap();
    assert!(frame.all_bad());
}

/// Flats of `level` ADU above the pedestal with the noise of photons and reading; the one at `other` sees through another filter.
fn photon_flats(dir: &Path, n: usize, level: f64, other: Option<usize>) -> Vec<Exposure> {
    let some = flat(dir, "gain.fits", &sky(8, 8, level, 1), false);
    let gain = detector().gain(&some).unwrap();
    let (e_per_adu, read_noise_e) = (gain.e_per_adu.0, gain.read_noise_e);
    let mut state = 20_261_125u64;
    let mut unit = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / 2f64.powi(53)
    };
    (0..n)
        .map(|k| {
            let pixels = Array2::from_shape_fn((120, 120), |(j, i)| {
                let stripes = if other == Some(k) { 1.0 + 0.03 * ((i / 40 + j / 40) % 2) as f64 } else { 1.0 };
                let light_e = level * e_per_adu * stripes;
                let gauss = (0..12).map(|_| unit()).sum::<f64>() - 6.0;
                (PEDESTAL + (light_e + gauss * (light_e + read_noise_e.powi(2)).sqrt()) / e_per_adu).round() as u16
            });
            flat(dir, &format!("flat_{k:02}.fits"), &pixels, false)
        })
        .collect()
}

fn scatter(master: &MasterFlat) -> f64 {
    let values: Vec<f64> = master.response.iter().map(|v| f64::from(*v)).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn no_more_flats_are_combined_than_the_noise_that_is_accepted_takes() {
    let dir = tempfile::tempdir().unwrap();
    let make = |flats: &[Exposure], noise_frac| {
        let config = satphot::config::Flat { noise_frac, ..config(&[]).flat };
        MasterFlat::make(flats, &detector(), &config, None, BAND_BYTES).unwrap()
    };
    let used =
        |master: &MasterFlat| -> Vec<usize> { (0..master.members.len()).filter(|k| master.members[*k].used).collect() };
    let flats = photon_flats(dir.path(), 30, 20_000.0, None);
    let all = make(&flats, None);
    assert_eq!(used(&all).len(), 30);
    for (master, n) in [(&all, 30), (&make(&flats, Some(0.0025)), 16), (&make(&flats, Some(0.02)), 5)] {
        // the scatter of 14 400 pixels is known to 0.6 %
        let (stated, seen) = (master.noise_frac.unwrap(), scatter(master));
        assert!((seen / stated - 1.0).abs() < 0.025, "{n} flats: stated {stated}, seen {seen}");
        let k = used(master);
        assert!(k.len().abs_diff(n) <= 1 && k[0] == 0 && k[k.len() - 1] == 29, "{k:?}, about {n} expected");
        let gaps = k.windows(2).map(|w| w[1] - w[0]);
        assert!(gaps.clone().max().unwrap() - gaps.min().unwrap() <= 1, "spread evenly: {k:?}");
        let spared = master.members.iter().filter(|m| m.not_needed);
        assert_eq!(spared.clone().count(), 30 - k.len());
        assert!(spared.clone().all(|m| !m.used && m.reason.contains("flat.noise_frac")));
    }
    let some = make(&flats, Some(0.0025));
    let few = &flats[..used(&some).len() - 1];
    assert!(
        some.noise_frac.unwrap() <= 0.0025 && make(few, None).noise_frac.unwrap() > 0.0025,
        "one fewer is not enough"
    );
    assert_eq!(used(&make(few, Some(0.0025))).len(), few.len(), "all of those that do not suffice");
    // written and read again, it is as certain
    let path = dir.path().join("master.fits");
    some.write(&path).unwrap();
    let again = MasterFlat::read(&path, None, &config(&[]).flat).unwrap();
    assert_eq!(again.noise_frac, some.noise_frac);
    // a flat of another filter among those that are combined: another takes its place
    let other = used(&some)[3];
    let mixed = photon_flats(dir.path(), 30, 20_000.0, Some(other));
    let master = make(&mixed, Some(0.0025));
    assert!(!master.members[other].used && !master.members[other].not_needed, "{:?}", master.members[other]);
    assert!(master.noise_frac.unwrap() <= 0.0025 && used(&master).len().abs_diff(16) <= 1);
    assert!((scatter(&master) / master.noise_frac.unwrap() - 1.0).abs() < 0.025);
}
