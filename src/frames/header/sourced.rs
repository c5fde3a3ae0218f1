//! A value and the header card it is from.

/// A value and where it is from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sourced<T> {
    /// The value.
    pub value: T,
    /// The keyword, and what was done to it.
    pub source: String,
}

impl<T> Sourced<T> {
    /// A value from a keyword.
    pub fn new(value: T, source: impl Into<String>) -> Self {
        Self { value, source: source.into() }
    }
}
