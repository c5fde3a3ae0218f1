//! The kinds of light a page tells apart.

use crate::brightness::Illum;
use crate::tables::PhotometryRow;

pub(super) const KINDS: [(&str, &str, &[Illum]); 3] = [
    ("sunlit", "sun", &[Illum::Sun]),
    ("penumbra or Earthshine", "earthshine", &[Illum::Penumbra, Illum::Earthshine]),
    ("moonlit or dark", "moon", &[Illum::Moon, Illum::LunarEarthshine, Illum::None]),
];

/// Which of [`KINDS`] lights a row; their number where no model tells.
pub(super) fn kind_of(row: &PhotometryRow) -> usize {
    let light = Illum::from_cell(&row.illum);
    KINDS.iter().position(|(_, _, lights)| light.is_some_and(|l| lights.contains(&l))).unwrap_or(KINDS.len())
}

/// The colour of a light of [`kind_of`].
pub(super) fn class_of(kind: usize) -> &'static str {
    KINDS.get(kind).map_or("unmodelled", |k| k.1)
}
