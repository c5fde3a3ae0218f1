//! The sky as a disc: magnitude of a satellite in every direction, zenith in the middle, North up and East left, as one
//! looks up.
//!
//! Equal steps of altitude are equal steps of radius. Cells are filled in steps of magnitude; where there is no light
//! they are grey and hatched. Sun and Moon stand at their place, or on the rim above which they are below the horizon.

use std::path::Path;

use plotters::element::{Circle, PathElement, Polygon, Rectangle};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor, ShapeStyle};

use super::canvas::{Drawn, GREY, INK, LABEL, ORANGE, SMALL, Sheet, TITLE, figure, no_data, signed, write_text};
use crate::base::error::Result;
use crate::tables::SkyRow;

/// Shown size \[px\].
const SIZE: (u32, u32) = (960, 800);
/// The one sky of a map.
const WHOLE: Disc = Disc { centre: (740.0, 830.0), radius: 610.0, small: false };
/// Left end of colour bar and notes.
const ASIDE: i32 = 1610;
/// Between hatch lines, and between samples along them \[drawn px\].
const HATCH: (i32, i32) = (26, 5);
/// No light.
const DARK: RGBColor = RGBColor(214, 214, 214);
/// Most steps of colour.
const MOST_LEVELS: f64 = 50.0;
/// The viridis map (Smith & van der Walt, CC0) at eight equal steps: monotone in lightness for every colour vision.
const VIRIDIS: [(f64, f64, f64); 9] = [
    (68.0, 1.0, 84.0),
    (71.0, 44.0, 122.0),
    (59.0, 81.0, 139.0),
    (44.0, 113.0, 142.0),
    (33.0, 144.0, 141.0),
    (39.0, 173.0, 129.0),
    (92.0, 200.0, 99.0),
    (170.0, 220.0, 50.0),
    (253.0, 231.0, 37.0),
];

/// The colour at a share of the viridis map: 0 = dark violet, 1 = yellow.
pub(crate) fn viridis(share: f64) -> (u8, u8, u8) {
    let at = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let i = (at as usize).min(VIRIDIS.len() - 2);
    let (a, b, t) = (VIRIDIS[i], VIRIDIS[i + 1], at - i as f64);
    let mix = |a: f64, b: f64| (a + t * (b - a)).round() as u8;
    (mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

/// The Sun or the Moon on the map.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyMark {
    /// `Sun` or `Moon`.
    pub name: String,
    /// Altitude \[deg\].
    pub alt_deg: f64,
    /// Azimuth \[deg\].
    pub az_deg: f64,
}

/// Where a sky is on the sheet \[drawn px\].
#[derive(Debug, Clone, Copy)]
pub(super) struct Disc {
    pub centre: (f64, f64),
    pub radius: f64,
    /// One of many: no texts inside, Sun and Moon without their names.
    pub small: bool,
}

/// Steps of magnitude and their colours.
pub(super) struct Levels {
    step_mag: f64,
    /// Number of the brightest and the faintest step.
    ends: (i64, i64),
    /// The last one holds fainter ones too.
    clipped: bool,
}

/// The rows as a grid: altitudes and azimuths in order, and the level of each cell.
pub(super) struct Cells {
    alt_deg: Vec<f64>,
    az_deg: Vec<f64>,
    pub level: Vec<Option<i64>>,
}

/// Draws a map from the rows of its table, altitude running fastest; `notes` are written below the legend.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn sky_map(path: &Path, rows: &[SkyRow], marks: &[SkyMark], title: &str, notes: &[String]) -> Result<()> {
    let Some(levels) = Levels::of(rows) else {
        return no_data(path, SIZE, title, "no direction in which the satellite has any light");
    };
    let cells = Cells::of(rows, &levels);
    figure(path, SIZE, |sheet| {
        write_text(sheet, title, (40, 26), TITLE, INK, (HPos::Left, VPos::Top))?;
        WHOLE.sky(sheet, &cells, &levels, marks)?;
        levels.bar(sheet, ASIDE, cells.level.contains(&None))?;
        for (i, note) in notes.iter().enumerate() {
            write_text(
                sheet,
                &signed(note),
                (ASIDE - 80, 1190 + 44 * i as i32),
                SMALL,
                INK,
                (HPos::Left, VPos::Center),
            )?;
        }
        Ok(())
    })
}

