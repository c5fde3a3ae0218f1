//! `satphot predict table` and `satphot compare` on tables of others: lists with time, satellite and site, lists of geometries,
//! SCORE's and MMT-9's columns, and the wrong tables that look right. The pass is that of the ISS over Macquarie on 2025-06-09.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;
use std::path::Path;

use satphot::base::time::parse_utc;
use satphot::brightness::scene::scene;
use satphot::brightness::{Model, ModelSettings, Satellite};
use satphot::orbit::{EarthOrientation, Site, Tracker, read_elements};
use satphot::tables::read::{Row, Table};
use support::{RunOutput, satphot};

const ELEMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/night/iss-2025-june.tle");
const TABLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/tables");
const SITE: &str = "-33.7703,151.1113,70";
const TIMES: [&str; 5] =
    ["2025-06-09T10:31:00", "2025-06-09T10:32:00", "2025-06-09T10:33:12", "2025-06-09T10:34:00", "2025-06-09T10:35:00"];

/// Runs `predict table` or `compare` on a text in a folder of its own, with elements, site and satellite.
fn run_in(folder: &Path, verb: &[&str], text: &str, more: &[&str]) -> RunOutput {
    std::fs::write(folder.join("obs.csv"), text).unwrap();
    satphot(folder, &[verb, &["obs.csv"], more].concat())
}

const BY_ORBIT: [&str; 6] = ["--elements", ELEMENTS, "--site", SITE, "--satellite", "iss"];

fn predict(text: &str, more: &[&str]) -> RunOutput {
    let folder = tempfile::tempdir().unwrap();
    run_in(folder.path(), &["predict", "table"], text, more)
}

fn predict_orbit(text: &str, more: &[&str]) -> RunOutput {
    predict(text, &[&BY_ORBIT[..], more].concat())
}

type Cells = HashMap<String, String>;

fn rows(text: &str) -> Vec<Cells> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().map(Result::unwrap).collect()
}

fn number(row: &Cells, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} of {row:?}"))
}

/// The rows of any table that satphot reads.
fn rows_of(path: &Path) -> Vec<Cells> {
    let mut table = Table::open_where(path, &|t| t.column("model_v_mag").is_some()).unwrap();
    let names: Vec<String> = table.columns.iter().map(|c| c.name.to_lowercase()).collect();
    let (mut row, mut all) = (Row::default(), Vec::new());
    while table.read(&mut row).unwrap() {
        all.push(names.iter().enumerate().map(|(i, n)| (n.clone(), row.get(i).to_owned())).collect());
    }
    all
}

fn engine() -> (Tracker, Model) {
    let site = Site::new(-33.7703, 151.1113, 70.0).unwrap();
    let tracker = Tracker::new(read_elements(Path::new(ELEMENTS)).unwrap(), None, site, EarthOrientation::default());
    let iss = Satellite::named("iss").unwrap();
    (tracker.unwrap(), Model::new(&iss, &ModelSettings::default()).unwrap())
}

/// The model's magnitude at a moment.
fn expected(time: &str) -> f64 {
    let (tracker, model) = engine();
    let geometry = tracker.at(&parse_utc("t", time).unwrap()).unwrap();
    model.brightness(&scene(&geometry)).unwrap().total_v_mag.unwrap()
}

fn list() -> String {
    let lines: Vec<String> = TIMES.iter().enumerate().map(|(i, t)| format!("{i},\"a, {i}\",{t}Z,25544,=x")).collect();
    format!("id,remark,observation_time_utc,norad_cat_id,colour\n{}\n", lines.join("\n"))
}

