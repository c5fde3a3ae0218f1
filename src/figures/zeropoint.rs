//! What the zeropoint fit did: the extinction line, the colour line, residuals against all that should not matter, and
//! the offset of every pointing.
//!
//! `V_inst = V + ZP + k·X + C·(B−V)`, magnitudes of electrons per second. Here a difference grows upwards, so that the
//! slopes seen have the signs of k and C.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    BLUE, GREY, HPos, INK, LABEL, Mark, Medium, PURPLE, Paint, SMALL, Sheet, VERMILLION, VPos, draw_mark, figure,
    heading, no_data, signed, write_text,
};
use super::chart::Chart;
use super::panel::{Panel, Point, Ticks};
use crate::base::error::Result;
use crate::base::stats::scatter;
use crate::tables::StarRow;
use crate::tables::words::Status;

const SIZE: (u32, u32) = (960, 1240);
const NAME: &str = "Zeropoint fit";

/// One star as the panels need it.
struct Star {
    used: bool,
    airmass: f64,
    b_v_mag: f64,
    v_mag: f64,
    /// Seconds since the first midnight.
    time_s: Option<f64>,
    x_px: Option<f64>,
    y_px: Option<f64>,
    pointing: Option<i64>,
    /// Inst − V minus the fit \[mag\].
    residual_mag: f64,
    /// What a page says of it.
    tip: String,
}

/// Zeropoint, extinction and colour term of a fit.
type Terms = (f64, f64, f64);

/// A panel: titles of x and y, where a star lies in it, and the slope of the fit in it.
struct View {
    x_title: String,
    y_title: String,
    of: Box<dyn Fn(&Star) -> Option<(f64, f64)>>,
    slope: Option<f64>,
}

/// What is drawn in a panel: its axes, the stars, and the fit as offset and slope.
struct Content<'a> {
    spans: (Span, Span),
    points: Vec<Point<'a>>,
    fit: (f64, f64),
}

const USED: Paint = BLUE.class("star");
const REJECTED: Paint = VERMILLION.class("star left");
const POINTING: Paint = PURPLE.class("pointing");

/// The six panels of a fit in a band with a colour index.
fn views((zp, k, c): Terms, (band, colour): (&str, &str)) -> [View; 6] {
    let colour = colour.replace('-', "−");
    let view = |x: &str, y: &str, slope, of: Box<dyn Fn(&Star) -> Option<(f64, f64)>>| View {
        x_title: x.into(),
        y_title: y.into(),
        of,
        slope,
    };
    let residual = "residual [mag]";
    [
        view(
            "airmass X",
            &format!("{band}_inst − {band} − C({colour}) [mag]"),
            Some(k),
            Box::new(move |s| Some((s.airmass, zp + k * s.airmass + s.residual_mag))),
        ),
        view(
            &format!("{colour} [mag]"),
            &format!("{band}_inst − {band} − kX [mag]"),
            Some(c),
            Box::new(move |s| Some((s.b_v_mag, zp + c * s.b_v_mag + s.residual_mag))),
        ),
        view(&format!("{band} of the catalogue [mag]"), residual, None, Box::new(|s| Some((s.v_mag, s.residual_mag)))),
        view("UTC", residual, None, Box::new(|s| Some((s.time_s?, s.residual_mag)))),
        view("x [px]", residual, None, Box::new(|s| Some((s.x_px?, s.residual_mag)))),
        view("y [px]", residual, None, Box::new(|s| Some((s.y_px?, s.residual_mag)))),
    ]
}

impl View {
    fn ticks(&self) -> Ticks<'static> {
        if self.x_title == "UTC" { Ticks::Clock } else { Ticks::Numbers }
    }

    /// Rejected stars below, used stars above; `None` where no star has a place.
    fn content(&self, stars: &[Star], zp: f64) -> Option<Content<'static>> {
        let placed: Vec<(&Star, f64, f64)> =
            stars.iter().filter_map(|s| (self.of)(s).map(|(x, y)| (s, x, y))).collect();
        let fit = self.slope.map_or((0.0, 0.0), |slope| (zp, slope));
        let any_used = placed.iter().any(|p| p.0.used);
        let chosen = placed.iter().filter(|p| p.0.used || !any_used);
        let least_x = if self.ticks() == Ticks::Clock { 60.0 } else { 0.1 };
        let x = Span::around(placed.iter().map(|p| p.1), least_x)?;
        let y = Span::around(chosen.flat_map(|p| [p.2, fit.0 + fit.1 * p.1]), 0.1)?;
        let point = |(s, x, y): &(&Star, f64, f64)| {
            let (mark, paint) = if s.used { (Mark::Dot, USED) } else { (Mark::Open, REJECTED) };
            Point { x: *x, y: *y, mark, paint, tip: s.tip.clone(), ..Point::default() }
        };
        let (used, rejected): (Vec<_>, Vec<_>) = placed.iter().partition(|p| p.0.used);
        let points = rejected.into_iter().chain(used).map(point).collect();
        Some(Content { spans: (x, y), points, fit })
    }
}

