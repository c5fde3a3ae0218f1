//! `satphot plan-night`: which satellites to observe in a night, when, how bright they will be and with which exposure.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use hifitime::Epoch;
use satphot::base::threads::with_threads;
use satphot::base::time::{iso_utc, mjd_utc, parse_date, shifted};
use satphot::brightness::{Catalogue, Model, ModelSettings, Satellite, ToleranceOf};
use satphot::config::{self, Config};
use satphot::orbit::{EarthOrientation, Elements, Site, Tracker, read_elements_file};
use satphot::pipeline::groups::model_of;
use satphot::pipeline::groups::objects::Object;
use satphot::report::page::{PlanPage, write_plan_page};
use satphot::report::summary::text_table;
use satphot::tables::words::PlanStatus;
use satphot::tables::{Meta, MetaValue, PlanRow, csv_text, write_rows};
use satphot::visibility::duty_cycle::dark_spans;
use satphot::visibility::forecast::month::nights;
use satphot::visibility::night_plan::{Candidate, LocalHorizon, NamedModel, PlanSettings, plan};
use satphot::visibility::sky_brightness::{DARK_V_MAG_ARCSEC2, K_V_MAG_AIRMASS};
use satphot::visibility::telescope::preset;

use super::limits::tracked::instrument::{Instrument, PRESET, TelescopeArgs};
use super::orbit_args::{OrbitArgs, bad, of_argument, tell_unknown_ut1};
use super::predict::{OutArgs, tolerance};
use super::{bar::Bars, print, tell, threads};

/// Brightest twilight: the sky is not modelled with the Sun above this \[deg\].
const BRIGHTEST_SUN_ALT_DEG: f64 = -6.0;
/// Twilight is over in every band.
const NIGHT_DEG: f64 = -18.0;

const AFTER_HELP: &str = "\
A night is named by the local date of its evening and lasts from noon to noon of the site's mean time; what is planned is its dark
part (--sun-alt-deg). Every pass above --min-alt is looked at every --step-s: the model of its satellite gives the magnitude by
Sunlight, Earthshine, Moonlight and Lunar-Earthshine, the exposure calculator of `satphot limits tracked` the signal-to-noise
ratio of one exposure under the sky of that place and moment. Observable is what reaches --snr, far enough from the Moon, slow
enough for the mount; the rank is by the best signal-to-noise ratio. Whoever comes first in rank is scheduled first; passes that
overlap it, the time to slew included, are named as conflicts.

A satellite gets the model that --model names, else that of the configuration, else the entry of the catalogue that lists it
(`satphot satellites`). Where several designs list it, as all generations of Starlink do, or none, it has no magnitude and no rank
until --model says which it is. An exposure that would saturate is shortened. The zeropoint is computed from the optics unless
--zp-mag gives the measured one.

Examples:
  satphot plan-night --elements iss.tle --site -33.77,151.11,70 --date 2025-06-10
  satphot plan-night -c pipeline.toml --elements active.json --object 'STARLINK-3*,ISS*' --date 2025-06-10 \\
      --model 'STARLINK*=starlink-v2-mini-phase' -o plan
  satphot plan-night --elements active.tle --site 28.3,-16.5,2390 --date 2025-06-10 --min-alt 30 --snr 50 \\
      --zp-mag 22.4 --order time --top 100";

