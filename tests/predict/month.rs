//! `satphot predict month`: the published month, its zones, one night against the day, edges.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;
use std::path::Path;

use support::{RunOutput, satphot};

const SITE: &str = "-33.7703,151.1113,70";

fn month(folder: &Path, more: &[&str]) -> RunOutput {
    satphot(folder, &[&["predict", "month", "--site", SITE], more].concat())
}

fn rows(text: &str) -> Vec<HashMap<String, String>> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().map(Result::unwrap).collect()
}

fn number(row: &HashMap<String, String>, name: &str) -> f64 {
    row[name].parse().unwrap_or(f64::NAN)
}

#[test]
fn june_2025_has_its_published_nights() {
    // Caddy et al.: the Moon up on about half of the nights, about 6 without any light; by calculation 3-18 and 22-28 June.
    // Full Moon, mu of BlueBird 16.34: a Lambert plate of albedo 0.6 gives 16.56, 16.25 at least.
    let folder = tempfile::tempdir().unwrap();
    let few = ["--month", "2025-06", "--satellite", "iss,bluebird-fm1,starlink-v1.5", "--points", "60"];
    let output = month(folder.path(), &[&few[..], &["--csv", "-o", "m"]].concat()).expect(0, &["UTC+10"]);
    let rows = rows(&output.out);
    assert_eq!(rows.len(), 90);
    let nights = |name: &str, of: &dyn Fn(&HashMap<String, String>) -> bool| -> Vec<u32> {
        let own = rows.iter().filter(|r| r["object_name"] == name && of(r));
        own.map(|r| r["night"][8..].parse().unwrap()).collect()
    };
    let up = nights("iss", &|r| number(r, "moon_alt_deg") > 0.0);
    assert_eq!(up, (3..=18).collect::<Vec<u32>>());
    for name in ["iss", "bluebird-fm1", "starlink-v1.5"] {
        assert_eq!(nights(name, &|r| r["note"] == "not lit"), (22..=28).collect::<Vec<u32>>(), "{name}");
        // where nothing is lit there is neither a magnitude nor a verdict
        let unlit = rows.iter().filter(|r| r["note"] == "not lit");
        unlit.for_each(|r| assert!(r["mu_mean_mag_arcsec2"].is_empty() && r["detected_1sigma"].is_empty()));
    }
    // 14 nights of the ISS with the surface brightness of the model (11 with the paper's, 2.3 mag fainter)
    let detected = nights("iss", &|r| r["detected_1sigma"] == "1").len();
    assert!((13..=15).contains(&detected), "{detected}");
    let brightest = |name: &str| {
        let mu = rows.iter().filter(|r| r["object_name"] == name).map(|r| number(r, "mu_mean_mag_arcsec2"));
        mu.filter(|v| v.is_finite()).fold(f64::INFINITY, f64::min)
    };
    assert!((brightest("bluebird-fm1") - 16.34).abs() < 0.3, "{}", brightest("bluebird-fm1"));
    assert!((brightest("iss") - 17.5).abs() < 0.5, "{}", brightest("iss"));
    // the limits: brightest sky at full Moon, dark with the Moon down
    let limit = |day: &str, name: &str| number(rows.iter().find(|r| r["night"].ends_with(day)).unwrap(), name);
    assert!((limit("11", "limit_1sigma_mag_arcsec2") - 21.65).abs() < 0.01);
    assert!((limit("11", "limit_5sigma_mag_arcsec2") - 19.67).abs() < 0.01);
    assert!((limit("25", "limit_1sigma_mag_arcsec2") - 22.56).abs() < 0.02);
    assert!((limit("25", "limit_5sigma_mag_arcsec2") - 20.27).abs() < 0.02);
    assert!(std::fs::read_to_string(folder.path().join("m/month.svg")).unwrap().contains("Moon down at midnight"));
}

#[test]
fn a_night_of_one_moment_is_the_day_at_that_moment() {
    let folder = tempfile::tempdir().unwrap();
    let night = [
        "--date",
        "2025-06-09",
        "--nights",
        "1",
        "--satellite",
        "iss",
        "--points",
        "80",
        "--steps",
        "1",
        "--csv",
        "-q",
    ];
    let one = rows(&month(folder.path(), &night).expect(0, &[]).out).remove(0);
    let day =
        ["predict", "day", "--satellite", "iss", "--site", SITE, "--start", "2025-06-09T14:00:00", "--hours", "0.1"];
    let more = ["--step-min", "10", "--points", "80", "--csv", "-q"];
    let day = rows(&satphot(folder.path(), &[&day[..], &more].concat()).expect(0, &[]).out).remove(0);
    assert_eq!(one["date_mid"], day["date_mid"]);
    for name in
        ["model_v_mag", "mu_mean_mag_arcsec2", "mu_p16_mag_arcsec2", "lit_frac", "moon_alt_deg", "moon_phase_deg"]
    {
        assert_eq!(one[name], day[name], "{name}");
    }
}

