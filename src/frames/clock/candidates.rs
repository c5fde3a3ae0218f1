//! Every way a header states the middle of the exposure, in the order of trust, each checked against the exposure time.
//!
//! Seconds. It does not cover which of them is used ([`super::mid_time`]) and what a stamp's comment means
//! ([`super::meaning`]).

use hifitime::{Epoch, TimeScale, Unit};

use super::candidate::Candidate;
use super::candidate::TimeKind;
use super::candidate::seconds;
use super::meaning::{Meaning, meaning, program_warning};
use super::stamp::{self, Stamp};
use crate::config::DateObsMeans;
use crate::fits::cards::Header;
use crate::tables::words::TimeStamp;

/// Start and end of the exposure, in order of preference. Sources: FITS 4.0 section 4.4.2.1; N.I.N.A. (QHY and
/// ToupTek GPS cards); LCO and Subaru headers.
const PAIRS: [(&str, &str, f64); 12] = [
    ("GPS_SUTC", "GPS_EUTC", 0.001),
    ("GPS_ST", "GPS_ET", 0.001),
    ("DATE-BEG", "DATE-END", 0.1),
    ("DATE-OBS", "DATE-END", 0.1),
    ("MJD-BEG", "MJD-END", 0.1),
    ("MJD-STR", "MJD-END", 0.1),
    ("MJD-OBS", "MJD-END", 0.1),
    ("DATE-OBS", "UTSTOP", 0.1),
    ("DATE-OBS", "UT-END", 0.1),
    ("DATE-OBS", "END-OBS", 0.1),
    ("DATE-OBS", "DATEEND", 0.1),
    ("DATE-OBS", "TIME-END", 0.1),
];
/// Middle of the exposure.
const MIDS: [&str; 8] = ["DATE-AVG", "DATEAVG", "DATE-MID", "MJD-AVG", "MJD-MID", "JD_UTC", "UTMIDDLE", "MIDTIMJD"];
/// Start of the exposure.
const STARTS: [&str; 8] =
    ["DATE-BEG", "DATE-OBS", "CAMERA-DATE-OBS", "DATE_OBS", "MJD-BEG", "MJD-OBS", "MJD-STR", "JD"];
/// Time of day next to a DATE-OBS that has only a date.
const TIMES_OF_DAY: [&str; 9] =
    ["TIME-OBS", "TIME-BEG", "UTSTART", "UTC-OBS", "UT-STR", "UTSHUT", "UTC", "UT", "TIME_OBS"];
/// A span this much longer than the exposure, and half of it, is one of several exposures \[s\]: slow cameras need some
/// seconds to read out. SharpCap stamps its live stacks from the first to the last frame.
const SEVERAL_S: (f64, f64) = (10.0, 2.0);

/// Seconds from the start to the end the header states, whatever the exposure time; the keywords.
pub(crate) fn span_s(header: &Header) -> Option<(f64, String)> {
    let scale = stamp::time_scale(header, std::path::Path::new("")).ok()?;
    let mut finder = Finder::new(header, scale, 0.0);
    PAIRS.iter().find_map(|(begin, end, _)| {
        let (a, b) = finder.pair(begin, end)?;
        Some(((b.epoch - a.epoch).to_seconds(), format!("{end} - {begin}")))
    })
}

/// Collects the candidates.
pub(super) struct Finder<'a> {
    header: &'a Header,
    scale: TimeScale,
    exptime_s: f64,
    pub found: Vec<Candidate>,
    pub rejected: Vec<String>,
    pub warnings: Vec<String>,
    /// Start and end that span more than one exposure: keyword and problem.
    pub several: Option<(String, String)>,
    /// Floor of the error of a start whose end does not fit \[s\].
    doubt_s: f64,
}

impl<'a> Finder<'a> {
    pub fn new(header: &'a Header, scale: TimeScale, exptime_s: f64) -> Self {
        let (found, rejected, warnings) = (Vec::new(), Vec::new(), Vec::new());
        Self { header, scale, exptime_s, found, rejected, warnings, several: None, doubt_s: 0.0 }
    }

