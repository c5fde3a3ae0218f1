//! The limits of rules, and that of a survey's exposure. V magnitudes.

use crate::base::error::Result;
use crate::config::Mode;
use crate::visibility::streak::{effective_surface_brightness, width_arcsec, zenith_rate_rad_s};
use crate::visibility::survey::{LimitKind, SeeingMeaning, Survey, Tint, colour_mag};

/// Signal-to-noise ratio of a trail that is detected.
const DETECTED_SNR: f64 = 5.0;

/// A limit.
#[derive(Debug, Clone, PartialEq)]
pub struct BrightnessLimit {
    /// What sets it.
    pub name: String,
    /// What is brighter breaks it \[V mag\].
    pub v_mag: f64,
}

/// V 7 up to 550 km, `7 + 2.5 lg(h/550 km)` above.
///
/// # Source
/// Walker et al. 2020 (SATCON1, NOIRLab techdoc 102), as the IAU Centre for the Protection of the Dark and Quiet Sky quotes it.
#[must_use]
pub fn satcon1_v_mag(height_km: f64) -> f64 {
    7.0 + 2.5 * (height_km / 550.0).max(1.0).log10()
}

/// V of a sunlit satellite in the zenith whose trail a survey just detects in one exposure: its effective surface brightness is the
/// 5 σ limit of a square arcsecond.
///
/// # Errors
/// Those of [`Survey::band`], [`colour_mag`] and of an area or height that is not above 0.
pub fn survey_v_mag(survey: &Survey, band: &str, height_km: f64, area_m2: f64) -> Result<f64> {
    let visit = survey.visit(survey.band(band)?, SeeingMeaning::At500nm);
    let limit = visit.limit_mag(LimitKind::SquareArcsec, DETECTED_SNR)?;
    let width = width_arcsec(area_m2, 1e3 * height_km, survey.mirror_m, visit.fwhm_eff_arcsec)?;
    let rate_arcsec_s = zenith_rate_rad_s(height_km)?.to_degrees() * 3600.0;
    // ν of magnitude 0: what the trail spreads
    let spread = effective_surface_brightness(0.0, width, rate_arcsec_s, visit.exptime_s, Mode::Corrected);
    Ok(limit - spread.unwrap_or_default() - colour_mag(visit.band.name, Tint::Sun)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_is_7_up_to_550_km_and_that_of_its_source_above() {
        // 630 km: 7.15; 1200 km: 7.85 (as quoted)
        for (height_km, v_mag) in [(300.0, 7.0), (550.0, 7.0), (630.0, 7.147), (1200.0, 7.847)] {
            assert!((satcon1_v_mag(height_km) - v_mag).abs() < 1e-3, "{height_km}");
        }
    }

    #[test]
    fn a_trail_at_the_limit_of_a_survey_has_its_surface_brightness() {
        let rubin = Survey::named("rubin").unwrap();
        let v = survey_v_mag(&rubin, "g", 550.0, 20.0).unwrap();
        let visit = rubin.visit(rubin.band("g").unwrap(), SeeingMeaning::At500nm);
        let width = width_arcsec(20.0, 550e3, rubin.mirror_m, visit.fwhm_eff_arcsec).unwrap();
        // 7.58 km/s at 550 km: 0.79 deg/s; F/(θ ω t) per square arcsecond
        let moved = 7.585 / 550.0 * 206_264.8 * visit.exptime_s;
        let nu = v + colour_mag("g", Tint::Sun).unwrap() + 2.5 * (width * moved).log10();
        let limit = visit.limit_mag(LimitKind::SquareArcsec, 5.0).unwrap();
        assert!((nu - limit).abs() < 0.01, "{nu} {limit}");
        // a faster, nearer satellite must be brighter to be seen
        assert!(survey_v_mag(&rubin, "g", 300.0, 20.0).unwrap() < v);
    }
}
