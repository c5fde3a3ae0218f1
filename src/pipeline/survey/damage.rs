//! Files that can be read but are not what they were: wrong checksums, missing padding, foreign characters.
//!
//! A note each, never a refusal. Files without CHECKSUM or DATASUM cost nothing: only their headers are looked at.

use std::path::Path;

use rayon::prelude::*;

use crate::fits::{Header, guarded, wrong_checksum};
use crate::frames::Exposure;

/// Most files that are named one by one.
const NAMED: usize = 10;

/// What is wrong with a file that can be read.
pub(crate) fn damage(path: &Path, header: &Header) -> Vec<String> {
    let sums = guarded(path, || wrong_checksum(path, header)).unwrap_or_else(|error| Some(error.to_string()));
    header.warnings().iter().cloned().chain(sums).collect()
}

/// One note per damaged file among `exposures`, in their order.
pub(crate) fn damage_notes(exposures: &[&Exposure]) -> Vec<String> {
    let damaged: Vec<String> = exposures
        .par_iter()
        .filter_map(|e| {
            let all = damage(&e.path, &e.header);
            (!all.is_empty()).then(|| format!("{}: {}", e.name, all.join("; ")))
        })
        .collect();
    let more = damaged.len().saturating_sub(NAMED);
    let rest = (more > 0).then(|| format!("{more} more files with such damage; `inspect` lists each"));
    damaged.into_iter().take(NAMED).chain(rest).collect()
}
