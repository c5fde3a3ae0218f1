//! `satphot limits tracked`: the published limits, the laws of signal and noise, the sky, what is refused.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;

use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal, Poisson};
use satphot::frames::pixel_scale_arcsec;
use satphot::visibility::sky_brightness::{MoonInSky, moonlight_nl, moonlit_sky_v_mag_arcsec2};
use satphot::visibility::sky_brightness_table::sky_of_v;
use satphot::visibility::telescope::macquarie;
use satphot::visibility::tracked::{Area, Noise, limit_mag};
use serde_json::Value;
use support::{RunOutput, satphot};

fn tracked(more: &[&str]) -> RunOutput {
    let empty = tempfile::tempdir().unwrap();
    satphot(empty.path(), &[&["limits", "tracked"], more].concat())
}

type Row = HashMap<String, String>;

fn rows(output: RunOutput) -> Vec<Row> {
    let text = output.expect(0, &[]).out;
    csv::Reader::from_reader(text.as_bytes()).deserialize().map(Result::unwrap).collect()
}

fn number(row: &Row, name: &str) -> f64 {
    row[name].parse().unwrap_or(f64::NAN)
}

/// The row of what is detected at a ratio under a sky.
fn find<'a>(rows: &'a [Row], sky: &str, of: &str, snr: f64) -> &'a Row {
    rows.iter().find(|r| r["sky"].contains(sky) && r["limit_of"] == of && number(r, "snr") == snr).unwrap()
}

#[test]
fn every_reference_point_of_detection_sky_and_instrument_is_met() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/reference/points.json");
    let Ok(text) = std::fs::read_to_string(path) else {
        println!("skipped: ../shared/reference/points.json not present");
        return;
    };
    let points: Value = serde_json::from_str(&text).unwrap();
    let mut met = 0;
    for point in points.as_array().unwrap() {
        let input = |name: &str| point["inputs"][name].as_f64().unwrap();
        let id = point["id"].as_str().unwrap();
        let got = match id {
            "etc_1sig_full" | "etc_5sig_full" => {
                let noise = Noise { sky_e_s: 0.0, dark_e_s: 0.0, read_noise_e: input("noise_var_e2").sqrt() };
                limit_mag(input("zp_pix_1e_per_s"), &noise, input("t"), 1, input("snr")).unwrap()
            }
            "ks_sky_moon_nL" => {
                let alt = |zenith: &str| (90.0 - input(zenith)).to_radians();
                let moon = MoonInSky {
                    alt_rad: alt("Zmoon"),
                    phase_rad: input("alpha").to_radians(),
                    sep_rad: input("rho").to_radians(),
                };
                moonlight_nl(input("k"), alt("Z"), moon)
            }
            "pixel_scale_cdk24" => pixel_scale_arcsec(input("pixel_um"), 1, input("focal_mm")),
            _ => continue,
        };
        let (expected, tolerance) = (point["expected"].as_f64().unwrap(), point["tolerance"].as_f64().unwrap());
        let scale = if point["tolerance_kind"] == "rel" { expected.abs() } else { 1.0 };
        assert!((got - expected).abs() <= tolerance * scale, "{id}: {got} {expected}");
        met += 1;
    }
    assert_eq!(met, 4);
}

#[test]
fn the_published_limits_come_out_of_the_command_with_the_skies_of_the_decam_calculator() {
    let rows = rows(tracked(&[
        "--band",
        "g",
        "--zp-pixel-mag",
        "21.624",
        "--read-noise-e",
        "2.7",
        "--dark-e-s",
        "0",
        "--csv",
    ]));
    for (sky, snr, published, variance) in [
        ("full Moon", 1.0, "21.65", 84.6),
        ("full Moon", 5.0, "19.67", 84.6),
        ("new Moon", 1.0, "22.56", 13.6),
        ("new Moon", 5.0, "20.27", 13.6),
    ] {
        let row = find(&rows, sky, "one pixel", snr);
        assert_eq!(format!("{:.2}", number(row, "mu_limit_mag_arcsec2")), published, "{row:?}");
        // the published variances were inferred with a zeropoint of 21.62
        assert!((number(row, "noise_var_e2") - variance).abs() < 0.3, "{row:?}");
    }
    assert_eq!(number(find(&rows, "full", "one pixel", 1.0), "sky_mag_arcsec2"), 19.4);
}

