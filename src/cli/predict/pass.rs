//! `satphot predict pass`: magnitudes along the passes of a satellite over a site, light by light.

use clap::Args;
use hifitime::Epoch;
use satphot::Error;
use satphot::base::threads::with_threads;
use satphot::base::time::{iso_utc, seconds_between, shifted};
use satphot::brightness::scene::scene;
use satphot::brightness::{Model, ModelSettings, Satellite};
use satphot::figures::light_curve;
use satphot::orbit::{Pass as Stay, Tracker};
use satphot::pipeline::explain::{explain_low_rows, explain_scenes};
use satphot::report::summary::{pass_lights, text_table};
use satphot::tables::{MetaValue, PREDICTION, PhotometryRow, csv_of_cells, prediction_cells, write_prediction};
use satphot::visibility::forecast::{Window, highest, moments, predict, prediction_meta, visible};

use super::super::orbit_args::{OrbitArgs, bad, window};
use super::super::{bar::Bars, print, tell, threads};
use super::{Clock, ModelArgs, OutArgs, band_note};

const AFTER_HELP: &str = "\
Rows are whole steps after --start, wherever the satellite is above --min-alt; a pass that
falls between two steps is shown at its culmination. Every light has its own column: sunlight,
sunlight reflected by the Earth (earthshine), moonlight, moonlight reflected by the Earth; a light
that is absent is an empty cell, and the column skipped says why. Magnitudes are outside
the atmosphere unless model.effects.source says otherwise; v_pred_err_mag holds 68 % of
observed magnitudes (empty for a satellite nobody compared), model_err_mag is the numerical
error alone.

Examples:
  satphot predict pass --elements iss.tle --site -33.77,151.11,70 --satellite iss \\
      --start 2025-06-09T10:00:00 --hours 1
  satphot predict pass -c pipeline.toml --start 2025-06-09T00:00:00 --hours 24 -o predicted
  satphot predict pass -c pipeline.toml --start 2025-06-09T10:25:00 \\
      --end 2025-06-09T10:45:00 --step-s 1 --csv
  satphot predict pass -c pipeline.toml --start 2025-06-09T10:00:00 --hours 1 \\
      --set model.effects.shadow=cylinder --explain

-o writes the table (ECSV, the columns of every other table) and the light curve (SVG). A window
in which the satellite is never above --min-alt gives \"no pass\", exit code 0 and
a table without rows; elements that are too old give exit code 5.";

