//! How bright it was: violins and a histogram of each light, for every satellite in every band.
//!
//! Magnitudes of used frames. The table of passes is in [`super::passes`].

use super::kinds::{kind_of, named};
use maud::{Markup, html};

use super::groups::{Group, groups};
use super::parts::nothing;
use super::parts::{NightPage, key_mark, shown};
use super::violins;
use crate::figures::axis::Span;
use crate::figures::canvas::{Mark, Medium, Sheet};
use crate::figures::chart::Chart;
use crate::figures::panel::Ticks;
use crate::tables::PhotometryRow;
use crate::tables::selection::is_used;

/// Width of a bin \[mag\].
const BIN_MAG: f64 = 0.25;

/// The section.
pub(super) fn distribution(nights: &[NightPage]) -> Markup {
    let groups = groups(nights);
    if groups.is_empty() {
        return nothing("No magnitude is used.");
    }
    html! {
        @for group in &groups {
            @if !group.name.is_empty() { h3 { (group.name) } }
            div.panels { (violins::by_pass(group).figure()) (violins::by_light(group).figure()) (histogram(group)) }
        }
    }
}

/// How many used magnitudes of each light lie in each bin.
struct Bins {
    width_mag: f64,
    /// Number of the first bin.
    first: i64,
    counts: Vec<[usize; 4]>,
}

/// `None` without a used magnitude.
fn bins(group: &Group) -> Option<Bins> {
    let used: Vec<(&PhotometryRow, f64)> =
        group.rows().filter(|r| is_used(&r.status, &r.verdict)).filter_map(|r| Some((r, r.v_mag?))).collect();
    let span = Span::around(used.iter().map(|u| u.1), 1.0)?;
    // a night of 30 mag is not a night; bins stay few
    let width_mag = BIN_MAG.max((span.high() - span.low()) / 80.0);
    let first = (span.low() / width_mag).floor() as i64;
    let n = ((span.high() / width_mag).ceil() as i64 - first).max(1);
    let mut counts = vec![[0usize; 4]; n as usize];
    for (row, v_mag) in used {
        let at = ((v_mag / width_mag).floor() as i64 - first).clamp(0, n - 1) as usize;
        counts[at][kind_of(row)] += 1;
    }
    Some(Bins { width_mag, first, counts })
}

/// The histogram by the largest light; `None` without a used magnitude.
pub(super) fn histogram_chart(group: &Group, medium: Medium) -> Option<Sheet> {
    let (bins, band) = (bins(group)?, &group.band);
    let edge = |i: usize| (bins.first + i as i64) as f64 * bins.width_mag;
    let most = bins.counts.iter().map(|c| c.iter().sum::<usize>()).max().unwrap_or(1) as f64;
    let chart = Chart {
        size: if medium == Medium::Page { (460, 280) } else { (940, 260) },
        x: Span { from: edge(0), to: edge(bins.counts.len()) },
        y: Span { from: 0.0, to: 1.08 * most },
        x_label: &format!("{band} [mag]"),
        y_label: "frames",
        ticks: Ticks::Numbers,
    };
    Some(chart.draw(
        medium,
        |_| {},
        |panel| {
            for (i, counted) in bins.counts.iter().enumerate() {
                // the highest first: what is below covers it
                for (k, (name, paint)) in named().into_iter().enumerate().rev().filter(|(k, _)| counted[*k] > 0) {
                    let below: usize = counted[..=k].iter().sum();
                    let tip = format!("{band} {:.2} to {:.2}: {} {name}", edge(i), edge(i + 1), counted[k]);
                    panel.column((edge(i), edge(i + 1)), below as f64, paint, &tip);
                }
            }
        },
    ))
}

fn histogram(group: &Group) -> Markup {
    let (Some(bins), Some(chart)) = (bins(group), histogram_chart(group, Medium::Page)) else {
        return nothing("No magnitude is used.");
    };
    let of = |k: usize| bins.counts.iter().map(|c| c[k]).sum::<usize>();
    let all: usize = (0..4).map(of).sum();
    html! {
        figure {
            (shown(chart, "Distribution of the used magnitudes"))
            ul.key {
                @for (_, (name, paint)) in named().into_iter().enumerate().filter(|(k, _)| of(*k) > 0) {
                    li { (key_mark(Mark::Square, paint)) " " (name) }
                }
            }
            figcaption { (all) " used magnitudes in bins of " (format!("{:.2}", bins.width_mag)) " mag, by the largest light of the model." }
        }
    }
}
