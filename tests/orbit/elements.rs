//! Reading elements: every format users have, and every way a file is damaged.

#![allow(clippy::unwrap_used, missing_docs)] // helpers of tests

use std::io::Write;
use std::path::{Path, PathBuf};

use hifitime::Epoch;
use satphot::orbit::{
    EarthOrientation, Elements, Propagator, Site, Tracker, check_age, element_names, nearest, read_elements,
};

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/orbits");
const L1: &str = "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996";
const L2: &str = "2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748";
const C1: &str = "1 48274U 21035A   25156.21104554  .00019537  00000+0  25342-3 0  9990";
const C2: &str = "2 48274  41.4641  93.3127 0005512   5.5400 354.5498 15.58366731234281";

fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(SHARED).join(name);
    if !path.exists() {
        println!("skipped: ../shared/data/orbits/{name} not present");
        return None;
    }
    Some(path)
}

fn read_text(text: &str) -> Result<Vec<Elements>, String> {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(text.as_bytes()).unwrap();
    read_elements(file.path()).map_err(|e| e.to_string())
}

fn message(text: &str) -> String {
    read_text(text).unwrap_err()
}

#[test]
fn names_numbers_and_epoch_are_read_whatever_the_dress_of_the_file() {
    let dressed = [
        format!("{L1}\n{L2}\n"),
        format!("ISS (ZARYA)\n{L1}\n{L2}\n"),
        format!("0 ISS (ZARYA)\r\n{L1}\r\n{L2}\r\n"),
        format!("\u{feff}# from somewhere\n\nISS (ZARYA)   \n# between\n{L1}   \n\n{L2}\t\n\n"),
    ];
    for (i, text) in dressed.iter().enumerate() {
        let sets = read_text(text).unwrap();
        assert_eq!(sets.len(), 1);
        let e = &sets[0];
        assert_eq!((e.norad_cat_id(), e.object_id()), (25544, "1998-067A"));
        assert_eq!((e.name(), e.format()), if i == 0 { ("", "TLE") } else { ("ISS (ZARYA)", "3LE") });
        // Day 159.07052714 of 2025 is 8 June, 0.07052714 d after midnight.
        let expected = Epoch::from_gregorian_utc(2025, 6, 8, 1, 41, 33, 544_896_000);
        assert!((e.epoch() - expected).abs().to_seconds() < 1e-6, "{}", e.epoch());
        assert!((e.period_min() - 92.9).abs() < 0.01);
    }
}

#[test]
fn mixed_two_and_three_line_sets_keep_their_own_names() {
    let sets = read_text(&format!("{L1}\n{L2}\nCSS (TIANHE)\n{C1}\n{C2}\n{L1}\n{L2}\n")).unwrap();
    let names: Vec<_> = sets.iter().map(Elements::name).collect();
    assert_eq!(names, ["", "CSS (TIANHE)", ""]);
    assert_eq!(
        element_names(&sets),
        ["25544", "1998-067A", "CSS (TIANHE)", "CSS", "48274", "2021-035A"].map(str::to_owned)
    );
}

#[test]
fn alpha_5_numbers_are_read() {
    let fix = |line: &str| {
        let body = &line[..68];
        let sum: u32 = body.chars().map(|c| if c == '-' { 1 } else { c.to_digit(10).unwrap_or(0) }).sum();
        format!("{body}{}", sum % 10)
    };
    let sets = read_text(&format!("{}\n{}\n", fix(&L1.replace("25544", "T0001")), fix(&L2.replace("25544", "T0001"))))
        .unwrap();
    assert_eq!(sets[0].norad_cat_id(), 270_001);
}

