//! One knob turned: for each setting the errors over many cases and what a case costs.

use super::effort::Effort;
use super::effort::Stopwatch;

/// CPU time of one setting is measured over at least this long \[s\].
const LEAST_S: (f64, f64) = (0.02, 0.3);

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
        Some(Self { median: *sizes.get(rank(0.5))?, p95: *sizes.get(rank(0.95))?, worst: *sizes.last()?, n })
    }
}

/// One setting of the knob.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPoint {
    /// The setting as a user would write it.
    pub setting: String,
    /// How wrong it is.
    pub errors: Errors,
    /// CPU time of one piece of work \[µs\].
    pub cpu_us: f64,
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

impl Series {
    /// Which points no other point beats in both the 95 % error and CPU time. A point within 5 % of another's time is
    /// not beaten by time, and errors below 1e-15 are all the same.
    #[must_use]
    pub fn on_front(&self) -> Vec<bool> {
        let error = |p: &SweepPoint| p.errors.p95.max(1e-15);
        let beats = |a: &SweepPoint, b: &SweepPoint| {
            (error(a) < error(b) && a.cpu_us <= 1.05 * b.cpu_us) || (error(a) <= error(b) && 1.05 * a.cpu_us < b.cpu_us)
        };
        self.points.iter().map(|p| !self.points.iter().any(|other| beats(other, p))).collect()
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
    /// Where the default stands: on the front, or what beats it, in how many situations; and why it is the default.
    #[must_use]
    pub fn standing(&self) -> String {
        let mut behind = Vec::new();
        let mut n = 0;
        for series in &self.series {
            let front = series.on_front();
            let Some(k) = series.points.iter().position(|p| p.is_default) else { continue };
            n += 1;
            if front[k] {
                continue;
            }
            let own = &series.points[k];
            let beats = |p: &&SweepPoint| p.errors.p95 <= own.errors.p95.max(1e-15) && p.cpu_us < own.cpu_us;
            let best = series.points.iter().filter(beats).min_by(|a, b| a.cpu_us.total_cmp(&b.cpu_us));
            let by = best.map_or("another".to_string(), |p| {
                format!("{} takes {:.0} % of its time", p.setting, 100.0 * p.cpu_us / own.cpu_us)
            });
            behind.push(format!("{} ({by})", series.label));
        }
        let on = format!("on the front in {} of {n}", n - behind.len());
        let behind = if behind.is_empty() { String::new() } else { format!("; behind it: {}", behind.join(", ")) };
        format!("{on}{behind}; {}", self.default_because)
    }
}

/// CPU time of one call \[µs\]: repeated until the clock's steps do not matter.
pub(super) fn cpu_us(stopwatch: &Stopwatch, mut work: impl FnMut()) -> f64 {
    let least_s = match stopwatch.effort {
        Effort::Quick => LEAST_S.0,
        Effort::Full => LEAST_S.1,
    };
    let (mut calls, mut batch) = (0.0, 1);
    let start = (stopwatch.cpu_s)();
    loop {
        for _ in 0..batch {
            work();
        }
        calls += f64::from(batch);
        let used_s = (stopwatch.cpu_s)() - start;
        if used_s >= least_s {
            return 1e6 * used_s / calls;
        }
        batch = (2 * batch).min(1 << 20);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(p95: f64, cpu_us: f64) -> SweepPoint {
        let errors = Errors { median: p95, p95, worst: p95, n: 1 };
        SweepPoint { setting: String::new(), errors, cpu_us, memory_kb: None, is_default: false }
    }

    #[test]
    fn the_front_holds_what_nothing_beats_in_both() {
        let points = vec![point(1e-2, 1.0), point(1e-3, 2.0), point(1e-3, 3.0), point(1e-2, 1.02), point(1e-6, 9.0)];
        let series = Series { label: String::new(), points };
        assert_eq!(series.on_front(), [true, true, false, true, true]);
    }

    #[test]
    fn the_standing_of_a_default_names_what_beats_it() {
        let series = |points: Vec<SweepPoint>, label: &str| Series { label: label.into(), points };
        let default = |p95, us| SweepPoint { is_default: true, ..point(p95, us) };
        let best = SweepPoint { setting: "quicker".into(), ..point(1e-3, 2.0) };
        let sweep = Sweep {
            knob: "knob",
            work: "work",
            error: "relative",
            reference: "truth",
            default_because: "it is",
            series: vec![
                series(vec![default(1e-3, 4.0), best], "behind"),
                series(vec![default(1e-6, 9.0), point(1e-3, 2.0)], "on it"),
                series(vec![point(1.0, 1.0)], "somebody else's"),
            ],
        };
        let standing = sweep.standing();
        assert_eq!(standing, "on the front in 1 of 2; behind it: behind (quicker takes 50 % of its time); it is");
    }

    #[test]
    fn errors_are_ranks_of_their_sizes_and_what_is_not_a_number_is_the_worst() {
        let hundred: Vec<f64> = (1..=100).map(|k| if k % 2 == 0 { f64::from(k) } else { -f64::from(k) }).collect();
        let of = Errors::of(&hundred).unwrap();
        assert_eq!((of.median, of.p95, of.worst, of.n), (50.0, 95.0, 100.0, 100));
        assert_eq!(Errors::of(&[1.0, f64::NAN]).unwrap().worst, f64::INFINITY);
        assert_eq!(Errors::of(&[]), None);
    }
}
