//! What the model answers: four lights, their sum, its numerical error, what was excluded.
//!
//! Magnitudes in the band of the settings, irradiances relative to a star of magnitude 0.

use std::fmt;

use super::flux_sum::FluxSum;
use super::light_sources::mag_of_flux;
use super::lights::LightSource;
use super::skip::Skip;
use crate::base::constants::MAG_PER_LN;

/// Share of the Sun's light below which the satellite is said to be in the penumbra.
const PENUMBRA_BELOW: f64 = 0.99;

/// One of the four lights.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Light {
    /// Magnitude; `None` = no light, or too little of it was computed ([`Light::is_too_faint`]).
    pub v_mag: Option<f64>,
    /// Irradiance at the observer relative to a star of magnitude 0: what was computed of it.
    pub flux_ratio: f64,
    /// Upper bound of what was not computed because it cannot change the sum of the lights by more than the tolerance; 0 where the
    /// tolerance is that of each light.
    pub skipped_flux_ratio: f64,
    too_faint: bool,
}

impl Light {
    fn of(light: &FluxSum, tolerance: f64) -> Self {
        let too_faint = light.skipped > tolerance * light.flux;
        Self {
            v_mag: mag_of_flux(light.flux).filter(|_| !too_faint),
            flux_ratio: light.flux,
            skipped_flux_ratio: light.skipped,
            too_faint,
        }
    }

    /// So much was skipped that the rest is not the light: it is there, and cannot change the sum by more than the tolerance.
    #[must_use]
    pub fn is_too_faint(&self) -> bool {
        self.too_faint
    }
}

/// What lights a satellite most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Illum {
    /// The whole Sun.
    Sun,
    /// The Sun, partly behind the Earth.
    Penumbra,
    /// The Moon.
    Moon,
    /// Moonlight from the Earth.
    LunarEarthshine,
    /// Sunlight from the Earth.
    Earthshine,
    /// Nothing.
    None,
}

impl Illum {
    /// All of them.
    pub const ALL: [Illum; 6] =
        [Illum::Sun, Illum::Penumbra, Illum::Moon, Illum::LunarEarthshine, Illum::Earthshine, Illum::None];

    /// The word in the column `illum`.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Illum::Sun => "sun",
            Illum::Penumbra => "penumbra",
            Illum::Moon => "moon",
            Illum::LunarEarthshine => "lunar_earthshine",
            Illum::Earthshine => "earthshine",
            Illum::None => "none",
        }
    }

    /// The light of a cell of that column; `None` for an empty cell (no model) and any other text.
    #[doc(hidden)]
    #[must_use]
    pub fn from_cell(cell: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|light| light.as_str() == cell)
    }
}

impl fmt::Display for Illum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// How many Earth integrals (one per surface) were really evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Quadratures {
    /// For sunlight.
    pub sun: usize,
    /// For moonlight.
    pub moon: usize,
}

