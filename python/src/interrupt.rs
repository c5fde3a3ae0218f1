//! Work without the interpreter's lock, on a stated number of threads, that Ctrl-C stops.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::Duration;

use pyo3::prelude::*;
use satphot::base::threads::with_threads;

use crate::errors::raise;

/// How often a signal is looked for while the work runs.
const PERIOD: Duration = Duration::from_millis(10);

/// Whether the work shall stop; read between rows.
pub type Stopped<'a> = &'a (dyn Fn() -> bool + Sync);

/// Runs `work` on `threads` threads (0: all cores) without the lock. A signal requests a stop of `work`, and the exception
/// of the signal is raised once it has returned. Work that `is_quick` is done at once, on the calling thread.
///
/// Signals reach the main thread of Python alone; a call from another thread is not interrupted.
pub fn interruptible<T: Send>(
    py: Python<'_>,
    threads: usize,
    is_quick: bool,
    work: impl FnOnce(Stopped) -> T + Send,
) -> PyResult<T> {
    if is_quick {
        return Ok(py.detach(|| work(&|| false)));
    }
    let stop = AtomicBool::new(false);
    let stopped = || stop.load(Ordering::Relaxed);
    py.detach(|| {
        std::thread::scope(|scope| {
            let (done, is_done) = channel::<()>();
            let worker = scope.spawn(move || {
                let answer = if threads == 0 { Ok(work(&stopped)) } else { with_threads(threads, || work(&stopped)) };
                drop(done);
                answer
            });
            // nothing is ever sent: the channel closes when the work is over, also by a panic
            while is_done.recv_timeout(PERIOD) == Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
                if let Err(signal) = Python::attach(|py| py.check_signals()) {
                    stop.store(true, Ordering::Relaxed);
                    let _ = worker.join();
                    return Err(signal);
                }
            }
            match worker.join() {
                Ok(answer) => answer.map_err(raise),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        })
    })
}

/// The answer of work that was stopped; the signal itself is what Python sees.
pub fn interrupted() -> satphot::Error {
    satphot::Error::Interrupted { signal: 2, problem: "the call was interrupted".into() }
}
