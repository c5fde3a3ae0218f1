//! The strip on top: what a reader must know before anything else.
//!
//! Counts, zeropoint, Moon, and the worst thing that happened to the night.

use maud::{Markup, html};

use super::{NightPage, nothing};
use crate::report::rows::PhotometryRow;
use crate::report::summary::{is_used, robust};

/// The section.
pub(super) fn summary(page: &NightPage) -> Markup {
    let rows = &page.rows;
    if rows.is_empty() {
        return html! { (nothing("photometry.ecsv has no row: no frame of a target was found.")) (notes(page)) };
    }
    let with = |status: &str| rows.iter().filter(|r| r.status == status).count();
    let judged = |verdict: &str| rows.iter().filter(|r| r.status == "ok" && r.verdict == verdict).count();
    let used: Vec<&PhotometryRow> = rows.iter().filter(|r| is_used(&r.status, &r.verdict)).collect();
    let median = |of: fn(&PhotometryRow) -> Option<f64>, among: &[&PhotometryRow]| {
        robust(&among.iter().filter_map(|r| of(r)).collect::<Vec<_>>())
    };
    let timed: Vec<&PhotometryRow> = rows.iter().filter(|r| r.moon_phase_deg.is_some()).collect();
    let mut figures: Vec<(&str, String)> = vec![(
        "frames",
        format!(
            "{} measured ({} use, {} caution, {} reject), {} not detected, {} rejected, {} failed",
            with("ok"),
            judged("use"),
            judged("caution"),
            judged("reject"),
            with("nondetection"),
            with("rejected"),
            with("failed")
        ),
    )];
    if let Some((m, s)) = median(|r| r.v_mag, &used) {
        figures.push(("median V", format!("{m:.2}, scatter {s:.2} mag")));
    }
    if let Some((m, s)) = median(|r| r.residual_mag, &used) {
        figures.push(("observed − modelled", format!("{} ± {s:.2} mag", format!("{m:+.2}").replace('-', "−"))));
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
    if let (Some((illum, _)), Some((alt, _))) =
        (median(|r| r.moon_illum_pct, &timed), median(|r| r.moon_alt_deg, &timed))
    {
        let place = if alt > 0.0 { format!("{alt:.0}° up") } else { "below the horizon".into() };
        figures.push(("Moon", format!("{illum:.0} % lit, {place} (median over the frames)")));
    }
    if let Some((sun, _)) = median(|r| r.sun_alt_deg, &timed) {
        figures.push(("Sun", format!("altitude {sun:.0}° (median over the frames)").replace('-', "−")));
    }
    html! {
        dl.strip { @for (name, value) in figures { div { dt { (name) } dd { (value) } } } }
        (notes(page))
    }
}

/// What went wrong, the gravest first, and what should be known.
fn notes(page: &NightPage) -> Markup {
    let list = |key: &str| -> Vec<String> {
        let items = page.manifest.get(key).and_then(|v| v.as_array());
        items.map(|a| a.iter().filter_map(|v| v.as_str().map(str::to_owned)).collect()).unwrap_or_default()
    };
    let (poor, told, left_out) = (list("poor"), list("notes"), list("left_out"));
    html! {
        @if !poor.is_empty() {
            h3 { "Why this night is poor" }
            ul.poor { @for p in &poor { li { (p) } } }
        }
        @if !told.is_empty() || !page.notes.is_empty() {
            details open[told.len() <= 6] {
                summary { (told.len() + page.notes.len()) " notes" }
                ul { @for n in told.iter().chain(&page.notes) { li { (n) } } }
            }
        }
        @if !left_out.is_empty() {
            details { summary { "What is empty, and why" } ul { @for n in &left_out { li { (n) } } } }
        }
    }
}
