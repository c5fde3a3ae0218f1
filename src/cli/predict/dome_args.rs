//! What `predict day`, `month` and `duty` have in common: how the sky is sampled, the height of the orbits, moments.

use clap::Args;
use hifitime::Epoch;
use satphot::base::time::parse_utc;
use satphot::brightness::Catalogue;
use satphot::brightness::sky_points::SkyPoints;
use satphot::config::{self, Sampling};

use super::super::orbit_args::bad;

/// How directions are spread over the sky.
#[derive(Debug, Clone, Args)]
pub struct SamplingArgs {
    /// Directions are even in this measure instead of the mode's: solid_angle (corrected) or alt_az (as_published)
    #[arg(long, value_name = "MEASURE", value_parser = ["solid_angle", "alt_az"])]
    sampling: Option<String>,
    /// Independent random directions of this seed instead of a golden spiral
    #[arg(long, value_name = "SEED")]
    seed: Option<u64>,
}

impl SamplingArgs {
    /// Puts the measure of the command line over the model's.
    pub fn over(&self, model: &mut config::Model) {
        match self.sampling.as_deref() {
            Some("alt_az") => model.effects.sampling = Some(Sampling::AltAz),
            Some(_) => model.effects.sampling = Some(Sampling::SolidAngle),
            None => {}
        }
    }

    /// `n` directions in the measure of a model.
    pub fn points(&self, n: usize, model: &config::Model) -> satphot::Result<SkyPoints> {
        SkyPoints::new(n, model.resolved_effects().sampling, self.seed)
    }

    /// How the directions were chosen, in words.
    pub fn text(&self, n: usize, model: &config::Model) -> String {
        let measure = match model.resolved_effects().sampling {
            Sampling::SolidAngle => "even in solid angle",
            Sampling::AltAz => "even in altitude and azimuth",
        };
        let how = self.seed.map_or("golden spiral".to_string(), |seed| format!("random, seed {seed}"));
        format!("{n} directions {measure} ({how})")
    }
}

/// A height of orbits \[km\]; one in metres is refused.
pub fn checked_height(height_km: f64) -> anyhow::Result<f64> {
    if (1.0..=HIGHEST_KM).contains(&height_km) {
        return Ok(height_km);
    }
    let metres = height_km / 1000.0;
    let hint = match height_km > HIGHEST_KM && (100.0..=HIGHEST_KM).contains(&metres) {
        true => format!("; for {height_km} m give {metres}"),
        false => String::new(),
    };
    let problem = format!("{height_km} km must be between 1 and {HIGHEST_KM} km above the ground{hint}");
    Err(bad("--height-km", problem))
}

/// Highest orbit \[km\]: beyond the Moon's half-way no satellite of the Earth is meant.
const HIGHEST_KM: f64 = 200_000.0;

/// The height that is given, else the middle of the first orbits the catalogue knows of the model's satellite.
pub fn height_km(given: Option<f64>, model: &config::Model) -> anyhow::Result<f64> {
    if let Some(height_km) = given {
        return checked_height(height_km);
    }
    let known = Catalogue::load(model.satellites.as_deref())?;
    let entry = known.find(&model.satellite).ok().filter(|_| model.surfaces.is_empty());
    let shell = entry.and_then(|e| e.orbits.first()).map(|shell| shell.height_km.bounds());
    shell.map(|[low, high]| 0.5 * (low + high)).ok_or_else(|| {
        bad("--height-km", format!("the orbit of {} is not known; give its height [km]", model.satellite))
    })
}

/// The site of the command line, else of the configuration.
pub fn site_of(given: Option<config::Site>, config: Option<&config::Config>) -> anyhow::Result<config::Site> {
    let place = given.or_else(|| config.map(|c| c.site.clone()));
    place.ok_or_else(|| {
        bad("--site", "is needed without a configuration: latitude,longitude,height [deg, deg, m]".into())
    })
}

/// The first moment: of `--start`, or 0 h UTC of `--date`.
pub fn first_moment(date: Option<&str>, start: Option<&str>) -> anyhow::Result<Epoch> {
    match (start, date) {
        (Some(start), _) => Ok(parse_utc("--start", start)?),
        (None, Some(date)) => Ok(parse_utc("--date", date)?),
        (None, None) => Err(bad("--date", "give a date (UTC), or --start with a moment".into())),
    }
}

/// The label of a mode as the command line spells it.
pub fn mode_name(mode: config::Mode) -> &'static str {
    mode.as_str()
}
