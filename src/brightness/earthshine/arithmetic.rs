//! Exponential, logarithm and power as short branch-free series, so that a whole row of nodes goes through at once.
//!
//! Dimensionless. Relative error below 4e-16 (power: times the exponent of e). Not included: infinities, NaN,
//! subnormals.

use std::f64::consts::{LN_2, LOG2_E};

/// 1.5·2⁵²: adding it rounds to whole numbers and leaves them in the low bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts, the first with 21 trailing zero bits.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// Bits of 1.0 less those of sqrt(1/2), to round the exponent.
const TO_ROOT_HALF: u64 = 0x3ff0_0000_0000_0000 - 0x3fe6_a09e_667f_3bcd;
/// Exponent of 2 at which a `u64` below 2⁵² becomes a number by bits alone.
const TWO_52: u64 = 0x4330_0000_0000_0000;

/// e^x for x ≤ 700; 0 below −700. `QUICK` omits the last terms: relative error 6e-9.
#[inline(always)]
pub(super) fn exp<const QUICK: bool>(x: f64) -> f64 {
    // x = j ln 2 + r, |r| ≤ ln 2 / 2
    let (given, x) = (x, x.max(-700.0));
    let shifted = x * LOG2_E + ROUNDER;
    let j = shifted - ROUNDER;
    let r = (x - j * LN_2_HIGH) - j * LN_2_LOW;
    let r2 = r * r;
    let r4 = r2 * r2;
    let low = (1.0 + r) + r2 * (1.0 / 2.0 + r * (1.0 / 6.0));
    let middle = (1.0 / 24.0 + r * (1.0 / 120.0)) + r2 * (1.0 / 720.0 + r * (1.0 / 5040.0));
    if QUICK {
        return scaled(low + r4 * middle, shifted, given);
    }
    let high = (1.0 / 40_320.0 + r * (1.0 / 362_880.0)) + r2 * (1.0 / 3_628_800.0 + r * (1.0 / 39_916_800.0));
    let last = 1.0 / 479_001_600.0 + r * (1.0 / 6_227_020_800.0);
    scaled(low + r4 * (middle + r4 * (high + r4 * last)), shifted, given)
}

/// A series times 2^j, the exponent in the low bits of `shifted`.
#[inline(always)]
fn scaled(series: f64, shifted: f64, given: f64) -> f64 {
    let power = series * f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    if given >= -700.0 { power } else { 0.0 }
}

/// ln x for normal positive x. `QUICK` omits the last terms: error 2e-9.
#[inline(always)]
pub(super) fn ln<const QUICK: bool>(x: f64) -> f64 {
    // x = 2^j m, sqrt(1/2) ≤ m < sqrt 2; ln m = 2 artanh((m − 1)/(m + 1))
    let bits = x.to_bits();
    let exponent = bits.wrapping_add(TO_ROOT_HALF) >> 52;
    let m = f64::from_bits(bits.wrapping_sub(exponent << 52).wrapping_add(1023 << 52));
    let j = f64::from_bits(exponent | TWO_52) - (4_503_599_627_370_496.0 + 1023.0);
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let z2 = z * z;
    let z4 = z2 * z2;
    let low = (1.0 / 3.0 + z * (1.0 / 5.0)) + z2 * (1.0 / 7.0 + z * (1.0 / 9.0));
    if QUICK {
        return j * LN_2 + 2.0 * (s + s * (z * low));
    }
    let high = (1.0 / 11.0 + z * (1.0 / 13.0)) + z2 * (1.0 / 15.0 + z * (1.0 / 17.0));
    let last = 1.0 / 19.0 + z * (1.0 / 21.0);
    let series = z * (low + z4 * (high + z4 * last));
    j * LN_2 + 2.0 * (s + s * series)
}

/// max(0, c)ⁿ for n ≥ 0; 0 for c ≤ 0 even where n = 0.
#[inline(always)]
pub(super) fn positive_power<const QUICK: bool>(c: f64, n: f64) -> f64 {
    let power = exp::<QUICK>(n * ln::<QUICK>(c.max(1e-300)));
    if c > 0.0 { power } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_and_logarithm_are_those_of_the_library() {
        for step in 0..20_000 {
            let x = -690.0 + 0.0695 * f64::from(step);
            assert!((exp::<false>(x) / x.exp() - 1.0).abs() < 5e-16, "exp {x}");
            let y = (x / 3.0).exp();
            assert!((ln::<false>(y) - y.ln()).abs() <= 3e-16 * y.ln().abs().max(0.5), "ln {y}");
        }
        assert_eq!(exp::<false>(0.0), 1.0);
        assert_eq!(ln::<false>(1.0), 0.0);
    }

    #[test]
    fn the_quick_forms_are_good_to_1e_8() {
        for step in 0..20_000 {
            let x = -690.0 + 0.0695 * f64::from(step);
            assert!((exp::<true>(x) / x.exp() - 1.0).abs() < 1e-8, "exp {x}");
            let y = (x / 3.0).exp();
            assert!((ln::<true>(y) - y.ln()).abs() < 1e-8, "ln {y}");
        }
    }

    #[test]
    fn a_power_is_the_librarys_and_nothing_below_zero() {
        for (c, n) in [(0.3_f64, 7.31_f64), (1.0, 1e6), (1.0 - 1e-9, 1e6), (1e-9, 0.01), (0.5, 0.0)] {
            assert!((positive_power::<false>(c, n) / c.powf(n) - 1.0).abs() < 1e-13, "{c} {n}");
        }
        assert_eq!(positive_power::<false>(-0.1, 0.0), 0.0);
        assert_eq!(positive_power::<false>(0.0, 2.0), 0.0);
        assert!(positive_power::<false>(1e-300, 50.0) < 1e-300);
    }
}
