//! The preflight: everything that can be checked before a pixel is read, in one list for `satphot run`, its dry run and the
//! single stages.
//!
//! A check adds errors (the night is refused, and all of them are reported at once), notes, and lines to paste into
//! pipeline.toml. A new check is a function and a line in `CHECKS`. It does not cover what only pixels show
//! ([`super::scale::check_stars`]).

use super::findings::Findings;
use super::findings::MissingKey;
use std::collections::BTreeMap;
use std::path::PathBuf;

use super::read::survey_until;
use crate::base::error::{Error, Result};
use crate::base::stop::Stop;
use crate::config::Config;
use crate::fits::Header;
use crate::frames::{Exposure, Role, check_pattern};
use crate::pipeline::prepared::Prepared;
use crate::pipeline::survey::files::Survey;
use crate::pipeline::survey::filters::{agree_on_band, reduce_one_filter};
use crate::pipeline::survey::header_checks::{header_notes, refuse_other_site};
use crate::pipeline::survey::instrument::check_instrument;
use crate::pipeline::survey::scale;
use crate::zeropoint::fit::Zeropoint;

/// A night that was looked at before its work begins.
#[derive(Debug)]
pub struct Preflight {
    /// What every frame shares; pieces with an error are missing.
    pub prepared: Prepared,
    /// The files by role.
    pub survey: Survey,
    /// The result.
    pub findings: Findings,
    /// Whether a zeropoint is fitted to the stars of this night.
    fits: bool,
}

/// A check: looks at a night, takes frames out of it, says what it found.
type Check = fn(&mut Preflight);

/// The checks, in the order in which their errors count: the first decides the exit code.
const CHECKS: &[(&str, Check)] = &[
    ("satellites", |p| p.prepared.set_others_aside(&mut p.survey)),
    ("filter", |p| p.refuse(|p| reduce_one_filter(&mut p.survey, &p.prepared.config))),
    ("site", |p| p.refuse(|p| refuse_other_site(&p.survey))),
    ("files", |p| p.refuse(files)),
    ("instrument", |p| check_instrument(&mut p.survey, &p.prepared.config, &mut p.findings)),
    ("pattern", |p| p.refuse(pattern)),
    ("gain", gains),
    ("elements", |p| p.refuse(elements)),
    ("master flat", |p| p.refuse(master_flat)),
    ("zeropoint", |p| p.refuse(previous_zeropoint)),
    ("band", |p| p.refuse(band)),
    ("model", |p| p.findings.notes.extend(p.prepared.model_note())),
    ("scale", |p| p.refuse(headers_of_scale)),
    ("headers", |p| p.findings.notes.extend(header_notes(&p.survey, &p.prepared.config, &p.prepared.detector))),
];

/// Reads the configuration's files and every header of the night (or of `files`), and makes every check.
///
/// # Errors
/// [`Error::Config`] for a site that is none; [`Error::Interrupted`]. Whatever else is wrong is in [`Preflight::findings`].
pub fn preflight(config: &Config, files: &[PathBuf], stop: &Stop) -> Result<Preflight> {
    let _reading = stop.reading();
    let (prepared, errors) = Prepared::gather(config)?;
    let mut names = prepared.target_names();
    if prepared.tracker.is_none() && !errors.is_empty() {
        // elements would name the target; the model names the same satellite
        names.extend(config.model.iter().map(|m| m.satellite.clone()));
    }
    let survey = survey_until(config, files, &names, stop);
    if let Err(stopped @ Error::Interrupted { .. }) = survey {
        return Err(stopped);
    }
    Ok(preflight_of(prepared, errors, survey, true))
}

/// As [`preflight`], of files that were sorted already; `errors` are those of the prepared, `fits` says whether a zeropoint is
/// fitted to the stars of this night.
#[must_use]
pub fn preflight_of(prepared: Prepared, errors: Vec<Error>, survey: Result<Survey>, fits: bool) -> Preflight {
    let mut findings = Findings { errors, ..Findings::default() };
    let survey = survey.map_err(|error| findings.errors.push(error));
    let there = survey.is_ok();
    let mut preflight = Preflight { prepared, survey: survey.unwrap_or_default(), findings, fits };
    if there {
        CHECKS.iter().for_each(|(_, check)| check(&mut preflight));
    }
    preflight
}

