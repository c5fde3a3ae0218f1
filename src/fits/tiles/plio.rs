//! IRAF's line lists (PLIO) of one tile: runs of equal values, for masks.
//!
//! Stored integers 0 to 2²⁴. FITS 4.0 section 10.4.3, after `pl_l2pi` of IRAF. What the list does not cover is 0, as there;
//! nothing is read outside the list.

/// Decodes the big-endian 16-bit words of a line list into `out`.
///
/// # Errors
/// In words, where the list is shorter than it says.
pub(super) fn decode(bytes: &[u8], out: &mut [i32]) -> Result<(), String> {
    let word = |k: usize| bytes.get(2 * k..2 * k + 2).map(|b| i32::from(i16::from_be_bytes([b[0], b[1]])));
    let short = || format!("the line list of {} words ends too early", bytes.len() / 2);
    out.fill(0);
    // Old lists give their length in word 2; newer ones in words 3 and 4, and the length of their header in word 1.
    let (length, first) = match word(2).ok_or_else(short)? {
        old if old > 0 => (i64::from(old), 3),
        _ => {
            let low = i64::from(word(3).ok_or_else(short)?);
            ((i64::from(word(4).ok_or_else(short)?) << 15) + low, i64::from(word(1).ok_or_else(short)?))
        }
    };
    if length < 0 || first < 3 || length * 2 > bytes.len() as i64 {
        return Err(format!("the line list says {length} words from word {first} on, and holds {}", bytes.len() / 2));
    }
    let (mut at, mut high) = (0usize, 1i32);
    let mut k = first as usize;
    while k < length as usize && at < out.len() {
        let code = word(k).ok_or_else(short)?;
        let data = code & 4095;
        let mut put = |at: &mut usize, high: i32| {
            if let Some(pixel) = out.get_mut(*at) {
                *pixel = high;
            }
            *at += 1;
        };
        match code >> 12 {
            0 => at += data as usize,
            4 => (0..data).for_each(|_| put(&mut at, high)),
            5 => {
                at += (data as usize).saturating_sub(1);
                if data > 0 {
                    put(&mut at, high);
                }
            }
            1 => {
                k += 1;
                high = (word(k).ok_or_else(short)? << 12) + data;
            }
            2 => high = high.wrapping_add(data),
            3 => high = high.wrapping_sub(data),
            6 | 7 => {
                high = high.wrapping_add(if code >> 12 == 6 { data } else { -data });
                put(&mut at, high);
            }
            // a negative word: no encoder writes one, IRAF passes over it
            _ => return Err(format!("word {k} of the line list is {code}")),
        }
        k += 1;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_zeros_and_steps_are_those_of_the_encoder_and_short_lists_are_errors() {
        // 3 zeros, 4 times 1, the value 5 behind 2 zeros, 300000 twice: as pl_p2li writes them
        let words: [i16; 13] =
            [0, 7, -100, 13, 0, 0, 0, 3, 0x4000 + 4, 0x2000 + 4, 0x5000 + 3, 0x1000 + (300_000 % 4096) as i16, 73];
        let mut bytes: Vec<u8> = words.iter().flat_map(|w| w.to_be_bytes()).collect();
        bytes.extend((0x4000i16 + 2).to_be_bytes());
        bytes[7] = 14;
        let mut out = [9; 14];
        decode(&bytes, &mut out).unwrap();
        assert_eq!(out, [0, 0, 0, 1, 1, 1, 1, 0, 0, 5, 300_000, 300_000, 0, 0]);
        for n in 0..bytes.len() {
            assert!(decode(&bytes[..n], &mut out).is_err(), "{n} bytes");
        }
    }
}
