//! `satphot predict sky`: the geometry of the map against independent cases, its numbers against the engine, its files.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;

use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::sky::{Body, Sky};
use satphot::brightness::{Model, ModelSettings, Satellite, ToleranceOf};
use satphot::config::{self, Mode};
use satphot::tables::SKY;
use support::{RunOutput, satphot};

const NIGHT: [&str; 10] = [
    "predict",
    "sky",
    "--satellite",
    "starlink-v1.5",
    "--height-km",
    "550",
    "--sun-alt-deg",
    "-15",
    "--sun-az-deg",
    "250",
];
const AXES: [Vector<Itrs>; 3] = [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)];

fn sky(more: &[&str]) -> RunOutput {
    let empty = tempfile::tempdir().unwrap();
    satphot(empty.path(), &[&NIGHT[..], more].concat())
}

fn rows(text: &str) -> Vec<HashMap<String, String>> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().map(Result::unwrap).collect()
}

#[test]
fn a_line_of_sight_meets_the_orbits_where_the_reference_cases_put_the_satellite() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/brightness_vectors.csv");
    let Ok(text) = std::fs::read_to_string(path) else {
        println!("skipped: ../shared/reference/brightness_vectors.csv not present");
        return;
    };
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let mut compared = 0;
    for row in reader.deserialize::<HashMap<String, String>>() {
        let row = row.unwrap();
        let number = |name: &str| row[name].parse::<f64>().unwrap();
        let rad = |name: &str| number(name).to_radians();
        // below the horizon there is no line of sight; in the zenith of either the frame has no azimuth
        if number("sat_alt_deg") < 0.0 || number("sat_alt_deg") > 89.99 || number("src_elev_deg").abs() > 89.99 {
            continue;
        }
        let sun = Body::sun(rad("src_alt_deg"), rad("src_az_deg")).at_infinity();
        let sky = Sky::new(AXES, (6378.0, number("height_m") / 1e3), 0.0, sun, None).unwrap();
        let scene = sky.scene(rad("sat_alt_deg"), rad("sat_az_deg"));
        let z = scene.satellite_km.unit().unwrap();
        let s = scene.sun_km.unit().unwrap();
        assert!((z.dot(&s).asin().to_degrees() - number("src_elev_deg")).abs() < 1e-6, "{}", row["id"]);
        let y = (s - z * z.dot(&s)).unit().unwrap();
        let x = y.cross(&z);
        for (axis, name) in [(x, "obs_x_m"), (y, "obs_y_m"), (z, "obs_z_m")] {
            let got_m = scene.observer_km.dot(&axis) * 1e3;
            // angles are printed to 1e-10 deg; in a sky with the source near the zenith x and y turn more
            assert!((got_m - number(name)).abs() < 0.5, "{} {name}: {got_m}", row["id"]);
        }
        compared += 1;
    }
    assert!(compared > 150, "{compared}");
}

#[test]
fn every_direction_is_the_engine_with_a_satellite_there() {
    let output = sky(&["--mode", "as_published", "--grid", "4x7", "--csv"]).expect(0, &[]);
    let rows = rows(&output.out);
    let names: Vec<&str> = SKY.columns.iter().map(|c| c.name).collect();
    assert_eq!((rows.len(), output.out.lines().next().unwrap()), (28, names.join(",").as_str()));
    let model = config::Model { mode: Mode::AsPublished, ..config::Model::of("starlink-v1.5") };
    let mut settings = ModelSettings::try_from(&model).unwrap();
    settings.earth_radius_km = Some(6378.0);
    settings.tolerance_of = ToleranceOf::Total;
    let engine = Model::new(&Satellite::from_config(&model).unwrap(), &settings).unwrap();
    let sun = Body::sun((-15.0_f64).to_radians(), 250.0_f64.to_radians()).at_infinity();
    let sky = Sky::new(AXES, (6378.0, 550.0), 90.0_f64.to_radians(), sun, None).unwrap();
    for row in &rows {
        let [alt, az] = ["alt_deg", "az_deg"].map(|c| row[c].parse::<f64>().unwrap().to_radians());
        let expected = engine.brightness(&sky.scene(alt, az)).unwrap();
        for (column, expected) in [
            ("sun_v_mag", expected.sun.v_mag),
            ("earthshine_v_mag", expected.earthshine.v_mag),
            ("moon_v_mag", None),
            ("lunar_earthshine_v_mag", None),
        ] {
            match (row[column].parse::<f64>().ok(), expected) {
                // the program has other axes: rounding of the frame, through the quadrature's tolerance at most
                (Some(got), Some(expected)) => assert!((got - expected).abs() < 1e-5, "{column} {row:?} {expected}"),
                (got, expected) => assert_eq!(got, expected, "{column} {row:?}"),
            }
        }
    }
}

