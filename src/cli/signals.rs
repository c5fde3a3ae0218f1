//! Ctrl-C, a scheduler's SIGTERM, a closed terminal: the first finishes the frames in work, the second ends at once.
//! While `run` reads its inputs nothing is in work, and the first ends at once, too.
//!
//! The exit code is 128 + the signal (130, 143, 129). A closed pipe (`| head`) is no signal here: see [`super::output`].

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use satphot::base::stop::Stop;

/// The request of this program, connected to the signals at the first call.
///
/// Verbs that never use it end at the first signal, as programs do.
pub fn stop() -> Stop {
    static STOP: OnceLock<Stop> = OnceLock::new();
    STOP.get_or_init(|| {
        let stop = Stop::default();
        connect(&stop);
        stop
    })
    .clone()
}

/// Whether the first signal ends the program while inputs are read: not where it has more to do, as `watch` has.
static ENDS_WHILE_READING: AtomicBool = AtomicBool::new(false);

/// Has the first signal end the program while a run reads its inputs.
pub fn end_while_reading() {
    ENDS_WHILE_READING.store(true, Ordering::Relaxed);
}

/// Has a write beyond the limit on the size of files (`ulimit -f`) fail with an error, as one to a full disk does,
/// instead of ending the process.
#[cfg(unix)]
pub fn report_file_limit() {
    // SIGXFSZ has the same number on every system we know of that has it
    const SIGXFSZ: i32 = 25;
    let _ = signal_hook::flag::register(SIGXFSZ, std::sync::Arc::default());
}

#[cfg(not(unix))]
pub fn report_file_limit() {}

#[cfg(unix)]
fn connect(stop: &Stop) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::flag;
    use std::sync::Arc;

    let stop_requested = Arc::new(AtomicBool::new(false));
    // under nohup a hangup is nothing to end for
    let hangup = (!hangup_is_ignored()).then_some(SIGHUP);
    for signal in [SIGINT, SIGTERM].into_iter().chain(hangup) {
        // in this order: the first signal finds `stop_requested` false, the second finds it true and ends the process
        let connected = flag::register_conditional_default(signal, Arc::clone(&stop_requested))
            .and_then(|_| flag::register(signal, Arc::clone(&stop_requested)))
            .and_then(|_| flag::register_usize(signal, stop.flag(), signal as usize));
        if connected.is_err() {
            return; // the system's own manners: it ends at the first signal
        }
    }
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM].into_iter().chain(hangup)) else {
        return;
    };
    let stop = stop.clone();
    let tell = move || {
        if let Some(signal) = signals.forever().next() {
            if ENDS_WHILE_READING.load(Ordering::Relaxed) && stop.is_reading() {
                super::tell("stopped while the inputs were read; nothing was written: run again");
                std::process::exit(128 + signal);
            }
            super::tell("finishing the frames in work; interrupt again to end at once");
        }
    };
    // without the thread nothing is said, and the frames are finished all the same
    let _ = std::thread::Builder::new().name("signals".into()).spawn(tell);
}

/// Whether the process was started with SIGHUP ignored, where the system reports it.
#[cfg(unix)]
fn hangup_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & 1 == 1)
}

#[cfg(not(unix))]
fn connect(_: &Stop) {}
