//! One way to write a result: next to its place, flushed to disk, then renamed; a reader never sees half a file.
//!
//! The temporary is `.NAME.tmp.<host>.<pid>` in the same folder; one that a killed process left is rubbish
//! ([`clear_leftovers`]). A full disk, a read-only or vanished folder is one error with its remedy, and the temporary
//! is taken away. Names that come from a header or a configuration are held against [`plain_name`] before they are
//! joined to a folder. It does not cover who may write into a folder ([`crate::pipeline::products::lock`]).

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};
use crate::base::path_text::path_text;

/// What stands between the name and the host of a temporary file.
const MARK: &str = ".tmp.";
/// Longest part of a name that is kept in that of its temporary \[bytes\].
const NAME_BYTES: usize = 120;

/// Writes `bytes` to `path` in one step: a temporary file in the same folder, flushed to disk, then renamed.
///
/// A crash leaves the old file or none, never a part of the new one. A device or a pipe (`/dev/stdout`) is written as
/// it is.
///
/// # Errors
/// [`Error::Io`] with the remedy: the disk is full, the folder is read-only or gone.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = NewFile::create(path)?;
    file.needs_bytes = Some(bytes.len() as u64);
    match file.write_all(bytes) {
        Ok(()) => file.finish(),
        Err(source) => Err(file.refused(source)),
    }
}

/// As [`write_atomic`], piece by piece: `fill` writes into a buffer before the file.
///
/// # Errors
/// Those of [`write_atomic`]; what `fill` answers.
pub fn write_streamed(path: &Path, fill: impl FnOnce(&mut NewFile) -> io::Result<()>) -> Result<()> {
    let mut file = NewFile::create(path)?;
    match fill(&mut file) {
        Ok(()) => file.finish(),
        Err(source) => Err(file.refused(source)),
    }
}

/// As [`write_atomic`] for a writer that wants a path: `make` writes a file of at least `bytes` at the path it is
/// given.
///
/// A device or a pipe receives a copy of a file made in the folder of temporary files.
///
/// # Errors
/// Those of [`write_atomic`]; what `make` answers, unless the disk was full.
pub fn write_by_path(path: &Path, bytes: u64, make: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    if is_stream(path) {
        let copy = std::env::temp_dir().join(temporary_name("stream"));
        let made = make(&copy).and_then(|()| {
            let copied = File::open(&copy)
                .and_then(|mut from| io::copy(&mut from, &mut File::options().write(true).open(path)?));
            copied.map(drop).map_err(|source| refusal(path, source, Some(bytes)))
        });
        let _ = fs::remove_file(&copy);
        return made;
    }
    let (path, temporary) = temporary_for(path)?;
    let written = match fs::remove_file(&temporary) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    };
    let written = written.map_err(|e| refusal(&path, e, Some(bytes))).and_then(|()| make(&temporary)).and_then(|()| {
        let whole = File::open(&temporary).and_then(|file| match file.metadata()?.len() {
            len if len < bytes => Err(ErrorKind::WriteZero.into()),
            _ => file.sync_all(),
        });
        whole.and_then(|()| put(&temporary, &path)).map_err(|e| refusal(&path, e, Some(bytes)))
    });
    written.map_err(|error| {
        let error = match error {
            // what the FITS library says of a full disk is a number
            Error::Fits { .. } if free_bytes(&path).is_some_and(|free| free < bytes) => {
                refusal(&path, ErrorKind::StorageFull.into(), Some(bytes))
            }
            other => other,
        };
        // the first error is the one to tell
        let _ = fs::remove_file(&temporary);
        error
    })
}

/// A file being written, which appears under its name when it is whole ([`NewFile::finish`]) and else never.
#[derive(Debug)]
pub struct NewFile {
    path: PathBuf,
    /// Absent where the path is a device or a pipe.
    temporary: Option<PathBuf>,
    file: Option<BufWriter<File>>,
    needs_bytes: Option<u64>,
}

