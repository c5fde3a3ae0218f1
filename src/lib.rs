//! satphot: photometry of tracked satellites, from a night's raw FITS files to calibrated magnitudes, and from
//! orbit and geometry to predicted magnitudes under Sunlight, Earthshine, Moonlight and Lunar-Earthshine.
//!
//! The library computes and returns; it never prints, never exits and never reads the clock.
//! Units are in the names; inside functions radians and km, at the edges (TOML, tables) degrees.
//!
//! | to | use |
//! |---|---|
//! | reduce a night and get its rows | [`Config`], [`reduce_night`] |
//! | find the passes of elements over a site | [`Tracker`], [`Site`], [`passes`] |
//! | turn a satellite and a scene into magnitudes | [`Satellite`], [`Model`], [`Scene`] |
//! | map the brightness of satellites over a sky | [`map_sky`] |
//! | fit a zeropoint to a table of matched stars | [`fit_zeropoint`] |
//! | sum an aperture | [`Aperture`], [`sum_aperture`] |
//!
//! The other names are what these take and return. A program for each line is in `examples/`.
//!
//! ```
//! use satphot::{Illum, Model, ModelSettings, Satellite, Scene, Site, Tracker};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let elements = "ISS (ZARYA)
//! 1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996
//! 2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748";
//! let tracker = Tracker::from_text(elements, Site::new(-33.7703, 151.1113, 70.0)?)?;
//! let geometry = tracker.at(&"2025-06-09T10:33:12 UTC".parse()?)?;
//!
//! let iss = Satellite::named("iss").ok_or("not in the catalogue")?;
//! let answer = Model::new(&iss, &ModelSettings::default())?.brightness(&Scene::from(&geometry))?;
//! assert_eq!(answer.illum, Illum::LunarEarthshine); // in the Earth's shadow, over moonlit ground
//! assert!((answer.total_v_mag.ok_or("dark")? - 12.64).abs() < 0.05);
//! # Ok(())
//! # }
//! ```
//!
//! # Features
//!
//! All but `parquet` are on by default; without them the library has the photometry of a night and the brightness model, and
//! needs no network, HTML or terminal.
//!
//! - `cli`: what the program needs besides the library.
//! - `fetch`: elements and stars from the network.
//! - `report`: figures, gallery and page of a night.
//! - `resolved`: satellites of many components, and synthetic nights.
//! - `parquet`: tables as Parquet, written and read.

// Modules that a smaller build does not contain are the only users of some shared names.
#![cfg_attr(not(all(feature = "report", feature = "resolved")), allow(dead_code, unused_imports, unused_variables))]

#[cfg(all(feature = "report", feature = "resolved"))]
#[doc(hidden)]
pub mod accuracy;
#[doc(hidden)]
pub mod astrometry;
#[doc(hidden)]
pub mod bands;
#[doc(hidden)]
pub mod base;
#[doc(hidden)]
pub mod brightness;
#[doc(hidden)]
pub mod config;
#[doc(hidden)]
pub mod detector;
#[doc(hidden)]
pub mod export;
#[cfg(feature = "fetch")]
#[doc(hidden)]
pub mod fetch;
#[cfg(feature = "report")]
#[doc(hidden)]
pub mod figures;
#[doc(hidden)]
pub mod fitting;
#[cfg(not(feature = "report"))]
#[doc(hidden)]
pub mod figures {
    //! Of the figures only the picture of a target, which measured frames can have.

    pub mod thumb;
    pub use thumb::Thumb;
}
#[doc(hidden)]
pub mod fits;
#[doc(hidden)]
pub mod frames;
#[doc(hidden)]
pub mod orbit;
#[cfg(feature = "resolved")]
#[doc(hidden)]
pub mod paper;
#[doc(hidden)]
pub mod photometry;
#[doc(hidden)]
pub mod pipeline;
#[cfg(feature = "report")]
#[doc(hidden)]
pub mod report;
#[cfg(not(feature = "report"))]
#[doc(hidden)]
pub mod report {
    //! Of the report only the closing summary, which is text.

    pub mod summary;
}
#[cfg(feature = "resolved")]
#[doc(hidden)]
pub mod resolved;
#[cfg(feature = "resolved")]
#[doc(hidden)]
pub mod simulate;
#[doc(hidden)]
pub mod tables;
#[doc(hidden)]
pub mod visibility;
#[doc(hidden)]
pub mod zeropoint;

#[doc(inline)]
pub use base::error::{Error, Result};
#[doc(inline)]
pub use base::vector::Vector;
#[doc(inline)]
pub use brightness::sky::SkyMap;
#[doc(inline)]
pub use brightness::{Attitude, Brdf, Brightness, Illum, Light, Model, ModelSettings, Satellite, Scene, Surface};
#[doc(inline)]
pub use config::{Config, Mode};
#[doc(inline)]
pub use orbit::passes::passes;
#[doc(inline)]
pub use orbit::{Geometry, Pass, PassEvent, Site, Tracker};
#[doc(inline)]
pub use photometry::aperture::{Shape as Aperture, sum_aperture};
#[doc(inline)]
pub use pipeline::reduce::{ReducedNight, reduce_night};
#[doc(inline)]
pub use tables::PhotometryRow;
#[doc(inline)]
pub use visibility::forecast::map_sky;
#[doc(inline)]
pub use zeropoint::fit::Zeropoint;
#[doc(inline)]
pub use zeropoint::matched::fit_zeropoint;

#[doc(no_inline)]
pub use hifitime::Epoch;
#[doc(no_inline)]
pub use ndarray;
