//! Colour indices: which one a band is calibrated with, the Sun's, and stars of one index by another.

use super::gaia::GaiaRelation;
use crate::bands::{Band, column_band};

/// B−V of the Sun \[mag\]: Cox 2002, as Caddy et al. use it.
const SUN_B_V_MAG: f64 = 0.65;
/// BP−RP between which one index is made of another \[mag\]; all rise with it.
const BP_RP_MAG: [f64; 2] = [-0.5, 4.0];

/// A difference of two magnitudes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ColourIndex {
    /// The band of shorter wavelengths.
    pub blue: Band,
    /// The band that is subtracted.
    pub red: Band,
}

impl ColourIndex {
    /// B−V.
    pub const B_V: Self = Self { blue: Band::B, red: Band::V };
    /// g−r.
    pub const G_R: Self = Self { blue: Band::SloanG, red: Band::SloanR };
    /// r−i.
    pub const R_I: Self = Self { blue: Band::SloanR, red: Band::SloanI };
    /// BP−RP.
    pub const BP_RP: Self = Self { blue: Band::GaiaBp, red: Band::GaiaRp };
    /// i−z.
    const I_Z: Self = Self { blue: Band::SloanI, red: Band::SloanZ };
    /// V−R.
    const V_R: Self = Self { blue: Band::V, red: Band::R };

    /// The indices that magnitudes of a band are calibrated with, the usual one first.
    #[must_use]
    pub fn of_band(band: Band) -> &'static [Self] {
        match band.reference() {
            Band::SloanU | Band::SloanG => &[Self::G_R, Self::B_V, Self::BP_RP],
            Band::SloanR => &[Self::R_I, Self::G_R, Self::B_V, Self::BP_RP],
            Band::SloanI => &[Self::R_I, Self::I_Z, Self::G_R, Self::B_V, Self::BP_RP],
            Band::SloanZ | Band::PanStarrsY => &[Self::I_Z, Self::R_I, Self::G_R, Self::BP_RP],
            Band::GaiaG | Band::GaiaBp | Band::GaiaRp => &[Self::BP_RP, Self::B_V, Self::G_R],
            Band::R | Band::I | Band::RJohnson | Band::IJohnson => &[Self::B_V, Self::V_R, Self::G_R, Self::BP_RP],
            _ => &[Self::B_V, Self::G_R, Self::BP_RP],
        }
    }

    /// The index of a name: `B-V`, `g_psf-r_psf`, `BPmag-RPmag`, `b_v_mag`.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        if matches!(name, "b_v_mag" | "B_V" | "BV" | "(B-V)" | "catalogue_b_v_mag") {
            return Some(Self::B_V);
        }
        let (blue, red) = name.trim_matches(['(', ')']).split_once(['-', '−'])?;
        Some(Self { blue: column_band(blue)?, red: column_band(red)? })
    }

    /// The Sun's \[mag\]; `None` where a magnitude of the Sun is not known.
    #[must_use]
    pub fn sun_mag(self) -> Option<f64> {
        if self == Self::B_V { Some(SUN_B_V_MAG) } else { Some(self.blue.sun_mag()? - self.red.sun_mag()?) }
    }

    /// The index of stars with this BP−RP \[mag\]; `None` for bands without a relation.
    fn at_bp_rp(self, bp_rp_mag: f64) -> Option<f64> {
        if self == Self::BP_RP {
            return Some(bp_rp_mag);
        }
        let g_minus = |band| GaiaRelation::of(band).map(|relation| relation.g_minus_x(bp_rp_mag).0);
        Some(g_minus(self.red)? - g_minus(self.blue)?)
    }

    /// The index of stars of the main sequence with this B−V \[mag\], by way of their BP−RP; B−V itself for bands without a
    /// relation. Good to about 0.05 mag: for cuts, not for calibration.
    #[must_use]
    pub fn of_b_v(self, b_v_mag: f64) -> f64 {
        if self == Self::B_V {
            return b_v_mag;
        }
        let at = |x: f64| Self::B_V.at_bp_rp(x).unwrap_or(f64::NAN);
        let [mut low, mut high] = BP_RP_MAG;
        if !(at(low) < b_v_mag && b_v_mag < at(high)) {
            return b_v_mag; // a range that is wide open
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if at(middle) < b_v_mag { low = middle } else { high = middle }
        }
        self.at_bp_rp(low).unwrap_or(b_v_mag)
    }
}

impl std::fmt::Display for ColourIndex {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}-{}", self.blue, self.red)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_has_its_published_colours() {
        // Willmer 2018; BP−RP: Casagrande & VandenBerg 2018
        for (name, mag) in [("B-V", 0.65), ("V-R", 0.39), ("R-I", 0.32), ("g-r", 0.46), ("r-i", 0.12), ("BP-RP", 0.82)]
        {
            let index = ColourIndex::named(name).unwrap();
            assert_eq!(index.to_string(), name);
            assert!((index.sun_mag().unwrap() - mag).abs() < 0.015, "{name}: {:?}", index.sun_mag());
        }
    }

    #[test]
    fn the_colours_of_the_sun_go_with_each_other() {
        // the relations of stars at the Sun's B−V give the Sun's own colours, which are from its spectrum
        for index in [ColourIndex::G_R, ColourIndex::R_I, ColourIndex::BP_RP, ColourIndex::V_R] {
            let (by_stars, sun) = (index.of_b_v(0.63), index.sun_mag().unwrap());
            assert!((by_stars - sun).abs() < 0.06, "{index}: {by_stars} {sun}");
        }
    }

    #[test]
    fn a_cut_in_b_v_keeps_its_order_in_every_index_and_an_open_one_stays_open() {
        for index in [ColourIndex::B_V, ColourIndex::G_R, ColourIndex::R_I, ColourIndex::I_Z, ColourIndex::BP_RP] {
            assert!(index.of_b_v(0.2) < index.of_b_v(0.5) && index.of_b_v(0.5) < index.of_b_v(0.9), "{index}");
            assert_eq!([index.of_b_v(-20.0), index.of_b_v(20.0)], [-20.0, 20.0]);
        }
    }

    #[test]
    fn names_of_columns_give_their_index() {
        assert_eq!(ColourIndex::named("g_psf-r_psf"), Some(ColourIndex::G_R));
        assert_eq!(ColourIndex::named("BPmag-RPmag"), Some(ColourIndex::BP_RP));
        assert_eq!(ColourIndex::named("b_v_mag"), Some(ColourIndex::B_V));
        assert_eq!(ColourIndex::named("colour"), None);
    }
}
