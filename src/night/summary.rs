//! The night in numbers, and the text printed at its end.

use std::fmt::Write as _;
use std::path::PathBuf;

use serde::Serialize;

use crate::error::Error;
use crate::night::survey::Survey;
use crate::photometry::zeropoint::Zeropoint;
use crate::report::{PhotometryRow, StarRow};

/// How many failures the summary prints.
const SHOWN_FAILURES: usize = 5;

/// Frames by kind and status.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Files found.
    pub files: usize,
    /// Flats.
    pub flats: usize,
    /// Star frames.
    pub stars: usize,
    /// Target frames.
    pub targets: usize,
    /// Bias, dark and ignored frames.
    pub others: usize,
    /// Files whose header could not be understood.
    pub unreadable: usize,
    /// Star, target and unreadable frames: those that can fail.
    pub science: usize,
    /// Target frames with a detection.
    pub ok: usize,
    /// Of these, with verdict `use`.
    pub verdict_use: usize,
    /// Of these, with verdict `caution`.
    pub verdict_caution: usize,
    /// Of these, with verdict `reject`.
    pub verdict_reject: usize,
    /// Target frames without one.
    pub nondetection: usize,
    /// Frames left out for a stated reason.
    pub rejected: usize,
    /// Frames that could not be reduced.
    pub failed: usize,
    /// Star measurements.
    pub star_rows: usize,
}

impl Counts {
    /// Counts of a finished night.
    #[must_use]
    pub fn of(survey: &Survey, rows: &[PhotometryRow], stars: &[StarRow]) -> Self {
        let with = |status: &str| rows.iter().filter(|r| r.status == status).count();
        let judged = |verdict: &str| rows.iter().filter(|r| r.status == "ok" && r.verdict == verdict).count();
        Self {
            files: survey.len(),
            flats: survey.flats.len(),
            stars: survey.n_star_frames(),
            targets: survey.targets.len(),
            others: survey.others.len(),
            unreadable: survey.unreadable.len(),
            science: survey.targets.len() + survey.n_star_frames() + survey.unreadable.len(),
            ok: with("ok"),
            verdict_use: judged("use"),
            verdict_caution: judged("caution"),
            verdict_reject: judged("reject"),
            nondetection: with("nondetection"),
            rejected: with("rejected"),
            failed: with("failed"),
            star_rows: stars.len(),
        }
    }

    /// Share of the science frames that failed.
    #[must_use]
    pub fn failed_frac(&self) -> f64 {
        self.failed as f64 / self.science.max(1) as f64
    }
}

/// The night in numbers.
#[derive(Debug, Clone)]
pub struct Summary {
    /// Name of the night.
    pub night: String,
    /// Folder of the results.
    pub folder: PathBuf,
    /// Frames by kind and status.
    pub counts: Counts,
    /// The zeropoint used.
    pub zeropoint: Option<Zeropoint>,
    /// Where it is from.
    pub zeropoint_source: String,
    /// The passes, a line each.
    pub passes: String,
    /// Failed and rejected frames: name, status, reason.
    pub failures: Vec<(String, String, String)>,
    /// What should be known about this night.
    pub notes: Vec<String>,
    /// Columns that stay empty, and why.
    pub empty_columns: Vec<String>,
    /// Why the night is not good enough for exit code 0.
    pub poor: Vec<String>,
    /// Bytes of the frames used.
    pub bytes: u64,
    /// Wall time \[s\].
    pub elapsed_s: f64,
    /// Files written.
    pub files: Vec<PathBuf>,
}

impl Summary {
    /// The error of a night whose outputs are written but poor (exit code 3).
    #[must_use]
    pub fn poor_error(&self) -> Option<Error> {
        (!self.poor.is_empty()).then(|| Error::PoorNight { problem: self.poor.join("; ") })
    }

    /// The text printed at the end, without times.
    #[must_use]
    pub fn text(&self) -> String {
        let c = &self.counts;
        let mut t = String::new();
        let _ = writeln!(t, "Night {}", self.night);
        let _ = writeln!(
            t,
            "Frames     {} files: {} flats, {} star, {} target, {} other, {} unreadable",
            c.files, c.flats, c.stars, c.targets, c.others, c.unreadable
        );
        let _ = writeln!(
            t,
            "Target     {} ok (verdict: {} use, {} caution, {} reject), {} nondetection; in all {} rejected, {} failed",
            c.ok, c.verdict_use, c.verdict_caution, c.verdict_reject, c.nondetection, c.rejected, c.failed
        );
        for (frame, status, reason) in self.failures.iter().take(SHOWN_FAILURES) {
            let _ = writeln!(t, "           {status}: {frame}: {reason}");
        }
        if self.failures.len() > SHOWN_FAILURES {
            let _ = writeln!(t, "           and {} more, in photometry.ecsv", self.failures.len() - SHOWN_FAILURES);
        }
        t.push_str(&zeropoint_text(self.zeropoint.as_ref(), &self.zeropoint_source));
        t.push_str(&self.passes);
        t
    }

    /// Time and speed.
    #[must_use]
    pub fn speed(&self) -> String {
        let mb = self.bytes as f64 / 1e6;
        let rate = if self.elapsed_s > 0.0 { mb / self.elapsed_s } else { 0.0 };
        format!("{:.1} s, {mb:.0} MB of frames, {rate:.0} MB/s", self.elapsed_s)
    }
}

/// The zeropoint in three lines.
#[must_use]
pub fn zeropoint_text(zeropoint: Option<&Zeropoint>, source: &str) -> String {
    let mut t = String::new();
    let Some(z) = zeropoint else {
        return "Zeropoint  none: magnitudes stay instrumental\n".into();
    };
    let err = |i: usize| z.cov[i][i].max(0.0).sqrt();
    let _ = writeln!(
        t,
        "Zeropoint  ZP {:.4} +- {:.4}  k {:.4} +- {:.4} ({})  C {:.4} +- {:.4} ({})",
        z.zp_mag,
        err(0),
        z.k_mag_airmass,
        err(1),
        z.k_note,
        z.c_mag_mag,
        err(2),
        z.c_note
    );
    let _ = writeln!(
        t,
        "           V = V_inst - ZP - k X - C (B-V), V_inst of e-/s; N {} used, {} outliers, rms {:.4} mag; {}",
        z.n_used, z.n_rejected, z.rms_mag, source
    );
    let _ = writeln!(
        t,
        "           error at X 1.5, B-V 0.65: {:.4} mag propagated, {:.4} as the paper adds it",
        z.err_mag(1.5, 0.65, 0.0),
        z.err_as_published_mag()
    );
    t
}
