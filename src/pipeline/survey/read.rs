//! Which file is what: every file of the configured folders read and sorted.

use super::files::Survey;
use super::files::Unreadable;
use super::files::by_time;
use super::files::own_results;
use super::header_checks::check_headers;
use crate::base::error::Error;
use crate::base::error::Result;
use crate::base::stop::Stop;
use crate::config::Config;
use crate::fits::find_files;
use crate::frames::Role;
use crate::frames::classify;
use std::path::Path;
use std::path::PathBuf;

/// Reads every header of the night (or of `files`, if any are given) and sorts the files by role.
///
/// Results of an earlier run inside an input folder are not inputs.
///
/// # Errors
/// [`Error::NoInput`] when there is no FITS file.
pub fn survey(config: &Config, files: &[PathBuf], target_names: &[String]) -> Result<Survey> {
    survey_until(config, files, target_names, &Stop::default())
}

/// As [`survey`], until a stop is requested.
///
/// # Errors
/// Those of [`survey`]; [`Error::Interrupted`].
pub fn survey_until(config: &Config, files: &[PathBuf], target_names: &[String], stop: &Stop) -> Result<Survey> {
    let inputs = if files.is_empty() { &config.night.input } else { files };
    if inputs.is_empty() {
        return Err(Error::Config { key: "night.input".into(), problem: "is empty; name folders or files".into() });
    }
    let found = find_files(inputs)?;
    let own = own_results(config, inputs);
    let is_own = |path: &Path| match (&own, std::fs::canonicalize(path)) {
        (Some(own), Ok(path)) => path.starts_with(own),
        _ => false,
    };
    let mut survey = Survey::default();
    let mut stars = Vec::new();
    for path in found.into_iter().filter(|p| files.contains(p) || !is_own(p)) {
        stop.check(|| "stopped while the headers were read; nothing was written: run again".into())?;
        match classify(&path, config, target_names) {
            Ok(exposure) => match exposure.role {
                Role::Flat => survey.flats.push(exposure),
                Role::Stars => stars.push(exposure),
                Role::Target => survey.targets.push(exposure),
                Role::Bias | Role::Dark | Role::Ignored | Role::OtherTarget | Role::OtherFilter => {
                    survey.others.push(exposure);
                }
            },
            Err(error) => survey.unreadable.push(Unreadable { path, error }),
        }
    }
    if survey.is_empty() && stars.is_empty() {
        return Err(Error::NoInput {
            path: inputs.first().cloned().unwrap_or_default(),
            problem: "holds results of satphot only, no frames".into(),
        });
    }
    by_time(&mut survey.targets);
    by_time(&mut stars);
    check_headers(&mut survey, &mut stars, config);
    survey.group_stars(stars, config);
    Ok(survey)
}
