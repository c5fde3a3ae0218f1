//! `satphot predict duty`: the share of time a satellite can be observed, by twilight, day and Moonlight.

use std::path::PathBuf;

use clap::Args;
use hifitime::Epoch;
use satphot::base::threads::with_threads;
use satphot::base::time::iso_utc;
use satphot::brightness::{ModelSettings, Satellite, ToleranceOf};
use satphot::config::{self, Config};
use satphot::orbit::Site;
use satphot::report::summary::text_table;
use satphot::tables::{DutyRow, csv_text, write_rows};
use satphot::visibility::duty_cycle::{SunTime, sun_time, v_mag_of_mu};
use satphot::visibility::forecast::day::{day_moments, predict_day};
use satphot::visibility::forecast::dome::Dome;
use satphot::visibility::forecast::month::TrackedLimits;
use satphot::visibility::forecast::prediction_meta;

use super::super::orbit_args::{SiteArg, bad, configuration, tell_unknown_ut1};
use super::super::{bar::Bars, print, tell, threads};
use super::dome_args::{SamplingArgs, first_moment, height_km, site_of};
use super::{ModelArgs, OutArgs};

/// Sun's altitude below which it is night [deg].
const NIGHT_DEG: f64 = -18.0;

const AFTER_HELP: &str = "\
The Sun's altitude (its centre, no refraction) crosses -0.83 (sunset: upper limb, refraction),
-6, -12 and -18 deg at times found by bisection; twilight counted from 0 deg is reported too. Where it never does, as in polar summer, a part is all of the window or nothing.
With --satellite the nights are computed too: a moment of night counts as observable where the
median over the sky is brighter than --limit-mag. Unless given, that is the V at which the
satellite overhead has the 1-sigma surface brightness of a tracked 10 s exposure under full
Moon (21.65 mag/arcsec2).

Examples:
  satphot predict duty --site -33.7703,151.1113,70 --date 2025-06-11
  satphot predict duty --site -33.7703,151.1113,70 --date 2025-06-11 --satellite iss
  satphot predict duty --site 69.65,18.96,100 --date 2025-01-01 --days 365 --csv";

