//! FITS files in and out, headers, the detector, the master flat: everything that touches raw pixels.
//!
//! The only room that knows the FITS library. Pixels of a [`Frame`] are f32 electrons; x runs along a row, y over rows,
//! both 0-based from the centre of the first pixel.

mod calibrate;
mod camera;
pub(crate) mod clip;
mod clock;
pub(crate) mod exposure;
pub mod flat;
mod frame;
pub mod header;
mod hot_pixels;
mod load;
mod mosaic;
mod overscan;
pub(crate) mod read;
mod readout;
mod role;
mod sample;
mod zero_level;

pub use camera::{Detector, table_camera};
pub use clock::{MidTime, TimeKind, mid_time};
pub use exposure::{Exposure, classify, refusals};
pub(crate) use exposure::{light_exptime, sorted};
pub use header::optics::pixel_scale_arcsec;

pub use frame::{Electrons, ElectronsPerAdu, Frame, Gain, GainSetting, mask};
pub use hot_pixels::{FEWEST_FIELDS, HotPixels, MOST_FIELDS, Peak, peaks};
pub use load::{Buffers, FrameReader, PooledFrame, read};

pub use exposure::other_satellite;
pub use mosaic::{check_pattern, sensor_pixels};
pub use overscan::{Level, Section, overscan, sections};
pub use readout::Camera;
pub use role::Role;
pub(crate) use role::{letters, matches_glob, name_variants, names_object, role_by_name};
pub use sample::Blocks;
pub use sample::never_filled;
pub use sample::read_box;
pub use zero_level::{ZeroLevel, ZeroLevels};
