//! One target frame, from disk to a row of the light curve. Nothing here stops the night: a failed frame is a row.

use crate::config::Config;
use crate::constants::MAG_PER_LN;
use crate::error::{Error, Result};
use crate::frames::Exposure;
use crate::night::bench::{Bench, sha256_16};
use crate::night::clock::{iso_utc, mjd_utc};
use crate::orbit::Geometry;
use crate::photometry::Flags;
use crate::photometry::aperture::Shape;
use crate::photometry::background::background;
use crate::photometry::flux::Flux;
use crate::photometry::target::{TargetFound, TargetSettings, measure_target};
use crate::report::PhotometryRow;

/// FWHM taken when neither star pointings nor the configuration give one \[arcsec\].
pub const ASSUMED_FWHM_ARCSEC: f64 = 2.5;
/// Elements older than this are flagged \[d\] (arcminutes of error are normal beyond it).
const OLD_ELEMENTS_D: f64 = 2.0;
/// A mid-time this uncertain is flagged \[s\]: the ISS moves a degree in it.
const TIME_UNCERTAIN_S: f64 = 1.0;

/// The row of a frame of which nothing is known but its name and what went wrong.
#[must_use]
pub fn failed_row(frame: &str, reason: &Error) -> PhotometryRow {
    PhotometryRow {
        frame: frame.into(),
        status: "failed".into(),
        verdict: "reject".into(),
        reason: reason.to_string(),
        ..PhotometryRow::default()
    }
}

/// Measures the target in one frame, with the geometry of its moment.
#[must_use]
pub fn measure_frame(exposure: &Exposure, bench: &Bench) -> (PhotometryRow, Option<Geometry>) {
    let mut row = header_columns(exposure, bench);
    let geometry = match geometry_columns(&mut row, exposure, bench) {
        Ok(geometry) => geometry,
        Err(error) => {
            row.status = "rejected".into();
            row.verdict = "reject".into();
            row.reason = error.to_string();
            return (row, None);
        }
    };
    // a damaged file must cost one row even where a library panics on it
    let measured =
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| measure_columns(&mut row, exposure, bench)));
    let result = measured.unwrap_or_else(|_| {
        Err(Error::Fits { path: exposure.path.clone(), problem: "internal error while reading this frame".into() })
    });
    if let Err(error) = result {
        row.status = "failed".into();
        row.reason = error.to_string();
    } else {
        calibrate(&mut row, bench);
    }
    let (verdict, because) = verdict(&row);
    row.verdict = verdict.into();
    if row.reason.is_empty() && because != Flags::default() {
        row.reason = format!("flags {because}");
    }
    (row, geometry)
}

