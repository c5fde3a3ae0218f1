//! Times, windows and numbers of the command line: zones, dates alone, passes that the window cuts, what no option takes.

use crate::support;

use std::collections::HashMap;
use std::path::Path;

use support::{RunOutput, satphot};

const ELEMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/night/iss-2025-june.tle");
const SITE: &str = "-33.7703,151.1113,70";
const AMC_4: &str = "AMC-4\n\
                     1 25954U 99060A   04039.68057285 -.00000108  00000-0  00000-0 0  6847\n\
                     2 25954   0.0004 243.8136 0001765  15.5294  22.7134  1.00271289 15615\n";

fn run(args: &[&str]) -> RunOutput {
    satphot(tempfile::tempdir().unwrap().path(), args)
}

fn passes(start: &str, more: &[&str]) -> RunOutput {
    let head = ["passes", "--elements", ELEMENTS, "--site", SITE, "--start", start];
    run(&[&head[..], more].concat())
}

fn rows(output: &RunOutput) -> Vec<HashMap<String, String>> {
    csv::Reader::from_reader(output.out.as_bytes()).deserialize().map(Result::unwrap).collect()
}

#[test]
fn a_zone_is_honoured_and_a_date_alone_is_its_midnight() {
    let csv = |start: &str| passes(start, &["--hours", "2", "--csv"]).expect(0, &[]).out;
    let utc = csv("2025-06-09T10:20:00");
    assert!(utc.contains("2025-06-09T10:33:12Z"), "{utc}");
    for same in
        ["2025-06-09T20:20:00+10:00", "2025-06-09 20:20 +1000", "2025-06-09T10:20:00Z", "2025-06-09T06:50:00-0330"]
    {
        assert_eq!(csv(same), utc, "{same}");
    }
    assert_eq!(csv("2025-06-09"), csv("2025-06-09T00:00:00"));
    assert_eq!(csv("2025-06-08T24:00:00"), csv("2025-06-09T00:00:00"));
    // a moment of another verb
    let ground = |time: &str| {
        run(&["plot", "ground", "--elements", ELEMENTS, "--time", time, "--rows", "3", "--csv"]).expect(0, &[]).out
    };
    assert_eq!(ground("2025-06-09T20:33:00+10:00"), ground("2025-06-09T10:33:00"));
}

#[test]
fn what_is_no_time_is_named_with_its_option_and_what_is_accepted() {
    for (time, why) in [
        ("2025-02-30T10:00:00", "2025-02 has 28 days"),
        ("2025-06-09T25:00:00", "the hour 25"),
        ("2025-06-09T23:59:60", "no leap second"),
        ("2025-06-09T10:20:00 AEST", "not a zone"),
        ("2025-06-09T10:20:00+25:00", "outside -14:00 to +14:00"),
        ("yesterday", "begin with a date"),
    ] {
        let words = ["--start:", time, why, "2025-06-09T20:20:00", "+10:00"];
        let output = passes(time, &[]).expect(2, &words).without_results();
        assert!(!output.err.contains("configuration"), "{}", output.err);
    }
    let month = |more: &[&str]| run(&[&["predict", "month", "--site", SITE][..], more].concat());
    month(&["--date", "2025-02-29"]).expect(2, &["--date:", "2025-02 has 28 days"]);
    month(&["--month", "2025-13"]).expect(2, &["--month:", "no month 13"]);
    run(&["predict", "day", "--satellite", "iss", "--site", SITE, "--date", "2025-06-31"])
        .expect(2, &["2025-06 has 30 days"]);
}

