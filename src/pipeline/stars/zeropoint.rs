//! The zeropoint of a night: fitted to its stars, or that of another night.

use crate::base::error::{Error, Result};
use crate::pipeline::prepared::{Flattened, Prepared};
use crate::tables::{PhotometryRow, StarRow};
use crate::zeropoint::fit::Zeropoint;
use crate::zeropoint::previous::read_previous;
use crate::zeropoint::stars::{fit_rows, in_index};

/// Fits the zeropoint, or reads the one given; without either the night goes on without calibrated magnitudes.
pub(crate) fn zeropoint_stage(
    rows: &mut [StarRow],
    failed: &[PhotometryRow],
    night: &Flattened,
    poor: &mut Vec<String>,
    notes: &mut Vec<String>,
) -> Result<Option<Zeropoint>> {
    if let Some(path) = &night.config.zeropoint.previous {
        let (zeropoint, warnings) = read_previous(path, &night.config, night.flat.is_some())?;
        notes.extend(warnings);
        return Ok(Some(of_band(zeropoint, night)));
    }
    if night.config.stars.is_none() {
        notes.push("no [stars] and no zeropoint.previous: magnitudes stay instrumental".into());
        return Ok(None);
    }
    if rows.is_empty() {
        if failed.is_empty() {
            notes.push("no star pointings in the night and no zeropoint.previous: magnitudes stay instrumental".into());
        } else {
            poor.push(format!(
                "no star matched the catalogue in any of {} star frames; the first: {}",
                failed.len(),
                failed[0].reason
            ));
        }
        return Ok(None);
    }
    let index = night.catalogue.as_ref().and_then(|c| c.colour);
    match fit_rows(rows, &in_index(&night.config, index)) {
        Ok(zeropoint) => {
            notes.extend(zeropoint.warnings.iter().map(|w| format!("zeropoint: {w}")));
            Ok(Some(of_band(zeropoint, night)))
        }
        Err(error @ Error::Zeropoint { .. }) => {
            poor.push(error.to_string());
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// The zeropoint with the chosen band.
pub(crate) fn of_band(mut zeropoint: Zeropoint, night: &Prepared) -> Zeropoint {
    if let Some(calibrated) = &night.band {
        (zeropoint.band, zeropoint.light) = (Some(calibrated.band), Some(calibrated.light.clone()));
    }
    if night.config.zeropoint.previous.is_none() {
        zeropoint.colour = night.catalogue.as_ref().and_then(|c| c.colour);
    }
    zeropoint.target_b_v_mag = night.config.zeropoint.target_colour(zeropoint.colour);
    zeropoint
}
