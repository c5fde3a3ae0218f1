//! Limits by what is detected: one pixel, one arcsec², a star, an extended target; and what saturates.
//!
//! Magnitudes and mag/arcsec² of one band. A star's light is summed over its noise-equivalent area, that of a Gaussian.

use std::f64::consts::{LN_2, PI};

use statrs::function::erf::erf;

use super::noise::{Noise, exposure_for_snr, limit_mag, snr};
use super::optics::{DARK_E_S_PX, FWHM_ARCSEC};
use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::error::{Error, Result};

/// Noise-equivalent area of a Gaussian image over FWHM²: `4π/(8 ln 2)` (LSE-40: 2.266).
const NOISE_AREA_PER_FWHM2: f64 = 2.266_18;

/// What is to be detected: over which area its light is summed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Area {
    /// Light that fills one pixel: a surface brightness.
    Pixel,
    /// Light that fills one arcsec²: a surface brightness.
    Arcsec2,
    /// A star: 2.266 FWHM².
    Point,
    /// A target of this solid angle \[arcsec²\], blurred: its area and that of a star.
    Extended(f64),
}

impl Area {
    /// How it is called in tables.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Area::Pixel => "one pixel",
            Area::Arcsec2 => "one arcsec2",
            Area::Point => "point source",
            Area::Extended(_) => "extended target",
        }
    }
}

/// A faintest magnitude, and over what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// Magnitude of all the light detected \[mag\]; of a surface brightness, that in the area.
    pub mag: f64,
    /// The same as a mean surface brightness \[mag/arcsec²\]; `None` for a star.
    pub mag_arcsec2: Option<f64>,
    /// Area over which light is summed \[arcsec²\].
    pub summed_arcsec2: f64,
    /// The same in pixels.
    pub n_px: f64,
    /// Variance without the target in it \[e⁻²\].
    pub variance_e2: f64,
    /// The brightest pixel holds more than it can at this limit.
    pub saturated: bool,
}

/// What a magnitude needs to be seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Needed {
    /// Time in all \[s\].
    pub exptime_s: f64,
    /// Exposures it is split into.
    pub n_sub: u32,
    /// Longest exposure that does not saturate \[s\].
    pub unsaturated_s: f64,
}

/// A telescope in one band: what it makes of magnitudes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calculator {
    /// Magnitude of 1 e⁻/s, of light that reaches the telescope.
    pub zp_mag: f64,
    /// What the air takes of the target \[mag\]: 0 for limits at the ground, kX for limits outside the atmosphere.
    pub extinction_mag: f64,
    /// Pixel scale \[arcsec\].
    pub pixel_arcsec: f64,
    /// Full width at half maximum of a star's image \[arcsec\].
    pub fwhm_arcsec: f64,
    /// Radius of the aperture a star is measured in \[arcsec\]; without it, its noise-equivalent area and all its light.
    pub aper_r_arcsec: Option<f64>,
    /// Dark current \[e⁻/s/px\].
    pub dark_e_s_px: f64,
    /// Read noise of a pixel \[e⁻\].
    pub read_noise_e: f64,
    /// What a pixel can hold: the smaller of full well and converter \[e⁻\].
    pub saturation_e: f64,
}

impl Calculator {
    /// The telescope behind the published limits: 21.62 mag/arcsec² make 1 e⁻/s in a pixel, read noise 2.7 e⁻, no dark
    /// current. With the sky at 19.4 and 22.13 it has their 84.6 and 13.6 e² in 10 s.
    #[must_use]
    pub fn published(pixel_arcsec: f64) -> Self {
        Self {
            zp_mag: 21.62 - 2.5 * pixel_arcsec.powi(2).log10(),
            extinction_mag: 0.0,
            pixel_arcsec,
            fwhm_arcsec: FWHM_ARCSEC,
            aper_r_arcsec: None,
            dark_e_s_px: 0.0,
            read_noise_e: 2.7,
            saturation_e: f64::INFINITY,
        }
    }

    /// A telescope of this zeropoint, pixel and camera, with [`FWHM_ARCSEC`] and [`DARK_E_S_PX`], no extinction.
    #[must_use]
    pub fn new(zp_mag: f64, pixel_arcsec: f64, read_noise_e: f64, saturation_e: f64) -> Self {
        Self {
            zp_mag,
            extinction_mag: 0.0,
            pixel_arcsec,
            fwhm_arcsec: FWHM_ARCSEC,
            aper_r_arcsec: None,
            dark_e_s_px: DARK_E_S_PX,
            read_noise_e,
            saturation_e,
        }
    }

