//! A satellite as named components: what a file of components states, and those that come with the program.
//!
//! Metres and degrees in the body frame (LVLH: x forward, y against the orbit's angular momentum, z to nadir). Areas
//! are checked against the catalogue's elsewhere. Not included: bending, and lattices, which count as closed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::joint::Joint;
use super::shape::Shape;
use super::shape::wrong;
use super::triangle::Body;
use super::triangle::Triangle;
use crate::base::error::{Error, Result};
use crate::base::vector::Vector;
use crate::brightness::Brdf;
use crate::config::{self, read_layers};

/// The satellites that come with the program: name and text.
const EMBEDDED: [(&str, &str); 4] = [
    ("iss", include_str!("../presets/components/iss.toml")),
    ("css", include_str!("../presets/components/css.toml")),
    ("starlink-v2", include_str!("../presets/components/starlink-v2.toml")),
    ("bluebird-fm1", include_str!("../presets/components/bluebird-fm1.toml")),
];

/// A file of components.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Listing {
    name: String,
    title: String,
    #[serde(default)]
    aliases: Vec<String>,
    #[serde(default)]
    catalogue: Option<String>,
    #[serde(default)]
    notes: Vec<String>,
    #[serde(default)]
    sources: BTreeMap<String, String>,
    materials: BTreeMap<String, Listed>,
    #[serde(default)]
    joints: Vec<Joint>,
    components: Vec<Component>,
    #[serde(default)]
    points: BTreeMap<String, TestPoint>,
}

/// How a side scatters, by name of the material.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Listed {
    brdf: config::Brdf,
    #[serde(default)]
    back: Option<config::Brdf>,
}

/// A named part of a satellite.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Component {
    /// Its name.
    pub name: String,
    /// Name of its material.
    pub material: String,
    /// Its shape.
    pub shape: Shape,
    /// Where its centre is, joints at angle 0 \[m\].
    pub at_m: [f64; 3],
    /// The joint it turns with; absent = fixed to the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// The part or surface of the catalogue it is (a share of).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts_as: Option<String>,
}

/// A test point: a place on a component, looked at from a direction.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TestPoint {
    /// The component it is on.
    pub component: String,
    /// In the body frame with all joints at angle 0, turning with the component \[m\]; absent = anywhere on the face.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_m: Option<[f64; 3]>,
    /// The normal of the face, joints at angle 0; absent = the face that looks most nearly to the observer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
}

/// How both sides of a component scatter.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Its name.
    pub name: String,
    /// The front.
    pub front: Brdf,
    /// The back; `None` = black.
    pub back: Option<Brdf>,
}

/// A satellite of many components, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct ComponentSatellite {
    /// Name.
    pub name: String,
    /// Full name.
    pub title: String,
    /// Its entry in the catalogue of two-surface satellites.
    pub catalogue: Option<String>,
    /// What is excluded or uncertain.
    pub notes: Vec<String>,
    /// Where each group of numbers is from.
    pub sources: BTreeMap<String, String>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Joints, each after the one it sits on.
    pub joints: Vec<Joint>,
    /// Components.
    pub components: Vec<Component>,
    /// Named test points.
    pub points: BTreeMap<String, TestPoint>,
    /// Where meshes are looked for.
    folder: PathBuf,
}

impl ComponentSatellite {
    /// A satellite by name, or of a file that ends in `.toml`.
    ///
    /// # Errors
    /// [`Error::Config`] for an unknown name, with the known ones, and for a bad key; [`Error::Io`] for a file that
    /// cannot be read; [`Error::Model`] for components that make no sense.
    pub fn named(name: &str) -> Result<Self> {
        if name.to_ascii_lowercase().ends_with(".toml") {
            let path = Path::new(name);
            let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
            let folder = path.parent().unwrap_or(Path::new("."));
            return Self::parse(&text, folder).map_err(|error| in_file(error, path));
        }
        let plain = |n: &str| n.trim().to_lowercase().replace(['_', ' '], "-");
        let wanted = plain(name);
        for (own, text) in EMBEDDED {
            let satellite = Self::parse(text, Path::new("."))?;
            if own == wanted || Self::aliases(text).iter().any(|a| plain(a) == wanted) {
                return Ok(satellite);
            }
        }
        let known: Vec<&str> = EMBEDDED.iter().map(|(n, _)| *n).collect();
        Err(Error::Config {
            key: "satellite".into(),
            problem: format!(
                "no components of \"{name}\" are known; known: {}. Or name a file of components ending in .toml",
                known.join(", ")
            ),
        })
    }

