//! The star catalogue: a CSV or ECSV table with APASS names as VizieR writes them, or own names from the configuration.
//!
//! Degrees and magnitudes. Values that stand for "unknown" (blank, NaN, 0.0 errors, 99.999) become `None`; a row without
//! position or magnitude is counted with its reason. Left out: proper motion, VOTable, the network.

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::{Error, Result};

/// One entry.
#[derive(Debug, Clone, PartialEq)]
pub struct CatalogueStar {
    /// Name or number; the row number if the table has none.
    pub id: String,
    /// Right ascension, J2000 \[deg\], 0 to 360.
    pub ra_deg: f64,
    /// Declination, J2000 \[deg\].
    pub dec_deg: f64,
    /// V \[mag\].
    pub v_mag: f64,
    /// Its error, if known \[mag\].
    pub v_err_mag: Option<f64>,
    /// Colour B−V, if known \[mag\].
    pub b_v_mag: Option<f64>,
    /// Its error, if known \[mag\].
    pub b_v_err_mag: Option<f64>,
}

/// The entries of a file, in its order, duplicates included.
#[derive(Debug, Clone, Default)]
pub struct Catalogue {
    /// Usable entries.
    pub stars: Vec<CatalogueStar>,
    /// Rows without position or magnitude.
    pub n_skipped: usize,
    /// Why, for the first [`SKIPPED_SHOWN`] of them.
    pub skipped: Vec<String>,
}

/// How many reasons of skipped rows are kept.
pub const SKIPPED_SHOWN: usize = 10;

/// Keys of `stars.columns`, and the column names that are known without it.
const KNOWN: [(&str, &[&str]); 7] = [
    ("ra_deg", &["RAJ2000", "ra_deg", "RA_ICRS", "radeg", "ra"]),
    ("dec_deg", &["DEJ2000", "dec_deg", "DE_ICRS", "decdeg", "dec"]),
    ("v_mag", &["Vmag", "v_mag", "Johnson_V", "V"]),
    ("v_mag_err", &["e_Vmag", "v_mag_err", "v_err_mag", "Verr", "V_err"]),
    ("b_v_mag", &["B-V", "b_v_mag", "B_V", "BV"]),
    ("b_v_err_mag", &["e_B-V", "b_v_err_mag", "b_v_mag_err", "e_B_V", "BVerr"]),
    ("id", &["recno", "id", "Field", "Name", "source_id"]),
];
const B_MAG: &[&str] = &["Bmag", "b_mag", "Johnson_B"];
const B_ERR: &[&str] = &["e_Bmag", "b_mag_err", "Berr", "B_err"];

impl Catalogue {
    /// Reads `path`: comma, semicolon, tab, bar or space separated, with one line of names; ECSV by its own header.
    ///
    /// `columns` maps `ra_deg`, `dec_deg`, `v_mag`, `v_mag_err`, `b_v_mag`, `b_v_err_mag`, `id` to names of the file. B−V
    /// is made from Bmag and Vmag where it is absent. V = 0.0 and V ≥ 90 are read as unknown, as are errors that are not
    /// positive, and a B−V of exactly 0.0 whose error is given as unknown.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Config`] for an unknown key of `stars.columns`; [`Error::Catalogue`] if a column is missing,
    /// if positions are not in degrees, or if no usable star is left.
    pub fn read(path: &Path, columns: &BTreeMap<String, String>) -> Result<Catalogue> {
        check_keys(columns)?;
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
        let text = String::from_utf8_lossy(&bytes);
        let table = Table::parse(text.trim_start_matches('\u{feff}')).map_err(|p| fail(path, p))?;
        let layout = Layout::find(&table, columns).map_err(|p| fail(path, p))?;
        let mut catalogue = Catalogue::default();
        for row in &table.rows {
            match layout.star(row, table.names.len()) {
                Ok(star) => catalogue.stars.push(star),
                Err(reason) => {
                    catalogue.n_skipped += 1;
                    if catalogue.skipped.len() < SKIPPED_SHOWN {
                        catalogue.skipped.push(format!("line {}: {reason}", row.line));
                    }
                }
            }
        }
        if catalogue.stars.is_empty() {
            let why = match catalogue.skipped.first() {
                Some(first) => format!("holds no usable star: {} rows skipped, first {first}", catalogue.n_skipped),
                None => "holds no rows".to_owned(),
            };
            return Err(fail(path, why));
        }
        Ok(catalogue)
    }

    /// Indices of the stars within `radius_deg` of a point, brightest first.
    #[must_use]
    pub fn near(&self, ra_deg: f64, dec_deg: f64, radius_deg: f64) -> Vec<usize> {
        let near = |s: &CatalogueStar| separation_deg(ra_deg, dec_deg, s.ra_deg, s.dec_deg) <= radius_deg;
        let mut found: Vec<usize> = (0..self.stars.len()).filter(|&i| near(&self.stars[i])).collect();
        found.sort_by(|&a, &b| self.stars[a].v_mag.total_cmp(&self.stars[b].v_mag).then(a.cmp(&b)));
        found
    }
}