impl Disc {
    /// The cells, the circles of altitude, Sun and Moon.
    pub(super) fn sky(&self, sheet: &Sheet, cells: &Cells, levels: &Levels, marks: &[SkyMark]) -> Drawn {
        cells.fill(sheet, self, levels)?;
        cells.hatch(sheet, self)?;
        self.graticule(sheet)?;
        marks.iter().try_for_each(|mark| self.body(sheet, mark))
    }

    /// Where a direction is on the sheet.
    fn place(&self, alt_deg: f64, az_deg: f64) -> (f64, f64) {
        let r = self.radius * (90.0 - alt_deg) / 90.0;
        let (sin_a, cos_a) = az_deg.to_radians().sin_cos();
        (self.centre.0 - r * sin_a, self.centre.1 - r * cos_a)
    }
}

fn pixel((x, y): (f64, f64)) -> (i32, i32) {
    (x.round() as i32, y.round() as i32)
}

impl Levels {
    /// The finest round step with at most [`MOST_LEVELS`] from the brightest direction to where 1 % are fainter, so that
    /// a few in the penumbra do not take all the colours; `None` without any magnitude.
    pub(super) fn of<'r>(rows: impl IntoIterator<Item = &'r SkyRow>) -> Option<Self> {
        let mut lit: Vec<f64> = rows.into_iter().filter_map(|r| r.model_v_mag).filter(|v| v.is_finite()).collect();
        lit.sort_by(f64::total_cmp);
        let (low, high) = (*lit.first()?, *lit.get((lit.len() - 1) * 99 / 100)?);
        let steps = [0.02, 0.05, 0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 5.0];
        let step_mag = steps.into_iter().find(|s| (high - low) / s <= MOST_LEVELS - 1.0).unwrap_or(10.0);
        let number = |v: f64| (v / step_mag).floor() as i64;
        let clipped = lit.last().is_some_and(|v| number(*v) > number(high));
        Some(Self { step_mag, ends: (number(low), number(high)), clipped })
    }

    fn number(&self, v_mag: f64) -> i64 {
        ((v_mag / self.step_mag).floor() as i64).clamp(self.ends.0, self.ends.1)
    }

    fn count(&self) -> i64 {
        self.ends.1 - self.ends.0 + 1
    }

    /// Bright is yellow, faint is violet.
    fn colour(&self, level: i64) -> RGBColor {
        let share = (level - self.ends.0) as f64 / (self.count() - 1).max(1) as f64;
        let (r, g, b) = viridis(1.0 - share);
        RGBColor(r, g, b)
    }

    /// The colour bar, bright on top, and what grey means.
    pub(super) fn bar(&self, sheet: &Sheet, aside: i32, dark: bool) -> Drawn {
        let (left, right, top, bottom) = (aside, aside + 60, 220, 960);
        let left_centre = (HPos::Left, VPos::Center);
        write_text(sheet, "V [mag]", (left, top - 50), LABEL, INK, left_centre)?;
        let edge = |level: i64| top + ((bottom - top) as i64 * (level - self.ends.0) / self.count()) as i32;
        // labels every 1, 2 or 5 times a power of ten levels
        let every = [1, 2, 4, 5, 10, 20].into_iter().find(|e| self.count() <= 10 * e).unwrap_or(50);
        let decimals = if self.step_mag < 0.1 || self.step_mag == 0.25 { 2 } else { usize::from(self.step_mag < 1.0) };
        for level in self.ends.0..=self.ends.1 {
            let corners = [(left, edge(level)), (right, edge(level + 1))];
            sheet.draw(&Rectangle::new(corners, self.colour(level).filled()))?;
        }
        for level in (self.ends.0..=self.ends.1 + 1).filter(|l| l.rem_euclid(every) == 0) {
            let text = signed(&format!("{:.decimals$}", level as f64 * self.step_mag));
            write_text(sheet, &text, (right + 16, edge(level)), SMALL, INK, left_centre)?;
        }
        sheet.draw(&Rectangle::new([(left, top), (right, bottom)], stroke(INK, 2)))?;
        if self.clipped {
            write_text(sheet, "and fainter", (left, bottom + 26), SMALL, INK, left_centre)?;
        }
        if dark {
            let corners = [(left, bottom + 60), (right, bottom + 100)];
            sheet.draw(&Rectangle::new(corners, DARK.filled()))?;
            for x in (left..right).step_by(20) {
                sheet.draw(&PathElement::new(vec![(x, bottom + 100), (x + 20, bottom + 60)], stroke(GREY, 1)))?;
            }
            sheet.draw(&Rectangle::new(corners, stroke(INK, 1)))?;
            write_text(sheet, "no light", (right + 16, bottom + 80), SMALL, INK, left_centre)?;
        }
        Ok(())
    }
}

