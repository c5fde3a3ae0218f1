//! Binary rows of a VOTable: bytes to cells of text.
//!
//! Big-endian numbers, texts and arrays as the IVOA recommendation VOTable 1.4, sections 5.3 and 5.4, has them. Arrays of
//! numbers become one cell with blanks between them.

use csv::StringRecord;

/// What the bytes of a field are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Kind {
    datatype: String,
    /// Elements; `None` = a count stands before them.
    count: Option<usize>,
}

impl Kind {
    /// From the attributes `datatype` and `arraysize`: `8`, `*`, `8*`, `2x3`.
    pub fn of(datatype: &str, arraysize: &str) -> Kind {
        let count = match arraysize {
            "" => Some(1),
            size if size.contains('*') => None,
            size => size.split('x').try_fold(1_usize, |all, n| all.checked_mul(n.parse().ok()?)),
        };
        Kind { datatype: datatype.to_owned(), count }
    }
}

/// Most cells that one byte of a row may stand for: a table of bits has 8.
const MOST_CELLS_PER_BYTE: usize = 64;

/// Rows in memory.
#[derive(Debug)]
pub struct Binary {
    bytes: Vec<u8>,
    at: usize,
    kinds: Vec<Kind>,
    /// Whether bits that mark missing cells stand before each row (BINARY2).
    masked: bool,
}

impl Binary {
    /// Rows of these fields.
    pub fn new(bytes: Vec<u8>, kinds: Vec<Kind>, masked: bool) -> Binary {
        Binary { bytes, at: 0, kinds, masked }
    }

    /// The cells of the next row; `false` at the end.
    ///
    /// # Errors
    /// The bytes end inside a row, or a type is unknown, in words.
    pub fn read(&mut self, cells: &mut StringRecord) -> Result<bool, String> {
        if self.at >= self.bytes.len() || self.kinds.is_empty() {
            return Ok(false);
        }
        let start = self.at;
        let mask = if self.masked { self.take(self.kinds.len().div_ceil(8))?.to_vec() } else { Vec::new() };
        for i in 0..self.kinds.len() {
            let kind = self.kinds[i].clone();
            let cell = self.cell(&kind)?;
            let missing = mask.get(i / 8).is_some_and(|bits| bits & (0x80 >> (i % 8)) != 0);
            cells.push_field(if missing { "" } else { cell.trim() });
        }
        // a row of nothing would be read for ever
        if (self.at - start).saturating_mul(MOST_CELLS_PER_BYTE) < self.kinds.len() {
            let n = self.kinds.len();
            let problem = format!("a binary row of {} bytes for {n} fields (arraysize = \"0\"?)", self.at - start);
            return Err(format!("{problem}; save the VOTable with TABLEDATA"));
        }
        Ok(true)
    }

    fn take(&mut self, n: usize) -> Result<&[u8], String> {
        let end = self.at.checked_add(n).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or("the binary rows of the VOTable end in the middle: fetch it again")?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn cell(&mut self, kind: &Kind) -> Result<String, String> {
        let count = match kind.count {
            Some(count) => count,
            None => number(self.take(4)?, u32::from_be_bytes) as usize,
        };
        let (size, text): (usize, fn(&[u8]) -> String) = match kind.datatype.as_str() {
            "char" => {
                let bytes = self.take(count)?;
                let end = bytes.iter().position(|b| *b == 0).unwrap_or(count);
                return Ok(String::from_utf8_lossy(&bytes[..end]).into_owned());
            }
            "unicodeChar" => {
                let bytes = self.take(count.saturating_mul(2))?;
                let units: Vec<u16> = bytes.chunks_exact(2).map(|b| number(b, u16::from_be_bytes)).collect();
                return Ok(String::from_utf16_lossy(&units).trim_end_matches('\0').to_owned());
            }
            "bit" => {
                self.take(count.div_ceil(8))?;
                return Ok(String::new());
            }
            "boolean" => (1, |b| match b[0] {
                b'T' | b't' | b'1' => "T".to_owned(),
                b'F' | b'f' | b'0' => "F".to_owned(),
                _ => String::new(),
            }),
            "unsignedByte" => (1, |b| b[0].to_string()),
            "short" => (2, |b| number(b, i16::from_be_bytes).to_string()),
            "int" => (4, |b| number(b, i32::from_be_bytes).to_string()),
            "long" => (8, |b| number(b, i64::from_be_bytes).to_string()),
            "float" => (4, |b| number(b, f32::from_be_bytes).to_string()),
            "double" => (8, |b| number(b, f64::from_be_bytes).to_string()),
            "floatComplex" => (8, |_| String::new()),
            "doubleComplex" => (16, |_| String::new()),
            other => return Err(format!("a field of type `{other}`; save the VOTable with TABLEDATA")),
        };
        let bytes = self.take(count.saturating_mul(size))?;
        Ok(bytes.chunks_exact(size).map(text).collect::<Vec<_>>().join(" "))
    }
}

/// The number of these bytes; missing ones are 0.
fn number<const N: usize, T>(bytes: &[u8], from: fn([u8; N]) -> T) -> T {
    let mut all = [0; N];
    for (to, byte) in all.iter_mut().zip(bytes) {
        *to = *byte;
    }
    from(all)
}
