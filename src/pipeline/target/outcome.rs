//! What became of one target frame.

use crate::figures::Thumb;
use crate::orbit::Geometry;
use crate::tables::PhotometryRow;

/// What is known of one target frame.
#[derive(Debug, Clone)]
pub struct TargetFrame {
    /// Its row of the light curve.
    pub row: PhotometryRow,
    /// Where the satellite stood.
    pub geometry: Option<Geometry>,
    /// A small picture of the target, where [`super::pictures`] made one.
    pub thumb: Option<Thumb>,
}
