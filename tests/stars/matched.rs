//! Zeropoints from tables of matched stars made by other programs: no frames, no pipeline.toml.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use satphot::tables::read_stars;
use satphot::zeropoint::fit::Zeropoint;
use satphot::zeropoint::matched::{Matched, Request, fit_matched, without_config};
use satphot::{Error, Result};

fn shared(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")).join(name);
    if !path.exists() {
        println!("skipped: ../shared/data/{name} not present");
        return None;
    }
    Some(path)
}

fn fit_file(path: &Path, columns: &[(&str, &str)], band: &str, sets: &[&str]) -> Result<Matched> {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    let columns = columns.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    fit_matched(&without_config(&sets)?, &Request { table: path, columns, band, inst_constant_mag: 0.0 })
}

fn fit_text(text: &str, columns: &[(&str, &str)]) -> Result<Matched> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    fit_file(file.path(), columns, "V", &[])
}

/// One measured star.
struct Star {
    flux_e_s: f64,
    err: f64,
    v: f64,
    b_v: f64,
    airmass: f64,
    field: usize,
}

const TRUTH: [f64; 3] = [-23.37, 0.12, 0.08];

/// 240 stars in 8 fields, 0.01 mag of noise, one in twelve a blend.
fn stars() -> Vec<Star> {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    (0..240)
        .map(|k| {
            let field = k % 8;
            let (airmass, v, b_v) =
                (1.0 + 0.13 * field as f64, rng.random_range(9.0..14.0), rng.random_range(0.2..1.1));
            let noise: f64 = rng.sample::<f64, _>(StandardNormal) * 0.01 + if k % 12 == 5 { -0.7 } else { 0.0 };
            let inst = v + TRUTH[0] + TRUTH[1] * airmass + TRUTH[2] * b_v + noise;
            Star { flux_e_s: 10f64.powf(-0.4 * inst), err: 0.01, v, b_v, airmass, field }
        })
        .collect()
}

/// The fit is the truth within 0.02 mag: five standard errors of ZP with 0.01 mag on 220 stars.
fn is_truth(matched: &Matched, zp_mag: f64) -> Zeropoint {
    let z = matched.zeropoint.clone().unwrap();
    assert!((z.zp_mag - zp_mag).abs() < 0.02, "ZP {} against {zp_mag}\n{}", z.zp_mag, matched.text());
    assert!((z.k_mag_airmass - TRUTH[1]).abs() < 0.02 && (z.c_mag_mag - TRUTH[2]).abs() < 0.02, "{}", matched.text());
    z
}

#[test]
fn the_published_answer_of_the_jkt_standards_comes_out_to_six_digits() {
    let Some(path) = shared("standards/jkt_standards.txt") else { return };
    // SUN/190: Z = 23.474252, k = 0.085569 for m_cat = m_inst - 30 + Z - k X, unweighted
    let folder = tempfile::tempdir().unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_satphot"))
        .args([
            "zeropoint",
            "--set",
            "zeropoint.estimator=\"ols\"",
            "--inst-constant",
            "30",
            "--band",
            "R",
            "--matched",
        ])
        .arg(path.canonicalize().unwrap())
        .current_dir(folder.path())
        .output()
        .unwrap();
    let (out, err) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    assert!(run.status.success(), "{out}{err}");
    assert!(out.contains("R = inst + 23.474252 - 0.085569 X") && out.contains("23.474252)"), "{out}");
    assert!(out.contains("14 rows, skipped: 1 not to be included") && out.contains("N 13 used"), "{out}");
    assert!(out.contains("refused: no colour column") && err.contains("C refused"), "{out}{err}");
    // the residuals, catalogue minus fit, in the order of the table, as printed there
    let printed = [-0.008, 0.007, 0.004, -0.007, -0.001, 0.0, 0.004, 0.007, -0.004, 0.002, -0.003, 0.006, 0.0, -0.007];
    let rows = read_stars(&folder.path().join("matched.ecsv")).unwrap().0;
    assert_eq!(rows.len(), 14);
    for (row, printed) in rows.iter().zip(printed) {
        match row.fit_residual_mag {
            Some(residual) => assert!((residual + printed).abs() < 6e-4, "{} {residual} {printed}", row.star_id),
            None => assert_eq!((row.star_id.as_str(), row.reason.as_str()), ("99Z367", "not to be included")),
        }
    }
    let toml = std::fs::read_to_string(folder.path().join("zeropoint.toml")).unwrap();
    assert!(toml.contains("convention = \"R = R_inst") && toml.contains("MINST - 30"), "{toml}");
    // the magnitudes are not of electrons per second: no night may take this zeropoint for its own
    assert!(Zeropoint::read(&folder.path().join("zeropoint.toml")).is_err());

    // the robust fit of the same stars agrees within its error
    let z = fit_file(&path, &[], "R", &[]).unwrap().zeropoint.unwrap();
    assert!((30.0 - z.zp_mag - 23.474252).abs() < 3.0 * 30.0_f64.min(z.errs()[0]), "{z:?}");
    assert!(z.zp_mag - 6.525_748 < 0.01);
}

