//! What a plate solution starts from, what it ends with, and why there may be none.

use super::fit::Model;
use crate::astrometry::wcs::Wcs;
use std::fmt;

/// A catalogue star: the three numbers the match needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyStar {
    /// Right ascension \[deg\].
    pub ra_deg: f64,
    /// Declination \[deg\].
    pub dec_deg: f64,
    /// Magnitude in any band: it only orders the stars.
    pub v_mag: f64,
}

/// A detection on the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Position \[px\], 0-based.
    pub x_px: f64,
    /// Position \[px\].
    pub y_px: f64,
    /// Flux in any unit: it only orders the detections.
    pub flux: f64,
}

/// What is known before: where the frame's centre is, and the scale of the optics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hint {
    /// Right ascension \[deg\].
    pub ra_deg: f64,
    /// Declination \[deg\].
    pub dec_deg: f64,
    /// How far the frame's centre may be from there \[deg\].
    pub radius_deg: f64,
    /// Pixel scale \[arcsec/px\].
    pub scale_arcsec: f64,
    /// How far the scale may be off, as a share.
    pub scale_search_frac: f64,
    /// Whether the sky is mirrored on the frame, where the optics say so; `None` = either.
    pub mirrored: Option<bool>,
}

/// A star found on the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Index in the catalogue.
    pub star: usize,
    /// Index in the detections.
    pub detection: usize,
    /// Detected minus fitted place, east and north \[arcsec\].
    pub residual_arcsec: (f64, f64),
}

/// A frame on the sky.
#[derive(Debug, Clone)]
pub struct Solution {
    /// World coordinates, the reference point at the frame's centre.
    pub wcs: Wcs,
    /// What was fitted.
    pub model: Model,
    /// The stars it rests on, in the order of the catalogue; each star and each detection once.
    pub pairs: Vec<Pair>,
    /// Root mean square distance of the pairs \[arcsec\].
    pub rms_arcsec: f64,
    /// Probability that chance brings as many stars together in any of the hypotheses tried.
    pub chance: f64,
    /// Hypotheses tried.
    pub n_hypotheses: u64,
    /// Pixel scale \[arcsec/px\].
    pub scale_arcsec: f64,
    /// Rotation \[deg\], as in [`Wcs::tan`]: 0 = north along +y; positive turns the sky from +x towards +y.
    pub rotation_deg: f64,
    /// Whether east is along +x where north is along +y: not as the sky is seen by eye.
    pub mirrored: bool,
    /// (RA, Dec) of the frame's centre \[deg\].
    pub centre_deg: (f64, f64),
}

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// The hint cannot be used.
    Hint(String),
    /// Too few detections for any match.
    FewDetections {
        /// How many, duplicates and those off the frame excluded.
        n: usize,
    },
    /// Too few catalogue stars for any match.
    FewStars {
        /// How many.
        n: usize,
        /// Within this distance of the hint \[deg\].
        radius_deg: f64,
    },
    /// Nothing fits better than chance.
    NoMatch {
        /// Detections that were tried.
        n_detections: usize,
        /// Stars that were tried.
        n_stars: usize,
        /// Hypotheses that were judged.
        n_hypotheses: u64,
        /// Most stars that any solution matched, and the probability of as many by chance.
        best: Option<(usize, f64)>,
    },
    /// The stars that match lie on a line: a mirrored sky fits them as well.
    OnALine {
        /// How many.
        n: usize,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Hint(problem) => f.write_str(problem),
            Refusal::FewDetections { n } => write!(f, "{n} detections on the frame, {MIN_MATCHED} are needed"),
            Refusal::FewStars { n, radius_deg } => {
                write!(f, "{n} catalogue stars within {radius_deg:.2} deg of the hint, {MIN_MATCHED} are needed")
            }
            Refusal::NoMatch { n_detections, n_stars, n_hypotheses, best } => {
                write!(
                    f,
                    "{n_detections} detections fit {n_stars} catalogue stars no better than chance \
                     ({n_hypotheses} hypotheses"
                )?;
                match best {
                    Some((n, chance)) => write!(f, "; the best brings {n} stars together, chance {chance:.1e})"),
                    None => f.write_str(")"),
                }
            }
            Refusal::OnALine { n } => write!(f, "the {n} stars that match lie on a line: the parity is open"),
        }
    }
}

/// Fewest stars of a solution: three make a hypothesis, a fourth can speak for it.
pub const MIN_MATCHED: usize = 4;

/// Largest probability that an accepted solution is chance.
pub const MAX_CHANCE: f64 = 1e-5;

/// Effort of a search: what is traded against run time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Most detections triangles are made of.
    pub max_detections: usize,
    /// Most rounds, from few bright stars to many; four are all.
    pub max_levels: usize,
}

impl Default for Effort {
    fn default() -> Self {
        Effort { max_detections: 32, max_levels: 4 }
    }
}
