//! Reading, merging and saving: preset, then the file, then `--set`, into one table that serde reads with paths.

use super::layers::deserialize;
use super::layers::layers;
use super::range::bad;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::file::Config;
use crate::base::error::{Error, Result};

/// Elements embedded for simulations: name and text (published by CelesTrak for June 2025).
pub const ELEMENTS: &[(&str, &str)] = &[
    ("iss-2025-june", include_str!("../presets/iss_2025_june.tle")),
    ("css-2025-june", include_str!("../presets/css_2025_june.tle")),
];

impl Config {
    /// Reads `path`, fills it from its preset, applies `key=value` settings, checks every range once.
    ///
    /// Paths inside become relative to the folder of `path`.
    ///
    /// # Errors
    /// [`Error::Config`] naming the key, the value and what would be accepted; [`Error::Io`].
    pub fn load(path: &Path, sets: &[String]) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
        let text = String::from_utf8(bytes).map_err(|e| not_a_text(path, e.as_bytes()))?;
        if text.starts_with(FITS_BEGINS) {
            return Err(not_a_text(path, text.as_bytes()));
        }
        let mut config = Self::from_text(&text, sets)?;
        config.resolve_paths(path.parent().unwrap_or(Path::new("")));
        config.file = path.to_owned();
        Ok(config)
    }

    /// As [`Config::load`], from text; paths stay as they are.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn from_text(text: &str, sets: &[String]) -> Result<Self> {
        let table = layers(text, sets)?;
        let mut config: Config = deserialize(table.clone()).map_err(|error| with_all_missing(error, &table))?;
        for (quantity, keywords) in std::mem::take(&mut config.frames.aliases) {
            config.header.aliases.entry(quantity).or_default().extend(keywords);
        }
        config.check()?;
        Ok(config)
    }

    /// The configuration in force, as TOML, for `effective.toml`.
    ///
    /// # Errors
    /// [`Error::Config`] if it cannot be written as TOML.
    pub fn to_toml(&self) -> Result<String> {
        toml::to_string_pretty(self).map_err(|e| bad("effective.toml", e.to_string()))
    }

    fn resolve_paths(&mut self, base: &Path) {
        self.each_path(&|p: &mut PathBuf| {
            if p.is_relative() && !base.as_os_str().is_empty() {
                *p = base.join(&*p).components().collect(); // without the "." of `input = ["."]`
            }
        });
    }

    /// Changes every path the configuration holds: inputs, results, catalogue, elements, flat, zeropoint, model.
    #[doc(hidden)]
    pub fn each_path(&mut self, fix: &dyn Fn(&mut PathBuf)) {
        self.night.input.iter_mut().for_each(fix);
        fix(&mut self.night.output);
        self.flat.master.iter_mut().for_each(fix);
        self.stars.iter_mut().for_each(|s| fix(&mut s.catalogue));
        self.zeropoint.previous.iter_mut().for_each(fix);
        self.orbit.iter_mut().for_each(|o| fix(&mut o.elements));
        self.fetch.cache.iter_mut().for_each(fix);
        if let Some(model) = &mut self.model {
            model.satellites.iter_mut().chain(&mut model.throughput).for_each(fix);
            if let Some(mut file) = model.band_file() {
                fix(&mut file);
                model.band = file.to_string_lossy().into_owned();
            }
        }
    }
}

/// How a FITS file begins.
const FITS_BEGINS: &str = "SIMPLE  =";

/// The error of a file that is no text in UTF-8, by what it is.
fn not_a_text(path: &Path, bytes: &[u8]) -> Error {
    let problem = if bytes.starts_with(FITS_BEGINS.as_bytes()) {
        "is a FITS file, not a configuration; name a pipeline.toml whose night.input lists this file or its folder \
         (`satphot init` writes one), or look at the file with `satphot inspect`"
    } else {
        "is not text in UTF-8; a configuration is a TOML file such as `satphot init` writes"
    };
    Error::NoInput { path: path.to_owned(), problem: problem.into() }
}

