//! What goes into the fit: usable measurements in a fixed order, and the columns of the terms that are fitted.
//!
//! Magnitudes. y = V_inst − V against (1, X − X̄, (B−V) − mean, (X − X_p)((B−V) − B_p)). A held term is subtracted from y; a
//! term pulled to a value by an error adds one row; a term that the stars do not determine is refused by name.

mod colours;
mod held;

use super::measurement::StarMeasurement;
use super::solve::{Matrix, N, Triangle, Vector, dot};
use super::terms::Term;
use crate::base::error::{Error, Result};
use crate::config::{self, Estimator};

/// Kasten & Young give 0.9997 at the zenith; anything lower is not an airmass.
const MIN_AIRMASS: f64 = 0.99;
/// No star has such a magnitude or colour \[mag\]: 99.999, −99.9 and the like stand for "not measured".
const SENTINEL_MAG: [f64; 2] = [60.0, 20.0];

/// More rows than this per star: stars are measured repeatedly.
const REPEATED: f64 = 1.05;
/// Most members of the smaller group of repeated stars and their pointings: the time of the fit grows with its cube, to some
/// minutes here.
const MOST_CROSSED: usize = 2000;
/// Smallest share of the variance of the colours that must be the stars' own.
const BELIEVED_SHARE: f64 = 0.1;

/// The effect of the errors of the colours on the colour term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// Share λ of the variance of the colours that is the stars' own; 1 without errors.
    pub share: f64,
    /// Relative error of λ, and so of C.
    pub rel_err: f64,
    /// Root mean square error of the colours \[mag\].
    pub err_mag: f64,
}

impl Default for Calibration {
    fn default() -> Self {
        Calibration { share: 1.0, rel_err: 0.0, err_mag: 0.0 }
    }
}

/// Index of the star of each row and the number of stars; a row without identity is a star of its own.
fn identities(stars: &[(usize, StarMeasurement)]) -> (Vec<usize>, usize) {
    let mut index = std::collections::BTreeMap::new();
    let mut n = 0;
    let of = stars
        .iter()
        .map(|(_, s)| {
            let next = s.star.map_or(n, |id| *index.entry(id).or_insert(n));
            n += usize::from(next == n);
            next
        })
        .collect();
    (of, n)
}

/// The usable measurements, sorted so that the order of the input does not matter.
#[derive(Debug, Clone)]
pub struct Rows {
    stars: Vec<(usize, StarMeasurement)>,
    /// Terms of k, C and k''.
    pub terms: [Term; 3],
    /// Mean airmass and mean colour, subtracted from the columns.
    pub mean: [f64; 2],
    /// Airmass and colour subtracted in the product column: the means, or 0 where the other term is not free, so that a
    /// pinned k or C keeps its meaning.
    product: [f64; 2],
    /// Median of V_inst − V, subtracted from y so that sums stay small.
    offset: f64,
    /// σ_inst² + σ_cat² of each row \[mag²\], unknown parts filled by the median of the known; 0 if nothing is known.
    var: Vec<f64>,
    /// σ_cat² of each row \[mag²\]: the same for all visits of a star.
    var_catalogue: Vec<f64>,
    /// Variance of the true colour of each row about its expected value \[mag²\].
    var_colour: Vec<f64>,
    /// B−V of each row weighted down by its error \[mag\] (errors in variables).
    colour: Vec<f64>,
    /// The effect of the errors of the colours.
    pub calibration: Calibration,
    /// Index of the star of each row.
    pub star_of: Vec<usize>,
    /// Different stars among the rows.
    pub n_stars: usize,
    /// Whether stars are measured repeatedly, so that the catalogue's error of a star is shared by its visits.
    pub repeated: bool,
    /// Subtracted from y: offsets of stars and clouds a fit has found \[mag\].
    pub shift: Vec<f64>,
    /// Whether rows are weighted by their errors.
    pub weighted: bool,
    /// Labels of the pointings, ascending.
    pub pointings: Vec<usize>,
    /// Index of the pointing of each row in `pointings`.
    pub group: Vec<usize>,
    /// Notes for the observer.
    pub warnings: Vec<String>,
    /// Rounds after which the fit stops.
    pub max_rounds: usize,
}

