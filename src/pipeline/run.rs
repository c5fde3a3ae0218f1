//! A night from its files to its tables: survey, master flat, zeropoint, target frames, comparison with the model.

use std::path::{Path, PathBuf};

use crate::bands::Band;
use crate::base::error::{Error, Result};
use crate::base::file::{file_name, make_folder};
use crate::base::progress::Progress;
use crate::base::threads::with_threads;
use crate::config::Config;
use crate::config::digest::config_sha256;
use crate::figures::Thumb;
use crate::frames::Exposure;
use crate::frames::flat::FlatMember;
use crate::pipeline::along_track::along_track_note;
use crate::pipeline::compare::residual_rows;
use crate::pipeline::detector::checks::check as check_detector;
use crate::pipeline::detector::gain_check::GainCheck;
use crate::pipeline::detector::report::write_checks;
use crate::pipeline::explain::explain_night;
use crate::pipeline::explain::text::Explanation;
use crate::pipeline::hot_pixels::with_hot_pixels;
use crate::pipeline::keyword_checks::{keyword_checks, not_checkable};
use crate::pipeline::options::Options;
use crate::pipeline::passes::pass_stack;
use crate::pipeline::prepared::{Calibrated, Flattened, Prepared};
use crate::pipeline::products::inputs::named_files;
use crate::pipeline::products::lock::{FolderLock, lock};
use crate::pipeline::products::manifest::{Manifest, Quadratures, bytes_read, manifest_inputs, peak_memory_mb, record};
use crate::pipeline::products::outputs::Outputs;
#[cfg(feature = "report")]
use crate::pipeline::products::page::write_report_and_figures;
use crate::pipeline::products::provenance::Provenance;
use crate::pipeline::products::record::StageRecord;
use crate::pipeline::products::summary::{Counts, ModelStanding, Summary};
use crate::pipeline::shards::plan_file::{FRAMES_PER_SHARD, Plan, set_copies_aside};
use crate::pipeline::shards::products::{FOLDER, FrameCache};
use crate::pipeline::shards::whole::judge_whole_night;
use crate::pipeline::stages::{master_flat, rejected_flats, target_stage};
use crate::pipeline::stars::frame_check::FrameCheck;
use crate::pipeline::stars::stage::star_stage;
use crate::pipeline::stars::zeropoint::zeropoint_stage;
use crate::pipeline::survey::damage::damage_notes;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::survey::preflight::preflight;
use crate::pipeline::survey::scale::check_stars;
use crate::pipeline::target::frame::missing_parts;
use crate::pipeline::target::outcome::TargetFrame;
#[cfg(feature = "report")]
use crate::pipeline::target::pictures::pictures;
use crate::pipeline::target::pilots::TargetFrames;
use crate::pipeline::target::place::off_target_note;
use crate::pipeline::target::row::{failed_file_row, set_aside_row};
use crate::report::summary::{pass_summaries, pass_table, stack_table};
use crate::tables::words::Status;
use crate::tables::{KeywordCheckRow, PassStackRow, PhotometryRow, ResidualRow, StarRow};

/// Reduces a whole night and writes its tables, figures and summary to `<output>/<name>/`.
///
/// # Errors
/// Anything that is missing before the work begins (exit codes 2, 4, 5). A failed frame is a row, never an error; a night
/// whose outputs are written but poor is described by [`Summary::poor`].
pub fn run(config: &Config, options: &Options, progress: &dyn Progress) -> Result<Summary> {
    let (prepared, mut night) = Run::prepare(config, options, progress)?;
    let checks = night.check(&prepared)?;
    let flattened = night.flatten(prepared)?;
    let (calibrated, stars) = night.calibrate(flattened)?;
    let measured = night.measure(&calibrated)?;
    let compared = night.compare(&calibrated, stars, measured)?;
    night.write(&calibrated, &checks, compared)
}

/// What every stage of one run uses: its options, the files of the night, the folder of the results and the log.
struct Run<'a> {
    config: &'a Config,
    options: &'a Options,
    progress: &'a dyn Progress,
    survey: Survey,
    folder: PathBuf,
    lock: FolderLock,
    products: FrameCache,
    log: Log<'a>,
    /// Why the night is not good enough for exit code 0.
    poor: Vec<String>,
}

/// Rows of the star pointings, and of star frames that failed.
struct Stars {
    rows: Vec<StarRow>,
    failed: Vec<PhotometryRow>,
    checks: Vec<FrameCheck>,
}

