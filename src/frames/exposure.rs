//! An exposure: what one file is, told from its header, its name and the configuration.
//!
//! Exposure times in s, sizes in px. Reads headers only, no pixels; the reason for every decision is kept. Leaves out
//! the pointing (photometry's WCS) and the site (configuration).

use std::path::{Path, PathBuf};

use super::cards::Header;
use super::frame::GainSetting;
use super::time::{MidTime, mid_time};
use crate::config::Config;
use crate::error::{Error, Result};

/// What a frame is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Role {
    /// A flat field.
    Flat,
    /// A star pointing, for the zeropoint.
    Stars,
    /// A frame of the tracked satellite.
    Target,
    /// A bias frame (not used).
    Bias,
    /// A dark frame (not used).
    Dark,
    /// Left alone, for the reason given.
    Ignored,
}

/// One file of the night, as far as its header tells.
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
    /// All its cards.
    pub header: Header,
}

/// Reads the header of `path` and decides what the frame is.
///
/// The globs of `config.frames` win over IMAGETYP; a light whose OBJECT contains one of `target_names` (a satellite's
/// name or catalogue number) or of `config.frames.target_objects` is a target frame, any other light a star pointing.
///
/// # Errors
/// [`Error::Io`], [`Error::Fits`]; [`Error::Header`] for lights without exposure time or time, colour sensors, and
/// frames that are already flat-fielded.
pub fn classify(path: &Path, config: &Config, target_names: &[String]) -> Result<Exposure> {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let glob = role_by_name(&name, config);
    if let Some((Role::Ignored, reason)) = glob {
        return Ok(blank(path, name, Role::Ignored, reason, Header::default()));
    }
    let header = Header::read(path)?;
    let object = lookup(&header, config, "object", &["OBJECT", "OBJNAME"]).and_then(|k| header.text(&k));
    let (role, role_reason) = glob.unwrap_or_else(|| role_by_header(&header, config, object.as_deref(), target_names));
    let mut exposure = blank(path, name, role, role_reason, header);
    exposure.object = object;
    if !matches!(role, Role::Flat | Role::Stars | Role::Target) {
        return Ok(exposure);
    }
    let header = exposure.header.clone();
    let bad =
        |keyword: &str, problem: String| Error::Header { path: path.to_path_buf(), keyword: keyword.into(), problem };
    if let Some(pattern) = header.text("BAYERPAT").or_else(|| header.text("COLORTYP")) {
        return Err(bad("BAYERPAT", format!("'{pattern}': a colour sensor; satphot measures monochrome frames only")));
    }
    if let Some(done) = header.text("CALSTAT").filter(|c| c.to_ascii_uppercase().contains('F')) {
        return Err(bad("CALSTAT", format!("'{done}': already flat-fielded; give the raw frames")));
    }
    for key in ["STACKCNT", "NCOMBINE", "SNAPSHOT", "LIVESTAC"] {
        if let Some(n) = header.number(key).filter(|n| *n > 1.0) {
            return Err(bad(
                key,
                format!("{n}: a stack of several exposures has no single time; give the single frames"),
            ));
        }
    }
    let exptime = exptime_s(&header, config);
    if role == Role::Flat {
        exposure.exptime_s = exptime.as_ref().map_or(0.0, |(_, s)| *s).max(0.0);
        exposure.time = mid_time(&header, exposure.exptime_s, &config.time, &config.frames.aliases, path).ok();
    } else {
        let (key, seconds) = exptime.ok_or_else(|| {
            bad("EXPTIME", "absent (EXPOSURE and synonyms too); name your keyword in frames.aliases.exptime".into())
        })?;
        // Shorter than a microsecond is no exposure of the sky.
        if !(seconds > 1e-6 && seconds < 1e6) {
            return Err(bad(
                &key,
                format!(
                    "{seconds} s is not an exposure time of a light frame (accepted: 1e-6 to 1e6 s); \
                     name the right keyword in frames.aliases.exptime, or the file in frames.ignore"
                ),
            ));
        }
        exposure.exptime_s = seconds;
        exposure.time = Some(mid_time(&header, seconds, &config.time, &config.frames.aliases, path)?);
    }
    (exposure.setting, exposure.header_e_per_adu) = gains(&header, config);
    exposure.filter =
        lookup(&header, config, "filter", &["FILTER", "FILTERS", "FWHEEL", "INSFLNAM"]).and_then(|k| header.text(&k));
    exposure.binning = ["XBINNING", "CCDXBIN", "BINX", "BINNING"]
        .iter()
        .find_map(|k| header.integer(k))
        .and_then(|b| u32::try_from(b).ok())
        .filter(|b| *b > 0)
        .unwrap_or(1);
    Ok(exposure)
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
        header,
    }
}

