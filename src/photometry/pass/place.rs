//! Where the target stands in the frames of a pass, by the frames that show it.
//!
//! Pixels of the full frame and seconds. A tracked target stands still up to errors of tracking and elements, which change
//! slowly: one place, or a straight line in time. It does not cover a target whose place jumps.

use crate::base::stats::{mad_sigma, median};

/// Fewest detections that agree on one place.
const FEWEST: usize = 3;
/// Fewest detections for a drift: two of them always lie on a line.
const FEWEST_FOR_DRIFT: usize = 5;
/// Detections further than this from the place are others' \[FWHM\].
const AGREE_FWHM: f64 = 2.0;
/// Least share of the detections that must agree.
const LEAST_SHARE: f64 = 0.6;
/// Most detections whose pairs give the drift; of more, an even selection.
const MOST_FOR_DRIFT: usize = 200;
/// A drift smaller than this many of its errors is none.
const DRIFT_SIGMA: f64 = 3.0;
/// Fewest offsets that refine a place.
const FEWEST_OFFSETS: usize = 5;
/// A jitter below this, which costs 2 % of the light, is none \[FWHM\] ...
const LEAST_JITTER_FWHM: f64 = 0.1;
/// ... unless its square is so many of its errors.
const JITTER_SIGMA: f64 = 2.5;
/// An offset is right only where the target is no further from the place than its own width: for a jitter up to this \[FWHM\].
const MOST_JITTER_FWHM: f64 = 0.4;

/// One detection of the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Time \[s\].
    pub t_s: f64,
    /// Column \[px\].
    pub x_px: f64,
    /// Row \[px\].
    pub y_px: f64,
    /// Error of each \[px\].
    pub err_px: f64,
}

/// The place of the target in the frames of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassPlace {
    /// Time at which it is (x, y) \[s\].
    pub t0_s: f64,
    /// Column then \[px\].
    pub x_px: f64,
    /// Row then \[px\].
    pub y_px: f64,
    /// Drift along columns and rows \[px/s\].
    pub drift_px_s: (f64, f64),
    /// Scatter of the target about it, per axis, beyond the error of the detections \[px\].
    pub jitter_px: f64,
    /// Parameters that were chosen for the largest stacked flux: none where detections gave the place.
    pub freedoms: usize,
}

impl PassPlace {
    /// The place at a time \[px\].
    #[must_use]
    pub fn at(&self, t_s: f64) -> (f64, f64) {
        let dt = t_s - self.t0_s;
        (self.x_px + self.drift_px_s.0 * dt, self.y_px + self.drift_px_s.1 * dt)
    }

    /// The place that most of the detections agree on; `None` where they are fewer than three, or do not agree.
    ///
    /// The drift is the median of the slopes of all pairs (Theil 1950, Sen 1968, J. Am. Stat. Assoc. 63, 1379), which a
    /// third of false detections does not move, the place the median of what is left.
    #[must_use]
    pub fn of_detections(detections: &[Detection], fwhm_px: f64) -> Option<Self> {
        if detections.len() < FEWEST {
            return None;
        }
        let mut times: Vec<f64> = detections.iter().map(|d| d.t_s).collect();
        let t0_s = median(&mut times)?;
        let still = Self::with_drift(detections, t0_s, (0.0, 0.0), fwhm_px);
        let drifting = (detections.len() >= FEWEST_FOR_DRIFT)
            .then(|| {
                let drift = (slope(detections, |d| d.x_px)?, slope(detections, |d| d.y_px)?);
                Self::with_drift(detections, t0_s, drift, fwhm_px)
            })
            .flatten();
        match (still, drifting) {
            // what scatters as little without a drift has none
            (Some((still, _)), Some((drifting, scatter))) if !drifting.is_significant(detections, scatter) => {
                Some(still)
            }
            (_, Some((drifting, _))) => Some(drifting),
            (still, None) => still.map(|(still, _)| still),
        }
    }

    /// Whether the target jitters by so much that the light at the place is a poor measure of it.
    #[must_use]
    pub fn is_loose(&self, fwhm_px: f64) -> bool {
        self.jitter_px > MOST_JITTER_FWHM * fwhm_px
    }

