//! A resolved space station among star trails: modules, truss and arrays, seen through the atmosphere.
//!
//! Pixels and electrons; everything random is drawn from the seed, and the light of every trail is known.

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use satphot::frames::{Electrons, Frame};
use satphot::photometry::aperture::{Bounds, Shape, for_each_pixel};
use statrs::function::erf::erf;

use super::{FWHM_PER_SIGMA, frame};

/// The stars behind the target.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Stars {
    /// No trail at all.
    None,
    /// One trail through the target in an otherwise starless frame, 1 to 100 % of the target's flux.
    One,
    /// Six trails of any brightness anywhere, and in half of the frames one through the target.
    Few,
    /// 120 trails, most of them below the noise.
    Crowded,
}

/// What is observed.
#[derive(Clone, Copy)]
pub struct Case {
    pub n: usize,
    pub fwhm: f64,
    /// Length of the station along its truss.
    pub length: f64,
    pub sky_e: f64,
    pub read_noise_e: f64,
    /// Flux over the error of an aperture around the whole station.
    pub snr: f64,
    pub stars: Stars,
    /// Level of the sky at the corners over that at the centre: linear and quadratic in equal parts.
    pub gradient: f64,
    pub seed: u64,
}

/// A straight trail across the frame: `v` px off the centre of the frame.
#[derive(Clone, Copy)]
pub struct Trail {
    pub v: f64,
    pub light_e_px: f64,
}

/// A realised exposure and what is in it.
pub struct Exposed {
    pub frame: Frame<Electrons>,
    pub x: f64,
    pub y: f64,
    pub flux_e: f64,
    /// Direction of all trails.
    pub theta: f64,
    pub trails: Vec<Trail>,
    sigma: f64,
    n: f64,
}

/// Parts of the station: centre and half sizes in units of half its length, and relative surface brightness.
const PARTS: [(f64, f64, f64, f64, f64); 13] = [
    (0.0, 0.0, 1.0, 0.03, 1.0),
    (0.0, -0.1, 0.10, 0.42, 2.0),
    (0.0, 0.15, 0.25, 0.05, 1.5),
    (0.30, -0.25, 0.10, 0.20, 0.7),
    (-0.30, -0.25, 0.10, 0.20, 0.7),
    (0.90, 0.32, 0.09, 0.30, 1.0),
    (0.90, -0.32, 0.09, 0.30, 1.0),
    (0.66, 0.32, 0.09, 0.30, 1.0),
    (0.66, -0.32, 0.09, 0.30, 1.0),
    (-0.90, 0.32, 0.09, 0.30, 1.0),
    (-0.90, -0.32, 0.09, 0.30, 1.0),
    (-0.66, 0.32, 0.09, 0.30, 1.0),
    (-0.66, -0.32, 0.09, 0.30, 1.0),
];

impl Case {
    /// Draws the scene and exposes it.
    pub fn expose(&self) -> Exposed {
        let mut rng = ChaCha12Rng::seed_from_u64(self.seed);
        let n = self.n as f64;
        let sigma = self.fwhm / FWHM_PER_SIGMA;
        let theta_body = rng.random_range(0.0..std::f64::consts::PI);
        // seen at a slant: the width shrinks
        let slant = rng.random_range(0.35..1.0);
        let (off, way) = (rng.random_range(0.0..0.12) * n, rng.random_range(0.0..std::f64::consts::TAU));
        let (x, y) = (n / 2.0 + off * way.cos(), n / 2.0 + off * way.sin());
        let half = 0.5 * self.length;
        let (a, b) = (half + 1.5 * self.fwhm, 0.62 * slant * half + 1.5 * self.fwhm);
        let variance = 1.3 * std::f64::consts::PI * a * b * (self.sky_e + self.read_noise_e.powi(2));
        let flux_e = 0.5 * self.snr * (self.snr + (self.snr * self.snr + 4.0 * variance).sqrt());
        let mut mean = Array2::from_elem((self.n, self.n), 0.0);
        let parts = PARTS.map(|(px, py, hx, hy, light)| {
            let light = light * 10f64.powf(rng.random_range(-0.3..0.3));
            (px * half, py * half * slant, hx * half, (hy * half * slant).max(1.0), light)
        });
        let total: f64 = parts.iter().map(|p| p.2 * p.3 * p.4).sum();
        for (px, py, hx, hy, light) in parts {
            let flux = flux_e * light * hx * hy / total;
            rectangle(&mut mean, (x, y), theta_body, (px, py, hx, hy), sigma, flux);
        }
        let theta = rng.random_range(0.0..std::f64::consts::PI);
        let trails = self.trails(&mut rng, (x, y), (a, b, theta_body), flux_e, theta);
        add_trails(&mut mean, &trails, theta, sigma);
        let (gx, gy) = (rng.random_range(-1.0..1.0f64), rng.random_range(-1.0..1.0f64));
        let norm = gx.hypot(gy).max(0.1);
        for ((j, i), m) in mean.indexed_iter_mut() {
            let (u, v) = (2.0 * i as f64 / n - 1.0, 2.0 * j as f64 / n - 1.0);
            let t = 0.35 * (gx * u + gy * v) / norm + 0.25 * ((u + 0.3) * (u + 0.3) + (v - 0.2) * (v - 0.2));
            *m += self.sky_e * (1.0 + (self.gradient - 1.0) * t).max(0.1);
        }
        let scene = super::Scene { mean };
        let frame = scene.expose(self.read_noise_e, self.seed ^ 0x5eed);
        Exposed { frame, x, y, flux_e, theta, trails, sigma, n }
    }

