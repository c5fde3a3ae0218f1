//! Zeropoint, extinction and colour term from catalogue stars: V = V_inst − ZP − k X − C (B−V) \[− k'' X (B−V)\].
//!
//! V_inst = −2.5 log10(electrons per second); magnitudes throughout. Fitted centred on the mean airmass and colour by
//! orthogonal factors with an offset for every pointing, reported at airmass 0 and colour 0 with the full covariance. Left
//! out: drifts in time within a pointing; cuts on stars are the caller's.

mod clouds;
mod crossed;
mod file;
mod jackknife;
mod marginal;
mod measurement;
mod median;
mod mixed;
mod noise;
mod pointings;
mod repeated;
mod report;
mod robust;
mod rows;
mod solve;
mod start;
mod terms;
mod weights;
mod zeropoint;

use median::median;
pub use zeropoint::Zeropoint;

pub use measurement::StarMeasurement;
use zeropoint::negative_k;

use crate::base::error::{Error, Result};
use crate::base::stats;
use crate::config::{self, Estimator};
pub use file::NO_ZEROPOINT;
pub use pointings::Pointing;
use rows::Rows;
use terms::Term;

/// Fits ZP, k, C and, if requested, k''.
///
/// `robust`: a start that outliers cannot spoil, then Tukey's biweight to convergence; `clip`: median start, then a 3 σ clip;
/// `huber`: Huber's weights. All three weigh by σ_inst² + σ_cat² + (C σ_BV)² + τ², τ by maximum likelihood, and give every
/// pointing an offset drawn from a common scatter, so that many stars under one cloud count as one pointing.
/// `ols`: equal weights, s² (AᵀA)⁻¹. The result does not depend on the order of the rows, to the bit.
///
/// # Errors
/// [`Error::Zeropoint`] with counts: too few stars, no usable row, no clear majority of stars agrees.
pub fn fit(measurements: &[StarMeasurement], config: &config::Zeropoint) -> Result<Zeropoint> {
    fit_among(measurements, &[], config)
}

/// As [`fit`], of stars chosen from a `population` by their colour: B−V and its error \[mag\] of all of them. A cut on measured
/// colours narrows them, and how far an error of a colour misleads depends on what was there before the cut.
///
/// # Errors
/// As [`fit`].
pub fn fit_among(
    measurements: &[StarMeasurement],
    population: &[[f64; 2]],
    config: &config::Zeropoint,
) -> Result<Zeropoint> {
    let second = if config.second_order { Term::Free } else { Term::Absent };
    let terms = [Term::of(config.pin_k), Term::of(config.pin_c), second];
    let mut rows = Rows::select(measurements, population, terms, config)?;
    let mut zeropoint = fit_rows(&rows, config, measurements.len())?;
    let (k, err) = (zeropoint.k_mag_airmass, zeropoint.errs()[1]);
    if k < 0.0 && -k > err && rows.terms[0] == Term::Free && !zeropoint.second_order() {
        rows.hold(0, config.k_prior, format!("the stars give {k:.3} +- {err:.3}, and air does not brighten stars"));
        zeropoint = fit_rows(&rows, config, measurements.len())?;
    }
    zeropoint.warnings.extend(negative_k(zeropoint.k_mag_airmass, zeropoint.errs()[1]));
    Ok(zeropoint)
}

/// The fit of rows whose terms are decided.
fn fit_rows(rows: &Rows, config: &config::Zeropoint, n_input: usize) -> Result<Zeropoint> {
    if config.estimator == Estimator::Ols {
        return Ok(report::report(rows, &robust::ols(rows)?, None, config, n_input));
    }
    let fit = robust::reweighted(rows, config.estimator, config)?;
    if config.estimator == Estimator::Huber {
        // Huber's weights reject nobody and follow a majority of outliers: the biweight shows whether there is one
        check_majority(rows, &robust::reweighted(rows, Estimator::Robust, config)?, config)?;
    }
    check_majority(rows, &fit, config)?;
    let rejected = fit.weights.iter().filter(|w| **w == 0.0).count();
    rows.enough(rows.len() - rejected, config.min_stars, &format!("{rejected} rejected as outliers"))?;
    let (cleared, fit, clouds) = without_clouds(rows, fit, config)?;
    Ok(report::report(&cleared, &fit, clouds.as_ref(), config, n_input))
}

/// Rounds of finding clouds and fitting without them.
const CLOUD_ROUNDS: usize = 3;

