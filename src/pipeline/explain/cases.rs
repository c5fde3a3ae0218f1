//! Explicit geometries, stated number by number: what was skipped in them, and the time that this saved.
//!
//! CPU seconds from the caller's clock, magnitudes. A few cases of each kind are kept, however long the file is.

use std::collections::BTreeMap;

use super::timing::SCENES;
use super::timing::brighter_mag;
use super::timing::each_us;
use crate::brightness::explicit::{Case, Fluxes, exhaustive, explicit};
use crate::pipeline::explain::text::{Explanation, LeftOut, runs};

/// Explicit geometries by what was skipped in them; a few cases of each kind are kept to be timed.
#[derive(Debug, Default)]
pub struct CasesLeftOut {
    cases: usize,
    kinds: BTreeMap<String, (Vec<usize>, Vec<Case>)>,
    ids: Vec<String>,
}

impl CasesLeftOut {
    /// The next case with its name; `None` for a row that is not a case.
    pub fn add(&mut self, case: Option<(String, Case)>) {
        self.cases += 1;
        let Some((id, case)) = case else {
            self.ids.push(String::new());
            return;
        };
        // what is skipped does not depend on the tolerance
        let skipped = explicit(&case, 0.5).map(|f| f.skipped).unwrap_or_default();
        if !skipped.is_empty() {
            let kind = self.kinds.entry(skipped.join("; ")).or_default();
            kind.0.push(self.ids.len());
            if kind.1.len() < SCENES {
                kind.1.push(case.clone());
            }
        }
        self.ids.push(id);
    }

    /// What was skipped, with the time it takes to compute it all the same.
    #[must_use]
    pub fn explanation(&self, tolerance: f64, cpu_s: &dyn Fn() -> f64) -> Explanation {
        let fluxes = |f: Option<Fluxes>| f.map_or(0.0, |f| f.direct + f.earth);
        let mut items: Vec<LeftOut> = (self.kinds.iter())
            .map(|(why, (at, cases))| {
                let time = |of: fn(&Case, f64) -> Option<Fluxes>| {
                    each_us(cpu_s, cases.len(), |k| {
                        std::hint::black_box(of(&cases[k], tolerance).is_some());
                    })
                };
                let changes = cases.iter().map(|case| {
                    let some = fluxes(explicit(case, tolerance));
                    brighter_mag(some, fluxes(exhaustive(case, tolerance)) - some)
                });
                LeftOut {
                    what: "lights".into(),
                    why: why.clone(),
                    count: at.len(),
                    of: self.cases,
                    scenes: runs(at, &|i| self.ids[i].clone()),
                    timed: cases.len(),
                    each_us: Some((time(exhaustive) - time(explicit)).max(0.0)),
                    changes_mag: Some(changes.fold(0.0, f64::max)),
                }
            })
            .collect();
        items.sort_by_key(|item| std::cmp::Reverse(item.count));
        Explanation { items, ..Explanation::default() }
    }
}
