//! `satphot limits footprint`: the beam of a mirror in orbit, and when it comes to a site.

use std::cell::RefCell;
use std::path::PathBuf;

use clap::Args;
use hifitime::Epoch;
use satphot::Error;
use satphot::base::time::{iso_utc, parse_utc, shifted};
use satphot::brightness::light_sources::SourceSettings;
use satphot::brightness::scene::scene;
use satphot::brightness::{Attitude, Band, Scene};
use satphot::config::{Effects, Mode};
use satphot::orbit::geometry::geometry;
use satphot::orbit::{EarthOrientation, Site, Tracker, bodies};
use satphot::report::summary::text_table;
use satphot::tables::{FootprintRow, Meta, MetaValue, csv_text, write_rows};
use satphot::visibility::footprint::{
    Approach, CircularOrbit, LightSource, Mirror, PUBLISHED_DIVERGENCE_DEG, approaches, beam_diameter_km,
    crossings_per_day,
};

use super::super::orbit_args::{OrbitArgs, bad, tell_unknown_ut1};
use super::super::predict::dome_args::checked_height;
use super::super::{print, tell};
use super::{positive, within};

/// Sampling of the search \[s\]: the direction from a low orbit turns by less than 0.2 rad in it.
const STEP_S: f64 = 10.0;

const AFTER_HELP: &str = "\
The mirror is flat; its beam is as wide as the light source's disc. Attitudes: sun_to_nadir (halfway
between Sun and nadir: sunlight goes straight down; moonlight goes where that normal sends it),
nadir, sun, sun_azimuth; or a normal fixed along the orbit (--lvlh) or among the stars
(--inertial-deg).

The search samples the angle between beam and site, refines every minimum and brackets the two
edges of the beam: 5.8 km at 7 km/s pass in less than a second and are found nevertheless.
Approaches below the site's horizon are excluded.

A circular orbit of which only height and inclination are known takes its node and phase from
--node-deg and --phase-deg; how often such an orbit's beam meets the site by chance is printed.

Examples:
  satphot limits footprint --site -33.7703,151.1113,70
  satphot limits footprint --site -33.7703,151.1113,70 --start 2025-06-11T00:00:00 --node-deg 77
  satphot limits footprint --elements mirror.tle --start 2025-06-11T00:00:00 --csv";

/// The beam of a mirror: diameter at the ground, nearest approaches to a site, crossings with their length and
/// magnitude.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Footprint {
    /// Area of the mirror [m2]
    #[arg(long, value_name = "M2", default_value_t = 324.0, allow_hyphen_values = true)]
    area_m2: f64,
    /// Reflectance of the mirror
    #[arg(long, value_name = "RHO", default_value_t = 0.96, allow_hyphen_values = true)]
    reflectance: f64,
    /// Divergence of the beam: the diameter of the light source's disc [deg]
    #[arg(long, value_name = "DEG", default_value_t = PUBLISHED_DIVERGENCE_DEG, allow_hyphen_values = true)]
    divergence_deg: f64,
    /// Attitude of the mirror
    #[arg(long, value_name = "ATTITUDE", default_value = "sun_to_nadir",
          value_parser = ["sun_to_nadir", "nadir", "sun", "sun_azimuth"])]
    attitude: String,
    /// Normal fixed along the orbit instead: x forward, y against the angular momentum, z down
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', num_args = 1, allow_hyphen_values = true,
          conflicts_with_all = ["attitude", "inertial_deg"])]
    lvlh: Vec<f64>,
    /// Normal fixed among the stars instead: right ascension, declination of date [deg]
    #[arg(
        long,
        value_name = "RA,DEC",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        conflicts_with = "attitude"
    )]
    inertial_deg: Vec<f64>,
    /// Light source whose beam is followed
    #[arg(long, alias = "lamp", value_name = "SOURCE", default_value = "both", value_parser = ["sun", "moon", "both"])]
    light_source: String,
    /// Height of a circular orbit [km]
    #[arg(long, value_name = "KM", default_value_t = 625.0, allow_hyphen_values = true, conflicts_with = "elements")]
    height_km: f64,
    /// Its inclination [deg]
    #[arg(long, value_name = "DEG", default_value_t = 88.0, allow_hyphen_values = true, conflicts_with = "elements")]
    inclination_deg: f64,
    /// Right ascension of its ascending node [deg]
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true, conflicts_with = "elements")]
    node_deg: f64,
    /// Angle from the node at the start [deg]
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true, conflicts_with = "elements")]
    phase_deg: f64,
    #[command(flatten)]
    orbit: OrbitArgs,
    /// First moment, UTC
    #[arg(long, value_name = "UTC", default_value = "2025-06-11T00:00:00")]
    start: String,
    /// Length of the search [h]
    #[arg(long, value_name = "H", default_value_t = 24.0, allow_hyphen_values = true)]
    hours: f64,
    /// Nearest approaches listed for each light source, besides crossings
    #[arg(long, value_name = "N", default_value_t = 5)]
    nearest: usize,
    /// Print comma-separated values of all approaches instead of a table
    #[arg(long)]
    csv: bool,
    /// Write all approaches as a table into this file
    #[arg(short, long, value_name = "FILE.ecsv", value_parser = ecsv_file)]
    out: Option<PathBuf>,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

