//! Where the target can be: a cutout without the light of star trails, and the candidates in it.
//!
//! Electrons; columns and rows of the cutout. What lines up over long stretches is a trail, what comes in families of
//! equal streaks is a short trail, what is one pixel wide is a hit; the target is the most significant of the rest.

use ndarray::Array2;

use crate::frames::{Electrons, Frame, mask};
use crate::photometry::aperture::{Bounds, Shape, cells};
use crate::photometry::background::Background;
use crate::photometry::label::{Run, label, runs_of_row};
use crate::photometry::smooth::{Kernel, level_offset, net_row, smooth_image};
use crate::photometry::target::TargetSettings;
use crate::photometry::target_shape::{Ellipse, axes, covariance};
use crate::photometry::trail::trail_direction;
use crate::photometry::trail_model::Strips;

/// Threshold of the outline \[σ of the smoothed frame\].
pub(crate) const OUTLINE_SIGMA: f64 = 3.0;
/// Threshold of the pixels that make trails \[σ of the smoothed frame\].
const TRAIL_SIGMA: f64 = 4.0;
/// The same for faint trails, which must be longer to count \[σ\].
const FAINT_TRAIL_SIGMA: f64 = 2.5;
/// Share of a trail's light that its constant profile may get wrong (flicker, seeing).
const TRAIL_MODEL_ERR: f32 = 0.05;
/// Share of the change of the model over a block that it may get wrong: where a trail ends.
const END_ERR: f32 = 0.5;
/// A candidate at the edge of the search region counts exp(−this) of one at the expected place.
const PREFER_NEAR: f64 = 3.0;
/// Significance beyond this many thresholds is no further merit.
const SCORE_CAP: f64 = 10.0;
/// What an object cut by an edge, or a streak along the trails, counts.
const SUSPECT: f64 = 0.2;
/// A streak along the trails longer than this is one of them \[FWHM\].
const TRAIL_LENGTH_FWHM: f64 = 18.0;
/// Widths of the filter, in units of the FWHM: the target may be larger and fainter than a star.
const SCALES: [f64; 3] = [1.0, 2.0, 4.0];

/// The part of the frame where the target can be, sky taken off.
pub(crate) struct Cutout {
    /// Local columns and rows of the frame.
    pub x0: usize,
    pub y0: usize,
    pub net: Array2<f32>,
    pub rms_e: f64,
    pub trails: Trails,
    /// Whether each side (left, right, bottom, top) is the frame's own edge.
    at_edge: [bool; 4],
}

/// The light of trails in the cutout.
pub(crate) struct Trails {
    /// The frame less `sky_e`, NaN where it is bad; empty without trails.
    pub pixels: Array2<f32>,
    /// One level for the whole cutout \[e⁻\]: the mesh follows the trails and the target.
    pub sky_e: f64,
    /// Means along the trails, if there are any.
    pub strips: Option<Strips>,
    /// What lies along the trails above the mesh \[e⁻\].
    pub light: Array2<f32>,
    /// By how much it changes over a few pixels \[e⁻\]: where trails end.
    pub unsure: Array2<f32>,
}

/// A component that may be the target, in columns and rows of the cutout.
pub(crate) struct Candidate {
    pub pixels: Vec<(usize, usize)>,
    pub snr: f64,
    score: f64,
    scale: usize,
}

impl Cutout {
    pub fn new(frame: &Frame<Electrons>, background: &Background, s: &TargetSettings) -> Option<Self> {
        let bounds = Bounds::of(frame);
        let reach = s.search_radius_px + 100.0 + 2.0 * s.sky_out_px;
        let columns = cells(s.x_px - reach, s.x_px + reach, bounds.x0, bounds.x1);
        let rows = cells(s.y_px - reach, s.y_px + reach, bounds.y0, bounds.y1);
        if columns.len() < 8 || rows.len() < 8 || s.fwhm_px.is_nan() || s.fwhm_px <= 0.0 {
            return None;
        }
        let (x0, y0) = (columns.start - bounds.x0, rows.start - bounds.y0);
        let mut net = Array2::zeros((rows.len(), columns.len()));
        let mut line = vec![0f32; frame.pixels.ncols()];
        let offset_e = level_offset(frame, background, y0..y0 + rows.len(), x0..x0 + columns.len());
        for (k, mut out) in net.rows_mut().into_iter().enumerate() {
            net_row(frame, background, offset_e, y0 + k, &mut line);
            out.iter_mut().zip(&line[x0..]).for_each(|(o, v)| *o = *v);
        }
        let dim = net.dim();
        let trails = Trails {
            pixels: Array2::zeros((0, 0)),
            sky_e: 0.0,
            strips: None,
            light: Array2::zeros(dim),
            unsure: Array2::zeros(dim),
        };
        let at_edge =
            [columns.start == bounds.x0, columns.end == bounds.x1, rows.start == bounds.y0, rows.end == bounds.y1];
        let rms_e = background.rms(s.x_px, s.y_px).max(1e-6);
        Some(Self { x0, y0, net, rms_e, trails, at_edge })
    }

