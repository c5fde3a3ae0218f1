//! Passes of a target that hardly any frame shows, in seeing that goes with the airmass: all of their frames are stacked.
#![allow(clippy::unwrap_used)]

use std::collections::HashMap;

use crate::support::{Night, simulated};

use satphot::tables::{PassStackRow, PhotometryRow, read_rows};

/// Three passes of a faint point, in fields larger than what is read around it.
const PASSES: &[&str] = &[
    "target.n=30",
    "frame.nx_px=480",
    "frame.ny_px=440",
    "pointings.n=6",
    "psf.airmass_exponent=0.6",
    "target.off_centre_arcsec=0.0",
    "target.offset_mag=3.4",
    "target.exptime_range_s=[0.3, 0.3]",
    "target.size_m=[2.0, 2.0]",
];

#[test]
fn frames_of_different_seeing_are_all_stacked() {
    let original = simulated("faint_passes", PASSES);
    let night = Night::copy_of(&original).set("target.search_radius_arcsec=40");
    night.run().unwrap();
    let mut truth = csv::Reader::from_path(original.join("truth").join("target.csv")).unwrap();
    let truth: Vec<HashMap<String, String>> = truth.deserialize().map(Result::unwrap).collect();
    let stack: Vec<PassStackRow> = read_rows(&night.result("pass_stack.ecsv")).unwrap().0;
    let passes: Vec<&PassStackRow> = stack.iter().filter(|r| r.bin == 0).collect();
    assert_eq!(passes.iter().map(|p| p.frames + p.frames_excluded).sum::<i64>(), 30, "{passes:?}");
    // excluded is what a trail crosses
    assert!(passes.iter().all(|p| p.frames_excluded <= 1), "{passes:?}");
    // seen in their sum alone, and right in each
    let mut pulls = Vec::new();
    for pass in passes.iter().filter(|p| p.place_from == "stack") {
        let in_it = |r: &PhotometryRow| r.date_mid >= pass.date_first && r.date_mid <= pass.date_last;
        for row in night.rows().iter().filter(|r| in_it(r) && r.forced_at == "pass") {
            let flux_e: f64 = truth.iter().find(|t| t["frame"] == row.frame).unwrap()["flux_e"].parse().unwrap();
            pulls.push((row.forced_flux_e.unwrap() - flux_e) / row.forced_flux_err_e.unwrap());
        }
    }
    let n = pulls.len() as f64;
    let mean = pulls.iter().sum::<f64>() / n;
    assert!(n >= 18.0 && mean.abs() < 4.0 / n.sqrt(), "{mean} of {n}: {pulls:?}");
}
