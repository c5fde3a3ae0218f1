//! The sigma clip and the smoothed median of a few thousand pixels, by counting instead of ordering.
//!
//! The same definitions as [`stats::sigma_clip`] and [`stats::smoothed_median`] for f32 pixels. An order statistic is
//! searched over the integers that order as the floats do: each step counts the whole slice, at many values per
//! instruction, which is quicker than moving them. Units are those of the values. It does not cover values that are not
//! finite.

use multiversion::multiversion;

use crate::base::constants::SIGMA_PER_MAD;
use crate::base::stats;

/// f64 sums are kept in this many lanes on every machine, so that all give the same bits.
const LANES: usize = 16;
/// What is further than this from its like is something else \[σ\]: blocks of a sky, cells, pieces and sides of a trail, sizes in a pass.
pub(crate) const CLIP_SIGMA: f64 = 3.0;
/// Pixels further than this from the sky are hits \[σ\]: so far out that the skewness of Poisson counts costs nothing.
pub(crate) const HIT_SIGMA: f64 = 5.0;

/// The values of a sample that a clip keeps, and their location.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Location {
    /// [`stats::smoothed_median`] of the kept values.
    pub location: f64,
    /// Standard deviation, corrected for the cut tails.
    pub sigma: f64,
    /// Values kept.
    pub n: usize,
}

/// Buffers that outlive a star.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// The sample.
    pub values: Vec<f32>,
    keys: Vec<i32>,
    deviations: Vec<i32>,
    around: Vec<i32>,
}

/// Clips `scratch.values`, all finite, at ±`k` σ and finds the location of what is left; spoils the sample.
///
/// `None` if there are no values or `k` is not positive.
pub(crate) fn clipped_location(scratch: &mut Scratch, k: f64) -> Option<Location> {
    let Scratch { values, keys, deviations, around } = scratch;
    if values.is_empty() || k.is_nan() || k <= 0.0 {
        return None;
    }
    let total = values.len();
    keys.clear();
    keys.resize(total, 0);
    deviations.clear();
    deviations.resize(total, 0);
    order_keys(values, keys);
    let shrink = stats::truncation_shrink(k);

    let central = Central::of(keys, around);
    let mut centre = central.middle(keys, 0, total);
    let mut sigma = SIGMA_PER_MAD * median_deviation(values, centre, deviations);
    if sigma <= 0.0 {
        sigma = sums_between(values, f32::MIN, f32::MAX, centre).sd();
    }
    let (mut within, mut kept) = ((f32::MIN, f32::MAX), Sums { n: total, ..Sums::default() });
    for _ in 0..50 {
        let (low, high) = floats_within(centre, k * sigma);
        let sums = sums_between(values, low, high, centre);
        if sums.n == 0 {
            break;
        }
        let unchanged = sums.n == kept.n;
        if !(unchanged && sums.below == kept.below) {
            centre = central.middle(keys, sums.below, sums.n);
        }
        (within, kept) = ((low, high), sums);
        sigma = sums.sd() / shrink;
        if unchanged {
            break;
        }
    }
    let location = smoothed_median(values, within, kept, centre, sigma);
    Some(Location { location, sigma, n: kept.n })
}

/// The float of an order key.
fn float_of(key: i32) -> f32 {
    f32::from_bits((key ^ (((key >> 31) as u32) >> 1) as i32) as u32)
}

/// The integers that order as the floats do (`f32::total_cmp`); the map is its own inverse.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn order_keys(values: &[f32], keys: &mut [i32]) {
    for (key, value) in keys.iter_mut().zip(values) {
        let bits = value.to_bits() as i32;
        *key = bits ^ (((bits >> 31) as u32) >> 1) as i32;
    }
}

/// The keys about the median, which hold the median of all but coarse clips.
struct Central<'a> {
    keys: &'a [i32],
    /// Keys below them.
    below: usize,
}

