//! Axes: ranges that hold every point with room around it, and ticks at round numbers and round times.

/// A span of values on one axis, `from` at the left or bottom end; `from > to` is a reversed axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    /// Value at the left or bottom end.
    pub from: f64,
    /// Value at the right or top end.
    pub to: f64,
}

impl Span {
    /// The span of the finite values with 6 % of room, at least `least` wide; `None` without any value.
    pub(super) fn around(values: impl IntoIterator<Item = f64>, least: f64) -> Option<Self> {
        let (lo, hi) = values
            .into_iter()
            .filter(|v| v.abs() < 1e15) // finite, and far from where widths overflow
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        if lo > hi {
            return None;
        }
        let half = (0.56 * (hi - lo)).max(0.5 * least).max(1e-9 * lo.abs().max(hi.abs()));
        let centre = 0.5 * (lo + hi);
        Some(Span { from: centre - half, to: centre + half })
    }

    /// The same values the other way round.
    pub(super) fn reversed(self) -> Self {
        Span { from: self.to, to: self.from }
    }

    pub(super) fn low(self) -> f64 {
        self.from.min(self.to)
    }

    pub(super) fn high(self) -> f64 {
        self.from.max(self.to)
    }

    pub(super) fn holds(self, value: f64) -> bool {
        (self.low()..=self.high()).contains(&value)
    }

    /// Round numbers inside, at most about `count` of them, and the decimals their labels need.
    pub(super) fn ticks(self, count: usize) -> (Vec<f64>, usize) {
        let raw = (self.high() - self.low()) / count.max(1) as f64;
        let power = 10f64.powf(raw.log10().floor());
        let step = power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|s| s * power >= raw).unwrap_or(10.0);
        let decimals = (-(step * 1.000_001).log10().floor()).max(0.0) as usize;
        (multiples(self, step), decimals)
    }

    /// Round times inside, at most about `count` of them; the values are seconds.
    pub(super) fn time_ticks(self, count: usize) -> Vec<f64> {
        const STEPS_S: [f64; 17] = [
            1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0, 10800.0,
            14400.0, 21600.0,
        ];
        let raw = (self.high() - self.low()) / count.max(1) as f64;
        let step = STEPS_S.into_iter().find(|s| *s >= raw).unwrap_or((raw / 86_400.0).ceil() * 86_400.0);
        multiples(self, step)
    }
}

fn multiples(span: Span, step: f64) -> Vec<f64> {
    let first = (span.low() / step).ceil();
    let count = ((span.high() / step).floor() - first).clamp(-1.0, 100.0) as i64 + 1;
    // + 0.0 turns a negative zero into zero, whose label has no sign.
    (0..count).map(|i| (first + i as f64) * step + 0.0).collect()
}

/// `hh:mm:ss` of seconds since midnight.
pub(super) fn clock(seconds: f64) -> String {
    let s = (seconds.round() as i64).rem_euclid(86_400);
    format!("{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}
