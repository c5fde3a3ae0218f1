//! The merit of a hypothesis: the number of stars it matches, and how often chance would do as well.
//!
//! P = Binom(n − 3, p)(≥ k − 3), p = N π r² / area, n detections of which k lie within r of one of N stars on the frame;
//! three are met by construction. The search multiplies by the number of hypotheses. A hypothesis is given up as soon as
//! the detections, brightest first, speak against it (Wald's sequential test).

use super::chance::tail;

use super::field::Field;
use super::fit::{Model, fit};
use super::lists::{Lists, unique_pairs};
use super::similarity::Similarity;
use crate::astrometry::wcs::Wcs;

/// A detection counts as matched with a star within this many σ, which allows for the lever arm of a small triangle.
const JUDGE_SIGMAS: f64 = 5.0;
/// Share of the detections a true hypothesis meets at least.
const TRUE_SHARE: f64 = 0.25;
/// Likelihood ratio at which a hypothesis is given up.
const GIVEN_UP: f64 = 0.005;
/// A hypothesis is worth a fit if chance makes fewer than this many as good among those heard so far.
const WORTH_A_FIT: f64 = 10.0;
/// The first hypotheses count as this many.
const FIRST_HEARD: f64 = 1000.0;
/// A hypothesis that was fitted.
#[derive(Debug, Clone)]
pub(super) struct Found {
    /// Coordinates of the fit.
    pub wcs: Wcs,
    /// (star of the field, detection of the field).
    pub pairs: Vec<(usize, usize)>,
    /// Radius the pairs were taken within \[px\].
    pub radius_px: f64,
    /// Probability of chance; of one hypothesis until the search has multiplied it.
    pub chance: f64,
    /// Root mean square distance \[arcsec\].
    rms_arcsec: f64,
    /// Hypotheses tried, once the search is over.
    pub n_hypotheses: u64,
}

impl Found {
    pub fn better_than(&self, other: &Found) -> bool {
        (self.chance, self.rms_arcsec) < (other.chance, other.rms_arcsec)
    }
}

/// Judges hypotheses about one field at one tolerance.
pub(super) struct Judge<'a> {
    field: &'a Field,
    radius_px: f64,
    /// Log likelihood ratio of a match and of a miss.
    steps: (f64, f64),
    /// P(at least k matches beyond the first three) by chance.
    tails: Vec<f64>,
    /// The field's lists, for fits.
    lists: Lists,
    /// Hypotheses heard by others before.
    n_before: u64,
    /// Hypotheses heard.
    pub n_judged: u64,
    /// The best so far.
    pub best: Option<Found>,
}

impl<'a> Judge<'a> {
    pub fn new(field: &'a Field, sigma_px: f64, n_before: u64) -> Self {
        let radius_px = JUDGE_SIGMAS * sigma_px;
        let area = field.size_px.0 * field.size_px.1;
        let p = (field.stars_per_frame * std::f64::consts::PI * radius_px * radius_px / area).clamp(1e-12, 0.5);
        let share = TRUE_SHARE.max(1.2 * p);
        let steps = ((share / p).ln(), ((1.0 - share) / (1.0 - p)).ln());
        let n = field.detected.len() as u64 - 3;
        let tails = (0..=n).map(|k| tail(n, p, k)).collect();
        Judge { field, radius_px, steps, tails, lists: Lists::of_field(field), n_before, n_judged: 0, best: None }
    }

    /// Hears a hypothesis; `true` if it is now the best.
    pub fn hear(&mut self, at: &Similarity) -> bool {
        let field = self.field;
        // the frame's centre is the origin of the pixels
        let centre = at.apply((0.0, 0.0));
        if centre.0.hypot(centre.1) > field.radius_arcsec * 1.02 + 60.0
            || at.scale() < field.scales.0
            || at.scale() > field.scales.1
        {
            return false;
        }
        self.n_judged += 1;
        let radius = self.radius_px * at.scale();
        let (mut met, mut ratio) = (0, 0.0);
        for detection in &field.detected {
            let (x, y) = at.apply(*detection);
            if field.sky.near(x, y, radius).next().is_some() {
                met += 1;
                ratio += self.steps.0;
            } else {
                ratio += self.steps.1;
                if ratio < GIVEN_UP.ln() {
                    return false;
                }
            }
        }
        let heard = ((self.n_before + self.n_judged) as f64).max(FIRST_HEARD);
        if met <= 3 || self.tails.get(met - 3).is_none_or(|t| t * heard > WORTH_A_FIT) {
            return false;
        }
        match fitted(field, &self.lists, at, self.radius_px) {
            Some(found) if self.best.as_ref().is_none_or(|b| found.better_than(b)) => {
                self.best = Some(found);
                true
            }
            _ => false,
        }
    }

    /// Chance of the best, 1 if there is none.
    pub fn best_chance(&self) -> f64 {
        self.best.as_ref().map_or(1.0, |b| b.chance)
    }
}

/// Fits a hypothesis to the stars it brings together, and counts them.
fn fitted(field: &Field, lists: &Lists, at: &Similarity, radius_px: f64) -> Option<Found> {
    let centre = field.plane.pixel_to_sky(at.apply((0.0, 0.0)).0, at.apply((0.0, 0.0)).1);
    let by_similarity: Vec<(usize, usize)> = {
        let moved: Vec<(f64, f64)> = field.detected.iter().map(|s| at.apply(*s)).collect();
        let places: Vec<(f64, f64)> = field.stars.iter().map(|s| s.at).collect();
        unique_pairs(&places, &moved, &field.sky, radius_px * at.scale())
    };
    let (wcs, pairs, radius_px) = lists.settle(by_similarity, centre, radius_px, &|matches, start| {
        let model = if matches.len() < 8 { Model::Similarity } else { Model::Affine };
        fit(matches, field.size_px, start, model)
    })?;
    let (chance, rms_arcsec) = lists.chance(&wcs, &pairs, radius_px.max(0.5));
    let scale = wcs.scale_arcsec();
    (scale >= field.scales.0 * 0.99 && scale <= field.scales.1 * 1.01).then_some(Found {
        wcs,
        pairs,
        radius_px,
        chance,
        rms_arcsec,
        n_hypotheses: 0,
    })
}
