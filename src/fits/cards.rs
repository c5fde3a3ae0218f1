//! A header: the 80-byte cards of a FITS file, read by ourselves and without the FITS library.
//!
//! Values are kept as text and parsed on request; no units here. It does not cover the meaning of keywords
//! ([`crate::frames::exposure`], [`crate::frames::time`]) and the checks that make a file safe to open
//! ([`super::scan`]).

use std::collections::HashMap;
use std::sync::Arc;

/// One header card.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Card {
    /// Keyword in upper case; the part after `HIERARCH` of such a card.
    pub keyword: String,
    /// Value as text: a string without its quotes, a number as written, the text of COMMENT and HISTORY.
    pub value: String,
    /// Comment, trimmed.
    pub comment: String,
    /// Whether the value was a quoted string.
    pub is_text: bool,
}

impl Card {
    /// Parses one card; bytes that are not printable ASCII become `?`. `None` for a blank card.
    pub(crate) fn parse(bytes: &[u8]) -> Option<Card> {
        let line: String = bytes.iter().map(|b| if (0x20..0x7f).contains(b) { *b as char } else { '?' }).collect();
        let word = line.get(..8.min(line.len()))?.trim_end().to_ascii_uppercase();
        if let Some((name, value)) = line.get(8..).filter(|_| word == "HIERARCH").and_then(|rest| rest.split_once('='))
        {
            let (value, comment, is_text) = parse_value(value);
            return Some(Card { keyword: name.trim().to_ascii_uppercase(), value, comment, is_text });
        }
        match line.get(8..) {
            Some(rest) if rest.starts_with('=') && !matches!(word.as_str(), "COMMENT" | "HISTORY" | "") => {
                let (value, comment, is_text) = parse_value(&rest[1..]);
                Some(Card { keyword: word, value, comment, is_text })
            }
            Some(rest) if word == "CONTINUE" => {
                let (value, comment, is_text) = parse_value(rest);
                Some(Card { keyword: word, value, comment, is_text })
            }
            rest => {
                let value = rest.unwrap_or("").trim().to_string();
                let blank = word.is_empty() && value.is_empty();
                (!blank).then(|| Card { keyword: word, value, comment: String::new(), is_text: true })
            }
        }
    }
}

/// Splits `'a''b' / comment` or `1.0 / comment` into (value, comment, was quoted).
fn parse_value(text: &str) -> (String, String, bool) {
    let text = text.trim_start();
    let Some(inner) = text.strip_prefix('\'') else {
        let (value, comment) = text.split_once('/').unwrap_or((text, ""));
        return (value.trim().to_string(), comment.trim().to_string(), false);
    };
    let mut value = String::new();
    let mut chars = inner.char_indices().peekable();
    let mut rest = "";
    while let Some((at, c)) = chars.next() {
        if c != '\'' {
            value.push(c);
        } else if chars.next_if(|(_, next)| *next == '\'').is_some() {
            value.push('\'');
        } else {
            rest = &inner[at + 1..];
            break;
        }
    }
    let comment = rest.split_once('/').map_or("", |(_, c)| c.trim());
    (value.trim_end().to_string(), comment.to_string(), true)
}

/// Appends CONTINUE cards to the string they continue (FITS 4.0 section 4.2.1.2).
pub(crate) fn join_continued(cards: Vec<Card>) -> Vec<Card> {
    let mut joined: Vec<Card> = Vec::with_capacity(cards.len());
    for card in cards {
        let continues = card.keyword == "CONTINUE" && card.is_text;
        if let Some(last) = joined.last_mut().filter(|l| continues && l.is_text && l.value.ends_with('&')) {
            last.value.pop();
            last.value.push_str(&card.value);
            if !last.comment.is_empty() && !card.comment.is_empty() {
                last.comment.push(' ');
            }
            last.comment.push_str(&card.comment);
            continue;
        }
        joined.push(card);
    }
    joined
}

/// What the scan found out about the image.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct ImageInfo {
    pub hdu_index: usize,
    pub compressed: bool,
    pub bitpix: i64,
    /// NAXISn of the uncompressed image, fastest first.
    pub axes: Vec<usize>,
    /// Where its header begins in the file \[bytes\].
    pub hdu_at: u64,
    /// Where its data begin in the file \[bytes\]; absent if no file was scanned.
    pub data_at: Option<u64>,
    /// Where they end, padding excluded \[bytes\].
    pub data_end: u64,
    /// What is odd but no reason to refuse the file.
    pub warnings: Vec<String>,
}

