//! The gain from pairs of flats: injected detectors are recovered with honest errors, and what is no pair is refused.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Poisson};
use satphot::detector::{DarkNoise, PairPoints, Refusal, Transfer, compare_flats, fit_transfer};

const SIDE: usize = 64;

/// A detector to inject.
#[derive(Clone, Copy)]
struct Camera {
    e_per_adu: f64,
    read_noise_e: f64,
    pedestal_adu: f64,
    prnu: f64,
    /// Distance of the values in the file [ADU].
    step: f64,
}

const CMOS: Camera = Camera { e_per_adu: 0.8, read_noise_e: 3.5, pedestal_adu: 500.0, prnu: 0.01, step: 1.0 };

impl Camera {
    /// Flats of the given levels above the pedestal [ADU], `n` blocks of a vignetted field (30 % at the edge).
    fn flats(&self, levels_adu: &[f64], n: usize, seed: u64) -> Vec<Vec<Vec<f32>>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let response = Normal::new(1.0, self.prnu).unwrap();
        let noise = Normal::new(0.0, self.read_noise_e).unwrap();
        let mut flats = vec![Vec::new(); levels_adu.len()];
        for block in 0..n {
            let pixels: Vec<f64> = (0..SIDE * SIDE)
                .map(|i| {
                    let place = (block as f64 + i as f64 / (SIDE * SIDE) as f64) / n as f64;
                    (1.0 - 0.3 * place * place) * response.sample(&mut rng)
                })
                .collect();
            for (flat, level) in flats.iter_mut().zip(levels_adu) {
                let mut expose = |r: &f64| {
                    let light: f64 = Poisson::new(level * self.e_per_adu * r).unwrap().sample(&mut rng);
                    let adu = self.pedestal_adu + (light + noise.sample(&mut rng)) / self.e_per_adu;
                    ((adu / self.step).round() * self.step).clamp(0.0, 65_535.0) as f32
                };
                flat.push(pixels.iter().map(&mut expose).collect());
            }
        }
        flats
    }

    fn table(&self) -> DarkNoise {
        DarkNoise::Table { read_noise_e: self.read_noise_e, digitisation_adu2: self.step.powi(2) / 12.0 }
    }

    fn pair(&self, levels: [f64; 2], n: usize, seed: u64) -> PairPoints {
        let flats = self.flats(&levels, n, seed);
        compare_flats(&flats[0], &flats[1], self.pedestal_adu, 62_000.0).unwrap()
    }

    fn transfer(&self, levels: [f64; 2], n: usize, seed: u64) -> Transfer {
        fit_transfer(&[self.pair(levels, n, seed)], self.table()).unwrap()
    }
}

#[test]
fn two_flats_of_half_a_megapixel_give_the_gain_to_one_percent_for_every_kind_of_camera() {
    let cameras = [
        (CMOS, 30_000.0),
        (Camera { e_per_adu: 0.0844, read_noise_e: 1.45, ..CMOS }, 25_000.0),
        // 12 bits padded to 16, 14 bits padded to 16
        (Camera { e_per_adu: 3.6 / 16.0, read_noise_e: 2.5, step: 16.0, ..CMOS }, 20_000.0),
        (Camera { e_per_adu: 0.25, read_noise_e: 2.5, step: 4.0, ..CMOS }, 30_000.0),
        // 12 bits not padded: the noise is a few steps
        (Camera { e_per_adu: 3.6, read_noise_e: 2.5, pedestal_adu: 32.0, ..CMOS }, 2_500.0),
        // strong pixel response, a CCD
        (Camera { e_per_adu: 1.5, read_noise_e: 9.0, prnu: 0.02, ..CMOS }, 35_000.0),
        // little light: read noise and digitisation are a third of the variance
        (Camera { e_per_adu: 0.5, read_noise_e: 4.0, step: 4.0, ..CMOS }, 60.0),
    ];
    for (k, (camera, level)) in cameras.into_iter().enumerate() {
        // the second flat is 4 % brighter; 123 blocks of 4096 px
        let t = camera.transfer([level, 1.04 * level], 123, 100 + k as u64);
        let (g, err) = (t.gain.e_per_adu, t.gain.err);
        println!(
            "camera {k}: {g:.5} +- {err:.5}, true {:.5}, off by {:+.2} sigma",
            camera.e_per_adu,
            (g - camera.e_per_adu) / err
        );
        assert!((g / camera.e_per_adu - 1.0).abs() < 0.01, "camera {k}: {g}");
        assert!((g - camera.e_per_adu).abs() < 4.0 * err, "camera {k}: {g} +- {err}");
    }
}

