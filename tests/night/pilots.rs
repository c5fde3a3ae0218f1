//! Frames between the pilots of a pass: looked at where the target stands, found as before, and found where it is displaced.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::HashMap;

use crate::support::{self, Night, simulated};

use satphot::photometry::Flags;
use satphot::tables::PhotometryRow;
use satphot::tables::words::Verdict;

/// Three passes of fifteen frames.
pub const PASSES: &[&str] = &["target.n=45", "frame.nx_px=240", "frame.ny_px=200", "target.off_centre_arcsec=1.0"];

/// Places of the truth \[px\] and magnitudes, by frame.
fn truth(night: &std::path::Path) -> HashMap<String, [f64; 3]> {
    let mut reader = csv::Reader::from_path(night.join("truth").join("target.csv")).unwrap();
    let rows: Vec<HashMap<String, String>> = reader.deserialize().map(Result::unwrap).collect();
    let numbers = |row: &HashMap<String, String>| ["x_px", "y_px", "v_mag"].map(|key| row[key].parse().unwrap());
    rows.iter().map(|row| (row["frame"].clone(), numbers(row))).collect()
}

#[test]
fn between_the_pilots_of_a_pass_the_target_is_looked_for_where_it_stands() {
    let original = simulated("pilots", PASSES);
    let (truth, night) = (truth(&original), Night::copy_of(&original));
    night.run().unwrap();
    let before = night.rows();
    let whole_px = before.iter().filter_map(|r| r.search_radius_px).fold(0.0, f64::max);
    let mut narrow = Vec::new();
    for row in before.iter().filter(|r| r.search_radius_px < Some(0.5 * whole_px)) {
        let [x, y, v_mag] = truth[&row.frame];
        let off_px = (row.x_px.unwrap() - x).hypot(row.y_px.unwrap() - y);
        assert!(off_px < 10.0, "{}: {off_px}", row.frame);
        let err_mag = row.v_mag_err.unwrap().hypot(row.v_mag_err_sys.unwrap());
        assert!((row.v_mag.unwrap() - v_mag).abs() < 5.0 * err_mag, "{}: {:?} {v_mag}", row.frame, row.v_mag);
        narrow.push(row.frame.clone());
    }
    // of three passes of fifteen, each with five pilots
    assert!((18..=36).contains(&narrow.len()), "{narrow:?}");

    // displaced by 50 px in one of them: found all the same, in all of the region, and no other row changes
    let displaced = &narrow[narrow.len() / 2];
    support::shift(&night.path(displaced), 240, 50);
    night.run().unwrap();
    for (row, was) in night.rows().iter().zip(&before) {
        if row.frame == *displaced {
            let [x, y, _] = truth[displaced];
            let off_px = (row.x_px.unwrap() - x - 50.0).hypot(row.y_px.unwrap() - y);
            assert!(off_px < 10.0 && row.search_radius_px == Some(whole_px), "{off_px} {:?}", row.search_radius_px);
            // it may as well be another object
            assert!(Flags(row.flags).has(Flags::UNCONFIRMED) && row.verdict != Verdict::Use, "{row:?}");
            assert!(row.reason.contains("from where the other frames of the pass show the target"), "{}", row.reason);
        } else {
            assert_eq!((&row.frame, row.x_px, row.flux_e), (&was.frame, was.x_px, was.flux_e));
            assert!(!Flags(row.flags).has(Flags::UNCONFIRMED), "{row:?}");
        }
    }

    // without pilots that show the target nothing is known beforehand
    let pilot = |k: usize| k.is_multiple_of(3);
    let frames = night.frames("target");
    frames.iter().enumerate().filter(|(k, _)| pilot(*k)).for_each(|(_, path)| support::fill(path, 1_000));
    night.run().unwrap();
    assert!(night.rows().iter().all(|r| r.search_radius_px.is_none_or(|r| r == whole_px)));
}

#[test]
fn a_trail_that_joins_the_target_is_cut_off_where_the_pilots_show_no_target() {
    let bright = [PASSES, &["target.offset_mag=-3.0"]].concat();
    let original = simulated("pilots_trails", &bright);
    let (truth, night) = (truth(&original), Night::copy_of(&original));
    night.run().unwrap();
    let half_px = |r: &PhotometryRow| r.aper_a_px.or(r.aper_r_px).unwrap_or(f64::NAN);
    let bright = |r: &&PhotometryRow| r.verdict == Verdict::Use && r.snr > Some(40.0) && half_px(r) < 25.0;
    let before: Vec<PhotometryRow> = night.rows().into_iter().filter(|r| bright(&r)).collect();
    assert!(before.len() >= 8, "{} bright frames", before.len());
    // every fourth of them, pilots too, with a trail that ends at the edge of the target
    let joined: Vec<&PhotometryRow> = before.iter().step_by(4).collect();
    for row in &joined {
        let [x, y, _] = truth[&row.frame];
        let theta = 35f64.to_radians();
        let (dx, dy) = (6.0 * theta.cos(), 6.0 * theta.sin());
        support::trail(&night.path(&row.frame), 240, (x + dx, y + dy), theta, (85.0, 3.6), 300.0);
    }
    night.run().unwrap();
    let (mut n_cut, n_joined, rows) = (0, joined.len(), night.rows());
    for was in joined {
        let row = rows.iter().find(|r| r.frame == was.frame).unwrap();
        let off_mag = row.v_mag.unwrap_or(f64::NAN) - was.v_mag.unwrap();
        // never wrong without a word
        assert!(
            row.verdict != Verdict::Use || off_mag.abs() < 5.0 * row.v_mag_err.unwrap().hypot(was.v_mag_err.unwrap()),
            "{}: {off_mag} {}",
            row.frame,
            row.reason
        );
        if half_px(row) < 1.6 * half_px(was) {
            n_cut += 1;
            assert!(off_mag.abs() < 0.3, "{}: {off_mag} {}", row.frame, row.reason);
        }
    }
    assert!(2 * n_cut >= n_joined, "{n_cut} of {n_joined} are as large as before");
}

#[test]
fn another_object_in_one_frame_is_unconfirmed_and_the_light_at_the_place_of_the_pass_is_measured_all_the_same() {
    let faint = [PASSES, &["target.offset_mag=0.5", "target.size_m=[3.0, 3.0]"]].concat();
    let original = simulated("pilots_another", &faint);
    let (truth, night) = (truth(&original), Night::copy_of(&original));
    night.run().unwrap();
    let before = night.rows();
    // the faintest of the pilots, so that a bright object is taken for the target
    let pilots = before.iter().step_by(3).filter(|r| r.verdict == Verdict::Use && r.snr.is_some());
    let was = pilots.min_by(|a, b| a.snr.partial_cmp(&b.snr).unwrap()).unwrap();
    let [x, y, _] = truth[&was.frame];
    support::trail(&night.path(&was.frame), 240, (x - 30.0, y), 0.0, (0.0, was.fwhm_px.unwrap()), 12_000.0);
    night.run().unwrap();
    let row = night.row(&was.frame);
    assert!((row.x_px.unwrap() - x + 30.0).abs() < 3.0, "{x} {row:?}");
    assert!(Flags(row.flags).has(Flags::UNCONFIRMED) && row.verdict == Verdict::Caution, "{row:?}");
    assert_eq!(row.forced_at, "pass");
    let (light, err) = (row.forced_flux_e.unwrap(), row.forced_flux_err_e.unwrap());
    assert!(
        (light - was.forced_flux_e.unwrap()).abs() < 4.0 * err.hypot(was.forced_flux_err_e.unwrap()),
        "{light} {err}"
    );
}
