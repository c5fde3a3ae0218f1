//! `satphot predict day`: the median brightness of a satellite over the sky through 24 hours.

use std::path::PathBuf;

use clap::Args;
use satphot::base::threads::with_threads;
use satphot::brightness::{ModelSettings, Satellite, ToleranceOf};
use satphot::figures::{Violin, day as draw};
use satphot::orbit::Site;
use satphot::report::summary::text_table;
use satphot::tables::{DayRow, MetaValue, ObservedRow, csv_text, read_photometry, write_rows};
use satphot::visibility::forecast::day::{ObservedPass, day_moments, observed_passes, predict_day};
use satphot::visibility::forecast::dome::Dome;
use satphot::visibility::forecast::prediction_meta;

use super::super::orbit_args::{SiteArg, configuration, tell_unknown_ut1};
use super::super::{bar::Bars, print, tell, threads};
use super::dome_args::{SamplingArgs, first_moment, height_km, mode_name, site_of};
use super::{ModelArgs, OutArgs, band_note};

const AFTER_HELP: &str = "\
At every moment one satellite is computed in many directions of the sky, all at one height; the
row is the median over the directions in which it is lit, and between which magnitudes the
middle 68 % of them lie. Where no direction is lit the cells are empty. How the directions are
spread changes the answer by day by 1 mag: --sampling solid_angle counts every area of the sky
alike (what a random satellite shows), alt_az every altitude and azimuth (as published).

The tolerance is 1e-3 of the sum of the lights unless --tolerance or a configuration says
otherwise: a median needs no more.

--observed draws passes of photometry tables as violins; a pass of another date stands at its
time of day, and the table says by how many days it was moved.

Examples:
  satphot predict day --satellite iss --site -33.7703,151.1113,70 --date 2025-06-11
  satphot predict day --satellite iss --height-km 420 --site -33.7703,151.1113,70 \\
      --date 2025-06-11 --mode as_published -o day --observed photometry.ecsv
  satphot predict day -c pipeline.toml --start 2025-06-11T04:00:00 --points 300 --csv";

/// Predicts the median brightness of a satellite over the sky, moment by moment for 24 hours.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Day {
    /// Configuration with [site] and [model]; pipeline.toml where the arguments leave something open
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    place: SiteArg,
    /// Day, UTC: from 0 h to 24 h
    #[arg(long, value_name = "YYYY-MM-DD", conflicts_with = "start")]
    date: Option<String>,
    /// First moment instead of 0 h, UTC, e.g. 2025-06-11T04:00:00
    #[arg(long, value_name = "UTC")]
    start: Option<String>,
    /// Length [h]
    #[arg(long, value_name = "H", default_value_t = 24.0, allow_hyphen_values = true)]
    hours: f64,
    /// Time between rows [min]
    #[arg(long, value_name = "MIN", default_value_t = 10.0, allow_hyphen_values = true)]
    step_min: f64,
    /// Number of directions of the sky
    #[arg(long, value_name = "N", default_value_t = 1000)]
    points: usize,
    #[command(flatten)]
    sampling: SamplingArgs,
    /// Height of the orbits [km]; the catalogue's where it has one
    #[arg(long, value_name = "KM", allow_hyphen_values = true)]
    height_km: Option<f64>,
    /// Azimuth in which the satellites move [deg]
    #[arg(long, value_name = "DEG", default_value_t = 90.0, allow_hyphen_values = true)]
    track_az_deg: f64,
    /// Photometry table whose passes are drawn next to the model (repeatable)
    #[arg(long, value_name = "photometry.ecsv")]
    observed: Vec<PathBuf>,
    /// Print comma-separated values instead of a summary
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

