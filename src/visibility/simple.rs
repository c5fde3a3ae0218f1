//! The published simple model: a flat Lambert panel under one light source, its magnitude and its surface brightness.
//!
//! Areas in m², distances in m, angles in rad or in the arcsec of the name, magnitudes of the light source's band. Each
//! place where print and physics differ is an enum of [`SimpleEffects`]. Not included: everything but one panel and one
//! light source; see [`crate::brightness`] for more.

use crate::base::constants::ARCSEC_PER_RAD;
use std::f64::consts::{FRAC_PI_2, LN_2, PI};

use crate::base::error::{Error, Result};
use crate::config::Mode;

/// The cosine of incidence on a panel that faces the observer at nadir.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PanelLight {
    /// `cos θ_i = sin α_M`, α_M the light source's altitude: that of a panel facing the zenith, which the observer
    /// cannot see.
    SineOfAltitude,
    /// `cos θ_i = max(0, −sin α_M)`: a light source above the satellite's horizon shines on the panel's back.
    Geometric,
}

/// What the area of the panel is taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AreaMeaning {
    /// "Projected area", multiplied by both cosines all the same: the observer's cosine counts twice.
    Projected,
    /// The area of the panel itself.
    Geometric,
}

/// The diameter of a disc of the panel's area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Diameter {
    /// `A = (π/4) D`, as printed: a length equal to an area.
    Linear,
    /// `A = (π/4) D²`.
    Square,
}

/// The readings of the simple model, effect by effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SimpleEffects {
    /// Incidence on the panel.
    pub light: PanelLight,
    /// Meaning of the area.
    pub area: AreaMeaning,
    /// Diameter of the disc.
    pub diameter: Diameter,
}

impl SimpleEffects {
    /// The preset of a mode.
    #[must_use]
    pub fn of(mode: Mode) -> Self {
        match mode {
            Mode::AsPublished => {
                Self { light: PanelLight::SineOfAltitude, area: AreaMeaning::Projected, diameter: Diameter::Linear }
            }
            Mode::Corrected => {
                Self { light: PanelLight::Geometric, area: AreaMeaning::Geometric, diameter: Diameter::Square }
            }
        }
    }
}

/// A flat Lambert panel that faces nadir, under one light source, before one observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel {
    /// Lambert reflectance ρ, above 0 and at most 1.
    pub albedo: f64,
    /// Area \[m²\], above 0.
    pub area_m2: f64,
    /// Satellite to observer \[m\], above 0; in the zenith the height of the orbit.
    pub range_m: f64,
    /// Altitude of the light source above the satellite's local horizontal \[rad\], −π/2 to π/2.
    pub source_alt_rad: f64,
    /// Angle between the panel's normal and the observer θ_e \[rad\], 0 to π/2; 0 in the zenith.
    pub emission_rad: f64,
}

impl Panel {
    /// Refuses a panel that cannot be.
    ///
    /// # Errors
    /// [`Error::Model`] naming the quantity, its value and what is accepted.
    pub fn check(&self) -> Result<()> {
        if !(self.albedo > 0.0 && self.albedo <= 1.0) {
            return Err(refused("albedo", self.albedo, "above 0, at most 1"));
        }
        above_zero("area_m2", self.area_m2)?;
        above_zero("range_m", self.range_m)?;
        if !(self.source_alt_rad.abs() <= FRAC_PI_2) {
            return Err(refused("source_alt_rad", self.source_alt_rad, "−π/2 to π/2"));
        }
        if !(0.0..=FRAC_PI_2).contains(&self.emission_rad) {
            return Err(refused("emission_rad", self.emission_rad, "0 to π/2"));
        }
        Ok(())
    }

    /// `cos θ_i` of the panel.
    #[must_use]
    pub fn cos_incidence(&self, light: PanelLight) -> f64 {
        match light {
            PanelLight::SineOfAltitude => self.source_alt_rad.sin(),
            PanelLight::Geometric => -self.source_alt_rad.sin(),
        }
        .max(0.0)
    }

    /// Irradiance of the observer over that of the panel: `F_obs/F_source = ρ A cos θ_i cos θ_e / (π d²)`.
    ///
    /// 0 where the light source shines on the back: the corrected answer for a Moon above the satellite's horizon,
    /// where moonlight comes to the panel by way of the Earth alone (Lunar-Earthshine, which
    /// [`crate::brightness::Model`] computes).
    ///
    /// # Errors
    /// As [`Panel::check`].
    pub fn flux_ratio(&self, effects: &SimpleEffects) -> Result<f64> {
        self.check()?;
        let cos_e = self.emission_rad.cos();
        let area_m2 = match effects.area {
            AreaMeaning::Projected => self.area_m2 * cos_e,
            AreaMeaning::Geometric => self.area_m2,
        };
        let cos_i = self.cos_incidence(effects.light);
        Ok(self.albedo * area_m2 * cos_i * cos_e / (PI * self.range_m * self.range_m))
    }
}

