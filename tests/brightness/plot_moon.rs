//! `satphot plot moon`: the lunar laws against documented numbers, their flags, the table and the figure.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;

use support::{RunOutput, satphot};

fn moon(more: &[&str]) -> RunOutput {
    let empty = tempfile::tempdir().unwrap();
    satphot(empty.path(), &[&["plot", "moon"], more].concat())
}

fn rows(text: &str) -> Vec<HashMap<String, String>> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().map(Result::unwrap).collect()
}

fn number(row: &HashMap<String, String>, name: &str) -> f64 {
    row[name].parse().unwrap_or(f64::NAN)
}

/// The row of a phase.
fn at(rows: &[HashMap<String, String>], phase_deg: f64) -> HashMap<String, String> {
    rows.iter().find(|r| number(r, "phase_deg") == phase_deg).unwrap().clone()
}

#[test]
fn rolo_and_cox_have_the_magnitudes_of_an_independent_evaluation() {
    let rows = rows(&moon(&["--csv"]).expect(0, &[]).out);
    // zero libration, V; an evaluation of its own at 544 to 554 nm, printed to 0.01 mag: the band is wider, 0.01 each
    for (deg, rolo, cox) in [
        (2.0, -12.82, -12.68),
        (5.0, -12.61, -12.60),
        (7.0, -12.52, -12.55),
        (10.0, -12.41, -12.47),
        (20.0, -12.12, -12.21),
        (30.0, -11.86, -11.95),
        (60.0, -11.05, -11.12),
        (90.0, -10.07, -10.13),
    ] {
        let row = at(&rows, deg);
        assert!((number(&row, "rolo_v_mag") - rolo).abs() < 0.011, "{deg}: {row:?}");
        assert!((number(&row, "cox_v_mag") - cox).abs() < 0.0051, "{deg}: {row:?}");
        if deg >= 5.0 {
            assert!(number(&row, "rolo_minus_cox_mag").abs() < 0.091, "{deg}: {row:?}");
        }
    }
    // Cox is 0.14 too faint at 2 deg, where the surge of Krisciunas & Schaefer overshoots by 0.1
    let two = at(&rows, 2.0);
    assert!((number(&two, "rolo_minus_cox_mag") + 0.14).abs() < 0.005, "{two:?}");
    assert!((number(&two, "ks_v_mag") + 12.92).abs() < 0.005, "{two:?}");
    assert!((number(&two, "ks_v_mag") - number(&two, "rolo_v_mag") + 0.1).abs() < 0.01, "{two:?}");
}

#[test]
fn the_surge_is_that_of_the_reference_point_and_ends_at_7_degrees() {
    let rows = rows(&moon(&["--csv"]).out);
    assert!((number(&at(&rows, 3.0), "ks_v_mag") + 12.849_952_791_119_064).abs() < 1e-9);
    for row in rows.iter().filter(|r| number(r, "phase_deg") >= 7.0 && number(r, "phase_deg") < 180.0) {
        assert!(number(row, "ks_minus_cox_mag").abs() < 1e-12, "{row:?}");
    }
}

#[test]
fn every_number_beyond_the_range_of_its_law_is_flagged_and_no_other() {
    for row in rows(&moon(&["--csv"]).out) {
        let deg = number(&row, "phase_deg");
        let flag = |inside: bool| if inside { "0" } else { "1" };
        assert_eq!(row["cox_extrapolated"], flag(deg <= 150.0), "{row:?}");
        assert_eq!(row["ks_extrapolated"], flag(deg <= 150.0), "{row:?}");
        assert_eq!(row["rolo_extrapolated"], flag((1.55..=97.0).contains(&deg)), "{row:?}");
    }
    let table = moon(&[]).expect(0, &["literature only", "waxing and waning"]).out;
    assert!(table.contains("no light*") && table.contains("-9.671*") && table.contains("-11.858 "), "{table}");
}

#[test]
fn a_new_moon_gives_no_light_where_the_printed_polynomial_gives_minus_3_85() {
    let rows = rows(&moon(&["--csv"]).out);
    let new = at(&rows, 180.0);
    assert_eq!((new["cox_v_mag"].as_str(), new["rolo_v_mag"].as_str()), ("", ""));
    assert!((number(&new, "cox_polynomial_v_mag") + 3.850_96).abs() < 1e-5, "{new:?}");
    assert_eq!(number(&new, "illum_frac"), 0.0);
    // half the disc is lit at 90 deg
    assert!((number(&at(&rows, 90.0), "illum_frac") - 0.5).abs() < 1e-12);
}

#[test]
fn the_figure_names_laws_units_and_phases_and_is_the_same_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let draw = |name: &str| {
        satphot(folder.path(), &["plot", "moon", "--phase-deg", "0,45,-90", "-q", "-o", name]).expect(0, &[]);
        std::fs::read_to_string(folder.path().join(name)).unwrap()
    };
    let svg = draw("a.svg");
    for word in [
        "phase angle [deg]",
        "V [mag]",
        "law − Cox [mag]",
        "wavelength [nm]",
        "W m⁻² nm⁻¹",
        "Krisciunas",
        "ROLO",
        "Cox",
        "α = 45°",
        "α = −90°",
        "waxing",
    ] {
        assert!(svg.contains(word), "{word}");
    }
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    assert_eq!(svg, draw("b.svg"));
}

#[test]
fn the_table_names_band_and_what_is_not_modelled() {
    let folder = tempfile::tempdir().unwrap();
    satphot(folder.path(), &["plot", "moon", "-q", "-o", "out"]).expect(0, &[]);
    let ecsv = std::fs::read_to_string(folder.path().join("out/moon.ecsv")).unwrap();
    for word in ["rolo_v_mag, unit: mag", "mag_system: Vega", "asymmetry", "holzloehner_2017", "literature only"] {
        assert!(ecsv.contains(word), "{word}");
    }
    assert!(folder.path().join("out/moon.svg").exists());
}

#[test]
fn wrong_phases_laws_and_files_are_refused_by_name() {
    moon(&["--phase-deg", "0,181"]).expect(2, &["--phase-deg", "181"]);
    moon(&["--phase-deg", "NaN"]).expect(2, &["--phase-deg"]);
    moon(&["--law", "lumos"]).expect(2, &["--law", "cox_opposition"]);
    moon(&["-o", "moon.png"]).expect(2, &["--out", ".svg"]);
}
