//! From a converged fit to the zeropoint: the covariance that is quoted, the diagnostics, the warnings.
//!
//! Quoted is the larger of the jackknives by star and by pointing. On the geometry of the paper it holds the truth in 68 to
//! 70 % of nights with pointings that scatter by 0.03 or 0.10 mag, in 72 % with none (`scripts/prove_zeropoint.sh`). The
//! model with an offset per pointing agrees within 2 % and stands in where no jackknife can be made.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::clouds::Clouds;
use super::crossed::Sums;
use super::jackknife::{Jackknife, jackknife, repeated};
use super::marginal::{Prior, Problem, Quoted, SHARES, TOLD_BY, quantile};
use super::pointings::{Pointings, pointings};
use super::rows::Rows;
use super::solve::{Matrix, Vector, quadratic};
use super::stats;
use super::terms::Term;
use super::weights::Fit;
use super::zeropoint::Zeropoint;
use crate::config::{self, Estimator};

/// χ² per degree of freedom below which the stated errors are questioned.
const CHI2_SMALL: f64 = 0.25;
/// Condition number above which the observer is warned.
const CONDITION_WARN: f64 = 30.0;
/// Share of rejected measurements above which the observer is warned.
const REJECTED_WARN: f64 = 0.2;
/// Fewest degrees of freedom of a jackknife.
const FEWEST_DOF: usize = 10;
/// A jackknife this many times the other estimates has jumped.
const JUMP: f64 = 2.0;

