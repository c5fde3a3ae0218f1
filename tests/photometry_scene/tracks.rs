//! Cosmic rays and radioactive decays in a detector: tracks of charge that no optics have seen.
//!
//! Electrons and pixels. Charge is laid down along a path in small steps and spreads by diffusion (σ 0.15 to 0.35 px)
//! before it is collected: straight tracks of 1 to 60 px at any angle, spots, and the worms that electrons of a
//! decay leave. Nothing here knows how the search recognises them.

use ndarray::Array2;
use rand::Rng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal, Poisson};

/// Range of the charge of a track \[e⁻\], even in its logarithm.
pub const CHARGE_E: (f64, f64) = (300.0, 30_000.0);
/// Longest track \[px\].
const LONGEST_PX: f64 = 60.0;
/// Step along a path \[px\].
const STEP_PX: f64 = 0.05;

/// What a particle left.
#[derive(Debug, Clone)]
pub struct Track {
    /// Points of the path \[px\], even in length.
    pub path: Vec<(f64, f64)>,
    /// Its charge \[e⁻\].
    pub charge_e: f64,
    /// σ of the diffusion \[px\].
    diffusion_px: f64,
}

impl Track {
    /// Three of five are straight, one a spot, one a worm; the middle of the path lies at (x, y).
    pub fn any(rng: &mut ChaCha12Rng, (x, y): (f64, f64)) -> Self {
        let charge_e = (CHARGE_E.0.ln() + rng.random::<f64>() * (CHARGE_E.1 / CHARGE_E.0).ln()).exp();
        let diffusion_px = rng.random_range(0.15..0.35);
        let (length, bend) = match rng.random_range(0..5) {
            0..3 => (rng.random_range(1.0..LONGEST_PX), 0.0),
            3 => (rng.random_range(0.0..1.5), 0.0),
            // direction of a worm: a random walk of so many radians per square root of a pixel
            _ => (rng.random_range(5.0..LONGEST_PX), rng.random_range(0.1..0.4)),
        };
        let mut theta = rng.random_range(0.0..std::f64::consts::TAU);
        let turn = Normal::new(0.0, 1.0).unwrap();
        let mut at = (0.0, 0.0);
        let mut path = vec![at];
        for _ in 0..(length / STEP_PX) as usize {
            theta += bend * STEP_PX.sqrt() * turn.sample(rng);
            at = (at.0 + STEP_PX * theta.cos(), at.1 + STEP_PX * theta.sin());
            path.push(at);
        }
        let middle = path[path.len() / 2];
        path.iter_mut().for_each(|p| *p = (p.0 - middle.0 + x, p.1 - middle.1 + y));
        Self { path, charge_e, diffusion_px }
    }

    /// Of other shapes: single and double pixels, long thin tracks, worms, and muons that end within a few pixels, after
    /// much or little diffusion.
    pub fn other(rng: &mut ChaCha12Rng, (x, y): (f64, f64)) -> Self {
        let charge_e = (CHARGE_E.0.ln() + rng.random::<f64>() * (CHARGE_E.1 / CHARGE_E.0).ln()).exp();
        let diffusion_px = rng.random_range(0.1..0.4);
        let theta = rng.random_range(0.0..std::f64::consts::TAU);
        let straight = |length: f64| -> Vec<(f64, f64)> {
            let steps = (length / STEP_PX) as usize;
            let along = |k: usize| (k as f64 - 0.5 * steps as f64) * STEP_PX;
            (0..=steps).map(|k| (along(k) * theta.cos(), along(k) * theta.sin())).collect()
        };
        let mut path = match rng.random_range(0..5) {
            // no diffusion beyond the pixel
            0 => return Self { path: vec![(x.round(), y.round())], charge_e, diffusion_px: 0.01 },
            1 => {
                let (dx, dy) = [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, -1.0)][rng.random_range(0..4)];
                let path = vec![(x.round(), y.round()), (x.round() + dx, y.round() + dy)];
                return Self { path, charge_e, diffusion_px: 0.01 };
            }
            2 => straight(rng.random_range(20.0..150.0)),
            3 => {
                let (length, bend) = (rng.random_range(5.0..40.0), rng.random_range(0.2..0.6));
                let turn = Normal::new(0.0, bend * STEP_PX.sqrt()).unwrap();
                let (mut theta, mut at, mut path) = (theta, (0.0, 0.0), vec![(0.0, 0.0)]);
                for _ in 0..(length / STEP_PX) as usize {
                    theta += turn.sample(rng);
                    at = (at.0 + STEP_PX * theta.cos(), at.1 + STEP_PX * theta.sin());
                    path.push(at);
                }
                path
            }
            _ => straight(rng.random_range(1.0..20.0)),
        };
        path.iter_mut().for_each(|p| *p = (p.0 + x, p.1 + y));
        Self { path, charge_e, diffusion_px }
    }

    /// Adds its charge to the pixels of a frame that has been exposed.
    pub fn strike(&self, pixels: &mut Array2<f32>, rng: &mut ChaCha12Rng) {
        let (ny, nx) = pixels.dim();
        let spread = Normal::new(0.0, self.diffusion_px).unwrap();
        // enough packets that their own number is no noise of note
        let packets = (4000 / self.path.len()).max(8);
        let each = self.charge_e / (packets * self.path.len()) as f64;
        let mut mean = std::collections::BTreeMap::new();
        for &(x, y) in &self.path {
            for _ in 0..packets {
                let (i, j) = ((x + spread.sample(rng)).round(), (y + spread.sample(rng)).round());
                if i >= 0.0 && j >= 0.0 && i < nx as f64 && j < ny as f64 {
                    *mean.entry((j as usize, i as usize)).or_insert(0.0) += each;
                }
            }
        }
        for ((j, i), m) in mean {
            pixels[[j, i]] += Poisson::new(m).unwrap().sample(rng) as f32;
        }
    }

    /// Distance of a place from the track \[px\].
    pub fn distance(&self, x: f64, y: f64) -> f64 {
        self.path.iter().map(|p| (p.0 - x).hypot(p.1 - y)).fold(f64::INFINITY, f64::min)
    }
}
