//! Light classes: the laws of the two labels, the pass of 11 June 2025 that begins in sunlight, the paper's table and
//! histogram from simulated passes.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;
use std::path::Path;

use satphot::brightness::Illum;
use satphot::brightness::light_class::{PaperLabel, SUNRISE_ALT_DEG, SkyClass, is_sunlit};
use satphot::paper::labels::{read_labelled, summary};
use satphot::tables::{Meta, PhotometryRow, read_photometry, write_photometry};
use support::{RunOutput, satphot};

const ELEMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/night/iss-2025-june.tle");
const SITE: &str = "-33.7703,151.1113,70";
const LIGHTS: [Illum; 6] =
    [Illum::Sun, Illum::Penumbra, Illum::Moon, Illum::LunarEarthshine, Illum::Earthshine, Illum::None];

fn rows(output: &RunOutput) -> Vec<HashMap<String, String>> {
    csv::Reader::from_reader(output.out.as_bytes()).deserialize().map(Result::unwrap).collect()
}

/// The pass of 11 June 2025, 18:50 in Sydney, above the dome's 15 deg, as a table in `folder`.
fn twilight_pass(folder: &Path, more: &[&str]) -> RunOutput {
    let start = ["--start", "2025-06-11T08:45:00", "--hours", "0.5", "--min-alt", "15", "--satellite", "iss"];
    let head = ["predict", "pass", "--elements", ELEMENTS, "--site", SITE];
    satphot(folder, &[&head[..], &start, more].concat()).expect(0, &[])
}

#[test]
fn with_the_sun_up_it_is_day_whatever_lights_the_satellite() {
    for sun_alt_deg in [90.0, 30.0, 0.0, SUNRISE_ALT_DEG] {
        let sky = SkyClass::of_sun_alt(sun_alt_deg);
        assert_eq!(sky, SkyClass::Day);
        assert!(LIGHTS.iter().all(|l| PaperLabel::of(sky, is_sunlit(*l)) == PaperLabel::Day));
    }
}

#[test]
fn sunlight_on_the_satellite_makes_twilight_of_any_night_and_its_absence_makes_night_of_none_but_a_dark_sky() {
    for sun_alt_deg in [-0.9, -6.0, -10.0, -17.9, -18.1, -45.0, -90.0] {
        let sky = SkyClass::of_sun_alt(sun_alt_deg);
        for light in LIGHTS {
            let dark = sky == SkyClass::Night && !matches!(light, Illum::Sun | Illum::Penumbra);
            let expected = if dark { PaperLabel::Night } else { PaperLabel::Twilight };
            assert_eq!(PaperLabel::of(sky, is_sunlit(light)), expected, "{sun_alt_deg} {light}");
        }
    }
}

#[test]
fn the_sky_darkens_class_by_class_at_the_altitudes_of_the_almanac() {
    let limits = [(SUNRISE_ALT_DEG, "day"), (-6.0, "civil_twilight"), (-12.0, "nautical_twilight")];
    for (alt_deg, class) in limits.into_iter().chain([(-18.0, "astronomical_twilight")]) {
        assert_eq!(SkyClass::of_sun_alt(alt_deg).to_string(), class, "the limit belongs to the brighter class");
        assert!(SkyClass::of_sun_alt(alt_deg - 1e-9) > SkyClass::of_sun_alt(alt_deg));
    }
    let classes: Vec<SkyClass> = (-90..=90).rev().map(|alt| SkyClass::of_sun_alt(f64::from(alt))).collect();
    assert!(classes.is_sorted(), "a lower Sun is never a brighter class");
}

#[test]
fn a_pass_has_the_label_of_its_moment_nearest_to_day() {
    use PaperLabel::{Day, Night, Twilight};
    assert_eq!(PaperLabel::of_pass([Night, Night, Twilight]), Some(Twilight));
    assert_eq!(PaperLabel::of_pass([Twilight, Day]), Some(Day));
    assert_eq!(PaperLabel::of_pass([Night]), Some(Night));
    assert_eq!(PaperLabel::of_pass([]), None);
    for label in PaperLabel::ALL {
        assert_eq!(PaperLabel::from_text(&label.to_string().to_uppercase()), Some(label), "spelled as in tables");
    }
}

