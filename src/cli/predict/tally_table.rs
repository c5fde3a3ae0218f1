//! The table of a constellation: one row per moment, written, printed, read back and added up.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use csv::StringRecord;
use satphot::Error;
use satphot::base::time::{iso_utc, mjd_utc};
use satphot::report::summary::text_table;
use satphot::tables::{Column, constellation_columns, csv_of_cells};
use satphot::visibility::forecast::constellation::SkyMoment;
use satphot::visibility::forecast::tally::Tally;

/// One moment.
pub struct MomentTally {
    date_mid: String,
    mjd_mid_d: String,
    sun_alt_deg: String,
    moon_alt_deg: String,
    tally: Tally,
}

/// All moments.
pub struct Table {
    pub magnitudes: Vec<f64>,
    pub moments: Vec<MomentTally>,
}

impl MomentTally {
    pub fn new(moment: &SkyMoment, tally: Tally) -> Self {
        Self {
            date_mid: iso_utc(moment.epoch, 0),
            mjd_mid_d: mjd_utc(moment.epoch).to_string(),
            sun_alt_deg: format!("{:.6}", moment.sun_alt_rad.to_degrees()),
            moon_alt_deg: format!("{:.6}", moment.moon_alt_rad.to_degrees()),
            tally,
        }
    }

    /// The cells of its row.
    fn cells(&self) -> Vec<String> {
        let t = &self.tally;
        let mag = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.2}"));
        let counts = [t.n_satellites, t.failed, t.above_horizon, t.above_min_alt, t.lit].into_iter().chain(t.lit_by);
        let mut cells =
            vec![self.date_mid.clone(), self.mjd_mid_d.clone(), self.sun_alt_deg.clone(), self.moon_alt_deg.clone()];
        cells.extend(counts.map(|n| n.to_string()));
        cells.push(t.brightest.map_or(String::new(), |b| b.0.to_string()));
        cells.extend(t.brighter.iter().map(u64::to_string));
        cells.push(t.brightest.map_or(String::new(), |b| b.1.to_string()));
        cells.extend([0.5, 0.16, 0.84].map(|share| mag(t.quantile(share))));
        cells.push(if t.lit > 0 { t.err_mag.to_string() } else { String::new() });
        cells.push(t.pred_err_mag.map_or(String::new(), |err| err.to_string()));
        cells.push(t.histogram_text());
        cells
    }
}

impl Table {
    /// Its columns.
    pub fn columns(&self) -> Vec<Column> {
        constellation_columns(&self.magnitudes)
    }

    pub fn records(&self) -> Vec<StringRecord> {
        self.moments.iter().map(|m| StringRecord::from(m.cells())).collect()
    }

    pub fn csv(&self) -> anyhow::Result<String> {
        Ok(csv_of_cells(&self.columns(), &self.records())?)
    }

    /// The counts, without histogram and what reads as a date anyway.
    pub fn text(&self) -> String {
        let brighter: Vec<String> = self.magnitudes.iter().map(|m| format!("V < {m}")).collect();
        let mut head =
            vec!["UTC", "Sun deg", "Moon deg", "up", "counted", "lit", "Sun", "Earthshine", "Moon", "Lunar-E."];
        head.extend(brighter.iter().map(String::as_str));
        head.extend(["brightest", "median V", "16 %", "84 %"]);
        let short = |text: &str| text.parse::<f64>().map_or(String::new(), |v| format!("{v:.1}"));
        let mag = |v: Option<f64>| v.map_or("-".into(), |v| format!("{v:.2}"));
        let line = |m: &MomentTally| {
            let t = &m.tally;
            let mut cells: Vec<String> =
                vec![m.date_mid.chars().take(16).collect(), short(&m.sun_alt_deg), short(&m.moon_alt_deg)];
            let counts = [t.above_horizon, t.above_min_alt, t.lit].into_iter().chain(t.lit_by);
            cells.extend(counts.chain(t.brighter.iter().copied()).map(|n| n.to_string()));
            cells.push(mag(t.brightest.map(|b| b.0)));
            cells.extend([0.5, 0.16, 0.84].map(|share| mag(t.quantile(share))));
            cells
        };
        text_table(&head, &self.moments.iter().map(line).collect::<Vec<_>>())
    }
}