/// Target frames, measured and modelled one by one and judged together.
struct Measured {
    frames: Vec<TargetFrame>,
    quadratures: Quadratures,
    explained: Option<Explanation>,
}

/// The tables of a night.
struct Compared {
    rows: Vec<PhotometryRow>,
    stars: Vec<StarRow>,
    residuals: Vec<ResidualRow>,
    stacks: Vec<PassStackRow>,
    checks: Vec<KeywordCheckRow>,
    /// Pictures of the target frames, which are the first of `rows`.
    thumbs: Vec<Option<Thumb>>,
    counts: Counts,
    quadratures: Quadratures,
    explained: Option<Explanation>,
}

impl<'a> Run<'a> {
    /// Reads the configuration's files and every header, makes every check before the first pixel, and takes the folder of
    /// the results.
    fn prepare(config: &'a Config, options: &'a Options, progress: &'a dyn Progress) -> Result<(Prepared, Self)> {
        let (mut prepared, survey, found) = preflight(config, &options.files, &options.stop)?.ready()?;
        if options.exhaustive {
            prepared.make_exhaustive()?;
        }
        let short_of_memory = options.memory().check(&survey, &prepared)?;
        let folder = config.night.output.join(&config.night.name);
        make_folder(&folder).map_err(|e| Error::NoInput {
            path: folder.clone(),
            problem: format!("the folder of the results cannot be made (night.output, -o): {e}"),
        })?;
        let lock = lock(&folder)?;
        let products =
            FrameCache::in_folder(folder.join(FOLDER), &prepared, options.redo)?.knowing(options.known_hashes.clone());
        // what has just been read: the files may be others, or gone, when the products state their hashes
        named_files(config).iter().for_each(|(_, path)| _ = products.sha256(path));
        let mut log = Log::new(progress);
        log.notes.extend(short_of_memory);
        log.notes.extend(found);
        log.notes.extend(note_set_aside(&survey));
        Ok((prepared, Self { config, options, progress, survey, folder, lock, products, log, poor: Vec::new() }))
    }

    /// The pixel scale and the detector against what the frames say of them.
    fn check(&mut self, prepared: &Prepared) -> Result<Vec<GainCheck>> {
        let Self { survey, products, options, log, .. } = self;
        let scale = log.stage("scale", |_| check_stars(survey, prepared, products, options.jobs))?;
        log.notes.extend(scale);
        if survey.targets.is_empty() {
            log.notes.push(no_target(survey, prepared));
        }
        log.stage("detector", |log| check_detector(survey, prepared, &mut log.notes))
    }

    /// The master flat, written as soon as it is made.
    fn flatten(&mut self, prepared: Prepared) -> Result<Flattened> {
        let Self { survey, products, options, progress, log, .. } = self;
        let file = self.folder.join("master_flat.fits");
        log.stage("flat", |log| {
            let night = master_flat(survey, prepared, (products, Some(&file)), options, *progress, &mut log.notes)?;
            with_hot_pixels(night, &survey.pointings, products, options, &mut log.notes)
        })
    }

    /// The star pointings measured, and the zeropoint fitted to them.
    fn calibrate(&mut self, flattened: Flattened) -> Result<(Calibrated, Stars)> {
        let Self { survey, products, options, progress, log, poor, .. } = self;
        let shared = match &options.stars_cache {
            Some(folder) => {
                let cache = FrameCache::of_stars(folder.clone(), &flattened, options.redo)?;
                Some(cache.knowing(options.known_hashes.clone()))
            }
            None => None,
        };
        let kept = shared.as_ref().unwrap_or(products);
        let mut stars =
            log.stage("stars", |log| star_stage(survey, &flattened, kept, options, *progress, &mut log.notes))?;
        log.details.append(&mut stars.details);
        let zeropoint = zeropoint_stage(&mut stars.rows, &stars.failed, &flattened, poor, &mut log.notes)?;
        let no_star_frames = survey.pointings.is_empty() && !survey.unreadable.is_empty();
        if zeropoint.is_none() && no_star_frames && self.config.stars.is_some() {
            let n = survey.unreadable.len();
            poor.push(format!(
                "no star frame can be read, and {n} files of the night cannot: were the stars among them?"
            ));
        }
        let calibrated = Calibrated { flattened, seeing: stars.seeing, zeropoint };
        Ok((calibrated, Stars { rows: stars.rows, failed: stars.failed, checks: stars.checks }))
    }

