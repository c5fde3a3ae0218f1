//! Vetting: verdict and reasons of a frame, by itself and among its neighbours.
//!
//! A verdict is the worst of its findings; every finding sets its flag and says in words what was seen, with the number
//! and, where there is one, the threshold of `[vetting]`. What could not be measured is not judged. It does not cover the
//! measurements themselves, which are columns by now.

mod cadence;
mod frame;
mod neighbours;
mod place;
pub(crate) mod pointing;
mod size;
mod sky;

use crate::config::{Config, Vetting};
use crate::photometry::Flags;
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};

/// Flags that make a frame one to be cautious with, or to reject. The others inform: of a trail that was subtracted, a
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
        | Flags::LOW_ALTITUDE.0
        | Flags::CLOUD.0
        | Flags::UNCONFIRMED.0,
);

/// The verdict on a frame, and its reasons; of a frame by itself, and then of one among its neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// The worst of its findings.
    pub verdict: Verdict,
    /// Those of the measurement and of every finding.
    pub flags: Flags,
    /// What the row says already, then every finding.
    pub reason: String,
    /// Time since the frame of this target before \[s\].
    pub cadence_s: Option<f64>,
    /// The limit \[mag\].
    pub limit_v_mag: Option<f64>,
    /// Whether findings count: a frame that failed or was set aside keeps its reason alone.
    open: bool,
}

impl Judgement {
    /// What the row says of itself; a verdict that says none is to be used.
    #[must_use]
    pub fn of(row: &PhotometryRow) -> Self {
        Self {
            verdict: Verdict::from_cell(&row.verdict).unwrap_or(Verdict::Use),
            flags: Flags(row.flags),
            reason: row.reason.clone(),
            cadence_s: row.cadence_s,
            limit_v_mag: row.limit_v_mag,
            open: !matches!(Status::from_cell(&row.status), Some(Status::Failed | Status::Rejected)),
        }
    }

    /// The row it was made of, with what was judged.
    #[must_use]
    pub fn into_row(self, row: PhotometryRow) -> PhotometryRow {
        PhotometryRow {
            verdict: self.verdict.into(),
            flags: self.flags.0,
            reason: self.reason,
            cadence_s: self.cadence_s,
            limit_v_mag: self.limit_v_mag,
            ..row
        }
    }

    /// Adds a finding: the flag, the worse verdict, the words.
    fn add(&mut self, finding: Finding) {
        if !self.open {
            return;
        }
        self.flags = self.flags | finding.flags;
        self.verdict = self.verdict.max(finding.verdict);
        if !self.reason.is_empty() {
            self.reason.push_str("; ");
        }
        self.reason.push_str(&finding.words);
    }
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
#[must_use]
pub fn judge(row: &PhotometryRow, thresholds: &Vetting) -> Judgement {
    let mut judgement = Judgement::of(row);
    if !judgement.open {
        return Judgement { verdict: Verdict::Reject, ..judgement };
    }
    judgement.verdict = Verdict::Use;
    let mut found = frame::findings(row, thresholds);
    found.sort_by_key(|f| std::cmp::Reverse(f.verdict)); // stable
    found.into_iter().for_each(|finding| judgement.add(finding));
    judgement
}

/// A flux without a magnitude is nothing to use as it is; the reason says already what is missing.
#[must_use]
pub fn without_magnitude(row: &PhotometryRow, judgement: Judgement) -> Judgement {
    let least = if row.status == Status::Ok && row.v_mag.is_none() { Verdict::Caution } else { Verdict::Use };
    Judgement { verdict: judgement.verdict.max(least), ..judgement }
}

fn of_night<'a>(rows: &[&'a PhotometryRow], target: &[usize]) -> Vec<&'a PhotometryRow> {
    target.iter().map(|i| rows[*i]).collect()
}

/// What only the frames before and after a frame show: cadence against EXPTIME, the level and shape of the background,
/// the size and the place of the target. Each row has its judgement so far at the same place of `judgements`.
///
/// Frames of one target are taken in order of time; failed ones count for the cadence and are left as they are. The
/// result does not depend on the order of `rows`.
pub fn judge_neighbours(rows: &[&PhotometryRow], judgements: &mut [Judgement], config: &Config) {
    let thresholds = &config.vetting;
    for target in neighbours::targets(rows) {
        for (k, finding) in pointing::findings(&of_night(rows, &target)) {
            judgements[target[k]].add(finding);
        }
        for (i, cadence_s) in cadence::cadences(rows, &target) {
            judgements[i].cadence_s = Some(cadence_s);
        }
        let of_night = of_night(rows, &target);
        for pass in neighbours::passes(rows, &target) {
            let of_pass: Vec<&PhotometryRow> = pass.iter().map(|i| rows[*i]).collect();
            let mut found = cadence::findings(&of_pass, thresholds);
            let doubted: Vec<usize> = found.iter().map(|(k, _)| *k).collect();
            found.extend(sky::findings(&of_pass, thresholds, &doubted));
            found.extend(place::findings(&of_pass));
            found.extend(size::findings(&of_pass, &of_night, thresholds, config.target.margin_fwhm));
            found.sort_by_key(|(k, f)| (*k, std::cmp::Reverse(f.verdict))); // stable
            for (k, finding) in found {
                judgements[pass[k]].add(finding);
            }
        }
    }
}
