//! The part of the frame where the target can be: its sky, its trails, and what is left.
//!
//! Electrons. Pixels of the cutout, and cells of it ([`Cells`]) for everything but fluxes. Two passes: once with nothing
//! known, again with the target excluded from sky and trails. It does not cover which object is the target.

use std::ops::Range;

use super::placed::Placed;
use super::placed::scaled;
use ndarray::Array2;

use super::settings::TargetSettings;
use crate::frames::{Electrons, Frame, mask};
use crate::photometry::Flags;
use crate::photometry::aperture::{Bounds, cells};
use crate::photometry::target::blocks::{Blocks, blocks};
use crate::photometry::target::bumps::{Bumps, FEWEST_BLOCKS, blocks_of};
use crate::photometry::target::cells::{Cells, Layers, SCALES, WIDE_SCALE, grown, row_of};
use crate::photometry::target::cosmic_rays::{PIXEL_SIGMA, Patch, hits, margin_px};
use crate::photometry::target::psf::Psf;
use crate::photometry::target::sharpness::{Verdict, judge};
use crate::photometry::target::sky::Surface;
use crate::photometry::trails::crossing::Crossing;
use crate::photometry::trails::known::{KnownDirection, line_through};
use crate::photometry::trails::model::TrailBackground;
use crate::photometry::trails::search::faint_direction;
use crate::photometry::trails::segments::Segments;

/// Additional significance required of a line at another angle than the known one \[σ\].
const ANOTHER_ANGLE_SIGMA: f64 = 0.5;
/// Share of the change of the model over a block that it may get wrong: where a trail ends.
const END_ERR: f32 = 0.5;
/// Most pixels on a side of a candidate that are searched for cosmic-ray hits.
const PATCH_PX: usize = 72;
/// Blocks of the sky's surface \[FWHM\].
const BLOCK_FWHM: f64 = 1.6;

/// The part of the frame where the target can be.
pub(crate) struct Cutout {
    /// Local columns and rows of the frame.
    pub x0: usize,
    pub y0: usize,
    /// Electrons; NaN where a pixel is bad or clipped.
    pub pixels: Array2<f32>,
    blocks: Blocks,
    pub sky: Surface,
    /// What the sky has besides a quadratic.
    bumps: Option<Bumps>,
    /// Pixels sharper than a star.
    pub hits: Vec<(usize, usize)>,
    /// Pixels that do not count: those, and the hits of candidates.
    masked: Array2<bool>,
    /// The latter: nothing is left of them to look at.
    tested: Array2<bool>,
    /// Columns and rows in which no hit was found.
    clean: Vec<(Range<usize>, Range<usize>)>,
    /// The pixels less the sky, in cells.
    pub net: Cells,
    /// Scatter of a sky pixel in the middle \[e⁻\].
    pub rms_e: f64,
    pub fwhm_px: f64,
    /// That of the stars with which hits are compared \[px\].
    pub hits_fwhm_px: f64,
    pub psf: Psf,
    /// Means along the trails, if there are any, in cells.
    pub trail_background: Option<TrailBackground>,
    /// Trails of known length, one by one; `trail_background` is of what they leave.
    pub(super) segments: Option<Segments>,
    /// Light of the trails \[e⁻ per pixel\], in cells.
    pub light: Array2<f32>,
    /// By how much it changes over a few cells: where trails end.
    pub(super) unsure: Array2<f32>,
    /// Share of it that is not the same all along a trail.
    pub(super) scintillation: f64,
    /// Direction of the trails, where it is known beforehand.
    pub known: Option<KnownDirection>,
    /// Their length \[px\], where it is known.
    pub(super) trail_length_px: Option<f64>,
    /// Largest size of the target \[cells\], where that is known.
    pub(super) largest: Option<f64>,
    /// Where across the trails a faint one along that direction goes through the target [cells].
    pub trail_v: Option<f64>,
    /// What candidates were that were no target: [`Flags::BLOOMING`].
    pub artefacts: Flags,
    /// Lines that cross it, masked.
    pub lines: Vec<Crossing>,
    /// Whether each side (left, right, bottom, top) is the frame's own edge.
    pub at_edge: [bool; 4],
    /// Cells in which nothing is part of the target, where that is known.
    pub beyond: Option<Array2<bool>>,
}