impl Day {
    pub fn execute(self) -> anyhow::Result<()> {
        let start = first_moment(self.date.as_deref(), self.start.as_deref())?;
        tell_unknown_ut1(&start, self.quiet);
        let epochs = day_moments(start, self.hours, self.step_min)?;
        let given = self.place.given()?;
        let missing: Vec<&str> = self.model.missing().into_iter().chain(given.is_none().then_some("--site")).collect();
        let config = configuration(self.config.as_deref(), &self.sets, &missing)?;
        let mut model = self.model.over(config.as_ref(), &self.sets)?;
        if self.model.tolerance.is_none() && config.is_none() {
            model.tolerance = 1e-3;
        }
        self.sampling.over(&mut model);
        let place = site_of(given, config.as_ref())?;
        let site = Site::from_config(&place)?;
        let satellite = Satellite::from_config(&model)?;
        let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::try_from(&model)? };
        let height_km = height_km(self.height_km, &model)?;
        let dome = Dome::new(&site, &satellite, &settings, height_km, self.track_az_deg.to_radians())?;
        let points = self.sampling.points(self.points, &model)?;

        let bar = Bars::new(!self.quiet);
        let rows = with_threads(self.jobs, || predict_day(&site, &dome, &points, &epochs, &bar))??;
        let observed = self.passes(&rows, &model.band)?;

        let band = band_note(&model);
        if let Some(band) = band.as_ref().filter(|_| !self.quiet) {
            tell(&format!("note: magnitudes are of {band}, also where a name or label says V"));
        }
        let how = self.sampling.text(self.points, &model);
        let title = format!("{} at {height_km} km · {} · {}", satellite.name, when(&rows), mode_name(model.mode));
        let (tables, figures) = self.out.files("day")?;
        let mut meta = prediction_meta("satphot.day/1", &model, Some(&place));
        meta.push("height_km", MetaValue::Number(height_km));
        meta.push("track_az_deg", MetaValue::Number(self.track_az_deg));
        meta.push("directions", MetaValue::Text(how.clone()));
        for table in &tables {
            write_rows(table, &rows, &meta)?;
            if !observed.is_empty() {
                let passes: Vec<&ObservedRow> = observed.iter().map(|p| &p.row).collect();
                write_rows(&table.with_file_name(passes_name(table)), &passes, &meta)?;
            }
        }
        let violins: Vec<Violin> = observed
            .iter()
            .map(|p| Violin { mjd_d: p.mjd_d, v_mag: p.v_mag.clone(), median_mag: p.row.v_mag })
            .collect();
        figures.iter().try_for_each(|figure| draw(figure, &rows, &violins, &title))?;
        if self.csv {
            print(&csv_text(&rows)?);
        } else {
            print(&format!("{title}\n{how}\n\n{}", summary(&rows)));
            if !observed.is_empty() {
                print(&format!("\n{}", passes_text(&observed)));
            }
            print(&format!("\n{}", satellite.standing_line()));
        }
        for file in tables.iter().chain(&figures).filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }

    /// The passes of every table named; a table without one is reported.
    fn passes(&self, rows: &[DayRow], band: &str) -> anyhow::Result<Vec<ObservedPass>> {
        let mut all = Vec::new();
        for path in &self.observed {
            let (observed, meta) = read_photometry(path)?;
            if let Some(MetaValue::Text(of)) = meta.get("band").filter(|_| !self.quiet)
                && of != band
                && observed.iter().any(|r| r.v_mag.is_some())
            {
                let path = path.display();
                tell(&format!(
                    "warning: {path}: its magnitudes are of band {of}, the model's of {band} (--set model.band={of})"
                ));
            }
            let passes = observed_passes(&observed, rows);
            if passes.is_empty() && !self.quiet {
                let n = observed.len();
                tell(&format!(
                    "note: {}: none of {n} rows has a usable magnitude and a time; no violin",
                    path.display()
                ));
            }
            all.extend(passes);
        }
        all.sort_by(|a, b| a.mjd_d.total_cmp(&b.mjd_d));
        Ok(all)
    }
}

/// `day.ecsv` -> `day_passes.ecsv`.
fn passes_name(table: &std::path::Path) -> String {
    format!("{}_passes.ecsv", table.file_stem().unwrap_or_default().to_string_lossy())
}

/// First and last moment.
fn when(rows: &[DayRow]) -> String {
    let minute = |r: Option<&DayRow>| r.map_or(String::new(), |r| r.date_mid.chars().take(16).collect::<String>());
    format!("{} to {} UTC", minute(rows.first()), minute(rows.last()))
}

/// A magnitude, or a dash where there is none.
fn cell(v: Option<f64>) -> String {
    v.map_or("-".into(), |v| format!("{v:.2}"))
}

