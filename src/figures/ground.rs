//! A map of the ground: day and night, where the Moon is up, a satellite's track, the points under Sun and Moon.
//!
//! Longitude and latitude in equal steps, deg. Twilight fades over 18°.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    BLUE, Colour, GREY, HPos, INK, Mark, ORANGE, SMALL, Style, VERMILLION, VPos, draw_mark, figure_over, heading,
    legend, write_text,
};
use super::panel::{Panel, Ticks};
use crate::base::error::{Error, Result};
use crate::base::file::write_atomic;
use crate::base::vector::{Itrs, Vector};
use crate::figures::coast::coast;
use crate::figures::raster::Raster;
use crate::orbit::ground_track::altitude_deg;

/// Shown size \[px\].
const SIZE: (u32, u32) = (960, 660);
/// The map: left, top, right, bottom \[drawn px\].
const FRAME: (i32, i32, i32, i32) = (160, 110, 1_880, 970);
/// Columns and rows of the shading.
const CELLS: (usize, usize) = (360, 180);
/// Dots of a cell in a PNG.
const ZOOM: usize = 4;
/// Arrows along the track.
const ARROWS: usize = 8;
const DAY: [f64; 3] = [253.0, 246.0, 222.0];
const NIGHT: [f64; 3] = [150.0, 152.0, 164.0];
const MOONLIT: [f64; 3] = [194.0, 204.0, 226.0];

/// What a map shows.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundMap {
    /// Title.
    pub title: String,
    /// The Sun \[km\].
    pub sun_km: Vector<Itrs>,
    /// The Moon \[km\].
    pub moon_km: Vector<Itrs>,
    /// Longitude and latitude under Sun and Moon \[deg\].
    pub under_deg: [(f64, f64); 2],
    /// Where each sets, longitude and latitude \[deg\].
    pub terminators_deg: [Vec<(f64, f64)>; 2],
    /// The track \[deg\].
    pub track_deg: Vec<(f64, f64)>,
    /// The satellite at the moment of the map: name and place \[deg\].
    pub satellite: Option<(String, (f64, f64))>,
    /// An observer: name and place \[deg\].
    pub site: Option<(String, (f64, f64))>,
}

/// Draws the map; as PNG, the map alone without axes and words.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn ground_map(path: &Path, map: &GroundMap) -> Result<()> {
    let raster = shading(map)?;
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return write_atomic(path, &preview(&raster, map).png().map_err(|e| Error::io(path, e))?);
    }
    figure_over(path, SIZE, (&raster, FRAME), |sheet| {
        heading(sheet, &map.title);
        let (x, y) = (Span { from: -180.0, to: 180.0 }, Span { from: -90.0, to: 90.0 });
        let panel = Panel { sheet, frame: FRAME, x, y };
        panel.axes(Ticks::Numbers, "longitude [deg east]", "latitude [deg north]");
        let line = |points: &[(f64, f64)], colour: Colour, width: u32| {
            let broken = broken(points);
            panel.polyline(&broken, colour, width)
        };
        for coast in coast() {
            line(&coast, GREY, 1);
        }
        for (terminator, colour) in map.terminators_deg.iter().zip([ORANGE, BLUE]) {
            line(&closed(terminator), colour, 3);
        }
        line(&map.track_deg, VERMILLION, 4);
        for (at, way) in arrows(&map.track_deg) {
            let (x, y) = (panel.px(at.0), panel.py(at.1));
            let turned = |along: f64, across: f64| {
                let (dx, dy) = (along * way.0 - across * way.1, along * way.1 + across * way.0);
                (x + dx, y - dy)
            };
            let head = [turned(15.0, 0.0), turned(-11.0, 11.0), turned(-11.0, -11.0)];
            sheet.polygon(&head, &Style::filled(VERMILLION));
        }
        let track = "track, arrows forward in time";
        let mut entries = vec![(Some((Mark::Line(4), VERMILLION)), track.to_owned())];
        let mark = |kind: Mark, at: (f64, f64), colour: Colour, text: &str, below: bool| {
            let px = (panel.px(at.0), panel.py(at.1));
            draw_mark(sheet, kind, px, colour);
            let (side, shift) = if at.0 > 130.0 { (HPos::Right, -18.0) } else { (HPos::Left, 18.0) };
            // inside the frame at the poles
            let below = px.1 - 44.0 < f64::from(FRAME.1) || (below && px.1 + 48.0 < f64::from(FRAME.3));
            let off = if below { 26.0 } else { -22.0 };
            write_text(sheet, text, (px.0 + shift, px.1 + off), SMALL, INK, (side, VPos::Center))
        };
        if let Some((name, at)) = &map.site {
            mark(Mark::Square, *at, INK, name, false);
        }
        if let Some((name, at)) = &map.satellite {
            mark(Mark::Diamond, *at, VERMILLION, name, true);
        }
        mark(Mark::Full, map.under_deg[0], ORANGE, "Sun", false);
        mark(Mark::Full, map.under_deg[1], BLUE, "Moon", false);
        entries.push((Some((Mark::Line(3), ORANGE)), "Sun sets or rises".into()));
        entries.push((Some((Mark::Line(3), BLUE)), "Moon sets or rises".into()));
        let ground = |c: [f64; 3]| Colour(c[0] as u8, c[1] as u8, c[2] as u8);
        legend(sheet, (160, 1_110), &entries);
        legend(
            sheet,
            (760, 1_110),
            &[
                (Some((Mark::Swatch, ground(DAY))), "Sun up; fading over 18° of twilight".into()),
                (Some((Mark::Swatch, ground(MOONLIT))), "night, Moon up".into()),
                (Some((Mark::Swatch, ground(NIGHT))), "night, no Moon".into()),
            ],
        );
        let note = "coasts: Natural Earth";
        write_text(sheet, note, (1_880, 1_290), SMALL - 5.0, GREY, (HPos::Right, VPos::Center))
    })
}

