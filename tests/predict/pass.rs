//! `satphot predict pass`: moments, lights, files, and arguments that cannot be used. The pass is that of the ISS over
//! Macquarie on 2025-06-09, culmination 10:33:12 UTC at 32.1 deg.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;
use std::path::Path;

use satphot::base::time::parse_utc;
use satphot::brightness::Model;
use satphot::brightness::scene::scene;
use satphot::config;
use satphot::orbit::{EarthOrientation, Site, Tracker, read_elements};
use satphot::tables::PREDICTION;
use support::{RunOutput, satphot};

const ELEMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/night/iss-2025-june.tle");
const SITE: &str = "-33.7703,151.1113,70";
const EVENING: &str = "2025-06-09T08:40:00";

fn pass_in(folder: &Path, start: &str, more: &[&str]) -> RunOutput {
    let head = ["predict", "pass", "--elements", ELEMENTS, "--site", SITE, "--start", start];
    satphot(folder, &[&head[..], more].concat())
}

fn pass(start: &str, more: &[&str]) -> RunOutput {
    let empty = tempfile::tempdir().unwrap();
    pass_in(empty.path(), start, more)
}

fn rows(output: &RunOutput) -> Vec<HashMap<String, String>> {
    csv::Reader::from_reader(output.out.as_bytes()).deserialize().map(Result::unwrap).collect()
}

fn number(row: &HashMap<String, String>, column: &str) -> Option<f64> {
    Some(row[column].as_str()).filter(|c| !c.is_empty()).map(|c| c.parse().unwrap())
}

#[test]
fn rows_are_whole_steps_after_the_start_while_the_satellite_is_up() {
    let output = pass(EVENING, &["--satellite", "iss", "--hours", "1", "--step-s", "10", "--csv"]).expect(0, &[]);
    let rows = rows(&output);
    assert_eq!(output.out.lines().next().unwrap(), PREDICTION.column_names().join(","));
    assert!((55..=65).contains(&rows.len()), "{}", rows.len());
    let first = parse_utc("t", EVENING).unwrap();
    for row in &rows {
        let after_s = (parse_utc("t", &row["date_mid"]).unwrap() - first).to_seconds();
        assert!((after_s / 10.0 - (after_s / 10.0).round()).abs() < 1e-4, "{row:?}");
        assert!(number(row, "alt_deg").unwrap() > -1e-6, "{row:?}");
    }
    let culmination = rows.iter().filter_map(|r| number(r, "alt_deg")).fold(0.0, f64::max);
    assert!((culmination - 19.1).abs() < 0.1, "{culmination}");
    let higher = pass(EVENING, &["--satellite", "iss", "--hours", "1", "--min-alt", "15", "--csv"]).expect(0, &[]);
    assert!(self::rows(&higher).iter().all(|r| number(r, "alt_deg").unwrap() >= 15.0));
}

#[test]
fn every_row_is_the_engine_at_that_moment_and_its_lights_add_up() {
    let args = ["--satellite", "iss", "--hours", "1", "--step-s", "30", "--mode", "as_published", "--csv"];
    let rows = rows(&pass(EVENING, &args).expect(0, &[]));
    let site = Site::new(-33.7703, 151.1113, 70.0).unwrap();
    let sets = read_elements(Path::new(ELEMENTS)).unwrap();
    let tracker = Tracker::new(sets, None, site, EarthOrientation::default()).unwrap();
    let model = config::Model { mode: config::Mode::AsPublished, ..config::Model::of("iss") };
    let model = Model::from_config(&model).unwrap();
    for row in &rows {
        let geometry = tracker.at(&parse_utc("t", &row["date_mid"]).unwrap()).unwrap();
        let expected = model.brightness(&scene(&geometry)).unwrap();
        match (number(row, "model_v_mag"), expected.total_v_mag) {
            (Some(got), Some(expected)) => assert!((got - expected).abs() < 1e-9, "{row:?} {expected}"),
            (got, expected) => assert_eq!(got, expected, "{row:?}"),
        }
        let lights = ["sun_v_mag", "earthshine_v_mag", "moon_v_mag", "lunar_earthshine_v_mag"];
        let sum: f64 = lights.iter().filter_map(|c| number(row, c)).map(|v| 10_f64.powf(-0.4 * v)).sum();
        if let Some(v) = number(row, "model_v_mag") {
            assert!((-2.5 * sum.log10() - v).abs() < 1e-9, "{row:?}");
        }
        let dark = lights.iter().filter(|c| number(row, c).is_none()).count();
        assert!(dark == 0 || !row["skipped"].is_empty(), "no reason: {row:?}");
    }
    // this pass goes from sunlight into the umbra
    let light = |r: &HashMap<String, String>| r["illum"].clone();
    assert_eq!(light(&rows[0]), "sun");
    assert_ne!(light(&rows[rows.len() - 1]), "sun");
}

