//! Passes of real satellites over the paper's observatory, and the stubborn geometries.

#![allow(clippy::unwrap_used, missing_docs)] // helpers of tests

use std::path::Path;

use hifitime::{Duration, Epoch};
use satphot::orbit::passes::passes;
use satphot::orbit::{EarthOrientation, Elements, Site, Tracker, read_elements};

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data");
const ISS: [&str; 3] = [
    "ISS (ZARYA)",
    "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996",
    "2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748",
];

fn tracker_of(name: &str) -> Option<Tracker> {
    let path = Path::new(SHARED).join("orbits").join(name);
    if !path.exists() {
        println!("skipped: ../shared/data/orbits/{name} not present");
        return None;
    }
    Some(Tracker::new(read_elements(&path).unwrap(), None, macquarie(), EarthOrientation::default()).unwrap())
}

fn macquarie() -> Site {
    Site::new(-33.7703, 151.1113, 70.0).unwrap()
}

fn iss(site: Site) -> Tracker {
    let e = Elements::from_tle(ISS[0], ISS[1], ISS[2]).unwrap();
    Tracker::new(vec![e], None, site, EarthOrientation::default()).unwrap()
}

fn utc(text: &str) -> Epoch {
    format!("{text} UTC").parse().unwrap()
}

#[test]
fn the_iss_stands_at_32_11_degrees_and_748_7_km_on_the_evening_of_9_june() {
    let Some(tracker) = tracker_of("iss_2025_june.tle") else { return };
    let g = tracker.at(&utc("2025-06-09T10:33:12")).unwrap();
    println!("alt {:.4} az {:.4} range {:.3}", g.alt_rad.to_degrees(), g.az_rad.to_degrees(), g.range_km);
    assert!((g.alt_rad.to_degrees() - 32.11).abs() < 0.005);
    assert!((g.range_km - 748.7).abs() < 0.05);
    assert!((g.moon_phase_rad.to_degrees() - 21.1).abs() < 0.06);
    assert!((g.tle_age_d - 1.369).abs() < 0.001);
}

/// File, start of a two-hour window, minute of the culmination, its altitude \[deg\] and the tolerance of the digits.
const PASSES: [(&str, &str, &str, f64, f64); 7] = [
    ("iss_2025_june.tle", "2025-06-09T09:33:00", "2025-06-09T10:33", 32.1, 0.06),
    ("css_2025_june.tle", "2025-06-09T15:30:00", "2025-06-09T16:11", 72.8, 0.06),
    ("iss_2025_june.tle", "2025-06-09T16:20:00", "2025-06-09T17:05", 44.5, 0.06),
    ("iss_2025_june.tle", "2025-06-10T09:00:00", "2025-06-10T09:44", 59.5, 0.06),
    ("iss_2025_june.tle", "2025-06-11T08:10:00", "2025-06-11T08:56", 68.0, 0.6),
    ("iss_2025_june.tle", "2025-06-11T16:20:00", "2025-06-11T17:04", 50.0, 0.6),
    ("iss_2025_june.tle", "2025-06-08T17:10:00", "2025-06-08T17:53", 87.5, 0.06),
];

#[test]
fn the_published_passes_culminate_at_their_computed_minute_and_altitude() {
    for (file, start, minute, alt_deg, tolerance_deg) in PASSES {
        let Some(tracker) = tracker_of(file) else { return };
        let start = utc(start);
        let found = passes(&tracker, &start, &(start + Duration::from_hours(1.4)), 10f64.to_radians()).unwrap();
        assert_eq!(found.len(), 1, "{minute}");
        let top = &found[0].culmination;
        println!(
            "{minute} {} {:.3} rate {:.4} deg/s",
            top.epoch,
            top.alt_rad.to_degrees(),
            top.geometry.rate_rad_s.to_degrees()
        );
        assert!((top.epoch - utc(&format!("{minute}:30"))).abs().to_seconds() < 61.0, "{minute}: {}", top.epoch);
        assert!((top.alt_rad.to_degrees() - alt_deg).abs() < tolerance_deg, "{minute}: {}", top.alt_rad.to_degrees());
        assert!(!found[0].starts_before && !found[0].ends_after);
        for edge in [&found[0].rise, &found[0].set] {
            // 0.01 s of a pass that climbs at most 0.1 deg/s near the horizon.
            assert!((edge.alt_rad.to_degrees() - 10.0).abs() < 1e-3);
        }
    }
}

