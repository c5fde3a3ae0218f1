//! Directions over the Earth's disc and over the rest of the sky, in sets that each cover it evenly.
//!
//! Unit vectors along Earth-fixed axes, equal solid angles. A (0,2)-sequence: every aligned run of a power of two of its
//! points is even by itself, so that a pixel may use a few sets and its neighbours others.

use std::f64::consts::TAU;

use crate::base::vector::{Itrs, Vector};

/// Sets of directions; one sample of a pixel uses one.
pub const SETS: usize = 16;

/// Directions over a cap about an axis, from a cosine to a cosine.
#[derive(Debug, Clone)]
pub struct Directions {
    /// Unit vectors, set after set.
    pub unit: Vec<Vector<Itrs>>,
    /// Directions in a set.
    pub per_set: usize,
    /// Solid angle of each \[sr\].
    pub each_sr: f64,
}

impl Directions {
    /// `per_set` (a power of two) directions in each of [`SETS`] sets, uniform in the angle about `axis` and in its cosine
    /// from `low` to `high`.
    #[must_use]
    pub fn new(axis: &Vector<Itrs>, (low, high): (f64, f64), per_set: usize) -> Self {
        let n = SETS * per_set;
        let u = axis.any_perpendicular().unwrap_or(*axis);
        let v = axis.cross(&u);
        let unit = (0..n)
            .map(|j| {
                let (x, y) = net(j as u32);
                let cos = low + (high - low) * x;
                let sin = (1.0 - cos * cos).max(0.0).sqrt();
                let (s, c) = (TAU * y).sin_cos();
                *axis * cos + u * (sin * c) + v * (sin * s)
            })
            .collect();
        Self { unit, per_set, each_sr: TAU * (high - low) / n as f64 }
    }

    /// The places of a set in the list.
    #[must_use]
    pub fn set(&self, k: usize) -> std::ops::Range<usize> {
        let k = k % SETS;
        k * self.per_set..(k + 1) * self.per_set
    }
}

/// The j-th point of the two-dimensional sequence of van der Corput and Sobol', in the middle of its cell of 2⁻³².
fn net(j: u32) -> (f64, f64) {
    let (mut second, mut direction, mut left) = (0_u32, 1_u32 << 31, j);
    while left > 0 {
        if left & 1 == 1 {
            second ^= direction;
        }
        direction ^= direction >> 1;
        left >>= 1;
    }
    let share = |bits: u32| (f64::from(bits) + 0.5) / 4_294_967_296.0;
    (share(j.reverse_bits()), share(second))
}

/// A number in 0..2³² that two places share only by chance: which set a pixel uses, where in a cell a sample lies.
#[must_use]
pub fn scramble(x: usize, y: usize, k: usize) -> u32 {
    // finalizer of MurmurHash3 over the three
    let mut h = (x as u32).wrapping_mul(0x9e37_79b1)
        ^ (y as u32).wrapping_mul(0x85eb_ca77)
        ^ (k as u32).wrapping_mul(0xc2b2_ae3d);
    h ^= h >> 16;
    h = h.wrapping_mul(0x85eb_ca6b);
    h ^= h >> 13;
    h = h.wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_by_itself_has_one_direction_in_every_elementary_cell() {
        for set in 0..8 {
            for (nx, ny) in [(16, 1), (8, 2), (4, 4), (2, 8), (1, 16)] {
                let mut seen = vec![0; nx * ny];
                for j in 16 * set..16 * (set + 1) {
                    let (x, y) = net(j);
                    seen[(x * nx as f64) as usize * ny + (y * ny as f64) as usize] += 1;
                }
                assert!(seen.iter().all(|n| *n == 1), "{set} {nx}x{ny}: {seen:?}");
            }
        }
    }

    #[test]
    fn the_directions_fill_the_cap_and_average_to_its_moments() {
        let axis = Vector::new(0.3, -0.5, 0.81).unit().unwrap();
        let cap = Directions::new(&axis, (0.35, 1.0), 16);
        assert!((cap.each_sr * cap.unit.len() as f64 / (TAU * 0.65) - 1.0).abs() < 1e-12);
        let mean = cap.unit.iter().map(|w| w.dot(&axis)).sum::<f64>() / cap.unit.len() as f64;
        assert!((mean - 0.675).abs() < 2e-3, "{mean}"); // 256 points, half a cell is 1.3e-3
        assert!(cap.unit.iter().all(|w| (w.norm() - 1.0).abs() < 1e-12));
    }
}
