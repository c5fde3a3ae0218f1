//! Arguments of `satphot fetch`.

use clap::Args;
use clap::ValueEnum;
use std::path::PathBuf;

/// Fetches elements (CelesTrak, SatChecker) and stars (APASS DR9 of VizieR) into the files the configuration names.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Fetch {
    /// What to fetch [default: what the configuration names and does not exist]
    #[arg(value_enum)]
    pub(super) what: Option<What>,
    /// Configuration of the night [default: pipeline.toml, if it exists]
    #[arg(short, long, value_name = "FILE")]
    pub(super) config: Option<PathBuf>,
    /// Set a key of the configuration, e.g. --set fetch.timeout_s=30 (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) sets: Vec<String>,
    /// File to write instead of orbit.elements or stars.catalogue
    #[arg(short, long, value_name = "FILE", requires = "what")]
    pub(super) out: Option<PathBuf>,
    /// Overwrite existing files
    #[arg(long)]
    pub(super) force: bool,
    /// Use the cache alone, without the network
    #[arg(long)]
    pub(super) offline: bool,
    /// Print the addresses that would be queried, and send nothing
    #[arg(long)]
    pub(super) dry_run: bool,
    /// Folder of the cache [default: fetch.cache, $XDG_CACHE_HOME/satphot or ~/.cache/satphot]
    #[arg(long, value_name = "DIR")]
    pub(super) cache: Option<PathBuf>,
    /// Print no progress and no notes
    #[arg(short, long)]
    pub(super) quiet: bool,
    /// Progress, notes and errors on standard error as lines of JSON
    #[arg(long)]
    pub(super) json: bool,

    /// Catalogue number [default: orbit.norad_cat_id]
    #[arg(long, value_name = "NUMBER", help_heading = "Elements", value_parser = norad)]
    pub(super) norad: Option<u64>,
    /// Name instead of a number
    #[arg(long, value_name = "NAME", help_heading = "Elements", conflicts_with = "norad")]
    pub(super) name: Option<String>,
    /// Moment the elements are for, UTC [default: the middle of the night's frames, else night.name, else now]
    #[arg(long, value_name = "UTC", help_heading = "Elements")]
    pub(super) date: Option<String>,
    /// Service to query [default: CelesTrak for nights of the last 2 d, SatChecker for older ones]
    #[arg(long, value_enum, help_heading = "Elements")]
    pub(super) source: Option<ElementSource>,
    /// Format [default: TLE for files called .tle, .3le or .txt, else OMM JSON]
    #[arg(long, value_enum, help_heading = "Elements")]
    pub(super) format: Option<ElementFormat>,
    /// Largest time between elements and moment [d] [default: orbit.max_age_d, or 14]
    #[arg(long, value_name = "D", help_heading = "Elements")]
    pub(super) max_age_d: Option<f64>,
    /// Address of CelesTrak's gp.php
    #[arg(long, value_name = "URL", help_heading = "Elements")]
    pub(super) celestrak_url: Option<String>,
    /// Address of SatChecker's tools
    #[arg(long, value_name = "URL", help_heading = "Elements")]
    pub(super) satchecker_url: Option<String>,

    /// Right ascension of a field [deg], instead of the frames'
    #[arg(long, value_name = "DEG", help_heading = "Stars", requires = "dec_deg")]
    pub(super) ra_deg: Option<f64>,
    /// Declination of that field [deg]
    #[arg(long, value_name = "DEG", help_heading = "Stars", requires = "ra_deg", allow_negative_numbers = true)]
    pub(super) dec_deg: Option<f64>,
    /// Radius of each field [deg] [default: from the optics and the pointing error; 0.5 without a configuration]
    #[arg(long, value_name = "DEG", help_heading = "Stars")]
    pub(super) radius_deg: Option<f64>,
    /// Address of VizieR's asu-tsv
    #[arg(long, value_name = "URL", help_heading = "Stars")]
    pub(super) vizier_url: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum What {
    /// Orbital elements of the target
    Elements,
    /// APASS DR9 stars of the star pointings
    Stars,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum ElementSource {
    /// Current elements
    Celestrak,
    /// The elements nearest to the moment
    Satchecker,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum ElementFormat {
    /// OMM in JSON: every object
    Json,
    /// Two lines with a name: objects up to 99999
    Tle,
}

pub(super) const AFTER_HELP: &str = "\
Examples:
  satphot fetch -c night.toml                             what night.toml names and does not have
  satphot fetch -c night.toml --norad 25544 --dry-run     the addresses that would be queried
  satphot fetch elements --norad 25544 -o iss.json        current elements (CelesTrak)
  satphot fetch elements --norad 25544 --date 2025-06-10T10:00:00 -o iss.tle      of a past night (SatChecker)
  satphot fetch stars -c night.toml                       APASS DR9 of the night's star pointings
  satphot fetch stars --ra-deg 280.6 --dec-deg 0.1 --radius-deg 0.5 -o apass.csv

This is the only verb that uses the network. Answers are kept in a cache ($XDG_CACHE_HOME/satphot or ~/.cache/satphot) and not requested
again for 2 h (elements), for a day (past nights), or at all (APASS DR9). Proxies: HTTPS_PROXY, NO_PROXY. Addresses, time limits
and the contact sent to the services are keys of [fetch]. Files that exist are left alone without --force.

Exit codes: 75 if the network or a server failed (try again later); 5 if the object or stars do not exist; 2 for wrong usage.";

/// A catalogue number; a name is another option.
fn norad(text: &str) -> Result<u64, String> {
    let wrong = "must be a catalogue number from 1 to 999999999, such as 25544; --name takes the name of an object";
    text.parse().ok().filter(|n| (1..=999_999_999).contains(n)).ok_or_else(|| wrong.into())
}
