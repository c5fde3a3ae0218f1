//! The closing summary: robust numbers, passes, aligned tables.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // tests

use proptest::prelude::*;
use satphot::base::stats::robust;
use satphot::base::stats::scatter;
use satphot::photometry::Flags;
use satphot::report::summary::pass_table;
use satphot::report::summary::text_table;
use satphot::tables::row_passes::PASS_GAP_S;
use satphot::tables::row_passes::passes;
use satphot::tables::selection::used_residuals;
use satphot::tables::{PhotometryRow, ResidualRow};

fn row(mjd: f64, norad: i64, v_mag: Option<f64>, verdict: &str) -> PhotometryRow {
    PhotometryRow {
        date_mid: "2025-06-09T10:33:02.500Z".into(),
        norad_cat_id: Some(norad),
        object_name: format!("OBJECT {norad}"),
        mjd_mid_d: Some(mjd),
        v_mag,
        residual_mag: v_mag.map(|v| v - 12.0),
        illum: "moon".into(),
        status: if v_mag.is_some() { "ok" } else { "nondetection" }.into(),
        verdict: verdict.into(),
        ..Default::default()
    }
}

#[test]
fn median_and_scatter_are_those_of_numpy_and_ignore_an_outlier() {
    // numpy.median([1, 2, 3, 4, 100]) = 3; astropy.stats.mad_std of it = 1.4826022185056018.
    let (centre, sigma) = robust(&[100.0, 1.0, 3.0, 2.0, 4.0]).unwrap();
    assert_eq!(centre, 3.0);
    assert!((sigma - 1.482_602_218_505_601_8).abs() < 1e-12);
    assert_eq!(robust(&[1.0, 2.0]), Some((1.5, 0.5 * 1.482_602_218_505_602)));
    assert_eq!(robust(&[5.0]), Some((5.0, 0.0)));
    assert_eq!(robust(&[]), None);
    assert_eq!(robust(&[f64::NAN]), None);
}

proptest! {
    #[test]
    fn median_and_scatter_move_and_scale_with_the_values(
        values in prop::collection::vec(-100.0..100.0f64, 1..40), shift in -50.0..50.0f64, scale in 0.1..10.0f64,
    ) {
        let (centre, sigma) = robust(&values).unwrap();
        let moved: Vec<f64> = values.iter().map(|v| v * scale + shift).collect();
        let (moved_centre, moved_sigma) = robust(&moved).unwrap();
        // Rounding of values up to 1000 in two operations.
        prop_assert!((moved_centre - (centre * scale + shift)).abs() < 1e-10);
        prop_assert!((moved_sigma - sigma * scale).abs() < 1e-10);
    }
}

#[test]
fn a_pass_ends_at_a_long_gap_or_at_another_target() {
    let gap = PASS_GAP_S / 86_400.0;
    let rows = vec![
        row(60_000.0 + 3.0 * gap, 1, Some(12.0), "use"),
        row(60_000.0, 1, Some(12.0), "use"),
        row(60_000.0 + 0.9 * gap, 1, Some(12.0), "use"),
        row(60_000.0 + 0.5 * gap, 2, Some(12.0), "use"),
        PhotometryRow { status: "failed".into(), ..Default::default() },
    ];
    let found: Vec<(i64, usize)> =
        passes(&rows).iter().map(|pass| (pass[0].norad_cat_id.unwrap(), pass.len())).collect();
    assert_eq!(found, [(1, 2), (2, 1), (1, 1)], "in order of time; the frame without a time is in none");
}

#[test]
fn a_target_whose_name_is_spelled_in_two_ways_is_one_target() {
    let mut rows = vec![row(60_000.0, 1, None, ""), row(60_000.000_1, 1, None, "")];
    rows[1].object_name = "another spelling".into();
    assert_eq!(passes(&rows).len(), 1);
}

#[test]
fn columns_line_up_and_numbers_stand_right() {
    let rows = vec![
        vec!["étoile".to_owned(), "1.5".to_owned()],
        vec!["b".to_owned(), "-12.25".to_owned()],
        vec!["c".to_owned()],
    ];
    let text = text_table(&["name", "V"], &rows);
    assert_eq!(text, "name         V\n------  ------\nétoile     1.5\nb       -12.25\nc\n");
    assert_eq!(text_table(&["a"], &[]), "a\n-\n");
}

#[test]
fn an_empty_first_cell_keeps_its_place() {
    let text = text_table(&["a", "b"], &[vec![String::new(), "x".to_owned()]]);
    assert_eq!(text, "a  b\n-  -\n   x\n");
}

