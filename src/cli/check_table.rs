//! `satphot check-table`: stated passes held against Sun, Moon and elements.

use std::path::{Path, PathBuf};

use clap::Args;
use satphot::config::{Config, Site as SiteConfig};
use satphot::orbit::Site;
use satphot::paper::local_time::Zone;
use satphot::paper::pass_check::{CheckedPass, Standing, Tolerances, check_passes};
use satphot::paper::pass_rows::{PAPER_PASSES, parse_passes, read_passes};
use satphot::paper::trackers::Targets;
use satphot::report::summary::text_table;
use satphot::tables::{CheckedRow, Meta, MetaValue, csv_text, write_rows};

use super::orbit_args::{SiteArg, bad};
use super::{print, tell};

const AFTER_HELP: &str = "\
The table is CSV with a row of names; lines that begin with # are comments. It needs the columns
target (name or number), and time_utc, or time_local with zone (or --zone). These are checked if present:
moon_illum_pct, sun_alt_deg, label (Day, Twilight, Night), max_v_mag, median_v_mag.

Times: 2025-06-08 20:33, or 08-06-25 20:33 (day-month-year). Zones: UTC, an offset such as +10:00,
AEST, AEDT, Australia/Sydney.

  time_local,zone,target,moon_illum_pct,sun_alt_deg,label
  2025-06-08 20:33,+10:00,ISS,91,-44,Night

A row cannot be true if its satellite has no pass above --min-alt within --time-err-min of its time;
then the dates around it are searched for a pass at that time of day. Without a file the paper's own
table of passes is checked. Elements of the ISS and the CSS of June 2025 are built in.

Examples:
  satphot check-table
  satphot check-table my_passes.csv --elements css.tle --site -33.77,151.11,70 --csv";

/// Checks a table of passes: Sun, Moon and satellite at the stated times, and what would make a wrong row true.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct CheckTable {
    /// Table of passes (CSV) [default: the paper's own]
    file: Option<PathBuf>,
    /// Elements, instead of those built in: TLE, 3LE or OMM (repeatable)
    #[arg(long, value_name = "FILE")]
    elements: Vec<PathBuf>,
    #[command(flatten)]
    place: SiteArg,
    /// Zone of local times in rows without one
    #[arg(long, value_name = "ZONE", allow_hyphen_values = true, value_parser = Zone::from_text)]
    zone: Option<Zone>,
    /// Error of the stated times [min]
    #[arg(long, value_name = "MIN", default_value_t = 10.0, allow_hyphen_values = true)]
    time_err_min: f64,
    /// Passes reach at least this altitude [deg]
    #[arg(long, value_name = "DEG", default_value_t = 10.0, allow_hyphen_values = true)]
    min_alt: f64,
    /// Error of the stated share of the Moon that is lit [%]
    #[arg(long, value_name = "PCT", default_value_t = 1.0, allow_hyphen_values = true)]
    moon_err_pct: f64,
    /// Error of the stated altitude of the Sun, besides its motion in --time-err-min [deg]
    #[arg(long, value_name = "DEG", default_value_t = 1.0, allow_hyphen_values = true)]
    sun_err_deg: f64,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    /// Table to write (.ecsv; repeatable)
    #[arg(short, long, value_name = "FILE.ecsv")]
    out: Vec<PathBuf>,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

impl CheckTable {
    pub fn execute(self) -> anyhow::Result<()> {
        let tolerances = self.tolerances()?;
        if let Some(wrong) = self.out.iter().find(|p| !p.extension().is_some_and(|e| e.eq_ignore_ascii_case("ecsv"))) {
            return Err(bad("--out", format!("{} does not end in .ecsv; --csv prints CSV", wrong.display())));
        }
        let place = self.site()?;
        let site = Site::from_config(&place)?;
        let (rows, unread) = match &self.file {
            Some(file) => read_passes(file, self.zone)?,
            None => parse_passes(Path::new("the paper's table of passes"), PAPER_PASSES, self.zone)?,
        };
        if !unread.is_empty() && !self.quiet {
            tell(&format!("note: columns not read: {}", unread.join(", ")));
        }
        let targets = Targets::new(&self.elements, &site)?;
        let checked = check_passes(&rows, &site, &targets, &tolerances)?;
        let file_rows: Vec<CheckedRow> = checked.iter().map(CheckedPass::file_row).collect();
        let meta = meta(&place, &tolerances);
        self.out.iter().try_for_each(|path| write_rows(path, &file_rows, &meta))?;
        if self.csv {
            print(&csv_text(&file_rows)?);
        } else {
            print(&text(&checked));
        }
        for file in self.out.iter().filter(|_| !self.quiet) {
            tell(&format!("wrote {}", file.display()));
        }
        Ok(())
    }

