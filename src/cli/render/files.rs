//! Which files `-o` names, known before anything is computed: by their ending, or a folder for everything.

use std::path::{Path, PathBuf};

use clap::Args;
use satphot::Error;

use super::bad;

/// Where pictures go.
#[derive(Debug, Clone, Args)]
pub struct PictureOut {
    /// Folder for everything, or a file: .fits the picture, .png the preview, .ecsv the table (repeatable); with --sensor a
    /// file is of the frame: .fits its raw counts, .png a preview of them, .ecsv signal over noise
    #[arg(short, long, value_name = "DIR|FILE")]
    out: Vec<PathBuf>,
    /// Also a PNG with one panel for each light
    #[arg(long, value_name = "FILE.png", conflicts_with = "pass")]
    lights_png: Option<PathBuf>,
}

/// Files of one picture by their kind.
#[derive(Debug, Default)]
pub struct Kinds {
    pub fits: Vec<PathBuf>,
    pub png: Vec<PathBuf>,
    pub ecsv: Vec<PathBuf>,
}

/// All files of a call.
#[derive(Debug, Default)]
pub struct Files {
    /// Of the radiances.
    pub picture: Kinds,
    /// Of the frame of a sensor.
    pub frame: Kinds,
    /// One panel for each light.
    pub lights_png: Option<PathBuf>,
    pub folders: Vec<PathBuf>,
}

impl PictureOut {
    /// The files to write, names in folders beginning with `stem`. Nothing is made yet.
    pub fn files(&self, stem: &str, with_sensor: bool) -> anyhow::Result<Files> {
        let mut files = Files { lights_png: self.lights_png.clone(), ..Files::default() };
        if let Some(other) = self.lights_png.iter().find(|p| ending(p) != "png") {
            return Err(bad("--lights-png", format!("{} does not end in .png", other.display())));
        }
        for out in &self.out {
            let name = out.to_string_lossy();
            let ending = ending(out);
            if out.is_dir() || name.ends_with(std::path::is_separator) || (ending.is_empty() && !out.exists()) {
                files.picture.add(out, stem);
                if with_sensor {
                    files.frame.add(out, &format!("{stem}_sensor"));
                }
                files.folders.push(out.clone());
                continue;
            }
            let kinds = if with_sensor { &mut files.frame } else { &mut files.picture };
            match ending.as_str() {
                "fits" | "fit" | "fts" => kinds.fits.push(out.clone()),
                "fz" if with_sensor => kinds.fits.push(out.clone()),
                "png" => kinds.png.push(out.clone()),
                "ecsv" => kinds.ecsv.push(out.clone()),
                _ => {
                    let problem = format!(
                        "{name} is neither .fits, .png, .ecsv nor a folder (a new one whose name has a dot ends in /); \
                         --csv prints CSV"
                    );
                    return Err(bad("--out", problem));
                }
            }
        }
        Ok(files)
    }
}

impl Kinds {
    fn add(&mut self, folder: &Path, stem: &str) {
        self.fits.push(folder.join(format!("{stem}.fits")));
        self.png.push(folder.join(format!("{stem}.png")));
        self.ecsv.push(folder.join(format!("{stem}.ecsv")));
    }

    fn all(&self) -> impl Iterator<Item = &PathBuf> {
        self.fits.iter().chain(&self.png).chain(&self.ecsv)
    }
}

impl Files {
    /// Makes the folders the files go to.
    pub fn make_folders(&self) -> anyhow::Result<()> {
        for file in self.picture.all().chain(self.frame.all()).chain(&self.lights_png) {
            if let Some(folder) = file.parent().filter(|p| !p.as_os_str().is_empty()) {
                std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
            }
        }
        Ok(())
    }
}

fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}
