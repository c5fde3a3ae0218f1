//! Star pointings: every member measured in its own pixels at the aligned catalogue positions, then combined.
//!
//! deviates: Caddy et al. take the median of the members' pixels; here the median is taken of each star's electrons
//! per second. The alignment (shift and rotation) is the same, but nothing is resampled, so the noise stays white,
//! members of different gain, exposure or seeing do not bias the star, and only one frame is in memory.

mod member;
mod rows;

pub use member::{Member, MemberStar};

use std::path::Path;

use rstar::primitives::GeomWithData;
use rstar::{AABB, RTree};

use crate::astrometry::align::align;
use crate::astrometry::catalogue::Catalogue;
use crate::astrometry::field_rotation::CameraTurn;
use crate::astrometry::wcs::Wcs;
use crate::base::error::{Error, Result};
use crate::frames::Exposure;
use crate::orbit::{airmass::airmass, icrs_to_altaz};
use crate::photometry::Flags;
use crate::photometry::aperture::Shape;
use crate::photometry::background::{Background, background};
use crate::photometry::centroid::centroid;
use crate::photometry::detect::{Source, detect, stellar_fwhm};
use crate::photometry::flux::{Neighbour, measure_all};
use crate::photometry::growth::frame_growth;
use crate::pipeline::prepared::Flattened;
use crate::pipeline::stars::solve::field_wcs;

pub use rows::{combined_rows, single_rows};

/// Stars brighter than this many σ are recentred; fainter ones are measured where the alignment puts them, because a
/// centroid in the noise climbs onto the noise and makes the star too bright.
const RECENTRE_SNR: f64 = 25.0;
/// A neighbour that adds more than this share of a star's own error taints it.
const NEIGHBOUR_SIGMA: f64 = 0.3;
/// Exponent of the wings of the profile of neighbours.
const WING_BETA: f64 = 2.5;
/// Light above this share of the noise of a pixel is that of a neighbour.
const WING_SIGMA: f64 = 0.1;
/// Brightest objects used for the alignment.
const N_ALIGN: usize = 300;
/// Of two objects at one place the fainter counts if it has more than this share of the brighter one's light.
const AMBIGUOUS_FRAC: f64 = 0.1;