impl Rows {
    /// The usable rows of `all`. A colour may be missing only where the colour term is held at 0 and k'' is not fitted.
    ///
    /// # Errors
    /// [`Error::Zeropoint`] if too few are usable.
    pub fn select(
        all: &[StarMeasurement],
        population: &[[f64; 2]],
        terms: [Term; 3],
        config: &config::Zeropoint,
    ) -> Result<Rows> {
        let colourless = terms[1] == Term::Fixed(0.0) && terms[2].held().is_some();
        let usable = |s: &StarMeasurement| {
            let finite = [s.inst_mag, s.v_mag].iter().all(|v| v.abs() < SENTINEL_MAG[0]);
            finite
                && (s.b_v_mag.abs() < SENTINEL_MAG[1] || colourless)
                && s.airmass.is_finite()
                && s.airmass >= MIN_AIRMASS
        };
        let mut stars: Vec<(usize, StarMeasurement)> =
            all.iter().copied().enumerate().filter(|(_, s)| usable(s)).collect();
        stars.sort_by(|(_, a), (_, b)| {
            let key = |s: &StarMeasurement| {
                [s.airmass, s.b_v_mag, s.v_mag, s.inst_mag, s.inst_err_mag, s.v_err_mag, s.b_v_err_mag]
            };
            let order = key(a).iter().zip(key(b)).map(|(x, y)| x.total_cmp(&y)).find(|o| o.is_ne());
            order.unwrap_or_else(|| (a.pointing, a.star).cmp(&(b.pointing, b.star)))
        });
        let mut pointings: Vec<usize> = stars.iter().map(|(_, s)| s.pointing).collect();
        pointings.sort_unstable();
        pointings.dedup();
        let group = stars.iter().map(|(_, s)| pointings.partition_point(|p| *p < s.pointing)).collect();
        let (star_of, n_stars) = identities(&stars);
        let n = stars.len();
        let mut rows = Rows {
            stars,
            terms,
            mean: [0.0; 2],
            product: [0.0; 2],
            offset: 0.0,
            var: Vec::new(),
            var_catalogue: Vec::new(),
            var_colour: Vec::new(),
            colour: Vec::new(),
            calibration: Calibration::default(),
            star_of,
            n_stars,
            repeated: config.estimator != Estimator::Ols && n as f64 > REPEATED * n_stars as f64,
            shift: vec![0.0; n],
            weighted: false,
            pointings,
            group,
            warnings: Vec::new(),
            max_rounds: config.max_rounds,
        };
        let crossed = rows.n_stars.min(rows.pointings.len());
        if rows.repeated && crossed > MOST_CROSSED {
            return Err(Error::Zeropoint {
                problem: format!(
                    "{} stars measured repeatedly in {} pointings: the offsets of stars and pointings are fitted together \
                     for at most {MOST_CROSSED} of the fewer of the two; fit the nights apart, name the stars (`column` id) if \
                     different ones share their magnitudes, or set zeropoint.estimator = \"ols\"",
                    rows.n_stars,
                    rows.pointings.len()
                ),
            });
        }
        let lost = all.len() - rows.len();
        if lost > 0 {
            let what = "NaN, infinite or sentinel magnitude or colour, no airmass, or airmass below 0.99";
            rows.warnings.push(format!("{lost} of {} measurements were excluded: {what}", all.len()));
        }
        rows.enough(rows.len(), config.min_stars, &format!("{lost} of {} unusable (NaN)", all.len()))?;
        rows.mean = [rows.mean_of(|s| s.airmass), rows.mean_of(|s| s.b_v_mag)];
        rows.offset = super::median(&mut rows.stars.iter().map(|(_, s)| s.inst_mag - s.v_mag).collect::<Vec<_>>());
        rows.errors(config);
        rows.correct_colours(population, config);
        rows.refuse_degenerate_terms(config)?;
        Ok(rows)
    }

    /// Number of usable rows.
    pub fn len(&self) -> usize {
        self.stars.len()
    }

    /// Row `i` in the fit's own order.
    pub fn star(&self, i: usize) -> &StarMeasurement {
        &self.stars[i].1
    }

    /// Index of row `i` in the caller's order.
    pub fn input(&self, i: usize) -> usize {
        self.stars[i].0
    }

    /// Free parameters: ZP and the terms that are fitted.
    pub fn n_free(&self) -> usize {
        1 + self.terms.iter().filter(|t| matches!(t, Term::Free)).count()
    }

    /// Parameters that are fitted, freely or with a prior.
    pub fn n_fitted(&self) -> usize {
        1 + self.terms.iter().filter(|t| t.held().is_none()).count()
    }

