//! The exact median of values of any kind that may be read more than once, by counting: memory 256 kB.
//!
//! No units; NaN is not counted. The quick ways for images of counts and responses are in [`super::levels`].

/// The exact median of values that arrive in pieces and may be read twice: counts by the upper, then the lower 16
/// bits of an order-preserving key. Memory 256 kB for any number of values.
pub(crate) struct CountingMedian {
    counts: Vec<u32>,
}

impl CountingMedian {
    pub(crate) fn new() -> Self {
        Self { counts: vec![0; 1 << 16] }
    }

    /// `each(f)` must call `f` with the same values every time; NaN is not counted. `None` if nothing was counted.
    /// One pass for whole numbers of 16 bits, up to four for others.
    pub(crate) fn of<E>(
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
pub(crate) fn find(counts: &[u32], rank: u64) -> (u32, u64) {
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
        ((f64::from(v[(v.len() - 1) / 2]) + f64::from(v[v.len() / 2])) / 2.0) as f32
    }

    proptest! {
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
