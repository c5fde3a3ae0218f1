//! The synonyms: which keywords hold a quantity, in the order in which they are trusted.
//!
//! Sources: FITS 4.0; SBFITSEXT 1.0; headers of N.I.N.A., SharpCap, Sequence Generator Pro, MaxIm DL, APT, PRISM,
//! Seestar, Dwarf, LCO (BANZAI), Rubin, Subaru, VATT. It does not cover pairs (site, pointing) and time stamps, which
//! have their own rules.

use std::collections::BTreeMap;

use crate::fits::cards::Header;

/// Quantity -> the observer's own keywords: `[header.aliases]`.
pub type Aliases = BTreeMap<String, Vec<String>>;

/// The usual keywords of every quantity of [`crate::config::QUANTITIES`] that has some of its own.
const USUAL: [(&str, &[&str]); 11] = [
    ("exptime", &["EXPTIME", "EXPOSURE", "EXP", "EXP_TIME", "TELAPSE", "XPOSURE", "EXPOSURETIME"]),
    ("egain", &["EGAIN", "CVF"]),
    ("gain", &["GAIN"]),
    ("offset", &["OFFSET", "BLKLEVEL"]),
    ("filter", &["FILTER", "FILTERS", "INSFLNAM", "FILTER01", "FILTER1"]),
    ("object", &["OBJECT", "OBJNAME"]),
    ("imagetyp", &["IMAGETYP", "OBSTYPE", "FRAME", "IMAGETYPE", "FRAMETYP", "CALFRAME"]),
    ("camera", &["INSTRUME", "CAMERAID", "CAMERA", "DETECTOR"]),
    ("binning", &["XBINNING", "CCDXBIN", "BINX", "CCDBIN1", "BIN-FCT1", "CCDSUM", "BINNING", "XFACTOR"]),
    ("pix_scale", &["PIXSCALE", "SCALE", "SECPIX"]),
    ("read_noise", &["RDNOISE", "READNOIS", "READNOISE", "RNOISE"]),
];

/// The keywords of a quantity: the observer's own, then the usual ones.
#[must_use]
pub fn keywords<'a>(aliases: &'a Aliases, quantity: &str) -> Vec<&'a str> {
    let own = aliases.get(quantity).into_iter().flatten().map(String::as_str);
    let usual = USUAL.iter().find(|(q, _)| *q == quantity).map_or(&[] as &[&str], |(_, k)| k);
    own.chain(usual.iter().copied()).collect()
}

/// The first keyword of a quantity that has a value.
#[must_use]
pub fn find(header: &Header, aliases: &Aliases, quantity: &str) -> Option<String> {
    keywords(aliases, quantity).into_iter().find(|k| header.text(k).is_some()).map(str::to_string)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_quantity_may_be_named_in_the_configuration() {
        assert!(USUAL.iter().all(|(q, _)| crate::config::QUANTITIES.contains(q)));
        let own = Aliases::from([("egain".to_string(), vec!["MYGAIN".to_string()])]);
        assert_eq!(keywords(&own, "egain"), ["MYGAIN", "EGAIN", "CVF"]);
    }
}
