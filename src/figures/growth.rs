//! The growth curve of the night's stars: how much light a radius holds, and why the aperture has the one it has.

use std::path::Path;

use super::axis::Span;
use super::canvas::{
    BLUE, GREEN, GREY, HPos, INK, Mark, PALE, SMALL, Sheet, VERMILLION, VPos, figure, heading, legend, no_data,
    write_text,
};
use super::panel::{Panel, Ticks};
use crate::base::error::Result;
use crate::photometry::growth::GrowthCurve;

const SIZE: (u32, u32) = (960, 640);
const NAME: &str = "Growth curve of the stars";

/// Draws a night's growth curve; without one, says so.
///
/// Points are the stack of the stars, the line the fitted profile; the second line is the signal-to-noise of a faint
/// star. Marked are the aperture, the radius of the best signal-to-noise and the annulus of the sky.
///
/// # Errors
/// [`crate::Error::Io`].
pub fn growth_curve(path: &Path, curve: Option<&GrowthCurve>) -> Result<()> {
    let Some(curve) = curve else {
        return no_data(path, SIZE, NAME, "too few bright, isolated, unsaturated stars in the star frames");
    };
    figure(path, SIZE, |sheet| draw(sheet, curve))
}

fn draw(sheet: &Sheet, curve: &GrowthCurve) {
    heading(sheet, NAME);
    let profile = &curve.profile;
    let form = if profile.beta.is_finite() {
        format!("Moffat \u{3b2} = {:.2} \u{b1} {:.2}", profile.beta, profile.beta_err())
    } else {
        "Gaussian".into()
    };
    let below = format!("{form}, {} stars, FWHM {:.2} px", profile.n_stars, curve.fwhm_px);
    write_text(sheet, &below, (30, 78), SMALL, GREY, (HPos::Left, VPos::Top));

    let far = curve.r_fwhm.last().copied().unwrap_or(6.0).max(curve.sky_fwhm.1).max(curve.chosen_r_fwhm) + 0.25;
    let panel =
        Panel { sheet, frame: (150, 140, 1880, 1150), x: Span { from: 0.0, to: far }, y: Span { from: 0.0, to: 1.08 } };
    panel.shade(curve.sky_fwhm.0, curve.sky_fwhm.1, PALE, "");
    panel.axes(Ticks::Numbers, "radius [FWHM]", "share of a star's light");
    let steps: Vec<f64> = (1..=400).map(|k| far * f64::from(k) / 400.0).collect();
    let light: Vec<(f64, Option<f64>)> = steps.iter().map(|r| (*r, Some(curve.light_within(*r)))).collect();
    let best = curve.light_within(curve.best_snr_r_fwhm) / curve.best_snr_r_fwhm;
    let snr: Vec<(f64, Option<f64>)> = steps.iter().map(|r| (*r, Some(curve.light_within(*r) / r / best))).collect();
    panel.polyline(&snr, GREEN, 3);
    panel.polyline(&light, BLUE, 4);
    let upright = |r: f64| [(r, Some(0.0)), (r, Some(1.08))];
    panel.polyline(&upright(curve.chosen_r_fwhm), VERMILLION, 4);
    panel.polyline(&upright(curve.best_snr_r_fwhm), GREEN, 2);
    for ((r, enclosed), err) in curve.r_fwhm.iter().zip(&curve.enclosed).zip(&curve.err) {
        panel.error_bar(*r, *enclosed, *err, INK);
        panel.mark(Mark::Open, *r, *enclosed, INK);
    }
    let chosen =
        format!("aperture {:.2} FWHM holds {:.4}", curve.chosen_r_fwhm, curve.light_within(curve.chosen_r_fwhm));
    let entries = [
        (Some((Mark::Open, INK)), "stars of the night".to_string()),
        (Some((Mark::Line(4), BLUE)), "fitted profile".to_string()),
        (Some((Mark::Line(3), GREEN)), format!("S/N of a faint star, best at {:.2} FWHM", curve.best_snr_r_fwhm)),
        (Some((Mark::Line(4), VERMILLION)), chosen),
        (Some((Mark::Swatch, PALE)), format!("sky {:.1} to {:.1} FWHM", curve.sky_fwhm.0, curve.sky_fwhm.1)),
    ];
    legend(sheet, (panel.px(0.42 * far) as i32, panel.py(0.86) as i32), &entries)
}
