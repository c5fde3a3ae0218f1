//! A unit in the spelling of each format.
//!
//! The schema spells units as astropy does. FITS and VOTable have rules of their own; `electron` and percent are in
//! neither, so they stand as words that readers take as they are. Leaves out conversion: a number never changes.

/// The unit as FITS 4.0 section 4.3 spells it.
#[must_use]
pub fn fits_unit(unit: &str) -> &str {
    match unit {
        "pix" => "pixel",
        "electron / adu" => "electron/adu",
        "electron / pix" => "electron/pixel",
        "arcsec / pix" => "arcsec/pixel",
        "mag / arcsec2" => "mag arcsec-2",
        "deg / s" => "deg/s",
        other => other,
    }
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
            assert!(!fits_unit(column.unit).contains(" / "), "{}", column.unit);
            assert!(!column.ucd.is_empty(), "{} has no UCD", column.name);
        }
    }
}