#[test]
fn every_row_is_the_engine_at_its_time_and_every_column_stays() {
    let output = predict_orbit(&list(), &[]).expect(0, &[]);
    let rows = rows(&output.out);
    assert!(
        output.out.starts_with("id,remark,observation_time_utc,norad_cat_id,colour,mjd_mid_d,norad_cat_id_satphot,"),
        "{}",
        output.out
    );
    assert_eq!(rows.len(), 5);
    for (i, (row, time)) in rows.iter().zip(TIMES).enumerate() {
        assert_eq!(
            (row["id"].as_str(), row["remark"].as_str(), row["colour"].as_str()),
            (&*i.to_string(), &*format!("a, {i}"), "=x")
        );
        assert_eq!(number(row, "model_v_mag"), expected(time), "{time}");
        assert_eq!((row["status"].as_str(), row["norad_cat_id_satphot"].as_str()), ("ok", "25544"));
    }
    // the same numbers as the pass, to the printed digit
    let start = ["--start", TIMES[0], "--end", TIMES[1], "--step-s", "60", "--csv"];
    let pass = satphot(Path::new("."), &[&["predict", "pass"][..], &BY_ORBIT, &start].concat()).expect(0, &[]);
    for (row, of_pass) in rows.iter().zip(self::rows(&pass.out)) {
        for column in
            ["model_v_mag", "sun_v_mag", "alt_deg", "range_km", "phase_angle_deg", "tle_age_d", "mu_mean_mag_arcsec2"]
        {
            assert_eq!(row[column], of_pass[column], "{column}");
        }
    }
    assert_eq!(predict_orbit(&list(), &["-j", "1"]).out, predict_orbit(&list(), &["-j", "3"]).out);
}

#[test]
fn every_format_gets_the_same_numbers_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let out = ["-o", "a.ecsv", "-o", "b.csv", "-o", "c.fits", "-o", "d.vot"];
    let output = run_in(folder.path(), &["predict", "table"], &list(), &[&BY_ORBIT[..], &out].concat())
        .expect(0, &["wrote a.ecsv", "wrote c.fits"]);
    assert!(
        output.out.contains("time: observation_time_utc") && output.out.contains("5 rows, 0 failed"),
        "{}",
        output.out
    );
    for file in ["a.ecsv", "b.csv", "c.fits", "d.vot"] {
        let rows = rows_of(&folder.path().join(file));
        for (row, time) in rows.iter().zip(TIMES) {
            assert_eq!(number(row, "model_v_mag").to_bits(), expected(time).to_bits(), "{file} {time}");
        }
        assert_eq!((rows.len(), rows[4]["id"].as_str(), rows[4]["remark"].as_str()), (5, "4", "a, 4"), "{file}");
    }
    for bad in ["x.txt", "x", "x.parquet"] {
        if bad == "x.parquet" && cfg!(feature = "parquet") {
            continue;
        }
        run_in(folder.path(), &["predict", "table"], &list(), &[&BY_ORBIT[..], &["-o", bad]].concat())
            .expect(2, &["--out", bad])
            .without_results();
    }
}

#[cfg(feature = "parquet")]
#[test]
fn a_result_in_parquet_is_read_again_with_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let list = list().replace("norad_cat_id", "satno");
    run_in(folder.path(), &["predict", "table"], &list, &[&BY_ORBIT[..], &["-o", "a.parquet"]].concat())
        .expect(0, &["wrote a.parquet"]);
    satphot(folder.path(), &[&["predict", "table", "a.parquet"], &BY_ORBIT[..], &["-o", "b.parquet"]].concat())
        .expect(0, &["wrote b.parquet"]);
    for (row, time) in rows_of(&folder.path().join("b.parquet")).iter().zip(TIMES) {
        assert_eq!(number(row, "model_v_mag").to_bits(), expected(time).to_bits(), "{time}");
        // from `mjd_mid_d` of the first result, which has microseconds
        assert!((number(row, "model_v_mag_satphot") - expected(time)).abs() < 1e-6, "{time}");
        assert_eq!(row["colour"], "=x");
    }
}

#[cfg(not(feature = "parquet"))]
#[test]
fn parquet_is_refused_with_the_way_to_read_it() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.parquet"), b"PAR1\0\0").unwrap();
    satphot(folder.path(), &[&["predict", "table", "a.parquet"], &BY_ORBIT[..]].concat())
        .expect(4, &["a.parquet", "feature `parquet`"])
        .without_results();
}

