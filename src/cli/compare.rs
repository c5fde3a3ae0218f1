//! `satphot compare`: a photometry table against the model.

use std::path::PathBuf;

use clap::Args;
use satphot::brightness::Satellite;
use satphot::pipeline::single_stages::compare_table;

use super::{Common, print, tell};

const EXAMPLES: &str = "\
Examples:
  satphot compare satphot-out/2025-06-09/photometry.ecsv
  satphot compare photometry.ecsv --set model.mode=as_published -o residuals_as_published.ecsv";

/// Predicts the magnitude of every row of a photometry table and writes the residuals, observed minus modelled.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Compare {
    /// photometry.ecsv of `run` or `measure`
    #[arg(value_name = "ECSV")]
    photometry: PathBuf,
    #[command(flatten)]
    common: Common,
    /// Table of residuals to write
    #[arg(short, long, value_name = "FILE", default_value = "residuals.ecsv")]
    out: PathBuf,
    /// Also write the photometry table with its model columns filled
    #[arg(long, value_name = "FILE")]
    photometry_out: Option<PathBuf>,
}

impl Compare {
    pub fn execute(self) -> anyhow::Result<()> {
        let config = self.common.load()?;
        let compared = compare_table(&config, &self.photometry)?;
        compared.write(&config, &self.out, self.photometry_out.as_deref())?;
        for note in compared.notes.iter().filter(|_| !self.common.quiet) {
            tell(&format!("note: {note}"));
        }
        print(&compared.text());
        if let Some(model) = &config.model {
            print(&Satellite::from_config(model)?.standing_line());
        }
        print(&format!("{}\n", self.out.display()));
        Ok(())
    }
}
