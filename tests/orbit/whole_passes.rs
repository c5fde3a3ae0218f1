//! Whole passes: a window that cuts a pass changes nothing but what lies outside it.

use hifitime::{Duration, Epoch};
use satphot::base::time::{iso_utc, parse_utc};
use satphot::orbit::passes::passes;
use satphot::orbit::{EarthOrientation, Elements, Site, Tracker, WholePass, whole_passes};

const ISS: [&str; 3] = [
    "ISS (ZARYA)",
    "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996",
    "2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748",
];
/// Of the verification cases of Vallado et al. 2006 (AIAA 2006-6753): Molniya 2-14, a 12 h orbit of eccentricity 0.69.
const MOLNIYA: [&str; 3] = [
    "MOLNIYA 2-14",
    "1 08195U 75081A   06176.33215444  .00000099  00000-0  11873-3 0   813",
    "2 08195  64.1586 279.0717 6877146 264.7651  20.2257  2.00491383225656",
];
const AMC_4: [&str; 3] = [
    "AMC-4",
    "1 25954U 99060A   04039.68057285 -.00000108  00000-0  00000-0 0  6847",
    "2 25954   0.0004 243.8136 0001765  15.5294  22.7134  1.00271289 15615",
];

fn tracker([name, line1, line2]: [&str; 3], lat_deg: f64, lon_deg: f64) -> Tracker {
    let e = Elements::from_tle(name, line1, line2).unwrap();
    Tracker::new(vec![e], None, Site::new(lat_deg, lon_deg, 70.0).unwrap(), EarthOrientation::default()).unwrap()
}

fn iss() -> Tracker {
    tracker(ISS, -33.7703, 151.1113)
}

fn utc(text: &str) -> Epoch {
    parse_utc("test", text).unwrap()
}

fn s(seconds: f64) -> Duration {
    Duration::from_seconds(seconds)
}

/// The pass of the evening of 9 June 2025, culmination 10:33:12 at 32.1 deg, as a window shows it.
fn evening(tracker: &Tracker, from: &str, length_s: f64) -> WholePass {
    let start = utc(from);
    let mut found = whole_passes(tracker, &start, &(start + s(length_s)), 10f64.to_radians()).unwrap();
    assert_eq!(found.len(), 1, "{from}");
    found.remove(0)
}

#[test]
fn every_window_that_cuts_a_pass_finds_the_same_rise_culmination_and_set() {
    let tracker = iss();
    for (from, length_s, outside) in [
        ("2025-06-09T09:33:00", 7200.0, &[][..]),
        ("2025-06-09T10:32:00", 1800.0, &["rise"]),
        ("2025-06-09T10:35:00", 1800.0, &["rise", "culmination"]),
        ("2025-06-09T10:20:00", 780.0, &["culmination", "set"]),
        ("2025-06-09T10:20:00", 840.0, &["set"]),
        ("2025-06-09T10:34:00", 60.0, &["rise", "culmination", "set"]),
        ("2025-06-09T10:33:00", 30.0, &["rise", "set"]),
        ("2025-06-09T10:31:30", 0.5, &["rise", "culmination", "set"]),
    ] {
        let pass = evening(&tracker, from, length_s);
        let [rise, top, set] = [&pass.rise, &pass.culmination, &pass.set].map(|e| e.as_ref().unwrap());
        assert_eq!(iso_utc(top.epoch, 0), "2025-06-09T10:33:12Z", "{from}");
        assert!((top.alt_rad.to_degrees() - 32.1).abs() < 0.05, "{from}: {}", top.alt_rad.to_degrees());
        for edge in [rise, set] {
            assert!((edge.alt_rad.to_degrees() - 10.0).abs() < 1e-3, "{from}");
        }
        assert!(rise.epoch < top.epoch && top.epoch < set.epoch);
        let start = utc(from);
        assert_eq!(pass.outside(&start, &(start + s(length_s))), outside, "{from}");
    }
}

