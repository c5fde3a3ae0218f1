//! What one moment of a constellation comes to: counts, the brightest, a histogram whose quantiles are its medians.
//!
//! Magnitudes in steps of 0.02. Tallies add up: those of shards make the whole, exactly, in any order.

use super::constellation::Seen;
use super::larger;
use crate::brightness::light_sources::mag_of_flux;

/// Width of a step of the histogram \[mag\]: a quantile is off by half of it at most.
pub const STEP_MAG: f64 = 0.02;
/// Brightest and faintest step; beyond them everything is in the last.
const FROM_MAG: f64 = -30.0;
const STEPS: usize = 4500;

/// Counts of one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    /// Satellites computed.
    pub n_satellites: u64,
    /// Satellites whose elements fail.
    pub failed: u64,
    /// Above the horizon.
    pub above_horizon: u64,
    /// Above the altitude from which they count; all below is of these.
    pub above_min_alt: u64,
    /// Lit by anything.
    pub lit: u64,
    /// Lit by Sun, earthshine, Moon, lunar earthshine.
    pub lit_by: [u64; 4],
    /// Brighter than each of the magnitudes requested.
    pub brighter: Vec<u64>,
    /// V of the brightest and its number.
    pub brightest: Option<(f64, u64)>,
    /// Largest numerical error \[mag\].
    pub err_mag: f64,
    /// Largest error as a prediction \[mag\].
    pub pred_err_mag: Option<f64>,
    histogram: Vec<u64>,
}

impl Tally {
    /// Nothing yet, for so many magnitudes.
    #[must_use]
    pub fn new(magnitudes: usize) -> Self {
        Self {
            n_satellites: 0,
            failed: 0,
            above_horizon: 0,
            above_min_alt: 0,
            lit: 0,
            lit_by: [0; 4],
            brighter: vec![0; magnitudes],
            brightest: None,
            err_mag: 0.0,
            pred_err_mag: None,
            histogram: vec![0; STEPS],
        }
    }

    /// Counts a satellite above the horizon.
    pub fn count(&mut self, seen: &Seen, min_alt_rad: f64, magnitudes: &[f64]) {
        self.above_horizon += 1;
        if seen.alt_rad < min_alt_rad {
            return;
        }
        self.above_min_alt += 1;
        let Some(v_mag) = mag_of_flux(seen.lights.iter().sum()) else { return };
        self.lit += 1;
        for (count, (flux, too_faint)) in self.lit_by.iter_mut().zip(seen.lights.into_iter().zip(seen.too_faint)) {
            *count += u64::from(flux > 0.0 || too_faint);
        }
        for (count, limit) in self.brighter.iter_mut().zip(magnitudes) {
            *count += u64::from(v_mag < *limit);
        }
        self.brightest = brighter_of(self.brightest, Some((v_mag, seen.number)));
        self.err_mag = self.err_mag.max(seen.err_mag);
        self.pred_err_mag = larger(self.pred_err_mag, seen.pred_err_mag);
        let step = ((v_mag - FROM_MAG) / STEP_MAG).floor().clamp(0.0, (STEPS - 1) as f64) as usize;
        self.histogram[step] += 1;
    }

    /// Adds another part of the same moment.
    pub fn add(&mut self, other: &Tally) {
        self.n_satellites += other.n_satellites;
        self.failed += other.failed;
        self.above_horizon += other.above_horizon;
        self.above_min_alt += other.above_min_alt;
        self.lit += other.lit;
        for (a, b) in self.lit_by.iter_mut().zip(other.lit_by) {
            *a += b;
        }
        for (a, b) in self.brighter.iter_mut().zip(&other.brighter) {
            *a += b;
        }
        self.brightest = brighter_of(self.brightest, other.brightest);
        self.err_mag = self.err_mag.max(other.err_mag);
        self.pred_err_mag = larger(self.pred_err_mag, other.pred_err_mag);
        for (a, b) in self.histogram.iter_mut().zip(&other.histogram) {
            *a += b;
        }
    }

