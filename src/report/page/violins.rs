//! How the magnitudes of each pass, and of each target under each light, are spread: violins with median and number.
//!
//! Magnitudes upwards to brighter. Groups of fewer than eight magnitudes are their points. Only used frames; lower limits
//! are none. Widths compare within a violin, not between violins.

use maud::{Markup, html};

use super::groups::Group as TargetGroup;
use super::kinds::KINDS;
use super::kinds::{kind_of, paint_of_kind};
use super::parts::shown;
use crate::base::stats::robust;
use crate::figures::axis::Span;
use crate::figures::canvas::{Medium, Paint, Sheet};
use crate::figures::chart::Chart;
use crate::figures::density::{LEAST_VALUES, density};
use crate::figures::panel::{Panel, Point, Ticks};
use crate::tables::PhotometryRow;
use crate::tables::selection::is_lower_limit;
use crate::tables::selection::is_used;

/// Violins in one chart; more are counted below it.
const MOST: usize = 24;
/// Half the width of a violin, in places.
const HALF: f64 = 0.36;
/// Half the width of a violin as a share of the chart, where there are few.
const WIDEST: f64 = 0.09;
/// Passes in one chart that have room for their time below their number.
const MOST_CLOCKS: usize = 10;

/// Magnitudes that belong together.
struct Group {
    /// Below the axis.
    name: String,
    /// Read out.
    label: String,
    paint: Paint<'static>,
    v_mag: Vec<f64>,
}

fn used(row: &&PhotometryRow) -> bool {
    is_used(&row.status, &row.verdict) && row.v_mag.is_some() && !is_lower_limit(row.flags)
}

fn magnitudes<'a>(rows: impl Iterator<Item = &'a PhotometryRow>) -> Vec<f64> {
    rows.filter_map(|r| r.v_mag).filter(|v| v.is_finite()).collect()
}

/// Violins side by side, and what is said about them.
pub(super) struct Violins {
    title: &'static str,
    about: &'static str,
    groups: Vec<Group>,
    band: String,
}

/// One violin a pass.
pub(super) fn by_pass(group: &TargetGroup) -> Violins {
    let passes = group.parts.iter().flat_map(|part| &part.passes);
    let one_night = group.parts.len() == 1;
    let few = group.parts.iter().map(|part| part.passes.len()).sum::<usize>() <= MOST_CLOCKS;
    let one = |(i, pass): &(usize, Vec<&PhotometryRow>)| {
        let kept: Vec<&PhotometryRow> = pass.iter().copied().filter(used).collect();
        let first = kept.first()?;
        let part = |from: usize| first.date_mid.chars().skip(from).take(5).collect::<String>();
        let (day, clock) = (part(5), part(11));
        let most = (0..=KINDS.len()).max_by_key(|k| kept.iter().filter(|r| kind_of(r) == *k).count())?;
        Some(Group {
            name: match (one_night, few) {
                (true, true) => format!("{}\n{clock}", i + 1),
                (true, false) => (i + 1).to_string(),
                (false, true) => format!("{day}\n{clock}"),
                (false, false) => format!("{}\n{}", day.get(3..).unwrap_or_default(), i + 1),
            },
            label: format!("pass {} of {}", i + 1, first.object_name),
            paint: paint_of_kind(most),
            v_mag: magnitudes(kept.into_iter()),
        })
    };
    Violins {
        title: "Magnitudes of each pass",
        about: match (one_night, few) {
            (true, true) => {
                "Below: number of the pass, UTC of its first used frame; colour: the light of most of its frames."
            }
            (true, false) => "Below: number of the pass; colour: the light of most of its frames.",
            (false, true) => "Below: date and UTC of the first used frame; colour: the light of most of the frames.",
            (false, false) => "Below: day of the month, number of the pass; colour: the light of most of its frames.",
        },
        groups: passes.filter_map(one).collect(),
        band: group.band.clone(),
    }
}

/// One violin for the target under each light.
pub(super) fn by_light(group: &TargetGroup) -> Violins {
    let kept: Vec<&PhotometryRow> = group.rows().filter(used).collect();
    let mut keys: Vec<(&str, usize)> = kept.iter().map(|r| (r.object_name.as_str(), kind_of(r))).collect();
    keys.sort_unstable();
    keys.dedup();
    let one = |(object, kind): &(&str, usize)| {
        let light = KINDS.get(*kind).map_or("no model", |k| k.0);
        Group {
            name: light.replacen(" or ", " or\n", 1),
            label: format!("{object}, {light}"),
            paint: paint_of_kind(*kind),
            v_mag: magnitudes(kept.iter().copied().filter(|r| r.object_name == *object && kind_of(r) == *kind)),
        }
    };
    Violins {
        title: "Magnitudes by light",
        about: "The light is the largest of the model.",
        groups: keys.iter().map(one).collect(),
        band: group.band.clone(),
    }
}

impl Violins {
    fn drawn(&self) -> &[Group] {
        &self.groups[..self.groups.len().min(MOST)]
    }

    /// `None` without a magnitude.
    pub(super) fn chart(&self, medium: Medium) -> Option<Sheet> {
        let groups = self.drawn();
        let violins: Vec<Vec<(f64, f64)>> = groups.iter().map(|g| density(&g.v_mag)).collect();
        let ends = violins.iter().flatten().map(|place| place.0);
        let y = Span::around(groups.iter().flat_map(|g| g.v_mag.iter().copied()).chain(ends), 1.0)?;
        let names: Vec<String> = groups.iter().map(|g| g.name.clone()).collect();
        let chart = Chart {
            size: (460, 280),
            x: Span { from: 0.0, to: groups.len() as f64 },
            y: y.reversed(),
            x_label: "",
            y_label: &format!("{} [mag]", self.band),
            ticks: Ticks::Names(&names),
        };
        Some(chart.draw(
            medium,
            |_| {},
            |panel| {
                for (i, group) in groups.iter().enumerate() {
                    self.one(panel, i as f64 + 0.5, group, &violins[i]);
                }
            },
        ))
    }

    fn one(&self, panel: &Panel, at: f64, group: &Group, violin: &[(f64, f64)]) {
        let half = HALF.min(WIDEST * self.drawn().len() as f64) * (panel.px(1.0) - panel.px(0.0));
        let n = group.v_mag.len();
        let median = robust(&group.v_mag).map(|m| m.0);
        let said = median.map(|m| format!(", median {} {m:.2}", self.band)).unwrap_or_default();
        let tip = format!("{}: {n} magnitudes{said}", group.label);
        if violin.is_empty() {
            let point = |v: &f64| Point {
                x: at,
                y: *v,
                paint: group.paint,
                tip: format!("{}: {} {v:.2}", group.label, self.band),
                ..Point::default()
            };
            panel.points(&group.v_mag.iter().map(point).collect::<Vec<_>>());
        } else {
            panel.violin(at, half, violin, group.paint, &tip);
        }
        if let Some(m) = median {
            panel.dash(at, 0.5 * half, m, &tip);
        }
    }

    /// The chart in the page.
    pub(super) fn figure(&self) -> Markup {
        let (all, drawn) = (self.groups.len(), self.drawn().len());
        html! {
            @if let Some(chart) = self.chart(Medium::Page) {
                figure {
                    (shown(chart, self.title))
                    figcaption {
                        (self.title) ": " (all) " with used magnitudes"
                        @if all > drawn { ", the first " (drawn) " drawn" }
                        "; dash: median; fewer than " (LEAST_VALUES) " magnitudes are points. " (self.about)
                    }
                }
            }
        }
    }
}
