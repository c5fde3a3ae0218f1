//! Writing through the FITS library: the one place that calls its C functions.
//!
//! Directly, because the safe wrapper parses brackets in file names as filters, cuts long strings and rounds numbers in
//! cards. Nothing is read with it: what C does with a damaged file cannot be caught. Every pointer given to C points
//! into a buffer that outlives the call, and C is given that buffer's true length.
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_int, c_long, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::ptr;

use fitsio::{FileOpenMode, FitsFile, sys};

use super::card_value::{CardLine, CardValue, ascii, card};
use crate::base::error::{Error, Result};

/// Type codes of fitsio.h.
const TUSHORT: c_int = 20;
const TFLOAT: c_int = 42;
const TDOUBLE: c_int = 82;
/// Codes of images and tables of fitsio.h.
const BYTE_IMG: c_int = 8;
const USHORT_IMG: c_int = 20;
const FLOAT_IMG: c_int = -32;
const DOUBLE_IMG: c_int = -64;
const BINARY_TBL: c_int = 2;
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

/// The pixels of an image to write.
pub(crate) enum Pixels<'a> {
    /// Unsigned 16 bit, as i16 with BZERO = 32768.
    U16(&'a [u16]),
    /// 32-bit float.
    F32(&'a [f32]),
    /// 64-bit float.
    F64(&'a [f64]),
}

impl Pixels<'_> {
    /// Their number, where they begin, the code of their type and the code of the image.
    fn parts(&self) -> (usize, *const c_void, c_int, c_int) {
        match self {
            Pixels::U16(p) => (p.len(), p.as_ptr().cast(), TUSHORT, USHORT_IMG),
            Pixels::F32(p) => (p.len(), p.as_ptr().cast(), TFLOAT, FLOAT_IMG),
            Pixels::F64(p) => (p.len(), p.as_ptr().cast(), TDOUBLE, DOUBLE_IMG),
        }
    }
}

/// A new FITS file, written HDU by HDU.
pub(crate) struct NewFits {
    file: FitsFile,
    path: PathBuf,
}

impl NewFits {
    /// Creates the file; `path` must not exist yet.
    pub(crate) fn create(path: &Path) -> Result<Self> {
        let name = c_path(path)?;
        let mut raw = ptr::null_mut();
        let mut status = 0;
        // SAFETY: `name` is a valid C string; `raw` and `status` are ours.
        unsafe { sys::ffdkinit(&mut raw, name.as_ptr(), &mut status) };
        check(path, status, "creating")?;
        // SAFETY: `raw` comes from a successful ffdkinit and is closed by FitsFile alone.
        let file = unsafe { FitsFile::from_raw(raw, FileOpenMode::READWRITE) };
        let file = file.map_err(|e| Error::Fits { path: path.to_path_buf(), problem: format!("creating: {e}") })?;
        Ok(Self { file, path: path.to_path_buf() })
    }

    /// Appends an HDU that has cards and no data: the primary HDU of a file of tables.
    pub(crate) fn empty(&mut self, cards: &[CardLine]) -> Result<()> {
        let mut status = 0;
        // SAFETY: the handle is open; without axes the library reads none.
        unsafe { sys::ffcrim(self.raw(), BYTE_IMG, 0, ptr::null_mut(), &mut status) };
        self.check(status, "writing the header")?;
        self.cards(cards)
    }

    /// Appends an image with its cards; `compress` makes it a Rice tile-compressed extension.
    pub(crate) fn image(
        &mut self,
        pixels: &Pixels<'_>,
        (nx, ny): (usize, usize),
        cards: &[CardLine],
        compress: bool,
    ) -> Result<()> {
        let (count, data, code, image_type) = pixels.parts();
        if count != nx * ny || count == 0 {
            return Err(self.error(format!("{count} pixels do not make {nx}x{ny}")));
        }
        let mut status = 0;
        let mut axes = [nx as c_long, ny as c_long];
        let mut tile = [nx as c_long, 1];
        // SAFETY: the handle is open; axes and tile have the 2 entries announced.
        unsafe {
            let f = self.raw();
            if compress {
                sys::fits_set_compression_type(f, RICE_1, &mut status);
                sys::fits_set_tile_dim(f, 2, tile.as_mut_ptr(), &mut status);
            }
            sys::ffcrim(f, image_type, 2, axes.as_mut_ptr(), &mut status);
        }
        self.check(status, "writing the header")?;
        self.cards(cards)?;
        // SAFETY: `data` points to `count` elements of type `code`; ffppr only reads them despite its *mut.
        unsafe {
            sys::ffppr(self.raw(), code, 1, count as sys::LONGLONG, data.cast_mut(), &mut status);
            sys::ffflus(self.raw(), &mut status);
        }
        self.check(status, "writing pixels")
    }

    /// Appends a binary table of `rows` rows: `columns` are names and forms (TFORM); rows follow by [`Self::row`].
    pub(crate) fn table(
        &mut self,
        name: &str,
        columns: &[(String, String)],
        rows: usize,
        cards: &[CardLine],
    ) -> Result<()> {
        let texts = |pick: fn(&(String, String)) -> &String| {
            columns.iter().map(|column| c_text(&self.path, pick(column))).collect::<Result<Vec<CString>>>()
        };
        let (names, forms, name) = (texts(|c| &c.0)?, texts(|c| &c.1)?, c_text(&self.path, name)?);
        let pointers = |texts: &[CString]| texts.iter().map(|t| t.as_ptr().cast_mut()).collect::<Vec<_>>();
        let (mut types, mut formats) = (pointers(&names), pointers(&forms));
        let mut status = 0;
        // SAFETY: both lists hold as many valid C strings as announced, which outlive the call and are only read; without
        // units the library writes none.
        unsafe {
            sys::ffcrtb(
                self.raw(),
                BINARY_TBL,
                rows as sys::LONGLONG,
                columns.len() as c_int,
                types.as_mut_ptr(),
                formats.as_mut_ptr(),
                ptr::null_mut(),
                name.as_ptr(),
                &mut status,
            );
        }
        self.check(status, "writing the header of a table")?;
        self.cards(cards)
    }

    /// Writes the bytes of a row of the table, counted from 0.
    pub(crate) fn row(&mut self, index: usize, bytes: &[u8]) -> Result<()> {
        let (row, count) = (index as sys::LONGLONG + 1, bytes.len() as sys::LONGLONG);
        let mut status = 0;
        // SAFETY: `bytes` holds `count` bytes; ffptbb only reads them despite its *mut.
        unsafe { sys::ffptbb(self.raw(), row, 1, count, bytes.as_ptr().cast_mut(), &mut status) };
        self.check(status, "writing a row")
    }

    /// Completes the HDU with DATASUM and CHECKSUM. The library's own call would write the present time into their comments.
    pub(crate) fn checksum(&mut self) -> Result<()> {
        let (mut data_sum, mut hdu_sum) = (0, 0);
        let mut text = [0; 17];
        let mut status = 0;
        self.card(&card("CHECKSUM", "0000000000000000", "makes the sum of the HDU -0"))?;
        self.card(&card("DATASUM", "0", "sum of the data as 32-bit words"))?;
        // SAFETY: the handle is open, sums and status are ours; ffflus fills the last blocks of header and data up.
        unsafe {
            sys::ffflus(self.raw(), &mut status);
            sys::ffgcks(self.raw(), &mut data_sum, &mut hdu_sum, &mut status);
        }
        self.check(status, "the sum of the data")?;
        self.update("DATASUM", &c_text(&self.path, &data_sum.to_string())?)?;
        // SAFETY: as above; ffesum writes 16 characters and a final 0.
        unsafe {
            sys::ffgcks(self.raw(), &mut data_sum, &mut hdu_sum, &mut status);
            sys::ffesum(hdu_sum, 1, text.as_mut_ptr());
        }
        self.check(status, "the checksum")?;
        // SAFETY: ffesum ended the text with a 0.
        let text = unsafe { CStr::from_ptr(text.as_ptr()) };
        self.update("CHECKSUM", text)
    }

    /// Gives a text card another value; its comment stays.
    fn update(&mut self, key: &str, value: &CStr) -> Result<()> {
        let name = c_text(&self.path, key)?;
        let mut status = 0;
        // SAFETY: the handle is open, both are C strings that outlive the call; without a comment the old one stays.
        unsafe { sys::ffmkys(self.raw(), name.as_ptr(), value.as_ptr(), ptr::null(), &mut status) };
        self.check(status, &format!("writing card {key}"))
    }

    fn cards(&mut self, cards: &[CardLine]) -> Result<()> {
        cards.iter().try_for_each(|card| self.card(card))
    }

    fn card(&mut self, (key, value, comment): &CardLine) -> Result<()> {
        if matches!(value, CardValue::Real(v) if !v.is_finite()) {
            return Err(self.error(format!("card {key} is not a finite number")));
        }
        let text = |text: &str| c_text(&self.path, &ascii(text));
        let (name, note) = (text(key)?, text(comment)?);
        let words = if let CardValue::Text(words) = value { text(words)? } else { CString::default() };
        let mut status = 0;
        // SAFETY: the handle is open; every string is a valid C string that outlives the call; the library copies them.
        unsafe {
            let f = self.raw();
            match value {
                CardValue::Text(_) if key == "HISTORY" => sys::ffphis(f, words.as_ptr(), &mut status),
                CardValue::Text(_) if key == "COMMENT" => sys::ffpcom(f, words.as_ptr(), &mut status),
                CardValue::Text(_) => {
                    if words.as_bytes().len() > 60 {
                        sys::ffplsw(f, &mut status);
                    }
                    sys::ffpkls(f, name.as_ptr(), words.as_ptr(), note.as_ptr(), &mut status)
                }
                CardValue::Integer(v) => sys::ffpkyj(f, name.as_ptr(), *v as sys::LONGLONG, note.as_ptr(), &mut status),
                // 17 significant digits give every f64 back exactly.
                CardValue::Real(v) => sys::ffpkyd(f, name.as_ptr(), *v, -17, note.as_ptr(), &mut status),
                CardValue::Logical(v) => sys::ffpkyl(f, name.as_ptr(), c_int::from(*v), note.as_ptr(), &mut status),
            }
        };
        self.check(status, &format!("writing card {key}"))
    }

    /// The library's handle of the open file.
    fn raw(&mut self) -> *mut sys::fitsfile {
        // SAFETY: the handle stays within this type, which keeps the file open and uses it from one thread.
        unsafe { self.file.as_raw() }
    }

    fn check(&self, status: c_int, doing: &str) -> Result<()> {
        check(&self.path, status, doing)
    }

    fn error(&self, problem: String) -> Error {
        Error::Fits { path: self.path.clone(), problem }
    }
}
