//! `satphot predict compliance`: shares against laws (a satellite of one magnitude at 1000 km, half an area, a common error), the
//! verdict from observations against counts by hand, and what must be refused.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;

use support::{RunOutput, satphot};

type Cells = HashMap<String, String>;

const SITE: [&str; 4] = ["--site", "-33.77,151.11,70", "--date", "2025-06-21"];

fn run(folder: &Path, more: &[&str]) -> RunOutput {
    satphot(folder, &[&["predict", "compliance", "--csv"][..], &SITE, more].concat())
}

fn rows(text: &str) -> Vec<Cells> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().map(Result::unwrap).collect()
}

fn number(row: &Cells, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} of {row:?}"))
}

/// The row of a variant and a limit.
fn of<'a>(rows: &'a [Cells], variant: &str, limit: &str) -> &'a Cells {
    rows.iter().find(|r| r["variant"] == variant && r["rule"] == limit).unwrap_or_else(|| panic!("{variant} {limit}"))
}

/// A satellite of one magnitude at 1000 km, whatever the phase angle.
fn constant(folder: &Path, mag_1000km: f64, scatter: &str) {
    let entry = format!(
        "[[satellites]]\nname = \"constant\"\ntitle = \"of one magnitude\"\n{scatter}\n[satellites.empirical]\nkind = \"polynomial\"\n\
         mag_1000km = [{mag_1000km}]\nphase_deg = [0.0, 180.0]\n"
    );
    std::fs::write(folder.join("own.toml"), entry).unwrap();
}

const OWN: [&str; 4] = ["--satellites", "own.toml", "--satellite", "constant"];

#[test]
fn of_a_satellite_of_one_magnitude_the_share_is_the_cap_of_the_sky_that_is_near_enough() {
    let folder = tempfile::tempdir().unwrap();
    constant(folder.path(), 5.0, "");
    // V = 5 + 5 lg(d / 1000 km), d² + 2 d R sin a = h² + 2 R h, the Sun 1.01625 au away; up to a tenth of the sky is in the shadow
    let (radius, height) = (6_371.6f64, 20_000.0f64);
    let range = |alt_deg: f64| {
        let sin = alt_deg.to_radians().sin();
        ((radius * sin).powi(2) + height * (height + 2.0 * radius)).sqrt() - radius * sin
    };
    let altitudes = [40.0, 55.0, 70.0];
    let limits: Vec<String> =
        altitudes.iter().map(|a| format!("{a}={}", 5.0 + 5.0 * (1.01625 * range(*a) / 1000.0).log10())).collect();
    let limits = limits.join(",");
    let more =
        [&OWN[..], &["--height-km", "20000", "--points", "3000", "--step-min", "60", "--limit", &limits]].concat();
    let rows = rows(&run(folder.path(), &more).expect(0, &[]).out);
    for alt in altitudes {
        let row = of(&rows, "as listed", &alt.to_string());
        let cap = (1.0 - alt.to_radians().sin()) / (1.0 - 30f64.to_radians().sin());
        let lit = number(row, "n_lit") / number(row, "n");
        assert!(lit > 0.85, "{lit}");
        let share = number(row, "brighter_frac");
        assert!(share < cap + 0.005 && share > cap - 0.10, "{cap} {row:?}");
        assert!(row["brighter_p16_frac"].is_empty() && row["expected_frac"].is_empty(), "never compared: no interval");
    }
    // SATCON1 at 20 000 km
    assert!((number(of(&rows, "as listed", "SATCON1"), "limit_v_mag") - 10.9018).abs() < 1e-3);
}

#[test]
fn the_interval_is_all_magnitudes_off_by_the_error_and_the_expectation_each_by_itself() {
    let folder = tempfile::tempdir().unwrap();
    constant(folder.path(), 6.0, "scatter_mag = 0.4\nsources = { scatter = \"a test\" }");
    let more = [&OWN[..], &["--height-km", "550", "--limit", "a=5.6,b=6,c=6.4,all=15,none=-20"]].concat();
    let rows = rows(&run(folder.path(), &more).expect(0, &[]).out);
    let share = |limit: &str, column: &str| number(of(&rows, "as listed", limit), column);
    assert!(share("b", "brighter_frac") > 0.0);
    assert_eq!(share("b", "brighter_p84_frac"), share("c", "brighter_frac"));
    assert_eq!(share("b", "brighter_p16_frac"), share("a", "brighter_frac"));
    let expected = share("b", "expected_frac");
    assert!(expected > share("a", "brighter_frac") && expected < share("c", "brighter_frac"), "{expected}");
    assert_eq!((share("none", "brighter_frac"), share("all", "lit_brighter_frac")), (0.0, 1.0));
    assert!((share("all", "expected_frac") - share("all", "brighter_frac")).abs() < 0.01);
    assert!((share("b", "v_pred_err_mag") - 0.4).abs() < 1e-12);
}

