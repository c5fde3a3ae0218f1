//! A night of several satellites, filters and cameras: one reduction for each group of frames that belong together, and a
//! table and a report over all of them.
//!
//! A night of one kind is reduced as it is, into the folder of the night. Otherwise each group has a folder of its own in
//! it, complete with tables, report and manifest. A group that fails does not end the others.

mod by_position;
mod colour;
pub mod objects;
mod split;

use colour::{has_partner, target_colours};
pub use split::{Group, Split, model_of, split};

use std::path::PathBuf;

use crate::base::error::{Error, Result};
use crate::base::file::make_folder;
use crate::base::progress::Progress;
use crate::config::Config;
use crate::frames::Role;
use crate::pipeline::options::Options;
use crate::pipeline::products::lock::lock;
#[cfg(feature = "report")]
use crate::pipeline::products::page::write_campaign_report;
use crate::pipeline::products::summary::Summary;
use crate::pipeline::run::run;
use crate::tables::words::Status;
use crate::tables::{Meta, NightRow, UngroupedRow, write_rows};

/// A reduced group, or why it could not be.
#[derive(Debug)]
pub struct Reduced {
    /// Which frames these are.
    pub group: Group,
    /// The results.
    pub summary: Result<Summary>,
}

/// A reduced night.
#[derive(Debug)]
pub enum Night {
    /// A night of one kind.
    Single(Box<Summary>),
    /// A night of several groups.
    Groups(Groups),
}

/// A night of several groups.
#[derive(Debug)]
pub struct Groups {
    /// Folder of the night.
    pub folder: PathBuf,
    /// What should be known of the night as a whole.
    pub notes: Vec<String>,
    /// Each group, in the order of camera, satellite and filter.
    pub reduced: Vec<Reduced>,
    /// The files that belong to no group, with the reason.
    pub ungrouped: Vec<UngroupedRow>,
    /// Why the night as a whole is poor (exit code 3): too many files that belong to no group.
    pub poor: Option<String>,
    /// Files written over all groups.
    pub files: Vec<PathBuf>,
}

impl Groups {
    /// The groups one after another, as a run of each alone prints them, and the reason of each that failed.
    #[must_use]
    pub fn text(&self, verbose: bool) -> String {
        let one = |r: &Reduced| match &r.summary {
            Ok(summary) if verbose => summary.text(),
            Ok(summary) => summary.brief(),
            Err(error) => format!("Night {}\nFailed     {error}\n", r.group.config.night.name),
        };
        let mut text = self.reduced.iter().map(one).collect::<Vec<_>>().join("\n");
        if let Some(first) = self.ungrouped.iter().min_by_key(|row| (row.status != Status::Failed, &row.frame)) {
            let failed = self.ungrouped.iter().filter(|row| row.status == Status::Failed).count();
            text += &format!(
                "\nUngrouped  {} file{} of no group, {failed} cannot be read (ungrouped.ecsv); {}: {}\n",
                self.ungrouped.len(),
                if self.ungrouped.len() == 1 { "" } else { "s" },
                first.frame,
                first.reason
            );
        }
        text
    }

    /// The night as one JSON object: the summary of each group, or its error.
    #[must_use]
    pub fn json(&self) -> serde_json::Value {
        let one = |r: &Reduced| match &r.summary {
            Ok(summary) => summary.json(),
            Err(error) => serde_json::json!({ "night": r.group.config.night.name, "error": error.to_string() }),
        };
        serde_json::json!({
            "folder": self.folder, "notes": self.notes, "files": self.files,
            "groups": self.reduced.iter().map(one).collect::<Vec<_>>(), "ungrouped": self.ungrouped,
        })
    }

    /// The error of the night: the first of a group that failed or is poor, else that of the night as a whole.
    #[must_use]
    pub fn error(self) -> Option<Error> {
        let of_night = self.poor.map(|problem| Error::PoorNight { problem });
        let of_group = self.reduced.into_iter().find_map(|r| match r.summary {
            Ok(summary) => summary.poor_error().map(|e| match e {
                Error::PoorNight { problem } => Error::PoorNight { problem: format!("{}: {problem}", summary.night) },
                other => other,
            }),
            Err(error) => Some(error),
        });
        of_group.or(of_night)
    }
}

