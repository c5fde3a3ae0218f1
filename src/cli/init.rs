//! `satphot init`: a commented pipeline.toml to start from.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;

use super::{print, tell};

/// Writes a commented pipeline.toml: fill in your site, camera and folders.
#[derive(Debug, Args)]
pub struct Init {
    /// File to write; `-` prints it
    #[arg(value_name = "FILE", default_value = "pipeline.toml")]
    file: PathBuf,
    /// Overwrite an existing file
    #[arg(long)]
    force: bool,
}

const TEMPLATE: &str = include_str!("../presets/template.toml");

impl Init {
    pub fn execute(self) -> anyhow::Result<()> {
        if self.file.as_os_str() == "-" {
            print(TEMPLATE);
            return Ok(());
        }
        if self.file.exists() && !self.force {
            return Err(Error::Config {
                key: self.file.display().to_string(),
                problem: "exists already; --force overwrites it".into(),
            }
            .into());
        }
        std::fs::write(&self.file, TEMPLATE).map_err(|e| Error::io(&self.file, e))?;
        tell(&format!("wrote {}; edit it, then `satphot run {}`", self.file.display(), self.file.display()));
        Ok(())
    }
}
