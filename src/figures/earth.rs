//! The Earth under a lamp: its radiance in colours, the coasts, where the lamp stands in the zenith and where it sets.
//!
//! Logarithmic colours over three decades below the brightest pixel; darker ground is black.

use std::path::Path;

use plotters::element::{Circle, PathElement, Rectangle};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBAColor, RGBColor, ShapeStyle};

use super::canvas::{Drawn, INK, LABEL, ORANGE, SMALL, Sheet, TITLE, figure_over, signed, write_over, write_text};
use super::viridis;
use crate::base::error::{Error, Result};
use crate::base::file::write_atomic;
use crate::base::vector::{Enu, Vector};
use crate::brightness::earth_view::{EarthPicture, Viewpoint};
use crate::figures::coast::coast;
use crate::figures::raster::Raster;
use crate::orbit::Site;

/// Shown size \[px\].
const SIZE: (u32, u32) = (960, 800);
/// Where the picture is: left, top, right, bottom \[drawn px\].
const FRAME: (i32, i32, i32, i32) = (60, 130, 1_460, 1_530);
/// Decades of radiance shown.
const DECADES: f64 = 3.0;
const WHITE: RGBColor = RGBColor(255, 255, 255);
/// Ground without light.
const DARK: (u8, u8, u8) = (16, 16, 28);

/// What is written beside the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct EarthMark {
    /// `Sun` or `Moon`.
    pub lamp: String,
    /// Longitude and latitude under it \[deg\].
    pub under_deg: (f64, f64),
    /// Points at which it sets, longitude and latitude \[deg\].
    pub terminator_deg: Vec<(f64, f64)>,
    /// Lines of text.
    pub notes: Vec<String>,
}

/// The radiances as colours; white beyond the limb.
#[must_use]
pub fn earth_raster(picture: &EarthPicture) -> Raster {
    let (n, brightest) = (picture.radiance.ncols(), picture.brightest());
    let limb = 2.0 * (0.5 * picture.view.limb_rad()).sin();
    Raster::of((n, n), |column, row| {
        let at = |k: usize| ((k as f64 + 0.5) / n as f64 * 2.0 - 1.0) * picture.half_side;
        if at(column).hypot(at(row)) > limb {
            return (255, 255, 255);
        }
        colour(picture.radiance[[n - 1 - row, column]] / brightest)
    })
}

/// Writes the colours alone as PNG.
///
/// # Errors
/// [`Error::Io`].
pub fn earth(path: &Path, picture: &EarthPicture, title: &str, mark: &EarthMark) -> Result<()> {
    let raster = earth_raster(picture);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return write_atomic(path, &raster.png().map_err(|e| Error::io(path, e))?);
    }
    figure_over(path, SIZE, Some((&raster, FRAME)), |sheet| {
        write_text(sheet, title, (40, 26), TITLE, INK, (HPos::Left, VPos::Top))?;
        graticule(sheet, picture)?;
        for line in coast() {
            polyline(sheet, picture, &line, stroke(WHITE.mix(0.75), 2))?;
        }
        polyline(sheet, picture, &mark.terminator_deg, stroke(ORANGE.mix(1.0), 3))?;
        if let Some(at) = place(picture, mark.under_deg) {
            sheet.draw(&Circle::new(at, 16, stroke(INK.mix(1.0), 11)))?;
            sheet.draw(&Circle::new(at, 16, stroke(ORANGE.mix(1.0), 5)))?;
            write_over(sheet, &mark.lamp, (at.0 + 30, at.1), WHITE, (HPos::Left, VPos::Center))?;
        }
        bar(sheet, picture.brightest())?;
        for (i, note) in mark.notes.iter().chain(&legend(picture, mark)).enumerate() {
            let at = (1_500, 1_010 + 44 * i as i32);
            write_text(sheet, &signed(note), at, SMALL - 3, INK, (HPos::Left, VPos::Center))?;
        }
        Ok(())
    })
}

fn colour(share: f64) -> (u8, u8, u8) {
    if !(share > 0.0) {
        return DARK;
    }
    let lg = 1.0 + share.log10() / DECADES;
    if lg < 0.0 { DARK } else { viridis(lg) }
}

fn stroke(color: RGBAColor, width: u32) -> ShapeStyle {
    ShapeStyle { color, filled: false, stroke_width: width }
}

/// Where a geodetic point is on the sheet; `None` behind the limb.
fn place(picture: &EarthPicture, (lon_deg, lat_deg): (f64, f64)) -> Option<(i32, i32)> {
    // the engine's ground is a sphere: its point is the one with this plumb line
    let plumb = Site::new(lat_deg, lon_deg, 0.0).ok()?.from_enu(&Vector::<Enu>::new(0.0, 0.0, 1.0));
    let view: &Viewpoint = &picture.view;
    let (x, y) = picture.pixel_of(view.ground_point(&plumb)?);
    let scale = f64::from(FRAME.2 - FRAME.0) / picture.radiance.ncols() as f64;
    Some((FRAME.0 + (x * scale).round() as i32, FRAME.3 - (y * scale).round() as i32))
}

