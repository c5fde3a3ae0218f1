//! The folder of an observer's night, drawn small: three satellites, three filters, two cameras, calibration frames, damage, and
//! keywords that belong to another frame. `scripts/prove_observer_folder.sh` is the same with many frames.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use satphot::base::progress::Silent;
use satphot::pipeline::groups::{Groups, Night as Reduced, run_night};
use satphot::simulate::{Scenario, simulate};
use satphot::tables::{KeywordCheckRow, PhotometryRow, read_photometry, read_rows};

use crate::support::Night;

/// Drawn once for all tests.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("observer_folder");
    std::fs::remove_dir_all(&folder).ok();
    let sets = ["target.n=4", "pointings.n=6"].map(String::from);
    let scenario = Scenario::load(&root.join("scripts/observer_folder.toml"), &sets).unwrap();
    simulate(&scenario, &folder, &Silent).unwrap();
    folder
});

fn reduced(night: &Night) -> Groups {
    match run_night(&night.config().unwrap(), &night.options, &Silent).unwrap() {
        Reduced::Groups(groups) => groups,
        Reduced::Single(summary) => panic!("one group: {}", summary.brief()),
    }
}

fn rows_of(groups: &Groups) -> Vec<(String, PhotometryRow)> {
    let summaries = groups.reduced.iter().map(|r| r.summary.as_ref().unwrap());
    let rows = |folder: &Path| read_photometry(&folder.join("photometry.ecsv")).unwrap().0;
    summaries.flat_map(|s| rows(&s.folder).into_iter().map(|r| (s.night.clone(), r))).collect()
}

/// Standing and reason of a keyword of a frame.
fn checks(groups: &Groups) -> HashMap<(String, String), (String, String)> {
    let mut all = HashMap::new();
    for summary in groups.reduced.iter().map(|r| r.summary.as_ref().unwrap()) {
        let path = summary.folder.join("keyword_checks.ecsv");
        for row in read_rows::<KeywordCheckRow>(&path).unwrap().0 {
            all.insert((row.frame, row.keyword), (row.standing, row.reason));
        }
    }
    all
}

fn swap_cards(night: &Night, keyword: &str, first: &str, second: &str) {
    let of = |name: &str| {
        let bytes = std::fs::read(night.path(name)).unwrap();
        let at = (0..bytes.len() / 80)
            .map(|k| 80 * k)
            .find(|at| bytes[*at..].starts_with(format!("{keyword:<8}=").as_bytes()));
        (bytes, at.unwrap_or_else(|| panic!("{name} has no {keyword}")))
    };
    let ((mut a, at_a), (mut b, at_b)) = (of(first), of(second));
    a[at_a..at_a + 80].swap_with_slice(&mut b[at_b..at_b + 80]);
    std::fs::write(night.path(first), a).unwrap();
    std::fs::write(night.path(second), b).unwrap();
}

/// Magnitude of each target frame, in the band of its filter.
fn truth_of(path: &Path) -> HashMap<String, f64> {
    let text = std::fs::read_to_string(path).unwrap();
    let at = text.lines().next().unwrap().split(',').position(|c| c == "v_mag").unwrap();
    let row = |line: &str| Some((line.split(',').next()?.to_owned(), line.split(',').nth(at)?.parse().ok()?));
    text.lines().skip(1).filter_map(row).collect()
}

