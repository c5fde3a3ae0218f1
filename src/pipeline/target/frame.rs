//! One target frame, from disk to a row of the light curve. Nothing here stops the night: a failed frame is a row.

use super::outcome::TargetFrame;
use crate::brightness::columns::fill_geometry;
use std::fmt;
use std::path::Path;

use crate::base::constants::MAG_PER_LN;
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::base::time::{iso_utc, mjd_utc};
use crate::frames::Exposure;
use crate::orbit::Geometry;
use crate::photometry::Flags;
use crate::photometry::aperture::Shape;
use crate::photometry::flux::{Flux, detectable_e};
use crate::photometry::surface_brightness::inst_mu;
use crate::photometry::target::measure::KnownDirection;
use crate::photometry::target::measure::LIMIT_MARGIN_SIGMA;
use crate::photometry::target::measure::Light;
use crate::photometry::target::measure::TargetFound;
use crate::photometry::target::settings::TargetSettings;
use crate::pipeline::prepared::{Calibrated, Prepared};
use crate::pipeline::target::window::look;
use crate::pipeline::vet::{judge, without_magnitude};
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};
use crate::zeropoint::previous::other_night;

/// FWHM taken when neither star pointings nor the configuration give one \[arcsec\].
pub const ASSUMED_FWHM_ARCSEC: f64 = 2.5;
/// A mid-time this uncertain is flagged \[s\]: the ISS moves a degree in it.
const TIME_UNCERTAIN_S: f64 = 1.0;

/// The row of a frame that could not be reduced: its identity and what went wrong.
#[must_use]
pub fn failed_row(exposure: &Exposure, reason: &Error) -> PhotometryRow {
    failed_file_row(&exposure.path, reason)
}

/// The row of a file of which nothing is known but its name and what went wrong.
#[must_use]
pub fn failed_file_row(path: &Path, reason: &Error) -> PhotometryRow {
    PhotometryRow {
        frame: file_name(path),
        status: Status::Failed.into(),
        verdict: Verdict::Reject.into(),
        reason: without_folder(reason, path),
        ..PhotometryRow::default()
    }
}

/// The row of a frame that was set aside: it does not belong to the others of the night.
#[must_use]
pub fn set_aside_row(path: &Path, reason: &str) -> PhotometryRow {
    PhotometryRow {
        frame: file_name(path),
        status: Status::Rejected.into(),
        verdict: Verdict::Reject.into(),
        reason: reason.into(),
        ..PhotometryRow::default()
    }
}

/// An error in words, its file by its name: where the night lies on this machine is nothing of a result's.
fn without_folder(error: &Error, path: &Path) -> String {
    let mut text = error.to_string().replace(&*path.to_string_lossy(), &file_name(path));
    if let Error::Catalogue { path, .. } = error {
        text = text.replace(&*path.to_string_lossy(), &file_name(path));
    }
    text
}

/// Measures the target in one frame, with the geometry of its moment; leaves out the hash of the file, for which all of
/// it must be read.
#[must_use]
pub fn measure_frame(exposure: &Exposure, night: &Calibrated) -> TargetFrame {
    let mut row = row_of_header(exposure, night);
    let geometry = match geometry_columns(&mut row, exposure, night) {
        Ok(geometry) => geometry,
        Err(error) => {
            row.status = Status::Rejected.into();
            row.verdict = Verdict::Reject.into();
            row.reason = without_folder(&error, &exposure.path);
            return TargetFrame { row, geometry: None, thumb: None };
        }
    };
    // a damaged file must cost one row even where a library panics on it
    let measured = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        measure_columns(&mut row, geometry.as_ref(), exposure, night)
    }));
    if let Err(error) = measured.unwrap_or_else(|_| Err(internal(exposure))) {
        row.status = Status::Failed.into();
        row.reason = without_folder(&error, &exposure.path);
    } else {
        calibrate(&mut row, night);
    }
    judge(&mut row, &night.config.vetting);
    without_magnitude(&mut row);
    TargetFrame { row, geometry, thumb: None }
}

