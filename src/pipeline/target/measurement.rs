//! The target in one frame: measured in electrons and pixels ([`Measurement`]), then in magnitudes ([`CalibratedMeasurement`]).
//!
//! Instrumental magnitudes are −2.5 log₁₀ of electrons per second. It does not cover the place of the satellite
//! ([`super::place`]) and the row of it all ([`super::row`]).

use crate::base::constants::MAG_PER_LN;
use crate::frames::Gain;
use crate::frames::flat::needed::noise_mag;
use crate::photometry::aperture::Shape;
use crate::photometry::flux::{Flux, detectable_e};
use crate::photometry::surface_brightness::inst_mu;
use crate::photometry::target::compact::{Size, of_a_point};
use crate::photometry::target::measure::{LIMIT_MARGIN_SIGMA, Light, TargetFound};
use crate::pipeline::prepared::Calibrated;
use crate::tables::words::ForcedAt;
use crate::zeropoint::previous::{OtherNight, other_night};

/// The measurement of one frame.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// The detector at the gain of the frame.
    pub gain: Gain,
    /// FWHM of the stars \[px\], if anything determines it.
    pub fwhm_px: Option<f64>,
    /// Radius of the circle in which the target was looked for \[px\].
    pub search_radius_px: f64,
    /// Level of the sky at the edge of the field over that at its centre.
    pub sky_corner_ratio: Option<f64>,
    /// Whether the frame was divided by a master flat.
    pub flattened: bool,
    /// Error of a magnitude by the flat \[mag\]: its noise under a point, where that is known, or the vignetting of a frame without.
    pub flat_err_mag: f64,
    /// Whether the target stands out.
    pub detected: bool,
    /// Centre of the aperture \[px\].
    pub x_px: f64,
    /// Centre of the aperture \[px\].
    pub y_px: f64,
    /// The flux in the aperture.
    pub flux: Flux,
    /// The light of a point: without a detection at the expected place, else at its own place that of a compact target; its whole
    /// light above [`CLEAR_SNR`], and where that has the smaller error.
    pub forced: Option<PointAt>,
    /// The shape of the target; `None` if nothing was found.
    pub target_shape: Option<TargetShape>,
    /// What its pixels say of its size; `None` where that of a point was not compared with them.
    pub size: Option<Size>,
    /// The correction of the target to its whole light; `None` without a profile of the stars, or if that gives none.
    pub correction: Option<ApertureCorrection>,
    /// Before the zeropoint.
    pub inst: Instrumental,
    /// Why there is no detection, no limit or no magnitude.
    pub reasons: Vec<String>,
}

/// A frame that shows the target this clearly is a measure of its whole light: the outline holds that of any size at any place, and its
/// noise adds no more than a few percent.
pub const CLEAR_SNR: f64 = 25.0;

/// The light of a point at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointAt {
    /// What the place is.
    pub at: ForcedAt,
    /// Column \[px\].
    pub x_px: f64,
    /// Row \[px\].
    pub y_px: f64,
    /// The light \[e⁻\], negative or not.
    pub flux_e: f64,
    /// Its random error \[e⁻\].
    pub err_e: f64,
}

/// The shape of the target and the light that is mixed with it.
#[derive(Debug, Clone, Copy)]
pub struct TargetShape {
    /// Ratio of its axes.
    pub elongation: f64,
    /// Its length \[FWHM of the stars\].
    pub extent_fwhm: Option<f64>,
    /// Light of trails and neighbours over its flux.
    pub contam_frac: Option<f64>,
}

/// An aperture correction and its error \[mag\].
#[derive(Debug, Clone, Copy)]
pub struct ApertureCorrection {
    /// Added to magnitudes.
    pub mag: f64,
    /// Its error; `None` if the profile does not determine it.
    pub err_mag: Option<f64>,
}

/// Instrumental magnitudes, aperture correction included \[mag, mag/arcsec²\].
#[derive(Debug, Clone, Copy, Default)]
pub struct Instrumental {
    /// Of a detected target.
    pub mag: Option<f64>,
    /// Its random error.
    pub mag_err: Option<f64>,
    /// The limit.
    pub limit_mag: Option<f64>,
    /// Mean surface brightness over the aperture.
    pub mu_mean: Option<f64>,
    /// Surface brightness of the brightest disc.
    pub mu_peak: Option<f64>,
}