impl Cutout {
    /// The cutout around the expected place; `None` if it is off the frame.
    pub fn new(frame: &Frame<Electrons>, s: &TargetSettings) -> Option<Self> {
        let bounds = Bounds::of(frame);
        let reach = s.reach_px();
        let columns = cells(s.x_px - reach, s.x_px + reach, bounds.x0, bounds.x1);
        let rows = cells(s.y_px - reach, s.y_px + reach, bounds.y0, bounds.y1);
        if columns.len() < 8 || rows.len() < 8 || s.fwhm_px.is_nan() || s.fwhm_px <= 0.0 {
            return None;
        }
        let (x0, y0) = (columns.start - bounds.x0, rows.start - bounds.y0);
        let part = ndarray::s![y0..y0 + rows.len(), x0..x0 + columns.len()];
        let mut pixels = frame.pixels.slice(part).to_owned();
        for (mut row, masks) in pixels.rows_mut().into_iter().zip(frame.mask.slice(part).rows()) {
            row.zip_mut_with(&masks, |v, m| {
                if m & (mask::BAD | mask::CLIPPED) != 0 || !v.is_finite() {
                    *v = f32::NAN;
                }
            });
        }
        let at_edge =
            [columns.start == bounds.x0, columns.end == bounds.x1, rows.start == bounds.y0, rows.end == bounds.y1];
        let blocks = blocks(&pixels, block_px(s.fwhm_px));
        let mut sky = Surface::fit(&blocks, pixels.dim(), None, |_| false);
        let bumps = Bumps::above(&blocks, |b| b.mean - sky.level(b.x, b.y));
        if bumps.is_some() {
            sky = Surface::fit(&blocks, pixels.dim(), bumps.as_ref(), |_| false);
        }
        let mut masked = Array2::from_elem(pixels.dim(), false);
        let hits = hits(&pixels, &sky, s.hits_fwhm_px());
        hits.iter().for_each(|&(i, j)| masked[[j, i]] = true);
        let net = cells_above(&pixels, &sky, &masked, s.fwhm_px);
        let none = Array2::zeros(net.mean.dim());
        let rms_e = noise_of(&sky, pixels.dim());
        let fwhm_px = s.fwhm_px;
        let cells_per_fwhm = fwhm_px / net.bin as f64;
        let (light, unsure) = (none.clone(), none);
        let mut cutout = Self {
            x0,
            y0,
            pixels,
            blocks,
            sky,
            bumps,
            hits,
            tested: Array2::from_elem(masked.dim(), false),
            clean: Vec::new(),
            masked,
            net,
            rms_e,
            fwhm_px,
            hits_fwhm_px: s.hits_fwhm_px(),
            psf: Psf::new(s.profile.as_ref(), fwhm_px),
            trail_background: None,
            segments: None,
            light,
            unsure,
            scintillation: 0.0,
            known: s.trail_direction,
            trail_length_px: s.trail_length_px,
            largest: s.largest_fwhm.map(|fwhm| fwhm * cells_per_fwhm),
            trail_v: None,
            artefacts: Flags::default(),
            lines: Vec::new(),
            at_edge,
            beyond: None,
        };
        if let Some(bound_px) = s.bound_px {
            let (x, y) = (s.x_px - columns.start as f64, s.y_px - rows.start as f64);
            cutout.beyond = Some(Array2::from_shape_fn(cutout.net.mean.dim(), |(j, i)| {
                (cutout.net.to_px(i as f64) - x).hypot(cutout.net.to_px(j as f64) - y) > bound_px
            }));
        }
        cutout.find_trails(None);
        cutout.straighten(None);
        cutout.model_trails(None);
        Some(cutout)
    }

    /// Sky and trails once more after pixels have been masked.
    pub fn renew(&mut self) {
        self.blocks = blocks(&self.pixels, block_px(self.fwhm_px));
        self.sky = Surface::fit(&self.blocks, self.pixels.dim(), self.bumps.as_ref(), |_| false);
        self.net = cells_above(&self.pixels, &self.sky, &self.masked, self.fwhm_px);
        self.rms_e = noise_of(&self.sky, self.pixels.dim());
        (self.light, self.unsure) = (Array2::zeros(self.net.mean.dim()), Array2::zeros(self.net.mean.dim()));
        (self.scintillation, self.trail_v) = (0.0, None);
        self.find_trails(None);
        self.straighten(None);
        self.model_trails(None);
    }

