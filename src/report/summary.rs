//! The text of the closing summary: aligned plain-text tables and the robust numbers in them.
//!
//! Magnitudes, degrees, UTC. Returns text; the program prints it.

use crate::base::constants::SIGMA_PER_MAD;
use crate::photometry::Flags;
use crate::tables::rows::{PhotometryRow, ResidualRow};
use crate::tables::words::{Status, Verdict};

/// Two exposures of one target further apart than this belong to different passes \[s\]. A low-orbit pass lasts a
/// quarter of an hour at most and the next one comes an hour and a half later.
pub const PASS_GAP_S: f64 = 1_200.0;

/// Median and robust scatter, `(med x, 1.4826 · med |x − med x|)`, of the finite values; `None` without any.
///
/// The scatter equals σ for a Gaussian and is 0 for a single value.
#[must_use]
pub fn robust(values: &[f64]) -> Option<(f64, f64)> {
    let mut kept: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let centre = median(&mut kept)?;
    let mut deviations: Vec<f64> = kept.iter().map(|v| (v - centre).abs()).collect();
    Some((centre, SIGMA_PER_MAD * median(&mut deviations)?))
}

/// Robust scatter of the finite values; `None` of fewer than two: one value does not tell how much values scatter.
#[must_use]
pub fn scatter(values: &[f64]) -> Option<f64> {
    let finite = values.iter().filter(|v| v.is_finite()).count();
    robust(values).map(|(_, sigma)| sigma).filter(|_| finite > 1)
}

/// The middle value, or the mean of the two middle ones.
fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    if values.len() % 2 == 1 {
        return Some(upper);
    }
    Some(0.5 * (values.get(values.len() / 2 - 1)? + upper))
}

/// The passes of a night: rows of one target without a gap longer than [`PASS_GAP_S`], in order of time.
///
/// Rows without a time and rejected ones, whose time or place is impossible, belong to no pass.
#[must_use]
pub fn passes(rows: &[PhotometryRow]) -> Vec<Vec<&PhotometryRow>> {
    let in_time = |r: &&PhotometryRow| r.mjd_mid_d.is_some_and(f64::is_finite) && r.status != Status::Rejected;
    let mut timed: Vec<&PhotometryRow> = rows.iter().filter(in_time).collect();
    timed.sort_by(|a, b| target(a).cmp(&target(b)).then(mjd(a).total_cmp(&mjd(b))));
    let mut passes: Vec<Vec<&PhotometryRow>> = Vec::new();
    for row in timed {
        match passes.last_mut() {
            Some(pass) if pass.last().is_some_and(|last| same_pass(last, row)) => pass.push(row),
            _ => passes.push(vec![row]),
        }
    }
    passes.sort_by(|a, b| a.first().map_or(0.0, |r| mjd(r)).total_cmp(&b.first().map_or(0.0, |r| mjd(r))));
    passes
}

fn target(row: &PhotometryRow) -> (Option<i64>, &str) {
    // The number names the target; the name counts only where there is no number.
    (row.norad_cat_id, if row.norad_cat_id.is_some() { "" } else { row.object_name.as_str() })
}

fn mjd(row: &PhotometryRow) -> f64 {
    row.mjd_mid_d.unwrap_or(f64::NAN)
}

fn same_pass(last: &PhotometryRow, row: &PhotometryRow) -> bool {
    target(last) == target(row) && (mjd(row) - mjd(last)) * 86_400.0 <= PASS_GAP_S
}

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

/// Whether a measurement counts in medians: status `ok` (or unsaid) and not rejected by its verdict.
#[must_use]
pub fn is_used(status: &str, verdict: &str) -> bool {
    let measured = status.is_empty() || *status == Status::Ok;
    measured && *verdict != Verdict::Reject
}

/// Whether a row only says "at least so bright": something may have stood in the beam.
#[must_use]
pub fn is_lower_limit(flags: i32) -> bool {
    Flags(flags).has(Flags::LOWER_LIMIT)
}

/// Whether a row's magnitude counts in medians: there is one, it is used, and it is no lower limit on the brightness.
#[must_use]
pub fn counts(row: &PhotometryRow) -> bool {
    row.v_mag.is_some_and(f64::is_finite) && is_used(&row.status, &row.verdict) && !is_lower_limit(row.flags)
}

/// Residuals that count in medians: a lower limit on the brightness is no measurement of it.
#[must_use]
pub fn used_residuals(rows: &[ResidualRow]) -> Vec<f64> {
    let counts = |r: &&ResidualRow| is_used("", &r.verdict) && !is_lower_limit(r.flags);
    rows.iter().filter(counts).filter_map(|r| r.residual_mag).collect()
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
