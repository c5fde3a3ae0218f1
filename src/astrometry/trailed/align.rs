//! A tracked frame laid on its star trails, or the reason why it is not.
//!
//! Of an image whose camera angle is known up to half a turn both angles are tried, else those that the direction of the
//! trails leaves. The best offset must do better than the same stars at random places and than every other angle, by a margin
//! unless the ends of trails confirm it.

use std::f64::consts::PI;

use super::CameraOnSky;
use super::ends::checked;
use super::fit::{Start, TrailFit, TrailLight, fit_trails};
use super::image::TrailImage;
use super::path::{Around, SkyPath};
use super::search::{Found, LitTrail, at_ends, best_offset, direction, width};

/// By how much the offset found must do better than chance, in its scatter.
const MARGIN: f64 = 1.5;
/// Or so many trails must end where they should, at an offset that does no worse than chance.
const MATCHING_ENDS: usize = 6;
/// Least score of an offset.
const LEAST_SCORE: f64 = 4.0;
/// Trails that are fitted at once.
pub const MOST_TRAILS: usize = 80;
/// S/N of a trail, by its predicted light, from which it is fitted.
const LEAST_SNR: f64 = 1.5;
/// The direction may differ by this many of its errors.
const TURN_SIGMA: f64 = 4.0;
/// The length may differ by this many of its errors.
const STRETCH_SIGMA: f64 = 4.0;
/// And by this share in any case.
const STRETCH_ALLOWED: f64 = 0.02;
/// FWHM with which trails are looked for whose width is not known \[px\], and the range of what is found.
const UNKNOWN_FWHM_PX: f64 = 3.0;
/// The narrowest that is found.
const LEAST_FWHM_PX: f64 = 1.0;
/// The widest.
const MOST_FWHM_PX: f64 = 30.0;

/// What is known of a frame before its trails are looked at.
#[derive(Debug, Clone, Copy)]
pub struct Beforehand {
    /// North on the detector up to half a turn \[rad\], whether mirrored, and the error \[rad\].
    pub turn: Option<(f64, bool, f64)>,
    /// Pixel scale \[arcsec/px\].
    pub scale_arcsec: f64,
    /// FWHM of the stars \[px\]; `None` where the trails must give it.
    pub fwhm_px: Option<f64>,
    /// Moffat's exponent.
    pub beta: f64,
    /// How far the frame may lie off along the satellite's path \[px\].
    pub along_px: f64,
    /// How far across \[px\].
    pub across_px: f64,
    /// Trails that are fitted at once, the brightest first: [`MOST_TRAILS`].
    pub most_trails: usize,
}

/// A frame on its trails.
#[derive(Debug, Clone)]
pub struct Aligned {
    /// The fit.
    pub fit: TrailFit,
    /// The camera on the sky, its angle as fitted.
    pub camera: CameraOnSky,
    /// Time by which the camera is ahead of the path that was predicted, as far as it was taken into account \[s\].
    pub ahead_s: f64,
    /// The path at that time.
    pub path: SkyPath,
    /// Speed of the stars \[px/s\].
    pub speed_px_s: f64,
    /// Score of the offset, and the best that chance reached.
    pub score: (f64, f64),
}

