//! The surfaces of a satellite as a file states them: area, attitude, scattering.
//!
//! Areas in m², angles in degrees, units in the keys.

use serde::{Deserialize, Serialize};

/// A flat surface of the satellite.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// Name, e.g. `chassis`.
    pub name: String,
    /// Area \[m²\].
    pub area_m2: f64,
    /// How it is held.
    pub attitude: Attitude,
    /// How its front scatters.
    pub brdf: Brdf,
    /// How its back scatters; absent = black.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub back: Option<Brdf>,
}

/// How a surface is held: where the normal of its front points.
///
/// LVLH axes: z to the centre of the Earth, y against the orbit's angular momentum, x = y × z, forward.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Attitude {
    /// To the centre of the Earth.
    Nadir,
    /// To the geometric Sun, also in the shadow: two axes without limits.
    Sun,
    /// To the Sun, turned away from nadir by an angle; negative towards nadir.
    SunOffset {
        /// The angle \[deg\], −90 to 90.
        offset_deg: f64,
    },
    /// At right angles to nadir, towards the Sun's azimuth.
    SunAzimuth,
    /// Halfway between Sun and nadir: a mirror that sends sunlight straight down.
    SunToNadir,
    /// As near to the Sun as turning about one axis allows.
    SunOneAxis {
        /// The axis, in LVLH.
        axis_lvlh: [f64; 3],
        /// The normal at angle 0, in LVLH; at right angles to the axis.
        zero_lvlh: [f64; 3],
        /// Largest turn either way \[deg\].
        #[serde(default = "half_turn")]
        limit_deg: f64,
    },
    /// As near to the Sun as two gimbals allow: azimuth about LVLH −z (up), then elevation above the local horizontal.
    SunTwoAxes {
        /// Largest azimuth either way from forward \[deg\].
        #[serde(default = "half_turn")]
        azimuth_limit_deg: f64,
        /// Lowest and highest elevation \[deg\].
        #[serde(default = "any_elevation")]
        elevation_deg: [f64; 2],
    },
    /// Fixed in LVLH.
    Lvlh([f64; 3]),
    /// Fixed among the stars, equator of date.
    Inertial {
        /// Right ascension \[deg\].
        ra_deg: f64,
        /// Declination \[deg\].
        dec_deg: f64,
    },
}

/// How a surface scatters; f in 1/sr.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub enum Brdf {
    /// f = ρ/π.
    Lambert {
        /// Albedo ρ, 0 to 1.
        albedo: f64,
    },
    /// f = k_d/π + k_s (n+2)/2π max(0, r·o)ⁿ.
    Phong {
        /// Diffuse share.
        kd: f64,
        /// Specular share.
        ks: f64,
        /// Exponent.
        n: f64,
    },
    /// lg f = Σ_k Vᵏ [Σ_i B_ki Dⁱ + ½ Σ_i C_ki lg(1 + d^(i+l1) D²)] (Greynolds).
    Binomial {
        /// B_ki, a row for each power of V.
        b: Vec<Vec<f64>>,
        /// C_ki.
        c: Vec<Vec<f64>>,
        /// d.
        d: f64,
        /// First power of d.
        l1: i32,
    },
    /// f = A/(B + D^g).
    Abg {
        /// A.
        a: f64,
        /// B.
        b: f64,
        /// g.
        g: f64,
    },
    /// f = A exp((r·o − 1)/σ).
    Gaussian {
        /// Peak A \[1/sr\].
        peak_per_sr: f64,
        /// Width σ.
        sigma: f64,
    },
    /// A mirror: the source's disc is seen in it.
    Mirror {
        /// Reflectance, 0 to 1.
        reflectance: f64,
    },
    /// A law known by name; `satphot brdf plot --list` lists them.
    Named {
        /// Its name, e.g. `starlink-chassis-lab`.
        name: String,
    },
}

impl Brdf {
    /// Land with vegetation, by name.
    #[must_use]
    pub fn earth_vegetation() -> Self {
        Brdf::Named { name: "earth-vegetation".into() }
    }
}

fn half_turn() -> f64 {
    180.0
}
fn any_elevation() -> [f64; 2] {
    [-90.0, 90.0]
}
