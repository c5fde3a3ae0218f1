//! Joints: how a part of a satellite turns to the Sun, one axis on another.
//!
//! Metres and radians (degrees in files). In the Earth's shadow a joint keeps following the geometric Sun. Not
//! included: how fast it can turn, and what the operators do with it for power, drag or plumes.

use serde::{Deserialize, Serialize};

use super::shape::wrong;
use super::triangle::Body;
use crate::base::error::Result;
use crate::base::vector::Vector;

/// Sine of the angle between Sun and axis below which the joint stays at angle 0: 0.2 arcsec.
const SINGULAR: f64 = 1e-6;

/// A joint that turns what is on it towards the Sun about one axis.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// The joint it sits on; absent = the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on: Option<String>,
    /// A place on its axis, joints at angle 0 \[m\].
    pub pivot_m: [f64; 3],
    /// Its axis, joints at angle 0.
    pub axis: [f64; 3],
    /// What is turned to the Sun: the normal at angle 0; its part along the axis does not count.
    pub zero: [f64; 3],
    /// Largest turn either way \[deg\].
    #[serde(default = "half_turn")]
    pub limit_deg: f64,
}

fn half_turn() -> f64 {
    180.0
}

/// A turn about an axis through a place: p → R (p − pivot) + pivot, one after another.
#[derive(Debug, Clone, PartialEq)]
pub struct Pose {
    /// Images of the three axes.
    axes: [Vector<Body>; 3],
    /// Image of the origin \[m\].
    origin: Vector<Body>,
}

impl Pose {
    /// No turn at all.
    #[must_use]
    pub fn fixed() -> Self {
        let axes = [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)];
        Self { axes, origin: Vector::new(0.0, 0.0, 0.0) }
    }

    /// Where a direction goes.
    #[must_use]
    pub fn direction(&self, v: &Vector<Body>) -> Vector<Body> {
        self.axes[0] * v.x() + self.axes[1] * v.y() + self.axes[2] * v.z()
    }

    /// Where a place goes.
    #[must_use]
    pub fn place(&self, v: &Vector<Body>) -> Vector<Body> {
        self.direction(v) + self.origin
    }

    /// Where a direction comes from.
    fn back(&self, v: &Vector<Body>) -> Vector<Body> {
        Vector::new(self.axes[0].dot(v), self.axes[1].dot(v), self.axes[2].dot(v))
    }

    /// First a turn about `axis` (unit) through `pivot`, then this pose.
    fn after_turn(&self, axis: &Vector<Body>, pivot: &Vector<Body>, turn_rad: f64) -> Self {
        let (sin, cos) = turn_rad.sin_cos();
        // Rodrigues: v cosθ + (a × v) sinθ + a (a·v)(1 − cosθ)
        let turned = |v: &Vector<Body>| *v * cos + axis.cross(v) * sin + *axis * (axis.dot(v) * (1.0 - cos));
        let axes = Pose::fixed().axes.map(|v| self.direction(&turned(&v)));
        let origin = self.place(&(*pivot - turned(pivot)));
        Self { axes, origin }
    }
}

impl Joint {
    /// The angle that brings the zero normal nearest to the Sun: `θ* = atan2((a × z)·s, z·s)`, cut at the limit.
    fn turn_rad(&self, sun: &Vector<Body>) -> f64 {
        let (Some(axis), zero) = (vector(self.axis).unit(), vector(self.zero)) else { return 0.0 };
        let Some(zero) = (zero - axis * axis.dot(&zero)).unit() else { return 0.0 };
        let (along, quarter) = (zero.dot(sun), axis.cross(&zero).dot(sun));
        if along.hypot(quarter) <= SINGULAR {
            return 0.0;
        }
        let limit = self.limit_deg.to_radians();
        quarter.atan2(along).clamp(-limit, limit)
    }