/// Plans a night: which satellites can be observed when, how bright, with which exposure, ranked and scheduled.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct PlanNight {
    #[command(flatten)]
    orbit: OrbitArgs,
    /// Night: local date of its evening
    #[arg(long, value_name = "YYYY-MM-DD")]
    date: String,
    /// Satellites of the elements: names, catalogue numbers or designators, `*` for any text [default: all of them]
    #[arg(long, value_name = "OBJECT,...", value_delimiter = ',')]
    object: Vec<String>,
    /// Own satellites, in the form of `satphot satellites NAME --toml` (model.satellites)
    #[arg(long, value_name = "FILE")]
    satellites: Option<PathBuf>,
    /// Models of satellites, e.g. 'STARLINK*=starlink-v2,44713=starlink-v1.0'; the first that fits is used
    #[arg(long, value_name = "OBJECT=MODEL,...", value_delimiter = ',', value_parser = rule)]
    model: Vec<Rule>,
    /// Relative tolerance of the modelled flux
    #[arg(long, value_name = "T", default_value_t = 1e-2, value_parser = tolerance)]
    tolerance: f64,
    /// Smallest altitude of a target [deg]
    #[arg(long, value_name = "DEG", default_value_t = 20.0, allow_hyphen_values = true)]
    min_alt: f64,
    /// Local horizon: azimuth (from north through east) and altitude of what hides the sky, interpolated between [deg]
    #[arg(long, value_name = "AZ=ALT,...", value_delimiter = ',', value_parser = horizon_point, allow_hyphen_values = true)]
    horizon: Vec<[f64; 2]>,
    /// Altitude of the Sun below which it is dark [deg], -6 or below [default: -6; in bands but V -18]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    sun_alt_deg: Option<f64>,
    /// Smallest distance from a Moon that is up [deg]
    #[arg(long, value_name = "DEG", default_value_t = 20.0, allow_hyphen_values = true)]
    moon_sep_deg: f64,
    /// Fastest that the mount follows against the stars [deg/s]
    #[arg(long, value_name = "RATE", default_value_t = 5.0, allow_hyphen_values = true)]
    max_rate_deg_s: f64,
    /// One exposure [s]; shortened where it would saturate
    #[arg(long, value_name = "S", default_value_t = 1.0, allow_hyphen_values = true)]
    exptime_s: f64,
    /// Shortest exposure of the camera [s]
    #[arg(long, value_name = "S", default_value_t = 1e-3, allow_hyphen_values = true)]
    min_exptime_s: f64,
    /// Signal-to-noise ratio of one exposure from which on a target is observable
    #[arg(long, value_name = "K", default_value_t = 10.0, allow_hyphen_values = true)]
    snr: f64,
    /// Time from one target to the next [s]
    #[arg(long, value_name = "S", default_value_t = 60.0, allow_hyphen_values = true)]
    slew_s: f64,
    /// Longest time given to one pass [min]
    #[arg(long, value_name = "MIN", default_value_t = 10.0, allow_hyphen_values = true)]
    longest_min: f64,
    /// Between the moments of a pass that are looked at [s]
    #[arg(long, value_name = "S", default_value_t = 30.0, allow_hyphen_values = true)]
    step_s: f64,
    /// Dark sky without Moon and twilight [V mag/arcsec2]
    #[arg(long, value_name = "MAG", default_value_t = DARK_V_MAG_ARCSEC2, allow_hyphen_values = true)]
    dark_sky_mag: f64,
    /// Extinction [mag/airmass] [default: model.k_mag_airmass, else 0.172]
    #[arg(long, value_name = "K", allow_hyphen_values = true)]
    k_mag_airmass: Option<f64>,
    #[command(flatten)]
    telescope: TelescopeArgs,
    /// Order of the printed rows
    #[arg(long, value_enum, default_value_t = Order::Rank)]
    order: Order,
    /// Number of printed rows; the table has all of them
    #[arg(long, value_name = "N", default_value_t = 30)]
    top: usize,
    /// Print all rows as comma-separated values instead
    #[arg(long)]
    csv: bool,
    /// Folder for table and page, or a file: .ecsv is the table, .html the page (repeatable)
    #[arg(short, long, value_name = "DIR|FILE")]
    out: Vec<PathBuf>,
    /// Number of threads; 0 = all cores. The result does not depend on it
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    jobs: usize,
    /// Print no progress bar and no notes
    #[arg(short, long)]
    quiet: bool,
}

/// Which model the satellites of a name have.
#[derive(Debug, Clone)]
struct Rule {
    object: String,
    model: String,
}

fn rule(text: &str) -> Result<Rule, String> {
    match text.split_once('=').map(|(object, model)| (object.trim(), model.trim())) {
        Some((object, model)) if !object.is_empty() && !model.is_empty() => {
            Ok(Rule { object: object.to_owned(), model: model.to_owned() })
        }
        _ => Err("is not OBJECT=MODEL, such as STARLINK*=starlink-v2".into()),
    }
}

