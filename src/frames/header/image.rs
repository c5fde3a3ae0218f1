//! What was done to the pixels before we see them: stacking, colour, calibration, binning, order of the rows.
//!
//! Pedestals in ADU. It does not cover what is refused because of it ([`crate::frames::exposure`]).

use super::names::{Aliases, keywords};
use super::sourced::Sourced;
use crate::fits::cards::{Green, Header};

/// Counts of combined exposures.
const COUNTS: [&str; 7] = ["STACKCNT", "NCOMBINE", "SNAPSHOT", "LIVESTAC", "NUMFRAME", "NSTACK", "STACKED"];

/// Whether the frame combines several exposures: keyword and words.
#[must_use]
pub fn stack(header: &Header) -> Option<(String, String)> {
    if let Some((key, n)) = COUNTS.iter().find_map(|k| Some((*k, header.number(k).filter(|n| *n > 1.0)?))) {
        return Some((key.into(), format!("{n} exposures combined")));
    }
    if let Some(text) = header.text("INTEGRAT") {
        return Some(("INTEGRAT".into(), format!("'{text}'")));
    }
    // PixInsight gives the number in its history
    let images = header.cards().iter().filter(|c| c.keyword == "HISTORY").find_map(|c| {
        let (_, n) = c.value.split_once("numberOfImages:")?;
        n.trim().parse::<f64>().ok().filter(|n| *n > 1.0)
    });
    images.map(|n| ("HISTORY".into(), format!("{n} images integrated")))
}

/// The pattern of a colour sensor, or that there are three planes of colours.
#[must_use]
pub fn colour(header: &Header) -> Option<(String, String)> {
    let mono =
        |v: &String| matches!(v.to_ascii_lowercase().as_str(), "no" | "none" | "mono" | "monochrome" | "false" | "f");
    let pattern = ["BAYERPAT", "COLORTYP", "CFAIMAGE", "BAYRPAT", "COLORSPC"]
        .iter()
        .find_map(|k| Some(((*k).to_string(), header.text(k).filter(|v| !mono(v))?)));
    pattern.or_else(|| {
        let (keyword, planes) = planes(header)?;
        (planes == 3).then(|| (keyword, format!("{planes} planes")))
    })
}

/// Which pixels of the file are green, where a header names a Bayer pattern, or `pattern` of the configuration does, which wins
/// (`none`: the pixels have no colours).
///
/// XBAYROFF and YBAYROFF move the pattern. ROWORDER does not count, because programs differ in whether they turn the pattern with the
/// rows; what the pixels say is checked before a night is reduced.
#[must_use]
pub fn green_pixels(header: &Header, pattern: Option<&str>) -> Option<Green> {
    let text = match pattern {
        Some(own) => own.to_owned(),
        None => colour(header)?.1,
    };
    let green = match text.trim().to_ascii_uppercase().as_str() {
        "RGGB" | "BGGR" => Green::Mixed,
        "GRBG" | "GBRG" => Green::Same,
        _ => return None,
    };
    let offset =
        |keys: [&str; 2]| keys.iter().find_map(|k| header.integer(k)).filter(|_| pattern.is_none()).unwrap_or(0);
    let moved = offset(["XBAYROFF", "BAYOFFX"]) + offset(["YBAYROFF", "BAYOFFY"]);
    Some(match (green, moved.rem_euclid(2)) {
        (Green::Mixed, 1) => Green::Same,
        (Green::Same, 1) => Green::Mixed,
        (green, _) => green,
    })
}

/// The keyword and the number of images a cube holds, where it is not three planes of colours: a sequence of exposures,
/// a stack of extensions, a spectrum.
#[must_use]
pub fn cube(header: &Header) -> Option<(String, i64)> {
    planes(header).filter(|(_, n)| *n != 3)
}

