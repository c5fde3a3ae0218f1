//! Which measurements are of the same star: by its name, else by its place in the sky, else by its catalogue magnitudes.
//!
//! The catalogue's error of a star is shared by all its visits, so that the fit must know them. A name counts together with the
//! catalogue magnitude: numbers that a detection program assigns again in every frame are not names of stars.

use std::collections::{BTreeMap, HashMap};

use crate::tables::StarRow;

/// Measurements of one star lie within this \[arcsec\].
pub const SAME_STAR_ARCSEC: f64 = 1.0;
/// Catalogue magnitudes of one star agree to this \[mag\].
const SAME_MAG: f64 = 5e-4;

/// Index of the star of each row; `None` for a row that nothing distinguishes. `named` says whether `star_id` is a name.
#[must_use]
pub fn stars(rows: &[StarRow], named: bool) -> Vec<Option<usize>> {
    let rounded = |v: Option<f64>| v.filter(|v| v.is_finite()).map(|v| (v / SAME_MAG).round() as i64);
    let mags = |r: &StarRow| (rounded(r.catalogue_v_mag), rounded(r.catalogue_b_v_mag));
    let mut sky = Sky::default();
    let mut by_name = BTreeMap::new();
    let mut by_mags = BTreeMap::new();
    let mut n = 0;
    let one = |row: &StarRow| {
        let index = if named && !row.star_id.is_empty() {
            *by_name.entry((row.star_id.clone(), mags(row))).or_insert(n)
        } else if let (Some(ra), Some(dec)) = (row.ra_deg, row.dec_deg) {
            sky.star_at(ra, dec, n)
        } else {
            let (v, b_v) = mags(row);
            *by_mags.entry((v?, b_v?)).or_insert(n)
        };
        n += usize::from(index == n);
        Some(index)
    };
    rows.iter().map(one).collect()
}

/// Places of the stars so far, in cells of the size of the tolerance.
#[derive(Default)]
struct Sky {
    cells: HashMap<(i64, i64), Vec<(f64, f64, usize)>>,
}

impl Sky {
    /// The star within [`SAME_STAR_ARCSEC`] of a place, or `new` there.
    fn star_at(&mut self, ra_deg: f64, dec_deg: f64, new: usize) -> usize {
        let row = (dec_deg * 3600.0 / SAME_STAR_ARCSEC).floor() as i64;
        let ra_deg = ra_deg.rem_euclid(360.0);
        let column = |row: i64, ra_deg: f64| {
            // the same cosine for all stars of a row of cells
            let dec = (row as f64 * SAME_STAR_ARCSEC / 3600.0).to_radians();
            (ra_deg * 3600.0 * dec.cos() / SAME_STAR_ARCSEC).floor() as i64
        };
        for r in row - 1..=row + 1 {
            // both sides of 0 h
            for turned in [ra_deg, ra_deg - 360.0, ra_deg + 360.0] {
                let middle = column(r, turned);
                for c in middle - 1..=middle + 1 {
                    for (ra, dec, star) in self.cells.get(&(r, c)).into_iter().flatten() {
                        let d_ra = (turned - ra) * dec.to_radians().cos();
                        if 3600.0 * d_ra.hypot(dec_deg - dec) <= SAME_STAR_ARCSEC {
                            return *star;
                        }
                    }
                }
            }
        }
        self.cells.entry((row, column(row, ra_deg))).or_default().push((ra_deg, dec_deg, new));
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(id: &str, ra: f64, dec: f64, v: f64) -> StarRow {
        StarRow {
            star_id: id.into(),
            ra_deg: Some(ra),
            dec_deg: Some(dec),
            catalogue_v_mag: Some(v),
            catalogue_b_v_mag: Some(0.5),
            ..StarRow::default()
        }
    }

    #[test]
    fn a_name_with_another_magnitude_is_another_star() {
        let rows = [row("5", 10.0, 0.0, 12.0), row("5", 20.0, 0.0, 13.0), row("5", 10.0, 0.0, 12.0)];
        assert_eq!(stars(&rows, true), [Some(0), Some(1), Some(0)]);
    }

    #[test]
    fn places_within_an_arcsecond_are_one_star_also_at_the_pole_and_across_zero_hours() {
        let s = 1.0 / 3600.0;
        let rows = [
            row("", 10.0, -33.0, 12.0),
            row("", 10.0 + 0.9 * s / 33f64.to_radians().cos(), -33.0, 12.0),
            row("", 10.0, -33.0 + 1.2 * s, 12.0),
            row("", 100.0, 89.9999, 12.0),
            row("", 100.0 + 3.0, 89.9999, 12.0),
            row("", 359.9999, 1.0, 12.0),
            row("", 0.0001, 1.0, 12.0),
        ];
        assert_eq!(stars(&rows, false), [Some(0), Some(0), Some(1), Some(2), Some(2), Some(3), Some(3)]);
    }

    #[test]
    fn without_name_and_place_the_catalogue_magnitudes_tell() {
        let bare = |v: f64| StarRow { catalogue_v_mag: Some(v), catalogue_b_v_mag: Some(0.5), ..StarRow::default() };
        assert_eq!(stars(&[bare(12.345), bare(12.346), bare(12.345)], false), [Some(0), Some(1), Some(0)]);
        assert_eq!(stars(&[StarRow::default()], false), [None]);
    }
}
