//! The zeropoint with its terms, covariance and diagnostics.

use super::marginal;
use super::pointings::Pointing;
use super::solve;
use super::solve::quadratic;
use crate::bands::{Band, CalibratedBand, ColourIndex, Light};

/// A zeropoint with all that is needed to use and to judge it; [`fit_zeropoint`](crate::fit_zeropoint) makes one.
#[derive(Debug, Clone, PartialEq)]
pub struct Zeropoint {
    /// ZP \[mag\], for V_inst of electrons per second, outside the atmosphere, at B−V = 0.
    pub zp_mag: f64,
    /// Extinction k \[mag/airmass\].
    pub k_mag_airmass: f64,
    /// Colour term C \[mag/mag\].
    pub c_mag_mag: f64,
    /// Second-order extinction k'' \[mag/airmass/mag\]; 0 when not fitted.
    pub k2_mag: f64,
    /// Covariance of (ZP, k, C, k''); zero for a term that is held. See [`Zeropoint::err_mag`] for what is in it.
    pub cov: [[f64; 4]; 4],
    /// Covariance whose ±√(gᵀ Cov g) holds the truth in 95 % of nights: wider than 1.96 σ where few stars or pointings
    /// determine the scatter.
    pub cov_95: [[f64; 4]; 4],
    /// Covariance of the model: noise of the stars and an offset per pointing.
    #[doc(hidden)]
    pub cov_model: [[f64; 4]; 4],
    /// Covariance by leaving out one star at a time.
    #[doc(hidden)]
    pub cov_star_jackknife: Option<[[f64; 4]; 4]>,
    /// Covariance by leaving out one pointing at a time; `None` with fewer than five.
    #[doc(hidden)]
    pub cov_pointing_jackknife: Option<[[f64; 4]; 4]>,
    /// `robust`, `clip`, `huber` or `ols`.
    pub estimator: String,
    /// Measurements with weight.
    pub n_used: usize,
    /// Different stars among them.
    pub n_stars: usize,
    /// Measurements the fit gave no weight.
    pub n_rejected: usize,
    /// Pointings with a used measurement.
    pub n_pointings: usize,
    /// Root mean square residual of the used measurements \[mag\].
    pub rms_mag: f64,
    /// 1.4826 MAD of all residuals, the rejected ones included \[mag\].
    pub robust_sigma_mag: f64,
    /// Scatter of single stars beyond their stated errors, by maximum likelihood \[mag\].
    pub intrinsic_mag: f64,
    /// Scatter of the stars' own offsets that their visits share \[mag\]; NaN where stars are measured once.
    pub star_scatter_mag: f64,
    /// Scatter of the pointings' own offsets \[mag\]; NaN where it cannot be separated from that of the stars.
    pub pointing_scatter_mag: f64,
    /// Scatter of one line of sight \[mag\]: that of the pointings, or that of the site where there are few pointings.
    pub line_of_sight_mag: f64,
    /// Share of the variance of the stars' colours that is not their error; C is fitted to the colours that are expected
    /// with it (errors in variables). 1 without errors of the colours.
    pub colour_share: f64,
    /// Cloud test: χ² of the pointings' offsets per degree of freedom if the errors of their stars were all.
    pub pointing_chi2_dof: Option<f64>,
    /// Probability of a χ² at least as large: small = the pointings differ.
    pub pointing_p_value: Option<f64>,
    /// χ² per degree of freedom of the used measurements with their stated errors alone; `None` without degrees of
    /// freedom or stated errors.
    pub chi2_dof: Option<f64>,
    /// Probability of a χ² at least as large.
    pub p_value: Option<f64>,
    /// Condition number of the centred matrix with columns of equal length.
    pub condition: f64,
    /// Number of terms that the stars can separate, ZP included.
    pub rank: usize,
    /// Mean airmass of the usable measurements.
    pub airmass_mean: f64,
    /// Mean B−V of the usable measurements \[mag\].
    pub b_v_mean_mag: f64,
    /// Smallest and largest airmass used.
    pub airmass_range: [f64; 2],
    /// Smallest and largest B−V used \[mag\].
    pub b_v_range_mag: [f64; 2],
    /// Mean mid-exposure time of the used measurements, MJD (UTC) \[d\]; the fit does not know it, the night fills it in.
    pub mjd_mean_d: Option<f64>,
    /// Band of the catalogue magnitudes; the fit does not know it, the night fills it in.
    #[doc(hidden)]
    pub band: Option<Band>,
    /// Colour index of the stars; the fit does not know it either.
    #[doc(hidden)]
    pub colour: Option<ColourIndex>,
    /// Filter of the star frames; the fit does not know it either.
    #[doc(hidden)]
    pub light: Option<Light>,
    /// How k was determined: `fitted`, `pinned 0.12`, `refused: all stars within 0.02 airmass`.
    pub k_note: String,
    /// How C was determined.
    pub c_note: String,
    /// How k'' was determined, and whether the stars support it.
    pub k2_note: String,
    /// Where the covariance is from.
    pub cov_note: String,
    /// Colour of the target and its error \[mag\], for the errors that the file states; NaN if unknown.
    pub target_b_v_mag: [f64; 2],
    /// The pointings, by number.
    #[doc(hidden)]
    pub pointings: Vec<Pointing>,
    /// Notes for the observer.
    pub warnings: Vec<String>,
    /// Robust weight of each input row, 0 to 1; 0 = rejected or unusable.
    pub weights: Vec<f64>,
    /// Residual V_inst − V − ZP − k X − C (B−V) − k'' X (B−V) of each input row \[mag\]; NaN for an unusable row.
    pub residuals_mag: Vec<f64>,
    /// Share of its own residual each input row takes up in the fit, 0 to 1; 0 if it is not used. The sum is the number
    /// of terms.
    pub leverage: Vec<f64>,
}