#[test]
fn calibrated_daytime_photometry_gives_back_the_zeropoint_it_was_made_with() {
    // calibed_mags = m_inst + 21.75804 - 0.357771 airmass, exactly
    let mut seen = 0;
    for name in ["SAOCOM-43641U", "starlink-2242-48587U", "starlink-2245-48589U", "starlink-3952-52534U"] {
        let Some(path) = shared(&format!("observations/daytime_{name}.csv")) else { return };
        let m = fit_file(&path, &[("v_mag", "calibed_mags")], "r", &[]).unwrap();
        let z = m.zeropoint.as_ref().unwrap();
        if z.k_note.starts_with("refused") {
            // a pass that stayed at one airmass: the zeropoint holds the extinction there
            let at = z.zp_mag - 0.357_771 * z.airmass_mean;
            assert!((at + 21.758_04).abs() < 0.02, "{name}: {}", m.text());
            continue;
        }
        seen += 1;
        assert!(
            (z.zp_mag + 21.758_04).abs() < 1e-5 && (z.k_mag_airmass - 0.357_771).abs() < 1e-5,
            "{name}: {}",
            m.text()
        );
    }
    assert!(seen > 0);
}

#[test]
fn a_list_of_sextractor_is_fitted_with_its_arbitrary_zeropoint() {
    let mut text = String::from(
        "#   1 NUMBER       Running object number\n#   2 MAG_AUTO     Kron-like elliptical aperture magnitude   [mag]\n\
         #   3 MAGERR_AUTO  RMS error for AUTO magnitude              [mag]\n#   4 FLUX_APER    Flux vector  [count]\n\
         #   6 AIRMASS\n#   7 Vmag\n#   8 e_Vmag\n#   9 Bmag\n#  10 FIELD_ID\n",
    );
    for (k, s) in stars().iter().enumerate() {
        let inst = 25.0 - 2.5 * s.flux_e_s.log10();
        let _ = writeln!(
            text,
            "  {k:5}  {inst:9.5} {:7.4} {:.1} {:.1} {:.4}  {:7.4} 0.0200 {:7.4} {}",
            s.err,
            s.flux_e_s,
            s.flux_e_s * 1.1,
            s.airmass,
            s.v,
            s.v + s.b_v,
            s.field
        );
    }
    let m = fit_text(&text, &[("pointing", "FIELD_ID")]).unwrap();
    let z = is_truth(&m, TRUTH[0] + 25.0);
    assert!(z.n_pointings == 8 && z.n_rejected >= 18, "{}", m.text());
    assert!(
        m.text().contains("inst: MAG_AUTO, its error: MAGERR_AUTO, V: Vmag, its error: e_Vmag, B-V: Bmag - Vmag"),
        "{}",
        m.text()
    );
    assert!(m.rows.iter().all(|r| r.inst_mag_err == Some(0.01) && r.fit_weight.is_some()));
    // the vector's second value is another column
    let m = fit_text(&text, &[("flux", "FLUX_APER_1"), ("inst_mag_err", "MAGERR_AUTO")]).unwrap();
    is_truth(&m, TRUTH[0] - 2.5 * 1.1_f64.log10());
}

