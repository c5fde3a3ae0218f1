//! From star rows to the zeropoint: which rows the cuts keep, what is written back, and a real night with a flat-topped star.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;
use crate::zeropoint_nights;

use satphot::config::Config;
use satphot::photometry::Flags;
use satphot::tables::{StarRow, read_stars};
use satphot::zeropoint::stars::{cut, fit_rows};
use support::{Night as Folder, simulated};
use zeropoint_nights::{PAPER, off};

fn config() -> Config {
    let sets = ["stars.bv_range_mag=[0.2,0.9]".to_string(), "stars.v_range_mag=[10.0,15.0]".to_string()];
    Config::load(std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/pipeline.toml")), &sets).unwrap()
}

/// The rows of a simulated night, at electrons per second, an hour of them from MJD 60000.
fn rows(seed: u64) -> Vec<StarRow> {
    PAPER
        .measure(seed)
        .iter()
        .enumerate()
        .map(|(i, s)| StarRow {
            frame: format!("field_{:02}.fits", s.pointing),
            pointing: Some(s.pointing as i64),
            star_id: format!("star {i}"),
            mjd_mid_d: Some(60_000.0 + i as f64 / 321.0 / 24.0),
            snr: Some(1.0857 / s.inst_err_mag),
            inst_mag: Some(s.inst_mag),
            inst_mag_err: Some(s.inst_err_mag),
            airmass: Some(s.airmass),
            catalogue_v_mag: Some(s.v_mag),
            catalogue_v_mag_err: Some(s.v_err_mag),
            catalogue_b_v_mag: Some(s.b_v_mag),
            catalogue_b_v_mag_err: Some(0.0),
            match_arcsec: Some(0.3),
            ..StarRow::default()
        })
        .collect()
}

/// The reason a changed row is cut for.
fn reason(change: impl Fn(&mut StarRow)) -> String {
    let config = config();
    let mut row = rows(1).into_iter().find(|r| r.catalogue_v_mag_err < Some(0.14)).unwrap();
    assert_eq!(cut(&row, config.stars.as_ref().unwrap(), &config.zeropoint), None);
    change(&mut row);
    cut(&row, config.stars.as_ref().unwrap(), &config.zeropoint).map(|cut| cut.to_string()).unwrap_or_default()
}

#[test]
fn every_row_gets_its_weight_residual_and_leverage_and_the_zeropoint_its_time() {
    let mut rows = rows(2);
    let z = fit_rows(&mut rows, &config()).unwrap();
    assert!(off(&z).abs() < 0.05);
    let used: Vec<&StarRow> = rows.iter().filter(|r| r.status == "ok").collect();
    assert_eq!(used.len(), z.n_used);
    assert!(used.iter().all(|r| r.fit_weight.unwrap() > 0.0 && r.fit_residual_mag.is_some()));
    let leverage: f64 = used.iter().map(|r| r.fit_leverage.unwrap()).sum();
    assert!((leverage - 3.0).abs() < 1e-6, "{leverage}");
    let mean = used.iter().map(|r| r.mjd_mid_d.unwrap()).sum::<f64>() / used.len() as f64;
    assert!((z.mjd_mean_d.unwrap() - mean).abs() < 1e-9);
    for row in rows.iter().filter(|r| r.status == "rejected") {
        assert!(!row.reason.is_empty());
    }
}

#[test]
fn no_star_left_after_the_cuts_stops_with_the_reasons_counted() {
    let mut all = rows(3);
    all.iter_mut().for_each(|r| r.snr = Some(2.0));
    all[0].flags = Flags::SATURATED.0;
    let message = fit_rows(&mut all, &config()).unwrap_err().to_string();
    assert!(
        message.contains("0 of 321") && message.contains("320 snr below") && message.contains("flags saturated"),
        "{message}"
    );
    assert!(fit_rows(&mut [], &config()).unwrap_err().to_string().contains("0 of 0"));
}

#[test]
fn a_flux_that_is_zero_or_negative_and_an_exposure_of_zero_give_no_magnitude_to_fit() {
    assert_eq!(reason(|r| r.inst_mag = None), "no positive flux");
    assert!(reason(|r| r.flags = Flags::NEGATIVE.0).contains("negative"));
    // electrons per 0 s are infinite
    assert_eq!(reason(|r| r.inst_mag = Some(-2.5 * (1e5_f64 / 0.0).log10())), "no positive flux");
    assert_eq!(reason(|r| r.inst_mag = Some(f64::NAN)), "no positive flux");
    assert_eq!(reason(|r| r.inst_mag_err = None), "no positive flux");
}

#[test]
fn colours_and_magnitudes_beyond_the_range_and_sentinels_are_cut_by_name() {
    assert!(reason(|r| r.catalogue_b_v_mag = Some(1.3)).contains("colour 1.300 outside 0.2 to 0.9"));
    assert!(reason(|r| r.catalogue_b_v_mag = Some(f64::NAN)).contains("colour"));
    assert!(reason(|r| r.catalogue_b_v_mag = None).contains("no colour"));
    assert!(reason(|r| r.catalogue_v_mag = Some(99.999)).contains("V 99.999 outside"));
    assert!(reason(|r| r.catalogue_v_mag = Some(0.0)).contains("V 0.000 outside"));
    assert!(reason(|r| r.catalogue_v_mag_err = Some(99.999)).contains("catalogue error"));
    assert!(reason(|r| r.airmass = Some(0.5)).contains("airmass 0.500 outside"));
    assert!(reason(|r| r.airmass = Some(f64::NAN)).contains("airmass"));
    assert!(reason(|r| r.airmass = None).contains("no airmass"));
    // Kasten & Young at the zenith
    assert_eq!(reason(|r| r.airmass = Some(0.9997)), "");
}

#[test]
fn two_detections_of_one_catalogue_star_are_both_excluded_and_one_star_in_two_pointings_is_not() {
    let mut all = rows(4);
    all[1] = StarRow { inst_mag: all[0].inst_mag.map(|m| m + 0.7), ..all[0].clone() };
    all[2].star_id = all[0].star_id.clone();
    assert_ne!(all[2].frame, all[0].frame);
    fit_rows(&mut all, &config()).unwrap();
    for row in &all[..2] {
        assert!(row.status == "rejected" && row.reason.contains("two detections"), "{}", row.reason);
    }
    assert!(!all[2].reason.contains("two detections"));
}

#[test]
fn three_gain_settings_give_one_zeropoint_once_counts_are_electrons() {
    // the same night taken at 200, 250 and 300 (0.1 dB): a factor of 10^(50/200) in ADU per electron between them
    let e_per_adu = [0.25, 0.25 * 10f64.powf(-0.25), 0.25 * 10f64.powf(-0.5)];
    let (electrons, mut counts) = (rows(5), rows(5));
    for (i, row) in counts.iter_mut().enumerate() {
        row.inst_mag = row.inst_mag.map(|m| m + 2.5 * e_per_adu[i % 3].log10());
    }
    let mut converted = counts.clone();
    for (i, row) in converted.iter_mut().enumerate() {
        row.inst_mag = row.inst_mag.map(|m| m - 2.5 * e_per_adu[i % 3].log10());
    }
    let z = |mut rows: Vec<StarRow>| fit_rows(&mut rows, &config());
    let (truth, one) = (z(electrons).unwrap(), z(converted).unwrap());
    assert!((truth.zp_mag - one.zp_mag).abs() < 1e-9);
    // left as counts they are three zeropoints: refused, or with a scatter that nobody overlooks
    assert!(z(counts).map_or(true, |bad| bad.robust_sigma_mag > 0.3));
}

#[test]
fn a_star_flat_topped_in_one_member_of_a_pointing_is_flagged_out_of_the_fit() {
    let folder = simulated("zeropoint_saturated", &["pointings.frames=4"]);
    let night = Folder::copy_of(&folder);
    let stars = |n: &Folder| {
        n.run().unwrap();
        read_stars(&n.result("stars.ecsv")).unwrap().0
    };
    let before = stars(&night);
    let star = before.iter().find(|r| r.status == "ok" && r.n_members > Some(2)).unwrap().clone();
    // its pixels in the first member, at the top of the converter
    let path = night.path(&star.frame);
    let mut file = fitsio::FitsFile::edit(&path).unwrap();
    let hdu = file.primary_hdu().unwrap();
    let (x, y) = (star.x_px.unwrap().round() as usize, star.y_px.unwrap().round() as usize);
    let mut pixels: Vec<i32> = hdu.read_image(&mut file).unwrap();
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        pixels[(y + dy) * 160 + x + dx] = 65_535; // 160 px wide
    }
    hdu.write_image(&mut file, &pixels).unwrap();
    drop(file);
    let after = stars(&night);
    let same = after.iter().find(|r| r.star_id == star.star_id && r.pointing == star.pointing).unwrap();
    assert!(Flags(same.flags).has(Flags::SATURATED), "flags {}, peak {:?}", Flags(same.flags), same.peak_frac_sat);
    assert!(same.status == "rejected" && same.reason.contains("saturated"), "{}", same.reason);
    // the median of the members hides it: the magnitude alone would not tell
    assert!((same.inst_mag.unwrap() - star.inst_mag.unwrap()).abs() < 0.1);
}

#[test]
fn every_pointing_is_drawn_with_its_offset() {
    let mut all = rows(6);
    let z = fit_rows(&mut all, &config()).unwrap();
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("zeropoint_pointings.svg");
    satphot::figures::zeropoint_diagnostics(&path, &all, (z.zp_mag, z.k_mag_airmass, z.c_mag_mag), ("V", "B-V"))
        .unwrap();
    let svg = std::fs::read_to_string(&path).unwrap();
    let purple = svg.lines().filter(|l| l.starts_with("<circle") && l.contains("fill=\"#CC79A7\"")).count();
    assert_eq!(purple, z.n_pointings + 1, "one mark per pointing and the legend");
    assert!(svg.contains("number of the pointing"));
}