    fn trails(
        &self,
        rng: &mut ChaCha12Rng,
        at: (f64, f64),
        (a, b, theta_body): (f64, f64, f64),
        flux_e: f64,
        theta: f64,
    ) -> Vec<Trail> {
        let n = self.n as f64;
        let (sin, cos) = theta.sin_cos();
        let own = (at.1 - n / 2.0) * cos - (at.0 - n / 2.0) * sin;
        // the target's reach across the trails, and the mean chord along them
        let phi = theta_body - theta;
        let across = (a * phi.sin()).hypot(b * phi.cos());
        let chord = std::f64::consts::PI * a * b / (2.0 * across);
        let through = |rng: &mut ChaCha12Rng| Trail {
            v: own + rng.random_range(-0.8..0.8) * across,
            light_e_px: flux_e * 10f64.powf(rng.random_range(-2.0..0.0)) / chord,
        };
        let noise = (self.sky_e + self.read_noise_e.powi(2)).sqrt();
        match self.stars {
            Stars::None => Vec::new(),
            Stars::One => vec![through(rng)],
            Stars::Few => {
                let mut trails: Vec<Trail> = (0..6)
                    .map(|_| Trail {
                        v: rng.random_range(-0.7..0.7) * n,
                        light_e_px: noise * 10f64.powf(rng.random_range(-0.5..2.0)),
                    })
                    .collect();
                if rng.random::<bool>() {
                    trails.push(through(rng));
                }
                trails
            }
            Stars::Crowded => (0..120)
                .map(|_| Trail {
                    v: rng.random_range(-0.75..0.75) * n,
                    light_e_px: (0.75 * noise / rng.random_range(0.003..1.0f64)).min(250.0 * noise),
                })
                .collect(),
        }
    }
}

impl Exposed {
    /// Light of each trail inside an aperture, noiseless.
    pub fn light_of_trails(&self, x: f64, y: f64, shape: &Shape) -> Vec<f64> {
        let (sin, cos) = self.theta.sin_cos();
        let (ny, nx) = self.frame.pixels.dim();
        let mut light = vec![0.0; self.trails.len()];
        for_each_pixel(shape, x, y, Bounds { x0: 0, x1: nx, y0: 0, y1: ny }, |i, j, fraction| {
            let v = (j as f64 - self.n / 2.0) * cos - (i as f64 - self.n / 2.0) * sin;
            for (sum, trail) in light.iter_mut().zip(&self.trails) {
                let z = (v - trail.v) / self.sigma;
                if z.abs() < 5.0 {
                    let profile = (-0.5 * z * z).exp() / (self.sigma * (2.0 * std::f64::consts::PI).sqrt());
                    *sum += fraction * trail.light_e_px * profile;
                }
            }
        });
        light
    }
}

/// A turned rectangle of even light, blurred by a Gaussian, sampled at the centres of pixels.
fn rectangle(
    mean: &mut Array2<f64>,
    (x, y): (f64, f64),
    theta: f64,
    (px, py, hx, hy): (f64, f64, f64, f64),
    sigma: f64,
    flux_e: f64,
) {
    let (ny, nx) = mean.dim();
    let (sin, cos) = theta.sin_cos();
    let (cx, cy) = (x + px * cos - py * sin, y + px * sin + py * cos);
    let reach = hx.hypot(hy) + 6.0 * sigma + 2.0;
    let root = sigma * std::f64::consts::SQRT_2;
    let share = |d: f64, h: f64| (erf((d + h) / root) - erf((d - h) / root)) / (4.0 * h);
    let range = |c: f64, n: usize| ((c - reach).max(0.0) as usize)..((c + reach).clamp(0.0, n as f64) as usize);
    for j in range(cy, ny) {
        for i in range(cx, nx) {
            let (dx, dy) = (i as f64 - cx, j as f64 - cy);
            let (u, v) = (dx * cos + dy * sin, dy * cos - dx * sin);
            if u.abs() < hx + 6.0 * sigma && v.abs() < hy + 6.0 * sigma {
                mean[[j, i]] += flux_e * share(u, hx) * share(v, hy);
            }
        }
    }
}

/// Endless trails, from a table of the profile across them.
pub fn add_trails(mean: &mut Array2<f64>, trails: &[Trail], theta: f64, sigma: f64) {
    let (ny, nx) = mean.dim();
    let n = nx.max(ny) as f64;
    let step = 0.05;
    let mut across = vec![0f64; (2.0 * n / step) as usize];
    for trail in trails {
        let from = ((trail.v + n - 6.0 * sigma) / step).max(0.0) as usize;
        let to = (((trail.v + n + 6.0 * sigma) / step) as usize).min(across.len());
        for k in from..to {
            let z = (k as f64 * step - n - trail.v) / sigma;
            across[k] += trail.light_e_px * (-0.5 * z * z).exp() / (sigma * (2.0 * std::f64::consts::PI).sqrt());
        }
    }
    let (sin, cos) = theta.sin_cos();
    for ((j, i), m) in mean.indexed_iter_mut() {
        let v = (j as f64 - ny as f64 / 2.0) * cos - (i as f64 - nx as f64 / 2.0) * sin;
        *m += across[(((v + n) / step).round().max(0.0) as usize).min(across.len() - 1)];
    }
}

/// A frame of given expected electrons, for shapes other than the station.
pub fn exact(mean: &Array2<f64>, read_noise_e: f64) -> Frame<Electrons> {
    frame(mean.mapv(|v| v as f32), read_noise_e)
}
