//! A date and time as text to an instant: the one reader of every time that a user or a table gives.
//!
//! ISO 8601 with a zone, UTC without one. Calendar and clock are checked here, in whole numbers, so that no impossible
//! time becomes a possible one. It does not cover what headers of the last century write ([`crate::frames`]) and zones
//! by name ([`crate::paper::local_time`]).

use hifitime::{Epoch, TimeScale, Unit};

/// What is accepted, for messages.
pub const ACCEPTED: &str = "accepted is 2025-06-09T20:20:00 (UTC), with Z or an offset such as +10:00 after it, or a date \
                            alone (0 h UTC)";
/// Years that Sun and Moon are known in.
const YEARS: std::ops::RangeInclusive<i32> = 1900..=2100;
/// Widest zone of the civil world \[min\]: UTC+14.
const WIDEST_ZONE_MIN: i32 = 14 * 60;
const MINUTES_OF_DAY: i64 = 1_440;

/// A time as it was given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    /// The instant.
    pub epoch: Epoch,
    /// A zone stood behind it.
    pub has_zone: bool,
    /// It was a date without a time of day.
    pub is_date_only: bool,
}

/// Reads a time: `2025-06-09T20:20:00.5+10:00`, a blank for the T, seconds optional, `Z`, `UTC`, `+1000`, `-03:30`,
/// `+10`, or a date alone. Without a zone it is UTC; `24:00:00` is the end of its day; second 60 only where there was
/// one.
///
/// # Errors
/// A sentence that says what is wrong with the text, without the text and without what is accepted ([`ACCEPTED`]).
pub fn read(text: &str) -> Result<Instant, String> {
    let text = text.trim();
    let (date, rest) = split_date(text)?;
    let (year, month, day) = civil(date)?;
    let rest = rest.trim_start();
    let clock_text = rest.strip_prefix(['T', 't']).unwrap_or(rest).trim();
    let is_date_only = !clock_text.starts_with(|c: char| c.is_ascii_digit());
    if is_date_only && clock_text.len() < rest.len() {
        return Err("no time of day stands after the T".into());
    }
    let zone_at =
        clock_text.find(|c: char| !(c.is_ascii_digit() || matches!(c, ':' | '.' | ','))).unwrap_or(clock_text.len());
    let (clock_text, zone_text) = if is_date_only { ("00:00", clock_text) } else { clock_text.split_at(zone_at) };
    let (hour, minute, second, nanos) = clock(clock_text)?;
    let zone_text = zone_text.trim();
    let zone_min = if zone_text.is_empty() { 0 } else { offset_min(zone_text)? };
    let minutes = days_from_civil(year, month, day) * MINUTES_OF_DAY + i64::from(hour) * 60 + i64::from(minute)
        - i64::from(zone_min);
    Ok(Instant { epoch: epoch_of(minutes, second, nanos)?, has_zone: !zone_text.is_empty(), is_date_only })
}

/// Reads a date of the calendar, `2025-06-09`: year, month, day.
///
/// # Errors
/// As [`read`].
pub fn read_date(text: &str) -> Result<(i32, u8, u8), String> {
    match split_date(text.trim())? {
        (date, "") => civil(date),
        (_, rest) => Err(format!("\"{}\" after the date is too much", rest.trim())),
    }
}

/// An offset from UTC \[min\], positive to the east: `Z`, `UTC`, `UT`, `GMT`, `+10:00`, `-0330`, `+10`, `-3`.
///
/// # Errors
/// As [`read`].
pub fn offset_min(text: &str) -> Result<i32, String> {
    let wrong = || format!("\"{text}\" is not a zone: Z, UTC, or an offset such as +10:00 or -0330");
    if ["Z", "UTC", "UT", "GMT"].iter().any(|name| text.eq_ignore_ascii_case(name)) {
        return Ok(0);
    }
    // "UTC+10:00" is written, too
    let signed = ["UTC", "GMT"].iter().find_map(|name| text.strip_prefix(name)).unwrap_or(text);
    let mut chars = signed.chars();
    let sign = match chars.next() {
        Some('+') => 1,
        Some('-' | '−') => -1,
        _ => return Err(wrong()),
    };
    let number = |t: &str| {
        let good = (1..=2).contains(&t.len()) && t.bytes().all(|b| b.is_ascii_digit());
        t.parse::<i32>().ok().filter(|_| good)
    };
    let digits = chars.as_str();
    let parts = match (digits.split_once(':'), digits.split_at_checked(2)) {
        (Some((h, m)), _) if m.len() == 2 => number(h).zip(number(m)),
        (None, Some((h, m))) if digits.len() == 4 => number(h).zip(number(m)),
        (None, _) => number(digits).zip(Some(0)),
        _ => None,
    };
    let (hours, minutes) = parts.ok_or_else(wrong)?;
    let size = 60 * hours + minutes;
    if minutes > 59 || size > WIDEST_ZONE_MIN {
        return Err(format!("the offset \"{text}\" is outside -14:00 to +14:00"));
    }
    Ok(sign * size)
}

