//! Star pointings of simulated nights: light outside the aperture, ambiguous matches, members that differ.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use hifitime::Epoch;
use satphot::astrometry::align::Alignment;
use satphot::astrometry::catalogue::Catalogue;
use satphot::base::progress::Silent;
use satphot::config::Config;
use satphot::frames::{ElectronsPerAdu, Gain};
use satphot::photometry::Flags;
use satphot::photometry::aperture::Shape;
use satphot::photometry::flux::Flux;
use satphot::photometry::growth::StarProfile;
use satphot::pipeline::options::Options;
use satphot::pipeline::products::summary::Summary;
use satphot::pipeline::run::run;
use satphot::pipeline::stars::pointing::{Member, MemberStar, combined_rows};
use satphot::simulate::{Scenario, simulate};
use satphot::tables::{PhotometryRow, StarRow, read_photometry, read_stars};

fn simulated(folder: &Path, sets: &[&str]) -> Scenario {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_string()).collect();
    let scenario = Scenario::crowded_night(&sets).unwrap();
    simulate(&scenario, folder, &Silent).unwrap();
    scenario
}

fn reduced(folder: &Path, sets: &[&str], out: &str) -> (Summary, Vec<StarRow>) {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_string()).collect();
    let mut config = Config::load(&folder.join("pipeline.toml"), &sets).unwrap();
    config.night.output = folder.join(out);
    let summary = run(&config, &Options { no_figures: true, ..Options::default() }, &Silent).unwrap();
    let stars = read_stars(&summary.folder.join("stars.ecsv")).unwrap().0;
    (summary, stars)
}

/// The true electrons per second of every star of every star frame.
fn true_rates(folder: &Path) -> HashMap<(String, String), f64> {
    let mut reader = csv::Reader::from_path(folder.join("truth/stars.csv")).unwrap();
    let rows = reader.deserialize::<HashMap<String, String>>().map(Result::unwrap);
    rows.map(|r| {
        let number = |key: &str| -> f64 { r[key].parse().unwrap() };
        ((r["frame"].clone(), r["star_id"].clone()), number("flux_e") / number("exptime_s"))
    })
    .collect()
}

/// Weighted mean of measured − true instrumental magnitudes of the rows without flags, without and with the correction.
fn star_errors(folder: &Path, rows: &[StarRow]) -> ([f64; 2], usize) {
    let truth = true_rates(folder);
    let (mut sums, mut weights, mut n) = ([0.0; 2], 0.0, 0);
    for row in rows.iter().filter(|r| r.flags == 0 && r.inst_mag.is_some()) {
        let Some(rate) = truth.get(&(row.frame.clone(), row.star_id.clone())) else { continue };
        let error = row.inst_mag.unwrap() + 2.5 * rate.log10();
        let weight = row.inst_mag_err.unwrap().hypot(0.005).powi(-2);
        sums[0] += weight * (error - row.aper_corr_mag.unwrap_or(0.0));
        sums[1] += weight * error;
        weights += weight;
        n += 1;
    }
    (sums.map(|s| s / weights), n)
}

/// A night of stars alone with an all but perfect catalogue.
const NIGHT: [&str; 10] = [
    "frame.nx_px=640",
    "frame.ny_px=480",
    "photometry.clip_radius_px=400.0",
    "photometry.mesh_px=64",
    "pointings.n=6",
    "pointings.frames=3",
    "target.n=2",
    "field.stars_per_deg2=500.0",
    "field.v_range_mag=[9.5, 13.0]",
    "field.catalogue_err_mag=0.001",
];

