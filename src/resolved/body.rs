//! A satellite of components in one scene: every triangle where it is, which of them something can shade, and rays.
//!
//! Metres from the satellite's origin along Earth-fixed axes. Parallel views: the satellite is far away.

use std::collections::HashMap;

use super::joint::{Pose, poses};
use super::rays::Rays;
use super::satellite::{ComponentSatellite, Material};
use super::shape::wrong;
use super::surface::extent_m;
use super::triangle::Body;
use super::triangle::Triangle;
use super::triangle::double_area;
use crate::base::error::Result;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::{Attitude, Scene};

/// Height above a face below which a corner lies in its plane, relative to the body.
const IN_PLANE: f64 = 1e-7;
/// How far rays start off a face, relative to the body.
const LIFT: f64 = 1e-6;

/// All triangles of one material and one normal: they answer every parallel light alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    /// Unit normal of the front.
    pub normal: Vector<Itrs>,
    /// Index of the material.
    pub material: usize,
}

/// A triangle of the body.
#[derive(Debug, Clone)]
pub struct BodyTriangle {
    /// Its corners \[m\].
    pub corners: Triangle<Itrs>,
    /// Index of its facet.
    pub facet: usize,
    /// Index of its component.
    pub component: usize,
    /// The back can be seen too.
    pub sheet: bool,
    /// Nothing of the body is before its front, before its back: no light can be kept from it.
    pub open: [bool; 2],
}

/// A satellite in one scene.
#[derive(Debug)]
pub struct PosedBody {
    /// Triangles.
    pub faces: Vec<BodyTriangle>,
    /// Facets.
    pub facets: Vec<Facet>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Names of the components.
    pub names: Vec<String>,
    /// Boxes of the components along the body's axes, joints at angle 0 \[m\].
    pub extents_m: Vec<[[f64; 2]; 3]>,
    /// Radius of the sphere about the origin that holds everything \[m\].
    pub radius_m: f64,
    axes: [Vector<Itrs>; 3],
    joints: Vec<Pose>,
    joint_of: Vec<Option<usize>>,
    rays: Rays,
}

impl PosedBody {
    /// Turns the joints, puts every component in its place, and finds out what can shade what.
    ///
    /// # Errors
    /// [`crate::Error::Model`] when the orbit has no plane to hold the body in; those of the shapes.
    pub fn new(satellite: &ComponentSatellite, scene: &Scene, sides: usize) -> Result<Self> {
        let axis = |v: [f64; 3]| {
            let found = Attitude::Lvlh(v).normal(scene);
            found.ok_or_else(|| wrong(&satellite.name, "position and velocity span no plane".into()))
        };
        let axes = [axis([1.0, 0.0, 0.0])?, axis([0.0, 1.0, 0.0])?, axis([0.0, 0.0, 1.0])?];
        let sun = scene.sun_km - scene.satellite_km;
        let sun = Vector::<Body>::new(sun.dot(&axes[0]), sun.dot(&axes[1]), sun.dot(&axes[2])).unit();
        let sun = sun.ok_or_else(|| wrong(&satellite.name, "the satellite is in the Sun".into()))?;
        let joints = poses(&satellite.joints, &sun);
        let mut body = Self {
            faces: Vec::new(),
            facets: Vec::new(),
            materials: satellite.materials.clone(),
            names: satellite.components.iter().map(|c| c.name.clone()).collect(),
            extents_m: Vec::new(),
            radius_m: 0.0,
            axes,
            joint_of: satellite
                .components
                .iter()
                .map(|c| c.joint.as_ref().and_then(|name| satellite.joints.iter().position(|j| j.name == *name)))
                .collect(),
            joints,
            rays: Rays::new::<Itrs>(&[], 1.0),
        };
        let mut known: HashMap<(usize, [i64; 3]), usize> = HashMap::new();
        for (component, part) in satellite.components.iter().enumerate() {
            let (material, sheet) = (satellite.material_of(part), part.shape.is_sheet());
            let triangles = satellite.triangles(part, sides)?;
            body.extents_m.push(extent_m(&triangles));
            for triangle in triangles {
                let corners = triangle.map(|v| body.place(component, &v));
                let Some(normal) = double_area(&corners).unit() else { continue };
                let key = (material, normal.to_array().map(|x| (x * 1e8).round() as i64));
                let facet = *known.entry(key).or_insert_with(|| {
                    body.facets.push(Facet { normal, material });
                    body.facets.len() - 1
                });
                body.faces.push(BodyTriangle { corners, facet, component, sheet, open: [false; 2] });
            }
        }
        let corners = || body.faces.iter().flat_map(|p| p.corners.iter());
        body.radius_m = corners().map(Vector::norm).fold(0.0, f64::max);
        body.find_open();
        let triangles: Vec<Triangle<Itrs>> = body.faces.iter().map(|p| p.corners).collect();
        body.rays = Rays::new(&triangles, body.radius_m);
        Ok(body)
    }

