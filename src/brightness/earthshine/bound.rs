//! Upper bounds of the integral from a few cosines: whether a light of a sum may be skipped before it is computed.
//!
//! In 1/sr per unit irradiance on the ground. With `L ≤ f_E,max (p·s)_max` in view,
//! `∫ L f (n·w)₊ dω ≤ L_max min(ρ_max, f_max ∫ (n·w)₊ dω)`, ρ the directional-hemispherical reflectance. Usually five to ten
//! times the integral. Not included: how little of the view is lit, how far the lobe is from it.

use std::f64::consts::PI;

use crate::base::vector::{Itrs, Vector};
use crate::brightness::brdf::Brdf;
use crate::brightness::ground::{Ground, GroundLaw};

/// The reflectance is a maximum over a grid and golden sections.
const REFLECTANCE_MARGIN: f64 = 1.01;

/// What a scattering law gives at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LawBound {
    /// Share of the light that leaves again, over all directions.
    reflectance: f64,
    /// f \[1/sr\]; infinite where it is not known.
    per_sr: f64,
}

impl LawBound {
    /// Milliseconds for laws whose reflectance is an integral.
    pub fn of(brdf: &Brdf) -> Self {
        Self { reflectance: REFLECTANCE_MARGIN * brdf.max_reflectance(), per_sr: brdf.max_value() }
    }
}

impl Ground {
    /// Upper bound of the light of the lit ground in view that a surface of this normal and law reflects in any direction, per unit
    /// of the largest irradiance on the ground \[1/sr\].
    pub(crate) fn reflected_at_most(&self, normal: &Vector<Itrs>, law: &LawBound) -> f64 {
        let f_ground = match &self.law {
            GroundLaw::Phong { diffuse, peak, .. } => diffuse + peak,
            GroundLaw::Other(brdf) => brdf.max_value(),
        };
        f_ground * self.largest_height() * law.reflectance.min(law.per_sr * self.form_factor_at_most(normal))
    }

    /// Sine of the largest altitude at which ground in view sees the light source.
    fn largest_height(&self) -> f64 {
        let (cos_e, sin_e) = (self.light_source.y(), self.light_source.z());
        let sin_dip = ((1.0 - self.k) * (1.0 + self.k)).sqrt();
        // the view reaches arccos k from the sub-satellite point
        if cos_e * self.k - sin_e * sin_dip <= 0.0 { 1.0 } else { (sin_e * self.k + cos_e * sin_dip).max(0.0) }
    }

    /// Upper bound of `∫ (n·w)₊ dω` over the Earth's disc: πk² of a surface that faces the nadir, or the disc's solid angle times the
    /// largest cosine in it \[sr\].
    fn form_factor_at_most(&self, normal: &Vector<Itrs>) -> f64 {
        let (sin_limb, cos_limb) = (self.k, ((1.0 - self.k) * (1.0 + self.k)).sqrt());
        let cos_nadir = -self.local(normal).z();
        let largest_cos = if cos_nadir >= cos_limb {
            1.0
        } else {
            // cos(β − η)
            cos_nadir * cos_limb + (1.0 - cos_nadir * cos_nadir).max(0.0).sqrt() * sin_limb
        };
        // 1 − cos η = sin² η/(1 + cos η)
        let disc_sr = 2.0 * PI * sin_limb * sin_limb / (1.0 + cos_limb);
        (PI * self.k * self.k).min(disc_sr * largest_cos.max(0.0))
    }
}

impl Brdf {
    /// The largest f \[1/sr\]; infinite for a mirror and where it is not known.
    pub(crate) fn max_value(&self) -> f64 {
        match self {
            Brdf::Lambert { albedo } => albedo / PI,
            Brdf::Phong { kd, ks, n } => kd / PI + ks * (n + 2.0) / (2.0 * PI),
            Brdf::Gaussian { peak_per_sr, .. } => *peak_per_sr,
            Brdf::Abg { a, b, .. } => a / b,
            Brdf::Binomial(_) | Brdf::Mirror { .. } => f64::INFINITY,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brightness::brdf::EARTH_VEGETATION;
    use crate::brightness::earthshine::{Accuracy, PreparedBrdf};
    use crate::brightness::light_sources::SourceSettings;
    use crate::brightness::spectrum::Band;
    use crate::config::{Effects, Mode};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn direction(rng: &mut ChaCha8Rng) -> Vector<Itrs> {
        let (z, turn): (f64, f64) = (rng.random_range(-1.0..1.0), rng.random_range(0.0..2.0 * PI));
        let level = (1.0 - z * z).sqrt();
        Vector::new(level * turn.cos(), level * turn.sin(), z)
    }

    #[test]
    fn no_integral_is_above_its_bound_and_many_are_within_a_factor_of_twenty() {
        let mut rng = ChaCha8Rng::seed_from_u64(2_028);
        let laws = [
            Brdf::Lambert { albedo: 0.6 },
            Brdf::Phong { kd: 0.1, ks: 0.8, n: 200.0 },
            Brdf::Gaussian { peak_per_sr: 10.0, sigma: 1e-3 },
            Brdf::Abg { a: 0.003_362, b: 4.309e-6, g: 2.068 },
            Brdf::named("starlink-array-lab").unwrap(),
            Brdf::Mirror { reflectance: 0.9 },
        ];
        let bounds = laws.each_ref().map(LawBound::of);
        let sources = SourceSettings::new(&Effects::of(Mode::Corrected), &Band::named("V").unwrap()).unwrap();
        let (mut lit, mut close) = (0, 0);
        for k in 0..1500 {
            let r_km = 6378.0 + 10.0_f64.powf(rng.random_range(2.2..5.6));
            let satellite_km = direction(&mut rng) * r_km;
            let earth =
                [EARTH_VEGETATION, Brdf::Lambert { albedo: 0.3 }, Brdf::Gaussian { peak_per_sr: 1.0, sigma: 0.1 }];
            let moon_km = direction(&mut rng) * rng.random_range(357_000.0..406_000.0);
            if (moon_km - satellite_km).norm() < 2e4 {
                continue;
            }
            let sun_km = direction(&mut rng) * 1.496e8;
            let near = sources.moon_over_ground(&moon_km, &sun_km, 6378.0).filter(|_| k % 2 == 0);
            let (ground, irradiance) = match &near {
                Some(moon) => (
                    Ground::under_moon(&satellite_km, 6378.0, moon, &earth[k % 3]).unwrap(),
                    sources.moonlight_on_ground_at_most(&moon_km, &sun_km, 6378.0),
                ),
                None => (Ground::new(&satellite_km, 6378.0, &moon_km, &earth[k % 3]).unwrap(), 1.0),
            };
            let (normal, observer) = (direction(&mut rng), direction(&mut rng));
            let which = rng.random_range(0..laws.len());
            let accuracy = Accuracy::relative(1e-3, 20_000);
            let light = PreparedBrdf::bare(&laws[which]).reflected(&ground, &normal, &observer, &accuracy);
            let at_most = irradiance * ground.reflected_at_most(&normal, &bounds[which]);
            assert!(light.per_sr <= at_most * (1.0 + 2e-3), "{light:?} {at_most} {:?} {satellite_km:?}", laws[which]);
            lit += usize::from(light.per_sr > 0.0);
            close += usize::from(light.per_sr > 0.05 * at_most);
        }
        assert!(lit > 300 && close * 10 > lit, "{close} of {lit}");
    }
}
