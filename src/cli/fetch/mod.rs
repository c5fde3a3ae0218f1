//! `satphot fetch`: elements and stars from the network into the files the configuration names.

mod args;
mod job;

pub use args::Fetch;

use args::What;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use hifitime::Epoch;
use satphot::Error;
use satphot::config::{self, Config};
use satphot::fetch::{Cache, Client, Hooks};

use super::orbit_args::bad;
use super::{load, log, tell};
use job::Job;

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
        let outside = Hooks { wait: &std::thread::sleep, say: &say, environment: true };
        let client = Client::new(&settings, cache, now, self.offline, outside)?;
        let job = Job { verb: &self, config: config.as_ref(), settings: &settings, client: &client, say: &say };
        match self.what {
            Some(What::Elements) => job.elements(&job.elements_file()?),
            Some(What::Stars) => job.stars(&job.stars_file()?),
            None => job.what_is_missing(),
        }
    }

    /// An option that would do nothing is a mistake worth a message.
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
            .ok_or_else(|| bad("--cache", "is needed, because HOME is not set; name a folder".into()))
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
