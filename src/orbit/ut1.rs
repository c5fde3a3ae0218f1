//! UT1 − UTC of the embedded IERS table: how far the Earth has turned.
//!
//! Seconds. UT1 − TAI, which no leap second breaks, is interpolated on a straight line between rows 20 d apart: within
//! 5 ms of every day of IERS C04 and Bulletin A (2.3 m of the ground at the equator). Polar motion is excluded.

use std::sync::OnceLock;

use hifitime::Epoch;

use super::time::{date_text, mjd_utc_d};

/// `mjd_utc_d,ut1_tai_s` from 1972 on. Source: IERS EOP 20 C04 and Bulletin A, by `scripts/make_ut1_table.py`.
const TABLE: &str = include_str!("../presets/ut1_tai.csv");
/// Key of the comment that says up to which day the values are measured; the rest is the prediction of Bulletin A.
const MEASURED: &str = "# measured_to_mjd_d = ";
/// UTC is kept within this of UT1 \[s\] (ITU-R TF.460): what an unknown UT1 − UTC costs at most.
const LARGEST_S: f64 = 0.9;

/// The rows of the table: MJD (UTC) \[d\] and UT1 − TAI \[s\]; and the last measured day.
struct Ut1Table {
    rows: Vec<(f64, f64)>,
    measured_to_mjd_d: f64,
}

fn table() -> &'static Ut1Table {
    static ROWS: OnceLock<Ut1Table> = OnceLock::new();
    ROWS.get_or_init(|| {
        let row = |line: &str| {
            let (mjd, value) = line.split_once(',')?;
            Some((mjd.parse().ok()?, value.trim().parse().ok()?))
        };
        let measured = TABLE.lines().find_map(|l| l.strip_prefix(MEASURED)?.trim().parse().ok());
        Ut1Table { rows: TABLE.lines().filter_map(row).collect(), measured_to_mjd_d: measured.unwrap_or(f64::NAN) }
    })
}

/// UT1 − UTC \[s\] at an instant. Beyond the table: that of its last day; 0 before 1972, when UTC followed UT1 to 0.1
/// s.
#[must_use]
pub fn ut1_utc_s(epoch: &Epoch) -> f64 {
    let rows = &table().rows;
    let mjd_d = mjd_utc_d(epoch);
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return 0.0 };
    if mjd_d < first.0 {
        return 0.0;
    }
    if mjd_d >= last.0 {
        // no leap second is announced beyond the table
        return last.1 + tai_utc_s(epoch);
    }
    let after = rows.partition_point(|r| r.0 <= mjd_d).max(1);
    let ((a_d, a_s), (b_d, b_s)) = (rows[after - 1], rows[after]);
    a_s + (b_s - a_s) * (mjd_d - a_d) / (b_d - a_d) + tai_utc_s(epoch)
}

/// TAI − UTC \[s\], by the same labels that [`super::time::ut1`] counts from: the sum does not break at a leap second.
fn tai_utc_s(epoch: &Epoch) -> f64 {
    (epoch.to_tai_duration() - epoch.to_utc_duration()).to_seconds()
}

/// The days the table covers, as words for messages: `1972-01-01 to 2027-10-29 (predicted from 2026-10-23)`.
#[must_use]
pub fn coverage() -> String {
    let t = table();
    let ends = [t.rows.first(), t.rows.last()].map(|row| row.map_or(f64::NAN, |r| r.0)).map(date_text);
    format!("{} to {} (predicted from {})", ends[0], ends[1], date_text(t.measured_to_mjd_d + 1.0))
}

