//! Every trap of the clock, each by name: headers made here, read as `satphot inspect` reads them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::headers;

use headers::{inspected, inspected_at_macquarie, inspected_with, says, time};

const START: &str = "EXPTIME = 5.0\nDATE-OBS = '2025-06-09T10:33:00.000'\n";

#[test]
fn a_start_gains_half_the_exposure_with_half_a_second_of_error() {
    let i = inspected(START);
    assert_eq!(time(&i), ("2025-06-09T10:33:02.500000Z", "DATE-OBS + EXPTIME/2", 0.5));
    assert_eq!(i.time.unwrap().kind, "start");
}

#[test]
fn the_configuration_wins_over_gps_and_is_printed() {
    let gps = format!("{START}GPS_SUTC = '2025-06-09T10:33:00.100'\nGPS_EUTC = '2025-06-09T10:33:05.100'\n");
    let i = inspected_with(&["time.date_obs_means=\"end\"", "time.offset_s=-0.25"], &gps);
    let (mid, source, _) = time(&i);
    assert_eq!(mid, "2025-06-09T10:32:57.250000Z");
    assert!(source.contains("time.date_obs_means") && source.contains("offset -0.25 s"), "{source}");
    assert_eq!(i.time.as_ref().unwrap().kind, "configured");
    let mid = inspected_with(&["time.date_obs_means=\"mid\"", "time.err_s=0.02"], START);
    assert_eq!((time(&mid).0, time(&mid).2), ("2025-06-09T10:33:00.000000Z", 0.02));
}

#[test]
fn gps_shutter_times_win_need_a_lock_and_carry_the_rolling_shutter() {
    let gps = format!("{START}GPS_SUTC = '2025-06-09T10:33:00.123'\nGPS_EUTC = '2025-06-09T10:33:05.123'\n");
    let i = inspected(&gps);
    assert_eq!(time(&i), ("2025-06-09T10:33:02.623000Z", "(GPS_SUTC + GPS_EUTC)/2", 0.001));
    assert!(says(&i.time_rejected, &["DATE-OBS + EXPTIME/2", "-0.123 s"]), "{:?}", i.time_rejected);
    // 20 us a row over 800 rows: half of 16 ms more
    let rolling = inspected(&format!("{gps}GPS_LP = 20000 / [ns] linePeriod\n"));
    assert!((time(&rolling).2 - 0.009).abs() < 1e-9);
    for status in
        ["GPS_SST = 'not locked'", "GPS_EST = 'just powered on'", "GPS_STAT = '0 sats'", "GPS_SST = 'Unknown'"]
    {
        let i = inspected(&format!("{gps}{status}\n"));
        assert_eq!(time(&i).1, "DATE-OBS + EXPTIME/2", "{status}");
        assert!(says(&i.time_rejected, &["no GPS lock"]) && says(&i.warnings, &["no lock"]), "{status}");
    }
    for status in ["GPS_SST = 'locked and valid'", "GPS_STAT = '9 sats'"] {
        assert_eq!(time(&inspected(&format!("{gps}{status}\n"))).2, 0.001, "{status}");
    }
    // SharpCap writes year 1 when its GPS has lost the lock
    let lost = inspected("EXPTIME = 5.0\nDATE-OBS = '0001-01-01T00:00:00.0000000'\n");
    assert!(lost.time.is_none() && says(&lost.refused, &["lost the lock"]), "{:?}", lost.refused);
}

