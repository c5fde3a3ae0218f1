//! What came in and how it was treated, as keys and values: the table's meta, the run's configuration and manifest.
//!
//! Nested keys are dotted; a list of inputs has one line per file. All three are complete.

use serde_json::Value;

use crate::base::error::{Error, Result};
use crate::tables::meta::Meta;

/// Keys and values, in order.
pub type Provenance = Vec<(String, String)>;

/// The provenance of a table from its meta block, effective.toml and manifest.json, as far as they are there.
///
/// # Errors
/// [`Error::Table`] for a configuration or manifest that is not TOML or JSON.
pub fn provenance(meta: &Meta, effective_toml: Option<&str>, manifest_json: Option<&str>) -> Result<Provenance> {
    let bad = |name: &str, problem: String| Error::Table { path: name.into(), line: None, problem };
    let mut pairs: Provenance = meta.flat().into_iter().map(|(key, value)| (format!("meta.{key}"), value)).collect();
    if let Some(text) = effective_toml {
        let table: toml::Table = text.parse().map_err(|e: toml::de::Error| bad("effective.toml", e.to_string()))?;
        let value = serde_json::to_value(table).map_err(|e| bad("effective.toml", e.to_string()))?;
        flatten("config", &value, &mut pairs);
    }
    if let Some(text) = manifest_json {
        let value: Value = serde_json::from_str(text).map_err(|e| bad("manifest.json", e.to_string()))?;
        flatten("manifest", &value, &mut pairs);
    }
    Ok(pairs)
}

fn flatten(key: &str, value: &Value, pairs: &mut Provenance) {
    match value {
        Value::Object(map) => map.iter().for_each(|(k, v)| flatten(&format!("{key}.{k}"), v, pairs)),
        Value::Array(items) if items.iter().any(Value::is_object) => {
            items.iter().enumerate().for_each(|(i, v)| pairs.push((format!("{key}.{i}"), v.to_string())));
        }
        Value::String(text) => pairs.push((key.to_owned(), text.clone())),
        other => pairs.push((key.to_owned(), other.to_string())),
    }
}
