//! The exposure-time calculator of a telescope that follows a satellite.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyList;
use satphot::Config;
use satphot::base::constants::ARCSEC2_PER_SR;
use satphot::brightness::Band;
use satphot::frames::pixel_scale_arcsec;
use satphot::tables::{LIMITS, LimitRow};
use satphot::visibility::sky_brightness::{MoonInSky, moonlit_sky_v_mag_arcsec2};
use satphot::visibility::sky_brightness_table::{sky_at_moon_phase, sky_of_v};
use satphot::visibility::telescope::{CameraAt, preset};
use satphot::visibility::tracked::{
    Area, CDK24_OBSTRUCTION, Calculator, DARK_E_S_PX, FILTER_TRANSMISSION, OPTICS_TRANSMISSION, Optics, flat_qe,
    qe_named,
};

use crate::errors::{bad, raise};
use crate::table::{Columns, Data};

/// The telescope, the sky and what is looked for, as the package hands them over.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Request {
    config: Option<PathBuf>,
    settings: Vec<String>,
    band: String,
    obstruction: f64,
    optics: f64,
    filter_transmission: f64,
    qe: Option<f64>,
    zp_mag: Option<f64>,
    pixel_arcsec: Option<f64>,
    gain_setting: i64,
    read_noise_e: Option<f64>,
    dark_e_s_px: f64,
    saturation_e: Option<f64>,
    fwhm_arcsec: f64,
    aper_r_arcsec: Option<f64>,
    extinction_mag: f64,
    sky_mag_arcsec2: Option<Vec<f64>>,
    moon_phase_deg: Option<Vec<f64>>,
    moon_alt_deg: Option<Vec<f64>>,
    moon_sep_deg: Option<f64>,
    alt_deg: f64,
    dark_sky_mag_arcsec2: f64,
    k_mag_airmass: f64,
    exptime_s: f64,
    n_sub: u32,
    snr: Vec<f64>,
    mag: Option<f64>,
    omega_arcsec2: Option<f64>,
    area_m2: f64,
    range_km: f64,
}

/// One sky.
struct Sky {
    name: String,
    moon_phase_deg: Option<f64>,
    moon_alt_deg: Option<f64>,
    mag_arcsec2: f64,
}

/// Columns of the limits under every sky, and the zeropoint of the telescope [mag].
#[pyfunction]
pub fn limits<'py>(py: Python<'py>, request: Request) -> PyResult<(Bound<'py, PyList>, f64)> {
    let (rows, zp_mag) = py.detach(|| request.rows())?;
    let number = |value: &dyn Fn(&LimitRow) -> Option<f64>| {
        Data::Float(rows.iter().map(|r| value(r).unwrap_or(f64::NAN)).collect())
    };
    let whole = |value: &dyn Fn(&LimitRow) -> i64| Data::Int(rows.iter().map(value).collect());
    let text = |value: &dyn Fn(&LimitRow) -> String| Data::Text(rows.iter().map(value).collect());
    let mut columns = Columns::default();
    for (name, data) in [
        ("sky", text(&|r| r.sky.clone())),
        ("moon_phase_deg", number(&|r| r.moon_phase_deg)),
        ("moon_alt_deg", number(&|r| r.moon_alt_deg)),
        ("sky_mag_arcsec2", number(&|r| Some(r.sky_mag_arcsec2))),
        ("sky_e_s_px", number(&|r| Some(r.sky_e_s_px))),
        ("exptime_s", number(&|r| Some(r.exptime_s))),
        ("n_sub", whole(&|r| r.n_sub)),
        ("snr", number(&|r| Some(r.snr))),
        ("limit_of", text(&|r| r.limit_of.clone())),
        ("summed_arcsec2", number(&|r| Some(r.summed_arcsec2))),
        ("n_px", number(&|r| Some(r.n_px))),
        ("noise_var_e2", number(&|r| Some(r.noise_var_e2))),
        ("limit_mag", number(&|r| r.limit_mag)),
        ("mu_limit_mag_arcsec2", number(&|r| r.mu_limit_mag_arcsec2)),
        ("saturation_mag", number(&|r| r.saturation_mag)),
        ("saturated", whole(&|r| r.saturated)),
        ("mag", number(&|r| r.mag)),
        ("mag_snr", number(&|r| r.mag_snr)),
        ("mag_exptime_s", number(&|r| r.mag_exptime_s)),
        ("mag_n_sub", number(&|r| r.mag_n_sub.map(|n| n as f64))),
        ("reason", text(&|r| r.reason.clone())),
    ] {
        columns.of(&LIMITS, name, data);
    }
    Ok((columns.into_py(py)?, zp_mag))
}

