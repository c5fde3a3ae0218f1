//! What every row may use: the catalogue, the site, the camera, the elements, the sky of a moment.
//!
//! Read once. The site is that of the paper (Macquarie), the elements are those embedded for June 2025.

use std::path::Path;

use super::pass_check::{CheckedPass, Tolerances, check_passes};
use super::pass_rows::{PAPER_PASSES, parse_passes};
use super::trackers::Targets;
use crate::base::error::{Error, Result};
use crate::base::time::parse_utc;
use crate::brightness::sky_points::SkyPoints;
use crate::brightness::{Brightness, Catalogue, Model, ModelSettings, Satellite};
use crate::config::{Config, Effects, Mode};
use crate::orbit::{Site, Tracker};
use crate::visibility::forecast::dome::{Dome, Overhead};

/// The configuration of the paper's telescope, without a night.
const TELESCOPE: &str = "preset = \"macquarie-cdk24\"\n[night]\nname = \"none\"\ninput = [\".\"]\noutput = \".\"\n";
/// Relative tolerance of the Earth-reflected integrals of these rows: 0.001 mag.
const TOLERANCE: f64 = 1e-3;
/// Directions of a sky.
const DIRECTIONS: usize = 288;
/// Azimuth in which the satellites of a sky move: east \[rad\]. The arrays follow the Sun, the chassis is level.
const TRACK_AZ_RAD: f64 = std::f64::consts::FRAC_PI_2;

/// What every row may use.
#[derive(Debug)]
pub struct Context {
    /// Satellites.
    pub catalogue: Catalogue,
    /// Site, telescope and camera.
    pub config: Config,
    /// The site.
    pub site: Site,
    /// Elements.
    pub targets: Targets,
    /// The paper's table of passes, checked.
    pub passes: Vec<CheckedPass>,
}

impl Context {
    /// Reads what is embedded.
    ///
    /// # Errors
    /// Those of catalogue, configuration and elements.
    pub fn new() -> Result<Self> {
        let config = Config::from_text(TELESCOPE, &[])?;
        let site = Site::from_config(&config.site)?;
        let none: [&Path; 0] = [];
        let targets = Targets::new(&none, &site)?;
        let (stated, _) = parse_passes(Path::new("the paper's table of passes"), PAPER_PASSES, None)?;
        let passes = check_passes(&stated, &site, &targets, &Tolerances::default())?;
        Ok(Self { catalogue: Catalogue::load(None)?, config, site, targets, passes })
    }

    /// A satellite of the catalogue.
    pub(super) fn satellite(&self, name: &str) -> Result<Satellite> {
        Satellite::named(name).ok_or_else(|| Error::Model { problem: format!("{name} is not in the catalogue") })
    }

    /// Area of all surfaces of a satellite of the catalogue \[m²\].
    pub(super) fn area_m2(&self, name: &str) -> Result<f64> {
        Ok(self.catalogue.find(name)?.area_m2())
    }

    /// The tracker of a target.
    pub(super) fn tracker(&self, name: &str) -> Result<&Tracker> {
        self.targets.find(name).ok_or_else(|| Error::Orbit { problem: format!("no embedded elements of {name}") })
    }

    /// A satellite all over the sky of the site at one height.
    pub(super) fn dome(&self, satellite: &Satellite, height_km: f64, mode: Mode) -> Result<Dome> {
        Dome::new(&self.site, satellite, &settings(mode), height_km, TRACK_AZ_RAD)
    }

    /// The model over the whole sky of a moment: the answer of every direction that has one.
    pub(super) fn over_the_sky(
        &self,
        utc: &str,
        satellite: &Satellite,
        height_km: f64,
        mode: Mode,
    ) -> Result<Vec<Brightness>> {
        let dome = self.dome(satellite, height_km, mode)?;
        let overhead = Overhead::at(&self.site, &parse_utc("time", utc)?)?;
        let sky = dome.under(&overhead)?;
        let points = sky_points(DIRECTIONS, mode)?;
        let answers = points.directions.iter().map(|(alt_rad, az_rad)| sky.toward(*alt_rad, *az_rad));
        answers.filter_map(Result::transpose).collect()
    }

    /// The model of a satellite in one mode.
    pub(super) fn model(&self, name: &str, mode: Mode) -> Result<Model> {
        Model::new(&self.satellite(name)?, &settings(mode))
    }
}

/// `n` directions: even in altitude and azimuth as the paper's numbers need them, or in solid angle.
pub(super) fn sky_points(n: usize, mode: Mode) -> Result<SkyPoints> {
    SkyPoints::new(n, Effects::of(mode).sampling, None)
}

/// Settings of these rows.
pub(super) fn settings(mode: Mode) -> ModelSettings {
    ModelSettings::new(mode, TOLERANCE)
}

/// The value below which a share of the values lies; `None` without any.
pub(super) fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    let at = ((share * values.len() as f64).ceil() as usize).max(1) - 1;
    values.get(at).copied()
}
