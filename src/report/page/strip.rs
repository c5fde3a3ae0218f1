//! The summary on top: the verdict, the passes, what went wrong; then counts, zeropoint, Moon and Sun, and notes.
//!
//! Magnitudes in the band of the table, degrees. It does not cover single frames.

use maud::{Markup, html};

use super::parts::NightPage;
use super::parts::nothing;
use super::passes;
use crate::base::stats::robust;
use crate::base::stats::scatter;
use crate::brightness::catalogue::Standing;
use crate::tables::PhotometryRow;
use crate::tables::selection::counts;
use crate::tables::selection::is_lower_limit;
use crate::tables::selection::is_used;
use crate::tables::words::{Status, Verdict, flagged_frames};

/// A value of more bytes than this has a line of its own.
const LONG: usize = 160;

/// The section.
pub(super) fn summary(page: &NightPage) -> Markup {
    let rows = &page.rows;
    if rows.is_empty() {
        return html! { (nothing("photometry.ecsv has no row: no frame of a target was found.")) (warnings(page)) (notes(page)) };
    }
    let with = |status: Status| rows.iter().filter(|r| r.status == status).count();
    let judged = |verdict: Verdict| rows.iter().filter(|r| r.status == Status::Ok && r.verdict == verdict).count();
    let used: Vec<&PhotometryRow> = rows.iter().filter(|r| counts(r)).collect();
    let median = |of: fn(&PhotometryRow) -> Option<f64>, among: &[&PhotometryRow]| {
        robust(&among.iter().filter_map(|r| of(r)).collect::<Vec<_>>())
    };
    let timed: Vec<&PhotometryRow> = rows.iter().filter(|r| r.moon_phase_deg.is_some()).collect();
    let mut figures: Vec<(&str, String)> = Vec::new();
    figures.push(("night", page.name.clone()));
    figures.extend(page.site().map(|site| ("site", site)));
    figures.extend(page.data_mode().map(|mode| ("data", mode)));
    figures.push((
        "frames",
        format!(
            "{} measured (verdict: {} use, {} caution, {} reject), {} not detected, {} rejected before measurement, {} failed",
            with(Status::Ok),
            judged(Verdict::Use),
            judged(Verdict::Caution),
            judged(Verdict::Reject),
            with(Status::Nondetection),
            with(Status::Rejected),
            with(Status::Failed)
        ),
    ));
    let values = |of: fn(&PhotometryRow) -> Option<f64>| used.iter().filter_map(|r| of(r)).collect::<Vec<_>>();
    let scattered = |of| scatter(&values(of)).map_or(" mag".to_owned(), |s| format!(", scatter {s:.2} mag"));
    if let Some((m, _)) = robust(&values(|r| r.v_mag)) {
        let (name, of) =
            if page.band() == "V" { ("median V", String::new()) } else { ("median", format!("{} ", page.band())) };
        figures.push((name, format!("{of}{m:.2}{}", scattered(|r| r.v_mag))));
    }
    if let Some((m, _)) = robust(&values(|r| r.residual_mag)) {
        let median = format!("{m:+.2}").replace('-', "−");
        figures.push(("observed − modelled", format!("median {median}{}", scattered(|r| r.residual_mag))));
    }
    if let Some(model) = Standing::line_of(&page.meta) {
        figures.push(("model", model));
    }
    if let Some(z) = &page.zeropoint {
        let [zp, k, c] = z.errs();
        figures.push((
            "zeropoint",
            format!(
                "ZP {:.3} ± {zp:.3}, k {:.3} ± {k:.3}, C {:.3} ± {c:.3} mag, {} stars, rms {:.3}",
                z.zp_mag, z.k_mag_airmass, z.c_mag_mag, z.n_used, z.rms_mag
            )
            .replace('-', "−"),
        ));
    }
    if let (Some(illum), Some((alt, _))) = (moon_lit_pct(rows), median(|r| r.moon_alt_deg, &timed)) {
        let place = if alt > 0.0 { format!("{alt:.0}° up") } else { "below the horizon".into() };
        figures.push(("Moon", format!("{illum:.0} % lit, {place} (median over the frames)")));
    }
    if let Some((sun, _)) = median(|r| r.sun_alt_deg, &timed) {
        figures.push(("Sun", format!("altitude {sun:.0}° (median over the frames)").replace('-', "−")));
    }
    html! {
        (passes::verdict(page))
        (passes::pass_tables(std::slice::from_ref(page)))
        (warnings(page))
        dl.strip { @for (name, value) in figures { div.wide[value.len() > LONG] { dt { (name) } dd { (value) } } } }
        (notes(page))
    }
}

