//! docs/columns.md says what every column of every table is: made from the schema itself, so it cannot drift.
//!
//! `SATPHOT_WRITE_DOCS=1 cargo test --test command_line` writes it anew.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;

use satphot::photometry::Flags;
use satphot::tables::columns::{Column, PHOTOMETRY, RESIDUALS, SKY, STARS};

const TABLES: [(&str, &str, &[Column]); 4] = [
    ("photometry.ecsv", "One row per target frame, and per frame that failed, with its reason.", PHOTOMETRY),
    (
        "residuals.ecsv",
        "One row per target frame that has both magnitudes; residual = observed − modelled, positive = fainter.",
        RESIDUALS,
    ),
    ("stars.ecsv", "One row per measurement of a catalogue star.", STARS),
    ("sky.ecsv", "One row per direction of `predict sky`.", SKY),
];

fn page() -> String {
    let mut text = String::from(
        "# Every column of every table\n\nNames hold the unit; an empty cell is missing, 0 is a value. Magnitudes are V (Vega) \
         outside the atmosphere. V = V_inst − ZP − k X − C (B−V), V_inst = −2.5 lg(e⁻/s): ZP is negative, k and C are added by \
         the air and the camera. Angles from north through east; altitudes without refraction. Times are UTC at mid-exposure. \
         `v_mag_err` is random, `v_mag_err_sys` is common to a night: do not add them row by row.\n",
    );
    for (name, about, columns) in TABLES {
        let _ = write!(text, "\n## {name}\n\n{about}\n\n| column | unit | type | meaning |\n|---|---|---|---|\n");
        for c in columns {
            let meaning = c.description.replace('|', "\\|");
            let _ = writeln!(text, "| `{}` | {} | {} | {meaning} |", c.name, c.unit, c.datatype.ecsv());
        }
    }
    text.push_str("\n## Bits of `flags`\n\n| bit | name |\n|---|---|\n");
    for (flag, name) in Flags::NAMES {
        let _ = writeln!(text, "| {} | {name} |", flag.0);
    }
    text
}

#[test]
fn the_page_of_columns_is_that_of_the_schema() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/columns.md");
    if std::env::var_os("SATPHOT_WRITE_DOCS").is_some() {
        std::fs::write(&path, page()).unwrap();
    }
    assert_eq!(
        std::fs::read_to_string(path).unwrap(),
        page(),
        "write it anew: SATPHOT_WRITE_DOCS=1 cargo test --test command_line"
    );
}

#[test]
fn every_column_says_what_it_is_in_a_sentence_of_its_own() {
    for (name, _, columns) in TABLES {
        for c in columns {
            assert!(c.description.len() > 3, "{name}: {} is not described", c.name);
        }
    }
}
