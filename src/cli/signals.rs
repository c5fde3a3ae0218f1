//! Ctrl-C and a scheduler's SIGTERM: the first finishes the frames in work, the second ends at once.
//!
//! The exit code is 128 + the signal (130, 143). A closed pipe (`| head`) is no signal here: see [`super::print`].

use std::sync::OnceLock;

use satphot::night::stop::Stop;

/// The request of this program, connected to the signals at the first call.
///
/// Verbs that never ask for it end at the first signal, as programs do.
pub fn stop() -> Stop {
    static STOP: OnceLock<Stop> = OnceLock::new();
    STOP.get_or_init(|| {
        let stop = Stop::default();
        connect(&stop);
        stop
    })
    .clone()
}

#[cfg(unix)]
fn connect(stop: &Stop) {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::flag;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    let asked = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // in this order: the first signal finds `asked` false, the second finds it true and ends the process
        let connected = flag::register_conditional_default(signal, Arc::clone(&asked))
            .and_then(|_| flag::register(signal, Arc::clone(&asked)))
            .and_then(|_| flag::register_usize(signal, stop.flag(), signal as usize));
        if connected.is_err() {
            return; // the system's own manners: it ends at the first signal
        }
    }
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) else { return };
    let tell = move || {
        if signals.forever().next().is_some() {
            super::tell("finishing the frames in work; again to end at once");
        }
    };
    // without the thread nothing is said, and the frames are finished all the same
    let _ = std::thread::Builder::new().name("signals".into()).spawn(tell);
}

#[cfg(not(unix))]
fn connect(_: &Stop) {}
