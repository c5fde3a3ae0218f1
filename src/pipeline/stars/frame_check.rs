//! Every star frame by itself against the others: its zeropoint and its scale show a filter or a camera that is not theirs.
//!
//! Magnitudes. A cloud dims all frames of a pointing, and so does another filter: such a pointing is left to the model of clouds
//! ([`crate::zeropoint`]). A frame that is brighter than the others, or differs from others of its own pointing, is under
//! no cloud.

use super::pointing::Member;
use crate::astrometry::catalogue::Catalogue;
use crate::base::stats::{mad_sigma, median};
use crate::photometry::Flags;
use crate::tables::words::Standing;

/// Signal-to-noise of a star from which its magnitude counts.
const SNR: f64 = 20.0;
/// Fewest stars of a frame that give a zeropoint.
const FEWEST_STARS: usize = 3;
/// Fewest frames whose scatter is known.
const FEWEST_FRAMES: usize = 5;
/// A frame differs from the others by this many of its errors.
const SIGMA: f64 = 5.0;
/// Smallest difference that counts \[mag\]: filters of one band differ by less.
const LEAST_MAG: f64 = 0.1;
/// Airmasses over which the extinction is fitted; over fewer it changes the zeropoint by less than [`LEAST_MAG`].
const AIRMASS_SPAN: f64 = 0.3;
/// Flags of stars whose light is not all there, or not all theirs.
const TAINTED: Flags = Flags(Flags::SATURATED.0 | Flags::EDGE.0 | Flags::MASKED.0 | Flags::NEIGHBOUR.0);

/// What a star frame shows of its filter and camera.
#[derive(Debug, Clone)]
pub struct FrameCheck {
    /// The file.
    pub frame: String,
    /// Zeropoint minus that of the other frames at the same airmass, positive = fainter \[mag\]; `None` with too few stars.
    pub zp_dev_mag: Option<f64>,
    /// The difference that counts \[mag\]; `None` with too few frames.
    pub zp_limit_mag: Option<f64>,
    /// Scale its stars solve to over that of the other frames, minus 1.
    pub scale_dev_frac: Option<f64>,
    /// What the zeropoint says of its filter.
    pub standing: Standing,
}

impl FrameCheck {
    /// Why the frame cannot be of the filter or the camera that its header states; `None` where its zeropoint does not say so.
    #[must_use]
    pub fn contradiction(&self) -> Option<String> {
        let (dev, limit) = self.zp_dev_mag.zip(self.zp_limit_mag).filter(|_| self.standing == Standing::Deviates)?;
        let (side, cloud) = if dev < 0.0 { ("brighter", "") } else { ("fainter", ", or under a cloud") };
        Some(format!(
            "its zeropoint is {:.2} mag {side} than that of the other star frames, where {limit:.2} mag is the limit: is it of \
             another filter or camera{cloud}?",
            dev.abs()
        ))
    }
}

/// Compares the frames of all pointings.
///
/// The zeropoint of a frame is the median of inst − catalogue over its stars, its error 1.25 σ/√n with σ the robust scatter of
/// the stars about their frames; the extinction is the median of the slopes between all pairs of frames (Theil 1950, Sen 1968).
/// The colour term is left in: it is the same for all frames. `scales` are those of the frames over the configured one.
pub(super) fn check_frames(pointings: &[Vec<(&Member, f64)>], catalogue: &Catalogue) -> Vec<Vec<FrameCheck>> {
    let stars: Vec<Vec<Option<Stars>>> =
        pointings.iter().map(|p| p.iter().map(|(m, _)| Stars::of(m, catalogue)).collect()).collect();
    let measured: Vec<&Stars> = stars.iter().flatten().flatten().collect();
    let k = extinction(&measured);
    let level = |s: &Stars| s.zp_mag - k * s.airmass;
    let levels: Vec<f64> = measured.iter().map(|s| level(s)).collect();
    let middle = median(&mut levels.clone());
    let scatter = mad_sigma(&mut levels.clone()).unwrap_or(0.0);
    let of_star =
        mad_sigma(&mut measured.iter().flat_map(|s| s.about.iter().copied()).collect::<Vec<_>>()).unwrap_or(0.0);
    let scale = median(&mut pointings.iter().flatten().map(|(_, ratio)| *ratio).collect::<Vec<_>>());
    let mut checks: Vec<Vec<FrameCheck>> = Vec::new();
    for (members, stars) in pointings.iter().zip(&stars) {
        let check = |((member, ratio), stars): (&(&Member, f64), &Option<Stars>)| {
            let zp_dev_mag = stars.as_ref().zip(middle).map(|(s, middle)| level(s) - middle);
            let own_err = stars.as_ref().map(|s| 1.253 * of_star / (s.about.len() as f64).sqrt());
            let zp_limit_mag = own_err
                .filter(|_| measured.len() >= FEWEST_FRAMES)
                .map(|own| (SIGMA * own.hypot(scatter)).max(LEAST_MAG));
            FrameCheck {
                frame: member.frame.clone(),
                zp_dev_mag,
                zp_limit_mag,
                scale_dev_frac: scale.map(|scale| ratio / scale - 1.0),
                standing: Standing::NotCheckable,
            }
        };
        let mut of_pointing: Vec<FrameCheck> = members.iter().zip(stars).map(check).collect();
        judge(&mut of_pointing);
        checks.push(of_pointing);
    }
    checks
}

