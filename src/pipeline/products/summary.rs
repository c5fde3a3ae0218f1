//! The night in numbers, and the text printed at its end.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use serde::Serialize;
use serde_json::json;

use crate::base::error::Error;
use crate::brightness::catalogue::Standing;
use crate::config::Config;
use crate::frames::Role;
use crate::photometry::Flags;
use crate::pipeline::explain::text::Explanation;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::vet::DECIDING;
use crate::report::summary::PassSummary;
use crate::tables::selection::is_lower_limit;
use crate::tables::selection::is_used;
use crate::tables::words::{Status, Verdict, flagged_frames};
use crate::tables::{PhotometryRow, StarRow};
use crate::zeropoint::fit::Zeropoint;

/// How many reasons the summary prints.
const SHOWN_WARNINGS: usize = 5;
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
    /// Of these, frames of another satellite.
    pub other_target: usize,
    /// Of these, frames of another filter.
    pub other_filter: usize,
    /// Files whose header could not be read.
    pub unreadable: usize,
    /// Frames that do not belong to the others: another camera, binning, size, focal length or read-out mode.
    pub set_aside: usize,
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
    /// Detections that only say "at least so bright".
    pub lower_limit: usize,
    /// Why measured target frames are used with caution or not at all: flags and how many of these frames have them.
    #[serde(rename = "doubts")]
    pub warnings: BTreeMap<&'static str, usize>,
    /// Frames excluded for a stated reason.
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
        let with = |status: Status| rows.iter().filter(|r| r.status == status).count();
        let judged = |verdict: Verdict| rows.iter().filter(|r| r.status == Status::Ok && r.verdict == verdict).count();
        Self {
            files: survey.len(),
            flats: survey.flats.len(),
            stars: survey.n_star_frames(),
            targets: survey.targets.len(),
            others: survey.others.len(),
            other_target: survey.n_aside(Role::OtherTarget),
            other_filter: survey.n_aside(Role::OtherFilter),
            unreadable: survey.unreadable.len(),
            set_aside: survey.set_aside.len(),
            science: survey.targets.len() + survey.n_star_frames() + survey.unreadable.len(),
            ok: with(Status::Ok),
            verdict_use: judged(Verdict::Use),
            verdict_caution: judged(Verdict::Caution),
            verdict_reject: judged(Verdict::Reject),
            nondetection: with(Status::Nondetection),
            lower_limit: rows.iter().filter(|r| is_used(&r.status, &r.verdict) && is_lower_limit(r.flags)).count(),
            warnings: warnings(rows),
            rejected: with(Status::Rejected),
            failed: with(Status::Failed),
            star_rows: stars.len(),
        }
    }

    /// Share of the science frames that failed.
    #[must_use]
    pub fn failed_frac(&self) -> f64 {
        self.failed as f64 / self.science.max(1) as f64
    }

    /// How many of the others are of another satellite or filter, in words; empty without any.
    fn aside_text(&self) -> String {
        let of =
            |n: usize, what: &str| if n > 0 { format!("; set aside: {n} of another {what}") } else { String::new() };
        of(self.other_target, "target") + &of(self.other_filter, "filter")
    }

    /// The reasons for caution and rejection, the most frequent first, and the lower limits; `None` without any.
    #[must_use]
    pub fn warnings_text(&self) -> Option<String> {
        let mut warnings: Vec<(&str, usize)> = self.warnings.iter().map(|(name, n)| (*name, *n)).collect();
        warnings.sort_by_key(|(name, n)| (std::cmp::Reverse(*n), *name));
        let mut parts: Vec<String> =
            warnings.iter().take(SHOWN_WARNINGS).map(|(name, n)| flagged_frames(name, *n as u64)).collect();
        if warnings.len() > SHOWN_WARNINGS {
            parts.push(format!("{} other reasons", warnings.len() - SHOWN_WARNINGS));
        }
        match self.lower_limit {
            0 => {}
            1 => parts.push("1 lower limit".into()),
            n => parts.push(format!("{n} lower limits")),
        }
        (!parts.is_empty()).then(|| parts.join(", "))
    }
}

