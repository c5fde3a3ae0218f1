//! What `satphot limits tracked` prints: the numbers used, the limits, what a magnitude needs, the zeropoints side by
//! side.

use std::fmt::Write as _;

use satphot::report::summary::text_table;
use satphot::tables::LimitRow;
use satphot::visibility::tracked::{Area, Calculator, PUBLISHED_ZP_MAG};

use super::instrument::Instrument;
use super::sky::SkyCase;
use super::{ISS_AREA_M2, ISS_RANGE_KM, Tracked};

impl Tracked {
    pub(super) fn text(
        &self,
        instrument: &Instrument,
        skies: &[SkyCase],
        omega_arcsec2: f64,
        rows: &[LimitRow],
    ) -> anyhow::Result<String> {
        let mut text = format!("{}\n\n{}", instrument.title, settings_text(instrument));
        // Writing to a String cannot fail.
        let _ = writeln!(text, "\nsky: {}", self.sky.source());
        let target = match self.omega_arcsec2 {
            Some(_) => format!("{omega_arcsec2} arcsec2"),
            None => {
                let iss = self.area_m2 == ISS_AREA_M2 && self.range_km == ISS_RANGE_KM;
                let name = if iss { " (default: the ISS)" } else { "" };
                format!("{} m2 at {} km, {omega_arcsec2:.1} arcsec2{name}", self.area_m2, self.range_km)
            }
        };
        let _ = writeln!(text, "extended target: {target}");
        let times = if self.subs == 1 {
            format!("{} s in one exposure", self.exptime_s)
        } else {
            format!("{} s in {} exposures of {} s", self.exptime_s, self.subs, self.exptime_s / f64::from(self.subs))
        };
        let place = if instrument.calculator.extinction_mag > 0.0 { "outside the atmosphere" } else { "at the ground" };
        let _ = writeln!(text, "\nlimits of {times}, {place} (* a pixel saturates)");
        text.push_str(&if self.sky.is_grid() { grid_text(rows) } else { limits_text(rows) });
        if self.mag.is_some() {
            let _ = writeln!(text, "\nmagnitude {}, {place}", self.mag.unwrap_or_default());
            text.push_str(&needed_text(rows));
        }
        if instrument.is_preset && !self.sky.is_grid() {
            text.push_str(&self.zeropoints_text(instrument, skies)?);
        }
        Ok(text)
    }

    /// The pixel limits by the zeropoint that was computed, the one measured, and the one behind the published limits.
    fn zeropoints_text(&self, instrument: &Instrument, skies: &[SkyCase]) -> anyhow::Result<String> {
        let used = instrument.calculator;
        let published = Calculator::published(used.pixel_arcsec).zp_mag;
        let cases = [
            ("used above", used.zp_mag),
            ("measured with this telescope", PUBLISHED_ZP_MAG),
            ("behind the published limits", published),
        ];
        let mut head = vec!["zeropoint".to_owned(), "mag = 1 e-/s".to_owned()];
        head.extend(skies.iter().flat_map(|sky| self.snr.iter().map(move |k| format!("{}, SNR {k}", sky.name))));
        let mut rows = Vec::new();
        for (name, zp_mag) in cases {
            let mut cells = vec![name.to_owned(), format!("{zp_mag:.2}")];
            for sky in skies {
                for k in &self.snr {
                    let calculator = Calculator { zp_mag, ..used };
                    let limit = calculator.limit(Area::Pixel, sky.mag_arcsec2, self.exptime_s, self.subs, *k)?;
                    cells.push(limit.mag_arcsec2.map_or(String::new(), |mu| format!("{mu:.2}")));
                }
            }
            rows.push(cells);
        }
        let head: Vec<&str> = head.iter().map(String::as_str).collect();
        Ok(format!(
            "\nlimits of one pixel [mag/arcsec2] by zeropoint: {:.2} mag lie between the one behind the published limits and \
             the one measured (V, no filter, if of electrons)\n{}",
            published - PUBLISHED_ZP_MAG,
            text_table(&head, &rows)
        ))
    }
}

