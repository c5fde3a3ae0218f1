//! H-compress decoding of one tile: a quadtree of bit planes, then the inverse H-transform.
//!
//! Stored integers. FITS 4.0 section 10.4.4, after R. White's `hdecompress` (STScI, as in CFITSIO). The stream says its
//! own size, which must be that of the tile; every bit is requested, none is read past the end. Arithmetic wraps as
//! there.

use super::hsmooth::smoothed;
use crate::base::pages::resize;

/// Bits of a byte stream, highest first.
struct Bits<'a> {
    bytes: &'a [u8],
    next: usize,
    buffer: u32,
    held: u32,
}

type Decoded<T> = Result<T, String>;

impl Bits<'_> {
    fn take(&mut self, n: u32) -> Decoded<u8> {
        if self.held < n {
            let byte = self.bytes.get(self.next).ok_or("the compressed bytes end before the pixels do")?;
            self.buffer = self.buffer << 8 | u32::from(*byte);
            self.next += 1;
            self.held += 8;
        }
        self.held -= n;
        Ok((self.buffer >> self.held & ((1 << n) - 1)) as u8)
    }

    /// Four bits of the fixed Huffman code.
    fn huffman(&mut self) -> Decoded<u8> {
        let mut code = self.take(3)?;
        if code < 4 {
            return Ok(1 << code);
        }
        for table in [&[3, 5, 10, 12, 15][..], &[6, 7, 9, 11, 13]] {
            code = code << 1 | self.take(1)?;
            let first = if table[0] == 3 { 8 } else { 26 };
            if let Some(value) = code.checked_sub(first).and_then(|k| table.get(usize::from(k))) {
                return Ok(*value);
            }
        }
        code = code << 1 | self.take(1)?;
        Ok(if code == 62 { 0 } else { 14 })
    }
}

/// A block of coefficients within the tile: its first element, the length of the tile's rows, rows and columns.
struct Block {
    at: usize,
    stride: usize,
    rows: usize,
    columns: usize,
}

/// Decodes a tile of `nx` columns and `ny` rows; `smooth` interpolates the coefficients lost by a lossy scale.
///
/// # Errors
/// In words: not this format, of another size, cut, or with codes no encoder writes.
pub(super) fn decode(bytes: &[u8], (nx, ny): (usize, usize), smooth: bool, out: &mut [i32]) -> Decoded<()> {
    let head: &[u8; 25] = bytes.first_chunk().ok_or("too short for an H-compressed tile")?;
    if head[..2] != [0xdd, 0x99] {
        return Err("not an H-compressed tile (its first bytes are not dd 99)".into());
    }
    let word = |at: usize| i32::from_be_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
    // In the stream the axes have their other names.
    if (i64::from(word(6)), i64::from(word(2))) != (nx as i64, ny as i64) || out.len() != nx * ny || out.is_empty() {
        return Err(format!("an H-compressed tile of {}x{} px where {nx}x{ny} are expected", word(6), word(2)));
    }
    if nx < 2 || ny < 2 {
        return Err(format!("an H-compressed tile of {nx}x{ny} px; no encoder makes one so narrow"));
    }
    let scale = i64::from(word(10)).max(1);
    let sum = head[14..22].iter().fold(0i64, |v, b| v << 8 | i64::from(*b));
    let planes = [head[22], head[23], head[24]];
    if planes.iter().any(|p| *p > 60) {
        return Err(format!("bit planes {planes:?}: more than 60"));
    }
    let mut a: Vec<i64> = Vec::new();
    resize(&mut a, nx * ny)?;
    let mut bits = Bits { bytes: &bytes[25..], next: 0, buffer: 0, held: 0 };
    let (half_y, half_x) = (ny.div_ceil(2), nx.div_ceil(2));
    for (at, rows, columns, planes) in [
        (0, half_y, half_x, planes[0]),
        (half_x, half_y, nx / 2, planes[1]),
        (nx * half_y, ny / 2, half_x, planes[1]),
        (nx * half_y + half_x, ny / 2, nx / 2, planes[2]),
    ] {
        quadtree(&mut bits, &mut a, &Block { at, stride: nx, rows, columns }, planes)?;
    }
    if bits.take(4)? != 0 {
        return Err("the bit planes do not end where they should".into());
    }
    bits.held = 0;
    for value in a.iter_mut().filter(|v| **v != 0) {
        if bits.take(1)? == 1 {
            *value = -*value;
        }
    }
    a[0] = sum;
    if scale > 1 {
        a.iter_mut().for_each(|v| *v = v.wrapping_mul(scale));
    }
    invert(&mut a, (nx, ny), smooth.then_some(scale));
    out.iter_mut().zip(&a).for_each(|(to, from)| *to = *from as i32);
    Ok(())
}

/// The power of two that holds `n`.
fn log2_up(n: usize) -> u32 {
    n.max(1).next_power_of_two().trailing_zeros()
}

/// The lengths (n+1)/2, applied `log2 − 1` ... 0 times: the sizes of a quadtree from its root to `n`.
fn sizes(n: usize, log2: u32) -> impl Iterator<Item = usize> {
    (0..log2).rev().map(move |k| n.div_ceil(1 << k))
}