/// The part that is a date, and the rest.
fn split_date(text: &str) -> Result<(&str, &str), String> {
    if text.is_empty() {
        return Err("it is empty".into());
    }
    // the third number of the date ends at the first character that is not a digit
    let mut dashes = 0;
    let end = text.find(|c: char| {
        dashes += usize::from(c == '-');
        !(c.is_ascii_digit() || c == '-') || dashes > 2
    });
    Ok(text.split_at(end.unwrap_or(text.len())))
}

/// Year, month and day that the calendar has.
fn civil(date: &str) -> Result<(i32, u8, u8), String> {
    let wrong = || match date {
        "" => "it does not begin with a date such as 2025-06-09".to_owned(),
        _ => format!("\"{date}\" is not a date such as 2025-06-09"),
    };
    let parts: Vec<&str> = date.split('-').collect();
    let [y, m, d] = parts[..] else { return Err(wrong()) };
    let digits = |t: &str, n: std::ops::RangeInclusive<usize>| {
        (n.contains(&t.len()) && t.bytes().all(|b| b.is_ascii_digit())).then(|| t.parse::<i32>().ok()).flatten()
    };
    let (Some(year), Some(month), Some(day)) = (digits(y, 4..=4), digits(m, 1..=2), digits(d, 1..=2)) else {
        return Err(wrong());
    };
    if !YEARS.contains(&year) {
        return Err(format!("the year {year} is outside {} to {}", YEARS.start(), YEARS.end()));
    }
    if !(1..=12).contains(&month) {
        return Err(format!("there is no month {month}"));
    }
    let last = days_in_month(year, month as u8);
    if !(1..=i32::from(last)).contains(&day) {
        return Err(format!("{year}-{month:02} has {last} days, not a day {day}"));
    }
    Ok((year, month as u8, day as u8))
}

/// Days of a month.
#[must_use]
pub fn days_in_month(year: i32, month: u8) -> u8 {
    match month {
        4 | 6 | 9 | 11 => 30,
        2 if year % 4 == 0 && (year % 100 != 0 || year % 400 == 0) => 29,
        2 => 28,
        _ => 31,
    }
}

/// Hour (24 only as the end of a day), minute, second (60 is checked later), nanoseconds.
fn clock(text: &str) -> Result<(u8, u8, u8, u32), String> {
    let wrong = || format!("\"{text}\" is not a time of day such as 20:20 or 20:20:00.5");
    let parts: Vec<&str> = text.split(':').collect();
    let (h, m, s) = match parts[..] {
        [h, m] => (h, m, "0"),
        [h, m, s] => (h, m, s),
        _ => return Err(wrong()),
    };
    let whole = |t: &str| {
        let good = (1..=2).contains(&t.len()) && t.bytes().all(|b| b.is_ascii_digit());
        t.parse::<u8>().ok().filter(|_| good)
    };
    let (s, fraction) = s.split_once(['.', ',']).unwrap_or((s, "0"));
    let (Some(hour), Some(minute), Some(second)) = (whole(h), whole(m), whole(s)) else { return Err(wrong()) };
    if fraction.is_empty() || !fraction.bytes().all(|b| b.is_ascii_digit()) {
        return Err(wrong());
    }
    let digits: String = fraction.chars().chain("000000000".chars()).take(9).collect();
    let nanos: u32 = digits.parse().map_err(|_| wrong())?;
    if hour > 24 || (hour == 24 && (minute, second, nanos) != (0, 0, 0)) {
        return Err(format!("the hour {h} is outside 0 to 23 (24:00:00 ends a day)"));
    }
    if minute > 59 {
        return Err(format!("the minute {m} is outside 0 to 59"));
    }
    if second > 60 {
        return Err(format!("the second {s} is outside 0 to 59"));
    }
    Ok((hour, minute, second, nanos))
}

