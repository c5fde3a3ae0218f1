//! Fluxes against a plain reference: pixel by pixel, polygons clipped by the disc, the sky by ordering f64.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene;

use ndarray::Array2;
use photometry_scene::frame;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal};
use satphot::base::stats;
use satphot::frames::{Electrons, Frame, mask};
use satphot::photometry::Flags;
use satphot::photometry::aperture::Shape;
use satphot::photometry::background::{Background, background};
use satphot::photometry::flux::{Flux, Neighbour, measure, measure_all};

/// Flux, area, sky, its scatter, pixels kept, highest pixel, flags but those of the sky's crowding.
struct Plain {
    flux_e: f64,
    area_px: f64,
    sky_e_px: f64,
    sky_rms_e: f64,
    n_sky: usize,
    peak_e: f64,
    flags: Flags,
}

/// The definition of `measure`, written down without regard to speed. Only for frames that begin at (0, 0).
fn plain(
    frame: &Frame<Electrons>,
    sky: &Background,
    (x, y): (f64, f64),
    shape: Shape,
    (r_in, r_out): (f64, f64),
    k: f64,
) -> Plain {
    let mut flags = Flags::default();
    let mut values = Vec::new();
    for ((j, i), v) in frame.pixels.indexed_iter() {
        let r2 = (i as f64 - x).powi(2) + (j as f64 - y).powi(2);
        if r2 >= r_in * r_in && r2 <= r_out * r_out {
            if frame.mask[[j, i]] & mask::CLIPPED != 0 {
                flags.set(Flags::CLIP_EDGE);
            }
            if frame.mask[[j, i]] == 0 && v.is_finite() {
                values.push(f64::from(*v));
            }
        }
    }
    let sampled = values.len() as f64;
    let (mut level, mut rms, mut n_sky) = (sky.level(x, y), sky.rms(x, y), 0);
    if values.len() < 16 {
        flags.set(Flags::NO_ANNULUS);
    } else {
        let c = stats::sigma_clip(&mut values, k).unwrap();
        let location = stats::smoothed_median(&values[..c.n], c.median, c.sigma).unwrap();
        let variance = c.sigma * c.sigma;
        let share = if variance > 0.0 { (location.max(0.0) / variance).min(1.0) } else { 0.0 };
        level = location + stats::smoothed_median_skew_shift(k) * share;
        (rms, n_sky) = (c.sigma, c.n);
        let by_noise = 1.0 - stats::gauss_within(k);
        if c.n_rejected as f64 > sampled * (by_noise + 0.02) + 5.0 * (sampled * by_noise).sqrt() {
            flags.set(Flags::CROWDED_ANNULUS);
        }
    }
    let (mut area, mut good, mut sum, mut peak) = (0.0, 0.0, 0.0, f64::NAN);
    for ((j, i), v) in frame.pixels.indexed_iter() {
        let share = shape.pixel_fraction(i as f64 - x, j as f64 - y);
        // a share of rounding alone is none
        if share < 1e-13 {
            continue;
        }
        area += share;
        let m = frame.mask[[j, i]];
        if m & mask::SATURATED != 0 {
            flags.set(Flags::SATURATED);
        }
        if m & mask::CLIPPED != 0 {
            flags.set(Flags::CLIP_EDGE);
        }
        if m & (mask::BAD | mask::CLIPPED) != 0 || !v.is_finite() {
            flags.set(Flags::MASKED);
            if let Some(v) = (m & mask::CLIPPED == 0).then(|| from_neighbours(frame, j, i)).flatten() {
                good += share;
                sum += share * (v - level);
            }
            continue;
        }
        good += share;
        sum += share * (f64::from(*v) - level);
        peak = peak.max(f64::from(*v) - level);
    }
    let flux_e = if good > 0.0 { sum * area / good } else { f64::NAN };
    if area < shape.area_px() * (1.0 - 1e-9) {
        flags.set(Flags::EDGE);
    }
    if flux_e <= 0.0 {
        flags.set(Flags::NEGATIVE);
    }
    Plain { flux_e, area_px: area, sky_e_px: level, sky_rms_e: rms, n_sky, peak_e: peak, flags }
}

