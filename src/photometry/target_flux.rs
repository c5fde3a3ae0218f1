//! The flux of the target and of the places where it was not: over an annulus, or over the level along the trails.
//!
//! Electrons and full-frame pixels. Among trails the error is the scatter of empty apertures treated like the target's
//! own, where that is larger than what photons explain. Leaves out: where the target is and how large.

use ndarray::{Array2, s};

use crate::frames::{Electrons, Frame};
use crate::photometry::Flags;
use crate::photometry::aperture::{Bounds, Shape, for_each_pixel};
use crate::photometry::background::Background;
use crate::photometry::flux::{Flux, Sky, annulus_sky, flux_over_sky};
use crate::photometry::smooth::{Kernel, smooth_image};
use crate::photometry::stats;
use crate::photometry::target::{TargetFound, TargetSettings};
use crate::photometry::target_search::Cutout;
use crate::photometry::trail_model::{Hole, Level, Strips, catmull_rom};

/// Significant pixels are not sky \[σ of a frame smoothed with 3 px\].
const NOT_SKY_SIGMA: f64 = 4.0;
/// A trail is flagged where its light is above this \[σ of a sky pixel\].
const TRAIL_LIGHT: f64 = 0.3;
/// Most empty apertures.
const MAX_EMPTY: usize = 80;
/// Fewest empty apertures whose scatter is believed.
const MIN_EMPTY: usize = 8;

impl Cutout {
    /// The cutout as a frame without the light of trails.
    pub fn cleaned(&self, frame: &Frame<Electrons>) -> Cleaned {
        let (ny, nx) = self.net.dim();
        let region = s![self.y0..self.y0 + ny, self.x0..self.x0 + nx];
        let mut pixels = frame.pixels.slice(region).to_owned();
        pixels -= &self.trails.light;
        let mut part = Frame::from_electrons(frame.path.clone(), pixels, frame.gain.clone());
        part.mask = frame.mask.slice(region).to_owned();
        part.origin_px = (frame.origin_px.0 + self.x0, frame.origin_px.1 + self.y0);
        part.full_size_px = frame.full_size_px;
        // what must not count as sky: trails, and anything significant with a margin of three pixels
        let kernel = Kernel::gaussian(3.0);
        let threshold = (NOT_SKY_SIGMA * self.rms_e * kernel.noise_factor()) as f32;
        let smooth = smooth_image(&self.net, &kernel);
        let light_limit = 0.1 * self.rms_e as f32;
        let objects =
            Array2::from_shape_fn((ny, nx), |at| smooth[at] > threshold || self.trails.light[at] > light_limit);
        Cleaned { part, not_sky: grown(&objects, 3) }
    }

    /// The flux: over the level along the trails, and over an annulus where there are none.
    pub fn flux(
        &self,
        frame: &Frame<Electrons>,
        background: &Background,
        at: (f64, f64),
        shape: Shape,
        s: &TargetSettings,
    ) -> Flux {
        let cleaned = self.cleaned(frame);
        self.flux_along_trails(&cleaned.part, at, shape, s)
            .unwrap_or_else(|| self.flux_over_annulus(&cleaned, background, at, shape, s))
    }

    /// The flux over an annulus, which grows until it has enough sky.
    fn flux_over_annulus(
        &self,
        cleaned: &Cleaned,
        background: &Background,
        at: (f64, f64),
        shape: Shape,
        s: &TargetSettings,
    ) -> Flux {
        let (inner, outer) = annulus(shape, s);
        let width = outer - inner;
        let (ox, oy) = cleaned.part.origin_px;
        let not_sky = |i: usize, j: usize| cleaned.not_sky[[j - oy, i - ox]];
        let mut outer = outer;
        let mut sky = annulus_sky(&cleaned.part, background, at, (inner, outer), s.clip_sigma, not_sky);
        for _ in 0..3 {
            if sky.n >= 200 {
                break;
            }
            outer += width;
            sky = annulus_sky(&cleaned.part, background, at, (inner, outer), s.clip_sigma, not_sky);
        }
        let mut trail_light = 0f64;
        let light = |i: usize, j: usize| f64::from(self.trails.light[[j - oy, i - ox]]).max(0.0);
        let mut flux = flux_over_sky(&cleaned.part, at, shape, (inner, outer), &sky, light);
        for_each_pixel(&shape, at.0, at.1, Bounds::of(&cleaned.part), |i, j, _| {
            trail_light = trail_light.max(light(i, j))
        });
        if trail_light > TRAIL_LIGHT * self.rms_e {
            flux.flags.set(Flags::TRAIL);
        }
        flux
    }