#[test]
fn start_and_end_in_every_spelling_give_the_middle_to_a_tenth_of_a_second() {
    for pair in [
        "DATE-BEG = '2025-06-09T10:33:00.0'\nDATE-END = '2025-06-09T10:33:05.0'\n",
        "DATE-OBS = '2025-06-09T10:33:00.0'\nDATE-END = '2025-06-09T10:33:05.0'\n",
        "DATE-OBS = '2025-06-09T10:33:00.0'\nUTSTOP = '10:33:05.0'\n",
        "DATE-OBS = '2025-06-09T10:33:00.0'\nDATEEND = '2025-06-09T10:33:05.0'\n",
        "DATE-OBS = '2025-06-09T10:33:00.0'\nEND-OBS = '2025-06-09T10:33:05.0'\n",
        "DATE-OBS = '2025-06-09'\nUT-STR = '10:33:00.0'\nUT-END = '10:33:05.0'\n",
        "MJD-BEG = 60835.439583333334\nMJD-END = 60835.439641203704\n",
    ] {
        let i = inspected(&format!("EXPTIME = 5.0\n{pair}"));
        let (mid, source, err_s) = time(&i);
        assert!(
            mid.starts_with("2025-06-09T10:33:02.5") || mid.starts_with("2025-06-09T10:33:02.499999"),
            "{pair}{mid}"
        );
        assert!((err_s - 0.1).abs() < 1e-3 && source.ends_with(")/2"), "{pair}{source} {err_s}");
    }
    // over midnight
    let i = inspected("EXPTIME = 90\nDATE-OBS = '2020-11-20'\nUT-STR = '23:59:29.2'\nUT-END = '00:00:59.2'\n");
    assert_eq!(time(&i).0, "2020-11-21T00:00:14.200000Z");
}

#[test]
fn the_middle_is_trusted_to_its_distance_from_start_plus_half_the_exposure() {
    for key in ["DATE-AVG", "DATEAVG", "DATE-MID"] {
        let i = inspected(&format!("{START}{key} = '2025-06-09T10:33:02.900'\n"));
        assert_eq!(time(&i), ("2025-06-09T10:33:02.900000Z", key, 0.4));
    }
    let i = inspected(&format!("{START}JD_UTC = 2460835.939612268\n"));
    assert_eq!(time(&i).1, "JD_UTC");
    let i = inspected("EXPTIME = 300.0\nDATE-OBS = '2025-06-09'\nUTSTART = '10:33:00.0'\nUTMIDDLE = '10:35:30.0'\n");
    assert_eq!((time(&i).0, time(&i).1), ("2025-06-09T10:35:30.000000Z", "UTMIDDLE"));
    let far = inspected(&format!("{START}DATE-AVG = '2025-06-09T20:33:02.500'\n"));
    assert_eq!(time(&far).1, "DATE-OBS + EXPTIME/2");
    assert!(says(&far.warnings, &["DATE-AVG", "+10 h", "local time"]), "{:?}", far.warnings);
}

#[test]
fn every_spelling_of_the_start_is_read() {
    for (lines, source) in [
        ("DATE-OBS = '2025-06-09T10:33:00.0'\n", "DATE-OBS"),
        ("DATE-OBS = '2025-06-09 10:33:00.0'\n", "DATE-OBS"),
        ("DATE-OBS = '2025/06/09T10:33:00.0Z'\n", "DATE-OBS"),
        ("DATE-OBS = '2025-06-09'\nTIME-OBS = '10:33:00.0'\n", "DATE-OBS"),
        ("DATE-OBS = '2025-06-09'\nUT = '10:33:00.0'\n", "DATE-OBS"),
        ("DATE-OBS = '2025-06-09'\nUTSTART = '10:33:00.0'\n", "DATE-OBS"),
        ("DATE-OBS = '2025-06-09'\nUTC-OBS = '10:33:00.0'\n", "DATE-OBS"),
        ("DATE-BEG = '2025-06-09T10:33:00.0'\n", "DATE-BEG"),
        ("HIERARCH CAMERA-DATE-OBS = '2025-06-09T10:33:00.0'\n", "CAMERA-DATE-OBS"),
        ("MJD-OBS = 60835.439583333334\n", "MJD-OBS"),
        ("JD = 2460835.9395833333\n", "JD"),
        ("JD = '2460835.9395833333'\n", "JD"),
    ] {
        let i = inspected(&format!("EXPTIME = 5.0\n{lines}"));
        let (mid, from, err_s) = time(&i);
        // a Julian date in one number resolves 40 us
        assert!(
            mid.starts_with("2025-06-09T10:33:02.500") || mid.starts_with("2025-06-09T10:33:02.4999"),
            "{lines}{mid}"
        );
        assert!(from.starts_with(&format!("{source} + EXPTIME/2")) && err_s == 0.5, "{lines}{from} {err_s}");
    }
    let named = inspected_with(
        &["header.aliases.date_obs=[\"SHUTTER\"]"],
        &format!("{START}SHUTTER = '2025-06-09T10:33:01.0'\n"),
    );
    assert_eq!((time(&named).0, time(&named).1), ("2025-06-09T10:33:03.500000Z", "SHUTTER + EXPTIME/2"));
}