/// The value at (j, i) of the surface of second order through its eight neighbours, if all are good: by least squares the
/// constant of a + b x + c y + d x² + e y² + f x y is (5 − 3x² − 3y²)/9 of the nine; without the middle one twice the mean of the four
/// next to it less that of the four corners.
fn from_neighbours(frame: &Frame<Electrons>, j: usize, i: usize) -> Option<f64> {
    let (ny, nx) = frame.pixels.dim();
    if j == 0 || i == 0 || j + 1 == ny || i + 1 == nx {
        return None;
    }
    let good = |dj: usize, di: usize| {
        let at = [j + dj - 1, i + di - 1];
        (frame.mask[at] == 0 && frame.pixels[at].is_finite()).then(|| f64::from(frame.pixels[at]))
    };
    let mean = |places: [(usize, usize); 4]| {
        let values: Option<Vec<f64>> = places.iter().map(|(dj, di)| good(*dj, *di)).collect();
        values.map(|v| v.iter().sum::<f64>() / 4.0)
    };
    Some(2.0 * mean([(0, 1), (1, 0), (1, 2), (2, 1)])? - mean([(0, 0), (0, 2), (2, 0), (2, 2)])?)
}

fn assert_same(got: &Flux, want: &Plain, what: &str) {
    assert_eq!((got.flags, got.n_sky), (want.flags, want.n_sky), "{what}: {} / {}", got.flags, want.flags);
    assert_eq!(got.flux_e.is_nan(), want.flux_e.is_nan(), "{what}");
    // rounding, of all the light that was summed: the sky is subtracted
    let light = want.flux_e.abs() + want.area_px * (want.sky_e_px.abs() + want.sky_rms_e);
    let close = |a: f64, b: f64, scale: f64| (a.is_nan() && b.is_nan()) || (a - b).abs() <= 1e-12 * scale;
    assert!(close(got.flux_e, want.flux_e, light), "{what}: {} {}", got.flux_e, want.flux_e);
    assert!(close(got.area_px, want.area_px, want.area_px.max(1.0)), "{what}: {} {}", got.area_px, want.area_px);
    let level = want.sky_e_px.abs() + want.sky_rms_e;
    assert!(close(got.sky_e_px, want.sky_e_px, level), "{what}: {} {}", got.sky_e_px, want.sky_e_px);
    assert!(close(got.sky_rms_e, want.sky_rms_e, level), "{what}: {} {}", got.sky_rms_e, want.sky_rms_e);
    assert!(close(got.peak_e, want.peak_e, want.peak_e.abs() + level), "{what}: {} {}", got.peak_e, want.peak_e);
}

const NX: usize = 230;
const NY: usize = 190;

/// Noise of `sigma` on `sky`, whole numbers of `step` if that is above 0, with stars, bad, saturated and clipped pixels.
fn noisy(sky: f64, sigma: f64, step: f64, seed: u64) -> Frame<Electrons> {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let noise = Normal::new(sky, sigma).unwrap();
    let mut pixels = Array2::from_shape_simple_fn((NY, NX), || noise.sample(&mut rng));
    for _ in 0..12 {
        let (x, y, e) =
            (rng.random_range(0.0..230.0), rng.random_range(0.0..190.0), sigma * rng.random_range(5.0..5e3));
        for ((j, i), v) in pixels.indexed_iter_mut() {
            *v += e * (-((i as f64 - x).powi(2) + (j as f64 - y).powi(2)) / 8.0).exp();
        }
    }
    if step > 0.0 {
        pixels.mapv_inplace(|v| (v / step).round() * step);
    }
    let mut frame = frame(pixels.mapv(|v| v as f32), 2.0);
    for _ in 0..25 {
        let at = [rng.random_range(0..NY), rng.random_range(0..NX)];
        frame.mask[at] = [mask::BAD, mask::SATURATED, mask::CLIPPED][rng.random_range(0..3)];
        frame.pixels[at] = [f32::NAN, f32::INFINITY, -7e30, 65_535.0][rng.random_range(0..4)];
    }
    frame.pixels[[50, 60]] = f32::NAN; // not even masked
    frame
}

