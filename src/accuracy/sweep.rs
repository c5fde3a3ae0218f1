//! One knob turned: for each setting the errors over many cases and what a case costs.

use super::timing::CpuTime;
pub(super) use super::timing::{cpu_us, timed};
use crate::base::stats::mean_and_sd;

/// How wrong a setting is over its cases, in absolute value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Half of the cases are better.
    pub median: f64,
    /// 95 of 100 cases are better.
    pub p95: f64,
    /// The worst case.
    pub worst: f64,
    /// Cases.
    pub n: usize,
    /// Mean of the errors, signed where an error has a sign; `None` where a case is not finite or there is only one.
    pub bias: Option<f64>,
    /// Standard deviation about it.
    pub scatter: Option<f64>,
    /// Share of the cases whose error is within the stated 1-sigma error; `None` where none is stated.
    pub coverage_frac: Option<f64>,
}

impl Errors {
    /// Of signed errors; a case that is not finite makes the worst infinite. `None` without a case.
    #[must_use]
    pub fn of(errors: &[f64]) -> Option<Self> {
        let size = |e: &f64| if e.is_finite() { e.abs() } else { f64::INFINITY };
        let mut sizes: Vec<f64> = errors.iter().map(size).collect();
        sizes.sort_by(f64::total_cmp);
        let n = sizes.len();
        let rank = |share: f64| ((share * n as f64).ceil() as usize).clamp(1, n.max(1)) - 1;
        let finite = n > 1 && errors.iter().all(|e| e.is_finite());
        let (bias, scatter) = mean_and_sd(errors);
        Some(Self {
            median: *sizes.get(rank(0.5))?,
            p95: *sizes.get(rank(0.95))?,
            worst: *sizes.last()?,
            n,
            bias: finite.then_some(bias),
            scatter: finite.then_some(scatter),
            coverage_frac: None,
        })
    }

    /// Of signed errors with the 1-sigma error that was stated for each.
    #[must_use]
    pub fn with_stated(errors: &[(f64, f64)]) -> Option<Self> {
        let signed: Vec<f64> = errors.iter().map(|(error, _)| *error).collect();
        let held = errors.iter().filter(|(error, stated)| error.abs() <= *stated).count();
        Some(Self { coverage_frac: Some(held as f64 / errors.len() as f64), ..Self::of(&signed)? })
    }
}

/// One setting of the knob.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPoint {
    /// The setting as a user would write it.
    pub setting: String,
    /// How wrong it is.
    pub errors: Errors,
    /// CPU time of one piece of work.
    pub cpu_us: CpuTime,
    /// Memory of one piece of work \[kB\], where it depends on the knob.
    pub memory_kb: Option<f64>,
    /// Whether satphot takes this setting by default.
    pub is_default: bool,
}

/// The settings of one knob in one situation (a scattering law, an aperture).
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The situation.
    pub label: String,
    /// Its settings, in the order they were tried.
    pub points: Vec<SweepPoint>,
}

/// Where a setting stands among the others of its series, in the 95 % error and CPU time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Every setting that is as accurate takes more time, beyond the errors of the times.
    Front,
    /// Another is as accurate and takes as much time, as far as the times can tell.
    Level,
    /// Another is as accurate and takes less time, beyond the errors of the times.
    Behind,
}

impl Place {
    /// As it is written in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Place::Front => "front",
            Place::Level => "level",
            Place::Behind => "behind",
        }
    }
}

/// Whether the first is at least as accurate as the second, in nearly all cases and in the worst; errors below 1e-15 are all the
/// same.
fn as_accurate(a: &SweepPoint, b: &SweepPoint) -> bool {
    a.errors.p95 <= b.errors.p95.max(1e-15) && a.errors.worst <= b.errors.worst.max(1e-15)
}

/// Where each of these points stands among them.
pub(super) fn places(points: &[&SweepPoint]) -> Vec<Place> {
    let place = |(k, p): (usize, &&SweepPoint)| {
        let mut place = Place::Front;
        for (_, other) in points.iter().enumerate().filter(|(i, other)| *i != k && as_accurate(other, p)) {
            if other.cpu_us.is_below(&p.cpu_us) {
                return Place::Behind;
            }
            if !p.cpu_us.is_below(&other.cpu_us) {
                place = Place::Level;
            }
        }
        place
    };
    points.iter().enumerate().map(place).collect()
}

impl Series {
    /// Where each setting stands among those of the series.
    #[must_use]
    pub fn places(&self) -> Vec<Place> {
        places(&self.points.iter().collect::<Vec<_>>())
    }
}

/// One method's knob, turned in every situation.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// The knob, e.g. `tolerance`.
    pub knob: &'static str,
    /// What one piece of work is, e.g. `one integral`.
    pub work: &'static str,
    /// What the error is: `relative`, or its unit.
    pub error: &'static str,
    /// What it is measured against.
    pub reference: &'static str,
    /// Why the default is what it is.
    pub default_because: &'static str,
    /// The situations.
    pub series: Vec<Series>,
}

