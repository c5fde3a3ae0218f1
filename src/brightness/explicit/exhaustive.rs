//! The fluxes of a case with nothing excluded: hidden sources, dark ground and surfaces turned away are computed too.
//!
//! Units of [`Fluxes`]. For tests and for `--explain`, which times it; [`super::explicit`] is what is used.

use super::case::Case;
use super::case::Fluxes;
use super::case::RADIUS_KM;
use super::case::Scattering;
use super::case::Sight;
use crate::base::vector::Vector;
use crate::brightness::brdf::Brdf;
use crate::brightness::earthshine::plain;
use crate::brightness::ground::Ground;

/// [`super::explicit`] without deciding first what is needed: what gives no light is multiplied by 0 instead.
#[must_use]
pub fn exhaustive(case: &Case, tolerance: f64) -> Option<Fluxes> {
    let r_km = RADIUS_KM + case.height_km;
    let satellite_km = Vector::new(0.0, 0.0, r_km);
    let line = case.observer_km - satellite_km;
    let observer = line.unit()?;
    let share = |is_so: bool| f64::from(u8::from(is_so));
    let up = share(case.observer_km.z() >= RADIUS_KM * RADIUS_KM / r_km);
    let cos_o = case.normal.dot(&observer);
    let spread = up * case.area_m2 * cos_o.max(0.0) / (line.norm() * 1e3).powi(2);
    let (sin_e, cos_e) = case.elevation_rad.sin_cos();
    let sight = Sight { case, satellite_km, source: Vector::new(0.0, cos_e, sin_e), observer, spread };
    let mut answer = Fluxes::default();

    let cos_s = case.normal.dot(&sight.source);
    let dip_rad = 2.0 * (0.5 * case.height_km / r_km).sqrt().asin();
    let seen = share(case.elevation_rad >= -dip_rad) * spread;
    answer.direct = match &case.scattering {
        Scattering::Law(brdf) => seen * cos_s.max(0.0) * brdf.value(&sight.source, &case.normal, &observer),
        Scattering::Mirror { reflectance, disc_rad } => {
            let shown = cos_s > 0.0 && sight.mirrored().angle_to(&sight.source) <= *disc_rad;
            let disc_sr = 4.0 * std::f64::consts::PI * (0.5 * disc_rad).sin().powi(2);
            share(shown) * seen * reflectance / disc_sr
        }
    };
    let ground = Ground::new(&satellite_km, RADIUS_KM, &sight.source, &case.earth)?;
    if ground.lit_in_view() && ground.seen_by(&case.normal) {
        sight.by_the_ground(tolerance, &mut answer);
        answer.skipped.clear();
    } else {
        let mirror;
        let law = match &case.scattering {
            Scattering::Law(brdf) => brdf,
            Scattering::Mirror { reflectance, .. } => {
                mirror = Brdf::Mirror { reflectance: *reflectance };
                &mirror
            }
        };
        answer.earth = spread * plain(&ground, law, &case.normal, &observer);
    }
    Some(answer)
}
