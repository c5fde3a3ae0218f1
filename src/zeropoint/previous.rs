//! The zeropoint of another night: under which conditions it holds, and what they change.

use std::path::Path;

use crate::base::error::Result;
use crate::config::{self, Config};
use crate::tables::PhotometryRow;
use crate::zeropoint::fit::Zeropoint;

/// A frame this close to the mean time of the zeropoint's stars is of their night \[d\].
const SAME_NIGHT_D: f64 = 0.6;

/// The error added by the zeropoint of another night.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherNight {
    /// Frame time minus mean time of the stars \[d\]; `None` if either is unknown.
    pub age_d: Option<f64>,
    /// Added in quadrature to the systematic error \[mag\]: how much photometric nights differ.
    pub extra_err_mag: f64,
}

/// The error added to a frame by using `zeropoint`; `None` if it was fitted in this night, or comes from a file but is
/// of the frame's night all the same.
#[must_use]
pub fn other_night(zeropoint: &Zeropoint, mjd_mid_d: Option<f64>, config: &config::Zeropoint) -> Option<OtherNight> {
    config.previous.as_ref()?;
    let age_d = mjd_mid_d.zip(zeropoint.mjd_mean_d).map(|(frame, stars)| frame - stars);
    let same = age_d.is_some_and(|age| age.abs() < SAME_NIGHT_D);
    (!same).then_some(OtherNight { age_d, extra_err_mag: config.previous_err_mag })
}

/// The note on frames that were calibrated with another night's zeropoint: its age and the error added.
#[must_use]
pub fn age_note<'a>(rows: impl Iterator<Item = &'a PhotometryRow>) -> Option<String> {
    let others: Vec<(Option<f64>, f64)> = rows.filter_map(|r| Some((r.zp_age_d, r.zp_extra_err_mag?))).collect();
    let extra_mag = others.first()?.1;
    let ages = others.iter().filter_map(|(age, _)| *age);
    let (lo, hi) = ages.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), a| (lo.min(a), hi.max(a)));
    let unknown = others.iter().filter(|(age, _)| age.is_none()).count();
    let age = match (unknown, lo <= hi) {
        (0, _) => format!("{lo:.1} to {hi:.1} d before the frames"),
        (_, false) => "of unknown age (no mjd_mean_d in it, or no time in the frames)".to_owned(),
        (n, true) => format!("{lo:.1} to {hi:.1} d before the frames, unknown for {n} of them"),
    };
    Some(format!(
        "zeropoint of another night, {age}: {extra_mag} mag (zeropoint.previous_err_mag) added to v_mag_err_sys of {} frames",
        others.len()
    ))
}

/// Under which conditions a zeropoint holds: another aperture, clip circle (the flat is 1 inside it), camera or flat
/// moves it. Kept as a note in zeropoint.toml.
#[must_use]
pub fn conditions(config: &Config, flattened: bool) -> String {
    let clip = config.photometry.clip_radius_px.map_or("none".into(), |r| format!("{r} px"));
    format!(
        "{CONDITIONS} aperture {} FWHM, {}, clip radius {clip}, camera {}, {}",
        config.photometry.aper_r_fwhm,
        if config.photometry.aper_correction { "corrected to the whole light" } else { "light inside it" },
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
