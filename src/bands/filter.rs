//! What the text of FILTER means: one table of spellings for every program and every maker of filters.
//!
//! Case is ignored except in single letters: `r` is Sloan's, `R` Cousins's or the red filter of a colour set. Sources:
//! N.I.N.A., INDI, MaxIm DL, LCO (BANZAI), DECam, Huntsman, photometrypipeline, AAVSO. It does not cover which keyword
//! holds the text ([`crate::frames::header`]).

use serde::{Deserialize, Serialize};

use crate::bands::Band;

/// What a filter is for photometry.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Meaning {
    /// No filter, or one that passes all the light a camera sees: absent, empty, `Clear`, `L`.
    Unfiltered,
    /// A band.
    Band(Band),
    /// A single letter with two meanings: Johnson-Cousins, or one of a colour set.
    Either(Band, Band),
    /// A filter for which no catalogue has magnitudes: `Ha`, `OIII`, `LP`.
    NoBand,
    /// Not known.
    Unknown,
}

impl Meaning {
    /// Whether a frame of this filter may be of `band`.
    #[must_use]
    pub fn may_be(&self, band: Band) -> bool {
        match self {
            Meaning::Band(own) => *own == band,
            Meaning::Either(a, b) => *a == band || *b == band,
            Meaning::Unfiltered | Meaning::Unknown => true,
            Meaning::NoBand => false,
        }
    }
}

/// Words, small letters and digits alone, for no filter at all.
const UNFILTERED: &[&str] = &[
    "",
    "clear",
    "clr",
    "cl",
    "c",
    "lum",
    "luminance",
    "l",
    "lumi",
    "air",
    "none",
    "empty",
    "open",
    "nofilter",
    "no",
    "unfiltered",
    "white",
    "na",
    "null",
    "nil",
    "notset",
    "blankglass",
    "uvir",
    "uvircut",
    "iruvcut",
    "ircut",
    "uvircutl",
    "cv",
    "cr",
    "notpresent",
];

/// Words, small letters and digits alone, for filters without magnitudes of stars.
const NO_BAND: &[&str] = &[
    "ha",
    "halpha",
    "hydrogenalpha",
    "hb",
    "hbeta",
    "oi",
    "oii",
    "oiii",
    "o3",
    "sii",
    "s2",
    "siii",
    "nii",
    "n2",
    "haoiii",
    "hao3",
    "siioiii",
    "s2o3",
    "hahb",
    "heii",
    "lp",
    "lpr",
    "lps",
    "lpro",
    "lextreme",
    "lenhance",
    "lultimate",
    "lquadenhance",
    "lenh",
    "lext",
    "cls",
    "clsccd",
    "uhc",
    "uhcs",
    "idas",
    "idaslps",
    "nbz",
    "alpt",
    "alpthaoiii",
    "triad",
    "triband",
    "quadband",
    "duoband",
    "dualband",
    "dualnarrowband",
    "narrowband",
    "vr",
    "irpass",
    "ir",
    "irp",
    "proplanet",
    "ch4",
    "methane",
    "nir",
    "uv",
    "uvenus",
    "uvvenus",
    "solar",
    "j",
    "h",
    "k",
    "ks",
    "dark",
    "opaque",
    "closed",
    "blank",
    "blocked",
    "grism",
    "grating",
    "sa",
    "sa100",
    "sa200",
    "polarizer",
    "pol",
];

/// Words that tell nothing of the light: makers, places in the wheel, the word filter itself.
const NOISE: &[&str] = &[
    "filter",
    "filters",
    "filt",
    "band",
    "astrodon",
    "astronomik",
    "baader",
    "chroma",
    "optolong",
    "zwo",
    "antlia",
    "custom",
    "asahi",
    "andover",
    "decam",
    "photometric",
    "phot",
    "photometry",
    "gen",
    "gen1",
    "gen2",
    "gen3",
    "generic",
    "the",
    "planetarium",
    "upper",
    "lower",
    "top",
    "bottom",
    "wheel",
    "xxx",
    "mm",
    "mounted",
    "unmounted",
    "deep",
    "sky",
    "nm",
    "a",
];
const JOHNSON: &[&str] = &["johnson", "cousins", "bessell", "bessel", "kron", "jc", "ubvri", "ubv", "landolt"];
const SLOAN: &[&str] = &["sloan", "sdss", "ps1", "panstarrs", "pan", "starrs", "skymapper", "lsst", "hsc", "prime"];
const COLOUR_SET: &[&str] = &["rgb", "lrgb", "tri", "tricolor", "tricolour", "bayer"];