fn horizon_point(text: &str) -> Result<[f64; 2], String> {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let point = text.split_once('=').and_then(|(az, alt)| Some([number(az)?, number(alt)?]));
    point.ok_or_else(|| "is not AZ=ALT in degrees, such as 90=25".into())
}

/// The order of printed rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Order {
    /// The best first
    Rank,
    /// The first first
    Time,
}

/// The night itself.
struct Dark {
    label: String,
    spans: Vec<[Epoch; 2]>,
    sun_alt_deg: f64,
}

impl PlanNight {
    pub fn execute(self) -> anyhow::Result<()> {
        self.check()?;
        let config = self.orbit.configuration(self.orbit.missing()?)?;
        if config.is_none() && !self.orbit.sets.is_empty() {
            return Err(bad("--set", "has no effect: --elements and --site replace the configuration".into()));
        }
        let (orbit, place) = self.orbit.orbit_and_site(config.as_ref())?;
        let site = Site::from_config(&place)?;
        let eop = EarthOrientation::from_config(&orbit);
        let instrument = match &config {
            Some(config) => self.telescope.instrument(config, "configuration")?,
            None => self.telescope.instrument(&preset(&[])?, PRESET)?,
        };
        let dark = self.dark(&site, &place, &eop, &instrument)?;
        let settings = self.settings(&instrument, config.as_ref())?;
        let (candidates, models) = self.candidates(&orbit, &site, config.as_ref(), &instrument)?;
        let bar = Bars::new(!self.quiet);
        let rows = with_threads(self.jobs, || plan(&candidates, &models.built, &dark.spans, &eop, &settings, &bar))??;

        let meta = self.meta(&place, &dark, &instrument, &settings, config.as_ref());
        if self.csv {
            print(&csv_text(&rows)?);
        } else {
            print(&self.text(&rows, &dark));
            models.standings.iter().for_each(|line| print(line));
        }
        self.notes(&rows, &instrument);
        let (tables, pages) = OutArgs { out: self.out.clone() }.files_of("plan_night", &["html"])?;
        tables.iter().try_for_each(|table| write_rows(table, &rows, &meta))?;
        // a folder gets the page where others get a figure
        let pages: Vec<PathBuf> = pages.iter().map(|page| page.with_extension("html")).collect();
        for page in &pages {
            write_plan_page(page, &self.page(&rows, &dark, &instrument, &settings, &place))?;
        }
        for file in tables.iter().chain(&pages).filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }

    fn check(&self) -> anyhow::Result<()> {
        let within = |key: &str, value: f64, low: f64, high: f64| match (low..=high).contains(&value) {
            true => Ok(()),
            false => Err(bad(key, format!("{value} is outside {low} to {high}"))),
        };
        within("--min-alt", self.min_alt, 0.0, 89.0)?;
        within("--sun-alt-deg", self.sun_alt_deg.unwrap_or(NIGHT_DEG), -90.0, BRIGHTEST_SUN_ALT_DEG)?;
        within("--moon-sep-deg", self.moon_sep_deg, 0.0, 180.0)?;
        within("--max-rate-deg-s", self.max_rate_deg_s, 1e-6, 1000.0)?;
        within("--min-exptime-s", self.min_exptime_s, 1e-6, 1e5)?;
        within("--exptime-s", self.exptime_s, self.min_exptime_s, 1e5)?;
        within("--snr", self.snr, 1e-3, 1e6)?;
        within("--slew-s", self.slew_s, 0.0, 86_400.0)?;
        within("--longest-min", self.longest_min, 0.1, 1440.0)?;
        within("--step-s", self.step_s, 1.0, 3600.0)?;
        within("--dark-sky-mag", self.dark_sky_mag, 10.0, 30.0)?;
        within("--k-mag-airmass", self.k_mag_airmass.unwrap_or_default(), 0.0, 3.0)
    }

