//! Which satellite a frame is of, and its place at mid-exposure, from the elements alone.

use crate::base::error::{Error, Result};
use crate::base::time::iso_utc;
use crate::frames::Exposure;
use crate::orbit::{Geometry, Tracker};
use crate::pipeline::prepared::Prepared;

/// The satellite of one frame, as far as elements and clock determine it.
#[derive(Debug, Default)]
pub struct Place {
    /// Which satellite; `None` without elements or a time.
    pub object: Option<Object>,
    /// Its place on the sky.
    pub geometry: Option<Geometry>,
    /// Why this frame cannot show it: elements refused, or the satellite below the horizon.
    pub problem: Option<Error>,
}

/// A satellite as its elements name it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Object {
    /// Its catalogue number.
    pub norad_cat_id: Option<i64>,
    /// Its COSPAR designator.
    pub object_id: String,
    /// Its name.
    pub name: String,
}

impl Place {
    /// The place of the satellite at mid-exposure.
    #[must_use]
    pub fn of(exposure: &Exposure, night: &Prepared) -> Self {
        let (Some(tracker), Some(time)) = (&night.tracker, &exposure.time) else { return Self::default() };
        let mut place = Self::default();
        place.problem = place.fill(tracker, &time.mid).err();
        place
    }

    fn fill(&mut self, tracker: &Tracker, mid: &hifitime::Epoch) -> Result<()> {
        let elements = tracker.elements_at(mid)?;
        let object = self.object.insert(Object {
            norad_cat_id: i64::try_from(elements.norad_cat_id()).ok(),
            object_id: elements.object_id().to_string(),
            name: elements.name().to_string(),
        });
        let geometry = self.geometry.insert(tracker.at(mid)?);
        if geometry.alt_rad <= 0.0 {
            return Err(Error::Orbit {
                problem: format!(
                    "{} was {:.1} deg below the horizon at {}; check the clock, the site and the elements",
                    object.name,
                    -geometry.alt_rad.to_degrees(),
                    iso_utc(*mid, 6)
                ),
            });
        }
        Ok(())
    }

    /// The place of the satellite, if the frame can show it.
    #[must_use]
    pub fn seen(&self) -> Option<&Geometry> {
        self.geometry.as_ref().filter(|_| self.problem.is_none())
    }
}
