//! Stated passes against the sky: which rows cannot be true, and what would make them true.
//!
//! Altitudes in deg without refraction, times in UTC, the Moon's V by the law of Cox at mean distance. What has no
//! elements near enough in time is checked for Sun and Moon alone.

use hifitime::Epoch;

use super::pass_rows::StatedPass;
use super::trackers::Targets;
use crate::base::error::Result;
use crate::base::time::{iso_utc, seconds_between, shifted};
use crate::brightness::light_class::{PaperLabel, SkyClass, classes};
use crate::brightness::light_sources::moon_v_mag;
use crate::orbit::{EarthOrientation, Pass, Site, Tracker, bodies, moon_altaz, passes, sun_altaz};

const DAY_S: f64 = 86_400.0;
/// How many days a date may be wrong by and still be found.
const DATE_ERR_D: i32 = 3;

/// How much a statement may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Error of the stated time \[s\].
    pub time_s: f64,
    /// Of the Moon's lit share \[%\].
    pub moon_pct: f64,
    /// Of the Sun's altitude, next to what it moves in the error of the time \[deg\].
    pub sun_deg: f64,
    /// Passes reach at least this altitude \[deg\].
    pub min_alt_deg: f64,
}

impl Default for Tolerances {
    /// 10 min, 1 %, 1°, 10°: times rounded to ten minutes, the rest to its last digit.
    fn default() -> Self {
        Self { time_s: 600.0, moon_pct: 1.0, sun_deg: 1.0, min_alt_deg: 10.0 }
    }
}

/// Sun and Moon over a site.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunAndMoon {
    /// Altitude of the Sun \[deg\].
    pub sun_alt_deg: f64,
    /// Altitude of the Moon \[deg\].
    pub moon_alt_deg: f64,
    /// Phase angle of the Moon from the site, 0 = full \[deg\].
    pub moon_phase_deg: f64,
    /// Share of its disc that is lit \[%\].
    pub moon_illum_pct: f64,
}

/// One pass, by its highest point.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundPass {
    /// When.
    pub epoch: Epoch,
    /// How high \[deg\].
    pub alt_deg: f64,
    /// How far \[km\].
    pub range_km: f64,
    /// The paper's label of the whole pass.
    pub label: PaperLabel,
    /// The stated time, with its error, falls into it.
    pub at_stated_time: bool,
}

/// What is to be thought of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// Everything stated agrees.
    Agrees,
    /// Sun, Moon and label agree; the satellite could not be checked.
    AgreesWithoutSatellite,
    /// The pass is there, but a number next to it is another.
    Differs,
    /// No such pass at that time.
    CannotBe,
}

/// A row with what is true of its moment.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedPass {
    /// As stated.
    pub stated: StatedPass,
    /// At the stated time.
    pub sky: SunAndMoon,
    /// Of the Moon at its phase, law of Cox \[mag\].
    pub moon_v_mag: f64,
    /// Altitude of the satellite at the stated time \[deg\].
    pub alt_deg: Option<f64>,
    /// The pass at the stated time, else the nearest one.
    pub pass: Option<FoundPass>,
    /// The verdict.
    pub standing: Standing,
    /// What does not agree, and what could not be checked.
    pub remarks: Vec<String>,
    /// Dates that would make an impossible row true, the likelier first: days later, and the pass of that date.
    pub proposed: Vec<(i32, FoundPass)>,
    /// What would make it true, in words.
    pub remedy: Option<String>,
}

impl Standing {
    /// As tables spell it.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::AgreesWithoutSatellite => "agrees (sky only)",
            Self::Differs => "differs",
            Self::CannotBe => "cannot be true",
        }
    }
}

/// Sun and Moon at an instant.
///
/// # Errors
/// [`crate::Error::Orbit`] outside 1900-2100.
pub fn sun_and_moon(site: &Site, epoch: &Epoch) -> Result<SunAndMoon> {
    let b = bodies(epoch, &EarthOrientation::default())?;
    let phase_rad = (b.sun_itrs_km - b.moon_itrs_km).angle_to(&(site.position() - b.moon_itrs_km));
    Ok(SunAndMoon {
        sun_alt_deg: sun_altaz(site, &b).0.to_degrees(),
        moon_alt_deg: moon_altaz(site, &b).0.to_degrees(),
        moon_phase_deg: phase_rad.to_degrees(),
        moon_illum_pct: 50.0 * (1.0 + phase_rad.cos()),
    })
}

