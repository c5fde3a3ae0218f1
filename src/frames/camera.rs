//! The detector: what one gain setting means in electrons, read noise and saturation.
//!
//! Gain settings in 0.1 dB, conversion factors in e⁻/ADU, noise and full well in e⁻, levels in ADU. A setting that is
//! not tabulated is an error: nothing is interpolated. It does not cover dark current and linearity.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::exposure::Exposure;
use super::frame::{ElectronsPerAdu, Gain, GainSetting};
use super::header::{CameraCheck, check_camera};
use super::overscan::overscan;
use crate::base::error::{Error, Result};
use crate::base::stats::median;
use crate::config;

/// The embedded cameras, with their source in the comment lines.
const CAMERAS: &str = include_str!("cameras.csv");
/// Largest count of a 16-bit converter \[ADU\].
const FULL_SCALE_16_BIT_ADU: f64 = 65_535.0;
/// Error of the digitised curves \[mag\]: plotted e⁻/ADU against full_well_e/65535 at setting 200.
const TABLE_ERR_MAG: f64 = 0.05;

/// One gain setting of a camera.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct GainRow {
    e_per_adu: Option<f64>,
    /// Where that is from.
    from: &'static str,
    read_noise_e: Option<f64>,
    full_well_e: Option<f64>,
}

/// A camera with its gain table, ready to say what a frame's numbers mean.
#[derive(Debug, Clone)]
pub struct Detector {
    camera: String,
    table: BTreeMap<i64, GainRow>,
    config: config::Detector,
    own: Own,
}

/// The configuration's own tables, by setting.
#[derive(Debug, Clone, Default)]
struct Own {
    e_per_adu: BTreeMap<i64, f64>,
    read_noise_e: BTreeMap<i64, f64>,
    full_well_e: BTreeMap<i64, f64>,
}

impl Detector {
    /// The camera of the configuration: the embedded table of that name, overridden by the configuration's own tables.
    ///
    /// # Errors
    /// [`Error::Config`] if the camera is unknown and neither `e_per_adu` nor `use_header_egain` is given.
    pub fn from_config(config: &config::Detector) -> Result<Detector> {
        let (_, table) = camera_table(&config.camera);
        if table.is_empty() && config.e_per_adu.is_empty() && !config.use_header_egain {
            return Err(Error::Config {
                key: "detector.camera".into(),
                problem: format!(
                    "\"{}\" is not in the table of cameras ({}); give detector.e_per_adu and detector.read_noise_e, \
                     or set detector.use_header_egain = true",
                    config.camera,
                    camera_names().join(", ")
                ),
            });
        }
        Self::of_any_camera(config)
    }

    /// As [`Detector::from_config`], of a camera that may be unknown: its table is then empty.
    ///
    /// # Errors
    /// [`Error::Config`] for an entry of the configuration's tables that is not a gain setting.
    pub(crate) fn of_any_camera(config: &config::Detector) -> Result<Detector> {
        let (camera, table) = camera_table(&config.camera);
        let own = Own {
            e_per_adu: by_setting("detector.e_per_adu", &config.e_per_adu)?,
            read_noise_e: by_setting("detector.read_noise_e", &config.read_noise_e)?,
            full_well_e: by_setting("detector.full_well_e", &config.full_well_e)?,
        };
        Ok(Detector { camera, table, config: config.clone(), own })
    }

