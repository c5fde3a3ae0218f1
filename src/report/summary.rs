//! The text of the closing summary: aligned plain-text tables and the robust numbers in them.
//!
//! Magnitudes, degrees, UTC. Returns text; the program prints it.

use crate::base::stats::robust;
use crate::base::stats::scatter;
use crate::photometry::Flags;
use crate::tables::row_passes::passes;
use crate::tables::selection::counts;
use crate::tables::{PassStackRow, PhotometryRow};

/// A table of plain text: columns two spaces apart, numbers to the right, the rest to the left, a rule below the head.
///
/// A column is numeric when every cell of it that is not empty starts with a digit or a sign. Short rows are padded.
#[must_use]
pub fn text_table(head: &[&str], rows: &[Vec<String>]) -> String {
    let cell = |row: &Vec<String>, i: usize| row.get(i).cloned().unwrap_or_default();
    let numeric: Vec<bool> = (0..head.len())
        .map(|i| {
            let mut filled = rows.iter().map(|row| cell(row, i)).filter(|c| !c.is_empty()).peekable();
            filled.peek().is_some() && filled.all(|c| c.starts_with(|c: char| c.is_ascii_digit() || "+-−".contains(c)))
        })
        .collect();
    let widths: Vec<usize> = (0..head.len())
        .map(|i| {
            let cells = rows.iter().map(|row| cell(row, i).chars().count()).max().unwrap_or(0);
            cells.max(head.get(i).map_or(0, |h| h.chars().count()))
        })
        .collect();
    let line = |cells: Vec<String>| {
        let mut text = String::new();
        for ((cell, &width), &right) in cells.iter().zip(&widths).zip(&numeric) {
            let pad = " ".repeat(width - cell.chars().count());
            text.push_str(if text.is_empty() { "" } else { "  " });
            text.push_str(&if right { format!("{pad}{cell}") } else { format!("{cell}{pad}") });
        }
        format!("{}\n", text.trim_end())
    };
    let mut text = line(head.iter().map(|h| (*h).to_owned()).collect());
    text.push_str(&line(widths.iter().map(|&w| "-".repeat(w)).collect()));
    for row in rows {
        text.push_str(&line((0..head.len()).map(|i| cell(row, i)).collect()));
    }
    text
}

/// A measured pass in numbers; see [`pass_table`].
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct PassSummary {
    /// Number in the night, from 1.
    pub pass: usize,
    /// UTC of the first frame.
    pub date_first: String,
    /// Name of the target.
    pub object_name: String,
    /// Magnitudes used.
    pub used: usize,
    /// Frames.
    pub frames: usize,
    /// Median of the used magnitudes \[mag\].
    pub median_mag: Option<f64>,
    /// Brightest of the used magnitudes \[mag\].
    pub brightest_mag: Option<f64>,
    /// Largest light of the frames.
    pub light: String,
    /// Median of the used residuals, observed minus modelled \[mag\].
    pub residual_mag: Option<f64>,
    /// Robust σ of the used residuals \[mag\].
    pub sigma_mag: Option<f64>,
    /// Median random error of the used magnitudes \[mag\].
    pub median_err_mag: Option<f64>,
    /// Median systematic error of the used magnitudes \[mag\].
    pub median_err_sys_mag: Option<f64>,
}