/// Errors of star magnitudes (without, with correction), and whether the zeropoint predicts a magnitude at X = 1.4 and
/// B−V = 0.65 to 0.003 and twice its own error.
fn night_of(psf: &[&str]) -> ([f64; 2], bool, Summary) {
    let folder = tempfile::tempdir().unwrap();
    let sets: Vec<&str> = NIGHT.iter().chain(psf).copied().collect();
    let scenario = simulated(folder.path(), &sets);
    let (summary, rows) = reduced(folder.path(), &[], "out");
    let (errors, n) = star_errors(folder.path(), &rows);
    let z = summary.zeropoint.clone().unwrap();
    let p = &scenario.photometric;
    let at = |zp: f64, k: f64, c: f64| zp + 1.4 * k + 0.65 * c;
    let zeropoint = at(z.zp_mag, z.k_mag_airmass, z.c_mag_mag) - at(p.zp_mag, p.k_mag_airmass, p.c_mag_mag);
    let err = z.err_mag(1.4, 0.65, 0.0);
    println!("{psf:?}: {n} stars, {:+.4} -> {:+.4}, zeropoint {zeropoint:+.4} +- {err:.4}", errors[0], errors[1]);
    (errors, zeropoint.abs() < 0.003 + 2.0 * err && err < 0.005, summary)
}

#[test]
fn a_moffat_night_of_changing_seeing_has_the_right_zeropoint() {
    let (errors, unbiased, summary) =
        night_of(&["psf.kind=moffat", "psf.moffat_beta=3.5", "psf.seeing_scatter_frac=0.15"]);
    assert!(errors[0] > 0.013, "the loss that is to be corrected: {}", errors[0]);
    assert!(errors[1].abs() < 0.003 && unbiased, "{}", errors[1]);
    let message = summary.details.iter().any(|n| n.contains("of a star's flux (Moffat beta 3."));
    assert!(message, "{:?}", summary.details);
}

#[test]
fn target_frames_are_as_wide_as_stars_at_their_airmass() {
    for exponent in [0.0, 0.6] {
        let folder = tempfile::tempdir().unwrap();
        let exponent_key = format!("psf.airmass_exponent={exponent}");
        let own = ["target.n=6", exponent_key.as_str()];
        let scenario = simulated(folder.path(), &NIGHT.iter().chain(&own).copied().collect::<Vec<_>>());
        let (summary, _) = reduced(folder.path(), &[], "out");
        let rows = read_photometry(&summary.folder.join("photometry.ecsv")).unwrap().0;
        let of_row = |r: &PhotometryRow| Some((r.fwhm_px? * r.pix_scale_arcsec?, r.airmass?));
        let widths: Vec<(f64, f64)> = rows.iter().filter_map(of_row).filter(|(_, airmass)| *airmass < 3.0).collect();
        assert!(widths.len() >= 3 && widths.iter().any(|(_, airmass)| *airmass > 1.8), "{widths:?}");
        for (fwhm_arcsec, airmass) in widths {
            let ratio = fwhm_arcsec / (scenario.psf.fwhm_arcsec * airmass.powf(exponent));
            println!("X^{exponent}: {ratio:.3} of the width at airmass {airmass:.2}");
            assert!((ratio - 1.0).abs() < 0.08, "X^{exponent} at {airmass}: {ratio}");
        }
    }
}

#[test]
#[ignore = "a table of twelve nights: scripts/prove_growth.sh"]
fn zeropoints_are_unbiased_for_every_profile_and_seeing() {
    for psf in ["psf.moffat_beta=2.5", "psf.moffat_beta=3.5", "psf.moffat_beta=5.0", "psf.kind=gaussian"] {
        for (fwhm, scatter) in [("3.5", "0.03"), ("5.5", "0.15"), ("9.0", "0.03")] {
            let kind = if psf.contains("gauss") { psf } else { "psf.kind=moffat" };
            let fwhm = format!("psf.fwhm_arcsec={fwhm}");
            let scatter = format!("psf.seeing_scatter_frac={scatter}");
            let sets: Vec<&str> =
                if kind == psf { vec![psf, &fwhm, &scatter] } else { vec![kind, psf, &fwhm, &scatter] };
            let (errors, unbiased, _) = night_of(&sets);
            assert!(errors[1].abs() < 0.003 && unbiased, "{sets:?}: {}", errors[1]);
        }
    }
}

