//! The results that a night keeps of every frame, so that no run repeats the work of an earlier one.
//!
//! One small file per frame in `.satphot/` next to the results, with the SHA-256 of everything it depends on: the
//! program, the configuration, the frame, the products before it. Where that agrees the file is taken, else the frame is
//! measured again. Values are kept bit for bit. It does not cover what depends on several frames: that is computed again
//! each time.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

use crate::base::error::Result;
use crate::base::file::{file_name, refusal, temporary_name};
use crate::base::hash::sha256_16_text;
use crate::base::hash::{KnownHashes, sha256_16};
use crate::config::Config;
use crate::config::digest::config_sha256;
use crate::frames::Exposure;
use crate::pipeline::prepared::Prepared;

/// Name of the folder of products, hidden from searches for frames.
pub const FOLDER: &str = ".satphot";
/// Raised whenever what is kept, or how it is computed, changes between versions of the program.
const SCHEMA: &str = "satphot.product/1";

/// A refused file larger than this is not hashed \[bytes\].
const LARGEST_HASHED_BYTES: u64 = 4 << 30;

/// The kept results of single frames, and the hashes of files read so far.
#[derive(Debug, Default)]
pub struct FrameCache {
    /// Folder of the products; `None` keeps nothing.
    folder: Option<PathBuf>,
    /// Everything that all of them depend on.
    base: String,
    /// Nothing kept earlier is used.
    redo: bool,
    hashes: Mutex<BTreeMap<PathBuf, String>>,
    /// Hashes that an earlier run of the same program took.
    known_hashes: Option<KnownHashes>,
    /// Names of the products that this run had to do with.
    used: Mutex<BTreeSet<String>>,
    kept: AtomicUsize,
    made: AtomicUsize,
    /// The first product that could not be written, and why.
    unwritten: Mutex<Option<String>>,
}

impl FrameCache {
    /// Keeps products in `folder`; with `redo`, none of those already there is used.
    ///
    /// # Errors
    /// [`crate::Error::Config`] if the configuration cannot be written as text for its hash; [`crate::Error::Io`] where
    /// the folder cannot be made.
    pub fn in_folder(folder: PathBuf, night: &Prepared, redo: bool) -> Result<Self> {
        let force_age = night.config.orbit.as_ref().is_some_and(|o| o.force_age);
        let how = format!("{force_age} {}", night.exhaustive);
        // here and not later: a folder that goes away during the run stays away
        fs::create_dir_all(&folder).map_err(|e| refusal(&folder, e, None))?;
        let config = without_colour(night.config.clone());
        let base = key(&[SCHEMA, env!("CARGO_PKG_VERSION"), &build(), &config_sha256(&config)?, &how]);
        Ok(Self { folder: Some(folder), base, redo, ..Self::default() })
    }

    /// Keeps the results of star frames in `folder`, for every satellite of a night: neither elements nor model nor the
    /// name of the night are in what they depend on.
    ///
    /// # Errors
    /// As [`FrameCache::in_folder`].
    pub fn of_stars(folder: PathBuf, night: &Prepared, redo: bool) -> Result<Self> {
        let mut config = without_colour(night.config.clone());
        (config.orbit, config.model) = (None, None);
        config.night.name = String::new();
        fs::create_dir_all(&folder).map_err(|e| refusal(&folder, e, None))?;
        let how = format!("{} {:?}", night.exhaustive, night.eop);
        let base = key(&[SCHEMA, env!("CARGO_PKG_VERSION"), &build(), &config_sha256(&config)?, &how]);
        Ok(Self { folder: Some(folder), base, redo, ..Self::default() })
    }

    /// The same, that reads no file again whose hash is known.
    #[must_use]
    pub fn knowing(self, known_hashes: Option<KnownHashes>) -> Self {
        Self { known_hashes, ..self }
    }

