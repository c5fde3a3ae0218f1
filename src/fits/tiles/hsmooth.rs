//! The optional smoothing of H-compressed tiles: coefficients are moved, by at most half their scale, towards a smooth image.
//!
//! Coefficients, before the inverse transform ([`super::hcompress`]). After R. White's `hsmooth` (STScI, as in CFITSIO).

/// Adjusts the differences of the block of `rows` and `columns` within rows `stride` long.
pub(super) fn smoothed(a: &mut [i64], rows: usize, columns: usize, stride: usize, scale: i64) {
    let most = scale >> 1;
    if most <= 0 {
        return;
    }
    // Differences down, then along the rows: towards the slope of the neighbouring means.
    let slope = |a: &mut [i64], at: usize, to: usize, apart: usize| {
        let (before, here, after) = (a[at - apart], a[at], a[at + apart]);
        let (up, down) = (after.wrapping_sub(here), here.wrapping_sub(before));
        let (hi, lo) = (up.min(down).max(0).wrapping_shl(2), up.max(down).min(0).wrapping_shl(2));
        if lo < hi {
            let wanted = after.wrapping_sub(before).min(hi).max(lo);
            a[to] = a[to].wrapping_add(change(wanted, a[to], 3).clamp(-most, most));
        }
    };
    for i in (2..rows.saturating_sub(2)).step_by(2) {
        for j in (0..columns).step_by(2) {
            slope(a, stride * i + j, stride * (i + 1) + j, 2 * stride);
        }
    }
    for i in (0..rows).step_by(2) {
        for j in (2..columns.saturating_sub(2)).step_by(2) {
            slope(a, stride * i + j, stride * i + j + 1, 2);
        }
    }
    for i in (2..rows.saturating_sub(2)).step_by(2) {
        for j in (2..columns.saturating_sub(2)).step_by(2) {
            curvature(a, stride * i + j, stride, most);
        }
    }
}

/// (wanted − 2ⁿ v) / 2ⁿ, towards zero.
fn change(wanted: i64, v: i64, n: u32) -> i64 {
    let s = wanted.wrapping_sub(v.wrapping_shl(n));
    (if s >= 0 { s } else { s.wrapping_add((1 << n) - 1) }) >> n
}

/// The twist of one zone, kept monotone between its four diagonal neighbours.
fn curvature(a: &mut [i64], at: usize, stride: usize, most: i64) {
    let below = at + stride;
    let (mm, pm) = (a[at - 2 * stride - 2], a[at + 2 * stride - 2]);
    let (mp, pp) = (a[at - 2 * stride + 2], a[at + 2 * stride + 2]);
    let h0 = a[at];
    let wanted = pp.wrapping_add(mm).wrapping_sub(mp).wrapping_sub(pm);
    let (x2, y2) = (a[below].wrapping_shl(1), a[at + 1].wrapping_shl(1));
    let bound = |clip: fn(i64) -> i64| {
        [
            clip(pp.wrapping_sub(h0)).wrapping_sub(x2).wrapping_sub(y2),
            clip(h0.wrapping_sub(pm)).wrapping_add(x2).wrapping_sub(y2),
            clip(h0.wrapping_sub(mp)).wrapping_sub(x2).wrapping_add(y2),
            clip(mm.wrapping_sub(h0)).wrapping_add(x2).wrapping_add(y2),
        ]
    };
    let fold =
        |values: [i64; 4], f: fn(i64, i64) -> i64| values[1..].iter().fold(values[0], |m, v| f(m, *v)).wrapping_shl(4);
    let (hi, lo) = (fold(bound(|v| v.max(0)), i64::min), fold(bound(|v| v.min(0)), i64::max));
    if lo < hi {
        let twist = a[below + 1];
        a[below + 1] = twist.wrapping_add(change(wanted.min(hi).max(lo), twist, 6).clamp(-most, most));
    }
}