impl Zeropoint {
    /// V = V_inst − ZP − k X − C (B−V) − k'' X (B−V) \[mag\].
    #[must_use]
    pub fn v_mag(&self, inst_mag: f64, airmass: f64, b_v_mag: f64) -> f64 {
        inst_mag
            - self.zp_mag
            - self.k_mag_airmass * airmass
            - self.c_mag_mag * b_v_mag
            - self.k2_mag * airmass * b_v_mag
    }

    /// Error of the calibration at an airmass and a colour \[mag\]: ±1 σ holds the truth in 68 % of nights.
    ///
    /// σ² = gᵀ Cov g + ((C + k'' X) σ_BV)², g = (1, X, B−V, X (B−V)). The covariance, the larger of the jackknives by star
    /// and by pointing, holds the noise of the stars, their intrinsic scatter and what the scatter between pointings does
    /// to the fit. Not in it: the error of V_inst itself, and the offset of the target's own line of sight
    /// ([`Zeropoint::err_one_pointing_mag`]).
    #[must_use]
    pub fn err_mag(&self, airmass: f64, b_v_mag: f64, b_v_err_mag: f64) -> f64 {
        let colour_err = if b_v_err_mag.is_nan() { 0.0 } else { b_v_err_mag };
        predicted(&self.cov, airmass, b_v_mag).hypot(self.colour_slope(airmass) * colour_err)
    }

    /// Half-width of the 95 % interval of the calibration at an airmass and a colour \[mag\].
    #[must_use]
    pub fn err_95_mag(&self, airmass: f64, b_v_mag: f64, b_v_err_mag: f64) -> f64 {
        let colour_err = if b_v_err_mag.is_nan() { 0.0 } else { marginal::SIGMAS[1] * b_v_err_mag };
        predicted(&self.cov_95, airmass, b_v_mag).hypot(self.colour_slope(airmass) * colour_err)
    }

