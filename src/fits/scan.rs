//! The scan of a file's headers up to its image: whether it holds what it promises, before anything is allocated.
//!
//! Bytes. A header that lies about its size would make us allocate what it says, so every size is held against the
//! length of the file here ([`super::structure`] knows what a header may say). It does not cover checksums
//! ([`super::checksum`]) and everything after the image.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::cards::{Card, Header, ImageInfo};
use super::open::open;
use super::structure::{Hdu, Kind, check_hdu, kind};
use super::tiles;
use crate::base::error::{Error, Result};

/// Bytes of a FITS block and of a card (FITS 4.0 section 3.1).
const BLOCK: usize = 2880;
const CARD: usize = 80;
/// No honest header is longer \[bytes\].
const MAX_HEADER: usize = 16 << 20;
/// Most headers a file may have before its image.
const MAX_HDUS: usize = 10_000;

impl Header {
    /// Scans the cards of `path`, picks the image HDU and holds what it promises against the file.
    ///
    /// The image is the first HDU with a 2-D image (further axes of length 1 are accepted), or with a
    /// tile-compressed one. Nothing but headers is read.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io) if the file cannot be read; [`Error::Fits`](crate::Error::Fits) saying what is
    /// wrong: not FITS, damaged or lying header, truncated (with the bytes expected and present), no 2-D image.
    pub fn read(path: &Path) -> Result<Header> {
        let (cards, image) = scan(path)?;
        Ok(Header::new(cards, image))
    }
}

/// The HDUs of a file, one after the other, each held against the length of the file.
pub(crate) struct Hdus<'a> {
    path: &'a Path,
    file: File,
    file_bytes: u128,
    at: u64,
    index: usize,
}

/// One HDU: its header, and the bytes of the file that it takes.
pub(crate) struct ScannedHdu {
    pub(crate) hdu: Hdu,
    /// 0-based number in the file.
    pub(crate) index: usize,
    /// Where its header begins \[bytes\].
    pub(crate) at: u64,
    /// Where its data begin \[bytes\].
    pub(crate) data_at: u128,
    /// Where they end, padding excluded \[bytes\].
    pub(crate) end: u128,
    /// Where the next HDU begins \[bytes\].
    padded: u128,
}

impl<'a> Hdus<'a> {
    /// Opens a file, also one that is packed as a whole.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Fits`] for what is not a regular file.
    pub(crate) fn open(path: &'a Path) -> Result<Self> {
        // Before it is opened: a pipe would wait for its writer.
        let meta = std::fs::metadata(path).map_err(|e| Error::io(path, e))?;
        if let Some(error) = meta.is_dir().then(|| std::fs::read_dir(path).err()).flatten() {
            return Err(Error::io(path, error)); // a folder of the night, whose frames nobody knows
        }
        if !meta.is_file() {
            return Err(Error::Fits { path: path.to_path_buf(), problem: "not a regular file".into() });
        }
        let file = open(path)?;
        let file_bytes = u128::from(file.metadata().map_err(|e| Error::io(path, e))?.len());
        Ok(Self { path, file, file_bytes, at: 0, index: 0 })
    }

    /// Bytes of the file.
    pub(crate) fn file_bytes(&self) -> u128 {
        self.file_bytes
    }

    /// The file, whose place is anywhere.
    pub(crate) fn into_file(self) -> File {
        self.file
    }

    fn bad(&self, problem: String) -> Error {
        Error::Fits { path: self.path.to_path_buf(), problem }
    }

    /// The next HDU; `None` at the end.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Fits`] for a damaged or lying header, and for data that the file does not hold.
    pub(crate) fn next(&mut self) -> Result<Option<ScannedHdu>> {
        let (index, at) = (self.index, self.at);
        if index >= MAX_HDUS {
            return Ok(None);
        }
        if u128::from(at) >= self.file_bytes {
            return if index == 0 { Err(self.bad("the file is empty".into())) } else { Ok(None) };
        }
        self.file.seek(SeekFrom::Start(at)).map_err(|e| Error::io(self.path, e))?;
        let raw = match read_header(&mut self.file, index).map_err(|e| Error::io(self.path, e))? {
            Ok(raw) => raw,
            // Fill after the last HDU is allowed (FITS 4.0 section 3.5).
            Err(Problem::NotAnHdu) if index > 0 => return Ok(None),
            Err(problem) => return Err(self.bad(problem.text(index))),
        };
        let data_at = u128::from(at) + raw.len() as u128;
        let hdu = check_hdu(raw, index).map_err(|p| self.bad(format!("HDU {index}: {p}")))?;
        let end = data_at + hdu.data_bytes;
        if end > self.file_bytes {
            return Err(self.bad(format!(
                "truncated: the header of HDU {index} promises {} bytes of data, the file holds {}",
                hdu.data_bytes,
                self.file_bytes.saturating_sub(data_at)
            )));
        }
        let padded = end.div_ceil(BLOCK as u128) * BLOCK as u128;
        self.at = u64::try_from(padded).map_err(|_| self.bad("sizes beyond 64 bit".into()))?;
        self.index += 1;
        Ok(Some(ScannedHdu { hdu, index, at, data_at, end, padded }))
    }
}

