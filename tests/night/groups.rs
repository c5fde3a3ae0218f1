//! Nights of several satellites, filters and cameras: each group is what a night of its own gives, nothing is mixed, and a
//! folder of frames implies its configuration.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

use satphot::base::progress::Silent;
use satphot::config::ELEMENTS;
use satphot::pipeline::groups::{Groups, Night as Reduced, run_night};
use satphot::tables::read_photometry;

use super::filters::put_card;
use crate::support::{Night, set_card};

/// The night of the README, whose frames have no filter and one satellite.
fn demo() -> Night {
    Night::copy_of(&Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/night"))
}

fn elements(name: &str) -> &'static str {
    ELEMENTS.iter().find(|(known, _)| *known == name).unwrap().1
}

/// Both stations in one file of elements.
fn both_stations(night: Night) -> Night {
    let text = format!("{}\n{}", elements("iss-2025-june"), elements("css-2025-june"));
    night.file("iss-2025-june.tle", text)
}

/// Copies of all frames under names that begin with a letter, seen through a filter.
fn also_through(night: Night, filter: &str) -> Night {
    for kind in ["flat", "field", "target"] {
        for path in night.frames(kind) {
            let copy = night.path(&format!("{filter}_{}", path.file_name().unwrap().to_string_lossy()));
            std::fs::copy(path, &copy).unwrap();
            put_card(&copy, "FILTER", filter);
        }
    }
    night
}

/// The frames whose names begin as the simulator's, seen through V.
fn in_v(night: Night) -> Night {
    for kind in ["flat", "field", "target"] {
        night.frames(kind).iter().for_each(|path| put_card(path, "FILTER", "V"));
    }
    night
}

fn reduced(night: &Night) -> Groups {
    match run_night(&night.config().unwrap(), &night.options, &Silent).unwrap() {
        Reduced::Groups(groups) => groups,
        Reduced::Single(summary) => panic!("one group: {}", summary.brief()),
    }
}

/// Frame and magnitude of each row of a group.
fn magnitudes(folder: &Path) -> Vec<(String, Option<f64>)> {
    let rows = read_photometry(&folder.join("photometry.ecsv")).unwrap().0;
    rows.into_iter().map(|r| (r.frame.trim_start_matches("R_").to_owned(), r.v_mag)).collect()
}

fn folder_of(groups: &Groups, ending: &str) -> PathBuf {
    let found = groups.reduced.iter().filter_map(|r| r.summary.as_ref().ok()).find(|s| s.night.ends_with(ending));
    found.unwrap_or_else(|| panic!("no group {ending}")).folder.clone()
}

#[test]
fn two_filters_are_two_nights_and_neither_takes_frames_of_the_other() {
    // the colour of the Sun, and no other that two bands measure
    let grey = |night: Night| night.set("zeropoint.target_b_v_mag=0.65").set("zeropoint.target_b_v_err_mag=0.1");
    let alone = grey(in_v(demo()));
    let alone_summary = alone.run().unwrap();
    let night = grey(in_v(also_through(demo(), "R")));
    let text = std::fs::read_to_string(night.path("catalogue.csv")).unwrap();
    let at = text.lines().next().unwrap().split(',').position(|c| c == "Vmag").unwrap();
    let lines = text.lines().enumerate().map(|(k, line)| match k {
        0 => format!("{line},Rmag\n"),
        _ => format!("{line},{}\n", line.split(',').nth(at).unwrap()),
    });
    let night = night.file("catalogue.csv", lines.collect::<String>());
    let groups = reduced(&night);
    let names: Vec<&str> = groups.reduced.iter().map(|r| r.summary.as_ref().unwrap().night.as_str()).collect();
    assert_eq!(names, ["2025-06-13-R", "2025-06-13-V"]);
    let (v, r) = (folder_of(&groups, "-V"), folder_of(&groups, "-R"));
    assert_eq!(magnitudes(&v), magnitudes(&alone_summary.folder), "the frames in V as without those in R");
    // the catalogue says that R is V: the same numbers, of another band
    let close = |a: &[(String, Option<f64>)], b: &[(String, Option<f64>)]| {
        a.len() == b.len()
            && a.iter().zip(b).all(|(a, b)| a.0 == b.0 && (a.1.unwrap_or(0.0) - b.1.unwrap_or(0.0)).abs() < 0.05)
    };
    assert!(close(&magnitudes(&v), &magnitudes(&r)));
    let band = |r: &satphot::pipeline::groups::Reduced| {
        r.summary.as_ref().unwrap().zeropoint.as_ref().unwrap().band_name().to_owned()
    };
    assert_eq!(groups.reduced.iter().map(band).collect::<Vec<_>>(), ["R", "V"]);
    let residuals = |folder: &Path| {
        let rows = read_photometry(&folder.join("photometry.ecsv")).unwrap().0;
        rows.iter().filter_map(|r| r.residual_mag).collect::<Vec<f64>>()
    };
    let (of_v, of_r) = (residuals(&v), residuals(&r));
    assert!(of_v.len() > 20 && of_r.len() == of_v.len());
    // in sunlight, in the first pass, a target of V = R is fainter than a grey one by the V-R of the Sun (Willmer 2018)
    for (r, v) in of_r.iter().zip(&of_v).take(5) {
        assert!((r - v - 0.39).abs() < 0.05, "{r} {v}");
    }
    let table = std::fs::read_to_string(groups.folder.join("night.ecsv")).unwrap();
    assert_eq!(table.lines().filter(|l| l.starts_with("2025-06-13-")).count(), 6, "{table}");
    // one filter of several satellites
    let requested = both_stations(in_v(also_through(demo(), "R"))).set("input.filter=\"Johnson V\"");
    let split = satphot::pipeline::groups::split(&requested.config().unwrap(), &[], &requested.options.stop).unwrap();
    let names: Vec<&str> = split.groups.iter().map(|g| g.filter.as_str()).collect();
    assert!(split.groups.iter().all(|g| g.files.iter().all(|f| !f.to_string_lossy().contains("R_"))), "{names:?}");
    // again, with other threads: the same bytes, and nothing measured twice
    let mut night = night;
    night.options.jobs = 1;
    let again = reduced(&night);
    assert_eq!(std::fs::read_to_string(again.folder.join("night.ecsv")).unwrap(), table);
}

