//! What goes into a night: files, their digest, the simulation they are from.

use crate::base::file::file_name;
use crate::base::hash::sha256_16_text;
use crate::config::Config;
use crate::config::Model;
use crate::export::DataMode;
use crate::frames::{Exposure, Role};
use crate::pipeline::survey::files::Survey;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::path::PathBuf;

/// What became of an input file, as plans and manifests record it under `role`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum InputRole {
    /// A frame whose header could be read.
    Frame(Role),
    /// A file whose header could not be read.
    Unreadable,
    /// A frame that does not belong to the others of the night.
    SetAside,
}

impl InputRole {
    /// A flat field.
    pub const FLAT: Self = Self::Frame(Role::Flat);
    /// A frame of a star pointing.
    pub const STARS: Self = Self::Frame(Role::Stars);
    /// A frame of the tracked satellite.
    pub const TARGET: Self = Self::Frame(Role::Target);

    /// Its name on disk.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            InputRole::Frame(role) => role.name(),
            InputRole::Unreadable => "unreadable",
            InputRole::SetAside => "set_aside",
        }
    }

    fn all() -> impl Iterator<Item = Self> {
        Role::ALL.map(Self::Frame).into_iter().chain([Self::Unreadable, Self::SetAside])
    }
}

impl From<InputRole> for String {
    fn from(role: InputRole) -> Self {
        role.name().to_owned()
    }
}

impl TryFrom<String> for InputRole {
    type Error = String;

    fn try_from(name: String) -> std::result::Result<Self, String> {
        // the manifest of a run writes `othertarget` where a plan writes `other target`
        Self::all().find(|role| role.name() == name || role.name().replace(' ', "") == name).ok_or_else(|| {
            let known: Vec<&str> = Self::all().map(Self::name).collect();
            format!("\"{name}\" is not the role of a file; known: {}", known.join(", "))
        })
    }
}

/// Hash over the names and hashes of all inputs, whatever their order: those of a manifest or of a plan.
#[must_use]
pub fn inputs_sha256<'a>(inputs: impl Iterator<Item = (&'a Path, &'a str)>) -> String {
    let mut lines: Vec<String> = inputs.map(|(path, hash)| format!("{} {hash}", file_name(path))).collect();
    lines.sort();
    sha256_16_text(&lines.join("\n"))
}

/// The program and its version.
pub const TOOL: &str = concat!("satphot ", env!("CARGO_PKG_VERSION"));

/// The files that a configuration names besides the frames, by the key that names them.
#[must_use]
pub fn named_files(config: &Config) -> Vec<(&'static str, PathBuf)> {
    let mut files: Vec<(&'static str, Option<&PathBuf>)> = vec![
        ("flat.master", config.flat.master.as_ref()),
        ("stars.catalogue", config.stars.as_ref().map(|s| &s.catalogue)),
        ("zeropoint.previous", config.zeropoint.previous.as_ref()),
        ("orbit.elements", config.orbit.as_ref().map(|o| &o.elements)),
    ];
    if let Some(model) = &config.model {
        files.push(("model.satellites", model.satellites.as_ref()));
        files.push(("model.throughput", model.throughput.as_ref()));
    }
    let band = config.model.as_ref().and_then(Model::band_file);
    files.push(("model.band", band.as_ref()));
    files.into_iter().filter_map(|(key, path)| Some((key, path?.clone()))).collect()
}

/// The seed of a night of which a frame is drawn: SIMSEED of the first one that has it.
#[must_use]
pub fn simulation_seed(survey: &Survey) -> Option<i64> {
    let exposures = survey.flats.iter().chain(survey.pointings.iter().flatten()).chain(&survey.targets);
    exposures.map(|e: &Exposure| e.header.integer(SEED.1)).find(Option::is_some).flatten()
}

/// Whether the night is of the sky: the meta key `data_mode`, SIMULATED as soon as one frame of it is drawn.
///
/// `satphot simulate` marks its frames with SIMSEED and in SWCREATE.
#[must_use]
pub fn data_mode(survey: &Survey) -> DataMode {
    let drawn = |e: &Exposure| {
        e.header.card("SIMSEED").is_some()
            || e.header.text("SWCREATE").is_some_and(|t| t.starts_with("satphot") && t.contains("simulate"))
    };
    let pointings = survey.pointings.iter().flatten();
    match survey.flats.iter().chain(pointings).chain(&survey.targets).any(drawn) {
        true => DataMode::Simulated,
        false => DataMode::Real,
    }
}

/// The key of the seed of a night that is drawn, and its card, which every frame of `satphot simulate` has.
pub const SEED: (&str, &str) = ("seed", "SIMSEED");