/// Tables and keys that a night cannot do without, each with a value that is refused until it is filled in, and what it
/// is; those of the last tables are needed where the table is there.
const NEEDED: [(&str, &[(&str, &str, &str)]); 7] = [
    (
        "night",
        &[
            ("name", "\"\"", "name of the night"),
            ("input", "[]", "folders or files of the frames"),
            ("output", "\"\"", "folder of the results"),
        ],
    ),
    (
        "site",
        &[
            ("name", "\"\"", "name of the site"),
            ("lat_deg", "nan", "latitude, north positive [deg]"),
            ("lon_deg", "nan", "longitude, east positive [deg]"),
            ("alt_m", "nan", "height [m]"),
        ],
    ),
    (
        "telescope",
        &[
            ("name", "\"\"", "name of the telescope"),
            ("aperture_m", "nan", "clear aperture [m]"),
            ("focal_length_mm", "nan", "focal length [mm]"),
        ],
    ),
    (
        "detector",
        &[
            ("camera", "\"\"", "a camera of the table, e.g. asi6200mm, or any name with detector.e_per_adu"),
            ("pixel_um", "nan", "pixel pitch, unbinned [um]"),
            ("pedestal_adu", "nan", "bias level of a raw frame [ADU]"),
        ],
    ),
    (
        "stars",
        &[
            ("catalogue", "\"\"", "star catalogue; `fetch stars` gets one"),
            ("bv_range_mag", "[nan, nan]", "range of B-V of the stars [mag]"),
            ("v_range_mag", "[nan, nan]", "range of V of the stars [mag]"),
        ],
    ),
    ("orbit", &[("elements", "\"\"", "file of elements; `fetch elements` gets one")]),
    ("model", &[("satellite", "\"\"", "a satellite of the catalogue; `satellites` lists them")]),
];
/// Tables of [`NEEDED`] that a night may do without.
const OPTIONAL: [&str; 3] = ["stars", "orbit", "model"];

/// The error of a configuration that lacks keys, naming all of them with the lines to paste; any other error as it is.
fn with_all_missing((error, unknown_key): (Error, bool), table: &Table) -> Error {
    if unknown_key {
        return error; // the key that is missing may be the one that is misspelt
    }
    let mut n = 0;
    let mut lines = String::new();
    for (name, keys) in NEEDED {
        let there = match table.get(name) {
            None if OPTIONAL.contains(&name) => continue,
            None => None,
            Some(Value::Table(there)) => Some(there),
            Some(_) => return error,
        };
        let lacking: Vec<_> = keys.iter().filter(|(key, ..)| there.is_none_or(|t| !t.contains_key(*key))).collect();
        if !lacking.is_empty() {
            lines += &format!("\n[{name}]");
        }
        for (key, value, what) in lacking {
            lines += &format!("\n{key} = {value}   # {what}");
            n += 1;
        }
    }
    match n {
        0 => error,
        1 => bad("pipeline.toml", format!("a key is missing; the line to paste, with your value:{lines}")),
        _ => bad("pipeline.toml", format!("{n} keys are missing; the lines to paste, with your values:{lines}")),
    }
}