/// What the zeropoints of one pointing say.
fn judge(frames: &mut [FrameCheck]) {
    let within = |f: &FrameCheck| Some(f.zp_dev_mag?.abs() <= f.zp_limit_mag?);
    let some_agree = frames.iter().any(|f| within(f) == Some(true));
    for frame in frames {
        frame.standing = match (within(frame), frame.zp_dev_mag) {
            (Some(true), _) => Standing::Agrees,
            (Some(false), Some(dev)) if some_agree || dev < 0.0 => Standing::Deviates,
            _ => Standing::NotCheckable,
        };
    }
}

/// The stars of one frame.
struct Stars {
    zp_mag: f64,
    airmass: f64,
    /// Of each star about the median \[mag\].
    about: Vec<f64>,
}

impl Stars {
    fn of(member: &Member, catalogue: &Catalogue) -> Option<Self> {
        let good = |s: &&super::pointing::MemberStar| {
            !s.flux.flags.any(TAINTED) && s.flux.flux_e > SNR * s.flux.flux_err_e && s.match_px.is_some()
        };
        let of_star = |s: &super::pointing::MemberStar| {
            let inst_mag = -2.5 * (s.flux.flux_e / member.exptime_s).log10();
            Some((inst_mag - catalogue.stars[s.index].v_mag, s.airmass?)).filter(|(zp, _)| zp.is_finite())
        };
        let (zps, airmasses): (Vec<f64>, Vec<f64>) = member.stars.iter().filter(good).filter_map(of_star).unzip();
        if zps.len() < FEWEST_STARS {
            return None;
        }
        let zp_mag = median(&mut zps.clone())?;
        let airmass = median(&mut airmasses.clone())?;
        Some(Self { zp_mag, airmass, about: zps.into_iter().map(|zp| zp - zp_mag).collect() })
    }
}

/// Extinction \[mag/airmass\]; 0 where the frames span too few airmasses.
fn extinction(frames: &[&Stars]) -> f64 {
    let (lo, hi) =
        frames.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), s| (s.airmass.min(lo), s.airmass.max(hi)));
    if frames.len() < FEWEST_FRAMES || !(hi - lo > AIRMASS_SPAN) {
        return 0.0;
    }
    let pairs = frames.iter().enumerate().flat_map(|(k, a)| frames[..k].iter().map(move |b| (*a, *b)));
    let apart = pairs.filter(|(a, b)| (a.airmass - b.airmass).abs() > 0.1 * (hi - lo));
    let mut slopes: Vec<f64> = apart.map(|(a, b)| (a.zp_mag - b.zp_mag) / (a.airmass - b.airmass)).collect();
    median(&mut slopes).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(dev_mag: f64) -> FrameCheck {
        FrameCheck {
            frame: String::new(),
            zp_dev_mag: Some(dev_mag),
            zp_limit_mag: Some(0.1),
            scale_dev_frac: None,
            standing: Standing::NotCheckable,
        }
    }

    fn judged(devs_mag: &[f64]) -> Vec<Standing> {
        let mut frames: Vec<FrameCheck> = devs_mag.iter().map(|d| frame(*d)).collect();
        judge(&mut frames);
        frames.iter().map(|f| f.standing).collect()
    }

    #[test]
    fn a_cloud_cannot_be_determined_from_another_filter_and_a_brighter_frame_is_under_none() {
        use Standing::{Agrees, Deviates, NotCheckable};
        assert_eq!(judged(&[0.01, -0.02]), [Agrees, Agrees]);
        assert_eq!(judged(&[0.8, 0.9]), [NotCheckable, NotCheckable]);
        assert_eq!(judged(&[0.0, 0.3]), [Agrees, Deviates]);
        assert_eq!(judged(&[-0.3, -0.3]), [Deviates, Deviates]);
        let unknown = FrameCheck { zp_limit_mag: None, ..frame(0.0) };
        let mut frames = vec![unknown];
        judge(&mut frames);
        assert_eq!(frames[0].standing, NotCheckable);
    }

    #[test]
    fn extinction_is_the_slope_of_most_frames() {
        let stars: Vec<Stars> = (0..9)
            .map(|k| (1.0 + 0.1 * f64::from(k), if k == 4 { 0.7 } else { 0.0 }))
            .map(|(airmass, off)| Stars { zp_mag: -22.0 + 0.2 * airmass + off, airmass, about: Vec::new() })
            .collect();
        assert!((extinction(&stars.iter().collect::<Vec<_>>()) - 0.2).abs() < 0.02);
        assert_eq!(extinction(&stars.iter().take(4).collect::<Vec<_>>()), 0.0);
    }
}