#[test]
fn the_quoted_error_holds_the_truth_in_two_thirds_of_two_hundred_flat_pairs() {
    // 16 blocks: 65 kpx; the error does not know how many pixels there are
    let offs: Vec<f64> = (0..200)
        .map(|seed| {
            let t = CMOS.transfer([20_000.0, 20_800.0], 16, seed);
            (t.gain.e_per_adu - CMOS.e_per_adu) / t.gain.err
        })
        .collect();
    let inside = offs.iter().filter(|o| o.abs() < 1.0).count() as f64 / 200.0;
    let mean = offs.iter().sum::<f64>() / 200.0;
    println!("coverage {inside:.3}, mean off {mean:+.3} sigma");
    assert!((0.60..=0.76).contains(&inside), "{inside}");
    // the mean of 200 has an error of 0.07 sigma
    assert!(mean.abs() < 0.25, "{mean}");
}

#[test]
fn one_percent_of_pixel_response_biases_a_single_flat_by_a_factor_but_not_a_pair() {
    let flats = CMOS.flats(&[30_000.0, 31_200.0], 60, 7);
    let t = fit_transfer(&[compare_flats(&flats[0], &flats[1], 500.0, 62_000.0).unwrap()], CMOS.table()).unwrap();
    assert!((t.gain.e_per_adu / 0.8 - 1.0).abs() < 0.01);
    // variance over pixels of the first block of one flat: counted light and (0.01 m)^2
    let block: Vec<f64> = flats[0][0].iter().map(|v| f64::from(*v)).collect();
    let mean = block.iter().sum::<f64>() / block.len() as f64;
    let var = block.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (block.len() - 1) as f64;
    let naive = (mean - 500.0) / var;
    assert!(naive < 0.5 * 0.8, "{naive}");
}

#[test]
fn a_star_a_trail_and_hot_pixels_in_one_flat_do_not_move_the_gain() {
    let mut flats = CMOS.flats(&[30_000.0, 31_000.0], 60, 11);
    for (block, pixels) in flats[0].iter_mut().enumerate() {
        for (i, v) in pixels.iter_mut().enumerate() {
            let (x, y) = ((i % SIDE) as f32, (i / SIDE) as f32);
            // a bright star of FWHM 8 px in every sixth block, a satellite's trail through every tenth
            if block % 6 == 0 {
                *v += 15_000.0 * (-((x - 30.0).powi(2) + (y - 20.0).powi(2)) / (2.0 * 3.4f32.powi(2))).exp();
            }
            if block % 10 == 3 {
                *v += 4_000.0 * (-((x - y).powi(2)) / 20.0).exp();
            }
            if i % 1511 == 0 {
                *v = 60_000.0;
            }
        }
    }
    let t = fit_transfer(&[compare_flats(&flats[0], &flats[1], 500.0, 62_000.0).unwrap()], CMOS.table()).unwrap();
    println!("with stars: {:.4} +- {:.4}", t.gain.e_per_adu, t.gain.err);
    assert!((t.gain.e_per_adu / 0.8 - 1.0).abs() < 0.015, "{:?}", t.gain);
}

#[test]
fn a_gradient_that_turns_between_two_flats_does_not_count_as_noise() {
    let mut flats = CMOS.flats(&[30_000.0, 30_500.0], 60, 12);
    // 4 % across every block: the slope of a binned twilight flat, there in one flat and not in the other
    for pixels in &mut flats[0] {
        for (i, v) in pixels.iter_mut().enumerate() {
            *v = (500.0 + (*v - 500.0) * (1.0 + 0.04 * ((i % SIDE) as f32 / SIDE as f32 - 0.5))).round();
        }
    }
    let t = fit_transfer(&[compare_flats(&flats[0], &flats[1], 500.0, 62_000.0).unwrap()], CMOS.table()).unwrap();
    // left in, (0.04 x 30000)^2/12 ADU^2 would halve the gain; the scaled pixels have 0.01 % more noise
    assert!((t.gain.e_per_adu / 0.8 - 1.0).abs() < 0.01, "{:?}", t.gain);
}

