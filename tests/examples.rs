//! The programs in `examples/` run and print what they promise. Cargo builds them before the tests.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder of the built examples, next to that of this test.
fn examples() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    test.parent().and_then(Path::parent).unwrap().join("examples")
}

/// What an example prints, run in an empty folder.
fn output(name: &str, args: &[&str]) -> String {
    let program = examples().join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    assert!(
        program.is_file(),
        "{} is not built: run cargo build --examples, or cargo test without naming a test",
        program.display()
    );
    let folder = tempfile::tempdir().unwrap();
    let run =
        Command::new(program).args(args).current_dir(folder.path()).env("TMPDIR", folder.path()).output().unwrap();
    let text = String::from_utf8(run.stdout).unwrap();
    println!("{name}:\n{text}");
    assert!(run.status.success(), "{name}: {}", String::from_utf8_lossy(&run.stderr));
    text
}

/// The number after a word.
fn number_after(text: &str, word: &str) -> f64 {
    let rest = &text[text.find(word).unwrap_or_else(|| panic!("{word} is not in\n{text}")) + word.len()..];
    rest.split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn predict_pass_lists_the_moonlit_pass_of_the_evening() {
    let text = output("predict_pass", &[]);
    let pass = text.lines().find(|l| l.starts_with("2025-06-09T10:33")).unwrap();
    assert!((number_after(pass, "altitude") - 32.1).abs() < 0.11, "{pass}");
    assert!((number_after(pass, "range") - 748.7).abs() < 1.0, "{pass}");
    assert!(pass.contains("lunar_earthshine"), "{pass}");
    assert!((number_after(pass, " V") - 12.64).abs() < 0.05, "{pass}");
}

#[test]
fn sky_map_prints_four_rows_and_the_brightest_direction() {
    let text = output("sky_map", &[]);
    assert_eq!(text.lines().count(), 7, "{text}");
    assert!((0.0..7.0).contains(&number_after(&text, "brightest: V")), "{text}");
}

#[test]
fn fit_zeropoint_finds_the_terms_its_table_was_made_with() {
    let text = output("fit_zeropoint", &[]);
    assert!((number_after(&text, "ZP") - -23.40).abs() < 0.03, "{text}");
    assert!((number_after(&text, "\nk ") - 0.12).abs() < 0.02, "{text}");
    assert!((number_after(&text, "\nC ") - 0.08).abs() < 0.03, "{text}");
}

#[test]
fn aperture_finds_the_sky_and_the_star_of_its_image() {
    let text = output("aperture", &[]);
    assert!((number_after(&text, "sky") - 50.0).abs() < 0.01, "{text}");
    assert!((number_after(&text, "r 8 px:") - 10_000.0).abs() < 5.0, "{text}");
}

#[test]
fn reduce_night_prints_calibrated_magnitudes_and_the_zeropoint() {
    let text = output("reduce_night", &[]);
    assert!((number_after(&text, "zeropoint") - -23.37).abs() < 0.05, "{text}");
    assert!(text.lines().filter(|l| l.starts_with("2025-06-13T") && l.contains(" ok ")).count() >= 20, "{text}");
}

#[test]
fn own_satellite_lists_its_lights_at_rise_culmination_and_set() {
    let text = output("own_satellite", &[]);
    assert_eq!(text.lines().filter(|l| l.contains("earthshine")).count(), 3, "{text}");
}

#[test]
fn every_example_is_short_and_uses_the_root_of_the_library_alone() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let mut seen = 0;
    for path in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if path.extension().is_none_or(|e| e != "rs") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.lines().count() < 50, "{}", path.display());
        // `satphot::name` and `satphot::{names}`, never `satphot::room::name`; `ndarray` is another crate
        let text = text.replace("satphot::ndarray::", "ndarray::");
        for rest in text.split("satphot::").skip(1).filter(|rest| !rest.starts_with('{')) {
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap();
            assert!(!rest[end..].starts_with("::"), "{}: {rest}", path.display());
        }
        seen += 1;
    }
    assert_eq!(seen, 6);
}