/// Reduces a night, whatever it holds.
///
/// # Errors
/// Those of [`run`] for a night of one kind. For one of several groups what stops the whole night: a folder that cannot be
/// made, a request to stop.
pub fn run_night(config: &Config, options: &Options, progress: &dyn Progress) -> Result<Night> {
    let Split { mut groups, mut notes, ungrouped, science } = split(config, &options.files, &options.stop)?;
    if groups.len() < 2 {
        let own = groups.pop().map(|group| group.config);
        let mut summary = run(own.as_ref().unwrap_or(config), options, progress)?;
        notes.append(&mut summary.notes);
        summary.notes = notes;
        return Ok(Night::Single(Box::new(summary)));
    }
    let folder = config.night.output.join(&config.night.name);
    make_folder(&folder)?;
    let _lock = lock(&folder)?;
    let stars_cache = Some(folder.join(".satphot-stars"));
    let own =
        |group: &Group| Options { files: group.files.clone(), stars_cache: stars_cache.clone(), ..options.clone() };
    let to_be_coloured: Vec<bool> = groups.iter().map(|group| has_partner(group, &groups)).collect();
    let mut reduced = Vec::new();
    for (group, waits) in groups.into_iter().zip(&to_be_coloured) {
        // figures of magnitudes that will change are drawn once they have
        let own = own(&group);
        let summary = run_group(&group, &Options { no_figures: own.no_figures || *waits, ..own }, progress)?;
        reduced.push(Reduced { group, summary });
    }
    let summaries: Vec<_> = reduced.iter().map(|r| (&r.group, r.summary.as_ref().ok())).collect();
    let colours = target_colours(&summaries);
    for ((reduced, colour), waits) in reduced.iter_mut().zip(colours).zip(to_be_coloured) {
        let zeropoint = &mut reduced.group.config.zeropoint;
        if let Some(colour) = &colour {
            (zeropoint.target_b_v_mag, zeropoint.target_b_v_err_mag) = (Some(colour.mag), Some(colour.err_mag));
            zeropoint.target_b_v_from = Some(colour.from.clone());
        }
        if colour.is_some() || (waits && !options.no_figures) {
            reduced.summary = run_group(&reduced.group, &own(&reduced.group), progress)?;
        }
    }
    let limit = if options.strict { 0.0 } else { config.night.max_failed_frac };
    let poor = too_many(&ungrouped, science, limit);
    let (table, left) = (folder.join("night.ecsv"), folder.join("ungrouped.ecsv"));
    let mut night = Groups { folder, notes, reduced, ungrouped, poor, files: Vec::new() };
    write_rows(&table, &night_rows(&night), &Meta::default())?;
    write_rows(&left, &night.ungrouped, &Meta::default())?;
    night.files.extend([table, left]);
    #[cfg(feature = "report")]
    if !options.no_figures {
        let folders: Vec<PathBuf> =
            night.reduced.iter().filter_map(|r| r.summary.as_ref().ok()).map(|s| s.folder.clone()).collect();
        if !folders.is_empty() {
            let page = night.folder.join("report.html");
            night.notes.extend(write_campaign_report(&folders, &page)?);
            night.files.push(page);
        }
    }
    Ok(Night::Groups(night))
}

/// Reduces a group; what stops the whole night is an error, what stops the group alone is its result.
fn run_group(group: &Group, options: &Options, progress: &dyn Progress) -> Result<Result<Summary>> {
    match run(&group.config, options, progress) {
        Err(stop @ (Error::Interrupted { .. } | Error::Temporary { .. })) => Err(stop),
        other => Ok(other),
    }
}

/// Why the night is poor, where more than the allowed share of its frames are target frames of no group or cannot be read.
fn too_many(ungrouped: &[UngroupedRow], science: usize, limit: f64) -> Option<String> {
    let is_lost = |row: &&UngroupedRow| row.status == Status::Failed || row.role == Role::Target.name();
    let lost = ungrouped.iter().filter(is_lost).count();
    (lost as f64 > limit * science as f64).then(|| {
        format!(
            "{lost} of {science} frames belong to no group (ungrouped.ecsv), more than the allowed share of {limit} \
             (night.max_failed_frac)"
        )
    })
}

/// A row per pass of each group; one that has none, or failed, is a row as well.
#[must_use]
pub fn night_rows(night: &Groups) -> Vec<NightRow> {
    night.reduced.iter().flat_map(rows_of).collect()
}

fn rows_of(reduced: &Reduced) -> Vec<NightRow> {
    let config = &reduced.group.config;
    let row = NightRow {
        group: config.night.name.clone(),
        object_name: reduced.group.satellite.clone(),
        norad_cat_id: config.orbit.as_ref().and_then(|o| o.norad_cat_id).and_then(|n| i64::try_from(n).ok()),
        instrument: config.detector.camera.clone(),
        band: reduced.group.filter.clone(),
        ..NightRow::default()
    };
    let summary = match &reduced.summary {
        Ok(summary) => summary,
        Err(error) => return vec![NightRow { reason: error.to_string(), ..row }],
    };
    let zeropoint = summary.zeropoint.as_ref();
    let row = NightRow {
        band: zeropoint.map_or(row.band, |z| z.band_name().to_owned()),
        zp_mag: zeropoint.map(|z| z.zp_mag),
        zp_mag_err: zeropoint.map(|z| z.cov[0][0].max(0.0).sqrt()),
        colour_index: zeropoint.map(|z| z.colour_name()).unwrap_or_default(),
        target_colour_mag: zeropoint.map(|z| z.target_b_v_mag[0]).filter(|c| c.is_finite()),
        target_colour_err_mag: zeropoint.map(|z| z.target_b_v_mag[1]).filter(|c| c.is_finite()),
        target_colour_from: zeropoint.map(|_| config.zeropoint.target_colour_from()).unwrap_or_default(),
        reason: summary.poor.join("; "),
        frames: summary.counts.targets as i64,
        ..row
    };
    if summary.pass_rows.is_empty() {
        return vec![row];
    }
    let pass = |p: &crate::report::summary::PassSummary| NightRow {
        object_name: p.object_name.clone(),
        pass: i64::try_from(p.pass).ok(),
        date_first: p.date_first.clone(),
        frames: p.frames as i64,
        used: p.used as i64,
        median_mag: p.median_mag,
        brightest_mag: p.brightest_mag,
        residual_mag: p.residual_mag,
        sigma_mag: p.sigma_mag,
        median_err_mag: p.median_err_mag,
        median_err_sys_mag: p.median_err_sys_mag,
        ..row.clone()
    };
    summary.pass_rows.iter().map(pass).collect()
}
