//! What the zeropoint fit did: the extinction line, the colour line, residuals against all that should not matter, and the
//! offset of every pointing.
//!
//! `V_inst = V + ZP + k·X + C·(B−V)`, magnitudes of electrons per second. Here a difference grows upwards, so that the
//! slopes seen have the signs of k and C.

use std::path::Path;

use plotters::style::text_anchor::{HPos, VPos};

use super::axis::Span;
use super::canvas::{
    BLUE, Drawn, GREY, INK, LABEL, Mark, PURPLE, SMALL, Sheet, TITLE, VERMILLION, draw_mark, figure, no_data, signed,
    write_text,
};
use super::panel::{Panel, Ticks};
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
    /// V_inst − V minus the fit \[mag\].
    residual_mag: f64,
}

/// A panel: titles of x and y, labels of x, where a star lies in it, and the slope of the fit in it.
type View<'a> = (&'a str, &'a str, Ticks, &'a dyn Fn(&Star) -> Option<(f64, f64)>, Option<f64>);

/// Draws seven panels: `V_inst − V − C(B−V)` against airmass and `V_inst − V − kX` against B−V, each with the fit (a
/// second-order term is taken off); the residual against V, time, x and y; the mean residual of each pointing with the
/// error its stars give it. Stars that were not used are open circles.
///
/// A star without airmass (or colour) is drawn only where k (or C) is zero.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn zeropoint_diagnostics(path: &Path, rows: &[StarRow], zp: f64, k: f64, c: f64) -> Result<()> {
    let midnight = rows.iter().filter_map(|r| r.mjd_mid_d).min_by(f64::total_cmp).unwrap_or(0.0).floor();
    let stars: Vec<Star> = rows.iter().filter_map(|r| star(r, midnight, (zp, k, c))).collect();
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
    let residual = |s: &Star| s.residual_mag;
    let used: Vec<f64> = stars.iter().filter(|s| s.used).map(residual).collect();
    figure(path, SIZE, |sheet| {
        heading(sheet, &stars, &used, (zp, k, c))?;
        let panels: [View; 6] = [
            (
                "airmass X",
                "V_inst − V − C(B−V) [mag]",
                Ticks::Numbers,
                &|s| Some((s.airmass, zp + k * s.airmass + s.residual_mag)),
                Some(k),
            ),
            (
                "B−V [mag]",
                "V_inst − V − kX [mag]",
                Ticks::Numbers,
                &|s| Some((s.b_v_mag, zp + c * s.b_v_mag + s.residual_mag)),
                Some(c),
            ),
            ("V [mag]", "residual [mag]", Ticks::Numbers, &|s| Some((s.v_mag, residual(s))), None),
            ("UTC", "residual [mag]", Ticks::Clock, &|s| Some((s.time_s?, residual(s))), None),
            ("x [px]", "residual [mag]", Ticks::Numbers, &|s| Some((s.x_px?, residual(s))), None),
            ("y [px]", "residual [mag]", Ticks::Numbers, &|s| Some((s.y_px?, residual(s))), None),
        ];
        for (i, (x_title, y_title, ticks, of, slope)) in panels.into_iter().enumerate() {
            let (column, row) = (i as i32 % 2, i as i32 / 2);
            let (left, top) = (170 + 950 * column, 170 + 590 * row);
            let frame = (left, top, left + 740, top + 450);
            let points: Vec<(bool, f64, f64)> =
                stars.iter().filter_map(|s| of(s).map(|(x, y)| (s.used, x, y))).collect();
            let line = slope.map_or((0.0, 0.0), |slope| (zp, slope));
            draw_panel(sheet, frame, &points, (x_title, y_title, ticks), line)?;
        }
        draw_pointings(sheet, (170, 1940, 1860, 2390), &stars)
    })
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