#[test]
fn the_error_of_several_pairs_is_honest_too() {
    let inside = (0..100).filter(|seed| {
        let pairs: Vec<PairPoints> = (0..3).map(|k| CMOS.pair([20_000.0, 20_500.0], 4, 1_000 + 3 * seed + k)).collect();
        let t = fit_transfer(&pairs, CMOS.table()).unwrap();
        (t.gain.e_per_adu - CMOS.e_per_adu).abs() < t.gain.err
    });
    let inside = inside.count() as f64 / 100.0;
    println!("coverage of three pairs {inside:.2}");
    // the scatter of three pairs can widen the error, never narrow it; 100 trials know it to 0.05
    assert!((0.58..=0.86).contains(&inside), "{inside}");
}

#[test]
fn several_levels_give_the_gain_from_the_slope_whatever_the_pedestal_is_thought_to_be() {
    let camera = Camera { prnu: 0.005, ..CMOS };
    let pairs = |pedestal: f64| -> Vec<PairPoints> {
        [2_000.0, 8_000.0, 20_000.0, 40_000.0]
            .iter()
            .enumerate()
            .map(|(k, level)| {
                let flats = camera.flats(&[*level, 1.01 * level], 40, 50 + k as u64);
                compare_flats(&flats[0], &flats[1], pedestal, 62_000.0).unwrap()
            })
            .collect()
    };
    let right = fit_transfer(&pairs(500.0), camera.table()).unwrap();
    assert!(right.from_slope && right.pairs.len() == 4);
    assert!((right.gain.e_per_adu / 0.8 - 1.0).abs() < 0.01, "{:?}", right.gain);
    assert!((right.fixed.e_per_adu / 0.8 - 1.0).abs() < 0.01, "{:?}", right.fixed);
    // the intercept is the read noise: (3.5/0.8)^2 + 1/12 ADU^2, small against its error
    let (intercept, err) = right.intercept_adu2.unwrap();
    assert!((intercept - 19.2).abs() < 4.0 * err, "{intercept} +- {err}");
    // 300 ADU wrong: 15 % of the lowest level, nothing of the slope
    let wrong = fit_transfer(&pairs(200.0), camera.table()).unwrap();
    assert!((wrong.gain.e_per_adu / 0.8 - 1.0).abs() < 0.01, "{:?}", wrong.gain);
    assert!((wrong.pairs[0].e_per_adu / 0.8 - 1.0).abs() > 0.1, "{:?}", wrong.pairs);
}

#[test]
fn a_measured_dark_variance_takes_the_place_of_the_table() {
    let pair = CMOS.pair([200.0, 205.0], 60, 21);
    let var = (3.5f64 / 0.8).powi(2) + 1.0 / 12.0;
    let by_table = fit_transfer(std::slice::from_ref(&pair), CMOS.table()).unwrap();
    let measured = fit_transfer(std::slice::from_ref(&pair), DarkNoise::Measured(var)).unwrap();
    assert!((by_table.gain.e_per_adu / measured.gain.e_per_adu - 1.0).abs() < 3e-3);
    // without any read noise the gain comes out 8 % low
    let none = fit_transfer(&[pair], DarkNoise::Measured(0.0)).unwrap();
    assert!(none.gain.e_per_adu < 0.95 * measured.gain.e_per_adu);
}