#[test]
fn a_folder_gets_the_table_and_the_light_curve_and_single_files_are_distinguished() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--satellite", "iss", "--hours", "1", "-o", "out", "-o", "deep/only.ecsv"];
    let output = pass_in(folder.path(), EVENING, &args).expect(0, &["pass.ecsv", "pass.svg", "only.ecsv"]);
    assert!(output.out.contains("brightest V") && output.out.lines().count() < 6, "{}", output.out);
    let table = std::fs::read_to_string(folder.path().join("out/pass.ecsv")).unwrap();
    assert!(table.starts_with("# %ECSV 1.0\n"));
    for word in ["satphot.prediction/1", "satellite: iss", "shadow:", "name: lunar_earthshine_v_mag, unit: mag"] {
        assert!(table.contains(word), "{word}");
    }
    assert_eq!(std::fs::read_to_string(folder.path().join("deep/only.ecsv")).unwrap(), table);
    let figure = std::fs::read_to_string(folder.path().join("out/pass.svg")).unwrap();
    for word in ["ISS (ZARYA) as iss, predicted", "moments predicted", "Sunlight", "altitude [deg]", "umbra"] {
        assert!(figure.contains(word), "{word}");
    }
    // the text table has each light in its own column
    let text = pass(EVENING, &["--satellite", "iss", "--hours", "1", "--step-s", "60"]).expect(0, &[]).out;
    assert!(["sun", "earthshine", "moon", "lunar earthshine"].iter().all(|w| text.lines().next().unwrap().contains(w)));
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_threads() {
    let on =
        |jobs: &str| pass(EVENING, &["--satellite", "iss", "--hours", "1", "--csv", "-j", jobs]).expect(0, &[]).out;
    assert_eq!(on("1"), on("3"));
}

#[test]
fn a_pass_shorter_than_the_step_is_its_culmination() {
    let args = ["--satellite", "iss", "--hours", "1", "--step-s", "599", "--min-alt", "19", "--csv"];
    let rows = rows(&pass(EVENING, &args).expect(0, &[]));
    assert_eq!(rows.len(), 1);
    assert!((number(&rows[0], "alt_deg").unwrap() - 19.1).abs() < 0.1);
}

#[test]
fn a_window_without_a_pass_is_an_answer_with_a_table_without_rows() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--satellite", "iss", "--hours", "1", "--min-alt", "60"];
    let output = pass_in(folder.path(), EVENING, &args).expect(0, &[]);
    for word in ["no pass", "never above 60 deg", "highest 19.1 deg", "satphot passes"] {
        assert!(output.out.contains(word), "{word}\n{}", output.out);
    }
    let csv = pass_in(folder.path(), EVENING, &[&args[..], &["--csv"]].concat()).expect(0, &["no pass"]);
    assert_eq!(csv.out.trim_end(), PREDICTION.column_names().join(","));
    let output = pass_in(folder.path(), EVENING, &[&args[..], &["-o", "p.ecsv", "-o", "p.svg"]].concat());
    output.expect(0, &["p.svg is not drawn"]);
    let table = std::fs::read_to_string(folder.path().join("p.ecsv")).unwrap();
    assert_eq!(table.lines().filter(|l| !l.starts_with('#')).count(), 1, "{table}");
    assert!(!folder.path().join("p.svg").exists());
}

#[test]
fn arguments_that_cannot_be_used_are_named_with_a_remedy() {
    let iss = ["--satellite", "iss"];
    let with = |more: &[&str]| pass(EVENING, &[&iss[..], more].concat());
    for (more, words) in [
        (&["--hours", "0"][..], &["--hours", "outside 0 to 8784"][..]),
        (&["--end", "2025-06-09T08:00:00"], &["--end", "after --start", "above 0"]),
        (&["--end", "later"], &["--end", "is not a time"]),
        (&["--hours", "1", "--step-s", "0"], &["--step-s", "0.001 to 600"]),
        (&["--hours", "1", "--min-alt", "95"], &["--min-alt", "0 to 90"]),
        (&["--hours", "1", "--set", "site.lat_deg=1"], &["--set", "model."]),
        (&["--hours", "1", "--set", "model.tolerance=0"], &["model.tolerance"]),
        (&["--hours", "1", "-o", "table.csv"], &["--out", ".ecsv", "--csv"]),
    ] {
        with(more).expect(2, words).without_results();
    }
    pass(EVENING, &["--hours", "1", "--satellite", "isss"]).expect(2, &["isss", "did you mean \"iss\""]);
    pass(EVENING, &["--hours", "1"]).expect(2, &["pipeline.toml", "--satellite"]);
    pass("2025-09-09T00:00:00", &[&iss[..], &["--hours", "24"]].concat()).expect(5, &["max_age_d"]).without_results();
}