impl<'a> Central<'a> {
    /// Gathers the keys about the median of `keys`.
    fn of(keys: &[i32], around: &'a mut Vec<i32>) -> Self {
        let (low, high, below) = bracket(keys, keys.len() / 2, CENTRAL);
        around.clear();
        around.resize(keys.len() + 1, 0);
        let n = gather(keys, low, high, around);
        Self { keys: &around[..n], below }
    }

    /// The median of the values of rank `first` to `first + count` of `all`; the mean of the two middle ones for an
    /// even number.
    fn middle(&self, all: &[i32], first: usize, count: usize) -> f64 {
        let rank = first + count / 2;
        let (keys, rank) = match rank.checked_sub(self.below) {
            // the next lower rank is needed, too
            Some(rank) if rank > 0 && rank < self.keys.len() => (self.keys, rank),
            _ => (all, rank),
        };
        let (key, below) = select(keys, rank);
        let upper = f64::from(float_of(key));
        if count % 2 == 1 {
            return upper;
        }
        // the next lower rank is of the same key, or the highest below it
        let lower = if below < rank { upper } else { f64::from(float_of(highest_below(keys, key))) };
        0.5 * (lower + upper)
    }
}

/// Copies the keys from `low` to `high` to the front of `to`, which has one place more than there are keys; how many.
fn gather(keys: &[i32], low: i32, high: i32, to: &mut [i32]) -> usize {
    let mut n = 0;
    // every key is written, and only those that belong move the end: no branch to be guessed
    for key in keys {
        to[n] = *key;
        n += usize::from(*key >= low && *key <= high);
    }
    n
}

/// About so many keys are gathered about the median.
const CENTRAL: usize = 128;
/// So few keys are sorted instead of being divided by further counts.
const FEW: usize = 8;

/// The key of a rank, and how many keys are below it.
fn select(keys: &[i32], rank: usize) -> (i32, usize) {
    let (low, high, below) = bracket(keys, rank, FEW);
    if low == high {
        return (low, below);
    }
    let mut found = Vec::with_capacity(FEW);
    for chunk in keys.chunks(LANES) {
        if chunk.iter().fold(false, |any, key| any | (*key >= low && *key <= high)) {
            found.extend(chunk.iter().filter(|key| (low..=high).contains(*key)));
        }
    }
    found.sort_unstable();
    let key = found.get(rank - below).copied().unwrap_or(low);
    (key, below + found.iter().take_while(|other| **other < key).count())
}

