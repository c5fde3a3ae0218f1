//! The night as one sentence: survey, flat, star pointings, zeropoint, target frames, comparison, tables.

use super::options::Options;
use std::path::{Path, PathBuf};

use super::products::record::Stage;
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::base::file::make_folder;
use crate::base::progress::Progress;
use crate::base::threads::with_threads;
use crate::brightness::catalogue::Standing;
use crate::config::Config;
use crate::config::digest::config_sha256;
use crate::frames::Exposure;
use crate::frames::flat::FlatMember;
use crate::pipeline::compare::residual_rows;
use crate::pipeline::detector::checks::check as check_detector;
use crate::pipeline::detector::report::write_checks;
use crate::pipeline::explain::explain_night;
use crate::pipeline::prepared::Bench;
use crate::pipeline::products::lock::lock;
use crate::pipeline::products::manifest::Manifest;
use crate::pipeline::products::manifest::bytes_read;
use crate::pipeline::products::manifest::manifest_inputs;
use crate::pipeline::products::manifest::peak_memory_mb;
use crate::pipeline::products::manifest::record;
use crate::pipeline::products::outputs::Outputs;
use crate::pipeline::products::page::write_report_and_figures;
use crate::pipeline::products::provenance::Provenance;
use crate::pipeline::products::summary::{Counts, Summary};
use crate::pipeline::shards::plan_file::{FRAMES_PER_SHARD, Plan, set_copies_aside};
use crate::pipeline::shards::products::{FOLDER, Products};
use crate::pipeline::shards::whole::judge_whole_night;
use crate::pipeline::stages::master_flat;
use crate::pipeline::stages::target_stage;
use crate::pipeline::stars::stage::{StarStage, star_stage};
use crate::pipeline::survey::damage::damage_notes;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::survey::preflight::preflight;
use crate::pipeline::survey::scale::check_stars;
use crate::pipeline::target::frame::{failed_file_row, missing_parts, set_aside_row};
use crate::pipeline::target::pictures::pictures;
use crate::report::summary::pass_table;
use crate::tables::words::{Status, Verdict};
use crate::tables::{PhotometryRow, StarRow};
use crate::zeropoint::fit::Zeropoint;
use crate::zeropoint::previous::read_previous;
use crate::zeropoint::stars::fit_rows;

