//! Observations for archives: the tracking data message by a parser we did not write, the records of the library by its
//! documented fields, IOD by its columns; and what is never written as a magnitude (SCORE's own: `export_score.rs`).
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // tests

use crate::export_support;

use std::path::Path;

use ccsds_ndm::messages::tdm::{Tdm, TdmObservationData};
use ccsds_ndm::traits::{Ndm, Validate};
use export_support::{facts, later, meta, missed, python_with, python_with_package, row, run_python, shared};
use satphot::config::Reporter;
use satphot::export::{Choice, DataMode, Facts, TdmNames, UdlNames, iod_text, score_text, select, tdm_text, udl_text};
use satphot::tables::PhotometryRow;

fn path() -> &'static Path {
    Path::new("photometry.ecsv")
}

fn score(rows: &[PhotometryRow], facts: &Facts) -> satphot::Result<String> {
    score_text(path(), &select(rows, Choice::default(), true).kept, facts, true).map(|s| s.text)
}

fn tdm(rows: &[PhotometryRow], facts: &Facts) -> satphot::Result<String> {
    tdm_text(path(), rows, &select(rows, Choice::default(), false).kept, facts, &TdmNames::default())
}

fn udl(rows: &[PhotometryRow], facts: &Facts) -> Vec<serde_json::Value> {
    let kept = select(rows, Choice::default(), false).kept;
    serde_json::from_str(&udl_text(path(), rows, &kept, facts, &UdlNames::default()).unwrap()).unwrap()
}

fn iod(rows: &[PhotometryRow], facts: &Facts) -> satphot::Result<String> {
    iod_text(path(), &select(rows, Choice::default(), false).kept, facts)
}

// ---------------------------------------------------------------- all formats

#[test]
fn simulated_data_are_refused_for_score_and_iod_and_marked_in_the_others() {
    for mode in [DataMode::Simulated, DataMode::Test, DataMode::Exercise] {
        let facts = Facts { data_mode: Some(mode), ..facts() };
        assert!(score(&[row()], &facts).unwrap_err().to_string().contains(mode.name()));
        assert!(iod(&[row()], &facts).unwrap_err().to_string().contains(mode.name()));
        assert!(tdm(&[row()], &facts).unwrap().contains(&format!("COMMENT {} DATA", mode.name())));
        assert_eq!(udl(&[row()], &facts)[0]["dataMode"], mode.name());
    }
    let unknown = Facts { data_mode: None, ..facts() };
    assert!(score(&[row()], &unknown).unwrap_err().to_string().contains("`data_mode`"));
}

#[test]
fn what_nobody_said_is_an_error_that_names_the_option_and_the_key() {
    let bare = || Facts::new(&meta(), None, Reporter::default()).unwrap();
    let with = |change: fn(&mut Reporter)| {
        let mut facts = facts();
        change(&mut facts.reporter);
        facts
    };
    let cases = [
        (score(&[row()], &with(|r| r.email = None)), "`email`", "reporter.email"),
        (score(&[row()], &with(|r| r.orcid = vec![])), "`orcid`", "reporter.orcid"),
        (score(&[row()], &with(|r| r.observing_mode = None)), "`observing_mode`", "reporter.observing_mode"),
        (tdm(&[row()], &bare()), "`organisation`", "reporter.organisation"),
        (tdm(&[row()], &with(|r| r.station = None)), "`station`", "reporter.station"),
        (iod(&[row()], &with(|r| r.iod_station = None)), "`iod_station`", "reporter.iod_station"),
        (score(&[row()], &Facts { site: None, ..facts() }), "`site`", "[site]"),
    ];
    for (answer, option, key) in cases {
        let error = answer.unwrap_err();
        assert_eq!(error.exit_code(), 2, "{error}");
        assert!(error.to_string().contains(option) && error.to_string().contains(key), "{error}");
    }
    let nameless = PhotometryRow { object_id: String::new(), norad_cat_id: None, ..row() };
    assert!(tdm(std::slice::from_ref(&nameless), &facts()).unwrap_err().to_string().contains("`object_id"));
    assert!(score(&[nameless], &facts()).unwrap_err().to_string().contains("`norad_cat_id`"));
}

