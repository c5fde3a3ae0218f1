//! What observations say of a satellite's magnitudes: the scatter about the model, and what must be said with each of them.
//!
//! Magnitudes. An entry that states no scatter was not compared with observations, and says so.

use super::Entry;
use crate::tables::{Meta, MetaValue};

/// What stands for a scatter nobody measured.
pub const NOT_COMPARED: &str = "not compared with observations";
/// The word under `sources` that says what a scatter was measured on.
pub(super) const SCATTER: &str = "scatter";

/// Its keys in the meta block of a table.
const SCATTER_KEY: &str = "model_scatter_mag";
const SOURCE_KEY: &str = "model_scatter_source";
const CAVEAT_KEY: &str = "model_caveat";

/// What is known of a model from observations.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Standing {
    /// Scatter of observed less modelled magnitudes \[mag\]; `None` where they were not compared.
    pub scatter_mag: Option<f64>,
    /// What it was measured on.
    pub source: String,
    /// What must be said with every magnitude; may be empty.
    pub caveat: String,
}

impl From<&Entry> for Standing {
    fn from(entry: &Entry) -> Self {
        let source = entry.sources.get(SCATTER).cloned().unwrap_or_default();
        Self { scatter_mag: entry.scatter_mag, source, caveat: entry.caveat.clone() }
    }
}

impl Standing {
    /// In one line, without the name.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = match self.scatter_mag {
            Some(scatter) if self.source.is_empty() => format!("observations scatter by {scatter} mag about it"),
            Some(scatter) => format!("observations scatter by {scatter} mag about it ({})", self.source),
            None => NOT_COMPARED.to_owned(),
        };
        if !self.caveat.is_empty() {
            text += &format!("; {}", self.caveat);
        }
        text
    }

    /// The line a table's meta block stands for, the satellite's name before it; `None` for a table without a model.
    #[must_use]
    pub fn line_of(meta: &Meta) -> Option<String> {
        let text = |key: &str| match meta.get(key) {
            Some(MetaValue::Text(text)) => text.clone(),
            _ => String::new(),
        };
        let scatter_mag = match meta.get(SCATTER_KEY)? {
            MetaValue::Number(scatter_mag) => Some(*scatter_mag),
            _ => None,
        };
        let standing = Self { scatter_mag, source: text(SOURCE_KEY), caveat: text(CAVEAT_KEY) };
        Some(format!("{}: {}", text("satellite"), standing.text()))
    }

    /// As the meta block of a table carries it: `model_scatter_mag`, `model_scatter_source`, `model_caveat`.
    pub fn push_to(&self, meta: &mut Meta) {
        match self.scatter_mag {
            Some(scatter_mag) => meta.push(SCATTER_KEY, MetaValue::Number(scatter_mag)),
            None => meta.push(SCATTER_KEY, NOT_COMPARED),
        }
        let texts = [(SOURCE_KEY, &self.source), (CAVEAT_KEY, &self.caveat)];
        for (key, text) in texts.into_iter().filter(|(_, text)| !text.is_empty()) {
            meta.push(key, text.as_str());
        }
    }
}
