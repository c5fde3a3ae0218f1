//! Spectra, pass bands and zero points: how much of a light source's light a band collects, and which magnitude that
//! is.
//!
//! Wavelengths in nm, spectral irradiances in W m⁻² nm⁻¹, ⟨f_ν⟩ in W m⁻² Hz⁻¹. Not included: the spectra of surfaces
//! (they are grey) and of the Earth.

mod band;
mod curve;
mod magnitude;
mod solar;
mod table;

pub use band::{Band, Response};
pub use curve::Curve;
pub(crate) use curve::{trapezoid, union_nm};
pub use magnitude::{MagSystem, ab_mag, brightness_ratio, published_ab_mag};
pub use solar::{SolarColumn, Spectrum};
pub(crate) use table::embedded;
