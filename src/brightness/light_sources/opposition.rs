//! Limits of the Moon's phase law.

/// Phase angle up to which the law of Cox is trusted \[deg\]; it was fitted to less.
pub const MOON_LAW_MAX_DEG: f64 = 150.0;

/// Phase angle below which the surge is added \[deg\] (Krisciunas & Schaefer 1991, PASP 103, 1033).
pub(super) const OPPOSITION_DEG: f64 = 7.0;