#[test]
fn the_pass_of_11_june_is_night_sky_sunlit_satellite_then_night_and_as_a_whole_twilight() {
    let folder = tempfile::tempdir().unwrap();
    let rows = rows(&twilight_pass(folder.path(), &["--csv"]));
    assert!(rows.len() > 40);
    for row in &rows {
        assert_eq!(row["sky_class"], "night", "the Sun stands at {}", row["sun_alt_deg"]);
        let sunlit = matches!(row["illum"].as_str(), "sun" | "penumbra");
        // in the last of the penumbra moonlight can outshine what is left of the Sun
        if row["illum"] != "lunar_earthshine" {
            assert_eq!(row["paper_label"], if sunlit { "twilight" } else { "night" }, "{row:?}");
        }
    }
    let count = |label: &str| rows.iter().filter(|r| r["paper_label"] == label).count();
    assert!(count("twilight") > 10 && count("night") > 10, "{} {}", count("twilight"), count("night"));
    let head = ["passes", "--elements", ELEMENTS, "--site", SITE, "--start", "2025-06-11T08:45:00", "--hours", "0.5"];
    let passes = satphot(folder.path(), &[&head[..], &["--csv"]].concat()).expect(0, &[]);
    let pass = &self::rows(&passes)[0];
    assert_eq!((pass["sky_class"].as_str(), pass["paper_label"].as_str()), ("night", "twilight"));
}

#[test]
fn the_table_of_the_paper_counts_frames_under_the_label_of_their_pass() {
    let folder = tempfile::tempdir().unwrap();
    twilight_pass(folder.path(), &["-o", "a.ecsv", "-q"]);
    let table = read_labelled(&folder.path().join("a.ecsv")).unwrap();
    assert_eq!((table.column, table.without), ("model_v_mag", 0));
    let lines = summary(&table.rows);
    let line = |label: &str| lines.iter().find(|l| l.paper_label == label).unwrap();
    let n = table.rows.len() as i64;
    assert_eq!((line("twilight").n, line("night").n, line("day").n), (n, 0, 0));
    assert_eq!(line("twilight").n_by_frame + line("night").n_by_frame, n);
    assert!(line("night").n_by_frame > 10 && line("night").median_v_mag.is_none());
    // the two peaks: sunlit about V 1 to 3, then moonlit about 11
    let (sunlit, moonlit) =
        (line("twilight").median_by_frame_v_mag.unwrap(), line("night").median_by_frame_v_mag.unwrap());
    assert!(sunlit < 5.0 && moonlit > 9.0, "{sunlit} {moonlit}");
    assert!(line("twilight").std_v_mag.unwrap() > 3.0);
    let published: Vec<(i64, f64, f64)> =
        lines.iter().map(|l| (l.published_n, l.published_median_v_mag, l.published_std_v_mag)).collect();
    assert_eq!(published, [(147, 12.02, 1.0), (52, 6.41, 1.93), (363, -1.10, 0.84)]);
}

#[test]
fn a_table_without_the_label_is_labelled_from_the_sun_and_the_light() {
    let folder = tempfile::tempdir().unwrap();
    let csv = twilight_pass(folder.path(), &["--csv"]).out;
    let names: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
    let keep: Vec<usize> = (0..names.len()).filter(|i| !matches!(names[*i], "paper_label" | "sky_class")).collect();
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(csv.as_bytes());
    let mut writer = csv::Writer::from_path(folder.path().join("old.csv")).unwrap();
    for record in reader.records().map(Result::unwrap) {
        writer.write_record(keep.iter().map(|i| &record[*i])).unwrap();
    }
    writer.flush().unwrap();
    std::fs::write(folder.path().join("new.csv"), &csv).unwrap();
    let [old, new] = ["old.csv", "new.csv"].map(|f| read_labelled(&folder.path().join(f)).unwrap());
    // the label is of any sunlight, `illum` of the largest light: they may part where the penumbra ends
    let apart = old.rows.iter().zip(&new.rows).filter(|(a, b)| a.frame != b.frame).count();
    assert!(old.rows.len() == new.rows.len() && apart <= 1, "{apart}");
}

