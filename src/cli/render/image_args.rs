//! How the picture is made, from the command line.

use clap::Args;
use satphot::Error;
use satphot::brightness::Brdf;
use satphot::resolved::RenderSettings;
use satphot::resolved::light_source::InBand;
use satphot::resolved::settings::STARLIGHT_MAG_ARCSEC2;

use super::super::orbit_args::bad;

/// How the picture is made.
#[derive(Debug, Clone, Args)]
pub struct ImageArgs {
    /// Pixels along a side; of a strip: --frame-pixels
    #[arg(long, value_name = "N", default_value_t = 512, conflicts_with = "pass")]
    pixels: usize,
    /// Side of a pixel [arcsec] [default: the satellite fills the picture]
    #[arg(long, value_name = "ARCSEC")]
    pixel_arcsec: Option<f64>,
    /// Samples along a side of a pixel: N x N of them
    #[arg(long, value_name = "N", default_value_t = 2)]
    samples: usize,
    /// Directions that each sample traces towards Earth and sky; a power of two
    #[arg(long, value_name = "N", default_value_t = 16)]
    rays: usize,
    /// Sides of round shapes
    #[arg(long, value_name = "N", default_value_t = 32)]
    pub sides: usize,
    /// Band: two wavelengths [um], or B, V, R, I, g, r, i, z, G, or a file of wavelength_nm,transmission
    #[arg(long, value_name = "BAND", default_value = "0.3-1.05")]
    band: String,
    /// Light of the ground: a law by name, lambert:ALBEDO, or uniform:L, the same radiance L [W cm-2 sr-1 um-1] from all
    /// of the Earth in the place of Lunar-Earthshine, as published with 1e-9
    #[arg(long, value_name = "LAW", default_value = "earth-vegetation")]
    earth: String,
    /// Starlight: V surface brightness of the sky [mag/arcsec2], or SKY,AIRGLOW, or none
    #[arg(long, value_name = "MAG", default_value = "22,22")]
    starlight: String,
    /// Reflections between parts of the satellite: 0 or 1
    #[arg(long, value_name = "N", default_value_t = 0)]
    bounces: u8,
    /// Parts of the satellite hide no light from each other
    #[arg(long)]
    no_shadows: bool,
}

impl ImageArgs {
    /// The settings they stand for.
    pub fn settings(&self) -> anyhow::Result<RenderSettings> {
        let mut settings = RenderSettings {
            pixels: self.pixels,
            pixel_rad: self.pixel_arcsec.map(|a| (a / 3600.0).to_radians()),
            samples: self.samples,
            earth_rays: self.rays,
            sides: self.sides,
            band: InBand::parse(&self.band)?,
            starlight_mag_arcsec2: self.starlight()?,
            shadows: !self.no_shadows,
            bounce: match self.bounces {
                0 => false,
                1 => true,
                n => return Err(bad("--bounces", format!("{n}; accepted is 0 or 1"))),
            },
            ..RenderSettings::default()
        };
        let number = |text: &str| {
            let wrong = || bad("--earth", format!("\"{text}\" is not a number"));
            text.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(wrong)
        };
        match self.earth.split_once(':') {
            Some(("uniform", l)) => settings.uniform_earth_w_cm2_sr_um = Some(number(l)?),
            Some(("lambert", albedo)) => settings.model.earth = Brdf::Lambert { albedo: number(albedo)? },
            _ => {
                settings.model.earth = Brdf::named(&self.earth).map_err(|error| match error {
                    Error::Config { problem, .. } => {
                        bad("--earth", format!("{problem}, lambert:ALBEDO, or uniform:W_CM2_SR_UM"))
                    }
                    other => other.into(),
                })?;
            }
        }
        settings.model.earth.check("--earth")?;
        settings.check().map_err(by_option)?;
        Ok(settings)
    }

    fn starlight(&self) -> anyhow::Result<Option<[f64; 2]>> {
        let wrong = || {
            let usual = STARLIGHT_MAG_ARCSEC2;
            bad(
                "--starlight",
                format!(
                    "\"{}\"; accepted are none, SKY or SKY,AIRGLOW, e.g. {},{}",
                    self.starlight, usual[0], usual[1]
                ),
            )
        };
        if self.starlight == "none" {
            return Ok(None);
        }
        let numbers: Result<Vec<f64>, _> = self.starlight.split(',').map(|p| p.trim().parse::<f64>()).collect();
        match numbers.as_deref() {
            Ok([both]) => Ok(Some([*both; 2])),
            Ok([sky, airglow]) => Ok(Some([*sky, *airglow])),
            _ => Err(wrong()),
        }
    }
}

/// A setting out of range, by the name of its option.
fn by_option(error: Error) -> anyhow::Error {
    match error {
        Error::Config { key, problem } if key == "earth_rays" => bad("--rays", problem),
        Error::Config { key, problem } if key == "uniform_earth" => bad("--earth", problem),
        Error::Config { key, problem } => bad(&format!("--{}", key.replace('_', "-")), problem),
        other => other.into(),
    }
}
