//! How many electrons a star makes: mirrors, filter and detector against a spectrum, photon by photon.
//!
//! m², shares from 0 to 1, e⁻/s. The star has the colours of the Sun, outside the atmosphere; its extinction is the caller's.

use std::f64::consts::FRAC_PI_4;

use crate::base::error::{Error, Result};
use crate::brightness::Band;
use crate::brightness::light_sources::SUN_V_MAG;
use crate::brightness::spectrum::{Curve, Response, SolarColumn, Spectrum, embedded, trapezoid, union_nm};

/// Planck's constant times the speed of light \[J m\], exact (SI).
const H_C_J_M: f64 = 6.626_070_15e-34 * 2.997_924_58e8;

/// Diameter of the shadow of the secondary over the aperture: PlaneWave CDK24, 47 %.
pub const CDK24_OBSTRUCTION: f64 = 0.47;
/// Light the mirrors and lenses pass: ours, for two mirrors and a fold mirror of 96 %, a corrector, a window, some dust.
pub const OPTICS_TRANSMISSION: f64 = 0.8;
/// Light a filter passes at its peak: ours.
pub const FILTER_TRANSMISSION: f64 = 0.9;
/// Dark current of the IMX455 at −10 °C \[e⁻/s/px\] (Alarcon et al. 2023, PASP 135, 055001: a QHY600).
pub const DARK_E_S_PX: f64 = 0.011;
/// Width of a star's image \[arcsec\]: ours.
pub const FWHM_ARCSEC: f64 = 2.0;
/// Zeropoint measured with the CDK24 without a filter: V of 1 e⁻/s outside the atmosphere (Caddy et al., ZP −23.37 ± 0.11
/// of instrumental magnitudes; that those are of electrons is assumed).
pub const PUBLISHED_ZP_MAG: f64 = 23.37;

/// Cameras whose quantum efficiency is known by name: name, table.
const QE: [(&str, &str); 1] = [("asi6200mm", include_str!("../../presets/spectra/imx455_qe.csv"))];

/// What stands between the sky and the electrons.
#[derive(Debug, Clone, PartialEq)]
pub struct Optics {
    /// Diameter of the aperture \[m\].
    pub aperture_m: f64,
    /// Diameter of the central obstruction over that of the aperture.
    pub obstruction: f64,
    /// Share of the light that mirrors and lenses pass.
    pub transmission: f64,
    /// Share of the light the filter passes at its peak; not used without a filter.
    pub filter_transmission: f64,
    /// Electrons per photon over nm.
    pub qe: Curve,
}

impl Optics {
    /// Collecting area \[m²\]: `π/4 D² (1 − ε²)`.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        FRAC_PI_4 * self.aperture_m.powi(2) * (1.0 - self.obstruction.powi(2))
    }

    /// Magnitude of a source of the Sun's colours that makes 1 e⁻/s, outside the atmosphere.
    ///
    /// `ZP = m_Sun + 2.5 lg (A τ ∫ f_λ T q λ/hc dλ)` with f_λ the Sun's at 1 au. With a filter T is the shape of the band,
    /// its peak at the filter's transmission, and magnitudes are those of the band; without one T is 1 and magnitudes are V.
    /// The curves of SDSS hold their own detector and 1.3 airmasses: of them the shape alone is used.
    ///
    /// # Errors
    /// [`Error::Model`] for an aperture, obstruction or share outside its range, and when nothing gets through.
    pub fn zeropoint_mag(&self, filter: Option<&Band>) -> Result<f64> {
        self.check()?;
        let sun = Spectrum::sun(SolarColumn::Extraterrestrial)?;
        let (filter_transmission, sun_mag) =
            filter.map_or((1.0, SUN_V_MAG), |band| (self.filter_transmission, band.sun_mag()));
        // the tables of energy hold λ times the transmission of photons, up to a factor
        let of_photons = |band: &Band, nm: f64| match band.response() {
            Response::Photon => band.transmission().at(nm),
            Response::Energy => band.transmission().at(nm) / nm,
        };
        let peak = filter
            .map_or(1.0, |band| band.transmission().nm().iter().map(|nm| of_photons(band, *nm)).fold(0.0, f64::max));
        let shape = |nm: f64| filter.map_or(1.0, |band| of_photons(band, nm) / peak);
        let mut curves = vec![&self.qe, sun.curve()];
        curves.extend(filter.map(Band::transmission));
        let photons_per_j = |nm: f64| nm * 1e-9 / H_C_J_M;
        let electrons_s_m2 =
            trapezoid(&union_nm(&curves), |nm| sun.curve().at(nm) * photons_per_j(nm) * shape(nm) * self.qe.at(nm));
        let rate_e_s = self.area_m2() * self.transmission * filter_transmission * electrons_s_m2;
        if rate_e_s > 0.0 && rate_e_s.is_finite() {
            return Ok(sun_mag + 2.5 * rate_e_s.log10());
        }
        let name = filter.map_or("no filter", Band::name);
        Err(Error::Model { problem: format!("no light of band {name} becomes electrons") })
    }

    fn check(&self) -> Result<()> {
        let fault = |problem: String| Err(Error::Model { problem });
        if !(self.aperture_m > 0.0 && self.aperture_m < 1e3) {
            return fault(format!("aperture {} m is not above 0 and below 1000", self.aperture_m));
        }
        if !(0.0..1.0).contains(&self.obstruction) {
            return fault(format!("obstruction {} is not from 0 to below 1 of the diameter", self.obstruction));
        }
        for (name, share) in [("optics", self.transmission), ("filter", self.filter_transmission)] {
            if !(share > 0.0 && share <= 1.0) {
                return fault(format!("transmission of the {name} {share} is not above 0 and at most 1"));
            }
        }
        match self.qe.values().iter().find(|q| !(0.0..=1.0).contains(*q)) {
            Some(q) => fault(format!("quantum efficiency {q} is outside 0 to 1")),
            None => Ok(()),
        }
    }
}

