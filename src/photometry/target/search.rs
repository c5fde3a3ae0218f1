//! Which component of the cutout is the target.
//!
//! Cells. What comes in families of equal streaks is a short trail, what is one pixel wide is a hit; the target is the
//! most significant of the rest, at the scale that shows it best. It does not cover where it ends (`target_segment`).

use ndarray::Array2;

use super::settings::TargetSettings;
use crate::base::stats;
use crate::frames::{Electrons, Frame, mask};
use crate::photometry::label::{Run, label, runs_of_part};
use crate::photometry::target::cells::{Layers, ROUND, SCALES, grown, paint, row_of};
use crate::photometry::target::compact::least_significance;
use crate::photometry::target::cosmic_rays::PIXEL_SIGMA;
use crate::photometry::target::cutout::Cutout;
use crate::photometry::target::shape::{axes, covariance};
use crate::photometry::trails::direction::{FAMILY, SHORTEST_FWHM};

/// Threshold of the outline \[σ of the smoothed cutout\].
pub(crate) const OUTLINE_SIGMA: f64 = 3.0;
/// From this peak on a component is clear without a look for the place where a point fits best \[σ\].
const BRIGHT_SIGMA: f64 = 8.0;
/// Most by which its significance grows there, so that a fainter peak cannot reach the threshold: a Moffat profile with β = 2.5 under a
/// Gaussian, and a place between cells.
const MOST_GAIN: f64 = 1.2;
/// A candidate at the edge of the search region counts exp(−this) of one at the expected place.
const PREFER_NEAR: f64 = 3.0;
/// Significance beyond this many thresholds is no further merit.
const SCORE_CAP: f64 = 10.0;
/// Weight of an object cut by an edge.
const CUT: f64 = 0.2;
/// A streak along the trails longer than this is one of them \[FWHM\], if it is as thin as one.
const TRAIL_LENGTH_FWHM: f64 = 18.0;
/// Width of the outline of a trail \[FWHM\].
const TRAIL_WIDTH_FWHM: f64 = 5.0;
/// A streak along the trails longer than this is one of them however wide \[FWHM\].
const LONGEST_FWHM: f64 = 40.0;
/// By how much the next scale must be better: its outline is less sharp.
const SCALE_HANDICAP: f64 = 1.05;
/// From this many thresholds on the outline at a scale is good enough: less, and it ends so far inside a wide target that
/// the margin does not make up for it.
const BRIGHT: f64 = 6.0;
/// A cutout that scatters this much more than its photons is not empty sky.
const STRUCTURED: f32 = 1.4;
/// A pixel with more than this share of the light of the 25 around it is hot: that of a star has no such pixel.
const HOT_SHARE: f64 = 0.6;
/// A component of more cells than this ...
const STREAK_CELLS: usize = 20;
/// ... that is so many times as long as wide is a streak.
pub(crate) const STREAK_RATIO: f64 = 2.5;
/// Cosine of twice the angle between a streak and the trails it is along.
const ALONG_COS: f64 = 0.97;
/// Streaks of a family are as parallel as this (cosine of twice the angle) ...
const FAMILY_COS: f64 = 0.98;
/// ... and as long as each other to this \[logarithm of the ratio\].
const FAMILY_LENGTH: f64 = 0.25;

impl Layers {
    /// The significance at one of the scales, `fwhm` being that of a star in cells; cells in `hidden` do not count.
    pub fn at_scale(&self, scale: usize, fwhm: f64, hidden: Option<&Array2<bool>>) -> Array2<f32> {
        if scale < ROUND {
            self.significance(SCALES[scale] as f64 * fwhm, SCALES[scale], hidden)
        } else {
            self.elongated(fwhm, SCALES[scale], hidden)
        }
    }
}

/// A component that may be the target, in squares of `rebin` cells.
pub(crate) struct Candidate {
    pub pixels: Vec<(usize, usize)>,
    pub snr: f64,
    score: f64,
    /// Index of its scale.
    pub scale: usize,
}

