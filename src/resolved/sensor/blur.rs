//! What blurs a picture, as transfer functions: seeing, diffraction, jitter and drift of the tracking, and their
//! product.
//!
//! Lengths in arcsec, spatial frequencies in cycles per arcsec; every function is 1 at frequency 0, so that no photon
//! is lost. Not included: defocus, scattered light, a PSF that changes over the field or with the wavelength.

use crate::base::constants::ARCSEC_PER_RAD;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use statrs::function::gamma::gamma;

use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::error::{Error, Result};

/// Beyond this argument the transfer of a Moffat is below 1e-15.
const MOFFAT_END: f64 = 45.0;
/// Steps of the table of a Moffat's transfer.
const MOFFAT_STEPS: usize = 4_500;

/// The long-exposure image of a star through the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Seeing {
    /// None: above the air.
    None,
    /// Gaussian of this FWHM \[arcsec\].
    Gaussian {
        /// FWHM \[arcsec\].
        fwhm_arcsec: f64,
    },
    /// Moffat `I ∝ (1 + r²/α²)^(−β)`, `FWHM = 2α √(2^(1/β) − 1)`.
    Moffat {
        /// FWHM \[arcsec\].
        fwhm_arcsec: f64,
        /// Exponent, above 1.
        beta: f64,
    },
}

/// A round aperture with a round central obstruction, at one wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pupil {
    /// Diameter \[m\].
    pub aperture_m: f64,
    /// Diameter of the obstruction over that of the aperture.
    pub obstruction: f64,
    /// Wavelength \[µm\].
    pub wavelength_um: f64,
}

/// Everything that blurs one exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blur {
    /// The air.
    pub seeing: Seeing,
    /// Diffraction; `None` leaves it out.
    pub pupil: Option<Pupil>,
    /// Tracking error within the exposure, root mean square per axis \[arcsec\].
    pub jitter_arcsec: f64,
    /// Drift during the exposure along x and y of the picture \[arcsec\].
    pub drift_arcsec: (f64, f64),
}

impl Blur {
    /// Checks every number once.
    ///
    /// # Errors
    /// [`Error::Model`] naming the number that makes no sense.
    pub fn check(&self) -> Result<()> {
        let fault = |problem: String| Err(Error::Model { problem });
        let fwhm = self.seeing.fwhm_arcsec();
        if !((0.0..=600.0).contains(&fwhm) && (fwhm > 0.0 || self.seeing == Seeing::None)) {
            return fault(format!("seeing {fwhm} arcsec is not above 0 and at most 600"));
        }
        if let Seeing::Moffat { beta, .. } = self.seeing
            && !(1.2..=50.0).contains(&beta)
        {
            return fault(format!("Moffat exponent {beta} is outside 1.2 to 50"));
        }
        if let Some(p) = self.pupil {
            if !(p.aperture_m > 0.0 && p.aperture_m < 1e3) {
                return fault(format!("aperture {} m is not above 0 and below 1000", p.aperture_m));
            }
            if !(0.0..1.0).contains(&p.obstruction) {
                return fault(format!("obstruction {} is not from 0 to below 1 of the diameter", p.obstruction));
            }
            if !(0.1..=100.0).contains(&p.wavelength_um) {
                return fault(format!("wavelength {} um is outside 0.1 to 100", p.wavelength_um));
            }
        }
        if !(0.0..=600.0).contains(&self.jitter_arcsec) {
            return fault(format!("jitter {} arcsec is outside 0 to 600", self.jitter_arcsec));
        }
        let drift = self.drift_arcsec.0.hypot(self.drift_arcsec.1);
        if !(drift <= 3_600.0) {
            return fault(format!("drift {drift} arcsec is above 3600"));
        }
        Ok(())
    }

    /// Width of a star that does not drift \[arcsec\]: the parts' FWHM in quadrature, good to some per cent.
    #[must_use]
    pub fn fwhm_arcsec(&self) -> f64 {
        let airy = self.pupil.map_or(0.0, |p| 1.03 * p.lambda_over_d_arcsec());
        (self.seeing.fwhm_arcsec().powi(2) + airy * airy + (FWHM_PER_SIGMA * self.jitter_arcsec).powi(2)).sqrt()
    }

    /// The transfer of all of it, ready to be evaluated many times.
    #[must_use]
    pub(crate) fn transfer(&self) -> Transfer {
        Transfer { blur: *self, moffat: MoffatTable::new(self.seeing) }
    }
}

impl Seeing {
    /// FWHM \[arcsec\]; 0 without air.
    #[must_use]
    pub fn fwhm_arcsec(self) -> f64 {
        match self {
            Seeing::None => 0.0,
            Seeing::Gaussian { fwhm_arcsec } | Seeing::Moffat { fwhm_arcsec, .. } => fwhm_arcsec,
        }
    }
}

