//! Frames read right: every BITPIX, scaling, compression, the clip box, real frames against astropy.
#![allow(clippy::unwrap_used)]

use crate::frames_support;

use frames_support::*;
use ndarray::Array2;
use satphot::fits::{CardValue, Header, write_f32, write_u16};
use satphot::frames::{Detector, Role, classify, mask};

/// Pixel values that reach the extremes of 16 bits.
fn pattern(nx: usize, ny: usize) -> Array2<u16> {
    Array2::from_shape_fn((ny, nx), |(j, i)| match (j * nx + i) % 7 {
        0 => 0,
        1 => 65535,
        2 => 32767,
        3 => 32768,
        _ => ((j * 7919 + i * 104_729) % 65536) as u16,
    })
}

fn cards() -> Vec<(String, CardValue, String)> {
    let card = |k: &str, v: CardValue| (k.to_string(), v, "a comment".to_string());
    vec![
        card("IMAGETYP", CardValue::Text("LIGHT".into())),
        card("EXPTIME", CardValue::Real(0.1 + 0.2)),
        card("DATE-OBS", CardValue::Text("2025-06-09T10:33:00.500".into())),
        card("GAIN", CardValue::Integer(200)),
        card("OBJECT", CardValue::Text("ISS".into())),
        card("LONGTEXT", CardValue::Text("x".repeat(200) + "end")),
        card("TINY", CardValue::Real(-1.2345678901234567e-300)),
        card("TRUTH", CardValue::Logical(true)),
        card("HISTORY", CardValue::Text("made by a test".into())),
    ]
}

#[test]
fn sixteen_bit_frames_come_back_plain_and_compressed() {
    let dir = tempfile::tempdir().unwrap();
    let pixels = pattern(131, 97);
    for (name, compress) in [("a.fits", false), ("a.fits.fz", true), ("odd [1](2) name+3.fits", false)] {
        let path = dir.path().join(name);
        write_u16(&path, &pixels, &cards(), compress).unwrap();
        write_u16(&path, &pixels, &cards(), compress).unwrap(); // replaces
        let e = exposure(&path);
        assert_eq!(
            (e.role, e.header.is_compressed(), e.header.bitpix()),
            (Role::Target, compress, 16),
            "{}",
            e.role_reason
        );
        assert_eq!(e.size_px, (131, 97));
        let frame = read(&e, unit_gain(), None, None).unwrap();
        assert_eq!(frame.pixels, pixels.mapv(f32::from), "{name}");
        assert_eq!(e.header.number("EXPTIME"), Some(0.1 + 0.2), "a number reads back exactly");
        assert_eq!(e.header.number("TINY"), Some(-1.2345678901234567e-300));
        assert_eq!(e.header.text("LONGTEXT"), Some("x".repeat(200) + "end"));
        assert_eq!(e.header.logical("TRUTH"), Some(true));
        assert_eq!(e.header.text("HISTORY").as_deref(), Some("made by a test"));
        let left: Vec<_> = std::fs::read_dir(dir.path())
            .unwrap()
            .filter(|f| f.as_ref().unwrap().file_name().to_string_lossy().contains("part"))
            .collect();
        assert!(left.is_empty(), "no half-written file is left");
    }
}

