//! The stars that trail through target frames: clouds are seen and corrected, the target's place is measured, a clock that is
//! wrong is found; and what does not fit gives nothing.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::HashMap;
use std::path::Path;

use satphot::base::progress::Silent;
use satphot::config::Config;
use satphot::photometry::Flags;
use satphot::pipeline::along_track::ahead_of_elements;
use satphot::pipeline::options::Options;
use satphot::pipeline::run::run;
use satphot::simulate::{Scenario, simulate};
use satphot::tables::{PhotometryRow, read_photometry};

/// A faint target, so that exposures are long; the stars that trail are in the catalogue.
const NIGHT: [&str; 6] = [
    "target.catalogue_trails=true",
    "target.offset_mag=9.0",
    "target.scatter_mag=0.0",
    "target.min_alt_deg=25.0",
    "field.catalogue_err_mag=0.02",
    "pointings.n=4",
];

fn simulated(folder: &Path, sets: &[&str]) {
    let sets: Vec<String> = NIGHT.iter().chain(sets).map(|s| (*s).to_string()).collect();
    simulate(&Scenario::crowded_night(&sets).unwrap(), folder, &Silent).unwrap();
}

fn reduced(folder: &Path, sets: &[&str], out: &str) -> Vec<PhotometryRow> {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_string()).collect();
    let mut config = Config::load(&folder.join("pipeline.toml"), &sets).unwrap();
    config.night.output = folder.join("satphot-out").join(out);
    let summary = run(&config, &Options { no_figures: true, ..Options::default() }, &Silent).unwrap();
    read_photometry(&summary.folder.join("photometry.ecsv")).unwrap().0
}

fn truth(folder: &Path) -> HashMap<String, HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(folder.join("truth").join("target.csv")).unwrap();
    let rows = reader.deserialize::<HashMap<String, String>>().map(Result::unwrap);
    rows.map(|row| (row["frame"].clone(), row)).collect()
}

#[test]
fn clouds_over_target_frames_are_flagged_and_corrected() {
    let folder = tempfile::tempdir().unwrap();
    simulated(
        folder.path(),
        &["seed=31", "target.n=10", "target.exptime_range_s=[0.4, 0.4]", "target.cloudy_frac=0.4"],
    );
    let (truth, rows) = (truth(folder.path()), reduced(folder.path(), &[], "night"));
    let (mut n, mut within, mut seen, mut missed, mut false_alarms) = (0, 0, 0, 0, 0);
    for row in &rows {
        let offset_and_err = row.frame_zp_offset_mag.zip(row.frame_zp_offset_err_mag);
        println!("{}: {offset_and_err:?}, {:?} {}", row.frame, row.frame_zp_stars, row.frame_zp_note);
        let Some((offset, err)) = offset_and_err else { continue };
        let cloud: f64 = truth[&row.frame]["cloud_mag"].parse().unwrap();
        n += 1;
        within += usize::from((offset - cloud).abs() < err);
        let flagged = Flags(row.flags).has(Flags::CLOUD);
        assert!((offset - cloud).abs() < 6.0 * err, "{}: {offset} +- {err}, put in {cloud}", row.frame);
        if cloud > 4.0 * err {
            seen += usize::from(flagged);
            missed += usize::from(!flagged);
        }
        false_alarms += usize::from(flagged && cloud == 0.0);
        if let (Some(v), Some(own)) = (row.frame_v_mag, row.v_mag) {
            assert!((own - offset - v).abs() < 1e-4 && row.v_mag_zeropoint == "night");
        }
    }
    println!(
        "{n} of {} frames, {within} within 1 sigma, {seen} clouds seen, {missed} not, {false_alarms} false",
        rows.len()
    );
    assert!(2 * n > rows.len(), "{n} of {} frames have an offset", rows.len());
    assert!(missed == 0 && false_alarms == 0 && seen >= 3, "{seen} {missed} {false_alarms}");
    // 68 %, three binomial deviations
    assert!((within as f64 / n as f64 - 0.683).abs() < 3.0 * (0.683 * 0.317 / n as f64).sqrt(), "{within} of {n}");
}

#[test]
fn a_clock_that_is_late_is_found_by_trail_ends() {
    let folder = tempfile::tempdir().unwrap();
    let night = [
        "seed=32",
        "target.n=20",
        "target.exptime_range_s=[0.06, 0.06]",
        "field.trail_stars_per_deg2=5000.0",
        "target.clock_err_s=0.25",
    ];
    simulated(folder.path(), &night);
    let rows = reduced(folder.path(), &[], "night");
    let found = ahead_of_elements(&rows).unwrap();
    for row in rows.iter().filter(|r| r.along_oc_arcsec.is_some()) {
        let rate = row.rate_deg_s.unwrap() * 3600.0;
        let [dt, err] = [row.along_oc_arcsec, row.along_oc_err_arcsec].map(|v| v.unwrap() / rate);
        println!("{}: {dt:.4} +- {err:.4} s, {} stars", row.frame, row.frame_zp_stars.unwrap_or(0));
    }
    println!("{found:?}");
    // the headers are late: the target is where it was before
    assert!((found.ahead_s + 0.25).abs() < 0.02 && found.n_frames >= 3, "{found:?}");
    for row in rows.iter().filter(|r| r.along_oc_arcsec.is_some()) {
        assert!(row.ra_deg.is_some() && row.dec_deg.is_some() && row.ra_err_arcsec.unwrap() < 3.0, "{row:?}");
        assert!(row.cross_oc_arcsec.unwrap().abs() < 5.0 * row.cross_oc_err_arcsec.unwrap() + 3.0, "{row:?}");
    }
}

#[test]
fn a_night_without_star_pointings_has_the_zeropoint_of_its_trails() {
    let folder = tempfile::tempdir().unwrap();
    simulated(folder.path(), &["seed=33", "target.n=8", "target.exptime_range_s=[0.4, 0.4]", "pointings.n=0"]);
    let (truth, rows) = (truth(folder.path()), reduced(folder.path(), &[], "night"));
    let mut n = 0;
    for row in rows.iter().filter(|r| r.v_mag_zeropoint == "trails") {
        let wanted: f64 = truth[&row.frame]["v_mag"].parse().unwrap();
        let err = row.v_mag_err.unwrap().hypot(row.v_mag_err_sys.unwrap());
        println!("{}: {:.3} +- {err:.3}, put in {wanted:.3}", row.frame, row.v_mag.unwrap());
        assert!((row.v_mag.unwrap() - wanted).abs() < 5.0 * err.max(0.05), "{}: {:?}", row.frame, row.v_mag);
        n += 1;
    }
    assert!(n >= 3, "{n} of {} frames", rows.len());
}

#[test]
fn trails_of_stars_that_are_in_no_catalogue_give_nothing_and_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let night = ["seed=34", "target.n=8", "target.exptime_range_s=[0.4, 0.4]", "target.catalogue_trails=false"];
    simulated(folder.path(), &night);
    for row in reduced(folder.path(), &[], "night").iter().filter(|r| r.status == "ok") {
        assert!(row.frame_zp_offset_mag.is_none() && row.cross_oc_arcsec.is_none(), "{row:?}");
        assert!(row.frame_zp_note.contains("catalogue"), "{}", row.frame_zp_note);
    }
}
