//! Opening a FITS file, also one that is packed as a whole: `.fits.gz`, `.fits.bz2`.
//!
//! A packed file is unpacked into an unnamed temporary file, which the system removes when it is closed. The last one stays
//! open for each thread, since header, checksum and pixels of a frame are mostly read one after another. Bytes. It does
//! not cover tiles ([`super::tiles`]).

use std::cell::RefCell;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::base::error::{Error, Result};

/// More bytes than any frame has: a packed file that holds more is not unpacked further.
const MOST_BYTES: u64 = 8 << 30;

/// How a file is packed as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Packing {
    Gzip,
    Bzip2,
}

impl Packing {
    /// By the first bytes, whatever the name says.
    fn of(start: &[u8]) -> Option<Self> {
        match start {
            [0x1f, 0x8b, ..] => Some(Self::Gzip),
            [b'B', b'Z', b'h', b'1'..=b'9', ..] => Some(Self::Bzip2),
            _ => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Bzip2 => "bzip2",
        }
    }
}

/// A file that was unpacked, and what it was unpacked from.
struct Unpacked {
    path: PathBuf,
    stamp: (u64, Option<SystemTime>),
    file: File,
}

thread_local! {
    static LAST: RefCell<Option<Unpacked>> = const { RefCell::new(None) };
}

/// The bytes of a FITS file: those of the file, or what is packed in it.
///
/// Readers that outlive the call read at places, never from where the file stands: the file may be shared.
///
/// # Errors
/// [`Error::Io`]; [`Error::Fits`] for a packed file that is damaged or cut off.
pub(crate) fn open(path: &Path) -> Result<File> {
    let io = |e| Error::io(path, e);
    let mut file = File::open(path).map_err(io)?;
    let mut start = [0; 4];
    let n = file.read(&mut start).map_err(io)?;
    file.seek(SeekFrom::Start(0)).map_err(io)?;
    let Some(packing) = Packing::of(&start[..n]) else { return Ok(file) };
    let meta = file.metadata().map_err(io)?;
    let stamp = (meta.len(), meta.modified().ok());
    LAST.with_borrow_mut(|last| {
        if let Some(known) = last.as_ref().filter(|u| u.path == path && u.stamp == stamp) {
            return known.file.try_clone().map_err(io);
        }
        *last = None; // closes the one before
        let file = unpacked(file, packing, path)?;
        let own = file.try_clone().map_err(io)?;
        *last = Some(Unpacked { path: path.to_path_buf(), stamp, file });
        Ok(own)
    })
}

fn unpacked(packed: File, packing: Packing, path: &Path) -> Result<File> {
    let bad = |problem: String| Error::Fits { path: path.to_path_buf(), problem };
    let reader = BufReader::with_capacity(1 << 18, packed);
    let mut stream: Box<dyn Read> = match packing {
        Packing::Gzip => Box::new(flate2::bufread::MultiGzDecoder::new(reader)),
        Packing::Bzip2 => Box::new(bzip2::bufread::MultiBzDecoder::new(reader)),
    };
    let mut file = tempfile::tempfile().map_err(|e| Error::io(std::env::temp_dir(), e))?;
    let (mut buffer, mut n_bytes) = (vec![0; 1 << 18], 0_u64);
    loop {
        let n = stream.read(&mut buffer).map_err(|e| {
            bad(format!("the {} stream is damaged or cut off: {e}; copy the file again", packing.name()))
        })?;
        if n == 0 {
            break;
        }
        n_bytes += n as u64;
        if n_bytes > MOST_BYTES {
            return Err(bad(format!("the {} stream holds more than {MOST_BYTES} bytes", packing.name())));
        }
        // the disk of the temporary files is what fails here
        file.write_all(&buffer[..n]).map_err(|e| Error::io(std::env::temp_dir(), e))?;
    }
    file.seek(SeekFrom::Start(0)).map_err(|e| Error::io(path, e))?;
    Ok(file)
}
