//! `satphot zeropoint`: star pointings, or a table of star measurements, to a zeropoint.toml.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::night::pipeline::Options;
use satphot::night::stage::{fit_stars, zeropoint_from_table};

use super::{Common, print, tell};

/// Fits V = V_inst - ZP - k X - C (B-V) to the star pointings of a night, to named star frames, or to a stars.ecsv.
#[derive(Debug, Args)]
pub struct ZeropointVerb {
    /// Star frames; the night's own if none are named
    files: Vec<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// Fit this stars.ecsv again instead of measuring frames
    #[arg(long, value_name = "ECSV", conflicts_with = "files")]
    stars: Option<PathBuf>,
    /// Master flat to divide by; made from the night's flats if absent
    #[arg(long, value_name = "FITS")]
    flat: Option<PathBuf>,
    /// Zeropoint to write; new star measurements go to stars.ecsv beside it
    #[arg(short, long, value_name = "FILE", default_value = "zeropoint.toml")]
    out: PathBuf,
}

impl ZeropointVerb {
    pub fn execute(self) -> anyhow::Result<()> {
        let mut config = self.common.load()?;
        config.zeropoint.previous = None;
        if self.flat.is_some() {
            config.flat.master = self.flat;
        }
        let progress = self.common.progress();
        let fitted = match &self.stars {
            Some(table) => zeropoint_from_table(&config, table)?,
            None => {
                let options = Options { jobs: self.common.jobs, files: self.files, ..Options::default() };
                fit_stars(&config, &options, &progress)?
            }
        };
        let stars = self.out.with_file_name("stars.ecsv");
        fitted.write(&config, &self.out, self.stars.is_none().then_some(stars.as_path()))?;
        for note in fitted.notes.iter().filter(|_| !self.common.quiet) {
            tell(&format!("note: {note}"));
        }
        print(&fitted.text());
        print(&format!("{}\n", self.out.display()));
        match fitted.zeropoint {
            Ok(_) => Ok(()),
            Err(problem) => Err(Error::PoorNight { problem }.into()),
        }
    }
}
