//! The sensor: a radiance image through a telescope onto a detector, to electrons, counts and a FITS file.
//!
//! radiance → irradiance per detector pixel, blurred (`stamp`) → electrons ([`Sensor::expose`]) → counts
//! ([`Sensor::read_out`]) → file ([`write_frame`]). Not included: distortion, vignetting and the response of single
//! pixels, stars in the frame, the turning of the satellite within an exposure, colours that differ from the Sun's.

mod air;
mod blur;
mod exposure;
mod fits;
mod fourier;
mod resample;
mod settings;
mod snr;
mod stamp;

pub use exposure::{Exposure, Sensor};

pub use blur::{Blur, Pupil, Seeing};
pub use fits::{FrameFacts, write_frame};
pub use settings::{
    BlurSettings, FrameSettings, OpticsSettings, SENSORS, SamplingSettings, SeeingForm, SensorSettings, SkySettings,
};
pub use snr::{Snr, signal_to_noise};
pub use stamp::{Sampling, Stamp, stamp};

use ndarray::{Array2, Axis};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::base::error::{Error, Result};
use crate::brightness::Band;
use crate::brightness::light_sources::SUN_V_MAG;
use crate::brightness::spectrum::{MagSystem, SolarColumn, Spectrum};
use crate::frames::{Camera, Detector};
use crate::resolved::image::{Light, RadianceImage};
use crate::visibility::tracked::Optics;

/// Streams of the noise: one for each row of a frame.
const NOISE_STREAM: u64 = 1 << 40;

/// What lies in front of and behind a satellite in one exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyConditions {
    /// Surface brightness of the sky \[mag/arcsec²\], in V or the filter's band.
    pub sky_mag_arcsec2: f64,
    /// What the air takes of the satellite's light \[mag\].
    pub extinction_mag: f64,
}

impl Sensor {
    /// The sensor of the settings for radiances in a band \[µm\].
    ///
    /// `ZP = m_Sun + 2.5 lg (A τ ∫ f_λ T q λ/hc dλ)` over the band; `e⁻/s per W m⁻² = 10^(0.4 (ZP − m_Sun)) / ∫ f_λ dλ`
    /// with f_λ the Sun's at 1 au: the light is taken to have the Sun's colours.
    ///
    /// # Errors
    /// [`Error::Config`] for a camera, gain setting or filter that is not known; [`Error::Model`] for a band without
    /// light.
    pub fn new(settings: &SensorSettings, band_um: (f64, f64)) -> Result<Self> {
        let fault = |problem: String| Error::Model { problem };
        let band_nm = (1e3 * band_um.0, 1e3 * band_um.1);
        let sun_w_m2 = Spectrum::sun(SolarColumn::Extraterrestrial)?.irradiance_w_m2(band_nm.0, band_nm.1);
        if !(sun_w_m2 > 0.0) {
            return Err(fault(format!("band {} to {} um holds no sunlight", band_um.0, band_um.1)));
        }
        let filter = settings.filter()?;
        let optics = settings.optics()?;
        let (first, last) = optics.qe.range_nm();
        if !(band_nm.0 < last && band_nm.1 > first) {
            return Err(fault(format!(
                "band {} to {} um does not meet the detector's {first} to {last} nm",
                band_um.0, band_um.1
            )));
        }
        let optics = Optics { qe: settings::cut(&optics.qe, band_nm), ..optics };
        let zp_mag = optics.zeropoint_mag(filter.as_ref())?;
        let sun_mag = filter.as_ref().map_or(SUN_V_MAG, Band::sun_mag);
        let zp_band = filter.as_ref().map_or("V, Vega".into(), |b| {
            let system = match b.system() {
                MagSystem::Vega => "Vega",
                MagSystem::Ab => "AB",
            };
            format!("{}, {system}", b.name())
        });
        let setting = settings.frame.gain_setting;
        let gain =
            Detector::from_config(&settings.detector)?.gain_for_setting(setting).ok_or_else(|| Error::Config {
                key: "frame.gain_setting".into(),
                problem: format!("{setting} (0.1 dB) is not in the table of camera {}", settings.detector.camera),
            })?;
        Ok(Self {
            settings: settings.clone(),
            pixel_arcsec: settings.pixel_arcsec(),
            gain,
            zp_mag,
            e_s_per_w_m2: 10f64.powf(0.4 * (zp_mag - sun_mag)) / sun_w_m2,
            sun_w_m2,
            zp_band,
        })
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &SensorSettings {
        &self.settings
    }

    /// Exposes a picture, its middle `off_px` from the middle of the frame.
    ///
    /// Electrons of a pixel: `E_px t e 10^(−0.4 kX) + (sky + dark) t`. Binned pixels have the dark current of all they
    /// hold.
    ///
    /// # Errors
    /// [`Error::Model`] for an exposure time that is not above 0 or longer than a day, an air that is not a number, and
    /// as [`stamp`].
    pub fn expose(
        &self,
        image: &RadianceImage,
        exptime_s: f64,
        air: &SkyConditions,
        off_px: (f64, f64),
    ) -> Result<Exposure> {
        let fault = |problem: String| Err(Error::Model { problem });
        if !(exptime_s > 0.0 && exptime_s <= 86_400.0) {
            return fault(format!("exposure time {exptime_s} s is not above 0 and at most 86400"));
        }
        if !(air.sky_mag_arcsec2.is_finite() && air.extinction_mag >= 0.0 && air.extinction_mag.is_finite()) {
            return fault(format!(
                "sky {} mag/arcsec2, extinction {} mag: accepted are numbers, extinction from 0 up",
                air.sky_mag_arcsec2, air.extinction_mag
            ));
        }
        let s = &self.settings;
        let (nx, ny) = (s.frame.nx_px, s.frame.ny_px);
        let centre = (0.5 * (nx as f64 - 1.0) + off_px.0, 0.5 * (ny as f64 - 1.0) + off_px.1);
        let blur = s.blur(image.wavelength_um, exptime_s);
        let stamp = stamp(image, &blur, self.pixel_arcsec, centre, &s.sampling.into())?;
        let sky_e_px = 10f64.powf(-0.4 * (air.sky_mag_arcsec2 - self.zp_mag)) * self.pixel_arcsec.powi(2) * exptime_s;
        let dark_e_px = s.sky.dark_current_e_s_px * f64::from(s.frame.binning).powi(2) * exptime_s;
        let e_per_w_m2 = self.e_s_per_w_m2 * exptime_s * 10f64.powf(-0.4 * air.extinction_mag);
        let mut expected_e = Array2::from_elem((ny, nx), (sky_e_px + dark_e_px) as f32);
        let outside_frac = stamp.paint(&stamp.total(), e_per_w_m2, &mut expected_e);
        Ok(Exposure { exptime_s, expected_e, stamp, e_per_w_m2, sky_e_px, dark_e_px, outside_frac })
    }

    /// Reads an exposure out: photon noise, full well, read noise, converter, from a seed. The counts do not depend on
    /// the number of threads.
    #[must_use]
    pub fn read_out(&self, exposure: &Exposure, seed: u64) -> Array2<u16> {
        let camera = Camera::at(&self.gain, &self.settings.detector);
        let mut counts = Array2::<u16>::zeros(exposure.expected_e.dim());
        let rows = exposure.expected_e.axis_iter(Axis(0)).into_par_iter().zip(counts.axis_iter_mut(Axis(0)));
        rows.enumerate().for_each(|(j, (expected, mut counts))| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(NOISE_STREAM + j as u64);
            camera.read_out(expected.iter().copied(), counts.iter_mut(), &mut rng);
        });
        counts
    }

