//! The layers of a configuration: presets, the file, settings of the command line.

use super::range::bad;
use crate::base::error::Error;
use crate::base::error::Result;
use toml::Table;
use toml::Value;

/// The embedded presets: name and text.
pub const PRESETS: &[(&str, &str)] = &[("macquarie-cdk24", include_str!("../presets/macquarie_cdk24.toml"))];

/// The text of an embedded preset.
#[must_use]
pub fn preset_text(name: &str) -> Option<&'static str> {
    PRESETS.iter().find(|(n, _)| *n == name).map(|(_, t)| *t)
}

/// Preset, then the text, then `--set`, read as `T`; an unknown key or a bad type names its dotted key.
///
/// # Errors
/// [`Error::Config`].
pub(crate) fn read_layers<T: serde::de::DeserializeOwned>(text: &str, sets: &[String]) -> Result<T> {
    deserialize(layers(text, sets)?).map_err(|(error, _)| error)
}

/// The error of a text that is not TOML: its line, the line itself, and what TOML expects there.
fn not_toml(text: &str, error: &toml::de::Error) -> Error {
    let at = error.span().map_or(0, |span| span.start).min(text.len());
    let number = text.as_bytes()[..at].iter().filter(|b| **b == b'\n').count();
    let line = text.lines().nth(number).unwrap_or_default().trim();
    let value = line.split_once('=').map_or("", |(_, value)| value.split('#').next().unwrap_or_default().trim());
    let comma = value.split_once(',').is_some_and(|(a, b)| {
        let digits = |t: &str| !t.is_empty() && t.bytes().all(|b| b.is_ascii_digit());
        digits(a.trim_start_matches(['-', '+'])) && digits(b)
    });
    let hint =
        if comma { "a decimal point is written as \".\"".to_owned() } else { error.message().replace('\n', ", ") };
    bad(&format!("line {}", number + 1), format!("`{line}` is not TOML: {hint}"))
}

/// Preset, then the text, then `--set`, as one table.
pub(super) fn layers(text: &str, sets: &[String]) -> Result<Table> {
    let mut user: Table = text.parse().map_err(|e: toml::de::Error| not_toml(text, &e))?;
    for set in sets {
        apply_set(&mut user, set)?;
    }
    let mut table = match user.get("preset") {
        None => Table::new(),
        Some(name) => preset_table(name)?,
    };
    merge(&mut table, user);
    Ok(table)
}

/// What serde does not take, in our words, and whether it is a key that it does not know.
pub(crate) fn deserialize<T: serde::de::DeserializeOwned>(table: Table) -> std::result::Result<T, (Error, bool)> {
    serde_path_to_error::deserialize(Value::Table(table)).map_err(|e| explain(&e))
}

pub(super) fn preset_table(name: &Value) -> Result<Table> {
    let known = || PRESETS.iter().map(|(n, _)| *n).collect::<Vec<_>>().join(", ");
    let text = name
        .as_str()
        .and_then(preset_text)
        .ok_or_else(|| bad("preset", format!("\"{name}\" is not a preset; known: {}", known())))?;
    text.parse().map_err(|e: toml::de::Error| bad("preset", e.to_string()))
}

/// Puts `over` on top of `base`, table by table.
pub(crate) fn merge(base: &mut Table, over: Table) {
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => merge(below, above),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

/// Applies one `a.b.c=value`; the value is TOML, or a bare string.
pub(super) fn apply_set(table: &mut Table, set: &str) -> Result<()> {
    let (key, text) = set.split_once('=').ok_or_else(|| Error::Argument {
        name: "set".into(),
        problem: format!("\"{set}\" is not key=value, e.g. photometry.aper_r_fwhm=2.5"),
    })?;
    let key = key.trim();
    let value = format!("v = {text}")
        .parse::<Table>()
        .ok()
        .and_then(|mut t| t.remove("v"))
        .unwrap_or_else(|| Value::String(text.trim().to_string()));
    let mut parts: Vec<&str> = key.split('.').collect();
    let last = parts.pop().filter(|s| !s.is_empty()).ok_or_else(|| Error::Argument {
        name: "set".into(),
        problem: format!("\"{set}\" has no key; write key=value, e.g. photometry.aper_r_fwhm=2.5"),
    })?;
    let mut here = table;
    for part in parts {
        here = here
            .entry(part)
            .or_insert_with(|| Value::Table(Table::new()))
            .as_table_mut()
            .ok_or_else(|| bad(key, format!("\"{part}\" is a value, not a table")))?;
    }
    here.insert(last.to_string(), value);
    Ok(())
}

/// Turns serde's message into one that names the dotted key and, for a typing error, the nearest known key.
pub(super) fn explain(error: &serde_path_to_error::Error<toml::de::Error>) -> (Error, bool) {
    let message = error.inner().message().to_string();
    let path = error.path().to_string();
    if let Some((unknown, known)) = unknown_field(&message) {
        let table = path.strip_suffix(&unknown).unwrap_or(&path).trim_end_matches('.');
        let key = if table.is_empty() || table == "?" { unknown.clone() } else { format!("{table}.{unknown}") };
        let nearest =
            known.iter().max_by(|a, b| strsim::jaro_winkler(&unknown, a).total_cmp(&strsim::jaro_winkler(&unknown, b)));
        let hint = nearest.map(|n| format!("; did you mean \"{n}\"?")).unwrap_or_default();
        return (bad(&key, format!("unknown key{hint} Known here: {}", known.join(", "))), true);
    }
    let mut message = [
        ("expected usize", "expected a whole number"),
        ("expected f64", "expected a number"),
        ("invalid type: unit variant, expected string only", "expected a name in quotes"),
        ("expected internally tagged enum Brdf", "expected a law, e.g. { kind = \"lambert\", albedo = 0.3 }"),
        ("expected struct EffectsTable", "expected a table of effects, e.g. { shadow = \"cylinder\" }"),
    ]
    .into_iter()
    .fold(message, |text, (serde, words)| text.replace(serde, words));
    if message.contains("expected a number") && path.ends_with("_deg") {
        message += "; angles are decimal degrees without quotes, such as -33.7703";
    }
    (bad(if path == "." { "pipeline.toml" } else { &path }, message), false)
}

/// `unknown field `x`, expected one of `a`, `b`` -> (x, [a, b]).
pub(super) fn unknown_field(message: &str) -> Option<(String, Vec<String>)> {
    let rest = message.strip_prefix("unknown field ")?;
    let mut quoted = rest.split('`').skip(1).step_by(2).map(str::to_string);
    let unknown = quoted.next()?;
    Some((unknown, quoted.collect()))
}
