//! Stored numbers to physical values: v = BZERO + BSCALE i, and which integer means "undefined".
//!
//! Physical units of the file; computed in f64, rounded once to f32. A header whose scaling cannot be meant (BSCALE =
//! 0, a text, a BLANK that is not an integer) is refused. It does not cover dithered floats ([`super::tiles`]).

use super::cards::Header;

/// v = zero + scale · i, with the integer that means "undefined".
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Linear {
    pub(crate) scale: f64,
    pub(crate) zero: f64,
    pub(crate) blank: Option<i64>,
}

impl Linear {
    /// Integers as they are.
    pub(crate) const UNIT: Self = Self { scale: 1.0, zero: 0.0, blank: None };

    /// The scaling a header states; `blank_key` is BLANK or ZBLANK and counts for integers alone.
    ///
    /// # Errors
    /// In words, naming keyword and value.
    pub(crate) fn of(header: &Header, blank_key: &str) -> Result<Self, String> {
        let number = |key: &str, absent: f64| match header.card(key) {
            None => Ok(absent),
            Some(card) => header.number(key).ok_or_else(|| format!("{key} = '{}' is not a number", card.value)),
        };
        let (scale, zero) = (number("BSCALE", 1.0)?, number("BZERO", 0.0)?);
        if scale == 0.0 {
            return Err("BSCALE = 0 makes every pixel BZERO; write the right scale, or blank the card".into());
        }
        let blank = match header.card(blank_key).filter(|_| header.bitpix() > 0) {
            None => None,
            Some(card) => {
                let value = header.integer(blank_key);
                Some(value.ok_or_else(|| format!("{blank_key} = '{}' is not a whole number", card.value))?)
            }
        };
        Ok(Self { scale, zero, blank })
    }

    /// One value; BLANK and whatever f32 cannot hold are NaN.
    #[inline(always)]
    pub(crate) fn real(&self, stored: f64) -> f32 {
        let value = self.zero + self.scale * stored;
        finite(value as f32)
    }

    /// One integer.
    #[inline(always)]
    pub(crate) fn integer(&self, stored: i64) -> f32 {
        if self.blank == Some(stored) { f32::NAN } else { self.real(stored as f64) }
    }

    /// One integer of 64 bits: BZERO = 2⁶³, which makes it unsigned, is added before f64 rounds.
    pub(crate) fn long(&self, stored: i64) -> f32 {
        const LIMIT: f64 = 2e19;
        if self.scale == 1.0 && self.zero.fract() == 0.0 && self.zero.abs() < LIMIT && self.blank != Some(stored) {
            return (i128::from(stored) + self.zero as i128) as f32;
        }
        self.integer(stored)
    }

    /// A row of integers; `narrow` ones have 16 bits at the most.
    pub(crate) fn integers(&self, stored: &[i32], narrow: bool, out: &mut [f32]) {
        // The usual counts: whole BZERO, no BLANK, and sums that i32 and f32 hold exactly.
        let zero = self.zero as i32;
        let small = |v: &i32| v.unsigned_abs() < 1 << 23;
        let plain = self.scale == 1.0 && self.blank.is_none() && f64::from(zero) == self.zero && small(&zero);
        if plain && (narrow || stored.iter().all(small)) {
            out.iter_mut().zip(stored).for_each(|(to, from)| *to = (from + zero) as f32);
        } else {
            out.iter_mut().zip(stored).for_each(|(to, from)| *to = self.integer(i64::from(*from)));
        }
    }
}

/// NaN for whatever is not finite.
#[inline(always)]
pub(crate) fn finite(value: f32) -> f32 {
    if value.is_finite() { value } else { f32::NAN }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_of_scaling_give_the_same_and_blank_is_not_a_number() {
        let linear = Linear { scale: 1.0, zero: 32_768.0, blank: None };
        let stored: Vec<i32> = (-32_768..32_768).step_by(7).collect();
        let mut out = vec![0.0; stored.len()];
        linear.integers(&stored, true, &mut out);
        assert!(stored.iter().zip(&out).all(|(s, v)| linear.integer(i64::from(*s)) == *v));
        let blank = Linear { blank: Some(-32_768), ..linear };
        blank.integers(&stored, true, &mut out);
        assert!(out[0].is_nan() && out[1] == 7.0);
        assert!(Linear { scale: 1e300, ..linear }.integer(1 << 40).is_nan());
    }
}
