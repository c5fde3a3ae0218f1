//! `satphot plan-night`: each row against the engine and the noise written out, ranks and schedule by their definition, and what
//! must not be guessed: which Starlink it is, what saturates, which elements are too old.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;

use satphot::base::time::{mjd_utc, parse_utc};
use satphot::brightness::scene::scene;
use satphot::brightness::{Model, ModelSettings, Satellite};
use satphot::orbit::{EarthOrientation, Elements, Site, Tracker, bodies, sun_altaz};
use support::{RunOutput, satphot};

const ISS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/night/iss-2025-june.tle");
const NIGHT: [&str; 4] = ["--site", "-33.7703,151.1113,70", "--date", "2025-06-09"];
const V2: [&str; 2] = ["--model", "STARLINK*=starlink-v2"];

type Cells = HashMap<String, String>;

/// A line of elements with its checksum.
fn line(text: &str) -> String {
    let sum: u32 = text.chars().map(|c| c.to_digit(10).unwrap_or(u32::from(c == '-'))).sum();
    format!("{text}{}", sum % 10)
}

/// Elements of n satellites on circular orbits at 550 km, all around the Earth.
fn shell(n: usize) -> String {
    let mut text = String::new();
    for i in 0..n {
        let (number, node) = (44_000 + i, 360.0 * (i % 12) as f64 / 12.0);
        let anomaly = 360.0 * (i as f64 * 0.618_034).fract();
        let first = format!("1 {number:05}U 19074A   25160.50000000  .00000000  00000+0  00000+0 0  999");
        let second = format!("2 {number:05}  53.0500 {node:8.4} 0001632 195.4618 {anomaly:8.4} 15.06000000 1000");
        writeln!(text, "STARLINK-{}\n{}\n{}", 1000 + i, line(&first), line(&second)).unwrap();
    }
    text
}

fn planned(text: &str, more: &[&str]) -> RunOutput {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("all.tle"), text).unwrap();
    plan_in(folder.path(), more)
}

fn plan_in(folder: &Path, more: &[&str]) -> RunOutput {
    satphot(folder, &[&["plan-night", "--elements", "all.tle", "--csv"][..], &NIGHT, more].concat())
}

fn rows(text: &str) -> Vec<Cells> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().map(Result::unwrap).collect()
}

fn number(row: &Cells, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} of {row:?}"))
}

fn of_status<'a>(rows: &'a [Cells], status: &str) -> Vec<&'a Cells> {
    rows.iter().filter(|r| r["status"] == status).collect()
}

/// The tracker of one satellite of [`shell`].
fn tracker(text: &str, number: &str) -> Tracker {
    let lines: Vec<&str> = text.lines().collect();
    let at = lines.iter().position(|l| l.starts_with(&format!("1 {number}"))).unwrap();
    let set = Elements::from_tle(lines[at - 1], lines[at], lines[at + 1]).unwrap();
    let site = Site::new(-33.7703, 151.1113, 70.0).unwrap();
    Tracker::new(vec![set], None, site, EarthOrientation::default()).unwrap()
}

#[test]
fn every_row_is_the_engine_and_the_noise_at_its_best_moment() {
    let text = shell(24);
    let output =
        planned(&text, &[&V2[..], &["--tolerance", "1e-5", "--zp-mag", "22.4", "--exptime-s", "0.02"]].concat());
    let rows = rows(&output.expect(0, &[]).out);
    let seen = of_status(&rows, "observable");
    assert!(seen.len() >= 5, "{}", seen.len());
    let model = Model::new(&Satellite::named("starlink-v2").unwrap(), &ModelSettings::default()).unwrap();
    for row in rows.iter().filter(|r| !r["snr"].is_empty()) {
        let tracker = tracker(&text, &row["norad_cat_id"]);
        // the row has the moment to a second; a step later or earlier is not meant
        let geometry = tracker.at(&satphot::base::time::from_mjd_utc(number(row, "mjd_best_d"))).unwrap();
        assert!((number(row, "alt_deg") - geometry.alt_rad.to_degrees()).abs() < 1e-4);
        assert!(number(row, "sun_alt_deg") <= -6.0 + 1e-3 && number(row, "alt_deg") >= 20.0 - 1e-6, "{row:?}");
        let want = model.brightness(&scene(&geometry)).unwrap();
        let v = want.total_v_mag.unwrap();
        assert!((number(row, "model_v_mag") - v).abs() < 1e-3, "{v} {row:?}");
        // Ω = 10^(0.4 (μ − V)) [arcsec²]; N = (sky + dark) t + RN², summed over the object and the noise area of a star
        let omega = 10f64.powf(0.4 * (want.mu_mean_mag_arcsec2.unwrap() - v));
        let (pixel, fwhm, t) = (0.195_748_528_9f64, 2.0f64, number(row, "exptime_s"));
        let n_px = (omega + 2.266_18 * fwhm * fwhm) / pixel.powi(2);
        let rate = 10f64.powf(-0.4 * (v + 0.172 * geometry.airmass.unwrap() - 22.4));
        let sky = 10f64.powf(-0.4 * (number(row, "sky_mag_arcsec2") - 22.4)) * pixel.powi(2);
        let (signal, noise) = (rate * t, n_px * ((sky + 0.005) * t + 1.45f64.powi(2)));
        let snr = signal / (signal + noise).sqrt();
        assert!((number(row, "snr") / snr - 1.0).abs() < 3e-3, "{snr} {row:?}");
        assert!(t <= 0.02 && number(row, "unsaturated_exptime_s") >= t * (1.0 - 1e-9));
    }
}

