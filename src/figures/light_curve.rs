//! Light curves: observed V with error bars and limits over the model and its lights, altitude below, one block a pass.
//!
//! Magnitudes upwards to brighter, UTC to the right. The model is a curve of its own, closer in time than the frames. The background says which light is the largest. Lights more than
//! [`LIGHTS_BELOW_MAG`] fainter than the rest leave the figure: their numbers are in the table.

use std::path::{Path, PathBuf};

use super::axis::{Span, clock};
use super::canvas::{
    BLUE, Colour, GREEN, GREY, HPos, INK, LABEL, Legend, Mark, Medium, ORANGE, PURPLE, Paint, SKY_BLUE, SMALL, Sheet,
    VERMILLION, VPos, WHITE, figure, heading, legend, no_data, signed, write_text,
};
use super::chart::Chart;
use super::interaction::Interaction;
use super::panel::{Panel, Point, Ticks};
use super::viridis;
use crate::base::error::Result;
use crate::base::stats::robust;
use crate::base::stats::scatter;
use crate::brightness::Illum;
use crate::tables::PhotometryRow;
use crate::tables::row_passes::{PASS_GAP_S, mjd, passes, target};
use crate::tables::selection::counts;
use crate::tables::selection::is_lower_limit;
use crate::tables::selection::is_used;
use crate::tables::words::{Status, Verdict};

/// How far below everything else a light is still shown next to observations \[mag\].
const LIGHTS_BELOW_MAG: f64 = 3.0;
/// In a prediction lights are shown at least this far below its brightest moment: moonlight by way of the Earth is
/// 17 mag below sunlight \[mag\].
const PREDICTED_RANGE_MAG: f64 = 18.0;
/// Passes in one figure, which is then as high as a page; more are counted in a note, and have figures of their own in
/// [`light_curve_pages`].
const MOST_PASSES: usize = 3;
/// Shown size of a figure of one pass \[px\].
const ONE_PASS: (u32, u32) = (960, 640);
/// Height of one of several passes \[drawn px\].
const BLOCK: i32 = 860;
/// The ground where sunlight is not the largest light.
const DIM: Colour = Colour(229, 235, 243);
/// Where the legend begins \[drawn px\].
const LEGEND_X: i32 = 1490;

/// A light of the model: its name, colour and magnitude in a row.
type Light = (&'static str, Paint<'static>, fn(&PhotometryRow) -> Option<f64>);

pub(crate) const LIGHTS: [Light; 4] = [
    ("Sunlight", ORANGE.class("sun"), |r| r.sun_v_mag),
    ("Earthshine", GREEN.class("earthshine"), |r| r.earthshine_v_mag),
    ("Moonlight", SKY_BLUE.class("moon"), |r| r.moon_v_mag),
    ("Lunar-Earthshine", PURPLE.class("lunar"), |r| r.lunar_earthshine_v_mag),
];
/// All lights together.
pub(crate) const MODEL: Paint = INK.class("model");

/// Draws every pass of the rows, one block each (the first three; a note counts the rest).
///
/// Without a magnitude, limit or model the figure says so.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn light_curve(path: &Path, rows: &[PhotometryRow], title: &str) -> Result<()> {
    light_curve_in(path, (rows, &[]), title, "V")
}

