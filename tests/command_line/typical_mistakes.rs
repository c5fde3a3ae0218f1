//! What new users type wrongly, and what the program answers: the key, option or file, what is accepted, what to do.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use crate::support::simulated;

/// A mistake, the line that makes it, the exit code, and what its answer holds; `=` begins what standard output holds where
/// the line is no mistake after all.
type Mistake = (&'static str, &'static str, i32, &'static [&'static str]);

const SITE_AND_START: &str = "--site -33.77,151.11,70 --start";

/// `TLE` stands for the elements, `SITE` for a site and the beginning of --start, `SKY` for a sky of a fixed Sun.
const MISTAKES: &[Mistake] = &[
    (
        "unknown key",
        "run --set photometry.aperture=3",
        2,
        &["photometry.aperture: unknown key", "did you mean", "aper_r_fwhm"],
    ),
    ("unknown table", "run wrong_table.toml", 2, &["observatory", "unknown key", "wrong_table.toml", "site"]),
    (
        "word for a number",
        "run --set site.lat_deg=abc",
        2,
        &["site.lat_deg", "\"abc\"", "expected a number", "decimal degrees"],
    ),
    ("latitude beyond the pole", "run --set site.lat_deg=-133", 2, &["site.lat_deg: -133", "-90 to 90 deg"]),
    (
        "sexagesimal latitude",
        "run --set site.lat_deg=\"-33:46:13\"",
        2,
        &["site.lat_deg", "-33:46:13", "decimal degrees", "-33.7703"],
    ),
    ("pixel in mm", "run --set detector.pixel_um=0.00376", 2, &["detector.pixel_um: 0.00376", "0.1 to 1000 µm"]),
    (
        "focal length in m",
        "run --set telescope.focal_length_mm=3.962",
        2,
        &["telescope.focal_length_mm: = 3.962", "arcsec/px come from the stars", "set telescope.focal_length_mm = 39"],
    ),
    ("missing folder", "run --set night.input=[\"nothere\"]", 4, &["nothere", "night.input"]),
    ("empty folder", "run --set night.input=[\"empty\"] -o out", 4, &["empty: no FITS file", "*.fits", "night.input"]),
    (
        "site without altitude",
        "init a.toml --site=-33.77,151.11",
        2,
        &["--site", "\"-33.77,151.11\"", "latitude,longitude,altitude"],
    ),
    ("negative latitude after a space", "init b.toml --site -33.77,151.11,70", 0, &["wrote b.toml"]),
    (
        "unknown satellite in init",
        "init c.toml --satellite starlnk",
        2,
        &["--satellite: \"starlnk\"", "did you mean \"starlink", "known: iss"],
    ),
    (
        "passes without elements",
        "passes SITE 2025-06-09T00:00:00 @empty",
        2,
        &["--elements: is not given", "give --elements, or -c FILE"],
    ),
    (
        "slashes in a date",
        "passes TLE SITE 2025/06/09",
        2,
        &["--start", "\"2025/06/09\" is not a time", "2025-06-09T20:20:00"],
    ),
    ("date alone", "passes TLE SITE 2025-06-09", 0, &["=2025-06-09T08:54"]),
    ("time with Z", "passes TLE SITE 2025-06-09T10:00:00Z --hours 12", 0, &["=2025-06-09T10:30"]),
    ("time with a zone", "passes TLE SITE 2025-06-09T10:00:00+10:00 --hours 12", 0, &["=2025-06-09T08:54"]),
    (
        "window reversed",
        "passes TLE SITE 2025-06-10T10:00:00 --end 2025-06-09T10:00:00",
        2,
        &["--end", "-24.000 h after --start", "above 0"],
    ),
    (
        "old elements",
        "passes TLE SITE 2026-06-10T10:00:00",
        5,
        &["360.6 d before", "14 d", "satphot fetch elements --norad 25544"],
    ),
    (
        "misspelt satellite",
        "predict sky --satellite starlnk-v2 SKY",
        2,
        &["\"starlnk-v2\"", "did you mean \"starlink-v2\"?", "known: iss"],
    ),
    ("satellite by its number", "predict sky --satellite 25544 SKY", 0, &["=iss at 416 km"]),
    (
        "number that is not in the file",
        "passes TLE --norad 44713 SITE 2025-06-09",
        5,
        &["44713 is not in the file", "ISS (ZARYA) [25544]", "satphot fetch elements --norad 44713"],
    ),
    ("output that exists", "predict sky --satellite iss SKY -o sky.svg", 0, &["wrote sky.svg"]),
    (
        "folder without permission",
        "predict sky --satellite iss SKY -o /proc/sky.svg",
        4,
        &["/proc/sky.svg", "make it and run again"],
    ),
    (
        "unknown ending of a figure",
        "predict sky --satellite iss SKY -o sky.png",
        2,
        &["--out: sky.png", ".ecsv", ".svg"],
    ),
    ("misspelt verb", "predcit sky", 2, &["\"predcit\": unknown verb", "did you mean `predict`?", "`satphot --help`"]),
    (
        "misspelt option",
        "predict sky --satelite iss",
        2,
        &["--satelite: unknown option", "did you mean `--satellite`?", "`satphot predict sky --help`"],
    ),
    (
        "neither site nor configuration",
        "predict pass TLE --satellite iss --start 2025-06-09T10:00:00 @empty",
        2,
        &["--site: is not given", "no pipeline.toml", "give --site, or -c FILE"],
    ),
    (
        "table without magnitudes",
        "zeropoint --matched bad.csv",
        4,
        &["bad.csv", "present: a, b", "--column v_mag=NAME"],
    ),
    ("text for a FITS file", "inspect note.fits", 4, &["note.fits", "neither a FITS file nor the text of a header"]),
    ("elements cut off", "passes --elements cut.tle SITE 2025-06-09", 4, &["cut.tle"]),
    ("decimal comma", "run comma.toml", 2, &["lat_deg = -33,7703", "decimal point", "comma.toml"]),
    (
        "unknown camera",
        "run --set detector.camera=asi1600",
        2,
        &["detector.camera: \"asi1600\"", "asi6200mm", "detector.e_per_adu"],
    ),
    ("memory without its unit", "run --max-memory 2G", 2, &["--max-memory: \"2G\" must be", "such as 600MB or 2GB"]),
    ("negative threads", "run -j -1", 2, &["--jobs: \"-1\" must be a whole number from 0"]),
    ("band that is not known", "limits tracked --band B", 2, &["--band: \"B\"", "V, g, r, i"]),
    ("unknown format", "export . --to ascii -o x", 2, &["--to: \"ascii\" must be one of", "votable, csv"]),
    (
        "SCORE without an output",
        "export . --to score --data-mode REAL",
        2,
        &["`satphot export` needs --out <FILE>", "`satphot export --help`"],
    ),
    (
        "export of a night that is not reduced",
        "export satphot-out/none --to csv -o x.csv",
        4,
        &["satphot-out/none", "satphot run"],
    ),
    ("folder for a configuration", "run .", 4, &[".: is a folder", "pipeline.toml"]),
    (
        "frame for a configuration",
        "run target_0000.fits",
        4,
        &["target_0000.fits: is a FITS file", "satphot init", "satphot inspect"],
    ),
    (
        "height of a constellation in mm",
        "predict constellation --satellite starlink-v2 --count 100 --height-km 55000000 --inclination-deg 53 SITE 2025-06-11 --steps 2",
        2,
        &["--height-km: 55000000 km", "between 1 and 200000 km"],
    ),
    (
        "height in m",
        "predict sky --satellite starlink-v2 --height-km 550000 SKY",
        2,
        &["--height-km: 550000 km", "for 550000 m give 550"],
    ),
    (
        "negative height",
        "predict sky --satellite starlink-v2 --height-km -5 SKY",
        2,
        &["--height-km: -5 km", "between 1 and 200000 km"],
    ),
    (
        "altitude beyond the zenith",
        "predict sky --satellite iss --sun-alt-deg 200 --sun-az-deg 90",
        2,
        &["--sun-alt-deg: 200", "-90 to 90 deg"],
    ),
    ("report on nothing", "report empty", 4, &["empty: holds no photometry.ecsv", "finished night"]),
    ("check of nothing", "verify empty", 4, &["empty: holds no manifest.json", "finished night"]),
    ("elements of no object", "fetch elements -o a.tle @empty", 2, &["--norad", "--norad 25544", "--name"]),
    (
        "object by name",
        "fetch elements --norad ISS -o a.tle",
        2,
        &["--norad: \"ISS\" must be a catalogue number", "25544", "--name"],
    ),
    (
        "longitude of the wrong sign",
        "run --set site.lon_deg=-151.1113 -o west",
        3,
        &["a longitude counted west", "configured -33.7703 -151.1113 deg", "check [site]"],
    ),
];