/// Reduces a whole night and writes its tables, figures and summary to `<output>/<name>/`.
///
/// # Errors
/// What must be there before work begins (exit codes 2, 4, 5). A failed frame is a row, never an error; a night whose
/// outputs are written but poor is told by [`Summary::poor`].
pub fn run(config: &Config, options: &Options, progress: &dyn Progress) -> Result<Summary> {
    let (mut bench, mut survey, found) = preflight(config, &options.files)?.ready()?;
    if options.everything {
        bench.compute_everything()?;
    }
    let short_of_memory = options.memory().check(&survey, &bench)?;
    let folder = config.night.output.join(&config.night.name);
    make_folder(&folder).map_err(|e| Error::NoInput {
        path: folder.clone(),
        problem: format!("the folder of the results cannot be made (night.output, -o): {e}"),
    })?;
    let held = lock(&folder)?;

    let products = Products::in_folder(folder.join(FOLDER), &bench, options.redo)?;

    let mut log = Log::new(progress);
    log.notes.extend(short_of_memory);
    log.notes.extend(found);
    log.notes.extend(log_set_aside(&survey));
    let scale = log.stage("scale", |_| check_stars(&survey, &bench, &products, options.jobs))?;
    log.notes.extend(scale);
    if survey.targets.is_empty() {
        log.notes.push(no_target(&survey, &bench));
    }
    let checks = log.stage("detector", |log| check_detector(&survey, &bench, &mut log.notes))?;
    let flat = folder.join("master_flat.fits");
    log.stage("flat", |log| {
        master_flat(&survey, &mut bench, (&products, Some(&flat)), options, progress, &mut log.notes)
    })?;
    let mut stars =
        log.stage("stars", |log| star_stage(&survey, &bench, &products, options, progress, &mut log.notes))?;
    (bench.fwhm_arcsec, bench.profile, bench.growth) = (stars.fwhm_arcsec, stars.profile, stars.growth.take());
    bench.camera_turn = stars.camera_turn;
    let mut star_rows = std::mem::take(&mut stars.rows);
    let mut poor = Vec::new();
    bench.zeropoint = zeropoint_stage(&mut star_rows, &stars, &bench, &mut poor, &mut log.notes)?;
    if bench.zeropoint.is_none()
        && survey.pointings.is_empty()
        && !survey.unreadable.is_empty()
        && config.stars.is_some()
    {
        let n = survey.unreadable.len();
        poor.push(format!("no star frame can be read, and {n} files of the night cannot: were the stars among them?"));
    }
    let (mut frames, quadratures) =
        log.stage("target", |log| target_stage(&survey.targets, &bench, &products, options, progress, &mut log.notes))?;
    for copy in set_copies_aside(&mut survey, &products, &mut log.notes).into_iter().rev() {
        frames.remove(copy);
    }
    judge_whole_night(&mut frames, config, &mut log.notes);
    let read: Vec<&Exposure> =
        survey.flats.iter().chain(survey.pointings.iter().flatten()).chain(&survey.targets).collect();
    log.notes.extend(with_threads(options.jobs, || damage_notes(&read))?);
    pictures(&mut frames, &survey.targets, &bench, options)?;

    let explained = explain_night(&survey, &frames, &bench, options, progress)?;
    let (mut rows, thumbs): (Vec<PhotometryRow>, Vec<_>) = frames.into_iter().map(|f| (f.row, f.thumb)).unzip();
    let n_target_rows = rows.len();
    rows.extend(std::mem::take(&mut stars.failed));
    rows.extend(rejected_flats(&bench));
    rows.extend(survey.unreadable.iter().map(|u| failed_file_row(&u.path, &u.error)));
    rows.extend(survey.set_aside.iter().map(|s| set_aside_row(&s.path, &s.reason)));
    let counts = Counts::of(&survey, &rows, &star_rows);
    let of_targets = &rows[..n_target_rows];
    if counts.ok + counts.nondetection == 0
        && let Some(first) = of_targets.iter().find(|r| r.status == Status::Rejected)
    {
        poor.push(format!(
            "none of {} target frames could be measured; {}: {}",
            counts.targets, first.frame, first.reason
        ));
    }
    let failed_frac = counts.failed_frac();
    let limit = if options.strict { 0.0 } else { config.night.max_failed_frac };
    if failed_frac > limit {
        poor.push(format!(
            "{} of {} frames failed, more than the allowed share of {limit} (night.max_failed_frac)",
            counts.failed, counts.science
        ));
    }
    let residuals = residual_rows(&rows);
    log.notes.extend(products.notes());
    let (kept, made) = products.counts();
    let mut summary = Summary {
        night: config.night.name.clone(),
        folder: folder.clone(),
        passes: if counts.targets > 0 {
            format!("\n{}", pass_table(&rows, bench.zeropoint.as_ref().map_or("V", |z| z.band_name())))
        } else {
            String::new()
        },
        model: model_text(config),
        counts,
        zeropoint: bench.zeropoint.clone(),
        zeropoint_source: zeropoint_source(&bench, star_rows.len()),
        failures: failures(&rows),
        kept: (kept, kept + made),
        notes: log.notes.clone(),
        empty_columns: missing_parts(config, &bench).iter().map(ToString::to_string).collect(),
        explained,
        poor,
        bytes: survey_bytes(&survey),
        elapsed_s: 0.0,
        files: Vec::new(),
    };
    let inputs = manifest_inputs(&survey, &products);
    let plan = with_threads(options.jobs, || Plan::of(&survey, config, &products, FRAMES_PER_SHARD))??;
    let told = Provenance::of_plan(&plan, config)?;
    let outputs =
        Outputs { folder: &folder, bench: &bench, config, thumbs: &thumbs, told: &told, data_mode: plan.data_mode };
    held.check()?;
    summary.files = log.stage("write", |_| outputs.write(&rows, &star_rows, &residuals, options))?;
    summary.files.push(write_checks(&folder, &checks)?);
    summary.files.last().map_or(Ok(()), |path| told.stamp(path))?;
    summary.files.push(folder.join("plan.json"));
    plan.write(&folder.join("plan.json"))?;
    summary.elapsed_s = progress.elapsed_s();
    let manifest = Manifest {
        config,
        told: &told,
        config_sha256: config_sha256(config)?,
        inputs,
        flats: bench.flat.iter().flat_map(|f| &f.members).map(flat_member).collect(),
        flat_masked_frac: bench.flat.as_ref().map(|f| f.masked_frac),
        stages: log.stages,
        quadratures,
        rows: &rows,
        summary: &summary,
    };
    summary.files.push(manifest.write(&folder)?);
    if !options.no_figures {
        let drawn = with_threads(options.jobs, || write_report_and_figures(&folder))??;
        drawn.iter().try_for_each(|path| record(&folder, path))?;
        summary.files.extend(drawn);
    }
    Ok(summary)
}

/// The model of the target, and what observations say of it.
fn model_text(config: &Config) -> Option<String> {
    let model = config.model.as_ref()?;
    let standing = Standing::of(model).ok()?;
    Some(format!("{}: {}", model.satellite, standing.text()))
}

/// Why no frame was taken for one of the target, and how to name those that are.
fn no_target(survey: &Survey, bench: &Bench) -> String {
    let names = bench.target_names();
    let known = if names.is_empty() {
        "without [orbit] the target's name is not known".to_string()
    } else {
        format!("no OBJECT contains {}", names.join(" or "))
    };
    format!(
        "no target frames among {} files: {known}; name it in frames.target_objects, or its files in frames.target",
        survey.len()
    )
}