    /// How many of the [`SCALES`] of the search are used: where the sky has structure a wide source does not differ from it.
    pub fn scales(&self) -> usize {
        if self.bumps.is_some() { WIDE_SCALE } else { SCALES.len() }
    }

    /// Takes a candidate that is too smooth to be a target for sky, once; whether it was.
    pub fn follow_bumps(&mut self, candidate: &[(usize, usize)]) -> bool {
        let side = (block_px(self.fwhm_px) / self.net.bin).max(2);
        let part = blocks_of(candidate, side);
        if self.bumps.is_some() || part.len() < FEWEST_BLOCKS {
            return false;
        }
        self.bumps = Bumps::under(&blocks(&self.residual(), side), self.net.bin, &part);
        let is_sky = self.bumps.is_some();
        if is_sky {
            self.renew();
        }
        is_sky
    }

    /// Full-frame position of the cutout's first pixel.
    pub fn origin(&self, frame: &Frame<Electrons>) -> (f64, f64) {
        ((frame.origin_px.0 + self.x0) as f64, (frame.origin_px.1 + self.y0) as f64)
    }

    /// FWHM of a star \[cells\].
    pub fn fwhm_cells(&self) -> f64 {
        self.fwhm_px / self.net.bin as f64
    }

    /// Whether a pixel is a hit.
    pub fn is_masked(&self, i: usize, j: usize) -> bool {
        self.masked[[j, i]]
    }

    /// Scatter of a cell of sky \[e⁻ per pixel\].
    pub fn noise_of_cell(&self) -> f64 {
        self.rms_e / self.net.bin as f64
    }

    /// A place of pixels in cells.
    pub fn in_cells(&self, at: &Placed) -> Placed {
        Placed {
            x: self.net.in_cells(at.x),
            y: self.net.in_cells(at.y),
            shape: scaled(at.shape, 1.0 / self.net.bin as f64),
        }
    }

    /// Sky and trails once more with a known object kept out of both; where no trail stood out, a faint one is looked
    /// for with the object masked.
    pub fn exclude(&mut self, object: &Placed) {
        let clear = object.shape.grown(self.fwhm_px);
        self.sky = Surface::fit(&self.blocks, self.pixels.dim(), self.bumps.as_ref(), |b| {
            clear.contains(b.x - object.x, b.y - object.y)
        });
        self.net = cells_above(&self.pixels, &self.sky, &self.masked, self.fwhm_px);
        self.rms_e = noise_of(&self.sky, self.pixels.dim());
        let object = self.in_cells(&Placed { shape: clear, ..*object });
        if self.trail_background.is_some() || self.segments.is_some() {
            self.find_trails(Some(&object));
        }
        if self.trail_background.is_none() {
            let hidden = Array2::from_shape_fn(self.net.mean.dim(), |(j, i)| {
                object.shape.contains(i as f64 - object.x, j as f64 - object.y)
            });
            let target = (object.x, object.y, object.shape.bounding_radius_px());
            let scale = (self.noise_of_cell(), self.fwhm_cells());
            let left = self.without_segments();
            let through = self.known.and_then(|known| line_through(&left, &hidden, &object, scale, known));
            // a line at another angle than the known one must be the more certain
            let uncertainty = if self.known.is_some() { ANOTHER_ANGLE_SIGMA } else { 0.0 };
            let known = through.map(|line| line.0);
            let theta = known.or_else(|| faint_direction(&left, &hidden, target, scale, uncertainty));
            self.trail_v = through.map(|line| line.1);
            self.trail_background = theta.map(|theta| self.trail_background_along(theta));
        }
        self.straighten(Some(&object));
        self.model_trails(Some(&object));
    }

    /// Columns and rows about a candidate given in squares of `rebin` cells.
    fn about(&self, squares: &[(usize, usize)], rebin: usize) -> (Range<usize>, Range<usize>) {
        let (ny, nx) = self.pixels.dim();
        let (side, margin) = (rebin * self.net.bin, margin_px(self.fwhm_px));
        let span = |at: fn(&(usize, usize)) -> usize, n: usize| {
            let (low, high) = squares.iter().map(at).fold((n, 0), |(low, high), k| (low.min(k), high.max(k + 1)));
            let (low, high) = ((low * side).saturating_sub(margin), (high * side + margin).min(n));
            // the middle of what is larger
            let over = high.saturating_sub(low).saturating_sub(PATCH_PX);
            low.min(high) + over / 2..high - over.div_ceil(2)
        };
        (span(|s| s.0, nx), span(|s| s.1, ny))
    }