#[test]
fn windows_slid_over_three_days_agree_with_one_long_window() {
    let tracker = iss();
    let (start, limit) = (utc("2025-06-08T00:00:00"), 5f64.to_radians());
    let all = whole_passes(&tracker, &start, &(start + s(3.0 * 86_400.0)), limit).unwrap();
    let mut cut = 0;
    for k in 0..(3 * 24 * 12) {
        let from = start + s(300.0 * f64::from(k));
        let to = from + s(240.0);
        for pass in whole_passes(&tracker, &from, &to, limit).unwrap() {
            let top = pass.culmination.as_ref().unwrap().epoch;
            // a pass of the long window is cut by neither of its ends here
            let same = all.iter().filter_map(|p| p.culmination.as_ref()).any(|t| (t.epoch - top).abs() < s(0.5));
            assert!(same || top < start || top > start + s(3.0 * 86_400.0), "{} {}", iso_utc(from, 0), iso_utc(top, 0));
            cut += usize::from(!pass.outside(&from, &to).is_empty());
        }
    }
    assert!(cut > 20, "{cut}");
}

#[test]
fn a_geostationary_satellite_has_no_rise_culmination_or_set() {
    let start = utc("2004-02-08T00:00:00");
    for hours in [0.01, 1.0, 72.0] {
        let found = whole_passes(&tracker(AMC_4, 20.0, -101.0), &start, &(start + s(3600.0 * hours)), 0.2).unwrap();
        assert_eq!(found.len(), 1, "{hours}");
        assert!(found[0].rise.is_none() && found[0].culmination.is_none() && found[0].set.is_none());
        assert!(found[0].outside(&start, &(start + s(3600.0 * hours))).is_empty());
        let [from, to] = found[0].searched;
        assert!(start - from >= s(2.0 * 86_400.0 - 600.0) && to - start >= s(2.0 * 86_400.0 - 600.0));
    }
    assert!(whole_passes(&tracker(AMC_4, -33.8, 151.1), &start, &(start + s(86_400.0)), 0.2).unwrap().is_empty());
}

#[test]
fn a_molniya_is_found_whole_from_any_hour_of_its_long_pass() {
    let tracker = tracker(MOLNIYA, 55.0, 37.0);
    let start = utc("2006-06-25T00:00:00");
    let limit = 10f64.to_radians();
    // every 20 s by itself: the truth
    let altitude = |t_s: f64| tracker.altitude_at(&(start + s(t_s))).unwrap();
    let samples: Vec<f64> = (0..(4 * 4320)).map(|k| altitude(20.0 * f64::from(k))).collect();
    let ups: Vec<usize> = (1..samples.len()).filter(|k| samples[k - 1] < limit && samples[*k] >= limit).collect();
    let (rise, set) = ups
        .iter()
        .filter_map(|r| Some((*r, (*r..samples.len()).find(|k| samples[*k] < limit)?)))
        .max_by_key(|(r, set)| set - r)
        .unwrap();
    let top = (rise..set).max_by(|a, b| samples[*a].total_cmp(&samples[*b])).unwrap();
    assert!(set - rise > 3 * 180, "longer than three hours: {}", set - rise);
    for share in [0.02, 0.3, 0.5, 0.7, 0.98] {
        let from = start + s(20.0 * (rise as f64 + share * (set - rise) as f64));
        let found = whole_passes(&tracker, &from, &(from + s(60.0)), limit).unwrap();
        let event = |e: &Option<satphot::orbit::PassEvent>| (e.as_ref().unwrap().epoch - start).to_seconds() / 20.0;
        assert!((event(&found[0].rise) - rise as f64).abs() < 1.0, "{share}");
        assert!((event(&found[0].set) - set as f64).abs() < 1.0, "{share}");
        let highest = found[0].culmination.as_ref().unwrap().alt_rad;
        assert!(
            (highest - samples[top]).abs() < 1e-5 && (event(&found[0].culmination) - top as f64).abs() < 2.0,
            "{share}"
        );
    }
}

#[test]
fn the_search_ends_where_the_elements_do_and_a_limit_above_the_culmination_finds_none() {
    // 14 d after the elements; the window ends inside the age limit, the reach beyond it does not
    let tracker = tracker(AMC_4, 20.0, -101.0);
    let start = utc("2004-02-21T00:00:00");
    let found = whole_passes(&tracker, &start, &(start + s(3600.0)), 0.2).unwrap();
    assert!(found[0].elements_end && found[0].set.is_none());
    let start = utc("2025-06-09T10:20:00");
    assert!(whole_passes(&iss(), &start, &(start + s(1800.0)), 33f64.to_radians()).unwrap().is_empty());
    assert_eq!(passes(&iss(), &start, &(start + s(1800.0)), 32f64.to_radians()).unwrap().len(), 1);
}