/// A range that holds the key of a rank and at most `few` keys, or one key however often; how many are below it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn bracket(keys: &[i32], rank: usize, few: usize) -> (i32, i32, usize) {
    let count_below = |limit: i32| -> usize { keys.iter().map(|key| i32::from(*key < limit)).sum::<i32>() as usize };
    let (mut low, mut high) = (i32::MAX, i32::MIN);
    for key in keys {
        (low, high) = (low.min(*key), high.max(*key));
    }
    // `below` keys are lower than `low`, `not_above` are not higher than `high`
    let (mut below, mut not_above) = (0, keys.len());
    let mut step = 0;
    while low < high && not_above - below > few {
        let width = i64::from(high) - i64::from(low);
        // between its ends a range is nearly straight: guesses a little below and a little above the rank close in on
        // it from both sides; every third step halves the range, whatever it holds. Always low < middle ≤ high.
        let aim = if step % 3 == 0 { rank + few / 3 } else { rank.saturating_sub(few / 3) };
        let share = (aim.max(below) - below) as f64 / (not_above - below) as f64;
        let guess = if step % 3 == 2 { width / 2 } else { (width as f64 * share) as i64 };
        let middle = (i64::from(low) + 1 + guess.min(width - 1)) as i32;
        let count = count_below(middle);
        if count <= rank {
            (low, below) = (middle, count);
        } else {
            (high, not_above) = (middle - 1, count);
        }
        step += 1;
    }
    (low, high, below)
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn highest_below(keys: &[i32], limit: i32) -> i32 {
    // lanes spelled out: as one running maximum it is compiled to branches
    let mut highest = [i32::MIN; LANES];
    let mut chunks = keys.chunks_exact(LANES);
    for chunk in &mut chunks {
        for lane in 0..LANES {
            let key = if chunk[lane] < limit { chunk[lane] } else { i32::MIN };
            highest[lane] = highest[lane].max(key);
        }
    }
    let rest = chunks.remainder().iter().filter(|key| **key < limit);
    rest.chain(&highest).fold(i32::MIN, |highest, key| highest.max(*key))
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn deviation_keys(values: &[f32], centre: f64, keys: &mut [i32]) {
    for (key, value) in keys.iter_mut().zip(values) {
        *key = ((f64::from(*value) - centre).abs() as f32).to_bits() as i32;
    }
}

/// The median of |v − centre|, to the last digit of f64: found among deviations rounded to f32, which keep their order,
/// then looked up among the few that round to the same.
fn median_deviation(values: &[f32], centre: f64, keys: &mut [i32]) -> f64 {
    deviation_keys(values, centre, keys);
    let rank = values.len() / 2;
    let (key, below) = select(keys, rank);
    let exact = |key: i32| {
        let mut found = Vec::new();
        for (values, keys) in values.chunks(64).zip(keys.chunks(64)) {
            if keys.iter().fold(false, |any, k| any | (*k == key)) {
                let same = values.iter().zip(keys).filter(|(_, k)| **k == key);
                found.extend(same.map(|(v, _)| (f64::from(*v) - centre).abs()));
            }
        }
        found.sort_unstable_by(f64::total_cmp);
        found
    };
    let same = exact(key);
    let at = |sorted: &[f64], k: usize| sorted.get(k).copied().unwrap_or(0.0);
    let upper = at(&same, rank - below);
    if values.len() % 2 == 1 {
        return upper;
    }
    let lower = if below < rank {
        at(&same, rank - below - 1)
    } else {
        exact(highest_below(keys, key)).last().copied().unwrap_or(0.0)
    };
    0.5 * (lower + upper)
}

/// The lowest and the highest f32 with |v − centre| ≤ `limit` as f64 has it.
///
/// A float's distance from the centre grows with the float, so what is kept is a range, and comparing f32 decides.
fn floats_within(centre: f64, limit: f64) -> (f32, f32) {
    let is_low = |v: f32| f64::from(v) - centre < -limit;
    let is_high = |v: f32| f64::from(v) - centre > limit;
    let bounded = |v: f64| v.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
    let (mut low, mut high) = (bounded(centre - limit), bounded(centre + limit));
    while low > f32::MIN && !is_low(low.next_down()) {
        low = low.next_down();
    }
    while is_low(low) {
        low = low.next_up();
    }
    while high < f32::MAX && !is_high(high.next_up()) {
        high = high.next_up();
    }
    while is_high(high) {
        high = high.next_down();
    }
    (low, high)
}

/// Numbers and sums of a range of values.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    n: usize,
    /// Values below the range.
    below: usize,
    /// Σ(v − zero) and Σ(v − zero)².
    first: f64,
    second: f64,
}

