//! Hypotheses: triangles of detections that have the shape of triangles of stars, at a scale and a place the hint allows.
//!
//! The shape is the complex number z = (C − A)/(B − A), AB the longest side: free of scale, place and rotation, and
//! conjugated by a mirror. Levels go from few bright stars to many, each first for good centroids, then for poor ones.

use super::similarity::C;
use super::similarity::Similarity;

use super::field::Field;
use super::grid::Grid;
use super::judge::{Found, Judge};
use super::problem::Effort;
use super::problem::MAX_CHANCE;
use super::problem::MIN_MATCHED;
use super::problem::Refusal;

/// The settings of one round of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Level {
    /// Brightest detections.
    n_detected: usize,
    /// Stars of a rank below this.
    rank: usize,
    /// Longest side \[diagonals of the frame\].
    longest: f64,
}

const LEVELS: [Level; 4] = [
    Level { n_detected: 10, rank: 12, longest: 0.7 },
    Level { n_detected: 16, rank: 20, longest: 0.7 },
    Level { n_detected: 24, rank: 32, longest: 0.6 },
    Level { n_detected: 32, rank: 40, longest: 0.5 },
];
/// Where detections are so few that every triangle of theirs is needed.
const SPARSE: Level = Level { n_detected: 20, rank: 32, longest: 1.0 };
/// Longest side at least \[diagonals of the frame\].
const SHORTEST: f64 = 0.12;
/// Thinnest triangle, height over longest side: thinner ones cannot be distinguished from their mirror image.
const THINNEST: f64 = 0.05;
/// Errors of the positions that are allowed for \[px\]: good centroids, then poor ones or a distorted field.
const SIGMAS_PX: [f64; 2] = [0.5, 2.5];
/// Shapes agree within this many σ; the three corners add 1.6 σ/AB to z.
const SHAPE_SIGMAS: f64 = 3.0 * 1.6;
/// Triangles of stars of one round, at most.
const MAX_TRIANGLES: u64 = 4_000_000;
/// Hypotheses judged in one round, at most.
const MAX_HYPOTHESES: u64 = 400_000;
/// A solution this good ends the search.
const CERTAIN: f64 = 1e-12;

/// The best hypothesis whose chance, times the number of all that were tried and of `n_tiles`, is small enough.
pub(super) fn search(field: &Field, n_tiles: f64, effort: Effort) -> Result<Found, Refusal> {
    let n_detected = field.detected.len();
    let sparse = (n_detected <= SPARSE.n_detected).then_some(SPARSE);
    let mut tried = 0u64;
    let mut best: Option<Found> = None;
    let mut done: Option<Level> = None;
    for level in LEVELS.into_iter().take(effort.max_levels).chain(sparse) {
        let level = Level { n_detected: level.n_detected.min(n_detected).min(effort.max_detections), ..level };
        // deeper in stars alone is worth a round, the same again is not
        if done.is_some_and(|d| d.n_detected == level.n_detected && d.rank >= level.rank && d.longest >= level.longest)
        {
            continue;
        }
        done = Some(level);
        for sigma_px in SIGMAS_PX {
            let mut judge = Judge::new(field, sigma_px, tried);
            let certain = round(field, level, sigma_px, &mut judge, tried, n_tiles);
            tried += judge.n_judged;
            for found in judge.best.into_iter() {
                if best.as_ref().is_none_or(|b| found.better_than(b)) {
                    best = Some(found);
                }
            }
            let factor = tried as f64 * n_tiles;
            if let Some(mut found) = best.take_if(|b| certain || b.chance * factor <= MAX_CHANCE) {
                found.chance = (found.chance * factor).min(1.0);
                found.n_hypotheses = tried;
                return Ok(found);
            }
        }
    }
    let factor = tried as f64 * n_tiles;
    Err(Refusal::NoMatch {
        n_detections: n_detected,
        n_stars: field.stars.len(),
        n_hypotheses: tried,
        best: best.map(|b| (b.pairs.len(), (b.chance * factor).min(1.0))).filter(|b| b.0 >= MIN_MATCHED),
    })
}

/// A triangle of detections by its shape.
struct Shape {
    corners: [C; 3],
    /// Length of AB \[px\].
    length: f64,
    /// Whether Im z was negative and has been turned over.
    turned: bool,
}

