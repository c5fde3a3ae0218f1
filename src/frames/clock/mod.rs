//! The middle of an exposure, from whatever the camera's software wrote.
//!
//! Times as [`hifitime::Epoch`]; seconds. The first stamp that is present and agrees with the exposure time wins; what
//! was turned down is kept with its reason. Never used: the file's date, and DATE (when the file was written).

mod candidate;
mod candidates;
mod meaning;
mod stamp;
#[cfg(test)]
mod tests;

pub use candidate::TimeKind;

use candidate::{seconds, zone_hint};
use std::path::Path;

use hifitime::{Epoch, TimeScale};

use super::header::Aliases;
use crate::base::error::{Error, Result};
use crate::config;
use crate::fits::cards::Header;
use crate::tables::words::TimeStamp;
use candidates::Finder;

pub(super) use candidates::span_s;

/// Middle of an exposure, and how it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct MidTime {
    /// Middle of the exposure (UTC).
    pub mid: Epoch,
    /// Keywords and meaning, e.g. `DATE-OBS + EXPTIME/2`.
    pub source: String,
    /// The kind of stamp.
    pub kind: TimeKind,
    /// Which moment of the exposure the stamp marks.
    pub stamp: TimeStamp,
    /// Error \[s\].
    pub err_s: f64,
    /// The header's own middle (DATE-AVG and its like) minus start + EXPTIME/2 \[s\]; `None` where it lacks one of them.
    pub avg_minus_mid_s: Option<f64>,
    /// What was present but not used, each with its reason.
    pub rejected: Vec<String>,
    /// Notes for the observer: stamps that contradict each other, programs with known latencies.
    pub warnings: Vec<String>,
}

/// Stamps further apart than their errors (times 3) and this contradict each other \[s\].
const CONTRADICTION_S: f64 = 2.0;

/// A second stamp this long after the end of the exposure is that of the file (APT's JD) \[s\].
const SAVED_S: f64 = 15.0;

/// Finds the middle of an exposure of `exptime_s` seconds.
///
/// Precedence: the configuration's `date_obs_means` and own keywords; GPS shutter times; start and end; middle;
/// start + EXPTIME/2 (or what the comment of the card says). TIMESYS may be UTC, TAI, TT or GPS. `config.offset_s` is
/// added to all.
///
/// # Errors
/// [`Error::Header`] if no stamp is usable, with everything that was tried, or if start and end span several exposures.
pub fn mid_time(
    header: &Header,
    exptime_s: f64,
    config: &config::Time,
    aliases: &Aliases,
    path: &Path,
) -> Result<MidTime> {
    let scale = stamp::time_scale(header, path)?;
    let own = aliases.get("date_obs").map(Vec::as_slice).unwrap_or_default();
    let mut finder = Finder::new(header, scale, exptime_s);
    finder.collect(own, config.date_obs_means);
    let Finder { found, mut rejected, mut warnings, several, .. } = finder;
    if let Some((keyword, problem)) = several {
        return Err(Error::Header { path: path.to_path_buf(), keyword, problem });
    }
    let mid_of = |kind| found.iter().find(|c| c.kind == kind).map(|c| c.mid);
    let avg_minus_mid_s =
        mid_of(TimeKind::Middle).zip(mid_of(TimeKind::Start)).map(|(avg, mid)| (avg - mid).to_seconds());
    let mut found = found.into_iter();
    let Some(best) = found.next() else {
        let tried = if rejected.is_empty() { "none is present".to_string() } else { rejected.join("; ") };
        return Err(Error::Header {
            path: path.to_path_buf(),
            keyword: "DATE-OBS (DATE-AVG, DATE-BEG, MJD-OBS, ...)".into(),
            problem: format!("no usable time: {tried}; name your keyword in header.aliases.date_obs"),
        });
    };
    for other in found {
        let off_s = (other.mid - best.mid).to_seconds();
        if (0.5 * exptime_s..exptime_s + SAVED_S).contains(&off_s) && off_s > CONTRADICTION_S {
            rejected.push(format!("{}: stamped {off_s:.3} s late, when the frame was read or saved", other.source));
            continue;
        }
        rejected.push(format!("{}: not needed, {off_s:+.3} s from the time used", other.source));
        if off_s.abs() > CONTRADICTION_S.max(3.0 * (best.err_s + other.err_s)) {
            warnings.push(format!(
                "{} and {} contradict each other by {off_s:+.1} s{}",
                best.source,
                other.source,
                zone_hint(off_s)
            ));
        }
    }
    if let Some(written) = header.text("DATE") {
        rejected.push(format!("DATE = '{written}': by the standard when the file was written, never used"));
    }
    let offset = if config.offset_s == 0.0 { String::new() } else { format!(", offset {} s", config.offset_s) };
    Ok(MidTime {
        mid: (best.mid + seconds(config.offset_s)).to_time_scale(TimeScale::UTC),
        source: format!("{}{offset}", best.source),
        kind: best.kind,
        stamp: best.stamp,
        err_s: config.err_s.unwrap_or(best.err_s),
        avg_minus_mid_s,
        rejected,
        warnings,
    })
}
