//! A circular orbit without perturbations, and how often its beam meets a site by chance.
//!
//! km, rad, s. The node does not precess: of an orbit that is stated by height and inclination alone, a day is enough.

use std::f64::consts::{PI, TAU};

use crate::base::error::{Error, Result};
use crate::base::vector::{Teme, Vector};
use crate::brightness::sky::GM_KM3_S2;
use crate::visibility::simple::above_zero;
use crate::visibility::streak::MEAN_RADIUS_KM;

/// A circular orbit about the centre of the Earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircularOrbit {
    radius_km: f64,
    inclination_rad: f64,
    node_rad: f64,
    argument_rad: f64,
}

impl CircularOrbit {
    /// From height above 6371 km, inclination, right ascension of the ascending node, and the angle from it at time 0.
    ///
    /// # Errors
    /// [`Error::Model`] for a height that is not above 0, an inclination outside 0 to π, an angle that is not finite.
    pub fn new(height_km: f64, inclination_rad: f64, node_rad: f64, argument_rad: f64) -> Result<Self> {
        let radius_km = MEAN_RADIUS_KM + above_zero("height_km", height_km)?;
        if !((0.0..=PI).contains(&inclination_rad) && node_rad.is_finite() && argument_rad.is_finite()) {
            let problem = format!("an inclination of {:.3} deg; accepted is 0 to 180", inclination_rad.to_degrees());
            return Err(Error::Model { problem });
        }
        Ok(Self { radius_km, inclination_rad, node_rad, argument_rad })
    }

    /// Mean motion `sqrt(GM/r³)` \[rad/s\].
    #[must_use]
    pub fn motion_rad_s(&self) -> f64 {
        (GM_KM3_S2 / self.radius_km.powi(3)).sqrt()
    }

    /// Period \[s\].
    #[must_use]
    pub fn period_s(&self) -> f64 {
        TAU / self.motion_rad_s()
    }

    /// Position \[km\] and velocity \[km/s\] at a time \[s\], axes of the equator of date.
    #[must_use]
    pub fn state(&self, t_s: f64) -> (Vector<Teme>, Vector<Teme>) {
        let ((sn, cn), (si, ci)) = (self.node_rad.sin_cos(), self.inclination_rad.sin_cos());
        let (su, cu) = (self.argument_rad + self.motion_rad_s() * t_s).sin_cos();
        // towards the node, and a quarter of a turn after it
        let (p, q) = (Vector::new(cn, sn, 0.0), Vector::new(-sn * ci, cn * ci, si));
        let speed = self.radius_km * self.motion_rad_s();
        ((p * cu + q * su) * self.radius_km, (q * cu + p * -su) * speed)
    }
}

/// How many times a day a beam straight down sweeps over a site of geocentric latitude φ, node and phase unknown.
///
/// Twice a revolution the orbit passes that latitude, heading ψ from north, `sin ψ = cos i / cos φ`; there the beam
/// covers `D/cos ψ` of the `2π R cos φ` of the circle of latitude. 0 where the orbit does not reach it. The Earth's
/// turn changes
/// ψ by a few degrees and is excluded.
///
/// # Errors
/// As [`CircularOrbit::new`].
pub fn crossings_per_day(height_km: f64, inclination_rad: f64, lat_rad: f64, diameter_km: f64) -> Result<f64> {
    let orbit = CircularOrbit::new(height_km, inclination_rad, 0.0, 0.0)?;
    let sin_heading = inclination_rad.cos() / lat_rad.cos();
    if !(sin_heading.abs() < 1.0) {
        return Ok(0.0);
    }
    let cos_heading = (1.0 - sin_heading * sin_heading).sqrt();
    let share = diameter_km / cos_heading / (TAU * MEAN_RADIUS_KM * lat_rad.cos());
    Ok(2.0 * 86_400.0 / orbit.period_s() * share.min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circular_orbit_is_one() {
        let orbit = CircularOrbit::new(625.0, 88_f64.to_radians(), 1.0, 2.0).unwrap();
        for t in [0.0, 1000.0, 50_000.0] {
            let (r, v) = orbit.state(t);
            assert!((r.norm() - 6996.0).abs() < 1e-9 && r.dot(&v).abs() < 1e-8);
            assert!((v.norm() - (GM_KM3_S2 / 6996.0).sqrt()).abs() < 1e-9);
            // inclination from the angular momentum
            let h = r.cross(&v);
            assert!((h.z() / h.norm() - 88_f64.to_radians().cos()).abs() < 1e-12);
            // velocity is the derivative of the position
            let (a, b) = (orbit.state(t - 0.5).0, orbit.state(t + 0.5).0);
            assert!((b - a - v).norm() < 1e-6);
        }
    }

    #[test]
    fn over_the_pole_an_equatorial_beam_never_comes() {
        assert_eq!(crossings_per_day(625.0, 0.1, 0.5, 5.8).unwrap(), 0.0);
        let polar = crossings_per_day(625.0, PI / 2.0, 0.0, 5.8).unwrap();
        // 2 · 14.84 · 5.8 / 40 030
        assert!((polar - 0.0043).abs() < 1e-4, "{polar}");
    }
}
