//! Sun and Moon between the steps of a grid in time: error and cost against computing them again for every row.
//!
//! Directions in Earth-fixed axes, errors in arcsec, the worse of Sun and Moon. Linear, or cubic through four steps.
//! The reference is [`bodies`] at the very moment.

use hifitime::{Duration, Epoch};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::constants::ARCSEC_PER_RAD;
use crate::base::error::Result;
use crate::orbit::{EarthOrientation, SkyBodies, bodies};

/// Step \[s\] and points of the interpolation.
const GRIDS: [(f64, usize); 7] = [(10.0, 2), (60.0, 2), (300.0, 2), (300.0, 4), (1200.0, 4), (3600.0, 2), (3600.0, 4)];

struct Grid {
    start: Epoch,
    step_s: f64,
    points: usize,
    nodes: Vec<SkyBodies>,
}

impl Grid {
    fn new(start: Epoch, span_s: f64, (step_s, points): (f64, usize)) -> Result<Self> {
        // cubic: one step more on both sides
        let margin = points / 2 - 1;
        let start = start - Duration::from_seconds(margin as f64 * step_s);
        let n = (span_s / step_s).ceil() as usize + points;
        let at = |k: usize| bodies(&(start + Duration::from_seconds(k as f64 * step_s)), &EarthOrientation::default());
        Ok(Self { start, step_s, points, nodes: (0..n).map(at).collect::<Result<_>>()? })
    }

    /// Lagrange through the nearest steps.
    fn at(&self, epoch: &Epoch) -> SkyBodies {
        let u = (*epoch - self.start).to_seconds() / self.step_s;
        let first = (u as usize).saturating_sub(self.points / 2 - 1).min(self.nodes.len() - self.points);
        let t = u - first as f64;
        let mut sum = SkyBodies {
            sun_itrs_km: self.nodes[first].sun_itrs_km * 0.0,
            moon_itrs_km: self.nodes[first].sun_itrs_km * 0.0,
        };
        for i in 0..self.points {
            let factor = |j: usize| (t - j as f64) / (i as f64 - j as f64);
            let weight: f64 = (0..self.points).filter(|j| *j != i).map(factor).product();
            let node = &self.nodes[first + i];
            sum.sun_itrs_km = sum.sun_itrs_km + node.sun_itrs_km * weight;
            sum.moon_itrs_km = sum.moon_itrs_km + node.moon_itrs_km * weight;
        }
        sum
    }
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let eop = EarthOrientation::default();
    let mut series = Vec::new();
    for (label, span_s, row_s) in
        [("a pass of 10 min, rows of 5 s", 600.0, 5.0), ("a day, rows of 60 s", 86_400.0, 60.0)]
    {
        let mut rng = ChaCha12Rng::seed_from_u64(stopwatch.seed(23));
        let starts: Vec<Epoch> = (0..stopwatch.effort.of(2, 12))
            .map(|_| Epoch::from_mjd_utc(60_676.0) + Duration::from_days(rng.random_range(0.0..365.0)))
            .collect();
        let rows = (span_s / row_s) as usize;
        let moment = |start: &Epoch, k: usize| *start + Duration::from_seconds(k as f64 * row_s);
        let few = rows.min(stopwatch.effort.of(120, 600));
        let seen: Vec<usize> = (0..few).map(|k| k * rows / few).collect();
        let mut points = Vec::new();
        let mut exact = Vec::new();
        for start in &starts {
            exact.push(seen.iter().map(|k| bodies(&moment(start, *k), &eop)).collect::<Result<Vec<_>>>()?);
        }
        let exact_us = cpu_us(stopwatch, || {
            seen.iter().for_each(|k| {
                std::hint::black_box(bodies(&moment(&starts[0], *k), &eop).is_ok());
            });
        });
        let none = vec![0.0; few * starts.len()];
        points.extend(Errors::of(&none).map(|errors| SweepPoint {
            setting: "none".into(),
            errors,
            cpu_us: exact_us / few as f64,
            memory_kb: Some(0.0),
            is_default: true,
        }));
        // a grid finer than the rows is not a grid
        for grid in GRIDS.into_iter().filter(|grid| grid.0 > row_s) {
            let mut off = Vec::new();
            for (start, exact) in starts.iter().zip(&exact) {
                let table = Grid::new(*start, span_s, grid)?;
                for (k, exact) in seen.iter().zip(exact) {
                    let got = table.at(&moment(start, *k));
                    let sun = got.sun_itrs_km.angle_to(&exact.sun_itrs_km);
                    off.push(ARCSEC_PER_RAD * sun.max(got.moon_itrs_km.angle_to(&exact.moon_itrs_km)));
                }
            }
            // a grid is made once, and requested every row
            let nodes = Grid::new(starts[0], span_s, grid)?.nodes.len();
            let us = cpu_us(stopwatch, || {
                if let Ok(table) = Grid::new(starts[0], span_s, grid) {
                    (0..rows).for_each(|k| {
                        std::hint::black_box(table.at(&moment(&starts[0], k)));
                    });
                }
            });
            let setting = format!("{} s {}", grid.0, if grid.1 == 2 { "linear" } else { "cubic" });
            let memory_kb = Some((nodes * size_of::<SkyBodies>()) as f64 / 1024.0);
            points.extend(Errors::of(&off).map(|errors| SweepPoint {
                setting,
                errors,
                cpu_us: us / rows as f64,
                memory_kb,
                is_default: false,
            }));
        }
        series.push(Series { label: label.into(), points });
    }
    Ok(Sweep {
        knob: "interpolation",
        work: "Sun and Moon for one row, the grid's share included",
        error: "arcsec",
        reference: "Sun and Moon computed for the very moment",
        default_because: "none: Sun and Moon are half the time of a row, so a pass of 120 rows would gain a hundredth of a \
                          second; every row would depend on where the grid begins. A cubic of 300 s (0.0004 arcsec) is what to \
                          take where millions of rows are wanted",
        series,
    })
}
