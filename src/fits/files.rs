//! The FITS files of folders, by their names.

use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};

/// FITS files of folders (recursively) and single files: `.fit`, `.fits`, `.fts` and these with `.fz`, `.gz` or `.bz2`, any
/// case.
///
/// Sorted, without hidden files and duplicates.
///
/// # Errors
/// [`Error::Io`]; [`Error::NoInput`] naming the first folder if nothing is found.
pub fn find_files(inputs: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    let mut folders: Vec<PathBuf> = Vec::new();
    for input in inputs {
        let meta = std::fs::metadata(input).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => {
                let problem = "no such file or folder (night.input, or the command line)".to_owned();
                Error::NoInput { path: input.clone(), problem }
            }
            _ => Error::io(input, e),
        })?;
        if meta.is_dir() {
            folders.push(input.clone());
        } else {
            files.push(input.clone());
        }
    }
    while let Some(folder) = folders.pop() {
        let entries = std::fs::canonicalize(&folder).and_then(|real| Ok((real, std::fs::read_dir(&folder)?)));
        let (real, entries) = match entries {
            Ok(found) => found,
            // a folder within the night that cannot be read becomes a file that cannot, with its reason
            Err(_) if !inputs.contains(&folder) => {
                files.push(folder);
                continue;
            }
            Err(error) => return Err(Error::io(&folder, error)),
        };
        if !seen.insert(real) {
            continue; // a link that leads back
        }
        for entry in entries {
            let path = entry.map_err(|e| Error::io(&folder, e))?.path();
            let hidden = path.file_name().is_none_or(|n| n.to_string_lossy().starts_with('.'));
            if hidden {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else if is_fits_name(&path) {
                files.push(path);
            }
        }
    }
    files.sort();
    let mut unique = std::collections::BTreeSet::new();
    files.retain(|f| unique.insert(std::fs::canonicalize(f).unwrap_or_else(|_| f.clone())));
    if files.is_empty() {
        let path = inputs.first().cloned().unwrap_or_default();
        let problem = "no FITS file here (*.fit, *.fits, *.fts, also with .fz, .gz or .bz2); check night.input".into();
        return Err(Error::NoInput { path, problem });
    }
    Ok(files)
}

fn is_fits_name(path: &Path) -> bool {
    let name = path.file_name().map(|n| n.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let packed = [".fz", ".gz", ".bz2"].iter().find_map(|e| name.strip_suffix(e));
    let name = packed.unwrap_or(&name);
    [".fit", ".fits", ".fts"].iter().any(|e| name.ends_with(e))
}