#[test]
fn half_the_area_is_three_quarters_of_a_magnitude_and_what_mends_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let half = 2.5 * 2f64.log10();
    let limits = format!("a=5,b={}", 5.0 + half);
    let plate = "[[satellites]]\nname = \"plate\"\nsurfaces = [{ name = \"chassis\", area_m2 = 60.0, attitude = \"nadir\", \
                 brdf = { kind = \"phong\", kd = 0.2, ks = 0.3, n = 20.0 } }]\n";
    std::fs::write(folder.path().join("own.toml"), plate).unwrap();
    let scene = ["--satellites", "own.toml", "--satellite", "plate", "--height-km", "550", "--mend"];
    let more =
        [&scene[..], &["--points", "60", "--step-min", "60", "--tolerance", "1e-4", "--limit", &limits]].concat();
    let rows = rows(&run(folder.path(), &more).expect(0, &[]).out);
    let listed = |limit: &str| of(&rows, "as listed", limit);
    let changed = |what: &str, limit: &str| of(&rows, what, limit).clone();
    let halved = changed("half the area of chassis", "b");
    // what counts as lit ends at V 15 for both
    assert!((number(&halved, "v_p05_mag") - number(listed("b"), "v_p05_mag") - half).abs() < 0.1);
    assert_eq!(halved["brighter_frac"], listed("a")["brighter_frac"], "V < 5 and V + 0.75 < 5.75 are the same sky");
    for what in ["chassis diffuse", "chassis tilted 10 deg backwards"] {
        let row = changed(what, "a");
        assert!(row["of"] == "model" && number(&row, "n") == number(listed("a"), "n"));
        assert!(
            (number(&row, "v_p05_mag") - number(listed("a"), "v_p05_mag")).abs() > 1e-3,
            "{what} changes something"
        );
    }
}

#[test]
fn observations_are_counted_with_their_limits_and_by_passes() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("time,norad_cat_id,v_mag,limit_v_mag\n");
    // two passes of one satellite, one of another: magnitudes 5.0 to 7.7 in steps of 0.1, two limits
    for i in 0..28 {
        let (number, hour) = if i < 9 {
            (1, 10)
        } else if i < 18 {
            (1, 20)
        } else {
            (2, 10)
        };
        let mag = 5.0 + 0.1 * f64::from(i);
        writeln!(text, "2025-06-21T{hour}:{i:02}:00,{number},{mag:.1},").unwrap();
    }
    text += "2025-06-21T20:30:00,1,,6.05\n2025-06-21T10:31:00,2,,9.0\n2025-06-21T10:32:00,2,bad,\n";
    std::fs::write(folder.path().join("seen.csv"), &text).unwrap();
    let more = ["--satellite", "starlink-v2", "--points", "20", "--step-min", "120", "--observed", "seen.csv"];
    let output = run(folder.path(), &more).expect(0, &["1 of 31 rows of seen.csv are not used"]);
    let rows = rows(&output.out);
    let row = of(&rows, "as observed", "SATCON1");
    assert_eq!((row["n"].as_str(), row["n_lit"].as_str(), row["n_passes"].as_str()), ("30", "28", "3"));
    // brighter than 7: 20 magnitudes (5.0 to 6.9); 11 before the limit at 6.05, with 30 and then 18 left: S = 19/30 · 9/18
    let share = 1.0 - 19.0 / 30.0 * 9.0 / 18.0;
    assert!((number(row, "brighter_frac") - share).abs() < 1e-12, "{share} {row:?}");
    assert!(number(row, "brighter_p16_frac") < share && number(row, "brighter_p84_frac") > share);
    assert!(number(row, "brighter_p84_frac") - number(row, "brighter_p16_frac") > 0.3, "three passes are three trials");
    let eye = of(&rows, "as observed", "eye");
    assert!((number(eye, "brighter_frac") - 10.0 / 30.0).abs() < 1e-12);
    // wrong tables: no magnitude at all, a column that is none
    std::fs::write(folder.path().join("none.csv"), "time,norad_cat_id,v_mag\n2025-06-21T10:00:00,1,99.9\n").unwrap();
    let none = ["--satellite", "starlink-v2", "--points", "20", "--observed", "none.csv"];
    run(folder.path(), &none).expect(2, &["--observed", "no usable magnitude"]).without_results();
    std::fs::write(folder.path().join("none.csv"), "time,norad_cat_id\n2025-06-21T10:00:00,1\n").unwrap();
    run(folder.path(), &none).expect(4, &["no column of apparent magnitudes"]).without_results();
}

#[test]
fn tables_and_page_agree_for_any_number_of_threads_and_wrong_arguments_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let satellite = ["--satellite", "starlink-v2", "--points", "40", "--step-min", "60", "--survey", "rubin"];
    let out = |jobs: &'static str, out: &'static str| {
        run(folder.path(), &[&satellite[..], &["-j", jobs, "-o", out]].concat())
    };
    let one = out("1", "one").expect(0, &["compliance.ecsv", "compliance_worst.ecsv", "compliance.html"]);
    assert_eq!(one.out, out("2", "two").out);
    for file in ["compliance.ecsv", "compliance_worst.ecsv", "compliance.html"] {
        let [a, b] = ["one", "two"].map(|f| std::fs::read(folder.path().join(f).join(file)).unwrap());
        assert!(a == b, "{file}");
    }
    let page = std::fs::read_to_string(folder.path().join("one/compliance.html")).unwrap();
    let share = 100.0 * number(of(&rows(&one.out), "as listed", "SATCON1"), "brighter_frac");
    assert!(page.contains(&format!("SATCON1: {share:.2} %")), "{share}");
    // a limit deep in the inclination's reach: nothing passes over a pole on 53 deg
    let pole = ["--satellite", "starlink-v2", "--inclination-deg", "53", "--lat-deg", "89", "--date", "2025-12-21"];
    satphot(folder.path(), &[&["predict", "compliance"][..], &pole].concat()).expect(2, &["inclination"]);
    for (more, words) in [
        (&["--satellite", "starlink-v2", "--limit", "bright"][..], "--limit"),
        (&["--satellite", "starlink-v2", "--survey", "rubins"], "survey"),
        (&["--satellite", "starlnk-v2"], "starlink-v2"),
        (&["--satellite", "starlink-v2", "--min-alt", "95"], "--min-alt"),
        (&["--satellite", "starlink-v2", "--height-km", "550000"], "for 550000 m give 550"),
        (&["--satellite", "starlink-v2", "--column", "v_mag=Mag"], "--observed"),
    ] {
        run(folder.path(), more).expect(2, &[words]).without_results();
    }
}
