//! V and B−V from Tycho-2 and Gaia magnitudes, with the error of the relation in theirs.
//!
//! Magnitudes. Outside the published range of a relation the result is `None`. Not included: reddening, luminosity
//! classes, M dwarfs of Tycho.

use crate::bands::{Band, GaiaRelation};

/// A magnitude or colour with its error, if known \[mag\].
pub type Value = (f64, Option<f64>);

/// V and B−V of a star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Johnson {
    /// V \[mag\].
    pub v: Value,
    /// B−V \[mag\], where the relation holds.
    pub b_v: Option<Value>,
}

/// Range of BT−VT of the Tycho relation \[mag\].
pub const TYCHO_RANGE_MAG: [f64; 2] = [-0.2, 1.8];
/// Error of V from Tycho \[mag\]: "generally below".
const TYCHO_V_ERR_MAG: f64 = 0.015;
/// Error of B−V from Tycho \[mag\].
const TYCHO_B_V_ERR_MAG: f64 = 0.05;
/// Range of BP−RP of V from Gaia \[mag\].
pub const GAIA_RANGE_MAG: [f64; 2] = [-0.5, 5.0];
/// Range of BP−RP taken for B−V from Gaia \[mag\]: about −0.1 to 1.5 of B−V, inside that of either relation.
pub const GAIA_COLOUR_RANGE_MAG: [f64; 2] = [-0.1, 1.9];
/// Error taken for B−V from Gaia \[mag\]: 0.05 of the Tycho relation and the scatter of both polynomials; an estimate.
const GAIA_B_V_ERR_MAG: f64 = 0.1;

/// V = VT − 0.090 (BT−VT), B−V = 0.850 (BT−VT); `None` outside −0.2 < BT−VT < 1.8.
///
/// # Source
/// ESA 1997, The Hipparcos and Tycho Catalogues, SP-1200, vol. 1, section 1.3: errors generally below 0.015 mag in V
/// and 0.05 mag in B−V, unreddened stars, not for M stars.
#[must_use]
pub fn tycho(bt: Value, vt: Value) -> Option<Johnson> {
    let colour = bt.0 - vt.0;
    if !(TYCHO_RANGE_MAG[0] < colour && colour < TYCHO_RANGE_MAG[1]) {
        return None;
    }
    // σ_V² = (1.090 σ_VT)² + (0.090 σ_BT)²; σ_B−V² = 0.850² (σ_BT² + σ_VT²)
    let v_err = vt.1.map(|vt_err| quadrature(&[1.090 * vt_err, 0.090 * bt.1.unwrap_or(0.0), TYCHO_V_ERR_MAG]));
    let b_v_err = bt.1.zip(vt.1).map(|(b, v)| quadrature(&[0.850 * b, 0.850 * v, TYCHO_B_V_ERR_MAG]));
    Some(Johnson { v: (vt.0 - 0.090 * colour, v_err), b_v: Some((0.850 * colour, b_v_err)) })
}

/// V from G and BP−RP; B−V by way of the Tycho magnitudes of the same star; `None` outside −0.5 < BP−RP < 5.
///
/// G−V = −0.02704 + 0.01424 x − 0.2156 x² + 0.01426 x³, x = BP−RP, σ = 0.030;
/// G−VT = −0.01077 − 0.0682 x − 0.2387 x² + 0.02342 x³;
/// G−BT = −0.004288 − 0.8547 x + 0.1244 x² − 0.9085 x³ + 0.4843 x⁴ − 0.06814 x⁵; B−V = 0.850 (BT−VT).
///
/// # Source
/// Gaia DR3 documentation, section 5.5.1, tables 5.9 (Riello et al. 2021, A&A 649, A3, appendix C); B−V as [`tycho`].
#[must_use]
pub fn gaia(g: Value, bp: Value, rp: Value) -> Option<Johnson> {
    let x = bp.0 - rp.0;
    let v = gaia_band(&GaiaRelation::of(Band::V)?, g, bp, rp)?;
    let x_err = quadrature(&[bp.1.unwrap_or(0.0), rp.1.unwrap_or(0.0)]);
    let b_v = (GAIA_COLOUR_RANGE_MAG[0] < x && x < GAIA_COLOUR_RANGE_MAG[1]).then(|| {
        let g_minus_vt = polynomial(&[-0.01077, -0.0682, -0.2387, 0.02342], x);
        let g_minus_bt = polynomial(&[-0.004_288, -0.8547, 0.1244, -0.9085, 0.4843, -0.068_14], x);
        // d(B−V)/dx is about 0.8 over the range
        (0.850 * (g_minus_vt - g_minus_bt), Some(quadrature(&[0.8 * x_err, GAIA_B_V_ERR_MAG])))
    });
    Some(Johnson { v, b_v })
}

