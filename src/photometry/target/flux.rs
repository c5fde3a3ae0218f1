//! The flux of the target and of the place where it was not: over an annulus, or over the level along the trails.
//!
//! Electrons and full-frame pixels. Sky means are of unclipped counts in small blocks: over a target of 30 000 pixels a
//! hundredth of an electron matters, and a median of skewed counts is wrong by more. It does not cover where the target
//! is.

use ndarray::Array2;

use super::placed::Placed;
use super::settings::TargetSettings;
use crate::base::stats;
use crate::frames::{Electrons, Frame, mask};
use crate::photometry::Flags;
use crate::photometry::annulus::Sky;
use crate::photometry::aperture::{Bounds, Shape, for_each_pixel};
use crate::photometry::background::Background;
use crate::photometry::clip::{CLIP_SIGMA, HIT_SIGMA};
use crate::photometry::flux::{Flux, flux_over_sky};
use crate::photometry::target::cells::grown;
use crate::photometry::target::cutout::Cutout;
use crate::photometry::target::sky::MeanOf;
use crate::photometry::trails::level::TrailLevel;
use crate::photometry::trails::model::TrailBackground;

/// Cells this significant at a star's scale are not sky \[σ\].
const NOT_SKY_SIGMA: f64 = 4.0;
/// Cells with this much light of trails are not sky \[σ of a sky pixel\].
const NOT_SKY_LIGHT: f64 = 0.1;
/// An annulus of which objects take more than this share is crowded.
const CROWDED_SHARE: f64 = 0.02;
/// Fewer sky pixels than this, and the annulus is widened.
const FEW_SKY_PX: usize = 200;
/// A trail is flagged, and a line that was taken for one counts as crossing, where its light is above this \[σ of a sky pixel\].
pub(crate) const TRAIL_LIGHT: f64 = 0.3;
/// The annulus grows until its area is this many times that of the aperture.
const SKY_AREA: f64 = 3.0;
/// Side of the blocks an annulus is averaged in \[px\].
const SKY_BLOCK_PX: usize = 12;
/// Fewest sky pixels; below, the mesh is used.
const MIN_SKY_PX: usize = 16;
/// Share of the trails' light in the aperture that their profile may get wrong: it is interpolated twice, and turned by the
/// error of the trails' direction, which moves the light of a bright one at the edge of the aperture.
const PROFILE_ERR: f64 = 0.01;
/// Most empty apertures.
const MAX_EMPTY: usize = 40;
/// √n times the relative error of a σ from a median absolute deviation.
const MAD_ERR: f64 = 1.17;
/// Fewest empty apertures whose scatter is used.
const MIN_EMPTY: usize = 8;

/// A flux and the level along the trails it was measured over, if there are trails.
pub(crate) struct Measured {
    pub flux: Flux,
    pub trail_level: Option<TrailLevel>,
    /// The aperture's pixels less sky and trails, for whoever looks inside: cutout columns and rows.
    pub net: Array2<f32>,
    /// Local column and row of the first pixel of `net`.
    pub net_origin: (usize, usize),
}

impl Cutout {
    /// The flux: over the level along the trails, or over an annulus where there are no trails or no room next to them.
    ///
    /// `objects` are the cells that are no sky ([`Self::objects`]).
    pub fn flux(
        &self,
        frame: &Frame<Electrons>,
        background: &Background,
        at: &Placed,
        objects: &Array2<bool>,
        s: &TargetSettings,
    ) -> Measured {
        let trail_level =
            self.trail_background.as_ref().and_then(|trail_background| self.trail_level(trail_background, at));
        match trail_level {
            Some(trail_level) => self.flux_along_trails(frame, at, trail_level, s),
            None => self.flux_over_annulus(frame, background, at, objects, s),
        }
    }

    /// The cells that are no sky: trails, and what stands out in `snr1`, the significance at the scale of a star.
    pub fn objects(&self, snr1: &Array2<f32>) -> Array2<bool> {
        let light_limit = NOT_SKY_LIGHT * self.rms_e;
        let objects = Array2::from_shape_fn(snr1.dim(), |c| {
            f64::from(snr1[c]) > NOT_SKY_SIGMA || f64::from(self.light[c]) > light_limit
        });
        grown(&objects, (0.5 * self.fwhm_cells()).ceil() as usize)
    }