/// Bit planes of a block, each as a quadtree or as plain bits.
fn quadtree(bits: &mut Bits<'_>, a: &mut [i64], block: &Block, planes: u8) -> Decoded<()> {
    let log2 = log2_up(block.rows.max(block.columns));
    let (half_rows, half_columns) = (block.rows.div_ceil(2), block.columns.div_ceil(2));
    let mut codes: Vec<u8> = Vec::new();
    for plane in (0..planes).rev() {
        match bits.take(4)? {
            0 => {
                codes.clear();
                for _ in 0..half_rows * half_columns {
                    codes.push(bits.take(4)?);
                }
            }
            15 => {
                codes.clear();
                codes.push(bits.huffman()?);
                let steps = sizes(block.rows, log2).zip(sizes(block.columns, log2));
                for (rows, columns) in steps.take(log2.saturating_sub(1) as usize) {
                    codes = expanded(&codes, rows, columns);
                    for code in codes.iter_mut().rev().filter(|c| **c != 0) {
                        *code = bits.huffman()?;
                    }
                }
            }
            other => return Err(format!("a bit plane begins with {other}")),
        }
        let mut code = codes.iter();
        for i in (0..block.rows).step_by(2) {
            for j in (0..block.columns).step_by(2) {
                let Some(code) = code.next().filter(|c| **c != 0) else { continue };
                for (bit, di, dj) in [(8, 0, 0), (4, 0, 1), (2, 1, 0), (1, 1, 1)] {
                    if code & bit != 0 && i + di < block.rows && j + dj < block.columns {
                        a[block.at + (i + di) * block.stride + j + dj] |= 1 << plane;
                    }
                }
            }
        }
    }
    Ok(())
}

/// Each code of four bits to 2x2 elements of 0 or 1.
fn expanded(codes: &[u8], rows: usize, columns: usize) -> Vec<u8> {
    let mut out = vec![0; rows * columns];
    let half = columns.div_ceil(2);
    for i in 0..rows {
        for j in 0..columns {
            let code = codes.get(i / 2 * half + j / 2).copied().unwrap_or(0);
            out[i * columns + j] = code >> (3 - 2 * (i % 2) - j % 2) & 1;
        }
    }
    out
}

/// Puts the second half of a line of `n` elements `stride` apart between the elements of its first half.
fn unshuffle(a: &mut [i64], at: usize, n: usize, stride: usize, line: &mut Vec<i64>) {
    let half = n.div_ceil(2);
    line.clear();
    line.extend((0..n).map(|k| a[at + stride * if k % 2 == 0 { k / 2 } else { half + k / 2 }]));
    line.iter().enumerate().for_each(|(k, v)| a[at + stride * k] = *v);
}

/// Rounds away from the middle to a multiple of `bit`, with half a bit less for negative values.
#[inline(always)]
fn rounded(v: i64, bit: i64) -> i64 {
    let half = bit >> 1;
    v.wrapping_add(if v >= 0 { half } else { half - 1 }) & bit.wrapping_neg()
}

/// The inverse H-transform in place.
fn invert(a: &mut [i64], (nx, ny): (usize, usize), smooth_scale: Option<i64>) {
    let log2 = log2_up(nx.max(ny));
    if log2 == 0 {
        return;
    }
    let mut line = Vec::with_capacity(nx.max(ny));
    a[0] = rounded(a[0], 1 << (log2 + 1));
    for (step, (rows, columns)) in sizes(ny, log2).zip(sizes(nx, log2)).enumerate() {
        let k = log2 - 1 - step as u32;
        let shift = if k == 0 { 2 } else { 1 };
        let (bit0, bit1) = (1i64 << k, 1i64 << (k + 1));
        for i in 0..rows {
            unshuffle(a, nx * i, columns, 1, &mut line);
        }
        for j in 0..columns {
            unshuffle(a, j, rows, nx, &mut line);
        }
        if let Some(scale) = smooth_scale {
            smoothed(a, rows, columns, nx, scale);
        }
        // On the last pass nothing is left to round hc by.
        let round0 = |v: i64| if k == 0 { v } else { rounded(v, bit0) };
        for i in (0..rows).step_by(2) {
            for j in (0..columns).step_by(2) {
                let (s00, s10) = (nx * i + j, nx * (i + 1) + j);
                let h0 = a[s00];
                match (i + 1 < rows, j + 1 < columns) {
                    (true, true) => {
                        let hc = round0(a[s10 + 1]);
                        let low0 = hc & bit0;
                        let nearer = |v: i64| v.wrapping_sub(if v >= 0 { low0 } else { -low0 });
                        let (hx, hy) = (nearer(rounded(a[s10], bit1)), nearer(rounded(a[s00 + 1], bit1)));
                        let low1 = (hc ^ hx ^ hy) & bit1;
                        let h0 = h0.wrapping_add(match (h0 >= 0, low0) {
                            (true, _) => low0 - low1,
                            (false, 0) => low1,
                            (false, _) => low0 - low1,
                        });
                        let sum = |x: i64, y: i64, c: i64| h0.wrapping_add(x).wrapping_add(y).wrapping_add(c) >> shift;
                        let (nx_, ny_, nc) = (hx.wrapping_neg(), hy.wrapping_neg(), hc.wrapping_neg());
                        a[s10 + 1] = sum(hx, hy, hc);
                        a[s10] = sum(hx, ny_, nc);
                        a[s00 + 1] = sum(nx_, hy, nc);
                        a[s00] = sum(nx_, ny_, hc);
                    }
                    (false, false) => a[s00] = h0 >> shift,
                    (down, _) => {
                        let other = if down { s10 } else { s00 + 1 };
                        let h = rounded(a[other], bit1);
                        let low1 = h & bit1;
                        let h0 = h0.wrapping_sub(if h0 >= 0 { low1 } else { -low1 });
                        a[other] = h0.wrapping_add(h) >> shift;
                        a[s00] = h0.wrapping_sub(h) >> shift;
                    }
                }
            }
        }
    }
}
