//! Two independent paths to one number: by how much they disagree at worst.
//!
//! In the unit each line names. What is compared shares no formula, no series and no quadrature; extended precision is
//! sums of two f64.

mod double;
mod light;

use hifitime::{Duration, Epoch};
use nalgebra::{Matrix3, Vector3};
use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use double::Double;

use super::earth_frames::{EOP, direction, iau_1980, turned};
use super::ephemeris::almanac;
use super::extremes::{Extreme, Verdict};
use super::median;
use super::zeropoint_fit::night;
use crate::base::constants::{ARCSEC_PER_RAD, AU_KM, SUN_RADIUS_KM};
use crate::base::error::Result;
use crate::base::vector::Vector;
use crate::config::{self, Estimator};
use crate::orbit::earth::{gcrs_to_itrs, teme_to_itrs};
use crate::orbit::{EarthOrientation, bodies};
use crate::photometry::aperture::{Shape, circle_sum, for_each_pixel};
use crate::zeropoint::fit::fit;

/// Every quantity with two paths; a line is wrong where they disagree by more than what is known of the lesser one.
#[must_use]
pub fn paths() -> Vec<Extreme> {
    let sun_rad = (SUN_RADIUS_KM / AU_KM).asin();
    let lines = [
        two(
            "Earth-reflected integral, all ground lit [relative]",
            "rings from the satellite, adaptive to 1e-10",
            "latitudes and longitudes on the ground, Gauss 160 x 320",
            || Ok(light::earth_integrals()),
            1e-8,
        ),
        two(
            "Lunar-Earthshine, the Moon 88 to -15 deg high under the satellite [relative]",
            "rings from the satellite, the Moon's place on each in closed form",
            "500 x 1000 patches, the Moon seen from each: direction, distance, phase",
            light::moonlit_ground,
            2e-3,
        ),
        two(
            "direct light over the Sun's disc [relative to the brightest]",
            "averages in closed form and by edges",
            "102 400 points of the disc",
            || Ok(light::disc_means(sun_rad)),
            1e-4,
        ),
        two(
            "share of the Sun in the penumbra, no air [share]",
            "discs in a plane, closed form",
            "4000 rings of caps on the sphere",
            || Ok(light::penumbrae(sun_rad)),
            5e-4,
        ),
        two(
            "celestial to Earth-fixed axes, 1990 to 2030 [arcsec]",
            "IAU 2006/2000A, origin of longitudes CIO",
            "IAU 1976/1980, equinox and sidereal time",
            || Ok(frames()),
            0.3,
        ),
        two(
            "SGP4's axes to Earth-fixed, 1990 to 2030 [arcsec]",
            "sidereal time of 1982 and polar motion",
            "by way of the stars: equation of the equinoxes, nutation and precession undone, IAU 2006/2000A",
            || Ok(teme()),
            0.5,
        ),
        two(
            "the Sun's direction, 1990 to 2030 [arcsec]",
            "ERFA epv00",
            "Astronomical Almanac, formula",
            || almanacs(true),
            60.0,
        ),
        two(
            "the Moon's direction, 1990 to 2030 [arcsec]",
            "ERFA moon98 (Meeus)",
            "Astronomical Almanac, formula (0.3 deg by its own account)",
            || almanacs(false),
            1500.0,
        ),
        two("area of an aperture [relative]", "exact shares of pixels, summed", "closed form", || Ok(areas()), 1e-12),
        two(
            "sum over an aperture, pixels from 1e-3 to 1e7 [relative]",
            "f64, row by row",
            "extended precision, sums of two f64",
            || Ok(aperture_sums()),
            1e-12,
        ),
        two(
            "median of a stack [stored units]",
            "sorting network",
            "plain sort",
            || Ok(median::worst_difference(20)),
            0.0,
        ),
        two(
            "zeropoint, ordinary least squares [mag]",
            "Givens rotations and singular values, centred",
            "normal equations and Cholesky, not centred",
            zeropoints,
            1e-8,
        ),
    ];
    lines.into()
}

/// One line of the table.
fn two(
    quantity: &'static str,
    one: &str,
    other: &str,
    worst: impl Fn() -> Result<(f64, usize)>,
    limit: f64,
) -> Extreme {
    let line = |case: String, error: Option<f64>, verdict: Verdict| Extreme {
        area: quantity,
        case,
        expected: one.into(),
        got: other.into(),
        error,
        limit: Some(limit),
        verdict,
    };
    match worst() {
        // written so that NaN is wrong
        Ok((worst, n)) => {
            let verdict = if worst <= limit { Verdict::Ok } else { Verdict::Wrong };
            line(format!("worst of {n}"), worst.is_finite().then_some(worst), verdict)
        }
        Err(error) => line(error.to_string(), None, Verdict::Wrong),
    }
}

/// A moment from 1990 to 2030.
fn moment(rng: &mut ChaCha12Rng) -> Epoch {
    Epoch::from_mjd_utc(47_892.0) + Duration::from_days(rng.random_range(0.0..14_610.0))
}

fn frames() -> (f64, usize) {
    let mut rng = ChaCha12Rng::seed_from_u64(33);
    let n = 300;
    let off = |_| {
        let (at, v) = (moment(&mut rng), direction(&mut rng));
        ARCSEC_PER_RAD * (gcrs_to_itrs(&at, &EOP).apply(&v) - turned(&iau_1980(&at), &v)).norm()
    };
    ((0..n).map(off).fold(0.0, f64::max), n)
}