/// Measures every catalogue star of one star frame.
///
/// # Errors
/// What is wrong with the frame: no WCS, no star detected, no match with the catalogue, no usable pixel.
pub fn measure_member(exposure: &Exposure, night: &Flattened, catalogue: &Catalogue) -> Result<Member> {
    let path = exposure.path.as_path();
    let Some(stars) = &night.config.stars else {
        return Err(Error::Config { key: "stars".into(), problem: "is needed to measure star pointings".into() });
    };
    let time = exposure.time.as_ref().ok_or_else(|| header(path, "DATE-OBS", "no mid-exposure time"))?;
    let p = &night.config.photometry;
    let frame = night.reduce(exposure)?;
    let sky = background(&frame, p.mesh_px, p.clip_sigma)?;
    let sources = detect(&frame, &sky, p.detect_sigma, p.fwhm_px);
    let seeing_px = stellar_fwhm(&frame, &sky, &sources);
    let fwhm_px = match p.fwhm_px.or(seeing_px) {
        Some(fwhm) => fwhm,
        None => {
            return Err(Error::Fits {
                path: path.into(),
                problem: format!(
                    "no round, unsaturated star to measure the FWHM on ({} detections above {} sigma); \
                     clouds, or set photometry.fwhm_px",
                    sources.len(),
                    p.detect_sigma
                ),
            });
        }
    };
    let field = field_wcs(exposure, &sources, night, catalogue)?;
    let wcs = &field.wcs;
    let scale_arcsec = wcs.scale_arcsec();
    let predicted = predict(wcs, catalogue, exposure.size_px, stars.pointing_err_arcsec / scale_arcsec);
    let detected: Vec<(f64, f64)> = sources.iter().take(N_ALIGN).map(|s| (s.x_px, s.y_px)).collect();
    let brightest: Vec<(f64, f64)> = predicted.iter().take(N_ALIGN).map(|s| (s.1, s.2)).collect();
    let match_px = stars.match_radius_arcsec / scale_arcsec;
    let alignment = align(&brightest, &detected, stars.pointing_err_arcsec / scale_arcsec, match_px).ok_or_else(
        || Error::Catalogue {
            path: stars.catalogue.clone(),
            problem: format!(
                "{}: {} catalogue stars expected, {} detected, no match within {} arcsec (stars.pointing_err_arcsec) \
                     and 6 deg of the header's pointing; at least 3 common stars are needed: is the WCS of this field, \
                     and does the catalogue reach it (`{} --force` gets one that does)?",
                exposure.name,
                brightest.len(),
                detected.len(),
                stars.pointing_err_arcsec,
                night.config.fetch_line("stars")
            ),
        },
    )?;
    let seeing_px = seeing_px.filter(|_| p.aper_correction);
    let growth = seeing_px.and_then(|seeing_px| frame_growth(&frame, &sky, &sources, seeing_px, p.clip_sigma));
    let radii_px = [p.aper_r_fwhm, p.sky_in_fwhm, p.sky_out_fwhm].map(|r| r * fwhm_px);
    let source_places = Places::of(sources.iter().map(|s| (s.x_px, s.y_px)));
    let mut places: Vec<(usize, Option<Nearest>)> = Vec::new();
    let mut positions: Vec<(f64, f64)> = Vec::new();
    for (index, x, y) in predicted {
        let (x, y) = alignment.apply(x, y);
        if !inside(x, y, exposure.size_px) {
            continue;
        }
        let nearest = nearest(&sources, &source_places, x, y, match_px);
        let mut at = (x, y);
        if let Some(found) = &nearest {
            let source = &sources[found.source];
            let bright = source.flux_e > 0.0 && {
                let area = std::f64::consts::PI * radii_px[0].powi(2);
                let noise = (source.flux_e + area * sky.rms(x, y).powi(2)).sqrt();
                source.flux_e / noise > RECENTRE_SNR
            };
            if bright && let Some(centre) = centroid(&frame, &sky, source.x_px, source.y_px, fwhm_px) {
                at = centre;
            }
        }
        places.push((index, nearest));
        positions.push(at);
    }
    let shape = Shape::Circle { r_px: radii_px[0] };
    let stars = neighbours(&sources, &sky, fwhm_px);
    let fluxes = measure_all(&frame, &sky, &positions, shape, (radii_px[1], radii_px[2]), p.clip_sigma, &stars);
    let mut measured = Vec::new();
    let mut claims: Vec<Option<usize>> = Vec::new();
    for (((index, nearest), at), mut flux) in places.into_iter().zip(positions).zip(fluxes) {
        if nearest.as_ref().is_some_and(|n| n.ambiguous) || catalogue.stars[index].ambiguous {
            flux.flags.set(Flags::NEIGHBOUR);
        }
        if field.replaced {
            flux.flags.set(Flags::WCS_REPLACED);
        }
        let star = &catalogue.stars[index];
        let (alt_rad, az_rad) = icrs_to_altaz(&night.site, &night.eop, &time.mid, star.ra_deg, star.dec_deg);
        measured.push(MemberStar {
            index,
            x_px: at.0,
            y_px: at.1,
            flux,
            match_px: nearest.as_ref().map(|n| n.distance_px),
            alt_rad,
            az_rad,
            airmass: airmass(alt_rad, &night.site.atmosphere()),
        });
        claims.push(nearest.map(|n| n.source));
    }
    flag_shared(&mut measured, &claims, catalogue);
    flag_neighbours(&mut measured, catalogue, radii_px[0], fwhm_px);
    measured.sort_by_key(|s| s.index);
    Ok(Member {
        frame: exposure.name.clone(),
        object: exposure.object.clone().unwrap_or_default(),
        mid: time.mid,
        exptime_s: exposure.exptime_s,
        gain: frame.gain.clone(),
        fwhm_px,
        scale_arcsec,
        turn: CameraTurn::of_frame(wcs, alignment.rotation_rad, exposure.size_px),
        radii_px,
        flat: night.flat.is_some(),
        n_detected: sources.len(),
        alignment,
        growth,
        profile: None,
        note: field.note,
        stars: measured,
    })
}

