//! The fit without each star and without each pointing: errors that rely on no model, and pointings that decide alone.
//!
//! Magnitudes. Each fit without is one step of Newton from the full fit, which costs a pass over the stars for all of them
//! together. Stars of one pointing share clouds and flat-field errors; leaving out single stars does not see those.

use super::crossed::Sums;
use super::mixed::{Means, whitened};
use super::rows::Rows;
use super::solve::{Matrix, N, Triangle, Vector, dot, inverse, times};
use super::terms::Term;
use super::weights::Fit;

/// Fewest pointings for a covariance.
pub const FEWEST: usize = 5;

/// The result of the fits without one star and without one pointing.
#[derive(Debug, Clone, Default)]
pub struct Jackknife {
    /// Covariance of the centred parameters by leaving out stars.
    pub by_star: Option<Matrix>,
    /// By leaving out pointings, from at least [`FEWEST`] of them.
    pub by_pointing: Option<Matrix>,
    /// Parameters without each pointing, in the order of [`Rows::pointings`]; `None` where a term is then not determined.
    pub without: Vec<Option<Vector>>,
    /// Leverage of each row: diagonal of the hat matrix of the whitened rows; their sum is the number of terms.
    pub leverage: Vec<f64>,
    /// Pointings without which k would be another one.
    pub warnings: Vec<String>,
    /// Whether k is that of a single pointing among at least [`RESTS_AMONG`]: without it k moves by more than [`RESTS`]
    /// of its errors, and its error grows by [`RESTS_ERROR`].
    pub rests: bool,
}

/// Errors by which k moves without the pointing it rests on.
const RESTS: f64 = 8.0;
/// Below so many pointings the fits without one of them jump by chance, too.
const RESTS_AMONG: usize = 6;
/// And its error grows by so much: a fit that jumps between two sets of outliers does not.
const RESTS_ERROR: f64 = 3.0;

/// Omits each star and each pointing in turn. Cov = (n−1)/n Σ (θ₍ⱼ₎ − θ̄)(θ₍ⱼ₎ − θ̄)ᵀ.
pub fn jackknife(rows: &Rows, fit: &Fit) -> Jackknife {
    let n = rows.len();
    let mut out = Jackknife { leverage: vec![0.0; n], ..Jackknife::default() };
    let means = Means::of(rows, &fit.omega);
    let g = rows.pointings.len();
    let mut of_pointing = vec![(Triangle::default(), [0.0; N]); g];
    for i in (0..n).filter(|i| fit.omega[*i] > 0.0) {
        let (triangle, score) = &mut of_pointing[rows.group[i]];
        triangle.add(whitened(rows, i, fit.omega[i], &means, fit.tau2).0, 0.0);
        // ψ over its slope
        let push = fit.omega[i] / fit.slope * fit.sigma[i] * fit.pull(rows, i);
        let a = rows.columns(i);
        (0..N).for_each(|c| score[c] += push * a[c]);
    }
    let mut priors = Triangle::default();
    rows.add_priors(&mut priors);
    let mut information = priors.information();
    let parts: Vec<Matrix> = of_pointing.iter().map(|(t, _)| t.information()).collect();
    parts.iter().for_each(|part| add(&mut information, part, 1.0));
    let Some(bread) = inverse(&information) else { return out };
    stars(rows, fit, &means, &bread, &mut out);
    let mut shifts = Vec::new();
    for j in 0..g {
        let mut without = information;
        add(&mut without, &parts[j], -1.0);
        // a difference that is only rounding holds no information
        let possible = (0..N).all(|c| information[c][c] == 0.0 || without[c][c] > 1e-9 * information[c][c]);
        let left = inverse(&without).filter(|_| possible);
        let theta = left.map(|m| {
            let step = times(&m, &of_pointing[j].1);
            std::array::from_fn(|c| fit.theta[c] - step[c])
        });
        let p = rows.pointings[j];
        match &theta {
            // a single pointing decides everything, which is reported elsewhere
            _ if means.weight[j] == 0.0 || g == 1 => {}
            None => {
                out.warnings.push(format!("pointing {p} alone decides a term: without it k or C is not determined"))
            }
            Some(theta) => {
                out.warnings.extend(turns_k(rows, fit, &bread, theta, p));
                out.rests |= rests(rows, fit, &bread, theta, left.as_ref());
                shifts.push(*theta);
            }
        }
        out.without.push(theta);
    }
    if shifts.len() >= FEWEST && shifts.len() == means.with_weight().count() {
        out.by_pointing = Some(spread(&shifts));
    }
    out
}