#[test]
fn fluxes_are_those_of_the_plain_definition() {
    let shapes = [
        Shape::Circle { r_px: 0.3 },
        Shape::Circle { r_px: 5.0 },
        Shape::Circle { r_px: 20.0 },
        Shape::Ellipse { a_px: 40.0, b_px: 9.0, theta_rad: 0.6 },
        Shape::Ellipse { a_px: 12.0, b_px: 1.0, theta_rad: -1.1 },
        Shape::Rectangle { a_px: 14.0, b_px: 3.0, theta_rad: 0.3 },
        Shape::Pill { a_px: 20.0, b_px: 4.0, theta_rad: 2.0 },
    ];
    // dark, bright, digitised in steps of half σ and of two σ, far below one electron, far above all
    let skies = [(100.0, 10.0, 0.0), (-3.0, 2.0, 0.0), (50.0, 5.0, 2.5), (50.0, 5.0, 10.0), (1e-3, 1e-4, 0.0)];
    let (mut n, mut crowded) = (0, 0);
    for (seed, (level, sigma, step)) in skies.into_iter().chain([(1e12, 1e6, 0.0)]).enumerate() {
        let frame = noisy(level, sigma, step, seed as u64);
        let sky = background(&frame, 48, 3.0).unwrap();
        let mut rng = ChaCha12Rng::seed_from_u64(100 + seed as u64);
        for _ in 0..40 {
            let at = (rng.random_range(-15.0..245.0), rng.random_range(-15.0..205.0));
            let shape = shapes[rng.random_range(0..shapes.len())];
            let radii = (rng.random_range(0.0..12.0), rng.random_range(2.0..40.0));
            let k = rng.random_range(1.0..4.0);
            let got = measure(&frame, &sky, at.0, at.1, shape, radii.0, radii.1, k);
            let what = format!("sky {level} +- {sigma}, {shape:?} at {at:?}, annulus {radii:?}, clip {k}");
            assert_same(&got, &plain(&frame, &sky, at, shape, radii, k), &what);
            n += 1;
            crowded += usize::from(got.flags.has(Flags::CROWDED_ANNULUS));
        }
    }
    assert!(n == 240 && crowded > 5, "{n} {crowded}");
}

#[test]
fn many_stars_at_once_are_those_of_one_by_one_on_any_number_of_threads() {
    let frame = noisy(100.0, 10.0, 0.0, 77);
    let sky = background(&frame, 48, 3.0).unwrap();
    let mut rng = ChaCha12Rng::seed_from_u64(5);
    let mut places: Vec<(f64, f64)> =
        (0..300).map(|_| (rng.random_range(-20.0..250.0), rng.random_range(-20.0..210.0))).collect();
    // what cannot be measured must not spoil the others
    for (k, bad) in [(f64::NAN, 3.0), (3.0, f64::NAN), (f64::INFINITY, 1.0), (1e300, -1e300)].into_iter().enumerate() {
        places[17 * k + 3] = bad;
    }
    let shape = Shape::Circle { r_px: 6.0 };
    // Debug writes every digit, and NaN as NaN
    let one_by_one: Vec<String> =
        places.iter().map(|&(x, y)| format!("{:?}", measure(&frame, &sky, x, y, shape, 9.0, 15.0, 3.0))).collect();
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let at_once = pool.install(|| measure_all(&frame, &sky, &places, shape, (9.0, 15.0), 3.0, &[]));
        let at_once: Vec<String> = at_once.iter().map(|flux| format!("{flux:?}")).collect();
        assert_eq!(at_once, one_by_one, "{threads} threads");
    }
    assert!(measure_all(&frame, &sky, &[], shape, (9.0, 15.0), 3.0, &[]).is_empty());
}

#[test]
fn an_annulus_without_a_valid_pixel_spoils_no_other_star() {
    let mut f = frame(Array2::from_elem((120, 120), 100.0), 2.0);
    for ((j, i), m) in f.mask.indexed_iter_mut() {
        let r = (i as f64 - 30.0).hypot(j as f64 - 30.0);
        if r > 7.0 && r < 25.0 {
            *m = mask::BAD;
        }
    }
    f.pixels[[30, 30]] += 500.0;
    f.pixels[[90, 90]] += 500.0;
    let sky = background(&f, 40, 3.0).unwrap();
    let shape = Shape::Circle { r_px: 4.0 };
    let got = measure_all(&f, &sky, &[(30.0, 30.0), (90.0, 90.0)], shape, (8.0, 16.0), 3.0, &[]);
    assert_eq!((got[0].flags, got[0].n_sky), (Flags::NO_ANNULUS, 0));
    assert_eq!(got[1].flags, Flags::default());
    for star in got {
        assert!((star.flux_e - 500.0).abs() < 1e-9, "{}", star.flux_e);
    }
}