// ---------------------------------------------------------------- tracking data message

#[test]
fn a_parser_we_did_not_write_reads_the_message_as_it_was_meant() {
    // two passes, the second with two exposure times; a non-detection; the table is not in order of time
    let short = |seconds, v| PhotometryRow { exptime_s: Some(1.0), ..later(seconds, v) };
    let rows = [
        later(12, 11.707),
        row(),
        missed(24),
        later(6000, 12.0),
        short(6012, 12.5),
        later(6024, 12.25),
        short(6036, 12.75),
    ];
    let text = tdm(&rows, &facts()).unwrap();
    let message = Tdm::from_kvn(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    message.validate().unwrap();
    assert_eq!((message.version.as_str(), message.header.originator.as_str()), ("2.0", "EXAMPLE_OBSERVATORY"));
    assert_eq!(message.header.message_id.as_deref(), Some("20250609-25544-0001"));
    let stated: Vec<(f64, Vec<(String, f64)>)> = message
        .body
        .segments
        .iter()
        .map(|s| {
            let mags = s.data.observations.iter().map(|o| match &o.data {
                TdmObservationData::Mag(mag) => (o.epoch.as_str().to_owned(), *mag),
                other => panic!("{other:?}"),
            });
            (s.metadata.integration_interval.unwrap(), mags.collect())
        })
        .collect();
    let mags: Vec<(f64, Vec<f64>)> = stated.iter().map(|(t, m)| (*t, m.iter().map(|(_, m)| *m).collect())).collect();
    assert_eq!(mags, [(5.0, vec![11.934, 11.707]), (5.0, vec![12.0, 12.25]), (1.0, vec![12.5, 12.75])]);
    for ((_, mags), segment) in stated.iter().zip(&message.body.segments) {
        let times: Vec<&str> = mags.iter().map(|(t, _)| t.as_str()).collect();
        assert!(times.is_sorted(), "{times:?}");
        let m = &segment.metadata;
        assert_eq!(m.start_time.unwrap().as_str(), times[0]);
        assert_eq!(m.stop_time.unwrap().as_str(), *times.last().unwrap());
        assert_eq!((m.participant_1.as_str(), m.participant_2.as_deref()), ("MQ_CDK24", Some("1998-067A")));
        assert_eq!((m.time_system.as_str(), m.data_types.as_deref()), ("UTC", Some("MAG")));
    }
    assert_eq!(message.body.segments[0].metadata.track_id.as_deref(), Some("20250609_103302-25544"));
    assert_ne!(message.body.segments[0].metadata.track_id, message.body.segments[1].metadata.track_id);
    assert_eq!(message.body.segments[1].metadata.track_id, message.body.segments[2].metadata.track_id);
    assert!(!text.contains("14.0"), "the limit is no magnitude");
}

#[test]
fn a_measured_place_is_in_every_format_that_has_a_field_for_it() {
    let placed = PhotometryRow {
        ra_deg: Some(283.123_456),
        dec_deg: Some(-33.5),
        ra_err_arcsec: Some(0.36),
        dec_err_arcsec: Some(0.72),
        ..row()
    };
    let rows = [placed, later(9, 12.0)];
    let records = udl(&rows, &facts());
    assert_eq!(
        (&records[0]["ra"], &records[0]["declination"]),
        (&serde_json::json!(283.123_456), &serde_json::json!(-33.5))
    );
    assert!((records[0]["declinationUnc"].as_f64().unwrap() - 2e-4).abs() < 1e-12);
    assert_eq!(records[0]["raMeasured"], true);
    assert!(records[1].get("ra").is_none() && records[1].get("raMeasured").is_none());
    follows(&records[0], UDL_FIELDS);
    let text = score(&rows, &facts()).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[1].contains("283.123456,-33.500000,0.1296,,0.5184"), "{text}");
    assert!(!lines[2].contains("283."), "{text}");
    let message = Tdm::from_kvn(&tdm(&rows, &facts()).unwrap()).unwrap();
    message.validate().unwrap();
    let angles: Vec<f64> = message.body.segments[0]
        .data
        .observations
        .iter()
        .filter_map(|o| match &o.data {
            TdmObservationData::Angle1(angle) | TdmObservationData::Angle2(angle) => Some(*angle),
            _ => None,
        })
        .collect();
    assert_eq!(angles, [283.123_456, -33.5]);
}

