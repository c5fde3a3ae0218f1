//! The four lights of a satellite as a drawing: Sunlight, Earthshine, Moonlight, Lunar-Earthshine, and the way to the
//! observer.
//!
//! A diagram, not to scale: distances, sizes and angles mean nothing.

use std::path::Path;

use super::canvas::{
    BLUE, Colour, GREEN, GREY, HPos, INK, LABEL, Mark, ORANGE, PALE, PURPLE, Place, SKY_BLUE, SMALL, Sheet, Style,
    VPos, WHITE, draw_mark, figure, heading, write_text,
};
use crate::base::error::Result;

/// Shown size \[px\].
const SIZE: (u32, u32) = (960, 570);
/// Middle of the Earth and its radius \[drawn px\].
const EARTH: (Place, f64) = ((960.0, 860.0), 340.0);
const SATELLITE: Place = (960.0, 260.0);
const SUN: Place = (170.0, 420.0);
const MOON: Place = (1750.0, 420.0);
/// Where the ground reflects sunlight and moonlight, and where the observer is \[deg from the right, upwards\].
const GROUND_DEG: [f64; 3] = [132.0, 48.0, 76.0];
const DAY: Colour = Colour(196, 222, 240);
const NIGHT: Colour = Colour(96, 106, 128);

/// Draws the diagram.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn four_lights(path: &Path) -> Result<()> {
    figure(path, SIZE, |sheet| {
        heading(sheet, "The four lights of a satellite (not to scale)");
        earth(sheet);
        let [by_day, by_night, observer] = GROUND_DEG.map(on_ground);
        ray(sheet, &[SUN, SATELLITE], ORANGE, 138.0);
        ray(sheet, &[SUN, by_day, SATELLITE], GREEN, 60.0);
        ray(sheet, &[MOON, SATELLITE], SKY_BLUE, 138.0);
        ray(sheet, &[MOON, by_night, SATELLITE], PURPLE, 60.0);
        ray(sheet, &[SATELLITE, observer], INK, 40.0);
        body(sheet, SUN, 62.0, ORANGE, "Sun");
        body(sheet, MOON, 42.0, PALE, "Moon");
        satellite(sheet);
        draw_mark(sheet, Mark::Up, (observer.0, observer.1 + 4.0), WHITE);
        write_text(
            sheet,
            "observer",
            (observer.0 - 8.0, observer.1 + 44.0),
            SMALL,
            WHITE,
            (HPos::Center, VPos::Center),
        );
        let named = [
            ("Sunlight", ORANGE, (500.0, 290.0)),
            ("Earthshine", GREEN, (400.0, 600.0)),
            ("Moonlight", SKY_BLUE, (1420.0, 290.0)),
            ("Lunar-Earthshine", PURPLE, (1530.0, 600.0)),
        ];
        for (name, colour, at) in named {
            write_text(sheet, name, at, LABEL + 5.0, darker(colour), (HPos::Center, VPos::Center));
        }
        let labels = [
            ("Sunlight: the Sun lights the satellite.", ORANGE),
            ("Earthshine: sunlight that the day side of the Earth reflects to the satellite.", GREEN),
            ("Moonlight: the Moon lights the satellite.", SKY_BLUE),
            ("Lunar-Earthshine: moonlight that the night side of the Earth reflects to the satellite.", PURPLE),
        ];
        for (i, (text, colour)) in labels.into_iter().enumerate() {
            let y = 950 + 44 * i as i32;
            draw_mark(sheet, Mark::Line(7), (340, y), colour);
            write_text(sheet, text, (390, y), SMALL, INK, (HPos::Left, VPos::Center));
        }
    })
}

/// A place on the ground.
fn on_ground(deg: f64) -> Place {
    let ((x, y), r) = EARTH;
    let (sin, cos) = deg.to_radians().sin_cos();
    (x + r * cos, y - r * sin)
}

/// A colour that can be read as text on white.
fn darker(Colour(r, g, b): Colour) -> Colour {
    let less = |v: u8| (f64::from(v) * 0.72).round() as u8;
    Colour(less(r), less(g), less(b))
}

/// The upper half of the Earth, day to the Sun, night to the Moon.
fn earth(sheet: &Sheet) {
    let (centre, _) = EARTH;
    let arc =
        |from: i32, to: i32| -> Vec<Place> { (from..=to).step_by(2).map(|deg| on_ground(f64::from(deg))).collect() };
    for (from, to, colour) in [(90, 180, DAY), (0, 90, NIGHT)] {
        let quarter: Vec<Place> = std::iter::once(centre).chain(arc(from, to)).collect();
        sheet.polygon(&quarter, &Style::filled(colour));
    }
    sheet.path(&arc(0, 180), &Style::line(INK, 3));
    let middle = (HPos::Center, VPos::Center);
    write_text(sheet, "Earth: day", (centre.0 - 150.0, centre.1 - 60.0), LABEL, INK, middle);
    write_text(sheet, "Earth: night", (centre.0 + 150.0, centre.1 - 60.0), LABEL, WHITE, middle);
}

/// A way of light with an arrow at its end, which stops `short` of the last place.
fn ray(sheet: &Sheet, places: &[Place], colour: Colour, short: f64) {
    let [.., before, last] = places else { return };
    let (dx, dy) = (last.0 - before.0, last.1 - before.1);
    let length = dx.hypot(dy);
    let (ux, uy) = (dx / length, dy / length);
    let end = (last.0 - short * ux, last.1 - short * uy);
    let mut way = places[..places.len() - 1].to_vec();
    way.push(end);
    sheet.path(&way, &Style::line(colour, 7));
    let corner = |along: f64, across: f64| (end.0 + along * ux - across * uy, end.1 + along * uy + across * ux);
    sheet.polygon(&[corner(22.0, 0.0), corner(-10.0, 14.0), corner(-10.0, -14.0)], &Style::filled(colour));
}

fn body(sheet: &Sheet, at: Place, radius: f64, colour: Colour, name: &str) {
    sheet.circle(at, radius, &Style::line(INK, 3).fill(colour));
    write_text(sheet, name, (at.0, at.1 - radius - 14.0), LABEL, INK, (HPos::Center, VPos::Bottom));
}

/// A box between two arrays.
fn satellite(sheet: &Sheet) {
    let (x, y) = SATELLITE;
    let edge = Style::line(INK, 3);
    sheet.line((x - 110.0, y), (x + 110.0, y), &edge);
    for side in [-1.0, 1.0] {
        let (near, far) = (x + side * 36.0, x + side * 110.0);
        sheet.rect((near.min(far), y - 20.0), (near.max(far), y + 20.0), &edge.clone().fill(BLUE));
    }
    sheet.rect((x - 26.0, y - 30.0), (x + 26.0, y + 30.0), &edge.fill(GREY));
    write_text(sheet, "satellite", (x, y - 46.0), LABEL, INK, (HPos::Center, VPos::Bottom));
}
