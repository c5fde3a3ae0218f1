//! CHECKSUM and DATASUM: whether a file is still what its writer wrote.
//!
//! The ones'-complement sum of the 32-bit words of an HDU (FITS 4.0 section 4.4.2.7 and appendix J). A wrong one is a
//! warning, never a refusal: a header edited by hand is the usual reason, flipped bits the other.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::cards::Header;
use super::open::open;
use crate::base::error::{Error, Result};

/// Bytes of a FITS block.
const BLOCK: u64 = 2880;
/// Bytes read at a time: whole words, whole blocks.
const PIECE: usize = 364 * BLOCK as usize;

/// What is wrong with the checksums of the image `header` was scanned from; `None` if they are right or there are none.
///
/// DATASUM is held against the data, CHECKSUM against the whole HDU, whose sum must be 0. Reads the HDU once, and only if
/// it has one of the two.
///
/// # Errors
/// [`Error::Io`]; a file that has become shorter since it was scanned.
pub fn wrong_checksum(path: &Path, header: &Header) -> Result<Option<String>> {
    let (stated, whole) = (header.text("DATASUM"), header.text("CHECKSUM"));
    let Some(data_at) = header.data_at().filter(|_| stated.is_some() || whole.is_some()) else { return Ok(None) };
    let (from, to) = header.hdu_bytes();
    let mut file = open(path)?;
    let mut sum = |from: u64, to: u64| sum(&mut file, from, to).map_err(|e| Error::io(path, e));
    let data = sum(data_at, to.div_ceil(BLOCK) * BLOCK)?;
    let hdu = header.hdu_index();
    if let Some(stated) = stated {
        // FITS writes it as a string; an empty one means "not computed"
        match stated.parse::<u64>() {
            Ok(stated) if stated == u64::from(data) || (stated == 0 && data == u32::MAX) => {}
            _ => {
                return Ok(Some(format!(
                    "the data of HDU {hdu} were changed after they were written: DATASUM = '{stated}', their sum is {data}"
                )));
            }
        }
    }
    let total = added(sum(from, data_at)?, data);
    Ok((whole.is_some() && total != u32::MAX && total != 0).then(|| {
        let what = if header.text("DATASUM").is_some() { "the header" } else { "HDU" };
        format!("{what} of HDU {hdu} was changed after it was written: CHECKSUM is wrong")
    }))
}

/// The sum of bytes `from` to `to`; what lies beyond the end of the file counts as 0.
fn sum(file: &mut File, from: u64, to: u64) -> std::io::Result<u32> {
    file.seek(SeekFrom::Start(from))?;
    let mut bytes = vec![0; PIECE.min(usize::try_from(to - from).unwrap_or(PIECE))];
    let (mut left, mut total) = (to - from, 0u64);
    while left > 0 {
        let piece = bytes.len().min(usize::try_from(left).unwrap_or(PIECE));
        let bytes = &mut bytes[..piece];
        let mut filled = 0;
        while filled < piece {
            match file.read(&mut bytes[filled..])? {
                0 => break,
                n => filled += n,
            }
        }
        bytes[filled..].fill(0);
        let words = bytes.as_chunks::<4>().0;
        total += u64::from(folded(words.iter().map(|w| u64::from(u32::from_be_bytes(*w))).sum()));
        left -= piece as u64;
        if filled < piece {
            break;
        }
    }
    Ok(folded(total))
}

/// Carries added back in until none is left.
fn folded(mut sum: u64) -> u32 {
    while sum >> 32 != 0 {
        sum = (sum & 0xffff_ffff) + (sum >> 32);
    }
    sum as u32
}

fn added(a: u32, b: u32) -> u32 {
    folded(u64::from(a) + u64::from(b))
}
