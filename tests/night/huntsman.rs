//! A real frame end to end: Huntsman, ZWO ASI183MM, bias and flat applied, WCS with its SIP terms, SkyMapper g.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::Path;

use satphot::base::progress::Silent;
use satphot::base::stats::robust;
use satphot::config::Config;
use satphot::pipeline::options::Options;
use satphot::pipeline::products::summary::Summary;
use satphot::pipeline::run::run;
use satphot::tables::{StarRow, read_stars};

const FRAMES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/frames");

/// The bias frame is 32 ADU everywhere, so it is the pedestal.
fn configuration(detector: &str) -> String {
    format!(
        r#"
[night]
name = "huntsman"
input = ["{FRAMES}"]
output = "out"
[site]
name = "Siding Spring"
lat_deg = -31.16
lon_deg = 149.13
alt_m = 1160.0
[telescope]
name = "400 mm f/2.8"
aperture_m = 0.143
focal_length_mm = 400.0
[detector]
camera = "asi183mm"
pixel_um = 2.4
pedestal_adu = 32.0
{detector}
[frames]
flat = ["huntsman_flat*"]
stars = ["huntsman_science*"]
ignore = ["*bias*", "*dark*", "astride*", "cutout*", "sep_*"]
[flat]
min_flats = 1
[stars]
catalogue = "{FRAMES}/huntsman_refcat.csv"
columns = {{ ra_deg = "raj2000", dec_deg = "dej2000", v_mag = "g_psf", v_mag_err = "e_g_psf", id = "object_id" }}
bv_range_mag = [-5.0, 9.0]
v_range_mag = [8.0, 18.0]
combine = "none"
[zeropoint]
pin_k = {{ value = 0.0 }}
pin_c = {{ value = 0.0 }}
"#
    )
}

fn reduce(detector: &str) -> (Summary, Vec<StarRow>) {
    let folder = tempfile::tempdir().unwrap();
    let sets = ["header.aliases.gain=[\"CAM-GAIN\"]".to_string()];
    let mut config = Config::from_text(&configuration(detector), &sets).unwrap();
    config.night.output = folder.path().to_path_buf();
    let summary = run(&config, &Options { no_figures: true, ..Options::default() }, &Silent).unwrap();
    let stars = read_stars(&summary.folder.join("stars.ecsv")).unwrap().0;
    (summary, stars)
}

#[test]
fn a_real_frame_gives_its_zeropoint_and_says_what_the_header_gain_does_to_it() {
    if !Path::new(FRAMES).exists() {
        println!("skipped: ../shared/data/frames not present");
        return;
    }
    // 12-bit converter: 4095 ADU is the end; EGAIN 1.1447 e-/ADU from the header
    let (summary, stars) =
        reduce("use_header_egain = true\nadc_max_adu = 4095.0\n[detector.read_noise_e]\n\"100\" = 2.0");
    let z = summary.zeropoint.unwrap();
    let zeropoints =
        |rows: &[StarRow]| -> Vec<f64> { rows.iter().filter_map(|r| Some(r.inst_mag? - r.catalogue_v_mag?)).collect() };
    let all = robust(&zeropoints(&stars)).unwrap();
    println!(
        "{} stars matched; all, saturated ones too: ZP {:.3}, sigma {:.3}; {} unsaturated: ZP {:.3} +- {:.3}, rms {:.3}",
        stars.len(),
        all.0,
        all.1,
        z.n_used,
        z.zp_mag,
        z.cov[0][0].sqrt(),
        z.rms_mag
    );
    assert!(stars.len() >= 12, "{} stars matched", stars.len());
    // an independent, crude value for all stars is -19.53 +- 0.17 (no colour term, saturated ones included)
    assert!((all.0 + 19.53).abs() < 0.2, "{all:?}");
    assert!(all.1 < 0.3);
    // the unsaturated ones are not held down by the converter: brighter by up to a quarter of a magnitude
    assert!(z.zp_mag < all.0 && z.zp_mag > -20.0, "{}", z.zp_mag);
    assert!(z.rms_mag < 0.2);

    // without EGAIN (1 e-/ADU) the zeropoint is that of ADU/s: 2.5 log10(1.144745) = 0.1468 mag fainter
    let (summary, _) = reduce(
        "adc_max_adu = 4095.0\nuse_header_egain = false\n[detector.e_per_adu]\n\"100\" = 1.0\n[detector.read_noise_e]\n\"100\" = 2.0",
    );
    let shift = summary.zeropoint.unwrap().zp_mag - z.zp_mag;
    println!("EGAIN moves the zeropoint by {shift:+.4} mag");
    assert!((shift - 2.5 * 1.144_744_5f64.log10()).abs() < 0.01, "{shift}");
}