/// How often each flag that decides a verdict occurs among measured frames that are not simply used.
fn warnings(rows: &[PhotometryRow]) -> BTreeMap<&'static str, usize> {
    let judged = |r: &&PhotometryRow| {
        matches!(Status::from_cell(&r.status), Some(Status::Ok | Status::Nondetection)) && r.verdict != Verdict::Use
    };
    // lower limits have a count of their own
    let is_counted = |row: &PhotometryRow, flag: Flags| {
        let decides = DECIDING.has(flag) || (flag == Flags::OLD_ELEMENTS && row.status == Status::Nondetection);
        decides && flag != Flags::LOWER_LIMIT
    };
    let mut warnings = BTreeMap::new();
    for row in rows.iter().filter(judged) {
        for (_, name) in Flags::NAMES.iter().filter(|(flag, _)| is_counted(row, *flag) && Flags(row.flags).has(*flag)) {
            *warnings.entry(*name).or_default() += 1;
        }
    }
    warnings
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
    /// The model the target is compared with, and what observations say of it.
    pub model: Option<ModelStanding>,
    /// The passes, a line each.
    pub passes: String,
    /// The same in numbers.
    pub pass_rows: Vec<PassSummary>,
    /// Failed and rejected frames: name, status, reason.
    pub failures: Vec<(String, String, String)>,
    /// Star and target frames kept from an earlier run, and of how many: nothing of the results depends on it.
    pub kept: (usize, usize),
    /// Notes about this night.
    pub notes: Vec<String>,
    /// What was measured on the way and needs no action; printed with `-v`, kept in the log and in manifest.json.
    pub details: Vec<String>,
    /// Columns that stay empty, and why.
    pub empty_columns: Vec<String>,
    /// What was skipped in frames and scenes and what that saved, if requested.
    pub explained: Option<Explanation>,
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
    /// What was kept from an earlier run, in words.
    #[must_use]
    pub fn kept_note(&self) -> Option<String> {
        let (kept, all) = self.kept;
        (kept > 0).then(|| format!("{kept} of {all} star and target frames kept from an earlier run"))
    }

    /// Every note, whether it needs action or not.
    pub fn all_notes(&self) -> impl Iterator<Item = String> {
        self.notes.iter().chain(&self.details).cloned().chain(self.kept_note())
    }

    /// The error of a night whose outputs are written but poor (exit code 3).
    #[must_use]
    pub fn poor_error(&self) -> Option<Error> {
        (!self.poor.is_empty()).then(|| Error::PoorNight { problem: self.poor.join("; ") })
    }

    /// The text printed at the end, without times: counts, warnings, zeropoint and passes, with the details of zeropoint
    /// and model.
    #[must_use]
    pub fn text(&self) -> String {
        self.lines(true)
    }

    /// The same without the details.
    #[must_use]
    pub fn brief(&self) -> String {
        self.lines(false)
    }

    fn lines(&self, details: bool) -> String {
        let c = &self.counts;
        let mut t = String::new();
        let _ = writeln!(t, "Night {}", self.night);
        let _ = write!(
            t,
            "Frames     {} files: {} flats, {} star, {} target, {} other, {} unreadable{}",
            c.files,
            c.flats,
            c.stars,
            c.targets,
            c.others,
            c.unreadable,
            c.aside_text()
        );
        if c.set_aside > 0 {
            let _ = write!(t, ", {} set aside", c.set_aside);
        }
        t.push('\n');
        let _ = writeln!(
            t,
            "Target     {} ok (verdict: {} use, {} caution, {} reject), {} nondetection; in all {} rejected, {} failed",
            c.ok, c.verdict_use, c.verdict_caution, c.verdict_reject, c.nondetection, c.rejected, c.failed
        );
        if let Some(warnings) = c.warnings_text() {
            let _ = writeln!(t, "Warnings   {warnings}");
        }
        for (frame, status, reason) in self.failures.iter().take(SHOWN_FAILURES) {
            // errors of files begin with the name of the file
            let reason = reason.strip_prefix(&format!("{frame}: ")).unwrap_or(reason);
            let _ = writeln!(t, "           {status}: {frame}: {reason}");
        }
        if self.failures.len() > SHOWN_FAILURES {
            let _ = writeln!(t, "           and {} more, in photometry.ecsv", self.failures.len() - SHOWN_FAILURES);
        }
        let zeropoint = zeropoint_text(self.zeropoint.as_ref(), &self.zeropoint_source);
        let model = self.model.as_ref().map(|m| if details { m.text() } else { m.brief() });
        t.extend(zeropoint.split_inclusive('\n').take(if details { usize::MAX } else { 1 }));
        if let Some(model) = model {
            let _ = writeln!(t, "Model      {model}");
        }
        t.push_str(&self.passes);
        t
    }

    /// The summary as one JSON object, for programs; the keys are those of the tables and of zeropoint.toml.
    #[must_use]
    pub fn json(&self) -> serde_json::Value {
        let zeropoint = self.zeropoint.as_ref().map(|z| {
            let err = |i: usize| z.cov[i][i].max(0.0).sqrt();
            json!({
                "band": z.band_name(), "zp_mag": z.zp_mag, "zp_mag_err": err(0), "k_mag_airmass": z.k_mag_airmass,
                "k_mag_airmass_err": err(1), "c_mag_mag": z.c_mag_mag, "c_mag_mag_err": err(2), "rms_mag": z.rms_mag,
                "n_used": z.n_used, "n_rejected": z.n_rejected, "source": self.zeropoint_source,
            })
        });
        let failures: Vec<_> = self
            .failures
            .iter()
            .map(|(frame, status, reason)| json!({ "frame": frame, "status": status, "reason": reason }))
            .collect();
        json!({
            "night": self.night, "folder": self.folder, "counts": self.counts, "warnings": self.counts.warnings,
            "failures": failures, "zeropoint": zeropoint, "model": self.model.as_ref().map(ModelStanding::text), "passes": self.pass_rows,
            "notes": self.notes, "details": self.details, "poor": self.poor, "elapsed_s": self.elapsed_s, "files": self.files,
        })
    }

    /// Time and speed.
    #[must_use]
    pub fn speed(&self) -> String {
        let mb = self.bytes as f64 / 1e6;
        let rate = if self.elapsed_s > 0.0 { mb / self.elapsed_s } else { 0.0 };
        format!("{:.1} s, {mb:.0} MB of frames, {rate:.0} MB/s", self.elapsed_s)
    }
}

