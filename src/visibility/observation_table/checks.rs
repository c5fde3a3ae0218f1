//! What a table of observations says of itself that cannot be: radians for degrees, local times for UTC, another satellite,
//! magnitudes reduced to a range.
//!
//! Degrees, km, magnitudes. What one row shows is a reason of that row; what only all of them show is a note.

use super::columns::Columns;
use super::job::Job;
use super::number::Number;
use super::request::{Places, wrong};
use super::satellites::Which;
use super::time::TimeColumn;
use crate::base::error::Result;
use crate::base::stats::mad_sigma;
use crate::orbit::{Site, Tracker};
use crate::tables::PhotometryRow;
use crate::tables::read::{Row, Table};

/// Stated and computed direction may differ so much: arcminutes are normal, old elements make degrees \[deg\].
const DIRECTION_DEG: f64 = 5.0;
/// Stated and computed range may differ by this share.
const RANGE_FRAC: f64 = 0.1;
/// Stated and computed phase angle may differ by this \[deg\].
const PHASE_DEG: f64 = 10.0;
/// Fewer rows decide nothing about a unit.
const FEW: usize = 3;
/// Rows that zones are tried on.
const SAMPLE: usize = 64;
/// A zone differs from that of the longitude by this at most \[half hours\].
const ZONE_HALF_HOURS: i32 = 5;
/// The scatter of residuals must fall to this share for magnitudes to look reduced.
const REDUCED_FRAC: f64 = 0.75;
/// 5 lg of the ranges must differ by this for that \[mag\].
const RANGES_DIFFER_MAG: f64 = 0.3;

/// Refuses angles without a unit that are all within those of radians; a word on those of a stated unit.
pub fn no_radians<T>(table: &Table, columns: &Columns, rows: &[(Row, T)], notes: &mut Vec<String>) -> Result<()> {
    let pairs = [("alt_deg, az_deg", columns.alt_az_deg), ("sun_alt_deg, sun_az_deg", columns.sun_alt_az_deg)];
    for (keys, [alt, az]) in pairs.into_iter().filter_map(|(keys, pair)| Some((keys, pair?))) {
        let (Some(alt_at), Some(az_at)) = (alt.column(), az.column()) else { continue };
        let values: Vec<(f64, f64)> = rows.iter().filter_map(|(row, _)| Some((alt.of(row)?, az.of(row)?))).collect();
        let in_radians =
            |(alt, az): &(f64, f64)| alt.abs() <= std::f64::consts::FRAC_PI_2 && az.abs() <= std::f64::consts::TAU;
        if values.len() < FEW || !values.iter().all(in_radians) {
            continue;
        }
        let names = format!("`{}` and `{}`", table.columns[alt_at].name, table.columns[az_at].name);
        let problem = format!("no value of the columns {names} ({keys}) is above those of an angle in radians");
        let stated = |n: Number| n.unit_is_stated;
        if stated(alt) && stated(az) {
            notes.push(format!("{problem}, and they are taken as the degrees they state to be"));
        } else {
            return Err(wrong(
                table,
                format!(
                    "{problem}, and they state no unit: write it behind the names, as in `alt [rad]` or `alt [deg]`"
                ),
            ));
        }
    }
    Ok(())
}

/// What a row states and its elements contradict.
pub fn contradictions(job: &Job, row: &Row, tracker: &Tracker, made: &PhotometryRow) -> Vec<String> {
    let mut found = Vec::new();
    let (alt_deg, az_deg) = (made.alt_deg.unwrap_or(0.0), made.az_deg.unwrap_or(0.0));
    if alt_deg <= 0.0 {
        found.push(format!("{BELOW} by {:.1} deg: are time (UTC), site and satellite right?", -alt_deg));
    }
    if let Some([alt, az]) = job.columns.alt_az_deg
        && let (Some(alt), Some(az)) = (alt.of(row), az.of(row))
    {
        let off_deg = separation_deg((alt, az), (alt_deg, az_deg));
        if off_deg > DIRECTION_DEG {
            found.push(format!("{CONTRADICTED} is {off_deg:.1} deg from that of the elements"));
        }
    }
    if let (Some(stated), Some(range_km)) = (job.columns.range_km.and_then(|r| r.of(row)), made.range_km)
        && (stated / range_km - 1.0).abs() > RANGE_FRAC
    {
        let hint = if (stated / range_km / 1e3 - 1.0).abs() < RANGE_FRAC { " (is it in m?)" } else { "" };
        found.push(format!("{CONTRADICTED_RANGE} of {stated} km is {range_km:.0} km by the elements{hint}"));
    }
    found.extend(other_phase(job, row, made, "by the elements"));
    let (number, name) =
        (job.columns.norad_cat_id.map_or("", |i| row.get(i)), job.columns.object_name.map_or("", |i| row.get(i)));
    let known = tracker.names();
    let (own, _) = tracker.object();
    if !number.is_empty() && !name.is_empty() && !own.is_empty() && !known.iter().any(|k| k.eq_ignore_ascii_case(name))
    {
        found.push(format!("the satellite is called {name} in the table and {own} in the elements"));
    }
    found
}

/// A stated phase angle that is another.
pub fn other_phase(job: &Job, row: &Row, made: &PhotometryRow, by: &str) -> Option<String> {
    let (stated, phase) = (job.columns.phase_angle_deg?.of(row)?, made.phase_angle_deg?);
    ((stated - phase).abs() > PHASE_DEG)
        .then(|| format!("the stated phase angle of {stated} deg is {phase:.0} deg {by}"))
}

