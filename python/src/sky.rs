//! How bright satellites of one type are in every direction of the sky over a site.

use pyo3::prelude::*;
use pyo3::types::PyList;
use rayon::prelude::*;
use satphot::Vector;
use satphot::brightness::sky::{Sky, SkyGrid, SkyMap, SkyPoint, sky_map};
use satphot::tables::SKY;
use satphot::visibility::forecast::dome::Overhead;
use satphot::visibility::forecast::sky_rows;

use crate::elements::site;
use crate::errors::{bad, raise};
use crate::interrupt::{Stopped, interruptible};
use crate::model::Model;
use crate::table::{Columns, Data};
use crate::times::epoch;

/// Columns of a map of the sky, and the height of its orbits [km].
#[pyfunction]
#[pyo3(signature = (model, place, time_ns, is_tai, height_km, track_az_deg, alt_by_az, threads))]
#[allow(clippy::too_many_arguments)] // what a map is of
pub fn sky<'py>(
    py: Python<'py>,
    model: &Model,
    place: (f64, f64, f64),
    time_ns: i64,
    is_tai: bool,
    height_km: Option<f64>,
    track_az_deg: f64,
    alt_by_az: (usize, usize),
    threads: usize,
) -> PyResult<(Bound<'py, PyList>, f64)> {
    let (site, moment) = (site(place)?, epoch(time_ns, is_tai)?);
    let height_km = height_km.map_or_else(|| model.height_km(), |height_km| Ok(Some(height_km)))?;
    let height_km = height_km
        .ok_or_else(|| bad("height_km", format!("no orbit of {} is known; give the height", model.satellite.name)))?;
    if !(height_km > 0.0 && height_km <= 1e6) {
        return Err(bad("height_km", format!("{height_km} km is outside 0 to 1000000 km")));
    }
    let grid = SkyGrid::new(alt_by_az.0, alt_by_az.1).map_err(raise)?;
    let settings = model.map_settings();
    let work = |stopped: Stopped| -> satphot::Result<SkyMap> {
        let axes = [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)]
            .map(|axis| site.from_enu(&axis));
        let overhead = Overhead::at(&site, &moment)?;
        let place = (model.radius_km(&site), height_km);
        let mut sky = Sky::new(axes, place, track_az_deg.to_radians(), overhead.sun, Some(overhead.moon))?;
        sky.sidereal_rad = overhead.sidereal_rad;
        // one direction gives the unit of the fluxes; the others are computed where they can be stopped
        let zenith = SkyGrid { alt_deg: vec![90.0], az_deg: vec![0.0] };
        let unit = sky_map(&sky, &zenith, &model.satellite, &settings, &|| ())?;
        let engine = sky.model(&model.satellite, &settings)?;
        let point = |(alt_deg, az_deg): (f64, f64)| -> satphot::Result<SkyPoint> {
            if stopped() {
                return Ok(SkyPoint::default());
            }
            let scene = sky.scene(alt_deg.to_radians(), (az_deg % 360.0).to_radians());
            Ok(SkyPoint::of(&scene, &engine.brightness(&scene)?))
        };
        let directions: Vec<(f64, f64)> = grid.directions().collect();
        let points = directions.into_par_iter().map(point).collect::<satphot::Result<_>>()?;
        Ok(SkyMap { grid: grid.clone(), points, sun_flux: unit.sun_flux })
    };
    let map = interruptible(py, threads, false, work)?.map_err(raise)?;

    let rows = sky_rows(&map);
    let mut columns = Columns::default();
    let number = |value: &dyn Fn(&satphot::tables::SkyRow) -> Option<f64>| {
        Data::Float(rows.iter().map(|r| value(r).unwrap_or(f64::NAN)).collect())
    };
    columns.of(&SKY, "alt_deg", number(&|r| Some(r.alt_deg)));
    columns.of(&SKY, "az_deg", number(&|r| Some(r.az_deg)));
    columns.of(&SKY, "range_km", number(&|r| Some(r.range_km)));
    columns.of(&SKY, "illum", Data::Text(rows.iter().map(|r| r.illum.clone()).collect()));
    columns.of(&SKY, "sun_visible_frac", number(&|r| Some(r.sun_visible_frac)));
    columns.of(&SKY, "model_v_mag", number(&|r| r.model_v_mag));
    columns.of(&SKY, "sun_v_mag", number(&|r| r.sun_v_mag));
    columns.of(&SKY, "earthshine_v_mag", number(&|r| r.earthshine_v_mag));
    columns.of(&SKY, "moon_v_mag", number(&|r| r.moon_v_mag));
    columns.of(&SKY, "lunar_earthshine_v_mag", number(&|r| r.lunar_earthshine_v_mag));
    columns.of(&SKY, "model_err_mag", number(&|r| r.model_err_mag));
    columns.of(&SKY, "v_pred_err_mag", number(&|r| r.v_pred_err_mag));
    columns.of(&SKY, "flux_per_e0", number(&|r| Some(r.flux_per_e0)));
    columns.of(&SKY, "too_faint", Data::Text(rows.iter().map(|r| r.too_faint.clone()).collect()));
    Ok((columns.into_py(py)?, height_km))
}
