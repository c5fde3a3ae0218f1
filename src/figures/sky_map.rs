//! The sky as a disc: magnitude of a satellite in every direction, zenith in the middle, North up and East left, as one
//! looks up.
//!
//! Equal steps of altitude are equal steps of radius. Cells are filled in steps of magnitude; where there is no light
//! they are grey and hatched. Sun and Moon stand at their place, or on the edge above which they are below the horizon.

use std::path::Path;

use super::canvas::{
    Colour, GREY, HPos, INK, LABEL, Medium, ORANGE, PALE, Place, SMALL, Sheet, Style, VPos, WHITE, figure, heading,
    no_data, signed, write_text,
};
use super::interaction::Interaction;
use crate::base::error::Result;
use crate::tables::{PhotometryRow, SkyRow};

/// Shown size \[px\].
const SIZE: (u32, u32) = (960, 800);
/// The one sky of a map.
const WHOLE: Disc = Disc { centre: (740.0, 830.0), radius: 610.0, unit: 1.0, degrees: true, names: true };
/// Left end of colour bar and notes.
const ASIDE: i32 = 1610;
/// Between hatch lines, and between samples along them, in units of a disc.
const HATCH: (f64, f64) = (26.0, 5.0);
/// Shown side of the disc of a pass, and its radius \[px\].
const PASS: (f64, f64) = (348.0, 150.0);
/// Shown size of the bar of colours below discs of passes, and of what is coloured of it \[px\].
const ACROSS: (f64, f64) = (510.0, 330.0);
/// No light.
const DARK: Colour = Colour(214, 214, 214);
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
    /// Size of marks: 1 in a file.
    pub unit: f64,
    /// The circles of altitude are labelled.
    pub degrees: bool,
    /// Sun and Moon are named.
    pub names: bool,
}

/// Steps of magnitude and their colours.
pub(crate) struct Levels {
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
        heading(sheet, title);
        WHOLE.sky(sheet, &cells, &levels, marks, &[]);
        levels.bar(sheet, ASIDE, cells.level.contains(&None));
        for (i, note) in notes.iter().enumerate() {
            write_text(
                sheet,
                &signed(note),
                (ASIDE - 80, 1190 + 44 * i as i32),
                SMALL,
                INK,
                (HPos::Left, VPos::Center),
            );
        }
    })
}

impl Disc {
    /// The cells, the circles of altitude, Sun and Moon, whose names keep off the places of `avoid`.
    pub(super) fn sky(&self, sheet: &Sheet, cells: &Cells, levels: &Levels, marks: &[SkyMark], avoid: &[Place]) {
        sheet.circle(self.centre, self.radius, &Style::filled(PALE).class("ground", ""));
        cells.fill(sheet, self, levels);
        cells.hatch(sheet, self);
        self.graticule(sheet);
        marks.iter().for_each(|mark| self.body(sheet, mark, avoid));
    }

    /// Next to the horizon, outside.
    fn outside(&self, az_deg: f64) -> Place {
        self.place(-90.0 * (0.061 * self.radius).max(33.0 * self.unit) / self.radius, az_deg)
    }

    /// Where a direction is on the sheet.
    pub(super) fn place(&self, alt_deg: f64, az_deg: f64) -> (f64, f64) {
        let r = self.radius * (90.0 - alt_deg) / 90.0;
        let (sin_a, cos_a) = az_deg.to_radians().sin_cos();
        (self.centre.0 - r * sin_a, self.centre.1 - r * cos_a)
    }
}

/// The sky of one pass: its model, empty without one; its frames; Sun and Moon.
pub(crate) struct PassDisc<'a> {
    pub cells: &'a [SkyRow],
    pub track: &'a [PhotometryRow],
    pub marks: &'a [SkyMark],
}

