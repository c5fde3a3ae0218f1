//! The tracked satellite: a compact or elongated blob near the expected place, among parallel star trails.
//!
//! Electrons and full-frame pixels. Found by `target_search`, outlined by `target_shape`, measured here in an aperture that
//! encloses all of it; where nothing is found the answer is a limit. Leaves out: several targets in one frame.

use crate::frames::{Electrons, Frame};
use crate::photometry::Flags;
use crate::photometry::aperture::Shape;
use crate::photometry::background::Background;
use crate::photometry::flux::{Flux, measure};
use crate::photometry::target_search::Cutout;
use crate::photometry::target_shape::{Ellipse, enclosing_ellipse, moments};

/// Where and how to look for the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetSettings {
    /// Expected place \[px\].
    pub x_px: f64,
    /// Expected place \[px\].
    pub y_px: f64,
    /// How far from there the target may be \[px\].
    pub search_radius_px: f64,
    /// Threshold of the whole target \[σ\].
    pub detect_sigma: f64,
    /// Added around the object's own outline \[px\].
    pub margin_px: f64,
    /// Aperture radius of a limit \[px\].
    pub limit_r_px: f64,
    /// FWHM of a point source \[px\].
    pub fwhm_px: f64,
    /// Inner radius of the annulus of an aperture of `limit_r_px` \[px\].
    pub sky_in_px: f64,
    /// Outer radius of that annulus \[px\]; the target's own annulus keeps its gap and width.
    pub sky_out_px: f64,
    /// Clip of the sky pixels \[σ\].
    pub clip_sigma: f64,
}

/// What was found.
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
        /// Semi-major axis of the outline \[px\].
        a_px: f64,
        /// Semi-minor axis of the outline \[px\].
        b_px: f64,
        /// Angle of the major axis from +x towards +y \[rad\].
        theta_rad: f64,
        /// Ratio of the axes.
        elongation: f64,
    },
    /// Nothing above the threshold.
    NotDetected {
        /// `detect_sigma` times the error of an empty aperture of `limit_r_px` at the expected place \[e⁻\].
        limit_e: f64,
        /// What that aperture holds, negative or not.
        flux: Flux,
        /// The expected place \[px\].
        x_px: f64,
        /// The expected place \[px\].
        y_px: f64,
    },
}

/// An elliptical Gaussian out to this many σ holds 0.997 of its light.
const ENCLOSING_SIGMA: f64 = 3.4;
/// From this signal-to-noise on the moments of the target are trusted.
const MOMENTS_SNR: f64 = 15.0;

/// Finds and measures the target, or says how bright it could have been.
///
/// 1. Around the expected place the frame is smoothed; long straight runs give the direction of the star trails. The
///    robust mean level along that direction is the sky and every trail, resolved or not, and is taken off; it holds
///    no object shorter than 18 FWHM along the trails, and where it changes (trails end) it is doubted.
/// 2. What is left is smoothed at 1, 2 and 4 FWHM. A candidate peaks above `detect_sigma` within the search radius, does
///    not run out of the cutout, is not one of a family of equal parallel streaks, and is not a single hot pixel.
///    Of several the nearer wins over the brighter; objects cut by an edge and streaks along the trails come last.
/// 3. The aperture is the ellipse around its outline at 3 σ plus `margin_px`, at least 1.5 FWHM and, for a target of
///    S/N above 15, 3.4 σ of its own second moments (0.997 of a Gaussian).
/// 4. Among trails the sky of each line of pixels is the level of that line on both sides of the aperture, and the error
///    is at least the scatter of empty apertures treated alike; [`Flags::TRAIL`] where light of trails was taken off
///    inside the aperture. Without trails, or without room beside it, the sky is an annulus, other objects left out.
///
/// [`TargetFound::NotDetected`] holds the forced flux at the expected place, negative or not, and the limit.
#[must_use]
pub fn measure_target(frame: &Frame<Electrons>, background: &Background, settings: &TargetSettings) -> TargetFound {
    let Some(mut cutout) = Cutout::new(frame, background, settings) else {
        return limit_without_cutout(frame, background, settings);
    };
    cutout.find_trails(frame, background, settings);
    let mut found = cutout.best_candidate(frame, settings);
    if let (Some(first), true) = (&found, cutout.trails.strips.is_some()) {
        // once more with the target kept out of the trails' profiles
        cutout.model_trails(Some(&grown(&enclosing_ellipse(&first.pixels), 1.5 * settings.fwhm_px)));
        found = cutout.best_candidate(frame, settings).or(found);
    }
    let Some(found) = found else { return cutout.limit(frame, background, settings) };
    let outline = enclosing_ellipse(&found.pixels);
    let shape_of_light =
        (found.snr > MOMENTS_SNR).then(|| moments(&cutout.residual(), &outline, settings.fwhm_px)).flatten();
    let aperture = aperture_around(&outline, shape_of_light.as_ref(), settings);
    let (ox, oy) = cutout.origin(frame);
    let (x_px, y_px) = (aperture.x + ox, aperture.y + oy);
    let shape = if aperture.a < 1.15 * aperture.b {
        Shape::Circle { r_px: aperture.a }
    } else {
        Shape::Ellipse { a_px: aperture.a, b_px: aperture.b, theta_rad: aperture.theta }
    };
    let mut flux = cutout.flux(frame, background, (x_px, y_px), shape, settings);
    if !flux.flux_e.is_finite() {
        return cutout.limit(frame, background, settings);
    }
    let own = shape_of_light.unwrap_or(outline);
    let elongation = own.a / own.b;
    if elongation > 1.5 {
        flux.flags.set(Flags::ELONGATED);
    }
    TargetFound::Detected { flux, x_px, y_px, a_px: outline.a, b_px: outline.b, theta_rad: own.theta, elongation }
}

/// The limit where the expected place is off the frame: nothing measurable.
fn limit_without_cutout(frame: &Frame<Electrons>, background: &Background, s: &TargetSettings) -> TargetFound {
    let shape = Shape::Circle { r_px: s.limit_r_px };
    let flux = measure(frame, background, s.x_px, s.y_px, shape, s.sky_in_px, s.sky_out_px, s.clip_sigma);
    TargetFound::NotDetected { limit_e: f64::NAN, flux, x_px: s.x_px, y_px: s.y_px }
}

/// The aperture: outline plus margin, wide enough for faint targets and for the wings of bright ones.
fn aperture_around(outline: &Ellipse, light: Option<&Ellipse>, s: &TargetSettings) -> Ellipse {
    let least = 1.5 * s.fwhm_px;
    let mut out = *outline;
    out.a = (outline.a + s.margin_px).max(least);
    out.b = (outline.b + s.margin_px).max(least);
    if let Some(light) = light {
        // the axes nearly agree; the longer of both serves, within twice the outline
        out.a = out.a.max((ENCLOSING_SIGMA * light.a).min(2.0 * out.a));
        out.b = out.b.max((ENCLOSING_SIGMA * light.b).min(2.0 * out.b));
    }
    out
}

/// The ellipse moved outwards.
fn grown(e: &Ellipse, by: f64) -> Ellipse {
    Ellipse { a: e.a + by, b: e.b + by, ..*e }
}
