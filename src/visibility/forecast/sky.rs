//! A map of the sky as rows of a table: one per direction, each light a magnitude, no light a missing one.

use hifitime::Epoch;

use super::dome::Overhead;
use crate::base::error::Result;
use crate::base::vector::Vector;
use crate::brightness::light_sources::mag_of_flux;
use crate::brightness::scene::local_radius_km;
use crate::brightness::sky::{Sky, SkyGrid, SkyMap, SkyPoint, sky_map};
use crate::brightness::{Illum, ModelSettings, Satellite, too_faint_text};
use crate::orbit::Site;
use crate::tables::SkyRow;

/// Azimuth in which the satellites of a map move \[rad\]: eastward.
const TRACK_AZ_RAD: f64 = std::f64::consts::FRAC_PI_2;

/// How bright satellites of one type would be in every direction of the sky over a site at one moment.
///
/// Each direction holds one satellite, where the line of sight meets the sphere of the orbits `height_km` above the site;
/// it moves eastward on a circular orbit. The Earth is a sphere with the radius of the site. Sun and Moon stand where the
/// ephemeris puts them. The map has `n_alt` altitudes from 0 to 90° and `n_az` azimuths from 0 to 360°, ends included.
///
/// # Errors
/// [`Error::Model`](crate::Error::Model) for a height that is not above 0, a grid of fewer than 2 by 2, or surfaces that
/// are no reflectors; [`Error::Orbit`](crate::Error::Orbit) outside the years 1900 to 2100.
///
/// ```
/// use satphot::{ModelSettings, Satellite, Site, map_sky};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let site = Site::new(-33.7703, 151.1113, 70.0)?;
/// let starlink = Satellite::named("starlink-v1.5").ok_or("not in the catalogue")?;
/// let evening = "2025-06-09T08:30:00 UTC".parse()?;
/// let map = map_sky(&starlink, &ModelSettings::default(), &site, &evening, 550.0, (7, 13))?;
/// let (_, brightest_v_mag) = map.brightest().ok_or("a dark sky")?;
/// assert!((brightest_v_mag - 5.3).abs() < 0.3);
/// # Ok(())
/// # }
/// ```
pub fn map_sky(
    satellite: &Satellite,
    settings: &ModelSettings,
    site: &Site,
    epoch: &Epoch,
    height_km: f64,
    (n_alt, n_az): (usize, usize),
) -> Result<SkyMap> {
    let axes =
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|[e, n, u]| site.from_enu(&Vector::new(e, n, u)));
    let overhead = Overhead::at(site, epoch)?;
    let radius_km = local_radius_km(&site.position());
    let mut sky = Sky::new(axes, (radius_km, height_km), TRACK_AZ_RAD, overhead.sun, Some(overhead.moon))?;
    sky.sidereal_rad = overhead.sidereal_rad;
    sky_map(&sky, &SkyGrid::new(n_alt, n_az)?, satellite, settings, &|| ())
}

/// The rows of a map, in the order of its points.
#[must_use]
pub fn sky_rows(map: &SkyMap) -> Vec<SkyRow> {
    map.grid.directions().zip(&map.points).map(|(direction, point)| row(map, direction, point)).collect()
}

/// Irradiance at the observer by all lights, in units of the Sun's at 1 au as the model scales it.
#[must_use]
pub fn flux_per_e0(map: &SkyMap, point: &SkyPoint) -> f64 {
    point.flux() / map.sun_flux
}

fn row(map: &SkyMap, (alt_deg, az_deg): (f64, f64), point: &SkyPoint) -> SkyRow {
    let of = |light: usize| mag_of_flux(point.lights[light]).filter(|_| !point.too_faint[light]);
    let model_v_mag = point.v_mag();
    SkyRow {
        alt_deg,
        az_deg,
        range_km: point.range_km,
        illum: largest(point).to_string(),
        sun_visible_frac: point.sun_visible_frac,
        model_v_mag,
        sun_v_mag: of(0),
        earthshine_v_mag: of(1),
        moon_v_mag: of(2),
        lunar_earthshine_v_mag: of(3),
        model_err_mag: model_v_mag.map(|_| point.err_mag),
        v_pred_err_mag: model_v_mag.and(point.pred_err_mag),
        flux_per_e0: flux_per_e0(map, point),
        too_faint: too_faint_text(&point.too_faint),
    }
}

/// The largest light; a partly covered Sun is the penumbra.
fn largest(point: &SkyPoint) -> Illum {
    let direct = if point.sun_visible_frac < 1.0 { Illum::Penumbra } else { Illum::Sun };
    let classes = [direct, Illum::Earthshine, Illum::Moon, Illum::LunarEarthshine];
    let lights = classes.into_iter().zip(point.lights);
    lights.fold((Illum::None, 0.0), |largest, light| if light.1 > largest.1 { light } else { largest }).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brightness::sky::SkyGrid;

    #[test]
    fn a_light_that_is_not_there_is_no_magnitude_and_the_largest_names_the_direction() {
        let grid = SkyGrid::new(2, 2).unwrap();
        let map = SkyMap { grid, points: vec![SkyPoint::default(); 4], sun_flux: 2.0 };
        let row = |direction, point: &SkyPoint| super::row(&map, direction, point);
        let point = SkyPoint { lights: [0.0, 1e-4, 1e-6, 0.0], sun_visible_frac: 0.3, ..SkyPoint::default() };
        let dim = row((30.0, 90.0), &point);
        assert_eq!((dim.sun_v_mag, dim.lunar_earthshine_v_mag, dim.illum.as_str()), (None, None, "earthshine"));
        assert!((dim.earthshine_v_mag.unwrap() - 10.0).abs() < 1e-12);
        let faint =
            SkyPoint { lights: [0.0, 1e-4, 1e-9, 0.0], too_faint: [false, false, true, true], ..SkyPoint::default() };
        let faint = row((30.0, 90.0), &faint);
        assert_eq!((faint.moon_v_mag, faint.too_faint.as_str()), (None, "moon; lunar_earthshine"));
        let partly = SkyPoint { lights: [1.0, 0.0, 0.0, 0.0], sun_visible_frac: 0.3, ..point };
        assert_eq!(row((30.0, 90.0), &partly).illum, "penumbra");
        let dark = row((30.0, 90.0), &SkyPoint::default());
        assert_eq!((dark.model_v_mag, dark.model_err_mag, dark.illum.as_str()), (None, None, "none"));
        let half = SkyPoint { lights: [1.0, 0.0, 0.0, 0.0], ..SkyPoint::default() };
        assert_eq!(row((30.0, 90.0), &half).flux_per_e0, 0.5);
    }
}
