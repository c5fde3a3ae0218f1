//! Shapes of components and the triangles they are made of.
//!
//! Metres in the body frame. A round shape is a prism of as many sides as is requested with the perimeter of the
//! circle, so that its side has the right area and, averaged over the turn, the right silhouette; its ends are too
//! small by (π/N)²/3. Not included: thickness of plates and dishes.

use super::triangle::Body;
use super::triangle::Triangle;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::mesh::read_mesh;
use super::surface::volume_m3;
use crate::base::error::{Error, Result};
use crate::base::vector::Vector;

/// Sides of a round shape by default.
pub const SIDES: usize = 32;

/// The shape of a component.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A box, closed.
    Box {
        /// Edges along x, y and z \[m\].
        size_m: [f64; 3],
    },
    /// A cylinder, closed at both ends; with a second diameter a truncated cone.
    Cylinder {
        /// Along the axis \[m\].
        length_m: f64,
        /// At the end the axis points away from \[m\].
        diameter_m: f64,
        /// At the end the axis points to \[m\]; absent = the same.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        end_diameter_m: Option<f64>,
        /// The axis, of any length.
        axis: [f64; 3],
    },
    /// A flat rectangle with two sides.
    Plate {
        /// Along `along` and across \[m\].
        size_m: [f64; 2],
        /// Where the front points.
        normal: [f64; 3],
        /// The first edge; its part along the normal does not count.
        along: [f64; 3],
    },
    /// A paraboloid open to where its axis points, its front the hollow side.
    Dish {
        /// Of the edge \[m\].
        diameter_m: f64,
        /// From edge to vertex \[m\].
        depth_m: f64,
        /// Out of the hollow side.
        axis: [f64; 3],
    },
    /// Triangles of a file, OBJ or STL, fronts outwards.
    Mesh {
        /// The file, relative to the satellite's own.
        file: PathBuf,
        /// Metres in a unit of the file.
        scale_m: f64,
        /// Backs are seen too: an open surface. Without it backs are black, and a closed mesh wound inwards is refused.
        #[serde(default)]
        sheet: bool,
    },
}

impl Shape {
    /// Both sides of its triangles can be seen.
    #[must_use]
    pub fn is_sheet(&self) -> bool {
        matches!(self, Shape::Plate { .. } | Shape::Dish { .. } | Shape::Mesh { sheet: true, .. })
    }

    /// A direction from which the shape shows what the catalogue calls its area: the side of a cylinder, the face of a
    /// plate, the largest face of a box.
    #[must_use]
    pub fn broadside(&self) -> [f64; 3] {
        match *self {
            Shape::Box { size_m: [x, y, z] } => {
                if x * y >= x * z && x * y >= y * z {
                    [0.0, 0.0, 1.0]
                } else if x * z >= y * z {
                    [0.0, 1.0, 0.0]
                } else {
                    [1.0, 0.0, 0.0]
                }
            }
            Shape::Cylinder { axis, .. } => {
                let along = Vector::<Body>::new(axis[0], axis[1], axis[2]);
                along.any_perpendicular().map_or([0.0, 0.0, 1.0], |v| v.to_array())
            }
            Shape::Plate { normal, .. } => normal,
            Shape::Dish { axis, .. } => axis,
            Shape::Mesh { .. } => [0.0, 0.0, 1.0],
        }
    }

