//! `satphot init`: a commented pipeline.toml to start from.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::base::file::write_atomic;
use satphot::brightness::{Catalogue, Satellite};
use satphot::config::Config;

use super::implied::{Implied, implied};
use super::{print, tell};

const EXAMPLES: &str = "\
Examples:
  satphot init                                                  every key with its meaning, to fill in
  satphot init --site-name Paranal --site=-24.627,-70.404,2635 --input raw --night 2025-06-10
  satphot init - | less                                         to read it only
  satphot init raw                                              what the headers of the frames in raw/ imply
  satphot init raw night.toml                                   the same into another file";

/// Writes a commented pipeline.toml: fill in your site, camera and folders.
///
/// Of a folder of frames it reads the headers and writes the configuration that they imply, each value with its keyword;
/// what no header states is left to fill in, and listed.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Init {
    /// File to write, `-` prints it; or a folder of frames, from whose headers the configuration is made
    #[arg(value_name = "FILE|FOLDER", default_value = "pipeline.toml")]
    file: PathBuf,
    /// File to write for a folder of frames
    #[arg(value_name = "FILE")]
    of_folder: Option<PathBuf>,
    /// Latitude, longitude [deg, north and east positive] and height [m] of your site
    #[arg(long, value_name = "LAT,LON,ALT", allow_hyphen_values = true)]
    site: Option<String>,
    /// Its name
    #[arg(long, value_name = "NAME")]
    site_name: Option<String>,
    /// Name of the night
    #[arg(long, value_name = "NAME")]
    night: Option<String>,
    /// Folder of the frames
    #[arg(long, value_name = "DIR")]
    input: Option<String>,
    /// Satellite of the catalogue (`satphot satellites` lists them)
    #[arg(long, value_name = "NAME")]
    satellite: Option<String>,
    /// Overwrite an existing file
    #[arg(long)]
    force: bool,
}

const TEMPLATE: &str = include_str!("../presets/template.toml");

impl Init {
    pub fn execute(self) -> anyhow::Result<()> {
        if self.file.is_dir() {
            return self.write_implied();
        }
        if let Some(file) = &self.of_folder {
            let problem =
                format!("a second file needs a folder of frames before it, and {} is not one", self.file.display());
            return Err(
                Error::Argument { name: "FILE".into(), problem: format!("{}: {problem}", file.display()) }.into()
            );
        }
        let text = self.text()?;
        if self.file.as_os_str() == "-" {
            print(&text);
            return Ok(());
        }
        if self.file.exists() && !self.force {
            return Err(Error::Config {
                key: self.file.display().to_string(),
                problem: "exists already; --force overwrites it".into(),
            }
            .into());
        }
        write_atomic(&self.file, text.as_bytes())?;
        if self.site.is_none() {
            tell(
                "note: site, telescope and camera in it are those of Macquarie University Observatory: put your own in \
                 their place (--site LAT,LON,ALT fills in the site)",
            );
        }
        tell(&format!("wrote {}; edit it, then run `satphot run {}`", self.file.display(), self.file.display()));
        Ok(())
    }

    /// Writes what the headers of a folder imply, and says what is missing.
    fn write_implied(self) -> anyhow::Result<()> {
        let file = self.of_folder.clone().unwrap_or_else(|| "pipeline.toml".into());
        let to_stdout = file.as_os_str() == "-";
        let options = [("--site", &self.site), ("--site-name", &self.site_name), ("--night", &self.night)];
        let options = options.into_iter().chain([("--input", &self.input), ("--satellite", &self.satellite)]);
        if let Some((name, _)) = options.into_iter().find(|(_, value)| value.is_some()) {
            let problem = "has no effect where a folder of frames is read; write it into the file".into();
            return Err(Error::Argument { name: name.into(), problem }.into());
        }
        if !to_stdout && file.exists() && !self.force {
            let problem = "exists already; --force overwrites it, or name another file behind the folder".into();
            return Err(Error::Config { key: file.display().to_string(), problem }.into());
        }
        // paths of a configuration are relative to its folder
        let parent = file.parent().filter(|p| !p.as_os_str().is_empty());
        let input = match parent {
            None => self.file.clone(),
            Some(folder) if folder == self.file => ".".into(),
            Some(_) => std::fs::canonicalize(&self.file).unwrap_or_else(|_| self.file.clone()),
        };
        let shown = if to_stdout { "pipeline.toml".into() } else { file.display().to_string() };
        let Implied { text, missing, n_frames } = implied(&self.file, &input.to_string_lossy(), &shown)?;
        if to_stdout {
            print(&text);
        } else {
            write_atomic(&file, text.as_bytes())?;
            tell(&format!("wrote {shown} from the headers of {n_frames} frames"));
        }
        missing.iter().for_each(|what| tell(&format!("missing: {what}")));
        tell(&format!("next: `satphot run {shown} --dry-run`"));
        Ok(())
    }

    /// The template with what was said filled in; it is a configuration, or the option is refused.
    fn text(&self) -> anyhow::Result<String> {
        let mut text = TEMPLATE.to_owned();
        let quoted = |t: &str| toml::Value::String(t.to_owned()).to_string();
        if let Some(site) = &self.site {
            let number = |n: &str| n.trim().parse().ok().filter(|v: &f64| v.is_finite());
            let numbers: Vec<f64> = site.split(',').map_while(number).collect();
            let [lat, lon, alt] = numbers[..] else {
                let problem = format!(
                    "\"{site}\" must be latitude,longitude,altitude [deg, deg, m], such as -33.7703,151.1113,70"
                );
                return Err(Error::Argument { name: "--site".into(), problem }.into());
            };
            for (key, value) in [("lat_deg", lat), ("lon_deg", lon), ("alt_m", alt)] {
                set(&mut text, "[site]", key, &format!("{value:?}"));
            }
        }
        for (option, section, key) in [(&self.site_name, "[site]", "name"), (&self.night, "[night]", "name")] {
            if let Some(value) = option {
                set(&mut text, section, key, &quoted(value));
            }
        }
        if let Some(name) = &self.satellite {
            let catalogue = Catalogue::load(None)?;
            let entry = catalogue.find(name).map_err(|error| named("--satellite", error))?;
            set(&mut text, "[model]", "satellite", &quoted(&entry.name));
        }
        if let Some(input) = &self.input {
            set(&mut text, "[night]", "input", &format!("[{}]", quoted(input)));
        }
        let config = Config::from_text(&text, &[])?;
        config.model.as_ref().map(Satellite::from_config).transpose()?;
        Ok(text)
    }
}

/// An error of the configuration, by the option that gave the value.
fn named(option: &str, error: Error) -> Error {
    match error {
        Error::Config { problem, .. } => Error::Argument { name: option.into(), problem },
        other => other,
    }
}

/// Puts another value behind a key of a section of the template; the comment of the line stays.
fn set(text: &mut String, section: &str, key: &str, value: &str) {
    let mut within = false;
    let lines = text.lines().map(|line| {
        if line.starts_with('[') {
            within = line.starts_with(section);
        }
        match line.split_once(" = ") {
            Some((k, rest)) if within && k == key => {
                let comment = rest.find(" #").map(|at| &rest[at..]).unwrap_or_default();
                format!("{key} = {value}{}{}", if comment.is_empty() { "" } else { "  " }, comment.trim_start())
            }
            _ => line.to_owned(),
        }
    });
    *text = lines.collect::<Vec<_>>().join("\n") + "\n";
}
