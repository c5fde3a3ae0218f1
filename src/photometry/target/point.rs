//! The flux of a compact source under the weights of the point-spread function: at a place, or where it fits best.
//!
//! Electrons; pixels of the cutout. Least squares over the pixels within two FWHM. A point gives all of its light with the
//! least error there is; where the size is free, too, discs of up to 1 FWHM give it with an error 1.4 to 1.5 times as
//! large. It does not cover what is wider than that, which an outline measures.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
use ndarray::Array2;

use super::placed::Placed;
use super::psf::{Psf, Share, WIDE_FWHM, WIDE_REACH_FWHM};
use crate::frames::{Electrons, Frame};
use crate::photometry::aperture::{Shape, cells};
use crate::photometry::background::Background;
use crate::photometry::flux::Flux;
use crate::photometry::target::cutout::Cutout;
use crate::photometry::target::flux::{Measured, circle_at};
use crate::photometry::target::settings::TargetSettings;

/// Steps of the search for the best place.
const PLACE_STEPS: usize = 8;
/// It ends at a step below this \[FWHM\], and no step is longer than that.
const PLACE_STEP_FWHM: (f64, f64) = (0.002, 0.25);
/// The best place is no further from the first than this \[FWHM\].
const PLACE_REACH_FWHM: f64 = 0.75;
/// Share of the weight of a point that must be on good pixels.
const LEAST_WEIGHT: f64 = 0.5;
/// Share of the circle of a wide source that must be good pixels.
const LEAST_GOOD: f64 = 0.7;

/// A compact source, measured under the weights of the point-spread function.
pub(crate) struct PointFlux {
    /// The whole light of a point, and all else as in a circle of two FWHM.
    pub flux: Flux,
    /// Its error on empty sky \[e⁻\].
    pub empty_err_e: f64,
    /// Its variance per electron of its own \[e⁻\].
    pub photons: f64,
    /// The whole light of a disc of unknown size, and its error \[e⁻\].
    pub free_e: (f64, f64),
    /// What of that light is the disc of one FWHM, its error, and the covariance of both \[e⁻, e⁻²\]. In units of the light of a point it is
    /// the square of the diameter of the even disc that fits \[FWHM²\], negative where noise makes it narrower than a star.
    pub of_disc_e: (f64, f64, f64),
    /// The pixels less sky and trails, and what the light was measured over.
    pub measured: Measured,
}

/// A source of up to three FWHM, measured as the sum of three discs.
pub(crate) struct WideFlux {
    /// Its whole light and the error of that \[e⁻\].
    pub flux_e: (f64, f64),
    /// Mean square of the diameters, and its error \[FWHM²\].
    pub disc2: (f64, f64),
    /// The circle whose pixels carry weight.
    pub place: Placed,
    /// The sum of those pixels, with flags, sky and trail level.
    pub measured: Measured,
}

/// A circle of pixels over sky and trails.
struct Over {
    at: Placed,
    measured: Measured,
    /// Cutout column and row of the first pixel of `measured.net`.
    first: (usize, usize),
    /// Variance of empty apertures over that of their photons.
    excess: f64,
    /// Error of the sky \[e⁻ per pixel\]; 0 along trails.
    sky_err_e: f64,
    /// Light per pixel of a point that the annulus takes for sky, as a share of its whole light.
    taken: f64,
}

/// A pixel of the cutout under a source.
struct Pixel {
    share: Share,
    net_e: f64,
    variance: f64,
}

/// A source at its best place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BestPlace {
    pub x: f64,
    pub y: f64,
    /// Significance of a point there.
    pub snr: f64,
}

/// A step from a place to a better one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaceStep {
    /// Significance of a point at the place.
    pub snr: f64,
    /// How far from the place the light is, along columns and rows, and the error of each \[px\]; `None` without light.
    pub offset_px: Option<(f64, f64, f64)>,
}