/// Lays a frame on the trails of `stars`: RA and Dec \[deg\] and predicted light \[e⁻/s\] of each.
///
/// `path_at` gives the satellite's path for a camera that is ahead by so many seconds.
///
/// # Errors
/// The reason why there is no offset, in words.
pub fn align(
    image: &TrailImage,
    path_at: &dyn Fn(f64) -> Option<SkyPath>,
    stars: &[((f64, f64), f64)],
    known: Beforehand,
) -> Result<Aligned, String> {
    let path = path_at(0.0).ok_or("the path of the satellite is not known")?;
    let fwhm_px = match known.fwhm_px {
        Some(fwhm_px) => fwhm_px,
        None => width(image, lined_up(image, &path, known, UNKNOWN_FWHM_PX))
            .ok_or("no trails from which the width of the stars could be measured")?
            .clamp(LEAST_FWHM_PX, MOST_FWHM_PX),
    };
    let around = Around { half_px: image.half_px(), along_px: known.along_px, across_px: known.across_px };
    let places: Vec<(f64, f64)> = stars.iter().map(|s| s.0).collect();
    let lit = |path: &SkyPath, camera: &CameraOnSky, theta: f64, around: Around| -> Vec<LitTrail> {
        let trails = path.trails(&places, camera, theta, around);
        trails.into_iter().map(|t| LitTrail { trail: t, e_per_px: stars[t.star].1 * t.s_per_px }).collect()
    };
    let mut best: Option<(Found, CameraOnSky, f64)> = None;
    let mut chance = 0.0f64;
    for camera in cameras(image, &path, known, fwhm_px) {
        let (theta, _) = path.star_motion(&camera);
        let trails = lit(&path, &camera, theta, around);
        let Some((found, by_chance)) = best_offset(image, theta, &trails, around, fwhm_px) else { continue };
        chance = chance.max(by_chance);
        match &best {
            Some((other, ..)) if other.score >= found.score => chance = chance.max(found.score),
            _ => {
                chance = best.map_or(chance, |(other, ..)| chance.max(other.score));
                best = Some((found, camera, theta));
            }
        }
    }
    let (found, camera, theta) = best.ok_or("fewer than 3 catalogue stars trail through the frame")?;
    let no_match = || {
        format!("the trails do not match the catalogue: the best offset scores {:.1}, chance {chance:.1}", found.score)
    };
    if found.score < LEAST_SCORE || found.score < chance {
        return Err(no_match());
    }
    // the path as the camera followed it: found again about its own middle
    let (_, speed_px_s) = path.star_motion(&camera);
    let followed = |ahead_s: f64, camera: CameraOnSky| {
        let path = path_at(ahead_s).ok_or("the path of the satellite is not known")?;
        let (turned, _) = path.star_motion(&camera);
        let camera = CameraOnSky { north_rad: camera.north_rad + theta - turned, ..camera };
        let trails = lit(&path, &camera, theta, around);
        let trails = strongest(image, trails, (Found { along_px: 0.0, ..found }, fwhm_px), known.most_trails);
        Ok::<_, String>((path, camera, trails))
    };
    let mut ahead_s = found.along_px / speed_px_s;
    let (mut path, mut camera, mut trails) = followed(ahead_s, camera)?;
    let found = Found { along_px: 0.0, ..found };
    // light that goes on says little of where it ends: as far off as trails of this length still overlap
    let length_px = speed_px_s * path.duration_s();
    let overlap_px = if length_px > 2.0 * image.half_px() { f64::INFINITY } else { length_px.max(4.0 * fwhm_px) };
    let ends_at = at_ends(image, theta, &trails, found, around.along_px.min(overlap_px), fwhm_px);
    if let Some(along_px) = ends_at {
        ahead_s += along_px / speed_px_s;
        (path, camera, trails) = followed(ahead_s, camera)?;
    }
    let start = Start {
        along_px: 0.0,
        along_known: ends_at.is_some(),
        across_px: found.across_px,
        theta_rad: theta,
        theta_err_rad: 0.5 * fwhm_px / image.half_px(),
        fwhm_px,
        beta: known.beta,
    };
    let fit = fit_trails(image, &trails, start).ok_or("the pixels do not determine the trails")?;
    let fit = checked(image, fit, start);
    // ends that lie where they should are evidence of their own
    let by_ends = fit.along_px.is_some() && fit.n_ends >= MATCHING_ENDS;
    if found.score < chance + MARGIN && !by_ends {
        return Err(no_match());
    }
    if let Some((stretch, err)) = fit.stretch
        && stretch.abs() > STRETCH_ALLOWED.max(STRETCH_SIGMA * err)
    {
        return Err(format!(
            "the trails are {:.1} % longer than rate and exposure time make them: another satellite, or a wrong exposure \
             time",
            100.0 * stretch
        ));
    }
    let camera = CameraOnSky { north_rad: camera.north_rad + fit.theta_rad.0 - theta, ..camera };
    Ok(Aligned { fit, camera, ahead_s, path, speed_px_s, score: (found.score, chance) })
}

/// The direction in which the light lines up \[rad\], up to half a turn.
fn lined_up(image: &TrailImage, path: &SkyPath, known: Beforehand, fwhm_px: f64) -> f64 {
    match known.turn {
        Some((north_rad, mirrored, err_rad)) => {
            let camera = CameraOnSky { north_rad, mirrored, scale_arcsec: known.scale_arcsec };
            direction(image, path.star_motion(&camera).0, TURN_SIGMA * err_rad, fwhm_px)
        }
        None => direction(image, 0.0, 0.5 * PI, fwhm_px),
    }
}

/// The angles the camera may have, each turned so that the trails lie where the light of the frame lines up.
fn cameras(image: &TrailImage, path: &SkyPath, known: Beforehand, fwhm_px: f64) -> Vec<CameraOnSky> {
    let theta = lined_up(image, path, known, fwhm_px);
    let turned = |north_rad: f64, mirrored: bool, half: f64| {
        let camera = CameraOnSky { north_rad, mirrored, scale_arcsec: known.scale_arcsec };
        let (expected, _) = path.star_motion(&camera);
        CameraOnSky { north_rad: north_rad + theta + half - expected, ..camera }
    };
    match known.turn {
        Some((north_rad, mirrored, _)) => [0.0, PI].map(|half| turned(north_rad, mirrored, half)).to_vec(),
        None => [(false, 0.0), (false, PI), (true, 0.0), (true, PI)].map(|(m, half)| turned(0.0, m, half)).to_vec(),
    }
}

/// The trails that can be measured at an offset, the strongest first.
fn strongest(image: &TrailImage, trails: Vec<LitTrail>, (at, fwhm_px): (Found, f64), most: usize) -> Vec<LitTrail> {
    let half = image.half_px();
    let snr = |lit: &LitTrail| {
        let length = (lit.trail.end_px + at.along_px).min(half) - (lit.trail.start_px + at.along_px).max(-half);
        // a matched filter across: 1.5 FWHM of noise
        lit.e_per_px * length.max(0.0).sqrt() / (image.sigma_e * (1.5 * fwhm_px).sqrt())
    };
    let mut strong: Vec<(f64, LitTrail)> = trails.into_iter().map(|t| (snr(&t), t)).collect();
    strong.retain(|s| s.0 > LEAST_SNR);
    strong.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.trail.star.cmp(&b.1.trail.star)));
    strong.truncate(most);
    strong.into_iter().map(|s| s.1).collect()
}

impl Aligned {
    /// Whether trails may end in the frame while no end says where the frame lies along them.
    #[must_use]
    pub fn ends_unknown(&self) -> bool {
        self.fit.along_px.is_none() && self.fit.lights.iter().any(|l| l.ends_inside)
    }

    /// The trails whose light is known: those that end in the frame only where their ends are measured.
    pub fn lights(&self) -> impl Iterator<Item = &TrailLight> {
        let ends_known = self.fit.along_px.is_some();
        self.fit.lights.iter().filter(move |l| ends_known || !l.ends_inside)
    }
}