/// Puts a converged fit into the form the rest of the night uses; `clouds` have been taken out of the rows where they are
/// used; otherwise they widen the error.
pub fn report(
    all: &Rows,
    whole: &Fit,
    clouds: Option<&Clouds>,
    config: &config::Zeropoint,
    n_input: usize,
) -> Zeropoint {
    let suspected_mag = clouds.filter(|c| !c.likely()).map_or(0.0, |c| c.suspected_mag);
    let clouds = clouds.filter(|c| c.likely());
    let inference = Inference::of(all, whole, clouds, suspected_mag, config);
    // from here on the rows have the offsets of their stars taken out
    let shift: Vec<f64> = all.shift.iter().zip(&whole.star_offset).map(|(a, b)| a + b).collect();
    let (rows, fit) = (&all.shifted(&shift), &whole.without_star_offsets());
    let jack = if all.repeated {
        repeated(all, whole, &inference.sums, [&inference.sds[0], &inference.sds[1]])
    } else {
        jackknife(rows, fit)
    };
    // the pointings as they are, clouds and all
    let mut offsets = fit.offsets.clone();
    if let Some(clouds) = clouds {
        offsets.iter_mut().zip(&clouds.mean_mag).for_each(|(u, mean)| *u += mean);
    }
    let seen = pointings(&all.shifted(&whole.star_offset), &Fit { offsets, ..fit.clone() });
    let mut warnings = rows.warnings.clone();
    let g = seen.list.len();
    if config.estimator != Estimator::Ols && g < TOLD_BY && matches!(inference.prior, Prior::Site(_)) {
        let prior =
            format!("prior of {} mag (zeropoint.pointing_scatter_prior_mag)", config.pointing_scatter_prior_mag);
        warnings.push(if g == 1 {
            format!("one pointing: how much pointings scatter is not measured, and a {prior} is in the error")
        } else {
            format!("{g} pointings: too few to know their scatter well, so a {prior} is in the error")
        });
    }
    warnings.extend(clouds.map(|c| cloud_text(c, rows)));
    if config.estimator == Estimator::Ols && (rows.len() as f64) > 1.05 * rows.n_stars as f64 {
        warnings.push(format!(
            "{} measurements of {} stars are taken as independent by ordinary least squares: the errors are too small; \
             zeropoint.estimator = \"robust\" has an effect per star",
            rows.len(),
            rows.n_stars
        ));
    }
    let (quoted, jack, cov_note) = quote(rows, jack, &seen, &inference, config, &mut warnings);
    warnings.extend(jack.warnings.iter().chain(&seen.warnings).cloned());

    let used: Vec<usize> = (0..rows.len()).filter(|i| fit.weights[*i] > 0.0).collect();
    let residuals: Vec<f64> = (0..rows.len()).map(|i| rows.residual(i, &fit.theta) + rows.shift[i]).collect();
    let (condition, rank) = rows.condition(&fit.weights);
    if condition > CONDITION_WARN {
        warnings.push(format!(
            "condition number {condition:.0}: airmass and colour hardly vary apart; pin a term or spread the pointings"
        ));
    }
    let rejected = rows.len() - used.len();
    if rejected as f64 > REJECTED_WARN * rows.len() as f64 {
        warnings.push(format!("{rejected} of {} measurements rejected as outliers", rows.len()));
    }
    let range = |f: &dyn Fn(usize) -> f64| {
        let values = used.iter().map(|i| f(*i)).filter(|v| v.is_finite());
        let range = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)]);
        if range[0] <= range[1] { range } else { [f64::NAN; 2] }
    };
    let b_v_range_mag = range(&|i| rows.star(i).b_v_mag);
    let (chi2_dof, p_value) = chi2(all, &used, fit);
    if let Some(small) = chi2_dof.filter(|c| *c < CHI2_SMALL) {
        warnings.push(format!(
            "chi2/dof {small:.2}: the stars scatter far less than their stated errors, and the quoted error follows the \
             scatter; are the stated errors too large, or rows repeated?"
        ));
    }
    let uncentre = |m: &Matrix| rows.uncentred(&fit.theta, m).1;
    let (terms, cov) = rows.uncentred(&fit.theta, &quoted.cov);
    let [zp_mag, k_mag_airmass, c_mag_mag, k2_mag] = terms;
    let mut out = Zeropoint {
        zp_mag,
        k_mag_airmass,
        c_mag_mag,
        k2_mag,
        cov,
        cov_95: uncentre(&quoted.cov_95),
        cov_model: uncentre(&inference.model.cov),
        cov_star_jackknife: jack.by_star.as_ref().map(uncentre),
        cov_pointing_jackknife: jack.by_pointing.as_ref().map(uncentre),
        estimator: name(config.estimator).to_owned(),
        n_used: used.len(),
        n_stars: {
            let mut stars: Vec<usize> = used.iter().map(|i| rows.star_of[*i]).collect();
            stars.sort_unstable();
            stars.dedup();
            stars.len()
        },
        n_rejected: rejected,
        n_pointings: seen.list.iter().filter(|p| p.n_used > 0).count(),
        rms_mag: (used.iter().map(|i| residuals[*i].powi(2)).sum::<f64>() / used.len() as f64).sqrt(),
        robust_sigma_mag: stats::mad_sigma(&mut residuals.clone()).unwrap_or(0.0),
        intrinsic_mag: fit.intrinsic_mag,
        star_scatter_mag: if rows.repeated { inference.star_scatter_mag } else { f64::NAN },
        pointing_scatter_mag: seen.scatter_mag.unwrap_or(f64::NAN),
        line_of_sight_mag: inference.line_of_sight_mag(&seen),
        colour_share: rows.calibration.share,
        pointing_chi2_dof: seen.chi2_dof,
        pointing_p_value: seen.p_value,
        chi2_dof,
        p_value,
        condition,
        rank,
        airmass_mean: rows.mean[0],
        b_v_mean_mag: if b_v_range_mag[0].is_nan() { f64::NAN } else { rows.mean[1] },
        airmass_range: range(&|i| rows.star(i).airmass),
        b_v_range_mag,
        mjd_mean_d: None,
        band: None,
        colour: None,
        light: None,
        k_note: rows.terms[0].note(),
        c_note: rows.terms[1].note(),
        k2_note: second_order(rows, fit, &inference.at_scatters, used.len()),
        cov_note,
        target_b_v_mag: config.target_colour(None),
        pointings: seen.list,
        warnings,
        weights: vec![0.0; n_input],
        residuals_mag: vec![f64::NAN; n_input],
        leverage: vec![0.0; n_input],
    };
    for (i, r) in residuals.iter().enumerate() {
        out.weights[rows.input(i)] = fit.weights[i];
        out.residuals_mag[rows.input(i)] = *r;
        out.leverage[rows.input(i)] = jack.leverage[i];
    }
    out
}