/// As [`light_curve`], of magnitudes of another band than V, with the model at the moments of `curve`; without one at
/// those of the frames.
fn light_curve_in(
    path: &Path,
    (rows, curve): (&[PhotometryRow], &[PhotometryRow]),
    title: &str,
    band: &str,
) -> Result<()> {
    let all = passes(rows);
    let drawable: Vec<&Vec<&PhotometryRow>> = all.iter().filter(|p| magnitude_span(p).is_some()).collect();
    if drawable.is_empty() {
        let reason = if rows.is_empty() {
            "no target frame".to_owned()
        } else if all.is_empty() {
            format!("none of {} frames has a time", rows.len())
        } else {
            format!("none of {} frames has a magnitude, a limit or a model", rows.len())
        };
        return no_data(path, ONE_PASS, title, &reason);
    }
    let shown = drawable.len().min(MOST_PASSES);
    let height = if shown == 1 { ONE_PASS.1 } else { (110 + BLOCK * shown as i32) as u32 / 2 };
    figure(path, (ONE_PASS.0, height), |sheet| {
        heading(sheet, title);
        let more = drawable.len() - shown;
        if more > 0 {
            let note = format!("… and {more} more {}", if more == 1 { "pass" } else { "passes" });
            write_text(sheet, &note, (1880, 30), LABEL, GREY, (HPos::Right, VPos::Top));
        }
        let block = if shown == 1 { 2 * ONE_PASS.1 as i32 - 110 } else { BLOCK };
        for (i, pass) in drawable.iter().take(shown).enumerate() {
            let curve = curve_of(pass, curve);
            draw_pass(sheet, (pass, &curve), (90 + block * i as i32, block), band);
        }
    })
}

/// Writes `light_curve.svg` with the first three passes into `dir`, and `light_curve_2.svg` and so on with the next
/// three each, of magnitudes of `band`; returns the paths. The model is drawn at the moments of `curve`, or, where that
/// has none, at those of the frames.
///
/// # Errors
/// As [`light_curve`].
pub fn light_curve_pages(
    dir: &Path,
    (rows, curve): (&[PhotometryRow], &[PhotometryRow]),
    title: &str,
    band: &str,
) -> Result<Vec<PathBuf>> {
    let mut paths = vec![dir.join("light_curve.svg")];
    light_curve_in(&paths[0], (rows, curve), title, band)?;
    let all = passes(rows);
    let drawable: Vec<&Vec<&PhotometryRow>> = all.iter().filter(|p| magnitude_span(p).is_some()).collect();
    for (page, some) in drawable.chunks(MOST_PASSES).enumerate().skip(1) {
        let path = dir.join(format!("light_curve_{}.svg", page + 1));
        let rows: Vec<PhotometryRow> = some.iter().flat_map(|p| p.iter().map(|r| (*r).clone())).collect();
        light_curve_in(&path, (&rows, curve), title, band)?;
        paths.push(path);
    }
    Ok(paths)
}

/// Writes one figure per pass into `dir`, named `light_curve_<number>_<UTC of the first frame>.svg`, and returns the
/// paths in order of time.
///
/// # Errors
/// As [`light_curve`].
pub fn light_curves(dir: &Path, rows: &[PhotometryRow], title: &str) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for pass in passes(rows) {
        let Some(first) = pass.first() else { continue };
        let target = first.norad_cat_id.map_or_else(|| first.object_name.clone(), |n| n.to_string());
        let when: String = first.date_mid.chars().take(19).collect();
        let plain = |text: String| text.replace(|c: char| !c.is_ascii_alphanumeric(), "");
        let mut path = dir.join(format!("light_curve_{}_{}.svg", plain(target), plain(when)));
        if paths.contains(&path) {
            path = dir.join(format!("light_curve_{}.svg", paths.len() + 1));
        }
        let rows: Vec<PhotometryRow> = pass.into_iter().cloned().collect();
        light_curve(&path, &rows, title)?;
        paths.push(path);
    }
    Ok(paths)
}

/// The limit of a row that has no magnitude.
pub(crate) fn limit(row: &PhotometryRow) -> Option<f64> {
    if row.v_mag.is_some() || matches!(Status::from_cell(&row.status), Some(Status::Failed | Status::Rejected)) {
        return None;
    }
    row.limit_v_mag
}

/// Nothing was observed: the rows are a prediction.
fn predicted(pass: &[&PhotometryRow]) -> bool {
    pass.iter().all(|r| r.status.is_empty() && r.v_mag.is_none() && r.limit_v_mag.is_none())
}

/// The interval that holds 68 % of observed magnitudes.
fn predicted_within(row: &PhotometryRow) -> Option<[f64; 2]> {
    let (v_mag, err_mag) = (row.model_v_mag?, row.v_pred_err_mag?);
    Some([v_mag - err_mag, v_mag + err_mag])
}

