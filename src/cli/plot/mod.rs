//! `satphot plot`: figures of what goes into the model.

mod earth;
mod ground;
mod moon;

use clap::{Args, Subcommand};

const EXAMPLES: &str = "\
Example:
  satphot plot moon -o moon";

/// Draws what goes into the model: the Moon's laws and spectra, the Earth under Sun and Moon, ground tracks.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Plot {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// The Moon's magnitude against phase by three laws, and its spectrum by phase
    Moon(moon::Moon),
    /// The Earth lit by Sun or Moon, as seen from a place above it
    Earth(earth::Earth),
    /// The ground under a satellite: its track, the points under Sun and Moon, where they set
    Ground(ground::Ground),
}

impl Plot {
    pub fn execute(self) -> anyhow::Result<()> {
        match self.what {
            What::Moon(v) => v.execute(),
            What::Earth(v) => v.execute(),
            What::Ground(v) => v.execute(),
        }
    }
}
