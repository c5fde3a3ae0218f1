//! The zeropoint fit: error of the magnitude it predicts, and cost, by estimator and by what spoils the stars.
//!
//! Nights of 321 stars in 21 pointings, airmass 1.03 to 2.03, catalogue errors 0.05 mag, pointings that scatter by 0.03
//! mag (the geometry of Caddy et al.). The reference is the zeropoint the stars were drawn with.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::error::Result;
use crate::config::{self, Estimator};
use crate::zeropoint::fit::{StarMeasurement, fit};

/// ZP, k and C that are put in.
const TRUTH: [f64; 3] = [-23.37, 0.12, 0.08];
/// Airmass and B−V of the magnitude that is predicted.
pub(super) const AT: (f64, f64) = (1.4, 0.65);
const STARS: usize = 321;
const POINTINGS: usize = 21;

/// V_inst − V without noise.
fn line(airmass: f64, b_v_mag: f64) -> f64 {
    TRUTH[0] + TRUTH[1] * airmass + TRUTH[2] * b_v_mag
}

/// One night; a share of the stars is too faint by 0.8 mag or so, as saturated or blended ones are.
pub(super) fn night(seed: u64, spoilt_frac: f64) -> Vec<StarMeasurement> {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let normal = |rng: &mut ChaCha12Rng| -> f64 { rng.sample(StandardNormal) };
    let pointings: Vec<(f64, f64)> =
        (0..POINTINGS).map(|_| (rng.random_range(1.03..2.03), 0.03 * normal(&mut rng))).collect();
    (0..STARS)
        .map(|star| {
            let pointing = star % POINTINGS;
            let (airmass, cloud_mag) = pointings[pointing];
            let (b_v_mag, v_mag) = (rng.random_range(0.2..0.9), rng.random_range(10.0..14.5));
            let inst_err_mag = 0.003f64.hypot(0.02 * 10f64.powf(0.2 * (v_mag - 13.0)));
            let v_err_mag = 0.05 * (0.3 * normal(&mut rng)).exp();
            let mut y = line(airmass, b_v_mag) + cloud_mag + inst_err_mag.hypot(v_err_mag) * normal(&mut rng);
            if rng.random_range(0.0..1.0) < spoilt_frac {
                y += (0.8 + 0.6 * normal(&mut rng)).abs();
            }
            let inst_mag = v_mag + y;
            StarMeasurement {
                inst_mag,
                inst_err_mag,
                v_mag,
                v_err_mag,
                b_v_mag,
                b_v_err_mag: 0.0,
                airmass,
                pointing,
                star: None,
            }
        })
        .collect()
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let default = config::Zeropoint::default().estimator;
    let nights = stopwatch.effort.of(40, 1000);
    let estimators = [
        ("ols", Estimator::Ols),
        ("huber", Estimator::Huber),
        ("clip", Estimator::Clip),
        ("robust", Estimator::Robust),
    ];
    let mut series = Vec::new();
    for (label, spoilt_frac) in [("clean", 0.0), ("10 % of the stars spoilt", 0.1), ("30 % of the stars spoilt", 0.3)] {
        let drawn: Vec<Vec<StarMeasurement>> =
            (0..nights).map(|k| night(stopwatch.seed(1000 + k), spoilt_frac)).collect();
        let mut points = Vec::new();
        for (setting, estimator) in estimators {
            let config = config::Zeropoint { estimator, ..config::Zeropoint::default() };
            let (truth, of) = (line(AT.0, AT.1), |stars: &[StarMeasurement]| fit(stars, &config));
            // a fit that is refused has no error: it is reported, and excluded here
            let off: Vec<f64> = drawn
                .iter()
                .filter_map(|stars| of(stars).ok())
                .map(|zeropoint| -zeropoint.v_mag(0.0, AT.0, AT.1) - truth)
                .collect();
            let few = &drawn[..drawn.len().min(8)];
            let us = cpu_us(stopwatch, || {
                for stars in few {
                    std::hint::black_box(of(stars).is_ok());
                }
            });
            points.extend(Errors::of(&off).map(|errors| SweepPoint {
                setting: setting.into(),
                errors,
                cpu_us: us / few.len() as f64,
                memory_kb: None,
                is_default: estimator == default,
            }));
        }
        series.push(Series { label: label.into(), points });
    }
    Ok(Sweep {
        knob: "zeropoint.estimator",
        work: "one fit with its jackknives",
        error: "mag",
        reference: "the zeropoint put in, at airmass 1.4 and B-V 0.65",
        default_because: "robust and clip hold where a third of the stars are spoilt; robust needs no cut to be chosen, and a night is \
                          fitted once",
        series,
    })
}