/// Stages with their times, and what should be told at the end.
struct Log<'a> {
    progress: &'a dyn Progress,
    stages: Vec<Stage>,
    notes: Vec<String>,
}

impl<'a> Log<'a> {
    fn new(progress: &'a dyn Progress) -> Self {
        Self { progress, stages: Vec::new(), notes: Vec::new() }
    }
    fn stage<T>(&mut self, name: &str, work: impl FnOnce(&mut Self) -> T) -> T {
        let (start, cpu_start, read) = (self.progress.elapsed_s(), self.progress.cpu_s(), bytes_read());
        let result = work(self);
        let cpu_s = self.progress.cpu_s().zip(cpu_start).map(|(end, start)| end - start);
        let end_s = self.progress.elapsed_s();
        let wall_s = end_s - start;
        let bytes_read = bytes_read().zip(read).map(|(end, start)| end - start);
        let peak_memory_mb = peak_memory_mb();
        self.stages.push(Stage { name: name.into(), wall_s, cpu_s, end_s, bytes_read, peak_memory_mb });
        result
    }
}

/// How many frames were set aside, and why the first.
fn log_set_aside(survey: &Survey) -> Option<String> {
    let first = survey.set_aside.first()?;
    let n = survey.set_aside.len();
    Some(format!("{n} frames set aside, {}: {}", file_name(&first.path), first.reason))
}

fn zeropoint_source(bench: &Bench, n_rows: usize) -> String {
    match (&bench.zeropoint, &bench.config.zeropoint.previous) {
        (None, _) => "none".into(),
        (Some(_), Some(path)) => path.display().to_string(),
        (Some(_), None) => format!("fit to {n_rows} star measurements of this night"),
    }
}

/// Fits the zeropoint, or reads the one given; without either the night goes on without calibrated magnitudes.
pub(super) fn zeropoint_stage(
    rows: &mut [StarRow],
    stars: &StarStage,
    bench: &Bench,
    poor: &mut Vec<String>,
    notes: &mut Vec<String>,
) -> Result<Option<Zeropoint>> {
    if let Some(path) = &bench.config.zeropoint.previous {
        let (zeropoint, told) = read_previous(path, &bench.config, bench.flat.is_some())?;
        notes.extend(told);
        return Ok(Some(of_band(zeropoint, bench)));
    }
    if bench.config.stars.is_none() {
        notes.push("no [stars] and no zeropoint.previous: magnitudes stay instrumental".into());
        return Ok(None);
    }
    if rows.is_empty() {
        if stars.failed.is_empty() {
            notes.push("no star pointings in the night and no zeropoint.previous: magnitudes stay instrumental".into());
        } else {
            poor.push(format!(
                "no star matched the catalogue in any of {} star frames; the first: {}",
                stars.failed.len(),
                stars.failed[0].reason
            ));
        }
        return Ok(None);
    }
    match fit_rows(rows, &bench.config) {
        Ok(zeropoint) => {
            notes.extend(zeropoint.warnings.iter().map(|w| format!("zeropoint: {w}")));
            Ok(Some(of_band(zeropoint, bench)))
        }
        Err(error @ Error::Zeropoint { .. }) => {
            poor.push(error.to_string());
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// The zeropoint with the band that was agreed on.
pub(super) fn of_band(mut zeropoint: Zeropoint, bench: &Bench) -> Zeropoint {
    if let Some(calibrated) = &bench.calibrated {
        (zeropoint.band, zeropoint.light) = (Some(calibrated.band), Some(calibrated.light.clone()));
    }
    zeropoint
}

fn flat_member(m: &FlatMember) -> (PathBuf, f64, bool, String) {
    (m.path.clone(), m.level_adu, m.used, m.reason.clone())
}

/// Flats that did not enter the master, as rows.
pub(super) fn rejected_flats(bench: &Bench) -> Vec<PhotometryRow> {
    let Some(flat) = &bench.flat else { return Vec::new() };
    flat.members
        .iter()
        .filter(|m| !m.used)
        .map(|m| PhotometryRow {
            frame: file_name(&m.path),
            object_name: "flat".into(),
            status: Status::Rejected.into(),
            verdict: Verdict::Reject.into(),
            reason: format!("flat: {}", m.reason),
            ..PhotometryRow::default()
        })
        .collect()
}

fn failures(rows: &[PhotometryRow]) -> Vec<(String, String, String)> {
    rows.iter()
        .filter(|r| r.status == Status::Failed || r.status == Status::Rejected)
        .map(|r| (r.frame.clone(), r.status.clone(), r.reason.clone()))
        .collect()
}

fn survey_bytes(survey: &Survey) -> u64 {
    let size = |path: &Path| std::fs::metadata(path).map_or(0, |m| m.len());
    let exposures = survey.flats.iter().chain(survey.pointings.iter().flatten()).chain(&survey.targets);
    exposures.map(|e| size(&e.path)).sum()
}
