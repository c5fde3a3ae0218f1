//! The row of a frame in `photometry.ecsv`, made here and nowhere else: of a frame that was looked at, and of one that was not.

use std::path::Path;

use super::measurement::CalibratedMeasurement;
use super::outcome::ComparedFrame;
use super::place::pointing_sep_deg;
use super::star_trails::fill_trails;
use crate::base::error::Error;
use crate::base::file::file_name;
use crate::base::time::{iso_utc, mjd_utc};
use crate::brightness::columns::{fill_geometry, fill_model, fill_normalised};
use crate::frames::Exposure;
use crate::photometry::Flags;
use crate::photometry::aperture::Shape;
use crate::photometry::flux::Flux;
use crate::pipeline::prepared::Calibrated;
use crate::pipeline::vet::{judge, without_magnitude};
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};

/// A mid-time this uncertain is flagged \[s\]: the ISS moves a degree in it.
const TIME_UNCERTAIN_S: f64 = 1.0;

/// The row of a frame that was not measured: its name, what became of it and why.
#[must_use]
pub fn unmeasured_row(name: &str, status: Status, reason: String) -> PhotometryRow {
    PhotometryRow {
        frame: name.into(),
        status: status.into(),
        verdict: Verdict::Reject.into(),
        reason,
        ..PhotometryRow::default()
    }
}

/// The row of a frame that could not be reduced: its identity and what went wrong.
#[must_use]
pub fn failed_row(exposure: &Exposure, reason: &Error) -> PhotometryRow {
    failed_file_row(&exposure.path, reason)
}

/// The row of a file of which nothing is known but its name and what went wrong.
#[must_use]
pub fn failed_file_row(path: &Path, reason: &Error) -> PhotometryRow {
    unmeasured_row(&file_name(path), Status::Failed, without_folder(reason, path))
}

/// The row of a frame that was set aside: it does not belong to the others of the night.
#[must_use]
pub fn set_aside_row(path: &Path, reason: &str) -> PhotometryRow {
    unmeasured_row(&file_name(path), Status::Rejected, reason.into())
}

/// The row of a star frame that gave no stars.
#[must_use]
pub fn star_frame_row(exposure: &Exposure, status: Status, reason: String) -> PhotometryRow {
    PhotometryRow {
        object_name: exposure.object.clone().unwrap_or_default(),
        exptime_s: Some(exposure.exptime_s),
        ..unmeasured_row(&file_name(&exposure.path), status, reason)
    }
}

/// The row of a flat that did not enter the master.
#[must_use]
pub fn flat_row(path: &Path, reason: &str) -> PhotometryRow {
    PhotometryRow {
        object_name: "flat".into(),
        ..unmeasured_row(&file_name(path), Status::Rejected, format!("flat: {reason}"))
    }
}

/// An error in words, its file by its name: where the night lies on this machine is nothing of a result's.
#[must_use]
pub fn without_folder(error: &Error, path: &Path) -> String {
    let mut text = error.to_string().replace(&*path.to_string_lossy(), &file_name(path));
    if let Error::Catalogue { path, .. } = error {
        text = text.replace(&*path.to_string_lossy(), &file_name(path));
    }
    text
}

impl ComparedFrame<'_> {
    /// The row of this frame, judged by itself; without the hash of the file, for which all of it must be read.
    #[must_use]
    pub fn row(&self, night: &Calibrated) -> PhotometryRow {
        let mut row = self.header_columns(night);
        if let Some(geometry) = &self.place.geometry {
            fill_geometry(&mut row, geometry);
            row.pointing_sep_deg = pointing_sep_deg(self.exposure, geometry, (&night.site, &night.eop), &night.config);
            // σ = ω σ_t, on the sky along the track
            row.alt_az_err_deg = row.time_err_s.map(|err_s| geometry.rate_rad_s.to_degrees() * err_s);
        }
        match (&self.measured, &self.place.problem) {
            (_, Some(error)) => {
                row.status = Status::Rejected.into();
                row.reason = without_folder(error, &self.exposure.path);
            }
            (Some(Err(error)), None) => {
                row.status = Status::Failed.into();
                row.reason = without_folder(error, &self.exposure.path);
            }
            (Some(Ok(measured)), None) => {
                row = measured_columns(row, measured);
                fill_trails(&mut row, self.trails.as_ref(), measured, night);
                let bias_adu = measured.measured.gain.pedestal_adu;
                // only an overscan gives a frame a bias level of its own
                if bias_adu != night.detector.pedestal_adu() {
                    let by_pedestal = row.zero_level.trim_start_matches("pedestal");
                    row.zero_level = format!("overscan at {bias_adu:.2} ADU{by_pedestal}");
                }
            }
            (None, None) => {}
        }
        match &self.model {
            Some(Ok(model)) => fill_model(&mut row, model, night.model_is_of_band()),
            Some(Err(error)) => row.skipped = error.to_string(),
            None => {}
        }
        fill_normalised(&mut row);
        let judgement = without_magnitude(&row, judge(&row, &night.config.vetting));
        judgement.into_row(row)
    }

    /// Identity, time and optics.
    fn header_columns(&self, night: &Calibrated) -> PhotometryRow {
        let exposure = self.exposure;
        let object = self.place.object.as_ref();
        let time = exposure.time.as_ref();
        let uncertain = time.is_some_and(|t| t.err_s >= TIME_UNCERTAIN_S);
        let name = object.map(|o| o.name.clone()).or_else(|| exposure.object.clone());
        PhotometryRow {
            frame: exposure.name.clone(),
            norad_cat_id: object.and_then(|o| o.norad_cat_id),
            object_id: object.map(|o| o.object_id.clone()).unwrap_or_default(),
            object_name: name.unwrap_or_default(),
            date_mid: time.map(|t| iso_utc(t.mid, 6)).unwrap_or_default(),
            mjd_mid_d: time.map(|t| mjd_utc(t.mid)),
            exptime_s: Some(exposure.exptime_s),
            time_err_s: time.map(|t| t.err_s),
            time_source: time.map(|t| t.source.clone()).unwrap_or_default(),
            time_stamp: time.map(|t| t.stamp.into()).unwrap_or_default(),
            date_avg_minus_mid_s: time.and_then(|t| t.avg_minus_mid_s),
            filter: exposure.filter.clone().unwrap_or_default(),
            gain_setting: exposure.setting.map(|g| g.0),
            zero_level: zero_level(exposure, night),
            pix_scale_arcsec: Some(night.scale_arcsec(exposure)),
            flags: if uncertain { Flags::TIME_UNCERTAIN.0 } else { 0 },
            ..PhotometryRow::default()
        }
    }
}

