//! A request to stop: finish the frames in work, keep what is done, say how to go on.
//!
//! The library only reads it; the program connects it to the signals of the system.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::base::error::{Error, Result};

/// Whether a stop of a run was requested, shared by all its threads. The default never is.
#[derive(Debug, Clone, Default)]
pub struct Stop {
    signal: Arc<AtomicUsize>,
}

impl Stop {
    /// The number a signal handler sets: 0 = go on, else the signal that requests a stop.
    #[must_use]
    pub fn flag(&self) -> Arc<AtomicUsize> {
        Arc::clone(&self.signal)
    }

    /// The signal that requested a stop, if there was one.
    #[must_use]
    pub fn requested(&self) -> Option<u8> {
        u8::try_from(self.signal.load(Ordering::Relaxed)).ok().filter(|signal| *signal != 0)
    }

    /// Goes on, or stops with what was finished.
    ///
    /// # Errors
    /// [`Error::Interrupted`] once a stop was requested; `finished` says what is kept and how to go on.
    pub fn check(&self, finished: impl FnOnce() -> String) -> Result<()> {
        match self.requested() {
            Some(signal) => Err(Error::Interrupted { signal, problem: finished() }),
            None => Ok(()),
        }
    }
}
