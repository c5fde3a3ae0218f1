//! The star catalogue: any table with places and magnitudes, by the names VizieR gives its columns or by own ones.
//!
//! Degrees and magnitudes. Values that stand for "unknown" (blank, NaN, 0.0 errors, 99.999) become `None`; a row
//! without position or magnitude is counted with its reason. V of Tycho-2 and Gaia is made from their own magnitudes.
//! Not included: the network, equinoxes other than J2000, parallaxes.

mod angle;
mod layout;
mod names;
mod sky;
mod star;
#[cfg(test)]
mod tests;
mod transform;
mod tree;

pub use star::{Catalogue, CatalogueStar};

use std::collections::BTreeMap;
use std::path::Path;

use crate::bands::Band;
use crate::base::error::{Error, Result};
use crate::tables::read::{Row, Table};
use layout::Layout;
pub use sky::separation_deg;
pub use tree::direction;

/// How many reasons of skipped rows are kept.
pub const SKIPPED_SHOWN: usize = 10;

impl Catalogue {
    /// Reads `path`: CSV, TSV, ECSV, VOTable, or what [`Table`] reads next to them.
    ///
    /// `columns` maps `ra_deg`, `dec_deg`, `v_mag`, `v_mag_err`, `b_v_mag`, `b_v_err_mag`, `id`, `pm_ra_mas_yr`,
    /// `pm_dec_mas_yr` and `epoch_jyear` to names of the file; `b_v_mag` may be a difference, `g_psf-r_psf`. Without it
    /// columns are known by the names VizieR gives those of APASS, Tycho-2, Gaia and others, and by their descriptors
    /// (UCD). V = 0.0 and V ≥ 90 are read as unknown, as are errors that are not positive, and a B−V of exactly 0.0
    /// whose error is given as unknown.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Config`] for an unknown key of `stars.columns`; [`Error::Catalogue`] if the file is not
    /// a table, if a column is missing or of another equinox or unit, or if no usable star is left.
    pub fn read(path: &Path, columns: &BTreeMap<String, String>) -> Result<Catalogue> {
        Self::read_band(path, columns, Band::V)
    }

    /// As [`Catalogue::read`], with magnitudes of `band` and the colour index that goes with it. They are made from those of Gaia
    /// (B V R I g r i z), of SDSS or Pan-STARRS (B V R I) where the table has no column of the band, and are of V where they
    /// cannot be made: [`Catalogue::band`] says which.
    ///
    /// # Errors
    /// As [`Catalogue::read`].
    pub fn read_band(path: &Path, columns: &BTreeMap<String, String>, band: Band) -> Result<Catalogue> {
        names::check_keys(columns)?;
        let fail = |problem: String| Error::Catalogue { path: path.to_owned(), problem };
        // a table that cannot be read is a catalogue that cannot be used (exit code 5)
        let unreadable = |error: Error| match error {
            Error::Table { line, problem, .. } => {
                fail(line.map_or(problem.clone(), |line| format!("line {line}: {problem}")))
            }
            Error::Fits { problem, .. } => fail(format!("is a FITS file that cannot be read: {problem}")),
            other => other,
        };
        let is_catalogue = |table: &Table| Layout::find(table, columns, band.reference()).is_ok();
        let mut table = Table::open_where(path, &is_catalogue).map_err(unreadable)?;
        let layout = Layout::find(&table, columns, band.reference()).map_err(fail)?;
        let (band, column) = layout.band(&table);
        let file = path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
        let band_from = format!("{column} of the catalogue {file}");
        let mut catalogue =
            Catalogue { notes: table.notes.clone(), band, band_from, colour: layout.colour, ..Catalogue::default() };
        catalogue.notes.extend(layout.notes.iter().cloned());
        let mut row = Row::default();
        while table.read(&mut row).map_err(unreadable)? {
            match table.check(&row).and_then(|()| layout.star(&row, &table)) {
                Ok(star) => catalogue.stars.push(star),
                Err(reason) => {
                    catalogue.n_skipped += 1;
                    if catalogue.skipped.len() < SKIPPED_SHOWN {
                        catalogue.skipped.push(format!("{}: {reason}", table.place(&row)));
                    }
                }
            }
        }
        if catalogue.stars.is_empty() {
            return Err(fail(match catalogue.skipped.first() {
                Some(first) => format!("holds no usable star: {} rows skipped, first {first}", catalogue.n_skipped),
                None => "holds no rows under its column names".to_owned(),
            }));
        }
        if layout.may_hold_duplicates() {
            let n = sky::drop_duplicates(&mut catalogue.stars);
            if n > 0 {
                catalogue
                    .notes
                    .push(format!("{n} entries of stars that are in it twice dropped (1 arcsec, same magnitude)"));
            }
        }
        Ok(catalogue)
    }

    /// A catalogue of these stars.
    #[must_use]
    pub fn from_stars(stars: Vec<CatalogueStar>) -> Catalogue {
        Catalogue { stars, ..Catalogue::default() }
    }

    /// Indices of the stars within `radius_deg` of a point, brightest first.
    ///
    /// The first call builds a tree of all places: do not move stars after it, but make a new catalogue.
    #[must_use]
    pub fn near(&self, ra_deg: f64, dec_deg: f64, radius_deg: f64) -> Vec<usize> {
        let tree = self.tree.get_or_init(|| tree::Tree::of(&self.stars));
        let near = |i: &usize| {
            let s = &self.stars[*i];
            separation_deg(ra_deg, dec_deg, s.ra_deg, s.dec_deg) <= radius_deg
        };
        let mut found: Vec<usize> = tree.within(ra_deg, dec_deg, radius_deg).filter(near).collect();
        found.sort_by(|&a, &b| self.stars[a].v_mag.total_cmp(&self.stars[b].v_mag).then(a.cmp(&b)));
        found
    }
}
