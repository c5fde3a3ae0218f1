//! What the preflight found: errors, warnings, notes.

use crate::base::error::Error;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The findings of the checks.
#[derive(Debug, Default)]
pub struct Findings {
    /// Why the night is refused.
    pub errors: Vec<Error>,
    /// Notes for the observer.
    pub notes: Vec<String>,
    /// Lines that would mend errors, or let frames be measured that now fail.
    pub missing: Vec<MissingKey>,
    /// Whether headers contradict the configured scale, so that star frames must be solved.
    pub scale_in_doubt: bool,
}

impl Findings {
    /// The lines to paste, table by table; empty if nothing is missing.
    #[must_use]
    pub fn paste(&self) -> String {
        let mut tables: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        let mut lines: Vec<&MissingKey> = self.missing.iter().collect();
        lines.dedup();
        lines.iter().for_each(|m| tables.entry(&m.table).or_default().push(&m.line));
        let mut text = String::new();
        for (table, lines) in tables {
            let _ = writeln!(text, "[{table}]\n{}", lines.join("\n"));
        }
        text
    }
}

/// A line that pipeline.toml lacks.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct MissingKey {
    /// Its table, e.g. `detector.e_per_adu`.
    pub table: String,
    /// `key = value`, with a comment on where the value is from.
    pub line: String,
}
