//! Which satellite the frames are of, and whether the model is one of it.
//!
//! Frames of another satellite are set aside; the model that a satellite is compared with is said, and a name or a
//! catalogue number that contradicts it is warned of. It does not cover what is in the field: only names and numbers are
//! known.

use std::collections::HashMap;

use crate::brightness::{Catalogue, Entry};
use crate::config::Config;
use crate::frames::{Role, other_satellite, role_by_name};
use crate::orbit::Tracker;
use crate::pipeline::survey::files::Survey;

/// Names and numbers of satellites that are not the target: those of the other objects in the file of elements, and those
/// the catalogue of satellites knows.
#[must_use]
pub fn other_names(tracker: Option<&Tracker>, config: &Config) -> Vec<String> {
    let mut names: Vec<String> = tracker.map(|t| t.others().to_vec()).unwrap_or_default();
    let file = config.model.as_ref().and_then(|m| m.satellites.as_deref());
    if let Ok(catalogue) = Catalogue::load(file) {
        // elements without a name: the catalogue knows the target's
        let number = tracker.map_or(0, |t| t.object().1);
        // without elements the model says which satellite is the target
        let model = config.model.as_ref().filter(|_| tracker.is_none()).and_then(|m| catalogue.find(&m.satellite).ok());
        let is_target = |o: &&String| model.is_some_and(|own| own.objects.contains(*o));
        let of_others = catalogue.entries().iter().filter(|e| !e.has_number(number));
        let objects = of_others.flat_map(|e| &e.objects).filter(|o| !is_target(o));
        names.extend(objects.map(|o| o.trim_end_matches(['*', '-', ' ', '(']).to_owned()));
    }
    names.retain(|n| !n.is_empty());
    names
}

/// Sets the frames of other satellites aside.
pub fn set_others_aside(survey: &mut Survey, config: &Config, target_names: &[String], others: &[String]) {
    let mut aside = Vec::new();
    // the frames of a field share their OBJECT, and catalogues of elements have thousands of names
    let mut known: HashMap<(Option<String>, bool), Option<String>> = HashMap::new();
    let lists = survey.pointings.iter_mut().chain(std::iter::once(&mut survey.targets));
    for list in lists {
        for mut exposure in std::mem::take(list) {
            let by_name = role_by_name(&exposure.name, config).is_some();
            let reason = known
                .entry((exposure.object.clone(), by_name))
                .or_insert_with(|| other_satellite(&exposure, config, target_names, others));
            match reason.clone() {
                Some(reason) => {
                    (exposure.role, exposure.role_reason) = (Role::OtherTarget, reason);
                    aside.push(exposure);
                }
                None => list.push(exposure),
            }
        }
    }
    survey.pointings.retain(|p| !p.is_empty());
    survey.others.extend(aside);
}

/// Which model the satellite is compared with, and what contradicts it; empty without a model or without elements.
#[must_use]
pub fn model_notes(tracker: Option<&Tracker>, config: &Config) -> Vec<String> {
    let (Some(model), Some(tracker)) = (&config.model, tracker) else { return Vec::new() };
    let Ok(catalogue) = Catalogue::load(model.satellites.as_deref()) else { return Vec::new() };
    let (name, number) = tracker.object();
    let label = if name.is_empty() { format!("[{number}]") } else { format!("{name} [{number}]") };
    let own = catalogue.find(&model.satellite).ok();
    let title = own.filter(|e| !e.title.is_empty() && model.surfaces.is_empty()).map(|e| format!(" ({})", e.title));
    let mut notes =
        vec![format!("{label} is compared with the model {}{}", model.satellite, title.unwrap_or_default())];
    notes.extend(own.and_then(|own| contradiction(own, &catalogue, name, number, &label)));
    notes
}

/// What contradicts that an object of this name and number is the satellite of an entry.
fn contradiction(own: &Entry, catalogue: &Catalogue, name: &str, number: u64, label: &str) -> Option<String> {
    if own.is_of(name, number) {
        return None;
    }
    let other = catalogue.of_object(name, number).first().copied();
    if other.is_none() && (own.objects.is_empty() || name.is_empty() && !own.has_numbers()) {
        return None;
    }
    let of_other = other.map(|e| format!("; it is one of {}", e.name)).unwrap_or_default();
    Some(format!(
        "warning: {label} is not a satellite of the model {} (which is of {}){of_other}: residuals compare two different \
         satellites; set model.satellite or orbit.norad_cat_id",
        own.name,
        if own.objects.is_empty() { own.title.clone() } else { own.objects.join(", ") }
    ))
}
