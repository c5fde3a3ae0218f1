//! `plot ground` and `plot earth`: a smooth track with a direction, labels inside the frame, remedies the verb knows, PNG.
#![allow(clippy::unwrap_used, clippy::panic)] // tests

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const ELEMENTS: &str = "fixtures/night/iss-2025-june.tle";

fn place(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn satphot(args: &[&str], out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_satphot"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .arg("plot")
        .args(args)
        .arg("-o")
        .arg(out)
        .output()
        .unwrap()
}

fn drawn(args: &[&str], name: &str) -> String {
    let done = satphot(args, &place(name));
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    std::fs::read_to_string(place(name)).unwrap()
}

fn refused(args: &[&str]) -> String {
    let done = satphot(args, &place("refused.svg"));
    assert!(!done.status.success());
    String::from_utf8_lossy(&done.stderr).into_owned()
}

const GROUND: [&str; 5] = ["ground", "--elements", ELEMENTS, "--time", "2025-06-09T10:33:00"];

/// Points of the longest line of the track's colour.
fn track_points(svg: &str) -> usize {
    let lines = svg.split("<polyline").skip(1).map(|l| l.split("/>").next().unwrap());
    lines
        .filter(|l| l.contains("#D55E00"))
        .map(|l| l.split("points=\"").nth(1).unwrap().split(' ').count())
        .max()
        .unwrap()
}

#[test]
fn the_track_is_smooth_whatever_the_rows_of_the_table_and_has_arrows() {
    let few = drawn(&[&GROUND[..], &["--rows", "2"]].concat(), "track_few.svg");
    let many = drawn(&[&GROUND[..], &["--rows", "200"]].concat(), "track_many.svg");
    // 93 min in steps of 30 s, broken at one edge of the map at least
    assert!(track_points(&few) > 60, "{}", track_points(&few));
    assert_eq!(track_points(&few), track_points(&many));
    let heads = few.split("<polygon").skip(1).filter(|p| p.split("/>").next().unwrap().contains("#D55E00")).count();
    assert!(heads >= 6, "{heads} arrows and the satellite");
}

#[test]
fn a_site_at_the_pole_is_named_inside_the_frame() {
    let svg = drawn(&[&GROUND[..], &["--site", "89,10,0"]].concat(), "track_pole.svg");
    let label = svg.split("<text").find(|t| t.contains("observer")).unwrap();
    let y: f64 = label.split(" y=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
    assert!(y > 115.0, "{y} is above the frame");
}

#[test]
fn refusals_name_arguments_that_exist_and_force_is_one() {
    let old = ["ground", "--elements", ELEMENTS, "--time", "2025-09-09T10:33:00"];
    let message = refused(&old);
    assert!(message.contains("--force-age") && !message.contains("force_age"), "{message}");
    drawn(&[&old[..], &["--force-age"]].concat(), "track_forced.svg");
    let message = refused(&["ground", "--elements", "none.tle", "--norad", "25544", "--time", "2025-06-09T10:33:00"]);
    assert!(message.contains("satphot fetch elements --norad 25544"), "{message}");
}

#[test]
fn a_map_and_an_earth_are_written_as_png_too() {
    for (args, name, size) in [
        (&GROUND[..], "map.png", (1440, 720)),
        (&["earth", "--time", "2025-06-09T10:33:00", "--pixels", "64"], "globe.png", (64, 64)),
    ] {
        let done = satphot(args, &place(name));
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(place(name)).unwrap())).read_info();
        let info = reader.unwrap().info().clone();
        assert_eq!((info.width, info.height), size);
    }
}

#[test]
fn an_earth_names_its_viewpoint_by_hemisphere_and_an_unlit_one_has_no_scale() {
    let earth = |from: &str, name: &str| {
        let time = "2025-06-09T10:33:00";
        drawn(&["earth", "--time", time, "--from", from, "--light-source", "sun", "--pixels", "64"], name)
    };
    let sydney = earth("151.1,-33.8,420", "sydney.svg");
    assert!(sydney.contains("from 151.1 E, 33.8 S") && sydney.contains("2025-06-09T10:33:00"), "{sydney}");
    assert!(sydney.contains("band 0.3-1.05 um"));
    // night below: no numbers of a scale, no legend of what is not in view
    assert!(sydney.contains("no lit ground in view") && !sydney.contains("0e0") && !sydney.contains("ring: under"));
    let day = earth("60,10,35786", "afternoon.svg");
    assert!(day.contains("ring: under the Sun") && day.contains("line: where it sets") && day.contains(">1e1<"));
}