fn ecsv_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_ecsv = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ecsv"));
    if is_ecsv { Ok(path) } else { Err("tables are ECSV: the name must end in .ecsv".into()) }
}

impl Footprint {
    pub fn execute(self) -> anyhow::Result<()> {
        self.check()?;
        let mirror = Mirror {
            area_m2: self.area_m2,
            reflectance: self.reflectance,
            attitude: self.attitude()?,
            half_rad: (0.5 * self.divergence_deg).to_radians(),
        };
        let config = self.orbit.configuration(self.orbit.place.missing()?.into_iter().collect())?;
        let site = match (self.orbit.place.given()?, &config) {
            (Some(site), _) => site,
            (None, Some(config)) => config.site.clone(),
            (None, None) => {
                return Err(bad(
                    "--site",
                    "is needed without a configuration: latitude,longitude,height [deg, deg, m]".into(),
                ));
            }
        };
        let start = parse_utc("--start", &self.start)?;
        let here = Site::from_config(&site)?;
        let eop = EarthOrientation::default();
        let circle = CircularOrbit::new(
            self.height_km,
            self.inclination_deg.to_radians(),
            self.node_deg.to_radians(),
            self.phase_deg.to_radians(),
        )?;
        let tracker = match self.orbit.elements {
            Some(_) => Some(Tracker::from_config(&self.orbit.orbit_and_site(config.as_ref())?.0, &site)?),
            None => None,
        };
        if let Some(warning) = tracker.as_ref().and_then(|t| t.age_warning(&start)).filter(|_| !self.quiet) {
            tell(&format!("note: {warning}"));
        }
        if tracker.is_none() {
            tell_unknown_ut1(&start, self.quiet);
        }
        let at = |t_s: f64| -> satphot::Result<Scene> {
            let epoch = shifted(start, t_s);
            match &tracker {
                Some(tracker) => tracker.at(&epoch).map(|g| scene(&g)),
                None => {
                    let sky = bodies(&epoch, &eop)?;
                    geometry(&here, &eop, &epoch, &circle.state(t_s), &sky, 0.0).map(|g| scene(&g))
                }
            }
        };
        // both light sources sample the same moments
        let kept: RefCell<std::collections::HashMap<u64, Scene>> = RefCell::default();
        let kept_at = |t_s: f64| -> satphot::Result<Scene> {
            if let Some(scene) = kept.borrow().get(&t_s.to_bits()) {
                return Ok(*scene);
            }
            let scene = at(t_s)?;
            kept.borrow_mut().insert(t_s.to_bits(), scene);
            Ok(scene)
        };
        let sources = SourceSettings::new(&Effects::of(Mode::Corrected), &Band::of_config("V")?)?;
        let mut found = Vec::new();
        for (name, source) in [("sun", LightSource::Sun), ("moon", LightSource::Moon)] {
            if self.light_source == name || self.light_source == "both" {
                let times = (3600.0 * self.hours, STEP_S);
                found.push((name, approaches(&kept_at, (source, &mirror), times, &sources)?));
            }
        }
        let utc = |t_s: f64| iso_utc(shifted(start, t_s), 1);
        let table = rows(&found, &utc);
        if self.csv {
            print(&csv_text(&table)?);
        } else {
            print(&self.beam_text(&site, start, tracker.is_some())?);
            for (name, all) in &found {
                print(&self.source_text(name, all, &utc));
            }
        }
        if let Some(path) = &self.out {
            write_rows(path, &table, &self.meta(&site, start))?;
            if !self.quiet {
                tell(&format!("wrote {}", path.display()));
            }
        }
        Ok(())
    }

