//! `satphot predict compliance`: how much of sky and time a satellite is brighter than a limit, where, and what would mend it.

use std::path::{Path, PathBuf};

use clap::Args;
use hifitime::Epoch;
use satphot::bands::Band;
use satphot::base::threads::with_threads;
use satphot::base::time::{iso_utc, parse_date, seconds_between, shifted};
use satphot::brightness::{ModelSettings, Satellite, ToleranceOf};
use satphot::config::{self, Config};
use satphot::orbit::{EarthOrientation, Site};
use satphot::report::page::{CompliancePage, write_compliance_page};
use satphot::report::summary::text_table;
use satphot::tables::row_passes::passes;
use satphot::tables::words::Status;
use satphot::tables::{ComplianceRow, MetaValue, PhotometryRow, WorstRow, csv_text, write_rows};
use satphot::visibility::compliance::{
    BrightnessLimit, LIT_TO_V_MAG, Magnitude, Sample, Survey, judged, observed_row, sample, satcon1_v_mag,
    survey_v_mag, variants,
};
use satphot::visibility::duty_cycle::dark_spans;
use satphot::visibility::forecast::month::nights;
use satphot::visibility::forecast::prediction_meta;
use satphot::visibility::observation_table::{Magnitudes, Request, magnitude_rows};
use satphot::visibility::survey;

use super::super::orbit_args::{bad, configuration, tell_unknown_ut1};
use super::super::zeropoint::column;
use super::super::{bar::Bars, print, signals, tell, threads};
use super::dome_args::{SamplingArgs, checked_height};
use super::{ModelArgs, OutArgs};

/// The satellite as the catalogue has it, among the variants.
const LISTED: &str = "as listed";

const AFTER_HELP: &str = "\
The satellite is put at its height into directions of equal solid angle above --min-alt, at moments of the dark part of each night
(--sun-alt-deg), at each site. Counted is how much of that sky and time it is brighter than each limit: V 7 + 2.5 lg(h/550 km)
above 550 km, 7 below (SATCON1); V 6, what the eye sees; the trail that a survey just detects (--survey); and any --limit. With
an inclination, directions in which no satellite of that orbit passes are not counted.

Where the model was compared with observations, the interval is what remains if all magnitudes are off by the error of a prediction
the same way, and the expected share is what remains if each is off by itself. With --observed, the same verdict is given from the
magnitudes of a table, its limits included (Kaplan and Meier; interval by passes).

--mend computes the same for the satellite with one thing changed at a time: half the area of a surface, a diffuse law, another
attitude.

Examples:
  satphot predict compliance --satellite starlink-v2 --lat-deg 30 --date 2025-06-21
  satphot predict compliance --satellite own --satellites own.toml --height-km 600 --inclination-deg 53 \\
      --lat-deg 0,30,-35,50 --date 2025-03-20,2025-06-21,2025-12-21 --survey rubin --mend -o compliance
  satphot predict compliance --satellite starlink-v2-mini-phase --site -33.77,151.11,70 --date 2025-06-21 \\
      --observed score.csv";