#[test]
fn every_magnitude_of_an_observers_folder_is_of_its_own_satellite_filter_and_camera() {
    let night = Night::copy_of(&FOLDER);
    for damaged in ["cdk_V_flat_002.fits", "cdk_iss_R_target_0002.fits"] {
        std::fs::File::options().write(true).open(night.path(damaged)).unwrap().set_len(20_000).unwrap();
    }
    let groups = reduced(&night);
    assert_eq!(groups.reduced.len(), 18, "{}", groups.text(false));
    let (truth, rows) = (truth_of(&FOLDER.join("truth/target.csv")), rows_of(&groups));
    let measured: Vec<&(String, PhotometryRow)> = rows.iter().filter(|(_, r)| truth.contains_key(&r.frame)).collect();
    assert_eq!(measured.len(), 71, "each frame once, but for the damaged one");
    for (group, row) in &measured {
        let (camera, rest) = row.frame.split_once('_').unwrap();
        let (satellite, rest) = rest.split_once('_').unwrap();
        let filter = rest.split_once('_').unwrap().0.replace("clear", "no-filter");
        let group = group.to_lowercase();
        assert!(group.contains(satellite) && group.contains(&filter.to_lowercase()), "{} in {group}", row.frame);
        assert_eq!(group.contains("qhy"), camera == "refractor", "{} in {group}", row.frame);
    }
    let damaged: Vec<&str> = groups.ungrouped.iter().map(|row| row.frame.as_str()).collect();
    assert_eq!(damaged, ["cdk_V_flat_002.fits", "cdk_iss_R_target_0002.fits"], "and the night goes on");
    let used: Vec<&PhotometryRow> =
        measured.iter().map(|(_, r)| r).filter(|r| r.verdict == "use" && r.status == "ok").collect();
    assert!(used.len() > 50, "{} of 71", used.len());
    for row in used {
        let err_mag = row.v_mag_err.unwrap().hypot(row.v_mag_err_sys.unwrap());
        let off_mag = row.v_mag.unwrap() - truth[&row.frame];
        assert!(off_mag.abs() < 4.0 * err_mag, "{}: {off_mag:+.3} +- {err_mag:.3}", row.frame);
    }
    // the pointing under the cloud is like one of another filter
    let checks = checks(&groups);
    let of = |frame: &str, keyword: &str| checks[&(frame.to_owned(), keyword.to_owned())].clone();
    let cloudy = of("cdk_V_field04_00.fits", "FILTER");
    assert!(cloudy.0 == "not_checkable" && cloudy.1.contains("clouds"), "{cloudy:?}");
    assert_eq!(of("cdk_V_field00_00.fits", "FILTER").0, "agrees");
    assert_eq!(of("cdk_iss_V_target_0000.fits", "FILTER").0, "not_checkable");
    assert_eq!(of("cdk_iss_V_target_0000.fits", "OBJECT").0, "agrees");
    assert!(!checks.values().any(|(standing, _)| standing == "deviates"), "{checks:#?}");
}

#[test]
fn swapped_keywords_are_noticed_where_the_data_show_them_and_listed_where_not() {
    let night = Night::copy_of(&FOLDER);
    swap_cards(&night, "FILTER", "cdk_V_field01_00.fits", "cdk_clear_field01_01.fits");
    swap_cards(&night, "FILTER", "cdk_V_flat_001.fits", "cdk_R_flat_001.fits");
    swap_cards(&night, "FILTER", "cdk_iss_V_target_0001.fits", "cdk_iss_R_target_0001.fits");
    swap_cards(&night, "INSTRUME", "cdk_R_field02_00.fits", "refractor_R_field02_00.fits");
    swap_cards(&night, "OBJECT", "cdk_starlink_V_target_0001.fits", "cdk_bluebird_V_target_0001.fits");
    let groups = reduced(&night);
    let (checks, rows) = (checks(&groups), rows_of(&groups));
    let standing =
        |frame: &str, keyword: &str| checks.get(&(frame.to_owned(), keyword.to_owned())).map(|(s, _)| s.as_str());
    let rejected =
        |frame: &str| rows.iter().any(|(_, r)| r.frame == frame && r.verdict == "reject" && !r.reason.is_empty());
    for frame in ["cdk_V_field01_00.fits", "cdk_clear_field01_01.fits", "cdk_V_flat_001.fits", "cdk_R_flat_001.fits"] {
        assert_eq!(standing(frame, "FILTER"), Some("deviates"), "{frame}");
        assert!(rejected(frame), "{frame}");
    }
    for frame in ["cdk_R_field02_00.fits", "refractor_R_field02_00.fits"] {
        assert!(rejected(frame) && standing(frame, "INSTRUME").is_none_or(|s| s == "deviates"), "{frame}");
    }
    for frame in ["cdk_starlink_V_target_0001.fits", "cdk_bluebird_V_target_0001.fits"] {
        assert!(rejected(frame) && standing(frame, "OBJECT") == Some("deviates"), "{frame}");
    }
    for frame in ["cdk_iss_V_target_0001.fits", "cdk_iss_R_target_0001.fits"] {
        assert_eq!(standing(frame, "FILTER"), Some("not_checkable"), "{frame}");
    }
}

