//! `satphot accuracy` and `--explain` as their user meets them.
#![allow(clippy::unwrap_used)]

use crate::support;

use support::{Night, satphot, simulated};

const SKY: &[&str] = &[
    "predict",
    "sky",
    "--satellite",
    "starlink-v1.5",
    "--height-km",
    "550",
    "--sun-alt-deg",
    "-25",
    "--sun-az-deg",
    "90",
    "--grid",
    "7x9",
    "--csv",
    "-q",
];
const HEADER: &str =
    "id,height_m,src_elev_deg,obs_x_m,obs_y_m,obs_z_m,nx,ny,nz,area_m2,brdf,p1,p2,p3,earth_brdf,ep1,ep2,ep3";

#[test]
fn the_list_names_every_method() {
    let folder = tempfile::tempdir().unwrap();
    let output = satphot(folder.path(), &["accuracy", "--list"]).expect(0, &[]);
    for method in satphot::accuracy::METHODS {
        assert!(output.out.contains(method.name), "{}", output.out);
    }
    assert!(output.out.lines().any(|l| l.starts_with("renderer")), "{}", output.out);
}

#[test]
fn a_sweep_says_where_its_default_stands_and_leaves_table_figure_and_page() {
    let folder = tempfile::tempdir().unwrap();
    let output = satphot(folder.path(), &["accuracy", "median", "penumbra", "-q", "-o", "a"]).expect(0, &[]);
    let defaults: Vec<&str> = output.out.lines().filter(|l| l.starts_with("    default: ")).collect();
    assert!(defaults.len() == 2 && defaults[0].contains(" of 6") && defaults[1].contains(" of 4"), "{defaults:#?}");
    let read = |name: &str| std::fs::read_to_string(folder.path().join("a").join(name)).unwrap();
    assert!(read("accuracy.html").contains("Default: on the front in"));
    assert!(read("accuracy_median.svg").contains("behind another setting"));
    // every median is exact
    let table = read("accuracy.ecsv");
    let medians: Vec<&str> = table.lines().filter(|l| l.starts_with("median,")).collect();
    assert_eq!(medians.len(), 18);
    assert!(medians.iter().all(|l| l.contains(",stored units,0.0,0.0,0.0,")), "{medians:#?}");
}

#[test]
fn a_seed_draws_other_cases_and_the_same_ones_again() {
    let folder = tempfile::tempdir().unwrap();
    let errors = |seed: &str, out: &str| {
        satphot(folder.path(), &["accuracy", "apertures", "-q", "--seed", seed, "-o", out]).expect(0, &[]);
        let table = std::fs::read_to_string(folder.path().join(out).join("accuracy.ecsv")).unwrap();
        let mut lines = table.lines().filter(|l| !l.starts_with('#')).map(|l| l.split(',').collect::<Vec<_>>());
        let head = lines.next().unwrap();
        let p95 = head.iter().position(|name| *name == "err_p95").unwrap();
        lines.map(|row| row[p95].to_string()).collect::<Vec<_>>()
    };
    let (published, other) = (errors("0", "a"), errors("3", "b"));
    assert!(published.len() == other.len() && published != other, "{other:?}");
    assert_eq!(other, errors("3", "c"));
}

#[test]
fn a_python_that_is_not_there_is_refused_by_name_and_none_at_all_is_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let apertures = ["accuracy", "apertures", "-o", "a"];
    let output = satphot(folder.path(), &apertures).expect(0, &["--python", "SATPHOT_PYTHON"]);
    assert_eq!(output.err.lines().count(), 1, "{}", output.err);
    satphot(folder.path(), &[&apertures[..], &["--python", "no/such/python"]].concat()).expect(2, &["no/such/python"]);
}

#[test]
fn explaining_a_sky_or_geometries_changes_no_byte_of_the_answer() {
    let folder = tempfile::tempdir().unwrap();
    let plain = satphot(folder.path(), SKY).expect(0, &[]);
    assert_eq!(plain.err, "");
    let output = satphot(folder.path(), &[SKY, &["--explain"]].concat());
    assert_eq!(output.out, plain.out);
    let output =
        output.expect(0, &["in umbra", "CPU us each", "saved ms", "one scene:", "differ by at most", "stated error"]);
    // a sky of given light sources has no Moon: by choice, not for want of light
    assert!(output.err.lines().any(|l| l.contains("switched off") && l.trim_end().ends_with('-')), "{}", output.err);

    let dark = "dark,550000,-40,0,0,6378000,0,0,-1,2,lambertian,0.5,,,lambertian,0.3,,";
    let away = "away,550000,30,0,0,6378000,0,0,1,2,lambertian,0.5,,,lambertian,0.3,,";
    std::fs::write(folder.path().join("cases.csv"), format!("{HEADER}\n{dark}\n{away}\n")).unwrap();
    let geometry = ["predict", "geometry", "cases.csv", "-q"];
    let plain = satphot(folder.path(), &geometry).expect(0, &[]);
    let output = satphot(folder.path(), &[&geometry[..], &["--explain"]].concat());
    assert_eq!(output.out, plain.out);
    output.expect(0, &["no lit ground in view", "umbra", "1 of 2", "surface faces away from the observer", "away"]);
}

#[test]
fn explaining_a_night_lists_stages_pixels_and_lights_with_their_times() {
    let night = Night::copy_of(&simulated("accuracy_explain", &[])).without_table("model");
    let output = night.satphot(&["run", "pipeline.toml", "--no-figures", "--explain", "-q"]);
    let output =
        output.expect(0, &["no [model]", "pixels of target frames", "the target cannot be there", "saved in all"]);
    assert!(!output.err.contains("one scene"), "there is no model: {}", output.err);
    assert!(night.manifest()["left_out_measured"]["items"].as_array().is_some_and(|items| items.len() >= 2));
}

#[test]
fn explaining_a_pass_lists_the_rows_that_are_not_made_and_changes_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let elements = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/night/iss-2025-june.tle");
    let pass = [
        "predict",
        "pass",
        "--elements",
        elements,
        "--site",
        "-33.7703,151.1113,70",
        "--satellite",
        "iss",
        "--start",
        "2025-06-09T08:40:00",
        "--hours",
        "3",
        "--step-s",
        "20",
        "--csv",
        "-q",
    ];
    let plain = satphot(folder.path(), &pass).expect(0, &[]);
    let output = satphot(folder.path(), &[&pass[..], &["--explain"]].concat());
    assert_eq!(output.out, plain.out);
    let output = output.expect(0, &["satellite below 0 deg", "in umbra", "one scene:"]);
    let rows = plain.out.lines().count() - 1;
    assert!(output.err.contains(&format!("{} of 541", 541 - rows)), "{rows}: {}", output.err);
}
