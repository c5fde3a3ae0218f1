//! What stands above the rows of a table of lines: remarks of ECSV, VizieR and SExtractor, the description of a Starlink list.

use std::collections::HashMap;

use csv::StringRecord;

use super::Column;
use super::split::{Between, split};
use crate::base::error::Result;
use crate::tables::schema::Datatype;

/// The `#` lines above a table.
pub struct Remarks<'a>(pub &'a [String]);

impl Remarks<'_> {
    /// The names of `n` columns: SExtractor's numbered lines, else the last remark that splits into as many words.
    pub fn names(&self, n: usize, between: Between) -> Option<Vec<Column>> {
        self.sextractor(n).or_else(|| {
            let words = |line: &String| {
                let mut cells = StringRecord::new();
                let text = line.trim_start_matches(['#', ' ']);
                let text = if between == Between::Blanks { text } else { line.trim_start_matches('#') };
                split(text, between, &mut cells).ok()?;
                let names: Vec<Column> = cells.iter().map(Column::named).collect();
                (names.len() == n && names.iter().all(|c| c.name.parse::<f64>().is_err())).then_some(names)
            };
            self.0.iter().rev().find_map(words)
        })
    }

    /// `#   3 FLUX_APER   Flux vector [count]`, `#   5 X_IMAGE ...`: a column with several values gets FLUX_APER_1 and so on.
    fn sextractor(&self, n: usize) -> Option<Vec<Column>> {
        let mut columns: Vec<Column> = Vec::new();
        for line in self.0 {
            let mut words = line.trim_start_matches('#').split_whitespace();
            let (Some(Ok(at)), Some(name)) = (words.next().map(str::parse::<usize>), words.next()) else { continue };
            if at == 0 || at > n || at <= columns.len() {
                return None;
            }
            fill(&mut columns, at - 1);
            let unit = line.rsplit_once('[').and_then(|(_, u)| u.trim_end().strip_suffix(']')).unwrap_or_default();
            columns.push(Column { unit: unit.to_owned(), ..Column::named(name) });
        }
        if columns.is_empty() {
            return None;
        }
        fill(&mut columns, n);
        Some(columns)
    }

    /// `#Column Vmag (F6.3) Johnson V-band magnitude [ucd=phot.mag;em.opt.V]` with tabs between, as VizieR writes.
    pub fn describe(&self, columns: &mut [Column]) {
        // by name; of columns of one name the first
        let at: HashMap<String, usize> = columns.iter().enumerate().rev().map(|(i, c)| (c.name.clone(), i)).collect();
        for line in self.0.iter().filter_map(|l| l.strip_prefix("#Column")) {
            let mut parts = line.split('\t').map(str::trim).filter(|p| !p.is_empty());
            let Some(name) = parts.next().map(|n| n.trim_matches('"')) else { continue };
            let ucd = parts.find_map(|p| p.strip_prefix("[ucd=")?.strip_suffix(']'));
            if let (Some(ucd), Some(column)) = (ucd, at.get(name).and_then(|i| columns.get_mut(*i))) {
                column.ucd = ucd.to_owned();
            }
        }
    }
}

/// Further values of the last column, up to `n` columns.
fn fill(columns: &mut Vec<Column>, n: usize) {
    let Some(last) = columns.last().cloned() else { return };
    let first = columns.len();
    for k in first..n {
        columns.push(Column { name: format!("{}_{}", last.name, k + 1 - first), ..last.clone() });
    }
}

/// Columns with unit and descriptor from the `#` lines of an ECSV file, and what separates the cells.
pub fn ecsv(remarks: &[String]) -> (Vec<Column>, Between) {
    let mut columns: Vec<Column> = Vec::new();
    let mut between = Between::Blanks;
    let clean = |v: &str| v.trim().trim_matches(['\'', '"']).to_owned();
    for line in remarks {
        let bare = line.trim_start_matches(['#', ' ', '-', '{']).trim_end_matches([' ', '}']);
        if let Some(sign) = bare.strip_prefix("delimiter:") {
            let sign = sign.trim().trim_matches(['\'', '"']).replace("\\t", "\t").chars().next();
            between = sign.filter(|c| *c != ' ').map_or(Between::Blanks, Between::Sign);
        }
        if bare.starts_with("meta: !!omap") && !line.starts_with("#  ") {
            break; // the meta block of the table has names of its own
        }
        for part in bare.split(", ") {
            let part = part.trim().trim_start_matches("meta: !!omap").trim_matches(['{', '}', '[', ']', ' ']);
            if let Some(name) = part.strip_prefix("name:") {
                columns.push(Column::named(&clean(name)));
            } else if let (Some(unit), Some(column)) = (part.strip_prefix("unit:"), columns.last_mut()) {
                column.unit = clean(unit);
            } else if let (Some(datatype), Some(column)) = (part.strip_prefix("datatype:"), columns.last_mut()) {
                column.datatype = Datatype::of_ecsv(&clean(datatype));
            } else if let (Some(at), Some(column)) = (part.find("ucd:"), columns.last_mut()) {
                column.ucd = clean(part[at + 4..].trim_end_matches(['}', ']']));
            }
        }
    }
    time_scales(remarks, &mut columns);
    (columns, between)
}

/// The scales of the columns that astropy wrote as a Time: `time:`, and below it `__class__: astropy.time...`, `scale: tai`.
fn time_scales(remarks: &[String], columns: &mut [Column]) {
    let serialized = remarks.iter().skip_while(|line| !line.contains("__serialized_columns__:")).skip(1);
    let (mut name, mut is_time) = ("", false);
    for line in serialized.map(|line| line.trim_start_matches(['#', ' '])) {
        match line.split_once(':') {
            Some((key, rest)) if rest.trim().is_empty() => (name, is_time) = (key.trim_matches(['\'', '"']), false),
            Some(("__class__", class)) => is_time = class.trim() == "astropy.time.core.Time",
            Some(("scale", scale)) if is_time => {
                columns.iter_mut().filter(|c| c.name == name).for_each(|c| c.time_scale = scale.trim().to_owned());
            }
            _ => {}
        }
    }
}

/// The columns of a Starlink small text list: `C NAME CHAR*7 1 EXFMT=A7` gives name, type and place; `None` without any.
pub fn starlink(line: &mut dyn FnMut() -> Result<Option<(usize, String)>>) -> Result<Option<Vec<Column>>> {
    let mut columns: Vec<Column> = Vec::new();
    while let Some((_, text)) = line()? {
        if text.trim_end() == "BEGINTABLE" {
            break;
        }
        let words: Vec<&str> = text.split_whitespace().collect();
        if let ["C" | "c", name, _, place, ..] = words[..]
            && let Ok(place @ 1..=10_000) = place.parse::<usize>()
        {
            columns.resize(columns.len().max(place), Column::default());
            columns[place - 1] = Column::named(name);
        }
    }
    Ok((!columns.is_empty()).then_some(columns))
}
