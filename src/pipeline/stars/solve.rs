//! The world coordinates of a star frame: its header's where they fit the sky, else those found by matching the catalogue.
//!
//! A header is trusted when its predictions align with the detections better than chance, within
//! `stars.pointing_err_arcsec`. Otherwise the field is solved from every approximate position in turn, with the scale
//! of the optics. It does not cover what a solved frame is measured with.

use std::path::Path;

use crate::astrometry::align::align;
use crate::astrometry::catalogue::{Catalogue, separation_deg};
use crate::astrometry::initial_pointing::{InitialPointing, initial_pointings};
use crate::astrometry::plate;
use crate::astrometry::plate::{Detection, Hint, SkyStar, Solution};
use crate::astrometry::wcs::Wcs;
use crate::base::error::{Error, Result};
use crate::config::{Solve, Stars};
use crate::frames::Exposure;
use crate::photometry::detect::Source;
use crate::pipeline::prepared::Prepared;

/// The world coordinates of a star frame.
#[derive(Debug, Clone)]
pub struct FieldWcs {
    /// The coordinates.
    pub wcs: Wcs,
    /// Whether the header's were absent or wrong.
    pub replaced: bool,
    /// Notes for the observer: why the header's were replaced, residuals of the match.
    pub note: String,
}

/// Brightest stars and detections that check a header.
const N_CHECK: usize = 300;
/// Share of the stars that could match below which a header is questioned although it aligns.
const DOUBTED_SHARE: f64 = 0.5;
/// A solution replaces a questioned header when it matches this many times as many stars.
const CLEARLY_MORE: f64 = 1.3;
/// A header whose scale or rotation is off by what [`align`] can take up at most fits somewhere in the frame only; a
/// solution replaces it when it matches this many times as many stars.
const ABOUT_AS_MANY: f64 = 0.7;
/// Scale and rotation \[rad\] beyond which the alignment is at its limits, 1 % and 6°.
const LIMITS: (f64, f64) = (0.009, 0.1);

/// The world coordinates of a star frame with detections `sources`, brightest first.
///
/// `stars.solve` = `auto`: the header's if they fit, else a solution; a header that fits less than half of the stars gives
/// way to a solution that fits clearly more. `never`: the header's or nothing. `always`: a solution; the header's place is
/// still a hint. A solution that confirms the header refines it; only where it does not are they `replaced`, with a note.
///
/// # Errors
/// [`Error::Header`] if there are no usable world coordinates, with all attempts and a remedy.
pub fn field_wcs(
    exposure: &Exposure,
    sources: &[Source],
    prepared: &Prepared,
    catalogue: &Catalogue,
) -> Result<FieldWcs> {
    let header = header_wcs(exposure);
    let Some(stars) = &prepared.config.stars else {
        let problem = "no TAN world coordinates, and no [stars] catalogue to find them with".to_owned();
        let wcs = header.map_err(|p| error(&exposure.path, p))?.ok_or_else(|| error(&exposure.path, problem))?;
        return Ok(FieldWcs { wcs, replaced: false, note: String::new() });
    };
    let fits = match &header {
        Ok(Some(wcs)) => {
            agreement(wcs, sources, (exposure.size_px, prepared.config.photometry.clip_radius_px), stars, catalogue)
        }
        _ => None,
    };
    let why = match (&header, &fits) {
        (Err(problem), _) => problem.clone(),
        (Ok(None), _) => "no world coordinates in the header".into(),
        (Ok(Some(_)), None) => format!(
            "header WCS does not fit the sky (no match within {} arcsec, stars.pointing_err_arcsec)",
            stars.pointing_err_arcsec
        ),
        (Ok(Some(_)), Some(fit)) if fit.at_limit => "header WCS is off in scale or rotation".into(),
        (Ok(Some(_)), Some(fit)) => {
            format!("header WCS fits {} of {} stars only", fit.matched, fit.possible)
        }
    };
    let wcs = header.as_ref().ok().and_then(Option::as_ref);
    let trusted = wcs.zip(fits.as_ref());
    match (stars.solve, trusted) {
        (Solve::Never, Some((wcs, fit))) if !fit.at_limit => Ok(kept(wcs)),
        (Solve::Never, _) => Err(error(
            &exposure.path,
            format!(
                "{why}; stars.solve = \"never\" forbids to solve the frame: set it to \"auto\", or solve it before (`solve`)"
            ),
        )),
        (Solve::Auto, Some((wcs, fit))) if !fit.doubted() => Ok(kept(wcs)),
        (Solve::Auto, Some((wcs, fit))) => match solved(exposure, sources, prepared, stars, catalogue, Some(wcs)) {
            Ok((s, from)) if s.pairs.len() as f64 > fit.yields_to() => {
                Ok(found(&s, &why, &from, (Some(wcs), exposure.size_px, stars)))
            }
            // nothing better was found: few stars are what there is
            _ => Ok(kept(wcs)),
        },
        (Solve::Auto, None) | (Solve::Always, _) => {
            let why = if stars.solve == Solve::Always { "stars.solve = \"always\"" } else { &why };
            solved(exposure, sources, prepared, stars, catalogue, wcs)
                .map(|(s, from)| found(&s, why, &from, (wcs, exposure.size_px, stars)))
                .map_err(|tried| error(&exposure.path, format!("{why}, and no solution: {tried}")))
        }
    }
}

