//! The elements of one object for a night: CelesTrak for these days, SatChecker for nights of the past.
//!
//! Days. It does not cover where they are written, and what a night's time is.

use hifitime::Epoch;

use super::answers::{check_gp, check_nearest, gp_sets, nearest_sets};
use super::client::{Answer, Client};
use super::query::{Object, Query, Service, celestrak_query, satchecker_query};
use crate::base::error::{Error, Result};
use crate::config::Fetch;
use crate::orbit::time::{days_between, utc_text};
use crate::orbit::{Elements, nearest};

/// Nights nearer than this are served by current elements \[d\], which are about a day old themselves.
const CURRENT_D: f64 = 2.0;
/// Candidates a message names.
const SHOWN: usize = 12;

/// Who is requested elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WhichService {
    /// CelesTrak for nights of these days, SatChecker for older ones.
    #[default]
    Auto,
    /// CelesTrak.
    CelesTrak,
    /// SatChecker.
    SatChecker,
}

/// Which elements are wanted.
#[derive(Debug, Clone)]
pub struct Wanted {
    /// Of which object.
    pub object: Object,
    /// For which moment.
    pub at: Epoch,
    /// From whom.
    pub service: WhichService,
    /// TLE rather than OMM, where the service has both.
    pub tle: bool,
    /// Elements further from the moment are not taken \[d\].
    pub max_age_d: f64,
}

/// Elements as they came.
#[derive(Debug, Clone)]
pub struct FetchedElements {
    /// The set.
    pub elements: Elements,
    /// A file that holds it.
    pub text: String,
    /// Who gave it.
    pub service: Service,
}

/// The queries that are sent, the second only where the first has no answer near enough.
#[must_use]
pub fn element_queries(wanted: &Wanted, settings: &Fetch, now: &Epoch) -> Vec<Query> {
    let current = match wanted.service {
        WhichService::CelesTrak => true,
        WhichService::SatChecker => false,
        WhichService::Auto => days_between(&wanted.at, now) < CURRENT_D,
    };
    if current {
        return vec![celestrak_query(settings, &wanted.object, wanted.tle)];
    }
    // two archives that do not overlap; each answers with its nearest set however far that is
    let omm_first = wanted.at >= Epoch::from_gregorian_utc_at_midnight(2026, 7, 12);
    [omm_first, !omm_first].map(|omm| satchecker_query(settings, &wanted.object, &wanted.at, omm)).to_vec()
}

/// The elements nearest to the moment, from the first service that has them near enough.
///
/// # Errors
/// [`Error::Orbit`] if there are none within `max_age_d`; [`Error::Config`] for a name that fits several objects, with
/// their numbers; those of [`Client::fetch`].
pub fn fetch_elements(client: &Client, wanted: &Wanted, settings: &Fetch) -> Result<FetchedElements> {
    let mut missed = Vec::new();
    for query in element_queries(wanted, settings, client.now()) {
        let check = |body: &[u8], _: bool| {
            let content = match query.service {
                Service::CelesTrak => check_gp(body)?,
                _ => check_nearest(body)?,
            };
            let sets = candidates(query.service, body);
            match (&wanted.object, sets.first()) {
                (Object::Number(n), Some((e, _))) if !sets.iter().any(|(s, _)| s.norad_cat_id() == *n) => {
                    Err(format!("elements of {}, not of object {n}", e.label()))
                }
                _ => Ok(content),
            }
        };
        let name = query.service.name();
        match client.fetch(&query, &check)? {
            Answer::Nothing(said) => missed.push(format!("{name} has none ({said})")),
            Answer::Data(body) => {
                let (elements, text) = chosen(candidates(query.service, &body), wanted)?;
                let age_d = elements.age_d(&wanted.at);
                if age_d.abs() <= wanted.max_age_d {
                    return Ok(FetchedElements { elements, text, service: query.service });
                }
                let side = if age_d < 0.0 { "after" } else { "before" };
                missed.push(format!("the nearest of {name} are {:.1} d {side}", age_d.abs()));
            }
        }
    }
    let limit = format!("{} d (orbit.max_age_d, argument `max_age_d`)", wanted.max_age_d);
    let tle = if wanted.tle { "; objects above 99999 have no TLE: try argument `format json`" } else { "" };
    let problem = format!(
        "no elements of {} within {limit} of {}: {}{tle}; Space-Track (login) keeps the whole history",
        wanted.object.label(),
        utc_text(&wanted.at),
        missed.join(", ")
    );
    Err(Error::Orbit { problem })
}

