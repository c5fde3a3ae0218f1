//! `satphot plot`: figures of what goes into the model.

mod moon;

use clap::{Args, Subcommand};

/// Draws what goes into the model: the Moon's laws and spectra.
#[derive(Debug, Args)]
pub struct Plot {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// The Moon's magnitude against phase by three laws, and its spectrum by phase
    Moon(moon::Moon),
}

impl Plot {
    pub fn execute(self) -> anyhow::Result<()> {
        match self.what {
            What::Moon(v) => v.execute(),
        }
    }
}
