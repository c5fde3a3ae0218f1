//! Directions spread over the sky above an observer, and the median of what is seen in them.
//!
//! Angles in rad. The same points for the same number, measure and seed, whatever the number of threads: a golden
//! spiral, or, with a seed, independent random directions. Not included: horizons, and where satellites really are.

use std::f64::consts::{FRAC_PI_2, TAU};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::scene::impossible;
use crate::base::error::Result;
use crate::config::Sampling;

/// Most directions of one sky.
pub const MAX_SKY_POINTS: usize = 1_000_000;
/// 1/φ, the golden section: the turn from one point of the spiral to the next.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Directions of equal weight.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyPoints {
    /// Altitude and azimuth (north through east) \[rad\].
    pub directions: Vec<(f64, f64)>,
}

impl SkyPoints {
    /// `n` directions spread over the sky in the given measure.
    ///
    /// Without a seed a golden spiral: `x_i = (i + ½)/n`, `az_i = 2π frac(i/φ)`, whose medians converge almost like
    /// 1/n. With a seed, independent random directions, whose medians converge like 1/sqrt(n). `x` is the sine of the
    /// altitude where areas count alike, the altitude over 90° where altitudes do.
    ///
    /// # Errors
    /// [`crate::Error::Model`] for no point, or more than [`MAX_SKY_POINTS`].
    pub fn new(n: usize, sampling: Sampling, seed: Option<u64>) -> Result<Self> {
        if !(1..=MAX_SKY_POINTS).contains(&n) {
            return Err(impossible(format!("{n} points of the sky; accepted is 1 to {MAX_SKY_POINTS}")));
        }
        let altitude = |x: f64| match sampling {
            Sampling::SolidAngle => x.asin(),
            Sampling::AltAz => FRAC_PI_2 * x,
        };
        let directions = match seed {
            None => {
                (0..n).map(|i| (altitude((i as f64 + 0.5) / n as f64), TAU * (i as f64 * GOLDEN).fract())).collect()
            }
            Some(seed) => {
                let mut rng = ChaCha12Rng::seed_from_u64(seed);
                (0..n).map(|_| (altitude(rng.random_range(0.0..1.0)), rng.random_range(0.0..TAU))).collect()
            }
        };
        Ok(Self { directions })
    }
}

/// Brightest sixth, median and faintest sixth of magnitudes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Half of the directions are brighter.
    pub median: f64,
    /// 16 % of the directions are brighter.
    pub p16: f64,
    /// 84 % of the directions are brighter.
    pub p84: f64,
}

impl Spread {
    /// Of magnitudes of equal weight; `None` without any. Sorts them.
    ///
    /// The value at a share is the first that so many are not fainter than: no two values are mixed.
    #[must_use]
    pub fn of(magnitudes: &mut [f64]) -> Option<Self> {
        magnitudes.sort_unstable_by(f64::total_cmp);
        let n = magnitudes.len();
        let at = |share: f64| magnitudes.get(((share * n as f64).ceil() as usize).max(1) - 1).copied();
        Some(Self { median: at(0.5)?, p16: at(0.16)?, p84: at(0.84)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_third_of_the_sky_holds_a_third_of_the_points_in_its_own_measure() {
        for (seed, off) in [(None, 0.003), (Some(0), 0.03), (Some(7), 0.03)] {
            for sampling in [Sampling::SolidAngle, Sampling::AltAz] {
                let sky = SkyPoints::new(3000, sampling, seed).unwrap();
                let x = |alt: f64| if sampling == Sampling::SolidAngle { alt.sin() } else { alt / FRAC_PI_2 };
                let low = sky.directions.iter().filter(|d| x(d.0) < 1.0 / 3.0).count() as f64 / 3000.0;
                let west = sky.directions.iter().filter(|d| d.1 > 2.0 / 3.0 * TAU).count() as f64 / 3000.0;
                assert!((low - 1.0 / 3.0).abs() < off && (west - 1.0 / 3.0).abs() < off, "{seed:?} {low} {west}");
                assert!(sky.directions.iter().all(|d| d.0 > 0.0 && d.0 <= FRAC_PI_2 && (0.0..TAU).contains(&d.1)));
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_sky_and_no_point_at_all_is_refused() {
        let sky = |seed| SkyPoints::new(50, Sampling::SolidAngle, seed).unwrap();
        assert_eq!(sky(Some(3)), sky(Some(3)));
        assert_ne!(sky(Some(3)), sky(Some(4)));
        assert_ne!(sky(Some(0)), sky(None));
        assert!(SkyPoints::new(0, Sampling::AltAz, None).is_err());
        assert!(SkyPoints::new(MAX_SKY_POINTS + 1, Sampling::AltAz, None).is_err());
    }

    #[test]
    fn a_spread_is_made_of_values_that_are_there() {
        let mut hundred: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        assert_eq!(Spread::of(&mut hundred), Some(Spread { median: 50.0, p16: 16.0, p84: 84.0 }));
        assert_eq!(Spread::of(&mut [7.0]), Some(Spread { median: 7.0, p16: 7.0, p84: 7.0 }));
        assert_eq!(Spread::of(&mut []), None);
    }
}
