//! Where the tiles of a compressed image lie in its table and heap, and how each is to be decoded.
//!
//! Bytes and pixels. From a header the scan has passed; the descriptors in the table are checked here, tile by tile,
//! against the heap.

use std::ops::Range;

use super::dither::Dither;
use crate::fits::cards::Header;
use crate::fits::linear::Linear;

/// Most pixels of a tile: an image of the largest detectors in one piece.
const MAX_TILE_PX: usize = 1 << 28;
/// Longest table of tiles \[bytes\]: that of a tile takes some 30.
const MAX_TABLE_BYTES: u64 = 64 << 20;

/// How the bytes of a tile become numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Method {
    Rice {
        byte_pix: i64,
        block: usize,
    },
    Gzip {
        shuffled: bool,
    },
    Bytes {
        shuffled: bool,
    },
    HCompress {
        smooth: bool,
    },
    Plio,
    /// Floats that were not quantised: column GZIP_COMPRESSED_DATA.
    LosslessFloats,
    /// Column UNCOMPRESSED_DATA, with its BITPIX.
    Uncompressed(i64),
}

/// One tile in the file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub at: u64,
    pub bytes: u64,
    pub method: Method,
}

impl Place {
    /// Pixels that a tile can hold at the most.
    pub(super) fn most_pixels(&self) -> u128 {
        let most = match self.method {
            // a block of equal pixels is one code of at least 3 bits
            Method::Rice { block, .. } => 3 * block as u128,
            // deflate: 1032 to 1
            Method::Gzip { .. } | Method::LosslessFloats => 1_032,
            // exactly 1 or less; a few tiles whose row of the table is damaged must not cost the whole image
            Method::Bytes { .. } | Method::Uncompressed(_) => 16,
            // runs of 4095 in two bytes; a quadtree of nothing
            Method::Plio | Method::HCompress { .. } => 4_096,
        };
        u128::from(self.bytes) * most
    }
}

/// A column of the table: where it begins in a row, and its code in TFORM; of an array in the heap, that of its
/// elements.
#[derive(Debug, Clone, Copy)]
struct Column {
    at: usize,
    code: char,
    /// 4 or 8 bytes per number of a descriptor; 0 for a column that holds its numbers itself.
    descriptor: usize,
}

/// A constant or one number per tile.
#[derive(Debug, Clone, Copy)]
enum PerTile {
    Constant(f64),
    Column(Column),
}

/// The tiles of one image.
#[derive(Debug)]
pub(super) struct Layout {
    pub size_px: (usize, usize),
    pub tile_px: (usize, usize),
    pub table_at: u64,
    pub row_bytes: usize,
    /// Tile of the first row of the table that is held.
    pub first_held: usize,
    pub bitpix: i64,
    /// Floats rounded to integers.
    pub quantised: bool,
    pub dither: Dither,
    heap: Range<u64>,
    method: Method,
    compressed: Column,
    lossless: Option<Column>,
    uncompressed: Option<Column>,
    /// BSCALE and BZERO.
    header: Linear,
    scale: PerTile,
    zero: PerTile,
    blank: Option<PerTile>,
}

