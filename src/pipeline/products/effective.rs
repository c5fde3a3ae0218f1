//! effective.toml: the configuration in force, with paths that lead from its own folder to the files.
//!
//! So the results can be reported and made again from anywhere, and no folder of this machine is in them as long as frames
//! and results lie in one tree. It does not cover the settings of a single run (threads, memory).

use std::path::{Component, Path, PathBuf};

use crate::base::error::Result;
use crate::config::Config;

/// The configuration as TOML for a file in `folder`, the folder of the night's results.
///
/// # Errors
/// [`crate::Error::Config`] if it cannot be written as TOML.
pub fn effective_toml(config: &Config, folder: &Path) -> Result<String> {
    let mut config = config.clone();
    config.each_path(&|path| {
        // a text cannot hold a way through folders whose names are none; the path as it was configured is one
        let way = relative_to(folder, path);
        if way.to_str().is_some() {
            *path = way;
        }
    });
    // <output>/<name>/effective.toml
    config.night.output = PathBuf::from("..");
    config.to_toml()
}

/// The way from `folder` to `path`, links resolved where both are there; `path` as it is where there is none (another
/// drive).
#[must_use]
pub fn relative_to(folder: &Path, path: &Path) -> PathBuf {
    let whole = |p: &Path| std::fs::canonicalize(p).or_else(|_| std::path::absolute(p)).ok();
    let (Some(from), Some(to)) = (whole(folder), whole(path)) else { return path.to_path_buf() };
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return path.to_path_buf();
    }
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    let way: PathBuf = up.chain(to.components().skip(shared)).collect();
    if way.as_os_str().is_empty() { PathBuf::from(".") } else { way }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_leads_back_to_the_file() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("out/night");
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(root.path().join("stars.csv"), "").unwrap();
        let way = relative_to(&folder, &root.path().join("out/../stars.csv"));
        assert_eq!(way, Path::new("../../stars.csv"));
        assert!(folder.join(way).is_file());
        assert_eq!(relative_to(&folder, &folder), Path::new("."));
        assert_eq!(relative_to(&folder, &folder.join("absent")), Path::new("absent"));
    }

    #[test]
    fn the_file_has_no_folder_of_the_machine_and_reads_back_to_the_same_night() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("out/n");
        std::fs::create_dir_all(&folder).unwrap();
        let text = format!(
            "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [{0:?}]\noutput = {1:?}\n[orbit]\nelements = {2:?}\n",
            root.path().display().to_string(),
            root.path().join("out").display().to_string(),
            root.path().join("iss.tle").display().to_string(),
        );
        let config = Config::from_text(&text, &[]).unwrap();
        let saved = effective_toml(&config, &folder).unwrap();
        assert!(!saved.contains(&root.path().display().to_string()), "{saved}");
        let path = folder.join("effective.toml");
        std::fs::write(&path, &saved).unwrap();
        let again = Config::load(&path, &[]).unwrap();
        let real = |p: &Path| std::fs::canonicalize(p).unwrap();
        assert_eq!(real(&again.night.input[0]), real(root.path()));
        assert_eq!(real(&again.night.output.join(&again.night.name)), real(&folder));
        assert_eq!(effective_toml(&again, &folder).unwrap(), saved);
    }
}
