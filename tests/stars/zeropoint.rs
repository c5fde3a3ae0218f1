//! The zeropoint fit: the published JKT standards, the laws of a linear fit, and its file.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use satphot::config::{Estimator, Pin, Zeropoint as Config};
use satphot::zeropoint::fit::{StarMeasurement, Zeropoint, fit};

use crate::zeropoint_nights;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use zeropoint_nights::{Night, exact, normal};

/// The paper's geometry without clouds.
const PAPER: Night = Night { pointing_scatter_mag: 0.0, ..zeropoint_nights::PAPER };

fn night(n: &Night, seed: u64) -> Vec<StarMeasurement> {
    n.measure(seed)
}
fn robust() -> Config {
    Config::default()
}
fn ols() -> Config {
    Config { estimator: Estimator::Ols, ..Config::default() }
}
fn pin(value: f64, err: f64) -> Option<Pin> {
    Some(Pin { value, err })
}
fn terms(z: &Zeropoint) -> [f64; 3] {
    [z.zp_mag, z.k_mag_airmass, z.c_mag_mag]
}
fn near(z: &Zeropoint, want: [f64; 3], within: f64) -> bool {
    terms(z).iter().zip(want).all(|(a, b)| (a - b).abs() < within)
}
/// (used, all) of the JKT standards; colour is not in the table.
fn jkt() -> Option<(Vec<StarMeasurement>, Vec<StarMeasurement>)> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/standards/jkt_standards.txt");
    let Ok(text) = std::fs::read_to_string(path) else {
        println!("skipped: ../shared/data/standards/jkt_standards.txt not present");
        return None;
    };
    let (mut used, mut all) = (Vec::new(), Vec::new());
    for (i, line) in text.lines().skip_while(|l| !l.starts_with("BEGINTABLE")).skip(1).enumerate() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [_, cat, inst, airmass, included] = words[..] else { continue };
        let star = StarMeasurement {
            inst_mag: inst.parse().unwrap(),
            inst_err_mag: f64::NAN,
            v_mag: cat.parse().unwrap(),
            v_err_mag: f64::NAN,
            b_v_mag: f64::NAN,
            b_v_err_mag: f64::NAN,
            airmass: airmass.parse().unwrap(),
            pointing: i,
            star: None,
        };
        all.push(star);
        if included == "T" {
            used.push(star);
        }
    }
    Some((used, all))
}

#[test]
fn the_jkt_standards_give_the_published_zeropoint_and_extinction() {
    let Some((used, _)) = jkt() else { return };
    assert_eq!(used.len(), 13);
    // SUN/190: m_cat = m_inst − 30 + Z − k X, so ZP = 30 − Z; published Z = 23.474252, k = 0.085569
    let z = fit(&used, &Config { pin_c: pin(0.0, 0.0), ..ols() }).unwrap();
    assert!((30.0 - z.zp_mag - 23.474252).abs() < 5e-7, "Z = {:.7}", 30.0 - z.zp_mag);
    assert!((z.k_mag_airmass - 0.085569).abs() < 5e-7, "k = {:.7}", z.k_mag_airmass);
    let length = z.residuals_mag.iter().map(|r| r * r).sum::<f64>().sqrt();
    assert!((length - 0.018932).abs() < 5e-7, "minimum residual vector length {length:.7}");
    assert_eq!((z.c_mag_mag, z.c_note.as_str(), z.k_note.as_str()), (0.0, "pinned 0", "fitted"));
}

#[test]
fn the_robust_default_agrees_with_the_published_fit_within_a_thousandth() {
    let Some((used, all)) = jkt() else { return };
    for (stars, within) in [(used, 1e-3), (all, 5e-3)] {
        // the star that the observers excluded is 12 mmag off, two of the fit's standard deviations: not an outlier to reject
        let z = fit(&stars, &Config { pin_c: pin(0.0, 0.0), ..robust() }).unwrap();
        println!("{} stars: Z = {:.6}, k = {:.6}", stars.len(), 30.0 - z.zp_mag, z.k_mag_airmass);
        assert!((30.0 - z.zp_mag - 23.474252).abs() < within, "{} stars: Z = {:.6}", stars.len(), 30.0 - z.zp_mag);
        assert!((z.k_mag_airmass - 0.085569).abs() < within, "{} stars: k = {:.6}", stars.len(), z.k_mag_airmass);
    }
}