fn kept(wcs: &Wcs) -> FieldWcs {
    FieldWcs { wcs: wcs.clone(), replaced: false, note: String::new() }
}

/// The coordinates of a solution. Those of a header it confirms are refined, not replaced: they were right, as far as a
/// header is ever trusted.
fn found(
    solution: &Solution,
    why: &str,
    from: &str,
    (header, size_px, stars): (Option<&Wcs>, (usize, usize), &Stars),
) -> FieldWcs {
    if header.is_some_and(|header| confirms(solution, header, size_px, stars)) {
        return FieldWcs { wcs: solution.wcs.clone(), replaced: false, note: String::new() };
    }
    let parity = if solution.mirrored { ", mirrored" } else { "" };
    let note = format!(
        "{why}: replaced, {} stars, rms {:.2} arcsec, {:.4} arcsec/px{parity}, chance {:.0e} (from {from})",
        solution.pairs.len(),
        solution.rms_arcsec,
        solution.scale_arcsec,
        solution.chance
    );
    FieldWcs { wcs: solution.wcs.clone(), replaced: true, note }
}

/// Whether a solution confirms the coordinates of a header: the frame's centre within
/// `stars.pointing_err_arcsec`, parity the same, scale and rotation within what an alignment takes up.
pub(crate) fn confirms(solution: &Solution, header: &Wcs, (nx, ny): (usize, usize), stars: &Stars) -> bool {
    let (x, y) = ((nx as f64 - 1.0) / 2.0, (ny as f64 - 1.0) / 2.0);
    let (stated, solved) = (header.pixel_to_sky(x, y), solution.wcs.pixel_to_sky(x, y));
    let off_arcsec = separation_deg(stated.0, stated.1, solved.0, solved.1) * 3600.0;
    let turn_deg = (header.rotation_deg() - solution.wcs.rotation_deg()).rem_euclid(360.0);
    off_arcsec <= stars.pointing_err_arcsec
        && header.mirrored() == solution.wcs.mirrored()
        && (header.scale_arcsec() / solution.wcs.scale_arcsec() - 1.0).abs() <= LIMITS.0
        && turn_deg.min(360.0 - turn_deg).to_radians() <= LIMITS.1
}

fn error(path: &Path, problem: String) -> Error {
    Error::Header { path: path.into(), keyword: "CTYPE1/CD1_1".into(), problem }
}

/// The WCS of an exposure's header; `Ok(None)` if it has none.
pub(crate) fn header_wcs(exposure: &Exposure) -> std::result::Result<Option<Wcs>, String> {
    Wcs::of_header(&exposure.header)
}

/// How well the coordinates of a header fit.
pub(crate) struct Agreement {
    /// Stars that matched.
    pub matched: usize,
    /// Stars that could have matched: the fewer of those expected on the frame and those detected.
    pub possible: usize,
    /// Scale of the stars \[arcsec/px\].
    pub scale_arcsec: f64,
    /// Whether scale or rotation are off by the most that can be taken up.
    at_limit: bool,
}

