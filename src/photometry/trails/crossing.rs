//! Satellites and aircraft that cross a tracked frame: a long line in another direction than the star trails.
//!
//! Cells of the significance at the scale of a star, trails subtracted. Where there are no star trails the first line of a
//! frame is taken for one and its level subtracted; then only a direction known beforehand tells them apart. It does not
//! cover lines that end in the cutout, and faint ones.

use ndarray::Array2;

use super::direction::{ONE_DIRECTION, Turned, direction, long_runs};
use super::known::KnownDirection;
use crate::photometry::target::placed::Placed;

/// Significance of the cells of a line \[σ\].
const LINE_SIGMA: f32 = 4.0;
/// A line is as long as this share of the shorter side of the cutout.
const LEAST_LENGTH: f64 = 0.33;
/// Errors of a known direction beyond which a line is at another angle.
const ANGLE_SIGMA: f64 = 4.0;

/// A line that crosses the cutout.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Crossing {
    turned: Turned,
    /// Range across the line \[cells\].
    v: (f64, f64),
    /// Range along it \[cells\].
    u: (f64, f64),
}

impl Crossing {
    /// Whether the line runs through an object \[cells\] or within `margin` cells of it.
    pub fn touches(&self, object: &Placed, margin: f64) -> bool {
        let v = self.turned.uv(object.x, object.y).1;
        let reach = object.shape.bounding_radius_px() + margin;
        v + reach > self.v.0 && v - reach < self.v.1
    }

    /// Whether a cell is on the line or within `margin` cells of it.
    pub fn holds(&self, (x, y): (f64, f64), margin: f64) -> bool {
        let v = self.turned.uv(x, y).1;
        v > self.v.0 - margin && v < self.v.1 + margin
    }

    /// Whether both ends of the line are within `margin` cells of the border of a cutout of `(ny, nx)` cells.
    pub fn runs_through(&self, (ny, nx): (usize, usize), margin: f64) -> bool {
        let outer = |at: f64, n: usize| at < margin || at > n as f64 - 1.0 - margin;
        let at_border = |u: f64| {
            let (x, y) = self.turned.xy(u, 0.5 * (self.v.0 + self.v.1));
            outer(x, nx) || outer(y, ny)
        };
        at_border(self.u.0) && at_border(self.u.1)
    }
}

/// The lines in `snr` in another direction than `trails` \[rad\], the star trails that were subtracted.
pub(crate) fn crossings(snr: &Array2<f32>, fwhm: f64, trails: Option<f64>) -> Vec<Crossing> {
    let dim = snr.dim();
    let least = (LEAST_LENGTH * dim.0.min(dim.1) as f64).max(15.0 * fwhm);
    let points: Vec<(usize, usize)> =
        snr.indexed_iter().filter(|(_, v)| **v > LINE_SIGMA).map(|((j, i), _)| (i, j)).collect();
    if (points.len() as f64) < least {
        return Vec::new();
    }
    let theta = direction(&points, dim);
    if trails.is_some_and(|trails| (theta - trails).sin().abs() < ONE_DIRECTION.max(2.0 * fwhm / least)) {
        return Vec::new();
    }
    let turned = Turned::new(dim, theta);
    long_runs(&points, turned, dim, fwhm, least)
        .into_iter()
        .map(|run| Crossing { turned, v: run.v, u: run.u })
        .collect()
}

/// Whether lines that were taken for star trails are at another angle than these are known to have.
pub(crate) fn is_another_angle(theta: f64, known: KnownDirection) -> bool {
    (theta - known.theta_rad).sin().abs() > ONE_DIRECTION.max(ANGLE_SIGMA * known.err_rad)
}
