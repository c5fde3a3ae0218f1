//! One target frame, from disk to magnitudes. Nothing here stops the night: a frame that fails says why.

use std::fmt;

use super::measurement::{CalibratedMeasurement, Measurement, Setting};
use super::outcome::TaggedFrame;
use super::place::Place;
use super::star_trails::{frame_trails, guarded_trails};
use crate::base::error::{Error, Result};
use crate::base::time::mjd_utc;
use crate::frames::Exposure;
use crate::orbit::Geometry;
use crate::photometry::growth::FRAME_SCATTER;
use crate::photometry::target::measure::KnownDirection;
use crate::photometry::target::settings::TargetSettings;
use crate::pipeline::prepared::{Calibrated, Prepared};
use crate::pipeline::target::window::{Region, measure_in_window};

/// Length of a satellite in diameters of a disc of the area of all its surfaces: of a plate eleven times as long as wide.
const LONGEST_OF_AREA: f64 = 3.0;
/// FWHM taken when neither star pointings nor the configuration give one \[arcsec\].
pub const ASSUMED_FWHM_ARCSEC: f64 = 2.5;

/// Measures the target in one frame, where the elements let it be there, and calibrates it; first in the `region` where its pass has
/// it.
#[must_use]
pub fn measure_frame<'a>(exposure: &'a Exposure, region: Option<&Region>, night: &Calibrated) -> TaggedFrame<'a> {
    let place = Place::of(exposure, night);
    if place.problem.is_some() {
        return TaggedFrame { exposure, place, measured: None, trails: None };
    }
    let geometry = place.seen();
    // a damaged file must cost one row even where a library panics on it
    let measured = || measure_target(geometry, exposure, region, night);
    let measured = std::panic::catch_unwind(std::panic::AssertUnwindSafe(measured));
    let (airmass, mjd_mid_d) = (geometry.and_then(|g| g.airmass), exposure.time.as_ref().map(|t| mjd_utc(t.mid)));
    let measured = measured.unwrap_or_else(|_| Err(internal(exposure)));
    let measured = measured.map(|m| m.calibrated(airmass, mjd_mid_d, night));
    let fwhm_px = target_settings(exposure, night, night.seeing.fwhm_arcsec(airmass)).fwhm_px;
    let of_frame = |m: &CalibratedMeasurement| guarded_trails(|| frame_trails(exposure, geometry, (m, fwhm_px), night));
    let trails = measured.as_ref().ok().and_then(of_frame);
    TaggedFrame { exposure, place, measured: Some(measured), trails }
}

/// What is reported of a frame on which the program itself failed.
#[must_use]
pub fn internal(exposure: &Exposure) -> Error {
    Error::Fits { path: exposure.path.clone(), problem: "internal error while reading this frame".into() }
}

/// FWHM of the stars of this frame \[px\], if the configuration or the star pointings determine it.
fn known_fwhm_px(exposure: &Exposure, night: &Prepared, fwhm_arcsec: Option<f64>) -> Option<f64> {
    night.config.photometry.fwhm_px.or(fwhm_arcsec.map(|f| f / night.scale_arcsec(exposure)))
}

/// Where and how the target is looked for in one frame.
#[must_use]
pub fn target_settings(exposure: &Exposure, night: &Prepared, fwhm_arcsec: Option<f64>) -> TargetSettings {
    let (p, t) = (&night.config.photometry, &night.config.target);
    let scale_arcsec = night.scale_arcsec(exposure);
    let known_fwhm_px = known_fwhm_px(exposure, night, fwhm_arcsec);
    let fwhm_px = known_fwhm_px.unwrap_or(ASSUMED_FWHM_ARCSEC / scale_arcsec);
    let (nx, ny) = exposure.size_px;
    TargetSettings {
        x_px: t.x_px.unwrap_or((nx as f64 - 1.0) / 2.0),
        y_px: t.y_px.unwrap_or((ny as f64 - 1.0) / 2.0),
        search_radius_px: t.search_radius_arcsec / scale_arcsec,
        detect_sigma: t.detect_sigma,
        margin_px: t.margin_fwhm * fwhm_px,
        limit_r_px: t.limit_r_fwhm * fwhm_px,
        fwhm_px,
        fwhm_err_frac: FRAME_SCATTER,
        is_fwhm_known: known_fwhm_px.is_some(),
        profile: None,
        largest_fwhm: None,
        known_disc2: None,
        sky_in_px: p.sky_in_fwhm * fwhm_px,
        sky_out_px: p.sky_out_fwhm * fwhm_px,
        clip_sigma: p.clip_sigma,
        shape: t.shape,
        contam_frac: night.config.vetting.contam_caution_frac,
        trail_direction: None,
        trail_length_px: None,
        bound_px: None,
    }
}

