//! Two lists matched under world coordinates, and the chance that they agree as well by accident.

use super::chance::tail;
use super::field::Field;
use super::fit::{Fit, Match};
use super::grid::Grid;
use crate::astrometry::wcs::Wcs;

/// Radii at which matches are counted: each half of the one before.
const N_RADII: i32 = 5;

/// Stars on the sky and detections on the frame, to be matched under world coordinates.
pub(super) struct Lists {
    /// (RA, Dec) \[deg\].
    stars: Vec<(f64, f64)>,
    /// (x, y) \[px\].
    pub detected: Vec<(f64, f64)>,
    size_px: (f64, f64),
}

impl Lists {
    pub fn new(stars: Vec<(f64, f64)>, detected: Vec<(f64, f64)>, size_px: (f64, f64)) -> Lists {
        Lists { stars, detected, size_px }
    }

    pub fn of_field(field: &Field) -> Lists {
        let half = (0.5 * (field.size_px.0 - 1.0), 0.5 * (field.size_px.1 - 1.0));
        let detected = field.detected.iter().map(|s| (s.0 + half.0, s.1 + half.1)).collect();
        let stars = field.stars.iter().map(|s| field.plane.pixel_to_sky(s.at.0, s.at.1)).collect();
        Lists::new(stars, detected, field.size_px)
    }

    pub fn matches(&self, pairs: &[(usize, usize)]) -> Vec<Match> {
        pairs.iter().map(|&(i, j)| Match { sky_deg: self.stars[i], at_px: self.detected[j] }).collect()
    }

    /// Stars on the frame or within `margin` of it: (star, place).
    fn expected(&self, wcs: &Wcs, margin: f64) -> Vec<(usize, (f64, f64))> {
        let inside = |p: &(f64, f64)| {
            p.0 > -margin && p.1 > -margin && p.0 < self.size_px.0 + margin && p.1 < self.size_px.1 + margin
        };
        let place = |(i, s): (usize, &(f64, f64))| Some((i, wcs.sky_to_pixel(s.0, s.1).filter(inside)?));
        self.stars.iter().enumerate().filter_map(place).collect()
    }

    /// Pairs within `radius_px` under `wcs`, each star and each detection once, without ambiguous ones.
    pub fn pairs(&self, wcs: &Wcs, radius_px: f64) -> Vec<(usize, usize)> {
        let expected = self.expected(wcs, radius_px);
        let places: Vec<(f64, f64)> = expected.iter().map(|e| e.1).collect();
        let grid = Grid::new(&places, 0.02 * self.size_px.0.hypot(self.size_px.1));
        let mut pairs: Vec<(usize, usize)> = unique_pairs(&places, &self.detected, &grid, radius_px)
            .into_iter()
            .map(|(i, j)| (expected[i].0, j))
            .collect();
        pairs.sort_unstable();
        pairs
    }

    /// Fits and matches in turn until the pairs stay the same; the radius follows the scatter.
    pub fn settle(
        &self,
        start: Vec<(usize, usize)>,
        start_deg: (f64, f64),
        radius_px: f64,
        fit: &dyn Fn(&[Match], (f64, f64)) -> Option<Fit>,
    ) -> Option<(Wcs, Vec<(usize, usize)>, f64)> {
        let mut pairs = start;
        let mut radius = 1.5 * radius_px;
        let mut centre = start_deg;
        let mut last = None;
        for round in 0..10 {
            if pairs.len() < 3 {
                return None;
            }
            let fit = fit(&self.matches(&pairs), centre)?;
            let scale = fit.wcs.scale_arcsec();
            centre = fit.wcs.pixel_to_sky(0.5 * (self.size_px.0 - 1.0), 0.5 * (self.size_px.1 - 1.0));
            let mut r: Vec<f64> = fit.residuals_arcsec.iter().map(|r| r.0.hypot(r.1) / scale).collect();
            r.sort_by(f64::total_cmp);
            // the median of a Rayleigh distribution is 1.18 σ; few stars are drawn to their fit by its parameters
            let free = (2 * r.len()) as f64 / (2 * r.len()).saturating_sub(fit.model.parameters()).max(1) as f64;
            let sigma = r[r.len() / 2] / 1.18 * free.sqrt();
            if round > 0 {
                radius = (4.5 * sigma).clamp(0.3 * radius_px, 1.5 * radius_px);
            }
            let next = self.pairs(&fit.wcs, radius);
            last = Some(fit.wcs);
            if next == pairs {
                break;
            }
            pairs = next;
        }
        if pairs.len() < 3 {
            return None;
        }
        last.map(|wcs| (wcs, pairs, radius))
    }

    /// Probability that one hypothesis brings as many together by chance, at the most significant radius, and the rms
    /// \[arcsec\].
    pub fn chance(&self, wcs: &Wcs, pairs: &[(usize, usize)], radius_px: f64) -> (f64, f64) {
        let distance = |&(i, j): &(usize, usize)| {
            let at = wcs.sky_to_pixel(self.stars[i].0, self.stars[i].1)?;
            Some((at.0 - self.detected[j].0).hypot(at.1 - self.detected[j].1))
        };
        let r: Vec<f64> = pairs.iter().filter_map(distance).collect();
        let expected = self.expected(wcs, 0.0).len() as f64;
        let n = self.detected.len() as u64;
        let mut best = 1.0_f64;
        for step in 0..N_RADII {
            let radius = radius_px * 0.5f64.powi(step);
            let k = r.iter().filter(|d| **d <= radius).count() as u64;
            let p = (expected * std::f64::consts::PI * radius * radius / (self.size_px.0 * self.size_px.1)).min(1.0);
            if k > 3 && n >= k {
                best = best.min(tail(n - 3, p, k - 3) * f64::from(N_RADII));
            }
        }
        let rms = (r.iter().map(|d| d * d).sum::<f64>() / r.len().max(1) as f64).sqrt() * wcs.scale_arcsec();
        (best.min(1.0), rms)
    }
}

/// (star, detection) pairs within `radius`, both the only one near the other; `places` of the stars are in `grid`.
pub(super) fn unique_pairs(
    places: &[(f64, f64)],
    detected: &[(f64, f64)],
    grid: &Grid,
    radius: f64,
) -> Vec<(usize, usize)> {
    let mut of_star: Vec<Option<(usize, usize)>> = vec![None; places.len()];
    let mut candidates = Vec::new();
    for (j, detection) in detected.iter().enumerate() {
        let mut near = grid.near(detection.0, detection.1, radius);
        let (Some((i, _)), None) = (near.next(), near.next()) else {
            for (i, _) in grid.near(detection.0, detection.1, radius) {
                of_star[i] = Some((2, j));
            }
            continue;
        };
        of_star[i] = Some((of_star[i].map_or(1, |(n, _)| n + 1), j));
        candidates.push((i, j));
    }
    candidates.retain(|(i, _)| of_star[*i].is_some_and(|(n, _)| n == 1));
    candidates
}
