//! One satellite as a file states it: surfaces, orbits, counts, the parts its areas are summed from, sources.
//!
//! Areas in m², lengths in m, heights in km, angles in degrees, as in the file. Nothing here scatters light.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::base::error::{Error, Result};
use crate::config::{self, check_surface, range};

/// A satellite of the catalogue, or of the user's own file.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Name, lower case with hyphens, e.g. `starlink-v1.5`.
    pub name: String,
    /// Other names it is found by.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub aliases: Vec<String>,
    /// Which objects it is a model of: catalogue numbers, and names as elements have them, `*` for any ending.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<String>,
    /// What it is, in a few words.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// Scatter of observed less modelled magnitudes \[mag\], `sources.scatter` says of which; absent where they were
    /// not compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter_mag: Option<f64>,
    /// What must be said with every magnitude of it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub caveat: String,
    /// What a reader must know before using it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// What -> where it is from: `areas`, `attitudes`, `scattering`, `orbits`, `counts`, or any other word.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sources: BTreeMap<String, String>,
    /// How many there are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts: Option<Counts>,
    /// Where it flies.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub orbits: Vec<Shell>,
    /// Its surfaces, at least one unless `empirical` is given.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub surfaces: Vec<config::Surface>,
    /// How its magnitude depends on phase angle and range, where its surfaces are not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub empirical: Option<config::Empirical>,
    /// What a fit to observations rests on, where it is the result of one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<Fitted>,
    /// The parts the surfaces stand for, where they are known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub components: Vec<Component>,
}

/// The fit that an entry is the result of (`satphot fit`).
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Fitted {
    /// The table of observations.
    pub table: String,
    /// Magnitudes and limits.
    pub n: usize,
    /// Of those, limits.
    pub n_limits: usize,
    /// Passes, which have an offset each.
    pub n_passes: usize,
    /// First and last observation, UTC; empty where the table has no times.
    pub dates_utc: [String; 2],
    /// Phase angles of the observations \[deg\].
    pub phase_deg: [f64; 2],
    /// Their ranges \[km\].
    pub range_km: [f64; 2],
    /// Scale of the scatter within passes, a Student t of four degrees of freedom \[mag\].
    pub within_mag: f64,
    /// Standard deviation of the offsets of passes \[mag\].
    pub between_mag: f64,
    /// The parameters of the fit.
    pub parameters: Vec<String>,
    /// Their values.
    pub values: Vec<f64>,
    /// Their covariance.
    pub covariance: Vec<Vec<f64>>,
}

/// How many of a kind there are.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// Launched.
    pub launched: u64,
    /// Planned; a range where the plan is one.
    pub planned: Span,
    /// Date of the numbers, ISO 8601 as far as it is known.
    pub date: String,
}

/// A family of orbits.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Shell {
    /// Height above the ground \[km\].
    pub height_km: Span,
    /// Inclination \[deg\]; absent where it follows from the kind, e.g. Sun-synchronous.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inclination_deg: Option<Span>,
    /// What kind of orbit, in words.
    pub kind: String,
}

/// One number or a range.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(untagged, expecting = "expected a number or [from, to]")]
pub enum Span {
    /// One number.
    One(f64),
    /// From, to.
    Range([f64; 2]),
}

impl Span {
    /// Lowest and highest.
    #[must_use]
    pub fn bounds(&self) -> [f64; 2] {
        match *self {
            Span::One(value) => [value, value],
            Span::Range(bounds) => bounds,
        }
    }
}

impl std::fmt::Display for Span {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Span::One(value) => write!(f, "{value}"),
            Span::Range([low, high]) => write!(f, "{low}-{high}"),
        }
    }
}

/// A part of a satellite, as a table of components lists it.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Component {
    /// Name.
    pub name: String,
    /// The surface it belongs to.
    pub surface: String,
    /// Length \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_m: Option<f64>,
    /// Diameter or width \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diameter_m: Option<f64>,
    /// Area \[m²\] instead of length and diameter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area_m2: Option<f64>,
    /// How many.
    #[serde(default = "one")]
    pub count: u32,
    /// Listed, but not counted.
    #[serde(default, alias = "left_out", skip_serializing_if = "std::ops::Not::not")]
    pub excluded: bool,
}

fn one() -> u32 {
    1
}

impl Component {
    /// Area of all of them \[m²\]: `count · area`, else `count · length · diameter`.
    #[must_use]
    pub fn total_m2(&self) -> Option<f64> {
        let each = self.area_m2.or_else(|| Some(self.length_m? * self.diameter_m?))?;
        Some(f64::from(self.count) * each)
    }
}

/// What the components of one surface sum to, next to the area the surface is given.
#[derive(Debug, Clone, PartialEq)]
pub struct ComponentSum {
    /// The surface.
    pub surface: String,
    /// Sum of the components counted \[m²\].
    pub listed_m2: f64,
    /// Area of the surface \[m²\].
    pub published_m2: f64,
}