#[test]
fn flux_is_the_irradiance_in_suns_and_altitude_runs_fastest() {
    let flux = sky(&["--grid", "3x3", "--flux"]).expect(0, &[]);
    let table = rows(&sky(&["--grid", "3x3", "--csv"]).expect(0, &[]).out);
    let rows = rows(&flux.out);
    let at: Vec<(&str, &str)> = rows.iter().map(|r| (r["alt_deg"].as_str(), r["az_deg"].as_str())).collect();
    assert_eq!(at[..4], [("0", "0"), ("45", "0"), ("90", "0"), ("0", "180")]);
    for (row, full) in rows.iter().zip(&table) {
        let flux: f64 = row["flux"].parse().unwrap();
        match full["model_v_mag"].parse::<f64>() {
            // a Sun of V = −26.76
            Ok(v) => assert!((10_f64.powf(-0.4 * (v + 26.76)) / flux - 1.0).abs() < 1e-9, "{row:?} {full:?}"),
            Err(_) => assert_eq!(flux, 0.0),
        }
    }
}

#[test]
fn no_light_is_an_empty_magnitude_and_the_summary_says_how_much_of_the_sky_is_lit() {
    let output = sky(&["--mode", "as_published", "--set", "model.effects.shadow=cylinder"]).expect(0, &[]);
    for word in ["equal areas of sky", "equal altitudes and azimuths", "% of the sky lit", "brightest", "Sun  altitude"]
    {
        assert!(output.out.contains(word), "{word}\n{}", output.out);
    }
    let midnight = ["--sun-alt-deg", "-80", "--sun-az-deg", "0", "--satellite", "starlink-v1.5", "--height-km", "550"];
    let empty = tempfile::tempdir().unwrap();
    let dark =
        satphot(empty.path(), &[&["predict", "sky"], &midnight[..], &["-o", "dark.svg"]].concat()).expect(0, &[]);
    assert!(dark.out.contains("no light in any direction"), "{}", dark.out);
    assert!(std::fs::read_to_string(empty.path().join("dark.svg")).unwrap().contains("no data"));
    let csv = satphot(empty.path(), &[&["predict", "sky"], &midnight[..], &["--csv", "--grid", "3x4"]].concat());
    assert!(rows(&csv.out).iter().all(|r| r["model_v_mag"].is_empty() && r["illum"] == "none"), "{}", csv.out);
}

#[test]
fn the_moon_lights_what_the_sun_does_not_and_its_phase_can_be_chosen() {
    let moon = ["--moon-alt-deg", "40", "--moon-az-deg", "80", "--grid", "4x9", "--csv"];
    let full = rows(&sky(&moon).expect(0, &[]).out);
    // there everywhere, and where the Sun shines too faint to be computed
    assert!(full.iter().all(|r| r["lunar_earthshine_v_mag"].is_empty() == r["too_faint"].contains("lunar_earthshine")));
    assert!(full.iter().any(|r| r["too_faint"].is_empty()) && full.iter().any(|r| !r["too_faint"].is_empty()));
    let v = |r: &HashMap<String, String>, c: &str| r[c].parse::<f64>().unwrap();
    let phase = |deg: &str| rows(&sky(&[&moon[..], &["--moon-phase-deg", deg]].concat()).expect(0, &[]).out);
    for (bright, faint) in phase("10").iter().zip(phase("90")) {
        let fainter = v(&faint, "lunar_earthshine_v_mag") - v(bright, "lunar_earthshine_v_mag");
        // Cox: 0.026·80 + 4e-9 (90⁴ − 10⁴)
        assert!((fainter - 2.3424).abs() < 1e-3, "{fainter}");
        assert_eq!(bright["sun_v_mag"], faint["sun_v_mag"]);
        // scaled to the phase afterwards, so none is skipped
        assert!(bright["too_faint"].is_empty() && faint["too_faint"].is_empty());
    }
}