impl PassDisc<'_> {
    /// The disc with the frames on it, coloured by their magnitudes, and an arrow in the direction of motion.
    pub(crate) fn draw(&self, medium: Medium, levels: Option<&Levels>, interaction: &Interaction) -> Sheet {
        let (unit, scale) = if medium == Medium::Page { (0.46, 1.0) } else { (0.92, 2.0) };
        let side = scale * PASS.0;
        let sheet = Sheet::new(medium, (side, side));
        let disc = Disc { centre: (0.5 * side, 0.5 * side), radius: scale * PASS.1, unit, degrees: false, names: true };
        let none = Levels { step_mag: 1.0, ends: (0, 0), clipped: false };
        let cells = Cells::of(self.cells, levels.unwrap_or(&none));
        let dots: Vec<(&PhotometryRow, Place)> = self
            .track
            .iter()
            .filter_map(|row| Some((row, disc.place(row.alt_deg?.clamp(0.0, 90.0), row.az_deg?))))
            .collect();
        let way: Vec<Place> = dots.iter().map(|d| d.1).collect();
        disc.sky(&sheet, &cells, levels.unwrap_or(&none), self.marks, &way);
        sheet.path(&way, &Style::line(WHITE, 2.0 * unit).class("track", ""));
        for (row, at) in &dots {
            let style = Style::line(WHITE, 2.6 * unit).class("seen", "").tip(&(interaction.tip)(row));
            let v_mag = row.v_mag.filter(|v| v.is_finite());
            let style = match levels.zip(v_mag) {
                Some((levels, v)) => {
                    let colour = levels.colour(levels.number(v));
                    style.fill(colour).property("fill", Some(&colour.hex()))
                }
                None => style.property("fill", Some("none")),
            };
            sheet.link((interaction.link)(row).as_deref(), false, || sheet.circle(*at, 9.0 * unit, &style));
        }
        if let [.., a, b] = way.as_slice() {
            let (dx, dy) = (b.0 - a.0, b.1 - a.1);
            let length = dx.hypot(dy);
            if length > 0.0 {
                let turned = |along: f64, across: f64| {
                    let (along, across) = (unit * along / length, unit * across / length);
                    (b.0 + along * dx - across * dy, b.1 + along * dy + across * dx)
                };
                let head =
                    [turned(13.0, 0.0), turned(37.0, 0.0), turned(24.0, -11.0), turned(37.0, 0.0), turned(24.0, 11.0)];
                sheet.path(&head, &Style::line(WHITE, 4.0 * unit).class("arrow", "").tip("direction of the motion"));
            }
        }
        sheet
    }
}

impl Levels {
    /// The finest round step with at most [`MOST_LEVELS`] from the brightest magnitude to where 1 % are fainter, so that a
    /// few in the penumbra do not take all the colours; `None` without any magnitude.
    pub(crate) fn of_magnitudes(v_mag: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut lit: Vec<f64> = v_mag.into_iter().filter(|v| v.is_finite()).collect();
        lit.sort_by(f64::total_cmp);
        let (low, high) = (*lit.first()?, *lit.get((lit.len() - 1) * 99 / 100)?);
        let steps = [0.02, 0.05, 0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 5.0];
        let step_mag = steps.into_iter().find(|s| (high - low) / s <= MOST_LEVELS - 1.0).unwrap_or(10.0);
        let number = |v: f64| (v / step_mag).floor() as i64;
        let clipped = lit.last().is_some_and(|v| number(*v) > number(high));
        Some(Self { step_mag, ends: (number(low), number(high)), clipped })
    }

