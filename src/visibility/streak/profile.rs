//! The profile across a trail: a disc (the satellite), another (the mirror, out of focus) and a Gaussian (the seeing),
//! folded together.
//!
//! Angles in arcsec, shares of 1. The widest of the three is integrated in closed form, the others by midpoints, so that
//! nothing narrow is ever sampled.

use std::f64::consts::PI;

use statrs::function::erf::erf;

use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::error::Result;
use crate::visibility::simple::above_zero;

/// Midpoints over each of the two narrower parts: the share is good to 1e-4 (see the tests).
const NODES: usize = 128;
/// Reach of the Gaussian \[σ\].
const REACH: f64 = 6.0;

/// Share of the light that falls on a strip of width `strip` along the middle of the trail.
///
/// `∫ p(x) dx` over the strip, p the density across the motion: of a disc of diameter D `(8/πD²) sqrt(D²/4 − x²)`.
///
/// # Errors
/// [`crate::Error::Model`] for a width that is not above 0.
pub fn strip_share(strip: f64, disc: f64, other_disc: f64, fwhm: f64) -> Result<f64> {
    let half = 0.5 * above_zero("pix_arcsec", strip)?;
    let (wide, narrow) = if disc >= other_disc { (disc, other_disc) } else { (other_disc, disc) };
    let (wide, narrow) = (above_zero("satellite_arcsec", wide)?, above_zero("defocus_arcsec", narrow)?);
    let sigma = above_zero("fwhm_arcsec", fwhm)? / FWHM_PER_SIGMA;
    if sigma > 0.25 * wide {
        // the standard deviation of a disc is D/4: the Gaussian is the widest
        let below = |x: f64| 0.5 * (1.0 + erf(x / (sigma * 2f64.sqrt())));
        return Ok(mean(&disc_nodes(wide), &disc_nodes(narrow), |x| below(x + half) - below(x - half)));
    }
    let below = |x: f64| disc_below(x, wide);
    Ok(mean(&disc_nodes(narrow), &gaussian_nodes(sigma), |x| below(x + half) - below(x - half)))
}

/// Share of a disc of diameter `d` left of `x`: `½ + (u sqrt(1 − u²) + asin u)/π`, u = 2x/d.
fn disc_below(x: f64, d: f64) -> f64 {
    let u = (2.0 * x / d).clamp(-1.0, 1.0);
    0.5 + (u * (1.0 - u * u).sqrt() + u.asin()) / PI
}

/// Places and weights over a disc: x = (d/2) cos t, the weight `(2/π) sin² t dt`.
fn disc_nodes(d: f64) -> Vec<(f64, f64)> {
    let step = PI / NODES as f64;
    (0..NODES)
        .map(|i| {
            let t = (i as f64 + 0.5) * step;
            (0.5 * d * t.cos(), 2.0 / PI * t.sin().powi(2) * step)
        })
        .collect()
}

/// Places and weights over a Gaussian.
fn gaussian_nodes(sigma: f64) -> Vec<(f64, f64)> {
    let step = 2.0 * REACH / NODES as f64;
    let at = |i: usize| (i as f64 + 0.5) * step - REACH;
    let total: f64 = (0..NODES).map(|i| (-0.5 * at(i).powi(2)).exp()).sum();
    (0..NODES).map(|i| (sigma * at(i), (-0.5 * at(i).powi(2)).exp() / total)).collect()
}

fn mean(a: &[(f64, f64)], b: &[(f64, f64)], f: impl Fn(f64) -> f64) -> f64 {
    a.iter().map(|(x, w)| w * b.iter().map(|(y, v)| v * f(x + y)).sum::<f64>()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alone_each_part_gives_its_closed_form_at_the_centre() {
        let thin = 1e-3;
        // a disc: 4/(πD) per arcsec; a Gaussian: 1/(σ sqrt 2π)
        let share = strip_share(thin, 40.0, 1e-6, 1e-6).unwrap();
        assert!((share / (thin * 4.0 / (PI * 40.0)) - 1.0).abs() < 1e-6, "{share}");
        let share = strip_share(thin, 1e-6, 1e-7, 0.7).unwrap();
        let sigma = 0.7 / FWHM_PER_SIGMA;
        assert!((share / (thin / (sigma * (2.0 * PI).sqrt())) - 1.0).abs() < 1e-6, "{share}");
        assert!((strip_share(1e3, 40.0, 4.0, 0.7).unwrap() - 1.0).abs() < 1e-9, "a strip wider than the trail");
    }

    #[test]
    fn folded_they_agree_with_a_fine_sum_whichever_is_widest() {
        // midpoints of all three parts on grids of their own, far finer
        for (disc, mirror, fwhm) in [(38.0, 4.3, 0.7), (1.9, 4.3, 0.7), (0.4, 0.8, 0.7), (2.0, 2.0, 2.0)] {
            let strip = 0.2;
            let n = 400;
            let grid = |d: f64| -> Vec<(f64, f64)> {
                (0..n)
                    .map(|i| {
                        let x = ((i as f64 + 0.5) / n as f64 - 0.5) * d;
                        (x, 8.0 / (PI * d * d) * (d * d / 4.0 - x * x).sqrt() * d / n as f64)
                    })
                    .collect()
            };
            let sigma = fwhm / FWHM_PER_SIGMA;
            let inside = |x: f64| {
                let below = |x: f64| 0.5 * (1.0 + erf(x / (sigma * 2f64.sqrt())));
                below(x + 0.5 * strip) - below(x - 0.5 * strip)
            };
            let fine = mean(&grid(disc), &grid(mirror), inside);
            let share = strip_share(strip, disc, mirror, fwhm).unwrap();
            assert!((share / fine - 1.0).abs() < 1e-3, "{disc} {mirror} {fwhm}: {share} {fine}");
        }
    }
}