/// Angle between two points \[deg\], hav d = hav Δδ + cos δ₁ cos δ₂ hav Δα.
#[must_use]
pub fn separation_deg(ra1_deg: f64, dec1_deg: f64, ra2_deg: f64, dec2_deg: f64) -> f64 {
    let hav = |deg: f64| (deg.to_radians() / 2.0).sin().powi(2);
    let cos = dec1_deg.to_radians().cos() * dec2_deg.to_radians().cos();
    let h = hav(dec2_deg - dec1_deg) + cos * hav(ra2_deg - ra1_deg);
    (2.0 * h.sqrt().min(1.0).asin()).to_degrees()
}

fn fail(path: &Path, problem: String) -> Error {
    Error::Catalogue { path: path.to_owned(), problem }
}

fn check_keys(columns: &BTreeMap<String, String>) -> Result<()> {
    for key in columns.keys() {
        if !KNOWN.iter().any(|(k, _)| k == key) {
            let known: Vec<&str> = KNOWN.iter().map(|(k, _)| *k).collect();
            return Err(Error::Config {
                key: format!("stars.columns.{key}"),
                problem: format!("is no column satphot reads; known: {}", known.join(", ")),
            });
        }
    }
    Ok(())
}

/// A table of text fields with the line each row came from.
struct Table {
    names: Vec<String>,
    /// Unit of a column, where an ECSV header gives one.
    units: BTreeMap<String, String>,
    rows: Vec<Row>,
}

struct Row {
    line: usize,
    fields: Vec<String>,
}

impl Table {
    fn parse(text: &str) -> std::result::Result<Table, String> {
        let (units, declared) = ecsv_header(text);
        let mut lines = text.lines().enumerate().filter(|(_, l)| !l.starts_with('#') && !l.trim().is_empty());
        let (_, header) = lines.next().ok_or("is empty: a line of column names is needed")?;
        let delimiter = declared.unwrap_or_else(|| guess_delimiter(header));
        let names: Vec<String> = split(header, delimiter)?.iter().map(|n| n.trim().to_owned()).collect();
        let mut rows = Vec::new();
        for (i, line) in lines {
            let fields = split(line, delimiter).map_err(|e| format!("line {}: {e}", i + 1))?;
            // VizieR's text output has a line of units and a line of dashes under the names.
            if fields.iter().all(|f| !f.trim().is_empty() && f.trim().chars().all(|c| c == '-')) && rows.len() <= 1 {
                rows.clear();
                continue;
            }
            rows.push(Row { line: i + 1, fields });
        }
        Ok(Table { names, units, rows })
    }

    /// Exact name first, then without regard to case.
    fn column(&self, name: &str) -> Option<usize> {
        let exact = self.names.iter().position(|n| n == name);
        exact.or_else(|| self.names.iter().position(|n| n.eq_ignore_ascii_case(name)))
    }
}

/// Units per column and the delimiter from the `#` lines of an ECSV file; nothing for other files.
fn ecsv_header(text: &str) -> (BTreeMap<String, String>, Option<u8>) {
    let mut units = BTreeMap::new();
    if !text.starts_with("# %ECSV") {
        return (units, None);
    }
    let (mut delimiter, mut name) = (b' ', String::new());
    for line in text.lines().take_while(|l| l.starts_with('#')) {
        let bare = line.trim_start_matches(['#', ' ', '-', '{']).trim_end_matches('}');
        if let Some(d) = bare.strip_prefix("delimiter:") {
            delimiter = d.trim().trim_matches(['\'', '"']).bytes().next().unwrap_or(b' ');
        }
        for part in bare.split(", ") {
            let clean = |v: &str| v.trim().trim_matches(['\'', '"']).to_owned();
            if let Some(v) = part.trim().strip_prefix("name:") {
                name = clean(v);
            } else if let Some(v) = part.trim().strip_prefix("unit:") {
                units.insert(name.clone(), clean(v));
            }
        }
    }
    (units, Some(delimiter))
}

/// The separator that occurs most often in the line of names; space if none does.
fn guess_delimiter(header: &str) -> u8 {
    let count = |d: u8| header.bytes().filter(|b| *b == d).count();
    let best = [b',', b'\t', b';', b'|'].into_iter().max_by_key(|d| (count(*d), u8::MAX - d));
    best.filter(|d| count(*d) > 0).unwrap_or(b' ')
}

/// One line to its fields; runs of spaces count as one separator.
fn split(line: &str, delimiter: u8) -> std::result::Result<Vec<String>, String> {
    let squeezed;
    let line = if delimiter == b' ' {
        let (mut quoted, mut out) = (false, String::new());
        for c in line.trim().chars() {
            quoted ^= c == '"';
            let space = c.is_whitespace() && !quoted;
            if !(space && out.ends_with(' ')) {
                out.push(if space { ' ' } else { c });
            }
        }
        squeezed = out;
        &squeezed
    } else {
        line
    };
    let mut reader =
        csv::ReaderBuilder::new().has_headers(false).flexible(true).delimiter(delimiter).from_reader(line.as_bytes());
    match reader.records().next() {
        Some(Ok(record)) => Ok(record.iter().map(|f| f.trim().to_owned()).collect()),
        Some(Err(e)) => Err(e.to_string()),
        None => Ok(Vec::new()),
    }
}

