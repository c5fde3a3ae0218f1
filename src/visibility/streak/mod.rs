//! The trail of a satellite in an exposure that follows the stars: its width, how long it lights a place, how bright it
//! is.
//!
//! Lengths in m, angles in arcsec, rates in rad/s, times in s, mag and mag/arcsec². Two readings of the effective
//! surface brightness, side by side. Not included: brightness that changes along the trail, and the hole in the
//! telescope's mirror.

mod profile;
mod rate;

pub use profile::strip_share;
pub use rate::{Leg, MEAN_RADIUS_KM, OnCircle, circular_speed_km_s, on_circle, zenith_rate_rad_s};

use std::f64::consts::PI;

use super::simple::{Diameter, above_zero, angle_arcsec, diameter_m, solid_angle_arcsec2, surface_brightness};
use crate::base::constants::ARCSEC_PER_RAD;
use crate::base::error::{Error, Result};
use crate::brightness::sky::GM_KM3_S2;
use crate::config::Mode;

/// What crosses the field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Area of the satellite \[m²\].
    pub area_m2: f64,
    /// Observer to satellite \[m\].
    pub range_m: f64,
    /// Angular rate against the stars \[rad/s\]; 0 = it stands still.
    pub rate_rad_s: f64,
    /// Its magnitude, tracked; `None` = no light.
    pub mag: Option<f64>,
}

/// What looks at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Exposure \[s\].
    pub exptime_s: f64,
    /// Diameter of the field of view \[arcsec\].
    pub fov_arcsec: f64,
    /// Diameter of the telescope's mirror \[m\]: a satellite is nearer than the focus, and its image as wide as the
    /// mirror seen from there.
    pub mirror_m: f64,
    /// FWHM of the seeing \[arcsec\].
    pub fwhm_arcsec: f64,
}

/// The trail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trail {
    /// Diameter of a disc of the satellite's area \[m\].
    pub diameter_m: f64,
    /// Its angle \[arcsec\].
    pub satellite_arcsec: f64,
    /// Its solid angle \[arcsec²\].
    pub omega_arcsec2: f64,
    /// Angle of the mirror seen from the satellite: the blur of its being out of focus \[arcsec\].
    pub defocus_arcsec: f64,
    /// Width of the trail: satellite, defocus and seeing in quadrature \[arcsec\].
    pub width_arcsec: f64,
    /// Angular rate \[arcsec/s\].
    pub rate_arcsec_s: f64,
    /// Time the satellite takes to move by the trail's width, at most the exposure \[s\].
    pub t_eff_s: f64,
    /// Time it is in the field: `min(t_exp, FOV/ω)` \[s\].
    pub in_field_s: f64,
    /// Length of the trail in the field: `min(ω t_exp, FOV)` \[arcsec\].
    pub length_arcsec: f64,
    /// Mean surface brightness while tracked, `m + 2.5 lg Ω` \[mag/arcsec²\].
    pub mu_mag_arcsec2: Option<f64>,
    /// Effective surface brightness as published; `None` for no light, and for no motion, where it has no value.
    pub nu_published_mag_arcsec2: Option<f64>,
    /// Effective surface brightness, corrected.
    pub nu_corrected_mag_arcsec2: Option<f64>,
}

/// Width of a trail \[arcsec\]: `θ² = (D_sat² + D_mirror²)/d² + σ²`.
///
/// # Errors
/// [`Error::Model`] for an area, range, mirror or FWHM that is not above 0.
pub fn width_arcsec(area_m2: f64, range_m: f64, mirror_m: f64, fwhm_arcsec: f64) -> Result<f64> {
    let satellite = angle_arcsec(diameter_m(area_m2, Diameter::Square)?, range_m)?;
    let defocus = angle_arcsec(above_zero("mirror_m", mirror_m)?, range_m)?;
    Ok(satellite.hypot(defocus).hypot(above_zero("fwhm_arcsec", fwhm_arcsec)?))
}

/// Time a satellite in the zenith takes to move by its own diameter \[s\]: `t_eff = 2 sqrt(A/π · (R + h)/GM)`.
///
/// # Errors
/// [`Error::Model`] for an area or height that is not above 0.
pub fn t_eff_simple_s(area_m2: f64, height_km: f64) -> Result<f64> {
    let r_m = 1e3 * (MEAN_RADIUS_KM + above_zero("height_km", height_km)?);
    Ok(2.0 * (above_zero("area_m2", area_m2)? / PI * r_m / (1e9 * GM_KM3_S2)).sqrt())
}