/// How much of the Moon is lit \[%\]: the median over every frame of the night with a time, measured or not.
pub(super) fn moon_lit_pct(rows: &[PhotometryRow]) -> Option<f64> {
    robust(&rows.iter().filter_map(|r| r.moon_illum_pct).collect::<Vec<_>>()).map(|m| m.0)
}

/// What is wrong with frames of the night, the gravest first: those that failed, those excluded, then what made
/// verdicts `caution` or `reject`, by how many frames it touched.
fn frame_warnings(page: &NightPage) -> Vec<String> {
    let mut lines = Vec::new();
    for (status, what) in [(Status::Failed, "could not be reduced"), (Status::Rejected, "rejected before measurement")]
    {
        let of: Vec<&PhotometryRow> = page.rows.iter().filter(|r| r.status == status).collect();
        if let Some(first) = of.first() {
            lines.push(format!("{} of {} frames {what}; {}: {}", of.len(), page.rows.len(), first.frame, first.reason));
        }
    }
    let counted = page.manifest.get("counts").and_then(|c| c.get("doubts")).and_then(|d| d.as_object());
    let mut reasons: Vec<(&String, u64)> =
        counted.into_iter().flatten().filter_map(|(name, n)| Some((name, n.as_u64()?))).collect();
    reasons.sort_by_key(|(name, n)| (std::cmp::Reverse(*n), *name));
    let frames = |(name, n): (&String, u64)| format!("{} (verdict caution or reject)", flagged_frames(name, n));
    lines.extend(reasons.into_iter().map(frames));
    let limits = page.rows.iter().filter(|r| is_used(&r.status, &r.verdict) && is_lower_limit(r.flags)).count();
    if limits > 0 {
        lines.push(format!("{limits} used frames say only \"at least so bright\" (lower limits)"));
    }
    lines
}

/// A list of texts in the manifest.
fn list(page: &NightPage, key: &str) -> Vec<String> {
    let items = page.manifest.get(key).and_then(|v| v.as_array());
    items.map(|a| a.iter().filter_map(|v| v.as_str().map(str::to_owned)).collect()).unwrap_or_default()
}

/// What went wrong, the gravest first.
fn warnings(page: &NightPage) -> Markup {
    let (poor, frame_warnings) = (list(page, "poor"), frame_warnings(page));
    html! {
        @if !poor.is_empty() {
            h3 { "Why this night is poor" }
            ul.poor { @for p in &poor { li { (p) } } }
        }
        @if !frame_warnings.is_empty() {
            h3 { "Warnings, the gravest first" }
            ul.poor.frame_warnings { @for d in &frame_warnings { li { (d) } } }
        }
    }
}

/// What should be known besides.
fn notes(page: &NightPage) -> Markup {
    let empty_columns = list(page, "left_out");
    // notes about what is missing before those that only tell how it was done
    let lines: Vec<String> = page.notes.iter().cloned().chain(list(page, "notes")).collect();
    html! {
        @if !lines.is_empty() {
            details open[lines.len() <= 6] {
                summary { (lines.len()) " notes" }
                ul { @for n in &lines { li { (n) } } }
            }
        }
        @if !empty_columns.is_empty() {
            details { summary { "What is empty, and why" } ul { @for n in &empty_columns { li { (n) } } } }
        }
    }
}