/// A row an hour, then day, twilight and night, the highest and the lowest Sun.
fn summary(rows: &[DayRow]) -> String {
    let head =
        ["UTC", "Sun deg", "Moon deg", "lit %", "median V", "16 %", "84 %", "Sun", "Earthshine", "Moon", "Lunar-E."];
    let line = |r: &DayRow| {
        let mut cells: Vec<String> = vec![
            r.date_mid.chars().take(16).collect(),
            format!("{:.1}", r.sun_alt_deg),
            format!("{:.1}", r.moon_alt_deg),
            format!("{:.0}", 100.0 * r.lit_frac),
        ];
        cells.extend([r.model_v_mag, r.model_v_p16_mag, r.model_v_p84_mag].map(cell));
        let too_faint = |name: &str| r.too_faint.split("; ").any(|light| light == name);
        let light = |(name, v): (&str, Option<f64>)| if too_faint(name) { "faint".into() } else { cell(v) };
        cells.extend(
            [
                ("sun", r.sun_v_mag),
                ("earthshine", r.earthshine_v_mag),
                ("moon", r.moon_v_mag),
                ("lunar_earthshine", r.lunar_earthshine_v_mag),
            ]
            .map(light),
        );
        cells
    };
    let mut last_h = f64::NEG_INFINITY;
    let hourly = rows.iter().filter(|r| {
        let due = (r.mjd_mid_d - last_h) * 24.0 > 0.999;
        if due {
            last_h = r.mjd_mid_d;
        }
        due
    });
    let mut text = text_table(&head, &hourly.map(line).collect::<Vec<_>>());
    text.push('\n');
    text.push_str(&parts(rows));
    text
}

/// Day, twilight and night: the median of the moments' medians and of their 16 and 84 %.
fn parts(rows: &[DayRow]) -> String {
    let highest = rows.iter().max_by(|a, b| a.sun_alt_deg.total_cmp(&b.sun_alt_deg));
    let lowest = rows.iter().min_by(|a, b| a.sun_alt_deg.total_cmp(&b.sun_alt_deg));
    let between = |low: f64, high: f64| -> Vec<&DayRow> {
        rows.iter().filter(|r| r.sun_alt_deg > low && r.sun_alt_deg <= high).collect()
    };
    let line = |name: &str, part: &[&DayRow]| {
        let median = |of: fn(&DayRow) -> Option<f64>| {
            let mut values: Vec<f64> = part.iter().filter_map(|r| of(r)).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        let lit = part.iter().filter(|r| r.model_v_mag.is_some()).count();
        vec![
            name.to_string(),
            part.len().to_string(),
            lit.to_string(),
            cell(median(|r| r.model_v_mag)),
            cell(median(|r| r.model_v_p16_mag)),
            cell(median(|r| r.model_v_p84_mag)),
            cell(median(|r| r.mu_mean_mag_arcsec2)),
        ]
    };
    let lines = [
        line("day, Sun above 0 deg", &between(0.0, 90.0)),
        line("highest Sun", &highest.into_iter().collect::<Vec<_>>()),
        line("twilight, Sun -18 to 0", &between(-18.0, 0.0)),
        line("night, Sun below -18", &between(-90.1, -18.0)),
        line("lowest Sun", &lowest.into_iter().collect::<Vec<_>>()),
    ];
    text_table(&["medians over", "moments", "lit", "median V", "16 %", "84 %", "mag/arcsec2"], &lines)
}

/// Each observed pass next to the model.
fn passes_text(passes: &[ObservedPass]) -> String {
    let lines: Vec<Vec<String>> = passes
        .iter()
        .map(|p| {
            let r = &p.row;
            vec![
                r.object_name.clone(),
                r.date_mid.chars().take(16).collect(),
                if p.moved_d == 0.0 { String::new() } else { format!("{:+.0}", p.moved_d) },
                r.n.to_string(),
                cell(Some(r.v_mag)),
                cell(r.model_v_mag),
                cell(r.model_v_p16_mag),
                cell(r.model_v_p84_mag),
                r.within.clone(),
            ]
        })
        .collect();
    text_table(&["observed pass", "UTC", "moved d", "n", "median V", "model", "16 %", "84 %", "within"], &lines)
}
