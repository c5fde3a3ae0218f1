//! Where the outer integral over the Earth has an edge.

/// A span longer than this many scales is graded.
pub(super) const GRADED_FROM: f64 = 2.0;

/// Lobes wider than this are left to the rule.
pub(super) const WIDE: f64 = 0.5;

/// Where spans meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Edge {
    pub zeta: f64,
    /// The ring integral behaves like a root here.
    pub root: bool,
    /// It behaves like a small power or a step.
    pub sharp: bool,
    /// It changes over this length before the edge, and behind it; infinite where nothing special happens.
    pub before: f64,
    pub behind: f64,
}

impl Edge {
    pub fn plain(zeta: f64) -> Self {
        Self { zeta, root: false, sharp: false, before: f64::INFINITY, behind: f64::INFINITY }
    }

    pub(super) fn merge(&mut self, o: &Self) {
        self.root |= o.root;
        self.sharp |= o.sharp;
        self.before = self.before.min(o.before);
        self.behind = self.behind.min(o.behind);
    }
}