    /// The levels of the lines of cells under an aperture.
    fn trail_level(&self, trail_background: &TrailBackground, at: &Placed) -> Option<TrailLevel> {
        let cells = self.in_cells(at);
        let own = trail_background.exclusion((cells.x, cells.y), cells.shape.grown(self.fwhm_cells()));
        TrailLevel::of(trail_background, own, &[own])
    }

    /// The part of the frame around an aperture, less `level(i, j)` per pixel of the cutout, over a sky of `sky_e`.
    fn around(
        &self,
        frame: &Frame<Electrons>,
        at: &Placed,
        sky_e: f64,
        level: impl Fn(usize, usize) -> f64,
    ) -> Frame<Electrons> {
        let r = at.shape.bounding_radius_px() + 2.0;
        let (ny, nx) = self.pixels.dim();
        let range = |c: f64, n: usize| {
            let lo = (c - r).floor().clamp(0.0, n as f64 - 1.0) as usize;
            let hi = ((c + r).ceil().clamp(0.0, n as f64 - 1.0) as usize + 1).max(lo + 1);
            lo..hi
        };
        let (columns, rows) = (range(at.x, nx), range(at.y, ny));
        let part = ndarray::s![rows.clone(), columns.clone()];
        let mut pixels = self.pixels.slice(part).to_owned();
        for ((j, i), v) in pixels.indexed_iter_mut() {
            *v = (f64::from(*v) - level(i + columns.start, j + rows.start) + sky_e) as f32;
        }
        let mut net = Frame::from_electrons(frame.path.clone(), pixels, frame.gain.clone());
        let (x, y) = (self.x0 + columns.start, self.y0 + rows.start);
        net.mask = frame.mask.slice(ndarray::s![y..y + rows.len(), x..x + columns.len()]).to_owned();
        net.origin_px = (frame.origin_px.0 + x, frame.origin_px.1 + y);
        net.full_size_px = frame.full_size_px;
        net
    }

    /// The flux over an annulus around the aperture, wide enough for its sky to be known better than the flux.
    ///
    /// `σ² = max(F, 0) + A (S + RN²) + A² (σ_S² + σ_Q²)`: σ_S the error of the mean of the annulus, σ_Q that of the
    /// difference of the sky's surface between annulus and aperture.
    fn flux_over_annulus(
        &self,
        frame: &Frame<Electrons>,
        background: &Background,
        at: &Placed,
        objects: &Array2<bool>,
        s: &TargetSettings,
    ) -> Measured {
        let (gap, width) = ((s.sky_in_px - s.limit_r_px).max(1.0), (s.sky_out_px - s.sky_in_px).max(2.0));
        let inner = at.shape.bounding_radius_px() + gap;
        let wanted = SKY_AREA * at.shape.area_px() / std::f64::consts::PI;
        let mut outer = (inner + width).max((inner * inner + wanted).sqrt());
        let mut ring = self.ring(frame, at, (inner, outer), objects);
        for _ in 0..3 {
            if ring.n >= FEW_SKY_PX {
                break;
            }
            outer += width;
            ring = self.ring(frame, at, (inner, outer), objects);
        }
        let level_e = self.sky.level(at.x, at.y);
        let mut flags = ring.flags;
        let (offset, err2, n) = if ring.n >= MIN_SKY_PX {
            let mut own = MeanOf::default();
            for_each_pixel(&at.shape, at.x, at.y, self.bounds(), |i, j, f| {
                self.sky.add(&mut own, i as f64, j as f64, f)
            });
            (ring.offset, ring.variance + self.sky.variance_between(&own, &ring.mean_of), ring.n)
        } else {
            flags.set(Flags::NO_ANNULUS);
            let (ox, oy) = self.origin(frame);
            (0.0, background.level_err(at.x + ox, at.y + oy).powi(2), 0)
        };
        let sky = Sky { level_e: level_e + offset, err_e: err2.sqrt(), rms_e: self.sky.rms(at.x, at.y), n, flags };
        let light = |i: usize, j: usize| self.light_at(i, j);
        let net = self.around(frame, at, sky.level_e, |i, j| self.sky.level(i as f64, j as f64) + offset + light(i, j));
        let (ox, oy) = (frame.origin_px.0 + self.x0, frame.origin_px.1 + self.y0);
        let mut brightest = 0f64;
        let extra = |i: usize, j: usize| {
            (light(i - ox, j - oy) + self.sky.level((i - ox) as f64, (j - oy) as f64) - level_e).max(-sky.level_e)
        };
        let place = (at.x + ox as f64, at.y + oy as f64);
        let mut flux = flux_over_sky(&net, place, at.shape, (inner, outer), &sky, extra);
        let mut of_trails = 0.0;
        for_each_pixel(&at.shape, at.x, at.y, self.bounds(), |i, j, f| {
            brightest = brightest.max(light(i, j));
            of_trails += f * light(i, j);
        });
        if self.segments.is_some() {
            flux.flux_err_e =
                (flux.flux_err_e.powi(2) + self.segments_variance(at) + (PROFILE_ERR * of_trails).powi(2)).sqrt();
            flux.snr = flux.flux_e / flux.flux_err_e;
        }
        if brightest > TRAIL_LIGHT * self.rms_e {
            flux.flags.set(Flags::TRAIL);
        }
        self.measured(net, flux, sky.level_e, None)
    }

