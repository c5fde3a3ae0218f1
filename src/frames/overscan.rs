//! The overscan: pixels of a frame that saw no light (BIASSEC), the zero level they give, and the part that did see light.
//!
//! Sections are `[x1:x2,y1:y2]` from 1, both ends included, in pixels of the file; here columns and rows of the frame from 0. The
//! level is a clipped mean \[ADU\]. A section that a program left behind when it cut the frame is told by TRIMSEC or DATASEC,
//! which then does not fit, or by its scatter. It does not cover a slope along the overscan, and several amplifiers.

use std::ops::Range;

use super::exposure::Exposure;
use super::frame::Gain;
use super::header::calibration;
use super::sample::read_box;
use crate::base::stats::sigma_clip;

/// Pixels of an overscan that are read.
const MOST_PX: usize = 100_000;
/// Fewest pixels that give a level.
const FEWEST_PX: usize = 100;
/// Clip of the mean.
const CLIP_SIGMA: f64 = 5.0;
/// Pixels without light scatter by their read noise; twice of it allows for a table that is of another mode of the camera.
const MOST_READ_NOISES: f64 = 2.0;

/// Columns and rows of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Columns.
    pub x: Range<usize>,
    /// Rows.
    pub y: Range<usize>,
}

/// The level of an overscan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Clipped mean \[ADU\].
    pub adu: f64,
    /// Its error \[ADU\].
    pub err_adu: f64,
    /// Standard deviation of its pixels \[ADU\].
    pub sigma_adu: f64,
}

impl Section {
    fn parse(text: &str, size_px: (usize, usize)) -> Option<Self> {
        let (x, y) = text.trim().strip_prefix('[')?.strip_suffix(']')?.split_once(',')?;
        let span = |s: &str, n: usize| {
            let (a, b) = s.split_once(':')?;
            let (a, b): (usize, usize) = (a.trim().parse().ok()?, b.trim().parse().ok()?);
            (1 <= a && a <= b && b <= n).then(|| a - 1..b)
        };
        Some(Self { x: span(x, size_px.0)?, y: span(y, size_px.1)? })
    }

    fn overlaps(&self, other: &Self) -> bool {
        let meet = |a: &Range<usize>, b: &Range<usize>| a.start < b.end && b.start < a.end;
        meet(&self.x, &other.x) && meet(&self.y, &other.y)
    }

    /// In pixels of a frame whose pixels are squares of `n` by `n`; only those that lie in it entirely.
    fn of_superpixels(&self, n: usize) -> Self {
        let inner = |r: &Range<usize>| r.start.div_ceil(n)..r.end / n;
        Self { x: inner(&self.x), y: inner(&self.y) }
    }
}

/// The overscan of a frame and the part that saw light (the whole frame where no header states it); `None` without BIASSEC.
///
/// # Errors
/// Why the section of the header cannot be one of this frame: it does not lie in it, it is said to see light, or the frame was
/// corrected by it.
pub fn sections(exposure: &Exposure) -> Result<Option<(Section, Option<Section>)>, String> {
    let Some(text) = exposure.header.text("BIASSEC").filter(|text| !text.trim().is_empty()) else { return Ok(None) };
    let superpixel = if exposure.header.green().is_some() { 2 } else { 1 };
    let size_px = (superpixel * exposure.size_px.0, superpixel * exposure.size_px.1);
    let outside = |key: &str, text: &str| format!("{key} = {text} is no part of {} x {} px", size_px.0, size_px.1);
    if calibration(&exposure.header).zero_subtracted {
        return Err(format!("CALSTAT says that bias or dark are subtracted: BIASSEC = {text} is not used"));
    }
    let bias = Section::parse(&text, size_px).ok_or_else(|| outside("BIASSEC", &text))?;
    let mut lit = None;
    for key in ["TRIMSEC", "DATASEC"] {
        let Some(data) = exposure.header.text(key).filter(|text| !text.trim().is_empty()) else { continue };
        let section =
            Section::parse(&data, size_px).ok_or_else(|| format!("{}: the frame was cut", outside(key, &data)))?;
        if section.overlaps(&bias) {
            return Err(format!("BIASSEC = {text} overlaps {key} = {data}"));
        }
        lit = lit.or(Some(section.of_superpixels(superpixel)));
    }
    Ok(Some((bias.of_superpixels(superpixel), lit)))
}

/// The level of the overscan of a frame; `None` where it has none or cannot be read. `gain` checks that no light falls on it, where it is known.
///
/// # Errors
/// Why it cannot be used, as [`sections`] says, or because it scatters by more than read noise.
pub fn overscan(exposure: &Exposure, gain: Option<&Gain>) -> Result<Option<Level>, String> {
    let Some((Section { x, y }, _)) = sections(exposure)? else { return Ok(None) };
    let rows = y.len().min(MOST_PX.div_ceil(x.len().max(1)));
    let first = y.start + (y.len() - rows) / 2;
    // a damaged file says so where its pixels are needed
    let Ok(values) = read_box(exposure, (x.start, first), (x.len(), rows)) else { return Ok(None) };
    let clipped = sigma_clip(&mut values.into_iter().map(f64::from).collect::<Vec<_>>(), CLIP_SIGMA);
    let Some(clipped) = clipped.filter(|c| c.n >= FEWEST_PX) else {
        return Err(format!("the overscan has fewer than {FEWEST_PX} usable pixels"));
    };
    if let Some(gain) = gain {
        // one step of the converter is noise, too
        let most_adu = MOST_READ_NOISES * (gain.read_noise_e / gain.e_per_adu.0).hypot(1.0);
        if clipped.sigma > most_adu {
            return Err(format!(
                "the overscan scatters by {:.1} ADU, where read noise makes {:.1}: light falls on it",
                clipped.sigma,
                most_adu / MOST_READ_NOISES
            ));
        }
    }
    let err_adu = clipped.sigma / (clipped.n as f64).sqrt();
    Ok(Some(Level { adu: clipped.mean, err_adu, sigma_adu: clipped.sigma }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_counted_from_one_and_both_ends_belong_to_them() {
        assert_eq!(Section::parse("[1:50,1:20]", (60, 20)), Some(Section { x: 0..50, y: 0..20 }));
        assert_eq!(Section::parse(" [ 51 : 60 , 2:20 ] ", (60, 20)), Some(Section { x: 50..60, y: 1..20 }));
        for wrong in ["[0:5,1:20]", "[51:61,1:20]", "[5:1,1:20]", "51:60,1:20", "[N/A]", "", "[1:2]", "[a:b,1:2]"] {
            assert_eq!(Section::parse(wrong, (60, 20)), None, "{wrong}");
        }
        let section = Section { x: 51..60, y: 1..20 };
        assert_eq!(section.of_superpixels(2), Section { x: 26..30, y: 1..10 });
        assert!(
            section.overlaps(&Section { x: 59..70, y: 0..2 }) && !section.overlaps(&Section { x: 60..70, y: 0..2 })
        );
    }
}
