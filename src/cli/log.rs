//! What is said on standard error: lines for people, or one JSON object a line for programs that watch.
//!
//! `{"event":"note","text":…}`, `error`, `message`; of stages `stage`, `progress`, `done` with the seconds since the start.

use std::borrow::Cow;
use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

use satphot::base::foreign::shown;
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

/// A text of the library for the terminal: what it calls "argument `step_min`" is the option `--step-min` here.
///
/// The library knows no options. A value may follow the name: "argument `column flux=NAME`" is `--column flux=NAME`.
pub fn with_options(text: &str) -> Cow<'_, str> {
    const MARK: &str = "argument `";
    if !text.contains(MARK) {
        return text.into();
    }
    let mut parts = text.split(MARK);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let Some((argument, rest)) = part.split_once('`') else {
            out += &format!("{MARK}{part}");
            continue;
        };
        let end = argument.find(' ').unwrap_or(argument.len());
        let (name, value) = argument.split_at(end);
        let name = if name.starts_with('-') || name.chars().all(char::is_uppercase) {
            name.into()
        } else {
            format!("--{}", name.replace('_', "-"))
        };
        out += &format!("{name}{value}{rest}");
    }
    out.into()
}

/// A line on standard error; nobody listening is not an error.
pub fn tell(text: &str) {
    let text = with_options(text);
    let text = &*shown(&text);
    if is_json() {
        let (event, text) = [("note: ", "note"), ("warning: ", "warning"), ("error: ", "error")]
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

#[cfg(test)]
mod tests {
    use super::with_options;

    #[test]
    fn arguments_of_the_library_are_options_of_the_terminal() {
        for (library, terminal) in [
            ("argument `step_min`: 0 min", "--step-min: 0 min"),
            (
                "name it (argument `column flux=A_B`) or give argument `max_age_d 3`",
                "name it (--column flux=A_B) or give --max-age-d 3",
            ),
            ("argument `--earth`: bad", "--earth: bad"),
            ("nothing to see", "nothing to see"),
            ("a lone argument `", "a lone argument `"),
        ] {
            assert_eq!(with_options(library), terminal);
        }
    }
}
