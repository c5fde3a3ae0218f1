//! FITS files in and out, headers, the detector, the master flat: everything that touches raw pixels.
//!
//! The only room that knows the FITS library. Pixels of a [`Frame`] are f32 electrons; x runs along a row, y over rows,
//! both 0-based from the centre of the first pixel.

mod adc;
mod calibrate;
mod cards;
mod checksum;
mod clip;
mod clock;
mod counting;
mod detector;
mod exposure;
mod files;
mod flat;
mod flat_file;
mod flat_kernel;
mod flat_pairs;
mod flat_stack;
mod frame;
pub mod header;
mod levels;
mod linear;
mod load;
mod median;
mod pages;
mod plain;
mod raw;
mod read;
mod readout;
mod role;
mod sample;
mod scan;
mod stored;
mod structure;
mod tiles;
mod transfer;
mod write;

pub use adc::{Counts, Pile, Step, converter_bits};
pub use cards::{Card, Header};
pub use checksum::wrong_checksum;
pub use clock::{MidTime, TimeKind, mid_time};
pub use detector::{Detector, pixel_scale_arcsec};
pub use exposure::{Exposure, classify, refusals};
pub(crate) use exposure::{light_exptime, sorted};
pub use files::find_files;
pub use flat::{BAND_BYTES, FlatMember, MasterFlat};
pub use flat_pairs::{BlockPoint, MAX_FLAT_RATIO, PairPoints, Refusal, compare_flats};
pub use frame::{Electrons, ElectronsPerAdu, Frame, Gain, GainSetting, mask};
pub use load::{Buffers, FrameReader, Held, read};
pub(crate) use median::{LANES, Lanes, Network, middle};
pub(crate) use raw::guarded;
pub use readout::Camera;
pub use role::{Role, other_satellite};
pub use sample::{Blocks, count_values, never_filled, read_box};
pub use transfer::{DarkNoise, GainEstimate, Transfer, fit_transfer};
pub use write::{CardValue, write_f32, write_u16};
