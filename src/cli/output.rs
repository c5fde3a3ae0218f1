//! Standard output: the one gate through which results leave the program.
//!
//! The first write that fails ends the listing. A pipe that was closed (`| head`) is a reader who has seen enough and no
//! error; anything else, a full disk, is exit code 4 at the end of the verb ([`finish`]).

use std::io::{self, ErrorKind, Write};
use std::path::Path;
use std::sync::Mutex;

use satphot::Error;
use satphot::base::foreign::shown;

use super::log::with_options;

/// Why nothing more can be written, once that is so.
static FAILED: Mutex<Option<io::Error>> = Mutex::new(None);

/// Prints a text to standard output.
pub fn print(text: &str) {
    listening(text);
}

/// As [`print`]; whether anybody still takes it.
pub fn listening(text: &str) -> bool {
    write(shown(&with_options(text)).as_bytes())
}

fn write(bytes: &[u8]) -> bool {
    let Ok(mut failed) = FAILED.lock() else { return false };
    if failed.is_none() {
        *failed = io::stdout().write_all(bytes).err();
    }
    failed.is_none()
}

/// Copies a finished file to standard output.
pub fn copy(path: &Path) -> satphot::Result<()> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    write(&bytes);
    Ok(())
}

/// Records the answer of something that printed by itself.
pub fn printed(answer: io::Result<()>) {
    if let (Err(error), Ok(mut failed)) = (answer, FAILED.lock()) {
        failed.get_or_insert(error);
    }
}

/// Hands over what is still held back, and reports a write that failed; the end of every verb.
pub fn finish() -> satphot::Result<()> {
    printed(io::stdout().flush());
    match FAILED.lock().ok().and_then(|mut failed| failed.take()) {
        Some(error) if error.kind() != ErrorKind::BrokenPipe => {
            let words = error.to_string();
            let words = words.split(" (os error").next().unwrap_or(&words);
            let problem =
                format!("{words}; what was printed is incomplete: free space, or print elsewhere, and run again");
            Err(Error::io("standard output", io::Error::new(error.kind(), problem)))
        }
        _ => Ok(()),
    }
}

/// Whether an error is a pipe that its reader closed.
pub fn is_closed_pipe(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref::<Error>(), Some(Error::Io { source, .. }) if source.kind() == ErrorKind::BrokenPipe)
}