#[test]
fn a_pass_cut_by_the_window_is_shown_whole_and_marked() {
    let output = passes("2025-06-09T10:35:00", &["--hours", "1", "--csv"]).expect(0, &[]);
    let row = &rows(&output)[0];
    assert_eq!((row["culmination_utc"].as_str(), row["max_alt_deg"].as_str()), ("2025-06-09T10:33:12Z", "32.1"));
    assert_eq!(row["outside_window"], "rise culmination");
    let whole = rows(&passes("2025-06-09T10:00:00", &["--hours", "1", "--csv"]).expect(0, &[]));
    assert_eq!(whole[0]["outside_window"], "");
    for key in
        ["rise_utc", "culmination_utc", "set_utc", "max_alt_deg", "range_km", "sun_alt_deg", "illum", "paper_label"]
    {
        assert_eq!(row[key], whole[0][key], "{key}");
    }
    let text = passes("2025-06-09T10:35:00", &["--hours", "1"]).expect(0, &[]).out;
    assert!(text.contains("outside the window") && text.contains("rise culmination"), "{text}");
}

#[test]
fn a_satellite_that_never_sets_has_no_culmination_and_that_is_said() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("geo.tle"), AMC_4).unwrap();
    let args = ["passes", "--elements", "geo.tle", "--site", "20,-101,0", "--start", "2004-02-08", "--hours", "5"];
    let output = satphot(folder.path(), &[&args[..], &["--csv"]].concat()).expect(0, &[]);
    let rows = rows(&output);
    assert_eq!(rows.len(), 1);
    for key in ["rise_utc", "culmination_utc", "set_utc", "max_alt_deg"] {
        assert_eq!(rows[0][key], "", "{key}");
    }
    assert!(rows[0]["note"].contains("does not rise or set"), "{}", rows[0]["note"]);
    satphot(folder.path(), &args).expect(0, &["does not rise or set and has no culmination"]);
}

#[test]
fn no_option_takes_infinity_or_nan_and_the_message_is_of_the_option() {
    for args in [
        &["passes", "--elements", ELEMENTS, "--site", SITE, "--start", "2025-06-09", "--min-alt", "inf"][..],
        &["passes", "--elements", ELEMENTS, "--site", SITE, "--start", "2025-06-09", "--min-alt", "nan"],
        &["passes", "--elements", ELEMENTS, "--site", SITE, "--start", "2025-06-09", "--hours", "inf"],
        &["predict", "duty", "--site", SITE, "--date", "2025-06-09", "--satellite", "iss", "--limit-mag", "inf"],
        &["predict", "month", "--site", SITE, "--month", "2025-06", "--zp-mag", "inf"],
        &["predict", "month", "--site", SITE, "--month", "2025-06", "--exptime-s", "inf"],
        &["limits", "tracked", "--saturation-e", "inf"],
        &["limits", "streak", "--area-m2", "inf", "--height-km", "400"],
    ] {
        let option = args.iter().rev().find(|a| a.starts_with("--")).unwrap();
        let option = if args.contains(&"--area-m2") { "--area-m2" } else { option };
        let output = run(args).expect(2, &[&format!("error: {option}: "), "finite number"]).without_results();
        assert!(!output.err.contains("configuration"), "{}", output.err);
    }
}

#[test]
fn a_damaged_set_of_another_object_is_a_warning_and_the_passes_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let good = std::fs::read_to_string(Path::new(ELEMENTS)).unwrap();
    let damaged = AMC_4.replace("1.00271289", "1.10271289");
    std::fs::write(folder.path().join("both.tle"), format!("{damaged}{good}")).unwrap();
    let with = |norad: &str, start: &str| {
        let args = ["passes", "--elements", "both.tle", "--site", SITE, "--norad", norad, "--start", start, "--csv"];
        satphot(folder.path(), &args)
    };
    let output =
        with("25544", "2025-06-09T10:00:00").expect(0, &["note: ", "both.tle:3", "checksum", "another object"]);
    assert!(output.out.contains("2025-06-09T10:33:12Z"), "{}", output.out);
    with("25954", "2004-02-08").expect(4, &["both.tle:3", "checksum"]).without_results();
}

#[test]
fn beyond_the_table_of_ut1_it_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let output = satphot(
        folder.path(),
        &[
            "predict",
            "sky",
            "--satellite",
            "iss",
            "--site",
            SITE,
            "--time",
            "2060-06-09T20:20:00+10:00",
            "--mode",
            "as_published",
        ],
    );
    output.expect(0, &["UT1 - UTC on 2060-06-09 is not known", "1972-01-01"]);
}
