//! The pointings of a fit one by one: their offsets, and whether a cloud was among them.
//!
//! Magnitudes. χ² of the offsets against the errors of their stars shows whether the pointings differ at all; an offset
//! is called a cloud when it lies 3 σ from the others, σ the scatter of the others.

use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use super::mixed::{Means, dof, scatter_between, triangle};
use super::rows::Rows;
use super::rows::has_pointings;
use super::solve::{Matrix, quadratic};
use super::weights::Fit;

/// Two-sided probability of a 3 σ deviation of a Gaussian.
const THREE_SIGMA: f64 = 0.0027;

/// One pointing as the fit saw it.
#[derive(Debug, Clone, PartialEq)]
pub struct Pointing {
    /// Its number in the star table.
    pub number: usize,
    /// Measurements with weight.
    pub n_used: usize,
    /// Measurements the fit gave no weight.
    pub n_rejected: usize,
    /// Mean airmass of its measurements.
    pub airmass_mean: f64,
    /// Weighted mean of V_inst − V minus the fit \[mag\]; positive = fainter, a cloud. The median if all are rejected.
    pub offset_mag: f64,
    /// Its error from the stars of the pointing alone \[mag\].
    pub offset_err_mag: f64,
}

/// The result of all pointings together.
#[derive(Debug, Clone)]
pub struct Pointings {
    /// Each of them, by number.
    pub list: Vec<Pointing>,
    /// Scatter of their own offsets \[mag\]; `None` where the stars do not determine it.
    pub scatter_mag: Option<f64>,
    /// Degrees of freedom of that scatter.
    pub dof: f64,
    /// χ² of the offsets per degree of freedom, if the stars' errors were all.
    pub chi2_dof: Option<f64>,
    /// Probability of a χ² at least as large.
    pub p_value: Option<f64>,
    /// Clouds by name.
    pub warnings: Vec<String>,
}

/// Looks at the pointings of a fit.
pub fn pointings(rows: &Rows, fit: &Fit) -> Pointings {
    let means = Means::of(rows, &fit.omega);
    let deviations = fit.deviations(&means);
    let mut list: Vec<Pointing> = rows
        .pointings
        .iter()
        .enumerate()
        .map(|(j, number)| Pointing {
            number: *number,
            n_used: 0,
            n_rejected: 0,
            airmass_mean: 0.0,
            offset_mag: deviations[j],
            offset_err_mag: means.weight[j].sqrt().recip(),
        })
        .collect();
    let mut residuals: Vec<Vec<f64>> = vec![Vec::new(); list.len()];
    for i in 0..rows.len() {
        let j = rows.group[i];
        let used = fit.weights[i] > 0.0;
        list[j].n_used += usize::from(used);
        list[j].n_rejected += usize::from(!used);
        list[j].airmass_mean += rows.star(i).airmass;
        if means.weight[j] == 0.0 {
            residuals[j].push(rows.residual(i, &fit.theta));
        }
    }
    let mut out = Pointings {
        list: Vec::new(),
        scatter_mag: None,
        dof: 0.0,
        chi2_dof: None,
        p_value: None,
        warnings: Vec::new(),
    };
    for (p, r) in list.iter_mut().zip(&mut residuals) {
        p.airmass_mean /= (p.n_used + p.n_rejected) as f64;
        if p.n_used == 0 {
            p.offset_mag = super::median(r);
            p.offset_err_mag = crate::base::stats::mad_sigma(r).unwrap_or(0.0) / (r.len() as f64).sqrt();
            let text = format!(
                "pointing {} rejected whole: its {} stars are {:+.3} mag off the fit; a cloud, or a wrong match",
                p.number, p.n_rejected, p.offset_mag
            );
            out.warnings.push(text);
        }
    }
    if has_pointings(rows) {
        scatter(rows, fit, &means, &mut list, &mut out);
    }
    out.list = list;
    out
}

/// The scatter of the offsets, the cloud test and the clouds.
fn scatter(rows: &Rows, fit: &Fit, means: &Means, list: &mut [Pointing], out: &mut Pointings) {
    let alone = triangle(rows, &fit.omega, means, 0.0).solve();
    let dof0 = dof(means, &alone.inverse, 0.0);
    if dof0 < 0.5 {
        return;
    }
    let chi2: f64 = means.with_weight().map(|j| means.residual(j, &alone.theta).powi(2) * means.weight[j]).sum();
    out.chi2_dof = Some(chi2 / dof0);
    out.p_value = ChiSquared::new(dof0).ok().map(|d| d.sf(chi2));
    // least squares do not use the scatter, but it is worth knowing
    let cov = triangle(rows, &fit.omega, means, fit.tau2).solve().inverse;
    out.dof = dof(means, &cov, fit.tau2);
    let tau2 = if fit.tau2 > 0.0 { fit.tau2 } else { scatter_between(means, &fit.deviations(means), out.dof) };
    out.scatter_mag = Some(tau2.sqrt());
    for j in means.with_weight() {
        if let Some(text) = cloud(j, means, &cov, fit, tau2, out.dof, &list[j]) {
            out.warnings.push(text);
        }
    }
}

/// Deviation of one pointing from the others in units of their scatter (externally studentised, so that a cloud among few
/// pointings does not hide behind the scatter it makes).
fn cloud(j: usize, means: &Means, cov: &Matrix, fit: &Fit, tau2: f64, dof: f64, p: &Pointing) -> Option<String> {
    let var = tau2 + 1.0 / means.weight[j];
    let left = (var - quadratic(cov, &means.columns[j])).max(1e-3 * var);
    let r = p.offset_mag / left.sqrt();
    // where the scatter is that of the stars alone it is known and not estimated from the pointings
    let (t, probability) = if fit.tau2 > 0.0 && dof > 1.5 && r * r < dof {
        let t = r * ((dof - 1.0) / (dof - r * r)).sqrt();
        (t, 2.0 * StudentsT::new(0.0, 1.0, dof - 1.0).ok()?.sf(t.abs()))
    } else {
        (r, statrs::function::erf::erfc(r.abs() / std::f64::consts::SQRT_2))
    };
    (probability < THREE_SIGMA).then(|| {
        format!(
            "pointing {} is off by {:+.3} mag, {:.1} sigma of the others: a cloud, or a wrong exposure or match",
            p.number,
            p.offset_mag,
            t.abs()
        )
    })
}
