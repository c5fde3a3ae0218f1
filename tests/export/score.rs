//! Observations for SCORE: which rows are taken, the cells of the file, and every rule of the server reported with row,
//! column and value.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // tests

use crate::export_support;

use std::path::Path;

use export_support::{facts, later, missed, row, shared};
use satphot::config::Reporter;
use satphot::export::{Choice, Facts, Finding, SCORE_HEADER, check_score, score_text, select, sound};
use satphot::photometry::Flags;
use satphot::tables::PhotometryRow;

fn path() -> &'static Path {
    Path::new("photometry.ecsv")
}

fn score(rows: &[PhotometryRow], facts: &Facts) -> satphot::Result<String> {
    score_text(path(), &select(rows, Choice::default(), true).kept, facts, true).map(|s| s.text)
}

/// Cells by the names of the header.
fn cells(text: &str) -> Vec<Vec<String>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    assert_eq!(reader.headers().unwrap(), SCORE_HEADER.as_slice());
    reader.records().map(|r| r.unwrap().iter().map(str::to_owned).collect()).collect()
}

fn cell<'a>(row: &'a [String], column: &str) -> &'a str {
    &row[SCORE_HEADER.iter().position(|c| *c == column).unwrap()]
}

// ---------------------------------------------------------------- selection

#[test]
fn only_measured_and_usable_magnitudes_become_observations() {
    let mut rows = vec![row(), missed(10)];
    rows.push(PhotometryRow { verdict: "caution".into(), ..later(20, 12.0) });
    rows.push(PhotometryRow { verdict: "reject".into(), ..later(30, 12.0) });
    rows.push(PhotometryRow { flags: Flags::LOWER_LIMIT.0, ..later(40, 12.0) });
    rows.push(PhotometryRow { status: "failed".into(), verdict: "reject".into(), v_mag: None, ..later(50, 12.0) });
    rows.push(PhotometryRow { v_mag: None, v_mag_err: None, ..later(60, 12.0) });
    let selected = select(&rows, Choice::default(), true);
    assert_eq!(selected.kept.len(), 2, "{}", selected.text());
    assert_eq!(selected.omitted.iter().map(|(_, n)| n).sum::<usize>(), 5, "nothing vanishes: {}", selected.text());
    assert_eq!(select(&rows, Choice::default(), false).kept.len(), 1);
    assert_eq!(select(&rows, Choice::named("use, caution,reject").unwrap(), true).kept.len(), 4);
    for wrong in ["", "caution", "all", "use;caution"] {
        assert!(Choice::named(wrong).unwrap_err().to_string().contains("`verdicts`"), "{wrong}");
    }
}

#[test]
fn a_row_that_cannot_be_true_is_named_with_frame_column_and_value() {
    let cases: [(fn(&mut PhotometryRow), &str, &str); 10] = [
        (|r| r.status = "good".into(), "status", "good"),
        (|r| r.verdict = "maybe".into(), "verdict", "maybe"),
        (|r| r.date_mid = "2025-06-31T10:00:00Z".into(), "date_mid", "2025-06-31"),
        (|r| r.mjd_mid_d = Some(60_835.5), "mjd_mid_d", "60835.5"),
        (|r| r.v_mag_err = Some(-0.1), "v_mag_err", "-0.1"),
        (|r| r.exptime_s = Some(0.0), "exptime_s", "0"),
        (|r| r.alt_deg = Some(91.0), "alt_deg", "91"),
        (|r| r.object_id = "98067A".into(), "object_id", "98067A"),
        (|r| r.norad_cat_id = Some(-5), "norad_cat_id", "-5"),
        (|r| r.status = "nondetection".into(), "v_mag", "non-detection"),
    ];
    for (damage, column, value) in cases {
        let mut rows = vec![row(), later(10, 12.0)];
        sound(path(), &rows).unwrap();
        damage(&mut rows[1]);
        let selected = sound(path(), &rows).unwrap_err().to_string();
        for word in ["photometry.ecsv", "row 2", "iss_00010.fits", column, value] {
            assert!(selected.contains(word), "{word}: {selected}");
        }
    }
}

// ---------------------------------------------------------------- SCORE

