//! Moonlight on the ground: every place sees the Moon in its own direction, at its own distance and at its own phase.
//!
//! Ratios to the irradiance at the Earth's centre. The Moon is 60 Earth radii away: its direction differs by up to
//! 0.95° between places, its irradiance by up to 3.5 %, its phase by as much as its direction. Not included: the Moon's
//! disc, half a degree across, and refraction; both matter where the Moon rises or sets alone.

use super::SourceSettings;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::polynomial::{TERMS, fit};
use crate::config::{Distances, GroundMoonlight, MoonLaw, MoonPastLimit};

use super::opposition::MOON_LAW_MAX_DEG;
use super::opposition::OPPOSITION_DEG;

/// Half of the shortest range of sin(α/2) that is interpolated over.
const LEAST_HALF_RANGE: f64 = 1e-4;
/// Error of the polynomials, relative to the brightest place, and some.
const PHASE_CURVE_MARGIN: f64 = 1.0 + 1e-5;
/// Phase angle from which the variable is cos(α/2) \[deg\].
const TURN_DEG: f64 = 90.0;

/// The Moon over the ground, for [`crate::brightness::Ground::under_moon`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearMoon {
    /// From the Earth's centre \[km\].
    pub(crate) position_km: Vector<Itrs>,
    /// From the Moon to the Sun, unit.
    pub(crate) to_sun: Vector<Itrs>,
    /// Irradiance falls with the square of the distance.
    pub(crate) by_distance: bool,
    pub(crate) phase: PhaseCurve,
}

/// The lunar law over the phases at which one moment's ground sees the Moon, relative to that at the Earth's centre.
///
/// Polynomials in sin(α/2), beyond 90° of phase in cos(α/2): smooth in either, and had from the phase's cosine by one
/// root. Two of them where the law has a kink in the range. Error below 1e-7 of the brightest place, in the taper
/// beyond the end of the lunar law (150°), where there is next to no light, below 1e-6.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PhaseCurve {
    /// 1: sin(α/2); −1: cos(α/2).
    sign: f64,
    /// Where the second polynomial begins.
    kink: f64,
    polynomials: [Polynomial; 2],
    /// The law is not smooth over the range: it has a kink there, or the tip of the cone at full Moon.
    pub sharp: bool,
}

/// A polynomial about the middle of its range.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Polynomial {
    middle: f64,
    per_half_range: f64,
    c: [f64; TERMS],
}

impl SourceSettings {
    /// The Moon over a ground of this radius \[km\], patch by patch; `None` where moonlight is to be parallel, or
    /// without any at the Earth's centre.
    #[must_use]
    pub fn moon_over_ground(&self, moon_km: &Vector<Itrs>, sun_km: &Vector<Itrs>, radius_km: f64) -> Option<NearMoon> {
        if self.ground_moonlight == GroundMoonlight::Parallel {
            return None;
        }
        let to_sun = (*sun_km - *moon_km).unit()?;
        let phase_deg = to_sun.angle_to(&-*moon_km).to_degrees();
        // no place on the ground is seen farther from the Earth's centre, from the Moon
        let reach_deg = (radius_km / moon_km.norm()).min(1.0).asin().to_degrees();
        Some(NearMoon {
            position_km: *moon_km,
            to_sun,
            by_distance: self.distances == Distances::Applied,
            phase: PhaseCurve::new(self, phase_deg, reach_deg)?,
        })
    }

    /// Upper bound of the irradiance of any place on the ground over that at the Earth's centre: the place nearest to the Moon, at
    /// the fullest phase that the ground sees. Every lunar law fades with phase.
    #[must_use]
    pub fn moonlight_on_ground_at_most(&self, moon_km: &Vector<Itrs>, sun_km: &Vector<Itrs>, radius_km: f64) -> f64 {
        if self.ground_moonlight == GroundMoonlight::Parallel {
            return 1.0;
        }
        let ratio = radius_km / moon_km.norm();
        let phase_deg = (*sun_km - *moon_km).angle_to(&-*moon_km).to_degrees();
        let fullest_deg = (phase_deg - ratio.min(1.0).asin().to_degrees()).max(0.0);
        let by_phase = self.moonlight_at_phase(fullest_deg).flux / self.moonlight_at_phase(phase_deg).flux;
        // what the radiance is multiplied by besides: δ⁻³, or δ⁻¹ where distances are ignored
        let per_delta = 1.0 / (1.0 - ratio);
        let by_distance = if self.distances == Distances::Applied { per_delta.powi(3) } else { per_delta };
        let bound = PHASE_CURVE_MARGIN * by_phase * by_distance;
        if bound.is_finite() && ratio < 1.0 { bound } else { f64::INFINITY }
    }
}

