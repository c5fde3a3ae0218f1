//! Offset, direction and width of the trails of a frame, and the light of each, by least squares on its pixels.
//!
//! d(u, v) = Σ Fᵢ λᵢ L(v − vᵢ(u)) E(u) + sky, λᵢ the predicted light per pixel of length, Fᵢ how much of it is there. All
//! trails at once, so that those that overlap share their light. Gauss-Newton; a quadratic stands for what is left of the
//! sky. It does not cover light that is in no catalogue, but for a clip.

use nalgebra::{DMatrix, DVector};

use super::image::TrailImage;
use super::line::LineSpread;
use super::search::LitTrail;

/// Most rounds of the fit: amplitudes alone, then everything.
const ROUNDS: usize = 8;
/// It has settled where no unknown moves by more than this \[its error\].
const SETTLED: f64 = 0.05;
/// Rounds before pixels are clipped.
const UNCLIPPED: usize = 3;
/// Pixels further from the model than this are left out \[σ\].
const CLIP_SIGMA: f64 = 5.0;
/// How well a profile can describe a trail, as a share of its light there.
const PROFILE_ERR: f64 = 0.03;
/// How much the width may differ from the expected one, as a share.
const WIDTH_PRIOR: f64 = 0.3;
/// How much the length of trails may differ from the predicted one, as a share: far less than a wrong exposure makes.
const STRETCH_PRIOR: f64 = 0.05;
/// S/N of a trail whose ends count.
const END_SNR: f64 = 5.0;
/// A trail that ends this near to the frame may end in it, where its end is not measured \[FWHM\].
const NEAR_END_FWHM: f64 = 3.0;
/// The same where no end says how the frame lies along the trails \[half the diagonal\].
const NEAR_END_HALF: f64 = 1.0;
/// Fewest ends that say where the frame lies along the trails.
pub(super) const LEAST_ENDS: usize = 3;
/// And how well they must say it \[FWHM\].
const ENDS_KNOWN_FWHM: f64 = 0.25;
/// Terms of the sky.
const SKY: usize = 6;

/// Where a fit starts, and what is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Start {
    /// Offset along the trails \[px\].
    pub along_px: f64,
    /// Whether the ends of trails say so.
    pub along_known: bool,
    /// Offset across \[px\].
    pub across_px: f64,
    /// Direction of the trails \[rad\].
    pub theta_rad: f64,
    /// Its error beforehand \[rad\].
    pub theta_err_rad: f64,
    /// FWHM of the stars \[px\].
    pub fwhm_px: f64,
    /// Moffat's exponent.
    pub beta: f64,
}

/// The light of one trail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrailLight {
    /// The star, by its number in the list.
    pub star: usize,
    /// Light over the predicted light.
    pub ratio: f64,
    /// Its error by the noise of the pixels.
    pub err: f64,
    /// Whether it starts or ends in the frame, or near its edge.
    pub ends_inside: bool,
}

/// A frame that lies on its trails.
#[derive(Debug, Clone)]
pub struct TrailFit {
    /// Offset along the trails \[px\] and its error; `None` unless at least three ends lie in the frame.
    pub along_px: Option<(f64, f64)>,
    /// Offset across \[px\] and its error.
    pub across_px: (f64, f64),
    /// Direction of the trails \[rad\] and its error.
    pub theta_rad: (f64, f64),
    /// FWHM of the trails \[px\].
    pub fwhm_px: f64,
    /// Length of the trails over the predicted length less 1, and its error; `None` without ends of both kinds.
    pub stretch: Option<(f64, f64)>,
    /// Ends in the frame of trails that stand out.
    pub n_ends: usize,
    /// χ² per pixel along the trails.
    pub chi2_px: f64,
    /// The light of each trail in the frame.
    pub lights: Vec<TrailLight>,
    /// The trails, in the order of `lights`.
    pub trails: Vec<LitTrail>,
    pub(super) shape: Shape,
    pub(super) beta: f64,
}

/// The unknowns besides the amplitudes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    across: f64,
    theta: f64,
    ln_width: f64,
    along: f64,
    stretch: f64,
    sky: [f64; SKY],
}

impl Shape {
    /// Whether the place u of a trail lies in the frame, further than `margin_px` from its edge.
    pub(super) fn end_is_inside(&self, image: &TrailImage, lit: &LitTrail, u_px: f64, margin_px: f64) -> bool {
        let (sin, cos) = self.theta.sin_cos();
        let (u, v) = (u_px + self.along, lit.trail.v_px(u_px) + self.across);
        image.holds((u * cos - v * sin, u * sin + v * cos), margin_px)
    }
}