    /// The site of the command line, else the paper's, with a note.
    fn site(&self) -> anyhow::Result<SiteConfig> {
        if let Some(site) = self.place.given()? {
            return Ok(site);
        }
        let text = "preset = \"macquarie-cdk24\"\n[night]\nname = \"none\"\ninput = [\".\"]\noutput = \".\"\n";
        let site = Config::from_text(text, &[])?.site;
        if self.file.is_some() && !self.quiet {
            tell(&format!("note: site {}, {} {} deg; --site names another", site.name, site.lat_deg, site.lon_deg));
        }
        Ok(site)
    }

    fn tolerances(&self) -> anyhow::Result<Tolerances> {
        for (key, value, high) in [
            ("--time-err-min", self.time_err_min, 600.0),
            ("--min-alt", self.min_alt, 90.0),
            ("--moon-err-pct", self.moon_err_pct, 100.0),
            ("--sun-err-deg", self.sun_err_deg, 90.0),
        ] {
            if !(0.0..=high).contains(&value) {
                return Err(bad(key, format!("{value} is outside 0 to {high}")));
            }
        }
        Ok(Tolerances {
            time_s: 60.0 * self.time_err_min,
            moon_pct: self.moon_err_pct,
            sun_deg: self.sun_err_deg,
            min_alt_deg: self.min_alt,
        })
    }
}

fn meta(site: &SiteConfig, tolerances: &Tolerances) -> Meta {
    let mut meta = Meta::default();
    meta.push("schema", "satphot.checked_passes/1");
    meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
    meta.push("time_scale", "UTC");
    let place = [("lat_deg", site.lat_deg), ("lon_deg", site.lon_deg), ("alt_m", site.alt_m)];
    meta.push("site", MetaValue::Map(place.map(|(k, v)| (k.to_owned(), v.into())).to_vec()));
    let off = [
        ("time_s", tolerances.time_s),
        ("moon_pct", tolerances.moon_pct),
        ("sun_deg", tolerances.sun_deg),
        ("min_alt_deg", tolerances.min_alt_deg),
    ];
    meta.push("tolerances", MetaValue::Map(off.map(|(k, v)| (k.to_owned(), v.into())).to_vec()));
    meta
}

/// The rows, and below them what is wrong with which.
fn text(checked: &[CheckedPass]) -> String {
    let head = [
        "time",
        "target",
        "verdict",
        "sun alt",
        "moon %",
        "moon alt",
        "phase",
        "moon V",
        "alt",
        "pass (UTC)",
        "pass alt",
        "range km",
        "label",
    ];
    let rows = checked.iter().map(|c| {
        let row = c.file_row();
        let number = |v: Option<f64>, decimals: usize| v.map_or(String::new(), |v| format!("{v:.decimals$}"));
        vec![
            row.time,
            row.target,
            row.verdict,
            number(Some(row.sun_alt_deg), 1),
            number(Some(row.moon_illum_pct), 1),
            number(Some(row.moon_alt_deg), 1),
            number(Some(row.moon_phase_deg), 1),
            number(Some(row.moon_v_mag), 2),
            number(row.alt_deg, 1),
            row.pass_utc,
            number(row.pass_alt_deg, 1),
            number(row.pass_range_km, 0),
            row.paper_label,
        ]
    });
    let mut text = text_table(&head, &rows.collect::<Vec<_>>());
    for c in checked.iter().filter(|c| !c.remarks.is_empty()) {
        text.push_str(&format!(
            "\nline {}, {} {}: {}\n",
            c.stated.line,
            c.stated.time,
            c.stated.target,
            c.standing.text()
        ));
        c.remarks.iter().for_each(|remark| text.push_str(&format!("  {remark}\n")));
        c.remedy.iter().for_each(|remedy| text.push_str(&format!("  would be true: {remedy}\n")));
    }
    let cannot = checked.iter().filter(|c| c.standing == Standing::CannotBe).count();
    text.push_str(&format!("\n{} rows, {cannot} cannot be true\n", checked.len()));
    text
}
