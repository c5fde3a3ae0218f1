//! The pixels of a tracked frame in which star trails are measured: net of the sky, without the target and masked pixels.
//!
//! Electrons per pixel; positions from the pixel at which the satellite is expected. Finely sampled frames are binned.

use crate::frames::{Electrons, Frame};
use crate::photometry::background::Background;

/// Bins are no wider than this share of the FWHM.
const BIN_FWHM: f64 = 0.26;
/// Pixels after binning, at most: larger frames are binned further.
pub const MOST_PIXELS: usize = 1_500_000;
/// Memory of a pixel \[bytes\].
pub const BYTES_PER_PX: usize = size_of::<Pixel>();

/// One pixel, or the mean of a few.
#[derive(Debug, Clone, Copy)]
pub struct Pixel {
    /// From the expected place of the satellite \[px\].
    pub x: f32,
    /// From the expected place of the satellite \[px\].
    pub y: f32,
    /// Net of the sky as the mesh has it, which holds some of the light of bright trails \[e⁻/px\].
    pub net: f32,
    /// Net of one level for the whole frame \[e⁻/px\].
    pub above_level: f32,
    /// Variance of `net` without the light of trails.
    pub variance: f32,
    /// How many pixels it is the mean of.
    pub n: f32,
}

/// The usable pixels of a frame.
#[derive(Debug, Clone)]
pub struct TrailImage {
    /// In order of rows.
    pub pixels: Vec<Pixel>,
    /// The frame's corners from the expected place: x from, x to, y from, y to \[px\].
    pub bounds_px: [f64; 4],
    /// Typical scatter of a pixel \[e⁻/px\].
    pub sigma_e: f64,
}

impl TrailImage {
    /// The pixels of a frame about the place `at` \[px\], without circles (x, y, radius) \[px\].
    #[must_use]
    pub fn new(
        frame: &Frame<Electrons>,
        sky: &Background,
        at: (f64, f64),
        without: &[(f64, f64, f64)],
        fwhm_px: f64,
    ) -> Self {
        let (ny, nx) = frame.pixels.dim();
        let by_size = ((nx * ny) as f64 / MOST_PIXELS as f64).sqrt().ceil() as usize;
        let bin = ((BIN_FWHM * fwhm_px) as usize).max(by_size).max(1);
        let (x0, y0) = frame.origin_px;
        let whole = sky.global_level();
        let mut pixels = Vec::with_capacity(nx.div_ceil(bin) * ny.div_ceil(bin));
        let (mut level, mut rms) = (vec![0f32; nx], vec![0f32; nx]);
        let mut sums: Vec<[f64; 6]> = vec![[0.0; 6]; nx.div_ceil(bin)];
        for j in 0..ny {
            sky.level_row(y0 + j, x0, &mut level);
            sky.rms_row(y0 + j, x0, &mut rms);
            for i in 0..nx {
                let value = frame.pixels[[j, i]];
                let (x, y) = ((x0 + i) as f64, (y0 + j) as f64);
                if frame.mask[[j, i]] != 0
                    || !value.is_finite()
                    || without.iter().any(|(cx, cy, r)| (x - cx).hypot(y - cy) < *r)
                {
                    continue;
                }
                let sum = &mut sums[i / bin];
                let value = f64::from(value);
                let net = value - f64::from(level[i]);
                let parts = [1.0, x - at.0, y - at.1, net, value - whole, f64::from(rms[i]).powi(2)];
                sum.iter_mut().zip(parts).for_each(|(s, p)| *s += p);
            }
            if (j + 1) % bin == 0 || j + 1 == ny {
                for [n, x, y, net, above, variance] in sums.iter_mut().map(std::mem::take) {
                    if 2.0 * n > (bin * bin) as f64 && variance > 0.0 {
                        let f = |sum: f64| (sum / n) as f32;
                        let variance = f(variance / n);
                        let above_level = f(above);
                        pixels.push(Pixel { x: f(x), y: f(y), net: f(net), above_level, variance, n: n as f32 });
                    }
                }
            }
        }
        let mut scatter: Vec<f64> = pixels.iter().map(|p| f64::from(p.variance).sqrt()).collect();
        let sigma_e = crate::base::stats::median(&mut scatter).unwrap_or(1.0);
        let bounds_px = [
            x0 as f64 - 0.5 - at.0,
            (x0 + nx) as f64 - 0.5 - at.0,
            y0 as f64 - 0.5 - at.1,
            (y0 + ny) as f64 - 0.5 - at.1,
        ];
        Self { pixels, bounds_px, sigma_e }
    }

    /// Distance of the furthest corner from the expected place \[px\].
    #[must_use]
    pub fn half_px(&self) -> f64 {
        let [x0, x1, y0, y1] = self.bounds_px;
        x0.abs().max(x1.abs()).hypot(y0.abs().max(y1.abs()))
    }

    /// Whether a place lies in the frame, further than `margin_px` from its edge.
    #[must_use]
    pub fn holds(&self, (x, y): (f64, f64), margin_px: f64) -> bool {
        let [x0, x1, y0, y1] = self.bounds_px;
        x > x0 + margin_px && x < x1 - margin_px && y > y0 + margin_px && y < y1 - margin_px
    }
}