#[test]
fn a_message_has_the_lines_of_the_shared_example() {
    let Some(example) = shared("mag_only.tdm") else { return };
    let rows = [row(), later(12, 11.707)];
    let kept = select(&rows, Choice::default(), false).kept;
    let names = TdmNames { creation_date: Some("2026-11-21T10:05:00Z".into()), message_id: None };
    let text = tdm_text(path(), &rows, &kept, &facts(), &names).unwrap();
    // the example names its track after another second; its own lines of commentary differ
    for line in
        example.lines().filter(|l| !l.starts_with("TRACK_ID") && (!l.starts_with("COMMENT") || l.contains("SITE")))
    {
        let wanted = line.replace("10:05:00Z", "10:05:00.000Z");
        assert!(text.lines().any(|l| l == wanted), "{wanted}\n{text}");
    }
}

#[test]
fn a_message_is_ascii_in_short_lines_and_says_degraded_where_it_must() {
    for words in ["Sternwarte Bückeburg", &"long ".repeat(30), "two\nlines"] {
        let reporter = Reporter { organisation: Some(words.into()), ..facts().reporter };
        let message = tdm(&[row()], &Facts { reporter, ..facts() }).unwrap_err();
        assert!(message.exit_code() == 2 && message.to_string().contains("`organisation`"), "{message}");
    }
    let facts = facts();
    let rows = [PhotometryRow { verdict: "caution".into(), ..row() }];
    let kept = select(&rows, Choice::named("use,caution").unwrap(), false).kept;
    let text = tdm_text(path(), &rows, &kept, &facts, &TdmNames::default()).unwrap();
    assert!(text.is_ascii() && text.lines().all(|l| l.len() <= 254));
    assert!(text.contains("DATA_QUALITY = DEGRADED"));
    Tdm::from_kvn(&text).unwrap().validate().unwrap();
    let error = tdm(&[missed(0)], &facts).unwrap_err();
    assert!(error.exit_code() == 4 && error.to_string().contains("`verdicts`"), "{error}");
}

#[test]
fn a_message_is_validated_only_where_every_row_was_judged_to_be_used() {
    let facts = facts();
    let quality = |verdicts: [&str; 2]| {
        let rows = [row(), later(5, 12.0)].into_iter().zip(verdicts);
        let rows: Vec<PhotometryRow> = rows.map(|(r, v)| PhotometryRow { verdict: v.into(), ..r }).collect();
        let kept = select(&rows, Choice::named("use,caution").unwrap(), false).kept;
        let text = tdm_text(path(), &rows, &kept, &facts, &TdmNames::default()).unwrap();
        text.lines().find_map(|l| l.strip_prefix("DATA_QUALITY = ")).unwrap().to_owned()
    };
    assert_eq!(quality(["use", "use"]), "VALIDATED");
    assert_eq!(quality(["use", "caution"]), "DEGRADED");
    assert_eq!(quality(["use", ""]), "RAW");
    assert_eq!(quality(["", "caution"]), "DEGRADED");
}

#[test]
fn a_second_reader_in_another_language_finds_the_same_magnitudes_in_a_tracking_data_message() {
    let Some(python) = python_with("ccsds_ndm") else { return };
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("night.tdm"), tdm(&[row(), later(5, 12.345), later(9, -1.5)], &facts()).unwrap())
        .unwrap();
    let script = "from ccsds_ndm.ndm_io import NdmIo\n\
        m = NdmIo().from_path('night.tdm')\n\
        o = [o for s in m.body.segment for o in s.data.observation]\n\
        assert [float(x.mag) for x in o] == [11.934, 12.345, -1.5], [x.mag for x in o]\n\
        assert o[0].epoch.startswith('2025-06-09T10:33:02.5'), o[0].epoch\n\
        assert m.body.segment[0].metadata.participant_2 == '1998-067A'\n\
        print('as expected')";
    run_python(&python, dir.path(), script);
}

