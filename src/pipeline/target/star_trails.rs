//! The star trails of a target frame as its calibration: the offset of its zeropoint, and where the target stands among the
//! stars.
//!
//! Electrons, pixels, magnitudes; offsets from the elements in arcsec, along the motion among the stars, and across it at
//! the position angle of the motion + 90°. It does not cover frames without catalogue stars.

use super::measurement::CalibratedMeasurement;
use crate::astrometry::catalogue::CatalogueStar;
use crate::astrometry::trailed::align::{Aligned, Beforehand, MOST_TRAILS, align};
use crate::astrometry::trailed::image::TrailImage;
use crate::astrometry::trailed::path::SkyPath;
use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::error::Result;
use crate::base::time::{jyear, shifted};
use crate::frames::Exposure;
use crate::orbit::Geometry;
use crate::photometry::Flags;
use crate::photometry::background::background;
use crate::photometry::center_of_light::{CenterOfLight, NetPixels, center_of_light, net_pixels};
use crate::photometry::target::compact::SourceKind;
use crate::pipeline::prepared::Calibrated;
use crate::tables::PhotometryRow;
use crate::zeropoint::frame_offset::{FrameOffset, StarRatio, frame_offset};

/// Moments of an exposure at which the satellite's place is computed.
const MOMENTS: usize = 9;
/// A path longer than this is not followed \[deg\].
const LONGEST_DEG: f64 = 20.0;
/// How far clock and elements may be off along the path \[s\], in addition to three errors of the time.
const ALONG_S: f64 = 0.6;
/// How far elements may be off across the path \[arcsec\].
const ACROSS_ARCSEC: f64 = 120.0;
/// Fewest catalogue stars for which a frame is read again.
const LEAST_STARS: usize = 3;
/// Stars fainter than the tenth by this are not predicted \[mag\].
const FAINTER_MAG: f64 = 4.5;
/// Error of a catalogue magnitude that states none \[mag\].
const UNSTATED_ERR_MAG: f64 = 0.05;
/// Colour of a star that has none, and its error \[mag\].
const UNKNOWN_COLOUR_MAG: [f64; 2] = [0.7, 0.3];
/// Electrons per second and m² of V = 0 where nothing is known of the camera; the trails correct it.
const UNKNOWN_E_S_M2: f64 = 5e9;
/// Turn of the camera beforehand that is allowed where star frames show it \[rad\].
const TURN_ERR_RAD: f64 = 0.004;
/// Exponent of the profile where no star frame shows it.
const UNKNOWN_BETA: f64 = 3.5;
/// Errors of a catalogue's places that its stars share \[arcsec\].
const CATALOGUE_ERR_ARCSEC: f64 = 0.1;

/// The note of a frame whose star trails made the program fail.
const FAILED: &str = "internal error while measuring the star trails of this frame: please report it with the frame";

/// The star trails of one frame.
#[derive(Debug, Clone, Default)]
pub struct FrameTrails {
    /// The offset of the frame's zeropoint.
    pub offset: Option<FrameOffset>,
    /// ZP + k X of this frame at colour 0, by its trails alone \[mag\]; only where the night has no zeropoint.
    pub own_zp_mag: Option<f64>,
    /// Where the target stands.
    pub position: Option<TargetPosition>,
    /// Why something is missing.
    pub note: String,
}

/// A place on the sky measured against the star trails.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetPosition {
    /// Observed minus computed across the motion and its error \[arcsec\].
    pub cross_arcsec: (f64, f64),
    /// Along the motion, and its error \[arcsec\]; `None` unless trail ends lie in the frame.
    pub along_arcsec: Option<(f64, f64)>,
    /// RA and Dec, ICRS, topocentric \[deg\]; `None` without the offset along the motion.
    pub icrs_deg: Option<(f64, f64)>,
    /// Errors of RA (times cos Dec) and Dec \[arcsec\].
    pub icrs_err_arcsec: Option<(f64, f64)>,
}

/// How far along its path a frame may lie off \[s\], for a time with this error.
#[must_use]
pub fn along_s(time_err_s: f64) -> f64 {
    ALONG_S + 3.0 * time_err_s.min(1.0)
}

/// The same, or that it failed: a panic must not end the night, as with the measurement of the target.
pub fn guarded_trails(look: impl FnOnce() -> Option<FrameTrails>) -> Option<FrameTrails> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(look))
        .unwrap_or_else(|_| Some(FrameTrails { note: FAILED.into(), ..FrameTrails::default() }))
}

