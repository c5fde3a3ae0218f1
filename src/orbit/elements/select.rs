//! Which set of many is meant: by object, by epoch, by age; and the names an object goes by.
//!
//! Days. It does not cover whether the sets agree with each other ([`super::neighbours`]).

use std::collections::HashSet;

use hifitime::Epoch;

use super::set::Elements;
use crate::base::error::{Error, Result};
use crate::orbit::time::utc_text;

/// Age from which a warning is due \[d\]: the along-track error of a LEO satellite then reaches kilometres.
/// Source: CelesTrak and SatChecker practice for low orbits.
pub const AGE_WARNING_D: f64 = 2.0;

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
pub(crate) fn only_object(sets: &[Elements], norad: Option<u64>) -> Result<()> {
    let mut objects: Vec<(u64, String)> = sets.iter().map(|e| (e.norad_cat_id(), e.label())).collect();
    objects.sort();
    objects.dedup_by_key(|o| o.0);
    let listed = || objects.iter().map(|o| o.1.as_str()).collect::<Vec<_>>().join(", ");
    match norad {
        _ if objects.is_empty() => {
            Err(Error::Orbit { problem: "no element sets; give a file in orbit.elements".to_owned() })
        }
        Some(n) if !objects.iter().any(|o| o.0 == n) => Err(Error::Orbit {
            problem: format!(
                "catalogue number {n} is not in the file of elements; it holds {}; `satphot fetch elements --norad {n} -o \
                 FILE` gets it",
                listed()
            ),
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
    let mut known = HashSet::new();
    for e in sets {
        let plain = e.name().split('(').next().unwrap_or("").trim();
        for name in [e.name(), plain, &e.norad_cat_id().to_string(), e.object_id()] {
            if !name.is_empty() && known.insert(name.to_owned()) {
                names.push(name.to_owned());
            }
        }
    }
    names
}

/// Refuses elements older (or newer) than `max_age_d`, unless forced; warns past `AGE_WARNING_D`.
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
                "{facts}: more than orbit.max_age_d = {max_age_d} d; fetch elements nearer to the night (`satphot fetch \
                 elements --norad {} --date {} -o FILE`), or set orbit.force_age = true",
                elements.norad_cat_id(),
                utc_text(epoch)
            ),
        });
    }
    Ok((age_d.abs() > AGE_WARNING_D).then(|| format!("{facts}: positions may be off by kilometres")))
}