    /// The dark spans of the night.
    fn dark(
        &self,
        site: &Site,
        place: &config::Site,
        eop: &EarthOrientation,
        instrument: &Instrument,
    ) -> anyhow::Result<Dark> {
        let in_v = instrument.sky_band == "V";
        let sun_alt_deg = self.sun_alt_deg.unwrap_or(if in_v { BRIGHTEST_SUN_ALT_DEG } else { NIGHT_DEG });
        if !in_v && sun_alt_deg > NIGHT_DEG {
            let problem = format!("twilight is known in V only, not in {}; accepted is -18", instrument.sky_band);
            return Err(bad("--sun-alt-deg", problem));
        }
        let lon_deg = (place.lon_deg + 180.0).rem_euclid(360.0) - 180.0;
        let night = nights(parse_date("--date", &self.date)?, 1, lon_deg / 15.0)?;
        let Some(night) = night.into_iter().next() else { return Err(bad("--date", "is no night".into())) };
        tell_unknown_ut1(&night.midnight, self.quiet);
        let noon = shifted(night.midnight, -43_200.0);
        let spans = dark_spans(site, eop, &noon, 1.0, sun_alt_deg.to_radians())?;
        if spans.is_empty() {
            let problem = format!(
                "the Sun stays above {sun_alt_deg} deg from {} to {} at this site: no moment is dark",
                iso_utc(noon, 0),
                iso_utc(shifted(noon, 86_400.0), 0)
            );
            return Err(bad("--date", problem));
        }
        Ok(Dark { label: night.label, spans, sun_alt_deg })
    }

    fn settings(&self, instrument: &Instrument, config: Option<&Config>) -> anyhow::Result<PlanSettings> {
        let of_config = config.and_then(|c| c.model.as_ref()?.k_mag_airmass);
        Ok(PlanSettings {
            calculator: instrument.calculator,
            sky_band: instrument.sky_band.clone(),
            dark_sky_mag_arcsec2: self.dark_sky_mag,
            k_mag_airmass: self.k_mag_airmass.or(of_config).unwrap_or(K_V_MAG_AIRMASS),
            min_alt_rad: self.min_alt.to_radians(),
            horizon: LocalHorizon::from_degrees(&self.horizon)?,
            moon_sep_rad: self.moon_sep_deg.to_radians(),
            max_rate_rad_s: self.max_rate_deg_s.to_radians(),
            exptime_s: self.exptime_s,
            min_exptime_s: self.min_exptime_s,
            snr: self.snr,
            slew_s: self.slew_s,
            longest_s: 60.0 * self.longest_min,
            step_s: self.step_s,
        })
    }

    /// The local horizon, for the page and the table.
    fn horizon_text(&self) -> String {
        let points: Vec<String> = self.horizon.iter().map(|[az, alt]| format!("{az}={alt}")).collect();
        if points.is_empty() { String::new() } else { format!(" and the local horizon {}", points.join(", ")) }
    }

