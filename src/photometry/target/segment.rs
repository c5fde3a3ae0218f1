//! Where the target ends: its component grown by what belongs to it, fainter and wider than the scale it was found at.
//!
//! Cells. What is found is masked and the rest is searched again through a wider filter, so that a bright core does not
//! bleed into the outline. Compact objects next to the target are neighbours. It does not cover the shape of the
//! aperture.

use ndarray::Array2;

use crate::photometry::target::cells::{Layers, ROUND, SCALES, cells_of, cells_where, grown, paint, row_of};
use crate::photometry::target::cutout::Cutout;
use crate::photometry::target::search::{Candidate, OUTLINE_SIGMA, components};

/// Peak of a component that is joined \[σ\].
const JOIN_SIGMA: f64 = 3.7;
/// The same under a filter wider than a star, of what lies next to the target and not around it: of the places such a
/// filter finds along the edge of a target, noise makes 3.7 σ of one in sixty, and each would add an aperture's worth of
/// sky.
const JOIN_NEIGHBOUR_SIGMA: f64 = 4.5;
/// Peak of a separate part nearby that is joined \[σ\].
const PART_SIGMA: f64 = 5.0;
/// A target this much as significant under a wider filter as under its own, less one σ for the noise, is as wide as that
/// filter. Of a star twice the width leaves 0.8: at 7 σ or less it may get too wide an aperture; a station whose brightest
/// module was found gets the whole.
const EXTENDED: f64 = 0.7;
/// From this significance on its own scale shows the target well enough \[σ\].
const BRIGHT_SIGMA: f64 = 25.0;
/// Where a smoothed target ends, in units of its peak.
const OUTLINE_FRAC: f64 = 0.3;
/// The same for the elongated filter, which is longer than most targets.
const OUTLINE_FRAC_ELONGATED: f64 = 0.6;
/// The same for a faint one \[σ\].
const FAINT_OUTLINE_SIGMA: f64 = 2.2;
/// How far a separate part may be \[FWHM\].
const PART_REACH_FWHM: f64 = 5.0;
/// Peak of a point source that is a neighbour and not a part \[σ\].
const NEIGHBOUR_SIGMA: f64 = 6.0;
/// Moffat's β of a star with wide wings.
const WIDEST_BETA: f64 = 2.5;
/// Largest size of the outline of a point source \[FWHM\].
const NEIGHBOUR_SIZE_FWHM: f64 = 4.0;

/// The cells of the target, and the point sources that are not part of it.
pub(crate) struct Segment {
    pub inside: Array2<bool>,
    /// Cells of each neighbour.
    pub neighbours: Vec<Vec<(usize, usize)>>,
    /// Whether it goes on where nothing is part of the target: a trail or a neighbour is in it.
    pub is_cut: bool,
}

impl Segment {
    /// Centres of the cells of the outline \[px of the cutout\].
    pub fn points(&self, cutout: &Cutout) -> Vec<[f64; 2]> {
        let (ny, nx) = self.inside.dim();
        let mut points = Vec::new();
        for (j, row) in self.inside.rows().into_iter().enumerate() {
            // only the ends of a row can be corners of the hull
            let first = row.iter().position(|v| *v);
            let last = row.iter().rposition(|v| *v);
            for i in [first, last].into_iter().flatten() {
                points.push([cutout.net.to_px(i as f64), cutout.net.to_px(j as f64)]);
            }
        }
        debug_assert!(points.len() <= 2 * ny && nx > 0);
        points
    }

    /// Columns and rows of the cells inside.
    pub fn cells(&self) -> Vec<(usize, usize)> {
        cells_where(&self.inside, |v| *v)
    }
}

/// The number of scales whose significance [`segment`] needs.
pub(crate) fn scales_needed(found: &Candidate) -> usize {
    if found.snr < BRIGHT_SIGMA { SCALES.len() } else { ROUND.max(found.scale + 2) - 1 }
}

