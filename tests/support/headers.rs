//! Headers made in the test, read as `satphot inspect` does.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, dead_code)]

use std::path::{Path, PathBuf};

use satphot::config::Config;
use satphot::pipeline::inspect::inspector::Inspector;
use satphot::pipeline::inspect::record::Inspection;

/// The reference data, or `None` with a word about it.
pub fn shared(what: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(what);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: ../shared/{what} not present");
    None
}

/// `KEY = value / comment` lines as cards: columns are set here, so that the tests stay readable.
pub fn cards(lines: &str) -> String {
    let fixed = |line: &str| match line.split_once('=') {
        Some((key, value)) if key.trim().len() <= 8 && !line.starts_with("HIERARCH") => {
            format!("{:<8}= {}\n", key.trim(), value.trim())
        }
        _ => format!("{line}\n"),
    };
    lines.lines().filter(|l| !l.trim().is_empty()).map(|l| fixed(l.trim())).collect()
}

fn read(inspector: &Inspector, lines: &str) -> Inspection {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("header.txt");
    // three cards at least make a text a header
    std::fs::write(&path, format!("SIMPLE  = T\nNAXIS   = 2\nNAXIS1  = 1000\nNAXIS2  = 800\n{}END\n", cards(lines)))
        .unwrap();
    inspector.inspect(&path).unwrap()
}

/// What is understood without a configuration.
pub fn inspected(lines: &str) -> Inspection {
    read(&Inspector::new(None, &[]).unwrap(), lines)
}

/// What is understood without a configuration but with `key=value` settings.
pub fn inspected_with(sets: &[&str], lines: &str) -> Inspection {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    read(&Inspector::new(None, &sets).unwrap(), lines)
}

/// What is understood with the paper's site and camera, and `key=value` settings on top.
pub fn inspected_at_macquarie(sets: &[&str], lines: &str) -> Inspection {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let night = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\".\"]\noutput = \"o\"\n";
    read(&Inspector::new(Some(Config::from_text(night, &sets).unwrap()), &[]).unwrap(), lines)
}

/// The mid-time, its source and error.
pub fn time(i: &Inspection) -> (&str, &str, f64) {
    let t = i.time.as_ref().unwrap_or_else(|| panic!("no time: {:?}", i.refused));
    (&t.date_mid, &t.time_source, t.time_err_s)
}

/// One of the lines holds all the words.
pub fn says(lines: &[String], words: &[&str]) -> bool {
    lines.iter().any(|l| words.iter().all(|w| l.contains(w)))
}