/// The magnitude axis: every accepted point with its error, every limit, the model, and the lights that are near.
fn magnitude_span(pass: &[&PhotometryRow]) -> Option<Span> {
    let any_used = pass.iter().any(|r| r.v_mag.is_some() && is_used(&r.status, &r.verdict));
    let observed = pass.iter().filter(|r| !any_used || is_used(&r.status, &r.verdict)).filter_map(|r| {
        let err = r.v_mag_err.unwrap_or(0.0).clamp(0.0, 1.0);
        r.v_mag.map(|v| [v - err, v + err])
    });
    let main: Vec<f64> = observed
        .flatten()
        .chain(pass.iter().filter_map(|r| limit(r)))
        .chain(pass.iter().filter_map(|r| r.model_v_mag))
        .chain(pass.iter().flat_map(|r| predicted_within(r)).flatten())
        .filter(|v| v.is_finite())
        .collect();
    let mut faintest = main.iter().copied().max_by(f64::total_cmp)? + LIGHTS_BELOW_MAG;
    if predicted(pass) {
        faintest = faintest.max(main.iter().copied().min_by(f64::total_cmp)? + PREDICTED_RANGE_MAG);
    }
    let lights = pass.iter().flat_map(|r| LIGHTS.iter().filter_map(|(_, _, of)| of(r))).filter(|v| *v <= faintest);
    let mut span = Span::around(main.iter().copied().chain(lights), 1.0)?.reversed();
    if pass.iter().any(|r| limit(r).is_some()) {
        span.from += 0.05 * (span.from - span.to); // room for the arrow below a limit
    }
    Some(span)
}

/// The moments of `curve` that belong to a pass, in order of time; those of its frames where there is none.
fn curve_of<'a>(pass: &[&'a PhotometryRow], curve: &'a [PhotometryRow]) -> Vec<&'a PhotometryRow> {
    let (Some(first), Some(last)) = (pass.first(), pass.last()) else { return Vec::new() };
    // further apart than this, and a moment is of another pass
    let near_d = PASS_GAP_S / 86_400.0;
    let ours =
        |r: &&PhotometryRow| target(r) == target(first) && mjd(first) - near_d < mjd(r) && mjd(r) < mjd(last) + near_d;
    let found: Vec<&PhotometryRow> = curve.iter().filter(ours).collect();
    if found.is_empty() { pass.to_vec() } else { found }
}

/// One pass as a chart of a page: the same curves and points as in a file, with a strip of altitudes along the foot.
/// `None` without a magnitude, a limit or a model.
pub(crate) fn pass_chart(
    pass: &[&PhotometryRow],
    curve: &[PhotometryRow],
    band: &str,
    size: (i32, i32),
    interaction: &Interaction,
) -> Option<Sheet> {
    let first = *pass.first()?;
    let mut y = magnitude_span(pass)?;
    y.from += 0.06 * (y.from - y.to); // room for the strip
    let seconds =
        |r: &PhotometryRow| (r.mjd_mid_d.unwrap_or(f64::NAN) - first.mjd_mid_d.unwrap_or(0.0).floor()) * 86_400.0;
    let x = Span::around(pass.iter().map(|r| seconds(r)), 20.0)?;
    let day: String = first.date_mid.chars().take(10).collect();
    let chart =
        Chart { size, x, y, x_label: &format!("UTC on {day}"), y_label: &format!("{band} [mag]"), ticks: Ticks::Clock };
    let curve = curve_of(pass, curve);
    let shades = |panel: &Panel| drop(shade(panel, &curve, &seconds, false));
    Some(chart.draw(Medium::Page, shades, |panel| {
        altitudes(panel, &curve, &seconds);
        curves(panel, (pass, &curve), &seconds, (Legend::new(), band), interaction);
    }))
}

/// Colour of an altitude: dark at the horizon, yellow in the zenith.
pub(crate) fn altitude_colour(alt_deg: f64) -> Colour {
    let (r, g, b) = viridis(alt_deg / 90.0);
    Colour(r, g, b)
}