/// Quantum efficiency of a camera of the table (`asi6200mm`); `None` for another.
///
/// # Errors
/// [`Error::Table`] when the embedded table is damaged.
pub fn qe_named(camera: &str) -> Result<Option<Curve>> {
    let letters: String = camera.to_ascii_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
    let plain = letters.replace("zwo", "");
    let Some((name, text)) = QE.iter().find(|(name, _)| *name == plain.trim_end_matches("pro")) else {
        return Ok(None);
    };
    Ok(Some(Curve::from_rows(&embedded(text, name, 2)?, 1)))
}

/// The same quantum efficiency from 350 to 1000 nm.
#[must_use]
pub fn flat_qe(electrons_per_photon: f64) -> Curve {
    Curve::from_rows(&[vec![350.0, electrons_per_photon], vec![1_000.0, electrons_per_photon]], 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cdk24() -> Optics {
        Optics {
            aperture_m: 0.61,
            obstruction: CDK24_OBSTRUCTION,
            transmission: OPTICS_TRANSMISSION,
            filter_transmission: FILTER_TRANSMISSION,
            qe: qe_named("ZWO ASI6200MM Pro").unwrap().unwrap(),
        }
    }

    #[test]
    fn the_zeropoints_of_the_cdk24_are_those_of_an_independent_integration() {
        // a Riemann sum in steps of 0.5 nm in another program
        assert!((cdk24().area_m2() - 0.227_689).abs() < 1e-6);
        for (band, expected) in
            [(None, 24.2497), (Some("V"), 22.6590), (Some("g"), 23.1925), (Some("r"), 22.5755), (Some("i"), 21.7088)]
        {
            let band = band.map(|name| Band::named(name).unwrap());
            let zp = cdk24().zeropoint_mag(band.as_ref()).unwrap();
            assert!((zp - expected).abs() < 3e-3, "{band:?}: {zp}");
        }
    }

    #[test]
    fn a_perfect_square_metre_collects_the_photons_of_vega_magnitude_zero() {
        // V = 0: 3.63e-11 W/m²/nm at 545 nm (Bessell, Castelli & Plez 1998) are 9.96e7 photons/s/m²/nm; the V band is about
        // 85 nm wide. A Sun-coloured source of V = 0 must agree to 5 %.
        let optics = Optics {
            aperture_m: (1.0 / FRAC_PI_4).sqrt(),
            obstruction: 0.0,
            transmission: 1.0,
            filter_transmission: 1.0,
            qe: flat_qe(1.0),
        };
        let v = Band::named("V").unwrap();
        let rate = 10f64.powf(0.4 * optics.zeropoint_mag(Some(&v)).unwrap());
        // the width by photons of that very band: ∫ T/λ dλ over its peak
        let width: f64 = {
            let photons: Vec<(f64, f64)> =
                v.transmission().nm().iter().map(|nm| (*nm, v.transmission().at(*nm) / nm)).collect();
            let peak = photons.iter().map(|p| p.1).fold(0.0, f64::max);
            photons.windows(2).map(|w| (w[1].0 - w[0].0) * 0.5 * (w[0].1 + w[1].1) / peak).sum()
        };
        assert!((rate / (9.96e7 * width) - 1.0).abs() < 0.05, "{rate} {width}");
    }

    #[test]
    fn zeropoints_follow_area_and_transmission() {
        let zp = |optics: &Optics| optics.zeropoint_mag(None).unwrap();
        let twice = Optics { aperture_m: 1.22, ..cdk24() };
        assert!((zp(&twice) - zp(&cdk24()) - 5.0 * 2f64.log10()).abs() < 1e-12);
        let half = Optics { transmission: 0.4, ..cdk24() };
        assert!((zp(&half) - zp(&cdk24()) + 2.5 * 2f64.log10()).abs() < 1e-12);
    }

    #[test]
    fn the_measured_zeropoint_lies_between_none_and_the_published_pixel_zeropoint() {
        // what the published limits take for 1 e⁻/s is 25.16, what the mirrors and the detector give 24.25, measured 23.37
        let published_limits = 21.62 - 2.5 * (0.195_748_5_f64 * 0.195_748_5).log10();
        let computed = cdk24().zeropoint_mag(None).unwrap();
        assert!((published_limits - 25.16).abs() < 0.01);
        assert!(PUBLISHED_ZP_MAG < computed && computed < published_limits);
        // not even a perfect telescope without obstruction reaches it
        let perfect = Optics { obstruction: 0.0, transmission: 1.0, ..cdk24() };
        assert!(perfect.zeropoint_mag(None).unwrap() < published_limits - 0.2);
    }

    #[test]
    fn impossible_optics_are_refused_by_name() {
        for (optics, said) in [
            (Optics { aperture_m: 0.0, ..cdk24() }, "aperture 0"),
            (Optics { obstruction: 1.0, ..cdk24() }, "obstruction 1"),
            (Optics { transmission: 1.2, ..cdk24() }, "optics 1.2"),
            (Optics { filter_transmission: f64::NAN, ..cdk24() }, "filter NaN"),
            (Optics { qe: flat_qe(1.5), ..cdk24() }, "1.5"),
            (Optics { qe: flat_qe(0.0), ..cdk24() }, "no light"),
        ] {
            let error = optics.zeropoint_mag(None).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
        assert!(qe_named("qhy9").unwrap().is_none());
    }
}