#[test]
fn each_satellite_has_segments_of_its_own() {
    let other =
        |seconds| PhotometryRow { norad_cat_id: Some(100_001), object_id: String::new(), ..later(seconds, 9.0) };
    let message = Tdm::from_kvn(&tdm(&[row(), other(1), later(2, 12.0), other(3)], &facts()).unwrap()).unwrap();
    let targets: Vec<_> = message.body.segments.iter().map(|s| s.metadata.participant_2.clone().unwrap()).collect();
    assert_eq!(targets, ["1998-067A", "100001"]);
    assert!(message.body.segments.iter().all(|s| s.data.observations.len() == 2));
}

// ---------------------------------------------------------------- Unified Data Library

/// Fields of EOObservation and its details that satphot may write, with their JSON types (s, n, i, b, a, o), as
/// documented for `eo_observation_create` and the flags of its full form.
const UDL_FIELDS: &str = "classificationMarking:s dataMode:s obTime:s source:s satNo:i origObjectId:s origSensorId:s \
    senlat:n senlon:n senalt:n azimuth:n azimuthMeasured:b elevation:n elevationMeasured:b range:n rangeMeasured:b \
    expDuration:n mag:n magUnc:n magNormRange:n tags:a descriptor:s zeroptd:n zeroPtdUnc:n primaryExtinction:n primaryExtinctionUnc:n \
    ra:n raUnc:n raMeasured:b declination:n declinationUnc:n declinationMeasured:b skyBkgrnd:n solarPhaseAngle:n umbra:b penumbra:b trackId:s collectMethod:s rawFileURI:s eoobservationDetails:o";
const UDL_DETAILS: &str = "gain:n magInstrumental:n snrEst:n ccdObjPosX:n ccdObjPosY:n pcalNumStars:i \
    distFromStreakCenter:a surfBrightness:a solarDiskFrac:n timesUnc:n sunElevation:n";

fn follows(object: &serde_json::Value, fields: &str) {
    for (key, value) in object.as_object().unwrap() {
        let kind = fields.split_whitespace().find_map(|f| f.strip_prefix(&format!("{key}:")));
        let good = match kind.unwrap_or_else(|| panic!("{key} is not documented")) {
            "s" => value.is_string(),
            "n" => value.is_number(),
            "i" => value.is_i64(),
            "b" => value.is_boolean(),
            "a" => value.is_array(),
            _ => value.is_object(),
        };
        assert!(good, "{key}: {value}");
    }
}

#[test]
fn a_sunlit_satellite_that_shows_earthshine_is_not_said_to_be_in_the_umbra() {
    let shadow = |illum: &str, label: &str, sky: &str| {
        let row =
            PhotometryRow { illum: illum.into(), paper_label: label.into(), sky_class: sky.into(), ..later(9, 12.0) };
        let record = udl(&[row], &facts()).remove(0);
        (record.get("umbra").and_then(|v| v.as_bool()), record.get("penumbra").and_then(|v| v.as_bool()))
    };
    assert_eq!(shadow("sun", "twilight", "night"), (Some(false), Some(false)));
    assert_eq!(shadow("penumbra", "twilight", "night"), (Some(false), Some(true)));
    assert_eq!(shadow("moon", "night", "night"), (Some(true), Some(false)));
    // its lit sides look away: by day nothing shows it, in a night sky the label does
    assert_eq!(shadow("earthshine", "day", "day"), (None, None));
    assert_eq!(shadow("none", "day", "day"), (None, None));
    assert_eq!(shadow("earthshine", "twilight", "night"), (Some(false), None));
    assert_eq!(shadow("lunar_earthshine", "twilight", "civil_twilight"), (None, None));
    assert_eq!(shadow("", "", ""), (None, None));
}