/// What the trails of a frame with stars of `fwhm_px` say; `None` where they were not looked for: without elements, time or catalogue.
pub fn frame_trails(
    exposure: &Exposure,
    geometry: Option<&Geometry>,
    (measured, fwhm_px): (&CalibratedMeasurement, f64),
    night: &Calibrated,
) -> Option<FrameTrails> {
    let (geometry, time) = (geometry?, exposure.time.as_ref()?);
    let (tracker, catalogue) = (night.tracker.as_ref()?, night.catalogue.as_ref()?);
    if !night.config.zeropoint.star_trails {
        return None;
    }
    let missing = |note: &str| Some(FrameTrails { note: note.into(), ..FrameTrails::default() });
    let path_at = |ahead_s: f64| {
        let place = |k: usize| {
            let t_s = exposure.exptime_s * (k as f64 / (MOMENTS - 1) as f64 - 0.5);
            let (ra_deg, dec_deg) = tracker.icrs_at(&shifted(time.mid, t_s + ahead_s)).ok()?;
            Some((t_s, ra_deg, dec_deg))
        };
        SkyPath::new(&(0..MOMENTS).map(place).collect::<Option<Vec<_>>>()?)
    };
    let path = path_at(0.0)?;
    let scale_arcsec = night.scale_arcsec(exposure);
    let along_deg = geometry.rate_rad_s.to_degrees() * along_s(time.err_s);
    let half_frame_deg = 0.5 * (exposure.size_px.0 as f64).hypot(exposure.size_px.1 as f64) * scale_arcsec / 3600.0;
    let radius_deg = path.half_length_deg() + along_deg + 1.5 * half_frame_deg;
    if radius_deg > LONGEST_DEG {
        return missing("the trails of this exposure are too long to follow");
    }
    let (ra_deg, dec_deg) = path.middle_deg();
    let (of_date, epoch_jyear) = (jyear(time.mid), night.config.stars.as_ref().map_or(2000.0, |s| s.epoch_jyear));
    let near = catalogue.near(ra_deg, dec_deg, radius_deg).into_iter();
    let near: Vec<CatalogueStar> = near.map(|i| catalogue.stars[i].moved_to(of_date, epoch_jyear)).collect();
    if near.len() < LEAST_STARS {
        return missing("no catalogue stars along the path of the target");
    }
    match measure(exposure, geometry, (measured, fwhm_px), night, (&path_at, &near, along_deg, scale_arcsec)) {
        Ok(Ok(trails)) => Some(trails),
        Ok(Err(note)) => missing(&note),
        // the frame was measured: what fails now is said with its row
        Err(error) => missing(&error.to_string()),
    }
}

/// ZP + k X and C + k'' X of the night at the frame's airmass; without a zeropoint what a telescope of this size should have.
fn predicted_zeropoint(night: &Calibrated, airmass: f64) -> (f64, f64) {
    match &night.zeropoint {
        Some(z) => (z.zp_mag + z.k_mag_airmass * airmass, z.c_mag_mag + z.k2_mag * airmass),
        None => {
            let area_m2 = 0.25 * std::f64::consts::PI * night.config.telescope.aperture_m.powi(2);
            (-2.5 * (UNKNOWN_E_S_M2 * area_m2).log10(), 0.0)
        }
    }
}

/// Predicted light of a star \[e⁻/s\] and the error of its magnitude \[mag\].
fn light(star: &CatalogueStar, (zp_mag, slope): (f64, f64)) -> (f64, f64) {
    let [unknown, unknown_err] = UNKNOWN_COLOUR_MAG;
    let colour = star.b_v_mag.unwrap_or(unknown);
    let colour_err = if star.b_v_mag.is_some() { star.b_v_err_mag.unwrap_or(0.0) } else { unknown_err };
    let err_mag = star.v_err_mag.unwrap_or(UNSTATED_ERR_MAG).hypot(slope * colour_err);
    (10f64.powf(-0.4 * (star.v_mag + zp_mag + slope * colour)), err_mag)
}

type Field<'a> = (&'a dyn Fn(f64) -> Option<SkyPath>, &'a [CatalogueStar], f64, f64);

