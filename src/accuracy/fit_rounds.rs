//! Rounds of the robust zeropoint fit: how far from converged it is, and what a round costs.
//!
//! The nights of [`super::zeropoint_fit`]; errors in magnitudes of the magnitude the fit predicts, against the converged fit.

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use super::zeropoint_fit::{AT, night};
use crate::base::error::Result;
use crate::config;
use crate::zeropoint::fit::{StarMeasurement, fit};

const ROUNDS: [usize; 8] = [1, 2, 4, 8, 16, 32, 64, config::Zeropoint::MAX_ROUNDS];

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let nights = stopwatch.effort.of(8, 100);
    let with = |stars: &[StarMeasurement], max_rounds: usize| {
        fit(stars, &config::Zeropoint { max_rounds, ..config::Zeropoint::default() })
    };
    let mut series = Vec::new();
    for (label, spoilt_frac) in [("clean", 0.0), ("10 % of the stars spoilt", 0.1), ("30 % of the stars spoilt", 0.3)] {
        let drawn: Vec<Vec<StarMeasurement>> =
            (0..nights).map(|k| night(stopwatch.seed(2000 + k), spoilt_frac)).collect();
        let mut converged = Vec::new();
        for stars in &drawn {
            converged.push(with(stars, 3000)?.v_mag(0.0, AT.0, AT.1));
        }
        let points = ROUNDS.into_iter().filter_map(|rounds| {
            // a fit that is refused before it has converged is as wrong as can be
            let off: Vec<f64> = (drawn.iter().zip(&converged))
                .map(|(stars, v)| with(stars, rounds).map_or(f64::INFINITY, |z| z.v_mag(0.0, AT.0, AT.1) - v))
                .collect();
            let few = &drawn[..drawn.len().min(3)];
            let us = cpu_us(stopwatch, || {
                few.iter().for_each(|stars| {
                    std::hint::black_box(with(stars, rounds).is_ok());
                });
            });
            Errors::of(&off).map(|errors| SweepPoint {
                setting: rounds.to_string(),
                errors,
                cpu_us: us / few.len() as f64,
                memory_kb: None,
                is_default: rounds == config::Zeropoint::MAX_ROUNDS,
            })
        });
        series.push(Series { label: label.into(), points: points.collect() });
    }
    Ok(Sweep {
        knob: "rounds at most",
        work: "one fit with its jackknives",
        error: "mag",
        reference: "3000 rounds at most",
        default_because: "a fit stops by itself when its terms stand still to 1e-12 mag; the bound is there for nights that never \
                          settle, and costs the others nothing",
        series,
    })
}
