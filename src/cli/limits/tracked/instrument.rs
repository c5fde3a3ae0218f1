//! The telescope of `satphot limits tracked`: options over configuration over preset, and where each number is from.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::brightness::Band;
use satphot::brightness::spectrum::Curve;
use satphot::config::{self, Config};
use satphot::frames::pixel_scale_arcsec;
use satphot::visibility::telescope::{CameraAt, GAIN_SETTING, preset};
use satphot::visibility::tracked::{
    CDK24_OBSTRUCTION, Calculator, DARK_E_S_PX, FILTER_TRANSMISSION, FWHM_ARCSEC, OPTICS_TRANSMISSION, Optics, flat_qe,
    qe_named,
};

use crate::cli::load;
use crate::cli::orbit_args::bad;

/// Where the telescope is from without a configuration.
pub const PRESET: &str = "preset macquarie-cdk24";

/// Telescope, camera and filter.
#[derive(Debug, Args)]
pub struct InstrumentArgs {
    /// Configuration with [telescope] and [detector]; without it the preset macquarie-cdk24
    #[arg(short, long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set a key of the configuration or preset, e.g. --set telescope.aperture_m=0.5 (repeatable)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    #[command(flatten)]
    telescope: TelescopeArgs,
    /// Extinction of the target [mag], k X: with it the limits are outside the atmosphere, else at the ground
    #[arg(long, value_name = "MAG", default_value_t = 0.0, allow_hyphen_values = true)]
    extinction_mag: f64,
}

/// What may differ from the telescope and camera of the configuration.
#[derive(Debug, Args)]
pub struct TelescopeArgs {
    /// Pass band: none, B, V, R, I, g, r, i, z, G, or a file of wavelength_nm,transmission. Without a filter magnitudes are V of a source
    /// of the Sun's colours
    #[arg(long, value_name = "BAND", default_value = "none")]
    band: String,
    /// Diameter of the shadow of the secondary over the aperture
    #[arg(long, value_name = "SHARE", default_value_t = CDK24_OBSTRUCTION)]
    obstruction: f64,
    /// Share of the light that mirrors and lenses pass
    #[arg(long, value_name = "SHARE", default_value_t = OPTICS_TRANSMISSION)]
    optics: f64,
    /// Share of the light the filter passes at its peak
    #[arg(long, value_name = "SHARE", default_value_t = FILTER_TRANSMISSION)]
    filter_transmission: f64,
    /// Quantum efficiency: a number, or a file of nm and electrons per photon [default: the camera's]
    #[arg(long, value_name = "QE|FILE")]
    qe: Option<String>,
    /// Zeropoint itself: magnitude of 1 e-/s at the telescope [default: from aperture, optics and camera]
    #[arg(long, value_name = "MAG", allow_hyphen_values = true)]
    zp_mag: Option<f64>,
    /// The same of a pixel: mag/arcsec2 that make 1 e-/s in it
    #[arg(long, value_name = "MAG", conflicts_with = "zp_mag", allow_hyphen_values = true)]
    zp_pixel_mag: Option<f64>,
    /// Pixel scale [arcsec] [default: from pixel and focal length; the paper prints 1]
    #[arg(long, value_name = "ARCSEC", allow_hyphen_values = true)]
    pixel_scale: Option<f64>,
    /// Gain setting of the camera [0.1 dB]
    #[arg(long, value_name = "SETTING", default_value_t = GAIN_SETTING, allow_hyphen_values = true)]
    gain_setting: i64,
    /// Read noise of a pixel [e-] [default: the camera's at the gain setting]
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    read_noise_e: Option<f64>,
    /// Dark current [e-/s/px]
    #[arg(long, value_name = "RATE", default_value_t = DARK_E_S_PX, allow_hyphen_values = true)]
    dark_e_s: f64,
    /// Saturation level of a pixel [e-] [default: full well or converter at the gain setting, the smaller]
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    saturation_e: Option<f64>,
    /// Full width at half maximum of a star [arcsec]
    #[arg(long, value_name = "ARCSEC", default_value_t = FWHM_ARCSEC, allow_hyphen_values = true)]
    fwhm_arcsec: f64,
    /// Radius of the aperture a star is measured in [arcsec] [default: 2.266 FWHM^2, all its light]
    #[arg(long, value_name = "ARCSEC", allow_hyphen_values = true)]
    aper_r_arcsec: Option<f64>,
}

