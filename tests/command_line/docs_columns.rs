//! docs/columns.md says what every column of every table is: made from the definitions of the tables.
//!
//! `SATPHOT_WRITE_DOCS=1 cargo test --test command_line` writes it again.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;

use satphot::photometry::Flags;
use satphot::tables::{ALL, Column};

fn page() -> String {
    let mut text = String::from(
        "# Every column of every table\n\nNames hold the unit; an empty cell is missing, 0 is a value. Magnitudes are V (Vega) \
         outside the atmosphere. V = V_inst − ZP − k X − C (B−V), V_inst = −2.5 lg(e⁻/s): ZP is negative, k and C are added by \
         the air and the camera. Angles from north through east; altitudes without refraction. Times are UTC at mid-exposure. \
         `v_mag_err` is random, `v_mag_err_sys` is common to a night: do not add them row by row.\n",
    );
    for table in ALL {
        let (name, about) = (table.file, table.about);
        let _ = write!(text, "\n## {name}\n\n{about}\n\n| column | unit | type | meaning |\n|---|---|---|---|\n");
        for c in table.columns {
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
        "write it again: SATPHOT_WRITE_DOCS=1 cargo test --test command_line"
    );
}

#[test]
fn every_column_says_what_it_is_and_no_table_is_listed_twice() {
    for (i, table) in ALL.iter().enumerate() {
        assert!(ALL[..i].iter().all(|other| other.file != table.file), "{}", table.file);
        for (k, c) in table.columns.iter().enumerate() {
            assert!(c.description.len() > 2, "{}: {} is not described", table.file, c.name);
            assert!(!c.description.contains("  "), "{}: {}", table.file, c.description);
            assert!(
                table.columns[..k].iter().all(|other| other.name != c.name),
                "{}: {} is there twice",
                table.file,
                c.name
            );
        }
    }
}

#[test]
fn a_name_has_one_unit_one_ucd_and_one_type_in_all_tables() {
    // limits.ecsv has an area in pixels and 0 or 1, the tables of rendered pictures and of streaks a number and yes or no
    let differ = ["n_px", "saturated"];
    let all: Vec<&Column> = ALL.iter().flat_map(|table| table.columns).collect();
    for a in all.iter().filter(|a| !differ.contains(&a.name)) {
        for b in all.iter().filter(|b| b.name == a.name) {
            assert_eq!((a.unit, a.ucd, a.datatype), (b.unit, b.ucd, b.datatype), "{}", a.name);
        }
    }
}
