//! The satellites satphot knows by name, its own and the user's: areas, attitudes, scattering, and where each number is
//! from.
//!
//! Areas in m². The numbers themselves are in `presets/satellites.toml`; a file of the user has the same form.

mod entry;
mod list;
mod standing;

pub use list::{Catalogue, catalogue_names, catalogue_toml};

use list::{embedded, find};

use serde::{Deserialize, Serialize};

use super::surface::Surface;
use crate::base::error::{Error, Result};
use crate::config::{self, Effects};

pub use entry::{Component, ComponentSum, Counts, Entry, Shell, Span};
pub use standing::{NOT_COMPARED, Standing};

/// A satellite as the model sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Satellite {
    /// Name.
    pub name: String,
    /// Its surfaces.
    pub surfaces: Vec<Surface>,
    /// Where areas and scattering are from.
    pub source: String,
    /// What observations say of its magnitudes.
    pub standing: Standing,
}

impl Satellite {
    /// A satellite of these surfaces, from nowhere else.
    #[must_use]
    pub fn of(name: &str, surfaces: Vec<Surface>) -> Self {
        Self { name: name.into(), surfaces, source: "own surfaces".into(), standing: Standing::default() }
    }

    /// A satellite of the catalogue that comes with the program; case and `_` or blank for `-` do not matter.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::try_from(find(embedded(), name)?).ok()
    }

    /// The satellite a configuration asks for: its own surfaces if it lists any, else that of its file of satellites,
    /// else the catalogue's. `model.effects` are not in it yet, see [`Satellite::with_effects`].
    ///
    /// # Errors
    /// [`Error::Config`] for an unknown name (the known ones listed, the nearest first) and for a damaged file;
    /// [`Error::Model`] for surfaces that are no reflectors.
    pub fn from_config(model: &config::Model) -> Result<Self> {
        if model.surfaces.is_empty() {
            let catalogue = Catalogue::load(model.satellites.as_deref())?;
            return Self::try_from(catalogue.find(&model.satellite)?);
        }
        let surfaces = built(&model.surfaces, "model")?;
        Ok(Satellite {
            name: model.satellite.clone(),
            surfaces,
            source: "configuration, model.surfaces".into(),
            standing: Standing::default(),
        })
    }

    /// What observations say of it, on a line of its own, the name before it.
    #[must_use]
    pub fn standing_line(&self) -> String {
        format!("model {}: {}\n", self.name, self.standing.text())
    }

    /// The satellite under the choices for arrays and backs; doing it twice changes nothing more.
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
        let mut sources: Vec<String> = ["areas", "scattering"].into_iter().filter_map(word).collect();
        if sources.is_empty() {
            sources.push("no source given".into());
        }
        Ok(Satellite {
            name: entry.name.clone(),
            surfaces: built(&entry.surfaces, &format!("satellites.{}", entry.name))?,
            source: sources.join("; "),
            standing: Standing::from(entry),
        })
    }
}

/// The surfaces of the engine, each a reflector; what is wrong with one names its key, `at` being the satellite's.
fn built(surfaces: &[config::Surface], at: &str) -> Result<Vec<Surface>> {
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