impl Agreement {
    /// Whether scale or rotation are off by the most that can be taken up.
    pub fn at_limit(&self) -> bool {
        self.at_limit
    }
    /// Whether fewer stars match than a right header's would.
    pub fn doubted(&self) -> bool {
        self.at_limit || (self.matched as f64) < DOUBTED_SHARE * self.possible as f64
    }
    /// Number of stars that a solution must exceed to be used instead.
    fn yields_to(&self) -> f64 {
        self.matched as f64 * if self.at_limit { ABOUT_AS_MANY } else { CLEARLY_MORE }
    }
}

/// Whether the catalogue, placed by `wcs`, aligns with the detections better than chance. Detections lie in the part of the
/// frame that is used: its size and photometry.clip_radius_px.
pub(crate) fn agreement(
    wcs: &Wcs,
    sources: &[Source],
    ((nx, ny), clip_radius_px): ((usize, usize), Option<f64>),
    stars: &Stars,
    catalogue: &Catalogue,
) -> Option<Agreement> {
    let scale = wcs.scale_arcsec();
    let margin = stars.pointing_err_arcsec / scale;
    let (cx, cy) = ((nx as f64 - 1.0) / 2.0, (ny as f64 - 1.0) / 2.0);
    let (ra_deg, dec_deg) = wcs.pixel_to_sky(cx, cy);
    let clip = clip_radius_px.unwrap_or(f64::INFINITY);
    let radius_deg = (cx.hypot(cy).min(clip) + margin) * scale / 3600.0 * 1.05;
    let inside = |x: f64, y: f64, m: f64| {
        let in_frame = x > -m && y > -m && x < nx as f64 + m && y < ny as f64 + m;
        in_frame && (x - cx).hypot(y - cy) < clip + m
    };
    let predicted: Vec<(f64, f64)> = catalogue
        .near(ra_deg, dec_deg, radius_deg.min(90.0))
        .into_iter()
        .filter_map(|i| wcs.sky_to_pixel(catalogue.stars[i].ra_deg, catalogue.stars[i].dec_deg))
        .filter(|p| inside(p.0, p.1, margin))
        .take(N_CHECK)
        .collect();
    let detected: Vec<(f64, f64)> = sources.iter().take(N_CHECK).map(|s| (s.x_px, s.y_px)).collect();
    let fit = align(&predicted, &detected, margin, stars.match_radius_arcsec / scale)?;
    let expected = predicted.iter().map(|p| fit.apply(p.0, p.1)).filter(|p| inside(p.0, p.1, 0.0)).count();
    let at_limit = (fit.scale - 1.0).abs() > LIMITS.0 || fit.rotation_rad.abs() > LIMITS.1;
    // places on the frame that lie further apart mean a finer scale
    let scale_arcsec = scale / fit.scale;
    Some(Agreement { matched: fit.n, possible: expected.min(detected.len()), scale_arcsec, at_limit })
}

/// A solution and the position it started from, or everything that was tried.
fn solved(
    exposure: &Exposure,
    sources: &[Source],
    prepared: &Prepared,
    stars: &Stars,
    catalogue: &Catalogue,
    wcs: Option<&Wcs>,
) -> std::result::Result<(Solution, String), String> {
    let field = exposure.object.as_ref().and_then(|name| Some((name.as_str(), *stars.fields.get(name)?)));
    let positions =
        initial_pointings(exposure, field, wcs, Some((&prepared.site, &prepared.eop)), &prepared.config.header.aliases);
    let scale_arcsec = prepared.scale_arcsec(exposure);
    let search = Search {
        radius_deg: stars.solve_radius_deg,
        scale_arcsec,
        scale_search_frac: stars.scale_search_frac,
        mirrored: None,
    };
    let object = exposure.object.as_deref().unwrap_or("OBJECT");
    if positions.is_empty() {
        return Err(format!(
            "neither OBJCTRA/OBJCTDEC, RA/DEC, CRVAL1/CRVAL2 nor CENTALT/CENTAZ says where the frame points; \
             give stars.fields = {{ \"{object}\" = [RA, Dec] }} in degrees"
        ));
    }
    solve_from(&positions, sources, exposure.size_px, &catalogue_stars(catalogue), search).map_err(|tried| {
        format!(
            "{tried}; the scale of the optics is {scale_arcsec:.3} arcsec/px +- {:.0} % (detector.pixel_um, binning, \
             telescope.focal_length_mm, stars.scale_search_frac): is it right, does the catalogue cover the field, and \
             does the frame point within stars.solve_radius_deg? Or give stars.fields = {{ \"{object}\" = [RA, Dec] }}",
            100.0 * stars.scale_search_frac
        )
    })
}

