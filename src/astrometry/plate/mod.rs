//! A frame on the sky without world coordinates: stars matched to a catalogue from an approximate position and the pixel
//! scale.
//!
//! Degrees, arcseconds and pixels (0-based). Rotation and parity are free. Triangles of bright detections are looked
//! for among triangles of bright catalogue stars; each agreement is a hypothesis, judged by how many other stars it
//! matches, and accepted if chance does not match as many once in 10⁵ fields. Then TAN and, where the stars support it,
//! SIP are fitted. It does not cover searches without any position, nor plates larger than about ten degrees.

pub mod case;
mod chance;
mod field;
mod finish;
pub mod fit;
mod grid;
mod judge;
mod lists;
mod problem;
mod search;
mod similarity;

use crate::astrometry::wcs::Wcs;
use field::Field;
pub use fit::Model;

/// Widest search about one tangent plane \[deg\]; wider ones are made of several.
const TILE_RADIUS_DEG: f64 = 1.5;

/// Finds where a frame of `size_px` (nx, ny) is on the sky.
///
/// Neither list needs to be in any order; positions and brightnesses that are not finite are passed over. The answer
/// does not depend on threads. A search wider than 1.5° is made in circles of that radius, from the hint outwards.
///
/// # Errors
/// [`Refusal`]: too little to match, nothing better than chance, or a parity that stays open.
pub fn solve(
    catalogue: &[SkyStar],
    detections: &[Detection],
    size_px: (usize, usize),
    hint: &Hint,
) -> Result<Solution, Refusal> {
    solve_with(catalogue, detections, size_px, hint, Effort::default())
}

/// As [`solve`], with another effort.
///
/// # Errors
/// As [`solve`].
pub fn solve_with(
    catalogue: &[SkyStar],
    detections: &[Detection],
    size_px: (usize, usize),
    hint: &Hint,
    effort: Effort,
) -> Result<Solution, Refusal> {
    check(hint, size_px)?;
    let tiles = tiles(hint);
    let mut first = None;
    let (mut tried, mut most) = (0, None::<(usize, f64)>);
    for tile in &tiles {
        let answer = Field::new(catalogue, detections, size_px, tile).and_then(|field| {
            search::search(&field, tiles.len() as f64, effort)
                .and_then(|found| finish::solution(&field, found, catalogue, detections))
        });
        match answer {
            Ok(solution) => return Ok(solution),
            Err(Refusal::NoMatch { n_hypotheses, best, .. }) if tiles.len() > 1 => {
                tried += n_hypotheses;
                most = [most, best].into_iter().flatten().min_by(|a, b| a.1.total_cmp(&b.1));
                first.get_or_insert(Refusal::NoMatch {
                    n_detections: detections.len(),
                    n_stars: catalogue.len(),
                    n_hypotheses: tried,
                    best: most,
                });
            }
            Err(other) => {
                first.get_or_insert(other);
            }
        }
    }
    let refusal = first.unwrap_or_else(|| Refusal::Hint("the search radius is empty".into()));
    Err(match refusal {
        Refusal::NoMatch { n_detections, n_stars, .. } if tiles.len() > 1 => {
            Refusal::NoMatch { n_detections, n_stars, n_hypotheses: tried, best: most }
        }
        other => other,
    })
}

fn check(hint: &Hint, (nx, ny): (usize, usize)) -> Result<(), Refusal> {
    let bad = |problem: String| Err(Refusal::Hint(problem));
    if !hint.ra_deg.is_finite() || !(-90.0..=90.0).contains(&hint.dec_deg) {
        return bad(format!("the approximate position {} {} deg is not on the sky", hint.ra_deg, hint.dec_deg));
    }
    if !(1e-3..=3600.0).contains(&hint.scale_arcsec) {
        return bad(format!("the scale {} arcsec/px is not between 0.001 and 3600", hint.scale_arcsec));
    }
    if !(0.0..=0.5).contains(&hint.scale_search_frac) {
        return bad(format!("the scale search {} is not between 0 and 0.5", hint.scale_search_frac));
    }
    if !(0.0..=10.0).contains(&hint.radius_deg) {
        return bad(format!("the search radius {} deg is not between 0 and 10", hint.radius_deg));
    }
    let diagonal_deg = (nx as f64).hypot(ny as f64) * hint.scale_arcsec / 3600.0;
    if nx == 0 || ny == 0 || diagonal_deg > 20.0 {
        return bad(format!("a frame of {nx} x {ny} px, {diagonal_deg:.1} deg across: 20 deg is the most"));
    }
    Ok(())
}

/// The circles a wide search is made of, from the hint outwards.
fn tiles(hint: &Hint) -> Vec<Hint> {
    if hint.radius_deg <= TILE_RADIUS_DEG {
        return vec![*hint];
    }
    let plane = Wcs::tan(hint.ra_deg, hint.dec_deg, 0.0, 0.0, 3600.0, 0.0, true);
    // squares inside the circles leave no gap
    let step = TILE_RADIUS_DEG * std::f64::consts::SQRT_2;
    let n = (hint.radius_deg / step).ceil() as i32;
    let mut places: Vec<(f64, f64)> = (-n..=n)
        .flat_map(|i| (-n..=n).map(move |j| (f64::from(i) * step, f64::from(j) * step)))
        .filter(|p| p.0.hypot(p.1) <= hint.radius_deg + TILE_RADIUS_DEG)
        .collect();
    places.sort_by(|a, b| a.0.hypot(a.1).total_cmp(&b.0.hypot(b.1)));
    places
        .into_iter()
        .map(|(x, y)| {
            let (ra_deg, dec_deg) = plane.pixel_to_sky(x, y);
            Hint { ra_deg, dec_deg, radius_deg: TILE_RADIUS_DEG, ..*hint }
        })
        .collect()
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;

pub use problem::{Detection, Effort, Hint, MAX_CHANCE, MIN_MATCHED, Pair, Refusal, SkyStar, Solution};
