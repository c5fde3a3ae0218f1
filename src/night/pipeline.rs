//! The night as one sentence: survey, flat, star pointings, zeropoint, target frames, comparison, tables.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use rayon::prelude::*;

use crate::config::{Combine, Config};
use crate::error::{Error, Result};
use crate::frames::{Exposure, FlatMember, MasterFlat};
use crate::night::bench::{Bench, sha256_16_text};
use crate::night::compare::{add_model, residual_rows};
use crate::night::manifest::{Manifest, Quadratures, Stage, inputs_sha256, manifest_inputs};
use crate::night::outputs::{Outputs, file_name};
use crate::night::pointing::{Member, combined_rows, measure_member, single_rows};
use crate::night::progress::Progress;
use crate::night::summary::{Counts, Summary};
use crate::night::survey::{Survey, survey};
use crate::night::target::{ASSUMED_FWHM_ARCSEC, empty_columns, failed_row, measure_frame};
use crate::night::zeropoint::fit_rows;
use crate::orbit::Geometry;
use crate::photometry::zeropoint::Zeropoint;
use crate::report::summary::{pass_table, robust};
use crate::report::{PhotometryRow, StarRow};

/// How a run is done, apart from what it does.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Threads; 0 = all cores.
    pub jobs: usize,
    /// Files instead of the configured inputs.
    pub files: Vec<PathBuf>,
    /// Any failed frame makes the exit code 3.
    pub strict: bool,
    /// Draw no figures.
    pub no_figures: bool,
}

impl Options {
    /// Threads to use.
    #[must_use]
    pub fn threads(&self) -> usize {
        if self.jobs > 0 { self.jobs } else { std::thread::available_parallelism().map_or(1, usize::from) }
    }
}

/// Reduces a whole night and writes its tables, figures and summary to `<output>/<name>/`.
///
/// # Errors
/// What must be there before work begins (exit codes 2, 4, 5). A failed frame is a row, never an error; a night whose
/// outputs are written but poor is told by [`Summary::poor`].
pub fn run(config: &Config, options: &Options, progress: &dyn Progress) -> Result<Summary> {
    let mut bench = Bench::prepare(config)?;
    let survey = survey(config, &options.files, &bench.target_names())?;
    refuse_hopeless(&survey, &bench)?;
    let folder = config.night.output.join(&config.night.name);
    std::fs::create_dir_all(&folder).map_err(|e| Error::NoInput {
        path: folder.clone(),
        problem: format!("the folder of the results cannot be made ({e}); choose another night.output"),
    })?;

    let mut log = Log::new(progress);
    if survey.targets.is_empty() {
        log.notes.push(no_target(&survey, &bench));
    }
    bench.flat = log.stage("flat", |log| master_flat(&survey, &bench, options, progress, &mut log.notes))?;
    let mut stars = log.stage("stars", |log| star_stage(&survey, &bench, options, progress, &mut log.notes))?;
    bench.fwhm_arcsec = stars.fwhm_arcsec;
    let mut star_rows = std::mem::take(&mut stars.rows);
    let mut poor = Vec::new();
    bench.zeropoint = zeropoint_stage(&mut star_rows, &stars, &bench, &mut poor, &mut log.notes)?;
    let mut frames = log.stage("target", |log| target_stage(&survey, &bench, options, progress, &mut log.notes))?;
    let quadratures = log.stage("model", |log| model_stage(&mut frames, &bench, &mut log.notes));

    let mut rows: Vec<PhotometryRow> = frames.into_iter().map(|f| f.0).collect();
    rows.extend(std::mem::take(&mut stars.failed));
    rows.extend(rejected_flats(&bench));
    rows.extend(survey.unreadable.iter().map(|u| failed_row(&file_name(&u.path), &u.error)));
    let counts = Counts::of(&survey, &rows, &star_rows);
    let target_rejected = |r: &&PhotometryRow| r.status == "rejected" && r.object_name != "flat";
    if counts.ok + counts.nondetection == 0
        && let Some(first) = rows.iter().find(target_rejected)
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
    let mut summary = Summary {
        night: config.night.name.clone(),
        folder: folder.clone(),
        passes: if counts.targets > 0 { format!("\n{}", pass_table(&rows)) } else { String::new() },
        counts,
        zeropoint: bench.zeropoint.clone(),
        zeropoint_source: zeropoint_source(&bench, star_rows.len()),
        failures: failures(&rows),
        notes: log.notes.clone(),
        empty_columns: empty_columns(config, &bench),
        poor,
        bytes: survey_bytes(&survey),
        elapsed_s: 0.0,
        files: Vec::new(),
    };
    let inputs = manifest_inputs(&survey, &rows);
    let outputs = Outputs { folder: &folder, bench: &bench, config, inputs_sha256: inputs_sha256(&inputs) };
    summary.files = log.stage("write", |_| outputs.write(&rows, &star_rows, &residuals, options))?;
    summary.elapsed_s = progress.elapsed_s();
    let manifest = Manifest {
        config_sha256: sha256_16_text(&config.to_toml()?),
        inputs,
        flats: bench.flat.iter().flat_map(|f| &f.members).map(flat_member).collect(),
        flat_masked_frac: bench.flat.as_ref().map(|f| f.masked_frac),
        stages: log.stages,
        quadratures,
        summary: &summary,
    };
    summary.files.push(manifest.write(&folder)?);
    Ok(summary)
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
        let start = self.progress.elapsed_s();
        let result = work(self);
        self.stages.push(Stage { name: name.into(), wall_s: self.progress.elapsed_s() - start });
        result
    }
}