    /// The pixels of some columns and rows in which hits are searched; with the trails, which are as wide as stars.
    fn patch(&self, columns: &Range<usize>, rows: &Range<usize>) -> Patch {
        let dim = (rows.len(), columns.len());
        let above = Array2::from_shape_fn(dim, |(j, i)| {
            let (x, y) = (i + columns.start, j + rows.start);
            if self.tested[[y, x]] {
                f32::NAN
            } else {
                (f64::from(self.pixels[[y, x]]) - self.sky.level(x as f64, y as f64)) as f32
            }
        });
        let rms = self.sky.rms((columns.start + dim.1 / 2) as f64, (rows.start + dim.0 / 2) as f64);
        // next to a dead pixel the sky would look like a sharp line
        let above = above.mapv(|v| if f64::from(v) < -PIXEL_SIGMA * rms { f32::NAN } else { v });
        let variance = above.mapv(|v| (rms * rms) as f32 + v.max(0.0));
        Patch { above, variance }
    }

    /// Masks the hits in a candidate given in squares of `rebin` cells. Returns whether there were any.
    pub fn mask_hits(&mut self, squares: &[(usize, usize)], rebin: usize) -> bool {
        let (columns, rows) = self.about(squares, rebin);
        let holds = |all: &Range<usize>, part: &Range<usize>| all.start <= part.start && all.end >= part.end;
        let clean = self.clean.iter().any(|clean| holds(&clean.0, &columns) && holds(&clean.1, &rows));
        let mut patch = self.patch(&columns, &rows);
        let mut found = if clean { Vec::new() } else { patch.mask_hits(self.hits_fwhm_px) };
        let (x0, y0) = (columns.start, rows.start);
        if found.is_empty() {
            found = self.mask_sharp(&mut patch, (x0, y0), squares, rebin);
            if !clean {
                self.clean.push((columns, rows));
            }
        }
        for &(i, j) in &found {
            let (x, y) = (i + x0, j + y0);
            (self.masked[[y, x]], self.tested[[y, x]]) = (true, true);
            self.renew_cell(x / self.net.bin, y / self.net.bin);
        }
        !found.is_empty()
    }

    /// The pixels of a candidate that a hit fits better than a star, masked in its patch.
    fn mask_sharp(
        &self,
        patch: &mut Patch,
        (x0, y0): (usize, usize),
        squares: &[(usize, usize)],
        rebin: usize,
    ) -> Vec<(usize, usize)> {
        let (side, (ny, nx)) = (rebin * self.net.bin, patch.above.dim());
        let mut inside = Array2::from_elem((ny, nx), false);
        for &(i, j) in squares {
            for y in (j * side..(j + 1) * side).filter(|y| (y0..y0 + ny).contains(y)) {
                for x in (i * side..(i + 1) * side).filter(|x| (x0..x0 + nx).contains(x)) {
                    inside[[y - y0, x - x0]] = true;
                }
            }
        }
        let near_hit = grown(&inside, 2).indexed_iter().any(|((j, i), v)| *v && self.tested[[j + y0, i + x0]]);
        match judge(patch, &inside, self.hits_fwhm_px, near_hit) {
            Verdict::Sky => Vec::new(),
            Verdict::Hits(lines) => lines.into_iter().flat_map(|mut line| patch.mask_line(&mut line)).collect(),
            Verdict::AllHits => inside
                .indexed_iter()
                .filter(|((j, i), v)| **v && patch.above[[*j, *i]].is_finite())
                .map(|((j, i), _)| (i, j))
                .collect(),
        }
    }

    /// Marks a whole outline as the remnant of hits.
    pub fn mask_cells(&mut self, outline: &[(usize, usize)]) {
        let bin = self.net.bin;
        for &(i, j) in outline {
            self.masked.slice_mut(ndarray::s![j * bin..(j + 1) * bin, i * bin..(i + 1) * bin]).fill(true);
            self.tested.slice_mut(ndarray::s![j * bin..(j + 1) * bin, i * bin..(i + 1) * bin]).fill(true);
            self.renew_cell(i, j);
        }
    }