    /// The detector at the gain this exposure was taken with.
    ///
    /// # Errors
    /// [`Error::GainNotTabulated`]; [`Error::Header`] if GAIN (or EGAIN, with `use_header_egain`) is absent;
    /// [`Error::Config`] if the read noise is not known.
    pub fn gain(&self, exposure: &Exposure) -> Result<Gain> {
        let header_error = |keyword: &str, problem: &str| Error::Header {
            path: exposure.path.clone(),
            keyword: keyword.into(),
            problem: problem.into(),
        };
        let setting = exposure.setting.map(|s| s.0);
        let (e_per_adu, source) = if self.config.use_header_egain {
            let value = exposure.header_e_per_adu.ok_or_else(|| {
                header_error("EGAIN", "absent or not positive; name your keyword in header.aliases.egain or set detector.use_header_egain = false")
            })?;
            (value, "header EGAIN".to_string())
        } else {
            let of_table = match setting {
                Some(setting) => self.e_per_adu(setting),
                // a camera without settings has one entry
                None => only(&self.own.e_per_adu).map(|g| (g, "pipeline.toml".into())),
            };
            of_table.ok_or_else(|| match setting {
                Some(setting) => Error::GainNotTabulated {
                    path: exposure.path.clone(),
                    setting,
                    camera: self.camera.clone(),
                },
                None => header_error(
                    "GAIN",
                    "no gain setting in the header; name your keyword in header.aliases.gain, set \
                     detector.use_header_egain = true, or give detector.e_per_adu its one entry \"0\" = electrons per ADU",
                ),
            })?
        };
        let in_header =
            ["RDNOISE", "READNOIS", "READNOISE"].iter().find_map(|k| exposure.header.number(k)).filter(|n| *n > 0.0);
        let read_noise_e = setting
            .and_then(|s| self.read_noise_e(s))
            .or_else(|| only(&self.own.read_noise_e).filter(|_| setting.is_none()))
            .or(in_header.filter(|_| self.config.use_header_egain))
            .ok_or_else(|| self.no_read_noise(setting))?;
        let full_well_e = match setting {
            Some(s) => self.full_well_e(s),
            None => only(&self.own.full_well_e),
        };
        let mut gain = self.assemble(setting, e_per_adu, source, read_noise_e, full_well_e);
        if exposure.header.green().is_some() {
            // the mean of two pixels stands for the electrons of both
            gain.e_per_adu = ElectronsPerAdu(2.0 * e_per_adu);
            gain.read_noise_e *= std::f64::consts::SQRT_2;
            gain.source += ", two green pixels";
        }
        Ok(gain)
    }

    /// The detector at a gain setting \[0.1 dB\], from the tables alone; `None` where one of the numbers is missing.
    #[must_use]
    pub fn gain_for_setting(&self, setting: i64) -> Option<Gain> {
        let (e_per_adu, source) = self.e_per_adu(setting)?;
        Some(self.assemble(Some(setting), e_per_adu, source, self.read_noise_e(setting)?, self.full_well_e(setting)))
    }

    /// Systematic error of the conversion factor \[mag\]: the configuration's, else the camera's; 0 for a camera
    /// that is not in the table and where the header's EGAIN is used.
    #[must_use]
    pub fn gain_table_err_mag(&self) -> f64 {
        let own = if self.table.is_empty() || self.config.use_header_egain { 0.0 } else { TABLE_ERR_MAG };
        self.config.gain_table_err_mag.unwrap_or(own)
    }

    /// Name of the table in force, and all its numbers as one line per gain setting (e⁻/ADU, read noise \[e⁻\], full
    /// well \[e⁻\]; `-` where there is none): what its hash is made of.
    #[must_use]
    pub fn gain_table(&self) -> (String, String) {
        let own =
            !(self.own.e_per_adu.is_empty() && self.own.read_noise_e.is_empty() && self.own.full_well_e.is_empty());
        let name = match (self.config.use_header_egain, own) {
            (true, _) => format!("{}: header EGAIN", self.camera),
            (false, true) => format!("{}, changed by the configuration", self.camera),
            (false, false) => self.camera.clone(),
        };
        let own = [&self.own.e_per_adu, &self.own.read_noise_e, &self.own.full_well_e];
        let settings: BTreeSet<i64> =
            self.table.keys().chain(own.iter().flat_map(|table| table.keys())).copied().collect();
        let cell = |value: Option<f64>| value.map_or("-".to_string(), |v| v.to_string());
        let line = |setting: i64| {
            let e_per_adu = cell(self.e_per_adu(setting).map(|(v, _)| v));
            let (noise, well) = (cell(self.read_noise_e(setting)), cell(self.full_well_e(setting)));
            format!("{setting} {e_per_adu} {noise} {well}\n")
        };
        (name, settings.into_iter().map(line).collect())
    }

    /// Whether the tables hold electrons per ADU and read noise at a gain setting \[0.1 dB\].
    pub(crate) fn tabulated(&self, setting: i64) -> (bool, bool) {
        (self.e_per_adu(setting).is_some(), self.read_noise_e(setting).is_some())
    }