fn settings_text(instrument: &Instrument) -> String {
    let cells = |s: &super::instrument::Setting| {
        let value = if s.value.abs() >= 1_000.0 { format!("{:.1}", s.value) } else { plain(s.value) };
        vec![s.name.to_owned(), value, s.unit.to_owned(), s.from.clone()]
    };
    text_table(&["", "value", "unit", "from"], &instrument.settings.iter().map(cells).collect::<Vec<_>>())
}

/// A number with at most four decimals, without trailing zeros.
fn plain(value: f64) -> String {
    let text = format!("{value:.4}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or(String::new(), |v| format!("{v:.decimals$}"))
}

fn limits_text(rows: &[LimitRow]) -> String {
    let head =
        ["sky", "mag/arcsec2", "e-/s/px", "SNR", "limit of", "mag", "mag/arcsec2", "noise [e-]", "saturates [mag]"];
    let cells = |r: &LimitRow| {
        let star = if r.saturated == 1 { "*" } else { "" };
        let mu = number(r.mu_limit_mag_arcsec2, 2);
        vec![
            r.sky.clone(),
            format!("{:.2}", r.sky_mag_arcsec2),
            format!("{:.3}", r.sky_e_s_px),
            format!("{}", r.snr),
            r.limit_of.clone(),
            r.limit_mag.map_or(String::new(), |m| format!("{m:.2}{star}")),
            if mu.is_empty() { mu } else { mu + star },
            format!("{:.2}", r.noise_var_e2.sqrt()),
            number(r.saturation_mag, 2),
        ]
    };
    text_table(&head, &rows.iter().map(cells).collect::<Vec<_>>())
}

/// One line for each phase and altitude, the limits at the largest ratio next to each other.
fn grid_text(rows: &[LimitRow]) -> String {
    let snr = rows.iter().map(|r| r.snr).fold(0.0, f64::max);
    let kept: Vec<&LimitRow> = rows.iter().filter(|r| r.snr == snr).collect();
    let lines: Vec<Vec<String>> = kept
        .chunks(4)
        .filter_map(|four| {
            let [pixel, arcsec2, point, extended] = four else { return None };
            let star = if four.iter().any(|r| r.saturated == 1) { "*" } else { "" };
            let alt =
                pixel.moon_alt_deg.map_or(String::new(), |alt| if alt > 0.0 { format!("{alt}") } else { "set".into() });
            Some(vec![
                number(pixel.moon_phase_deg, 0),
                alt,
                format!("{:.2}", pixel.sky_mag_arcsec2),
                number(pixel.mu_limit_mag_arcsec2, 2),
                number(arcsec2.mu_limit_mag_arcsec2, 2),
                number(point.limit_mag, 2),
                number(extended.limit_mag, 2) + star,
                number(extended.mu_limit_mag_arcsec2, 2),
            ])
        })
        .collect();
    let head = [
        "Moon phase [deg]",
        "alt [deg]",
        "sky [mag/arcsec2]",
        "one pixel [mag/arcsec2]",
        "one arcsec2 [mag/arcsec2]",
        "point [mag]",
        "extended [mag]",
        "[mag/arcsec2]",
    ];
    format!("signal-to-noise ratio {snr}\n{}", text_table(&head, &lines))
}

fn needed_text(rows: &[LimitRow]) -> String {
    let head = ["sky", "as", "SNR now", "SNR wanted", "needs [s]", "exposures", "each [s]"];
    let cells = |r: &&LimitRow| {
        // the requested exposure fills a pixel: its ratio is not one that can be measured
        let full = r.mag.is_some_and(|mag| r.saturation_mag.is_none_or(|saturation| mag < saturation));
        let each = r.mag_exptime_s.zip(r.mag_n_sub).map(|(t, n)| t / n as f64);
        vec![
            r.sky.clone(),
            r.limit_of.clone(),
            r.mag_snr.map_or(String::new(), |v| format!("{v:.4}{}", if full { "*" } else { "" })),
            format!("{}", r.snr),
            r.mag_exptime_s.map_or("impossible".to_owned(), |t| format!("{t:.4e}")),
            r.mag_n_sub.map_or(String::new(), |n| format!("{n}")),
            each.map_or(String::new(), |t| format!("{t:.4e}")),
        ]
    };
    let shown: Vec<&LimitRow> = rows.iter().filter(|r| r.mag.is_some()).collect();
    text_table(&head, &shown.iter().map(cells).collect::<Vec<_>>())
}