    fn measured(&self, net: Frame<Electrons>, flux: Flux, sky_e: f64, trail_level: Option<TrailLevel>) -> Measured {
        let net_origin = (net.origin_px.0, net.origin_px.1);
        let mut pixels = net.pixels;
        pixels.mapv_inplace(|v| (f64::from(v) - sky_e) as f32);
        Measured { flux, trail_level, net: pixels, net_origin }
    }

    /// All pixels of the cutout.
    fn bounds(&self) -> Bounds {
        let (ny, nx) = self.pixels.dim();
        Bounds { x0: 0, x1: nx, y0: 0, y1: ny }
    }

    /// Light of the trails of known length at a place in cells \[e⁻ per pixel\].
    fn segments_at(&self, x: f64, y: f64) -> f64 {
        self.segments.as_ref().map_or(0.0, |segments| segments.at(x, y))
    }

    /// Variance of the light of the trails of known length in an aperture.
    fn segments_variance(&self, at: &Placed) -> f64 {
        let Some(segments) = &self.segments else { return 0.0 };
        let px = (self.net.bin * self.net.bin) as f64;
        segments.variance(&self.in_cells(at)) * px * px
    }

    /// Light of the trails of known length in an aperture, and its error \[e⁻\].
    pub fn segments_light(&self, at: &Placed) -> (f64, f64) {
        if self.segments.is_none() {
            return (0.0, 0.0);
        }
        let mut sum = 0.0;
        for_each_pixel(&at.shape, at.x, at.y, self.bounds(), |i, j, f| {
            sum += f * self.segments_at(self.net.in_cells(i as f64), self.net.in_cells(j as f64));
        });
        (sum, (PROFILE_ERR * sum).hypot(self.segments_variance(at).sqrt()))
    }

    /// Light of trails at a pixel of the cutout.
    pub fn light_at(&self, i: usize, j: usize) -> f64 {
        let (ny, nx) = self.light.dim();
        f64::from(self.light[[(j / self.net.bin).min(ny - 1), (i / self.net.bin).min(nx - 1)]]).max(0.0)
    }