#[test]
fn fluxes_in_adu_become_electrons_per_second_where_both_numbers_are_given() {
    let mut text = String::from("id,aperture_sum,aperture_sum_err,exptime,airmass,Vmag,B-V,image\n");
    for (k, s) in stars().iter().enumerate() {
        let exptime = 5.0 + (s.field % 3) as f64;
        let adu = s.flux_e_s * exptime / 0.8;
        let _ = writeln!(
            text,
            "{k},{adu},{},{exptime},{},{},{},im{}.fits",
            adu * s.err / 1.0857,
            s.airmass,
            s.v,
            s.b_v,
            s.field
        );
    }
    // four bad fluxes are excluded and counted
    text += "900,-5,1,5,1.2,12,0.5,im0.fits\n901,0,1,5,1.2,12,0.5,im0.fits\n902,nan,1,5,1.2,12,0.5,im0.fits\n903,10,1,0,1.2,12,0.5,im0.fits\n";
    let m = fit_text(&text, &[("e_per_adu", "0.8")]).unwrap();
    let z = is_truth(&m, TRUTH[0]);
    assert_eq!((m.excluded["flux not positive"], m.excluded["no flux"], m.excluded["no exposure time"]), (2, 1, 1));
    assert_eq!((m.rows.len(), z.n_pointings), (244, 8));
    assert_eq!(m.inst_unit, "-2.5 log10(electrons per second)");
    // then, and only then, a night may use it
    let folder = tempfile::tempdir().unwrap();
    let (toml, ecsv) = (folder.path().join("z.toml"), folder.path().join("m.ecsv"));
    satphot::pipeline::matched::write_matched(&m, &without_config(&[]).unwrap(), &toml, &ecsv).unwrap();
    assert_eq!(Zeropoint::read(&toml).unwrap().zp_mag, z.zp_mag);
    let rows = read_stars(&ecsv).unwrap().0;
    assert_eq!((rows.len(), rows[243].reason.as_str()), (244, "no exposure time"));
    assert!((rows[0].inst_mag_err.unwrap() - 0.01).abs() < 1e-4);
    // without e-/ADU the zeropoint is that of ADU/s, and the file says so
    let m = fit_text(&text, &[]).unwrap();
    is_truth(&m, TRUTH[0] + 2.5 * 0.8_f64.log10());
    assert!(m.inst_unit.contains("aperture_sum / exptime") && m.notes.iter().any(|n| n.contains("e_per_adu")), "{m:?}");
}

#[test]
fn real_columns_of_standards_carry_a_fit() {
    // the published magnitudes, errors and colours, measured by a made-up telescope
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut measured = |v: f64, b_v: f64| {
        let airmass = rng.random_range(1.0..2.0);
        let noise: f64 = 0.01 * rng.sample::<f64, _>(StandardNormal);
        (v + TRUTH[0] + TRUTH[1] * airmass + TRUTH[2] * b_v + noise, airmass)
    };
    let Some(path) = shared("standards/landolt_1992.dat") else { return };
    let mut text = String::new();
    for line in std::fs::read_to_string(path).unwrap().lines() {
        let cells: Vec<&str> = line.split_whitespace().collect();
        let (inst, airmass) = measured(cells[3].parse().unwrap(), cells[4].parse().unwrap());
        let _ = writeln!(text, "{line} {inst:.4} {airmass:.3}");
    }
    let columns = [
        ("id", "col1"),
        ("v_mag", "col4"),
        ("b_v_mag", "col5"),
        ("v_mag_err", "col12"),
        ("b_v_err_mag", "col13"),
        ("inst_mag", "col18"),
        ("airmass", "col19"),
    ];
    let m = fit_text(&text, &columns).unwrap();
    is_truth(&m, TRUTH[0]);
    assert_eq!((m.rows.len(), m.rows[0].star_id.as_str()), (526, "TPHE_A"));
    assert!(m.notes.iter().any(|n| n.contains("col19")), "{:?}", m.notes);

    // APASS as VizieR serves it: the same header with two columns more
    let Some(path) = shared("standards/apass_dr9_ey_uma.ecsv") else { return };
    let mut text = String::new();
    for line in std::fs::read_to_string(path).unwrap().lines() {
        let cells: Vec<&str> = line.split_whitespace().collect();
        let _ = match (line.starts_with('#'), cells.get(10).and_then(|v| v.parse::<f64>().ok())) {
            (true, _) => writeln!(text, "{line}"),
            (false, None) if line.starts_with("_r") => writeln!(text, "{line} MAG_BEST airmass"),
            (false, None) => writeln!(text, "{line} \"\" 1.1"),
            (false, Some(v)) => {
                let (inst, airmass) = measured(v, cells[8].parse().unwrap_or(0.6));
                writeln!(text, "{line} {:.4} {airmass:.3}", inst + 25.0)
            }
        };
    }
    let m = fit_text(&text, &[]).unwrap();
    let z = m.zeropoint.clone().unwrap();
    assert!(m.text().contains("V: Vmag, its error: e_Vmag, B-V: B-V, its error: e_B-V"), "{}", m.text());
    // 51 stars with errors of 0.02 to 0.1 mag as weights
    assert!((z.zp_mag - TRUTH[0] - 25.0).abs() < 0.1 && z.n_used > 40, "{}", m.text());
}

