//! Which satellite a frame is of, and its place at mid-exposure, from the elements alone.

use crate::astrometry::catalogue::separation_deg;
use crate::astrometry::initial_pointing::initial_pointings;
use crate::base::error::{Error, Result};
use crate::base::time::iso_utc;
use crate::config::Config;
use crate::frames::{Exposure, pixel_scale_arcsec};
use crate::orbit::{EarthOrientation, Geometry, Site, Tracker, altaz_to_icrs};
use crate::pipeline::prepared::Prepared;
use crate::tables::PhotometryRow;

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

/// Distance of the header's pointing from the place of the satellite \[deg\]; `None` where the header does not say.
#[must_use]
pub fn pointing_sep_deg(
    exposure: &Exposure,
    geometry: &Geometry,
    (site, eop): (&Site, &EarthOrientation),
    config: &Config,
) -> Option<f64> {
    let position =
        initial_pointings(exposure, None, None, Some((site, eop)), &config.header.aliases).into_iter().next()?;
    let (ra_deg, dec_deg) = altaz_to_icrs(site, eop, &geometry.epoch, geometry.alt_rad, geometry.az_rad);
    Some(separation_deg(position.ra_deg, position.dec_deg, ra_deg, dec_deg))
}

/// Centre to corner of a frame \[deg\].
#[must_use]
pub fn half_field_deg(exposure: &Exposure, config: &Config) -> f64 {
    let scale = pixel_scale_arcsec(config.detector.pixel_um, exposure.binning, config.telescope.focal_length_mm);
    (exposure.size_px.0 as f64).hypot(exposure.size_px.1 as f64) / 2.0 * scale / 3600.0
}

/// A word on frames whose header points outside the field of the predicted satellite.
#[must_use]
pub fn off_target_note<'a>(
    frames: impl Iterator<Item = (&'a PhotometryRow, &'a Exposure)>,
    config: &Config,
) -> Option<String> {
    let off = |(row, exposure): (&'a PhotometryRow, &Exposure)| {
        Some((row.pointing_sep_deg.filter(|sep_deg| *sep_deg > half_field_deg(exposure, config))?, row.frame.as_str()))
    };
    let off: Vec<(f64, &str)> = frames.filter_map(off).collect();
    let (worst_deg, frame) = off.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(format!(
        "warning: {} frames point outside the field around the predicted satellite (pointing_sep_deg, at most {worst_deg:.2} deg in \
         {frame}): another satellite, a wrong clock or old elements? Or a header that states another position",
        off.len()
    ))
}
