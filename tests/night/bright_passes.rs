//! Passes whose frames show the target clearly, each at a place of its own: their stack is no worse than its frames.
#![allow(clippy::unwrap_used)]

use crate::support::{self, Night, simulated};

use satphot::tables::{PassStackRow, PhotometryRow, read_rows};

/// Three passes of a bright target, smaller than the seeing, that is not kept in the middle.
const PASSES: &[&str] = &[
    "target.n=24",
    "frame.nx_px=480",
    "frame.ny_px=440",
    "target.off_centre_arcsec=12.0",
    "target.offset_mag=-4.5",
    "target.exptime_range_s=[0.1, 0.1]",
    "target.size_m=[4.0, 4.0]",
];

/// The stack of each pass against what its own frames show; how many passes are averages of their frames.
fn check(night: &Night) -> usize {
    let mut n_of_frames = 0;
    let rows = night.rows();
    let stack: Vec<PassStackRow> = read_rows(&night.result("pass_stack.ecsv")).unwrap().0;
    let passes: Vec<&PassStackRow> = stack.iter().filter(|r| r.bin == 0 && r.frames >= 4).collect();
    assert!(!passes.is_empty(), "{stack:?}");
    for pass in passes {
        let in_it = |r: &&PhotometryRow| r.date_mid >= pass.date_first && r.date_mid <= pass.date_last;
        let seen: Vec<&PhotometryRow> =
            rows.iter().filter(in_it).filter(|r| r.verdict != "reject" && r.v_mag.is_some()).collect();
        let own: Vec<&&PhotometryRow> = seen.iter().filter(|r| r.snr > Some(50.0)).collect();
        let flux = |r: &&PhotometryRow| 10f64.powf(-0.4 * r.v_mag.unwrap());
        let (faintest, brightest) =
            seen.iter().map(flux).fold((f64::INFINITY, 0.0f64), |(low, high), f| (low.min(f), high.max(f)));
        let v_mag = pass.v_mag.unwrap();
        let mean = 10f64.powf(-0.4 * v_mag);
        assert!(faintest < mean && mean < brightest, "{pass:?}: {mean} of {faintest} to {brightest}");
        assert!(pass.v_mag_err < Some(0.05) && pass.snr > Some(100.0), "{pass:?}");
        n_of_frames += usize::from(pass.place_from == "frames");
        for row in own.into_iter().filter(|r| r.disc_fwhm2.is_none()) {
            let (flux_e, err_e) = (row.forced_flux_e.unwrap(), row.forced_flux_err_e.unwrap());
            let whole = row.flux_e.unwrap() * 10f64.powf(-0.4 * row.aper_corr_mag.unwrap_or(0.0));
            assert!((flux_e / whole - 1.0).abs() < 1e-9 && err_e > 0.0, "{row:?}");
            assert_eq!(row.forced_at, "detection");
        }
    }
    n_of_frames
}

#[test]
fn a_pass_of_bright_displaced_targets_is_no_worse_than_its_frames() {
    let original = simulated("bright_passes", PASSES);
    let night = Night::copy_of(&original);
    night.run().unwrap();
    assert!(check(&night) >= 1);
    // without a target in one frame of each pass: the others are what they were
    for frame in night.frames("target").iter().step_by(8) {
        support::fill(frame, 1_000);
    }
    night.run().unwrap();
    check(&night);
}
