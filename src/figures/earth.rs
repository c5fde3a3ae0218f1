//! The Earth under a light source: its radiance in colours, the coasts, where the light source stands in the zenith and
//! where it sets.
//!
//! Logarithmic colours over three decades below the brightest pixel; darker ground is black.

use std::path::Path;

use super::canvas::{
    Colour, HPos, INK, LABEL, ORANGE, Place, SMALL, Sheet, Style, VPos, WHITE, figure_over, heading, signed,
    write_over, write_text,
};
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
/// Ground without light.
const DARK: (u8, u8, u8) = (16, 16, 28);

/// What is written next to the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct EarthMark {
    /// `Sun` or `Moon`.
    pub light_source: String,
    /// Longitude and latitude under it \[deg\].
    pub under_deg: (f64, f64),
    /// Points at which it sets, longitude and latitude \[deg\].
    pub terminator_deg: Vec<(f64, f64)>,
    /// Lines of text.
    pub notes: Vec<String>,
    /// Radiance of the brightest colour \[W m⁻² sr⁻¹\]; `None` = that of the brightest pixel.
    pub brightest: Option<f64>,
}

/// The radiances as colours, the brightest of which is for `brightest`; white beyond the limb.
#[must_use]
pub fn earth_raster(picture: &EarthPicture, brightest: f64) -> Raster {
    let n = picture.radiance.ncols();
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
    let brightest = mark.brightest.unwrap_or_else(|| picture.brightest());
    let raster = earth_raster(picture, brightest);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return write_atomic(path, &raster.png().map_err(|e| Error::io(path, e))?);
    }
    figure_over(path, SIZE, (&raster, FRAME), |sheet| {
        heading(sheet, title);
        graticule(sheet, picture);
        for line in coast() {
            polyline(sheet, picture, &line, &Style::line(WHITE, 2).opacity(0.75));
        }
        polyline(sheet, picture, &mark.terminator_deg, &Style::line(ORANGE, 3));
        if let Some(at) = place(picture, mark.under_deg) {
            sheet.circle(at, 16, &Style::line(INK, 11));
            sheet.circle(at, 16, &Style::line(ORANGE, 5));
            write_over(sheet, &mark.light_source, (at.0 + 30.0, at.1), WHITE, (HPos::Left, VPos::Center));
        }
        bar(sheet, brightest);
        for (i, note) in mark.notes.iter().chain(&legend(picture, mark)).enumerate() {
            let at = (1_500, 1_010 + 44 * i as i32);
            write_text(sheet, &signed(note), at, SMALL - 2.0, INK, (HPos::Left, VPos::Center));
        }
    })
}

fn colour(share: f64) -> (u8, u8, u8) {
    if !(share > 0.0) {
        return DARK;
    }
    let lg = 1.0 + share.log10() / DECADES;
    if lg < 0.0 { DARK } else { viridis(lg) }
}

/// Where a geodetic point is on the sheet; `None` behind the limb.
fn place(picture: &EarthPicture, (lon_deg, lat_deg): (f64, f64)) -> Option<Place> {
    // the engine's ground is a sphere: its point is the one with this plumb line
    let plumb = Site::new(lat_deg, lon_deg, 0.0).ok()?.from_enu(&Vector::<Enu>::new(0.0, 0.0, 1.0));
    let view: &Viewpoint = &picture.view;
    let (x, y) = picture.pixel_of(view.ground_point(&plumb)?);
    let scale = f64::from(FRAME.2 - FRAME.0) / picture.radiance.ncols() as f64;
    Some((f64::from(FRAME.0) + x * scale, f64::from(FRAME.3) - y * scale))
}

/// A line over the ground, broken where it is behind the limb.
fn polyline(sheet: &Sheet, picture: &EarthPicture, points: &[(f64, f64)], style: &Style) {
    let mut run: Vec<Place> = Vec::new();
    for point in points.iter().map(|p| place(picture, *p)).chain([None]) {
        match point {
            Some(at) => run.push(at),
            None => {
                sheet.path(&run, style);
                run.clear();
            }
        }
    }
}

fn graticule(sheet: &Sheet, picture: &EarthPicture) {
    let style = Style::line(WHITE, 1).opacity(0.3);
    let every = |from: i32, to: i32, step: usize| (from..=to).step_by(step).map(f64::from);
    for lat in every(-60, 60, 30) {
        polyline(sheet, picture, &every(-180, 180, 2).map(|lon| (lon, lat)).collect::<Vec<_>>(), &style);
    }
    for lon in every(-180, 150, 30) {
        polyline(sheet, picture, &every(-90, 90, 2).map(|lat| (lon, lat)).collect::<Vec<_>>(), &style);
    }
}

/// What orange means, of what is in view.
fn legend(picture: &EarthPicture, mark: &EarthMark) -> Vec<String> {
    let ring = place(picture, mark.under_deg).map(|_| format!("ring: under the {}", mark.light_source));
    let line = mark.terminator_deg.iter().any(|at| place(picture, *at).is_some()).then(|| "line: where it sets".into());
    ring.into_iter().chain(line).collect()
}

/// Radiances for the labels of the bar: 1, and 2 and 5 where there is room, times powers of ten, with their height on
/// it as a share from the faint end.
fn bar_ticks(brightest: f64) -> Vec<(f64, f64)> {
    let (top, low) = (brightest.log10(), brightest.log10() - DECADES);
    let decades = low.floor() as i32..=top.ceil() as i32;
    let values = decades.flat_map(|power| [1.0, 2.0, 5.0].map(|n: f64| n * 10f64.powi(power)));
    values.map(|v| (v, (v.log10() - low) / DECADES)).filter(|(_, share)| (-1e-9..=1.0 + 1e-9).contains(share)).collect()
}

/// The colour bar, bright on top; without light it has nothing to say.
fn bar(sheet: &Sheet, brightest: f64) {
    let (left, right, top, bottom) = (1_520, 1_580, 230, 930);
    let left_centre = (HPos::Left, VPos::Center);
    if !(brightest > 0.0) {
        sheet.rect((left, top), (right, top + 60), &Style::filled(Colour(DARK.0, DARK.1, DARK.2)));
        return write_text(sheet, "no lit ground in view", (left, top + 100), SMALL, INK, left_centre);
    }
    write_text(sheet, "radiance", (left, top - 90), LABEL, INK, left_centre);
    write_text(sheet, "[W m⁻² sr⁻¹]", (left, top - 48), LABEL, INK, left_centre);
    for y in (top..bottom).step_by(5) {
        let share = 1.0 - f64::from(y - top) / f64::from(bottom - top);
        let (r, g, b) = viridis(share);
        sheet.rect((left, y), (right, y + 6), &Style::filled(Colour(r, g, b)));
    }
    sheet.rect((left, top), (right, bottom), &Style::line(INK, 2));
    for (value, share) in bar_ticks(brightest) {
        let y = bottom - (share * f64::from(bottom - top)).round() as i32;
        sheet.line((right, y), (right + 8, y), &Style::line(INK, 2));
        write_text(sheet, &signed(&format!("{value:.0e}")), (right + 16, y), SMALL, INK, left_centre);
    }
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
