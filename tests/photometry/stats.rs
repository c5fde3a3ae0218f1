//! Robust statistics against definitions, tables and seeded noise.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal, Poisson};
use satphot::base::stats::*;

#[test]
fn median_and_quantile_leave_out_nan_and_agree_with_sorting() {
    assert_eq!(median(&mut [3.0, f64::NAN, 1.0, f64::INFINITY, 2.0]), Some(2.0));
    assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), Some(2.5));
    assert_eq!(median(&mut [f64::NAN]), None);
    assert_eq!(median(&mut []), None);
    let mut v: Vec<f64> = (0..101).map(|k| f64::from((k * 37) % 101)).collect();
    assert_eq!(quantile(&mut v, 0.25), Some(25.0));
    assert_eq!(quantile(&mut v, 0.255), Some(25.5));
    assert_eq!((quantile(&mut v, 0.0), quantile(&mut v, 1.0)), (Some(0.0), Some(100.0)));
    assert_eq!(quantile(&mut [f64::NAN], 0.5), None);
}

#[test]
fn statistics_follow_scale_and_shift() {
    let mut rng = ChaCha12Rng::seed_from_u64(3);
    let values: Vec<f64> = (0..999).map(|_| Normal::new(0.0, 1.0).unwrap().sample(&mut rng)).collect();
    let one = sigma_clip(&mut values.clone(), 3.0).unwrap();
    let two = sigma_clip(&mut values.iter().map(|v| 8.0 * v + 1024.0).collect::<Vec<_>>(), 3.0).unwrap();
    assert!((two.median - (8.0 * one.median + 1024.0)).abs() < 1e-9 && (two.sigma - 8.0 * one.sigma).abs() < 1e-9);
    assert_eq!((one.n, one.n_rejected), (two.n, two.n_rejected));
}

#[test]
fn a_sigma_clip_is_unbiased_for_gaussian_noise_and_drops_outliers() {
    let mut rng = ChaCha12Rng::seed_from_u64(4);
    let mut values: Vec<f64> = (0..200_000).map(|_| Normal::new(10.0, 2.0).unwrap().sample(&mut rng)).collect();
    values.extend((0..20_000).map(|_| rng.random_range(100.0..1000.0)));
    let c = sigma_clip(&mut values, 3.0).unwrap();
    assert!((c.sigma / 2.0 - 1.0).abs() < 0.01, "{}", c.sigma);
    assert!((c.mean - 10.0).abs() < 0.02 && (c.median - 10.0).abs() < 0.02);
    assert!((20_300..21_000).contains(&c.n_rejected), "{}", c.n_rejected);
}

#[test]
fn a_clip_of_equal_or_few_values_is_finite() {
    let c = sigma_clip(&mut [5.0; 7], 3.0).unwrap();
    assert_eq!((c.mean, c.median, c.sigma, c.n, c.n_rejected), (5.0, 5.0, 0.0, 7, 0));
    assert_eq!(sigma_clip(&mut [2.0], 3.0).unwrap().median, 2.0);
    assert!(sigma_clip(&mut [f64::NAN], 3.0).is_none() && sigma_clip(&mut [1.0], 0.0).is_none());
    // most values equal: the MAD is 0 and must not reject everything else
    let c = sigma_clip(&mut [1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 0.0], 3.0).unwrap();
    assert_eq!(c.n, 7);
}

#[test]
fn the_variance_of_a_median_is_that_of_order_statistics() {
    // Hojo 1931; David & Nagaraja, Order Statistics: Var of the median of 2, 3, 5 unit Gaussians: 0.5, 0.4487, 0.2868
    for (n, variance) in [(1, 1.0), (2, 0.5), (3, 0.448_67), (5, 0.286_83)] {
        assert!((median_variance_factor(n) / n as f64 - variance).abs() < 1e-5, "{n}");
    }
    // the join of table and formula
    assert!((median_variance_factor(21) - 1.538_454_85).abs() < 2e-5);
    assert!((median_variance_factor(40) - 1.517_366_28).abs() < 1e-4);
    assert!((median_variance_factor(1_000_001) - std::f64::consts::FRAC_PI_2).abs() < 1e-5);
}

#[test]
fn a_smoothed_median_has_the_variance_and_the_skew_shift_it_claims() {
    let mut rng = ChaCha12Rng::seed_from_u64(6);
    let (lambda, noise, n) = (8.0f64, 2.0f64, 400);
    let sigma = (lambda + noise * noise).sqrt();
    let mut locations = Vec::new();
    for _ in 0..6000 {
        let mut v: Vec<f64> = (0..n)
            .map(|_| Poisson::new(lambda).unwrap().sample(&mut rng) + Normal::new(0.0, noise).unwrap().sample(&mut rng))
            .collect();
        let c = sigma_clip(&mut v, 3.0).unwrap();
        locations.push(smoothed_median(&v[..c.n], c.median, c.sigma).unwrap());
    }
    let (mean, sd) = mean_and_sd(&locations);
    let shift = smoothed_median_skew_shift(3.0) * lambda / (sigma * sigma);
    println!("shift {:.4} claimed {:.4}; sd {sd:.4}", lambda - mean, shift);
    assert!((lambda - mean - shift).abs() < 0.012); // 0.0023 of sampling, the rest is the next order in 1/σ
    let claimed = sigma * (smoothed_median_variance_factor() / n as f64).sqrt();
    assert!((sd / claimed - 1.0).abs() < 0.04, "{sd} {claimed}");
}

#[test]
fn a_smoothed_median_of_digitised_noise_is_not_a_level() {
    let mut rng = ChaCha12Rng::seed_from_u64(7);
    for offset in [0.0, 0.2, 0.4, 0.6, 0.8] {
        let mut v: Vec<f64> =
            (0..40_000).map(|_| f64::round(Normal::new(50.0 + offset, 1.2).unwrap().sample(&mut rng))).collect();
        let c = sigma_clip(&mut v, 4.0).unwrap();
        let m = smoothed_median(&v[..c.n], c.median, c.sigma).unwrap();
        // 5 % of a step; a plain median would be off by up to 40 %
        assert!((m - 50.0 - offset).abs() < 0.05, "{offset}: {m}");
    }
}