#[test]
fn the_order_of_the_stars_does_not_matter_to_the_bit() {
    let mut stars = night(&Night { outliers: 0.1, pointing_scatter_mag: 0.03, ..PAPER }, 7);
    stars.extend_from_slice(&stars.clone()[..5]); // identical rows too
    for config in [robust(), ols(), Config { pin_k: pin(0.1, 0.02), ..robust() }] {
        let a = fit(&stars, &config).unwrap();
        let mut turned = stars.clone();
        turned.reverse();
        turned.rotate_left(37);
        let b = fit(&turned, &config).unwrap();
        assert_eq!(terms(&a).map(f64::to_bits), terms(&b).map(f64::to_bits));
        assert_eq!(a.cov.map(|r| r.map(f64::to_bits)), b.cov.map(|r| r.map(f64::to_bits)));
        let mut back = b.residuals_mag.clone();
        back.rotate_right(37);
        back.reverse();
        assert_eq!(a.residuals_mag, back);
    }
}

#[test]
fn a_magnitude_added_to_every_instrumental_magnitude_adds_to_the_zeropoint_alone() {
    let stars = night(&Night { outliers: 0.1, ..PAPER }, 8);
    for config in [robust(), ols()] {
        let a = fit(&stars, &config).unwrap();
        let shifted: Vec<_> = stars.iter().map(|s| StarMeasurement { inst_mag: s.inst_mag + 1.0, ..*s }).collect();
        let b = fit(&shifted, &config).unwrap();
        let want = [a.zp_mag + 1.0, a.k_mag_airmass, a.c_mag_mag];
        assert!(near(&b, want, 1e-10)); // rounding of magnitudes near 25
        assert!((a.err_mag(1.4, 0.6, 0.0) - b.err_mag(1.4, 0.6, 0.0)).abs() < 1e-10);
    }
}

#[test]
fn a_scatter_beyond_the_stated_errors_is_found_and_bright_stars_do_not_rule() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let mut stars = exact(500, 0.1); // errors of 2 mmag
    stars.iter_mut().for_each(|s| s.inst_mag += 0.04 * normal(&mut rng));
    let z = fit(&stars, &robust()).unwrap();
    assert!((z.intrinsic_mag - 0.04).abs() < 0.006, "{}", z.intrinsic_mag);
    assert!(z.chi2_dof.unwrap() > 50.0 && z.p_value.unwrap() < 1e-6);
    assert!((z.robust_sigma_mag - 0.04).abs() < 0.006 && (z.rms_mag - 0.04).abs() < 0.006);
}

#[test]
fn the_colour_error_enters_multiplied_by_the_colour_term() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let mut stars = exact(600, 0.2);
    for s in &mut stars {
        s.inst_mag += 2.0 * s.b_v_mag + 0.0045 * normal(&mut rng); // C = 2.08
        s.b_v_err_mag = 0.02;
        s.b_v_mag += 0.02 * normal(&mut rng);
    }
    let z = fit(&stars, &robust()).unwrap();
    assert!((z.c_mag_mag - 2.08).abs() < 0.05, "{}", z.c_mag_mag); // attenuated by 1 % at most
    assert!(z.chi2_dof.is_some_and(|c| (0.8..1.25).contains(&c)), "{:?}", z.chi2_dof);
    assert!(z.intrinsic_mag < 0.015, "{}", z.intrinsic_mag);
    assert!((z.err_mag(1.4, 0.5, 0.1) - 0.208).abs() < 0.01);
}

