//! The detector checks in words: what disagrees and what to do, the text of a terminal, the file detector.toml.
//!
//! Units as in [`GainCheck`]. Nothing is measured here.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::gain_check::GainCheck;
use crate::base::error::{Error, Result};
use crate::base::file::save;

/// Gains further apart than this (and than 3 σ) disagree.
const GAIN_TOLERANCE: f64 = 0.05;
/// Read noises further apart than this (and than 3 σ) disagree; the maker's curves are read off to two digits.
const READ_NOISE_TOLERANCE: f64 = 0.2;

/// A name for one gain setting.
fn name(c: &GainCheck) -> String {
    let binning = if c.binning > 1 { format!(", binning {}", c.binning) } else { String::new() };
    match c.setting {
        Some(s) => format!("gain setting {s}{binning}"),
        None => {
            let egain = c.header_e_per_adu.map(|g| format!(", EGAIN {}", short(g))).unwrap_or_default();
            format!("frames without a gain setting{egain}{binning}")
        }
    }
}

/// Whether a gain disagrees with the measured one by more than max(3 σ, 5 %).
fn differs(c: &GainCheck, other: f64) -> Option<bool> {
    let (measured, err) = (c.measured_e_per_adu?, c.measured_err_e_per_adu?);
    Some((measured - other).abs() > (3.0 * err).max(GAIN_TOLERANCE * other))
}

/// The disagreements.
pub(crate) fn warnings(c: &GainCheck) -> Vec<String> {
    let mut warnings = Vec::new();
    let who = name(c);
    gain_warnings(c, &who, &mut warnings);
    unknown_read_noise_warning(c, &who, &mut warnings);
    read_noise_warning(c, &who, &mut warnings);
    pedestal_warnings(c, &who, &mut warnings);
    saturation_warnings(c, &who, &mut warnings);
    warnings.extend(c.doubtful_frames.iter().map(|p| format!("{who}: {p}")));
    warnings
}

fn gain_warnings(c: &GainCheck, who: &str, warnings: &mut Vec<String>) {
    if let (Some(g), Some(err)) = (c.measured_e_per_adu, c.measured_err_e_per_adu) {
        let measured = format!("{} +- {} e-/ADU from {} flats", short(g), two(err), 2 * c.n_pairs);
        if let Some(table) = c.configured_e_per_adu.filter(|t| differs(c, *t) == Some(true)) {
            warnings.push(format!(
                "{who}: {measured}, but {} in use ({}): {:.0} % off; every magnitude measured with it moves by {:.2} mag \
                 (it cancels only against stars of the same setting), error bars by its root; {}",
                short(table),
                c.configured_source,
                100.0 * (g / table - 1.0).abs(),
                2.5 * (g / table).log10().abs(),
                padded_hint(c, table).unwrap_or_else(|| "check detector.e_per_adu or the flats".into())
            ));
        }
        if let Some(egain) = c.header_e_per_adu.filter(|e| differs(c, *e) == Some(true))
            && !c.egain_in_use
        {
            warnings.push(format!(
                "{who}: {measured}, but EGAIN of the header says {}: {}",
                short(egain),
                padded_hint(c, egain).unwrap_or_else(|| "do not set detector.use_header_egain".into())
            ));
        }
    } else if let (Some(egain), Some(spacing)) = (c.header_e_per_adu, c.spacing_adu.filter(|s| *s > 1.5))
        && c.egain_in_use
    {
        warnings.push(format!(
            "{who}: the values are {} ADU apart, so EGAIN {} may be per count of the converter and {} per ADU of the file; \
             two flats of one level decide",
            short(spacing),
            short(egain),
            short(egain / spacing)
        ));
    }
    if c.header_differs {
        warnings.push(format!("{who}: EGAIN differs between headers of this setting (another read-out mode?)"));
    }
}

