//! Medians of a stack of flats on lanes: of the stored 16-bit counts as they are, and of levels scaled to one.
//!
//! Counts in ADU, scaled values without unit, NaN where at most half of the flats vote. Compiled for several
//! instruction sets and the same bits on each: every pixel goes through the same comparisons and roundings.

use multiversion::multiversion;

use super::median::{LANES, Lanes, Network, mean_of_two, middle, of_few};
use crate::fits::stored::{PIXEL_BYTES, count};

/// The pixels of one flat that a band needs, one after the other.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Pixels<'a> {
    /// As stored: big-endian, of the order of the counts.
    Counts(&'a [[u8; PIXEL_BYTES]]),
    /// Any other kind of file \[ADU\].
    Values(&'a [f32]),
}

/// One flat of the stack.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layer<'a> {
    /// Its pixels.
    pub pixels: Pixels<'a>,
    /// From here on a pixel does not vote \[ADU\].
    pub saturation_adu: f32,
    /// 1 / level \[1/ADU\].
    pub per_level: f32,
}

/// Buffers in which a thread computes medians, reused from band to band.
pub(crate) struct MedianBuffers {
    network: Network,
    counts: Vec<Lanes<i16>>,
    values: Vec<Lanes<f32>>,
    few: Vec<f32>,
}

impl MedianBuffers {
    /// For stacks of `n` flats, as stored or scaled.
    pub(crate) fn new(n: usize, as_stored: bool) -> Self {
        let rows = |wanted: bool| if wanted { n } else { 0 };
        Self {
            network: Network::new(n),
            counts: vec![Lanes([0; LANES]); rows(as_stored)],
            values: vec![Lanes([0.0; LANES]); rows(!as_stored)],
            few: Vec::with_capacity(n),
        }
    }

    /// out = median_k N_k − pedestal \[ADU\] of layers that all hold counts.
    pub(crate) fn of_counts(&mut self, layers: &[(&[[u8; PIXEL_BYTES]], f32)], pedestal_adu: f64, out: &mut [f32]) {
        let layers: Vec<_> =
            layers.iter().map(|(pixels, saturation_adu)| (*pixels, last_vote(*saturation_adu))).collect();
        if layers.len() == self.counts.len() && layers.iter().all(|(pixels, _)| pixels.len() == out.len()) {
            counts_kernel(&layers, pedestal_adu, &self.network, &mut self.counts, &mut self.few, out);
        } else {
            out.fill(f32::NAN);
        }
    }

    /// out = median_k (N_k − pedestal) / level_k.
    pub(crate) fn of_scaled(&mut self, layers: &[Layer<'_>], pedestal_adu: f32, out: &mut [f32]) {
        let len = |layer: &Layer<'_>| match layer.pixels {
            Pixels::Counts(pixels) => pixels.len(),
            Pixels::Values(pixels) => pixels.len(),
        };
        if layers.len() == self.values.len() && layers.iter().all(|layer| len(layer) == out.len()) {
            scaled_kernel(layers, pedestal_adu, &self.network, &mut self.values, &mut self.few, out);
        } else {
            out.fill(f32::NAN);
        }
    }
}

/// The largest stored value that votes: its count is below the saturation level.
fn last_vote(saturation_adu: f32) -> i16 {
    let count = (saturation_adu.ceil() - 1.0).clamp(0.0, 65_535.0) as u16;
    (count ^ 0x8000) as i16
}