#[test]
fn sharpcap_2019_stamps_the_grabbed_frame_and_sharpcap_4_names_start_middle_and_end() {
    let i = inspected("EXPTIME = 2\nDATE-OBS = '2019-04-29T20:25:29.8219583' / System Clock-Frame Grabbed\n");
    assert_eq!(time(&i).0, "2019-04-29T20:25:28.821958Z");
    assert!(time(&i).1.contains("DATE-OBS - EXPTIME/2") && says(&i.warnings, &["SharpCap before version 4"]));
    let v4 = "EXPTIME = 5.0\nDATE-OBS = '2025-06-09T10:33:00.000' / System Clock:Est. Frame Start\n\
              DATE-AVG = '2025-06-09T10:33:02.500' / System Clock:Est. Frame Mid Point\n\
              DATE-END = '2025-06-09T10:33:05.000' / System Clock:Est. Frame End\nSWCREATE = 'SharpCap v4.0'\n";
    let i = inspected(v4);
    // three cards from one clock: no better than the start
    assert_eq!(time(&i), ("2025-06-09T10:33:02.500000Z", "(DATE-OBS + DATE-END)/2", 0.5));
    let alone = inspected("EXPTIME = 5.0\nDATE-OBS = '2025-06-09T10:33:05.0' / System Clock:Est. Frame End\n");
    assert_eq!(time(&alone).0, "2025-06-09T10:33:02.500000Z");
    let middle = inspected("EXPTIME = 5.0\nDATE-OBS = '2025-06-09T10:33:02.5' / System Clock:Est. Frame Mid Point\n");
    assert_eq!(time(&middle).0, "2025-06-09T10:33:02.500000Z");
}

#[test]
fn a_live_stack_is_refused_however_it_is_marked() {
    let sharpcap = "EXPTIME = 280\nDATE-OBS = '2025-06-09T10:33:00.0'\nDATE-END = '2025-06-09T10:44:41.0'\nSWCREATE = 'SharpCap'\n";
    let i = inspected(sharpcap);
    assert!(
        !i.usable && i.time.is_none() && says(&i.refused, &["DATE-END", "701.000 s", "single frames"]),
        "{:?}",
        i.refused
    );
    for card in [
        "STACKCNT = 187",
        "NCOMBINE = 5",
        "SNAPSHOT = 3",
        "NUMFRAME = 30",
        "HISTORY ImageIntegration.numberOfImages: 238",
    ] {
        let i = inspected(&format!("{START}{card}\n"));
        assert!(!i.usable && says(&i.refused, &["stack of several exposures"]), "{card}: {:?}", i.refused);
    }
    assert!(inspected(&format!("{START}SNAPSHOT = 1 / Number of images combined\nNCOMBINE = 1\n")).usable);
    // an end that is a few seconds late is read-out: the start counts, less well known
    let late = inspected(&format!("{START}DATE-END = '2025-06-09T10:33:09.0'\n"));
    assert_eq!(time(&late), ("2025-06-09T10:33:02.500000Z", "DATE-OBS + EXPTIME/2", 2.0));
    assert!(says(&late.warnings, &["DATE-END - DATE-OBS = 9.000 s"]), "{:?}", late.warnings);
}

