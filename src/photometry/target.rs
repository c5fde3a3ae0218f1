//! The tracked satellite: a compact or elongated blob near the expected place, among parallel star trails.
//!
//! Electrons and full-frame pixels.

use ndarray::{Array2, s};

use crate::frames::{Electrons, Frame};
use crate::photometry::Flags;
use crate::photometry::aperture::{Bounds, Shape, cells, for_each_pixel};
use crate::photometry::background::Background;
use crate::photometry::centroid::FWHM_PER_SIGMA;
use crate::photometry::flux::{Flux, annulus_sky, flux_over_sky, measure};
use crate::photometry::label::{Run, label, runs_of_row};
use crate::photometry::smooth::{Kernel, level_offset, net_row, smooth_image};
use crate::photometry::trail::{Trails, trails};

/// Where and how to look for the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetSettings {
    /// Expected place \[px\].
    pub x_px: f64,
    /// Expected place \[px\].
    pub y_px: f64,
    /// How far from there the target may be \[px\].
    pub search_radius_px: f64,
    /// Threshold of the whole target \[σ\].
    pub detect_sigma: f64,
    /// Added around the object's own outline \[px\].
    pub margin_px: f64,
    /// Aperture radius of a limit \[px\].
    pub limit_r_px: f64,
    /// FWHM of a point source \[px\].
    pub fwhm_px: f64,
    /// Inner radius of the annulus of an aperture of `limit_r_px` \[px\].
    pub sky_in_px: f64,
    /// Outer radius of that annulus \[px\]; the target's own annulus keeps its gap and width.
    pub sky_out_px: f64,
    /// Clip of the sky pixels \[σ\].
    pub clip_sigma: f64,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub enum TargetFound {
    /// The target.
    Detected {
        /// Its flux, in the aperture that encloses it.
        flux: Flux,
        /// Centre of the aperture \[px\].
        x_px: f64,
        /// Centre of the aperture \[px\].
        y_px: f64,
        /// Semi-major axis of the outline \[px\].
        a_px: f64,
        /// Semi-minor axis of the outline \[px\].
        b_px: f64,
        /// Angle of the major axis from +x towards +y \[rad\].
        theta_rad: f64,
        /// Ratio of the axes.
        elongation: f64,
    },
    /// Nothing above the threshold.
    NotDetected {
        /// `detect_sigma` times the error of an empty aperture of `limit_r_px` at the expected place \[e⁻\].
        limit_e: f64,
        /// What that aperture holds, negative or not.
        flux: Flux,
        /// The expected place \[px\].
        x_px: f64,
        /// The expected place \[px\].
        y_px: f64,
    },
}

/// Threshold of the outline \[σ of the smoothed frame\].
const OUTLINE_SIGMA: f64 = 3.0;
/// Threshold of the pixels that make trails \[σ of the smoothed frame\].
const TRAIL_SIGMA: f64 = 4.0;
/// The same for faint trails, which must be longer to count \[σ\].
const FAINT_TRAIL_SIGMA: f64 = 2.5;
/// Share of a trail's light that its constant profile may get wrong (flicker, seeing).
const TRAIL_MODEL_ERR: f64 = 0.05;
/// Widths of the filter, in units of the FWHM: the target may be larger and fainter than a star.
const SCALES: [f64; 3] = [1.0, 2.0, 4.0];
/// An elliptical Gaussian out to this many σ holds 0.997 of its light.
const ENCLOSING_SIGMA: f64 = 3.4;
/// From this signal-to-noise on the moments of the target are trusted.
const MOMENTS_SNR: f64 = 15.0;

/// The part of the frame where the target can be, sky taken off.
struct Cutout {
    /// Local columns and rows of the frame.
    x0: usize,
    y0: usize,
    net: Array2<f32>,
    rms_e: f64,
    trails: Trails,
    /// Whether each side (left, right, bottom, top) is the frame's own edge.
    at_edge: [bool; 4],
}

