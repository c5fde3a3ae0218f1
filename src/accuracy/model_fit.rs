//! A law of the phase angle fitted to simulated passes: its degree, and how many passes there are.
//!
//! Magnitudes at 1000 km of a truth that is no polynomial, a diffuse sphere with a broad glint; passes with offsets and tails as SCORE's of
//! Starlink V2 minis. The error is that of the law against the truth, over the phase angles of the data.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, StudentT};

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::error::{Error, Result};
use crate::fitting::{Observation, phase_law};

const DEGREES: [usize; 6] = [0, 1, 2, 3, 4, 5];
/// `satphot fit --degree` without a value.
const DEFAULT_DEGREE: usize = 2;
const PASSES: [usize; 3] = [20, 80, 320];
/// Phase angles of the data \[deg\].
const PHASE_DEG: [f64; 2] = [35.0, 120.0];
const BETWEEN_MAG: f64 = 0.36;
const WITHIN_MAG: f64 = 0.1;
const ERR_MAG: f64 = 0.05;
/// Phase angles at which the law is compared.
const GRID: usize = 18;

/// A sphere of magnitude 6 at full phase, with a glint about 65 deg that doubles its light.
fn truth_mag(phase_deg: f64) -> f64 {
    let phase_rad = phase_deg.to_radians();
    let diffuse = (phase_rad.sin() + (std::f64::consts::PI - phase_rad) * phase_rad.cos()) / std::f64::consts::PI;
    let glint = 0.5 * (-((phase_deg - 65.0) / 18.0).powi(2)).exp();
    6.0 - 2.5 * (diffuse + glint).log10()
}

/// Passes of 3 to 20 magnitudes.
fn drawn(passes: usize, seed: u64) -> Result<Vec<Observation>> {
    let words = |e: String| Error::Model { problem: e };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let normal = Normal::new(0.0, 1.0).map_err(|e| words(e.to_string()))?;
    let student = StudentT::new(4.0).map_err(|e| words(e.to_string()))?;
    let mut rows = Vec::new();
    for pass in 0..passes {
        let offset = BETWEEN_MAG * normal.sample(&mut rng);
        let width = rng.random_range(10.0..35.0);
        let from = rng.random_range(PHASE_DEG[0]..PHASE_DEG[1] - width);
        for _ in 0..rng.random_range(3..20) {
            let phase_deg = from + width * rng.random::<f64>();
            let noise = offset + WITHIN_MAG * student.sample(&mut rng) + ERR_MAG * normal.sample(&mut rng);
            let mag = truth_mag(phase_deg) + noise;
            rows.push(Observation {
                row: rows.len(),
                mag_1000km: mag,
                v_mag: mag,
                err_mag: ERR_MAG,
                is_limit: false,
                phase_deg,
                sun_alt_sat_deg: None,
                range_km: 1000.0,
                mjd_d: None,
                pass,
                satellite: pass,
                table: 0,
            });
        }
    }
    Ok(rows)
}

/// The law less the truth over the phase angles.
fn off(rows: &[Observation], degree: usize) -> Vec<f64> {
    let Ok(problem) = phase_law(rows, [degree, 0], &[]) else { return vec![f64::INFINITY] };
    let at = |k: usize| PHASE_DEG[0] + (PHASE_DEG[1] - PHASE_DEG[0]) * k as f64 / (GRID - 1) as f64;
    let law = |phase_deg: f64| problem.fit.theta.iter().rev().fold(0.0, |sum, c| sum * phase_deg + c);
    (0..GRID).map(|k| law(at(k)) - truth_mag(at(k))).collect()
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let sets = stopwatch.effort.of(3, 30);
    let mut series = Vec::new();
    for passes in PASSES {
        let data: Vec<Vec<Observation>> =
            (0..sets).map(|k| drawn(passes, stopwatch.seed(7000 + k))).collect::<Result<_>>()?;
        let point = |degree: usize| {
            let errors: Vec<f64> = data.iter().flat_map(|rows| off(rows, degree)).collect();
            let us = cpu_us(stopwatch, || {
                std::hint::black_box(phase_law(&data[0], [degree, 0], &[]).is_ok());
            });
            Errors::of(&errors).map(|errors| SweepPoint {
                setting: degree.to_string(),
                errors,
                cpu_us: us,
                memory_kb: None,
                is_default: degree == DEFAULT_DEGREE,
            })
        };
        series.push(Series {
            label: format!("{passes} passes"),
            points: DEGREES.into_iter().filter_map(point).collect(),
        });
    }
    Ok(Sweep {
        knob: "degree",
        work: "one fit with its five of fewer satellites",
        error: "mag",
        reference: "the truth that was put in",
        default_because: "the passes of a season tell no more: a higher degree follows their offsets, and its ends run away; with hundreds \
                          of passes it is worth trying 3",
        series,
    })
}
