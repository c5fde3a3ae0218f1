//! FITS files as bytes: cards, checksums, pixels plain and tiled, and the writer.

pub(crate) mod card_value;
pub(crate) mod cards;
pub(crate) mod checksum;
pub(crate) mod files;
pub(crate) mod linear;
pub(crate) mod open;
pub(crate) mod plain;
pub(crate) mod raw;
pub(crate) mod scan;
pub(crate) mod stored;
pub(crate) mod structure;
pub(crate) mod tables;
pub(crate) mod tall;
pub(crate) mod tiles;
pub(crate) mod write;

pub use card_value::{CardLine, CardValue, card};
pub use cards::{Card, Green, Header};
pub use checksum::wrong_checksum;
pub use files::find_files;
pub(crate) use open::open;
pub(crate) use raw::guarded;
pub use write::write_f32;
pub use write::write_u16;
