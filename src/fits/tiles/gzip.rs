//! Gzip of one tile, and the byte order of GZIP_2.
//!
//! Bytes. Never more are unpacked than the tile can hold; the stream's own checksum is checked.

use std::io::Read;

use flate2::bufread::GzDecoder;

/// Unpacks a stream that holds one of `sizes` bytes.
///
/// # Errors
/// In words: damaged, or of another size.
pub(super) fn inflate(bytes: &[u8], sizes: &[usize]) -> Result<Vec<u8>, String> {
    let most = sizes.iter().copied().max().unwrap_or(0);
    // deflate packs at most 1032 to 1: a short stream claims no large buffer
    let mut out = Vec::with_capacity(most.min(bytes.len().saturating_mul(1_032)));
    GzDecoder::new(bytes)
        .take(most as u64 + 1)
        .read_to_end(&mut out)
        .map_err(|e| format!("the gzip stream is damaged: {e}"))?;
    if sizes.contains(&out.len()) {
        return Ok(out);
    }
    Err(format!("{}{} bytes in the gzip stream, expected {most}", if out.len() > most { "more than " } else { "" }, {
        out.len().min(most)
    }))
}

/// Undoes GZIP_2: all first bytes of the numbers, then all second bytes, and so on.
pub(super) fn unshuffled(bytes: &[u8], width: usize) -> Vec<u8> {
    let n = bytes.len() / width.max(1);
    (0..n * width).map(|k| bytes[k % width * n + k / width]).collect()
}
