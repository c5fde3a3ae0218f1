//! Frames of a colour camera: superpixels of its green pixels are what a monochrome camera of twice the pixel saw.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::Path;

use satphot::frames::classify;
use satphot::photometry::Flags;
use satphot::tables::PhotometryRow;

use super::filters::put_card;
use crate::support::{Night, set_card};

const BLOCK: usize = 2880;
/// Level of no light in the demo night \[ADU\].
const PEDESTAL_ADU: f64 = 500.0;

fn demo() -> Night {
    Night::copy_of(&Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/night")).set("night.name=\"tiny\"")
}

/// Writes a frame of u16 as a colour camera of half the pixel would: in each square of 2 × 2 the green pixels of `pattern` have the
/// count of the pixel, one more and one less by a tenth of its light, red and blue are fainter.
fn as_mosaic(path: &Path, pattern: &str) {
    let bytes = fs::read(path).unwrap();
    let text = |key: &str| {
        let cards = bytes.chunks(80).find(|c| c.starts_with(format!("{key:<8}=").as_bytes())).unwrap();
        String::from_utf8_lossy(&cards[10..30]).trim().to_owned()
    };
    let (nx, ny): (usize, usize) = (text("NAXIS1").parse().unwrap(), text("NAXIS2").parse().unwrap());
    let binning: usize = text("XBINNING").parse().unwrap();
    let start = find_data(&bytes);
    let count = |i: usize, j: usize| {
        let at = start + 2 * (j * nx + i);
        f64::from(u16::from_be_bytes([bytes[at], bytes[at + 1]]) ^ 0x8000)
    };
    let mut data = Vec::with_capacity(8 * nx * ny);
    for j in 0..2 * ny {
        for i in 0..2 * nx {
            let whole = count(i / 2, j / 2);
            let light = whole - PEDESTAL_ADU;
            let colour = pattern.as_bytes()[2 * (j % 2) + i % 2];
            let value = match colour {
                // noise of its own that the mean of the two does not have
                b'G' => {
                    whole
                        + if j % 2 == 0 { (0.1 * light).round() } else { -(0.1 * light).round() }
                            * f64::from((i / 2 + j / 2) % 2 == 0)
                }
                b'R' => PEDESTAL_ADU + (0.6 * light).round(),
                _ => PEDESTAL_ADU + (0.4 * light).round(),
            };
            data.extend((value.clamp(0.0, 65_535.0) as u16 ^ 0x8000).to_be_bytes());
        }
    }
    data.resize(data.len().div_ceil(BLOCK) * BLOCK, 0);
    fs::write(path, [&bytes[..start], &data].concat()).unwrap();
    for (key, value) in [("NAXIS1", 2 * nx), ("NAXIS2", 2 * ny), ("XBINNING", binning / 2)] {
        set_card(path, key, Some(&value.to_string()));
    }
    put_card(path, "BAYERPAT", pattern);
}

fn mosaic(pattern: &str) -> Night {
    let night = demo();
    for kind in ["flat", "field", "target"] {
        night.frames(kind).iter().for_each(|path| as_mosaic(path, pattern));
    }
    night
}

fn measured(rows: &[PhotometryRow]) -> Vec<(String, f64, f64)> {
    rows.iter().filter_map(|r| Some((r.frame.clone(), r.v_mag?, r.v_mag_err?))).collect()
}

#[test]
fn superpixels_of_a_colour_camera_give_the_magnitudes_of_a_monochrome_one_in_tg() {
    // one width for both: where a faint outline may end in either of two ways, that of another fit to the stars decides
    let mono = demo().set("photometry.fwhm_px=3.6");
    mono.run().unwrap();
    let mono = measured(&mono.rows());
    for pattern in ["RGGB", "GRBG"] {
        let night = mosaic(pattern).set("photometry.fwhm_px=3.6");
        let summary = night.run().unwrap();
        assert_eq!(summary.zeropoint.as_ref().unwrap().band_name(), "TG");
        let rows = night.rows();
        assert!(rows.iter().all(|r| !Flags(r.flags).has(Flags::NO_FLAT)));
        let green = measured(&rows);
        for (frame, v_mono, err_mono) in &mono {
            let (_, v, err) = green.iter().find(|(name, ..)| name == frame).unwrap();
            assert!((v - v_mono).abs() < 0.01 + 0.3 * err_mono, "{pattern} {frame}: {v} {v_mono} +- {err_mono}");
            // the camera is taken to have counted twice the electrons
            assert!(*err < 1.05 * err_mono, "{pattern} {frame}: {err} {err_mono}");
        }
    }
}

#[test]
fn a_pattern_that_the_pixels_contradict_is_refused_with_the_right_one() {
    let night = mosaic("GRBG");
    for kind in ["flat", "field", "target"] {
        night.frames(kind).iter().for_each(|path| set_card(path, "BAYERPAT", Some("'RGGB    '")));
    }
    let (code, problem) = night.refusal();
    assert!(code == 2 && problem.contains("set detector.bayer_pattern = \"GRBG\""), "{problem}");
    let night = night.set("detector.bayer_pattern=\"GRBG\"");
    assert!(night.run().unwrap().counts.ok > 20);
    // XBAYROFF moves the pattern by a column
    let night = mosaic("GRBG");
    for kind in ["flat", "field", "target"] {
        night.frames(kind).iter().for_each(|path| {
            set_card(path, "BAYERPAT", Some("'RGGB    '"));
            put_card(path, "XBAYROFF", "");
            set_card(path, "XBAYROFF", Some("1"));
        });
    }
    assert!(night.run().unwrap().counts.ok > 20);
    // frames of a monochrome camera whose program writes a pattern all the same
    let night = demo();
    for kind in ["flat", "field", "target"] {
        night.frames(kind).iter().for_each(|path| put_card(path, "BAYERPAT", "RGGB"));
    }
    let (code, problem) = night.refusal();
    assert!(code == 2 && problem.contains("detector.bayer_pattern = \"none\""), "{problem}");
    assert!(night.set("detector.bayer_pattern=\"none\"").run().unwrap().counts.ok > 20);
    let (code, problem) = demo().set("detector.bayer_pattern=\"RGBG\"").refusal();
    assert!(code == 2 && problem.contains("RGBG"), "{problem}");
}

#[test]
fn a_saturated_green_pixel_is_not_hidden_by_its_neighbour() {
    let night = mosaic("RGGB");
    let config = night.config().unwrap();
    let path = &night.frames("target")[0];
    let exposure = classify(path, &config, &[]).unwrap();
    assert_eq!((exposure.filter.as_deref(), exposure.binning), (Some("TG"), 8));
    let (x, y) = (exposure.size_px.0 / 2, exposure.size_px.1 / 2);
    let before = satphot::frames::read_box(&exposure, (x, y), (1, 1)).unwrap()[0];
    let mut bytes = fs::read(path).unwrap();
    let start = find_data(&bytes);
    let at = start + 2 * ((2 * y) * 2 * exposure.size_px.0 + 2 * x + 1);
    bytes[at..at + 2].copy_from_slice(&(u16::MAX ^ 0x8000).to_be_bytes());
    fs::write(path, bytes).unwrap();
    let after = satphot::frames::read_box(&exposure, (x, y), (1, 1)).unwrap()[0];
    assert!(before < 10_000.0 && after == 65_535.0, "{before} {after}");
}

fn find_data(bytes: &[u8]) -> usize {
    let end = bytes.chunks(80).position(|c| c.starts_with(b"END     ")).unwrap();
    (80 * (end + 1)).div_ceil(BLOCK) * BLOCK
}
