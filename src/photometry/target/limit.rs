//! How bright a point source must be for 95 % of those in the search region to be detected.
//!
//! Electrons and cutout pixels. The flux of a point and its error are measured at places spread over the search region, as
//! the target's are: a source is detected there if it lifts that to the threshold. It does not cover sources wider than a
//! star, for which the limit is scaled by the night.

use ndarray::Array2;
use statrs::function::erf::erf;

use crate::base::stats;
use crate::frames::{Electrons, Frame};
use crate::photometry::background::Background;
use crate::photometry::flux::detectable_e;
use crate::photometry::target::compact::least_significance;
use crate::photometry::target::cutout::Cutout;
use crate::photometry::target::settings::TargetSettings;
use crate::photometry::target::sharpness::share_kept;

/// Share of the sources that are detected at the limit.
pub const LIMIT_COMPLETENESS: f64 = 0.95;
/// A flux so many errors above a threshold passes it that often.
pub const LIMIT_MARGIN_SIGMA: f64 = 1.644_853_627;
/// Places that are looked at.
const PLACES: usize = 32;
/// A limit this many times that of the middle place says nothing of the frame.
const MOST: f64 = 1e4;

/// A place without a source: the flux of a point there, its error, and its variance per electron of a source.
struct Empty {
    flux_e: f64,
    err_e: f64,
    photons: f64,
}

impl Cutout {
    /// The flux of point sources of which 95 % would be detected in the search region \[e⁻\]; NaN where there is none:
    /// more than 5 % of the region has no pixels, or no source stands out there.
    ///
    /// A source of flux t passes at a place of error σ₀ with `t + f ≥ detect_sigma √(σ₀² + p t)` and, where it fits best, with
    /// `t + f + σ₀²/t ≥ T σ₀` ([`least_significance`]), f ~ N(f̄, s²σ₀² + p t): what the places hold by themselves, s being
    /// their scatter in units of their error, and the photons. Where stars are hardly wider than hits, some that pass are taken for one
    /// ([`share_kept`]).
    /// `objects` are the cells that are no sky ([`Self::objects`]).
    pub fn limit_e(
        &self,
        frame: &Frame<Electrons>,
        background: &Background,
        objects: &Array2<bool>,
        s: &TargetSettings,
    ) -> f64 {
        let (ox, oy) = self.origin(frame);
        let (mut tried, mut empty) = (0, Vec::new());
        for (x, y) in places(s) {
            let (x, y) = (x - ox, y - oy);
            let (ny, nx) = self.pixels.dim();
            if !(x > -0.5 && y > -0.5 && x < nx as f64 - 0.5 && y < ny as f64 - 0.5) {
                continue;
            }
            // outside the clip circle is no part of the region
            let cell = |at: f64| self.net.in_cells(at).round().max(0.0) as usize;
            let Some(mean) = self.net.mean.get((cell(y), cell(x))) else { continue };
            tried += 1;
            if !mean.is_finite() {
                continue;
            }
            let Some(point) = self.forced_flux(frame, background, (x, y), objects, s) else { continue };
            let (flux_e, err_e, photons) = (point.flux.flux_e, point.empty_err_e, point.photons);
            if flux_e.is_finite() && err_e > 0.0 {
                empty.push(Empty { flux_e, err_e, photons });
            }
        }
        let kept = |snr: f64| share_kept(snr, self.hits_fwhm_px);
        completeness_limit(&empty, tried, (s.detect_sigma, least_significance(s, self.skewness())), kept)
    }
}

/// The flux at which 95 % of `tried` places show a source, `empty` being those that can, `kept` the share that is no hit by its
/// significance.
fn completeness_limit(
    empty: &[Empty],
    tried: usize,
    (detect_sigma, least_sigma): (f64, f64),
    kept: impl Fn(f64) -> f64,
) -> f64 {
    if empty.len() < 4 || (empty.len() as f64) < LIMIT_COMPLETENESS * tried as f64 {
        return f64::NAN;
    }
    let mut pulls: Vec<f64> = empty.iter().map(|e| e.flux_e / e.err_e).collect();
    let shift = stats::median(&mut pulls).unwrap_or(0.0);
    let scatter = stats::mad_sigma(&mut pulls).unwrap_or(1.0).max(1.0);
    let detected = |t: f64| {
        let passed = |e: &Empty| {
            let whole = detect_sigma * (e.err_e * e.err_e + e.photons * t).sqrt();
            let needed = whole.max(least_sigma * e.err_e - e.err_e * e.err_e / t);
            let sd = ((scatter * e.err_e).powi(2) + e.photons * t).sqrt();
            let seen = 0.5 * (1.0 + erf((t + shift * e.err_e - needed) / (sd * std::f64::consts::SQRT_2)));
            seen * kept(t / (e.err_e * e.err_e + e.photons * t).sqrt())
        };
        empty.iter().map(passed).sum::<f64>() / tried as f64
    };
    let mut errors: Vec<f64> = empty.iter().map(|e| e.err_e).collect();
    let least = detectable_e(0.0, stats::median(&mut errors).unwrap_or(f64::NAN), detect_sigma);
    let (mut low, mut high) = (0.1 * least, MOST * least);
    if detected(high) < LIMIT_COMPLETENESS {
        return f64::NAN;
    }
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        if detected(middle) < LIMIT_COMPLETENESS { low = middle } else { high = middle }
    }
    high
}

/// Places spread evenly over the search region: the sunflower's spiral.
fn places(s: &TargetSettings) -> impl Iterator<Item = (f64, f64)> {
    let (x, y, radius) = (s.x_px, s.y_px, s.search_radius_px);
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..PLACES).map(move |k| {
        let (r, angle) = (radius * ((k as f64 + 0.5) / PLACES as f64).sqrt(), golden * k as f64);
        (x + r * angle.cos(), y + r * angle.sin())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_places_need_the_threshold_and_1_645_errors_and_a_region_of_holes_has_no_limit() {
        let place = |k: i32| Empty { flux_e: f64::from(k % 3 - 1), err_e: 1e4, photons: 1.0 };
        let empty: Vec<Empty> = (0..40).map(place).collect();
        let limit = completeness_limit(&empty, 40, (5.0, 5.0), |_| 1.0);
        assert!((limit / 1e4 - 6.645).abs() < 0.01, "{limit}");
        // where some are taken for hits, the source must be brighter
        let sharper = completeness_limit(&empty, 40, (5.0, 5.0), |snr| share_kept(snr, 1.5));
        assert!(sharper > 1.03 * limit && share_kept(sharper / 1e4, 1.5) > 0.95, "{sharper}");
        assert!(sharper < 1.3 * limit, "{sharper}"); // not much: a point is expected in every frame
        let seen = 0.5 * (1.0 + erf((sharper / 1e4 - 5.0) / std::f64::consts::SQRT_2));
        assert!((seen * share_kept(sharper / 1e4, 1.5) - 0.95).abs() < 1e-3, "{sharper}");
        // 5 % of the places without pixels leave nothing for noise
        assert!(completeness_limit(&empty, 42, (5.0, 5.0), |_| 1.0) > 1.1 * limit);
        assert!(completeness_limit(&empty, 43, (5.0, 5.0), |_| 1.0).is_nan());
        assert!(completeness_limit(&[], 0, (5.0, 5.0), |_| 1.0).is_nan());
    }
}
