//! The options of a run of the night.

use super::memory::Memory;
use crate::base::hash::KnownHashes;
use crate::base::stop::Stop;
use crate::base::threads::threads;
use std::path::PathBuf;

/// How a run is done, apart from what it does.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Threads; 0 = all cores.
    pub jobs: usize,
    /// Memory the run may take; absent = [`Memory::of_threads`].
    pub max_memory_bytes: Option<usize>,
    /// Files instead of the configured inputs.
    pub files: Vec<PathBuf>,
    /// Folder of the kept results of star frames, where several reductions share them; absent: that of the night.
    pub stars_cache: Option<PathBuf>,
    /// Any failed frame makes the exit code 3.
    pub strict: bool,
    /// Draw no figures.
    pub no_figures: bool,
    /// Measure what was skipped in frames and scenes, and what that saved.
    pub explain: bool,
    /// Leave nothing out, for tests that compare.
    pub exhaustive: bool,
    /// Do everything again, including what an earlier run has kept.
    pub redo: bool,
    /// Hashes of frames that an earlier reduction of the same program took; absent: all files are read again.
    pub known_hashes: Option<KnownHashes>,
    /// A request to stop after the frames in work.
    pub stop: Stop,
}

impl Options {
    /// Threads to use.
    #[must_use]
    pub fn threads(&self) -> usize {
        threads(self.jobs)
    }

    /// Memory to use.
    #[must_use]
    pub fn memory(&self) -> Memory {
        match self.max_memory_bytes {
            Some(limit_bytes) => Memory { limit_bytes, given: true },
            None => Memory::of_threads(self.threads()),
        }
    }
}