#[test]
fn indigo_before_2020_wrote_the_end() {
    let i = inspected("EXPTIME = 5.0\nDATE-OBS = '2019-06-09T10:33:05.0'\nSWCREATE = 'INDIGO 2.0-90'\n");
    assert_eq!(time(&i).0, "2019-06-09T10:33:02.500000Z");
    assert!(time(&i).1.contains("INDIGO"), "{}", time(&i).1);
    let later = inspected("EXPTIME = 5.0\nDATE-OBS = '2021-06-09T10:33:05.0'\nSWCREATE = 'INDIGO 2.0-140'\n");
    assert_eq!(time(&later).0, "2021-06-09T10:33:07.500000Z");
}

#[test]
fn local_time_written_as_utc_is_reported() {
    let same = format!("{START}DATE-LOC = '2025-06-09T10:33:00.000'\n");
    assert!(says(&inspected(&same).warnings, &["DATE-LOC equals DATE-OBS"]));
    // at Greenwich that is as it should be
    let greenwich = format!("{same}SITELAT = 51.48\nSITELONG = 0.01\n");
    assert!(!says(&inspected(&greenwich).warnings, &["DATE-LOC"]), "{:?}", inspected(&greenwich).warnings);
    let exchanged = format!("{START}DATE-LOC = '2025-06-09T00:33:00.000'\nSITELAT = -33.77\nSITELONG = 151.11\n");
    assert!(says(&inspected(&exchanged).warnings, &["exchanged"]), "{:?}", inspected(&exchanged).warnings);
    let right = format!("{START}DATE-LOC = '2025-06-09T20:33:00.000'\nSITELAT = -33.77\nSITELONG = 151.11\n");
    assert!(!says(&inspected(&right).warnings, &["DATE-LOC"]), "{:?}", inspected(&right).warnings);
}

#[test]
fn the_sun_above_the_horizon_contradicts_a_night() {
    let night = inspected_at_macquarie(&[], START);
    assert!(night.time.as_ref().unwrap().sun_alt_deg.unwrap() < -40.0 && !says(&night.warnings, &["Sun stood"]));
    // 21:33 local time written as UTC is half past seven in the morning
    let day = inspected_at_macquarie(&[], "EXPTIME = 5.0\nDATE-OBS = '2025-06-09T21:33:00.0'\n");
    assert!(says(&day.warnings, &["Sun stood", "local time", "time.offset_s"]), "{:?}", day.warnings);
}

#[test]
fn whole_seconds_cost_a_second() {
    let i = inspected("EXPTIME = 300\nDATE-OBS = '2018-07-04T14:03:03'\n");
    assert_eq!(time(&i).2, 1.0);
    assert!(says(&i.warnings, &["whole seconds"]), "{:?}", i.warnings);
}

#[test]
fn programs_with_known_latencies_are_named() {
    assert!(says(&inspected(&format!("{START}SWCREATE = 'N.I.N.A. 3.1'\n")).warnings, &["N.I.N.A.", "time.offset_s"]));
    assert!(says(&inspected(&format!("{START}CREATOR = 'Sequence Generator Pro v3.1'\n")).warnings, &["4 s late"]));
    let unclear = inspected("EXPTIME = 10\nDATE-OBS = '2025-05-13T22:48:35.751879' / Image created time\n");
    assert_eq!(time(&unclear).2, 10.0);
    assert!(says(&unclear.warnings, &["does not say whether it is start or end"]), "{:?}", unclear.warnings);
}

#[test]
fn time_scales_and_their_leap_seconds_are_honoured() {
    let at =
        |scale: &str| inspected(&format!("EXPTIME = 0.001\nDATE-OBS = '2025-06-09T10:33:37.0'\nTIMESYS = '{scale}'\n"));
    for (scale, mid) in [
        ("UTC", "10:33:37.000500Z"),
        ("TAI", "10:33:00.000500Z"),
        ("tai", "10:33:00.000500Z"),
        ("GPS", "10:33:19.000500Z"),
        ("TT", "10:32:27.816500Z"),
    ] {
        assert_eq!(time(&at(scale)).0, format!("2025-06-09T{mid}"), "{scale}");
    }
    assert!(says(&at("LOCAL").refused, &["TIMESYS", "LOCAL"]));
    // UTC by name stays UTC with TIMESYS = TAI
    let i = inspected(
        "EXPTIME = 5.0\nTIMESYS = 'TAI'\nDATE-OBS = '2025-06-09T10:33:37.0'\nGPS_SUTC = '2025-06-09T10:33:00.0'\nGPS_EUTC = '2025-06-09T10:33:05.0'\n",
    );
    assert_eq!(time(&i).0, "2025-06-09T10:33:02.500000Z");
    assert!(says(&i.time_rejected, &["DATE-OBS", "0.000 s"]), "{:?}", i.time_rejected);
}

