//! Exposure times of a telescope that follows: from an instrument and a sky to the faintest magnitude, and back.
//!
//! Electrons, seconds, magnitudes; areas in pixels and arcsec². Not included: scintillation, flat-field errors, the
//! target's own motion in the frame, and what confuses a detection besides noise.

mod calculator;
mod noise;
mod optics;

pub use calculator::{Area, Calculator, Limit, Needed};
pub use noise::{Noise, exposure_for_snr, limit_mag, signal_for_snr, snr};
pub use optics::{
    CDK24_OBSTRUCTION, DARK_E_S_PX, FILTER_TRANSMISSION, FWHM_ARCSEC, OPTICS_TRANSMISSION, Optics, PUBLISHED_ZP_MAG,
    flat_qe, qe_named,
};
