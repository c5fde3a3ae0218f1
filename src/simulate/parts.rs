//! The parts of a night of several cameras, filters and satellites: each a scenario of its own.
//!
//! A table of `[[cameras]]`, `[[filters]]` or `[[satellites]]` holds keys of the scenario and a `label`; it is laid over the
//! rest. Each camera with each filter draws flats and star frames, and target frames of each satellite; all filters of a camera
//! see the same stars with the same pixels, frames of different filters in turn.

use toml::{Table, Value};

use super::scenario::Scenario;
use crate::base::error::{Error, Result};
use crate::base::file::plain_name;
use crate::config::{deserialize, merge};

/// Fields of one camera, at most.
pub(super) const FIELDS_PER_CAMERA: usize = 1_000;

/// A part of a night.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// What is drawn.
    pub scenario: Scenario,
    /// Before the names of its files.
    pub prefix: String,
    /// Its number, for its random streams.
    pub number: u64,
    /// Which of so many frames taken in turn are its own.
    pub turn: (usize, usize),
    /// Number of its first star field.
    pub first_field: usize,
    /// Whether its stars stand in no other part's catalogue.
    pub lists_stars: bool,
}

/// The parts of a night; one without tables is its own only part.
///
/// # Errors
/// [`Error::Config`] for a table without label, and what the scenario of a part refuses.
pub(super) fn parts(scenario: &Scenario) -> Result<Vec<Part>> {
    let [cameras, filters, satellites] = [&scenario.cameras, &scenario.filters, &scenario.satellites];
    if cameras.is_empty() && filters.is_empty() && satellites.is_empty() {
        let (prefix, number, turn, first_field) = (String::new(), 0, (0, 1), 0);
        return Ok(vec![Part { scenario: scenario.clone(), prefix, number, turn, first_field, lists_stars: true }]);
    }
    let mut base = Table::try_from(scenario).map_err(|e| refused("scenario", e.to_string()))?;
    for key in ["cameras", "filters", "satellites"] {
        base.remove(key);
    }
    let mut parts = Vec::new();
    let cameras = labelled("cameras", cameras)?;
    let filters = labelled("filters", filters)?;
    let satellites = labelled("satellites", satellites)?;
    for (c, (camera, of_camera)) in cameras.iter().enumerate() {
        for (f, (filter, of_filter)) in filters.iter().enumerate() {
            // the first part has the calibration frames and the stars, the others the target frames of each satellite
            for (s, (satellite, of_satellite)) in
                std::iter::once(&(String::new(), Table::new())).chain(&satellites).enumerate()
            {
                let mut table = base.clone();
                [of_camera, of_filter, of_satellite].into_iter().for_each(|over| merge(&mut table, over.clone()));
                let mut own: Scenario = deserialize(table).map_err(|(error, _)| error)?;
                own.check()?;
                own.seed = own.seed.wrapping_add(c as u64);
                if s == 0 {
                    own.target.n = 0;
                } else {
                    (own.flats.n, own.pointings.n) = (0, 0);
                }
                if s > 0 || f > 0 {
                    own.zeros = None; // biases and darks have no filter
                }
                let words = [camera, satellite, filter];
                let prefix = words.into_iter().filter(|w| !w.is_empty()).map(|w| format!("{w}_")).collect();
                parts.push(Part {
                    scenario: own,
                    prefix,
                    number: parts.len() as u64 + 1,
                    turn: (f, filters.len()),
                    first_field: c * FIELDS_PER_CAMERA,
                    lists_stars: f == 0,
                });
            }
        }
    }
    Ok(parts)
}

/// Tables with their labels; one without label that changes nothing where there are none.
fn labelled(key: &str, tables: &[Table]) -> Result<Vec<(String, Table)>> {
    if tables.is_empty() {
        return Ok(vec![(String::new(), Table::new())]);
    }
    let one = |table: &Table| {
        let mut table = table.clone();
        match table.remove("label") {
            Some(Value::String(label)) => plain_name(&format!("{key}.label"), &label).map(|()| (label, table)),
            other => Err(refused(
                &format!("{key}.label"),
                format!(
                    "{} is no text; each table of [[{key}]] has one, which begins the names of its files",
                    other.map_or("nothing".into(), |v| v.to_string())
                ),
            )),
        }
    };
    let labelled: Vec<(String, Table)> = tables.iter().map(one).collect::<Result<_>>()?;
    let mut labels: Vec<&str> = labelled.iter().map(|(label, _)| label.as_str()).collect();
    labels.sort_unstable();
    match labels.windows(2).find(|w| w[0] == w[1]) {
        Some(twice) => Err(refused(&format!("{key}.label"), format!("\"{}\" stands twice", twice[0]))),
        None => Ok(labelled),
    }
}

fn refused(key: &str, problem: String) -> Error {
    Error::Config { key: key.into(), problem }
}