const SHAPE: usize = 5;

/// Fits the trails of a frame; `None` where its pixels do not determine the fit.
#[must_use]
pub fn fit_trails(image: &TrailImage, trails: &[LitTrail], start: Start) -> Option<TrailFit> {
    let (across, along) = (start.across_px, start.along_px);
    let mut shape = Shape { across, theta: start.theta_rad, ln_width: 0.0, along, stretch: 0.0, sky: [0.0; SKY] };
    let mut used: Vec<LitTrail> = trails.to_vec();
    let mut amplitudes = vec![1.0; used.len()];
    let mut ends = (0, 0);
    let mut last: Option<Solved> = None;
    for round in 0..ROUNDS {
        // in the first round amplitudes alone, in the second no ends
        let free = [
            round > 0,
            round > 0,
            round > 1,
            round > 1 && start.along_known && ends.0 + ends.1 > 0,
            round > 1 && ends.0 >= 2 && ends.1 >= 2,
        ];
        let solved = solve(image, &used, &amplitudes, shape, start, free, round >= UNCLIPPED)?;
        amplitudes.copy_from_slice(&solved.amplitudes);
        shape.sky = solved.sky;
        let limit = |step: f64, most: f64| step.clamp(-most, most);
        shape.across += limit(solved.step[0], start.fwhm_px);
        shape.theta += limit(solved.step[1], start.fwhm_px / image.half_px());
        shape.ln_width = (shape.ln_width + limit(solved.step[2], 0.15)).clamp(-0.7, 0.9);
        shape.along += limit(solved.step[3], 2.0 * start.fwhm_px);
        shape.stretch = (shape.stretch + limit(solved.step[4], 0.02)).clamp(-0.3, 0.3);
        if round == 0 {
            // trails that do not touch the frame determine nothing
            let keep: Vec<bool> = solved.errs.iter().map(|e| e.is_finite() && *e < 2.0).collect();
            let mut kept = keep.iter();
            used.retain(|_| kept.next().is_some_and(|k| *k));
            amplitudes = solved.amplitudes.iter().zip(&keep).filter(|(_, k)| **k).map(|(a, _)| *a).collect();
            if used.is_empty() {
                return None;
            }
        } else {
            ends = ends_in(image, &used, &solved, shape);
            let settled = (0..SHAPE).all(|k| !free[k] || solved.step[k].abs() < SETTLED * solved.shape_err[k]);
            last = Some(solved);
            if settled && round > UNCLIPPED {
                break;
            }
        }
    }
    let solved = last?;
    let at_ends =
        start.along_known && ends.0 + ends.1 >= LEAST_ENDS && solved.shape_err[3] < ENDS_KNOWN_FWHM * start.fwhm_px;
    let n_ends = ends.0 + ends.1;
    let inflate = solved.chi2_px.max(1.0).sqrt();
    let err = |k: usize| solved.shape_err[k] * inflate;
    let margin_px = if start.along_known { NEAR_END_FWHM * start.fwhm_px } else { NEAR_END_HALF * image.half_px() };
    let lights = used.iter().zip(solved.amplitudes.iter().zip(&solved.errs));
    let lights = lights.map(|(t, (a, e))| TrailLight {
        star: t.trail.star,
        ratio: *a,
        err: e * inflate,
        ends_inside: ends_near(image, t, shape, margin_px),
    });
    Some(TrailFit {
        along_px: at_ends.then(|| (shape.along, err(3))),
        across_px: (shape.across, err(0)),
        theta_rad: (shape.theta, err(1)),
        fwhm_px: start.fwhm_px * shape.ln_width.exp(),
        stretch: (at_ends && ends.0 >= 2 && ends.1 >= 2).then(|| (shape.stretch, err(4))),
        n_ends,
        chi2_px: solved.chi2_px,
        lights: lights.collect(),
        trails: used,
        shape,
        beta: start.beta,
    })
}

