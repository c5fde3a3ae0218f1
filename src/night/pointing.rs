//! Star pointings: every member measured in its own pixels at the aligned catalogue positions, then combined.
//!
//! deviates: Caddy et al. take the median of the members' pixels; here the median is taken of each star's electrons
//! per second. The alignment (shift and rotation) is the same, but nothing is resampled, so the noise stays white,
//! members of different gain, exposure or seeing do not bias the star, and only one frame is in memory.

use std::path::Path;

use hifitime::Epoch;

use crate::error::{Error, Result};
use crate::frames::{Exposure, Gain};
use crate::night::bench::Bench;
use crate::night::clock::{iso_utc, mjd_utc};
use crate::orbit::{airmass::airmass, icrs_to_altaz};
use crate::photometry::Flags;
use crate::photometry::align::{Alignment, align};
use crate::photometry::aperture::Shape;
use crate::photometry::background::background;
use crate::photometry::catalogue::Catalogue;
use crate::photometry::centroid::centroid;
use crate::photometry::detect::{Source, detect, stellar_fwhm};
use crate::photometry::flux::{Flux, measure};
use crate::photometry::stats::{median, median_variance_factor};
use crate::photometry::wcs::Wcs;
use crate::report::StarRow;

/// Stars brighter than this many σ are recentred; fainter ones are measured where the alignment puts them, because a
/// centroid in the noise climbs onto the noise and makes the star too bright.
const RECENTRE_SNR: f64 = 25.0;
/// A neighbour that adds more than this share of a star's own error taints it.
const NEIGHBOUR_SIGMA: f64 = 0.3;
/// Brightest objects used for the alignment.
const N_ALIGN: usize = 300;

/// One star in one member frame.
#[derive(Debug, Clone)]
pub struct MemberStar {
    /// Index in the catalogue.
    pub index: usize,
    /// Position \[px\].
    pub x_px: f64,
    /// Position \[px\].
    pub y_px: f64,
    /// The measurement.
    pub flux: Flux,
    /// Distance of the detection from the aligned catalogue position \[px\]; `None` = not detected.
    pub match_px: Option<f64>,
    /// Altitude \[rad\].
    pub alt_rad: f64,
    /// Azimuth \[rad\].
    pub az_rad: f64,
    /// Airmass.
    pub airmass: Option<f64>,
}

/// One member frame with its stars.
#[derive(Debug, Clone)]
pub struct Member {
    /// File name.
    pub frame: String,
    /// OBJECT.
    pub object: String,
    /// Mid-exposure.
    pub mid: Epoch,
    /// Exposure time \[s\].
    pub exptime_s: f64,
    /// The detector at this frame's gain.
    pub gain: Gain,
    /// FWHM of the stars \[px\].
    pub fwhm_px: f64,
    /// Pixel scale \[arcsec/px\].
    pub scale_arcsec: f64,
    /// Radii of aperture and annulus \[px\].
    pub radii_px: [f64; 3],
    /// Whether a flat was applied.
    pub flat: bool,
    /// Detections in the frame.
    pub n_detected: usize,
    /// The alignment of the catalogue to the frame.
    pub alignment: Alignment,
    /// Its stars, in the order of the catalogue.
    pub stars: Vec<MemberStar>,
}

