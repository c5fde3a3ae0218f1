//! The kinds of light a page distinguishes.

use crate::brightness::Illum;
use crate::figures::canvas::{GREEN, GREY, ORANGE, Paint, SKY_BLUE};
use crate::tables::PhotometryRow;

pub(super) const KINDS: [(&str, &str, &[Illum]); 3] = [
    ("sunlit", "sun", &[Illum::Sun]),
    ("penumbra or Earthshine", "earthshine", &[Illum::Penumbra, Illum::Earthshine]),
    ("moonlit or dark", "moon", &[Illum::Moon, Illum::LunarEarthshine, Illum::None]),
];

/// Which of [`KINDS`] lights a row; their number where no model says it.
pub(super) fn kind_of(row: &PhotometryRow) -> usize {
    let light = Illum::from_cell(&row.illum);
    KINDS.iter().position(|(_, _, lights)| light.is_some_and(|l| lights.contains(&l))).unwrap_or(KINDS.len())
}

/// The colour of a light of [`kind_of`].
pub(super) fn paint_of_kind(kind: usize) -> Paint<'static> {
    let class = KINDS.get(kind).map_or("unmodelled", |k| k.1);
    [ORANGE, GREEN, SKY_BLUE].get(kind).copied().unwrap_or(GREY).class(class)
}

/// Every light with its name.
pub(super) fn named() -> Vec<(&'static str, Paint<'static>)> {
    let names = KINDS.iter().map(|k| k.0).chain(["no model"]);
    names.enumerate().map(|(kind, name)| (name, paint_of_kind(kind))).collect()
}