/// `m_sat = m_source − 2.5 lg(F_obs/F_source)`; `None` without light \[mag\].
#[must_use]
pub fn magnitude(flux_ratio: f64, source_mag: f64) -> Option<f64> {
    (flux_ratio > 0.0 && flux_ratio.is_finite()).then(|| source_mag - 2.5 * flux_ratio.log10())
}

/// Diameter of the disc of an area \[m\]: `D = sqrt(4A/π)`, or `4A/π` as printed.
///
/// # Errors
/// [`Error::Model`] for an area that is not above 0.
pub fn diameter_m(area_m2: f64, reading: Diameter) -> Result<f64> {
    let square = 4.0 * above_zero("area_m2", area_m2)? / PI;
    Ok(match reading {
        Diameter::Linear => square,
        Diameter::Square => square.sqrt(),
    })
}

/// Angle of a length across the line of sight, `θ = D/d · 180·3600/π` \[arcsec\].
///
/// # Errors
/// [`Error::Model`] for a range that is not above 0.
pub fn angle_arcsec(length_m: f64, range_m: f64) -> Result<f64> {
    Ok(length_m / above_zero("range_m", range_m)? * ARCSEC_PER_RAD)
}

/// Solid angle of the disc of an area, `Ω = (π/4) θ²` \[arcsec²\].
///
/// # Errors
/// [`Error::Model`] for an area or range that is not above 0.
pub fn solid_angle_arcsec2(area_m2: f64, range_m: f64, reading: Diameter) -> Result<f64> {
    let theta_arcsec = angle_arcsec(diameter_m(area_m2, reading)?, range_m)?;
    Ok(PI / 4.0 * theta_arcsec * theta_arcsec)
}

/// Mean surface brightness `μ = m + 2.5 lg Ω` \[mag/arcsec²\].
#[must_use]
pub fn surface_brightness(mag: f64, omega_arcsec2: f64) -> f64 {
    mag + 2.5 * omega_arcsec2.log10()
}

/// Surface brightness of a resolved Lambert panel: neither its area nor its distance is in it \[mag/arcsec²\].
///
/// `μ = m_source − 2.5 lg ρ − 2.5 lg(cos θ_i) + 2.5 lg(π · 206265²)`; the constant is 27.815. The printed formula has
/// cos θ_e next to cos θ_i: it goes when the solid angle is that of the panel as it is seen (A cos θ_e/d²).
/// `None` without light.
#[must_use]
pub fn invariant_surface_brightness(source_mag: f64, albedo: f64, cos_i: f64) -> Option<f64> {
    let radiance = albedo * cos_i / (PI * ARCSEC_PER_RAD * ARCSEC_PER_RAD);
    magnitude(radiance, source_mag)
}

/// Solid angle over which the brightest point of a disc seems spread behind a Gaussian PSF: `μ_peak = m + 2.5 lg
/// Ω_eff`.
///
/// `Ω_eff = Ω / (1 − exp(−R²/2σ²))`, R the disc's radius, exactly: Ω when resolved, `2πσ² = π FWHM²/(4 ln 2)` when not.
///
/// # Errors
/// [`Error::Model`] for a solid angle or FWHM that is not above 0.
pub fn effective_solid_angle_arcsec2(omega_arcsec2: f64, fwhm_arcsec: f64) -> Result<f64> {
    let (omega, psf) = (above_zero("omega_arcsec2", omega_arcsec2)?, psf_solid_angle_arcsec2(fwhm_arcsec)?);
    // R²/2σ² = Ω/2πσ²; −expm1 keeps the digits of discs far below the PSF
    Ok(omega / -(-omega / psf).exp_m1())
}

/// The same by the sum `Ω + π FWHM²/(4 ln 2)`: right at both ends, up to 0.28 mag too faint between (Ω ≈ 1.8 · 2πσ²).
///
/// # Errors
/// As [`effective_solid_angle_arcsec2`].
pub fn summed_solid_angle_arcsec2(omega_arcsec2: f64, fwhm_arcsec: f64) -> Result<f64> {
    Ok(above_zero("omega_arcsec2", omega_arcsec2)? + psf_solid_angle_arcsec2(fwhm_arcsec)?)
}

/// Solid angle of a Gaussian PSF, its light over its peak: `2πσ² = π FWHM²/(4 ln 2)` \[arcsec²\].
///
/// # Errors
/// [`Error::Model`] for a FWHM that is not above 0.
pub fn psf_solid_angle_arcsec2(fwhm_arcsec: f64) -> Result<f64> {
    let fwhm = above_zero("fwhm_arcsec", fwhm_arcsec)?;
    Ok(PI * fwhm * fwhm / (4.0 * LN_2))
}

/// A finite number above 0, or a refusal that says so.
///
/// # Errors
/// [`Error::Model`] naming the quantity and its value.
pub fn above_zero(name: &str, value: f64) -> Result<f64> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(refused(name, value, "a finite number above 0")) }
}

fn refused(name: &str, value: f64, accepted: &str) -> Error {
    Error::Model { problem: format!("{name} = {value}; accepted is {accepted}") }
}