impl Config {
    /// The line that fetches the `elements` or the `stars` this configuration names, for messages.
    #[doc(hidden)]
    #[must_use]
    pub fn fetch_line(&self, what: &str) -> String {
        let file = match self.file.to_string_lossy() {
            file if file.is_empty() => "pipeline.toml".to_owned(),
            file if file.contains([' ', '\'', '"', '$', '&', ';', '(', ')']) => format!("{file:?}"),
            file => file.into_owned(),
        };
        let numbered = self.orbit.as_ref().is_some_and(|o| o.norad_cat_id.is_some());
        let which = if what == "elements" && !numbered { " --norad NUMBER" } else { "" };
        format!("satphot fetch {what} -c {file}{which}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NIGHT: &str = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\"in\"]\noutput = \"out\"\n";

    #[test]
    fn a_preset_and_four_lines_make_a_configuration() {
        let c = Config::from_text(NIGHT, &[]).unwrap();
        assert_eq!(c.photometry.clip_radius_px, Some(2500.0));
        assert_eq!(c.detector.camera, "asi6200mm");
    }

    #[test]
    fn a_typing_error_names_the_nearest_key() {
        let e = Config::from_text(&format!("{NIGHT}[photometry]\nclip_radius = 1.0\n"), &[]).unwrap_err().to_string();
        assert!(e.contains("photometry.clip_radius:") && e.contains("did you mean \"clip_radius_px\""), "{e}");
        let e = Config::from_text(&format!("{NIGHT}[photometri]\n"), &[]).unwrap_err().to_string();
        assert!(e.contains("\"photometry\""), "{e}");
    }

    #[test]
    fn all_missing_keys_are_named_at_once_with_lines_that_are_refused_until_filled_in() {
        let text = "[night]\nname = \"n\"\noutput = \"o\"\n[telescope]\naperture_m = 0.6\n[detector]\n[orbit]\n";
        let e = Config::from_text(text, &[]).unwrap_err().to_string();
        for word in [
            "11 keys",
            "[night]\ninput",
            "[site]\nname",
            "lat_deg",
            "focal_length_mm",
            "pedestal_adu",
            "[orbit]\nelements",
        ] {
            assert!(e.contains(word), "{word} is not in\n{e}");
        }
        for word in ["[stars]", "[model]", "output =", "aperture_m ="] {
            assert!(!e.contains(word), "{word} is in\n{e}");
        }
        // the lines as they are do not pass for a configuration
        let lacks_site = "[night]\nname = \"n\"\ninput = [\"i\"]\noutput = \"o\"\n[telescope]\nname = \"\"\naperture_m = 0.6\n\
                          focal_length_mm = 3962.0\n[detector]\ncamera = \"asi6200mm\"\npixel_um = 3.76\npedestal_adu = 500.0\n";
        let e = Config::from_text(lacks_site, &[]).unwrap_err().to_string();
        let lines = &e[e.find("[site]").unwrap()..];
        let e = Config::from_text(&format!("{lacks_site}{lines}\n"), &[]).unwrap_err().to_string();
        assert!(e.contains("site.lat_deg") && e.contains("NaN"), "{e}");
        // a misspelt key is reported as one
        let e =
            Config::from_text(&lacks_site.replace("focal_length_mm", "focal_lenght_mm"), &[]).unwrap_err().to_string();
        assert!(e.contains("did you mean \"focal_length_mm\""), "{e}");
    }

    #[test]
    fn set_wins_over_the_file_and_is_checked_like_it() {
        let c = Config::from_text(NIGHT, &["photometry.aper_r_fwhm=3".into(), "night.name=zwei".into()]).unwrap();
        assert_eq!((c.photometry.aper_r_fwhm, c.night.name.as_str()), (3.0, "zwei"));
        let e = Config::from_text(NIGHT, &["photometry.aper_r_fwhm=-1".into()]).unwrap_err().to_string();
        assert!(e.contains("photometry.aper_r_fwhm") && e.contains("-1") && e.contains("FWHM"), "{e}");
        assert!(Config::from_text(NIGHT, &["nonsense".into()]).is_err());
    }

    #[test]
    fn the_saved_configuration_reads_back_the_same() {
        let c = Config::from_text(NIGHT, &[]).unwrap();
        let text = c.to_toml().unwrap();
        let again = Config::from_text(&text, &[]).unwrap();
        assert_eq!(again.to_toml().unwrap(), text);
    }

    #[test]
    fn the_template_shows_every_key_and_only_keys() {
        let template = include_str!("../presets/template.toml");
        let is_setting = |l: &str| {
            let word = l.trim_start_matches(['[', '"']).split(['=', ']', '"', ' ']).next().unwrap_or("");
            (l.contains('=') || l.starts_with('['))
                && !word.is_empty()
                && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '.')
        };
        let all: Vec<&str> =
            template.lines().map(|l| l.strip_prefix("# ").filter(|rest| is_setting(rest)).unwrap_or(l)).collect();
        let config = Config::from_text(&all.join("\n"), &[]).unwrap();
        for line in config.to_toml().unwrap().lines().filter(|l| is_setting(l)) {
            let key = line.trim_start_matches(['[', '"']).split(['=', ']', '"', ' ']).next().unwrap();
            let name = key.rsplit('.').next().unwrap();
            assert!(template.contains(name), "{key} is not in the template");
        }
    }
}