impl TrailFit {
    /// Light of the trails at places (x, y) from the pixel at which the satellite is expected \[e⁻/px\].
    #[must_use]
    pub fn light_at(&self, places: &[(f64, f64)]) -> Vec<f64> {
        let line = LineSpread::new(self.fwhm_px, self.beta);
        let (sin, cos) = self.shape.theta.sin_cos();
        let at = |&(x, y): &(f64, f64)| {
            let (u, v) = (x * cos + y * sin - self.shape.along, y * cos - x * sin - self.shape.across);
            let of = |(lit, light): (&LitTrail, &TrailLight)| {
                let (start, end) = lit.trail.ends_px(self.shape.stretch);
                let off = v - lit.trail.v_px(u);
                light.ratio * lit.e_per_px * line.at(off).0 * line.along(u, off, start, end).0
            };
            self.trails.iter().zip(&self.lights).map(of).sum()
        };
        places.iter().map(at).collect()
    }
}

/// Starts and ends of bright trails in the frame.
fn ends_in(image: &TrailImage, trails: &[LitTrail], solved: &Solved, shape: Shape) -> (usize, usize) {
    let within = |lit: &LitTrail, u: f64| shape.end_is_inside(image, lit, u, 2.0);
    let bright = |k: &usize| solved.amplitudes[*k] > END_SNR * solved.errs[*k];
    let n = |of: fn(&LitTrail) -> f64| {
        (0..trails.len()).filter(bright).filter(|k| within(&trails[*k], of(&trails[*k]))).count()
    };
    (n(|t| t.trail.start_px), n(|t| t.trail.end_px))
}

/// Whether a trail starts or ends in the frame or within `margin_px` of it.
fn ends_near(image: &TrailImage, lit: &LitTrail, shape: Shape, margin_px: f64) -> bool {
    [lit.trail.start_px, lit.trail.end_px].into_iter().any(|u| shape.end_is_inside(image, lit, u, -margin_px))
}

/// One round.
pub(super) struct Solved {
    pub(super) amplitudes: Vec<f64>,
    pub(super) errs: Vec<f64>,
    sky: [f64; SKY],
    step: [f64; SHAPE],
    shape_err: [f64; SHAPE],
    chi2_px: f64,
}

/// One trail as a round needs it.
struct Prepared {
    /// Its number among the trails.
    index: usize,
    lit: LitTrail,
    start: f64,
    end: f64,
}