impl NewFile {
    /// Begins the file that will be `path`.
    ///
    /// # Errors
    /// Those of [`write_atomic`].
    pub fn create(path: &Path) -> Result<Self> {
        let (path, temporary) = match is_stream(path) {
            true => (path.to_path_buf(), None),
            false => temporary_for(path).map(|(path, temporary)| (path, Some(temporary)))?,
        };
        let opened = match &temporary {
            Some(temporary) => File::create(temporary),
            None => File::options().write(true).open(&path),
        };
        let file = opened.map_err(|source| refusal(&path, source, None))?;
        Ok(Self { path, temporary, file: Some(BufWriter::new(file)), needs_bytes: None })
    }

    /// Flushes it to disk and gives it its name.
    ///
    /// # Errors
    /// Those of [`write_atomic`].
    pub fn finish(mut self) -> Result<()> {
        let Some(mut buffer) = self.file.take() else { return Ok(()) };
        let written = buffer.flush().and_then(|()| match &self.temporary {
            Some(temporary) => {
                buffer.get_ref().sync_all()?;
                put(temporary, &self.path)
            }
            None => Ok(()),
        });
        match written {
            Ok(()) => {
                self.temporary = None;
                Ok(())
            }
            Err(source) => Err(self.refused(source)),
        }
    }

    /// The error of a write that failed, with its remedy.
    #[must_use]
    pub fn refused(&self, source: io::Error) -> Error {
        refusal(&self.path, source, self.needs_bytes)
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.as_mut().map_or(Ok(0), |file| file.write(bytes))
    }
    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().map_or(Ok(()), Write::flush)
    }
}

impl Drop for NewFile {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            // what is left is rubbish: not to be flushed any more
            if let Some(buffer) = self.file.take() {
                let _ = buffer.into_parts();
            }
            let _ = fs::remove_file(temporary);
        }
    }
}

/// Makes a folder and those above it.
///
/// # Errors
/// Those of [`write_atomic`].
pub fn make_folder(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).map_err(|source| refusal(folder, source, None))
}

/// Takes away the temporaries in `folder` of processes of this machine that are no more; `all` takes those of other
/// machines too, for a folder in which nobody else writes. Returns how many there were.
pub fn clear_leftovers(folder: &Path, all: bool) -> usize {
    let Ok(entries) = fs::read_dir(folder) else { return 0 };
    let host = host();
    let dead = |name: &str| {
        let Some((_, owner)) = name.strip_prefix('.').and_then(|n| n.rsplit_once(MARK)) else { return false };
        let Some((of, pid)) = owner.rsplit_once('.') else { return false };
        let Ok(pid) = pid.parse::<u32>() else { return false };
        let here = of == host;
        let lives = here && (pid == std::process::id() || Path::new("/proc").join(pid.to_string()).exists());
        // without /proc nobody can tell who lives
        !lives && (all || (here && Path::new("/proc/self").exists()))
    };
    let leftovers = entries.filter_map(|e| Some(e.ok()?.path()));
    leftovers
        .filter(|path| path.file_name().is_some_and(|name| dead(&name.to_string_lossy())))
        .filter(|path| fs::remove_file(path).is_ok())
        .count()
}

/// The name of this machine, as far as it may stand in a file name.
#[must_use]
pub fn host() -> String {
    let reported = fs::read_to_string("/proc/sys/kernel/hostname").ok().or_else(|| std::env::var("HOSTNAME").ok());
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    let name: String = reported.unwrap_or_default().trim().chars().take(40).map(plain).collect();
    if name.is_empty() { "host".into() } else { name }
}

/// Refuses a text as the name of a file or folder unless joining it to a folder stays in that folder, one level down.
///
/// # Errors
/// [`Error::Config`] naming `key`: empty, `.` or `..`, a slash, a drive, control characters, blanks at the ends, a dot
/// in front (hidden), longer than 100 bytes.
pub fn plain_name(key: &str, name: &str) -> Result<()> {
    let problem = if name.trim().is_empty() {
        "is empty"
    } else if name.contains(['/', '\\']) {
        "holds a slash"
    } else if name.starts_with('.') {
        "begins with a dot"
    } else if name.contains(':') {
        "holds a colon"
    } else if name.chars().any(char::is_control) {
        "holds control characters"
    } else if name.trim() != name {
        "begins or ends with a blank"
    } else if name.len() > 100 {
        "is longer than 100 bytes"
    } else {
        return Ok(());
    };
    let shown: String = name.chars().take(60).collect();
    let problem = format!("{shown:?} {problem}; it must be a plain folder name, e.g. \"2025-06-11\"");
    Err(Error::Config { key: key.into(), problem })
}