#[test]
fn times_are_read_as_utc_mjd_jd_with_zone_and_in_other_scales_alike() {
    let want = expected(TIMES[2]);
    let near = |row: &Cells| assert!((number(row, "model_v_mag") - want).abs() < 1e-3, "{row:?}");
    for text in [
        "time\n2025-06-09T20:33:12+10:00\n",
        "mjd\n60835.439722222222\n",
        // whatever the column is called, the value says which it is
        "mjd\n2460835.939722222\n",
        "JD\n2460835.939722222\n",
        "n,Time (UTC)\n1,2025-06-09T10:33:12\n",
        "Date Time Mag\n2025-06-09 10:33:12 5.0\n",
        "Date Time Mag\n2025/06/09 10:33:12 5.0\n",
        // half of the exposure is added to its start
        "date_obs,exptime\n2025-06-09T10:33:07,10\n",
    ] {
        near(&rows(&predict_orbit(text, &[]).expect(0, &[]).out)[0]);
    }
    // astropy's Time in TAI, in FITS and in ECSV
    for file in ["observations_tai.fits", "observations_tai.ecsv"] {
        let path = format!("{TABLES}/{file}");
        let output = satphot(Path::new("."), &[&["predict", "table", &path][..], &BY_ORBIT].concat()).expect(0, &[]);
        let rows = rows(&output.out);
        assert_eq!(rows.len(), 4, "{file}");
        near(&rows[2]);
    }
    for (text, words) in [
        ("time\n1749465192\n", "neither an MJD nor a JD"),
        ("time\n2025-06-09\n", "without a time of day"),
        ("time,n\n09.06.2025 10:33,1\n", "is not a time"),
        ("local_time\n2025-06-09T20:33:12\n", "local time without a zone"),
        ("time\nnoon\n", "is not a time"),
    ] {
        let output = predict_orbit(text, &[]).expect(3, &["1 of 1 rows", words]);
        assert!(rows(&output.out)[0]["reason"].contains(words), "{}", output.out);
    }
    near(&rows(&predict_orbit("local_time\n2025-06-09T20:33:12+10:00\n", &[]).expect(0, &[]).out)[0]);
}

#[test]
fn a_row_that_cannot_be_computed_keeps_its_place_and_the_others_go_on() {
    let text = "n,time,norad_cat_id\n1,2025-06-09T10:33:12Z,25544\n2,2025-06-09T10:33:12Z,99999\n3,,25544\n4,2025-08-09T10:33:12Z,25544\n\
                5,2025-06-09T10:33:12Z,x\n6,2025-06-09T10:33:12Z\n7,2025-06-09T10:34:00Z,25544\n";
    let output = predict_orbit(text, &[]).expect(3, &["5 of 7 rows"]);
    let rows = rows(&output.out);
    let wanted = ["", "no elements of 99999", "time is empty", "more than", "not a catalogue number", "2 cells", ""];
    for (i, (row, word)) in rows.iter().zip(wanted).enumerate() {
        assert_eq!(row["n"], (i + 1).to_string());
        assert_eq!(row["model_v_mag"].is_empty(), !word.is_empty(), "{row:?}");
        assert_eq!(row["status"] == "failed", !word.is_empty(), "{row:?}");
        assert!(row["reason"].contains(word), "{word}: {row:?}");
    }
    // elements beyond their age are used where that is asked for
    let old = "time\n2025-08-09T10:33:12Z\n";
    predict_orbit(old, &[]).expect(3, &["max_age_d"]);
    let forced = predict_orbit(old, &["--force-age"]).expect(0, &[]);
    assert!(self::rows(&forced.out)[0]["reason"].contains("positions may be off"), "{}", forced.out);
}

