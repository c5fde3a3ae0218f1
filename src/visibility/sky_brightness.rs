//! The brightness of the sky: the dark sky, the Moon's scattered light, twilight.
//!
//! V mag/arcsec² and nanolamberts, angles in rad. Starlight, zodiacal light and airglow are in the dark value;
//! excluded: their place on the sky, towns, clouds, the surge of the full Moon, and the sky while the Sun is above −5°.

use crate::base::error::{Error, Result};
use crate::brightness::light_sources::{FULL_MOON_V_MAG, moon_v_mag};

/// Dark V sky at a good site near the zenith \[mag/arcsec²\] (Krisciunas & Schaefer 1991, Mauna Kea: 21.587).
pub const DARK_V_MAG_ARCSEC2: f64 = 21.587;
/// Extinction in V of Krisciunas & Schaefer 1991 \[mag/airmass\].
pub const K_V_MAG_AIRMASS: f64 = 0.172;
/// Distance from the Moon below which the law of its scattered light was not fitted \[deg\].
pub const LEAST_MOON_SEP_DEG: f64 = 10.0;

/// Sun's altitude from which on the sky is daylight to the twilight law \[deg\].
const DAY_ALT_DEG: f64 = -5.0;
/// Sun's altitude at which the twilight law ends \[deg\].
const TWILIGHT_FIT_ALT_DEG: f64 = -15.0;
/// Sun's altitude at which astronomical twilight ends \[deg\].
pub const NIGHT_ALT_DEG: f64 = -18.0;
/// V of the night sky the twilight law ends in \[mag/arcsec²\] (Patat 2003, A&A 400, 1183: Paranal, zenith).
const PARANAL_DARK_V: f64 = 21.6;
/// How fast twilight fades past its law's end \[mag/deg\]: the slope it has from −5° to −10°; ours, unvalidated.
const TWILIGHT_FADING_MAG_DEG: f64 = 1.14;

/// Where the Moon stands for the sky's brightness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoonInSky {
    /// Altitude \[rad\].
    pub alt_rad: f64,
    /// Phase angle, 0 = full \[rad\].
    pub phase_rad: f64,
    /// Distance from the line of sight \[rad\].
    pub sep_rad: f64,
}

/// Nanolamberts of a V surface brightness \[mag/arcsec²\]: `B = 34.08 exp(20.7233 − 0.92104 V)` (Garstang 1989, by way
/// of Krisciunas & Schaefer 1991, Eq. 1).
#[must_use]
pub fn nl_of_v_mag_arcsec2(v_mag_arcsec2: f64) -> f64 {
    34.08 * (20.7233 - 0.92104 * v_mag_arcsec2).exp()
}

/// V surface brightness \[mag/arcsec²\] of nanolamberts; infinite without light.
#[must_use]
pub fn v_mag_arcsec2_of_nl(nl: f64) -> f64 {
    (20.7233 - (nl / 34.08).ln()) / 0.92104
}

/// The Moon's light scattered into a line of sight at altitude `alt_rad` \[nL\]; 0 with the Moon below the horizon.
///
/// `B = f(ρ) I* 10^(−0.4 k X(Z_m)) (1 − 10^(−0.4 k X(Z)))`, `I* = 10^(−0.4 (3.84 + 0.026|α| + 4·10⁻⁹ α⁴))`,
/// `f(ρ) = 10^5.36 (1.06 + cos²ρ) + 10^(6.15 − ρ/40)`, `X(Z) = (1 − 0.96 sin²Z)^−½`. Without the surge of the full
/// Moon; fitted for ρ above 10°.
///
/// # Source
/// Krisciunas & Schaefer 1991, PASP 103, 1033, Eqs. 3, 15, 20, 21.
#[must_use]
pub fn moonlight_nl(k_mag_airmass: f64, alt_rad: f64, moon: MoonInSky) -> f64 {
    if !(moon.alt_rad > 0.0) {
        return 0.0;
    }
    let path = |alt: f64| (1.0 - 0.96 * alt.cos().powi(2)).powf(-0.5);
    let rho_deg = moon.sep_rad.to_degrees();
    // 3.84 stands for the full Moon's −12.73
    let i_star = 10f64.powf(-0.4 * (3.84 + moon_v_mag(moon.phase_rad.to_degrees()) - FULL_MOON_V_MAG));
    let f = 10f64.powf(5.36) * (1.06 + moon.sep_rad.cos().powi(2)) + 10f64.powf(6.15 - rho_deg / 40.0);
    let through = |x: f64| 10f64.powf(-0.4 * k_mag_airmass * x);
    f * i_star * through(path(moon.alt_rad)) * (1.0 - through(path(alt_rad)))
}

/// Surface brightness of the sky \[V mag/arcsec²\] at altitude `alt_rad`: the dark sky and [`moonlight_nl`].
#[must_use]
pub fn moonlit_sky_v_mag_arcsec2(
    dark_v_mag_arcsec2: f64,
    k_mag_airmass: f64,
    alt_rad: f64,
    moon: Option<MoonInSky>,
) -> f64 {
    let moon_nl = moon.map_or(0.0, |moon| moonlight_nl(k_mag_airmass, alt_rad, moon));
    v_mag_arcsec2_of_nl(nl_of_v_mag_arcsec2(dark_v_mag_arcsec2) + moon_nl)
}