/// Effective surface brightness of a trail \[mag/arcsec²\]; `None` without motion as published.
///
/// As published `Σ = F/A_trail · t_eff/t_exp` with A_trail = θ ω t_exp and t_eff = θ/ω: θ cancels and
/// `ν = m + 5 lg(ω t_exp)`. The light is spread over the trail, and what is left is thinned by the time a place is lit:
/// twice the same average, `2.5 lg(t_exp/t_eff)` too faint (8 mag for the ISS).
///
/// Corrected: a place of the trail gets F/(θ ω) and the exposure divides by t_exp,
/// `ν = m + 2.5 lg(θ · max(ω t_exp, (π/4) θ))`; the second term is a satellite that does not leave its own image, whose
/// ν is the surface brightness of a disc of diameter θ.
#[must_use]
pub fn effective_surface_brightness(
    mag: f64,
    width_arcsec: f64,
    rate_arcsec_s: f64,
    exptime_s: f64,
    mode: Mode,
) -> Option<f64> {
    let moved_arcsec = rate_arcsec_s * exptime_s;
    match mode {
        Mode::AsPublished => (moved_arcsec > 0.0).then(|| mag + 5.0 * moved_arcsec.log10()),
        Mode::Corrected => Some(surface_brightness(mag, width_arcsec * moved_arcsec.max(PI / 4.0 * width_arcsec))),
    }
}

impl Trail {
    /// The trail of a satellite before a camera.
    ///
    /// # Errors
    /// [`Error::Model`] for an area, range, exposure, field, mirror or FWHM that is not above 0, a rate that is
    /// negative or not finite, a magnitude that is not finite.
    pub fn new(crossing: &Crossing, camera: &Camera) -> Result<Self> {
        let Crossing { area_m2, range_m, rate_rad_s, mag } = *crossing;
        let exptime_s = above_zero("exptime_s", camera.exptime_s)?;
        let fov_arcsec = above_zero("fov_arcsec", camera.fov_arcsec)?;
        if !(rate_rad_s >= 0.0 && rate_rad_s.is_finite()) {
            return Err(Error::Model { problem: format!("rate_rad_s = {rate_rad_s}; accepted is 0 or above") });
        }
        if let Some(mag) = mag.filter(|m| !m.is_finite()) {
            return Err(Error::Model { problem: format!("a magnitude of {mag}; accepted is a finite number") });
        }
        let diameter_m = diameter_m(area_m2, Diameter::Square)?;
        let omega_arcsec2 = solid_angle_arcsec2(area_m2, range_m, Diameter::Square)?;
        let width_arcsec = width_arcsec(area_m2, range_m, camera.mirror_m, camera.fwhm_arcsec)?;
        let rate_arcsec_s = rate_rad_s * ARCSEC_PER_RAD;
        let nu = |mode| effective_surface_brightness(mag?, width_arcsec, rate_arcsec_s, exptime_s, mode);
        Ok(Self {
            diameter_m,
            satellite_arcsec: angle_arcsec(diameter_m, range_m)?,
            omega_arcsec2,
            defocus_arcsec: angle_arcsec(camera.mirror_m, range_m)?,
            width_arcsec,
            rate_arcsec_s,
            // a rate of 0 divides to infinity, which the exposure cuts
            t_eff_s: (width_arcsec / rate_arcsec_s).min(exptime_s),
            in_field_s: (fov_arcsec / rate_arcsec_s).min(exptime_s),
            length_arcsec: (rate_arcsec_s * exptime_s).min(fov_arcsec),
            mu_mag_arcsec2: mag.map(|m| surface_brightness(m, omega_arcsec2)),
            nu_published_mag_arcsec2: nu(Mode::AsPublished),
            nu_corrected_mag_arcsec2: nu(Mode::Corrected),
        })
    }

    /// Solid angle of the trail inside the field \[arcsec²\], never less than the image of a satellite that stands
    /// still.
    #[must_use]
    pub fn solid_angle_arcsec2(&self) -> f64 {
        self.width_arcsec * self.length_arcsec.max(PI / 4.0 * self.width_arcsec)
    }

    /// Electrons in the brightest pixel of the trail, for a source of `e_per_s` in all.
    ///
    /// The pixel on the middle line gets the share of the light that falls on its strip, for the time the satellite
    /// takes to cross it, `pix/ω`, or, where it hardly moves, for the share of its light along the motion in all the
    /// time.
    ///
    /// # Errors
    /// [`Error::Model`] for a pixel that is not above 0.
    pub fn peak_pixel_e(&self, e_per_s: f64, pix_arcsec: f64, fwhm_arcsec: f64) -> Result<f64> {
        let share = strip_share(pix_arcsec, self.satellite_arcsec, self.defocus_arcsec, fwhm_arcsec)?;
        let lit_s = (pix_arcsec / self.rate_arcsec_s).min(self.in_field_s * share);
        Ok(e_per_s * share * lit_s)
    }
}