#[test]
fn frames_of_two_satellites_are_reduced_with_their_own_elements_and_models() {
    let night = both_stations(demo());
    let others: Vec<PathBuf> = night.frames("target").split_off(14);
    others.iter().for_each(|path| set_card(path, "OBJECT", Some("'CSS (TIANHE)'")));
    let groups = reduced(&night);
    let of = |name: &str| {
        let group = groups.reduced.iter().find(|r| r.group.satellite == name).unwrap();
        let rows = read_photometry(&group.summary.as_ref().unwrap().folder.join("photometry.ecsv")).unwrap().0;
        (group.group.config.model.is_some(), rows)
    };
    let ((iss_has_model, iss), (css_has_model, css)) = (of("ISS (ZARYA)"), of("CSS (TIANHE)"));
    assert!(iss_has_model && !css_has_model, "the model of [model] is that of the ISS alone");
    assert_eq!((iss.len(), css.len()), (14, 10));
    assert!(iss.iter().all(|r| r.norad_cat_id == Some(25544)) && css.iter().all(|r| r.norad_cat_id == Some(48274)));
    assert!(groups.notes.iter().any(|n| n.contains("CSS (TIANHE): measured without a model")), "{:?}", groups.notes);
    // a model by a pattern
    let text = std::fs::read_to_string(night.path("pipeline.toml")).unwrap();
    let night = night.file("pipeline.toml", text + "\n[[satellites]]\nobjects = [\"CSS*\"]\nmodel = \"iss\"\n");
    let groups = reduced(&night);
    assert!(groups.reduced.iter().all(|r| r.group.config.model.is_some()), "{:?}", groups.notes);
    // and one that is not known
    let text = std::fs::read_to_string(night.path("pipeline.toml")).unwrap();
    let night = night.file("pipeline.toml", text.replace("model = \"iss\"", "model = \"nosuch\""));
    let error = run_night(&night.config().unwrap(), &night.options, &Silent).unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("satellites.model"), "{error}");
}

#[test]
fn a_catalogue_of_elements_with_a_damaged_set_of_another_object_serves() {
    let iss = elements("iss-2025-june");
    let night = demo().file("iss-2025-june.tle", format!("OTHER\n1 30100U 98067A   25160.5  .0001\n{iss}"));
    let groups = run_night(&night.config().unwrap(), &night.options, &Silent).unwrap();
    let Reduced::Single(summary) = groups else { panic!("one satellite, one filter") };
    assert_eq!(summary.counts.targets, 24);
}

