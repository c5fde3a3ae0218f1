//! Nights of which a part is missing: they run, say which columns stay empty, and do no work that is not needed.
#![allow(clippy::unwrap_used)]

use crate::support;

use std::path::PathBuf;
use std::sync::OnceLock;

use satphot::pipeline::products::summary::Summary;
use satphot::tables::PhotometryRow;
use support::{Night, TARGETS, simulated};

fn original() -> &'static PathBuf {
    static NIGHT: OnceLock<PathBuf> = OnceLock::new();
    NIGHT.get_or_init(|| simulated("night_left_out", &[]))
}

fn night() -> Night {
    Night::copy_of(original())
}

/// A column of the photometry table, by its name.
type Column = (&'static str, fn(&PhotometryRow) -> bool);

const GEOMETRY: &[Column] = &[
    ("norad_cat_id", |r| r.norad_cat_id.is_some()),
    ("object_id", |r| !r.object_id.is_empty()),
    ("alt_deg", |r| r.alt_deg.is_some()),
    ("az_deg", |r| r.az_deg.is_some()),
    ("range_km", |r| r.range_km.is_some()),
    ("rate_deg_s", |r| r.rate_deg_s.is_some()),
    ("airmass", |r| r.airmass.is_some()),
    ("phase_angle_deg", |r| r.phase_angle_deg.is_some()),
    ("sun_alt_deg", |r| r.sun_alt_deg.is_some()),
    ("moon_", |r| r.moon_alt_deg.is_some()),
    ("tle_age_d", |r| r.tle_age_d.is_some()),
];
const CALIBRATED: &[Column] = &[
    ("v_mag", |r| r.v_mag.is_some()),
    ("v_mag_err_sys", |r| r.v_mag_err_sys.is_some()),
    ("residual_mag", |r| r.residual_mag.is_some()),
];
const MODEL: &[Column] = &[
    ("model_v_mag", |r| r.model_v_mag.is_some()),
    ("sun_v_mag", |r| r.sun_v_mag.is_some()),
    ("earthshine_v_mag", |r| r.earthshine_v_mag.is_some()),
    ("moon_v_mag", |r| r.moon_v_mag.is_some()),
    ("lunar_earthshine_v_mag", |r| r.lunar_earthshine_v_mag.is_some()),
    ("model_err_mag", |r| r.model_err_mag.is_some()),
    ("residual_mag", |r| r.residual_mag.is_some()),
];

/// These columns are empty in every row, and the summary and the manifest say so by name.
fn empty_and_reported(n: &Night, summary: &Summary, columns: &[Column]) {
    let message = summary.empty_columns.join("\n");
    for (name, filled) in columns {
        assert!(n.rows().iter().all(|r| !filled(r)), "{name} is filled");
        assert!(message.contains(name), "{name} is empty, which is not reported: {message}");
    }
    let manifest = n.manifest();
    let empty: Vec<&str> = manifest["left_out"].as_array().unwrap().iter().map(|v| v.as_str().unwrap()).collect();
    assert_eq!(empty, summary.empty_columns);
}

#[test]
fn a_whole_night_fills_every_column_and_leaves_nothing_out() {
    let n = night();
    let summary = n.run().unwrap();
    for (name, filled) in GEOMETRY.iter().chain(CALIBRATED).chain(&MODEL[..1]) {
        assert!(n.rows().iter().all(filled), "{name} is empty");
    }
    assert!(summary.empty_columns.is_empty(), "{:?}", summary.empty_columns);
}

#[test]
fn a_night_without_flats_runs_with_a_flag_in_every_row() {
    let n = night().remove("flat");
    let summary = n.run().unwrap();
    assert!(summary.poor_error().is_none());
    assert!(summary.empty_columns.iter().any(|e| e.contains("no flats") && e.contains("no_flat")));
    let no_flat = satphot::photometry::Flags::NO_FLAT.0;
    assert!(n.rows().iter().all(|r| r.flags & no_flat != 0 && r.v_mag.is_some()));
    assert!(!n.result("master_flat.fits").exists());
}

#[test]
fn a_night_without_star_pointings_takes_a_previous_zeropoint() {
    // with a width of its own, since without stars that at the airmass of a target is not known
    let whole = night().set("photometry.fwhm_px=3.6");
    whole.run().unwrap();
    let zeropoint = whole.text("zeropoint.toml");
    let n = night()
        .remove("field")
        .file("before.toml", zeropoint)
        .set("zeropoint.previous=before.toml")
        .set("photometry.fwhm_px=3.6");
    let summary = n.run().unwrap();
    assert!(summary.poor_error().is_none() && summary.zeropoint_source.contains("before.toml"));
    for frame in TARGETS {
        let (a, b) = (whole.row(frame), n.row(frame));
        let (v, v_err) = (b.v_mag.unwrap(), b.v_mag_err_sys.unwrap());
        // the same pixels, aperture and zeropoint
        assert!((a.v_mag.unwrap() - v).abs() < 1e-9 && (a.v_mag_err_sys.unwrap() - v_err).abs() < 1e-9, "{frame}");
    }
}

#[test]
fn a_night_without_star_pointings_and_zeropoint_stays_instrumental_and_says_so() {
    for n in [night().remove("field"), night().without_table("stars")] {
        let summary = n.run().unwrap();
        assert!(summary.poor_error().is_none(), "{:?}", summary.poor);
        empty_and_reported(&n, &summary, CALIBRATED);
        assert!(summary.notes.iter().any(|t| t.contains("zeropoint.previous")), "{:?}", summary.notes);
        assert!(summary.notes.iter().any(|t| t.contains("photometry.fwhm_px")), "{:?}", summary.notes);
        // the assumed FWHM is too narrow for the faintest target: it may be a limit
        assert!(n.rows().iter().all(|r| r.flux_e.is_some() && r.model_v_mag.is_some()));
        assert!(n.rows().iter().filter(|r| r.inst_mag.is_some()).count() >= 5);
        assert!(n.rows().iter().all(|r| r.reason.contains("no zeropoint")));
        assert!(!n.result("zeropoint.toml").exists());
    }
}

#[test]
fn a_night_without_a_model_has_no_predicted_magnitudes_and_no_residuals() {
    let n = night().without_table("model");
    let summary = n.run().unwrap();
    assert!(summary.poor_error().is_none());
    empty_and_reported(&n, &summary, MODEL);
    assert!(n.rows().iter().all(|r| r.v_mag.is_some() && r.illum.is_empty()));
    assert!(!n.result("residuals.ecsv").exists());
}

#[test]
fn a_night_without_elements_has_no_geometry_and_asks_how_the_target_is_called() {
    let n = night().without_table("orbit").without_table("model").set("frames.target_objects=[\"iss\"]");
    let summary = n.run().unwrap();
    assert!(summary.poor_error().is_none(), "{:?}", summary.poor);
    empty_and_reported(&n, &summary, &[GEOMETRY, &CALIBRATED[..1], MODEL].concat());
    assert!(n.rows().iter().all(|r| r.inst_mag.is_some() && r.snr.is_some()));
    // nobody said which frames show the target
    let unnamed = night().without_table("orbit");
    let summary = unnamed.run().unwrap();
    assert_eq!(summary.counts.targets, 0);
    assert!(summary.notes.iter().any(|t| t.contains("frames.target_objects")), "{:?}", summary.notes);
}

#[test]
fn a_night_of_target_frames_only_is_measured() {
    let n = night().remove("flat").remove("field");
    let summary = n.run().unwrap();
    assert!(summary.poor_error().is_none());
    // the faintest, V 15 at 15 degrees of altitude, may be a limit
    assert_eq!((summary.counts.files, summary.counts.ok + summary.counts.nondetection), (6, 6));
    assert!(summary.counts.ok >= 5);
    empty_and_reported(&n, &summary, CALIBRATED);
}

#[test]
fn a_night_of_flats_or_stars_only_makes_what_it_can_and_says_that_there_is_no_target() {
    for (gone, made) in [("field", "master_flat.fits"), ("flat", "zeropoint.toml")] {
        let n = night().remove("target").remove(gone);
        let summary = n.run().unwrap();
        assert!(summary.poor_error().is_none());
        assert!(n.rows().is_empty() && n.result(made).exists());
        assert!(summary.notes.iter().any(|t| t.contains("no target frames")), "{:?}", summary.notes);
    }
}

#[test]
fn with_the_moon_up_lunar_earthshine_is_integrated_and_with_the_moon_far_down_it_is_not() {
    let n = night();
    n.run().unwrap();
    let moonlit = n.manifest();
    assert!(moonlit["earth_quadratures"]["moon"].as_u64().unwrap() > 0, "{}", moonlit["earth_quadratures"]);
    assert!(n.rows().iter().all(|r| r.lunar_earthshine_v_mag.is_some()));

    // 2025-06-23: the Moon is 70 to 82 deg below the horizon and lights no ground the ISS sees; nor does the Sun
    let sets = ["start_utc=2025-06-23T10:00:00", "end_utc=2025-06-23T13:00:00", "pointings.n=0", "flats.n=0"];
    let dark = Night::copy_of(&simulated("night_moon_down", &sets));
    let summary = dark.run().unwrap();
    assert_eq!(summary.counts.targets, 6);
    let counts = dark.manifest()["earth_quadratures"].clone();
    assert_eq!(counts["scenes"].as_u64(), Some(6), "{counts}");
    assert_eq!(counts["moon"].as_u64(), Some(0), "{counts}");
    assert_eq!(counts["sun"].as_u64(), Some(0), "{counts}");
    for row in dark.rows() {
        assert!(row.moon_alt_deg.unwrap() < -60.0);
        assert!(row.lunar_earthshine_v_mag.is_none() && row.skipped.contains("lunar_earthshine"), "{}", row.skipped);
    }
}

#[test]
fn compressed_frames_give_the_same_table_as_plain_ones() {
    let n = night();
    n.run().unwrap();
    let packed = Night::copy_of(&simulated("night_packed", &["compress=true"]));
    assert_eq!(packed.frames("").len(), 19);
    assert!(packed.frames("").iter().all(|p| p.to_string_lossy().ends_with(".fits.fz")));
    packed.run().unwrap();
    let plain = |r: &PhotometryRow| PhotometryRow { frame: String::new(), frame_sha256: String::new(), ..r.clone() };
    let (a, b): (Vec<_>, Vec<_>) = (n.rows().iter().map(plain).collect(), packed.rows().iter().map(plain).collect());
    assert_eq!(a, b);
    // the inputs are other files, which the last line says
    let fit = |n: &Night| n.text("zeropoint.toml").split("# provenance: ").next().unwrap().to_string();
    assert_eq!(fit(&n), fit(&packed));
}

#[test]
fn a_site_in_the_headers_that_is_not_the_configured_one_fails_the_frames_unless_configured_otherwise() {
    let same = night().run().unwrap();
    assert!(!same.notes.iter().any(|n| n.contains("another site")), "{:?}", same.notes);
    let (code, words) = night().set("site.lon_deg=150.9").refusal();
    assert_eq!(code, 4, "{words}");
    let other = night().set("site.lon_deg=150.9").set("header.check_site=false").run().unwrap();
    let message = other.notes.iter().find(|n| n.contains("another site")).unwrap();
    assert!(message.contains("151.1113") && message.contains("150.9") && message.contains("[site]"), "{message}");
}

#[test]
fn a_previous_zeropoint_made_with_another_aperture_is_reported() {
    let n = night();
    n.run().unwrap();
    let file = n.result("zeropoint.toml");
    let kept = n.path("kept.toml");
    std::fs::copy(file, &kept).unwrap();
    let previous = format!("zeropoint.previous={:?}", kept.display().to_string());
    let n = n.set(&previous);
    assert!(!n.run().unwrap().notes.iter().any(|n| n.contains("other conditions")));
    let message = n.set("photometry.aper_r_fwhm=1.5").run().unwrap().notes;
    assert!(
        message.iter().any(|n| n.contains("other conditions: aperture 2 FWHM") && n.contains("aperture 1.5 FWHM")),
        "{message:?}"
    );
}
