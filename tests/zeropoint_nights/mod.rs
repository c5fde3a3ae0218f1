//! Simulated nights of star pointings: the geometry of Caddy et al., with the noise, clouds and outliers one asks for.
//!
//! Magnitudes. 321 stars in 21 pointings, airmass 1.03 to 2.03, B−V 0.2 to 0.9, V 10 to 15 as a beta distribution,
//! photon noise 3 mmag and 20 mmag at V = 13, catalogue errors 0.05 mag with a lognormal spread of 0.3, pointings that
//! share a scatter. Deterministic in the seed.
#![allow(dead_code)]

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Beta, StandardNormal};
use rayon::prelude::*;
use satphot::config::Zeropoint as Config;
use satphot::zeropoint::fit::{StarMeasurement, Zeropoint, fit};

/// ZP, k and C of every simulated night.
pub const TRUTH: [f64; 3] = [-23.37, 0.12, 0.08];
/// Where the magnitude is predicted: airmass and B−V.
pub const AT: (f64, f64) = (1.4, 0.65);

/// What a night of star pointings is made of.
#[derive(Clone, Copy)]
pub struct Night {
    pub stars: usize,
    pub pointings: usize,
    /// Share of outliers.
    pub outliers: f64,
    pub outlier: fn(&mut ChaCha8Rng) -> f64,
    pub pointing_scatter_mag: f64,
    pub catalogue_err_mag: f64,
    pub airmass: fn(&mut ChaCha8Rng) -> f64,
    pub colour: fn(&mut ChaCha8Rng, f64) -> f64,
}

/// The geometry of the paper.
pub const PAPER: Night = Night {
    stars: 321,
    pointings: 21,
    outliers: 0.0,
    outlier: one_sided,
    pointing_scatter_mag: 0.03,
    catalogue_err_mag: 0.05,
    airmass: |r| r.random_range(1.03..2.03),
    colour: |r, _| r.random_range(0.2..0.9),
};

pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(StandardNormal)
}
/// Saturated or blended: instrumentally fainter by about 0.8 mag.
pub fn one_sided(rng: &mut ChaCha8Rng) -> f64 {
    (0.8 + 0.6 * normal(rng)).abs()
}
/// As far, to both sides.
pub fn symmetric(rng: &mut ChaCha8Rng) -> f64 {
    let sign = if rng.random_range(0.0..1.0) < 0.5 { -1.0 } else { 1.0 };
    sign * one_sided(rng)
}
/// Anything: wrong matches.
pub fn wild(rng: &mut ChaCha8Rng) -> f64 {
    8.0 * normal(rng)
}
/// All the same: a neighbour's magnitude, a wrong exposure time.
pub fn equal(_: &mut ChaCha8Rng) -> f64 {
    0.75
}

/// V_inst − V of a star without noise \[mag\].
pub fn truth(airmass: f64, b_v_mag: f64) -> f64 {
    TRUTH[0] + TRUTH[1] * airmass + TRUTH[2] * b_v_mag
}

/// `n` stars without noise in seven pointings; stated errors of 22 mmag times `scale`.
pub fn exact(n: usize, scale: f64) -> Vec<StarMeasurement> {
    let star = |i: usize| {
        let (airmass, b_v_mag) = (1.0 + 0.05 * (i % 19) as f64, 0.2 + 0.03 * (i % 23) as f64);
        let y = TRUTH[0] + TRUTH[1] * airmass + TRUTH[2] * b_v_mag;
        let v_mag = 10.0 + 0.01 * i as f64;
        StarMeasurement {
            inst_mag: v_mag + y,
            inst_err_mag: 0.01 * scale,
            v_mag,
            v_err_mag: 0.02 * scale,
            b_v_mag,
            b_v_err_mag: 0.0,
            airmass,
            pointing: i % 7,
            star: None,
        }
    };
    (0..n).map(star).collect()
}

