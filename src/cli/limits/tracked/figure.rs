//! The figure of `satphot limits tracked`: limits against time, signal-to-noise ratio against magnitude, or limits by Moon.

use std::path::Path;

use satphot::figures::{LimitCurve, LimitPanel, limit_panels};
use satphot::visibility::tracked::Area;

use super::Tracked;
use super::instrument::Instrument;
use super::sky::SkyCase;

/// Points of a curve.
const STEPS: u32 = 160;

/// Draws the figure that suits the skies.
pub(super) fn draw(
    path: &Path,
    tracked: &Tracked,
    instrument: &Instrument,
    skies: &[SkyCase],
    omega_arcsec2: f64,
) -> anyhow::Result<()> {
    let calculator = &instrument.calculator;
    let band = &instrument.sky_band;
    let snr = tracked.snr.iter().copied().fold(0.0, f64::max);
    let time = format!(
        "{} s in {}",
        tracked.exptime_s,
        if tracked.subs == 1 { "one exposure".into() } else { format!("{} exposures", tracked.subs) }
    );
    let mut notes = vec![
        format!("zeropoint {:.2} mag", calculator.zp_mag),
        format!("pixel {:.4}″, FWHM {}″", calculator.pixel_arcsec, calculator.fwhm_arcsec),
        format!("read noise {} e⁻", calculator.read_noise_e),
    ];
    if tracked.sky.is_grid() {
        notes.extend([format!("limits at SNR {snr}"), time]);
        let panels = by_moon(tracked, instrument, skies, omega_arcsec2, snr)?;
        let legend: Vec<String> = altitudes(skies)
            .into_iter()
            .map(|alt| if alt > 0.0 { format!("Moon at {alt}°") } else { "Moon set".into() })
            .collect();
        limit_panels(path, &instrument.title, &panels, &legend, &notes)?;
        return Ok(());
    }
    notes.push(format!("extended: {omega_arcsec2:.0} arcsec²"));
    notes.push(format!("left at SNR {snr}; right {time}"));
    let areas = [Area::Point, Area::Extended(omega_arcsec2)];
    let surfaces = [Area::Pixel, Area::Arcsec2];
    let mut legend = Vec::new();
    let (mut by_time, mut mu_by_time, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for sky in skies {
        for (area, surface) in areas.into_iter().zip(surfaces) {
            let of = if matches!(area, Area::Point) { "point or one pixel" } else { "extended or 1 arcsec²" };
            let series = legend.len();
            legend.push(format!("{}: {of}", sky.name));
            let (mut deep, mut mu_deep, mut ratio) = (Vec::new(), Vec::new(), Vec::new());
            let at_time = calculator.limit(area, sky.mag_arcsec2, tracked.exptime_s, tracked.subs, 5.0)?.mag;
            for i in 0..=STEPS {
                let share = f64::from(i) / f64::from(STEPS);
                let lg_t = tracked.exptime_s.log10() - 2.0 + 4.0 * share;
                let limit = |area| calculator.limit(area, sky.mag_arcsec2, 10f64.powf(lg_t), tracked.subs, snr);
                deep.push((lg_t, Some(limit(area)?.mag)));
                mu_deep.push((lg_t, limit(surface)?.mag_arcsec2));
                let mag = at_time + 3.0 - 9.0 * share;
                let k = calculator.snr(area, mag, sky.mag_arcsec2, tracked.exptime_s, tracked.subs)?;
                ratio.push((mag, Some(k.log10())));
            }
            by_time.push(LimitCurve { series, points: deep });
            mu_by_time.push(LimitCurve { series, points: mu_deep });
            ratio.reverse();
            ratios.push(LimitCurve { series, points: ratio });
        }
    }
    let panel = |x_title: &str, y_title: &str, curves, faint_up| LimitPanel {
        x_title: x_title.to_owned(),
        y_title: y_title.to_owned(),
        curves,
        y_reversed: false,
        lines: if faint_up { Vec::new() } else { tracked.snr.iter().map(|k| k.log10()).collect() },
    };
    let panels = [
        panel("lg exposure time [s]", &format!("{band} limit, point or extended [mag]"), by_time, true),
        panel(&format!("{band} [mag]"), "lg signal-to-noise ratio", ratios, false),
        panel("lg exposure time [s]", &format!("{band} limit, pixel or arcsec² [mag/arcsec²]"), mu_by_time, true),
    ];
    limit_panels(path, &instrument.title, &panels, &legend, &notes)?;
    Ok(())
}

/// The altitudes of the Moon, each once.
fn altitudes(skies: &[SkyCase]) -> Vec<f64> {
    let mut altitudes: Vec<f64> = skies.iter().filter_map(|sky| sky.moon_alt_deg).collect();
    altitudes.sort_by(f64::total_cmp);
    altitudes.dedup();
    altitudes
}

/// The sky and the limits against phase, a curve for each altitude of the Moon.
fn by_moon(
    tracked: &Tracked,
    instrument: &Instrument,
    skies: &[SkyCase],
    omega_arcsec2: f64,
    snr: f64,
) -> anyhow::Result<Vec<LimitPanel>> {
    let calculator = &instrument.calculator;
    let (mut sky_curves, mut point, mut extended) = (Vec::new(), Vec::new(), Vec::new());
    for (series, alt) in altitudes(skies).into_iter().enumerate() {
        let of: Vec<&SkyCase> = skies.iter().filter(|sky| sky.moon_alt_deg == Some(alt)).collect();
        let curve = |value: &dyn Fn(&SkyCase) -> anyhow::Result<f64>| -> anyhow::Result<LimitCurve> {
            let points: anyhow::Result<Vec<(f64, Option<f64>)>> =
                of.iter().map(|sky| Ok((sky.moon_phase_deg.unwrap_or_default(), Some(value(sky)?)))).collect();
            Ok(LimitCurve { series, points: points? })
        };
        let limit = |sky: &SkyCase, area| -> anyhow::Result<f64> {
            Ok(calculator.limit(area, sky.mag_arcsec2, tracked.exptime_s, tracked.subs, snr)?.mag)
        };
        sky_curves.push(curve(&|sky| Ok(sky.mag_arcsec2))?);
        point.push(curve(&|sky| limit(sky, Area::Point))?);
        extended.push(curve(&|sky| limit(sky, Area::Extended(omega_arcsec2)))?);
    }
    let band = &instrument.sky_band;
    let panel = |y_title: String, curves| LimitPanel {
        x_title: "phase angle of the Moon [deg], 0 = full".into(),
        y_title,
        curves,
        y_reversed: false,
        lines: Vec::new(),
    };
    Ok(vec![
        panel(format!("{band} sky [mag/arcsec²]"), sky_curves),
        panel(format!("{band} limit, point source [mag]"), point),
        panel(format!("{band} limit, {omega_arcsec2:.0} arcsec² [mag]"), extended),
    ])
}
