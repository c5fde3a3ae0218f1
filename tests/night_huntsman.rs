//! A real frame end to end: Huntsman, ZWO ASI183MM, bias and flat applied, WCS with its SIP terms, SkyMapper g.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::Path;

use satphot::config::Config;
use satphot::night::pipeline::{Options, run};
use satphot::night::progress::Silent;
use satphot::night::summary::Summary;
use satphot::report::{StarRow, read_stars, summary::robust};

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
    let sets = ["frames.aliases.gain=[\"CAM-GAIN\"]".to_string()];
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
