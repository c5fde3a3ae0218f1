//! Frames of another instrument than the configured one: another focal length, camera, binning, gain setting. None of them
//! passes as a result, and none of them costs results that were there.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::support::{Night, TARGETS, replace_card, satphot, set_card, simulated};

/// The focal length of the simulated telescope \[mm\].
const TRUE_MM: f64 = 3962.0;

fn original() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| simulated("instrument_night", &[]))
}

fn night() -> Night {
    Night::copy_of(original())
}

fn without_wcs(night: Night) -> Night {
    let none = |n: Night, card: &str| n.card("field", card, None);
    ["CTYPE1", "CTYPE2", "CD1_1", "CD1_2", "CD2_1", "CD2_2"].into_iter().fold(night, none)
}

fn with_focal(mut night: Night, mm: f64) -> Night {
    night.sets.retain(|s| !s.starts_with("telescope.focal_length_mm"));
    night.set(&format!("telescope.focal_length_mm={mm:?}"))
}

/// Every file below a folder with its bytes, but for what is kept of frames and for the lock.
fn bytes_of(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true if path.ends_with(".satphot") => {}
            true => all.extend(bytes_of(&path)),
            false => all.push((path.clone(), std::fs::read(&path).unwrap())),
        }
    }
    all.sort();
    all
}

/// The focal length a refusal proposes \[mm\].
fn proposed_mm(message: &str) -> f64 {
    let after = message.split("set telescope.focal_length_mm = ").nth(1).unwrap_or_else(|| panic!("{message}"));
    after.split([',', ' ']).next().unwrap().parse().unwrap()
}

fn refused_scale(night: &Night, configured_mm: f64) {
    let (code, message) = night.refusal();
    assert_eq!(code, 2, "{message}");
    let configured = format!("= {configured_mm} with");
    for word in [configured.as_str(), "arcsec/px", "telescope.check_scale = false"] {
        assert!(message.contains(word), "{word} is not in: {message}");
    }
    let right = proposed_mm(&message) / TRUE_MM;
    assert!((right - 1.0).abs() < 0.005, "{message}");
}

#[test]
fn a_wrong_focal_length_is_refused_with_the_right_one_and_the_results_that_were_there_stay() {
    let mut night = night();
    night.run().unwrap();
    let before = bytes_of(&night.path("satphot-out"));
    assert!(before.iter().any(|(path, _)| path.ends_with("master_flat.fits")));
    for mm in [3500.0, 2000.0, 400.0, 3.962] {
        night = with_focal(night, mm);
        refused_scale(&night, mm);
    }
    assert!(bytes_of(&night.path("satphot-out")) == before, "a refused run changed a result");
    // the proposal mends it
    night = with_focal(night, 3500.0);
    let mm = proposed_mm(&night.refusal().1);
    night = with_focal(night, mm);
    assert!(night.run().unwrap().counts.ok > 3);
}

#[test]
fn a_wrong_focal_length_is_found_out_without_world_coordinates_too() {
    let mut night = without_wcs(night()).card("", "FOCALLEN", None).card("", "XPIXSZ", None);
    for mm in [3500.0, 2000.0, 400.0, 3.962] {
        night = with_focal(night, mm);
        refused_scale(&night, mm);
    }
    assert!(!night.result("photometry.ecsv").exists());
    night = with_focal(night, 3930.0);
    assert!(night.run().unwrap().zeropoint.is_some());
}

