//! `satphot predict day`, `duty` and `sky --sequence`: laws, the published figures, edges, files.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;
use std::path::Path;

use satphot::base::progress::Silent;
use satphot::base::time::parse_utc;
use satphot::brightness::sky_points::SkyPoints;
use satphot::brightness::{ModelSettings, Satellite, ToleranceOf};
use satphot::config::{Mode, Sampling};
use satphot::orbit::Site;
use satphot::tables::{DayRow, PhotometryRow};
use satphot::visibility::forecast::day::{day_moments, observed_passes, predict_day, sky_light};
use satphot::visibility::forecast::dome::{Dome, Overhead};
use support::{RunOutput, satphot};

const SITE: &str = "-33.7703,151.1113,70";

fn macquarie() -> Site {
    Site::new(-33.7703, 151.1113, 70.0).unwrap()
}

fn settings(mode: Mode) -> ModelSettings {
    ModelSettings { tolerance_of: ToleranceOf::Total, ..ModelSettings::new(mode, 1e-3) }
}

fn dome(name: &str, mode: Mode, height_km: f64) -> Dome {
    Dome::new(&macquarie(), &Satellite::named(name).unwrap(), &settings(mode), height_km, 1.5).unwrap()
}

/// Rows at these moments, of few points.
fn rows(dome: &Dome, sampling: Sampling, n: usize, moments: &[&str]) -> Vec<DayRow> {
    let epochs: Vec<_> = moments.iter().map(|t| parse_utc("t", t).unwrap()).collect();
    predict_day(&macquarie(), dome, &SkyPoints::new(n, sampling, None).unwrap(), &epochs, &Silent).unwrap()
}

fn run(folder: &Path, args: &[&str]) -> RunOutput {
    satphot(folder, &[&["predict"], args].concat())
}

fn csv_rows(text: &str) -> Vec<HashMap<String, String>> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().map(Result::unwrap).collect()
}

#[test]
fn the_iss_of_full_moon_is_as_published_in_the_published_convention() {
    // Caddy et al.: night 11.25 (9.52..13.97), day -2.66 (-3.44..-0.27); the night of the model is 10.9 to 11.4, its noon
    // -2.59 +- 0.15. 300 points of the sky are good to 0.05 mag.
    let dome = dome("iss", Mode::AsPublished, 420.0);
    let found =
        rows(&dome, Sampling::AltAz, 300, &["2025-06-11T02:00:00", "2025-06-11T12:00:00", "2025-06-11T14:00:00"]);
    let v = |r: &DayRow| [r.model_v_mag, r.model_v_p16_mag, r.model_v_p84_mag].map(Option::unwrap);
    let [noon, noon16, noon84] = v(&found[0]);
    assert!((noon + 2.6).abs() < 0.15, "{noon}");
    assert!((noon16 + 3.44).abs() < 0.25 && (noon84 + 0.27).abs() < 0.35, "{noon16} {noon84}");
    for night in &found[1..] {
        let [median, p16, p84] = v(night);
        assert!((10.9..=11.4).contains(&median), "{median}");
        assert!((p16 - 9.52).abs() < 0.35 && (p84 - 13.97).abs() < 0.35, "{p16} {p84}");
        // no direction in which direct moonlight is the largest light, at full Moon
        assert_eq!(night.moon_frac, 0.0);
        assert!(night.lunar_earthshine_frac > 0.99);
    }
}

#[test]
fn how_the_sky_is_sampled_is_a_magnitude_by_day() {
    let dome = dome("iss", Mode::Corrected, 420.0);
    let noon = |sampling| rows(&dome, sampling, 300, &["2025-06-11T02:00:00"])[0].model_v_mag.unwrap();
    let (even, crowded) = (noon(Sampling::SolidAngle), noon(Sampling::AltAz));
    assert!((even - crowded - 1.0).abs() < 0.15, "{even} {crowded}");
    assert!((even + 1.61).abs() < 0.1 && (crowded + 2.59).abs() < 0.1, "{even} {crowded}");
}

