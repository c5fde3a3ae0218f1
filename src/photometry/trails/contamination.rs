//! Light in the aperture that is not the target's: star trails that cross it, and point sources next to the target.
//!
//! Electrons. A trail is seen outside the aperture along its whole length, so its light inside is known far better than
//! the target's own flux. It does not cover what ends inside the aperture and is nowhere else.

use ndarray::Array2;

use crate::base::stats;
use crate::photometry::aperture::{Bounds, Shape, for_each_pixel};
use crate::photometry::smooth::Kernel;
use crate::photometry::target::cutout::Cutout;
use crate::photometry::target::placed::Placed;
use crate::photometry::trails::level::TrailLevel;
use crate::photometry::trails::model::TrailBackground;

/// Significance of a trail among the lines of an aperture: of some 30, twice, one in 50 frames by chance.
const TRAIL_SIGMA: f64 = 3.4;
/// Significance of a neighbour's own light.
const NEIGHBOUR_SIGMA: f64 = 5.0;
/// A frame counts as contaminated if the light lies at most so many errors below the threshold.
const ALLOWED_SIGMA: f64 = 1.0;

/// Light that is not the target's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Contamination {
    /// Light of trails, which has been subtracted from the flux \[e⁻\].
    pub trails_e: f64,
    /// Light of point sources, which has not been subtracted \[e⁻\].
    pub neighbours_e: f64,
    /// Error of their sum \[e⁻\].
    pub err_e: f64,
}

impl Contamination {
    /// Sum of both \[e⁻\].
    pub fn light_e(&self) -> f64 {
        self.trails_e + self.neighbours_e
    }

    /// Whether more than `share` of the flux, within the error of the light.
    pub fn exceeds(&self, share: f64, flux_e: f64) -> bool {
        self.light_e() > 0.0 && self.light_e() + ALLOWED_SIGMA * self.err_e > share * flux_e
    }
}

/// The light of the trails inside an aperture.
///
/// Per line v of cells: e(v) = level next to the aperture − base, the base being the level of the lines without a trail.
/// A trail is where e under a Gaussian of one FWHM stands out by 3.4 σ, over the whole length of the cutout or near the
/// aperture alone, or where one along the known direction was found before; its light is Σ c(v) e(v) over the lines it
/// covers, c the chord of the aperture.
pub(crate) fn of_trails(
    cutout: &Cutout,
    trail_background: &TrailBackground,
    trail_level: &TrailLevel,
    at: &Placed,
) -> Contamination {
    let cells = cutout.in_cells(at);
    let aperture = trail_background.exclusion((cells.x, cells.y), cells.shape);
    let own = trail_background.exclusion((cells.x, cells.y), cells.shape.grown(cutout.fwhm_cells()));
    let profile = trail_background.profile(&[own]);
    let base =
        base_level(&profile.iter().filter_map(|l| l.map(|l| l.mean)).collect::<Vec<_>>(), trail_background, &profile);
    // excess and its variance, over the whole length and near by
    let near: Vec<(f64, f64)> =
        trail_level.levels.iter().map(|l| (l.mean - base, trail_background.variance(l.mean) / l.n)).collect();
    let whole: Vec<(f64, f64)> = (0..trail_level.levels.len())
        .map(|k| {
            profile
                .get(trail_level.first + k)
                .copied()
                .flatten()
                .map_or(near[k], |l| (l.mean - base, trail_background.variance(l.mean) / l.n))
        })
        .collect();
    let chords: Vec<f64> = (0..trail_level.levels.len())
        .map(|k| aperture.chord(trail_background.v_of(trail_level.first + k)).map_or(0.0, |(from, to)| to - from))
        .collect();
    let kernel = Kernel::gaussian(cutout.fwhm_cells());
    let (stands_out, stands_out_near) = (matched(&whole, &kernel), matched(&near, &kernel));
    let found =
        |k: usize| cutout.trail_v.is_some_and(|v| (trail_background.v_of(trail_level.first + k) - v).abs() <= 0.5);
    let seeds: Vec<bool> =
        (0..stands_out.len()).map(|k| stands_out[k].max(stands_out_near[k]) > TRAIL_SIGMA || found(k)).collect();
    // a trail covers a FWHM on both sides of its ridge
    let reach = cutout.fwhm_cells().round() as usize;
    let covered: Vec<usize> = (0..seeds.len())
        .filter(|k| seeds[k.saturating_sub(reach)..(k + reach + 1).min(seeds.len())].iter().any(|s| *s))
        .collect();
    if !covered.iter().any(|k| chords[*k] > 0.0) {
        return Contamination::default();
    }
    let px = (cutout.net.bin * cutout.net.bin) as f64;
    let sum = |levels: &[(f64, f64)]| {
        let light: f64 = covered.iter().map(|k| chords[*k] * levels[*k].0).sum();
        let variance: f64 = covered.iter().map(|k| chords[*k].powi(2) * levels[*k].1).sum();
        (px * light, px * variance.sqrt())
    };
    let (near, whole) = (sum(&near), sum(&whole));
    // the whole length knows better, unless the trail is not the same near by
    let (light, err) = if (near.0 - whole.0).abs() < 2.5 * near.1 { whole } else { near };
    Contamination { trails_e: light.max(0.0), neighbours_e: 0.0, err_e: err }
}

