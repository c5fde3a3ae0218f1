//! One instant in the scales that ERFA requires: TT and UT1 as two-part Julian dates.
//!
//! Days. TDB is taken equal to TT (they differ by less than 2 ms: 60 m of the Earth's path, 0.00008″ of the Sun).
//! During a leap second UT1 repeats one second, as the UTC labels do.

use hifitime::{Epoch, TimeScale, Unit};

/// Julian date of MJD 0 \[d\].
const JD_OF_MJD_0: f64 = 2_400_000.5;
/// Nanoseconds in a day.
const NS_PER_DAY: i128 = 86_400_000_000_000;
/// MJD of 1900-01-01, from which hifitime counts UTC \[d\].
const MJD_OF_1900: i128 = 15_020;

/// A Julian date as whole and fraction \[d\]; the sum would lose 40 µs.
pub type TwoPartJd = (f64, f64);

/// Terrestrial time as a two-part Julian date \[d\].
#[must_use]
pub fn tt(epoch: &Epoch) -> TwoPartJd {
    split(epoch.to_mjd_tt_duration().total_nanoseconds())
}

/// UT1 as a two-part Julian date \[d\]: UT1 = UTC + (UT1 − UTC), with `ut1_utc_s` from IERS Bulletin A.
#[must_use]
pub fn ut1(epoch: &Epoch, ut1_utc_s: f64) -> TwoPartJd {
    let (day, fraction) = split(epoch.to_utc_duration().total_nanoseconds() + MJD_OF_1900 * NS_PER_DAY);
    (day, fraction + ut1_utc_s / 86_400.0)
}

/// Modified Julian Date of UTC \[d\].
#[must_use]
pub fn mjd_utc_d(epoch: &Epoch) -> f64 {
    epoch.to_mjd_utc_days()
}

/// The date of an MJD (UTC), `2025-06-09`, for messages.
#[must_use]
pub fn date_text(mjd_d: f64) -> String {
    utc_text(&Epoch::from_mjd_utc(mjd_d)).chars().take(10).collect()
}

/// Elapsed (SI) time from `from` to `to` \[d\]; leap seconds in between are counted.
#[must_use]
pub fn days_between(from: &Epoch, to: &Epoch) -> f64 {
    // In TAI: the difference of two UTC labels would leave leap seconds out.
    (to.to_time_scale(TimeScale::TAI) - from.to_time_scale(TimeScale::TAI)).to_unit(Unit::Day)
}

/// UTC as ISO text to the second, with Z, for messages.
#[must_use]
pub fn utc_text(epoch: &Epoch) -> String {
    let (y, mo, d, h, mi, s, _) = epoch.to_gregorian_utc();
    format!("{y:04}-{mo:02}-{d:02}T{h:02}:{mi:02}:{s:02}Z")
}

fn split(mjd_ns: i128) -> TwoPartJd {
    (JD_OF_MJD_0 + mjd_ns.div_euclid(NS_PER_DAY) as f64, mjd_ns.rem_euclid(NS_PER_DAY) as f64 / NS_PER_DAY as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn j2000_is_noon_tt_and_utc_lags_it_by_64_184_s() {
        let epoch = Epoch::from_gregorian_utc(2000, 1, 1, 11, 58, 55, 816_000_000);
        let (day, fraction) = tt(&epoch);
        assert_eq!(day + fraction, 2_451_545.0);
        let (day, fraction) = ut1(&epoch, 0.0);
        assert!((day - 2_451_544.5).abs() < 1e-9);
        assert!((fraction * 86_400.0 - (43_200.0 - 64.184)).abs() < 1e-9);
    }

    #[test]
    fn elapsed_time_counts_the_leap_second_of_2016() {
        let before = Epoch::from_gregorian_utc_hms(2016, 12, 31, 23, 0, 0);
        let after = Epoch::from_gregorian_utc_hms(2017, 1, 1, 0, 0, 0);
        assert!((days_between(&before, &after) * 86_400.0 - 3_601.0).abs() < 1e-9);
    }
}