impl Cutout {
    /// The flux of a compact source at a place of the cutout, whatever is there; `None` where half of its light has no pixels.
    ///
    /// `F = Σ w d`, d the pixels less sky and trails, w = (P/v)/Σ(P²/v): v the variance of a pixel, P its share of the light
    /// of a point, less what the annulus takes of it for sky. So the flux is the whole light, and needs no aperture
    /// correction. v holds the photons of the source as a first round finds them.
    /// `σ² = Σ w² v + (Σ w)² σ_S²`, more where trails make empty apertures scatter more than their photons.
    ///
    /// With a second profile, that of a disc one FWHM across, F is the sum of both: to the fourth order in its size the light
    /// of any disc smaller than that, and the share of the second is the square of its diameter.
    pub fn forced_flux(
        &self,
        frame: &Frame<Electrons>,
        background: &Background,
        (x, y): (f64, f64),
        objects: &Array2<bool>,
        s: &TargetSettings,
    ) -> Option<PointFlux> {
        let over = self.over_sky(frame, background, circle_at(x, y, self.psf.reach_px()), objects, s);
        let Over { measured, first: (nx, ny), excess, sky_err_e, taken, .. } = over;
        let net_at = |i: usize, j: usize| {
            let at = (j.checked_sub(ny)?, i.checked_sub(nx)?);
            measured.net.get(at).map(|v| f64::from(*v))
        };
        let pixels = self.pixels_of(&self.psf, (x, y), taken, net_at)?;
        let mut flux_e = 0.0;
        let mut result = None;
        for _ in 0..2 {
            let own = f64::max(flux_e, 0.0);
            let fitted = Fitted::of(&pixels, own, excess, sky_err_e)?;
            flux_e = fitted.point.flux_e;
            result = Some(fitted);
        }
        let fitted = result?;
        let err_of = |w: &Weighed| (w.empty * w.empty + f64::max(flux_e, 0.0) * w.photons).sqrt();
        let (point, free) = (fitted.point, fitted.free);
        let mut flux = measured.flux.clone();
        (flux.flux_e, flux.flux_err_e) = (point.flux_e, err_of(&point));
        flux.snr = flux.flux_e / flux.flux_err_e;
        let (empty, photons) = fitted.free_and_disc;
        Some(PointFlux {
            flux,
            empty_err_e: point.empty,
            photons: point.photons,
            free_e: (free.flux_e, err_of(&free)),
            of_disc_e: (fitted.disc.flux_e, err_of(&fitted.disc), empty + f64::max(flux_e, 0.0) * photons),
            measured,
        })
    }

    /// The light of a source of up to three FWHM at a place, by least squares of discs of 1.1, 2 and 2.9 FWHM; `None` where too few of its
    /// pixels are good.
    ///
    /// Errors are as in [`Self::forced_flux`], 2.1 to 2.5 times that of a point.
    pub fn wide_flux(
        &self,
        frame: &Frame<Electrons>,
        background: &Background,
        (x, y): (f64, f64),
        objects: &Array2<bool>,
        s: &TargetSettings,
    ) -> Option<WideFlux> {
        let reach = WIDE_REACH_FWHM * self.psf.fwhm_px;
        let over = self.over_sky(frame, background, circle_at(x, y, reach), objects, s);
        let Over { at, measured, first, excess, sky_err_e, taken } = over;
        let discs = self.psf.wide_discs();
        let mut pixels = Vec::new();
        for ((j, i), net_e) in measured.net.indexed_iter() {
            let (i, j) = (i + first.0, j + first.1);
            let (dx, dy) = (i as f64 - x, j as f64 - y);
            if dx * dx + dy * dy <= reach * reach && net_e.is_finite() && !self.is_masked(i, j) {
                let variance = self.sky.rms(i as f64, j as f64).powi(2) + self.light_at(i, j);
                pixels.push((SVector::from(discs.share(dx, dy)).add_scalar(-taken), f64::from(*net_e), variance));
            }
        }
        if (pixels.len() as f64) < LEAST_GOOD * at.shape.area_px() {
            return None;
        }
        let mut shares = SVector::<f64, 3>::zeros();
        let mut fitted = None;
        for _ in 0..2 {
            // photons of the source as it is known so far
            let variance = |p: &(SVector<f64, 3>, f64, f64)| p.2 + p.0.dot(&shares).max(0.0);
            let (mut normal, mut right) = (SMatrix::<f64, 3, 3>::zeros(), SVector::<f64, 3>::zeros());
            for p in &pixels {
                normal += p.0 * p.0.transpose() / variance(p);
                right += p.0 * (p.1 / variance(p));
            }
            let inverse = normal.cholesky()?.inverse();
            let sum_of = |coefficients: SVector<f64, 3>| {
                let weights = inverse * coefficients;
                let (mut value, mut sum, mut empty, mut photons) = (0.0, 0.0, 0.0, 0.0);
                for p in &pixels {
                    let w = weights.dot(&p.0) / variance(p);
                    value += w * p.1;
                    sum += w;
                    empty += w * w * p.2;
                    photons += w * w * p.0.dot(&shares).max(0.0);
                }
                (value, (excess * empty + photons + (sum * sky_err_e).powi(2)).sqrt())
            };
            let flux_e = sum_of(SVector::repeat(1.0));
            let size = sum_of(SVector::from(WIDE_FWHM.map(|diameter| diameter * diameter)));
            shares = inverse * right;
            fitted = Some((flux_e, (size.0 / flux_e.0, size.1 / flux_e.0.abs())));
        }
        let (flux_e, disc2) = fitted?;
        Some(WideFlux { flux_e, disc2, place: at, measured })
    }