pub(super) fn solve(
    image: &TrailImage,
    trails: &[LitTrail],
    amplitudes: &[f64],
    shape: Shape,
    start: Start,
    free: [bool; SHAPE],
    clip: bool,
) -> Option<Solved> {
    let line = LineSpread::new(start.fwhm_px * shape.ln_width.exp(), start.beta);
    let half = image.half_px();
    let reach = line.reach_px();
    // in order across, so that a pixel finds those that reach it
    let prepare = |(index, lit): (usize, &LitTrail)| {
        let (start, end) = lit.trail.ends_px(shape.stretch);
        Prepared { index, lit: *lit, start, end }
    };
    let mut prepared: Vec<Prepared> = trails.iter().enumerate().map(prepare).collect();
    prepared.sort_by(|a, b| a.lit.trail.across[0].total_cmp(&b.lit.trail.across[0]).then(a.index.cmp(&b.index)));
    // most that a path bends away from its v at u = 0
    let bend = |t: &Prepared| half * (t.lit.trail.across[1].abs() + half * t.lit.trail.across[2].abs());
    let wide = reach + prepared.iter().map(bend).fold(0.0, f64::max);
    let n = trails.len();
    let size = n + SHAPE + SKY;
    // the upper half, row by row
    let mut upper = vec![0f64; size * size];
    let mut right = DVector::<f64>::zeros(size);
    let (sin, cos) = shape.theta.sin_cos();
    let (mut chi2, mut n_px) = (0.0, 0.0);
    // column, derivative
    let mut terms: Vec<(usize, f64)> = Vec::with_capacity(32);
    for p in &image.pixels {
        let (x, y) = (f64::from(p.x), f64::from(p.y));
        let (u, v) = (x * cos + y * sin, y * cos - x * sin);
        terms.clear();
        let mut light = 0.0;
        let mut d = [0.0; SHAPE];
        let uu = u - shape.along;
        let from = prepared.partition_point(|t| t.lit.trail.across[0] < v - shape.across - wide);
        for (i, t) in prepared.iter().enumerate().skip(from) {
            let off = v - shape.across - t.lit.trail.across[0];
            if off < -wide {
                break;
            }
            if uu < t.start - reach || uu > t.end + reach {
                continue;
            }
            let path = &t.lit.trail.across;
            let vv = off - uu * (path[1] + uu * path[2]);
            if vv.abs() > reach {
                continue;
            }
            let (l, dl) = line.at(vv);
            let (e, de_start, de_end) = line.along(uu, vv, t.start, t.end);
            if e < 1e-9 && de_start == 0.0 && de_end == 0.0 {
                continue;
            }
            let scale = t.lit.e_per_px;
            let unit = scale * l * e;
            terms.push((i, unit));
            let f = amplitudes[t.index] * scale;
            light += f * l * e;
            let slope = path[1] + 2.0 * path[2] * uu;
            // how the light changes with u, at its ends
            let du = -(de_start + de_end);
            d[0] -= f * dl * e;
            d[1] += f * (dl * e * (-u - slope * v) + l * du * v);
            d[2] -= f * (l + vv * dl) * e;
            d[3] += f * (dl * e * slope - l * du);
            let long = 0.5 * (t.lit.trail.end_px - t.lit.trail.start_px);
            d[4] += f * l * long * (de_end - de_start);
        }
        let s = [1.0, u / half, v / half, (u / half).powi(2), u * v / (half * half), (v / half).powi(2)];
        let level: f64 = s.iter().zip(&shape.sky).map(|(a, b)| a * b).sum();
        let residual = f64::from(p.above_level) - light - level;
        // the light of the trails has noise of its own
        let n_of = f64::from(p.n);
        let variance = f64::from(p.variance) + light.max(0.0) / n_of + (PROFILE_ERR * light).powi(2);
        if clip && residual * residual > CLIP_SIGMA * CLIP_SIGMA * variance {
            continue;
        }
        if !terms.is_empty() {
            chi2 += residual * residual / variance;
            n_px += 1.0;
        }
        for (k, value) in d.iter().enumerate() {
            if free[k] && *value != 0.0 {
                terms.push((n + k, *value));
            }
        }
        terms.extend(s.iter().enumerate().map(|(k, value)| (n + SHAPE + k, *value)));
        let weight = 1.0 / variance;
        // amplitudes and sky are solved anew, the shape by steps
        let target = f64::from(p.above_level);
        for (a, (i, di)) in terms.iter().enumerate() {
            let weighted = weight * di;
            right[*i] += weighted * target;
            let row = &mut upper[i * size..(i + 1) * size];
            for (j, dj) in &terms[a..] {
                row[*j] += weighted * dj;
            }
        }
    }
    let mut normal = DMatrix::from_fn(size, size, |i, j| upper[i.min(j) * size + i.max(j)]);
    let no_trail: Vec<bool> = (0..n).map(|i| normal[(i, i)] < 1e-6).collect();
    for i in 0..n {
        // far weaker than any light: a trail outside the frame must not make the rest unsolvable
        normal[(i, i)] += 1e-4;
        right[i] += 1e-4;
    }
    let priors = [0.0, start.theta_err_rad.powi(-2), WIDTH_PRIOR.powi(-2), 1e-8, STRETCH_PRIOR.powi(-2)];
    let away = [0.0, start.theta_rad - shape.theta, -shape.ln_width, 0.0, -shape.stretch];
    for k in 0..SHAPE {
        let at = n + k;
        if free[k] {
            normal[(at, at)] += priors[k];
            right[at] += priors[k] * away[k];
        } else {
            normal.row_mut(at).fill(0.0);
            normal.column_mut(at).fill(0.0);
            normal[(at, at)] = 1.0;
            right[at] = 0.0;
        }
    }
    let inverse = normal.cholesky()?.inverse();
    let solution = &inverse * &right;
    if solution.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let err = |k: usize| inverse[(k, k)].max(0.0).sqrt();
    let mut out = Solved {
        amplitudes: vec![0.0; n],
        errs: vec![0.0; n],
        sky: [0.0; SKY],
        step: [0.0; SHAPE],
        shape_err: [f64::INFINITY; SHAPE],
        chi2_px: if n_px > 0.0 { chi2 / n_px } else { 1.0 },
    };
    for (i, t) in prepared.iter().enumerate() {
        out.amplitudes[t.index] = solution[i];
        out.errs[t.index] = if no_trail[i] { f64::INFINITY } else { err(i) };
    }
    for k in 0..SKY {
        out.sky[k] = solution[n + SHAPE + k];
    }
    for k in (0..SHAPE).filter(|k| free[*k]) {
        out.step[k] = solution[n + k];
        out.shape_err[k] = err(n + k);
    }
    Some(out)
}
