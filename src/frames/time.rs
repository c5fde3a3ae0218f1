//! The middle of an exposure, from whatever the camera's software wrote.
//!
//! Times as [`hifitime::Epoch`]; seconds. The first stamp that is present and agrees with the exposure time wins; what
//! was turned down is kept with its reason. Never used: the file's date, and DATE (when the file was written).

use std::collections::BTreeMap;
use std::path::Path;

use hifitime::{Duration, Epoch, TimeScale, Unit};

use super::cards::Header;
use super::stamp::{self, Stamp};
use crate::config::{self, DateObsMeans};
use crate::error::{Error, Result};

/// Middle of an exposure, and how it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct MidTime {
    /// Middle of the exposure (UTC).
    pub mid: Epoch,
    /// Keywords and meaning, e.g. `DATE-OBS + EXPTIME/2`.
    pub source: String,
    /// Error \[s\].
    pub err_s: f64,
    /// What was present but not used, each with its reason.
    pub rejected: Vec<String>,
}

/// Start and end of the exposure, in order of preference. Sources: FITS 4.0 section 4.4.2.1; N.I.N.A. (QHY and
/// ToupTek GPS cards); LCO and Subaru headers.
const PAIRS: [(&str, &str, f64); 10] = [
    ("GPS_SUTC", "GPS_EUTC", 0.001),
    ("GPS_ST", "GPS_ET", 0.001),
    ("DATE-BEG", "DATE-END", 0.1),
    ("DATE-OBS", "DATE-END", 0.1),
    ("MJD-BEG", "MJD-END", 0.1),
    ("MJD-STR", "MJD-END", 0.1),
    ("MJD-OBS", "MJD-END", 0.1),
    ("DATE-OBS", "UTSTOP", 0.1),
    ("DATE-OBS", "END-OBS", 0.1),
    ("DATE-OBS", "DATEEND", 0.1),
];
/// Middle of the exposure.
const MIDS: [&str; 7] = ["DATE-AVG", "DATEAVG", "DATE-MID", "MJD-AVG", "MJD-MID", "JD_UTC", "UTMIDDLE"];
/// Start of the exposure.
const STARTS: [&str; 8] =
    ["DATE-BEG", "DATE-OBS", "CAMERA-DATE-OBS", "DATE_OBS", "MJD-BEG", "MJD-OBS", "MJD-STR", "JD"];
/// Time of day beside a DATE-OBS that has only a date.
const TIMES_OF_DAY: [&str; 8] = ["TIME-OBS", "TIME-BEG", "UTSTART", "UTC-OBS", "UT-STR", "UTSHUT", "UTC", "UT"];

/// Finds the middle of an exposure of `exptime_s` seconds.
///
/// Precedence: the configuration's `date_obs_means`; GPS shutter times; start and end; middle; start + EXPTIME/2 (or
/// what the comment of the card says). TIMESYS may be UTC, TAI, TT or GPS. `config.offset_s` is added to all.
///
/// # Errors
/// [`Error::Header`] if no stamp is usable, with everything that was tried.
pub fn mid_time(
    header: &Header,
    exptime_s: f64,
    config: &config::Time,
    aliases: &BTreeMap<String, Vec<String>>,
    path: &Path,
) -> Result<MidTime> {
    let scale = stamp::time_scale(header, path)?;
    let mut finder = Finder { header, scale, exptime_s, rejected: Vec::new() };
    let own = aliases.get("date_obs").map(Vec::as_slice).unwrap_or_default();
    let found = match config.date_obs_means {
        DateObsMeans::Header => {
            finder.aliased(own).or_else(|| finder.pairs()).or_else(|| finder.mids()).or_else(|| finder.starts())
        }
        means => finder.as_configured(own, means),
    };
    finder.note_local_time();
    let Some((mid, source, err_s)) = found else {
        let tried = if finder.rejected.is_empty() { "none is present".to_string() } else { finder.rejected.join("; ") };
        return Err(Error::Header {
            path: path.to_path_buf(),
            keyword: "DATE-OBS (DATE-AVG, DATE-BEG, MJD-OBS, ...)".into(),
            problem: format!("no usable time: {tried}; name your keyword in frames.aliases.date_obs"),
        });
    };
    let offset = if config.offset_s == 0.0 { String::new() } else { format!(", offset {} s", config.offset_s) };
    Ok(MidTime {
        mid: (mid + seconds(config.offset_s)).to_time_scale(TimeScale::UTC),
        source: format!("{source}{offset}"),
        err_s: config.err_s.unwrap_or(err_s),
        rejected: finder.rejected,
    })
}