/// How far the light of the detected stars reaches: until a Moffat profile of β = 2.5, one of wide wings, is a
/// tenth of the noise of a pixel, peak (1 + r²/α²)^(−β) = 0.1 σ.
fn neighbours(sources: &[Source], sky: &Background, fwhm_px: f64) -> Vec<Neighbour> {
    let alpha_px = 0.5 * fwhm_px / (2f64.powf(1.0 / WING_BETA) - 1.0).sqrt();
    let reach = |s: &Source| {
        let over = (s.peak_e / (WING_SIGMA * sky.rms(s.x_px, s.y_px))).powf(1.0 / WING_BETA) - 1.0;
        let r_px = alpha_px * over.sqrt();
        r_px.is_finite().then_some(Neighbour { x_px: s.x_px, y_px: s.y_px, r_px })
    };
    sources.iter().filter_map(reach).collect()
}

fn header(path: &Path, keyword: &str, problem: &str) -> Error {
    Error::Header { path: path.into(), keyword: keyword.into(), problem: problem.into() }
}

fn inside(x: f64, y: f64, (nx, ny): (usize, usize)) -> bool {
    x > -0.5 && y > -0.5 && x < nx as f64 - 0.5 && y < ny as f64 - 0.5
}

/// Catalogue stars that may lie in the frame: (index, x, y), brightest first.
fn predict(wcs: &Wcs, catalogue: &Catalogue, (nx, ny): (usize, usize), margin_px: f64) -> Vec<(usize, f64, f64)> {
    let (cx, cy) = ((nx as f64 - 1.0) / 2.0, (ny as f64 - 1.0) / 2.0);
    let (ra_deg, dec_deg) = wcs.pixel_to_sky(cx, cy);
    let radius_deg = (cx.hypot(cy) + margin_px) * wcs.scale_arcsec() / 3600.0 * 1.05;
    let mut stars: Vec<(usize, f64, f64)> = catalogue
        .near(ra_deg, dec_deg, radius_deg)
        .into_iter()
        .filter_map(|index| {
            let star = &catalogue.stars[index];
            let (x, y) = wcs.sky_to_pixel(star.ra_deg, star.dec_deg)?;
            let near = x > -margin_px && y > -margin_px && x < nx as f64 + margin_px && y < ny as f64 + margin_px;
            near.then_some((index, x, y))
        })
        .collect();
    stars.sort_by(|a, b| catalogue.stars[a.0].v_mag.total_cmp(&catalogue.stars[b.0].v_mag).then(a.0.cmp(&b.0)));
    stars
}

/// The detection a catalogue star is taken for.
struct Nearest {
    /// Index of the detection.
    source: usize,
    distance_px: f64,
    /// Whether another detection of comparable light could be the star as well.
    ambiguous: bool,
}

/// Positions \[px\] that can be searched for neighbours.
struct Places(RTree<GeomWithData<[f64; 2], usize>>);

impl Places {
    /// Positions that are not finite are near nothing.
    fn of(positions: impl Iterator<Item = (f64, f64)>) -> Self {
        let finite = positions.enumerate().filter(|(_, (x, y))| x.is_finite() && y.is_finite());
        Self(RTree::bulk_load(finite.map(|(k, (x, y))| GeomWithData::new([x, y], k)).collect()))
    }

    /// Indices of the positions in a square of half-width `reach_px` around a position, edges included, ascending.
    fn around(&self, x: f64, y: f64, reach_px: f64) -> Vec<usize> {
        if !(x.is_finite() && y.is_finite() && reach_px >= 0.0) {
            return Vec::new();
        }
        // a little more, so that rounding loses none: the caller decides
        let reach_px = reach_px + 1e-6;
        let square = AABB::from_corners([x - reach_px, y - reach_px], [x + reach_px, y + reach_px]);
        let mut near: Vec<usize> = self.0.locate_in_envelope(&square).map(|point| point.data).collect();
        near.sort_unstable();
        near
    }
}