    /// The factors of the errors of ZP, k and C for 95 %; 1.96 for a term that is held exactly.
    #[doc(hidden)]
    #[must_use]
    pub fn multipliers_95(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| {
            let ratio = (self.cov_95[i][i] / self.cov[i][i]).sqrt();
            if ratio.is_finite() { ratio } else { marginal::SIGMAS[1] }
        })
    }

    /// Its band in words, as [`CalibratedBand::text`]; `None` where it is not known.
    #[doc(hidden)]
    #[must_use]
    pub fn band_text(&self) -> Option<String> {
        let band = self.band?;
        Some(match &self.light {
            Some(light) => CalibratedBand::known(band, light.clone()).text(),
            None => band.to_string(),
        })
    }

    /// The name of its band, by [`Band::or_v`].
    #[doc(hidden)]
    #[must_use]
    pub fn band_name(&self) -> &'static str {
        Band::or_v(self.band).name()
    }

    /// The name of its colour index: B−V where it is not known, as in Caddy et al.
    #[doc(hidden)]
    #[must_use]
    pub fn colour_name(&self) -> String {
        self.colour.unwrap_or(ColourIndex::B_V).to_string()
    }

    /// `V = V_inst - ZP - k X - C (B-V)` with its own band and colour index.
    #[doc(hidden)]
    #[must_use]
    pub fn equation(&self) -> String {
        equation(self.band_name(), &self.colour_name(), self.second_order())
    }

    /// ∂V/∂(B−V) without its sign, C + k'' X.
    pub(super) fn colour_slope(&self, airmass: f64) -> f64 {
        self.c_mag_mag + self.k2_mag * airmass
    }

    /// [`Zeropoint::err_mag`] with the scatter of one pointing added \[mag\]: the error of a magnitude measured in one
    /// direction at one time, when the target's line of sight has a cloud or a flat-field error of its own like the
    /// pointings have.
    #[must_use]
    pub fn err_one_pointing_mag(&self, airmass: f64, b_v_mag: f64, b_v_err_mag: f64) -> f64 {
        let own = [self.line_of_sight_mag, self.pointing_scatter_mag].into_iter().find(|s| s.is_finite());
        self.err_mag(airmass, b_v_mag, b_v_err_mag).hypot(own.unwrap_or(0.0))
    }

    /// The error as the paper adds it up, √(σ_ZP² + σ_k² + σ_C²) \[mag\]: no airmass, no colour, no correlation.
    #[must_use]
    pub fn err_as_published_mag(&self) -> f64 {
        (self.cov[0][0] + self.cov[1][1] + self.cov[2][2]).max(0.0).sqrt()
    }

    /// `2350 star measurements of 25 stars`.
    #[doc(hidden)]
    #[must_use]
    pub fn n_words(&self) -> String {
        format!("{} star measurements of {} stars", self.n_used, self.n_stars)
    }

    /// Standard errors of (ZP, k, C).
    #[doc(hidden)]
    #[must_use]
    pub fn errs(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| self.cov[i][i].max(0.0).sqrt())
    }

    /// Whether k'' was fitted.
    #[doc(hidden)]
    #[must_use]
    pub fn second_order(&self) -> bool {
        self.k2_mag != 0.0 || self.cov[3][3] > 0.0
    }

    /// The covariance of (ZP, k, C), with k'' where it was fitted, as rows.
    #[doc(hidden)]
    #[must_use]
    pub fn covariance(&self) -> Vec<Vec<f64>> {
        let n = if self.second_order() { 4 } else { 3 };
        self.cov[..n].iter().map(|row| row[..n].to_vec()).collect()
    }
}

/// The equation of the calibration, with the sign convention.
pub(super) fn equation(band: &str, colour: &str, second_order: bool) -> String {
    let second = if second_order { format!(" - k2 X ({colour})") } else { String::new() };
    format!("{band} = {band}_inst - ZP - k X - C ({colour}){second}")
}

/// √(gᵀ Cov g), g = (1, X, B−V, X (B−V)) \[mag\].
pub(super) fn predicted(cov: &solve::Matrix, airmass: f64, b_v_mag: f64) -> f64 {
    quadratic(cov, &[1.0, airmass, b_v_mag, airmass * b_v_mag]).max(0.0).sqrt()
}

/// The note on an extinction below zero.
pub(super) fn negative_k(k: f64, err: f64) -> Option<String> {
    (k < 0.0).then(|| {
        format!(
            "k = {k:.3} +- {err:.3} is below zero: extinction is not; check the airmasses, or pin k (zeropoint.pin_k)"
        )
    })
}