/// A component that may be the target, in columns and rows of the cutout.
struct Candidate {
    pixels: Vec<(usize, usize)>,
    snr: f64,
    score: f64,
    scale: usize,
    x: f64,
    y: f64,
}

/// An ellipse: centre, semi-axes and angle.
#[derive(Clone, Copy)]
struct Ellipse {
    x: f64,
    y: f64,
    a: f64,
    b: f64,
    theta: f64,
}

/// Finds and measures the target, or says how bright it could have been.
///
/// 1. Around the expected place the frame is smoothed; what lines up in long straight runs is star trails, and their
///    light, a constant profile across, is taken off ([`Flags::TRAIL`] if any of it was inside the aperture).
/// 2. What is left is smoothed at 1, 2 and 4 FWHM. A candidate peaks above `detect_sigma` within the search radius, does
///    not run out of the cutout, is not one of a family of equal parallel streaks, and is not a single hot pixel.
///    Of several the most significant is taken, those near the expected place preferred.
/// 3. The aperture is the ellipse around its outline at 3 σ plus `margin_px`, at least 1.5 FWHM and, for a target of
///    S/N above 15, 3.4 σ of its own second moments (0.997 of a Gaussian). The sky is an annulus beyond it, other
///    objects and trails left out.
///
/// [`TargetFound::NotDetected`] holds the forced flux at the expected place, negative or not, and the limit.
#[must_use]
pub fn measure_target(frame: &Frame<Electrons>, background: &Background, settings: &TargetSettings) -> TargetFound {
    let Some(mut cutout) = Cutout::new(frame, background, settings) else {
        return limit_without_cutout(frame, background, settings);
    };
    cutout.find_trails(settings, None);
    let mut found = cutout.best_candidate(frame, settings);
    if let (Some(first), true) = (&found, cutout.trails.theta_rad.is_some()) {
        // once more with the target kept out of the trails' profiles
        let reach =
            first.pixels.iter().map(|&(i, j)| (i as f64 - first.x).hypot(j as f64 - first.y)).fold(0.0, f64::max);
        cutout.find_trails(settings, Some((first.x, first.y, reach + 1.5 * settings.fwhm_px)));
        found = cutout.best_candidate(frame, settings).or(found);
    }
    let cleaned = cutout.cleaned(frame);
    let Some(found) = found else { return cutout.limit(&cleaned, background, settings) };
    let outline = enclosing_ellipse(&found);
    let shape_of_light = (found.snr > MOMENTS_SNR).then(|| cutout.moments(&outline, settings.fwhm_px)).flatten();
    let aperture = aperture_around(&outline, shape_of_light.as_ref(), settings);
    let (ox, oy) = cutout.origin(frame);
    let (x_px, y_px) = (aperture.x + ox, aperture.y + oy);
    let shape = if aperture.a < 1.15 * aperture.b {
        Shape::Circle { r_px: aperture.a }
    } else {
        Shape::Ellipse { a_px: aperture.a, b_px: aperture.b, theta_rad: aperture.theta }
    };
    let mut flux = cutout.flux(&cleaned, background, (x_px, y_px), shape, settings);
    if !flux.flux_e.is_finite() {
        return cutout.limit(&cleaned, background, settings);
    }
    let own = shape_of_light.unwrap_or(outline);
    let elongation = own.a / own.b;
    if elongation > 1.5 {
        flux.flags.set(Flags::ELONGATED);
    }
    TargetFound::Detected { flux, x_px, y_px, a_px: outline.a, b_px: outline.b, theta_rad: own.theta, elongation }
}

/// The limit where the expected place is off the frame: nothing measurable.
fn limit_without_cutout(frame: &Frame<Electrons>, background: &Background, s: &TargetSettings) -> TargetFound {
    let shape = Shape::Circle { r_px: s.limit_r_px };
    let flux = measure(frame, background, s.x_px, s.y_px, shape, s.sky_in_px, s.sky_out_px, s.clip_sigma);
    TargetFound::NotDetected { limit_e: f64::NAN, flux, x_px: s.x_px, y_px: s.y_px }
}