/// A measurement in magnitudes outside the atmosphere; all `None` without a zeropoint or an airmass.
#[derive(Debug, Clone)]
pub struct CalibratedMeasurement {
    /// The measurement.
    pub measured: Measurement,
    /// Magnitude of a detected target.
    pub v_mag: Option<f64>,
    /// Systematic error of the magnitude or of the limit.
    pub v_mag_err_sys: Option<f64>,
    /// The limit.
    pub limit_v_mag: Option<f64>,
    /// Mean surface brightness over the aperture \[mag/arcsec²\].
    pub mu_mean: Option<f64>,
    /// Surface brightness of the brightest disc \[mag/arcsec²\].
    pub mu_peak: Option<f64>,
    /// The error added by the zeropoint of another night.
    pub other_night: Option<OtherNight>,
    /// The reason why there is no magnitude.
    pub missing: Option<&'static str>,
}

/// The inputs of the measurement of a frame.
#[derive(Debug)]
pub struct Setting<'a> {
    /// The night.
    pub night: &'a Calibrated,
    /// Gain of the frame.
    pub gain: &'a Gain,
    /// Exposure time \[s\].
    pub exptime_s: f64,
    /// Pixel scale \[arcsec/px\].
    pub scale_arcsec: f64,
    /// FWHM of the stars that apertures are made for \[px\].
    pub aperture_fwhm_px: f64,
    /// FWHM of the stars \[px\], if anything determines it.
    pub fwhm_px: Option<f64>,
    /// Radius of the circle in which the target was looked for \[px\].
    pub search_radius_px: f64,
    /// Level of the sky at the edge of the field over that at its centre.
    pub sky_corner_ratio: Option<f64>,
}

