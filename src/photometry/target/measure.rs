//! The tracked satellite: a compact or resolved object near the expected place, among parallel star trails.
//!
//! Electrons and full-frame pixels. Found by `target_search`, outlined by `target_segment`, measured here in the
//! smallest shape that holds all of it; where nothing is found the answer is a limit. It does not cover several targets
//! in one frame.

use super::settings::TargetSettings;
use ndarray::Array2;

use super::placed::Placed;
use crate::base::constants::FWHM_PER_SIGMA;
use crate::frames::{Electrons, Frame};
use crate::photometry::Flags;
use crate::photometry::aperture::Shape;
use crate::photometry::background::Background;
use crate::photometry::flux::{Flux, measure};
use crate::photometry::surface_brightness::brightest_disc;
use crate::photometry::target::cells::{SCALES, WIDE_SCALE, cells_of};
use crate::photometry::target::compact::{Compact, Size, SourceKind, measure_compact};
use crate::photometry::target::cutout::Cutout;
use crate::photometry::target::enclose::minimum_aperture;
use crate::photometry::target::flux::{Measured, circle_at};
pub use crate::photometry::target::limit::{LIMIT_COMPLETENESS, LIMIT_MARGIN_SIGMA};
use crate::photometry::target::search::{OUTLINE_SIGMA, Significances, best_candidate, components};
use crate::photometry::target::segment::{Segment, scales_needed, segment};
use crate::photometry::target::shape::{Ellipse, moments, outline_moments};
use crate::photometry::trails::contamination::{Contamination, of_neighbours, of_trails};
pub use crate::photometry::trails::known::KnownDirection;

/// The result.
#[derive(Debug, Clone, PartialEq)]
pub enum TargetFound {
    /// The target.
    Detected {
        /// Its flux, in the aperture that encloses it.
        flux: Flux,
        /// Centre of the aperture \[px\].
        x_px: f64,
        /// Centre of the aperture \[px\].
        y_px: f64,
        /// The shape of its light.
        light: Light,
        /// Whether the sky is the level along the trails next to it: then there is no annulus, and no light of the target
        /// in the sky.
        along_trails: bool,
        /// The limit, if the whole object does not reach `detect_sigma` and is therefore not a detection.
        unseen: Option<Box<Unseen>>,
        /// What its pixels say of its size; `None` where that of a point was not compared with them.
        size: Option<Size>,
        /// The light of a point there and its error \[e⁻\], if the flux is that of a compact source: then it is the whole
        /// light, and its `snr` is the significance of the point.
        as_point_e: Option<(f64, f64)>,
    },
    /// Nothing above the threshold.
    NotDetected {
        /// Flux of a point source of which 95 % would be detected in the search region \[e⁻\]; NaN where there is none.
        limit_e: f64,
        /// The flux in an aperture of `limit_r_px` at the expected place, negative or not.
        flux: Flux,
        /// The expected place \[px\].
        x_px: f64,
        /// The expected place \[px\].
        y_px: f64,
        /// Whether the flux is the whole light of a point there.
        whole_light: bool,
    },
}

/// The result of a frame without a detection.
#[derive(Debug, Clone, PartialEq)]
pub struct Unseen {
    /// As in [`TargetFound::NotDetected`].
    pub limit_e: f64,
    /// Forced flux at the expected place.
    pub flux: Flux,
    /// The expected place \[px\].
    pub x_px: f64,
    /// The expected place \[px\].
    pub y_px: f64,
    /// Whether that is the whole light of a point there.
    pub whole_light: bool,
}

/// The light of a target, and what is mixed with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Angle of its major axis from +x towards +y \[rad\].
    pub theta_rad: f64,
    /// Ratio of its axes.
    pub elongation: f64,
    /// FWHM along the major axis \[px\]: 2.355 σ of its second moments; `None` where they cannot be trusted.
    pub extent_px: Option<f64>,
    /// The even ellipse that, seen through the point-spread function, has its second moments; `None` for a point source.
    pub source: Option<Shape>,
    /// Electrons per pixel in the brightest disc of one FWHM across; `None` where noise could be that bright.
    pub peak_disc_e_px: Option<f64>,
    /// Light of trails and neighbours inside the aperture \[e⁻\]; that of trails has been subtracted from the flux. NaN
    /// where there are trails and too little of them is seen beside the aperture.
    pub contamination_e: f64,
}