impl Cells {
    pub(super) fn of(rows: &[SkyRow], levels: &Levels) -> Self {
        let n_alt = rows.iter().take_while(|r| r.az_deg == rows[0].az_deg).count().max(1);
        Self {
            alt_deg: rows.iter().take(n_alt).map(|r| r.alt_deg).collect(),
            az_deg: rows.iter().step_by(n_alt).map(|r| r.az_deg).collect(),
            level: rows.iter().map(|r| r.model_v_mag.filter(|v| v.is_finite()).map(|v| levels.number(v))).collect(),
        }
    }

    fn level(&self, i: usize, j: usize) -> Option<i64> {
        self.level.get(j * self.alt_deg.len() + i).copied().flatten()
    }

    /// Halfway to the neighbours on both sides; the outermost values end the axis.
    fn edges(values: &[f64], i: usize) -> (f64, f64) {
        let at = |k: usize| values.get(k).copied().unwrap_or(values[i]);
        let from = if i == 0 { values[0] } else { 0.5 * (at(i - 1) + values[i]) };
        (from, if i + 1 == values.len() { values[i] } else { 0.5 * (values[i] + at(i + 1)) })
    }

    /// Rings from the horizon inwards; neighbours of one level are one piece. Pieces reach a little under those drawn
    /// after them, so that no seam shows.
    fn fill(&self, sheet: &Sheet, disc: &Disc, levels: &Levels) -> Drawn {
        for i in 0..self.alt_deg.len() {
            let (low_deg, high_deg) = Self::edges(&self.alt_deg, i);
            let mut start = 0;
            while start < self.az_deg.len() {
                let level = self.level(i, start);
                let end = (start..self.az_deg.len()).take_while(|j| self.level(i, *j) == level).last().unwrap_or(start);
                let (from_deg, to_deg) = (Self::edges(&self.az_deg, start).0, Self::edges(&self.az_deg, end).1);
                let under = if end + 1 < self.az_deg.len() { 0.4 } else { 0.0 };
                let colour = level.map_or(DARK, |level| levels.colour(level));
                disc.sector(sheet, (low_deg, (high_deg + 0.4).min(90.0)), (from_deg, to_deg + under), colour)?;
                start = end + 1;
            }
        }
        Ok(())
    }

    /// Diagonal lines over what has no light.
    fn hatch(&self, sheet: &Sheet, disc: &Disc) -> Drawn {
        let r = disc.radius as i32;
        let (spacing, sample) = HATCH;
        for offset in (-2 * r..=2 * r).step_by(spacing as usize) {
            let mut run: Vec<(i32, i32)> = Vec::new();
            for x in (-r..=r + sample).step_by(sample as usize) {
                let at = (x, offset - x);
                if x <= r && self.is_dark(disc, at) {
                    run.push((at.0 + disc.centre.0 as i32, at.1 + disc.centre.1 as i32));
                    continue;
                }
                if let (Some(a), Some(b)) = (run.first(), run.last()) {
                    sheet.draw(&PathElement::new(vec![*a, *b], stroke(GREY, 1)))?;
                }
                run.clear();
            }
        }
        Ok(())
    }

    /// Whether a place, from the centre of the disc, is in a cell without light.
    fn is_dark(&self, disc: &Disc, (x, y): (i32, i32)) -> bool {
        let (x, y) = (f64::from(x), f64::from(y));
        let alt_deg = 90.0 * (1.0 - x.hypot(y) / disc.radius);
        let az_deg = (-x).atan2(-y).to_degrees().rem_euclid(360.0);
        let nearest = |values: &[f64], v: f64| {
            let off = |i: &usize| (values[*i] - v).abs();
            (0..values.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
        };
        alt_deg >= 0.0 && self.level(nearest(&self.alt_deg, alt_deg), nearest(&self.az_deg, az_deg)).is_none()
    }
}

impl Disc {
    /// A piece of a ring between two altitudes and two azimuths.
    fn sector(&self, sheet: &Sheet, alt_deg: (f64, f64), az_deg: (f64, f64), colour: RGBColor) -> Drawn {
        let steps = ((az_deg.1 - az_deg.0) / 2.0).ceil().max(1.0) as usize;
        let az = |k: usize| az_deg.0 + (az_deg.1 - az_deg.0) * k as f64 / steps as f64;
        let mut outline: Vec<(i32, i32)> = (0..=steps).map(|k| pixel(self.place(alt_deg.0, az(k)))).collect();
        outline.extend((0..=steps).rev().map(|k| pixel(self.place(alt_deg.1, az(k)))));
        outline.dedup();
        sheet.draw(&Polygon::new(outline, colour.filled()))
    }

