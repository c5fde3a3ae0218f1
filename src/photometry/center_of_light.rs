//! Where an object of any size is: the first moments of its light in an aperture that follows it.
//!
//! Full-frame pixels, electrons. x̄ = Σ f p x / Σ f p over the pixels net of the sky and of the light of others, f the share of each
//! pixel in the aperture. It does not cover objects that the aperture cuts.

use crate::frames::{Electrons, Frame};
use crate::photometry::aperture::{Bounds, Shape, cells, for_each_pixel};
use crate::photometry::background::Background;

/// Moves of the aperture, at most.
const MOST_ROUNDS: usize = 30;
/// It has settled below this \[px\].
const SETTLED_PX: f64 = 1e-3;
/// How well the light of others is known, as a share of it.
const OTHERS_ERR: f64 = 0.1;

/// The pixels about an object, net of the sky.
#[derive(Debug, Clone)]
pub struct NetPixels {
    /// Which columns and rows of the frame they are.
    pub bounds: Bounds,
    /// Net of the sky, row by row \[e⁻\].
    pub net_e: Vec<f64>,
    /// Its variance \[e⁻²\].
    pub variance_e2: Vec<f64>,
}

impl NetPixels {
    /// Column and row of each.
    pub fn places_px(&self) -> impl Iterator<Item = (f64, f64)> {
        let b = self.bounds;
        (b.y0..b.y1).flat_map(move |j| (b.x0..b.x1).map(move |i| (i as f64, j as f64)))
    }

    /// Calls `visit(dx, dy, share, k)` for the pixels that the shape at (x, y) covers.
    fn under(&self, shape: &Shape, (x, y): (f64, f64), mut visit: impl FnMut(f64, f64, f64, usize)) {
        let b = self.bounds;
        for_each_pixel(shape, x, y, b, |i, j, share| {
            visit(i as f64 - x, j as f64 - y, share, (j - b.y0) * (b.x1 - b.x0) + i - b.x0);
        });
    }
}

/// A centre of light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CenterOfLight {
    /// Column.
    pub x_px: f64,
    /// Row.
    pub y_px: f64,
    /// Variances of column and row and their covariance, by noise and by the light of others \[px²\].
    pub covariance_px2: [f64; 3],
}

/// The pixels of a square about a place; a masked one holds the mean of its neighbours, with an error as large.
#[must_use]
pub fn net_pixels(frame: &Frame<Electrons>, sky: &Background, at: (f64, f64), reach_px: f64) -> NetPixels {
    let all = Bounds::of(frame);
    let value = |i: usize, j: usize| {
        let at = [j - all.y0, i - all.x0];
        let value = f64::from(frame.pixels[at]);
        (frame.mask[at] == 0 && value.is_finite()).then_some(value)
    };
    let columns = cells(at.0 - reach_px, at.0 + reach_px, all.x0, all.x1);
    let rows = cells(at.1 - reach_px, at.1 + reach_px, all.y0, all.y1);
    let bounds = Bounds { x0: columns.start, x1: columns.end, y0: rows.start, y1: rows.end };
    let (mut net_e, mut variance_e2) = (Vec::new(), Vec::new());
    let (mut level, mut rms) = (vec![0f32; columns.len()], vec![0f32; columns.len()]);
    for j in rows {
        sky.level_row(j, bounds.x0, &mut level);
        sky.rms_row(j, bounds.x0, &mut rms);
        for (i, (level, rms)) in columns.clone().zip(level.iter().zip(&rms)) {
            let (level, rms2) = (f64::from(*level), f64::from(*rms).powi(2));
            let (net, own) = match value(i, j) {
                Some(value) => (value - level, (value - level).max(0.0)),
                None => {
                    let near_rows = j.saturating_sub(1).max(all.y0)..(j + 2).min(all.y1);
                    let near_columns = i.saturating_sub(1).max(all.x0)..(i + 2).min(all.x1);
                    let near = near_rows.flat_map(|j| near_columns.clone().filter_map(move |i| value(i, j)));
                    let (sum, n) = near.fold((0.0, 0.0), |(sum, n), value| (sum + value - level, n + 1.0));
                    let mean = if n > 0.0 { sum / n } else { 0.0 };
                    (mean, mean * mean)
                }
            };
            net_e.push(net);
            variance_e2.push(rms2 + own);
        }
    }
    NetPixels { bounds, net_e, variance_e2 }
}