impl Layout {
    /// From the header of the table.
    pub(super) fn of(header: &Header) -> Result<Self, String> {
        let whole = |key: &str| {
            let value = header.integer(key).and_then(|v| u64::try_from(v).ok());
            value.ok_or_else(|| format!("{key} is missing or not a whole number"))
        };
        let (size_px, bitpix) = (header.size_px(), header.bitpix());
        let tile = |n: usize, axis: usize, absent: usize| match header.integer(&format!("ZTILE{n}")) {
            // A tile that reaches beyond the image ends with it.
            Some(length) => usize::try_from(length).unwrap_or(0).clamp(1, axis.max(1)),
            None => absent,
        };
        let tile_px = (tile(1, size_px.0, size_px.0), tile(2, size_px.1, 1));
        if tile_px.0.saturating_mul(tile_px.1) > MAX_TILE_PX {
            return Err(format!(
                "a tile of {}x{} px; at most {MAX_TILE_PX} px are unpacked at once",
                tile_px.0, tile_px.1
            ));
        }
        let (row_bytes, rows) = (whole("NAXIS1")?, whole("NAXIS2")?);
        let table_at = header.data_at().ok_or("no image in the header")?;
        let table = row_bytes.checked_mul(rows).ok_or("the table is absurdly large")?;
        if table > MAX_TABLE_BYTES {
            return Err(format!("the table of the tiles takes {table} bytes; at most {MAX_TABLE_BYTES} are read"));
        }
        let gap = match header.card("THEAP") {
            None => table,
            Some(_) => whole("THEAP")?,
        };
        let data = table.checked_add(whole("PCOUNT")?).ok_or("PCOUNT is absurdly large")?;
        if gap < table || gap > data {
            return Err(format!("THEAP = {gap} is not between the table ({table} bytes) and its end ({data})"));
        }
        let columns = columns(header)?;
        let find = |name: &str| columns.iter().find(|(n, _)| n == name).map(|(_, c)| *c);
        let compressed = find("COMPRESSED_DATA").filter(|c| c.descriptor > 0);
        let compressed = compressed.ok_or("no column COMPRESSED_DATA of arrays in the heap")?;
        let per_tile = |name: &str| match (find(name), header.number(name)) {
            (Some(column), _) if matches!(column.code, 'D' | 'E' | 'J' | 'I' | 'K') && column.descriptor == 0 => {
                Ok(Some(PerTile::Column(column)))
            }
            (Some(_), _) => Err(format!("column {name} holds no numbers")),
            (None, number) => Ok(number.map(PerTile::Constant)),
        };
        let (scale, zero, blank) = (per_tile("ZSCALE")?, per_tile("ZZERO")?, per_tile("ZBLANK")?);
        let method_of_floats = header.text("ZQUANTIZ").unwrap_or_default();
        let quantised = bitpix < 0 && (scale.is_some() || zero.is_some()) && method_of_floats != "NONE";
        let method = method(header, compressed)?;
        let integers_only = matches!(method, Method::Rice { .. } | Method::HCompress { .. } | Method::Plio);
        if (bitpix < 0 && !quantised && integers_only) || (bitpix == 64 && integers_only) {
            return Err(format!("ZBITPIX = {bitpix} cannot be compressed this way without ZSCALE and ZZERO"));
        }
        let seed = header.integer("ZDITHER0").unwrap_or(1);
        let dither = match method_of_floats.as_str() {
            "SUBTRACTIVE_DITHER_1" => Dither::Subtractive(seed),
            "SUBTRACTIVE_DITHER_2" => Dither::ExactZeros(seed),
            "" | "NO_DITHER" | "NONE" => Dither::None,
            other => return Err(format!("ZQUANTIZ = '{other}' is unknown")),
        };
        let header_scaling = Linear::of(header, if header.card("ZBLANK").is_some() { "ZBLANK" } else { "BLANK" })?;
        Ok(Self {
            size_px,
            tile_px,
            table_at,
            row_bytes: usize::try_from(row_bytes).map_err(|_| "NAXIS1 is absurdly large")?,
            first_held: 0,
            bitpix,
            quantised,
            dither,
            heap: table_at.saturating_add(gap)..table_at.saturating_add(data),
            method,
            compressed,
            lossless: find("GZIP_COMPRESSED_DATA").filter(|c| c.descriptor > 0),
            uncompressed: find("UNCOMPRESSED_DATA").filter(|c| c.descriptor > 0),
            header: header_scaling,
            scale: scale.unwrap_or(PerTile::Constant(1.0)),
            zero: zero.unwrap_or(PerTile::Constant(0.0)),
            blank,
        })
    }

    /// Tiles along a row of the image.
    fn along(&self) -> usize {
        self.size_px.0.div_ceil(self.tile_px.0)
    }

