//! The satellites satphot knows by name: areas, attitudes, scattering, and where each number is from.
//!
//! Areas in m². Left out: components smaller than the two surfaces, and orbits.

use super::brdf::Brdf;
use super::surface::{Attitude, Surface};
use crate::config;
use crate::error::{Error, Result};

/// Chassis of Starlink V1.5, Phong fit to 2022 Pomenis photometry for an area of 1 m² (Fankhauser et al. 2023).
const INFERRED_CHASSIS: (f64, f64, f64) = (0.34, 0.40, 8.9);
/// Solar array of Starlink V1.5, same fit, same unit area.
const INFERRED_ARRAY: (f64, f64, f64) = (0.15, 0.25, 0.26);
/// Areas of Starlink V1.5 the lab models use \[m²\]: chassis, array.
const V15_AREAS_M2: (f64, f64) = (3.65, 22.0);

/// Name, chassis \[m²\], array \[m²\], where the areas are from.
const CATALOGUE: [(&str, f64, f64, &str); 4] = [
    ("iss", 1577.89, 2672.36, "areas: Caddy et al., appendix"),
    ("starlink-v1.0", 2.214, 20.992, "areas: V2 divided by 5, no other source given"),
    ("starlink-v1.5", 3.65, 22.0, "areas: Fankhauser et al. 2023"),
    ("starlink-v2", 11.07, 104.96, "areas: Caddy et al."),
];

/// A satellite as the model sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Satellite {
    /// Name.
    pub name: String,
    /// Its surfaces.
    pub surfaces: Vec<Surface>,
    /// Where areas and scattering are from.
    pub source: String,
}

/// Every name [`Satellite::named`] knows.
#[must_use]
pub fn catalogue_names() -> Vec<&'static str> {
    CATALOGUE.iter().map(|row| row.0).collect()
}

impl Satellite {
    /// A satellite of the catalogue; case and `_` or blank for `-` do not matter.
    ///
    /// Chassis to nadir, array to the Sun. The inferred coefficients belong to 1 m² of each surface, so the Starlinks
    /// carry them divided by the V1.5 areas (the fluxes are those of the fit, the areas the real ones); the ISS
    /// carries them as reflectances of its published areas, since no fit to the ISS itself exists.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let wanted = plain(name);
        let (name, chassis_m2, array_m2, areas) = CATALOGUE.into_iter().find(|row| row.0 == wanted)?;
        let unit_areas = if name == "iss" { (1.0, 1.0) } else { V15_AREAS_M2 };
        let surface = |name: &str, area_m2, attitude, (kd, ks, n): (f64, f64, f64), unit_area: f64| Surface {
            name: name.into(),
            area_m2,
            attitude,
            brdf: Brdf::Phong { kd: kd / unit_area, ks: ks / unit_area, n },
            back: None,
        };
        Some(Satellite {
            name: name.into(),
            surfaces: vec![
                surface("chassis", chassis_m2, Attitude::Nadir, INFERRED_CHASSIS, unit_areas.0),
                surface("array", array_m2, Attitude::Sun, INFERRED_ARRAY, unit_areas.1),
            ],
            source: format!(
                "{areas}; scattering: Phong inferred for Starlink V1.5, Fankhauser et al. 2023, AJ 166, 59"
            ),
        })
    }

    /// The satellite a configuration asks for: its own surfaces if it lists any, else the catalogue's.
    ///
    /// # Errors
    /// [`Error::Config`] for an unknown name (the known ones listed, the nearest first); [`Error::Model`] for
    /// surfaces that are no reflectors.
    pub fn from_config(model: &config::Model) -> Result<Self> {
        let satellite = if model.surfaces.is_empty() {
            Self::named(&model.satellite).ok_or_else(|| unknown(&model.satellite))?
        } else {
            Satellite {
                name: model.satellite.clone(),
                surfaces: model.surfaces.iter().map(Surface::try_from).collect::<Result<_>>()?,
                source: "configuration, model.surfaces".into(),
            }
        };
        satellite.surfaces.iter().try_for_each(Surface::check)?;
        Ok(satellite)
    }
}

fn plain(name: &str) -> String {
    name.trim().to_lowercase().replace(['_', ' '], "-")
}

fn unknown(name: &str) -> Error {
    let mut known = catalogue_names();
    let wanted = plain(name);
    known.sort_by(|a, b| strsim::jaro_winkler(b, &wanted).total_cmp(&strsim::jaro_winkler(a, &wanted)));
    Error::Config {
        key: "model.satellite".into(),
        problem: format!(
            "\"{name}\" is not in the catalogue; did you mean \"{}\"? Known: {}. Or list model.surfaces",
            known[0],
            known.join(", ")
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(satellite: &str, surfaces: Vec<config::Surface>) -> config::Model {
        config::Model { surfaces, ..config::Model::of(satellite) }
    }

    #[test]
    fn the_iss_has_its_published_areas() {
        let iss = Satellite::named("ISS").unwrap();
        let total_m2: f64 = iss.surfaces.iter().map(|s| s.area_m2).sum();
        assert!((total_m2 - 4250.25).abs() < 1e-9);
    }

    #[test]
    fn every_name_is_found_and_reflects_no_more_than_it_receives() {
        for name in catalogue_names() {
            Satellite::named(name).unwrap().surfaces.iter().for_each(|s| s.check().unwrap());
        }
    }

    #[test]
    fn an_unknown_satellite_is_an_error_that_names_the_nearest() {
        let message = Satellite::from_config(&model("starlink-v15", vec![])).unwrap_err().to_string();
        assert!(message.contains("did you mean \"starlink-v1.5\"") && message.contains("iss"), "{message}");
    }

    #[test]
    fn surfaces_of_the_configuration_win_and_are_checked() {
        let plate = |albedo| config::Surface {
            name: "plate".into(),
            area_m2: 2.0,
            attitude: config::Attitude::Nadir,
            brdf: config::Brdf::Lambert { albedo },
            back: None,
        };
        let own = Satellite::from_config(&model("iss", vec![plate(0.5)])).unwrap();
        assert_eq!((own.surfaces.len(), own.surfaces[0].area_m2), (1, 2.0));
        assert!(Satellite::from_config(&model("iss", vec![plate(1.5)])).is_err());
    }
}
