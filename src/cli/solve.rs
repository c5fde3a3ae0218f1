//! `satphot solve`: where frames are on the sky, without world coordinates in their headers.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use rayon::prelude::*;
use satphot::Error;
use satphot::astrometry::plate::case::{Case, Verdict};
use satphot::astrometry::plate::{Effort, Solution, solve_with};
use satphot::astrometry::wcs::WcsValue;
use satphot::base::file::{make_folder, write_atomic};
use satphot::base::threads::with_threads;
use satphot::pipeline::stars::solve_file::FrameSolver;

use super::{load, print, tell};

const AFTER_HELP: &str = "\
Examples:
  satphot solve -c pipeline.toml field00_00.fits          catalogue, optics and site of the night
  satphot solve --catalogue apass.csv --ra 280.6 --dec 0.1 --scale 0.196 -o solved *.fits
  satphot solve cases/*.json                              matching cases: right, wrong or none against their truth

The sky is \"normal\" on a frame where east is to the left of north, \"mirrored\" otherwise. Rotation 0 has north along +y;
a positive one turns the sky from +x towards +y. Frames are never modified.";

/// Finds where frames are on the sky: their stars are matched to a catalogue.
///
/// This needs an initial pointing (--ra and --dec, stars.fields of the configuration, or the header's OBJCTRA/OBJCTDEC,
/// RA/DEC, CRVAL, CENTALT/CENTAZ) and the pixel scale. Rotation and parity are measured.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Solve {
    /// FITS frames, or matching cases (.json)
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Configuration of the night: catalogue, optics, site, fields [default: pipeline.toml, unless --catalogue is given]
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Star catalogue, instead of a configuration
    #[arg(long, value_name = "FILE", conflicts_with = "config")]
    catalogue: Option<PathBuf>,
    /// Column of the catalogue, e.g. --column v_mag=gmag (repeatable)
    #[arg(long, value_name = "KEY=NAME", requires = "catalogue")]
    column: Vec<String>,
    /// Right ascension of the frames' centre [deg]
    #[arg(long, value_name = "DEG", requires = "dec")]
    ra: Option<f64>,
    /// Declination of the frames' centre [deg]
    #[arg(long, value_name = "DEG", requires = "ra", allow_negative_numbers = true)]
    dec: Option<f64>,
    /// Pixel scale [arcsec/px]; from the optics if absent
    #[arg(long, value_name = "ARCSEC")]
    scale: Option<f64>,
    /// How far the centre may be from there [deg] [default: 1, or stars.solve_radius_deg]
    #[arg(long, value_name = "DEG")]
    radius: Option<f64>,
    /// How far the scale may be off, as a share [default: 0.2, or stars.scale_search_frac]
    #[arg(long, value_name = "SHARE")]
    scale_search: Option<f64>,
    /// Parity, where the optics tell it
    #[arg(long, value_enum, default_value_t = Parity::Either)]
    parity: Parity,
    /// Brightest detections that hypotheses are made of: fewer is faster and finds less (cases only)
    #[arg(long, value_name = "N", default_value_t = Effort::default().max_detections)]
    brightest: usize,
    /// One JSON object per line instead of a table
    #[arg(long)]
    json: bool,
    /// Folder for the solutions, FRAME.wcs each: a FITS header without pixels
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of threads; 0 = all cores
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = super::threads)]
    jobs: usize,
}

/// What is known of the parity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Parity {
    /// Not known
    Either,
    /// East to the left of north
    Normal,
    /// East to the right of north
    Mirrored,
}

/// What came of one file.
struct Answer {
    file: PathBuf,
    /// Kind of case; empty for a frame.
    kind: String,
    solved: Result<Box<Solution>, String>,
    /// The file could not be read at all.
    error: Option<Error>,
    verdict: Option<Verdict>,
    size_px: (usize, usize),
    time_s: f64,
}

impl Solve {
    pub fn execute(self) -> anyhow::Result<()> {
        let is_case = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let solver = if self.files.iter().all(|f| is_case(f)) { None } else { Some(self.solver()?) };
        if let Some(folder) = &self.out {
            make_folder(folder)?;
        }
        let answers: Vec<Answer> = with_threads(self.jobs, || {
            let one = |file: &PathBuf| match &solver {
                Some(solver) if !is_case(file) => frame(solver, file),
                _ => self.case(file),
            };
            self.files.par_iter().map(one).collect()
        })?;
        if let Some(folder) = &self.out {
            for answer in &answers {
                write_wcs(folder, answer)?;
            }
        }
        if self.json {
            answers.iter().for_each(|a| print(&json_line(a)));
        } else {
            print(&table(&answers));
        }
        outcome(answers)
    }

    fn mirrored(&self) -> Option<bool> {
        match self.parity {
            Parity::Either => None,
            Parity::Normal => Some(false),
            Parity::Mirrored => Some(true),
        }
    }

    fn solver(&self) -> anyhow::Result<FrameSolver> {
        let mut solver = match &self.catalogue {
            Some(catalogue) => {
                let column = |text: &String| {
                    let (key, name) = text.split_once('=').ok_or_else(|| Error::Argument {
                        name: "--column".into(),
                        problem: format!("\"{text}\" is not KEY=NAME, e.g. v_mag=gmag"),
                    })?;
                    Ok((key.trim().to_owned(), name.trim().to_owned()))
                };
                let columns = self.column.iter().map(column).collect::<Result<BTreeMap<_, _>, Error>>()?;
                FrameSolver::from_catalogue(catalogue, &columns)?
            }
            None => {
                let path = self.config.clone().unwrap_or_else(|| "pipeline.toml".into());
                if !path.exists() {
                    let problem = "no such configuration; -c names another, --catalogue does without".into();
                    return Err(Error::NoInput { path, problem }.into());
                }
                FrameSolver::from_config(&load(&path, &self.sets)?)?
            }
        };
        solver.position_deg = self.ra.zip(self.dec);
        solver.scale_arcsec = self.scale;
        solver.radius_deg = self.radius.unwrap_or(solver.radius_deg);
        solver.scale_search_frac = self.scale_search.unwrap_or(solver.scale_search_frac);
        solver.mirrored = self.mirrored();
        Ok(solver)
    }

    fn case(&self, file: &Path) -> Answer {
        let mut answer = Answer::of(file);
        let case = match Case::read(file) {
            Ok(case) => case,
            Err(error) => return answer.failed(error),
        };
        let (stars, detections, mut hint) = (case.stars(), case.detections(), case.hint());
        hint.radius_deg = self.radius.unwrap_or(hint.radius_deg);
        hint.scale_search_frac = self.scale_search.unwrap_or(hint.scale_search_frac);
        hint.scale_arcsec = self.scale.unwrap_or(hint.scale_arcsec);
        hint.mirrored = self.mirrored().or(hint.mirrored);
        (hint.ra_deg, hint.dec_deg) = self.ra.zip(self.dec).unwrap_or((hint.ra_deg, hint.dec_deg));
        let start = Instant::now();
        let effort = Effort { max_detections: self.brightest, ..Effort::default() };
        let solved = solve_with(&stars, &detections, case.size_px(), &hint, effort);
        answer.time_s = start.elapsed().as_secs_f64();
        answer.verdict = Some(case.verdict(solved.as_ref().ok()));
        answer.size_px = case.size_px();
        answer.kind = case.case;
        answer.solved = solved.map(Box::new).map_err(|refusal| refusal.to_string());
        answer
    }
}

impl Answer {
    fn of(file: &Path) -> Answer {
        let (solved, kind) = (Err(String::new()), String::new());
        Answer { file: file.into(), kind, solved, error: None, verdict: None, size_px: (0, 0), time_s: 0.0 }
    }
    fn failed(mut self, error: Error) -> Answer {
        self.solved = Err(error.to_string());
        self.error = Some(error);
        self
    }
    fn name(&self) -> String {
        self.file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
    }
    fn word(&self) -> &'static str {
        match (self.verdict, &self.solved) {
            (Some(verdict), _) => verdict.name(),
            (None, Ok(_)) => "yes",
            (None, Err(_)) => "no",
        }
    }
}

fn frame(solver: &FrameSolver, file: &Path) -> Answer {
    let mut answer = Answer::of(file);
    let start = Instant::now();
    let solved = solver.solve(file);
    answer.time_s = start.elapsed().as_secs_f64();
    match solved {
        Ok(frame) => {
            answer.size_px = frame.size_px;
            answer.solved = Ok(Box::new(frame.solution));
            answer
        }
        Err(error) => answer.failed(error),
    }
}

fn write_wcs(folder: &Path, answer: &Answer) -> anyhow::Result<()> {
    let Ok(solution) = &answer.solved else { return Ok(()) };
    let stem = answer.file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let path = folder.join(format!("{}.wcs", stem.trim_end_matches(".fits")));
    Ok(write_atomic(&path, &solution.wcs.header_file(answer.size_px))?)
}

fn table(answers: &[Answer]) -> String {
    let width = answers.iter().map(|a| a.name().len()).max().unwrap_or(0).max(5);
    let mut text = format!(
        "{:<width$}  solved  ra_deg      dec_deg     arcsec/px  rotation_deg  parity    stars  model  rms_arcsec  \
         chance   time_s\n",
        "frame"
    );
    for a in answers {
        let head = format!("{:<width$}  {:<6}", a.name(), a.word());
        text += &match &a.solved {
            Ok(s) => format!(
                "{head}  {:<10.6}  {:<+10.6}  {:<9.5}  {:<12.4}  {:<8}  {:<5}  {:<5}  {:<10.3}  {:<7.0e}  {:.3}\n",
                s.centre_deg.0,
                s.centre_deg.1,
                s.scale_arcsec,
                s.rotation_deg,
                parity(s),
                s.pairs.len(),
                s.model.name(),
                s.rms_arcsec,
                s.chance,
                a.time_s
            ),
            Err(why) => format!("{head}  {why} ({:.3} s)\n", a.time_s),
        };
    }
    text + &summary(answers)
}

fn parity(solution: &Solution) -> &'static str {
    if solution.mirrored { "mirrored" } else { "normal" }
}

/// Right, wrong and none of each kind of case, with its times.
fn summary(answers: &[Answer]) -> String {
    let mut kinds: BTreeMap<&str, Vec<&Answer>> = BTreeMap::new();
    for answer in answers.iter().filter(|a| a.verdict.is_some()) {
        kinds.entry(&answer.kind).or_default().push(answer);
    }
    if kinds.is_empty() {
        return String::new();
    }
    let mut text = String::from("\ncase                  right  wrong  none  solved  mean_s  max_s  rms_arcsec\n");
    for (kind, of) in kinds {
        let count = |v: Verdict| of.iter().filter(|a| a.verdict == Some(v)).count();
        let mean_s = of.iter().map(|a| a.time_s).sum::<f64>() / of.len() as f64;
        let max_s = of.iter().map(|a| a.time_s).fold(0.0, f64::max);
        let mut rms: Vec<f64> = of.iter().filter_map(|a| a.solved.as_ref().ok()).map(|s| s.rms_arcsec).collect();
        rms.sort_by(f64::total_cmp);
        text += &format!(
            "{kind:<20}  {:>5}  {:>5}  {:>4}  {:>6}  {mean_s:.4}  {max_s:.3}  {}\n",
            count(Verdict::Right),
            count(Verdict::Wrong),
            count(Verdict::None),
            rms.len(),
            rms.get(rms.len() / 2).map_or("-".into(), |r| format!("{r:.3}"))
        );
    }
    text
}

fn json_line(a: &Answer) -> String {
    let mut line = serde_json::json!({
        "file": a.file.to_string_lossy(),
        "solved": a.solved.is_ok(),
        "time_s": a.time_s,
    });
    let mut put = |key: &str, value: serde_json::Value| {
        line[key] = value;
    };
    if let Some(verdict) = a.verdict {
        put("case", a.kind.as_str().into());
        put("verdict", verdict.name().into());
    }
    match &a.solved {
        Ok(s) => {
            put("ra_deg", s.centre_deg.0.into());
            put("dec_deg", s.centre_deg.1.into());
            put("scale_arcsec", s.scale_arcsec.into());
            put("rotation_deg", s.rotation_deg.into());
            put("parity", parity(s).into());
            put("n_stars", s.pairs.len().into());
            put("rms_arcsec", s.rms_arcsec.into());
            put("chance", s.chance.into());
            put("n_hypotheses", s.n_hypotheses.into());
            put("model", s.model.name().into());
            let value = |v: WcsValue| match v {
                WcsValue::Text(t) => serde_json::Value::from(t),
                WcsValue::Real(r) => serde_json::Value::from(r),
            };
            let cards: serde_json::Map<_, _> = s.wcs.cards().into_iter().map(|(k, v, _)| (k, value(v))).collect();
            put("wcs", cards.into());
        }
        Err(why) => put("reason", why.as_str().into()),
    }
    format!("{line}\n")
}

/// The exit: unreadable files first, then wrong cases, then frames without a solution.
fn outcome(answers: Vec<Answer>) -> anyhow::Result<()> {
    let n = answers.len();
    let wrong = answers.iter().filter(|a| a.verdict == Some(Verdict::Wrong)).count();
    let frames = answers.iter().filter(|a| a.verdict.is_none()).count();
    let lost = answers.iter().filter(|a| a.verdict.is_none() && a.solved.is_err()).count();
    let unreadable = |e: &Error| matches!(e, Error::Io { .. } | Error::Fits { .. } | Error::Table { .. });
    if let Some(error) = answers.into_iter().filter_map(|a| a.error).find(unreadable) {
        return Err(error.into());
    }
    if wrong > 0 {
        tell(
            "note: a case without a solution that is solved may hold its own mirror image; --parity says which parity \
             the optics have",
        );
        return Err(Error::PoorNight { problem: format!("{wrong} of {n} cases solved wrongly") }.into());
    }
    if lost > 0 {
        return Err(Error::PoorNight { problem: format!("{lost} of {frames} frames not solved") }.into());
    }
    Ok(())
}