/// The model's answer for one scene: what [`Model::brightness`](crate::Model::brightness) returns.
///
/// ```
/// use satphot::{Model, ModelSettings, Satellite, Scene, Site, Tracker};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let elements = "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996
/// # 2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748";
/// # let tracker = Tracker::from_text(elements, Site::new(-33.7703, 151.1113, 70.0)?)?;
/// # let scene = Scene::from(&tracker.at(&"2025-06-09T10:33:12 UTC".parse()?)?);
/// # let iss = Satellite::named("iss").ok_or("not in the catalogue")?;
/// let answer = Model::new(&iss, &ModelSettings::default())?.brightness(&scene)?;
/// let lights = [answer.sun, answer.earthshine, answer.moon, answer.lunar_earthshine];
/// let flux: f64 = lights.iter().map(|light| light.flux_ratio).sum(); // relative to a star of magnitude 0
/// assert!((answer.total_v_mag.ok_or("dark")? - -2.5 * flux.log10()).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Brightness {
    /// Sunlight.
    pub sun: Light,
    /// Sunlight by way of the Earth.
    pub earthshine: Light,
    /// Moonlight.
    pub moon: Light,
    /// Moonlight by way of the Earth.
    pub lunar_earthshine: Light,
    /// V of all four together; `None` = no light, or the observer cannot see the satellite.
    pub total_v_mag: Option<f64>,
    /// The largest light; [`Illum::Penumbra`] when that is a partly covered Sun.
    pub illum: Illum,
    /// Share of the Sun's light that gets past the Earth to the satellite.
    pub sun_visible_frac: f64,
    /// Estimated numerical error of the total \[mag\]; says nothing about the model's truth.
    pub err_mag: f64,
    /// 1-sigma error of the total as a prediction \[mag\]: scatter of observations about the model, errors of its fitted
    /// parameters, extinction; `None` where no light is, and for a model that was not compared with observations.
    pub v_pred_err_mag: Option<f64>,
    /// Cosine of the angle under which the observer sees the sunlit front of a surface that keeps to the Sun; 0 where it is not
    /// seen or not lit, `None` without such a surface.
    pub lit_array_cos: Option<f64>,
    /// What was excluded, and why.
    #[doc(hidden)]
    pub skipped: Vec<Skip>,
    /// Earth integrals really evaluated.
    #[doc(hidden)]
    pub quadratures: Quadratures,
    /// Nodes of all of them.
    #[doc(hidden)]
    pub nodes: usize,
    /// Moonlight was requested beyond 150° of phase.
    pub extrapolated: bool,
    /// Mean V surface brightness \[mag/arcsec²\] over the projected area (corrected) or the whole area (as published).
    pub mu_mean_mag_arcsec2: Option<f64>,
}

/// Names of the four lights, in the order of [`Brightness::lights`].
const LIGHTS: [&str; 4] = ["sun", "earthshine", "moon", "lunar_earthshine"];

/// The names of those that are too faint, for a table's `too_faint` column.
pub(crate) fn too_faint_text(too_faint: &[bool; 4]) -> String {
    let named: Vec<&str> = LIGHTS.into_iter().zip(too_faint).filter(|(_, too)| **too).map(|(name, _)| name).collect();
    named.join("; ")
}

impl Brightness {
    /// Sun, earthshine, Moon, lunar earthshine.
    #[must_use]
    pub fn lights(&self) -> [Light; 4] {
        [self.sun, self.earthshine, self.moon, self.lunar_earthshine]
    }

    /// Which of [`Brightness::lights`] are there and were not computed, [`Light::is_too_faint`].
    #[must_use]
    pub fn too_faint(&self) -> [bool; 4] {
        self.lights().map(|light| light.is_too_faint())
    }
}

/// The answer from the four lights: Sun, earthshine, Moon, lunar earthshine.
pub(super) fn assemble(
    lights: &[FluxSum; 4],
    tolerance: f64,
    sun: &LightSource,
    extrapolated: bool,
    skipped: Vec<Skip>,
) -> Brightness {
    let light = |k: usize| Light::of(&lights[k], tolerance);
    let [sunlight, earthshine, moonlight, lunar_earthshine] = lights.each_ref().map(|l| l.flux);
    let total: f64 = lights.iter().map(|l| l.flux).sum();
    let err: f64 = lights.iter().map(|l| l.err).sum();
    let direct_sun = if sun.visible_frac < PENUMBRA_BELOW { Illum::Penumbra } else { Illum::Sun };
    let (illum, _) = [
        (direct_sun, sunlight),
        (Illum::Earthshine, earthshine),
        (Illum::Moon, moonlight),
        (Illum::LunarEarthshine, lunar_earthshine),
    ]
    .into_iter()
    .fold((Illum::None, 0.0), |largest, light| if light.1 > largest.1 { light } else { largest });
    Brightness {
        sun: light(0),
        earthshine: light(1),
        moon: light(2),
        lunar_earthshine: light(3),
        total_v_mag: mag_of_flux(total),
        illum,
        sun_visible_frac: sun.visible_frac,
        err_mag: if total > 0.0 { MAG_PER_LN * err / total } else { 0.0 },
        v_pred_err_mag: None,
        lit_array_cos: None,
        skipped,
        quadratures: Quadratures { sun: lights[1].quadratures, moon: lights[3].quadratures },
        nodes: lights.iter().map(|l| l.nodes).sum(),
        extrapolated,
        mu_mean_mag_arcsec2: None,
    }
}