    /// Expected electrons at which a pixel is full \[e⁻\].
    #[must_use]
    pub fn full_well_e(&self) -> f64 {
        Camera::at(&self.gain, &self.settings.detector).full_well_e
    }

    /// Pixels of a frame that the reduction will call saturated: at or above the level of
    /// [`crate::frames::Gain::saturation_adu`].
    #[must_use]
    pub fn n_saturated(&self, counts: &Array2<u16>) -> usize {
        counts.iter().filter(|n| f64::from(**n) >= self.gain.saturation_adu).count()
    }

    /// Counts of a pixel without the satellite, expected: pedestal, sky and dark current \[ADU\].
    #[must_use]
    pub fn background_adu(&self, exposure: &Exposure) -> f64 {
        self.gain.pedestal_adu + (exposure.sky_e_px + exposure.dark_e_px) / self.gain.e_per_adu.0
    }

    /// Magnitude (V, or that of the filter's band) of an irradiance in the band; `None` without light.
    #[must_use]
    pub fn mag_of_w_m2(&self, w_m2: f64) -> Option<f64> {
        (w_m2 > 0.0).then(|| self.zp_mag - 2.5 * (w_m2 * self.e_s_per_w_m2).log10())
    }
}

impl Exposure {
    /// Electrons of one light, all of it, also what fell outside the frame.
    #[must_use]
    pub fn light_e(&self, light: Light) -> f64 {
        let planes = self.stamp.planes.iter().filter(|(of, _)| *of == light);
        planes.map(|(_, plane)| plane.sum()).sum::<f64>() * self.e_per_w_m2
    }

    /// Electrons of all lights.
    #[must_use]
    pub fn satellite_e(&self) -> f64 {
        self.stamp.planes.iter().map(|(_, plane)| plane.sum()).sum::<f64>() * self.e_per_w_m2
    }

    /// Pixels whose expected electrons exceed what they hold.
    #[must_use]
    pub fn n_saturated(&self, full_well_e: f64) -> usize {
        self.expected_e.iter().filter(|e| f64::from(**e) > full_well_e).count()
    }
}
