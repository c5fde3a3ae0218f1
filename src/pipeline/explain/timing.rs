//! How scenes are sampled and timed.

use crate::base::constants::MAG_PER_LN;

/// Scenes a piece is computed for.
pub(super) const SCENES: usize = 32;

/// Up to `most` of `of`, evenly spread.
pub(super) fn sample<T: Copy>(of: &[T], most: usize) -> Vec<T> {
    let n = of.len().min(most);
    (0..n).map(|k| of[k * of.len() / n]).collect()
}

/// CPU time of one call of `work` \[µs\], over calls 0 to n − 1 again and again.
pub(super) fn each_us(cpu_s: &dyn Fn() -> f64, n: usize, mut work: impl FnMut(usize)) -> f64 {
    let (start, mut calls) = (cpu_s(), 0usize);
    loop {
        (0..n).for_each(&mut work);
        calls += n.max(1);
        let used_s = cpu_s() - start;
        // a clock that stands still must not hold everything up
        if used_s >= LEAST_S || used_s <= 0.0 {
            return 1e6 * used_s / calls as f64;
        }
    }
}

/// How much brighter light of `flux` is with `more` \[mag\].
pub(super) fn brighter_mag(flux: f64, more: f64) -> f64 {
    match (flux > 0.0, more == 0.0) {
        (_, true) => 0.0,
        (false, _) => f64::INFINITY,
        _ => MAG_PER_LN * (more / flux).abs().ln_1p(),
    }
}

/// A piece is computed again and again for at least this long \[s\].
pub(super) const LEAST_S: f64 = 0.01;
