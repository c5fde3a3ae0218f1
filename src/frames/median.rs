//! Exact medians: of a stack of frames pixel by pixel (a sorting network on lanes), and of millions of values (by counting).
//!
//! No units. The median of an even number is the mean of the two middle values. NaN means "not counted".

/// Pixels sorted at once; 256 f32 of 42 frames are 43 kB.
const LANES: usize = 256;

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
fn middle(n: usize) -> (usize, usize) {
    ((n - 1) / 2, n / 2)
}

/// Median along a stack of `n` frames.
pub(super) struct StackMedian {
    n: usize,
    network: Vec<(usize, usize)>,
    lanes: Vec<f32>,
    few: Vec<f32>,
}

impl StackMedian {
    pub(super) fn new(n: usize) -> Self {
        let network = if n == 0 { Vec::new() } else { comparators(n, &[middle(n).0, middle(n).1]) };
        Self { n, network, lanes: vec![0.0; n * LANES], few: Vec::with_capacity(n) }
    }

    /// `stack` holds n images of `out.len()` values one after the other; NaN values are left out of their pixel's median.
    /// Pixels with at most half of their values left become NaN.
    pub(super) fn run(&mut self, stack: &[f32], out: &mut [f32]) {
        let (n, size) = (self.n, out.len());
        if n == 0 || stack.len() != n * size {
            out.fill(f32::NAN);
            return;
        }
        for start in (0..size).step_by(LANES) {
            let width = LANES.min(size - start);
            let mut complete = true;
            for k in 0..n {
                let from = &stack[k * size + start..k * size + start + width];
                self.lanes[k * LANES..k * LANES + width].copy_from_slice(from);
                // No early exit: this way it is vectorised.
                complete &= !from.iter().fold(false, |any, v| any | v.is_nan());
            }
            for &(a, b) in &self.network {
                let (low, high) = self.lanes.split_at_mut(b * LANES);
                let (low, high) = (&mut low[a * LANES..(a + 1) * LANES], &mut high[..LANES]);
                for (x, y) in low.iter_mut().zip(high) {
                    (*x, *y) = (x.min(*y), x.max(*y));
                }
            }
            let (lo, hi) = middle(n);
            for i in 0..width {
                out[start + i] = mean_of_two(self.lanes[lo * LANES + i], self.lanes[hi * LANES + i]);
            }
            if !complete {
                self.repair(stack, start, width, out);
            }
        }
    }

    /// Redoes the pixels with a NaN by sorting what is left.
    fn repair(&mut self, stack: &[f32], start: usize, width: usize, out: &mut [f32]) {
        let size = out.len();
        for i in start..start + width {
            self.few.clear();
            self.few.extend((0..self.n).map(|k| stack[k * size + i]).filter(|v| !v.is_nan()));
            if self.few.len() == self.n {
                continue;
            }
            self.few.sort_unstable_by(f32::total_cmp);
            out[i] = if 2 * self.few.len() > self.n {
                let (lo, hi) = middle(self.few.len());
                mean_of_two(self.few[lo], self.few[hi])
            } else {
                f32::NAN
            };
        }
    }
}

/// Mean without rounding twice; equal values stay what they are.
fn mean_of_two(a: f32, b: f32) -> f32 {
    ((f64::from(a) + f64::from(b)) / 2.0) as f32
}

/// The exact median of values that arrive in pieces and may be read twice: counts by the upper, then the lower 16
/// bits of an order-preserving key. Memory 256 kB for any number of values.
pub(super) struct CountingMedian {
    counts: Vec<u32>,
}

impl CountingMedian {
    pub(super) fn new() -> Self {
        Self { counts: vec![0; 1 << 16] }
    }

    /// `each(f)` must call `f` with the same values every time; NaN is not counted. `None` if nothing was counted.
    /// One pass for whole numbers of 16 bits, up to four for others.
    pub(super) fn of<E>(
        &mut self,
        mut each: impl FnMut(&mut dyn FnMut(&[f32])) -> Result<(), E>,
    ) -> Result<Option<f64>, E> {
        if let Some(median) = self.of_counts(&mut each)? {
            return Ok(Some(median));
        }
        self.counts.fill(0);
        let counts = &mut self.counts;
        let mut total = 0u64;
        each(&mut |values| {
            for v in values.iter().filter(|v| !v.is_nan()) {
                counts[(key(*v) >> 16) as usize] += 1;
                total += 1;
            }
        })?;
        if total == 0 {
            return Ok(None);
        }
        let ranks = [(total - 1) / 2, total / 2];
        let (high_a, rest_a) = find(counts, ranks[0]);
        let (high_b, rest_b) = find(counts, ranks[1]);
        let mut found = [0.0f64; 2];
        for (slot, (high, rest)) in [(high_a, rest_a), (high_b, rest_b)].into_iter().enumerate() {
            if slot == 0 || high != high_a {
                counts.fill(0);
                each(&mut |values| {
                    for v in values.iter().filter(|v| !v.is_nan()) {
                        let k = key(*v);
                        if k >> 16 == high {
                            counts[(k & 0xffff) as usize] += 1;
                        }
                    }
                })?;
            }
            let (low, _) = find(counts, rest);
            found[slot] = f64::from(value(high << 16 | low));
        }
        Ok(Some((found[0] + found[1]) / 2.0))
    }

