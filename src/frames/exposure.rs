//! An exposure: what one file is, derived from its header, its name and the configuration.
//!
//! Exposure times in s, sizes in px. Reads headers only, no pixels; the reason for every decision is kept. It does not
//! cover the pointing (photometry's WCS) and the site (configuration).

use super::role::letters;
use super::role::name_variants;
use super::role::names_object;
use std::path::{Path, PathBuf};

use super::clock::{MidTime, mid_time};
use super::frame::GainSetting;
use super::header::{
    Sourced, binning, calibration, colour, cube, exposure_time, filter, find, green_pixels, header_gain, stack,
};
use super::role::{Role, role_by_header, role_by_name};
use crate::bands::{Band, Meaning, filter_meaning};
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::config::Config;
use crate::fits::cards::Header;
use crate::fits::raw::guarded;

/// One file of the night, as far as its header states.
#[derive(Debug, Clone)]
pub struct Exposure {
    /// The file.
    pub path: PathBuf,
    /// Its file name.
    pub name: String,
    /// What it is for.
    pub role: Role,
    /// Why.
    pub role_reason: String,
    /// OBJECT.
    pub object: Option<String>,
    /// Exposure time \[s\]; 0 where a calibration frame does not say.
    pub exptime_s: f64,
    /// Middle of the exposure; always there for stars and target.
    pub time: Option<MidTime>,
    /// Gain setting \[0.1 dB\].
    pub setting: Option<GainSetting>,
    /// Electrons per ADU as the header says.
    pub header_e_per_adu: Option<f64>,
    /// Filter.
    pub filter: Option<String>,
    /// Size (nx, ny) \[px\].
    pub size_px: (usize, usize),
    /// Binning along x.
    pub binning: u32,
    /// Warnings about the header.
    pub warnings: Vec<String>,
    /// All its cards.
    pub header: Header,
}

/// Reads the header of `path` and decides what the frame is. A frame with a Bayer pattern is one of superpixels: half the size,
/// twice the binning, and TG where it has no filter.
///
/// The globs of `config.frames` win over IMAGETYP; a light whose OBJECT contains one of `target_names` (a satellite's
/// name or catalogue number) or of `config.frames.target_objects` is a target frame, any other light a star pointing.
///
/// # Errors
/// [`Error::Io`], [`Error::Fits`]; [`Error::Header`] for lights without exposure time or time, and for what
/// [`refusals`] names.
pub fn classify(path: &Path, config: &Config, target_names: &[String]) -> Result<Exposure> {
    guarded(path, || understood(path, config, target_names))
}

fn understood(path: &Path, config: &Config, target_names: &[String]) -> Result<Exposure> {
    let name = file_name(path);
    if let Some((Role::Ignored, reason)) = role_by_name(&name, config) {
        return Ok(blank(path, name, Role::Ignored, reason, Header::default()));
    }
    let header = Header::read(path)?;
    let mut exposure = sorted(path, header, config, target_names);
    let green = green_pixels(&exposure.header, config.detector.bayer_pattern.as_deref());
    let superpixel = if green.is_some() { 2 } else { 1 };
    if green.is_some() {
        let (nx, ny) = exposure.size_px;
        exposure.size_px = (nx / 2, ny / 2);
        exposure.header = exposure.header.with_green(green);
    }
    if matches!(exposure.role, Role::Bias | Role::Dark) {
        let aliases = &config.header.aliases;
        exposure.exptime_s = exposure_time(&exposure.header, aliases).0.as_ref().map_or(0.0, |t| t.value).max(0.0);
        exposure.setting = header_gain(&exposure.header, aliases).setting.map(|s| s.value);
        exposure.binning = superpixel * binning(&exposure.header, aliases).0.value;
        return Ok(exposure);
    }
    if !matches!(exposure.role, Role::Flat | Role::Stars | Role::Target) {
        return Ok(exposure);
    }
    let bad = |(keyword, problem): (String, String)| Error::Header { path: path.to_path_buf(), keyword, problem };
    let header = exposure.header.clone();
    if let Some(why) = refusals(&header, config).into_iter().next() {
        return Err(bad(why));
    }
    let aliases = &config.header.aliases;
    let (exptime, mut warnings) = exposure_time(&header, aliases);
    if exposure.role == Role::Flat {
        exposure.exptime_s = exptime.as_ref().map_or(0.0, |t| t.value).max(0.0);
        exposure.time = mid_time(&header, exposure.exptime_s, &config.time, aliases, path).ok();
    } else {
        let exptime = light_exptime(exptime).map_err(bad)?;
        exposure.exptime_s = exptime.value;
        let time = mid_time(&header, exptime.value, &config.time, aliases, path)?;
        warnings.extend(time.warnings.iter().cloned());
        exposure.time = Some(time);
    }
    let gain = header_gain(&header, aliases);
    exposure.setting = gain.setting.map(|s| s.value);
    exposure.header_e_per_adu = gain.e_per_adu.map(|e| e.value);
    exposure.filter = config.input.filter_of(filter(&header, aliases).map(|f| f.value));
    if green.is_some() && filter_meaning(exposure.filter.as_deref().unwrap_or("")) == Meaning::Unfiltered {
        exposure.filter = Some(Band::TriGreen.name().into());
    }
    let (binned, odd) = binning(&header, aliases);
    exposure.binning = superpixel * binned.value;
    warnings.extend(gain.warnings.into_iter().chain(odd));
    exposure.warnings = warnings;
    Ok(exposure)
}