/// Signal-to-noise of the cutout at the requested scales: that of scale k on squares of k cells.
///
/// A bright target needs no wide filter.
pub(crate) struct Significances<'a> {
    layers: &'a Layers,
    fwhm: f64,
    /// Scatter of the last scale in units of its photons' where that is more.
    unit: f32,
    pub at_scale: Vec<Array2<f32>>,
}

impl<'a> Significances<'a> {
    /// Without any scale yet; `fwhm` of a star in cells.
    pub fn new(layers: &'a Layers, fwhm: f64) -> Self {
        Self { layers, fwhm, unit: 1.0, at_scale: Vec::new() }
    }

    /// The significances of the first `n` scales.
    pub fn first(&mut self, n: usize) -> &[Array2<f32>] {
        while self.at_scale.len() < n.min(SCALES.len()) {
            let k = self.at_scale.len();
            let snr = self.layers.at_scale(k, self.fwhm, None);
            if k < ROUND {
                // what scatters more than its photons is structure of the sky: less sure by that factor
                let mut sample: Vec<f64> =
                    snr.iter().step_by(3).filter(|v| **v != 0.0).map(|v| f64::from(*v)).collect();
                self.unit = stats::mad_sigma(&mut sample).unwrap_or(1.0).max(1.0) as f32;
            }
            self.at_scale.push(self.in_units(snr));
        }
        &self.at_scale
    }

    /// The significance at the last scale that was looked at without the cells in `hidden`.
    fn last_without(&self, hidden: &Array2<bool>) -> Array2<f32> {
        self.in_units(self.layers.at_scale(self.at_scale.len() - 1, self.fwhm, Some(hidden)))
    }

    /// Significances of a sky of this structure.
    fn in_units(&self, mut snr: Array2<f32>) -> Array2<f32> {
        if self.unit > STRUCTURED {
            snr.mapv_inplace(|v| v / self.unit);
        }
        snr
    }
}

/// Cells of a row that are looked at together: of most of them none is above a threshold.
const PART: usize = 32;

/// The components of an image above `threshold`.
pub(crate) fn components(snr: &Array2<f32>, threshold: f64) -> Vec<Vec<(usize, usize)>> {
    let is_above = |v: &f32| *v > threshold as f32;
    let mut runs: Vec<Run> = Vec::new();
    for j in 0..snr.nrows() {
        for (k, part) in row_of(snr, j).chunks(PART).enumerate() {
            if part.iter().fold(false, |any, v| any | is_above(v)) {
                runs_of_part(j, k * PART, part.iter().map(is_above), &mut runs);
            }
        }
    }
    // a run that goes on in the next part
    runs.dedup_by(|next, run| {
        let is_one = (run.row, run.columns.end) == (next.row, next.columns.start);
        if is_one {
            run.columns.end = next.columns.end;
        }
        is_one
    });
    let (labels, n) = label(&runs);
    let mut groups: Vec<Vec<(usize, usize)>> = vec![Vec::new(); n];
    for (run, l) in runs.iter().zip(labels) {
        groups[l].extend(run.columns.clone().map(|i| (i, run.row)));
    }
    groups
}

/// The component most likely to be the target.
pub(crate) fn best_candidate(
    cutout: &Cutout,
    snrs: &mut Significances,
    frame: &Frame<Electrons>,
    s: &TargetSettings,
) -> Option<Candidate> {
    let mut best: Option<Candidate> = None;
    let point_least = least_significance(s, cutout.skewness());
    // cells of short trails, which a wider filter must not take for something else
    let mut trails = Array2::from_elem(cutout.net.mean.dim(), false);
    for scale in 0..cutout.scales() {
        let snr = cutout.in_bound(&snrs.first(scale + 1)[scale], SCALES[scale]);
        for candidate in candidates(cutout, frame, &snr, (scale, point_least), &mut trails, s) {
            let further = candidate.scale as i32 - best.as_ref().map_or(0, |b| b.scale as i32);
            let handicap = SCALE_HANDICAP.powi(further).max(1.0);
            let is_better = best.as_ref().is_none_or(|b| candidate.score > b.score * handicap);
            if is_better && !is_of_several(&candidate, snrs, point_least, s) {
                best = Some(candidate);
            }
        }
        // bright enough to be outlined at this scale
        if best.as_ref().is_some_and(|b| b.snr > BRIGHT * s.detect_sigma) {
            break;
        }
    }
    best
}