    fn check(&self) -> anyhow::Result<()> {
        positive("--area-m2", Some(self.area_m2))?;
        checked_height(self.height_km)?;
        for (key, value, low, high) in [
            ("--reflectance", self.reflectance, 0.0, 1.0),
            ("--divergence-deg", self.divergence_deg, 1e-6, 90.0),
            ("--inclination-deg", self.inclination_deg, 0.0, 180.0),
            ("--node-deg", self.node_deg, -360.0, 360.0),
            ("--phase-deg", self.phase_deg, -360.0, 360.0),
            ("--hours", self.hours, 1e-3, 24.0 * 31.0),
        ] {
            within(key, Some(value), low, high)?;
        }
        Ok(())
    }

    fn attitude(&self) -> anyhow::Result<Attitude> {
        let attitude = match (self.lvlh.as_slice(), self.inertial_deg.as_slice(), self.attitude.as_str()) {
            ([x, y, z], [], _) => Attitude::Lvlh([*x, *y, *z]),
            ([], [ra, dec], _) => Attitude::Inertial { ra_rad: ra.to_radians(), dec_rad: dec.to_radians() },
            ([], [], "nadir") => Attitude::Nadir,
            ([], [], "sun") => Attitude::Sun,
            ([], [], "sun_azimuth") => Attitude::SunAzimuth,
            ([], [], _) => Attitude::SunToNadir,
            ([], ..) => return Err(bad("--inertial-deg", "needs two numbers: right ascension,declination".into())),
            _ => return Err(bad("--lvlh", "needs three numbers: x,y,z".into())),
        };
        attitude.check("attitude").map_err(|e| match e {
            Error::Model { problem } => bad(if self.lvlh.is_empty() { "--inertial-deg" } else { "--lvlh" }, problem),
            other => other.into(),
        })?;
        Ok(attitude)
    }

    fn meta(&self, site: &satphot::config::Site, start: Epoch) -> Meta {
        let number = MetaValue::Number;
        let mut meta = Meta::default();
        meta.push("schema", "satphot.footprint/1");
        meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
        meta.push("time_scale", "UTC");
        let fields = [("lat_deg", site.lat_deg), ("lon_deg", site.lon_deg), ("alt_m", site.alt_m)];
        meta.push("site", MetaValue::Map(fields.map(|(key, value)| (key.to_string(), number(value))).to_vec()));
        meta.push("start", iso_utc(start, 0));
        meta.push("hours", number(self.hours));
        meta.push("area_m2", number(self.area_m2));
        meta.push("reflectance", number(self.reflectance));
        meta.push("divergence_deg", number(self.divergence_deg));
        if self.orbit.elements.is_none() {
            meta.push("height_km", number(self.height_km));
            meta.push("inclination_deg", number(self.inclination_deg));
            meta.push("node_deg", number(self.node_deg));
            meta.push("phase_deg", number(self.phase_deg));
        }
        meta
    }