    /// The same in one pass, where every value is a whole number that 16 bits hold; `None` where one is not.
    fn of_counts<E>(
        &mut self,
        each: &mut impl FnMut(&mut dyn FnMut(&[f32])) -> Result<(), E>,
    ) -> Result<Option<f64>, E> {
        self.counts.fill(0);
        let counts = &mut self.counts;
        let (mut total, mut all_whole) = (0u64, true);
        each(&mut |values| {
            if !all_whole {
                return;
            }
            for v in values {
                let bin = *v as u16;
                // False for NaN too.
                all_whole &= f32::from(bin) == *v;
                counts[usize::from(bin)] += 1;
            }
            total += values.len() as u64;
        })?;
        if !all_whole || total == 0 {
            return Ok(None);
        }
        let (low, _) = find(counts, (total - 1) / 2);
        let (high, _) = find(counts, total / 2);
        Ok(Some((f64::from(low) + f64::from(high)) / 2.0))
    }
}

/// Bin of the value of this rank, and its rank within the bin.
fn find(counts: &[u32], rank: u64) -> (u32, u64) {
    let mut below = 0;
    for (bin, n) in counts.iter().enumerate() {
        if rank < below + u64::from(*n) {
            return (bin as u32, rank - below);
        }
        below += u64::from(*n);
    }
    (counts.len() as u32 - 1, 0)
}

/// A key whose unsigned order is the order of the numbers.
fn key(v: f32) -> u32 {
    let bits = v.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

fn value(key: u32) -> f32 {
    f32::from_bits(if key >> 31 == 1 { key & !(1 << 31) } else { !key })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn plain_median(values: &[f32]) -> f32 {
        let mut v: Vec<f32> = values.iter().copied().filter(|v| !v.is_nan()).collect();
        if v.is_empty() {
            return f32::NAN;
        }
        v.sort_by(f32::total_cmp);
        let (lo, hi) = middle(v.len());
        mean_of_two(v[lo], v[hi])
    }

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

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_stack_median_is_that_of_a_plain_sort(n in 1usize..50, size in 1usize..600, seed in any::<u64>(), holes in 0u64..4) {
            let mut state = seed | 1;
            let mut next = || { state ^= state << 13; state ^= state >> 7; state ^= state << 17; state };
            let stack: Vec<f32> = (0..n * size)
                .map(|_| { let r = next(); if holes > 0 && r % 7 < holes { f32::NAN } else { (r >> 40) as f32 - 8e6 } })
                .collect();
            let mut out = vec![0.0; size];
            StackMedian::new(n).run(&stack, &mut out);
            for i in 0..size {
                let column: Vec<f32> = (0..n).map(|k| stack[k * size + i]).collect();
                let valid = column.iter().filter(|v| !v.is_nan()).count();
                if 2 * valid > n { prop_assert_eq!(out[i], plain_median(&column)); } else { prop_assert!(out[i].is_nan()); }
            }
        }

        #[test]
        fn whole_numbers_are_counted_in_one_pass(values in prop::collection::vec(0u16..=65535, 1..400)) {
            let values: Vec<f32> = values.into_iter().map(f32::from).collect();
            let mut passes = 0;
            let got = CountingMedian::new().of(|f| { passes += 1; f(&values); Ok::<(), ()>(()) }).unwrap().unwrap();
            prop_assert_eq!((got as f32, passes), (plain_median(&values), 1));
        }

        #[test]
        fn the_counting_median_is_that_of_a_plain_sort(values in prop::collection::vec(prop_oneof![-1e30f32..1e30, -5f32..5.0, Just(f32::NAN), Just(0.0)], 1..400)) {
            let got = CountingMedian::new().of(|f| { f(&values); Ok::<(), ()>(()) }).unwrap();
            match got {
                // f64 mean of the two middle values, so compare after the same rounding.
                Some(m) => prop_assert_eq!(m as f32, plain_median(&values)),
                None => prop_assert!(values.iter().all(|v| v.is_nan())),
            }
        }
    }
}
