//! `satphot inspect`: what was understood from headers, and why.

use std::path::{Path, PathBuf};

use clap::Args;
use rayon::prelude::*;
use satphot::Error;
use satphot::base::threads::with_threads;
use satphot::frames::header::header_files;
use satphot::pipeline::inspect::file::mark_cadence;
use satphot::pipeline::inspect::inspector::Inspector;
use satphot::pipeline::inspect::record::Inspection;

use super::{load, print, tell};

const AFTER_HELP: &str = "\
Examples:
  satphot inspect night/*.fits                     what satphot would use, and why
  satphot inspect -c pipeline.toml night/          against the site, camera, catalogue and elements of a night
  satphot inspect header.txt                       a header pasted into a text file, as cards or KEYWORD = value
  satphot inspect --json *.fits | jq -r '[.file, .time.date_mid, .time.time_source] | @tsv'

The mid-exposure time is taken from, in this order: the configuration (time.date_obs_means, header.aliases.date_obs), GPS shutter
times, start and end, the middle, start + EXPTIME/2 with what the comment of the card says. Nothing is modified.

Exit codes: 0 understood; 3 more than half of the files could not be read; 4 none could.";

/// Reports what was understood of frames and headers: mid-exposure time with its source, its error and what was
/// rejected, exposure, gain, site, pointing, filter, type, binning, calibration, world coordinates, warnings.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Inspect {
    /// FITS files, headers as text (.txt, .hdr), or folders of them
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Configuration of the night: site, camera, catalogue, elements, aliases [default: none]
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration, e.g. --set 'header.aliases.egain=["MYGAIN"]' (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// One JSON object per line instead of text
    #[arg(long)]
    json: bool,
    /// Print no notes
    #[arg(short, long)]
    quiet: bool,
    /// Number of threads; 0 = all cores
    #[arg(short, long, value_name = "N", default_value_t = 0, value_parser = super::threads)]
    jobs: usize,
}

impl Inspect {
    pub fn execute(self) -> anyhow::Result<()> {
        let config = self.config.as_ref().map(|path| self.load(path)).transpose()?;
        let inspector = Inspector::new(config, &self.sets)?;
        for note in inspector.notes.iter().filter(|_| !self.quiet) {
            tell(&format!("note: {note}"));
        }
        let mut files = Vec::new();
        for input in &self.files {
            files.extend(header_files(input)?);
        }
        let mut answers: Vec<(PathBuf, Result<Inspection, Error>)> = with_threads(self.jobs, || {
            files.into_par_iter().map(|file| (file.clone(), inspector.inspect(&file))).collect()
        })?;
        mark_cadence(answers.iter_mut().filter_map(|(_, answer)| answer.as_mut().ok()).collect());
        for (file, answer) in &answers {
            print(&if self.json { json_line(file, answer)? } else { text(file, answer) });
        }
        outcome(answers)
    }

    fn load(&self, path: &Path) -> anyhow::Result<satphot::config::Config> {
        if !path.exists() {
            let problem = "no such configuration; without -c headers are read by themselves".into();
            return Err(Error::NoInput { path: path.to_path_buf(), problem }.into());
        }
        load(path, &self.sets)
    }
}

fn text(file: &Path, answer: &Result<Inspection, Error>) -> String {
    match answer {
        Ok(inspection) => format!("{}\n", inspection.text()),
        Err(error) => format!("{}\n  UNREADABLE  {}\n\n", file.display(), plain(file, error)),
    }
}

fn json_line(file: &Path, answer: &Result<Inspection, Error>) -> anyhow::Result<String> {
    let line = match answer {
        Ok(inspection) => serde_json::to_string(inspection)?,
        Err(error) => {
            serde_json::json!({ "file": file.to_string_lossy(), "usable": false, "error": plain(file, error) })
                .to_string()
        }
    };
    Ok(line + "\n")
}

/// An error without the file's name in front.
fn plain(file: &Path, error: &Error) -> String {
    let words = error.to_string();
    words.strip_prefix(&format!("{}: ", file.display())).unwrap_or(&words).to_string()
}

/// The exit: unreadable files count once half of them are.
fn outcome(answers: Vec<(PathBuf, Result<Inspection, Error>)>) -> anyhow::Result<()> {
    let n = answers.len();
    let mut errors: Vec<Error> = answers.into_iter().filter_map(|(_, answer)| answer.err()).collect();
    if errors.is_empty() || 2 * errors.len() <= n {
        return Ok(());
    }
    if errors.len() == n {
        return Err(errors.swap_remove(0).into());
    }
    Err(Error::PoorNight { problem: format!("{} of {n} files could not be read", errors.len()) }.into())
}
