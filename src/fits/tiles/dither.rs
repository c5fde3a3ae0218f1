//! The dither of quantised floats: integers of a tile to physical values.
//!
//! Physical units of the file. v = ZZERO + ZSCALE (i − r + ½) with r of the standard's table of random numbers (FITS
//! 4.0 section 10.2 and appendix I). It does not cover the scaling itself ([`crate::fits::linear`]).

use std::sync::OnceLock;

use crate::fits::linear::Linear;

/// How many random numbers the standard's table holds.
const N_RANDOM: usize = 10_000;
/// The integer that stands for exactly 0 under SUBTRACTIVE_DITHER_2 (FITS 4.0 section 10.2.2).
const EXACT_ZERO: i32 = -2_147_483_646;

/// How floats were rounded to integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dither {
    /// Not at random.
    None,
    /// With numbers that begin at ZDITHER0.
    Subtractive(i64),
    /// The same, with exact zeros.
    ExactZeros(i64),
}

/// Takes the dither out of tile `index` (0-based), in place of [`Linear::integers`]. All pixels of a tile in one go.
pub(super) fn undither(stored: &[i32], linear: &Linear, dither: Dither, index: usize, out: &mut [f32]) {
    let (start, exact_zeros) = match dither {
        Dither::None => return linear.integers(stored, false, out),
        Dither::Subtractive(start) => (start, false),
        Dither::ExactZeros(start) => (start, true),
    };
    let table = random();
    // (row + ZDITHER0 − 2) mod 10000 with rows from 1
    let mut seed = (index as i64).wrapping_add(start).wrapping_sub(1).rem_euclid(N_RANDOM as i64) as usize;
    let mut next = (table[seed] * 500.0) as usize;
    for (to, from) in out.iter_mut().zip(stored) {
        *to = if linear.blank == Some(i64::from(*from)) {
            f32::NAN
        } else if exact_zeros && *from == EXACT_ZERO {
            0.0
        } else {
            linear.real(f64::from(*from) - f64::from(table[next]) + 0.5)
        };
        next += 1;
        if next == N_RANDOM {
            seed = (seed + 1) % N_RANDOM;
            next = (table[seed] * 500.0) as usize;
        }
    }
}

/// The standard's random numbers (FITS 4.0 appendix I): Park and Miller's generator from 1.
fn random() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut seed = 1u64;
        (0..N_RANDOM)
            .map(|_| {
                seed = seed * 16_807 % 2_147_483_647;
                (seed as f64 / 2_147_483_647.0) as f32
            })
            .collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_random_numbers_end_where_the_standard_says() {
        // FITS 4.0 appendix I: the 10 000th seed is 1043618065.
        let last = random()[N_RANDOM - 1];
        assert_eq!(last, (1_043_618_065.0 / 2_147_483_647.0) as f32);
    }
}
