//! Rays against triangles: the nearest one, or whether any is in the way.
//!
//! Metres. A bounding-volume hierarchy in 32 bits finds the candidates, its boxes a little too large; the triangles
//! themselves are met in 64 bits. Not included: rays that start inside a triangle's own plane, which callers lift off
//! it.

use std::time::Duration;

use glam::{Vec3A, vec3a};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::{Ray, RayHit};
use obvhs::{Boundable, BvhBuildParams};

use super::triangle::Triangle;
use crate::base::vector::Vector;

/// How much larger the boxes are, relative to the body: far above the rounding of 32 bits.
const MARGIN: f64 = 1e-6;

/// A triangle ready to be met.
#[derive(Debug, Clone, Copy)]
struct Flat {
    corner: [f64; 3],
    edges: [[f64; 3]; 2],
    /// Place in the list the rays were made from.
    index: u32,
}

/// The box of a triangle.
struct Boxed(Aabb);

impl Boundable for Boxed {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// Triangles that rays can meet.
pub struct Rays {
    tree: Bvh2,
    flats: Vec<Flat>,
}

impl std::fmt::Debug for Rays {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rays").field("triangles", &self.flats.len()).finish_non_exhaustive()
    }
}

impl Rays {
    /// Sorts the triangles of a body of this radius \[m\] about the origin.
    #[must_use]
    pub fn new<F>(triangles: &[Triangle<F>], radius_m: f64) -> Self {
        let margin = (MARGIN * radius_m).max(1e-9);
        let boxes: Vec<Boxed> = triangles
            .iter()
            .map(|t| {
                let edge =
                    |k: usize, of: fn(f64, f64) -> f64| t.iter().map(|v| v.to_array()[k]).fold(t[0].to_array()[k], of);
                let low = [0, 1, 2].map(|k| (edge(k, f64::min) - margin) as f32);
                let high = [0, 1, 2].map(|k| (edge(k, f64::max) + margin) as f32);
                Boxed(Aabb::new(Vec3A::from_array(low), Vec3A::from_array(high)))
            })
            .collect();
        let mut took = Duration::ZERO;
        let tree = build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut took);
        let flat = |index: u32| {
            let [a, b, c] = &triangles[index as usize];
            Flat { corner: a.to_array(), edges: [(*b - *a).to_array(), (*c - *a).to_array()], index }
        };
        let flats = tree.primitive_indices.iter().map(|i| flat(*i)).collect();
        Self { tree, flats }
    }

    /// The nearest triangle along a ray: its place in the list and the distance in lengths of `direction`.
    #[must_use]
    pub fn nearest<F>(&self, from: &Vector<F>, direction: &Vector<F>) -> Option<(usize, f64)> {
        let (o, d) = (from.to_array(), direction.to_array());
        let mut best: Option<(usize, f64)> = None;
        self.tree.ray_traverse(ray(o, d), &mut RayHit::none(), |_, k| {
            let flat = &self.flats[k];
            match meet(flat, o, d) {
                Some(t) => {
                    if best.is_none_or(|(_, nearest)| t < nearest) {
                        best = Some((flat.index as usize, t));
                    }
                    (t * (1.0 + 1e-6)) as f32
                }
                None => f32::INFINITY,
            }
        });
        best
    }

    /// Something is in the way.
    #[must_use]
    pub fn blocked<F>(&self, from: &Vector<F>, direction: &Vector<F>) -> bool {
        let (o, d) = (from.to_array(), direction.to_array());
        !self
            .tree
            .ray_traverse_miss(ray(o, d), |_, k| if meet(&self.flats[k], o, d).is_some() { 0.0 } else { f32::INFINITY })
    }
}

fn ray(o: [f64; 3], d: [f64; 3]) -> Ray {
    let single = |v: [f64; 3]| vec3a(v[0] as f32, v[1] as f32, v[2] as f32);
    Ray::new(single(o), single(d), 0.0, f32::MAX)
}

/// Where a ray meets a triangle, in lengths of its direction (Möller & Trumbore 1997); `None` behind the start.
#[inline]
fn meet(flat: &Flat, o: [f64; 3], d: [f64; 3]) -> Option<f64> {
    let [e1, e2] = flat.edges;
    let p = cross(d, e2);
    let det = dot(e1, p);
    if det == 0.0 {
        return None;
    }
    let inverse = 1.0 / det;
    let s = [o[0] - flat.corner[0], o[1] - flat.corner[1], o[2] - flat.corner[2]];
    let u = dot(s, p) * inverse;
    if !(0.0..=1.0).contains(&u) {
        return None;
    }
    let q = cross(s, e1);
    let v = dot(d, q) * inverse;
    if v < 0.0 || u + v > 1.0 {
        return None;
    }
    let t = dot(e2, q) * inverse;
    (t > 0.0).then_some(t)
}

#[inline]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha12Rng;

    use super::*;
    use crate::base::vector::Enu;

    #[test]
    fn the_tree_finds_what_asking_every_triangle_finds() {
        let mut rng = ChaCha12Rng::seed_from_u64(3);
        let mut place = |size: f64| {
            let mut one = || rng.random_range(-size..size);
            Vector::<Enu>::new(one(), one(), one())
        };
        let triangles: Vec<Triangle<Enu>> = (0..400)
            .map(|_| {
                let at = place(50.0);
                [at, at + place(4.0), at + place(4.0)]
            })
            .collect();
        let rays = Rays::new(&triangles, 60.0);
        let mut met = 0;
        for _ in 0..3000 {
            let (from, direction) = (place(60.0), place(1.0));
            let plain = triangles
                .iter()
                .enumerate()
                .filter_map(|(k, [a, b, c])| {
                    let flat = Flat {
                        corner: a.to_array(),
                        edges: [(*b - *a).to_array(), (*c - *a).to_array()],
                        index: k as u32,
                    };
                    meet(&flat, from.to_array(), direction.to_array()).map(|t| (k, t))
                })
                .min_by(|a, b| a.1.total_cmp(&b.1));
            assert_eq!(rays.nearest(&from, &direction), plain);
            assert_eq!(rays.blocked(&from, &direction), plain.is_some());
            met += usize::from(plain.is_some());
        }
        assert!(met > 100, "too few rays met anything to tell: {met}");
    }

    #[test]
    fn a_flat_plate_along_the_axes_is_met_and_its_plane_next_to_it_is_not() {
        let corner = |x: f64, y: f64| Vector::<Enu>::new(x, y, 7.0);
        let plate = [[corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0)]];
        let rays = Rays::new(&plate, 10.0);
        let up = Vector::<Enu>::new(0.0, 0.0, 1.0);
        assert_eq!(rays.nearest(&Vector::new(0.5, 0.0, 0.0), &up), Some((0, 7.0)));
        assert!(!rays.blocked(&Vector::new(-0.5, 0.0, 0.0), &up));
        assert!(!rays.blocked(&Vector::new(0.5, 0.0, 8.0), &up), "behind the start");
    }
}