/// Reports the share of time in which a satellite can be observed: in twilight, by day, by Moonlight.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Duty {
    /// Configuration with [site]; pipeline.toml where the arguments leave something open
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    place: SiteArg,
    /// First day, from 0 h UTC
    #[arg(long, value_name = "YYYY-MM-DD", conflicts_with = "start")]
    date: Option<String>,
    /// First moment instead of 0 h, UTC
    #[arg(long, value_name = "UTC")]
    start: Option<String>,
    /// Length of the window [d]
    #[arg(long, value_name = "D", default_value_t = 1.0, allow_hyphen_values = true)]
    days: f64,
    /// Faintest median V over the sky that counts as observable
    #[arg(long, value_name = "MAG", allow_hyphen_values = true, requires = "satellite")]
    limit_mag: Option<f64>,
    /// Time between the computed moments of the night [min]
    #[arg(long, value_name = "MIN", default_value_t = 10.0, allow_hyphen_values = true)]
    step_min: f64,
    /// Number of directions of the sky
    #[arg(long, value_name = "N", default_value_t = 100)]
    points: usize,
    #[command(flatten)]
    sampling: SamplingArgs,
    /// Height of the orbits [km]; the catalogue's where it has one
    #[arg(long, value_name = "KM", allow_hyphen_values = true)]
    height_km: Option<f64>,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    #[command(flatten)]
    out: OutArgs,
    /// Number of threads; 0 = all cores. The result does not depend on it
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    jobs: usize,
    /// Print no progress bar and no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Duty {
    pub fn execute(self) -> anyhow::Result<()> {
        let start = first_moment(self.date.as_deref(), self.start.as_deref())?;
        tell_unknown_ut1(&start, self.quiet);
        let given = self.place.given()?;
        let config = configuration(
            self.config.as_deref(),
            &self.sets,
            &given.is_none().then_some("--site").into_iter().collect::<Vec<_>>(),
        )?;
        let place = site_of(given, config.as_ref())?;
        let site = Site::from_config(&place)?;
        let sun = with_threads(self.jobs, || sun_time(&site, &start, self.days))??;
        let mut rows = sun_rows(&sun);
        let (mut meta, mut standing) = (satphot::tables::Meta::default(), String::new());
        if self.model.satellite.is_some() {
            let model = self.model_of(config.as_ref())?;
            rows.push(self.moonlight(&site, &model, &start, &sun)?);
            standing = Satellite::from_config(&model)?.standing_line();
            meta = prediction_meta("satphot.duty/1", &model, Some(&place));
        } else {
            meta.push("schema", "satphot.duty/1");
            meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
        }
        meta.push("start", iso_utc(start, 0));
        meta.push("window_d", self.days);
        let (tables, figures) = self.out.files("duty")?;
        tables.iter().try_for_each(|table| write_rows(table, &rows, &meta))?;
        if !self.quiet && self.out.out.iter().any(|o| figures.contains(o)) {
            tell("note: there is no figure of hours; `satphot predict day -o day.svg` draws the day");
        }
        if self.csv {
            print(&csv_text(&rows)?);
        } else {
            print(&format!("{} d from {}\n{}{standing}", self.days, iso_utc(start, 0), text(&rows)));
        }
        for file in tables.iter().filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }

    fn model_of(&self, config: Option<&Config>) -> anyhow::Result<config::Model> {
        let mut model = self.model.over(config, &self.sets)?;
        if self.model.tolerance.is_none() && config.is_none() {
            model.tolerance = 1e-3;
        }
        self.sampling.over(&mut model);
        Ok(model)
    }

    /// The nights, moment by moment.
    fn moonlight(&self, site: &Site, model: &config::Model, start: &Epoch, sun: &SunTime) -> anyhow::Result<DutyRow> {
        let satellite = Satellite::from_config(model)?;
        let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::try_from(model)? };
        let height_km = height_km(self.height_km, model)?;
        let area_m2: f64 = satellite.surfaces.iter().map(|s| s.area_m2).sum();
        let (_, one_sigma, _) = TrackedLimits::published().at(1.0, 0.0, model.mode)?;
        let limit = self.limit_mag.unwrap_or_else(|| v_mag_of_mu(one_sigma, area_m2, height_km));
        if !limit.is_finite() {
            return Err(bad("--limit-mag", format!("{limit} is not a magnitude")));
        }
        let dome = Dome::new(site, &satellite, &settings, height_km, std::f64::consts::FRAC_PI_2)?;
        let points = self.sampling.points(self.points, model)?;
        let dark = |epoch: &Epoch| -> satphot::Result<bool> {
            Ok(satphot::visibility::forecast::dome::Overhead::at(site, epoch)?.sun.alt_rad.to_degrees() <= NIGHT_DEG)
        };
        let mut nights = Vec::new();
        for epoch in day_moments(*start, self.days * 24.0, self.step_min)? {
            if dark(&epoch)? {
                nights.push(epoch);
            }
        }
        let bar = Bars::new(!self.quiet);
        let rows = with_threads(self.jobs, || predict_day(site, &dome, &points, &nights, &bar))??;
        // half of the directions at least must be lit for their median to stand for the sky
        let seen = rows.iter().filter(|r| r.lit_frac >= 0.5 && r.model_v_mag.is_some_and(|v| v <= limit)).count();
        let share = if rows.is_empty() { 0.0 } else { seen as f64 / rows.len() as f64 };
        let duration_s = sun.above_s[4] + share * sun.night_s();
        Ok(DutyRow {
            observing: "twilight, day and Moonlight".into(),
            threshold: format!(
                "or median V of {} above {limit:.2} ({seen} of {} moments of night)",
                satellite.name,
                rows.len()
            ),
            duration_h: duration_s / 3600.0,
            duty_pct: 100.0 * duration_s / sun.window_s,
            published_pct: Some(100.0),
        })
    }
}

/// The parts of the window the Sun alone decides.
fn sun_rows(sun: &SunTime) -> Vec<DutyRow> {
    let row = |observing: &str, threshold: &str, s: f64, published_pct: Option<f64>| DutyRow {
        observing: observing.into(),
        threshold: threshold.into(),
        duration_h: s / 3600.0,
        duty_pct: 100.0 * s / sun.window_s,
        published_pct,
    };
    vec![
        row("day", "Sun above -0.83 deg (sunset)", sun.above_s[1], None),
        row("civil twilight", "Sun -6 to -0.83 deg", sun.between_s(Some(1), 2), None),
        row("nautical twilight", "Sun -12 to -6 deg", sun.between_s(Some(2), 3), None),
        row("astronomical twilight", "Sun -18 to -12 deg", sun.between_s(Some(3), 4), None),
        row("night", "Sun below -18 deg", sun.night_s(), None),
        row("twilight only", "Sun -18 to -0.83 deg", sun.between_s(Some(1), 4), Some(12.5)),
        row("twilight by the centre", "Sun -18 to 0 deg", sun.between_s(Some(0), 4), None),
        row("twilight and day", "Sun above -18 deg", sun.above_s[4], Some(54.0)),
    ]
}

fn text(rows: &[DutyRow]) -> String {
    let lines: Vec<Vec<String>> = rows
        .iter()
        .map(|r| {
            vec![
                r.observing.clone(),
                r.threshold.clone(),
                format!("{:.2}", r.duration_h),
                format!("{:.1}", r.duty_pct),
                r.published_pct.map_or(String::new(), |p| format!("{p}")),
            ]
        })
        .collect();
    text_table(&["observing", "when", "h", "%", "published %"], &lines)
}
