//! The binary tables of a FITS file: where each is, what its header says of the columns, and the bytes of its rows.
//!
//! Bytes; FITS 4.0 section 7.3. Tables of compressed tiles are images and not listed. Not supported: ASCII tables, and the heap
//! behind the rows, which holds arrays of variable length.

use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::cards::{Header, ImageInfo};
use super::scan::Hdus;
use super::stored::{SHORTER, read_exact_at};
use super::structure::{column_bytes, kind};
use crate::base::error::{Error, Result};

/// Rows are read so many bytes at a time.
const CHUNK_BYTES: usize = 1 << 20;
/// A longer row is no row of a table of measurements.
const LONGEST_ROW: usize = 1 << 26;

/// One binary table.
#[derive(Debug)]
pub(crate) struct BinaryTable {
    /// 0-based number of its HDU.
    pub(crate) index: usize,
    /// EXTNAME; empty if there is none.
    pub(crate) name: String,
    /// Its header.
    pub(crate) header: Header,
    /// Its columns.
    pub(crate) fields: Vec<Field>,
    data_at: u64,
    n_rows: u64,
    row_bytes: usize,
}

/// One column: its number, and its bytes in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Field {
    /// From 1, as in TTYPEn.
    pub(crate) n: usize,
    /// Code of its type (FITS 4.0 table 18).
    pub(crate) code: char,
    /// Elements in a row.
    pub(crate) repeat: usize,
    /// Where it begins in a row.
    pub(crate) at: usize,
    /// Bytes in a row.
    pub(crate) bytes: usize,
}

/// Lists the binary tables of a file; the second is what the other HDUs are, in words.
///
/// # Errors
/// [`Error::Io`]; [`Error::Fits`] for a file that is damaged or cut off, with the HDU.
pub(crate) fn binary_tables(path: &Path) -> Result<(Arc<File>, Vec<BinaryTable>, Vec<String>)> {
    let bad = |problem: String| Error::Fits { path: path.to_path_buf(), problem };
    let mut hdus = Hdus::open(path)?;
    let (mut tables, mut others) = (Vec::new(), Vec::new());
    while let Some(scanned) = hdus.next()? {
        let index = scanned.index;
        let header = Header::new(scanned.hdu.cards, ImageInfo::default());
        let is_table = index > 0 && header.text("XTENSION").as_deref() == Some("BINTABLE");
        if !is_table || header.logical("ZIMAGE") == Some(true) {
            let what = match header.text("XTENSION").as_deref() {
                Some("TABLE") => "an ASCII table",
                _ => "an image",
            };
            others.push(format!("HDU {index} is {what}"));
            continue;
        }
        // the widths of the columns make that of the row
        kind(&header, index, hdus.file_bytes()).map_err(|p| bad(format!("HDU {index}: {p}")))?;
        let name = header.text("EXTNAME").unwrap_or_default();
        let row_bytes = header.integer("NAXIS1").and_then(|n| usize::try_from(n).ok()).unwrap_or(0);
        if row_bytes > LONGEST_ROW {
            return Err(bad(format!("HDU {index}: rows of {row_bytes} bytes; at most {LONGEST_ROW} are read")));
        }
        // a row of nothing would be read for ever
        let n_rows = header.integer("NAXIS2").and_then(|n| u64::try_from(n).ok()).filter(|_| row_bytes > 0);
        let data_at = u64::try_from(scanned.data_at).map_err(|_| bad("sizes beyond 64 bit".into()))?;
        let fields =
            fields(&header).ok_or_else(|| bad(format!("HDU {index}: a TFORMn that is not a column format")))?;
        tables.push(BinaryTable { index, name, header, fields, data_at, n_rows: n_rows.unwrap_or(0), row_bytes });
    }
    Ok((Arc::new(hdus.into_file()), tables, others))
}

fn fields(header: &Header) -> Option<Vec<Field>> {
    let (mut fields, mut at) = (Vec::new(), 0);
    for n in 1..=usize::try_from(header.integer("TFIELDS")?).ok()? {
        let form = header.text(&format!("TFORM{n}"))?;
        let digits = form.bytes().take_while(u8::is_ascii_digit).count();
        let repeat = if digits == 0 { 1 } else { form[..digits].parse().ok()? };
        let code = form[digits..].chars().next()?;
        let bytes = usize::try_from(column_bytes(&form)?).ok()?;
        fields.push(Field { n, code, repeat, at, bytes });
        at += bytes;
    }
    Some(fields)
}

/// The rows of a table, read one after another.
#[derive(Debug)]
pub(crate) struct RowBytes {
    file: Arc<File>,
    path: PathBuf,
    at: u64,
    left: u64,
    row_bytes: usize,
    chunk: Vec<u8>,
    used: usize,
}

impl RowBytes {
    /// From the first row on.
    pub(crate) fn new(file: Arc<File>, path: &Path, table: &BinaryTable) -> Self {
        let (at, left, row_bytes) = (table.data_at, table.n_rows, table.row_bytes);
        Self { file, path: path.to_path_buf(), at, left, row_bytes, chunk: Vec::new(), used: 0 }
    }

    /// The bytes of the next row; `None` at the end.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Fits`] if the file has become shorter since it was scanned.
    pub(crate) fn next(&mut self) -> Result<Option<&[u8]>> {
        if self.used == self.chunk.len() {
            let rows = self.left.min((CHUNK_BYTES / self.row_bytes.max(1)).max(1) as u64);
            if rows == 0 {
                return Ok(None);
            }
            // at most a chunk, or one row
            self.chunk.resize(rows as usize * self.row_bytes, 0);
            read_exact_at(&self.file, &mut self.chunk, self.at).map_err(|e| match e.kind() {
                ErrorKind::UnexpectedEof => Error::Fits { path: self.path.clone(), problem: SHORTER.into() },
                _ => Error::io(&self.path, e),
            })?;
            self.at += self.chunk.len() as u64;
            self.left -= rows;
            self.used = 0;
        }
        let from = self.used;
        self.used += self.row_bytes;
        Ok(self.chunk.get(from..self.used))
    }
}