fn name(estimator: Estimator) -> &'static str {
    match estimator {
        Estimator::Robust => "robust",
        Estimator::Clip => "clip",
        Estimator::Huber => "huber",
        Estimator::Ols => "ols",
    }
}

/// Which pointings are under clouds.
fn cloud_text(clouds: &Clouds, rows: &Rows) -> String {
    let named: Vec<String> = (0..rows.pointings.len())
        .filter(|j| clouds.probability[*j] > 0.5)
        .map(|j| format!("{} ({:+.2})", rows.pointings[j], clouds.mean_mag[j]))
        .collect();
    format!(
        "{} of {} pointings are dimmed as by clouds: {}; the zeropoint is that of the clear ones, {:.3} mag brighter than \
         with the clouds as scatter, and {:.3} mag for their uncertainty are in its error",
        named.len(),
        rows.pointings.len(),
        if named.is_empty() { "none for certain".to_owned() } else { named.join(", ") },
        clouds.shift_mag.abs(),
        clouds.doubt_mag()
    )
}

/// The errors by the model.
struct Inference {
    sums: Sums,
    sds: [Vec<f64>; 2],
    prior: Prior,
    model: Quoted,
    /// Covariance at the most likely scatters.
    at_scatters: Matrix,
    star_scatter_mag: f64,
    tau_rms_mag: f64,
    clouded: bool,
    /// Error of C by that of the colours' share \[mag/mag\].
    colour_err: f64,
    /// Error of the zeropoint by clouds that are suspected and not corrected \[mag\].
    suspected_mag: f64,
}

impl Inference {
    fn of(
        rows: &Rows,
        fit: &Fit,
        clouds: Option<&Clouds>,
        suspected_mag: f64,
        config: &config::Zeropoint,
    ) -> Inference {
        let doubt_mag = clouds.map_or(0.0, Clouds::doubt_mag);
        let (g, n) = (rows.pointings.len(), rows.len() as f64);
        let sums = fit.sums(rows);
        let ols = config.estimator == Estimator::Ols;
        let prior = if ols { Prior::None } else { Prior::of(rows, config) };
        let tau_mag = clouds.map_or(fit.tau2.sqrt(), |c| c.tau_mag);
        let ones = vec![1.0; g];
        let problem = Problem {
            sums: &sums,
            prior,
            offsets_mag: super::repeated::typical_offsets(&sums, &fit.theta, &fit.offsets_of_stars(rows), g),
            stars: &fit.stars,
            pointing_weight: clouds.map_or(&ones, |c| &c.weight),
            kappa: fit.kappa,
            tau_mag,
        };
        let of_pointings = problem.pointing_weight.iter().map(|w| tau_mag / w.max(1e-4).sqrt()).collect();
        let sds = [of_pointings, fit.stars.sds(fit.kappa)];
        let at_scatters = sums.solve(&sds[0], &sds[1]).cov;
        let alone = sums.solve(&vec![0.0; g], &vec![0.0; fit.stars.stated.len()]).cov;
        let dof = (n - if rows.repeated { fit.fitted } else { rows.n_free() as f64 }).max(1.0);
        let mut tau_rms_mag = tau_mag;
        let mut model = match clouds {
            _ if ols => Quoted::of(at_scatters, dof),
            Some(clouds) => {
                let clear: f64 = clouds.weight.iter().sum::<f64>() - rows.n_free() as f64;
                let t = quantile(SHARES[0], clear.max(1.0)).powi(2);
                let mut quoted = Quoted::of(at_scatters.map(|row| row.map(|c| t * c)), clear.max(1.0));
                quoted.cov_95 = quoted.cov_95.map(|row| row.map(|c| c / t));
                quoted
            }
            None => {
                let marginal = problem.integrate(false);
                tau_rms_mag = marginal.tau_rms_mag;
                marginal.quoted(&fit.theta, &alone, dof)
            }
        };
        let colour_err = fit.theta[2].abs() * rows.calibration.rel_err;
        model.add(&[0.0, 0.0, 1.0, 0.0], colour_err);
        model.add(&[1.0, 0.0, 0.0, 0.0], doubt_mag.hypot(suspected_mag));
        let mut out = Inference {
            star_scatter_mag: (fit.stars.mean * fit.kappa).sqrt(),
            sums,
            sds,
            prior,
            model,
            at_scatters,
            tau_rms_mag,
            clouded: clouds.is_some(),
            colour_err,
            suspected_mag,
        };
        let held = out.held(rows, fit);
        held.iter().for_each(|(slope, err)| out.model.add(slope, *err));
        out
    }

