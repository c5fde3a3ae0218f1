//! The second moments of the target: of its outline, and of its light.
//!
//! Columns, rows and axes of a cutout in cells, angles from +x towards +y. It does not cover the aperture
//! (`target_enclose`).

use ndarray::Array2;

use crate::photometry::aperture::cells;
use crate::photometry::centroid::FWHM_PER_SIGMA;

/// An ellipse: centre, semi-axes (here standard deviations) and angle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ellipse {
    pub x: f64,
    pub y: f64,
    pub a: f64,
    pub b: f64,
    pub theta: f64,
}

/// Semi-axes (standard deviations) and angle of a covariance.
pub(crate) fn axes(xx: f64, xy: f64, yy: f64) -> (f64, f64, f64) {
    let (mean, half) = (0.5 * (xx + yy), (0.25 * (xx - yy).powi(2) + xy * xy).sqrt());
    ((mean + half).sqrt(), (mean - half).max(1.0 / 12.0).sqrt(), 0.5 * (2.0 * xy).atan2(xx - yy))
}

/// Centre and covariance of a set of pixels, each with its own 1/12 px².
pub(crate) fn covariance(pixels: &[(usize, usize)]) -> (f64, f64, f64, f64, f64) {
    let n = pixels.len() as f64;
    let x = pixels.iter().map(|p| p.0 as f64).sum::<f64>() / n;
    let y = pixels.iter().map(|p| p.1 as f64).sum::<f64>() / n;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for &(i, j) in pixels {
        let (dx, dy) = (i as f64 - x, j as f64 - y);
        xx += dx * dx;
        xy += dx * dy;
        yy += dy * dy;
    }
    (x, y, xx / n + 1.0 / 12.0, xy / n, yy / n + 1.0 / 12.0)
}

/// Standard deviations of a set of pixels.
pub(crate) fn outline_moments(pixels: &[(usize, usize)]) -> Ellipse {
    let (x, y, xx, xy, yy) = covariance(pixels);
    let (a, b, theta) = axes(xx, xy, yy);
    Ellipse { x, y, a, b, theta }
}

/// Second moments of the light under an elliptical Gaussian that follows them, from those of the outline on; `None` where
/// they do not settle. NaN is no light.
pub(crate) fn moments(light: &Array2<f32>, outline: &Ellipse, fwhm_px: f64) -> Option<Ellipse> {
    let (ny, nx) = light.dim();
    let least = (fwhm_px / FWHM_PER_SIGMA).powi(2);
    let (mut x, mut y) = (outline.x, outline.y);
    let (sin, cos) = outline.theta.sin_cos();
    let (p, q) = (outline.a.powi(2).max(least), outline.b.powi(2).max(least));
    let (mut xx, mut xy, mut yy) = (cos * cos * p + sin * sin * q, sin * cos * (p - q), sin * sin * p + cos * cos * q);
    for _ in 0..60 {
        let det = xx * yy - xy * xy;
        let (ixx, ixy, iyy) = (yy / det, -xy / det, xx / det);
        let (rx, ry) = (4.0 * xx.sqrt(), 4.0 * yy.sqrt());
        let (mut w, mut sx, mut sy, mut sxx, mut sxy, mut syy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for j in cells(y - ry, y + ry, 0, ny) {
            for i in cells(x - rx, x + rx, 0, nx) {
                let (dx, dy) = (i as f64 - x, j as f64 - y);
                if !light[[j, i]].is_finite() {
                    continue;
                }
                let weight =
                    (-0.5 * (ixx * dx * dx + 2.0 * ixy * dx * dy + iyy * dy * dy)).exp() * f64::from(light[[j, i]]);
                w += weight;
                sx += weight * dx;
                sy += weight * dy;
                sxx += weight * dx * dx;
                sxy += weight * dx * dy;
                syy += weight * dy * dy;
            }
        }
        if w.is_nan() || w <= 0.0 {
            return None;
        }
        let (dx, dy) = (2.0 * sx / w, 2.0 * sy / w);
        // a Gaussian under its own window has half its covariance
        let (nxx, nxy, nyy) = (2.0 * sxx / w, 2.0 * sxy / w, 2.0 * syy / w);
        if !(nxx > 0.0 && nyy > 0.0 && nxx * nyy > nxy * nxy * 1.0001) {
            return None;
        }
        x += dx;
        y += dy;
        let change = (nxx - xx).abs().max((nyy - yy).abs()) / (xx + yy);
        (xx, xy, yy) = (0.5 * (xx + nxx), 0.5 * (xy + nxy), 0.5 * (yy + nyy));
        if (x - outline.x).hypot(y - outline.y) > 2.0 * outline.a || xx + yy > 16.0 * outline.a * outline.a {
            return None;
        }
        if change < 1e-3 && dx.abs().max(dy.abs()) < 1e-2 {
            let (a, b, theta) = axes(xx, xy, yy);
            return Some(Ellipse { x, y, a, b, theta });
        }
    }
    None
}
