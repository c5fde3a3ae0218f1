//! The whole geometry of one instant: satellite, observer, Sun and Moon.
//!
//! Everything in Earth-fixed axes (ITRS), km, rad, rad/s; altitudes geometric, without refraction.

use hifitime::Epoch;

use super::airmass::airmass;
use super::earth::{EarthOrientation, Site, alt_az, geodetic_height_km, sidereal_rad, spin_velocity, teme_to_itrs};
use super::sky::{SkyBodies, topocentric};
use crate::base::error::{Error, Result};
use crate::base::vector::{Enu, Itrs, Teme, Vector};

/// Where everything is at one instant.
#[derive(Debug, Clone)]
pub struct Geometry {
    /// The instant.
    pub epoch: Epoch,
    /// The satellite \[km\].
    pub satellite_itrs_km: Vector<Itrs>,
    /// The satellite's *inertial* velocity along Earth-fixed axes \[km/s\], for attitudes that follow the orbit.
    pub satellite_velocity_itrs_km_s: Vector<Itrs>,
    /// The observer \[km\].
    pub observer_itrs_km: Vector<Itrs>,
    /// The Sun from the Earth's centre \[km\].
    pub sun_itrs_km: Vector<Itrs>,
    /// The Moon from the Earth's centre \[km\].
    pub moon_itrs_km: Vector<Itrs>,
    /// Sidereal time at Greenwich \[rad\]: the angle from the mean equinox of date to the x axis.
    pub sidereal_rad: f64,
    /// Altitude of the satellite \[rad\].
    pub alt_rad: f64,
    /// Azimuth of the satellite, north through east \[rad\].
    pub az_rad: f64,
    /// Observer to satellite \[km\].
    pub range_km: f64,
    /// Angular rate against the stars \[rad/s\]: `ω = |r × v_rel| / r²`, `v_rel = v_sat − Ω × r_obs`.
    pub rate_rad_s: f64,
    /// Rate of the azimuth \[rad/s\], never negative: what a dome must follow. Over a second of straight motion
    /// `h ± v/2` of the horizontal parts, so that it is finite in the zenith (at most π).
    pub az_rate_rad_s: f64,
    /// Direction of that motion on the sky, a unit vector at right angles to the line of sight (star trails run
    /// opposite); zero in the singular case of no motion.
    pub motion_enu: Vector<Enu>,
    /// Airmass (Kasten & Young 1989 at the refracted altitude); `None` below the horizon.
    pub airmass: Option<f64>,
    /// Angle Sun-satellite-observer \[rad\]; 0 = full.
    pub phase_angle_rad: f64,
    /// Altitude of the Sun from the site \[rad\].
    pub sun_alt_rad: f64,
    /// Azimuth of the Sun \[rad\].
    pub sun_az_rad: f64,
    /// Altitude of the Moon from the site \[rad\].
    pub moon_alt_rad: f64,
    /// Azimuth of the Moon \[rad\].
    pub moon_az_rad: f64,
    /// Phase of the Moon: the angle Sun-Moon-observer \[rad\]; 0 = full.
    pub moon_phase_rad: f64,
    /// Share of the Moon's disc that is lit: `(1 + cos α) / 2`.
    pub moon_illum_frac: f64,
    /// Satellite to Moon on the sky of the site \[rad\].
    pub moon_sep_rad: f64,
    /// Geodetic height of the satellite \[km\].
    pub height_km: f64,
    /// Age of the elements \[d\]; negative when they are newer than the instant.
    pub tle_age_d: f64,
}

/// Satellite as seen from a site: altitude and azimuth \[rad\], range \[km\].
#[must_use]
pub fn alt_az_range(site: &Site, eop: &EarthOrientation, epoch: &Epoch, position_km: &Vector<Teme>) -> (f64, f64, f64) {
    let satellite = teme_to_itrs(epoch, eop).apply(position_km);
    let line = satellite - site.position();
    let (alt_rad, az_rad) = alt_az(&site.to_enu(&line));
    (alt_rad, az_rad, line.norm())
}

/// Rate of the azimuth \[rad/s\] of a place `line` moving with `velocity` over the ground: the angle between the horizontal
/// parts of `line ± velocity · τ/2`, over τ = 1 s.
///
/// Far from the zenith this is `|h × v| / h²`; in the zenith, where that has no bound, half a turn a second.
fn az_rate_rad_s(line: &Vector<Enu>, velocity: &Vector<Enu>) -> f64 {
    const TAU_S: f64 = 1.0;
    let flat = |v: Vector<Enu>| Vector::<Enu>::new(v.x(), v.y(), 0.0);
    let half = *velocity * (0.5 * TAU_S);
    flat(*line - half).angle_to(&flat(*line + half)) / TAU_S
}