    /// Full-frame position of the cutout's first pixel.
    pub fn origin(&self, frame: &Frame<Electrons>) -> (f64, f64) {
        ((frame.origin_px.0 + self.x0) as f64, (frame.origin_px.1 + self.y0) as f64)
    }

    /// Finds the direction of the trails and models their light.
    pub fn find_trails(&mut self, frame: &Frame<Electrons>, background: &Background, s: &TargetSettings) {
        let kernel = Kernel::gaussian(s.fwhm_px);
        let smooth = smooth_image(&self.net, &kernel);
        let above = |sigma: f64| {
            let threshold = (sigma * self.rms_e * kernel.noise_factor()) as f32;
            smooth.mapv(|v| v > threshold)
        };
        let Some(theta) = trail_direction(&above(TRAIL_SIGMA), &above(FAINT_TRAIL_SIGMA), s.fwhm_px) else { return };
        self.trails.sky_e = background.global_level();
        self.trails.pixels = Array2::from_shape_fn(self.net.dim(), |(j, i)| {
            let at = [self.y0 + j, self.x0 + i];
            let usable = frame.mask[at] & (mask::BAD | mask::CLIPPED) == 0;
            if usable { (f64::from(frame.pixels[at]) - self.trails.sky_e) as f32 } else { f32::NAN }
        });
        self.trails.strips = Some(Strips::new(&self.trails.pixels, theta, s.fwhm_px, self.rms_e));
        self.model_trails(None);
    }

    /// Models the trails' light, a known object left out.
    pub fn model_trails(&mut self, object: Option<&Ellipse>) {
        let Some(strips) = &self.trails.strips else { return };
        let shape = |e: &Ellipse| Shape::Ellipse { a_px: e.a, b_px: e.b, theta_rad: e.theta };
        let holes: Vec<_> = object.iter().map(|e| strips.hole((e.x, e.y), shape(e))).collect();
        let (level, unsure) = strips.everywhere(self.net.dim(), &holes);
        // in terms of the net frame, whose mesh has followed the trails
        self.trails.light = Array2::from_shape_fn(self.net.dim(), |at| {
            let light = self.net[at] - (self.trails.pixels[at] - level[at]);
            if light.is_finite() { light } else { 0.0 }
        });
        self.trails.unsure = unsure;
    }

    /// The cutout without sky and trails.
    pub fn residual(&self) -> Array2<f32> {
        &self.net - &self.trails.light
    }

    /// Signal-to-noise after a filter; the noise knows the trails' light and how well it is known.
    fn significance(&self, kernel: &Kernel) -> Array2<f32> {
        let mut snr = smooth_image(&self.residual(), kernel);
        let factor = kernel.noise_factor();
        if self.trails.strips.is_none() {
            let sigma = (self.rms_e * factor) as f32;
            snr.mapv_inplace(|v| v / sigma);
            return snr;
        }
        let mut doubt = self.trails.light.mapv(|t| TRAIL_MODEL_ERR * t.max(0.0));
        doubt.scaled_add(END_ERR, &self.trails.unsure);
        let doubt = smooth_image(&doubt, kernel);
        let (noise, factor) = ((self.rms_e * self.rms_e) as f32, (factor * factor) as f32);
        ndarray::Zip::from(&mut snr).and(&self.trails.light).and(&doubt).for_each(|v, t, d| {
            *v /= ((noise + t.max(0.0)) * factor + d * d).sqrt();
        });
        snr
    }

    /// The component most likely to be the target.
    pub fn best_candidate(&self, frame: &Frame<Electrons>, s: &TargetSettings) -> Option<Candidate> {
        let mut best: Option<Candidate> = None;
        for (scale, factor) in SCALES.iter().enumerate() {
            let snr = self.significance(&Kernel::gaussian(factor * s.fwhm_px));
            for candidate in self.candidates(frame, &snr, scale, s) {
                // a larger filter must be worth it: its outline is less sharp
                let handicap = 1.3f64.powi((candidate.scale as i32) - best.as_ref().map_or(0, |b| b.scale as i32));
                if best.as_ref().is_none_or(|b| candidate.score > b.score * handicap.max(1.0)) {
                    best = Some(candidate);
                }
            }
            // bright enough to be outlined at this scale
            if best.as_ref().is_some_and(|b| b.snr > 3.0 * s.detect_sigma) {
                break;
            }
        }
        best
    }