#[test]
fn elements_may_stand_in_the_rows_and_sites_too() {
    let elements = std::fs::read_to_string(ELEMENTS).unwrap();
    let lines: Vec<&str> = elements.lines().filter(|l| l.starts_with("1 ") || l.starts_with("2 ")).collect();
    let sets: Vec<(&str, &str)> = lines.chunks(2).map(|c| (c[0], c[1])).collect();
    let text = format!(
        "time,line1,line2,lat,lon,observer_altitude_m\n{0},{1},{2},-33.7703,151.1113,70\n{0},{1},broken,-33.7703,151.1113,70\n\
         {0},{1},{2},151.1113,-33.7703,70\n",
        TIMES[2], sets[0].0, sets[0].1
    );
    let output = predict(&text, &["--satellite", "iss"]).expect(3, &["2 of 3 rows"]);
    let rows = rows(&output.out);
    // another set of the same days
    assert!((number(&rows[0], "model_v_mag") - expected(TIMES[2])).abs() < 0.05);
    assert!(rows[1]["reason"].contains("line 2") || rows[1]["reason"].contains("69"), "{:?}", rows[1]);
    assert!(rows[2]["reason"].contains("lat_deg"), "{:?}", rows[2]);
    // a site of the table against one of the command line, which is said
    let there = format!("time,lat,lon\n{},0,0\n", TIMES[2]);
    let output = predict_orbit(&there, &[]).expect(0, &["replaces the sites"]);
    assert_eq!(number(&self::rows(&output.out)[0], "model_v_mag"), expected(TIMES[2]));
    predict(&format!("time,lat\n{},0\n", TIMES[2]), &["--satellite", "iss", "--elements", ELEMENTS])
        .expect(4, &["obs.csv", "none of site_lon_deg", "--column site_lon_deg=NAME"]);
}

const GEOMETRY: &str =
    "sun_alt_deg,sun_az_deg,alt_deg,az_deg,height_km\n-10,90,30,200,550\n-12,95,45,300,550\n-20,100,80,10,550\n";

#[test]
fn a_geometry_is_that_of_the_map_of_the_sky_and_units_of_the_header_are_converted() {
    let starlink = ["--satellite", "starlink-v1.5"];
    let output = predict(GEOMETRY, &starlink).expect(0, &[]);
    let rows = rows(&output.out);
    // the same directions of the map: 4 x 37 altitudes and azimuths in steps of 30 and 10 deg
    let map = [
        "predict",
        "sky",
        "--height-km",
        "550",
        "--sun-alt-deg",
        "-10",
        "--sun-az-deg",
        "90",
        "--grid",
        "4x37",
        "--csv",
    ];
    let map = satphot(Path::new("."), &[&map[..], &starlink].concat()).expect(0, &[]);
    let point = self::rows(&map.out)
        .into_iter()
        .find(|r| number(r, "alt_deg") == 30.0 && number(r, "az_deg") == 200.0)
        .unwrap();
    let magnitude = point.iter().find(|(k, _)| *k == "model_v_mag" || *k == "v_mag").unwrap().1;
    assert!(
        (magnitude.parse::<f64>().unwrap() - number(&rows[0], "model_v_mag")).abs() < 1e-4,
        "{point:?} {:?}",
        rows[0]
    );
    let want: Vec<f64> = rows.iter().map(|r| number(r, "model_v_mag")).collect();

    // radians and metres of FITS and VOTable
    for file in ["geometry_rad.fits", "geometry_rad.vot"] {
        let path = format!("{TABLES}/{file}");
        let output =
            satphot(Path::new("."), &["predict", "table", &path, "--satellite", "starlink-v1.5"]).expect(0, &[]);
        for (row, want) in self::rows(&output.out).iter().zip(&want) {
            assert!((number(row, "model_v_mag") - want).abs() < 1e-9, "{file}");
        }
    }
    // units behind the names, heights for all rows, ranges for heights
    let text = "sun alt [rad],sun_az [rad],alt (deg),az (deg),Height [m]\n-0.17453292519943295,1.5707963267948966,30,200,550000\n";
    let output = predict(text, &starlink).expect(0, &[]);
    assert!((number(&self::rows(&output.out)[0], "model_v_mag") - want[0]).abs() < 1e-9);
    let flat = GEOMETRY.replace(",height_km", "").replace(",550", "");
    let output = predict(&flat, &["--satellite", "starlink-v1.5", "--column", "height_km=550"]).expect(0, &[]);
    assert_eq!(number(&self::rows(&output.out)[1], "model_v_mag"), want[1]);
    let ranges = format!("sun_alt_deg,sun_az_deg,alt_deg,az_deg,range_km\n-10,90,30,200,{}\n", rows[0]["range_km"]);
    let output = predict(&ranges, &starlink).expect(0, &[]);
    assert!((number(&self::rows(&output.out)[0], "model_v_mag") - want[0]).abs() < 1e-6);
}

