//! `satphot passes`: when a satellite can be seen, and by which light.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::brightness::light_class;
use satphot::config::{Orbit, Site};
use satphot::night::clock::{iso_utc, parse_utc, shifted};
use satphot::night::compare::scene;
use satphot::orbit::{PassEvent, Tracker, passes};
use satphot::report::summary::text_table;

use super::{load, print, tell};

/// Lists the passes of a satellite over a site: rise, culmination, set, with Sun, Moon and the light it is seen by.
#[derive(Debug, Args)]
pub struct Passes {
    /// Configuration with [site] and [orbit]
    #[arg(short, long, value_name = "FILE", default_value = "pipeline.toml")]
    config: PathBuf,
    /// Set a key of the configuration (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Elements (TLE, 3LE, OMM JSON) instead of those of the configuration
    #[arg(long, value_name = "FILE")]
    elements: Option<PathBuf>,
    /// Catalogue number, when the file holds several objects
    #[arg(long, value_name = "NUMBER")]
    norad: Option<u64>,
    /// Site instead of the configuration's: latitude, longitude [deg], height [m], e.g. -33.77,151.11,70
    #[arg(long, value_name = "LAT,LON,ALT", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    site: Vec<f64>,
    /// First moment, UTC, e.g. 2025-06-10T06:00:00
    #[arg(long, value_name = "UTC")]
    start: String,
    /// Length of the search [h]
    #[arg(long, value_name = "H", default_value_t = 24.0, allow_hyphen_values = true)]
    hours: f64,
    /// Passes that reach at least this altitude, between their crossings of it [deg]
    #[arg(long, value_name = "DEG", default_value_t = 10.0, allow_hyphen_values = true)]
    min_alt: f64,
    /// Comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    /// Use elements older than the limit all the same
    #[arg(long)]
    force: bool,
}

impl Passes {
    pub fn execute(self) -> anyhow::Result<()> {
        if !(0.0 < self.hours && self.hours <= 24.0 * 366.0) {
            return Err(bad("--hours", format!("{} is outside 0 to 8784 h", self.hours)));
        }
        if !(-5.0..90.0).contains(&self.min_alt) {
            return Err(bad("--min-alt", format!("{} is outside -5 to 90 deg", self.min_alt)));
        }
        let start = parse_utc("--start", &self.start)?;
        let end = shifted(start, self.hours * 3600.0);
        let (orbit, site) = self.orbit_and_site()?;
        let tracker = Tracker::from_config(&orbit, &site)?;
        if let Some(warning) = tracker.age_warning(&shifted(start, self.hours * 1800.0)) {
            tell(&format!("note: {warning}"));
        }
        let found = passes(&tracker, &start, &end, self.min_alt.to_radians())?;
        let header = [
            "rise (UTC)",
            "culmination (UTC)",
            "set (UTC)",
            "az rise",
            "alt max",
            "az max",
            "az set",
            "range km",
            "sun alt",
            "moon alt",
            "moon %",
            "light",
        ];
        let mut rows = Vec::new();
        for pass in &found {
            let mut lights = Vec::new();
            for event in [&pass.rise, &pass.culmination, &pass.set] {
                let light = light_class(&scene(&tracker.at(&event.epoch)?))?.to_string();
                if lights.last() != Some(&light) {
                    lights.push(light);
                }
            }
            let culmination = tracker.at(&pass.culmination.epoch)?;
            let deg = |rad: f64| format!("{:.1}", rad.to_degrees());
            let utc = |e: &PassEvent| iso_utc(e.epoch, 0);
            rows.push(vec![
                utc(&pass.rise),
                utc(&pass.culmination),
                utc(&pass.set),
                deg(pass.rise.az_rad),
                deg(pass.culmination.alt_rad),
                deg(pass.culmination.az_rad),
                deg(pass.set.az_rad),
                format!("{:.1}", pass.culmination.range_km),
                deg(pass.culmination.sun_alt_rad),
                deg(pass.culmination.moon_alt_rad),
                format!("{:.0}", 100.0 * culmination.moon_illum_frac),
                lights.join(">"),
            ]);
        }
        if self.csv {
            let names = [
                "rise_utc",
                "culmination_utc",
                "set_utc",
                "rise_az_deg",
                "max_alt_deg",
                "max_az_deg",
                "set_az_deg",
                "range_km",
                "sun_alt_deg",
                "moon_alt_deg",
                "moon_illum_pct",
                "illum",
            ];
            print(&format!("{}\n", names.join(",")));
            rows.iter().for_each(|r| print(&format!("{}\n", r.join(","))));
        } else if rows.is_empty() {
            print(&format!("no pass above {} deg in these {} h\n", self.min_alt, self.hours));
        } else {
            print(&text_table(&header, &rows));
        }
        Ok(())
    }

    /// Elements and site from the arguments, else from the configuration.
    fn orbit_and_site(&self) -> anyhow::Result<(Orbit, Site)> {
        let needs_config = self.elements.is_none() || self.site.is_empty();
        let config = if needs_config {
            if !self.config.exists() {
                return Err(bad(
                    "-c",
                    format!("{} is not there; give --elements and --site instead", self.config.display()),
                ));
            }
            Some(load(&self.config, &self.sets)?)
        } else if self.sets.is_empty() {
            None
        } else {
            return Err(bad("--set", "has no effect: --elements and --site replace the configuration".into()));
        };
        let site = match (self.site.as_slice(), &config) {
            ([lat_deg, lon_deg, alt_m], _) => {
                Site { name: "command line".into(), lat_deg: *lat_deg, lon_deg: *lon_deg, alt_m: *alt_m }
            }
            ([], Some(config)) => config.site.clone(),
            _ => return Err(bad("--site", "needs three numbers: latitude,longitude,height".into())),
        };
        let mut orbit = match (&self.elements, config.and_then(|c| c.orbit)) {
            (Some(elements), from_config) => Orbit {
                elements: elements.clone(),
                norad_cat_id: None,
                max_age_d: from_config.as_ref().map_or(14.0, |o| o.max_age_d),
                force_age: false,
                ut1_utc_s: from_config.as_ref().map_or(0.0, |o| o.ut1_utc_s),
                xp_arcsec: from_config.as_ref().map_or(0.0, |o| o.xp_arcsec),
                yp_arcsec: from_config.as_ref().map_or(0.0, |o| o.yp_arcsec),
            },
            (None, Some(orbit)) => orbit,
            (None, None) => return Err(bad("--elements", "no [orbit] in the configuration; name a file".into())),
        };
        orbit.norad_cat_id = self.norad.or(orbit.norad_cat_id);
        orbit.force_age |= self.force;
        if !orbit.elements.exists() {
            return Err(Error::Orbit { problem: format!("no elements at {}", orbit.elements.display()) }.into());
        }
        Ok((orbit, site))
    }
}

fn bad(key: &str, problem: String) -> anyhow::Error {
    Error::Config { key: key.into(), problem }.into()
}