impl Pupil {
    /// λ/D \[arcsec\].
    #[must_use]
    pub fn lambda_over_d_arcsec(&self) -> f64 {
        self.wavelength_um * 1e-6 / self.aperture_m * ARCSEC_PER_RAD
    }

    /// Transfer at a frequency: the overlap of the ring with itself, shifted by `f λ`, over its area; 0 from `D/λ` on.
    ///
    /// `T(d) = (A(1,1,d) − 2 A(1,ε,d) + A(ε,ε,d)) / (π (1 − ε²))`, A the area two discs share, d = 2fλ/D.
    #[must_use]
    pub fn transfer(&self, per_arcsec: f64) -> f64 {
        let (d, e) = (2.0 * per_arcsec * self.lambda_over_d_arcsec(), self.obstruction);
        (shared_area(1.0, 1.0, d) - 2.0 * shared_area(1.0, e, d) + shared_area(e, e, d)) / (PI * (1.0 - e * e))
    }
}

/// Area that two discs of radii a ≥ b share when their centres are d apart.
fn shared_area(a: f64, b: f64, d: f64) -> f64 {
    if d >= a + b {
        return 0.0;
    }
    if d <= a - b {
        return PI * b * b;
    }
    let at_a = ((d * d + a * a - b * b) / (2.0 * d * a)).clamp(-1.0, 1.0).acos();
    let at_b = ((d * d + b * b - a * a) / (2.0 * d * b)).clamp(-1.0, 1.0).acos();
    // sectors less triangles
    a * a * (at_a - 0.5 * (2.0 * at_a).sin()) + b * b * (at_b - 0.5 * (2.0 * at_b).sin())
}

/// The transfer function of a [`Blur`].
pub(crate) struct Transfer {
    blur: Blur,
    moffat: Option<MoffatTable>,
}

impl Transfer {
    /// At a frequency along x and y \[cycles/arcsec\].
    pub fn at(&self, fx: f64, fy: f64) -> f64 {
        let f = fx.hypot(fy);
        let gauss = |sigma: f64| (-2.0 * (PI * sigma * f).powi(2)).exp();
        let air = match (&self.moffat, self.blur.seeing) {
            (Some(table), _) => table.at(f),
            (None, Seeing::Gaussian { fwhm_arcsec }) => gauss(fwhm_arcsec / FWHM_PER_SIGMA),
            (None, _) => 1.0,
        };
        let pupil = self.blur.pupil.map_or(1.0, |p| p.transfer(f));
        let (dx, dy) = self.blur.drift_arcsec;
        air * pupil * gauss(self.blur.jitter_arcsec) * sinc(fx * dx + fy * dy)
    }
}

/// sin(πx)/(πx).
pub(crate) fn sinc(x: f64) -> f64 {
    let y = PI * x;
    if y.abs() < 1e-4 { 1.0 - y * y / 6.0 } else { y.sin() / y }
}

/// The transfer of a Moffat over q = 2π α f, at equal steps of q.
struct MoffatTable {
    q_per_frequency: f64,
    values: Vec<f64>,
}

impl MoffatTable {
    fn new(seeing: Seeing) -> Option<Self> {
        let Seeing::Moffat { fwhm_arcsec, beta } = seeing else { return None };
        let alpha = fwhm_arcsec / (2.0 * (2f64.powf(1.0 / beta) - 1.0).sqrt());
        let step = MOFFAT_END / MOFFAT_STEPS as f64;
        let values = (0..MOFFAT_STEPS + 2).map(|i| moffat_transfer(beta, i as f64 * step)).collect();
        Some(Self { q_per_frequency: TAU * alpha, values })
    }

    /// By the parabola through three neighbours.
    fn at(&self, frequency: f64) -> f64 {
        let u = self.q_per_frequency * frequency * MOFFAT_STEPS as f64 / MOFFAT_END;
        let i = (u.round() as usize).max(1);
        let (Some(a), Some(b), Some(c)) = (self.values.get(i - 1), self.values.get(i), self.values.get(i + 1)) else {
            return 0.0;
        };
        let t = u - i as f64;
        b + 0.5 * t * (c - a) + 0.5 * t * t * (a - 2.0 * b + c)
    }
}