impl Cutout {
    fn new(frame: &Frame<Electrons>, background: &Background, s: &TargetSettings) -> Option<Self> {
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
            theta_rad: None,
            light: Array2::zeros(dim),
            per_pixel: Array2::zeros(dim),
            ends: Array2::from_elem(dim, false),
        };
        let at_edge =
            [columns.start == bounds.x0, columns.end == bounds.x1, rows.start == bounds.y0, rows.end == bounds.y1];
        let rms_e = background.rms(s.x_px, s.y_px).max(1e-6);
        Some(Self { x0, y0, net, rms_e, trails, at_edge })
    }

    /// Full-frame position of the cutout's first pixel.
    fn origin(&self, frame: &Frame<Electrons>) -> (f64, f64) {
        ((frame.origin_px.0 + self.x0) as f64, (frame.origin_px.1 + self.y0) as f64)
    }

    fn find_trails(&mut self, s: &TargetSettings, keep_out: Option<(f64, f64, f64)>) {
        let kernel = Kernel::gaussian(s.fwhm_px);
        let smooth = smooth_image(&self.net, &kernel);
        let above = |sigma: f64| {
            let threshold = (sigma * self.rms_e * kernel.noise_factor()) as f32;
            smooth.mapv(|v| v > threshold)
        };
        self.trails = trails(&self.net, &above(TRAIL_SIGMA), &above(FAINT_TRAIL_SIGMA), s.fwhm_px, keep_out);
    }

    /// Signal-to-noise after a filter; the noise knows the trails' light and how well it is known.
    fn significance(&self, kernel: &Kernel) -> Array2<f32> {
        let mut residual = &self.net - &self.trails.light;
        residual.zip_mut_with(&self.trails.ends, |v, end| *v = if *end { 0.0 } else { *v });
        let mut snr = smooth_image(&residual, kernel);
        let light = smooth_image(&self.trails.light, kernel);
        let factor = kernel.noise_factor().powi(2);
        snr.zip_mut_with(&light, |v, t| {
            let t = f64::from(t.max(0.0));
            let variance = (self.rms_e * self.rms_e + t) * factor + (TRAIL_MODEL_ERR * t).powi(2);
            *v = (f64::from(*v) / variance.sqrt()) as f32;
        });
        snr
    }

    /// The component most likely to be the target.
    fn best_candidate(&self, frame: &Frame<Electrons>, s: &TargetSettings) -> Option<Candidate> {
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
            let score = peak * (-(distance / s.search_radius_px.max(1.0)).powi(2)).exp();
            found.push(Candidate { pixels, snr: peak, score, scale, x, y });
        }
        found
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

    /// Second moments of the light under an elliptical Gaussian that follows them; `None` where they do not settle.
    fn moments(&self, outline: &Ellipse, fwhm_px: f64) -> Option<Ellipse> {
        let (ny, nx) = self.net.dim();
        let least = (fwhm_px / FWHM_PER_SIGMA).powi(2);
        let (mut x, mut y) = (outline.x, outline.y);
        let (sin, cos) = outline.theta.sin_cos();
        let (p, q) = ((outline.a / 2.0).powi(2).max(least), (outline.b / 2.0).powi(2).max(least));
        let (mut xx, mut xy, mut yy) =
            (cos * cos * p + sin * sin * q, sin * cos * (p - q), sin * sin * p + cos * cos * q);
        for _ in 0..60 {
            let det = xx * yy - xy * xy;
            let (ixx, ixy, iyy) = (yy / det, -xy / det, xx / det);
            let (rx, ry) = (4.0 * xx.sqrt(), 4.0 * yy.sqrt());
            let (mut w, mut sx, mut sy, mut sxx, mut sxy, mut syy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
            for j in cells(y - ry, y + ry, 0, ny) {
                for i in cells(x - rx, x + rx, 0, nx) {
                    let (dx, dy) = (i as f64 - x, j as f64 - y);
                    let weight = (-0.5 * (ixx * dx * dx + 2.0 * ixy * dx * dy + iyy * dy * dy)).exp()
                        * f64::from(self.net[[j, i]] - self.trails.light[[j, i]]);
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
            if (x - outline.x).hypot(y - outline.y) > outline.a || xx + yy > 16.0 * outline.a * outline.a {
                return None;
            }
            if change < 1e-3 && dx.abs().max(dy.abs()) < 1e-2 {
                let (a, b, theta) = axes(xx, xy, yy);
                return Some(Ellipse { x, y, a, b, theta });
            }
        }
        None
    }

    /// The cutout as a frame without the light of trails.
    fn cleaned(&self, frame: &Frame<Electrons>) -> Cleaned {
        let (ny, nx) = self.net.dim();
        let region = s![self.y0..self.y0 + ny, self.x0..self.x0 + nx];
        let mut pixels = frame.pixels.slice(region).to_owned();
        pixels -= &self.trails.light;
        let mut part = Frame::from_electrons(frame.path.clone(), pixels, frame.gain.clone());
        part.mask = frame.mask.slice(region).to_owned();
        part.origin_px = (frame.origin_px.0 + self.x0, frame.origin_px.1 + self.y0);
        part.full_size_px = frame.full_size_px;
        // what must not count as sky: trails, and anything significant with a margin of one pixel
        let kernel = Kernel::gaussian(3.0);
        let threshold = (OUTLINE_SIGMA * self.rms_e * kernel.noise_factor()) as f32;
        let smooth = smooth_image(&self.net, &kernel);
        let light_limit = 0.1 * self.rms_e as f32;
        let objects = Array2::from_shape_fn((ny, nx), |at| {
            smooth[at] > 4.0 / OUTLINE_SIGMA as f32 * threshold
                || self.trails.light[at] > light_limit
                || self.trails.ends[at]
        });
        Cleaned { part, not_sky: grown(&objects, 3) }
    }

    /// The flux on the cleaned frame; the annulus grows until it has enough sky.
    fn flux(
        &self,
        cleaned: &Cleaned,
        background: &Background,
        at: (f64, f64),
        shape: Shape,
        s: &TargetSettings,
    ) -> Flux {
        let (gap, width) = ((s.sky_in_px - s.limit_r_px).max(1.0), (s.sky_out_px - s.sky_in_px).max(2.0));
        let inner = shape.bounding_radius_px() + gap;
        let (ox, oy) = cleaned.part.origin_px;
        let not_sky = |i: usize, j: usize| cleaned.not_sky[[j - oy, i - ox]];
        let mut outer = inner + width;
        let mut sky = annulus_sky(&cleaned.part, background, at, (inner, outer), s.clip_sigma, not_sky);
        for _ in 0..3 {
            if sky.n >= 200 {
                break;
            }
            outer += width;
            sky = annulus_sky(&cleaned.part, background, at, (inner, outer), s.clip_sigma, not_sky);
        }
        // a trail's light is Poisson noise, and its profile is known to one over the pixels it rests on
        let chord = 2.0 * shape.bounding_radius_px();
        let sky_variance = self.rms_e * self.rms_e;
        let mut trail_light = 0f32;
        let trail_variance = |i: usize, j: usize| {
            let k = [j - oy, i - ox];
            let (light, per_pixel) = (f64::from(self.trails.light[k].max(0.0)), f64::from(self.trails.per_pixel[k]));
            light + (light + sky_variance) * per_pixel * chord
        };
        let mut flux = flux_over_sky(&cleaned.part, at, shape, (inner, outer), &sky, trail_variance);
        for_each_pixel(&shape, at.0, at.1, Bounds::of(&cleaned.part), |i, j, _| {
            trail_light = trail_light.max(self.trails.light[[j - oy, i - ox]]);
        });
        if f64::from(trail_light) > 0.3 * self.rms_e {
            flux.flags.set(Flags::TRAIL);
        }
        flux
    }

    /// The forced flux at the expected place and what could have been seen there.
    fn limit(&self, cleaned: &Cleaned, background: &Background, s: &TargetSettings) -> TargetFound {
        let shape = Shape::Circle { r_px: s.limit_r_px };
        let flux = self.flux(cleaned, background, (s.x_px, s.y_px), shape, s);
        // the error without the flux's own Poisson noise: that of an empty aperture
        let empty = (flux.flux_err_e.powi(2) - flux.flux_e.max(0.0)).sqrt();
        TargetFound::NotDetected { limit_e: s.detect_sigma * empty, flux, x_px: s.x_px, y_px: s.y_px }
    }
}

/// The cutout with the trails' light taken off, and what of it is not sky.
struct Cleaned {
    part: Frame<Electrons>,
    not_sky: Array2<bool>,
}

/// Every true pixel grown by `by` pixels along x and y.
fn grown(image: &Array2<bool>, by: usize) -> Array2<bool> {
    let (ny, nx) = image.dim();
    let mut along = Array2::from_elem((ny, nx), false);
    let mut out = Array2::from_elem((ny, nx), false);
    for ((j, i), _) in image.indexed_iter().filter(|(_, v)| **v) {
        along.slice_mut(s![j, i.saturating_sub(by)..(i + by + 1).min(nx)]).fill(true);
    }
    for ((j, i), _) in along.indexed_iter().filter(|(_, v)| **v) {
        out.slice_mut(s![j.saturating_sub(by)..(j + by + 1).min(ny), i]).fill(true);
    }
    out
}

/// Semi-axes (standard deviations) and angle of a covariance.
fn axes(xx: f64, xy: f64, yy: f64) -> (f64, f64, f64) {
    let (mean, half) = (0.5 * (xx + yy), (0.25 * (xx - yy).powi(2) + xy * xy).sqrt());
    ((mean + half).sqrt(), (mean - half).max(1.0 / 12.0).sqrt(), 0.5 * (2.0 * xy).atan2(xx - yy))
}

/// Centre and covariance of a set of pixels, each with its own 1/12 px².
fn covariance(pixels: &[(usize, usize)]) -> (f64, f64, f64, f64, f64) {
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

/// The ellipse of a component's own covariance that holds the centres of all its pixels.
fn enclosing_ellipse(found: &Candidate) -> Ellipse {
    let (x, y, xx, xy, yy) = covariance(&found.pixels);
    let (a, b, theta) = axes(xx, xy, yy);
    let (sin, cos) = theta.sin_cos();
    let reach = found.pixels.iter().map(|&(i, j)| {
        let (dx, dy) = (i as f64 - x, j as f64 - y);
        ((dx * cos + dy * sin) / a).hypot((dy * cos - dx * sin) / b)
    });
    let t = reach.fold(1.0, f64::max);
    Ellipse { x, y, a: t * a, b: t * b, theta }
}

/// The aperture: outline plus margin, wide enough for faint targets and for the wings of bright ones.
fn aperture_around(outline: &Ellipse, light: Option<&Ellipse>, s: &TargetSettings) -> Ellipse {
    let least = 1.5 * s.fwhm_px;
    let mut out = *outline;
    out.a = (outline.a + s.margin_px).max(least);
    out.b = (outline.b + s.margin_px).max(least);
    if let Some(light) = light {
        // the axes nearly agree; the longer of both serves, within twice the outline
        out.a = out.a.max((ENCLOSING_SIGMA * light.a).min(2.0 * out.a));
        out.b = out.b.max((ENCLOSING_SIGMA * light.b).min(2.0 * out.b));
    }
    out
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
