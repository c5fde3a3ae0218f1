//! How a body lies on the sky: its extent east and north, the pixel that shows all of it, and whether a picture does.
//!
//! Metres across the line of sight, x to the west and y to the north. The middle of a picture is the middle of the extent.

use super::body::PosedBody;
use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};

/// Room about the satellite in a picture that it fills.
const MARGIN: f64 = 1.05;

/// A body before an observer who sees it from afar.
#[derive(Debug, Clone)]
pub struct View {
    /// West on the sky, unit.
    pub west: Vector<Itrs>,
    /// North on the sky, unit.
    pub north: Vector<Itrs>,
    /// Middle of the extent, west and north of the body's origin \[m\].
    pub middle_m: [f64; 2],
    /// Half the extent, west and north \[m\].
    pub half_m: [f64; 2],
}

impl View {
    /// The extent of a body towards an observer in a direction (unit), over the corners of all its triangles.
    ///
    /// # Errors
    /// [`Error::Model`] for a line of sight without a direction.
    pub fn new(body: &PosedBody, observer: &Vector<Itrs>) -> Result<Self> {
        // line of sight u; east = pole × u, north = u × east
        let u = -*observer;
        let pole = Vector::new(0.0, 0.0, 1.0);
        let east = pole.cross(&u).unit().or_else(|| u.any_perpendicular());
        let east = east.ok_or_else(|| Error::Model { problem: "no line of sight".into() })?;
        let (west, north) = (-east, u.cross(&east));
        let ends = [west, north].map(|axis| {
            let along = body.faces.iter().flat_map(|p| p.corners.iter()).map(|v| v.dot(&axis));
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        });
        Ok(Self {
            west,
            north,
            middle_m: ends.map(|(low, high)| 0.5 * (low + high)),
            half_m: ends.map(|(low, high)| 0.5 * (high - low)),
        })
    }

    /// Side of the pixel with which the body fills a picture of so many, with a margin of 5 % \[m\].
    #[must_use]
    pub fn filling_pixel_m(&self, pixels: usize) -> f64 {
        2.0 * MARGIN * self.half_m[0].max(self.half_m[1]) / pixels as f64
    }

    /// All of the body lies within a picture of so many pixels of this side \[m\].
    #[must_use]
    pub fn fits(&self, pixels: usize, pixel_m: f64) -> bool {
        self.half_m.iter().all(|half| 2.0 * half <= pixels as f64 * pixel_m)
    }

    /// A place on the plane across the line of sight, west and north of the picture's middle \[m\].
    #[must_use]
    pub fn place(&self, west_m: f64, north_m: f64) -> Vector<Itrs> {
        self.west * (self.middle_m[0] + west_m) + self.north * (self.middle_m[1] + north_m)
    }
}