/// Measures every catalogue star of one star frame.
///
/// # Errors
/// What is wrong with the frame: no WCS, no star detected, no match with the catalogue, no usable pixel.
pub fn measure_member(exposure: &Exposure, bench: &Bench, catalogue: &Catalogue) -> Result<Member> {
    let path = exposure.path.as_path();
    let Some(stars) = &bench.config.stars else {
        return Err(Error::Config { key: "stars".into(), problem: "is needed to measure star pointings".into() });
    };
    let time = exposure.time.as_ref().ok_or_else(|| header(path, "DATE-OBS", "no mid-exposure time"))?;
    let wcs = wcs_of(exposure)?;
    let p = &bench.config.photometry;
    let frame = bench.reduce(exposure)?;
    let sky = background(&frame, p.mesh_px, p.clip_sigma)?;
    let sources = detect(&frame, &sky, p.detect_sigma, p.fwhm_px);
    let fwhm_px = match p.fwhm_px.or_else(|| stellar_fwhm(&frame, &sky, &sources)) {
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
    let scale_arcsec = wcs.scale_arcsec();
    let predicted = predict(&wcs, catalogue, exposure.size_px, stars.pointing_err_arcsec / scale_arcsec);
    let detected: Vec<(f64, f64)> = sources.iter().take(N_ALIGN).map(|s| (s.x_px, s.y_px)).collect();
    let brightest: Vec<(f64, f64)> = predicted.iter().take(N_ALIGN).map(|s| (s.1, s.2)).collect();
    let match_px = stars.match_radius_arcsec / scale_arcsec;
    let alignment = align(&brightest, &detected, stars.pointing_err_arcsec / scale_arcsec, match_px).ok_or_else(
        || Error::Catalogue {
            path: stars.catalogue.clone(),
            problem: format!(
                "{}: {} catalogue stars expected, {} detected, no match within {} arcsec (stars.pointing_err_arcsec) \
                     and 6 deg of the header's pointing; at least 3 common stars are needed: is the WCS of this field, \
                     and does the catalogue reach it?",
                exposure.name,
                brightest.len(),
                detected.len(),
                stars.pointing_err_arcsec
            ),
        },
    )?;
    let radii_px = [p.aper_r_fwhm, p.sky_in_fwhm, p.sky_out_fwhm].map(|r| r * fwhm_px);
    let mut measured = Vec::new();
    for (index, x, y) in predicted {
        let (x, y) = alignment.apply(x, y);
        if !inside(x, y, exposure.size_px) {
            continue;
        }
        let nearest = nearest(&sources, x, y, match_px);
        let mut at = (x, y);
        if let Some((source, _)) = nearest {
            let bright = source.flux_e > 0.0 && {
                let area = std::f64::consts::PI * radii_px[0].powi(2);
                let noise = (source.flux_e + area * sky.rms(x, y).powi(2)).sqrt();
                source.flux_e / noise > RECENTRE_SNR
            };
            if bright && let Some(centre) = centroid(&frame, &sky, source.x_px, source.y_px, fwhm_px) {
                at = centre;
            }
        }
        let shape = Shape::Circle { r_px: radii_px[0] };
        let flux = measure(&frame, &sky, at.0, at.1, shape, radii_px[1], radii_px[2], p.clip_sigma);
        let star = &catalogue.stars[index];
        let (alt_rad, az_rad) = icrs_to_altaz(&bench.site, &bench.eop, &time.mid, star.ra_deg, star.dec_deg);
        measured.push(MemberStar {
            index,
            x_px: at.0,
            y_px: at.1,
            flux,
            match_px: nearest.map(|n| n.1),
            alt_rad,
            az_rad,
            airmass: airmass(alt_rad),
        });
    }
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
        radii_px,
        flat: bench.flat.is_some(),
        n_detected: sources.len(),
        alignment,
        stars: measured,
    })
}