/// Puts satellite, observer, Sun and Moon together.
///
/// # Errors
/// [`Error::Orbit`] if the satellite is at the observer or at the Earth's centre.
pub fn geometry(
    site: &Site,
    eop: &EarthOrientation,
    epoch: &Epoch,
    state: &(Vector<Teme>, Vector<Teme>),
    sky: &SkyBodies,
    tle_age_d: f64,
) -> Result<Geometry> {
    let turn = teme_to_itrs(epoch, eop);
    let (satellite, velocity) = (turn.apply(&state.0), turn.apply(&state.1));
    let observer = site.position();
    let line = satellite - observer;
    let range_km = line.norm();
    let degenerate = |what: &str| Error::Orbit { problem: format!("the satellite is at {what}") };
    let sight = line.unit().ok_or_else(|| degenerate("the observer"))?;
    let height_km = geodetic_height_km(&satellite).ok_or_else(|| degenerate("the Earth's centre"))?;
    let (alt_rad, az_rad) = alt_az(&site.to_enu(&line));

    // The camera follows the satellite against the stars: an inertial rate, so the observer's own motion is Ω × r_obs.
    let v_rel = velocity - spin_velocity(&observer);
    let across = v_rel - sight * sight.dot(&v_rel);
    let motion = across.unit().unwrap_or(Vector::new(0.0, 0.0, 0.0));

    // Over the ground: the dome turns with the Earth.
    let v_ground = velocity - spin_velocity(&satellite);

    let (sun, moon) = (topocentric(site, &sky.sun_itrs_km), topocentric(site, &sky.moon_itrs_km));
    let (sun_alt_rad, sun_az_rad) = alt_az(&site.to_enu(&sun));
    let (moon_alt_rad, moon_az_rad) = alt_az(&site.to_enu(&moon));
    let moon_phase_rad = (sky.sun_itrs_km - sky.moon_itrs_km).angle_to(&(observer - sky.moon_itrs_km));

    Ok(Geometry {
        epoch: *epoch,
        satellite_itrs_km: satellite,
        satellite_velocity_itrs_km_s: velocity,
        observer_itrs_km: observer,
        sun_itrs_km: sky.sun_itrs_km,
        moon_itrs_km: sky.moon_itrs_km,
        sidereal_rad: sidereal_rad(epoch, eop),
        alt_rad,
        az_rad,
        range_km,
        // ω = |r × v_rel| / r²
        rate_rad_s: sight.cross(&v_rel).norm() / range_km,
        az_rate_rad_s: az_rate_rad_s(&site.to_enu(&line), &site.to_enu(&v_ground)),
        motion_enu: site.to_enu(&motion),
        airmass: airmass(alt_rad, &site.atmosphere()),
        phase_angle_rad: (sky.sun_itrs_km - satellite).angle_to(&(observer - satellite)),
        sun_alt_rad,
        sun_az_rad,
        moon_alt_rad,
        moon_az_rad,
        moon_phase_rad,
        moon_illum_frac: 0.5 * (1.0 + moon_phase_rad.cos()),
        moon_sep_rad: line.angle_to(&moon),
        height_km,
        tle_age_d,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_azimuth_rate_is_finite_in_the_zenith_and_the_formula_of_the_books_away_from_it() {
        let rate = |x: f64, y: f64| az_rate_rad_s(&Vector::new(x, y, 420.0), &Vector::new(0.0, 7.3, 0.0));
        // |h × v| / h² = 7.3 · 150 / 150²; the second of motion bends it by (v τ / h)² / 12
        assert!((rate(150.0, 0.0) / (7.3 / 150.0) - 1.0).abs() < 2.5e-4, "{}", rate(150.0, 0.0));
        assert!((rate(0.0, 0.0) - std::f64::consts::PI).abs() < 1e-12);
        assert_eq!(rate(0.0, 300.0), 0.0, "straight away from the zenith");
        assert!(rate(1e-300, 1e-300) <= std::f64::consts::PI);
        assert_eq!(az_rate_rad_s(&Vector::new(0.0, 0.0, 1.0), &Vector::new(0.0, 0.0, 0.0)), 0.0);
    }
}
