//! telescope.toml -> [`SensorSettings`]: optics, camera, frame, blur and sky of a sensor, units in the keys.
//!
//! The sections site, telescope and detector are those of pipeline.toml. Unknown keys are errors; ranges are checked once.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::blur::{Blur, Pupil, Seeing};
use super::stamp::Sampling;
use crate::base::error::{Error, Result};
use crate::brightness::Band;
use crate::brightness::spectrum::Curve;
use crate::config::{self, range, read_layers};
use crate::frames::pixel_scale_arcsec;
use crate::visibility::tracked::{Optics, flat_qe, qe_named};

/// Sensors known by name, and their text.
pub const SENSORS: &[(&str, &str)] = &[("macquarie-cdk24", include_str!("../../presets/sensor_cdk24.toml"))];

/// A telescope with its camera, its air and its sky.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SensorSettings {
    /// Embedded preset that fills site, telescope and detector.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// The observatory.
    pub site: config::Site,
    /// The optics.
    pub telescope: config::Telescope,
    /// The camera.
    pub detector: config::Detector,
    /// What stands in the light.
    pub optics: OpticsSettings,
    /// The frame.
    pub frame: FrameSettings,
    /// What blurs.
    pub blur: BlurSettings,
    /// What adds light.
    pub sky: SkySettings,
    /// Of the reduction; presets bring it, the sensor does not use it.
    #[serde(default)]
    pub photometry: config::Photometry,
    /// How finely the picture is blurred.
    #[serde(default)]
    pub sampling: SamplingSettings,
}

/// What stands in the light.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct OpticsSettings {
    /// Diameter of the central obstruction over that of the aperture.
    pub obstruction: f64,
    /// Share of the light that mirrors and lenses pass.
    pub transmission: f64,
    /// `none`, `V`, `g`, `r`, `i`, or a file of wavelength_nm,transmission.
    pub filter: String,
    /// Share of the light the filter passes at its peak.
    pub filter_transmission: f64,
    /// Electrons per photon at every wavelength; the camera's curve if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub qe: Option<f64>,
}

/// The frame.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct FrameSettings {
    /// Columns \[px\].
    pub nx_px: usize,
    /// Rows \[px\].
    pub ny_px: usize,
    /// Binning; the pixel pitch is `detector.pixel_um` times this.
    pub binning: u32,
    /// Gain setting of the camera \[0.1 dB\].
    pub gain_setting: i64,
}

/// Form of a star's image through the air.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SeeingForm {
    /// Above the air.
    None,
    /// Gaussian.
    Gaussian,
    /// Moffat of exponent `moffat_beta`.
    Moffat,
}

/// What blurs.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BlurSettings {
    /// Form of the seeing.
    pub seeing: SeeingForm,
    /// FWHM of the seeing \[arcsec\].
    pub fwhm_arcsec: f64,
    /// Exponent of the Moffat.
    pub moffat_beta: f64,
    /// Whether the aperture diffracts.
    pub diffraction: bool,
    /// Tracking error within an exposure, rms per axis \[arcsec\].
    pub jitter_arcsec: f64,
    /// Steady drift of the tracking \[arcsec/s\].
    pub drift_arcsec_s: f64,
    /// Its position angle, north through east \[deg\].
    pub drift_pa_deg: f64,
}

/// What adds light.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SkySettings {
    /// The sky without Moon and twilight \[V mag/arcsec²\].
    pub dark_v_mag_arcsec2: f64,
    /// Extinction of the target, and of moonlight before it is scattered \[mag/airmass\].
    pub k_mag_airmass: f64,
    /// Dark current of an unbinned pixel \[e⁻/s\].
    pub dark_current_e_s_px: f64,
}

/// How finely the picture is blurred; the defaults are those of [`Sampling`].
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct SamplingSettings {
    /// Steps of the grid per FWHM.
    pub steps_per_fwhm: f64,
    /// Half the side of a star's image \[FWHM\].
    pub reach_fwhm: f64,
}

impl Default for SamplingSettings {
    fn default() -> Self {
        let Sampling { steps_per_fwhm, reach_fwhm } = Sampling::default();
        Self { steps_per_fwhm, reach_fwhm }
    }
}

impl From<SamplingSettings> for Sampling {
    fn from(s: SamplingSettings) -> Self {
        Self { steps_per_fwhm: s.steps_per_fwhm, reach_fwhm: s.reach_fwhm }
    }
}