/// What the text of FILTER means; an absent card is an empty text.
#[must_use]
pub fn filter_meaning(text: &str) -> Meaning {
    let text = text.trim().trim_matches(['\'', '"']).trim();
    let whole: String = text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
    // a bare number is a place in the wheel, which says nothing
    if !text.is_empty() && whole.chars().all(|c| c.is_ascii_digit()) {
        return Meaning::Unknown;
    }
    if let Some(known) = single(text).or_else(|| word(&whole)) {
        return known;
    }
    let mut tokens = tokens(text);
    let takes = |list: &[&str], tokens: &mut Vec<String>| {
        let before = tokens.len();
        tokens.retain(|t| !list.contains(&t.to_lowercase().as_str()));
        tokens.len() < before
    };
    takes(NOISE, &mut tokens);
    let johnson = takes(JOHNSON, &mut tokens);
    let sloan = takes(SLOAN, &mut tokens);
    let colour_set = takes(COLOUR_SET, &mut tokens);
    let gaia = takes(&["gaia"], &mut tokens);
    if let Some(known) = word(&tokens.concat().to_lowercase()).filter(|_| !tokens.is_empty()) {
        // `Sloan L` does not exist, `LRGB_L` does
        return known;
    }
    if tokens.len() > 1 {
        // a second wheel that is open: `V, Clear`
        let bare = |t: &String| !(t.len() > 1 && UNFILTERED.contains(&t.to_lowercase().as_str()));
        if tokens.iter().any(bare) {
            tokens.retain(bare);
        }
    }
    // `None (Clear)`, `Blue (B)`
    if tokens.len() > 1 {
        let each: Vec<Meaning> = tokens.iter().filter_map(|t| single(t).or_else(|| word(&t.to_lowercase()))).collect();
        if let Some(first) = each.iter().find(|m| !matches!(m, Meaning::Either(..)))
            && each.len() == tokens.len()
            && each.iter().all(|m| {
                m == first || matches!((m, first), (Meaning::Either(a, b), Meaning::Band(x)) if a == x || b == x)
            })
        {
            return first.clone();
        }
    }
    let joined = tokens.concat();
    let [one] = tokens.as_slice() else {
        let bands = matches!(tokens.as_slice(), [_, b] if matches!(b.as_str(), "c" | "C" | "j" | "J" | "p"));
        return if bands { single(&joined).unwrap_or(Meaning::Unknown) } else { Meaning::Unknown };
    };
    let letter = one.trim_end_matches(['\'', '’', '′', '`', '*']);
    let family = |upper: bool| {
        let letter = if upper { letter.to_uppercase() } else { letter.to_lowercase() };
        Band::named(&letter).map(Meaning::Band)
    };
    let found = match (johnson, sloan, colour_set, gaia) {
        (true, ..) if letter.len() == 1 => family(true),
        // HSC numbers its filters: r2
        (_, true, ..) => family(false)
            .or_else(|| single(&letter.to_lowercase()))
            .or_else(|| single(letter.trim_end_matches(|c: char| c.is_ascii_digit()))),
        (_, _, true, _) => match letter.to_lowercase().as_str() {
            "r" => Some(Meaning::Band(Band::TriRed)),
            "g" => Some(Meaning::Band(Band::TriGreen)),
            "b" => Some(Meaning::Band(Band::TriBlue)),
            _ => None,
        },
        (_, _, _, true) => family(true),
        _ => None,
    };
    found.or_else(|| single(one)).or_else(|| word(&one.to_lowercase())).unwrap_or(Meaning::Unknown)
}