impl Content<'_> {
    /// The stars, and the line of the fit over them.
    fn draw(&self, panel: &Panel) {
        panel.points(&self.points);
        let at = |x: f64| (x, Some(self.fit.0 + self.fit.1 * x));
        panel.polyline(&[at(panel.x.from), at(panel.x.to)], INK.class("zero"), 4);
    }
}

/// The panels of a fit as charts of a page, each with its title; a star's tip names it and the reason it is not used.
pub(crate) fn zeropoint_charts(rows: &[StarRow], terms: Terms, names: (&str, &str)) -> Vec<(String, Sheet)> {
    let stars = stars(rows, terms);
    let chart = |(x, y): (Span, Span), x_label: &str, y_label: &str, ticks, body: &dyn Fn(&Panel)| {
        Chart { size: (460, 250), x, y, x_label, y_label, ticks }.draw(Medium::Page, |_| {}, body)
    };
    let one = |view: &View| {
        let content = view.content(&stars, terms.0)?;
        let body = |panel: &Panel| content.draw(panel);
        let sheet = chart(content.spans, &view.x_title, &view.y_title, view.ticks(), &body);
        Some((format!("{} against {}", view.y_title, view.x_title), sheet))
    };
    let mut charts: Vec<(String, Sheet)> = views(terms, names).iter().filter_map(one).collect();
    let means = pointing_means(&stars);
    if let Some(spans) = pointing_spans(&means) {
        let sheet = chart(spans, POINTING_TITLES.0, POINTING_TITLES.1, Ticks::Numbers, &|p| draw_means(p, &means));
        charts.push((format!("{} against {}", POINTING_TITLES.1, POINTING_TITLES.0), sheet));
    }
    charts
}

/// The stars that can be placed.
fn stars(rows: &[StarRow], terms: Terms) -> Vec<Star> {
    let midnight = rows.iter().filter_map(|r| r.mjd_mid_d).min_by(f64::total_cmp).unwrap_or(0.0).floor();
    rows.iter().filter_map(|r| star(r, midnight, terms)).collect()
}

/// Draws seven panels: `V_inst − V − C(B−V)` against airmass and `V_inst − V − kX` against B−V, each with the fit (a
/// second-order term is subtracted); the residual against V, time, x and y; the mean residual of each pointing with the
/// error its stars give it. Stars that were not used are open circles.
///
/// `names` are those of the band and of the colour index. A star without airmass (or colour) is drawn only where k (or C) is zero.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn zeropoint_diagnostics(path: &Path, rows: &[StarRow], (zp, k, c): Terms, names: (&str, &str)) -> Result<()> {
    let stars = stars(rows, (zp, k, c));
    if stars.is_empty() || ![zp, k, c].iter().all(|v| v.is_finite()) {
        let reason = if rows.is_empty() {
            "no star was measured".to_owned()
        } else if stars.is_empty() {
            format!("none of {} stars has magnitudes, airmass and colour", rows.len())
        } else {
            "there is no fit".to_owned()
        };
        return no_data(path, SIZE, NAME, &reason);
    }
    let used: Vec<f64> = stars.iter().filter(|s| s.used).map(|s| s.residual_mag).collect();
    figure(path, SIZE, |sheet| {
        numbers(sheet, &stars, &used, (zp, k, c));
        for (i, view) in views((zp, k, c), names).iter().enumerate() {
            let (column, row) = (i as i32 % 2, i as i32 / 2);
            let (left, top) = (170 + 950 * column, 170 + 590 * row);
            let frame = (left, top, left + 740, top + 450);
            match view.content(&stars, zp) {
                Some(content) => {
                    let panel = Panel { sheet, frame, x: content.spans.0, y: content.spans.1 };
                    panel.axes(view.ticks(), &view.x_title, &view.y_title);
                    content.draw(&panel);
                }
                None => empty(sheet, frame, &format!("no data against {}", view.x_title)),
            }
        }
        draw_pointings(sheet, (170, 1940, 1860, 2390), &stars);
    })
}

/// Where a panel would be, why it is not.
fn empty(sheet: &Sheet, frame: (i32, i32, i32, i32), text: &str) {
    let middle = ((frame.0 + frame.2) / 2, (frame.1 + frame.3) / 2);
    write_text(sheet, text, middle, LABEL, GREY, (HPos::Center, VPos::Center));
}

/// Mean residual of the used stars of each pointing and its error, by number: s/√n, with s of all stars where there are
/// fewer than three.
fn pointing_means(stars: &[Star]) -> Vec<(f64, f64, f64)> {
    let mut groups = std::collections::BTreeMap::<i64, Vec<f64>>::new();
    for s in stars.iter().filter(|s| s.used) {
        if let Some(number) = s.pointing {
            groups.entry(number).or_default().push(s.residual_mag);
        }
    }
    let all: Vec<f64> = groups.values().flatten().copied().collect();
    let scatter = |values: &[f64], mean: f64| {
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1).max(1) as f64).sqrt()
    };
    let one = |(number, values): (&i64, &Vec<f64>)| {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let s = if values.len() < 3 { scatter(&all, 0.0) } else { scatter(values, mean) };
        (*number as f64, mean, s / n.sqrt())
    };
    groups.iter().map(one).collect()
}

