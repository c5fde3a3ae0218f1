//! How wide the night's stars are, and how that goes with the airmass.
//!
//! FWHM in arcsec. It does not cover seeing that changes with the hour.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

use crate::base::stats::{mad_sigma, median};

/// Exponent of the airmass in the FWHM before any pointing is looked at, and its error: 0.6 of seeing (Fried 1966, J. Opt. Soc. Am.
/// 56, 1372), 0 of the optics.
pub const PRIOR_EXPONENT: (f64, f64) = (0.4, 0.3);
/// Scatter of ln FWHM from pointing to pointing that is expected, counted as one of them.
const SCATTER: f64 = 0.1;
/// Share of its width by which the stars of a frame differ from those of the night, before any frame is looked at ...
pub const FRAME_SCATTER: f64 = 0.05;
/// ... counted as so many frames.
const FRAMES_BEFORE: f64 = 4.0;
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
    /// Robust scatter of ln f from frame to frame.
    #[serde(default)]
    pub scatter: f64,
    /// The number of those frames, and their exposure time \[s\].
    #[serde(default)]
    pub frames: (f64, Option<f64>),
}

impl StarWidth {
    /// That of the pointings, each the FWHM \[arcsec\] and airmass of its frames; `None` without any.
    ///
    /// ln f = ln f₀ + k ln(X/X₀) by least squares over n pointings, k = 0.4 ± 0.3 beforehand, their scatter s² = (0.1² + Σ r²)/(n − 1)
    /// with the residuals r; then f₀ by the median of the frames. `exptime_s` is that of the frames.
    #[must_use]
    pub fn of(pointings: &[Vec<(f64, Option<f64>)>], exptime_s: Option<f64>) -> Option<Self> {
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
        let fwhm_arcsec = median(&mut fwhm)?;
        let mut logs: Vec<f64> = fwhm.iter().map(|f| f.ln()).collect();
        let (m, scatter) = (logs.len() as f64, mad_sigma(&mut logs).unwrap_or(0.0));
        Some(Self { fwhm_arcsec, airmass, exponent, scatter, frames: (m, exptime_s) })
    }

    /// The FWHM at an airmass \[arcsec\]; that at the mean airmass of the pointings where it is not known.
    #[must_use]
    pub fn at(&self, airmass: Option<f64>) -> f64 {
        let log = airmass.and_then(log_airmass).zip(self.airmass).map_or(0.0, |(log, x0)| log - x0.ln());
        self.fwhm_arcsec * (self.exponent * log).exp()
    }

    /// Share of the FWHM by which that of a frame of `exptime_s` differs from it:
    /// e² = (4 · 0.05² + m (σ² + min(σ² (t₀/t − 1), 0.05²)))/(4 + m) by the scatter σ of m frames of t₀, as a mean over a shorter time scatters more.
    #[must_use]
    pub fn err_frac(&self, exptime_s: f64) -> f64 {
        let (m, own) = (self.frames.0, self.scatter.powi(2));
        let ratio = self.frames.1.map_or(1.0, |of_stars| of_stars / exptime_s);
        let shorter = if ratio > 1.0 { (own * (ratio - 1.0)).min(FRAME_SCATTER.powi(2)) } else { 0.0 };
        ((FRAMES_BEFORE * FRAME_SCATTER.powi(2) + m * (own + shorter)) / (FRAMES_BEFORE + m)).sqrt()
    }

    /// It and its scatter, in words.
    #[must_use]
    pub fn explanation(&self) -> String {
        let at =
            self.airmass.map(|x| format!(" at airmass {x:.2}, ∝ airmass^{:.2}", self.exponent)).unwrap_or_default();
        let of = self.frames.1.map(|t| format!(" of {t} s")).unwrap_or_default();
        format!(
            "stars: FWHM {:.2} arcsec{at}; {:.1} % from frame to frame, in {} frames{of}",
            self.fwhm_arcsec,
            100.0 * self.scatter,
            self.frames.0
        )
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
        StarWidth::of(&airmasses.iter().map(of).collect::<Vec<_>>(), None)
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
    fn the_scatter_of_many_frames_is_theirs_and_that_of_few_what_was_known_before() {
        let width = |m: usize, sigma: f64| {
            let frames =
                (0..m).map(|k| (2.0 * (sigma * [-1.2, -0.5, 0.0, 0.7, 1.1][k % 5]).exp(), Some(1.3))).collect();
            StarWidth::of(&[frames], Some(6.0)).unwrap()
        };
        let of = |m: usize, sigma: f64| width(m, sigma).err_frac(10.0);
        assert!((of(500, 0.01) - 0.01).abs() < 0.002 && (of(500, 0.12) - 0.12).abs() < 0.02);
        assert!((0.02..0.04).contains(&of(6, 0.01)) && (of(1, 0.0) - 0.05).abs() < 0.006, "{}", of(6, 0.01));
        let old = r#"{"fwhm_arcsec":2.0,"airmass":null,"exponent":0.4}"#;
        assert_eq!(serde_json::from_str::<StarWidth>(old).unwrap().err_frac(1.0), FRAME_SCATTER);
        // a sixth of the time; by no more than what is known before, and by that where there is no time
        let of = |sigma: f64, exptime_s: f64| width(500, sigma).err_frac(exptime_s);
        assert!(
            (of(0.01, 1.0) - 6f64.sqrt() * 0.01).abs() < 0.002 && (of(0.1, 1.0) - 0.1f64.hypot(0.05)).abs() < 0.005
        );
        assert!((of(0.01, 0.0) - 0.01f64.hypot(0.05)).abs() < 0.002 && (of(0.01, f64::NAN) - 0.01).abs() < 0.002);
    }

    #[test]
    fn a_night_without_airmasses_or_stars_has_one_width_or_none() {
        let flat = StarWidth::of(&[vec![(2.0, None), (f64::NAN, Some(1.1)), (-1.0, None)]], None).unwrap();
        assert_eq!((flat.at(Some(3.0)), flat.at(None), flat.largest()), (2.0, 2.0, 2.0));
        assert_eq!(StarWidth::of(&[], None), None);
        assert_eq!(StarWidth::of(&[vec![(f64::NAN, None)], vec![]], None), None);
        // a frame out of focus among many does not decide
        let mut frames = vec![(2.0, Some(1.5)); 5];
        frames.push((20.0, Some(1.5)));
        assert!((StarWidth::of(&[frames], None).unwrap().at(Some(1.5)) - 2.0).abs() < 1e-12);
    }
}
