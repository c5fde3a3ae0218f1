//! Connected pixels: runs of rows joined into components, 8-connected.
//!
//! Works on runs, so memory goes with what is found, not with the frame. No pixel values here.

use std::ops::Range;

/// A run of columns in one row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Run {
    pub row: usize,
    pub columns: Range<usize>,
}

/// The runs of a part of a row, from the column `first` on, where `above` is true, appended to `runs`.
pub(crate) fn runs_of_part(row: usize, first: usize, above: impl Iterator<Item = bool>, runs: &mut Vec<Run>) {
    let mut start = None;
    let mut n = first;
    for (i, is_above) in (first..).zip(above) {
        match (is_above, start) {
            (true, None) => start = Some(i),
            (false, Some(s)) => {
                runs.push(Run { row, columns: s..i });
                start = None;
            }
            _ => {}
        }
        n = i + 1;
    }
    if let Some(s) = start {
        runs.push(Run { row, columns: s..n });
    }
}

/// Component number of every run, counted in order of first appearance, and how many components there are.
/// The runs must be in order of row, then column.
pub(crate) fn label(runs: &[Run]) -> (Vec<usize>, usize) {
    let mut parent: Vec<usize> = (0..runs.len()).collect();
    let mut above = 0; // first run of the row above that may still touch
    for (k, run) in runs.iter().enumerate() {
        while above < k && (runs[above].row + 1 < run.row || ends_before(&runs[above], run)) {
            above += 1;
        }
        for (candidate, other) in runs.iter().enumerate().take(k).skip(above) {
            if other.row + 1 != run.row || other.columns.start > run.columns.end {
                break;
            }
            let (a, b) = (root(&mut parent, candidate), root(&mut parent, k));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut number = vec![usize::MAX; runs.len()];
    let mut n = 0;
    let labels = (0..runs.len())
        .map(|k| {
            let r = root(&mut parent, k);
            if number[r] == usize::MAX {
                number[r] = n;
                n += 1;
            }
            number[r]
        })
        .collect();
    (labels, n)
}

/// Whether a run of the row above ends before the diagonal neighbour of `run` begins.
fn ends_before(above: &Run, run: &Run) -> bool {
    above.row + 1 == run.row && above.columns.end < run.columns.start
}

fn root(parent: &mut [usize], mut k: usize) -> usize {
    while parent[k] != k {
        parent[k] = parent[parent[k]];
        k = parent[k];
    }
    k
}
