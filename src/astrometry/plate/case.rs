//! A matching case in a JSON file: size, hint, catalogue, detections and, where it is known, the truth.
//!
//! `{"size": [nx, ny], "hint": {"ra_deg", "dec_deg", "scale_arcsec"}, "catalogue": [{"ra_deg", "dec_deg", "v_mag"}],
//! "detections": [{"x_px", "y_px", "flux"}], "truth": {"ra_deg", "dec_deg", "scale_arcsec", "rotation_deg",
//! "mirrored"}}`. A truth of null says that the field is not in the catalogue. Other keys are passed over.

use std::path::Path;

use serde::Deserialize;

use super::problem::Detection;
use super::problem::Hint;
use super::problem::SkyStar;
use super::problem::Solution;
use crate::astrometry::catalogue::separation_deg;
use crate::astrometry::wcs::Wcs;
use crate::base::error::{Error, Result};

/// Error of an approximate position where the case does not state one \[deg\].
const RADIUS_DEG: f64 = 1.0;
/// Error of a scale where the case does not state one, as a share.
const SCALE_SEARCH_FRAC: f64 = 0.2;
/// Largest error of the centre of a right solution \[arcsec\].
const CENTRE_ARCSEC: f64 = 3.0;
/// Largest error of the scale of a right solution, as a share.
const SCALE_FRAC: f64 = 0.002;
/// Largest error of the rotation of a right solution \[deg\].
const ROTATION_DEG: f64 = 0.1;

/// A matching case.
#[derive(Debug, Clone, Deserialize)]
pub struct Case {
    /// Name of the kind of field; empty if it has none.
    #[serde(default)]
    pub case: String,
    /// (nx, ny) \[px\].
    size: (usize, usize),
    hint: CaseHint,
    catalogue: Vec<CaseStar>,
    detections: Vec<CaseDetection>,
    /// Absent: unknown; null: there is no solution.
    #[serde(default, deserialize_with = "present")]
    truth: Option<Option<Truth>>,
}

#[derive(Debug, Clone, Deserialize)]
struct CaseHint {
    ra_deg: f64,
    dec_deg: f64,
    scale_arcsec: f64,
    radius_deg: Option<f64>,
    scale_search_frac: Option<f64>,
    mirrored: Option<bool>,
}

#[derive(Debug, Clone, Deserialize)]
struct CaseStar {
    ra_deg: f64,
    dec_deg: f64,
    v_mag: f64,
}

#[derive(Debug, Clone, Deserialize)]
struct CaseDetection {
    x_px: f64,
    y_px: f64,
    flux: f64,
}

/// Where the frame really is. The centre of the frame is at (nx/2, ny/2); (x, y) = R(θ) diag(±1, 1) (east,
/// north)/scale, minus if `mirrored`: a sky seen by eye, east to the left, is called mirrored here.
#[derive(Debug, Clone, Copy, Deserialize)]
struct Truth {
    ra_deg: f64,
    dec_deg: f64,
    scale_arcsec: f64,
    rotation_deg: f64,
    mirrored: bool,
}

/// Reports `"truth": null` from no truth at all.
fn present<'de, D: serde::Deserializer<'de>>(from: D) -> std::result::Result<Option<Option<Truth>>, D::Error> {
    Option::<Truth>::deserialize(from).map(Some)
}

/// An answer against the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Solved as the truth says.
    Right,
    /// Solved otherwise, or where there is no solution.
    Wrong,
    /// Not solved.
    None,
    /// Solved; the case holds no truth.
    Unknown,
}

impl Verdict {
    /// As it is printed.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Right => "right",
            Verdict::Wrong => "wrong",
            Verdict::None => "none",
            Verdict::Unknown => "solved",
        }
    }
}

impl Case {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Table`] with the line of what is not understood.
    pub fn read(path: &Path) -> Result<Case> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        serde_json::from_str(&text).map_err(|e| Error::Table {
            path: path.into(),
            line: Some(e.line()),
            problem: format!("is not a matching case ({e}); keys: size, hint, catalogue, detections, truth"),
        })
    }

    /// (nx, ny) \[px\].
    #[must_use]
    pub fn size_px(&self) -> (usize, usize) {
        self.size
    }

    /// The stars of the catalogue.
    #[must_use]
    pub fn stars(&self) -> Vec<SkyStar> {
        self.catalogue.iter().map(|s| SkyStar { ra_deg: s.ra_deg, dec_deg: s.dec_deg, v_mag: s.v_mag }).collect()
    }

    /// The detections.
    #[must_use]
    pub fn detections(&self) -> Vec<Detection> {
        self.detections.iter().map(|d| Detection { x_px: d.x_px, y_px: d.y_px, flux: d.flux }).collect()
    }

    /// The approximate position; its error is 1 deg, and that of the scale a fifth, where the case does not state them.
    #[must_use]
    pub fn hint(&self) -> Hint {
        Hint {
            ra_deg: self.hint.ra_deg,
            dec_deg: self.hint.dec_deg,
            radius_deg: self.hint.radius_deg.unwrap_or(RADIUS_DEG),
            scale_arcsec: self.hint.scale_arcsec,
            scale_search_frac: self.hint.scale_search_frac.unwrap_or(SCALE_SEARCH_FRAC),
            mirrored: self.hint.mirrored,
        }
    }

    /// Compares an answer with the truth: centre within 3 arcsec, scale within 0.2 %, rotation within 0.1 deg, parity.
    #[must_use]
    pub fn verdict(&self, solution: Option<&Solution>) -> Verdict {
        let Some(solution) = solution else { return Verdict::None };
        let Some(truth) = &self.truth else { return Verdict::Unknown };
        let Some(t) = truth else { return Verdict::Wrong };
        let centre = (self.size.0 as f64 / 2.0, self.size.1 as f64 / 2.0);
        // at rotation 0 and not mirrored the case has east along +x: Wcs::tan calls that mirrored
        let wcs = Wcs::tan(t.ra_deg, t.dec_deg, centre.0, centre.1, t.scale_arcsec, t.rotation_deg, !t.mirrored);
        let (ra, dec) = solution.wcs.pixel_to_sky(centre.0, centre.1);
        let off_arcsec = separation_deg(ra, dec, t.ra_deg, t.dec_deg) * 3600.0;
        let turn = (solution.wcs.rotation_deg() - wcs.rotation_deg()).rem_euclid(360.0);
        let right = off_arcsec < CENTRE_ARCSEC
            && (solution.scale_arcsec / t.scale_arcsec - 1.0).abs() < SCALE_FRAC
            && turn.min(360.0 - turn) < ROTATION_DEG
            && solution.mirrored == wcs.mirrored();
        if right { Verdict::Right } else { Verdict::Wrong }
    }
}