#[test]
fn every_bitpix_is_read_with_its_scaling() {
    let dir = tempfile::tempdir().unwrap();
    let values: Vec<i64> = vec![-32768, -1, 0, 1, 100, 32767];
    let bytes = |f: &dyn Fn(i64) -> Vec<u8>| values.iter().flat_map(|v| f(*v)).collect::<Vec<u8>>();
    let cases: Vec<(i64, Vec<u8>)> = vec![
        (16, bytes(&|v| (v as i16).to_be_bytes().to_vec())),
        (32, bytes(&|v| (v as i32).to_be_bytes().to_vec())),
        (64, bytes(&|v| v.to_be_bytes().to_vec())),
        (-32, bytes(&|v| (v as f32).to_be_bytes().to_vec())),
        (-64, bytes(&|v| (v as f64).to_be_bytes().to_vec())),
    ];
    for (bitpix, data) in &cases {
        for (scale, zero) in [(1.0, 0.0), (1.0, 32768.0), (0.5, -10.0)] {
            let mut more = light();
            more.extend([card("BSCALE", scale), card("BZERO", zero)]);
            let path = put(dir.path(), "x.fits", &fits(*bitpix, 3, 2, &more, data));
            let frame = read(&exposure(&path), unit_gain(), None, None).unwrap();
            let expected: Vec<f32> = values.iter().map(|v| (*v as f64 * scale + zero) as f32).collect();
            assert_eq!(
                frame.pixels.as_slice().unwrap(),
                expected.as_slice(),
                "BITPIX {bitpix} BSCALE {scale} BZERO {zero}"
            );
        }
    }
    let path = put(dir.path(), "b.fits", &fits(8, 3, 1, &light(), &[0, 128, 255]));
    assert_eq!(
        read(&exposure(&path), unit_gain(), None, None).unwrap().pixels.as_slice().unwrap(),
        &[0.0, 128.0, 255.0]
    );
}

#[test]
fn blank_nan_and_infinite_pixels_are_bad_and_bright_ones_saturated() {
    let dir = tempfile::tempdir().unwrap();
    let mut more = light();
    more.extend([card("BZERO", 32768), card("BLANK", -32768)]);
    let data: Vec<u8> = [-32768i16, 0, 32000, 32767].iter().flat_map(|v| v.to_be_bytes()).collect();
    let path = put(dir.path(), "i.fits", &fits(16, 4, 1, &more, &data));
    let mut gain = unit_gain();
    gain.saturation_adu = 64768.0;
    let frame = read(&exposure(&path), gain.clone(), None, None).unwrap();
    assert_eq!(frame.mask.as_slice().unwrap(), &[mask::BAD, 0, mask::SATURATED, mask::SATURATED]);
    let data: Vec<u8> = [f64::NAN, f64::INFINITY, 1e300, 64767.0].iter().flat_map(|v| v.to_be_bytes()).collect();
    let path = put(dir.path(), "f.fits", &fits(-64, 4, 1, &light(), &data));
    let frame = read(&exposure(&path), gain, None, None).unwrap();
    assert_eq!(frame.mask.as_slice().unwrap(), &[mask::BAD, mask::BAD, mask::BAD, 0]);
}

#[test]
fn an_image_behind_an_empty_primary_inherits_its_cards() {
    let dir = tempfile::tempdir().unwrap();
    let mut primary = vec![card("SIMPLE", "T"), card("BITPIX", 8), card("NAXIS", 0), card("EXTEND", "T")];
    primary.extend(light());
    let extension = vec![
        text("XTENSION", "IMAGE"),
        card("BITPIX", -32),
        card("NAXIS", 3),
        card("NAXIS1", 2),
        card("NAXIS2", 2),
        card("NAXIS3", 1),
        card("PCOUNT", 0),
        card("GCOUNT", 1),
        card("GAIN", 300),
    ];
    let mut bytes = header(&primary);
    bytes.extend(header(&extension));
    bytes.extend([1f32, 2.0, 3.0, 4.0].iter().flat_map(|v| v.to_be_bytes()));
    bytes.resize(bytes.len().div_ceil(2880) * 2880, 0);
    let e = exposure(&put(dir.path(), "x.fits", &bytes));
    assert_eq!((e.header.hdu_index(), e.setting.unwrap().0, e.exptime_s), (1, 300, 5.0));
    assert_eq!(read(&e, unit_gain(), None, None).unwrap().pixels.as_slice().unwrap(), &[1.0, 2.0, 3.0, 4.0]);
}