/// Where each quantity stands.
struct Layout {
    ra: usize,
    dec: usize,
    v: usize,
    v_err: Option<usize>,
    b_v: Option<usize>,
    b_v_err: Option<usize>,
    b: Option<usize>,
    b_err: Option<usize>,
    id: Option<usize>,
}

impl Layout {
    fn find(table: &Table, columns: &BTreeMap<String, String>) -> std::result::Result<Layout, String> {
        let any = |names: &[&str]| names.iter().find_map(|n| table.column(n));
        let present = || table.names.join(", ");
        let find = |key: &str| -> std::result::Result<Option<usize>, String> {
            match columns.get(key) {
                Some(own) => table
                    .column(own)
                    .map(Some)
                    .ok_or_else(|| format!("column `{own}` (stars.columns.{key}) is missing; present: {}", present())),
                None => Ok(KNOWN.iter().find(|(k, _)| *k == key).and_then(|(_, names)| any(names))),
            }
        };
        let need = |key: &str| {
            let usual = KNOWN.iter().find(|(k, _)| *k == key).map_or("", |(_, n)| n[0]);
            find(key)?.ok_or_else(|| {
                format!(
                    "column `{usual}` is missing; present: {}; name it with stars.columns.{key} = \"...\"",
                    present()
                )
            })
        };
        let layout = Layout {
            ra: need("ra_deg")?,
            dec: need("dec_deg")?,
            v: need("v_mag")?,
            v_err: find("v_mag_err")?,
            b_v: find("b_v_mag")?,
            b_v_err: find("b_v_err_mag")?,
            b: any(B_MAG),
            b_err: any(B_ERR),
            id: find("id")?,
        };
        for i in [layout.ra, layout.dec] {
            let name = &table.names[i];
            if let Some(unit) = table.units.get(name).filter(|u| !matches!(u.as_str(), "deg" | "degree" | "degrees")) {
                return Err(format!("column `{name}` is in `{unit}`; degrees are needed"));
            }
        }
        Ok(layout)
    }

    fn star(&self, row: &Row, n_columns: usize) -> std::result::Result<CatalogueStar, String> {
        if row.fields.len() != n_columns {
            return Err(format!("{} fields, but {n_columns} column names", row.fields.len()));
        }
        let text = |i: usize| row.fields.get(i).map_or("", String::as_str);
        let ra_deg = number(text(self.ra)).ok_or_else(|| format!("no right ascension (`{}`)", text(self.ra)))?;
        let dec_deg = number(text(self.dec)).ok_or_else(|| format!("no declination (`{}`)", text(self.dec)))?;
        if !(-360.0..=360.0).contains(&ra_deg) || !(-90.0..=90.0).contains(&dec_deg) {
            return Err(format!("position {ra_deg} {dec_deg} deg is not on the sky"));
        }
        let v_mag = magnitude(text(self.v)).ok_or_else(|| format!("no V magnitude (`{}`)", text(self.v)))?;
        let v_err_mag = self.v_err.and_then(|i| error(text(i)));
        let (b_v_mag, b_v_err_mag) = self.colour(&text, v_mag, v_err_mag);
        let id = self.id.map(text).filter(|t| !t.is_empty());
        Ok(CatalogueStar {
            id: id.map_or_else(|| format!("line {}", row.line), str::to_owned),
            ra_deg: ra_deg.rem_euclid(360.0),
            dec_deg,
            v_mag,
            v_err_mag,
            b_v_mag,
            b_v_err_mag,
        })
    }

    /// B−V and its error: the table's own, else from B and V.
    fn colour<'a>(
        &self,
        text: &dyn Fn(usize) -> &'a str,
        v_mag: f64,
        v_err_mag: Option<f64>,
    ) -> (Option<f64>, Option<f64>) {
        let err = self.b_v_err.and_then(|i| error(text(i)));
        let own = self.b_v.and_then(|i| number(text(i))).filter(|c| c.abs() < 20.0);
        // 0.0 beside a column of errors that holds none is the catalogue's "unknown", not an A0 star
        let own = own.filter(|c| *c != 0.0 || self.b_v_err.is_none() || err.is_some());
        if own.is_some() {
            return (own, err);
        }
        match self.b.and_then(|i| magnitude(text(i))) {
            Some(b_mag) => {
                let b_err = self.b_err.and_then(|i| error(text(i)));
                (Some(b_mag - v_mag), b_err.zip(v_err_mag).map(|(b, v)| b.hypot(v)))
            }
            None => (None, None),
        }
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|v| v.is_finite())
}

/// A magnitude; 0.0, 99.999 and their like are unknown.
fn magnitude(text: &str) -> Option<f64> {
    number(text).filter(|m| *m != 0.0 && m.abs() < 90.0)
}

/// An error; what is not positive, or 9.999 and above, is unknown.
fn error(text: &str) -> Option<f64> {
    number(text).filter(|e| *e > 0.0 && *e < 9.99)
}

#[cfg(test)]
#[path = "catalogue_tests.rs"]
mod tests;
