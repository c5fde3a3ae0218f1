//! Radiance images for readers: the table of a picture, the picture as FITS, as PNG, and strips of many.
//!
//! W m⁻² sr⁻¹ in a band, magnitudes V. It does not cover how a picture is made.

pub mod fits;
mod font;
pub mod picture;
pub mod snr;

use crate::base::constants::ARCSEC2_PER_SR;
use crate::brightness::light_sources::mag_of_flux;
use crate::resolved::points::PointLight;
use crate::resolved::{Light, Rendered, Renderer};
use crate::tables::RadianceRow;

/// Name of the sum of the lights.
pub const TOTAL: &str = "total";

/// The rows of a picture: every light of the satellite (of the part in the picture) and their sum, then those of the
/// test points.
#[must_use]
pub fn radiance_rows(renderer: &Renderer, rendered: &Rendered, points: &[PointLight]) -> Vec<RadianceRow> {
    let image = &rendered.image;
    let mut rows = Vec::new();
    let range_m = image.range_km * 1e3;
    let seen_sr = rendered.seen_area_m2 / (range_m * range_m);
    let total_w: f64 = image.planes.iter().map(|(l, _)| image.irradiance_w_m2(*l)).sum();
    let share = |part: f64, whole: f64| (whole > 0.0).then(|| part / whole);
    let mu = |v_flux_per_sr: f64| mag_of_flux(v_flux_per_sr / ARCSEC2_PER_SR);
    let mut satellite = |light: &str, w_m2: f64, v_flux: f64| {
        rows.push(RadianceRow {
            place: if rendered.whole { "satellite" } else { "picture" }.into(),
            light: light.into(),
            radiance_w_m2_sr: if seen_sr > 0.0 { w_m2 / seen_sr } else { 0.0 },
            irradiance_w_m2: Some(w_m2),
            v_mag: mag_of_flux(v_flux),
            mu_v_mag_arcsec2: if seen_sr > 0.0 { mu(v_flux / seen_sr) } else { None },
            share_frac: share(w_m2, total_w),
            ..RadianceRow::default()
        });
    };
    for (light, v_flux) in &rendered.v_flux {
        satellite(light.name(), image.irradiance_w_m2(*light), *v_flux);
    }
    satellite(TOTAL, total_w, rendered.v_flux.iter().map(|(_, v)| v).sum());
    let shining: Vec<Light> = image.planes.iter().map(|(l, _)| *l).collect();
    for point in points {
        let all = point.of(&shining);
        let v = |light: Light| point.of(&[light]) * renderer.v_per_w_m2(light);
        let mut row = |light: &str, radiance: f64, v_flux: f64| {
            rows.push(RadianceRow {
                place: point.name.clone(),
                component: point.component.clone(),
                view: point.view.into(),
                light: light.into(),
                radiance_w_m2_sr: radiance,
                mu_v_mag_arcsec2: mu(v_flux),
                share_frac: share(radiance, all),
                ..RadianceRow::default()
            });
        };
        for light in &shining {
            row(light.name(), point.of(&[*light]), v(*light));
        }
        row(TOTAL, all, shining.iter().map(|l| v(*l)).sum());
    }
    rows
}