    /// Every target frame measured and modelled, then judged among its neighbours.
    fn measure(&mut self, night: &Calibrated) -> Result<Measured> {
        let Self { survey, products, options, progress, log, .. } = self;
        let (mut frames, quadratures) = log.stage("target", |log| {
            target_stage(&TargetFrames::all(&survey.targets), night, products, options, *progress, &mut log.notes)
        })?;
        for copy in set_copies_aside(survey, products, &mut log.notes).into_iter().rev() {
            frames.remove(copy);
        }
        judge_whole_night(&mut frames, self.config, &mut log.notes);
        let rows = frames.iter().map(|f| &f.row).zip(&survey.targets);
        log.notes.extend(off_target_note(rows, self.config));
        log.notes.extend(along_track_note(&frames.iter().map(|f| f.row.clone()).collect::<Vec<_>>()));
        let read: Vec<&Exposure> =
            survey.flats.iter().chain(survey.pointings.iter().flatten()).chain(&survey.targets).collect();
        log.notes.extend(with_threads(options.jobs, || damage_notes(&read))?);
        #[cfg(feature = "report")]
        pictures(&mut frames, &survey.targets, night, options)?;
        let explained = explain_night(survey, &frames, night, options, *progress)?;
        Ok(Measured { frames, quadratures, explained })
    }

    /// The rows of the tables: target frames, then whatever else has a row, and the residuals from the model.
    fn compare(&mut self, night: &Calibrated, stars: Stars, measured: Measured) -> Result<Compared> {
        let Measured { frames, quadratures, explained } = measured;
        let (mut rows, thumbs): (Vec<PhotometryRow>, Vec<_>) = frames.into_iter().map(|f| (f.row, f.thumb)).unzip();
        let n_target_rows = rows.len();
        let Self { survey, options, progress, log, .. } = self;
        let stacks = log.stage("pass stacks", |_| pass_stack(&mut rows, &survey.targets, night, options, *progress))?;
        let checks = keyword_checks(&self.survey, night.flat.as_ref(), &stars.checks, &rows, self.config);
        self.log.details.extend(not_checkable(&checks));
        rows.extend(stars.failed);
        rows.extend(rejected_flats(night));
        rows.extend(self.survey.unreadable.iter().map(|u| failed_file_row(&u.path, &u.error)));
        rows.extend(self.survey.set_aside.iter().map(|s| set_aside_row(&s.path, &s.reason)));
        let counts = Counts::of(&self.survey, &rows, &stars.rows);
        self.judge(&counts, &rows[..n_target_rows]);
        let residuals = residual_rows(&rows);
        Ok(Compared { rows, stars: stars.rows, residuals, stacks, checks, thumbs, counts, quadratures, explained })
    }

    /// Whether the night as a whole is good enough for exit code 0.
    fn judge(&mut self, counts: &Counts, of_targets: &[PhotometryRow]) {
        if counts.ok + counts.nondetection == 0
            && let Some(first) = of_targets.iter().find(|r| r.status == Status::Rejected)
        {
            self.poor.push(format!(
                "none of {} target frames could be measured; {}: {}",
                counts.targets, first.frame, first.reason
            ));
        }
        let limit = if self.options.strict { 0.0 } else { self.config.night.max_failed_frac };
        if counts.failed_frac() > limit {
            self.poor.push(format!(
                "{} of {} frames failed, more than the allowed share of {limit} (night.max_failed_frac)",
                counts.failed, counts.science
            ));
        }
    }

    /// Writes tables, figures, plan, manifest and report; returns the summary.
    fn write(mut self, night: &Calibrated, checks: &[GainCheck], compared: Compared) -> Result<Summary> {
        let (config, options, folder) = (self.config, self.options, self.folder.clone());
        self.log.notes.extend(self.products.notes());
        // a run of named files alone says nothing of the others; the files of a group are all it has
        if options.files.is_empty() || options.stars_cache.is_some() {
            self.products.prune();
        }
        let mut summary = self.summary(night, &compared);
        let inputs = manifest_inputs(&self.survey, &self.products);
        let of_plan = || Plan::of(&self.survey, config, &self.products, FRAMES_PER_SHARD);
        let plan = with_threads(options.jobs, of_plan)??;
        let provenance = Provenance::of_plan(&plan, config)?;
        let Compared { rows, stars, residuals, stacks, checks: keywords, thumbs, .. } = &compared;
        let data_mode = plan.data_mode;
        let outputs = Outputs { folder: &folder, night, config, thumbs, provenance: &provenance, data_mode };
        self.lock.check()?;
        summary.files =
            self.log.stage("write", |_| outputs.write(rows, stars, (residuals, stacks, keywords), options))?;
        let of_checks = write_checks(&folder, checks)?;
        provenance.stamp(&of_checks)?;
        let of_plan = folder.join("plan.json");
        plan.write(&of_plan)?;
        summary.files.extend([of_checks, of_plan]);
        summary.elapsed_s = self.progress.elapsed_s();
        let manifest = Manifest {
            config,
            provenance: &provenance,
            config_sha256: config_sha256(config)?,
            inputs,
            flats: night.flat.iter().flat_map(|f| &f.members).map(flat_member).collect(),
            flat_masked_frac: night.flat.as_ref().map(|f| f.masked_frac),
            stages: self.log.stages,
            quadratures: compared.quadratures,
            rows,
            summary: &summary,
        };
        summary.files.push(manifest.write(&folder)?);
        #[cfg(feature = "report")]
        if !options.no_figures {
            let drawn = with_threads(options.jobs, || write_report_and_figures(&folder))??;
            drawn.iter().try_for_each(|path| record(&folder, path))?;
            summary.files.extend(drawn);
        }
        Ok(summary)
    }

