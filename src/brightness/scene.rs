//! A scene: where satellite, observer, Sun and Moon are at one instant, and what a place on Earth needs to know.
//!
//! Geocentric vectors in km in one Earth-fixed frame; nothing here knows surfaces or lights.

use crate::base::constants::{MOON_RADIUS_KM, SUN_RADIUS_KM, WGS84_A_KM, WGS84_F};
use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};
use crate::orbit::Geometry;

/// Altitude of a light source at the satellite \[rad\]: above the plane at right angles to the direction to the Earth's centre.
pub fn source_alt_rad(satellite_km: &Vector<Itrs>, source_km: &Vector<Itrs>) -> f64 {
    std::f64::consts::FRAC_PI_2 - satellite_km.angle_to(&(*source_km - *satellite_km))
}

/// One instant, geocentric, Earth-fixed: from the [`Geometry`] of a tracked satellite, or from vectors of one's own.
///
/// ```
/// use satphot::{Scene, Vector};
///
/// let scene = Scene {
///     satellite_km: Vector::new(6921.0, 0.0, 0.0),
///     velocity_km_s: Vector::new(0.0, 7.6, 0.0),
///     observer_km: Vector::new(6371.0, 0.0, 0.0),
///     sun_km: Vector::new(0.0, 1.496e8, 0.0),
///     moon_km: Vector::new(3.844e5, 0.0, 0.0),
///     sidereal_rad: 0.0,
/// };
/// assert!((scene.range_km() - 550.0).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scene {
    /// The satellite \[km\].
    pub satellite_km: Vector<Itrs>,
    /// Its inertial velocity, along the Earth-fixed axes \[km/s\]: r × v is the orbit's angular momentum.
    pub velocity_km_s: Vector<Itrs>,
    /// The observer \[km\].
    pub observer_km: Vector<Itrs>,
    /// The Sun \[km\].
    pub sun_km: Vector<Itrs>,
    /// The Moon \[km\].
    pub moon_km: Vector<Itrs>,
    /// Angle from the equinox of date to the x axis, eastward \[rad\]: sidereal time at Greenwich.
    pub sidereal_rad: f64,
}

impl Scene {
    /// Refuses scenes no observer can be in, for a spherical Earth of `radius_km`.
    ///
    /// # Errors
    /// [`Error::Model`] for a component that is not finite, a satellite at or below the surface, an observer less than
    /// a metre from the satellite or deep inside the Earth, a Sun or Moon within 10 Earth radii or around the satellite.
    pub(super) fn check(&self, radius_km: f64) -> Result<()> {
        let parts = [
            ("satellite_km", &self.satellite_km),
            ("velocity_km_s", &self.velocity_km_s),
            ("observer_km", &self.observer_km),
            ("sun_km", &self.sun_km),
            ("moon_km", &self.moon_km),
        ];
        for (name, v) in parts {
            if !v.norm().is_finite() {
                return Err(impossible(format!("{name} = {:?} is not finite", v.to_array())));
            }
        }
        if !self.sidereal_rad.is_finite() {
            return Err(impossible(format!("sidereal_rad = {} is not finite", self.sidereal_rad)));
        }
        let r_km = self.satellite_km.norm();
        if r_km <= radius_km {
            return Err(impossible(format!(
                "the satellite is below the surface: {r_km:.3} km from the centre of an Earth of {radius_km:.3} km"
            )));
        }
        let range_km = self.range_km();
        if range_km < 0.001 {
            return Err(impossible(format!("the satellite is {range_km} km from the observer; at least 0.001 km")));
        }
        if self.observer_km.norm() < 0.99 * radius_km {
            let o_km = self.observer_km.norm();
            return Err(impossible(format!(
                "the observer is {o_km:.3} km from the centre of an Earth of {radius_km:.3} km"
            )));
        }
        let bodies = [("Sun", &self.sun_km, SUN_RADIUS_KM), ("Moon", &self.moon_km, MOON_RADIUS_KM)];
        for (name, v, body_radius_km) in bodies {
            let (from_earth_km, from_satellite_km) = (v.norm(), (*v - self.satellite_km).norm());
            if from_earth_km <= 10.0 * radius_km || from_satellite_km <= body_radius_km {
                return Err(impossible(format!(
                    "the {name} is {from_earth_km:.0} km from the Earth's centre and {from_satellite_km:.0} km from the \
                     satellite: accepted is beyond 10 Earth radii, the satellite outside"
                )));
            }
        }
        Ok(())
    }

    /// Distance from observer to satellite \[km\].
    #[must_use]
    pub fn range_km(&self) -> f64 {
        (self.satellite_km - self.observer_km).norm()
    }
}

/// Distance from the Earth's centre to the WGS84 ellipsoid under a geocentric place \[km\].
///
/// `R = a / sqrt(cos²ψ + sin²ψ/(1−f)²)` with ψ the geocentric latitude. A vector of length zero gives a.
#[must_use]
pub fn local_radius_km(place: &Vector<Itrs>) -> f64 {
    let sin_lat = place.unit().map_or(0.0, |u| u.z());
    let polar = sin_lat / (1.0 - WGS84_F);
    WGS84_A_KM / (1.0 - sin_lat * sin_lat + polar * polar).sqrt()
}

/// The vertical of a place near the WGS84 ellipsoid: its geodetic normal, to 1e-5 rad up to 10 km height.
pub fn geodetic_up(place: &Vector<Itrs>) -> Vector<Itrs> {
    // ∇(x²/a² + y²/a² + z²/b²)
    let b_over_a = 1.0 - WGS84_F;
    let n = Vector::new(place.x(), place.y(), place.z() / (b_over_a * b_over_a));
    n.unit().unwrap_or(*place)
}

/// A model input that makes no sense.
pub(super) fn impossible(problem: String) -> Error {
    Error::Model { problem }
}

/// The scene of the brightness engine at one instant.
#[must_use]
pub fn scene(geometry: &Geometry) -> Scene {
    Scene::from(geometry)
}

impl From<&Geometry> for Scene {
    fn from(g: &Geometry) -> Self {
        Self {
            satellite_km: g.satellite_itrs_km,
            velocity_km_s: g.satellite_velocity_itrs_km_s,
            observer_km: g.observer_itrs_km,
            sun_km: g.sun_itrs_km,
            moon_km: g.moon_itrs_km,
            sidereal_rad: g.sidereal_rad,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_local_radius_is_the_equators_and_the_poles() {
        assert!((local_radius_km(&Vector::new(7000.0, 0.0, 0.0)) - 6378.137).abs() < 1e-9);
        assert!((local_radius_km(&Vector::new(0.0, 0.0, -7000.0)) - 6_356.752_314).abs() < 1e-5);
    }

    #[test]
    fn the_radius_at_macquarie_is_the_documented_one() {
        // geodetic 33.7703 S is geocentric 33.593 S; 6371.6 km
        let lat = -33.593_f64.to_radians();
        assert!((local_radius_km(&Vector::new(lat.cos(), 0.0, lat.sin())) - 6371.6).abs() < 0.1);
    }
}