    /// The place moved by the median of offsets (dx, dy, their error \[px\]) of the target from it, and with its jitter, the
    /// scatter of the offsets per axis. As it is where the detections scatter by more than an offset can tell.
    #[must_use]
    pub fn refined(self, offsets: &[(f64, f64, f64)], fwhm_px: f64) -> Self {
        let near: Vec<&(f64, f64, f64)> = offsets.iter().filter(|o| o.0.hypot(o.1) < fwhm_px).collect();
        let middle = |of: fn(&(f64, f64, f64)) -> f64| median(&mut near.iter().map(|o| of(o)).collect::<Vec<_>>());
        let (Some(dx), Some(dy), Some(err2)) = (middle(|o| o.0), middle(|o| o.1), middle(|o| o.2 * o.2)) else {
            return self;
        };
        if near.len() < FEWEST_OFFSETS || self.is_loose(fwhm_px) {
            return self;
        }
        let mut about: Vec<f64> = near.iter().flat_map(|o| [o.0 - dx, o.1 - dy]).collect();
        let jitter_px = jitter_px(mad_sigma(&mut about).unwrap_or(0.0), about.len(), err2, fwhm_px);
        Self { x_px: self.x_px + dx, y_px: self.y_px + dy, jitter_px, ..self }
    }

    fn with_drift(detections: &[Detection], t0_s: f64, drift_px_s: (f64, f64), fwhm_px: f64) -> Option<(Self, f64)> {
        let left = |d: &Detection, of: f64, drift: f64| of - drift * (d.t_s - t0_s);
        let mut x: Vec<f64> = detections.iter().map(|d| left(d, d.x_px, drift_px_s.0)).collect();
        let mut y: Vec<f64> = detections.iter().map(|d| left(d, d.y_px, drift_px_s.1)).collect();
        let place =
            Self { t0_s, x_px: median(&mut x)?, y_px: median(&mut y)?, drift_px_s, jitter_px: 0.0, freedoms: 0 };
        let agreeing: Vec<&Detection> =
            detections.iter().filter(|d| place.distance_px(d) < AGREE_FWHM * fwhm_px).collect();
        let wanted = if detections.len() < FEWEST_FOR_DRIFT { 1.0 } else { LEAST_SHARE };
        if (agreeing.len() as f64) < (wanted * detections.len() as f64).max(FEWEST as f64) {
            return None;
        }
        let offset = |d: &&Detection| {
            let (x, y) = place.at(d.t_s);
            [d.x_px - x, d.y_px - y]
        };
        let mut offsets: Vec<f64> = agreeing.iter().flat_map(offset).collect();
        let scatter = mad_sigma(&mut offsets).unwrap_or(0.0);
        let err2 = median(&mut agreeing.iter().map(|d| d.err_px * d.err_px).collect::<Vec<_>>()).unwrap_or(0.0);
        Some((Self { jitter_px: jitter_px(scatter, offsets.len(), err2, fwhm_px), ..place }, scatter))
    }

    fn distance_px(&self, d: &Detection) -> f64 {
        let (x, y) = self.at(d.t_s);
        (d.x_px - x).hypot(d.y_px - y)
    }

    /// Whether the drift exceeds what the scatter of the detections \[px\] makes by chance.
    fn is_significant(&self, detections: &[Detection], scatter: f64) -> bool {
        let n = detections.len() as f64;
        let mean_t = detections.iter().map(|d| d.t_s).sum::<f64>() / n;
        let spread = (detections.iter().map(|d| (d.t_s - mean_t).powi(2)).sum::<f64>()).sqrt();
        self.drift_px_s.0.hypot(self.drift_px_s.1) * spread > DRIFT_SIGMA * scatter
    }
}

/// What the scatter of `n` offsets \[px\] is beyond errors of the variance `err2`; 0 where that is little and may be chance.
///
/// The scatter s is from the median of |offset|, whose variance is 1.36 s²/n: that of s² is 4 · 1.36 s⁴/n.
fn jitter_px(scatter: f64, n: usize, err2: f64, fwhm_px: f64) -> f64 {
    let jitter2 = (scatter * scatter - err2).max(0.0);
    let err_of_square = 2.0 * scatter * scatter * (1.36 / n as f64).sqrt();
    let is_clear = jitter2.sqrt() > LEAST_JITTER_FWHM * fwhm_px || jitter2 > JITTER_SIGMA * err_of_square;
    if is_clear { jitter2.sqrt() } else { 0.0 }
}

