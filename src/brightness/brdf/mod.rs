//! How a surface scatters: one-sided reflectance distributions f(i, n, o).
//!
//! Unit \[1/sr\]; i, n, o are unit vectors from the surface to the light, along its normal, to the observer.
//! A mirror has no finite f: whoever integrates light treats it apart.

mod binomial;
mod check;
mod disc;
pub mod fit;
mod law;
mod named;
mod profile;
mod reflectance;

pub use law::{Brdf, PHONG_N_MAX};

pub use binomial::Binomial;
pub use check::REFLECTANCE_MAX;
pub use disc::{direct_reflection, mirror_reflection};
pub use named::EARTH_VEGETATION;
pub use profile::{ProfileRow, ReflectanceRow};

use std::f64::consts::PI;
use std::sync::Arc;

use crate::base::error::{Error, Result};
use crate::base::vector::Vector;
use crate::config;

impl TryFrom<&config::Brdf> for Brdf {
    type Error = Error;

    fn try_from(law: &config::Brdf) -> Result<Self> {
        Ok(match law {
            config::Brdf::Lambert { albedo } => Brdf::Lambert { albedo: *albedo },
            config::Brdf::Phong { kd, ks, n } => Brdf::Phong { kd: *kd, ks: *ks, n: *n },
            config::Brdf::Binomial { b, c, d, l1 } => {
                Brdf::Binomial(Arc::new(Binomial { b: b.clone(), c: c.clone(), d: *d, l1: *l1 }))
            }
            config::Brdf::Abg { a, b, g } => Brdf::Abg { a: *a, b: *b, g: *g },
            config::Brdf::Gaussian { peak_per_sr, sigma } => {
                Brdf::Gaussian { peak_per_sr: *peak_per_sr, sigma: *sigma }
            }
            config::Brdf::Mirror { reflectance } => Brdf::Mirror { reflectance: *reflectance },
            config::Brdf::Named { name } => Brdf::named(name)?,
        })
    }
}

impl Brdf {
    /// f(i, n, o) \[1/sr\]; exactly 0 unless n·i > 0 and n·o > 0.
    #[must_use]
    pub fn value<F>(&self, i: &Vector<F>, n: &Vector<F>, o: &Vector<F>) -> f64 {
        let (cos_i, cos_o) = (n.dot(i), n.dot(o));
        if !(cos_i > 0.0 && cos_o > 0.0) {
            return 0.0;
        }
        match self {
            Brdf::Lambert { .. } | Brdf::Phong { .. } | Brdf::Gaussian { .. } => {
                // 1 − r·o = |r − o|²/2, without cancellation
                let apart = *n * (2.0 * cos_i) - *i - *o;
                self.off_mirror(0.5 * apart.dot(&apart))
            }
            Brdf::Abg { a, b, g } => a / (b + tangential(i, n, cos_i, o, cos_o).norm().powf(*g)),
            Brdf::Binomial(law) => {
                let d = tangential(i, n, cos_i, o, cos_o).norm();
                let v = cos_i * cos_o - i.dot(o); // −o_t·i_t
                law.value(d, v)
            }
            Brdf::Mirror { .. } => 0.0,
        }
    }

    /// f of a law of r·o alone at t = 1 − r·o, for light and observer on the front side \[1/sr\]; NaN for others.
    pub(super) fn off_mirror(&self, t: f64) -> f64 {
        match *self {
            Brdf::Lambert { albedo } => albedo / PI,
            Brdf::Phong { kd, ks, n } => kd / PI + ks * (n + 2.0) / (2.0 * PI) * cosine_power(t, n),
            Brdf::Gaussian { peak_per_sr, sigma } => peak_per_sr * (-t.max(0.0) / sigma).exp(),
            _ => f64::NAN,
        }
    }
}

/// o_t + i_t, the tangential parts; its length is D.
fn tangential<F>(i: &Vector<F>, n: &Vector<F>, cos_i: f64, o: &Vector<F>, cos_o: f64) -> Vector<F> {
    *o + *i - *n * (cos_i + cos_o)
}