    /// Fails if `n` stars are too few for the fit.
    pub fn enough(&self, n: usize, min_stars: usize, lost: &str) -> Result<()> {
        let need = min_stars.max(self.n_free()).max(2);
        if n >= need {
            return Ok(());
        }
        Err(Error::Zeropoint {
            problem: format!(
                "{n} usable stars ({lost}), {need} needed for {} free terms and zeropoint.min_stars = {min_stars}; \
                 take more star pointings, widen the cuts of [stars], or pin k and C",
                self.n_free()
            ),
        })
    }

    /// The columns of row `i`; 0 for a term that is not fitted.
    pub fn columns(&self, i: usize) -> Vector {
        let s = self.star(i);
        let column = |t: usize, v: f64| if self.terms[t].held().is_some() { 0.0 } else { v };
        [
            1.0,
            column(0, s.airmass - self.mean[0]),
            column(1, self.colour[i] - self.mean[1]),
            column(2, (s.airmass - self.product[0]) * (self.colour[i] - self.product[1])),
        ]
    }

    /// y of row `i` about the median, held terms subtracted \[mag\].
    pub fn y(&self, i: usize) -> f64 {
        let s = self.star(i);
        let held = |t: usize, v: f64| match self.terms[t].held() {
            Some(h) if h != 0.0 => h * (v - self.mean[t]),
            _ => 0.0,
        };
        s.inst_mag - s.v_mag - self.offset - held(0, s.airmass) - held(1, self.colour[i]) - self.shift[i]
    }

    /// The column of a term, fitted or held.
    pub fn column_of_term(&self, term: usize, i: usize) -> f64 {
        if term == 0 { self.star(i).airmass - self.mean[0] } else { self.colour[i] - self.mean[1] }
    }

    /// The same rows with offsets subtracted from y.
    pub fn shifted(&self, shift: &[f64]) -> Rows {
        Rows { shift: shift.to_vec(), ..self.clone() }
    }

    /// y − θ·columns \[mag\].
    pub fn residual(&self, i: usize, theta: &Vector) -> f64 {
        self.y(i) - dot(&self.columns(i), theta)
    }

    /// Stated variance of row `i` at the colour term of `theta`: σ_inst² + σ_cat² + (∂y/∂(B−V) σ_BV)² \[mag²\]; σ_inst²
    /// alone where stars are measured repeatedly and the rest is the star's own.
    pub fn stated_var(&self, i: usize, theta: &Vector) -> f64 {
        if self.repeated { self.var[i] } else { self.var[i] + self.colour_var(i, theta) }
    }

    /// What the catalogue's errors of magnitude and colour add to all rows of the star of row `i` \[mag²\].
    pub fn star_var(&self, i: usize, theta: &Vector) -> f64 {
        self.var_catalogue[i] + self.colour_var(i, theta)
    }

    fn colour_var(&self, i: usize, theta: &Vector) -> f64 {
        let mut c = self.terms[1].held().unwrap_or(theta[2]);
        if self.terms[2].held().is_none() {
            c += theta[3] * (self.star(i).airmass - self.product[0]);
        }
        c * c * self.var_colour[i]
    }

