//! The Moffat profile behind a stack of growth curves: exponent, width and a remaining sky, by damped least squares.
//!
//! Radii in FWHM of the stack. The sky of the curves is modelled as it was taken: with the star's own wings in it.

use std::f64::consts::PI;

use super::radial::Radial;
use super::stack::{CORE, EDGES_FWHM, FrameGrowth, N, SKY_FWHM};

/// 1/β a fit may reach: from β = 1.8 to infinity, and as far beyond, where a noisy Gaussian may fall. Wider wings would
/// put more light beyond the curve than a fit of the curve can determine.
pub(super) const Q_RANGE: [f64; 2] = [-0.5, 0.55];
/// Profile width over the width measured under a Gaussian window.
const RATIO_RANGE: [f64; 2] = [0.5, 2.0];
/// Starting values of 1/β.
const STARTS: [f64; 3] = [0.02, 0.2, 0.4];

/// A fitted profile.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fitted {
    /// 1/β.
    pub q: f64,
    /// Its error.
    pub q_err: f64,
    /// FWHM of the profile over that of the stack.
    pub ratio: f64,
    /// Its error.
    pub ratio_err: f64,
    /// Light within 1.5 FWHM, less the sky taken there, as a share of the whole.
    pub core: f64,
}

/// The rings of a model in the unit of the stack, and the light that unit stands for.
fn model(stack: &FrameGrowth, q: f64, ratio: f64, sky: f64) -> ([f64; N], f64) {
    let fwhm = stack.fwhm_px;
    let profile = Radial::new(q, ratio * fwhm);
    let level = profile.mean_between(SKY_FWHM.0 * fwhm, SKY_FWHM.1 * fwhm);
    let within = EDGES_FWHM.map(|edge| {
        let r = edge * fwhm;
        profile.enclosed_on_pixels(r) - PI * r * r * level
    });
    let core = within[CORE - 1];
    let rings = std::array::from_fn(|k| {
        let (inner, light) = if k == 0 { (0.0, within[0]) } else { (EDGES_FWHM[k - 1], within[k] - within[k - 1]) };
        light / core + sky * PI * (EDGES_FWHM[k] * EDGES_FWHM[k] - inner * inner)
    });
    (rings, core)
}

/// Residuals in units of their errors; the last is the sky's, which its own error holds at 0.
fn residuals(stack: &FrameGrowth, p: [f64; 3]) -> [f64; N + 1] {
    let (rings, _) = model(stack, p[0], p[1], p[2] * stack.sky_err);
    std::array::from_fn(|k| if k < N { (stack.rings[k] - rings[k]) / stack.err[k] } else { -p[2] })
}

fn sum_of_squares(r: &[f64; N + 1]) -> f64 {
    r.iter().map(|v| v * v).sum()
}

/// Fits 1/β, width and sky to a stack; `q` held where given. `None` where nothing finite is found.
pub(super) fn fit(stack: &FrameGrowth, held_q: Option<f64>) -> Option<Fitted> {
    let starts: Vec<f64> = held_q.map_or_else(|| STARTS.to_vec(), |q| vec![q]);
    starts
        .into_iter()
        .filter_map(|q| descend(stack, [q, 1.0, 0.0], held_q.is_some()))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, fitted)| fitted)
}

/// Levenberg's descent from `p` = (1/β, ratio, sky in units of its error); χ² and the fit.
fn descend(stack: &FrameGrowth, mut p: [f64; 3], hold_q: bool) -> Option<(f64, Fitted)> {
    let free: &[usize] = if hold_q { &[1, 2] } else { &[0, 1, 2] };
    let mut r = residuals(stack, p);
    let mut chi2 = sum_of_squares(&r);
    let mut damping = 1e-3;
    let mut normal = [[0.0; 3]; 3];
    for _ in 0..60 {
        let mut gradient = [0.0; 3];
        normal = [[0.0; 3]; 3];
        let slopes: Vec<[f64; N + 1]> = free.iter().map(|&i| slope(stack, p, i)).collect();
        for (a, &i) in free.iter().enumerate() {
            gradient[i] = slopes[a].iter().zip(&r).map(|(s, r)| s * r).sum();
            for (b, &j) in free.iter().enumerate() {
                normal[i][j] = slopes[a].iter().zip(&slopes[b]).map(|(s, t)| s * t).sum();
            }
        }
        let mut damped = normal;
        for i in 0..3 {
            damped[i][i] = if free.contains(&i) { normal[i][i] * (1.0 + damping) + 1e-12 } else { 1.0 };
        }
        let step = solve3(&damped, &gradient)?;
        let mut next = [p[0] - step[0], p[1] - step[1], p[2] - step[2]];
        next[0] = next[0].clamp(Q_RANGE[0], Q_RANGE[1]);
        next[1] = next[1].clamp(RATIO_RANGE[0], RATIO_RANGE[1]);
        let trial = residuals(stack, next);
        let value = sum_of_squares(&trial);
        if value.is_finite() && value <= chi2 {
            let gain = chi2 - value;
            (p, r, chi2) = (next, trial, value);
            damping = (damping * 0.2).max(1e-9);
            if gain < 1e-9 * (1.0 + chi2) {
                break;
            }
        } else {
            damping *= 6.0;
            if damping > 1e9 {
                break;
            }
        }
    }
    for i in 0..3 {
        if !free.contains(&i) {
            normal[i][i] = 1.0;
        }
    }
    // a poor fit means that the rings are less well known than they say
    let scale = (chi2 / (N - free.len()) as f64).max(1.0).sqrt();
    let err = |i: usize| -> Option<f64> {
        let mut unit = [0.0; 3];
        unit[i] = 1.0;
        Some(solve3(&normal, &unit)?[i].max(0.0).sqrt() * scale)
    };
    let q_err = if hold_q { 0.0 } else { err(0)? };
    let fitted = Fitted { q: p[0], q_err, ratio: p[1], ratio_err: err(1)?, core: model(stack, p[0], p[1], 0.0).1 };
    (chi2.is_finite() && fitted.q_err.is_finite() && fitted.ratio_err.is_finite()).then_some((chi2, fitted))
}

/// Derivative of the residuals by one parameter.
fn slope(stack: &FrameGrowth, p: [f64; 3], i: usize) -> [f64; N + 1] {
    let step = 1e-5;
    let (mut up, mut down) = (p, p);
    up[i] += step;
    down[i] -= step;
    let (up, down) = (residuals(stack, up), residuals(stack, down));
    std::array::from_fn(|k| (up[k] - down[k]) / (2.0 * step))
}

/// Solves a symmetric 3 × 3 system by Cramer's rule on scaled rows; `None` if singular.
fn solve3(m: &[[f64; 3]; 3], v: &[f64; 3]) -> Option<[f64; 3]> {
    let scale: [f64; 3] = std::array::from_fn(|i| m[i][i].sqrt());
    if scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let a = |i: usize, j: usize| m[i][j] / (scale[i] * scale[j]);
    let minor = |i: usize, j: usize| {
        let (r, c) = ([(i + 1) % 3, (i + 2) % 3], [(j + 1) % 3, (j + 2) % 3]);
        a(r[0], c[0]) * a(r[1], c[1]) - a(r[0], c[1]) * a(r[1], c[0])
    };
    let det: f64 = (0..3).map(|j| a(0, j) * minor(0, j)).sum();
    if !(det.abs() > 1e-13) {
        return None;
    }
    // the inverse is the transposed matrix of cofactors over the determinant
    let x = |i: usize| (0..3).map(|j| minor(j, i) * v[j] / scale[j]).sum::<f64>() / det / scale[i];
    Some(std::array::from_fn(x))
}