/// The whole of the candidate; `snrs` = significance at the first [`scales_needed`] scales or more.
pub(crate) fn segment(cutout: &Cutout, layers: &Layers, snrs: &[Array2<f32>], found: &Candidate) -> Segment {
    let dim = cutout.net.mean.dim();
    let margin = cutout.fwhm_cells().ceil() as usize;
    let mut inside = Array2::from_elem(dim, false);
    let own = components_at(&snrs[found.scale], found, &seed(found, dim), (SCALES[found.scale], found.scale == ROUND));
    let faint = found.scale >= 2 && found.snr < BRIGHT_SIGMA;
    paint(&mut inside, own.as_ref().filter(|_| faint).unwrap_or(&found.pixels), SCALES[found.scale]);
    let mut neighbours: Vec<Vec<(usize, usize)>> = Vec::new();
    // what a wider filter shows as well is as wide as that filter
    let wider = if found.snr < BRIGHT_SIGMA { cutout.scales() } else { 0 };
    let points = (wider > 0).then(|| points_around(&snrs[0], &inside, cutout.fwhm_cells())).flatten();
    for (k, (scale, snr)) in SCALES.iter().zip(snrs).enumerate().take(wider).skip(found.scale + 1) {
        let at_scale = (*scale, k == ROUND);
        let part = components_at(snr, found, &inside, at_scale).and_then(|part| match &points {
            None => Some(part),
            // such a filter mixes their light with that of the target
            Some(points) => {
                components_at(&layers.at_scale(k, cutout.fwhm_cells(), Some(points)), found, &inside, at_scale)
            }
        });
        if let Some(part) = part {
            paint(&mut inside, &part, *scale);
        }
    }
    if let Some(points) = &points {
        inside.zip_mut_with(points, |cell, point| *cell &= !point);
    }
    // separate parts of the finest scales
    for (scale, snr) in SCALES.iter().zip(snrs).take(2).filter(|(scale, _)| **scale <= SCALES[found.scale]) {
        let parts: Vec<(f64, Vec<(usize, usize)>)> = components(snr, OUTLINE_SIGMA)
            .into_iter()
            .map(|part| (peak_of(snr, &part), part))
            .filter(|(peak, _)| *peak >= PART_SIGMA)
            .map(|(peak, part)| (peak, cells_of(&part, *scale, dim)))
            .collect();
        for _ in 0..2 {
            let reach = grown(&inside, (PART_REACH_FWHM * cutout.fwhm_cells()) as usize);
            for (peak, cells) in &parts {
                if cells.iter().all(|&(i, j)| inside[[j, i]]) {
                    continue;
                }
                let touches = cells.iter().any(|&(i, j)| inside[[j, i]]);
                let near = cells.iter().any(|&(i, j)| reach[[j, i]]);
                if !touches && *scale == 1 && *peak > NEIGHBOUR_SIGMA && is_point(cells, cutout.fwhm_cells(), *peak) {
                    if !neighbours.contains(cells) {
                        neighbours.push(cells.clone());
                    }
                } else if touches || (near && cells.len() as f64 > 2.0 * cutout.fwhm_cells().powi(2)) {
                    cells.iter().for_each(|&(i, j)| inside[[j, i]] = true);
                }
            }
        }
    }
    // what is fainter and wider
    for (k, scale) in SCALES[..ROUND.min(cutout.scales())].iter().enumerate().skip(found.scale) {
        let mut objects = inside.clone();
        neighbours.iter().flatten().for_each(|&(i, j)| objects[[j, i]] = true);
        let mut hidden = grown(&objects, margin);
        let touching = grown(&inside, margin + scale);
        // other objects must not bleed in either
        for other in components(&snrs[k.saturating_sub(1)], OUTLINE_SIGMA + 1.0) {
            let cells = cells_of(&other, SCALES[k.saturating_sub(1)], dim);
            if !cells.iter().any(|&(i, j)| touching[[j, i]]) {
                cells.iter().for_each(|&(i, j)| hidden[[j, i]] = true);
            }
        }
        let snr = layers.significance(*scale as f64 * cutout.fwhm_cells(), *scale, Some(&hidden));
        for part in components(&snr, OUTLINE_SIGMA) {
            let cells = cells_of(&part, *scale, dim);
            let peak = peak_of(&snr, &part);
            if !(peak > JOIN_SIGMA && cells.iter().any(|&(i, j)| touching[[j, i]])) {
                continue;
            }
            if peak > JOIN_NEIGHBOUR_SIGMA || k == 0 || surrounds(&cells, &inside) {
                cells.iter().for_each(|&(i, j)| inside[[j, i]] = true);
            }
        }
    }
    let is_cut = cutout.cut_at_bound(&mut inside);
    neighbours.retain(|cells| cells.iter().any(|&(i, j)| !inside[[j, i]]));
    Segment { inside, neighbours, is_cut }
}