/// The same of a frame of a calibrated night, with the direction and the length of its star trails.
#[must_use]
pub fn settings_of_frame(geometry: Option<&Geometry>, exposure: &Exposure, night: &Calibrated) -> TargetSettings {
    TargetSettings {
        trail_direction: trail_direction(geometry, exposure, night),
        trail_length_px: geometry.map(|g| trail_length_px(g, exposure, night)),
        profile: night.seeing.profile,
        fwhm_err_frac: night.seeing.fwhm_err_frac(exposure.exptime_s),
        ..target_settings(exposure, night, night.seeing.fwhm_arcsec(geometry.and_then(|g| g.airmass)))
    }
}

/// Length of the star trails: as far as the target moves among the stars.
fn trail_length_px(geometry: &Geometry, exposure: &Exposure, night: &Prepared) -> f64 {
    (geometry.rate_rad_s * exposure.exptime_s).to_degrees() * 3600.0 / night.scale_arcsec(exposure)
}

/// Direction of the star trails, if the star frames show how the camera is turned.
fn trail_direction(geometry: Option<&Geometry>, exposure: &Exposure, night: &Calibrated) -> Option<KnownDirection> {
    night.seeing.camera_turn?.trails(geometry?, &night.site, exposure.time.as_ref()?.err_s)
}

/// Largest size of the satellite by its model and range \[FWHM\]: as long as three times the diameter of a disc of all its surfaces.
fn largest_fwhm(geometry: Option<&Geometry>, exposure: &Exposure, night: &Calibrated, fwhm_px: f64) -> Option<f64> {
    let area_m2 = night.satellite_area_m2?;
    let longest_m = LONGEST_OF_AREA * 2.0 * (area_m2 / std::f64::consts::PI).sqrt();
    let angle_arcsec = (longest_m / (geometry?.range_km * 1e3)).to_degrees() * 3600.0;
    Some(angle_arcsec / (night.scale_arcsec(exposure) * fwhm_px))
}

/// Finds and measures the target.
fn measure_target(
    geometry: Option<&Geometry>,
    exposure: &Exposure,
    region: Option<&Region>,
    night: &Calibrated,
) -> Result<Measurement> {
    let t = &night.config.target;
    let (nx, ny) = exposure.size_px;
    for (key, at, n) in [("target.x_px", t.x_px, nx), ("target.y_px", t.y_px, ny)] {
        if let Some(at) = at.filter(|at| *at < -0.5 || *at > n as f64 - 0.5) {
            return Err(Error::Config {
                key: key.into(),
                problem: format!("{at} is outside this frame of {nx} x {ny} px"),
            });
        }
    }
    let mut settings = settings_of_frame(geometry, exposure, night);
    settings.largest_fwhm = largest_fwhm(geometry, exposure, night, settings.fwhm_px);
    let reader = night.open(exposure)?;
    let seen = measure_in_window(&reader, night, &settings, region)?;
    let setting = Setting {
        night,
        gain: reader.gain(),
        exptime_s: exposure.exptime_s,
        scale_arcsec: night.scale_arcsec(exposure),
        aperture_fwhm_px: settings.fwhm_px,
        fwhm_px: known_fwhm_px(exposure, night, night.seeing.fwhm_arcsec(geometry.and_then(|g| g.airmass))),
        search_radius_px: seen.search_radius_px,
        sky_corner_ratio: seen.corner_ratio,
    };
    Ok(setting.measurement(seen.found))
}

/// A part of a night without which columns stay empty; as text, which ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Missing {
    /// No flat and no master flat.
    Flats,
    /// No `[orbit]`.
    Orbit,
    /// No zeropoint, neither of this night nor of another.
    Zeropoint,
    /// No `[model]`.
    Model,
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Missing::Flats => {
                "no flats: frames are not flattened, every row carries the flag no_flat, and v_mag_err_sys holds the \
                 vignetting of zeropoint.no_flat_err_mag"
            }
            Missing::Orbit => {
                "no [orbit]: norad_cat_id, object_id, alt_deg, az_deg, range_km, rate_deg_s, alt_az_err_deg, airmass, \
                 phase_angle_deg, sun_alt_deg, moon_*, tle_age_d, v_mag and all model columns are empty"
            }
            Missing::Zeropoint => "no zeropoint: v_mag, v_mag_err_sys, limit_v_mag, mu_* and residual_mag are empty",
            Missing::Model => {
                "no [model]: model_v_mag, sun_v_mag, earthshine_v_mag, moon_v_mag, lunar_earthshine_v_mag, \
                 model_err_mag, residual_mag and illum are empty"
            }
        })
    }
}

/// What a night goes without that has, or has not, a master flat and a zeropoint.
#[must_use]
pub fn missing_parts(night: &Prepared, has_flat: bool, has_zeropoint: bool) -> Vec<Missing> {
    [
        (Missing::Flats, !has_flat),
        (Missing::Orbit, night.tracker.is_none()),
        (Missing::Zeropoint, !has_zeropoint),
        (Missing::Model, night.config.model.is_none()),
    ]
    .into_iter()
    .filter_map(|(part, missing)| missing.then_some(part))
    .collect()
}