#[test]
fn ranks_are_by_the_time_needed_and_nothing_in_the_schedule_overlaps() {
    let output = planned(&shell(60), &[&V2[..], &["--zp-mag", "22.4", "--slew-s", "90"]].concat()).expect(0, &[]);
    let rows = rows(&output.out);
    let seen = of_status(&rows, "observable");
    assert!(seen.len() > 15 && rows[..seen.len()].iter().all(|r| r["status"] == "observable"));
    for (i, row) in seen.iter().enumerate() {
        assert_eq!(row["rank"], (i + 1).to_string());
    }
    for pair in seen.windows(2) {
        assert!(number(pair[0], "needed_exptime_s") <= number(pair[1], "needed_exptime_s") * (1.0 + 1e-9));
    }
    let second = |row: &Cells, column: &str| 86_400.0 * mjd_utc(parse_utc(column, &row[column]).unwrap());
    let span = |row: &Cells| (second(row, "date_beg"), second(row, "date_end"));
    let apart = |a: &Cells, b: &Cells| span(a).0 > span(b).1 + 89.0 || span(b).0 > span(a).1 + 89.0;
    for (i, row) in seen.iter().enumerate() {
        let (beg, end) = span(row);
        assert!(beg <= end && end - beg <= 601.0, "{row:?}");
        assert!((beg - 1.0..=end + 1.0).contains(&second(row, "date_best")), "{row:?}");
        // whoever waits has a better one in the schedule in its way
        let in_the_way = seen[..i].iter().any(|other| other["scheduled"] == "1" && !apart(row, other));
        assert_eq!(row["scheduled"] == "1", !in_the_way, "{row:?}");
        let overlapping: Vec<usize> = (0..seen.len()).filter(|j| *j != i && !apart(row, seen[*j])).collect();
        assert_eq!(row["n_conflicts"], overlapping.len().to_string());
        let first = overlapping.first().map(|j| (j + 1).to_string()).unwrap_or_default();
        assert_eq!(row["conflicts_with"], first);
    }
}

#[test]
fn a_finer_step_finds_no_better_moment_by_more_than_a_step_allows() {
    let best = |step: &str| -> HashMap<String, f64> {
        let more = [&V2[..], &["--step-s", step, "--zp-mag", "22.4", "--min-alt", "30"]].concat();
        let rows = rows(&planned(&shell(30), &more).expect(0, &[]).out);
        let needed =
            |r: &Cells| (r["norad_cat_id"].clone() + &r["date_end"][..15], r["needed_exptime_s"].parse().unwrap());
        rows.iter().filter(|r| r["status"] == "observable" && !r["needed_exptime_s"].is_empty()).map(needed).collect()
    };
    let (coarse, fine) = (best("30"), best("2"));
    let both: Vec<f64> = coarse.iter().filter_map(|(key, t)| Some((fine.get(key)? / t).ln())).collect();
    assert!(both.len() > 5, "{} {}", coarse.len(), fine.len());
    assert!(both.iter().all(|d| *d < 1e-3), "the finer step is never worse: {both:?}");
    let median = satphot::base::stats::median(&mut both.iter().map(|d| d.abs()).collect::<Vec<_>>()).unwrap();
    assert!(median < 0.01, "{median}");
}

