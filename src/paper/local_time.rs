//! Local dates and times to UTC: by the rule of the zone, not by longitude.
//!
//! Accepted are `2025-06-08 20:33`, `2025-06-08T20:33:00` and, as the paper prints them, `08-06-25 20:33` (day-month-year).
//! Zones: UTC, fixed offsets, AEST, AEDT, Australia/Sydney since 2008. No other zone's summer time is known.

use hifitime::Epoch;

use crate::base::instant;
use crate::base::time::shifted;

/// What is accepted as a zone, for messages.
pub const ZONES: &str = "UTC, Z, an offset such as +10:00 or -3, AEST (+10:00), AEDT (+11:00), Australia/Sydney";

/// Offset of a clock from UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Zone {
    /// The same all year \[min\], positive to the east.
    Fixed(i32),
    /// +10:00, and +11:00 from the first Sunday of October, 2:00, to the first Sunday of April, 3:00 (Standard Time Act
    /// 1987 No 149, New South Wales, as amended; since 2008).
    Sydney,
}

/// A civil date and time: year, month, day, hour, minute, second.
type Civil = (i32, u8, u8, u8, u8, u8);

impl Zone {
    /// The zone of a text; the error lists what is accepted.
    pub fn from_text(text: &str) -> Result<Self, String> {
        match text.trim() {
            "UTC" | "utc" | "UT" | "Z" | "z" | "GMT" => return Ok(Self::Fixed(0)),
            "AEST" => return Ok(Self::Fixed(600)),
            "AEDT" => return Ok(Self::Fixed(660)),
            "Australia/Sydney" => return Ok(Self::Sydney),
            _ => {}
        }
        offset_min(text.trim())
            .map(Self::Fixed)
            .ok_or_else(|| format!("\"{}\" is not a time zone known here; accepted are {ZONES}", text.trim()))
    }

    /// The instant of a local date and time.
    pub fn to_utc(self, text: &str) -> Result<Epoch, String> {
        // a time that names its own zone is of that zone
        if let Ok(given) = instant::read(text)
            && given.has_zone
        {
            return Ok(given.epoch);
        }
        let civil = civil(text)?;
        let as_utc = epoch(civil).ok_or_else(|| format!("\"{text}\" is not a date of the calendar"))?;
        let minutes = match self {
            Self::Fixed(minutes) => minutes,
            Self::Sydney => sydney_min(civil, text)?,
        };
        Ok(shifted(as_utc, -60.0 * f64::from(minutes)))
    }
}

/// `+10:00`, `+10`, `-3`, `+1030` in minutes.
fn offset_min(text: &str) -> Option<i32> {
    let (sign, digits) = match text.split_at_checked(1)? {
        ("+", rest) => (1, rest),
        ("-" | "−", rest) => (-1, rest),
        _ => return None,
    };
    let number = |t: &str| t.bytes().all(|b| b.is_ascii_digit()).then(|| t.parse::<i32>().ok()).flatten();
    let (hours, minutes) = match digits.split_once(':') {
        Some((h, m)) => (number(h)?, number(m)?),
        None if digits.len() == 4 => (number(digits.get(..2)?)?, number(digits.get(2..)?)?),
        None => (number(digits)?, 0),
    };
    (hours <= 14 && minutes < 60).then_some(sign * (60 * hours + minutes))
}

/// Reads a date and a time of day.
fn civil(text: &str) -> Result<Civil, String> {
    let wrong =
        || format!("\"{text}\" is not a date and time such as 2025-06-08 20:33, or 08-06-25 20:33 (day-month-year)");
    let (date, time) = text.trim().split_once(['T', ' ']).ok_or_else(wrong)?;
    let parts = |t: &str, by: char| -> Option<Vec<u32>> { t.trim().split(by).map(|p| p.parse().ok()).collect() };
    let (d, t) = (parts(date, '-').ok_or_else(wrong)?, parts(time, ':').ok_or_else(wrong)?);
    let year_first = date.split('-').next().is_some_and(|y| y.len() == 4);
    let (y, mo, day) = match d.as_slice() {
        [y, mo, day] if year_first => (*y, *mo, *day),
        [day, mo, y] if *y < 100 => (2000 + *y, *mo, *day),
        _ => return Err(wrong()),
    };
    let (h, mi, s) = match t.as_slice() {
        [h, mi] => (*h, *mi, 0),
        [h, mi, s] => (*h, *mi, *s),
        _ => return Err(wrong()),
    };
    let small = |v: u32| u8::try_from(v).map_err(|_| wrong());
    Ok((i32::try_from(y).map_err(|_| wrong())?, small(mo)?, small(day)?, small(h)?, small(mi)?, small(s)?))
}