/// Pixels, flux and magnitudes, with what is known of the frame.
fn measured_columns(row: PhotometryRow, of: &CalibratedMeasurement) -> PhotometryRow {
    let m = &of.measured;
    let finite = |v: f64| v.is_finite().then_some(v);
    let well_e = (m.gain.saturation_adu - m.gain.pedestal_adu) * m.gain.e_per_adu.0;
    let flux: &Flux = &m.flux;
    let (r_px, a_px, b_px, theta_rad) = match flux.shape {
        Shape::Circle { r_px } => (Some(r_px), None, None, None),
        Shape::Ellipse { a_px, b_px, theta_rad }
        | Shape::Rectangle { a_px, b_px, theta_rad }
        | Shape::Pill { a_px, b_px, theta_rad } => (None, Some(a_px), Some(b_px), Some(theta_rad)),
    };
    let no_flat = if m.flattened { Flags::default() } else { Flags::NO_FLAT };
    let other_zeropoint = if of.other_night.is_some() { Flags::OTHER_ZEROPOINT } else { Flags::default() };
    let missing = of.missing.map(|missing| format!("{missing}: v_mag left empty"));
    let forced = m.forced.filter(|f| f.flux_e.is_finite() && f.err_e.is_finite());
    let reasons: Vec<String> = m.reasons.iter().cloned().chain(missing).collect();
    PhotometryRow {
        e_per_adu: Some(m.gain.e_per_adu.0),
        e_per_adu_source: m.gain.source.clone(),
        read_noise_e: Some(m.gain.read_noise_e),
        fwhm_px: m.fwhm_px,
        x_px: Some(m.x_px),
        y_px: Some(m.y_px),
        search_radius_px: finite(m.search_radius_px),
        aper_shape: flux.shape.name().into(),
        aper_r_px: r_px,
        aper_a_px: a_px,
        aper_b_px: b_px,
        aper_theta_deg: theta_rad.map(f64::to_degrees),
        elongation: m.target_shape.map(|l| l.elongation),
        extent_fwhm: m.target_shape.and_then(|l| l.extent_fwhm),
        source_kind: m.size.map(|size| size.kind.name().into()).unwrap_or_default(),
        point_log10_odds: m.size.and_then(|size| finite(size.log10_odds)),
        disc_fwhm2: m.size.and_then(|size| finite(size.disc2)),
        disc_fwhm2_err: m.size.and_then(|size| finite(size.disc2_err)),
        sky_in_px: finite(flux.sky_in_px),
        sky_out_px: finite(flux.sky_out_px),
        flux_e: finite(flux.flux_e),
        flux_err_e: finite(flux.flux_err_e),
        forced_flux_e: forced.map(|f| f.flux_e),
        forced_flux_err_e: forced.map(|f| f.err_e),
        forced_at: forced.map(|f| f.at.into()).unwrap_or_default(),
        forced_x_px: forced.map(|f| f.x_px),
        forced_y_px: forced.map(|f| f.y_px),
        sky_e_px: finite(flux.sky_e_px),
        sky_corner_ratio: m.sky_corner_ratio,
        snr: finite(flux.snr),
        // the converter sees the sky too: by day it may fill most of the range
        peak_frac_sat: finite((flux.peak_e + flux.sky_e_px) / well_e),
        masked_frac: finite(flux.masked_frac),
        contam_frac: m.target_shape.and_then(|l| l.contam_frac),
        aper_corr_mag: m.correction.map(|c| c.mag),
        inst_mag: m.inst.mag,
        v_mag: of.v_mag,
        v_mag_err: m.inst.mag_err,
        v_mag_err_sys: of.v_mag_err_sys,
        zp_age_d: of.other_night.and_then(|other| other.age_d),
        zp_extra_err_mag: of.other_night.map(|other| other.extra_err_mag),
        limit_v_mag: of.limit_v_mag,
        mu_mean_mag_arcsec2: of.mu_mean,
        mu_peak_mag_arcsec2: of.mu_peak,
        status: if m.detected { Status::Ok } else { Status::Nondetection }.into(),
        reason: reasons.join("; "),
        flags: row.flags | flux.flags.0 | no_flat.0 | other_zeropoint.0,
        ..row
    }
}

/// The level without light, and the map of hot pixels, in words.
fn zero_level(exposure: &Exposure, night: &Calibrated) -> String {
    let level = night.zero.of(exposure).map_or("pedestal".into(), |zero| zero.from);
    match night.hot_pixels(exposure) {
        Some(hot) => format!("{level}, hot pixels of {} fields", hot.n_fields),
        None => level,
    }
}