/// From this signal-to-noise on all of the target is outlined at first, and its moments are trusted.
const WHOLE_SNR: f64 = 15.0;
/// The rest of a fainter one among trails may be as far away \[FWHM\]: that much around is kept out of the trails' profiles, too.
const FAINT_REACH_FWHM: f64 = 8.0;
/// Searches of a frame, each without the hits that the one before took for the target.
const MOST_SEARCHES: usize = 40;
/// Where a candidate was a hit, other components of at least so many cells are examined.
const MIN_HIT_CELLS: usize = 4;
/// Of fewer than so many.
const MOST_HIT_CELLS: usize = 2000;
/// So many at once.
const MOST_HITS_AT_ONCE: usize = 100;
/// An object is discarded if hits make at least this share of its flux.
const MOST_OF_HITS: f64 = 0.3;
/// The aperture is nowhere narrower than this many FWHM to each side.
const LEAST_FWHM: f64 = 1.5;
/// Among trails, a wide source whose whole light is less significant than this is the remnant of a trail.
const LEAST_SNR: f64 = 3.0;
/// Above this ratio of the axes a target is called elongated.
const ELONGATED: f64 = 1.5;
/// A target less extended than this is a point source \[FWHM\].
const POINT_FWHM: f64 = 0.3;

/// Finds and measures the target, or says how bright it could have been.
///
/// 1. Around the expected place a quadratic surface is the sky, with a mesh where what is off it is smoother than a
///    target. Long straight runs give the direction of the star trails; where there are none, the best line outside the
///    target may be one faint trail. The robust mean level along that direction is subtracted; where it changes (trails
///    end), its uncertainty grows.
/// 2. What is left is smoothed at 1, 2, 4 and 8 FWHM. A candidate peaks above `detect_sigma` within the search radius,
///    does not run out of the cutout, is not one of a family of equal parallel streaks, is not a single hot pixel, and is
///    not several sources that a wide filter shows as one. Of several the nearer wins over the brighter; objects cut by an
///    edge come last.
/// 3. Its outline at 3 σ is joined with what is fainter and wider around it, without the points next to it, and with its
///    separate parts; then sky, trails and outline once more with it kept out. The aperture is the smallest shape around
///    the outline, plus `margin_px`.
/// 4. Among trails the sky of each line of pixels is the level of that line on both sides of the aperture, and the error
///    is at least the scatter of empty apertures treated alike. Without trails the sky is an annulus. What the choice of
///    the aperture added to a faint flux, 2 σ over its significance where it is resolved, is subtracted.
/// 5. Charge spilt from saturated pixels is masked, and so is the line of a satellite or an aircraft that runs through the cutout;
///    [`Flags::CROSSED`] where one crosses the target. [`Flags::TRAIL`] where light of trails was subtracted, [`Flags::CONTAMINATED`] where that of trails and neighbours is
///    more than `contam_frac` of the flux, [`Flags::HIT`] for a pixel sharper than a star.
///
/// [`TargetFound::NotDetected`] holds the forced flux at the expected place, negative or not, and the limit: the flux of
/// which 95 % of point sources in the search region would be detected.
#[must_use]
pub fn measure_target(frame: &Frame<Electrons>, background: &Background, s: &TargetSettings) -> TargetFound {
    let Some(mut cutout) = Cutout::new(frame, s) else {
        return limit_without_cutout(frame, background, s);
    };
    let mut left = MOST_SEARCHES;
    let (outlined, aperture, Measured { mut flux, trail_level, net, net_origin }, compact) = loop {
        let Some(first) = outlined(&mut cutout, frame, s, &mut left) else {
            return limit(cutout, frame, background, s);
        };
        let Some(aperture) = aperture(&cutout, &first.segment, s) else { return limit(cutout, frame, background, s) };
        // once more with the target kept out of the sky and of the trails' profiles
        let around =
            if first.snr < WHOLE_SNR && cutout.trail_background.is_some() { FAINT_REACH_FWHM * s.fwhm_px } else { 0.0 };
        cutout.exclude(&Placed { shape: aperture.shape.grown(around), ..aperture });
        let outlined = outlined(&mut cutout, frame, s, &mut left)
            .unwrap_or_else(|| Outlined { snr1: cutout.layers().significance(cutout.fwhm_cells(), 1, None), ..first });
        let Some(aperture) = self::aperture(&cutout, &outlined.segment, s) else {
            return limit(cutout, frame, background, s);
        };
        let objects = cutout.objects(&outlined.snr1);
        let mut measured = cutout.flux(frame, background, &aperture, &objects, s);
        correct_selection_bias(&mut measured.flux, &outlined);
        let compact = compact(&cutout, frame, background, (&outlined, &measured.flux), &objects, s);
        let is_track = match &compact {
            Some(c) if c.size.kind != SourceKind::Extended => {
                cutout.is_on_track((c.place.x, c.place.y), c.point.flux.snr, &outlined.snr1)
            }
            _ if outlined.scale >= WIDE_SCALE => {
                let best = cutout.best_place(&cutout.psf, outlined.peak_px);
                let at = best.map_or(outlined.peak_px, |best| (best.x, best.y));
                cutout.is_track(at, outlined.snr, &outlined.snr1)
            }
            _ => false,
        };
        match compact {
            _ if is_track => {}
            Some(c) if c.size.kind != SourceKind::Extended => {
                let Compact { size, point, as_point_e, place } = c;
                let whole = Measured { flux: point.flux, ..point.measured };
                break (outlined, place, whole, (Some(size), Some(as_point_e)));
            }
            _ if !consists_of_hits(&cutout, &aperture, &measured.flux, s) => {
                break (outlined, aperture, measured, (compact.map(|c| c.size), None));
            }
            _ => {}
        }
        cutout.mask_cells(&outlined.segment.cells());
    };
    let Outlined { segment: outline, snr, .. } = &outlined;
    let is_wide_and_faint = cutout.trail_background.is_some() && outlined.scale >= WIDE_SCALE && flux.snr < LEAST_SNR;
    if is_wide_and_faint || !flux.flux_e.is_finite() {
        return limit(cutout, frame, background, s);
    }
    let along_trails = trail_level.is_some();
    let trails = match (&cutout.trail_background, &trail_level) {
        (Some(trail_background), Some(trail_level)) => of_trails(&cutout, trail_background, trail_level, &aperture),
        _ => Contamination::default(),
    };
    let (segments_e, segments_err_e) = cutout.segments_light(&aperture);
    let (ox, oy) = cutout.origin(frame);
    let (nx, ny) = (net_origin.0 - ox as usize, net_origin.1 - oy as usize);
    let neighbours = of_neighbours(&cutout, &outline.neighbours, &aperture, (&net, (nx, ny)));
    let all = Contamination {
        trails_e: trails.trails_e + segments_e,
        neighbours_e: neighbours.neighbours_e,
        err_e: trails.err_e.hypot(neighbours.err_e).hypot(segments_err_e),
    };
    // trails of which nothing is seen next to the aperture add an unknown amount, and so does what goes on beyond the target
    let unknown = (cutout.trail_background.is_some() && trail_level.is_none())
        || outline.is_cut
        || cutout.may_hold_a_trail(aperture.shape.grown(-s.margin_px));
    // a flux below its error is no measure of a share
    if unknown || all.exceeds(s.contam_frac, (flux.flux_e - neighbours.neighbours_e).max(flux.flux_err_e)) {
        flux.flags.set(Flags::CONTAMINATED);
    }
    let at = (aperture.x - nx as f64, aperture.y - ny as f64);
    let rms_e = cutout.sky.rms(aperture.x, aperture.y);
    let inside = |&(i, j): &(usize, usize)| aperture.shape.contains(i as f64 - aperture.x, j as f64 - aperture.y);
    // the light of hits that were kept out of the search is in the aperture all the same
    if cutout.hits.iter().any(inside) || cutout.hits_in(&aperture).is_some() {
        flux.flags.set(Flags::HIT);
    }
    flux.flags.set(cutout.crossed(&aperture, &outlined.snr1));
    let mut light = shape_of_light(&cutout, outline, *snr);
    light.contamination_e = if unknown { f64::NAN } else { all.light_e() };
    light.peak_disc_e_px = brightest_disc(&net, at, &aperture.shape, s.fwhm_px, cutout.net.bin, rms_e);
    if light.elongation > ELONGATED {
        flux.flags.set(Flags::ELONGATED);
    }
    let unseen = (flux.snr < s.detect_sigma).then(|| Box::new(forced(cutout, frame, background, s)));
    let (size, as_point_e) = compact;
    if as_point_e.is_some() {
        light.source = None;
    }
    let (x_px, y_px) = (aperture.x + ox, aperture.y + oy);
    TargetFound::Detected { flux, x_px, y_px, light, along_trails, unseen, size, as_point_e }
}

