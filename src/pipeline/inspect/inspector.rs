//! Reads headers with or without a configuration.

use crate::astrometry::catalogue::Catalogue;
use crate::config::Config;
use crate::orbit::Tracker;

/// Reads headers with or without a configuration.
#[derive(Debug)]
pub struct Inspector {
    pub(crate) config: Config,
    pub(super) configured: bool,
    pub(crate) catalogue: Option<Catalogue>,
    pub(super) target_names: Vec<String>,
    pub(super) others: Vec<String>,
    pub(super) tracker: Option<Tracker>,
    /// The parts of the configuration that could not be read and are not used.
    pub notes: Vec<String>,
}