    /// What the tables suggest for a gain setting \[0.1 dB\] that they lack: electrons per ADU by the decibel law,
    /// `g(s) = g(t) · 10^((t − s)/200)`, from the nearest setting t, and the read noise \[e⁻\] of that setting. Only
    /// for a proposal that the observer judges: the law does not know where a camera switches its conversion gain.
    pub(crate) fn suggestion(&self, setting: i64) -> Option<(f64, f64)> {
        let both = |t: &i64| Some((*t, self.e_per_adu(*t)?.0, self.read_noise_e(*t)?));
        let known = self.table.keys().chain(self.own.e_per_adu.keys()).filter_map(both);
        let (nearest, e_per_adu, read_noise_e) = known.min_by_key(|(t, _, _)| ((t - setting).abs(), *t))?;
        Some((e_per_adu * 10f64.powf((nearest - setting) as f64 / 200.0), read_noise_e))
    }

    /// The bias level of a frame by its overscan \[ADU\]; `None` where it has none, or the configuration leaves it out.
    ///
    /// # Errors
    /// Why BIASSEC of the header cannot be used. A file that cannot be read has none.
    pub fn overscan_adu(&self, exposure: &Exposure) -> std::result::Result<Option<f64>, String> {
        if !self.config.use_overscan {
            return Ok(None);
        }
        Ok(overscan(exposure, self.gain(exposure).ok().as_ref())?.map(|level| level.adu))
    }

    /// From now on no frame has a bias level of its own.
    pub fn leave_overscan_out(&mut self) {
        self.config.use_overscan = false;
    }

    /// The same with the bias level of the overscans of frames, their median, where they have some.
    #[must_use]
    pub(crate) fn at_overscan_of(&self, exposures: &[Exposure]) -> Detector {
        let levels = exposures.par_iter().filter_map(|exposure| self.overscan_adu(exposure).ok().flatten());
        let pedestal_adu = median(&mut levels.collect::<Vec<_>>()).unwrap_or(self.config.pedestal_adu);
        Detector { config: config::Detector { pedestal_adu, ..self.config.clone() }, ..self.clone() }
    }

    /// Bias level \[ADU\].
    #[must_use]
    pub fn pedestal_adu(&self) -> f64 {
        self.config.pedestal_adu
    }

    /// Level from which a pixel is saturated when nothing is known of the gain \[ADU\].
    pub(super) fn saturation_of_converter_adu(&self) -> f64 {
        self.config.saturation_frac * self.config.adc_max_adu
    }

    /// Whether the conversion factor is the header's EGAIN.
    pub(crate) fn uses_header_egain(&self) -> bool {
        self.config.use_header_egain
    }

    /// Share of full scale that is called saturated.
    pub(crate) fn saturation_frac(&self) -> f64 {
        self.config.saturation_frac
    }

    fn e_per_adu(&self, setting: i64) -> Option<(f64, String)> {
        if let Some(v) = self.own.e_per_adu.get(&setting) {
            return Some((*v, "pipeline.toml".into()));
        }
        let row = self.table.get(&setting)?;
        Some((row.e_per_adu?, format!("{} table: {}", self.camera, row.from)))
    }

    fn read_noise_e(&self, setting: i64) -> Option<f64> {
        self.own.read_noise_e.get(&setting).copied().or_else(|| self.table.get(&setting)?.read_noise_e)
    }

    fn full_well_e(&self, setting: i64) -> Option<f64> {
        self.own.full_well_e.get(&setting).copied().or_else(|| self.table.get(&setting)?.full_well_e)
    }

    fn no_read_noise(&self, setting: Option<i64>) -> Error {
        let problem = match setting {
            Some(s) => format!(
                "no read noise for gain setting {s} (0.1 dB) of camera {}; add \"{s}\" = electrons",
                self.camera
            ),
            None => {
                format!("camera {}: the frames have no gain setting; give one entry \"0\" = electrons", self.camera)
            }
        };
        Error::Config { key: "detector.read_noise_e".into(), problem }
    }