/// The target measured as a compact source, if it was found at the scale of one and it is known what a point looks like.
fn compact(
    cutout: &Cutout,
    frame: &Frame<Electrons>,
    background: &Background,
    (outlined, of_outline): (&Outlined, &Flux),
    objects: &Array2<bool>,
    s: &TargetSettings,
) -> Option<Compact> {
    if outlined.scale >= WIDE_SCALE || !s.is_fwhm_known {
        return None;
    }
    measure_compact(cutout, frame, background, (outlined.peak_px, of_outline), objects, s)
}

/// The most likely target.
struct Outlined {
    /// All that belongs to it.
    segment: Segment,
    /// Significance of the cells at the scale of a star.
    snr1: Array2<f32>,
    /// Its own at the scale it was found at.
    snr: f64,
    /// Index of that scale.
    scale: usize,
    /// The place in it that is most significant at the scale of a star \[px of the cutout\].
    peak_px: (f64, f64),
}

/// Searches until a candidate is not a hit, at most `left` times.
fn outlined(cutout: &mut Cutout, frame: &Frame<Electrons>, s: &TargetSettings, left: &mut usize) -> Option<Outlined> {
    while *left > 0 {
        *left -= 1;
        let layers = cutout.layers();
        let mut snrs = Significances::new(&layers, cutout.fwhm_cells());
        let found = best_candidate(cutout, &mut snrs, frame, s)?;
        if cutout.mask_hits(&found.pixels, SCALES[found.scale]) {
            // where there is one there are more
            let mut others = components(&snrs.first(1)[0], OUTLINE_SIGMA);
            others.retain(|other| (MIN_HIT_CELLS..MOST_HIT_CELLS).contains(&other.len()));
            others.iter().take(MOST_HITS_AT_ONCE).for_each(|other| {
                cutout.mask_hits(other, 1);
            });
            continue;
        }
        let segment = segment(cutout, &layers, snrs.first(scales_needed(&found)), &found);
        let cells = segment.cells();
        if cutout.mask_hits(&cells, 1) {
            continue;
        }
        if cutout.is_spill(frame, &cells) {
            cutout.artefacts.set(Flags::BLOOMING);
            cutout.mask_cells(&cells);
            continue;
        }
        if let Some(line) = cutout.line_of(&cells, &snrs.first(1)[0]) {
            cutout.mask_line(line);
            continue;
        }
        if cutout.follow_bumps(&cells) {
            continue;
        }
        let snr1 = snrs.at_scale.swap_remove(0);
        let cells = cells_of(&found.pixels, SCALES[found.scale], snr1.dim());
        let (i, j) = cells.into_iter().max_by(|p, q| snr1[[p.1, p.0]].total_cmp(&snr1[[q.1, q.0]]))?;
        let peak_px = (cutout.net.to_px(i as f64), cutout.net.to_px(j as f64));
        return Some(Outlined { segment, snr1, snr: found.snr, scale: found.scale, peak_px });
    }
    None
}