/// A gain that took all the noise without light for none: neither bias frames nor a table give the read noise.
fn unknown_read_noise_warning(c: &GainCheck, who: &str, warnings: &mut Vec<String>) {
    let held = c.transfer.as_ref().is_some_and(|t| !t.from_slope);
    if held && c.read_noise_e.is_none() && c.configured_read_noise_e.is_none() {
        warnings.push(format!(
            "{who}: the read noise is not known and was taken as 0 for the gain, which is too small by the share of the read \
             noise in the variance of the flats: give bias frames (argument `bias`) or detector.read_noise_e"
        ));
    }
}

/// Whether a gain is that of the converter's count in a file of padded values.
fn padded_hint(c: &GainCheck, gain: f64) -> Option<String> {
    let (measured, spacing) = (c.measured_e_per_adu?, c.spacing_adu.filter(|s| *s > 1.5)?);
    let fits = (gain / measured / spacing - 1.0).abs() < 0.15;
    fits.then(|| {
        format!(
            "the values are {} ADU apart ({} bits padded to 16), so this is e- per count of the converter; \
             per ADU of the file it is {}",
            short(spacing),
            c.converter_bits.unwrap_or(0),
            short(gain / spacing)
        )
    })
}

fn read_noise_warning(c: &GainCheck, who: &str, warnings: &mut Vec<String>) {
    let (Some(noise), Some(err), Some(table)) = (c.read_noise_e, c.read_noise_err_e, c.configured_read_noise_e) else {
        return;
    };
    // a table may or may not count the digitisation as read noise
    let g = c.measured_e_per_adu.or(c.configured_e_per_adu).unwrap_or(0.0);
    let bare = (noise * noise - (g * c.spacing_adu.unwrap_or(1.0)).powi(2) / 12.0).max(0.0).sqrt();
    let allowed = (3.0 * err).max(READ_NOISE_TOLERANCE * table);
    if bare - table > allowed || table - noise > allowed {
        warnings.push(format!(
            "{who}: read noise {} +- {} e- from bias frames, but {} in use: check detector.read_noise_e",
            short(noise),
            two(err),
            short(table)
        ));
    }
}

fn pedestal_warnings(c: &GainCheck, who: &str, warnings: &mut Vec<String>) {
    let Some(pedestal) = c.configured_pedestal_adu else { return };
    let noise_adu = match (c.configured_read_noise_e, c.configured_e_per_adu) {
        (Some(n), Some(g)) => n / g,
        _ => 0.0,
    };
    let step = c.spacing_adu.unwrap_or(1.0);
    let allowed = (0.5 * noise_adu).max(step);
    if let (Some(level), Some(err)) = (c.pedestal_adu, c.pedestal_err_adu) {
        if (level - pedestal).abs() > allowed.max(3.0 * err) {
            warnings.push(format!(
                "{who}: {} at {level:.1} +- {err:.1} ADU, but detector.pedestal_adu = {pedestal}: \
                 flats and backgrounds are off by the difference",
                if c.n_biases > 0 { "bias frames lie" } else { "the overscan lies" }
            ));
        }
    } else if let Some(dark) = c.dark_level_adu.filter(|d| *d < pedestal - allowed) {
        warnings.push(format!(
            "{who}: darks lie at {dark:.1} ADU, below detector.pedestal_adu = {pedestal}: the pedestal is too high"
        ));
    }
    // of pure bias 0.1 % of the pixels lie 3.1 σ low; anything that shines lies higher
    if let Some(lowest) = c.lowest_adu.filter(|l| *l < pedestal - 5.0 * noise_adu - 2.0 * step) {
        warnings.push(format!(
            "{who}: 0.1 % of the pixels of star and target frames lie at or below {lowest:.0} ADU, below \
             detector.pedestal_adu = {pedestal} by more than read noise ({noise_adu:.1} ADU) allows: the pedestal is too high"
        ));
    }
}