    /// The triangles about the shape's own centre; `folder` is where a mesh is looked for.
    ///
    /// # Errors
    /// [`Error::Model`] for lengths that are not above 0, vectors without a direction, and a closed mesh whose fronts
    /// look inwards; those of reading a mesh.
    pub fn triangles(&self, sides: usize, folder: &Path, what: &str) -> Result<Vec<Triangle<Body>>> {
        let unit = |name: &str, v: [f64; 3]| {
            let found = Vector::<Body>::new(v[0], v[1], v[2]).unit();
            found.ok_or_else(|| wrong(what, format!("{name} = {v:?} has no direction")))
        };
        let above_0 = |name: &str, value: f64| {
            if value > 0.0 && value < 1e6 {
                Ok(value)
            } else {
                Err(wrong(what, format!("{name} = {value}; accepted is above 0, below 1e6 m")))
            }
        };
        match self {
            Shape::Box { size_m } => {
                let [x, y, z] = *size_m;
                Ok(cuboid([above_0("size_m", x)?, above_0("size_m", y)?, above_0("size_m", z)?]))
            }
            Shape::Cylinder { length_m, diameter_m, end_diameter_m, axis } => {
                let end = end_diameter_m.map_or(Ok(*diameter_m), |d| above_0("end_diameter_m", d))?;
                let radii = (0.5 * above_0("diameter_m", *diameter_m)?, 0.5 * end);
                Ok(cylinder(above_0("length_m", *length_m)?, radii, &unit("axis", *axis)?, sides))
            }
            Shape::Plate { size_m, normal, along } => {
                let n = unit("normal", *normal)?;
                let a = unit("along", *along)?;
                let u = (a - n * n.dot(&a)).unit();
                let u = u.ok_or_else(|| wrong(what, format!("along = {along:?} is the normal's direction")))?;
                let (u, v) =
                    (u * (0.5 * above_0("size_m", size_m[0])?), n.cross(&u) * (0.5 * above_0("size_m", size_m[1])?));
                Ok(quad([-u - v, u - v, u + v, v - u]).to_vec())
            }
            Shape::Dish { diameter_m, depth_m, axis } => Ok(dish(
                0.5 * above_0("diameter_m", *diameter_m)?,
                above_0("depth_m", *depth_m)?,
                &unit("axis", *axis)?,
                sides,
            )),
            Shape::Mesh { file, scale_m, sheet } => {
                let triangles = read_mesh(&folder.join(file), above_0("scale_m", *scale_m)?)?;
                match volume_m3(&triangles) {
                    Some(volume) if volume < 0.0 && !sheet => Err(wrong(
                        what,
                        format!(
                            "the closed mesh {} is wound inwards (volume {volume:.3e} m3): turn its faces around, or \
                             give sheet = true to show the backs too",
                            file.display()
                        ),
                    )),
                    _ => Ok(triangles),
                }
            }
        }
    }
}

/// Two triangles of four corners in order.
fn quad<F>([a, b, c, d]: [Vector<F>; 4]) -> [Triangle<F>; 2] {
    [[a, b, c], [a, c, d]]
}

fn cuboid([x, y, z]: [f64; 3]) -> Vec<Triangle<Body>> {
    let axes = [Vector::new(0.5 * x, 0.0, 0.0), Vector::new(0.0, 0.5 * y, 0.0), Vector::new(0.0, 0.0, 0.5 * z)];
    let mut triangles = Vec::with_capacity(12);
    for k in 0..3 {
        let (u, v, w) = (axes[(k + 1) % 3], axes[(k + 2) % 3], axes[k]);
        triangles.extend(quad([w - u - v, w + u - v, w + u + v, w - u + v]));
        triangles.extend(quad([-w - u - v, -w - u + v, -w + u + v, -w + u - v]));
    }
    triangles
}

/// Radius of the corners of a prism with the perimeter of a circle: `r' = π r / (N sin(π/N))`.
fn corner_radius(radius: f64, sides: usize) -> f64 {
    let step = PI / sides as f64;
    radius * step / step.sin()
}

fn cylinder(length: f64, radii: (f64, f64), axis: &Vector<Body>, sides: usize) -> Vec<Triangle<Body>> {
    let u = axis.any_perpendicular().unwrap_or(*axis);
    let v = axis.cross(&u);
    let around = |k: usize| {
        let (sin, cos) = (2.0 * PI * (k % sides) as f64 / sides as f64).sin_cos();
        u * cos + v * sin
    };
    let (low, high) = (*axis * (-0.5 * length), *axis * (0.5 * length));
    let (r0, r1) = (corner_radius(radii.0, sides), corner_radius(radii.1, sides));
    let mut triangles = Vec::with_capacity(4 * sides);
    for k in 0..sides {
        let (a, b) = (around(k), around(k + 1));
        triangles.extend(quad([low + a * r0, low + b * r0, high + b * r1, high + a * r1]));
        triangles.push([low, low + b * r0, low + a * r0]);
        triangles.push([high, high + a * r1, high + b * r1]);
    }
    triangles
}

