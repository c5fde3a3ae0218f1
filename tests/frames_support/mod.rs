//! A FITS writer of a few lines, independent of the library under test, and the paths of the reference data.
#![allow(dead_code, clippy::expect_used)]

use std::path::{Path, PathBuf};

use satphot::config::Config;
use satphot::fits::Header;
use satphot::frames::flat::MasterFlat;
use satphot::frames::{Buffers, Electrons, Exposure, Frame, Gain, classify};

/// A header block of cards, padded.
pub fn header(cards: &[String]) -> Vec<u8> {
    let mut out = Vec::new();
    for card in cards.iter().map(String::as_str).chain(["END"]) {
        assert!(card.len() <= 80, "{card}");
        out.extend_from_slice(format!("{card:<80}").as_bytes());
    }
    out.resize(out.len().div_ceil(2880) * 2880, b' ');
    out
}

/// One card of a number or logical.
pub fn card(key: &str, value: impl std::fmt::Display) -> String {
    format!("{key:<8}= {value:>20}")
}

/// One card of a string.
pub fn text(key: &str, value: &str) -> String {
    format!("{key:<8}= '{value:<8}'")
}

/// The cards of a primary image.
pub fn image_cards(bitpix: i64, nx: usize, ny: usize, more: &[String]) -> Vec<String> {
    let mut cards =
        vec![card("SIMPLE", "T"), card("BITPIX", bitpix), card("NAXIS", 2), card("NAXIS1", nx), card("NAXIS2", ny)];
    cards.extend_from_slice(more);
    cards
}

/// Header and big-endian data of a primary image.
pub fn fits(bitpix: i64, nx: usize, ny: usize, more: &[String], data: &[u8]) -> Vec<u8> {
    let mut out = header(&image_cards(bitpix, nx, ny, more));
    out.extend_from_slice(data);
    out.resize(out.len().div_ceil(2880) * 2880, 0);
    out
}

/// What a light frame needs besides its pixels.
pub fn light() -> Vec<String> {
    vec![
        text("IMAGETYP", "LIGHT"),
        card("EXPTIME", 5.0),
        text("DATE-OBS", "2025-06-09T10:33:00.500"),
        card("GAIN", 200),
        text("OBJECT", "ISS"),
    ]
}

/// The paper's configuration, changed by `sets`.
pub fn config(sets: &[&str]) -> Config {
    let night = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\"i\"]\noutput = \"o\"\n";
    Config::from_text(night, &sets.iter().map(ToString::to_string).collect::<Vec<_>>()).unwrap()
}

/// A gain of 1 e-/ADU without a pedestal, that never saturates.
pub fn unit_gain() -> Gain {
    Gain {
        setting: None,
        e_per_adu: satphot::frames::ElectronsPerAdu(1.0),
        source: "test".into(),
        read_noise_e: 1.0,
        pedestal_adu: 0.0,
        saturation_adu: f64::INFINITY,
    }
}

pub fn put(dir: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = dir.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Classified as whatever it is, with the paper's configuration.
pub fn exposure(path: &Path) -> Exposure {
    classify(path, &config(&[]), &["ISS (ZARYA)".into()]).unwrap()
}

/// An exposure of a file that need not say anything about itself.
pub fn anything(path: &Path, header: Header) -> Exposure {
    static ANY: std::sync::OnceLock<Exposure> = std::sync::OnceLock::new();
    let any = ANY.get_or_init(|| {
        let dir = tempfile::tempdir().expect("a folder");
        exposure(&put(dir.path(), "x.fits", &fits(8, 1, 1, &light(), &[1])))
    });
    Exposure { size_px: header.size_px(), header, path: path.to_path_buf(), ..any.clone() }
}

/// The reference data, or `None` with a word about it.
pub fn shared(what: &str) -> Option<PathBuf> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared")).join(what);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: ../shared/{what} not present");
    None
}

/// One exposure as electrons, flattened by `flat`.
pub fn read(
    exposure: &Exposure,
    gain: Gain,
    clip_radius_px: Option<f64>,
    flat: Option<&MasterFlat>,
) -> satphot::base::error::Result<Frame<Electrons>> {
    let buffers = Buffers::default();
    let frame = satphot::frames::read(exposure, gain, clip_radius_px, flat, &buffers)?;
    Ok(Frame::clone(&frame))
}

pub fn sum<U>(frame: &Frame<U>) -> f64 {
    frame.pixels.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)).sum()
}
