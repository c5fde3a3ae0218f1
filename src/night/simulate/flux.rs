//! Magnitudes to electrons per second: the star law and the moonlit sky.

use super::scenario::{Photometric, Sky};

/// Electrons per second of a star of magnitude `v_mag` and colour `b_v_mag` at airmass X.
///
/// V_inst = V + ZP + k X + C (B−V), rate = 10^(−0.4 V_inst).
pub fn rate_e_s(p: &Photometric, v_mag: f64, b_v_mag: f64, airmass: f64) -> f64 {
    10f64.powf(-0.4 * (v_mag + p.zp_mag + p.k_mag_airmass * airmass + p.c_mag_mag * b_v_mag))
}

/// Where the Moon stands for the sky's brightness.
#[derive(Debug, Clone, Copy)]
pub struct MoonInSky {
    /// Altitude \[rad\].
    pub alt_rad: f64,
    /// Phase angle, 0 = full \[rad\].
    pub phase_rad: f64,
    /// Distance from the line of sight \[rad\].
    pub sep_rad: f64,
}

/// Surface brightness of the sky \[V mag/arcsec²\] at altitude `alt_rad`.
///
/// Krisciunas & Schaefer 1991 (PASP 103, 1033), Eqs. 15-21:
/// B_moon = f(ρ) I* 10^(−0.4 k X(Z_m)) (1 − 10^(−0.4 k X(Z))), I* = 10^(−0.4 (3.84 + 0.026|α| + 4·10⁻⁹ α⁴)),
/// f(ρ) = 10^5.36 (1.06 + cos²ρ) + 10^(6.15 − ρ/40), X(Z) = (1 − 0.96 sin²Z)^−½, B in nanolamberts.
/// No twilight: the night is dark but for the Moon.
pub fn sky_v_mag_arcsec2(sky: &Sky, k_mag_airmass: f64, alt_rad: f64, moon: Option<MoonInSky>) -> f64 {
    // B [nL] = 34.08 exp(20.7233 − 0.92104 V)
    let dark_nl = 34.08 * (20.7233 - 0.92104 * sky.dark_v_mag_arcsec2).exp();
    let moon_nl = match moon {
        Some(m) if sky.moonlight && m.alt_rad > 0.0 => {
            let path = |alt: f64| (1.0 - 0.96 * alt.cos().powi(2)).powf(-0.5);
            let (alpha, rho) = (m.phase_rad.to_degrees().abs(), m.sep_rad.to_degrees());
            let i_star = 10f64.powf(-0.4 * (3.84 + 0.026 * alpha + 4e-9 * alpha.powi(4)));
            let f = 10f64.powf(5.36) * (1.06 + m.sep_rad.cos().powi(2)) + 10f64.powf(6.15 - rho / 40.0);
            let through = |x: f64| 10f64.powf(-0.4 * k_mag_airmass * x);
            f * i_star * through(path(m.alt_rad)) * (1.0 - through(path(alt_rad)))
        }
        _ => 0.0,
    };
    (20.7233 - ((dark_nl + moon_nl) / 34.08).ln()) / 0.92104
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKY: Sky = Sky { dark_v_mag_arcsec2: 21.587, moonlight: true, gradient_frac: 0.0 };

    #[test]
    fn a_full_moon_brightens_the_sky_as_in_krisciunas_and_schaefer() {
        // Their Table 2 scale: full Moon at zenith distance 30 deg, 60 deg away, k = 0.172: about 3.5 mag brighter.
        let moon = MoonInSky { alt_rad: 60f64.to_radians(), phase_rad: 0.0, sep_rad: 60f64.to_radians() };
        let v = sky_v_mag_arcsec2(&SKY, 0.172, 60f64.to_radians(), Some(moon));
        assert!((17.5..18.7).contains(&v), "{v}");
    }

    #[test]
    fn a_moon_below_the_horizon_adds_nothing() {
        let moon = MoonInSky { alt_rad: -0.1, phase_rad: 0.0, sep_rad: 1.0 };
        let v = sky_v_mag_arcsec2(&SKY, 0.172, 1.0, Some(moon));
        assert!((v - SKY.dark_v_mag_arcsec2).abs() < 1e-9);
    }

    #[test]
    fn five_magnitudes_are_a_factor_of_a_hundred() {
        let p = Photometric { zp_mag: -23.0, k_mag_airmass: 0.1, c_mag_mag: 0.05, pointing_scatter_mag: 0.0 };
        let ratio = rate_e_s(&p, 10.0, 0.6, 1.3) / rate_e_s(&p, 15.0, 0.6, 1.3);
        assert!((ratio - 100.0).abs() < 1e-9);
    }
}
