//! The satellites of a table of observations: trackers by catalogue number and name, and those whose elements stand in the rows.
//!
//! A file of many objects is read once, and only the objects that the table names become trackers.

use std::collections::HashMap;

use crate::base::error::{Error, Result};
use crate::config;
use crate::orbit::elements::{element_names, read_elements_file};
use crate::orbit::{EarthOrientation, Elements, Site, Tracker};
use crate::tables::read::Row;

use super::columns::Columns;

/// Which tracker a row has, or why none.
pub type Which = std::result::Result<usize, String>;

/// Trackers of the satellites of a table.
#[derive(Debug, Default)]
pub struct Satellites {
    trackers: Vec<Tracker>,
    by_number: HashMap<u64, Which>,
    by_lines: HashMap<[String; 2], Which>,
    sets: HashMap<u64, Vec<Elements>>,
    /// Names in small letters; several numbers where a name is not of one object.
    names: HashMap<String, Vec<u64>>,
    file: String,
    orbit: Option<config::Orbit>,
    site: Option<Site>,
    /// For the reader.
    pub notes: Vec<String>,
}

impl Satellites {
    /// The objects of a file of elements; without one only rows with elements of their own have a place. A tracker needs a
    /// site: any, since each row has its own.
    ///
    /// # Errors
    /// Those of [`read_elements_file`]; [`Error::Orbit`] where the number that is named is not in the file.
    pub fn new(orbit: Option<&config::Orbit>) -> Result<Self> {
        let mut new = Self { orbit: orbit.cloned(), site: Some(Site::new(0.0, 0.0, 0.0)?), ..Self::default() };
        let Some(orbit) = orbit else { return Ok(new) };
        new.file = orbit.elements.display().to_string();
        let file = read_elements_file(&orbit.elements)?;
        if !file.damaged.is_empty() {
            new.notes.push(format!(
                "{}: {} damaged sets are not used, the first: {}",
                new.file,
                file.damaged.len(),
                file.damaged[0].problem
            ));
        }
        for set in file.sets {
            new.sets.entry(set.norad_cat_id()).or_default().push(set);
        }
        for (number, sets) in &new.sets {
            for name in element_names(sets) {
                new.names.entry(name.to_lowercase()).or_default().push(*number);
            }
        }
        match orbit.norad_cat_id {
            Some(number) if !new.sets.contains_key(&number) => Err(Error::Orbit {
                problem: format!(
                    "catalogue number {number} is not in {}, which holds {} objects",
                    new.file,
                    new.sets.len()
                ),
            }),
            _ => Ok(new),
        }
    }

    /// The tracker of a row: by its own elements, its catalogue number, its name, else the one object that is meant.
    pub fn of(&mut self, row: &Row, columns: &Columns) -> Which {
        if let Some(lines) = columns.tle_lines {
            let lines = lines.map(|i| row.get(i).to_owned());
            if lines.iter().all(|l| !l.is_empty()) {
                return self.of_lines(lines);
            }
        }
        let number_cell = columns.norad_cat_id.map_or("", |i| row.get(i));
        let name_cell = columns.object_name.map_or("", |i| row.get(i));
        let number = match (number_cell, name_cell) {
            ("", "") => self.only()?,
            ("", name) => self.named(name)?,
            (cell, _) => number_of(cell).ok_or_else(|| format!("\"{cell}\" is not a catalogue number"))?,
        };
        if let Some(known) = self.by_number.get(&number) {
            return known.clone();
        }
        let which = match self.sets.remove(&number) {
            Some(sets) => self.add(sets),
            None if self.file.is_empty() => Err("no elements are given".into()),
            None => Err(format!("no elements of {number} in {}", self.file)),
        };
        self.by_number.insert(number, which.clone());
        which
    }

    /// A tracker.
    #[must_use]
    pub fn get(&self, which: usize) -> Option<&Tracker> {
        self.trackers.get(which)
    }

    /// The object of rows that name none.
    fn only(&self) -> std::result::Result<u64, String> {
        let number = self.orbit.as_ref().and_then(|o| o.norad_cat_id);
        let mut all = self.names.values().flatten();
        let first = number.or_else(|| all.next().copied());
        match first {
            Some(one) if number.is_some() || all.all(|n| *n == one) => Ok(one),
            Some(_) => Err(format!("the row names no satellite, and {} holds several", self.file)),
            None => Err("no elements are given".into()),
        }
    }

    fn named(&self, name: &str) -> std::result::Result<u64, String> {
        match self.names.get(&name.to_lowercase()).map(Vec::as_slice) {
            Some([one]) => Ok(*one),
            Some(_) => Err(format!("several objects of {} are called {name}; give the catalogue number", self.file)),
            None => match number_of(name) {
                Some(number) => Ok(number),
                None => Err(format!("no elements of \"{name}\" in {}", self.file)),
            },
        }
    }

    fn of_lines(&mut self, lines: [String; 2]) -> Which {
        if let Some(known) = self.by_lines.get(&lines) {
            return known.clone();
        }
        let which = match Elements::from_tle("", &lines[0], &lines[1]) {
            Ok(set) => self.add(vec![set]),
            Err(error) => Err(error.to_string()),
        };
        self.by_lines.insert(lines, which.clone());
        which
    }

    fn add(&mut self, sets: Vec<Elements>) -> Which {
        let Some(site) = self.site.clone() else { return Err("no site".into()) };
        let eop = self.orbit.as_ref().map(EarthOrientation::from_config).unwrap_or_default();
        let tracker = Tracker::new(sets, None, site, eop).map_err(|e| e.to_string())?;
        self.trackers.push(match &self.orbit {
            Some(orbit) => tracker.with_age_limit(orbit.max_age_d, orbit.force_age),
            None => tracker,
        });
        Ok(self.trackers.len() - 1)
    }
}

/// A catalogue number as tables write it: `25544`, `25544.0`, `25544U`.
fn number_of(cell: &str) -> Option<u64> {
    let cell = cell.trim();
    let plain = cell.strip_suffix(".0").or_else(|| cell.strip_suffix(['U', 'u'])).unwrap_or(cell);
    plain.parse().ok().filter(|n| (1..=999_999_999).contains(n))
}
