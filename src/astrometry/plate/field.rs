//! What is matched: the catalogue about the hint on a tangent plane \[arcsec\], the detections about the frame's centre \[px\].
//!
//! A star's rank is the number of brighter stars within a circle of the frame's area about it: the same in a crowded and
//! in an empty part of the sky, and comparable with the rank of a detection among those of the frame.

use super::grid::Grid;
use super::problem::Detection;
use super::problem::Hint;
use super::problem::Refusal;
use super::problem::SkyStar;
use crate::astrometry::wcs::Wcs;

/// Stars up to this rank judge a hypothesis.
const JUDGE_RANK: usize = 150;
/// Detections that judge a hypothesis.
const JUDGE_DETECTIONS: usize = 100;
/// Detections closer than this to a brighter one are that one again \[px\].
pub(super) const DUPLICATE_PX: f64 = 3.0;
/// Entries closer than this to a brighter one are that one again, or a pair no camera splits \[arcsec\].
pub(super) const SAME_STAR_ARCSEC: f64 = 0.5;

/// A catalogue star near the hint.
#[derive(Debug, Clone, Copy)]
pub(super) struct Star {
    /// East and north of the hint on its tangent plane \[arcsec\].
    pub at: (f64, f64),
    /// Brighter stars within a circle of the frame's area.
    pub rank: usize,
}

/// Both lists, ready to be matched.
#[derive(Debug)]
pub(super) struct Field {
    /// Size of the frame \[px\].
    pub size_px: (f64, f64),
    /// Stars of rank below [`JUDGE_RANK`], brightest first.
    pub stars: Vec<Star>,
    /// Their positions.
    pub sky: Grid,
    /// Positions from the frame's centre of the brightest detections, brightest first \[px\].
    pub detected: Vec<(f64, f64)>,
    /// Stars of the list in an area of the frame's size, on average over the part of the sky they cover.
    pub stars_per_frame: f64,
    /// How far the frame's centre may be from the hint \[arcsec\].
    pub radius_arcsec: f64,
    /// Scales looked for \[arcsec/px\].
    pub scales: (f64, f64),
    /// Which of direct (0) and conjugated (1) hypotheses are allowed.
    pub conjugate: [bool; 2],
    /// The tangent plane: pixels of one arcsecond, east along +x.
    pub plane: Wcs,
}

impl Field {
    /// Selects and projects.
    pub fn new(
        catalogue: &[SkyStar],
        detections: &[Detection],
        size_px: (usize, usize),
        hint: &Hint,
    ) -> Result<Field, Refusal> {
        let size = (size_px.0 as f64, size_px.1 as f64);
        let scales = (
            hint.scale_arcsec * (1.0 - hint.scale_search_frac.max(0.002)),
            hint.scale_arcsec * (1.0 + hint.scale_search_frac.max(0.002)),
        );
        let radius_arcsec = hint.radius_deg * 3600.0;
        let detected = detected(detections, size);
        if detected.len() < super::problem::MIN_MATCHED {
            return Err(Refusal::FewDetections { n: detected.len() });
        }
        let plane = Wcs::tan(hint.ra_deg, hint.dec_deg, 0.0, 0.0, 1.0, 0.0, true);
        let reach_arcsec = radius_arcsec + 0.5 * size.0.hypot(size.1) * scales.1;
        let frame_area = size.0 * size.1 * hint.scale_arcsec * hint.scale_arcsec;
        let near = near(catalogue, &plane, hint, reach_arcsec);
        let stars = ranked(near, (frame_area / std::f64::consts::PI).sqrt());
        if stars.len() < super::problem::MIN_MATCHED {
            return Err(Refusal::FewStars { n: stars.len(), radius_deg: reach_arcsec / 3600.0 });
        }
        let places: Vec<(f64, f64)> = stars.iter().map(|s| s.at).collect();
        let sky = Grid::new(&places, 0.02 * size.0.hypot(size.1) * hint.scale_arcsec);
        // the mean rank of n stars spread evenly over the sky is half their number in a frame's area
        let mean_rank = stars.iter().map(|s| s.rank as f64).sum::<f64>() / stars.len() as f64;
        let stars_per_frame = (2.0 * mean_rank).max(1.0);
        // on a plane with east along +x a frame that is not mirrored is conjugated
        let conjugate = [hint.mirrored != Some(false), hint.mirrored != Some(true)];
        Ok(Field { size_px: size, stars, sky, detected, stars_per_frame, radius_arcsec, scales, conjugate, plane })
    }
}

