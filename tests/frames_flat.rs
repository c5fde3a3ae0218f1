//! The master flat: median against a plain sort, nothing divided by zero, rejections with reasons, back bit for bit.
#![allow(clippy::unwrap_used)]

mod frames_support;

use std::path::Path;

use frames_support::*;
use ndarray::Array2;
use satphot::frames::{CardValue, Detector, Exposure, MasterFlat, classify, mask, read, write_f32, write_u16};

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
        let master = MasterFlat::make(&flats, &detector(), &config(&[]).flat, None).unwrap();
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
fn zero_low_and_saturated_pixels_are_masked_or_left_out_and_never_divided_by() {
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
    let master = MasterFlat::make(&flats, &detector(), &config(&[]).flat, None).unwrap();
    for at in [[3, 3], [4, 4], [5, 5], [6, 6], [8, 8]] {
        assert!(master.mask[at] == mask::BAD && master.response[at].is_nan(), "{at:?}");
    }
    assert!(master.mask[[7, 7]] == 0 && (master.response[[7, 7]] - 1.0).abs() < 0.05);
    assert!((master.masked_frac - 5.0 / 1600.0).abs() < 1e-12);
    let science = flat(dir.path(), "science.fits", &sky(40, 40, 10_000.0, 9), false);
    let frame = read(&science, unit_gain(), None).unwrap().into_electrons().flattened(&master).unwrap();
    assert!(frame.pixels.iter().all(|v| v.is_finite()), "nothing was divided by zero or NaN");
    assert_eq!(frame.mask[[3, 3]], mask::BAD);
    assert!(!frame.all_bad());
}

#[test]
fn unusable_flats_are_rejected_with_a_reason_and_too_few_stop_the_night() {
    let dir = tempfile::tempdir().unwrap();
    let mut flats: Vec<Exposure> =
        (0..3).map(|k| flat(dir.path(), &format!("good{k}.fits"), &sky(30, 20, 20_000.0, k + 1), false)).collect();
    flats.push(flat(dir.path(), "dark.fits", &Array2::from_elem((20, 30), 510), false));
    flats.push(flat(dir.path(), "bright.fits", &Array2::from_elem((20, 30), 65_535), false));
    flats.push(flat(dir.path(), "zero.fits", &Array2::zeros((20, 30)), false));
    flats.push(flat(dir.path(), "small.fits", &sky(20, 20, 20_000.0, 4), false));
    let path = dir.path().join("nan.fits");
    write_f32(&path, &Array2::from_elem((20, 30), f32::NAN), &flat_cards()).unwrap();
    flats.push(classify(&path, &config(&[]), &[]).unwrap());
    let gone = flat(dir.path(), "gone.fits", &sky(30, 20, 20_000.0, 4), false);
    std::fs::remove_file(&gone.path).unwrap();
    flats.push(gone);
    let master = MasterFlat::make(&flats, &detector(), &config(&[]).flat, None).unwrap();
    let used: Vec<bool> = master.members.iter().map(|m| m.used).collect();
    assert_eq!(used, [true, true, true, false, false, false, false, false, false]);
    for (m, word) in
        master.members[3..].iter().zip(["level 10", "outside", "outside", "20x20", "no finite pixel", "gone.fits"])
    {
        assert!(m.reason.contains(word), "{m:?}");
    }
    let e = MasterFlat::make(&flats[2..], &detector(), &config(&[]).flat, None).unwrap_err();
    assert!(
        e.exit_code() == 5 && e.to_string().contains("1 of 7 flats are usable") && e.to_string().contains("dark.fits"),
        "{e}"
    );
    let e = MasterFlat::make(&[], &detector(), &config(&[]).flat, None).unwrap_err();
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
        let made = MasterFlat::make(&flats, &detector(), &c.flat, clip).unwrap();
        made.write(&path).unwrap();
        let back = MasterFlat::read(&path, clip, &c.flat).unwrap();
        let bits = |m: &MasterFlat| m.response.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&made), bits(&back));
        assert_eq!((made.mask, made.origin_px, made.full_size_px), (back.mask, back.origin_px, back.full_size_px));
        assert_eq!(made.masked_frac, back.masked_frac);
    }
    let e = MasterFlat::read(&path, Some(24.0), &c.flat).unwrap_err().to_string();
    assert!(e.contains("clip_radius_px"), "a clipped master does not cover a larger circle: {e}");
    // A frame of another size names both.
    let master = MasterFlat::read(&path, Some(20.0), &c.flat).unwrap();
    let other = flat(dir.path(), "other.fits", &sky(60, 50, 1_000.0, 1), false);
    let e = read(&other, unit_gain(), Some(20.0)).unwrap().into_electrons().flattened(&master).unwrap_err().to_string();
    assert!(e.contains("60x50") && e.contains("61x50") && e.contains("other.fits"), "{e}");
    // Another program's master, with another normalisation.
    let foreign = dir.path().join("foreign.fits");
    write_f32(&foreign, &Array2::from_shape_fn((9, 9), |(j, i)| if i == 0 && j == 0 { 0.0 } else { 20_000.0 }), &[])
        .unwrap();
    let m = MasterFlat::read(&foreign, None, &c.flat).unwrap();
    assert_eq!((m.mask[[0, 0]], m.response[[4, 4]]), (mask::BAD, 1.0));
    write_f32(&foreign, &Array2::zeros((9, 9)), &[]).unwrap();
    assert!(MasterFlat::read(&foreign, None, &c.flat).unwrap_err().to_string().contains("not positive"));
}

#[test]
fn the_master_does_not_depend_on_the_number_of_threads_or_on_the_clip() {
    let dir = tempfile::tempdir().unwrap();
    let flats: Vec<Exposure> =
        (0..5).map(|k| flat(dir.path(), &format!("{k}.fits"), &sky(90, 300, 20_000.0, k + 1), k == 2)).collect();
    let make = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| MasterFlat::make(&flats, &detector(), &config(&[]).flat, Some(40.0)).unwrap())
    };
    let (one, many) = (make(1), make(3));
    assert_eq!(one.response.mapv(f32::to_bits), many.response.mapv(f32::to_bits));
    assert_eq!(one.response.dim(), (80, 80));
}

#[test]
fn a_frame_of_nan_is_all_bad_and_dividing_a_flat_by_itself_is_flat() {
    let dir = tempfile::tempdir().unwrap();
    let flats: Vec<Exposure> =
        (0..3).map(|k| flat(dir.path(), &format!("{k}.fits"), &sky(30, 30, 20_000.0, 1), k == 2)).collect();
    let master = MasterFlat::make(&flats, &detector(), &config(&[]).flat, None).unwrap();
    let mut gain = unit_gain();
    gain.pedestal_adu = PEDESTAL;
    let frame = read(&flats[0], gain.clone(), None).unwrap().into_electrons().flattened(&master).unwrap();
    let level = master.members[0].level_adu as f32;
    assert!(frame.pixels.iter().all(|v| (v / level - 1.0).abs() < 1e-6));
    let path = dir.path().join("nan.fits");
    write_f32(&path, &Array2::from_elem((30, 30), f32::NAN), &flat_cards()).unwrap();
    let e = classify(&path, &config(&[]), &[]).unwrap();
    let frame = read(&e, gain, None).unwrap().into_electrons().flattened(&master).unwrap().clipped(10.0);
    assert!(frame.all_bad());
}