#[test]
fn which_design_an_object_is_of_is_not_guessed() {
    let mut text = shell(3);
    let unknown = text.replace("STARLINK-1000", "COSMOS 1").replace("STARLINK-1001", "ISS (ZARYA)");
    text = unknown;
    let rows_of = |more: &[&str], words: &[&str]| rows(&planned(&text, more).expect(0, words).out);
    let plain = rows_of(&[], &["several models list this object: starlink-v1.0", "--model OBJECT=NAME"]);
    for row in &plain {
        match row["object_name"].as_str() {
            "COSMOS 1" => assert_eq!(row["status"], "no_model", "{row:?}"),
            "ISS (ZARYA)" => assert_eq!(row["model"], "iss"),
            _ => {
                assert_eq!((row["status"].as_str(), row["model"].as_str(), row["rank"].as_str()), ("no_model", "", ""))
            }
        }
        assert!(row["status"] != "no_model" || row["model_v_mag"].is_empty() && !row["reason"].is_empty());
    }
    let told = rows_of(&["--model", "STARLINK*=starlink-v2,44000=bluebird-fm1"], &[]);
    let model = |name: &str| told.iter().find(|r| r["object_name"] == name).unwrap()["model"].clone();
    assert_eq!((&*model("COSMOS 1"), &*model("STARLINK-1002")), ("bluebird-fm1", "starlink-v2"));
    planned(&text, &["--model", "STARLINK*"]).expect(2, &["--model", "OBJECT=MODEL"]).without_results();
    planned(&text, &["--model", "*=starlnik-v2"]).expect(2, &["did you mean \"starlink-v2\""]).without_results();
    planned(&text, &["--object", "44001,COSMOS 2"])
        .expect(2, &["\"COSMOS 2\" is none of the 3 objects"])
        .without_results();
    let one = rows_of(&["--object", "iss*"], &[]);
    assert!(one.iter().all(|r| r["object_name"] == "ISS (ZARYA)") && !one.is_empty());
}

#[test]
fn damaged_and_old_elements_are_said_and_the_others_are_planned() {
    let good = shell(3);
    // a damaged set: a digit of the mean motion that the checksum does not know
    let damaged = good.replacen("15.06000000 1000", "15.16000000 1000", 1);
    let left = rows(&planned(&damaged, &V2).expect(0, &["1 damaged sets are not used"]).out);
    assert!(left.iter().all(|r| r["norad_cat_id"] != "44000") && !left.is_empty());
    // elements of another month, of one object: wrong, but plausible
    let lines: Vec<&str> = good.lines().collect();
    let old = line(&lines[1][..68].replace("25160.5", "25100.5"));
    let mixed = rows(&planned(&good.replace(lines[1], &old), &V2).expect(0, &["orbit.max_age_d"]).out);
    let failed = of_status(&mixed, "failed");
    assert_eq!(failed.len(), 1);
    assert!(failed[0]["norad_cat_id"] == "44000" && failed[0]["reason"].contains("59.8 d"), "{:?}", failed[0]);
    assert!(mixed.len() > 3);
    planned("no elements\n", &[]).expect(4, &["all.tle"]).without_results();
}

#[test]
fn bright_fast_and_moonlit_passes_are_refused_by_name() {
    let text = shell(30);
    let count = |more: &[&str], status: &str| {
        let rows = rows(&planned(&text, &[&V2[..], more].concat()).expect(0, &[]).out);
        for row in of_status(&rows, status) {
            assert!(!row["reason"].is_empty() && row["rank"].is_empty() && row["scheduled"] == "0", "{row:?}");
        }
        (of_status(&rows, status).len(), of_status(&rows, "observable").len())
    };
    let all = count(&[], "observable_").1;
    assert!(all > 5);
    assert!(count(&["--max-rate-deg-s", "0.01"], "too_fast") == (all, 0));
    let (near, rest) = count(&["--moon-sep-deg", "180"], "near_moon");
    // the Moon of that night sets after midnight: what is left is without it
    assert!(near > 0 && rest < all, "{near} {rest} {all}");
    let (bright, _) = count(&["--min-exptime-s", "0.5", "--exptime-s", "0.5"], "too_bright");
    assert!(bright > 0);
    let (faint, rest) = count(&["--snr", "1e5"], "faint");
    assert!(faint >= all && rest == 0, "{faint} {rest}");
}

