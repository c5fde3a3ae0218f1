//! The two light sources: how bright Sun and Moon shine at the satellite and on the ground.
//!
//! Irradiances in a pass band as ratios to a star of magnitude 0 in it; distances in km, phase angles in deg as the
//! lunar laws are printed. Not included: the Sun's own variation, libration, the colour of Earthshine.

mod eclipse;
mod moon;
mod near;
mod opposition;
mod rolo;
mod sed;
mod settings;
mod sun;

pub use sun::{SUN_V_MAG, SourceLight, flux_of_mag, mag_of_flux, sunlight};

pub use eclipse::{UMBRA_FLOOR, eclipse_factor};
pub use moon::FULL_MOON_V_MAG;
pub use moon::MOON_MEAN_DISTANCE_KM;
pub use moon::moon_v_mag;
pub use moon::moonlight;
pub use moon::opposition_factor;
pub use near::NearMoon;
pub use opposition::MOON_LAW_MAX_DEG;
pub use rolo::{ROLO_RANGE_DEG, Rolo};
pub use sed::moon_spectrum;
pub use settings::{MOON_COLOUR_PHASE_DEG, SourceSettings};