#[test]
fn without_options_every_default_is_reported_with_where_it_is_from() {
    let output = tracked(&[]).expect(0, &[]).out;
    for line in [
        "0.61  m                     preset macquarie-cdk24",
        "0.47  of the diameter       default",
        "maker's curve of asi6200mm",
        "asi6200mm at gain setting 200",
        "converter of asi6200mm",
        "0.1957  arcsec                3.76 um / 3962 mm",
        "0.011  e-/s/px               default",
        "4250.25 m2 at 400 km, 1130.2 arcsec2 (default: the ISS)",
        "Walker 1987",
        "10 s in one exposure",
        "1.79 mag lie between",
    ] {
        assert!(output.contains(line), "{line:?} is not in\n{output}");
    }
    // two skies, two ratios
    for kind in ["  one pixel ", "  one arcsec2 ", "  point source ", "  extended target "] {
        assert_eq!(output.matches(kind).count(), 4, "{kind}\n{output}");
    }
    // the help is wrapped: its words, one blank between them
    let help = tracked(&["--help"]).out.split_whitespace().collect::<Vec<_>>().join(" ");
    for default in [
        "[default: 0.47]",
        "[default: 0.8]",
        "[default: 200]",
        "[default: 0.011]",
        "[default: 10]",
        "[default: 4250.25]",
    ] {
        assert!(help.contains(default), "{default}");
    }
}

#[test]
fn a_target_at_the_limit_has_the_ratio_of_the_limit_and_needs_the_time_it_had() {
    let options = ["--sky-mag", "20.3", "--snr", "5", "--exptime-s", "24", "--subs", "6", "--csv"];
    let limits = rows(tracked(&options));
    for kind in ["point source", "extended target"] {
        let mag = find(&limits, "given", kind, 5.0)["limit_mag"].clone();
        let back = rows(tracked(&[&options[..], &["--mag", &mag]].concat()));
        let row = find(&back, "given", kind, 5.0);
        assert!((number(row, "mag_snr") / 5.0 - 1.0).abs() < 1e-10, "{row:?}");
        assert!((number(row, "mag_exptime_s") / 24.0 - 1.0).abs() < 1e-10 && row["mag_n_sub"] == "6", "{row:?}");
    }
}

#[test]
fn frames_drawn_with_noise_scatter_by_the_ratio_the_limit_promises() {
    // a star at the 5 sigma limit, 4 exposures of 2.5 s, its electrons, the sky's and the readout's drawn 20 000 times
    let calculator = macquarie(None).unwrap();
    let limit = calculator.limit(Area::Point, 20.0, 10.0, 4, 5.0).unwrap();
    let signal = calculator.rate_e_s(limit.mag) * 10.0;
    let noise = calculator.noise_px(20.0).over(limit.n_px);
    let background = (noise.sky_e_s + noise.dark_e_s) * 10.0;
    let mut rng = ChaCha12Rng::seed_from_u64(8);
    let (light, readout) = (Poisson::new(signal + background).unwrap(), Normal::new(0.0, noise.read_noise_e).unwrap());
    let count = 20_000;
    let net: Vec<f64> = (0..count)
        .map(|_| light.sample(&mut rng) + (0..4).map(|_| readout.sample(&mut rng)).sum::<f64>() - background)
        .collect();
    let mean = net.iter().sum::<f64>() / f64::from(count);
    let scatter = (net.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(count - 1)).sqrt();
    // the scatter of 20 000 draws is known to 0.5 %, their mean to 0.14 % of the signal
    assert!((mean / signal - 1.0).abs() < 0.006, "{mean} {signal}");
    assert!((mean / scatter / 5.0 - 1.0).abs() < 0.02, "{mean} {scatter}");
}

