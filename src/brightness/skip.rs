//! What a scene does not need: one line per light and surface excluded, with the reason.
//!
//! Decided from cheap geometry before anything is integrated; nothing here computes. All but what is too faint is exactly 0.

use std::fmt;
use std::sync::Arc;

/// Why a light source the settings switch off is excluded.
pub(super) const SWITCHED_OFF: &str = "switched off";
/// Why a light or a surface is skipped that would give some.
pub(super) const TOO_FAINT: &str = "too faint to change the sum";

/// A light, or a surface under a light, that was excluded from a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skip {
    /// `sun`, `earthshine`, `moon`, `lunar_earthshine` or `all`.
    pub light: &'static str,
    /// The surface, where it is not the whole satellite.
    pub surface: Option<Arc<str>>,
    /// Why it contributes nothing, or nothing that counts.
    pub why: &'static str,
}

impl Skip {
    pub(super) fn light(light: &'static str, why: &'static str) -> Self {
        Self { light, surface: None, why }
    }

    /// Excluded because somebody said so, not because it gives no light.
    #[must_use]
    pub fn is_choice(&self) -> bool {
        self.why == SWITCHED_OFF
    }

    /// Excluded because the sum does not change by more than the tolerance: it is not 0.
    #[must_use]
    pub fn is_too_faint(&self) -> bool {
        self.why == TOO_FAINT
    }

    /// The same surface under no light at all: what is left is the cost of the decision.
    #[must_use]
    pub fn without_lights(&self) -> Self {
        Self { light: "none", ..self.clone() }
    }

    /// Which light or surface.
    #[must_use]
    pub fn what(&self) -> String {
        match &self.surface {
            Some(surface) => format!("{}, {surface}", self.light),
            None => self.light.to_string(),
        }
    }

    pub(super) fn surface(light: &'static str, surface: &Arc<str>, why: &'static str) -> Self {
        Self { light, surface: Some(Arc::clone(surface)), why }
    }
}

impl fmt::Display for Skip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.surface, self.light) {
            (Some(surface), "all") => write!(f, "{surface}: {}", self.why),
            (Some(surface), light) => write!(f, "{light}: {surface} {}", self.why),
            (None, light) => write!(f, "{light}: {}", self.why),
        }
    }
}

/// The lines of several, for a table's `skipped` column.
#[must_use]
pub fn skipped_text(skipped: &[Skip]) -> String {
    skipped.iter().map(Skip::to_string).collect::<Vec<_>>().join("; ")
}