#[test]
fn a_damaged_set_among_good_ones_is_named_with_its_line_and_what_was_expected() {
    let good = format!("CSS (TIANHE)\n{C1}\n{C2}\n");
    let bad_sum = format!("{}7", &L1[..68]);
    let m = message(&format!("{good}ISS (ZARYA)\n{bad_sum}\n{L2}\n"));
    assert!(m.contains(":5:") && m.contains("ISS (ZARYA) [25544]") && m.contains("checksum is '7', expected 6"), "{m}");
    let m = message(&format!("{good}{L1}\n{}\n", &L2[..60]));
    assert!(m.contains(":5:") && m.contains("60 characters, expected 69"), "{m}");
    let m = message(&format!("{good}{L1}\n{good}"));
    assert!(m.contains(":4:") && m.contains("without a line 2"), "{m}");
    let m = message(&format!("{good}{L2}\n"));
    assert!(m.contains(":4:") && m.contains("without a line 1"), "{m}");
    let m = message(&format!("{good}{L1}\n{C2}\n"));
    assert!(m.contains("mismatch"), "{m}");
    let m = message(&format!("{good}{L1}\n"));
    assert!(m.contains(":4:") && m.contains("without a line 2"), "{m}");
    let m = message("No GP data found\n");
    assert!(m.contains("No GP data found") && m.contains("FORMAT=json"), "{m}");
    let m = message(&format!("{L1}\n{L2}\n1 25544U 98067A\n"));
    assert!(m.contains(":3:"), "{m}");
    let m = message(&format!("{}\n{L2}\n", L1.replace("98067A ", "98067é ")));
    assert!(m.contains("ASCII"), "{m}");
    for nothing in ["", "\n\n", "# only comments\n", "[]"] {
        assert!(message(nothing).contains("no element sets"), "{nothing:?}");
    }
    let last_not_digit = format!("{}x", &L1[..68]);
    assert!(message(&format!("{last_not_digit}\n{L2}\n")).contains("expected 6"));
}

#[test]
fn omm_json_of_every_maker_is_read_and_gives_the_orbit_of_the_tle_to_a_metre() {
    let (Some(json), Some(tle)) = (shared("iss_omm.json"), shared("iss_omm_same_elements.tle")) else { return };
    let (omm, tle) = (read_elements(&json).unwrap(), read_elements(&tle).unwrap());
    assert_eq!((omm[0].format(), omm[0].name(), omm[0].object_id()), ("OMM JSON", "ISS (ZARYA)", "1998-067A"));
    let apart_km = |omm: &Elements, hours: f64| {
        let epoch = omm.epoch() + hifitime::Duration::from_hours(hours);
        let place = |e: &Elements| Propagator::new(e).unwrap().state(&epoch).unwrap().0;
        (place(omm) - place(&tle[0])).norm()
    };
    for hours in [-12.0, -6.0, -1.0, 0.0, 0.7, 6.0, 12.0] {
        assert!(apart_km(&omm[0], hours) < 1e-3, "{hours} h: {} km", apart_km(&omm[0], hours));
    }
    // The TLE has room for fewer digits of the eccentricity (7e-8 is 0.9 m) and of B*: with its digits, nothing is left.
    let rounded = std::fs::read_to_string(&json)
        .unwrap()
        .replace("0.00066697", "0.0006669")
        .replace("0.00010370434", "0.00010370");
    let rounded = read_text(&rounded).unwrap();
    for hours in [-48.0, 0.0, 72.0] {
        assert!(apart_km(&rounded[0], hours) < 1e-6, "{hours} h: {} km", apart_km(&rounded[0], hours));
    }
}

#[test]
fn omm_texts_numbers_missing_bookkeeping_and_odd_epochs_are_the_same_orbit() {
    let base = r#"{"OBJECT_NAME":"ISS (ZARYA)","OBJECT_ID":"1998-067A","EPOCH":"2025-06-08T01:41:33.544896","MEAN_MOTION":15.50064259,
        "ECCENTRICITY":0.0001632,"INCLINATION":51.64,"RA_OF_ASC_NODE":352.2516,"ARG_OF_PERICENTER":195.4618,"MEAN_ANOMALY":310.3088,
        "EPHEMERIS_TYPE":0,"CLASSIFICATION_TYPE":"U","NORAD_CAT_ID":25544,"ELEMENT_SET_NO":999,"REV_AT_EPOCH":51374,"BSTAR":0.00015816,
        "MEAN_MOTION_DOT":8.601e-5,"MEAN_MOTION_DDOT":0}"#;
    let place = |text: &str| {
        let sets = read_text(text).unwrap();
        let (r, _) =
            Propagator::new(&sets[0]).unwrap().state(&Epoch::from_gregorian_utc_hms(2025, 6, 9, 10, 33, 12)).unwrap();
        r
    };
    let expected = place(&format!("{L1}\n{L2}\n"));
    let variants = [
        base.to_owned(),
        format!("[{base}]"),
        base.replace("544896\"", "544896Z\""),
        base.replace("2025-06-08T", "2025-159T"),
        base.replace("15.50064259", "\"15.50064259\"").replace("25544", "\"25544\"").replace("51374", "\" 51374 \""),
        base.replace("\"ELEMENT_SET_NO\":999,", "").replace("\"CLASSIFICATION_TYPE\":\"U\",", ""),
        base.replace(
            "\"REV_AT_EPOCH\":51374",
            "\"REV_AT_EPOCH\":51374.0,\"REF_FRAME\":\"TEME\",\"CCSDS_OMM_VERS\":\"3.0\"",
        ),
    ];
    for text in &variants {
        // 1e-6 d of rounding in no field: the same numbers, so millimetres.
        assert!((place(text) - expected).norm() < 1e-5, "{text}");
    }
    let no_id = read_text(&base.replace("\"1998-067A\"", "\"\"")).unwrap();
    assert_eq!(no_id[0].object_id(), "");
    let second_bad = |from: &str, to: &str| message(&format!("[{base},{}]", base.replace(from, to)));
    for (from, to, says) in [
        ("\"BSTAR\":0.00015816,", "", "BSTAR is missing"),
        ("15.50064259", "\"fast\"", "MEAN_MOTION"),
        ("0.0001632", "1.5", "eccentricity 1.5"),
        ("51.64", "\"NaN\"", "inclination"),
        ("2025-06-08T01", "2025-13-08T01", ""),
        ("2025-06-08T", "yesterday", "EPOCH"),
        ("\"EPHEMERIS_TYPE\":0", "\"REF_FRAME\":\"GCRF\"", "REF_FRAME is GCRF"),
    ] {
        let m = second_bad(from, to);
        assert!(m.contains("element set 2") && m.contains("ISS (ZARYA)") && m.contains(says), "{m}");
    }
    assert!(message("{\"OBJECT_NAME\": ").contains(":1:"));
    assert!(message("<?xml version=\"1.0\"?>").contains("XML"));
}