/// Sets of a checked answer, each with the text of a file that holds it.
fn candidates(service: Service, body: &[u8]) -> Vec<(Elements, String)> {
    match service {
        Service::CelesTrak => {
            let whole = String::from_utf8_lossy(body).into_owned();
            let sets = gp_sets(body).unwrap_or_default();
            let alone = sets.len() == 1;
            sets.into_iter()
                .enumerate()
                .map(|(i, e)| (e, if alone { whole.clone() } else { part(&whole, i) }))
                .collect()
        }
        _ => nearest_sets(body).unwrap_or_default().into_iter().map(|s| (s.elements, s.text)).collect(),
    }
}

/// The set at place `i` of a text with several: an object of a JSON list, or three lines.
fn part(whole: &str, i: usize) -> String {
    match serde_json::from_str::<Vec<serde_json::Value>>(whole) {
        Ok(list) => list.get(i).map(|v| format!("[{v}]\n")).unwrap_or_default(),
        Err(_) => {
            let lines: Vec<&str> = whole.lines().filter(|l| !l.trim().is_empty()).collect();
            lines.chunks(3).nth(i).map(|set| set.join("\n") + "\n").unwrap_or_default()
        }
    }
}

/// The set that is meant: of the number, or of the one object that has the name.
fn chosen(sets: Vec<(Elements, String)>, wanted: &Wanted) -> Result<(Elements, String)> {
    let number = match &wanted.object {
        Object::Number(number) => *number,
        Object::Name(name) => only(&sets, name)?,
    };
    let all: Vec<Elements> = sets.iter().map(|(e, _)| e.clone()).collect();
    let best = nearest(&all, Some(number), &wanted.at)?;
    let place = sets.iter().position(|(e, _)| e.norad_cat_id() == number && e.epoch() == best.epoch());
    place.and_then(|i| sets.into_iter().nth(i)).ok_or_else(|| Error::Orbit { problem: "no element sets".into() })
}

/// The number of the one object a name means: the only one, or the only one that is called exactly so.
fn only(sets: &[(Elements, String)], name: &str) -> Result<u64> {
    let exact = |e: &Elements| {
        let plain = e.name().split('(').next().unwrap_or("").trim();
        [e.name(), plain].iter().any(|n| n.eq_ignore_ascii_case(name.trim()))
    };
    let mut numbers: Vec<u64> = sets.iter().map(|(e, _)| e.norad_cat_id()).collect();
    let mut exactly: Vec<u64> = sets.iter().filter(|(e, _)| exact(e)).map(|(e, _)| e.norad_cat_id()).collect();
    for list in [&mut numbers, &mut exactly] {
        list.sort_unstable();
        list.dedup();
    }
    match (numbers.as_slice(), exactly.as_slice()) {
        ([number], _) | (_, [number]) => Ok(*number),
        _ => {
            let mut labels: Vec<String> = sets.iter().map(|(e, _)| e.label()).collect();
            labels.dedup();
            let more = if labels.len() > SHOWN { format!(" and {} more", labels.len() - SHOWN) } else { String::new() };
            labels.truncate(SHOWN);
            let problem = format!(
                "\"{name}\" is part of {} names: {}{more}; give one with argument `norad`",
                numbers.len(),
                labels.join(", ")
            );
            Err(Error::Argument { name: "name".into(), problem })
        }
    }
}
