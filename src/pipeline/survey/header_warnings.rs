//! What is odd about one frame's header and no reason to refuse it: the same words in `satphot inspect` and in a run.
//!
//! Arcsec/px, e⁻/ADU. It does not cover what reading the frame already found ([`Exposure::warnings`]: exposure, time,
//! gain, binning) and what only the whole night shows ([`super::header_checks`], `instrument`).

use crate::config::Config;
use crate::fits::Header;
use crate::frames::header::{CameraCheck, calibration, check_camera, optics, sexagesimal};
use crate::frames::{Detector, Exposure};
use crate::pipeline::survey::scale::nominal_warning;

/// Share by which the header's electrons per ADU may differ from the table's.
const EGAIN_FRAC: f64 = 0.1;

/// Warnings about a header, in words. If `configured` is false, there is no instrument to compare with.
#[must_use]
pub fn header_warnings(exposure: &Exposure, config: &Config, configured: bool) -> Vec<String> {
    let header = &exposure.header;
    let mut warnings = optics(header, &config.header.aliases).warnings;
    if configured {
        warnings.extend(camera_warning(exposure, config));
        warnings.extend(nominal_warning(exposure, config));
    }
    warnings.extend(twins(header));
    warnings.extend(unset_pointings(header));
    let named = calibration(header).others;
    if !named.is_empty() {
        warnings.push(format!("{}: already calibrated? a flat must not be applied twice", named.join(", ")));
    }
    warnings
}

/// The words of electrons per ADU in a header that differ from those used.
#[must_use]
pub fn egain_warning(header_e_per_adu: Option<f64>, used: Option<(f64, &str)>) -> Option<String> {
    let (own, (used, source)) = header_e_per_adu.zip(used)?;
    ((own / used - 1.0).abs() > EGAIN_FRAC)
        .then(|| format!("the header's {own:.4} e-/ADU differ from {used:.4} of {source}"))
}

/// [`egain_warning`] of a frame that a detector's tables know.
pub(crate) fn egain_warning_of(exposure: &Exposure, detector: &Detector) -> Option<String> {
    let gain = detector.gain(exposure).ok()?;
    egain_warning(exposure.header_e_per_adu, Some((gain.e_per_adu.0, &gain.source)))
}

/// A camera that is another one, where that is allowed, or that the header does not name.
fn camera_warning(exposure: &Exposure, config: &Config) -> Option<String> {
    let configured = &config.detector.camera;
    if let Some((keyword, name)) = other_camera(exposure, config) {
        return Some(format!(
            "{keyword} = '{name}' is another camera than detector.camera = \"{configured}\", whose numbers are used"
        ));
    }
    let camera = optics(&exposure.header, &config.header.aliases).camera?;
    (check_camera(&camera.value, configured) == CameraCheck::NoModel).then(|| {
        format!(
            "{} = '{}' cannot be compared with detector.camera = \"{configured}\": one of them names no model",
            camera.source, camera.value
        )
    })
}

/// When a frame was exposed, by its header.
#[derive(Debug, Clone, PartialEq)]
pub struct Stamp {
    /// The frame, in words.
    pub name: String,
    /// Its camera.
    pub camera: Option<String>,
    /// Start of the exposure \[s\], from any origin that all share.
    pub start_s: f64,
    /// Exposure time \[s\].
    pub exptime_s: f64,
    /// Error of the time \[s\].
    pub err_s: f64,
}

/// Exposures that do not fit between their neighbours of the same camera, by their places, with words: an exposure time in
/// another unit, or the first frames after it was changed.
#[must_use]
pub fn cadence_conflicts(stamps: &[Stamp]) -> Vec<(usize, String)> {
    let mut order: Vec<usize> = (0..stamps.len()).collect();
    order.sort_by(|a, b| {
        let (a, b) = (&stamps[*a], &stamps[*b]);
        a.camera.cmp(&b.camera).then(a.start_s.total_cmp(&b.start_s))
    });
    let mut conflicts = Vec::new();
    for pair in order.windows(2) {
        let (a, b) = (&stamps[pair[0]], &stamps[pair[1]]);
        let spacing_s = b.start_s - a.start_s;
        // a copy of the frame before is not an exposure of its own
        let copy = spacing_s.abs() < 1e-3;
        if copy || a.camera != b.camera || spacing_s >= a.exptime_s - a.err_s.hypot(b.err_s) {
            continue;
        }
        let exptime_s = a.exptime_s;
        let milli = if spacing_s > 0.0 && spacing_s >= exptime_s * 1e-3 && exptime_s > 50.0 * spacing_s {
            "; is it in milliseconds?"
        } else {
            "; the first frames after a change may state the new exposure time with old data"
        };
        let words = format!("{exptime_s} s of exposure do not fit: {} began {spacing_s:.2} s later{milli}", b.name);
        conflicts.push((pair[0], words));
    }
    conflicts
}

/// Pointings that are zeros: a place on the sky that no program means.
fn unset_pointings(header: &Header) -> Vec<String> {
    let zero = |key: &str| header.text(key).filter(|t| sexagesimal(t) == Some(0.0));
    let pair =
        |(ra, dec): &(&str, &str)| Some(format!("{ra} = '{}', {dec} = '{}': zeros, unset", zero(ra)?, zero(dec)?));
    [("OBJCTRA", "OBJCTDEC"), ("RA", "DEC")].iter().filter_map(pair).collect()
}

/// Keywords that stand twice with different values: the first counts.
fn twins(header: &Header) -> Vec<String> {
    let mut odd = Vec::new();
    for card in header.cards() {
        let listed = matches!(card.keyword.as_str(), "COMMENT" | "HISTORY" | "CONTINUE" | "" | "END");
        let Some(first) = header.card(&card.keyword).filter(|f| !listed && f.value != card.value) else { continue };
        let words = format!("{} stands twice, '{}' and '{}': the first is used", card.keyword, first.value, card.value);
        if !odd.contains(&words) {
            odd.push(words);
        }
    }
    odd
}

/// The camera of a header, where it is another than the configured one.
pub(crate) fn other_camera(exposure: &Exposure, config: &Config) -> Option<(String, String)> {
    let camera = optics(&exposure.header, &config.header.aliases).camera?;
    (check_camera(&camera.value, &config.detector.camera) == CameraCheck::Other)
        .then_some((camera.source, camera.value))
}
