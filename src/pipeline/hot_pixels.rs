//! The hot pixels of a night without darks, by what stands out in its star frames of several fields.
//!
//! One frame of each of the first five fields that differ in where they point. It does not take target frames: a tracked
//! satellite stands still on the detector, as a hot pixel does.

use super::options::Options;
use super::prepared::Flattened;
use super::shards::products::FrameCache;
use crate::astrometry::catalogue::separation_deg;
use crate::astrometry::initial_pointing::initial_pointings;
use crate::base::error;
use crate::base::hash::sha256_16_text;
use crate::base::threads::pool;
use crate::frames::{Exposure, FEWEST_FIELDS, HotPixels, MOST_FIELDS, Peak, peaks};

/// Fields are different where their centres are this far apart \[px\]: no star lies on the same pixel twice.
const APART_PX: f64 = 20.0;
/// Kind of the product.
const HOT: &str = "hot_pixels";

/// The night with a map of the hot pixels of each size and binning whose frames have no matching darks; with what is to be said.
///
/// A frame that cannot be read is passed over for the next of its pointing.
///
/// # Errors
/// A stop, and what is wrong with the machine.
pub fn with_hot_pixels(
    mut night: Flattened,
    pointings: &[Vec<Exposure>],
    products: &FrameCache,
    options: &Options,
    notes: &mut Vec<String>,
) -> error::Result<Flattened> {
    if !night.config.detector.mask_hot_pixels {
        return Ok(night);
    }
    let threads = pool(options.threads())?;
    for fields in fields_by_readout(&night, pointings) {
        options.stop.check(|| "stopped before the hot pixels were found".into())?;
        let hash = |e: &&Exposure| format!("{} {}", e.name, products.sha256(&e.path).unwrap_or_default());
        let Some(first) = fields.first().and_then(|frames| frames.first()).copied() else { continue };
        let mut depends: Vec<String> = fields.iter().flatten().map(hash).collect();
        depends.extend([HOT.into(), night.flat_sha256.clone(), night.zero.key.clone()]);
        let key = products.key(&depends.iter().map(String::as_str).collect::<Vec<_>>());
        let name = format!("{HOT}_{}x{}_{}", first.size_px.0, first.size_px.1, first.binning);
        let map = match products.load::<Result<HotPixels, String>>(&name, &key) {
            Some(map) => Some(map),
            None => threads.install(|| map_of(&night, &fields, options)),
        };
        let Some(map) = map else { continue };
        products.store(&name, &key, &map);
        match map {
            Err(why) => notes.push(format!("warning: {why}")),
            Ok(map) if map.pixels.is_empty() => {}
            Ok(map) => {
                notes.push(format!(
                    "{} hot pixels of {} x {} px at binning {}, by star frames of {} fields, are masked where they add more \
                     than the read noise; detector.mask_hot_pixels = false keeps them",
                    map.pixels.len(),
                    map.size_px.0,
                    map.size_px.1,
                    map.binning,
                    map.n_fields
                ));
                night.hot.push(map);
            }
        }
    }
    night.buffers.clear();
    Ok(night)
}

/// What measurements depend on; empty without hot pixels.
#[must_use]
pub fn hot_key(maps: &[HotPixels]) -> String {
    if maps.is_empty() { String::new() } else { sha256_16_text(&format!("{maps:?}")) }
}

/// Per size and binning the first fields that differ, each the frames of its pointing; only where they are enough.
fn fields_by_readout<'a>(night: &Flattened, pointings: &'a [Vec<Exposure>]) -> Vec<Vec<Vec<&'a Exposure>>> {
    type Fields<'a> = Vec<(Option<[f64; 2]>, Vec<&'a Exposure>)>;
    let mut by_readout: Vec<((usize, usize), u32, Fields)> = Vec::new();
    let shown = |e: &&Exposure| night.zero.of(e).is_some_and(|zero| zero.shows_hot_pixels());
    for pointing in pointings {
        let frames: Vec<&Exposure> = pointing.iter().filter(|e| !shown(e) && e.exptime_s > 0.0).collect();
        let Some(first) = frames.first().copied() else { continue };
        let readout =
            by_readout.iter().position(|(size, binning, _)| (*size, *binning) == (first.size_px, first.binning));
        let readout = readout.unwrap_or_else(|| {
            by_readout.push((first.size_px, first.binning, Vec::new()));
            by_readout.len() - 1
        });
        let fields = &mut by_readout[readout].2;
        let aliases = &night.config.header.aliases;
        let site = Some((&night.site, &night.eop));
        let place = initial_pointings(first, None, None, site, aliases).into_iter().next();
        let place = place.map(|p| [p.ra_deg, p.dec_deg]);
        let apart_deg = APART_PX * night.scale_arcsec(first) / 3600.0;
        let object = |e: &Exposure| e.object.clone().unwrap_or_default().trim().to_lowercase();
        let differs = |(other, frames): &(Option<[f64; 2]>, Vec<&Exposure>)| match (place, other) {
            (Some([ra, dec]), Some([other_ra, other_dec])) => {
                separation_deg(ra, dec, *other_ra, *other_dec) > apart_deg
            }
            // without a place a name tells fields apart
            _ => frames.first().is_some_and(|e| !object(e).is_empty() && object(e) != object(first)),
        };
        let told = place.is_some() || !object(first).is_empty();
        if told && fields.len() < MOST_FIELDS && fields.iter().all(differs) {
            fields.push((place, frames));
        }
    }
    let frames = by_readout.into_iter().map(|(.., fields)| fields.into_iter().map(|(_, frames)| frames).collect());
    frames.filter(|fields: &Vec<_>| fields.len() >= FEWEST_FIELDS).collect()
}

/// The map; `None` where too few of the fields can be read.
fn map_of(night: &Flattened, fields: &[Vec<&Exposure>], options: &Options) -> Option<Result<HotPixels, String>> {
    let of_field = |frames: &Vec<&Exposure>| -> Option<(Vec<Peak>, f64)> {
        let fits = |e: &&&Exposure| options.memory().holds_star_frame(night, e).is_ok();
        frames.iter().filter(fits).find_map(|e| Some((peaks(&*night.reduce(e).ok()?), e.exptime_s)))
    };
    let found: Vec<(Vec<Peak>, f64)> = fields.iter().filter_map(of_field).collect();
    let first = fields.first()?.first()?;
    (found.len() >= FEWEST_FIELDS).then(|| HotPixels::common(first, &found))
}
