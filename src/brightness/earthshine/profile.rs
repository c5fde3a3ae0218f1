//! A surface's scattering law as the integral wants it: f over the squared distance from the mirror direction.
//!
//! Two distances: the chord |m − w| (Phong, Gaussian; r·o = 1 − |m − w|²/2, so nothing cancels in a narrow lobe) and
//! its part in the plane of the surface, D (Binomial, ABG). f in 1/sr, distances in units of 1. A Binomial with several
//! rows depends on V = −o_t·i_t as well and is evaluated as it stands.

use std::f64::consts::{LN_10, PI};

use super::arithmetic::{exp, ln, positive_power};
use super::table::Table;
use crate::brightness::brdf::{Binomial, Brdf};

/// From this exponent on ln(1 − x) is taken by the library: rounding of 1 − x would show.
const SHARP_EXPONENT: f64 = 1e3;
/// Exponents below this end at r·o = 0 with a branch point.
const SMOOTH_EXPONENT: f64 = 4.0;

/// What f depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Metric {
    /// Nothing.
    None,
    /// |m − w|².
    Chord,
    /// D², the part of that in the plane of the surface.
    Plane,
}

/// A scattering law made ready for many integrals: build one per surface, not one per integral.
///
/// A one-row Binomial is tabulated (relative error below 1e-9), which costs a millisecond once and saves a hundred
/// nanoseconds at every node.
#[derive(Debug, Clone)]
pub struct PreparedBrdf {
    pub(super) law: Law,
}

/// The law with what is constant in it worked out.
#[derive(Debug, Clone)]
pub(super) enum Law {
    Lambert { f: f64 },
    Phong { diffuse: f64, peak: f64, n: f64 },
    Gaussian { peak: f64, sigma: f64 },
    Abg { a: f64, b: f64, g: f64 },
    Binomial { rows: Rows, table: Option<Table>, width: f64 },
    Mirror { reflectance: f64 },
}

/// The sums of a Binomial: B_ki, and (C_ki/2, d^(i+l1)).
#[derive(Debug, Clone)]
pub(super) struct Rows(Vec<(Vec<f64>, Vec<(f64, f64)>)>);

impl PreparedBrdf {
    /// Makes a law ready; a one-row Binomial gets its table.
    #[must_use]
    pub fn new(brdf: &Brdf) -> Self {
        let mut prepared = Self::bare(brdf);
        if let Law::Binomial { rows, table, width } = &mut prepared.law
            && rows.0.len() <= 1
        {
            *table = Table::new(|d| rows.value(d, 0.0), *width);
        }
        prepared
    }

    /// The same without a table, for a single integral.
    pub(super) fn bare(brdf: &Brdf) -> Self {
        let law = match brdf {
            Brdf::Lambert { albedo } => Law::Lambert { f: albedo / PI },
            Brdf::Phong { kd, ks, n } if *ks == 0.0 || n.is_nan() => Law::Lambert { f: kd / PI },
            Brdf::Phong { kd, ks, n } => Law::Phong { diffuse: kd / PI, peak: ks * (n + 2.0) / (2.0 * PI), n: *n },
            Brdf::Gaussian { peak_per_sr, sigma } => Law::Gaussian { peak: *peak_per_sr, sigma: *sigma },
            Brdf::Abg { a, b, g } => Law::Abg { a: *a, b: *b, g: *g },
            Brdf::Binomial(binomial) => {
                let rows = Rows::new(binomial);
                let width = rows.half_width(0.0);
                Law::Binomial { rows, table: None, width }
            }
            Brdf::Mirror { reflectance } => Law::Mirror { reflectance: *reflectance },
        };
        Self { law }
    }

    /// What f depends on.
    pub(super) fn metric(&self) -> Metric {
        match self.law {
            Law::Lambert { .. } | Law::Mirror { .. } => Metric::None,
            Law::Phong { .. } | Law::Gaussian { .. } => Metric::Chord,
            Law::Abg { .. } | Law::Binomial { .. } => Metric::Plane,
        }
    }

    /// f needs V next to D.
    pub(super) fn needs_v(&self) -> bool {
        matches!(&self.law, Law::Binomial { rows, .. } if rows.0.len() > 1)
    }

    /// Distance over which the middle of the lobe changes.
    pub(super) fn width(&self) -> f64 {
        match self.law {
            Law::Lambert { .. } | Law::Mirror { .. } => f64::INFINITY,
            Law::Phong { n, .. } => n.powf(-0.5),
            Law::Gaussian { sigma, .. } => sigma.sqrt(),
            Law::Abg { b, g, .. } => b.powf(1.0 / g),
            Law::Binomial { width, .. } => width,
        }
    }

    /// The lobe falls like exp(−x²) and is nothing beyond a few widths; the others have the tails of a power.
    pub(super) fn falls_off(&self) -> bool {
        match self.law {
            Law::Gaussian { .. } => true,
            Law::Phong { n, .. } => n > 8.0,
            _ => false,
        }
    }

    /// f where the lobe no longer counts.
    pub(super) fn diffuse(&self) -> f64 {
        match self.law {
            Law::Phong { diffuse, .. } => diffuse,
            _ => 0.0,
        }
    }

