//! Many frames, one after the other in the order of the night: a reader ahead of the workers, and never more frames in
//! memory than fit.
//!
//! The reader brings the next files into the memory of the operating system, where they cost this process nothing; the
//! workers take from there the part they need. Frames in work are bounded, not by cores but by memory; within a frame
//! the same threads share its rows, so that more threads than frames still help. It does not cover how many fit
//! ([`super::memory`]).

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Mutex;
use std::sync::mpsc::sync_channel;

use crate::base::error::{Error, Result};
use crate::base::progress::Progress;
use crate::base::stop::Stop;
use crate::base::threads::pool;
use crate::frames::Exposure;

/// Files the reader may be ahead of the workers.
const READ_AHEAD: usize = 2;

/// Runs `work` on every exposure with `threads` threads and at most `frames` frames at once; results in their order.
///
/// A frame on which `work` panics gets `lost` instead. Once a stop is requested no further frame is begun; those in work
/// are finished, and `kept` says what is left of it all.
///
/// # Errors
/// [`Error::Config`] when the threads cannot be started; [`Error::Interrupted`] when a stop came before the last frame.
pub fn in_order<T: Send>(
    exposures: &[&Exposure],
    (threads, frames): (usize, usize),
    (stop, kept): (&Stop, &dyn Fn() -> String),
    progress: &dyn Progress,
    work: impl Fn(&Exposure) -> T + Sync,
    lost: impl Fn(&Exposure) -> T + Sync,
) -> Result<Vec<T>> {
    let results: Vec<Mutex<Option<T>>> = exposures.iter().map(|_| Mutex::new(None)).collect();
    let pool = pool(threads)?;
    let (work, lost, results_of) = (&work, &lost, &results);
    std::thread::scope(|threads| {
        let (ready, next) = sync_channel::<usize>(READ_AHEAD);
        let reader = move || {
            for (index, exposure) in exposures.iter().enumerate() {
                warm(&exposure.path);
                if stop.requested().is_some() || ready.send(index).is_err() {
                    break;
                }
            }
        };
        std::thread::Builder::new()
            .name("reader".into())
            .spawn_scoped(threads, reader)
            .map_err(|e| Error::Argument { name: "jobs".into(), problem: format!("cannot start the reader: {e}") })?;
        let (done, room) = sync_channel::<()>(frames.max(1));
        (0..frames.max(1)).for_each(|_| _ = done.send(()));
        pool.in_place_scope(|frames| {
            for index in next {
                if room.recv().is_err() || stop.requested().is_some() {
                    break;
                }
                let done = done.clone();
                frames.spawn(move |_| {
                    let exposure = exposures[index];
                    let result = catch_unwind(AssertUnwindSafe(|| work(exposure))).unwrap_or_else(|_| lost(exposure));
                    if let Ok(mut slot) = results_of[index].lock() {
                        *slot = Some(result);
                    }
                    progress.read(file_bytes(&exposure.path));
                    progress.tick();
                    _ = done.send(());
                });
            }
        });
        Ok::<(), Error>(())
    })?;
    let taken: Vec<Option<T>> = results.into_iter().map(|slot| slot.into_inner().ok().flatten()).collect();
    if taken.iter().any(Option::is_none) {
        stop.check(kept)?;
    }
    Ok(taken.into_iter().zip(exposures).map(|(result, exposure)| result.unwrap_or_else(|| lost(exposure))).collect())
}

/// Bytes of a file; 0 if it is gone.
fn file_bytes(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |m| m.len())
}

/// Asks the operating system to have a file's bytes at hand; nothing of it is held here. What is wrong with the file is
/// for the worker to report.
fn warm(path: &Path) {
    #[cfg(target_os = "linux")]
    if let Ok(file) = std::fs::File::open(path) {
        // advice: where it is not taken the worker waits for the disk, as it does on other systems
        let _ = rustix::fs::fadvise(&file, 0, None, rustix::fs::Advice::WillNeed);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = path;
}
