//! The one place that calls the FITS library's C functions directly.
//!
//! Needed because the safe wrapper parses brackets in file names as filters, always allocates what it reads, cuts
//! long strings and rounds numbers in cards. Files are opened only after [`super::scan`] has passed them. Every
//! pointer given to C points into a buffer that outlives the call, and C is told that buffer's true length.
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_int, c_long, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::ptr;

use fitsio::{FileOpenMode, FitsFile, sys};

use super::cards::Header;
use super::write::CardValue;
use crate::error::{Error, Result};

/// Type codes of fitsio.h.
const TUSHORT: c_int = 20;
const TFLOAT: c_int = 42;
const TDOUBLE: c_int = 82;
const RICE_1: c_int = 11;

/// Runs `work`, turning a panic inside the library into [`Error::Fits`].
pub(super) fn guarded<T>(path: &Path, work: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|_| Err(Error::Fits { path: path.to_path_buf(), problem: "the FITS library panicked".into() }))
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

/// A pixel type the library converts to.
pub(super) trait Pixel: Copy {
    /// Type code.
    const CODE: c_int;
    /// What a BLANK pixel becomes; 0 tells the library not to look for BLANK.
    const BLANK: Self;
}
impl Pixel for u16 {
    const CODE: c_int = TUSHORT;
    const BLANK: u16 = 0;
}
impl Pixel for f32 {
    const CODE: c_int = TFLOAT;
    const BLANK: f32 = f32::NAN;
}
impl Pixel for f64 {
    const CODE: c_int = TDOUBLE;
    const BLANK: f64 = f64::NAN;
}

/// An image open for reading.
pub(super) struct OpenImage<'a> {
    file: FitsFile,
    path: &'a Path,
    size_px: (usize, usize),
    n_axes: usize,
}

impl<'a> OpenImage<'a> {
    /// Opens the image that `header` was scanned from; brackets in the name are just characters.
    pub(super) fn open(path: &'a Path, header: &Header) -> Result<Self> {
        let name = c_path(path)?;
        let mut raw = ptr::null_mut();
        let mut status = 0;
        // SAFETY: `name` is a valid C string; `raw` and `status` are ours.
        unsafe { sys::ffdkopn(&mut raw, name.as_ptr(), 0, &mut status) };
        check(path, status, "opening")?;
        // SAFETY: `raw` comes from a successful ffdkopn and is closed by FitsFile alone.
        let file = unsafe { FitsFile::from_raw(raw, FileOpenMode::READONLY) };
        let file = file.map_err(|e| Error::Fits { path: path.to_path_buf(), problem: format!("opening: {e}") })?;
        let mut image = Self { file, path, size_px: header.size_px(), n_axes: header.n_axes() };
        let number = c_int::try_from(header.hdu_index() + 1).unwrap_or(c_int::MAX);
        let mut kind = 0;
        // SAFETY: the handle is open; `kind` and `status` are ours.
        unsafe { sys::ffmahd(image.file.as_raw(), number, &mut kind, &mut status) };
        check(path, status, "going to the image")?;
        Ok(image)
    }

    /// Reads columns `x0..x0+nx`, rows `y0..y0+ny` (0-based) into `buffer`, scaled by BSCALE and BZERO; BLANK is NaN.
    pub(super) fn read<T: Pixel>(
        &mut self,
        (x0, y0): (usize, usize),
        (nx, ny): (usize, usize),
        buffer: &mut [T],
    ) -> Result<()> {
        let (full_nx, full_ny) = self.size_px;
        if buffer.len() != nx * ny || nx == 0 || ny == 0 || x0 + nx > full_nx || y0 + ny > full_ny {
            let problem = format!("asked for {nx}x{ny} pixels at ({x0}, {y0}) of {full_nx}x{full_ny}");
            return Err(Error::Fits { path: self.path.to_path_buf(), problem });
        }
        let mut first: Vec<c_long> = vec![1; self.n_axes];
        let mut last: Vec<c_long> = vec![1; self.n_axes];
        let mut step: Vec<c_long> = vec![1; self.n_axes];
        (first[0], first[1]) = (x0 as c_long + 1, y0 as c_long + 1);
        (last[0], last[1]) = ((x0 + nx) as c_long, (y0 + ny) as c_long);
        let mut null = T::BLANK;
        let (mut any_null, mut status) = (0, 0);
        // SAFETY: the region was checked to lie inside the image and to have exactly `buffer.len()` pixels of type
        // T::CODE; first, last, step have one entry per axis (at least 2, from the scan).
        unsafe {
            sys::ffgsv(
                self.file.as_raw(),
                T::CODE,
                first.as_mut_ptr(),
                last.as_mut_ptr(),
                step.as_mut_ptr(),
                ptr::from_mut(&mut null).cast::<c_void>(),
                buffer.as_mut_ptr().cast::<c_void>(),
                &mut any_null,
                &mut status,
            );
        }
        check(self.path, status, "reading pixels")
    }
}

/// What kind of image to write.
pub(super) enum Pixels<'a> {
    /// Unsigned 16 bit, as i16 with BZERO = 32768.
    U16(&'a [u16]),
    /// 32-bit float.
    F32(&'a [f32]),
}

/// Writes one image with its cards to a new file; `path` must not exist yet.
pub(super) fn write_image(
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