#[test]
fn splitting_the_time_costs_depth_and_never_gains_any() {
    let limit = |subs: &str| {
        let rows = rows(tracked(&["--sky-mag", "21.8", "--subs", subs, "--csv"]));
        number(find(&rows, "given", "point source", 5.0), "limit_mag")
    };
    let limits: Vec<f64> = ["1", "2", "10", "100"].map(limit).to_vec();
    assert!(limits.windows(2).all(|w| w[1] < w[0]), "{limits:?}");
}

#[test]
fn a_bright_target_is_split_into_exposures_that_do_not_saturate() {
    let rows = rows(tracked(&["--mag", "4", "--sky-mag", "20", "--snr", "1000", "--csv"]));
    let row = find(&rows, "given", "point source", 1_000.0);
    let (time, count) = (number(row, "mag_exptime_s"), number(row, "mag_n_sub"));
    let calculator = macquarie(None).unwrap();
    let longest = calculator.unsaturated_s(Area::Point, 4.0, 20.0);
    assert!(count > 1.0 && time / count <= longest * (1.0 + 1e-9), "{row:?} {longest}");
    assert!((calculator.snr(Area::Point, 4.0, 20.0, time, count as u32).unwrap() / 1_000.0 - 1.0).abs() < 1e-9);
}

#[test]
fn a_sky_that_fills_the_pixels_is_reported_and_every_limit_under_it_is_marked() {
    let output = tracked(&["--sky-mag", "9"]).expect(0, &["sky and dark current alone fill the pixels", "--subs"]);
    assert!(output.out.contains('*'));
    let rows = rows(tracked(&["--sky-mag", "9", "--csv"]));
    assert!(rows.iter().all(|r| r["saturated"] == "1" && r["saturation_mag"].is_empty()), "{rows:?}");
    let requested = tracked(&["--sky-mag", "9", "--mag", "12", "--snr", "5"]).expect(0, &[]).out;
    let (_, requested) = requested.split_once("magnitude 12").unwrap();
    assert!(requested.lines().find(|line| line.contains("point source")).unwrap().contains('*'), "{requested}");
    // and a magnitude that would need more than a million exposures says why there is no time
    tracked(&["--sky-mag", "-15", "--mag", "12"]).expect(0, &["saturates in"]);
}

#[test]
fn the_configuration_and_set_change_the_telescope_and_say_so() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("own.toml"),
        "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\".\"]\noutput = \"o\"\n[telescope]\n\
         name = \"Twice\"\naperture_m = 1.22\nfocal_length_mm = 7924.0\n",
    )
    .unwrap();
    let output = satphot(folder.path(), &["limits", "tracked", "-c", "own.toml"]).expect(0, &[]).out;
    assert!(output.contains("Twice") && output.contains("1.22  m") && output.contains("configuration"), "{output}");
    // twice the aperture is 1.505 mag, twice the focal length half the pixel
    assert!(output.contains("25.7543") && output.contains("0.0979"), "{output}");
    assert!(!output.contains("behind the published limits"), "the comparison is of the preset's telescope alone");
    let set = tracked(&["--set", "telescope.aperture_m=1.22"]).expect(0, &[]).out;
    assert!(set.contains("25.7543") && set.contains("--set"), "{set}");
}

