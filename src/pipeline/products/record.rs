//! What a run records of its stages and its products.

use crate::base::error::Error;
use crate::base::error::Result;
use crate::base::hash::sha256_16;
use serde::Deserialize;
use serde::Serialize;
use std::path::Path;
use std::path::PathBuf;

/// One stage and its time.
#[derive(Debug, Clone, Serialize)]
pub struct StageRecord {
    /// Name.
    pub name: String,
    /// Wall time \[s\].
    pub wall_s: f64,
    /// Time of all cores together \[s\], where the system reports it.
    pub cpu_s: Option<f64>,
    /// Seconds since the start when it was over.
    pub end_s: f64,
    /// Bytes this process read in it, where the system reports it.
    pub bytes_read: Option<u64>,
    /// Largest resident memory so far, when it was over \[MB\], where the system reports it.
    pub peak_memory_mb: Option<f64>,
}

/// One file that was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Output {
    /// Path in the folder of the night.
    #[serde(with = "crate::base::path_text")]
    pub path: PathBuf,
    /// Size \[bytes\].
    pub bytes: u64,
    /// First 16 hex digits of the SHA-256.
    pub sha256: String,
}

impl Output {
    /// A finished file in `folder`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn of(folder: &Path, path: &Path) -> Result<Self> {
        let sha256 = sha256_16(path)?;
        let bytes = std::fs::metadata(path).map_err(|e| Error::io(path, e))?.len();
        Ok(Self { path: path.strip_prefix(folder).unwrap_or(path).to_path_buf(), bytes, sha256 })
    }
}
