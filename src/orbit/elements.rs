//! Mean orbital elements: which sets a file holds, which one fits an epoch, and whether it is too old.
//!
//! Days and minutes. Reading is in [`super::tle`] and [`super::omm`]; propagation in [`super::propagate`].

use std::path::Path;

use hifitime::Epoch;
use sgp4::chrono::{Datelike, Timelike};

use super::time::{days_between, utc_text};
use super::{omm, tle};
use crate::error::{Error, Result};

/// Age from which a warning is due \[d\]: the along-track error of a LEO satellite then reaches kilometres.
/// Source: CelesTrak and SatChecker practice for low orbits.
pub const AGE_WARNING_D: f64 = 2.0;

/// One set of mean elements (TLE, 3LE or OMM) for SGP4.
#[derive(Debug, Clone)]
pub struct Elements {
    pub(super) inner: sgp4::Elements,
    name: String,
    object_id: String,
    epoch: Epoch,
    format: &'static str,
}

impl Elements {
    /// Wraps what the parser made, after checking the ranges SGP4 does not check. The problem is a sentence.
    pub(super) fn new(inner: sgp4::Elements, format: &'static str) -> std::result::Result<Self, String> {
        for (what, value, lo, hi, unit) in [
            ("eccentricity", inner.eccentricity, 0.0, 1.0 - 1e-9, ""),
            ("inclination", inner.inclination, 0.0, 180.0, " deg"),
            ("right ascension of the node", inner.right_ascension, -360.0, 360.0, " deg"),
            ("argument of perigee", inner.argument_of_perigee, -360.0, 360.0, " deg"),
            ("mean anomaly", inner.mean_anomaly, -360.0, 360.0, " deg"),
            ("mean motion", inner.mean_motion, 1e-6, 20.0, " revolutions per day"),
            ("B*", inner.drag_term, -10.0, 10.0, " per Earth radius"),
        ] {
            if !(lo..=hi).contains(&value) {
                return Err(format!("{what} {value}{unit} is outside {lo} to {hi}"));
            }
        }
        let t = inner.datetime;
        if !(1957..=2200).contains(&t.year()) {
            return Err(format!("epoch {t} is outside the years 1957 to 2200"));
        }
        // chrono writes a leap second as nanosecond >= 10⁹ of second 59.
        let (second, ns) = if t.nanosecond() >= 1_000_000_000 {
            (60, t.nanosecond() - 1_000_000_000)
        } else {
            (t.second(), t.nanosecond())
        };
        let epoch = Epoch::maybe_from_gregorian_utc(
            t.year(),
            t.month() as u8,
            t.day() as u8,
            t.hour() as u8,
            t.minute() as u8,
            second as u8,
            ns,
        )
        .map_err(|e| format!("epoch {t}: {e}"))?;
        let trimmed = |s: &Option<String>| s.as_deref().unwrap_or("").trim().to_owned();
        let (name, object_id) = (trimmed(&inner.object_name), trimmed(&inner.international_designator));
        Ok(Self { inner, name, object_id, epoch, format })
    }

    /// One set from its two lines of 69 characters and a name (empty for none).
    ///
    /// # Errors
    /// [`Error::Orbit`] with the field that is wrong; for a checksum, the one that was expected.
    pub fn from_tle(name: &str, line1: &str, line2: &str) -> Result<Self> {
        tle::parse_set(name, line1, line2).map_err(|(_, problem)| Error::Orbit { problem })
    }

    /// Name of the object; empty if the file has none.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }
    /// Catalogue number.
    #[must_use]
    pub fn norad_cat_id(&self) -> u64 {
        self.inner.norad_id
    }
    /// International designator in COSPAR form, `1998-067A`; empty if the set has none.
    #[must_use]
    pub fn object_id(&self) -> &str {
        &self.object_id
    }
    /// Epoch of the elements.
    #[must_use]
    pub fn epoch(&self) -> Epoch {
        self.epoch
    }
    /// Format the set was read from: `TLE`, `3LE`, `OMM JSON`, `OMM KVN` or `OMM CSV`.
    #[must_use]
    pub fn format(&self) -> &str {
        self.format
    }
    /// Period from the (Kozai) mean motion \[min\].
    #[must_use]
    pub fn period_min(&self) -> f64 {
        1_440.0 / self.inner.mean_motion
    }
    /// Eccentricity.
    #[must_use]
    pub fn eccentricity(&self) -> f64 {
        self.inner.eccentricity
    }
    /// Inclination \[deg\].
    #[must_use]
    pub fn inclination_deg(&self) -> f64 {
        self.inner.inclination
    }

    /// Age at `epoch` \[d\]: positive when the elements are older than the epoch, negative when newer.
    #[must_use]
    pub fn age_d(&self, epoch: &Epoch) -> f64 {
        days_between(&self.epoch, epoch)
    }

    /// Short text for messages: `ISS (ZARYA) [25544]`.
    #[must_use]
    pub fn label(&self) -> String {
        if self.name.is_empty() {
            format!("[{}]", self.norad_cat_id())
        } else {
            format!("{} [{}]", self.name, self.norad_cat_id())
        }
    }
}