    /// The flux over the level beside it along the trails; `None` without trails or without room beside it.
    ///
    /// σ² = max(F, 0) + max(Σ f (S + P + RN²) + σ_P² + σ_end², σ_empty²): P the light above the sky S along each line, σ_P² the
    /// error of its mean, σ_end what trails that end under the target may add, σ_empty the robust scatter about 0 of apertures of the same shape where the target is not.
    fn flux_along_trails(
        &self,
        part: &Frame<Electrons>,
        at: (f64, f64),
        shape: Shape,
        s: &TargetSettings,
    ) -> Option<Flux> {
        let strips = self.trails.strips.as_ref()?;
        let (ox, oy) = (part.origin_px.0 as f64, part.origin_px.1 as f64);
        let local = (at.0 - ox, at.1 - oy);
        let own = strips.hole(local, shape.grown(s.fwhm_px));
        let under = Under::of(strips, own, &[own])?;
        // the frame less what is beside the target
        let mut pixels = part.pixels.clone();
        let mut peak_light = 0f64;
        let mut mean = (0.0, 0.0);
        for_each_pixel(&shape, local.0, local.1, whole(self.net.dim()), |i, j, fraction| {
            let level = under.at(strips.turned.uv(i as f64, j as f64).1);
            peak_light = peak_light.max(level);
            mean = (mean.0 + fraction * level, mean.1 + fraction);
            pixels[[j, i]] = (f64::from(self.trails.pixels[[j, i]]) + self.trails.sky_e - level) as f32;
        });
        let mut net = Frame::from_electrons(part.path.clone(), pixels, part.gain.clone());
        net.mask = part.mask.clone();
        net.origin_px = part.origin_px;
        net.full_size_px = part.full_size_px;
        let sky = Sky { level_e: self.trails.sky_e, err_e: 0.0, rms_e: 0.0, n: 0, flags: Flags::default() };
        let extra = |i: usize, j: usize| {
            let v = strips.turned.uv(i as f64 - ox, j as f64 - oy).1;
            under.at(v).max(-self.trails.sky_e)
        };
        let mut flux = flux_over_sky(&net, at, shape, annulus(shape, s), &sky, extra);
        let own_noise = flux.flux_e.max(0.0);
        let model = under.variance(strips, &strips.hole(local, shape), self.rms_e);
        let ends = under.variance_of_ends(strips, &strips.hole(local, shape), s.fwhm_px);
        let photons = flux.flux_err_e.powi(2) - own_noise + model + ends;
        let empty = self.empty_scatter(strips, local, shape, own).unwrap_or(0.0);
        flux.flux_err_e = (own_noise + photons.max(empty * empty)).sqrt();
        flux.snr = flux.flux_e / flux.flux_err_e;
        flux.sky_e_px = self.trails.sky_e + mean.0 / mean.1;
        flux.sky_err_e_px = model.sqrt() / flux.area_px;
        flux.sky_rms_e = self.rms_e;
        flux.n_sky = under.n as usize;
        if peak_light > TRAIL_LIGHT * self.rms_e {
            flux.flags.set(Flags::TRAIL);
        }
        Some(flux)
    }

    /// 1.4826 median |F| of empty apertures around the target, each over its own level along the trails.
    fn empty_scatter(&self, strips: &Strips, at: (f64, f64), shape: Shape, target: Hole) -> Option<f64> {
        let (ny, nx) = self.net.dim();
        let r = shape.bounding_radius_px();
        let step = (0.7 * r).max(3.0);
        let inside = |x: f64, y: f64| x >= r && y >= r && x <= nx as f64 - 1.0 - r && y <= ny as f64 - 1.0 - r;
        let reach = ((nx.max(ny) as f64) / step).ceil().min(12.0) as i32;
        let mut places: Vec<(f64, f64, f64)> = (-reach..=reach)
            .flat_map(|k| (-reach..=reach).map(move |l| (f64::from(k) * step, f64::from(l) * step)))
            .map(|(dx, dy)| (dx.hypot(dy), at.0 + dx, at.1 + dy))
            .filter(|&(d, x, y)| d > r + target.a && inside(x, y))
            .collect();
        places.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.2.total_cmp(&q.2)).then(p.1.total_cmp(&q.1)));
        let mut fluxes: Vec<f64> = Vec::new();
        for (_, x, y) in places {
            if fluxes.len() >= MAX_EMPTY {
                break;
            }
            let hole = strips.hole((x, y), shape);
            let Some(under) = Under::of(strips, hole, &[hole, target]) else { continue };
            let mut sum = 0.0;
            for_each_pixel(&shape, x, y, whole((ny, nx)), |i, j, fraction| {
                let v = strips.turned.uv(i as f64, j as f64).1;
                sum += fraction * (f64::from(self.trails.pixels[[j, i]]) - under.at(v));
            });
            if sum.is_finite() {
                fluxes.push(sum.abs());
            }
        }
        (fluxes.len() >= MIN_EMPTY).then(|| stats::median(&mut fluxes)).flatten().map(|m| stats::SIGMA_PER_MAD * m)
    }

    /// The forced flux at the expected place and what could have been seen there.
    pub fn limit(&self, frame: &Frame<Electrons>, background: &Background, s: &TargetSettings) -> TargetFound {
        let shape = Shape::Circle { r_px: s.limit_r_px };
        let flux = self.flux(frame, background, (s.x_px, s.y_px), shape, s);
        // the error without the flux's own Poisson noise: that of an empty aperture
        let empty = (flux.flux_err_e.powi(2) - flux.flux_e.max(0.0)).sqrt();
        TargetFound::NotDetected { limit_e: s.detect_sigma * empty, flux, x_px: s.x_px, y_px: s.y_px }
    }
}

