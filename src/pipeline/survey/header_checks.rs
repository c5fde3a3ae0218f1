//! What headers say that a single frame cannot judge: another site, flats upside down, the Sun above a night's frames.
//!
//! Degrees. A frame of another site or a flat of the other row order is taken out of the night with its reason; the rest is
//! reported in notes. It does not cover the cadence ([`crate::pipeline::vet`]).

use std::collections::BTreeMap;

use crate::base::error::{Error, Result};
use crate::base::time::mjd_utc;
use crate::config::{self, Config};
use crate::frames::header::{SiteCheck, check_site, header_site, optics, row_order};
use crate::frames::{Detector, Exposure};
use crate::orbit::{EarthOrientation, Site, bodies, sun_altaz};
use crate::pipeline::survey::files::{Survey, Unreadable};
use crate::pipeline::survey::header_warnings::{Stamp, cadence_conflicts, egain_warning_of, header_warnings};

/// Takes out light frames of another site, and flats whose rows run the other way than those of the lights.
pub(crate) fn check_headers(survey: &mut Survey, stars: &mut Vec<Exposure>, config: &Config) {
    if config.header.check_site {
        for list in [stars as &mut Vec<Exposure>, &mut survey.targets] {
            let (good, bad): (Vec<_>, Vec<_>) =
                std::mem::take(list).into_iter().map(|e| (site_problem(&e, config), e)).partition(|(p, _)| p.is_none());
            *list = good.into_iter().map(|(_, e)| e).collect();
            survey.other_site.extend(bad.iter().map(|(_, e)| e.path.clone()));
            survey.unreadable.extend(bad.into_iter().filter_map(|(p, e)| refused(e, p)));
        }
    }
    let order = stars.iter().chain(&survey.targets).find_map(|e| row_order(&e.header));
    let Some(order) = order else { return };
    let (good, bad): (Vec<_>, Vec<_>) =
        std::mem::take(&mut survey.flats).into_iter().partition(|e| row_order(&e.header).is_none_or(|o| o == order));
    survey.flats = good;
    survey.unreadable.extend(bad.into_iter().filter_map(|e| {
        let own = row_order(&e.header).unwrap_or_default();
        let problem = format!(
            "'{own}', but the light frames are '{order}': this flat is upside down against them; write all frames with one \
             program and one setting"
        );
        refused(e, Some(("ROWORDER".into(), problem)))
    }));
}

fn refused(exposure: Exposure, problem: Option<(String, String)>) -> Option<Unreadable> {
    let (keyword, problem) = problem?;
    let error = Error::Header { path: exposure.path.clone(), keyword, problem };
    Some(Unreadable { path: exposure.path, error })
}

/// Keyword and problem of a frame whose header states another site.
pub(crate) fn site_problem(exposure: &Exposure, config: &Config) -> Option<(String, String)> {
    let stated = header_site(&exposure.header, &config.header.aliases).0?;
    let SiteCheck::Differs(off_deg) = check_site(&stated, &config.site) else { return None };
    let problem = format!(
        "another site, {:.4} {:.4} deg, {off_deg:.2} deg from the configured {} {} deg: correct [site], name the right \
         keywords in header.aliases.site_lat and site_lon, or set header.check_site = false to use the configured one",
        stated.lat_deg, stated.lon_deg, config.site.lat_deg, config.site.lon_deg
    );
    Some((stated.source, problem))
}

/// A night of which every light frame was taken at another site has the wrong configuration.
///
/// # Errors
/// [`Error::Header`]: that of the first frame.
pub fn refuse_other_site(survey: &Survey) -> Result<()> {
    if survey.n_star_frames() + survey.targets.len() > 0 {
        return Ok(());
    }
    let other = survey.unreadable.iter().find_map(|u| match &u.error {
        Error::Header { path, keyword, problem } if survey.other_site.contains(path) => {
            Some(Error::Header { path: path.clone(), keyword: keyword.clone(), problem: problem.clone() })
        }
        _ => None,
    });
    other.map_or(Ok(()), Err)
}