/// What no frame of the night can do without is an error before work begins: a gain setting that no target frame has
/// in the table, elements that are refused for every frame.
fn refuse_hopeless(survey: &Survey, bench: &Bench) -> Result<()> {
    let science: Vec<&Exposure> = survey.targets.iter().chain(survey.pointings.iter().flatten()).collect();
    if science.is_empty() && survey.flats.is_empty() {
        return match survey.unreadable.first() {
            Some(first) => Err(Error::NoInput {
                path: bench.config.night.input.first().cloned().unwrap_or_default(),
                problem: format!("none of the {} files can be used; the first: {}", survey.len(), first.error),
            }),
            None => Err(Error::NoInput {
                path: bench.config.night.input.first().cloned().unwrap_or_default(),
                problem: "holds no flat, star or target frames (IMAGETYP, OBJECT; or name them in [frames])".into(),
            }),
        };
    }
    let gains: Vec<Result<_>> = science.iter().map(|e| bench.detector.gain(e)).collect();
    if gains.iter().all(Result::is_err)
        && let Some(Err(first)) = gains.into_iter().next()
    {
        return Err(first);
    }
    if let Some(tracker) = &bench.tracker {
        let refused: Vec<Error> =
            survey.targets.iter().filter_map(|e| tracker.elements_at(&e.time.as_ref()?.mid).err()).collect();
        if refused.len() == survey.targets.len()
            && let Some(first) = refused.into_iter().next()
        {
            return Err(first);
        }
    }
    Ok(())
}

/// The master flat: read if configured, made if there are flats, left out if there are none.
///
/// # Errors
/// [`Error::Flat`] when there are flats but too few can be used.
pub fn master_flat(
    survey: &Survey,
    bench: &Bench,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<Option<MasterFlat>> {
    let clip = bench.config.photometry.clip_radius_px;
    if let Some(path) = &bench.config.flat.master {
        return MasterFlat::read(path, clip, &bench.config.flat).map(Some);
    }
    if survey.flats.is_empty() {
        notes.push("no flats in the night: frames are not flattened".into());
        return Ok(None);
    }
    progress.stage("master flat", survey.flats.len());
    let flat = pool(options.threads())?
        .install(|| MasterFlat::make(&survey.flats, &bench.detector, &bench.config.flat, clip))
        .map_err(|error| match error {
            Error::Flat { problem } => Error::Flat {
                problem: format!(
                    "{problem}; take more flats, name a master of another night in flat.master, lower flat.min_flats, \
                     or leave the flats out with frames.ignore"
                ),
            },
            other => other,
        })?;
    progress.done();
    Ok(Some(flat))
}

/// Runs `work` on a pool of `jobs` threads; 0 = all cores.
///
/// # Errors
/// [`Error::Config`] when the threads cannot be started.
pub fn with_threads<T: Send>(jobs: usize, work: impl FnOnce() -> T + Send) -> Result<T> {
    Ok(pool(Options { jobs, ..Options::default() }.threads())?.install(work))
}

fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Error::Config { key: "--jobs".into(), problem: format!("cannot start {threads} threads: {e}") })
}

