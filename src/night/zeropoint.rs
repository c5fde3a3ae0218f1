//! From star rows to the zeropoint: the cuts of the configuration, each named in its row, then the fit.

use std::path::Path;

use crate::config::{self, Config};
use crate::error::{Error, Result};
use crate::photometry::Flags;
use crate::photometry::zeropoint::{StarMeasurement, Zeropoint, fit};
use crate::report::StarRow;

/// Flags that keep a star out of the fit.
const TAINTED: Flags = Flags(
    Flags::SATURATED.0
        | Flags::MASKED.0
        | Flags::EDGE.0
        | Flags::CLIP_EDGE.0
        | Flags::NEGATIVE.0
        | Flags::NEIGHBOUR.0
        | Flags::NO_ANNULUS.0,
);

/// Why a star does not enter the fit; `None` if it does. A colour is needed unless the colour term is pinned to 0.
#[must_use]
pub fn cut(row: &StarRow, stars: &config::Stars, zeropoint: &config::Zeropoint) -> Option<String> {
    let outside = |value: Option<f64>, [lo, hi]: [f64; 2], name: &str| match value {
        None => Some(format!("no {name}")),
        Some(v) if v < lo || v > hi => Some(format!("{name} {v:.3} outside {lo} to {hi}")),
        Some(_) => None,
    };
    let flags = Flags(row.flags);
    if flags.any(TAINTED) {
        return Some(format!("flags {}", Flags(flags.0 & TAINTED.0)));
    }
    if row.inst_mag.is_none() || row.inst_mag_err.is_none() {
        return Some("no positive flux".into());
    }
    if row.match_arcsec.is_none() {
        return Some(format!("no detection within {} arcsec", stars.match_radius_arcsec));
    }
    if row.snr.is_none_or(|snr| snr < stars.min_snr) {
        return Some(format!("snr below {}", stars.min_snr));
    }
    if row.catalogue_v_mag_err.is_some_and(|e| e > stars.v_err_max_mag) {
        return Some(format!("catalogue error above {} mag", stars.v_err_max_mag));
    }
    let colourless = zeropoint.pin_c.is_some_and(|pin| pin.value == 0.0 && pin.err == 0.0);
    outside(row.catalogue_v_mag, stars.v_range_mag, "V")
        .or_else(|| {
            let unneeded = colourless && row.catalogue_b_v_mag.is_none();
            if unneeded { None } else { outside(row.catalogue_b_v_mag, stars.bv_range_mag, "B-V") }
        })
        .or_else(|| outside(row.airmass, stars.airmass_range, "airmass"))
}

/// Fits the zeropoint to the rows that pass the cuts and writes status, reason, weight and residual into each row.
///
/// # Errors
/// [`Error::Zeropoint`] naming how many stars each cut left.
pub fn fit_rows(rows: &mut [StarRow], config: &Config) -> Result<Zeropoint> {
    let Some(stars) = &config.stars else {
        return Err(Error::Config { key: "stars".into(), problem: "is needed to fit a zeropoint".into() });
    };
    let mut chosen = Vec::new();
    let mut measurements = Vec::new();
    for (k, row) in rows.iter_mut().enumerate() {
        row.fit_weight = None;
        row.fit_residual_mag = None;
        match cut(row, stars, &config.zeropoint) {
            Some(reason) => {
                row.status = "rejected".into();
                row.reason = reason;
            }
            None => {
                row.status = "ok".into();
                row.reason.clear();
                chosen.push(k);
                measurements.push(measurement(row));
            }
        }
    }
    if measurements.len() < config.zeropoint.min_stars {
        return Err(Error::Zeropoint { problem: too_few(rows, measurements.len(), config.zeropoint.min_stars) });
    }
    let zeropoint = fit(&measurements, &config.zeropoint)?;
    for (slot, &k) in chosen.iter().enumerate() {
        let row = &mut rows[k];
        row.fit_weight = Some(zeropoint.weights[slot]).filter(|w| w.is_finite());
        row.fit_residual_mag = Some(zeropoint.residuals_mag[slot]).filter(|r| r.is_finite());
        if zeropoint.weights[slot] == 0.0 {
            row.status = "rejected".into();
            row.reason = "outlier of the fit".into();
        }
    }
    Ok(zeropoint)
}

/// Under which conditions a zeropoint holds: another aperture, clip circle (the flat is 1 inside it), camera or flat
/// moves it. Kept as a note in zeropoint.toml.
#[must_use]
pub fn conditions(config: &Config, flattened: bool) -> String {
    let clip = config.photometry.clip_radius_px.map_or("none".into(), |r| format!("{r} px"));
    format!(
        "{CONDITIONS} aperture {} FWHM, clip radius {clip}, camera {}, {}",
        config.photometry.aper_r_fwhm,
        config.detector.camera,
        if flattened { "flattened" } else { "not flattened" }
    )
}

const CONDITIONS: &str = "conditions:";

/// Reads a zeropoint of another night, with what should be known of it: its own warnings, and conditions that differ.
///
/// # Errors
/// As [`Zeropoint::read`].
pub fn read_previous(path: &Path, config: &Config, flattened: bool) -> Result<(Zeropoint, Vec<String>)> {
    let zeropoint = Zeropoint::read(path)?;
    let now = conditions(config, flattened);
    let mut notes = vec![format!("zeropoint of {}", path.display())];
    for warning in &zeropoint.warnings {
        if !warning.starts_with(CONDITIONS) {
            notes.push(format!("zeropoint: {warning}"));
        } else if *warning != now {
            notes.push(format!("zeropoint made under other {warning}; now {now}: magnitudes may be off"));
        }
    }
    Ok((zeropoint, notes))
}

fn measurement(row: &StarRow) -> StarMeasurement {
    // `cut` has made sure of every value that is needed; an unknown catalogue error counts as 0 and the fit's own
    // scatter estimate takes its place
    StarMeasurement {
        inst_mag: row.inst_mag.unwrap_or(f64::NAN),
        inst_err_mag: row.inst_mag_err.unwrap_or(f64::NAN),
        v_mag: row.catalogue_v_mag.unwrap_or(f64::NAN),
        v_err_mag: row.catalogue_v_mag_err.unwrap_or(0.0),
        b_v_mag: row.catalogue_b_v_mag.unwrap_or(f64::NAN),
        b_v_err_mag: row.catalogue_b_v_mag_err.unwrap_or(0.0),
        airmass: row.airmass.unwrap_or(f64::NAN),
        pointing: row.pointing.unwrap_or(0).max(0) as usize,
    }
}

/// The sentence that says where the stars went.
fn too_few(rows: &[StarRow], kept: usize, need: usize) -> String {
    let mut counts = std::collections::BTreeMap::<String, usize>::new();
    for row in rows.iter().filter(|r| r.status == "rejected") {
        // "V 15.203 outside 10.5 to 15" and "snr below 10" without their numbers
        let words = row.reason.split(|c: char| c.is_ascii_digit()).next().unwrap_or("").trim_end_matches([' ', '-']);
        let kind = words.to_string() + if row.reason.contains("outside") { " out of range" } else { "" };
        *counts.entry(kind).or_default() += 1;
    }
    let lost: Vec<String> = counts.iter().map(|(reason, n)| format!("{n} {reason}")).collect();
    let lost = if lost.is_empty() { String::new() } else { format!(" ({})", lost.join(", ")) };
    format!(
        "{kept} of {} star measurements left by the cuts, need {need}{lost}; take more stars, widen [stars], \
         lower zeropoint.min_stars, or give zeropoint.previous",
        rows.len()
    )
}
