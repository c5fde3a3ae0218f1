//! The products of a zeropoint from matched stars: zeropoint.toml and the table of its stars.

use std::path::Path;

use crate::base::error::Result;
use crate::base::file::save;
use crate::config::Config;
use crate::pipeline::products::meta::table_meta;
use crate::pipeline::products::provenance::Provenance;
use crate::tables::{MetaValue, write_stars};
use crate::zeropoint::matched::Matched;

/// Writes zeropoint.toml, if there is a fit, and the rows with weights and residuals.
///
/// # Errors
/// [`crate::Error::Io`].
pub fn write_matched(matched: &Matched, config: &Config, zeropoint: &Path, table: &Path) -> Result<()> {
    if let Ok(fit) = &matched.zeropoint {
        let mut notes: Vec<String> = matched.notes.clone();
        notes.push(format!("fit to the matched stars of {}", matched.table));
        notes.extend(matched.taken.iter().map(|(what, from)| format!("{what}: {from}")));
        save(zeropoint, &matched.own_convention(&fit.to_toml(&notes)))?;
    }
    let mut meta = table_meta(config, matched.zeropoint.as_ref().ok(), &Provenance::of(config, None, None)?);
    // the site, the telescope and the catalogue are those of a night, not of this table
    meta.entries.retain(|(key, _)| !matches!(key.as_str(), "night" | "site" | "telescope" | "catalogue"));
    for (key, value) in &mut meta.entries {
        match key.as_str() {
            "band" => *value = MetaValue::Text(matched.band.clone()),
            "mag_system" => *value = MetaValue::Text("that of the table".into()),
            _ => {}
        }
    }
    meta.push("matched_table", MetaValue::Text(matched.table.clone()));
    meta.push("inst_mag_unit", MetaValue::Text(matched.inst_unit.clone()));
    meta.push("colour", MetaValue::Text(matched.colour.clone()));
    write_stars(table, &matched.rows, &meta)
}
