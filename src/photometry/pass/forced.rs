//! The flux of a point source at a given place of one frame, detected or not.
//!
//! Electrons; cells of the cutout. The star profile P and a constant sky b are fitted to the cells around the place,
//! x = F P + b, weights 1/σ², with the sky's surface and the trails subtracted, hits masked and neighbours excluded. It does
//! not cover a source that is larger than a star.

use ndarray::Array2;

use crate::frames::{Electrons, Frame, mask};
use crate::photometry::Flags;
use crate::photometry::growth::StarProfile;
use crate::photometry::target::cells::{grown, lines_in_quadrature};
use crate::photometry::target::cutout::Cutout;
use crate::photometry::target::flux::circle_at;
use crate::photometry::target::search::{OUTLINE_SIGMA, components};
use crate::photometry::target::settings::TargetSettings;

/// Radius of the cells that are fitted \[FWHM\]: the constant sky costs 5 % of the variance.
const REACH_FWHM: f64 = 4.0;
/// Within this distance of the place nothing is taken for a neighbour \[FWHM\].
const OWN_FWHM: f64 = 1.5;
/// Cells this significant at the scale of a star are neighbours \[σ\].
const NEIGHBOUR_SIGMA: f64 = 4.0;
/// Components near the place are searched for hits up to this size \[cells\].
const MOST_HIT_CELLS: usize = 2000;
/// Points along each side of a cell at which the profile is averaged.
const SUBCELLS: usize = 5;
/// Empty places around the target whose scatter checks the errors, at this distance \[FWHM\].
const EMPTY_FWHM: f64 = 8.0;
/// Number of those places.
const EMPTY_PLACES: usize = 12;
/// Share of ΣP² that must be seen: less, and the place is masked.
const LEAST_SEEN: f64 = 0.5;
/// A trail is flagged where its light at the place is above this \[σ of a sky pixel\], as in the apertures of targets.
const TRAIL_LIGHT: f64 = 0.3;

/// The flux at a place of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ForcedFlux {
    /// Electrons, negative or not.
    pub flux_e: f64,
    /// Its variance without the photons of the source itself \[e⁻²\].
    pub variance_e2: f64,
    /// What the photons of a source of one electron add to it.
    pub variance_per_e: f64,
    /// Trails, hits, crossing satellites, saturated or masked pixels near the place.
    pub flags: Flags,
    /// How far from the place the light is, along columns and rows, and the error of each \[px\]; `None` without light.
    pub offset_px: Option<(f64, f64, f64)>,
    /// Flux and variance at empty places around the target, the same in every frame; `None` where one is masked.
    pub empty: Vec<Option<(f64, f64)>>,
}

/// The flux of a point source at (`s.x_px`, `s.y_px`); `None` off the frame, or where most of it is masked.
///
/// Least squares for F and b: with S_p = ΣP/σ², S_pp, S_1, S_pd, S_d likewise and Δ = S_pp S_1 − S_p²,
/// F = (S_pd S_1 − S_p S_d)/Δ and Var F = S_1/Δ + F Σ w² P/a, w = (P S_1 − S_p)/(σ² Δ), a the pixels of a cell. `profile` is
/// that of the stars, a Gaussian without one; `jitter_px` the scatter of the target about the place per axis, by which the
/// profile is widened, so that the mean over many frames is the flux.
#[must_use]
pub fn forced_flux(
    frame: &Frame<Electrons>,
    s: &TargetSettings,
    profile: Option<&StarProfile>,
    jitter_px: f64,
) -> Option<ForcedFlux> {
    let mut cutout = Cutout::new(frame, s)?;
    let (ox, oy) = cutout.origin(frame);
    let place = circle_at(s.x_px - ox, s.y_px - oy, s.limit_r_px);
    cutout.exclude(&place);
    let fwhm = cutout.fwhm_cells();
    let at = (cutout.net.in_cells(place.x), cutout.net.in_cells(place.y));
    let hit = mask_hits(&mut cutout, at, fwhm);
    let layers = cutout.layers();
    let snr1 = layers.significance(fwhm, 1, None);
    let neighbours = grown(&snr1.mapv(|v| f64::from(v) > NEIGHBOUR_SIGMA), (0.5 * fwhm).ceil() as usize);
    let mut variance = layers.variance;
    if let Some(uncertainty) = &layers.uncertainty {
        let along = lines_in_quadrature(fwhm, 1.0);
        variance.zip_mut_with(uncertainty, |v, d| *v += along * d * d);
    }
    let bin = cutout.net.bin;
    let template = Template::new(profile, cutout.fwhm_px, jitter_px, bin, at);
    let cells = Cells { value: &layers.value, variance: &variance, neighbours: &neighbours, area: (bin * bin) as f64 };
    let fit = template.fit(&cells, (0, 0), OWN_FWHM * fwhm)?;
    let around = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / EMPTY_PLACES as f64;
        let offset = |c: f64| (EMPTY_FWHM * fwhm * c).round() as isize;
        template.fit(&cells, (offset(angle.cos()), offset(angle.sin())), 0.0)
    };
    let empty = (0..EMPTY_PLACES).map(|k| around(k).map(|f| (f.flux, f.variance))).collect();
    let mut flags = flags_near(frame, s);
    flags.set(cutout.crossed(&circle_at(place.x, place.y, cutout.fwhm_px), &snr1));
    if hit {
        flags.set(Flags::HIT);
    }
    let (i, j) = ((place.x.round().max(0.0)) as usize, (place.y.round().max(0.0)) as usize);
    if cutout.light_at(i, j) > TRAIL_LIGHT * cutout.rms_e {
        flags.set(Flags::TRAIL);
    }
    Some(ForcedFlux {
        flux_e: fit.flux,
        variance_e2: fit.variance,
        variance_per_e: fit.per_e,
        flags,
        offset_px: fit.offset.map(|(x, y, err)| (x * bin as f64, y * bin as f64, err * bin as f64)),
        empty,
    })
}

