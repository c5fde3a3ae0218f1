//! How fast a satellite moves among the stars: on a circular orbit over a site, or by v/d in the zenith.
//!
//! km, rad, s. The camera follows the stars, so the observer's own motion with the turning Earth counts. For elements
//! the rate is [`crate::orbit::Geometry::rate_rad_s`].

use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};
use crate::brightness::scene::local_radius_km;
use crate::brightness::sky::GM_KM3_S2;
use crate::orbit::Site;
use crate::orbit::earth::{from_alt_az, spin_velocity};

/// Mean radius of the Earth \[km\] (IUGG), that of the paper's effective exposure time.
pub const MEAN_RADIUS_KM: f64 = 6371.0;

/// Speed on a circular orbit, `v = sqrt(GM/(R + h))`, R = 6371 km \[km/s\].
///
/// # Errors
/// [`Error::Model`] for a height that is not above 0.
pub fn circular_speed_km_s(height_km: f64) -> Result<f64> {
    Ok((GM_KM3_S2 / (MEAN_RADIUS_KM + height(height_km)?)).sqrt())
}

/// Rate in the zenith as the paper has it: `ω = v/h`, the observer at rest \[rad/s\].
///
/// # Errors
/// As [`circular_speed_km_s`].
pub fn zenith_rate_rad_s(height_km: f64) -> Result<f64> {
    Ok(circular_speed_km_s(height_km)? / height_km)
}

/// Which of the two orbits of one inclination through a place is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Leg {
    /// Northward.
    #[default]
    Ascending,
    /// Southward.
    Descending,
}

/// A satellite on a circular orbit in one direction of one site.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnCircle {
    /// The satellite, Earth-fixed axes \[km\].
    pub position_km: Vector<Itrs>,
    /// Its inertial velocity along those axes \[km/s\].
    pub velocity_km_s: Vector<Itrs>,
    /// Observer to satellite \[km\].
    pub range_km: f64,
    /// Angular rate against the stars \[rad/s\]: `ω = |r × v_rel|/r²`, `v_rel = v_sat − Ω × r_obs`.
    pub rate_rad_s: f64,
}

/// The satellite that a site sees at an altitude and azimuth on a circular orbit of a height and inclination.
///
/// The orbit is a circle of radius R + h, R the geocentric radius of the ellipsoid at the site. Through its point of
/// latitude φ run two such orbits, heading from north by ψ: `sin ψ = cos i / cos φ`.
///
/// # Errors
/// [`Error::Model`] for a height not above the site's, an altitude below the horizon, an inclination that does not
/// reach that latitude.
pub fn on_circle(
    site: &Site,
    height_km: f64,
    inclination_rad: f64,
    (alt_rad, az_rad): (f64, f64),
    leg: Leg,
) -> Result<OnCircle> {
    let refused = |problem: String| Err(Error::Model { problem });
    if !(0.0..=std::f64::consts::PI).contains(&inclination_rad) {
        return refused(format!("an inclination of {:.3} deg; accepted is 0 to 180", inclination_rad.to_degrees()));
    }
    if !((0.0..=std::f64::consts::FRAC_PI_2).contains(&alt_rad) && az_rad.is_finite()) {
        return refused(format!("an altitude of {:.3} deg; accepted is 0 to 90", alt_rad.to_degrees()));
    }
    let observer = site.position();
    let radius_km = local_radius_km(&observer) + height(height_km)?;
    let sight = site.from_enu(&from_alt_az(alt_rad, az_rad));
    // |o + d s| = r; the larger root
    let (along, inside) = (observer.dot(&sight), radius_km * radius_km - observer.dot(&observer));
    if !(inside > 0.0) {
        return refused(format!("a height of {height_km} km is below the site, {:.3} km", site.height_km()));
    }
    let root = (along * along + inside).sqrt();
    let range_km = if along > 0.0 { inside / (along + root) } else { root - along };
    let position_km = observer + sight * range_km;
    let up = position_km * (1.0 / radius_km);
    let velocity_km_s = heading(&up, inclination_rad, leg)? * (GM_KM3_S2 / radius_km).sqrt();
    let v_rel = velocity_km_s - spin_velocity(&observer);
    Ok(OnCircle { position_km, velocity_km_s, range_km, rate_rad_s: sight.cross(&v_rel).norm() / range_km })
}

/// Direction of motion at the place over which `up` stands; over a pole any, along the meridian of longitude 90°.
fn heading(up: &Vector<Itrs>, inclination_rad: f64, leg: Leg) -> Result<Vector<Itrs>> {
    /// An orbit of the inclination of a latitude passes it heading due east: rounding must not refuse it.
    const ROUNDING: f64 = 1e-9;
    let cos_lat = up.x().hypot(up.y());
    let (sin_heading, east) = if cos_lat > ROUNDING {
        (inclination_rad.cos() / cos_lat, Vector::new(-up.y() / cos_lat, up.x() / cos_lat, 0.0))
    } else {
        (inclination_rad.cos(), Vector::new(0.0, 1.0, 0.0))
    };
    if sin_heading.abs() > 1.0 + ROUNDING {
        return Err(Error::Model {
            problem: format!(
                "an orbit inclined by {:.3} deg never comes over latitude {:.3} deg, where the line of sight meets it",
                inclination_rad.to_degrees(),
                up.z().atan2(cos_lat).to_degrees()
            ),
        });
    }
    let sin_heading = sin_heading.clamp(-1.0, 1.0);
    let northward = (1.0 - sin_heading * sin_heading).sqrt();
    let northward = if leg == Leg::Ascending { northward } else { -northward };
    Ok(east * sin_heading + up.cross(&east) * northward)
}

fn height(height_km: f64) -> Result<f64> {
    if height_km > 0.0 && height_km.is_finite() {
        return Ok(height_km);
    }
    Err(Error::Model { problem: format!("height_km = {height_km}; accepted is a finite number above 0") })
}
