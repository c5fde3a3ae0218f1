//! How likely a number of agreements is by chance.

use statrs::distribution::{Binomial, DiscreteCDF};

/// P(at least k of n), each with probability p.
pub(super) fn tail(n: u64, p: f64, k: u64) -> f64 {
    if k == 0 {
        return 1.0;
    }
    Binomial::new(p, n).map_or(1.0, |b| b.sf(k - 1))
}