#[test]
fn the_histogram_and_the_table_are_written_and_what_cannot_be_read_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    twilight_pass(folder.path(), &["-o", "a.ecsv", "-q"]);
    let output = satphot(folder.path(), &["published", "--observed", "a.ecsv", "-o", "h.svg", "-o", "t.ecsv"]);
    let output = output.expect(0, &["magnitudes from model_v_mag", "wrote h.svg"]);
    assert!(output.out.contains("Moonlight + Lunar-Earthshine") && output.out.contains("12.02"), "{}", output.out);
    let svg = std::fs::read_to_string(folder.path().join("h.svg")).unwrap();
    assert!(svg.contains("share of the class") && svg.contains("twilight: Sunlight"), "axes and legend");
    let table = std::fs::read_to_string(folder.path().join("t.ecsv")).unwrap();
    assert!(table.starts_with("# %ECSV 1.0") && table.lines().filter(|l| !l.starts_with('#')).count() == 4);

    for (name, text, says) in [
        ("no_mag.csv", "mjd_mid_d,paper_label\n60000,day\n", "column v_mag or model_v_mag is needed"),
        ("no_label.csv", "mjd_mid_d,v_mag\n60000,3\n", "column paper_label, or sun_alt_deg and illum, is needed"),
        ("no_time.csv", "v_mag,paper_label\n3,day\n", "column mjd_mid_d or date_mid is needed"),
        (
            "bad.csv",
            "mjd_mid_d,v_mag,paper_label\n60000,3,day\n60001,bright,day\n",
            "bad.csv:3: column v_mag: \"bright\"",
        ),
        ("label.csv", "mjd_mid_d,v_mag,paper_label\n60000,3,dusk\n", "\"dusk\" is not one of day, twilight, night"),
        ("empty.csv", "", "is needed"),
    ] {
        std::fs::write(folder.path().join(name), text).unwrap();
        satphot(folder.path(), &["published", "--observed", name]).expect(4, &[says]);
    }
    satphot(folder.path(), &["published", "--observed", "a.ecsv", "-o", "h.png"]).expect(2, &[".svg"]);
    satphot(folder.path(), &["published", "-o", "h.svg"]).expect(2, &["--observed"]);
}

#[test]
fn a_photometry_table_of_an_older_version_is_read_without_the_classes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.ecsv");
    let row =
        PhotometryRow { frame: "a".into(), paper_label: "day".into(), sky_class: "day".into(), ..Default::default() };
    write_photometry(&path, std::slice::from_ref(&row), &Meta::default()).unwrap();
    assert_eq!(read_photometry(&path).unwrap().0, std::slice::from_ref(&row));
    let text = std::fs::read_to_string(&path).unwrap();
    let names = text.lines().find(|l| l.starts_with("frame,")).unwrap();
    let at: Vec<usize> = ["sky_class", "paper_label"].map(|n| names.split(',').position(|c| c == n).unwrap()).into();
    let old: Vec<String> = text
        .lines()
        .filter(|l| !l.contains("name: sky_class") && !l.contains("name: paper_label"))
        .map(|l| {
            let cells = l.split(',').enumerate().filter(|(i, _)| l.starts_with('#') || !at.contains(i));
            cells.map(|(_, c)| c).collect::<Vec<_>>().join(",")
        })
        .collect();
    std::fs::write(&path, old.join("\n") + "\n").unwrap();
    let read = read_photometry(&path).unwrap().0;
    assert_eq!(read, [PhotometryRow { paper_label: String::new(), sky_class: String::new(), ..row }]);
}