/// Images beyond the first two axes, with the keyword of the first axis longer than 1.
fn planes(header: &Header) -> Option<(String, i64)> {
    let long = |axis: &i64| header.integer(&format!("NAXIS{axis}")).filter(|n| *n > 1);
    let axes: Vec<(i64, i64)> = (3..=9).filter_map(|axis| Some((axis, long(&axis)?))).collect();
    let (first, _) = axes.first()?;
    Some((format!("NAXIS{first}"), axes.iter().fold(1_i64, |all, (_, n)| all.saturating_mul(*n))))
}

/// The calibration that a header states.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Calibration {
    /// CALSTAT of MaxIm and others: B bias, D dark, F flat.
    pub calstat: Option<String>,
    /// Bias or dark subtracted, by CALSTAT.
    pub zero_subtracted: bool,
    /// Divided by a flat, by CALSTAT.
    pub flat_divided: bool,
    /// PEDESTAL as written \[ADU\]: MaxIm's is to be added to reach zero.
    pub pedestal_adu: Option<f64>,
    /// Other keywords that name calibration frames, as written.
    pub others: Vec<String>,
}

impl Calibration {
    /// The level that stands for zero light in the file \[ADU\], once bias or dark are subtracted.
    #[must_use]
    pub fn zero_adu(&self) -> f64 {
        self.pedestal_adu.map_or(0.0, f64::abs)
    }

    /// In words: `not stated (raw)`, `bias or dark subtracted`, `flat divided`.
    #[must_use]
    pub fn state(&self) -> &'static str {
        match (self.zero_subtracted, self.flat_divided, self.others.is_empty()) {
            (_, true, _) => "flat divided",
            (true, false, _) => "bias or dark subtracted",
            (false, false, false) => "calibrated by other keywords",
            (false, false, true) => "not stated (raw)",
        }
    }
}

/// The calibration state of a frame.
#[must_use]
pub fn calibration(header: &Header) -> Calibration {
    let calstat = header.text("CALSTAT");
    let has = |letters: &[char]| calstat.as_ref().is_some_and(|c| c.to_ascii_uppercase().contains(letters));
    let named = ["FLATCOR", "ZEROCOR", "DARKCOR", "FLATFRM", "BIASFRM", "FLAT_DIV", "L1IDFLAT", "L1IDBIAS", "FLATFILE"];
    let others = named.iter().filter_map(|k| Some(format!("{k} = '{}'", header.text(k)?))).collect();
    Calibration {
        zero_subtracted: has(&['B', 'D']),
        flat_divided: has(&['F']),
        pedestal_adu: header.number("PEDESTAL"),
        others,
        calstat,
    }
}

/// Binning along x, 1 if the header does not state it, and warnings.
#[must_use]
pub fn binning(header: &Header, aliases: &Aliases) -> (Sourced<u32>, Vec<String>) {
    let mut warnings = Vec::new();
    for key in keywords(aliases, "binning") {
        let Some(text) = header.text(key) else { continue };
        // `2`, `2*2`, `2x2`, `2 2`
        let mut parts = text.split(|c: char| !c.is_ascii_digit() && c != '.').filter(|p| !p.is_empty());
        let whole = |p: &str| p.parse::<f64>().ok().filter(|v| v.fract() == 0.0 && (1.0..=64.0).contains(v));
        let (x, y) = (parts.next().and_then(whole), parts.next().and_then(whole));
        let Some(x) = x else {
            warnings.push(format!("{key} = '{text}' is not a binning: 1 is used"));
            continue;
        };
        let y = y.or_else(|| header.number(&key.replacen('X', "Y", 1)).filter(|_| key.contains('X'))).unwrap_or(x);
        if x != y {
            warnings.push(format!("binned {x} x {y}: the pixels are not square, {x} is used"));
        }
        return (Sourced::new(x as u32, key), warnings);
    }
    (Sourced::new(1, "not given"), warnings)
}

/// ROWORDER: whether the first row of the file is the top of the picture; `None` if not given.
#[must_use]
pub fn row_order(header: &Header) -> Option<String> {
    header.text("ROWORDER").map(|o| o.to_ascii_uppercase())
}
