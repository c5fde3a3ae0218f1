//! Whether the ends of trails are where a fit has them: light up to them, and none beyond.
//!
//! Next to each end in the frame two short pieces are fitted in addition to the trail: light that is missing before the end, and
//! light that is there beyond it.

use super::fit::{LEAST_ENDS, Start, TrailFit, solve};
use super::image::TrailImage;
use super::path::PredictedTrail;
use super::search::LitTrail;

/// The pieces must be known this well, as a share of the trail's light.
const MOST_ERR: f64 = 0.3;
/// Light of a piece that is none, and that which is the trail's, as shares of the trail's light.
const NONE_AND_ALL: [f64; 2] = [0.4, 0.6];
/// The pieces begin this far from the end \[FWHM\] ...
const FROM_FWHM: f64 = 0.7;
/// ... and end here.
const TO_FWHM: f64 = 7.0;

/// The fit, without its offset along the trails where fewer than three ends are where it has them, or where too many are not.
pub(super) fn checked(image: &TrailImage, fit: TrailFit, start: Start) -> TrailFit {
    if fit.along_px.is_none() {
        return fit;
    }
    // a few ends may belong to light that is in no catalogue
    let seen = confirmed(image, &fit, start).filter(|(there, not)| *there >= LEAST_ENDS && 3 * not <= *there);
    match seen {
        Some((n_ends, _)) => TrailFit { n_ends, ..fit },
        None => TrailFit { along_px: None, stretch: None, ..fit },
    }
}

/// How many ends are there, and how many are not where they should be.
fn confirmed(image: &TrailImage, fit: &TrailFit, start: Start) -> Option<(usize, usize)> {
    let (trails, shape) = (&fit.trails, fit.shape);
    let (from, to) = (FROM_FWHM * start.fwhm_px, TO_FWHM * start.fwhm_px);
    let mut all = trails.clone();
    let mut of = Vec::new();
    for (k, lit) in trails.iter().enumerate() {
        for (u, outwards) in [(lit.trail.start_px, -1.0), (lit.trail.end_px, 1.0)] {
            if !shape.end_is_inside(image, lit, u, 0.5 * to) {
                continue;
            }
            let piece = |way: f64| {
                let (a, b) = (u + way * from, u + way * to);
                LitTrail { trail: PredictedTrail { start_px: a.min(b), end_px: a.max(b), ..lit.trail }, ..*lit }
            };
            of.push((k, all.len()));
            all.extend([piece(-outwards), piece(outwards)]);
        }
    }
    let mut guess: Vec<f64> = fit.lights.iter().map(|l| l.ratio).collect();
    guess.resize(all.len(), 0.0);
    let solved = solve(image, &all, &guess, shape, start, [false; 5], true)?;
    let (mut there, mut not) = (0, 0);
    for (k, inner) in of {
        let (light, errs) = (solved.amplitudes[k], &solved.errs);
        let known = errs[inner].max(errs[inner + 1]) < MOST_ERR * light;
        let (before, beyond) = (1.0 + solved.amplitudes[inner] / light, solved.amplitudes[inner + 1] / light);
        there += usize::from(known && beyond < NONE_AND_ALL[0] && before > NONE_AND_ALL[1]);
        not += usize::from(known && (beyond > NONE_AND_ALL[1] || before < NONE_AND_ALL[0]));
    }
    Some((there, not))
}