#[test]
fn the_file_reads_back_to_the_bit_and_refuses_another_convention() {
    let z = fit(&night(&Night { outliers: 0.1, ..PAPER }, 15), &robust()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("zeropoint.toml");
    let text = z.to_toml(&["night \"9 June\"".to_owned()]);
    std::fs::write(&path, &text).unwrap();
    let back = Zeropoint::read(&path).unwrap();
    assert_eq!(terms(&z).map(f64::to_bits), terms(&back).map(f64::to_bits));
    assert_eq!((z.cov, z.n_used, &z.k_note), (back.cov, back.n_used, &back.k_note));
    assert!(text.contains("V = V_inst - ZP - k X - C (B-V)") && text.contains("electrons per second"));
    assert!(back.warnings.contains(&"night \"9 June\"".to_owned()));

    // the paper's own, without a covariance
    std::fs::write(&path, "zp_mag = -23.37\nzp_err_mag = 0.13\nk_mag_airmass = 0.12\nk_err_mag_airmass = 0.08\nc_mag_mag = 0.08\nc_err_mag_mag = 0.07\n").unwrap();
    let paper = Zeropoint::read(&path).unwrap();
    assert!(
        (paper.err_as_published_mag() - (0.13f64.powi(2) + 0.08f64.powi(2) + 0.07f64.powi(2)).sqrt()).abs() < 1e-12
    );
    assert!(paper.warnings[0].contains("no covariance"));

    for (broken, word) in [
        (text.replace("- ZP - k X", "+ ZP - k X"), "convention"),
        (text.replace("zp_mag =", "zp ="), "zp"),
        (text.replace("electrons per second", "ADU"), "inst_mag_unit"),
        ("zp_mag = 1.0\nk_mag_airmass = 0.1\nc_mag_mag = 0.0\n".to_owned(), "covariance"),
        ("zp_mag = nan\nk_mag_airmass = 0.1\nc_mag_mag = 0.0\nzp_err_mag=0.1\nk_err_mag_airmass=0.1\nc_err_mag_mag=0.1".to_owned(), "zp_mag"),
        ("zp_mag = 1.0\nk_mag_airmass = 0.1\nc_mag_mag = 0.0\ncovariance = [[1.0,2.0,0.0],[2.0,1.0,0.0],[0.0,0.0,1.0]]".to_owned(), "covariance"),
    ] {
        std::fs::write(&path, broken).unwrap();
        let message = Zeropoint::read(&path).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn the_file_keeps_a_second_order_term_the_pointings_and_the_time() {
    let config = Config { second_order: true, target_b_v_mag: Some(0.65), target_b_v_err_mag: Some(0.1), ..robust() };
    let mut z = fit(&night(&zeropoint_nights::PAPER, 16), &config).unwrap();
    z.mjd_mean_d = Some(60_834.437_512_345);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("zeropoint.toml");
    let text = z.to_toml(&[]);
    std::fs::write(&path, &text).unwrap();
    let back = Zeropoint::read(&path).unwrap();
    assert_eq!((z.k2_mag.to_bits(), z.cov, z.cov_model), (back.k2_mag.to_bits(), back.cov, back.cov_model));
    assert_eq!((&z.pointings, z.mjd_mean_d, z.rank), (&back.pointings, back.mjd_mean_d, back.rank));
    assert_eq!(
        (z.cov_pointing_jackknife, z.cov_star_jackknife),
        (back.cov_pointing_jackknife, back.cov_star_jackknife)
    );
    assert_eq!(z.err_mag(1.7, 0.4, 0.1).to_bits(), back.err_mag(1.7, 0.4, 0.1).to_bits());
    for word in ["- k2 X (B-V)", "correlation", "[[pointings]]", "err_as_published_mag", "err_one_pointing_mag", "BIC"]
    {
        assert!(text.contains(word), "{word} in\n{text}");
    }
    // the quoted error is the larger of the jackknives, or more where clouds are suspected
    let at = |cov: &[[f64; 4]; 4]| Zeropoint { cov: *cov, ..z.clone() }.err_mag(z.airmass_mean, z.b_v_mean_mag, 0.0);
    let (star, pointing) = (at(&z.cov_star_jackknife.unwrap()), at(&z.cov_pointing_jackknife.unwrap()));
    assert!((1.0..1.5).contains(&(at(&z.cov) / star.max(pointing))));
    // a file of four rows without k2, or of two, is none
    std::fs::write(
        &path,
        "zp_mag = 1.0\nk_mag_airmass = 0.1\nc_mag_mag = 0.0\ncovariance = [[1.0, 0.0], [0.0, 1.0]]\n",
    )
    .unwrap();
    assert!(Zeropoint::read(&path).unwrap_err().to_string().contains("neither 3 nor 4 rows"));
}
