//! `satphot check-table`: the paper's own table of passes row by row, and tables that are damaged.
//!
//! Reference: skyfield with DE421 and the same public elements (ISS 2025-06-08, CSS 2025-06-05).
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::path::Path;

use satphot::brightness::light_class::PaperLabel;
use satphot::paper::Context;
use satphot::paper::pass_check::{CheckedPass, Standing};
use support::{RunOutput, satphot};

/// Row of the table: lit share of the Moon \[%\], altitudes of Sun and Moon, phase angle \[deg\], V of the Moon by Cox, at
/// the stated time.
const SKY: [(f64, f64, f64, f64, f64); 7] = [
    (96.7, 50.2, -71.2, 20.9, -12.19),
    (92.4, -44.8, 70.4, 32.0, -11.89),
    (93.1, -60.5, 32.4, f64::NAN, f64::NAN),
    (97.2, -48.3, 31.5, 19.3, -12.23),
    (99.1, -33.8, 44.5, 10.7, -12.45),
    (99.8, -23.5, 24.8, 4.7, -12.61),
    (99.7, -48.4, 53.7, 6.2, -12.57),
];

fn paper() -> Vec<CheckedPass> {
    Context::new().unwrap().passes
}

fn check(folder: &Path, text: &str, more: &[&str]) -> RunOutput {
    std::fs::write(folder.join("passes.csv"), text).unwrap();
    satphot(folder, &[&["check-table", "passes.csv"][..], more].concat())
}

#[test]
fn sun_and_moon_of_every_row_are_those_of_de421() {
    for (row, (moon_pct, sun_deg, moon_deg, phase_deg, v)) in paper().iter().zip(SKY) {
        let near = |got: f64, expected: f64, within: f64| expected.is_nan() || (got - expected).abs() < within;
        let at = &row.stated.time;
        // half of the last digit of the reference
        assert!(near(row.sky.moon_illum_pct, moon_pct, 0.06), "{at} {}", row.sky.moon_illum_pct);
        assert!(near(row.sky.sun_alt_deg, sun_deg, 0.06), "{at} {}", row.sky.sun_alt_deg);
        assert!(near(row.sky.moon_alt_deg, moon_deg, 0.06), "{at} {}", row.sky.moon_alt_deg);
        assert!(near(row.sky.moon_phase_deg, phase_deg, 0.06), "{at} {}", row.sky.moon_phase_deg);
        assert!(near(row.moon_v_mag, v, 0.006), "{at} {}", row.moon_v_mag);
    }
    // to more digits: the points of the reference
    let exact = [
        (0, 50.233_458_112_609_95, -71.173_860_123_261_35, 20.913_296_374_243_522),
        (3, -48.252_656_850_730_695, 31.488_602_039_666_61, 19.274_565_870_533_177),
        (4, -33.765_750_154_197_49, 44.469_927_955_590_06, 10.737_966_993_512_277),
    ];
    for (i, sun_deg, moon_deg, phase_deg) in exact {
        let sky = &paper()[i].sky;
        assert!((sky.sun_alt_deg - sun_deg).abs() < 0.03 && (sky.moon_alt_deg - moon_deg).abs() < 0.03, "{sky:?}");
        assert!((sky.moon_phase_deg - phase_deg).abs() < 0.02, "{sky:?}");
    }
}

#[test]
fn two_rows_of_the_paper_cannot_be_true_and_are_of_the_day_after() {
    let rows = paper();
    let cannot: Vec<&str> =
        rows.iter().filter(|r| r.standing == Standing::CannotBe).map(|r| r.stated.time.as_str()).collect();
    assert_eq!(cannot, ["08-06-25 20:33", "09-06-25 02:00"]);
    let iss = &rows[1];
    assert!((iss.alt_deg.unwrap() - -88.741_811_988_626_89).abs() < 0.05, "{:?}", iss.alt_deg);
    let (days, pass) = &iss.proposed[0];
    assert_eq!(*days, 1);
    assert!((pass.alt_deg - 32.1).abs() < 0.05 && (pass.range_km - 749.0).abs() < 1.0, "{pass:?}");
    assert!(iss.remedy.as_ref().unwrap().contains("2025-06-09 20:33 (10:33 UTC)"), "{:?}", iss.remedy);
    let css = &rows[2];
    assert!((css.alt_deg.unwrap() - -51.0).abs() < 0.2, "{:?}", css.alt_deg);
    let (days, pass) = &css.proposed[0];
    assert!(*days == 1 && (pass.alt_deg - 72.8).abs() < 0.1, "{days} {pass:?}");
    assert!(css.remedy.as_ref().unwrap().contains("2025-06-10 02:11"), "{:?}", css.remedy);
}

#[test]
fn the_other_passes_are_where_the_reference_has_them() {
    let rows = paper();
    for (i, alt_deg, utc) in [(3, 44.5, "17:05"), (4, 59.5, "09:44"), (5, 68.3, "08:56"), (6, 50.1, "17:04")] {
        let pass = rows[i].pass.as_ref().unwrap();
        assert!(pass.at_stated_time && (pass.alt_deg - alt_deg).abs() < 0.1, "{i} {pass:?}");
        assert!(satphot::base::time::iso_utc(pass.epoch, 0).contains(utc), "{i} {pass:?}");
        assert_eq!(Some(pass.label), rows[i].stated.label, "{i}");
    }
    assert_eq!(rows[5].pass.as_ref().unwrap().label, PaperLabel::Twilight, "sunlit at the start, Sun at -24 deg");
    // 99 % is printed for 97.2 %: the pass is there, its Moon is not
    assert_eq!((rows[3].standing, rows[4].standing), (Standing::Differs, Standing::Agrees));
    assert!(rows[3].remarks[0].contains("97.2 % lit, not 99"), "{:?}", rows[3].remarks);
}

