//! `satphot plot ground`: a satellite's track over the ground, and the points under Sun and Moon.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::base::time::{iso_utc, parse_utc, shifted};
use satphot::config::{Orbit, Site};
use satphot::figures::{GroundMap, ground_map};
use satphot::orbit::ground_track::{altitude_deg, point_under, terminator};
use satphot::orbit::{EarthOrientation, Tracker, bodies};
use satphot::report::summary::text_table;
use satphot::tables::{Meta, TrackRow, csv_text, write_rows};
use satphot::visibility::earth_tables::place_text;

use super::super::orbit_args::{MAX_AGE_D, SiteArg, bad, elements_there};
use super::super::predict::OutArgs;
use super::super::{print, tell};

/// Points of each terminator.
const TERMINATOR: usize = 360;
/// Longest step of the line drawn [s]: a low orbit moves two degrees in it.
const STEP_S: f64 = 30.0;

const AFTER_HELP: &str = "\
The map shows the moment of --time: day, twilight and night, where the Moon is up, the points
under Sun and Moon and the lines on which they set (centres, no refraction). The track runs
half of --span-min before and after; arrows point the way of the satellite. A file that ends
in .png holds the map alone, without axes and words.

Examples:
  satphot plot ground --elements iss.tle --time 2025-06-09T10:33:00 --site -33.77,151.11,70 -o map.svg
  satphot plot ground --elements iss.tle --time 2025-06-09T10:33:00 --span-min 20 --csv";

/// Ground track of a satellite with the points under Sun and Moon.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Ground {
    /// Elements: TLE, 3LE, or OMM in JSON, CSV, KVN or XML
    #[arg(long, visible_alias = "tle", value_name = "FILE")]
    elements: PathBuf,
    /// Catalogue number, when the file holds several objects
    #[arg(long, value_name = "NUMBER")]
    norad: Option<u64>,
    /// Moment of the map, UTC
    #[arg(long, value_name = "UTC")]
    time: String,
    /// Length of the track [min]
    #[arg(long, value_name = "MIN", default_value_t = 93.0, allow_hyphen_values = true)]
    span_min: f64,
    /// Rows of the table
    #[arg(long, value_name = "N", default_value_t = 32)]
    rows: usize,
    /// Use elements older than 14 d, or contradicted by others, all the same
    #[arg(long)]
    force_age: bool,
    #[command(flatten)]
    place: SiteArg,
    /// Print comma-separated values instead of a table
    #[arg(long)]
    csv: bool,
    #[command(flatten)]
    out: OutArgs,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
}