/// The instant of a count of UTC minutes since 1970, and seconds after it.
fn epoch_of(minutes: i64, second: u8, nanos: u32) -> Result<Epoch, String> {
    let start = |minutes: i64| {
        let (y, mo, d) = civil_from_days(minutes.div_euclid(MINUTES_OF_DAY));
        let of_day = minutes.rem_euclid(MINUTES_OF_DAY);
        let (h, mi) = ((of_day / 60) as u8, (of_day % 60) as u8);
        move |s: u8, ns: u32| Epoch::maybe_from_gregorian_utc(y, mo, d, h, mi, s, ns).map_err(|e| e.to_string())
    };
    if second < 60 {
        return start(minutes)(second, nanos);
    }
    if !has_leap_second(&start(minutes)(0, 0)?) {
        return Err("there was no leap second at that time".into());
    }
    // a label of its own exists in UTC alone, where the library of times repeats second 59
    Ok(start(minutes)(59, nanos)?.to_time_scale(TimeScale::TAI) + 1 * Unit::Second)
}

/// Whether the UTC minute that begins here has 61 seconds.
#[must_use]
pub fn has_leap_second(minute: &Epoch) -> bool {
    // 60 s later by the labels of UTC, which skip a leap second
    let next = Epoch::from_utc_duration(minute.to_utc_duration() + 60 * Unit::Second);
    next.to_time_scale(TimeScale::TAI) - minute.to_time_scale(TimeScale::TAI) > 60.5 * Unit::Second
}