#[test]
fn geometries_that_look_right_and_are_not_are_noticed() {
    let starlink = ["--satellite", "starlink-v1.5"];
    // radians without a unit
    let radians = "sun_alt,sun_az,altitude,azimuth,height_km\n-0.17,1.57,0.52,3.49,550\n-0.2,1.6,0.78,5.2,550\n-0.3,1.7,1.4,0.2,550\n";
    predict(radians, &starlink)
        .expect(4, &["obs.csv", "`altitude` and `azimuth`", "radians", "alt [rad]"])
        .without_results();
    // stated as degrees: computed, and said
    let stated = radians
        .replace("sun_alt,", "sun_alt_deg,")
        .replace("sun_az,", "sun_az_deg,")
        .replace("altitude,azimuth", "alt_deg,az_deg");
    predict(&stated, &starlink).expect(0, &["note:", "angle in radians", "degrees they state"]);
    // a height in metres, an orbit in the air, the satellite below the horizon, words
    for (cells, word) in [
        ("-10,90,30,200,550000", "is it in m?"),
        ("-10,90,30,200,0.55", "accepted is"),
        ("-10,90,-30,200,550", "below the horizon"),
        ("-10,90,95,200,550", "-90 to 90"),
        ("-10,90,high,200,550", "\"high\" is not a number"),
        ("-10,,30,200,550", "sun_az_deg is empty"),
    ] {
        let text = format!("{}{cells}\n", GEOMETRY);
        let output = predict(&text, &starlink).expect(3, &["1 of 4 rows", word]);
        assert!(rows(&output.out)[3]["reason"].contains(word), "{word}: {}", output.out);
    }
    for (text, words) in [
        // a column of a length where an angle is needed, and two that can be meant
        (
            GEOMETRY.replace("alt_deg,az_deg", "altitude [km],az_deg"),
            vec!["`altitude [km]` is in `km`", "alt_deg is needed"],
        ),
        (
            GEOMETRY.replace(",alt_deg,az_deg,height_km", ",alt,altitude,height_km"),
            vec!["`altitude` and `alt` can both be alt_deg", "--column alt_deg=NAME"],
        ),
        (GEOMETRY.replace("height_km", "remark"), vec!["height_km or range_km", "present: sun_alt_deg"]),
        (GEOMETRY.lines().next().unwrap().to_owned() + "\n", vec!["no rows"]),
        (String::new(), vec!["is empty"]),
    ] {
        let output = predict(&text, &starlink).expect(4, &["obs.csv"]).without_results();
        assert!(words.iter().all(|w| output.err.contains(w)), "{words:?}: {}", output.err);
    }
    predict(GEOMETRY, &["--satellite", "starlink-v1.5", "--column", "nope=1"]).expect(2, &["nope", "height_km"]);
    predict(GEOMETRY, &["--satellite", "starlink-v1.5", "--column", "height_km=nope"]).expect(2, &["nope", "present"]);
}

