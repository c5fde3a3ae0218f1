//! Where the Sun, the Moon and the stars stand: low-precision theories that need no data files.
//!
//! km and radians. Geocentric vectors are apparent (light time, with the Earth's own motion in it); the observer's
//! place and spin are added where altitudes are computed. No refraction, no deflection of light by the Sun (1.75″ at
//! its limb, 0.004″ at 90°). Against JPL DE421, 2024-2027: Sun 0.01″, Moon 9.8″ at most.

use hifitime::Epoch;

use super::earth::{EarthOrientation, Gcrs, Rotation, Site, alt_az, from_alt_az, gcrs_to_itrs, spin_velocity};
use super::time::{tt, utc_text};
use crate::base::constants::{AU_KM, SPEED_OF_LIGHT_KM_S};
use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};

/// Distance to the Sun in the relativistic term of aberration (0.4 µas) \[au\].
const SUN_DISTANCE_FOR_ABERRATION_AU: f64 = 1.0;

/// The Sun and the Moon at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyBodies {
    /// Centre of the Earth to the Sun as it appears, Earth-fixed axes \[km\].
    pub sun_itrs_km: Vector<Itrs>,
    /// Centre of the Earth to the Moon as it appears, Earth-fixed axes \[km\].
    pub moon_itrs_km: Vector<Itrs>,
}

/// The Sun and the Moon from the centre of the Earth, in Earth-fixed axes.
///
/// # Errors
/// [`Error::Orbit`] outside 1900-2100, where the theories were not fitted.
pub fn bodies(epoch: &Epoch, eop: &EarthOrientation) -> Result<SkyBodies> {
    let turn = gcrs_to_itrs(epoch, eop);
    let (sun, moon) = bodies_gcrs(epoch)?;
    Ok(SkyBodies { sun_itrs_km: turn.apply(&sun), moon_itrs_km: turn.apply(&moon) })
}

/// The Sun and the Moon from the centre of the Earth, apparent, celestial axes \[km\].
///
/// Both at the time the light left: for the Sun `−Earth_heliocentric(t − τ)`, for the Moon `Moon_geocentric(t − τ)`;
/// this is light time and annual aberration together (planetary aberration), to v²/c² = 0.002″.
///
/// # Source
/// ERFA `epv00` (Bretagnon & Francou, fitted to DE405) and `moon98` (Meeus 1998, chapter 47, after ELP-2000/82).
///
/// # Errors
/// As [`bodies`].
pub fn bodies_gcrs(epoch: &Epoch) -> Result<(Vector<Gcrs>, Vector<Gcrs>)> {
    let t = tt(epoch);
    let light_d = |distance_km: f64| distance_km / SPEED_OF_LIGHT_KM_S / 86_400.0;
    let Ok(((earth_pv, _), 0)) = erfars::ephemerides::Epv00(t.0, t.1 - light_d(AU_KM)) else {
        return Err(Error::Orbit {
            problem: format!("{}: the positions of Sun and Moon are known from 1900 to 2100 only", utc_text(epoch)),
        });
    };
    let [x, y, z, vx, vy, vz] = earth_pv.map(|c| -c * AU_KM);
    let (sun_km, sun_km_d) = (Vector::<Gcrs>::new(x, y, z), Vector::<Gcrs>::new(vx, vy, vz));
    // The light took 499 s · (1 ± 0.017): in those 8 s the path is straight to a metre.
    let sun_km = sun_km + sun_km_d * (light_d(AU_KM) - light_d(sun_km.norm()));
    // For the Moon's light a mean distance is enough: 1.28 s · (1 ± 0.06), in which it moves 0.04″.
    let [x, y, z, ..] = erfars::ephemerides::Moon98(t.0, t.1 - light_d(384_400.0)).map(|c| c * AU_KM);
    Ok((sun_km, Vector::new(x, y, z)))
}

