//! Radiance images for readers: the table of a picture, the picture as FITS, as PNG, and strips of many.
//!
//! W m⁻² sr⁻¹ in a band, magnitudes V. Leaves out: how a picture is made.

pub mod fits;
mod font;
pub mod picture;
pub mod snr;

use crate::base::constants::ARCSEC2_PER_SR;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::base::error::Result;
use crate::brightness::lamps::mag_of_flux;
use crate::resolved::points::PointLight;
use crate::resolved::{Light, Rendered, Renderer};
use crate::tables::columns::{Column, number, text};
use crate::tables::ecsv;
use crate::tables::meta::Meta;

/// Name of the sum of the lights.
pub const TOTAL: &str = "total";

/// One light of the whole satellite, or of a test point.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RadianceRow {
    /// `satellite`; `picture` for the part in a picture that does not hold all of it; or the name of a test point.
    pub place: String,
    /// Component of the test point.
    pub component: String,
    /// `seen`, `hidden` or `faces away`.
    pub view: String,
    /// The light, or `total`.
    pub light: String,
    /// Radiance in band \[W m⁻² sr⁻¹\]: of the point, or the mean over what is seen of the satellite.
    pub radiance_w_m2_sr: f64,
    /// Irradiance in band at the observer \[W m⁻²\].
    pub irradiance_w_m2: Option<f64>,
    /// V outside the atmosphere \[mag\].
    pub v_mag: Option<f64>,
    /// V surface brightness \[mag arcsec⁻²\].
    pub mu_v_mag_arcsec2: Option<f64>,
    /// Share of the irradiance, or of the point's radiance.
    pub share_frac: Option<f64>,
}

/// Columns of the table of a picture.
pub const RADIANCE: &[Column] = &[
    text(
        "place",
        "satellite (the whole of it); picture (the part in a picture that does not hold all of it); or the name of a test point",
    ),
    text("component", "component the test point is on"),
    text("view", "test point: seen, hidden behind another part, or faces away from the observer"),
    text("light", "sunlight, earthshine, moonlight, lunar_earthshine, starlight, or total"),
    number(
        "radiance_w_m2_sr",
        "W m-2 sr-1",
        "radiance in band towards the observer; satellite, picture: mean over what is seen",
    ),
    number("irradiance_w_m2", "W m-2", "irradiance in band at the observer, outside the atmosphere"),
    number("v_mag", "mag", "V magnitude, Vega, outside the atmosphere"),
    number("mu_v_mag_arcsec2", "mag / arcsec2", "V surface brightness"),
    number("share_frac", "", "share of the total"),
];

/// The rows of a picture: every light of the satellite (of the part in the picture) and their sum, then those of the test points.
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

/// Writes the table.
///
/// # Errors
/// [`crate::Error::Table`] naming row and column of a NaN or infinite number; [`crate::Error::Io`].
pub fn write_radiance(path: &Path, rows: &[RadianceRow], meta: &Meta) -> Result<()> {
    ecsv::write_rows(path, rows, RADIANCE, meta)
}
