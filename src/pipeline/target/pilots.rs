//! Where the target stands in a frame by other frames of its pass, so that it need not be looked for elsewhere.
//!
//! Full-frame pixels; seconds. Every third target frame of a night is a pilot: the target is looked for in all of
//! `target.search_radius_arcsec`. In the frames between it is looked for first where the nearest pilots have it, and in all of it
//! only if it is not clear there. So nothing can be lost; what is saved is most of the pixels. Where a frame, a pilot too, shows
//! something larger than the other pilots do, a trail or a neighbour has joined the target, which is then bounded by its size in them.
//! A pilot with a compact target is measured once more with the sizes that the others show, where they know it better.
//! It does not cover the place of a pass for forced fluxes ([`crate::pipeline::passes`]), which takes all of its detections.

use std::collections::HashMap;
use std::ops::Range;

use super::frame::settings_of_frame;
use super::place::Place;
use super::window::{MOST_GROWTH, Region, size_err};
use crate::base::stats::median;
use crate::base::time::mjd_utc;
use crate::frames::Exposure;
use crate::photometry::Flags;
use crate::photometry::target::compact::mean_disc2;
use crate::pipeline::prepared::{Calibrated, Seeing};
use crate::tables::PhotometryRow;
use crate::tables::row_passes::PASS_GAP_S;
use crate::tables::words::Status;

/// One target frame of so many is a pilot: passes of ten frames have three, and a search in all of the region takes three times as
/// long as one where the target stands.
const STEP: usize = 3;
/// The place in a frame is expected by at most so many of the nearest pilots of its pass that show the target clearly, and at least so
/// many.
const NEAREST: usize = 5;
const FEWEST: usize = 3;
/// No pilot further away is of use \[frames\].
pub const REACH: usize = NEAREST * STEP;
/// A detection in a pilot is clear unless one of these disturbs its place.
const DISTURBED: Flags = Flags(
    Flags::EDGE.0 | Flags::CROSSED.0 | Flags::HIT.0 | Flags::BLOOMING.0 | Flags::NO_ANNULUS.0 | Flags::TIME_UNCERTAIN.0,
);
/// The region reaches so many errors of the expected place, and so much further: stars are not points \[FWHM\].
const SIGMAS: f64 = 5.0;
const MARGIN_FWHM: f64 = 2.0;
/// The bound of the target reaches so many of those errors beyond its outline in the pilots.
const BOUND_SIGMAS: f64 = 2.0;
/// Seconds per day.
const DAY_S: f64 = 86_400.0;

/// Target frames of a night, with those around them that may be their pilots.
#[derive(Debug)]
pub struct TargetFrames<'a> {
    /// The frames, in the order of the night.
    pub exposures: &'a [Exposure],
    /// The number of each in the night ([`numbers`]).
    pub numbers: Vec<Option<usize>>,
    /// Those to be measured.
    pub wanted: Range<usize>,
}

impl<'a> TargetFrames<'a> {
    /// All frames of a night.
    #[must_use]
    pub fn all(exposures: &'a [Exposure]) -> Self {
        Self { exposures, numbers: numbers(exposures), wanted: 0..exposures.len() }
    }

    /// The places of the pilots that frames to be measured may need.
    #[must_use]
    pub fn pilots(&self) -> Vec<usize> {
        let wanted: Vec<usize> = self.numbers[self.wanted.clone()].iter().flatten().copied().collect();
        let (first, last) = (wanted.iter().min(), wanted.iter().max());
        let near =
            |n: usize| first.is_some_and(|first| n + REACH >= *first) && last.is_some_and(|last| n <= *last + REACH);
        (0..self.exposures.len()).filter(|k| self.numbers[*k].is_some_and(|n| is_pilot(n) && near(n))).collect()
    }

    /// Where the frame at place `k` shows the target by the pilots (places and rows); `None` where they do not say.
    #[must_use]
    pub fn region(&self, k: usize, pilots: &[(usize, PhotometryRow)], night: &Calibrated) -> Option<Region> {
        let (exposure, number) = (&self.exposures[k], self.numbers[k]?);
        let place = Place::of(exposure, night);
        let object = place.object.as_ref();
        let name = object.map(|o| o.name.as_str()).or(exposure.object.as_deref()).unwrap_or_default();
        let target = (object.and_then(|o| o.norad_cat_id), name);
        let mjd_d = mjd_utc(exposure.time.as_ref()?.mid);
        let t_s = |row: &PhotometryRow| row.mjd_mid_d.map(|mjd| (mjd - mjd_d) * DAY_S);
        let of_pass = |(place, row): &&(usize, PhotometryRow)| {
            let other = &self.exposures[*place];
            self.numbers[*place] != Some(number)
                && (row.norad_cat_id, row.object_name.as_str()) == target
                && t_s(row).is_some_and(|t| t.abs() <= PASS_GAP_S)
                && (other.size_px, other.binning) == (exposure.size_px, exposure.binning)
        };
        let mut near: Vec<(usize, &PhotometryRow)> = pilots
            .iter()
            .filter(|(place, _)| self.numbers[*place].is_some_and(|n| n.abs_diff(number) <= REACH))
            .filter(of_pass)
            .filter_map(|(place, row)| Some((self.numbers[*place]?, row)))
            .collect();
        near.sort_by_key(|(n, _)| (n.abs_diff(number), *n));
        near.dedup_by_key(|(n, _)| *n);
        let clear: Vec<Clear> = near.iter().filter_map(|(_, row)| Clear::of(row, t_s(row)?, &night.seeing)).collect();
        let s = settings_of_frame(place.seen(), exposure, night);
        expected(clear, (s.fwhm_px, s.fwhm_err_frac), s.margin_px)
            .filter(|region| (region.x_px - s.x_px).hypot(region.y_px - s.y_px) <= s.search_radius_px)
    }
}

