//! Messages go to standard error alone: whatever goes wrong, standard output stays empty for the next program in a pipe.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output};

fn satphot(folder: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_satphot")).current_dir(folder).args(line.split_whitespace()).output().unwrap()
}

#[test]
fn a_refusal_says_why_on_standard_error_and_nothing_on_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("text.csv"), "a,b\n1,2\n").unwrap();
    for (line, codes) in [
        ("run", &[4][..]),
        ("run --no-such-option", &[2]),
        ("flat", &[4]),
        ("zeropoint", &[4]),
        ("zeropoint --matched text.csv", &[4, 2]),
        ("measure", &[4]),
        ("compare none.ecsv", &[4]),
        ("report .", &[4]),
        ("report . -o page.txt", &[2]),
        ("export . --to fits -o x.fits", &[4]),
        ("export --check none.csv", &[4]),
        ("export text.csv --to votable -o x.vot", &[4]),
        ("solve none.fits", &[4]),
        ("detector none.fits", &[4]),
        ("passes", &[4, 2, 5]),
        ("check-table none.csv", &[4]),
        ("brdf fit none.txt", &[4]),
        ("brdf plot no-such-law", &[2, 4]),
        ("limits tracked --exptime-s -1", &[2]),
        ("predict sky --satellite no-such-satellite --height-km 500 -o x.svg", &[2]),
        ("satellites no-such-satellite", &[2]),
        ("simulate none.toml", &[4, 2]),
        ("accuracy no-such-method", &[2]),
        ("init --site nowhere", &[2]),
        ("published -o x.txt", &[2]),
    ] {
        let output = satphot(folder.path(), line);
        let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.code().is_some_and(|c| codes.contains(&c)), "{line}: {:?}\n{err}", output.status);
        assert!(out.is_empty(), "{line}: {out}");
        assert!(err.ends_with('\n') && err.len() > 20, "{line}: {err}");
    }
}

#[test]
fn what_was_requested_is_on_standard_output_and_notes_are_not() {
    let folder = tempfile::tempdir().unwrap();
    for line in ["init -", "satellites", "completions bash", "simulate --print-scenario", "limits tracked --csv"] {
        let output = satphot(folder.path(), line);
        assert!(output.status.success() && output.stdout.len() > 100, "{line}");
        assert!(!String::from_utf8_lossy(&output.stdout).contains("note:"), "{line}");
    }
    let output = satphot(folder.path(), "init night.toml");
    assert!(
        output.status.success() && output.stdout.is_empty() && !output.stderr.is_empty(),
        "a file is reported, not printed"
    );
}
