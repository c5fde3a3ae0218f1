//! The digest of a configuration.

use super::Config;
use crate::base::error::Result;
use crate::base::hash::sha256_16_text;
use std::path::PathBuf;

/// Hash of everything in the configuration that can change a result: files by their names alone, not the folders they
/// lie in, nor those of frames and results, not `[reporter]` and `[fetch]`.
///
/// # Errors
/// [`Error::Config`] if the configuration cannot be written as text.
pub fn config_sha256(config: &Config) -> Result<String> {
    let mut config = config.clone();
    config.night.output = PathBuf::new();
    // what went in is identified by the hashes of the inputs, wherever and in whatever order they lay
    config.night.input = Vec::new();
    config.reporter = Default::default();
    config.fetch = Default::default();
    let bare = |path: &mut PathBuf| *path = path.file_name().map(PathBuf::from).unwrap_or_default();
    config.each_path(&bare);
    config.orbit.iter_mut().for_each(|o| o.force_age = false); // reported by the flag old_elements and tle_age_d
    Ok(sha256_16_text(&config.to_toml()?))
}