#[test]
fn two_catalogue_stars_that_claim_one_detection_are_flagged_and_kept_out_of_the_fit() {
    let folder = tempfile::tempdir().unwrap();
    simulated(folder.path(), &["pointings.n=3", "pointings.frames=1", "target.n=2"]);
    let (_, rows) = reduced(folder.path(), &[], "before");
    let used: Vec<&StarRow> = rows.iter().filter(|r| r.status == "ok" && r.snr.unwrap() > 30.0).collect();
    let (equal, faint) = (used[0], used[used.len() / 2]);
    // a double of one star 2 arcsec away, and a companion of another 4 mag fainter
    let path = folder.path().join("catalogue.csv");
    let mut text = std::fs::read_to_string(&path).unwrap();
    for (id, star, fainter) in [("9999998", equal, 0.0), ("9999999", faint, 4.0)] {
        let (ra, dec) = (star.ra_deg.unwrap(), star.dec_deg.unwrap() + 2.0 / 3600.0);
        let (v, bv) = (star.catalogue_v_mag.unwrap() + fainter, star.catalogue_b_v_mag.unwrap());
        text += &format!("{id},{ra:.7},{dec:.7},{v:.4},0.010,{bv:.4},0.001\n");
    }
    std::fs::write(&path, text).unwrap();
    let (_, rows) = reduced(folder.path(), &["stars.v_range_mag=[10.0, 20.0]"], "after");
    let row = |id: &str| rows.iter().find(|r| r.star_id == id).unwrap();
    for id in [&equal.star_id, "9999998", "9999999"] {
        let row = row(id);
        assert!(Flags(row.flags).has(Flags::NEIGHBOUR) && row.status == "rejected", "{id}: {row:?}");
        assert!(row.reason.contains("neighbour") && row.match_arcsec.is_some(), "{id}: {}", row.reason);
    }
}

#[test]
fn without_the_correction_or_without_stars_for_it_magnitudes_are_of_the_aperture() {
    let folder = tempfile::tempdir().unwrap();
    let few: Vec<&str> = NIGHT.iter().chain(&["pointings.n=3", "pointings.frames=1"]).copied().collect();
    simulated(folder.path(), &few);
    let (_, off) = reduced(folder.path(), &["photometry.aper_correction=false"], "off");
    let (_, on) = reduced(folder.path(), &[], "on");
    assert!(off.iter().all(|r| r.aper_corr_mag.is_none()));
    for (off, on) in off.iter().zip(&on) {
        assert_eq!((off.flux_e, off.flux_err_e), (on.flux_e, on.flux_err_e));
        let (Some(a), Some(b)) = (off.inst_mag, on.inst_mag) else { continue };
        assert!((b - a - on.aper_corr_mag.unwrap()).abs() < 1e-12, "{a} {b}");
        // the night is a Gaussian's
        assert!(on.aper_corr_mag.unwrap().abs() < 5e-4, "{:?}", on.aper_corr_mag);
    }
    // a night with a few faint stars: said, and left as it is
    let folder = tempfile::tempdir().unwrap();
    simulated(folder.path(), &["pointings.n=2", "pointings.frames=1", "target.n=2", "field.v_range_mag=[13.0, 14.5]"]);
    let (summary, rows) = reduced(folder.path(), &["zeropoint.min_stars=4"], "faint");
    assert!(rows.iter().all(|r| r.aper_corr_mag.is_none()));
    assert!(summary.notes.iter().any(|n| n.contains("no aperture correction")), "{:?}", summary.notes);
}

