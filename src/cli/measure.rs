//! `satphot measure`: target frames to photometry rows, without the model.

use std::path::PathBuf;

use clap::Args;
use satphot::night::pipeline::Options;
use satphot::night::stage::measure_targets;

use super::{Common, print, tell};

/// Measures the target in the night's target frames or in named files, and tags each with its geometry.
///
/// With the zeropoint of a run the numbers are those of the run: flats and the stars' FWHM are the night's own. Limits of
/// non-detections take the size of the object from the frames measured together.
#[derive(Debug, Args)]
pub struct Measure {
    /// Target frames; the night's own if none are named
    files: Vec<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// Zeropoint to calibrate with (zeropoint.previous); without one magnitudes stay instrumental
    #[arg(long, value_name = "TOML")]
    zeropoint: Option<PathBuf>,
    /// Master flat to divide by; made from the night's flats if absent
    #[arg(long, value_name = "FITS")]
    flat: Option<PathBuf>,
    /// Table to write
    #[arg(short, long, value_name = "FILE", default_value = "photometry.ecsv")]
    out: PathBuf,
}

impl Measure {
    pub fn execute(self) -> anyhow::Result<()> {
        let mut config = self.common.load()?;
        if self.flat.is_some() {
            config.flat.master = self.flat;
        }
        if self.zeropoint.is_some() {
            config.zeropoint.previous = self.zeropoint;
        }
        let options = Options { files: self.files, ..self.common.options() };
        let progress = self.common.progress();
        let measured = measure_targets(&config, &options, &progress)?;
        measured.write(&config, &self.out)?;
        for note in measured.notes.iter().filter(|_| !self.common.quiet) {
            tell(&format!("note: {note}"));
        }
        print(&measured.text());
        print(&format!("{}\n", self.out.display()));
        match measured.poor {
            Some(error) => Err(error.into()),
            None => Ok(()),
        }
    }
}
