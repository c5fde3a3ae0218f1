//! How far a magnitude may be from the one predicted: what observations scatter about the model, the errors of its fitted
//! parameters, the extinction.
//!
//! σ² = σ_scatter² + Jᵀ C J + (σ_k X)² \[mag²\], J the derivatives of V by the parameters and C their covariance. The scatter is that
//! of observed less modelled magnitudes, attitude and elements of the observed passes included. A satellite that was never compared
//! with observations has no predictive error. It does not cover a bias of the model, and elements older than those observed with.

use super::Entry;
use crate::base::constants::MAG_PER_LN;

/// A parameter of a fit.
#[derive(Debug, Clone, PartialEq)]
enum Parameter {
    /// Coefficient of a power of the phase angle in degrees.
    PhasePower(i32),
    /// Coefficient of a power of the altitude of the Sun at the satellite in degrees.
    SunAltPower(i32),
    /// Logarithm of the scale of surfaces, by their places in [`Predictive::surfaces`].
    Scale(Vec<usize>),
    /// What has no derivative here: the offset of a table, which is of the observations, and numbers of laws and angles, whose errors
    /// are part of the scatter of magnitudes left out of the fit.
    Other,
}

/// The predictive error of a satellite.
#[derive(Debug, Clone, PartialEq)]
#[doc(hidden)]
pub struct Predictive {
    /// Scatter of observed less modelled magnitudes \[mag\].
    scatter_mag: f64,
    surfaces: Vec<String>,
    parameters: Vec<Parameter>,
    covariance: Vec<Vec<f64>>,
}

/// Before the name of a surface in the parameters of a fit.
pub const LN_SCALE: &str = "ln scale of ";
/// Coefficients of powers of the phase angle among them.
pub const PHASE_POWER: &str = "mag_1000km";
/// Coefficients of powers of the altitude of the Sun at the satellite, from the first.
pub const SUN_ALT_POWER: &str = "per_sun_alt_sat";

impl Predictive {
    /// Of an entry; `None` where it states no scatter.
    pub(super) fn of(entry: &Entry) -> Option<Self> {
        let fit = entry.fit.as_ref();
        let mut surfaces = Vec::new();
        let mut parameter = |name: &String| {
            let power = |of: &str| name.strip_prefix(of)?.strip_prefix('[')?.strip_suffix(']')?.parse().ok();
            if let Some(tied) = name.strip_prefix(LN_SCALE) {
                let first = surfaces.len();
                surfaces.extend(tied.split('+').map(str::to_owned));
                return Parameter::Scale((first..surfaces.len()).collect());
            }
            let phase = power(PHASE_POWER).map(Parameter::PhasePower);
            phase.or_else(|| power(SUN_ALT_POWER).map(Parameter::SunAltPower)).unwrap_or(Parameter::Other)
        };
        let parameters = fit.map_or(Vec::new(), |fit| fit.parameters.iter().map(&mut parameter).collect());
        let covariance = fit.map_or(Vec::new(), |fit| fit.covariance.clone());
        Some(Self { scatter_mag: entry.scatter_mag?, surfaces, parameters, covariance })
    }

    /// Surfaces whose share of the light is needed.
    pub(super) fn surfaces(&self) -> &[String] {
        &self.surfaces
    }

    /// σ at a phase angle and altitude of the Sun at the satellite, given the share of the light that each of
    /// [`Predictive::surfaces`] sends, and the error of the extinction \[mag\].
    pub(super) fn err_mag(
        &self,
        [phase_rad, sun_alt_sat_rad]: [f64; 2],
        shares: &[f64],
        extinction_err_mag: f64,
    ) -> f64 {
        let derivative = |parameter: &Parameter| match parameter {
            Parameter::PhasePower(k) => phase_rad.to_degrees().powi(*k),
            Parameter::SunAltPower(k) => sun_alt_sat_rad.to_degrees().powi(*k),
            Parameter::Scale(of) => -MAG_PER_LN * of.iter().map(|s| shares[*s]).sum::<f64>(),
            Parameter::Other => 0.0,
        };
        let j: Vec<f64> = self.parameters.iter().map(derivative).collect();
        let row = |(a, row): (&f64, &Vec<f64>)| a * row.iter().zip(&j).map(|(c, b)| c * b).sum::<f64>();
        let by_parameters = j.iter().zip(&self.covariance).map(row).sum::<f64>().max(0.0);
        (self.scatter_mag * self.scatter_mag + by_parameters + extinction_err_mag * extinction_err_mag).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_add_in_quadrature_and_shares_of_all_surfaces_are_one_scale() {
        let covariance = vec![vec![0.01, 0.0], vec![0.0, 0.04]];
        let of = |parameters: &[Parameter], covariance: &[Vec<f64>]| Predictive {
            scatter_mag: 0.3,
            surfaces: vec!["a".into(), "b".into()],
            parameters: parameters.to_vec(),
            covariance: covariance.to_vec(),
        };
        let scales = [Parameter::Scale(vec![0]), Parameter::Scale(vec![1])];
        assert_eq!(of(&[], &[]).err_mag([1.0, 0.0], &[], 0.4), 0.5);
        // all light of one surface: its relative error
        let one = of(&scales, &covariance).err_mag([1.0, 0.0], &[0.0, 1.0], 0.0);
        assert!((one - 0.3f64.hypot(0.2 * MAG_PER_LN)).abs() < 1e-12);
        // scales that are known together to the same: the sum of shares counts
        let together = of(&scales, &vec![vec![0.04; 2]; 2]);
        assert!((together.err_mag([1.0, 0.0], &[0.3, 0.7], 0.0) - one).abs() < 1e-12);
        // a constant and a slope: 0.1 + 0.2 x at x = 2 deg
        let law = [Parameter::PhasePower(0), Parameter::PhasePower(1)];
        let law = of(&law, &covariance).err_mag([2f64.to_radians(), 0.0], &[], 0.0);
        assert!((law - (0.09f64 + 0.01 + 4.0 * 0.04).sqrt()).abs() < 1e-12);
        // an offset of a table is no error of a prediction; the square of the Sun's altitude is
        let law = [Parameter::Other, Parameter::SunAltPower(2)];
        let law = of(&law, &covariance).err_mag([1.0, 3f64.to_radians()], &[], 0.0);
        assert!((law - (0.09f64 + 81.0 * 0.04).sqrt()).abs() < 1e-12);
    }
}
