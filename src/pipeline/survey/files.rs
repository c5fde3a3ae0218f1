//! What each file of the night is: flats, star pointings, target frames, and those that cannot be read.

use std::path::PathBuf;

use crate::bands::Light;
use crate::base::error::Error;
use crate::base::time::seconds_between;
use crate::config::Config;
use crate::frames::{Exposure, Role};

/// A file that could not be read: it becomes a row with its reason.
#[derive(Debug)]
pub struct Unreadable {
    /// The file.
    pub path: PathBuf,
    /// Why.
    pub error: Error,
}

/// A frame that can be read but does not belong to the night's others: it becomes a row with its reason.
#[derive(Debug, Clone)]
pub struct SetAside {
    /// The file.
    pub path: PathBuf,
    /// What it would have been.
    pub role: Role,
    /// Why it is set aside, and what would take it in.
    pub reason: String,
}

/// The night's files by role, each list in the order of time and name.
#[derive(Debug, Default)]
pub struct Survey {
    /// Flats.
    pub flats: Vec<Exposure>,
    /// Star pointings, each the frames of one field.
    pub pointings: Vec<Vec<Exposure>>,
    /// Target frames.
    pub targets: Vec<Exposure>,
    /// Bias, dark and ignored frames, and those of other satellites and filters.
    pub others: Vec<Exposure>,
    /// Files that could not be read.
    pub unreadable: Vec<Unreadable>,
    /// Frames that do not belong to the others.
    pub set_aside: Vec<SetAside>,
    /// Those of them whose headers state another site.
    pub other_site: Vec<PathBuf>,
    /// The filter that is reduced, once it is chosen ([`crate::pipeline::survey::filters`]).
    pub light: Option<Light>,
}

impl Survey {
    /// Number of files.
    #[must_use]
    pub fn len(&self) -> usize {
        let measured = self.flats.len() + self.n_star_frames() + self.targets.len();
        measured + self.others.len() + self.unreadable.len() + self.set_aside.len()
    }

    /// Whether there is no file at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of frames that were set aside as this role.
    #[must_use]
    pub fn n_aside(&self, role: Role) -> usize {
        self.others.iter().filter(|e| e.role == role).count()
    }

    /// Number of star frames.
    #[must_use]
    pub fn n_star_frames(&self) -> usize {
        self.pointings.iter().map(Vec::len).sum()
    }

    /// Puts star frames, in the order of time, into pointings.
    pub(crate) fn group_stars(&mut self, stars: Vec<Exposure>, config: &Config) {
        let gap_s = config.stars.as_ref().map_or(300.0, |s| s.pointing_gap_s);
        self.pointings = group(stars, gap_s);
    }
}

/// The folder whose files are results: night.output, or the night's own part of it where that holds the inputs too.
pub(crate) fn own_results(config: &Config, inputs: &[PathBuf]) -> Option<PathBuf> {
    let output = std::fs::canonicalize(&config.night.output).ok()?;
    let holds = |input: &PathBuf| std::fs::canonicalize(input).is_ok_and(|path| path.starts_with(&output));
    Some(if inputs.iter().any(holds) { output.join(&config.night.name) } else { output })
}

pub(crate) fn by_time(exposures: &mut [Exposure]) {
    exposures.sort_by(|a, b| {
        let time = |e: &Exposure| e.time.as_ref().map(|t| t.mid);
        time(a).cmp(&time(b)).then_with(|| a.path.cmp(&b.path))
    });
}

/// A pointing ends where OBJECT changes or the next frame comes later than `gap_s`.
///
/// A frame of another size is a pointing by itself and does not divide the one it lies in.
fn group(stars: Vec<Exposure>, gap_s: f64) -> Vec<Vec<Exposure>> {
    let mut pointings: Vec<Vec<Exposure>> = Vec::new();
    for exposure in stars {
        let field = |p: &&mut Vec<Exposure>| p.last().is_some_and(|last| last.object == exposure.object);
        let sized = |p: &&mut Vec<Exposure>| p.last().is_some_and(|last| last.size_px == exposure.size_px);
        let open = pointings.iter_mut().rev().take_while(field).find(sized);
        let joins = open.as_ref().and_then(|p| p.last()).is_some_and(|last| match (&last.time, &exposure.time) {
            (Some(a), Some(b)) => seconds_between(a.mid, b.mid) - 0.5 * (last.exptime_s + exposure.exptime_s) <= gap_s,
            _ => false,
        });
        match open {
            Some(pointing) if joins => pointing.push(exposure),
            _ => pointings.push(vec![exposure]),
        }
    }
    pointings
}
