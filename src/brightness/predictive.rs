//! How far a magnitude may be from the one predicted: what observations scatter about the model, the errors of its fitted
//! parameters, the extinction.
//!
//! σ² = σ_scatter² + Jᵀ C J + (σ_k X)² \[mag²\], J the derivatives of V by the parameters and C their covariance. The scatter is that
//! of observed less modelled magnitudes, attitude and elements of the observed passes included. A satellite that was never compared
//! with observations has no predictive error. It does not cover a bias of the model, and elements older than those observed with.

use super::Entry;
use crate::base::constants::MAG_PER_LN;

/// What the parameters of a fit are.
#[derive(Debug, Clone, PartialEq)]
enum Parameters {
    /// Coefficients of powers of the phase angle in degrees.
    PhaseLaw,
    /// Logarithms of the scales of these surfaces.
    Scales(Vec<String>),
}

/// The predictive error of a satellite.
#[derive(Debug, Clone, PartialEq)]
#[doc(hidden)]
pub struct Predictive {
    /// Scatter of observed less modelled magnitudes \[mag\].
    scatter_mag: f64,
    fit: Option<(Parameters, Vec<Vec<f64>>)>,
}

/// Before the name of a surface in the parameters of a fit.
pub const LN_SCALE: &str = "ln scale of ";

impl Predictive {
    /// Of an entry; `None` where it states no scatter.
    pub(super) fn of(entry: &Entry) -> Option<Self> {
        let parameters = |fit: &super::catalogue::Fitted| {
            let scales: Option<Vec<String>> =
                fit.parameters.iter().map(|name| name.strip_prefix(LN_SCALE).map(str::to_owned)).collect();
            let parameters = match scales {
                Some(names) => Parameters::Scales(names),
                None => Parameters::PhaseLaw,
            };
            (parameters, fit.covariance.clone())
        };
        Some(Self { scatter_mag: entry.scatter_mag?, fit: entry.fit.as_ref().map(parameters) })
    }

    /// Surfaces whose share of the light is needed.
    pub(super) fn surfaces(&self) -> &[String] {
        match &self.fit {
            Some((Parameters::Scales(names), _)) => names,
            _ => &[],
        }
    }

    /// σ at a phase angle, given the share of the light that each of [`Predictive::surfaces`] sends, and the error of the
    /// extinction \[mag\].
    pub(super) fn err_mag(&self, phase_rad: f64, shares: &[f64], extinction_err_mag: f64) -> f64 {
        let by_parameters = self.fit.as_ref().map_or(0.0, |(parameters, covariance)| {
            let j: Vec<f64> = match parameters {
                Parameters::PhaseLaw => (0..covariance.len()).map(|k| phase_rad.to_degrees().powi(k as i32)).collect(),
                Parameters::Scales(_) => shares.iter().map(|share| -MAG_PER_LN * share).collect(),
            };
            let row = |(a, row): (&f64, &Vec<f64>)| a * row.iter().zip(&j).map(|(c, b)| c * b).sum::<f64>();
            j.iter().zip(covariance).map(row).sum::<f64>().max(0.0)
        });
        (self.scatter_mag * self.scatter_mag + by_parameters + extinction_err_mag * extinction_err_mag).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_add_in_quadrature_and_shares_of_all_surfaces_are_one_scale() {
        let covariance = vec![vec![0.01, 0.0], vec![0.0, 0.04]];
        let scales = Parameters::Scales(vec!["a".into(), "b".into()]);
        let of = |fit| Predictive { scatter_mag: 0.3, fit };
        assert_eq!(of(None).err_mag(1.0, &[], 0.4), 0.5);
        // all light of one surface: its relative error
        let one = of(Some((scales.clone(), covariance.clone()))).err_mag(1.0, &[0.0, 1.0], 0.0);
        assert!((one - 0.3f64.hypot(0.2 * MAG_PER_LN)).abs() < 1e-12);
        // scales that are known together to the same: the sum of shares counts
        let together = of(Some((scales, vec![vec![0.04; 2]; 2])));
        assert!((together.err_mag(1.0, &[0.3, 0.7], 0.0) - one).abs() < 1e-12);
        // a constant and a slope: 0.1 + 0.2 x at x = 2 deg
        let law = of(Some((Parameters::PhaseLaw, covariance))).err_mag(2f64.to_radians(), &[], 0.0);
        assert!((law - (0.09f64 + 0.01 + 4.0 * 0.04).sqrt()).abs() < 1e-12);
    }
}
