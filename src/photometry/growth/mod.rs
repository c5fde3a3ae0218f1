//! The light a star sends beyond an aperture: a Moffat profile fitted to the growth curve of bright stars.
//!
//! Shares of the whole light, 0 to 1; pixels. β → ∞ is a Gaussian. It does not cover the aureole beyond 8 FWHM, which
//! stars and target share.

mod annulus;
mod collect;
mod curve;
mod fit;
mod profile;
mod radial;
mod stack;
mod star_width;

pub use profile::StarProfile;
pub(crate) use radial::Radial;

pub use curve::GrowthCurve;
pub use stack::{FrameGrowth, frame_growth};
pub use star_width::{FRAME_SCATTER, PRIOR_EXPONENT, StarWidth};
