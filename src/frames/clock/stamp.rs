//! One time stamp: text or day number to an instant.
//!
//! ISO 8601 as FITS writes it, day/month/year of the last century's headers, Julian dates. Instants are kept in TAI so
//! that adding seconds crosses a leap second correctly. It does not cover what the stamp means ([`super::meaning`]).

use std::path::Path;

use hifitime::{Epoch, TimeScale, Unit};

use crate::base::error::{Error, Result};
use crate::base::instant;
use crate::fits::cards::{Header, parse_number};

/// An instant and the last digit of its stamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stamp {
    pub epoch: Epoch,
    pub resolution_s: f64,
    /// Warning about the way it is written.
    pub remark: Option<&'static str>,
}

/// TIMESYS; UTC if absent (FITS 4.0 section 9.2.1).
pub(super) fn time_scale(header: &Header, path: &Path) -> Result<TimeScale> {
    let text = header.text("TIMESYS").unwrap_or_else(|| "UTC".into());
    let name = text.to_ascii_uppercase();
    let name = name.split('(').next().unwrap_or_default().trim();
    match name {
        // UT1 is within 0.9 s of UTC; ET and TDT are old names of TT.
        "UTC" | "UT" | "UT1" | "GMT" | "Z" => Ok(TimeScale::UTC),
        "TAI" | "IAT" => Ok(TimeScale::TAI),
        "TT" | "TDT" | "ET" => Ok(TimeScale::TT),
        "TDB" => Ok(TimeScale::TDB),
        "GPS" => Ok(TimeScale::GPST),
        _ => Err(Error::Header {
            path: path.to_path_buf(),
            keyword: "TIMESYS".into(),
            problem: format!("'{text}' is not a time scale; accepted: UTC, TAI, TT, TDB, GPS"),
        }),
    }
}

/// Julian or modified Julian days, by the keyword.
pub(super) fn parse_days(key: &str, text: &str, scale: TimeScale) -> std::result::Result<Stamp, String> {
    let days = parse_number(text).ok_or("not a number")?;
    let mjd = if key.starts_with("MJD") { days } else { days - 2_400_000.5 };
    // 1957 to 2100.
    if !(35_839.0..88_069.0).contains(&mjd) {
        return Err(format!("{days} days are outside 1957 to 2100"));
    }
    let digits = text.split_once('.').map_or(0, |(_, f)| f.trim().len());
    let day = mjd.floor();
    // MJD 15020 is 1899-12-31T00:00; whole days first, so that the fraction keeps its digits.
    let midnight = Epoch::from_gregorian_at_midnight(1957, 1, 1, scale) + (day - 35_839.0) * Unit::Day;
    let epoch = midnight + (mjd - day) * Unit::Day;
    Ok(Stamp {
        epoch: epoch.to_time_scale(TimeScale::TAI),
        resolution_s: 86_400.0 * 10f64.powi(-(digits.min(12) as i32)),
        remark: None,
    })
}

/// `hh:mm:ss` and nothing else.
pub(super) fn is_time_of_day(text: &str) -> bool {
    let t = text.trim().trim_end_matches('Z');
    !t.contains(['-', '/', 'T']) && t.matches(':').count() == 2
}

/// A date without a time of day.
pub(super) fn is_date_only(text: &str) -> bool {
    !text.contains(':')
}

/// A time of day on the date of `start`, or on the next day if it is earlier than `start`.
pub(super) fn parse_time_after(start: &str, time: &str, scale: TimeScale) -> std::result::Result<Stamp, String> {
    let date = start.split(['T', ' ']).next().unwrap_or_default();
    let stamp = parse(&format!("{date}T{}", time.trim()), scale)?;
    let before = parse(start, scale).is_ok_and(|s| s.epoch > stamp.epoch);
    Ok(if before { Stamp { epoch: stamp.epoch + 1 * Unit::Day, ..stamp } } else { stamp })
}

