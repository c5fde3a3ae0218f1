//! Whether a faint source is a long track or its brightest piece: light goes on from it along a line.
//!
//! Pixels of the cutout, in units of their own noise. A track of a cosmic ray is a line of uneven charge, straight or bent; of a faint
//! one a single piece may stand out, as sharp as a star, or nothing but the whole, under a filter as long as it is. It does not cover
//! tracks that end within the source ([`super::sharpness`]).

use ndarray::Array2;

use crate::base::stats;
use crate::photometry::target::cells::grown;
use crate::photometry::target::cutout::Cutout;
use crate::photometry::trails::direction::ONE_DIRECTION;

/// From this significance on a compact source is judged by its own pixels alone; its pixels, and those within one FWHM, do not
/// count on lines through others.
const FAINT_SIGMA: f64 = 10.0;
/// How far the line is followed to each side \[px\].
const LENGTHS_PX: [usize; 4] = [0, 7, 14, 28];
/// Curvatures of lines: straight, or a bend of 20 px radius to either side \[rad/px\].
const BENDS: [f64; 3] = [0.0, 0.05, -0.05];
/// A pixel counts no more than this \[σ\], so that another source on the line does not make it one.
const MOST_SIGMA: f64 = 2.5;
/// Light of a straight line \[σ\], the best of 176 directions and 15 pairs of ends: 600 points of S/N 5 to 7 reach 4.25 five times in 1000.
const LINE_SIGMA: f64 = 4.5;
/// Of bent ones there are more, and they reach their noise more often: their light is so many times that.
const BENT_MORE: f64 = 1.13;
/// Directions of lines: half a pixel apart at their ends.
const DIRECTIONS: usize = 176;
/// Where the star takes all but so much of the variance of a line, the line is the star itself.
const LEAST_VARIANCE: f64 = 0.8;
/// Bent lines may be what the model of the star trails leaves if they come near to their direction within so many pixels \[px\].
const BEND_PX: f64 = 14.0;

/// A source and the pixels around it, in units of their noise.
struct Surroundings {
    /// Place of the source \[px\].
    at: (f64, f64),
    /// Light without the star that fits at the source; NaN where a pixel is bad or belongs to another source.
    rest: Array2<f64>,
    /// That star, for light 1.
    star: Array2<f64>,
    /// The sum of its squares where there is light.
    square: f64,
}

/// Sums along a line: Σ w², Σ w p and Σ w d, p being the star and d the light.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    square: f64,
    star: f64,
    light: f64,
}

impl Cutout {
    /// Whether a source of significance `snr` at (x, y) lies on a line of light as narrow as a pixel.
    ///
    /// The star that fits there is subtracted; of what is left a pixel counts up to ±2.5 σ. A line through the source has the weights w,
    /// shared between the two pixels of each column (row, if it is steep) next to it. With p the star,
    /// Σ w d > 4.5 √(Σ w² − (Σ w p)²/Σ p²): no light of the star is in it. Pixels within one FWHM
    /// of sources above 10 σ in `snr1` do not count.
    pub fn is_on_track(&self, at: (f64, f64), snr: f64, snr1: &Array2<f32>) -> bool {
        snr <= FAINT_SIGMA && self.has_line(at, snr1, LINE_SIGMA)
    }

    /// Whether a source of significance `snr` under a filter wider than a star is such a line itself: of a wide source no line of pixels is
    /// more significant than all of it.
    pub fn is_track(&self, at: (f64, f64), snr: f64, snr1: &Array2<f32>) -> bool {
        self.has_line(at, snr1, LINE_SIGMA.max(snr))
    }

    fn has_line(&self, at: (f64, f64), snr1: &Array2<f32>, least: f64) -> bool {
        let Some(around) = self.surroundings(at, snr1) else { return false };
        let trails = self.trail_background.as_ref().map(|t| t.theta());
        let is_off = |theta: f64, bend: f64| {
            let clear = (ONE_DIRECTION + BEND_PX * bend.abs()).sin();
            trails.is_none_or(|trail| (theta - trail).sin().abs() > clear)
        };
        (0..DIRECTIONS).map(|k| std::f64::consts::PI * k as f64 / DIRECTIONS as f64).any(|theta| {
            BENDS.iter().filter(|bend| is_off(theta, **bend)).any(|bend| {
                let least = if *bend == 0.0 { least } else { BENT_MORE * least };
                around.line_is_bright(theta, *bend, least)
            })
        })
    }