impl SensorSettings {
    /// A sensor of [`SENSORS`] by its name, or of a file; `--set`-like `key=value` settings win over both.
    ///
    /// # Errors
    /// [`Error::Config`] for a name that is neither, an unknown key, a value out of range; [`Error::Io`].
    pub fn named(name: &str, sets: &[String]) -> Result<Self> {
        if let Some((_, text)) = SENSORS.iter().find(|(known, _)| *known == name) {
            return Self::from_text(text, sets);
        }
        let path = Path::new(name);
        if !path.exists() {
            let known = SENSORS.iter().map(|(n, _)| *n).collect::<Vec<_>>().join(", ");
            let problem = format!("\"{name}\" is neither a file nor a sensor known by name ({known})");
            return Err(Error::Config { key: "sensor".into(), problem });
        }
        Self::from_text(&std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?, sets)
    }

    /// From the text of a telescope.toml.
    ///
    /// # Errors
    /// [`Error::Config`].
    pub fn from_text(text: &str, sets: &[String]) -> Result<Self> {
        let settings: Self = read_layers(text, sets)?;
        settings.check()?;
        Ok(settings)
    }

    fn check(&self) -> Result<()> {
        let (f, b, s) = (&self.frame, &self.blur, &self.sky);
        range("telescope.aperture_m", self.telescope.aperture_m, 1e-3, 999.0, "m")?;
        range("telescope.focal_length_mm", self.telescope.focal_length_mm, 1.0, 1e6, "mm")?;
        range("detector.pixel_um", self.detector.pixel_um, 0.1, 1e3, "um")?;
        range("frame.nx_px", f.nx_px as f64, 8.0, 32_768.0, "px")?;
        range("frame.ny_px", f.ny_px as f64, 8.0, 32_768.0, "px")?;
        range("frame.binning", f64::from(f.binning), 1.0, 64.0, "")?;
        range("blur.fwhm_arcsec", b.fwhm_arcsec, 0.0, 600.0, "arcsec")?;
        range("blur.moffat_beta", b.moffat_beta, 1.2, 50.0, "")?;
        range("blur.jitter_arcsec", b.jitter_arcsec, 0.0, 600.0, "arcsec")?;
        range("blur.drift_arcsec_s", b.drift_arcsec_s, 0.0, 3_600.0, "arcsec/s")?;
        range("blur.drift_pa_deg", b.drift_pa_deg, -360.0, 360.0, "deg")?;
        range("sky.dark_v_mag_arcsec2", s.dark_v_mag_arcsec2, 0.0, 40.0, "mag/arcsec2")?;
        range("sky.k_mag_airmass", s.k_mag_airmass, 0.0, 5.0, "mag/airmass")?;
        range("sky.dark_current_e_s_px", s.dark_current_e_s_px, 0.0, 1e6, "e-/s/px")?;
        if let Some(qe) = self.optics.qe {
            range("optics.qe", qe, 1e-6, 1.0, "e-/photon")?;
        }
        Ok(())
    }

    /// Side of a binned pixel on the sky \[arcsec\].
    #[must_use]
    pub fn pixel_arcsec(&self) -> f64 {
        pixel_scale_arcsec(self.detector.pixel_um, self.frame.binning, self.telescope.focal_length_mm)
    }

    /// What stands between the sky and the electrons.
    ///
    /// # Errors
    /// [`Error::Config`] for a camera without a known quantum efficiency.
    pub fn optics(&self) -> Result<Optics> {
        let o = &self.optics;
        let qe = match o.qe {
            Some(qe) => flat_qe(qe),
            None => qe_named(&self.detector.camera)?.ok_or_else(|| Error::Config {
                key: "optics.qe".into(),
                problem: format!("no curve of {} is known; give electrons per photon, e.g. 0.7", self.detector.camera),
            })?,
        };
        Ok(Optics {
            aperture_m: self.telescope.aperture_m,
            obstruction: o.obstruction,
            transmission: o.transmission,
            filter_transmission: o.filter_transmission,
            qe,
        })
    }

    /// The filter; `None` without one.
    ///
    /// # Errors
    /// As [`Band::of_config`].
    pub fn filter(&self) -> Result<Option<Band>> {
        match self.optics.filter.as_str() {
            "none" => Ok(None),
            name => Band::of_config(name).map(Some).map_err(|error| match error {
                Error::Config { problem, .. } => Error::Config { key: "optics.filter".into(), problem },
                other => other,
            }),
        }
    }

