//! The catalogue on the frame: shift and rotation from predicted positions to detections, found by voting pairs.
//!
//! Pixels, 0-based. Not included: scale errors beyond 1 %, mirrored frames and blind solving (the WCS gives scale and
//! parity).

use serde::{Deserialize, Serialize};
use std::collections::HashMap;

use rstar::primitives::GeomWithData;
use rstar::{PointDistance, RTree};
use statrs::distribution::{Binomial, DiscreteCDF};

/// A similarity transform about a centre, and the stars it rests on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Alignment {
    /// Shift of the centre \[px\].
    pub dx_px: f64,
    /// Shift of the centre \[px\].
    pub dy_px: f64,
    /// Rotation from +x towards +y \[rad\].
    pub rotation_rad: f64,
    /// Scale, within 1 % of 1.
    pub scale: f64,
    /// Centre of rotation \[px\]: the mean predicted position.
    pub x0: f64,
    /// Centre of rotation \[px\].
    pub y0: f64,
    /// Matched pairs.
    pub n: usize,
    /// Root mean square distance of the pairs \[px\].
    pub rms_px: f64,
    /// (index of predicted, index of detected), unique both ways, in order of the first.
    pub pairs: Vec<(usize, usize)>,
}

impl Alignment {
    /// Where a predicted position is on the frame: c + d + s R(θ) (p − c) \[px\].
    #[must_use]
    pub fn apply(&self, x: f64, y: f64) -> (f64, f64) {
        let (s, c) = self.rotation_rad.sin_cos();
        let (u, v) = (x - self.x0, y - self.y0);
        (self.x0 + self.dx_px + self.scale * (c * u - s * v), self.y0 + self.dy_px + self.scale * (s * u + c * v))
    }
}

/// Brightest stars of each list that vote.
const VOTERS: usize = 60;
/// Brightest predicted stars that judge a hypothesis.
const JUDGES: usize = 150;
/// Hypotheses of each kind that are judged, by votes.
const JUDGED: usize = 60;
/// Hypotheses of each kind that are refined, by number of matched stars.
const REFINED: usize = 6;
/// Largest rotation looked for \[rad\].
const MAX_ROTATION_RAD: f64 = 6.0 * std::f64::consts::PI / 180.0;
/// Largest departure of the scale from 1.
const MAX_SCALE_ERR: f64 = 0.01;
/// Largest probability that an accepted match is chance.
const MAX_CHANCE: f64 = 1e-4;

/// Finds the similarity that maps `predicted` to `detected` positions \[px\], both brightest first.
///
/// Hypotheses come from single stars (shift alone) and from pairs of stars of equal separation and direction (shift,
/// rotation up to 6°, scale within 1 %); those with the most votes are judged by the number of stars they bring
/// together, the best is refined. Shifts reach `search_radius_px`. Pairs are at most `match_radius_px` apart; two stars
/// near one entry or two entries near one star are ambiguous and dropped. `None` if the chance of so many matches,
/// times the number of hypotheses, exceeds 1e-4 (binomial).
#[must_use]
pub fn align(
    predicted: &[(f64, f64)],
    detected: &[(f64, f64)],
    search_radius_px: f64,
    match_radius_px: f64,
) -> Option<Alignment> {
    let usable = |p: &&(f64, f64)| p.0.is_finite() && p.1.is_finite();
    let good: Vec<(f64, f64)> = predicted.iter().filter(usable).copied().collect();
    let found: Vec<(f64, f64)> = detected.iter().filter(usable).copied().collect();
    if good.is_empty() || found.is_empty() || match_radius_px.is_nan() || match_radius_px <= 0.0 {
        return None;
    }
    let field = Field::new(good, found, match_radius_px);
    let shifts = field.shifts(search_radius_px);
    let turns = field.turns(search_radius_px);
    let mut best: Option<(f64, f64, Motion)> = None;
    for (seeds, forced) in [(&shifts, 1), (&turns, 2)] {
        for seed in field.judged(field.elect(seeds)) {
            let motion = field.refined(seed);
            if motion.shift() > search_radius_px * 1.1 || motion.turn().abs() > MAX_ROTATION_RAD * 1.1 {
                continue;
            }
            let (chance, rms) = field.chance(&motion, forced, seeds.len());
            if chance <= MAX_CHANCE && best.as_ref().is_none_or(|b| (chance, rms) < (b.0, b.1)) {
                best = Some((chance, rms, motion));
            }
        }
    }
    let (_, _, motion) = best?;
    Some(motion.alignment(&field, predicted, detected))
}

