//! Where a satellite, the Sun and the Moon stand over the ground: geodetic points, and the line on which a light source
//! sets.
//!
//! deg on the WGS84 ellipsoid, east and north positive; centres of Sun and Moon, without refraction.

use super::earth::{Site, alt_az, geodetic};
use crate::base::error::Result;
use crate::base::search::{Until, bisect};
use crate::base::vector::{Enu, Itrs, Vector};

/// Geodetic longitude, latitude \[deg\] and height \[km\] under a place; `None` at the Earth's centre.
#[must_use]
pub fn point_under(position_km: &Vector<Itrs>) -> Option<(f64, f64, f64)> {
    let (lon_rad, lat_rad, height_km) = geodetic(position_km)?;
    Some((lon_rad.to_degrees(), lat_rad.to_degrees(), height_km))
}

/// Altitude of a body's centre over the horizon of a point of the ground \[deg\], parallax included.
///
/// # Errors
/// As [`Site::new`].
pub fn altitude_deg(lon_deg: f64, lat_deg: f64, body_km: &Vector<Itrs>) -> Result<f64> {
    let site = Site::new(lat_deg, lon_deg, 0.0)?;
    Ok(alt_az(&site.to_enu(&(*body_km - site.position()))).0.to_degrees())
}

/// The terminator of a body: `n` points at equal bearings about the point under it where its altitude is 0, as
/// longitude and latitude \[deg\]; found by halving the way from there to the antipode.
///
/// # Errors
/// As [`Site::new`].
pub fn terminator(body_km: &Vector<Itrs>, n: usize) -> Result<Vec<(f64, f64)>> {
    let Some((lon0, lat0, _)) = point_under(body_km) else { return Ok(Vec::new()) };
    let under = Site::new(lat0, lon0, 0.0)?;
    let up = under.from_enu(&Vector::<Enu>::new(0.0, 0.0, 1.0));
    (0..n)
        .map(|k| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / n.max(1) as f64).sin_cos();
            let ahead = under.from_enu(&Vector::<Enu>::new(sin, cos, 0.0));
            // geodetic longitude and latitude are those of the plumb line
            let place = |angle: f64| {
                let u = up * angle.cos() + ahead * angle.sin();
                (u.y().atan2(u.x()).to_degrees(), u.z().atan2(u.x().hypot(u.y())).to_degrees())
            };
            let is_up = |angle: f64| {
                let (lon, lat) = place(angle);
                Ok::<bool, crate::Error>(altitude_deg(lon, lat, body_km)? > 0.0)
            };
            let [near, _] = bisect(0.0, std::f64::consts::PI, Until::Steps(50), is_up)?;
            Ok(place(near))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::constants::{AU_KM, WGS84_A_KM};

    #[test]
    fn on_its_terminator_a_light_source_is_90_degrees_from_the_zenith() {
        for (lon, lat, km) in [(151.0, -23.4, AU_KM), (-170.0, 28.0, 384_400.0), (0.0, 0.0, 384_400.0)] {
            let site = Site::new(lat, lon, 0.0).unwrap();
            let body = site.from_enu(&Vector::<Enu>::new(0.0, 0.0, 1.0)) * km;
            let line = terminator(&body, 72).unwrap();
            assert_eq!(line.len(), 72);
            for (lon, lat) in line {
                assert!(altitude_deg(lon, lat, &body).unwrap().abs() < 1e-9, "{lon} {lat}");
            }
        }
    }

    #[test]
    fn the_moon_sets_a_parallax_before_a_quarter_turn() {
        // cos of the angle from the sub-lunar point = R/d
        let body = Vector::new(384_400.0, 0.0, 0.0);
        let line = terminator(&body, 4).unwrap();
        let east = line.iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max);
        assert!((east - (WGS84_A_KM / 384_400.0).acos().to_degrees()).abs() < 1e-6, "{east}");
    }

    #[test]
    fn the_point_under_a_site_is_the_site() {
        let site = Site::new(-33.7703, 151.1113, 70.0).unwrap();
        let (lon, lat, height) = point_under(&site.position()).unwrap();
        assert!((lon - 151.1113).abs() < 1e-9 && (lat + 33.7703).abs() < 1e-9 && (height - 0.07).abs() < 1e-9);
        assert!(point_under(&Vector::new(0.0, 0.0, 0.0)).is_none());
    }
}
