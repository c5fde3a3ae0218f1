//! `satphot zeropoint`: star pointings, a table of star measurements, or any table of matched stars to a
//! zeropoint.toml.

use std::path::{Path, PathBuf};

use clap::Args;
use satphot::Error;
use satphot::config::Config;
use satphot::pipeline::options::Options;
use satphot::pipeline::products::summary::zeropoint_text;
use satphot::pipeline::shards::plan_file::Plan;
use satphot::pipeline::shards::reduce::{facts_path, plan_zeropoint};
use satphot::pipeline::single_stages::{fit_stars, zeropoint_from_table};
use satphot::zeropoint::matched::{Request, fit_matched, without_config};

use super::{Common, print, tell};

const EXAMPLES: &str = "\
Examples:
  satphot zeropoint -c pipeline.toml                 the star pointings of the night
  satphot zeropoint --stars satphot-out/2025-06-09/stars.ecsv --set zeropoint.estimator=ols
  satphot zeropoint --matched stars.csv --column inst_mag=MAG_AUTO --column airmass=1.2 -o zp.toml
  satphot zeropoint --matched 'field.cat[LDAC_OBJECTS]' --column v_mag=REF_MAG -o zp.toml";

/// Fits V = V_inst - ZP - k X - C (B-V) to the star pointings of a night, to named star frames, to a stars.ecsv, or to
/// any table of matched stars.
///
/// --matched needs no frames and no pipeline.toml: columns are known by the names that SExtractor, photutils, STDPipe
/// BANZAI, stellarphot and VizieR give theirs, or named with --column KEY=NAME. Keys: inst_mag or flux, inst_mag_err, flux_err or snr,
/// v_mag, v_mag_err, b_v_mag or b_mag, b_v_err_mag, airmass or alt_deg, pointing, exptime_s, e_per_adu, mjd_mid_d, id,
/// include. NAME may be a number for all rows (airmass=1.2) or a difference of two columns (b_v_mag=gmag-rmag).
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ZeropointVerb {
    /// Star frames; the night's own if none are named
    files: Vec<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// Fit this stars.ecsv again instead of measuring frames
    #[arg(long, value_name = "ECSV", conflicts_with = "files")]
    stars: Option<PathBuf>,
    /// Fit a table of matched stars: CSV, TSV, ECSV, VOTable, FITS (FILE[EXT] where it has several tables) or columns of text
    #[arg(long, value_name = "TABLE", conflicts_with_all = ["files", "stars", "flat"])]
    matched: Option<PathBuf>,
    /// What a column of the matched table is, e.g. --column inst_mag=MAG_AUTO (repeatable)
    #[arg(long = "column", value_name = "KEY=NAME", value_parser = column, requires = "matched")]
    columns: Vec<(String, String)>,
    /// Band of the catalogue magnitudes of the matched table
    #[arg(long, value_name = "NAME", default_value = "V", requires = "matched")]
    band: String,
    /// Arbitrary constant the instrumental magnitudes of the matched table contain, subtracted first
    #[arg(long, value_name = "MAG", default_value_t = 0.0, requires = "matched", allow_negative_numbers = true)]
    inst_constant: f64,
    /// Measure the star frames of this plan, for its shards; reads no pipeline.toml. What the stars show of the camera,
    /// and frames excluded, goes to a file .stars.toml next to the zeropoint
    #[arg(long, value_name = "FILE", conflicts_with_all = ["files", "stars", "matched", "config", "sets"])]
    plan: Option<PathBuf>,
    /// Master flat to divide by; made from the night's flats if absent
    #[arg(long, value_name = "FITS")]
    flat: Option<PathBuf>,
    /// Zeropoint to write; new star measurements go to stars.ecsv next to it, those of --matched to matched.ecsv
    #[arg(short, long, value_name = "FILE", default_value = "zeropoint.toml")]
    out: PathBuf,
}

impl ZeropointVerb {
    pub fn execute(self) -> anyhow::Result<()> {
        if let Some(table) = &self.matched {
            return self.fit_matched(table);
        }
        if let Some(plan) = &self.plan {
            return self.of_plan(&Plan::read(plan)?);
        }
        let mut config = self.common.load()?;
        config.zeropoint.previous = None;
        if self.flat.is_some() {
            config.flat.master = self.flat;
        }
        let progress = self.common.progress();
        let fitted = match &self.stars {
            Some(table) => zeropoint_from_table(&config, table)?,
            None => {
                let options = Options { files: self.files, ..self.common.options() };
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

    fn of_plan(&self, plan: &Plan) -> anyhow::Result<()> {
        let (options, progress) = (self.common.plan_options(), self.common.progress());
        let stars = plan_zeropoint(plan, (self.flat.as_deref(), &self.out), &options, &progress)?;
        stars.notes.iter().filter(|_| !self.common.quiet).for_each(|note| tell(&format!("note: {note}")));
        let source = format!("{} star measurements", stars.n_rows);
        print(&zeropoint_text(stars.zeropoint.as_ref(), &source));
        print(&format!("{}\n{}\n", self.out.display(), facts_path(&self.out).display()));
        match stars.poor.is_empty() {
            true => Ok(()),
            false => Err(Error::PoorNight { problem: stars.poor.join("; ") }.into()),
        }
    }

    fn fit_matched(&self, table: &Path) -> anyhow::Result<()> {
        let config = self.config_or_none()?;
        let rows = self.out.with_file_name("matched.ecsv");
        for output in [&self.out, &rows] {
            if same_file(output, table) {
                let problem =
                    format!("{} would be written over the matched table; name another file", output.display());
                return Err(Error::Argument { name: "--out".into(), problem }.into());
            }
        }
        let columns = self.columns.iter().cloned().collect();
        let request = Request { table, columns, band: &self.band, inst_constant_mag: self.inst_constant };
        let matched = fit_matched(&config, &request)?;
        satphot::pipeline::matched::write_matched(&matched, &config, &self.out, &rows)?;
        let warnings = matched.zeropoint.as_ref().map(|z| z.warnings.clone()).unwrap_or_default();
        for note in matched.notes.iter().chain(&warnings).filter(|_| !self.common.quiet) {
            tell(&format!("note: {note}"));
        }
        print(&matched.text());
        match matched.zeropoint {
            Ok(_) => {
                print(&format!("{}\n{}\n", self.out.display(), rows.display()));
                Ok(())
            }
            Err(problem) => Err(Error::PoorNight { problem }.into()),
        }
    }

    /// The configuration; that of a table alone where no pipeline.toml is there and none is named.
    fn config_or_none(&self) -> anyhow::Result<Config> {
        if !self.common.config.exists() && self.common.config == Path::new("pipeline.toml") {
            return Ok(without_config(&self.common.sets)?);
        }
        self.common.load()
    }
}

/// `KEY=NAME`.
pub(super) fn column(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, name)) if !key.trim().is_empty() && !name.trim().is_empty() => {
            Ok((key.trim().to_owned(), name.trim().to_owned()))
        }
        _ => Err("not KEY=NAME, e.g. inst_mag=MAG_AUTO".into()),
    }
}

fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