/// Whether hits are much of the light in an aperture, or the rest without them is not a detection.
fn consists_of_hits(cutout: &Cutout, aperture: &Placed, flux: &Flux, s: &TargetSettings) -> bool {
    cutout.hits_in(aperture).is_some_and(|(hits_e, n)| {
        // the error of the pixels that are left, without the photons of hits
        let left = (1.0 - n as f64 / flux.area_px).max(0.1);
        let variance = flux.flux_err_e.powi(2) - hits_e.max(0.0);
        let err_e = (left * variance.max(0.25 * flux.flux_err_e.powi(2))).sqrt();
        hits_e > MOST_OF_HITS * flux.flux_e || flux.flux_e - hits_e < s.detect_sigma * err_e
    })
}

/// Subtracts the selection bias of the aperture: it is placed where the noise is positive.
///
/// The largest response of a smooth field over k free parameters exceeds that of the truth by χ²_k in its square, so
/// E(s) = S + k/2S in units of σ. An outline under the wide filters has followed its place, length and angle: k = 4, all
/// of it in the flux. One at the scale of a star has followed its place, and an aperture of 2 FWHM around shares 0.4 of
/// the filter's noise: k = 1. σ is that of an empty aperture. What is seen only where the noise helped (near
/// `detect_sigma`) stays too bright by what is left, 0.1 to 0.2 σ.
fn correct_selection_bias(flux: &mut Flux, outlined: &Outlined) {
    let freedoms = if outlined.scale < WIDE_SCALE { 1.0 } else { 4.0 };
    let empty = (flux.flux_err_e.powi(2) - flux.flux_e.max(0.0)).max(0.0).sqrt();
    flux.flux_e -= 0.5 * freedoms / outlined.snr * empty;
    flux.snr = flux.flux_e / flux.flux_err_e;
}