#[test]
fn frames_whose_object_names_no_satellite_of_several_are_assigned_by_position_or_reported() {
    let night = both_stations(demo()).card("target_000", "OBJECT", Some("'satellite'"));
    let night = night.set("frames.target=[\"target_*\"]");
    let notes = |night: &Night| {
        satphot::pipeline::groups::split(&night.config().unwrap(), &[], &Default::default()).unwrap().notes
    };
    let said = notes(&night);
    assert!(said.iter().any(|n| n.contains("10 frames are assigned to satellites by where")), "{said:?}");
    let Reduced::Single(summary) = run_night(&night.config().unwrap(), &night.options, &Silent).unwrap() else {
        panic!("one satellite")
    };
    assert_eq!(summary.counts.targets, 24);
    let rows = read_photometry(&summary.folder.join("photometry.ecsv")).unwrap().0;
    // the simulator points at the satellite
    assert!(rows.iter().all(|r| r.norad_cat_id == Some(25544) && r.pointing_sep_deg.is_some_and(|sep| sep < 0.01)));
    // a header that points elsewhere, or nowhere, says nothing
    let night = night.card("target_000", "CENTALT", Some("2.0"));
    let said = notes(&night);
    assert!(
        said.iter().any(|n| n.contains("10 target frames with OBJECT = 'satellite' are not used")
            && n.contains("from the nearest candidate")
            && n.contains("norad_cat_id")),
        "{said:?}"
    );
    let night = night.card("target_000", "CENTALT", None);
    let said = notes(&night);
    assert!(
        said.iter().any(|n| n.contains("10 target frames") && n.contains("does not say in its header")),
        "{said:?}"
    );
    // an alias assigns them
    let text = std::fs::read_to_string(night.path("pipeline.toml")).unwrap();
    let alias = "\n[[satellites]]\nobjects = [\"satellite\"]\nnorad_cat_id = 25544\nmodel = \"iss\"\n";
    let night = night.file("pipeline.toml", text + alias);
    let Reduced::Single(summary) = run_night(&night.config().unwrap(), &night.options, &Silent).unwrap() else {
        panic!("one satellite")
    };
    assert!(summary.counts.targets >= 14, "{}", summary.brief());
}

#[test]
fn frames_of_an_object_that_is_not_in_the_elements_are_of_the_satellite_they_follow() {
    let night = both_stations(demo());
    for (k, path) in night.frames("target").iter().enumerate() {
        set_card(path, "OBJECT", Some(if k < 14 { "'Space station'" } else { "'CSS (TIANHE)'" }));
    }
    let groups = reduced(&night);
    assert!(
        groups.notes.iter().any(|n| n.contains("14 frames with OBJECT = 'Space station'")
            && n.contains("follow ISS (ZARYA) [25544]")
            && n.contains("[[satellites]]")),
        "{:?}",
        groups.notes
    );
    let rows = read_photometry(&folder_of(&groups, "iss-zarya").join("photometry.ecsv")).unwrap().0;
    assert_eq!((rows.len(), rows.iter().filter(|r| r.v_mag.is_some()).count()), (14, 13), "{}", groups.text(false));
    assert!(groups.ungrouped.is_empty(), "{:?}", groups.ungrouped);
    // star frames stay where they are, so they are none of its
    assert!(!groups.notes.iter().any(|n| n.contains("field")), "{:?}", groups.notes);
}

#[test]
fn files_of_no_group_are_rows_and_count_as_failed() {
    let mut night = both_stations(demo());
    night.frames("target")[14..].iter().for_each(|path| set_card(path, "OBJECT", Some("'CSS (TIANHE)'")));
    let damaged = night.frames("target").remove(3);
    std::fs::write(&damaged, b"SIMPLE  = no FITS at all").unwrap();
    let groups = reduced(&night);
    let table = std::fs::read_to_string(groups.folder.join("ungrouped.ecsv")).unwrap();
    let name = damaged.file_name().unwrap().to_string_lossy().into_owned();
    assert!(table.lines().any(|l| l.starts_with(&name) && l.contains("failed")), "{table}");
    let text = groups.text(false);
    assert!(text.contains("1 file of no group, 1 cannot be read") && text.contains(&name), "{text}");
    assert!(groups.poor.is_none(), "{:?}", groups.poor);
    night.options.strict = true;
    let groups = reduced(&night);
    assert!(groups.poor.as_ref().is_some_and(|p| p.contains("belong to no group")), "{:?}", groups.poor);
    assert_eq!(groups.error().unwrap().exit_code(), 3);
}