/// Detections on the frame, brightest first, each once.
fn detected(detections: &[Detection], size: (f64, f64)) -> Vec<(f64, f64)> {
    let on_frame =
        |d: &&Detection| d.x_px >= -1.0 && d.y_px >= -1.0 && d.x_px <= size.0 && d.y_px <= size.1 && !d.flux.is_nan();
    let mut bright: Vec<&Detection> = detections.iter().filter(on_frame).collect();
    bright.sort_by(|a, b| b.flux.total_cmp(&a.flux)); // stable: equal fluxes keep their order
    let mut detected: Vec<(f64, f64)> = Vec::with_capacity(JUDGE_DETECTIONS);
    for d in bright {
        // the centre of an image of n pixels is at (n − 1)/2
        let at = (d.x_px - 0.5 * (size.0 - 1.0), d.y_px - 0.5 * (size.1 - 1.0));
        if detected.iter().all(|s| (s.0 - at.0).hypot(s.1 - at.1) > DUPLICATE_PX) {
            detected.push(at);
        }
        if detected.len() == JUDGE_DETECTIONS {
            break;
        }
    }
    detected
}

/// Places on the plane of the stars within `reach_arcsec` of the hint, brightest first.
fn near(catalogue: &[SkyStar], plane: &Wcs, hint: &Hint, reach_arcsec: f64) -> Vec<(f64, f64)> {
    let reach_deg = reach_arcsec / 3600.0;
    let mut near: Vec<(usize, (f64, f64))> = catalogue
        .iter()
        .enumerate()
        // one subtraction spares the projection of most of a large catalogue
        .filter(|(_, s)| (s.dec_deg - hint.dec_deg).abs() <= 1.1 * reach_deg + 0.1 && !s.v_mag.is_nan())
        .filter_map(|(i, s)| Some((i, plane.sky_to_pixel(s.ra_deg, s.dec_deg)?)))
        .filter(|(_, p)| p.0.hypot(p.1) <= reach_arcsec)
        .collect();
    near.sort_by(|a, b| catalogue[a.0].v_mag.total_cmp(&catalogue[b.0].v_mag).then(a.0.cmp(&b.0)));
    near.into_iter().map(|n| n.1).collect()
}

/// Stars with their rank among those within `radius`, up to [`JUDGE_RANK`].
fn ranked(near: Vec<(f64, f64)>, radius: f64) -> Vec<Star> {
    let mut kept: Vec<Star> = Vec::new();
    let cell = |v: f64| (v / radius).floor() as i64;
    // brightest first, so whatever is in a cell already is brighter
    let mut cells: std::collections::HashMap<(i64, i64), Vec<usize>> = std::collections::HashMap::new();
    for at in near {
        let (cx, cy) = (cell(at.0), cell(at.1));
        let mut rank = 0;
        for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))) {
            for &other in cells.get(&(cx + i, cy + j)).into_iter().flatten() {
                let d = (kept[other].at.0 - at.0).hypot(kept[other].at.1 - at.1);
                if d < SAME_STAR_ARCSEC {
                    rank = JUDGE_RANK;
                }
                rank += usize::from(d <= radius);
            }
            if rank >= JUDGE_RANK {
                break;
            }
        }
        if rank < JUDGE_RANK {
            cells.entry((cx, cy)).or_default().push(kept.len());
            kept.push(Star { at, rank });
        }
    }
    kept
}
