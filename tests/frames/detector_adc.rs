//! Step, bits and saturation from the raw values alone.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use satphot::detector::{Counts, converter_bits};

fn counts(values: &[f32]) -> Counts {
    let mut counts = Counts::default();
    counts.add(values);
    counts
}

/// A sky of 100 kpx with noise of `sd` levels, spaced by `step` from `offset`.
fn sky(step: f64, offset: f64, sd: f64, seed: u64) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(300.0, sd).unwrap();
    (0..100_000).map(|_| (noise.sample(&mut rng).round() * step + offset) as f32).collect()
}

#[test]
fn the_step_is_the_padding_whatever_the_offset_and_the_noise() {
    for step in [1.0, 2.0, 4.0, 16.0, 64.0, 10.0, 257.0] {
        for (offset, sd) in [(0.0, 20.0), (1.0, 20.0), (3.0, 1.2), (0.0, 0.5)] {
            if offset >= step || 300.0 * step > 60_000.0 && sd > 1.2 {
                continue;
            }
            let found = if step > 200.0 { sky(step, offset - 100.0 * step, sd, 1) } else { sky(step, offset, sd, 1) };
            let found = counts(&found).step().unwrap();
            assert_eq!(f64::from(found.step_adu), step, "offset {offset} sd {sd}");
            assert_eq!(f64::from(found.offset_adu), offset, "step {step} sd {sd}");
            assert!((found.spacing_adu - step).abs() < 1e-9 && found.share > 0.999, "{found:?}");
        }
    }
}

#[test]
fn one_odd_pixel_in_a_hundred_does_not_hide_the_step_but_a_tenth_does() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut values = sky(16.0, 0.0, 20.0, 2);
    values.iter_mut().step_by(100).for_each(|v| *v = rng.random_range(0..65_535) as f32);
    let found = counts(&values).step().unwrap();
    assert_eq!(found.step_adu, 16);
    assert!(found.share > 0.98 && found.share < 0.995, "{found:?}");
    values.iter_mut().step_by(10).for_each(|v| *v = rng.random_range(0..65_535) as f32);
    assert_eq!(counts(&values).step().unwrap().step_adu, 1);
}

#[test]
fn counts_stretched_by_a_fraction_are_recognised_by_their_spacing() {
    // 12 bits stretched to 0..65535: 65535/4095 = 16.0037
    let stretched: Vec<f32> = sky(1.0, 1_000.0, 200.0, 3).iter().map(|v| (v * 65_535.0 / 4_095.0).round()).collect();
    let found = counts(&stretched).step().unwrap();
    assert_eq!(found.step_adu, 1);
    assert!((found.spacing_adu - 16.004).abs() < 0.2, "{found:?}");
    assert_eq!(converter_bits(Some(found), None), Some(12));
}

#[test]
fn a_constant_frame_and_calibrated_data_tell_nothing_of_the_step() {
    assert_eq!(counts(&[32.0; 5_000]).step(), None);
    assert_eq!(Counts::default().step(), None);
    let mut few = vec![32.0; 5_000];
    few[..20].iter_mut().for_each(|v| *v = 48.0);
    assert_eq!(counts(&few).step(), None, "20 pixels could be anything");
    let calibrated: Vec<f32> = sky(1.0, 0.0, 20.0, 4).iter().map(|v| v * 1.013).collect();
    let found = counts(&calibrated);
    assert!(!found.is_raw() && found.step().is_none() && found.n_fractional > 90_000);
    let nan = counts(&[f32::NAN; 100]);
    assert!(!nan.is_raw() && nan.is_empty() && nan.n_nan == 100);
    let below: Vec<f32> = sky(1.0, -600.0, 20.0, 5);
    assert!(!counts(&below).is_raw(), "values below zero were subtracted by somebody");
}

#[test]
fn saturated_stars_pile_up_and_unsaturated_ones_do_not() {
    // a Gaussian star has 2 pi s^2 dI/I pixels between I and I + dI: no pile anywhere, however bright
    let field = |clip: f64, peak: f64| -> Vec<f32> {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let mut values = sky(1.0, 700.0, 20.0, 6);
        for star in 0..40 {
            let top = peak * (1.0 - star as f64 / 45.0);
            for k in 0..400 {
                let (x, y) = ((k % 20) as f64 - 9.6, (k / 20) as f64 - 9.3);
                let noise: f64 = rng.random_range(-1.0..1.0);
                let light = top * (-(x * x + y * y) / (2.0 * 4.0f64.powi(2))).exp();
                values[star * 400 + k] += (light + noise * light.sqrt()).round() as f32;
            }
        }
        values.iter().map(|v| f64::from(*v).min(clip) as f32).collect()
    };
    assert_eq!(counts(&field(65_535.0, 60_000.0)).pile(1_200.0), None);
    for clip in [65_535.0, 4_095.0, 16_383.0, 50_000.0] {
        let pile = counts(&field(clip, 120_000.0)).pile(1_200.0).unwrap();
        assert!((pile.level_adu - clip).abs() <= 1e-3 * clip && pile.top_adu == clip, "{clip}: {pile:?}");
    }
    assert_eq!(converter_bits(None, counts(&field(4_094.0, 90_000.0)).pile(1_200.0)), Some(12));
    // a few hot pixels above the pile, and a pile that scatters by a few counts
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut values = field(50_000.0, 120_000.0);
    values.iter_mut().filter(|v| **v == 50_000.0).for_each(|v| *v += rng.random_range(-10i32..10) as f32);
    values[99_000..99_004].iter_mut().for_each(|v| *v = 65_535.0);
    let pile = counts(&values).pile(1_200.0).unwrap();
    assert!((pile.level_adu - 50_000.0).abs() < 60.0 && pile.n_px > 300, "{pile:?}");
}

#[test]
fn neither_a_bias_frame_nor_a_flat_nor_a_plateau_with_its_noise_is_a_pile() {
    assert_eq!(counts(&[500.0; 10_000]).pile(600.0), None);
    assert_eq!(counts(&sky(1.0, 0.0, 5.0, 8)).pile(250.0), None);
    assert_eq!(counts(&sky(16.0, 0.0, 20.0, 8)).pile(250.0), None);
    // 30000 ADU of 0.8 e-/ADU: noise 194 ADU
    assert_eq!(counts(&sky(1.0, 29_700.0, 194.0, 9)).pile(1_000.0), None);
    let mut plateau = sky(1.0, 700.0, 20.0, 10);
    for (v, top) in plateau.iter_mut().zip(sky(1.0, 29_700.0, 194.0, 11)).take(5_000) {
        *v = top;
    }
    assert_eq!(counts(&plateau).pile(1_200.0), None);
}

#[test]
fn quantiles_and_counts_above_are_those_of_a_plain_sort() {
    let values = sky(1.0, 0.0, 20.0, 12);
    let mut sorted = values.clone();
    sorted.sort_by(f32::total_cmp);
    let c = counts(&values);
    for q in [0.001, 0.25, 0.5, 0.9, 1.0] {
        let rank = (q * 100_000f64).ceil() as usize - 1;
        assert_eq!(c.quantile(q), Some(f64::from(sorted[rank])));
    }
    assert_eq!(c.max_adu(), Some(f64::from(sorted[99_999])));
    assert_eq!(c.n_above(310.0), sorted.iter().filter(|v| **v > 310.0).count() as u64);
    let mut both = c.clone();
    both.merge(&c);
    assert_eq!((both.len(), both.quantile(0.3)), (200_000, c.quantile(0.3)));
}