/// X = G − Σ cₙ (BP−RP)ⁿ; `None` outside the range of the relation.
#[must_use]
pub fn gaia_band(relation: &GaiaRelation, g: Value, bp: Value, rp: Value) -> Option<Value> {
    let x = bp.0 - rp.0;
    if !(relation.range_mag[0] < x && x < relation.range_mag[1]) {
        return None;
    }
    let (g_minus_x, slope) = relation.g_minus_x(x);
    let x_err = quadrature(&[bp.1.unwrap_or(0.0), rp.1.unwrap_or(0.0)]);
    Some((g.0 - g_minus_x, Some(quadrature(&[g.1.unwrap_or(0.0), slope * x_err, relation.scatter_mag]))))
}

/// A Johnson-Cousins magnitude by way of two of another set: `base + c₀ + c₁ c + c₂ c²`, c = g − r.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// What is made.
    pub band: Band,
    /// g.
    pub blue: Band,
    /// r.
    pub red: Band,
    /// What the colour is added to.
    pub base: Band,
    coefficients: [f64; 3],
    /// Scatter of stars about the relation \[mag\].
    pub scatter_mag: f64,
    /// Of which set, and by whom.
    pub source: &'static str,
}

impl Pair {
    /// Range of g − r \[mag\].
    pub const RANGE_MAG: [f64; 2] = [-0.3, 1.5];

    /// The relation of a band, from Pan-STARRS or from SDSS magnitudes.
    ///
    /// # Source
    /// Pan-STARRS: Kostov & Bonev 2018 (arXiv 1706.06147), table 2, which gives the Sun's magnitudes within 0.02; SDSS:
    /// Jester et al. 2005, AJ 130, 873 (V, B) and the relations of stdpipe for APASS (R, I).
    #[must_use]
    pub fn of(band: Band, pan_starrs: bool) -> Option<Self> {
        let (base, coefficients, scatter_mag) = match (band, pan_starrs) {
            (Band::B, true) => (Band::SloanG, [0.199, 0.540, 0.016], 0.03),
            (Band::V, true) => (Band::SloanG, [-0.020, -0.498, -0.008], 0.02),
            (Band::R, true) => (Band::SloanR, [-0.163, -0.086, -0.061], 0.02),
            (Band::I, true) => (Band::SloanI, [-0.387, -0.123, -0.034], 0.02),
            (Band::B, false) => (Band::SloanG, [0.21, 0.39, 0.0], 0.03),
            (Band::V, false) => (Band::SloanG, [-0.01, -0.59, 0.0], 0.01),
            (Band::R, false) => (Band::SloanR, [-0.157, -0.087, -0.014], 0.03),
            (Band::I, false) => (Band::SloanI, [-0.354, -0.118, -0.004], 0.03),
            _ => return None,
        };
        let source = if pan_starrs { "g, r and i of Pan-STARRS" } else { "g', r' and i' of SDSS" };
        Some(Self { band, blue: Band::SloanG, red: Band::SloanR, base, coefficients, scatter_mag, source })
    }

    /// The magnitude and its error; `None` outside the range of colours.
    #[must_use]
    pub fn magnitude(&self, blue: Value, red: Value, base: Value) -> Option<Value> {
        let c = blue.0 - red.0;
        if !(Self::RANGE_MAG[0] < c && c < Self::RANGE_MAG[1]) {
            return None;
        }
        let [_, c1, c2] = self.coefficients;
        let slope = c1 + 2.0 * c2 * c;
        let c_err = quadrature(&[blue.1.unwrap_or(0.0), red.1.unwrap_or(0.0)]);
        let err = quadrature(&[base.1.unwrap_or(0.0), slope * c_err, self.scatter_mag]);
        Some((base.0 + polynomial(&self.coefficients, c), Some(err)))
    }
}

