//! The zeropoint of another night: its age and its extra error are columns, and a file of the same night is none of another.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use satphot::photometry::Flags;
use satphot::tables::PhotometryRow;
use support::{Night, TARGETS, simulated};

/// A night without its star pointings but with the zeropoint they gave, edited, and its rows with those of the whole night.
fn with_previous(
    name: &str,
    edit: impl Fn(&str) -> String,
    set: &str,
) -> (Vec<(PhotometryRow, PhotometryRow)>, Vec<String>) {
    let original = simulated(name, &[]);
    // with a width of its own, since without stars that at the airmass of a target is not known
    let whole = Night::copy_of(&original).set("photometry.fwhm_px=3.6");
    whole.run().unwrap();
    let zeropoint: String = whole.text("zeropoint.toml").lines().map(|line| edit(line) + "\n").collect();
    let n = Night::copy_of(&original)
        .remove("field")
        .file("before.toml", zeropoint)
        .set("zeropoint.previous=before.toml")
        .set("photometry.fwhm_px=3.6")
        .set(set);
    let summary = n.run().unwrap();
    let rows = TARGETS.iter().map(|frame| (whole.row(frame), n.row(frame))).collect();
    (rows, summary.notes)
}

/// The line `mjd_mean_d` moved by `days`; every other line as it is.
fn moved(line: &str, days: f64) -> String {
    let Some(value) = line.strip_prefix("mjd_mean_d = ") else { return line.to_owned() };
    let mjd: f64 = value.split_whitespace().next().unwrap().parse().unwrap();
    format!("mjd_mean_d = {:?}", mjd + days)
}

#[test]
fn a_zeropoint_of_another_night_has_its_age_and_extra_error_in_every_row() {
    let (rows, notes) = with_previous("previous_old", |line| moved(line, -3.0), "zeropoint.previous_err_mag=0.04");
    for (own, other) in &rows {
        assert!((own.v_mag.unwrap() - other.v_mag.unwrap()).abs() < 1e-9);
        assert_eq!((own.zp_age_d, own.zp_extra_err_mag), (None, None));
        assert_eq!(other.zp_extra_err_mag, Some(0.04));
        // the stars were measured within hours of the target
        assert!((other.zp_age_d.unwrap() - 3.0).abs() < 0.5, "{:?}", other.zp_age_d);
        // in quadrature
        let want = own.v_mag_err_sys.unwrap().hypot(0.04);
        assert!((other.v_mag_err_sys.unwrap() - want).abs() < 1e-9, "{other:?}");
        assert!(Flags(other.flags).has(Flags::OTHER_ZEROPOINT) && !Flags(own.flags).has(Flags::OTHER_ZEROPOINT));
    }
    assert!(
        notes.iter().any(|n| n.contains("another night") && n.contains("0.04 mag") && n.contains("6 frames")),
        "{notes:?}"
    );
}

#[test]
fn a_zeropoint_of_the_same_night_adds_nothing() {
    let (rows, notes) = with_previous("previous_same", |line| moved(line, 0.0), "zeropoint.previous_err_mag=0.04");
    for (own, other) in &rows {
        assert_eq!((other.zp_age_d, other.zp_extra_err_mag), (None, None));
        assert!((own.v_mag_err_sys.unwrap() - other.v_mag_err_sys.unwrap()).abs() < 1e-9);
        assert!(!Flags(other.flags).has(Flags::OTHER_ZEROPOINT));
    }
    assert!(!notes.iter().any(|n| n.contains("another night")), "{notes:?}");
}

#[test]
fn a_zeropoint_of_unknown_age_adds_its_error_and_says_so() {
    let forget = |line: &str| if line.starts_with("mjd_mean_d") { String::new() } else { line.to_owned() };
    let (rows, notes) = with_previous("previous_unknown", forget, "zeropoint.previous_err_mag=0.05");
    for (own, other) in &rows {
        assert_eq!((other.zp_age_d, other.zp_extra_err_mag), (None, Some(0.05)));
        assert!((other.v_mag_err_sys.unwrap() - own.v_mag_err_sys.unwrap().hypot(0.05)).abs() < 1e-9);
        assert!(Flags(other.flags).has(Flags::OTHER_ZEROPOINT));
    }
    assert!(notes.iter().any(|n| n.contains("unknown age")), "{notes:?}");
}