    /// The satellites of the elements, and the models they have.
    fn candidates<'a>(
        &'a self,
        orbit: &config::Orbit,
        site: &Site,
        config: Option<&'a Config>,
        instrument: &Instrument,
    ) -> anyhow::Result<(Vec<Candidate>, Models<'a>)> {
        let file = read_elements_file(&orbit.elements)?;
        if let Some(first) = file.damaged.first().filter(|_| !self.quiet) {
            let (n, name) = (file.damaged.len(), orbit.elements.display());
            tell(&format!("note: {name}: {n} damaged sets are not used, the first: {}", first.problem));
        }
        let mut by_number: BTreeMap<u64, Vec<Elements>> = BTreeMap::new();
        for set in file.sets {
            by_number.entry(set.norad_cat_id()).or_default().push(set);
        }
        let total = by_number.len();
        let eop = EarthOrientation::from_config(orbit);
        let mut models = Models::new(self, config, instrument)?;
        let mut candidates = Vec::new();
        let mut matched = vec![false; self.object.len()];
        for (number, sets) in by_number {
            let named = sets.iter().find(|s| !s.name().trim().is_empty()).or(sets.first());
            let object = Object {
                norad_cat_id: number,
                name: named.map(|s| s.name().trim().to_owned()).unwrap_or_default(),
                object_id: named.map(|s| s.object_id().trim().to_owned()).unwrap_or_default(),
            };
            if orbit.norad_cat_id.is_some_and(|wanted| wanted != number && self.orbit.norad.is_some()) {
                continue;
            }
            let mut wanted = self.object.is_empty();
            for (pattern, hit) in self.object.iter().zip(&mut matched) {
                let is_of = object.is_of(pattern);
                *hit |= is_of;
                wanted |= is_of;
            }
            if !wanted {
                continue;
            }
            let model = models.of(&object, orbit.norad_cat_id == Some(number))?;
            let tracker = Tracker::new(sets, None, site.clone(), eop)
                .map(|t| t.with_age_limit(orbit.max_age_d, orbit.force_age))
                .map_err(|e| e.to_string());
            candidates.push(Candidate {
                object_name: object.label(),
                norad_cat_id: number,
                object_id: object.object_id,
                tracker,
                model,
            });
        }
        if let Some((pattern, _)) = self.object.iter().zip(&matched).find(|(_, hit)| !**hit) {
            let problem = format!("\"{pattern}\" is none of the {total} objects of {}", orbit.elements.display());
            return Err(bad("--object", problem));
        }
        if candidates.is_empty() {
            let problem = format!("{} has no object to plan", orbit.elements.display());
            return Err(bad("--elements", problem));
        }
        Ok((candidates, models))
    }

    fn meta(
        &self,
        place: &config::Site,
        dark: &Dark,
        instrument: &Instrument,
        settings: &PlanSettings,
        config: Option<&Config>,
    ) -> Meta {
        let mut meta = Meta::default();
        meta.push("schema", "satphot.plan-night/1");
        meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
        meta.push("time_scale", "UTC");
        let fields = [("lat_deg", place.lat_deg), ("lon_deg", place.lon_deg), ("alt_m", place.alt_m)];
        meta.push("site", MetaValue::Map(fields.map(|(k, v)| (k.to_owned(), v.into())).to_vec()));
        meta.push("night", dark.label.as_str());
        meta.push("band", instrument.sky_band.as_str());
        meta.push("mag_system", instrument.mag_system);
        if let Some(mode) = config.and_then(|c| c.model.as_ref()).map(|m| m.mode) {
            meta.push("mode", super::predict::dome_args::mode_name(mode));
        }
        let numbers = [
            ("sun_alt_deg", dark.sun_alt_deg),
            ("min_alt_deg", self.min_alt),
            ("moon_sep_deg", self.moon_sep_deg),
            ("max_rate_deg_s", self.max_rate_deg_s),
            ("snr", self.snr),
            ("slew_s", self.slew_s),
            ("longest_min", self.longest_min),
            ("step_s", self.step_s),
            ("dark_sky_mag_arcsec2", self.dark_sky_mag),
            ("k_mag_airmass", settings.k_mag_airmass),
            ("tolerance", self.tolerance),
        ];
        numbers.into_iter().for_each(|(key, value)| meta.push(key, value));
        if !self.horizon.is_empty() {
            let degrees = |p: &[f64; 2]| MetaValue::List(vec![p[0].into(), p[1].into()]);
            meta.push("horizon_az_alt_deg", MetaValue::List(self.horizon.iter().map(degrees).collect()));
        }
        let telescope = instrument.settings.iter().map(|s| (s.name.to_owned(), s.value.into())).collect();
        meta.push("telescope", MetaValue::Map(telescope));
        meta
    }

    /// What is printed.
    fn text(&self, rows: &[PlanRow], dark: &Dark) -> String {
        let of = |status: PlanStatus| rows.iter().filter(move |r| r.status == status);
        let spans: Vec<String> =
            dark.spans.iter().map(|[a, b]| format!("{} to {}", iso_utc(*a, 0), iso_utc(*b, 0))).collect();
        let mut text =
            format!("night of {}, Sun below {} deg: {}\n", dark.label, dark.sun_alt_deg, spans.join(" and "));
        let mut shown: Vec<&PlanRow> = of(PlanStatus::Observable).take(self.top).collect();
        if self.order == Order::Time {
            shown.sort_by(|a, b| a.date_beg.cmp(&b.date_beg));
        }
        if !shown.is_empty() {
            let cells: Vec<Vec<String>> = shown.iter().map(|r| cells(r)).collect();
            text += &text_table(&HEADER, &cells);
        }
        let n = of(PlanStatus::Observable).count();
        let scheduled = rows.iter().filter(|r| r.scheduled == 1).count();
        let listed =
            if n > shown.len() { format!(", the first {} by rank are listed", shown.len()) } else { String::new() };
        text += &format!("{n} observable passes{listed}; {scheduled} are scheduled without overlap (*)\n");
        let others: Vec<String> = PlanStatus::ALL
            .into_iter()
            .filter(|s| *s != PlanStatus::Observable && of(*s).next().is_some())
            .map(|s| format!("{} {}", of(s).count(), s.as_str().replace('_', " ")))
            .collect();
        if !others.is_empty() {
            text += &format!("not observable: {}\n", others.join(", "));
        }
        text
    }

    fn notes(&self, rows: &[PlanRow], instrument: &Instrument) {
        if self.quiet {
            return;
        }
        let of = |status: PlanStatus| rows.iter().filter(move |r| r.status == status);
        let said = |first: &PlanRow, n: usize, remedy: &str| {
            let more = if n > 1 { format!(" ({n} rows)") } else { String::new() };
            tell(&format!("note: {}: {}{more}{remedy}", first.object_name, first.reason));
        };
        if let Some(first) = of(PlanStatus::Failed).next() {
            said(first, of(PlanStatus::Failed).count(), "");
        }
        let reasons: BTreeSet<&str> = of(PlanStatus::NoModel).map(|r| r.reason.as_str()).collect();
        for reason in reasons {
            let mut same = of(PlanStatus::NoModel).filter(|r| r.reason == reason);
            if let Some(first) = same.next() {
                said(first, 1 + same.count(), "; --model OBJECT=NAME says which it is");
            }
        }
        if instrument.settings.iter().any(|s| s.name == "zeropoint" && s.from == "computed") {
            let zp = instrument.calculator.zp_mag;
            tell(&format!(
                "note: the zeropoint {zp:.2} mag is computed from the optics; a measured one is often 1 to 2 mag less, \
                 --zp-mag sets it"
            ));
        }
    }

    fn page<'a>(
        &self,
        rows: &'a [PlanRow],
        dark: &Dark,
        instrument: &Instrument,
        settings: &PlanSettings,
        place: &config::Site,
    ) -> PlanPage<'a> {
        let mut used: Vec<(String, String)> = vec![
            ("Sun below".into(), format!("{} deg", dark.sun_alt_deg)),
            ("target above".into(), format!("{} deg{}", self.min_alt, self.horizon_text())),
            ("Moon at least".into(), format!("{} deg away", self.moon_sep_deg)),
            ("mount up to".into(), format!("{} deg/s", self.max_rate_deg_s)),
            ("S/N asked for".into(), format!("{} in {} s", self.snr, self.exptime_s)),
            ("slew".into(), format!("{} s", self.slew_s)),
            ("longest observation".into(), format!("{} min", self.longest_min)),
            ("dark sky".into(), format!("V {} mag/arcsec2", self.dark_sky_mag)),
            ("extinction".into(), format!("{} mag/airmass", settings.k_mag_airmass)),
        ];
        let of_telescope = |s: &super::limits::tracked::instrument::Setting| {
            (s.name.to_owned(), format!("{:.4} {} ({})", s.value, s.unit, s.from))
        };
        used.extend(instrument.settings.iter().map(of_telescope));
        let site = format!("latitude {}°, longitude {}°", place.lat_deg, place.lon_deg).replace('-', "−");
        PlanPage {
            title: format!("Plan for the night of {}", dark.label),
            subtitle: format!("{site} · {}", instrument.title),
            rows,
            dark_mjd_d: dark.spans.iter().map(|span| span.map(mjd_utc)).collect(),
            band: instrument.sky_band.clone(),
            used,
        }
    }
}

