//! A map of the sky as rows of a table: one per direction, each light a magnitude, no light a missing one.

use crate::brightness::Illum;
use crate::brightness::lamps::mag_of_flux;
use crate::brightness::sky::{SkyMap, SkyPoint};
use crate::tables::SkyRow;

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
    let [sun, earthshine, moon, lunar_earthshine] = point.lights;
    let model_v_mag = point.v_mag();
    SkyRow {
        alt_deg,
        az_deg,
        range_km: point.range_km,
        illum: largest(point).to_string(),
        sun_visible_frac: point.sun_visible_frac,
        model_v_mag,
        sun_v_mag: mag_of_flux(sun),
        earthshine_v_mag: mag_of_flux(earthshine),
        moon_v_mag: mag_of_flux(moon),
        lunar_earthshine_v_mag: mag_of_flux(lunar_earthshine),
        model_err_mag: model_v_mag.map(|_| point.err_mag),
        flux_per_e0: flux_per_e0(map, point),
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
        let partly = SkyPoint { lights: [1.0, 0.0, 0.0, 0.0], sun_visible_frac: 0.3, ..point };
        assert_eq!(row((30.0, 90.0), &partly).illum, "penumbra");
        let dark = row((30.0, 90.0), &SkyPoint::default());
        assert_eq!((dark.model_v_mag, dark.model_err_mag, dark.illum.as_str()), (None, None, "none"));
        let half = SkyPoint { lights: [1.0, 0.0, 0.0, 0.0], ..SkyPoint::default() };
        assert_eq!(row((30.0, 90.0), &half).flux_per_e0, 0.5);
    }
}
