//! What one exposure of a survey reaches: a point, a square arcsecond, a pixel, a whole trail, each limit by its name.
//!
//! AB magnitudes of the survey's band, mag/arcsec², electrons, s, arcsec. A survey is a table of cited constants.
//! Excluded: clouds, airmass (X = 1 is in the zero points), and the light of the trail's own wings.

use crate::base::error::{Error, Result};
use crate::brightness::spectrum::Band;
use crate::visibility::simple::above_zero;

/// One pass band of a survey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurveyBand {
    /// Its name.
    pub name: &'static str,
    /// Magnitude that gives one electron a second, through the atmosphere at X = 1.
    pub zp_mag: f64,
    /// The same without the atmosphere: the sky's brightness is that at the ground.
    pub zp_hardware_mag: f64,
    /// Effective wavelength \[nm\].
    pub effective_nm: f64,
}

/// A survey: its camera, its usual exposure, its sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Survey {
    /// Name, lower case.
    pub name: &'static str,
    /// Name in figures.
    pub title: &'static str,
    /// Latitude, longitude \[deg\] and height \[m\].
    pub site: (f64, f64, f64),
    /// Diameter of the mirror \[m\].
    pub mirror_m: f64,
    /// Diameter of the field \[deg\].
    pub fov_deg: f64,
    /// Pixel scale \[arcsec\].
    pub pix_arcsec: f64,
    /// Read noise \[e⁻\].
    pub read_noise_e: f64,
    /// Dark current \[e⁻/s\].
    pub dark_e_s: f64,
    /// Electrons at which a pixel is full.
    pub full_well_e: f64,
    /// Exposure \[s\].
    pub exptime_s: f64,
    /// Seeing at 500 nm in the zenith, FWHM \[arcsec\].
    pub seeing_arcsec: f64,
    /// Sky at full Moon, as the paper takes it in every band \[mag/arcsec²\].
    pub sky_mag_arcsec2: f64,
    /// Its bands.
    pub bands: &'static [SurveyBand],
}

/// The Rubin Observatory's camera.
///
/// Zero points, read noise, dark current, pixel: rubin_sim (`reference/rubin.json` holds the same). Effective
/// wavelengths: rubin_scheduler; they make 0.957, 0.903 and 0.866″ of 0.7″. Full well: 150 000 e⁻, `saturation_e` of
/// rubin_sim's `saturation_limit` (single sensors differ). Mirror, seeing and sky: Caddy et al. (8.4 m; 0.7″ of
/// Crenshaw et al. 2024; 19.4 mag/arcsec² of the DECam calculator, g at full Moon). Field: 3.5°.
pub const RUBIN: Survey = Survey {
    name: "rubin",
    title: "Rubin",
    site: (-30.2446, -70.7494, 2663.0),
    mirror_m: 8.4,
    fov_deg: 3.5,
    pix_arcsec: 0.2,
    read_noise_e: 8.8,
    dark_e_s: 0.2,
    full_well_e: 150_000.0,
    exptime_s: 15.0,
    seeing_arcsec: 0.7,
    sky_mag_arcsec2: 19.4,
    bands: &[
        SurveyBand {
            name: "g",
            zp_mag: 28.507_545_544_094_17,
            zp_hardware_mag: 28.721_324_370_547_38,
            effective_nm: 480.7,
        },
        SurveyBand {
            name: "r",
            zp_mag: 28.360_365_503_331_952,
            zp_hardware_mag: 28.487_206_668_180_864,
            effective_nm: 622.2,
        },
        SurveyBand {
            name: "i",
            zp_mag: 28.170_373_076_693_625,
            zp_hardware_mag: 28.267_160_381_353_793,
            effective_nm: 754.5,
        },
    ],
};

/// What the paper prints for one exposure of 15 s \[mag\], g, r, i; called mag/arcsec² there, and a point's in fact.
pub const PUBLISHED_LIMITS: [(&str, f64); 3] = [("g", 23.13), ("r", 23.16), ("i", 23.12)];

/// Every survey known.
pub const SURVEYS: &[Survey] = &[RUBIN];