    /// The pixels of a circle over sky and trails, and what weights of a profile must know of them.
    fn over_sky(
        &self,
        frame: &Frame<Electrons>,
        background: &Background,
        at: Placed,
        objects: &Array2<bool>,
        s: &TargetSettings,
    ) -> Over {
        let measured = self.flux(frame, background, &at, objects, s);
        let (ox, oy) = self.origin(frame);
        let first = (measured.net_origin.0 - ox as usize, measured.net_origin.1 - oy as usize);
        let (flux, along_trails) = (&measured.flux, measured.trail_level.is_some());
        let excess = excess_of(flux, &at.shape, self.sky.rms(at.x, at.y), along_trails);
        let (sky_err_e, taken) = if along_trails {
            (0.0, 0.0)
        } else {
            (flux.sky_err_e_px, self.psf.mean_between(flux.sky_in_px, flux.sky_out_px))
        };
        Over { at, measured, first, excess, sky_err_e, taken }
    }

    /// Where a source of a profile near a place fits best, by Gauss-Newton steps of flux and place; over the sky's surface and the
    /// trails' light alone.
    pub fn best_place(&self, psf: &Psf, start: (f64, f64)) -> Option<BestPlace> {
        let (mut x, mut y) = start;
        let mut snr = 0.0;
        for _ in 0..PLACE_STEPS {
            let step = self.place_step(psf, (x, y))?;
            snr = step.snr;
            // without light there is no better place
            let Some((dx, dy, _)) = step.offset_px else { break };
            let longest = PLACE_STEP_FWHM.1 * psf.fwhm_px;
            let scale = (longest / dx.hypot(dy)).min(1.0);
            (x, y) = (x + scale * dx, y + scale * dy);
            if (x - start.0).hypot(y - start.1) > PLACE_REACH_FWHM * psf.fwhm_px {
                return None;
            }
            if dx.hypot(dy) < PLACE_STEP_FWHM.0 * psf.fwhm_px {
                break;
            }
        }
        Some(BestPlace { x, y, snr })
    }

    /// One Gauss-Newton step from a place to where a source of a profile fits best.
    pub fn place_step(&self, psf: &Psf, at: (f64, f64)) -> Option<PlaceStep> {
        let net_at = |i: usize, j: usize| {
            Some(f64::from(self.pixels[[j, i]]) - self.sky.level(i as f64, j as f64) - self.light_at(i, j))
        };
        let pixels = self.pixels_of(psf, at, 0.0, net_at)?;
        let (mut normal, mut right) = (SMatrix::<f64, 3, 3>::zeros(), SVector::<f64, 3>::zeros());
        for p in &pixels {
            let t = SVector::from([p.share.point, p.share.by_place[0], p.share.by_place[1]]);
            normal += t * t.transpose() / p.variance;
            right += t * (p.net_e / p.variance);
        }
        let snr = right[0] / normal[(0, 0)].sqrt();
        let fit = normal.cholesky()?.solve(&right);
        let err = 1.0 / (fit[0] * (0.5 * (normal[(1, 1)] + normal[(2, 2)])).sqrt());
        let offset_px = (fit[0] > 0.0).then(|| (fit[1] / fit[0], fit[2] / fit[0], err));
        Some(PlaceStep { snr, offset_px })
    }

    /// Whether enough of a source at a place is not masked.
    pub fn is_seen(&self, psf: &Psf, at: (f64, f64)) -> bool {
        self.pixels_of(psf, at, 0.0, |i, j| Some(f64::from(self.pixels[[j, i]]))).is_some()
    }