    /// Checks every number once.
    ///
    /// # Errors
    /// [`Error::Model`] naming the first that makes no sense.
    pub fn check(&self) -> Result<()> {
        let positive = [
            ("pixel scale", self.pixel_arcsec, "arcsec"),
            ("FWHM", self.fwhm_arcsec, "arcsec"),
            ("saturation", self.saturation_e, "e-"),
        ];
        for (name, value, unit) in positive {
            if !(value > 0.0) {
                return Err(Error::Model { problem: format!("{name} {value} {unit} is not above 0") });
            }
        }
        for (name, value) in
            [("zeropoint", self.zp_mag), ("pixel scale", self.pixel_arcsec), ("FWHM", self.fwhm_arcsec)]
        {
            if !value.is_finite() {
                return Err(Error::Model { problem: format!("{name} {value} is not a number") });
            }
        }
        if let Some(r) = self.aper_r_arcsec.filter(|r| !(PI * r * r >= self.pixel_arcsec.powi(2) && r.is_finite())) {
            return Err(Error::Model { problem: format!("aperture radius {r} arcsec holds less than a pixel") });
        }
        if !(self.extinction_mag >= 0.0 && self.extinction_mag.is_finite()) {
            return Err(Error::Model {
                problem: format!("extinction {} mag is not a number from 0 up", self.extinction_mag),
            });
        }
        Ok(())
    }

    /// Surface brightness that makes 1 e⁻/s in a pixel \[mag/arcsec²\], of light that reaches the telescope.
    #[must_use]
    pub fn zp_pixel_mag_arcsec2(&self) -> f64 {
        self.zp_mag + 2.5 * self.pixel_arcsec.powi(2).log10()
    }

    /// What a pixel holds of a sky \[mag/arcsec²\].
    #[must_use]
    pub fn noise_px(&self, sky_mag_arcsec2: f64) -> Noise {
        Noise {
            sky_e_s: 10f64.powf(-0.4 * (sky_mag_arcsec2 - self.zp_pixel_mag_arcsec2())),
            dark_e_s: self.dark_e_s_px,
            read_noise_e: self.read_noise_e,
        }
    }

    /// Electrons per second of a target.
    #[must_use]
    pub fn rate_e_s(&self, mag: f64) -> f64 {
        10f64.powf(-0.4 * (mag + self.extinction_mag - self.zp_mag))
    }

    /// Area over which the light is summed \[arcsec²\].
    fn summed_arcsec2(&self, area: Area) -> f64 {
        let star = NOISE_AREA_PER_FWHM2 * self.fwhm_arcsec.powi(2);
        match (area, self.aper_r_arcsec) {
            (Area::Pixel, _) => self.pixel_arcsec.powi(2),
            (Area::Arcsec2, _) => 1.0,
            (Area::Point, Some(r)) => PI * r * r,
            // a star sharper than a pixel still fills one
            (Area::Point, None) => star.max(self.pixel_arcsec.powi(2)),
            (Area::Extended(omega), _) => (omega + star).max(self.pixel_arcsec.powi(2)),
        }
    }

    /// Share of the target's light that is summed: of a star in an aperture `1 − exp(−4 ln 2 r²/FWHM²)`, else all of it.
    fn summed_share(&self, area: Area) -> f64 {
        match (area, self.aper_r_arcsec) {
            (Area::Point, Some(r)) => -(-4.0 * LN_2 * (r / self.fwhm_arcsec).powi(2)).exp_m1(),
            _ => 1.0,
        }
    }

    /// Solid angle the light comes from \[arcsec²\]; `None` for a star.
    fn shown_arcsec2(&self, area: Area) -> Option<f64> {
        match area {
            Area::Pixel => Some(self.pixel_arcsec.powi(2)),
            Area::Arcsec2 => Some(1.0),
            Area::Point => None,
            Area::Extended(omega) => Some(omega),
        }
    }

    /// Share of a target's light in its brightest pixel: a Gaussian centred on it, `erf²(s/(2√2 σ))`, or the pixel's share
    /// of a larger target.
    #[must_use]
    pub fn peak_share(&self, area: Area) -> f64 {
        let sigma = self.fwhm_arcsec / FWHM_PER_SIGMA;
        let star = erf(self.pixel_arcsec / (8f64.sqrt() * sigma)).powi(2);
        let pixel = self.pixel_arcsec.powi(2);
        match area {
            Area::Point => star,
            Area::Pixel => 1.0,
            Area::Arcsec2 => pixel.min(1.0),
            Area::Extended(omega) => star.min(pixel / omega),
        }
    }

