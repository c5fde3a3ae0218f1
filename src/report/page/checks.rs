//! Whether the clock and the detector can be trusted: cadence against exposure, sources of time, flats, gain.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::parts::NightPage;
use super::parts::cell;
use super::parts::nothing;
use super::parts::number;
use super::parts::table;
use super::parts::{over_line, tip, verdict_paint};
use crate::base::stats::robust;
use crate::figures::axis::Span;
use crate::figures::chart::Chart;
use crate::figures::panel::{Point, Ticks};
use crate::photometry::Flags;
use crate::tables::PhotometryRow;

/// The section of the clock.
pub(super) fn timing(page: &NightPage) -> Markup {
    let timed: Vec<&PhotometryRow> = page.rows.iter().filter(|r| r.mjd_mid_d.is_some()).collect();
    if timed.is_empty() {
        return nothing("No frame has a time.");
    }
    let mut sources: BTreeMap<&str, (usize, f64)> = BTreeMap::new();
    for row in &timed {
        let entry = sources.entry(&row.time_source).or_default();
        *entry = (entry.0 + 1, entry.1.max(row.time_err_s.unwrap_or(0.0)));
    }
    let worst = timed.iter().filter_map(|r| r.alt_az_err_deg).max_by(f64::total_cmp);
    let doubted = timed.iter().filter(|r| Flags(r.flags).has(Flags::EXPTIME_DOUBTED)).count();
    let rows: Vec<Vec<Markup>> =
        sources.iter().map(|(source, (n, err_s))| vec![cell(source), cell(n), number(Some(*err_s), 3)]).collect();
    html! {
        (table("", "Where the mid-exposure times are from", &["keywords", "frames", "error at most [s]"], &rows))
        @if let Some(worst) = worst { p { "By it the place along the track is uncertain by up to " (format!("{worst:.3}")) "°." } }
        @if doubted > 0 { p.poor { (doubted) " frames whose cadence contradicts their exposure time." } }
        div.panels { (cadence(page, &timed)) (stated_middles(page, &timed)) }
    }
}

fn cadence(page: &NightPage, timed: &[&PhotometryRow]) -> Markup {
    let pairs: Vec<(&PhotometryRow, f64, f64)> = timed
        .iter()
        .filter_map(|r| Some((*r, r.exptime_s?, r.cadence_s.filter(|c| *c > 0.0 && *c < 120.0)?)))
        .collect();
    let (Some(x), Some(y)) =
        (Span::around(pairs.iter().map(|p| p.1), 0.2), Span::around(pairs.iter().flat_map(|p| [p.1, p.2]), 1.0))
    else {
        return nothing("No two frames of one target lie within two minutes: no cadence to look at.");
    };
    let title = "Cadence against exposure time";
    let chart =
        Chart { size: (460, 250), x, y, x_label: "exposure time [s]", y_label: "cadence [s]", ticks: Ticks::Numbers };
    let points: Vec<Point> = pairs
        .iter()
        .map(|(row, exptime, cadence)| Point {
            x: *exptime,
            y: *cadence,
            paint: verdict_paint(row),
            href: page.link(row),
            tip: format!("cadence {cadence:.2} s, exposure {exptime:.3} s, {}", tip(row)),
            ..Point::default()
        })
        .collect();
    let equal = [(x.low(), Some(x.low())), (x.high(), Some(x.high()))];
    html! {
        figure {
            (over_line(&chart, &equal, &points, title))
            figcaption { "A frame below the line would have begun before the one before it ended." }
        }
    }
}

/// What headers call the middle of their exposures, against start + EXPTIME/2: a driver's delay is an offset, a clock
/// that is set during the night a step.
fn stated_middles(page: &NightPage, timed: &[&PhotometryRow]) -> Markup {
    let first = timed.iter().filter_map(|r| r.mjd_mid_d).min_by(f64::total_cmp).unwrap_or(0.0);
    let pairs: Vec<(&PhotometryRow, f64, f64)> =
        timed.iter().filter_map(|r| Some((*r, (r.mjd_mid_d? - first) * 24.0, r.date_avg_minus_mid_s?))).collect();
    let (Some(x), Some(y), Some((median_s, scatter_s))) = (
        Span::around(pairs.iter().map(|p| p.1), 0.05),
        Span::around(pairs.iter().map(|p| p.2), 0.1),
        robust(&pairs.iter().map(|p| p.2).collect::<Vec<_>>()),
    ) else {
        return nothing("No header states both its middle (DATE-AVG) and its start: the two cannot be compared.");
    };
    let title = "DATE-AVG minus start + EXPTIME/2";
    let chart = Chart {
        size: (460, 250),
        x,
        y,
        x_label: "hours since the first frame",
        y_label: "DATE-AVG − mid [s]",
        ticks: Ticks::Numbers,
    };
    let points: Vec<Point> = pairs
        .iter()
        .map(|(row, hours, off_s)| Point {
            x: *hours,
            y: *off_s,
            paint: verdict_paint(row),
            href: page.link(row),
            tip: format!("DATE-AVG − mid {off_s:+.3} s, {}", tip(row)),
            ..Point::default()
        })
        .collect();
    let zero = [(x.low(), Some(0.0)), (x.high(), Some(0.0))];
    html! {
        figure {
            (over_line(&chart, &zero, &points, title))
            figcaption {
                "DATE-AVG of the header minus (start + EXPTIME/2): median " (format!("{median_s:+.3}").replace('-', "−"))
                " s, scatter " (format!("{scatter_s:.3}")) " s over " (pairs.len()) " frames. An offset is a delay of the driver or the shutter."
            }
        }
    }
}