    /// The night in numbers; files and times are added when it is written.
    fn summary(&self, night: &Calibrated, compared: &Compared) -> Summary {
        let (kept, made) = self.products.counts();
        let band = Band::or_v(night.zeropoint.as_ref().and_then(|z| z.band)).name();
        Summary {
            night: self.config.night.name.clone(),
            folder: self.folder.clone(),
            passes: match compared.counts.targets {
                0 => String::new(),
                _ => format!("\n{}{}", pass_table(&compared.rows, band), stack_table(&compared.stacks, band)),
            },
            pass_rows: pass_summaries(&compared.rows),
            model: ModelStanding::of(self.config),
            counts: compared.counts.clone(),
            zeropoint: night.zeropoint.clone(),
            zeropoint_source: zeropoint_source(night, compared.stars.len()),
            failures: failures(&compared.rows),
            kept: (kept, kept + made),
            notes: self.log.notes.clone(),
            details: self.log.details.clone(),
            empty_columns: missing_parts(night, night.flat.is_some(), night.zeropoint.is_some())
                .iter()
                .map(ToString::to_string)
                .collect(),
            explained: compared.explained.clone(),
            poor: self.poor.clone(),
            bytes: survey_bytes(&self.survey),
            elapsed_s: 0.0,
            files: Vec::new(),
        }
    }
}

/// Why no frame was taken for one of the target, and how to name those that are.
fn no_target(survey: &Survey, night: &Prepared) -> String {
    let names = night.target_names();
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

/// How many frames were set aside, and why the first.
fn note_set_aside(survey: &Survey) -> Option<String> {
    let first = survey.set_aside.first()?;
    let n = survey.set_aside.len();
    Some(format!("{n} frames set aside, {}: {}", file_name(&first.path), first.reason))
}

fn zeropoint_source(night: &Calibrated, n_rows: usize) -> String {
    match (&night.zeropoint, &night.config.zeropoint.previous) {
        (None, _) => "none".into(),
        (Some(_), Some(path)) => path.display().to_string(),
        (Some(_), None) => format!("fit to {n_rows} star measurements of this night"),
    }
}

fn flat_member(m: &FlatMember) -> (PathBuf, f64, bool, String) {
    (m.path.clone(), m.level_adu, m.used, m.reason.clone())
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

/// The stages with their times, and the notes that are reported at the end.
struct Log<'a> {
    progress: &'a dyn Progress,
    stages: Vec<StageRecord>,
    notes: Vec<String>,
    details: Vec<String>,
}

impl<'a> Log<'a> {
    fn new(progress: &'a dyn Progress) -> Self {
        Self { progress, stages: Vec::new(), notes: Vec::new(), details: Vec::new() }
    }
    fn stage<T>(&mut self, name: &str, work: impl FnOnce(&mut Self) -> T) -> T {
        let (start, cpu_start, read) = (self.progress.elapsed_s(), self.progress.cpu_s(), bytes_read());
        let result = work(self);
        let cpu_s = self.progress.cpu_s().zip(cpu_start).map(|(end, start)| end - start);
        let end_s = self.progress.elapsed_s();
        let wall_s = end_s - start;
        let bytes_read = bytes_read().zip(read).map(|(end, start)| end - start);
        let peak_memory_mb = peak_memory_mb();
        self.stages.push(StageRecord { name: name.into(), wall_s, cpu_s, end_s, bytes_read, peak_memory_mb });
        result
    }
}