#[test]
fn a_plain_column_of_magnitudes_is_whichever_is_missing() {
    let (mut detections, mut catalogue) =
        (String::from("x y mag magerr cat_mag BV airmass\n"), String::from("flux,fluxerr,mag,color,airmass\n"));
    for s in stars() {
        let inst = -2.5 * s.flux_e_s.log10();
        let _ = writeln!(detections, "10.5 20.5 {inst} {} {} {} {}", s.err, s.v, s.b_v, s.airmass);
        let _ = writeln!(catalogue, "{},{},{},{},{}", s.flux_e_s, s.flux_e_s * s.err, s.v, s.b_v, s.airmass);
    }
    let m = fit_text(&detections, &[]).unwrap();
    is_truth(&m, TRUTH[0]);
    assert!(m.text().contains("inst: mag, its error: magerr, V: cat_mag, B-V: BV"), "{}", m.text());
    assert!(m.notes.iter().any(|n| n.contains("`band`")), "{:?}", m.notes);
    let m = fit_text(&catalogue, &[]).unwrap();
    is_truth(&m, TRUTH[0]);
    assert!(m.text().contains("V = V_inst - ZP - k X - C (color)"), "{}", m.text());
}

#[test]
fn a_column_that_is_not_there_costs_its_term_and_not_the_fit() {
    let mut text = String::from("inst_mag,Vmag,alt_deg\n");
    let all = stars();
    for s in all.iter().filter(|s| s.field == 0) {
        let _ = writeln!(text, "{},{},77.5", -2.5 * s.flux_e_s.log10(), s.v);
    }
    let z = fit_text(&text, &[]).unwrap().zeropoint.unwrap();
    assert!(z.k_note.contains("refused: all stars within") && z.c_note == "refused: no colour column", "{z:?}");
    let no_airmass = text.replace("alt_deg", "other");
    let m = fit_text(&no_airmass, &[]).unwrap();
    let z = m.zeropoint.clone().unwrap();
    assert!(z.k_note == "refused: no airmass column" && z.k_mag_airmass == 0.0 && z.airmass_mean.is_nan(), "{z:?}");
    assert!(z.warnings.iter().any(|w| w.contains("`column` airmass")), "{:?}", z.warnings);
    assert!(m.rows.iter().all(|r| r.airmass.is_none() && r.inst_mag_err.is_none() && r.snr.is_none()));
    // the mean of 30 stars at X = 1 and mean colour 0.65 +- 0.26/sqrt(30), without blends
    assert!((z.zp_mag - (TRUTH[0] + TRUTH[1] + TRUTH[2] * 0.65)).abs() < 0.02, "{z:?}");
    // a number for all rows and a held term use the airmass again
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), &no_airmass).unwrap();
    let held = fit_file(file.path(), &[("airmass", "1.0")], "V", &["zeropoint.pin_k={value=0.12}"]).unwrap();
    let held = held.zeropoint.unwrap();
    assert!((held.zp_mag - (z.zp_mag - 0.12)).abs() < 1e-9 && held.k_mag_airmass == 0.12, "{held:?}");
    for (set, word) in [("zeropoint.pin_k={value=0.12}", "airmass"), ("zeropoint.pin_c={value=0.1}", "colour")] {
        let error = fit_file(file.path(), &[], "V", &[set]).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("`column"), "{error}");
    }
}

