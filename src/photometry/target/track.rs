//! Whether a faint source is a long track or its brightest piece: light goes on from it along a line.
//!
//! Pixels of the cutout, in units of their own noise. A track of a cosmic ray is a line of uneven charge; of a faint one a single
//! piece may stand out, as sharp as a star, or nothing but the whole, under a filter as long as it is. It does not cover tracks that
//! end within the source ([`super::sharpness`]).

use crate::photometry::target::cutout::Cutout;

/// Above this FWHM \[px\] no piece of a track is as wide as a star.
const WIDEST_FWHM_PX: f64 = 4.0;
/// From this significance on a source is judged by its own pixels alone.
const FAINT_SIGMA: f64 = 8.0;
/// So near to the source its own light is on the line \[FWHM\].
const CLEAR_FWHM: f64 = 2.0;
/// A wide source whose line is this much more significant than itself has its light there.
const LINE_OF_WIDE: f64 = 1.2;
/// How far the line is followed to each side \[px\].
const LENGTHS_PX: [usize; 3] = [14, 28, 42];
/// A pixel counts no more than this \[σ\], so that another source on the line does not make it one; and the variance of noise that is
/// clipped so, 1 − 2 c φ(c) + 2 (c² − 1)(1 − Φ(c)).
const MOST_SIGMA: f64 = 1.5;
const CLIPPED_VARIANCE: f64 = 0.7785;
/// Light of a line \[σ\]: of 176 lines of three lengths, to one side or both. Of 1979 points without tracks none is lost by it
/// (`prove_cosmic_rays.sh`).
const LINE_SIGMA: f64 = 4.2;
/// Neighbouring lines are so far apart at their ends \[px\].
const APART_PX: f64 = 0.75;
/// Lines this near to the direction of the star trails may be what their model leaves \[rad\].
const TRAIL_ANGLE: f64 = 0.06;

impl Cutout {
    /// Whether a source of significance `snr` at (x, y) lies on a line of light as narrow as a pixel.
    ///
    /// Sums of d/σ, clipped at ±1.5 and interpolated between the two pixels of each column (of each row, for steep lines) next to the
    /// line, from 2 FWHM on to one side, the other, or both: Σ w d/σ > 4.2 √(0.78 Σ w²).
    pub fn is_on_track(&self, at: (f64, f64), snr: f64) -> bool {
        self.has_line(at, snr, (CLEAR_FWHM * self.fwhm_px).ceil() as i64 + 1, LINE_SIGMA)
    }

    /// Whether a source of significance `snr` under a filter wider than a star is such a line itself: of a wide source no line of pixels is
    /// more significant than all of it.
    pub fn is_track(&self, at: (f64, f64), snr: f64) -> bool {
        self.has_line(at, snr, 1, LINE_SIGMA.max(LINE_OF_WIDE * snr))
    }

    fn has_line(&self, at: (f64, f64), snr: f64, clear: i64, least: f64) -> bool {
        if self.fwhm_px > WIDEST_FWHM_PX || snr > FAINT_SIGMA {
            return false;
        }
        let farthest = LENGTHS_PX[LENGTHS_PX.len() - 1];
        let lines = (std::f64::consts::PI * farthest as f64 / APART_PX).ceil() as usize;
        let trails = self.trail_background.as_ref().map(|t| t.theta());
        let off_trails = |theta: &f64| trails.is_none_or(|trail| (theta - trail).sin().abs() > TRAIL_ANGLE.sin());
        let mut angles = (0..lines).map(|k| std::f64::consts::PI * k as f64 / lines as f64).filter(off_trails);
        angles.any(|theta| self.line_is_bright(at, theta, clear, least))
    }

    fn line_is_bright(&self, (x, y): (f64, f64), theta: f64, clear: i64, least: f64) -> bool {
        let (sin, cos) = theta.sin_cos();
        let is_steep = sin.abs() > cos.abs();
        let (along, across, slope) = if is_steep { (y, x, cos / sin) } else { (x, y, sin / cos) };
        // sum and variance from the clear region outwards, to each side
        let mut sides = [(0.0, 0.0); 2];
        let mut from = clear;
        LENGTHS_PX.iter().any(|length| {
            let to = clear + *length as i64;
            for (side, way) in sides.iter_mut().zip([1, -1]) {
                for k in from..to {
                    let own = along.round() as i64 + way * k;
                    let other = across + slope * (own as f64 - along);
                    if let Some((value, variance)) = self.between(own, other, is_steep) {
                        *side = (side.0 + value, side.1 + variance);
                    }
                }
            }
            from = to;
            let both = (sides[0].0 + sides[1].0, sides[0].1 + sides[1].1);
            sides.iter().chain([&both]).any(|(sum, variance)| *sum > least * variance.sqrt() && *variance > 0.0)
        })
    }

    /// Light above sky and trails between the two pixels of a column (of a row, if `is_steep`) next to a line, in units of its
    /// noise, and the variance of that; `None` off the cutout or next to a bad pixel.
    fn between(&self, own: i64, other: f64, is_steep: bool) -> Option<(f64, f64)> {
        let (ny, nx) = self.pixels.dim();
        let share = other - other.floor();
        let value = |step: i64| -> Option<f64> {
            let other = other.floor() as i64 + step;
            let (i, j) = if is_steep { (other, own) } else { (own, other) };
            let (i, j) = (usize::try_from(i).ok().filter(|i| *i < nx)?, usize::try_from(j).ok().filter(|j| *j < ny)?);
            let light = self.light_at(i, j);
            let above = f64::from(self.pixels[[j, i]]) - self.sky.level(i as f64, j as f64) - light;
            let value = above / (self.rms_e * self.rms_e + light).sqrt();
            value.is_finite().then(|| value.clamp(-MOST_SIGMA, MOST_SIGMA))
        };
        let (near, far) = (value(0)?, value(1)?);
        let variance = CLIPPED_VARIANCE * ((1.0 - share).powi(2) + share * share);
        Some(((1.0 - share) * near + share * far, variance))
    }
}