#[test]
fn the_printed_dates_of_two_passes_are_wrong_the_satellites_were_far_below_the_horizon() {
    let (Some(iss), Some(css)) = (tracker_of("iss_2025_june.tle"), tracker_of("css_2025_june.tle")) else { return };
    let g = iss.at(&utc("2025-06-08T10:33:00")).unwrap();
    assert!((g.alt_rad.to_degrees() + 88.7).abs() < 0.5, "{}", g.alt_rad.to_degrees());
    assert!(g.airmass.is_none());
    let g = css.at(&utc("2025-06-08T16:00:00")).unwrap();
    assert!((g.alt_rad.to_degrees() + 51.0).abs() < 1.0, "{}", g.alt_rad.to_degrees());
}

#[test]
fn daytime_satellites_stand_where_the_telescope_found_them() {
    let orbits = Path::new(SHARED).join("orbits/daytime_passes_2024.tle");
    let table = Path::new(SHARED).join("observations/daytime_public.csv");
    if !(orbits.exists() && table.exists()) {
        println!("skipped: ../shared/data/observations/daytime_public.csv not present");
        return;
    }
    let sets = read_elements(&orbits).unwrap();
    let site = || Site::new(-33.7703, 151.1112, 70.0).unwrap();
    // UT1−UTC of 2024-01-18..29 (IERS). The file's computation has it, too, and no polar motion.
    let eop = EarthOrientation { ut1_utc_s: Some(0.0059), ..Default::default() };
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_path(table).unwrap();
    let header = reader.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let (mut rows, mut worst) = (0, [0.0_f64; 6]);
    for record in reader.records() {
        let record = record.unwrap();
        let number = |name: &str| record[column(name)].parse::<f64>().unwrap();
        let tracker = Tracker::new(sets.clone(), Some(number("norad") as u64), site(), eop).unwrap();
        let g = tracker.at(&utc(&record[column("utc")])).unwrap();
        let pairs = [
            (g.alt_rad.to_degrees(), number("alt_deg")),
            (g.az_rad.to_degrees(), number("az_deg")),
            (g.range_km, number("range_km")),
            (g.height_km, number("sat_height_km")),
            (g.sun_alt_rad.to_degrees(), number("sun_alt_deg")),
            (g.phase_angle_rad.to_degrees(), number("phase_deg")),
        ];
        for (w, (a, b)) in worst.iter_mut().zip(pairs) {
            *w = w.max((a - b).abs());
        }
        rows += 1;
    }
    println!("{rows} rows, worst alt az range height sun_alt phase: {worst:?}");
    assert!(rows > 700);
    // The file rounds to 1e-7 deg and 1e-6 km; polar motion of skyfield is off, so is ours.
    assert!(worst[0] < 1e-4 && worst[1] < 2e-4, "{worst:?}");
    assert!(worst[2] < 1e-3 && worst[3] < 1e-5 && worst[4] < 1e-4 && worst[5] < 2e-3, "{worst:?}");
}

/// The six files as their author wrote them: altitude and azimuth computed for the time of each frame.
const DAYTIME: [(&str, u64); 6] = [
    ("daytime_SAOCOM-43641U.csv", 43641),
    ("daytime_starlink-2242-48587U.csv", 48587),
    ("daytime_starlink-2245-48589U.csv", 48589),
    ("daytime_starlink-30710-57938U.csv", 57938),
    ("daytime_starlink-30775-58139U.csv", 58139),
    ("daytime_starlink-3952-52534U.csv", 52534),
];