impl Setting<'_> {
    /// Error of a magnitude by the flat, or by there being none \[mag\].
    fn flat_err_mag(&self) -> f64 {
        match &self.night.flat {
            Some(flat) => flat.noise_frac.map_or(0.0, |noise| noise_mag(noise, self.aperture_fwhm_px)),
            None => self.night.config.zeropoint.no_flat_err_mag,
        }
    }

    /// The result of the search in a frame, as a measurement.
    #[must_use]
    pub fn measurement(&self, found: TargetFound) -> Measurement {
        let t = &self.night.config.target;
        match found {
            TargetFound::Detected { flux, x_px, y_px, light, along_trails, unseen, size, as_point_e } => {
                let (correction, corr_mag, why) = match as_point_e {
                    Some(_) => (self.of_whole_light(&flux, along_trails), 0.0, None),
                    None => self.aperture_correction(&flux, light.source, along_trails),
                };
                let target_shape = self.target_shape(&flux, &light);
                let mut inst = Instrumental {
                    mu_mean: inst_mu(flux.flux_e, self.exptime_s, flux.area_px, self.scale_arcsec),
                    mu_peak: light.peak_disc_e_px.and_then(|e| inst_mu(e, self.exptime_s, 1.0, self.scale_arcsec)),
                    ..Instrumental::default()
                };
                let detected = flux.snr >= t.detect_sigma;
                let point = |at, (x_px, y_px), (flux_e, err_e)| PointAt { at, x_px, y_px, flux_e, err_e };
                let whole = 10f64.powf(-0.4 * corr_mag);
                let whole_light = (flux.flux_e * whole, flux.flux_err_e * whole);
                // of a compact target the light of a point, where that is known better than its whole light
                let fwhm_err_frac = self.night.seeing.fwhm_err_frac(self.exptime_s);
                let own = match as_point_e.map(|point| of_a_point(point, fwhm_err_frac)) {
                    _ if flux.snr > CLEAR_SNR => Some(whole_light),
                    Some(point) if point.1 < whole_light.1 => Some(point),
                    of_point => of_point.map(|_| whole_light),
                };
                let mut forced = own.map(|light| point(ForcedAt::Detection, (x_px, y_px), light));
                let mut reasons = Vec::new();
                if detected {
                    let mag = -2.5 * (flux.flux_e / self.exptime_s).log10() + corr_mag;
                    inst.mag = Some(mag).filter(|m| m.is_finite());
                    inst.mag_err = Some(MAG_PER_LN * flux.flux_err_e / flux.flux_e);
                    // what a point would have to be, whatever this target is
                    let (flux_e, err_e) = as_point_e.unwrap_or((flux.flux_e, flux.flux_err_e));
                    let limit_e = detectable_e(flux_e, err_e, t.detect_sigma + LIMIT_MARGIN_SIGMA);
                    inst.limit_mag = self.inst_limit(limit_e, corr_mag);
                    reasons.extend(why);
                } else {
                    // a bright pixel, but the whole object is not significant: among star trails that is not a detection
                    reasons.push(format!(
                        "S/N {:.1} of the whole object is below {} (target.detect_sigma)",
                        flux.snr, t.detect_sigma
                    ));
                    if let Some(unseen) = unseen {
                        let corr_mag = if unseen.whole_light { 0.0 } else { self.point_correction(&unseen.flux) };
                        inst.limit_mag = self.inst_limit(unseen.limit_e, corr_mag);
                        reasons.extend(no_limit(unseen.limit_e));
                        let light = (unseen.flux.flux_e, unseen.flux.flux_err_e);
                        forced = Some(point(ForcedAt::Expected, (unseen.x_px, unseen.y_px), light));
                    }
                }
                Measurement {
                    forced,
                    target_shape: Some(target_shape),
                    size,
                    correction,
                    inst,
                    reasons,
                    ..self.nothing((x_px, y_px), flux, detected)
                }
            }
            TargetFound::NotDetected { limit_e, x_px, y_px, flux, whole_light } => {
                let (correction, corr_mag, why) = if whole_light {
                    (self.of_whole_light(&flux, false), 0.0, None)
                } else {
                    self.aperture_correction(&flux, None, false)
                };
                let mut reasons = vec![format!("nothing above {} sigma near ({x_px:.0}, {y_px:.0})", t.detect_sigma)];
                reasons.extend(why);
                reasons.extend(no_limit(limit_e));
                let limit_mag = self.inst_limit(limit_e, corr_mag);
                Measurement {
                    forced: Some(PointAt {
                        at: ForcedAt::Expected,
                        x_px,
                        y_px,
                        flux_e: flux.flux_e,
                        err_e: flux.flux_err_e,
                    }),
                    correction,
                    inst: Instrumental { limit_mag, ..Instrumental::default() },
                    reasons,
                    ..self.nothing((x_px, y_px), flux, false)
                }
            }
        }
    }

    /// A flux and what it was measured with.
    fn nothing(&self, (x_px, y_px): (f64, f64), flux: Flux, detected: bool) -> Measurement {
        Measurement {
            gain: self.gain.clone(),
            fwhm_px: self.fwhm_px,
            search_radius_px: self.search_radius_px,
            sky_corner_ratio: self.sky_corner_ratio,
            flattened: self.night.flat.is_some(),
            flat_err_mag: self.flat_err_mag(),
            detected,
            x_px,
            y_px,
            flux,
            forced: None,
            target_shape: None,
            size: None,
            correction: None,
            inst: Instrumental::default(),
            reasons: Vec::new(),
        }
    }

    fn target_shape(&self, flux: &Flux, light: &Light) -> TargetShape {
        TargetShape {
            elongation: light.elongation,
            extent_fwhm: light.extent_px.map(|e| e / self.aperture_fwhm_px),
            // a flux below its error cannot be the reference of a share
            contam_frac: Some(light.contamination_e / flux.flux_e.max(flux.flux_err_e)).filter(|f| f.is_finite()),
        }
    }

    /// The correction of a flux that is the whole light already: none, with the error that the stars' profile leaves.
    fn of_whole_light(&self, flux: &Flux, along_trails: bool) -> Option<ApertureCorrection> {
        let (correction, ..) = self.aperture_correction(flux, None, along_trails);
        correction.map(|c| ApertureCorrection { mag: 0.0, ..c })
    }

    /// A limit as an instrumental magnitude.
    fn inst_limit(&self, limit_e: f64, corr_mag: f64) -> Option<f64> {
        let limit = || -2.5 * (limit_e / self.exptime_s).log10() + corr_mag;
        (limit_e > 0.0).then(limit).filter(|m| m.is_finite())
    }

    /// The correction of a point source in the aperture of a limit to its whole light \[mag\]; 0 without a profile of
    /// the stars.
    fn point_correction(&self, flux: &Flux) -> f64 {
        let night = self.night;
        let profile = night.seeing.profile.filter(|_| night.config.photometry.aper_correction);
        let correction = profile
            .map(|p| p.correction_mag(self.aperture_fwhm_px, flux.shape, (flux.sky_in_px, flux.sky_out_px), None));
        correction.filter(|c| c.is_finite()).unwrap_or(0.0)
    }

    /// The correction of the target to its whole light, like that of the stars of the zeropoint, and that as a number
    /// \[mag\]: 0 without a profile of the stars, NaN, with a reason, where the profile gives none for this aperture.
    ///
    /// A level measured along trails has none of the target's light in it: then there is no annulus to correct for.
    fn aperture_correction(
        &self,
        flux: &Flux,
        source: Option<Shape>,
        along_trails: bool,
    ) -> (Option<ApertureCorrection>, f64, Option<String>) {
        let night = self.night;
        let Some(profile) = night.seeing.profile.filter(|_| night.config.photometry.aper_correction) else {
            return (None, 0.0, None);
        };
        let sky = if along_trails { (0.0, 0.0) } else { (flux.sky_in_px, flux.sky_out_px) };
        let mag = profile.correction_mag(self.aperture_fwhm_px, flux.shape, sky, source);
        if !mag.is_finite() {
            let why = "no aperture correction: next to nothing of a star's light would fall into this aperture, so there is \
                       no magnitude";
            return (None, f64::NAN, Some(why.into()));
        }
        let err_mag = profile.correction_err_mag(self.aperture_fwhm_px, flux.shape, sky, source);
        (Some(ApertureCorrection { mag, err_mag: Some(err_mag).filter(|e| e.is_finite()) }), mag, None)
    }
}