fn measure(
    exposure: &Exposure,
    geometry: &Geometry,
    (measured, fwhm_px): (&CalibratedMeasurement, f64),
    night: &Calibrated,
    (path_at, near, along_deg, scale_arcsec): Field<'_>,
) -> Result<std::result::Result<FrameTrails, String>> {
    let p = &night.config.photometry;
    let Some(airmass) = geometry.airmass else { return Ok(Err("no airmass".into())) };
    let zeropoint = predicted_zeropoint(night, airmass);
    // the brightest first
    let faintest = near[9.min(near.len() - 1)].v_mag + FAINTER_MAG;
    let usable: Vec<&CatalogueStar> = near.iter().filter(|s| s.v_mag < faintest).collect();
    let lights: Vec<(f64, f64)> = usable.iter().map(|s| light(s, zeropoint)).collect();
    let stars: Vec<((f64, f64), f64)> = usable.iter().zip(&lights).map(|(s, l)| ((s.ra_deg, s.dec_deg), l.0)).collect();
    let m = &measured.measured;
    let profile = night.seeing.profile;
    let known = Beforehand {
        turn: night.seeing.camera_turn.map(|t| (t.north_rad, t.mirrored, t.err_rad.max(TURN_ERR_RAD))),
        scale_arcsec,
        // a width that is only assumed is not taken
        fwhm_px: m.fwhm_px.map(|_| fwhm_px * profile.map_or(1.0, |p| p.fwhm_ratio)),
        beta: profile.map_or(UNKNOWN_BETA, |p| p.beta),
        along_px: along_deg * 3600.0 / scale_arcsec,
        across_px: ACROSS_ARCSEC.max(night.config.target.search_radius_arcsec) / scale_arcsec,
        most_trails: MOST_TRAILS,
    };
    let reader = night.open(exposure)?;
    let frame = night.usable(reader.whole(&night.buffers)?)?;
    let sky = background(&frame, p.mesh_px, p.clip_sigma)?;
    let at = (m.x_px, m.y_px);
    let reach_px = m.flux.shape.bounding_radius_px();
    let of_target = net_pixels(&frame, &sky, at, 2.0 * reach_px + 1.0);
    let image = TrailImage::new(&frame, &sky, at, &[(at.0, at.1, reach_px + 2.0 * fwhm_px)], fwhm_px);
    drop(frame);
    let aligned = match align(&image, path_at, &stars, known) {
        Ok(aligned) => aligned,
        Err(note) => return Ok(Err(note)),
    };
    let ratios: Vec<StarRatio> = aligned
        .lights()
        .map(|l| StarRatio { ratio: l.ratio, err: l.err, predicted_err_mag: lights[l.star].1 })
        .collect();
    let scatter_mag = night.zeropoint.as_ref().map_or(0.0, |z| z.intrinsic_mag).max(0.0);
    let without_zeropoint = night.zeropoint.is_none();
    let (offset, note) = match frame_offset(&ratios, scatter_mag, !without_zeropoint) {
        Ok(offset) => (Some(if aligned.ends_unknown() { offset.without_ends() } else { offset }), String::new()),
        Err(note) => (None, note),
    };
    let own_zp_mag = offset.filter(|_| without_zeropoint).map(|o| zeropoint.0 + o.offset_mag);
    // which trails are whose is certain only where their light agrees
    let position = offset.and_then(|_| position(&aligned, path_at, measured, &of_target));
    Ok(Ok(FrameTrails { offset, own_zp_mag, position, note }))
}

/// Where the target stands on the detector, and the variances and covariance of the place \[px²\]: the best place of a compact
/// one, else the centre of its light without that of the trails.
fn place_px(aligned: &Aligned, measured: &CalibratedMeasurement, of_target: &NetPixels) -> Option<CenterOfLight> {
    let m = &measured.measured;
    let (x_px, y_px) = (m.x_px, m.y_px);
    if m.size.is_some_and(|size| size.kind != SourceKind::Extended) {
        let variance_px2 = (aligned.fit.fwhm_px / FWHM_PER_SIGMA / m.flux.snr.max(1.0)).powi(2);
        return Some(CenterOfLight { x_px, y_px, covariance_px2: [variance_px2, variance_px2, 0.0] });
    }
    let from_target: Vec<(f64, f64)> = of_target.places_px().map(|(x, y)| (x - x_px, y - y_px)).collect();
    center_of_light(of_target, &aligned.fit.light_at(&from_target), &m.flux.shape, (x_px, y_px))
}

/// Where the target stands, from the offset of the frame.
fn position(
    aligned: &Aligned,
    path_at: &dyn Fn(f64) -> Option<SkyPath>,
    measured: &CalibratedMeasurement,
    of_target: &NetPixels,
) -> Option<TargetPosition> {
    let m = &measured.measured;
    if !m.detected {
        return None;
    }
    let place = place_px(aligned, measured, of_target)?;
    let (dx, dy) = (place.x_px - m.x_px, place.y_px - m.y_px);
    let scale = aligned.camera.scale_arcsec;
    let (theta, _) = aligned.fit.theta_rad;
    let (sin, cos) = theta.sin_cos();
    let (across, across_err) = aligned.fit.across_px;
    let along = aligned.fit.along_px;
    // from where the path is to the target; the aperture is the origin of the image
    let du = dx * cos + dy * sin - along.map_or(0.0, |a| a.0);
    let dv = dy * cos - dx * sin - across;
    let tangent = aligned.camera.tangent((du * cos - dv * sin, du * sin + dv * cos));
    let observed = aligned.path.sky_at_mid(tangent);
    let computed = path_at(0.0)?;
    let [east, north] = computed.offset_arcsec(observed)?;
    let [to_east, to_north] = computed.motion()?;
    let along_oc = east * to_east + north * to_north;
    let cross_oc = east * to_north - north * to_east;
    let [xx, yy, xy] = place.covariance_px2;
    let variance = |a: f64, b: f64| (a * a * xx + b * b * yy + 2.0 * a * b * xy).max(0.0);
    let err = |own_px2: f64, trails_px: f64| (scale * own_px2.sqrt().hypot(trails_px)).hypot(CATALOGUE_ERR_ARCSEC);
    let cross_err = err(variance(-sin, cos), across_err);
    let along_err = along.map(|(_, trails_px)| err(variance(cos, sin), trails_px));
    let turned = |a: f64, c: f64| ((a * to_east).hypot(c * to_north), (a * to_north).hypot(c * to_east));
    Some(TargetPosition {
        cross_arcsec: (cross_oc, cross_err),
        along_arcsec: along_err.map(|err| (along_oc, err)),
        icrs_deg: along_err.map(|_| observed),
        icrs_err_arcsec: along_err.map(|err| turned(err, cross_err)),
    })
}