/// The models of a plan, each built once.
struct Models<'a> {
    catalogue: Catalogue,
    config: Option<&'a Config>,
    rules: &'a [Rule],
    /// What all of them share.
    base: config::Model,
    known: HashMap<String, usize>,
    built: Vec<NamedModel>,
    /// What observations say of each.
    standings: Vec<String>,
}

impl<'a> Models<'a> {
    fn new(args: &'a PlanNight, config: Option<&'a Config>, instrument: &Instrument) -> anyhow::Result<Self> {
        let mut base = config.and_then(|c| c.model.clone()).unwrap_or_else(|| config::Model::of(""));
        base.satellites = args.satellites.clone().or(base.satellites);
        base.tolerance = args.tolerance;
        base.band.clone_from(&instrument.sky_band);
        // magnitudes are outside the atmosphere; the extinction is that of each moment
        base.effects.source = base.effects.source.filter(|s| *s != config::Source::Extincted);
        let catalogue = Catalogue::load(base.satellites.as_deref())?;
        for rule in &args.model {
            catalogue.find(&rule.model).map_err(|e| of_argument("--model", e))?;
        }
        let (known, built, standings) = (HashMap::new(), Vec::new(), Vec::new());
        Ok(Self { catalogue, config, rules: &args.model, base, known, built, standings })
    }

