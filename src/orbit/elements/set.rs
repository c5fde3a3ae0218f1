//! One set of orbital elements, a file of them, and what is damaged in it.

use hifitime::Epoch;

/// One set of mean elements (TLE, 3LE or OMM) for SGP4.
#[derive(Debug, Clone)]
pub struct Elements {
    pub(crate) inner: sgp4::Elements,
    pub(super) name: String,
    pub(super) object_id: String,
    pub(super) epoch: Epoch,
    pub(super) format: &'static str,
}

/// A set of a file that cannot be read, and what is known of whose it is.
#[derive(Debug, Clone, PartialEq)]
pub struct DamagedSet {
    /// 1-based line, where known.
    pub line: Option<usize>,
    /// What is wrong, as a sentence.
    pub problem: String,
    /// Catalogue numbers that stand in it; none if none can be read.
    pub numbers: Vec<u64>,
    /// The name above it; empty without one.
    pub name: String,
}

impl DamagedSet {
    /// It may be a set of the object of this number and these names.
    pub(super) fn may_be_of(&self, number: u64, names: &[String]) -> bool {
        if self.numbers.contains(&number) {
            return true;
        }
        // an altered number does not hide the name
        let is_named = names.iter().any(|n| n.eq_ignore_ascii_case(self.name.trim()));
        is_named || (self.numbers.is_empty() && self.name.is_empty())
    }
}

/// Damaged sets of other objects that are named one by one.
pub(super) const MOST_WARNINGS: usize = 3;

/// What a file of elements holds: the sets that can be read, and those that cannot.
#[derive(Debug, Clone, Default)]
pub struct ElementsFile {
    /// The sets, in order of the file.
    pub sets: Vec<Elements>,
    /// What is damaged.
    pub damaged: Vec<DamagedSet>,
}

/// Where (1-based line, where known) and what is wrong.
pub(crate) type Problem = (Option<usize>, String);