#[test]
fn the_pass_table_counts_all_frames_and_uses_only_the_good() {
    let rows = vec![
        row(60_000.0, 25544, Some(12.2), "use"),
        row(60_000.000_1, 25544, Some(11.9), "caution"),
        row(60_000.000_2, 25544, Some(2.0), "reject"),
        row(60_000.000_3, 25544, None, "use"),
    ];
    let text = pass_table(&rows, "V");
    let line: Vec<&str> = text.lines().nth(2).unwrap().split_whitespace().collect();
    let expected =
        ["1", "2025-06-09T10:33:02", "OBJECT", "25544", "2", "4", "12.05", "11.90", "moon", "+0.050", "0.222"];
    assert_eq!(line, expected, "\n{text}");
}

/// The cells of a pass by their headings.
fn cells(rows: &[PhotometryRow]) -> impl Fn(&str) -> String + use<> {
    let text = pass_table(rows, "V");
    let lines: Vec<Vec<char>> = text.lines().map(|l| l.chars().collect()).collect();
    // the rule below the head shows where the columns are
    let rule: Vec<(usize, usize)> = {
        let mut found = Vec::new();
        let mut start = None;
        for (i, c) in lines[1].iter().chain([&' ']).enumerate() {
            match (c, start) {
                ('-', None) => start = Some(i),
                (' ', Some(from)) => {
                    found.push((from, i));
                    start = None;
                }
                _ => {}
            }
        }
        found
    };
    let cell = move |line: usize, (from, to): (usize, usize)| -> String {
        lines[line].iter().skip(from).take(to - from).collect::<String>().trim().to_owned()
    };
    move |name| {
        let at = rule.iter().find(|at| cell(0, **at) == name).unwrap_or_else(|| panic!("{name}"));
        cell(2, *at)
    }
}

#[test]
fn a_pass_of_one_magnitude_has_a_median_and_no_scatter() {
    let one = PhotometryRow { v_mag_err: Some(0.02), v_mag_err_sys: Some(0.05), ..row(6e4, 1, Some(12.5), "use") };
    let cell = cells(&[one]);
    assert_eq!((cell("used").as_str(), cell("frames").as_str(), cell("median V").as_str()), ("1", "1", "12.50"));
    assert_eq!((cell("residual").as_str(), cell("sigma").as_str()), ("+0.500", ""));
    assert_eq!((cell("V err").as_str(), cell("V err sys").as_str()), ("0.020", "0.050"));
    assert_eq!((scatter(&[5.0]), scatter(&[5.0, f64::NAN]), scatter(&[])), (None, None, None));
    assert!((scatter(&[1.0, 2.0]).unwrap() - 0.5 * 1.482_602_218_505_602).abs() < 1e-12);
}

#[test]
fn a_pass_without_a_magnitude_has_empty_cells_and_not_the_errors_of_nothing() {
    // measured, but no zeropoint: a flux has an error, a magnitude there is not
    let bare = PhotometryRow { status: "ok".into(), v_mag_err: Some(0.02), ..row(6e4, 1, None, "caution") };
    let cell = cells(&[bare, row(6e4 + 1e-4, 1, None, "use")]);
    assert_eq!((cell("used").as_str(), cell("frames").as_str()), ("0", "2"));
    for name in ["median V", "brightest V", "residual", "sigma", "V err", "V err sys"] {
        assert_eq!(cell(name), "", "{name}");
    }
}

#[test]
fn a_lower_limit_on_the_brightness_is_counted_as_a_frame_and_used_in_no_median() {
    let limit = PhotometryRow { flags: Flags::LOWER_LIMIT.0, ..row(6e4 + 1e-4, 1, Some(14.0), "caution") };
    let cell = cells(&[row(6e4, 1, Some(12.0), "use"), limit, row(6e4 + 2e-4, 1, Some(12.2), "use")]);
    assert_eq!((cell("used").as_str(), cell("frames").as_str()), ("2", "3"));
    assert_eq!((cell("median V").as_str(), cell("residual").as_str()), ("12.10", "+0.100"));
}

#[test]
fn rejected_residuals_do_not_count() {
    let residual =
        |value, verdict: &str| ResidualRow { residual_mag: value, verdict: verdict.into(), ..Default::default() };
    let rows = [
        residual(Some(1.0), "use"),
        residual(Some(9.0), "reject"),
        residual(None, "use"),
        residual(Some(2.0), "caution"),
    ];
    assert_eq!(used_residuals(&rows), [1.0, 2.0]);
}
