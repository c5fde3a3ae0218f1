//! Whether the world coordinates of a header can be trusted: by themselves, by the header's own pointing, by the stars.
//!
//! Degrees. A system that cannot be right is refused with the remedy; the frame can still be measured by pixel position.

use super::inspector::Inspector;
use crate::astrometry::catalogue::{Catalogue, separation_deg};
use crate::astrometry::initial_pointing::{InitialPointing, initial_pointings};
use crate::astrometry::wcs::Wcs;
use crate::config::Stars;
use crate::fits::Header;
use crate::frames::header::Sourced;
use crate::frames::{Exposure, pixel_scale_arcsec};
use crate::orbit::{EarthOrientation, Site};
use crate::pipeline::inspect::record::InspectedWcs;
use crate::pipeline::stars::solve::{Search, agreement, catalogue_stars, confirms, solve_from};
use crate::pipeline::stars::solve_file::detections;
use crate::pipeline::survey::scale::configured_arcsec;

/// What to do about coordinates that cannot be used.
const REMEDY: &str =
    "`solve` finds the place on the sky; without it the frame can be measured by pixel position (target.x_px, y_px)";
/// How far a mount's pointing may be off the field \[deg\].
const POINTING_DEG: f64 = 0.25;
/// A pointing this near to CRVAL is the reference point itself, of a mosaic or a crop \[deg\].
const REFERENCE_DEG: f64 = 0.02;
/// Share by which the scale of coordinates and optics may differ.
const SCALE_FRAC: f64 = 0.2;

/// The problem and its remedy.
fn with_remedy(problem: &str) -> String {
    format!("{problem}; {REMEDY}")
}

fn header_wcs(exposure: &Exposure) -> Result<Option<Wcs>, String> {
    Wcs::of_header(&exposure.header)
}

/// Every approximate position of the frame.
pub(crate) fn positions(inspector: &Inspector, exposure: &Exposure) -> Vec<InitialPointing> {
    let config = &inspector.config;
    let field = exposure.object.as_ref().zip(config.stars.as_ref());
    let field = field.and_then(|(name, stars)| Some((name.as_str(), *stars.fields.get(name)?)));
    let site = Site::from_config(&config.site).ok().filter(|_| inspector.configured());
    let eop = EarthOrientation::default();
    let site = site.as_ref().map(|s| (s, &eop));
    initial_pointings(exposure, field, None, site, &config.header.aliases)
}

/// The state of the world coordinates; `image`: the pixels can be read.
pub(crate) fn inspected_wcs(
    inspector: &Inspector,
    exposure: &Exposure,
    scale: Option<&Sourced<f64>>,
    image: bool,
) -> InspectedWcs {
    let mut inspected = InspectedWcs {
        state: "none",
        ra_deg: None,
        dec_deg: None,
        scale_arcsec: None,
        rotation_deg: None,
        mirrored: None,
        distorted: None,
        note: REMEDY.into(),
    };
    let wcs = match header_wcs(exposure) {
        Ok(Some(wcs)) => wcs,
        Ok(None) => return inspected,
        Err(problem) => {
            (inspected.state, inspected.note) = ("refused", with_remedy(&problem));
            return inspected;
        }
    };
    let (nx, ny) = exposure.size_px;
    if nx > 0 && ny > 0 {
        let (ra_deg, dec_deg) = wcs.pixel_to_sky((nx as f64 - 1.0) / 2.0, (ny as f64 - 1.0) / 2.0);
        (inspected.ra_deg, inspected.dec_deg) = (Some(ra_deg), Some(dec_deg));
    }
    inspected.scale_arcsec = Some(wcs.scale_arcsec());
    inspected.rotation_deg = Some(wcs.rotation_deg());
    inspected.mirrored = Some(wcs.mirrored());
    inspected.distorted = Some(wcs.is_distorted());
    (inspected.state, inspected.note) = match contradiction(inspector, exposure, &wcs, scale) {
        Some(problem) => ("refused", with_remedy(&problem)),
        None => ("read", "not checked against stars".into()),
    };
    if image
        && let (Some(stars), Some(catalogue)) = (&inspector.config.stars, &inspector.catalogue)
        && let Some((state, note)) = by_stars(inspector, exposure, &wcs, stars, catalogue)
    {
        (inspected.state, inspected.note) = (state, note);
    }
    if exposure.header.text("REFSPLIN").is_some_and(|v| v == "T") {
        inspected.note += "; PixInsight's spline of the distortion is not read";
    }
    inspected
}

