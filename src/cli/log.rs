//! What is said on standard error: lines for people, or one JSON object a line for programs that watch.
//!
//! `{"event":"note","text":…}`, `error`, `message`; of stages `stage`, `progress`, `done` with the seconds since the start.

use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::{Value, json};

/// Whether lines are JSON from now on.
static JSON: AtomicBool = AtomicBool::new(false);

/// Makes every further line a JSON object.
pub fn as_json() {
    JSON.store(true, Ordering::Relaxed);
}

/// Whether lines are JSON.
pub fn is_json() -> bool {
    JSON.load(Ordering::Relaxed)
}

/// A line on standard error; nobody listening is not an error.
pub fn tell(text: &str) {
    if is_json() {
        let (event, text) = [("note: ", "note"), ("warning: ", "warning"), ("satphot: ", "error")]
            .into_iter()
            .find_map(|(prefix, event)| Some((event, text.strip_prefix(prefix)?)))
            .unwrap_or(("message", text));
        event_line(&json!({ "event": event, "text": text }));
    } else {
        let _ = writeln!(std::io::stderr(), "{text}");
    }
}

/// An event as a line of JSON.
pub fn event_line(event: &Value) {
    let _ = writeln!(std::io::stderr(), "{event}");
}