    /// Saturation: f · min(ADC maximum, pedestal + full well / g).
    fn assemble(
        &self,
        setting: Option<i64>,
        e_per_adu: f64,
        source: String,
        read_noise_e: f64,
        full_well_e: Option<f64>,
    ) -> Gain {
        let c = &self.config;
        let full_adu = full_well_e.map_or(c.adc_max_adu, |w| c.adc_max_adu.min(c.pedestal_adu + w / e_per_adu));
        Gain {
            setting: setting.map(GainSetting),
            e_per_adu: ElectronsPerAdu(e_per_adu),
            source,
            read_noise_e,
            pedestal_adu: c.pedestal_adu,
            saturation_adu: c.saturation_frac * full_adu,
        }
    }
}

/// The value of a table of one entry.
fn only(table: &BTreeMap<i64, f64>) -> Option<f64> {
    table.values().next().copied().filter(|_| table.len() == 1)
}

fn by_setting(key: &str, table: &BTreeMap<String, f64>) -> Result<BTreeMap<i64, f64>> {
    let parse = |(setting, value): (&String, &f64)| {
        let setting = setting.trim().parse().map_err(|_| Error::Config {
            key: format!("{key}.{setting}"),
            problem: format!("\"{setting}\" is not a gain setting (a whole number, 0.1 dB)"),
        })?;
        Ok((setting, *value))
    };
    table.iter().map(parse).collect()
}

/// Camera names are compared without case, spaces and the words ZWO and Pro.
fn plain_name(name: &str) -> String {
    let letters: String = name.to_ascii_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
    letters.replace("zwo", "").trim_end_matches("pro").to_string()
}

fn camera_rows() -> impl Iterator<Item = (String, i64, GainRow)> {
    CAMERAS.lines().filter(|l| !l.starts_with('#')).skip(1).filter_map(|line| {
        let mut cells = line.split(',').map(str::trim);
        let camera = cells.next()?.to_string();
        let setting: i64 = cells.next()?.parse().ok()?;
        let mut number = || cells.next().and_then(|c| c.parse::<f64>().ok());
        let (plotted, read_noise_e, full_well_e) = (number(), number(), number());
        let from_well = full_well_e.map(|w| w / FULL_SCALE_16_BIT_ADU).filter(|_| plotted.is_none());
        let from = match line.rsplit(',').next() {
            Some("decibel law") => "decibel law",
            _ if from_well.is_some() => "full_well_e/65535",
            _ => "maker's curve",
        };
        Some((camera, setting, GainRow { e_per_adu: plotted.or(from_well), from, read_noise_e, full_well_e }))
    })
}

fn camera_names() -> Vec<String> {
    let mut names: Vec<String> = camera_rows().map(|(n, _, _)| n).collect();
    names.dedup();
    names
}

/// The camera of the embedded table that a header names.
#[must_use]
pub fn table_camera(in_header: &str) -> Option<String> {
    camera_names().into_iter().find(|name| check_camera(in_header, name) == CameraCheck::Same)
}

