//! Which satellite of the elements a frame is of, by its OBJECT.
//!
//! Names, catalogue numbers, international designators and the aliases of `[[satellites]]`. It does not cover positions
//! (`super::by_position`): a frame whose OBJECT names no satellite is a star frame.

use std::collections::HashMap;
use std::path::Path;

use crate::base::error::Result;
use crate::config::{Config, SatelliteEntry};
use crate::frames::{letters, matches_glob, name_variants, names_object};
use crate::orbit::read_elements_file;

/// A satellite of the elements.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Object {
    /// Catalogue number.
    pub norad_cat_id: u64,
    /// Name; empty where the elements have none.
    pub name: String,
    /// International designator, `1998-067A`.
    pub object_id: String,
}

impl Object {
    /// The name, else the catalogue number.
    #[must_use]
    pub fn label(&self) -> String {
        if self.name.is_empty() { self.norad_cat_id.to_string() } else { self.name.clone() }
    }

    /// Whether a pattern of `[[satellites]]` is of this satellite.
    #[must_use]
    pub fn is_of(&self, pattern: &str) -> bool {
        let (pattern, upper) = (pattern.trim().to_uppercase(), self.name.to_uppercase());
        let mut names = name_variants(&upper);
        names.extend([upper, self.norad_cat_id.to_string(), self.object_id.to_uppercase()]);
        names.iter().any(|name| matches_glob(&pattern, name))
    }
}

/// What OBJECT says of the satellite.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Assigned {
    /// It names this one.
    Satellite(u64),
    /// It names several equally well.
    Ambiguous(Vec<u64>),
    /// It names none: a star field.
    NoSatellite,
}

/// The satellites of the elements, in the order of their numbers.
#[derive(Debug, Clone, Default)]
pub struct Objects {
    list: Vec<Object>,
    /// Which of them have a name, by its letters and digits.
    by_name: HashMap<String, Vec<usize>>,
    /// Damaged sets, which are not used.
    pub warnings: Vec<String>,
}

impl Objects {
    /// Reads the elements; a damaged set is a warning.
    ///
    /// # Errors
    /// Those of [`read_elements_file`].
    pub fn read(path: &Path) -> Result<Self> {
        let file = read_elements_file(path)?;
        let object = |set: &crate::orbit::Elements| Object {
            norad_cat_id: set.norad_cat_id(),
            name: set.name().trim().to_owned(),
            object_id: set.object_id().trim().to_owned(),
        };
        let mut list: Vec<Object> = file.sets.iter().map(object).collect();
        // of several sets of one object the first that has a name
        list.sort_by_key(|o| (o.norad_cat_id, o.name.is_empty()));
        list.dedup_by_key(|o| o.norad_cat_id);
        let warnings = match file.damaged.first() {
            Some(first) => {
                let line = first.line.map(|l| format!(":{l}")).unwrap_or_default();
                vec![format!(
                    "{}{line}: {}; {} damaged sets are not used",
                    path.display(),
                    first.problem,
                    file.damaged.len()
                )]
            }
            None => Vec::new(),
        };
        Ok(Self { warnings, ..Self::of(list) })
    }

    /// These satellites.
    #[must_use]
    pub fn of(list: Vec<Object>) -> Self {
        let mut by_name: HashMap<String, Vec<usize>> = HashMap::new();
        for (at, object) in list.iter().enumerate() {
            for name in name_variants(&object.name).iter().chain([&object.object_id]) {
                let places = by_name.entry(letters(name)).or_default();
                if !places.contains(&at) {
                    places.push(at);
                }
            }
        }
        by_name.remove("");
        Self { list, by_name, warnings: Vec::new() }
    }

    /// The satellites.
    #[must_use]
    pub fn list(&self) -> &[Object] {
        &self.list
    }

    /// The satellite of a catalogue number.
    #[must_use]
    pub fn get(&self, norad_cat_id: u64) -> Option<&Object> {
        let at = self.list.binary_search_by_key(&norad_cat_id, |o| o.norad_cat_id).ok()?;
        self.list.get(at)
    }