/// A body's place as seen from a site: direction and distance, with the aberration of the site's spin (0.3″ at most).
#[must_use]
pub fn topocentric(site: &Site, body_itrs_km: &Vector<Itrs>) -> Vector<Itrs> {
    let from_site = *body_itrs_km - site.position();
    // first order: u' = u + v/c
    from_site + spin_velocity(&site.position()) * (from_site.norm() / SPEED_OF_LIGHT_KM_S)
}

/// Altitude and azimuth of the Sun's centre from a site \[rad\], without refraction.
#[must_use]
pub fn sun_altaz(site: &Site, bodies: &SkyBodies) -> (f64, f64) {
    alt_az(&site.to_enu(&topocentric(site, &bodies.sun_itrs_km)))
}

/// Altitude and azimuth of the Moon's centre from a site \[rad\], without refraction.
#[must_use]
pub fn moon_altaz(site: &Site, bodies: &SkyBodies) -> (f64, f64) {
    alt_az(&site.to_enu(&topocentric(site, &bodies.moon_itrs_km)))
}

/// Altitude and azimuth \[rad\] of a star of ICRS coordinates \[deg\], with aberration, without refraction or parallax.
#[must_use]
pub fn icrs_to_altaz(site: &Site, eop: &EarthOrientation, epoch: &Epoch, ra_deg: f64, dec_deg: f64) -> (f64, f64) {
    let (turn, velocity_c) = star_frame(site, eop, epoch);
    let ((sr, cr), (sd, cd)) = (ra_deg.to_radians().sin_cos(), dec_deg.to_radians().sin_cos());
    let seen = aberrated([cd * cr, cd * sr, sd], velocity_c);
    alt_az(&site.to_enu(&turn.apply(&seen)))
}

/// ICRS coordinates (0 ≤ RA < 360) \[deg\] of the star seen at an altitude and azimuth \[rad\]; undoes [`icrs_to_altaz`].
#[must_use]
pub fn altaz_to_icrs(site: &Site, eop: &EarthOrientation, epoch: &Epoch, alt_rad: f64, az_rad: f64) -> (f64, f64) {
    let (turn, velocity_c) = star_frame(site, eop, epoch);
    let seen = turn.undo(&site.from_enu(&from_alt_az(alt_rad, az_rad)));
    // Aberration has no closed inverse: each round gains a factor v/c = 1e-4.
    let mut star = seen;
    for _ in 0..4 {
        let off = aberrated(star.to_array(), velocity_c) - seen;
        star = (star - off).unit().unwrap_or(seen);
    }
    let ra_deg = star.y().atan2(star.x()).to_degrees().rem_euclid(360.0);
    (if ra_deg < 360.0 { ra_deg } else { 0.0 }, star.z().atan2(star.x().hypot(star.y())).to_degrees())
}

/// Celestial to Earth-fixed axes, and the site's barycentric velocity along celestial axes \[c\].
fn star_frame(site: &Site, eop: &EarthOrientation, epoch: &Epoch) -> (Rotation<Gcrs, Itrs>, [f64; 3]) {
    let turn = gcrs_to_itrs(epoch, eop);
    let t = tt(epoch);
    // ERFA warns (but still answers) outside 1900-2100; the velocity stays good to 1e-6 c for centuries more.
    let earth = match erfars::ephemerides::Epv00(t.0, t.1) {
        Ok(((_, pvb), _)) => Vector::<Gcrs>::new(pvb[3], pvb[4], pvb[5]) * (AU_KM / 86_400.0),
        Err(_) => Vector::new(0.0, 0.0, 0.0),
    };
    let velocity_km_s = earth + turn.undo(&spin_velocity(&site.position()));
    (turn, (velocity_km_s * (1.0 / SPEED_OF_LIGHT_KM_S)).to_array())
}

fn aberrated(direction: [f64; 3], velocity_c: [f64; 3]) -> Vector<Gcrs> {
    let v2: f64 = velocity_c.iter().map(|c| c * c).sum();
    let [x, y, z] = erfars::astrometry::Ab(&direction, &velocity_c, SUN_DISTANCE_FOR_ABERRATION_AU, (1.0 - v2).sqrt());
    Vector::new(x, y, z)
}