fn saturation_warnings(c: &GainCheck, who: &str, warnings: &mut Vec<String>) {
    if let (Some(seen), Some(n)) = (c.saturation_adu, c.saturated_px) {
        if let Some(limit) = c.configured_saturation_adu.filter(|limit| seen < *limit) {
            warnings.push(format!(
                "{who}: {n} pixels pile up at {seen:.0} ADU, below the {limit:.0} ADU from which they count as saturated: \
                 saturated stars pass as good; set detector.adc_max_adu = {seen:.0} (or detector.full_well_e)"
            ));
        }
        if let Some(header) = c.header_saturation_adu.filter(|h| seen < 0.99 * h) {
            warnings.push(format!(
                "{who}: {n} pixels pile up at {seen:.0} ADU, below the {header:.0} ADU of {} in the header",
                c.header_saturation_key
            ));
        }
    }
    if let (Some(header), Some(limit)) = (c.header_saturation_adu, c.configured_saturation_adu)
        && limit > 1.05 * header
    {
        warnings.push(format!(
            "{who}: {} of the header says {header:.0} ADU, but pixels count as saturated from {limit:.0} ADU only: \
             check detector.full_well_e and detector.adc_max_adu",
            c.header_saturation_key
        ));
    }
    if let (Some(full), Some(highest)) = (c.full_scale_adu, c.highest_adu)
        && c.n_above_full >= 10
    {
        warnings.push(format!(
            "{who}: {} pixels reach up to {highest:.0} ADU, above the full scale of {full:.0} ADU in use: good pixels are \
             flagged as saturated; check detector.adc_max_adu and detector.full_well_e",
            c.n_above_full
        ));
    }
}

/// `agree`, `disagree` or `not measured`.
pub(crate) fn verdict(c: &GainCheck) -> String {
    let differences: Vec<bool> =
        [c.configured_e_per_adu, c.header_e_per_adu].into_iter().flatten().filter_map(|g| differs(c, g)).collect();
    match (c.measured_e_per_adu, differences.as_slice()) {
        (None, _) => "not measured",
        (Some(_), []) => "nothing to compare with",
        (Some(_), t) if t.contains(&true) => "disagree",
        _ => "agree",
    }
    .into()
}