/// Reports how much of sky and time a satellite is brighter than the limits of rules, eye and surveys.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Compliance {
    /// Configuration with [model]; pipeline.toml where the arguments leave something open
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    #[command(flatten)]
    model: ModelArgs,
    /// Sites: latitude, longitude [deg], height [m] (repeatable) [default: the configuration's]
    #[arg(long, value_name = "LAT,LON,ALT", allow_hyphen_values = true)]
    site: Vec<String>,
    /// Latitudes at longitude 0 and sea level instead [deg]
    #[arg(long, value_name = "DEG,...", value_delimiter = ',', allow_hyphen_values = true, conflicts_with = "site")]
    lat_deg: Vec<f64>,
    /// Nights: local dates of their evenings
    #[arg(long, value_name = "YYYY-MM-DD,...", value_delimiter = ',', required = true)]
    date: Vec<String>,
    /// Height of the orbits [km]; the catalogue's where it has one
    #[arg(long, value_name = "KM", allow_hyphen_values = true)]
    height_km: Option<f64>,
    /// Inclination of the orbits [deg] [default: directions count wherever orbits run]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    inclination_deg: Option<f64>,
    /// Smallest altitude [deg]
    #[arg(long, value_name = "DEG", default_value_t = 30.0, allow_hyphen_values = true)]
    min_alt: f64,
    /// Altitude of the Sun below which it is dark [deg]
    #[arg(long, value_name = "DEG", default_value_t = -12.0, allow_hyphen_values = true)]
    sun_alt_deg: f64,
    /// Further limits, e.g. 6.5 or telescope=9
    #[arg(long, value_name = "[NAME=]MAG,...", value_delimiter = ',', allow_hyphen_values = true)]
    limit: Vec<String>,
    /// Surveys whose trail limit counts: rubin, decam, ...
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    survey: Vec<String>,
    /// Band of the surveys
    #[arg(long, value_name = "BAND", default_value = "g")]
    survey_band: String,
    /// Number of directions of the whole sky
    #[arg(long, value_name = "N", default_value_t = 300)]
    points: usize,
    #[command(flatten)]
    sampling: SamplingArgs,
    /// Between the moments [min]
    #[arg(long, value_name = "MIN", default_value_t = 15.0, allow_hyphen_values = true)]
    step_min: f64,
    /// Compute what one change at a time would mend
    #[arg(long)]
    mend: bool,
    /// Table of observed apparent magnitudes, for the same verdict: SCORE, MMT-9, own, photometry.ecsv
    #[arg(long, value_name = "TABLE")]
    observed: Option<PathBuf>,
    /// What a column of that table is, e.g. --column v_mag=Mag (repeatable)
    #[arg(long = "column", value_name = "KEY=NAME", value_parser = column, requires = "observed")]
    columns: Vec<(String, String)>,
    /// Print comma-separated values instead of a summary
    #[arg(long)]
    csv: bool,
    /// Folder for tables and page, or a file: .ecsv is the table, .html the page (repeatable)
    #[arg(short, long, value_name = "DIR|FILE")]
    out: Vec<PathBuf>,
    /// Number of threads; 0 = all cores. The result does not depend on it
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    jobs: usize,
    /// Print no progress bar and no notes
    #[arg(short, long)]
    quiet: bool,
}

/// Height and inclination of the orbits.
struct Orbit {
    height_km: f64,
    inclination_deg: Option<f64>,
}

