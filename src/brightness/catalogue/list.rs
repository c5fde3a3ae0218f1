//! The satellites by name: those of the program, and a file of the user before them.

use super::Satellite;
use super::entry::Entry;
use crate::base::error::Error;
use crate::base::error::Result;
use crate::config::read_layers;
use serde::Deserialize;
use serde::Serialize;
use std::path::Path;
use std::sync::LazyLock;

/// The catalogue that comes with the program.
pub(super) const TEXT: &str = include_str!("../../presets/satellites.toml");

/// Read once; a test sees to it that it can be.
pub(super) static EMBEDDED: LazyLock<Result<Vec<Entry>>> = LazyLock::new(|| entries(TEXT));

/// `[[satellites]]`: the form of the catalogue.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Listing {
    pub(super) satellites: Vec<Entry>,
}

/// Satellites by name: those of a file first, then those that come with the program.
#[derive(Debug, Clone, PartialEq)]
pub struct Catalogue {
    pub(super) entries: Vec<Entry>,
}

impl Catalogue {
    /// The catalogue that comes with the program, with the user's file before it, if there is one.
    ///
    /// # Errors
    /// [`Error::Io`] for a file that cannot be read, [`Error::Config`] naming file and key for what is in it.
    pub fn load(file: Option<&Path>) -> Result<Self> {
        let mut entries = match file {
            None => Vec::new(),
            Some(path) => {
                let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
                let own = entries(&text).and_then(|own| own.iter().try_for_each(usable).map(|()| own));
                own.map_err(|error| in_file(error, path))?
            }
        };
        let own: Vec<String> = entries.iter().map(|e| plain(&e.name)).collect();
        entries.extend(embedded().iter().filter(|e| !own.contains(&plain(&e.name))).cloned());
        Ok(Self { entries })
    }

    /// Every satellite.
    #[must_use]
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// A satellite by name or alias; case and `_` or blank for `-` do not matter.
    ///
    /// # Errors
    /// [`Error::Config`] for an unknown name: the nearest one and all others in the message.
    pub fn find(&self, name: &str) -> Result<&Entry> {
        find(&self.entries, name).ok_or_else(|| unknown(&self.entries, name))
    }
}

/// Every name [`Satellite::named`] knows, aliases left out.
#[must_use]
pub fn catalogue_names() -> Vec<&'static str> {
    embedded().iter().map(|e| e.name.as_str()).collect()
}

/// Entries as a file of satellites, the form [`Catalogue::load`] reads.
///
/// # Errors
/// [`Error::Model`] if a number cannot be written as TOML.
pub fn catalogue_toml(entries: &[Entry]) -> Result<String> {
    toml::to_string(&Listing { satellites: entries.to_vec() }).map_err(|e| Error::Model { problem: e.to_string() })
}

/// Whether the engine takes it.
pub(super) fn usable(entry: &Entry) -> Result<()> {
    Satellite::try_from(entry).map(drop)
}

/// An error that says which file it is in.
pub(super) fn in_file(error: Error, path: &Path) -> Error {
    let at = |problem: String| format!("{} (in {})", problem.trim_end(), path.display());
    match error {
        Error::Config { key, problem } if key == "pipeline.toml" => {
            Error::Config { key: "satellites".into(), problem: at(problem) }
        }
        Error::Config { key, problem } => Error::Config { key, problem: at(problem) },
        Error::Model { problem } => Error::Model { problem: at(problem) },
        other => other,
    }
}

pub(super) fn embedded() -> &'static [Entry] {
    EMBEDDED.as_deref().unwrap_or_default()
}

/// The satellites of a text, every number checked, no name twice.
pub(super) fn entries(text: &str) -> Result<Vec<Entry>> {
    let Listing { satellites } = read_layers(text, &[])?;
    for (at, entry) in satellites.iter().enumerate() {
        let key = format!("satellites.{}", entry.name);
        if entry.name.is_empty() || plain(&entry.name) != entry.name {
            let problem = format!("\"{}\" is no name: lower case, hyphens for blanks", entry.name);
            return Err(Error::Config { key, problem });
        }
        let names = std::iter::once(&entry.name).chain(&entry.aliases);
        for name in names {
            if find(&satellites[..at], name).is_some() {
                return Err(Error::Config { key, problem: format!("\"{name}\" stands for two satellites") });
            }
        }
        entry.check(&key)?;
    }
    Ok(satellites)
}

pub(super) fn find<'a>(entries: &'a [Entry], name: &str) -> Option<&'a Entry> {
    let wanted = plain(name);
    let alias = |e: &&Entry| e.aliases.iter().any(|alias| plain(alias) == wanted);
    entries.iter().find(|e| plain(&e.name) == wanted).or_else(|| entries.iter().find(alias))
}

pub(super) fn plain(name: &str) -> String {
    name.trim().to_lowercase().replace(['_', ' '], "-")
}

pub(super) fn unknown(entries: &[Entry], name: &str) -> Error {
    let wanted = plain(name);
    let near = |e: &Entry| {
        let names = std::iter::once(&e.name).chain(&e.aliases);
        names.map(|n| strsim::jaro_winkler(&plain(n), &wanted)).fold(0.0, f64::max)
    };
    let nearest = entries.iter().filter(|e| near(e) > 0.7).max_by(|a, b| near(a).total_cmp(&near(b)));
    let hint = nearest.map(|e| format!("; did you mean \"{}\"?", e.name)).unwrap_or_else(|| ";".into());
    let known: Vec<&str> = entries.iter().map(|e| e.name.as_str()).collect();
    Error::Config {
        key: "model.satellite".into(),
        problem: format!(
            "\"{name}\" is not in the catalogue{hint} known: {}. Or list model.surfaces, or name a file in \
             model.satellites",
            known.join(", ")
        ),
    }
}
