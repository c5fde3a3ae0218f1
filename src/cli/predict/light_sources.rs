//! Where Sun and Moon stand over a map: by the ephemeris at a moment, or as the arguments say.

use clap::Args;
use satphot::base::time::{iso_utc, parse_utc};
use satphot::base::vector::{Enu, Itrs, Vector};
use satphot::brightness::attitude::Attitude;
use satphot::brightness::sky::{Body, Sky, SkyMap, parallel_light, phase_ratio};
use satphot::brightness::{ModelSettings, Satellite};
use satphot::config;
use satphot::figures::SkyMark;
use satphot::orbit::earth::{Site, from_alt_az};
use satphot::visibility::forecast::dome::Overhead;

use super::super::orbit_args::bad;

/// A moment, or fixed light sources.
#[derive(Debug, Clone, Args)]
pub struct LightSourceArgs {
    /// Moment, UTC, e.g. 2025-06-09T08:30:00: Sun and Moon by the ephemeris
    #[arg(long, value_name = "UTC", conflicts_with_all = ["sun_alt_deg", "moon_alt_deg"])]
    time: Option<String>,
    /// Altitude of the Sun instead of a moment [deg]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, requires = "sun_az_deg")]
    sun_alt_deg: Option<f64>,
    /// Azimuth of the Sun [deg]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, requires = "sun_alt_deg")]
    sun_az_deg: Option<f64>,
    /// Altitude of the Moon [deg]; without it there is no Moon
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, requires_all = ["moon_az_deg", "sun_alt_deg"])]
    moon_alt_deg: Option<f64>,
    /// Azimuth of the Moon [deg]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, requires = "moon_alt_deg")]
    moon_az_deg: Option<f64>,
    /// Phase angle of the Moon instead of that of the two directions, 0 = full [deg]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, requires = "moon_alt_deg")]
    moon_phase_deg: Option<f64>,
}

/// Sun and Moon over one observer.
pub struct LightSources {
    /// Where the observer is, if that is known \[km\].
    pub site_km: Option<Vector<Itrs>>,
    /// For the figure and the meta block.
    pub marks: Vec<SkyMark>,
    /// The moment, or how the Sun is placed.
    pub when: String,
    axes: [Vector<Itrs>; 3],
    sun: Body,
    moon: Option<Body>,
    /// Angle Sun-Moon-observer \[deg\], and what moonlight is multiplied by to be that of another angle.
    phase_deg: f64,
    moon_factor: f64,
    sidereal_rad: Option<f64>,
}

impl LightSourceArgs {
    /// Sun and Moon are the ephemeris'.
    pub fn at_a_time(&self) -> bool {
        self.time.is_some()
    }

    /// The moment as it was given.
    pub fn moment(&self) -> &str {
        self.time.as_deref().unwrap_or_default()
    }

    /// The same at another moment.
    pub fn at(&self, moment: String) -> Self {
        Self { time: Some(moment), ..self.clone() }
    }

    /// The phase of the Moon is not that of the directions.
    pub fn has_own_phase(&self) -> bool {
        self.moon_phase_deg.is_some()
    }

    /// Refuses angles that are not numbers, and neither or both ways of placing the Sun.
    pub fn check(&self) -> anyhow::Result<()> {
        if self.time.is_none() && self.sun_alt_deg.is_none() {
            return Err(bad("--time", "give a moment, or --sun-alt-deg and --sun-az-deg".into()));
        }
        for (key, value, low, high) in [
            ("--sun-alt-deg", self.sun_alt_deg, -90.0, 90.0),
            ("--sun-az-deg", self.sun_az_deg, -360.0, 360.0),
            ("--moon-alt-deg", self.moon_alt_deg, -90.0, 90.0),
            ("--moon-az-deg", self.moon_az_deg, -360.0, 360.0),
            ("--moon-phase-deg", self.moon_phase_deg, 0.0, 180.0),
        ] {
            if let Some(value) = value.filter(|v| !(low..=high).contains(v)) {
                return Err(bad(key, format!("{value} is outside {low} to {high} deg")));
            }
        }
        Ok(())
    }
}