impl Compliance {
    pub fn execute(self) -> anyhow::Result<()> {
        self.check()?;
        let no_site = (self.site.is_empty() && self.lat_deg.is_empty()).then_some("--site");
        let missing: Vec<&str> = self.model.missing().into_iter().chain(no_site).collect();
        let config = configuration(self.config.as_deref(), &self.sets, &missing)?;
        let mut model = self.model.over(config.as_ref(), &self.sets)?;
        if self.model.tolerance.is_none() && config.is_none() {
            model.tolerance = 1e-2;
        }
        self.sampling.over(&mut model);
        let satellite = Satellite::from_config(&model)?;
        let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::try_from(&model)? };
        let orbit = self.orbit(&model)?;
        let limits = self.limits(&satellite, &orbit)?;
        let points = self.sampling.points(self.points, &model)?;
        let looked = Survey {
            nights: self.nights(config.as_ref())?,
            points: &points,
            min_alt_rad: self.min_alt.to_radians(),
            height_km: orbit.height_km,
            inclination_rad: orbit.inclination_deg.map(f64::to_radians),
        };
        let bar = Bars::new(!self.quiet);
        let of = |satellite: &Satellite| with_threads(self.jobs, || sample(satellite, &settings, &looked, &bar));
        let listed = of(&satellite)??;
        if listed.n() == 0 {
            let problem =
                "no direction above --min-alt is passed over by orbits of that inclination, or no moment is dark";
            return Err(bad("--date", problem.into()));
        }
        let mut rows: Vec<ComplianceRow> = limits.iter().map(|l| judged(&listed, l, LISTED)).collect();
        if self.mend {
            for (variant, changed) in variants(&satellite) {
                let seen = of(&changed)??;
                rows.extend(limits.iter().map(|l| judged(&seen, l, &variant)));
            }
        }
        if let Some(table) = &self.observed {
            let magnitudes = self.magnitudes(table, &satellite, &settings)?;
            rows.extend(limits.iter().map(|l| observed_row(&magnitudes, l)));
        }
        let worst = worst(&looked, &listed, &limits);
        self.tell(&model, &orbit, &satellite, (&rows, &worst), &listed)
    }

    fn check(&self) -> anyhow::Result<()> {
        let within = |key: &str, value: f64, low: f64, high: f64| match (low..=high).contains(&value) {
            true => Ok(()),
            false => Err(bad(key, format!("{value} is outside {low} to {high}"))),
        };
        within("--min-alt", self.min_alt, 0.0, 89.0)?;
        within("--sun-alt-deg", self.sun_alt_deg, -90.0, 0.0)?;
        within("--step-min", self.step_min, 0.1, 600.0)?;
        within("--inclination-deg", self.inclination_deg.unwrap_or_default(), 0.0, 180.0)?;
        self.lat_deg.iter().try_for_each(|lat| within("--lat-deg", *lat, -90.0, 90.0))
    }

    /// The height that is given, else that of the catalogue's first shell; the inclination only where it is given.
    fn orbit(&self, model: &config::Model) -> anyhow::Result<Orbit> {
        let height_km = match self.height_km {
            Some(height_km) => checked_height(height_km)?,
            None => super::dome_args::height_km(None, model)?,
        };
        Ok(Orbit { height_km, inclination_deg: self.inclination_deg })
    }

    fn limits(&self, satellite: &Satellite, orbit: &Orbit) -> anyhow::Result<Vec<BrightnessLimit>> {
        let mut limits = vec![
            BrightnessLimit { name: "SATCON1".into(), v_mag: satcon1_v_mag(orbit.height_km) },
            BrightnessLimit { name: "eye".into(), v_mag: 6.0 },
        ];
        let area_m2: f64 = satellite.surfaces.iter().map(|s| s.area_m2).sum();
        for name in &self.survey {
            let survey = survey::Survey::named(name)?;
            // without surfaces the size is not known, and does not matter: a trail is as wide as the seeing
            let v_mag = survey_v_mag(&survey, &self.survey_band, orbit.height_km, area_m2.max(1.0))?;
            limits
                .push(BrightnessLimit { name: format!("{} {}, 5 sigma trail", survey.title, self.survey_band), v_mag });
        }
        for text in &self.limit {
            let (name, number) = text.split_once('=').unwrap_or((text, text));
            match number.trim().parse::<f64>() {
                Ok(v_mag) if (-30.0..=40.0).contains(&v_mag) => {
                    limits.push(BrightnessLimit { name: name.trim().to_owned(), v_mag });
                }
                _ => return Err(bad("--limit", format!("\"{text}\" is not a magnitude, such as 6.5 or telescope=9"))),
            }
        }
        Ok(limits)
    }

    /// Every site on every date, with its dark moments.
    fn nights(&self, config: Option<&Config>) -> anyhow::Result<Vec<(Site, Vec<Epoch>)>> {
        let mut sites = Vec::new();
        for text in &self.site {
            let numbers: Vec<f64> = text.split(',').filter_map(|n| n.trim().parse().ok()).collect();
            let [lat, lon, alt] = numbers[..] else {
                let problem = format!("\"{text}\" is not latitude,longitude,altitude, such as -33.77,151.11,70");
                return Err(bad("--site", problem));
            };
            sites.push(Site::new(lat, lon, alt)?);
        }
        for lat in &self.lat_deg {
            sites.push(Site::new(*lat, 0.0, 0.0)?);
        }
        if let Some(config) = config.filter(|_| sites.is_empty()) {
            sites.push(Site::from_config(&config.site)?);
        }
        let eop = EarthOrientation::default();
        let mut all = Vec::new();
        for date in &self.date {
            let date = parse_date("--date", date)?;
            for site in &sites {
                let night = nights(date, 1, site.lon_rad().to_degrees() / 15.0)?;
                let Some(night) = night.first() else { continue };
                if all.is_empty() {
                    tell_unknown_ut1(&night.midnight, self.quiet);
                }
                let noon = shifted(night.midnight, -43_200.0);
                let dark = dark_spans(site, &eop, &noon, 1.0, self.sun_alt_deg.to_radians())?;
                if dark.is_empty() && !self.quiet {
                    let (lat, label) = (site.lat_rad().to_degrees(), &night.label);
                    tell(&format!("note: no moment is dark at latitude {lat:.1} in the night of {label}"));
                }
                let step_s = 60.0 * self.step_min;
                let moments = |[from, to]: &[Epoch; 2]| {
                    // in the middles of equal parts, so that each stands for as much time
                    let n = (seconds_between(*from, *to) / step_s).ceil().max(1.0) as usize;
                    let part_s = seconds_between(*from, *to) / n as f64;
                    (0..n).map(|k| shifted(*from, (k as f64 + 0.5) * part_s)).collect::<Vec<_>>()
                };
                all.push((site.clone(), dark.iter().flat_map(moments).collect()));
            }
        }
        Ok(all)
    }

    /// The magnitudes of the table, with their passes.
    fn magnitudes(
        &self,
        table: &Path,
        satellite: &Satellite,
        settings: &ModelSettings,
    ) -> anyhow::Result<Vec<Magnitude>> {
        let request = Request {
            table,
            columns: self.columns.iter().cloned().collect(),
            orbit: None,
            site: None,
            site_replaces: false,
            satellite,
            settings,
            track_az_rad: std::f64::consts::FRAC_PI_2,
            magnitudes: Some(Magnitudes { band: Band::V, reduced_to_km: None }),
            stop: &signals::stop(),
        };
        let (rows, notes) = magnitude_rows(&request)?;
        let magnitude = |row: &PhotometryRow| match (row.v_mag, row.limit_v_mag) {
            (Some(v_mag), _) if row.status == Status::Ok => Some((v_mag, false)),
            (None, Some(limit)) if row.status == Status::Nondetection => Some((limit, true)),
            _ => None,
        };
        let mut found = Vec::new();
        for (pass, members) in passes(&rows).iter().enumerate() {
            let of = |row: &&PhotometryRow| magnitude(row).map(|(v_mag, is_limit)| Magnitude { v_mag, is_limit, pass });
            found.extend(members.iter().filter_map(of));
        }
        // without a time every row is a pass of its own
        let timeless = rows.iter().filter(|r| r.mjd_mid_d.is_none()).filter_map(magnitude);
        let first = found.len();
        found.extend(timeless.enumerate().map(|(k, (v_mag, is_limit))| Magnitude { v_mag, is_limit, pass: first + k }));
        let unused = rows.iter().filter(|r| magnitude(r).is_none());
        if !self.quiet {
            notes.iter().for_each(|note| tell(&format!("note: {note}")));
            if let Some(row) = unused.clone().next() {
                let (n, all) = (unused.count(), rows.len());
                tell(&format!(
                    "note: {n} of {all} rows of {} are not used, the first: {}",
                    table.display(),
                    row.reason
                ));
            }
        }
        if found.is_empty() {
            return Err(bad("--observed", format!("{} has no usable magnitude and no limit", table.display())));
        }
        Ok(found)
    }

    fn tell(
        &self,
        model: &config::Model,
        orbit: &Orbit,
        satellite: &Satellite,
        (rows, worst): (&[ComplianceRow], &[WorstRow]),
        listed: &Sample,
    ) -> anyhow::Result<()> {
        let mut meta = prediction_meta("satphot.compliance/1", model, None);
        meta.push("height_km", orbit.height_km);
        if let Some(inclination_deg) = orbit.inclination_deg {
            meta.push("inclination_deg", inclination_deg);
        }
        let used = [("min_alt_deg", self.min_alt), ("sun_alt_deg", self.sun_alt_deg), ("step_min", self.step_min)];
        used.into_iter().for_each(|(key, value)| meta.push(key, value));
        meta.push("directions", self.sampling.text(self.points, model));
        meta.push("nights", MetaValue::Text(self.date.join(", ")));
        if self.csv {
            print(&csv_text(rows)?);
        } else {
            print(&text(rows, worst, satellite, orbit));
        }
        let (tables, pages) = OutArgs { out: self.out.clone() }.files_of("compliance", &["html"])?;
        let mut written = Vec::new();
        for table in &tables {
            write_rows(table, rows, &meta)?;
            let stem = table.file_stem().unwrap_or_default().to_string_lossy();
            let of_nights = table.with_file_name(format!("{stem}_worst.ecsv"));
            write_rows(&of_nights, worst, &meta)?;
            written.extend([table.clone(), of_nights]);
        }
        let v_mag = listed.lit_v_mag();
        // a folder gets the page where others get a figure
        for page in pages.iter().map(|page| page.with_extension("html")) {
            let mut facts: Vec<(String, String)> = vec![
                ("satellite".into(), satellite.name.clone()),
                ("model".into(), satellite.source.clone()),
                ("observations".into(), satellite.standing.text()),
                ("height".into(), format!("{} km", orbit.height_km)),
                ("sky".into(), format!("above {} deg, {}", self.min_alt, self.sampling.text(self.points, model))),
                ("dark".into(), format!("Sun below {} deg, every {} min", self.sun_alt_deg, self.step_min)),
                ("nights".into(), self.date.join(", ")),
            ];
            if let Some(inclination_deg) = orbit.inclination_deg {
                facts.push(("inclination".into(), format!("{inclination_deg} deg")));
            }
            let page_of = CompliancePage {
                title: format!("{} at {:.0} km against brightness limits", satellite.name, orbit.height_km),
                subtitle: format!("{} nights and sites", worst.len()),
                rows,
                worst,
                v_mag: &v_mag,
                listed: LISTED,
                used: facts,
            };
            write_compliance_page(&page, &page_of)?;
            written.push(page);
        }
        for file in written.iter().filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }
}