#[test]
fn omm_kvn_and_csv_give_what_json_gives() {
    if let Some(path) = shared("omm_example.kvn") {
        let sets = read_elements(&path).unwrap();
        assert_eq!((sets[0].name(), sets[0].norad_cat_id(), sets[0].format()), ("GOES 9", 23581, "OMM KVN"));
        // Day 64 of 2007 is 5 March.
        let expected = Epoch::from_gregorian_utc(2007, 3, 5, 10, 34, 41, 426_400_000);
        assert!((sets[0].epoch() - expected).abs().to_seconds() < 1e-6);
    }
    let csv = "OBJECT_NAME,OBJECT_ID,EPOCH,MEAN_MOTION,ECCENTRICITY,INCLINATION,RA_OF_ASC_NODE,ARG_OF_PERICENTER,MEAN_ANOMALY,EPHEMERIS_TYPE,CLASSIFICATION_TYPE,NORAD_CAT_ID,ELEMENT_SET_NO,REV_AT_EPOCH,BSTAR,MEAN_MOTION_DOT,MEAN_MOTION_DDOT\r\nISS (ZARYA),1998-067A,2025-06-08T01:41:33.544896,15.50064259,.0001632,51.64,352.2516,195.4618,310.3088,0,U,25544,999,51374,.15816E-3,.8601E-4,0\r\n";
    let (a, b) = (read_text(csv).unwrap(), read_text(&format!("{L1}\n{L2}\n")).unwrap());
    let state = |e: &Elements| Propagator::new(e).unwrap().state_after(1_440.0).unwrap().0;
    assert_eq!(a[0].format(), "OMM CSV");
    assert!((state(&a[0]) - state(&b[0])).norm() < 1e-5);
    assert!(message(&csv.replace("15.50064259", "")).contains("MEAN_MOTION is missing"));
}

#[test]
fn the_nearest_set_is_used_and_ambiguity_is_an_error_that_lists_the_objects() {
    let Some(path) = shared("iss_2025_june.tle") else { return };
    let mut sets = read_elements(&path).unwrap();
    assert_eq!(sets.len(), 3);
    let at = |d, h| Epoch::from_gregorian_utc_hms(2025, 6, d, h, 0, 0);
    for (epoch, day) in
        [(at(1, 0), 156), (at(6, 12), 156), (at(9, 10), 159), (at(11, 0), 159), (at(12, 18), 165), (at(30, 0), 165)]
    {
        let e = nearest(&sets, None, &epoch).unwrap();
        assert_eq!(e.epoch().day_of_year().floor() as i32, day, "{epoch}");
    }
    sets.extend(read_text(&format!("CSS (TIANHE)\n{C1}\n{C2}\n")).unwrap());
    let m = nearest(&sets, None, &at(9, 0)).unwrap_err().to_string();
    assert!(m.contains("2 objects") && m.contains("25544") && m.contains("CSS (TIANHE) [48274]"), "{m}");
    let m = nearest(&sets, Some(5), &at(9, 0)).unwrap_err().to_string();
    assert!(m.contains("number 5 is not") && m.contains("48274"), "{m}");
    assert_eq!(nearest(&sets, Some(48274), &at(9, 0)).unwrap().name(), "CSS (TIANHE)");
    assert!(nearest(&[], None, &at(9, 0)).is_err());
}