impl Request {
    fn rows(&self) -> PyResult<(Vec<LimitRow>, f64)> {
        self.check()?;
        let filter = match self.band.as_str() {
            "none" => None,
            name => Some(Band::of_config(name).map_err(raise)?),
        };
        let sky_band = filter.as_ref().map_or("V", |band| band.name()).to_owned();
        let calculator = self.calculator(filter.as_ref())?;
        let omega = self.omega_arcsec2.unwrap_or_else(|| self.area_m2 / (1e3 * self.range_km).powi(2) * ARCSEC2_PER_SR);
        let areas = [Area::Pixel, Area::Arcsec2, Area::Point, Area::Extended(omega)];
        let mut rows = Vec::new();
        for sky in self.skies(&sky_band)? {
            for snr in &self.snr {
                for area in areas {
                    rows.push(self.row(&calculator, &sky, area, *snr).map_err(raise)?);
                }
            }
        }
        Ok((rows, calculator.zp_mag))
    }

    fn check(&self) -> PyResult<()> {
        let positive = [
            ("exptime_s", Some(self.exptime_s)),
            ("area_m2", Some(self.area_m2)),
            ("range_km", Some(self.range_km)),
            ("omega_arcsec2", self.omega_arcsec2),
            ("pixel_arcsec", self.pixel_arcsec),
        ];
        for (name, value) in positive.into_iter().chain(self.snr.iter().map(|snr| ("snr", Some(*snr)))) {
            if let Some(value) = value.filter(|v| !(*v > 0.0 && *v <= 1e12)) {
                return Err(bad(name, format!("{value} is not above 0 and at most 1e12")));
            }
        }
        let each = |values: &Option<Vec<f64>>| values.clone().unwrap_or_default();
        let ranges = [
            ("moon_phase_deg", each(&self.moon_phase_deg), [-180.0, 180.0]),
            ("moon_alt_deg", each(&self.moon_alt_deg), [-90.0, 90.0]),
            ("moon_sep_deg", self.moon_sep_deg.into_iter().collect(), [0.0, 180.0]),
            ("alt_deg", vec![self.alt_deg], [0.0, 90.0]),
            ("dark_sky_mag_arcsec2", vec![self.dark_sky_mag_arcsec2], [10.0, 30.0]),
            ("k_mag_airmass", vec![self.k_mag_airmass], [0.0, 3.0]),
            ("n_sub", vec![f64::from(self.n_sub)], [1.0, 1e6]),
            ("mag", self.mag.into_iter().collect(), [-100.0, 100.0]),
            ("qe", self.qe.into_iter().collect(), [f64::MIN_POSITIVE, 1.0]),
        ];
        for (name, values, [low, high]) in ranges {
            if let Some(value) = values.into_iter().find(|v| !(low..=high).contains(v)) {
                return Err(bad(name, format!("{value} is outside {low} to {high}")));
            }
        }
        Ok(())
    }

    fn calculator(&self, filter: Option<&Band>) -> PyResult<Calculator> {
        let config = match &self.config {
            Some(path) => Config::load(path, &self.settings),
            None => preset(&self.settings),
        };
        let config = config.map_err(raise)?;
        let (telescope, detector) = (&config.telescope, &config.detector);
        let camera = match CameraAt::new(detector, self.gain_setting) {
            Ok(camera) => Some(camera),
            Err(_) if self.read_noise_e.is_some() && self.saturation_e.is_some() => None,
            Err(error) => return Err(raise(error)),
        };
        let pixel_arcsec =
            self.pixel_arcsec.unwrap_or(pixel_scale_arcsec(detector.pixel_um, 1, telescope.focal_length_mm));
        let zp_mag = match self.zp_mag {
            Some(zp_mag) => zp_mag,
            None => {
                let qe = match self.qe {
                    Some(share) => flat_qe(share),
                    None => qe_named(&detector.camera).map_err(raise)?.ok_or_else(|| {
                        let camera = &detector.camera;
                        bad("qe", format!("no quantum efficiency of camera {camera} is known; give qe, or zp_mag"))
                    })?,
                };
                let optics = Optics {
                    aperture_m: telescope.aperture_m,
                    obstruction: self.obstruction,
                    transmission: self.optics,
                    filter_transmission: self.filter_transmission,
                    qe,
                };
                optics.zeropoint_mag(filter).map_err(raise)?
            }
        };
        let calculator = Calculator {
            zp_mag,
            extinction_mag: self.extinction_mag,
            pixel_arcsec,
            fwhm_arcsec: self.fwhm_arcsec,
            aper_r_arcsec: self.aper_r_arcsec,
            dark_e_s_px: self.dark_e_s_px,
            read_noise_e: self.read_noise_e.or(camera.map(|c| c.read_noise_e)).unwrap_or(f64::NAN),
            saturation_e: self.saturation_e.or(camera.map(|c| c.saturation_e)).unwrap_or(f64::NAN),
        };
        calculator.check().map_err(raise)?;
        Ok(calculator)
    }