impl Preflight {
    /// The night, if nothing speaks against it; with what should be known of it.
    ///
    /// # Errors
    /// The only error found, or [`Error::Preflight`] with all of them and the lines to paste.
    pub fn ready(self) -> Result<(Prepared, Survey, Vec<String>)> {
        let Self { prepared, survey, mut findings, .. } = self;
        let paste = findings.paste();
        match findings.errors.len() {
            0 => {
                if !paste.is_empty() {
                    findings.notes.push(format!("pipeline.toml lacks\n{}", paste.trim_end()));
                }
                Ok((prepared, survey, findings.notes))
            }
            1 if findings.missing.len() < 2 => Err(findings.errors.swap_remove(0)),
            _ => Err(Error::Preflight { problems: findings.errors, paste }),
        }
    }

    /// Keeps the error of a check that gives one.
    fn refuse(&mut self, check: impl FnOnce(&mut Self) -> Result<()>) {
        if let Err(error) = check(self) {
            self.findings.errors.push(error);
        }
    }
}

/// Refuses a night without frames.
fn files(p: &mut Preflight) -> Result<()> {
    let Preflight { survey, prepared, .. } = p;
    if survey.n_star_frames() + survey.targets.len() + survey.flats.len() > 0 {
        return Ok(());
    }
    // a night of another site has an error of its own
    if refuse_other_site(survey).is_err() {
        return Ok(());
    }
    let problem = match survey.unreadable.first() {
        Some(first) => format!("none of the {} files can be used; the first: {}", survey.len(), first.error),
        None => "holds no flat, star or target frames (IMAGETYP, OBJECT; or name them in [frames])".into(),
    };
    Err(Error::NoInput { path: prepared.config.night.input.first().cloned().unwrap_or_default(), problem })
}

/// The pattern of a colour sensor, which the pixels of the first flat, star and target frame must show.
fn pattern(p: &mut Preflight) -> Result<()> {
    let survey = &p.survey;
    let firsts = [survey.flats.first(), survey.pointings.iter().flatten().next(), survey.targets.first()];
    let pedestal_adu = p.prepared.config.detector.pedestal_adu;
    firsts.into_iter().flatten().try_for_each(|first| match check_pattern(first, pedestal_adu) {
        // a damaged frame is a row of its own
        Err(error @ Error::Config { .. }) => Err(error),
        _ => Ok(()),
    })
}

/// Electrons per ADU and read noise of every gain setting of the light frames: an error where a kind of frames has none of
/// them, else a note; the lines that are missing in either case.
fn gains(p: &mut Preflight) {
    let Preflight { prepared, survey, findings, .. } = p;
    let lights: Vec<&Exposure> = survey.pointings.iter().flatten().chain(&survey.targets).collect();
    let mut first: Option<Error> = None;
    for role in [Role::Target, Role::Stars] {
        let of_role: Vec<&&Exposure> = lights.iter().filter(|e| e.role == role).collect();
        let errors: Vec<Error> = of_role.iter().filter_map(|e| prepared.detector.gain(e).err()).collect();
        let (n, all) = (errors.len(), of_role.len());
        let Some(error) = errors.into_iter().next() else { continue };
        if n == all {
            first.get_or_insert(error);
        } else {
            let kind = super::instrument::kind_of(role);
            findings.notes.push(format!("{n} of {all} {kind}s will fail; the first: {error}"));
        }
    }
    // an unknown camera has been reported, with the same keys
    let unknown = findings.errors.iter().any(|e| matches!(e, Error::Config { key, .. } if key == "detector.camera"));
    findings.errors.extend(first.filter(|_| !unknown));
    findings.missing.extend(missing_settings(prepared, &lights));
}

