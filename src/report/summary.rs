//! The text of the closing summary: aligned plain-text tables and the robust numbers in them.
//!
//! Magnitudes, degrees, UTC. Returns text; the program prints it.

use crate::base::stats::robust;
use crate::base::stats::scatter;
use crate::photometry::Flags;
use crate::tables::PhotometryRow;
use crate::tables::row_passes::passes;
use crate::tables::selection::counts;

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
    let lines: Vec<Vec<String>> = passes(rows)
        .iter()
        .enumerate()
        .map(|(i, pass)| {
            let used: Vec<&&PhotometryRow> = pass.iter().filter(|r| counts(r)).collect();
            let v_mag: Vec<f64> = used.iter().filter_map(|r| r.v_mag).collect();
            let residuals: Vec<f64> = used.iter().filter_map(|r| r.residual_mag).collect();
            let first = pass.first();
            let error = |of: fn(&PhotometryRow) -> Option<f64>| {
                let values: Vec<f64> = used.iter().filter_map(|r| of(r)).collect();
                robust(&values).map(|(median, _)| format!("{median:.3}")).unwrap_or_default()
            };
            vec![
                (i + 1).to_string(),
                first.map(|r| r.date_mid.chars().take(19).collect()).unwrap_or_default(),
                first.map(|r| r.object_name.clone()).unwrap_or_default(),
                v_mag.len().to_string(),
                pass.len().to_string(),
                robust(&v_mag).map(|(m, _)| format!("{m:.2}")).unwrap_or_default(),
                v_mag.iter().copied().min_by(f64::total_cmp).map(|v| format!("{v:.2}")).unwrap_or_default(),
                lights(pass.iter().map(|r| r.illum.as_str())),
                robust(&residuals).map(|(m, _)| format!("{m:+.3}")).unwrap_or_default(),
                scatter(&residuals).map(|s| format!("{s:.3}")).unwrap_or_default(),
                error(|r| r.v_mag_err),
                error(|r| r.v_mag_err_sys),
            ]
        })
        .collect();
    text_table(&head, &lines) + &old_elements_note(rows).map(|note| format!("{note}\n")).unwrap_or_default()
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
        let pass = if of.len() == 1 { "pass" } else { "passes" };
        format!(
            "Elements older than 2 d{age} in {frames} frames of {pass} {}: the geometry, the model and the residuals carry \
             their error; the measured magnitudes do not.",
            of.join(", ")
        )
    })
}

/// One line per predicted pass: first and last moment, highest altitude, brightest and faintest V with the moment of the
/// brightest, the lights in order of appearance, and the largest numerical error.
#[must_use]
pub fn pass_lights(rows: &[PhotometryRow]) -> String {
    let head = ["pass", "from (UTC)", "to", "rows", "alt max", "brightest V", "at", "faintest V", "error", "light"];
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
