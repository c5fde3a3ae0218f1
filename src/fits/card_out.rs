//! Header cards of 80 characters, long strings by CONTINUE, and the checksum of an HDU.
//!
//! Texts are escaped to printable ASCII as in JSON (`\u00e9`, `\\`), because FITS holds nothing else. Source: FITS
//! Standard 4.0, sections 4.2 (cards), 4.4.2.7 and appendix J (CHECKSUM).

use std::fmt::Write as _;

/// Bytes of a FITS block.
pub const BLOCK: usize = 2880;
/// Characters of a card.
const CARD: usize = 80;

/// Text as printable ASCII: what is not, and the backslash, as JSON escapes.
#[must_use]
pub fn ascii(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\\' => out.push_str("\\\\"),
            ' '..='~' => out.push(c),
            c => {
                for unit in c.encode_utf16(&mut [0; 2]) {
                    // Writing to a String cannot fail.
                    let _ = write!(out, "\\u{unit:04x}");
                }
            }
        }
    }
    out
}

/// A header under construction.
#[derive(Debug, Clone, Default)]
pub struct Cards(String);

impl Cards {
    /// A card whose value is written as it is, right-aligned: numbers and logicals.
    pub fn value(&mut self, key: &str, value: &str, comment: &str) -> &mut Self {
        self.line(&format!("{key:<8}= {value:>20} / {comment}"))
    }

    /// A text of any length, continued over as many cards as it takes.
    pub fn text(&mut self, key: &str, value: &str, comment: &str) -> &mut Self {
        let quoted = ascii(value).replace('\'', "''");
        let one = format!("{key:<8}= {:<20} / {comment}", format!("'{quoted:<8}'"));
        if one.len() <= CARD {
            return self.line(&one);
        }
        // 67 characters and an ampersand between the quotes; never between the two halves of a doubled quote
        let mut rest = quoted.as_str();
        let mut start = format!("{key:<8}= ");
        while rest.len() > 68 {
            let quotes = rest[..67].chars().rev().take_while(|c| *c == '\'').count();
            let (piece, next) = rest.split_at(67 - quotes % 2);
            self.line(&format!("{start}'{piece}&'"));
            (rest, start) = (next, "CONTINUE  ".into());
        }
        self.line(&format!("{start}'{rest}'"))
    }

    /// A line of commentary.
    pub fn comment(&mut self, text: &str) -> &mut Self {
        self.line(&format!("COMMENT {}", ascii(text)))
    }

    fn line(&mut self, card: &str) -> &mut Self {
        // cards are ASCII by construction; only a comment can be too long
        let cut = card.len().min(CARD);
        let _ = write!(self.0, "{:<CARD$}", card.get(..cut).unwrap_or_default());
        self
    }

    /// The finished header, whole blocks, with DATASUM and a CHECKSUM that makes the sum of the HDU vanish.
    #[must_use]
    pub fn finished(mut self, datasum: u32) -> Vec<u8> {
        self.text("DATASUM", &datasum.to_string(), "sum of the data as 32-bit words");
        let at = self.0.len() + 11;
        self.text("CHECKSUM", "0000000000000000", "makes the sum of the HDU -0");
        self.line("END");
        let mut bytes = self.0.into_bytes();
        bytes.resize(bytes.len().div_ceil(BLOCK) * BLOCK, b' ');
        let mut sum = Sum::default();
        sum.add(&bytes);
        let total = folded(u64::from(sum.total()) + u64::from(datasum));
        bytes[at..at + 16].copy_from_slice(&encoded(!total));
        bytes
    }
}

/// The ones'-complement sum of the 32-bit words of a stream of bytes that comes in pieces of any length.
#[derive(Debug, Clone, Default)]
pub struct Sum {
    total: u64,
    place: usize,
}

impl Sum {
    /// Adds bytes.
    pub fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.total += u64::from(*byte) << (24 - 8 * self.place);
            self.place = (self.place + 1) % 4;
        }
        self.total = u64::from(folded(self.total));
    }

    /// The sum so far.
    #[must_use]
    pub fn total(&self) -> u32 {
        folded(self.total)
    }
}

/// Carries added back in until none is left.
fn folded(mut sum: u64) -> u32 {
    while sum >> 32 != 0 {
        sum = (sum & 0xffff_ffff) + (sum >> 32);
    }
    sum as u32
}

/// A sum as 16 letters and digits (appendix J): four characters for each byte, that add up to it above `0` each.
fn encoded(sum: u32) -> [u8; 16] {
    let punctuation = |c: u8| (0x3a..=0x40).contains(&c) || (0x5b..=0x60).contains(&c);
    let mut text = [0u8; 16];
    for (i, byte) in sum.to_be_bytes().into_iter().enumerate() {
        let mut four = [byte / 4 + b'0'; 4];
        four[0] += byte % 4;
        while four.iter().any(|c| punctuation(*c)) {
            for pair in four.chunks_exact_mut(2) {
                if pair.iter().any(|c| punctuation(*c)) {
                    pair[0] += 1;
                    pair[1] -= 1;
                }
            }
        }
        for (j, c) in four.into_iter().enumerate() {
            // the text begins at the last byte of a word of its card: turned by one place
            text[(4 * j + i + 1) % 16] = c;
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_of_a_finished_header_and_its_data_is_minus_zero() {
        for datasum in [0, 1, 868_229_149, u32::MAX - 1] {
            let mut cards = Cards::default();
            cards.value("SIMPLE", "T", "").text("NOTE", &"it's é ".repeat(40), "long");
            let mut sum = Sum::default();
            sum.add(&cards.finished(datasum));
            assert_eq!(folded(u64::from(sum.total()) + u64::from(datasum)), u32::MAX, "{datasum}");
        }
    }

    #[test]
    fn a_checksum_is_letters_and_digits() {
        // the standard's own example (appendix J.3): a sum of 868229149 is balanced by hcHjjc9ghcEghc9g
        assert_eq!(&encoded(!868_229_149), b"hcHjjc9ghcEghc9g");
        for sum in (0..u32::MAX).step_by(99_999_989) {
            assert!(encoded(sum).iter().all(u8::is_ascii_alphanumeric), "{sum}");
        }
    }

    #[test]
    fn a_long_text_is_never_cut_between_two_quotes() {
        let mut cards = Cards::default();
        cards.text("NOTE", &format!("{}{}", "x".repeat(66), "'".repeat(80)), "");
        let cards = cards.0;
        for card in cards.as_bytes().chunks(80) {
            let quotes = card.iter().filter(|c| **c == b'\'').count();
            assert_eq!(quotes % 2, 0, "{}", String::from_utf8_lossy(card));
        }
    }
}