    /// All candidates; `means` other than `Header` lets only starts count, as reported.
    pub fn collect(&mut self, own: &[String], means: DateObsMeans) {
        if means == DateObsMeans::Header {
            for key in own {
                self.start(key, TimeKind::Configured);
            }
            self.pairs();
            self.mids();
            for key in STARTS {
                self.start(key, TimeKind::Start);
            }
        } else {
            let keys: Vec<&str> = own.iter().map(String::as_str).chain(STARTS).collect();
            for key in keys {
                if let Some(stamp) = self.stamp(key) {
                    let what = match means {
                        DateObsMeans::Header | DateObsMeans::Start => Meaning::Start,
                        DateObsMeans::Mid => Meaning::Middle,
                        DateObsMeans::End => Meaning::End,
                    };
                    let found = self.shifted(key, stamp, what, " by time.date_obs_means", TimeKind::Configured);
                    self.found.push(found);
                }
            }
        }
        self.note_local_time();
        if self.found.first().is_some_and(|best| best.kind >= TimeKind::StartEnd) {
            self.warnings.extend(program_warning(self.header));
        }
    }

    fn reject(&mut self, note: String) {
        if !self.rejected.contains(&note) {
            self.rejected.push(note);
        }
    }

    fn warn(&mut self, note: String) {
        if !self.warnings.contains(&note) {
            self.warnings.push(note);
        }
    }

    /// Reads a stamp; an unreadable one is noted. A date alone is completed by a time of day.
    fn stamp(&mut self, key: &str) -> Option<Stamp> {
        let text = self.header.text(key)?;
        let days = key.contains("MJD") || key.contains("JD");
        let scale = self.scale_of(key);
        let parsed = if days { stamp::parse_days(key, &text, scale) } else { self.parse_date(key, &text) };
        match parsed {
            Ok(stamp) => {
                if let Some(remark) = stamp.remark {
                    self.warn(format!("{key} = '{text}': {remark}"));
                }
                Some(stamp)
            }
            Err(why) => {
                self.reject(format!("{key} = '{text}': {why}"));
                None
            }
        }
    }

    /// GPS cards and those that name UTC are UTC whatever TIMESYS says.
    fn scale_of(&self, key: &str) -> TimeScale {
        let utc = key.starts_with("GPS_") || key.starts_with("UT") || key.ends_with("_UTC");
        if utc { TimeScale::UTC } else { self.scale }
    }

    fn parse_date(&self, key: &str, text: &str) -> std::result::Result<Stamp, String> {
        let scale = self.scale_of(key);
        if stamp::is_time_of_day(text) {
            // UTSTOP and UTMIDDLE have no date: the one of DATE-OBS, or the day after.
            let start = self.header.text("DATE-OBS").ok_or("a time of day without DATE-OBS")?;
            return stamp::parse_time_after(&start, text, scale);
        }
        if !stamp::is_date_only(text) {
            return stamp::parse(text, scale);
        }
        let time = TIMES_OF_DAY.iter().filter(|_| !key.contains("END")).find_map(|k| Some((k, self.header.text(k)?)));
        let (time_key, time) = time.ok_or("a date without a time of day")?;
        let scale = if scale == TimeScale::UTC { scale } else { self.scale_of(time_key) };
        stamp::parse(&format!("{text}T{}", time.trim_end_matches('Z')), scale)
    }

    /// Both stamps of a pair; an end that is a time of day may lie on the next day.
    fn pair(&mut self, begin: &str, end: &str) -> Option<(Stamp, Stamp)> {
        if self.header.text(begin).is_none() || self.header.text(end).is_none() {
            return None;
        }
        let (a, mut b) = (self.stamp(begin)?, self.stamp(end)?);
        if b.epoch < a.epoch && self.header.text(end).is_some_and(|t| stamp::is_time_of_day(&t)) {
            b.epoch += 1 * Unit::Day;
        }
        Some((a, b))
    }