#[test]
fn the_dark_is_what_the_sun_says_and_a_night_without_dark_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let plan = |more: &[&str]| satphot(folder.path(), &[&["plan-night", "--elements", ISS][..], more].concat());
    let site = Site::new(-33.7703, 151.1113, 70.0).unwrap();
    let output = plan(&NIGHT).expect(0, &["computed from the optics"]);
    let first = output.out.lines().next().unwrap();
    let times: Vec<&str> = first.split_whitespace().filter(|w| w.ends_with('Z')).collect();
    assert_eq!(times.len(), 2, "{first}");
    for (time, sign) in times.iter().zip([1.0, -1.0]) {
        let at = |s: f64| {
            let epoch = satphot::base::time::shifted(parse_utc("t", time).unwrap(), s);
            sun_altaz(&site, &bodies(&epoch, &EarthOrientation::default()).unwrap()).0.to_degrees()
        };
        assert!((at(0.0) + 6.0).abs() < 0.01 && sign * (at(60.0) - at(0.0)) < 0.0, "{time}");
    }
    // polar summer, polar night, a date that is none, a band without a sky, twilight in a band without one
    let tromso = |date: &str| plan(&["--site", "69.65,18.96,100", "--date", date]);
    tromso("2025-06-09").expect(2, &["the Sun stays above -6 deg", "no moment is dark"]).without_results();
    let south = plan(&["--site", "-78.5,106.8,3500", "--date", "2025-06-10"]).expect(0, &[]);
    assert!(
        south.out.contains("T04:52") || south.out.lines().next().unwrap().matches('Z').count() == 2,
        "{}",
        south.out
    );
    plan(&["--site", "-33.77,151.11,70", "--date", "2025-06-31"]).expect(2, &["30 days"]).without_results();
    plan(&[&NIGHT[..], &["--band", "B"]].concat()).expect(2, &["--band", "V, g, r, i only"]).without_results();
    plan(&[&NIGHT[..], &["--band", "g", "--sun-alt-deg", "-12"]].concat()).expect(2, &["twilight is known in V only"]);
    plan(&[&NIGHT[..], &["--sun-alt-deg", "0"]].concat()).expect(2, &["--sun-alt-deg", "-6"]).without_results();
    plan(&["--date", "2025-06-09"]).expect(2, &["--site"]).without_results();
}

#[test]
fn table_page_and_print_agree_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("all.tle"), shell(20)).unwrap();
    let more = |jobs: &'static str, out: &'static str| [&V2[..], &["-j", jobs, "-o", out, "--zp-mag", "22.4"]].concat();
    let one = plan_in(folder.path(), &more("1", "one")).expect(0, &["plan_night.ecsv", "plan_night.html"]);
    let two = plan_in(folder.path(), &more("2", "two"));
    assert_eq!(one.out, two.out);
    for file in ["plan_night.ecsv", "plan_night.html"] {
        let [a, b] = ["one", "two"].map(|f| std::fs::read(folder.path().join(f).join(file)).unwrap());
        assert!(a == b, "{file}");
    }
    let page = std::fs::read_to_string(folder.path().join("one/plan_night.html")).unwrap();
    let seen = rows(&one.out).iter().filter(|r| r["status"] == "observable").count();
    assert!(page.contains(&format!("{seen} passes are observable")) && page.contains("<svg"), "{seen}");
    let told = satphot(
        folder.path(),
        &[&["plan-night", "--elements", "all.tle", "--order", "time"][..], &NIGHT, &V2].concat(),
    );
    assert!(told.out.contains(&format!("{seen} observable")) || told.out.contains("observable passes"), "{}", told.out);
}

#[test]
fn a_local_horizon_hides_what_is_below_it_and_moves_the_best_moment_above() {
    let text = shell(60);
    let more = |horizon: &'static [&'static str]| [&V2[..], &["--zp-mag", "22.4", "--min-alt", "20"], horizon].concat();
    let open = rows(&planned(&text, &more(&[])).expect(0, &[]).out);
    // a wall of 50 deg to the east, nothing to the west
    let walled = rows(&planned(&text, &more(&["--horizon", "0=0,10=50,170=50,180=0"])).expect(0, &[]).out);
    assert_eq!(open.len(), walled.len(), "every pass has a row");
    let hidden = |r: &Cells| (10.0..170.0).contains(&number(r, "az_deg")) && number(r, "alt_deg") < 50.0;
    assert!(of_status(&open, "observable").iter().any(|r| hidden(r)), "the wall stands before something");
    assert!(of_status(&walled, "observable").iter().all(|r| !hidden(r)));
    let below: Vec<&Cells> = of_status(&walled, "not_up").into_iter().filter(|r| !r["az_deg"].is_empty()).collect();
    assert!(!below.is_empty() && below.iter().all(|r| r["reason"].contains("below the local horizon")));
    // what the wall does not hide is as it was
    let key = |r: &Cells| (r["norad_cat_id"].clone(), r["date_best"].clone(), r["model_v_mag"].clone());
    let west = |all: &[Cells]| -> Vec<_> {
        let mut keys: Vec<_> = of_status(all, "observable")
            .into_iter()
            .filter(|r| number(r, "max_alt_deg") < 45.0 && (190.0..350.0).contains(&number(r, "az_deg")))
            .map(key)
            .collect();
        keys.sort();
        keys
    };
    assert!(!west(&open).is_empty() && west(&open).iter().all(|k| west(&walled).contains(k)));
    for (wrong, word) in [("90", "AZ=ALT"), ("90=95", "outside 0 to 90"), ("0=1,360=2", "twice")] {
        let refused = [&V2[..], &["--horizon", wrong]].concat();
        planned(&text, &refused).expect(2, &["horizon", word]);
    }
}