    /// The light of hits of candidates in an aperture \[e⁻\], and the pixels that hold it; `None` without any.
    pub fn hits_in(&self, at: &Placed) -> Option<(f64, usize)> {
        let r = at.shape.bounding_radius_px();
        let (ny, nx) = self.masked.dim();
        let (columns, rows) = (cells(at.x - r, at.x + r, 0, nx), cells(at.y - r, at.y + r, 0, ny));
        let inside = |i: usize, j: usize| at.shape.contains(i as f64 - at.x, j as f64 - at.y);
        let all = rows.into_iter().flat_map(|j| columns.clone().map(move |i| (i, j)));
        let light = all.filter(|&(i, j)| self.tested[[j, i]] && inside(i, j)).map(|(i, j)| {
            let above = f64::from(self.pixels[[j, i]]) - self.sky.level(i as f64, j as f64) - self.light_at(i, j);
            if above.is_finite() { above } else { 0.0 }
        });
        let (sum, n) = light.fold((0.0, 0), |(sum, n), v| (sum + v, n + 1));
        (n > 0).then_some((sum, n))
    }

    /// The mean of a cell once more, after pixels of it have been masked.
    fn renew_cell(&mut self, i: usize, j: usize) {
        let bin = self.net.bin;
        let (my, mx) = self.net.mean.dim();
        if i >= mx || j >= my {
            return;
        }
        let (mut sum, mut n) = (0.0, 0usize);
        for y in j * bin..(j + 1) * bin {
            for x in i * bin..(i + 1) * bin {
                let v = self.pixels[[y, x]];
                if v.is_finite() && !self.masked[[y, x]] {
                    sum += f64::from(v) - self.sky.level(x as f64, y as f64);
                    n += 1;
                }
            }
        }
        self.net.mean[[j, i]] = if 2 * n >= bin * bin { (sum / n as f64) as f32 } else { f32::NAN };
    }

    /// The cells without sky and trails; NaN where they are bad.
    pub fn residual(&self) -> Array2<f32> {
        let mut left = self.net.mean.clone();
        left -= &self.light;
        left
    }

    /// The inputs of the significance of the residual: its noise includes that of the light of the trails and its
    /// uncertainty.
    pub fn layers(&self) -> Layers {
        let area = (self.net.bin * self.net.bin) as f32;
        let (ny, nx) = self.light.dim();
        let scale = self.net.bin as f64;
        let mut variance = Array2::zeros((ny, nx));
        for (j, row) in variance.as_slice_mut().unwrap_or_default().chunks_exact_mut(nx.max(1)).enumerate() {
            // the noise of the sky follows the surface; smooth enough to be looked up every so often
            for (k, (part, light)) in row.chunks_mut(16).zip(row_of(&self.light, j).chunks(16)).enumerate() {
                let sky = self.sky.rms((16 * k) as f64 * scale, j as f64 * scale).powi(2) as f32;
                part.iter_mut().zip(light).for_each(|(v, l)| *v = (sky + l.max(0.0)) / area);
            }
        }
        let has_trails = self.trail_background.is_some() || self.segments.is_some();
        let uncertainty = has_trails.then(|| {
            let mut uncertainty = self.light.mapv(|t| self.scintillation as f32 * t.max(0.0));
            uncertainty.scaled_add(END_ERR, &self.unsure);
            uncertainty
        });
        Layers { value: self.residual(), variance, uncertainty }
    }
}

/// Side of the blocks of the sky's surface \[px\].
fn block_px(fwhm_px: f64) -> usize {
    ((BLOCK_FWHM * fwhm_px).round() as usize).clamp(8, 48)
}

/// Scatter of a sky pixel in the middle of a cutout \[e⁻\].
fn noise_of(sky: &Surface, (ny, nx): (usize, usize)) -> f64 {
    sky.rms(0.5 * nx as f64, 0.5 * ny as f64).max(1e-6)
}

/// The pixels above the sky, in cells; hits do not count.
fn cells_above(pixels: &Array2<f32>, sky: &Surface, masked: &Array2<bool>, fwhm_px: f64) -> Cells {
    Cells::of_lines(pixels.dim(), fwhm_px, |j, out| {
        sky.row(j, out);
        let row = row_of(pixels, j).iter().zip(row_of(masked, j));
        out.iter_mut().zip(row).for_each(|(o, (v, hit))| *o = if *hit { f32::NAN } else { v - *o });
    })
}
