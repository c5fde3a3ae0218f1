//! The products of a run: tables, master flat, zeropoint, configuration, figures.

use crate::base::file::save;
use std::path::{Path, PathBuf};

use crate::base::error::Result;
use crate::base::file::make_folder;
use crate::config::Config;
use crate::export::DataMode;
use crate::figures::Thumb;
use crate::pipeline::options::Options;
use crate::pipeline::prepared::Calibrated;
#[cfg(feature = "report")]
use crate::pipeline::products::curve::model_curve;
use crate::pipeline::products::effective::effective_toml;
use crate::pipeline::products::meta::{set_band, table_meta};
use crate::pipeline::products::provenance::Provenance;
#[cfg(feature = "report")]
use crate::report;
use crate::tables::{KeywordCheckRow, PassStackRow, PhotometryRow, ResidualRow, StarRow};
use crate::zeropoint::previous::conditions;

/// Where and how the results are written.
pub struct Outputs<'a> {
    /// Folder of the night.
    pub folder: &'a Path,
    /// The data that the frames share.
    pub night: &'a Calibrated,
    /// The configuration.
    pub config: &'a Config,
    /// Pictures of the target frames, in the order of their rows.
    pub thumbs: &'a [Option<Thumb>],
    /// The provenance that every product states.
    pub provenance: &'a Provenance,
    /// Whether the frames are real.
    pub data_mode: DataMode,
}

impl Outputs<'_> {
    /// Writes every table and figure; returns their paths.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn write(
        &self,
        rows: &[PhotometryRow],
        stars: &[StarRow],
        (residuals, stacks, checks): (&[ResidualRow], &[PassStackRow], &[KeywordCheckRow]),
        options: &Options,
    ) -> Result<Vec<PathBuf>> {
        let mut of_stars = table_meta(self.config, self.night.zeropoint.as_ref(), self.provenance);
        if self.night.zeropoint.is_none() {
            set_band(&mut of_stars, self.night.band.as_ref());
        }
        let mut meta = of_stars.clone();
        meta.push("data_mode", self.data_mode.name());
        let mut files = Vec::new();
        let mut add = |name: &str| -> PathBuf {
            let path = self.folder.join(name);
            files.push(path.clone());
            path
        };
        crate::tables::write_photometry(&add("photometry.ecsv"), rows, &meta)?;
        if self.config.stars.is_some() {
            crate::tables::write_stars(&add("stars.ecsv"), stars, &of_stars)?;
        }
        if self.night.model.is_some() {
            crate::tables::write_residuals(&add("residuals.ecsv"), residuals, &meta)?;
        }
        if !stacks.is_empty() {
            crate::tables::write_rows(&add("pass_stack.ecsv"), stacks, &meta)?;
        }
        crate::tables::write_rows(&add("keyword_checks.ecsv"), checks, &of_stars)?;
        if let Some(zeropoint) = &self.night.zeropoint {
            save(&add("zeropoint.toml"), &zeropoint.to_toml(&[conditions(self.config, self.night.flat.is_some())]))?;
        }
        if self.night.flat.is_some() && self.config.flat.master.is_none() {
            add("master_flat.fits"); // written as soon as it was made
        }
        save(&add("effective.toml"), &effective_toml(self.config, self.folder)?)?;
        #[cfg(feature = "report")]
        if !options.no_figures {
            files.extend(self.figures(rows, stars, residuals)?);
        }
        files.iter().try_for_each(|file| self.provenance.stamp(file))?;
        Ok(files)
    }

    #[cfg(feature = "report")]
    fn figures(&self, rows: &[PhotometryRow], stars: &[StarRow], residuals: &[ResidualRow]) -> Result<Vec<PathBuf>> {
        let folder = self.folder.join("figures");
        let band = crate::bands::Band::or_v(self.night.zeropoint.as_ref().and_then(|z| z.band)).name();
        make_folder(&folder)?;
        let curve = match (&self.night.tracker, &self.config.model) {
            (Some(tracker), Some(model)) => model_curve(rows, tracker, model)?,
            _ => Vec::new(),
        };
        let mut files = crate::figures::light_curve_pages(&folder, (rows, &curve), &self.config.night.name, band)?;
        if self.night.model.is_some() {
            let path = folder.join("residuals_altitude.svg");
            crate::figures::residuals_altitude(&path, residuals, band)?;
            files.push(path);
        }
        if let (Some(z), Some(_)) = (&self.night.zeropoint, &self.config.stars) {
            let path = folder.join("zeropoint.svg");
            crate::figures::zeropoint_diagnostics(
                &path,
                stars,
                (z.zp_mag, z.k_mag_airmass, z.c_mag_mag),
                (z.band_name(), &z.colour_name()),
            )?;
            files.push(path);
        }
        if self.config.vetting.gallery_frames > 0 {
            let (path, most) = (self.folder.join("gallery.html"), self.config.vetting.gallery_frames);
            report::write_gallery(&path, rows, self.thumbs, &self.config.night.name, (most, band))?;
            files.push(path);
        }
        if self.config.stars.is_some() && self.config.photometry.aper_correction {
            files.push(folder.join("growth.svg"));
            crate::figures::growth_curve(&folder.join("growth.svg"), self.night.seeing.growth.as_ref())?;
        }
        Ok(files)
    }
}