/// The strip of altitudes, each moment as far as halfway to its neighbours.
fn altitudes(panel: &Panel, curve: &[&PhotometryRow], seconds: &dyn Fn(&PhotometryRow) -> f64) {
    let known: Vec<(f64, f64)> = curve.iter().filter_map(|r| Some((seconds(r), r.alt_deg?))).collect();
    let middle = |a: usize, b: usize| Some(0.5 * (known.get(a)?.0 + known.get(b)?.0));
    for (k, (at, alt_deg)) in known.iter().enumerate() {
        let before = k.checked_sub(1).and_then(|p| middle(p, k)).unwrap_or(at - 5.0);
        let after = middle(k, k + 1).unwrap_or(at + 5.0);
        panel.foot(before, after, altitude_colour(*alt_deg), &format!("altitude {alt_deg:.1}°"));
    }
}

/// One pass: heading, magnitudes, altitude, legend, from `top` over `height` drawn pixels.
fn draw_pass(
    sheet: &Sheet,
    (pass, curve): (&[&PhotometryRow], &[&PhotometryRow]),
    (top, height): (i32, i32),
    band: &str,
) {
    let (Some(y), Some(first)) = (magnitude_span(pass), pass.first()) else { return };
    let midnight = first.mjd_mid_d.unwrap_or(0.0).floor();
    let seconds = |r: &PhotometryRow| (r.mjd_mid_d.unwrap_or(0.0) - midnight) * 86_400.0;
    let Some(x) = Span::around(pass.iter().map(|r| seconds(r)), 10.0) else { return };

    let ends = (pass.first().map_or(0.0, |r| seconds(r)), pass.last().map_or(0.0, |r| seconds(r)));
    let number = first.norad_cat_id.map(|n| format!(" {n}")).unwrap_or_default();
    let used = pass.iter().filter(|r| r.v_mag.is_some() && is_used(&r.status, &r.verdict)).count();
    let count = if predicted(pass) {
        format!("{} moments predicted", pass.len())
    } else {
        format!("{used} of {} frames used", pass.len())
    };
    let heading = format!(
        "{}{number} · {} UTC · {count}",
        first.object_name,
        if ends.0 == ends.1 { clock(ends.0) } else { format!("{}–{}", clock(ends.0), clock(ends.1)) },
    );
    write_text(sheet, heading.trim_start_matches([' ', '·']), (160, top), LABEL, INK, (HPos::Left, VPos::Top));

    let altitude = Span::around(pass.iter().chain(curve).filter_map(|r| r.alt_deg), 4.0);
    let bottom = top + height - 110;
    let split = if altitude.is_some() { bottom - (height - 200) * 3 / 10 } else { bottom };
    let day: String = first.date_mid.chars().take(10).collect();
    let x_title = format!("UTC {day}");
    let magnitudes = Panel { sheet, frame: (160, top + 84, 1430, split), x, y };
    let unnamed = shade(&magnitudes, curve, &seconds, true);
    magnitudes.axes(Ticks::Clock, if altitude.is_some() { "" } else { &x_title }, &format!("{band} [mag]"));
    let entries = curves(&magnitudes, (pass, curve), &seconds, (unnamed, band), &Interaction::NONE);
    legend(sheet, (LEGEND_X, top + 100), &entries);
    if let Some(y) = altitude {
        let panel = Panel { sheet, frame: (160, split + 26, 1430, bottom), x, y };
        shade(&panel, curve, &seconds, false);
        panel.axes(Ticks::Clock, &x_title, "altitude [deg]");
        let track: Vec<(f64, Option<f64>)> = curve.iter().map(|r| (seconds(r), r.alt_deg)).collect();
        panel.polyline(&track, INK, 3);
    }
}

