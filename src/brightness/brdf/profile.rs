//! A scattering law as rows: f in the plane of incidence, and the reflectance against incidence.
//!
//! Degrees and 1/sr. Fine near the mirror direction, where laboratory laws have their peak.

use super::law::Brdf;
use crate::base::vector::{Enu, Vector};

/// f at one outgoing angle in the plane of incidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfileRow {
    /// Angle of incidence \[deg\].
    pub incidence_deg: f64,
    /// Outgoing angle from the normal \[deg\]; above 0 on the side of the mirror direction, below 0 on that of the
    /// light source.
    pub outgoing_deg: f64,
    /// f \[1/sr\].
    pub f_per_sr: f64,
}

/// Share of the light that leaves again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReflectanceRow {
    /// Angle of incidence \[deg\].
    pub incidence_deg: f64,
    /// Directional-hemispherical reflectance.
    pub reflectance: f64,
}

/// Largest outgoing angle of a profile \[deg\].
const OUTGOING_MAX_DEG: f64 = 89.5;

impl Brdf {
    /// f against outgoing angle in the plane of incidence, for each incidence \[deg\]; a mirror has none.
    #[doc(hidden)]
    #[must_use]
    pub fn profile(&self, incidences_deg: &[f64]) -> Vec<ProfileRow> {
        if matches!(self, Brdf::Mirror { .. }) {
            return Vec::new();
        }
        let normal = Vector::<Enu>::new(0.0, 0.0, 1.0);
        let at = |deg: f64| Vector::new(deg.to_radians().sin(), 0.0, deg.to_radians().cos());
        let mut rows = Vec::new();
        for incidence_deg in incidences_deg {
            let mut angles: Vec<f64> = (-89..=89).map(f64::from).chain([-OUTGOING_MAX_DEG, OUTGOING_MAX_DEG]).collect();
            angles.push(*incidence_deg);
            for step in 0..50 {
                // 0.001 deg to 30 deg on either side of the mirror direction
                let off_deg = 1e-3 * 30_000_f64.powf(f64::from(step) / 49.0);
                angles.extend([incidence_deg - off_deg, incidence_deg + off_deg]);
            }
            angles.retain(|deg| deg.abs() <= OUTGOING_MAX_DEG);
            angles.sort_by(f64::total_cmp);
            angles.dedup();
            rows.extend(angles.into_iter().map(|outgoing_deg| ProfileRow {
                incidence_deg: *incidence_deg,
                outgoing_deg,
                f_per_sr: self.value(&at(-incidence_deg), &normal, &at(outgoing_deg)),
            }));
        }
        rows
    }

    /// Reflectance at incidences of 0 to 90 deg, a degree apart.
    #[doc(hidden)]
    #[must_use]
    pub fn reflectances(&self) -> Vec<ReflectanceRow> {
        let row = |deg: u32| {
            let incidence_deg = f64::from(deg);
            ReflectanceRow { incidence_deg, reflectance: self.hemispherical_reflectance(incidence_deg.to_radians()) }
        };
        (0..=90).map(row).collect()
    }
}
