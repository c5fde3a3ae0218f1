//! `satphot flat`: a master flat from the flats of a night, or from files.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::base::hash::sha256_16;
use satphot::base::threads::with_threads;
use satphot::frames::Detector;
use satphot::frames::flat::{BAND_BYTES, FlatMember, MasterFlat};
use satphot::pipeline::products::provenance::Provenance;
use satphot::pipeline::shards::plan_file::Plan;
use satphot::pipeline::shards::reduce::plan_flat;
use satphot::pipeline::survey::filters::{aside_notes, reduce_one_filter};
use satphot::pipeline::survey::read::survey;

use super::{Common, print, tell};

const AFTER_HELP: &str = "\
Examples:
  satphot flat -o master_flat.fits                            the flats of pipeline.toml's night
  satphot flat flats/*.fits -o master_flat.fits
  satphot flat --plan plan.json -o night/master_flat.fits     a step of a plan; what became of each flat goes to
                                                              master_flat.flats.toml next to it";

/// Makes a master flat: pedestal subtracted, each flat divided by its level, median over the flats, normalised.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Flat {
    /// Flats; the night's own if none are named
    files: Vec<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// Make the master flat of this plan, for its other steps; reads no pipeline.toml
    #[arg(long, value_name = "FILE", conflicts_with_all = ["files", "config", "sets"])]
    plan: Option<PathBuf>,
    /// Master flat to write
    #[arg(short, long, value_name = "FILE", default_value = "master_flat.fits")]
    out: PathBuf,
}

impl Flat {
    pub fn execute(self) -> anyhow::Result<()> {
        if let Some(plan) = &self.plan {
            let (options, progress) = (self.common.plan_options(), self.common.progress());
            let (flat, notes) = plan_flat(&Plan::read(plan)?, &self.out, &options, &progress)?;
            notes.iter().filter(|_| !self.common.quiet).for_each(|note| tell(&format!("note: {note}")));
            self.tell_flat(&flat);
            return Ok(());
        }
        let night = self.common.load()?;
        let mut config = night.clone();
        if !self.files.is_empty() {
            // files named here are flats, whatever their headers say
            config.frames.flat.push("*".into());
        }
        let mut survey = survey(&config, &self.files, &[])?;
        reduce_one_filter(&mut survey, &config)?;
        aside_notes(&survey).iter().filter(|_| !self.common.quiet).for_each(|note| tell(&format!("note: {note}")));
        if survey.flats.is_empty() {
            return Err(
                Error::Flat { problem: "no flats found (IMAGETYP, or patterns in [frames] flat)".into() }.into()
            );
        }
        let detector = Detector::from_config(&config.detector)?;
        let clip_radius_px = config.photometry.clip_radius_px;
        let make = || MasterFlat::make(&survey.flats, &detector, &config.flat, clip_radius_px, BAND_BYTES);
        let flat = with_threads(self.common.jobs, make)??;
        let provenance = Provenance::of_flat(&night, &survey.flats, &|path| sha256_16(path).ok())?;
        flat.write_with(&self.out, &provenance.cards())?;
        self.tell_flat(&flat);
        Ok(())
    }

    /// What became of each flat.
    fn tell_flat(&self, flat: &MasterFlat) {
        for member in &flat.members {
            let what = match member {
                FlatMember { used: true, .. } => "used".to_string(),
                FlatMember { not_needed: true, .. } => member.reason.clone(),
                _ => format!("rejected: {}", member.reason),
            };
            print(&format!("{:<40} level {:>9.1} ADU  {what}\n", member.path.display(), member.level_adu));
        }
        let used = flat.members.iter().filter(|m| m.used).count();
        print(&format!(
            "{}: median of {used} flats, {:.3} % of the pixels masked{}\n",
            self.out.display(),
            100.0 * flat.masked_frac,
            flat.noise_frac.map_or(String::new(), |noise| format!(", noise of a pixel {:.3} %", 100.0 * noise))
        ));
    }
}
