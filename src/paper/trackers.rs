//! Satellites by name: elements given, else the embedded ones of June 2025.
//!
//! One tracker per object; a target is found by catalogue number or by a part of its name, in any case.

use std::path::Path;

use crate::base::error::{Error, Result};
use crate::config::ELEMENTS;
use crate::orbit::{EarthOrientation, Elements, Site, Tracker, read_elements};

/// Trackers of several objects over one site.
#[derive(Debug)]
pub struct Targets {
    trackers: Vec<(u64, Tracker)>,
}

impl Targets {
    /// The objects of these files, and behind them the embedded ones.
    ///
    /// # Errors
    /// Those of [`read_elements`] and [`Tracker::new`].
    pub fn new(files: &[impl AsRef<Path>], site: &Site) -> Result<Self> {
        let mut trackers: Vec<(u64, Tracker)> = Vec::new();
        let given = files.iter().map(|file| read_elements(file.as_ref())).collect::<Result<Vec<_>>>()?.concat();
        let embedded = ELEMENTS.iter().map(|(name, text)| sets(name, text)).collect::<Result<Vec<_>>>()?.concat();
        for sets in [given, embedded] {
            let mut numbers: Vec<u64> = sets.iter().map(Elements::norad_cat_id).collect();
            numbers.dedup();
            for number in numbers {
                if !trackers.iter().any(|(known, _)| *known == number) {
                    let tracker = Tracker::new(sets.clone(), Some(number), site.clone(), EarthOrientation::default())?;
                    trackers.push((number, tracker));
                }
            }
        }
        Ok(Self { trackers })
    }

    /// The tracker of a name or number; the first where several fit.
    #[must_use]
    pub fn find(&self, target: &str) -> Option<&Tracker> {
        let wanted = target.trim().to_ascii_lowercase();
        let fits = |(number, tracker): &&(u64, Tracker)| {
            number.to_string() == wanted
                || tracker.names().iter().any(|name| {
                    let name = name.to_ascii_lowercase();
                    let mut words = name.split(|c: char| !c.is_ascii_alphanumeric() && c != '-');
                    name == wanted || words.any(|word| word == wanted)
                })
        };
        self.trackers.iter().find(fits).map(|(_, tracker)| tracker)
    }
}

/// The sets of an embedded text of three-line elements.
fn sets(name: &str, text: &str) -> Result<Vec<Elements>> {
    let lines: Vec<&str> = text.lines().collect();
    lines
        .chunks(3)
        .map(|set| match set {
            [title, first, second] => Elements::from_tle(title, first, second),
            _ => Err(Error::Orbit { problem: format!("embedded elements {name} are damaged") }),
        })
        .collect()
}