impl Night {
    /// The measurements of the night with this seed.
    pub fn measure(&self, seed: u64) -> Vec<StarMeasurement> {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let pointings: Vec<(f64, f64)> =
            (0..self.pointings).map(|_| ((self.airmass)(rng), self.pointing_scatter_mag * normal(rng))).collect();
        let brightness = Beta::new(2.5, 1.2).unwrap();
        let star = |_| {
            let pointing = rng.random_range(0..self.pointings);
            let (airmass, cloud) = pointings[pointing];
            let b_v_mag = (self.colour)(rng, airmass);
            let v_mag = 10.0 + 5.0 * rng.sample(brightness);
            let inst_err_mag = 0.003_f64.hypot(0.02 * 10f64.powf(0.2 * (v_mag - 13.0)));
            let v_err_mag = self.catalogue_err_mag * (0.3 * normal(rng)).exp();
            let mut y = truth(airmass, b_v_mag) + cloud + inst_err_mag.hypot(v_err_mag) * normal(rng);
            if rng.random_range(0.0..1.0) < self.outliers {
                y += (self.outlier)(rng);
            }
            StarMeasurement {
                inst_mag: v_mag + y,
                inst_err_mag,
                v_mag,
                v_err_mag,
                b_v_mag,
                b_v_err_mag: 0.0,
                airmass,
                pointing,
                star: None,
            }
        };
        (0..self.stars).map(star).collect()
    }

    /// Fits `n` nights from `seed` on.
    pub fn fits(&self, n: u64, seed: u64, config: &Config) -> Fits {
        let one = |s: u64| fit(&self.measure(seed + s), config).ok();
        Fits::of(&(0..n).into_par_iter().map(one).collect::<Vec<_>>())
    }
}

/// How far a zeropoint's prediction is off \[mag\]: negative = it makes the target too bright.
pub fn off(z: &Zeropoint) -> f64 {
    z.v_mag(truth(AT.0, AT.1), AT.0, AT.1)
}

/// Many fits of the magnitude predicted at [`AT`].
#[derive(Debug, Clone)]
pub struct Fits {
    pub n: usize,
    pub refused: usize,
    /// Mean error \[mag\].
    pub bias: f64,
    /// Standard deviation of the error \[mag\].
    pub sd: f64,
    /// Mean quoted error \[mag\].
    pub quoted: f64,
    /// Share of the fits within the quoted error.
    pub cover: f64,
    /// Share within the error as the paper adds it.
    pub cover_as_published: f64,
    /// Shares of ZP, k and C within their errors.
    pub cover_terms: [f64; 3],
    /// Largest error \[mag\].
    pub worst: f64,
    /// Mean share of rejected stars.
    pub rejected: f64,
}

impl Fits {
    pub fn of(fits: &[Option<Zeropoint>]) -> Fits {
        let done: Vec<&Zeropoint> = fits.iter().flatten().collect();
        let m = done.len().max(1) as f64;
        let mean = |f: &dyn Fn(&Zeropoint) -> f64| done.iter().map(|z| f(z)).sum::<f64>() / m;
        let bias = mean(&off);
        let quoted = |z: &Zeropoint| z.err_mag(AT.0, AT.1, 0.0);
        let within = |e: &dyn Fn(&Zeropoint) -> f64| mean(&|z| f64::from(u8::from(off(z).abs() < e(z))));
        let term = |i: usize| {
            mean(&|z| {
                let found = [z.zp_mag, z.k_mag_airmass, z.c_mag_mag][i];
                f64::from(u8::from((found - TRUTH[i]).abs() < z.errs()[i]))
            })
        };
        Fits {
            n: fits.len(),
            refused: fits.len() - done.len(),
            bias,
            sd: mean(&|z| (off(z) - bias).powi(2)).sqrt(),
            quoted: mean(&quoted),
            cover: within(&quoted),
            cover_as_published: within(&Zeropoint::err_as_published_mag),
            cover_terms: [term(0), term(1), term(2)],
            worst: done.iter().map(|z| off(z).abs()).fold(0.0, f64::max),
            rejected: mean(&|z| z.n_rejected as f64 / (z.n_used + z.n_rejected) as f64),
        }
    }
}