    /// Longest exposure that leaves the brightest pixel below saturation \[s\]; the mean, without noise.
    #[must_use]
    pub fn unsaturated_s(&self, area: Area, mag: f64, sky_mag_arcsec2: f64) -> f64 {
        let noise = self.noise_px(sky_mag_arcsec2);
        self.saturation_e / (self.rate_e_s(mag) * self.peak_share(area) + noise.sky_e_s + noise.dark_e_s)
    }

    /// Magnitude at which the brightest pixel saturates in an exposure; `None` when sky and dark current already do.
    #[must_use]
    pub fn saturation_mag(&self, area: Area, sky_mag_arcsec2: f64, exposure_s: f64) -> Option<f64> {
        let noise = self.noise_px(sky_mag_arcsec2);
        let left_e_s = self.saturation_e / exposure_s - noise.sky_e_s - noise.dark_e_s;
        let mag = self.zp_mag - self.extinction_mag - 2.5 * (left_e_s / self.peak_share(area)).log10();
        (left_e_s > 0.0 && mag.is_finite()).then_some(mag)
    }

    /// The faintest that is seen at `snr` in a time in all split into `n_sub` exposures.
    ///
    /// # Errors
    /// As [`limit_mag`] and [`Calculator::check`]; [`Error::Model`] for a solid angle that is not above 0.
    pub fn limit(&self, area: Area, sky_mag_arcsec2: f64, exptime_s: f64, n_sub: u32, snr: f64) -> Result<Limit> {
        let noise = self.summed_noise(area, sky_mag_arcsec2)?;
        let zp_mag = self.zp_mag - self.extinction_mag + 2.5 * self.summed_share(area).log10();
        let mag = limit_mag(zp_mag, &noise, exptime_s, n_sub, snr)?;
        let summed_arcsec2 = self.summed_arcsec2(area);
        Ok(Limit {
            mag,
            mag_arcsec2: self.shown_arcsec2(area).map(|omega| mag + 2.5 * omega.log10()),
            summed_arcsec2,
            n_px: summed_arcsec2 / self.pixel_arcsec.powi(2),
            variance_e2: noise.variance_e2(exptime_s, n_sub),
            saturated: self.unsaturated_s(area, mag, sky_mag_arcsec2) < exptime_s / f64::from(n_sub),
        })
    }

    /// Ratio to the noise of a target of this magnitude (all of its light).
    ///
    /// # Errors
    /// As [`snr`] and [`Calculator::check`].
    pub fn snr(&self, area: Area, mag: f64, sky_mag_arcsec2: f64, exptime_s: f64, n_sub: u32) -> Result<f64> {
        let noise = self.summed_noise(area, sky_mag_arcsec2)?;
        snr(self.rate_e_s(mag) * self.summed_share(area), &noise, exptime_s, n_sub)
    }

    /// The time a magnitude needs for a ratio, split into at least `n_sub` exposures and so many that none saturates.
    ///
    /// # Errors
    /// As [`exposure_for_snr`] and [`Calculator::check`]; [`Error::Model`] when more than a million exposures were needed.
    pub fn needed(&self, area: Area, mag: f64, sky_mag_arcsec2: f64, n_sub: u32, wanted: f64) -> Result<Needed> {
        let noise = self.summed_noise(area, sky_mag_arcsec2)?;
        let rate = self.rate_e_s(mag) * self.summed_share(area);
        let unsaturated_s = self.unsaturated_s(area, mag, sky_mag_arcsec2);
        let exptime_s = exposure_for_snr(rate, &noise, n_sub, wanted)?;
        if exptime_s / f64::from(n_sub) <= unsaturated_s {
            return Ok(Needed { exptime_s, n_sub, unsaturated_s });
        }
        // exposures of the longest time allowed add in the squares of their ratios
        let one = snr(rate, &noise, unsaturated_s, 1)?;
        let count = (wanted / one).powi(2).ceil();
        if !(count <= 1e6) {
            let problem = format!(
                "magnitude {mag}: a pixel saturates in {unsaturated_s:.3e} s, and {count:.1e} such exposures are needed for a \
                 signal-to-noise ratio of {wanted}"
            );
            return Err(Error::Model { problem });
        }
        let n_sub = (count as u32).max(n_sub);
        Ok(Needed { exptime_s: exposure_for_snr(rate, &noise, n_sub, wanted)?, n_sub, unsaturated_s })
    }