#[test]
fn a_score_file_has_the_cells_of_the_shared_example() {
    let Some(example) = shared("score.csv") else { return };
    let facts = Facts {
        reporter: Reporter { filter: Some("V (unfiltered colour-transformed)".into()), ..facts().reporter },
        ..facts()
    };
    let (mine, theirs) = (cells(&score(&[row(), missed(12)], &facts).unwrap()), cells(&example));
    assert_eq!(mine.len(), theirs.len());
    for (i, (mine, theirs)) in mine.iter().zip(&theirs).enumerate() {
        for column in SCORE_HEADER.iter().filter(|c| !["comments", "observer_orcid"].contains(c)) {
            let (mine, theirs) = (cell(mine, column), cell(theirs, column));
            match (mine.parse::<f64>(), theirs.parse::<f64>()) {
                (Ok(mine), Ok(theirs)) => assert_eq!(mine, theirs, "row {i}, {column}"),
                _ => assert_eq!(mine, theirs, "row {i}, {column}"),
            }
        }
    }
    assert_eq!(cell(&mine[0], "observer_orcid"), cell(&theirs[0], "observer_orcid"));
    assert!(cell(&mine[1], "comments").starts_with("non-detection"));
}

#[test]
fn a_score_file_passes_its_own_check_whatever_the_names_hold() {
    for name in ["ISS, \"THE\" STATION", "météore ☾", "a\nb\r\nc", ""] {
        let rows = [PhotometryRow { object_name: name.into(), ..row() }, missed(7)];
        let reporter = Reporter { instrument: Some(format!("camera, \"{name}\"")), ..facts().reporter };
        let text = score(&rows, &Facts { reporter, ..facts() }).unwrap();
        let wrong: Vec<Finding> = check_score(&text).into_iter().filter(|f| !f.warning).collect();
        assert_eq!(wrong, [], "{text}");
        assert_eq!(cells(&text).len(), 2);
    }
    let none = score(&[], &facts()).unwrap();
    assert_eq!(none.lines().count(), 1, "no observations: the header alone");
}

#[test]
fn a_detection_without_a_limit_gets_the_one_of_its_noise() {
    let noise = |flux_e, flux_err_e| PhotometryRow { limit_v_mag: None, flux_e, flux_err_e, ..row() };
    // 5000 e- with 100 e- of noise, half of its square the target's own: t = 5 sqrt(5000 + t) = 366.3 e-, 2.838 mag fainter
    let text = score(&[noise(Some(5_000.0), Some(100.0))], &facts()).unwrap();
    assert_eq!(cell(&cells(&text)[0], "limiting_magnitude"), "14.772");
    // the same sky under a target a hundred times as bright: the limit stays, 5 mag below where the target rises
    let text = score(&[noise(Some(500_000.0), Some(505_000f64.sqrt()))], &facts()).unwrap();
    assert_eq!(cell(&cells(&text)[0], "limiting_magnitude"), "19.772");
    let error = score(&[noise(None, None)], &facts()).unwrap_err().to_string();
    assert!(error.contains("limit_v_mag") && error.contains("flux_err_e"), "{error}");
}

/// A good file whose first row has `value` under `column`.
fn with_cell(column: &str, value: &str) -> String {
    let mut rows = cells(&score(&[row(), later(5, 12.0)], &facts()).unwrap());
    rows[0][SCORE_HEADER.iter().position(|c| *c == column).unwrap()] = value.into();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(SCORE_HEADER).unwrap();
    rows.iter().for_each(|r| writer.write_record(r).unwrap());
    String::from_utf8(writer.into_inner().unwrap()).unwrap()
}

