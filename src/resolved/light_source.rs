//! Sun, Moon and starlight at a satellite in watts per square metre of a band, and the V magnitude they carry.
//!
//! Irradiances W m⁻², radiances W m⁻² sr⁻¹, wavelengths µm. Surfaces are grey: the colour of a light is that of its
//! light source.

use crate::base::constants::ARCSEC2_PER_SR;
use crate::base::constants::{AU_KM, MOON_RADIUS_KM, SUN_RADIUS_KM};
use crate::base::error::{Error, Result};
use crate::base::vector::{Itrs, Vector};
use crate::brightness::light_sources::{SourceSettings, flux_of_mag, moonlight, sunlight};
use crate::brightness::shadow::{Colour, lit_fraction};
use crate::brightness::spectrum::{SolarColumn, Spectrum};
use crate::brightness::{Band, Brdf, Ground, ModelSettings, NearMoon, Scene};

/// Band of the published simulation \[µm\].
pub const WIDE_UM: (f64, f64) = (0.3, 1.05);
/// Wavelengths between which the Moon's colour is known \[nm\].
const MOON_NM: (f64, f64) = (350.0, 2383.0);
/// The band in which radiances are stated.
#[derive(Debug, Clone, PartialEq)]
pub enum InBand {
    /// All between two wavelengths \[µm\].
    Between(f64, f64),
    /// Energy behind a transmission: V, g, r, i, or a file.
    Named(Band),
}

/// Sun and Moon for one satellite, one band.
#[derive(Debug, Clone, Copy)]
pub struct LightSource {
    /// From the Earth's centre \[km\].
    pub position_km: Vector<Itrs>,
    /// From the satellite, unit.
    pub toward: Vector<Itrs>,
    /// Angular radius of its disc \[rad\].
    pub disc_rad: f64,
    /// Irradiance at the satellite past the Earth, across the beam \[W m⁻²\].
    pub at_satellite_w_m2: f64,
    /// Irradiance at the ground as at the Earth's centre \[W m⁻²\].
    pub at_ground_w_m2: f64,
    /// What every place on the ground has of its own; `None` for parallel light.
    pub near: Option<NearMoon>,
    /// Share of its light that gets past the Earth.
    pub visible_frac: f64,
    /// V flux, relative to a star of magnitude 0, of 1 W m⁻² of its light in the band.
    pub v_per_w_m2: f64,
}

/// What shines, in a band.
#[derive(Debug, Clone)]
pub struct LightSources {
    /// The Sun.
    pub sun: LightSource,
    /// The Moon.
    pub moon: LightSource,
    /// The lunar law was extrapolated beyond its range of validity.
    pub extrapolated: bool,
    /// Sunlight of V = 0 in the band \[W m⁻²\].
    pub v_zero_w_m2: f64,
    /// Ends of the band \[µm\].
    pub band_um: (f64, f64),
    /// Mean wavelength of sunlight in it \[µm\].
    pub wavelength_um: f64,
}

impl InBand {
    /// From the command line: `0.3-1.05` \[µm\], or V, g, r, i, or a file of wavelength_nm,transmission.
    ///
    /// # Errors
    /// [`Error::Config`] for anything else; those of reading a file.
    pub fn parse(text: &str) -> Result<Self> {
        let ends = text.split_once('-').and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
        match ends {
            Some((from, to)) if 0.28 <= from && from < to && to <= 4.0 => Ok(Self::Between(from, to)),
            Some((from, to)) => Err(Error::Config {
                key: "band".into(),
                problem: format!("{from}-{to} um; accepted are two rising wavelengths within 0.28-4 um"),
            }),
            None => Band::of_config(text).map(Self::Named).map_err(|error| match error {
                Error::Config { problem, .. } => Error::Config {
                    key: "band".into(),
                    problem: format!("{problem}; or two wavelengths, 0.3-1.05 [um]"),
                },
                other => other,
            }),
        }
    }

