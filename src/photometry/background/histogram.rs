//! The histogram of a box and its clip.
//!
//! In levels of the histogram. Sums of counts are whole numbers below 2⁵³: exact in f64 and in any order, so that a
//! range which shrinks needs only what it loses, not a new pass. It does not cover what a level is worth.

use multiversion::multiversion;

/// Bins of a [`Bins`], as many as a u16 can name: an index needs no check. Only those of the levels are ever touched.
const BINS: usize = 1 << 16;

/// Counts of pixels: below the range, by level, above the range.
pub(super) struct Bins {
    pub counts: Box<[u32; BINS]>,
}

impl Bins {
    pub fn new() -> Self {
        Self { counts: Box::new([0; BINS]) }
    }

    /// Empties the bins of a histogram of so many levels.
    pub fn clear(&mut self, levels: usize) {
        self.counts[..levels + 2].fill(0);
    }

    /// The counts of the levels.
    pub fn levels(&self, levels: usize) -> &[u32] {
        &self.counts[1..=levels]
    }
}

/// Median, mean and standard deviation of a clipped histogram \[levels\].
pub(super) struct ClippedHistogram {
    pub median: f64,
    pub mean: f64,
    pub sigma: f64,
}

/// Counts of the levels below `at`: Σc, Σcx, Σcx².
#[derive(Clone, Copy)]
struct Below {
    at: usize,
    n: f64,
    sum: f64,
    square: f64,
}

impl Below {
    fn move_to(&mut self, counts: &[u32], to: usize) {
        let (first, last, sign) = if to >= self.at { (self.at, to, 1.0) } else { (to, self.at, -1.0) };
        let (n, sum, square) = tally(&counts[first..last], first);
        self.at = to;
        self.n += sign * n;
        self.sum += sign * sum;
        self.square += sign * square;
    }
}

/// Clips a histogram at ±k σ around its median until σ changes by less than 1e-4 (at most 100 times).
pub(super) fn clip_histogram(counts: &[u32], k: f64) -> ClippedHistogram {
    let last = counts.len() - 1;
    let mut now = ClippedHistogram { median: 0.0, mean: 0.0, sigma: 10.0 * last as f64 };
    let mut low = Below { at: 0, n: 0.0, sum: 0.0, square: 0.0 };
    let mut middle = low;
    middle.move_to(counts, counts.len() / 2);
    let mut high = middle;
    high.move_to(counts, counts.len());
    let mut previous_sigma = 1.0;
    for _ in 0..100 {
        if now.sigma < 0.1 || (now.sigma / previous_sigma - 1.0).abs() <= 1e-4 {
            break;
        }
        previous_sigma = now.sigma;
        let n = high.n - low.n;
        if n == 0.0 {
            now.sigma = 0.0;
            break;
        }
        // about the low end, as whole numbers
        let from = low.at as f64;
        let sum = (high.sum - low.sum) - from * n;
        let square = (high.square - low.square) - from * (from * n + 2.0 * sum);
        let mean = sum / n;
        now.mean = from + mean;
        now.sigma = (square / n - mean * mean).max(0.0).sqrt();
        now.median = from + median_level(counts, &mut middle, &low, 0.5 * n);
        let first = (now.median - k * now.sigma).round().clamp(0.0, last as f64) as usize;
        let end = (now.median + k * now.sigma).round().clamp(first as f64, last as f64) as usize;
        low.move_to(counts, first);
        high.move_to(counts, end + 1);
    }
    now
}

/// Median of the counts from `low` on, `half` of which lie below it, each spread evenly over its level: in levels from
/// `low`. `middle` is where the search starts and ends.
fn median_level(counts: &[u32], middle: &mut Below, low: &Below, half: f64) -> f64 {
    let mut below = middle.n - low.n;
    let mut at = middle.at;
    while below >= half && at > 0 {
        at -= 1;
        below -= f64::from(counts[at]);
    }
    while at + 1 < counts.len() && below + f64::from(counts[at]) < half {
        below += f64::from(counts[at]);
        at += 1;
    }
    (middle.at, middle.n) = (at, below + low.n);
    at as f64 - low.at as f64 - 0.5 + (half - below) / f64::from(counts[at])
}

/// Σc, Σcx and Σcx² of counts whose first level is `first`.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn tally(counts: &[u32], first: usize) -> (f64, f64, f64) {
    const LANES: usize = 16;
    // the sum of the counts, of those sums and of those: with d the chunks from a count to the end, itself included,
    // Σc, Σcd and Σcd(d + 1)/2, without a product
    let (mut once, mut twice, mut thrice) = ([0i64; LANES], [0i64; LANES], [0i64; LANES]);
    let (chunks, rest) = counts.as_chunks::<LANES>();
    for chunk in chunks {
        for l in 0..LANES {
            once[l] += i64::from(chunk[l]);
            twice[l] += once[l];
            thrice[l] += twice[l];
        }
    }
    let (step, end) = (LANES as i64, (first + chunks.len() * LANES) as i64);
    let (mut n, mut sum, mut square) = (0, 0, 0);
    for l in 0..LANES {
        // x = from − d · step
        let from = end + l as i64;
        n += once[l];
        sum += from * once[l] - step * twice[l];
        square += from * (from * once[l] - 2 * step * twice[l]) + step * step * (2 * thrice[l] - twice[l]);
    }
    for (x, c) in (end..).zip(rest) {
        let c = i64::from(*c);
        n += c;
        sum += c * x;
        square += c * x * x;
    }
    (n as f64, sum as f64, square as f64)
}