    /// V than which a share of the lit satellites is brighter: the middle of its step.
    #[must_use]
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let wanted = ((share * self.lit as f64).ceil() as u64).max(1);
        let mut sum = 0;
        let step = self.histogram.iter().position(|n| {
            sum += n;
            sum >= wanted
        })?;
        Some(FROM_MAG + STEP_MAG * (step as f64 + 0.5))
    }

    /// The steps that hold anything: `step:count` with blanks between; step 0 begins at V −30.
    #[must_use]
    pub fn histogram_text(&self) -> String {
        let held = self.histogram.iter().enumerate().filter(|(_, n)| **n > 0);
        held.map(|(step, n)| format!("{step}:{n}")).collect::<Vec<_>>().join(" ")
    }

    /// Reads what [`Tally::histogram_text`] wrote; `None` for anything else.
    #[must_use]
    pub fn with_histogram(mut self, text: &str) -> Option<Self> {
        for part in text.split_whitespace() {
            let (step, n) = part.split_once(':')?;
            *self.histogram.get_mut(step.parse::<usize>().ok()?)? += n.parse::<u64>().ok()?;
        }
        Some(self)
    }
}

/// The brighter of two; of equals the lower number.
fn brighter_of(a: Option<(f64, u64)>, b: Option<(f64, u64)>) -> Option<(f64, u64)> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.0 < a.0 || (b.0 == a.0 && b.1 < a.1) { b } else { a }),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brightness::light_sources::flux_of_mag;

    fn seen(number: u64, v_mag: Option<f64>, alt_rad: f64) -> Seen {
        let lights = [v_mag.map_or(0.0, flux_of_mag), 0.0, 0.0, 0.0];
        Seen {
            number,
            alt_rad,
            az_rad: 0.0,
            range_km: 600.0,
            lights,
            too_faint: [false; 4],
            err_mag: 1e-4,
            pred_err_mag: None,
        }
    }

    #[test]
    fn parts_add_up_to_the_whole_whatever_their_order() {
        let all: Vec<Seen> =
            (0..500).map(|i| seen(i, (i % 3 > 0).then(|| -3.0 + 0.05 * i as f64), 0.003 * i as f64)).collect();
        let tally = |which: &dyn Fn(u64) -> bool| {
            let mut t = Tally::new(2);
            all.iter().filter(|s| which(s.number)).for_each(|s| t.count(s, 0.5, &[5.0, 10.0]));
            t
        };
        let whole = tally(&|_| true);
        let mut sum = tally(&|n| n % 7 == 3);
        sum.add(&tally(&|n| n % 7 > 3));
        sum.add(&tally(&|n| n % 7 < 3));
        assert_eq!(sum, whole);
        assert!(whole.brighter[0] < whole.brighter[1] && whole.lit < whole.above_min_alt);
    }

    #[test]
    fn a_quantile_is_the_exact_one_to_half_a_step_and_nothing_lit_has_none() {
        let mut t = Tally::new(0);
        let v: Vec<f64> = (0..1000).map(|i| 4.0 + 0.007 * f64::from(i)).collect();
        v.iter().enumerate().for_each(|(i, v)| t.count(&seen(i as u64, Some(*v), 1.0), 0.0, &[]));
        for share in [0.16, 0.5, 0.84] {
            let exact = v[(share * 1000.0) as usize - 1];
            assert!((t.quantile(share).unwrap() - exact).abs() <= 0.5 * STEP_MAG + 1e-9, "{share}");
        }
        let back = Tally { histogram: vec![0; STEPS], ..t.clone() }.with_histogram(&t.histogram_text()).unwrap();
        assert_eq!(back, t);
        assert_eq!(Tally::new(0).quantile(0.5), None);
        assert!(Tally::new(0).with_histogram("a:b").is_none() && Tally::new(0).with_histogram("99999:1").is_none());
    }
}
