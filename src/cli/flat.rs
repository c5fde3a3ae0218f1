//! `satphot flat`: a master flat from the flats of a night, or from files.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::frames::{BAND_BYTES, Detector, MasterFlat};
use satphot::night::stages::with_threads;
use satphot::night::survey::survey;

use super::{Common, print};

/// Makes a master flat: pedestal subtracted, each flat divided by its level, median over the flats, normalised.
#[derive(Debug, Args)]
pub struct Flat {
    /// Flats; the night's own if none are named
    files: Vec<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// Master flat to write
    #[arg(short, long, value_name = "FILE", default_value = "master_flat.fits")]
    out: PathBuf,
}

impl Flat {
    pub fn execute(self) -> anyhow::Result<()> {
        let mut config = self.common.load()?;
        if !self.files.is_empty() {
            // files named here are flats, whatever their headers say
            config.frames.flat.push("*".into());
        }
        let survey = survey(&config, &self.files, &[])?;
        if survey.flats.is_empty() {
            return Err(
                Error::Flat { problem: "no flats found (IMAGETYP, or patterns in [frames] flat)".into() }.into()
            );
        }
        let detector = Detector::from_config(&config.detector)?;
        let clip_radius_px = config.photometry.clip_radius_px;
        let make = || MasterFlat::make(&survey.flats, &detector, &config.flat, clip_radius_px, BAND_BYTES);
        let flat = with_threads(self.common.jobs, make)??;
        flat.write(&self.out)?;
        for member in &flat.members {
            let what = if member.used { "used".to_string() } else { format!("rejected: {}", member.reason) };
            print(&format!("{:<40} level {:>9.1} ADU  {what}\n", member.path.display(), member.level_adu));
        }
        let used = flat.members.iter().filter(|m| m.used).count();
        print(&format!(
            "{}: median of {used} flats, {:.3} % of the pixels masked\n",
            self.out.display(),
            100.0 * flat.masked_frac
        ));
        Ok(())
    }
}
