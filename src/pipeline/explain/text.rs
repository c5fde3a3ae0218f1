//! What was skipped in scenes and frames, why, and what that saved: the text of `--explain`.
//!
//! CPU seconds and microseconds of this machine; so it is printed with the times of a run, never in a table of results.

use std::fmt::Write as _;

use serde::Serialize;

use crate::report::summary::text_table;

/// Runs of scenes that are named one by one.
const SHOWN_RUNS: usize = 3;

/// One kind of step, skipped in some of many scenes or frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// The light, surface, rows or stage.
    pub what: String,
    /// Why it is not needed.
    pub why: String,
    /// The scenes or frames: how many, of how many, and which.
    pub count: usize,
    /// Of so many.
    pub of: usize,
    /// Which.
    pub scenes: String,
    /// How many were computed all the same, to be timed.
    pub timed: usize,
    /// CPU time of one computed all the same \[µs\]; `None` where there is nothing to compute.
    pub each_us: Option<f64>,
    /// By how much the result changes at most with it \[mag\]; `None` if it is not part of the result.
    pub changes_mag: Option<f64>,
}

/// Everything that was skipped, and the cost of a scene with and without it.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Explanation {
    /// What was skipped, in the order of the scenes.
    pub items: Vec<LeftOut>,
    /// CPU time of one scene as it was computed \[µs\].
    pub scene_us: Option<f64>,
    /// CPU time of one scene with nothing skipped \[µs\].
    pub everything_us: Option<f64>,
    /// Largest difference of the two answers \[mag\].
    pub differs_mag: Option<f64>,
    /// Largest numerical error an answer states of itself \[mag\].
    pub stated_err_mag: Option<f64>,
    /// Scenes both were computed for.
    pub timed: usize,
}

impl LeftOut {
    /// CPU time it would have taken in all \[s\].
    #[must_use]
    pub fn saved_s(&self) -> Option<f64> {
        self.each_us.map(|us| 1e-6 * us * self.count as f64)
    }
}

impl Explanation {
    /// As it is printed.
    #[must_use]
    pub fn text(&self) -> String {
        if self.items.is_empty() {
            return "skipped: nothing\n".into();
        }
        let us = |us: Option<f64>| us.map_or("-".into(), micros);
        let seconds = |s: Option<f64>| s.map_or("-".into(), |s| format!("{:.3}", 1e3 * s));
        let mag = |m: Option<f64>| m.map_or("-".into(), magnitudes);
        let rows: Vec<Vec<String>> = self
            .items
            .iter()
            .map(|i| {
                vec![
                    i.what.clone(),
                    i.why.clone(),
                    format!("{} of {}", i.count, i.of),
                    i.scenes.clone(),
                    us(i.each_us),
                    seconds(i.saved_s()),
                    mag(i.changes_mag),
                ]
            })
            .collect();
        let head = ["skipped", "why", "how many", "which", "CPU us each", "saved ms", "changes mag"];
        let mut text = text_table(&head, &rows);
        let saved_s: f64 = self.items.iter().filter_map(LeftOut::saved_s).sum();
        let timed = self.items.iter().map(|i| i.timed).max().unwrap_or(0);
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "saved in all: {:.3} ms of CPU time on this machine; each kind was computed all the same for up to {timed} \
             samples, and \"changes mag\" is what it did to the answer there",
            1e3 * saved_s
        );
        if let (Some(with), Some(without), Some(differs)) = (self.scene_us, self.everything_us, self.differs_mag) {
            let _ = writeln!(
                text,
                "one scene: {} us as computed, {} us with nothing skipped; the answers of {} scenes differ by at most {} \
                 mag{}",
                micros(with),
                micros(without),
                self.timed,
                magnitudes(differs),
                self.stated_err_mag.map_or(String::new(), |e| format!(", their stated error is {e:.1e} mag at most")),
            );
        }
        text
    }
}

/// Microseconds with three digits.
fn micros(us: f64) -> String {
    match us {
        us if us < 10.0 => format!("{us:.2}"),
        us if us < 100.0 => format!("{us:.1}"),
        us => format!("{us:.0}"),
    }
}

/// A change of magnitude; without bound where there was no light before.
fn magnitudes(mag: f64) -> String {
    match mag {
        0.0 => "0".into(),
        mag if mag.is_finite() => format!("{mag:.1e}"),
        _ => "no light without it".into(),
    }
}

/// Which of the labelled scenes: runs of neighbours as "from to", at most `SHOWN_RUNS` of them; `indices` rise.
#[must_use]
pub fn runs(indices: &[usize], labels: &dyn Fn(usize) -> String) -> String {
    let mut ends: Vec<(usize, usize)> = Vec::new();
    for &i in indices {
        match ends.last_mut() {
            Some((_, last)) if *last + 1 == i => *last = i,
            _ => ends.push((i, i)),
        }
    }
    let one = |(a, b): &(usize, usize)| if a == b { labels(*a) } else { format!("{} to {}", labels(*a), labels(*b)) };
    let mut text: Vec<String> = ends.iter().take(SHOWN_RUNS).map(one).collect();
    if ends.len() > SHOWN_RUNS {
        text.push(format!("{} more runs", ends.len() - SHOWN_RUNS));
    }
    text.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_reported_as_runs_and_many_runs_are_counted() {
        let label = |i: usize| format!("s{i}");
        assert_eq!(runs(&[0, 1, 2, 5], &label), "s0 to s2, s5");
        assert_eq!(runs(&[0, 2, 4, 6, 8], &label), "s0, s2, s4, 2 more runs");
        assert_eq!(runs(&[], &label), "");
    }

    #[test]
    fn the_text_names_every_item_with_its_reason_its_time_and_its_effect() {
        let piece = LeftOut {
            what: "moon".into(),
            why: "below the satellite's horizon".into(),
            count: 3,
            of: 4,
            scenes: "s0 to s2".into(),
            timed: 3,
            each_us: Some(20.0),
            changes_mag: Some(0.0),
        };
        let text = Explanation { items: vec![piece], ..Explanation::default() }.text();
        for word in ["moon", "below the satellite's horizon", "3 of 4", "s0 to s2", "20.0", "0.060"] {
            assert!(text.contains(word), "{word}: {text}");
        }
        assert_eq!(Explanation::default().text(), "skipped: nothing\n");
    }
}