/// The first keyword with a value: the configuration's aliases of `quantity`, then the usual ones.
fn lookup(header: &Header, config: &Config, quantity: &str, usual: &[&str]) -> Option<String> {
    let own = config.frames.aliases.get(quantity).into_iter().flatten().map(String::as_str);
    own.chain(usual.iter().copied()).find(|k| header.text(k).is_some()).map(str::to_string)
}

fn role_by_name(name: &str, config: &Config) -> Option<(Role, String)> {
    let f = &config.frames;
    let lists = [
        (Role::Ignored, "ignore", &f.ignore),
        (Role::Flat, "flat", &f.flat),
        (Role::Stars, "stars", &f.stars),
        (Role::Target, "target", &f.target),
    ];
    lists.into_iter().find_map(|(role, key, globs)| {
        let glob = globs.iter().find(|g| matches_glob(g, name))?;
        Some((role, format!("name matches frames.{key} \"{glob}\"")))
    })
}

fn role_by_header(header: &Header, config: &Config, object: Option<&str>, target_names: &[String]) -> (Role, String) {
    let key = lookup(header, config, "imagetyp", &["IMAGETYP", "OBSTYPE", "FRAME", "IMAGETYPE", "FRAMETYP"]);
    let kind = key.as_deref().and_then(|k| header.text(k)).unwrap_or_default();
    let reason = key.map_or("no IMAGETYP".to_string(), |k| format!("{k} = '{kind}'"));
    let word = kind.to_ascii_lowercase();
    if word.contains("master") {
        return (Role::Ignored, format!("{reason}: a combined frame, not a raw one"));
    }
    for (part, role) in
        [("dark", Role::Dark), ("bias", Role::Bias), ("zero", Role::Bias), ("offset", Role::Bias), ("flat", Role::Flat)]
    {
        if word.contains(part) {
            return (role, reason);
        }
    }
    let light = ["light", "object", "science", "snapshot", "expose", "sky", "standard", "target", "stars"];
    if !word.is_empty() && !light.iter().any(|l| word.contains(l)) {
        return (
            Role::Ignored,
            format!("{reason} is neither light, flat, bias nor dark; use frames.stars or frames.target"),
        );
    }
    let Some(object) = object else { return (Role::Stars, format!("{reason}, no OBJECT")) };
    if word.is_empty() {
        let plain = letters(object);
        for (start, role) in [
            ("bias", Role::Bias),
            ("zero", Role::Bias),
            ("dark", Role::Dark),
            ("flat", Role::Flat),
            ("skyflat", Role::Flat),
            ("domeflat", Role::Flat),
        ] {
            if plain.starts_with(start) {
                return (role, format!("{reason}, OBJECT = '{object}'"));
            }
        }
    }
    let names = target_names.iter().flat_map(|n| name_variants(n)).chain(config.frames.target_objects.iter().cloned());
    for name in names {
        if names_object(&name, object) {
            return (Role::Target, format!("{reason}, OBJECT = '{object}' contains \"{name}\""));
        }
    }
    (Role::Stars, format!("{reason}, OBJECT = '{object}' is not the target"))
}

/// `ISS (ZARYA)` is also known as `ISS` and as `ZARYA`.
fn name_variants(name: &str) -> Vec<String> {
    let mut variants = vec![name.trim().to_string()];
    if let Some((before, rest)) = name.split_once('(') {
        variants.push(before.trim().to_string());
        variants.push(rest.trim_end_matches([')', ' ']).trim().to_string());
    }
    variants.retain(|v| !letters(v).is_empty());
    variants
}

/// Whether `object` contains `name`, ignoring case, spaces and punctuation; numbers and names of up to three
/// letters only as a whole word.
fn names_object(name: &str, object: &str) -> bool {
    let wanted = letters(name);
    if wanted.is_empty() {
        return false;
    }
    if wanted.len() <= 3 || wanted.bytes().all(|b| b.is_ascii_digit()) {
        return object.split(|c: char| !c.is_ascii_alphanumeric()).any(|w| w.to_ascii_lowercase() == wanted);
    }
    letters(object).contains(&wanted)
}