/// What the star pointings gave.
#[derive(Debug, Default)]
pub struct StarStage {
    /// One row per star and pointing (or member).
    pub rows: Vec<StarRow>,
    /// Star frames that failed.
    pub failed: Vec<PhotometryRow>,
    /// Median FWHM \[arcsec\].
    pub fwhm_arcsec: Option<f64>,
    /// Star frames measured.
    pub n_members: usize,
}

fn zeropoint_source(bench: &Bench, n_rows: usize) -> String {
    match (&bench.zeropoint, &bench.config.zeropoint.previous) {
        (None, _) => "none".into(),
        (Some(_), Some(path)) => path.display().to_string(),
        (Some(_), None) => format!("fit to {n_rows} star measurements of this night"),
    }
}

/// Measures every star pointing.
///
/// # Errors
/// Only what is wrong with the machine; a failed frame is a row.
pub fn star_stage(
    survey: &Survey,
    bench: &Bench,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<StarStage> {
    let (Some(stars), Some(catalogue)) = (&bench.config.stars, &bench.catalogue) else {
        if survey.n_star_frames() > 0 {
            notes.push(format!("{} star frames left out: no [stars] in the configuration", survey.n_star_frames()));
        }
        return Ok(StarStage::default());
    };
    let exposures: Vec<&Exposure> = survey.pointings.iter().flatten().collect();
    progress.stage("star pointings", exposures.len());
    let measure = |exposure: &&Exposure| -> Result<Member> {
        let exposure: &Exposure = exposure;
        let work = std::panic::AssertUnwindSafe(|| measure_member(exposure, bench, catalogue));
        let member = std::panic::catch_unwind(work).unwrap_or_else(|_| {
            Err(Error::Fits { path: exposure.path.clone(), problem: "internal error while reading this frame".into() })
        });
        progress.tick();
        member
    };
    let threads = bench.frames_at_once(&exposures, options.threads());
    let results: Vec<Result<Member>> = pool(threads)?.install(|| exposures.par_iter().map(measure).collect());
    progress.done();

    let mut stage = StarStage::default();
    let mut fwhm: Vec<f64> = Vec::new();
    let mut results = results.into_iter();
    let mut number = 0;
    for pointing in &survey.pointings {
        let mut members = Vec::new();
        for exposure in pointing {
            match results.next() {
                Some(Ok(member)) => members.push(member),
                Some(Err(error)) => {
                    let mut row = failed_row(&exposure.name, &error);
                    row.object_name = exposure.object.clone().unwrap_or_default();
                    row.exptime_s = Some(exposure.exptime_s);
                    stage.failed.push(row);
                }
                None => {}
            }
        }
        fwhm.extend(members.iter().map(|m| m.fwhm_px * m.scale_arcsec));
        stage.n_members += members.len();
        match stars.combine {
            Combine::Median => stage.rows.extend(combined_rows(&members, number, catalogue)),
            Combine::None => stage.rows.extend(members.iter().flat_map(|m| single_rows(m, number, catalogue))),
        }
        // a pointing of which no frame could be measured has no number: it is missing in the tables
        number += usize::from(!members.is_empty());
    }
    stage.fwhm_arcsec = robust(&fwhm).map(|(median, _)| median);
    if catalogue.n_skipped > 0 {
        let why = catalogue.skipped.first().map(|s| format!(", e.g. {s}")).unwrap_or_default();
        notes.push(format!("catalogue: {} rows skipped{why}", catalogue.n_skipped));
    }
    Ok(stage)
}

/// Fits the zeropoint, or reads the one given; without either the night goes on without calibrated magnitudes.
fn zeropoint_stage(
    rows: &mut [StarRow],
    stars: &StarStage,
    bench: &Bench,
    poor: &mut Vec<String>,
    notes: &mut Vec<String>,
) -> Result<Option<Zeropoint>> {
    if let Some(path) = &bench.config.zeropoint.previous {
        notes.push(format!("zeropoint of {}", path.display()));
        return Zeropoint::read(path).map(Some);
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
            Ok(Some(zeropoint))
        }
        Err(error @ Error::Zeropoint { .. }) => {
            poor.push(error.to_string());
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// Measures every target frame; the row and the geometry of each.
///
/// # Errors
/// Only what is wrong with the machine; a failed frame is a row.
pub fn target_stage(
    survey: &Survey,
    bench: &Bench,
    options: &Options,
    progress: &dyn Progress,
    notes: &mut Vec<String>,
) -> Result<Vec<(PhotometryRow, Option<Geometry>)>> {
    if bench.fwhm_arcsec.is_none() && bench.config.photometry.fwhm_px.is_none() && !survey.targets.is_empty() {
        notes.push(format!(
            "no FWHM from star pointings or photometry.fwhm_px: target apertures assume {ASSUMED_FWHM_ARCSEC} arcsec"
        ));
    }
    if let Some(tracker) = &bench.tracker {
        let warnings = survey.targets.iter().filter_map(|e| tracker.age_warning(&e.time.as_ref()?.mid));
        notes.extend(warnings.take(1));
    }
    let exposures: Vec<&Exposure> = survey.targets.iter().collect();
    progress.stage("target frames", exposures.len());
    let threads = bench.frames_at_once(&exposures, options.threads());
    let rows = pool(threads)?.install(|| {
        exposures
            .par_iter()
            .map(|exposure| {
                let row = measure_frame(exposure, bench);
                progress.tick();
                row
            })
            .collect()
    });
    progress.done();
    Ok(rows)
}

/// The model for every frame with a geometry; frames without one keep their columns empty.
fn model_stage(
    frames: &mut [(PhotometryRow, Option<Geometry>)],
    bench: &Bench,
    notes: &mut Vec<String>,
) -> Quadratures {
    let Some(satellite) = &bench.satellite else { return Quadratures::default() };
    let settings = bench.model_settings();
    let errors = Mutex::new(Vec::new());
    let counts: Vec<Quadratures> = frames
        .par_iter_mut()
        .map(|(row, geometry)| {
            let Some(geometry) = geometry else { return Quadratures::default() };
            match add_model(row, geometry, satellite, &settings) {
                Ok(model) => Quadratures { scenes: 1, sun: model.quadratures.sun, moon: model.quadratures.moon },
                Err(error) => {
                    if let Ok(mut errors) = errors.lock() {
                        errors.push(format!("{}: {error}", row.frame));
                    }
                    row.skipped = error.to_string();
                    Quadratures::default()
                }
            }
        })
        .collect();
    let mut errors = errors.into_inner().unwrap_or_default();
    errors.sort();
    notes.extend(errors);
    counts.into_iter().fold(Quadratures::default(), |a, b| Quadratures {
        scenes: a.scenes + b.scenes,
        sun: a.sun + b.sun,
        moon: a.moon + b.moon,
    })
}

fn flat_member(m: &FlatMember) -> (PathBuf, f64, bool, String) {
    (m.path.clone(), m.level_adu, m.used, m.reason.clone())
}

/// Flats that did not enter the master, as rows.
fn rejected_flats(bench: &Bench) -> Vec<PhotometryRow> {
    let Some(flat) = &bench.flat else { return Vec::new() };
    flat.members
        .iter()
        .filter(|m| !m.used)
        .map(|m| PhotometryRow {
            frame: file_name(&m.path),
            object_name: "flat".into(),
            status: "rejected".into(),
            verdict: "reject".into(),
            reason: format!("flat: {}", m.reason),
            ..PhotometryRow::default()
        })
        .collect()
}

fn failures(rows: &[PhotometryRow]) -> Vec<(String, String, String)> {
    rows.iter()
        .filter(|r| r.status == "failed" || r.status == "rejected")
        .map(|r| (r.frame.clone(), r.status.clone(), r.reason.clone()))
        .collect()
}

fn survey_bytes(survey: &Survey) -> u64 {
    let size = |path: &Path| std::fs::metadata(path).map_or(0, |m| m.len());
    let exposures = survey.flats.iter().chain(survey.pointings.iter().flatten()).chain(&survey.targets);
    exposures.map(|e| size(&e.path)).sum()
}