    /// The pixels around a source; `None` where nothing of it is seen.
    fn surroundings(&self, at: (f64, f64), snr1: &Array2<f32>) -> Option<Surroundings> {
        let reach = LENGTHS_PX[LENGTHS_PX.len() - 1] as i64 + 2;
        let (i0, j0) = (at.0.round() as i64 - reach, at.1.round() as i64 - reach);
        let side = 2 * reach as usize + 1;
        let (ny, nx) = self.pixels.dim();
        let others = grown(&snr1.mapv(|snr| f64::from(snr) > FAINT_SIGMA), self.fwhm_cells().ceil() as usize);
        let (my, mx) = others.dim();
        let reach_px = self.psf.reach_px();
        let mut star = Array2::zeros((side, side));
        let mut rest = Array2::from_elem((side, side), f64::NAN);
        for ((v, u), rest) in rest.indexed_iter_mut() {
            let (i, j) = (usize::try_from(i0 + u as i64), usize::try_from(j0 + v as i64));
            let (Some(i), Some(j)) = (i.ok().filter(|i| *i < nx), j.ok().filter(|j| *j < ny)) else { continue };
            let cell = [(j / self.net.bin).min(my - 1), (i / self.net.bin).min(mx - 1)];
            if others[cell] {
                continue;
            }
            let light = self.light_at(i, j);
            let noise = (self.rms_e * self.rms_e + light).sqrt();
            *rest = (f64::from(self.pixels[[j, i]]) - self.sky.level(i as f64, j as f64) - light) / noise;
            let (dx, dy) = (i as f64 - at.0, j as f64 - at.1);
            if dx.hypot(dy) < reach_px {
                star[[v, u]] = self.psf.share(dx, dy).point;
            }
        }
        let mut known: Vec<f64> = rest.iter().copied().filter(|v| v.is_finite()).collect();
        // what scatters more than its photons is structure of the sky
        let unit = stats::mad_sigma(&mut known)?.max(1.0);
        let both = star.iter().zip(&rest).filter(|(_, r)| r.is_finite());
        let (light, square) = both.fold((0.0, 0.0), |(light, square), (p, r)| (light + p * r, square + p * p));
        if !(square > 0.0) {
            return None;
        }
        let flux = light / square;
        rest.zip_mut_with(&star, |r, p| *r = ((*r - flux * p) / unit).clamp(-MOST_SIGMA, MOST_SIGMA));
        Some(Surroundings { at: (at.0 - i0 as f64, at.1 - j0 as f64), rest, star, square })
    }
}

impl Surroundings {
    /// Whether a line through the source, up to any of its ends, has light of more than `least` σ.
    fn line_is_bright(&self, theta: f64, bend: f64, least: f64) -> bool {
        let ahead = self.side(theta, bend, 0);
        let back = self.side(theta + std::f64::consts::PI, -bend, 1);
        ahead.iter().any(|a| {
            back.iter().any(|b| {
                let variance = a.square + b.square - (a.star + b.star).powi(2) / self.square;
                variance > LEAST_VARIANCE && a.light + b.light > least * variance.sqrt()
            })
        })
    }

    /// The sums from the source, or `from` one step beyond it, to each of the ends.
    fn side(&self, mut heading: f64, bend: f64, from: usize) -> [Sums; LENGTHS_PX.len()] {
        let (mut x, mut y) = self.at;
        let mut sums = Sums::default();
        let mut step = 0;
        LENGTHS_PX.map(|end| {
            while step <= end {
                if step >= from {
                    self.add((x, y), heading, &mut sums);
                }
                // a column or a row further
                let (sin, cos) = heading.sin_cos();
                let length = 1.0 / sin.abs().max(cos.abs());
                let (sin, cos) = (heading + 0.5 * bend * length).sin_cos();
                (x, y, heading) = (x + length * cos, y + length * sin, heading + bend * length);
                step += 1;
            }
            sums
        })
    }

    /// Adds the two pixels of a column, or of a row, next to a line.
    fn add(&self, (x, y): (f64, f64), heading: f64, sums: &mut Sums) {
        let (sin, cos) = heading.sin_cos();
        let is_steep = sin.abs() > cos.abs();
        let (along, across, slope) = if is_steep { (y, x, cos / sin) } else { (x, y, sin / cos) };
        let own = along.round();
        let other = across + slope * (own - along);
        let (first, share) = (other.floor(), other - other.floor());
        for (other, weight) in [(first, 1.0 - share), (first + 1.0, share)] {
            let (i, j) = if is_steep { (other, own) } else { (own, other) };
            if i < 0.0 || j < 0.0 {
                continue;
            }
            let at = [j as usize, i as usize];
            if let Some(rest) = self.rest.get(at).filter(|rest| rest.is_finite()) {
                sums.square += weight * weight;
                sums.star += weight * self.star[at];
                sums.light += weight * rest;
            }
        }
    }
}
