//! Which satellite a frame is of, by where its header says it points.
//!
//! Used for target frames whose OBJECT names no satellite or several: the nearest candidate at mid-exposure is taken if it lies in
//! the field and three times nearer than the next. Frames of one OBJECT that names no satellite and that follow a candidate across
//! the sky are of it too. The position is that of the header; images are not searched for stars.

use crate::astrometry::catalogue::separation_deg;
use crate::astrometry::initial_pointing::initial_pointings;
use crate::base::error::{Error, Result};
use crate::config::Config;
use crate::frames::Exposure;
use crate::orbit::{EarthOrientation, Elements, Site, Tracker, read_elements_file};
use crate::pipeline::target::place::{half_field_deg, pointing_sep_deg};

/// How many times nearer than the next candidate the nearest must be.
const NEARER: f64 = 3.0;

/// Share of the frames of an OBJECT that must point at the candidate they follow.
const FOLLOWING: f64 = 0.8;

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

    /// The satellite that frames of one OBJECT follow across the sky, if their headers say so.
    ///
    /// At least two frames that are a field apart on the sky, four fifths of them with the same candidate in the field: a field
    /// of stars stays where it is, and a mount that follows a satellite by chance does not exist.
    #[must_use]
    pub fn followed(&self, frames: &[&Exposure], config: &Config) -> Option<u64> {
        let first = frames.first()?;
        let place = |e: &Exposure| {
            let aliases = &config.header.aliases;
            initial_pointings(e, None, None, Some((&self.site, &self.eop)), aliases).into_iter().next()
        };
        let from = place(first)?;
        let moved = |e: &&Exposure| {
            place(e).is_some_and(|to| {
                separation_deg(from.ra_deg, from.dec_deg, to.ra_deg, to.dec_deg) > 2.0 * half_field_deg(e, config)
            })
        };
        if !frames.iter().any(moved) {
            return None;
        }
        let number = frames.iter().take(3).find_map(|e| self.nearest(e, &[], config).ok())?;
        let follows = |e: &&&Exposure| self.nearest(e, &[number], config).is_ok();
        (frames.iter().filter(follows).count() as f64 >= FOLLOWING * frames.len() as f64).then_some(number)
    }
}
