//! Trails of known length in cutouts of their own, against what was put in.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use statrs::function::erf::erf;

use super::*;
use crate::base::constants::FWHM_PER_SIGMA;
use crate::photometry::aperture::Shape;

const DIM: (usize, usize) = (240, 260);
const FWHM: f64 = 4.0;
const SIGMA: f64 = FWHM / FWHM_PER_SIGMA;
const NOISE_E: f64 = 8.0;
const THETA: f64 = 0.45;
const LENGTH: f64 = 120.0;

/// Middle of a trail \[px\] and its light \[e⁻ per pixel of length\].
type Trail = ((f64, f64), f64);

/// Two trails whose ends lie in the cutout, and one that leaves it.
const TRAILS: [Trail; 3] = [((120.0, 130.0), 400.0), ((150.0, 60.0), 150.0), ((250.0, 180.0), 300.0)];

/// Light of a trail smeared by a star.
fn light(((x0, y0), light): Trail, x: f64, y: f64) -> f64 {
    let (sin, cos) = THETA.sin_cos();
    let (u, v) = ((x - x0) * cos + (y - y0) * sin, (y - y0) * cos - (x - x0) * sin);
    let step = |u: f64| 0.5 * erf(u / (std::f64::consts::SQRT_2 * SIGMA));
    let across = (-0.5 * (v / SIGMA).powi(2)).exp() / (std::f64::consts::TAU.sqrt() * SIGMA);
    light * across * (step(u + 0.5 * LENGTH) - step(u - 0.5 * LENGTH))
}

/// The trails under noise of the sky and their own photons.
fn cutout(trails: &[Trail], seed: u64) -> Array2<f32> {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    Array2::from_shape_fn(DIM, |(j, i)| {
        let of_trails: f64 = trails.iter().map(|t| light(*t, i as f64, j as f64)).sum();
        // a sum of twelve: Gaussian enough
        let noise = (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
        (of_trails + noise * NOISE_E.hypot(of_trails.sqrt())) as f32
    })
}

fn found(pixels: &Array2<f32>, theta: f64, length: f64, object: Option<Placed>) -> Option<Segments> {
    Segments::find(pixels, (theta, length), FWHM, (NOISE_E, 1.0), |turned| {
        object.iter().map(|at| ExclusionMask::of(turned, (at.x, at.y), at.shape)).collect()
    })
}

/// A round target on the brightest trail.
fn target() -> Placed {
    Placed { x: 118.0, y: 133.0, shape: Shape::Circle { r_px: 2.0 * FWHM } }
}

fn sum_in(at: &Placed, of: impl Fn(f64, f64) -> f64) -> f64 {
    let r = at.shape.bounding_radius_px();
    let inside = |(j, i): &(usize, usize)| (*i as f64 - at.x).hypot(*j as f64 - at.y) < r;
    ndarray::indices(DIM).into_iter().filter(inside).map(|(j, i)| of(i as f64, j as f64)).sum()
}

#[test]
fn each_trail_is_found_with_its_ends_and_its_light_also_under_a_target() {
    let object = target();
    let mut pixels = cutout(&TRAILS, 5);
    for ((j, i), v) in pixels.indexed_iter_mut() {
        let r = (i as f64 - object.x).hypot(j as f64 - object.y);
        *v += (3000.0 * (-0.5 * (r / SIGMA).powi(2)).exp()) as f32;
    }
    // the direction is known to a third of a degree
    for theta in [THETA, THETA - 0.006] {
        let segments = found(&pixels, theta, LENGTH, Some(object)).unwrap();
        assert_eq!(segments.list.len(), 3, "{:?}", segments.list.iter().map(|s| s.u).collect::<Vec<_>>());
        for trail in &TRAILS[..2] {
            let (u, v) = segments.turned.uv(trail.0.0, trail.0.1);
            let near = |s: &&Segment| (s.first as f64 + s.profile.len() as f64 / 2.0 - segments.half - v).abs() < FWHM;
            let segment = segments.list.iter().find(near).unwrap();
            for (end, wanted) in [(segment.u.0, u - 0.5 * LENGTH), (segment.u.1, u + 0.5 * LENGTH)] {
                assert!((end - wanted).abs() < 0.3 * FWHM, "{end} {wanted}");
            }
        }
        let wanted = sum_in(&object, |x, y| TRAILS.iter().map(|t| light(*t, x, y)).sum());
        let got = sum_in(&object, |x, y| segments.at(x, y));
        assert!((got / wanted - 1.0).abs() < 0.03, "{got} {wanted}");
        assert!((f64::from(segments.light[[133, 118]]) - segments.at(118.0, 133.0)).abs() < 1e-2);
    }
}

#[test]
fn the_stated_variance_is_that_of_the_light_in_an_aperture() {
    let object = target();
    let wanted = sum_in(&object, |x, y| TRAILS.iter().map(|t| light(*t, x, y)).sum());
    let pulls: Vec<f64> = (0..40)
        .map(|seed| {
            let segments = found(&cutout(&TRAILS, 100 + seed), THETA, LENGTH, Some(object)).unwrap();
            (sum_in(&object, |x, y| segments.at(x, y)) - wanted) / segments.variance(&object).sqrt()
        })
        .collect();
    let rms = (pulls.iter().map(|p| p * p).sum::<f64>() / pulls.len() as f64).sqrt();
    let mean = pulls.iter().sum::<f64>() / pulls.len() as f64;
    assert!((0.5..1.5).contains(&rms) && mean.abs() < 1.0, "rms {rms:.2} mean {mean:.2}");
}

#[test]
fn noise_and_stars_are_no_trails_and_what_crosses_gives_none_above_the_noise() {
    let mut false_trails = 0;
    for seed in 0..40 {
        let mut pixels = cutout(&[], seed);
        assert!(found(&pixels, THETA, LENGTH, None).is_none(), "noise {seed}");
        // a bright star that is not hidden
        for ((j, i), v) in pixels.indexed_iter_mut() {
            let r = (i as f64 - 90.0).hypot(j as f64 - 100.0);
            *v += (3000.0 * (-0.5 * (r / SIGMA).powi(2)).exp()) as f32;
        }
        assert!(found(&pixels, THETA, LENGTH, None).is_none(), "star {seed}");
        // where all three are crossed their faint ends may add up to something
        for segment in found(&cutout(&TRAILS, seed), THETA + 0.8, LENGTH, None).iter().flat_map(|found| &found.list) {
            let peak = segment.profile.iter().copied().fold(0.0, f32::max);
            assert!(f64::from(peak) < NOISE_E, "{peak} e- per pixel at {seed}");
            false_trails += 1;
        }
    }
    assert!(false_trails <= 6, "{false_trails} in 40 cutouts");
}
