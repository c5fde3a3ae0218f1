//! `satphot passes`: when a satellite can be seen, and by which light.

use clap::Args;
use hifitime::Epoch;
use satphot::base::time::{iso_utc, seconds_between, shifted};
use satphot::brightness::light_class;
use satphot::brightness::light_class::{PaperLabel, SkyClass, classes};
use satphot::brightness::scene::scene;
use satphot::orbit::{PassEvent, Tracker, WholePass, whole_passes};
use satphot::report::summary::text_table;
use satphot::tables::PASSES;

use super::orbit_args::{OrbitArgs, bad, window};
use super::{print, tell};

const AFTER_HELP: &str = "\
A pass of which a part lies in the window is listed whole; the column \"outside the window\" names which of rise,
culmination and set lie before --start or after the end. A satellite that neither rises nor sets (geostationary) has no
culmination: its cells are empty, and a note says so.

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
    /// First moment, e.g. 2025-06-10T06:00:00 (UTC), or with a zone: 2025-06-10T16:00:00+10:00
    #[arg(long, value_name = "UTC")]
    start: String,
    /// Last moment, UTC
    #[arg(long, value_name = "UTC", conflicts_with = "hours")]
    end: Option<String>,
    /// Length of the search [h]
    #[arg(long, value_name = "H", default_value_t = 24.0, allow_hyphen_values = true)]
    hours: f64,
    /// Passes that reach at least this altitude, between their crossings of it [deg]
    #[arg(long, value_name = "DEG", default_value_t = 10.0, allow_hyphen_values = true)]
    min_alt: f64,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
}

impl Passes {
    pub fn execute(self) -> anyhow::Result<()> {
        if !(-5.0..90.0).contains(&self.min_alt) {
            return Err(bad("--min-alt", format!("{} is outside -5 to 90 deg", self.min_alt)));
        }
        let window = window(&self.start, self.end.as_deref(), self.hours)?;
        let hours = seconds_between(window.0, window.1) / 3600.0;
        let config = self.orbit.configuration(self.orbit.missing()?)?;
        if config.is_none() && !self.orbit.sets.is_empty() {
            return Err(bad("--set", "has no effect: --elements and --site replace the configuration".into()));
        }
        let (orbit, site) = self.orbit.orbit_and_site(config.as_ref())?;
        let tracker = Tracker::from_config(&orbit, &site)?;
        if let Some(warning) = tracker.age_warning(&shifted(window.0, hours * 1800.0)) {
            tell(&format!("note: {warning}"));
        }
        let found = whole_passes(&tracker, &window.0, &window.1, self.min_alt.to_radians())?;
        let rows = found.iter().map(|pass| row(pass, window)).collect::<anyhow::Result<Vec<_>>>()?;
        let notes: Vec<String> = found.iter().map(|pass| note(pass, self.min_alt)).collect();
        if self.csv {
            print(&PASSES.csv_head());
            rows.iter().zip(&notes).for_each(|(r, note)| print(&format!("{},{note}\n", r.join(","))));
            return Ok(());
        }
        if rows.is_empty() {
            print(&format!("no pass above {} deg in these {hours} h\n", self.min_alt));
        } else {
            print(&text_table(&HEADER, &rows));
        }
        for (pass, note) in found.iter().zip(&notes).filter(|(_, note)| !note.is_empty()) {
            tell(&format!("note: the pass at {}: {note}", iso_utc(pass.inside.rise.epoch, 0)));
        }
        Ok(())
    }
}

const HEADER: [&str; 15] = [
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
    "outside the window",
];

/// The cells of a pass; what it does not have is empty. Light and label of a pass without rise, culmination or set are
/// those of its first, highest and last moment in the window.
fn row(pass: &WholePass, (start, end): (Epoch, Epoch)) -> anyhow::Result<Vec<String>> {
    let (mut lights, mut labels) = (Vec::new(), Vec::new());
    for (event, in_window) in
        [(&pass.rise, &pass.inside.rise), (&pass.culmination, &pass.inside.culmination), (&pass.set, &pass.inside.set)]
    {
        let geometry = &event.as_ref().unwrap_or(in_window).geometry;
        let light = light_class(&scene(geometry))?.to_string();
        labels.push(classes(geometry)?.1);
        if lights.last() != Some(&light) {
            lights.push(light);
        }
    }
    let cell =
        |event: &Option<PassEvent>, text: &dyn Fn(&PassEvent) -> String| event.as_ref().map(text).unwrap_or_default();
    let deg = |rad: f64| format!("{:.1}", rad.to_degrees());
    let utc = |event: &Option<PassEvent>| cell(event, &|e| iso_utc(e.epoch, 0));
    let top = |text: &dyn Fn(&PassEvent) -> String| cell(&pass.culmination, text);
    Ok(vec![
        utc(&pass.rise),
        utc(&pass.culmination),
        utc(&pass.set),
        cell(&pass.rise, &|e| deg(e.az_rad)),
        top(&|e| deg(e.alt_rad)),
        top(&|e| deg(e.az_rad)),
        cell(&pass.set, &|e| deg(e.az_rad)),
        top(&|e| format!("{:.1}", e.range_km)),
        top(&|e| deg(e.sun_alt_rad)),
        top(&|e| deg(e.moon_alt_rad)),
        top(&|e| format!("{:.0}", 100.0 * e.geometry.moon_illum_frac)),
        lights.join(">"),
        top(&|e| SkyClass::of_sun_alt(e.sun_alt_rad.to_degrees()).to_string()),
        PaperLabel::of_pass(labels).map_or(String::new(), |l| l.to_string()),
        pass.outside(&start, &end).join(" "),
    ])
}

/// What is to be said of a pass without a rise or a set; empty for all others.
fn note(pass: &WholePass, min_alt_deg: f64) -> String {
    let what = match (&pass.rise, &pass.set) {
        (Some(_), Some(_)) => return String::new(),
        (None, None) => "does not rise or set",
        (None, Some(_)) => "does not rise",
        (Some(_), None) => "does not set",
    };
    let [from, to] = pass.searched.map(|epoch| iso_utc(epoch, 0));
    let end = if pass.elements_end { " (the elements reach no further)" } else { "" };
    let inside = &pass.inside;
    let lowest = inside.rise.alt_rad.min(inside.set.alt_rad).to_degrees();
    format!(
        "above {min_alt_deg} deg all the time from {from} to {to}{end}: it {what} and has no culmination; altitude {lowest:.1} \
         to {:.1} deg at the ends and the highest moment of the window",
        inside.culmination.alt_rad.to_degrees()
    )
}