/// The inputs of a search from an approximate position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// How far the frame may be from the approximate position \[deg\].
    pub radius_deg: f64,
    /// Pixel scale \[arcsec/px\].
    pub scale_arcsec: f64,
    /// How far the scale may be off, as a share.
    pub scale_search_frac: f64,
    /// Whether the sky is mirrored on the frame; `None` = either.
    pub mirrored: Option<bool>,
}

/// The three numbers of every catalogue star that matching needs.
#[must_use]
pub fn catalogue_stars(catalogue: &Catalogue) -> Vec<SkyStar> {
    catalogue.stars.iter().map(|s| SkyStar { ra_deg: s.ra_deg, dec_deg: s.dec_deg, v_mag: s.v_mag }).collect()
}

/// Solves from one approximate position after the other; those close to one that failed are not tried again.
///
/// # Errors
/// What was tried and why it failed.
pub fn solve_from(
    positions: &[InitialPointing],
    sources: &[Source],
    size_px: (usize, usize),
    stars: &[SkyStar],
    search: Search,
) -> std::result::Result<(Solution, String), String> {
    solve_from_with(positions, sources, size_px, stars, (search, plate::Effort::default()))
}

/// As [`solve_from`], with another effort.
pub(crate) fn solve_from_with(
    positions: &[InitialPointing],
    sources: &[Source],
    size_px: (usize, usize),
    stars: &[SkyStar],
    (search, effort): (Search, plate::Effort),
) -> std::result::Result<(Solution, String), String> {
    let detections = starlike(sources);
    let mut tried: Vec<(&InitialPointing, String)> = Vec::new();
    for position in positions {
        let near = |(other, _): &(&InitialPointing, String)| {
            separation_deg(position.ra_deg, position.dec_deg, other.ra_deg, other.dec_deg) < 0.3 * search.radius_deg
        };
        if tried.iter().any(near) {
            continue;
        }
        let hint = Hint {
            ra_deg: position.ra_deg,
            dec_deg: position.dec_deg,
            radius_deg: search.radius_deg,
            scale_arcsec: search.scale_arcsec,
            scale_search_frac: search.scale_search_frac,
            mirrored: search.mirrored,
        };
        match plate::solve_with(stars, &detections, size_px, &hint, effort) {
            Ok(solution) => return Ok((solution, position.source.clone())),
            Err(refusal) => tried.push((position, refusal.to_string())),
        }
    }
    let attempts: Vec<String> = tried
        .iter()
        .map(|(p, why)| format!("from {} ({:.4} {:+.4} deg): {why}", p.source, p.ra_deg, p.dec_deg))
        .collect();
    Err(attempts.join("; "))
}

/// Detections that may be stars: without hot pixels and trails, but with saturated and elongated stars.
#[must_use]
pub fn starlike(sources: &[Source]) -> Vec<Detection> {
    let mut widths: Vec<f64> = sources.iter().take(N_CHECK).map(|s| s.a_px).collect();
    widths.sort_by(f64::total_cmp);
    let typical = widths.get(widths.len() / 2).copied().unwrap_or(1.0);
    // a single pixel has σ = 0.29; the width of a bright, saturated star may be several times the typical one
    let hot = |s: &Source| s.a_px < 0.35 || s.npix < 2;
    let trail = |s: &Source| s.a_px > 8.0 * s.b_px && s.a_px > 4.0 * typical;
    sources
        .iter()
        .filter(|s| !hot(s) && !trail(s))
        .map(|s| Detection { x_px: s.x_px, y_px: s.y_px, flux: s.flux_e })
        .collect()
}