/// Why a frame without a detection has no limit.
fn no_limit(limit_e: f64) -> Option<String> {
    let why = "no limit: in more than 5 % of the search region no point source would be detected, however bright";
    limit_e.is_nan().then(|| why.into())
}

impl Measurement {
    /// Instrumental to calibrated magnitudes, V = V_inst − ZP − k X − C (B−V), at an airmass and a time (MJD, UTC).
    ///
    /// The systematic error joins the zeropoint's propagated covariance at this airmass and colour, the scatter of one line
    /// of sight as the pointings show it, the colour of the target, the gain table, the aperture correction, the vignetting of
    /// a frame without flat and, where the zeropoint is of another night, how much nights differ; the random error is the
    /// flux's own.
    #[must_use]
    pub fn calibrated(self, airmass: Option<f64>, mjd_mid_d: Option<f64>, night: &Calibrated) -> CalibratedMeasurement {
        let z = &night.config.zeropoint;
        let other = night.zeropoint.as_ref().and_then(|zeropoint| other_night(zeropoint, mjd_mid_d, z));
        let (Some(zeropoint), Some(airmass)) = (&night.zeropoint, airmass) else {
            let missing = if night.zeropoint.is_none() { "no zeropoint" } else { "no airmass" };
            return CalibratedMeasurement {
                measured: self,
                v_mag: None,
                v_mag_err_sys: None,
                limit_v_mag: None,
                mu_mean: None,
                mu_peak: None,
                other_night: other,
                missing: Some(missing),
            };
        };
        let gain_err = night.detector.gain_table_err_mag();
        let [colour, colour_err] = z.target_colour(zeropoint.colour);
        let fit_err = zeropoint.err_one_pointing_mag(airmass, colour, colour_err);
        let night_err = other.map_or(0.0, |other| other.extra_err_mag);
        let correction_err = self.correction.and_then(|c| c.err_mag).unwrap_or(0.0);
        let of = |m: Option<f64>| m.map(|m| zeropoint.v_mag(m, airmass, colour));
        let (v_mag, limit_v_mag) = (of(self.inst.mag), of(self.inst.limit_mag));
        let v_mag_err_sys = (v_mag.is_some() || limit_v_mag.is_some())
            .then(|| fit_err.hypot(gain_err).hypot(night_err).hypot(correction_err).hypot(self.flat_err_mag));
        CalibratedMeasurement {
            v_mag,
            v_mag_err_sys,
            limit_v_mag,
            mu_mean: of(self.inst.mu_mean),
            mu_peak: of(self.inst.mu_peak),
            other_night: other,
            missing: None,
            measured: self,
        }
    }
}