    /// The beam itself, and the chance of meeting it.
    fn beam_text(&self, site: &satphot::config::Site, start: Epoch, from_elements: bool) -> anyhow::Result<String> {
        let divergence_rad = self.divergence_deg.to_radians();
        if from_elements {
            return Ok(format!("beam of {} deg; orbit by elements\n", self.divergence_deg));
        }
        let diameter_km = beam_diameter_km(self.height_km, divergence_rad)?;
        let lat_rad = site.lat_deg.to_radians();
        let per_day = crossings_per_day(self.height_km, self.inclination_deg.to_radians(), lat_rad, diameter_km)?;
        let chance = if per_day > 0.0 {
            format!("once in {:.0} days", 1.0 / per_day)
        } else {
            "never: the orbit does not come over it".into()
        };
        Ok(format!(
            "beam of {} deg: {diameter_km:.3} km across at {} km, straight down\n\
             circular orbit {} km, {} deg, node {} deg, phase {} deg at {}\n\
             by chance (node and phase unknown, beam to nadir) it sweeps over the site {chance}, day or night\n",
            self.divergence_deg,
            self.height_km,
            self.height_km,
            self.inclination_deg,
            self.node_deg,
            self.phase_deg,
            iso_utc(start, 0),
        ))
    }

    /// Crossings and nearest approaches of one light source's beam.
    fn source_text(&self, name: &str, all: &[Approach], utc: &dyn Fn(f64) -> String) -> String {
        let crossings = all.iter().filter(|a| a.inside.is_some()).count();
        let lit = all.iter().filter(|a| a.inside.is_some_and(|i| i.mag.is_some())).count();
        let mut sorted: Vec<&Approach> = all.iter().collect();
        sorted.sort_by(|a, b| a.miss_km.total_cmp(&b.miss_km));
        let shown = sorted.into_iter().take(self.nearest.max(crossings));
        let mut text = format!(
            "\n{name}: {} approaches above the horizon in {} h, the beam covers the site {crossings} times, {lit} of them lit\n",
            all.len(),
            self.hours
        );
        let rows: Vec<Vec<String>> = shown.map(|a| cells(a, utc)).collect();
        if !rows.is_empty() {
            text.push_str(&text_table(
                &["UTC", "alt deg", "range km", "off deg", "miss km", "spot km", "lit", "in beam s", "V"],
                &rows,
            ));
        }
        text
    }
}

fn cells(a: &Approach, utc: &dyn Fn(f64) -> String) -> Vec<String> {
    let spot = a.spot.and_then(|s| Some(format!("{:.2} x {:.2}", s.along_km?, s.across_km?)));
    vec![
        utc(a.t_s),
        format!("{:.2}", a.alt_rad.to_degrees()),
        format!("{:.1}", a.range_km),
        format!("{:.3}", a.offset_rad.to_degrees()),
        format!("{:.2}", a.miss_km),
        spot.unwrap_or_else(|| "-".into()),
        format!("{:.2}", a.lit_frac),
        a.inside.map_or("-".into(), |i| format!("{:.3}", i.to_s - i.from_s)),
        a.inside.and_then(|i| i.mag).map_or("-".into(), |m| format!("{m:.2}")),
    ]
}

fn rows(found: &[(&str, Vec<Approach>)], utc: &dyn Fn(f64) -> String) -> Vec<FootprintRow> {
    let row = |name: &str, a: &Approach| FootprintRow {
        lamp: name.into(),
        date_mid: utc(a.t_s),
        alt_deg: a.alt_rad.to_degrees(),
        range_km: a.range_km,
        offset_deg: a.offset_rad.to_degrees(),
        miss_km: a.miss_km,
        spot_along_km: a.spot.and_then(|s| s.along_km),
        spot_across_km: a.spot.and_then(|s| s.across_km),
        incidence_deg: a.spot.map(|s| s.incidence_rad.to_degrees()),
        lit_frac: a.lit_frac,
        in_beam_from: a.inside.map_or(String::new(), |i| utc(i.from_s)),
        in_beam_s: a.inside.map(|i| i.to_s - i.from_s),
        v_mag: a.inside.and_then(|i| i.mag),
    };
    found.iter().flat_map(|(name, all)| all.iter().map(|a| row(name, a))).collect()
}
