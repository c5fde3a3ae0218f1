//! What a table says of its columns where its magnitudes are of another band than V.
//!
//! The meta block names the band: `band`, or `model_band` for modelled magnitudes. Colours are of its
//! `colour_index`.

use super::meta::{Meta, MetaValue};
use super::schema::Column;
use crate::bands::{Band, ColourIndex};

/// The UCD1+ of a column in a table of this meta block: magnitudes are of its `band`, modelled ones of its `model_band`.
#[must_use]
pub fn ucd_in(column: &Column, meta: &Meta) -> String {
    let ucd = column.ucd;
    if ucd.contains("phot.color") {
        return match colour_in(meta) {
            Some(index) => ucd.replace("em.opt.B;em.opt.V", &format!("{};{}", index.blue.ucd(), index.red.ucd())),
            None => ucd.to_owned(),
        };
    }
    let modelled = ucd.ends_with("meta.modelled");
    let band = |key: &str| match meta.get(key) {
        Some(MetaValue::Text(text)) => Band::named(text),
        _ => None,
    };
    // a table of predictions has but one band
    let band = if modelled { band("model_band").or_else(|| band("band")) } else { band("band") };
    match band {
        Some(band) if band != Band::V => ucd.replace("em.opt.V", band.ucd()),
        _ => ucd.to_owned(),
    }
}

/// The colour index of a table, where it is another than B−V.
fn colour_in(meta: &Meta) -> Option<ColourIndex> {
    match meta.get("colour_index") {
        Some(MetaValue::Text(name)) => ColourIndex::named(name).filter(|index| *index != ColourIndex::B_V),
        _ => None,
    }
}

/// The description of a column in a table of this meta block, where magnitudes are of another band than V.
#[must_use]
pub fn description_in(column: &Column, meta: &Meta) -> String {
    if let Some(index) = colour_in(meta).filter(|_| column.ucd.contains("phot.color")) {
        return column.description.replace("B-V", &index.to_string());
    }
    let (of_v, own) = (column.ucd, ucd_in(column, meta));
    let key = if of_v.ends_with("meta.modelled") { "model_band" } else { "band" };
    match meta.get(key) {
        Some(MetaValue::Text(band)) if of_v != own => {
            let words = column.description.split(' ').map(|word| if word == "V" { band.as_str() } else { word });
            words.collect::<Vec<_>>().join(" ")
        }
        _ => column.description.to_owned(),
    }
}