#[test]
fn both_modes_stand_side_by_side_and_threads_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let args =
        ["--date", "2025-06-10", "--nights", "2", "--satellite", "bluebird-fm1", "--mode", "both", "--points", "30"];
    let with = |jobs: &str, out: &str| {
        month(folder.path(), &[&args[..], &["--steps", "3", "-j", jobs, "-o", out]].concat()).expect(0, &[]).out
    };
    assert_eq!(with("1", "a"), with("2", "b"));
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("a/month.ecsv"), read("b/month.ecsv"));
    assert!(
        folder.path().join("a/month_corrected.svg").exists() && folder.path().join("a/month_as_published.svg").exists()
    );
}

#[test]
fn a_mirror_that_misses_the_observer_is_reported_and_not_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--date", "2025-06-10", "--nights", "2", "--satellite", "earendil-1,bluebird-fm1", "--points", "30"];
    let output = month(folder.path(), &[&args[..], &["--steps", "1", "-o", "m"]].concat());
    let output = output.expect(0, &["earendil-1", "never reaches the observer"]);
    assert!(output.out.contains("earendil-1"));
    let svg = std::fs::read_to_string(folder.path().join("m/month.svg")).unwrap();
    assert!(svg.contains("bluebird-fm1") && !svg.contains("earendil-1"));
}

#[test]
fn a_polar_summer_has_sunlit_midnights_and_a_year_may_end() {
    let output = satphot(
        Path::new("."),
        &[
            "predict",
            "month",
            "--site",
            "78.2,15.6,100",
            "--date",
            "2025-12-30",
            "--nights",
            "3",
            "--satellite",
            "bluebird-fm1",
            "--points",
            "20",
            "--steps",
            "1",
            "--csv",
        ],
    )
    .expect(0, &["UTC+1"]);
    let rows = rows(&output.out);
    assert_eq!(rows[2]["night"], "2026-01-01");
    assert_eq!(rows[0]["date_mid"], "2025-12-30T23:00:00Z");
    let summer =
        ["predict", "month", "--site", "78.2,15.6,100", "--date", "2025-06-20", "--nights", "1", "--satellite", "iss"];
    let output =
        satphot(Path::new("."), &[&summer[..], &["--points", "20", "--steps", "1", "--csv"]].concat()).expect(0, &[]);
    let sunlit = self::rows(&output.out);
    assert!(number(&sunlit[0], "sun_alt_deg") > 0.0 && number(&sunlit[0], "model_v_mag") < 3.0);
}

#[test]
fn months_dates_and_telescopes_that_are_none_are_refused_by_name() {
    for (args, word) in [
        (&["--month", "2025-13"][..], "--month"),
        (&["--month", "June"], "--month"),
        (&["--date", "2025-02-30"], "--date"),
        (&["--month", "2025-06", "--nights", "0"], "--nights"),
        (&["--month", "2025-06", "--satellite", "isss"], "isss"),
        (&["--month", "2025-06", "--utc-offset-h", "20"], "--utc-offset-h"),
        (&["--month", "2025-06", "--steps", "0"], "--steps"),
        (&["--month", "2025-06", "--height-km", "50"], "--height-km"),
        (
            &["--month", "2025-06", "--nights", "1", "--steps", "1", "--points", "2", "--exptime-s", "0"],
            "exposure time",
        ),
        (&[], "--month"),
    ] {
        let output = month(Path::new("."), args).without_results();
        assert!(output.code != 0 && output.err.contains(word), "{args:?}: {output:?}");
    }
}

#[test]
fn the_lit_share_of_a_night_is_that_of_the_day_at_its_moment() {
    // one moment, the same directions: local midnight of the evening of 9 June is 14 h UTC
    let folder = tempfile::tempdir().unwrap();
    let sampling = ["--points", "80", "--csv", "-q"];
    let mut shares = Vec::new();
    for date in ["2025-06-09", "2025-06-01", "2025-06-25"] {
        let args = ["--date", date, "--nights", "1", "--steps", "1", "--around-h", "0", "--satellite", "iss"];
        let night =
            rows(&month(folder.path(), &[&args[..], &["--height-km", "420"], &sampling].concat()).expect(0, &[]).out);
        let start = format!("{date}T14:00:00");
        let head = ["predict", "day", "--site", SITE, "--satellite", "iss", "--height-km", "420", "--start", &start];
        let day = satphot(folder.path(), &[&head[..], &["--hours", "0.1", "--step-min", "6"], &sampling].concat());
        let day = rows(&day.expect(0, &[]).out);
        assert_eq!(number(&night[0], "lit_frac"), number(&day[0], "lit_frac"), "{date}");
        shares.push(number(&day[0], "lit_frac"));
    }
    assert!(shares.iter().any(|s| *s != shares[0]), "the test could not fail: {shares:?}");
}

#[test]
fn the_moons_illuminated_share_is_called_so() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--date", "2025-06-09", "--nights", "1", "--steps", "1", "--satellite", "iss", "--points", "20", "-q"];
    let output = month(folder.path(), &args).expect(0, &[]);
    // 97 % of the Moon's disc is lit; that is no share of the sky
    let line = output.out.lines().find(|l| l.starts_with("2025-06-09")).unwrap();
    let head = output.out.lines().find(|l| l.trim_start().starts_with("night")).unwrap();
    assert!(head.contains("Moon %") && !head.contains("lit %"), "{head}");
    assert_eq!(line.split_whitespace().nth(2), Some("97"), "{line}");
}