/// One satellite of an unusual colour, seen by one camera in turn through V, R and no filter.
fn coloured() -> Night {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("coloured_satellite");
    std::fs::remove_dir_all(&folder).ok();
    let satellite =
        "target = { norad_cat_id = 61111, satellite = \"bluebird-fm1\", size_m = [16.0, 16.0], b_v_mag = 1.1 }";
    let sets = [
        "seed=11".to_owned(),
        "cameras=[]".to_owned(),
        format!("satellites=[{{ label = \"bluebird\", {satellite} }}]"),
        "target.n=12".to_owned(),
        "target.scatter_mag=0.02".to_owned(),
    ];
    let scenario = Scenario::load(&root.join("scripts/observer_folder.toml"), &sets).unwrap();
    simulate(&scenario, &folder, &Silent).unwrap();
    Night::copy_of(&folder)
}

#[test]
fn the_colour_of_a_satellite_is_measured_where_two_bands_saw_it_and_assumed_where_not() {
    let night = coloured();
    let groups = reduced(&night);
    for group in &groups.reduced {
        let z = &group.group.config.zeropoint;
        let (mag, err_mag) = (z.target_b_v_mag.unwrap(), z.target_b_v_err_mag.unwrap());
        assert!((mag - 1.1).abs() < 3.0 * err_mag && err_mag < 0.1, "{mag} +- {err_mag}");
        let from = z.target_b_v_from.as_ref().unwrap();
        assert!(from.contains("measured: V-R"), "{from}");
        let folder = &group.summary.as_ref().unwrap().folder;
        let text = std::fs::read_to_string(folder.join("photometry.ecsv")).unwrap();
        assert!(text.contains("target_colour_from") && text.contains("measured: V-R"), "{}", folder.display());
    }
    let truth_path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("coloured_satellite/truth/target.csv");
    let truth = truth_of(&truth_path);
    for (group, row) in rows_of(&groups) {
        let (Some(mag), "use") = (row.v_mag, row.verdict.as_str()) else { continue };
        // with the colour of the Sun the unfiltered frames would be 0.21 x 0.45 = 0.09 mag off
        let err_mag = row.v_mag_err.unwrap().hypot(row.v_mag_err_sys.unwrap());
        assert!((mag - truth[&row.frame]).abs() < 4.0 * err_mag, "{group} {}: {mag} {}", row.frame, truth[&row.frame]);
    }
    let table = std::fs::read_to_string(groups.folder.join("night.ecsv")).unwrap();
    assert_eq!(table.lines().filter(|l| l.contains("measured: V-R")).count(), 3, "{table}");
    // one band alone measures no colour, and an observer who states one is asked for no more
    let night = night.remove("bluebird_R").remove("R_");
    let groups = reduced(&night);
    assert!(groups.reduced.iter().all(|g| g.group.config.zeropoint.target_b_v_mag.is_none()));
    let table = std::fs::read_to_string(groups.folder.join("night.ecsv")).unwrap();
    assert!(table.contains("assumed: the Sun's") && !table.contains("measured:"), "{table}");
    let groups = reduced(&coloured().set("zeropoint.target_b_v_mag=0.9"));
    assert!(groups.reduced.iter().all(|g| g.group.config.zeropoint.target_b_v_mag == Some(0.9)));
}