/// Masks the hits of what stands out within 2 FWHM of the place; whether there were any.
fn mask_hits(cutout: &mut Cutout, at: (f64, f64), fwhm: f64) -> bool {
    let snr = cutout.layers().significance(fwhm, 1, None);
    let near = |&(i, j): &(usize, usize)| (i as f64 - at.0).hypot(j as f64 - at.1) < 2.0 * fwhm;
    let mut any = cutout.hits.iter().any(|&(i, j)| {
        near(&((cutout.net.in_cells(i as f64).max(0.0)) as usize, (cutout.net.in_cells(j as f64).max(0.0)) as usize))
    });
    for cells in components(&snr, OUTLINE_SIGMA) {
        if cells.len() < MOST_HIT_CELLS && cells.iter().any(near) {
            any |= cutout.mask_hits(&cells, 1);
        }
    }
    any
}

/// Saturated and masked pixels within one FWHM of the place.
fn flags_near(frame: &Frame<Electrons>, s: &TargetSettings) -> Flags {
    let (ny, nx) = frame.mask.dim();
    let (x, y) = (s.x_px - frame.origin_px.0 as f64, s.y_px - frame.origin_px.1 as f64);
    let range = |c: f64, n: usize| {
        let edge = |v: f64| v.clamp(0.0, n as f64) as usize;
        edge((c - s.fwhm_px).ceil())..edge((c + s.fwhm_px).floor() + 1.0)
    };
    let mut flags = Flags::default();
    for j in range(y, ny) {
        for i in range(x, nx) {
            let bits = frame.mask[[j, i]];
            if bits & mask::SATURATED != 0 {
                flags.set(Flags::SATURATED);
            }
            if bits & mask::BAD != 0 {
                flags.set(Flags::MASKED);
            }
        }
    }
    flags
}

/// What is fitted, per cell: electrons per pixel and their variance.
struct Cells<'a> {
    value: &'a Array2<f32>,
    variance: &'a Array2<f32>,
    neighbours: &'a Array2<bool>,
    /// Pixels of a cell.
    area: f64,
}

/// A flux, its variance and what its photons add to it.
struct Fit {
    flux: f64,
    variance: f64,
    per_e: f64,
    /// Offset of the light from the place, and its error \[cells\].
    offset: Option<(f64, f64, f64)>,
}

/// The profile of a star on the cells around a place: shares of the light per pixel.
struct Template {
    share: Array2<f64>,
    /// Cell of its middle.
    at: (isize, isize),
    /// The place from there \[cells\].
    off: (f64, f64),
    reach: isize,
}