    /// The model of an object, or why none; `named`: it is the one that the configuration is about.
    fn of(&mut self, object: &Object, named: bool) -> anyhow::Result<Result<usize, String>> {
        let by_rule = self.rules.iter().find(|rule| object.is_of(&rule.object)).map(|rule| rule.model.clone());
        let of_config = match (&by_rule, self.config) {
            (None, Some(config)) => model_of(config, object, named)?,
            _ => None,
        };
        let model = match (by_rule, of_config) {
            (None, Some(model)) => {
                config::Model { satellite: model.satellite, surfaces: model.surfaces, ..self.base.clone() }
            }
            (by_rule, _) => {
                let name = match by_rule {
                    Some(name) => name,
                    None => match self.catalogue.design_of(&object.name, object.norad_cat_id) {
                        Ok(entry) => entry.name.clone(),
                        Err(names) if names.is_empty() => {
                            return Ok(Err("no model of the catalogue lists this object".into()));
                        }
                        Err(names) => return Ok(Err(format!("several models list this object: {}", names.join(", ")))),
                    },
                };
                config::Model { satellite: name, surfaces: Vec::new(), ..self.base.clone() }
            }
        };
        if let Some(known) = self.known.get(&model.satellite) {
            return Ok(Ok(*known));
        }
        let satellite = Satellite::from_config(&model)?;
        let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::try_from(&model)? };
        self.standings.push(satellite.standing_line());
        self.built.push(NamedModel { name: model.satellite.clone(), model: Model::new(&satellite, &settings)? });
        self.known.insert(model.satellite, self.built.len() - 1);
        Ok(Ok(self.built.len() - 1))
    }
}

const HEADER: [&str; 17] = [
    "rank",
    "",
    "satellite",
    "from (UTC)",
    "best",
    "to",
    "alt",
    "az",
    "deg/s",
    "V",
    "+-",
    "light",
    "sky",
    "S/N",
    "needs",
    "Moon",
    "overlaps",
];

/// The printed cells of a row.
fn cells(row: &PlanRow) -> Vec<String> {
    let fixed = |value: Option<f64>, decimals: usize| value.map(|v| format!("{v:.decimals$}")).unwrap_or_default();
    let whole = |value: Option<i64>| value.map(|v| v.to_string()).unwrap_or_default();
    let clock = |date: &str| date.chars().skip(11).take(8).collect::<String>();
    let needs = match (row.needed_exptime_s, row.needed_n_sub) {
        (Some(s), Some(n)) if n > 1 => format!("{n} x {:.2e} s", s / n as f64),
        (Some(s), _) => format!("{s:.2e} s"),
        _ => String::new(),
    };
    vec![
        whole(row.rank),
        if row.scheduled == 1 { "*".into() } else { String::new() },
        row.object_name.clone(),
        row.date_beg.clone(),
        clock(&row.date_best),
        clock(&row.date_end),
        fixed(row.alt_deg, 0),
        fixed(row.az_deg, 0),
        fixed(row.rate_deg_s, 3),
        fixed(row.model_v_mag, 2),
        fixed(row.v_pred_err_mag, 2),
        row.illum.clone(),
        fixed(row.sky_mag_arcsec2, 1),
        fixed(row.snr, 1),
        needs,
        fixed(row.moon_sep_deg.filter(|_| row.moon_alt_deg.is_some_and(|a| a > 0.0)), 0),
        whole(row.conflicts_with),
    ]
}