/// `yyyy-mm-ddThh:mm:ss[.f][Z]`, also with a space, `yyyy/mm/dd`, or `dd/mm/yy` before the time; a zone such as
/// `+10:00` is subtracted. Second 60 is a leap second where there was one and a rounded 59.999 elsewhere.
pub(super) fn parse(text: &str, scale: TimeScale) -> std::result::Result<Stamp, String> {
    let text = text.trim();
    let text = text.strip_suffix("UTC").unwrap_or(text).trim_end();
    let (date, time) = text.split_once(['T', ' ']).ok_or("no time of day")?;
    let (year, month, day) = parse_date(date)?;
    let time = time.trim().trim_end_matches(['Z', 'z']);
    let (time, zone) = match time.rfind(['+', '-', '−']) {
        Some(at) => (time[..at].trim_end(), Some(f64::from(instant::offset_min(&time[at..])?) / 60.0)),
        None => (time, None),
    };
    let mut parts = time.split(':');
    let (h, m, s) = (parts.next(), parts.next(), parts.next());
    let (Some(h), Some(m), Some(s), None) = (h, m, s, parts.next()) else {
        return Err("the time is not hh:mm:ss".into());
    };
    let whole = |t: &str, top: u8| {
        let digits = (1..=2).contains(&t.len()) && t.bytes().all(|b| b.is_ascii_digit());
        t.parse::<u8>().ok().filter(|v| digits && *v <= top)
    };
    let (second, fraction) = s.split_once('.').unwrap_or((s, ""));
    if !fraction.bytes().all(|b| b.is_ascii_digit()) {
        return Err(format!("'{s}' are not seconds"));
    }
    let (hour, minute) = (whole(h, 23).ok_or("hour outside 0 to 23")?, whole(m, 59).ok_or("minute outside 0 to 59")?);
    let second = whole(second, 60).ok_or("second outside 0 to 60")?;
    let mut remark = zone.map(|_| "a time zone was subtracted").or(date.contains('/').then_some(SLASHES));
    let no_date = || format!("{year}-{month:02}-{day:02} is not a date");
    let zone_h = zone.unwrap_or(0.0);
    let leap = second == 60 && scale == TimeScale::UTC && {
        let begins = Epoch::maybe_from_gregorian(year, month, day, hour, minute, 0, 0, scale).map_err(|_| no_date())?;
        instant::has_leap_second(&(begins - zone_h * Unit::Hour))
    };
    if leap {
        remark = Some("a leap second; the tables count it as the second before, so the time is known to 1 s only");
    } else if second == 60 {
        if fraction.bytes().any(|b| b != b'0') {
            return Err("second 60 is not a leap second".into());
        }
        remark = Some("second 60 outside a leap second is read as the next minute");
    }
    let mut nanos_text: String = fraction.chars().take(9).collect();
    while nanos_text.len() < 9 {
        nanos_text.push('0');
    }
    let nanos: u32 = nanos_text.parse().map_err(|_| "fraction of a second")?;
    let epoch = Epoch::maybe_from_gregorian(year, month, day, hour, minute, second.min(59), nanos, scale)
        .map_err(|_| no_date())?;
    let epoch = epoch.to_time_scale(TimeScale::TAI) + i64::from(second == 60) * Unit::Second;
    let epoch = epoch - zone_h * Unit::Hour;
    let resolution_s = if leap { 1.0 } else { 10f64.powi(-(fraction.len().min(9) as i32)) };
    Ok(Stamp { epoch, resolution_s, remark })
}

/// Day, month, year: the standard of the last century.
const SLASHES: &str = "read as day/month/year, which FITS gave up in 1999";

fn parse_date(date: &str) -> std::result::Result<(i32, u8, u8), String> {
    let separator = if date.contains('/') { '/' } else { '-' };
    let parts: Vec<&str> = date.split(separator).map(str::trim).collect();
    let [a, b, c] = parts[..] else { return Err("the date is not yyyy-mm-dd".into()) };
    if parts.iter().any(|p| p.is_empty() || !p.bytes().all(|x| x.is_ascii_digit())) {
        return Err("the date is not yyyy-mm-dd".into());
    }
    let (year, month, day) = match (a.len(), b.len(), c.len()) {
        (4, 1..=2, 1..=2) => (a.to_string(), b, c),
        (1..=2, 1..=2, 4) if separator == '/' => (c.to_string(), b, a),
        // dd/mm/yy ended with 1999 (FITS 4.0 section 4.4.2.1); no camera of ours is older than Sputnik.
        (2, 2, 2) if separator == '/' => (if c >= "57" { format!("19{c}") } else { format!("20{c}") }, b, a),
        _ => return Err("neither yyyy-mm-dd nor dd/mm/yy".into()),
    };
    let year: i32 = year.parse().map_err(|_| "the year is not a number")?;
    if year == 1 {
        return Err("year 1: no time was known (SharpCap writes it when its GPS has lost the lock)".into());
    }
    if !(1957..2100).contains(&year) {
        return Err(format!("year {year} is outside 1957 to 2100"));
    }
    let small = |t: &str| t.parse::<u8>().map_err(|_| "not a date".to_string());
    Ok((year, small(month)?, small(day)?))
}