#[test]
fn a_radius_of_1000_px_and_one_below_half_a_pixel_are_measured() {
    let n = 2700;
    let mut f = frame(Array2::from_elem((n, n), 64.0), 2.0);
    f.pixels[[1350, 1350]] += 4096.0;
    let sky = background(&f, 64, 3.0).unwrap();
    let wide = measure(&f, &sky, 1350.3, 1349.8, Shape::Circle { r_px: 1000.0 }, 1100.0, 1300.0, 3.0);
    assert!((wide.area_px / (std::f64::consts::PI * 1e6) - 1.0).abs() < 1e-13);
    assert!((wide.flux_e - 4096.0).abs() < 1e-9 && wide.flags == Flags::default());
    // the corners of the frame are 1909 px away: all of it is inside, and not all of the circle is on it
    let all = measure(&f, &sky, 1350.3, 1349.8, Shape::Circle { r_px: 1e4 }, 1100.0, 1300.0, 3.0);
    assert!(all.area_px == (n * n) as f64 && all.flags == Flags::EDGE && (all.flux_e - 4096.0).abs() < 1e-9);
    let tiny = measure(&f, &sky, 1350.1, 1350.2, Shape::Circle { r_px: 0.2 }, 10.0, 20.0, 3.0);
    assert!((tiny.flux_e / (4096.0 * std::f64::consts::PI * 0.04) - 1.0).abs() < 1e-12, "{}", tiny.flux_e);
}

#[test]
fn frames_of_1e12_electrons_and_skies_of_1e_minus_3_keep_six_digits() {
    // whole multiples of the step of f32 at the sky: what is measured is exact, so every digit lost is ours
    for (level, step, scatter) in [(1e12f32, 65_536.0f32, 30.0), (1e-3, 1.164_153_2e-10, 0.0)] {
        let mut rng = ChaCha12Rng::seed_from_u64(3);
        let steps = Normal::new(0.0, scatter).unwrap();
        let mut pixels =
            Array2::from_shape_simple_fn((161, 161), || level + f64::round(steps.sample(&mut rng)) as f32 * step);
        // a star of a thousandth of the sky per pixel
        let star = 4096.0 * step;
        for j in 78..83 {
            for i in 78..83 {
                pixels[[j, i]] = level + star;
            }
        }
        let f = frame(pixels, 0.0);
        let sky = background(&f, 40, 3.0).unwrap();
        let got =
            measure(&f, &sky, 80.0, 80.0, Shape::Rectangle { a_px: 2.5, b_px: 2.5, theta_rad: 0.0 }, 20.0, 60.0, 3.0);
        let want = 25.0 * f64::from(f.pixels[[80, 80]]) - 25.0 * got.sky_e_px;
        assert!((got.flux_e / want - 1.0).abs() < 1e-6, "{level}: {} {want}", got.flux_e);
        assert!((got.sky_e_px / f64::from(level) - 1.0).abs() < 1e-6, "{level}: {}", got.sky_e_px);
        assert!((got.flux_e / (25.0 * f64::from(star)) - 1.0).abs() < 2e-3, "{level}: {}", got.flux_e);
        let rms = scatter * f64::from(step);
        assert!((got.sky_rms_e - rms).abs() <= 0.03 * rms, "{level}: {}", got.sky_rms_e);
    }
}

#[test]
fn one_frame_holds_stars_of_1e_minus_2_and_1e8_electrons() {
    // 1e10 between the brightest and the faintest, on a sky of 0: f32 holds both, and so must every sum
    let mut pixels = Array2::zeros((200, 200));
    pixels[[100, 50]] = 1e8;
    pixels[[100, 150]] = 1e-2;
    let f = frame(pixels, 0.0);
    let sky = background(&f, 40, 3.0).unwrap();
    let places = [(50.2, 100.1), (150.2, 100.1)];
    let got = measure_all(&f, &sky, &places, Shape::Circle { r_px: 8.0 }, (12.0, 20.0), 3.0, &[]);
    assert!((got[0].flux_e / 1e8 - 1.0).abs() < 1e-12);
    assert!((got[1].flux_e / f64::from(1e-2f32) - 1.0).abs() < 1e-12);
    // within one aperture: the faint light is a whole number of steps of f64 at the bright light
    let mut pixels = Array2::zeros((81, 81));
    pixels[[40, 40]] = 1e8;
    pixels[[43, 41]] = 1e-2;
    let f = frame(pixels, 0.0);
    let both = measure(&f, &background(&f, 40, 3.0).unwrap(), 40.0, 40.0, Shape::Circle { r_px: 8.0 }, 12.0, 20.0, 3.0);
    assert!((both.flux_e - 1e8 - f64::from(1e-2f32)).abs() < 1e-6, "{}", both.flux_e - 1e8);
}