#[derive(Debug, Default)]
struct Inner {
    cards: Vec<Card>,
    first: HashMap<String, usize>,
    image: ImageInfo,
}

/// Which pixels of a colour sensor are green, by column and row of the file, both from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Green {
    /// Those whose column and row are both even or both odd: GRBG, GBRG.
    Same,
    /// Those of which one is even and the other odd: RGGB, BGGR.
    Mixed,
}

/// The cards of the image HDU, with those of the primary HDU as the fallback. Cheap to clone.
///
/// Of a colour sensor also which pixels are green: its image is read as superpixels of 2 × 2 pixels.
#[derive(Debug, Clone, Default)]
pub struct Header(Arc<Inner>, Option<Green>);

impl Header {
    /// From the text of a header: lines, or 80-character cards in one long line. Nothing is validated.
    #[must_use]
    pub fn from_text(text: &str) -> Header {
        let cards = text.lines().flat_map(|line| line.as_bytes().chunks(80)).filter_map(Card::parse).collect();
        let mut header = Self::new(join_continued(cards), ImageInfo::default());
        let axis = |n: usize| header.integer(&format!("NAXIS{n}")).and_then(|v| usize::try_from(v).ok());
        let axes = (1..=9).map_while(axis).collect();
        let image = ImageInfo { axes, bitpix: header.integer("BITPIX").unwrap_or(0), ..ImageInfo::default() };
        if let Some(inner) = Arc::get_mut(&mut header.0) {
            inner.image = image;
        }
        header
    }

    pub(crate) fn new(cards: Vec<Card>, image: ImageInfo) -> Header {
        let mut first = HashMap::with_capacity(cards.len());
        for (i, card) in cards.iter().enumerate() {
            first.entry(card.keyword.clone()).or_insert(i);
        }
        Header(Arc::new(Inner { cards, first, image }), None)
    }

    /// The same file, read as superpixels of its green pixels; `None` as it is stored.
    #[must_use]
    pub fn with_green(&self, green: Option<Green>) -> Header {
        Header(Arc::clone(&self.0), green)
    }

    /// Which pixels are green, where the file is read as superpixels.
    #[must_use]
    pub fn green(&self) -> Option<Green> {
        self.1
    }

    /// The first card of this keyword (any case, with or without `HIERARCH`).
    #[must_use]
    pub fn card(&self, key: &str) -> Option<&Card> {
        let key = key.trim().to_ascii_uppercase();
        let key = key.strip_prefix("HIERARCH ").unwrap_or(&key).trim();
        self.0.first.get(key).and_then(|i| self.0.cards.get(*i))
    }

    /// The value as text; `None` if absent or empty.
    #[must_use]
    pub fn text(&self, key: &str) -> Option<String> {
        self.card(key).map(|c| c.value.trim().to_string()).filter(|v| !v.is_empty())
    }

    /// The value as a finite number; also from a string, also with a Fortran `D` exponent.
    #[must_use]
    pub fn number(&self, key: &str) -> Option<f64> {
        self.card(key).and_then(|c| parse_number(&c.value))
    }

    /// The value as a whole number (`120`, `120.0`, `'120'`).
    #[must_use]
    pub fn integer(&self, key: &str) -> Option<i64> {
        let text = self.text(key)?;
        text.parse()
            .ok()
            .or_else(|| parse_number(&text).filter(|v| v.fract() == 0.0 && v.abs() < 9.0e15).map(|v| v as i64))
    }

    /// The value as a logical (`T`, `F`).
    #[must_use]
    pub fn logical(&self, key: &str) -> Option<bool> {
        match self.card(key)?.value.trim() {
            "T" => Some(true),
            "F" => Some(false),
            _ => None,
        }
    }

    /// The comment; `None` if the card is absent or has none.
    #[must_use]
    pub fn comment(&self, key: &str) -> Option<String> {
        self.card(key).map(|c| c.comment.clone()).filter(|c| !c.is_empty())
    }