    fn candidates(
        &self,
        frame: &Frame<Electrons>,
        snr: &Array2<f32>,
        scale: usize,
        s: &TargetSettings,
    ) -> Vec<Candidate> {
        let (ny, nx) = snr.dim();
        let mut runs: Vec<Run> = Vec::new();
        for (j, row) in snr.rows().into_iter().enumerate() {
            runs_of_row(j, row.iter().map(|v| *v > OUTLINE_SIGMA as f32), &mut runs);
        }
        let (labels, n) = label(&runs);
        let mut groups: Vec<Vec<(usize, usize)>> = vec![Vec::new(); n];
        for (run, l) in runs.iter().zip(labels) {
            groups[l].extend(run.columns.clone().map(|i| (i, run.row)));
        }
        let (ox, oy) = self.origin(frame);
        let expected = (s.x_px - ox, s.y_px - oy);
        let streaks: Vec<Option<(f64, f64)>> = groups.iter().map(|g| streak(g)).collect();
        let trail_angle = self.trails.strips.as_ref().map(|s| s.turned.sin.atan2(s.turned.cos));
        let [left, right, bottom, top] = self.at_edge;
        let mut found = Vec::new();
        for (g, pixels) in groups.into_iter().enumerate() {
            let peak = pixels.iter().map(|&(i, j)| f64::from(snr[[j, i]])).fold(0.0, f64::max);
            let runs_out = pixels.iter().any(|&(i, j)| {
                (i == 0 && !left) || (i + 1 == nx && !right) || (j == 0 && !bottom) || (j + 1 == ny && !top)
            });
            if peak < s.detect_sigma || runs_out || one_of_a_family(&streaks, g) {
                continue;
            }
            let (mut w, mut x, mut y) = (0.0, 0.0, 0.0);
            for &(i, j) in &pixels {
                let v = f64::from(snr[[j, i]]);
                w += v;
                x += v * i as f64;
                y += v * j as f64;
            }
            let (x, y) = (x / w, y / w);
            let distance = (x - expected.0).hypot(y - expected.1);
            if distance > s.search_radius_px || self.is_hot_pixel(&pixels) {
                continue;
            }
            // beyond the cap brightness is no merit: a remainder of a bright trail must not win over the target
            let near = (-PREFER_NEAR * (distance / s.search_radius_px.max(1.0)).powi(2)).exp();
            let cut = pixels.iter().any(|&(i, j)| self.is_cut_at(frame, i, j));
            let along = streaks[g]
                .zip(trail_angle)
                .filter(|((t, _), theta)| (2.0 * (t - theta)).cos() > 0.97)
                .map(|((_, length), _)| length);
            if along.is_some_and(|length| length > TRAIL_LENGTH_FWHM * s.fwhm_px) {
                continue;
            }
            let suspect = if cut || along.is_some() { SUSPECT } else { 1.0 };
            let score = peak.min(SCORE_CAP * s.detect_sigma) * near * suspect;
            found.push(Candidate { pixels, snr: peak, score, scale });
        }
        found
    }

    /// Whether a pixel is next to the edge of the frame or to pixels that do not count.
    fn is_cut_at(&self, frame: &Frame<Electrons>, i: usize, j: usize) -> bool {
        let (ny, nx) = frame.pixels.dim();
        let (x, y) = (self.x0 + i, self.y0 + j);
        let clipped = |x: usize, y: usize| frame.mask[[y, x]] & mask::CLIPPED != 0;
        x == 0
            || y == 0
            || x + 1 >= nx
            || y + 1 >= ny
            || clipped(x - 1, y)
            || clipped(x + 1, y)
            || clipped(x, y - 1)
            || clipped(x, y + 1)
    }

    /// Whether one pixel holds more than half the light around the brightest: no star image does.
    fn is_hot_pixel(&self, pixels: &[(usize, usize)]) -> bool {
        let (ny, nx) = self.net.dim();
        let residual = |i: usize, j: usize| f64::from(self.net[[j, i]] - self.trails.light[[j, i]]);
        let Some(&(i, j)) = pixels.iter().max_by(|p, q| residual(p.0, p.1).total_cmp(&residual(q.0, q.1))) else {
            return false;
        };
        let mut around = 0.0;
        for jj in j.saturating_sub(2)..(j + 3).min(ny) {
            for ii in i.saturating_sub(2)..(i + 3).min(nx) {
                around += residual(ii, jj);
            }
        }
        let peak = residual(i, j);
        peak > 6.0 * self.rms_e && peak > 0.6 * around
    }
}

/// Angle and length of a component that is a streak: at least 2.5 times as long as wide.
fn streak(pixels: &[(usize, usize)]) -> Option<(f64, f64)> {
    let (_, _, xx, xy, yy) = covariance(pixels);
    let (a, b, theta) = axes(xx, xy, yy);
    (pixels.len() > 20 && a > 2.5 * b).then(|| (theta, 12f64.sqrt() * a))
}

/// Whether at least two other components are streaks of nearly the same direction and length: short star trails.
fn one_of_a_family(streaks: &[Option<(f64, f64)>], which: usize) -> bool {
    let Some((theta, length)) = streaks[which] else { return false };
    let alike = streaks.iter().enumerate().filter(|(k, other)| {
        other.is_some_and(|(t, l)| *k != which && (2.0 * (t - theta)).cos() > 0.98 && (l / length).ln().abs() < 0.25)
    });
    alike.count() >= 2
}
