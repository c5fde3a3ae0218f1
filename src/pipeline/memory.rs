//! How many frames may be in work at once, from the memory they take: what a night holds, byte by byte.
//!
//! Bytes. Frames are counted with all they can need, so that the limit holds for the worst of them; with a limit that is given, cores
//! never multiply frames. It does not cover rows and notes: a kilobyte a frame.

use super::prepared::{Calibrated, Flattened, Prepared};
use super::survey::files::Survey;
use super::target::frame::target_settings;
use super::target::window::reach_px;
use crate::astrometry::trailed::image::{BYTES_PER_PX, MOST_PIXELS};
use crate::base::error::{Error, Result};
use crate::fits::tall::decoding_bytes;
use crate::frames::Exposure;
use crate::frames::flat::{BAND_BYTES, common_size};

/// The program, its libraries and tables \[bytes\].
const PROGRAM_BYTES: usize = 40_000_000;
/// A row of the catalogue with its places in the index.
const STAR_BYTES: usize = 250;
/// The master flat: f32.
const FLAT_BYTES_PER_PX: usize = 4;
/// A frame: f32 and its mask.
const FRAME_BYTES_PER_PX: usize = 5;
/// Memory that the search for the target takes in addition to its pixels: cutout, cells, significances at four scales.
const SEARCH_BYTES_PER_PX: usize = 40;
/// Detections, mesh and measurements of one frame.
const SOURCES_BYTES: usize = 10_000_000;
/// Rows of f32 a thread holds while it filters a band.
const BAND_ROWS: usize = 200;
/// Stack, buffers and what the allocator keeps for a thread.
const THREAD_BYTES: usize = 2_000_000;

/// The limit that nobody gave: so much for the first thread, and so much for each further one, which the search in another full-size
/// frame takes \[bytes\].
const DEFAULT_BYTES: (usize, usize) = (600_000_000, 400_000_000);

/// The memory a run may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Memory {
    /// Limit \[bytes\].
    pub limit_bytes: usize,
    /// Whether it is the user's own: then a frame that does not fit is an error.
    pub given: bool,
}

/// The memory of one stage \[bytes\].
#[derive(Debug, Clone, Copy)]
struct Need {
    held: usize,
    frame: usize,
    thread: usize,
}

impl Need {
    fn least(&self) -> usize {
        self.held + self.frame + self.thread
    }
}

impl Memory {
    /// The limit that nobody gave.
    #[must_use]
    pub fn of_threads(threads: usize) -> Self {
        let (first, further) = DEFAULT_BYTES;
        Self { limit_bytes: first + threads.saturating_sub(1).saturating_mul(further), given: false }
    }

    /// Threads, at most `threads`, and star frames in work at once.
    #[must_use]
    pub fn star_frames(&self, night: &Flattened, exposures: &[&Exposure], threads: usize) -> (usize, usize) {
        let fit: Vec<&Exposure> =
            exposures.iter().copied().filter(|e| self.holds_star_frame(night, e).is_ok()).collect();
        self.room(stars(night, &fit, night.flat.is_some()), threads)
    }

    /// Threads, at most `threads`, and target frames in work at once.
    #[must_use]
    pub fn target_frames(&self, night: &Calibrated, exposures: &[&Exposure], threads: usize) -> (usize, usize) {
        let fit: Vec<&Exposure> =
            exposures.iter().copied().filter(|e| self.holds_target_frame(night, e).is_ok()).collect();
        self.room(targets(night, largest_fwhm_arcsec(night), &fit, night.flat.is_some()), threads)
    }

    /// Whether a star frame may be measured: the limit nobody gave holds any frame.
    ///
    /// # Errors
    /// [`Error::Argument`] with the memory that it takes.
    pub fn holds_star_frame(&self, night: &Flattened, exposure: &Exposure) -> Result<()> {
        self.holds(stars(night, &[exposure], night.flat.is_some()), exposure)
    }

    /// The same of a target frame.
    ///
    /// # Errors
    /// [`Error::Argument`] with the memory that it takes.
    pub fn holds_target_frame(&self, night: &Calibrated, exposure: &Exposure) -> Result<()> {
        self.holds(targets(night, largest_fwhm_arcsec(night), &[exposure], night.flat.is_some()), exposure)
    }

    fn holds(&self, need: Need, exposure: &Exposure) -> Result<()> {
        if !self.given || need.least() <= self.limit_bytes {
            return Ok(());
        }
        let (nx, ny) = exposure.size_px;
        let problem = format!(
            "{} MB do not hold this frame of {nx}x{ny} px with its flat: {} MB are needed, or a smaller \
             photometry.clip_radius_px",
            self.limit_bytes / 1_000_000,
            need.least().div_ceil(1_000_000)
        );
        Err(Error::Argument { name: "max_memory".into(), problem })
    }

    fn room(&self, need: Need, threads: usize) -> (usize, usize) {
        let for_threads = self.limit_bytes.saturating_sub(need.held + need.frame);
        let threads = (for_threads / need.thread.max(1)).clamp(1, threads.max(1));
        let for_frames = self.limit_bytes.saturating_sub(need.held + threads * need.thread);
        (threads, (for_frames / need.frame.max(1)).clamp(1, threads))
    }