#[test]
fn a_moment_takes_sun_and_moon_from_the_ephemeris_and_files_carry_both() {
    let folder = tempfile::tempdir().unwrap();
    let args = [
        "predict",
        "sky",
        "--satellite",
        "starlink-v1.5",
        "--height-km",
        "550",
        "--site",
        "-33.7703,151.1113,70",
        "--time",
        "2025-06-09T08:30:00",
        "--grid",
        "7x13",
        "-o",
        "map",
    ];
    let output = satphot(folder.path(), &args).expect(0, &["sky.ecsv", "sky.svg"]);
    // by astropy: Sun −19.504, 285.134; Moon 39.159, 94.233 deg
    assert!(output.out.contains("altitude -19.50, azimuth 285.13 deg"), "{}", output.out);
    assert!(output.out.contains("Moon altitude  39.1"), "{}", output.out);
    let table = std::fs::read_to_string(folder.path().join("map/sky.ecsv")).unwrap();
    for word in ["# %ECSV 1.0", "satphot.sky/1", "height_km: 550", "sun: {alt_deg: -19.50", "track_az_deg: 90"] {
        assert!(table.contains(word), "{word}\n{}", &table[..4000]);
    }
    let figure = std::fs::read_to_string(folder.path().join("map/sky.svg")).unwrap();
    for word in ["Sun −19.5°", "Moon 39.", "V [mag]", ">N<", "North up, East left", "starlink-v1.5 at 550 km"] {
        assert!(figure.replace('\n', "").contains(word), "{word}");
    }
}

#[test]
fn the_map_does_not_depend_on_the_number_of_threads() {
    let on = |jobs: &str| sky(&["--grid", "7x13", "--csv", "-j", jobs]).expect(0, &[]).out;
    assert_eq!(on("1"), on("3"));
}

#[test]
fn arguments_that_cannot_be_used_are_named_with_a_remedy() {
    let bare = ["predict", "sky", "--satellite", "iss"];
    let empty = tempfile::tempdir().unwrap();
    for (more, words) in [
        (&[][..], &["--time", "--sun-alt-deg"][..]),
        (&["--time", "2025-06-09T08:30:00", "--height-km", "400"], &["pipeline.toml", "--site"]),
        (&["--sun-alt-deg", "3"], &["--sun-az-deg"]),
        (&["--sun-alt-deg", "95", "--sun-az-deg", "0"], &["--sun-alt-deg", "-90 to 90"]),
        (&["--sun-alt-deg", "5", "--sun-az-deg", "0", "--height-km", "0"], &["--height-km", "between 1 and 200000 km"]),
        (&["--sun-alt-deg", "5", "--sun-az-deg", "0", "--height-km", "400", "--grid", "9"], &["--grid", "31x73"]),
        (&["--sun-alt-deg", "5", "--sun-az-deg", "0", "--height-km", "400", "--grid", "1x9"], &["--grid", "2 or more"]),
        (&["--sun-alt-deg", "5", "--sun-az-deg", "0", "--height-km", "9", "--sphere-radius-km", "0"], &["radius"]),
        (&["--sun-alt-deg", "5", "--sun-az-deg", "0", "--time", "2025-06-09T08:30:00"], &["cannot be used with"]),
    ] {
        satphot(empty.path(), &[&bare[..], more].concat()).expect(2, words).without_results();
    }
}