/// Whether a candidate of a filter wider than a star is nothing but several sources, each of which is one under the filter of a star.
fn is_of_several(candidate: &Candidate, snrs: &Significances, point_least: f64, s: &TargetSettings) -> bool {
    if candidate.scale == 0 {
        return false;
    }
    let (snr1, least) = (&snrs.at_scale[0], point_least as f32);
    let mut inside = Array2::from_elem(snr1.dim(), false);
    paint(&mut inside, &candidate.pixels, SCALES[candidate.scale]);
    let mut sources = components(snr1, OUTLINE_SIGMA);
    sources
        .retain(|cells| cells.iter().any(|&(i, j)| snr1[[j, i]] > least) && cells.iter().any(|&(i, j)| inside[[j, i]]));
    if sources.len() < 2 {
        return false;
    }
    let mut hidden = Array2::from_elem(snr1.dim(), false);
    sources.iter().for_each(|cells| paint(&mut hidden, cells, 1));
    let rest = snrs.last_without(&grown(&hidden, snrs.fwhm.ceil() as usize));
    let least = threshold(s.detect_sigma, candidate.scale);
    !candidate.pixels.iter().any(|&(i, j)| f64::from(rest[[j, i]]) > least)
}

fn candidates(
    cutout: &Cutout,
    frame: &Frame<Electrons>,
    snr: &Array2<f32>,
    (scale, point_least): (usize, f64),
    trails: &mut Array2<bool>,
    s: &TargetSettings,
) -> Vec<Candidate> {
    let (ny, nx) = snr.dim();
    let groups = components(snr, OUTLINE_SIGMA);
    let side = (SCALES[scale] * cutout.net.bin) as f64;
    let to_px = |at: f64| at * side + 0.5 * (side - 1.0);
    let (ox, oy) = cutout.origin(frame);
    let expected = (s.x_px - ox, s.y_px - oy);
    let streaks: Vec<Option<Streak>> = groups.iter().map(|g| streak(g)).collect();
    let trail_angle = cutout.trail_background.as_ref().map(|s| s.theta());
    let [left, right, bottom, top] = cutout.at_edge;
    let least = if scale == 0 { point_least } else { threshold(s.detect_sigma, scale) };
    let mut found = Vec::new();
    for (g, pixels) in groups.into_iter().enumerate() {
        let runs_out = pixels.iter().any(|&(i, j)| {
            (i == 0 && !left) || (i + 1 == nx && !right) || (j == 0 && !bottom) || (j + 1 == ny && !top)
        });
        let family = one_of_a_family(&streaks, g);
        let long = |t: &Streak| t.length * side > SHORTEST_FWHM * s.fwhm_px;
        if family && scale == 0 && streaks[g].as_ref().is_some_and(long) {
            pixels.iter().for_each(|&(i, j)| trails[[j, i]] = true);
        }
        let of_trail = scale > 0 && holds_trail(trails, snr, &pixels, SCALES[scale]);
        if runs_out || family || of_trail {
            continue;
        }
        let (mut w, mut x, mut y) = (0.0, 0.0, 0.0);
        for &(i, j) in &pixels {
            let v = f64::from(snr[[j, i]]);
            w += v;
            x += v * to_px(i as f64);
            y += v * to_px(j as f64);
        }
        let distance = (x / w - expected.0).hypot(y / w - expected.1);
        if distance > s.search_radius_px {
            continue;
        }
        let mut peak = pixels.iter().map(|&(i, j)| f64::from(snr[[j, i]])).fold(0.0, f64::max);
        if scale == 0 {
            peak = point_significance(cutout, snr, &pixels, (peak, least));
        }
        if peak < least || is_hot_pixel(cutout, &pixels, side as usize) {
            continue;
        }
        // beyond the cap brightness is no merit: a remainder of a bright trail must not win over the target
        let near = (-PREFER_NEAR * (distance / s.search_radius_px.max(1.0)).powi(2)).exp();
        let cut = pixels.iter().any(|&(i, j)| is_cut_at(cutout, frame, (i, j), side as usize));
        let along =
            streaks[g].as_ref().zip(trail_angle).filter(|(t, theta)| (2.0 * (t.theta - theta)).cos() > ALONG_COS).map(
                |(t, _)| {
                    let fwhm = s.fwhm_px / side;
                    (t.length / fwhm, t.width / fwhm)
                },
            );
        let is_trail = |(length, width): (f64, f64)| {
            length > LONGEST_FWHM + 3.0 * SCALES[scale] as f64
                || (scale < 2 && length > TRAIL_LENGTH_FWHM && width < TRAIL_WIDTH_FWHM)
        };
        if along.is_some_and(is_trail) {
            if scale == 0 {
                pixels.iter().for_each(|&(i, j)| trails[[j, i]] = true);
            }
            continue;
        }
        let whole = if cut { CUT } else { 1.0 };
        let score = peak.min(SCORE_CAP * s.detect_sigma) * near * whole;
        found.push(Candidate { pixels, snr: peak, score, scale });
    }
    found
}