/// Predicts the magnitude of a satellite along its passes over a site: total and each light, moment by moment.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Pass {
    #[command(flatten)]
    orbit: OrbitArgs,
    #[command(flatten)]
    model: ModelArgs,
    /// First moment, UTC, e.g. 2025-06-10T06:00:00
    #[arg(long, value_name = "UTC")]
    start: String,
    /// Last moment, UTC
    #[arg(long, value_name = "UTC", conflicts_with = "hours")]
    end: Option<String>,
    /// Length of the window [h]
    #[arg(long, value_name = "H", default_value_t = 24.0, allow_hyphen_values = true)]
    hours: f64,
    /// Time between rows [s]
    #[arg(long, value_name = "S", default_value_t = 5.0, allow_hyphen_values = true)]
    step_s: f64,
    /// Rows only above this altitude [deg]
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    min_alt: f64,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    #[command(flatten)]
    out: OutArgs,
    /// Number of threads; 0 = all cores. The result does not depend on it
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    jobs: usize,
    /// Report on standard error what was skipped in each scene, why, and the CPU time saved
    #[arg(long)]
    explain: bool,
    /// Print no progress bar and no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Pass {
    pub fn execute(self) -> anyhow::Result<()> {
        let window = self.window()?;
        let mut missing = self.orbit.missing()?;
        missing.extend(self.model.missing());
        let config = self.orbit.configuration(missing)?;
        let model = self.model.over(config.as_ref(), &self.orbit.sets)?;
        let (orbit, site) = self.orbit.orbit_and_site(config.as_ref())?;
        let satellite = Satellite::from_config(&model)?;
        let engine = Model::new(&satellite, &ModelSettings::try_from(&model)?)?;
        let tracker = Tracker::from_config(&orbit, &site)?;

        let stays = visible(&tracker, &window)?;
        let middle = shifted(window.start, 0.5 * seconds_between(window.start, window.end));
        if let Some(warning) = tracker.age_warning(&middle).filter(|_| !self.quiet) {
            tell(&format!("note: {warning}"));
        }
        let epochs = moments(&window, &stays)?;
        let bar = Bars::new(!self.quiet);
        let rows = with_threads(self.jobs, || predict(&tracker, &engine, &epochs, &bar))??;

        let mut meta = prediction_meta("satphot.prediction/1", &model, Some(&site));
        meta.push("orbit_source", MetaValue::Text(orbit.elements.display().to_string()));
        let (tables, mut figures) = self.out.files("pass")?;
        for table in &tables {
            write_prediction(table, &rows, &meta)?;
        }
        let name = rows.first().map(|r| r.object_name.clone()).unwrap_or_default();
        let band = band_note(&model);
        if let Some(band) = band.as_ref().filter(|_| !self.quiet) {
            tell(&format!("note: magnitudes are of {band}, also where a name or label says V"));
        }
        let band = band.map(|band| format!(", {band}")).unwrap_or_default();
        if rows.is_empty() {
            for figure in figures.drain(..).filter(|_| !self.quiet) {
                tell(&format!("note: {} is not drawn: there is no pass", figure.display()));
            }
        }
        for figure in &figures {
            light_curve(figure, &rows, &format!("{name} as {}, predicted{band}", satellite.name))?;
        }
        if rows.is_empty() {
            self.tell_no_pass(&tracker, &window)?;
        } else {
            self.tell_results(&rows, &stays)?;
        }
        if !self.csv {
            print(&satellite.standing_line());
        }
        if self.explain {
            explain(&tracker, &engine, &window, &epochs)?;
        }
        for file in tables.iter().chain(&figures).filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }

    fn window(&self) -> anyhow::Result<Window> {
        let (start, end) = window(&self.start, self.end.as_deref(), self.hours)?;
        if !(0.001..=600.0).contains(&self.step_s) {
            return Err(bad("--step-s", format!("{} is outside 0.001 to 600 s", self.step_s)));
        }
        if !(0.0..90.0).contains(&self.min_alt) {
            return Err(bad("--min-alt", format!("{} is outside 0 to 90 deg", self.min_alt)));
        }
        Ok(Window { start, end, step_s: self.step_s, min_alt_rad: self.min_alt.to_radians() })
    }

    /// The answer for a satellite that does not come up, with how near it comes.
    fn tell_no_pass(&self, tracker: &Tracker, window: &Window) -> anyhow::Result<()> {
        let best = highest(tracker, window)?;
        let highest = best.map_or(String::new(), |top| {
            format!(" (highest {:.1} deg at {})", top.alt_rad.to_degrees(), iso_utc(top.epoch, 0))
        });
        if self.csv {
            print(&format!("{}\n", PREDICTION.column_names().join(",")));
        }
        let answer = format!(
            "no pass: the satellite is never above {} deg from {} to {}{highest}; `satphot passes` lists when it is",
            self.min_alt,
            iso_utc(window.start, 0),
            iso_utc(window.end, 0)
        );
        if self.csv {
            tell(&answer)
        } else {
            print(&format!("{answer}\n"))
        }
        Ok(())
    }

    /// The table on standard output: CSV, every row, or one line per pass when files were written.
    fn tell_results(&self, rows: &[PhotometryRow], stays: &[Stay]) -> anyhow::Result<()> {
        if self.csv {
            print(&csv_of_cells(PREDICTION.columns, &prediction_cells(rows)?)?);
            return Ok(());
        }
        if self.out.out.is_empty() {
            print(&table(rows));
            print("\n");
        }
        print(&pass_lights(rows));
        let whole = stays.iter().filter(|s| s.starts_before || s.ends_after).count();
        if whole > 0 && !self.quiet {
            tell(&format!("note: {whole} of {} passes are cut by the window", stays.len()));
        }
        Ok(())
    }
}

/// Reports what was excluded from the rows, and the rows that were excluded.
fn explain(tracker: &Tracker, engine: &Model, window: &Window, epochs: &[Epoch]) -> anyhow::Result<()> {
    let scenes = epochs.iter().map(|at| Ok(scene(&tracker.at(at)?))).collect::<Result<Vec<_>, Error>>()?;
    let clock = Clock::start();
    let label = |i: usize| iso_utc(epochs[i], 0);
    let mut explained = explain_scenes(engine, &scenes, &label, &|| clock.cpu_s())?;
    let low = explain_low_rows(tracker, engine, window, epochs, &|| clock.cpu_s())?;
    explained.items.splice(0..0, low);
    tell(&explained.text());
    Ok(())
}

/// Every row, for reading.
fn table(rows: &[PhotometryRow]) -> String {
    let head = [
        "UTC",
        "alt",
        "az",
        "range km",
        "phase",
        "sun alt",
        "light",
        "V",
        "sun",
        "earthshine",
        "moon",
        "lunar earthshine",
    ];
    let number = |value: Option<f64>, decimals: usize| value.map_or(String::new(), |v| format!("{v:.decimals$}"));
    let lines: Vec<Vec<String>> = rows
        .iter()
        .map(|r| {
            vec![
                r.date_mid.clone(),
                number(r.alt_deg, 2),
                number(r.az_deg, 2),
                number(r.range_km, 1),
                number(r.phase_angle_deg, 1),
                number(r.sun_alt_deg, 1),
                r.illum.clone(),
                number(r.model_v_mag, 3),
                number(r.sun_v_mag, 3),
                number(r.earthshine_v_mag, 3),
                number(r.moon_v_mag, 3),
                number(r.lunar_earthshine_v_mag, 3),
            ]
        })
        .collect();
    text_table(&head, &lines)
}