fn seconds(s: f64) -> Duration {
    s * Unit::Second
}

/// A middle with its source and error.
type Found = (Epoch, String, f64);

struct Finder<'a> {
    header: &'a Header,
    scale: TimeScale,
    exptime_s: f64,
    rejected: Vec<String>,
}

impl Finder<'_> {
    /// Reads a stamp; an unreadable one is noted. A date alone is completed by a time of day.
    fn stamp(&mut self, key: &str) -> Option<Stamp> {
        let text = self.header.text(key)?;
        let days = key.starts_with("MJD") || key.starts_with("JD");
        let parsed = if days { stamp::parse_days(key, &text, self.scale) } else { self.parse_date(key, &text) };
        match parsed {
            Ok(stamp) => Some(stamp),
            Err(why) => {
                let note = format!("{key} = '{text}': {why}");
                if !self.rejected.contains(&note) {
                    self.rejected.push(note);
                }
                None
            }
        }
    }

    fn parse_date(&self, key: &str, text: &str) -> std::result::Result<Stamp, String> {
        if stamp::is_time_of_day(text) {
            // UTSTOP and UTMIDDLE carry no date: the one of DATE-OBS, or the day after.
            let start = self.header.text("DATE-OBS").ok_or("a time of day without DATE-OBS")?;
            return stamp::parse_time_after(&start, text, self.scale);
        }
        if !stamp::is_date_only(text) {
            return stamp::parse(text, self.scale);
        }
        let time = TIMES_OF_DAY.iter().filter(|_| !key.contains("END")).find_map(|k| Some((k, self.header.text(k)?)));
        let (_, time) = time.ok_or("a date without a time of day")?;
        stamp::parse(&format!("{text}T{}", time.trim_end_matches('Z')), self.scale)
    }

    fn pairs(&mut self) -> Option<Found> {
        for (begin, end, err_s) in PAIRS {
            if self.header.text(begin).is_none() || self.header.text(end).is_none() {
                continue;
            }
            if begin.starts_with("GPS") && !self.gps_locked(begin) {
                continue;
            }
            let (Some(a), Some(b)) = (self.stamp(begin), self.stamp(end)) else { continue };
            let length_s = (b.epoch - a.epoch).to_seconds();
            // Read-out and rounding may add a little; a stack or a wrong card differs by far more.
            let allowed_s = 0.5 + a.resolution_s + b.resolution_s + 0.1 * self.exptime_s;
            if (length_s - self.exptime_s).abs() > allowed_s {
                let stack = if length_s > 1.5 * self.exptime_s { " (a stack of exposures?)" } else { "" };
                let note =
                    format!("{end} - {begin} = {length_s:.3} s, but the exposure is {} s{stack}", self.exptime_s);
                self.rejected.push(note);
                continue;
            }
            let half_gap_s = (length_s - self.exptime_s).abs() / 2.0;
            let err_s = f64::max(err_s, half_gap_s).max((a.resolution_s + b.resolution_s) / 4.0);
            return Some((a.epoch + (b.epoch - a.epoch) / 2, format!("({begin} + {end})/2"), err_s));
        }
        None
    }

    /// GPS stamps count only with a lock.
    fn gps_locked(&mut self, begin: &str) -> bool {
        for key in ["GPS_SST", "GPS_EST", "GPS_STAT"] {
            let Some(text) = self.header.text(key) else { continue };
            let low = text.to_ascii_lowercase();
            let lost = ["no", "un", "lost", "fail", "search", "init"].iter().any(|bad| low.contains(bad));
            if lost {
                let note = format!("{begin}: {key} = '{text}', no GPS lock");
                if !self.rejected.contains(&note) {
                    self.rejected.push(note);
                }
                return false;
            }
        }
        true
    }

    fn mids(&mut self) -> Option<Found> {
        for key in MIDS {
            let Some(mid) = self.stamp(key) else { continue };
            let start = ["DATE-OBS", "DATE-BEG"].iter().find_map(|k| {
                let text = self.header.text(k)?;
                self.parse_date(k, &text).ok()
            });
            let gap_s = start.map_or(0.0, |s| (mid.epoch - s.epoch).to_seconds() - self.exptime_s / 2.0);
            // N.I.N.A. writes the middle of its own clock readings, late by half the download.
            if gap_s.abs() > 10.0 + self.exptime_s {
                self.rejected.push(format!("{key}: {gap_s:.3} s away from DATE-OBS + EXPTIME/2"));
                continue;
            }
            return Some((mid.epoch, key.to_string(), f64::max(0.1, gap_s.abs()).max(mid.resolution_s / 2.0)));
        }
        None
    }

    fn starts(&mut self) -> Option<Found> {
        STARTS.iter().find_map(|key| {
            let stamp = self.stamp(key)?;
            let comment = self.header.comment(key).unwrap_or_default().to_ascii_lowercase();
            let means =
                if comment.contains("frame grabbed") || comment.contains("end of exp") || comment.contains("frame end")
                {
                    DateObsMeans::End // SharpCap before version 4 stamps the finished frame
                } else if comment.contains("mid point")
                    || comment.contains("midpoint")
                    || comment.contains("mid-exp")
                    || comment.contains("middle of")
                {
                    DateObsMeans::Mid
                } else {
                    DateObsMeans::Start
                };
            Some(self.meaning(key, stamp, means, if means == DateObsMeans::Start { "" } else { " by its comment" }))
        })
    }

    fn aliased(&mut self, own: &[String]) -> Option<Found> {
        own.iter().find_map(|key| {
            let stamp = self.stamp(key)?;
            Some(self.meaning(key, stamp, DateObsMeans::Start, ""))
        })
    }

    fn as_configured(&mut self, own: &[String], means: DateObsMeans) -> Option<Found> {
        let keys: Vec<&str> = own.iter().map(String::as_str).chain(STARTS).collect();
        keys.into_iter().find_map(|key| {
            let stamp = self.stamp(key)?;
            Some(self.meaning(key, stamp, means, " by time.date_obs_means"))
        })
    }

    /// Shifts a stamp to the middle of the exposure.
    fn meaning(&self, key: &str, stamp: Stamp, means: DateObsMeans, why: &str) -> Found {
        let half = seconds(self.exptime_s / 2.0);
        let (mid, text) = match means {
            DateObsMeans::Header | DateObsMeans::Start => (stamp.epoch + half, format!("{key} + EXPTIME/2{why}")),
            DateObsMeans::Mid => (stamp.epoch, format!("{key} as the middle{why}")),
            DateObsMeans::End => (stamp.epoch - half, format!("{key} - EXPTIME/2{why}")),
        };
        (mid, text, f64::max(0.5, stamp.resolution_s))
    }

    /// A local time that equals the "UTC" one is worth a word.
    fn note_local_time(&mut self) {
        let utc = self.header.text("DATE-OBS");
        for key in ["DATE-LOC", "LOCAL-DT"] {
            if utc.is_some() && self.header.text(key) == utc {
                self.rejected.push(format!("note: {key} equals DATE-OBS; was the computer's clock on UTC?"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mid(cards: &str, exptime_s: f64) -> Result<MidTime> {
        mid_time(&Header::from_text(cards), exptime_s, &config::Time::default(), &BTreeMap::new(), Path::new("x.fits"))
    }

    fn utc(text: &str) -> Epoch {
        stamp::parse(text, TimeScale::UTC).unwrap().epoch.to_time_scale(TimeScale::UTC)
    }

    fn close(t: &MidTime, text: &str) -> bool {
        (t.mid - utc(text)).abs() < seconds(2e-6)
    }

    #[test]
    fn a_start_time_gains_half_the_exposure() {
        let t = mid("DATE-OBS= '2025-06-09T10:33:00.500' / start", 5.0).unwrap();
        assert!(close(&t, "2025-06-09T10:33:03") && t.source == "DATE-OBS + EXPTIME/2" && t.err_s == 0.5, "{t:?}");
        assert_eq!(mid("DATE-OBS= '2018-07-04T14:03:03'", 300.0).unwrap().err_s, 1.0);
    }

    #[test]
    fn gps_beats_start_and_end_beats_the_middle_beats_the_start() {
        let start = "DATE-OBS= '2025-06-09T10:33:00.0'\n";
        let avg = format!("{start}DATE-AVG= '2025-06-09T10:33:02.6'\n");
        let end = format!("{avg}DATE-END= '2025-06-09T10:33:05.1'\n");
        let gps = format!("{end}GPS_SUTC= '2025-06-09T10:33:00.123'\nGPS_EUTC= '2025-06-09T10:33:05.123'\n");
        assert_eq!(mid(start, 5.0).unwrap().source, "DATE-OBS + EXPTIME/2");
        let t = mid(&avg, 5.0).unwrap();
        assert!(t.source == "DATE-AVG" && (t.err_s - 0.1).abs() < 1e-6);
        assert_eq!(mid(&end, 5.0).unwrap().source, "(DATE-OBS + DATE-END)/2");
        let t = mid(&gps, 5.0).unwrap();
        assert!(close(&t, "2025-06-09T10:33:02.623") && t.err_s == 0.001, "{t:?}");
        let t = mid(&format!("{gps}GPS_SST = 'Unlocked'\n"), 5.0).unwrap();
        assert!(t.source.starts_with("(DATE-OBS") && t.rejected[0].contains("no GPS lock"), "{t:?}");
    }

    #[test]
    fn an_end_that_contradicts_the_exposure_time_is_turned_down_with_a_reason() {
        let t = mid("DATE-OBS= '2025-06-09T10:33:00.0'\nDATE-END= '2025-06-09T10:44:41.0'\n", 280.0).unwrap();
        assert_eq!(t.source, "DATE-OBS + EXPTIME/2");
        assert!(t.rejected[0].contains("701.000 s") && t.rejected[0].contains("stack"), "{:?}", t.rejected);
    }

    #[test]
    fn time_scales_differ_by_their_leap_seconds() {
        let at = |scale: &str| mid(&format!("DATE-OBS= '2025-06-09T10:33:37.0'\nTIMESYS = '{scale}'\n"), 0.0);
        assert!(close(&at("TAI").unwrap(), "2025-06-09T10:33:00"));
        assert!(close(&at("GPS").unwrap(), "2025-06-09T10:33:19"));
        assert!(close(&at("TT").unwrap(), "2025-06-09T10:32:27.816"));
        assert!(at("LOCAL").is_err());
    }

    #[test]
    fn the_leap_second_of_2016_is_a_second_of_its_own() {
        let leap = mid("DATE-OBS= '2016-12-31T23:59:60.5'", 0.0).unwrap().mid;
        let after = utc("2017-01-01T00:00:00");
        assert!(((after - leap).to_seconds() - 0.5).abs() < 1e-6, "{leap}");
        // An exposure across it: 2 s from :59.0 ends at 00:00:00.
        let mid = mid("DATE-OBS= '2016-12-31T23:59:59.0'", 2.0).unwrap().mid;
        assert!(((after - mid).to_seconds() - 1.0).abs() < 1e-6, "{mid}");
    }

    #[test]
    fn dates_and_times_in_separate_cards_are_joined() {
        let t = mid("DATE-OBS= '2021-12-12'\nTIME-OBS= '12:51:21.366'\n", 300.0).unwrap();
        assert!(close(&t, "2021-12-12T12:53:51.366"));
        let t = mid("DATE-OBS= '2020-11-20T23:59:29.2'\nUTSTOP  = '00:00:59.2'\n", 90.0).unwrap();
        assert!(close(&t, "2020-11-21T00:00:14.2") && t.source.contains("UTSTOP"), "{t:?}");
        assert!(mid("DATE-OBS= '26/07/102'\nTIME-OBS= '19:36:37'\n", 60.0).is_err());
        assert!(mid("DATE-OBS= '2021-12-12'\n", 300.0).unwrap_err().to_string().contains("without a time"));
        assert!(mid("DATE    = '2021-12-12T00:00:00'\n", 300.0).is_err(), "DATE is when the file was written");
    }

    #[test]
    fn modified_julian_dates_are_good_to_a_microsecond() {
        let t = mid("MJD-OBS = 60835.43958333333\n", 0.0).unwrap();
        assert!(close(&t, "2025-06-09T10:33:00"), "{t:?}");
        let t = mid("JD      = 2460835.939583333\n", 0.0).unwrap();
        assert!((t.mid - utc("2025-06-09T10:33:00")).abs() < seconds(1e-4), "{t:?}");
    }

    #[test]
    fn sharpcap_stamps_the_finished_frame() {
        let t = mid("DATE-OBS= '2019-04-29T20:25:29.8219583' / System Clock-Frame Grabbed", 2.0).unwrap();
        assert!(close(&t, "2019-04-29T20:25:28.8219583"), "{t:?}");
    }

    #[test]
    fn the_configuration_decides_over_the_header_and_shifts_the_clock() {
        let cards = "DATE-OBS= '2025-06-09T10:33:00.0'\nDATE-AVG= '2025-06-09T10:33:02.6'\n";
        let config = config::Time { date_obs_means: DateObsMeans::Mid, offset_s: -0.25, err_s: Some(0.02) };
        let t = mid_time(&Header::from_text(cards), 5.0, &config, &BTreeMap::new(), Path::new("x")).unwrap();
        assert!(close(&t, "2025-06-09T10:32:59.75") && t.err_s == 0.02 && t.source.contains("date_obs_means"), "{t:?}");
    }
}