/// What "a seeing of 0.7 arcsec" is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeeingMeaning {
    /// That of the air at 500 nm; the band's wavelength, the telescope and the camera come on top. The paper's numbers.
    At500nm,
    /// The FWHM of the images.
    Effective,
}

/// What a limit is the limit of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LimitKind {
    /// The magnitude of a point \[mag\].
    Point,
    /// Surface brightness over one square arcsecond \[mag/arcsec²\].
    SquareArcsec,
    /// Surface brightness over one pixel \[mag/arcsec²\].
    Pixel,
    /// Surface brightness over a trail of this solid angle \[arcsec²\] whose place is known, summed \[mag/arcsec²\].
    Trail(f64),
}

/// One exposure of a survey in one band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visit {
    /// The survey.
    pub survey: Survey,
    /// The band.
    pub band: SurveyBand,
    /// Exposure \[s\].
    pub exptime_s: f64,
    /// Sky \[mag/arcsec²\].
    pub sky_mag_arcsec2: f64,
    /// FWHM of the images \[arcsec\].
    pub fwhm_eff_arcsec: f64,
}

impl Survey {
    /// A survey by name.
    ///
    /// # Errors
    /// [`Error::Config`] naming those known.
    pub fn named(name: &str) -> Result<Self> {
        SURVEYS.iter().find(|s| s.name.eq_ignore_ascii_case(name)).copied().ok_or_else(|| {
            let known: Vec<&str> = SURVEYS.iter().map(|s| s.name).collect();
            Error::Argument { name: "survey".into(), problem: format!("\"{name}\" is not one of {}", known.join(", ")) }
        })
    }

    /// One of its bands.
    ///
    /// # Errors
    /// [`Error::Config`] naming those known.
    pub fn band(&self, name: &str) -> Result<SurveyBand> {
        self.bands.iter().find(|b| b.name == name).copied().ok_or_else(|| {
            let known: Vec<&str> = self.bands.iter().map(|b| b.name).collect();
            let problem = format!("\"{name}\" is not one of {} ({})", known.join(", "), self.name);
            Error::Argument { name: "band".into(), problem }
        })
    }

    /// Its usual exposure in a band, under its own sky and seeing.
    #[must_use]
    pub fn visit(&self, band: SurveyBand, seeing: SeeingMeaning) -> Visit {
        Visit {
            survey: *self,
            band,
            exptime_s: self.exptime_s,
            sky_mag_arcsec2: self.sky_mag_arcsec2,
            fwhm_eff_arcsec: fwhm_eff_arcsec(self.seeing_arcsec, band.effective_nm, seeing),
        }
    }
}

/// FWHM of the images of a band \[arcsec\]: `1.16 sqrt(0.159 + 1.04 FWHM_atm²)`, `FWHM_atm = FWHM_500 (500 nm/λ)^0.3`.
///
/// 0.159 is what telescope (0.25″), optics (0.08″) and camera (0.30″) add. Source: rubin_scheduler, seeing model
/// (LSE-40).
#[must_use]
pub fn fwhm_eff_arcsec(seeing_arcsec: f64, effective_nm: f64, meaning: SeeingMeaning) -> f64 {
    match meaning {
        SeeingMeaning::Effective => seeing_arcsec,
        SeeingMeaning::At500nm => {
            let air = seeing_arcsec * (500.0 / effective_nm).powf(0.3);
            1.16 * (0.159 + 1.04 * air * air).sqrt()
        }
    }
}

/// Electrons that stand out k σ above the noise: `S = k²/2 + sqrt(k⁴/4 + k² N)`, N the variance without the source
/// \[e⁻²\].
#[must_use]
pub fn counts_at(snr: f64, variance_e2: f64) -> f64 {
    let k2 = snr * snr;
    0.5 * k2 + (0.25 * k2 * k2 + k2 * variance_e2).sqrt()
}

