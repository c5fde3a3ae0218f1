//! The turning Earth: TEME and GCRS to Earth-fixed axes (ITRS), and the horizon of a site on the WGS84 ellipsoid.
//!
//! km and radians. Tides, plate motion and the deflection of the vertical are excluded.

use hifitime::Epoch;

use super::airmass::Atmosphere;
use super::{time, ut1};
use crate::base::constants::EARTH_ROTATION_RAD_S;
use crate::base::error::{Error, Result};
use crate::base::vector::{Enu, Itrs, Teme, Vector};
use crate::config;

/// ERFA's number of the WGS84 ellipsoid.
const ERFA_WGS84: i32 = 1;

/// Celestial axes through the Earth's centre (GCRS): stars, the Sun, the Moon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gcrs {}

/// How the Earth is turned beyond what is computable. By default UT1 − UTC of the embedded IERS table
/// ([`super::ut1`]), and no polar motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EarthOrientation {
    /// UT1 − UTC \[s\]; `None` takes that of the embedded table at each instant.
    pub ut1_utc_s: Option<f64>,
    /// Polar motion x \[arcsec\].
    pub xp_arcsec: f64,
    /// Polar motion y \[arcsec\].
    pub yp_arcsec: f64,
}

impl EarthOrientation {
    /// From `[orbit]`: what it gives, else the table.
    #[must_use]
    pub fn from_config(orbit: &config::Orbit) -> Self {
        Self { ut1_utc_s: orbit.ut1_utc_s, xp_arcsec: orbit.xp_arcsec, yp_arcsec: orbit.yp_arcsec }
    }

    /// UT1 − UTC at an instant \[s\]: the one given, else that of the table.
    #[must_use]
    pub fn ut1_utc_s_at(&self, epoch: &Epoch) -> f64 {
        self.ut1_utc_s.unwrap_or_else(|| ut1::ut1_utc_s(epoch))
    }

    /// What to tell the observer about an instant at which UT1 − UTC is neither given nor in the table.
    #[must_use]
    pub fn warning(&self, epoch: &Epoch) -> Option<String> {
        if self.ut1_utc_s.is_some() { None } else { ut1::warning(epoch) }
    }
}

/// A rotation, rows first: `out[i] = Σ_j m[3i+j] in[j]`.
#[derive(Debug, Clone, Copy)]
pub struct Rotation<From, To> {
    m: [f64; 9],
    frames: std::marker::PhantomData<(From, To)>,
}

impl<From, To> Rotation<From, To> {
    fn new(m: [f64; 9]) -> Self {
        Self { m, frames: std::marker::PhantomData }
    }
    /// Turns a vector.
    #[must_use]
    pub fn apply(&self, v: &Vector<From>) -> Vector<To> {
        let (m, [x, y, z]) = (&self.m, v.to_array());
        Vector::new(m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z, m[6] * x + m[7] * y + m[8] * z)
    }
    /// Turns a vector back.
    #[must_use]
    pub fn undo(&self, v: &Vector<To>) -> Vector<From> {
        let (m, [x, y, z]) = (&self.m, v.to_array());
        Vector::new(m[0] * x + m[3] * y + m[6] * z, m[1] * x + m[4] * y + m[7] * z, m[2] * x + m[5] * y + m[8] * z)
    }
}

/// Sidereal time at Greenwich \[rad\], GMST82(UT1): the angle by which [`teme_to_itrs`] turns, polar motion apart.
#[must_use]
pub fn sidereal_rad(epoch: &Epoch, eop: &EarthOrientation) -> f64 {
    let (u1, u2) = time::ut1(epoch, eop.ut1_utc_s_at(epoch));
    erfars::rotationtime::Gmst82(u1, u2)
}

