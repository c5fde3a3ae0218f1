//! Which band a column of a catalogue is of, by its name.
//!
//! VizieR's names and those of the archives: `Vmag`, `g'mag`, `g_psf`, `phot_g_mean_mag`. In a name the case of r, i, u
//! gives Sloan from Johnson-Cousins; small `v` and `b` are Johnson's, capital G alone is Gaia's.

use crate::bands::Band;

/// Names that follow no rule.
const WHOLE: [(&str, Band); 9] = [
    ("phot_g_mean_mag", Band::GaiaG),
    ("phot_bp_mean_mag", Band::GaiaBp),
    ("phot_rp_mean_mag", Band::GaiaRp),
    ("BPmag", Band::GaiaBp),
    ("RPmag", Band::GaiaRp),
    ("BTmag", Band::TychoB),
    ("VTmag", Band::TychoV),
    ("visual", Band::V),
    ("Visual", Band::V),
];
/// Words that tell nothing of the band.
const NOISE: [&str; 33] = [
    "mag",
    "mags",
    "magnitude",
    "psf",
    "ap",
    "aper",
    "auto",
    "kron",
    "catalogue",
    "catalog",
    "cat",
    "ref",
    "std",
    "mean",
    "app",
    "apass",
    "refcat",
    "refcat2",
    "phot",
    "filter",
    "band",
    "vega",
    "ab",
    "apparent",
    "synthetic",
    "synth",
    "true",
    "lit",
    "m",
    "standard",
    "psfmag",
    "apermag",
    "automag",
];
const JOHNSON: [&str; 8] = ["johnson", "cousins", "bessell", "bessel", "jkc", "jc", "landolt", "ubvri"];
const SLOAN: [&str; 7] = ["sdss", "sloan", "ps1", "panstarrs", "ps", "skymapper", "lsst"];

/// The band of a column of magnitudes; `None` where its name does not tell.
#[must_use]
pub fn column_band(name: &str) -> Option<Band> {
    let name = name.trim();
    if let Some((_, band)) = WHOLE.iter().find(|(known, _)| *known == name) {
        return Some(*band);
    }
    let (mut johnson, mut sloan, mut gaia, mut letters) = (false, false, false, Vec::new());
    for token in name.split(|c: char| !(c.is_ascii_alphanumeric() || c == '\'')).filter(|t| !t.is_empty()) {
        let small = token.to_lowercase();
        if NOISE.contains(&small.as_str()) {
            continue;
        }
        johnson |= JOHNSON.contains(&small.as_str());
        sloan |= SLOAN.contains(&small.as_str());
        gaia |= small == "gaia";
        if johnson && JOHNSON.contains(&small.as_str()) || SLOAN.contains(&small.as_str()) || small == "gaia" {
            continue;
        }
        letters.push(without_mag(token));
    }
    letters.dedup(); // Johnson_V (V)
    let [one] = letters.as_slice() else { return None };
    // APASS writes g'mag, LCO gp
    let primed = one.ends_with('\'');
    let one = one.trim_end_matches('\'');
    let one = match one {
        "gp" | "rp" | "ip" | "zp" | "up" if !gaia => &one[..1],
        other => other,
    };
    match one {
        "Rc" | "RC" => return Some(Band::R),
        "Ic" | "IC" => return Some(Band::I),
        "Rj" | "RJ" => return Some(Band::RJohnson),
        "Ij" | "IJ" => return Some(Band::IJohnson),
        "Vj" | "VJ" => return Some(Band::V),
        "Bj" | "BJ" => return Some(Band::B),
        "BP" | "bp" | "Bp" => return Some(Band::GaiaBp),
        "RP" | "Rp" => return Some(Band::GaiaRp),
        "rp" if gaia => return Some(Band::GaiaRp),
        "TB" | "TG" | "TR" | "BT" | "VT" => return Band::named(one),
        _ if one.len() != 1 => return None,
        _ => {}
    }
    let (upper, lower) = (one.to_uppercase(), one.to_lowercase());
    if johnson {
        return Band::named(&upper).filter(|b| matches!(b, Band::U | Band::B | Band::V | Band::R | Band::I));
    }
    if sloan || primed {
        return Band::named(&lower);
    }
    match one {
        "v" => Some(Band::V),
        "b" => Some(Band::B),
        "g" if gaia => Some(Band::GaiaG),
        "R" | "I" | "U" | "V" | "B" | "G" | "u" | "g" | "r" | "i" | "z" | "y" => Band::named(one),
        _ => None,
    }
}

/// `Vmag` is V, `gMeanPSFMag` g, `magV` V.
fn without_mag(token: &str) -> &str {
    const ENDS: [&str; 9] = ["MeanPSFMag", "MeanKronMag", "MeanApMag", "PSFMag", "PSF", "mag", "Mag", "psf", "_"];
    for end in ENDS {
        if let Some(rest) = token.strip_suffix(end).filter(|rest| !rest.is_empty()) {
            return rest;
        }
    }
    token.strip_prefix("mag").or_else(|| token.strip_prefix("Mag")).filter(|rest| !rest.is_empty()).unwrap_or(token)
}