/// What is told of a frame on which the program itself failed.
#[must_use]
pub fn internal(exposure: &Exposure) -> Error {
    Error::Fits { path: exposure.path.clone(), problem: "internal error while reading this frame".into() }
}

/// Identity, time and optics, from the header alone.
#[must_use]
pub fn row_of_header(exposure: &Exposure, night: &Prepared) -> PhotometryRow {
    let mut row = PhotometryRow {
        frame: exposure.name.clone(),
        object_name: exposure.object.clone().unwrap_or_default(),
        exptime_s: Some(exposure.exptime_s),
        filter: exposure.filter.clone().unwrap_or_default(),
        gain_setting: exposure.setting.map(|g| g.0),
        pix_scale_arcsec: Some(night.scale_arcsec(exposure)),
        ..PhotometryRow::default()
    };
    if let Some(time) = &exposure.time {
        row.date_mid = iso_utc(time.mid, 6);
        row.mjd_mid_d = Some(mjd_utc(time.mid));
        row.time_source = time.source.clone();
        row.time_stamp = time.stamp.into();
        row.time_err_s = Some(time.err_s);
        row.date_avg_minus_mid_s = time.avg_minus_mid_s;
        if time.err_s >= TIME_UNCERTAIN_S {
            row.flags |= Flags::TIME_UNCERTAIN.0;
        }
    }
    row
}

/// Where the satellite stood at mid-exposure.
///
/// # Errors
/// Elements refused, or the satellite below the horizon: then this frame cannot show it.
pub fn geometry_columns(row: &mut PhotometryRow, exposure: &Exposure, night: &Prepared) -> Result<Option<Geometry>> {
    let (Some(tracker), Some(time)) = (&night.tracker, &exposure.time) else { return Ok(None) };
    let elements = tracker.elements_at(&time.mid)?;
    row.norad_cat_id = i64::try_from(elements.norad_cat_id()).ok();
    row.object_id = elements.object_id().to_string();
    row.object_name = elements.name().to_string();
    let g = tracker.at(&time.mid)?;
    fill_geometry(row, &g);
    // σ = ω σ_t, on the sky along the track
    row.alt_az_err_deg = row.time_err_s.map(|err_s| g.rate_rad_s.to_degrees() * err_s);
    if g.alt_rad <= 0.0 {
        return Err(Error::Orbit {
            problem: format!(
                "{} was {:.1} deg below the horizon at {}; check the clock, the site and the elements",
                row.object_name,
                -g.alt_rad.to_degrees(),
                row.date_mid
            ),
        });
    }
    Ok(Some(g))
}

/// FWHM of the stars of this frame \[px\], if the configuration or the star pointings tell.
fn known_fwhm_px(exposure: &Exposure, night: &Prepared, fwhm_arcsec: Option<f64>) -> Option<f64> {
    night.config.photometry.fwhm_px.or(fwhm_arcsec.map(|f| f / night.scale_arcsec(exposure)))
}

/// Where and how the target is looked for in one frame.
#[must_use]
pub fn target_settings(exposure: &Exposure, night: &Prepared, fwhm_arcsec: Option<f64>) -> TargetSettings {
    let (p, t) = (&night.config.photometry, &night.config.target);
    let scale_arcsec = night.scale_arcsec(exposure);
    let fwhm_px = known_fwhm_px(exposure, night, fwhm_arcsec).unwrap_or(ASSUMED_FWHM_ARCSEC / scale_arcsec);
    let (nx, ny) = exposure.size_px;
    TargetSettings {
        x_px: t.x_px.unwrap_or((nx as f64 - 1.0) / 2.0),
        y_px: t.y_px.unwrap_or((ny as f64 - 1.0) / 2.0),
        search_radius_px: t.search_radius_arcsec / scale_arcsec,
        detect_sigma: t.detect_sigma,
        margin_px: t.margin_fwhm * fwhm_px,
        limit_r_px: t.limit_r_fwhm * fwhm_px,
        fwhm_px,
        sky_in_px: p.sky_in_fwhm * fwhm_px,
        sky_out_px: p.sky_out_fwhm * fwhm_px,
        clip_sigma: p.clip_sigma,
        shape: t.shape,
        contam_frac: night.config.vetting.contam_caution_frac,
        trail_direction: None,
    }
}