/// The significance of a component of the first scale as a point where it fits best: the peak of a Gaussian in cells is that
/// of a Moffat profile between them to no better than [`MOST_GAIN`].
fn point_significance(cutout: &Cutout, snr: &Array2<f32>, pixels: &[(usize, usize)], (peak, least): (f64, f64)) -> f64 {
    if !(least / MOST_GAIN..BRIGHT_SIGMA).contains(&peak) {
        return peak;
    }
    let Some(&(i, j)) = pixels.iter().max_by(|p, q| snr[[p.1, p.0]].total_cmp(&snr[[q.1, q.0]])) else { return peak };
    let best = cutout.best_place(&cutout.psf, (cutout.net.to_px(i as f64), cutout.net.to_px(j as f64)));
    best.map_or(peak, |best| best.snr.clamp(peak, MOST_GAIN * peak))
}

/// The threshold of a scale \[σ\]: as many false alarms as `detect_sigma` has at the scale of a star.
///
/// e^(−T²/2) places of noise exceed T; a filter k times as wide has k² times fewer places: T_k² = T² − 4 ln k.
fn threshold(detect_sigma: f64, scale: usize) -> f64 {
    // the elongated filter, 20 by 5 FWHM, at some four independent angles
    let places = if scale < ROUND { (SCALES[scale] as f64).powi(2) } else { 25.0 };
    (detect_sigma.powi(2) - 2.0 * places.ln()).max(OUTLINE_SIGMA.powi(2)).sqrt()
}

/// Whether the peak of a component in squares of `scale` cells lies on the cells of a trail.
fn holds_trail(trails: &Array2<bool>, snr: &Array2<f32>, pixels: &[(usize, usize)], scale: usize) -> bool {
    let Some(&(i, j)) = pixels.iter().max_by(|p, q| snr[[p.1, p.0]].total_cmp(&snr[[q.1, q.0]])) else { return false };
    let (ny, nx) = trails.dim();
    let range = |k: usize, n: usize| (k * scale).min(n)..((k + 1) * scale).min(n);
    range(j, ny).any(|y| range(i, nx).any(|x| trails[[y, x]]))
}

