//! UTC as text in and out without losing a digit: days and nanoseconds as whole numbers, leap seconds included.

/// A moment of UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Utc {
    /// Modified Julian Date of the day.
    pub mjd: i64,
    /// Nanoseconds since its midnight; up to 86401e9 in a leap second.
    pub ns: i64,
}

const NS: i64 = 1_000_000_000;
const DAY_NS: i64 = 86_400 * NS;

impl Utc {
    /// Reads `YYYY-MM-DDTHH:MM:SS[.f]Z` strictly; `None` for anything else or a date that does not exist.
    #[must_use]
    pub fn read(text: &str) -> Option<Self> {
        let (whole, fraction) = match text.strip_suffix('Z')?.split_once('.') {
            Some((whole, fraction)) => (whole, fraction),
            None => (text.strip_suffix('Z')?, "0"),
        };
        let b = whole.as_bytes();
        let marks = [(4, b'-'), (7, b'-'), (10, b'T'), (13, b':'), (16, b':')];
        let shaped = b.len() == 19
            && b.iter().enumerate().all(|(i, c)| match marks.iter().find(|(at, _)| *at == i) {
                Some((_, mark)) => c == mark,
                None => c.is_ascii_digit(),
            });
        if !shaped || fraction.is_empty() || fraction.len() > 9 || !fraction.bytes().all(|c| c.is_ascii_digit()) {
            return None;
        }
        let number = |from: usize, to: usize| whole.get(from..to)?.parse::<i64>().ok();
        let (year, month, day) = (number(0, 4)?, number(5, 7)?, number(8, 10)?);
        let (hour, minute, second) = (number(11, 13)?, number(14, 16)?, number(17, 19)?);
        // leap seconds end a June or a December
        let leap = second == 60 && hour == 23 && minute == 59 && matches!((month, day), (6, 30) | (12, 31));
        if hour > 23 || minute > 59 || (second > 59 && !leap) {
            return None;
        }
        let mjd = mjd_of(year, month, day);
        if date_of(mjd) != (year, month, day) {
            return None;
        }
        let scale = 10i64.pow(9 - fraction.len() as u32);
        let ns = ((hour * 60 + minute) * 60 + second) * NS + fraction.parse::<i64>().ok()? * scale;
        Some(Self { mjd, ns })
    }

    /// As one number \[d\], good to 1 µs.
    #[must_use]
    pub fn mjd_d(self) -> f64 {
        self.mjd as f64 + self.ns as f64 / DAY_NS as f64
    }

    /// Year, month, day, hour, minute, second and the digits of its fraction, rounded half up to `decimals` (0 to 9).
    #[must_use]
    pub fn fields(self, decimals: u32) -> [i64; 7] {
        let step = 10i64.pow(9 - decimals.min(9));
        let (mut mjd, mut ns) = (self.mjd, (self.ns + step / 2) / step * step);
        // a leap second keeps its name; only what rounds up past the day moves on
        if (self.ns < DAY_NS && ns >= DAY_NS) || ns >= DAY_NS + NS {
            (mjd, ns) = (mjd + 1, 0);
        }
        let (year, month, day) = date_of(mjd);
        let seconds = ns.min(DAY_NS - NS) / NS;
        let in_minute = ns / NS - seconds / 60 * 60;
        [year, month, day, seconds / 3600, seconds / 60 % 60, in_minute, ns % NS / step]
    }

    /// `2025-06-09T10:33:02.500` rounded to `decimals` (1 to 9), without the Z.
    #[must_use]
    pub fn iso(self, decimals: u32) -> String {
        let [year, month, day, hour, minute, second, fraction] = self.fields(decimals);
        let width = decimals as usize;
        format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{fraction:0width$}")
    }

    /// `20250609_103302`, the second it is in: the name of what began then.
    #[must_use]
    pub fn compact(self) -> String {
        let [year, month, day, hour, minute, second, _] = self.fields(9);
        format!("{year:04}{month:02}{day:02}_{hour:02}{minute:02}{second:02}")
    }
}

/// MJD of a date of the Gregorian calendar (H. Hinnant's days_from_civil).
fn mjd_of(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let of_era = year - era * 400;
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 678_881
}

/// Date of the Gregorian calendar of an MJD.
fn date_of(mjd: i64) -> (i64, i64, i64) {
    let days = mjd + 678_881;
    let era = days.div_euclid(146_097);
    let of_era = days - era * 146_097;
    let year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let shifted = (5 * of_year + 2) / 153;
    let day = of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    (year + era * 400 + i64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_dates_have_their_mjd_and_come_back() {
        for (text, mjd) in [("1858-11-17", 0), ("2000-01-01", 51_544), ("2025-06-09", 60_835), ("2024-02-29", 60_369)] {
            let t = Utc::read(&format!("{text}T00:00:00Z")).unwrap();
            assert_eq!((t.mjd, t.ns), (mjd, 0), "{text}");
            assert_eq!(t.iso(3), format!("{text}T00:00:00.000"));
        }
    }

    #[test]
    fn what_is_no_moment_is_refused() {
        for text in [
            "2025-02-29T00:00:00Z",
            "2025-06-09T23:59:60Z",
            "2025-13-01T00:00:00Z",
            "2025-01-01T24:00:00Z",
            "2025-01-01T12:00:60Z",
            "2025-01-01T00:00:00",
            "2025-01-01 00:00:00Z",
            "2025-01-01T00:00:00.Z",
            "2025-1-01T00:00:00Z",
            "+025-01-01T00:00:00Z",
            "",
            "Z",
            "é025-01-01T00:00:00Z",
        ] {
            assert_eq!(Utc::read(text), None, "{text}");
        }
    }

    #[test]
    fn rounding_carries_over_a_year_and_keeps_a_leap_second() {
        let iso = |text: &str| Utc::read(text).unwrap().iso(3);
        assert_eq!(iso("2025-12-31T23:59:59.9996Z"), "2026-01-01T00:00:00.000");
        assert_eq!(iso("2016-12-31T23:59:60.5Z"), "2016-12-31T23:59:60.500");
        assert_eq!(iso("2025-06-09T10:33:02.4995Z"), "2025-06-09T10:33:02.500");
    }
}