#[test]
fn another_satellite_local_times_and_other_units_are_noticed_where_the_table_shows_it() {
    // the zone of the site, +10 h
    let local: Vec<String> = TIMES.iter().map(|t| t.replace("T10:", "T20:")).collect();
    let output = predict_orbit(&format!("time\n{}\n", local.join("\n")), &[])
        .expect(0, &["5 of 5 rows have the satellite below the horizon", "local times of UTC+10:00"]);
    assert!(rows(&output.out)[0]["reason"].contains("below the horizon"), "{}", output.out);
    let (tracker, _) = engine();
    let stated = |scale: f64, alt_off: f64| {
        let row = |t: &&str| {
            let g = tracker.at(&parse_utc("t", t).unwrap()).unwrap();
            format!("{t},{},{},{}", g.alt_rad.to_degrees() + alt_off, g.az_rad.to_degrees(), g.range_km * scale)
        };
        format!("time,sat_alt_deg,sat_az_deg,range\n{}\n", TIMES.iter().map(row).collect::<Vec<_>>().join("\n"))
    };
    let right = predict_orbit(&stated(1.0, 1.0), &[]).expect(0, &[]);
    assert!(
        !right.err.contains("contradict") && rows(&right.out).iter().all(|r| r["reason"].is_empty()),
        "{}",
        right.err
    );
    predict_orbit(&stated(1000.0, 0.0), &[]).expect(0, &["5 of 5 rows state a range", "another unit"]);
    let output =
        predict_orbit(&stated(1.0, 20.0), &[]).expect(0, &["5 of 5 rows state a direction", "another satellite"]);
    assert!(rows(&output.out)[0]["reason"].contains("20.0 deg from"), "{}", output.out);
    let named = format!("time,norad_cat_id,satellite_name\n{},25544,CSS (TIANHE)\n", TIMES[0]);
    let output = predict_orbit(&named, &[]).expect(0, &[]);
    assert!(rows(&output.out)[0]["reason"].contains("CSS (TIANHE) in the table and ISS (ZARYA)"), "{}", output.out);
}

#[test]
fn damaged_files_and_results_of_an_earlier_run_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = std::fs::read(format!("{TABLES}/geometry_rad.fits")).unwrap();
    std::fs::write(folder.path().join("cut.fits"), &bytes[..bytes.len() - 2880]).unwrap();
    satphot(folder.path(), &["predict", "table", "cut.fits", "--satellite", "iss"])
        .expect(4, &["cut.fits", "truncated"]);
    satphot(folder.path(), &["predict", "table", "nope.csv", "--satellite", "iss"]).expect(4, &["nope.csv"]);
    satphot(folder.path(), &["predict", "table", "cut.fits"]).expect(2, &["--satellite"]);
    // once more is `_satphot`, a third time is refused
    let first = predict(GEOMETRY, &["--satellite", "iss"]).expect(0, &[]).out;
    let second = predict(&first, &["--satellite", "iss"]).expect(0, &[]).out;
    let rows = rows(&second);
    assert_eq!(rows[0]["model_v_mag"], rows[0]["model_v_mag_satphot"]);
    predict(&second, &["--satellite", "iss"]).expect(4, &["`range_km`", "earlier result"]).without_results();
}

// ---------------------------------------------------------------- compare

fn compare(text: &str, more: &[&str]) -> (RunOutput, Vec<Cells>) {
    let folder = tempfile::tempdir().unwrap();
    let output = run_in(
        folder.path(),
        &["compare"],
        text,
        &[&BY_ORBIT[..4], &["--satellite", "iss", "-o", "r.csv"], more].concat(),
    );
    let made = folder.path().join("r.csv");
    let rows = if made.exists() { rows_of(&made) } else { Vec::new() };
    (output, rows)
}