impl Sums {
    /// Standard deviation (n − 1); about a zero near the mean nothing cancels.
    fn sd(&self) -> f64 {
        let n = self.n as f64;
        if self.n > 1 { ((self.second - self.first * self.first / n).max(0.0) / (n - 1.0)).sqrt() } else { 0.0 }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn sums_between(values: &[f32], low: f32, high: f32, zero: f64) -> Sums {
    let (mut first, mut second) = ([0f64; LANES], [0f64; LANES]);
    let (mut n, mut below) = ([0i32; LANES], [0i32; LANES]);
    for chunk in values.chunks(LANES) {
        // a short chunk is filled up with a value above the range
        let mut block = [f32::INFINITY; LANES];
        block[..chunk.len()].copy_from_slice(chunk);
        for lane in 0..LANES {
            let value = block[lane];
            let inside = value >= low && value <= high;
            let d = if inside { f64::from(value) - zero } else { 0.0 };
            first[lane] += d;
            second[lane] += d * d;
            n[lane] += i32::from(inside);
            below[lane] += i32::from(value < low);
        }
    }
    Sums {
        n: n.iter().sum::<i32>() as usize,
        below: below.iter().sum::<i32>() as usize,
        first: first.iter().sum(),
        second: second.iter().sum(),
    }
}

/// [`stats::smoothed_median`] of the values `within` a range; the others become ±∞ and count −1 or 1 in every sum,
/// exactly, which is subtracted again.
fn smoothed_median(values: &mut [f32], within: (f32, f32), kept: Sums, start: f64, sigma: f64) -> f64 {
    let h = stats::SMOOTHING_SIGMA * sigma;
    if h.is_nan() || h <= 0.0 {
        return start;
    }
    push_out(values, within.0, within.1);
    let above = values.len() - kept.n - kept.below;
    let surplus = above as f64 - kept.below as f64;
    let mut mu = start;
    for _ in 0..30 {
        let (sum, inside) = clamped_sum(values, mu, 1.0 / h);
        // Newton's step; never more than h, never divided by an empty middle
        let step = (h * (sum - surplus) / inside.max(kept.n / 8).max(1) as f64).clamp(-h, h);
        mu += step;
        if step.abs() < 1e-9 * sigma {
            break;
        }
    }
    mu
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn push_out(values: &mut [f32], low: f32, high: f32) {
    for value in values {
        let v = *value;
        *value = if v < low { f32::NEG_INFINITY } else { v };
        *value = if v > high { f32::INFINITY } else { *value };
    }
}

/// Σ clamp((v − mu)·scale, −1, 1), and how many are strictly between.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn clamped_sum(values: &[f32], mu: f64, scale: f64) -> (f64, usize) {
    let (mut sums, mut inside) = ([0f64; LANES], [0i64; LANES]);
    let mut chunks = values.chunks_exact(LANES);
    for chunk in &mut chunks {
        for lane in 0..LANES {
            let d = (f64::from(chunk[lane]) - mu) * scale;
            let low = if d > -1.0 { d } else { -1.0 };
            sums[lane] += if low < 1.0 { low } else { 1.0 };
            inside[lane] += i64::from(d > -1.0 && d < 1.0);
        }
    }
    for (lane, value) in chunks.remainder().iter().enumerate() {
        let d = (f64::from(*value) - mu) * scale;
        sums[lane] += d.clamp(-1.0, 1.0);
        inside[lane] += i64::from(d > -1.0 && d < 1.0);
    }
    (sums.iter().sum(), inside.iter().sum::<i64>() as usize)
}

/// Level and error of the sky from its pixels less `zero_e`, unbiased for Poisson counts with Gaussian read noise.
pub(crate) fn clipped_sky(values: &mut [f64], zero_e: f64, clip_sigma: f64) -> Option<(f64, f64, stats::Clipped)> {
    let clipped = stats::sigma_clip(values, clip_sigma)?;
    let location = stats::smoothed_median(&values[..clipped.n], clipped.median, clipped.sigma)?;
    let (level, err) = level_and_error(location, zero_e, clipped.sigma, clipped.n, clip_sigma);
    Some((level, err, clipped))
}

/// The median of skewed noise lies below its mean: median = μ − c σγ, γ = λ/σ³ with λ = S the Poisson share of the
/// variance. For a plain median c = 1/6: a sixth of an electron per pixel, 50 e⁻ in an aperture of 300 px.
pub(super) fn level_and_error(location: f64, zero_e: f64, sigma: f64, n: usize, clip_sigma: f64) -> (f64, f64) {
    let variance = sigma * sigma;
    let poisson_share = if variance > 0.0 { ((location + zero_e).max(0.0) / variance).min(1.0) } else { 0.0 };
    let level = location + stats::smoothed_median_skew_shift(clip_sigma) * poisson_share;
    (level, (stats::smoothed_median_variance_factor() * variance / n as f64).sqrt())
}