#[test]
fn two_percent_are_allowed_and_the_nominal_values_of_headers_only_warn() {
    let mut night = night();
    night = with_focal(night, 3930.0);
    let summary = night.run().unwrap();
    assert!(
        summary.poor_error().is_none() && !summary.notes.iter().any(|n| n.contains("FOCALLEN")),
        "{:?}",
        summary.notes
    );
    // 3800 mm in the headers, 3962 mm by the stars
    night = with_focal(night, TRUE_MM).card("", "FOCALLEN", Some("3800.0"));
    let summary = night.run().unwrap();
    assert!(summary.counts.ok > 3 && summary.counts.set_aside == 0, "{:?}", summary.counts);
    let warned =
        summary.notes.iter().find(|n| n.contains("FOCALLEN = 3800")).unwrap_or_else(|| panic!("{:?}", summary.notes));
    assert!(warned.contains("focal_length_mm = 3962") && warned.contains("4.3 %"), "{warned}");
    // even 50 % off while the stars say otherwise
    night = night.card("", "FOCALLEN", Some("2000.0"));
    assert!(night.run().unwrap().counts.ok > 3);
}

#[test]
fn without_stars_nominal_values_far_off_are_refused_and_near_ones_warn() {
    let with_stars = night();
    with_stars.run().unwrap();
    let zeropoint = with_stars.text("zeropoint.toml");
    let mut night =
        night().remove("field").without_table("stars").file("zp.toml", zeropoint).set("zeropoint.previous=zp.toml");
    night
        .sets
        .iter_mut()
        .for_each(|s| *s = s.replace("zp.toml", &with_stars.result("zeropoint.toml").display().to_string()));
    for mm in [2000.0, 400.0] {
        night = with_focal(night, mm);
        refused_scale(&night, mm);
    }
    night = with_focal(night, 3500.0);
    let summary = night.run().unwrap();
    assert!(summary.notes.iter().any(|n| n.contains("FOCALLEN = 3962")), "{:?}", summary.notes);
}

#[test]
fn a_configured_scale_may_be_used_all_the_same_when_that_is_said() {
    let night = with_focal(night(), 3500.0).set("telescope.check_scale=false");
    let summary = night.run().unwrap();
    let message = summary.notes.iter().find(|n| n.contains("telescope.check_scale = false")).unwrap();
    assert!(message.contains("11.") && message.contains("arcsec/px"), "{message}");
}

#[test]
fn another_camera_is_refused_by_both_names_and_one_of_another_name_is_not() {
    let night = night().card("", "INSTRUME", Some("'ZWO ASI183MM Pro'"));
    let (code, message) = night.refusal();
    assert_eq!(code, 2, "{message}");
    for word in ["detector.camera", "asi6200mm", "ZWO ASI183MM Pro", "header.check_camera"] {
        assert!(message.contains(word), "{word} is not in: {message}");
    }
    let message = night.set("header.check_camera=false").run().unwrap();
    assert!(
        message.notes.iter().any(|n| n.contains("ASI183MM") && n.contains("another camera")),
        "{:?}",
        message.notes
    );
    for name in ["'ZWO ASI6200MM Pro'", "'ZWO CCD ASI6200MM Pro'", "'ASI Camera (1)'"] {
        let summary = self::night().card("", "INSTRUME", Some(name)).run().unwrap();
        let warned = summary.notes.iter().any(|n| n.contains("names no model"));
        assert!(summary.counts.ok > 3 && summary.counts.set_aside == 0 && warned == name.contains("(1)"), "{name}");
    }
}

