//! What observations say of a satellite, said in every output of its magnitudes: text, meta block, list of satellites.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use satphot::brightness::Catalogue;
use satphot::brightness::catalogue::{NOT_COMPARED, Standing};
use support::satphot;

const SITE: &str = "-33.7703,151.1113,70";
const ELEMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/presets/iss_2025_june.tle");
/// What nobody may overlook of the film.
const FILM: [&str; 4] =
    ["starlink-v2-film: observations scatter by 0.68 mag", "held out", "does not generalise", "1.9 mag"];

#[test]
fn every_entry_states_a_scatter_with_its_source_or_says_it_was_not_compared() {
    for entry in Catalogue::load(None).unwrap().entries() {
        let standing = Standing::from(entry);
        let text = standing.text();
        match standing.scatter_mag {
            Some(scatter) => {
                assert!(scatter > 0.1 && standing.source.len() > 20 && !standing.caveat.is_empty(), "{text}")
            }
            None => assert!(text.starts_with(NOT_COMPARED) && standing.source.is_empty(), "{}: {text}", entry.name),
        }
    }
    let of = |name: &str| Standing::from(Catalogue::load(None).unwrap().find(name).unwrap());
    assert_eq!((of("starlink-v2-film").scatter_mag, of("starlink-v1.5").scatter_mag), (Some(0.68), Some(0.71)));
    assert!(of("iss").text().contains("not better than several tenths"));
}

#[test]
fn every_prediction_says_so_in_its_text_and_in_the_meta_block_of_its_table() {
    let folder = tempfile::tempdir().unwrap();
    let film = ["--satellite", "starlink-v2-film"];
    let cases: [(&str, &str, Vec<&str>); 7] = [
        (
            "pass.ecsv",
            "pass",
            vec![
                "--elements",
                ELEMENTS,
                "--site",
                SITE,
                "--start",
                "2025-06-10T09:30:00",
                "--hours",
                "1",
                "--step-s",
                "120",
            ],
        ),
        ("sky.ecsv", "sky", vec!["--height-km", "550", "--sun-alt-deg", "-15", "--sun-az-deg", "250", "--grid", "3x4"]),
        (
            "skies.ecsv",
            "sky",
            vec![
                "--height-km",
                "550",
                "--site",
                SITE,
                "--time",
                "2025-06-11T04:00:00",
                "--sequence",
                "12",
                "--grid",
                "3x4",
            ],
        ),
        (
            "day.ecsv",
            "day",
            vec![
                "--site",
                SITE,
                "--date",
                "2025-06-11",
                "--hours",
                "2",
                "--step-min",
                "60",
                "--points",
                "20",
                "--height-km",
                "550",
            ],
        ),
        ("duty.ecsv", "duty", vec!["--site", SITE, "--date", "2025-06-11", "--points", "20", "--height-km", "550"]),
        (
            "few.ecsv",
            "constellation",
            vec![
                "--site",
                SITE,
                "--start",
                "2025-06-11T08:00:00",
                "--steps",
                "1",
                "--count",
                "300",
                "--inclination-deg",
                "53",
            ],
        ),
        ("month.ecsv", "month", vec!["--site", SITE, "--month", "2025-06", "--nights", "1", "--points", "20"]),
    ];
    for (file, verb, args) in cases {
        let satellite = if verb == "month" { ["--satellite", "starlink-v2-film"] } else { film };
        let output = satphot(folder.path(), &[&["predict", verb, "-q", "-o", file][..], &satellite, &args].concat())
            .expect(0, &[]);
        let table = std::fs::read_to_string(folder.path().join(file)).unwrap();
        for word in FILM {
            assert!(output.out.contains(word), "{verb}: {word} is not in\n{}", output.out);
        }
        for word in &FILM[1..] {
            assert!(table.contains(word), "{verb}: {word} is not in {file}");
        }
    }
    // one that nobody compared says that
    let none = [
        "predict",
        "sky",
        "-q",
        "--satellite",
        "earendil-1",
        "--sun-alt-deg",
        "5",
        "--sun-az-deg",
        "0",
        "--grid",
        "3x4",
    ];
    assert!(satphot(folder.path(), &none).expect(0, &[]).out.contains(NOT_COMPARED));
}

#[test]
fn the_list_of_satellites_has_a_column_of_it_and_one_satellite_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let list = satphot(folder.path(), &["satellites", "--csv"]).expect(0, &[]).out;
    let mut reader = csv::Reader::from_reader(list.as_bytes());
    let (scatter, caveat) = {
        let head = reader.headers().unwrap();
        let at = |name: &str| head.iter().position(|c| c == name).unwrap();
        (at("scatter_mag"), at("caveat"))
    };
    for row in reader.records().map(Result::unwrap) {
        assert!(row[scatter].parse::<f64>().is_ok() || &row[scatter] == NOT_COMPARED, "{row:?}");
        assert!(!row[caveat].is_empty(), "{row:?}");
    }
    let whole = satphot(folder.path(), &["satellites", "starlink-v2-film"]).expect(0, &[]).out;
    assert!(FILM[1..].iter().all(|word| whole.contains(word)), "{whole}");
}