#[test]
fn skies_come_from_the_moon_where_it_stands_or_from_its_age() {
    let one = |more: &[&str]| number(&rows(tracked(&[more, &["--csv"]].concat()))[0], "sky_mag_arcsec2");
    let stands = ["--moon-phase-deg", "20", "--moon-alt-deg", "40", "--moon-sep-deg", "60", "--alt-deg", "55"];
    let moon = MoonInSky { alt_rad: 40f64.to_radians(), phase_rad: 20f64.to_radians(), sep_rad: 60f64.to_radians() };
    let v = moonlit_sky_v_mag_arcsec2(21.587, 0.172, 55f64.to_radians(), Some(moon));
    assert!((one(&stands) - v).abs() < 1e-12);
    assert!((one(&[&stands[..], &["--band", "r"]].concat()) - sky_of_v("r", v).unwrap()).abs() < 1e-12);
    assert_eq!(one(&["--moon-phase-deg", "0", "--band", "g"]), 19.4);
    // twilight: the dark sky of the table and Patat's law at −12°, 19.673 less Paranal's 21.6
    let dusk = one(&["--moon-phase-deg", "180", "--sun-alt-deg", "-12"]);
    let linear = |v: f64| 10f64.powf(-0.4 * v);
    let expected = -2.5 * (linear(21.8) + linear(19.673) - linear(21.6)).log10();
    assert!((dusk - expected).abs() < 1e-4, "{dusk} {expected}"); // 0.92104 stands for 0.4 ln 10
}

#[test]
fn the_table_by_moon_gets_fainter_limits_with_phase_and_with_a_lower_moon() {
    let rows = rows(tracked(&["--by-moon", "--snr", "5", "--csv"]));
    assert_eq!(rows.len(), 7 * 5 * 4);
    let limit = |phase: f64, alt: f64| {
        let is = |r: &&Row| {
            number(r, "moon_phase_deg") == phase && number(r, "moon_alt_deg") == alt && r["limit_of"] == "point source"
        };
        number(rows.iter().find(is).unwrap(), "limit_mag")
    };
    let phases = [0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0];
    let altitudes = [-5.0, 10.0, 30.0, 50.0, 70.0];
    for alt in &altitudes[1..] {
        assert!(phases.windows(2).all(|w| limit(w[0], *alt) < limit(w[1], *alt)), "{alt}");
    }
    for phase in phases {
        assert!(altitudes.windows(2).all(|w| limit(phase, w[0]) > limit(phase, w[1])), "{phase}");
        assert_eq!(limit(phase, -5.0), limit(0.0, -5.0), "a Moon that has set gives no light");
    }
    assert!(tracked(&["--by-moon"]).expect(0, &[]).out.contains("signal-to-noise ratio 5"));
}

#[test]
fn an_extended_target_is_as_large_as_its_area_at_its_distance() {
    let of = |more: &[&str]| {
        let rows = rows(tracked(&[more, &["--sky-mag", "20", "--csv"]].concat()));
        let row = find(&rows, "given", "extended target", 5.0).clone();
        (number(&row, "mu_limit_mag_arcsec2") - number(&row, "limit_mag"), number(&row, "summed_arcsec2"))
    };
    // 4250.25 m² at 400 km: 1130.1725628 arcsec² (omega_iss_400); a star of 2″ adds 9.06
    let (lg, summed) = of(&[]);
    assert!((10f64.powf(0.4 * lg) - 1_130.172_562_8).abs() < 1e-5, "{lg}");
    assert!((summed - 1_130.172_562_8 - 2.266_18 * 4.0).abs() < 1e-5, "{summed}");
    assert!((of(&["--omega-arcsec2", "1130.1725628"]).0 - lg).abs() < 1e-9);
    let (near, _) = of(&["--range-km", "200"]);
    assert!((near - lg - 5.0 * 2f64.log10()).abs() < 1e-9);
}