    /// The good pixels within reach of a source, less what an annulus takes of its light (`taken` per pixel).
    fn pixels_of(
        &self,
        psf: &Psf,
        (x, y): (f64, f64),
        taken: f64,
        net_at: impl Fn(usize, usize) -> Option<f64>,
    ) -> Option<Vec<Pixel>> {
        let (ny, nx) = self.pixels.dim();
        let reach = psf.reach_px();
        let (mut all, mut good, mut pixels) = (0.0, 0.0, Vec::new());
        let span = |at: f64| (at - reach).floor() as i64..=(at + reach).ceil() as i64;
        let (columns, rows) = (cells(x - reach, x + reach, 0, nx), cells(y - reach, y + reach, 0, ny));
        for j in span(y) {
            for i in span(x) {
                let (dx, dy) = (i as f64 - x, j as f64 - y);
                if dx * dx + dy * dy > reach * reach {
                    continue;
                }
                let mut share = psf.share(dx, dy);
                all += share.point * share.point;
                let (Ok(i), Ok(j)) = (usize::try_from(i), usize::try_from(j)) else { continue };
                if !columns.contains(&i) || !rows.contains(&j) || self.is_masked(i, j) {
                    continue;
                }
                let Some(net_e) = net_at(i, j).filter(|v| v.is_finite()) else { continue };
                good += share.point * share.point;
                share.point -= taken;
                share.disc -= taken;
                let variance = self.sky.rms(i as f64, j as f64).powi(2) + self.light_at(i, j);
                pixels.push(Pixel { share, net_e, variance });
            }
        }
        (good > LEAST_WEIGHT * all).then_some(pixels)
    }
}

/// By how much empty apertures scatter more than their photons, where trails make them.
fn excess_of(flux: &Flux, shape: &Shape, rms_e: f64, along_trails: bool) -> f64 {
    if !along_trails {
        return 1.0;
    }
    let empty = flux.flux_err_e.powi(2) - flux.flux_e.max(0.0);
    (empty / (shape.area_px() * rms_e * rms_e)).max(1.0)
}

/// A weighted sum: its value, its error without the photons of the source, and Σ w² P, its variance per photon.
#[derive(Debug, Clone, Copy)]
struct Weighed {
    flux_e: f64,
    empty: f64,
    photons: f64,
}

/// A point, a disc of free size, and the share of the disc of one FWHM in that.
struct Fitted {
    point: Weighed,
    free: Weighed,
    disc: Weighed,
    /// Covariance of the last two without the photons of the source, and per photon.
    free_and_disc: (f64, f64),
}

impl Fitted {
    /// `own_e` is the light of the source as it is known so far.
    fn of(pixels: &[Pixel], own_e: f64, excess: f64, sky_err_e: f64) -> Option<Self> {
        let variance = |p: &Pixel| p.variance + own_e * p.share.point.max(0.0);
        let mut normal = Matrix2::<f64>::zeros();
        for p in pixels {
            let t = Vector2::new(p.share.point, p.share.disc);
            normal += t * t.transpose() / variance(p);
        }
        let inverse = normal.cholesky()?.inverse();
        let weight =
            |weights: &Vector2<f64>, p: &Pixel| weights.dot(&Vector2::new(p.share.point, p.share.disc)) / variance(p);
        // of two weighted sums: without the photons of the source, and per photon
        let covariance = |a: &Vector2<f64>, b: &Vector2<f64>| {
            let (mut sums, mut empty, mut photons) = ((0.0, 0.0), 0.0, 0.0);
            for p in pixels {
                let (v, w) = (weight(a, p), weight(b, p));
                sums = (sums.0 + v, sums.1 + w);
                empty += v * w * p.variance;
                photons += v * w * p.share.point.max(0.0);
            }
            (excess * empty + sums.0 * sums.1 * sky_err_e * sky_err_e, photons)
        };
        let of = |weights: &Vector2<f64>| {
            let (empty, photons) = covariance(weights, weights);
            let flux_e = pixels.iter().map(|p| weight(weights, p) * p.net_e).sum();
            Weighed { flux_e, empty: empty.sqrt(), photons }
        };
        let [point, free, disc] = [
            Vector2::new(1.0 / normal[(0, 0)], 0.0),
            inverse * Vector2::new(1.0, 1.0),
            inverse * Vector2::new(0.0, 1.0),
        ];
        Some(Self { point: of(&point), free: of(&free), disc: of(&disc), free_and_disc: covariance(&free, &disc) })
    }
}