/// How the reasons of rows begin that are counted.
const BELOW: &str = "the satellite is below the horizon";
const CONTRADICTED: &str = "the stated direction";
const CONTRADICTED_RANGE: &str = "the stated range";

/// Angle between two directions \[deg\].
fn separation_deg(a: (f64, f64), b: (f64, f64)) -> f64 {
    let unit = |(alt, az): (f64, f64)| crate::orbit::earth::from_alt_az(alt.to_radians(), az.to_radians());
    unit(a).angle_to(&unit(b)).to_degrees()
}

/// Whether the reason of a row says that it cannot be of this satellite at this time and place.
pub fn is_contradicted(row: &PhotometryRow) -> bool {
    [BELOW, CONTRADICTED, CONTRADICTED_RANGE].iter().any(|mark| row.reason.contains(mark))
}

/// What the rows together show.
pub fn notes<T>(job: &Job, read: &[(Row, T)], which: &[Which], rows: &[PhotometryRow]) -> Vec<String> {
    let mut notes = Vec::new();
    let count = |mark: &str| rows.iter().filter(|r| r.reason.contains(mark)).count();
    let all = rows.len();
    let below = count(BELOW);
    if below > 0 {
        let zone = zone(job, read, which)
            .map(|zone| format!("; it would be above it in all rows if they were local times of {zone}"));
        notes.push(format!(
            "{below} of {all} rows have the satellite below the horizon{}",
            zone.unwrap_or_else(|| ": check times (UTC), site and satellite".into())
        ));
    }
    for (mark, what) in [(CONTRADICTED, "direction"), (CONTRADICTED_RANGE, "range")] {
        let n = count(mark);
        if n > 0 {
            notes.push(format!(
                "{n} of {all} rows state a {what} that the elements contradict: another satellite, local times, another site, another unit?"
            ));
        }
    }
    if job.columns.time.as_ref().is_some_and(|t| t.is_start && t.exptime_s.is_none()) && job.places == Places::Orbit {
        notes.push(
            "times are of the start of exposures whose length the table does not state, and taken as they are: argument `column \
             exptime_s=NAME`"
                .into(),
        );
    }
    if job.columns.site.is_some() && job.request.site_replaces {
        notes.push("argument `site` replaces the sites that the table states".into());
    }
    notes.extend(reduced(job, rows));
    notes
}

/// The zone near that of the site in which every satellite would be above the horizon; `None` if there is none.
fn zone<T>(job: &Job, read: &[(Row, T)], which: &[Which]) -> Option<String> {
    let step = read.len().div_ceil(SAMPLE);
    let places: Vec<(hifitime::Epoch, &Tracker, Site)> =
        read.iter().zip(which).step_by(step).filter_map(|((row, _), which)| job.place(row, which).ok()).collect();
    let lon_deg = places.first()?.2.lon_rad().to_degrees();
    let lon_deg = if lon_deg > 180.0 { lon_deg - 360.0 } else { lon_deg };
    let centre = (lon_deg / 7.5).round() as i32;
    let up = |half_hours: i32| {
        let above = |(epoch, tracker, site): &(hifitime::Epoch, &Tracker, Site)| {
            let at = TimeColumn::moved(*epoch, -half_hours);
            tracker.at_from(site, &at).is_ok_and(|g| g.alt_rad > 0.0)
        };
        half_hours != 0 && places.iter().all(above)
    };
    // whole hours first: most zones are
    let mut zones: Vec<i32> = (centre - ZONE_HALF_HOURS..=centre + ZONE_HALF_HOURS).collect();
    zones.sort_by_key(|z| (z % 2 != 0, (z - centre).abs()));
    let found = zones.into_iter().find(|z| up(*z))?;
    let sign = if found < 0 { '-' } else { '+' };
    Some(format!("UTC{sign}{:02}:{:02}", found.abs() / 2, found.abs() % 2 * 30))
}

/// A warning where residuals scatter less once the magnitudes are taken as reduced to a range.
fn reduced(job: &Job, rows: &[PhotometryRow]) -> Option<String> {
    const ENOUGH: usize = 10;
    let asked = job.request.magnitudes?;
    if asked.reduced_to_km.is_some() {
        return None;
    }
    let pairs: Vec<(f64, f64)> = rows
        .iter()
        .filter(|r| !is_contradicted(r))
        .filter_map(|r| Some((r.residual_mag?, 5.0 * (r.range_km? / 1e3).log10())))
        .collect();
    if pairs.len() < ENOUGH {
        return None;
    }
    let spread = mad_sigma(&mut pairs.iter().map(|p| p.1).collect::<Vec<_>>())?;
    let as_is = mad_sigma(&mut pairs.iter().map(|p| p.0).collect::<Vec<_>>())?;
    let undone = mad_sigma(&mut pairs.iter().map(|p| p.0 + p.1).collect::<Vec<_>>())?;
    (spread > RANGES_DIFFER_MAG && undone < REDUCED_FRAC * as_is).then(|| {
        format!(
            "the residuals scatter by {as_is:.2} mag, and by {undone:.2} mag if the magnitudes are reduced to one range: are they \
             apparent? argument `reduced_to_km 1000` undoes a reduction to 1000 km"
        )
    })
}