    /// Which satellite a text of OBJECT names: by an alias of the configuration, by number or designator, by the longest
    /// name in it.
    #[must_use]
    pub fn assign(&self, object: &str, rules: &[SatelliteEntry]) -> Assigned {
        let upper = object.trim().to_uppercase();
        let alias = |rule: &&SatelliteEntry| {
            rule.norad_cat_id.is_some()
                && rule.objects.iter().any(|p| matches_glob(&p.to_uppercase(), &upper) || names_object(p, object))
        };
        if let Some(number) = rules.iter().find(alias).and_then(|rule| rule.norad_cat_id) {
            return Assigned::Satellite(number);
        }
        let words: Vec<String> =
            object.split(|c: char| !c.is_alphanumeric()).map(letters).filter(|w| !w.is_empty()).collect();
        if let Some(found) = catalogue_number(&words).and_then(|n| self.get(n)) {
            return Assigned::Satellite(found.norad_cat_id);
        }
        // names as whole words: the field `missile` is not the ISS, STARLINK-10071 not STARLINK-1007
        let mut best: (usize, &[usize]) = (0, &[]);
        for first in 0..words.len() {
            let mut name = String::new();
            for word in &words[first..] {
                name += word;
                if let Some(places) = self.by_name.get(&name).filter(|_| name.len() > best.0) {
                    best = (name.len(), places);
                }
            }
        }
        let best: Vec<&Object> = best.1.iter().filter_map(|at| self.list.get(*at)).collect();
        match best.as_slice() {
            [] => Assigned::NoSatellite,
            [one] => Assigned::Satellite(one.norad_cat_id),
            several => Assigned::Ambiguous(several.iter().map(|o| o.norad_cat_id).collect()),
        }
    }
}

/// A catalogue number that stands alone or behind a word that says what it is; HD 25544 is a star.
fn catalogue_number(words: &[String]) -> Option<u64> {
    const BEFORE: [&str; 6] = ["norad", "satcat", "sat", "catnr", "ssn", "satellite"];
    let number = |word: &String| word.parse().ok();
    match words {
        [only] => number(only),
        _ => words.windows(2).filter(|w| BEFORE.contains(&w[0].as_str())).find_map(|w| number(&w[1])),
    }
}

/// The satellites among which the frames are distinguished: none where the configuration names the one that is reduced, or
/// has no elements.
///
/// # Errors
/// Those of [`Objects::read`].
pub fn objects_of(config: &Config) -> Result<Objects> {
    match &config.orbit {
        Some(orbit) if orbit.norad_cat_id.is_none() && orbit.elements.is_file() => Objects::read(&orbit.elements),
        _ => Ok(Objects::default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn objects() -> Objects {
        let object = |norad_cat_id, name: &str, object_id: &str| Object {
            norad_cat_id,
            name: name.into(),
            object_id: object_id.into(),
        };
        Objects::of(vec![
            object(25544, "ISS (ZARYA)", "1998-067A"),
            object(44714, "STARLINK-1007", "2019-074B"),
            object(48274, "CSS (TIANHE)", "2021-035A"),
            object(50000, "COSMOS 1408 DEB", "1982-092X"),
            object(50001, "COSMOS 1408 DEB", "1982-092Y"),
        ])
    }

    #[test]
    fn an_object_is_found_by_name_number_designator_and_alias() {
        let rule = SatelliteEntry { objects: vec!["Station".into()], norad_cat_id: Some(48274), model: None };
        for (text, number) in [
            ("ISS", 25544),
            ("ISS (ZARYA)", 25544),
            ("iss zarya pass 2", 25544),
            ("NORAD 44714", 44714),
            ("Starlink 1007", 44714),
            ("sat 2021-035A", 48274),
            ("my station", 48274),
        ] {
            assert_eq!(objects().assign(text, std::slice::from_ref(&rule)), Assigned::Satellite(number), "{text}");
        }
    }

    #[test]
    fn a_star_field_and_an_ambiguous_name_are_no_satellite() {
        for text in ["SA 104", "HD 25544", "STARLINK-10071", "Landolt 92", "M31", "missile field", ""] {
            assert_eq!(objects().assign(text, &[]), Assigned::NoSatellite, "{text}");
        }
        assert!(matches!(objects().assign("COSMOS 1408 DEB", &[]), Assigned::Ambiguous(names) if names.len() == 2));
    }
}