/// z → z₀ + d + m (z − z₀) with complex m = s e^{iθ}, as (re, im).
#[derive(Debug, Clone, Copy)]
struct Motion {
    d: (f64, f64),
    m: (f64, f64),
}

impl Motion {
    fn apply(&self, centre: (f64, f64), p: (f64, f64)) -> [f64; 2] {
        let (u, v) = (p.0 - centre.0, p.1 - centre.1);
        let (x, y) = (self.m.0 * u - self.m.1 * v, self.m.1 * u + self.m.0 * v);
        [centre.0 + self.d.0 + x, centre.1 + self.d.1 + y]
    }
    fn shift(&self) -> f64 {
        self.d.0.hypot(self.d.1)
    }
    fn turn(&self) -> f64 {
        self.m.1.atan2(self.m.0)
    }
    fn scale(&self) -> f64 {
        self.m.0.hypot(self.m.1)
    }

    /// The final pairs over the complete lists: nearest both ways, ambiguous ones dropped.
    fn alignment(&self, field: &Field, predicted: &[(f64, f64)], detected: &[(f64, f64)]) -> Alignment {
        let tree = |points: Vec<([f64; 2], usize)>| {
            RTree::bulk_load(
                points
                    .into_iter()
                    .filter(|(p, _)| p.iter().all(|v| v.is_finite()))
                    .map(|(p, i)| Point::new(p, i))
                    .collect(),
            )
        };
        let moved: Vec<[f64; 2]> = predicted.iter().map(|p| self.apply(field.centre, *p)).collect();
        let sky = tree(moved.iter().copied().enumerate().map(|(i, p)| (p, i)).collect());
        let frame = tree(detected.iter().enumerate().map(|(i, p)| ([p.0, p.1], i)).collect());
        let r2 = field.radius * field.radius;
        let mut pairs = Vec::new();
        let mut sum2 = 0.0;
        for (i, p) in moved.iter().enumerate().filter(|(_, p)| p.iter().all(|v| v.is_finite())) {
            let mut near = frame.locate_within_distance(*p, r2);
            let (Some(star), None) = (near.next(), near.next()) else { continue };
            if sky.locate_within_distance(*star.geom(), r2).count() == 1 {
                pairs.push((i, star.data));
                sum2 += (star.geom()[0] - p[0]).powi(2) + (star.geom()[1] - p[1]).powi(2);
            }
        }
        Alignment {
            dx_px: self.d.0,
            dy_px: self.d.1,
            rotation_rad: self.turn(),
            scale: self.scale(),
            x0: field.centre.0,
            y0: field.centre.1,
            n: pairs.len(),
            rms_px: if pairs.is_empty() { 0.0 } else { (sum2 / pairs.len() as f64).sqrt() },
            pairs,
        }
    }
}

type Point = GeomWithData<[f64; 2], usize>;
/// (index of predicted, index of detected, distance \[px\]).
type Match = (usize, usize, f64);
/// (length, first, second).
type Pair = (f64, (f64, f64), (f64, f64));

/// Both lists, with the index that searches them.
struct Field {
    predicted: Vec<(f64, f64)>,
    detected: Vec<(f64, f64)>,
    tree: RTree<Point>,
    centre: (f64, f64),
    radius: f64,
    /// Smallest and largest x, y of the detections.
    bounds: [f64; 4],
}

impl Field {
    fn new(predicted: Vec<(f64, f64)>, detected: Vec<(f64, f64)>, radius: f64) -> Field {
        let n = predicted.len() as f64;
        let centre = (predicted.iter().map(|p| p.0).sum::<f64>() / n, predicted.iter().map(|p| p.1).sum::<f64>() / n);
        let bounds =
            detected.iter().fold([f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY], |b, p| {
                [b[0].min(p.0), b[1].min(p.1), b[2].max(p.0), b[3].max(p.1)]
            });
        let tree = RTree::bulk_load(detected.iter().enumerate().map(|(i, p)| Point::new([p.0, p.1], i)).collect());
        Field { predicted, detected, tree, centre, radius, bounds }
    }

    /// One hypothesis per (predicted, detected) within the search radius: a shift.
    fn shifts(&self, search: f64) -> Vec<Motion> {
        let mut seeds = Vec::new();
        for p in self.predicted.iter().take(VOTERS) {
            for q in self.detected.iter().take(VOTERS) {
                let d = (q.0 - p.0, q.1 - p.1);
                if d.0.hypot(d.1) <= search {
                    seeds.push(Motion { d, m: (1.0, 0.0) });
                }
            }
        }
        seeds
    }