/// A night of its own with the files that the mistakes are about.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<std::path::PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = simulated("mistakes", &[]);
        let text = std::fs::read_to_string(folder.join("pipeline.toml")).unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
        let comma: Vec<&str> =
            text.lines().map(|l| if l.starts_with("lat_deg") { "lat_deg = -33,7703" } else { l }).collect();
        write("comma.toml", &comma.join("\n"));
        write("wrong_table.toml", &text.replace("[site]", "[observatory]"));
        write("bad.csv", "a,b\n1,2\n");
        write("note.fits", "hi\n");
        let elements = std::fs::read_to_string(folder.join("iss-2025-june.tle")).unwrap();
        write("cut.tle", &elements[..100]);
        std::fs::create_dir(folder.join("empty")).unwrap();
        folder
    })
}

/// Exit code, standard output and standard error of a line.
fn answer(line: &str) -> (Option<i32>, String, String) {
    let (line, inner) = match line.strip_suffix(" @empty") {
        Some(line) => (line, "empty"),
        None => (line, "."),
    };
    let elements = format!("--elements {}", folder().join("iss-2025-june.tle").display());
    let line = line
        .replace("TLE", &elements)
        .replace("SITE", SITE_AND_START)
        .replace("SKY", "--sun-alt-deg -10 --sun-az-deg 90");
    let words = line.split_whitespace();
    let output =
        Command::new(env!("CARGO_BIN_EXE_satphot")).current_dir(folder().join(inner)).args(words).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// Further ones, found by trial.
const FOUND_BY_TRIAL: &[Mistake] = &[
    ("folder for elements", "passes --elements empty SITE 2025-06-13", 4, &["empty: is a folder", "name a file"]),
    ("file that is not there", "inspect nosuch.fits", 4, &["nosuch.fits: no such file or folder"]),
    ("own satellites not there", "satellites --satellites nosuch.toml", 4, &["nosuch.toml: no such file or folder"]),
    (
        "height of a trail in m",
        "limits streak --height-km 420000 --mag 5 --area-m2 5",
        2,
        &["--height-km: 420000 km", "for 420000 m give 420"],
    ),
    ("figure of another format", "plot moon -o moon.gif", 2, &["moon.gif", ".svg"]),
    (
        "compass letters",
        "passes TLE --site 33S,151E,70 --start 2025-06-13",
        2,
        &["--site: \"33S\" must be a number", "south and west are negative"],
    ),
    ("satellite misspelt", "satellites is", 2, &["\"is\" is not in the catalogue", "did you mean \"iss\"?"]),
    (
        "satellite of an argument",
        "predict sky --satellite nosuch --height-km 420 SKY",
        2,
        &["--satellite: \"nosuch\" is not in the catalogue", "known: iss"],
    ),
];

#[test]
fn every_typical_mistake_is_answered_with_what_is_wrong_what_is_accepted_and_what_to_do() {
    assert_eq!(MISTAKES.len(), 50);
    let mut wrong = String::new();
    for (what, line, code, words) in MISTAKES.iter().chain(FOUND_BY_TRIAL) {
        let (exit, out, err) = answer(line);
        let missing: Vec<&str> = words
            .iter()
            .filter(|w| w.strip_prefix('=').map_or(!err.contains(**w), |w| !out.contains(w)))
            .copied()
            .collect();
        let style = *code == 0
            || (err.lines().any(|l| l.starts_with("error: ")) && !err.contains("os error") && !err.contains("Usage:"));
        if exit != Some(*code) || !missing.is_empty() || !style {
            wrong +=
                &format!("{what}: satphot {line}\n  exit {exit:?}, expected {code}; not said: {missing:?}\n{err}\n");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}