/// One level at one tolerance; `true` when the answer is certain.
fn round(field: &Field, level: Level, sigma_px: f64, judge: &mut Judge, tried: u64, n_tiles: f64) -> bool {
    let diagonal = field.size_px.0.hypot(field.size_px.1);
    let (shortest_px, longest_px) = (SHORTEST * diagonal, level.longest * diagonal);
    let widest = SHAPE_SIGMAS * sigma_px / shortest_px;
    let (shapes, index) = shapes(&field.detected[..level.n_detected], (shortest_px, longest_px), widest);
    if shapes.is_empty() {
        return false;
    }
    let stars: Vec<C> = field.stars.iter().filter(|s| s.rank < level.rank).map(|s| C::new(s.at.0, s.at.1)).collect();
    let reach = longest_px * field.scales.1;
    let shortest = shortest_px * field.scales.0;
    let places: Vec<(f64, f64)> = stars.iter().map(|s| (s.re, s.im)).collect();
    let near = Grid::new(&places, reach);
    let mut n_triangles = 0u64;
    for (i, a) in stars.iter().enumerate() {
        // the others by distance: all before the k-th are closer to A than it is
        let mut others: Vec<(f64, usize)> =
            near.near(a.re, a.im, reach).filter(|(j, _)| *j != i).map(|(j, d2)| (d2, j)).collect();
        others.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
        for (k, &(ab2, j)) in others.iter().enumerate() {
            // each side once as AB from either end: the end nearer to C is A (Re z ≤ ½), tested below
            if ab2 < shortest * shortest {
                continue;
            }
            let b = stars[j];
            let ab = b - a;
            for &(_, l) in &others[..k] {
                let c = stars[l];
                let z = (c - a) / ab;
                if z.re > 0.5 || (z - 1.0).norm_sqr() > 1.0 || z.im.abs() < THINNEST {
                    continue;
                }
                n_triangles += 1;
                let length = ab2.sqrt();
                for (s, d2) in index.near(z.re, z.im.abs(), widest) {
                    let shape = &shapes[s];
                    let tolerance = SHAPE_SIGMAS * sigma_px / shape.length;
                    let scale = length / shape.length;
                    let conjugate = shape.turned != (z.im < 0.0);
                    if d2 > tolerance * tolerance
                        || !(field.scales.0..=field.scales.1).contains(&scale)
                        || !field.conjugate[usize::from(conjugate)]
                    {
                        continue;
                    }
                    let at = Similarity::of(shape.corners, [*a, b, c], conjugate);
                    if judge.hear(&at) && judge.best_chance() * (tried + judge.n_judged) as f64 * n_tiles < CERTAIN {
                        return true;
                    }
                }
            }
            if n_triangles > MAX_TRIANGLES || judge.n_judged > MAX_HYPOTHESES {
                return false;
            }
        }
    }
    false
}

/// The triangles of detections, both ends of AB as A where C is about as far from both, and the grid of their shapes.
fn shapes(detected: &[(f64, f64)], (shortest, longest): (f64, f64), tolerance: f64) -> (Vec<Shape>, Grid) {
    let z: Vec<C> = detected.iter().map(|s| C::new(s.0, s.1)).collect();
    let (mut shapes, mut places) = (Vec::new(), Vec::new());
    for i in 0..z.len() {
        for j in i + 1..z.len() {
            for k in j + 1..z.len() {
                let sides = [(z[j], z[k], z[i]), (z[i], z[k], z[j]), (z[i], z[j], z[k])];
                let length2 = sides.map(|(a, b, _)| (b - a).norm_sqr());
                let longest_side = (0..3).max_by(|&p, &q| length2[p].total_cmp(&length2[q])).unwrap_or(0);
                let length = length2[longest_side].sqrt();
                if length < shortest || length > longest {
                    continue;
                }
                let (a, b, c) = sides[longest_side];
                for (a, b) in [(a, b), (b, a)] {
                    let shape = (c - a) / (b - a);
                    if shape.re <= 0.5 + tolerance && shape.im.abs() >= THINNEST - tolerance {
                        places.push((shape.re, shape.im.abs()));
                        shapes.push(Shape { corners: [a, b, c], length, turned: shape.im < 0.0 });
                    }
                }
            }
        }
    }
    let grid = Grid::new(&places, tolerance);
    (shapes, grid)
}