#[test]
fn cuts_requested_by_settings_are_made_and_counted() {
    let mut text = String::from("inst_mag,Vmag,e_Vmag,B-V,airmass\n");
    for s in stars() {
        let _ = writeln!(text, "{},{},0.02,{},{}", -2.5 * s.flux_e_s.log10(), s.v, s.b_v, s.airmass);
    }
    text += "-11,99.999,0.02,0.5,1.2\n-11,12,0.02,,1.2\n-11,12,0.02,0.5,\n-11,12\n";
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), &text).unwrap();
    let m = fit_file(file.path(), &[], "V", &["stars.bv_range_mag=[0.2, 0.9]"]).unwrap();
    let z = is_truth(&m, TRUTH[0]);
    let count = |word: &str| m.excluded.iter().filter(|(r, _)| r.starts_with(word)).map(|(_, n)| n).sum::<usize>();
    let red = stars().iter().filter(|s| s.b_v > 0.9).count();
    assert_eq!(
        (count("colour"), count("no V"), count("no colour"), count("no airmass"), count("damaged row")),
        (red, 1, 1, 1, 1)
    );
    assert!(z.b_v_range_mag[1] <= 0.9 && z.n_used + z.n_rejected == 240 - red, "{}", m.text());
}

#[test]
fn a_table_of_several_filters_and_the_letters_of_textbooks_are_understood() {
    // V, B-V: standard; v: instrumental; X: airmass
    let mut text = String::from("star,filter,v,X,V,B-V\n");
    for (k, s) in stars().iter().enumerate() {
        let inst = -2.5 * s.flux_e_s.log10();
        let _ = writeln!(text, "{k},V,{inst},{},{},{}", s.airmass, s.v, s.b_v);
        let _ = writeln!(text, "{k},B,{},{},{},{}", inst + 0.3 + s.b_v, s.airmass, s.v, s.b_v);
    }
    let m = fit_text(&text, &[]).unwrap();
    is_truth(&m, TRUTH[0]);
    assert_eq!(m.excluded["other filter"], 240, "{}", m.text());
    // the errors of a colour made of two columns are those of both, by their names or as the user says
    let mut text_g = String::from("flux_e,exptime,V_psf,e_V_psf,R_psf,e_R_psf,airmass\n");
    for s in stars() {
        let _ = writeln!(text_g, "{},1,{},0.03,{},0.04,{}", s.flux_e_s, s.v, s.v - s.b_v, s.airmass);
    }
    // magnitudes of g are no V
    let other = fit_text(&text_g.replace("V_psf", "g_psf"), &[("v_mag", "g_psf"), ("b_v_mag", "g_psf-R_psf")]);
    assert!(other.unwrap_err().to_string().contains("say argument `band g`"));
    let m = fit_text(&text_g, &[("v_mag", "V_psf"), ("b_v_mag", "V_psf-R_psf")]).unwrap();
    assert!(
        (m.rows[0].catalogue_b_v_mag_err.unwrap() - 0.05).abs() < 1e-12 && m.colour == "V_psf-R_psf",
        "{}",
        m.text()
    );
    is_truth(&m, TRUTH[0]);
    let error = fit_text(&text.replace(",V,-", ",Luminance,-"), &[]).unwrap_err().to_string();
    assert!(error.contains("B, Luminance") && error.contains("`band`"), "{error}");
    // a position is no airmass
    let m = fit_text(&text.replace("star,filter,v,X,", "Y,filter,v,X,"), &[]).unwrap();
    assert_eq!(m.zeropoint.unwrap().k_note, "refused: no airmass column");
}