#[test]
fn the_few_frames_that_differ_from_the_rest_are_rows_with_a_reason() {
    let reference = night();
    std::fs::remove_file(reference.path(TARGETS[2])).unwrap();
    reference.run().unwrap();
    for (keyword, value, words) in [
        ("INSTRUME", "'QHY600M'", ["QHY600M", "asi6200mm"]),
        ("XBINNING", "4", ["binning 4", "8 in 5 of 6"]),
        ("FOCALLEN", "2000.0", ["2000 mm", "3962 mm in 5 of 6"]),
    ] {
        let night = night();
        set_card(&night.path(TARGETS[2]), keyword, Some(value));
        let summary = night.run().unwrap();
        assert_eq!(summary.counts.set_aside, 1, "{keyword}");
        assert!(summary.text().contains("1 set aside"), "{}", summary.text());
        let row = night.row(TARGETS[2]);
        assert_eq!((row.status.as_str(), row.verdict.as_str(), row.v_mag), ("rejected", "reject", None));
        for word in words {
            assert!(row.reason.contains(word), "{word} is not in: {}", row.reason);
        }
        night.same_tables_but_for(&[TARGETS[2]], &reference);
        let verified = night.satphot(&["verify", "satphot-out/tiny"]);
        assert_eq!(verified.code, 0, "{verified:#?}");
    }
    // a read-out mode that one frame does not share, a flat of another camera
    let night = night();
    for path in night.frames("").iter() {
        let mode = if path.ends_with(TARGETS[1]) { "High Speed" } else { "Default" };
        replace_card(path, "SIMSEED", &format!("READOUTM= '{mode}'"));
    }
    set_card(&night.path("flat_001.fits"), "INSTRUME", Some("'QHY600M'"));
    let summary = night.run().unwrap();
    assert_eq!((summary.counts.set_aside, summary.counts.flats), (2, 3), "{:?}", summary.notes);
    assert!(
        night.row(TARGETS[1]).reason.contains("'High Speed', but 'Default' in 5 of 6"),
        "{}",
        night.row(TARGETS[1]).reason
    );
    assert!(night.row("flat_001.fits").reason.contains("QHY600M"));
}

#[test]
fn frames_half_of_one_binning_and_half_of_another_are_refused_with_both() {
    let night = night();
    TARGETS[..3].iter().for_each(|t| set_card(&night.path(t), "XBINNING", Some("4")));
    let (code, message) = night.refusal();
    assert_eq!(code, 2, "{message}");
    for word in ["target frames", "4 (3 frames)", "8 (3 frames)", "frames.ignore"] {
        assert!(message.contains(word), "{word} is not in: {message}");
    }
}

#[test]
fn a_wrong_binning_in_every_header_is_found_out_by_the_stars() {
    let (code, message) =
        night().card("", "XBINNING", Some("4")).card("", "XPIXSZ", None).card("", "FOCALLEN", None).refusal();
    assert_eq!(code, 2, "{message}");
    assert!(message.contains("factor of 2") && message.contains("XBINNING"), "{message}");
}

#[test]
fn an_exposure_time_of_zero_is_taken_from_exposure_and_said() {
    let reference = night();
    let truth = reference.run().unwrap().counts.ok;
    let night = night();
    for path in night.frames("target") {
        let header = std::fs::read(&path).unwrap();
        let cards = String::from_utf8_lossy(&header[..5760]).into_owned();
        let at = cards.find("EXPTIME =").unwrap();
        let value = cards[at + 10..at + 30].trim().to_string();
        set_card(&path, "EXPTIME", Some("0.0"));
        replace_card(&path, "SIMSEED", &format!("EXPOSURE= {value:>20}"));
    }
    let summary = night.run().unwrap();
    assert_eq!(summary.counts.ok, truth);
    assert!(summary.notes.iter().any(|n| n.contains("EXPTIME = 0 s") && n.contains("EXPOSURE")), "{:?}", summary.notes);
    for (a, b) in night.rows().iter().zip(reference.rows()) {
        assert_eq!((a.exptime_s, a.v_mag), (b.exptime_s, b.v_mag), "{}", a.frame);
    }
}

#[test]
fn a_cube_of_seventeen_planes_is_a_row_that_calls_it_a_cube() {
    let night = night();
    let path = night.path(TARGETS[3]);
    set_card(&path, "NAXIS", Some("3"));
    // NAXIS3 must follow NAXIS2: EXTEND stands there
    replace_card(&path, "EXTEND", "NAXIS3  =                   17");
    let mut bytes = std::fs::read(&path).unwrap();
    bytes.resize(bytes.len() + 16 * 160 * 120 * 2 + 2880, 0);
    bytes.truncate(bytes.len() / 2880 * 2880);
    std::fs::write(&path, bytes).unwrap();
    night.run().unwrap();
    let reason = night.row(TARGETS[3]).reason;
    assert!(reason.contains("a cube of 17 planes") && !reason.contains("colour"), "{reason}");
    let message = satphot(night.path("").as_path(), &["inspect", TARGETS[3]]);
    assert!(message.out.contains("cube of 17 planes") && !message.out.contains("colour sensor"), "{}", message.out);
}