#[test]
fn a_day_at_a_moment_is_the_median_of_the_map_of_that_moment() {
    // the same sky on a fine grid of altitude and azimuth, weighted by area, against the spiral
    let output = run(
        Path::new("."),
        &["sky", "--satellite", "bluebird-fm1", "--site", SITE, "--time", "2025-06-11T14:00:00", "--grid", "61x121"],
    )
    .expect(0, &[]);
    let line = output.out.lines().find(|l| l.starts_with("equal areas")).unwrap();
    let median: f64 = line.split("median V ").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
    let dome = dome("bluebird-fm1", Mode::Corrected, 520.0);
    let day = rows(&dome, Sampling::SolidAngle, 2000, &["2025-06-11T14:00:00"])[0].model_v_mag.unwrap();
    // half a cell of the grid at the median and two digits printed
    assert!((day - median).abs() < 0.02, "{day} {median}");
}

#[test]
fn turning_all_directions_about_the_zenith_moves_the_median_of_an_even_sky_by_next_to_nothing() {
    let dome = dome("bluebird-fm1", Mode::Corrected, 520.0);
    let overhead = Overhead::at(&macquarie(), &parse_utc("t", "2025-06-12T12:00:00").unwrap()).unwrap();
    let median = |turn_rad: f64| {
        let mut points = SkyPoints::new(3000, Sampling::SolidAngle, None).unwrap();
        points.directions.iter_mut().for_each(|d| d.1 = (d.1 + turn_rad) % std::f64::consts::TAU);
        let mut v = sky_light(&dome, &points, &overhead).unwrap().v_mag;
        v.sort_by(f64::total_cmp);
        v[v.len() / 2]
    };
    let still = median(0.0);
    // the spacing of 3000 points: the magnitude changes by 4 over the sky
    for turn in [0.7, 2.0, 4.5] {
        assert!((median(turn) - still).abs() < 0.02, "{turn}");
    }
}

#[test]
fn random_directions_give_the_same_median_within_their_scatter() {
    let dome = dome("bluebird-fm1", Mode::Corrected, 520.0);
    let overhead = Overhead::at(&macquarie(), &parse_utc("t", "2025-06-12T12:00:00").unwrap()).unwrap();
    let median = |seed: Option<u64>| {
        let points = SkyPoints::new(2000, Sampling::SolidAngle, seed).unwrap();
        let mut v = sky_light(&dome, &points, &overhead).unwrap().v_mag;
        v.sort_by(f64::total_cmp);
        v[v.len() / 2]
    };
    let spiral = median(None);
    for seed in [0, 1, 2] {
        let random = median(Some(seed));
        // sigma of a median: 1.25 sigma / sqrt(n), with sigma 1 mag 0.03
        assert!((random - spiral).abs() < 0.12 && random != spiral, "{seed}: {random} {spiral}");
    }
}

#[test]
fn where_nothing_is_lit_the_cells_are_empty() {
    // new Moon of 25 June 2025, local midnight
    let found = rows(&dome("iss", Mode::Corrected, 420.0), Sampling::SolidAngle, 50, &["2025-06-25T14:00:00"]);
    let dark = &found[0];
    assert_eq!((dark.lit_frac, dark.model_v_mag, dark.model_v_p16_mag, dark.brightest_v_mag), (0.0, None, None, None));
    assert_eq!((dark.mu_mean_mag_arcsec2, dark.model_err_mag), (None, None));
    assert!(dark.skipped.contains("sun: at") && dark.skipped.contains("moon: at"), "{}", dark.skipped);
    let folder = tempfile::tempdir().unwrap();
    let args = ["day", "--satellite", "iss", "--site", SITE, "--start", "2025-06-25T13:00:00", "--hours", "2", "--csv"];
    let output =
        run(folder.path(), &[&args[..], &["--points", "40", "-o", "d"]].concat()).expect(0, &["wrote d/day.svg"]);
    assert!(csv_rows(&output.out).iter().all(|r| r["model_v_mag"].is_empty()));
    assert!(!output.out.contains("NaN") && !output.out.contains("12.5,"));
    let svg = std::fs::read_to_string(folder.path().join("d/day.svg")).unwrap();
    assert!(svg.contains("nothing is lit"), "a figure without data says why");
}

