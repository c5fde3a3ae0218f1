//! Thread pools of a stated size.

use super::error::Error;
use super::error::Result;

/// Runs `work` on a pool of `jobs` threads; 0 = all cores.
///
/// # Errors
/// [`Error::Config`] when the threads cannot be started.
pub fn with_threads<T: Send>(jobs: usize, work: impl FnOnce() -> T + Send) -> Result<T> {
    Ok(pool(threads(jobs))?.install(work))
}

/// Threads to use when `jobs` are requested: 0 = all cores.
#[must_use]
pub fn threads(jobs: usize) -> usize {
    if jobs > 0 { jobs } else { std::thread::available_parallelism().map_or(1, usize::from) }
}

/// A pool of `threads` threads.
///
/// # Errors
/// As [`with_threads`].
pub(crate) fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Error::Argument { name: "jobs".into(), problem: format!("cannot start {threads} threads: {e}") })
}