    /// Number of tiles.
    pub(super) fn tiles(&self) -> usize {
        self.along() * self.size_px.1.div_ceil(self.tile_px.1)
    }

    /// 0-based number of a tile, which is its row of the table.
    pub(super) fn index(&self, down: usize, along: usize) -> usize {
        down * self.along() + along
    }

    /// Bytes per number that a gzip or raw tile may hold.
    pub(super) fn stored_widths(&self) -> [usize; 3] {
        match (self.quantised, self.bitpix) {
            (true, _) => [4; 3],
            (false, 64) => [8; 3],
            (false, 1..) => [1, 2, 4],
            (false, bitpix) => [(bitpix.unsigned_abs() / 8) as usize; 3],
        }
    }

    /// Scaling of floats that were not quantised.
    pub(super) fn floats(&self) -> Linear {
        Linear { blank: None, ..self.header }
    }

    /// The bytes of tile `index`, whose row of the table is `row`.
    pub(super) fn place(&self, row: &[u8], index: usize) -> Result<Place, String> {
        let choices = [
            (Some(self.compressed), self.method),
            (self.lossless.filter(|_| self.bitpix < 0), Method::LosslessFloats),
            (self.uncompressed, Method::Uncompressed(0)),
        ];
        let incomplete = |index: usize| format!("tile {}: its row of the table is incomplete", index + 1);
        for (column, method) in choices.into_iter().filter_map(|(c, m)| Some((c?, m))) {
            let number = |at: usize| match column.descriptor {
                4 => row.get(at..)?.first_chunk::<4>().map(|b| i64::from(i32::from_be_bytes(*b))),
                _ => row.get(at..)?.first_chunk::<8>().map(|b| i64::from_be_bytes(*b)),
            };
            let length = number(column.at).ok_or_else(|| incomplete(index))?;
            let offset = number(column.at + column.descriptor).ok_or_else(|| incomplete(index))?;
            if length == 0 {
                continue;
            }
            let (width, bitpix) = match column.code {
                'B' | 'A' | 'L' | 'X' => (1, 8),
                'I' => (2, 16),
                'J' => (4, 32),
                'K' => (8, 64),
                'E' => (4, -32),
                'D' => (8, -64),
                other => return Err(format!("its column has the format {other}")),
            };
            let inside = u64::try_from(length).ok().zip(u64::try_from(offset).ok()).and_then(|(length, offset)| {
                let (bytes, at) = (length.checked_mul(width)?, self.heap.start.checked_add(offset)?);
                (at.checked_add(bytes)? <= self.heap.end).then_some((at, bytes))
            });
            let (at, bytes) = inside.ok_or_else(|| {
                let heap = self.heap.end - self.heap.start;
                format!(
                    "tile {} of {}: {length} elements at byte {offset} of the heap, which has {heap} bytes",
                    index + 1,
                    self.tiles()
                )
            })?;
            // 8 bytes a pixel at most, and what a compression adds to noise
            let most = 16 * self.tile_px.0 as u64 * self.tile_px.1 as u64 + (1 << 16);
            if bytes > most {
                return Err(format!(
                    "tile {} of {}: {bytes} bytes for {}x{} px; a tile of that size has at most {most}",
                    index + 1,
                    self.tiles(),
                    self.tile_px.0,
                    self.tile_px.1
                ));
            }
            let method = if let Method::Uncompressed(_) = method { Method::Uncompressed(bitpix) } else { method };
            return Ok(Place { at, bytes, method });
        }
        Err(format!("tile {} of {} was never written", index + 1, self.tiles()))
    }