/// Lines for the gain settings of the frames that the tables lack: the header's number, else a proposal, else a zero that the
/// configuration refuses until it is filled in.
fn missing_settings(prepared: &Prepared, lights: &[&Exposure]) -> Vec<MissingKey> {
    let detector = &prepared.detector;
    let mut settings: BTreeMap<i64, (usize, &Exposure)> = BTreeMap::new();
    for e in lights {
        if let Some(setting) = e.setting {
            settings.entry(setting.0).or_insert((0, e)).0 += 1;
        }
    }
    let egain = prepared.config.detector.use_header_egain;
    let mut lines = Vec::new();
    for (setting, (n, exposure)) in settings {
        let (has_gain, has_noise) = detector.tabulated(setting);
        let suggestion = detector.suggestion(setting);
        let of = |header: Option<f64>, source: &str, proposal: Option<f64>| match (header, proposal) {
            (Some(value), _) => format!("\"{setting}\" = {value:?}   # {source} of {n} frames"),
            (None, Some(value)) => {
                let value = (value * 1e5).round() / 1e5;
                format!(
                    "\"{setting}\" = {value:?}   # {n} frames; proposed from the nearest setting of the table: measure it"
                )
            }
            (None, None) => format!("\"{setting}\" = 0.0   # {n} frames; fill in: 0 is refused"),
        };
        if !has_gain && !egain {
            let line = of(exposure.header_e_per_adu, "EGAIN", suggestion.map(|s| s.0));
            lines.push(MissingKey { table: "detector.e_per_adu".into(), line });
        }
        let in_header = header_read_noise(exposure);
        let from_header = egain && in_header.is_some();
        if !has_noise && !from_header {
            let line = of(in_header, "RDNOISE", suggestion.map(|s| s.1));
            lines.push(MissingKey { table: "detector.read_noise_e".into(), line });
        }
    }
    lines
}

fn header_read_noise(exposure: &Exposure) -> Option<f64> {
    ["RDNOISE", "READNOIS", "READNOISE"].iter().find_map(|k| exposure.header.number(k)).filter(|n| *n > 0.0)
}

/// Elements that are refused for every target frame.
fn elements(p: &mut Preflight) -> Result<()> {
    let Some(tracker) = &p.prepared.tracker else { return Ok(()) };
    let targets = &p.survey.targets;
    let mut refused: Vec<Error> =
        targets.iter().filter_map(|e| tracker.elements_at(&e.time.as_ref()?.mid).err()).collect();
    match refused.len() == targets.len() && !refused.is_empty() {
        true => Err(refused.swap_remove(0)),
        false => Ok(()),
    }
}

/// A master flat of another night that is not there, or no FITS file.
fn master_flat(p: &mut Preflight) -> Result<()> {
    let Some(path) = &p.prepared.config.flat.master else { return Ok(()) };
    if path.is_file() {
        return Header::read(path).map(|_| ());
    }
    let problem = "no such file (flat.master): name the master flat of a finished night".to_string();
    Err(Error::NoInput { path: path.clone(), problem })
}

/// Refuses a zeropoint of another night that is missing or cannot be read.
fn previous_zeropoint(p: &mut Preflight) -> Result<()> {
    let Some(path) = &p.prepared.config.zeropoint.previous else { return Ok(()) };
    if path.is_file() {
        return Zeropoint::read(path).map(|_| ());
    }
    let problem = "no such file (zeropoint.previous): name the zeropoint.toml of a finished night".to_string();
    Err(Error::NoInput { path: path.clone(), problem })
}

/// What filter, catalogue, master flat, the zeropoint of another night and the configuration say of the band.
fn band(p: &mut Preflight) -> Result<()> {
    // a zeropoint that cannot be read has its own error
    if p.prepared.config.zeropoint.previous.as_ref().is_some_and(|path| Zeropoint::read(path).is_err()) {
        return Ok(());
    }
    let notes = agree_on_band(&p.survey, &mut p.prepared, p.fits)?;
    p.findings.notes.extend(notes);
    Ok(())
}

/// The scale, as far as headers state it.
fn headers_of_scale(p: &mut Preflight) -> Result<()> {
    p.findings.scale_in_doubt = scale::check_headers(&p.survey, &p.prepared)?;
    Ok(())
}