/// The cells of points around the target and one FWHM around each; `None` without any.
fn points_around(snr1: &Array2<f32>, inside: &Array2<bool>, fwhm: f64) -> Option<Array2<bool>> {
    let mut points = Array2::from_elem(inside.dim(), false);
    for part in components(snr1, OUTLINE_SIGMA) {
        let peak = peak_of(snr1, &part);
        let is_other =
            peak > NEIGHBOUR_SIGMA && !part.iter().any(|&(i, j)| inside[[j, i]]) && is_point(&part, fwhm, peak);
        if is_other {
            paint(&mut points, &part, 1);
        }
    }
    points.iter().any(|v| *v).then(|| grown(&points, fwhm.ceil() as usize))
}

/// The cells of a candidate.
fn seed(found: &Candidate, dim: (usize, usize)) -> Array2<bool> {
    let mut cells = Array2::from_elem(dim, false);
    paint(&mut cells, &found.pixels, SCALES[found.scale]);
    cells
}

/// Whether the middle of an outline lies in the box around the cells.
fn surrounds(cells: &[(usize, usize)], inside: &Array2<bool>) -> bool {
    let (mut n, mut x, mut y) = (0, 0, 0);
    for j in 0..inside.nrows() {
        let row = row_of(inside, j);
        if row.contains(&true) {
            for (i, _) in row.iter().enumerate().filter(|(_, v)| **v) {
                (n, x, y) = (n + 1, x + i, y + j);
            }
        }
    }
    let (x, y) = (x / n.max(1), y / n.max(1));
    let any = |on: &dyn Fn(&(usize, usize)) -> bool| cells.iter().any(on);
    any(&|c| c.0 < x) && any(&|c| c.0 > x) && any(&|c| c.1 < y) && any(&|c| c.1 > y)
}

/// The component of a wider scale that holds the target and is nearly as significant there, out to a quarter of its peak.
fn components_at(
    snr: &Array2<f32>,
    found: &Candidate,
    inside: &Array2<bool>,
    (scale, elongated): (usize, bool),
) -> Option<Vec<(usize, usize)>> {
    let (ny, nx) = inside.dim();
    let held = |part: &[(usize, usize)]| {
        part.iter().any(|&(i, j)| inside[[(j * scale + scale / 2).min(ny - 1), (i * scale + scale / 2).min(nx - 1)]])
    };
    let peaks = components(snr, FAINT_OUTLINE_SIGMA).into_iter().filter(|part| held(part));
    let part = peaks.max_by(|p, q| peak_of(snr, p).total_cmp(&peak_of(snr, q)))?;
    let peak = peak_of(snr, &part);
    if peak < EXTENDED * found.snr - 1.0 {
        return None;
    }
    let outline_frac = if elongated { OUTLINE_FRAC_ELONGATED } else { OUTLINE_FRAC };
    let level = (outline_frac * peak).max(FAINT_OUTLINE_SIGMA);
    components(snr, level).into_iter().filter(|part| held(part)).max_by_key(Vec::len)
}

fn peak_of(snr: &Array2<f32>, part: &[(usize, usize)]) -> f64 {
    part.iter().map(|&(i, j)| f64::from(snr[[j, i]])).fold(0.0, f64::max)
}

/// Whether an outline is as round and small as that of a point source of this significance.
///
/// Moffat's profile with β = 2.5, √2 FWHM wide (seen through the filter), falls to 3 σ at
/// r = FWHM/√2 √(((peak/3)^{1/β} − 1)/(2^{1/β} − 1)).
fn is_point(cells: &[(usize, usize)], fwhm: f64, peak: f64) -> bool {
    let range = |values: &mut dyn Iterator<Item = usize>| {
        let (lo, hi) = values.fold((usize::MAX, 0), |(lo, hi), v| (lo.min(v), hi.max(v)));
        (hi + 1 - lo) as f64
    };
    let (width, height) = (range(&mut cells.iter().map(|c| c.0)), range(&mut cells.iter().map(|c| c.1)));
    let falls = |to: f64| to.powf(WIDEST_BETA.recip()) - 1.0;
    let r = (0.5 * falls(peak / OUTLINE_SIGMA) / falls(2.0)).sqrt() * fwhm;
    let longest = (2.6 * r + 2.0).min(2.0 * NEIGHBOUR_SIZE_FWHM * fwhm);
    width.max(height) <= longest && width.max(height) < 1.6 * width.min(height) + 1.0
}