/// TEME to ITRS: `W · R₃(GMST82(UT1))`, W being polar motion.
///
/// # Source
/// Vallado et al. 2006, AIAA 2006-6753, Appendix C; ERFA `gmst82`, `pom00`.
#[must_use]
pub fn teme_to_itrs(epoch: &Epoch, eop: &EarthOrientation) -> Rotation<Teme, Itrs> {
    let (s, c) = sidereal_rad(epoch, eop).sin_cos();
    let (t1, t2) = time::tt(epoch);
    let mut w = [0.0; 9];
    let (xp, yp) = polar_motion_rad(eop);
    erfars::precnutpolar::Pom00(xp, yp, erfars::precnutpolar::Sp00(t1, t2), &mut w);
    // W · [[c, s, 0], [−s, c, 0], [0, 0, 1]]
    Rotation::new([
        w[0] * c - w[1] * s,
        w[0] * s + w[1] * c,
        w[2],
        w[3] * c - w[4] * s,
        w[3] * s + w[4] * c,
        w[5],
        w[6] * c - w[7] * s,
        w[6] * s + w[7] * c,
        w[8],
    ])
}

/// GCRS to ITRS: IAU 2006/2000A precession and nutation, Earth rotation, polar motion (ERFA `c2t06a`).
///
/// 75 µs; IAU 2000B would take 7 and be off by 0.001″ (`satphot accuracy earth-frames`).
#[must_use]
pub fn gcrs_to_itrs(epoch: &Epoch, eop: &EarthOrientation) -> Rotation<Gcrs, Itrs> {
    let ((t1, t2), (u1, u2)) = (time::tt(epoch), time::ut1(epoch, eop.ut1_utc_s_at(epoch)));
    let (xp, yp) = polar_motion_rad(eop);
    let mut m = [0.0; 9];
    erfars::precnutpolar::C2t06a(t1, t2, u1, u2, xp, yp, &mut m);
    Rotation::new(m)
}

fn polar_motion_rad(eop: &EarthOrientation) -> (f64, f64) {
    ((eop.xp_arcsec / 3_600.0).to_radians(), (eop.yp_arcsec / 3_600.0).to_radians())
}

/// Velocity of a point that turns with the Earth, in inertial space but along Earth-fixed axes \[km/s\]: `Ω × r`.
#[must_use]
pub fn spin_velocity(position_km: &Vector<Itrs>) -> Vector<Itrs> {
    Vector::new(0.0, 0.0, EARTH_ROTATION_RAD_S).cross(position_km)
}

/// Geodetic longitude and latitude \[rad\] and height above the WGS84 ellipsoid \[km\]; `None` at the Earth's centre.
#[must_use]
pub fn geodetic(position_km: &Vector<Itrs>) -> Option<(f64, f64, f64)> {
    if position_km.norm() == 0.0 {
        return None;
    }
    let metres = position_km.to_array().map(|c| c * 1_000.0);
    let ((lon_rad, lat_rad, height_m), _) = erfars::geodeticgeocentric::Gc2gd(ERFA_WGS84, &metres).ok()?;
    height_m.is_finite().then_some((lon_rad, lat_rad, height_m / 1_000.0))
}

/// Geodetic height above the WGS84 ellipsoid \[km\]; `None` at the Earth's centre.
#[must_use]
pub fn geodetic_height_km(position_km: &Vector<Itrs>) -> Option<f64> {
    geodetic(position_km).map(|(_, _, height_km)| height_km)
}

/// An observatory on the WGS84 ellipsoid.
///
/// ```
/// let macquarie = satphot::Site::new(-33.7703, 151.1113, 70.0)?; // degrees north, degrees east, metres
/// assert!((macquarie.height_km() - 0.070).abs() < 1e-12);
/// assert!(satphot::Site::new(133.0, 0.0, 0.0).is_err());
/// # satphot::Result::Ok(())
/// ```
#[derive(Debug, Clone)]
pub struct Site {
    lat_rad: f64,
    lon_rad: f64,
    height_km: f64,
    position_km: Vector<Itrs>,
}

impl Site {
    /// From the configuration.
    ///
    /// # Errors
    /// [`Error::Config`] for a latitude, longitude or height that is not on the Earth.
    #[doc(hidden)]
    pub fn from_config(site: &config::Site) -> Result<Self> {
        Self::new(site.lat_deg, site.lon_deg, site.alt_m)
    }

