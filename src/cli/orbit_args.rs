//! Which satellite over which site: arguments, else the configuration. Shared by `passes` and `predict`.

use std::path::{Path, PathBuf};

use clap::Args;
use hifitime::Epoch;
use satphot::Error;
use satphot::base::time::{iso_utc, parse_utc, seconds_between, shifted};
use satphot::config::{Config, Orbit, Site};
use satphot::orbit::EarthOrientation;

use super::{load, tell};

/// Elements older than this are refused where no configuration says otherwise [d].
pub const MAX_AGE_D: f64 = 14.0;

/// Where elements, site and model come from.
#[derive(Debug, Clone, Args)]
pub struct OrbitArgs {
    /// Configuration with [site], [orbit] and [model]; pipeline.toml where the arguments leave something open
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Elements instead of those of the configuration: TLE, 3LE, or OMM in JSON, CSV, KVN or XML
    #[arg(long, visible_alias = "tle", value_name = "FILE")]
    pub elements: Option<PathBuf>,
    /// Catalogue number, when the file holds several objects
    #[arg(long, value_name = "NUMBER")]
    pub norad: Option<u64>,
    /// Use elements older than the limit, or contradicted by others, all the same
    #[arg(long)]
    pub force_age: bool,
    #[command(flatten)]
    pub place: SiteArg,
}

/// The site.
#[derive(Debug, Clone, Args)]
pub struct SiteArg {
    /// Site instead of the configuration's: latitude, longitude [deg], height [m], e.g. -33.77,151.11,70
    #[arg(long, value_name = "LAT,LON,ALT", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    site: Vec<f64>,
}

impl SiteArg {
    /// --site, where that is left to the configuration.
    pub fn missing(&self) -> anyhow::Result<Option<&'static str>> {
        Ok(self.given()?.is_none().then_some("--site"))
    }

    /// The site of the command line; `None` when it names none.
    pub fn given(&self) -> anyhow::Result<Option<Site>> {
        match self.site.as_slice() {
            [] => Ok(None),
            [lat_deg, lon_deg, alt_m] => {
                Ok(Some(Site { name: "command line".into(), lat_deg: *lat_deg, lon_deg: *lon_deg, alt_m: *alt_m }))
            }
            _ => {
                Err(bad("--site", "must be latitude,longitude,altitude [deg, deg, m], such as -33.77,151.11,70".into()))
            }
        }
    }
}

impl OrbitArgs {
    /// The configuration, if one is named or some options are `missing`.
    pub fn configuration(&self, missing: Vec<&str>) -> anyhow::Result<Option<Config>> {
        configuration(self.config.as_deref(), &self.sets, &missing)
    }

    /// Those of --elements and --site that are left to the configuration.
    pub fn missing(&self) -> anyhow::Result<Vec<&'static str>> {
        let elements = self.elements.is_none().then_some("--elements");
        Ok(elements.into_iter().chain(self.place.missing()?).collect())
    }

    /// Elements from the arguments, else from the configuration; `None` where neither names any.
    pub fn orbit(&self, config: Option<&Config>) -> anyhow::Result<Option<Orbit>> {
        if self.elements.is_none() && config.is_none_or(|c| c.orbit.is_none()) {
            return Ok(None);
        }
        self.named_orbit(config).map(Some)
    }

    /// Elements and site from the arguments, else from the configuration.
    pub fn orbit_and_site(&self, config: Option<&Config>) -> anyhow::Result<(Orbit, Site)> {
        let site = match (self.place.given()?, config) {
            (Some(site), _) => site,
            (None, Some(config)) => config.site.clone(),
            (None, None) => {
                return Err(bad(
                    "--site",
                    "is needed without a configuration: latitude,longitude,height [deg, deg, m]".into(),
                ));
            }
        };
        Ok((self.named_orbit(config)?, site))
    }

    fn named_orbit(&self, config: Option<&Config>) -> anyhow::Result<Orbit> {
        let mut orbit = match (&self.elements, config.and_then(|c| c.orbit.clone())) {
            (Some(elements), from_config) => Orbit {
                elements: elements.clone(),
                norad_cat_id: None,
                max_age_d: from_config.as_ref().map_or(MAX_AGE_D, |o| o.max_age_d),
                force_age: false,
                ut1_utc_s: from_config.as_ref().and_then(|o| o.ut1_utc_s),
                xp_arcsec: from_config.as_ref().map_or(0.0, |o| o.xp_arcsec),
                yp_arcsec: from_config.as_ref().map_or(0.0, |o| o.yp_arcsec),
            },
            (None, Some(orbit)) => orbit,
            (None, None) => return Err(bad("--elements", "no [orbit] in the configuration; name a file".into())),
        };
        orbit.norad_cat_id = self.norad.or(orbit.norad_cat_id);
        orbit.force_age |= self.force_age;
        let named_by = config.filter(|_| self.elements.is_none());
        elements_there(&orbit.elements, orbit.norad_cat_id, named_by)?;
        Ok(orbit)
    }
}

