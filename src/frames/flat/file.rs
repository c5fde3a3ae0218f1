//! The master flat on disk: one f32 image, with where it belongs and what it was made of in its cards.
//!
//! Read back bit for bit. A master made by another program is normalised and masked like our own.

use std::path::Path;

use ndarray::Array2;

use super::master::MasterFlat;
use crate::base::error::{Error, Result};
use crate::base::file::file_name;
use crate::base::pages::zeros;
use crate::config;
use crate::fits::cards::Header;
use crate::fits::raw::guarded;
use crate::fits::write::write_f32;
use crate::fits::{CardLine, card};
use crate::frames::clip::Region;
use crate::frames::read::Pixels;

/// The card with the noise of a pixel.
const NOISE: &str = "NOISEFRC";

impl MasterFlat {
    /// Writes the box of the clip circle as an f32 image; masked pixels are NaN.
    ///
    /// Cards: ORIGIN_X, ORIGIN_Y (full-frame pixel of the first one, 0-based), FULL_NX, FULL_NY, NCOMBINE, MASKFRAC,
    /// NORMED, NUNUSED, NOISEFRC where it is known, and one HISTORY line per flat with its level or the reason of its rejection.
    ///
    /// # Errors
    /// [`Error::Fits`], [`Error::Io`].
    pub fn write(&self, path: &Path) -> Result<()> {
        self.write_with(path, &[])
    }

    /// As [`MasterFlat::write`], with further cards before the history: where the flat is from.
    ///
    /// # Errors
    /// The errors of [`MasterFlat::write`].
    pub fn write_with(&self, path: &Path, more: &[CardLine]) -> Result<()> {
        let used = self.members.iter().filter(|m| m.used).count();
        let unneeded = self.members.iter().filter(|m| m.not_needed).count();
        let whole = |n: usize| n as i64;
        let mut cards = vec![
            card("IMAGETYP", "Master Flat", "median of flats, each divided by its level"),
            card("ORIGIN_X", whole(self.origin_px.0), "full-frame x of the first pixel, from 0"),
            card("ORIGIN_Y", whole(self.origin_px.1), "full-frame y of the first pixel, from 0"),
            card("FULL_NX", whole(self.full_size_px.0), "[px] full-frame size"),
            card("FULL_NY", whole(self.full_size_px.1), "[px] full-frame size"),
            card("NCOMBINE", whole(used), "flats in the median"),
            card("NREJECT", whole(self.members.len() - used - unneeded), "flats rejected"),
            card("NUNUSED", whole(unneeded), "flats not needed for flat.noise_frac"),
            card("MASKFRAC", self.masked_frac, "share of masked pixels (NaN)"),
            card("NORMED", true, "median 1 inside the clip circle"),
            card("BUNIT", "relative", "response"),
        ];
        if let Some(filter) = &self.filter {
            cards.push(card("FILTER", filter.as_str(), ""));
        }
        if let Some(noise_frac) = self.noise_frac {
            cards.push(card(NOISE, noise_frac, "noise of a pixel at the median level"));
        }
        cards.extend_from_slice(more);
        for m in &self.members {
            let name = file_name(&m.path);
            let line = if m.used {
                format!("used {name} level {:.1} ADU", m.level_adu)
            } else if m.not_needed {
                format!("{name} {}", m.reason)
            } else {
                format!("rejected {name}: {}", m.reason)
            };
            let line: String = line.chars().map(|c| if (' '..='~').contains(&c) { c } else { '?' }).collect();
            cards.push(card("HISTORY", line.as_str(), ""));
        }
        write_f32(path, &self.response, &cards)
    }

    /// Reads a master flat, ours or another program's, for frames read with `clip_radius_px`.
    ///
    /// # Errors
    /// [`Error::Flat`] if it does not cover the clip circle or holds no light; [`Error::Fits`], [`Error::Io`].
    pub fn read(path: &Path, clip_radius_px: Option<f64>, config: &config::Flat) -> Result<MasterFlat> {
        let header = Header::read(path)?;
        let (nx, ny) = header.size_px();
        let whole = |key: &str| header.integer(key).and_then(|v| usize::try_from(v).ok());
        let origin_px = (whole("ORIGIN_X").unwrap_or(0), whole("ORIGIN_Y").unwrap_or(0));
        let full_size_px = (whole("FULL_NX").unwrap_or(nx), whole("FULL_NY").unwrap_or(ny));
        let region = Region::new(full_size_px, clip_radius_px);
        let start = (region.origin_px.0.checked_sub(origin_px.0), region.origin_px.1.checked_sub(origin_px.1));
        let (w, h) = region.size_px;
        let (Some(x), Some(y)) = start else { return Err(uncovered(path, (nx, ny), origin_px, &region)) };
        if full_size_px.0 == 0 || full_size_px.1 == 0 || x + w > nx || y + h > ny {
            return Err(uncovered(path, (nx, ny), origin_px, &region));
        }
        let mut values = zeros(path, w * h)?;
        guarded(path, || Pixels::open(path, &header)?.read((x, y), (w, h), &mut values))?;
        let response = Array2::from_shape_vec((h, w), values).map_err(|e| Error::Flat { problem: e.to_string() })?;
        let normalise = header.logical("NORMED") != Some(true);
        let master =
            Self::finish(response, &region, config.min_response, normalise, Vec::new(), header.text("FILTER"))?;
        let noise_frac = header.number(NOISE).filter(|noise| (0.0..1.0).contains(noise));
        Ok(MasterFlat { noise_frac, ..master })
    }
}

fn uncovered(path: &Path, (nx, ny): (usize, usize), origin_px: (usize, usize), region: &Region) -> Error {
    Error::Flat {
        problem: format!(
            "{} holds {nx}x{ny} px at {origin_px:?}, but photometry.clip_radius_px = {:?} needs {:?} px at {:?}; make it again",
            path.display(),
            region.radius_px,
            region.size_px,
            region.origin_px
        ),
    }
}