/// The section of the detector and the flat.
pub(super) fn calibration(page: &NightPage) -> Markup {
    html! { (gains(page)) (flats(page)) div.panels { (corners(page)) } }
}

pub(super) fn gains(page: &NightPage) -> Markup {
    let mut kinds: BTreeMap<(i64, String), (usize, Option<f64>, Option<f64>)> = BTreeMap::new();
    for row in page.rows.iter().filter(|r| r.e_per_adu.is_some()) {
        let key = (row.gain_setting.unwrap_or(-1), row.e_per_adu_source.clone());
        let entry = kinds.entry(key).or_insert((0, row.e_per_adu, row.read_noise_e));
        entry.0 += 1;
    }
    if kinds.is_empty() {
        return nothing("No frame has a gain.");
    }
    let rows: Vec<Vec<Markup>> = kinds
        .iter()
        .map(|((setting, source), (n, gain, noise))| {
            let setting = if *setting < 0 { "missing".to_string() } else { setting.to_string() };
            vec![cell(setting), cell(n), number(*gain, 4), number(*noise, 2), cell(source)]
        })
        .collect();
    table("", "Gain of the target frames", &["setting [0.1 dB]", "frames", "e⁻/ADU", "read noise [e⁻]", "from"], &rows)
}

fn flats(page: &NightPage) -> Markup {
    let Some(flats) = page.manifest.get("flats").and_then(|f| f.as_array()).filter(|f| !f.is_empty()) else {
        return nothing("No flats: frames are not flattened, or manifest.json is not here.");
    };
    let used = |f: &&serde_json::Value| f.get("used").and_then(|u| u.as_bool()).unwrap_or(false);
    let levels: Vec<f64> = flats.iter().filter(used).filter_map(|f| f.get("level_adu")?.as_f64()).collect();
    let bounds = levels.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
    let masked = page.manifest.get("flat_masked_frac").and_then(|v| v.as_f64());
    let left: Vec<(&str, &str)> = flats
        .iter()
        .filter(|f| !used(f))
        .map(|f| {
            let text = |key: &str| f.get(key).and_then(|v| v.as_str()).unwrap_or_default();
            (text("path").rsplit('/').next().unwrap_or_default(), text("reason"))
        })
        .collect();
    let config: Option<toml::Table> = page.config_toml.parse().ok();
    let clip = config.as_ref().and_then(|c| c.get("photometry")?.get("clip_radius_px"));
    html! {
        p {
            "Master flat of " (levels.len()) " of " (flats.len()) " flats"
            @if bounds.0 <= bounds.1 { ", levels " (format!("{:.0} to {:.0}", bounds.0, bounds.1)) " ADU" }
            @if let Some(masked) = masked { ", " (format!("{:.2}", 100.0 * masked)) " % of its pixels masked" }
            @match clip { Some(r) => { "; frames are clipped at " (r) " px from the centre." }, None => { "; frames are not clipped." } }
        }
        @if !left.is_empty() { ul.poor { @for (name, reason) in left { li { (name) ": " (reason) } } } }
    }
}

/// The sky at the edge over that at the centre: what stands in the beam, and how well the flat fits.
fn corners(page: &NightPage) -> Markup {
    let rows: Vec<&PhotometryRow> =
        page.rows.iter().filter(|r| r.sky_corner_ratio.is_some() && r.az_deg.is_some()).collect();
    let (Some(x), Some(y)) = (
        Span::around(rows.iter().filter_map(|r| r.az_deg), 5.0),
        Span::around(rows.iter().filter_map(|r| r.sky_corner_ratio), 0.05),
    ) else {
        return html! {};
    };
    let title = "Sky at the edge over that at the centre, against azimuth";
    let chart = Chart {
        size: (460, 250),
        x,
        y,
        x_label: "azimuth [deg]",
        y_label: "sky, edge / centre",
        ticks: Ticks::Numbers,
    };
    let point = |r: &&PhotometryRow| {
        Some(Point {
            x: r.az_deg?,
            y: r.sky_corner_ratio?,
            paint: verdict_paint(r),
            href: page.link(r),
            tip: format!("edge / centre {:.3}, {}", r.sky_corner_ratio?, tip(r)),
            ..Point::default()
        })
    };
    let points: Vec<Point> = rows.iter().filter_map(point).collect();
    let one = [(x.low(), Some(1.0)), (x.high(), Some(1.0))];
    html! {
        figure {
            (over_line(&chart, &one, &points, title))
            figcaption { "A drop of single frames is something in the beam; all frames alike, a flat that does not fit." }
        }
    }
}
