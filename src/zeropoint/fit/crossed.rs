//! The mixed model behind the errors: terms, an offset per pointing and, where stars are measured repeatedly, one per star.
//!
//! Magnitudes. y_i = a_i·θ + u_p(i) + s_q(i) + e_i with u of variance σ_p², s of variance σ_q² (the catalogue's error of a
//! star is the same in all of its visits) and e of variance 1/ω_i. Solved by Henderson's equations (1975, Biometrics 31,
//! 423) for θ, u/σ_p and s/σ_q; the larger of the two groups is diagonal and eliminated, so the dense system has as many
//! rows as there are terms and members of the smaller group. Gives the restricted likelihood of the two scatters too.

use super::rows::Rows;
use super::solve::{Matrix, N, Vector};

/// Pivots below this share of their diagonal have no information.
const NO_PIVOT: f64 = 1e-12;

/// Weighted sums of one pointing or one star.
#[derive(Debug, Clone, Default)]
struct WeightedSum {
    /// Σ ω.
    weight: f64,
    /// Σ ω a.
    columns: Vector,
    /// Σ ω y.
    y: f64,
    /// Members of the other group that share rows, with Σ ω.
    links: Vec<(usize, f64)>,
}

/// All that is needed of the rows, once their precisions are settled.
#[derive(Debug, Clone)]
pub struct Sums {
    information: Matrix,
    score: Vector,
    squares: f64,
    pointings: Vec<WeightedSum>,
    stars: Vec<WeightedSum>,
}

/// The solution for given scatters.
#[derive(Debug, Clone)]
pub struct Solved {
    /// Terms.
    pub theta: Vector,
    /// Their covariance, the offsets of pointings and stars included.
    pub cov: Matrix,
    /// Offsets of the pointings \[mag\].
    pub pointings: Vec<f64>,
    /// Offsets of the stars \[mag\].
    pub stars: Vec<f64>,
    /// Restricted log-likelihood of the scatters, up to a constant.
    pub log_likelihood: f64,
}

impl Sums {
    /// The sums of rows with precisions `omega` \[1/mag²\] and values `y` \[mag\].
    pub fn of(rows: &Rows, omega: &[f64], y: impl Fn(usize) -> f64) -> Sums {
        let mut out = Sums::with_columns(rows, omega, y, |i| rows.columns(i));
        for (t, value, err) in rows.priors() {
            out.information[t][t] += 1.0 / (err * err);
            out.score[t] += value / (err * err);
            out.squares += (value / err).powi(2);
        }
        out
    }

    /// The sums of rows whose values are those of another column: how the terms answer to its coefficient. Pulled terms
    /// are pulled to 0.
    pub fn slope(rows: &Rows, omega: &[f64], column: impl Fn(usize) -> f64) -> Sums {
        let mut out = Sums::with_columns(rows, omega, column, |i| rows.columns(i));
        rows.priors().for_each(|(t, _, err)| out.information[t][t] += 1.0 / (err * err));
        out
    }

    /// The sums for offsets alone, without terms.
    pub fn without_terms(rows: &Rows, omega: &[f64], y: impl Fn(usize) -> f64) -> Sums {
        Sums::with_columns(rows, omega, y, |_| [0.0; N])
    }

    fn with_columns(rows: &Rows, omega: &[f64], y: impl Fn(usize) -> f64, columns: impl Fn(usize) -> Vector) -> Sums {
        let stars = if rows.repeated { rows.n_stars } else { 0 };
        let mut out = Sums {
            information: [[0.0; N]; N],
            score: [0.0; N],
            squares: 0.0,
            pointings: vec![WeightedSum::default(); rows.pointings.len()],
            stars: vec![WeightedSum::default(); stars],
        };
        for (i, w) in omega.iter().copied().enumerate().filter(|(_, w)| *w > 0.0) {
            let (a, value) = (columns(i), y(i));
            for r in 0..N {
                out.score[r] += w * a[r] * value;
                (0..N).for_each(|c| out.information[r][c] += w * a[r] * a[c]);
            }
            out.squares += w * value * value;
            let (p, q) = (rows.group[i], rows.star_of[i]);
            out.pointings[p].add(w, &a, value, (stars > 0).then_some(q));
            if stars > 0 {
                out.stars[q].add(w, &a, value, Some(p));
            }
        }
        out
    }

