//! How geometry and the model's magnitudes are written into a row.

use super::Brightness;
use super::light_class::PaperLabel;
use super::light_class::classes;
use super::light_class::is_sunlit;
use super::scene::source_alt_rad;
use super::skipped_text;
use crate::config;
use crate::orbit::Geometry;
use crate::photometry::Flags;
use crate::tables::MetaValue;
use crate::tables::PhotometryRow;

/// The geometry columns.
pub fn fill_geometry(row: &mut PhotometryRow, g: &Geometry) {
    row.alt_deg = Some(g.alt_rad.to_degrees());
    row.az_deg = Some(g.az_rad.to_degrees());
    row.range_km = Some(g.range_km);
    row.rate_deg_s = Some(g.rate_rad_s.to_degrees());
    row.az_rate_deg_s = Some(g.az_rate_rad_s.to_degrees());
    row.airmass = g.airmass;
    row.phase_angle_deg = Some(g.phase_angle_rad.to_degrees());
    row.sun_alt_deg = Some(g.sun_alt_rad.to_degrees());
    row.sun_alt_sat_deg = Some(source_alt_rad(&g.satellite_itrs_km, &g.sun_itrs_km).to_degrees());
    row.moon_alt_deg = Some(g.moon_alt_rad.to_degrees());
    row.moon_phase_deg = Some(g.moon_phase_rad.to_degrees());
    row.moon_illum_pct = Some(100.0 * g.moon_illum_frac);
    row.moon_sep_deg = Some(g.moon_sep_rad.to_degrees());
    row.tle_age_d = Some(g.tle_age_d);
    // a place below the ground has no light, and its row says so elsewhere
    if let Ok((sky, label)) = classes(g) {
        (row.sky_class, row.paper_label) = (sky.to_string(), label.to_string());
    }
    if g.tle_age_d.abs() > OLD_ELEMENTS_D {
        row.flags |= Flags::OLD_ELEMENTS.0;
    }
}

/// The model columns, and where the model is of the observed band the residual, observed minus modelled.
pub fn fill_model(row: &mut PhotometryRow, model: &Brightness, same_band: bool) {
    row.model_v_mag = model.total_v_mag;
    row.sun_v_mag = model.sun.v_mag;
    row.earthshine_v_mag = model.earthshine.v_mag;
    row.moon_v_mag = model.moon.v_mag;
    row.lunar_earthshine_v_mag = model.lunar_earthshine.v_mag;
    row.model_err_mag = model.total_v_mag.map(|_| model.err_mag);
    row.v_pred_err_mag = model.v_pred_err_mag;
    row.lit_array_cos = model.lit_array_cos;
    row.illum = model.illum.to_string();
    // sunlight that the air bends past the edge of the geometric shadow is sunlight too
    if is_sunlit(model.illum) && PaperLabel::from_text(&row.paper_label) == Some(PaperLabel::Night) {
        row.paper_label = PaperLabel::Twilight.to_string();
    }
    row.skipped = skipped_text(&model.skipped);
    row.residual_mag = match (row.v_mag, row.model_v_mag) {
        (Some(observed), Some(modelled)) if same_band => Some(observed - modelled),
        _ => None,
    };
    if model.extrapolated {
        row.flags |= Flags::MODEL_EXTRAPOLATED.0;
    }
}

/// The magnitudes at standard ranges and at half phase, of a row with magnitude and place.
pub fn fill_normalised(row: &mut PhotometryRow) {
    let at_km = |to_km: f64| Some(row.v_mag? - 5.0 * (row.range_km? / to_km).log10());
    let (at_550, at_1000) = (at_km(550.0), at_km(1000.0));
    // m = std − 2.5 lg(2 g), g = (1 + cos φ)/2
    let half_lit = |deg: f64| 2.5 * (1.0 + deg.to_radians().cos()).log10();
    row.standard_v_mag =
        at_1000.zip(row.phase_angle_deg).map(|(mag, deg)| mag + half_lit(deg)).filter(|m| m.is_finite());
    (row.v_mag_550km, row.v_mag_1000km) = (at_550, at_1000);
}

/// Each effect of a model by name, as a file spells it.
#[must_use]
pub fn effects_meta(model: &config::Model) -> MetaValue {
    let table = match toml::Value::try_from(model.resolved_effects()) {
        Ok(toml::Value::Table(table)) => table,
        _ => toml::Table::new(),
    };
    let spelled = |v: &toml::Value| MetaValue::Text(v.as_str().unwrap_or_default().into());
    MetaValue::Map(table.iter().map(|(key, value)| (key.clone(), spelled(value))).collect())
}

/// Elements older than this are flagged \[d\] (arcminutes of error are normal beyond it).
pub(crate) const OLD_ELEMENTS_D: f64 = 2.0;