/// The brightest of each night.
fn worst(looked: &Survey, listed: &Sample, limits: &[BrightnessLimit]) -> Vec<WorstRow> {
    let first = limits.first().map_or(f64::NEG_INFINITY, |l| l.v_mag);
    let of = |(night, (site, _)): (usize, &(Site, Vec<Epoch>))| {
        let n = listed.n_of_night.get(night).copied().filter(|n| *n > 0)?;
        let lit = || listed.lit.iter().filter(|l| l.night == night);
        let brightest = lit().reduce(|a, b| if b.v_mag < a.v_mag { b } else { a });
        let share = |count: usize| count as f64 / n as f64;
        let sep_deg = |az: f64, sun: f64| ((az - sun).to_degrees() + 180.0).rem_euclid(360.0) - 180.0;
        Some(WorstRow {
            lat_deg: site.lat_rad().to_degrees(),
            lon_deg: site.lon_rad().to_degrees(),
            date_mid: brightest.map(|l| iso_utc(l.epoch, 0)).unwrap_or_default(),
            alt_deg: brightest.map(|l| l.alt_rad.to_degrees()),
            az_deg: brightest.map(|l| l.az_rad.to_degrees()),
            model_v_mag: brightest.map(|l| l.v_mag),
            v_pred_err_mag: brightest.and_then(|l| l.pred_err_mag),
            illum: brightest.map(|l| l.illum.to_string()).unwrap_or_default(),
            sun_alt_deg: brightest.map_or(f64::NAN, |l| l.sun_alt_rad.to_degrees()),
            sun_az_sep_deg: brightest.map(|l| sep_deg(l.az_rad, l.sun_az_rad).abs()),
            lit_frac: share(lit().filter(|l| l.v_mag < LIT_TO_V_MAG).count()),
            brighter_frac: Some(share(lit().filter(|l| l.v_mag < first).count())),
        })
    };
    looked.nights.iter().enumerate().filter_map(of).collect()
}