/// Days from 1970-01-01 of a date of the Gregorian calendar.
///
/// # Source
/// Hinnant 2013, chrono-compatible low-level date algorithms: years begin in March, so that the leap day is the last.
fn days_from_civil(year: i32, month: u8, day: u8) -> i64 {
    let y = i64::from(year) - i64::from(month <= 2);
    let era = y.div_euclid(400);
    let of_era = y.rem_euclid(400);
    let of_year = (153 * ((i64::from(month) + 9) % 12) + 2) / 5 + i64::from(day) - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

/// The date of a count of days from 1970-01-01; undoes [`days_from_civil`].
fn civil_from_days(days: i64) -> (i32, u8, u8) {
    let z = days + 719_468;
    let (era, of_era) = (z.div_euclid(146_097), z.rem_euclid(146_097));
    let year_of_era = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let m = (5 * of_year + 2) / 153;
    let day = of_year - (153 * m + 2) / 5 + 1;
    let month = if m < 10 { m + 3 } else { m - 9 };
    ((year_of_era + era * 400 + i64::from(month <= 2)) as i32, month as u8, day as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::iso_utc;

    fn utc(text: &str) -> String {
        iso_utc(read(text).unwrap_or_else(|e| panic!("{text}: {e}")).epoch, 3)
    }

    #[test]
    fn every_way_of_writing_one_instant_gives_that_instant() {
        for text in [
            "2025-06-09T10:20:00",
            "2025-06-09T10:20:00Z",
            "2025-06-09t10:20z",
            " 2025-06-09 10:20:00 UTC ",
            "2025-06-09T10:20:00.000 GMT",
            "2025-06-09T20:20:00+10:00",
            "2025-06-09 20:20 +1000",
            "2025-06-09T20:20:00,0+10",
            "2025-06-09T06:50:00-03:30",
            "2025-06-09T06:50:00-0330",
            "2025-06-09T06:50:00−03:30",
            "2025-06-10T00:20:00+14:00",
            "2025-06-08T22:20:00-12:00",
            "2025-06-09T16:05+05:45",
            "2025-06-09T20:20:00 UTC+10:00",
        ] {
            assert_eq!(utc(text), "2025-06-09T10:20:00.000Z", "{text}");
        }
    }

    #[test]
    fn zones_carry_over_days_months_years_and_leap_days() {
        assert_eq!(utc("2025-01-01T05:00:00+10:00"), "2024-12-31T19:00:00.000Z");
        assert_eq!(utc("2024-02-28T22:00:00-03:30"), "2024-02-29T01:30:00.000Z");
        assert_eq!(utc("2023-02-28T22:00:00-03:30"), "2023-03-01T01:30:00.000Z");
        assert_eq!(utc("2025-06-09T24:00:00"), "2025-06-10T00:00:00.000Z");
        assert_eq!(utc("2025-12-31T24:00+10:00"), "2025-12-31T14:00:00.000Z");
        assert_eq!(utc("2025-06-09T10:20:00.1234567891"), "2025-06-09T10:20:00.123Z");
    }

    #[test]
    fn a_date_alone_is_its_0_h_utc_or_that_of_its_zone() {
        let date = read("2025-06-09").unwrap();
        assert!(date.is_date_only && !date.has_zone);
        assert_eq!(iso_utc(date.epoch, 0), "2025-06-09T00:00:00Z");
        assert_eq!(utc("2025-06-09Z"), "2025-06-09T00:00:00.000Z");
        assert_eq!(utc("2025-06-09 +10:00"), "2025-06-08T14:00:00.000Z");
        assert_eq!(utc("2025-06-09-03:30"), "2025-06-09T03:30:00.000Z");
        assert_eq!(read_date("2024-02-29"), Ok((2024, 2, 29)));
        assert!(read_date("2025-02-29").is_err() && read_date("2025-06-09T10:00").is_err());
    }

    #[test]
    fn what_no_calendar_or_clock_has_is_refused_and_named() {
        for (text, named) in [
            ("", "empty"),
            ("yesterday", "not begin with a date"),
            ("2025-02-30T10:00:00", "2025-02 has 28 days"),
            ("2025-02-29", "2025-02 has 28 days"),
            ("1900-02-29", "1900-02 has 28 days"),
            ("2025-13-01", "no month 13"),
            ("2025-00-10", "no month 0"),
            ("2025-06-00", "2025-06 has 30 days"),
            ("2025-06-31", "2025-06 has 30 days"),
            ("25-06-09", "not a date"),
            ("09/06/2025", "not a date"),
            ("2025-06", "not a date"),
            ("0001-01-01", "year 1 is outside"),
            ("2025-06-09T25:00:00", "hour 25"),
            ("2025-06-09T24:00:01", "hour 24"),
            ("2025-06-09T10:60:00", "minute 60"),
            ("2025-06-09T10:20:61", "second 61"),
            ("2025-06-09T23:59:60", "no leap second"),
            ("2025-06-09T10:20:60", "no leap second"),
            ("2025-06-09T10", "not a time of day"),
            ("2025-06-09T", "after the T"),
            ("2025-06-09T10:20:00.", "not a time of day"),
            ("2025-06-09T10:20:00:00", "not a time of day"),
            ("2025-06-09T10:20:00+25:00", "outside -14:00 to +14:00"),
            ("2025-06-09T10:20:00+10:60", "outside -14:00 to +14:00"),
            ("2025-06-09T10:20:00+1", ""),
            ("2025-06-09T10:20:00 AEST", "not a zone"),
            ("2025-06-09T10:20:00+10:0", "not a zone"),
            ("2025-06-09T10:20:00Z+10:00", "not a zone"),
            ("60835.4", "not a date"),
        ] {
            match read(text) {
                Err(problem) => assert!(!named.is_empty() && problem.contains(named), "{text}: {problem}"),
                Ok(_) => assert!(named.is_empty(), "{text} was accepted"),
            }
        }
    }

    #[test]
    fn a_leap_second_is_accepted_where_there_was_one_in_any_zone() {
        for text in ["2016-12-31T23:59:60Z", "2017-01-01T09:59:60+10:00", "2015-06-30T20:29:60.5-03:30"] {
            assert!(read(text).is_ok(), "{text}");
        }
        let elapsed_s = |a: &str, b: &str| {
            let tai = |text| read(text).unwrap().epoch.to_time_scale(TimeScale::TAI);
            (tai(b) - tai(a)).to_seconds()
        };
        assert_eq!(elapsed_s("2016-12-31T23:59:59.5Z", "2016-12-31T23:59:60.25Z"), 0.75);
        assert_eq!(elapsed_s("2016-12-31T23:59:60.25Z", "2017-01-01T00:00:00Z"), 0.75);
        assert!(read("2016-12-31T23:59:60+10:00").is_err());
    }

    #[test]
    fn the_calendar_runs_through_without_a_gap() {
        let first = days_from_civil(1900, 1, 1);
        let (mut y, mut m, mut d) = (1900, 1, 1);
        for k in 0..73_000 {
            assert_eq!(civil_from_days(first + k), (y, m, d));
            assert_eq!(days_from_civil(y, m, d), first + k);
            d += 1;
            if d > days_in_month(y, m) {
                (m, d) = (m + 1, 1);
            }
            if m > 12 {
                (y, m) = (y + 1, 1);
            }
        }
        // MJD 40587 is 1970-01-01
        let epoch = Epoch::from_gregorian_utc_at_midnight(2025, 6, 9);
        assert_eq!(days_from_civil(2025, 6, 9) + 40_587, epoch.to_mjd_utc_days() as i64);
    }
}