/// A number of the answer and where it is from.
pub struct Setting {
    pub name: &'static str,
    pub value: f64,
    pub unit: &'static str,
    pub from: String,
}

/// The telescope, ready.
pub struct Instrument {
    pub title: String,
    pub calculator: Calculator,
    pub settings: Vec<Setting>,
    /// The band whose sky is looked up: V without a filter.
    pub sky_band: String,
    /// Magnitude system.
    pub mag_system: &'static str,
    /// The telescope of the published limits and the published zeropoint.
    pub is_preset: bool,
}

impl InstrumentArgs {
    pub fn instrument(&self) -> anyhow::Result<Instrument> {
        let named = self.config.is_some();
        let config = self.configuration()?;
        let source = match (named, self.sets.is_empty()) {
            (true, _) => "configuration",
            (false, true) => PRESET,
            (false, false) => "preset macquarie-cdk24 and --set",
        };
        let mut instrument = self.telescope.instrument(&config, source)?;
        instrument.calculator.extinction_mag = self.extinction_mag;
        instrument.calculator.check()?;
        let from = if self.extinction_mag == 0.0 { "default" } else { "option" }.to_owned();
        let extinction = Setting { name: "extinction", value: self.extinction_mag, unit: "mag", from };
        instrument.settings.push(extinction);
        Ok(instrument)
    }

    fn configuration(&self) -> anyhow::Result<Config> {
        match &self.config {
            Some(path) if !path.exists() => Err(bad(
                "-c",
                format!("{} is not there; without -c the preset macquarie-cdk24 is used", path.display()),
            )),
            Some(path) => load(path, &self.sets),
            None => Ok(preset(&self.sets)?),
        }
    }
}

impl TelescopeArgs {
    /// The telescope of a configuration, which comes from `source`, with these options; no extinction.
    pub fn instrument(&self, config: &Config, source: &str) -> anyhow::Result<Instrument> {
        let (telescope, detector) = (&config.telescope, &config.detector);
        let mut settings = Vec::new();
        let mut tell =
            |name, value, unit, from: &str| settings.push(Setting { name, value, unit, from: from.to_owned() });
        let filter = self.filter()?;

        let camera = self.camera(detector)?;
        let given = |is: bool, other: &str| if is { "option".to_owned() } else { other.to_owned() };
        let or_default = |value: f64, default: f64| if value == default { "default" } else { "option" };

        let computed_arcsec = pixel_scale_arcsec(detector.pixel_um, 1, telescope.focal_length_mm);
        let pixel_arcsec = self.pixel_scale.unwrap_or(computed_arcsec);
        if !(pixel_arcsec > 0.0 && pixel_arcsec.is_finite()) {
            return Err(bad("--pixel-scale", format!("{pixel_arcsec} arcsec is not above 0; give a positive number")));
        }

        let zp_given = self.zp_mag.or(self.zp_pixel_mag.map(|zp| zp - 2.5 * pixel_arcsec.powi(2).log10()));
        let zp_mag = match zp_given {
            Some(zp_mag) => zp_mag,
            None => {
                let optics = Optics {
                    aperture_m: telescope.aperture_m,
                    obstruction: self.obstruction,
                    transmission: self.optics,
                    filter_transmission: self.filter_transmission,
                    qe: self.quantum_efficiency(&detector.camera)?,
                };
                tell("aperture", optics.aperture_m, "m", source);
                tell(
                    "obstruction",
                    self.obstruction,
                    "of the diameter",
                    or_default(self.obstruction, CDK24_OBSTRUCTION),
                );
                tell("collecting area", optics.area_m2(), "m2", "computed");
                tell("optics", self.optics, "of the light", or_default(self.optics, OPTICS_TRANSMISSION));
                if filter.is_some() {
                    let from = or_default(self.filter_transmission, FILTER_TRANSMISSION);
                    tell("filter", self.filter_transmission, "of the light", from);
                }
                let peak = optics.qe.values().iter().copied().fold(0.0, f64::max);
                let from = given(self.qe.is_some(), &format!("maker's curve of {}", detector.camera));
                tell("quantum efficiency", peak, "e-/photon, peak", &from);
                optics.zeropoint_mag(filter.as_ref())?
            }
        };
        let calculator = Calculator {
            zp_mag,
            extinction_mag: 0.0,
            pixel_arcsec,
            fwhm_arcsec: self.fwhm_arcsec,
            aper_r_arcsec: self.aper_r_arcsec,
            dark_e_s_px: self.dark_e_s,
            read_noise_e: self.read_noise_e.unwrap_or(camera.map_or(f64::NAN, |c| c.read_noise_e)),
            saturation_e: self.saturation_e.unwrap_or(camera.map_or(f64::NAN, |c| c.saturation_e)),
        };
        calculator.check()?;
        tell("zeropoint", zp_mag, "mag = 1 e-/s", &given(zp_given.is_some(), "computed"));
        tell("zeropoint of a pixel", calculator.zp_pixel_mag_arcsec2(), "mag/arcsec2 = 1 e-/s", "computed");
        let pitch = format!("{} um / {} mm, {source}", detector.pixel_um, telescope.focal_length_mm);
        tell("pixel scale", pixel_arcsec, "arcsec", &given(self.pixel_scale.is_some(), &pitch));
        tell("FWHM", self.fwhm_arcsec, "arcsec", or_default(self.fwhm_arcsec, FWHM_ARCSEC));
        if let Some(r) = self.aper_r_arcsec {
            tell("aperture of a star", r, "arcsec radius", "option");
        }
        let table = format!("{} at gain setting {}", detector.camera, self.gain_setting);
        tell("read noise", calculator.read_noise_e, "e-", &given(self.read_noise_e.is_some(), &table));
        tell("dark current", self.dark_e_s, "e-/s/px", or_default(self.dark_e_s, DARK_E_S_PX));
        let limited = camera.map_or(String::new(), |c| format!("{} of {table}", c.saturated_by()));
        tell("saturation", calculator.saturation_e, "e-", &given(self.saturation_e.is_some(), &limited));

        let (sky_band, mag_system, of) = match &filter {
            None => ("V".to_owned(), "Vega", "no filter, V of a source of the Sun's colours".to_owned()),
            Some(band) if band.name() == "V" => ("V".to_owned(), "Vega", "V".to_owned()),
            Some(band) => {
                let system = satphot::bands::Band::named(band.name()).map_or("AB", satphot::bands::Band::mag_system);
                (band.name().to_owned(), system, format!("{}, {system}", band.name()))
            }
        };
        Ok(Instrument {
            title: format!("{}, {}, {of}", telescope.name, detector.camera),
            calculator,
            settings,
            sky_band,
            mag_system,
            is_preset: source == PRESET && self.pixel_scale.is_none(),
        })
    }