/// The fits without one star, all its visits together, and without one pointing, where stars are measured repeatedly; `sums`
/// are the rows as the fit weighs them, `sds` the scatters of pointings and stars. Each is one step of Newton in the metric
/// of all rows: θ₍₋ⱼ₎ = θ − (M − Mⱼ)⁻¹ sⱼ, Mⱼ and sⱼ the parts of AᵀV⁻¹A and AᵀV⁻¹r of the omitted rows.
pub fn repeated(rows: &Rows, fit: &Fit, sums: &Sums, sds: [&[f64]; 2]) -> Jackknife {
    let n = rows.len();
    let (g, m) = (rows.pointings.len(), rows.n_stars);
    let mut out = Jackknife { leverage: vec![0.0; n], ..Jackknife::default() };
    let solved = sums.solve(sds[0], sds[1]);
    let Some(information) = inverse(&solved.cov) else { return out };
    // V⁻¹ of a column: what its own offsets leave of it
    let left: Vec<(Vec<f64>, Vec<f64>)> = (0..N)
        .map(|c| {
            let s = Sums::without_terms(rows, &fit.omega, |i| rows.columns(i)[c]).solve(sds[0], sds[1]);
            (s.pointings, s.stars)
        })
        .collect();
    let mut of_star = vec![([[0.0; N]; N], [0.0; N]); m];
    let mut of_pointing = vec![([[0.0; N]; N], [0.0; N]); g];
    for i in (0..n).filter(|i| fit.omega[*i] > 0.0) {
        let (a, p, q) = (rows.columns(i), rows.group[i], rows.star_of[i]);
        let white: Vector = std::array::from_fn(|c| fit.omega[i] * (a[c] - left[c].0[p] - left[c].1[q]));
        let r = fit.pseudo_value(rows, i) - dot(&a, &solved.theta) - solved.pointings[p] - solved.stars[q];
        out.leverage[i] = dot(&a, &times(&solved.cov, &white)).clamp(0.0, 1.0);
        for (matrix, score) in [&mut of_star[q], &mut of_pointing[p]] {
            for x in 0..N {
                score[x] += a[x] * fit.omega[i] * r;
                (0..N).for_each(|y| matrix[x][y] += 0.5 * (a[x] * white[y] + a[y] * white[x]));
            }
        }
    }
    let without = |part: &(Matrix, Vector)| -> Option<(Vector, Matrix)> {
        let mut left = information;
        add(&mut left, &part.0, -1.0);
        let possible = (0..N).all(|c| information[c][c] == 0.0 || left[c][c] > 1e-3 * information[c][c]);
        let left = inverse(&left).filter(|_| possible)?;
        let step = times(&left, &part.1);
        Some((std::array::from_fn(|c| solved.theta[c] - step[c]), left))
    };
    let stars: Option<Vec<Vector>> = of_star.iter().map(|part| Some(without(part)?.0)).collect();
    if let Some(stars) = stars.filter(|s| s.len() > rows.n_free()) {
        out.by_star = Some(spread(&stars));
    }
    for (p, part) in rows.pointings.iter().zip(&of_pointing) {
        let fitted = without(part);
        out.without.push(fitted.map(|(theta, _)| theta));
        match fitted {
            _ if g == 1 => {}
            None => {
                out.warnings.push(format!("pointing {p} alone decides a term: without it k or C is not determined"))
            }
            Some((theta, left)) => {
                out.warnings.extend(turns_k(rows, fit, &solved.cov, &theta, *p));
                out.rests |= rests(rows, fit, &solved.cov, &theta, Some(&left));
            }
        }
    }
    let pointings: Option<Vec<Vector>> = out.without.iter().copied().collect();
    if let Some(pointings) = pointings.filter(|p| p.len() >= FEWEST) {
        out.by_pointing = Some(spread(&pointings));
    }
    out
}