/// The number of each target frame in its night, in their order; frames of one moment are copies and share it. `None` without a
/// time.
#[must_use]
pub fn numbers(exposures: &[Exposure]) -> Vec<Option<usize>> {
    let mut of_moment: HashMap<u64, usize> = HashMap::new();
    let mut number = |exposure: &Exposure| {
        let next = of_moment.len();
        Some(*of_moment.entry(mjd_utc(exposure.time.as_ref()?.mid).to_bits()).or_insert(next))
    };
    exposures.iter().map(&mut number).collect()
}

/// Whether the frame of this number is a pilot.
#[must_use]
pub fn is_pilot(number: usize) -> bool {
    number.is_multiple_of(STEP)
}

/// A clear detection in a pilot.
#[derive(Debug, Clone, Copy)]
struct Clear {
    /// Time since the frame in question \[s\].
    t_s: f64,
    x_px: f64,
    y_px: f64,
    /// Radius of a circle around the aperture \[px\].
    aper_px: f64,
    /// Whether light of trails or neighbours is a part of its flux.
    is_contaminated: bool,
    /// Its size by its pixels and the error \[FWHM²\], where it is compact.
    disc2: Option<(f64, f64)>,
}

impl Clear {
    fn of(row: &PhotometryRow, t_s: f64, seeing: &Seeing) -> Option<Self> {
        let is_clear = row.status == Status::Ok && row.flags & DISTURBED.0 == 0;
        let aper_px = row.aper_r_px.or(row.aper_a_px)?;
        let disc2 = row.disc_fwhm2.zip(size_err(row, seeing));
        let is_contaminated = row.flags & Flags::CONTAMINATED.0 != 0;
        is_clear.then_some(Self { t_s, x_px: row.x_px?, y_px: row.y_px?, aper_px, is_contaminated, disc2 })
    }
}

