//! `P(D) = ∫ f(D) D dD`, tabulated: Chebyshev series on panels that grow with D.
//!
//! f in 1/sr, D dimensionless. A panel a factor of two wide is good to about 1e-11 for anything smooth in lg D.

use std::f64::consts::PI;
use std::sync::OnceLock;

/// Values per panel.
const ORDER: usize = 14;

/// P on `from` to `to`, 0 at `from`.
pub(super) struct Primitive {
    panels: Vec<Panel>,
}

struct Panel {
    from: f64,
    to: f64,
    /// P at `from`.
    before: f64,
    /// Chebyshev coefficients of P − `before`.
    series: [f64; ORDER + 1],
}

impl Primitive {
    /// Tabulates; panels break at `first`, twice that, and so on.
    pub(super) fn new(from: f64, to: f64, first: f64, f: impl Fn(f64) -> f64) -> Self {
        let mut panels: Vec<Panel> = Vec::new();
        let (mut low, mut before) = (from, 0.0);
        let mut high = first.max(2.0 * from);
        loop {
            // no sliver at the end
            let last = to < 1.2 * high;
            let end = if last { to } else { high };
            let panel = Panel::new(low, end, before, &f);
            before = panel.at(end);
            panels.push(panel);
            if last {
                return Self { panels };
            }
            (low, high) = (end, 2.0 * end);
        }
    }

    /// P at D, which is clamped to the tabulated range.
    pub(super) fn at(&self, d: f64) -> f64 {
        let k = self.panels.partition_point(|panel| panel.to < d).min(self.panels.len() - 1);
        self.panels[k].at(d)
    }
}

impl Panel {
    fn new(from: f64, to: f64, before: f64, f: &impl Fn(f64) -> f64) -> Self {
        let half = 0.5 * (to - from);
        let cosines = cosines();
        let values: [f64; ORDER] = std::array::from_fn(|j| {
            let d = from + half * (1.0 + cosines[1][j]);
            f(d) * d * half
        });
        let mut coefficients = [0.0; ORDER + 2];
        for (k, c) in coefficients.iter_mut().take(ORDER).enumerate() {
            *c = values.iter().zip(&cosines[k]).map(|(v, cos)| v * cos).sum::<f64>() * 2.0 / ORDER as f64;
        }
        // ∫ T_k = T_(k+1)/(2(k+1)) − T_(k−1)/(2(k−1))
        let mut series = [0.0; ORDER + 1];
        for k in 1..=ORDER {
            series[k] = (coefficients[k - 1] - coefficients[k + 1]) / (2 * k) as f64;
        }
        series[0] = -series.iter().enumerate().skip(1).map(|(k, c)| if k % 2 == 0 { *c } else { -c }).sum::<f64>();
        Self { from, to, before, series }
    }

    fn at(&self, d: f64) -> f64 {
        let width = self.to - self.from;
        if !(width > 0.0) {
            return self.before;
        }
        let x = (2.0 * (d - self.from) / width - 1.0).clamp(-1.0, 1.0);
        // Clenshaw
        let (mut b1, mut b2) = (0.0, 0.0);
        for c in self.series[1..].iter().rev() {
            (b1, b2) = (c + 2.0 * x * b1 - b2, b1);
        }
        self.before + self.series[0] + x * b1 - b2
    }
}

/// cos(k π (j + ½)/N): T_k at the Chebyshev nodes.
fn cosines() -> &'static [[f64; ORDER]; ORDER] {
    static TABLE: OnceLock<[[f64; ORDER]; ORDER]> = OnceLock::new();
    TABLE.get_or_init(|| {
        std::array::from_fn(|k| std::array::from_fn(|j| (k as f64 * PI * (j as f64 + 0.5) / ORDER as f64).cos()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integral_of_a_power_of_d_is_the_next_power() {
        for (from, to) in [(0.0, 3.0), (0.5, 3.0), (0.5, 0.501), (1e-3, 1e-3)] {
            let table = Primitive::new(from, to, 0.01, |d| (1.0 + d).powi(-3));
            // ∫ D/(1+D)³ dD = D²/(2(1+D)²)
            let exact = |d: f64| 0.5 * (d / (1.0 + d)).powi(2);
            for share in [0.0, 0.1, 0.5, 0.93, 1.0] {
                let d = from + share * (to - from);
                assert!((table.at(d) - (exact(d) - exact(from))).abs() < 1e-11, "{from} {to} {d}");
            }
        }
    }
}