#[test]
fn a_folder_of_frames_implies_its_configuration_and_what_is_missing() {
    let night = demo();
    std::fs::rename(night.path("pipeline.toml"), night.path("old.toml")).unwrap();
    std::fs::rename(night.path("iss-2025-june.tle"), night.path("elements.tle")).unwrap();
    let words = ["missing: aperture_m", "missing: pedestal_adu", "fetch elements --norad 25544 --date 2025-06-13"];
    let output = night.satphot(&["init", "."]).expect(0, &words);
    drop(output);
    let text = std::fs::read_to_string(night.path("pipeline.toml")).unwrap();
    for line in [
        "lat_deg = -33.7703",
        "focal_length_mm = 3962.0",
        "camera = \"asi6200mm\"",
        "pixel_um = 3.76",
        "input = [\".\"]",
    ] {
        assert!(text.lines().any(|l| l.starts_with(line)), "{line}\n{text}");
    }
    // what only the observer knows is asked for, not guessed
    night.satphot(&["run"]).expect(2, &["2 keys are missing", "aperture_m = nan", "pedestal_adu = nan"]);
    let filled = text
        .replace("# pedestal_adu = 500.0", "pedestal_adu = 500.0")
        .replace("# aperture_m = 0.3", "aperture_m = 0.61");
    let night = night.file("pipeline.toml", filled);
    let Reduced::Single(summary) = run_night(&night.config().unwrap(), &night.options, &Silent).unwrap() else {
        panic!("one group")
    };
    assert!(summary.counts.verdict_use >= 22, "{}", summary.brief());
    // never over a file that is there
    night.satphot(&["init", "."]).expect(2, &["pipeline.toml", "--force"]);
}

#[test]
fn frames_of_two_cameras_have_each_their_own_gain_and_zeropoint() {
    let night = demo();
    for kind in ["flat", "field", "target"] {
        for path in night.frames(kind) {
            let copy = night.path(&format!("b_{}", path.file_name().unwrap().to_string_lossy()));
            std::fs::copy(path, &copy).unwrap();
            set_card(&copy, "INSTRUME", Some("'QHY600M'"));
        }
    }
    let other = "\n[[instruments]]\nname = \"qhy\"\n[instruments.detector]\ncamera = \"QHY600M\"\npixel_um = 3.76\n\
                 pedestal_adu = 500.0\nuse_header_egain = true\n[instruments.detector.read_noise_e]\n100 = 3.3\n200 = 1.5\n\
                 250 = 1.5\n300 = 1.4\n";
    let text = std::fs::read_to_string(night.path("pipeline.toml")).unwrap();
    let night = night.file("pipeline.toml", text + other);
    let groups = reduced(&night);
    let counts: Vec<(String, usize, usize)> = groups
        .reduced
        .iter()
        .map(|r| {
            (
                r.group.instrument.clone(),
                r.summary.as_ref().unwrap().counts.targets,
                r.summary.as_ref().unwrap().counts.flats,
            )
        })
        .collect();
    assert_eq!(counts, [("asi6200mm".into(), 24, 5), ("qhy".into(), 24, 5)]);
}

#[test]
fn frames_of_one_camera_in_two_binnings_behind_two_telescopes_have_each_their_own_instrument() {
    let night = demo();
    for kind in ["flat", "field", "target"] {
        for path in night.frames(kind) {
            let copy = night.path(&format!("b_{}", path.file_name().unwrap().to_string_lossy()));
            std::fs::copy(path, &copy).unwrap();
            // half the binning behind half the focal length: the same scale
            [("XBINNING", "4"), ("FOCALLEN", "1981.0")].iter().for_each(|(k, v)| set_card(&copy, k, Some(v)));
        }
    }
    let (code, problem) = night.refusal();
    assert!(code == 2 && problem.contains("differ in binning") && problem.contains("[[instruments]]"), "{problem}");
    let other = "\n[[instruments]]\nname = \"binned\"\nbinning = 4\n[instruments.detector]\ncamera = \"asi6200mm\"\n\
                 pixel_um = 3.76\npedestal_adu = 500.0\n[instruments.telescope]\nname = \"short\"\naperture_m = 0.61\n\
                 focal_length_mm = 1981.0\n";
    let text = std::fs::read_to_string(night.path("pipeline.toml")).unwrap();
    let night = night.file("pipeline.toml", text + other);
    let groups = reduced(&night);
    let count = |name: &str| {
        let group = groups.reduced.iter().find(|r| r.group.instrument == name).unwrap();
        let counts = &group.summary.as_ref().unwrap().counts;
        (counts.targets, counts.flats, counts.set_aside)
    };
    assert_eq!((count("asi6200mm"), count("binned")), ((24, 5, 0), (24, 5, 0)), "{}", groups.text(false));
    assert_eq!(magnitudes(&folder_of(&groups, "asi6200mm")).len(), 24);
}
