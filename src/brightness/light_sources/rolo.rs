//! ROLO: the reflectance of the whole lunar disc against phase, in 32 bands from 350 to 2384 nm.
//!
//! Phase angles in deg. Zero libration; the terms odd in the Sun's selenographic longitude cancel between waxing and
//! waning, and so do not appear. Not included: the smoothing of the bands onto soil spectra (they scatter by 0.02 mag).

use crate::base::error::{Error, Result};
use crate::brightness::spectrum::{Band, Curve, Spectrum, embedded};

/// Phase angles ROLO was fitted to \[deg\] (Kieffer & Stone 2005).
pub const ROLO_RANGE_DEG: (f64, f64) = (1.55, 97.0);
/// Solid angle of the Moon at 384 400 km \[sr\] (Kieffer & Stone 2005, Eq. 8).
const MOON_SR: f64 = 6.4177e-5;
/// p₁ to p₄ \[deg\] (Kieffer & Stone 2005, Eq. 11). c₁ to c₄ multiply the libration, which is zero here.
const P_DEG: [f64; 4] = [4.06054, 12.8802, -30.5858, 16.7498];

const TABLE: &str = include_str!("../../presets/spectra/rolo_2005.csv");

/// The lunar disc in one pass band.
#[derive(Debug, Clone, PartialEq)]
pub struct Rolo {
    /// Share of each ROLO band in this one, and its a₀ to a₃, d₁ to d₃.
    bands: Vec<(f64, [f64; 7])>,
}

impl Rolo {
    /// The reflectance between ROLO's bands is a straight line; its mean over `band`, weighted by the signal of
    /// sunlight, is then a fixed mixture of them.
    ///
    /// # Errors
    /// [`Error::Model`] when the band reaches beyond 350 to 2383.6 nm by more than 1 % of its signal.
    pub fn new(band: &Band, sun: &Spectrum) -> Result<Self> {
        let rows = embedded(TABLE, "rolo_2005.csv", 8)?;
        let mut bands = Vec::new();
        for (k, row) in rows.iter().enumerate() {
            // the hat function of this band: 1 at it, 0 at its neighbours; the mixture of the hats is the straight
            // lines
            let hat: Vec<Vec<f64>> = (k.saturating_sub(1)..=(k + 1).min(rows.len() - 1))
                .map(|j| vec![rows[j][0], if j == k { 1.0 } else { 0.0 }])
                .collect();
            let hat = Curve::from_rows(&hat, 1);
            let share = band.mean_of(sun, |nm| hat.at(nm));
            if share > 0.0 {
                bands.push((share, [row[1], row[2], row[3], row[4], row[5], row[6], row[7]]));
            }
        }
        let total: f64 = bands.iter().map(|b| b.0).sum();
        if !(total > 0.99) {
            let problem = format!(
                "the lunar law rolo covers 350 to 2383 nm, {:.1} % of band {}; use cox",
                100.0 * total,
                band.name()
            );
            return Err(Error::Model { problem });
        }
        bands.iter_mut().for_each(|b| b.0 /= total);
        Ok(Self { bands })
    }

    /// Disc reflectance at a phase angle \[deg\].
    ///
    /// `ln A = Σ a_i gⁱ + d₁ e^(−g/p₁) + d₂ e^(−g/p₂) + d₃ cos((g − p₃)/p₄)`, g in rad in the sum, in deg elsewhere
    /// (Kieffer & Stone 2005, AJ 129, 2887, Eq. 10). No limit is applied.
    #[must_use]
    pub fn reflectance(&self, phase_deg: f64) -> f64 {
        let g = phase_deg.abs();
        let x = g.to_radians();
        let [p1, p2, p3, p4] = P_DEG;
        let shapes = [1.0, x, x * x, x * x * x, (-g / p1).exp(), (-g / p2).exp(), ((g - p3) / p4).cos()];
        self.bands.iter().map(|(share, c)| share * c.iter().zip(shapes).map(|(c, s)| c * s).sum::<f64>().exp()).sum()
    }

    /// Moonlight over sunlight at mean distances: `A · 6.4177·10⁻⁵ sr / π`.
    #[must_use]
    pub fn moon_over_sun(&self, phase_deg: f64) -> f64 {
        self.reflectance(phase_deg) * MOON_SR / std::f64::consts::PI
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brightness::light_sources::sun::mag_of_flux;
    use crate::brightness::spectrum::SolarColumn;

    #[test]
    fn in_v_the_moon_has_the_magnitudes_of_an_independent_evaluation() {
        let sun = Spectrum::sun(SolarColumn::Extraterrestrial).unwrap();
        let rolo = Rolo::new(&Band::named("V").unwrap(), &sun).unwrap();
        let expected = [
            (2.0, -12.82),
            (5.0, -12.61),
            (7.0, -12.52),
            (10.0, -12.41),
            (20.0, -12.12),
            (30.0, -11.86),
            (60.0, -11.05),
            (90.0, -10.07),
        ];
        for (deg, v_mag) in expected {
            let got = -26.76 + mag_of_flux(rolo.moon_over_sun(deg)).unwrap();
            // rounded to 0.01, and the mixture of the bands at 544, 549 and 554 nm is not stated
            assert!((got - v_mag).abs() < 0.01, "{deg}: {got} {v_mag}");
        }
    }

    #[test]
    fn moonlight_reddens_with_phase() {
        let sun = Spectrum::sun(SolarColumn::Extraterrestrial).unwrap();
        let ratio = |deg| {
            let [g, i] = ["g", "i"].map(|b| Rolo::new(&Band::named(b).unwrap(), &sun).unwrap().reflectance(deg));
            i / g
        };
        assert!(ratio(7.0) > 1.3 && ratio(90.0) > 1.1 * ratio(7.0));
    }
}