    /// What blurs an exposure of `exptime_s` at a wavelength.
    #[must_use]
    pub fn blur(&self, wavelength_um: f64, exptime_s: f64) -> Blur {
        let b = &self.blur;
        let seeing = match b.seeing {
            SeeingForm::None => Seeing::None,
            SeeingForm::Gaussian => Seeing::Gaussian { fwhm_arcsec: b.fwhm_arcsec },
            SeeingForm::Moffat => Seeing::Moffat { fwhm_arcsec: b.fwhm_arcsec, beta: b.moffat_beta },
        };
        let pupil = b.diffraction.then_some(Pupil {
            aperture_m: self.telescope.aperture_m,
            obstruction: self.optics.obstruction,
            wavelength_um,
        });
        // x of the picture grows to the west, position angles to the east
        let (sin, cos) = b.drift_pa_deg.to_radians().sin_cos();
        let drift = b.drift_arcsec_s * exptime_s;
        Blur { seeing, pupil, jitter_arcsec: b.jitter_arcsec, drift_arcsec: (-drift * sin, drift * cos) }
    }

    /// The settings as TOML.
    ///
    /// # Errors
    /// [`Error::Config`] if they cannot be written as TOML.
    pub fn to_toml(&self) -> Result<String> {
        toml::to_string_pretty(self).map_err(|e| Error::Config { key: "sensor".into(), problem: e.to_string() })
    }
}

/// A curve cut to a range of wavelengths \[nm\].
pub(super) fn cut(curve: &Curve, (from_nm, to_nm): (f64, f64)) -> Curve {
    let ends = [from_nm.max(curve.range_nm().0), to_nm.min(curve.range_nm().1)];
    let mut nm: Vec<f64> = curve.nm().iter().copied().filter(|x| ends[0] < *x && *x < ends[1]).collect();
    nm.extend(ends.iter().filter(|x| (from_nm..=to_nm).contains(*x)));
    nm.sort_by(f64::total_cmp);
    Curve::from_rows(&nm.iter().map(|x| vec![*x, curve.at(*x)]).collect::<Vec<_>>(), 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sensor_of_the_paper_has_the_papers_pixel_and_no_filter() {
        let s = SensorSettings::named("macquarie-cdk24", &[]).unwrap();
        assert!((s.pixel_arcsec() - 0.195_748_5).abs() < 1e-6);
        assert!(s.filter().unwrap().is_none());
        assert!((s.optics().unwrap().area_m2() - 0.227_689).abs() < 1e-6);
        let again = SensorSettings::from_text(&s.to_toml().unwrap(), &[]).unwrap();
        assert_eq!(again.to_toml().unwrap(), s.to_toml().unwrap());
    }

    #[test]
    fn a_sensor_that_makes_no_sense_is_refused_by_key_and_value() {
        for (set, said) in [
            ("frame.nx_px=1", "frame.nx_px: 1 "),
            ("blur.jitter_arcsec=-1", "blur.jitter_arcsec: -1"),
            ("blur.seeing=sharp", "blur.seeing"),
            ("optics.qe=1.5", "optics.qe: 1.5"),
            ("sky.dark=3", "sky.dark"),
            ("frame.binning=0", "frame.binning: 0"),
        ] {
            let error = SensorSettings::named("macquarie-cdk24", &[set.into()]).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
        let error = SensorSettings::named("no-such-thing", &[]).unwrap_err().to_string();
        assert!(error.contains("no-such-thing") && error.contains("macquarie-cdk24"), "{error}");
        let other = SensorSettings::named("macquarie-cdk24", &["optics.filter=Q".into()]).unwrap();
        assert!(other.filter().unwrap_err().to_string().contains("optics.filter"));
    }

    #[test]
    fn a_drift_to_the_east_moves_left() {
        let s = SensorSettings::named("macquarie-cdk24", &["blur.drift_arcsec_s=2".into()]).unwrap();
        let (x, y) = s.blur(0.6, 3.0).drift_arcsec;
        assert!((x + 6.0).abs() < 1e-12 && y.abs() < 1e-12);
    }

    #[test]
    fn a_curve_is_cut_at_both_ends() {
        let c = cut(&flat_qe(0.5), (400.0, 700.0));
        assert_eq!((c.range_nm(), c.at(400.0), c.at(700.0)), ((400.0, 700.0), 0.5, 0.5));
        assert_eq!(cut(&flat_qe(0.5), (100.0, 5_000.0)).range_nm(), (350.0, 1_000.0));
    }
}