/// The background by the largest light, changing halfway between moments. Returns the legend of the pieces too narrow
/// for their name.
fn shade(panel: &Panel, curve: &[&PhotometryRow], seconds: &dyn Fn(&PhotometryRow) -> f64, named: bool) -> Legend {
    let mut unnamed = Legend::new();
    let mut start = 0;
    while let Some(first) = curve.get(start) {
        let count = curve.iter().skip(start).take_while(|r| r.illum == first.illum).count();
        let end = start + count;
        let edge = |before: usize, after: usize| match (curve.get(before), curve.get(after)) {
            (Some(a), Some(b)) => Some(0.5 * (seconds(a) + seconds(b))),
            _ => None,
        };
        let from = start.checked_sub(1).and_then(|i| edge(i, start)).unwrap_or(panel.x.from);
        let to = edge(end - 1, end).unwrap_or(panel.x.to);
        // where sunlight is not the largest, the satellite need not be in the umbra: its lit sides may look away
        let (paint, name) = match Illum::from_cell(&first.illum) {
            None => (WHITE.class("sunlit"), String::new()),
            Some(Illum::Sun) => (Colour(255, 246, 214).class("sunlit"), "sunlit".to_owned()),
            Some(Illum::Penumbra) => (Colour(243, 230, 240).class("penumbra"), "penumbra".to_owned()),
            Some(Illum::None) => (DIM.class("umbra"), "no light".to_owned()),
            Some(light) => (DIM.class("umbra"), light.as_str().replace('_', "-")),
        };
        let tip = if name.is_empty() { String::new() } else { format!("largest light: {name}") };
        panel.shade(from, to, paint, &tip);
        let (left, right) = (panel.px(from), panel.px(to));
        if named && right - left > 17.0 * name.chars().count() as f64 {
            let above = (0.5 * (left + right), panel.frame.1 - 6);
            write_text(panel.sheet, &name, above, SMALL, GREY, (HPos::Center, VPos::Bottom));
        } else if !name.is_empty() && unnamed.iter().all(|(_, n)| *n != name) {
            unnamed.push((Some((Mark::Swatch, paint.colour)), name));
        }
        start = end;
    }
    unnamed
}