/// TEME is the true equator of 1980 with the mean equinox: turned back by the equation of the equinoxes it is of date.
fn teme() -> (f64, usize) {
    let mut rng = ChaCha12Rng::seed_from_u64(34);
    let n = 300;
    let off = |_| {
        let at = moment(&mut rng);
        let v = direction(&mut rng).to_array();
        let direct = teme_to_itrs(&at, &EOP).apply(&Vector::new(v[0], v[1], v[2]));
        let (t1, t2) = crate::orbit::time::tt(&at);
        let (s, c) = erfars::rotationtime::Eqeq94(t1, t2).sin_cos();
        // of date: R3(−EqE) of TEME
        let date = [c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]];
        let mut m = [0.0; 9];
        erfars::precnutpolar::Pnm80(t1, t2, &mut m);
        let column = |j: usize| m[j] * date[0] + m[3 + j] * date[1] + m[6 + j] * date[2];
        let by_the_stars = gcrs_to_itrs(&at, &EOP).apply(&Vector::new(column(0), column(1), column(2)));
        ARCSEC_PER_RAD * (direct - by_the_stars).norm()
    };
    ((0..n).map(off).fold(0.0, f64::max), n)
}

fn almanacs(of_sun: bool) -> Result<(f64, usize)> {
    let mut rng = ChaCha12Rng::seed_from_u64(35);
    let (mut worst, n) = (0.0f64, 300);
    for _ in 0..n {
        let at = moment(&mut rng);
        let (ours, other) = (bodies(&at, &EarthOrientation::default())?, almanac(&at));
        let apart = if of_sun {
            ours.sun_itrs_km.angle_to(&other.sun_itrs_km)
        } else {
            ours.moon_itrs_km.angle_to(&other.moon_itrs_km)
        };
        worst = worst.max(ARCSEC_PER_RAD * apart);
    }
    Ok((worst, n))
}

fn areas() -> (f64, usize) {
    let mut rng = ChaCha12Rng::seed_from_u64(36);
    let (mut worst, n) = (0.0f64, 200);
    for k in 0..n {
        let (a_px, b_px) = (rng.random_range(3.0..40.0), rng.random_range(1.0..3.0));
        let theta_rad = rng.random_range(0.0..std::f64::consts::PI);
        let shape = match k % 4 {
            0 => Shape::Circle { r_px: a_px },
            1 => Shape::Ellipse { a_px, b_px, theta_rad },
            2 => Shape::Rectangle { a_px, b_px, theta_rad },
            _ => Shape::Pill { a_px, b_px, theta_rad },
        };
        let (x, y) = (60.0 + rng.random_range(-0.5..0.5), 60.0 + rng.random_range(-0.5..0.5));
        let bounds = crate::photometry::aperture::Bounds { x0: 0, x1: 121, y0: 0, y1: 121 };
        let mut sum = 0.0;
        for_each_pixel(&shape, x, y, bounds, |_, _, share| sum += share);
        worst = worst.max((sum / shape.area_px() - 1.0).abs());
    }
    (worst, n)
}

fn aperture_sums() -> (f64, usize) {
    let mut rng = ChaCha12Rng::seed_from_u64(37);
    let pixels = Array2::from_shape_fn((121, 121), |_| 10f64.powf(rng.random_range(-3.0..7.0)));
    let (mut worst, n) = (0.0f64, 100);
    for _ in 0..n {
        let (x, y, r_px) =
            (60.0 + rng.random_range(-0.5..0.5), 60.0 + rng.random_range(-0.5..0.5), rng.random_range(2.0..50.0));
        let bounds = crate::photometry::aperture::Bounds { x0: 0, x1: 121, y0: 0, y1: 121 };
        let mut exact = Double::default();
        for_each_pixel(&Shape::Circle { r_px }, x, y, bounds, |i, j, share| {
            exact = exact.add_product(share, pixels[[j, i]])
        });
        worst = worst.max((circle_sum(&pixels, x, y, r_px) / exact.0 - 1.0).abs());
    }
    (worst, n)
}

/// ZP, k and C of equal weights.
fn zeropoints() -> Result<(f64, usize)> {
    let config = config::Zeropoint { estimator: Estimator::Ols, ..config::Zeropoint::default() };
    let (mut worst, n) = (0.0f64, 20);
    for seed in 0..n as u64 {
        let stars = night(3000 + seed, 0.0);
        let z = fit(&stars, &config)?;
        let (mut a, mut b) = (Matrix3::<f64>::zeros(), Vector3::<f64>::zeros());
        for star in &stars {
            let row = Vector3::new(1.0, star.airmass, star.b_v_mag);
            a += row * row.transpose();
            b += row * (star.inst_mag - star.v_mag);
        }
        let solved = a.cholesky().map(|c| c.solve(&b)).unwrap_or_else(|| Vector3::repeat(f64::NAN));
        for (ours, other) in [z.zp_mag, z.k_mag_airmass, z.c_mag_mag].into_iter().zip(solved.iter()) {
            worst = worst.max((ours - other).abs());
            if !other.is_finite() {
                worst = f64::NAN;
            }
        }
    }
    Ok((worst, n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_paths_to_one_number_disagree_by_no_more_than_is_known_of_the_lesser() {
        let all = paths();
        let wrong: Vec<&Extreme> = all.iter().filter(|e| e.verdict != Verdict::Ok).collect();
        assert!(wrong.is_empty(), "{wrong:#?}");
        assert!(all.len() >= 12);
    }
}