/// The count of a stored value \[ADU\].
#[inline(always)]
fn adu(stored: i16) -> f32 {
    f32::from(stored as u16 ^ 0x8000)
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn counts_kernel(
    layers: &[(&[[u8; PIXEL_BYTES]], i16)],
    pedestal_adu: f64,
    network: &Network,
    rows: &mut [Lanes<i16>],
    few: &mut Vec<f32>,
    out: &mut [f32],
) {
    let (lo, hi) = middle(network.n);
    for (block, out) in out.chunks_mut(LANES).enumerate() {
        let at = block * LANES..block * LANES + out.len();
        let mut silent = Lanes([0i16; LANES]);
        for ((pixels, last), row) in layers.iter().zip(rows.iter_mut()) {
            for ((to, silent), from) in row.0.iter_mut().zip(&mut silent.0).zip(&pixels[at.clone()]) {
                *to = i16::from_be_bytes(*from);
                *silent |= i16::from(*to > *last);
            }
        }
        network.run(rows);
        for ((out, a), b) in out.iter_mut().zip(&rows[lo].0).zip(&rows[hi].0) {
            *out = ((f64::from(adu(*a)) + f64::from(adu(*b))) / 2.0 - pedestal_adu) as f32;
        }
        if silent.0.iter().fold(0, |any, s| any | s) != 0 {
            for (i, out) in out.iter_mut().enumerate().filter(|(i, _)| silent.0[*i] != 0) {
                few.clear();
                few.extend(layers.iter().filter_map(|(pixels, last)| {
                    let stored = i16::from_be_bytes(pixels[at.start + i]);
                    (stored <= *last).then(|| adu(stored))
                }));
                *out = (f64::from(of_few(few, network.n)) - pedestal_adu) as f32;
            }
        }
    }
}

/// (N − pedestal) / level, and whether the pixel votes: not saturated, infinite or NaN.
#[inline(always)]
fn scaled(adu: f32, layer: &Layer<'_>, pedestal_adu: f32) -> (f32, bool) {
    ((adu - pedestal_adu) * layer.per_level, adu < layer.saturation_adu && adu > f32::NEG_INFINITY)
}

#[inline(always)]
fn load(value: (f32, bool), to: &mut f32, silent: &mut i32) {
    *to = if value.1 { value.0 } else { f32::INFINITY };
    *silent |= i32::from(!value.1);
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn scaled_kernel(
    layers: &[Layer],
    pedestal_adu: f32,
    network: &Network,
    rows: &mut [Lanes<f32>],
    few: &mut Vec<f32>,
    out: &mut [f32],
) {
    let (lo, hi) = middle(network.n);
    for (block, out) in out.chunks_mut(LANES).enumerate() {
        let at = block * LANES..block * LANES + out.len();
        let mut silent = Lanes([0i32; LANES]);
        for (layer, row) in layers.iter().zip(rows.iter_mut()) {
            let to = row.0.iter_mut().zip(&mut silent.0);
            match layer.pixels {
                Pixels::Counts(pixels) => to.zip(&pixels[at.clone()]).for_each(|((to, silent), from)| {
                    load(scaled(f32::from(count(*from)), layer, pedestal_adu), to, silent);
                }),
                Pixels::Values(pixels) => to.zip(&pixels[at.clone()]).for_each(|((to, silent), from)| {
                    load(scaled(*from, layer, pedestal_adu), to, silent);
                }),
            }
        }
        network.run(rows);
        for ((out, a), b) in out.iter_mut().zip(&rows[lo].0).zip(&rows[hi].0) {
            *out = mean_of_two(*a, *b);
        }
        if silent.0.iter().fold(0, |any, s| any | s) != 0 {
            for (i, out) in out.iter_mut().enumerate().filter(|(i, _)| silent.0[*i] != 0) {
                few.clear();
                few.extend(layers.iter().filter_map(|layer| {
                    let adu = match layer.pixels {
                        Pixels::Counts(pixels) => f32::from(count(pixels[at.start + i])),
                        Pixels::Values(pixels) => pixels[at.start + i],
                    };
                    let (value, votes) = scaled(adu, layer, pedestal_adu);
                    votes.then_some(value)
                }));
                *out = of_few(few, network.n);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// By a plain sort: the values that vote, NaN if they are not more than half.
    fn plain(mut voters: Vec<f32>, n: usize) -> f32 {
        if 2 * voters.len() <= n {
            return f32::NAN;
        }
        voters.sort_by(f32::total_cmp);
        let (lo, hi) = ((voters.len() - 1) / 2, voters.len() / 2);
        ((f64::from(voters[lo]) + f64::from(voters[hi])) / 2.0) as f32
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn both_kernels_give_the_median_of_a_plain_sort_bit_for_bit(
            n in 1usize..50, size in 1usize..400, seed in any::<u64>(), top in prop::sample::select(vec![20_000.0f32, 60_000.5, 65_535.0, 1e6]),
        ) {
            let mut state = seed | 1;
            let mut next = || { state ^= state << 13; state ^= state >> 7; state ^= state << 17; state };
            let frames: Vec<Vec<u16>> = (0..n).map(|_| (0..size).map(|_| (next() >> 20) as u16).collect()).collect();
            let bytes: Vec<Vec<[u8; 2]>> =
                frames.iter().map(|f| f.iter().map(|v| (v ^ 0x8000).to_be_bytes()).collect()).collect();
            let adu: Vec<Vec<f32>> = frames
                .iter()
                .map(|f| f.iter().map(|v| if next() % 9 == 0 { f32::NAN } else { f32::from(*v) }).collect())
                .collect();
            let mut got = vec![0.0; size];
            let layers: Vec<_> = bytes.iter().map(|b| (b.as_slice(), top)).collect();
            MedianBuffers::new(n, true).of_counts(&layers, 500.0, &mut got);
            for i in 0..size {
                let voters = frames.iter().map(|f| f32::from(f[i])).filter(|v| *v < top).collect();
                let want = (f64::from(plain(voters, n)) - 500.0) as f32;
                prop_assert!(got[i] == want || got[i].is_nan() && want.is_nan(), "{} {want}", got[i]);
            }
            // Every other flat is of another kind of file, with NaN.
            let per_level = |k: usize| 1.0 / (9_000.0 + 77.0 * k as f32);
            let layers: Vec<_> = (0..n)
                .map(|k| Layer {
                    pixels: if k.is_multiple_of(2) { Pixels::Counts(&bytes[k]) } else { Pixels::Values(&adu[k]) },
                    saturation_adu: top,
                    per_level: per_level(k),
                })
                .collect();
            MedianBuffers::new(n, false).of_scaled(&layers, 500.0, &mut got);
            for i in 0..size {
                let value = |k: usize| if k.is_multiple_of(2) { f32::from(frames[k][i]) } else { adu[k][i] };
                let voters = (0..n).filter(|k| value(*k) < top).map(|k| (value(k) - 500.0) * per_level(k)).collect();
                let want = plain(voters, n);
                prop_assert!(got[i].to_bits() == want.to_bits() || got[i].is_nan() && want.is_nan(), "{} {want}", got[i]);
            }
        }
    }
}