    /// The mean of an annulus above the sky's surface; without objects, trails and hits.
    fn ring(&self, frame: &Frame<Electrons>, at: &Placed, (inner, outer): (f64, f64), objects: &Array2<bool>) -> Ring {
        let (my, mx) = objects.dim();
        let bounds = self.bounds();
        let across = (2.0 * outer) as usize / SKY_BLOCK_PX + 2;
        // sum, number and squares of each block
        let mut blocks = vec![[0f64; 2]; across * across];
        let mut mean_of = MeanOf::default();
        let (mut total, mut excluded, mut flags) = (0usize, 0usize, Flags::default());
        let hit = HIT_SIGMA * self.rms_e;
        let columns = |r: f64, c: f64, lo: usize, hi: usize| crate::photometry::aperture::cells(c - r, c + r, lo, hi);
        for j in columns(outer, at.y, bounds.y0, bounds.y1) {
            let dy = j as f64 - at.y;
            let reach = (outer * outer - dy * dy).max(0.0).sqrt();
            for i in columns(reach, at.x, bounds.x0, bounds.x1) {
                let dx = i as f64 - at.x;
                if dx * dx + dy * dy < inner * inner {
                    continue;
                }
                let v = f64::from(self.pixels[[j, i]]);
                if !v.is_finite() {
                    if frame.mask[[j + self.y0, i + self.x0]] & mask::CLIPPED != 0 {
                        flags.set(Flags::CLIP_EDGE);
                    }
                    continue;
                }
                total += 1;
                let above = v - self.sky.level(i as f64, j as f64);
                if objects[[(j / self.net.bin).min(my - 1), (i / self.net.bin).min(mx - 1)]] {
                    excluded += 1;
                } else if above.abs() <= hit {
                    let block = ((dy + outer) as usize / SKY_BLOCK_PX) * across + (dx + outer) as usize / SKY_BLOCK_PX;
                    blocks[block][0] += above;
                    blocks[block][1] += 1.0;
                    self.sky.add(&mut mean_of, i as f64, j as f64, 1.0);
                }
            }
        }
        if excluded as f64 > CROWDED_SHARE * total as f64 {
            flags.set(Flags::CROWDED_ANNULUS);
        }
        let whole: Vec<[f64; 2]> = blocks.into_iter().filter(|b| b[1] >= 8.0).collect();
        let mut means: Vec<f64> = whole.iter().map(|b| b[0] / b[1]).collect();
        let median = stats::median(&mut means).unwrap_or(0.0);
        let kept = whole.iter().filter(|b| (b[0] / b[1] - median).abs() <= CLIP_SIGMA * self.rms_e / b[1].sqrt());
        let (sum, n) = kept.fold((0.0, 0.0), |(s, n), b| (s + b[0], n + b[1]));
        let variance = self.sky.rms(at.x, at.y).powi(2) / f64::max(n, 1.0);
        Ring { offset: sum / f64::max(n, 1.0), variance, n: n as usize, mean_of, flags }
    }

    /// The flux over the level next to it along the trails.
    ///
    /// σ² = max(F, 0) + max(Σ f (S + P + RN²) + σ_P² + σ_end² + (0.01 Σ f P)², σ_empty²): P the light above the sky S
    /// along each line, σ_P² the error of its mean, σ_end what trails that end under the target may add, σ_empty the
    /// robust scatter about 0 of apertures of the same shape where the target is not, less its own error.
    fn flux_along_trails(
        &self,
        frame: &Frame<Electrons>,
        at: &Placed,
        trail_level: TrailLevel,
        s: &TargetSettings,
    ) -> Measured {
        let Some(trail_background) = self.trail_background.as_ref() else {
            return Measured { flux: nothing(at), trail_level: None, net: Array2::zeros((0, 0)), net_origin: (0, 0) };
        };
        let level = |i: usize, j: usize| {
            let (x, y) = (self.net.in_cells(i as f64), self.net.in_cells(j as f64));
            trail_level.at(trail_background.turned.uv(x, y).1) + self.segments_at(x, y)
        };
        let level_e = self.sky.level(at.x, at.y);
        let net = self.around(frame, at, level_e, |i, j| self.sky.level(i as f64, j as f64) + level(i, j));
        let (ox, oy) = (frame.origin_px.0 + self.x0, frame.origin_px.1 + self.y0);
        let rms_e = self.sky.rms(at.x, at.y);
        let sky = Sky { level_e, err_e: 0.0, rms_e: 0.0, n: 0, flags: Flags::default() };
        let extra = |i: usize, j: usize| {
            (level(i - ox, j - oy) + self.sky.level((i - ox) as f64, (j - oy) as f64) - level_e).max(-level_e)
        };
        let (gap, width) = ((s.sky_in_px - s.limit_r_px).max(1.0), (s.sky_out_px - s.sky_in_px).max(2.0));
        let inner = at.shape.bounding_radius_px() + gap;
        let place = (at.x + ox as f64, at.y + oy as f64);
        let mut flux = flux_over_sky(&net, place, at.shape, (inner, inner + width), &sky, extra);
        let cells = self.in_cells(at);
        let exclusion = trail_background.exclusion((cells.x, cells.y), cells.shape);
        let px = (self.net.bin * self.net.bin) as f64;
        let own_noise = flux.flux_e.max(0.0);
        let model = trail_level.variance(trail_background, &exclusion) * px * px;
        let ends = trail_level.variance_of_ends(trail_background, &exclusion, self.fwhm_cells()) * px * px;
        let (mut sum, mut area, mut brightest) = (0.0, 0.0, 0f64);
        for_each_pixel(&at.shape, at.x, at.y, self.bounds(), |i, j, f| {
            let l = level(i, j);
            brightest = brightest.max(l);
            sum += f * l;
            area += f;
        });
        let profile = (PROFILE_ERR * sum).powi(2);
        let photons = flux.flux_err_e.powi(2) - own_noise + model + ends + profile + self.segments_variance(at);
        let empty = self.empty_scatter(trail_background, at).unwrap_or(0.0);
        flux.flux_err_e = (own_noise + photons.max(empty * empty)).sqrt();
        flux.snr = flux.flux_e / flux.flux_err_e;
        flux.sky_e_px = level_e + sum / f64::max(area, 1.0);
        flux.sky_rms_e = rms_e;
        flux.sky_err_e_px = model.sqrt() / flux.area_px;
        flux.n_sky = (trail_level.n * px) as usize;
        if brightest > TRAIL_LIGHT * self.rms_e {
            flux.flags.set(Flags::TRAIL);
        }
        self.measured(net, flux, level_e, Some(trail_level))
    }