/// The rows with the expected clouds subtracted and their fit, where some pointings are more likely than not under clouds;
/// else the rows and the fit as they are.
fn without_clouds(
    rows: &Rows,
    fit: weights::Fit,
    config: &config::Zeropoint,
) -> Result<(Rows, weights::Fit, Option<clouds::Clouds>)> {
    let search_clouds = |rows: &Rows, fit: &weights::Fit, taken: &[f64]| {
        let sums = fit.sums(rows);
        let stars = fit.offsets_of_stars(rows);
        let one = |p: usize| {
            let (d, w) = sums.pointing_residual(p, &fit.theta, &stars);
            (d + taken.get(p).copied().unwrap_or(0.0), w.recip())
        };
        let (d, v): (Vec<f64>, Vec<f64>) = (0..rows.pointings.len()).map(one).unzip();
        clouds::find(&d, &v)
    };
    let first = if rows::has_pointings(rows) { search_clouds(rows, &fit, &[]) } else { None };
    let Some(mut found) = first else { return Ok((rows.clone(), fit, None)) };
    if !found.likely() {
        return Ok((rows.clone(), fit, Some(found)));
    }
    let mut out = (rows.clone(), fit);
    for _ in 0..CLOUD_ROUNDS {
        let shift: Vec<f64> = rows.group.iter().map(|p| found.mean_mag[*p]).collect();
        let cleared = rows.shifted(&shift);
        let fit = robust::reweighted(&cleared, config.estimator, config)?;
        let next = search_clouds(&cleared, &fit, &found.mean_mag);
        out = (cleared, fit);
        let Some(next) = next.filter(clouds::Clouds::likely) else { break };
        found = next;
    }
    Ok((out.0, out.1, Some(found)))
}

/// Standard errors of the share of outliers within which a majority is uncertain, and the most they may take.
const MARGIN: (f64, f64) = (2.0, 0.1);
/// Rejected stars that agree with one another as well as this share of the good ones are a rival.
const RIVAL: f64 = 0.5;

/// Fails unless a majority of good stars is certain: otherwise the fit may be that of the bad ones.
fn check_majority(rows: &Rows, fit: &weights::Fit, config: &config::Zeropoint) -> Result<()> {
    if config.estimator == Estimator::Ols {
        return Ok(());
    }
    let n = rows.len() as f64;
    let rejected = fit.weights.iter().filter(|w| **w == 0.0).count();
    // blends hide among the good stars: the likelihood counts them too, where there are enough stars for it
    let hidden = if rows.len() < start::FEW { 0.0 } else { fit.outlier_share };
    let share = hidden.max(rejected as f64 / n);
    // visits of one star fail together
    let independent = if rows.repeated { rows.n_stars as f64 } else { n };
    let margin = (MARGIN.0 * (share * (1.0 - share) / independent).sqrt()).min(MARGIN.1);
    let agree = agreeing(rows, fit);
    let rival = agree as f64 > RIVAL * (n - rejected as f64) && rows.len() >= start::FEW;
    if !rival && share + margin <= config.max_rejected_frac.max(0.0) || config.max_rejected_frac >= 1.0 {
        return Ok(());
    }
    let why = if rival {
        format!(", and {agree} of the rejected agree with one another")
    } else {
        format!(
            ", +- {margin:.2} at {} sigma, exceeds zeropoint.max_rejected_frac = {}",
            MARGIN.0, config.max_rejected_frac
        )
    };
    Err(Error::Zeropoint {
        problem: format!(
            "{rejected} of {} stars rejected and {:.2} of all estimated to be outliers{why}: no majority agrees beyond \
             doubt, so the fit could be that of the outliers (zeropoint.max_rejected_frac); check the match, clouds and \
             saturation",
            rows.len(),
            share,
        ),
    })
}

/// The most rejected stars whose residuals lie within ±2.5 σ of one value.
fn agreeing(rows: &Rows, fit: &weights::Fit) -> usize {
    let residual = |i: usize| rows.residual(i, &fit.theta) - fit.offsets[rows.group[i]];
    let out = (0..rows.len()).filter(|i| fit.weights[*i] == 0.0);
    let mut list: Vec<(f64, f64)> = out.map(|i| (residual(i), fit.sigma[i])).collect();
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    let width = 5.0 * median(&mut list.iter().map(|l| l.1).collect::<Vec<_>>());
    let (mut from, mut most) = (0, 0);
    for to in 0..list.len() {
        while list[to].0 - list[from].0 > width {
            from += 1;
        }
        most = most.max(to + 1 - from);
    }
    most
}
