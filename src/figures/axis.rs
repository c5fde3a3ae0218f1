//! Axes: ranges that hold every point with room around it, and ticks at round numbers and round times.

/// A span of values on one axis, `from` at the left or bottom end; `from > to` is a reversed axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Span {
    /// Value at the left or bottom end.
    pub from: f64,
    /// Value at the right or top end.
    pub to: f64,
}

impl Span {
    /// The span of the finite values with 6 % of room, at least `least` wide; `None` without any value.
    pub(crate) fn around(values: impl IntoIterator<Item = f64>, least: f64) -> Option<Self> {
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
    pub(crate) fn reversed(self) -> Self {
        Span { from: self.to, to: self.from }
    }

    pub(crate) fn low(self) -> f64 {
        self.from.min(self.to)
    }

    pub(crate) fn high(self) -> f64 {
        self.from.max(self.to)
    }

    pub(crate) fn holds(self, value: f64) -> bool {
        (self.low()..=self.high()).contains(&value)
    }

    /// Round numbers inside, at most about `count` of them, and the decimals their labels need.
    pub(crate) fn ticks(self, count: usize) -> (Vec<f64>, usize) {
        let raw = (self.high() - self.low()) / count.max(1) as f64;
        let power = 10f64.powf(raw.log10().floor());
        let step = power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|s| s * power >= raw).unwrap_or(10.0);
        let decimals = (-(step * 1.000_001).log10().floor()).max(0.0) as usize;
        (multiples(self, step), decimals)
    }

    /// Round times inside, at most about `count` of them; the values are seconds.
    pub(crate) fn time_ticks(self, count: usize) -> Vec<f64> {
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
pub(crate) fn clock(seconds: f64) -> String {
    let s = (seconds.round() as i64).rem_euclid(86_400);
    format!("{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_holds_every_value_with_room_and_is_never_empty() {
        let span = Span::around([3.0, -1.0, f64::NAN], 0.5).unwrap();
        assert!(span.from < -1.0 && span.to > 3.0);
        for same in [0.0, 5.0, -1e9, 1e14] {
            let span = Span::around([same, same], 0.0);
            assert!(span.is_some_and(|s| s.to > s.from || same == 0.0), "{same}");
        }
        assert!(Span::around([7.0], 2.0).is_some_and(|s| s.to - s.from == 2.0));
        assert_eq!(Span::around([f64::NAN, f64::INFINITY], 1.0), None);
    }

    #[test]
    fn ticks_are_round_inside_and_neither_few_nor_many() {
        for (from, to) in [(0.0, 1.0), (16.2, 3.4), (-0.6, 0.8), (1e-6, 3e-6), (4e5, 4.1e5), (-23.3, -23.08)] {
            let span = Span { from, to };
            let (ticks, decimals) = span.ticks(6);
            assert!((2..=7).contains(&ticks.len()), "{from}..{to}: {ticks:?}");
            assert!(ticks.iter().all(|t| span.holds(*t)), "{ticks:?}");
            // A label of so many decimals is the tick itself, and no two labels are alike.
            let labels: Vec<String> = ticks.iter().map(|t| format!("{t:.decimals$}")).collect();
            let step = ticks[1] - ticks[0];
            assert!(labels.iter().zip(&ticks).all(|(l, t)| (l.parse::<f64>().unwrap() - t).abs() < 1e-6 * step));
            assert!(labels.windows(2).all(|pair| pair[0] != pair[1]), "{labels:?}");
        }
    }

    #[test]
    fn times_are_labelled_by_the_clock_past_midnight_too() {
        assert_eq!(clock(0.0), "00:00:00");
        assert_eq!(clock(38_582.4), "10:43:02");
        assert_eq!(clock(86_400.0 + 61.0), "00:01:01");
        assert_eq!(Span { from: 3.0, to: 200.0 }.time_ticks(5), [60.0, 120.0, 180.0]);
        assert!(Span { from: 0.0, to: 30.0 * 86_400.0 }.time_ticks(5).len() <= 6);
    }
}
