//! From the best hypothesis to the solution: every star, every detection, and the model they support.

use super::field::{DUPLICATE_PX, Field, SAME_STAR_ARCSEC};
use super::fit::{Match, fit_best};
use super::grid::Grid;
use super::judge::Found;
use super::lists::Lists;
use super::problem::Detection;
use super::problem::MIN_MATCHED;
use super::problem::Pair;
use super::problem::Refusal;
use super::problem::SkyStar;
use super::problem::Solution;
use crate::astrometry::wcs::Wcs;

/// Matched stars narrower than this share of their length leave the parity open.
const NARROWEST: f64 = 0.01;

/// The solution of a hypothesis: all stars and all detections, and the model they support.
pub(super) fn solution(
    field: &Field,
    found: Found,
    catalogue: &[SkyStar],
    detections: &[Detection],
) -> Result<Solution, Refusal> {
    let refused = || Refusal::NoMatch {
        n_detections: field.detected.len(),
        n_stars: field.stars.len(),
        n_hypotheses: found.n_hypotheses,
        best: Some((found.pairs.len(), found.chance)),
    };
    let judged = Lists::of_field(field);
    let best = |matches: &[Match], start: (f64, f64)| fit_best(matches, field.size_px, start);
    let half = (0.5 * (field.size_px.0 - 1.0), 0.5 * (field.size_px.1 - 1.0));
    let centre = found.wcs.pixel_to_sky(half.0, half.1);
    // first the bright stars, so that a distorted edge is reached; then all
    let (wcs, _, radius_px) = judged.settle(found.pairs.clone(), centre, found.radius_px, &best).ok_or_else(refused)?;
    let (stars, detected) = all_in_field(field, &wcs, catalogue, detections);
    let all = Lists::new(
        stars.iter().map(|i| (catalogue[*i].ra_deg, catalogue[*i].dec_deg)).collect(),
        detected.iter().map(|j| (detections[*j].x_px, detections[*j].y_px)).collect(),
        field.size_px,
    );
    let start = all.pairs(&wcs, radius_px);
    let (_, pairs, _) = all.settle(start, centre, radius_px / 1.5, &best).ok_or_else(refused)?;
    let fit = fit_best(&all.matches(&pairs), field.size_px, centre).ok_or_else(refused)?;
    if pairs.len() < MIN_MATCHED {
        return Err(refused());
    }
    if on_a_line(&all, &pairs) {
        return Err(Refusal::OnALine { n: pairs.len() });
    }
    let mut out: Vec<Pair> = pairs
        .iter()
        .zip(&fit.residuals_arcsec)
        .map(|(&(i, j), &residual_arcsec)| Pair { star: stars[i], detection: detected[j], residual_arcsec })
        .collect();
    out.sort_by_key(|p| p.star);
    Ok(Solution {
        pairs: out,
        rms_arcsec: fit.rms_arcsec(),
        chance: found.chance,
        n_hypotheses: found.n_hypotheses,
        scale_arcsec: fit.wcs.scale_arcsec(),
        rotation_deg: fit.wcs.rotation_deg(),
        mirrored: fit.wcs.mirrored(),
        centre_deg: fit.wcs.pixel_to_sky(half.0, half.1),
        model: fit.model,
        wcs: fit.wcs,
    })
}

/// Indices of the catalogue stars on the frame and of the detections on it.
fn all_in_field(field: &Field, wcs: &Wcs, catalogue: &[SkyStar], detections: &[Detection]) -> (Vec<usize>, Vec<usize>) {
    let (nx, ny) = field.size_px;
    let margin = 0.05 * nx.hypot(ny);
    let near = |x: f64, y: f64| x > -margin && y > -margin && x < nx + margin && y < ny + margin;
    let reach_deg = (nx.hypot(ny) * wcs.scale_arcsec() / 3600.0).max(0.01);
    let (_, dec_deg) = wcs.pixel_to_sky(0.5 * nx, 0.5 * ny);
    let stars = (0..catalogue.len()).filter(|&i| {
        let s = &catalogue[i];
        (s.dec_deg - dec_deg).abs() <= reach_deg
            && wcs.sky_to_pixel(s.ra_deg, s.dec_deg).is_some_and(|(x, y)| near(x, y))
    });
    let detected = (0..detections.len()).filter(|&j| near(detections[j].x_px, detections[j].y_px));
    let (stars, detected): (Vec<usize>, Vec<usize>) = (stars.collect(), detected.collect());
    let place =
        |i: &usize| wcs.sky_to_pixel(catalogue[*i].ra_deg, catalogue[*i].dec_deg).unwrap_or((f64::NAN, f64::NAN));
    let stars = without_copies(stars, &place, &|i| -catalogue[i].v_mag, SAME_STAR_ARCSEC / wcs.scale_arcsec());
    let at = |j: &usize| (detections[*j].x_px, detections[*j].y_px);
    let detected = without_copies(detected, &at, &|j| detections[j].flux, DUPLICATE_PX);
    (stars, detected)
}

/// The list without what lies within `radius` of something brighter (of the first, among equals).
fn without_copies(
    list: Vec<usize>,
    place: &dyn Fn(&usize) -> (f64, f64),
    brightness: &dyn Fn(usize) -> f64,
    radius: f64,
) -> Vec<usize> {
    let places: Vec<(f64, f64)> = list.iter().map(place).collect();
    let grid = Grid::new(&places, radius);
    let order = |i: usize| (brightness(list[i]), std::cmp::Reverse(i));
    let outshone = |i: usize| {
        grid.near(places[i].0, places[i].1, radius).any(|(k, _)| {
            let (a, b) = (order(k), order(i));
            a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).is_gt()
        })
    };
    (0..list.len()).filter(|i| !outshone(*i)).map(|i| list[i]).collect()
}

/// Whether the narrow side of the matched stars is a small share of the long one.
fn on_a_line(lists: &Lists, pairs: &[(usize, usize)]) -> bool {
    let n = pairs.len() as f64;
    let at: Vec<(f64, f64)> = pairs.iter().map(|(_, j)| lists.detected[*j]).collect();
    let (mx, my) = at.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for p in &at {
        xx += (p.0 - mx) * (p.0 - mx);
        yy += (p.1 - my) * (p.1 - my);
        xy += (p.0 - mx) * (p.1 - my);
    }
    let (mean, half) = (0.5 * (xx + yy), (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt());
    (mean - half).max(0.0).sqrt() < NARROWEST * (mean + half).sqrt()
}