#[test]
fn a_score_file_gives_residuals_and_their_statistics() {
    let offsets = [0.1, 0.2, 0.3, 0.4, 0.5];
    let mut text = String::from(
        "satellite_name,norad_cat_id,observation_time_utc,apparent_magnitude,apparent_magnitude_uncertainty,observer_latitude_deg,\
         observer_longitude_deg,observer_altitude_m,limiting_magnitude,observing_filter\n",
    );
    for (time, off) in TIMES.iter().zip(offsets) {
        text += &format!("ISS (ZARYA),25544,{time}Z,{},0.05,-33.7703,151.1113,70,14,V\n", expected(time) + off);
    }
    text += "ISS (ZARYA),25544,2025-06-09T10:33:30Z,,,-33.7703,151.1113,70,14,V\n";
    text += "ISS (ZARYA),25544,2025-06-09T10:33:40Z,99.0,,-33.7703,151.1113,70,14,V\n";
    text += "ISS (ZARYA),25544,2025-06-09T10:33:50Z,9.0,0.1,-33.7703,151.1113,70,14,Rc\n";
    let folder = tempfile::tempdir().unwrap();
    // no site: it is that of the rows
    let args = ["--elements", ELEMENTS, "--satellite", "iss", "-o", "r.fits"];
    let output = run_in(folder.path(), &["compare"], &text, &args).expect(0, &["wrote r.fits"]);
    for words in [
        "5 of 8 rows, V observed minus modelled",
        "2 without a magnitude, 1 rejected",
        "median +0.300, mean +0.300",
        "v_mag: apparent_magnitude",
    ] {
        assert!(output.out.contains(words), "{words}: {}", output.out);
    }
    let rows = rows_of(&folder.path().join("r.fits"));
    for (row, off) in rows.iter().zip(offsets) {
        assert!((number(row, "residual_mag") - off).abs() < 1e-12, "{row:?}");
        assert_eq!((row["verdict"].as_str(), row["v_mag_err"].as_str()), ("use", "0.05"));
    }
    let of = |i: usize| (rows[i]["status"].as_str(), rows[i]["verdict"].as_str(), rows[i]["residual_mag"].as_str());
    assert_eq!(
        (of(5), of(6), of(7)),
        (("nondetection", "reject", ""), ("nondetection", "reject", ""), ("rejected", "reject", ""))
    );
    assert!(
        rows[6]["reason"].contains("stands for a missing") && rows[7]["reason"].contains("filter Rc"),
        "{:?}",
        &rows[6..]
    );
    // no column beyond the needed ones
    let short: String =
        text.lines().take(8).map(|l| l.split(',').skip(1).take(3).collect::<Vec<_>>().join(",") + "\n").collect();
    let (output, rows) = compare(&short, &[]);
    assert!(output.out.contains("median +0.300") && output.err.contains("no column of filters"), "{output:?}");
    assert_eq!(rows.len(), 7);
}

#[test]
fn columns_of_mmt9_are_known_and_its_reduced_magnitude_is_not_taken_for_an_apparent_one() {
    let (tracker, _) = engine();
    let lines: Vec<String> = TIMES
        .iter()
        .map(|t| {
            let g = tracker.at(&parse_utc("t", t).unwrap()).unwrap();
            let mag = expected(t) + 0.25;
            let (d, clock) = t.split_once('T').unwrap();
            format!(
                "{d} {clock}.000 {:.3} {mag:.6} Clear 0 {:.1} {:.1} 2 17",
                mag - 1.0,
                g.range_km,
                g.phase_angle_rad.to_degrees()
            )
        })
        .collect();
    let text = format!(
        "# Satellite 25544\n# Date Time StdMag Mag Filter Penumbra Distance Phase Channel Track\n{}\n",
        lines.join("\n")
    );
    let (output, rows) = compare(&text, &[]);
    assert!(
        output.code == 0 && output.out.contains("median +0.250") && output.err.contains("without a filter"),
        "{output:#?}"
    );
    assert!(rows.iter().all(|r| r["verdict"] == "use" && r["reason"].is_empty()), "{rows:?}");
    let reduced = text.replace(" Mag ", " Flux ");
    let (output, _) = compare(&reduced, &[]);
    output.expect(4, &["`StdMag`", "not apparent but reduced", "--reduced-to-km 1000"]);
}

