//! `satphot passes`: when a satellite can be seen, and by which light.

use clap::Args;
use satphot::brightness::light_class;
use satphot::night::clock::{iso_utc, parse_utc, shifted};
use satphot::night::compare::scene;
use satphot::night::light_class::{PaperLabel, SkyClass, classes};
use satphot::orbit::{PassEvent, Tracker, passes};
use satphot::report::summary::text_table;

use super::orbit_args::{OrbitArgs, bad};
use super::{print, tell};

const AFTER_HELP: &str = "\
light: what reaches the satellite at rise, culmination and set. sky: where the Sun stands at culmination. The paper's label
goes by the light on the satellite: day with the Sun up, twilight if sunlight reaches the satellite at any of the three
moments (or the sky is not yet dark), else night.

Example:
  satphot passes --elements iss.tle --site -33.77,151.11,70 --start 2025-06-10T06:00:00";

/// Lists the passes of a satellite over a site: rise, culmination, set, with Sun, Moon and the light it is seen by.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Passes {
    #[command(flatten)]
    orbit: OrbitArgs,
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
        let config = self.orbit.configuration(self.orbit.incomplete()?, "--elements and --site")?;
        if config.is_none() && !self.orbit.sets.is_empty() {
            return Err(bad("--set", "has no effect: --elements and --site replace the configuration".into()));
        }
        let (orbit, site) = self.orbit.orbit_and_site(config.as_ref())?;
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
            "sky",
            "paper's label",
        ];
        let mut rows = Vec::new();
        for pass in &found {
            let (mut lights, mut labels) = (Vec::new(), Vec::new());
            for event in [&pass.rise, &pass.culmination, &pass.set] {
                let light = light_class(&scene(&event.geometry))?.to_string();
                labels.push(classes(&event.geometry)?.1);
                if lights.last() != Some(&light) {
                    lights.push(light);
                }
            }
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
                format!("{:.0}", 100.0 * pass.culmination.geometry.moon_illum_frac),
                lights.join(">"),
                SkyClass::of_sun_alt(pass.culmination.sun_alt_rad.to_degrees()).to_string(),
                PaperLabel::of_pass(labels).map_or(String::new(), |l| l.to_string()),
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
                "sky_class",
                "paper_label",
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
}