/// The model of a target, and what observations say of it.
#[derive(Debug, Clone)]
pub struct ModelStanding {
    /// Name of the satellite whose model it is.
    pub satellite: String,
    /// Scatter about it, source, caveat.
    pub standing: Standing,
}

impl ModelStanding {
    /// The model of a configuration, where it has one.
    #[must_use]
    pub fn of(config: &Config) -> Option<Self> {
        let model = config.model.as_ref()?;
        Some(Self { satellite: model.satellite.clone(), standing: Standing::of(model).ok()? })
    }

    /// With the source of the scatter, and the caveat.
    #[must_use]
    pub fn text(&self) -> String {
        format!("{}: {}", self.satellite, self.standing.text())
    }

    /// The scatter alone.
    #[must_use]
    pub fn brief(&self) -> String {
        let scatter_alone = Standing { source: String::new(), caveat: String::new(), ..self.standing.clone() };
        format!("{}: {}", self.satellite, scatter_alone.text())
    }
}

/// The zeropoint in a few lines, the first of which is the result.
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
    if z.second_order() {
        let _ = writeln!(t, "           k2 {:.4} +- {:.4} ({})", z.k2_mag, err(3), z.k2_note);
    }
    let _ = writeln!(
        t,
        "           {}, {}_inst of e-/s; N {} used, {} outliers, rms {:.4} mag; {}",
        z.equation(),
        z.band_name(),
        z.n_used,
        z.n_rejected,
        z.rms_mag,
        source
    );
    if z.n_stars > 0 {
        let [zp, k, c] = z.multipliers_95();
        let words = z.n_words();
        let _ = writeln!(t, "           {words}; 95 %: the errors of ZP, k and C times {zp:.2}, {k:.2} and {c:.2}");
    }
    if z.pointing_scatter_mag.is_finite() {
        let chance = z.pointing_p_value.map(|p| format!(", p {p:.3} that they agree")).unwrap_or_default();
        let _ = writeln!(
            t,
            "           {} pointings scatter by {:.4} mag beyond their stars{chance}",
            z.n_pointings, z.pointing_scatter_mag
        );
    }
    let [b_v, b_v_err] = if z.target_b_v_mag[0].is_finite() { z.target_b_v_mag } else { [0.65, 0.0] };
    let _ = writeln!(
        t,
        "           error at X 1.5, {} {b_v:.2} +- {b_v_err}: {:.4} mag propagated, {:.4} as the paper adds it",
        z.colour_name(),
        z.err_mag(1.5, b_v, b_v_err),
        z.err_as_published_mag()
    );
    t
}