    /// First 16 hex digits of the SHA-256 of a file, which is read once at most.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn sha256(&self, path: &Path) -> Result<String> {
        if let Some(known) = self.hashes.lock().ok().and_then(|hashes| hashes.get(path).cloned()) {
            return Ok(known);
        }
        let hash = match &self.known_hashes {
            Some(known) => known.sha256_16(path)?,
            None => sha256_16(path)?,
        };
        if let Ok(mut hashes) = self.hashes.lock() {
            hashes.insert(path.to_path_buf(), hash.clone());
        }
        Ok(hash)
    }

    /// The hash of a file that is no frame to be measured; empty where it cannot be read, or is larger than any frame: a file
    /// of holes whose header claims 100 GB would stall the night.
    #[must_use]
    pub fn sha256_of_refused(&self, path: &Path) -> String {
        let bytes = std::fs::metadata(path).map_or(0, |meta| meta.len());
        if bytes > LARGEST_HASHED_BYTES { String::new() } else { self.sha256(path).unwrap_or_default() }
    }

    /// The product `kind` of a frame: kept from an earlier run, or made and kept. `depends` names everything it depends
    /// on besides the frame itself, the program and the configuration; `keep` says whether a product is worth keeping.
    /// Errors are never kept.
    ///
    /// A frame without a file of products is hashed while it is measured; with one, before, and then perhaps no pixel is
    /// looked at. Returns the frame's hash (empty where it cannot be read) with the product.
    pub fn of_frame<T: Serialize + DeserializeOwned + Send>(
        &self,
        kind: &str,
        exposure: &Exposure,
        depends: &[&str],
        make: impl FnOnce() -> Result<T> + Send,
        keep: impl FnOnce(&T) -> bool,
    ) -> (String, Result<T>) {
        let hash_of = || self.sha256(&exposure.path).unwrap_or_default();
        let name = product_name(kind, &exposure.path);
        let key_of = |hash: &str| {
            let all: Vec<&str> =
                [kind, exposure.name.as_str(), hash].into_iter().chain(depends.iter().copied()).collect();
            self.key(&all)
        };
        if self.has(&name) {
            let hash = hash_of();
            if let Some(product) = self.load(&name, &key_of(&hash)) {
                self.kept.fetch_add(1, Ordering::Relaxed);
                return (hash, Ok(product));
            }
        }
        let (hash, product) = rayon::join(hash_of, make);
        // a frame that cannot be read now may be readable next time
        if let Ok(product) = &product
            && !hash.is_empty()
            && keep(product)
        {
            self.store(&name, &key_of(&hash), product);
        }
        self.made.fetch_add(1, Ordering::Relaxed);
        (hash, product)
    }

    /// The key of a product: SHA-256 over what it depends on.
    #[must_use]
    pub fn key(&self, depends: &[&str]) -> String {
        let all: Vec<&str> = std::iter::once(self.base.as_str()).chain(depends.iter().copied()).collect();
        key(&all)
    }

    /// Whether a file of this name is there, of whatever key.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.mark(name);
        !self.redo && self.folder.as_ref().is_some_and(|folder| folder.join(name).is_file())
    }

    /// How many of these frames have a product of this kind by this program and configuration.
    #[must_use]
    pub fn count(&self, kind: &str, exposures: &[&Exposure]) -> usize {
        let Some(folder) = &self.folder else { return 0 };
        let head = format!("{SCHEMA} {} ", self.base);
        let there = |e: &&&Exposure| {
            let bytes = fs::read(folder.join(product_name(kind, &e.path)));
            bytes.is_ok_and(|b| b.starts_with(head.as_bytes()))
        };
        exposures.iter().filter(there).count()
    }

    /// A product of this key; `None` if there is none, or its file is damaged: it is made again then.
    pub fn load<T: DeserializeOwned>(&self, name: &str, key: &str) -> Option<T> {
        self.mark(name);
        let folder = self.folder.as_ref().filter(|_| !self.redo)?;
        let bytes = fs::read(folder.join(name)).ok()?;
        let split = bytes.iter().position(|b| *b == b'\n')?;
        let (head, payload) = (std::str::from_utf8(&bytes[..split]).ok()?, &bytes[split + 1..]);
        if head != self.head_line(key, payload) {
            return None;
        }
        postcard::from_bytes(payload).ok()
    }

    /// Keeps a product. If it cannot be written, only the next run has more work; this is reported at the end.
    ///
    /// The file is renamed into its place but not forced to the disk, which would cost more than many a frame: a file that
    /// a crash of the machine tore does not agree with the hash in its first line, and is made again.
    pub fn store<T: Serialize>(&self, name: &str, key: &str, product: &T) {
        let Some(folder) = &self.folder else { return };
        self.mark(name);
        let written = postcard::to_stdvec(product).map_err(|e| e.to_string()).and_then(|payload| {
            let mut bytes = self.head_line(key, &payload).into_bytes();
            bytes.push(b'\n');
            bytes.extend(payload);
            let temporary = folder.join(temporary_name(name));
            fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, folder.join(name))).map_err(|e| {
                let _ = fs::remove_file(&temporary); // it may not even be there
                e.to_string()
            })
        });
        if let (Err(problem), Ok(mut first)) = (written, self.unwritten.lock()) {
            first.get_or_insert(format!("{}: {problem}", folder.join(name).display()));
        }
    }

    /// Products taken from an earlier run, and frames worked on.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        (self.kept.load(Ordering::Relaxed), self.made.load(Ordering::Relaxed))
    }

    /// Notes for the observer: that a product could not be kept.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let unwritten = self.unwritten.lock().ok().and_then(|first| first.clone());
        unwritten.map(|why| format!("not every frame is kept for another run: {why}")).into_iter().collect()
    }

    /// First line of a product: what it is, of which program and configuration, of what, and the hash of its contents.
    fn head_line(&self, key: &str, payload: &[u8]) -> String {
        format!("{SCHEMA} {} {key} {}", self.base, hex(&Sha256::digest(payload)))
    }

    fn mark(&self, name: &str) {
        if let Ok(mut used) = self.used.lock() {
            used.insert(name.to_owned());
        }
    }

    /// Takes away the products of frames that are not of the night any more; at the end of a whole run.
    pub fn prune(&self) {
        let (Some(folder), Ok(used)) = (&self.folder, self.used.lock()) else { return };
        let Ok(entries) = fs::read_dir(folder) else { return };
        // whatever is kept of a frame: what another run of the night made of it, with another colour of the target, too
        let frame = |name: &str| name.rsplit('-').next().unwrap_or_default().to_owned();
        let frames: BTreeSet<String> = used.iter().map(|name| frame(name)).collect();
        let left =
            entries.filter_map(|e| Some(e.ok()?.path())).filter(|path| !frames.contains(&frame(&file_name(path))));
        left.for_each(|path| {
            let _ = fs::remove_file(path); // it costs a little room, nothing else
        });
    }

    /// Takes the folder away: what was kept for is done.
    pub fn clear(&self) {
        if let Some(folder) = &self.folder {
            let _ = fs::remove_dir_all(folder); // left files cost a little room, nothing else
        }
    }
}

