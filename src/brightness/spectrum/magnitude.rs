//! Magnitudes: the ratio law, the AB zero point, and the published model's own conversion.
//!
//! ⟨f_ν⟩ in W m⁻² Hz⁻¹. No floor: faint is faint, and no light has no magnitude.

use crate::config::Mode;

/// Which source has magnitude 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MagSystem {
    /// Vega, by way of the Sun: the Sun's magnitude in this system fixes the zero point.
    Vega,
    /// A flat spectrum of 3631 Jy.
    Ab,
}

/// AB magnitude of a band's mean ⟨f_ν⟩ \[W m⁻² Hz⁻¹\]: `m = −2.5 lg ⟨f_ν⟩ − 56.1`; `None` for no light.
///
/// Source: Oke & Gunn 1983, ApJ 266, 713 (−48.60 in erg s⁻¹ cm⁻² Hz⁻¹).
#[must_use]
pub fn ab_mag(f_nu_w_m2_hz: f64) -> Option<f64> {
    (f_nu_w_m2_hz > 0.0 && f_nu_w_m2_hz.is_finite()).then(|| -2.5 * f_nu_w_m2_hz.log10() - 56.1)
}

/// Ratio of brightness of a difference of magnitudes: `10^(0.4 Δm)`; as published `2.5^Δm`.
///
/// deviates: the paper's I_Sun/I_Moon prints 2.5 for 2.512: 372 500 for 398 100 at 14 mag.
#[must_use]
pub fn brightness_ratio(delta_mag: f64, mode: Mode) -> f64 {
    match mode {
        Mode::AsPublished => 2.5_f64.powf(delta_mag),
        Mode::Corrected => 10.0_f64.powf(0.4 * delta_mag),
    }
}

/// AB magnitude of an irradiance \[W/m²\] as the published model has it: all of it λ f_λ at 532 nm, c = 3·10⁸ m/s.
///
/// `m = −2.5 lg (I λ/c / 3631·10⁻²⁶)`. 1360 W/m² is −27.06, the Sun's V is −26.76: 0.30 mag too bright. The clip of the
/// published code at 10⁻⁵ (magnitude 12.5) is excluded. `None` for no light.
#[must_use]
pub fn published_ab_mag(irradiance_w_m2: f64) -> Option<f64> {
    let f_nu_zero = irradiance_w_m2 * 532e-9 / 3e8 / 3631e-26;
    (f_nu_zero > 0.0 && f_nu_zero.is_finite()).then(|| -2.5 * f_nu_zero.log10())
}