#[test]
fn the_table_has_units_and_the_figure_names_its_axes() {
    let folder = tempfile::tempdir().unwrap();
    satphot(folder.path(), &["limits", "tracked", "-o", "out"]).expect(0, &["wrote out/limits.ecsv", "limits.svg"]);
    let ecsv = std::fs::read_to_string(folder.path().join("out/limits.ecsv")).unwrap();
    for word in
        ["mu_limit_mag_arcsec2, unit: mag / arcsec2", "mag_system: Vega", "zeropoint_of_a_pixel", "from: default"]
    {
        assert!(ecsv.contains(word), "{word}");
    }
    let svg = std::fs::read_to_string(folder.path().join("out/limits.svg")).unwrap();
    for word in ["lg exposure time [s]", "V [mag]", "lg signal-to-noise ratio", "mag/arcsec²", "full Moon", "new Moon"]
    {
        assert!(svg.contains(word), "{word}");
    }
    assert!(!svg.contains("NaN"));
    satphot(folder.path(), &["limits", "tracked", "--by-moon", "-q", "-o", "moon.svg"]).expect(0, &[]);
    let svg = std::fs::read_to_string(folder.path().join("moon.svg")).unwrap();
    assert!(svg.contains("phase angle of the Moon [deg]") && svg.contains("Moon set"));
}

#[test]
fn what_makes_no_sense_is_refused_by_the_name_of_its_option() {
    for (args, words) in [
        (&["--exptime-s", "0"][..], &["--exptime-s", "0"][..]),
        (&["--exptime-s", "-10"], &["--exptime-s"]),
        (&["--exptime-s", "NaN"], &["--exptime-s"]),
        (&["--snr", "5,0"], &["--snr"]),
        (&["--subs", "0"], &["--subs"]),
        (&["--pixel-scale", "0"], &["--pixel-scale"]),
        (&["--fwhm-arcsec", "0"], &["FWHM 0"]),
        (&["--aper-r-arcsec", "0.01"], &["aperture radius 0.01"]),
        (&["--area-m2", "0"], &["--area-m2"]),
        (&["--range-km", "0"], &["--range-km"]),
        (&["--omega-arcsec2", "-1"], &["--omega-arcsec2"]),
        (&["--omega-arcsec2", "5", "--area-m2", "3"], &["--omega-arcsec2", "cannot be used with"]),
        (&["--read-noise-e", "-1"], &["read noise -1"]),
        (&["--dark-e-s", "NaN"], &["--dark-e-s: NaN"]),
        (&["--saturation-e", "0"], &["saturation 0"]),
        (&["--extinction-mag", "-1"], &["extinction -1"]),
        (&["--zp-mag", "NaN"], &["--zp-mag: NaN"]),
        (&["--obstruction", "1"], &["obstruction 1"]),
        (&["--optics", "0"], &["optics 0"]),
        (&["--qe", "1.5"], &["--qe"]),
        (&["--qe", "no.csv"], &["no.csv"]),
        (&["--gain-setting", "120"], &["--gain-setting", "120"]),
        (&["--band", "K"], &["--band", "none"]),
        (&["--sky-mag", "inf"], &["--sky-mag"]),
        (&["--sky-mag", "20", "--moon-phase-deg", "0"], &["cannot be used with"]),
        (&["--moon-alt-deg", "40"], &["--moon-phase-deg"]),
        (&["--moon-phase-deg", "200"], &["--moon-phase-deg"]),
        (&["--moon-phase-deg", "0", "--moon-alt-deg", "40", "--moon-sep-deg", "10"], &["--moon-sep-deg", "between 50"]),
        (&["--sun-alt-deg", "-3"], &["--sun-alt-deg", "daytime sky is not modelled"]),
        (&["--sun-alt-deg", "-12", "--band", "g"], &["--sun-alt-deg", "V only"]),
        (&["--mag", "NaN"], &["--mag"]),
        (&["-c", "nowhere.toml"], &["nowhere.toml", "macquarie-cdk24"]),
        (&["-o", "limits.pdf"], &["--out"]),
    ] {
        let output = tracked(args);
        assert!(output.code == 2 || (output.code == 4 && args[0] == "--qe"), "{args:?}: {output:#?}");
        for word in words {
            assert!(output.err.contains(word), "{args:?}: {word:?} is not in {}", output.err);
        }
    }
}