/// Twilight at the zenith \[nL\], the night sky subtracted; 0 with the Sun below −18°.
///
/// `V = 11.84 + 1.518 x − 0.057 x²` with the Sun `5° + x` below the horizon, x from 0° to 10°, less the dark sky of
/// Paranal; from −15° to −18° it fades by 1.14 mag/deg (0.01 mag of a dark sky where it is cut off).
///
/// # Errors
/// [`Error::Model`] with the Sun above −5°: the sky of the day is not known here.
///
/// # Source
/// Patat, Ugolnikov & Postylyakov 2006, A&A 455, 385, Table 1 (zenith of Paranal, 0.18 mag).
pub fn twilight_nl(sun_alt_rad: f64) -> Result<f64> {
    let sun_alt_deg = sun_alt_rad.to_degrees();
    if !(sun_alt_deg <= DAY_ALT_DEG + 1e-9) {
        let problem = format!(
            "the Sun's altitude {sun_alt_deg:.2} deg is above {DAY_ALT_DEG} deg: the daytime sky is not modelled; give its \
             brightness itself"
        );
        return Err(Error::Model { problem });
    }
    if sun_alt_deg < NIGHT_ALT_DEG {
        return Ok(0.0);
    }
    let law_nl = |alt_deg: f64| {
        let x = DAY_ALT_DEG - alt_deg;
        nl_of_v_mag_arcsec2(11.84 + 1.518 * x - 0.057 * x * x) - nl_of_v_mag_arcsec2(PARANAL_DARK_V)
    };
    let past_deg = (TWILIGHT_FIT_ALT_DEG - sun_alt_deg).max(0.0);
    Ok(law_nl(sun_alt_deg.max(TWILIGHT_FIT_ALT_DEG)) * 10f64.powf(-0.4 * TWILIGHT_FADING_MAG_DEG * past_deg))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moon(alt_deg: f64, phase_deg: f64, sep_deg: f64) -> MoonInSky {
        MoonInSky { alt_rad: alt_deg.to_radians(), phase_rad: phase_deg.to_radians(), sep_rad: sep_deg.to_radians() }
    }

    #[test]
    fn the_moonlit_sky_is_that_of_an_independent_evaluation() {
        // α 30°, ρ 60°, Moon at 60° altitude, line of sight at 45°, k 0.172
        let nl = moonlight_nl(0.172, 45f64.to_radians(), moon(60.0, 30.0, 60.0));
        assert!((nl / 802.210_273_694_172_2 - 1.0).abs() < 1e-4, "{nl}");
    }

    #[test]
    fn a_full_moon_brightens_the_sky_as_in_krisciunas_and_schaefer() {
        // Their Table 2 scale: full Moon at zenith distance 30 deg, 60 deg away, k = 0.172: about 3.5 mag brighter.
        let alt = 60f64.to_radians();
        let v = moonlit_sky_v_mag_arcsec2(DARK_V_MAG_ARCSEC2, 0.172, alt, Some(moon(60.0, 0.0, 60.0)));
        assert!((17.5..18.7).contains(&v), "{v}");
    }

    #[test]
    fn a_moon_below_the_horizon_adds_nothing() {
        let v = moonlit_sky_v_mag_arcsec2(DARK_V_MAG_ARCSEC2, 0.172, 1.0, Some(moon(-5.0, 0.0, 57.0)));
        assert!((v - DARK_V_MAG_ARCSEC2).abs() < 1e-9);
    }

    #[test]
    fn magnitudes_and_nanolamberts_are_each_others_inverse() {
        for v in [3.0, 12.0, 18.3, 21.587, 26.0] {
            assert!((v_mag_arcsec2_of_nl(nl_of_v_mag_arcsec2(v)) - v).abs() < 1e-12, "{v}");
        }
        assert_eq!(v_mag_arcsec2_of_nl(0.0), f64::INFINITY);
    }

    #[test]
    fn twilight_is_the_law_of_paranal_then_fades_to_night() {
        // the law itself, the night sky put back
        for (sun_alt_deg, v) in [(-5.0, 11.84), (-8.0, 15.881), (-12.0, 19.673), (-15.0, 21.32)] {
            let nl = twilight_nl(f64::to_radians(sun_alt_deg)).unwrap() + nl_of_v_mag_arcsec2(PARANAL_DARK_V);
            assert!((v_mag_arcsec2_of_nl(nl) - v).abs() < 1e-9, "{sun_alt_deg}");
        }
        let mut before = twilight_nl(-5f64.to_radians()).unwrap();
        for j in 501..=1_800 {
            let now = twilight_nl((-0.01 * f64::from(j)).to_radians()).unwrap();
            assert!(now < before && now > 0.97 * before, "{j}: {before} {now}");
            before = now;
        }
        assert_eq!(twilight_nl(-20f64.to_radians()).unwrap(), 0.0);
        // what is cut off at −18° is a hundredth of the night sky
        assert!(before / nl_of_v_mag_arcsec2(PARANAL_DARK_V) < 0.014, "{before}");
    }

    #[test]
    fn the_sky_of_the_day_is_an_error_that_says_so() {
        for sun_alt_deg in [-4.0, 0.0, 30.0, f64::NAN] {
            let error = twilight_nl(f64::to_radians(sun_alt_deg)).unwrap_err().to_string();
            assert!(error.contains("daytime sky is not modelled"), "{error}");
        }
    }
}