/// Identity, time and optics, from the header alone.
fn header_columns(exposure: &Exposure, bench: &Bench) -> PhotometryRow {
    let mut row = PhotometryRow {
        frame: exposure.name.clone(),
        frame_sha256: sha256_16(&exposure.path).unwrap_or_default(),
        object_name: exposure.object.clone().unwrap_or_default(),
        exptime_s: Some(exposure.exptime_s),
        filter: exposure.filter.clone().unwrap_or_default(),
        gain_setting: exposure.setting.map(|g| g.0),
        pix_scale_arcsec: Some(bench.scale_arcsec(exposure)),
        ..PhotometryRow::default()
    };
    if let Some(time) = &exposure.time {
        row.date_mid = iso_utc(time.mid, 6);
        row.mjd_mid_d = Some(mjd_utc(time.mid));
        row.time_source = time.source.clone();
        row.time_err_s = Some(time.err_s);
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
pub fn geometry_columns(row: &mut PhotometryRow, exposure: &Exposure, bench: &Bench) -> Result<Option<Geometry>> {
    let (Some(tracker), Some(time)) = (&bench.tracker, &exposure.time) else { return Ok(None) };
    let elements = tracker.elements_at(&time.mid)?;
    row.norad_cat_id = i64::try_from(elements.norad_cat_id()).ok();
    row.object_id = elements.object_id().to_string();
    row.object_name = elements.name().to_string();
    let g = tracker.at(&time.mid)?;
    fill_geometry(row, &g);
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

/// The geometry columns.
pub fn fill_geometry(row: &mut PhotometryRow, g: &Geometry) {
    row.alt_deg = Some(g.alt_rad.to_degrees());
    row.az_deg = Some(g.az_rad.to_degrees());
    row.range_km = Some(g.range_km);
    row.rate_deg_s = Some(g.rate_rad_s.to_degrees());
    row.airmass = g.airmass;
    row.phase_angle_deg = Some(g.phase_angle_rad.to_degrees());
    row.sun_alt_deg = Some(g.sun_alt_rad.to_degrees());
    row.moon_alt_deg = Some(g.moon_alt_rad.to_degrees());
    row.moon_phase_deg = Some(g.moon_phase_rad.to_degrees());
    row.moon_illum_pct = Some(100.0 * g.moon_illum_frac);
    row.moon_sep_deg = Some(g.moon_sep_rad.to_degrees());
    row.tle_age_d = Some(g.tle_age_d);
    if g.tle_age_d.abs() > OLD_ELEMENTS_D {
        row.flags |= Flags::OLD_ELEMENTS.0;
    }
}

/// Finds and measures the target.
fn measure_columns(row: &mut PhotometryRow, exposure: &Exposure, bench: &Bench) -> Result<()> {
    let p = &bench.config.photometry;
    let t = &bench.config.target;
    let scale_arcsec = bench.scale_arcsec(exposure);
    let fwhm_px =
        p.fwhm_px.or(bench.fwhm_arcsec.map(|f| f / scale_arcsec)).unwrap_or(ASSUMED_FWHM_ARCSEC / scale_arcsec);
    let frame = bench.reduce(exposure)?;
    row.e_per_adu = Some(frame.gain.e_per_adu.0);
    row.e_per_adu_source = frame.gain.source.clone();
    row.read_noise_e = Some(frame.gain.read_noise_e);
    row.fwhm_px = p.fwhm_px.or(bench.fwhm_arcsec.map(|f| f / scale_arcsec));
    if bench.flat.is_none() {
        row.flags |= Flags::NO_FLAT.0;
    }
    let sky = background(&frame, p.mesh_px, p.clip_sigma)?;
    let (nx, ny) = exposure.size_px;
    for (key, at, n) in [("target.x_px", t.x_px, nx), ("target.y_px", t.y_px, ny)] {
        if let Some(at) = at.filter(|at| *at < -0.5 || *at > n as f64 - 0.5) {
            return Err(Error::Config {
                key: key.into(),
                problem: format!("{at} is outside this frame of {nx} x {ny} px"),
            });
        }
    }
    let settings = TargetSettings {
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
    };
    let well_e = (frame.gain.saturation_adu - frame.gain.pedestal_adu) * frame.gain.e_per_adu.0;
    match measure_target(&frame, &sky, &settings) {
        TargetFound::Detected { flux, x_px, y_px, .. } => {
            row.x_px = Some(x_px);
            row.y_px = Some(y_px);
            flux_columns(row, &flux, well_e);
            if flux.snr >= t.detect_sigma {
                row.inst_mag = Some(-2.5 * (flux.flux_e / exposure.exptime_s).log10());
                row.v_mag_err = Some(MAG_PER_LN * flux.flux_err_e / flux.flux_e);
                row.status = "ok".into();
            } else {
                // a bright spot, but the whole object does not stand out: among star trails that is no detection
                row.status = "nondetection".into();
                row.reason = format!(
                    "S/N {:.1} of the whole object is below {} (target.detect_sigma)",
                    flux.snr, t.detect_sigma
                );
                row.limit_v_mag = inst_limit(t.detect_sigma * flux.flux_err_e, exposure.exptime_s);
            }
        }
        TargetFound::NotDetected { limit_e, x_px, y_px, flux } => {
            flux_columns(row, &flux, well_e);
            row.x_px = Some(x_px);
            row.y_px = Some(y_px);
            row.status = "nondetection".into();
            row.reason = format!("nothing above {} sigma near ({x_px:.0}, {y_px:.0})", t.detect_sigma);
            row.limit_v_mag = inst_limit(limit_e, exposure.exptime_s);
        }
    }
    Ok(())
}

/// A limit as an instrumental magnitude, for `calibrate` to turn into V.
fn inst_limit(limit_e: f64, exptime_s: f64) -> Option<f64> {
    (limit_e > 0.0 && limit_e.is_finite()).then(|| -2.5 * (limit_e / exptime_s).log10())
}

fn flux_columns(row: &mut PhotometryRow, flux: &Flux, well_e: f64) {
    let finite = |v: f64| v.is_finite().then_some(v);
    row.aper_shape = flux.shape.name().into();
    match flux.shape {
        Shape::Circle { r_px } => row.aper_r_px = Some(r_px),
        Shape::Ellipse { a_px, b_px, theta_rad } => {
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
    row.peak_frac_sat = finite(flux.peak_e / well_e);
    row.flags |= flux.flags.0;
}

/// Instrumental to calibrated magnitudes, V = V_inst − ZP − k X − C (B−V).
///
/// The systematic error joins the zeropoint's propagated covariance at this airmass and colour, the colour of the
/// target and the gain table; the random error is the flux's own.
pub fn calibrate(row: &mut PhotometryRow, bench: &Bench) {
    let inst_limit = row.limit_v_mag.take();
    let z = &bench.config.zeropoint;
    let (Some(zeropoint), Some(airmass)) = (&bench.zeropoint, row.airmass) else {
        if row.status == "ok" || row.status == "nondetection" {
            let missing = if bench.zeropoint.is_none() { "no zeropoint" } else { "no airmass" };
            row.reason = join(&row.reason, &format!("{missing}: v_mag left empty"));
        }
        return;
    };
    let gain_err = if row.e_per_adu_source.contains("header") { 0.0 } else { bench.detector.gain_table_err_mag() };
    let fit_err = zeropoint.err_mag(airmass, z.target_b_v_mag, z.target_b_v_err_mag);
    row.v_mag = row.inst_mag.map(|m| zeropoint.v_mag(m, airmass, z.target_b_v_mag));
    row.limit_v_mag = inst_limit.map(|m| zeropoint.v_mag(m, airmass, z.target_b_v_mag));
    row.v_mag_err_sys = (row.v_mag.is_some() || row.limit_v_mag.is_some()).then(|| fit_err.hypot(gain_err));
}

fn join(a: &str, b: &str) -> String {
    if a.is_empty() { b.into() } else { format!("{a}; {b}") }
}

/// use, caution or reject, from status and flags; and the flags that decided.
fn verdict(row: &PhotometryRow) -> (&'static str, Flags) {
    let flags = Flags(row.flags);
    let reject = Flags(Flags::SATURATED.0 | Flags::EDGE.0);
    let caution = Flags(
        Flags::MASKED.0
            | Flags::CLIP_EDGE.0
            | Flags::NO_ANNULUS.0
            | Flags::TIME_UNCERTAIN.0
            | Flags::NEGATIVE.0
            | Flags::OLD_ELEMENTS.0,
    );
    match row.status.as_str() {
        "failed" | "rejected" => ("reject", Flags::default()),
        _ if flags.any(reject) => ("reject", Flags(flags.0 & (reject.0 | caution.0))),
        _ if flags.any(caution) => ("caution", Flags(flags.0 & caution.0)),
        _ => ("use", Flags::default()),
    }
}

/// Columns that stay empty in this night, and why.
#[must_use]
pub fn empty_columns(config: &Config, bench: &Bench) -> Vec<String> {
    let mut notes = Vec::new();
    if bench.flat.is_none() {
        notes.push("no flats: frames are not flattened, every row carries the flag no_flat".into());
    }
    if bench.tracker.is_none() {
        notes.push(
            "no [orbit]: norad_cat_id, object_id, alt_deg, az_deg, range_km, rate_deg_s, airmass, phase_angle_deg, \
             sun_alt_deg, moon_*, tle_age_d, v_mag and all model columns are empty"
                .into(),
        );
    }
    if bench.zeropoint.is_none() {
        notes.push("no zeropoint: v_mag, v_mag_err_sys, limit_v_mag and residual_mag are empty".into());
    }
    if config.model.is_none() {
        notes.push(
            "no [model]: model_v_mag, sun_v_mag, earthshine_v_mag, moon_v_mag, lunar_earthshine_v_mag, model_err_mag, \
             residual_mag and illum are empty"
                .into(),
        );
    }
    notes.push("not measured yet: mu_mean_mag_arcsec2, mu_peak_mag_arcsec2, starlight_v_mag are empty".into());
    notes
}