fn letters(text: &str) -> String {
    text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// Shell pattern with `*` and `?`, ignoring case.
fn matches_glob(pattern: &str, name: &str) -> bool {
    let pattern: Vec<char> = pattern.to_lowercase().chars().collect();
    let name: Vec<char> = name.to_lowercase().chars().collect();
    let (mut p, mut n, mut star) = (0, 0, None);
    while n < name.len() {
        if p < pattern.len() && pattern[p] == '*' {
            star = Some((p, n));
            p += 1;
        } else if p < pattern.len() && (pattern[p] == '?' || pattern[p] == name[n]) {
            p += 1;
            n += 1;
        } else if let Some((at, from)) = star {
            star = Some((at, from + 1));
            p = at + 1;
            n = from + 1;
        } else {
            return false;
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

/// Keyword and exposure time \[s\]; milliseconds are recognised by the comment.
fn exptime_s(header: &Header, config: &Config) -> Option<(String, f64)> {
    let usual = ["EXPTIME", "EXPOSURE", "EXP", "EXP_TIME", "TELAPSE", "XPOSURE", "EXPOSURETIME"];
    let own = config.frames.aliases.get("exptime").into_iter().flatten().map(String::as_str);
    let key = own.chain(usual).find(|k| header.number(k).is_some())?;
    let comment = header.comment(key).unwrap_or_default().to_ascii_lowercase();
    let milli = ["[ms]", "(ms)", "in ms", "millisec"].iter().any(|m| comment.contains(m));
    header.number(key).map(|v| (key.to_string(), if milli { v * 1e-3 } else { v }))
}

/// (gain setting, electrons per ADU). GAIN is a setting unless its comment or its decimals say electrons.
fn gains(header: &Header, config: &Config) -> (Option<GainSetting>, Option<f64>) {
    let own =
        |q: &str| config.frames.aliases.get(q).into_iter().flatten().find(|k| header.number(k).is_some()).cloned();
    let egain =
        own("egain").or_else(|| ["EGAIN", "CVF"].iter().find(|k| header.number(k).is_some()).map(ToString::to_string));
    let mut e_per_adu = egain.and_then(|k| header.number(&k)).filter(|v| *v > 0.0);
    if let Some(setting) = own("gain").and_then(|k| header.integer(&k)) {
        return (Some(GainSetting(setting)), e_per_adu);
    }
    let Some(value) = header.number("GAIN") else { return (None, e_per_adu) };
    let comment = header.comment("GAIN").unwrap_or_default().to_ascii_lowercase();
    let says_electrons =
        (comment.contains("electron") || comment.contains("e-") || comment.contains("e/")) && !comment.contains("db");
    if value.fract() != 0.0 || says_electrons {
        e_per_adu = e_per_adu.or(Some(value).filter(|v| *v > 0.0));
        return (None, e_per_adu);
    }
    (header.integer("GAIN").map(GainSetting), e_per_adu)
}

/// FITS files of folders (recursively) and single files: `.fit`, `.fits`, `.fts` and these with `.fz`, any case.
///
/// Sorted, without hidden files and duplicates.
///
/// # Errors
/// [`Error::Io`]; [`Error::NoInput`] naming the first folder if nothing is found.
pub fn find_files(inputs: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    let mut folders: Vec<PathBuf> = Vec::new();
    for input in inputs {
        let meta = std::fs::metadata(input).map_err(|e| Error::io(input, e))?;
        if meta.is_dir() {
            folders.push(input.clone());
        } else {
            files.push(input.clone());
        }
    }
    while let Some(folder) = folders.pop() {
        let real = std::fs::canonicalize(&folder).map_err(|e| Error::io(&folder, e))?;
        if !seen.insert(real) {
            continue; // a link that leads back
        }
        for entry in std::fs::read_dir(&folder).map_err(|e| Error::io(&folder, e))? {
            let path = entry.map_err(|e| Error::io(&folder, e))?.path();
            let hidden = path.file_name().is_none_or(|n| n.to_string_lossy().starts_with('.'));
            if hidden {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else if is_fits_name(&path) {
                files.push(path);
            }
        }
    }
    files.sort();
    let mut unique = std::collections::BTreeSet::new();
    files.retain(|f| unique.insert(std::fs::canonicalize(f).unwrap_or_else(|_| f.clone())));
    if files.is_empty() {
        let path = inputs.first().cloned().unwrap_or_default();
        let problem = "no FITS file here (*.fit, *.fits, *.fts, *.fits.fz); check night.input".into();
        return Err(Error::NoInput { path, problem });
    }
    Ok(files)
}

fn is_fits_name(path: &Path) -> bool {
    let name = path.file_name().map(|n| n.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let name = name.strip_suffix(".fz").unwrap_or(&name);
    [".fit", ".fits", ".fts"].iter().any(|e| name.ends_with(e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_recognised_by_name_or_number_but_not_by_accident() {
        let found = |name: &str, object: &str| name_variants(name).iter().any(|n| names_object(n, object));
        assert!(found("ISS (ZARYA)", "iss pass 2") && found("ISS (ZARYA)", "ISS-zenith"));
        assert!(!found("ISS (ZARYA)", "Mission field") && !found("25544", "NGC 125544"));
        assert!(found("25544", "norad 25544") && found("STARLINK-2242", "starlink 2242"));
        assert!(!found("", "anything") && !found("()", "x"));
    }

    #[test]
    fn globs_match_like_a_shell() {
        assert!(matches_glob("flat*.fits", "Flat_001.FITS") && matches_glob("*_?.fit", "a_b_1.fit"));
        assert!(!matches_glob("flat?.fits", "flat.fits") && matches_glob("*", ""));
        assert!(!matches_glob("a*b*c", "a__b__") && matches_glob("a*b*c", "a_bb_c"));
    }
}