#[test]
fn the_table_is_the_same_for_any_number_of_threads_and_over_the_end_of_a_year() {
    let folder = tempfile::tempdir().unwrap();
    let day = |jobs: &str, out: &str| {
        let args = ["day", "--satellite", "starlink-v1.5", "--site", "69.65,18.96,100", "--start"];
        let more = ["2025-12-31T18:00:00", "--hours", "12", "--step-min", "60", "--points", "60", "--csv"];
        run(folder.path(), &[&args[..], &more, &["-j", jobs, "-o", out]].concat()).expect(0, &[]).out
    };
    let one = day("1", "a.ecsv");
    assert_eq!(one, day("3", "b.ecsv"));
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("a.ecsv"), read("b.ecsv"));
    let dates: Vec<String> = csv_rows(&one).iter().map(|r| r["date_mid"].clone()).collect();
    assert_eq!((dates.len(), dates[6].as_str()), (13, "2026-01-01T00:00:00Z"));
}

#[test]
fn a_pole_has_a_day_too() {
    let output = run(
        Path::new("."),
        &[
            "day",
            "--satellite",
            "iss",
            "--site",
            "-90,0,2800",
            "--date",
            "2025-06-11",
            "--step-min",
            "240",
            "--points",
            "40",
        ],
    )
    .expect(0, &[]);
    assert!(output.out.contains("night, Sun below -18"), "{}", output.out);
}

#[test]
fn arguments_that_make_no_sense_are_refused_by_name() {
    let base = ["day", "--satellite", "iss", "--site", SITE];
    for (more, word) in [
        (&["--date", "2025-06-31"][..], "--date"),
        (&["--date", "11.6.2025"], "--date"),
        (&[], "--date"),
        (&["--date", "2025-06-11", "--height-km", "90"], "--height-km"),
        (&["--date", "2025-06-11", "--points", "0"], "points"),
        (&["--date", "2025-06-11", "--step-min", "0"], "--step-min"),
        (&["--date", "2025-06-11", "--hours", "-1"], "--hours"),
        (&["--date", "2025-06-11", "--sampling", "square"], "--sampling"),
    ] {
        let output = run(Path::new("."), &[&base[..], more].concat()).without_results();
        assert!(output.code != 0 && output.err.contains(word), "{more:?}: {output:?}");
    }
}

fn frame(second: f64, v_mag: Option<f64>) -> PhotometryRow {
    PhotometryRow {
        object_name: "ISS (ZARYA)".into(),
        norad_cat_id: Some(25544),
        mjd_mid_d: Some(60_836.583_333 + second / 86_400.0),
        v_mag,
        status: "ok".into(),
        ..PhotometryRow::default()
    }
}

#[test]
fn an_observed_pass_stands_at_its_time_of_day_next_to_the_interval_of_the_model() {
    let day: Vec<DayRow> = (0..=24)
        .map(|h| DayRow {
            mjd_mid_d: 60_837.0 + f64::from(h) / 24.0,
            model_v_mag: Some(11.0),
            model_v_p16_mag: Some(10.0),
            model_v_p84_mag: Some(13.0),
            ..DayRow::default()
        })
        .collect();
    let observed: Vec<PhotometryRow> = (0..5).map(|i| frame(f64::from(i), Some(12.0 + 0.1 * f64::from(i)))).collect();
    let passes = observed_passes(&observed, &day);
    assert_eq!(passes.len(), 1);
    assert_eq!((passes[0].row.n, passes[0].row.v_mag, passes[0].row.within.as_str()), (5, 12.2, "yes"));
    // 60836.58 is the evening before: moved by a day
    assert_eq!(passes[0].moved_d, 1.0);
    assert!((passes[0].mjd_d - 60_837.583_36).abs() < 1e-4);
    let faint: Vec<PhotometryRow> = (0..5).map(|i| frame(f64::from(i), Some(14.0))).collect();
    assert_eq!(observed_passes(&faint, &day)[0].row.within, "no");
    // without magnitudes there is no pass, without a model no verdict
    assert!(observed_passes(&[frame(0.0, None)], &day).is_empty());
    let dark: Vec<DayRow> = day.iter().map(|r| DayRow { mjd_mid_d: r.mjd_mid_d, ..DayRow::default() }).collect();
    assert_eq!(observed_passes(&observed, &dark)[0].row.within, "");
}

