//! A day of a satellite: the median over the sky with its spread and the error of a prediction, each light, observed passes as violins; Sun and Moon.
//!
//! Magnitudes upwards to brighter, UTC to the right. Nothing is drawn where nothing is lit.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    BLUE, Colour, GREEN, GREY, HPos, INK, Mark, ORANGE, PURPLE, SKY_BLUE, SMALL, VERMILLION, VPos, draw_mark, figure,
    heading, legend, no_data, write_text,
};
use super::panel::{Panel, Ticks};
use crate::base::error::Result;
use crate::figures::density::density;
use crate::tables::DayRow;

/// Shown size \[px\].
const SIZE: (u32, u32) = (960, 780);
/// Half the width of a violin where it is widest \[drawn px\].
const VIOLIN: f64 = 24.0;
/// Lights further below the faintest median than this leave the figure \[mag\].
const LIGHTS_BELOW_MAG: f64 = 2.0;

/// A light of the day: its name, colour and median in a row.
type Light = (&'static str, Colour, fn(&DayRow) -> Option<f64>);

const LIGHTS: [Light; 4] = [
    ("Sunlight", ORANGE, |r| r.sun_v_mag),
    ("Earthshine", GREEN, |r| r.earthshine_v_mag),
    ("Moonlight", SKY_BLUE, |r| r.moon_v_mag),
    ("Lunar-Earthshine", PURPLE, |r| r.lunar_earthshine_v_mag),
];

/// An observed pass: when, and its magnitudes.
#[derive(Debug, Clone, PartialEq)]
pub struct Violin {
    /// MJD (UTC), within the day \[d\].
    pub mjd_d: f64,
    /// Observed magnitudes \[mag\].
    pub v_mag: Vec<f64>,
    /// Their median \[mag\].
    pub median_mag: f64,
}

/// Draws a day from the rows of its table and the passes observed.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn day(path: &Path, rows: &[DayRow], violins: &[Violin], title: &str) -> Result<()> {
    let medians = || rows.iter().filter_map(|r| r.model_v_mag);
    let Some(faintest) = medians().reduce(f64::max).map(|v| v + LIGHTS_BELOW_MAG) else {
        return no_data(path, SIZE, title, "nothing is lit at any moment");
    };
    let within = |r: &DayRow| Some((r.model_v_mag? - r.v_pred_err_mag?, r.model_v_mag? + r.v_pred_err_mag?));
    let within_mag = rows.iter().filter_map(within).flat_map(|(low, high)| [low, high]);
    let spread = rows.iter().flat_map(|r| [r.model_v_p16_mag, r.model_v_p84_mag]).flatten();
    let seen = violins.iter().flat_map(|v| v.v_mag.iter().copied());
    let lights = rows.iter().flat_map(|r| LIGHTS.iter().filter_map(|(_, _, of)| of(r))).filter(|v| *v <= faintest);
    let y = Span::around(spread.chain(medians()).chain(within_mag).chain(seen).chain(lights), 1.0).map(Span::reversed);
    let midnight = rows.first().map_or(0.0, |r| r.mjd_mid_d.floor());
    let second = |mjd_d: f64| (mjd_d - midnight) * 86_400.0;
    let ends = (rows.first().map(|r| second(r.mjd_mid_d)), rows.last().map(|r| second(r.mjd_mid_d)));
    let (Some(y), (Some(from), Some(to))) = (y, ends) else {
        return no_data(path, SIZE, title, "no moment");
    };
    let x = Span { from, to: to.max(from + 1.0) };
    figure(path, SIZE, |sheet| {
        heading(sheet, title);
        let panel = Panel { sheet, frame: (170, 110, 1480, 980), x, y };
        panel.axes(Ticks::Hours, "", "V [mag], median over the sky");
        let curve = |of: fn(&DayRow) -> Option<f64>| -> Vec<(f64, Option<f64>)> {
            rows.iter().map(|r| (second(r.mjd_mid_d), of(r))).collect()
        };
        for run in rows.split(|r| within(r).is_none()) {
            let limits = |r: &DayRow| within(r).map(|(low, high)| (second(r.mjd_mid_d), low, high));
            panel.band(&run.iter().filter_map(limits).collect::<Vec<_>>(), GREY);
        }
        for run in rows.split(|r| r.model_v_p16_mag.is_none()) {
            let band: Vec<(f64, f64, f64)> = run
                .iter()
                .filter_map(|r| Some((second(r.mjd_mid_d), r.model_v_p16_mag?, r.model_v_p84_mag?)))
                .collect();
            panel.band(&band, BLUE);
        }
        let mut entries = vec![
            (Some((Mark::Line(7), BLUE)), "all four lights".to_string()),
            (Some((Mark::Band, BLUE)), "16 to 84 % of the sky".to_string()),
        ];
        if rows.iter().any(|r| within(r).is_some()) {
            entries.push((Some((Mark::Band, GREY)), "68 % of observations".to_string()));
        }
        for (name, colour, of) in LIGHTS {
            let line = curve(of);
            if line.iter().any(|p| p.1.is_some_and(|v| y.holds(v))) {
                panel.polyline(&line, colour, 3);
                entries.push((Some((Mark::Line(3), colour)), format!("{name} alone")));
            }
        }
        panel.polyline(&curve(|r| r.model_v_mag), BLUE, 7);
        for violin in violins {
            draw_violin(&panel, second(violin.mjd_d), violin);
        }
        if !violins.is_empty() {
            entries.push((Some((Mark::Swatch, GREY)), "observed pass".into()));
            entries.push((Some((Mark::Diamond, VERMILLION)), "its median".into()));
        }
        legend(sheet, (1510, 140), &entries);
        let below = Panel { sheet, frame: (170, 1030, 1480, 1420), x, y: Span { from: -90.0, to: 90.0 } };
        below.axes(Ticks::Hours, "UTC", "altitude [deg]");
        below.across(0.0, INK, 1);
        below.polyline(&curve(|r| Some(r.sun_alt_deg)), ORANGE, 5);
        below.polyline(&curve(|r| Some(r.moon_alt_deg)), GREY, 5);
        let middle = rows.get(rows.len() / 2);
        let phase = middle.map_or(String::new(), |r| format!("Moon, {:.0} % lit", r.moon_illum_pct));
        legend(
            sheet,
            (1510, 1060),
            &[(Some((Mark::Line(5), ORANGE)), "Sun".into()), (Some((Mark::Line(5), GREY)), phase)],
        )
    })
}

/// The density of the magnitudes of a pass on both sides of its time, Gaussian kernels of Silverman's width; a pass of
/// fewer than eight is its points.
fn draw_violin(panel: &Panel, second: f64, violin: &Violin) {
    let x = panel.px(second);
    let places = density(&violin.v_mag);
    if places.is_empty() {
        for v in &violin.v_mag {
            panel.mark(Mark::Full, second, *v, GREY);
        }
    } else {
        panel.violin(second, VIOLIN, &places, GREY.into(), "");
    }
    if panel.y.holds(violin.median_mag) {
        draw_mark(panel.sheet, Mark::Diamond, (x, panel.py(violin.median_mag)), VERMILLION);
        let text = format!("{:.1}", violin.median_mag);
        write_text(
            panel.sheet,
            &super::canvas::signed(&text),
            (x + 30.0, panel.py(violin.median_mag)),
            SMALL,
            INK,
            (HPos::Left, VPos::Center),
        );
    }
}
