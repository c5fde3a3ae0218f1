//! A scattering law as a figure, and a fitted one over its measurements.
//!
//! lg f upwards, so that a peak of 2000/sr and wings of 0.01/sr are both seen; degrees to the right.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    BLUE, Colour, GREEN, GREY, HPos, INK, Mark, ORANGE, SKY_BLUE, SMALL, VERMILLION, VPos, figure, heading, legend,
    no_data, write_text,
};
use super::panel::{Panel, Ticks};
use crate::base::error::Result;
use crate::brightness::brdf::{ProfileRow, ReflectanceRow};

const SIZE: (u32, u32) = (960, 900);
/// Decades below the largest f that are shown.
const DECADES: f64 = 9.0;

/// Colour and mark of each curve.
const CURVES: [(Colour, Mark); 5] = [
    (BLUE, Mark::Full),
    (GREEN, Mark::Square),
    (ORANGE, Mark::Diamond),
    (VERMILLION, Mark::Up),
    (SKY_BLUE, Mark::Down),
];

/// Draws f against the outgoing angle in the plane of incidence, a curve for each incidence with its mirror direction
/// marked, and below it the hemispherical reflectance against incidence.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn brdf_curves(path: &Path, title: &str, profile: &[ProfileRow], reflectances: &[ReflectanceRow]) -> Result<()> {
    let lg = |f: f64| Some(f.log10()).filter(|lg| lg.is_finite());
    let top = profile.iter().filter_map(|r| lg(r.f_per_sr)).fold(f64::NEG_INFINITY, f64::max);
    let shown = profile.iter().filter_map(|r| lg(r.f_per_sr)).filter(|lg| *lg > top - DECADES);
    let largest = reflectances.iter().map(|r| r.reflectance).chain([0.0]).fold(0.0, f64::max);
    let (Some(y), true) = (Span::around(shown, 1.0), largest.is_finite()) else {
        return no_data(path, SIZE, title, "the law has no finite f, as a mirror, or is 0 everywhere");
    };
    let mut incidences: Vec<f64> = profile.iter().map(|r| r.incidence_deg).collect();
    incidences.dedup();
    figure(path, SIZE, |sheet| {
        heading(sheet, title);
        let upper = Panel { sheet, frame: (170, 110, 1440, 1080), x: Span { from: -90.0, to: 90.0 }, y };
        upper.axes(Ticks::Numbers, "outgoing angle from the normal, the mirror's side positive [deg]", "lg f [1/sr]");
        let mut entries = vec![(None, "incidence".to_owned())];
        for (deg, (colour, mark)) in incidences.iter().zip(CURVES.iter().cycle()) {
            let curve: Vec<&ProfileRow> = profile.iter().filter(|r| r.incidence_deg == *deg).collect();
            let points: Vec<(f64, Option<f64>)> = curve.iter().map(|r| (r.outgoing_deg, lg(r.f_per_sr))).collect();
            upper.polyline(&points, *colour, 4);
            let peak = curve.iter().find(|r| r.outgoing_deg == *deg).and_then(|r| lg(r.f_per_sr));
            if let Some(peak) = peak.filter(|peak| y.holds(*peak)) {
                upper.mark(*mark, *deg, peak, *colour);
            }
            entries.push((Some((*mark, *colour)), format!("{deg:.0} deg")));
        }
        entries.extend([(None, String::new()), (None, "mark: mirror direction".into())]);
        legend(sheet, (1480, 130), &entries);

        let y = Span { from: 0.0, to: (1.12 * largest).max(0.01) };
        let lower = Panel { sheet, frame: (170, 1240, 1440, 1650), x: Span { from: 0.0, to: 90.0 }, y };
        lower.axes(Ticks::Numbers, "angle of incidence [deg]", "reflectance");
        let points: Vec<(f64, Option<f64>)> =
            reflectances.iter().map(|r| (r.incidence_deg, Some(r.reflectance))).collect();
        if y.holds(1.0) {
            lower.across(1.0, GREY, 2);
        }
        lower.polyline(&points, INK, 4);
        let text = ["share of the light".to_owned(), "that leaves again,".into(), format!("at most {largest:.3}")];
        for (i, line) in text.iter().enumerate() {
            write_text(sheet, line, (1480, 1260 + 42 * i as i32), SMALL, INK, (HPos::Left, VPos::Center));
        }
    })
}

/// A measurement and the fitted law at its geometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedRow {
    /// Angle between the outgoing light and the mirror direction \[deg\].
    pub off_mirror_deg: f64,
    /// Measured f \[1/sr\].
    pub measured_per_sr: f64,
    /// Fitted f \[1/sr\].
    pub fitted_per_sr: f64,
}

/// Draws measured and fitted f against the angle from the mirror direction, and below it lg(measured/fitted).
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn brdf_fit(path: &Path, title: &str, rows: &[FittedRow]) -> Result<()> {
    let lg = |f: f64| f.max(1e-12).log10();
    let rows: Vec<&FittedRow> = rows.iter().filter(|r| r.measured_per_sr > 0.0 && r.fitted_per_sr >= 0.0).collect();
    let x = Span::around(rows.iter().map(|r| r.off_mirror_deg), 1.0);
    let y = Span::around(rows.iter().flat_map(|r| [lg(r.measured_per_sr), lg(r.fitted_per_sr)]), 0.5);
    let difference = |r: &FittedRow| lg(r.measured_per_sr) - lg(r.fitted_per_sr);
    let below = Span::around(rows.iter().map(|r| difference(r)).chain([0.0]), 0.1);
    let (Some(x), Some(y), Some(below)) = (x, y, below) else {
        return no_data(path, SIZE, title, "no row has a positive f");
    };
    figure(path, SIZE, |sheet| {
        heading(sheet, title);
        let upper = Panel { sheet, frame: (170, 110, 1440, 1080), x, y };
        upper.axes(Ticks::Numbers, "", "lg f [1/sr]");
        let lower = Panel { sheet, frame: (170, 1180, 1440, 1650), x, y: below };
        lower.axes(Ticks::Numbers, "angle from the mirror direction [deg]", "lg measured/fitted [dex]");
        lower.across(0.0, INK, 3);
        for r in &rows {
            upper.mark(Mark::Dot, r.off_mirror_deg, lg(r.measured_per_sr), BLUE);
            lower.mark(Mark::Dot, r.off_mirror_deg, difference(r), BLUE);
        }
        for r in &rows {
            upper.mark(Mark::Cross, r.off_mirror_deg, lg(r.fitted_per_sr), VERMILLION);
        }
        let entries = [
            (Some((Mark::Dot, BLUE)), format!("measured ({})", rows.len())),
            (Some((Mark::Cross, VERMILLION)), "fitted".to_owned()),
        ];
        legend(sheet, (1480, 130), &entries)
    })
}