#[test]
fn the_gain_setting_of_most_observers_of_this_camera_is_in_its_table() {
    let sets = ["pointings.gain_settings=[100]", "target.gain_settings=[100]", "flats.gain_setting=100"];
    let night = Night::copy_of(&simulated("instrument_gain_100", &sets));
    let summary = night.run().unwrap();
    assert!(summary.poor_error().is_none() && summary.counts.ok > 3, "{:?}", summary.counts);
    let z = summary.zeropoint.unwrap();
    assert!((z.zp_mag + 23.37).abs() < 5.0 * z.cov[0][0].sqrt() + 0.02, "{z:?}");
}

#[test]
fn a_dry_run_lists_every_missing_key_with_lines_that_mend_it_and_ends_as_the_run() {
    let night = night().card("field", "GAIN", Some("120")).card("target", "GAIN", Some("130"));
    let dry = night.satphot(&["run", "--dry-run"]);
    let run = night.satphot(&["run", "-q"]);
    assert_eq!((dry.code, run.code), (5, 5), "{dry:#?}");
    assert!(!night.result("photometry.ecsv").exists());
    let lines = dry.out.split("lines to paste into pipeline.toml:\n").nth(1).unwrap();
    for word in [
        "[detector.e_per_adu]\n\"120\" = ",
        "\n\"130\" = ",
        "[detector.read_noise_e]\n\"120\" = ",
        "# EGAIN of 9 frames",
    ] {
        assert!(lines.contains(word), "{word} is not in\n{lines}");
        assert!(run.err.contains(word), "{word} is not in\n{}", run.err);
    }
    let toml = std::fs::read_to_string(night.path("pipeline.toml")).unwrap();
    let night = night.file("pipeline.toml", format!("{toml}\n{lines}"));
    night.satphot(&["run", "--dry-run"]).expect(0, &[]);
    night.satphot(&["run", "-q"]).expect(0, &[]);
}

#[test]
fn a_dry_run_makes_the_checks_of_the_run_and_ends_with_its_exit_code() {
    type Change = fn(Night) -> Night;
    let changes: [(&str, Change); 8] = [
        ("as it is", |n| n),
        ("focal length", |n| with_focal(n, 3500.0)),
        ("focal length far off", |n| with_focal(n, 3.962)),
        ("camera", |n| n.card("", "INSTRUME", Some("'ZWO ASI183MM Pro'"))),
        ("binning", |n| {
            TARGETS[..3].iter().for_each(|t| set_card(&n.path(t), "XBINNING", Some("4")));
            n
        }),
        ("unknown camera", |n| n.set("detector.camera=qhy9")),
        ("catalogue columns", |n| n.file("catalogue.csv", "id,magnitude\n1,12.0\n")),
        ("zeropoint of another night", |n| n.set("zeropoint.previous=none.toml")),
    ];
    for (name, change) in changes {
        let night = change(night());
        let sets: Vec<&str> = night.sets.iter().flat_map(|s| ["--set", s.as_str()]).collect();
        let with = |first: &[&'static str]| -> Vec<String> {
            first.iter().map(ToString::to_string).chain(sets.iter().map(ToString::to_string)).collect()
        };
        let message = |args: Vec<String>| night.satphot(&args.iter().map(String::as_str).collect::<Vec<_>>());
        let (dry, run) = (message(with(&["run", "--dry-run"])), message(with(&["run", "-q", "--no-figures"])));
        assert_eq!(dry.code, run.code, "{name}: {}\n{}", dry.err, run.err);
        assert_eq!(dry.code == 0, name == "as it is", "{name}: {}", dry.err);
        if dry.code != 0 {
            assert_eq!(dry.err, run.err, "{name}");
        }
    }
}