/// Short names, whose case is significant.
fn single(text: &str) -> Option<Meaning> {
    let band = match text {
        "B" => return Some(Meaning::Either(Band::B, Band::TriBlue)),
        "R" => return Some(Meaning::Either(Band::R, Band::TriRed)),
        "G" => return Some(Meaning::Either(Band::SloanG, Band::TriGreen)),
        "U" => Band::U,
        "V" | "VJ" | "Vj" => Band::V,
        "I" | "Ic" | "IC" => Band::I,
        "Rc" | "RC" => Band::R,
        "BJ" | "Bj" => Band::B,
        "UJ" | "Uj" => Band::U,
        "RJ" | "Rj" => Band::RJohnson,
        "IJ" | "Ij" => Band::IJohnson,
        "u" | "u'" | "u*" | "up" | "SU" => Band::SloanU,
        "g" | "g'" | "g*" | "gp" | "SG" => Band::SloanG,
        "r" | "r'" | "r*" | "rp" | "SR" => Band::SloanR,
        "i" | "i'" | "i*" | "ip" | "SI" => Band::SloanI,
        "z" | "z'" | "z*" | "zp" | "zs" | "SZ" | "ZS" => Band::SloanZ,
        "sg" => Band::SloanG,
        "sr" => Band::SloanR,
        "si" => Band::SloanI,
        "sz" => Band::SloanZ,
        "su" => Band::SloanU,
        "y" | "Y" => Band::PanStarrsY,
        "g’" | "g′" | "g`" => Band::SloanG,
        "r’" | "r′" | "r`" => Band::SloanR,
        "i’" | "i′" | "i`" => Band::SloanI,
        "z’" | "z′" | "z`" => Band::SloanZ,
        "u’" | "u′" | "u`" => Band::SloanU,
        _ => return None,
    };
    Some(Meaning::Band(band))
}

/// Words of more than one letter, in small letters without punctuation; and the single letters that have no case.
fn word(small: &str) -> Option<Meaning> {
    if UNFILTERED.contains(&small) {
        return Some(Meaning::Unfiltered);
    }
    if NO_BAND.contains(&small) {
        return Some(Meaning::NoBand);
    }
    Some(Meaning::Band(match small {
        "red" | "tr" => Band::TriRed,
        "green" | "tg" => Band::TriGreen,
        "blue" | "tb" => Band::TriBlue,
        "visual" => Band::V,
        "vband" => Band::V,
        "uband" => return Some(Meaning::Unknown), // U or u
        _ => return None,
    }))
}

/// The words of a text, with their primes; wavelengths and widths (`7nm`, `4720.0`, `c0001`) excluded.
fn tokens(text: &str) -> Vec<String> {
    let part = |c: char| !(c.is_alphanumeric() || matches!(c, '\'' | '’' | '′' | '`' | '*'));
    let measure = |t: &str| {
        let t = t.to_lowercase();
        let number =
            t.trim_end_matches("nm").trim_end_matches("mm").trim_end_matches('a').trim_start_matches(['c', '#']);
        !number.is_empty() && number.chars().all(|c| c.is_ascii_digit() || c == '.')
    };
    let mut found: Vec<String> = Vec::new();
    for token in text.split(part).filter(|t| !t.is_empty() && !measure(t)) {
        // `Vband`, `gband`
        let bare = token.strip_suffix("band").or_else(|| token.strip_suffix("Band")).filter(|t| t.len() == 1);
        found.push(bare.unwrap_or(token).to_owned());
    }
    found
}

impl Band {
    /// The band a user declares: a name, or any spelling of a filter that means one band.
    #[must_use]
    pub fn declared(text: &str) -> Option<Self> {
        Self::named(text.trim()).or_else(|| match filter_meaning(text) {
            Meaning::Band(band) => Some(band),
            _ => None,
        })
    }
}
