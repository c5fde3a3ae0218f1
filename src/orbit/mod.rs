//! From elements to where the satellite, the Sun and the Moon stand.
//!
//! elements -> [`Propagator`] (TEME) -> Earth-fixed axes (ITRS) -> horizon of the [`Site`]; [`Tracker::at`] is the
//! whole chain. Kilometres and radians. No refraction, no atmosphere, no brightness.

pub mod airmass;
pub mod earth;
pub mod elements;
pub mod geometry;
pub mod ground_track;
pub mod omm;
pub mod passes;
pub mod propagate;
pub mod sky;
pub mod time;
pub mod tle;
pub mod tracker;
pub mod ut1;
pub mod whole_pass;

pub use airmass::{Atmosphere, airmass, airmass_pickering2002};
pub use earth::{EarthOrientation, Site};
pub use elements::{
    Elements, check_age, element_names, elements_from_bytes, nearest, read_elements, read_elements_file,
    read_elements_for,
};
pub use geometry::Geometry;
pub use passes::{Pass, PassEvent, passes};
pub use propagate::Propagator;
pub use sky::{SkyBodies, altaz_to_icrs, bodies, icrs_to_altaz, moon_altaz, sun_altaz};
pub use tracker::Tracker;
pub use whole_pass::{WholePass, whole_passes};