    /// Every card: those of the image HDU, then those of the primary HDU that the image does not repeat.
    #[must_use]
    pub fn cards(&self) -> &[Card] {
        &self.0.cards
    }

    /// Size (nx, ny) of the uncompressed image as it is stored \[px\].
    #[must_use]
    pub fn size_px(&self) -> (usize, usize) {
        let axis = |n: usize| self.0.image.axes.get(n).copied().unwrap_or(0);
        (axis(0), axis(1))
    }

    /// Number of axes of the image, those of length 1 included.
    #[must_use]
    pub fn n_axes(&self) -> usize {
        self.0.image.axes.len()
    }

    /// 0-based number of the image HDU.
    #[must_use]
    pub fn hdu_index(&self) -> usize {
        self.0.image.hdu_index
    }

    /// Where the image's data begin in the file \[bytes\]; absent if no file was scanned.
    pub(crate) fn data_at(&self) -> Option<u64> {
        self.0.image.data_at
    }

    /// Bytes of the file that the image HDU takes: where its header begins, and where its data end.
    pub(crate) fn hdu_bytes(&self) -> (u64, u64) {
        (self.0.image.hdu_at, self.0.image.data_end)
    }

    /// What is odd about the file but no reason to refuse it: padding that is missing, characters that are not ASCII.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.0.image.warnings
    }

    /// Whether the image is tile-compressed.
    #[must_use]
    pub fn is_compressed(&self) -> bool {
        self.0.image.compressed
    }

    /// BITPIX of the uncompressed image: 8, 16, 32, 64, -32 or -64.
    #[must_use]
    pub fn bitpix(&self) -> i64 {
        self.0.image.bitpix
    }
}

/// A finite decimal number, with `D` accepted for `E`.
pub(crate) fn parse_number(text: &str) -> Option<f64> {
    let text = text.trim();
    let plain = text.bytes().all(|b| b.is_ascii_digit() || b"+-.eEdD".contains(&b));
    let value: f64 = if plain { text.replace(['d', 'D'], "E").parse().ok()? } else { return None };
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_as_people_write_them() {
        let h = Header::from_text(
            "EGAIN   =          1.5D-01 / [e-/ADU]\nEXPTIME = '120.00  '           / s\nOBJECT  = 'O''Neill / 1' / who\n\
             HIERARCH CAMERA-DATE-OBS = '2018-09-17T21:04:46' / start\nFLAG    =                    T\n\
             LONG    = 'abc&'\nCONTINUE  'def&' / x\nCONTINUE  'ghi' / y\nBIG     = 1E999\nHISTORY flat = 3\nFLAG    =  F\n",
        );
        assert_eq!(h.number("egain"), Some(0.15));
        assert_eq!((h.number("EXPTIME"), h.integer("EXPTIME")), (Some(120.0), Some(120)));
        assert_eq!(h.text("OBJECT").as_deref(), Some("O'Neill / 1"));
        assert_eq!(h.comment("OBJECT").as_deref(), Some("who"));
        assert_eq!(h.text("HIERARCH CAMERA-DATE-OBS").as_deref(), Some("2018-09-17T21:04:46"));
        assert_eq!(h.text("CAMERA-DATE-OBS"), h.text("HIERARCH CAMERA-DATE-OBS"));
        assert_eq!(h.logical("FLAG"), Some(true), "the first of two cards counts");
        assert_eq!(h.text("LONG").as_deref(), Some("abcdefghi"));
        assert_eq!(h.number("BIG"), None);
        assert_eq!(h.text("HISTORY").as_deref(), Some("flat = 3"));
        assert_eq!(h.text("NOTHERE"), None);
    }

    #[test]
    fn comments_of_continued_texts_are_joined_in_a_time_that_grows_with_their_length() {
        let more = format!("CONTINUE  'b&' / {}\n", "word ".repeat(12));
        let h = Header::from_text(&format!("LONG    = 'a&' / first\n{}CONTINUE  'c'\n", more.repeat(40_000)));
        // the square of its length took a minute
        assert_eq!(h.text("LONG").map(|t| t.len()), Some(40_002));
        assert!(h.comment("LONG").is_some_and(|c| c.starts_with("first word word") && c.ends_with("word")));
    }
}
