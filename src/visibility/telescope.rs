//! A telescope and camera of the configuration as the exposure calculator sees them.
//!
//! e⁻, arcsec. The calculator knows neither configuration nor gain tables; this is where they meet.

use crate::base::error::{Error, Result};
use crate::brightness::Band;
use crate::config::{self, Config};
use crate::frames::{Detector, pixel_scale_arcsec};
use crate::visibility::tracked::{
    CDK24_OBSTRUCTION, Calculator, FILTER_TRANSMISSION, OPTICS_TRANSMISSION, Optics, qe_named,
};

/// The gain setting of the star frames behind the published zeropoint \[0.1 dB\].
pub const GAIN_SETTING: i64 = 200;

/// A camera at one gain setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraAt {
    /// Electrons per ADU.
    pub e_per_adu: f64,
    /// Read noise of a pixel \[e⁻\].
    pub read_noise_e: f64,
    /// What the converter can count \[e⁻\]: `(ADC maximum − pedestal) g`.
    pub converter_e: f64,
    /// What a pixel can hold \[e⁻\]: full well or converter, the smaller.
    pub saturation_e: f64,
}

impl CameraAt {
    /// The camera of a configuration at a gain setting \[0.1 dB\].
    ///
    /// # Errors
    /// [`Error::Config`] for a camera or a setting the tables lack.
    pub fn new(detector: &config::Detector, gain_setting: i64) -> Result<Self> {
        let gain = Detector::from_config(detector)?.gain_for_setting(gain_setting).ok_or_else(|| Error::Config {
            key: "detector.e_per_adu".into(),
            problem: format!(
                "camera {} has no e/ADU and read noise at gain setting {gain_setting} (0.1 dB): another setting, or give \
                 detector.e_per_adu and detector.read_noise_e",
                detector.camera
            ),
        })?;
        let e_per_adu = gain.e_per_adu.0;
        // the saturation level of frames leaves a margin, which is taken back here
        let level_adu = gain.saturation_adu / detector.saturation_frac;
        Ok(Self {
            e_per_adu,
            read_noise_e: gain.read_noise_e,
            converter_e: (detector.adc_max_adu - detector.pedestal_adu) * e_per_adu,
            saturation_e: (level_adu - detector.pedestal_adu) * e_per_adu,
        })
    }

    /// Which of the two is the smaller.
    #[must_use]
    pub fn saturated_by(&self) -> &'static str {
        if self.saturation_e < self.converter_e * (1.0 - 1e-9) { "full well" } else { "converter" }
    }
}

/// The configuration of the preset: the CDK24 of Macquarie with its ASI6200MM.
///
/// # Errors
/// [`Error::Config`] when the embedded preset is damaged.
pub fn preset(sets: &[String]) -> Result<Config> {
    let text = "preset = \"macquarie-cdk24\"\n[night]\nname = \"limits\"\ninput = [\".\"]\noutput = \".\"\n";
    Config::from_text(text, sets)
}

/// The exposure calculator of that telescope at gain setting 200, with the zeropoint that its aperture, optics and camera
/// give in a band (`None`: without a filter, V of a source of the Sun's colours).
///
/// # Errors
/// As [`preset`], [`CameraAt::new`] and [`Optics::zeropoint_mag`].
pub fn macquarie(filter: Option<&Band>) -> Result<Calculator> {
    let config = preset(&[])?;
    let camera = CameraAt::new(&config.detector, GAIN_SETTING)?;
    let qe = qe_named(&config.detector.camera)?
        .ok_or_else(|| Error::Model { problem: format!("no quantum efficiency of {}", config.detector.camera) })?;
    let optics = Optics {
        aperture_m: config.telescope.aperture_m,
        obstruction: CDK24_OBSTRUCTION,
        transmission: OPTICS_TRANSMISSION,
        filter_transmission: FILTER_TRANSMISSION,
        qe,
    };
    let pixel_arcsec = pixel_scale_arcsec(config.detector.pixel_um, 1, config.telescope.focal_length_mm);
    Ok(Calculator::new(optics.zeropoint_mag(filter)?, pixel_arcsec, camera.read_noise_e, camera.saturation_e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_telescope_of_the_preset_has_its_published_pixel_and_the_gain_table_of_the_camera() {
        let calculator = macquarie(None).unwrap();
        assert!((calculator.pixel_arcsec - 0.195_748_528_896_790_1).abs() < 1e-6);
        assert_eq!(calculator.read_noise_e, 1.45);
        // 65 035 ADU of 5530/65535 e⁻ each are fewer than the well of 5530 e⁻
        assert!((calculator.saturation_e - 65_035.0 * 5_530.0 / 65_535.0).abs() < 1e-6);
        assert!((calculator.zp_mag - 24.25).abs() < 0.01);
    }

    #[test]
    fn converter_or_well_whichever_is_smaller() {
        let detector = preset(&[]).unwrap().detector;
        let at = |setting| CameraAt::new(&detector, setting).unwrap();
        assert_eq!((at(200).saturated_by(), at(0).saturated_by()), ("converter", "full well"));
        assert!((at(0).saturation_e - 51_400.0).abs() < 1e-6);
        let error = CameraAt::new(&detector, 120).unwrap_err().to_string();
        assert!(error.contains("120") && error.contains("detector.e_per_adu"), "{error}");
    }
}