impl PhaseCurve {
    /// The law of `light_sources` from `phase_deg − reach_deg` to `phase_deg + reach_deg`; `None` where it gives no light in
    /// the middle.
    fn new(light_sources: &SourceSettings, phase_deg: f64, reach_deg: f64) -> Option<Self> {
        let centre = light_sources.moonlight_at_phase(phase_deg).flux;
        if !(centre > 0.0) {
            return None;
        }
        let past_half = phase_deg > TURN_DEG;
        let of_deg = |deg: f64| {
            let (sin, cos) = (0.5 * deg.clamp(0.0, 180.0)).to_radians().sin_cos();
            if past_half { cos } else { sin }
        };
        let law = |x: f64| {
            let half_rad = if past_half { x.min(1.0).acos() } else { x.min(1.0).asin() };
            light_sources.moonlight_at_phase(2.0 * half_rad.to_degrees()).flux / centre
        };
        let ends = [of_deg(phase_deg - reach_deg), of_deg(phase_deg + reach_deg)];
        let (from, to) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let kinks_deg = [
            (light_sources.moon_law == MoonLaw::CoxOpposition).then_some(OPPOSITION_DEG),
            (light_sources.moon_past_limit == MoonPastLimit::Tapered).then_some(MOON_LAW_MAX_DEG),
        ];
        let kink = kinks_deg.into_iter().flatten().map(of_deg).find(|x| *x > from && *x < to);
        let polynomial = |from: f64, to: f64| {
            let (middle, half) = (0.5 * (from + to), (0.5 * (to - from)).max(LEAST_HALF_RANGE));
            Polynomial { middle, per_half_range: 1.0 / half, c: fit(&law, middle - half, middle + half) }
        };
        let polynomials = match kink {
            Some(kink) => [polynomial(from, kink), polynomial(kink, to)],
            None => [polynomial(from, to); 2],
        };
        Some(Self {
            sign: if past_half { -1.0 } else { 1.0 },
            kink: kink.unwrap_or(f64::INFINITY),
            polynomials,
            sharp: kink.is_some() || phase_deg < reach_deg,
        })
    }

    /// One polynomial is all: [`PhaseCurve::at`] may leave the choice out.
    pub fn is_whole(&self) -> bool {
        self.kink == f64::INFINITY
    }

    /// Irradiance at a place that sees the Moon at this phase (its cosine), over that at the Earth's centre; `WHOLE`
    /// for a curve of one polynomial.
    #[inline(always)]
    pub fn at<const WHOLE: bool>(&self, cos_phase: f64) -> f64 {
        let x = (0.5 * (1.0 - self.sign * cos_phase)).max(0.0).sqrt();
        let p = if WHOLE || x < self.kink { &self.polynomials[0] } else { &self.polynomials[1] };
        let y = (x - p.middle) * p.per_half_range;
        let y2 = y * y;
        let [c0, c1, c2, c3, c4, c5] = p.c;
        (c0 + c1 * y) + y2 * ((c2 + c3 * y) + y2 * (c4 + c5 * y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brightness::spectrum::Band;
    use crate::config::{Effects, Mode};

    #[test]
    fn the_curve_is_the_law_at_every_phase_the_ground_sees() {
        for (law, past) in [
            (MoonLaw::Cox, MoonPastLimit::Tapered),
            (MoonLaw::Cox, MoonPastLimit::Polynomial),
            (MoonLaw::CoxOpposition, MoonPastLimit::Tapered),
            (MoonLaw::Rolo, MoonPastLimit::Tapered),
        ] {
            let effects = Effects { moon_law: law, moon_past_limit: past, ..Effects::of(Mode::Corrected) };
            let light_sources = SourceSettings::new(&effects, &Band::named("V").unwrap()).unwrap();
            let reach_deg = 0.96;
            for step in 0..1800 {
                let phase_deg = 0.1 * f64::from(step);
                let curve = PhaseCurve::new(&light_sources, phase_deg, reach_deg).unwrap();
                let flux = |deg: f64| light_sources.moonlight_at_phase(deg).flux;
                let most = flux((phase_deg - reach_deg).max(0.0)) / flux(phase_deg);
                for part in -8..=8 {
                    let deg = (phase_deg + reach_deg * f64::from(part) / 8.0).clamp(0.0, 180.0);
                    let (got, expected) = (curve.at::<false>(deg.to_radians().cos()), flux(deg) / flux(phase_deg));
                    let bound = if phase_deg > MOON_LAW_MAX_DEG - reach_deg { 1e-6 } else { 1e-7 };
                    assert!(
                        (got - expected).abs() < bound * most,
                        "{law:?} {past:?} {phase_deg} {deg}: {got} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn kinks_of_the_law_and_the_tip_at_full_moon_are_reported() {
        let curve = |law: MoonLaw, phase_deg: f64| {
            let effects = Effects { moon_law: law, ..Effects::of(Mode::Corrected) };
            let light_sources = SourceSettings::new(&effects, &Band::named("V").unwrap()).unwrap();
            PhaseCurve::new(&light_sources, phase_deg, 0.95).unwrap().sharp
        };
        assert!(curve(MoonLaw::Cox, 0.5) && curve(MoonLaw::Cox, 149.3) && curve(MoonLaw::CoxOpposition, 7.4));
        assert!(!curve(MoonLaw::Cox, 1.0) && !curve(MoonLaw::Cox, 7.4) && !curve(MoonLaw::Cox, 90.0));
    }
}