    /// One hypothesis per pair of pairs of equal length and direction: shift, rotation, scale.
    fn turns(&self, search: f64) -> Vec<Motion> {
        let sky = long_pairs(&self.predicted, 8.0 * self.radius);
        let frame = long_pairs(&self.detected, 8.0 * self.radius);
        let mut seeds = Vec::new();
        for (length, p, q) in &sky {
            let low = frame.partition_point(|f| f.0 < length * (1.0 - MAX_SCALE_ERR));
            for (other, a, b) in frame[low..].iter().take_while(|f| f.0 <= length * (1.0 + MAX_SCALE_ERR)) {
                // m = (b − a) / (q − p); both orders of the pair are in the list of the frame
                let (u, v) = ((q.0 - p.0, q.1 - p.1), (b.0 - a.0, b.1 - a.1));
                let l2 = length * length;
                let m = ((v.0 * u.0 + v.1 * u.1) / l2, (v.1 * u.0 - v.0 * u.1) / l2);
                for (m, a) in [(m, a), ((-m.0, -m.1), b)] {
                    if m.1.atan2(m.0).abs() > MAX_ROTATION_RAD {
                        continue;
                    }
                    // the shift at the centre: a + m (z₀ − p) − z₀
                    let still = Motion { d: (0.0, 0.0), m };
                    let c = still.apply(self.centre, *p);
                    let d = (a.0 - c[0], a.1 - c[1]);
                    if d.0.hypot(d.1) <= search * 1.1 && (other / length - 1.0).abs() <= MAX_SCALE_ERR {
                        seeds.push(Motion { d, m });
                    }
                }
            }
        }
        seeds
    }

    /// The hypotheses with the most others in their bin of shift and rotation, at most [`JUDGED`].
    fn elect(&self, seeds: &[Motion]) -> Vec<Motion> {
        let size = (2.0 * self.radius).max(4.0);
        let bin = |s: &Motion| {
            let cell = |v: f64, size: f64| (v / size).floor() as i64;
            (cell(s.d.0, size), cell(s.d.1, size), cell(s.turn(), 0.004))
        };
        let mut votes: HashMap<(i64, i64, i64), usize> = HashMap::new();
        for s in seeds {
            *votes.entry(bin(s)).or_default() += 1;
        }
        let around = |(x, y, r): (i64, i64, i64)| {
            let mut n = 0;
            for i in -1..=1 {
                for j in -1..=1 {
                    for k in -1..=1 {
                        n += votes.get(&(x + i, y + j, r + k)).copied().unwrap_or(0);
                    }
                }
            }
            n
        };
        let mut ranked: Vec<(usize, usize)> = seeds.iter().enumerate().map(|(i, s)| (around(bin(s)), i)).collect();
        ranked.sort_by_key(|(n, i)| (std::cmp::Reverse(*n), *i));
        // one of each bin is enough
        let mut seen = std::collections::HashSet::new();
        ranked.iter().map(|(_, i)| seeds[*i]).filter(|s| seen.insert(bin(s))).take(JUDGED).collect()
    }

    /// The hypotheses that bring the most stars together, at most [`REFINED`].
    fn judged(&self, seeds: Vec<Motion>) -> Vec<Motion> {
        let mut ranked: Vec<(usize, f64, usize)> = Vec::new();
        for (i, seed) in seeds.iter().enumerate() {
            let found = self.matches(seed, self.radius, JUDGES);
            ranked.push((found.len(), found.iter().map(|m| m.2).sum(), i));
        }
        ranked.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        ranked.iter().take(REFINED).map(|r| seeds[r.2]).collect()
    }

