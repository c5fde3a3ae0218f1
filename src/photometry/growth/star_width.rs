//! How wide the night's stars are, and how that goes with the airmass.
//!
//! FWHM in arcsec. It does not cover seeing that changes with the hour.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

use crate::base::stats::median;

/// Exponent of the airmass in the FWHM before any pointing is looked at, and its error: 0.6 of seeing (Fried 1966, J. Opt. Soc. Am.
/// 56, 1372), 0 of the optics.
pub const PRIOR_EXPONENT: (f64, f64) = (0.4, 0.3);
/// Scatter of ln FWHM from pointing to pointing that is expected, counted as one of them.
const SCATTER: f64 = 0.1;
/// Beyond this airmass the width is that at it: neither the law nor the exponent is known so low.
const MOST_AIRMASS: f64 = 6.0;

/// The FWHM of the stars of a night: f(X) = f₀ (X/X₀)^k.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StarWidth {
    /// f₀, that at the mean airmass of the pointings \[arcsec\].
    pub fwhm_arcsec: f64,
    /// X₀; `None` if no pointing has an airmass: then the width is that everywhere.
    pub airmass: Option<f64>,
    /// k.
    pub exponent: f64,
}

impl StarWidth {
    /// That of the pointings, each the FWHM \[arcsec\] and airmass of its frames; `None` without any.
    ///
    /// ln f = ln f₀ + k ln(X/X₀) by least squares over n pointings, k = 0.4 ± 0.3 beforehand, their scatter s² = (0.1² + Σ r²)/(n − 1)
    /// with the residuals r; then f₀ by the median of the frames.
    #[must_use]
    pub fn of(pointings: &[Vec<(f64, Option<f64>)>]) -> Option<Self> {
        let usable = |frame: &&(f64, Option<f64>)| frame.0.is_finite() && frame.0 > 0.0;
        let middle = |frames: &Vec<(f64, Option<f64>)>| {
            let (fwhm, log): (Vec<f64>, Vec<f64>) =
                frames.iter().filter(usable).filter_map(|(f, x)| Some((f.ln(), log_airmass((*x)?)?))).unzip();
            Some((median(&mut fwhm.clone())?, median(&mut log.clone())?))
        };
        let middles: Vec<(f64, f64)> = pointings.iter().filter_map(middle).collect();
        let log0 = middles.iter().map(|m| m.1).sum::<f64>() / middles.len() as f64;
        let prior = Matrix2::new(0.0, 0.0, 0.0, PRIOR_EXPONENT.1.powi(-2));
        let fit = |scatter2: f64| {
            let mut normal = prior;
            let mut right = prior * Vector2::new(0.0, PRIOR_EXPONENT.0);
            for (fwhm, log) in &middles {
                let t = Vector2::new(1.0, log - log0);
                normal += t * t.transpose() / scatter2;
                right += t * (fwhm / scatter2);
            }
            normal.try_inverse().map_or(Vector2::zeros(), |inverse| inverse * right)
        };
        // once with the scatter that is expected, and once with it and that about the first line
        let first = fit(SCATTER * SCATTER);
        let square = |(fwhm, log): &(f64, f64)| (fwhm - first[0] - first[1] * (log - log0)).powi(2);
        let squares = SCATTER * SCATTER + middles.iter().map(square).sum::<f64>();
        let exponent = fit(squares / (middles.len() as f64 - 1.0).max(1.0))[1];
        let airmass = (!middles.is_empty()).then(|| log0.exp());
        let at_mean = |(fwhm, x): &(f64, Option<f64>)| {
            let log = x.and_then(log_airmass).map_or(0.0, |log| log - log0);
            fwhm / (exponent * log).exp()
        };
        let mut fwhm: Vec<f64> = pointings.iter().flatten().filter(usable).map(at_mean).collect();
        median(&mut fwhm).map(|fwhm_arcsec| Self { fwhm_arcsec, airmass, exponent })
    }

    /// The FWHM at an airmass \[arcsec\]; that at the mean airmass of the pointings where it is not known.
    #[must_use]
    pub fn at(&self, airmass: Option<f64>) -> f64 {
        let log = airmass.and_then(log_airmass).zip(self.airmass).map_or(0.0, |(log, x0)| log - x0.ln());
        self.fwhm_arcsec * (self.exponent * log).exp()
    }

    /// The largest at any airmass \[arcsec\].
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.at(Some(1.0)).max(self.at(Some(MOST_AIRMASS)))
    }
}

/// ln X, not beyond the largest airmass; `None` for what is none.
fn log_airmass(airmass: f64) -> Option<f64> {
    (airmass >= 1.0).then(|| airmass.min(MOST_AIRMASS).ln())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn night(exponent: f64, airmasses: &[f64]) -> Option<StarWidth> {
        let of = |x: &f64| vec![(2.5 * x.powf(exponent), Some(*x)); 4];
        StarWidth::of(&airmasses.iter().map(of).collect::<Vec<_>>())
    }

    #[test]
    fn pointings_over_a_range_of_airmass_determine_the_growth_of_the_width() {
        for exponent in [0.0, 0.6] {
            let wide: Vec<f64> = (0..8).map(|k| 1.0 + 0.25 * f64::from(k)).collect();
            let width = night(exponent, &wide).unwrap();
            let (got, want) = (width.at(Some(2.5)), 2.5 * 2.5f64.powf(exponent));
            assert!((got / want - 1.0).abs() < 0.03, "{exponent}: {got} {want}");
            assert_eq!(width.at(Some(50.0)), width.at(Some(6.0)));
        }
        // one airmass leaves the growth to what is known beforehand
        let one = night(0.6, &[1.2]).unwrap();
        assert!((one.at(Some(1.2)) / (2.5 * 1.2f64.powf(0.6)) - 1.0).abs() < 1e-9 && one.exponent == PRIOR_EXPONENT.0);
    }

    #[test]
    fn a_night_without_airmasses_or_stars_has_one_width_or_none() {
        let flat = StarWidth::of(&[vec![(2.0, None), (f64::NAN, Some(1.1)), (-1.0, None)]]).unwrap();
        assert_eq!((flat.at(Some(3.0)), flat.at(None), flat.largest()), (2.0, 2.0, 2.0));
        assert_eq!(StarWidth::of(&[]), None);
        assert_eq!(StarWidth::of(&[vec![(f64::NAN, None)], vec![]]), None);
        // a frame out of focus among many does not decide
        let mut frames = vec![(2.0, Some(1.5)); 5];
        frames.push((20.0, Some(1.5)));
        assert!((StarWidth::of(&[frames]).unwrap().at(Some(1.5)) - 2.0).abs() < 1e-12);
    }
}