    fn filter(&self) -> anyhow::Result<Option<Band>> {
        if self.band == "none" {
            return Ok(None);
        }
        Band::of_config(&self.band).map(Some).map_err(|error| match error {
            Error::Config { .. } => bad(
                "--band",
                format!(
                    "\"{}\" is neither none, {} nor a file of wavelength_nm,transmission",
                    self.band,
                    satphot::config::Model::BANDS.join(", ")
                ),
            ),
            other => other.into(),
        })
    }

    /// The camera at the gain setting; not needed where its numbers are all given.
    fn camera(&self, detector: &config::Detector) -> anyhow::Result<Option<CameraAt>> {
        match CameraAt::new(detector, self.gain_setting) {
            Ok(camera) => Ok(Some(camera)),
            Err(_) if self.read_noise_e.is_some() && self.saturation_e.is_some() => Ok(None),
            Err(Error::Config { problem, .. }) => Err(bad(
                "--gain-setting",
                format!(
                    "{problem} (gain settings of asi6200mm: 0, 50, 99, 100, 150, ... 450; or give --read-noise-e and \
                         --saturation-e)"
                ),
            )),
            Err(other) => Err(other.into()),
        }
    }

    fn quantum_efficiency(&self, camera: &str) -> anyhow::Result<Curve> {
        match &self.qe {
            Some(text) => match text.parse::<f64>() {
                Ok(share) if share > 0.0 && share <= 1.0 => Ok(flat_qe(share)),
                Ok(share) => Err(bad("--qe", format!("{share} is not above 0 and at most 1"))),
                Err(_) => Ok(Curve::from_file(std::path::Path::new(text))?),
            },
            None => qe_named(camera)?.ok_or_else(|| {
                bad("--qe", format!("no quantum efficiency of camera {camera} is known; give --qe, or --zp-mag"))
            }),
        }
    }
}