    /// From geodetic latitude \[deg, north positive\], longitude \[deg, east positive\] and height \[m\].
    ///
    /// # Errors
    /// As [`Site::from_config`].
    pub fn new(lat_deg: f64, lon_deg: f64, alt_m: f64) -> Result<Self> {
        for (key, value, lo, hi, unit) in [
            ("site.lat_deg", lat_deg, -90.0, 90.0, "deg, north positive"),
            ("site.lon_deg", lon_deg, -180.0, 360.0, "deg, east positive"),
            ("site.alt_m", alt_m, -500.0, 50_000.0, "m"),
        ] {
            if !(lo..=hi).contains(&value) {
                return Err(Error::Config {
                    key: key.to_owned(),
                    problem: format!("{value} is outside {lo} to {hi} [{unit}]"),
                });
            }
        }
        let (lat_rad, lon_rad) = (lat_deg.to_radians(), lon_deg.to_radians());
        let ([x, y, z], _) =
            erfars::geodeticgeocentric::Gd2gc(ERFA_WGS84, lon_rad, lat_rad, alt_m).map_err(|code| Error::Config {
                key: "site".to_owned(),
                problem: format!("ERFA gd2gc refuses it ({code})"),
            })?;
        let position_km = Vector::new(x, y, z) * 1e-3;
        Ok(Self { lat_rad, lon_rad, height_km: alt_m / 1_000.0, position_km })
    }

    /// The standard atmosphere at the height of the site.
    #[doc(hidden)]
    #[must_use]
    pub fn atmosphere(&self) -> Atmosphere {
        Atmosphere::at_height_m(1_000.0 * self.height_km)
    }

    /// Position \[km\].
    #[must_use]
    pub fn position(&self) -> Vector<Itrs> {
        self.position_km
    }
    /// Geodetic latitude, north positive \[rad\].
    #[must_use]
    pub fn lat_rad(&self) -> f64 {
        self.lat_rad
    }
    /// Longitude, east positive \[rad\].
    #[must_use]
    pub fn lon_rad(&self) -> f64 {
        self.lon_rad
    }
    /// Height above the ellipsoid \[km\].
    #[must_use]
    pub fn height_km(&self) -> f64 {
        self.height_km
    }

    /// Turns a direction or difference vector to the axes of the horizon (it does not subtract the position).
    #[doc(hidden)]
    #[must_use]
    pub fn to_enu(&self, v: &Vector<Itrs>) -> Vector<Enu> {
        let [e, n, u] = self.axes();
        Vector::new(e.dot(v), n.dot(v), u.dot(v))
    }

    /// Turns a direction or difference vector from the axes of the horizon to Earth-fixed ones.
    #[doc(hidden)]
    #[must_use]
    pub fn from_enu(&self, v: &Vector<Enu>) -> Vector<Itrs> {
        let [e, n, u] = self.axes();
        e * v.x() + n * v.y() + u * v.z()
    }

    /// East, north and up. At a pole east is where the site's longitude puts it.
    fn axes(&self) -> [Vector<Itrs>; 3] {
        let ((sp, cp), (sl, cl)) = (self.lat_rad.sin_cos(), self.lon_rad.sin_cos());
        [Vector::new(-sl, cl, 0.0), Vector::new(-sp * cl, -sp * sl, cp), Vector::new(cp * cl, cp * sl, sp)]
    }
}

/// Altitude and azimuth (north through east, 0 ≤ az < 2π) of a direction \[rad\]; azimuth 0 at the zenith.
#[must_use]
pub fn alt_az(v: &Vector<Enu>) -> (f64, f64) {
    let alt_rad = v.z().atan2(v.x().hypot(v.y()));
    let az_rad = v.x().atan2(v.y()).rem_euclid(std::f64::consts::TAU);
    // rem_euclid of a tiny negative number rounds to 2π itself.
    (alt_rad, if az_rad < std::f64::consts::TAU { az_rad } else { 0.0 })
}

