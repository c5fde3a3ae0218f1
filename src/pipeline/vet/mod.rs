//! What the observer's eye did: verdict and reasons of a frame, by itself and among its neighbours.
//!
//! A verdict is the worst of its findings; every finding sets its flag and says in words what was seen, with the number
//! and, where there is one, the threshold of `[vetting]`. What could not be measured is not judged. Leaves out: the
//! measurements themselves, which are columns by now.

mod cadence;
mod frame;
mod neighbours;
mod size;
mod sky;

use super::target::outcome::TargetFrame;
use crate::config::{Config, Vetting};
use crate::photometry::Flags;
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};

/// Flags that make a frame one to be cautious with, or to reject. The others inform: of a trail that was taken off, a
/// flat that is missing for the whole night, the age of the zeropoint. Old elements spoil what is computed from them,
/// not a measured magnitude: they decide where nothing was measured.
pub const DECIDING: Flags = Flags(
    Flags::SATURATED.0
        | Flags::MASKED.0
        | Flags::EDGE.0
        | Flags::CLIP_EDGE.0
        | Flags::NEGATIVE.0
        | Flags::NO_ANNULUS.0
        | Flags::TIME_UNCERTAIN.0
        | Flags::CONTAMINATED.0
        | Flags::SMEARED.0
        | Flags::VIGNETTED.0
        | Flags::HIT.0
        | Flags::LOWER_LIMIT.0
        | Flags::EXPTIME_DOUBTED.0
        | Flags::LOW_ALTITUDE.0,
);

/// The verdict of a row so far: one that says none is to be used.
fn verdict_of(row: &PhotometryRow) -> Verdict {
    Verdict::from_cell(&row.verdict).unwrap_or(Verdict::Use)
}

/// One thing wrong with a frame.
#[derive(Debug, Clone, PartialEq)]
struct Finding {
    verdict: Verdict,
    flags: Flags,
    words: String,
}

impl Finding {
    fn caution(flags: Flags, words: String) -> Self {
        Self { verdict: Verdict::Caution, flags, words }
    }
}

/// The verdict of one frame by itself: status, flags and columns against the thresholds.
///
/// Words are added to the reason, the worst first. A frame that failed keeps its reason alone.
pub fn judge(row: &mut PhotometryRow, thresholds: &Vetting) {
    if matches!(Status::from_cell(&row.status), Some(Status::Failed | Status::Rejected)) {
        row.verdict = Verdict::Reject.into();
        return;
    }
    row.verdict = Verdict::Use.into();
    let mut found = frame::findings(row, thresholds);
    found.sort_by_key(|f| std::cmp::Reverse(f.verdict)); // stable
    for finding in found {
        add(row, finding);
    }
}

/// A flux without a magnitude is nothing to use as it is; the reason says already what is missing.
pub fn without_magnitude(row: &mut PhotometryRow) {
    if row.status == Status::Ok && row.v_mag.is_none() {
        row.verdict = verdict_of(row).max(Verdict::Caution).into();
    }
}

/// What only the frames before and after a frame tell: cadence against EXPTIME, the level and shape of the background,
/// the size of the target. Fills `cadence_s`.
///
/// Frames of one target are taken in order of time; failed ones count for the cadence and are left as they are. The
/// result does not depend on the order of `frames`.
pub fn judge_night(frames: &mut [TargetFrame], config: &Config) {
    let thresholds = &config.vetting;
    for target in neighbours::targets(frames) {
        cadence::fill(frames, &target);
        for pass in neighbours::passes(frames, &target) {
            let rows: Vec<&PhotometryRow> = pass.iter().map(|i| &frames[*i].row).collect();
            let mut found = cadence::findings(&rows, thresholds);
            let doubted: Vec<usize> = found.iter().map(|(k, _)| *k).collect();
            found.extend(sky::findings(&rows, thresholds, &doubted));
            found.extend(size::findings(&rows, thresholds));
            found.sort_by_key(|(k, f)| (*k, std::cmp::Reverse(f.verdict))); // stable
            for (k, finding) in found {
                add(&mut frames[pass[k]].row, finding);
            }
        }
    }
}

/// Puts a finding into a row: the flag, the worse verdict, the words.
fn add(row: &mut PhotometryRow, finding: Finding) {
    if matches!(Status::from_cell(&row.status), Some(Status::Failed | Status::Rejected)) {
        return;
    }
    row.flags |= finding.flags.0;
    row.verdict = verdict_of(row).max(finding.verdict).into();
    if !row.reason.is_empty() {
        row.reason.push_str("; ");
    }
    row.reason.push_str(&finding.words);
}