#[test]
fn a_dark_flat_sky_and_a_sky_of_two_levels_are_clipped_as_defined() {
    // the MAD is 0 in both: the standard deviation takes its place
    for levels in [[7.0f32, 7.0, 7.0, 7.0], [7.0, 7.0, 7.0, 8.5]] {
        let f = frame(Array2::from_shape_fn((90, 90), |(j, i)| levels[(3 * i + 5 * j) % 4]), 1.0);
        let sky = background(&f, 40, 3.0).unwrap();
        let shape = Shape::Circle { r_px: 4.0 };
        let got = measure(&f, &sky, 45.0, 45.0, shape, 8.0, 20.0, 3.0);
        assert_same(&got, &plain(&f, &sky, (45.0, 45.0), shape, (8.0, 20.0), 3.0), &format!("{levels:?}"));
    }
}

/// Faint stars per annulus as near the galactic plane: 900 of 900 to 9000 e⁻ on 600 × 600 pixels, about 100 stars of 6000 e⁻.
///
/// The mean of the latter without faint ones in their own apertures, and its error, as shares of the truth.
fn mean_among_faint_stars(covering: bool) -> (f64, f64) {
    let (n, fwhm, flux_e, shape) = (600, 4.0, 6_000.0, Shape::Circle { r_px: 8.0 });
    let mut rng = ChaCha12Rng::seed_from_u64(25_128);
    let places: Vec<(f64, f64)> = (0..100)
        .map(|k| (40.0 + 57.0 * f64::from(k % 10), 40.0 + 57.0 * f64::from(k / 10)))
        .map(|(x, y)| (x + rng.random_range(-4.0..4.0), y + rng.random_range(-4.0..4.0)))
        .collect();
    let mut scene = photometry_scene::Scene::new(n, n, 130.0);
    places.iter().for_each(|&(x, y)| scene.star(x, y, flux_e, fwhm));
    let mut faint = Vec::new();
    while faint.len() < 900 {
        let (x, y) = (rng.random_range(0.0..n as f64), rng.random_range(0.0..n as f64));
        let e: f64 = 900.0 * 10f64.powf(rng.random::<f64>());
        // none in an aperture: the sky alone is tested
        if places.iter().all(|p| (p.0 - x).hypot(p.1 - y) > 14.0) {
            scene.star(x, y, e, fwhm);
            faint.push(Neighbour { x_px: x, y_px: y, r_px: 1.8 * fwhm });
        }
    }
    let f = scene.expose(2.0, 25_129);
    let sky = background(&f, 64, 3.0).unwrap();
    let fluxes = measure_all(&f, &sky, &places, shape, (12.0, 20.0), 3.0, if covering { &faint } else { &[] });
    let shares: Vec<f64> = fluxes.iter().map(|flux| flux.flux_e / flux_e).collect();
    let (mean, sd) = photometry_scene::mean_sd(&shares);
    (mean, sd / (shares.len() as f64).sqrt())
}

#[test]
fn faint_stars_in_the_annuli_take_no_light_where_they_are_known() {
    let (plain, plain_err) = mean_among_faint_stars(false);
    let (between, between_err) = mean_among_faint_stars(true);
    assert!(plain < 0.985 && plain_err < 0.005, "{plain} +- {plain_err}: what is tested is not there");
    assert!((between - 1.0).abs() < 3.0 * between_err && between_err < 0.005, "{between} +- {between_err}");
}

#[test]
fn neighbours_change_nothing_where_they_are_far_in_the_aperture_or_everywhere() {
    let scene = {
        let mut scene = photometry_scene::Scene::new(120, 120, 130.0);
        scene.star(60.0, 60.0, 9_000.0, 4.0);
        scene
    };
    let f = scene.expose(2.0, 7);
    let sky = background(&f, 40, 3.0).unwrap();
    let with = |others: &[Neighbour]| {
        let got = measure_all(&f, &sky, &[(60.0, 60.0)], Shape::Circle { r_px: 8.0 }, (12.0, 20.0), 3.0, others);
        format!("{got:?}")
    };
    let star = |x_px: f64, y_px: f64, r_px: f64| Neighbour { x_px, y_px, r_px };
    let alone = with(&[]);
    // far, the star itself, light that covers more than most of the annulus, places that are none
    for others in [
        star(100.0, 60.0, 15.0),
        star(60.5, 59.0, 30.0),
        star(72.0, 60.0, 60.0),
        star(f64::NAN, 60.0, 9.0),
        star(70.0, f64::NAN, 9.0),
    ] {
        assert_eq!(with(&[others]), alone, "{others:?}");
    }
    assert_ne!(with(&[star(74.0, 60.0, 6.0)]), alone);
}
