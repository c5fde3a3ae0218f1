//! The passes as one measurement each, and their light curves in bins.
//!
//! Magnitudes in the band of the table, brighter upwards; minutes since the first frame. It does not cover single frames.

use maud::{Markup, html};

use super::parts::{NightPage, cell, nothing, number, over_line, table};
use crate::figures::axis::Span;
use crate::figures::canvas::BLUE;
use crate::figures::chart::Chart;
use crate::figures::panel::{Point, Ticks};
use crate::tables::PassStackRow;

/// Light curves that are drawn.
const MOST_CURVES: usize = 24;

/// The section.
pub(super) fn stacks(page: &NightPage) -> Markup {
    let passes: Vec<&PassStackRow> = page.stacks.iter().filter(|r| r.bin == 0).collect();
    if passes.is_empty() {
        return nothing("No pass was stacked (pass_stack.ecsv; target.stack_passes).");
    }
    let band = page.band();
    let named = ["mean ?", "error", "limit ?"].map(|name| name.replace('?', band));
    let head =
        ["pass", "first frame (UTC)", "frames", "place from", &named[0], &named[1], "S/N", &named[2], "χ²/dof", "bins"];
    let bins = |r: &PassStackRow| page.stacks.iter().filter(|b| b.pass == r.pass && b.bin > 0).collect::<Vec<_>>();
    let line = |r: &&PassStackRow| {
        vec![
            cell(r.pass.unwrap_or(0)),
            cell(r.date_first.chars().take(19).collect::<String>().replace('T', " ")),
            cell(r.frames),
            cell(&r.place_from),
            number(r.v_mag, 3),
            number(r.v_mag_err, 3),
            number(r.snr, 1),
            number(r.limit_v_mag, 2),
            number(r.chi2_dof, 2),
            cell(bins(r).len().max(1)),
        ]
    };
    let lines: Vec<Vec<Markup>> = passes.iter().map(line).collect();
    let curves: Vec<Markup> = passes.iter().filter_map(|r| curve(r, &bins(r), band)).take(MOST_CURVES).collect();
    html! {
        (table("sortable", &format!("Passes as one measurement each: all frames at the place of the target; {band} in mag"), &head, &lines))
        p.note { "A pass whose target no single frame shows is detected in the sum of its frames, or has the limit of that sum. "
            "The bins of a light curve have equal signal-to-noise (target.pass_bin_snr)." }
        @if !curves.is_empty() { div.panels { @for curve in &curves { (curve) } } }
    }
}

/// The bins of one pass; `None` of fewer than two magnitudes.
fn curve(pass: &PassStackRow, bins: &[&PassStackRow], band: &str) -> Option<Markup> {
    let first = bins.iter().filter_map(|b| b.mjd_mid_d).min_by(f64::total_cmp)?;
    let minutes = |b: &PassStackRow| Some((b.mjd_mid_d? - first) * 1440.0);
    let points: Vec<Point> = bins
        .iter()
        .filter_map(|b| {
            let (x, v, err) = (minutes(b)?, b.v_mag?, b.v_mag_err?);
            let tip = format!("{} frames, {band} {v:.3} ± {err:.3}, S/N {:.1}", b.frames, b.snr.unwrap_or(0.0));
            Some(Point { x, y: v, err: Some(err), paint: BLUE.into(), tip, ..Point::default() })
        })
        .collect();
    if points.len() < 2 {
        return None;
    }
    let x = Span::around(points.iter().map(|p| p.x), 0.1)?;
    let y = Span::around(points.iter().map(|p| p.y), 0.2)?;
    // brighter upwards
    let y = y.reversed();
    let label = format!("{band} [mag]");
    let chart = Chart { size: (460, 250), x, y, x_label: "minutes", y_label: &label, ticks: Ticks::Numbers };
    let title = format!("Pass {} in {} bins", pass.pass.unwrap_or(0), bins.len());
    Some(html! { figure { (over_line(&chart, &[], &points, &title)) figcaption { (title) } } })
}