    /// The band of the spectra.
    fn band(&self) -> Result<Band> {
        match self {
            InBand::Between(from, to) => Band::between(1e3 * from, 1e3 * to),
            InBand::Named(band) => Ok(band.clone()),
        }
    }
}

impl LightSources {
    /// Sun and Moon in a scene, in a band.
    ///
    /// `E = E_☉(band, 1 au) · (m_source's flux over the Sun's at 1 au)`: laws, distances, shadow and eclipse are those of
    /// the brightness engine, the spectrum ASTM G-173. The Moon's colour is taken between 0.35 and 2.38 µm.
    ///
    /// # Errors
    /// [`Error::Model`] for an impossible scene or a band without sunlight.
    pub fn new(scene: &Scene, band: &InBand, settings: &ModelSettings) -> Result<Self> {
        let (spectrum, wide) = (Spectrum::sun(SolarColumn::Extraterrestrial)?, band.band()?);
        let sun_w_m2 = wide.irradiance_w_m2(&spectrum);
        let lunar = match band {
            InBand::Named(band) => band.clone(),
            InBand::Between(from, to) => Band::between((1e3 * from).max(MOON_NM.0), (1e3 * to).min(MOON_NM.1))
                .map_err(|_| Error::Model { problem: format!("the Moon is not known between {from} and {to} um") })?,
        };
        let v = Band::of_config("V")?;
        let (in_band, in_v) =
            (SourceSettings::new(&settings.effects, &lunar)?, SourceSettings::new(&settings.effects, &v)?);
        let colour = Colour::of(&lunar)?;
        let radius_km = settings.radius_km(&scene.satellite_km);
        let origin = Vector::new(0.0, 0.0, 0.0);
        let light_source = |position_km: Vector<Itrs>,
                            body_km: f64,
                            flux: &dyn Fn(&SourceSettings, &Vector<Itrs>) -> f64| {
            let line = position_km - scene.satellite_km;
            let toward =
                line.unit().ok_or_else(|| Error::Model { problem: "the satellite is inside Sun or Moon".into() })?;
            let w_m2 = |place: &Vector<Itrs>| sun_w_m2 * flux(&in_band, place) / flux_of_mag(in_band.sun_mag);
            let frac =
                lit_fraction(&scene.satellite_km, &position_km, body_km, radius_km, settings.effects.shadow, &colour);
            let ground = w_m2(&origin);
            Ok::<LightSource, Error>(LightSource {
                position_km,
                toward,
                disc_rad: (body_km / line.norm()).min(1.0).asin(),
                at_satellite_w_m2: frac * w_m2(&scene.satellite_km),
                at_ground_w_m2: ground,
                near: None,
                visible_frac: frac,
                v_per_w_m2: if ground > 0.0 { flux(&in_v, &origin) / ground } else { 0.0 },
            })
        };
        let sun = light_source(scene.sun_km, SUN_RADIUS_KM, &|light_sources, place| {
            sunlight((scene.sun_km - *place).norm(), light_sources).flux
        })?;
        let moon = light_source(scene.moon_km, MOON_RADIUS_KM, &|light_sources, place| {
            moonlight(place, &scene.moon_km, &scene.sun_km, light_sources).flux
        })?;
        let moon = LightSource { near: in_band.moon_over_ground(&scene.moon_km, &scene.sun_km, radius_km), ..moon };
        let extrapolated = moonlight(&scene.satellite_km, &scene.moon_km, &scene.sun_km, &in_v).extrapolated;
        let (from_nm, to_nm) = wide.transmission().range_nm();
        Ok(Self {
            sun: if settings.sun { sun } else { sun.dark() },
            moon: if settings.moon { moon } else { moon.dark() },
            extrapolated: extrapolated && settings.moon,
            v_zero_w_m2: sun_w_m2 / sunlight(AU_KM, &in_v).flux * flux_of_mag(in_v.source_dimming_mag),
            band_um: (1e-3 * from_nm, 1e-3 * to_nm),
            wavelength_um: 1e-3 * mean_nm(&wide, &spectrum),
        })
    }