    /// Terms pulled to a value: column, value, error.
    pub fn priors(&self) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        self.terms.iter().enumerate().filter_map(|(t, term)| match term {
            Term::Prior(value, err) => Some((t + 1, *value, *err)),
            _ => None,
        })
    }

    /// Adds the rows of pulled terms to a fit of rows whitened by their true standard deviation.
    pub fn add_priors(&self, triangle: &mut Triangle) {
        for (t, value, err) in self.priors() {
            let mut a = [0.0; N];
            a[t] = 1.0 / err;
            triangle.add(a, value / err);
        }
    }

    /// Whether any term is pulled.
    pub fn has_prior(&self) -> bool {
        self.terms.iter().any(|t| matches!(t, Term::Prior(..)))
    }

    /// Condition number and rank of the fitted columns under weights, centred, with columns of equal length.
    pub fn condition(&self, weights: &[f64]) -> (f64, usize) {
        let total: f64 = weights.iter().sum();
        let mut mean = [0.0; N];
        for (i, w) in weights.iter().enumerate() {
            let a = self.columns(i);
            (1..N).for_each(|c| mean[c] += w * a[c] / total);
        }
        let mut triangle = Triangle::default();
        for (i, w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let a = self.columns(i);
            let held = |c: usize| self.terms[c - 1].held().is_some();
            let sqrt = w.sqrt();
            let centred = |c: usize| if c > 0 && held(c) { 0.0 } else { sqrt * (a[c] - mean[c]) };
            triangle.add(std::array::from_fn(centred), 0.0);
        }
        let solution = triangle.solve();
        (solution.condition, solution.rank)
    }

    /// The columns at the mean airmass and colour.
    pub fn centre(&self) -> Vector {
        let product = (self.mean[0] - self.product[0]) * (self.mean[1] - self.product[1]);
        [1.0, 0.0, 0.0, if self.terms[2].held().is_some() { 0.0 } else { product }]
    }

    /// Terms at airmass 0 and colour 0 and their covariance, from the centred fit:
    /// ZP = a − k X̄ − C B̄ + k'' X_p B_p, k = k_c − k'' B_p, C = C_c − k'' X_p.
    pub fn uncentred(&self, theta: &Vector, cov: &Matrix) -> (Vector, Matrix) {
        let [px, pb] = self.product;
        let value = |t: usize| self.terms[t].held().unwrap_or(theta[t + 1]);
        let (k, c, k2) = (value(0), value(1), value(2));
        let colour = if c == 0.0 { 0.0 } else { c * self.mean[1] };
        let zp = self.offset + theta[0] - k * self.mean[0] - colour + k2 * px * pb;
        let terms = [zp, k - k2 * pb, c - k2 * px, k2];
        let j = [
            [1.0, -self.mean[0], -self.mean[1], px * pb],
            [0.0, 1.0, 0.0, -pb],
            [0.0, 0.0, 1.0, -px],
            [0.0, 0.0, 0.0, 1.0],
        ];
        // Cov' = J Cov Jᵀ
        let mut out = [[0.0; N]; N];
        for a in 0..N {
            for b in a..N {
                let mut v = 0.0;
                for m in 0..N {
                    for n in 0..N {
                        v += j[a][m] * cov[m][n] * j[b][n];
                    }
                }
                // symmetric to the bit
                out[a][b] = v;
                out[b][a] = v;
            }
        }
        (terms, out)
    }

    fn mean_of(&self, value: impl Fn(&StarMeasurement) -> f64) -> f64 {
        let values = || self.stars.iter().map(|(_, s)| value(s)).filter(|v| v.is_finite());
        let n = values().count();
        if n == 0 { 0.0 } else { values().sum::<f64>() / n as f64 }
    }

    fn span(&self, value: impl Fn(&StarMeasurement) -> f64) -> f64 {
        let values = self.stars.iter().map(|(_, s)| value(s)).filter(|v| v.is_finite());
        let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        hi - lo
    }

    /// Variances with unknown parts (NaN, zero, negative) filled by the median of the known ones.
    fn errors(&mut self, config: &config::Zeropoint) {
        let fill = |value: &dyn Fn(&StarMeasurement) -> f64| {
            let known = |e: &f64| e.is_finite() && *e > 0.0;
            let mut have: Vec<f64> = self.stars.iter().map(|(_, s)| value(s)).filter(known).collect();
            let missing = self.len() - have.len();
            let typical = super::median(&mut have);
            let of = |s: &StarMeasurement| Some(value(s)).filter(known).unwrap_or(typical);
            (self.stars.iter().map(|(_, s)| of(s).powi(2)).collect::<Vec<f64>>(), missing)
        };
        let (inst, no_inst) = fill(&|s| s.inst_err_mag);
        let (cat, no_cat) = fill(&|s| s.v_err_mag);
        let (colour, _) = fill(&|s| s.b_v_err_mag);
        self.var = if self.repeated { inst } else { inst.iter().zip(&cat).map(|(a, b)| a + b).collect() };
        self.var_catalogue = cat;
        self.var_colour = colour;
        self.weighted = config.estimator != Estimator::Ols && config.weighted && self.var.iter().any(|v| *v > 0.0);
        if self.weighted {
            for (missing, what) in [(no_inst, "instrumental"), (no_cat, "catalogue")] {
                if missing > 0 {
                    let how = if missing == self.len() { "taken as 0" } else { "filled by the median of the known" };
                    self.warnings.push(format!("{missing} of {} {what} errors unknown: {how}", self.len()));
                }
            }
        }
    }
}

/// Stars per pointing from which the scatter of the pointings can be separated from that of the stars.
pub(crate) const STARS_PER_POINTING: usize = 2;

/// Whether the pointings' own scatter enters: enough stars per pointing to separate it from that of the stars.
pub fn has_pointings(rows: &Rows) -> bool {
    rows.pointings.len() > 1 && rows.len() >= STARS_PER_POINTING * rows.pointings.len()
}