#[test]
fn old_elements_warn_past_two_days_and_are_refused_past_the_limit_unless_forced() {
    let e = Elements::from_tle("ISS (ZARYA)", L1, L2).unwrap();
    let later = |d: f64| e.epoch() + hifitime::Duration::from_days(d);
    for sign in [1.0, -1.0] {
        assert!(check_age(&e, &later(1.99 * sign), 14.0, false).unwrap().is_none());
        let warning = check_age(&e, &later(2.01 * sign), 14.0, false).unwrap().unwrap();
        assert!(warning.contains("2.0 d"), "{warning}");
        assert!(check_age(&e, &later(13.99 * sign), 14.0, false).unwrap().is_some());
        let refusal = check_age(&e, &later(14.01 * sign), 14.0, false).unwrap_err().to_string();
        assert!(refusal.contains("orbit.force_age") && refusal.contains("14.0 d"), "{refusal}");
        assert!(check_age(&e, &later(14.01 * sign), 14.0, true).unwrap().is_some());
    }
}

#[test]
fn the_invented_sets_are_refused_and_the_one_with_a_right_checksum_is_contradicted_by_its_neighbour() {
    let (Some(fabricated), Some(real)) = (shared("fabricated.tle"), shared("iss_2025_june.tle")) else { return };
    let m = read_elements(&fabricated).unwrap_err().to_string();
    assert!(m.contains("fabricated.tle:") && m.contains("checksum") && m.contains("expected"), "{m}");
    let text = std::fs::read_to_string(&fabricated).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert!(message(&lines[3..6].join("\n")).contains("checksum"));
    let mut sets = read_elements(&real).unwrap();
    let epoch = Epoch::from_gregorian_utc_hms(2025, 6, 17, 12, 0, 0);
    let site = || Site::new(-33.7703, 151.1113, 70.0).unwrap();
    let good = Tracker::new(sets.clone(), None, site(), EarthOrientation::default()).unwrap();
    assert!(good.age_warning(&Epoch::from_gregorian_utc_hms(2025, 6, 9, 0, 0, 0)).is_none());
    sets.extend(read_text(&lines[6..9].join("\n")).unwrap());
    let tracker = Tracker::new(sets, None, site(), EarthOrientation::default()).unwrap();
    let warning = tracker.age_warning(&epoch).unwrap();
    assert!(warning.contains("km apart"), "{warning}");
}

proptest::proptest! {
    /// Any one byte of a good file changed, or the file cut: elements or an error, never a panic, never fewer sets.
    #[test]
    fn a_byte_changed_or_a_file_cut_never_panics_and_never_loses_a_set(at in 0_usize..316, byte in 0_u8..128, cut in proptest::bool::ANY) {
        let mut text = format!("ISS (ZARYA)\n{L1}\n{L2}\nCSS (TIANHE)\n{C1}\n{C2}\n").into_bytes();
        let at = at.min(text.len() - 1);
        if cut { text.truncate(at) } else { text[at] = byte }
        let text = String::from_utf8(text).unwrap();
        if let Ok(sets) = read_text(&text) {
            // Cut exactly between the sets there is one; a change may only ever leave two.
            proptest::prop_assert!(sets.len() == 2 || cut);
        }
    }
}