impl LightSources {
    /// From the arguments; a moment needs a site.
    pub fn new(args: &LightSourceArgs, site: Option<&config::Site>, settings: &ModelSettings) -> anyhow::Result<Self> {
        let parallel = parallel_light(&settings.effects);
        let site = site.map(Site::from_config).transpose()?;
        let axes = site.as_ref().map_or(
            [Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0), Vector::new(1.0, 0.0, 0.0)],
            |s| {
                [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)]
                    .map(|e| s.from_enu(&e))
            },
        );
        let mut sidereal = None;
        let (sun, moon, when) = match (&args.time, &site) {
            (Some(time), Some(site)) => {
                let overhead = Overhead::at(site, &parse_utc("--time", time)?)?;
                sidereal = Some(overhead.sidereal_rad);
                (overhead.sun, Some(overhead.moon), iso_utc(overhead.epoch, 0))
            }
            (Some(_), None) => return Err(bad("--site", "a moment needs a place: latitude,longitude,height".into())),
            (None, _) => {
                let rad = |deg: Option<f64>| deg.unwrap_or(0.0).to_radians();
                let sun = Body::sun(rad(args.sun_alt_deg), rad(args.sun_az_deg).rem_euclid(std::f64::consts::TAU));
                let moon = args
                    .moon_alt_deg
                    .map(|alt| Body::moon(alt.to_radians(), rad(args.moon_az_deg).rem_euclid(std::f64::consts::TAU)));
                let far = |b: Body| if parallel { b.at_infinity() } else { b };
                (
                    far(sun),
                    moon.map(far),
                    "fixed Sun and Moon".replace(" and Moon", if moon.is_some() { " and Moon" } else { "" }),
                )
            }
        };
        let phase_deg = moon.map_or(180.0, |moon| phase_deg(&sun, &moon));
        let moon_factor = match args.moon_phase_deg {
            Some(wanted_deg) => phase_ratio(settings, wanted_deg, phase_deg)?.ok_or_else(|| {
                let problem = "the Moon is before the Sun and has no light to be scaled; move one of them";
                bad("--moon-phase-deg", problem.into())
            })?,
            None => 1.0,
        };
        let mark = |name: &str, b: &Body| SkyMark {
            name: name.into(),
            alt_deg: b.alt_rad.to_degrees(),
            az_deg: b.az_rad.to_degrees(),
        };
        let marks = std::iter::once(mark("Sun", &sun)).chain(moon.iter().map(|m| mark("Moon", m))).collect();
        let site_km = site.map(|s| s.position());
        let phase_deg = args.moon_phase_deg.unwrap_or(phase_deg);
        Ok(Self { site_km, marks, when, axes, sun, moon, phase_deg, moon_factor, sidereal_rad: sidereal })
    }

    /// The sky with these light sources.
    pub fn sky(&self, radius_km: f64, height_km: f64, track_az_rad: f64) -> satphot::Result<Sky> {
        let mut sky = Sky::new(self.axes, (radius_km, height_km), track_az_rad, self.sun, self.moon)?;
        sky.sidereal_rad = self.sidereal_rad.unwrap_or(0.0);
        Ok(sky)
    }

    /// Refuses surfaces that are fixed among the stars where no moment says how those stand.
    pub fn check_attitudes(&self, satellite: &Satellite) -> anyhow::Result<()> {
        let inertial = |s: &&satphot::brightness::Surface| matches!(s.attitude, Attitude::Inertial { .. });
        match satellite.surfaces.iter().find(inertial).filter(|_| self.sidereal_rad.is_none()) {
            Some(s) => Err(bad(
                "--time",
                format!("{} is fixed among the stars; give a moment, not fixed light sources", s.name),
            )),
            None => Ok(()),
        }
    }

    /// Moonlight of the phase that was requested, not of that the two directions make.
    pub fn scale_moonlight(&self, map: &mut SkyMap) {
        for point in &mut map.points {
            point.lights[2] *= self.moon_factor;
            point.lights[3] *= self.moon_factor;
        }
    }

    /// One line for each light source.
    pub fn text(&self) -> String {
        let mut lines = String::new();
        for mark in &self.marks {
            lines += &format!("{:<4} altitude {:>6.2}, azimuth {:>6.2} deg", mark.name, mark.alt_deg, mark.az_deg);
            if mark.name == "Moon" {
                let lit_pct = 50.0 * (1.0 + self.phase_deg.to_radians().cos());
                lines += &format!(", phase angle {:.1} deg ({lit_pct:.0} % lit)", self.phase_deg);
            }
            lines.push('\n');
        }
        lines
    }
}

/// Angle Sun-Moon-observer \[deg\].
fn phase_deg(sun: &Body, moon: &Body) -> f64 {
    let place = |b: &Body| -> Vector<Enu> { from_alt_az(b.alt_rad, b.az_rad) * b.distance_km };
    let (sun, moon) = (place(sun), place(moon));
    (sun - moon).angle_to(&-moon).to_degrees()
}
