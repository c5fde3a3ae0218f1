//! Effective surface brightness of trails against area, as published and corrected, with a survey's limits.
//!
//! lg m² to the right, mag/arcsec² with bright upwards, the effective exposure time along the top. A band is the range of
//! heights of orbits at one surface brightness; marks are the rows of the table.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    BLUE, Colour, GREEN, GREY, HPos, INK, LABEL, Mark, ORANGE, PURPLE, SKY_BLUE, SMALL, Sheet, Style, VERMILLION, VPos,
    draw_mark, figure, heading, legend, no_data, signed, write_text,
};
use super::panel::{Panel, Ticks};
use crate::base::error::Result;
use crate::tables::StreakRow;

/// Shown size \[px\].
const SIZE: (u32, u32) = (960, 745);
/// Frames of the two panels \[drawn px\].
const FRAMES: [(i32, i32, i32, i32); 2] = [(180, 250, 990, 1080), (1070, 250, 1880, 1080)];
/// Marks of the satellites, in the order of the rows.
const MARKS: [(Mark, Colour); 8] = [
    (Mark::Full, BLUE),
    (Mark::Square, SKY_BLUE),
    (Mark::Diamond, GREEN),
    (Mark::Up, VERMILLION),
    (Mark::Down, PURPLE),
    (Mark::Square, ORANGE),
    (Mark::Open, INK),
    (Mark::Diamond, INK),
];

/// One area of the bands: effective surface brightness at the two ends of the range of heights, and the trail's limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreakBand {
    /// Area \[m²\].
    pub area_m2: f64,
    /// As published \[mag/arcsec²\].
    pub published: [f64; 2],
    /// Corrected \[mag/arcsec²\].
    pub corrected: [f64; 2],
    /// 5 σ limit over the whole trail \[mag/arcsec²\], in the band of the curves.
    pub trail_limit: f64,
    /// Effective exposure time at the middle of the range \[s\].
    pub t_eff_s: f64,
}

/// Draws the two panels; `band_label` says what the bands are of.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn streak(path: &Path, title: &str, rows: &[StreakRow], bands: &[StreakBand], band_label: &str) -> Result<()> {
    let lit: Vec<&StreakRow> = rows.iter().filter(|r| r.v_mag.is_some()).collect();
    let areas = bands.iter().map(|b| b.area_m2.log10());
    let limits = rows.iter().flat_map(|r| [r.limit_point_mag, r.limit_mag_arcsec2 - r.colour_mag]);
    let nus = bands.iter().flat_map(|b| b.published.into_iter().chain(b.corrected)).chain(limits);
    let (Some(x), Some(y), Some(first)) = (Span::around(areas, 1.0), Span::around(nus, 1.0), rows.first()) else {
        return no_data(path, SIZE, title, "no satellite");
    };
    let limits = [
        (VERMILLION, first.limit_point_mag, format!("{} 5σ point source, as the paper compares", first.filter)),
        (GREEN, first.limit_mag_arcsec2 - first.colour_mag, format!("{} 5σ over 1 arcsec², in V", first.filter)),
    ];
    figure(path, SIZE, |sheet| {
        heading(sheet, title);
        for (k, frame) in FRAMES.into_iter().enumerate() {
            let panel = Panel { sheet, frame, x, y: y.reversed() };
            let curve: Vec<(f64, f64, f64)> = bands
                .iter()
                .map(|b| {
                    let [a, c] = if k == 0 { b.published } else { b.corrected };
                    (b.area_m2.log10(), a, c)
                })
                .collect();
            panel.axes(
                Ticks::Numbers,
                "lg area [m²]",
                if k == 0 { "effective surface brightness ν [V mag/arcsec²]" } else { "" },
            );
            panel.band(&curve, BLUE);
            for end in [|c: &(f64, f64, f64)| c.1, |c: &(f64, f64, f64)| c.2] {
                let edge: Vec<(f64, Option<f64>)> = curve.iter().map(|c| (c.0, Some(end(c)))).collect();
                panel.polyline(&edge, BLUE, 2);
            }
            let (colour, limit, _) = &limits[k];
            panel.across(*limit, *colour, 4);
            if k == 1 {
                let trail: Vec<(f64, Option<f64>)> =
                    bands.iter().map(|b| (b.area_m2.log10(), Some(b.trail_limit))).collect();
                panel.polyline(&trail, GREY, 4);
            }
            for (row, (mark, colour)) in lit.iter().zip(MARKS.iter().cycle()) {
                let nu = if k == 0 { row.nu_published_mag_arcsec2 } else { row.nu_corrected_mag_arcsec2 };
                if let Some(nu) = nu.filter(|_| x.holds(row.area_m2.log10())) {
                    panel.mark(*mark, row.area_m2.log10(), nu, *colour);
                }
            }
            times(sheet, &panel, bands);
            let name = if k == 0 { "as published" } else { "corrected" };
            write_text(sheet, name, (frame.0 + 20, frame.1 + 16), LABEL, INK, (HPos::Left, VPos::Top));
        }
        below(sheet, &lit, &limits.map(|(colour, _, text)| (colour, text)), band_label)
    })
}

