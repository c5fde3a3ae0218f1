//! One run at a time in one folder: a lock the operating system keeps, and lets go when its process ends, however it ends.
//!
//! The file `.satphot.lock` says who holds it; a file that is left over does not block anyone. It does not cover
//! machines that share a folder over a network without locks: there the run goes on unlocked.

use std::fs::{File, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};
use crate::base::file::{clear_leftovers, host};
use crate::pipeline::shards::products::FOLDER;

/// Name of the file in the folder that is worked in.
const NAME: &str = ".satphot.lock";

/// The right to write into a folder, until it is dropped.
#[derive(Debug)]
#[must_use = "the folder is free again when this is dropped"]
pub struct FolderLock {
    path: PathBuf,
    file: Option<File>,
}

/// Takes the lock of `folder`, and takes away what killed runs on this machine left half written there.
///
/// # Errors
/// [`Error::Temporary`] (exit code 75) naming the holder while another run works in the folder; [`Error::Io`] when the
/// folder cannot be written.
pub fn lock(folder: &Path) -> Result<FolderLock> {
    let path = folder.join(NAME);
    // the holder takes the file away in the end: a lock on a file without a name holds nothing
    for _ in 0..100 {
        let mut options = File::options();
        let opened = options.read(true).write(true).create(true).truncate(false).open(&path);
        let mut file = opened.map_err(|e| crate::base::file::refusal(&path, e, None))?;
        match file.try_lock() {
            Ok(()) if !is_file_of(&path, &file) => {}
            Ok(()) => {
                let holder = format!("pid {} on {}\n", std::process::id(), host());
                // the holder is for people only: if the disk is full, writing the results reports it
                let _ = file.set_len(0).and_then(|()| file.write_all(holder.as_bytes()));
                for inside in ["", FOLDER, "figures"] {
                    clear_leftovers(&folder.join(inside), false);
                }
                return Ok(FolderLock { path, file: Some(file) });
            }
            Err(TryLockError::WouldBlock) => {
                let mut holder = String::new();
                let _ = file.seek(SeekFrom::Start(0)).and_then(|_| file.read_to_string(&mut holder));
                let holder = holder.trim();
                let who = if holder.is_empty() { String::new() } else { format!(" ({holder})") };
                return Err(Error::Temporary {
                    problem: format!(
                        "{}: another run{who} works in this folder; wait for its end and run again, or give another \
                         folder with -o (night.output) or another night.name",
                        folder.display()
                    ),
                });
            }
            // a file system without locks
            Err(TryLockError::Error(_)) => return Ok(FolderLock { path, file: None }),
        }
    }
    Err(Error::Temporary { problem: format!("{}: runs come and go in this folder; try again", folder.display()) })
}

/// Whether `path` still names the opened file.
fn is_file_of(path: &Path, file: &File) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let same = |a: &std::fs::Metadata, b: &std::fs::Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
        matches!((std::fs::metadata(path), file.metadata()), (Ok(a), Ok(b)) if same(&a, &b))
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        path.exists()
    }
}

impl FolderLock {
    /// Refuses to go on in a folder that is not the one that was locked.
    ///
    /// # Errors
    /// [`Error::Io`] naming the folder: it was removed, unmounted or replaced meanwhile. It is not made again: where a disk
    /// was unmounted that would fill another one.
    pub fn check(&self) -> Result<()> {
        if self.file.as_ref().is_none_or(|file| is_file_of(&self.path, file)) {
            return Ok(());
        }
        let folder = self.path.parent().unwrap_or(Path::new("."));
        let words = "the folder was removed, unmounted or replaced during the run; nothing more was written: run again";
        Err(Error::io(folder, std::io::Error::new(std::io::ErrorKind::NotFound, words)))
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        if self.file.as_ref().is_some_and(|file| is_file_of(&self.path, file)) {
            // while it is still held, so that nobody else's is taken away
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_run_in_a_folder_reports_who_holds_it_and_a_leftover_holds_nobody() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(NAME), "pid 4999999 on elsewhere\n").unwrap();
        let held = lock(folder.path()).unwrap();
        held.check().unwrap();
        let second = lock(folder.path()).unwrap_err();
        let text = second.to_string();
        assert_eq!(second.exit_code(), 75);
        assert!(text.contains(&format!("pid {} on {}", std::process::id(), host())), "{text}");
        assert!(text.contains(&folder.path().display().to_string()), "{text}");
        drop(held);
        assert!(!folder.path().join(NAME).exists());
        let _again = lock(folder.path()).unwrap();
    }

    #[test]
    fn a_folder_that_is_not_there_cannot_be_locked() {
        let folder = tempfile::tempdir().unwrap();
        let night = folder.path().join("night");
        std::fs::create_dir(&night).unwrap();
        let held = lock(&night).unwrap();
        std::fs::remove_dir_all(&night).unwrap();
        let gone = held.check().unwrap_err();
        assert!(gone.exit_code() == 4 && gone.to_string().contains("removed, unmounted or replaced"), "{gone}");
        assert!(lock(&folder.path().join("gone")).unwrap_err().to_string().contains("not there"));
    }
}
