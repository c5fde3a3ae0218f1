//! What a table says of its columns where its magnitudes are of another band than V.
//!
//! The meta block names the band: `band`, or `model_band` for modelled magnitudes. Leaves out colours, which keep B-V.

use super::meta::{Meta, MetaValue};
use super::schema::Column;
use crate::bands::Band;

/// The UCD1+ of a column in a table of this meta block: magnitudes are of its `band`, modelled ones of its `model_band`.
#[must_use]
pub fn ucd_in(column: &Column, meta: &Meta) -> String {
    let ucd = column.ucd;
    let modelled = ucd.ends_with("meta.modelled");
    let band = |key: &str| match meta.get(key) {
        Some(MetaValue::Text(text)) => Band::named(text),
        _ => None,
    };
    // a table of predictions has but one band
    let band = if modelled { band("model_band").or_else(|| band("band")) } else { band("band") };
    match band {
        Some(band) if band != Band::V && !ucd.contains("phot.color") => ucd.replace("em.opt.V", band.ucd()),
        _ => ucd.to_owned(),
    }
}

/// The description of a column in a table of this meta block, where magnitudes are of another band than V.
#[must_use]
pub fn description_in(column: &Column, meta: &Meta) -> String {
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