/// A civil time read as UTC; `None` for the 30th of February.
fn epoch((y, mo, d, h, mi, s): Civil) -> Option<Epoch> {
    if !(1..=12).contains(&mo) || d == 0 || h > 23 || mi > 59 || s > 59 {
        return None;
    }
    let epoch = Epoch::maybe_from_gregorian_utc(y, mo, d, h, mi, s, 0).ok()?;
    let (y2, mo2, d2, ..) = epoch.to_gregorian_utc();
    ((y2, mo2, d2) == (y, mo, d)).then_some(epoch)
}

/// Sydney's offset at a local time \[min\]; the hour that comes twice in April is taken as summer time.
fn sydney_min((y, mo, d, h, mi, _): Civil, text: &str) -> Result<i32, String> {
    if y < 2008 {
        return Err(format!("\"{text}\": the rule of Australia/Sydney is known since 2008; give +10:00 or +11:00"));
    }
    let minutes_of = |day: u8, hour: u8, minute: u8| (u32::from(day) * 24 + u32::from(hour)) * 60 + u32::from(minute);
    let now = minutes_of(d, h, mi);
    let change =
        first_sunday(y, mo).map(|day| minutes_of(day, 2, 0)).ok_or_else(|| format!("\"{text}\" is not a date"))?;
    let summer = match mo {
        4 => now < change + 60,
        10 if (change..change + 60).contains(&now) => {
            return Err(format!("\"{text}\": clocks in Sydney skip this hour; add one"));
        }
        10 => now >= change,
        _ => !(4..=10).contains(&mo),
    };
    Ok(if summer { 660 } else { 600 })
}

/// Day of the month of its first Sunday.
fn first_sunday(y: i32, mo: u8) -> Option<u8> {
    let mjd = epoch((y, mo, 1, 12, 0, 0))?.to_mjd_utc_days().floor() as i64;
    // MJD 4 was a Sunday
    u8::try_from(1 + (4 - mjd).rem_euclid(7)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::iso_utc;

    fn utc(zone: &str, text: &str) -> String {
        iso_utc(Zone::from_text(zone).unwrap().to_utc(text).unwrap(), 0)
    }

    #[test]
    fn local_times_follow_the_rule_of_the_zone() {
        assert_eq!(utc("Australia/Sydney", "24-01-24 10:20"), "2024-01-23T23:20:00Z");
        assert_eq!(utc("Australia/Sydney", "2025-06-10 03:00"), "2025-06-09T17:00:00Z");
        assert_eq!(utc("AEST", "08-06-25 20:33"), "2025-06-08T10:33:00Z");
        assert_eq!(utc("-3:30", "2025-12-31T22:00:30"), "2026-01-01T01:30:30Z");
        assert_eq!(utc("UTC", "2024-02-29 00:00"), "2024-02-29T00:00:00Z");
        // 2025: 6 April 3:00 back, 5 October 2:00 forward
        assert_eq!(utc("Australia/Sydney", "2025-04-06 02:59"), "2025-04-05T15:59:00Z");
        assert_eq!(utc("Australia/Sydney", "2025-04-06 03:00"), "2025-04-05T17:00:00Z");
        assert_eq!(utc("Australia/Sydney", "2025-10-05 01:59"), "2025-10-04T15:59:00Z");
        assert_eq!(utc("Australia/Sydney", "2025-10-05 03:00"), "2025-10-04T16:00:00Z");
        assert!(Zone::Sydney.to_utc("2025-10-05 02:30").is_err());
    }

    #[test]
    fn what_is_no_time_or_zone_is_refused_with_what_would_be() {
        for text in ["2025-02-30 10:00", "2025-13-01 10:00", "2025-06-08", "10:00", "2025-06-08 25:00", "8 June 20:33"]
        {
            assert!(Zone::Fixed(0).to_utc(text).is_err(), "{text}");
        }
        for zone in ["Mars/Olympus", "", "+25:00", "+10:75", "10", "EST"] {
            assert!(Zone::from_text(zone).unwrap_err().contains("Australia/Sydney"), "{zone}");
        }
    }
}