    /// Horizon, circles of altitude with their degrees, and the points of the compass.
    fn graticule(&self, sheet: &Sheet) -> Drawn {
        let centre = pixel(self.centre);
        let white = RGBColor(255, 255, 255);
        for alt_deg in [30.0, 60.0] {
            let r = (self.radius * (90.0 - alt_deg) / 90.0) as i32;
            sheet.draw(&Circle::new(
                centre,
                r,
                ShapeStyle { color: white.mix(0.8), filled: false, stroke_width: 2 },
            ))?;
            if self.small {
                continue;
            }
            let at = pixel(self.place(alt_deg, 202.0));
            let ground = [(at.0 - 34, at.1 - 20), (at.0 + 34, at.1 + 20)];
            sheet.draw(&Rectangle::new(ground, white.mix(0.75).filled()))?;
            write_text(sheet, &format!("{alt_deg:.0}°"), at, SMALL, INK, (HPos::Center, VPos::Center))?;
        }
        sheet.draw(&Circle::new(centre, self.radius as i32, stroke(INK, 3)))?;
        sheet.draw(&PathElement::new(vec![(centre.0 - 10, centre.1), (centre.0 + 10, centre.1)], stroke(white, 2)))?;
        sheet.draw(&PathElement::new(vec![(centre.0, centre.1 - 10), (centre.0, centre.1 + 10)], stroke(white, 2)))?;
        for (name, az_deg) in [("N", 0.0), ("E", 90.0), ("S", 180.0), ("W", 270.0)] {
            let at = pixel(self.place(-5.5, az_deg));
            write_text(sheet, name, at, LABEL + 4, INK, (HPos::Center, VPos::Center))?;
        }
        Ok(())
    }

    /// Sun or Moon with its altitude: at its place, or open outside the rim in its azimuth when it is below the horizon.
    fn body(&self, sheet: &Sheet, mark: &SkyMark) -> Drawn {
        let up = mark.alt_deg >= 0.0;
        let fill = if mark.name == "Sun" { ORANGE } else { RGBColor(255, 255, 255) };
        let shown = (mark.alt_deg.clamp(0.0, 90.0), mark.az_deg);
        let at = pixel(if up { self.place(shown.0, shown.1) } else { self.place(-5.5, shown.1) });
        if up {
            sheet.draw(&Circle::new(at, 18, fill.filled()))?;
            sheet.draw(&Circle::new(at, 18, stroke(INK, 3)))?;
        } else {
            sheet.draw(&Circle::new(at, 14, RGBColor(255, 255, 255).filled()))?;
            sheet.draw(&Circle::new(at, 14, stroke(if mark.name == "Sun" { ORANGE } else { GREY }, 5)))?;
        }
        if self.small {
            return Ok(());
        }
        let text = signed(&format!("{} {:.1}°", mark.name, mark.alt_deg));
        // below or above the mark, away from the middle, inside the sheet
        let half = 9 * text.chars().count() as i32;
        let x = at.0.clamp(half + 8, sheet.dim_in_pixel().0 as i32 - half);
        let y = at.1 + if f64::from(at.1) < self.centre.1 { -42 } else { 42 };
        let ground = [(x - half, y - 20), (x + half, y + 20)];
        sheet.draw(&Rectangle::new(ground, RGBColor(255, 255, 255).mix(0.75).filled()))?;
        write_text(sheet, &text, (x, y), SMALL, INK, (HPos::Center, VPos::Center))
    }
}

fn stroke(colour: RGBColor, width: u32) -> ShapeStyle {
    ShapeStyle { color: colour.to_rgba(), filled: false, stroke_width: width }
}
