//! The stars of several fields as one catalogue: each star once, with the names VizieR gives its columns.
//!
//! Degrees and magnitudes, as they came. It does not cover stars without V, which no fit can use.

use std::collections::HashSet;

use super::apass::{self, Rows};
use super::client::{Answer, Client};
use super::fields::Field;
use super::query::apass_query;
use crate::base::error::{Error, Result};
use crate::base::time::iso_utc;
use crate::config::Fetch;

/// A catalogue as text.
#[derive(Debug, Clone)]
pub struct FetchedStars {
    /// CSV with remarks above the names.
    pub text: String,
    /// Stars.
    pub n: usize,
    /// Rows that were in several fields.
    pub n_repeated: usize,
    /// Stars without V, excluded.
    pub n_without_v: usize,
    /// Fields without stars.
    pub empty: Vec<String>,
}

/// The stars of all fields; the first field that cannot be had ends it.
///
/// # Errors
/// [`Error::Catalogue`] if no field holds a star; those of [`Client::fetch`].
pub fn fetch_stars(client: &Client, fields: &[Field], settings: &Fetch) -> Result<FetchedStars> {
    let mut merged = Merged::default();
    let mut empty = Vec::new();
    for field in fields {
        let query = apass_query(settings, field.ra_deg, field.dec_deg, field.radius_deg);
        let rows = match client.fetch(&query, &apass::check)? {
            // what was checked when it came was whole
            Answer::Data(body) => apass::rows(&body, true).map_err(|problem| Error::Temporary { problem })?,
            Answer::Nothing(_) => Rows::default(),
        };
        if rows.cells.is_empty() {
            empty.push(format!("{:.4} {:+.4} deg ({})", field.ra_deg, field.dec_deg, field.source));
        }
        merged.add(rows);
    }
    let count = |n: usize| format!("{n} field{}", if n == 1 { "" } else { "s" });
    if merged.cells.is_empty() {
        let problem = format!("APASS DR9 has no star in {}: {}", count(fields.len()), empty.join(", "));
        return Err(Error::Catalogue { path: "VizieR II/336/apass9".into(), problem });
    }
    let remarks: String = fields
        .iter()
        .map(|f| format!("# field {:.4} {:+.4} deg, radius {:.3} deg\n", f.ra_deg, f.dec_deg, f.radius_deg))
        .collect();
    let head = format!(
        "# APASS DR9 (Henden+ 2016, VizieR II/336/apass9), {} stars of {}, requested {}\n",
        merged.cells.len(),
        count(fields.len()),
        iso_utc(*client.now(), 0)
    );
    let n = merged.cells.len();
    Ok(FetchedStars {
        text: head + &remarks + &merged.csv()?,
        n,
        n_repeated: merged.n_repeated,
        n_without_v: merged.n_without_v,
        empty,
    })
}

/// Rows of several fields under the columns of the first.
#[derive(Default)]
struct Merged {
    columns: Vec<String>,
    cells: Vec<Vec<String>>,
    seen: HashSet<String>,
    n_repeated: usize,
    n_without_v: usize,
}

impl Merged {
    fn add(&mut self, rows: Rows) {
        if self.columns.is_empty() {
            self.columns.clone_from(&rows.columns);
        }
        let places: Vec<Option<usize>> =
            self.columns.iter().map(|name| rows.columns.iter().position(|c| c == name)).collect();
        let of = |name: &str| rows.columns.iter().position(|c| c == name);
        let (recno, v) = (of("recno"), of("Vmag"));
        let place = [of("RAJ2000"), of("DEJ2000"), v];
        for row in &rows.cells {
            let cell = |at: Option<usize>| at.and_then(|i| row.get(i)).map(String::as_str).unwrap_or_default();
            let key = match cell(recno) {
                "" => place.map(cell).join(" "),
                number => number.to_owned(),
            };
            if cell(v).is_empty() {
                self.n_without_v += 1;
            } else if self.seen.insert(key) {
                self.cells.push(places.iter().map(|at| cell(*at).to_owned()).collect());
            } else {
                self.n_repeated += 1;
            }
        }
    }

    fn csv(&self) -> Result<String> {
        let bad = |e: String| Error::Catalogue { path: "VizieR II/336/apass9".into(), problem: e };
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in std::iter::once(&self.columns).chain(&self.cells) {
            writer.write_record(row).map_err(|e| bad(e.to_string()))?;
        }
        let bytes = writer.into_inner().map_err(|e| bad(e.to_string()))?;
        String::from_utf8(bytes).map_err(|e| bad(e.to_string()))
    }
}