/// What the headers of the night say that its observer should know: sites, clocks, exposure times, the Sun, and whatever
/// `satphot inspect` warns of, once for all frames that say it.
#[must_use]
pub fn header_notes(survey: &Survey, config: &Config, detector: &Detector) -> Vec<String> {
    let lights: Vec<&Exposure> = survey.pointings.iter().flatten().chain(&survey.targets).collect();
    let mut notes: Vec<String> = Vec::new();
    notes.extend(site_note(&lights, config));
    notes.extend(sun_note(&lights, &config.site));
    // one note per warning, with the number of frames: messages differ in their values
    let mut counted: BTreeMap<String, (usize, &str, String)> = BTreeMap::new();
    for e in &lights {
        let own = e.warnings.iter().cloned();
        let all = own.chain(header_warnings(e, config, true)).chain(egain_warning_of(e, detector));
        for warning in all {
            let kind: String = warning.chars().filter(|c| !c.is_ascii_digit()).collect();
            counted.entry(kind).and_modify(|(n, ..)| *n += 1).or_insert((1, &e.name, warning));
        }
    }
    notes.extend(counted.into_values().map(|(n, name, warning)| {
        let frames = if n == 1 { name.to_string() } else { format!("{n} frames, {name}") };
        format!("{frames}: {warning}")
    }));
    notes.extend(cadence_note(&lights, config));
    notes
}

/// Exposures that do not fit between their neighbours: how many, and the first.
fn cadence_note(lights: &[&Exposure], config: &Config) -> Option<String> {
    let stamp = |e: &&&Exposure| {
        let time = e.time.as_ref()?;
        Some(Stamp {
            name: e.name.clone(),
            camera: optics(&e.header, &config.header.aliases).camera.map(|c| c.value),
            start_s: mjd_utc(time.mid) * 86_400.0 - e.exptime_s / 2.0,
            exptime_s: e.exptime_s,
            err_s: time.err_s,
        })
    };
    let stamps: Vec<Stamp> = lights.iter().filter_map(|e| stamp(&e)).collect();
    let conflicts = cadence_conflicts(&stamps);
    let (first, words) = conflicts.first()?;
    let name = &stamps[*first].name;
    Some(match conflicts.len() {
        1 => format!("{name}: {words}"),
        n => format!("{n} frames, {name}: {words}"),
    })
}

fn site_note(lights: &[&Exposure], config: &Config) -> Option<String> {
    let differs = |e: &&&Exposure| {
        header_site(&e.header, &config.header.aliases)
            .0
            .is_some_and(|header| check_site(&header, &config.site) != SiteCheck::Agrees)
    };
    let n = lights.iter().filter(differs).count();
    let first = lights.iter().find(differs)?;
    let stated = header_site(&first.header, &config.header.aliases).0?;
    let west = check_site(&stated, &config.site) == SiteCheck::WestPositive;
    Some(format!(
        "{n} frames say {}, {}: {} {} deg, configured {} {} deg; the configured one is used: check [site]",
        if west { "a longitude counted west" } else { "another site" },
        first.name,
        stated.lat_deg,
        stated.lon_deg,
        config.site.lat_deg,
        config.site.lon_deg
    ))
}

fn sun_note(lights: &[&Exposure], site: &config::Site) -> Option<String> {
    let site = Site::from_config(site).ok()?;
    let up: Vec<(&Exposure, f64)> = lights
        .iter()
        .filter_map(|e| Some((*e, sun_alt_deg(&site, e)?)))
        .filter(|(_, alt_deg)| *alt_deg > SUN_UP_DEG)
        .collect();
    let (first, alt_deg) = up.first()?;
    Some(format!("{} light frames were taken by day, {}: {}", up.len(), first.name, sun_words(*alt_deg)))
}

/// The Sun above this altitude contradicts a night \[deg\].
pub(crate) const SUN_UP_DEG: f64 = 0.0;

/// What a Sun above the horizon suggests.
pub(crate) fn sun_words(alt_deg: f64) -> String {
    format!(
        "the Sun stood {alt_deg:.0} deg above the horizon at this time and site; is DATE-OBS local time (time.offset_s), \
         and is the longitude counted east?"
    )
}

/// Altitude of the Sun at mid-exposure \[deg\].
pub(crate) fn sun_alt_deg(site: &Site, exposure: &Exposure) -> Option<f64> {
    let mid = exposure.time.as_ref()?.mid;
    let bodies = bodies(&mid, &EarthOrientation::default()).ok()?;
    Some(sun_altaz(site, &bodies).0.to_degrees())
}