/// Adds tables of shards: the same moments and magnitudes in each.
pub fn add(paths: &[PathBuf]) -> anyhow::Result<Table> {
    let mut whole: Option<Table> = None;
    for path in paths {
        let part = read(path)?;
        match &mut whole {
            None => whole = Some(part),
            Some(whole) => {
                let same = whole.magnitudes == part.magnitudes
                    && whole.moments.len() == part.moments.len()
                    && whole.moments.iter().zip(&part.moments).all(|(a, b)| a.date_mid == b.date_mid);
                if !same {
                    let problem = "its moments or magnitudes are not those of the first table".to_string();
                    return Err(Error::Table { path: path.clone(), line: None, problem }.into());
                }
                for (a, b) in whole.moments.iter_mut().zip(&part.moments) {
                    a.tally.add(&b.tally);
                }
            }
        }
    }
    let empty = Table { magnitudes: Vec::new(), moments: Vec::new() };
    Ok(whole.unwrap_or(empty))
}

/// Reads a table that was written before.
fn read(path: &Path) -> anyhow::Result<Table> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
    let problem = |line: Option<usize>, problem: String| Error::Table { path: path.into(), line, problem };
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let head = reader.headers().map_err(|e| problem(None, e.to_string()))?.clone();
    let brighter: Vec<&str> = head.iter().filter(|name| name.starts_with("n_brighter_")).collect();
    let magnitudes: Vec<f64> =
        brighter.iter().filter_map(|name| name.trim_start_matches("n_brighter_").parse().ok()).collect();
    let mut moments = Vec::new();
    for record in reader.deserialize::<HashMap<String, String>>() {
        let row = record.map_err(|e| problem(e.position().map(|p| p.line() as usize), e.to_string()))?;
        let line = Some(moments.len() + 1);
        let cell = |name: &str| {
            row.get(name).cloned().ok_or_else(|| {
                problem(
                    line,
                    format!(
                        "column {name} is missing; is it a table of \
                 `satphot predict constellation`?"
                    ),
                )
            })
        };
        let whole = |name: &str| -> Result<u64, Error> {
            let text = cell(name)?;
            text.parse().map_err(|_| problem(line, format!("column {name}: `{text}` is not a count")))
        };
        let mut tally = Tally::new(magnitudes.len());
        (tally.n_satellites, tally.failed) = (whole("n_satellites")?, whole("n_failed")?);
        (tally.above_horizon, tally.above_min_alt) = (whole("n_above_horizon")?, whole("n_above_min_alt")?);
        tally.lit = whole("n_lit")?;
        tally.lit_by = [whole("n_sun")?, whole("n_earthshine")?, whole("n_moon")?, whole("n_lunar_earthshine")?];
        for (count, name) in tally.brighter.iter_mut().zip(&brighter) {
            *count = whole(name)?;
        }
        tally.brightest = cell("brightest_v_mag")?.parse().ok().zip(cell("brightest_number")?.parse().ok());
        tally.err_mag = cell("model_err_mag")?.parse().unwrap_or(0.0);
        tally.pred_err_mag = cell("v_pred_err_mag")?.parse().ok();
        let counts = cell("histogram")?;
        let tally =
            tally.with_histogram(&counts).ok_or_else(|| problem(line, "its histogram cannot be read".into()))?;
        moments.push(MomentTally {
            date_mid: cell("date_mid")?,
            // a table pads its digits
            mjd_mid_d: cell("mjd_mid_d")?.parse::<f64>().map_or(String::new(), |mjd| mjd.to_string()),
            sun_alt_deg: cell("sun_alt_deg")?,
            moon_alt_deg: cell("moon_alt_deg")?,
            tally,
        });
    }
    Ok(Table { magnitudes, moments })
}