/// A header with its role and object; everything else is left blank.
pub(crate) fn sorted(path: &Path, header: Header, config: &Config, target_names: &[String]) -> Exposure {
    let name = file_name(path);
    let object = find(&header, &config.header.aliases, "object").and_then(|k| header.text(&k));
    let (role, reason) =
        role_by_name(&name, config).unwrap_or_else(|| role_by_header(&header, config, object.as_deref(), target_names));
    let mut exposure = blank(path, name, role, reason, header);
    exposure.object = object;
    exposure
}

/// Why a flat or a light frame cannot be measured, by its header alone: keywords and problems with their remedies.
///
/// Stacks, pictures in colour, cubes of several exposures, frames that are already flat-fielded, and frames whose bias is
/// off while `detector.pedestal_adu` would be subtracted again.
#[must_use]
pub fn refusals(header: &Header, config: &Config) -> Vec<(String, String)> {
    let mut why = Vec::new();
    why.extend(stack(header).map(|(key, words)| {
        (key, format!("{words}: a stack of several exposures has no single time; give the single frames"))
    }));
    let pattern = config.detector.bayer_pattern.as_deref();
    let read = pattern.is_some() || green_pixels(header, None).is_some();
    why.extend(colour(header).filter(|_| !read).map(|(key, pattern)| {
        let problem = format!(
            "'{pattern}': colours that are not those of a Bayer pattern (RGGB, BGGR, GRBG, GBRG); give the raw frames, or set \
             detector.bayer_pattern to the pattern of the file or to \"none\""
        );
        (key, problem)
    }));
    why.extend(cube(header).map(|(key, planes)| {
        let problem = format!(
            "a cube of {planes} planes: satphot reads one exposure per file, because each plane needs its own time; write \
             every plane to a file of its own with its own DATE-OBS"
        );
        (key, problem)
    }));
    let done = calibration(header);
    let calstat = done.calstat.clone().unwrap_or_default();
    let pedestal_adu = config.detector.pedestal_adu;
    if done.flat_divided {
        why.push(("CALSTAT".into(), format!("'{calstat}': already flat-fielded; give the raw frames")));
    } else if done.zero_subtracted && (pedestal_adu - done.zero_adu()).abs() > 0.5 {
        let problem = format!(
            "'{calstat}': bias or dark are subtracted already, and detector.pedestal_adu = {pedestal_adu} would be \
             subtracted again; set it to {}{}, or give the raw frames",
            done.zero_adu(),
            if done.pedestal_adu.is_some() { " (PEDESTAL)" } else { "" }
        );
        why.push(("CALSTAT".into(), problem));
    }
    why
}

/// The exposure time of a light frame: it must be there and be one.
pub(crate) fn light_exptime(stated: Option<Sourced<f64>>) -> std::result::Result<Sourced<f64>, (String, String)> {
    let absent = || "absent (EXPOSURE and synonyms too); name your keyword in header.aliases.exptime".to_string();
    let stated = stated.ok_or_else(|| ("EXPTIME".to_string(), absent()))?;
    // Shorter than a microsecond is not an exposure of the sky.
    if stated.value > 1e-6 && stated.value < 1e6 {
        return Ok(stated);
    }
    let problem = format!(
        "{} s is not an exposure time of a light frame (accepted: 1e-6 to 1e6 s); \
         name the right keyword in header.aliases.exptime, or the file in frames.ignore",
        stated.value
    );
    Err((stated.source, problem))
}

fn blank(path: &Path, name: String, role: Role, role_reason: String, header: Header) -> Exposure {
    Exposure {
        path: path.to_path_buf(),
        name,
        role,
        role_reason,
        object: None,
        exptime_s: 0.0,
        time: None,
        setting: None,
        header_e_per_adu: None,
        filter: None,
        size_px: header.size_px(),
        binning: 1,
        warnings: Vec::new(),
        header,
    }
}

/// Why a light frame is one of another satellite: its OBJECT holds a name of `others` that is longer than any of
/// `target_names` in it, and neither a pattern of file names nor `frames.target_objects` says what it is.
#[must_use]
pub fn other_satellite(
    exposure: &Exposure,
    config: &Config,
    target_names: &[String],
    others: &[String],
) -> Option<String> {
    let light = matches!(exposure.role, Role::Stars | Role::Target);
    if !light || role_by_name(&exposure.name, config).is_some() {
        return None;
    }
    let object = exposure.object.as_deref()?;
    if config.frames.target_objects.iter().any(|name| names_object(name, object)) {
        return None;
    }
    let longest = |names: &[String]| {
        let variants = names.iter().flat_map(|n| name_variants(n)).filter(|n| names_object(n, object));
        variants.max_by_key(|n| letters(n).len())
    };
    let other = longest(others)?;
    let own = longest(target_names).map_or(0, |n| letters(&n).len());
    (letters(&other).len() > own)
        .then(|| format!("OBJECT = '{object}' is another satellite (\"{other}\") than the target of this run"))
}