    /// Where a place of a component (body frame, joints at angle 0) is now \[m\].
    #[must_use]
    pub fn place(&self, component: usize, at_m: &Vector<Body>) -> Vector<Itrs> {
        self.along_axes(&self.pose(component).map_or(*at_m, |pose| pose.place(at_m)))
    }

    /// Where a direction of a component points now.
    #[must_use]
    pub fn direction(&self, component: usize, v: &Vector<Body>) -> Vector<Itrs> {
        self.along_axes(&self.pose(component).map_or(*v, |pose| pose.direction(v)))
    }

    fn pose(&self, component: usize) -> Option<&Pose> {
        self.joint_of.get(component).copied().flatten().and_then(|k| self.joints.get(k))
    }

    fn along_axes(&self, v: &Vector<Body>) -> Vector<Itrs> {
        self.axes[0] * v.x() + self.axes[1] * v.y() + self.axes[2] * v.z()
    }

    /// No triangle has anything before a side that can be seen: the body throws no shadow on itself.
    #[must_use]
    pub fn is_convex(&self) -> bool {
        self.faces.iter().all(|p| p.open[0] && (p.open[1] || !p.sheet))
    }

    /// The normal of the side of a triangle that a direction from it lies on: front 0, back 1.
    #[must_use]
    pub fn side_toward(&self, face: usize, direction: &Vector<Itrs>) -> (usize, Vector<Itrs>) {
        let normal = self.facets[self.faces[face].facet].normal;
        if normal.dot(direction) >= 0.0 { (0, normal) } else { (1, -normal) }
    }

    /// The first triangle on the way from afar along `direction` through `place`, and where it is met.
    #[must_use]
    pub fn seen_along(&self, place: &Vector<Itrs>, direction: &Vector<Itrs>) -> Option<(usize, Vector<Itrs>)> {
        let from = *place - *direction * (place.dot(direction) + 2.0 * self.radius_m);
        self.rays.nearest(&from, direction).map(|(face, t)| (face, from + *direction * t))
    }

    /// The first triangle on the way from a face: its normal towards the side the ray leaves on.
    #[must_use]
    pub fn met_from(
        &self,
        place: &Vector<Itrs>,
        normal: &Vector<Itrs>,
        to: &Vector<Itrs>,
    ) -> Option<(usize, Vector<Itrs>)> {
        let from = *place + *normal * (LIFT * self.radius_m);
        self.rays.nearest(&from, to).map(|(face, t)| (face, from + *to * t))
    }

    /// Part of the body is in the way from a face in the direction `to`.
    #[must_use]
    pub fn shaded(&self, place: &Vector<Itrs>, normal: &Vector<Itrs>, to: &Vector<Itrs>) -> bool {
        self.rays.blocked(&(*place + *normal * (LIFT * self.radius_m)), to)
    }

    /// A side is open when no corner of the body lies before its plane.
    fn find_open(&mut self) {
        let mut corners: Vec<Vector<Itrs>> = self.faces.iter().flat_map(|p| p.corners).collect();
        // the far ones first: they decide most planes
        corners.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
        let margin = IN_PLANE * self.radius_m;
        for face in &mut self.faces {
            let normal = self.facets[face.facet].normal;
            let level = normal.dot(&face.corners[0]);
            face.open = [
                corners.iter().all(|v| normal.dot(v) - level <= margin),
                corners.iter().all(|v| level - normal.dot(v) <= margin),
            ];
        }
    }
}
