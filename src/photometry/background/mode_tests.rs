//! The mode of a box against the same recipe written plainly, and its digits on dark and bright skies.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal};

use super::*;

/// The recipe in single sums, one value after another, every clip a new pass over the histogram.
fn plain_mode(values: &[f32], clip_sigma: f64) -> Mode {
    let (mean, sigma, _) = plain_moments(values, f64::NEG_INFINITY, f64::INFINITY);
    let (mean, sigma, n) = plain_moments(values, mean - 2.0 * sigma, mean + 2.0 * sigma);
    if sigma <= 0.0 {
        return Mode { level: mean, sigma: 0.0 };
    }
    let levels = ((n as f64 * (2.0 / std::f64::consts::PI).sqrt() * 1.25) as usize + 1).min(4096);
    let step = 10.0 * sigma / levels as f64;
    let zero = mean - 5.0 * sigma;
    let mut counts = vec![0u32; levels];
    for &v in values {
        let level = f64::from(v) * (1.0 / step) + (0.5 - zero / step);
        if level >= 0.0 && level < levels as f64 {
            counts[level as usize] += 1;
        }
    }
    let (median, mean, sigma) = plain_clip(&counts, clip_sigma);
    let (median, mean, sigma) = (zero + step * median, zero + step * mean, step * sigma);
    let level = if sigma <= 0.0 {
        mean
    } else if (mean - median).abs() >= 0.3 * sigma {
        median
    } else {
        2.5 * median - 1.5 * mean
    };
    Mode { level, sigma }
}