/// The median slope of the pairs of detections \[px/s\].
fn slope(detections: &[Detection], of: impl Fn(&Detection) -> f64) -> Option<f64> {
    let step = detections.len().div_ceil(MOST_FOR_DRIFT);
    let used: Vec<&Detection> = detections.iter().step_by(step).collect();
    let mut slopes = Vec::new();
    for (k, a) in used.iter().enumerate() {
        let of_pair = |b: &&Detection| (b.t_s != a.t_s).then(|| (of(b) - of(a)) / (b.t_s - a.t_s));
        slopes.extend(used[k + 1..].iter().filter_map(of_pair));
    }
    median(&mut slopes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn detections(n: usize, drift: f64, scatter: f64, every_other_false: usize) -> Vec<Detection> {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        (0..n)
            .map(|k| {
                let t_s = k as f64;
                let other = every_other_false > 0 && k % every_other_false == 1;
                let (dx, dy) = if other { (80.0 * random(), 80.0 * random()) } else { (0.0, 0.0) };
                let noise = scatter * 12f64.sqrt();
                let (x_px, y_px) = (100.0 + drift * t_s + dx + noise * random(), 50.0 + dy + noise * random());
                Detection { t_s, x_px, y_px, err_px: scatter }
            })
            .collect()
    }

    #[test]
    fn a_still_place_a_drift_and_a_third_of_false_detections_are_recovered() {
        let still = PassPlace::of_detections(&detections(30, 0.0, 0.1, 0), 4.0).unwrap();
        assert!((still.x_px - 100.0).hypot(still.y_px - 50.0) < 0.1 && still.drift_px_s == (0.0, 0.0), "{still:?}");
        for every in [0, 3] {
            let p = PassPlace::of_detections(&detections(60, 0.2, 0.1, every), 4.0).unwrap();
            let (x, y) = p.at(59.0);
            assert!((x - 111.8).hypot(y - 50.0) < 0.3, "{every}: {p:?}");
        }
    }

    #[test]
    fn offsets_move_the_place_and_their_scatter_beyond_their_errors_is_the_jitter() {
        let place = PassPlace::of_detections(&detections(30, 0.0, 0.1, 0), 4.0).unwrap();
        let offsets = |scatter: f64, err: f64| -> Vec<(f64, f64, f64)> {
            let of = |d: &Detection| (d.x_px - 100.0 + 0.5, d.y_px - 50.0, err);
            detections(300, 0.0, scatter, 0).iter().map(of).collect()
        };
        // an even distribution: its MAD is 1.28 sigma, the error of the median of 300 is sqrt(3 / 300) = 0.1; four of them
        let jittering = place.refined(&offsets(1.0, 0.1), 4.0);
        assert!((jittering.jitter_px - 1.28).abs() < 0.2, "{jittering:?}");
        assert!((jittering.x_px - place.x_px - 0.5).abs() < 0.4, "{jittering:?} {place:?}");
        assert_eq!(place.refined(&offsets(0.3, 0.4), 4.0).jitter_px, 0.0);
        assert_eq!(place.refined(&offsets(1.0, 0.1)[..4], 4.0), place);
    }

    #[test]
    fn detections_that_scatter_beyond_their_errors_give_the_jitter_and_others_none() {
        let jitter = |err_px: f64| {
            let of = |d: Detection| Detection { err_px, ..d };
            let all: Vec<Detection> = detections(300, 0.0, 1.0, 0).into_iter().map(of).collect();
            PassPlace::of_detections(&all, 4.0).unwrap().jitter_px
        };
        // an even distribution: its MAD is 1.28 sigma
        assert!((jitter(0.1) - 1.28).abs() < 0.15, "{}", jitter(0.1));
        assert_eq!(jitter(1.3), 0.0);
        // a twentieth of the FWHM is clear in 600 offsets whose error is half of it, and chance in ten, or where the error is as large
        assert!(jitter_px(0.21, 600, 0.01, 4.0) > 0.15);
        assert_eq!(jitter_px(0.21, 10, 0.01, 4.0), 0.0);
        assert_eq!(jitter_px(0.21, 600, 0.04, 4.0), 0.0);
    }

    #[test]
    fn two_detections_or_scattered_ones_are_no_place() {
        assert!(PassPlace::of_detections(&detections(2, 0.0, 0.1, 0), 4.0).is_none());
        assert!(PassPlace::of_detections(&detections(12, 0.0, 30.0, 0), 4.0).is_none());
        assert!(PassPlace::of_detections(&detections(4, 0.0, 0.1, 3), 4.0).is_none());
    }
}