fn camera_table(name: &str) -> (String, BTreeMap<i64, GainRow>) {
    let wanted = plain_name(name);
    let table: BTreeMap<i64, GainRow> =
        camera_rows().filter(|(n, _, _)| plain_name(n) == wanted).map(|(_, setting, row)| (setting, row)).collect();
    let known = camera_rows().map(|(n, _, _)| n).find(|n| plain_name(n) == wanted);
    (known.unwrap_or_else(|| name.to_string()), table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::pixel_scale_arcsec;

    fn detector(sets: &[&str]) -> Result<Detector> {
        let night = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\"i\"]\noutput = \"o\"\n";
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        Detector::from_config(&crate::config::Config::from_text(night, &sets)?.detector)
    }

    #[test]
    fn a_setting_the_table_lacks_is_taken_from_the_configuration_alone() {
        let own = ["detector.e_per_adu.225=0.06", "detector.read_noise_e.225=1.4", "detector.full_well_e.225=4000"];
        let g = detector(&own).unwrap().gain_for_setting(225).unwrap();
        assert_eq!((g.e_per_adu.0, g.read_noise_e), (0.06, 1.4));
        assert!((g.saturation_adu - 0.95 * 65_535.0).abs() < 1e-6); // 4000 e- need more counts than the file holds
    }

    #[test]
    fn the_asi6200_table_is_full_well_over_65535_above_the_switch() {
        let d = detector(&[]).unwrap();
        let g = d.gain_for_setting(200).unwrap();
        assert!((g.e_per_adu.0 - 5530.0 / 65535.0).abs() < 1e-15);
        assert_eq!(g.source, "asi6200mm table: full_well_e/65535");
        // Full well plus pedestal is beyond the converter, so the converter limits.
        assert!((g.saturation_adu - 0.95 * 65535.0).abs() < 1e-9);
        let low = d.gain_for_setting(0).unwrap();
        assert_eq!((low.e_per_adu.0, low.read_noise_e), (0.792, 3.52));
        assert!((low.saturation_adu - 0.95 * (500.0 + 51400.0 / 0.792)).abs() < 1e-9);
        assert!(d.gain_for_setting(97).is_none() && d.gain_for_setting(120).is_none());
        // both sides of the switch to high conversion gain: the same electrons per ADU, less than half the noise
        let (before, after) = (d.gain_for_setting(99).unwrap(), d.gain_for_setting(100).unwrap());
        assert_eq!((before.read_noise_e, after.read_noise_e), (3.4, 1.55));
        assert!((after.e_per_adu.0 - 51_400.0 * 10f64.powf(-0.5) / 65_535.0).abs() < 1e-4);
        let step_mag = 2.5 * (before.e_per_adu.0 / after.e_per_adu.0).log10();
        assert!((step_mag - 0.0125).abs() < 0.001, "{step_mag}"); // a tenth of a decibel is 0.0125 mag
        assert!((d.gain_table_err_mag() - 0.05).abs() < 1e-15);
    }

    #[test]
    fn other_cameras_have_the_electrons_per_count_that_headers_and_unity_gains_state() {
        let at = |camera: &str, setting| {
            detector(&[&format!("detector.camera={camera}")]).unwrap().gain_for_setting(setting).unwrap()
        };
        // headers of N.I.N.A. and of Huntsman, in counts of 14 and 12 bit
        assert!((at("ZWO ASI294MC Pro", 120).e_per_adu.0 - 1.00224 / 4.0).abs() < 1e-3);
        assert!((at("asi183mm", 100).e_per_adu.0 - 1.14474 / 16.0).abs() < 1e-3);
        // unity: one electron per count of the converter
        let native = |camera: &str, bits: i32| at(camera, 100).e_per_adu.0 * 2f64.powi(16 - bits);
        assert!(
            (native("asi533mm", 14) - 1.0).abs() < 0.05
                && (native("asi1600mm", 12) * 10f64.powf(-0.195) - 1.0).abs() < 0.05
        );
        assert_eq!(at("asi2600mm", 100).source, "asi2600mm table: decibel law");
        // between the settings nothing is interpolated
        assert!(detector(&["detector.camera=asi2600mm"]).unwrap().gain_for_setting(56).is_none());
    }

    #[test]
    fn the_configuration_overrides_the_table_and_unknown_cameras_need_it() {
        let d =
            detector(&["detector.e_per_adu.200=0.1", "detector.read_noise_e.200=2", "detector.full_well_e.200=1000"])
                .unwrap();
        let g = d.gain_for_setting(200).unwrap();
        assert_eq!((g.e_per_adu.0, g.read_noise_e, g.source.as_str()), (0.1, 2.0, "pipeline.toml"));
        assert!((g.saturation_adu - 0.95 * 10_500.0).abs() < 1e-9);
        let e = detector(&["detector.camera=qhy9"]).unwrap_err().to_string();
        assert!(e.contains("qhy9") && e.contains("asi6200mm") && e.contains("use_header_egain"), "{e}");
        assert_eq!(detector(&["detector.camera=ZWO ASI6200MM Pro"]).unwrap().camera, "asi6200mm");
    }

    #[test]
    fn a_pixel_of_the_cdk24_is_two_tenths_of_an_arcsecond() {
        assert!((pixel_scale_arcsec(3.76, 1, 3962.0) - 0.19575).abs() < 1e-4);
        assert!((pixel_scale_arcsec(3.76, 2, 3962.0) / pixel_scale_arcsec(3.76, 1, 3962.0) - 2.0).abs() < 1e-9);
    }
}
