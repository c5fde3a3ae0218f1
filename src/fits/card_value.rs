//! The value of a header card that is written.

/// The value of a card to be written. A `Text` under the keyword HISTORY or COMMENT becomes such lines.
#[derive(Debug, Clone, PartialEq)]
pub enum CardValue {
    /// A string, of any length.
    Text(String),
    /// A whole number.
    Integer(i64),
    /// A finite real number, written so that it reads back exactly.
    Real(f64),
    /// T or F.
    Logical(bool),
}