#[test]
fn one_scene_at_two_gains_holds_the_same_electrons() {
    let dir = tempfile::tempdir().unwrap();
    let detector = Detector::from_config(&config(&[]).detector).unwrap();
    let mut electrons = Vec::new();
    for setting in [0, 200] {
        let gain = detector.gain_for_setting(setting).unwrap();
        let scene = Array2::from_elem((2, 2), 3000.0);
        let raw = scene.mapv(|e: f64| (e / gain.e_per_adu.0 + gain.pedestal_adu).round() as u16);
        let path = dir.path().join(format!("{setting}.fits"));
        let mut cards = cards();
        cards[3].1 = CardValue::Integer(setting);
        write_u16(&path, &raw, &cards, false).unwrap();
        let e = exposure(&path);
        electrons.push(read(&e, detector.gain(&e).unwrap(), None, None).unwrap().pixels[[0, 0]]);
    }
    // Each is rounded to whole ADU: half an ADU is 0.40 and 0.04 electrons.
    assert!((electrons[0] - electrons[1]).abs() < 0.5, "{electrons:?}");
}

#[test]
fn a_gain_that_is_unknown_or_absent_is_said_so() {
    let dir = tempfile::tempdir().unwrap();
    let detector = Detector::from_config(&config(&[]).detector).unwrap();
    let with = |gain: &[String]| {
        let mut more: Vec<String> = light().into_iter().filter(|c| !c.starts_with("GAIN")).collect();
        more.extend_from_slice(gain);
        exposure(&put(dir.path(), "x.fits", &fits(8, 1, 1, &more, &[1])))
    };
    let e = detector.gain(&with(&[card("GAIN", 120)])).unwrap_err();
    assert!(
        e.exit_code() == 5 && e.to_string().contains("120") && e.to_string().contains("[detector.e_per_adu]"),
        "{e}"
    );
    let e = detector.gain(&with(&[])).unwrap_err();
    assert!(e.to_string().contains("header GAIN"), "{e}");
    let professional = with(&[card("GAIN", 1.75), card("EGAIN", "'0.5'")]);
    assert_eq!((professional.setting, professional.header_e_per_adu), (None, Some(0.5)));
    let d = Detector::from_config(&config(&["detector.use_header_egain=true"]).detector).unwrap();
    assert!(d.gain(&professional).unwrap_err().to_string().contains("detector.read_noise_e"));
    let d = Detector::from_config(&config(&["detector.use_header_egain=true", "detector.read_noise_e.0=7"]).detector)
        .unwrap();
    let g = d.gain(&professional).unwrap();
    assert_eq!((g.e_per_adu.0, g.read_noise_e, g.source.as_str()), (0.5, 7.0, "header EGAIN"));
}

#[test]
fn frames_are_distinguished_by_header_name_and_configuration() {
    let dir = tempfile::tempdir().unwrap();
    let role = |name: &str, kind: &str, object: &str, sets: &[&str]| {
        let mut more: Vec<String> =
            light().into_iter().filter(|c| !c.starts_with("IMAGETYP") && !c.starts_with("OBJECT")).collect();
        more.extend([text("IMAGETYP", kind), text("OBJECT", object)]);
        let path = put(dir.path(), name, &fits(8, 1, 1, &more, &[1]));
        classify(&path, &config(sets), &["ISS (ZARYA)".into(), "25544".into()]).unwrap().role
    };
    assert_eq!(role("a.fits", "Light Frame", "ISS", &[]), Role::Target);
    assert_eq!(role("a.fits", "Light Frame", "sat 25544", &[]), Role::Target);
    assert_eq!(role("a.fits", "object", "NGC 1", &[]), Role::Stars);
    assert_eq!(role("a.fits", "", "skyflat V", &[]), Role::Flat);
    assert_eq!(role("a.fits", "Flat Field", "ISS", &[]), Role::Flat);
    assert_eq!(role("a.fits", "DARKFLAT", "", &[]), Role::Dark);
    assert_eq!(role("a.fits", "Bias Frame", "", &[]), Role::Bias);
    assert_eq!(role("a.fits", "Master Flat", "", &[]), Role::Ignored);
    assert_eq!(role("a.fits", "focus", "", &[]), Role::Ignored);
    assert_eq!(role("t_1.fits", "LIGHT", "x", &["frames.target=[\"t_*.fits\"]"]), Role::Target);
    assert_eq!(role("t_1.fits", "LIGHT", "x", &["frames.ignore=[\"T_?.*\"]"]), Role::Ignored);
    assert_eq!(role("a.fits", "LIGHT", "My Sat 7", &["frames.target_objects=[\"my-sat\"]"]), Role::Target);
}

