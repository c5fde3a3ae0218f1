//! The provenance that every product states: program, configuration, inputs, gain table, elements, catalogue, seed.
//!
//! Hashes are the first 16 hex digits of SHA-256. Files go by their names, never by the folders they lie in; nothing
//! here knows the clock or the machine, so that the same night gives the same bytes anywhere. It does not cover times
//! and memory ([`super::manifest`]) and the checks ([`super::verify`]).

use super::inputs::SEED;
use super::inputs::TOOL;
use std::path::Path;

use super::inputs::inputs_sha256;
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::base::file::write_atomic;
use crate::base::hash::sha256_16;
use crate::base::hash::sha256_16_text;
use crate::base::time::iso_utc;
use crate::config::digest::config_sha256;
use crate::config::{Config, Orbit};
use crate::fits::{CardLine, CardValue};
use crate::frames::{Detector, Exposure};
use crate::orbit::read_elements_for;
use crate::tables::Meta;

/// Keys that every product of a night must state, and their keywords in a FITS header.
pub const KEYS: [(&str, &str, &str); 14] = [
    ("tool", "SWCREATE", "program"),
    ("config_sha256", "CONFHASH", "SHA-256 of the configuration"),
    ("input_manifest_sha256", "INPHASH", "SHA-256 over the inputs"),
    ("gain_table", "GAINTAB", "gain table"),
    ("gain_table_sha256", "GAINHASH", "SHA-256 of the gain table"),
    ("catalogue", "CATALOG", "star catalogue"),
    ("catalogue_sha256", "CATHASH", "SHA-256 of the star catalogue"),
    ("orbit_source", "ELEMENTS", "file of elements"),
    ("orbit_sha256", "ELEMHASH", "SHA-256 of the elements"),
    ("orbit_epochs", "ELEMEPO", "epochs of the elements"),
    ("zeropoint_file", "ZPFILE", "zeropoint of another night"),
    ("zeropoint_file_sha256", "ZPHASH", "SHA-256 of that file"),
    ("flat_file", "FLATFILE", "master flat that was given"),
    ("flat_file_sha256", "FLATHASH", "SHA-256 of that file"),
];
/// The keys of a master flat.
pub const OF_FLAT: [&str; 6] =
    ["tool", "config_sha256", "input_manifest_sha256", "gain_table", "gain_table_sha256", SEED.0];

/// Keys and values, in order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Provenance(pub Vec<(&'static str, String)>);

impl Provenance {
    /// The provenance of a configuration, with the hash over all inputs and the seed of a drawn night where they are
    /// known. A file that cannot be read has no hash: whoever needs it says so.
    ///
    /// # Errors
    /// [`Error::Config`] if the configuration cannot be written as text for its hash.
    pub fn of(config: &Config, inputs_sha256: Option<&str>, seed: Option<i64>) -> Result<Self> {
        Self::hashed(config, inputs_sha256, seed, &|path| sha256_16(path).ok())
    }

    pub(crate) fn hashed(
        config: &Config,
        inputs_sha256: Option<&str>,
        seed: Option<i64>,
        hash_of: &dyn Fn(&Path) -> Option<String>,
    ) -> Result<Self> {
        let mut entries = vec![("tool", TOOL.to_string()), ("config_sha256", config_sha256(config)?)];
        entries.extend(inputs_sha256.map(|hash| ("input_manifest_sha256", hash.to_string())));
        if let Ok(detector) = Detector::from_config(&config.detector) {
            let (name, table) = detector.gain_table();
            entries.extend([("gain_table", name), ("gain_table_sha256", sha256_16_text(&table))]);
        }
        let file = |entries: &mut Vec<_>, name: &'static str, hash: &'static str, path: &Path| {
            entries.push((name, file_name(path)));
            entries.extend(hash_of(path).map(|sha| (hash, sha)));
        };
        if let Some(stars) = &config.stars {
            file(&mut entries, "catalogue", "catalogue_sha256", &stars.catalogue);
        }
        if let Some(orbit) = &config.orbit {
            file(&mut entries, "orbit_source", "orbit_sha256", &orbit.elements);
            entries.extend(epochs(orbit).map(|epochs| ("orbit_epochs", epochs)));
        }
        if let Some(path) = &config.zeropoint.previous {
            file(&mut entries, "zeropoint_file", "zeropoint_file_sha256", path);
        }
        if let Some(path) = &config.flat.master {
            file(&mut entries, "flat_file", "flat_file_sha256", path);
        }
        entries.extend(seed.map(|seed| (SEED.0, seed.to_string())));
        Ok(Self(entries))
    }

    /// The provenance that the meta block of a table of the night states.
    #[must_use]
    pub fn of_meta(meta: &Meta) -> Self {
        let flat = meta.flat();
        let keys = KEYS.iter().map(|(key, ..)| *key).chain([SEED.0]);
        let recorded = |key| flat.iter().find(|(k, _)| k == key).map(|(_, value)| (key, value.clone()));
        Self(keys.filter_map(recorded).collect())
    }