/// A device or a pipe: it cannot be replaced by a finished file.
fn is_stream(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// The path a file will have, links followed, and its temporary.
fn temporary_for(path: &Path) -> Result<(PathBuf, PathBuf)> {
    let link = fs::symlink_metadata(path).is_ok_and(|m| m.is_symlink());
    let path = if link { fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf()) } else { path.to_path_buf() };
    if path.is_dir() {
        return Err(refusal(&path, ErrorKind::IsADirectory.into(), None));
    }
    let Some(name) = path.file_name() else { return Err(refusal(&path, ErrorKind::InvalidFilename.into(), None)) };
    let temporary = path.with_file_name(temporary_name(name));
    Ok((path, temporary))
}

/// The name of the temporary of a file, hidden, next to it: `.NAME.tmp.<host>.<pid>`.
pub(crate) fn temporary_name(name: impl AsRef<OsStr>) -> OsString {
    let name = name.as_ref();
    let mut hidden = OsString::from(".");
    match name.len() {
        0..=NAME_BYTES => hidden.push(name),
        _ => hidden.push(name.to_string_lossy().chars().take(NAME_BYTES / 4).collect::<String>()),
    }
    hidden.push(format!("{MARK}{}.{}", host(), std::process::id()));
    hidden
}

/// Renames, and has the folder remember it.
fn put(temporary: &Path, path: &Path) -> io::Result<()> {
    fs::rename(temporary, path)?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // some file systems cannot flush a folder: the file itself is safe
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        Err(e) if matches!(e.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded) => Err(e),
        _ => Ok(()),
    }
}

/// Why a file could not be written, and what helps.
pub(crate) fn refusal(path: &Path, source: io::Error, needs_bytes: Option<u64>) -> Error {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let shown = folder.display();
    let words = match source.kind() {
        ErrorKind::StorageFull | ErrorKind::WriteZero => {
            let needs = needs_bytes.map_or(String::new(), |n| format!("{n} bytes needed, "));
            let free = free_bytes(path).map_or("none".into(), |n| n.to_string());
            format!("disk full: {needs}{free} free in {shown}; free space and run again; nothing half written")
        }
        ErrorKind::QuotaExceeded => {
            format!("the quota of {shown} is used up; free space and run again; nothing half written")
        }
        ErrorKind::FileTooLarge => {
            "larger than a file may be here; raise the limit (`ulimit -f unlimited`) and run again; nothing half written"
                .into()
        }
        ErrorKind::ReadOnlyFilesystem => format!("{shown} is on a read-only file system; choose another folder"),
        ErrorKind::PermissionDenied => {
            format!("{shown} may not be written to (permission denied); choose another folder")
        }
        ErrorKind::NotFound => {
            format!(
                "the folder {shown} is not there (removed or unmounted?); make it and run again; nothing half written"
            )
        }
        ErrorKind::NotADirectory | ErrorKind::AlreadyExists => {
            format!("{shown} is a file, or a part of it is, where a folder is needed; choose another folder")
        }
        ErrorKind::IsADirectory => "is a folder; give the name of a file".into(),
        ErrorKind::InvalidFilename => "is not the name of a file".into(),
        _ => return Error::io(path, source),
    };
    Error::io(path, io::Error::new(source.kind(), words))
}

/// Bytes free for us where `path` is, if the system reports it.
fn free_bytes(path: &Path) -> Option<u64> {
    #[cfg(target_os = "linux")]
    {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let space = rustix::fs::statvfs(folder).ok()?;
        Some(space.f_bavail.saturating_mul(space.f_frsize))
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = path;
        None
    }
}