#[test]
fn what_cannot_be_fitted_says_which_column_is_missing_and_how_to_name_it() {
    let said = |text: &str, columns: &[(&str, &str)]| fit_text(text, columns).unwrap_err().to_string();
    let message = said("a,b\n1,2\n", &[]);
    assert!(message.contains("`column` v_mag=NAME") && message.contains("present: a, b"), "{message}");
    let message = said("Vmag,b\n1,2\n", &[]);
    assert!(message.contains("`column` inst_mag=NAME"), "{message}");
    let message = said("Vmag,b\n1,2\n", &[("inst_mag", "c")]);
    assert!(message.contains("`column inst_mag=c`") && message.contains("present: Vmag, b"), "{message}");
    let message = said("Vmag,b\n1,2\n", &[("magnitude", "b")]);
    assert!(message.contains("magnitude") && message.contains("e_per_adu"), "{message}");
    let message = said("Vmag,b\n1,2\n", &[("inst_mag", "Vmag")]);
    assert!(message.contains("both magnitudes"), "{message}");
    // too few stars: no fit, but a table that says why
    let m = fit_text("inst_mag,Vmag\n-10,12\n-11,11\n", &[]).unwrap();
    assert!(m.zeropoint.unwrap_err().contains("2"), "");
    assert!(matches!(fit_text("", &[]), Err(Error::Table { .. })));
}

#[test]
fn the_verb_needs_no_configuration_writes_next_to_its_output_and_never_over_its_input() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("MAG_AUTO;Vmag;airmass;mjd\n");
    for s in stars() {
        let _ =
            writeln!(text, "{};{};{};{}", 25.0 - 2.5 * s.flux_e_s.log10(), s.v, s.airmass, 60_000.0 + s.field as f64);
    }
    std::fs::write(folder.path().join("matched.ecsv"), &text).unwrap();
    let run = |args: &[&str]| {
        let run = Command::new(env!("CARGO_BIN_EXE_satphot"))
            .arg("zeropoint")
            .args(args)
            .current_dir(folder.path())
            .output()
            .unwrap();
        (
            run.status.code().unwrap(),
            String::from_utf8_lossy(&run.stdout).into_owned() + &String::from_utf8_lossy(&run.stderr),
        )
    };
    let (code, message) = run(&["--matched", "matched.ecsv"]);
    assert!(code == 2 && message.contains("written over"), "{code} {message}");
    assert_eq!(std::fs::read_to_string(folder.path().join("matched.ecsv")).unwrap(), text);
    std::fs::create_dir(folder.path().join("out")).unwrap();
    let (code, message) = run(&["--matched", "matched.ecsv", "-o", "out/z.toml"]);
    // eight nights, eight pointings
    assert!(code == 0 && message.contains("8 pointings"), "{code} {message}");
    assert!(folder.path().join("out/z.toml").exists() && folder.path().join("out/matched.ecsv").exists());
    let (code, message) = run(&["--matched", "matched.ecsv", "-c", "none.toml"]);
    assert!(code == 4 && message.contains("none.toml"), "{code} {message}");
    let (code, message) = run(&["--column", "inst_mag=MAG_AUTO"]);
    assert!(code == 2 && message.contains("--matched"), "{code} {message}");
    let (code, message) = run(&["--matched", "matched.ecsv", "--column", "inst_mag"]);
    assert!(code == 2 && message.contains("KEY=NAME"), "{code} {message}");
}

#[test]
fn more_repeated_stars_and_pointings_than_a_fit_of_both_can_hold_are_refused_with_their_numbers() {
    let table = |pointings: usize, visits: usize| {
        let mut text = String::from("star_id,inst_mag,Vmag,B-V,airmass,pointing\n");
        for k in 0..3 * pointings {
            let star = k % (3 * pointings / visits);
            let (v, airmass) = (9.0 + 0.001 * (star % 997) as f64, 1.0 + 0.01 * (k % 101) as f64);
            let inst = v + TRUTH[0] + TRUTH[1] * airmass + 0.001 * (k % 13) as f64;
            let _ = writeln!(text, "s{star},{inst},{v},0.{},{airmass},p{}", 1 + star % 9, k % pointings);
        }
        text
    };
    let refused = fit_text(&table(2_100, 2), &[]).unwrap().zeropoint.unwrap_err();
    for word in ["3150 stars", "2100 pointings", "at most 2000", "zeropoint.estimator", "`column` id"] {
        assert!(refused.contains(word), "{word}: {refused}");
    }
    // each star once: no offsets of stars, and any number of pointings
    let z = fit_text(&table(30_000, 1), &[]).unwrap().zeropoint.unwrap();
    assert!(z.n_used > 80_000 && (z.k_mag_airmass - TRUTH[1]).abs() < 0.01, "{} rows, k {}", z.n_used, z.k_mag_airmass);
}