fn plain_moments(values: &[f32], low: f64, high: f64) -> (f64, f64, usize) {
    let kept: Vec<f64> = values.iter().map(|v| f64::from(*v)).filter(|v| *v >= low && *v <= high).collect();
    if kept.is_empty() {
        return (f64::from(values[0]), 0.0, 0);
    }
    let n = kept.len() as f64;
    let mean = kept[0] + kept.iter().map(|v| v - kept[0]).sum::<f64>() / n;
    (mean, (kept.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt(), kept.len())
}

fn plain_clip(counts: &[u32], k: f64) -> (f64, f64, f64) {
    let last = counts.len() - 1;
    let (mut low, mut high) = (0usize, last);
    let (mut median, mut mean, mut sigma, mut previous) = (0.0, 0.0, 10.0 * last as f64, 1.0);
    for _ in 0..100 {
        if sigma < 0.1 || f64::abs(sigma / previous - 1.0) <= 1e-4 {
            break;
        }
        previous = sigma;
        let kept = &counts[low..=high];
        let n: f64 = kept.iter().map(|c| f64::from(*c)).sum();
        if n == 0.0 {
            sigma = 0.0;
            break;
        }
        let of = |power: i32| kept.iter().enumerate().map(|(i, c)| f64::from(*c) * (i as f64).powi(power)).sum::<f64>();
        let about_low = of(1) / n;
        mean = low as f64 + about_low;
        sigma = (of(2) / n - about_low * about_low).max(0.0).sqrt();
        let mut below = 0.0;
        for (i, &c) in kept.iter().enumerate() {
            let c = f64::from(c);
            if c > 0.0 && below + c >= 0.5 * n {
                median = low as f64 + (i as f64 - 0.5 + (0.5 * n - below) / c);
                break;
            }
            below += c;
        }
        low = (median - k * sigma).round().clamp(0.0, last as f64) as usize;
        high = (median + k * sigma).round().clamp(low as f64, last as f64) as usize;
    }
    (median, mean, sigma)
}

fn mode(values: &[f32]) -> Mode {
    mode_of_box(&mut values.to_vec(), &mut Bins::new(), 1.0, 3.0).unwrap()
}

/// A sky with noise, digitised to `quantum`, a share of its pixels under stars.
fn sky(n: usize, level: f64, sigma: f64, quantum: f64, stars: f64, seed: u64) -> Vec<f32> {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let noise = Normal::new(level, sigma).unwrap();
    (0..n)
        .map(|_| {
            let star = if rng.random::<f64>() < stars { sigma * rng.random_range(0.0..400.0) } else { 0.0 };
            let v = noise.sample(&mut rng) + star;
            (if quantum > 0.0 { (v / quantum).round() * quantum } else { v }) as f32
        })
        .collect()
}

#[test]
fn the_mode_is_that_of_the_recipe_written_plainly() {
    for seed in 0..60u64 {
        let n = [4096, 4095, 4097, 2048, 1000, 64, 33, 17, 16, 15, 3, 2][seed as usize % 12];
        let (level, sigma) = [(56.0, 7.5), (1e-3, 1e-4), (1e5, 316.0), (1e12, 1e6), (-3.0, 2.0)][seed as usize % 5];
        let quantum = [0.0, 0.25 * sigma, 0.0, 1.5 * sigma][seed as usize % 4];
        let values = sky(n, level, sigma, quantum, [0.0, 0.02, 0.3][seed as usize % 3], seed);
        let (got, want) = (mode(&values), plain_mode(&values, 3.0));
        // only the order of the additions differs
        let tolerance = 1e-13 * level.abs() + 1e-9 * sigma;
        assert!((got.level - want.level).abs() <= tolerance, "{seed}: {} {}", got.level, want.level);
        assert!((got.sigma - want.sigma).abs() <= tolerance, "{seed}: {} {}", got.sigma, want.sigma);
    }
}

#[test]
fn a_clip_that_updates_its_sums_gives_the_bits_of_one_that_starts_again() {
    let mut rng = ChaCha12Rng::seed_from_u64(4);
    for round in 0..300 {
        let n = [1, 2, 15, 16, 17, 300, 4096][round % 7];
        let (centre, width) = (rng.random_range(0.0..n as f64), rng.random_range(0.5..n as f64 + 1.0));
        let counts: Vec<u32> = (0..n)
            .map(|i| {
                let peak = 60.0 * (-((i as f64 - centre) / width).powi(2)).exp();
                if rng.random::<f64>() < 0.5 { rng.random_range(0.0..peak + 0.01) as u32 } else { 0 }
            })
            .collect();
        for k in [1.0, 3.0] {
            let got = clip_histogram(&counts, k);
            assert_eq!((got.median, got.mean, got.sigma), plain_clip(&counts, k), "round {round}, {n} levels");
        }
    }
}

#[test]
fn the_level_keeps_six_digits_from_a_thousandth_of_an_electron_to_a_million_million() {
    // the noise of a mode of 4096 px is 2.14 σ/64: relative 1e-7 here; f32 pixels hold 6e-8
    for level in [1e-3, 1.0, 1e5, 1e9, 1e12] {
        let got = mode(&sky(4096, level, 3e-6 * level, 0.0, 0.0, 7));
        assert!((got.level / level - 1.0).abs() < 4e-7, "{level}: {}", got.level);
        assert!((got.sigma / (3e-6 * level) - 1.0).abs() < 0.05, "{level}: {}", got.sigma);
    }
    // a hot pixel first in the box, which is the local zero of the first pass
    let mut dark = sky(4096, 1e-3, 1e-4, 0.0, 0.0, 8);
    let want = mode(&dark);
    dark[0] = 6e4;
    let got = mode(&dark);
    // the mean moves by what one pixel less of 4096 makes: 3 σ/n
    assert!((got.level - want.level).abs() < 1e-3 * want.sigma && (got.sigma / want.sigma - 1.0).abs() < 1e-3);
}

#[test]
fn what_is_not_finite_is_not_there() {
    let clean = sky(4000, 100.0, 10.0, 0.0, 0.0, 3);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for at in [0, 1700, 3999] {
            let mut dirty = clean.clone();
            dirty.insert(at, bad);
            let (got, want) = (mode(&dirty), mode(&clean));
            assert_eq!((got.level, got.sigma), (want.level, want.sigma));
        }
    }
    assert!(mode_of_box(&mut vec![f32::NAN; 100], &mut Bins::new(), 1.0, 3.0).is_none());
    assert!(mode_of_box(&mut clean.clone(), &mut Bins::new(), 4001.0, 3.0).is_none());
}