#[test]
fn a_damaged_set_of_another_object_is_a_warning_and_one_of_the_object_an_error() {
    use satphot::orbit::read_elements_for;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mixed.tle");
    let read = |text: &str, norad| {
        std::fs::write(&path, text).unwrap();
        read_elements_for(&path, norad)
    };
    let iss = format!("ISS (ZARYA)\n{L1}\n{L2}\n");
    let bad_sum = format!("{}5", &C1[..68]);
    assert_ne!(bad_sum, C1, "the test could not fail");
    // checksum, a cut line, a line that is missing, a name without lines
    for damaged in [
        format!("CSS (TIANHE)\n{bad_sum}\n{C2}\n"),
        format!("CSS (TIANHE)\n{C1}\n{}\n", &C2[..50]),
        format!("CSS (TIANHE)\n{C1}\n"),
        format!("CSS (TIANHE)\n{C2}\n"),
        format!("CSS (TIANHE)\n1 48274U\n{C2}\n"),
        "CSS (TIANHE)\n".to_owned(),
    ] {
        for text in [format!("{damaged}{iss}"), format!("{iss}{damaged}")] {
            let (sets, warnings) = read(&text, Some(25544)).unwrap_or_else(|e| panic!("{e}\n{text}"));
            assert_eq!(sets.len(), 1, "{text}");
            assert!(warnings.iter().all(|w| w.contains("mixed.tle:") && w.contains("another object")), "{warnings:?}");
            assert!(!warnings.is_empty());
            // the object itself is damaged
            assert_eq!(read(&text, Some(48274)).map(|_| ()).is_err(), damaged.len() > 20, "{text}");
        }
    }
    // without a number nobody says which object is meant
    let text = format!("{iss}CSS (TIANHE)\n{bad_sum}\n{C2}\n");
    let error = read(&text, None).unwrap_err();
    assert!(error.exit_code() == 5 && error.to_string().contains("orbit.norad_cat_id"), "{error}");
    // a damaged set of the object among its own good ones, and one whose number alone was altered
    let error = read(&format!("{iss}ISS (ZARYA)\n{L1}\n{}\n", &L2[..60]), Some(25544)).unwrap_err();
    assert!(error.exit_code() == 4 && error.to_string().contains("mixed.tle:6"), "{error}");
    let altered = L1.replace("25544", "25545");
    let error = read(&format!("{iss}ISS (ZARYA)\n{altered}\n{L2}\n"), Some(25544)).unwrap_err();
    assert_eq!(error.exit_code(), 4, "{error}");
}

#[test]
fn a_damaged_message_of_another_object_is_a_warning_in_json_and_csv() {
    use satphot::orbit::read_elements_for;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mixed");
    let set = |name: &str, number: &str, e: &str| {
        format!(
            "{{\"OBJECT_NAME\": \"{name}\", \"NORAD_CAT_ID\": {number}, \"EPOCH\": \"2025-06-08T01:41:33.5\", \"MEAN_MOTION\": 15.5, \
             \"ECCENTRICITY\": {e}, \"INCLINATION\": 51.6, \"RA_OF_ASC_NODE\": 10, \"ARG_OF_PERICENTER\": 20, \"MEAN_ANOMALY\": 30, \
             \"BSTAR\": 0.0001}}"
        )
    };
    std::fs::write(&path, format!("[{}, {}]", set("CSS", "48274", "7"), set("ISS", "25544", "0.0001"))).unwrap();
    let (sets, warnings) = read_elements_for(&path, Some(25544)).unwrap();
    assert!(sets.len() == 1 && warnings.len() == 1 && warnings[0].contains("eccentricity"), "{warnings:?}");
    assert_eq!(read_elements_for(&path, Some(48274)).unwrap_err().exit_code(), 4);
    let head = "OBJECT_NAME,NORAD_CAT_ID,EPOCH,MEAN_MOTION,ECCENTRICITY,INCLINATION,RA_OF_ASC_NODE,ARG_OF_PERICENTER,MEAN_ANOMALY,BSTAR";
    let row =
        |name: &str, number: &str| format!("{name},{number},2025-06-08T01:41:33.5,15.5,0.0001,51.6,10,20,30,0.0001");
    std::fs::write(&path, format!("{head}\n{}\nCSS,48274,2025-06-08T01:4\n", row("ISS", "25544"))).unwrap();
    let (sets, warnings) = read_elements_for(&path, Some(25544)).unwrap();
    assert!(sets.len() == 1 && warnings.len() == 1 && warnings[0].contains("fields"), "{warnings:?}");
}

#[test]
fn the_epoch_of_a_message_may_have_an_offset() {
    let of = |epoch: &str| {
        let text = format!(
            "{{\"OBJECT_NAME\": \"ISS\", \"NORAD_CAT_ID\": 25544, \"EPOCH\": \"{epoch}\", \"MEAN_MOTION\": 15.5, \"ECCENTRICITY\": \
             0.0001, \"INCLINATION\": 51.6, \"RA_OF_ASC_NODE\": 10, \"ARG_OF_PERICENTER\": 20, \"MEAN_ANOMALY\": 30, \"BSTAR\": 0.0001}}"
        );
        read_text(&text)
    };
    let utc = of("2025-06-08T01:41:33.5").unwrap()[0].epoch();
    for same in [
        "2025-06-08T01:41:33.5Z",
        "2025-06-08T11:41:33.5+10:00",
        "2025-06-07T22:11:33.5-0330",
        "2025-06-08T01:41:33.5+00:00",
    ] {
        assert_eq!(of(same).unwrap()[0].epoch(), utc, "{same}");
    }
    assert!(of("2025-02-30T01:41:33").is_err() && of("2025-06-08T25:41:33").is_err());
}
