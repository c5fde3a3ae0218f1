//! What a page adds to the points of frames: links and words. A file has neither.

use crate::tables::PhotometryRow;

/// Where the point of a frame leads, and what it says when the pointer rests on it.
pub(crate) struct Interaction<'a> {
    pub link: &'a dyn Fn(&PhotometryRow) -> Option<String>,
    pub tip: &'a dyn Fn(&PhotometryRow) -> String,
}

impl Interaction<'_> {
    /// Nothing: a file stands alone.
    pub(crate) const NONE: Self = Interaction { link: &|_| None, tip: &|_| String::new() };
}
