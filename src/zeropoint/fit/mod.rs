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

use crate::base::error::{Error, Result};
use crate::base::stats;
use crate::config::{self, Estimator};
use crate::zeropoint::bands::{Band, Calibrated, Light};
pub use file::NO_ZEROPOINT;
pub use pointings::Pointing;
use rows::Rows;
use solve::quadratic;
use terms::Term;

/// One catalogue star measured in one pointing. An error that is NaN or not positive is unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StarMeasurement {
    /// Instrumental magnitude, −2.5 log10(e⁻/s) \[mag\].
    pub inst_mag: f64,
    /// Its random error \[mag\].
    pub inst_err_mag: f64,
    /// Catalogue V \[mag\].
    pub v_mag: f64,
    /// Its error \[mag\].
    pub v_err_mag: f64,
    /// Catalogue B−V \[mag\]; may be NaN only where the colour term is pinned to 0.
    pub b_v_mag: f64,
    /// Its error \[mag\].
    pub b_v_err_mag: f64,
    /// Airmass X of the star or of its pointing.
    pub airmass: f64,
    /// Which pointing; stars of one pointing may share an error (a cloud).
    pub pointing: usize,
    /// Which star: the catalogue's error of a star is the same in all of its measurements. `None`: a star of its own.
    pub star: Option<usize>,
}

/// A zeropoint with all that is needed to use and to judge it.
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
    /// Covariance whose ±√(gᵀ Cov g) holds the truth in 95 % of nights: wider than 1.96 σ where few stars or pointings tell
    /// the scatter.
    pub cov_95: [[f64; 4]; 4],
    /// Covariance of the model: noise of the stars and an offset per pointing.
    pub cov_model: [[f64; 4]; 4],
    /// Covariance by leaving out one star at a time.
    pub cov_star_jackknife: Option<[[f64; 4]; 4]>,
    /// Covariance by leaving out one pointing at a time; `None` with fewer than five.
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
    /// Scatter of the pointings' own offsets \[mag\]; NaN where it cannot be told from that of the stars.
    pub pointing_scatter_mag: f64,
    /// Scatter of one line of sight \[mag\]: that of the pointings, or what is known of the site where few tell it.
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
    /// Terms the stars can tell apart, ZP included.
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
    pub band: Option<Band>,
    /// Filter of the star frames; the fit does not know it either.
    pub light: Option<Light>,
    /// How k came about: `fitted`, `pinned 0.12`, `refused: all stars within 0.02 airmass`.
    pub k_note: String,
    /// How C came about.
    pub c_note: String,
    /// How k'' came about, and whether the stars ask for it.
    pub k2_note: String,
    /// Where the covariance is from.
    pub cov_note: String,
    /// Colour of the target and its error \[mag\], for the errors told in the file; NaN if unknown.
    pub target_b_v_mag: [f64; 2],
    /// The pointings, by number.
    pub pointings: Vec<Pointing>,
    /// What the observer should know.
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

    /// What the errors of ZP, k and C are multiplied by for 95 %; 1.96 for a term that is held exactly.
    #[must_use]
    pub fn multipliers_95(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| {
            let ratio = (self.cov_95[i][i] / self.cov[i][i]).sqrt();
            if ratio.is_finite() { ratio } else { marginal::SIGMAS[1] }
        })
    }

    /// Its band in words, as [`Calibrated::text`]; `None` where it is not known.
    #[must_use]
    pub fn band_text(&self) -> Option<String> {
        let band = self.band?;
        Some(match &self.light {
            Some(light) => Calibrated::known(band, light.clone()).text(),
            None => band.to_string(),
        })
    }

    /// The name of its band, V where it does not say.
    #[must_use]
    pub fn band_name(&self) -> &'static str {
        self.band.unwrap_or(Band::V).name()
    }

    /// ∂V/∂(B−V) without its sign, C + k'' X.
    fn colour_slope(&self, airmass: f64) -> f64 {
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
    #[must_use]
    pub fn n_words(&self) -> String {
        format!("{} star measurements of {} stars", self.n_used, self.n_stars)
    }

    /// Standard errors of (ZP, k, C).
    #[must_use]
    pub fn errs(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| self.cov[i][i].max(0.0).sqrt())
    }

    /// Whether k'' was fitted.
    #[must_use]
    pub fn second_order(&self) -> bool {
        self.k2_mag != 0.0 || self.cov[3][3] > 0.0
    }

    /// The covariance of (ZP, k, C), with k'' where it was fitted, as rows.
    #[must_use]
    pub fn covariance(&self) -> Vec<Vec<f64>> {
        let n = if self.second_order() { 4 } else { 3 };
        self.cov[..n].iter().map(|row| row[..n].to_vec()).collect()
    }
}