/// Day, night and moonlit night, cell by cell.
fn shading(map: &GroundMap) -> Result<Raster> {
    let (nx, ny) = CELLS;
    let mut colours = Vec::with_capacity(nx * ny);
    for row in 0..ny {
        let lat = 90.0 - (row as f64 + 0.5) * 180.0 / ny as f64;
        for column in 0..nx {
            let lon = (column as f64 + 0.5) * 360.0 / nx as f64 - 180.0;
            let sun = altitude_deg(lon, lat, &map.sun_km)?;
            let moon = altitude_deg(lon, lat, &map.moon_km)?;
            let night = if moon > 0.0 { MOONLIT } else { NIGHT };
            let day = (1.0 + sun / 18.0).clamp(0.0, 1.0);
            let mix = |k: usize| (night[k] + day * (DAY[k] - night[k])).round() as u8;
            colours.push((mix(0), mix(1), mix(2)));
        }
    }
    Ok(Raster::of(CELLS, |column, row| colours[row * nx + column]))
}

/// The map without words, [`ZOOM`] dots a cell.
fn preview(shading: &Raster, map: &GroundMap) -> Raster {
    let dots = (CELLS.0 * ZOOM, CELLS.1 * ZOOM);
    let mut picture = Raster::of(dots, |column, row| shading.at(column / ZOOM, row / ZOOM));
    let scale = dots.0 as f64 / 360.0;
    let dot = |(lon, lat): (f64, f64)| ((lon + 180.0) * scale, (90.0 - lat) * scale);
    let mut line = |points: &[(f64, f64)], colour: Colour, width: usize| {
        for pair in broken(points).windows(2) {
            if let (Some(a), Some(b)) = (pair[0].1, pair[1].1) {
                picture.line(dot((pair[0].0, a)), dot((pair[1].0, b)), colour.rgb(), width);
            }
        }
    };
    coast().iter().for_each(|coast| line(coast, GREY, 1));
    for (terminator, colour) in map.terminators_deg.iter().zip([ORANGE, BLUE]) {
        line(&closed(terminator), colour, 2);
    }
    line(&map.track_deg, VERMILLION, 3);
    let site = map.site.iter().map(|(_, at)| (*at, INK));
    let satellite = map.satellite.iter().map(|(_, at)| (*at, VERMILLION));
    for (at, colour) in site.chain(satellite).chain(map.under_deg.into_iter().zip([ORANGE, BLUE])) {
        picture.line(dot(at), dot(at), INK.rgb(), 13);
        picture.line(dot(at), dot(at), colour.rgb(), 9);
    }
    picture
}

/// Heads of arrows along a track: a place, and the direction there as a unit vector with y up. Steps are equal in time.
fn arrows(track: &[(f64, f64)]) -> Vec<((f64, f64), (f64, f64))> {
    let every = (track.len() / ARROWS).max(1);
    let head = |i: usize| {
        let (a, b) = (track[i - 1], track[i]);
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let length = dx.hypot(dy);
        // none over the edge of the map, or where the satellite stands still
        (dx.abs() < 180.0 && length > 1e-6).then(|| (b, (dx / length, dy / length)))
    };
    (1..track.len()).filter(|i| (*i + every / 2).is_multiple_of(every)).filter_map(head).collect()
}

/// A closed line: its first point again at its end.
fn closed(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    points.iter().chain(points.first()).copied().collect()
}

/// A line broken where it leaves one side of the map for the other, drawn up to both edges.
fn broken(points: &[(f64, f64)]) -> Vec<(f64, Option<f64>)> {
    let mut out: Vec<(f64, Option<f64>)> = Vec::new();
    for (i, (lon, lat)) in points.iter().enumerate() {
        if i > 0 && (lon - points[i - 1].0).abs() > 180.0 {
            let (before, edge) = (points[i - 1], if points[i - 1].0 > 0.0 { 180.0 } else { -180.0 });
            let way = lon + 2.0 * edge - before.0;
            let share = if way == 0.0 { 0.5 } else { ((edge - before.0) / way).clamp(0.0, 1.0) };
            let at = before.1 + share * (lat - before.1);
            out.extend([(edge, Some(at)), (edge, None), (-edge, Some(at))]);
        }
        out.push((*lon, Some(*lat)));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrows_point_forward_and_none_over_the_edge() {
        let track: Vec<(f64, f64)> =
            (0..80).map(|i| ((100.0 + 2.0 * f64::from(i) + 180.0) % 360.0 - 180.0, 0.0)).collect();
        let heads = arrows(&track);
        assert!((7..=9).contains(&heads.len()) && heads.iter().all(|(_, way)| *way == (1.0, 0.0)), "{heads:?}");
        assert!(arrows(&[(0.0, 0.0); 9]).is_empty() && arrows(&[]).is_empty());
    }

    #[test]
    fn a_line_is_broken_at_the_edge_of_the_map_alone() {
        let line = broken(&[(170.0, 1.0), (179.0, 2.0), (-179.0, 3.0), (-170.0, 4.0)]);
        assert_eq!(line.iter().filter(|p| p.1.is_none()).count(), 1);
        // half the way from 179 to 181 degrees
        assert_eq!(line[2..5], [(180.0, Some(2.5)), (180.0, None), (-180.0, Some(2.5))]);
        assert_eq!(closed(&[(1.0, 2.0), (3.0, 4.0)]).len(), 3);
    }
}