/// Scans the headers of `path` up to its first 2-D image. See [`Header::read`].
pub(crate) fn scan(path: &Path) -> Result<(Vec<Card>, ImageInfo)> {
    let bad = |problem: String| Error::Fits { path: path.to_path_buf(), problem };
    let mut hdus = Hdus::open(path)?;
    let file_bytes = hdus.file_bytes();
    let mut primary: Vec<Card> = Vec::new();
    let mut seen: Vec<String> = Vec::new();
    while let Some(ScannedHdu { hdu, index, at, data_at, end, padded }) = hdus.next()? {
        let header = Header::new(hdu.cards.clone(), ImageInfo::default());
        match kind(&header, index, file_bytes).map_err(|p| bad(format!("HDU {index}: {p}")))? {
            Kind::Image(axes) => {
                let compressed = header.logical("ZIMAGE") == Some(true) && index > 0;
                let bitpix = header.integer(if compressed { "ZBITPIX" } else { "BITPIX" }).unwrap_or(0);
                let mut warnings = hdu.warnings;
                if padded > file_bytes {
                    warnings.push(format!(
                        "cut in the padding of HDU {index}: {} bytes are missing to a whole block of {BLOCK}; every pixel is there",
                        padded - file_bytes
                    ));
                }
                if bitpix < 0 && header.card("BLANK").is_some() {
                    warnings.push("BLANK has no meaning for floating-point pixels and is not used".into());
                }
                let mut cards = hdu.cards;
                cards.extend(primary.into_iter().filter(inherited));
                let image = ImageInfo {
                    hdu_index: index,
                    compressed,
                    bitpix,
                    axes,
                    hdu_at: at,
                    data_at: u64::try_from(data_at).ok(),
                    data_end: u64::try_from(end).unwrap_or(u64::MAX),
                    warnings,
                };
                if compressed {
                    let header = Header::new(cards.clone(), image.clone());
                    tiles::refuse_impossible(&hdus.into_file(), path, &header)?;
                }
                return Ok((cards, image));
            }
            Kind::Other(what) => seen.push(format!("HDU {index} {what}")),
        }
        if index == 0 {
            primary = hdu.cards;
        }
    }
    Err(bad(format!("no 2-D image in this file ({})", seen.join("; "))))
}

/// A primary card that an extension may inherit: everything but the structure.
fn inherited(card: &Card) -> bool {
    !matches!(
        card.keyword.as_str(),
        "SIMPLE" | "BITPIX" | "NAXIS" | "EXTEND" | "END" | "BSCALE" | "BZERO" | "BLANK" | "CHECKSUM" | "DATASUM"
    ) && !(card.keyword.starts_with("NAXIS"))
}

/// Why a header could not be taken from the file.
enum Problem {
    NotAnHdu,
    NoEnd,
    Control(usize),
}

impl Problem {
    fn text(&self, index: usize) -> String {
        match self {
            Problem::NotAnHdu => "not a FITS file: it does not begin with SIMPLE".into(),
            Problem::NoEnd => format!("HDU {index}: the header has no END card"),
            Problem::Control(card) => {
                format!("HDU {index}: card {card} holds control characters (line breaks?) and is not FITS")
            }
        }
    }
}

/// Reads the blocks of one header, END included.
fn read_header(file: &mut File, index: usize) -> std::io::Result<std::result::Result<Vec<u8>, Problem>> {
    let mut raw = Vec::new();
    let mut block = [0u8; BLOCK];
    while raw.len() < MAX_HEADER {
        let mut filled = 0;
        while filled < BLOCK {
            match file.read(&mut block[filled..])? {
                0 => break,
                n => filled += n,
            }
        }
        let start = if index == 0 { b"SIMPLE  ".as_slice() } else { b"XTENSION".as_slice() };
        if raw.is_empty() && !block[..filled].starts_with(start) {
            return Ok(Err(Problem::NotAnHdu));
        }
        if filled == 0 {
            return Ok(Err(Problem::NoEnd));
        }
        // A header cut behind its END is whole; what its data lack follows from their size.
        block[filled..].fill(b' ');
        for (i, card) in block.chunks(CARD).enumerate() {
            if card.starts_with(b"END") && card[3..].iter().all(|b| *b == b' ') {
                raw.extend_from_slice(&block);
                return Ok(Ok(raw));
            }
            // Accents in comments are tolerated, control characters are not.
            if card.iter().any(|b| *b < 0x20 || *b == 0x7f) {
                return Ok(Err(Problem::Control(raw.len() / CARD + i)));
            }
        }
        if filled < BLOCK {
            return Ok(Err(Problem::NoEnd));
        }
        raw.extend_from_slice(&block);
    }
    Ok(Err(Problem::NoEnd))
}
