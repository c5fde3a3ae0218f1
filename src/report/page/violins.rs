//! How the magnitudes of each pass, and of each target under each light, are spread: violins with median and number.
//!
//! Magnitudes upwards to brighter. Groups of fewer than three magnitudes are their points. Only used frames; lower limits
//! are none. Widths compare within a violin, not between violins.

use maud::{Markup, html};

use super::kinds::KINDS;
use super::kinds::class_of;
use super::kinds::kind_of;
use super::parts::NightPage;
use crate::base::stats::robust;
use crate::figures::axis::Span;
use crate::figures::chart::{Chart, Point, Ticks};
use crate::figures::density::density;
use crate::tables::PhotometryRow;
use crate::tables::row_passes::passes;
use crate::tables::selection::is_lower_limit;
use crate::tables::selection::is_used;

/// Violins in one chart; more are counted below it.
const MOST: usize = 24;
/// Half the width of a violin, in places.
const HALF: f64 = 0.36;
/// Half the width of a violin as a share of the chart, where there are few.
const WIDEST: f64 = 0.09;
/// Letters of a target's name below its violin.
const MOST_LETTERS: usize = 16;

/// Magnitudes that belong together.
struct Group {
    /// Below the axis.
    name: String,
    /// Read out.
    told: String,
    class: &'static str,
    v_mag: Vec<f64>,
}

fn used(row: &&PhotometryRow) -> bool {
    is_used(&row.status, &row.verdict) && row.v_mag.is_some() && !is_lower_limit(row.flags)
}

fn magnitudes<'a>(rows: impl Iterator<Item = &'a PhotometryRow>) -> Vec<f64> {
    rows.filter_map(|r| r.v_mag).filter(|v| v.is_finite()).collect()
}

/// One violin a pass.
pub(super) fn by_pass(page: &NightPage) -> Markup {
    let rows = &page.rows;
    let group = |(i, pass): (usize, &Vec<&PhotometryRow>)| {
        let kept: Vec<&PhotometryRow> = pass.iter().copied().filter(used).collect();
        let first = kept.first()?;
        let clock: String = first.date_mid.chars().skip(11).take(5).collect();
        let most = (0..=KINDS.len()).max_by_key(|k| kept.iter().filter(|r| kind_of(r) == *k).count())?;
        Some(Group {
            name: format!("{}\n{clock}", i + 1),
            told: format!("pass {} of {}", i + 1, first.object_name),
            class: class_of(most),
            v_mag: magnitudes(kept.into_iter()),
        })
    };
    let groups: Vec<Group> = passes(rows).iter().enumerate().filter_map(group).collect();
    chart(
        "Magnitudes of each pass",
        (&groups, page.band()),
        "Below: number of the pass and the UTC of its first used frame; colour: the light of most of its frames.",
    )
}

/// One violin for each target under each light.
pub(super) fn by_light(page: &NightPage) -> Markup {
    let rows = &page.rows;
    let kept: Vec<&PhotometryRow> = rows.iter().filter(used).collect();
    let mut keys: Vec<(&str, usize)> = kept.iter().map(|r| (r.object_name.as_str(), kind_of(r))).collect();
    keys.sort_unstable();
    keys.dedup();
    let group = |(object, kind): &(&str, usize)| {
        let light = KINDS.get(*kind).map_or("no model", |k| k.0);
        let short: String = object.chars().take(MOST_LETTERS).collect();
        Group {
            name: format!("{short}\n{light}"),
            told: format!("{object}, {light}"),
            class: class_of(*kind),
            v_mag: magnitudes(kept.iter().copied().filter(|r| r.object_name == *object && kind_of(r) == *kind)),
        }
    };
    let groups: Vec<Group> = keys.iter().map(group).collect();
    chart("Magnitudes of each target by light", (&groups, page.band()), "The light is the largest of the model.")
}

fn chart(title: &str, (groups, band): (&[Group], &str), about: &str) -> Markup {
    let shown = &groups[..groups.len().min(MOST)];
    let violins: Vec<Vec<(f64, f64)>> = shown.iter().map(|g| density(&g.v_mag)).collect();
    let ends = violins.iter().flatten().map(|place| place.0);
    let Some(y) = Span::around(shown.iter().flat_map(|g| g.v_mag.iter().copied()).chain(ends), 1.0) else {
        return html! {};
    };
    let half = HALF.min(WIDEST * shown.len() as f64);
    let chart = Chart {
        title: title.into(),
        width: 460.0,
        height: 280.0,
        x: Span { from: 0.0, to: shown.len() as f64 },
        y: y.reversed(),
        x_label: String::new(),
        y_label: format!("{band} [mag]"),
        ticks: Ticks::Names(shown.iter().map(|g| g.name.clone()).collect()),
    };
    let one = |(i, g): (usize, &Group)| {
        let at = i as f64 + 0.5;
        let n = g.v_mag.len();
        let median = robust(&g.v_mag).map(|m| m.0);
        let tip = format!(
            "{}: {n} magnitudes{}",
            g.told,
            median.map(|m| format!(", median {band} {m:.2}")).unwrap_or_default()
        );
        let points: Vec<Point> = g
            .v_mag
            .iter()
            .map(|v| Point { x: at, y: *v, class: g.class, tip: format!("{}: V {v:.2}", g.told), ..Point::default() })
            .collect();
        html! {
            @if n < 3 { (chart.points(&points)) } @else { (chart.violin(g.class, at, half, &violins[i], &tip)) }
            @if let Some(m) = median { (chart.dash(at, 0.5 * half, m, &tip)) }
        }
    };
    html! {
        figure {
            (chart.with(&html! {}, &html! { @for group in shown.iter().enumerate() { (one(group)) } }))
            figcaption {
                (title) ": " (groups.len()) " with used magnitudes"
                @if groups.len() > shown.len() { ", the first " (shown.len()) " drawn" }
                "; dash: median; fewer than three magnitudes are points. " (about)
            }
        }
    }
}