    /// The levels of the directions of a sky, or of several.
    pub(super) fn of<'r>(rows: impl IntoIterator<Item = &'r SkyRow>) -> Option<Self> {
        Self::of_magnitudes(rows.into_iter().filter_map(|r| r.model_v_mag))
    }

    pub(super) fn number(&self, v_mag: f64) -> i64 {
        ((v_mag / self.step_mag).floor() as i64).clamp(self.ends.0, self.ends.1)
    }

    fn count(&self) -> i64 {
        self.ends.1 - self.ends.0 + 1
    }

    /// Bright is yellow, faint is violet.
    pub(super) fn colour(&self, level: i64) -> Colour {
        let share = (level - self.ends.0) as f64 / (self.count() - 1).max(1) as f64;
        let (r, g, b) = viridis(1.0 - share);
        Colour(r, g, b)
    }

    /// Levels at which a scale is labelled, every 1, 2 or 5 times a power of ten of them, and their labels.
    fn labels(&self) -> Vec<(i64, String)> {
        let every = [1, 2, 4, 5, 10, 20].into_iter().find(|e| self.count() <= 10 * e).unwrap_or(50);
        let decimals = if self.step_mag < 0.1 || self.step_mag == 0.25 { 2 } else { usize::from(self.step_mag < 1.0) };
        let text = |level: i64| signed(&format!("{:.decimals$}", level as f64 * self.step_mag));
        let levels = (self.ends.0..=self.ends.1 + 1).filter(|l| l.rem_euclid(every) == 0);
        levels.map(|level| (level, text(level))).collect()
    }

    /// The colour bar lying down, bright to the left, and what grey means.
    pub(crate) fn across(&self, medium: Medium) -> Sheet {
        let (scale, size) = if medium == Medium::Page { (1.0, 11.5) } else { (2.0, SMALL) };
        let sheet = Sheet::new(medium, (scale * ACROSS.0, scale * 36.0));
        let at = |level: i64| scale * (10.0 + ACROSS.1 * (level - self.ends.0) as f64 / self.count() as f64);
        let (top, bottom) = (scale * 2.0, scale * 16.0);
        for level in self.ends.0..=self.ends.1 {
            // a little under the next one, so that no seam shows
            let right = at(level + 1) + if level < self.ends.1 { 0.5 * scale } else { 0.0 };
            sheet.rect((at(level), top), (right, bottom), &Style::filled(self.colour(level)));
        }
        let text = |text: &str, at: Place, place| write_text(&sheet, text, at, size, INK.class("tick"), place);
        for (level, name) in self.labels() {
            text(&name, (at(level), bottom + 2.0 * scale), (HPos::Center, VPos::Top));
        }
        let unit = if self.clipped { "V [mag], and fainter" } else { "V [mag]" };
        text(unit, (scale * (ACROSS.1 + 18.0), 0.5 * (top + bottom)), (HPos::Left, VPos::Center));
        sheet
    }

    /// The colour bar, bright on top, and what grey means.
    pub(super) fn bar(&self, sheet: &Sheet, aside: i32, dark: bool) {
        let (left, right, top, bottom) = (aside, aside + 60, 220, 960);
        let left_centre = (HPos::Left, VPos::Center);
        write_text(sheet, "V [mag]", (left, top - 50), LABEL, INK, left_centre);
        let edge = |level: i64| top + ((bottom - top) as i64 * (level - self.ends.0) / self.count()) as i32;
        for level in self.ends.0..=self.ends.1 {
            // a little under the next one, so that no seam shows
            let corners = [(left, edge(level)), (right, (edge(level + 1) + 1).min(bottom))];
            sheet.rect(corners[0], corners[1], &Style::filled(self.colour(level)));
        }
        for (level, text) in self.labels() {
            write_text(sheet, &text, (right + 16, edge(level)), SMALL, INK, left_centre);
        }
        sheet.rect((left, top), (right, bottom), &Style::line(INK, 2));
        if self.clipped {
            write_text(sheet, "and fainter", (left, bottom + 26), SMALL, INK, left_centre);
        }
        if dark {
            let corners = [(left, bottom + 60), (right, bottom + 100)];
            sheet.rect(corners[0], corners[1], &Style::filled(DARK));
            for x in (left..right).step_by(20) {
                sheet.line((x, bottom + 100), (x + 20, bottom + 60), &Style::line(GREY, 1));
            }
            sheet.rect(corners[0], corners[1], &Style::line(INK, 1));
            write_text(sheet, "no light", (right + 16, bottom + 80), SMALL, INK, left_centre);
        }
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
    fn fill(&self, sheet: &Sheet, disc: &Disc, levels: &Levels) {
        for i in 0..self.alt_deg.len() {
            let (low_deg, high_deg) = Self::edges(&self.alt_deg, i);
            let mut start = 0;
            while start < self.az_deg.len() {
                let level = self.level(i, start);
                let end = (start..self.az_deg.len()).take_while(|j| self.level(i, *j) == level).last().unwrap_or(start);
                let (from_deg, to_deg) = (Self::edges(&self.az_deg, start).0, Self::edges(&self.az_deg, end).1);
                let under = if end + 1 < self.az_deg.len() { 0.4 } else { 0.0 };
                let colour = level.map_or(DARK, |level| levels.colour(level));
                disc.sector(sheet, (low_deg, (high_deg + 0.4).min(90.0)), (from_deg, to_deg + under), colour);
                start = end + 1;
            }
        }
    }

    /// Diagonal lines over what has no light.
    fn hatch(&self, sheet: &Sheet, disc: &Disc) {
        if self.level.is_empty() {
            return;
        }
        let r = disc.radius;
        let (spacing, sample) = (HATCH.0 * disc.unit, HATCH.1 * disc.unit);
        let style = Style::line(GREY, 1).class("hatch", "");
        let lines = (2.0 * r / spacing) as i32;
        for offset in (-lines..=lines).map(|k| f64::from(k) * spacing) {
            let mut run: Vec<Place> = Vec::new();
            for x in (0..=(2.0 * r / sample) as i32 + 1).map(|k| f64::from(k) * sample - r) {
                let at = (x, offset - x);
                if x <= r && self.is_dark(disc, at) {
                    run.push((at.0 + disc.centre.0, at.1 + disc.centre.1));
                    continue;
                }
                if let (Some(a), Some(b)) = (run.first(), run.last()) {
                    sheet.line(*a, *b, &style);
                }
                run.clear();
            }
        }
    }

    /// Whether a place, from the centre of the disc, is in a cell without light.
    fn is_dark(&self, disc: &Disc, (x, y): Place) -> bool {
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
    fn sector(&self, sheet: &Sheet, alt_deg: (f64, f64), az_deg: (f64, f64), colour: Colour) {
        let steps = ((az_deg.1 - az_deg.0) / 2.0).ceil().max(1.0) as usize;
        let az = |k: usize| az_deg.0 + (az_deg.1 - az_deg.0) * k as f64 / steps as f64;
        let mut outline: Vec<Place> = (0..=steps).map(|k| self.place(alt_deg.0, az(k))).collect();
        outline.extend((0..=steps).rev().map(|k| self.place(alt_deg.1, az(k))));
        outline.dedup();
        sheet.polygon(&outline, &Style::filled(colour));
    }

    /// Horizon, circles of altitude with their degrees, and the points of the compass.
    fn graticule(&self, sheet: &Sheet) {
        let (centre, unit) = (self.centre, self.unit);
        for alt_deg in [30.0, 60.0] {
            let r = self.radius * (90.0 - alt_deg) / 90.0;
            sheet.circle(centre, r, &Style::line(WHITE, 2).opacity(0.8).class("ring", ""));
            if self.degrees {
                self.named(sheet, &format!("{alt_deg:.0}°"), self.place(alt_deg, 202.0), 34.0);
            }
        }
        sheet.circle(centre, self.radius, &Style::line(INK, 3).class("horizon", ""));
        let cross = Style::line(WHITE, 2).class("ring", "");
        sheet.line((centre.0 - 10.0 * unit, centre.1), (centre.0 + 10.0 * unit, centre.1), &cross);
        sheet.line((centre.0, centre.1 - 10.0 * unit), (centre.0, centre.1 + 10.0 * unit), &cross);
        for (name, az_deg) in [("N", 0.0), ("E", 90.0), ("S", 180.0), ("W", 270.0)] {
            let at = self.outside(az_deg);
            write_text(sheet, name, at, (LABEL + 3.0) * unit, INK.class("label"), (HPos::Center, VPos::Center));
        }
    }

    /// Text that can be read on any background.
    fn named(&self, sheet: &Sheet, text: &str, (x, y): Place, half: f64) {
        let (half, height) = (half * self.unit, 20.0 * self.unit);
        let under = Style::filled(WHITE).opacity(0.75).class("plate", "");
        sheet.rect((x - half, y - height), (x + half, y + height), &under);
        write_text(sheet, text, (x, y), SMALL * self.unit, INK.class("label"), (HPos::Center, VPos::Center));
    }

    /// Sun or Moon with its altitude: at its place, or open in its azimuth, outside the horizon (on it where degrees are
    /// not labelled), when it is below.
    fn body(&self, sheet: &Sheet, mark: &SkyMark, avoid: &[Place]) {
        let (up, unit) = (mark.alt_deg >= 0.0, self.unit);
        let (fill, edge, class) = if mark.name == "Sun" { (ORANGE, ORANGE, "sun") } else { (WHITE, GREY, "moon") };
        let at = match (up, self.names && !self.degrees) {
            (true, _) => self.place(mark.alt_deg.min(90.0), mark.az_deg),
            (false, true) => self.place(0.0, mark.az_deg),
            (false, false) => self.outside(mark.az_deg),
        };
        let tip = signed(&format!("{}: altitude {:.1}°, azimuth {:.0}°", mark.name, mark.alt_deg, mark.az_deg));
        if up {
            sheet.circle(at, 18.0 * unit, &Style::line(INK, 3).fill(fill).class("lamp", class).tip(&tip));
        } else {
            let style = Style::line(edge, 5).fill(WHITE).class("lamp below", class).tip(&tip);
            sheet.circle(at, 14.0 * unit, &style);
        }
        if !self.names {
            return;
        }
        let text = signed(&format!("{} {:.1}°", mark.name, mark.alt_deg));
        let half = 9.0 * text.chars().count() as f64;
        let x = at.0.clamp((half + 8.0) * unit, sheet.width() - half * unit);
        // below or above the mark: where it covers least of the track, at best near and away from the middle
        let side = |down: f64| at.1 + 42.0 * down * unit;
        let covers = |y: f64| {
            avoid.iter().filter(|p| (p.0 - x).abs() < (half + 12.0) * unit && (p.1 - y).abs() < 32.0 * unit).count()
        };
        let away = if at.1 < self.centre.1 { -1.0 } else { 1.0 };
        let places = [away, -away, 1.8 * away, -1.8 * away].map(side);
        if let Some(y) = places.into_iter().min_by_key(|y| covers(*y)) {
            self.named(sheet, &text, (x, y), half);
        }
    }
}