impl Template {
    fn new(profile: Option<&StarProfile>, fwhm_px: f64, jitter_px: f64, bin: usize, at: (f64, f64)) -> Self {
        let gaussian = StarProfile::moffat(f64::INFINITY);
        let profile = profile.unwrap_or(&gaussian);
        let wide_px = fwhm_px.hypot(crate::base::constants::FWHM_PER_SIGMA * jitter_px);
        let radial = profile.radial(wide_px);
        let bin = bin as f64;
        let reach = (REACH_FWHM * wide_px / bin).ceil() as isize;
        let middle = (at.0.round(), at.1.round());
        let off = (at.0 - middle.0, at.1 - middle.1);
        let side = (2 * reach + 1) as usize;
        let step = |k: usize| (k as f64 + 0.5) / SUBCELLS as f64 - 0.5;
        let share = Array2::from_shape_fn((side, side), |(j, i)| {
            let (dx, dy) = (i as f64 - reach as f64 - off.0, j as f64 - reach as f64 - off.1);
            let points = (0..SUBCELLS * SUBCELLS).map(|k| (dx + step(k % SUBCELLS), dy + step(k / SUBCELLS)));
            let sum: f64 = points.map(|(u, v)| radial.density(bin * u.hypot(v))).sum();
            sum / (SUBCELLS * SUBCELLS) as f64
        });
        Self { share, at: (middle.0 as isize, middle.1 as isize), off, reach }
    }

    /// The fit about the place moved by whole cells; neighbours nearer than `own` cells count.
    fn fit(&self, cells: &Cells, moved: (isize, isize), own: f64) -> Option<Fit> {
        let (ny, nx) = cells.value.dim();
        let radius2 = (self.reach * self.reach) as f64;
        let (mut all, mut seen) = (0.0, 0.0);
        let mut used: Vec<(f64, f64, f64)> = Vec::new();
        let mut slopes: Vec<(f64, f64)> = Vec::new();
        for ((j, i), p) in self.share.indexed_iter() {
            let (di, dj) = (i as isize - self.reach, j as isize - self.reach);
            let r2 = (di as f64 - self.off.0).powi(2) + (dj as f64 - self.off.1).powi(2);
            if r2 > radius2 {
                continue;
            }
            all += p * p;
            let (x, y) = (self.at.0 + moved.0 + di, self.at.1 + moved.1 + dj);
            if x < 0 || y < 0 || x as usize >= nx || y as usize >= ny {
                continue;
            }
            let cell = [y as usize, x as usize];
            let (value, variance) = (f64::from(cells.value[cell]), f64::from(cells.variance[cell]));
            if value.is_finite() && variance > 0.0 && (r2 < own * own || !cells.neighbours[cell]) {
                seen += p * p;
                used.push((*p, value, 1.0 / variance));
                slopes.push(self.slope(j, i));
            }
        }
        if seen < LEAST_SEEN * all {
            return None;
        }
        let [mut pp, mut p1, mut one, mut pd, mut d1] = [0.0; 5];
        for (p, d, w) in &used {
            pp += w * p * p;
            p1 += w * p;
            one += w;
            pd += w * p * d;
            d1 += w * d;
        }
        let delta = pp * one - p1 * p1;
        if !(delta > 1e-9 * pp * one) {
            return None;
        }
        let per_e = used.iter().map(|(p, _, w)| (w * (p * one - p1) / delta).powi(2) * p / cells.area).sum();
        let (flux, sky) = ((pd * one - p1 * d1) / delta, (d1 * pp - p1 * pd) / delta);
        // one Gauss-Newton step of the place: the slopes of a round profile are orthogonal to it and to each other
        let along = |of: fn(&(f64, f64)) -> f64| {
            let terms =
                used.iter().zip(&slopes).map(|((p, d, w), s)| (w * of(s) * (d - flux * p - sky), w * of(s).powi(2)));
            terms.fold((0.0, 0.0), |(r, n), (a, b)| (r + a, n + b))
        };
        let ((rx, nx2), (ry, ny2)) = (along(|s| s.0), along(|s| s.1));
        let offset = (flux > 0.0 && nx2 > 0.0 && ny2 > 0.0)
            .then(|| (-rx / (nx2 * flux), -ry / (ny2 * flux), 1.0 / (flux * (0.5 * (nx2 + ny2)).sqrt())));
        Some(Fit { flux, variance: one / delta, per_e, offset })
    }

    /// Slope of the profile along columns and rows at a cell.
    fn slope(&self, j: usize, i: usize) -> (f64, f64) {
        let side = self.share.ncols();
        let at = |j: usize, i: usize| self.share[[j.min(side - 1), i.min(side - 1)]];
        (0.5 * (at(j, i + 1) - at(j, i.saturating_sub(1))), 0.5 * (at(j + 1, i) - at(j.saturating_sub(1), i)))
    }
}
