//! How much fainter the stars of one frame are than the zeropoint of the night says.
//!
//! Ratios of measured to predicted light, 1 = as predicted; offsets in magnitudes, positive = fainter. A weighted mean of the
//! ratios, in which a star that disagrees loses its weight (Tukey's biweight about the median). It does not cover where the
//! ratios are from.

use crate::base::constants::MAG_PER_LN;
use crate::base::stats;

/// Fewest stars.
const LEAST_STARS: usize = 3;
/// Stars whose error is larger than this share of their light say nothing.
const MOST_ERR: f64 = 0.4;
/// Tukey's constant \[errors\].
const TUKEY: f64 = 5.0;
/// Stars that should stand out by this many errors are counted ...
const SEEN_SNR: f64 = 5.0;
/// ... and this share of them must.
const SEEN_SHARE: f64 = 0.6;
/// Scatter of a star about its catalogue magnitude in addition to the stated error, at least \[mag\].
const LEAST_SCATTER_MAG: f64 = 0.01;
/// The stars may differ by this at most, robust standard deviation \[mag\].
const MOST_SCATTER_MAG: f64 = 0.35;
/// Ratios outside this range are no sky's: 4 mag of cloud, or half a magnitude clearer than the night.
const RATIOS: [f64; 2] = [0.025, 1.6];
/// Factor of the error where trails may end in the frame and nobody knows which: injections need it to hold 68 %.
const WITHOUT_ENDS: f64 = 1.5;
/// Error of the profile of trails and of crowding, common to all of them: without it 56 % of frames with 1200 stars/deg² lie within
/// one error \[mag\].
const PROFILE_ERR_MAG: f64 = 0.012;

/// One star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StarRatio {
    /// Measured over predicted light.
    pub ratio: f64,
    /// Its error by the noise of the pixels.
    pub err: f64,
    /// Error of the predicted magnitude by catalogue and colour \[mag\].
    pub predicted_err_mag: f64,
}

/// The offset of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameOffset {
    /// Observed minus predicted magnitude \[mag\].
    pub offset_mag: f64,
    /// Its standard error: noise, catalogue and scatter of the stars \[mag\].
    pub err_mag: f64,
    /// Stars with weight.
    pub n_stars: usize,
}

impl FrameOffset {
    /// The same where no trail end says which stars' trails end in the frame: with half as much error again.
    #[must_use]
    pub fn without_ends(self) -> Self {
        Self { err_mag: WITHOUT_ENDS * self.err_mag, ..self }
    }
}

/// The offset of a frame; `scatter_mag` is the scatter of single stars that the fit of the night found, `calibrated` whether
/// the light was predicted with a zeropoint, so that an offset must be one of the sky.
///
/// # Errors
/// The reason why the stars give none, in words.
pub fn frame_offset(stars: &[StarRatio], scatter_mag: f64, calibrated: bool) -> Result<FrameOffset, String> {
    let stars: Vec<&StarRatio> = stars.iter().filter(|s| s.ratio.is_finite() && s.err < MOST_ERR).collect();
    if stars.len() < LEAST_STARS {
        return Err(format!("{} trails stand out, {LEAST_STARS} are needed", stars.len()));
    }
    let scatter_mag = scatter_mag.max(LEAST_SCATTER_MAG);
    let sigma = |s: &StarRatio, a: f64| s.err.hypot(a / MAG_PER_LN * s.predicted_err_mag.hypot(scatter_mag));
    let mut mean = weighted_median(&stars).ok_or("the trails have no light")?;
    let (mut variance, mut n_used, mut chi2) = (0.0, 0, 0.0);
    for _ in 0..30 {
        let (mut sw, mut swr, mut sww, mut n, mut c, mut dof) = (0.0, 0.0, 0.0, 0, 0.0, 0.0);
        for s in &stars {
            let err = sigma(s, mean.max(1e-3));
            let x = (s.ratio - mean) / (TUKEY * err);
            let tukey = if x.abs() < 1.0 { (1.0 - x * x).powi(2) } else { 0.0 };
            sw += tukey / (err * err);
            swr += tukey * s.ratio / (err * err);
            sww += (tukey / err).powi(2);
            n += usize::from(tukey > 0.0);
            c += tukey * ((s.ratio - mean) / err).powi(2);
            dof += tukey;
        }
        if n < LEAST_STARS {
            return Err("the trails do not agree with each other".into());
        }
        // Var = Σ w² σ² / (Σ w)²
        (variance, n_used, chi2) = (sww / (sw * sw), n, c / (dof - 1.0).max(1.0));
        mean = swr / sw;
    }
    if calibrated && !(RATIOS[0]..RATIOS[1]).contains(&mean) {
        return Err(format!("the trails have {mean:.2} of the predicted light, which no sky explains"));
    }
    let expected: Vec<&&StarRatio> = stars.iter().filter(|s| mean > SEEN_SNR * s.err).collect();
    let there = |s: &&&StarRatio| s.ratio > 0.5 * mean - s.err;
    let n_there = expected.iter().filter(|s| there(s)).count();
    if expected.len() < LEAST_STARS || (n_there as f64) < SEEN_SHARE * expected.len() as f64 {
        return Err(format!("{n_there} of {} trails that should stand out do", expected.len()));
    }
    let mut away: Vec<f64> = expected.iter().map(|s| MAG_PER_LN * (s.ratio / mean - 1.0)).collect();
    let scatter = stats::mad_sigma(&mut away).unwrap_or(0.0);
    let noise =
        stats::median(&mut expected.iter().map(|s| MAG_PER_LN * s.err / mean).collect::<Vec<_>>()).unwrap_or(0.0);
    if scatter > MOST_SCATTER_MAG.hypot(2.0 * noise) {
        return Err(format!("the trails differ among themselves by {scatter:.2} mag"));
    }
    // more scatter than stated widens the error
    let err_mag = (MAG_PER_LN * chi2.max(1.0).sqrt() * variance.sqrt() / mean).hypot(PROFILE_ERR_MAG);
    Ok(FrameOffset { offset_mag: -2.5 * mean.log10(), err_mag, n_stars: n_used })
}

/// The ratio with half of the weight on each side.
fn weighted_median(stars: &[&StarRatio]) -> Option<f64> {
    let mut sorted: Vec<(f64, f64)> = stars.iter().map(|s| (s.ratio, s.err.hypot(0.1).powi(-2))).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * sorted.iter().map(|s| s.1).sum::<f64>();
    let mut sum = 0.0;
    for (ratio, weight) in sorted {
        sum += weight;
        if sum >= half {
            return Some(ratio);
        }
    }
    None
}
