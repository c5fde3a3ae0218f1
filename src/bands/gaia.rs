//! Magnitudes of other bands from those of Gaia: `G − X = Σ cₙ (BP−RP)ⁿ`.

use crate::bands::Band;

/// The relation of one band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaiaRelation {
    /// c₀, c₁, ...
    pub coefficients: &'static [f64],
    /// BP−RP for which it holds \[mag\].
    pub range_mag: [f64; 2],
    /// Scatter of stars about it \[mag\].
    pub scatter_mag: f64,
}

/// # Source
/// Gaia DR3 documentation, section 5.5.1 (Riello et al. 2021, A&A 649, A3, appendix C): g, r, i and z are those of SDSS.
/// The scatter is published for V and R; 0.04 for B and I and 0.07 for g, r, i and z are estimates, as are the ranges of B and z.
const RELATIONS: [(Band, GaiaRelation); 8] = [
    (Band::B, relation(&[0.014_48, -0.6874, -0.3604, 0.067_18, -0.006_061], [-0.5, 4.0], 0.04)),
    (Band::V, relation(&[-0.027_04, 0.014_24, -0.2156, 0.014_26], [-0.5, 5.0], 0.030_17)),
    (Band::R, relation(&[-0.022_75, 0.3961, -0.1243, -0.013_96, 0.003_775], [0.0, 4.0], 0.032)),
    (Band::I, relation(&[0.017_53, 0.76, -0.0991], [-0.5, 4.5], 0.04)),
    (Band::SloanG, relation(&[0.2199, -0.6365, -0.1548, 0.0064], [0.3, 3.0], 0.07)),
    (Band::SloanR, relation(&[-0.098_37, 0.085_92, 0.1907, -0.1701, 0.022_63], [0.0, 3.0], 0.07)),
    (Band::SloanI, relation(&[-0.293, 0.6404, -0.096_09, -0.002_104], [0.5, 2.0], 0.07)),
    (Band::SloanZ, relation(&[-0.4619, 0.8992, -0.082_71, 0.005_029], [0.5, 2.0], 0.07)),
];

const fn relation(coefficients: &'static [f64], range_mag: [f64; 2], scatter_mag: f64) -> GaiaRelation {
    GaiaRelation { coefficients, range_mag, scatter_mag }
}

impl GaiaRelation {
    /// The relation of a band, if there is one.
    #[must_use]
    pub fn of(band: Band) -> Option<Self> {
        RELATIONS.iter().find(|(own, _)| *own == band).map(|(_, relation)| *relation)
    }

    /// `G − X` and its slope at BP−RP \[mag\], inside the range or not.
    #[must_use]
    pub fn g_minus_x(&self, bp_rp_mag: f64) -> (f64, f64) {
        let value = |sum: (f64, f64), c: &f64| (sum.0 * bp_rp_mag + c, sum.1 * bp_rp_mag + sum.0);
        self.coefficients.iter().rev().fold((0.0, 0.0), value)
    }
}