/// √(gᵀ Cov g), g = (1, X, B−V, X (B−V)) \[mag\].
fn predicted(cov: &solve::Matrix, airmass: f64, b_v_mag: f64) -> f64 {
    quadratic(cov, &[1.0, airmass, b_v_mag, airmass * b_v_mag]).max(0.0).sqrt()
}

/// Fits ZP, k, C and, where asked for, k''.
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

/// What should be known of an extinction below zero.
fn negative_k(k: f64, err: f64) -> Option<String> {
    (k < 0.0).then(|| {
        format!(
            "k = {k:.3} +- {err:.3} is below zero: extinction is not; check the airmasses, or pin k (zeropoint.pin_k)"
        )
    })
}

/// The fit of rows whose terms are decided.
fn fit_rows(rows: &Rows, config: &config::Zeropoint, n_input: usize) -> Result<Zeropoint> {
    if config.estimator == Estimator::Ols {
        return Ok(report::report(rows, &robust::ols(rows)?, None, config, n_input));
    }
    let fit = robust::reweighted(rows, config.estimator, config)?;
    if config.estimator == Estimator::Huber {
        // Huber's weights reject nobody and follow a majority of outliers: whether there is one, the biweight tells
        check_majority(rows, &robust::reweighted(rows, Estimator::Robust, config)?, config)?;
    }
    check_majority(rows, &fit, config)?;
    let rejected = fit.weights.iter().filter(|w| **w == 0.0).count();
    rows.enough(rows.len() - rejected, config.min_stars, &format!("{rejected} rejected as outliers"))?;
    let (cleared, fit, clouds) = without_clouds(rows, fit, config)?;
    Ok(report::report(&cleared, &fit, clouds.as_ref(), config, n_input))
}

/// Rounds of telling clouds and fitting without them.
const CLOUD_ROUNDS: usize = 3;

/// The rows with the expected clouds taken out and their fit, where some pointings are under clouds; as they are where none
/// is believed in.
fn without_clouds(
    rows: &Rows,
    fit: robust::Fit,
    config: &config::Zeropoint,
) -> Result<(Rows, robust::Fit, Option<clouds::Clouds>)> {
    let look = |rows: &Rows, fit: &robust::Fit, taken: &[f64]| {
        let sums = fit.sums(rows);
        let stars = fit.offsets_of_stars(rows);
        let one = |p: usize| {
            let (d, w) = sums.pointing_residual(p, &fit.theta, &stars);
            (d + taken.get(p).copied().unwrap_or(0.0), w.recip())
        };
        let (d, v): (Vec<f64>, Vec<f64>) = (0..rows.pointings.len()).map(one).unzip();
        clouds::find(&d, &v)
    };
    let first = if robust::has_pointings(rows) { look(rows, &fit, &[]) } else { None };
    let Some(mut found) = first else { return Ok((rows.clone(), fit, None)) };
    let mut out = (rows.clone(), fit);
    for _ in 0..CLOUD_ROUNDS {
        let shift: Vec<f64> = rows.group.iter().map(|p| found.mean_mag[*p]).collect();
        let cleared = rows.shifted(&shift);
        let fit = robust::reweighted(&cleared, config.estimator, config)?;
        let next = look(&cleared, &fit, &found.mean_mag);
        out = (cleared, fit);
        let Some(next) = next else { break };
        found = next;
    }
    Ok((out.0, out.1, Some(found)))
}

/// Standard errors of the share of outliers within which a majority is in doubt, and the most they may take.
const DOUBT: (f64, f64) = (2.0, 0.1);
/// Rejected stars that agree with one another as well as this share of the good ones are a rival.
const RIVAL: f64 = 0.5;

/// Fails where a majority of good stars is not beyond doubt: then the fit may be that of the bad ones.
fn check_majority(rows: &Rows, fit: &robust::Fit, config: &config::Zeropoint) -> Result<()> {
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
    let doubt = (DOUBT.0 * (share * (1.0 - share) / independent).sqrt()).min(DOUBT.1);
    let agree = agreeing(rows, fit);
    let rival = agree as f64 > RIVAL * (n - rejected as f64) && rows.len() >= start::FEW;
    if !rival && share + doubt <= config.max_rejected_frac.max(0.0) || config.max_rejected_frac >= 1.0 {
        return Ok(());
    }
    let why = if rival {
        format!(", and {agree} of the rejected agree with one another")
    } else {
        format!(
            ", +- {doubt:.2} at {} sigma, exceeds zeropoint.max_rejected_frac = {}",
            DOUBT.0, config.max_rejected_frac
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
fn agreeing(rows: &Rows, fit: &robust::Fit) -> usize {
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

/// The median of values, which are reordered; 0 if there are none.
fn median(values: &mut [f64]) -> f64 {
    stats::median(values).unwrap_or(0.0)
}