/// Whether a square of `side` pixels is next to the edge of the frame or to pixels outside the clip circle.
fn is_cut_at(cutout: &Cutout, frame: &Frame<Electrons>, (i, j): (usize, usize), side: usize) -> bool {
    let (ny, nx) = frame.pixels.dim();
    let (x, y) = (cutout.x0 + i * side, cutout.y0 + j * side);
    if x == 0 || y == 0 || x + side >= nx || y + side >= ny {
        return true;
    }
    let (left, right, below, above) = (x - 1, x + side, y - 1, y + side);
    [(left, y), (right, y), (x, below), (x, above)].iter().any(|&(x, y)| frame.mask[[y, x]] & mask::CLIPPED != 0)
}

/// Whether one pixel holds most of the light around the brightest. Where the width of a star is only assumed, at 1.5 px,
/// nothing else sees such a pixel.
fn is_hot_pixel(cutout: &Cutout, squares: &[(usize, usize)], side: usize) -> bool {
    let (ny, nx) = cutout.pixels.dim();
    let bin = cutout.net.bin;
    let (my, mx) = cutout.light.dim();
    let residual = |i: usize, j: usize| {
        let light = cutout.light[[(j / bin).min(my - 1), (i / bin).min(mx - 1)]];
        let v = f64::from(cutout.pixels[[j, i]] - light) - cutout.sky.level(i as f64, j as f64);
        if v.is_finite() { v } else { 0.0 }
    };
    let mut brightest = (f64::NEG_INFINITY, 0, 0);
    for &(i, j) in squares {
        for jj in j * side..((j + 1) * side).min(ny) {
            for ii in i * side..((i + 1) * side).min(nx) {
                let v = f64::from(cutout.pixels[[jj, ii]]);
                if v > brightest.0 {
                    brightest = (v, ii, jj);
                }
            }
        }
    }
    let (_, i, j) = brightest;
    let mut around = 0.0;
    for jj in j.saturating_sub(2)..(j + 3).min(ny) {
        for ii in i.saturating_sub(2)..(i + 3).min(nx) {
            around += residual(ii, jj);
        }
    }
    let peak = residual(i, j);
    peak > PIXEL_SIGMA * cutout.rms_e && peak > HOT_SHARE * around
}

/// A long component: angle, length and width of an even bar with its second moments.
struct Streak {
    theta: f64,
    length: f64,
    width: f64,
}

/// A component that is a streak.
fn streak(pixels: &[(usize, usize)]) -> Option<Streak> {
    let (_, _, xx, xy, yy) = covariance(pixels);
    let (a, b, theta) = axes(xx, xy, yy);
    let root = 12f64.sqrt();
    (pixels.len() > STREAK_CELLS && a > STREAK_RATIO * b).then_some(Streak { theta, length: root * a, width: root * b })
}

/// Whether other components are streaks of nearly the same direction and length: short star trails.
fn one_of_a_family(streaks: &[Option<Streak>], which: usize) -> bool {
    let Some(own) = &streaks[which] else { return false };
    let alike = streaks.iter().enumerate().filter(|(k, other)| {
        other.as_ref().is_some_and(|o| {
            *k != which
                && (2.0 * (o.theta - own.theta)).cos() > FAMILY_COS
                && (o.length / own.length).ln().abs() < FAMILY_LENGTH
        })
    });
    alike.count() + 1 >= FAMILY
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_component_of_a_row_is_a_run_wherever_its_parts_begin() {
        for sparse in [2, 7, 60] {
            let row: Vec<f32> = (0..5 * PART + 11).map(|i| ((i * 7919 / 31 + i * i) % sparse) as f32).collect();
            let snr = Array2::from_shape_vec((1, row.len()), row.clone()).unwrap();
            let numbered: Vec<(usize, f32)> = row.into_iter().enumerate().collect();
            let runs = numbered.split(|(_, v)| *v < 1.0).filter(|run| !run.is_empty());
            let wanted: Vec<Vec<(usize, usize)>> = runs.map(|run| run.iter().map(|(i, _)| (*i, 0)).collect()).collect();
            assert_eq!(components(&snr, 0.5), wanted);
            assert!(sparse < 60 || wanted.iter().any(|run| run.len() > PART), "{sparse}");
        }
    }
}