    /// The provenance of a master flat. Its only inputs are its flats, so it stays the same when other frames of the
    /// night change. `hash` returns the hash of a file.
    ///
    /// # Errors
    /// The errors of [`Provenance::of`].
    pub fn of_flat(config: &Config, flats: &[Exposure], hash: &dyn Fn(&Path) -> Option<String>) -> Result<Self> {
        let hashes: Vec<String> = flats.iter().map(|e| hash(&e.path).unwrap_or_default()).collect();
        let inputs = inputs_sha256(flats.iter().map(|e| e.path.as_path()).zip(hashes.iter().map(String::as_str)));
        let seed = flats.iter().find_map(|e| e.header.integer(SEED.1));
        let mut provenance = Self::of(config, Some(&inputs), seed)?;
        provenance.0.retain(|(key, _)| OF_FLAT.contains(key));
        Ok(provenance)
    }

    /// The value of a key.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&str> {
        self.0.iter().find(|(k, _)| *k == key).map(|(_, value)| value.as_str())
    }

    /// As cards of a FITS header.
    #[must_use]
    pub fn cards(&self) -> Vec<CardLine> {
        let plain = |text: &str| text.chars().map(|c| if (' '..='~').contains(&c) { c } else { '?' }).collect();
        let card = |(key, value): &(&str, String)| {
            if *key == SEED.0 {
                let seed = value.parse().map_or(CardValue::Text(plain(value)), CardValue::Integer);
                return Some((SEED.1.to_string(), seed, "seed of the drawn frames".to_string()));
            }
            let (_, keyword, comment) = KEYS.iter().find(|(k, _, _)| k == key)?;
            Some(((*keyword).to_string(), CardValue::Text(plain(value)), (*comment).to_string()))
        };
        self.0.iter().filter_map(card).collect()
    }

    /// In one line: `tool=satphot 0.1.0; config_sha256=…`.
    #[must_use]
    pub fn line(&self) -> String {
        // a comment of HTML ends at two dashes; a line at its end
        let plain = |text: &str| text.replace("--", "- -").replace(|c: char| c.is_control(), " ");
        let pairs: Vec<String> = self.0.iter().map(|(key, value)| format!("{key}={}", plain(value))).collect();
        format!("provenance: {}", pairs.join("; "))
    }

    /// The line as a comment of TOML.
    #[must_use]
    pub fn toml_comment(&self) -> String {
        format!("# {}\n", self.line())
    }

    /// Puts the line, as a comment, at the end of a finished text file: `.toml`, `.svg`, `.html`. Others are left alone.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn stamp(&self, path: &Path) -> Result<()> {
        let comment = match path.extension().and_then(|e| e.to_str()) {
            Some("toml") => self.toml_comment(),
            Some("svg" | "html") => format!("<!-- {} -->\n", self.line()),
            _ => return Ok(()),
        };
        let mut text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        if !text.ends_with('\n') {
            text.push('\n');
        }
        write_atomic(path, (text + &comment).as_bytes())
    }
}

/// `2025-06-10T10:07:36Z` of one set of elements, `first .. last (n sets)` of several; those of the object alone.
fn epochs(orbit: &Orbit) -> Option<String> {
    let (sets, _) = read_elements_for(&orbit.elements, orbit.norad_cat_id).ok()?;
    let wanted = |id: u64| orbit.norad_cat_id.is_none_or(|n| n == id);
    let mut epochs: Vec<_> = sets.iter().filter(|s| wanted(s.norad_cat_id())).map(|s| s.epoch()).collect();
    epochs.sort();
    match epochs.as_slice() {
        [] => None,
        [one] => Some(iso_utc(*one, 0)),
        [first, .., last] => Some(format!("{} .. {} ({} sets)", iso_utc(*first, 0), iso_utc(*last, 0), epochs.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config() -> Config {
        let night = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\"i\"]\noutput = \"o\"\n\
                     [stars]\ncatalogue = \"/nowhere/stars.csv\"\nbv_range_mag = [0.2, 0.9]\nv_range_mag = [8.0, 14.0]\n";
        Config::from_text(night, &[]).unwrap()
    }

    #[test]
    fn what_is_reported_has_no_folder_and_changes_with_the_gain_table() {
        let provenance = Provenance::of(&config(), Some("abc"), Some(7)).unwrap();
        assert_eq!(provenance.get("catalogue"), Some("stars.csv"));
        assert_eq!((provenance.get("catalogue_sha256"), provenance.get("seed")), (None, Some("7")));
        assert!(!provenance.line().contains("/nowhere"), "{}", provenance.line());
        let mut other = config();
        other.detector.e_per_adu.insert("200".into(), 0.123);
        let other = Provenance::of(&other, Some("abc"), None).unwrap();
        assert_ne!(other.get("gain_table_sha256"), provenance.get("gain_table_sha256"));
        assert!(provenance.cards().iter().any(|(k, v, _)| k == "SIMSEED" && *v == CardValue::Integer(7)));
        assert!(provenance.cards().iter().all(|(k, _, _)| k.len() <= 8));
    }

    #[test]
    fn the_line_can_stand_in_a_comment_of_any_text() {
        let provenance = Provenance(vec![("tool", "a-->\nb".into())]);
        assert_eq!(provenance.line(), "provenance: tool=a- -> b");
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in [("a.toml", "x = 1"), ("a.svg", "<svg></svg>\n"), ("a.ecsv", "a\n")] {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            provenance.stamp(&path).unwrap();
            let stamped = std::fs::read_to_string(&path).unwrap();
            assert!(
                stamped.starts_with(text) && stamped.contains("provenance: ") != name.ends_with("ecsv"),
                "{stamped}"
            );
        }
        let read: toml::Table = std::fs::read_to_string(folder.path().join("a.toml")).unwrap().parse().unwrap();
        assert_eq!(read.len(), 1);
    }
}