#[test]
fn without_elements_near_enough_sun_and_moon_alone_are_checked_and_that_is_said() {
    let row = &paper()[0];
    assert!(row.pass.is_none() && row.remarks.iter().any(|r| r.contains("pass not checked")), "{:?}", row.remarks);
    let folder = tempfile::tempdir().unwrap();
    let text = "time_utc,target,sun_alt_deg\n2025-06-10T09:40:00Z,NOSUCHSAT,-33.8\n";
    let output = check(folder.path(), text, &["-q"]).expect(0, &[]);
    assert!(
        output.out.contains("agrees (sky only)") && output.out.contains("no elements of NOSUCHSAT"),
        "{}",
        output.out
    );
}

#[test]
fn one_instant_in_any_zone_is_one_answer() {
    let folder = tempfile::tempdir().unwrap();
    let text = "time_local,zone,target\n2025-06-10 19:40,Australia/Sydney,ISS\n10-06-25 19:40,+10:00,25544\n\
                2025-06-10T09:40,UTC,iss\n2025-06-10 20:40,AEDT,ISS (ZARYA)\n";
    let output = check(folder.path(), text, &["--csv", "-q"]).expect(0, &[]);
    let rows: Vec<Vec<String>> = csv::Reader::from_reader(output.out.as_bytes())
        .records()
        .map(|r| r.unwrap().iter().map(str::to_owned).collect())
        .collect();
    assert_eq!(rows.len(), 4);
    for row in &rows {
        assert_eq!(row[2], "2025-06-10T09:40:00Z");
        assert_eq!(row[6..16], rows[0][6..16], "Sun, Moon and pass");
    }
}

#[test]
fn wrong_numbers_within_a_true_pass_are_reported_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let text = "time_utc,target,moon_illum_pct,sun_alt_deg,label,max_v_mag,median_v_mag,seeing\n\
                2025-06-10 09:44,ISS,50%,-80,Twilight,12.0,11.0,2\n2025-06-10 09:44,ISS,99,-34,Day,,,\n";
    let output = check(folder.path(), text, &[]).expect(0, &["columns not read: seeing", "site Macquarie"]);
    for says in ["Moon 99.1 % lit, not 50", "not -80", "the pass is night", "is fainter than the median", "is not day"]
    {
        assert!(output.out.contains(says), "{says}: {}", output.out);
    }
}

#[test]
fn a_damaged_table_is_an_error_with_its_line_and_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let head = "time_local,zone,target,moon_illum_pct\n";
    for (text, says) in [
        ("", "the file is empty"),
        ("# a comment\n", "the file is empty"),
        ("time_utc,target\n", "no rows below the names"),
        ("zone,target\n+10:00,ISS\n", "column time_utc or time_local is missing"),
        ("time_utc,moon_illum_pct\n2025-06-10 09:44,99\n", "column target is missing"),
        ("time_local,target\n2025-06-10 09:44,ISS\n", "time_local needs a column zone, or --zone"),
        ("time_utc,time_local,zone,target\n,,,\n", "keep one"),
        ("time_utc,target,target\n2025-06-10 09:44,ISS,CSS\n", "column target is there twice"),
        (
            &format!("{head}2025-06-10 19:40,AEST,ISS,99\n2025-02-30 19:40,AEST,ISS,99\n"),
            "passes.csv:3: column time_local",
        ),
        (&format!("{head}yesterday,AEST,ISS,99\n"), "not a date and time such as 2025-06-08 20:33"),
        (&format!("{head}2025-06-10 19:40,Mars/Olympus,ISS,99\n"), "passes.csv:2: column zone: \"Mars/Olympus\""),
        (&format!("{head}2025-06-10 19:40,,ISS,99\n"), "column zone: is empty"),
        (&format!("{head}2025-06-10 19:40,AEST,,99\n"), "column target: is empty"),
        (&format!("{head}2025-06-10 19:40,AEST,ISS,101\n"), "\"101\" is not a number from 0 to 100"),
        (&format!("{head}2025-06-10 19:40,AEST,ISS,full\n"), "\"full\" is not a number"),
        (&format!("{head}2025-06-10 19:40,AEST,ISS\n"), "passes.csv:2"),
        (&format!("{}2150-06-10 19:40,AEST,ISS,99\n", head), "1900 to 2100"),
    ] {
        let output = check(folder.path(), text, &[]);
        assert_ne!(output.code, 0, "{text}");
        assert!(output.err.contains(says), "{says}: {}", output.err);
    }
    satphot(folder.path(), &["check-table", "absent.csv"]).expect(4, &["absent.csv"]);
    satphot(folder.path(), &["check-table", "--zone", "Nowhere"]).expect(2, &["Australia/Sydney"]);
    satphot(folder.path(), &["check-table", "--time-err-min", "-1"]).expect(2, &["--time-err-min"]);
    satphot(folder.path(), &["check-table", "-o", "x.csv"]).expect(2, &[".ecsv"]);
}

#[test]
fn the_table_goes_to_a_file_with_units() {
    let folder = tempfile::tempdir().unwrap();
    satphot(folder.path(), &["check-table", "-o", "checked.ecsv"]).expect(0, &["wrote checked.ecsv"]);
    let text = std::fs::read_to_string(folder.path().join("checked.ecsv")).unwrap();
    assert!(text.contains("name: sun_alt_deg, unit: deg"), "{text}");
    assert_eq!(text.lines().filter(|l| !l.starts_with('#')).count(), 8);
}