/// The configuration without the colour of the target, which only calibrated magnitudes depend on: they name it with the zeropoint.
fn without_colour(mut config: Config) -> Config {
    let z = &mut config.zeropoint;
    (z.target_b_v_mag, z.target_b_v_err_mag, z.target_b_v_from) = (None, None, None);
    config
}

/// Two folders may hold files of one name, so the name of a product is of the whole path.
fn product_name(kind: &str, path: &Path) -> String {
    format!("{kind}-{}", sha256_16_text(&path.to_string_lossy()))
}

/// SHA-256 over texts, each with its length.
#[must_use]
pub fn key(parts: &[&str]) -> String {
    let mut hasher = Sha256::new();
    for part in parts {
        hasher.update((part.len() as u64).to_le_bytes());
        hasher.update(part.as_bytes());
    }
    hex(&hasher.finalize())
}

fn hex(digest: &[u8]) -> String {
    digest.iter().map(|b| format!("{b:02x}")).collect()
}

/// Size and time of the program's own file: a program that was built again under the same version number is another one.
///
/// Kept in the keys of products alone, never in results.
fn build() -> String {
    let file = std::env::current_exe().and_then(fs::metadata);
    let of = |m: fs::Metadata| format!("{} {:?}", m.len(), m.modified().ok());
    file.map(of).unwrap_or_default()
}