/// The place at t = 0 on the straight line through clear detections, the nearest in time first, and how far from it the target may be.
///
/// `r = 5 σ √(1 + 1/n + t̄²/Σ(t − t̄)²) + a/2 + 2 FWHM`: σ² = Σ residuals² / (2n − 4) the scatter of the places along an axis, a the
/// radius of the largest aperture: its middle is not the middle of the light that is found at first.
///
/// No part of it is further than a plus two of those σ from there, the margin around its outline not counted. Pilots whose aperture is
/// larger than that of most by [`MOST_GROWTH`] do not count: a trail or a neighbour is in it.
fn expected(mut clear: Vec<Clear>, (fwhm_px, fwhm_err_frac): (f64, f64), margin_px: f64) -> Option<Region> {
    let usual_px = median(&mut clear.iter().map(|c| c.aper_px).collect::<Vec<_>>())?;
    clear.retain(|c| c.aper_px <= MOST_GROWTH * usual_px);
    // light of others in an aperture has moved its middle: such pilots count only where too few are without it
    clear.sort_by_key(|c| c.is_contaminated);
    let clean = clear.iter().filter(|c| !c.is_contaminated).count();
    if clear.len() < FEWEST {
        return None;
    }
    // no line is drawn through sizes: all clean ones count, not only the nearest
    let disc2 = mean_disc2(clear[..clean].iter().filter_map(|c| c.disc2), fwhm_err_frac);
    clear.truncate(clean.clamp(FEWEST, NEAREST));
    let n = clear.len() as f64;
    let mean = |of: &dyn Fn(&Clear) -> f64| clear.iter().map(of).sum::<f64>() / n;
    let (t, x, y) = (mean(&|c| c.t_s), mean(&|c| c.x_px), mean(&|c| c.y_px));
    let spread = clear.iter().map(|c| (c.t_s - t).powi(2)).sum::<f64>();
    if !(spread > 0.0) {
        return None;
    }
    let slope = |of: &dyn Fn(&Clear) -> f64| clear.iter().map(|c| (c.t_s - t) * of(c)).sum::<f64>() / spread;
    let (vx, vy) = (slope(&|c| c.x_px), slope(&|c| c.y_px));
    let residual2 = |c: &Clear| {
        let dt = c.t_s - t;
        (c.x_px - x - vx * dt).powi(2) + (c.y_px - y - vy * dt).powi(2)
    };
    let sigma = (clear.iter().map(residual2).sum::<f64>() / (2.0 * n - 4.0)).sqrt();
    let err = sigma * (1.0 + 1.0 / n + t * t / spread).sqrt();
    let aper_px = clear.iter().map(|c| c.aper_px).fold(0.0, f64::max);
    let radius_px = SIGMAS * err + 0.5 * aper_px + MARGIN_FWHM * fwhm_px;
    let bound_px = (aper_px - margin_px).max(fwhm_px) + BOUND_SIGMAS * err;
    Some(Region { x_px: x - vx * t, y_px: y - vy * t, radius_px, aper_px, bound_px, disc2 })
        .filter(|r| r.radius_px.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(t_s: f64, x_px: f64, y_px: f64) -> Clear {
        Clear { t_s, x_px, y_px, aper_px: 8.0, is_contaminated: false, disc2: None }
    }

    #[test]
    fn the_region_follows_a_drift_and_is_as_wide_as_the_pilots_scatter() {
        let line = |t: f64| at(t, 100.0 + 0.5 * t, 200.0 - 0.2 * t);
        let still: Vec<Clear> = [-20.0, -10.0, 10.0, 20.0, 30.0].map(line).into();
        let of = |clear: &[Clear]| expected(clear.to_vec(), (3.0, 0.05), 4.5);
        let region = of(&still).unwrap();
        assert!((region.x_px - 100.0).abs() < 1e-9 && (region.y_px - 200.0).abs() < 1e-9);
        assert!((region.radius_px - 10.0).abs() < 1e-6, "{region:?}");
        // alternate places ±2 px off: σ = 2 √(5/6) or less, by what the line takes up
        let jitter: Vec<Clear> =
            (0..).zip(&still).map(|(k, c)| at(c.t_s, c.x_px + f64::from(4 * (k % 2) - 2), c.y_px)).collect();
        let wide = of(&jitter).unwrap().radius_px;
        assert!((16.0..31.0).contains(&wide), "{wide}");
        assert!(of(&still[..2]).is_none());
        assert!(of(&[at(1.0, 1.0, 1.0); 5]).is_none());
        // the third pilot has a trail in its aperture, which moves it
        let joined = Clear { aper_px: 30.0, x_px: 140.0, ..still[2] };
        let with: Vec<Clear> = still.iter().enumerate().map(|(k, c)| if k == 2 { joined } else { *c }).collect();
        let region = of(&with).unwrap();
        assert!((region.x_px - 100.0).abs() < 1e-9 && region.aper_px == 8.0 && (region.bound_px - 3.5).abs() < 1e-6);
        // two have light of others in apertures of the usual size, which moves them; of three they are not missed
        let moved =
            |k: usize| Clear { is_contaminated: k % 2 == 1, x_px: still[k].x_px + 9.0 * (k % 2) as f64, ..still[k] };
        let (all, some) = ([0, 1, 2, 3, 4].map(moved), [0, 1, 3].map(moved));
        assert!((of(&all).unwrap().radius_px - 10.0).abs() < 1e-6);
        assert!(of(&some).unwrap().radius_px > 20.0);
        assert!(region.is_usual(12.0) && region.is_joined((12.1, 8.0)) && !region.is_joined((12.0, 6.0)));
        // as round as it is large: brighter
        assert!(!region.is_joined((20.0, 18.0)));
    }

    #[test]
    fn all_clean_pilots_near_a_frame_show_its_size() {
        let sized = |k: i32| Clear { disc2: Some((1.0, 0.3)), ..at(f64::from(k), 100.0, 200.0) };
        let of = |clear: &[Clear]| expected(clear.to_vec(), (3.0, 0.05), 4.5).unwrap().disc2;
        let (five, ten): (Vec<Clear>, Vec<Clear>) = ((0..5).map(sized).collect(), (0..10).map(sized).collect());
        let (few, many) = (of(&five).unwrap(), of(&ten).unwrap());
        assert!((many.0 - 1.0).abs() < 1e-9 && many.1 < 0.8 * few.1, "{few:?} {many:?}");
        // a trail in the aperture makes a target wider
        let contaminated = |k| Clear { is_contaminated: true, disc2: Some((9.0, 0.1)), ..sized(k) };
        let with: Vec<Clear> = five.iter().copied().chain((5..10).map(contaminated)).collect();
        assert_eq!(of(&with), Some(few));
        assert_eq!(of(&[0, 1, 2].map(contaminated)), None);
    }
}
