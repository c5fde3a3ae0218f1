//! `satphot satellites`: what the model knows.

use clap::Args;
use satphot::Error;
use satphot::brightness::{Satellite, catalogue_names};

use super::print;

/// Lists the satellites of the catalogue, or the surfaces of one.
#[derive(Debug, Args)]
pub struct Satellites {
    /// Show this one's surfaces
    name: Option<String>,
}

impl Satellites {
    pub fn execute(self) -> anyhow::Result<()> {
        let names: Vec<&str> = match &self.name {
            Some(name) => vec![name],
            None => catalogue_names(),
        };
        for name in names {
            let satellite = Satellite::named(name).ok_or_else(|| Error::Model {
                problem: format!("no satellite \"{name}\"; known: {}", catalogue_names().join(", ")),
            })?;
            let area: f64 = satellite.surfaces.iter().map(|s| s.area_m2).sum();
            print(&format!("{:<16} {area:>12.2} m2  {}\n", satellite.name, satellite.source));
            for s in satellite.surfaces.iter().filter(|_| self.name.is_some()) {
                print(&format!("  {:<12} {:>12.2} m2  {:?}  {:?}\n", s.name, s.area_m2, s.attitude, s.brdf));
            }
        }
        Ok(())
    }
}