/// Checks every row.
///
/// # Errors
/// [`crate::Error::Orbit`] for a date outside 1900-2100, and elements that fail to propagate.
pub fn check_passes(
    rows: &[StatedPass],
    site: &Site,
    targets: &Targets,
    tolerances: &Tolerances,
) -> Result<Vec<CheckedPass>> {
    rows.iter().map(|row| check(row, site, targets, tolerances)).collect()
}

fn check(row: &StatedPass, site: &Site, targets: &Targets, tolerances: &Tolerances) -> Result<CheckedPass> {
    let sky = sun_and_moon(site, &row.epoch)?;
    let mut remarks = differences(row, site, &sky, tolerances)?;
    let around = match targets.find(&row.target) {
        None => Err(format!("pass not checked: no elements of {}; argument `elements` names a file", row.target)),
        Some(tracker) => around_the_time(tracker, &row.epoch, tolerances),
    };
    let (mut alt_deg, mut pass, mut proposed, mut remedy) = (None, None, Vec::new(), None);
    let mut standing = if remarks.is_empty() { Standing::Agrees } else { Standing::Differs };
    match around {
        Err(why) => {
            if standing == Standing::Agrees {
                standing = Standing::AgreesWithoutSatellite;
            }
            remarks.push(why);
        }
        Ok((alt, stays)) => {
            alt_deg = Some(alt);
            let found = nearest(&stays, &row.epoch, tolerances);
            match &found {
                Some(found) if found.at_stated_time => {
                    if row.label.is_some_and(|label| label != found.label) {
                        standing = Standing::Differs;
                        remarks.push(format!("by the light on it the pass is {}", found.label));
                    }
                }
                _ => {
                    standing = Standing::CannotBe;
                    let ten_min = tolerances.time_s / 60.0;
                    remarks.push(format!(
                        "{} is at {alt:.1} deg, and not above {} deg within {ten_min:.0} min",
                        row.target, tolerances.min_alt_deg
                    ));
                    proposed = other_dates(row, &stays, tolerances);
                    remedy = Some(remedy_of(row, site, &proposed, found.as_ref(), tolerances)?);
                }
            }
            pass = found;
        }
    }
    let moon_v_mag = moon_v_mag(sky.moon_phase_deg);
    Ok(CheckedPass { stated: row.clone(), sky, moon_v_mag, alt_deg, pass, standing, remarks, proposed, remedy })
}

/// What of Sun, Moon and magnitudes does not agree.
fn differences(row: &StatedPass, site: &Site, sky: &SunAndMoon, tolerances: &Tolerances) -> Result<Vec<String>> {
    let mut remarks = Vec::new();
    if let Some(stated) = row.moon_illum_pct.filter(|s| (s - sky.moon_illum_pct).abs() > tolerances.moon_pct) {
        remarks.push(format!("Moon {:.1} % lit, not {stated}", sky.moon_illum_pct));
    }
    if let Some(stated) = row.sun_alt_deg {
        let at = |s: f64| sun_and_moon(site, &shifted(row.epoch, s)).map(|b| b.sun_alt_deg);
        let (a, b) = (at(-tolerances.time_s)?, at(tolerances.time_s)?);
        let (low, high) = (a.min(b).min(sky.sun_alt_deg), a.max(b).max(sky.sun_alt_deg));
        if !(low - tolerances.sun_deg..=high + tolerances.sun_deg).contains(&stated) {
            remarks.push(format!("Sun at {:.1} deg, not {stated}", sky.sun_alt_deg));
        }
    }
    let is_day = SkyClass::of_sun_alt(sky.sun_alt_deg) == SkyClass::Day;
    if let Some(stated) = row.label.filter(|l| (*l == PaperLabel::Day) != is_day) {
        remarks.push(format!("the Sun at {:.1} deg is not {stated}", sky.sun_alt_deg));
    }
    if let (Some(max), Some(median)) = (row.max_v_mag, row.median_v_mag)
        && max > median
    {
        remarks.push(format!("the brightest, V {max}, is fainter than the median, {median}"));
    }
    Ok(remarks)
}