/// The level of the lines without a trail: from the lowest third upwards, what agrees within its noise.
fn base_level(
    means: &[f64],
    trail_background: &TrailBackground,
    profile: &[Option<crate::photometry::trails::model::Level>],
) -> f64 {
    let mut sorted = means.to_vec();
    let Some(mut base) = stats::quantile(&mut sorted, 0.3) else { return 0.0 };
    for _ in 0..10 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for l in profile.iter().flatten() {
            let variance = trail_background.variance(0.0) / l.n;
            if (l.mean - base).powi(2) < 4.0 * variance {
                sum += l.n * l.mean;
                weight += l.n;
            }
        }
        if weight <= 0.0 {
            break;
        }
        base = sum / weight;
    }
    base
}

/// Significance of levels with their variances under a kernel.
fn matched(levels: &[(f64, f64)], kernel: &Kernel) -> Vec<f64> {
    let taps = kernel.taps();
    let r = taps.len() / 2;
    (0..levels.len())
        .map(|k| {
            let (mut sum, mut variance) = (0.0, 0.0);
            for (t, w) in taps.iter().enumerate() {
                if let Some((e, v)) = (k + t).checked_sub(r).and_then(|q| levels.get(q)) {
                    sum += f64::from(*w) * e;
                    variance += f64::from(*w).powi(2) * v;
                }
            }
            if variance > 0.0 { sum / variance.sqrt() } else { 0.0 }
        })
        .collect()
}

/// The light, inside the aperture of the target, of point sources next to it.
///
/// Each in a circle of one FWHM about its peak, over the median of the ring around (1.3 to 1.8 FWHM), counted where it
/// lies inside the aperture; a Gaussian has 15/16 of its light there. `net` = pixels less sky and trails, from
/// (`x0`, `y0`) of the cutout on.
pub(crate) fn of_neighbours(
    cutout: &Cutout,
    neighbours: &[Vec<(usize, usize)>],
    at: &Placed,
    (net, (x0, y0)): (&Array2<f32>, (usize, usize)),
) -> Contamination {
    let residual = cutout.residual();
    let (ny, nx) = net.dim();
    let bounds = Bounds { x0: 0, x1: nx, y0: 0, y1: ny };
    let mut out = Contamination::default();
    for cells in neighbours {
        let Some(&(i, j)) = cells.iter().max_by(|p, q| residual[[p.1, p.0]].total_cmp(&residual[[q.1, q.0]])) else {
            continue;
        };
        let (x, y) = (cutout.net.to_px(i as f64) - x0 as f64, cutout.net.to_px(j as f64) - y0 as f64);
        let fwhm = cutout.fwhm_px;
        let mut ring = Vec::new();
        let ring_shape = Shape::Circle { r_px: 1.8 * fwhm };
        for_each_pixel(&ring_shape, x, y, bounds, |i, j, _| {
            if (i as f64 - x).hypot(j as f64 - y) > 1.3 * fwhm {
                ring.push(f64::from(net[[j, i]]));
            }
        });
        let level = stats::median(&mut ring).unwrap_or(0.0);
        let (mut light, mut area) = (0.0, 0.0);
        for_each_pixel(&Shape::Circle { r_px: fwhm }, x, y, bounds, |i, j, f| {
            let (dx, dy) = (i as f64 + x0 as f64 - at.x, j as f64 + y0 as f64 - at.y);
            let v = f64::from(net[[j, i]]) - level;
            if at.shape.contains(dx, dy) && v.is_finite() {
                light += f * v;
                area += f;
            }
        });
        let err = (area * cutout.rms_e.powi(2) + light.max(0.0)).sqrt();
        if light > NEIGHBOUR_SIGMA * err {
            out.neighbours_e += light * 16.0 / 15.0;
            out.err_e = out.err_e.hypot(err);
        }
    }
    out
}