/// Direction of the star trails, where the star frames tell how the camera is turned.
fn trail_direction(geometry: Option<&Geometry>, exposure: &Exposure, night: &Calibrated) -> Option<KnownDirection> {
    night.seeing.camera_turn?.trails(geometry?, &night.site, exposure.time.as_ref()?.err_s)
}

/// Finds and measures the target.
fn measure_columns(
    row: &mut PhotometryRow,
    geometry: Option<&Geometry>,
    exposure: &Exposure,
    night: &Calibrated,
) -> Result<()> {
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
    let scale_arcsec = night.scale_arcsec(exposure);
    let mut settings = target_settings(exposure, night, night.seeing.fwhm_arcsec);
    settings.trail_direction = trail_direction(geometry, exposure, night);
    let fwhm_px = settings.fwhm_px;
    let reader = night.open(exposure)?;
    let seen = look(&reader, night, &settings)?;
    let gain = reader.gain();
    row.e_per_adu = Some(gain.e_per_adu.0);
    row.e_per_adu_source = gain.source.clone();
    row.read_noise_e = Some(gain.read_noise_e);
    row.fwhm_px = known_fwhm_px(exposure, night, night.seeing.fwhm_arcsec);
    if night.flat.is_none() {
        row.flags |= Flags::NO_FLAT.0;
    }
    row.sky_corner_ratio = seen.corner_ratio;
    let well_e = (gain.saturation_adu - gain.pedestal_adu) * gain.e_per_adu.0;
    match seen.found {
        TargetFound::Detected { flux, x_px, y_px, light, along_trails, unseen } => {
            row.x_px = Some(x_px);
            row.y_px = Some(y_px);
            flux_columns(row, &flux, well_e);
            let corr_mag = aperture_correction(row, night, fwhm_px, &flux, light.source, along_trails);
            light_columns(row, &flux, &light, fwhm_px, (exposure.exptime_s, scale_arcsec));
            if flux.snr >= t.detect_sigma {
                let inst_mag = -2.5 * (flux.flux_e / exposure.exptime_s).log10() + corr_mag;
                row.inst_mag = Some(inst_mag).filter(|m| m.is_finite());
                row.v_mag_err = Some(MAG_PER_LN * flux.flux_err_e / flux.flux_e);
                row.status = Status::Ok.into();
                let limit_e = detectable_e(flux.flux_e, flux.flux_err_e, t.detect_sigma + LIMIT_MARGIN_SIGMA);
                row.limit_v_mag = inst_limit(limit_e, exposure.exptime_s, corr_mag);
            } else {
                // a bright spot, but the whole object does not stand out: among star trails that is no detection
                row.status = Status::Nondetection.into();
                row.reason = format!(
                    "S/N {:.1} of the whole object is below {} (target.detect_sigma)",
                    flux.snr, t.detect_sigma
                );
                if let Some(unseen) = unseen {
                    forced_columns(row, &unseen.flux);
                    let corr_mag = point_correction(night, fwhm_px, &unseen.flux);
                    limit_column(row, unseen.limit_e, exposure.exptime_s, corr_mag);
                }
            }
        }
        TargetFound::NotDetected { limit_e, x_px, y_px, flux } => {
            flux_columns(row, &flux, well_e);
            forced_columns(row, &flux);
            row.x_px = Some(x_px);
            row.y_px = Some(y_px);
            row.status = Status::Nondetection.into();
            row.reason = format!("nothing above {} sigma near ({x_px:.0}, {y_px:.0})", t.detect_sigma);
            let corr_mag = aperture_correction(row, night, fwhm_px, &flux, None, false);
            limit_column(row, limit_e, exposure.exptime_s, corr_mag);
        }
    }
    Ok(())
}

