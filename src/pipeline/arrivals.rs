//! Frames as they arrive in the folders of a night: which files are complete, and which are still being written.
//!
//! A file is complete when its size did not change between two looks and its header promises no more than it holds. Programs
//! write frames under their final names, pixels first or header first, so neither the name nor an event shows that a file is complete.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::base::error::{Error, Result};
use crate::config::Config;
use crate::fits::{Header, find_files};
use crate::pipeline::survey::files::own_results;

/// A file that is not complete, and has not changed for this long, never will be: it is taken as it is, which makes it a row
/// with a reason.
const ABANDONED: Duration = Duration::from_secs(60);

/// One file, as it was at the last scan.
#[derive(Debug, Clone)]
struct Seen {
    bytes: u64,
    /// When its size was first this one, on the caller's clock.
    since: Duration,
    complete: bool,
}

/// The files of a night that is still going on.
#[derive(Debug, Default)]
pub struct Arrivals {
    files: BTreeMap<PathBuf, Seen>,
}

impl Arrivals {
    /// Scans the folders of the night at the time `now` of any clock that goes on; returns how many files became complete, or
    /// complete files that changed or vanished. Results of satphot inside the folders are not files of the night.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::NoInput`] for a folder that is not there; one without frames is no error.
    pub fn scan(&mut self, config: &Config, now: Duration) -> Result<usize> {
        let inputs = &config.night.input;
        let found = match find_files(inputs) {
            Ok(found) => found,
            Err(Error::NoInput { .. }) if inputs.iter().all(|input| input.exists()) => Vec::new(),
            Err(error) => return Err(error),
        };
        let own = own_results(config, inputs);
        let is_own =
            |path: &Path| own.as_ref().is_some_and(|own| path.canonicalize().is_ok_and(|p| p.starts_with(own)));
        let mut files = BTreeMap::new();
        let mut news = 0;
        for path in found.into_iter().filter(|path| !is_own(path)) {
            let Ok(meta) = std::fs::metadata(&path) else { continue };
            let seen = match self.files.get(&path) {
                Some(before) if before.bytes == meta.len() => {
                    let waited = now.saturating_sub(before.since);
                    let complete = before.complete || is_whole(&path) || waited >= ABANDONED;
                    Seen { complete, ..before.clone() }
                }
                before => {
                    news += usize::from(before.is_some_and(|before| before.complete));
                    Seen { bytes: meta.len(), since: now, complete: false }
                }
            };
            news += usize::from(seen.complete && !self.files.get(&path).is_some_and(|before| before.complete));
            files.insert(path, seen);
        }
        news += self.files.iter().filter(|(path, seen)| seen.complete && !files.contains_key(*path)).count();
        self.files = files;
        Ok(news)
    }

    /// The complete files, sorted.
    #[must_use]
    pub fn complete(&self) -> Vec<PathBuf> {
        self.files.iter().filter(|(_, seen)| seen.complete).map(|(path, _)| path.clone()).collect()
    }

    /// Number of files that are still being written.
    #[must_use]
    pub fn n_awaited(&self) -> usize {
        self.files.values().filter(|seen| !seen.complete).count()
    }
}

/// Whether the file holds all that its headers promise.
fn is_whole(path: &Path) -> bool {
    Header::read(path).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(folder: &Path) -> Config {
        let text = "[night]\ninput = [\"FOLDER\"]\noutput = \"FOLDER/out\"\nname = \"n\"\n\
                    [site]\nname = \"s\"\nlat_deg = 0.0\nlon_deg = 0.0\nalt_m = 0.0\n\
                    [telescope]\nname = \"t\"\naperture_m = 0.5\nfocal_length_mm = 1000.0\n\
                    [detector]\ncamera = \"c\"\npixel_um = 4.0\npedestal_adu = 100.0\nuse_header_egain = true\n\
                    [detector.read_noise_e]\n0 = 2.0\n";
        Config::from_text(&text.replace("FOLDER", &folder.display().to_string()), &[]).unwrap()
    }

    fn seconds(s: f64) -> Duration {
        Duration::from_secs_f64(s)
    }

    #[test]
    fn a_file_is_complete_when_it_stands_still_and_holds_what_it_promises() {
        let folder = tempfile::tempdir().unwrap();
        let (path, config) = (folder.path().join("a.fits"), config(folder.path()));
        let mut arrivals = Arrivals::default();
        assert_eq!(arrivals.scan(&config, seconds(0.0)).unwrap(), 0);
        let pixels = ndarray::Array2::<u16>::zeros((100, 100));
        let whole = folder.path().join("whole.tmp");
        crate::fits::write_u16(&whole, &pixels, &[], false).unwrap();
        let bytes = std::fs::read(&whole).unwrap();
        // it grows: nothing; it stands still but is cut: nothing
        for (k, share) in [0.2, 0.5, 0.5].into_iter().enumerate() {
            std::fs::write(&path, &bytes[..(share * bytes.len() as f64) as usize]).unwrap();
            assert_eq!(arrivals.scan(&config, seconds(1.0 + k as f64)).unwrap(), 0);
            assert_eq!((arrivals.complete().len(), arrivals.n_awaited()), (0, 1));
        }
        std::fs::write(&path, &bytes).unwrap();
        assert_eq!(arrivals.scan(&config, seconds(5.0)).unwrap(), 0, "one scan more");
        assert_eq!(arrivals.scan(&config, seconds(5.3)).unwrap(), 1);
        assert_eq!(arrivals.complete(), std::slice::from_ref(&path));
        assert_eq!(arrivals.scan(&config, seconds(6.0)).unwrap(), 0, "nothing new");
        // it is written again: it is awaited again; it vanishes: that is news
        std::fs::write(&path, &bytes[..1000]).unwrap();
        assert_eq!(arrivals.scan(&config, seconds(7.0)).unwrap(), 1);
        assert_eq!(arrivals.n_awaited(), 1);
        // a file that nobody finishes is taken as it is in the end
        assert_eq!(arrivals.scan(&config, seconds(30.0)).unwrap(), 0);
        assert_eq!(arrivals.scan(&config, seconds(67.5)).unwrap(), 1);
        std::fs::remove_file(&path).unwrap();
        assert_eq!(arrivals.scan(&config, seconds(70.0)).unwrap(), 1);
        assert!(arrivals.complete().is_empty());
    }
}
