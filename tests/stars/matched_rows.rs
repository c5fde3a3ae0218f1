//! Rows of matched tables that are no measurements: written twice, with decimal commas, or not there at all.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fmt::Write as _;

use satphot::zeropoint::matched::{Matched, Request, fit_matched, without_config};
use satphot::{Error, Result};

fn fit_text(text: &str) -> Result<Matched> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    let columns = std::collections::BTreeMap::new();
    fit_matched(&without_config(&[])?, &Request { table: file.path(), columns, band: "V", inst_constant_mag: 0.0 })
}

/// Instrumental magnitude, its error, V, B-V and airmass of star `k` of 240, in field k % 8; noise of 0.01 mag or so.
fn star(k: usize) -> [f64; 5] {
    let (x, v, b_v) = (1.0 + 0.13 * (k % 8) as f64, 9.0 + 0.02 * k as f64, 0.2 + 0.9 * ((k * 37) % 240) as f64 / 240.0);
    let noise = 0.02 * (((k * 97) % 241) as f64 / 241.0 - 0.5);
    [v - 23.37 + 0.12 * x + 0.08 * b_v + noise, 0.01, v, b_v, x]
}

/// The stars as a table of `id`, field and magnitudes; one with tabs may have commas in its numbers.
fn as_table(separator: &str) -> String {
    let mut text = ["id", "pointing", "inst_mag", "inst_mag_err", "Vmag", "B-V", "airmass"].join(separator) + "\n";
    for (k, s) in (0..240).map(star).enumerate() {
        let _ = writeln!(text, "{}{separator}{}{separator}{}", k / 8, k % 8, s.map(|v| v.to_string()).join(separator));
    }
    text
}

#[test]
fn a_row_written_twice_is_one_measurement_and_a_star_measured_twice_is_two() {
    let text = as_table(",");
    let once = fit_text(&text).unwrap();
    let (head, rows) = text.split_once('\n').unwrap();
    let twice = fit_text(&format!("{head}\n{rows}{rows}")).unwrap();
    assert_eq!(twice.excluded.get("exact duplicate"), Some(&240), "{:?}", twice.excluded);
    assert!(twice.notes.iter().any(|n| n.starts_with("240 rows are in the table twice")), "{:?}", twice.notes);
    let (once, twice) = (once.zeropoint.unwrap(), twice.zeropoint.unwrap());
    assert_eq!((once.n_used, once.zp_mag, once.errs()), (twice.n_used, twice.zp_mag, twice.errs()));
    // another measurement of the same star: other numbers
    let again = rows.replace("0.01,", "0.011,");
    let measured_twice = fit_text(&format!("{head}\n{rows}{again}")).unwrap();
    assert_eq!(measured_twice.excluded.get("exact duplicate"), None);
}

#[test]
fn a_decimal_comma_and_a_table_without_rows_are_explained() {
    let message = |text: &str| match fit_text(text) {
        Err(error @ Error::Table { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    let text = as_table("\t").replace('.', ",");
    let problem = message(&text);
    let first = text.lines().nth(1).unwrap().split('\t').nth(2).unwrap();
    assert!(problem.contains("`inst_mag`") && problem.contains(&format!("`{first}`")), "{problem}");
    assert!(problem.contains("write numbers with a point"), "{problem}");
    let problem = message(as_table(",").lines().next().unwrap());
    assert!(problem.contains("no rows") && problem.contains("inst_mag"), "{problem}");
}