/// The WCS of an exposure's header.
fn wcs_of(exposure: &Exposure) -> Result<Wcs> {
    let h = &exposure.header;
    let wcs = Wcs::from_keys(&|key| h.number(key), &|key| h.text(key))
        .map_err(|problem| header(&exposure.path, "CTYPE1/CD1_1", &problem))?;
    wcs.ok_or_else(|| {
        header(
            &exposure.path,
            "CTYPE1",
            "no TAN world coordinates; plate-solve the star pointings first (e.g. astrometry.net)",
        )
    })
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

/// The nearest detection within `radius_px`, with its distance.
fn nearest(sources: &[Source], x: f64, y: f64, radius_px: f64) -> Option<(&Source, f64)> {
    sources
        .iter()
        .map(|s| (s, (s.x_px - x).hypot(s.y_px - y)))
        .filter(|(_, d)| *d <= radius_px)
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Flags stars whose aperture holds light of another catalogue star.
///
/// The share of a Gaussian of width σ inside a circle of radius r at distance d is taken as Φ((r − d)/σ), the
/// half-plane limit: an upper limit for d > r, enough to decide.
fn flag_neighbours(stars: &mut [MemberStar], catalogue: &Catalogue, r_px: f64, fwhm_px: f64) {
    let sigma = fwhm_px / crate::constants::FWHM_PER_SIGMA;
    let reach = r_px + 4.0 * sigma;
    let places: Vec<(usize, f64, f64)> = stars.iter().map(|s| (s.index, s.x_px, s.y_px)).collect();
    for star in stars.iter_mut() {
        let own = catalogue.stars[star.index].v_mag;
        let light: f64 = places
            .iter()
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

/// One row per star of a single member.
#[must_use]
pub fn single_rows(member: &Member, pointing: usize, catalogue: &Catalogue) -> Vec<StarRow> {
    member
        .stars
        .iter()
        .map(|star| {
            let rate = (star.flux.flux_e / member.exptime_s, star.flux.flux_err_e / member.exptime_s);
            row(pointing, &[member], &[star], rate, catalogue)
        })
        .collect()
}

/// One row per star of a pointing: the median of the members' electrons per second.
///
/// Var(median) = c(n) n / (Σ 1/σᵢ)², c(n) the variance of the median of n Gaussians relative to their mean (→ π/2);
/// for equal σ this is c(n) σ²/n. Flags of all members are kept, so a star saturated in one member is flagged.
/// Stars missing in more than half of the members are left out.
#[must_use]
pub fn combined_rows(members: &[Member], pointing: usize, catalogue: &Catalogue) -> Vec<StarRow> {
    let mut indices: Vec<usize> = members.iter().flat_map(|m| m.stars.iter().map(|s| s.index)).collect();
    indices.sort_unstable();
    indices.dedup();
    indices
        .into_iter()
        .filter_map(|index| {
            let found: Vec<(usize, &MemberStar)> = members
                .iter()
                .enumerate()
                .filter_map(|(k, m)| {
                    let at = m.stars.binary_search_by_key(&index, |s| s.index).ok()?;
                    m.stars[at].flux.flux_e.is_finite().then_some((k, &m.stars[at]))
                })
                .collect();
            if 2 * found.len() < members.len() || found.is_empty() {
                return None;
            }
            let used: Vec<&Member> = found.iter().map(|(k, _)| &members[*k]).collect();
            let stars: Vec<&MemberStar> = found.iter().map(|(_, s)| *s).collect();
            let mut rates: Vec<f64> = used.iter().zip(&stars).map(|(m, s)| s.flux.flux_e / m.exptime_s).collect();
            let inverse: f64 = used.iter().zip(&stars).map(|(m, s)| m.exptime_s / s.flux.flux_err_e).sum();
            let n = rates.len();
            let rate = median(&mut rates)?;
            let err = (median_variance_factor(n) * n as f64).sqrt() / inverse;
            Some(row(pointing, &used, &stars, (rate, err), catalogue))
        })
        .collect()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
    sum / n.max(1) as f64
}

/// The row of a star measured in `members` at `rate` (value, error) \[e⁻/s\].
fn row(
    pointing: usize,
    members: &[&Member],
    stars: &[&MemberStar],
    rate: (f64, f64),
    catalogue: &Catalogue,
) -> StarRow {
    let (first, entry) = (members[0], &catalogue.stars[stars[0].index]);
    let exptime_s = mean(members.iter().map(|m| m.exptime_s));
    let t0 = first.mid;
    let mid = t0 + hifitime::Unit::Second * mean(members.iter().map(|m| (m.mid - t0).to_seconds()));
    let mut flags = stars.iter().fold(Flags::default(), |f, s| f | s.flux.flags);
    if members.iter().any(|m| !m.flat) {
        flags.set(Flags::NO_FLAT);
    }
    let airmasses: Option<Vec<f64>> = stars.iter().map(|s| s.airmass).collect();
    let same = |f: fn(&Member) -> f64| members.iter().all(|m| f(m) == f(first)).then(|| f(first));
    let positive = rate.0 > 0.0 && rate.0.is_finite();
    let match_px: Vec<f64> = stars.iter().filter_map(|s| s.match_px).collect();
    let detected = 2 * match_px.len() > stars.len() || (match_px.len() == stars.len());
    let full_well = |m: &Member, s: &MemberStar| {
        let well_e = (m.gain.saturation_adu - m.gain.pedestal_adu) * m.gain.e_per_adu.0;
        s.flux.peak_e / well_e
    };
    let peak = members.iter().zip(stars).map(|(m, s)| full_well(m, s)).filter(|p| p.is_finite()).fold(0.0, f64::max);
    StarRow {
        frame: first.frame.clone(),
        n_members: Some(members.len() as i64),
        pointing: Some(pointing as i64),
        object_name: first.object.clone(),
        star_id: entry.id.clone(),
        ra_deg: Some(entry.ra_deg),
        dec_deg: Some(entry.dec_deg),
        date_mid: iso_utc(mid, 6),
        mjd_mid_d: Some(mjd_utc(mid)),
        exptime_s: Some(exptime_s),
        gain_setting: members
            .iter()
            .all(|m| m.gain.setting == first.gain.setting)
            .then_some(first.gain.setting)
            .flatten()
            .map(|g| g.0),
        e_per_adu: same(|m| m.gain.e_per_adu.0),
        x_px: Some(stars[0].x_px),
        y_px: Some(stars[0].y_px),
        aper_r_px: Some(mean(members.iter().map(|m| m.radii_px[0]))),
        sky_in_px: Some(mean(members.iter().map(|m| m.radii_px[1]))),
        sky_out_px: Some(mean(members.iter().map(|m| m.radii_px[2]))),
        fwhm_px: Some(mean(members.iter().map(|m| m.fwhm_px))),
        flux_e: Some(rate.0 * exptime_s).filter(|f| f.is_finite()),
        flux_err_e: Some(rate.1 * exptime_s).filter(|f| f.is_finite()),
        sky_e_px: Some(mean(stars.iter().map(|s| s.flux.sky_e_px))).filter(|f| f.is_finite()),
        snr: Some(rate.0 / rate.1).filter(|f| f.is_finite()),
        peak_frac_sat: Some(peak),
        inst_mag: positive.then(|| -2.5 * rate.0.log10()),
        inst_mag_err: positive.then(|| crate::constants::MAG_PER_LN * rate.1 / rate.0),
        alt_deg: Some(mean(stars.iter().map(|s| s.alt_rad)).to_degrees()),
        az_deg: Some(stars[0].az_rad.to_degrees()),
        airmass: airmasses.map(|a| mean(a.into_iter())),
        catalogue_v_mag: Some(entry.v_mag),
        catalogue_v_mag_err: entry.v_err_mag,
        catalogue_b_v_mag: entry.b_v_mag,
        catalogue_b_v_mag_err: entry.b_v_err_mag,
        match_arcsec: detected.then(|| mean(match_px.iter().copied()) * first.scale_arcsec),
        flags: flags.0,
        ..StarRow::default()
    }
}