#[test]
fn what_is_no_pair_of_flats_is_refused_by_name() {
    let flats = CMOS.flats(&[30_000.0, 30_600.0, 12_000.0], 12, 3);
    let compare = |a: &[Vec<f32>], b: &[Vec<f32>]| compare_flats(a, b, 500.0, 62_000.0);
    let fitted = |p: PairPoints| fit_transfer(&[p], CMOS.table());
    assert_eq!(compare(&flats[0], &flats[0]), Err(Refusal::Identical));
    assert!(matches!(compare(&flats[0], &flats[2]), Err(Refusal::Unlike { ratio }) if (ratio - 2.5).abs() < 0.05));
    let full = vec![vec![65_535f32; SIDE * SIDE]; 4];
    assert!(matches!(compare(&full, &full), Err(Refusal::Saturated { blocks: 4, of: 4, .. })));
    // half of the field saturated is refused, a tenth is excluded
    let mut part = flats[0].clone();
    part.iter_mut().take(7).for_each(|b| b.iter_mut().step_by(100).for_each(|v| *v = 64_000.0));
    assert!(matches!(compare(&part, &flats[1]), Err(Refusal::Saturated { blocks: 7, of: 12, .. })));
    let mut corner = flats[0].clone();
    corner[0].iter_mut().for_each(|v| *v = 64_000.0);
    let t = fitted(compare(&corner, &flats[1]).unwrap()).unwrap();
    assert!((t.gain.e_per_adu / 0.8 - 1.0).abs() < 0.03);
    // no light at all, and less than the read noise
    let dark = Camera { pedestal_adu: 499.0, ..CMOS }.flats(&[0.01, 0.01], 12, 4);
    assert!(matches!(compare(&dark[0], &dark[1]), Err(Refusal::Dark { .. })));
    let faint = CMOS.flats(&[0.5, 0.5], 12, 5);
    assert!(matches!(compare(&faint[0], &faint[1]).and_then(fitted), Err(Refusal::Dark { .. })));
    // a copy with another factor has no noise of its own
    let scaled: Vec<Vec<f32>> =
        flats[0].iter().map(|b| b.iter().map(|v| 500.0 + 1.01 * (v - 500.0)).collect()).collect();
    assert!(matches!(compare(&flats[0], &scaled).and_then(fitted), Err(Refusal::Uncertain { .. })));
    // NaN pixels are excluded; nothing but NaN is refused
    let mut with_nan = flats[0].clone();
    with_nan.iter_mut().for_each(|b| b.iter_mut().step_by(7).for_each(|v| *v = f32::NAN));
    let t = fitted(compare(&with_nan, &flats[1]).unwrap()).unwrap();
    assert!((t.gain.e_per_adu / 0.8 - 1.0).abs() < 0.03);
    let nothing = vec![vec![f32::NAN; SIDE * SIDE]; 12];
    assert_eq!(compare(&nothing, &flats[1]), Err(Refusal::NoPixels));
    assert_eq!(compare(&[], &[]), Err(Refusal::NoPixels));
    assert_eq!(fit_transfer(&[], CMOS.table()), Err(Refusal::NoPixels));
}

#[test]
fn flats_that_were_smoothed_or_averaged_give_no_gain_a_table_would_agree_with() {
    // the mean of four flats has a fourth of the variance: four times the gain
    let flats = CMOS.flats(&[30_000.0; 8], 20, 9);
    let mean = |of: &[Vec<Vec<f32>>]| -> Vec<Vec<f32>> {
        (0..20).map(|b| (0..SIDE * SIDE).map(|i| of.iter().map(|f| f[b][i]).sum::<f32>() / 4.0).collect()).collect()
    };
    let pair = compare_flats(&mean(&flats[..4]), &mean(&flats[4..]), 500.0, 62_000.0).unwrap();
    let t = fit_transfer(&[pair], CMOS.table()).unwrap();
    assert!((t.gain.e_per_adu / 3.2 - 1.0).abs() < 0.05, "{:?}", t.gain);
}

#[test]
fn twice_the_electrons_per_count_is_twice_the_gain_and_the_order_of_the_flats_does_not_matter() {
    let flats = CMOS.flats(&[20_000.0, 21_000.0], 12, 31);
    let fit = |a: &[Vec<f32>], b: &[Vec<f32>], k: f32| {
        let scale = |f: &[Vec<f32>]| -> Vec<Vec<f32>> { f.iter().map(|b| b.iter().map(|v| v * k).collect()).collect() };
        let pair = compare_flats(&scale(a), &scale(b), 500.0 * f64::from(k), 1e9).unwrap();
        let digitisation_adu2 = f64::from(k * k) / 12.0;
        fit_transfer(&[pair], DarkNoise::Table { read_noise_e: 3.5, digitisation_adu2 }).unwrap().gain.e_per_adu
    };
    let plain = fit(&flats[0], &flats[1], 1.0);
    // powers of two are exact in f32
    assert!((fit(&flats[0], &flats[1], 0.5) / (2.0 * plain) - 1.0).abs() < 1e-9);
    assert!((fit(&flats[1], &flats[0], 1.0) / plain - 1.0).abs() < 1e-4);
}
