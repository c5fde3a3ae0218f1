//! A vector is a vector: three components in a named frame, so that frames cannot be mixed.
//!
//! Units are the caller's (km for positions, km/s for velocities, 1 for directions). No matrices here.

use std::marker::PhantomData;
use std::ops::{Add, Mul, Neg, Sub};

/// True equator, mean equinox of date: the frame of SGP4.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Teme {}
/// Rotating with the Earth (ITRS): stations, and every scene of the brightness engine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Itrs {}
/// East, north, up of an observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Enu {}

/// Three components in the frame `F`.
#[derive(Debug, PartialEq)]
pub struct Vector<F> {
    xyz: [f64; 3],
    frame: PhantomData<F>,
}

impl<F> Clone for Vector<F> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<F> Copy for Vector<F> {}

impl<F> Vector<F> {
    /// From components.
    #[must_use]
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self { xyz: [x, y, z], frame: PhantomData }
    }
    /// First component.
    #[must_use]
    pub const fn x(&self) -> f64 {
        self.xyz[0]
    }
    /// Second component.
    #[must_use]
    pub const fn y(&self) -> f64 {
        self.xyz[1]
    }
    /// Third component.
    #[must_use]
    pub const fn z(&self) -> f64 {
        self.xyz[2]
    }
    /// The components.
    #[must_use]
    pub const fn to_array(&self) -> [f64; 3] {
        self.xyz
    }
    /// Scalar product.
    #[must_use]
    pub fn dot(&self, o: &Self) -> f64 {
        self.xyz[0] * o.xyz[0] + self.xyz[1] * o.xyz[1] + self.xyz[2] * o.xyz[2]
    }
    /// Vector product.
    #[must_use]
    pub fn cross(&self, o: &Self) -> Self {
        let ([a, b, c], [d, e, f]) = (self.xyz, o.xyz);
        Self::new(b * f - c * e, c * d - a * f, a * e - b * d)
    }
    /// Length.
    #[must_use]
    pub fn norm(&self) -> f64 {
        self.dot(self).sqrt()
    }
    /// Direction; `None` for a vector of length zero or not finite.
    #[must_use]
    pub fn unit(&self) -> Option<Self> {
        let n = self.norm();
        (n > 0.0 && n.is_finite()).then(|| *self * (1.0 / n))
    }
    /// Angle between two directions \[rad\], accurate near 0 and π.
    #[must_use]
    pub fn angle_to(&self, o: &Self) -> f64 {
        // θ = atan2(|a×b|, a·b)
        self.cross(o).norm().atan2(self.dot(o))
    }
    /// Any unit vector at right angles to this one.
    #[doc(hidden)]
    #[must_use]
    pub fn any_perpendicular(&self) -> Option<Self> {
        let [x, y, z] = self.xyz.map(f64::abs);
        let helper = if x <= y && x <= z {
            Self::new(1.0, 0.0, 0.0)
        } else if y <= z {
            Self::new(0.0, 1.0, 0.0)
        } else {
            Self::new(0.0, 0.0, 1.0)
        };
        self.cross(&helper).unit()
    }
}

impl<F> Add for Vector<F> {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self::new(self.xyz[0] + o.xyz[0], self.xyz[1] + o.xyz[1], self.xyz[2] + o.xyz[2])
    }
}
impl<F> Sub for Vector<F> {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}
impl<F> Neg for Vector<F> {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}
impl<F> Mul<f64> for Vector<F> {
    type Output = Self;
    fn mul(self, s: f64) -> Self {
        Self::new(self.xyz[0] * s, self.xyz[1] * s, self.xyz[2] * s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_accurate_when_tiny_and_when_opposite() {
        let a = Vector::<Enu>::new(1.0, 0.0, 0.0);
        let b = Vector::<Enu>::new(1.0, 1e-12, 0.0);
        assert!((a.angle_to(&b) - 1e-12).abs() < 1e-24);
        assert!((a.angle_to(&-a) - std::f64::consts::PI).abs() < 1e-15);
    }

    #[test]
    fn a_zero_vector_has_no_direction() {
        assert!(Vector::<Itrs>::new(0.0, 0.0, 0.0).unit().is_none());
        assert!(Vector::<Itrs>::new(f64::NAN, 0.0, 0.0).unit().is_none());
    }
}