    /// The lobe ends at r·o = 0 in a branch point, a kink or a step.
    pub(super) fn ends_sharply(&self) -> bool {
        matches!(self.law, Law::Phong { n, .. } if n < SMOOTH_EXPONENT && (n.fract() != 0.0 || n < 2.0))
    }

    /// The exponent of a Phong lobe.
    pub(super) fn lobe_exponent(&self) -> Option<f64> {
        match self.law {
            Law::Phong { n, .. } => Some(n),
            _ => None,
        }
    }

    /// −d ln f/d(x²) of a lobe that falls off.
    pub(super) fn steepness(&self, x2: f64) -> f64 {
        match self.law {
            Law::Phong { n, .. } => 0.5 * n / (1.0 - 0.5 * x2).max(1e-3),
            Law::Gaussian { sigma, .. } => 0.5 / sigma,
            _ => 0.0,
        }
    }

    /// Squared distance at which a lobe that falls off is e^(−drop) of what it is at `x2`; infinite for others.
    pub(super) fn window2(&self, x2: f64, drop: f64) -> f64 {
        match self.law {
            Law::Phong { n, .. } if self.falls_off() => {
                // (1 − W²/2) = (1 − x²/2) e^(−drop/n)
                let here = (1.0 - 0.5 * x2).max(0.0);
                2.0 * (1.0 - here) - 2.0 * here * (-drop / n).exp_m1()
            }
            Law::Gaussian { sigma, .. } => x2 + 2.0 * sigma * drop,
            _ => f64::INFINITY,
        }
    }

    /// f at the first `nodes` squared distances, and at any of the rest; `quick` to 1e-7, from the table where there is one.
    #[inline(always)]
    pub(super) fn fill<const N: usize>(&self, x2: &[f64; N], f: &mut [f64; N], nodes: usize, quick: bool) {
        match &self.law {
            Law::Lambert { f: value } => f.fill(*value),
            Law::Phong { diffuse, peak, n } if *n > SHARP_EXPONENT => {
                for j in 0..N {
                    let log = (-0.5 * x2[j].min(1.999_999)).ln_1p();
                    f[j] = diffuse + peak * exp::<false>(n * log);
                }
            }
            Law::Phong { diffuse, peak, n } => {
                for j in 0..N {
                    f[j] = diffuse + peak * positive_power::<false>(1.0 - 0.5 * x2[j], *n);
                }
            }
            Law::Gaussian { peak, sigma } => {
                let scale = -0.5 / sigma;
                for j in 0..N {
                    f[j] = peak * exp::<false>(scale * x2[j]);
                }
            }
            Law::Abg { a, b, g } => {
                let half = 0.5 * g;
                for j in 0..N {
                    f[j] = a / (b + exp::<false>(half * ln::<false>(x2[j].max(1e-300)))).max(1e-300);
                }
            }
            Law::Binomial { rows, table, .. } => match table {
                Some(table) if quick => table.fill(x2, f, nodes),
                _ => {
                    for j in 0..nodes.min(N) {
                        f[j] = rows.value(x2[j].sqrt(), 0.0);
                    }
                }
            },
            Law::Mirror { .. } => f.fill(0.0),
        }
    }

    /// f at one D and V of a Binomial with several rows.
    pub(super) fn value_at(&self, d: f64, v: f64) -> f64 {
        match &self.law {
            Law::Binomial { rows, .. } => rows.value(d, v),
            _ => 0.0,
        }
    }

    /// The same law with the width it has at this V.
    pub(super) fn width_at(&self, v: f64) -> f64 {
        match &self.law {
            Law::Binomial { rows, .. } if self.needs_v() => rows.half_width(v),
            _ => self.width(),
        }
    }
}

impl Rows {
    fn new(law: &Binomial) -> Self {
        let row = |k: usize| {
            let b = law.b.get(k).cloned().unwrap_or_default();
            let c = law.c.get(k).into_iter().flatten().enumerate();
            (b, c.map(|(i, c)| (0.5 * c, law.d.powi(i as i32 + law.l1))).collect())
        };
        Self((0..law.b.len().max(law.c.len())).map(row).collect())
    }

    /// f = 10^(Σ_k Vᵏ [Σ_i B_ki Dⁱ + ½ Σ_i C_ki lg(1 + d^(i+l1) D²)]).
    fn value(&self, d: f64, v: f64) -> f64 {
        let (mut lg_f, mut v_power) = (0.0, 1.0);
        for (b, c) in &self.0 {
            let polynomial = b.iter().rev().fold(0.0, |sum, b| sum * d + b);
            let logs: f64 = c.iter().map(|(half_c, scale)| half_c * (scale * d * d).ln_1p()).sum();
            lg_f += v_power * (polynomial + logs / LN_10);
            v_power *= v;
        }
        (lg_f * LN_10).min(700.0).exp()
    }

    /// D at which f has fallen to half; infinite if it never does.
    fn half_width(&self, v: f64) -> f64 {
        let half = 0.5 * self.value(0.0, v);
        let grid = (0..80).map(|j| 1e-8 * 1.28_f64.powi(j)).take_while(|d| *d < 2.0);
        grid.into_iter().find(|d| self.value(*d, v) < half).unwrap_or(f64::INFINITY)
    }
}
