//! `satphot predict geometry` as another program's author meets it: the reference cases, files with faults, streams.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use support::{RunOutput, satphot};

const HEADER: &str =
    "id,height_m,src_elev_deg,obs_x_m,obs_y_m,obs_z_m,nx,ny,nz,area_m2,brdf,p1,p2,p3,earth_brdf,ep1,ep2,ep3";
const PLATE: &str = "plate,550000,30,0,0,6378000,0,0,-1,2,lambertian,0.5,,,lambertian,0.3,,";

/// Runs it on a text, in a folder of its own.
fn geometry(text: &str, more: &[&str]) -> RunOutput {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cases.csv"), text).unwrap();
    satphot(folder.path(), &[&["predict", "geometry", "cases.csv"], more].concat())
}

/// The rows of a table of fluxes, by column.
fn table(text: &str) -> Vec<HashMap<String, String>> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    reader.deserialize().map(Result::unwrap).collect()
}

fn number(row: &HashMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} of {row:?}"))
}

#[test]
fn the_reference_cases_have_their_direct_flux_to_1e_8_and_say_why_a_flux_is_zero() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/brightness_vectors.csv");
    let Ok(text) = std::fs::read_to_string(path) else {
        println!("skipped: ../shared/reference/brightness_vectors.csv not present");
        return;
    };
    let output = satphot(Path::new("."), &["predict", "geometry", path, "--tolerance", "1e-3", "-q"]).expect(0, &[]);
    let (expected, got) = (table(&text), table(&output.out));
    assert_eq!((expected.len(), output.err.as_str()), (got.len(), ""));
    for (e, g) in expected.iter().zip(&got) {
        let id = &e["id"];
        assert_eq!(*id, g["id"]);
        let (wanted, direct) = (number(e, "direct_per_E0"), number(g, "direct_per_E0"));
        assert!((direct - wanted).abs() <= 1e-8 * wanted, "{id}: {direct:e} {wanted:e}");
        let (wanted, earth) = (number(e, "earth_per_E0"), number(g, "earth_per_E0"));
        assert_eq!(earth == 0.0, wanted == 0.0, "{id}: {earth:e} {wanted:e}");
        let slack = number(g, "earth_err_est").max(1e-2 * wanted);
        assert!((earth - wanted).abs() <= slack, "{id}: {earth:e} {wanted:e}");
        if direct == 0.0 || earth == 0.0 {
            assert!(!g["skipped"].is_empty(), "{id} is dark for no reason");
        }
        if e["brdf"] == "mirror" {
            // a closed form on both sides; the file has 16 digits
            assert!((earth - wanted).abs() <= 1e-8 * wanted, "{id}: {earth:e} {wanted:e}");
            assert_eq!(g["nodes"], "0", "{id}");
        }
    }
}

#[test]
fn a_row_that_cannot_be_computed_keeps_its_place_and_the_others_go_on() {
    let rows = [
        PLATE.replace("plate", "good"),
        PLATE.replace("plate", "flat").replace("0,0,-1", "0,0,0"),
        PLATE.replace("plate", "buried").replace("550000", "-1"),
        PLATE.replace("plate", "\"of, glass\"").replace("lambertian,0.5", "glass,0.5"),
        "short,550000".to_string(),
        PLATE.replace("plate", "here").replace("0,0,6378000", "0,0,6928000"),
        PLATE.replace("plate", "last"),
    ];
    let output = geometry(&format!("{HEADER}\n{}\n", rows.join("\n")), &[]).expect(3, &["5 of 7 rows", "warn"]);
    let rows = table(&output.out);
    let ids: Vec<&str> = rows.iter().map(|r| r["id"].as_str()).collect();
    assert_eq!(ids, ["good", "flat", "buried", "of, glass", "short", "here", "last"]);
    for (row, words) in rows.iter().zip([
        &[][..],
        &["nx, ny, nz", "0, 0, 0"],
        &["height_m = -1", "above 0"],
        &["brdf = glass", "phong"],
        &["src_elev_deg is empty"],
        &["observer", "at the satellite"],
        &[],
    ]) {
        assert_eq!(row["direct_per_E0"].is_empty() && row["nodes"].is_empty(), !words.is_empty(), "{row:?}");
        assert!(words.iter().all(|w| row["warn"].contains(w)), "{words:?} {row:?}");
    }
    assert_eq!(rows[0]["earth_per_E0"], rows[6]["earth_per_E0"]);
}

