//! The Moon's laws against phase, what lies between them, and the spectra of moonlight, on one sheet.
//!
//! V mag upwards to brighter, deg, nm and lg(W m⁻² nm⁻¹). Thin where a law is extrapolated.

use std::path::Path;

use super::SedCurve;
use super::axis::Span;
use super::canvas::{
    BLUE, Colour, GREEN, GREY, HPos, INK, Mark, ORANGE, PURPLE, SKY_BLUE, SMALL, Sheet, VERMILLION, VPos, figure,
    heading, legend, signed, write_text,
};
use super::panel::{Panel, Ticks};
use crate::base::error::Result;
use crate::tables::MoonLawRow;

const SIZE: (u32, u32) = (940, 640);
/// Faintest V shown: the law past 150° fades to nothing.
const FAINTEST_V: f64 = -4.0;
/// Phase up to which differences are shown \[deg\].
const DIFFERENCES_TO_DEG: f64 = 120.0;
/// Wavelengths shown \[nm\].
const SHOWN_NM: (f64, f64) = (280.0, 1_200.0);
/// Where the lines of the spectra are named \[nm\].
const LABEL_NM: f64 = 620.0;
const SPECTRA: [Colour; 7] = [INK, BLUE, SKY_BLUE, GREEN, ORANGE, PURPLE, GREY];

/// A law: its name, its colour and mark, its magnitude, whether it is extrapolated.
type Law = (&'static str, Colour, fn(&MoonLawRow) -> Option<f64>, fn(&MoonLawRow) -> bool);
const LAWS: [Law; 3] = [
    ("ROLO (Kieffer & Stone)", GREEN, |r| r.rolo_v_mag, |r| r.rolo_extrapolated == 1),
    ("Krisciunas & Schaefer", VERMILLION, |r| r.ks_v_mag, |r| r.ks_extrapolated == 1),
    ("Cox (Allen's Quantities)", BLUE, |r| r.cox_v_mag, |r| r.cox_extrapolated == 1),
];

/// Draws the laws of `rows`, closely spaced in phase, and the spectra.
///
/// # Errors
/// [`crate::Error::Io`] when the file cannot be written.
pub fn moon_laws(path: &Path, rows: &[MoonLawRow], spectra: &[SedCurve], subtitle: &str) -> Result<()> {
    figure(path, SIZE, |sheet| {
        heading(sheet, "The Moon: V against phase, and its spectrum");
        draw_laws(sheet, rows);
        draw_differences(sheet, rows);
        draw_spectra(sheet, spectra, subtitle)
    })
}

fn draw_laws(sheet: &Sheet, rows: &[MoonLawRow]) {
    let brightest = rows.iter().filter_map(|r| r.ks_v_mag).fold(-13.2, f64::min);
    let y = Span { from: FAINTEST_V, to: brightest - 0.3 };
    let panel = Panel { sheet, frame: (160, 120, 930, 700), x: Span { from: 0.0, to: 180.0 }, y };
    panel.axes(Ticks::Numbers, "phase angle [deg]", "V [mag]");
    for (_, colour, mag, extrapolated) in LAWS {
        for beyond in [true, false] {
            let part = |r: &MoonLawRow| mag(r).filter(|_| extrapolated(r) == beyond);
            let points: Vec<(f64, Option<f64>)> = rows.iter().map(|r| (r.phase_deg, part(r))).collect();
            panel.polyline(&points, colour, if beyond { 2 } else { 5 });
        }
    }
    let mut entries: Vec<(Option<(Mark, Colour)>, String)> =
        LAWS.iter().rev().map(|(name, colour, _, _)| (Some((Mark::Line(5), *colour)), (*name).to_owned())).collect();
    entries.push((Some((Mark::Line(2), INK)), "thin: beyond its range".into()));
    // right and above, where every law is faint
    legend(sheet, (490, 150), &entries)
}

fn draw_differences(sheet: &Sheet, rows: &[MoonLawRow]) {
    let near: Vec<&MoonLawRow> = rows.iter().filter(|r| r.phase_deg <= DIFFERENCES_TO_DEG).collect();
    let less =
        |r: &MoonLawRow, mag: fn(&MoonLawRow) -> Option<f64>| mag(r).zip(r.cox_v_mag).map(|(law, cox)| law - cox);
    let y = Span { from: 0.2, to: -0.4 };
    let panel = Panel { sheet, frame: (160, 840, 930, 1_140), x: Span { from: 0.0, to: DIFFERENCES_TO_DEG }, y };
    panel.axes(Ticks::Numbers, "phase angle [deg]", "law − Cox [mag]");
    panel.across(0.0, BLUE, 3);
    for (_, colour, mag, extrapolated) in LAWS.iter().take(2) {
        for beyond in [true, false] {
            let part = |r: &MoonLawRow| less(r, *mag).filter(|_| extrapolated(r) == beyond);
            let points: Vec<(f64, Option<f64>)> = near.iter().map(|r| (r.phase_deg, part(r))).collect();
            panel.polyline(&points, *colour, if beyond { 2 } else { 5 });
        }
    }
    let text = "waxing and waning differ by 0.05–0.15 at 90° (not modelled)";
    write_text(sheet, text, (915, 1_115), SMALL - 3.0, GREY, (HPos::Right, VPos::Center))
}

fn draw_spectra(sheet: &Sheet, spectra: &[SedCurve], subtitle: &str) {
    let shown =
        |(nm, value): (f64, f64)| ((SHOWN_NM.0..=SHOWN_NM.1).contains(&nm) && value > 0.0).then(|| (nm, value.log10()));
    let lines: Vec<Vec<(f64, f64)>> =
        spectra.iter().map(|s| s.points.iter().copied().filter_map(shown).collect()).collect();
    let peaks: Vec<f64> = lines.iter().filter_map(|line| line.iter().map(|p| p.1).reduce(f64::max)).collect();
    let low = peaks.iter().copied().reduce(f64::min).map(|lg| lg - 1.2);
    let frame = (1_130, 120, 1_850, 1_140);
    let Some(y) = Span::around(peaks.iter().copied().chain(low), 1.0) else {
        let middle = ((frame.0 + frame.2) / 2, (frame.1 + frame.3) / 2);
        return write_text(sheet, "no spectrum above zero", middle, SMALL, GREY, (HPos::Center, VPos::Center));
    };
    let panel = Panel { sheet, frame, x: Span { from: SHOWN_NM.0, to: SHOWN_NM.1 }, y };
    panel.axes(Ticks::Numbers, "wavelength [nm]", "lg spectral irradiance [W m⁻² nm⁻¹]");
    for (i, (line, spectrum)) in lines.iter().zip(spectra).enumerate() {
        let colour = SPECTRA[i % SPECTRA.len()];
        let points: Vec<(f64, Option<f64>)> = line.iter().map(|p| (p.0, Some(p.1))).collect();
        panel.polyline(&points, colour, 3);
        // each line is named where it is smooth, above it
        if let Some((_, lg)) = line.iter().find(|(nm, _)| *nm >= LABEL_NM) {
            let at = (panel.px(LABEL_NM), panel.py(*lg) - 36.0);
            write_text(sheet, &signed(&spectrum.label), at, SMALL, colour, (HPos::Center, VPos::Center));
        }
    }
    write_text(sheet, subtitle, (frame.2, 84), SMALL, GREY, (HPos::Right, VPos::Center))
}
