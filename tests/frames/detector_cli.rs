//! `satphot detector` and the checks of a run: what the frames say against table and headers, on good and damaged files.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::path::{Path, PathBuf};

use ndarray::Array2;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use satphot::fits::{CardValue, write_u16};
use support::{Night, RunOutput, satphot, simulated};

/// A camera that writes frames of 320x256 px.
#[derive(Clone)]
struct Camera {
    setting: i64,
    e_per_adu: f64,
    read_noise_e: f64,
    pedestal_adu: f64,
    step: f64,
    max_adu: f64,
    cards: Vec<(&'static str, CardValue)>,
}

/// The ASI6200 at setting 200 as the table has it.
fn asi6200() -> Camera {
    Camera {
        setting: 200,
        e_per_adu: 5530.0 / 65535.0,
        read_noise_e: 1.45,
        pedestal_adu: 500.0,
        step: 1.0,
        max_adu: 65_535.0,
        cards: vec![("INSTRUME", CardValue::Text("ZWO ASI6200MM Pro".into()))],
    }
}

impl Camera {
    /// A frame of `level` ADU above the pedestal, with 12 stars of ten times full scale if it is a light.
    fn write(&self, dir: &Path, name: &str, kind: &str, level: f64, seed: u64, (nx, ny): (usize, usize)) -> PathBuf {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let unit = Normal::new(0.0, 1.0).unwrap();
        let light = kind.starts_with("Light");
        let pixels = Array2::from_shape_fn((ny, nx), |(j, i)| {
            let (u, v) = (i as f64 / nx as f64 - 0.5, j as f64 / ny as f64 - 0.5);
            // the same pixel response in every frame
            let response = 1.0 + 0.01 * (((i * 7919 + j * 104_729) % 1009) as f64 / 1009.0 - 0.5);
            let mut e = level * self.e_per_adu * (1.0 - 0.4 * (u * u + v * v)) * response;
            if light && seed > 0 {
                let (x, y) = ((i % 80) as f64 - 40.0, (j % 85) as f64 - 40.0);
                e += 10.0 * self.max_adu * self.e_per_adu * (-(x * x + y * y) / 18.0).exp();
            }
            let noise = (e + self.read_noise_e.powi(2)).sqrt() * unit.sample(&mut rng);
            let adu = self.pedestal_adu + (e + noise) / self.e_per_adu;
            ((adu / self.step).round() * self.step).clamp(0.0, self.max_adu) as u16
        });
        let mut cards = vec![
            ("IMAGETYP".to_string(), CardValue::Text(kind.into()), String::new()),
            ("EXPTIME".into(), CardValue::Real(if kind.starts_with("Bias") { 1e-4 } else { 2.0 }), String::new()),
            ("GAIN".into(), CardValue::Integer(self.setting), String::new()),
            ("DATE-OBS".into(), CardValue::Text("2025-06-09T10:33:00.500".into()), String::new()),
        ];
        cards.extend(self.cards.iter().map(|(k, v)| (k.to_string(), v.clone(), String::new())));
        let path = dir.join(name);
        write_u16(&path, &pixels, &cards, false).unwrap();
        path
    }

    fn flats(&self, dir: &Path, prefix: &str, levels: &[f64], seed: u64) {
        for (k, level) in levels.iter().enumerate() {
            self.write(dir, &format!("{prefix}{k}.fits"), "Flat Frame", *level, seed + k as u64, (320, 256));
        }
    }

