//! FITS files in and out, headers, the detector, the master flat: everything that touches raw pixels.
//!
//! The only room that knows the FITS library. Pixels are f32, ADU before and electrons after
//! [`Frame::into_electrons`]; x runs along a row, y over rows, both 0-based from the centre of the first pixel.

mod frame;

pub use frame::{Adu, Electrons, ElectronsPerAdu, Frame, Gain, GainSetting, mask};