/// The fits without one star, and the leverages.
fn stars(rows: &Rows, fit: &Fit, means: &Means, bread: &Matrix, out: &mut Jackknife) {
    let mut cov = [[0.0; N]; N];
    let mut count = 0.0;
    for i in (0..rows.len()).filter(|i| fit.omega[*i] > 0.0) {
        let (white, _) = whitened(rows, i, fit.omega[i], means, fit.tau2);
        let h = dot(&white, &times(bread, &white)).clamp(0.0, 1.0);
        out.leverage[i] = h;
        // the offset of its pointing gives way too
        let j = rows.group[i];
        let b = means.shrink(j, fit.tau2);
        let a = rows.columns(i);
        let own: Vector = std::array::from_fn(|c| a[c] - b * means.columns[j][c]);
        let taken = (h + b * fit.omega[i] / means.weight[j]).min(0.999);
        let push = fit.omega[i] / fit.slope * fit.sigma[i] * fit.pull(rows, i) / (1.0 - taken);
        let step = times(bread, &own).map(|v| v * push);
        for (r, row) in cov.iter_mut().enumerate() {
            row.iter_mut().zip(step).for_each(|(c, s)| *c += step[r] * s);
        }
        count += 1.0;
    }
    if count > rows.n_free() as f64 {
        cov.iter_mut().flatten().for_each(|c| *c *= (count - 1.0) / count);
        out.by_star = Some(cov);
    }
}

/// A warning if leaving out one pointing moves k by more than three of its errors, or turns its sign.
fn turns_k(rows: &Rows, fit: &Fit, cov: &Matrix, without: &Vector, pointing: usize) -> Option<String> {
    if !matches!(rows.terms[0], Term::Free) {
        return None;
    }
    let (k, err, other) = (fit.theta[1], cov[1][1].max(0.0).sqrt(), without[1]);
    let turned = k * other < 0.0 && (k - other).abs() > 0.01;
    let moved = (k - other).abs() > (3.0 * err).max(0.01);
    (turned || moved).then(|| format!("k rests on pointing {pointing}: {k:.3} with it, {other:.3} without it"))
}

/// `without` and `left` are the terms and their covariance without the pointing.
fn rests(rows: &Rows, fit: &Fit, cov: &Matrix, without: &Vector, left: Option<&Matrix>) -> bool {
    let err = cov[1][1].max(0.0).sqrt();
    matches!(rows.terms[0], Term::Free)
        && rows.pointings.len() >= RESTS_AMONG
        && left.is_none_or(|left| left[1][1].max(0.0).sqrt() > RESTS_ERROR * err)
        && (fit.theta[1] - without[1]).abs() > (RESTS * err).max(0.01)
}

fn add(sum: &mut Matrix, part: &Matrix, sign: f64) {
    sum.iter_mut().flatten().zip(part.iter().flatten()).for_each(|(s, p)| *s += sign * p);
}

fn spread(thetas: &[Vector]) -> Matrix {
    let g = thetas.len() as f64;
    let mean: Vector = std::array::from_fn(|j| thetas.iter().map(|t| t[j]).sum::<f64>() / g);
    let mut cov = [[0.0; N]; N];
    for t in thetas {
        for (i, row) in cov.iter_mut().enumerate() {
            for (j, c) in row.iter_mut().enumerate() {
                *c += (g - 1.0) / g * (t[i] - mean[i]) * (t[j] - mean[j]);
            }
        }
    }
    cov
}