/// Makes the folder a file is to lie in.
pub(crate) fn make_folder_of(path: &Path) -> Result<()> {
    path.parent().filter(|p| !p.as_os_str().is_empty()).map_or(Ok(()), make_folder)
}

/// Writes a text file whole or not at all; makes its folder.
pub(crate) fn save(path: &Path, text: &str) -> Result<()> {
    make_folder_of(path)?;
    write_atomic(path, text.as_bytes())
}

pub(crate) fn file_name(path: &Path) -> String {
    path_text(path.file_name().map_or(path, Path::new))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_write_that_fails_half_way_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.ecsv");
        write_atomic(&path, b"old").unwrap();
        let failed = write_streamed(&path, |file| {
            file.write_all(&[b'x'; 100_000])?;
            Err(io::ErrorKind::StorageFull.into())
        });
        let text = failed.unwrap_err().to_string();
        assert!(text.contains("disk full") && text.contains("nothing half written"), "{text}");
        assert!(write_by_path(&path, 1, |_| Err(Error::Flat { problem: "no".into() })).is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_that_is_gone_or_is_a_file_is_reported_with_its_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let gone = write_atomic(&folder.path().join("gone/a.txt"), b"a").unwrap_err();
        assert!(gone.to_string().contains("not there") && gone.exit_code() == 4, "{gone}");
        write_atomic(&folder.path().join("file"), b"a").unwrap();
        let file = write_atomic(&folder.path().join("file/a.txt"), b"a").unwrap_err().to_string();
        assert!(file.contains("where a folder is needed"), "{file}");
        assert!(make_folder(&folder.path().join("file")).unwrap_err().to_string().contains("where a folder is needed"));
        let itself = write_atomic(folder.path(), b"a").unwrap_err().to_string();
        assert!(itself.contains("is a folder"), "{itself}");
    }

    #[test]
    fn a_link_stays_a_link_and_its_file_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        write_atomic(&file, b"old").unwrap();
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&file, &link).unwrap();
            write_atomic(&link, b"new").unwrap();
            assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
            assert_eq!(fs::read(&file).unwrap(), b"new");
        }
    }

    #[test]
    fn a_device_is_written_and_never_replaced() {
        if Path::new("/dev/null").exists() {
            write_atomic(Path::new("/dev/null"), b"gone").unwrap();
            assert!(!fs::metadata("/dev/null").unwrap().is_file());
        }
    }

    #[test]
    fn leftovers_of_dead_processes_are_cleared_and_those_of_others_kept() {
        let folder = tempfile::tempdir().unwrap();
        let name = |owner: &str, pid: u32| folder.path().join(format!(".photometry.ecsv.tmp.{owner}.{pid}"));
        // above the largest process number of Linux
        let (dead, own, elsewhere) = (name(&host(), 4_999_999), name(&host(), std::process::id()), name("other", 1));
        for path in [&dead, &own, &elsewhere, &folder.path().join(".a.tmp.notes"), &folder.path().join("b.tmp.x.1")] {
            fs::write(path, b"half").unwrap();
        }
        if Path::new("/proc/self").exists() {
            assert_eq!(clear_leftovers(folder.path(), false), 1);
            assert!(!dead.exists() && own.exists() && elsewhere.exists());
        }
        clear_leftovers(folder.path(), true);
        assert!(own.exists() && !elsewhere.exists());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    #[test]
    fn a_name_that_would_leave_its_folder_is_refused_with_its_key() {
        for name in ["", " ", ".", "..", "../../x", "/etc", "a/b", "a\\b", "a\0b", "a\nb", "C:x", ".hidden", " a", "a "]
        {
            let error = plain_name("night.name", name).unwrap_err();
            assert!(error.to_string().contains("night.name") && error.exit_code() == 2, "{name:?}: {error}");
        }
        assert!(plain_name("night.name", &"x".repeat(101)).is_err());
        for name in ["2025-06-11", "ISS pass 3", "Nacht_ä", "a..b"] {
            plain_name("night.name", name).unwrap();
            assert_eq!(Path::new("/out").join(name).parent(), Some(Path::new("/out")));
        }
    }
}
