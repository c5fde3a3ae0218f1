//! The outcome of one target frame, stage by stage: [`TaggedFrame`], [`ComparedFrame`], [`TargetFrame`].

use super::measurement::CalibratedMeasurement;
use super::place::Place;
use super::star_trails::FrameTrails;
use crate::base::error::Result;
use crate::brightness::Brightness;
use crate::brightness::scene::scene;
use crate::figures::Thumb;
use crate::frames::Exposure;
use crate::orbit::Geometry;
use crate::pipeline::prepared::Calibrated;
use crate::tables::PhotometryRow;

/// A frame with its place on the sky and what was measured in it.
#[derive(Debug)]
pub struct TaggedFrame<'a> {
    /// The frame.
    pub exposure: &'a Exposure,
    /// The place of the satellite.
    pub place: Place,
    /// The measurement, or why there is none; `None` where the place has a problem.
    pub measured: Option<Result<CalibratedMeasurement>>,
    /// What its star trails say; `None` where they were not looked for.
    pub trails: Option<FrameTrails>,
}

/// A tagged frame with the model of its scene.
#[derive(Debug)]
pub struct ComparedFrame<'a> {
    /// The frame.
    pub exposure: &'a Exposure,
    /// The place of the satellite.
    pub place: Place,
    /// The measurement, or why there is none; `None` where the place has a problem.
    pub measured: Option<Result<CalibratedMeasurement>>,
    /// What its star trails say; `None` where they were not looked for.
    pub trails: Option<FrameTrails>,
    /// The model's magnitudes, or why there are none; `None` without a model or a place.
    pub model: Option<Result<Brightness>>,
}

impl<'a> TaggedFrame<'a> {
    /// With the model's magnitudes for the same place, if the night has a model.
    #[must_use]
    pub fn compared(self, night: &Calibrated) -> ComparedFrame<'a> {
        let Self { exposure, place, measured, trails } = self;
        let model = night.model.as_ref().zip(place.seen()).map(|(model, at)| model.brightness(&scene(at)));
        ComparedFrame { exposure, place, measured, trails, model }
    }
}

/// The results of one target frame.
#[derive(Debug, Clone)]
pub struct TargetFrame {
    /// Its row of the light curve.
    pub row: PhotometryRow,
    /// The place of the satellite.
    pub geometry: Option<Geometry>,
    /// A small picture of the target, where [`super::pictures`] made one.
    pub thumb: Option<Thumb>,
}