#[test]
fn tables_of_observations_are_drawn_and_empty_or_foreign_ones_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let rows: Vec<PhotometryRow> = (0..6).map(|i| frame(f64::from(i), Some(11.5 + 0.2 * f64::from(i)))).collect();
    satphot::tables::write_photometry(&at("seen.ecsv"), &rows, &satphot::tables::Meta::default()).unwrap();
    satphot::tables::write_photometry(&at("none.ecsv"), &[frame(0.0, None)], &satphot::tables::Meta::default())
        .unwrap();
    std::fs::write(at("empty.ecsv"), "").unwrap();
    let base = ["day", "--satellite", "bluebird-fm1", "--site", SITE, "--date", "2025-06-11", "--points", "40"];
    let with = |files: &[&str]| {
        let observed: Vec<&str> = files.iter().flat_map(|f| ["--observed", f]).collect();
        run(folder.path(), &[&base[..], &["--step-min", "60", "-o", "day"], &observed].concat())
    };
    let output = with(&["seen.ecsv", "none.ecsv"]).expect(0, &["none.ecsv", "no violin"]);
    assert!(output.out.contains("ISS (ZARYA)") && output.out.contains("within"), "{}", output.out);
    assert!(at("day/day_passes.ecsv").exists());
    assert!(std::fs::read_to_string(at("day/day.svg")).unwrap().contains("observed pass"));
    with(&["empty.ecsv"]).expect(4, &["empty.ecsv"]).without_results();
    assert_ne!(with(&["absent.ecsv"]).code, 0);
}

#[test]
fn the_duty_of_a_june_day_is_the_published_one_and_full_moon_makes_it_whole() {
    let output = run(
        Path::new("."),
        &["duty", "--site", SITE, "--date", "2025-06-11", "--satellite", "iss", "--points", "30", "--csv"],
    )
    .expect(0, &[]);
    let rows = csv_rows(&output.out);
    let pct = |name: &str| rows.iter().find(|r| r["observing"] == name).unwrap()["duty_pct"].parse::<f64>().unwrap();
    // Caddy et al.: 12.5, 54 and 100 %
    assert!((pct("twilight only") - 12.4).abs() < 0.1, "{}", pct("twilight only"));
    assert!((pct("twilight and day") - 53.8).abs() < 0.1, "{}", pct("twilight and day"));
    assert!((pct("twilight, day and Moonlight") - 100.0).abs() < 1e-9);
    let new_moon = ["duty", "--site", SITE, "--date", "2025-06-25", "--satellite", "iss", "--points", "30", "--csv"];
    let rows = csv_rows(&run(Path::new("."), &new_moon).expect(0, &[]).out);
    let with_moon = rows.last().unwrap()["duty_pct"].parse::<f64>().unwrap();
    assert!(with_moon < 70.0, "{with_moon}");
    let refused = ["duty", "--site", SITE, "--date", "2025-06-25", "--days", "0"];
    run(Path::new("."), &refused).expect(2, &["--days"]).without_results();
}

#[test]
fn a_sequence_holds_the_maps_of_its_moments_with_their_time() {
    let folder = tempfile::tempdir().unwrap();
    let base = ["sky", "--satellite", "bluebird-fm1", "--site", SITE, "--grid", "4x5", "--csv", "-q"];
    let sequence = ["--time", "2025-06-11T04:00:00", "--sequence", "8", "--also", "2025-06-18T04:00:00", "-o", "s"];
    let all = run(folder.path(), &[&base[..], &sequence].concat()).expect(0, &[]);
    let rows = csv_rows(&all.out);
    assert_eq!(rows.len(), 2 * 3 * 4 * 5);
    for (k, time) in ["2025-06-11T04:00:00", "2025-06-11T12:00:00"].iter().enumerate() {
        let one = run(folder.path(), &[&base[..], &["--time", time]].concat()).expect(0, &[]);
        for (a, b) in csv_rows(&one.out).iter().zip(&rows[20 * k..]) {
            assert_eq!(b["date_mid"], format!("{time}Z"));
            assert!(a.iter().all(|(name, cell)| b[name] == *cell), "{a:?} {b:?}");
        }
    }
    let svg = std::fs::read_to_string(folder.path().join("s/sky_sequence.svg")).unwrap();
    assert!(svg.contains("2025-06-18 04:00 UTC") && svg.contains("Moon"));
    run(folder.path(), &[&base[..], &["--time", "2025-06-11T04:00:00", "--sequence", "0"]].concat())
        .expect(2, &["--sequence"]);
}

#[test]
fn the_moments_of_a_day_include_both_ends() {
    let start = parse_utc("t", "2025-06-11T00:00:00").unwrap();
    assert_eq!(day_moments(start, 24.0, 10.0).unwrap().len(), 145);
    assert_eq!(day_moments(start, 24.0, 7.0).unwrap().len(), 206);
}