#[test]
fn lights_that_cannot_be_measured_are_refused_with_the_keyword() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |drop: &str, add: &[String]| {
        let mut more: Vec<String> = light().into_iter().filter(|c| !c.starts_with(drop)).collect();
        more.extend_from_slice(add);
        let path = put(dir.path(), "x.fits", &fits(8, 1, 1, &more, &[1]));
        classify(&path, &config(&[]), &[]).unwrap_err().to_string()
    };
    assert!(refused("EXPTIME", &[]).contains("EXPTIME: absent"));
    assert!(refused("EXPTIME", &[card("EXPTIME", 0.0)]).contains("0 s is not an exposure time"));
    assert!(refused("EXPTIME", &[card("EXPTIME", -5.0)]).contains("-5 s"));
    assert!(refused("DATE-OBS", &[]).contains("DATE-OBS"));
    assert!(refused("-", &[text("BAYERPAT", "XTRANS")]).contains("colour"));
    assert!(refused("-", &[text("CALSTAT", "BDF")]).contains("already flat-fielded"));
    assert!(refused("-", &[card("STACKCNT", 187)]).contains("STACKCNT"));
}

/// Pixels as astropy 8.0.2 reads them (corner, [10, 20], last) and their sum.
const ASTROPY: [(&str, [f32; 3], f64); 10] = [
    ("astride_long", [296.0, 294.0, 293.0], 77202960.0),
    ("cutout_HSCA21787010", [1489.0, 1965.0, 1947.0], 331077855.0),
    ("cutout_lco_bi327715", [455.69458, 480.5604, 487.87225], 85441091.5625),
    ("cutout_vatt_v", [664.969_4, 640.9615, 668.00055], 25614888.477937944),
    ("huntsman_bias", [32.0, 32.0, 32.0], 20480000.0),
    ("huntsman_flat", [704.0, 710.0, 716.0], 453024147.0),
    ("huntsman_science", [113.0, 116.0, 111.0], 73221109.0),
    ("sep_back", [6859.3076, 6856.135, 6867.9297], 448987897.37402344),
    ("sep_image", [7010.5156, 6890.684, 6767.9287], 451363820.296875),
    ("sep_rms", [67.9772, 67.49547, 65.2717], 4286889.393318176),
];

#[test]
fn real_frames_hold_what_astropy_reads() {
    let Some(frames) = shared("data/frames") else { return };
    for (name, pixels, total) in ASTROPY {
        let path = frames.join(format!("{name}.fits"));
        let mut e = exposure(&put(tempfile::tempdir().unwrap().path(), "x.fits", &fits(8, 1, 1, &light(), &[1])));
        e.header = Header::read(&path).unwrap();
        e.size_px = e.header.size_px();
        e.path = path;
        let frame = read(&e, unit_gain(), None, None).unwrap();
        let (ny, nx) = frame.pixels.dim();
        let got = [frame.pixels[[0, 0]], frame.pixels[[10, 20]], frame.pixels[[ny - 1, nx - 1]]];
        for (g, p) in got.iter().zip(pixels) {
            // Scaled integers and f64 are rounded to f32: 1e-7 relative.
            assert!((g - p).abs() <= 2e-7 * p.abs(), "{name}: {got:?} instead of {pixels:?}");
        }
        assert!((sum(&frame) - total).abs() < 1e-7 * total, "{name}: sum {}", sum(&frame));
    }
}

