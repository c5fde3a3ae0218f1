//! Texts and files of elements to one tracker for each satellite in them.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use satphot::orbit::{EarthOrientation, Elements, elements_from_bytes, read_elements};
use satphot::{Result, Site, Tracker};

use crate::errors::{bad, raise};

/// Elements, site and what is accepted of them, as the package hands them over.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Watch {
    /// Texts, or names of files.
    elements: Vec<(bool, String)>,
    /// Latitude and longitude \[deg\], height \[m\].
    site: (f64, f64, f64),
    norad: Option<u64>,
    max_age_d: f64,
    force_age: bool,
}

/// A satellite with its tracker.
pub struct Tracked {
    /// Its catalogue number.
    pub norad_cat_id: u64,
    /// Its name, empty where the elements have none.
    pub name: String,
    /// Where it is.
    pub tracker: Tracker,
}

impl Watch {
    /// The site.
    pub fn site(&self) -> PyResult<Site> {
        site(self.site)
    }

    /// The satellites, in the order in which they are first named.
    pub fn satellites(&self) -> PyResult<Vec<Tracked>> {
        if !(self.max_age_d > 0.0) {
            return Err(bad("max_age_d", format!("{} d is not above 0; usually 14 d", self.max_age_d)));
        }
        let site = self.site()?;
        let mut all = Vec::new();
        for (is_file, text) in &self.elements {
            let sets = if *is_file {
                read_elements(&PathBuf::from(text))
            } else {
                elements_from_bytes(text.as_bytes().to_vec(), Path::new("elements"))
            };
            for sets in by_object(sets.map_err(raise)?) {
                all.extend(self.tracked(sets, &site).map_err(raise)?);
            }
        }
        match (all.is_empty(), self.norad) {
            (false, _) => Ok(all),
            (true, Some(number)) => Err(bad("norad", format!("no elements of {number} are given"))),
            (true, None) => Err(bad("elements", "no element set is given; TLE, 3LE and OMM are read".into())),
        }
    }

    /// The satellite of some sets, unless another one is wanted.
    fn tracked(&self, sets: Vec<Elements>, site: &Site) -> Result<Option<Tracked>> {
        let number = sets.first().map(Elements::norad_cat_id);
        if self.norad.is_some() && self.norad != number {
            return Ok(None);
        }
        let tracker = Tracker::new(sets, None, site.clone(), EarthOrientation::default())?
            .with_age_limit(self.max_age_d, self.force_age);
        let (name, norad_cat_id) = tracker.object();
        Ok(Some(Tracked { norad_cat_id, name: name.to_owned(), tracker }))
    }
}

/// A site from latitude and longitude \[deg\] and height \[m\].
pub fn site((lat_deg, lon_deg, height_m): (f64, f64, f64)) -> PyResult<Site> {
    Site::new(lat_deg, lon_deg, height_m).map_err(raise)
}

/// The sets of each object, in the order in which objects are first named.
fn by_object(sets: Vec<Elements>) -> Vec<Vec<Elements>> {
    let mut places = std::collections::HashMap::new();
    let mut groups: Vec<Vec<Elements>> = Vec::new();
    for set in sets {
        let place = *places.entry(set.norad_cat_id()).or_insert(groups.len());
        match groups.get_mut(place) {
            Some(group) => group.push(set),
            None => groups.push(vec![set]),
        }
    }
    groups
}