    /// Skies that are given, of a Moon that stands somewhere, or of the Moon's age.
    fn skies(&self, band: &str) -> PyResult<Vec<Sky>> {
        if let Some(given) = &self.sky_mag_arcsec2 {
            let sky = |mag_arcsec2: &f64| Sky {
                name: "given".into(),
                moon_phase_deg: None,
                moon_alt_deg: None,
                mag_arcsec2: *mag_arcsec2,
            };
            return Ok(given.iter().map(sky).collect());
        }
        let of_age = |name: String, phase_deg: f64| -> PyResult<Sky> {
            let mag_arcsec2 = sky_at_moon_phase(band, phase_deg).map_err(raise)?;
            Ok(Sky { name, moon_phase_deg: Some(phase_deg), moon_alt_deg: None, mag_arcsec2 })
        };
        match (&self.moon_phase_deg, &self.moon_alt_deg) {
            (None, None) => Ok(vec![of_age("full Moon".into(), 0.0)?, of_age("new Moon".into(), 180.0)?]),
            (None, Some(_)) => Err(bad("moon_alt_deg", "needs moon_phase_deg".into())),
            (Some(phases), None) => {
                phases.iter().map(|phase| of_age(format!("Moon {phase} deg from full"), *phase)).collect()
            }
            (Some(phases), Some(altitudes)) if phases.len() == altitudes.len() => {
                phases.iter().zip(altitudes).map(|(phase, alt)| self.moonlit(band, *phase, *alt)).collect()
            }
            (Some(phases), Some(altitudes)) => {
                Err(bad("moon_alt_deg", format!("{} altitudes for {} phases", altitudes.len(), phases.len())))
            }
        }
    }

    fn moonlit(&self, band: &str, phase_deg: f64, moon_alt_deg: f64) -> PyResult<Sky> {
        let (near, far) = ((self.alt_deg - moon_alt_deg).abs(), 180.0 - (self.alt_deg + moon_alt_deg).abs());
        let sep_deg = self.moon_sep_deg.unwrap_or(90.0_f64.max(near).min(far));
        if !(near - 0.01..=far + 0.01).contains(&sep_deg) {
            let problem = format!(
                "the Moon at {moon_alt_deg} deg is between {near} and {far} deg from a line of sight at {} deg, not {sep_deg}",
                self.alt_deg
            );
            return Err(bad("moon_sep_deg", problem));
        }
        let moon = MoonInSky {
            alt_rad: moon_alt_deg.to_radians(),
            phase_rad: phase_deg.to_radians(),
            sep_rad: sep_deg.to_radians(),
        };
        let (dark, k) = (self.dark_sky_mag_arcsec2, self.k_mag_airmass);
        let v = moonlit_sky_v_mag_arcsec2(dark, k, self.alt_deg.to_radians(), Some(moon));
        let place = if moon_alt_deg > 0.0 { format!(" at {moon_alt_deg} deg") } else { ", set".into() };
        Ok(Sky {
            name: format!("Moon {phase_deg} deg from full{place}"),
            moon_phase_deg: Some(phase_deg),
            moon_alt_deg: Some(moon_alt_deg),
            mag_arcsec2: sky_of_v(band, v).map_err(raise)?,
        })
    }

    fn row(&self, calculator: &Calculator, sky: &Sky, area: Area, snr: f64) -> satphot::Result<LimitRow> {
        let limit = calculator.limit(area, sky.mag_arcsec2, self.exptime_s, self.n_sub, snr)?;
        let surface = matches!(area, Area::Pixel | Area::Arcsec2);
        let mag = self.mag.filter(|_| !surface);
        let exposure_s = self.exptime_s / f64::from(self.n_sub);
        let mag_snr = mag.map(|m| calculator.snr(area, m, sky.mag_arcsec2, self.exptime_s, self.n_sub)).transpose()?;
        let (needed, reason) = match mag.map(|m| calculator.needed(area, m, sky.mag_arcsec2, self.n_sub, snr)) {
            Some(Err(error)) => (None, error.to_string().trim_start_matches("model: ").to_owned()),
            Some(Ok(needed)) => (Some(needed), String::new()),
            None => (None, String::new()),
        };
        Ok(LimitRow {
            sky: sky.name.clone(),
            moon_phase_deg: sky.moon_phase_deg,
            moon_alt_deg: sky.moon_alt_deg,
            sky_mag_arcsec2: sky.mag_arcsec2,
            sky_e_s_px: calculator.noise_px(sky.mag_arcsec2).sky_e_s,
            exptime_s: self.exptime_s,
            n_sub: i64::from(self.n_sub),
            snr,
            limit_of: area.name().into(),
            summed_arcsec2: limit.summed_arcsec2,
            n_px: limit.n_px,
            noise_var_e2: limit.variance_e2,
            limit_mag: (!surface).then_some(limit.mag),
            mu_limit_mag_arcsec2: limit.mag_arcsec2,
            saturation_mag: calculator.saturation_mag(area, sky.mag_arcsec2, exposure_s).filter(|_| !surface),
            saturated: i64::from(limit.saturated),
            mag,
            mag_snr,
            mag_exptime_s: needed.map(|n| n.exptime_s),
            mag_n_sub: needed.map(|n| i64::from(n.n_sub)),
            reason,
        })
    }
}

/// What is taken for a telescope of which nothing else is said.
#[pyfunction]
pub fn limit_defaults() -> std::collections::BTreeMap<&'static str, f64> {
    [
        ("obstruction", CDK24_OBSTRUCTION),
        ("optics", OPTICS_TRANSMISSION),
        ("filter_transmission", FILTER_TRANSMISSION),
        ("dark_e_s_px", DARK_E_S_PX),
    ]
    .into()
}