impl Ground {
    pub fn execute(self) -> anyhow::Result<()> {
        if !(self.span_min > 0.0 && self.span_min <= 2_880.0) {
            return Err(bad("--span-min", format!("{} is not above 0 and at most 2880 min", self.span_min)));
        }
        if !(2..=100_000).contains(&self.rows) {
            return Err(bad("--rows", format!("{} is outside 2 to 100000", self.rows)));
        }
        let epoch = parse_utc("--time", &self.time)?;
        elements_there(&self.elements, self.norad, None)?;
        let site = self.place.given()?;
        let nowhere = || Site { name: String::new(), lat_deg: 0.0, lon_deg: 0.0, alt_m: 0.0 };
        let orbit = Orbit {
            elements: self.elements.clone(),
            norad_cat_id: self.norad,
            max_age_d: MAX_AGE_D,
            force_age: self.force_age,
            ut1_utc_s: None,
            xp_arcsec: 0.0,
            yp_arcsec: 0.0,
        };
        let eop = EarthOrientation::default();
        let tracker = Tracker::from_config(&orbit, &site.clone().unwrap_or_else(nowhere))?;
        tracker.elements_at(&epoch).map_err(by_argument)?;
        let row = |after_s: f64| -> anyhow::Result<TrackRow> {
            let at = shifted(epoch, after_s);
            let g = tracker.at(&at).map_err(by_argument)?;
            let (lon_deg, lat_deg, height_km) = point_under(&g.satellite_itrs_km)
                .ok_or_else(|| Error::Orbit { problem: "the satellite is at the Earth's centre".into() })?;
            Ok(TrackRow {
                date: iso_utc(at, 0),
                lon_deg,
                lat_deg,
                height_km,
                sun_alt_deg: altitude_deg(lon_deg, lat_deg, &g.sun_itrs_km)?,
                moon_alt_deg: altitude_deg(lon_deg, lat_deg, &g.moon_itrs_km)?,
            })
        };
        let half_s = 30.0 * self.span_min;
        let at = |i: usize, n: usize| -half_s + 2.0 * half_s * i as f64 / (n - 1) as f64;
        let rows = (0..self.rows).map(|i| row(at(i, self.rows))).collect::<anyhow::Result<Vec<_>>>()?;
        print(&if self.csv { csv_text(&rows)? } else { table(&rows) });
        let sky = bodies(&epoch, &eop)?;
        let under = |km| point_under(km).map_or((0.0, 0.0), |(lon, lat, _)| (lon, lat));
        let under_deg = [under(&sky.sun_itrs_km), under(&sky.moon_itrs_km)];
        let name = tracker.elements_at(&epoch)?.name().to_string();
        let (tables, figures) = self.out.files_of("ground", &["svg", "png"])?;
        let meta = self.meta(&name, under_deg);
        tables.iter().try_for_each(|path| write_rows(path, &rows, &meta))?;
        if !figures.is_empty() {
            let n = (2.0 * half_s / STEP_S).ceil().max(2.0) as usize + 1;
            let fine = (0..n).map(|i| row(at(i, n))).collect::<anyhow::Result<Vec<_>>>()?;
            let now = row(0.0)?;
            let map = GroundMap {
                title: format!("{name}, {}", iso_utc(epoch, 0)),
                sun_km: sky.sun_itrs_km,
                moon_km: sky.moon_itrs_km,
                under_deg,
                terminators_deg: [
                    terminator(&sky.sun_itrs_km, TERMINATOR)?,
                    terminator(&sky.moon_itrs_km, TERMINATOR)?,
                ],
                track_deg: fine.iter().map(|r| (r.lon_deg, r.lat_deg)).collect(),
                satellite: Some((name.clone(), (now.lon_deg, now.lat_deg))),
                site: site.map(|s| ("observer".to_owned(), (s.lon_deg, s.lat_deg))),
            };
            figures.iter().try_for_each(|path| ground_map(path, &map))?;
        }
        if !self.quiet {
            tell(&format!(
                "note: at {} the Sun is in the zenith at {}, the Moon at {}",
                iso_utc(epoch, 0),
                place_text(under_deg[0].0, under_deg[0].1, 2),
                place_text(under_deg[1].0, under_deg[1].1, 2),
            ));
            if let Some(warning) = tracker.age_warning(&epoch) {
                tell(&format!("note: {warning}"));
            }
            for file in tables.iter().chain(&figures) {
                tell(&format!("wrote {}", file.display()));
            }
        }
        Ok(())
    }

    fn meta(&self, name: &str, under_deg: [(f64, f64); 2]) -> Meta {
        let mut meta = Meta::default();
        meta.push("schema", "satphot.ground_track/1");
        meta.push("tool", concat!("satphot ", env!("CARGO_PKG_VERSION")));
        meta.push("time_scale", "UTC");
        meta.push("object_name", name);
        meta.push("orbit_source", self.elements.display().to_string());
        for (body, (lon, lat)) in ["sun", "moon"].iter().zip(under_deg) {
            meta.push(&format!("sub_{body}_lon_deg"), lon);
            meta.push(&format!("sub_{body}_lat_deg"), lat);
        }
        meta
    }
}

/// The remedy of a refusal as this verb knows it: it has no configuration.
fn by_argument(error: Error) -> Error {
    match error {
        Error::Orbit { problem } => {
            Error::Orbit { problem: problem.replace("set orbit.force_age = true", "give --force-age") }
        }
        other => other,
    }
}

fn table(rows: &[TrackRow]) -> String {
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|r| {
            vec![
                r.date.clone(),
                format!("{:.2}", r.lon_deg),
                format!("{:.2}", r.lat_deg),
                format!("{:.1}", r.height_km),
                format!("{:.1}", r.sun_alt_deg),
                format!("{:.1}", r.moon_alt_deg),
            ]
        })
        .collect();
    text_table(&["UTC", "lon [deg E]", "lat [deg N]", "height [km]", "Sun alt [deg]", "Moon alt [deg]"], &cells)
}