#[test]
fn every_rule_of_the_server_is_found_with_row_column_and_value() {
    for (column, value) in [
        ("norad_cat_id", "0"),
        ("norad_cat_id", "-25544"),
        ("norad_cat_id", "1234567"),
        ("norad_cat_id", "25544.0"),
        ("norad_cat_id", ""),
        ("observation_time_utc", "2025-06-09 10:33:02Z"),
        ("observation_time_utc", "2025-06-09T10:33:02"),
        ("observation_time_utc", "2025-02-30T10:33:02Z"),
        ("observation_time_utc", "2025-06-09T23:59:60Z"),
        ("observation_time_utc", "2016-12-31T23:59:60Z"),
        ("observation_time_uncertainty_sec", "-1"),
        ("observation_time_uncertainty_sec", "n/a"),
        ("apparent_magnitude", "bright"),
        ("apparent_magnitude", ""),
        ("apparent_magnitude", "nan"),
        ("apparent_magnitude_uncertainty", ""),
        ("apparent_magnitude_uncertainty", "-0.1"),
        ("observer_latitude_deg", "90.1"),
        ("observer_longitude_deg", "208.9"),
        ("observer_altitude_m", "high"),
        ("limiting_magnitude", "0"),
        ("limiting_magnitude", ""),
        ("instrument", ""),
        ("observing_mode", "ROBOT"),
        ("observing_filter", ""),
        ("observer_email", "me"),
        ("observer_orcid", "1234"),
        ("observer_orcid", "0000-0002-1825-0097; 0000-0001-5109-3700"),
        ("satellite_right_ascension_deg", "361"),
        ("satellite_right_ascension_deg", "10"),
        ("satellite_declination_deg", "-91"),
        ("sigma_2_ra", "0.01"),
        ("range_to_satellite_km", "none"),
        ("range_to_satellite_uncertainty_km", "5"),
        ("range_rate_of_satellite_uncertainty_km_per_sec", "0.1"),
        ("data_archive_link", "my disk"),
        ("mpc_code", "ELEVENCHARS"),
    ] {
        let found: Vec<Finding> = check_score(&with_cell(column, value)).into_iter().filter(|f| !f.warning).collect();
        let hit = found.iter().find(|f| f.row == Some(1) && (f.column == column || f.problem.contains(column)));
        // a magnitude and its uncertainty are one rule: either may be named
        let pair = found.iter().find(|f| f.row == Some(1) && f.column.starts_with("apparent_magnitude"));
        let hit = hit.or(pair.filter(|_| column.starts_with("apparent_magnitude")));
        assert!(hit.is_some(), "{column} = {value}: {found:?}");
        assert!(found.iter().all(|f| f.row == Some(1)), "{found:?}");
    }
    assert!(check_score(&with_cell("comments", "any, \"text\"")).iter().all(|f| f.warning));
}

#[test]
fn the_form_of_a_score_file_is_checked_before_its_rows() {
    let good = score(&[row(), later(5, 12.0)], &facts()).unwrap();
    assert_eq!(check_score(&good), []);
    let line_of = |text: &str| {
        let found: Vec<Finding> = check_score(text).into_iter().filter(|f| !f.warning).collect();
        assert!(!found.is_empty(), "{text}");
        found[0].line
    };
    assert_eq!(line_of(""), 1);
    assert_eq!(line_of(&format!("\u{feff}{good}")), 1);
    assert_eq!(line_of(&good.replacen("satellite_name", "\"satellite_name\"", 1)), 1);
    assert_eq!(line_of(&good.replacen("apparent_magnitude,", "magnitude,", 1)), 1);
    assert_eq!(line_of(&good.replace(',', ";")), 1);
    assert_eq!(line_of(&good.replacen(",mpc_code", "", 1)), 1);
    assert_eq!(line_of(&good.replacen("\nISS", "\n\nISS", 1)), 2);
    assert_eq!(line_of(&format!("{good}\n")), 4);
    assert_eq!(line_of(&good.replacen("\nISS", "\nISS,ISS", 1)), 2);
    assert_eq!(line_of(&good.replacen("\nISS", "\n\"ISS", 1)), 2);
    assert_eq!(line_of(&good.replacen("\nISS (ZARYA)", "\nSATHUB-SATELLITE", 1)), 2);
    let twice = format!("{good}{}\n", good.lines().last().unwrap());
    assert!(check_score(&twice).iter().any(|f| f.warning && f.line == 4));
    // line ends of Windows are no fault
    assert_eq!(check_score(&good.replace('\n', "\r\n")), []);
}

#[test]
fn the_sample_of_the_site_is_refused_for_its_sample_rows_alone() {
    let Some(example) = shared("score_site_example.csv") else { return };
    let found: Vec<Finding> = check_score(&example).into_iter().filter(|f| !f.warning).collect();
    let columns: Vec<&str> = found.iter().map(|f| f.column.as_str()).collect();
    assert!(columns.iter().all(|c| ["satellite_name", "norad_cat_id"].contains(c)), "{found:?}");
    assert_eq!(columns.iter().filter(|c| **c == "satellite_name").count(), 4);
    let Some(example) = shared("score.csv") else { return };
    assert_eq!(check_score(&example), []);
}
