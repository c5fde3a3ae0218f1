//! Answers on disk: each with a note of the query, its time and its SHA-256; a damaged one is ignored.
//!
//! Hours. Files are written in one step; one process at a time queries a service. It does not cover what an answer means.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use hifitime::Epoch;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::query::{Query, Service};
use crate::base::error::{Error, Result};
use crate::base::file::write_atomic;
use crate::base::time::{iso_utc, parse_utc};

/// The note next to an answer.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Note {
    url: String,
    fetched_utc: String,
    /// When the service last said that it has nothing newer.
    checked_utc: String,
    bytes: usize,
    sha256: String,
    /// Words of the service where it had nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    nothing: Option<String>,
}

/// A service that is to be left alone.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Refusal {
    until_utc: String,
    why: String,
}

/// An answer that was kept.
#[derive(Debug)]
pub struct CachedAnswer {
    /// The answer; empty where the service had nothing.
    pub bytes: Vec<u8>,
    /// Words of the service where it had nothing.
    pub nothing: Option<String>,
    /// When it came.
    pub fetched: Epoch,
    /// When it was last known to be current.
    pub checked: Epoch,
}

/// What the cache holds for a query.
#[derive(Debug)]
pub enum Found {
    /// Nothing.
    Missing,
    /// Files that are not what their note says; why.
    Damaged(String),
    /// An answer.
    CachedAnswer(CachedAnswer),
}

/// A folder of answers.
#[derive(Debug, Clone)]
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// The cache in `folder`, which is made when something is kept.
    #[must_use]
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned() }
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Paths of an answer and of its note.
    #[must_use]
    pub fn paths(&self, query: &Query) -> (PathBuf, PathBuf) {
        let name = format!("{}-{}", query.service.stem(), &sha256(query.url.as_bytes())[..16]);
        (self.folder.join(format!("{name}.answer")), self.folder.join(format!("{name}.json")))
    }

    /// What is kept for a query.
    #[must_use]
    pub fn find(&self, query: &Query) -> Found {
        let (answer, note) = self.paths(query);
        let text = match fs::read(&note) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound && !answer.exists() => return Found::Missing,
            Err(e) => return Found::Damaged(format!("{}: {e}", note.display())),
        };
        match kept(query, &text, &answer) {
            Ok(kept) => Found::CachedAnswer(kept),
            Err(problem) => Found::Damaged(format!("{}: {problem}", note.display())),
        }
    }

    /// Keeps an answer; with `nothing` the words of a service that had none.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn keep(&self, query: &Query, bytes: &[u8], nothing: Option<&str>, now: &Epoch) -> Result<()> {
        self.write(query, bytes, nothing, now, now)
    }

    /// Notes that the service has nothing newer than what is kept.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn still_current(&self, query: &Query, kept: &CachedAnswer, now: &Epoch) -> Result<()> {
        self.write(query, &kept.bytes, kept.nothing.as_deref(), &kept.fetched, now)
    }

    fn write(&self, query: &Query, bytes: &[u8], nothing: Option<&str>, fetched: &Epoch, now: &Epoch) -> Result<()> {
        let (answer, note) = self.paths(query);
        let text = Note {
            url: query.shown().into_owned(),
            fetched_utc: iso_utc(*fetched, 0),
            checked_utc: iso_utc(*now, 0),
            bytes: bytes.len(),
            sha256: sha256(bytes),
            nothing: nothing.map(str::to_owned),
        };
        self.make_folder()?;
        write_atomic(&answer, bytes)?;
        write_atomic(&note, as_json(&text)?.as_bytes())
    }

    /// The moment until which a service is to be left alone, and why.
    #[must_use]
    pub fn refusal(&self, service: Service, now: &Epoch) -> Option<(Epoch, String)> {
        let text = fs::read(self.refusal_path(service)).ok()?;
        let refusal: Refusal = serde_json::from_slice(&text).ok()?;
        let until = parse_utc("until_utc", &refusal.until_utc).ok()?;
        (until > *now).then_some((until, refusal.why))
    }

    /// Leaves a service alone until then.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn refuse(&self, service: Service, until: &Epoch, why: &str) -> Result<()> {
        self.make_folder()?;
        let refusal = Refusal { until_utc: iso_utc(*until, 0), why: why.to_owned() };
        write_atomic(&self.refusal_path(service), as_json(&refusal)?.as_bytes())
    }

    /// Waits until no other process queries this service; the lock ends with the file. `None` if the folder cannot be
    /// written.
    #[must_use]
    pub fn lock(&self, service: Service) -> Option<File> {
        self.make_folder().ok()?;
        let path = self.folder.join(format!("{}.lock", service.stem()));
        let file = File::options().create(true).truncate(false).write(true).open(path).ok()?;
        file.lock().ok()?;
        Some(file)
    }

    fn refusal_path(&self, service: Service) -> PathBuf {
        self.folder.join(format!("{}-refused.json", service.stem()))
    }

    fn make_folder(&self) -> Result<()> {
        fs::create_dir_all(&self.folder).map_err(|e| Error::io(&self.folder, e))
    }
}

/// An answer as its note describes it, or what does not fit.
fn kept(query: &Query, note: &[u8], answer: &Path) -> std::result::Result<CachedAnswer, String> {
    let note: Note = serde_json::from_slice(note).map_err(|e| e.to_string())?;
    if note.url != query.shown() {
        return Err(format!("is of another address, {}", note.url));
    }
    let bytes = fs::read(answer).map_err(|e| format!("its answer: {e}"))?;
    if bytes.len() != note.bytes || sha256(&bytes) != note.sha256 {
        return Err("its answer is not the one it was written for (SHA-256)".into());
    }
    let moment = |text: &str| parse_utc("utc", text).map_err(|e| e.to_string());
    Ok(CachedAnswer {
        bytes,
        nothing: note.nothing,
        fetched: moment(&note.fetched_utc)?,
        checked: moment(&note.checked_utc)?,
    })
}

fn as_json<T: Serialize>(value: &T) -> Result<String> {
    let text = serde_json::to_string_pretty(value);
    text.map(|t| t + "\n").map_err(|e| Error::Temporary { problem: format!("a note of the cache: {e}") })
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}