/// Rings of equal steps in radius on `z = depth ((ρ/R)² − ½)`, so that the origin is half way down.
fn dish(radius: f64, depth: f64, axis: &Vector<Body>, sides: usize) -> Vec<Triangle<Body>> {
    let rings = (sides / 4).max(2);
    let u = axis.any_perpendicular().unwrap_or(*axis);
    let v = axis.cross(&u);
    let at = |ring: usize, k: usize| {
        let share = ring as f64 / rings as f64;
        let (sin, cos) = (2.0 * PI * (k % sides) as f64 / sides as f64).sin_cos();
        (u * cos + v * sin) * (corner_radius(radius, sides) * share) + *axis * (depth * (share * share - 0.5))
    };
    let mut triangles = Vec::with_capacity(2 * rings * sides);
    for k in 0..sides {
        triangles.push([at(0, 0), at(1, k), at(1, k + 1)]);
        for ring in 1..rings {
            triangles.extend(quad([at(ring, k), at(ring + 1, k), at(ring + 1, k + 1), at(ring, k + 1)]));
        }
    }
    triangles
}

/// A component that makes no sense.
pub(super) fn wrong(what: &str, problem: String) -> Error {
    Error::Model { problem: format!("{what}: {problem}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resolved::triangle::{double_area, projected_m2};

    const HERE: &str = ".";

    fn of(shape: &Shape, sides: usize) -> Vec<Triangle<Body>> {
        shape.triangles(sides, Path::new(HERE), "test").unwrap()
    }

    fn volume(triangles: &[Triangle<Body>]) -> f64 {
        triangles.iter().map(|[a, b, c]| a.dot(&b.cross(c)) / 6.0).sum()
    }

    #[test]
    fn closed_shapes_point_outwards_and_enclose_their_volume() {
        let cuboid = of(&Shape::Box { size_m: [2.0, 3.0, 4.0] }, 8);
        assert!((volume(&cuboid) - 24.0).abs() < 1e-12);
        for sides in [8, 32, 128] {
            let shape =
                Shape::Cylinder { length_m: 5.0, diameter_m: 2.0, end_diameter_m: None, axis: [1.0, 2.0, -0.5] };
            let step = PI / sides as f64;
            // a prism of the circle's perimeter: the cap is π r² · step/tan(step)
            assert!((volume(&of(&shape, sides)) / (5.0 * PI) - step / step.tan()).abs() < 1e-12, "{sides}");
        }
    }

    #[test]
    fn the_side_of_a_cylinder_has_its_area_whatever_the_number_of_sides() {
        for sides in [8, 31, 64] {
            let shape = Shape::Cylinder { length_m: 9.2, diameter_m: 4.3, end_diameter_m: None, axis: [0.0, 1.0, 0.0] };
            let y = Vector::<Body>::new(0.0, 1.0, 0.0);
            let side: f64 = of(&shape, sides)
                .iter()
                .map(double_area)
                .filter(|n| n.dot(&y).abs() < 1e-9)
                .map(|n| 0.5 * n.norm())
                .sum();
            assert!((side / (PI * 4.3 * 9.2) - 1.0).abs() < 1e-12, "{sides}: {side}");
        }
    }

    #[test]
    fn a_dish_shows_its_edge_from_the_front_and_its_hollow_side_is_the_front() {
        let shape = Shape::Dish { diameter_m: 3.0, depth_m: 0.5, axis: [0.0, 0.0, 1.0] };
        let triangles = of(&shape, 64);
        let z = Vector::<Body>::new(0.0, 0.0, 1.0);
        assert!(triangles.iter().all(|t| double_area(t).dot(&z) > 0.0));
        let edge_on_m2 = projected_m2(&triangles, &z, true);
        assert!((edge_on_m2 / (PI * 2.25) - 1.0).abs() < 1e-3, "{edge_on_m2}"); // (π/64)²/3 = 8e-4
    }

    #[test]
    fn a_length_of_nothing_and_a_plate_without_a_direction_are_refused_by_name() {
        let flat = Shape::Box { size_m: [1.0, 0.0, 1.0] };
        assert!(flat.triangles(8, Path::new(HERE), "tank").unwrap_err().to_string().contains("tank: size_m = 0"));
        let plate = Shape::Plate { size_m: [1.0, 1.0], normal: [0.0, 0.0, 1.0], along: [0.0, 0.0, 2.0] };
        assert!(plate.triangles(8, Path::new(HERE), "wing").unwrap_err().to_string().contains("along"));
    }
}