/// Unit vector of an altitude and azimuth.
#[must_use]
pub fn from_alt_az(alt_rad: f64, az_rad: f64) -> Vector<Enu> {
    let ((sa, ca), (sz, cz)) = (alt_rad.sin_cos(), az_rad.sin_cos());
    Vector::new(ca * sz, ca * cz, sa)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::constants::{WGS84_A_KM, WGS84_F};

    #[test]
    fn a_site_on_the_equator_is_one_equatorial_radius_out_and_one_on_the_pole_a_polar_one() {
        let equator = Site::new(0.0, 90.0, 0.0).unwrap();
        assert!((equator.position().y() - WGS84_A_KM).abs() < 1e-9);
        let pole = Site::new(-90.0, 0.0, 1_000.0).unwrap();
        assert!((pole.position().z() + WGS84_A_KM * (1.0 - WGS84_F) + 1.0).abs() < 1e-9);
    }

    #[test]
    fn horizon_axes_turn_there_and_back_everywhere_also_at_the_poles() {
        for (lat, lon) in [(-33.77, 151.11), (90.0, 0.0), (-90.0, 45.0), (0.0, -180.0), (12.0, 359.99)] {
            let site = Site::new(lat, lon, 70.0).unwrap();
            let v = Vector::<Itrs>::new(123.0, -456.0, 789.0);
            assert!((site.from_enu(&site.to_enu(&v)) - v).norm() < 1e-12 * v.norm());
            // Up leaves the ellipsoid at a right angle: within 0.2° of the geocentric vertical.
            let up = site.to_enu(&site.position()).unit().unwrap();
            assert!(up.z() > 0.999_98);
        }
    }

    #[test]
    fn azimuth_wraps_below_a_full_turn_and_the_zenith_is_finite() {
        let (_, az) = alt_az(&Vector::new(-1e-300, 1.0, 0.0));
        assert!((0.0..std::f64::consts::TAU).contains(&az));
        let (alt, az) = alt_az(&Vector::new(0.0, 0.0, 1.0));
        assert!((alt - std::f64::consts::FRAC_PI_2).abs() < 1e-15 && az == 0.0);
        for az_deg in [0.0_f64, 0.1, 89.0, 180.0, 271.0, 359.9] {
            let (alt, az) = alt_az(&from_alt_az(0.7, az_deg.to_radians()));
            assert!((alt - 0.7).abs() < 1e-14 && (az.to_degrees() - az_deg).abs() < 1e-11);
        }
    }

    #[test]
    fn rotations_keep_lengths_and_undo_themselves_and_both_frames_spin_alike() {
        let (epoch, later) = (Epoch::from_mjd_utc(60_835.4), Epoch::from_mjd_utc(60_835.5));
        let eop = EarthOrientation { ut1_utc_s: Some(0.05), xp_arcsec: 0.1, yp_arcsec: 0.4 };
        let v = Vector::<Teme>::new(1.0, 2.0, 3.0);
        let r = teme_to_itrs(&epoch, &eop);
        assert!((r.undo(&r.apply(&v)) - v).norm() < 1e-14);
        // 0.1 d of sidereal rotation, in either frame; precession adds less than 0.1″.
        let turn = |a: Vector<Itrs>, b: Vector<Itrs>| {
            (b.y().atan2(b.x()) - a.y().atan2(a.x())).rem_euclid(std::f64::consts::TAU)
        };
        let teme = turn(r.apply(&v), teme_to_itrs(&later, &eop).apply(&v));
        let g = Vector::<Gcrs>::new(1.0, 2.0, 3.0);
        let gcrs = turn(gcrs_to_itrs(&epoch, &eop).apply(&g), gcrs_to_itrs(&later, &eop).apply(&g));
        assert!((teme - gcrs).abs() < 1e-6, "{teme} {gcrs}");
    }

    #[test]
    fn a_site_off_the_earth_is_refused_with_its_key() {
        let message = Site::new(91.0, 0.0, 0.0).unwrap_err().to_string();
        assert!(message.contains("site.lat_deg") && message.contains("91"), "{message}");
        assert!(Site::new(f64::NAN, 0.0, 0.0).is_err());
    }
}