    /// The noise in the area, after every number has been checked.
    fn summed_noise(&self, area: Area, sky_mag_arcsec2: f64) -> Result<Noise> {
        self.check()?;
        if let Area::Extended(omega) = area
            && !(omega > 0.0 && omega.is_finite())
        {
            return Err(Error::Model { problem: format!("solid angle {omega} arcsec2 is not above 0") });
        }
        if !sky_mag_arcsec2.is_finite() {
            return Err(Error::Model { problem: format!("sky {sky_mag_arcsec2} mag/arcsec2 is not a number") });
        }
        Ok(self.noise_px(sky_mag_arcsec2).over(self.summed_arcsec2(area) / self.pixel_arcsec.powi(2)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXEL: f64 = 0.195_748_5;

    fn cdk24() -> Calculator {
        Calculator::new(24.25, PIXEL, 1.45, 5_488.0)
    }

    #[test]
    fn the_published_pixel_limits_follow_from_sky_and_read_noise() {
        let published = Calculator::published(PIXEL);
        for (sky, snr, limit) in [(19.4, 1.0, 21.65), (19.4, 5.0, 19.67), (22.13, 1.0, 22.56), (22.13, 5.0, 20.27)] {
            let got = published.limit(Area::Pixel, sky, 10.0, 1, snr).unwrap();
            assert!((got.mag_arcsec2.unwrap() - limit).abs() < 0.006, "{sky} {snr}: {got:?}");
            assert!((got.variance_e2 - if sky < 20.0 { 84.6 } else { 13.6 }).abs() < 0.1, "{got:?}");
        }
    }

    #[test]
    fn a_larger_target_is_seen_at_a_fainter_surface_brightness() {
        // no read noise, much sky, no blur: 1.25 mag for ten times the solid angle
        let sky_limited = Calculator { fwhm_arcsec: 1e-6, read_noise_e: 0.0, ..cdk24() };
        let mu = |area| sky_limited.limit(area, 10.0, 1e6, 1, 5.0).unwrap().mag_arcsec2.unwrap();
        assert!((mu(Area::Extended(10.0)) - mu(Area::Arcsec2) - 1.25).abs() < 1e-4);
        // one arcsec² is a target of one arcsec²
        assert!((mu(Area::Extended(1.0)) - mu(Area::Arcsec2)).abs() < 1e-9);
        // and a pixel is a target of a pixel
        assert!((mu(Area::Extended(PIXEL * PIXEL)) - mu(Area::Pixel)).abs() < 1e-9);
    }

    #[test]
    fn a_target_that_shrinks_becomes_a_star() {
        let small = cdk24().limit(Area::Extended(1e-9), 20.0, 10.0, 1, 5.0).unwrap();
        let star = cdk24().limit(Area::Point, 20.0, 10.0, 1, 5.0).unwrap();
        assert!((small.mag - star.mag).abs() < 1e-8 && star.mag_arcsec2.is_none());
        assert!((star.summed_arcsec2 - 2.266_18 * 4.0).abs() < 1e-9);
    }

    #[test]
    fn an_aperture_of_two_thirds_of_the_fwhm_is_the_best_and_close_to_the_whole_image() {
        let at = |r: f64| {
            let calculator = Calculator { aper_r_arcsec: Some(r), read_noise_e: 0.0, ..cdk24() };
            calculator.limit(Area::Point, 18.0, 100.0, 1, 0.01).unwrap().mag
        };
        // under sky the best radius of a Gaussian is 0.673 FWHM (the root of e^x = 1 + 2x, x = 4 ln 2 r²/FWHM²)
        let best = (50..400).map(|i| 0.01 * f64::from(i)).max_by(|a, b| at(*a).total_cmp(&at(*b))).unwrap();
        assert!((best / 2.0 - 0.673).abs() < 0.006, "{best}");
        // 0.715 of the light in 1.425 FWHM²: 0.9 of the ratio of the image as a whole
        let whole = Calculator { read_noise_e: 0.0, ..cdk24() }.limit(Area::Point, 18.0, 100.0, 1, 0.01).unwrap().mag;
        assert!((whole - at(best) - 2.5 * (0.902f64.recip()).log10()).abs() < 0.003, "{whole} {}", at(best));
    }

    #[test]
    fn the_light_of_the_brightest_pixel_is_a_gaussians() {
        // by a sum over 401 x 401 points of the pixel
        let sigma = 2.0 / FWHM_PER_SIGMA;
        let at = |i: i32| (f64::from(i) / 400.0 - 0.5) * PIXEL;
        let one: f64 = (0..=400)
            .map(|i| (-0.5 * (at(i) / sigma).powi(2)).exp() * if i % 400 == 0 { 0.5 } else { 1.0 })
            .sum::<f64>()
            * PIXEL
            / 400.0;
        let share = one * one / (std::f64::consts::TAU * sigma * sigma);
        assert!((cdk24().peak_share(Area::Point) / share - 1.0).abs() < 1e-5);
    }

    #[test]
    fn at_the_magnitude_of_saturation_the_longest_exposure_is_this_one() {
        for area in [Area::Point, Area::Extended(1_130.0), Area::Pixel] {
            let mag = cdk24().saturation_mag(area, 20.0, 10.0).unwrap();
            assert!((cdk24().unsaturated_s(area, mag, 20.0) - 10.0).abs() < 1e-9);
        }
        // a sky that fills the pixels by itself has no such magnitude, and every limit under it says saturated
        assert_eq!(cdk24().saturation_mag(Area::Point, 8.0, 10.0), None);
        assert!(cdk24().limit(Area::Point, 8.0, 10.0, 1, 5.0).unwrap().saturated);
        assert!(!cdk24().limit(Area::Point, 20.0, 10.0, 1, 5.0).unwrap().saturated);
    }

    #[test]
    fn the_time_needed_gives_the_ratio_and_never_saturates() {
        for (mag, wanted) in [(20.0, 5.0), (8.0, 5.0), (5.0, 2_000.0), (12.0, 300.0)] {
            let got = cdk24().needed(Area::Point, mag, 20.0, 1, wanted).unwrap();
            let back = cdk24().snr(Area::Point, mag, 20.0, got.exptime_s, got.n_sub).unwrap();
            assert!((back / wanted - 1.0).abs() < 1e-9, "{mag}: {got:?} {back}");
            assert!(got.exptime_s / f64::from(got.n_sub) <= got.unsaturated_s * (1.0 + 1e-9), "{mag}: {got:?}");
        }
        assert!(cdk24().needed(Area::Point, 5.0, 20.0, 1, 2_000.0).unwrap().n_sub > 1);
        let error = cdk24().needed(Area::Point, 20.0, -10.0, 1, 1e3).unwrap_err().to_string();
        assert!(error.contains("saturates"), "{error}");
    }

    #[test]
    fn extinction_dims_the_target_and_not_the_sky() {
        let air = Calculator { extinction_mag: 0.12, ..cdk24() };
        let at = |c: &Calculator| c.limit(Area::Point, 20.0, 10.0, 1, 5.0).unwrap().mag;
        assert!((at(&cdk24()) - at(&air) - 0.12).abs() < 1e-12);
        assert_eq!(air.noise_px(20.0), cdk24().noise_px(20.0));
    }

    #[test]
    fn impossible_numbers_are_refused_by_name() {
        let limit = |c: Calculator| c.limit(Area::Point, 20.0, 10.0, 1, 5.0).unwrap_err().to_string();
        assert!(limit(Calculator { pixel_arcsec: 0.0, ..cdk24() }).contains("pixel scale 0"));
        assert!(limit(Calculator { fwhm_arcsec: -1.0, ..cdk24() }).contains("FWHM -1"));
        assert!(limit(Calculator { saturation_e: f64::NAN, ..cdk24() }).contains("saturation NaN"));
        assert!(limit(Calculator { extinction_mag: -0.1, ..cdk24() }).contains("extinction -0.1"));
        assert!(limit(Calculator { aper_r_arcsec: Some(0.0), ..cdk24() }).contains("aperture radius 0"));
        assert!(limit(Calculator { zp_mag: f64::INFINITY, ..cdk24() }).contains("zeropoint inf"));
        assert!(cdk24().limit(Area::Extended(0.0), 20.0, 10.0, 1, 5.0).is_err());
        assert!(cdk24().limit(Area::Point, f64::NAN, 10.0, 1, 5.0).is_err());
    }
}