#[test]
fn the_real_frame_without_its_world_coordinates_is_put_back_where_it_was() {
    use satphot::astrometry::wcs::Wcs;
    use satphot::fits::Header;
    use satphot::pipeline::stars::solve_file::FrameSolver;

    if !Path::new(FRAMES).exists() {
        println!("skipped: ../shared/data/frames not present");
        return;
    }
    let science = Path::new(FRAMES).join("huntsman_science.fits");
    let header = Header::read(&science).unwrap();
    // the trap: SIP terms although CTYPE says plain TAN; they are used
    assert_eq!(header.text("CTYPE1").as_deref(), Some("RA---TAN"));
    let own = Wcs::from_keys(&|k| header.number(k), &|k| header.text(k)).unwrap().unwrap();
    assert!(own.is_distorted());

    // a copy whose header has no coordinates but the mount's, 8 arcmin off
    let mut bytes = std::fs::read(&science).unwrap();
    let wcs = ["CTYPE", "CRVAL", "CRPIX", "CUNIT", "CD1_", "CD2_", "A_", "B_", "AP_", "BP_", "LONPOLE", "LATPOLE"];
    let mut at = 0;
    while &bytes[at..at + 8] != b"END     " {
        if wcs.iter().any(|k| bytes[at..].starts_with(k.as_bytes())) {
            bytes[at..at + 80].copy_from_slice(format!("{:<80}", "COMMENT").as_bytes());
        }
        at += 80;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bare.fits");
    std::fs::write(&path, bytes).unwrap();
    let config = Config::from_text(&configuration("use_header_egain = true"), &[]).unwrap();
    let solver = FrameSolver::from_config(&config).unwrap();
    let found = solver.solve(&path).unwrap();
    let s = &found.solution;
    println!(
        "{} stars of {} detections from {}, rms {:.2} arcsec, {:.4} arcsec/px, chance {:.0e}",
        s.pairs.len(),
        found.n_detected,
        found.source,
        s.rms_arcsec,
        s.scale_arcsec,
        s.chance
    );
    assert_eq!(found.source, "RA-MNT/DEC-MNT");
    assert!(s.pairs.len() >= 10 && s.rms_arcsec < 0.5 && s.chance < 1e-10);
    assert_eq!(s.mirrored, own.mirrored());
    assert!((s.scale_arcsec / own.scale_arcsec() - 1.0).abs() < 0.002);
    // The header itself is off: its stars lie 1.2 px along +x of where it puts them (photutils and SkyMapper say the
    // same), so the two agree to that, and to half a pixel in shape once the shift is subtracted.
    let places = [(0.0, 0.0), (799.0, 0.0), (0.0, 799.0), (799.0, 799.0), (400.0, 400.0)];
    let off: Vec<(f64, f64)> = places
        .iter()
        .map(|&(x, y)| {
            let (ra, dec) = own.pixel_to_sky(x, y);
            let (u, v) = s.wcs.sky_to_pixel(ra, dec).unwrap();
            (u - x, v - y)
        })
        .collect();
    let mean = off.iter().fold((0.0, 0.0), |m, o| (m.0 + o.0 / 5.0, m.1 + o.1 / 5.0));
    println!("header against solution: {mean:.2?} px on average, {off:.2?} at corners and centre");
    assert!(mean.0.hypot(mean.1) < 1.5);
    assert!(off.iter().all(|o| (o.0 - mean.0).hypot(o.1 - mean.1) < 0.6));
}
