//! Tests of `clock`.

use std::collections::BTreeMap;

use super::*;
use crate::config::DateObsMeans;

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
fn what_the_header_calls_its_middle_is_held_against_start_and_exposure_whichever_of_them_is_used() {
    let start = "DATE-OBS= '2025-06-09T10:33:00.0'\n";
    let avg = format!("{start}DATE-AVG= '2025-06-09T10:33:02.6'\n");
    let gps = format!("{avg}GPS_SUTC= '2025-06-09T10:33:00.123'\nGPS_EUTC= '2025-06-09T10:33:05.123'\n");
    for cards in [&avg, &gps] {
        assert!((mid(cards, 5.0).unwrap().avg_minus_mid_s.unwrap() - 0.1).abs() < 1e-6, "{cards}");
    }
    assert_eq!(mid(start, 5.0).unwrap().avg_minus_mid_s, None);
    assert_eq!(mid("DATE-AVG= '2025-06-09T10:33:02.6'\n", 5.0).unwrap().avg_minus_mid_s, None);
}

#[test]
fn an_end_far_later_than_the_exposure_is_a_stack_unless_the_configuration_knows_better() {
    let cards = "DATE-OBS= '2025-06-09T10:33:00.0'\nDATE-END= '2025-06-09T10:44:41.0'\n";
    let why = mid(cards, 280.0).unwrap_err().to_string();
    assert!(why.contains("701.000 s") && why.contains("stack") && why.contains("time.date_obs_means"), "{why}");
    let config = config::Time { date_obs_means: DateObsMeans::Start, ..config::Time::default() };
    let t = mid_time(&Header::from_text(cards), 280.0, &config, &BTreeMap::new(), Path::new("x")).unwrap();
    assert!(close(&t, "2025-06-09T10:35:20"), "{t:?}");
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