/// Four significant digits.
#[must_use]
pub fn short(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    let decimals = (3.0 - v.abs().log10().floor()).clamp(0.0, 8.0) as usize;
    let text = format!("{v:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

/// The checks as the terminal shows them.
#[must_use]
pub fn checks_text(checks: &[GainCheck]) -> String {
    let mut t = String::new();
    for c in checks {
        let (flats, biases, darks, lights) = (c.n_flats, c.n_biases, c.n_darks, c.n_lights);
        let _ = writeln!(
            t,
            "{}: {}, {}, {}, {}",
            capital(&name(c)),
            plural(flats, "flat"),
            plural(biases, "bias frame"),
            plural(darks, "dark"),
            plural(lights, "star or target frame")
        );
        let with = |value: Option<f64>, err: Option<f64>| match (value, err) {
            (Some(v), Some(e)) => format!("{} +- {}", short(v), two(e)),
            (Some(v), None) => short(v),
            _ => "-".into(),
        };
        let plain = |value: Option<f64>| value.map_or("-".into(), short);
        let mut line = |what: &str, measured: String, table: String, header: String, note: &str| {
            let _ = writeln!(t, "  {what:<22}{measured:>20}{table:>12}{header:>12}  {note}").map(|()| {
                let kept = t.trim_end().len();
                t.truncate(kept);
                t.push('\n');
            });
        };
        line("", "measured".into(), "in use".into(), "header".into(), "");
        let how = match c.levels_adu {
            Some([low, high]) => {
                format!("{}: {} of {low:.0} to {high:.0} ADU, {}", c.verdict, plural(c.n_pairs, "pair"), c.method)
            }
            None => c.method.clone(),
        };
        let gain = with(c.measured_e_per_adu, c.measured_err_e_per_adu);
        line("gain [e-/ADU]", gain, plain(c.configured_e_per_adu), plain(c.header_e_per_adu), &how);
        let noise = match c.read_noise_e {
            None if biases < 2 => "needs two bias frames",
            None => "the bias frames do not differ: less than the step of their values",
            Some(_) => "",
        };
        line(
            "read noise [e-]",
            with(c.read_noise_e, c.read_noise_err_e),
            plain(c.configured_read_noise_e),
            "-".into(),
            noise,
        );
        let pedestal = if c.pedestal_adu.is_none() {
            "needs a bias frame"
        } else if biases == 0 {
            "of the overscan"
        } else {
            ""
        };
        line(
            "pedestal [ADU]",
            with(c.pedestal_adu, c.pedestal_err_adu),
            plain(c.configured_pedestal_adu),
            "-".into(),
            pedestal,
        );
        let bits = c.header_bits.map_or("-".into(), |b| format!("{b} bits"));
        line("step [ADU]", plain(c.spacing_adu), "-".into(), bits, &step_note(c));
        let saturation = match (c.saturation_adu, c.saturated_px, c.highest_adu) {
            (Some(_), Some(n), _) => format!("{} piled up", plural(n as usize, "pixel")),
            (_, _, Some(top)) => format!("not reached: at least {top:.0} ADU"),
            _ => "no raw counts".into(),
        };
        let whole = |v: Option<f64>| v.map_or("-".into(), |v| format!("{v:.0}"));
        let (seen, limit) = (whole(c.saturation_adu), whole(c.configured_saturation_adu));
        line("saturation [ADU]", seen, limit, whole(c.header_saturation_adu), &saturation);
        c.problems.iter().for_each(|p| t.push_str(&format!("  excluded: {p}\n")));
        c.warnings.iter().for_each(|w| t.push_str(&format!("  WARNING: {w}\n")));
        t.push('\n');
    }
    t
}

fn step_note(c: &GainCheck) -> String {
    let (Some(spacing), bits) = (c.spacing_adu, c.converter_bits) else { return "too few different values".into() };
    let of = |egain: f64| format!("; EGAIN {} e- is per ADU of the file or per {} ADU", short(egain), short(spacing));
    match bits {
        Some(b) if spacing > 1.5 => {
            format!("{b} bits padded to 16{}", c.header_e_per_adu.map(of).unwrap_or_default())
        }
        Some(b) => {
            let full = c.header_e_per_adu.map(|g| {
                format!("; EGAIN is per ADU of the file: {:.0} e- at {} bits", g * (2f64.powi(b as i32) - 1.0), b)
            });
            format!("{b} bits, not padded{}", full.unwrap_or_default())
        }
        None => "not padded".into(),
    }
}

/// Two significant digits, of an error.
#[must_use]
pub fn two(v: f64) -> String {
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    let decimals = (1.0 - v.abs().log10().floor()).clamp(0.0, 8.0) as usize;
    format!("{v:.decimals$}")
}

fn plural(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}

const HEADER: &str = "\
# Detector checks of satphot, one [[gain]] per gain setting (0.1 dB) and binning. Gains e-/ADU, noise e-, levels ADU as in
# the files. measured: from these frames; configured: in use; header: as the headers say. A key without a value is absent.

";

/// Writes `detector.toml` into `folder`.
///
/// # Errors
/// [`Error::Io`].
pub fn write_checks(folder: &Path, checks: &[GainCheck]) -> Result<PathBuf> {
    #[derive(Serialize)]
    struct File<'a> {
        schema: &'static str,
        tool: &'static str,
        gain: &'a [GainCheck],
    }
    let file =
        File { schema: "satphot.detector/1", tool: concat!("satphot ", env!("CARGO_PKG_VERSION")), gain: checks };
    let text =
        toml::to_string(&file).map_err(|e| Error::Config { key: "detector.toml".into(), problem: e.to_string() })?;
    let path = folder.join("detector.toml");
    save(&path, &format!("{HEADER}{text}"))?;
    Ok(path)
}