/// A line over the ground, broken where it is behind the limb.
fn polyline(sheet: &Sheet, picture: &EarthPicture, points: &[(f64, f64)], style: ShapeStyle) -> Drawn {
    let mut run: Vec<(i32, i32)> = Vec::new();
    for point in points.iter().map(|p| place(picture, *p)).chain([None]) {
        match point {
            Some(at) => run.push(at),
            None => {
                if run.len() > 1 {
                    sheet.draw(&PathElement::new(run.clone(), style))?;
                }
                run.clear();
            }
        }
    }
    Ok(())
}

fn graticule(sheet: &Sheet, picture: &EarthPicture) -> Drawn {
    let style = stroke(WHITE.mix(0.3), 1);
    let every = |from: i32, to: i32, step: usize| (from..=to).step_by(step).map(f64::from);
    for lat in every(-60, 60, 30) {
        polyline(sheet, picture, &every(-180, 180, 2).map(|lon| (lon, lat)).collect::<Vec<_>>(), style)?;
    }
    for lon in every(-180, 150, 30) {
        polyline(sheet, picture, &every(-90, 90, 2).map(|lat| (lon, lat)).collect::<Vec<_>>(), style)?;
    }
    Ok(())
}

/// What orange means, of what is in view.
fn legend(picture: &EarthPicture, mark: &EarthMark) -> Vec<String> {
    let ring = place(picture, mark.under_deg).map(|_| format!("ring: under the {}", mark.lamp));
    let line = mark.terminator_deg.iter().any(|at| place(picture, *at).is_some()).then(|| "line: where it sets".into());
    ring.into_iter().chain(line).collect()
}

/// Radiances for the labels of the bar: 1, and 2 and 5 where there is room, times powers of ten, with their height on it
/// as a share from the faint end.
fn bar_ticks(brightest: f64) -> Vec<(f64, f64)> {
    let (top, low) = (brightest.log10(), brightest.log10() - DECADES);
    let decades = low.floor() as i32..=top.ceil() as i32;
    let values = decades.flat_map(|power| [1.0, 2.0, 5.0].map(|n: f64| n * 10f64.powi(power)));
    values.map(|v| (v, (v.log10() - low) / DECADES)).filter(|(_, share)| (-1e-9..=1.0 + 1e-9).contains(share)).collect()
}

/// The colour bar, bright on top; without light it has nothing to say.
fn bar(sheet: &Sheet, brightest: f64) -> Drawn {
    let (left, right, top, bottom) = (1_520, 1_580, 230, 930);
    let left_centre = (HPos::Left, VPos::Center);
    if !(brightest > 0.0) {
        sheet.draw(&Rectangle::new([(left, top), (right, top + 60)], RGBColor(DARK.0, DARK.1, DARK.2).filled()))?;
        return write_text(sheet, "no lit ground in view", (left, top + 100), SMALL, INK, left_centre);
    }
    write_text(sheet, "radiance", (left, top - 90), LABEL, INK, left_centre)?;
    write_text(sheet, "[W m⁻² sr⁻¹]", (left, top - 48), LABEL, INK, left_centre)?;
    for y in (top..bottom).step_by(5) {
        let share = 1.0 - f64::from(y - top) / f64::from(bottom - top);
        let (r, g, b) = viridis(share);
        sheet.draw(&Rectangle::new([(left, y), (right, y + 6)], RGBColor(r, g, b).filled()))?;
    }
    sheet.draw(&Rectangle::new([(left, top), (right, bottom)], stroke(INK.mix(1.0), 2)))?;
    for (value, share) in bar_ticks(brightest) {
        let y = bottom - (share * f64::from(bottom - top)).round() as i32;
        sheet.draw(&PathElement::new(vec![(right, y), (right + 8, y)], stroke(INK.mix(1.0), 2)))?;
        write_text(sheet, &signed(&format!("{value:.0e}")), (right + 16, y), SMALL, INK, left_centre)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_is_labelled_at_round_radiances_inside_its_three_decades() {
        let ticks = bar_ticks(7.58e-4);
        assert_eq!(
            ticks.iter().map(|t| format!("{:.0e}", t.0)).collect::<Vec<_>>(),
            ["1e-6", "2e-6", "5e-6", "1e-5", "2e-5", "5e-5", "1e-4", "2e-4", "5e-4"]
        );
        assert!(ticks.iter().all(|t| (0.0..=1.0).contains(&t.1)) && ticks.windows(2).all(|p| p[0].1 < p[1].1));
        assert_eq!(bar_ticks(1.0).len(), 10);
    }
}
