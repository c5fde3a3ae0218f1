//! `satphot fetch`: elements and stars from the network into the files the configuration names.

mod job;

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use clap::{Args, ValueEnum};
use hifitime::Epoch;
use satphot::Error;
use satphot::config::{self, Config};
use satphot::fetch::{Cache, Desk, Outside};

use super::orbit_args::bad;
use super::{load, log, tell};
use job::Job;

const AFTER_HELP: &str = "\
Examples:
  satphot fetch -c night.toml                             what night.toml names and does not have
  satphot fetch -c night.toml --norad 25544 --dry-run     the addresses that would be asked
  satphot fetch elements --norad 25544 -o iss.json        current elements (CelesTrak)
  satphot fetch elements --norad 25544 --date 2025-06-10T10:00:00 -o iss.tle      of a past night (SatChecker)
  satphot fetch stars -c night.toml                       APASS DR9 of the night's star pointings
  satphot fetch stars --ra-deg 280.6 --dec-deg 0.1 --radius-deg 0.5 -o apass.csv

The only verb that uses the network. Answers are kept in a cache ($XDG_CACHE_HOME/satphot or ~/.cache/satphot) and not asked
for again within 2 h (elements), a day (past nights), ever (APASS DR9). Proxies: HTTPS_PROXY, NO_PROXY. Addresses, patience
and the contact told to the services are keys of [fetch]. Files that exist are left alone without --force.

Exit codes: 75 the network or a server failed, try again later; 5 there is no such object or star; 2 usage.";