    /// Whether the night can be reduced in this memory; a note where a frame takes more than the limit.
    ///
    /// # Errors
    /// [`Error::Argument`] with the least that works, where the limit given holds none of the frames.
    pub fn check(&self, survey: &Survey, night: &Prepared) -> Result<Option<String>> {
        let flat = !survey.flats.is_empty() || night.config.flat.master.is_some();
        let star_frames = survey.pointings.iter().flatten().filter(|_| night.config.stars.is_some());
        let star_frames = star_frames.map(|e| stars(night, &[e], flat).least());
        let target_frames = survey.targets.iter().map(|e| targets(night, None, &[e], flat).least());
        let lights: Vec<usize> = star_frames.chain(target_frames).collect();
        let flats = if survey.flats.is_empty() { 0 } else { flats(night, &survey.flats).least() };
        let least = lights.iter().copied().min().unwrap_or(0).max(flats);
        let most = lights.iter().copied().max().unwrap_or(0).max(flats);
        if most <= self.limit_bytes {
            return Ok(None);
        }
        let (limit_mb, mb) = (self.limit_bytes / 1_000_000, |bytes: usize| bytes.div_ceil(1_000_000));
        if self.given && least > self.limit_bytes {
            let problem = format!(
                "{limit_mb} MB do not hold one frame of this night with its flat: at least {}MB is needed, or a \
                 smaller photometry.clip_radius_px",
                mb(least)
            );
            return Err(Error::Argument { name: "max_memory".into(), problem });
        }
        if self.given {
            let n = lights.iter().filter(|need| **need > self.limit_bytes).count();
            return Ok(Some(format!(
                "warning: {n} of {} light frames take more than the {limit_mb} MB of argument `max_memory`, the largest {} MB: \
                 they fail",
                lights.len(),
                mb(most)
            )));
        }
        Ok(Some(format!(
            "one frame of this night with its flat takes {} MB, more than the {limit_mb} MB of argument `max_memory`: one is \
             worked on at a time",
            mb(most)
        )))
    }
}

/// Pixels of the largest box of the clip circle, and its width.
fn largest_box(night: &Prepared, exposures: &[&Exposure]) -> (usize, usize) {
    let side = night.config.photometry.clip_radius_px.map_or(usize::MAX, |r| (2.0 * r).ceil() as usize + 1);
    let size = |e: &&Exposure| (e.size_px.0.min(side), e.size_px.1.min(side));
    exposures.iter().map(size).map(|(nx, ny)| (nx * ny, nx)).max().unwrap_or((0, 0))
}

/// The memory in use in every stage, with the master flat of the same box, and the tiles of one frame that are decoded at once.
fn held(night: &Prepared, px: usize, flat: bool, exposures: &[&Exposure]) -> usize {
    let stars = night.catalogue.as_ref().map_or(0, |c| c.stars.len());
    let tiles = exposures.iter().map(|e| decoding_bytes(&e.header)).max().unwrap_or(0);
    PROGRAM_BYTES + tiles + stars * STAR_BYTES + if flat { px * FLAT_BYTES_PER_PX } else { 0 }
}

fn stars(night: &Prepared, exposures: &[&Exposure], flat: bool) -> Need {
    let (px, width) = largest_box(night, exposures);
    Need {
        held: held(night, px, flat, exposures),
        frame: px * FRAME_BYTES_PER_PX + SOURCES_BYTES,
        thread: THREAD_BYTES + 4 * BAND_ROWS * width,
    }
}

fn largest_fwhm_arcsec(night: &Calibrated) -> Option<f64> {
    night.seeing.width.map(|width| width.largest())
}

/// A target frame may be read whole, and is then searched or its star trails measured as well.
fn targets(night: &Prepared, fwhm_arcsec: Option<f64>, exposures: &[&Exposure], flat: bool) -> Need {
    let (px, width) = largest_box(night, exposures);
    let reach = exposures.iter().map(|e| reach_px(&target_settings(e, night, fwhm_arcsec))).fold(0.0, f64::max);
    let side = (2.0 * reach).min(1e9) as usize;
    let search = px.min(side.min(width) * side);
    let by_trails = night.catalogue.is_some() && night.config.zeropoint.star_trails;
    let trails = if by_trails { px.min(MOST_PIXELS) * BYTES_PER_PX } else { 0 };
    Need {
        held: held(night, px, flat, exposures),
        frame: px * FRAME_BYTES_PER_PX + (search * (FRAME_BYTES_PER_PX + SEARCH_BYTES_PER_PX)).max(trails),
        // a row of boxes of the mesh
        thread: THREAD_BYTES + FRAME_BYTES_PER_PX * night.config.photometry.mesh_px * width,
    }
}

fn flats(night: &Prepared, exposures: &[Exposure]) -> Need {
    // those of another size do not enter the master
    let size_px = common_size(exposures);
    let exposures: Vec<&Exposure> = exposures.iter().filter(|e| Some(e.size_px) == size_px).collect();
    let (px, _) = largest_box(night, &exposures);
    Need { held: held(night, px, true, &exposures), frame: BAND_BYTES, thread: THREAD_BYTES }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cores_never_multiply_frames_and_one_is_always_worked_on() {
        let need = Need { held: 160, frame: 130, thread: 5 };
        let room = |limit_bytes, threads| Memory { limit_bytes, given: false }.room(need, threads);
        assert_eq!(room(600, 1), (1, 1));
        assert_eq!(room(600, 2), (2, 2));
        assert_eq!(room(1_000_000, 64), (64, 64));
        assert_eq!(room(100, 64), (1, 1));
        for (limit, threads) in [(600, 64), (600, 8), (300, 4), (430, 2), (1_000, 16)] {
            let (threads, frames) = room(limit, threads);
            assert!(need.held + frames * need.frame + threads * need.thread <= limit, "{limit}: {threads} {frames}");
        }
    }
}