    /// Nearest detections within `radius` of the judges under `motion`, one detection to one star.
    fn matches(&self, motion: &Motion, radius: f64, judges: usize) -> Vec<Match> {
        let mut nearest: HashMap<usize, (usize, f64)> = HashMap::new();
        for (i, p) in self.predicted.iter().take(judges).enumerate() {
            let at = motion.apply(self.centre, *p);
            // of most hypotheses no star is near
            let near =
                self.tree.locate_within_distance(at, radius * radius).map(|star| (star.distance_2(&at), star.data));
            let Some((d2, star)) = near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))) else { continue };
            if nearest.get(&star).is_none_or(|(_, other)| d2 < *other) {
                nearest.insert(star, (i, d2));
            }
        }
        let mut out: Vec<Match> = nearest.into_iter().map(|(q, (p, d2))| (p, q, d2.sqrt())).collect();
        out.sort_by_key(|m| m.0);
        out
    }

    /// Least squares on the matched stars, the radius shrinking to four times their scatter.
    fn refined(&self, seed: Motion) -> Motion {
        let mut motion = seed;
        let mut radius = self.radius * 2.0;
        for _ in 0..12 {
            let found = self.matches(&motion, radius, usize::MAX);
            if found.len() < 2 {
                break;
            }
            let Some(next) = self.similarity(&found) else { break };
            motion = next;
            let mut r: Vec<f64> = self.matches(&motion, radius, usize::MAX).iter().map(|m| m.2).collect();
            r.sort_by(f64::total_cmp);
            let median = r.get(r.len() / 2).copied().unwrap_or(radius);
            // the median of a Rayleigh distribution is 1.18 σ
            radius = (4.0 * median / 1.18).clamp(0.05 * self.radius, self.radius).min(radius);
        }
        motion
    }

    /// m = Σ conj(u) v / Σ |u|²; a plain shift from fewer than three stars or where the scale runs away.
    fn similarity(&self, found: &[Match]) -> Option<Motion> {
        let n = found.len() as f64;
        let add = |a: (f64, f64), b: (f64, f64)| (a.0 + b.0 / n, a.1 + b.1 / n);
        let pc = found.iter().map(|m| self.predicted[m.0]).fold((0.0, 0.0), add);
        let qc = found.iter().map(|m| self.detected[m.1]).fold((0.0, 0.0), add);
        let (mut re, mut im, mut norm) = (0.0, 0.0, 0.0);
        for (i, j, _) in found {
            let (p, q) = (self.predicted[*i], self.detected[*j]);
            let (u, v) = ((p.0 - pc.0, p.1 - pc.1), (q.0 - qc.0, q.1 - qc.1));
            re += u.0 * v.0 + u.1 * v.1;
            im += u.0 * v.1 - u.1 * v.0;
            norm += u.0 * u.0 + u.1 * u.1;
        }
        let mut m = if found.len() >= 3 && norm > 0.0 { (re / norm, im / norm) } else { (1.0, 0.0) };
        let scale = m.0.hypot(m.1);
        if scale <= 0.0 || !scale.is_finite() {
            return None;
        }
        let held = scale.clamp(1.0 - MAX_SCALE_ERR, 1.0 + MAX_SCALE_ERR);
        m = (m.0 / scale * held, m.1 / scale * held);
        let c = Motion { d: (0.0, 0.0), m }.apply(self.centre, pc);
        Some(Motion { d: (qc.0 - c[0], qc.1 - c[1]), m })
    }

    /// Probability that chance brings as many stars together, for the most significant of a few radii, and the rms
    /// distance.
    ///
    /// P = h · Σ_{j ≥ k − f} Binom(n − f, p)(j), p = N π r² / area; f stars are met by construction, h counts the
    /// hypotheses and radii tried.
    fn chance(&self, motion: &Motion, forced: u64, n_hypotheses: usize) -> (f64, f64) {
        let found = self.matches(motion, self.radius, usize::MAX);
        let [x0, y0, x1, y1] = self.bounds;
        let r = self.radius;
        let seen = self.predicted.iter().filter(|p| {
            let at = motion.apply(self.centre, **p);
            at[0] >= x0 - r && at[0] <= x1 + r && at[1] >= y0 - r && at[1] <= y1 + r
        });
        let n = (seen.count() as u64).max(found.len() as u64);
        let area = (x1 - x0 + 2.0 * r) * (y1 - y0 + 2.0 * r);
        let mut best = 1.0_f64;
        let radii: Vec<f64> = (0..6).map(|i| self.radius * 0.5_f64.powi(i)).collect();
        for radius in &radii {
            let k = found.iter().filter(|m| m.2 <= *radius).count() as u64;
            let p = (self.detected.len() as f64 * std::f64::consts::PI * radius * radius / area).min(1.0);
            if k <= forced {
                continue;
            }
            if let Ok(binomial) = Binomial::new(p, n - forced) {
                best = best.min(binomial.sf(k - forced - 1) * (n_hypotheses.max(1) * radii.len()) as f64);
            }
        }
        let rms = (found.iter().map(|m| m.2 * m.2).sum::<f64>() / found.len().max(1) as f64).sqrt();
        (best, rms)
    }
}

/// (length, first, second) of the pairs of the brightest points longer than `shortest`, by length.
fn long_pairs(points: &[(f64, f64)], shortest: f64) -> Vec<Pair> {
    let voters = &points[..points.len().min(VOTERS)];
    let mut out = Vec::new();
    for (i, p) in voters.iter().enumerate() {
        for q in &voters[i + 1..] {
            let length = (q.0 - p.0).hypot(q.1 - p.1);
            if length > shortest {
                out.push((length, *p, *q));
            }
        }
    }
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    out
}

#[cfg(test)]
#[path = "align_tests.rs"]
mod tests;