/// A cloud is flagged beyond this many errors of the offset.
const CLOUD_SIGMA: f64 = 3.0;

/// Fills the columns of the star trails, and v_mag where the night has no zeropoint.
pub fn fill_trails(
    row: &mut PhotometryRow,
    trails: Option<&FrameTrails>,
    of: &CalibratedMeasurement,
    night: &Calibrated,
) {
    if row.v_mag.is_some() {
        row.v_mag_zeropoint = if of.other_night.is_some() { "other_night" } else { "night" }.into();
    }
    let Some(trails) = trails else { return };
    row.frame_zp_note.clone_from(&trails.note);
    let Some(offset) = trails.offset else { return };
    row.frame_zp_stars = i64::try_from(offset.n_stars).ok();
    let m = &of.measured;
    let airmass = row.airmass.unwrap_or(f64::NAN);
    let [colour, colour_err] = night.config.zeropoint.target_colour(night.zeropoint.as_ref().and_then(|z| z.colour));
    let correction_err = m.correction.and_then(|c| c.err_mag).unwrap_or(0.0);
    let own_err = offset.err_mag.hypot(correction_err).hypot(m.flat_err_mag);
    match (&night.zeropoint, trails.own_zp_mag) {
        (Some(z), _) => {
            let colour_part = (z.c_mag_mag + z.k2_mag * airmass) * colour_err;
            let err_mag = offset.err_mag.hypot(z.err_mag(airmass, colour, 0.0));
            row.frame_zp_offset_mag = Some(offset.offset_mag);
            row.frame_zp_offset_err_mag = Some(err_mag);
            row.frame_v_mag = row.v_mag.map(|v| v - offset.offset_mag);
            row.frame_v_mag_err_sys = row.frame_v_mag.map(|_| own_err.hypot(colour_part));
            if offset.offset_mag > CLOUD_SIGMA * err_mag {
                row.flags |= Flags::CLOUD.0;
            }
        }
        (None, Some(zp_mag)) => {
            // the colour term is not known
            let own_err = own_err.hypot(night.config.zeropoint.c_prior.err * colour_err);
            let of = |inst: Option<f64>| inst.map(|inst| inst - zp_mag);
            (row.v_mag, row.limit_v_mag) = (of(m.inst.mag), of(m.inst.limit_mag));
            (row.mu_mean_mag_arcsec2, row.mu_peak_mag_arcsec2) = (of(m.inst.mu_mean), of(m.inst.mu_peak));
            row.v_mag_err_sys = row.v_mag.or(row.limit_v_mag).map(|_| own_err);
            (row.frame_v_mag, row.frame_v_mag_err_sys) = (row.v_mag, row.v_mag.map(|_| own_err));
            row.v_mag_zeropoint = row.v_mag.map_or(String::new(), |_| "trails".into());
            row.reason = m.reasons.join("; ");
        }
        (None, None) => {}
    }
    if let Some(at) = trails.position {
        (row.cross_oc_arcsec, row.cross_oc_err_arcsec) = (Some(at.cross_arcsec.0), Some(at.cross_arcsec.1));
        (row.along_oc_arcsec, row.along_oc_err_arcsec) = at.along_arcsec.unzip();
        (row.ra_deg, row.dec_deg) = at.icrs_deg.unzip();
        (row.ra_err_arcsec, row.dec_err_arcsec) = at.icrs_err_arcsec.unzip();
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::panic)]
    use super::*;

    #[test]
    fn a_panic_in_the_trails_of_a_frame_is_a_note_of_its_row_and_no_number() {
        let trails = guarded_trails(|| panic!("trails of a test"));
        let of = trails.as_ref().map(|t| (t.offset, t.own_zp_mag, t.position, t.note.contains("internal error")));
        assert_eq!(of, Some((None, None, None, true)));
        assert!(guarded_trails(|| None).is_none());
    }
}