/// The configuration that is named, else pipeline.toml if options are `missing`; without it, these are named in one message.
pub fn configuration(named: Option<&Path>, sets: &[String], missing: &[&str]) -> anyhow::Result<Option<Config>> {
    let path = match named {
        Some(path) => path,
        None if !missing.is_empty() => Path::new("pipeline.toml"),
        None => return Ok(None),
    };
    if !path.exists() {
        if named.is_some() {
            return Err(bad("-c", format!("{} does not exist; `satphot init` writes a configuration", path.display())));
        }
        let (verb, options) = match missing {
            [one] => ("is", (*one).to_owned()),
            [first @ .., last] => ("are", format!("{} and {last}", first.join(", "))),
            [] => ("is", String::new()),
        };
        let problem = format!("{verb} not given, and there is no pipeline.toml here; give {options}, or -c FILE");
        return Err(bad(&options, problem));
    }
    load(path, sets).map(Some)
}

/// Longest window \[h\].
pub const LONGEST_H: f64 = 24.0 * 366.0;

/// From --start to --end, else for --hours.
pub fn window(start: &str, end: Option<&str>, hours: f64) -> anyhow::Result<(Epoch, Epoch)> {
    let start = parse_utc("--start", start)?;
    let Some(end) = end else {
        if !(0.0 < hours && hours <= LONGEST_H) {
            return Err(bad("--hours", format!("{hours} is outside 0 to {LONGEST_H} h")));
        }
        return Ok((start, shifted(start, hours * 3600.0)));
    };
    let end = parse_utc("--end", end)?;
    let length_h = seconds_between(start, end) / 3600.0;
    if !(0.0 < length_h && length_h <= LONGEST_H) {
        let (a, b) = (iso_utc(start, 0), iso_utc(end, 0));
        let problem = format!("{b} is {length_h:.3} h after --start {a}; accepted is above 0, to {LONGEST_H} h");
        return Err(bad("--end", problem));
    }
    Ok((start, end))
}

/// Elements that are not there are an error with the line that gets them: that of the configuration which names them, if
/// one does.
pub fn elements_there(file: &Path, norad: Option<u64>, config: Option<&Config>) -> anyhow::Result<()> {
    if file.exists() {
        return Ok(());
    }
    let (number, file) = (norad.map_or("NUMBER".to_owned(), |n| n.to_string()), file.display());
    let line = match config {
        Some(config) => config.fetch_line("elements"),
        None => format!("satphot fetch elements --norad {number} --date YYYY-MM-DD -o {file}"),
    };
    Err(Error::Orbit { problem: format!("no elements at {file}; `{line}` gets them") }.into())
}

/// A note where UT1 - UTC of a moment is neither given nor in the embedded table.
pub fn tell_unknown_ut1(epoch: &Epoch, quiet: bool) {
    if let Some(warning) = EarthOrientation::default().warning(epoch).filter(|_| !quiet) {
        tell(&format!("note: {warning}"));
    }
}

/// An error of a key of the configuration as one of the argument that gave its value.
pub fn of_argument(argument: &str, error: Error) -> Error {
    match error {
        Error::Config { problem, .. } => Error::Argument { name: argument.into(), problem },
        other => other,
    }
}

/// A wrong argument, with what would be right.
pub fn bad(key: &str, problem: String) -> anyhow::Error {
    Error::Argument { name: key.into(), problem }.into()
}