impl Entry {
    /// An entry of this name with nothing in it yet.
    #[must_use]
    pub fn named(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            aliases: Vec::new(),
            objects: Vec::new(),
            title: String::new(),
            scatter_mag: None,
            caveat: String::new(),
            notes: Vec::new(),
            sources: BTreeMap::new(),
            counts: None,
            orbits: Vec::new(),
            surfaces: Vec::new(),
            empirical: None,
            fit: None,
            components: Vec::new(),
        }
    }

    /// Whether an object of this name and catalogue number is one of its satellites, as far as `objects` says.
    #[must_use]
    pub fn is_of(&self, name: &str, number: u64) -> bool {
        let name = name.trim().to_lowercase();
        let fits = |object: &String| {
            let object = object.trim().to_lowercase();
            match object.strip_suffix('*') {
                Some(start) => !name.is_empty() && name.starts_with(start),
                None => !name.is_empty() && name == object,
            }
        };
        self.has_number(number) || self.objects.iter().any(fits)
    }

    /// Whether `objects` holds this catalogue number.
    #[must_use]
    pub fn has_number(&self, number: u64) -> bool {
        self.objects.iter().any(|object| object.trim().parse() == Ok(number))
    }

    /// Whether `objects` holds catalogue numbers: then an object of another number is none of its satellites.
    #[must_use]
    pub fn has_numbers(&self) -> bool {
        self.objects.iter().any(|object| object.trim().parse::<u64>().is_ok())
    }

    /// Area of all surfaces \[m²\].
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        self.surfaces.iter().map(|s| s.area_m2).sum()
    }

    /// For each surface that has components: their sum and the surface's own area.
    #[must_use]
    pub fn component_sums(&self) -> Vec<ComponentSum> {
        let of = |s: &config::Surface| {
            let mut parts = self.components.iter().filter(|c| c.surface == s.name && !c.excluded).peekable();
            parts.peek().is_some().then(|| ComponentSum {
                surface: s.name.clone(),
                listed_m2: parts.filter_map(Component::total_m2).sum(),
                published_m2: s.area_m2,
            })
        };
        self.surfaces.iter().filter_map(of).collect()
    }

    /// Where the component table and the areas in use disagree by more than 0.1 %, in words.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let differ = |s: &ComponentSum| (s.listed_m2 - s.published_m2).abs() > 1e-3 * s.published_m2;
        let tell = |s: &ComponentSum| {
            format!(
                "{}: the components of {} sum to {:.2} m2, published and used is {:.2} m2 ({:+.2} m2, {:+.3} mag)",
                self.name,
                s.surface,
                s.listed_m2,
                s.published_m2,
                s.published_m2 - s.listed_m2,
                -2.5 * (s.published_m2 / s.listed_m2).log10()
            )
        };
        self.component_sums().iter().filter(|s| differ(s)).map(tell).collect()
    }

    /// Checks every number; `key` is the entry's own, e.g. `satellites.iss`.
    ///
    /// # Errors
    /// [`Error::Config`] naming the key, the value and what is accepted.
    pub fn check(&self, key: &str) -> Result<()> {
        let bad = |key: String, problem: &str| Err(Error::Config { key, problem: problem.into() });
        match (&self.empirical, self.surfaces.is_empty()) {
            (None, true) => return bad(format!("{key}.surfaces"), "at least one surface is needed, or `empirical`"),
            (Some(_), false) => return bad(format!("{key}.empirical"), "stands beside surfaces; give one of them"),
            (Some(empirical), true) => empirical.check(&format!("{key}.empirical"))?,
            (None, false) => {}
        }
        if let Some(scatter_mag) = self.scatter_mag {
            range(&format!("{key}.scatter_mag"), scatter_mag, 0.0, 100.0, "mag")?;
        }
        for (at, surface) in self.surfaces.iter().enumerate() {
            check_surface(&format!("{key}.surfaces.{}", surface.name), surface)?;
            if self.surfaces[..at].iter().any(|other| other.name == surface.name) {
                return bad(format!("{key}.surfaces.{}", surface.name), "two surfaces have this name");
            }
        }
        let span = |key: String, span: &Span, lo: f64, hi: f64, unit: &str| {
            let [low, high] = span.bounds();
            range(&key, low, lo, hi, unit)?;
            range(&key, high, low, hi, unit)
        };
        for shell in &self.orbits {
            span(format!("{key}.orbits.height_km"), &shell.height_km, 50.0, 1e6, "km")?;
            if let Some(inclination) = &shell.inclination_deg {
                span(format!("{key}.orbits.inclination_deg"), inclination, 0.0, 180.0, "deg")?;
            }
        }
        if let Some(counts) = &self.counts {
            span(format!("{key}.counts.planned"), &counts.planned, 0.0, 1e12, "satellites")?;
        }
        for part in &self.components {
            let key = format!("{key}.components.{}", part.name);
            if !self.surfaces.iter().any(|s| s.name == part.surface) {
                return bad(format!("{key}.surface"), &format!("\"{}\" is not one of its surfaces", part.surface));
            }
            match part.total_m2() {
                Some(area_m2) => range(&key, area_m2, 1e-9, 1e9, "m²")?,
                None => return bad(key, "needs area_m2, or length_m and diameter_m"),
            }
        }
        Ok(())
    }
}