    /// Refuses axes without a direction and limits out of range.
    pub(super) fn check(&self) -> Result<()> {
        let axis = vector(self.axis).unit();
        let axis = axis.ok_or_else(|| wrong(&self.name, format!("axis = {:?} has no direction", self.axis)))?;
        let zero = vector(self.zero);
        if !(axis.cross(&zero).norm() > SINGULAR * zero.norm()) {
            return Err(wrong(&self.name, format!("zero = {:?} has no part across the axis", self.zero)));
        }
        if !(self.limit_deg > 0.0 && self.limit_deg <= 180.0) {
            return Err(wrong(&self.name, format!("limit_deg = {}; accepted is above 0, at most 180", self.limit_deg)));
        }
        if !vector(self.pivot_m).norm().is_finite() {
            return Err(wrong(&self.name, format!("pivot_m = {:?} is not finite", self.pivot_m)));
        }
        Ok(())
    }
}

/// The pose of every joint, in the order of `joints`, with the Sun in a direction of the body frame.
#[must_use]
pub fn poses(joints: &[Joint], sun: &Vector<Body>) -> Vec<Pose> {
    let mut done: Vec<Pose> = Vec::with_capacity(joints.len());
    for joint in joints {
        let on = joint.on.as_ref().and_then(|name| joints.iter().position(|j| j.name == *name));
        let base = on.and_then(|k| done.get(k).cloned()).unwrap_or_else(Pose::fixed);
        let turn = joint.turn_rad(&base.back(sun));
        let axis = vector(joint.axis).unit().unwrap_or(Vector::new(1.0, 0.0, 0.0));
        done.push(base.after_turn(&axis, &vector(joint.pivot_m), turn));
    }
    done
}

fn vector([x, y, z]: [f64; 3]) -> Vector<Body> {
    Vector::new(x, y, z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joint(name: &str, on: Option<&str>, axis: [f64; 3]) -> Joint {
        let pivot_m = [1.0, 20.0, 3.0];
        Joint { name: name.into(), on: on.map(Into::into), pivot_m, axis, zero: [0.0, 0.0, -1.0], limit_deg: 180.0 }
    }

    #[test]
    fn two_axes_point_a_wing_at_any_sun_and_one_axis_as_near_as_it_can() {
        let joints = [joint("alpha", None, [0.0, 1.0, 0.0]), joint("beta", Some("alpha"), [1.0, 0.0, 0.0])];
        let normal = Vector::<Body>::new(0.0, 0.0, -1.0);
        for sun in [[0.3, -0.7, 0.2], [-0.1, 0.9, 0.4], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 1e-3, 0.0]] {
            let sun = vector(sun).unit().unwrap();
            let found = poses(&joints, &sun);
            assert!((found[1].direction(&normal).dot(&sun) - 1.0).abs() < 1e-12, "{sun:?}");
            // one axis: what is left is the part along it
            let best = (1.0 - sun.y() * sun.y()).sqrt();
            assert!((found[0].direction(&normal).dot(&sun) - best).abs() < 1e-12, "{sun:?}");
        }
    }

    #[test]
    fn a_turn_keeps_the_pivot_and_all_lengths() {
        let joints = [joint("alpha", None, [0.2, 1.0, -0.4])];
        let sun = vector([0.5, 0.1, 0.8]).unit().unwrap();
        let pose = &poses(&joints, &sun)[0];
        let pivot = vector(joints[0].pivot_m);
        assert!((pose.place(&pivot) - pivot).norm() < 1e-12);
        let (a, b) = (vector([7.0, -3.0, 2.0]), vector([-1.0, 4.0, 9.0]));
        assert!(((pose.place(&a) - pose.place(&b)).norm() - (a - b).norm()).abs() < 1e-12);
    }

    #[test]
    fn with_the_sun_on_its_axis_a_joint_stays_at_angle_zero() {
        let joints = [joint("alpha", None, [0.0, 1.0, 0.0])];
        assert_eq!(poses(&joints, &vector([0.0, 1.0, 0.0]))[0], Pose::fixed());
    }
}
