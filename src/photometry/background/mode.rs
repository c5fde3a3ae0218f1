//! Level and scatter of the pixels of one box: SExtractor's clipped mode, from a histogram.
//!
//! Electrons. Sums run in [`LANES`] lanes of f64 about a local zero: a sky of 1e12 e⁻ keeps its digits, and the bits do
//! not depend on the instruction set. It does not cover where the pixels are.

use multiversion::multiversion;

use super::histogram::{Bins, clip_histogram};

/// Cut of the first pass, which only sets the range of the histogram \[σ\].
const FIRST_CUT_SIGMA: f64 = 2.0;
/// Half the range of the histogram \[σ\].
const HISTOGRAM_SIGMA: f64 = 5.0;
/// Most levels of the histogram.
const MAX_LEVELS: usize = 4096;
/// A box whose mean and median differ by more than this is crowded: its median is used \[σ\].
const CROWDED_SIGMA: f64 = 0.3;
/// Sums held side by side: two AVX-512 or four AVX2 registers.
const LANES: usize = 16;

/// Level and scatter of one box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mode {
    pub level: f64,
    pub sigma: f64,
}

/// The clipped mode of the pixels of a box, from a histogram; `None` if fewer than `enough` are finite.
/// Values that are not finite are taken out of `values`.
pub(super) fn mode_of_box(values: &mut Vec<f32>, bins: &mut Bins, enough: f64, clip_sigma: f64) -> Option<Mode> {
    // a value that is not finite spoils the sums: only then it is worth looking for
    let mut all = Moments::of_all(values);
    if !(all.sum.is_finite() && all.square.is_finite()) {
        values.retain(|v| v.is_finite());
        all = Moments::of_all(values);
    }
    if values.is_empty() || (values.len() as f64) < enough {
        return None;
    }
    let (mean, sigma) = all.mean_and_sigma();
    let (low, high) = (mean - FIRST_CUT_SIGMA * sigma, mean + FIRST_CUT_SIGMA * sigma);
    let core = Moments::within(values, mean, low, high);
    let (mean, sigma) = core.mean_and_sigma();
    if sigma.is_nan() || sigma <= 0.0 {
        return Some(Mode { level: mean, sigma: 0.0 });
    }
    // as many levels as put about four pixels into each at the peak of a Gaussian: n √(2/π) · 5/4
    let levels = ((core.n * (2.0 / std::f64::consts::PI).sqrt() * HISTOGRAM_SIGMA / 4.0) as usize + 1).min(MAX_LEVELS);
    let step = 2.0 * HISTOGRAM_SIGMA * sigma / levels as f64;
    let zero = mean - HISTOGRAM_SIGMA * sigma;
    bins.clear(levels);
    count_levels(values, 1.0 / step, 0.5 - zero / step, levels, bins);
    let clipped = clip_histogram(bins.levels(levels), clip_sigma);
    let (median, mean, sigma) = (zero + step * clipped.median, zero + step * clipped.mean, step * clipped.sigma);
    let crowded = (mean - median).abs() >= CROWDED_SIGMA * sigma;
    let level = if sigma <= 0.0 {
        mean
    } else if crowded {
        median
    } else {
        2.5 * median - 1.5 * mean
    };
    Some(Mode { level, sigma })
}

/// Number, Σ(v − about) and Σ(v − about)² of some values.
struct Moments {
    about: f64,
    n: f64,
    sum: f64,
    square: f64,
}

impl Moments {
    /// The histogram of all values, about the first.
    fn of_all(values: &[f32]) -> Self {
        let about = values.first().map_or(0.0, |v| f64::from(*v));
        let (sum, square) = sums_of_all(values, about);
        Self { about, n: values.len() as f64, sum, square }
    }

    /// The histogram of the values from `low` to `high`.
    fn within(values: &[f32], about: f64, low: f64, high: f64) -> Self {
        let (n, sum, square) = sums_within(values, about, low, high);
        Self { about, n, sum, square }
    }

    /// Mean and standard deviation; (about, 0) of no value.
    fn mean_and_sigma(&self) -> (f64, f64) {
        if self.n == 0.0 {
            return (self.about, 0.0);
        }
        let mean = self.sum / self.n;
        (self.about + mean, (self.square / self.n - mean * mean).max(0.0).sqrt())
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn sums_of_all(values: &[f32], about: f64) -> (f64, f64) {
    // several rounds of the lanes at a time: in shorter loops the compiler pairs sums with squares and gives up the lanes
    const ROUNDS: usize = 4;
    let (mut sum, mut square) = ([0f64; LANES], [0f64; LANES]);
    let (chunks, rest) = values.as_chunks::<{ ROUNDS * LANES }>();
    for chunk in chunks {
        for l in 0..LANES {
            for round in 0..ROUNDS {
                let d = f64::from(chunk[round * LANES + l]) - about;
                sum[l] += d;
                square[l] += d * d;
            }
        }
    }
    for (k, v) in rest.iter().enumerate() {
        let d = f64::from(*v) - about;
        sum[k % LANES] += d;
        square[k % LANES] += d * d;
    }
    (sum.iter().sum(), square.iter().sum())
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn sums_within(values: &[f32], about: f64, low: f64, high: f64) -> (f64, f64, f64) {
    let (mut n, mut sum, mut square) = ([0f64; LANES], [0f64; LANES], [0f64; LANES]);
    let (chunks, rest) = values.as_chunks::<LANES>();
    for chunk in chunks {
        for l in 0..LANES {
            let v = f64::from(chunk[l]);
            let inside = (v >= low) & (v <= high);
            let d = if inside { v - about } else { 0.0 };
            n[l] += if inside { 1.0 } else { 0.0 };
            sum[l] += d;
            square[l] += d * d;
        }
    }
    for (l, v) in rest.iter().enumerate() {
        let v = f64::from(*v);
        if v >= low && v <= high {
            n[l] += 1.0;
            sum[l] += v - about;
            square[l] += (v - about) * (v - about);
        }
    }
    (n.iter().sum(), sum.iter().sum(), square.iter().sum())
}

/// Counts the values by level, `v · per_step + shift` rounded down; those below and above go to the bins at the ends.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn count_levels(values: &[f32], per_step: f64, shift: f64, levels: usize, bins: &mut Bins) {
    const BLOCK: usize = 256;
    const TWO_52: f64 = 4_503_599_627_370_496.0;
    let top = levels as f64;
    let mut at = [0u16; BLOCK];
    let counts = &mut *bins.counts;
    let (blocks, rest) = values.as_chunks::<BLOCK>();
    // a whole number below 2¹⁶ in the low bits of 2⁵² + number: a conversion in lanes, without that of every edge case
    let bin_of = |v: f32| {
        let level = (f64::from(v) * per_step + shift).max(-1.0).min(top).floor();
        (level + (TWO_52 + 1.0)).to_bits() as u16
    };
    for block in blocks {
        for l in 0..BLOCK {
            at[l] = bin_of(block[l]);
        }
        for eight in at.as_chunks::<8>().0 {
            for bin in *eight {
                counts[usize::from(bin)] += 1;
            }
        }
    }
    for &v in rest {
        counts[usize::from(bin_of(v))] += 1;
    }
}

#[cfg(test)]
#[path = "mode_tests.rs"]
mod tests;
