//! One moment of a pass: what comes from the satellite, what the sky adds, what the telescope makes of it.

use std::f64::consts::PI;

use crate::base::error::Result;
use crate::brightness::scene::scene;
use crate::brightness::{Brightness, Model, skipped_text};
use crate::orbit::Geometry;
use crate::tables::PlanRow;
use crate::visibility::sky_brightness::{
    MoonInSky, moonlit_sky_v_mag_arcsec2, nl_of_v_mag_arcsec2, twilight_nl, v_mag_arcsec2_of_nl,
};
use crate::visibility::sky_brightness_table::sky_of_v;
use crate::visibility::tracked::{Area, Calculator};

use super::settings::PlanSettings;

/// One moment.
pub struct Look {
    pub geometry: Geometry,
    light: Option<Brightness>,
    sky_mag_arcsec2: f64,
    /// The telescope under the extinction of this moment, and what it sums.
    telescope: Calculator,
    area: Area,
    /// One exposure: that asked for, or the longest that does not saturate \[s\].
    pub exptime_s: f64,
    /// Even the shortest exposure saturates.
    pub saturated: bool,
    /// Of one exposure; `None` without light, without a model, and where it saturates.
    pub snr: Option<f64>,
    /// Of the exposure that is asked for, were there no saturation: what moments are compared by.
    pub merit: f64,
}

/// Looks at a satellite.
///
/// # Errors
/// [`crate::Error::Model`] for a scene, a sky or a telescope that makes no sense.
pub fn look(geometry: Geometry, model: Option<&Model>, settings: &PlanSettings) -> Result<Look> {
    let light = model.map(|m| m.brightness(&scene(&geometry))).transpose()?;
    let sky_mag_arcsec2 = sky(&geometry, settings)?;
    let airmass = geometry.airmass.unwrap_or_default();
    let telescope = Calculator { extinction_mag: settings.k_mag_airmass * airmass, ..settings.calculator };
    let v_mag = light.as_ref().and_then(|l| l.total_v_mag);
    // Ω of the mean surface brightness: μ = V + 2.5 lg Ω
    let omega = light.as_ref().and_then(|l| Some(10f64.powf(0.4 * (l.mu_mean_mag_arcsec2? - v_mag?))));
    let area = omega.filter(|o| *o > 0.0 && o.is_finite()).map_or(Area::Point, Area::Extended);
    let unsaturated_s = v_mag.map_or(f64::INFINITY, |v| telescope.unsaturated_s(area, v, sky_mag_arcsec2));
    let exptime_s = settings.exptime_s.min(unsaturated_s);
    let saturated = unsaturated_s < settings.min_exptime_s;
    let snr_in = |exptime_s: f64| v_mag.map(|v| telescope.snr(area, v, sky_mag_arcsec2, exptime_s, 1)).transpose();
    let snr = snr_in(exptime_s)?.filter(|_| !saturated);
    let merit = snr_in(settings.exptime_s)?.unwrap_or_default();
    Ok(Look { geometry, light, sky_mag_arcsec2, telescope, area, exptime_s, saturated, snr, merit })
}

/// The sky next to the satellite \[mag/arcsec²\]: dark, moonlit, twilight (that of the zenith).
fn sky(g: &Geometry, settings: &PlanSettings) -> Result<f64> {
    let moon = MoonInSky { alt_rad: g.moon_alt_rad, phase_rad: g.moon_phase_rad, sep_rad: g.moon_sep_rad };
    let (dark, k) = (settings.dark_sky_mag_arcsec2, settings.k_mag_airmass);
    let night = moonlit_sky_v_mag_arcsec2(dark, k, g.alt_rad, Some(moon));
    let v = v_mag_arcsec2_of_nl(nl_of_v_mag_arcsec2(night) + twilight_nl(g.sun_alt_rad)?);
    sky_of_v(&settings.sky_band, v)
}

impl Look {
    /// Far enough from a Moon that is up.
    pub fn away_from_moon(&self, settings: &PlanSettings) -> bool {
        self.geometry.moon_alt_rad <= 0.0 || self.geometry.moon_sep_rad >= settings.moon_sep_rad
    }

    /// Slow enough for the mount.
    pub fn slow(&self, settings: &PlanSettings) -> bool {
        self.geometry.rate_rad_s <= settings.max_rate_rad_s
    }

    /// Not hidden by what stands around the telescope.
    pub fn above_horizon(&self, settings: &PlanSettings) -> bool {
        self.geometry.alt_rad >= settings.horizon.alt_rad(self.geometry.az_rad)
    }

    /// All that is asked for.
    pub fn observable(&self, settings: &PlanSettings) -> bool {
        self.snr.is_some_and(|snr| snr >= settings.snr)
            && self.above_horizon(settings)
            && self.away_from_moon(settings)
            && self.slow(settings)
    }

    /// What the model left out, and why.
    pub fn skipped(&self) -> String {
        self.light.as_ref().map(|light| skipped_text(&light.skipped)).unwrap_or_default()
    }

    /// The columns of this moment.
    pub fn fill(&self, row: &mut PlanRow, settings: &PlanSettings) {
        let g = &self.geometry;
        let deg = |rad: f64| Some(rad * 180.0 / PI);
        row.alt_deg = deg(g.alt_rad);
        row.az_deg = deg(g.az_rad);
        row.range_km = Some(g.range_km);
        row.height_km = Some(g.height_km);
        row.airmass = g.airmass;
        row.rate_deg_s = deg(g.rate_rad_s);
        row.az_rate_deg_s = deg(g.az_rate_rad_s);
        row.phase_angle_deg = deg(g.phase_angle_rad);
        row.sun_alt_deg = deg(g.sun_alt_rad);
        row.moon_alt_deg = deg(g.moon_alt_rad);
        row.moon_illum_pct = Some(100.0 * g.moon_illum_frac);
        row.moon_sep_deg = deg(g.moon_sep_rad);
        row.tle_age_d = Some(g.tle_age_d);
        row.sky_mag_arcsec2 = Some(self.sky_mag_arcsec2);
        let Some(light) = &self.light else { return };
        row.illum = light.illum.to_string();
        row.model_v_mag = light.total_v_mag;
        row.v_pred_err_mag = light.v_pred_err_mag;
        row.model_err_mag = light.total_v_mag.map(|_| light.err_mag);
        row.sun_v_mag = light.sun.v_mag;
        row.earthshine_v_mag = light.earthshine.v_mag;
        row.moon_v_mag = light.moon.v_mag;
        row.lunar_earthshine_v_mag = light.lunar_earthshine.v_mag;
        row.mu_mean_mag_arcsec2 = light.mu_mean_mag_arcsec2;
        let Some(v_mag) = light.total_v_mag else { return };
        row.snr = self.snr;
        row.exptime_s = self.snr.map(|_| self.exptime_s);
        row.unsaturated_exptime_s = Some(self.telescope.unsaturated_s(self.area, v_mag, self.sky_mag_arcsec2));
        match self.telescope.needed(self.area, v_mag, self.sky_mag_arcsec2, 1, settings.snr) {
            Ok(needed) => {
                row.needed_exptime_s = Some(needed.exptime_s);
                row.needed_n_sub = Some(i64::from(needed.n_sub));
            }
            Err(error) => {
                let before = if row.reason.is_empty() { String::new() } else { format!("{}; ", row.reason) };
                row.reason = format!("{before}no exposure time: {error}");
            }
        }
    }
}