    /// Σ ω of a pointing.
    pub fn weight_of_pointing(&self, p: usize) -> f64 {
        self.pointings[p].weight
    }

    /// Mean of y − a·θ over a star's rows, given the offsets of the pointings, and its weight.
    pub fn star_residual(&self, q: usize, theta: &Vector, pointings: &[f64]) -> (f64, f64) {
        let s = &self.stars[q];
        let known = super::solve::dot(&s.columns, theta) + s.links.iter().map(|(p, w)| w * pointings[*p]).sum::<f64>();
        ((s.y - known) / s.weight.max(f64::MIN_POSITIVE), s.weight)
    }

    /// Mean of y − a·θ over a pointing's rows, given the offsets of the stars, and its weight.
    pub fn pointing_residual(&self, p: usize, theta: &Vector, stars: &[f64]) -> (f64, f64) {
        let s = &self.pointings[p];
        let linked = if stars.is_empty() { 0.0 } else { s.links.iter().map(|(q, w)| w * stars[*q]).sum::<f64>() };
        let known = super::solve::dot(&s.columns, theta) + linked;
        ((s.y - known) / s.weight.max(f64::MIN_POSITIVE), s.weight)
    }

    /// Solves for the terms and offsets; `sd_pointing` and `sd_star` are the scatters of each pointing and star \[mag\].
    pub fn solve(&self, sd_pointing: &[f64], sd_star: &[f64]) -> Solved {
        let stars_dense = self.stars.len() <= self.pointings.len();
        let (dense, sparse, sd_dense, sd_sparse) = if stars_dense {
            (&self.stars, &self.pointings, sd_star, sd_pointing)
        } else {
            (&self.pointings, &self.stars, sd_pointing, sd_star)
        };
        let d = N + dense.len();
        let mut m = vec![0.0; d * d];
        let mut rhs = vec![0.0; d];
        for r in 0..N {
            rhs[r] = self.score[r];
            m[r * d..r * d + N].copy_from_slice(&self.information[r]);
        }
        for (k, s) in dense.iter().enumerate() {
            let (row, sd) = (N + k, sd_dense[k]);
            m[row * d + row] = 1.0 + sd * sd * s.weight;
            (0..N).for_each(|c| m[row * d + c] = sd * s.columns[c]);
            rhs[row] = sd * s.y;
        }
        let (mut log_det, mut explained) = (0.0, 0.0);
        let mut entries: Vec<(usize, f64)> = Vec::new();
        for (s, sd) in sparse.iter().zip(sd_sparse).filter(|(s, sd)| s.weight > 0.0 && **sd > 0.0) {
            let pivot = 1.0 + sd * sd * s.weight;
            entries.clear();
            entries.extend((0..N).map(|c| (c, sd * s.columns[c])));
            if !dense.is_empty() {
                entries.extend(s.links.iter().map(|(k, w)| (N + k, sd * sd_dense[*k] * w)));
            }
            let value = sd * s.y;
            // links are sorted, so the lower triangle is filled
            for (n, (r, a)) in entries.iter().enumerate() {
                rhs[*r] -= a * value / pivot;
                let share = a / pivot;
                for (c, b) in &entries[..=n] {
                    m[r * d + c] -= share * b;
                }
            }
            log_det += pivot.ln();
            explained += value * value / pivot;
        }
        let fitted: [bool; N] = std::array::from_fn(|c| self.information[c][c] > 0.0);
        for c in (0..N).filter(|c| !fitted[*c]) {
            (0..d).for_each(|r| {
                m[r * d + c] = 0.0;
                m[c * d + r] = 0.0;
            });
            m[c * d + c] = 1.0;
            rhs[c] = 0.0;
        }
        log_det += factor(&mut m, d);
        let mut x = rhs.clone();
        forward(&m, d, &mut x);
        explained += x.iter().map(|v| v * v).sum::<f64>();
        backward(&m, d, &mut x);
        let mut cov = [[0.0; N]; N];
        for c in (0..N).filter(|c| fitted[*c]) {
            let mut unit = vec![0.0; d];
            unit[c] = 1.0;
            forward(&m, d, &mut unit);
            backward(&m, d, &mut unit);
            (0..N).filter(|r| fitted[*r]).for_each(|r| cov[r][c] = unit[r]);
        }
        let theta: Vector = std::array::from_fn(|c| if fitted[c] { x[c] } else { 0.0 });
        let of_dense: Vec<f64> = (0..dense.len()).map(|k| sd_dense[k] * x[N + k]).collect();
        let of_sparse = sparse
            .iter()
            .zip(sd_sparse)
            .map(|(s, sd)| {
                let known = super::solve::dot(&s.columns, &theta)
                    + if dense.is_empty() { 0.0 } else { s.links.iter().map(|(k, w)| w * of_dense[*k]).sum::<f64>() };
                sd * sd * (s.y - known) / (1.0 + sd * sd * s.weight)
            })
            .collect();
        let log_likelihood = -0.5 * (log_det + (self.squares - explained).max(0.0));
        let (pointings, stars) = if stars_dense { (of_sparse, of_dense) } else { (of_dense, of_sparse) };
        Solved { theta, cov, pointings, stars, log_likelihood }
    }
}

