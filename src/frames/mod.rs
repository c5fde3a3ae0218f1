//! FITS files in and out, headers, the detector, the master flat: everything that touches raw pixels.
//!
//! The only room that knows the FITS library. Pixels are f32, ADU before and electrons after
//! [`Frame::into_electrons`]; x runs along a row, y over rows, both 0-based from the centre of the first pixel.

mod cards;
mod clip;
mod detector;
mod exposure;
mod flat;
mod flat_file;
mod frame;
mod median;
mod raw;
mod read;
mod scan;
mod stamp;
mod time;
mod write;

pub use cards::{Card, Header};
pub use detector::{Detector, pixel_scale_arcsec};
pub use exposure::{Exposure, Role, classify, find_files};
pub use flat::{FlatMember, MasterFlat};
pub use frame::{Adu, Electrons, ElectronsPerAdu, Frame, Gain, GainSetting, mask};
pub use read::read;
pub use time::{MidTime, mid_time};
pub use write::{CardValue, write_f32, write_u16};
