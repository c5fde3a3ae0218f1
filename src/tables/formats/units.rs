//! A unit in the spelling of each format.
//!
//! The schema spells units as astropy does. FITS and VOTable have rules of their own, and neither knows electrons and
//! percent: in FITS they are counts, `ct`, and the factor `10**-2`, in VOTables words that readers take as they are. Units
//! are not converted: a number never changes.

/// The unit as FITS 4.0 section 4.3 spells it, in what its readers parse without a warning.
#[must_use]
pub fn fits_unit(unit: &str) -> &str {
    match unit {
        "pix" => "pixel",
        "electron" => "ct",
        "electron2" => "ct2",
        "electron / adu" => "ct/adu",
        "electron / pix" => "ct/pixel",
        "electron / (pix s)" => "ct pixel-1 s-1",
        "arcsec / pix" => "arcsec/pixel",
        "mag / arcsec2" => "mag arcsec-2",
        "deg / s" => "deg/s",
        "1 / sr" => "sr-1",
        "%" => "10**-2",
        other => other,
    }
}

/// The description of a column in FITS, which says where a count is an electron.
#[must_use]
pub fn fits_description(description: String, unit: &str) -> String {
    if unit.contains("electron") { format!("{description} (ct: electrons)") } else { description }
}

/// The unit as VOUnits 1.0 spells it: units it does not know stand in quotes.
#[must_use]
pub fn vo_unit(unit: &str) -> &str {
    match unit {
        "pix" => "pixel",
        "electron" => "'electron'",
        "electron / adu" => "'electron'/adu",
        "electron / pix" => "'electron'/pixel",
        "arcsec / pix" => "arcsec/pixel",
        "mag / arcsec2" => "mag.arcsec**-2",
        "deg / s" => "deg/s",
        "%" => "'percent'",
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::{fits_unit, vo_unit};
    use crate::tables::formats::KNOWN;

    #[test]
    fn no_unit_keeps_a_blank_that_vounits_forbid() {
        for column in KNOWN.iter().flat_map(|table| table.columns) {
            assert!(!vo_unit(column.unit).contains(' '), "{}", column.unit);
            let in_fits = fits_unit(column.unit);
            assert!(!in_fits.contains(" / ") && !in_fits.contains("electron") && !in_fits.contains('%'), "{in_fits}");
            assert!(!column.ucd.is_empty(), "{} has no UCD", column.name);
        }
    }
}