#[test]
fn second_sixty_is_a_leap_second_or_a_rounded_minute() {
    let i = inspected("EXPTIME = 0.001\nDATE-OBS = '2016-12-31T23:59:60.500'\n");
    // counted as the second before, and said to be uncertain by it
    assert!(time(&i).0.starts_with("2016-12-31T23:59:59.5") && time(&i).2 == 1.0, "{:?}", time(&i));
    assert!(says(&i.warnings, &["leap second"]), "{:?}", i.warnings);
    let i = inspected("EXPTIME = 2.0\nDATE-OBS = '2025-06-09T10:33:60.000'\n");
    assert_eq!(time(&i).0, "2025-06-09T10:34:01.000000Z");
    assert!(says(&i.warnings, &["second 60"]), "{:?}", i.warnings);
    assert!(inspected("EXPTIME = 2.0\nDATE-OBS = '2025-06-09T10:33:61.0'\n").time.is_none());
}

#[test]
fn old_dates_are_read_day_first_and_bad_ones_refused() {
    let i = inspected("EXPTIME = 60\nDATE-OBS = '26/10/92'\nTIME-OBS = '03:04:08.0'\n");
    assert_eq!(time(&i).0, "1992-10-26T03:04:38.000000Z");
    assert!(says(&i.warnings, &["day/month/year"]), "{:?}", i.warnings);
    let bad = inspected("EXPTIME = 60\nDATE-OBS = '26/07/102'\nTIME-OBS = '19:36:37'\n");
    assert!(bad.time.is_none() && says(&bad.refused, &["26/07/102"]), "{:?}", bad.refused);
    let saved = inspected("EXPTIME = 60\nDATE-OBS = '26/07/102'\nJD = 2452482.31709 / Time at end of exposure\n");
    assert!(time(&saved).0.starts_with("2002-07-26T19:36:06.57") && time(&saved).1.starts_with("JD - EXPTIME/2"));
    assert!(inspected("EXPTIME = 60\nDATE-OBS = '2025-02-30T10:00:00.0'\n").time.is_none());
}

#[test]
fn the_time_of_writing_is_never_used() {
    let i = inspected("EXPTIME = 60\nDATE = '2025-06-09T10:33:00'\n");
    assert!(i.time.is_none() && !i.usable, "{:?}", i.time);
    let both = inspected(&format!("{START}DATE = '2025-06-09T11:00:00'\n"));
    assert!(says(&both.time_rejected, &["DATE = ", "never used"]));
}

#[test]
fn stamps_that_contradict_each_other_are_reported() {
    let i = inspected(&format!("{START}MJD-OBS = 60835.856250000000\n"));
    assert_eq!(time(&i).1, "DATE-OBS + EXPTIME/2");
    assert!(says(&i.warnings, &["contradict", "+10 h"]), "{:?}", i.warnings);
    // APT's JD is when the file was saved
    let apt = inspected("EXPTIME = 240.\nDATE-OBS = '2018-09-17T21:04:46'\nJD = 2458379.38114583\n");
    assert!(says(&apt.time_rejected, &["JD", "245.000 s late"]) && !says(&apt.warnings, &["contradict"]), "{apt:?}");
}

#[test]
fn a_zone_in_the_stamp_is_subtracted() {
    let i = inspected("EXPTIME = 5.0\nDATE-OBS = '2025-06-09T20:33:00.0+10:00'\n");
    assert_eq!(time(&i).0, "2025-06-09T10:33:02.500000Z");
    assert!(says(&i.warnings, &["time zone"]), "{:?}", i.warnings);
}