/// The effective exposure time along the top of a panel: round times where the bands have them.
fn times(sheet: &Sheet, panel: &Panel, bands: &[StreakBand]) {
    let (left, top, right, _) = panel.frame;
    for power in -6..=3 {
        let wanted = f64::from(power);
        let Some(at) = bands.windows(2).find_map(|w| {
            let (a, b) = (w[0].t_eff_s.log10(), w[1].t_eff_s.log10());
            let along = (wanted - a) / (b - a);
            let between = |s: f64| w[0].area_m2.log10() + s * (w[1].area_m2.log10() - w[0].area_m2.log10());
            (0.0..=1.0).contains(&along).then(|| between(along))
        }) else {
            continue;
        };
        let x = panel.px(at);
        sheet.line((x, top - 8), (x, top), &Style::line(INK, 2));
        let label = match power {
            -6..=-4 => format!("{:.0} µs", 10f64.powi(power + 6)),
            -3..=-1 => format!("{:.0} ms", 10f64.powi(power + 3)),
            _ => format!("{:.0} s", 10f64.powi(power)),
        };
        write_text(sheet, &label, (x, top - 14), SMALL, INK, (HPos::Center, VPos::Bottom));
    }
    let title = "effective exposure time of the satellite's own width";
    write_text(sheet, title, ((left + right) / 2, top - 60), LABEL, INK, (HPos::Center, VPos::Bottom))
}

/// The legends under the panels: satellites to the left in two columns, lines to the right.
fn below(sheet: &Sheet, lit: &[&StreakRow], limits: &[(Colour, String); 2], band_label: &str) {
    let y = FRAMES[0].3 + 160;
    for (i, (row, (mark, colour))) in lit.iter().zip(MARKS.iter().cycle()).enumerate().take(12) {
        let at = (FRAMES[0].0 + 380 * (i / 4) as i32, y + 42 * (i % 4) as i32);
        draw_mark(sheet, *mark, (at.0 + 20, at.1), *colour);
        write_text(sheet, &row.object_name, (at.0 + 54, at.1), SMALL, INK, (HPos::Left, VPos::Center));
    }
    let [(point, point_text), (square, square_text)] = limits;
    let entries = [
        (Some((Mark::Band, BLUE)), signed(band_label)),
        (Some((Mark::Line(4), *point)), point_text.clone()),
        (Some((Mark::Line(4), *square)), square_text.clone()),
        (Some((Mark::Line(4), GREY)), "5σ over the whole trail, in V".to_owned()),
    ];
    legend(sheet, (FRAMES[1].0 - 60, y), &entries);
    let note =
        "ν of the survey's exposure; satellites in the zenith; a trail is seen where its mark stands above the line";
    write_text(sheet, note, (FRAMES[0].0, y + 190), SMALL, GREY, (HPos::Left, VPos::Center))
}