/// Altitude at the stated time \[deg\] and every pass of the days around it; an explanation where elements fail.
fn around_the_time(
    tracker: &Tracker,
    epoch: &Epoch,
    tolerances: &Tolerances,
) -> std::result::Result<(f64, Vec<Pass>), String> {
    let why = |e: crate::Error| format!("pass not checked: {e}");
    let alt = tracker.altitude_at(epoch).map_err(why)?.to_degrees();
    let search = |days: f64| {
        let (from, to) = (shifted(*epoch, -days * DAY_S), shifted(*epoch, days * DAY_S));
        passes(tracker, &from, &to, tolerances.min_alt_deg.to_radians())
    };
    // elements may be too old for the ends of the longer search
    let stays = search(f64::from(DATE_ERR_D) + 0.1).or_else(|_| search(0.6)).map_err(why)?;
    Ok((alt, stays))
}

/// Seconds from an instant to a pass; 0 inside it.
fn distance_s(pass: &Pass, epoch: &Epoch) -> f64 {
    let (before, after) = (seconds_between(*epoch, pass.rise.epoch), seconds_between(pass.set.epoch, *epoch));
    before.max(after).max(0.0)
}

fn nearest(stays: &[Pass], epoch: &Epoch, tolerances: &Tolerances) -> Option<FoundPass> {
    let pass = stays.iter().min_by(|a, b| distance_s(a, epoch).total_cmp(&distance_s(b, epoch)))?;
    found(pass, distance_s(pass, epoch) <= tolerances.time_s)
}

fn found(pass: &Pass, at_stated_time: bool) -> Option<FoundPass> {
    let moments = [&pass.rise, &pass.culmination, &pass.set];
    let labels = moments.iter().filter_map(|e| classes(&e.geometry).ok()).map(|(_, label)| label);
    Some(FoundPass {
        epoch: pass.culmination.epoch,
        alt_deg: pass.culmination.alt_rad.to_degrees(),
        range_km: pass.culmination.range_km,
        label: PaperLabel::of_pass(labels)?,
        at_stated_time,
    })
}

/// The dates nearest to the stated one on which a pass fits the stated time of day: days later, and that pass. Of two
/// as near the later comes first: a date is more often that of the evening before than of the day after.
fn other_dates(row: &StatedPass, stays: &[Pass], tolerances: &Tolerances) -> Vec<(i32, FoundPass)> {
    let fitting = |day: i32| {
        let at = shifted(row.epoch, f64::from(day) * DAY_S);
        let pass = stays.iter().min_by(|a, b| distance_s(a, &at).total_cmp(&distance_s(b, &at)))?;
        Some((day, found(pass, false).filter(|_| distance_s(pass, &at) <= tolerances.time_s)?))
    };
    let nearest = (1..=DATE_ERR_D).map(|day| [day, -day].into_iter().filter_map(fitting).collect::<Vec<_>>());
    nearest.into_iter().find(|dates| !dates.is_empty()).unwrap_or_default()
}

/// What would make an impossible row true: the same time of a date near by, else the nearest pass.
fn remedy_of(
    row: &StatedPass,
    site: &Site,
    proposed: &[(i32, FoundPass)],
    nearest: Option<&FoundPass>,
    tolerances: &Tolerances,
) -> Result<String> {
    let described = |pass: &FoundPass| -> Result<String> {
        let sky = sun_and_moon(site, &pass.epoch)?;
        let local = iso_utc(shifted(pass.epoch, row.clock_ahead_s), 0).replace('T', " ");
        let utc = iso_utc(pass.epoch, 0);
        Ok(format!(
            "{} ({} UTC): {:.1} deg high, {:.0} km; Moon {:.1} %, Sun {:.1} deg",
            local.get(..16).unwrap_or(&local),
            utc.get(11..16).unwrap_or(&utc),
            pass.alt_deg,
            pass.range_km,
            sky.moon_illum_pct,
            sky.sun_alt_deg
        ))
    };
    let dates = proposed.iter().map(|(day, pass)| {
        let days = if day.abs() == 1 { "one day".to_owned() } else { format!("{} days", day.abs()) };
        let way = if *day > 0 { "later" } else { "earlier" };
        Ok(format!("the date {days} {way}: pass of {}", described(pass)?))
    });
    let dates = dates.collect::<Result<Vec<_>>>()?;
    match nearest {
        _ if !dates.is_empty() => Ok(dates.join("; or ")),
        Some(pass) => Ok(format!("no date within {DATE_ERR_D} days fits; nearest pass {}", described(pass)?)),
        None => Ok(format!("no pass above {} deg in the days around it", tolerances.min_alt_deg)),
    }
}