/// The centre of the light in `shape`, which starts at `start` and follows it; `others_e` is the light of others in each pixel.
///
/// Σ f² (x − x̄)² σ² / (Σ f p)² and a tenth of what the light of others moves it by are its variance. `None` without light, and
/// where it leaves the aperture it started from.
#[must_use]
pub fn center_of_light(
    pixels: &NetPixels,
    others_e: &[f64],
    shape: &Shape,
    start: (f64, f64),
) -> Option<CenterOfLight> {
    let light = |k: usize| pixels.net_e[k] - others_e[k];
    let mut at = start;
    for _ in 0..MOST_ROUNDS {
        let (mut sum, mut sx, mut sy) = (0.0, 0.0, 0.0);
        pixels.under(shape, at, |dx, dy, share, k| {
            let e = share * light(k);
            (sum, sx, sy) = (sum + e, sx + e * dx, sy + e * dy);
        });
        if !(sum > 0.0) {
            return None;
        }
        at = (at.0 + sx / sum, at.1 + sy / sum);
        if !shape.contains(at.0 - start.0, at.1 - start.1) {
            return None;
        }
        if (sx / sum).hypot(sy / sum) < SETTLED_PX {
            break;
        }
    }
    let (mut sum, mut noise, mut pull) = (0.0, [0.0; 3], [0.0; 2]);
    pixels.under(shape, at, |dx, dy, share, k| {
        sum += share * light(k);
        let variance = share * share * pixels.variance_e2[k];
        noise = [noise[0] + variance * dx * dx, noise[1] + variance * dy * dy, noise[2] + variance * dx * dy];
        let others = share * OTHERS_ERR * others_e[k];
        pull = [pull[0] + dx * others, pull[1] + dy * others];
    });
    let of = |noise: f64, a: f64, b: f64| (noise + a * b) / (sum * sum);
    let covariance_px2 =
        [of(noise[0], pull[0], pull[0]), of(noise[1], pull[1], pull[1]), of(noise[2], pull[0], pull[1])];
    (sum > 0.0).then_some(CenterOfLight { x_px: at.0, y_px: at.1, covariance_px2 })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A plate of 9 by 5 px about (20.3, 17.6), seen through a blur that leaves its centre where it is.
    fn plate(noise: impl Fn(usize) -> f64) -> NetPixels {
        let smooth = |d: f64, half: f64| 1.0 / (1.0 + ((d.abs() - half) / 0.6).exp());
        let bounds = Bounds { x0: 0, x1: 40, y0: 0, y1: 40 };
        let mut out = NetPixels { bounds, net_e: Vec::new(), variance_e2: vec![9.0; 1600] };
        let lit = |(x, y): (f64, f64)| 50.0 * smooth(x - 20.3, 4.5) * smooth(y - 17.6, 2.5);
        out.net_e = out.places_px().enumerate().map(|(k, at)| lit(at) + noise(k)).collect();
        out
    }

    #[test]
    fn a_plate_is_at_its_middle_wherever_the_aperture_starts_and_its_error_is_its_scatter() {
        let shape = Shape::Circle { r_px: 11.0 };
        let none = vec![0.0; 1600];
        let exact = center_of_light(&plate(|_| 0.0), &none, &shape, (22.0, 15.5)).unwrap();
        assert!((exact.x_px - 20.3).abs() < 0.02 && (exact.y_px - 17.6).abs() < 0.02, "{exact:?}");
        // noise of 3 e-: twelve uniform numbers of SplitMix64
        let noise = |seed: usize, k: usize| {
            let uniform = |draw: usize| {
                let mut z = (((seed * 1600 + k) * 12 + draw) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
                ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            };
            3.0 * (0..12).map(uniform).sum::<f64>()
        };
        let z2: Vec<f64> = (0..60)
            .map(|seed| {
                let found = center_of_light(&plate(|k| noise(seed, k)), &none, &shape, (20.0, 18.0)).unwrap();
                (found.x_px - 20.3).powi(2) / found.covariance_px2[0]
            })
            .collect();
        let mean = z2.iter().sum::<f64>() / 60.0;
        assert!((0.6..1.6).contains(&mean), "{mean}");
    }

    #[test]
    fn light_of_others_that_is_known_moves_nothing_and_widens_the_error() {
        let shape = Shape::Circle { r_px: 11.0 };
        let others: Vec<f64> = (0..1600).map(|k| if (k / 40) % 40 > 22 { 40.0 } else { 0.0 }).collect();
        let mut lit = plate(|_| 0.0);
        lit.net_e.iter_mut().zip(&others).for_each(|(net, e)| *net += e);
        let (clean, found) = (
            center_of_light(&plate(|_| 0.0), &vec![0.0; 1600], &shape, (20.0, 18.0)).unwrap(),
            center_of_light(&lit, &others, &shape, (20.0, 18.0)).unwrap(),
        );
        assert!((found.y_px - clean.y_px).abs() < 1e-6 && found.covariance_px2[1] > 2.0 * clean.covariance_px2[1]);
        let dark = NetPixels { net_e: vec![-1.0; 1600], ..plate(|_| 0.0) };
        assert_eq!(center_of_light(&dark, &[0.0; 1600], &shape, (20.0, 18.0)), None);
    }
}