/// A member frame with one star of `flux_e` in one second.
fn member(flux_e: f64, flags: Flags, profile: Option<StarProfile>) -> Member {
    let gain = Gain {
        setting: None,
        e_per_adu: ElectronsPerAdu(1.0),
        source: "test".into(),
        read_noise_e: 2.0,
        pedestal_adu: 0.0,
        saturation_adu: 60_000.0,
    };
    let flux = Flux {
        flux_e,
        flux_err_e: 10.0,
        sky_e_px: 20.0,
        sky_err_e_px: 0.1,
        sky_rms_e: 5.0,
        area_px: 113.0,
        n_sky: 400,
        snr: flux_e / 10.0,
        peak_e: 0.05 * flux_e,
        masked_frac: 0.0,
        shape: Shape::Circle { r_px: 6.0 },
        sky_in_px: 9.0,
        sky_out_px: 15.0,
        flags,
    };
    let star = MemberStar {
        index: 0,
        x_px: 50.0,
        y_px: 50.0,
        flux,
        match_px: Some(0.2),
        alt_rad: 1.0,
        az_rad: 0.5,
        airmass: Some(1.2),
    };
    Member {
        frame: "star.fits".into(),
        object: "field".into(),
        mid: Epoch::from_gregorian_utc_at_midnight(2025, 6, 9),
        exptime_s: 1.0,
        gain,
        fwhm_px: 3.0,
        scale_arcsec: 1.5,
        turn: None,
        radii_px: [6.0, 9.0, 15.0],
        flat: true,
        n_detected: 10,
        alignment: Alignment {
            dx_px: 0.0,
            dy_px: 0.0,
            rotation_rad: 0.0,
            scale: 1.0,
            x0: 0.0,
            y0: 0.0,
            n: 10,
            pairs: Vec::new(),
            rms_px: 0.1,
        },
        growth: None,
        profile,
        note: String::new(),
        stars: vec![star],
    }
}

fn catalogue() -> Catalogue {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("catalogue.csv");
    std::fs::write(&path, "recno,RAJ2000,DEJ2000,Vmag,e_Vmag,B-V,e_B-V\n7,10.0,-20.0,12.0,0.01,0.6,0.01\n").unwrap();
    Catalogue::read(&path, &std::collections::BTreeMap::new()).unwrap()
}

#[test]
fn a_star_saturated_in_one_of_twelve_members_is_flagged_in_the_combined_row() {
    let mut members: Vec<Member> = (0..12).map(|_| member(1e4, Flags::default(), None)).collect();
    let row = |members: &[Member]| combined_rows(members, 0, &catalogue()).remove(0);
    assert_eq!(row(&members).flags, 0);
    members[5] = member(7e4, Flags::SATURATED, None);
    let combined = row(&members);
    assert_eq!(Flags(combined.flags), Flags::SATURATED);
    // the median hides it in the flux, so only the flag shows it
    assert!((combined.flux_e.unwrap() - 1e4).abs() < 1e-9);
}

#[test]
fn negative_fluxes_are_kept_and_have_no_magnitude() {
    let members: Vec<Member> = (0..3).map(|_| member(-20.0, Flags::NEGATIVE, Some(StarProfile::moffat(3.0)))).collect();
    let row = combined_rows(&members, 0, &catalogue()).remove(0);
    assert_eq!((row.flux_e, row.inst_mag, row.aper_corr_mag), (Some(-20.0), None, None));
    assert!(Flags(row.flags).has(Flags::NEGATIVE));
}

#[test]
fn each_member_is_corrected_by_its_own_profile_before_the_median() {
    // one sharp frame and two with twice the width: the same star
    let sharp = StarProfile::moffat(f64::INFINITY);
    let wide = StarProfile { fwhm_ratio: 2.0, ..sharp };
    let share = |p: &StarProfile| 10f64.powf(0.4 * p.star_correction_mag(3.0, 6.0, (9.0, 15.0), 1e4, 5.0));
    assert!(share(&wide) < 0.94 && share(&sharp) > 0.999);
    let members: Vec<Member> =
        [wide, wide, sharp].into_iter().map(|p| member(1e4 * share(&p), Flags::default(), Some(p))).collect();
    let row = combined_rows(&members, 0, &catalogue()).remove(0);
    assert!((row.inst_mag.unwrap() + 10.0).abs() < 1e-3, "{:?}", row.inst_mag);
    assert!((row.inst_mag.unwrap() + 2.5 * row.flux_e.unwrap().log10() - row.aper_corr_mag.unwrap()).abs() < 1e-12);
    assert!(row.aper_corr_mag.unwrap() < -0.06);
}