const POINTING_TITLES: (&str, &str) = ("number of the pointing", "mean residual [mag]");

fn pointing_spans(means: &[(f64, f64, f64)]) -> Option<(Span, Span)> {
    let y = means.iter().flat_map(|m| [m.1 - m.2, m.1 + m.2, 0.0]);
    Some((Span::around(means.iter().map(|m| m.0), 4.0)?, Span::around(y, 0.02)?))
}

/// The offsets of the pointings: a cloud is one that its error bar does not explain.
fn draw_pointings(sheet: &Sheet, frame: (i32, i32, i32, i32), stars: &[Star]) {
    let means = pointing_means(stars);
    let Some((x, y)) = pointing_spans(&means) else {
        return empty(sheet, frame, "no used star has a pointing");
    };
    let panel = Panel { sheet, frame, x, y };
    panel.axes(Ticks::Numbers, POINTING_TITLES.0, POINTING_TITLES.1);
    draw_means(&panel, &means);
}

fn draw_means(panel: &Panel, means: &[(f64, f64, f64)]) {
    panel.across(0.0, INK.class("zero"), 4);
    let point = |(number, mean, error): &(f64, f64, f64)| Point {
        x: *number,
        y: *mean,
        err: Some(*error),
        paint: POINTING,
        tip: format!("pointing {number:.0}: {} ± {error:.3} mag", signed(&format!("{mean:+.3}"))),
        ..Point::default()
    };
    panel.points(&means.iter().map(point).collect::<Vec<_>>());
}

fn star(row: &StarRow, midnight: f64, (zp, k, c): (f64, f64, f64)) -> Option<Star> {
    let finite = |v: Option<f64>| v.filter(|v| v.is_finite());
    // A term the fit omits needs no value.
    let term = |value: Option<f64>, coefficient: f64| finite(value).or((coefficient == 0.0).then_some(0.0));
    let v_mag = finite(row.catalogue_v_mag)?;
    let (airmass, b_v_mag) = (term(row.airmass, k)?, term(row.catalogue_b_v_mag, c)?);
    let difference = finite(row.inst_mag)? - v_mag;
    Some(Star {
        used: row.status == Status::Ok && row.fit_weight.is_none_or(|w| w > 0.0),
        airmass,
        b_v_mag,
        v_mag,
        time_s: finite(row.mjd_mid_d).map(|mjd| (mjd - midnight) * 86_400.0),
        x_px: finite(row.x_px),
        y_px: finite(row.y_px),
        pointing: row.pointing,
        residual_mag: finite(row.fit_residual_mag).unwrap_or(difference - zp - k * airmass - c * b_v_mag),
        tip: tip(row),
    })
}

/// What a star's point says.
fn tip(row: &StarRow) -> String {
    let v = row.catalogue_v_mag.map(|v| format!(": {v:.2} mag")).unwrap_or_default();
    let residual = row.fit_residual_mag.map(|r| signed(&format!(", residual {r:+.3}"))).unwrap_or_default();
    let reason = if row.reason.is_empty() { String::new() } else { format!(", {}", row.reason) };
    format!("{} in {}{v}{residual}{reason}", row.star_id, row.frame)
}

/// Title, the fitted numbers, and what the marks mean.
fn numbers(sheet: &Sheet, stars: &[Star], used: &[f64], (zp, k, c): (f64, f64, f64)) {
    let left = (HPos::Left, VPos::Center);
    heading(sheet, NAME);
    let scatter = scatter(used).map(|s| format!(" · robust σ {s:.3} mag")).unwrap_or_default();
    let fit = signed(&format!("ZP {zp:.3} · k {k:.3} · C {c:.3}{scatter}"));
    write_text(sheet, &fit, (1880, 46), LABEL, INK, (HPos::Right, VPos::Center));
    draw_mark(sheet, Mark::Dot, (60, 116), BLUE);
    write_text(sheet, &format!("used ({})", used.len()), (82, 116), SMALL, INK, left);
    draw_mark(sheet, Mark::Open, (320, 116), VERMILLION);
    write_text(sheet, &format!("rejected ({})", stars.len() - used.len()), (342, 116), SMALL, INK, left);
    draw_mark(sheet, Mark::Line(4), (640, 116), INK);
    write_text(sheet, "fit", (676, 116), SMALL, INK, left);
    draw_mark(sheet, Mark::Full, (800, 116), PURPLE);
    write_text(sheet, "mean of a pointing", (822, 116), SMALL, INK, left);
    write_text(sheet, "△ rejected, beyond the axis", (1880, 116), SMALL, GREY, (HPos::Right, VPos::Center))
}