#[test]
fn a_record_has_documented_fields_of_the_right_kind_and_the_numbers_of_the_row() {
    let rows = [
        row(),
        missed(5),
        PhotometryRow { illum: "penumbra".into(), mu_mean_mag_arcsec2: Some(21.5), ..later(9, 12.0) },
    ];
    let records = udl(&rows, &facts());
    assert_eq!(records.len(), 2, "a non-detection has no record");
    for record in &records {
        follows(record, UDL_FIELDS);
        follows(&record["eoobservationDetails"], UDL_DETAILS);
        for key in ["classificationMarking", "dataMode", "obTime", "source"] {
            assert!(record.get(key).is_some(), "{key} is required");
        }
        assert!(!record.to_string().contains("null"));
        assert_eq!(record["azimuthMeasured"], false);
        assert_eq!(record["tags"], serde_json::json!(["BAND_V"]));
    }
    let (first, second) = (&records[0], &records[1]);
    assert_eq!(first["mag"], 11.934);
    assert!((first["magUnc"].as_f64().unwrap() - 0.021f64.hypot(0.17)).abs() < 1e-15);
    // reduced to 1000 km, as the library defines it
    let reduced = 11.934 - 5.0 * (first["range"].as_f64().unwrap() / 1000.0).log10();
    assert!((first["magNormRange"].as_f64().unwrap() - reduced).abs() < 1e-12);
    assert_eq!((&first["senalt"], &first["satNo"]), (&serde_json::json!(0.07), &serde_json::json!(25544)));
    assert_eq!((&first["umbra"], &first["penumbra"]), (&serde_json::json!(true), &serde_json::json!(false)));
    assert_eq!((&second["umbra"], &second["penumbra"]), (&serde_json::json!(false), &serde_json::json!(true)));
    assert_eq!(first["zeroptd"], 23.377, "2.5 log10 of the counts per second of magnitude 0");
    // 20 e-/px in 5 s is 4 e-/px/s: -2.5 log10 4 + 23.377 + 5 log10 1.566
    let sky = -2.5 * 4f64.log10() + 23.377 + 5.0 * 1.566f64.log10();
    assert!((first["skyBkgrnd"].as_f64().unwrap() - sky).abs() < 1e-12);
    assert_eq!(second["eoobservationDetails"]["surfBrightness"], serde_json::json!([21.5]));
    assert_eq!(first["trackId"], second["trackId"]);
    let rows = [missed(0)];
    let kept = select(&rows, Choice::default(), false).kept;
    let none = udl_text(path(), &rows, &kept, &facts(), &UdlNames::default()).unwrap_err();
    assert!(none.exit_code() == 4 && none.to_string().contains("no magnitude to report"), "{none}");
}

#[test]
fn a_validator_of_json_schemas_takes_the_records_and_refuses_broken_ones() {
    let Some(python) = python_with("jsonschema") else { return };
    let rows = [row(), PhotometryRow { illum: "penumbra".into(), mu_mean_mag_arcsec2: Some(21.5), ..later(9, 12.0) }];
    let kept = select(&rows, Choice::default(), false).kept;
    let text = udl_text(path(), &rows, &kept, &facts(), &UdlNames::default()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("night.json"), text).unwrap();
    std::fs::write(dir.path().join("schema.json"), include_str!("../data/udl_eoobservation.schema.json")).unwrap();
    let script = "import json, copy\n\
        from jsonschema import Draft202012Validator as V\n\
        s = json.load(open('schema.json')); V.check_schema(s); v = V(s, format_checker=V.FORMAT_CHECKER)\n\
        n = json.load(open('night.json')); assert len(n) == 2\n\
        assert not list(v.iter_errors(n)), [e.message for e in v.iter_errors(n)]\n\
        for key, wrong in [('mag', None), ('senalt', 1165.0), ('azimuth', 400), ('dataMode', 'real'), ('none', 1)]:\n\
        \x20   bad = copy.deepcopy(n); bad[0][key] = wrong; assert list(v.iter_errors(bad)), key\n\
        print('as expected')";
    run_python(&python, dir.path(), script);
}

