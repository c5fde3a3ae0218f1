//! Rice decoding of one tile: differences of neighbouring pixels, coded in blocks that share a number of low bits.
//!
//! Stored integers, before BSCALE and BZERO. FITS 4.0 section 10.4.1; the numbers per size of a pixel are those of R. White's
//! `rcomp` in CFITSIO. Nothing is read outside the bytes given: a stream that ends early is an error.

/// Decodes a tile of `out.len()` pixels of `byte_pix` bytes (1: unsigned; 2 and 4: signed) from blocks of `block` pixels.
///
/// # Errors
/// In words, where the stream ends before the pixels do or holds a code that no encoder writes.
pub(super) fn decode(bytes: &[u8], byte_pix: i64, block: usize, out: &mut [i32]) -> Result<(), String> {
    match byte_pix {
        1 => run::<1, 3>(bytes, block, out, |v| i32::from(v as u8)),
        2 => run::<2, 4>(bytes, block, out, |v| i32::from(v as i16)),
        4 => run::<4, 5>(bytes, block, out, |v| v as i32),
        other => Err(format!("BYTEPIX = {other} is not one of 1, 2, 4")),
    }
}

/// Bits of a byte stream, highest first; past its end they are 0 and counted.
struct Bits<'a> {
    bytes: &'a [u8],
    next: usize,
    /// The bits to come, left-aligned; those below `held` may already be there, they are the same bits.
    buffer: u64,
    held: u32,
}

impl Bits<'_> {
    #[inline(always)]
    fn refill(&mut self) {
        if let Some((word, _)) = self.bytes.get(self.next..).and_then(<[u8]>::split_first_chunk::<8>) {
            self.buffer |= u64::from_be_bytes(*word) >> self.held;
            let more = (63 - self.held) / 8;
            self.next += more as usize;
            self.held += more * 8;
        } else {
            while self.held <= 56 {
                let byte = self.bytes.get(self.next).copied().unwrap_or(0);
                self.buffer |= u64::from(byte) << (56 - self.held);
                self.next += 1;
                self.held += 8;
            }
        }
    }

    /// Takes `n` bits, at most 32.
    #[inline(always)]
    fn take(&mut self, n: u32) -> u32 {
        if self.held < n {
            self.refill();
        }
        let value = (self.buffer >> 1) >> (63 - n);
        self.buffer <<= n;
        self.held -= n;
        value as u32
    }

    /// Whether more bits were taken than there are.
    #[inline(always)]
    fn overdrawn(&self) -> bool {
        self.next > self.bytes.len() && self.next * 8 - self.held as usize > self.bytes.len() * 8
    }

    /// Counts zeros up to the next one, and takes them with it: for runs longer than the buffer.
    #[cold]
    fn long_zeros(&mut self) -> Option<u32> {
        let mut count = 0u32;
        loop {
            let zeros = self.buffer.leading_zeros();
            if zeros < self.held {
                self.buffer = (self.buffer << zeros) << 1;
                self.held -= zeros + 1;
                return Some(count + zeros);
            }
            count += self.held;
            (self.buffer, self.held) = (0, 0);
            if self.next >= self.bytes.len() {
                return None;
            }
            self.refill();
        }
    }
}

fn run<const BYTES: usize, const FS_BITS: u32>(
    bytes: &[u8],
    block: usize,
    out: &mut [i32],
    value: impl Fn(u32) -> i32,
) -> Result<(), String> {
    let short = || "the compressed bytes end before the pixels do".to_string();
    let raw_bits = 8 * BYTES as u32;
    // Codes: 0 all the same, `raw` uncoded differences, else 1 + the number of low bits.
    let raw = match BYTES {
        1 => 7,
        2 => 15,
        _ => 26,
    };
    let first = bytes.get(..BYTES).ok_or_else(short)?;
    let mut last = first.iter().fold(0u32, |v, b| v << 8 | u32::from(*b));
    let mut bits = Bits { bytes: &bytes[BYTES..], next: 0, buffer: 0, held: 0 };
    for pixels in out.chunks_mut(block) {
        let code = bits.take(FS_BITS);
        if code > raw {
            return Err(format!("a block has the code {code}, above {raw}"));
        }
        if code == 0 {
            pixels.fill(value(last));
        } else if code == raw {
            for pixel in pixels {
                last = last.wrapping_add(unfolded(bits.take(raw_bits)));
                *pixel = value(last);
            }
        } else {
            let low = code - 1;
            for pixel in pixels {
                if bits.held < 32 {
                    bits.refill();
                }
                let zeros = bits.buffer.leading_zeros();
                let folded = if zeros + 1 + low <= bits.held {
                    let rest = (bits.buffer << zeros) << 1;
                    bits.buffer = rest << low;
                    bits.held -= zeros + 1 + low;
                    zeros << low | ((rest >> 1) >> (63 - low)) as u32
                } else {
                    let zeros = bits.long_zeros().ok_or_else(short)?;
                    zeros.wrapping_shl(low) | bits.take(low)
                };
                last = last.wrapping_add(unfolded(folded));
                *pixel = value(last);
            }
        }
        if bits.overdrawn() {
            return Err(short());
        }
    }
    Ok(())
}

/// Differences are folded to 0, −1, 1, −2, 2, ... as 0, 1, 2, 3, 4.
#[inline(always)]
fn unfolded(folded: u32) -> u32 {
    (folded >> 1) ^ (folded & 1).wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_of_one_value_takes_its_first_pixel_and_a_code_of_zero() {
        let mut out = [0; 3];
        // the tile of astropy's compressed_float_bzero.fits: 0x8001 and a block that does not change
        decode(&[0x80, 0x01, 0x00], 2, 32, &mut out).unwrap();
        assert_eq!(out, [-32767; 3]);
    }

    #[test]
    fn any_bytes_give_pixels_or_an_error_and_a_cut_stream_an_error() {
        let mut state = 1u64;
        for round in 0..3_000 {
            let bytes: Vec<u8> = (0..round % 90)
                .map(|_| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    // many zeros: long runs
                    if state >> 62 == 0 { (state >> 40) as u8 } else { 0 }
                })
                .collect();
            for byte_pix in [1, 2, 4] {
                let mut out = vec![0; 200];
                let _ = decode(&bytes, byte_pix, 32, &mut out);
                assert!(decode(&bytes[..bytes.len().min(3)], byte_pix, 1, &mut out).is_err());
            }
        }
        assert!(decode(&[0; 9], 8, 32, &mut [0]).is_err());
    }
}