/// What in the header itself contradicts its world coordinates.
fn contradiction(
    inspector: &Inspector,
    exposure: &Exposure,
    wcs: &Wcs,
    scale: Option<&Sourced<f64>>,
) -> Option<String> {
    let (config, header) = (&inspector.config, &exposure.header);
    let own = config.detector.pixel_um;
    let optics = if inspector.configured() {
        let scale = pixel_scale_arcsec(own, exposure.binning, config.telescope.focal_length_mm);
        Some((scale, "the configured optics".to_string()))
    } else {
        scale.map(|s| (s.value, s.source.clone()))
    };
    if let Some((expected, source)) = optics.filter(|(s, _)| (wcs.scale_arcsec() / s - 1.0).abs() > SCALE_FRAC) {
        return Some(format!("{:.3} arcsec/px, but {expected:.3} by {source}", wcs.scale_arcsec()));
    }
    let (nx, ny) = (exposure.size_px.0 as f64, exposure.size_px.1 as f64);
    if nx == 0.0 || ny == 0.0 || is_chip(header) {
        return None;
    }
    let (ra_deg, dec_deg) = wcs.pixel_to_sky((nx - 1.0) / 2.0, (ny - 1.0) / 2.0);
    let allowed_deg = nx.hypot(ny) / 2.0 * wcs.scale_arcsec() / 3_600.0 + POINTING_DEG;
    let reference = header.number("CRVAL1").zip(header.number("CRVAL2"));
    let pointings: Vec<InitialPointing> =
        positions(inspector, exposure).into_iter().filter(|p| !p.is_reference).collect();
    let agrees = |p: &InitialPointing| {
        let at_reference = reference.is_some_and(|(r, d)| separation_deg(p.ra_deg, p.dec_deg, r, d) < REFERENCE_DEG);
        at_reference || separation_deg(p.ra_deg, p.dec_deg, ra_deg, dec_deg) < allowed_deg
    };
    let first = pointings.first().filter(|_| !pointings.iter().any(agrees))?;
    Some(format!(
        "the frame's centre would be {:.2} deg from where {} points: header WCS does not fit the sky",
        separation_deg(first.ra_deg, first.dec_deg, ra_deg, dec_deg),
        first.source
    ))
}

/// Whether the frame is one chip of a mosaic, which the telescope does not point at.
fn is_chip(header: &Header) -> bool {
    let named = ["DETSEC", "CCDID", "CCDNUM", "CCDNAME"].iter().any(|k| header.text(k).is_some());
    let several = ["NCCDS", "NEXTEND"].iter().any(|k| header.number(k).is_some_and(|n| n > 1.0));
    named || several || header.text("INSTRUME").is_some_and(|i| i.to_ascii_uppercase().contains("MOSAIC"))
}

/// State and words by the catalogue stars; `None` if none are expected in the frame or its pixels cannot be read.
///
/// Coordinates that fit few stars, or none, are compared with a solution of the field, as a run does.
fn by_stars(
    inspector: &Inspector,
    exposure: &Exposure,
    wcs: &Wcs,
    stars: &Stars,
    catalogue: &Catalogue,
) -> Option<(&'static str, String)> {
    let sources = detections(exposure, &inspector.config.photometry).ok()?;
    let used = (exposure.size_px, inspector.config.photometry.clip_radius_px);
    let fit = agreement(wcs, &sources, used, stars, catalogue);
    if let Some(fit) = fit.as_ref().filter(|fit| !fit.doubted()) {
        return Some(("fits the sky", format!("{} of {} catalogue stars", fit.matched, fit.possible)));
    }
    let config = &inspector.config;
    let search = Search {
        radius_deg: stars.solve_radius_deg,
        scale_arcsec: configured_arcsec(exposure, config),
        scale_search_frac: stars.scale_search_frac,
        mirrored: None,
    };
    let positions = positions(inspector, exposure);
    let solution = solve_from(&positions, &sources, exposure.size_px, &catalogue_stars(catalogue), search);
    if let Ok((solution, _)) = solution.as_ref()
        && confirms(solution, wcs, exposure.size_px, stars)
    {
        return Some(("fits the sky", format!("{} stars of a solution confirm it", solution.pairs.len())));
    }
    Some(match fit {
        Some(fit) => {
            ("refused", format!("header WCS fits {} of {} catalogue stars only; {REMEDY}", fit.matched, fit.possible))
        }
        None => (
            "refused",
            format!("header WCS does not fit the sky: no match with {}; {REMEDY}", stars.catalogue.display()),
        ),
    })
}