#[test]
fn the_library_of_the_unified_data_library_reads_the_records_and_gives_them_back() {
    let Some(python) = python_with_package("unifieddatalibrary", "udl-sdk") else { return };
    let rows = [row(), PhotometryRow { illum: "penumbra".into(), mu_mean_mag_arcsec2: Some(21.5), ..later(9, 12.0) }];
    let kept = select(&rows, Choice::default(), false).kept;
    let text = udl_text(path(), &rows, &kept, &facts(), &UdlNames::default()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("night.json"), text).unwrap();
    let script = "import json\n\
        from unifieddatalibrary.types.shared import EoObservationFull as Record\n\
        records = json.load(open('night.json')); assert len(records) == 2\n\
        for record in records:\n\
        \x20   read = Record.model_validate(record)\n\
        \x20   assert not read.model_extra and not read.eoobservation_details.model_extra, 'unknown fields'\n\
        \x20   assert read.to_dict(mode='json', exclude_unset=True, use_api_names=True) == record\n\
        try: Record.model_validate({**records[0], 'mag': 'bright'})\n\
        except ValueError: print('as expected')";
    run_python(&python, dir.path(), script);
}

#[test]
fn longitudes_beyond_180_deg_are_written_west() {
    let facts = Facts { site: Some([10.0, -156.0, 3_000.0]), ..facts() };
    assert_eq!(udl(&[row()], &facts)[0]["senlon"], -156.0);
    let mut message = meta();
    message.entries.retain(|(k, _)| k != "site");
    let number = |k: &str, v: f64| (k.to_owned(), satphot::tables::MetaValue::Number(v));
    let site = vec![number("lat_deg", 10.0), number("lon_deg", 204.0), number("alt_m", 3_000.0)];
    message.push("site", satphot::tables::MetaValue::Map(site));
    assert_eq!(Facts::new(&message, None, Reporter::default()).unwrap().site, Some([10.0, -156.0, 3_000.0]));
}

// ---------------------------------------------------------------- IOD

#[test]
fn an_iod_line_has_its_fields_in_their_columns() {
    let rows = [row(), PhotometryRow { v_mag: Some(-1.26), ..later(5, 0.0) }, missed(9)];
    let text = iod(&rows, &facts()).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 2, "a non-detection has no line");
    let columns = |line: &str, from: usize, to: usize| line[from - 1..to].to_owned();
    assert_eq!(columns(lines[0], 1, 15), "25544 98 067A  ");
    assert_eq!(columns(lines[0], 17, 20), "8000");
    assert_eq!(columns(lines[0], 24, 40), "20250609103302500");
    assert_eq!(columns(lines[0], 42, 43), "57", "0.5 s");
    assert_eq!(columns(lines[0], 44, 66).trim(), "", "no position was measured");
    assert_eq!((columns(lines[0], 67, 70), columns(lines[0], 72, 73)), ("+119".into(), "02".into()));
    assert_eq!(columns(lines[1], 67, 70), "-013");
    assert!(lines.iter().all(|l| l.len() <= 80));
}

#[test]
fn iod_refuses_what_its_columns_cannot_hold() {
    let big = PhotometryRow { norad_cat_id: Some(100_000), ..row() };
    let message = iod(&[big], &facts()).unwrap_err().to_string();
    assert!(message.contains("100000") && message.contains("99999"), "{message}");
    assert!(iod(&[PhotometryRow { norad_cat_id: Some(99_999), ..row() }], &facts()).unwrap().starts_with("99999 "));
    let nameless = PhotometryRow { object_id: String::new(), ..row() };
    assert!(iod(&[nameless], &facts()).unwrap_err().to_string().contains("`object_id"));
    let facts = Facts { reporter: Reporter { iod_station: Some("80".into()), ..facts().reporter }, ..facts() };
    assert!(iod(&[row()], &facts).unwrap_err().to_string().contains("four digits"));
}

#[test]
fn same_rows_give_same_bytes_in_every_format() {
    let rows = [row(), later(12, 11.707), missed(24)];
    assert_eq!(score(&rows, &facts()).unwrap(), score(&rows, &facts()).unwrap());
    assert_eq!(tdm(&rows, &facts()).unwrap(), tdm(&rows, &facts()).unwrap());
    assert_eq!(udl(&rows, &facts()), udl(&rows, &facts()));
    assert_eq!(iod(&rows, &facts()).unwrap(), iod(&rows, &facts()).unwrap());
}
