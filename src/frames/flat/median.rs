//! The exact median of a stack of frames, pixel by pixel: a sorting network on lanes of pixels.
//!
//! No units. The median of an even number is the mean of the two middle values. A lane whose pixel must not vote is
//! noted next to the network and redone by a plain sort. It does not cover where the pixels come from
//! ([`super::stack`]) and medians of millions of values ([`super::levels`]).

/// Pixels sorted at once. Whole cache lines (see the alignment): 42 frames of f32 are 21 kB, which the fastest cache
/// holds.
pub(crate) const LANES: usize = 128;

/// One frame's pixels in the network.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Lanes<T>(pub [T; LANES]);

/// Comparators that bring the wanted ranks of `n` values into place.
///
/// Batcher's odd-even merge sort for the next power of two, without the comparators that touch an index ≥ n
/// (as if +∞ were there), and without those that no wanted rank depends on.
/// Source: Batcher 1968, AFIPS 32, 307; Knuth, TAOCP 3, algorithm 5.2.2M.
fn comparators(n: usize, wanted: &[usize]) -> Vec<(usize, usize)> {
    let top = n.next_power_of_two();
    let mut all = Vec::new();
    let mut p = top / 2;
    while p > 0 {
        let (mut q, mut r, mut d) = (top / 2, 0, p);
        loop {
            for i in 0..top - d {
                if i & p == r && i + d < n {
                    all.push((i, i + d));
                }
            }
            if q == p {
                break;
            }
            (d, q, r) = (q - p, q / 2, p);
        }
        p /= 2;
    }
    let mut needed = vec![false; n];
    wanted.iter().for_each(|w| needed[*w] = true);
    let mut kept: Vec<(usize, usize)> = Vec::new();
    for (a, b) in all.into_iter().rev() {
        if needed[a] || needed[b] {
            (needed[a], needed[b]) = (true, true);
            kept.push((a, b));
        }
    }
    kept.reverse();
    kept
}

/// The two middle ranks of `n` values (equal for odd n).
pub(crate) fn middle(n: usize) -> (usize, usize) {
    ((n - 1) / 2, n / 2)
}

/// The comparators of a median of `n` values.
pub(crate) struct Network {
    /// Number of values.
    pub n: usize,
    pairs: Vec<(usize, usize)>,
}

impl Network {
    /// For `n` ≥ 1 values.
    pub(crate) fn new(n: usize) -> Self {
        let (lo, hi) = middle(n.max(1));
        Self { n, pairs: if n < 2 { Vec::new() } else { comparators(n, &[lo, hi]) } }
    }

    /// Brings the middle ranks of every lane into rows `middle(n)`; `rows` must hold `n`.
    ///
    /// Inlined into kernels compiled for several instruction sets. The comparison by hand is one instruction for each
    /// of minimum and maximum; `f32::min` would first look for NaN, of which there are none here.
    #[inline(always)]
    pub(crate) fn run<T: Copy + PartialOrd>(&self, rows: &mut [Lanes<T>]) {
        for &(a, b) in &self.pairs {
            let (low, high) = rows.split_at_mut(b);
            let (low, high) = (&mut low[a].0, &mut high[0].0);
            for i in 0..LANES {
                let (x, y) = (low[i], high[i]);
                low[i] = if x < y { x } else { y };
                high[i] = if x < y { y } else { x };
            }
        }
    }
}

/// Median of the values left over, by sorting them; NaN if they are not more than half of `n`.
pub(crate) fn of_few(few: &mut [f32], n: usize) -> f32 {
    if 2 * few.len() <= n {
        return f32::NAN;
    }
    few.sort_unstable_by(f32::total_cmp);
    let (lo, hi) = middle(few.len());
    mean_of_two(few[lo], few[hi])
}

/// Mean without rounding twice; equal values stay what they are.
#[inline(always)]
pub(crate) fn mean_of_two(a: f32, b: f32) -> f32 {
    ((f64::from(a) + f64::from(b)) / 2.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_network_sorts_every_zero_one_input() {
        // The 0-1 principle: a network that finds the middle of all 0-1 inputs finds that of all inputs.
        for n in 1..=14usize {
            let (lo, hi) = middle(n);
            let network = comparators(n, &[lo, hi]);
            for bits in 0u32..1 << n {
                let mut v: Vec<u32> = (0..n).map(|i| bits >> i & 1).collect();
                for &(a, b) in &network {
                    (v[a], v[b]) = (v[a].min(v[b]), v[a].max(v[b]));
                }
                let zeros = n - bits.count_ones() as usize;
                assert_eq!((v[lo], v[hi]), (u32::from(lo >= zeros), u32::from(hi >= zeros)), "n={n} bits={bits:b}");
            }
        }
        assert!(comparators(42, &[20, 21]).len() <= 269);
    }
}