    /// How the terms answer to a value that is held, and its error.
    fn held(&self, rows: &Rows, fit: &Fit) -> Vec<(Vector, f64)> {
        let one = |t: usize| {
            let err = rows.terms[t].held_err();
            let per_unit = || {
                let column = Sums::slope(rows, &fit.omega, |i| rows.column_of_term(t, i));
                let mut slope = column.solve(&self.sds[0], &self.sds[1]).theta.map(|v| -v);
                slope[t + 1] = 1.0;
                (slope, err)
            };
            (err > 0.0).then(per_unit)
        };
        (0..2).filter_map(one).collect()
    }

    /// Scatter of one line of sight \[mag\].
    fn line_of_sight_mag(&self, seen: &Pointings) -> f64 {
        match self.prior {
            Prior::Site(_) => self.tau_rms_mag,
            Prior::Flat | Prior::None => seen.scatter_mag.unwrap_or(f64::NAN),
        }
    }
}

/// The covariances that cover the truth in 68 and 95 % of nights, and where they are from.
///
/// With ten pointings and more of stars measured once: the larger of the jackknives by star and by pointing, judged at the
/// mean airmass and colour. Else the model, averaged over what is not known of the scatters: few pointings, stars measured
/// repeatedly, clouds, or a term held or pulled, whose error no leaving out can see. A jackknife more than twice the model
/// and the other one has jumped to another solution without one of its stars: the model stands in.
fn quote(
    rows: &Rows,
    mut jack: Jackknife,
    seen: &Pointings,
    inference: &Inference,
    config: &config::Zeropoint,
    warnings: &mut Vec<String>,
) -> (Quoted, Jackknife, String) {
    let model = inference.model;
    if config.estimator == Estimator::Ols {
        let note = "least squares, s² (AᵀA)⁻¹: neither outliers, clouds nor stars measured repeatedly are in it";
        return (model, jack, note.to_owned());
    }
    let errs = |cov: &Matrix| {
        let cov = rows.uncentred(&[0.0; 4], cov).1;
        [0, 1, 2].map(|i| cov[i][i].max(0.0).sqrt())
    };
    let of_model = errs(&model.cov);
    let jumps = |one: &Option<Matrix>, other: &Option<Matrix>| {
        let other = other.as_ref().map_or([0.0; 3], errs);
        one.as_ref().map(errs).is_some_and(|e| (0..3).any(|i| e[i] > JUMP * of_model[i].max(other[i])))
    };
    // twice: what one was measured by may itself fall
    for (which, by) in [(0, "star"), (1, "pointing"), (0, "star")] {
        let (one, other) =
            if which == 0 { (&jack.by_star, &jack.by_pointing) } else { (&jack.by_pointing, &jack.by_star) };
        // where k rests on one pointing the model cannot know whether it was clouded
        if jumps(one, other) && !(which == 1 && jack.rests) {
            warnings.push(format!(
                "the fits without one {by} scatter more than {JUMP} times as far as the model and the other jackknife say: a \
                 single {by} decides a term, and the model is quoted instead"
            ));
            if which == 0 { jack.by_star = None } else { jack.by_pointing = None }
        }
    }
    let g = seen.list.len();
    let at_k = |cov: &Matrix| cov[1][1];
    if let Some(pointing) = jack.by_pointing.as_ref().filter(|p| jack.rests && at_k(p) > at_k(&model.cov)) {
        let note = format!("delete-one-pointing jackknife ({g} pointings): k rests on one of them");
        return (Quoted::of(*pointing, seen.dof.max(1.0)), jack, note);
    }
    let few = rows.len() < rows.n_free() + FEWEST_DOF;
    let held = rows.terms.iter().any(|t| t.held_err() > 0.0);
    let why = if inference.clouded {
        "clouds".to_owned()
    } else if rows.repeated {
        format!("{} measurements of {} stars", rows.len(), rows.n_stars)
    } else if rows.has_prior() {
        "a term is pulled by a prior".to_owned()
    } else if held {
        "a term is held at its prior".to_owned()
    } else if few {
        format!("{} measurements", rows.len())
    } else if g < TOLD_BY {
        format!("{g} pointings")
    } else {
        let (Some(star), Some(pointing)) = (&jack.by_star, &jack.by_pointing) else {
            let note = "model of stars and pointings; no jackknife: a star or a pointing decides alone";
            return (model, jack, note.to_owned());
        };
        let at = rows.centre();
        let of_star = (rows.len() - rows.n_free()) as f64;
        let (cov, dof, note) = if quadratic(pointing, &at) >= quadratic(star, &at) {
            let note = format!("delete-one-pointing jackknife ({g} pointings), larger than that of single stars");
            (*pointing, seen.dof.max(1.0), note)
        } else {
            let note = format!("delete-one-star jackknife ({} stars), larger than that of {g} pointings", rows.len());
            (*star, of_star, note)
        };
        let mut quoted = Quoted::of(cov, dof);
        quoted.add(&[0.0, 0.0, 1.0, 0.0], inference.colour_err);
        quoted.add(&[1.0, 0.0, 0.0, 0.0], inference.suspected_mag);
        return (quoted, jack, note);
    };
    (model, jack, format!("model of stars and pointings, averaged over their scatters; no jackknife: {why}"))
}

