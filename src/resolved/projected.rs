//! Areas of components next to those of the catalogue, and what a satellite shows from a direction.
//!
//! m². Broadside areas are those of the triangles, so that they are the areas that are drawn. Silhouettes count what is
//! hidden once; a sum over components counts it twice.

use super::body::PosedBody;
use super::satellite::ComponentSatellite;
use super::triangle::Body;
use super::triangle::projected_m2;
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::Catalogue;

/// A part of the catalogue, or of the components alone, and its areas.
#[derive(Debug, Clone, PartialEq)]
pub struct AreaRow {
    /// Name of the part.
    pub part: String,
    /// Components it is made of.
    pub components: usize,
    /// Seen from the broad side of each \[m²\].
    pub broadside_m2: f64,
    /// Seen from nadir, joints at angle 0 \[m²\]; what hides what is excluded.
    pub from_nadir_m2: f64,
    /// Area of the catalogue \[m²\]; `None` for a part it does not list.
    pub catalogue_m2: Option<f64>,
}

/// The areas of a satellite's components by part of the catalogue.
///
/// # Errors
/// Those of the shapes and the catalogue.
pub fn areas(satellite: &ComponentSatellite, sides: usize) -> Result<Vec<AreaRow>> {
    let entry = match &satellite.catalogue {
        Some(name) => Some(Catalogue::load(None)?.find(name)?.clone()),
        None => None,
    };
    let known = |part: &str| {
        let entry = entry.as_ref()?;
        let listed = entry.components.iter().find(|c| c.name == part).and_then(|c| c.total_m2());
        listed.or_else(|| entry.surfaces.iter().find(|s| s.name == part).map(|s| s.area_m2))
    };
    let mut rows: Vec<AreaRow> = Vec::new();
    for component in &satellite.components {
        let triangles = satellite.triangles(component, sides)?;
        let sheet = component.shape.is_sheet();
        let seen = |[x, y, z]: [f64; 3]| projected_m2(&triangles, &Vector::<Body>::new(x, y, z), sheet);
        let (broadside, nadir) = (seen(component.shape.broadside()), seen([0.0, 0.0, 1.0]));
        let part = component.counts_as.clone().unwrap_or_else(|| component.name.clone());
        match rows.iter_mut().find(|r| r.part == part) {
            Some(row) => {
                row.components += 1;
                row.broadside_m2 += broadside;
                row.from_nadir_m2 += nadir;
            }
            None => {
                let catalogue_m2 = component.counts_as.as_deref().and_then(known);
                rows.push(AreaRow { part, components: 1, broadside_m2: broadside, from_nadir_m2: nadir, catalogue_m2 });
            }
        }
    }
    Ok(rows)
}

/// Area of the silhouette in a direction \[m²\]: the share of a grid of `n` × `n` parallel rays that meet the body.
#[must_use]
pub fn silhouette_m2(body: &PosedBody, direction: &Vector<Itrs>, n: usize) -> f64 {
    let (Some(d), Some(u)) = (direction.unit(), direction.any_perpendicular()) else { return 0.0 };
    let v = d.cross(&u);
    let step = 2.0 * body.radius_m / n as f64;
    let at = |k: usize| (k as f64 + 0.5) * step - body.radius_m;
    let met = |k: usize| {
        let place = u * at(k % n) + v * at(k / n);
        body.seen_along(&place, &-d).is_some()
    };
    (0..n * n).filter(|k| met(*k)).count() as f64 * step * step
}