    fn pairs(&mut self) {
        for (begin, end, err_s) in PAIRS {
            let gps = begin.starts_with("GPS");
            if gps && self.header.text(begin).is_some() && !self.gps_locked(begin) {
                continue;
            }
            let Some((a, b)) = self.pair(begin, end) else { continue };
            let length_s = (b.epoch - a.epoch).to_seconds();
            // Read-out and rounding may add a little; a stack or a wrong card differs by far more.
            let allowed_s = 0.5 + a.resolution_s + b.resolution_s + 0.1 * self.exptime_s;
            let excess_s = length_s - self.exptime_s;
            if excess_s.abs() > allowed_s {
                self.does_not_fit(begin, end, length_s);
                continue;
            }
            let comments = [begin, end].map(|k| self.header.comment(k).unwrap_or_default().to_ascii_lowercase());
            // SharpCap 4 computes both from its own clock; MaxIm's and APT's whole seconds are not more accurate.
            let estimated = comments.iter().any(|c| c.contains("est. ") || c.contains("estimated"));
            let err_s = if estimated { err_s.max(0.5) } else { err_s };
            let rolling_s = if gps { self.rolling_shutter_s() } else { 0.0 };
            let err_s = f64::max(err_s + rolling_s, excess_s.abs() / 2.0).max((a.resolution_s + b.resolution_s) / 4.0);
            self.found.push(Candidate {
                mid: a.epoch + (b.epoch - a.epoch) / 2,
                source: format!("({begin} + {end})/2"),
                kind: if gps { TimeKind::Gps } else { TimeKind::StartEnd },
                stamp: TimeStamp::StartAndEnd,
                err_s,
            });
        }
    }

    /// An end that contradicts the exposure time: several exposures, or a card that means something else.
    fn does_not_fit(&mut self, begin: &str, end: &str, length_s: f64) {
        let exptime_s = self.exptime_s;
        let sharpcap = super::meaning::program(self.header).contains("sharpcap");
        let spare_s = if sharpcap { SEVERAL_S.1 } else { SEVERAL_S.0 };
        let zone = super::candidate::zone_hint(length_s - exptime_s);
        let several = length_s - exptime_s > 0.5 * exptime_s + spare_s && zone.is_empty();
        let words = format!("{end} - {begin} = {length_s:.3} s, but the exposure is {exptime_s} s");
        if several && exptime_s > 0.0 {
            self.several.get_or_insert((
                end.to_string(),
                format!(
                    "{words}: a stack of several exposures has no single time; give the single frames, or set \
                     time.date_obs_means = \"start\" if {end} is wrong"
                ),
            ));
        } else if length_s > exptime_s && zone.is_empty() {
            self.doubt_s = self.doubt_s.max((length_s - exptime_s) / 2.0);
        }
        let why = if several { " (a stack of exposures?)".to_string() } else { zone };
        self.warn(format!("{words}{why}"));
        self.reject(format!("{words}{why}"));
    }

    /// Half of the time a rolling shutter takes over the frame \[s\]: GPS_LP is the period of a row \[ns\].
    fn rolling_shutter_s(&self) -> f64 {
        let rows = self.header.size_px().1 as f64;
        self.header.number("GPS_LP").filter(|p| (0.0..1e9).contains(p)).map_or(0.0, |p| p * 1e-9 * rows / 2.0)
    }

    /// GPS stamps count only with a lock. N.I.N.A. writes QHY's status as `locked and valid`, `not locked`,
    /// `not locked but data valid`, `just powered on`; ToupTek's and Moravian's as the number of satellites.
    fn gps_locked(&mut self, begin: &str) -> bool {
        for key in ["GPS_SST", "GPS_EST", "GPS_STAT"] {
            let Some(text) = self.header.text(key) else { continue };
            let low = text.to_ascii_lowercase();
            let bad = ["no", "un", "lost", "fail", "search", "init", "powered", "wait"];
            if bad.iter().any(|b| low.contains(b)) || low.trim_start_matches('0').trim() == "sats" {
                self.reject(format!("{begin}: {key} = '{text}', no GPS lock"));
                self.warn(format!("{key} = '{text}': the GPS had no lock, its times are not used"));
                return false;
            }
        }
        true
    }

    fn mids(&mut self) {
        for key in MIDS {
            let Some(mid) = self.stamp(key) else { continue };
            let start = ["DATE-OBS", "DATE-BEG"].iter().find_map(|k| {
                let text = self.header.text(k)?;
                self.parse_date(k, &text).ok()
            });
            let gap_s = start.map_or(0.0, |s| (mid.epoch - s.epoch).to_seconds() - self.exptime_s / 2.0);
            // N.I.N.A. writes the middle of its own clock readings, late by half the download.
            if gap_s.abs() > 10.0 + self.exptime_s {
                let note =
                    format!("{key}: {gap_s:.3} s away from DATE-OBS + EXPTIME/2{}", super::candidate::zone_hint(gap_s));
                self.warn(note.clone());
                self.reject(note);
                continue;
            }
            let estimated = self.header.comment(key).is_some_and(|c| c.to_ascii_lowercase().contains("est. "));
            let least_s: f64 = if estimated { 0.5 } else { 0.1 };
            self.found.push(Candidate {
                mid: mid.epoch,
                source: key.to_string(),
                kind: TimeKind::Middle,
                stamp: TimeStamp::Middle,
                err_s: least_s.max(gap_s.abs()).max(mid.resolution_s / 2.0),
            });
        }
    }

