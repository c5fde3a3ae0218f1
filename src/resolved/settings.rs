//! How a picture is made: pixels, samples, rays, band, and which lights shine.
//!
//! Relative numbers, pixels, mag arcsec⁻². Nothing here computes light.

use super::light_source::{InBand, WIDE_UM};
use super::shape::SIDES;
use crate::base::error::{Error, Result};
use crate::brightness::{Brdf, ModelSettings};

/// Surface brightness of the night sky and of the airglow below, V \[mag arcsec⁻²\]: starlight and zodiacal light
/// between 22.0 and 22.7, airglow near 22 (Leinert et al. 1998, A&AS 127, 1: 22 to 23 in V at high latitudes).
pub const STARLIGHT_MAG_ARCSEC2: [f64; 2] = [22.0, 22.0];

/// The paper's radiance of the moonlit Earth \[W cm⁻² sr⁻¹ µm⁻¹\] (Caddy et al., section on Lunar-Earthshine).
pub const PAPER_EARTH_W_CM2_SR_UM: f64 = 1e-9;

/// How a picture is made.
#[derive(Debug, Clone)]
pub struct RenderSettings {
    /// Pixels along a side.
    pub pixels: usize,
    /// Side of a pixel \[rad\]; `None` = the satellite fills the picture with a margin of 5 %.
    pub pixel_rad: Option<f64>,
    /// Samples along a side of a pixel: n × n of them.
    pub samples: usize,
    /// Directions that a sample traces towards the Earth, and as many towards the sky; a power of two.
    pub earth_rays: usize,
    /// Sides of round shapes.
    pub sides: usize,
    /// The band.
    pub band: InBand,
    /// Effects, ground, tolerance, and which light sources shine.
    pub model: ModelSettings,
    /// A uniform radiance of the Earth for Lunar-Earthshine \[W cm⁻² sr⁻¹ µm⁻¹\] instead of the moonlit ground.
    pub uniform_earth_w_cm2_sr_um: Option<f64>,
    /// Surface brightness of the sky above and of the airglow below; `None` = no starlight.
    pub starlight_mag_arcsec2: Option<[f64; 2]>,
    /// Light that went from one part of the satellite to another, once.
    pub bounce: bool,
    /// Parts of the satellite hide lights from others.
    pub shadows: bool,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            pixels: 512,
            pixel_rad: None,
            samples: 2,
            earth_rays: 16,
            sides: SIDES,
            band: InBand::Between(WIDE_UM.0, WIDE_UM.1),
            model: ModelSettings { tolerance: 1e-3, ..ModelSettings::default() },
            uniform_earth_w_cm2_sr_um: None,
            starlight_mag_arcsec2: Some(STARLIGHT_MAG_ARCSEC2),
            bounce: false,
            shadows: true,
        }
    }
}

impl RenderSettings {
    /// Refuses what would give no picture or never end.
    ///
    /// # Errors
    /// [`Error::Config`] naming the setting, its value and what is accepted.
    pub fn check(&self) -> Result<()> {
        let within = |key: &str, value: usize, low: usize, high: usize| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(Error::Config { key: key.into(), problem: format!("{value}; accepted is {low} to {high}") })
            }
        };
        within("pixels", self.pixels, 8, 8192)?;
        within("samples", self.samples, 1, 32)?;
        within("earth_rays", self.earth_rays, 1, 1024)?;
        within("sides", self.sides, 6, 1024)?;
        let refuse = |key: &str, problem: String| Err(Error::Config { key: key.into(), problem });
        if !self.earth_rays.is_power_of_two() {
            let above = self.earth_rays.next_power_of_two();
            let problem = format!("{}; accepted are powers of two, e.g. {} or {above}", self.earth_rays, above / 2);
            return refuse("earth_rays", problem);
        }
        if let Some(p) = self.pixel_rad.filter(|p| !(*p > 0.0 && *p < 0.01)) {
            return refuse("pixel_arcsec", format!("{}; accepted is above 0, below 2000", p.to_degrees() * 3600.0));
        }
        if let Some(l) = self.uniform_earth_w_cm2_sr_um.filter(|l| !(*l >= 0.0 && l.is_finite())) {
            return refuse("uniform_earth", format!("{l} W cm-2 sr-1 um-1; accepted is 0 or more"));
        }
        if let Some(m) = self.starlight_mag_arcsec2.filter(|m| m.iter().any(|m| !(10.0..=40.0).contains(m))) {
            return refuse("starlight", format!("{m:?} mag/arcsec2; accepted is 10 to 40"));
        }
        match self.model.earth {
            Brdf::Mirror { .. } => {
                refuse("earth", "a mirror cannot be the ground; accepted are lambert and phong laws".into())
            }
            _ => Ok(()),
        }
    }
}