impl Sweep {
    /// The default, where all series have one and the same measured point of it: settings of one system.
    #[must_use]
    pub fn common_default(&self) -> Option<&SweepPoint> {
        let mut defaults = self.series.iter().map(|s| s.points.iter().find(|p| p.is_default));
        let first = defaults.next()??;
        let same = |p: Option<&SweepPoint>| p.is_some_and(|p| p.errors == first.errors && p.cpu_us == first.cpu_us);
        (self.series.len() > 1 && defaults.all(same)).then_some(first)
    }

    /// Where the default stands: on the front, level with another, or what beats it, in how many situations; and why it is
    /// the default.
    #[must_use]
    pub fn standing(&self) -> String {
        let (mut behind, mut level) = (Vec::new(), 0);
        let mut n = 0;
        for series in &self.series {
            let Some(k) = series.points.iter().position(|p| p.is_default) else { continue };
            n += 1;
            match series.places()[k] {
                Place::Front => continue,
                Place::Level => {
                    level += 1;
                    continue;
                }
                Place::Behind => {}
            }
            let own = &series.points[k];
            let beats = |p: &&SweepPoint| as_accurate(p, own) && p.cpu_us.is_below(&own.cpu_us);
            let best =
                series.points.iter().filter(beats).min_by(|a, b| a.cpu_us.median_us.total_cmp(&b.cpu_us.median_us));
            let by = best.map_or("another".to_string(), |p| {
                format!("{} takes {:.0} % of its time", p.setting, 100.0 * p.cpu_us.median_us / own.cpu_us.median_us)
            });
            behind.push(format!("{} ({by})", series.label));
        }
        let on = format!("on the front in {} of {n}", n - level - behind.len());
        let level = if level == 0 { String::new() } else { format!(", level with another setting in {level}") };
        let behind = if behind.is_empty() { String::new() } else { format!(", behind in: {}", behind.join(", ")) };
        format!("{on}{level}{behind}; {}", self.default_because)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha12Rng;
    use rand_distr::StandardNormal;

    fn timed_point(p95: f64, cpu_us: CpuTime) -> SweepPoint {
        let errors = Errors { p95, ..Errors::of(&[p95]).unwrap() };
        SweepPoint { setting: String::new(), errors, cpu_us, memory_kb: None, is_default: false }
    }

    fn point(p95: f64, cpu_us: f64) -> SweepPoint {
        timed_point(p95, CpuTime::once(cpu_us))
    }

    #[test]
    fn the_front_holds_what_nothing_as_accurate_is_faster_than() {
        let points = vec![point(1e-2, 1.0), point(1e-3, 2.0), point(1e-3, 3.0), point(1e-1, 1.02), point(1e-6, 9.0)];
        let series = Series { label: String::new(), points };
        assert_eq!(series.places(), [Place::Front, Place::Front, Place::Behind, Place::Level, Place::Front]);
    }

    /// One run of a sweep: repeats of a time with noise of some per cent, a tenth of them disturbed by half of the time, and
    /// one factor for each setting that stays the same for the whole run.
    fn run(rng: &mut ChaCha12Rng, truth: &[(f64, f64)], repeats: usize) -> Series {
        let mut one = |(p95, us): &(f64, f64)| {
            let of_run = 1.0 + 0.01 * rng.sample::<f64, _>(StandardNormal);
            let mut repeat = || {
                let noise: f64 = 1.0 + 0.03 * rng.sample::<f64, _>(StandardNormal).abs();
                us * of_run * noise * if rng.random_range(0.0..1.0) < 0.1 { 1.5 } else { 1.0 }
            };
            let measured: Vec<f64> = (0..repeats).map(|_| repeat()).collect();
            timed_point(*p95, CpuTime::of(&measured).unwrap())
        };
        Series { label: String::new(), points: truth.iter().map(&mut one).collect() }
    }

    #[test]
    fn two_runs_do_not_contradict_each_other_and_agree_where_times_are_apart() {
        let mut rng = ChaCha12Rng::seed_from_u64(90);
        for repeats in [3, 7, 15] {
            let (mut contradict, mut medians_contradict, mut wrong, mut apart, mut equal_told) = (0, 0, 0, 0, 0);
            let sets = 2_000;
            for set in 0..sets {
                // every other set has times that are all the same, or at least 1.35 times apart
                let steps: Vec<f64> = (0..5).map(|_| rng.random_range(0.0..1.0)).collect();
                let mut us = 100.0;
                let truth: Vec<(f64, f64)> = steps
                    .iter()
                    .map(|step| {
                        us *= match set % 3 {
                            0 => 1.0,
                            1 => 1.35 + step,
                            _ => 1.0 + 0.3 * step,
                        };
                        (10f64.powi(-rng.random_range(0..4)), us)
                    })
                    .collect();
                let exact: Vec<SweepPoint> = truth.iter().map(|(e, us)| point(*e, *us)).collect();
                let exact = Series { label: String::new(), points: exact }.places();
                let (a, b) = (run(&mut rng, &truth, repeats), run(&mut rng, &truth, repeats));
                let definite = |x: &Place, y: &Place| {
                    matches!((x, y), (Place::Front, Place::Behind) | (Place::Behind, Place::Front))
                };
                let count = |a: &[Place], b: &[Place]| a.iter().zip(b).filter(|(x, y)| definite(x, y)).count();
                contradict += count(&a.places(), &b.places());
                let bare = |s: &Series| {
                    let points: Vec<SweepPoint> = (s.points.iter())
                        .map(|p| SweepPoint { cpu_us: CpuTime::once(p.cpu_us.median_us), ..p.clone() })
                        .collect();
                    // as if the median had no error at all
                    let faster = |q: &SweepPoint, p: &SweepPoint| q.cpu_us.median_us < p.cpu_us.median_us;
                    (points.iter())
                        .map(|p| {
                            let beaten = points.iter().any(|q| q.errors.p95 <= p.errors.p95 && faster(q, p));
                            if beaten { Place::Behind } else { Place::Front }
                        })
                        .collect::<Vec<_>>()
                };
                medians_contradict += count(&bare(&a), &bare(&b));
                match set % 3 {
                    0 => equal_told += a.places().iter().filter(|p| **p == Place::Behind).count(),
                    1 => {
                        apart += exact.len();
                        wrong += a.places().iter().zip(&exact).filter(|(x, y)| x != y).count();
                    }
                    _ => {}
                }
            }
            // all of three repeats are disturbed once in a thousand, most of seven or more never
            let most = if repeats == 3 { 5 * sets / 1000 } else { 0 };
            assert!(contradict <= most, "{repeats} repeats: {contradict}");
            assert!(
                medians_contradict > 500,
                "{medians_contradict}: the noise of this test is too small to mean anything"
            );
            assert!(equal_told * 200 < 5 * sets / 3, "{repeats} repeats: {equal_told}");
            // with few repeats one that is disturbed widens the interval over a real difference: level, never the contrary
            let (few, allowed) = (repeats < 15, 0.05 * apart as f64);
            assert!(few || (wrong as f64) < allowed, "{repeats} repeats: {wrong} of {apart}");
        }
    }

    #[test]
    fn the_standing_of_a_default_names_what_beats_it() {
        let series = |points: Vec<SweepPoint>, label: &str| Series { label: label.into(), points };
        let default = |p95, us| SweepPoint { is_default: true, ..point(p95, us) };
        let best = SweepPoint { setting: "quicker".into(), ..point(1e-3, 2.0) };
        let mut sweep = Sweep {
            knob: "knob",
            work: "work",
            error: "relative",
            reference: "truth",
            default_because: "it is",
            series: vec![
                series(vec![default(1e-3, 4.0), best], "behind"),
                series(vec![default(1e-6, 9.0), point(1e-3, 2.0)], "on it"),
                series(vec![default(1e-6, 9.0), point(1e-7, 9.1)], "as good"),
                series(vec![point(1.0, 1.0)], "somebody else's"),
            ],
        };
        assert_eq!(
            sweep.standing(),
            "on the front in 1 of 3, level with another setting in 1, behind in: behind (quicker takes 50 % of its time); it is"
        );
        assert_eq!(sweep.common_default(), None);
        sweep.series =
            vec![series(vec![default(1e-3, 4.0), point(1.0, 1.0)], "a"), series(vec![default(1e-3, 4.0)], "b")];
        assert_eq!(sweep.common_default().map(|p| p.cpu_us.median_us), Some(4.0));
    }

    #[test]
    fn errors_are_ranks_of_their_sizes_and_what_is_not_a_number_is_the_worst() {
        let hundred: Vec<f64> = (1..=100).map(|k| if k % 2 == 0 { f64::from(k) } else { -f64::from(k) }).collect();
        let of = Errors::of(&hundred).unwrap();
        assert_eq!((of.median, of.p95, of.worst, of.n), (50.0, 95.0, 100.0, 100));
        // the mean of 50 pairs of neighbours, half of one apart
        assert_eq!((of.bias, of.coverage_frac), (Some(0.5), None));
        let bad = Errors::of(&[1.0, f64::NAN]).unwrap();
        assert_eq!((bad.worst, bad.bias), (f64::INFINITY, None));
        assert_eq!(Errors::of(&[]), None);
        let stated = Errors::with_stated(&[(1.0, 1.0), (-2.0, 1.0), (0.5, 1.0), (f64::NAN, 1.0)]).unwrap();
        assert_eq!(stated.coverage_frac, Some(0.5));
    }
}