/// χ²/dof and its probability with the stated errors alone.
fn chi2(rows: &Rows, used: &[usize], fit: &Fit) -> (Option<f64>, Option<f64>) {
    let stated = |i: usize| {
        // all there is of a row, though the part of its star is shared by its visits
        let of_star = if rows.repeated { rows.star_var(i, &fit.theta) } else { 0.0 };
        rows.stated_var(i, &fit.theta) + of_star
    };
    let known = used.iter().all(|i| stated(*i) > 0.0);
    let dof = used.len().saturating_sub(rows.n_free());
    if !known || dof == 0 {
        return (None, None);
    }
    let one = |i: &usize| rows.residual(*i, &fit.theta).powi(2) / stated(*i);
    let chi2: f64 = used.iter().map(one).sum();
    let p = ChiSquared::new(dof as f64).ok().map(|d| d.sf(chi2));
    (Some(chi2 / dof as f64), p)
}

/// How k'' came about and, where it was fitted, whether the stars support it: F = (k''/σ)², ΔBIC = ln n − n ln(1 + F/dof).
fn second_order(rows: &Rows, fit: &Fit, cov: &Matrix, n_used: usize) -> String {
    if rows.terms[2] != Term::Free {
        return rows.terms[2].note();
    }
    let dof = n_used.saturating_sub(rows.n_free()) as f64;
    if !(cov[3][3] > 0.0) || dof < 1.0 {
        return "fitted; no degree of freedom to test it".to_owned();
    }
    let f = fit.theta[3].powi(2) / cov[3][3];
    let p = FisherSnedecor::new(1.0, dof).map_or(f64::NAN, |d| d.sf(f));
    let n = n_used as f64;
    let bic = n.ln() - n * (f / dof).ln_1p();
    let verdict = if bic < 0.0 { "supported by the data" } else { "not supported by the data" };
    format!("fitted; F(1, {dof:.0}) = {f:.2}, p = {p:.3}, BIC changes by {bic:+.1}: {verdict}")
}
