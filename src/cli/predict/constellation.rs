//! `satphot predict constellation`: how many satellites of a constellation are up, lit and bright, moment by moment.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use hifitime::Epoch;
use satphot::Error;
use satphot::base::file::NewFile;
use satphot::base::progress::Progress;
use satphot::base::threads::with_threads;
use satphot::base::time::{parse_utc, shifted};
use satphot::brightness::catalogue::Standing;
use satphot::brightness::{Catalogue, Model, ModelSettings, Satellite, ToleranceOf};
use satphot::config;
use satphot::orbit::{Propagator, Site, check_age, read_elements_file};
use satphot::pipeline::products::manifest::peak_memory_mb;
use satphot::tables::{Meta, SEEN, write_cells};
use satphot::visibility::forecast::constellation::{Seen, Source, Watch};
use satphot::visibility::forecast::prediction_meta;
use satphot::visibility::forecast::tally::Tally;
use satphot::visibility::forecast::walker::{Pattern, Walker};

use super::super::orbit_args::{SiteArg, bad, configuration, tell_unknown_ut1};
use super::super::{bar::Bars, print, tell, threads};
use super::ModelArgs;
use super::dome_args::{checked_height, site_of};
use super::shards::{Shards, shard, together};
use super::tally_table::{MomentTally, Table, add};

/// Satellites of which the note gives the time.
const A_MILLION: f64 = 1e6;

const AFTER_HELP: &str = "\
Satellites are placed evenly in the shells of the catalogue's entry (circular orbits; planes
even in node, satellites even in each plane; two bodies and the drift by the Earth's flattening),
or read from a file of elements (SGP4; of each object the set nearest to the first moment). All
are of one type, --satellite.

The columns: satellites computed, above the horizon, above --min-alt, and of these: lit, lit by
each light, brighter than each of --magnitudes, the brightest, median and 16/84 % of the lit
from a histogram in steps of 0.02 mag (the column histogram: step:count, step 0 begins at -30).

--shard 2/8 computes every eighth satellite; the tables of all eight, given to --merge, make the
table of the whole, byte for byte (exit code 3 names missing shards). Memory does not grow with the number of satellites or of
moments; rows of single satellites go straight to --rows.

Examples:
  satphot predict constellation --satellite starlink-v2 --count 10000 --inclination-deg 53 \\
      --site -33.7703,151.1113,70 --start 2025-06-11T00:00:00 -o counts.ecsv
  satphot predict constellation --satellite starmind --count 100000 --shard 1/4 \\
      --site -33.77,151.11,70 --start 2025-06-11T08:00:00 --steps 24 --rows seen.csv
  satphot predict constellation --elements starlink.json --satellite starlink-v2 \\
      --site -33.77,151.11,70 --start 2025-06-11T08:00:00
  satphot predict constellation --merge part1.ecsv part2.ecsv -o whole.ecsv";

