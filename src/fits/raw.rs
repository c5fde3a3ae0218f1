//! Writing through the FITS library: the one place that calls its C functions.
//!
//! Directly, because the safe wrapper parses brackets in file names as filters, cuts long strings and rounds numbers in
//! cards. Nothing is read with it: what C does with a damaged file cannot be caught. Every pointer given to C points
//! into a buffer that outlives the call, and C is given that buffer's true length.
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_int, c_long, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::ptr;

use fitsio::{FileOpenMode, FitsFile, sys};

use super::card_value::CardValue;
use crate::base::error::{Error, Result};

/// Type codes of fitsio.h.
const TUSHORT: c_int = 20;
const TFLOAT: c_int = 42;
const RICE_1: c_int = 11;

/// Runs `work`, turning a panic inside it into [`Error::Fits`].
pub(crate) fn guarded<T>(path: &Path, work: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        Err(Error::Fits {
            path: path.to_path_buf(),
            problem: "reading or writing it panicked: a fault of satphot; please report it with this file".into(),
        })
    })
}

/// Status 0 is success; anything else becomes the library's own words.
fn check(path: &Path, status: c_int, doing: &str) -> Result<()> {
    if status == 0 {
        return Ok(());
    }
    let mut text = [0; 81];
    // SAFETY: ffgerr writes at most 31 bytes with a final 0 into a buffer of 81.
    let words = unsafe {
        sys::ffgerr(status, text.as_mut_ptr());
        CStr::from_ptr(text.as_ptr()).to_string_lossy().into_owned()
    };
    // SAFETY: no arguments; empties this process's list of messages.
    unsafe { sys::ffcmsg() };
    Err(Error::Fits { path: path.to_path_buf(), problem: format!("{doing}: FITS library status {status}, {words}") })
}

fn c_text(path: &Path, text: &str) -> Result<CString> {
    CString::new(text)
        .map_err(|_| Error::Fits { path: path.to_path_buf(), problem: format!("{text:?} holds a zero byte") })
}

fn c_path(path: &Path) -> Result<CString> {
    let text = path
        .to_str()
        .ok_or_else(|| Error::Fits { path: path.to_path_buf(), problem: "the path is not UTF-8".into() })?;
    c_text(path, text)
}

/// What kind of image to write.
pub(crate) enum Pixels<'a> {
    /// Unsigned 16 bit, as i16 with BZERO = 32768.
    U16(&'a [u16]),
    /// 32-bit float.
    F32(&'a [f32]),
}

/// Writes one image with its cards to a new file; `path` must not exist yet.
pub(crate) fn write_image(
    path: &Path,
    pixels: &Pixels<'_>,
    (nx, ny): (usize, usize),
    cards: &[(String, CardValue, String)],
    compress: bool,
) -> Result<()> {
    let (count, code, image_type) = match pixels {
        Pixels::U16(p) => (p.len(), TUSHORT, 20),
        Pixels::F32(p) => (p.len(), TFLOAT, -32),
    };
    if count != nx * ny || count == 0 {
        return Err(Error::Fits { path: path.to_path_buf(), problem: format!("{count} pixels do not make {nx}x{ny}") });
    }
    let name = c_path(path)?;
    let mut raw = ptr::null_mut();
    let mut status = 0;
    // SAFETY: `name` is a valid C string; `raw` and `status` are ours.
    unsafe { sys::ffdkinit(&mut raw, name.as_ptr(), &mut status) };
    check(path, status, "creating")?;
    // SAFETY: `raw` comes from a successful ffdkinit and is closed by FitsFile alone.
    let file = unsafe { FitsFile::from_raw(raw, FileOpenMode::READWRITE) };
    let mut file = file.map_err(|e| Error::Fits { path: path.to_path_buf(), problem: format!("creating: {e}") })?;
    let mut axes = [nx as c_long, ny as c_long];
    let mut tile = [nx as c_long, 1];
    // SAFETY: the handle is open; axes and tile have the 2 entries announced.
    unsafe {
        let f = file.as_raw();
        if compress {
            sys::fits_set_compression_type(f, RICE_1, &mut status);
            sys::fits_set_tile_dim(f, 2, tile.as_mut_ptr(), &mut status);
        }
        sys::ffcrim(f, image_type, 2, axes.as_mut_ptr(), &mut status);
    }
    check(path, status, "writing the header")?;
    for (key, value, comment) in cards {
        write_card(&mut file, path, key, value, comment)?;
    }
    let data = match pixels {
        Pixels::U16(p) => p.as_ptr().cast::<c_void>(),
        Pixels::F32(p) => p.as_ptr().cast::<c_void>(),
    };
    // SAFETY: `data` points to `count` elements of type `code`; ffppr only reads them despite its *mut.
    unsafe {
        sys::ffppr(file.as_raw(), code, 1, count as sys::LONGLONG, data.cast_mut(), &mut status);
        sys::ffflus(file.as_raw(), &mut status);
    }
    check(path, status, "writing pixels")
}

fn write_card(file: &mut FitsFile, path: &Path, key: &str, value: &CardValue, comment: &str) -> Result<()> {
    let doing = format!("writing card {key}");
    let (name, note) = (c_text(path, key)?, c_text(path, comment)?);
    let mut status = 0;
    // SAFETY: the handle is open; every string is a valid C string that outlives the call; the library copies them.
    unsafe {
        let f = file.as_raw();
        match value {
            CardValue::Text(text) if key == "HISTORY" || key == "COMMENT" => {
                let text = c_text(path, text)?;
                if key == "HISTORY" {
                    sys::ffphis(f, text.as_ptr(), &mut status);
                } else {
                    sys::ffpcom(f, text.as_ptr(), &mut status);
                }
            }
            CardValue::Text(text) => {
                let value = c_text(path, text)?;
                if text.len() > 60 {
                    sys::ffplsw(f, &mut status);
                }
                sys::ffpkls(f, name.as_ptr(), value.as_ptr(), note.as_ptr(), &mut status);
            }
            CardValue::Integer(v) => {
                sys::ffpkyj(f, name.as_ptr(), *v as sys::LONGLONG, note.as_ptr(), &mut status);
            }
            // 17 significant digits give every f64 back exactly.
            CardValue::Real(v) => {
                sys::ffpkyd(f, name.as_ptr(), *v, -17, note.as_ptr(), &mut status);
            }
            CardValue::Logical(v) => {
                sys::ffpkyl(f, name.as_ptr(), c_int::from(*v), note.as_ptr(), &mut status);
            }
        }
    }
    check(path, status, &doing)
}