#[test]
fn the_authors_own_tables_are_met_to_2_millidegrees_in_altitude_and_6_5_in_azimuth() {
    let orbits = Path::new(SHARED).join("orbits/daytime_passes_2024.tle");
    for (file, norad) in DAYTIME {
        let table = Path::new(SHARED).join("observations").join(file);
        if !(orbits.exists() && table.exists()) {
            println!("skipped: ../shared/data/observations/{file} not present");
            return;
        }
        let site = Site::new(-33.7703, 151.1112, 70.0).unwrap();
        let sets = read_elements(&orbits).unwrap();
        // UT1−UTC of those days (IERS)
        let eop = EarthOrientation { ut1_utc_s: Some(0.0059), ..Default::default() };
        let tracker = Tracker::new(sets, Some(norad), site, eop).unwrap();
        let mut reader = csv::Reader::from_path(table).unwrap();
        let header = reader.headers().unwrap().clone();
        let column = |name: &str| header.iter().position(|h| h == name).unwrap();
        let (mut rows, mut worst_deg) = (0, [0.0_f64; 2]);
        for record in reader.records() {
            let record = record.unwrap();
            let g = tracker.at(&utc(&record[column("datetimes_sat")])).unwrap();
            let number = |name: &str| record[column(name)].parse::<f64>().unwrap();
            let d_az = (g.az_rad.to_degrees() - number("azimuth") + 180.0).rem_euclid(360.0) - 180.0;
            worst_deg[0] = worst_deg[0].max((g.alt_rad.to_degrees() - number("altitude")).abs());
            worst_deg[1] = worst_deg[1].max(d_az.abs());
            rows += 1;
        }
        println!("{file}: {rows} rows, worst altitude and azimuth {worst_deg:.5?} deg");
        // skyfield 1.55 is off by 0.00195 and 0.0065 deg at the most: their axes. From skyfield we are 1e-4 and 2e-4 deg.
        assert!(rows > 20 && worst_deg[0] < 0.00205 && worst_deg[1] < 0.0067, "{file}: {worst_deg:?}");
    }
}

