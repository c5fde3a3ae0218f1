//! `satphot predict sky --sequence`: maps of the sky every few hours of one or more days, on one sheet and in one table.

use clap::Args;
use csv::StringRecord;
use hifitime::Epoch;
use satphot::base::time::{iso_utc, mjd_utc, parse_utc, shifted};
use satphot::figures::{SkyMark, SkyPanel};
use satphot::tables::{SkyRow, csv_text};

use super::super::orbit_args::bad;

/// Maps through a day.
#[derive(Debug, Clone, Args)]
pub struct SequenceArgs {
    /// Maps every H hours for a day from --time on (with --time)
    #[arg(long, value_name = "H", requires = "time", conflicts_with_all = ["flux", "explain"], allow_hyphen_values = true)]
    sequence: Option<f64>,
    /// First moment of a further day, UTC (repeatable)
    #[arg(long, value_name = "UTC", requires = "sequence")]
    also: Vec<String>,
}

impl SequenceArgs {
    /// Maps of many moments are wanted.
    pub fn is_wanted(&self) -> bool {
        self.sequence.is_some()
    }

    /// The moments, a row per day.
    pub fn moments(&self, first: &str) -> anyhow::Result<Vec<Vec<Epoch>>> {
        let every_h = self.sequence.unwrap_or(24.0);
        if !(0.1..=24.0).contains(&every_h) {
            return Err(bad("--sequence", format!("{every_h} h is outside 0.1 to 24")));
        }
        let count = (24.0 / every_h - 1e-9).ceil().max(1.0) as usize;
        let day = |(key, text): (&str, &str)| -> anyhow::Result<Vec<Epoch>> {
            let from = parse_utc(key, text)?;
            Ok((0..count).map(|k| shifted(from, 3600.0 * every_h * k as f64)).collect())
        };
        let starts = std::iter::once(("--time", first)).chain(self.also.iter().map(|t| ("--also", t.as_str())));
        starts.map(day).collect()
    }
}

/// One map of a sequence.
pub struct SkyOfMoment {
    pub epoch: Epoch,
    pub rows: Vec<SkyRow>,
    pub marks: Vec<SkyMark>,
}

impl SkyOfMoment {
    /// Its panel of the figure.
    pub fn panel(&self) -> SkyPanel {
        let label = iso_utc(self.epoch, 0).chars().take(16).collect::<String>().replace('T', " ");
        SkyPanel { label: format!("{label} UTC"), rows: self.rows.clone(), marks: self.marks.clone() }
    }

    /// Its line of the summary: median and 16 to 84 % of the rows as they are, lit share, Sun and Moon.
    pub fn line(&self, spread: &str, lit: f64) -> Vec<String> {
        let alt = |name: &str| {
            let mark = self.marks.iter().find(|m| m.name == name);
            mark.map_or(String::new(), |m| format!("{:.1}", m.alt_deg))
        };
        vec![
            iso_utc(self.epoch, 0).chars().take(16).collect(),
            alt("Sun"),
            alt("Moon"),
            format!("{:.0}", 100.0 * lit),
            spread.to_string(),
        ]
    }
}

/// The cells of all maps under the columns of a sequence.
pub fn cells(skies: &[SkyOfMoment]) -> anyhow::Result<Vec<StringRecord>> {
    let mut all = Vec::new();
    for sky in skies {
        let text = csv_text(&sky.rows)?;
        for record in csv::Reader::from_reader(text.as_bytes()).records() {
            let moment = [iso_utc(sky.epoch, 0), mjd_utc(sky.epoch).to_string()];
            let record = record?;
            all.push(moment.iter().map(String::as_str).chain(record.iter()).collect());
        }
    }
    Ok(all)
}