impl Visit {
    /// Refuses an exposure, an image or a sky that cannot be.
    ///
    /// # Errors
    /// [`Error::Model`] naming the quantity, its value and what is accepted.
    pub fn check(&self) -> Result<()> {
        above_zero("exptime_s", self.exptime_s)?;
        above_zero("fwhm_eff_arcsec", self.fwhm_eff_arcsec)?;
        if !(-30.0..=40.0).contains(&self.sky_mag_arcsec2) {
            let problem = format!("sky_mag_arcsec2 = {}; accepted is −30 to 40", self.sky_mag_arcsec2);
            return Err(Error::Model { problem });
        }
        Ok(())
    }

    /// Electrons of the sky in one pixel.
    #[must_use]
    pub fn sky_e_px(&self) -> f64 {
        let pix2 = self.survey.pix_arcsec * self.survey.pix_arcsec;
        10f64.powf(0.4 * (self.band.zp_hardware_mag - self.sky_mag_arcsec2)) * pix2 * self.exptime_s
    }

    /// Variance of one pixel without the source \[e⁻²\]: sky, dark current, read noise.
    #[must_use]
    pub fn variance_e2_px(&self) -> f64 {
        self.sky_e_px() + self.survey.dark_e_s * self.exptime_s + self.survey.read_noise_e.powi(2)
    }

    /// Electrons a second of a source of a magnitude.
    #[must_use]
    pub fn e_per_s(&self, mag: f64) -> f64 {
        10f64.powf(0.4 * (self.band.zp_mag - mag))
    }

    /// The limit of a kind at `snr` σ.
    ///
    /// `m = ZP − 2.5 lg(S/t)` of the electrons S that stand out over n pixels: `n = 2.266 (FWHM/pix)²` for a point, the
    /// area itself for the others, whose magnitude is per square arcsecond. Where the sky is all the noise, an area Ω
    /// reaches 1.25 lg Ω deeper than one square arcsecond.
    ///
    /// # Errors
    /// As [`Visit::check`], and for a trail whose solid angle is not above 0.
    ///
    /// # Source
    /// LSE-40 with the noise of the source itself (rubin_sim `calc_m5` at a gain of 1).
    pub fn limit_mag(&self, kind: LimitKind, snr: f64) -> Result<f64> {
        self.check()?;
        above_zero("snr", snr)?;
        let pix2 = self.survey.pix_arcsec * self.survey.pix_arcsec;
        // pixels summed, and the solid angle the magnitude is of
        let (n_px, arcsec2) = match kind {
            LimitKind::Point => (2.266 * (self.fwhm_eff_arcsec / self.survey.pix_arcsec).powi(2), 1.0),
            LimitKind::SquareArcsec => (1.0 / pix2, 1.0),
            LimitKind::Pixel => (1.0, pix2),
            LimitKind::Trail(omega) => (above_zero("the trail's solid angle", omega)? / pix2, omega),
        };
        let counts_e = counts_at(snr, n_px * self.variance_e2_px());
        Ok(self.band.zp_mag - 2.5 * (counts_e / self.exptime_s / arcsec2).log10())
    }
}

/// By which light source the satellite shines, for its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tint {
    /// The magnitude is already the band's.
    None,
    /// A grey satellite in sunlight.
    Sun,
    /// A grey satellite in moonlight.
    Moon,
}

/// Band magnitude (AB) less V (Vega) of a grey satellite \[mag\].
///
/// That of the Sun (Willmer 2018: V −26.76; AB g −26.47, r −26.93, i −27.05), and in moonlight the Moon's own colour
/// (ROLO at 30°). SDSS bands stand for the survey's, to some 0.02 mag.
///
/// # Errors
/// [`Error::Model`] for a band that has no cited Sun.
pub fn colour_mag(band: &str, tint: Tint) -> Result<f64> {
    use crate::brightness::light_sources::{SUN_V_MAG, SourceSettings};
    use crate::config::{Effects, Mode};
    if tint == Tint::None {
        return Ok(0.0);
    }
    let band = Band::named(band)
        .ok_or_else(|| Error::Model { problem: format!("no magnitude of the Sun in band {band} is known") })?;
    let sun = band.sun_mag() - SUN_V_MAG;
    if tint == Tint::Sun {
        return Ok(sun);
    }
    Ok(sun + SourceSettings::new(&Effects::of(Mode::Corrected), &band)?.moon_minus_sun_colour_mag)
}
