//! Stars by their places on the sphere, for the nearest one.

use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Directions of the entries with their indices.
#[derive(Debug, Clone)]
pub struct Tree(pub(super) RTree<GeomWithData<[f64; 3], usize>>);

/// Unit vector of a place.
#[must_use]
pub fn direction(ra_deg: f64, dec_deg: f64) -> [f64; 3] {
    let ((sin_a, cos_a), (sin_d, cos_d)) = (ra_deg.to_radians().sin_cos(), dec_deg.to_radians().sin_cos());
    [cos_d * cos_a, cos_d * sin_a, sin_d]
}
