//! SHA-256 of files and texts, as 16 hexadecimal digits.

use super::error::Error;
use super::error::Result;
use sha2::Digest;
use sha2::Sha256;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::SystemTime;

/// First 16 hex digits of the SHA-256 of a file.
///
/// # Errors
/// [`Error::Io`]; also for what is not a regular file: a device never ends, a pipe may never begin.
pub fn sha256_16(path: &Path) -> Result<String> {
    let is_file = std::fs::metadata(path).map_err(|e| Error::io(path, e))?.is_file();
    if !is_file {
        return Err(Error::io(path, std::io::Error::new(ErrorKind::InvalidInput, "is not a regular file")));
    }
    let mut file = std::fs::File::open(path).map_err(|e| Error::io(path, e))?;
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; HASHED_BYTES];
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(hex16(&hasher.finalize())),
            Ok(n) => hasher.update(&buffer[..n]),
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) => return Err(Error::io(path, e)),
        }
    }
}

/// Hashes of files that are known from their size and the time of their last change, for a program that looks at the same files
/// again and again. Clones share what they know.
#[derive(Debug, Clone, Default)]
pub struct KnownHashes(Arc<Mutex<BTreeMap<PathBuf, (u64, SystemTime, String)>>>);

impl KnownHashes {
    /// First 16 hex digits of the SHA-256 of a file.
    ///
    /// # Errors
    /// [`Error::Io`], as [`sha256_16`].
    pub fn sha256_16(&self, path: &Path) -> Result<String> {
        let state = || std::fs::metadata(path).ok().and_then(|meta| Some((meta.len(), meta.modified().ok()?)));
        let before = state();
        if let (Some((bytes, modified)), Ok(known)) = (before, self.0.lock())
            && let Some((known_bytes, known_modified, hash)) = known.get(path)
            && (*known_bytes, *known_modified) == (bytes, modified)
        {
            return Ok(hash.clone());
        }
        let hash = sha256_16(path)?;
        // a file that changed meanwhile is of two states
        if let (Some((bytes, modified)), true, Ok(mut known)) = (before, state() == before, self.0.lock()) {
            known.insert(path.to_path_buf(), (bytes, modified, hash.clone()));
        }
        Ok(hash)
    }
}

/// First 16 hex digits of the SHA-256 of a text.
#[must_use]
pub fn sha256_16_text(text: &str) -> String {
    hex16(&Sha256::digest(text.as_bytes()))
}

/// First 16 hex digits of the SHA-256 of pieces, one after the other.
pub(crate) fn sha256_16_of<const N: usize>(pieces: [&[u8]; N]) -> String {
    let mut hasher = Sha256::new();
    pieces.iter().for_each(|piece| hasher.update(piece));
    hex16(&hasher.finalize())
}

/// Bytes hashed at a time: they stay in the cache of a core.
pub(crate) const HASHED_BYTES: usize = 256 << 10;

pub(crate) fn hex16(digest: &[u8]) -> String {
    digest.iter().take(8).map(|b| format!("{b:02x}")).collect()
}