impl WeightedSum {
    fn add(&mut self, w: f64, a: &Vector, y: f64, other: Option<usize>) {
        self.weight += w;
        self.y += w * y;
        (0..N).for_each(|c| self.columns[c] += w * a[c]);
        if let Some(k) = other {
            match self.links.binary_search_by_key(&k, |l| l.0) {
                Ok(at) => self.links[at].1 += w,
                Err(at) => self.links.insert(at, (k, w)),
            }
        }
    }
}

/// Cholesky factor L in place of the lower triangle; ln det. A direction without information gets an infinite pivot: its
/// part of the solution is 0.
fn factor(m: &mut [f64], d: usize) -> f64 {
    let mut log_det = 0.0;
    for j in 0..d {
        let diagonal = m[j * d + j];
        let (above, below) = m.split_at_mut((j + 1) * d);
        let row_j = &mut above[j * d..j * d + j + 1];
        let pivot = diagonal - row_j[..j].iter().map(|v| v * v).sum::<f64>();
        let l = if pivot > NO_PIVOT * diagonal && diagonal > 0.0 { pivot.sqrt() } else { f64::INFINITY };
        row_j[j] = l;
        if l.is_finite() {
            log_det += 2.0 * l.ln();
        }
        let row_j = &above[j * d..j * d + j];
        for row in below.chunks_exact_mut(d) {
            let dot: f64 = row[..j].iter().zip(row_j).map(|(a, b)| a * b).sum();
            row[j] = (row[j] - dot) / l;
        }
    }
    log_det
}

fn forward(m: &[f64], d: usize, x: &mut [f64]) {
    for r in 0..d {
        let dot: f64 = m[r * d..r * d + r].iter().zip(&x[..r]).map(|(a, b)| a * b).sum();
        x[r] = (x[r] - dot) / m[r * d + r];
    }
}

fn backward(m: &[f64], d: usize, x: &mut [f64]) {
    for r in (0..d).rev() {
        x[r] /= m[r * d + r];
        let v = x[r];
        for c in 0..r {
            x[c] -= m[r * d + c] * v;
        }
    }
}
