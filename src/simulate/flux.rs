//! Magnitudes to electrons per second: the star law and the moonlit sky.

use super::scenario::{Photometric, Sky};
use crate::base::error::Result;
use crate::visibility::sky_brightness::{
    MoonInSky, moonlit_sky_v_mag_arcsec2, nl_of_v_mag_arcsec2, twilight_nl, v_mag_arcsec2_of_nl,
};

/// Electrons per second of a star of magnitude `v_mag` and colour `b_v_mag` at airmass X.
///
/// V_inst = V + ZP + k X + C (B−V), rate = 10^(−0.4 V_inst).
pub fn rate_e_s(p: &Photometric, v_mag: f64, b_v_mag: f64, airmass: f64) -> f64 {
    10f64.powf(-0.4 * (v_mag + p.zp_mag + p.k_mag_airmass * airmass + p.c_mag_mag * b_v_mag))
}

/// Surface brightness of the sky \[V mag/arcsec²\] at altitude `alt_rad`, with moonlight and the twilight of the zenith
/// where the scenario has them.
///
/// # Errors
/// [`Error::Model`](crate::Error::Model) with twilight and the Sun above −5°.
pub fn sky_v_mag_arcsec2(
    sky: &Sky,
    k_mag_airmass: f64,
    alt_rad: f64,
    moon: Option<MoonInSky>,
    sun_alt_rad: f64,
) -> Result<f64> {
    let moon = moon.filter(|_| sky.moonlight);
    let night = moonlit_sky_v_mag_arcsec2(sky.dark_v_mag_arcsec2, k_mag_airmass, alt_rad, moon);
    if !sky.twilight {
        return Ok(night);
    }
    Ok(v_mag_arcsec2_of_nl(nl_of_v_mag_arcsec2(night) + twilight_nl(sun_alt_rad)?))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_scenario_without_moonlight_has_a_dark_sky_under_a_full_moon() {
        let moon = MoonInSky { alt_rad: 1.0, phase_rad: 0.0, sep_rad: 1.0 };
        let sky = |moonlight, twilight| Sky { dark_v_mag_arcsec2: 21.587, moonlight, twilight, gradient_frac: 0.0 };
        let v = |moonlight, twilight: bool, sun_alt_deg: f64| {
            sky_v_mag_arcsec2(&sky(moonlight, twilight), 0.172, 1.0, Some(moon), sun_alt_deg.to_radians())
        };
        assert!((v(false, false, -6.0).unwrap() - 21.587).abs() < 1e-9 && v(true, false, -6.0).unwrap() < 19.0);
        // Patat et al. 2006: 13.3 mag/arcsec² with the Sun at −6°, and the dark sky once it is below −18°
        assert!((v(false, true, -6.0).unwrap() - 13.3).abs() < 0.05);
        assert!((v(false, true, -19.0).unwrap() - 21.587).abs() < 1e-9);
        assert!(v(false, true, -4.0).is_err());
    }

    #[test]
    fn five_magnitudes_are_a_factor_of_a_hundred() {
        let p = Photometric { zp_mag: -23.0, k_mag_airmass: 0.1, c_mag_mag: 0.05, pointing_scatter_mag: 0.0 };
        let ratio = rate_e_s(&p, 10.0, 0.6, 1.3) / rate_e_s(&p, 15.0, 0.6, 1.3);
        assert!((ratio - 100.0).abs() < 1e-9);
    }
}
