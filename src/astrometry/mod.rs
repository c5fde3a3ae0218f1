//! Where the frame points: world coordinates, plate solving, catalogues, alignment.

pub mod align;
pub mod catalogue;
pub mod field_rotation;
pub mod initial_pointing;
pub mod plate;
pub mod trailed;
pub mod wcs;