/// Model, lights and observations; returns the legend of what was drawn, `backgrounds` among it, and the numbers.
fn curves(
    panel: &Panel,
    (pass, curve): (&[&PhotometryRow], &[&PhotometryRow]),
    seconds: &dyn Fn(&PhotometryRow) -> f64,
    (backgrounds, name): (Legend, &str),
    interaction: &Interaction,
) -> Legend {
    let sheet = panel.sheet;
    let mut model = Legend::new();
    // the error of a prediction, which holds 68 % of observed magnitudes; else the numerical one
    let is_predictive = curve.iter().any(|r| r.v_pred_err_mag.is_some());
    let err_mag = |r: &PhotometryRow| if is_predictive { r.v_pred_err_mag } else { r.model_err_mag };
    for run in curve.split(|r| r.model_v_mag.is_none() || err_mag(r).is_none()) {
        let limits = |r: &&PhotometryRow| {
            let (v_mag, err_mag) = (r.model_v_mag?, err_mag(r)?);
            Some((seconds(r), v_mag - err_mag, v_mag + err_mag))
        };
        let band: Vec<(f64, f64, f64)> = run.iter().filter_map(limits).collect();
        // A band thinner than the line it surrounds would only blur it.
        if band.iter().any(|(_, low, high)| high - low > 0.04) && band.len() > 1 {
            sheet.series(MODEL.class, || panel.band(&band, GREY.class("model")));
            if model.is_empty() {
                let name = if is_predictive { "68 % of observations" } else { "model ± error" };
                model.push((Some((Mark::Band, GREY)), name.into()));
            }
        }
    }
    // The lights over the total: where one of them is nearly all of it, both can be seen.
    let total: Vec<(f64, Option<f64>)> = curve.iter().map(|r| (seconds(r), r.model_v_mag)).collect();
    if total.iter().any(|(_, v)| v.is_some()) {
        sheet.series(MODEL.class, || panel.polyline(&total, MODEL, 7));
        model.insert(0, (Some((Mark::Line(7), INK)), "model, all lights".into()));
    }
    for (name, paint, of) in LIGHTS {
        let light: Vec<(f64, Option<f64>)> = curve.iter().map(|r| (seconds(r), of(r))).collect();
        if light.iter().any(|(_, v)| v.is_some_and(|v| panel.y.holds(v))) {
            sheet.series(paint.class, || panel.polyline(&light, paint, 3));
            model.push((Some((Mark::Line(3), paint.colour)), name.into()));
        }
    }

    let (mut full, mut open, mut at_least, mut crossed, mut limits, mut without) = (0, 0, 0, 0, 0, 0);
    let mut points = Vec::new();
    for row in pass {
        let class = Verdict::from_cell(&row.verdict).unwrap_or(Verdict::Use).as_str();
        let (y, err, mark, colour, count) = match (row.v_mag, limit(row)) {
            (Some(v), _) => {
                let (mark, colour, count) = match (is_used(&row.status, &row.verdict), Verdict::from_cell(&row.verdict))
                {
                    (false, _) => (Mark::Cross, VERMILLION, &mut crossed),
                    (true, _) if is_lower_limit(row.flags) => (Mark::AtLeast, BLUE, &mut at_least),
                    (true, Some(Verdict::Caution)) => (Mark::Open, BLUE, &mut open),
                    (true, _) => (Mark::Full, BLUE, &mut full),
                };
                (v, row.v_mag_err, mark, colour, count)
            }
            (None, Some(v)) => (v, None, Mark::Limit, GREY, &mut limits),
            (None, None) => {
                without += 1;
                continue;
            }
        };
        *count += 1;
        points.push(Point {
            x: seconds(row),
            y,
            err,
            mark,
            paint: colour.class(class),
            href: (interaction.link)(row),
            tip: (interaction.tip)(row),
            by: row.alt_deg.map(|alt_deg| altitude_colour(alt_deg).hex()),
        });
    }
    let beyond = panel.points(&points);
    let mut entries = Legend::new();
    for (count, mark, colour, name) in [
        (full, Mark::Full, BLUE, "observed"),
        (open, Mark::Open, BLUE, "observed, caution"),
        (at_least, Mark::AtLeast, BLUE, "lower limit"),
        (crossed, Mark::Cross, VERMILLION, "verdict reject"),
        (limits, Mark::Limit, GREY, "not detected: limit"),
    ] {
        if count > 0 {
            entries.push((Some((mark, colour)), format!("{name} ({count})")));
        }
    }
    entries.extend(model);
    entries.extend(backgrounds);
    let used: Vec<&&PhotometryRow> = pass.iter().filter(|r| counts(r)).collect();
    let of =
        |value: fn(&PhotometryRow) -> Option<f64>| robust(&used.iter().filter_map(|r| value(r)).collect::<Vec<_>>());
    let mut notes = vec![String::new()];
    notes.extend(of(|r| r.v_mag).map(|(m, _)| format!("median {name} {m:.2}")));
    let residual = |r: &PhotometryRow| r.residual_mag.filter(|_| !is_lower_limit(r.flags));
    let scattered = scatter(&used.iter().filter_map(|r| residual(r)).collect::<Vec<_>>());
    let scattered = scattered.map(|s| format!(", σ {s:.2}")).unwrap_or_default();
    notes.extend(of(residual).map(|(m, _)| signed(&format!("residual {m:+.2}{scattered}"))));
    notes.extend(of(|r| r.v_mag_err_sys).map(|(m, _)| format!("systematic ±{m:.3} mag")));
    notes.extend((beyond > 0).then(|| format!("{beyond} beyond the axis (△)")));
    let brightest = pass.iter().filter_map(|r| r.model_v_mag).min_by(f64::total_cmp).filter(|_| predicted(pass));
    notes.extend(brightest.map(|v| signed(&format!("brightest V {v:.2}"))));
    notes.extend((without > 0 && !predicted(pass)).then(|| format!("{without} without a magnitude")));
    entries.extend(notes.into_iter().map(|note| (None, note)));
    entries
}