    fn start(&mut self, key: &str, kind: TimeKind) {
        let Some(stamp) = self.stamp(key) else { return };
        let comment = self.header.comment(key).unwrap_or_default();
        let (what, why) = meaning(self.header, &comment, stamp.epoch);
        let found = self.shifted(key, stamp, what, why, kind);
        if found.err_s >= 1.0 && stamp.resolution_s >= 1.0 {
            self.warn(format!("{key} is given to whole seconds only: time_err_s {} s", found.err_s));
        }
        if comment.to_ascii_lowercase().contains("frame grabbed") {
            self.warn(format!(
                "{key}: \"{comment}\" of SharpCap before version 4 is taken as the end of the exposure; check it once \
                 against a clock"
            ));
        }
        if what == Meaning::Unclear {
            self.warn(format!(
                "{key}: \"{comment}\" does not say whether it is start or end; taken as the start, time_err_s {} s: set \
                 time.date_obs_means",
                found.err_s
            ));
        }
        self.found.push(found);
    }

    /// Shifts a stamp to the middle of the exposure.
    fn shifted(&self, key: &str, stamp: Stamp, what: Meaning, why: &str, kind: TimeKind) -> Candidate {
        let half = seconds(self.exptime_s / 2.0);
        let (mid, marks, source): (Epoch, TimeStamp, String) = match what {
            Meaning::Start | Meaning::Unclear => {
                (stamp.epoch + half, TimeStamp::Start, format!("{key} + EXPTIME/2{why}"))
            }
            Meaning::Middle => (stamp.epoch, TimeStamp::Middle, format!("{key} as the middle{why}")),
            Meaning::End => (stamp.epoch - half, TimeStamp::End, format!("{key} - EXPTIME/2{why}")),
        };
        let unclear_s = if what == Meaning::Unclear { self.exptime_s } else { 0.0 };
        let err_s = stamp.resolution_s.max(0.5).max(unclear_s).max(self.doubt_s);
        Candidate { mid, source, kind, stamp: marks, err_s }
    }

    /// Local time written as UTC: DATE-LOC equals DATE-OBS, or differs by what is not a time zone of the site.
    fn note_local_time(&mut self) {
        let Some(utc) = self.header.text("DATE-OBS") else { return };
        let lon_deg = crate::frames::header::header_site(self.header, &Default::default()).0.map(|s| s.lon_deg);
        for key in ["DATE-LOC", "LOCAL-DT"] {
            let Some(local) = self.header.text(key) else { continue };
            let (Ok(a), Ok(b)) = (stamp::parse(&utc, TimeScale::UTC), stamp::parse(&local, TimeScale::UTC)) else {
                continue;
            };
            let zone_h = (b.epoch - a.epoch).to_seconds() / 3_600.0;
            let solar_h = lon_deg.map(|l| l / 15.0);
            if zone_h.abs() < 1e-3 && solar_h.is_none_or(|h| h.abs() > 1.5) {
                self.warn(format!(
                    "{key} equals DATE-OBS: either the computer's clock was on UTC, or DATE-OBS is local time (then set \
                     time.offset_s)"
                ));
            } else if zone_h.abs() > 1e-3
                && let Some(h) = solar_h.filter(|h| is_no_zone(zone_h, *h))
            {
                self.warn(format!(
                    "{key} is {zone_h:+.2} h from DATE-OBS, but the site's longitude implies about {h:+.1} h: local \
                     time and UTC may be exchanged"
                ));
            }
        }
    }
}

/// Whether a legal time `zone_h` ahead of UTC is too far from the Sun's, `solar_h` ahead; beyond the date line it may
/// be a day.
fn is_no_zone(zone_h: f64, solar_h: f64) -> bool {
    let off_h = (zone_h - solar_h).abs();
    off_h > 4.0 && (off_h - 24.0).abs() > 2.0
}