    /// The names [`ComponentSatellite::named`] knows.
    #[must_use]
    pub fn names() -> Vec<&'static str> {
        EMBEDDED.iter().map(|(name, _)| *name).collect()
    }

    /// The text behind a name, to copy and change.
    #[must_use]
    pub fn text(name: &str) -> Option<&'static str> {
        EMBEDDED.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
    }

    fn aliases(text: &str) -> Vec<String> {
        read_layers::<Listing>(text, &[]).map(|l| l.aliases).unwrap_or_default()
    }

    /// A satellite from the text of a file of components; meshes are looked for in `folder`.
    ///
    /// # Errors
    /// [`Error::Config`] for unknown keys and names that stand for nothing; [`Error::Model`] for numbers out of range.
    pub fn parse(text: &str, folder: &Path) -> Result<Self> {
        let listing: Listing = read_layers(text, &[])?;
        let mut materials = Vec::new();
        for (name, law) in &listing.materials {
            let front = Brdf::try_from(&law.brdf)?;
            front.check(&format!("materials.{name}"))?;
            let back = law.back.as_ref().map(Brdf::try_from).transpose()?;
            back.as_ref().map_or(Ok(()), |b| b.check(&format!("materials.{name} (back)")))?;
            materials.push(Material { name: name.clone(), front, back });
        }
        let unknown = |key: String, what: &str, name: &str| Error::Config {
            key,
            problem: format!("\"{name}\" is no {what} of this file"),
        };
        for (k, joint) in listing.joints.iter().enumerate() {
            joint.check()?;
            let before = &listing.joints[..k];
            if before.iter().any(|j| j.name == joint.name) {
                return Err(wrong(&joint.name, "two joints of this name".into()));
            }
            if let Some(parent) = joint.on.as_ref().filter(|p| before.iter().all(|j| j.name != **p)) {
                return Err(unknown(format!("joints.{}.on", joint.name), "joint before this one", parent));
            }
        }
        if listing.components.is_empty() {
            return Err(wrong(&listing.name, "no components".into()));
        }
        for (k, part) in listing.components.iter().enumerate() {
            let key = |what: &str| format!("components.{}.{what}", part.name);
            if listing.components[..k].iter().any(|c| c.name == part.name) {
                return Err(wrong(&part.name, "two components of this name".into()));
            }
            if !listing.materials.contains_key(&part.material) {
                return Err(unknown(key("material"), "material", &part.material));
            }
            if let Some(joint) = part.joint.as_ref().filter(|j| listing.joints.iter().all(|o| o.name != **j)) {
                return Err(unknown(key("joint"), "joint", joint));
            }
            if let Some(bad) = part.at_m.iter().find(|x| !(x.abs() < 1e6)) {
                return Err(wrong(&part.name, format!("at_m holds {bad}; accepted is below 1e6 m")));
            }
        }
        for (name, point) in &listing.points {
            if listing.components.iter().all(|c| c.name != point.component) {
                return Err(unknown(format!("points.{name}.component"), "component", &point.component));
            }
        }
        let Listing { name, title, catalogue, notes, sources, joints, components, points, .. } = listing;
        let folder = folder.to_owned();
        Ok(Self { name, title, catalogue, notes, sources, materials, joints, components, points, folder })
    }

    /// The triangles of a component about the body's origin, joints at angle 0.
    ///
    /// # Errors
    /// Those of [`Shape::triangles`].
    pub fn triangles(&self, component: &Component, sides: usize) -> Result<Vec<Triangle<Body>>> {
        let [x, y, z] = component.at_m;
        let at = Vector::new(x, y, z);
        let about = component.shape.triangles(sides, &self.folder, &component.name)?;
        Ok(about.into_iter().map(|t| t.map(|v| v + at)).collect())
    }

    /// Index of the material of a component.
    pub(super) fn material_of(&self, component: &Component) -> usize {
        self.materials.iter().position(|m| m.name == component.material).unwrap_or(0)
    }
}

/// An error that says which file it is in.
fn in_file(error: Error, path: &Path) -> Error {
    match error {
        Error::Config { key, problem } => {
            Error::Config { key, problem: format!("{} (in {})", problem.trim_end(), path.display()) }
        }
        Error::Model { problem } => Error::Model { problem: format!("{problem} (in {})", path.display()) },
        other => other,
    }
}
