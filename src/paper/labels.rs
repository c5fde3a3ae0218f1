//! Brightness by light class: the paper's table of day, twilight and night, from any tables of magnitudes.
//!
//! mag. Observed magnitudes where a table has any, else modelled ones. The paper labels whole passes, so a frame counts
//! under the label of its pass; the count frame by frame stands next to it.

use std::collections::HashMap;
use std::path::Path;

use crate::base::error::{Error, Result};
use crate::base::time::{mjd_utc, parse_utc};
use crate::brightness::Illum;
use crate::brightness::light_class::is_sunlit;
use crate::brightness::light_class::{PaperLabel, SkyClass};
use crate::tables::LabelRow;
use crate::tables::row_passes::PASS_GAP_S;
use crate::tables::selection::is_used;

/// The paper's own table: label, observations, median, standard deviation.
const PAPER: [(PaperLabel, i64, f64, f64); 3] = [
    (PaperLabel::Night, 147, 12.02, 1.00),
    (PaperLabel::Twilight, 52, 6.41, 1.93),
    (PaperLabel::Day, 363, -1.10, 0.84),
];

/// One magnitude with its classes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Labelled {
    /// V \[mag\].
    pub v_mag: f64,
    /// The label of its frame.
    pub frame: PaperLabel,
    /// The label of its pass.
    pub pass: PaperLabel,
}

/// The magnitudes of one table.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledTable {
    /// In the order of time.
    pub rows: Vec<Labelled>,
    /// The column they are from.
    pub column: &'static str,
    /// Rows that have none, or are rejected.
    pub without: usize,
}

/// Reads the magnitudes and classes of a table (ECSV or CSV; columns by name, in any order).
///
/// Needed are `v_mag` or `model_v_mag`, `mjd_mid_d` or `date_mid`, and `paper_label`, or `sun_alt_deg` and `illum`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Table`] with line and column, and what is needed.
pub fn read_labelled(path: &Path) -> Result<LabelledTable> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
    let fail = |line: Option<usize>, problem: String| Error::Table { path: path.into(), line, problem };
    let blank =
        text.starts_with("# %ECSV") && !text.lines().any(|l| l.starts_with('#') && l.contains("delimiter: ','"));
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .delimiter(if blank { b' ' } else { b',' })
        .from_reader(text.as_bytes());
    let line_of = |p: Option<&csv::Position>| p.map(|p| p.line() as usize);
    let names: HashMap<String, usize> = reader
        .headers()
        .map_err(|e| fail(line_of(e.position()), e.to_string()))?
        .iter()
        .enumerate()
        .map(|(i, n)| (n.to_owned(), i))
        .collect();
    let records = reader.records().collect::<std::result::Result<Vec<_>, _>>();
    let records = records.map_err(|e| fail(line_of(e.position()), e.to_string()))?;
    let has = |name: &str| names.contains_key(name);
    let need = |what: &str| fail(None, format!("column {what} is needed; `run` and `predict pass` write it"));
    if !has("mjd_mid_d") && !has("date_mid") {
        return Err(need("mjd_mid_d or date_mid"));
    }
    if !(has("paper_label") || has("sun_alt_deg") && has("illum")) {
        return Err(need("paper_label, or sun_alt_deg and illum,"));
    }
    let cell = |r: &'_ csv::StringRecord, name: &str| -> String {
        names.get(name).and_then(|i| r.get(*i)).unwrap_or_default().to_owned()
    };
    let observed = has("v_mag") && records.iter().any(|r| !cell(r, "v_mag").is_empty());
    let column = match (observed, has("model_v_mag")) {
        (true, _) => "v_mag",
        (false, true) => "model_v_mag",
        (false, false) => return Err(need("v_mag or model_v_mag")),
    };
    let mut rows: Vec<(String, f64, Labelled)> = Vec::new();
    let mut without = 0;
    for record in &records {
        let at = line_of(record.position());
        let number = |name: &str| -> Result<Option<f64>> {
            let text = cell(record, name);
            match text.parse::<f64>() {
                Ok(v) if v.is_finite() => Ok(Some(v)),
                _ if text.is_empty() => Ok(None),
                _ => Err(fail(at, format!("column {name}: \"{text}\" is not a number"))),
            }
        };
        let used = is_used(&cell(record, "status"), &cell(record, "verdict"));
        let Some(v_mag) = number(column)?.filter(|_| used) else {
            without += 1;
            continue;
        };
        let mjd_d = match number("mjd_mid_d")? {
            Some(mjd_d) => mjd_d,
            None => mjd_utc(parse_utc("date_mid", &cell(record, "date_mid")).map_err(|e| fail(at, e.to_string()))?),
        };
        let label = cell(record, "paper_label");
        let frame = match PaperLabel::from_text(&label) {
            Some(label) => label,
            None if !label.is_empty() => {
                return Err(fail(at, format!("column paper_label: \"{label}\" is not one of day, twilight, night")));
            }
            None => {
                let sun_alt_deg =
                    number("sun_alt_deg")?.ok_or_else(|| fail(at, "no paper_label and no sun_alt_deg".into()))?;
                let sunlit = Illum::from_cell(&cell(record, "illum")).is_some_and(is_sunlit);
                PaperLabel::of(SkyClass::of_sun_alt(sun_alt_deg), sunlit)
            }
        };
        let target = cell(record, "norad_cat_id");
        rows.push((target, mjd_d, Labelled { v_mag, frame, pass: frame }));
    }
    rows.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    Ok(LabelledTable { rows: by_pass(rows), column, without })
}

/// Gives every row the label of its pass: rows of one target without a gap.
fn by_pass(mut rows: Vec<(String, f64, Labelled)>) -> Vec<Labelled> {
    let same =
        |a: &(String, f64, Labelled), b: &(String, f64, Labelled)| a.0 == b.0 && (b.1 - a.1) * 86_400.0 <= PASS_GAP_S;
    for pass in rows.chunk_by_mut(same) {
        if let Some(label) = PaperLabel::of_pass(pass.iter().map(|r| r.2.frame)) {
            pass.iter_mut().for_each(|r| r.2.pass = label);
        }
    }
    rows.into_iter().map(|r| r.2).collect()
}

/// The paper's table from these magnitudes, its own numbers next to them.
#[must_use]
pub fn summary(rows: &[Labelled]) -> Vec<LabelRow> {
    let line = |(label, published_n, published_median_v_mag, published_std_v_mag): (PaperLabel, i64, f64, f64)| {
        let pass: Vec<f64> = rows.iter().filter(|r| r.pass == label).map(|r| r.v_mag).collect();
        let frame: Vec<f64> = rows.iter().filter(|r| r.frame == label).map(|r| r.v_mag).collect();
        LabelRow {
            paper_label: label.to_string(),
            light: label.wording().1.to_owned(),
            n: pass.len() as i64,
            median_v_mag: median(&pass),
            std_v_mag: std_dev(&pass),
            n_by_frame: frame.len() as i64,
            median_by_frame_v_mag: median(&frame),
            published_n,
            published_median_v_mag,
            published_std_v_mag,
        }
    };
    PAPER.into_iter().map(line).collect()
}

/// The middle value, or the mean of the two middle ones.
#[must_use]
pub fn median(values: &[f64]) -> Option<f64> {
    crate::base::stats::robust(values).map(|(median, _)| median)
}

/// Standard deviation about the mean, of a sample; `None` for fewer than two.
fn std_dev(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt())
}