#[test]
fn columns_come_in_any_order_and_comments_marks_and_results_of_others_are_ignored() {
    let plain = geometry(&format!("{HEADER}\n{PLATE}\n"), &[]).expect(0, &[]).out;
    let names: Vec<&str> = HEADER.split(',').collect();
    let cells: Vec<&str> = PLATE.split(',').collect();
    let turned = |of: &[&str]| of.iter().rev().copied().collect::<Vec<_>>().join(",");
    let text = format!(
        "\u{feff}# a comment\nearth_per_E0,{},colour,warn\r\n# another\r\n9.9,{},blue,never\r\n",
        turned(&names),
        turned(&cells)
    );
    assert_eq!(geometry(&text, &[]).expect(0, &[]).out, plain);
    let row = &table(&plain)[0];
    assert_eq!(row["skipped"], "direct: surface faces away from the source");
    // 17 significant digits read back exactly
    assert!(row["earth_per_E0"].split('e').next().unwrap().len() == 18, "{row:?}");
}

#[test]
fn an_empty_sky_of_lambertian_ground_is_the_closed_form() {
    // Sun and observer in the zenith and nadir axis, ground of albedo 1 far below: a Lambert sphere seen full face,
    // E/E0 = (2/3) (R/r)² onto a surface that faces it; the surface sends A ρ/π of it straight down
    let (r_m, far_m) = (6_378_000.0_f64, 1e12);
    let case = format!("far,{far_m},90,0,0,{r_m},0,0,-1,3,lambertian,0.5,,,lambertian,1,,");
    let row = &table(&geometry(&format!("{HEADER}\n{case}\n"), &["--tolerance", "1e-8"]).expect(0, &[]).out)[0];
    let expected = 2.0 / 3.0 * (r_m / (r_m + far_m)).powi(2) * 3.0 * 0.5 / std::f64::consts::PI / (far_m * far_m);
    // the sphere is not at infinity: terms of R/r = 6e-6
    assert!((number(row, "earth_per_E0") / expected - 1.0).abs() < 5e-5, "{row:?} {expected:e}");
}

#[test]
fn a_surface_that_creates_light_is_computed_with_a_warning() {
    let text = format!("{HEADER}\n{}\n", PLATE.replace("lambertian,0.5,,", "phong,0.9,0.8,3"));
    let row = &table(&geometry(&text, &[]).expect(0, &[]).out)[0];
    assert_eq!(row["warn"], "energy");
    assert!(number(row, "earth_per_E0") > 0.0);
}

#[test]
fn the_answer_does_not_depend_on_threads_or_on_where_the_cases_come_from() {
    let rows: Vec<String> =
        (0..300).map(|i| PLATE.replace("plate", &format!("r{i}")).replace(",30,", &format!(",{},", i % 90))).collect();
    let text = format!("{HEADER}\n{}\n", rows.join("\n"));
    let one = geometry(&text, &["-j", "1"]).expect(0, &[]).out;
    assert_eq!(one.lines().count(), 301);
    assert_eq!(geometry(&text, &["-j", "3"]).expect(0, &[]).out, one);

    let mut child = Command::new(env!("CARGO_BIN_EXE_satphot"))
        .args(["predict", "geometry", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success() && String::from_utf8(output.stdout).unwrap() == one);
}

#[test]
fn files_and_arguments_that_cannot_be_used_are_named_with_their_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    satphot(folder.path(), &["predict", "geometry", "none.csv"]).expect(4, &["none.csv"]).without_results();
    geometry("", &[]).expect(4, &["cases.csv", "height_m"]).without_results();
    geometry("id,height_m\na,1\n", &[]).expect(2, &["cases.csv", "missing column: src_elev_deg"]).without_results();
    geometry(&format!("{HEADER}\n"), &[]).expect(0, &["no case"]);
    for bad in ["0", "-1", "nan", "0.9", "x"] {
        let tolerance = format!("--tolerance={bad}");
        geometry(&format!("{HEADER}\n{PLATE}\n"), &[tolerance.as_str()]).expect(2, &["above 0", "1e-4"]);
    }
}