/// The smallest shape around the outline plus the margin.
fn aperture(cutout: &Cutout, outline: &Segment, s: &TargetSettings) -> Option<Placed> {
    minimum_aperture(&outline.points(cutout), s.shape, s.margin_px, LEAST_FWHM * s.fwhm_px)
}

/// Moments of the light where it is bright enough, of the outline where it is not.
fn shape_of_light(cutout: &Cutout, outline: &Segment, snr: f64) -> Light {
    let of_outline = outline_moments(&outline.cells());
    let fwhm = cutout.fwhm_cells();
    let settled = (snr > WHOLE_SNR).then(|| moments(&cutout.residual(), &of_outline, fwhm)).flatten();
    let Ellipse { a, b, theta, .. } = settled.unwrap_or(of_outline);
    let px = cutout.net.bin as f64;
    // of a star, seen in cells
    let own = (fwhm / FWHM_PER_SIGMA).powi(2) + (1.0 - 1.0 / (px * px)) / 12.0;
    let source = settled.and_then(|m| {
        let half = |sigma: f64| 2.0 * px * (sigma * sigma - own).max(0.0).sqrt();
        let (a_px, b_px) = (half(m.a), half(m.b));
        let extended = a_px > POINT_FWHM * cutout.fwhm_px;
        extended.then_some(Shape::Ellipse { a_px, b_px: b_px.max(0.05 * cutout.fwhm_px), theta_rad: theta })
    });
    Light {
        theta_rad: theta,
        elongation: a / b,
        extent_px: settled.map(|m| FWHM_PER_SIGMA * px * m.a),
        source,
        peak_disc_e_px: None,
        contamination_e: 0.0,
    }
}

/// Nothing above the threshold.
fn limit(cutout: Cutout, frame: &Frame<Electrons>, background: &Background, s: &TargetSettings) -> TargetFound {
    let Unseen { limit_e, flux, x_px, y_px, whole_light } = forced(cutout, frame, background, s);
    TargetFound::NotDetected { limit_e, flux, x_px, y_px, whole_light }
}

/// The forced flux at the expected place and what could have been seen in the search region.
fn forced(mut cutout: Cutout, frame: &Frame<Electrons>, background: &Background, s: &TargetSettings) -> Unseen {
    let (ox, oy) = cutout.origin(frame);
    let place = circle_at(s.x_px - ox, s.y_px - oy, s.limit_r_px);
    cutout.exclude(&place);
    let snr1 = cutout.layers().significance(cutout.fwhm_cells(), 1, None);
    let objects = cutout.objects(&snr1);
    let limit_e = cutout.limit_e(frame, background, &objects, s);
    let (mut flux, whole_light) = match cutout.forced_flux(frame, background, (place.x, place.y), &objects, s) {
        Some(point) => (point.flux, true),
        None => (cutout.flux(frame, background, &place, &objects, s).flux, false),
    };
    flux.flags.set(cutout.crossed(&place, &snr1));
    flux.flags.set(cutout.artefacts);
    Unseen { limit_e, flux, x_px: s.x_px, y_px: s.y_px, whole_light }
}

/// The limit where the expected place is off the frame: nothing measurable.
fn limit_without_cutout(frame: &Frame<Electrons>, background: &Background, s: &TargetSettings) -> TargetFound {
    let shape = Shape::Circle { r_px: s.limit_r_px };
    let flux = measure(frame, background, s.x_px, s.y_px, shape, s.sky_in_px, s.sky_out_px, s.clip_sigma);
    TargetFound::NotDetected { limit_e: f64::NAN, flux, x_px: s.x_px, y_px: s.y_px, whole_light: false }
}
