//! Where the numbers are from: version, hashes, configuration, and the command that makes them again.

use maud::{Markup, html};

use super::parts::NightPage;
use super::parts::cell;
use super::parts::table;
use crate::tables::meta::MetaValue;

/// Input files that are listed; all of them are in manifest.json.
const MOST_INPUTS: usize = 400;

/// The section.
pub(super) fn provenance(page: &NightPage) -> Markup {
    let text = |key: &str| match page.meta.get(key) {
        Some(MetaValue::Text(t)) => t.clone(),
        Some(MetaValue::Number(n)) => n.to_string(),
        _ => String::new(),
    };
    let both = |name: &str, hash: &str| [text(name), text(hash)].join(" ").trim().to_string();
    let calibration = Some(text("calibration")).filter(|c| !c.is_empty()).unwrap_or_else(|| text("band"));
    let facts = [
        ("made by", text("tool")),
        ("configuration, SHA-256", text("config_sha256")),
        ("all inputs, SHA-256", text("input_manifest_sha256")),
        (
            "model",
            [text("satellite"), text("mode")].iter().filter(|t| !t.is_empty()).cloned().collect::<Vec<_>>().join(", "),
        ),
        ("data", text("data_mode")),
        ("seed of the drawn frames", text("seed")),
        ("gain table", both("gain_table", "gain_table_sha256")),
        ("elements", both("orbit_source", "orbit_sha256")),
        ("epochs of the elements", text("orbit_epochs")),
        ("star catalogue", both("catalogue", "catalogue_sha256")),
        ("zeropoint of another night", both("zeropoint_file", "zeropoint_file_sha256")),
        ("master flat that was given", both("flat_file", "flat_file_sha256")),
        ("magnitudes", format!("{} ({})", calibration, text("mag_system"))),
    ];
    let effects = match page.meta.get("effects") {
        Some(MetaValue::Map(pairs)) => pairs
            .iter()
            .filter_map(|(k, v)| match v {
                MetaValue::Text(t) => Some(format!("{} = {}", k.replace('_', " "), t.replace('_', " "))),
                _ => None,
            })
            .collect::<Vec<_>>(),
        _ => Vec::new(),
    };
    html! {
        dl.facts { @for (name, value) in facts.iter().filter(|f| !f.1.is_empty()) { div { dt { (name) } dd { (value) } } } }
        @if !effects.is_empty() { p { "Effects of the model: " (effects.join("; ")) "." } }
        p { "To make it again: " code { "satphot run -c effective.toml" } " in the folder of the results, while the frames are where they were; to check it: " code { "satphot verify ." } }
        @if !page.config_toml.is_empty() { details { summary { "Configuration in force (effective.toml)" } pre { (page.config_toml) } } }
        (inputs(page))
    }
}

fn inputs(page: &NightPage) -> Markup {
    let Some(inputs) = page.manifest.get("inputs").and_then(|i| i.as_array()) else { return html! {} };
    let text = |v: &serde_json::Value, key: &str| v.get(key).and_then(|t| t.as_str()).unwrap_or_default().to_string();
    let rows: Vec<Vec<Markup>> = inputs
        .iter()
        .take(MOST_INPUTS)
        .map(|input| {
            let path = text(input, "path");
            let bytes = input.get("bytes").and_then(|b| b.as_u64()).unwrap_or(0);
            let name = path.rsplit(['/', '\\']).next().unwrap_or_default();
            vec![
                cell(name),
                cell(text(input, "role")),
                cell(bytes),
                html! { code { (text(input, "sha256")) } },
                cell(text(input, "reason")),
            ]
        })
        .collect();
    html! {
        details {
            summary { (inputs.len()) " input files" }
            @if inputs.len() > MOST_INPUTS { p { "The first " (MOST_INPUTS) "; all are in manifest.json." } }
            (table("sortable", "Input files", &["file", "taken for", "bytes", "SHA-256", "why"], &rows))
        }
    }
}