#[test]
fn magnitudes_reduced_to_a_range_are_noticed_and_made_apparent_on_demand() {
    let (tracker, model) = engine();
    let start = parse_utc("t", "2025-06-09T10:29:30").unwrap();
    let mut text = String::from("time,norad_cat_id,mag\n");
    for i in 0..30 {
        let at = satphot::base::time::shifted(start, 14.0 * f64::from(i));
        let g = tracker.at(&at).unwrap();
        let v = model.brightness(&scene(&g)).unwrap().total_v_mag.unwrap();
        text += &format!(
            "{},25544,{}\n",
            satphot::base::time::iso_utc(at, 9),
            v - 5.0 * (g.range_km / 1e3).log10() + 0.01 * f64::from(i % 3)
        );
    }
    let (output, _) = compare(&text, &[]);
    output.expect(0, &["are they apparent?", "--reduced-to-km 1000"]);
    let (output, rows) = compare(&text, &["--reduced-to-km", "1000"]);
    assert!(output.code == 0 && !output.err.contains("are they apparent"), "{output:#?}");
    assert!(rows.iter().all(|r| number(r, "residual_mag").abs() < 0.021), "{}", output.out);
    compare(&text, &["--reduced-to-km", "0"]).0.expect(2, &["--reduced-to-km"]);
}

#[test]
fn rows_of_another_place_or_time_are_rejected_and_the_table_is_never_written_over() {
    let mut text = String::from("time,norad_cat_id,mag,sat_alt_deg,sat_az_deg\n");
    let (tracker, _) = engine();
    for (i, time) in TIMES.iter().enumerate() {
        let g = tracker.at(&parse_utc("t", time).unwrap()).unwrap();
        let alt = g.alt_rad.to_degrees() + if i == 2 { 30.0 } else { 0.0 };
        text += &format!("{time},25544,{},{alt},{}\n", expected(time), g.az_rad.to_degrees());
    }
    text += "2025-06-09T22:33:12,25544,5.0,,\n";
    let (output, rows) = compare(&text, &[]);
    assert!(output.out.contains("4 of 6 rows") && output.out.contains("2 rejected"), "{output:#?}");
    assert_eq!((rows[2]["verdict"].as_str(), rows[5]["verdict"].as_str()), ("reject", "reject"));
    assert!(rows[2]["reason"].contains("30.0 deg from") && rows[5]["reason"].contains("below the horizon"));
    let folder = tempfile::tempdir().unwrap();
    let over = [&BY_ORBIT[..], &["-o", "obs.csv"]].concat();
    run_in(folder.path(), &["compare"], &text, &over).expect(2, &["the table itself"]);
    let words = text.replace(",25544,", ",25544,x");
    let (output, _) = compare(&words, &[]);
    output.expect(3, &["6 of 6 rows", "is not a number"]);
    let (output, _) = compare("time,norad_cat_id\n2025-06-09T10:33:12,25544\n", &[]);
    output.expect(4, &["no column of apparent magnitudes", "--column v_mag=NAME"]);
}

#[test]
fn geometries_are_compared_without_elements_and_without_a_configuration() {
    let folder = tempfile::tempdir().unwrap();
    let starlink = ["--satellite", "starlink-v1.5"];
    let model = rows(&predict(GEOMETRY, &starlink).expect(0, &[]).out);
    let head = GEOMETRY.lines().next().unwrap();
    let mut text = format!("{head},ab_mag\n");
    for (line, row) in GEOMETRY.lines().skip(1).zip(&model) {
        text += &format!("{line},{}\n", number(row, "model_v_mag") - 0.5);
    }
    let output = run_in(folder.path(), &["compare"], &text, &[&starlink[..], &["-o", "r.vot"]].concat())
        .expect(0, &["wrote r.vot"]);
    assert!(output.out.contains("3 of 3 rows") && output.out.contains("median -0.500"), "{}", output.out);
    assert!(rows_of(&folder.path().join("r.vot")).iter().all(|r| (number(r, "residual_mag") + 0.5).abs() < 1e-12));
    run_in(folder.path(), &["compare"], "time,mag\n2025-06-09T10:33:12,5\n", &starlink)
        .expect(4, &["--elements", "--site"]);
}