/// What to tell the observer about an instant the table does not reach; `None` inside it.
#[must_use]
pub fn warning(epoch: &Epoch) -> Option<String> {
    let mjd_d = mjd_utc_d(epoch);
    let rows = &table().rows;
    let (first, last) = (rows.first()?.0, rows.last()?.0);
    if (first..=last).contains(&mjd_d) {
        return None;
    }
    let used = if mjd_d < first { "0 s is used".to_owned() } else { format!("{:.3} s is used", ut1_utc_s(epoch)) };
    Some(format!(
        "UT1 - UTC on {} is not known: the IERS table of this version covers {}; {used}, which may be wrong by \
         {LARGEST_S} s at most (0.4 km on the ground at the equator); orbit.ut1_utc_s sets it",
        date_text(mjd_d),
        coverage()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_whole_and_in_order() {
        let t = table();
        assert!(t.rows.len() > 1000 && t.rows.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 > w[1].1 - 0.03));
        assert!(t.rows[0].0 == 41_317.0 && t.measured_to_mjd_d > 61_000.0);
        assert_eq!(TABLE.lines().filter(|l| l.starts_with(char::is_numeric)).count(), t.rows.len());
    }

    #[test]
    fn values_are_those_of_iers_c04_within_5_ms() {
        // IERS EOP 20 C04 at 0 h UTC, days between the rows of the table.
        for (y, m, d, c04_s) in C04 {
            let epoch = Epoch::from_gregorian_utc_at_midnight(y, m, d);
            assert!((ut1_utc_s(&epoch) - c04_s).abs() < 0.005, "{y}-{m}-{d}: {} {c04_s}", ut1_utc_s(&epoch));
        }
    }

    #[test]
    fn ut1_runs_on_through_a_leap_second() {
        // UT1 as the rotation of the Earth uses it, second by second of TAI through 2016-12-31T23:59:60
        let first = Epoch::from_gregorian_utc_hms(2016, 12, 31, 23, 59, 0).to_time_scale(hifitime::TimeScale::TAI);
        let ut1_s = |k: i64| {
            let epoch = first + k * hifitime::Unit::Second;
            let (day, fraction) = crate::orbit::time::ut1(&epoch, ut1_utc_s(&epoch));
            (day - 2_457_753.5 + fraction) * 86_400.0
        };
        for k in 0..120 {
            assert!((ut1_s(k + 1) - ut1_s(k) - 1.0).abs() < 1e-5, "{k}: {}", ut1_s(k + 1) - ut1_s(k));
        }
        let day = |y, m, d| ut1_utc_s(&Epoch::from_gregorian_utc_at_midnight(y, m, d));
        assert!((day(2017, 1, 1) - day(2016, 12, 31) - 1.0).abs() < 0.005);
    }

    #[test]
    fn beyond_the_table_it_is_said() {
        let at = |y: i32| Epoch::from_gregorian_utc_at_midnight(y, 6, 1);
        assert!(warning(&at(1975)).is_none() && warning(&at(2025)).is_none());
        let (past, future) = (warning(&at(1965)).unwrap(), warning(&at(2060)).unwrap());
        assert!(past.contains("1965-06-01") && past.contains("1972-01-01"), "{past}");
        assert!(future.contains("2060-06-01") && future.contains("orbit.ut1_utc_s"), "{future}");
        assert_eq!(ut1_utc_s(&at(1965)), 0.0);
        assert_eq!(ut1_utc_s(&at(2060)), ut1_utc_s(&at(2070)));
    }

    const C04: [(i32, u8, u8, f64); 18] = [
        (1972, 3, 11, -0.2723520),
        (1972, 6, 30, -0.6349935),
        (1972, 7, 1, 0.3621956),
        (1975, 6, 15, 0.2371561),
        (1979, 12, 31, -0.3526975),
        (1983, 7, 1, 0.7503454),
        (1990, 9, 3, -0.1261528),
        (1994, 6, 30, -0.2160243),
        (1998, 12, 31, -0.2823296),
        (1999, 1, 1, 0.7166654),
        (2005, 3, 9, -0.5564833),
        (2012, 6, 30, -0.5868284),
        (2012, 7, 1, 0.4132541),
        (2016, 12, 31, -0.4077697),
        (2017, 1, 1, 0.5912870),
        (2020, 2, 29, -0.2042684),
        (2025, 6, 9, 0.0293605),
        (2026, 9, 1, 0.0024534),
    ];
}