/// c₀ + c₁ x + c₂ x² + ...
fn polynomial(c: &[f64], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

fn quadrature(errors: &[f64]) -> f64 {
    errors.iter().map(|e| e * e).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tycho_magnitudes_give_johnson_ones_as_bessell_measured_them() {
        // Bessell 2000, PASP 112, 961, table 2: BT−VT, V−VT, (B−V)−(BT−VT); the relation claims 0.015 and 0.05 mag
        for (colour, v_vt, b_v) in [(0.0, 0.001, -0.005), (0.5, -0.054, -0.035), (1.0, -0.098, -0.122)] {
            let j = tycho((9.0 + colour, None), (9.0, None)).unwrap();
            assert!((j.v.0 - 9.0 - v_vt).abs() < 0.015, "{colour}: {j:?}");
            assert!((j.b_v.unwrap().0 - colour - b_v).abs() < 0.05, "{colour}: {j:?}");
        }
        let j = tycho((9.5, Some(0.01)), (9.0, Some(0.01))).unwrap();
        // by hand: √((0.0109)² + (0.0009)² + 0.015²)
        assert!((j.v.1.unwrap() - 0.018_563).abs() < 1e-5);
        assert!(tycho((8.0, None), (6.0, None)).is_none() && tycho((f64::NAN, None), (6.0, None)).is_none());
    }

    #[test]
    fn gaia_magnitudes_of_the_sun_give_its_johnson_ones() {
        // Casagrande & VandenBerg 2018, MNRAS 479, L102: BP−RP = 0.82, G−V = −0.12 for the Sun (V −26.76, G −26.90);
        // B−V 0.65. 0.05 and 0.1 are the errors of the relations
        let j = gaia((-26.90, None), (0.82, None), (0.0, None)).unwrap();
        assert!((j.v.0 + 26.76).abs() < 0.05, "{j:?}");
        assert!((j.b_v.unwrap().0 - 0.65).abs() < 0.1, "{j:?}");
        assert!(gaia((10.0, None), (3.0, None), (0.5, None)).unwrap().b_v.is_none());
        assert!(gaia((10.0, None), (16.0, None), (10.0, None)).is_none());
    }

    #[test]
    fn other_magnitudes_of_the_sun_give_its_johnson_cousins_ones() {
        // Willmer 2018: Pan-STARRS g -26.54, r -26.93, i -27.05; SDSS -26.47, -26.93, -27.05; B V R I -26.13 -26.76 -27.15 -27.47
        let suns = [(true, [-26.54, -26.93, -27.05]), (false, [-26.47, -26.93, -27.05])];
        for (pan_starrs, [g, r, i]) in suns {
            for (band, sun) in [(Band::B, -26.13), (Band::V, -26.76), (Band::R, -27.15), (Band::I, -27.47)] {
                let pair = Pair::of(band, pan_starrs).unwrap();
                let base = match pair.base {
                    Band::SloanG => g,
                    Band::SloanR => r,
                    _ => i,
                };
                let (mag, err) = pair.magnitude((g, None), (r, None), (base, None)).unwrap();
                assert!((mag - sun).abs() < 0.05, "{band} {pan_starrs}: {mag} {sun}");
                assert_eq!(err, Some(pair.scatter_mag));
            }
        }
        for band in [Band::B, Band::V, Band::R, Band::I, Band::SloanG, Band::SloanR, Band::SloanI, Band::SloanZ] {
            let relation = GaiaRelation::of(band).unwrap();
            let (mag, _) = gaia_band(&relation, (-26.90, None), (0.82, None), (0.0, None)).unwrap();
            assert!((mag - band.sun_mag().unwrap()).abs() < 0.055, "{band}: {mag}");
        }
    }

    #[test]
    fn colours_from_gaia_rise_with_its_own() {
        let b_v = |x: f64| gaia((10.0, None), (x, None), (0.0, None)).unwrap().b_v.unwrap().0;
        for i in 0..=18 {
            let x = f64::from(i) / 10.0 - 0.05;
            assert!(b_v(x + 0.05) > b_v(x), "{x}");
        }
    }
}