/// Reads every element set of a file: TLE, 3LE (name lines with or without `0 `), OMM JSON, KVN or CSV.
///
/// Blank lines, comments (`#`), CRLF and trailing spaces are accepted in TLE files. A damaged set is an error, also
/// among good ones.
///
/// # Errors
/// [`Error::Io`]; [`Error::Table`] with file, line and what was expected; [`Error::NoInput`] for a file without sets.
pub fn read_elements(path: &Path) -> Result<Vec<Elements>> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let table = |line, problem| Error::Table { path: path.to_owned(), line, problem };
    let text =
        String::from_utf8(bytes).map_err(|_| table(None, "not a text file; expected TLE, 3LE or OMM".to_owned()))?;
    let text = text.trim_start_matches('\u{feff}');
    let start = text.trim_start();
    let sets = if start.starts_with(['{', '[']) {
        omm::parse_json(text)
    } else if start.starts_with('<') {
        Err((None, "this is XML or HTML; fetch the elements as TLE, 3LE or OMM JSON (FORMAT=json)".to_owned()))
    } else if start.starts_with("CCSDS_OMM_VERS") {
        omm::parse_kvn(text)
    } else if start.lines().next().is_some_and(|header| header.contains("NORAD_CAT_ID")) {
        omm::parse_csv(text)
    } else {
        tle::parse_file(text)
    }
    .map_err(|(line, problem)| table(line, problem))?;
    if sets.is_empty() {
        return Err(Error::NoInput {
            path: path.to_owned(),
            problem: "no element sets in this file; expected TLE, 3LE or OMM JSON".to_owned(),
        });
    }
    Ok(sets)
}

/// The set of one object whose epoch is nearest to `epoch`, before or after.
///
/// # Errors
/// [`Error::Orbit`] if `sets` is empty, if `norad` is not among them, or if there are several objects and no number.
pub fn nearest<'a>(sets: &'a [Elements], norad: Option<u64>, epoch: &Epoch) -> Result<&'a Elements> {
    only_object(sets, norad)?;
    sets.iter()
        .filter(|e| norad.is_none_or(|n| n == e.norad_cat_id()))
        .min_by(|a, b| a.age_d(epoch).abs().total_cmp(&b.age_d(epoch).abs()))
        .ok_or_else(|| Error::Orbit { problem: "no element sets; give a file in orbit.elements".to_owned() })
}

/// Checks that `norad` (or the single object) is among the sets.
pub(super) fn only_object(sets: &[Elements], norad: Option<u64>) -> Result<()> {
    let mut objects: Vec<(u64, String)> = sets.iter().map(|e| (e.norad_cat_id(), e.label())).collect();
    objects.sort();
    objects.dedup_by_key(|o| o.0);
    let listed = || objects.iter().map(|o| o.1.as_str()).collect::<Vec<_>>().join(", ");
    match norad {
        _ if objects.is_empty() => {
            Err(Error::Orbit { problem: "no element sets; give a file in orbit.elements".to_owned() })
        }
        Some(n) if !objects.iter().any(|o| o.0 == n) => Err(Error::Orbit {
            problem: format!("catalogue number {n} is not in the file of elements; it holds {}", listed()),
        }),
        None if objects.len() > 1 => Err(Error::Orbit {
            problem: format!(
                "the file of elements holds {} objects ({}); set orbit.norad_cat_id to one of the numbers",
                objects.len(),
                listed()
            ),
        }),
        _ => Ok(()),
    }
}

/// Every way a header may name these objects: name, name without its part in parentheses, number, COSPAR id.
///
/// In order of appearance, without repeats and without empty texts.
#[must_use]
pub fn element_names(sets: &[Elements]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for e in sets {
        let plain = e.name().split('(').next().unwrap_or("").trim();
        for name in [e.name(), plain, &e.norad_cat_id().to_string(), e.object_id()] {
            if !name.is_empty() && !names.iter().any(|n| n == name) {
                names.push(name.to_owned());
            }
        }
    }
    names
}

/// Refuses elements older (or newer) than `max_age_d`, unless forced; warns past [`AGE_WARNING_D`].
///
/// # Errors
/// [`Error::Orbit`] with the age, the limit and the remedy.
pub fn check_age(elements: &Elements, epoch: &Epoch, max_age_d: f64, force: bool) -> Result<Option<String>> {
    let age_d = elements.age_d(epoch);
    let side = if age_d < 0.0 { "after" } else { "before" };
    let facts = format!(
        "elements of {} are of {}, {:.1} d {side} {}",
        elements.label(),
        utc_text(&elements.epoch()),
        age_d.abs(),
        utc_text(epoch)
    );
    if age_d.abs() > max_age_d && !force {
        return Err(Error::Orbit {
            problem: format!(
                "{facts}: more than orbit.max_age_d = {max_age_d} d; fetch elements nearer to the night, or set orbit.force_age = true"
            ),
        });
    }
    Ok((age_d.abs() > AGE_WARNING_D).then(|| format!("{facts}: positions may be off by kilometres")))
}
