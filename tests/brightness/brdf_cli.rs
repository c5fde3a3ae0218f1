//! `satphot brdf fit` and `satphot brdf plot` as a user runs them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::Path;
use std::process::{Command, Output};

fn satphot(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_satphot")).arg("brdf").args(arguments).current_dir(folder).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// f = 0.3/π + 0.4 · 27/2π cos²⁵ in the plane of incidence, by blanks.
fn write_phong(path: &Path) {
    let mut text = String::from("phi_i theta_i phi_o theta_o BRDF\n");
    for phi_i in [20.0_f64, 45.0] {
        for phi_o in (0..=80).step_by(4) {
            let off = (f64::from(phi_o) - phi_i).to_radians().cos().max(0.0);
            let f = 0.3 / std::f64::consts::PI + 0.4 * 27.0 / std::f64::consts::TAU * off.powi(25);
            text.push_str(&format!("{phi_i} 0 {phi_o} 180 {f:.12e}\n"));
        }
    }
    std::fs::write(path, text).unwrap();
}

#[test]
fn a_fitted_line_is_drawn_from_the_file_it_was_written_to() {
    let folder = tempfile::tempdir().unwrap();
    write_phong(&folder.path().join("panel.txt"));
    let fitted = satphot(folder.path(), &["fit", "panel.txt", "--toml", "panel.toml", "--plot", "fit.svg"]);
    assert!(fitted.status.success(), "{}", stderr(&fitted));
    let text = stdout(&fitted);
    assert!(text.contains("42 rows, 42 fitted in lg f") && text.contains("correlation"), "{text}");
    let first_law = text.lines().skip_while(|l| !l.starts_with("---")).nth(1).unwrap();
    assert!(first_law.starts_with("phong"), "{text}");
    let line = std::fs::read_to_string(folder.path().join("panel.toml")).unwrap();
    assert!(line.starts_with("brdf = { kind = \"phong\", kd = "), "{line}");
    assert!(std::fs::read_to_string(folder.path().join("fit.svg")).unwrap().contains("measured (42)"));

    let drawn = satphot(folder.path(), &["plot", "panel.toml"]);
    assert!(drawn.status.success(), "{}", stderr(&drawn));
    let svg = std::fs::read_to_string(folder.path().join("panel.svg")).unwrap();
    assert!(svg.contains("<svg") && svg.contains("outgoing angle") && svg.contains("reflectance"));
}

#[test]
fn toml_to_standard_output_is_the_line_alone() {
    let folder = tempfile::tempdir().unwrap();
    write_phong(&folder.path().join("panel.txt"));
    let fitted = satphot(folder.path(), &["fit", "panel.txt", "--law", "phong", "--toml", "-"]);
    let text = stdout(&fitted);
    assert_eq!(text.lines().count(), 1, "{text}");
    let table: toml::Table = text.parse().unwrap();
    let n = table["brdf"]["n"].as_float().unwrap();
    assert!((n - 25.0).abs() < 1e-4, "{n}");
}

#[test]
fn rows_of_a_figure_are_comma_separated_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let output = satphot(folder.path(), &["plot", "starlink-chassis-lab", "--csv", "--incidence", "0"]);
    let text = stdout(&output);
    let peak = text.lines().find(|l| l.starts_with("0,0,")).unwrap();
    let f: f64 = peak.split(',').nth(2).unwrap().parse().unwrap();
    assert!((f - 2187.761623949552).abs() < 1e-6);
    let normal = text.lines().find(|l| l.starts_with("0,,,")).unwrap();
    assert!((normal.split(',').nth(3).unwrap().parse::<f64>().unwrap() - 0.57814).abs() < 1e-5);
    assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none(), "nothing is written with --csv");
    let list = stdout(&satphot(folder.path(), &["plot", "--list"]));
    assert!(list.contains("earth-ocean") && list.contains("ScatterWorks"), "{list}");
}

#[test]
fn what_is_wrong_is_reported_with_the_documented_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write_phong(&folder.path().join("panel.txt"));
    write("damaged.txt", "names\n1 2 3\n");
    write("typing.toml", "brdf = { kind = \"mirror\", reflectanc = 0.9 }\n");
    write("empty.toml", "x = 1\n");
    write("bright.toml", "kind = \"phong\"\nkd = 0.9\nks = 0.4\nn = 3.0\n");
    for (arguments, code, expected) in [
        (vec!["plot", "starlink-chasis-lab"], 2, "did you mean \"starlink-chassis-lab\""),
        (vec!["plot", "typing.toml"], 2, "reflectanc"),
        (vec!["plot", "empty.toml"], 2, "brdf = { kind"),
        (vec!["plot", "absent.toml"], 4, "absent.toml"),
        (vec!["plot", "earth-ocean", "--incidence", "95"], 2, "--incidence"),
        (vec!["plot", "bright.toml"], 0, "creates light"),
        (vec!["fit", "damaged.txt"], 4, "damaged.txt:2: 3 columns"),
        (vec!["fit", "absent.txt"], 4, "absent.txt"),
        (vec!["fit", "panel.txt", "--law", "phong", "--start", "m=1"], 2, "kd, ks, n"),
        (vec!["fit", "panel.txt", "--law", "binomial", "--terms", "0"], 2, "terms"),
        (vec!["fit", "panel.txt", "--clip", "1e9"], 2, "no law could be fitted"),
        (vec!["fit", "panel.txt", "--law", "phong", "--bounds", "n=1:5"], 0, "sits on its bound 5"),
    ] {
        let output = satphot(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(expected), "{arguments:?}: {}", stderr(&output));
    }
}