/// What the target looks like and what is mixed with it; surface brightness is instrumental until `calibrate`.
fn light_columns(
    row: &mut PhotometryRow,
    flux: &Flux,
    light: &Light,
    fwhm_px: f64,
    (exptime_s, scale_arcsec): (f64, f64),
) {
    row.elongation = Some(light.elongation);
    row.extent_fwhm = light.extent_px.map(|e| e / fwhm_px);
    // a flux below its error is no measure of a share
    row.contam_frac = Some(light.contamination_e / flux.flux_e.max(flux.flux_err_e)).filter(|f| f.is_finite());
    row.mu_mean_mag_arcsec2 = inst_mu(flux.flux_e, exptime_s, flux.area_px, scale_arcsec);
    row.mu_peak_mag_arcsec2 = light.peak_disc_e_px.and_then(|e| inst_mu(e, exptime_s, 1.0, scale_arcsec));
}

/// A limit as an instrumental magnitude, for `calibrate` to turn into V.
fn inst_limit(limit_e: f64, exptime_s: f64, corr_mag: f64) -> Option<f64> {
    let limit = || -2.5 * (limit_e / exptime_s).log10() + corr_mag;
    (limit_e > 0.0).then(limit).filter(|m| m.is_finite())
}

/// The limit of a frame without a detection, or why there is none.
fn limit_column(row: &mut PhotometryRow, limit_e: f64, exptime_s: f64, corr_mag: f64) {
    row.limit_v_mag = inst_limit(limit_e, exptime_s, corr_mag);
    if limit_e.is_nan() {
        let why = "no limit: in more than 5 % of the search region no point source would be detected, however bright";
        row.reason = join(&row.reason, why);
    }
}

/// The flux forced at the expected place, beside the limit of a frame without a detection.
fn forced_columns(row: &mut PhotometryRow, flux: &Flux) {
    let finite = |v: f64| v.is_finite().then_some(v);
    (row.forced_flux_e, row.forced_flux_err_e) = (finite(flux.flux_e), finite(flux.flux_err_e));
}

/// What carries a point source in the aperture of a limit to its whole light \[mag\]; 0 without a profile of the stars.
fn point_correction(night: &Calibrated, fwhm_px: f64, flux: &Flux) -> f64 {
    let profile = night.seeing.profile.filter(|_| night.config.photometry.aper_correction);
    let correction = profile.map(|p| p.correction_mag(fwhm_px, flux.shape, (flux.sky_in_px, flux.sky_out_px), None));
    correction.filter(|c| c.is_finite()).unwrap_or(0.0)
}

/// What carries the target to its whole light, as the stars of the zeropoint are \[mag\]; 0 without a profile of the stars,
/// NaN, with a reason, where the profile gives none for this aperture.
///
/// A level measured along trails has none of the target's light in it: then there is no annulus to correct for. The
/// error of the correction is left in `v_mag_err_sys` for `calibrate`.
fn aperture_correction(
    row: &mut PhotometryRow,
    night: &Calibrated,
    fwhm_px: f64,
    flux: &Flux,
    source: Option<Shape>,
    along_trails: bool,
) -> f64 {
    let Some(profile) = night.seeing.profile.filter(|_| night.config.photometry.aper_correction) else { return 0.0 };
    let sky = if along_trails { (0.0, 0.0) } else { (flux.sky_in_px, flux.sky_out_px) };
    let correction = profile.correction_mag(fwhm_px, flux.shape, sky, source);
    if !correction.is_finite() {
        let why = "no aperture correction: next to nothing of a star's light would fall into this aperture, so there is no \
                   magnitude";
        row.reason = join(&row.reason, why);
        return f64::NAN;
    }
    row.aper_corr_mag = Some(correction);
    row.v_mag_err_sys = Some(profile.correction_err_mag(fwhm_px, flux.shape, sky, source)).filter(|e| e.is_finite());
    correction
}

