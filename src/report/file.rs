//! One way to write a result: beside its place, then renamed, so that a reader never sees half a file.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::error::{Error, Result};

/// Writes `bytes` to `path` in one step: a temporary file in the same folder, flushed to disk, then renamed.
///
/// A crash leaves the old file or none, never a part of the new one.
///
/// # Errors
/// [`Error::Io`] when the folder does not exist or cannot be written.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<()> {
    write_streamed(path, |file| file.write_all(bytes))
}

/// As [`write_atomic`], piece by piece: `fill` writes into a buffer before the file.
///
/// # Errors
/// [`Error::Io`]; what `fill` answers.
pub fn write_streamed(path: &Path, fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<()> {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".tmp.{}", std::process::id()));
    let temporary = path.with_file_name(name);
    let written = File::create(&temporary)
        .map(BufWriter::new)
        .and_then(|mut file| {
            fill(&mut file)?;
            file.flush()?;
            file.get_ref().sync_all()
        })
        .and_then(|()| fs::rename(&temporary, path));
    written.map_err(|source| {
        // The rename did not happen; what is left is rubbish, and the first error is the one to tell.
        let _ = fs::remove_file(&temporary);
        Error::io(path, source)
    })
}