#[test]
fn the_angular_rate_is_that_of_the_line_of_sight_against_the_stars() {
    let tracker = iss(macquarie());
    for minutes in [0.0, 3.0, 6.0, 50.0] {
        let t = utc("2025-06-09T10:30:00") + Duration::from_seconds(60.0 * minutes);
        let dt_s = 0.05;
        let (a, g, b) = (
            tracker.at(&(t - Duration::from_seconds(dt_s))).unwrap(),
            tracker.at(&t).unwrap(),
            tracker.at(&(t + Duration::from_seconds(dt_s))).unwrap(),
        );
        // Turn both Earth-fixed lines of sight to the axes of the middle instant: an inertial difference.
        let inertial = |g: &satphot::orbit::Geometry, dt_s: f64| {
            let (s, c) = (7.292_115e-5 * dt_s).sin_cos();
            let [x, y, z] = (g.satellite_itrs_km - g.observer_itrs_km).unit().unwrap().to_array();
            satphot::base::vector::Vector::<satphot::base::vector::Itrs>::new(c * x - s * y, s * x + c * y, z)
        };
        let (before, after) = (inertial(&a, -dt_s), inertial(&b, dt_s));
        let rate = before.angle_to(&after) / (2.0 * dt_s);
        assert!((rate / g.rate_rad_s - 1.0).abs() < 1e-5, "{minutes}: {rate} {}", g.rate_rad_s);
        let direction = tracker.site().to_enu(&(after - before)).unit().unwrap();
        assert!(direction.angle_to(&g.motion_enu) < 1e-4);
        assert!((g.motion_enu.norm() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn the_rate_of_the_azimuth_is_what_the_azimuth_does_in_a_second_over_the_ground() {
    let tracker = iss(macquarie());
    for seconds in 0..60 {
        let t = utc("2025-06-09T10:28:00") + Duration::from_seconds(10.0 * f64::from(seconds));
        let azimuth = |dt_s: f64| tracker.at(&(t + Duration::from_seconds(dt_s))).unwrap().az_rad;
        let turn = azimuth(0.5) - azimuth(-0.5);
        let turn = (turn + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        let rate = tracker.at(&t).unwrap().az_rate_rad_s;
        // the path bends in a second by a millionth of it, the two epochs are good to a nanosecond
        assert!((turn.abs() - rate).abs() < 1e-6 * (1.0 + rate / 1e-3), "{seconds}: {turn} {rate}");
    }
}

#[test]
fn no_pass_is_missed_or_invented_against_a_search_second_by_second() {
    let tracker = iss(macquarie());
    let (start, hours) = (utc("2025-06-08T03:00:00"), 24.0);
    let end = start + Duration::from_hours(hours);
    let altitudes: Vec<f64> = (0..=(hours * 3_600.0) as i64)
        .map(|s| tracker.altitude_at(&(start + Duration::from_seconds(s as f64))).unwrap())
        .collect();
    let highest = altitudes.iter().copied().fold(f64::MIN, f64::max);
    // The last limit leaves a grazing pass of a few seconds.
    for limit in [0.0, 10f64.to_radians(), 40f64.to_radians(), highest - 1e-4, highest + 1e-3] {
        let brute = altitudes.windows(2).filter(|w| w[0] < limit && w[1] >= limit).count();
        let found = passes(&tracker, &start, &end, limit).unwrap();
        assert_eq!(found.len(), brute, "limit {limit}");
        for p in &found {
            assert!(p.rise.epoch < p.culmination.epoch && p.culmination.epoch < p.set.epoch);
            assert!(p.culmination.alt_rad >= p.rise.alt_rad && p.culmination.alt_rad >= p.set.alt_rad);
            // 0.01 s around rise and set lie on both sides of the limit.
            let near = |e: Epoch, s: f64| tracker.altitude_at(&(e + Duration::from_seconds(s))).unwrap() - limit;
            assert!(near(p.rise.epoch, -0.01) < 0.0 && near(p.rise.epoch, 0.01) > 0.0);
            assert!(near(p.set.epoch, -0.01) > 0.0 && near(p.set.epoch, 0.01) < 0.0);
        }
    }
}

#[test]
fn a_pass_cut_by_the_window_is_flagged_on_the_side_it_is_cut() {
    let tracker = iss(macquarie());
    let top = utc("2025-06-09T10:33:00");
    let found = passes(&tracker, &top, &(top + Duration::from_seconds(60.0 * 30.0)), 0.1).unwrap();
    assert_eq!(found.len(), 1);
    assert!(found[0].starts_before && !found[0].ends_after && found[0].rise.epoch == top);
    let found = passes(&tracker, &(top - Duration::from_seconds(60.0 * 30.0)), &top, 0.1).unwrap();
    assert!(!found[0].starts_before && found[0].ends_after);
    assert!(passes(&tracker, &top, &top, 0.1).is_err());
    assert!(passes(&tracker, &top, &(top - Duration::from_seconds(60.0 * 1.0)), 0.1).is_err());
}

#[test]
fn a_geostationary_satellite_is_up_all_the_time_or_never() {
    let geo = |site: Site| {
        let e = Elements::from_tle(
            "AMC-4",
            "1 25954U 99060A   04039.68057285 -.00000108  00000-0  00000-0 0  6847",
            "2 25954   0.0004 243.8136 0001765  15.5294  22.7134  1.00271289 15615",
        )
        .unwrap();
        Tracker::new(vec![e], None, site, EarthOrientation::default()).unwrap()
    };
    let start = utc("2004-02-08T00:00:00");
    let end = start + Duration::from_days(3.0);
    let (up, never) = (geo(Site::new(20.0, -101.0, 0.0).unwrap()), geo(macquarie()));
    let found = passes(&up, &start, &end, 0.2).unwrap();
    assert_eq!(found.len(), 1);
    assert!(found[0].starts_before && found[0].ends_after);
    assert!((found[0].rise.range_km - 37_000.0).abs() < 2_000.0);
    // Against the stars it moves as the Earth turns, a little less for the observer's own turn.
    assert!((found[0].rise.geometry.rate_rad_s / 7.29e-5 - 1.0).abs() < 0.1);
    assert!(passes(&never, &start, &end, 0.2).unwrap().is_empty());
    assert!(up.age_warning(&start).unwrap().contains("11.5 deg"));
}

#[test]
fn poles_the_zenith_and_the_azimuth_wrap_are_finite() {
    for (lat, lon) in [(90.0, 0.0), (-90.0, 123.0), (0.0, 180.0), (0.0, -180.0), (51.64, 0.0)] {
        let tracker = iss(Site::new(lat, lon, 0.0).unwrap());
        for minute in 0..93 {
            let g =
                tracker.at(&(utc("2025-06-08T02:00:00") + Duration::from_seconds(60.0 * f64::from(minute)))).unwrap();
            let all = [
                g.alt_rad,
                g.az_rad,
                g.range_km,
                g.rate_rad_s,
                g.phase_angle_rad,
                g.sun_az_rad,
                g.moon_az_rad,
                g.moon_sep_rad,
            ];
            assert!(all.iter().all(|v| v.is_finite()), "{lat} {minute}: {all:?}");
            assert!((0.0..std::f64::consts::TAU).contains(&g.az_rad));
            assert!((380.0..460.0).contains(&g.height_km), "{}", g.height_km);
        }
    }
    // The observer right below the satellite.
    let below = iss(macquarie()).at(&utc("2025-06-08T02:00:00")).unwrap().satellite_itrs_km;
    let [x, y, z] = below.to_array();
    let geocentric = (z / x.hypot(y)).atan();
    let lat = (geocentric.tan() / (1.0 - 1.0 / 298.257_223_563_f64).powi(2)).atan().to_degrees();
    let g = iss(Site::new(lat, y.atan2(x).to_degrees(), 0.0).unwrap()).at(&utc("2025-06-08T02:00:00")).unwrap();
    // Geodetic latitude of the point on the geocentric ray: within 0.2° · 420/6800 of the vertical, seen 15 times closer.
    assert!(g.alt_rad.to_degrees() > 89.7, "{}", g.alt_rad.to_degrees());
    assert!((g.airmass.unwrap() - 0.9997).abs() < 1e-4);
    assert!((g.range_km - g.height_km).abs() < 0.1);
}

#[test]
fn a_culmination_in_the_first_or_last_seconds_of_the_window_is_found() {
    let tracker = iss(macquarie());
    let top = utc("2025-06-09T10:33:12");
    for (from_s, to_s) in [(-5.0, 300.0), (-300.0, 5.0), (-5.0, 5.0)] {
        let (start, end) = (top + Duration::from_seconds(from_s), top + Duration::from_seconds(to_s));
        let found = passes(&tracker, &start, &end, 0.1).unwrap();
        assert_eq!(found.len(), 1);
        assert!((found[0].culmination.epoch - top).abs().to_seconds() < 0.5, "{}", found[0].culmination.epoch);
    }
}

#[test]
fn passes_of_an_eccentric_orbit_agree_with_a_search_every_five_seconds() {
    let molniya = Elements::from_tle(
        "MOLNIYA 1-83",
        "1 21897U 92011A   06176.02341244 -.00001273  00000-0 -13525-3 0  3044",
        "2 21897  62.1749 198.0096 7421690 253.0462  20.1561  2.01269994104880",
    )
    .unwrap();
    for lat in [-33.77, 60.0, -75.0] {
        let site = Site::new(lat, 30.0, 0.0).unwrap();
        let tracker = Tracker::new(vec![molniya.clone()], None, site, EarthOrientation::default()).unwrap();
        let (start, days) = (utc("2006-06-25T00:00:00"), 3.0);
        let alt = |s: i64| tracker.altitude_at(&(start + Duration::from_seconds(5.0 * s as f64))).unwrap();
        let altitudes: Vec<f64> = (0..=(days * 17_280.0) as i64).map(alt).collect();
        for limit in [0.0, 0.3, 0.9] {
            let ups = altitudes.windows(2).filter(|w| w[0] < limit && w[1] >= limit).count();
            let brute = ups + usize::from(altitudes[0] >= limit);
            let found = passes(&tracker, &start, &(start + Duration::from_days(days)), limit).unwrap();
            assert_eq!(found.len(), brute, "{lat} {limit}");
        }
    }
}

/// UTC, then UT1−UTC \[s\], xp, yp \[arcsec\] (IERS), then altitude and azimuth of Sun, Moon and ISS \[deg\] without
/// air, from astropy 8.0.2 with DE421 and sgp4 2.27.
type Horizon = (&'static str, [f64; 3], [f64; 6]);
const ASTROPY: [Horizon; 4] = [
    (
        "2025-06-09T10:33:12",
        [0.0296574, 0.125382, 0.441729],
        [-44.8023427, 269.8606771, 64.1770214, 74.6966530, 32.1055428, 217.7147138],
    ),
    (
        "2025-06-08T17:53:30",
        [0.0292460, 0.124349, 0.441399],
        [-37.0714401, 85.3071493, 10.1309603, 251.2752734, 85.1330467, 195.8633521],
    ),
    (
        "2025-06-09T17:04:00",
        [0.0298407, 0.125766, 0.441859],
        [-47.4221829, 91.9065883, 30.6949016, 259.3653693, 31.9018377, 189.1193094],
    ),
    (
        "2025-06-10T09:46:30.25",
        [0.0303717, 0.126747, 0.442220],
        [-35.1088347, 276.0574614, 45.7888525, 94.6229490, 24.1334716, 148.5277077],
    ),
];

#[test]
fn sun_moon_and_satellite_stand_on_the_horizon_where_astropy_puts_them() {
    for (text, [ut1_utc_s, xp_arcsec, yp_arcsec], expected) in ASTROPY {
        let eop = EarthOrientation { ut1_utc_s: Some(ut1_utc_s), xp_arcsec, yp_arcsec };
        let e = Elements::from_tle(ISS[0], ISS[1], ISS[2]).unwrap();
        let g = Tracker::new(vec![e], None, macquarie(), eop).unwrap().at(&utc(text)).unwrap();
        let got =
            [g.sun_alt_rad, g.sun_az_rad, g.moon_alt_rad, g.moon_az_rad, g.alt_rad, g.az_rad].map(f64::to_degrees);
        let off_arcsec = |i: usize| {
            let across = (got[i + 1] - expected[i + 1]) * expected[i].to_radians().cos();
            (got[i] - expected[i]).hypot(across) * 3_600.0
        };
        let (sun, moon, satellite) = (off_arcsec(0), off_arcsec(2), off_arcsec(4));
        println!("{text}: Sun {sun:.3}, Moon {moon:.2}, ISS {satellite:.4} arcsec");
        // The theories: 0.01″ and 10″; the satellite shares SGP4 and differs by the rounding of the epoch.
        assert!(sun < 0.05 && moon < 10.0 && satellite < 0.01, "{text}: {sun} {moon} {satellite}");
    }
}

#[test]
#[ignore = "prints times; run with --ignored --nocapture"]
fn cost_of_one_geometry_and_of_a_day_of_passes() {
    let tracker = iss(macquarie());
    let start = utc("2025-06-08T02:00:00");
    let clock = std::time::Instant::now();
    let mut sum = 0.0;
    for s in 0..2_000 {
        sum += tracker.at(&(start + Duration::from_seconds(f64::from(s)))).unwrap().alt_rad;
    }
    println!("geometry {:.1} us ({sum:.1})", clock.elapsed().as_secs_f64() * 1e6 / 2_000.0);
    let clock = std::time::Instant::now();
    let n = passes(&tracker, &start, &(start + Duration::from_days(10.0)), 0.1).unwrap().len();
    println!("{n} passes of 10 days in {:.1} ms", clock.elapsed().as_secs_f64() * 1e3);
}

#[test]
fn a_tracker_from_the_configuration_keeps_its_age_limit_and_names_a_missing_file() {
    use satphot::config;
    let folder = tempfile::tempdir().unwrap();
    let elements = folder.path().join("iss.tle");
    std::fs::write(&elements, ISS.join("\n")).unwrap();
    let site = config::Site { name: "Macquarie".into(), lat_deg: -33.7703, lon_deg: 151.1113, alt_m: 70.0 };
    let mut orbit = config::Orbit {
        elements,
        norad_cat_id: None,
        max_age_d: 3.0,
        force_age: false,
        ut1_utc_s: None,
        xp_arcsec: 0.0,
        yp_arcsec: 0.0,
    };
    let tracker = Tracker::from_config(&orbit, &site).unwrap();
    assert_eq!(tracker.names(), ["ISS (ZARYA)", "ISS", "25544", "1998-067A"].map(str::to_owned));
    let (fresh, stale) = (utc("2025-06-10T00:00:00"), utc("2025-06-12T00:00:00"));
    assert!(tracker.at(&fresh).is_ok() && tracker.age_warning(&fresh).is_none());
    assert!(tracker.at(&stale).unwrap_err().to_string().contains("orbit.max_age_d = 3 d"));
    orbit.force_age = true;
    let forced = Tracker::from_config(&orbit, &site).unwrap();
    assert!(forced.at(&stale).is_ok() && forced.age_warning(&stale).unwrap().contains("3.9 d"));
    orbit.elements = folder.path().join("none.tle");
    assert!(Tracker::from_config(&orbit, &site).unwrap_err().to_string().contains("none.tle"));
}

#[test]
fn the_track_runs_on_through_a_leap_second_and_a_new_year() {
    let e = Elements::from_tle(
        "ISS (ZARYA)",
        "1 25544U 98067A   16366.50000000  .00008601  00000+0  15816-3 0  9995",
        ISS[2],
    )
    .unwrap();
    let propagator = satphot::orbit::Propagator::new(&e).unwrap();
    let moved_s = |from: &str, to: &str| {
        let ((p, v), (q, _)) = (propagator.state(&utc(from)).unwrap(), propagator.state(&utc(to)).unwrap());
        (q - p).norm() / v.norm()
    };
    // From :59 over :60 to :00 two seconds pass.
    let s = moved_s("2016-12-31T23:59:59", "2017-01-01T00:00:00");
    assert!((s - 2.0).abs() < 0.001, "{s}");
    let s = moved_s("2017-12-31T23:59:59", "2018-01-01T00:00:00");
    assert!((s - 1.0).abs() < 0.001, "{s}");
}