#[test]
fn the_huntsman_night_is_understood_from_its_headers() {
    let Some(frames) = shared("data/frames") else { return };
    let c = config(&["frames.flat=[\"*_flat*\"]", "detector.use_header_egain=true", "detector.read_noise_e.0=2"]);
    let science = classify(&frames.join("huntsman_science.fits"), &c, &[]).unwrap();
    assert_eq!((science.role, science.exptime_s, science.filter.as_deref()), (Role::Stars, 300.0, Some("g_band")));
    let time = science.time.as_ref().unwrap();
    assert_eq!(time.source, "DATE-OBS + EXPTIME/2");
    assert!(time.mid.to_string().starts_with("2021-01-18T11:29:02.228"), "{}", time.mid);
    let gain = Detector::from_config(&c.detector).unwrap().gain(&science).unwrap();
    assert_eq!(gain.e_per_adu.0, 1.144744515419006);
    assert_eq!(classify(&frames.join("huntsman_flat.fits"), &c, &[]).unwrap().role, Role::Flat);
    assert_eq!(classify(&frames.join("huntsman_dark.fits"), &c, &[]).unwrap().role, Role::Dark);
    let vatt = classify(&frames.join("cutout_vatt_v.fits"), &c, &[]).unwrap();
    assert!(vatt.time.unwrap().mid.to_string().starts_with("2021-12-12T12:53:51.366"));
    let lco = classify(&frames.join("cutout_lco_bi327715.fits"), &c, &[]).unwrap();
    assert_eq!((lco.setting, lco.header_e_per_adu), (None, Some(1.0)));
    assert!(lco.time.unwrap().source.contains("UTSTOP"));
    let astride = classify(&frames.join("astride_long.fits"), &c, &[]).unwrap().time.unwrap();
    assert!(astride.source.starts_with("JD - EXPTIME/2") && astride.rejected[0].contains("26/07/102"), "{astride:?}");
    // JD 2452482.31709 is the end of 60 s, to 0.86 s.
    assert!(astride.mid.to_string().starts_with("2002-07-26T19:36:06.57") && (astride.err_s - 0.864).abs() < 1e-9);
}

#[test]
fn floats_keep_their_bits_and_files_are_found() {
    let dir = tempfile::tempdir().unwrap();
    let pixels = Array2::from_shape_fn((5, 4), |(j, i)| if i == j { f32::NAN } else { 0.1 * i as f32 - j as f32 });
    for name in ["b.FIT", "a.fits.fz", ".hidden.fits", "notes.txt", "c.fts"] {
        write_f32(&dir.path().join(name), &pixels, &[]).unwrap();
    }
    let sub = dir.path().join("sub");
    std::fs::create_dir(&sub).unwrap();
    write_f32(&sub.join("d.fits"), &pixels, &[]).unwrap();
    let found = satphot::fits::find_files(&[dir.path().into(), sub.clone(), sub.join("d.fits")]).unwrap();
    let names: Vec<_> = found.iter().map(|p| p.strip_prefix(dir.path()).unwrap().to_str().unwrap()).collect();
    assert_eq!(names, ["a.fits.fz", "b.FIT", "c.fts", "sub/d.fits"]);
    let mut e = exposure(&put(dir.path(), "x.fits", &fits(8, 1, 1, &light(), &[1])));
    e.path = found[1].clone();
    e.header = Header::read(&e.path).unwrap();
    e.size_px = e.header.size_px();
    let frame = read(&e, unit_gain(), None, None).unwrap();
    assert!(frame.pixels.iter().zip(&pixels).all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()));
    let empty = tempfile::tempdir().unwrap();
    let e = satphot::fits::find_files(&[empty.path().into()]).unwrap_err();
    assert!(e.exit_code() == 4 && e.to_string().contains(empty.path().to_str().unwrap()), "{e}");
}