/// The nearest detection within `radius_px`; `places` are those of `sources`.
fn nearest(sources: &[Source], places: &Places, x: f64, y: f64, radius_px: f64) -> Option<Nearest> {
    let distance = |s: &Source| (s.x_px - x).hypot(s.y_px - y);
    let mut within = places.around(x, y, radius_px);
    within.retain(|&k| distance(&sources[k]) <= radius_px);
    let source = within.iter().copied().min_by(|&a, &b| distance(&sources[a]).total_cmp(&distance(&sources[b])))?;
    let light = sources[source].flux_e;
    let ambiguous = within.iter().any(|&k| k != source && sources[k].flux_e > AMBIGUOUS_FRAC * light);
    Some(Nearest { source, distance_px: distance(&sources[source]), ambiguous })
}

/// Flags catalogue stars that claim one detection: all of them, but one that is ten times brighter than the rest keeps
/// it. `claims` are the detections of `stars`.
fn flag_shared(stars: &mut [MemberStar], claims: &[Option<usize>], catalogue: &Catalogue) {
    let mut by_source: Vec<(usize, usize)> =
        claims.iter().enumerate().filter_map(|(k, source)| source.map(|s| (s, k))).collect();
    by_source.sort_unstable();
    for group in by_source.chunk_by(|a, b| a.0 == b.0).filter(|g| g.len() > 1) {
        for &(_, k) in group {
            let own = catalogue.stars[stars[k].index].v_mag;
            let rival = |&(_, other): &(usize, usize)| {
                let light = 10f64.powf(-0.4 * (catalogue.stars[stars[other].index].v_mag - own));
                // a rival without a magnitude may be anything
                other != k && !(light <= AMBIGUOUS_FRAC)
            };
            if group.iter().any(rival) {
                stars[k].flux.flags.set(Flags::NEIGHBOUR);
            }
        }
    }
}

/// Flags stars whose aperture holds light of another catalogue star.
///
/// The share of a Gaussian of width σ inside a circle of radius r at distance d is taken as Φ((r − d)/σ), the
/// half-plane limit: an upper limit for d > r, enough to decide.
fn flag_neighbours(stars: &mut [MemberStar], catalogue: &Catalogue, r_px: f64, fwhm_px: f64) {
    let sigma = fwhm_px / crate::base::constants::FWHM_PER_SIGMA;
    let reach = r_px + 4.0 * sigma;
    let places: Vec<(usize, f64, f64)> = stars.iter().map(|s| (s.index, s.x_px, s.y_px)).collect();
    let near = Places::of(places.iter().map(|place| (place.1, place.2)));
    for star in stars.iter_mut() {
        let own = catalogue.stars[star.index].v_mag;
        let light: f64 = near
            .around(star.x_px, star.y_px, reach)
            .into_iter()
            .map(|k| &places[k])
            .filter(|(index, x, y)| {
                *index != star.index && (x - star.x_px).abs() < reach && (y - star.y_px).abs() < reach
            })
            .map(|(index, x, y)| {
                let d = (x - star.x_px).hypot(y - star.y_px);
                let share = 0.5 * statrs::function::erf::erfc((d - r_px) / sigma / std::f64::consts::SQRT_2);
                share * 10f64.powf(-0.4 * (catalogue.stars[*index].v_mag - own))
            })
            .sum();
        if light * star.flux.flux_e.abs() > NEIGHBOUR_SIGMA * star.flux.flux_err_e {
            star.flux.flags.set(Flags::NEIGHBOUR);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn those_around_a_place_are_those_of_a_search_through_all() {
        // a lattice with a few that are nowhere; squares whose edges run through its points
        let all: Vec<(f64, f64)> = (0..900)
            .map(|k| (f64::from(k % 30), f64::from(k / 30)))
            .map(|(x, y)| if (x, y) == (7.0, 7.0) { (f64::NAN, y) } else { (x, y) })
            .collect();
        let places = Places::of(all.iter().copied());
        for (x, y, reach) in [(3.0, 4.0, 2.0), (7.3, 6.9, 5.25), (-2.0, 31.0, 2.0), (15.0, 15.0, 0.0), (50.0, 3.0, 9.0)]
        {
            let within = |k: &usize| (all[*k].0 - x).abs() <= reach && (all[*k].1 - y).abs() <= reach;
            let plain: Vec<usize> = (0..all.len()).filter(within).collect();
            assert_eq!(places.around(x, y, reach), plain, "{x} {y} {reach}");
        }
        assert!(places.around(f64::NAN, 1.0, 5.0).is_empty());
    }
}
