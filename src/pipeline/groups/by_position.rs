//! Which satellite a frame is of, by where its header says it points.
//!
//! Used for target frames whose OBJECT names no satellite or several: the nearest candidate at mid-exposure is taken if it lies in
//! the field and three times nearer than the next. The position is that of the header; images are not searched for stars.

use crate::base::error::{Error, Result};
use crate::config::Config;
use crate::frames::Exposure;
use crate::orbit::{EarthOrientation, Elements, Site, Tracker, read_elements_file};
use crate::pipeline::target::place::{half_field_deg, pointing_sep_deg};

/// How many times nearer than the next candidate the nearest must be.
const NEARER: f64 = 3.0;

/// The satellites that frames may be of, ready to propagate.
#[derive(Debug)]
pub struct Candidates {
    trackers: Vec<(u64, Tracker)>,
    site: Site,
    eop: EarthOrientation,
}

impl Candidates {
    /// From the elements of the configuration; a satellite whose elements SGP4 refuses is no candidate.
    ///
    /// # Errors
    /// [`Error::Orbit`] without elements; those of [`read_elements_file`].
    pub fn of(config: &Config) -> Result<Self> {
        let Some(orbit) = &config.orbit else { return Err(Error::Orbit { problem: "no elements".into() }) };
        let (site, eop) = (Site::from_config(&config.site)?, EarthOrientation::from_config(orbit));
        let mut sets = read_elements_file(&orbit.elements)?.sets;
        sets.sort_by_key(Elements::norad_cat_id);
        let same = |a: &Elements, b: &Elements| a.norad_cat_id() == b.norad_cat_id();
        let trackers = sets.chunk_by(same).filter_map(|of_one| {
            let number = of_one.first()?.norad_cat_id();
            Some((number, Tracker::new(of_one.to_vec(), Some(number), site.clone(), eop).ok()?))
        });
        Ok(Self { trackers: trackers.collect(), site, eop })
    }

    /// The satellite that the frame points at, among these numbers (all where there are none).
    ///
    /// # Errors
    /// In words: the header does not say where the frame points, no candidate lies in the field, or two do.
    pub fn nearest(&self, exposure: &Exposure, among: &[u64], config: &Config) -> std::result::Result<u64, String> {
        let Some(time) = &exposure.time else { return Err("has no time".into()) };
        let mut found: Vec<(f64, u64)> = Vec::new();
        for (number, tracker) in self.trackers.iter().filter(|(n, _)| among.is_empty() || among.contains(n)) {
            let above = tracker.altitude_at(&time.mid).is_ok_and(|alt_rad| alt_rad > 0.0);
            let Some(geometry) = above.then(|| tracker.at(&time.mid).ok()).flatten() else { continue };
            match pointing_sep_deg(exposure, &geometry, (&self.site, &self.eop), config) {
                Some(sep_deg) => found.push((sep_deg, *number)),
                None => return Err("does not say in its header where it points".into()),
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let field_deg = half_field_deg(exposure, config);
        match found.as_slice() {
            [] => Err("was taken when no candidate was above the horizon".into()),
            [(sep_deg, number), ..] if *sep_deg > field_deg => Err(format!(
                "points {sep_deg:.2} deg from the nearest candidate, [{number}]; half its field is {field_deg:.2} deg"
            )),
            [(first_deg, number), (next_deg, next), ..] if *next_deg < NEARER * first_deg => Err(format!(
                "points {first_deg:.3} deg from [{number}] and {next_deg:.3} deg from [{next}]: too close to tell"
            )),
            [(_, number), ..] => Ok(*number),
        }
    }
}
