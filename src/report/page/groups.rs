//! Rows of one satellite, in one band, through one instrument: what a chart may show together.
//!
//! A name says only what differs between the groups of a page, so that one group has none. Passes keep the numbers they
//! have in their night.

use std::collections::{BTreeMap, BTreeSet};

use super::parts::NightPage;
use crate::tables::PhotometryRow;
use crate::tables::row_passes::{passes, target};

/// What belongs together: satellite, band and instrument, as they are written.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    satellite: String,
    band: String,
    instrument: String,
}

/// The rows of one night in a group.
pub(super) struct Part<'a> {
    pub night: &'a NightPage,
    /// Passes with their place among all passes of the night.
    pub passes: Vec<(usize, Vec<&'a PhotometryRow>)>,
    pub rows: Vec<&'a PhotometryRow>,
}

/// One satellite in one band through one instrument.
pub(super) struct Group<'a> {
    /// What distinguishes it from the other groups; empty where it is the only one.
    pub name: String,
    pub band: String,
    /// In order of the nights.
    pub parts: Vec<Part<'a>>,
}

impl<'a> Group<'a> {
    pub(super) fn rows(&self) -> impl Iterator<Item = &'a PhotometryRow> {
        self.parts.iter().flat_map(|part| part.rows.iter().copied())
    }
}

/// The groups of some nights, in order of satellite, band and instrument; a night without a row of a target has none.
pub(super) fn groups(nights: &[NightPage]) -> Vec<Group<'_>> {
    let keyed: Vec<(&NightPage, Vec<Option<Key>>)> = nights.iter().map(|night| (night, keys(night))).collect();
    let all: BTreeSet<&Key> = keyed.iter().flat_map(|(_, keys)| keys.iter().flatten()).collect();
    let differs = |of: fn(&Key) -> &str| all.iter().map(|key| of(key)).collect::<BTreeSet<_>>().len() > 1;
    let named: [(bool, fn(&Key) -> &str); 3] = [
        (differs(|k| &k.satellite), |k| &k.satellite),
        (differs(|k| &k.band), |k| &k.band),
        (differs(|k| &k.instrument), |k| &k.instrument),
    ];
    let group = |key: &&Key| {
        let name = named.iter().filter(|(differs, _)| *differs).map(|(_, of)| of(key)).filter(|part| !part.is_empty());
        let parts = keyed.iter().map(|(night, keys)| part(night, keys, key)).filter(|part| !part.rows.is_empty());
        Group { name: name.collect::<Vec<_>>().join(", "), band: key.band.clone(), parts: parts.collect() }
    };
    all.iter().map(group).collect()
}

/// The rows of a night that have a key.
fn part<'a>(night: &'a NightPage, keys: &[Option<Key>], wanted: &Key) -> Part<'a> {
    let rows: Vec<&PhotometryRow> =
        night.rows.iter().zip(keys).filter(|(_, key)| key.as_ref() == Some(wanted)).map(|(row, _)| row).collect();
    let places: BTreeSet<*const PhotometryRow> = rows.iter().map(|row| std::ptr::from_ref(*row)).collect();
    let ours = |row: &&PhotometryRow| places.contains(&std::ptr::from_ref(*row));
    let of_pass = |(i, pass): (usize, Vec<&'a PhotometryRow>)| {
        let kept: Vec<&PhotometryRow> = pass.into_iter().filter(ours).collect();
        (!kept.is_empty()).then_some((i, kept))
    };
    let passes = passes(&night.rows).into_iter().enumerate().filter_map(of_pass).collect();
    Part { night, passes, rows }
}

/// The key of every row; `None` for frames of no target. The filter is the band where the night has several, else the
/// band is that of the table.
fn keys(night: &NightPage) -> Vec<Option<Key>> {
    let of_target =
        |row: &&PhotometryRow| !target(row).1.is_empty() || row.norad_cat_id.is_some() || row.v_mag.is_some();
    let filters: BTreeSet<&str> = night.rows.iter().filter(of_target).map(|r| r.filter.as_str()).collect();
    let instrument = night.stated("telescope").unwrap_or_default();
    // a satellite goes by its number: the name of one may be written in two ways
    let mut names: BTreeMap<(Option<i64>, &str), &str> = BTreeMap::new();
    for row in night.rows.iter().filter(|r| !r.object_name.is_empty()) {
        names.entry(target(row)).or_insert(&row.object_name);
    }
    let name = |row: &PhotometryRow| match names.get(&target(row)) {
        Some(name) => (*name).to_owned(),
        None => row.norad_cat_id.map(|n| n.to_string()).unwrap_or_default(),
    };
    let band = |row: &PhotometryRow| match row.filter.as_str() {
        filter if filters.len() > 1 && !filter.is_empty() => filter.to_owned(),
        _ => night.band().to_owned(),
    };
    let key = |row: &PhotometryRow| Key { satellite: name(row), band: band(row), instrument: instrument.clone() };
    night.rows.iter().map(|row| of_target(&row).then(|| key(row))).collect()
}