    /// Radiance of a sky of this surface brightness and of the Sun's colour \[W m⁻² sr⁻¹\].
    #[must_use]
    pub fn radiance_of_sky(&self, v_mag_arcsec2: f64) -> f64 {
        self.v_zero_w_m2 * flux_of_mag(v_mag_arcsec2) * ARCSEC2_PER_SR
    }
}

impl LightSource {
    /// The ground under a satellite in this light; `None` where none of it in view is lit.
    #[must_use]
    pub fn ground(&self, satellite_km: &Vector<Itrs>, radius_km: f64, earth: &Brdf) -> Option<Ground> {
        let ground = match &self.near {
            Some(moon) => Ground::under_moon(satellite_km, radius_km, moon, earth),
            None => Ground::new(satellite_km, radius_km, &self.position_km, earth),
        };
        ground.filter(|g| g.lit_in_view() && self.at_ground_w_m2 > 0.0)
    }

    /// The same, switched off.
    fn dark(self) -> Self {
        Self { at_satellite_w_m2: 0.0, at_ground_w_m2: 0.0, ..self }
    }
}

/// `∫ λ f T dλ / ∫ f T dλ`: energy, whatever the response of the band.
fn mean_nm(band: &Band, spectrum: &Spectrum) -> f64 {
    use crate::brightness::spectrum::Response;
    match band.response() {
        Response::Energy => band.mean_of(spectrum, |nm| nm),
        Response::Photon => 1.0 / band.mean_of(spectrum, |nm| 1.0 / nm),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> Scene {
        Scene {
            satellite_km: Vector::new(6800.0, 0.0, 0.0),
            velocity_km_s: Vector::new(0.0, 7.6, 0.0),
            observer_km: Vector::new(6378.0, 0.0, 0.0),
            sun_km: Vector::new(0.3, 0.9, 0.1) * (AU_KM / 0.91_f64.sqrt()),
            moon_km: Vector::new(250_000.0, -290_000.0, 20_000.0),
            sidereal_rad: 0.0,
        }
    }

    #[test]
    fn sunlight_of_v_zero_carries_the_energy_the_documents_say() {
        let light_sources =
            LightSources::new(&scene(), &InBand::parse("0.3-1.05").unwrap(), &ModelSettings::default()).unwrap();
        // 1.92e-12 W/cm2, by an independent evaluation to three digits
        assert!((light_sources.v_zero_w_m2 * 1e-4 / 1.92e-12 - 1.0).abs() < 3e-3, "{}", light_sources.v_zero_w_m2);
        assert!(
            light_sources.wavelength_um > 0.6 && light_sources.wavelength_um < 0.68,
            "{}",
            light_sources.wavelength_um
        );
    }

    #[test]
    fn v_of_a_light_source_does_not_depend_on_the_band_its_watts_are_counted_in() {
        let of =
            |band: &str| LightSources::new(&scene(), &InBand::parse(band).unwrap(), &ModelSettings::default()).unwrap();
        let (wide, v) = (of("0.3-1.05"), of("V"));
        for (a, b) in [(wide.sun, v.sun), (wide.moon, v.moon)] {
            let (a, b) = (a.at_ground_w_m2 * a.v_per_w_m2, b.at_ground_w_m2 * b.v_per_w_m2);
            assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        }
        // the Moon is redder than the Sun: more watts for the same V in a band that reaches into the red
        assert!(wide.moon.v_per_w_m2 < wide.sun.v_per_w_m2);
    }

    #[test]
    fn bands_that_are_none_are_refused() {
        for bad in ["0.1-1.0", "1.0-0.5", "W", "0.5-"] {
            assert!(matches!(InBand::parse(bad), Err(Error::Config { .. })), "{bad}");
        }
    }
}