    /// 1.4826 median |F| less its standard error, of empty apertures around the target, each over its own level along the trails \[e⁻\].
    fn empty_scatter(&self, trail_background: &TrailBackground, at: &Placed) -> Option<f64> {
        let (ny, nx) = self.net.mean.dim();
        let cells = self.in_cells(at);
        let target = trail_background.exclusion((cells.x, cells.y), cells.shape.grown(self.fwhm_cells()));
        let r = cells.shape.bounding_radius_px();
        let step = (0.9 * r).max(3.0);
        let inside = |x: f64, y: f64| x >= r && y >= r && x <= nx as f64 - 1.0 - r && y <= ny as f64 - 1.0 - r;
        let reach = ((nx.max(ny) as f64) / step).ceil().min(12.0) as i32;
        let mut places: Vec<(f64, f64, f64)> = (-reach..=reach)
            .flat_map(|k| (-reach..=reach).map(move |l| (f64::from(k) * step, f64::from(l) * step)))
            .map(|(dx, dy)| (dx.hypot(dy), cells.x + dx, cells.y + dy))
            .filter(|&(d, x, y)| d > r + target.a && inside(x, y))
            .collect();
        places.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.2.total_cmp(&q.2)).then(p.1.total_cmp(&q.1)));
        let mut fluxes: Vec<f64> = Vec::new();
        for (_, x, y) in places {
            if fluxes.len() >= MAX_EMPTY {
                break;
            }
            let exclusion = trail_background.exclusion((x, y), cells.shape);
            let Some(trail_level) = TrailLevel::of(trail_background, exclusion, &[exclusion, target]) else { continue };
            let mut sum = 0.0;
            let bounds = Bounds { x0: 0, x1: nx, y0: 0, y1: ny };
            for_each_pixel(&cells.shape, x, y, bounds, |i, j, fraction| {
                let v = trail_background.turned.uv(i as f64, j as f64).1;
                let segments = self.segments_at(i as f64, j as f64);
                sum += fraction * (f64::from(self.net.mean[[j, i]]) - segments - trail_level.at(v));
            });
            if sum.is_finite() {
                fluxes.push(sum.abs());
            }
        }
        let px = (self.net.bin * self.net.bin) as f64;
        (fluxes.len() >= MIN_EMPTY)
            .then(|| stats::median(&mut fluxes))
            .flatten()
            .map(|m| crate::base::constants::SIGMA_PER_MAD * m * px * (1.0 - MAD_ERR / (fluxes.len() as f64).sqrt()))
    }
}

/// The sky above the surface, from an annulus.
struct Ring {
    offset: f64,
    /// Error of the offset.
    variance: f64,
    n: usize,
    mean_of: MeanOf,
    flags: Flags,
}

/// No measurement at all.
fn nothing(at: &Placed) -> Flux {
    Flux {
        flux_e: f64::NAN,
        flux_err_e: f64::NAN,
        sky_e_px: f64::NAN,
        sky_err_e_px: f64::NAN,
        sky_rms_e: f64::NAN,
        area_px: 0.0,
        n_sky: 0,
        snr: f64::NAN,
        peak_e: f64::NAN,
        masked_frac: f64::NAN,
        shape: at.shape,
        sky_in_px: f64::NAN,
        sky_out_px: f64::NAN,
        flags: Flags::default(),
    }
}

/// The shape alone, for settings that need no place.
pub(crate) fn circle_at(x: f64, y: f64, r_px: f64) -> Placed {
    Placed { x, y, shape: Shape::Circle { r_px } }
}