    fn biases(&self, dir: &Path) {
        for k in 0..2 {
            self.write(dir, &format!("bias{k}.fits"), "Bias Frame", 0.0, 900 + k, (320, 256));
        }
    }
}

fn dir() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn detector(folder: &Path, more: &[&str]) -> RunOutput {
    satphot(folder, &[&["detector", "."], more].concat()).expect(0, &[])
}

fn checks(folder: &Path) -> Vec<toml::Table> {
    let text = std::fs::read_to_string(folder.join("checks/detector.toml")).unwrap();
    let file: toml::Table = text.parse().unwrap();
    file["gain"].as_array().unwrap().iter().map(|g| g.as_table().unwrap().clone()).collect()
}

fn number(check: &toml::Table, key: &str) -> f64 {
    let value = check.get(key).unwrap_or_else(|| panic!("no {key} in {check:#?}"));
    value.as_float().or(value.as_integer().map(|i| i as f64)).unwrap()
}

fn n_warnings(check: &toml::Table) -> usize {
    check["warnings"].as_array().unwrap().len()
}

#[test]
fn frames_of_a_good_camera_agree_with_its_table_in_every_number() {
    let d = dir();
    let camera = asi6200();
    camera.flats(d.path(), "a", &[30_000.0, 31_000.0, 9_000.0, 9_200.0], 1);
    camera.biases(d.path());
    camera.write(d.path(), "light.fits", "Light Frame", 300.0, 77, (320, 256));
    let output = detector(d.path(), &["-o", "checks"]);
    assert!(output.out.contains("agree: 2 pairs") && !output.out.contains("WARNING"), "{}", output.out);
    let check = &checks(d.path())[0];
    assert_eq!((number(check, "setting"), check["verdict"].as_str()), (200.0, Some("agree")));
    let (g, err) = (number(check, "measured_e_per_adu"), number(check, "measured_err_e_per_adu"));
    assert!((g / camera.e_per_adu - 1.0).abs() < 0.03 && (g - camera.e_per_adu).abs() < 4.0 * err, "{g} +- {err}");
    assert!((number(check, "read_noise_e") - 1.45).abs() < 0.05, "{check:#?}");
    assert!((number(check, "pedestal_adu") - 500.0).abs() < 0.5, "{check:#?}");
    assert_eq!((number(check, "step_adu"), number(check, "saturation_adu")), (1.0, 65_535.0));
    assert_eq!((number(check, "converter_bits"), n_warnings(check)), (16.0, 0));
    let svg = std::fs::read_to_string(d.path().join("checks/photon_transfer.svg")).unwrap();
    assert!(svg.contains("setting 200") && svg.contains("</svg>"));
    // with three levels and more the slope is used
    camera.flats(d.path(), "b", &[2_000.0, 2_050.0, 50_000.0, 50_500.0], 20);
    let output = detector(d.path(), &["-o", "checks", "--pedestal", "500"]);
    assert!(output.out.contains("4 pairs") && output.out.contains("slope"), "{}", output.out);
    let g = number(&checks(d.path())[0], "measured_e_per_adu");
    assert!((g / camera.e_per_adu - 1.0).abs() < 0.03, "{g}");
}

#[test]
fn egain_per_count_of_a_padded_converter_is_found_out() {
    let d = dir();
    // 12 bits of 3.6 e- each in the upper bits of 16; the driver's EGAIN is that of the 12-bit count
    let camera = Camera {
        setting: 0,
        e_per_adu: 3.6 / 16.0,
        read_noise_e: 3.0,
        step: 16.0,
        max_adu: 65_520.0,
        cards: vec![("EGAIN", CardValue::Real(3.6)), ("BITDEPTH", CardValue::Integer(12))],
        ..asi6200()
    };
    camera.flats(d.path(), "f", &[30_000.0, 30_500.0], 5);
    camera.biases(d.path());
    camera.write(d.path(), "light.fits", "Light Frame", 300.0, 78, (320, 256));
    let output = detector(d.path(), &["-o", "checks"]);
    for word in ["WARNING", "EGAIN of the header says 3.6", "16 ADU apart", "12 bits padded to 16", "it is 0.225"] {
        assert!(output.out.contains(word), "{word}\n{}", output.out);
    }
    let check = &checks(d.path())[0];
    assert_eq!((number(check, "step_adu"), number(check, "converter_bits")), (16.0, 12.0));
    assert_eq!((number(check, "saturation_adu"), check["verdict"].as_str()), (65_520.0, Some("disagree")));
    assert!((number(check, "measured_e_per_adu") / 0.225 - 1.0).abs() < 0.03);
    // with EGAIN per ADU of the file all is well
    let d = dir();
    let right = Camera { cards: vec![("EGAIN", CardValue::Real(0.225))], ..camera };
    right.flats(d.path(), "f", &[30_000.0, 30_500.0], 5);
    right.biases(d.path());
    let output = detector(d.path(), &["-o", "checks"]);
    assert!(!output.out.contains("WARNING") && output.out.contains("agree"), "{}", output.out);
}

#[test]
fn one_flat_or_flats_of_two_settings_give_no_gain() {
    let d = dir();
    asi6200().flats(d.path(), "a", &[30_000.0], 1);
    asi6200().biases(d.path());
    let output = detector(d.path(), &["-o", "checks"]);
    assert!(output.out.contains("needs two flats of one setting; there is one"), "{}", output.out);
    assert!(std::fs::read_to_string(d.path().join("checks/photon_transfer.svg")).unwrap().contains("no data"));
    // another setting: two groups, not a pair
    Camera { setting: 250, e_per_adu: 3052.0 / 65535.0, ..asi6200() }.flats(d.path(), "b", &[30_000.0], 2);
    let output = detector(d.path(), &["--pedestal", "500"]);
    assert_eq!(output.out.matches("there is one").count(), 2, "{}", output.out);
    // without bias frames, pedestal or configuration nothing is assumed
    let d = dir();
    asi6200().flats(d.path(), "a", &[30_000.0, 30_100.0], 1);
    let output = detector(d.path(), &[]);
    assert!(output.out.contains("pedestal not known"), "{}", output.out);
}

#[test]
fn damaged_flats_are_skipped_with_their_reason_and_the_others_give_the_gain() {
    let d = dir();
    let camera = asi6200();
    camera.flats(d.path(), "good", &[30_000.0, 30_400.0], 1);
    camera.biases(d.path());
    camera.write(d.path(), "small.fits", "Flat Frame", 30_000.0, 8, (160, 128));
    Camera { cards: vec![("XBINNING", CardValue::Integer(2))], ..camera.clone() }.write(
        d.path(),
        "binned.fits",
        "Flat Frame",
        30_000.0,
        9,
        (320, 256),
    );
    let cut = camera.write(d.path(), "cut.fits", "Flat Frame", 30_000.0, 10, (320, 256));
    let bytes = std::fs::read(&cut).unwrap();
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    std::fs::write(d.path().join("junk.fits"), b"not a FITS file").unwrap();
    let output = detector(d.path(), &["-o", "checks"]).expect(0, &["cut.fits", "junk.fits"]);
    let found = checks(d.path());
    assert_eq!(found.len(), 2, "binning 1 and 2\n{}", output.out);
    let g = number(&found[0], "measured_e_per_adu");
    assert!((g / camera.e_per_adu - 1.0).abs() < 0.03, "{g}");
    assert_eq!(found[1]["verdict"].as_str(), Some("not measured"));
}

#[test]
fn copies_saturated_dark_and_calibrated_flats_are_reported() {
    let camera = asi6200();
    let output = |levels: &[f64]| {
        let d = dir();
        camera.flats(d.path(), "f", levels, 1);
        camera.biases(d.path());
        detector(d.path(), &[]).out
    };
    let full = output(&[80_000.0, 81_000.0]);
    assert!(full.contains("saturated: ") && full.contains("blocks hold pixels"), "{full}");
    let dark = output(&[1.0, 1.0]);
    assert!(dark.contains("too dark"), "{dark}");
    let unlike = output(&[10_000.0, 40_000.0]);
    assert!(unlike.contains("levels too far apart"), "{unlike}");
    let d = dir();
    camera.biases(d.path());
    camera.flats(d.path(), "f", &[30_000.0], 1);
    std::fs::copy(d.path().join("f0.fits"), d.path().join("f1.fits")).unwrap();
    let copy = detector(d.path(), &[]).out;
    assert!(copy.contains("WARNING") && copy.contains("one is a copy of the other"), "{copy}");
}

#[test]
fn a_wrong_table_a_wrong_pedestal_and_a_lower_converter_are_warnings() {
    let d = dir();
    let camera = Camera { max_adu: 16_383.0, ..asi6200() };
    camera.flats(d.path(), "f", &[9_000.0, 9_100.0], 1);
    camera.biases(d.path());
    camera.write(d.path(), "light.fits", "Light Frame", 300.0, 79, (320, 256));
    let output =
        detector(d.path(), &["--camera", "asi6200mm", "--pedestal", "600", "--set", "detector.e_per_adu.200=0.095"]);
    for word in [
        "off; every magnitude",
        "check detector.e_per_adu",
        "bias frames lie at",
        "pile up at 16383 ADU",
        "adc_max_adu = 16383",
    ] {
        assert!(output.out.contains(word), "{word}\n{}", output.out);
    }
    // SATURATE of the header against the pile and against the table
    let d = dir();
    let camera = Camera { cards: vec![("SATURATE", CardValue::Integer(50_000))], ..asi6200() };
    camera.write(d.path(), "light.fits", "Light Frame", 300.0, 80, (320, 256));
    let output = detector(d.path(), &["--camera", "asi6200mm", "--pedestal", "500"]);
    assert!(output.out.contains("SATURATE of the header says 50000 ADU"), "{}", output.out);
    // read noise of twice the table
    let d = dir();
    let camera = Camera { read_noise_e: 3.0, ..asi6200() };
    camera.flats(d.path(), "f", &[20_000.0, 20_100.0], 3);
    camera.biases(d.path());
    let output = detector(d.path(), &["--camera", "asi6200mm", "--pedestal", "500"]);
    assert!(output.out.contains("from bias frames, but 1.45 in use"), "{}", output.out);
}

#[test]
fn the_overscan_stands_in_for_bias_frames_and_a_file_named_twice_is_one() {
    let d = dir();
    // the pixel response of the rightmost columns is that of the rest; only the card makes them an overscan
    let camera = Camera { cards: vec![("BIASSEC", CardValue::Text("[301:320,1:256]".into()))], ..asi6200() };
    let flat = camera.write(d.path(), "f.fits", "Flat Frame", 0.0, 1, (320, 256));
    let output = detector(d.path(), &["-o", "checks", "--flat", "f.fits", "./f.fits", flat.to_str().unwrap()]);
    assert!(output.out.contains("1 flat,") && output.out.contains("of the overscan"), "{}", output.out);
    assert!((number(&checks(d.path())[0], "pedestal_adu") - 500.0).abs() < 1.5);
    // a section outside the frame, and one that is none
    for section in ["[301:420,1:256]", "[N/A]", "[320:301,1:256]", "[0:5,1:256]"] {
        let d = dir();
        let camera = Camera { cards: vec![("BIASSEC", CardValue::Text(section.into()))], ..asi6200() };
        camera.write(d.path(), "f.fits", "Flat Frame", 100.0, 1, (320, 256));
        assert!(detector(d.path(), &[]).out.contains("needs a bias frame"), "{section}");
    }
}

#[test]
fn init_measures_a_camera_that_neither_table_nor_headers_know() {
    let homemade = Camera {
        e_per_adu: 0.61,
        read_noise_e: 4.2,
        cards: vec![("INSTRUME", CardValue::Text("homemade".into()))],
        ..asi6200()
    };
    let d = dir();
    homemade.flats(d.path(), "f", &[20_000.0, 20_100.0, 19_900.0, 20_050.0], 3);
    homemade.biases(d.path());
    homemade.write(d.path(), "light.fits", "Light Frame", 300.0, 80, (320, 256));
    let text = satphot(d.path(), &["init", ".", "-"]).expect(0, &[]).out;
    let line = |table: &str| {
        let after = text.split_once(table).unwrap_or_else(|| panic!("no {table} in\n{text}")).1;
        let line = after.lines().find(|l| l.starts_with("\"200\"")).unwrap_or_else(|| panic!("{text}"));
        let (value, why) = line.split_once('=').unwrap().1.split_once('#').unwrap();
        let err: f64 = why.split_once("+- ").unwrap().1.split(':').next().unwrap().trim().parse().unwrap();
        (value.trim().parse::<f64>().unwrap(), err)
    };
    let (e_per_adu, err) = line("[detector.e_per_adu]");
    assert!((e_per_adu - 0.61).abs() < 3.0 * err && err < 0.02, "{e_per_adu} +- {err}");
    let (read_noise_e, err) = line("[detector.read_noise_e]");
    assert!((read_noise_e - 4.2).abs() < 3.0 * err + 0.1 && err < 0.3, "{read_noise_e} +- {err}");
    assert!(text.contains("gain_table_err_mag = 0.0") && !text.contains("# [detector.e_per_adu]"), "{text}");
    // one flat and no biases say nothing, and the file says what is missing
    let d = dir();
    homemade.flats(d.path(), "f", &[20_000.0], 3);
    homemade.write(d.path(), "light.fits", "Light Frame", 300.0, 80, (320, 256));
    let output = satphot(d.path(), &["init", ".", "-"]).expect(0, &[]);
    assert!(output.out.contains("# [detector.e_per_adu]") && output.out.contains("# \"200\" = "), "{}", output.out);
    assert!(format!("{}{}", output.out, output.err).contains("`satphot detector` measures it"), "{}", output.err);
    // a camera of the table is not measured
    let d = dir();
    asi6200().flats(d.path(), "f", &[20_000.0, 20_100.0], 3);
    asi6200().write(d.path(), "light.fits", "Light Frame", 300.0, 80, (320, 256));
    assert!(!satphot(d.path(), &["init", ".", "-"]).expect(0, &[]).out.contains("e_per_adu"));
}

#[test]
fn the_program_says_what_it_needs() {
    let d = dir();
    satphot(d.path(), &["detector"]).expect(4, &["name flats and bias frames", "--help"]).without_results();
    satphot(d.path(), &["detector", "nothing.fits"]).expect(4, &["nothing.fits"]).without_results();
    satphot(d.path(), &["detector", "-c", "mine.toml", "."]).expect(4, &["mine.toml"]).without_results();
    let help = satphot(d.path(), &["detector", "--help"]).expect(0, &[]).out;
    for word in ["two flats one after the other", "two bias frames", "-o checks", "level / variance"] {
        assert!(help.contains(word), "{word}\n{help}");
    }
}

#[test]
fn a_run_is_silent_about_a_good_detector_and_warns_of_a_wrong_one() {
    let detector_notes = |night: &Night| -> Vec<String> {
        night.run().unwrap().notes.into_iter().filter(|n| n.starts_with("detector: ")).collect()
    };
    let original = simulated("detector_run", &[]);
    let good = Night::copy_of(&original);
    assert_eq!(detector_notes(&good), Vec::<String>::new());
    let text = good.text("detector.toml");
    assert!(text.contains("verdict = \"agree\"") && text.contains("measured_e_per_adu"), "{text}");
    assert!(good.manifest()["outputs"].to_string().contains("detector.toml"));

    let wrong = Night::copy_of(&original).set("detector.e_per_adu.200=0.1");
    let notes = detector_notes(&wrong);
    assert!(
        notes.iter().any(|n| n.contains("gain setting 200") && n.contains("0.1 in use (pipeline.toml)")),
        "{notes:?}"
    );
    assert!(wrong.text("satphot.log").contains("every magnitude"));
    let high = detector_notes(&Night::copy_of(&original).set("detector.pedestal_adu=2500"));
    assert!(high.iter().any(|n| n.contains("the pedestal is too high")), "{high:?}");
    // a master flat made before: no flats are needed, nothing is measured, nothing is said
    let bare = Night::copy_of(&original).remove("flat_");
    assert_eq!(detector_notes(&bare), Vec::<String>::new());
    assert!(bare.text("detector.toml").contains("no flats"));
}

#[test]
fn the_committed_night_has_no_false_warning() {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/night/pipeline.toml");
    let output = detector(config.parent().unwrap(), &["-c", config.to_str().unwrap()]);
    assert!(output.out.contains("agree: 2 pairs") && !output.out.contains("WARNING"), "{}", output.out);
}

#[test]
fn a_real_camera_of_twelve_bits_is_recognised_from_single_frames() {
    let frames = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/frames");
    if !frames.join("huntsman_flat.fits").exists() {
        println!("skipped: ../shared/data/frames not present");
        return;
    }
    let file = |name: &str| frames.join(name).to_str().unwrap().to_string();
    let [flat, bias, dark, science] = ["flat", "bias", "dark", "science"].map(|n| file(&format!("huntsman_{n}.fits")));
    let d = dir();
    let output = satphot(
        d.path(),
        &[
            "detector",
            &dark,
            &science,
            "--flat",
            &flat,
            "--bias",
            &bias,
            "-o",
            "checks",
            "--set",
            "header.aliases.gain=[\"CAM-GAIN\"]",
        ],
    )
    .expect(0, &[]);
    println!("{}", output.out);
    let check = &checks(d.path())[0];
    // its counts are those of the converter, 0 to 4095, and full pixels stand at 4094
    assert_eq!((number(check, "setting"), number(check, "step_adu")), (100.0, 1.0));
    assert_eq!((number(check, "saturation_adu"), number(check, "saturated_px")), (4_094.0, 82.0));
    assert_eq!((number(check, "converter_bits"), number(check, "header_bits")), (12.0, 12.0));
    // the bias frame is 32 everywhere
    assert_eq!((number(check, "pedestal_adu"), number(check, "pedestal_err_adu")), (32.0, 0.0));
    assert!((number(check, "header_e_per_adu") - 1.144_74).abs() < 1e-4);
    assert!(check["method"].as_str().unwrap().contains("needs two flats of one setting; there is one"));
    assert!(output.out.contains("EGAIN is per ADU of the file: 4688 e- at 12 bits"), "{}", output.out);
    assert_eq!(n_warnings(check), 0, "{check:#?}");
}
