//! FITS files in and out, headers, the detector, the master flat: everything that touches raw pixels.
//!
//! The only room that knows the FITS library. Pixels are f32, ADU before and electrons after
//! [`Frame::into_electrons`]; x runs along a row, y over rows, both 0-based from the centre of the first pixel.

mod adc;
mod cards;
mod clip;
mod detector;
mod exposure;
mod flat;
mod flat_file;
mod flat_pairs;
mod frame;
mod median;
mod raw;
mod read;
mod sample;
mod scan;
mod stamp;
mod time;
mod transfer;
mod write;

pub use adc::{Counts, Pile, Step, converter_bits};
pub use cards::{Card, Header};
pub use detector::{Detector, pixel_scale_arcsec};
pub use exposure::{Exposure, Role, classify, find_files};
pub use flat::{FlatMember, MasterFlat};
pub use flat_pairs::{BlockPoint, MAX_FLAT_RATIO, PairPoints, Refusal, compare_flats};
pub use frame::{Adu, Electrons, ElectronsPerAdu, Frame, Gain, GainSetting, mask};
pub use read::read;
pub use sample::{Blocks, count_values, read_box};
pub use time::{MidTime, mid_time};
pub use transfer::{DarkNoise, GainEstimate, Transfer, fit_transfer};
pub use write::{CardValue, write_f32, write_u16};