fn flux_columns(row: &mut PhotometryRow, flux: &Flux, well_e: f64) {
    let finite = |v: f64| v.is_finite().then_some(v);
    row.aper_shape = flux.shape.name().into();
    match flux.shape {
        Shape::Circle { r_px } => row.aper_r_px = Some(r_px),
        Shape::Ellipse { a_px, b_px, theta_rad }
        | Shape::Rectangle { a_px, b_px, theta_rad }
        | Shape::Pill { a_px, b_px, theta_rad } => {
            row.aper_a_px = Some(a_px);
            row.aper_b_px = Some(b_px);
            row.aper_theta_deg = Some(theta_rad.to_degrees());
        }
    }
    row.sky_in_px = finite(flux.sky_in_px);
    row.sky_out_px = finite(flux.sky_out_px);
    row.flux_e = finite(flux.flux_e);
    row.flux_err_e = finite(flux.flux_err_e);
    row.sky_e_px = finite(flux.sky_e_px);
    row.snr = finite(flux.snr);
    // the converter sees the sky too: by day it may fill most of the range
    row.peak_frac_sat = finite((flux.peak_e + flux.sky_e_px) / well_e);
    row.flags |= flux.flags.0;
}

/// Instrumental to calibrated magnitudes, V = V_inst − ZP − k X − C (B−V).
///
/// The systematic error joins the zeropoint's propagated covariance at this airmass and colour, the scatter of one line
/// of sight as the pointings show it, the colour of the target, the gain table, the aperture correction, the vignetting of
/// a frame without flat and, where the zeropoint is of another night, how much nights differ; the random error is the flux's own.
pub fn calibrate(row: &mut PhotometryRow, night: &Calibrated) {
    let inst_limit = row.limit_v_mag.take();
    let correction_err = row.v_mag_err_sys.take().unwrap_or(0.0);
    let inst_mu = [row.mu_mean_mag_arcsec2.take(), row.mu_peak_mag_arcsec2.take()];
    let z = &night.config.zeropoint;
    let other = night.zeropoint.as_ref().and_then(|zeropoint| other_night(zeropoint, row.mjd_mid_d, z));
    if let Some(other) = &other {
        row.flags |= Flags::OTHER_ZEROPOINT.0;
        row.zp_age_d = other.age_d;
        row.zp_extra_err_mag = Some(other.extra_err_mag);
    }
    let (Some(zeropoint), Some(airmass)) = (&night.zeropoint, row.airmass) else {
        if row.status == Status::Ok || row.status == Status::Nondetection {
            let missing = if night.zeropoint.is_none() { "no zeropoint" } else { "no airmass" };
            row.reason = join(&row.reason, &format!("{missing}: v_mag left empty"));
        }
        return;
    };
    let gain_err = night.detector.gain_table_err_mag();
    let fit_err = zeropoint.err_one_pointing_mag(airmass, z.target_b_v_mag, z.target_b_v_err_mag);
    let vignetting_err = if Flags(row.flags).has(Flags::NO_FLAT) { z.no_flat_err_mag } else { 0.0 };
    let night_err = other.map_or(0.0, |other| other.extra_err_mag);
    row.v_mag = row.inst_mag.map(|m| zeropoint.v_mag(m, airmass, z.target_b_v_mag));
    row.limit_v_mag = inst_limit.map(|m| zeropoint.v_mag(m, airmass, z.target_b_v_mag));
    [row.mu_mean_mag_arcsec2, row.mu_peak_mag_arcsec2] =
        inst_mu.map(|mu| mu.map(|m| zeropoint.v_mag(m, airmass, z.target_b_v_mag)));
    let calibrated = row.v_mag.is_some() || row.limit_v_mag.is_some();
    row.v_mag_err_sys =
        calibrated.then(|| fit_err.hypot(gain_err).hypot(night_err).hypot(correction_err).hypot(vignetting_err));
}

fn join(a: &str, b: &str) -> String {
    if a.is_empty() { b.into() } else { format!("{a}; {b}") }
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