/// The passes of a night in numbers.
#[must_use]
pub fn pass_summaries(rows: &[PhotometryRow]) -> Vec<PassSummary> {
    let median = |values: &[f64]| robust(values).map(|(median, _)| median);
    let summary = |(pass, frames): (usize, &Vec<&PhotometryRow>)| {
        let used: Vec<&&PhotometryRow> = frames.iter().filter(|r| counts(r)).collect();
        let values = |of: fn(&PhotometryRow) -> Option<f64>| used.iter().filter_map(|r| of(r)).collect::<Vec<f64>>();
        let (v_mag, residuals) = (values(|r| r.v_mag), values(|r| r.residual_mag));
        PassSummary {
            pass,
            date_first: frames.first().map(|r| r.date_mid.clone()).unwrap_or_default(),
            object_name: frames.first().map(|r| r.object_name.clone()).unwrap_or_default(),
            used: v_mag.len(),
            frames: frames.len(),
            median_mag: median(&v_mag),
            brightest_mag: v_mag.iter().copied().min_by(f64::total_cmp),
            light: lights(frames.iter().map(|r| r.illum.as_str())),
            residual_mag: median(&residuals),
            sigma_mag: scatter(&residuals),
            median_err_mag: median(&values(|r| r.v_mag_err)),
            median_err_sys_mag: median(&values(|r| r.v_mag_err_sys)),
        }
    };
    (1..).zip(&passes(rows)).map(summary).collect()
}

/// One line per pass: UTC of the first frame, target, how many magnitudes are used of how many frames, their median and
/// brightest one in `band`, the largest light of the frames, median and robust σ of the used residuals (observed − modelled), and the
/// median random and systematic errors of the used magnitudes.
///
/// Used are those of [`counts`]. A number that the pass does not give is an empty cell: a median without a magnitude, a σ
/// of one residual.
#[must_use]
pub fn pass_table(rows: &[PhotometryRow], band: &str) -> String {
    let named = ["median ?", "brightest ?", "? err", "? err sys"].map(|name| name.replace('?', band));
    let head = [
        "pass", "UTC", "target", "used", "frames", &named[0], &named[1], "light", "residual", "sigma", &named[2],
        &named[3],
    ];
    let number = |value: Option<f64>, decimals: usize| value.map_or(String::new(), |v| format!("{v:.decimals$}"));
    let line = |p: PassSummary| {
        vec![
            p.pass.to_string(),
            p.date_first.chars().take(19).collect(),
            p.object_name,
            p.used.to_string(),
            p.frames.to_string(),
            number(p.median_mag, 2),
            number(p.brightest_mag, 2),
            p.light,
            p.residual_mag.map_or(String::new(), |m| format!("{m:+.3}")),
            number(p.sigma_mag, 3),
            number(p.median_err_mag, 3),
            number(p.median_err_sys_mag, 3),
        ]
    };
    let lines: Vec<Vec<String>> = pass_summaries(rows).into_iter().map(line).collect();
    let table = if lines.is_empty() { String::new() } else { text_table(&head, &lines) };
    table + &old_elements_note(rows).map(|note| format!("{note}\n")).unwrap_or_default()
}

/// One line per pass of `pass_stack.ecsv`: frames in the mean, where the place is from, magnitude and error in `band`,
/// signal-to-noise, limit, and bins of the light curve; nothing without passes. The mean of a resolved target is that of its
/// single frames, which the table of passes shows already.
#[must_use]
pub fn stack_table(rows: &[PassStackRow], band: &str) -> String {
    let named = ["mean ?", "? err", "limit ?"].map(|name| name.replace('?', band));
    let head = ["pass", "UTC", "stacked", "place", &named[0], &named[1], "S/N", &named[2], "bins"];
    let number = |value: Option<f64>, decimals: usize| value.map_or(String::new(), |v| format!("{v:.decimals$}"));
    let bins = |pass: Option<i64>| rows.iter().filter(|r| r.pass == pass && r.bin > 0).count().max(1);
    let line = |r: &PassStackRow| {
        vec![
            r.pass.map_or(String::new(), |p| p.to_string()),
            r.date_first.chars().take(19).collect(),
            r.frames.to_string(),
            r.place_from.clone(),
            number(r.v_mag, 2),
            number(r.v_mag_err, 3),
            number(r.snr, 1),
            number(r.limit_v_mag, 2),
            bins(r.pass).to_string(),
        ]
    };
    let lines: Vec<Vec<String>> = rows.iter().filter(|r| r.bin == 0 && r.place_from != "frames").map(line).collect();
    if lines.is_empty() { String::new() } else { format!("\n{}", text_table(&head, &lines)) }
}

