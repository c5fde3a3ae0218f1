//! A request to stop: finish the frames in work, keep what is done, say how to go on.
//!
//! The library only reads it; the program connects it to the signals of the system.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::base::error::{Error, Result};

/// Whether a stop of a run was requested, shared by all its threads. The default never is.
#[derive(Debug, Clone, Default)]
pub struct Stop {
    signal: Arc<AtomicUsize>,
    reading: Arc<AtomicBool>,
}

/// While it lives, inputs are read and nothing is in work that a stop would have to finish.
#[derive(Debug)]
pub(crate) struct Reading(Arc<AtomicBool>);

impl Drop for Reading {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Relaxed);
    }
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

    /// Marks that inputs are read, until the answer is dropped.
    pub(crate) fn reading(&self) -> Reading {
        self.reading.store(true, Ordering::Relaxed);
        Reading(Arc::clone(&self.reading))
    }

    /// Whether only inputs are read, of which a catalogue can have any size: the program may end at once.
    #[must_use]
    pub fn is_reading(&self) -> bool {
        self.reading.load(Ordering::Relaxed)
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
