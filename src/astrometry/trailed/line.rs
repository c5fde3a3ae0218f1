//! The profile of a star trail: Moffat's line-spread function across, and the share of it that an end leaves.
//!
//! Pixels. The line-spread function of a Moffat profile is one itself, with exponent β − ½. Along a line at v from the middle the
//! light of the star falls as (1 + u²/(α² + v²))^−β: the share up to u is that at v = 0 for u/√(1 + v²/α²). Both are tabulated.
//! It does not cover elongated images.

use statrs::function::gamma::ln_gamma;

use crate::base::constants::FWHM_PER_SIGMA;

/// Cells of the tables per FWHM: between them a straight line errs by 2e-4 of the profile's top.
const PER_FWHM: f64 = 64.0;
/// How far the tables go \[FWHM\].
const TABLE_FWHM: f64 = 10.0;

/// The light of a trail across, per pixel of its length.
#[derive(Debug, Clone, PartialEq)]
pub struct LineSpread {
    /// FWHM of the star \[px\].
    pub fwhm_px: f64,
    /// Moffat's exponent; infinite for a Gaussian.
    pub beta: f64,
    /// α² of Moffat \[px²\]; infinite for a Gaussian.
    alpha2: f64,
    /// L and dL/dv, the density along v = 0 and the share beyond, from 0 outwards.
    table: Vec<[f64; 4]>,
}

impl LineSpread {
    /// Of stars with this FWHM and exponent: L(v) = Γ(β−½)/(√π Γ(β−1) α) (1 + v²/α²)^(½−β), Σ L = 1.
    #[must_use]
    pub fn new(fwhm_px: f64, beta: f64) -> Self {
        let beta = if beta > 50.0 { f64::INFINITY } else { beta };
        let pi = std::f64::consts::PI;
        let alpha2 = if beta.is_infinite() { beta } else { fwhm_px * fwhm_px / (4.0 * (2f64.powf(1.0 / beta) - 1.0)) };
        // of unit area: (1 + x²/α²)^−p, or a Gaussian
        let density = |x: f64, p: f64| -> f64 {
            if beta.is_infinite() {
                let sigma2 = (fwhm_px / FWHM_PER_SIGMA).powi(2);
                return (-0.5 * x * x / sigma2).exp() / (2.0 * pi * sigma2).sqrt();
            }
            (ln_gamma(p) - ln_gamma(p - 0.5)).exp() / (pi * alpha2).sqrt() * (1.0 + x * x / alpha2).powf(-p)
        };
        let slope = |v: f64, l: f64| {
            if beta.is_infinite() {
                return -v * (FWHM_PER_SIGMA / fwhm_px).powi(2) * l;
            }
            -2.0 * (beta - 0.5) * v / (alpha2 + v * v) * l
        };
        let step = fwhm_px / PER_FWHM;
        let n = (TABLE_FWHM * PER_FWHM) as usize + 2;
        let mut table = Vec::with_capacity(n);
        let mut beyond = 0.5;
        for k in 0..n {
            let x = k as f64 * step;
            let (l, along) = (density(x, beta - 0.5), density(x, beta));
            table.push([l, slope(x, l), along, beyond]);
            // Simpson's rule to the next cell
            let (middle, next) = (density(x + 0.5 * step, beta), density(x + step, beta));
            beyond = (beyond - step / 6.0 * (along + 4.0 * middle + next)).max(0.0);
        }
        // an end must end: none is left beyond the table
        let left = table[n - 1][3];
        table.iter_mut().for_each(|row| row[3] = (row[3] - left) * 0.5 / (0.5 - left));
        Self { fwhm_px, beta, alpha2, table }
    }

    /// The two rows about x and where between them it is.
    fn rows(&self, x_px: f64) -> Option<(&[[f64; 4]], f64)> {
        let at = x_px.abs() / self.fwhm_px * PER_FWHM;
        let k = at as usize;
        Some((self.table.get(k..k + 2)?, at - k as f64))
    }

    /// L(v) and dL/dv.
    #[must_use]
    pub fn at(&self, v_px: f64) -> (f64, f64) {
        let Some((pair, part)) = self.rows(v_px) else { return (0.0, 0.0) };
        let of = |i: usize| pair[0][i] + part * (pair[1][i] - pair[0][i]);
        (of(0), of(1).copysign(-v_px))
    }

    /// How far from the middle of a trail its light counts \[px\].
    #[must_use]
    pub fn reach_px(&self) -> f64 {
        if self.beta.is_infinite() { 2.0 * self.fwhm_px } else { 4.0 * self.fwhm_px }
    }

    /// Share of the light at u, on the line at v, of a trail from `start` to `end`, and its derivatives by `start` and by `end`.
    #[must_use]
    pub fn along(&self, u_px: f64, v_px: f64, start_px: f64, end_px: f64) -> (f64, f64, f64) {
        let scale = (1.0 + v_px * v_px / self.alpha2).sqrt().recip();
        // the share up to x, and its density
        let up_to = |x: f64| match self.rows(x * scale) {
            Some((pair, part)) => {
                let of = |i: usize| pair[0][i] + part * (pair[1][i] - pair[0][i]);
                (if x > 0.0 { 1.0 - of(3) } else { of(3) }, scale * of(2))
            }
            None => (f64::from(u8::from(x > 0.0)), 0.0),
        };
        let (s, ds) = up_to(u_px - start_px);
        let (e, de) = up_to(u_px - end_px);
        (s - e, -ds, de)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A star by the profile itself, at (u, v) from its middle.
    fn star(fwhm_px: f64, beta: f64, r2: f64) -> f64 {
        if beta.is_infinite() {
            let sigma2 = (fwhm_px / 2.354_820).powi(2);
            return (-0.5 * r2 / sigma2).exp() / (std::f64::consts::TAU * sigma2);
        }
        let alpha2 = (0.5 * fwhm_px).powi(2) / (2f64.powf(1.0 / beta) - 1.0);
        (beta - 1.0) / (std::f64::consts::PI * alpha2) * (1.0 + r2 / alpha2).powf(-beta)
    }

    #[test]
    fn a_trail_is_the_sum_of_stars_along_it_in_its_middle_and_at_its_ends() {
        for beta in [2.5, 3.0, 4.5, f64::INFINITY] {
            let line = LineSpread::new(3.7, beta);
            let top = line.at(0.0).0;
            for v in [0.0, 0.4, -1.3, 2.9, -6.0f64] {
                let slope = (line.at(v + 0.05).0 - line.at(v - 0.05).0) / 0.1;
                assert!((line.at(v).1 - slope).abs() < 0.003 * top, "{beta} {v}");
                for u in [-9.0, -2.0, 0.0, 1.1, 7.0, 30.0f64] {
                    let summed: f64 = (0..60_000)
                        .map(|k| 1e-3 * star(3.7, beta, (u - 1e-3 * (f64::from(k) + 0.5)).powi(2) + v * v))
                        .sum();
                    let (share, by_start, by_end) = line.along(u, v, 0.0, 60.0);
                    let light = line.at(v).0 * share;
                    assert!((light - summed).abs() < 1e-3 * top, "{beta} {u} {v}: {light} for {summed}");
                    let by = |d: f64| (line.along(u, v, d, 60.0).0 - line.along(u, v, -d, 60.0).0) / (2.0 * d);
                    assert!((by_start - by(0.05)).abs() < 0.003 * top && by_end.abs() < 0.02, "{beta} {u} {v}");
                }
            }
        }
    }
}