/// What old elements spoil, and in which passes; `None` where all are recent.
#[must_use]
pub fn old_elements_note(rows: &[PhotometryRow]) -> Option<String> {
    let old = |r: &&PhotometryRow| Flags(r.flags).has(Flags::OLD_ELEMENTS);
    let of: Vec<String> = passes(rows)
        .iter()
        .zip(1..)
        .filter(|(pass, _)| pass.iter().any(&old))
        .map(|(_, number): (_, usize)| number.to_string())
        .collect();
    let oldest = rows.iter().filter(old).filter_map(|r| r.tle_age_d).map(f64::abs).max_by(f64::total_cmp);
    let frames = rows.iter().filter(old).count();
    (frames > 0).then(|| {
        let age = oldest.map(|d| format!(" (up to {d:.1} d)")).unwrap_or_default();
        let passes = match of.as_slice() {
            [] => String::new(),
            [one] => format!(" of pass {one}"),
            several => format!(" of passes {}", several.join(", ")),
        };
        format!(
            "Elements older than 2 d{age} in {frames} frames{passes}: the geometry, the model and the residuals carry their \
             error; the measured magnitudes do not.",
        )
    })
}

/// One line per predicted pass: first and last moment, highest altitude, brightest and faintest V with the moment of the
/// brightest, the lights in order of appearance, and the largest numerical error.
#[must_use]
pub fn pass_lights(rows: &[PhotometryRow]) -> String {
    let head = [
        "pass",
        "from (UTC)",
        "to",
        "rows",
        "alt max",
        "brightest V",
        "at",
        "faintest V",
        "error",
        "68 % within",
        "light",
    ];
    let clock = |r: &PhotometryRow| r.date_mid.chars().skip(11).take(8).collect::<String>();
    let lines: Vec<Vec<String>> = passes(rows)
        .iter()
        .enumerate()
        .map(|(i, pass)| {
            let mut by_v: Vec<&&PhotometryRow> = pass.iter().filter(|r| r.model_v_mag.is_some()).collect();
            by_v.sort_by(|a, b| a.model_v_mag.unwrap_or(0.0).total_cmp(&b.model_v_mag.unwrap_or(0.0)));
            let v = |r: Option<&&&PhotometryRow>| r.and_then(|r| r.model_v_mag).map(|v| format!("{v:.2}"));
            let top = pass.iter().filter_map(|r| r.alt_deg).max_by(f64::total_cmp);
            let err = pass.iter().filter_map(|r| r.model_err_mag).max_by(f64::total_cmp);
            let pred_err = pass.iter().filter_map(|r| r.v_pred_err_mag).max_by(f64::total_cmp);
            vec![
                (i + 1).to_string(),
                pass.first().map(|r| r.date_mid.chars().take(19).collect()).unwrap_or_default(),
                pass.last().map(|r| clock(r)).unwrap_or_default(),
                pass.len().to_string(),
                top.map(|a| format!("{a:.1}")).unwrap_or_default(),
                v(by_v.first()).unwrap_or_default(),
                by_v.first().map(|r| clock(r)).unwrap_or_default(),
                v(by_v.last()).unwrap_or_default(),
                err.map(|e| format!("{e:.1e}")).unwrap_or_default(),
                pred_err.map(|e| format!("{e:.2} mag")).unwrap_or_default(),
                lights(pass.iter().map(|r| r.illum.as_str())),
            ]
        })
        .collect();
    text_table(&head, &lines)
}

/// The light classes in order of appearance, each once.
fn lights<'a>(classes: impl Iterator<Item = &'a str>) -> String {
    let mut seen: Vec<&str> = Vec::new();
    for class in classes {
        if !class.is_empty() && !seen.contains(&class) {
            seen.push(class);
        }
    }
    seen.join(", ")
}
