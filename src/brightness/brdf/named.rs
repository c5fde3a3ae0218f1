//! Scattering laws known by name, and where each is from.
//!
//! f in 1/sr. Laws fitted to photometry for an area of 1 m² say so: divide them by the true area, or keep the area 1.

use std::sync::Arc;

use super::Binomial;
use super::law::Brdf;
use crate::base::error::{Error, Result};

/// Land with vegetation, 479 nm (Cloud Absorption Radiometer, CLASIC), as fitted by Fankhauser et al. (2023, AJ 166, 59).
/// One spectral band and one biome: the global mean spherical albedo is near 0.3.
pub const EARTH_VEGETATION: Brdf = Brdf::Phong { kd: 0.53, ks: 0.28, n: 7.31 };

/// The coefficients of a named law; a binomial one has a single row.
enum Coefficients {
    Plain(Brdf),
    Binomial { b: &'static [f64], c: &'static [f64], d: f64, l1: i32 },
}

/// A row of the table.
struct Named {
    name: &'static str,
    law: Coefficients,
    source: &'static str,
}

const NAMED: [Named; 7] = [
    Named {
        name: "aluminium-lumos",
        law: Coefficients::Plain(Brdf::Abg { a: 0.003_362, b: 4.309e-6, g: 2.068 }),
        source: "ABG of the example examples/simple_sat.py of lumos-sat",
    },
    Named {
        name: "earth-ocean",
        law: Coefficients::Plain(Brdf::Phong { kd: 0.48, ks: 0.08, n: 16.45 }),
        source: "Phong fit to the Cloud Absorption Radiometer over water, 479 nm, CLAMS; Fankhauser et al. 2023, AJ 166, 59",
    },
    Named {
        name: "earth-vegetation",
        law: Coefficients::Plain(EARTH_VEGETATION),
        source: "Phong fit to the Cloud Absorption Radiometer over land, 479 nm, CLASIC; Fankhauser et al. 2023, AJ 166, 59",
    },
    Named {
        name: "starlink-array-inferred",
        law: Coefficients::Plain(Brdf::Phong { kd: 0.15, ks: 0.25, n: 0.26 }),
        source: "Phong inferred from 2022 Pomenis photometry of Starlink V1.5 for 1 m2 of array; Fankhauser et al. 2023",
    },
    Named {
        name: "starlink-array-lab",
        law: Coefficients::Binomial {
            b: &[0.534, -20.409],
            c: &[-527.765, 1000.0, -676.579, 430.596, -175.806, 57.879],
            d: 3.0,
            l1: -3,
        },
        source: "binomial fit to the ScatterWorks measurement of a Starlink V1.5 solar array, 532 nm; Fankhauser et al. 2023",
    },
    Named {
        name: "starlink-chassis-inferred",
        law: Coefficients::Plain(Brdf::Phong { kd: 0.34, ks: 0.40, n: 8.9 }),
        source: "Phong inferred from 2022 Pomenis photometry of Starlink V1.5 for 1 m2 of chassis; Fankhauser et al. 2023",
    },
    Named {
        name: "starlink-chassis-lab",
        law: Coefficients::Binomial {
            b: &[3.34, -98.085],
            c: &[-999.999, 867.538, 1000.0, 1000.0, -731.248, 618.552, -294.054, 269.248, -144.853, 75.196],
            d: 3.0,
            l1: -5,
        },
        source: "binomial fit to the ScatterWorks measurement of a Starlink V1.5 chassis, 532 nm; Fankhauser et al. 2023",
    },
];

impl Brdf {
    /// Every name [`Brdf::named`] knows, in alphabetical order.
    #[must_use]
    pub fn names() -> Vec<&'static str> {
        NAMED.iter().map(|row| row.name).collect()
    }

    /// A law known by name; case and `_` or blank for `-` do not matter.
    ///
    /// # Errors
    /// [`Error::Config`] for an unknown name: the nearest one, and all of them.
    pub fn named(name: &str) -> Result<Self> {
        let wanted = plain(name);
        let row = NAMED.iter().find(|row| row.name == wanted).ok_or_else(|| unknown(name))?;
        Ok(match &row.law {
            Coefficients::Plain(law) => law.clone(),
            Coefficients::Binomial { b, c, d, l1 } => {
                Brdf::Binomial(Arc::new(Binomial { b: vec![b.to_vec()], c: vec![c.to_vec()], d: *d, l1: *l1 }))
            }
        })
    }

    /// Where a named law is from.
    #[must_use]
    pub fn source(name: &str) -> Option<&'static str> {
        let wanted = plain(name);
        NAMED.iter().find(|row| row.name == wanted).map(|row| row.source)
    }
}

fn plain(name: &str) -> String {
    name.trim().to_lowercase().replace(['_', ' '], "-")
}

fn unknown(name: &str) -> Error {
    let mut known = Brdf::names();
    let wanted = plain(name);
    known.sort_by(|a, b| strsim::jaro_winkler(b, &wanted).total_cmp(&strsim::jaro_winkler(a, &wanted)));
    Error::Config {
        key: "brdf.name".into(),
        problem: format!(
            "no scattering law \"{name}\"; did you mean \"{}\"? Known: {}. Or give kind and coefficients",
            known[0],
            Brdf::names().join(", ")
        ),
    }
}
