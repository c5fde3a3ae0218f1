//! `[[satellites]]` and `[[instruments]]`: a night of several satellites and cameras.

use serde::{Deserialize, Serialize};

use super::file::{Detector, Telescope};

/// Which model the frames of a satellite are compared with; the first entry that fits is used.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SatelliteEntry {
    /// Names, catalogue numbers or international designators as in OBJECT or in the elements; `*` stands for any text
    /// (`STARLINK-*`).
    pub objects: Vec<String>,
    /// Catalogue number of these objects, where OBJECT holds a name that the elements do not have.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub norad_cat_id: Option<u64>,
    /// A satellite of the catalogue of models; absent: measured, without a residual.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
}

/// A further camera of the night, with its own flats, gain table and zeropoint. Frames whose header names it are reduced
/// with it, all others with `[detector]` and `[telescope]`.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Instrument {
    /// Its name in tables and folders.
    pub name: String,
    /// The camera, as `[detector]`; `camera` is compared with INSTRUME.
    pub detector: Detector,
    /// The optics, as `[telescope]`; absent: those of the night.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub telescope: Option<Telescope>,
    /// Radius outside which nothing is used \[px\]; absent: that of `[photometry]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clip_radius_px: Option<f64>,
}