/// max(0, 1 − t)ⁿ through the logarithm, so that n = 1e6 neither overflows nor loses the peak.
fn cosine_power(t: f64, n: f64) -> f64 {
    if t < 1.0 { (n * (-t.max(0.0)).ln_1p()).exp() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::vector::Enu;

    fn direction(zenith_deg: f64, azimuth_deg: f64) -> Vector<Enu> {
        let ((sz, cz), (sa, ca)) = (zenith_deg.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
        Vector::new(sz * ca, sz * sa, cz)
    }

    const UP: Vector<Enu> = Vector::new(0.0, 0.0, 1.0);
    const LAWS: [Brdf; 5] = [
        Brdf::Lambert { albedo: 0.3 },
        EARTH_VEGETATION,
        Brdf::Phong { kd: 0.15, ks: 0.25, n: 0.26 },
        Brdf::Phong { kd: 0.0, ks: 1.0, n: 100.0 },
        Brdf::Phong { kd: 0.1, ks: 0.9, n: 1e6 },
    ];

    #[test]
    fn light_and_observer_can_change_places() {
        for brdf in LAWS {
            for (i, o) in
                [(direction(40.0, 0.0), direction(25.0, 170.0)), (direction(80.0, 10.0), direction(3.0, 250.0))]
            {
                let (there, back) = (brdf.value(&i, &UP, &o), brdf.value(&o, &UP, &i));
                assert!((there - back).abs() <= 1e-9 * there, "{brdf:?}");
            }
        }
    }

    #[test]
    fn a_phong_value_is_the_directly_evaluated_one() {
        let f = EARTH_VEGETATION.value(&direction(40.0, 0.0), &UP, &direction(25.0, 170.0));
        assert!((f / 0.480_789_713_741_598_96 - 1.0).abs() < 1e-12, "{f}");
    }

    #[test]
    fn reflectances_are_the_independently_integrated_ones() {
        // three printed digits of an independent integration
        let earth = [(0.0, 0.810), (40.0, 0.745), (60.0, 0.673), (85.0, 0.583)];
        let lobe = [(0.0, 1.0), (40.0, 0.766), (60.0, 0.5), (85.0, 0.098)];
        let n100 = Brdf::Phong { kd: 0.0, ks: 1.0, n: 100.0 };
        for (brdf, rows) in [(EARTH_VEGETATION, earth), (n100, lobe)] {
            for (deg, expected) in rows {
                let got = brdf.hemispherical_reflectance(f64::to_radians(deg));
                assert!((got - expected).abs() < 6e-4, "{brdf:?} at {deg}: {got}");
            }
        }
    }

    #[test]
    fn no_admitted_phong_creates_light_and_at_normal_incidence_it_returns_kd_plus_ks() {
        for n in [0.0, 0.26, 1.0, 7.31, 100.0, 1e4, 1e6] {
            let brdf = Brdf::Phong { kd: 0.3, ks: 0.7, n };
            assert!((brdf.hemispherical_reflectance(0.0) - 1.0).abs() < 1e-6, "{n}");
            for deg in 0..90 {
                assert!(brdf.hemispherical_reflectance(f64::from(deg).to_radians()) <= 1.0 + 1e-6, "{n} {deg}");
            }
        }
    }

    #[test]
    fn a_phong_without_specular_share_is_lambert() {
        let (i, o) = (direction(10.0, 0.0), direction(70.0, 90.0));
        let phong = Brdf::Phong { kd: 0.4, ks: 0.0, n: 12.0 };
        assert_eq!(phong.value(&i, &UP, &o), Brdf::Lambert { albedo: 0.4 }.value(&i, &UP, &o));
    }

    #[test]
    fn behind_the_surface_nothing_is_seen_and_at_grazing_everything_stays_finite() {
        for brdf in LAWS {
            assert_eq!(brdf.value(&direction(91.0, 0.0), &UP, &direction(10.0, 0.0)), 0.0);
            assert_eq!(brdf.value(&direction(10.0, 0.0), &UP, &direction(91.0, 0.0)), 0.0);
            let grazing = direction(90.0 - 1e-9, 0.0);
            assert!(brdf.value(&grazing, &UP, &direction(90.0 - 1e-9, 180.0)).is_finite());
        }
    }

    #[test]
    fn a_million_as_exponent_keeps_its_peak() {
        let brdf = Brdf::Phong { kd: 0.0, ks: 1.0, n: 1e6 };
        let peak = brdf.off_mirror(-1e-16);
        assert!((peak / ((1e6 + 2.0) / (2.0 * PI)) - 1.0).abs() < 1e-12);
        // (1 − 1e-9)^1e6 = exp(−1e-3)
        assert!((brdf.off_mirror(1e-9) / peak - (-1e-3_f64).exp()).abs() < 1e-6);
        assert_eq!(brdf.off_mirror(1.0), 0.0);
    }

    #[test]
    fn coefficients_that_are_no_reflectance_are_refused() {
        for bad in [
            Brdf::Lambert { albedo: 1.1 },
            Brdf::Lambert { albedo: f64::NAN },
            Brdf::Phong { kd: 0.6, ks: 0.5, n: 1.0 },
            Brdf::Phong { kd: -0.1, ks: 0.5, n: 1.0 },
            Brdf::Phong { kd: 0.1, ks: 0.5, n: -1.0 },
            Brdf::Phong { kd: 0.1, ks: 0.5, n: 1e7 },
        ] {
            assert!(bad.check("plate").unwrap_err().to_string().contains("plate"));
        }
        for good in LAWS {
            good.check("plate").unwrap();
        }
    }
}