/// Counts the satellites of a constellation that are up, lit and bright over a site, moment by moment.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Constellation {
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
    /// First moment, UTC
    #[arg(long, value_name = "UTC", required_unless_present = "merge")]
    start: Option<String>,
    /// Moments
    #[arg(long, value_name = "N", default_value_t = 144)]
    steps: usize,
    /// Time between moments [min]
    #[arg(long, value_name = "MIN", default_value_t = 10.0, allow_hyphen_values = true)]
    step_min: f64,
    /// Number of satellites [default: those launched, else those planned]
    #[arg(long, value_name = "N")]
    count: Option<usize>,
    /// Elements of real satellites instead of an even pattern
    #[arg(long, value_name = "FILE", conflicts_with = "count")]
    elements: Option<PathBuf>,
    /// Use elements older than 14 d all the same
    #[arg(long)]
    force_age: bool,
    /// Height of all orbits [km] instead of the catalogue's shells
    #[arg(long, value_name = "KM", allow_hyphen_values = true)]
    height_km: Option<f64>,
    /// Inclination of all orbits [deg]
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    inclination_deg: Option<f64>,
    /// Planes of each shell [default: one for 22 satellites]
    #[arg(long, value_name = "P")]
    planes: Option<usize>,
    /// Phasing of Walker's pattern: from plane to plane the satellites move on by F/N of a turn
    #[arg(long, value_name = "F", default_value_t = 1)]
    phasing: usize,
    /// Lowest altitude at which a satellite counts [deg]
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    min_alt: f64,
    /// Magnitudes of the columns n_brighter_...
    #[arg(
        long,
        value_name = "MAG,...",
        value_delimiter = ',',
        default_value = "5,7,10,15",
        allow_hyphen_values = true
    )]
    magnitudes: Vec<f64>,
    /// Only every N-th satellite, beginning with the I-th
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "1/1")]
    shard: (usize, usize),
    /// Tables of shards to merge instead of computing
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["start", "elements", "count", "rows"])]
    merge: Vec<PathBuf>,
    /// A line for each satellite above --min-alt at each moment, CSV
    #[arg(long, value_name = "FILE.csv")]
    rows: Option<PathBuf>,
    /// Table (ECSV)
    #[arg(short, long, value_name = "FILE.ecsv", value_parser = ecsv_file)]
    out: Option<PathBuf>,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    /// Number of threads; 0 = all cores. The result does not depend on it
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = threads)]
    jobs: usize,
    /// Print no progress bar and no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Constellation {
    pub fn execute(self) -> anyhow::Result<()> {
        if !self.merge.is_empty() {
            let (tables, shards, meta) = together(&self.merge)?;
            self.tell_table(&add(&tables)?, &meta)?;
            if let Some(line) = Standing::line_of(&meta).filter(|_| !self.csv) {
                print(&format!("model {line}\n"));
            }
            return shards.lacking().map_or(Ok(()), |error| Err(error.into()));
        }
        let start = parse_utc("--start", self.start.as_deref().unwrap_or_default())?;
        tell_unknown_ut1(&start, self.quiet);
        self.check()?;
        let given = self.place.given()?;
        let missing: Vec<&str> = self.model.missing().into_iter().chain(given.is_none().then_some("--site")).collect();
        let config = configuration(self.config.as_deref(), &self.sets, &missing)?;
        let mut model = self.model.over(config.as_ref(), &self.sets)?;
        if self.model.tolerance.is_none() && config.is_none() {
            model.tolerance = 1e-2;
        }
        let place = site_of(given, config.as_ref())?;
        let site = Site::from_config(&place)?;
        let settings = ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::try_from(&model)? };
        let satellite = Satellite::from_config(&model)?;
        let engine = Model::new(&satellite, &settings)?;
        let source = self.source(&model, &start)?;
        let watch = Watch {
            site: &site,
            model: &engine,
            start,
            min_alt_rad: self.min_alt.to_radians(),
            shard: (self.shard.0 - 1, self.shard.1),
        };
        let bar = Bars::new(!self.quiet);
        let table = with_threads(self.jobs, || self.run(&watch, &source, &bar))??;

        let mut meta = prediction_meta("satphot.constellation/1", &model, Some(&place));
        meta.push("orbits", self.orbits_text(&source));
        meta.push("min_alt_deg", self.min_alt);
        Shards::one(self.shard.0, self.shard.1).state_in(&mut meta);
        self.tell_table(&table, &meta)?;
        if !self.csv {
            print(&satellite.standing_line());
        }
        if !self.quiet {
            self.tell_cost(&bar, source.len());
        }
        Ok(())
    }

    fn check(&self) -> anyhow::Result<()> {
        self.height_km.map(checked_height).transpose()?;
        if !(1..=1_000_000).contains(&self.steps) {
            return Err(bad("--steps", format!("{} is outside 1 to 1000000", self.steps)));
        }
        if !(self.step_min > 0.0 && self.step_min <= 1e6) {
            return Err(bad("--step-min", format!("{} min; accepted is above 0", self.step_min)));
        }
        if !(0.0..90.0).contains(&self.min_alt) {
            return Err(bad("--min-alt", format!("{} is outside 0 to 90 deg", self.min_alt)));
        }
        if self.magnitudes.len() > 20 || !self.magnitudes.iter().all(|m| m.is_finite()) {
            return Err(bad("--magnitudes", "accepts up to 20 numbers".into()));
        }
        if self.inclination_deg.is_some_and(|i| !(0.0..=180.0).contains(&i)) {
            return Err(bad("--inclination-deg", "must be 0 to 180 deg".into()));
        }
        Ok(())
    }

    /// The pattern, or the elements.
    fn source(&self, model: &config::Model, start: &Epoch) -> anyhow::Result<Source> {
        if let Some(path) = &self.elements {
            return self.elements(path, start);
        }
        let known = Catalogue::load(model.satellites.as_deref())?;
        let entry = known.find(&model.satellite).ok().filter(|_| model.surfaces.is_empty());
        let counts = entry.and_then(|e| e.counts.as_ref());
        let default = counts.map(|c| if c.launched > 0 { c.launched } else { c.planned.bounds()[1] as u64 });
        let count = self.count.or(default.and_then(|n| usize::try_from(n).ok())).ok_or_else(|| {
            bad("--count", format!("the number of satellites of {} is not known; give --count", model.satellite))
        })?;
        let pattern = Pattern {
            height_km: self.height_km,
            inclination_rad: self.inclination_deg.map(f64::to_radians),
            planes: self.planes,
            phasing: self.phasing,
        };
        let shells = entry.map(|e| e.orbits.as_slice()).unwrap_or_default();
        Ok(Source::Walker(Walker::new(shells, count, &pattern)?))
    }

    /// Of each object the set nearest to the first moment; what cannot be used is reported.
    fn elements(&self, path: &Path, start: &Epoch) -> anyhow::Result<Source> {
        let file = read_elements_file(path)?;
        if let Some(first) = file.damaged.first().filter(|_| !self.quiet) {
            let (n, line) = (file.damaged.len(), first.line.map(|l| format!(":{l}")).unwrap_or_default());
            tell(&format!(
                "note: {n} damaged sets are not used; the first: {}{line}: {}",
                path.display(),
                first.problem
            ));
        }
        let mut sets = file.sets;
        let age = |e: &satphot::orbit::Elements| e.age_d(start).abs();
        sets.sort_by(|a, b| a.norad_cat_id().cmp(&b.norad_cat_id()).then(age(a).total_cmp(&age(b))));
        sets.dedup_by_key(|e| e.norad_cat_id());
        let all = sets.len();
        let (mut used, mut old, mut refused) = (Vec::new(), 0, 0);
        for set in &sets {
            if check_age(set, start, 14.0, self.force_age).is_err() {
                old += 1;
            } else if let Ok(propagator) = Propagator::new(set) {
                used.push((set.norad_cat_id(), propagator));
            } else {
                refused += 1;
            }
        }
        if used.is_empty() {
            let problem = format!("{}: {old} of {all} objects have elements older than 14 d", path.display());
            return Err(Error::Orbit {
                problem: format!("{problem}, {refused} are refused by SGP4; --force-age uses old ones"),
            }
            .into());
        }
        if old + refused > 0 && !self.quiet {
            tell(&format!(
                "note: of {all} objects {old} have elements older than 14 d and {refused} are refused by SGP4"
            ));
        }
        Ok(Source::Elements(used))
    }

    fn orbits_text(&self, source: &Source) -> String {
        match source {
            Source::Walker(walker) => format!(
                "{} satellites even in {} planes, circular, two bodies and the drift by J2",
                walker.len(),
                walker.planes()
            ),
            Source::Elements(sets) => {
                let path = self.elements.as_deref().unwrap_or(Path::new("")).display();
                format!("{} objects of {path}, SGP4", sets.len())
            }
        }
    }

    /// Moment by moment; rows go out as they come.
    fn run(&self, watch: &Watch, source: &Source, bar: &Bars) -> anyhow::Result<Table> {
        let mut rows = self.rows.as_deref().map(RowsFile::new).transpose()?;
        bar.stage("moments", self.steps);
        let mut moments = Vec::with_capacity(self.steps);
        for k in 0..self.steps {
            let moment = watch.moment(&shifted(watch.start, 60.0 * self.step_min * k as f64))?;
            let mut tally = Tally::new(self.magnitudes.len());
            let (n_satellites, failed) = watch.for_each_above_horizon(source, &moment, &mut |seen: &Seen| {
                tally.count(seen, watch.min_alt_rad, &self.magnitudes);
                match rows.as_mut().filter(|_| seen.alt_rad >= watch.min_alt_rad) {
                    Some(rows) => rows.line(seen, &moment.epoch),
                    None => Ok(()),
                }
            })?;
            (tally.n_satellites, tally.failed) = (n_satellites as u64, failed as u64);
            moments.push(MomentTally::new(&moment, tally));
            bar.tick();
        }
        bar.done();
        rows.map_or(Ok(()), RowsFile::finish)?;
        Ok(Table { magnitudes: self.magnitudes.clone(), moments })
    }

    fn tell_table(&self, table: &Table, meta: &Meta) -> anyhow::Result<()> {
        if let Some(path) = &self.out {
            write_cells(path, &table.records(), &table.columns(), meta)?;
        }
        print(&if self.csv { table.csv()? } else { table.text() });
        if let Some(path) = self.out.as_ref().filter(|_| !self.quiet) {
            tell(&format!("wrote {}", path.display()));
        }
        if let Some(path) = self.rows.as_ref().filter(|_| !self.quiet) {
            tell(&format!("wrote {}", path.display()));
        }
        Ok(())
    }

    /// What it took, and what a million satellites would.
    fn tell_cost(&self, bar: &Bars, satellites: usize) {
        let n_satellites = satellites as f64 / self.shard.1 as f64;
        let wall_s = bar.elapsed_s();
        let memory = peak_memory_mb().map_or(String::new(), |mb| format!(", {mb:.0} MB peak memory"));
        let cpu = bar.cpu_s().map_or(String::new(), |s| format!(", {s:.1} s of CPU"));
        let times = A_MILLION / n_satellites;
        let projected = bar.cpu_s().map_or(String::new(), |s| format!(" ({:.0} s of CPU)", s * times));
        tell(&format!(
            "{n_satellites:.0} satellites x {} moments: {wall_s:.1} s{cpu}{memory}; a million satellites: about {:.0} s{projected}",
            self.steps,
            wall_s * times
        ));
    }
}

/// A file of rows that appears when it is whole.
struct RowsFile {
    out: NewFile,
}

impl RowsFile {
    fn new(path: &Path) -> anyhow::Result<Self> {
        let mut out = NewFile::create(path)?;
        out.write_all(SEEN.csv_head().as_bytes()).map_err(|e| out.refused(e))?;
        Ok(Self { out })
    }

    fn line(&mut self, seen: &Seen, epoch: &Epoch) -> satphot::Result<()> {
        seen.write_csv(epoch, &mut self.out).map_err(|e| self.out.refused(e))
    }

    fn finish(self) -> anyhow::Result<()> {
        Ok(self.out.finish()?)
    }
}

fn ecsv_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_ecsv = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ecsv"));
    if is_ecsv { Ok(path) } else { Err("the table is ECSV: the name must end in .ecsv; --csv prints CSV".into()) }
}