const HEADER: [&str; 11] =
    ["of", "variant", "limit", "V", "brighter %", "from", "to", "expected", "5 % above V", "brightest", "margin"];

fn text(rows: &[ComplianceRow], worst: &[WorstRow], satellite: &Satellite, orbit: &Orbit) -> String {
    let fixed = |value: Option<f64>| value.map(|v| format!("{v:.2}")).unwrap_or_default();
    let percent = |share: Option<f64>| fixed(share.map(|s| 100.0 * s));
    let line = |r: &ComplianceRow| {
        vec![
            r.of.clone(),
            r.variant.clone(),
            r.rule.clone(),
            format!("{:.2}", r.limit_v_mag),
            percent(r.brighter_frac),
            percent(r.brighter_p16_frac),
            percent(r.brighter_p84_frac),
            percent(r.expected_frac),
            fixed(r.v_p05_mag),
            fixed(r.brightest_v_mag),
            fixed(r.margin_mag),
        ]
    };
    let mut text = format!("{} at {} km: share of sky and time brighter than\n", satellite.name, orbit.height_km);
    text += &text_table(&HEADER, &rows.iter().map(line).collect::<Vec<_>>());
    if let Some(w) = worst
        .iter()
        .filter(|w| w.model_v_mag.is_some())
        .min_by(|a, b| a.model_v_mag.unwrap_or(f64::INFINITY).total_cmp(&b.model_v_mag.unwrap_or(f64::INFINITY)))
    {
        text += &format!(
            "worst: V {} at {} from latitude {:.1}, altitude {:.0}, {:.0} deg from the Sun's azimuth, Sun at {:.1} deg\n",
            fixed(w.model_v_mag),
            w.date_mid,
            w.lat_deg,
            w.alt_deg.unwrap_or(f64::NAN),
            w.sun_az_sep_deg.unwrap_or(f64::NAN),
            w.sun_alt_deg
        );
    }
    text + &satellite.standing_line()
}