/// Fetches elements (CelesTrak, SatChecker) and stars (APASS DR9 of VizieR) into the files the configuration names.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Fetch {
    /// What to fetch [default: what the configuration names and is not there]
    #[arg(value_enum)]
    what: Option<What>,
    /// Configuration of the night [default: pipeline.toml, if it is there]
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration, e.g. --set fetch.timeout_s=30 (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// File to write instead of orbit.elements or stars.catalogue
    #[arg(short, long, value_name = "FILE", requires = "what")]
    out: Option<PathBuf>,
    /// Overwrite files that are there
    #[arg(long)]
    force: bool,
    /// The cache alone: no network
    #[arg(long)]
    offline: bool,
    /// Print the addresses that would be asked, and ask nothing
    #[arg(long)]
    dry_run: bool,
    /// Folder of the cache [default: fetch.cache, $XDG_CACHE_HOME/satphot or ~/.cache/satphot]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// No progress, no notes
    #[arg(short, long)]
    quiet: bool,
    /// Progress, notes and errors on standard error as lines of JSON
    #[arg(long)]
    json: bool,

    /// Catalogue number [default: orbit.norad_cat_id]
    #[arg(long, value_name = "NUMBER", help_heading = "Elements", value_parser = clap::value_parser!(u64).range(1..=999_999_999))]
    norad: Option<u64>,
    /// Name instead of a number
    #[arg(long, value_name = "NAME", help_heading = "Elements", conflicts_with = "norad")]
    name: Option<String>,
    /// Moment the elements are for, UTC [default: the middle of the night's frames, else night.name, else now]
    #[arg(long, value_name = "UTC", help_heading = "Elements")]
    date: Option<String>,
    /// Who is asked [default: CelesTrak for nights of the last 2 d, SatChecker for older ones]
    #[arg(long, value_enum, help_heading = "Elements")]
    source: Option<ElementSource>,
    /// Format [default: TLE for files called .tle, .3le or .txt, else OMM JSON]
    #[arg(long, value_enum, help_heading = "Elements")]
    format: Option<ElementFormat>,
    /// Elements further from the moment are not taken [default: orbit.max_age_d, or 14]
    #[arg(long, value_name = "D", help_heading = "Elements")]
    max_age_d: Option<f64>,
    /// Address of CelesTrak's gp.php
    #[arg(long, value_name = "URL", help_heading = "Elements")]
    celestrak_url: Option<String>,
    /// Address of SatChecker's tools
    #[arg(long, value_name = "URL", help_heading = "Elements")]
    satchecker_url: Option<String>,

    /// Right ascension of a field [deg], instead of the frames'
    #[arg(long, value_name = "DEG", help_heading = "Stars", requires = "dec_deg")]
    ra_deg: Option<f64>,
    /// Declination of that field [deg]
    #[arg(long, value_name = "DEG", help_heading = "Stars", requires = "ra_deg", allow_negative_numbers = true)]
    dec_deg: Option<f64>,
    /// Radius of each field [deg] [default: from the optics and the pointing error; 0.5 without a configuration]
    #[arg(long, value_name = "DEG", help_heading = "Stars")]
    radius_deg: Option<f64>,
    /// Address of VizieR's asu-tsv
    #[arg(long, value_name = "URL", help_heading = "Stars")]
    vizier_url: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum What {
    /// Orbital elements of the target
    Elements,
    /// APASS DR9 stars of the star pointings
    Stars,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ElementSource {
    /// Current elements
    Celestrak,
    /// The elements nearest to the moment
    Satchecker,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ElementFormat {
    /// OMM in JSON: every object
    Json,
    /// Two lines with a name: objects up to 99999
    Tle,
}

impl Fetch {
    pub fn execute(self) -> anyhow::Result<()> {
        if self.json {
            log::as_json();
        }
        self.no_stray_options()?;
        let config = self.configuration()?;
        let settings = self.settings(config.as_ref())?;
        let now = now()?;
        let cache = Cache::new(&self.cache_folder(&settings)?);
        let say = |text: &str| {
            if !self.quiet {
                tell(text);
            }
        };
        let outside = Outside { wait: &std::thread::sleep, say: &say, environment: true };
        let desk = Desk::new(&settings, cache, now, self.offline, outside)?;
        let job = Job { verb: &self, config: config.as_ref(), settings: &settings, desk: &desk, say: &say };
        match self.what {
            Some(What::Elements) => job.elements(&job.elements_file()?),
            Some(What::Stars) => job.stars(&job.stars_file()?),
            None => job.what_is_missing(),
        }
    }

    /// An option that would do nothing is a mistake worth telling.
    fn no_stray_options(&self) -> anyhow::Result<()> {
        let of_elements = [
            ("--norad", self.norad.is_some()),
            ("--name", self.name.is_some()),
            ("--source", self.source.is_some()),
            ("--format", self.format.is_some()),
            ("--max-age-d", self.max_age_d.is_some()),
        ];
        let of_stars = [("--ra-deg", self.ra_deg.is_some()), ("--radius-deg", self.radius_deg.is_some())];
        let stray = match self.what {
            Some(What::Elements) => of_stars.iter().find(|o| o.1),
            Some(What::Stars) => of_elements.iter().find(|o| o.1),
            None => None,
        };
        if let Some((option, _)) = stray {
            return Err(bad(option, "has no effect here: elements and stars have their own options (--help)".into()));
        }
        if let Some(deg) = self.dec_deg.filter(|d| !(-90.0..=90.0).contains(d)) {
            return Err(bad("--dec-deg", format!("{deg} is outside -90 to 90 deg")));
        }
        if let Some(deg) = self.ra_deg.filter(|d| !(-360.0..=360.0).contains(d)) {
            return Err(bad("--ra-deg", format!("{deg} is outside -360 to 360 deg")));
        }
        if let Some(deg) = self.radius_deg.filter(|d| !(0.001..=5.0).contains(d)) {
            return Err(bad("--radius-deg", format!("{deg} is outside 0.001 to 5 deg")));
        }
        if let Some(days) = self.max_age_d.filter(|d| !(0.0..=36_525.0).contains(d)) {
            return Err(bad("--max-age-d", format!("{days} is outside 0 to 36525 d")));
        }
        if self.name.as_ref().is_some_and(|n| n.trim().is_empty()) {
            return Err(bad("--name", "is empty; give a name such as \"ISS (ZARYA)\"".into()));
        }
        Ok(())
    }

    /// The configuration that is named, or pipeline.toml if it is there.
    fn configuration(&self) -> anyhow::Result<Option<Config>> {
        let usual = Path::new("pipeline.toml");
        match &self.config {
            Some(path) if !path.exists() => {
                let problem = "no such configuration; `satphot init` writes one to start from, or say what to fetch \
                               without one: --norad and -o, --ra-deg, --dec-deg and -o";
                Err(Error::NoInput { path: path.clone(), problem: problem.into() }.into())
            }
            Some(path) => load(path, &self.sets).map(Some),
            None if usual.exists() => load(usual, &self.sets).map(Some),
            None => Ok(None),
        }
    }

    fn settings(&self, config: Option<&Config>) -> anyhow::Result<config::Fetch> {
        let mut settings = match config {
            Some(config) => config.fetch.clone(),
            None => config::Fetch::from_sets(&self.sets)?,
        };
        for (given, key) in [
            (&self.celestrak_url, &mut settings.celestrak_url),
            (&self.satchecker_url, &mut settings.satchecker_url),
            (&self.vizier_url, &mut settings.vizier_url),
        ] {
            if let Some(url) = given {
                key.clone_from(url);
            }
        }
        settings.check()?;
        Ok(settings)
    }

    fn cache_folder(&self, settings: &config::Fetch) -> anyhow::Result<PathBuf> {
        let variable = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
        let own = self.cache.clone().or_else(|| settings.cache.clone());
        // a relative XDG folder is to be ignored, says the specification
        let usual = || variable("XDG_CACHE_HOME").filter(|p| p.is_absolute()).map(|p| p.join("satphot"));
        let windows = || variable("LOCALAPPDATA").map(|p| p.join("satphot").join("cache"));
        let home = || std::env::home_dir().filter(|p| p.is_absolute()).map(|p| p.join(".cache").join("satphot"));
        own.or_else(usual)
            .or_else(windows)
            .or_else(home)
            .ok_or_else(|| bad("--cache", "name a folder: there is no home".into()))
    }
}

/// The moment of the machine's clock.
fn now() -> anyhow::Result<Epoch> {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
    if since.is_zero() {
        return Err(bad(
            "the clock",
            "of this machine is before 1970; set it, or certificates and ages are all wrong".into(),
        ));
    }
    Ok(Epoch::from_unix_seconds(since.as_secs_f64()))
}