/// Transfer of a Moffat: `2/Γ(ν) (q/2)^ν K_ν(q)`, ν = β − 1, q = 2π α f (Trujillo et al. 2001, MNRAS 328, 977, Eq. 11).
fn moffat_transfer(beta: f64, q: f64) -> f64 {
    let nu = beta - 1.0;
    if q < 1e-12 {
        return 1.0;
    }
    // ∫ exp(ν ln(q/2) − q cosh t) cosh(νt) dt from 0, by the trapezoid: its error falls like exp(−π²/h)
    let h = 0.06;
    let scale = nu * (0.5 * q).ln();
    let mut sum = 0.0;
    for i in 0..2_000 {
        let t = f64::from(i) * h;
        let growth = nu * t - q * t.cosh() + scale;
        let term = 0.5 * (growth.exp() + (growth - 2.0 * nu * t).exp());
        sum += if i == 0 { 0.5 * term } else { term };
        if growth < -45.0 && t > FRAC_PI_2 && q * t.sinh() > nu {
            break;
        }
    }
    2.0 / gamma(nu) * sum * h
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transfer_of_a_ring_is_the_share_of_its_points_that_stay_on_it_when_it_is_shifted() {
        // by counting the points of a grid
        let count = |obstruction: f64, shift: f64| {
            let on = |x: f64, y: f64| (obstruction * obstruction..1.0).contains(&(x * x + y * y));
            let grid = || (-600..600).flat_map(|i| (-600..600).map(move |j| (f64::from(i) + 0.5, f64::from(j) + 0.5)));
            let points = grid().map(|(i, j)| (i / 600.0, j / 600.0)).filter(|(x, y)| on(*x, *y));
            let (mut all, mut both) = (0.0, 0.0);
            for (x, y) in points {
                all += 1.0;
                both += if on(x + shift, y) { 1.0 } else { 0.0 };
            }
            both / all
        };
        for obstruction in [0.0, 0.47, 0.9] {
            let pupil = Pupil { aperture_m: 0.61, obstruction, wavelength_um: 0.6 };
            let cut = 1.0 / pupil.lambda_over_d_arcsec();
            for share in [0.0, 0.02, 0.2, 0.27, 0.45, 0.6, 0.73, 0.9, 1.0] {
                let (got, counted) = (pupil.transfer(share * cut), count(obstruction, 2.0 * share));
                assert!((got - counted).abs() < 2e-3, "{obstruction} {share}: {got} {counted}");
            }
            assert!((pupil.transfer(0.0) - 1.0).abs() < 1e-15 && pupil.transfer(1.001 * cut) == 0.0);
        }
    }

    #[test]
    fn the_transfer_of_a_moffat_is_its_hankel_transform() {
        // half-integer orders are elementary: β = 1.5 is exp(−q), β = 2.5 is (1 + q) exp(−q)
        for q in [0.0f64, 1e-3, 0.1, 1.0, 5.0, 20.0] {
            assert!((moffat_transfer(1.5, q) - (-q).exp()).abs() < 1e-12, "{q}");
            assert!((moffat_transfer(2.5, q) - (1.0 + q) * (-q).exp()).abs() < 1e-12, "{q}");
            assert!((moffat_transfer(3.5, q) - (1.0 + q + q * q / 3.0) * (-q).exp()).abs() < 1e-12, "{q}");
        }
        let blur = Blur {
            seeing: Seeing::Moffat { fwhm_arcsec: 2.0, beta: 2.5 },
            pupil: None,
            jitter_arcsec: 0.0,
            drift_arcsec: (0.0, 0.0),
        };
        let alpha = 1.0 / (2f64.powf(0.4) - 1.0).sqrt();
        for f in [0.0, 0.013, 0.3, 0.77, 2.0] {
            let q = TAU * alpha * f;
            assert!((blur.transfer().at(f, 0.0) - (1.0 + q) * (-q).exp()).abs() < 1e-6, "{f}");
        }
    }

    #[test]
    fn a_drift_is_felt_along_itself_and_not_across() {
        let blur = Blur { seeing: Seeing::None, pupil: None, jitter_arcsec: 0.0, drift_arcsec: (3.0, 0.0) };
        assert!((blur.transfer().at(0.0, 5.0) - 1.0).abs() < 1e-15);
        assert!(blur.transfer().at(1.0 / 3.0, 0.0).abs() < 1e-15);
    }

    #[test]
    fn impossible_blurs_are_refused_by_name() {
        let good = Blur {
            seeing: Seeing::Gaussian { fwhm_arcsec: 2.0 },
            pupil: None,
            jitter_arcsec: 0.0,
            drift_arcsec: (0.0, 0.0),
        };
        assert!(good.check().is_ok());
        let pupil = |aperture_m, obstruction, wavelength_um| Blur {
            pupil: Some(Pupil { aperture_m, obstruction, wavelength_um }),
            ..good
        };
        for (blur, said) in [
            (Blur { seeing: Seeing::Gaussian { fwhm_arcsec: 0.0 }, ..good }, "seeing 0"),
            (Blur { seeing: Seeing::Moffat { fwhm_arcsec: 2.0, beta: 1.0 }, ..good }, "exponent 1"),
            (Blur { jitter_arcsec: -1.0, ..good }, "jitter -1"),
            (Blur { drift_arcsec: (f64::NAN, 0.0), ..good }, "drift NaN"),
            (pupil(0.0, 0.4, 0.6), "aperture 0"),
            (pupil(0.6, 1.0, 0.6), "obstruction 1"),
            (pupil(0.6, 0.4, 0.0), "wavelength 0"),
        ] {
            let error = blur.check().unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}