/// The cutout with the trails' light taken off, and what of it is not sky.
pub(crate) struct Cleaned {
    part: Frame<Electrons>,
    not_sky: Array2<bool>,
}

/// The annulus of an aperture: the gap and the width of the limit's.
fn annulus(shape: Shape, s: &TargetSettings) -> (f64, f64) {
    let (gap, width) = ((s.sky_in_px - s.limit_r_px).max(1.0), (s.sky_out_px - s.sky_in_px).max(2.0));
    let inner = shape.bounding_radius_px() + gap;
    (inner, inner + width)
}

/// All pixels of an image.
fn whole((ny, nx): (usize, usize)) -> Bounds {
    Bounds { x0: 0, x1: nx, y0: 0, y1: ny }
}

/// The levels of the lines under an aperture.
struct Under {
    first: usize,
    v0: f64,
    levels: Vec<Level>,
    /// Pixels they rest on.
    n: f64,
}

impl Under {
    fn of(strips: &Strips, over: Hole, holes: &[Hole]) -> Option<Self> {
        let reach = over.a.max(over.b);
        let lines = strips.lines((over.v - reach, over.v + reach));
        let mut levels = Vec::with_capacity(lines.len());
        for q in lines.clone() {
            let u = over.chord(strips.v_of(q)).unwrap_or((over.u, over.u));
            levels.push(strips.beside(q, u, holes)?);
        }
        if levels.len() < 4 {
            return None;
        }
        let n = levels.iter().map(|l| l.n).sum();
        Some(Self { first: lines.start, v0: strips.v_of(lines.start), levels, n })
    }

    /// The level at v, by the cubic through four lines.
    fn at(&self, v: f64) -> f64 {
        let x = (v - self.v0).clamp(1.0, self.levels.len() as f64 - 2.001);
        let k = x.floor() as usize;
        let of = |q: usize| self.levels[q].mean as f32;
        f64::from(catmull_rom([of(k - 1), of(k), of(k + 1), of(k + 2)], (x - k as f64) as f32))
    }

    /// Variance of the sum of the levels under an aperture.
    fn variance(&self, strips: &Strips, aperture: &Hole, noise_e: f64) -> f64 {
        let of = |(k, l): (usize, &Level)| {
            let (from, to) = aperture.chord(strips.v_of(self.first + k)).unwrap_or((0.0, 0.0));
            (to - from).powi(2) * (noise_e * noise_e + l.mean.max(0.0)) / l.n
        };
        self.levels.iter().enumerate().map(of).sum()
    }

    /// Where the two sides of a line differ by D a trail ends under the aperture, anywhere along its chord c: a level
    /// between both is wrong by D c/√12. Lines are taken together over the width of a trail; noise is taken off twice.
    fn variance_of_ends(&self, strips: &Strips, aperture: &Hole, fwhm_px: f64) -> f64 {
        let width = (1.5 * fwhm_px).round().max(2.0) as usize;
        let of_trail = |(g, lines): (usize, &[Level])| {
            let (mut step, mut noise) = (0.0, 0.0);
            for (k, line) in lines.iter().enumerate() {
                let (from, to) = aperture.chord(strips.v_of(self.first + g * width + k)).unwrap_or((0.0, 0.0));
                step += (to - from) * line.step;
                noise += (to - from).powi(2) * line.step_variance;
            }
            (step * step - 2.0 * noise).max(0.0) / 12.0
        };
        self.levels.chunks(width).enumerate().map(of_trail).sum()
    }
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