    /// Scaling of the tile whose row of the table is `row`.
    pub(super) fn linear(&self, row: &[u8]) -> Linear {
        let value = |p: PerTile| match p {
            PerTile::Constant(v) => v,
            PerTile::Column(c) => number(row, c).unwrap_or(f64::NAN),
        };
        let blank = self.blank.map(value).filter(|b| b.is_finite()).map(|b| b as i64);
        if !self.quantised {
            return Linear { blank: if self.bitpix > 0 { blank.or(self.header.blank) } else { None }, ..self.header };
        }
        let (scale, zero) = (value(self.scale), value(self.zero));
        // BSCALE and BZERO on top, where a header has both.
        Linear { scale: scale * self.header.scale, zero: zero * self.header.scale + self.header.zero, blank }
    }
}

/// A number that a row of the table holds itself.
fn number(row: &[u8], column: Column) -> Option<f64> {
    let bytes = row.get(column.at..)?;
    Some(match column.code {
        'D' => f64::from_be_bytes(*bytes.first_chunk()?),
        'E' => f64::from(f32::from_be_bytes(*bytes.first_chunk()?)),
        'I' => f64::from(i16::from_be_bytes(*bytes.first_chunk()?)),
        'J' => f64::from(i32::from_be_bytes(*bytes.first_chunk()?)),
        _ => i64::from_be_bytes(*bytes.first_chunk()?) as f64,
    })
}

/// Names (upper case) and places of the columns. The scan has checked the formats and the width of a row.
fn columns(header: &Header) -> Result<Vec<(String, Column)>, String> {
    let mut at = 0usize;
    (1..=header.integer("TFIELDS").unwrap_or(0))
        .map(|n| {
            let form = header.text(&format!("TFORM{n}")).unwrap_or_default();
            let bytes = crate::fits::structure::column_bytes(&form).and_then(|b| usize::try_from(b).ok());
            let bytes = bytes.ok_or_else(|| format!("TFORM{n} = '{form}' is not a plain column format"))?;
            let mut letters = form.trim_start_matches(|c: char| c.is_ascii_digit()).chars();
            let code = letters.next().unwrap_or(' ');
            let (code, descriptor) = match code {
                'P' | 'Q' if bytes > 0 => (letters.next().unwrap_or(' '), if code == 'P' { 4 } else { 8 }),
                _ => (if bytes > 0 { code } else { ' ' }, 0),
            };
            let name = header.text(&format!("TTYPE{n}")).unwrap_or_default().to_ascii_uppercase();
            let column = Column { at, code, descriptor };
            at = at.checked_add(bytes).ok_or("the columns are absurdly wide")?;
            Ok((name, column))
        })
        .collect()
}

/// ZCMPTYPE and its parameters.
fn method(header: &Header, compressed: Column) -> Result<Method, String> {
    let parameter = |name: &str| {
        (1..=99).map_while(|i| header.text(&format!("ZNAME{i}")).map(|n| (i, n))).find(|(_, n)| n == name).map(
            |(i, _)| {
                let key = format!("ZVAL{i}");
                header.integer(&key).ok_or_else(|| format!("{key} is not a usable {name}"))
            },
        )
    };
    let shuffled = |name: &str| name == "GZIP_2";
    let name = header.text("ZCMPTYPE").unwrap_or_default();
    Ok(match name.as_str() {
        "RICE_1" | "RICE_ONE" => {
            let block = parameter("BLOCKSIZE").unwrap_or(Ok(32))?;
            let block = usize::try_from(block).ok().filter(|b| *b > 0);
            Method::Rice {
                byte_pix: parameter("BYTEPIX").unwrap_or(Ok(4))?,
                block: block.ok_or("BLOCKSIZE is not positive")?,
            }
        }
        "GZIP_1" | "GZIP_2" => Method::Gzip { shuffled: shuffled(&name) },
        "NOCOMPRESS" => Method::Bytes { shuffled: false },
        "HCOMPRESS_1" => Method::HCompress { smooth: parameter("SMOOTH").unwrap_or(Ok(0))? != 0 },
        "PLIO_1" if compressed.code == 'I' => Method::Plio,
        other => return Err(format!("ZCMPTYPE = '{other}' with arrays of {} is unknown", compressed.code)),
    })
}
