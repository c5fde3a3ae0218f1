//! The satellites by name: those of the program, and a file of the user before them.

use super::entry::Entry;
use super::standing::Standing;
use crate::base::error::Error;
use crate::base::error::Result;
use crate::brightness::predictive::Predictive;
use crate::brightness::surface::Surface;
use crate::config;
use crate::config::Effects;
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

    /// Every entry that an object of this name and catalogue number is one of, as far as `objects` say; those that list the number
    /// first, since a number is of one object and a name may be written in many ways.
    #[must_use]
    pub fn of_object(&self, name: &str, number: u64) -> Vec<&Entry> {
        let (by_number, by_name): (Vec<&Entry>, Vec<&Entry>) =
            self.entries.iter().filter(|e| e.is_of(name, number)).partition(|e| e.has_number(number));
        by_number.into_iter().chain(by_name).collect()
    }

    /// The entry that an object is one of: the first of [`Catalogue::of_object`], where the others are variants of it (`iss`,
    /// `iss-inferred`).
    ///
    /// # Errors
    /// Their names, where several designs list the object, as all generations of Starlink do, or none.
    pub fn design_of(&self, name: &str, number: u64) -> std::result::Result<&Entry, Vec<&str>> {
        let fitting = self.of_object(name, number);
        match fitting.split_first() {
            Some((first, rest)) if rest.iter().all(|e| e.name.starts_with(&format!("{}-", first.name))) => Ok(first),
            _ => Err(fitting.iter().map(|e| e.name.as_str()).collect()),
        }
    }
}

/// Every name [`Satellite::named`] knows, aliases excluded.
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
            let problem = format!("\"{}\" is not a name: use lower case, and hyphens for blanks", entry.name);
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
            "\"{name}\" is not in the catalogue{hint} known: {}. `satphot \
             satellites` describes them; own ones stand in model.surfaces, or in a file that model.satellites names",
            known.join(", ")
        ),
    }
}

/// A satellite as the model sees it: flat surfaces, each with its area, attitude and scattering.
///
/// ```
/// let iss = satphot::Satellite::named("ISS").expect("is in the catalogue");
/// let area_m2: f64 = iss.surfaces.iter().map(|s| s.area_m2).sum();
/// assert!((1_000.0..10_000.0).contains(&area_m2));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Satellite {
    /// Name.
    pub name: String,
    /// Its surfaces; none for an empirical model.
    pub surfaces: Vec<Surface>,
    /// How its magnitude depends on phase angle and range, where its surfaces are not known.
    pub empirical: Option<config::Empirical>,
    /// Where areas and scattering are from.
    pub source: String,
    /// What observations say of its magnitudes.
    #[doc(hidden)]
    pub standing: Standing,
    /// How far magnitudes may be from the predicted ones; `None` where they were not compared.
    #[doc(hidden)]
    pub predictive: Option<Predictive>,
}

impl Standing {
    /// That of the satellite a configuration names; surfaces of one's own were not compared.
    ///
    /// # Errors
    /// As [`Catalogue::load`] and [`Catalogue::find`].
    pub fn of(model: &config::Model) -> Result<Self> {
        if !model.surfaces.is_empty() {
            return Ok(Self::default());
        }
        Ok(Self::from(Catalogue::load(model.satellites.as_deref())?.find(&model.satellite)?))
    }
}

impl Satellite {
    /// A satellite of these surfaces, from nowhere else.
    #[must_use]
    pub fn of(name: &str, surfaces: Vec<Surface>) -> Self {
        let (source, standing) = ("own surfaces".into(), Standing::default());
        Self { name: name.into(), surfaces, empirical: None, source, standing, predictive: None }
    }

    /// A satellite of the catalogue that comes with the program; case and `_` or blank for `-` do not matter.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::try_from(find(embedded(), name)?).ok()
    }

    /// The satellite a configuration names: its own surfaces if it lists any, else that of its file of satellites,
    /// else the catalogue's. `model.effects` are not in it yet, see [`Satellite::with_effects`].
    ///
    /// # Errors
    /// [`Error::Config`] for an unknown name (the known ones listed, the nearest first) and for a damaged file;
    /// [`Error::Model`] for surfaces that are no reflectors.
    #[doc(hidden)]
    pub fn from_config(model: &config::Model) -> Result<Self> {
        if model.surfaces.is_empty() {
            let catalogue = Catalogue::load(model.satellites.as_deref())?;
            return Self::try_from(catalogue.find(&model.satellite)?);
        }
        let surfaces = built(&model.surfaces, "model")?;
        Ok(Satellite {
            name: model.satellite.clone(),
            surfaces,
            empirical: None,
            source: "configuration, model.surfaces".into(),
            standing: Standing::default(),
            predictive: None,
        })
    }

    /// What observations say of it, on a line of its own, the name before it.
    #[doc(hidden)]
    #[must_use]
    pub fn standing_line(&self) -> String {
        format!("model {}: {}\n", self.name, self.standing.text())
    }

    /// The satellite under the choices for arrays and backs; doing it twice changes nothing more.
    #[doc(hidden)]
    #[must_use]
    pub fn with_effects(self, effects: &Effects) -> Self {
        let under = |s: Surface| s.with_arrays(effects.arrays).with_backs(effects.backs);
        Satellite { surfaces: self.surfaces.into_iter().map(under).collect(), ..self }
    }
}

impl TryFrom<&Entry> for Satellite {
    type Error = Error;

    fn try_from(entry: &Entry) -> Result<Self> {
        let word = |what: &str| entry.sources.get(what).map(|source| format!("{what}: {source}"));
        let mut sources: Vec<String> = ["areas", "scattering", "empirical"].into_iter().filter_map(word).collect();
        if sources.is_empty() {
            sources.push("no source given".into());
        }
        Ok(Satellite {
            name: entry.name.clone(),
            surfaces: built(&entry.surfaces, &format!("satellites.{}", entry.name))?,
            empirical: entry.empirical.clone(),
            source: sources.join("; "),
            standing: Standing::from(entry),
            predictive: Predictive::of(entry),
        })
    }
}

/// The surfaces of the engine, each a reflector; what is wrong with one names its key, `at` being the satellite's.
pub(super) fn built(surfaces: &[config::Surface], at: &str) -> Result<Vec<Surface>> {
    let one = |s: &config::Surface| {
        let surface = Surface::try_from(s)?;
        surface.check().map(|()| surface)
    };
    let place = |error: Error, s: &config::Surface| match error {
        Error::Config { key, problem } => Error::Config { key: format!("{at}.surfaces.{}.{key}", s.name), problem },
        Error::Model { problem } => Error::Model { problem: format!("{at}.surfaces.{problem}") },
        other => other,
    };
    surfaces.iter().map(|s| one(s).map_err(|error| place(error, s))).collect()
}