/// The offsets of the pointings: a cloud is one that its error bar does not explain.
fn draw_pointings(sheet: &Sheet, frame: (i32, i32, i32, i32), stars: &[Star]) -> Drawn {
    let means = pointing_means(stars);
    let x = Span::around(means.iter().map(|m| m.0), 4.0);
    let y = Span::around(means.iter().flat_map(|m| [m.1 - m.2, m.1 + m.2, 0.0]), 0.02);
    let (Some(x), Some(y)) = (x, y) else {
        let middle = ((frame.0 + frame.2) / 2, (frame.1 + frame.3) / 2);
        let text = "no used star has a pointing";
        return write_text(sheet, text, middle, LABEL, GREY, (HPos::Center, VPos::Center));
    };
    let panel = Panel { sheet, frame, x, y };
    panel.axes(Ticks::Numbers, "number of the pointing", "mean residual [mag]")?;
    panel.polyline(&[(x.from, Some(0.0)), (x.to, Some(0.0))], INK, 4)?;
    for (number, mean, error) in means {
        panel.error_bar(number, mean, error, PURPLE)?;
        panel.mark(Mark::Full, number, mean, PURPLE)?;
    }
    Ok(())
}

fn star(row: &StarRow, midnight: f64, (zp, k, c): (f64, f64, f64)) -> Option<Star> {
    let finite = |v: Option<f64>| v.filter(|v| v.is_finite());
    // A term the fit leaves out needs no value.
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
    })
}

/// Title, the fitted numbers, and what the marks mean.
fn heading(sheet: &Sheet, stars: &[Star], used: &[f64], (zp, k, c): (f64, f64, f64)) -> Drawn {
    let left = (HPos::Left, VPos::Center);
    write_text(sheet, NAME, (40, 26), TITLE, INK, (HPos::Left, VPos::Top))?;
    let scatter = scatter(used).map(|s| format!(" · robust σ {s:.3} mag")).unwrap_or_default();
    let fit = signed(&format!("ZP {zp:.3} · k {k:.3} · C {c:.3}{scatter}"));
    write_text(sheet, &fit, (1880, 46), LABEL, INK, (HPos::Right, VPos::Center))?;
    draw_mark(sheet, Mark::Dot, (60, 116), BLUE)?;
    write_text(sheet, &format!("used ({})", used.len()), (82, 116), SMALL, INK, left)?;
    draw_mark(sheet, Mark::Open, (320, 116), VERMILLION)?;
    write_text(sheet, &format!("rejected ({})", stars.len() - used.len()), (342, 116), SMALL, INK, left)?;
    draw_mark(sheet, Mark::Line(4), (640, 116), INK)?;
    write_text(sheet, "fit", (676, 116), SMALL, INK, left)?;
    draw_mark(sheet, Mark::Full, (800, 116), PURPLE)?;
    write_text(sheet, "mean of a pointing", (822, 116), SMALL, INK, left)?;
    write_text(sheet, "△ rejected, beyond the axis", (1880, 116), SMALL, GREY, (HPos::Right, VPos::Center))
}

/// One panel: rejected stars below, used stars above, the line `offset + slope·x` on top.
fn draw_panel(
    sheet: &Sheet,
    frame: (i32, i32, i32, i32),
    points: &[(bool, f64, f64)],
    (x_title, y_title, ticks): (&str, &str, Ticks),
    (offset, slope): (f64, f64),
) -> Drawn {
    let any_used = points.iter().any(|p| p.0);
    let chosen = points.iter().filter(|p| p.0 || !any_used);
    let (least_x, room) = if ticks == Ticks::Clock { (60.0, 0.1) } else { (0.1, 0.1) };
    let x = Span::around(points.iter().map(|p| p.1), least_x);
    let y = Span::around(chosen.flat_map(|p| [p.2, offset + slope * p.1]), room);
    let (Some(x), Some(y)) = (x, y) else {
        let middle = ((frame.0 + frame.2) / 2, (frame.1 + frame.3) / 2);
        return write_text(
            sheet,
            &format!("no data against {x_title}"),
            middle,
            LABEL,
            GREY,
            (HPos::Center, VPos::Center),
        );
    };
    let panel = Panel { sheet, frame, x, y };
    panel.axes(ticks, x_title, y_title)?;
    for (_, x, y) in points.iter().filter(|p| !p.0) {
        panel.mark(Mark::Open, *x, *y, VERMILLION)?;
    }
    for (_, x, y) in points.iter().filter(|p| p.0) {
        panel.mark(Mark::Dot, *x, *y, BLUE)?;
    }
    panel.polyline(&[(x.from, Some(offset + slope * x.from)), (x.to, Some(offset + slope * x.to))], INK, 4)
}
