//! What the light sources are in one pass band and one reading of the paper: magnitudes, laws, dimming.
//!
//! Magnitudes in the band's own system. Computed once; nothing here depends on the scene.

use super::Rolo;
use crate::base::error::{Error, Result};
use crate::brightness::spectrum::{Band, SolarColumn, Spectrum};
use crate::config::{Distances, Effects, GroundMoonlight, LunarEclipse, MoonLaw, MoonPastLimit, Source};

/// Phase angle the Moon's colour of the law of Cox belongs to \[deg\]; it reddens by 0.05 mag in g−V from 7° to 90°.
pub const MOON_COLOUR_PHASE_DEG: f64 = 30.0;

/// How Sun and Moon shine in one pass band.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceSettings {
    /// Distances of Sun and Moon.
    pub distances: Distances,
    /// The Moon's magnitude against phase.
    pub moon_law: MoonLaw,
    /// What happens past 150° of phase.
    pub moon_past_limit: MoonPastLimit,
    /// The Earth's shadow on the Moon.
    pub lunar_eclipse: LunarEclipse,
    /// Moonlight on the ground.
    pub ground_moonlight: GroundMoonlight,
    /// Magnitude of the Sun at 1 au in the band and its system.
    pub sun_mag: f64,
    /// (m − V) of the Moon less (m − V) of the Sun: what the lunar law of V is corrected by for the Moon's own colour.
    pub moon_minus_sun_colour_mag: f64,
    /// What is lost before the light is scaled: 0 for a source outside the atmosphere, else the band's ratio of the
    /// extraterrestrial to the global spectrum of ASTM G-173.
    pub source_dimming_mag: f64,
    /// The lunar disc in the band, for [`MoonLaw::Rolo`].
    pub rolo: Rolo,
}

impl SourceSettings {
    /// Sun and Moon in `band` under `effects`. The extinction of [`Source::Extincted`] depends on the scene and is the
    /// caller's.
    ///
    /// The Moon's colour is ROLO's at 30° of phase: g +0.17, r −0.16, i −0.31 mag against the Sun's; in V it is 0.
    ///
    /// # Errors
    /// [`Error::Model`] for a band beyond the lunar disc's known reflectance, 350 to 2383 nm, or without sunlight;
    /// [`Error::Table`] when an embedded table is damaged.
    pub fn new(effects: &Effects, band: &Band) -> Result<Self> {
        let sun = Spectrum::sun(SolarColumn::Extraterrestrial)?;
        let v = Band::named("V").ok_or_else(|| Error::Model { problem: "band V is missing".into() })?;
        let (rolo, rolo_v) = (Rolo::new(band, &sun)?, Rolo::new(&v, &sun)?);
        let ratio = rolo.reflectance(MOON_COLOUR_PHASE_DEG) / rolo_v.reflectance(MOON_COLOUR_PHASE_DEG);
        let source_dimming_mag = match effects.source {
            Source::ExoAtmospheric | Source::Extincted => 0.0,
            Source::BottomOfAtmosphere => dimming_mag(band, &sun, SolarColumn::Global)?,
        };
        Ok(Self {
            distances: effects.distances,
            moon_law: effects.moon_law,
            moon_past_limit: effects.moon_past_limit,
            lunar_eclipse: effects.lunar_eclipse,
            ground_moonlight: effects.ground_moonlight,
            sun_mag: band.sun_mag(),
            moon_minus_sun_colour_mag: -2.5 * ratio.log10(),
            source_dimming_mag,
            rolo,
        })
    }
}

/// What the band loses on the way to the ground \[mag\].
fn dimming_mag(band: &Band, sun: &Spectrum, column: SolarColumn) -> Result<f64> {
    let ground = Spectrum::sun(column)?;
    let mag = -2.5 * (band.mean_f_nu(&ground) / band.mean_f_nu(sun)).log10();
    if mag.is_finite() {
        return Ok(mag);
    }
    Err(Error::Model { problem: format!("no sunlight of band {} reaches the ground", band.name()) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::constants::AU_KM;
    use crate::brightness::light_sources::sun::SUN_V_MAG;
    use crate::brightness::light_sources::sun::mag_of_flux;
    use crate::brightness::light_sources::sun::sunlight;
    use crate::config::Mode;

    fn of(mode: Mode) -> SourceSettings {
        SourceSettings::new(&Effects::of(mode), &Band::named("V").unwrap()).unwrap()
    }

    #[test]
    fn sunlight_falls_with_the_square_of_the_distance() {
        let corrected = of(Mode::Corrected);
        let one = sunlight(AU_KM, &corrected).flux;
        assert!((mag_of_flux(one).unwrap() - SUN_V_MAG).abs() < 1e-12);
        assert!((sunlight(2.0 * AU_KM, &corrected).flux * 4.0 / one - 1.0).abs() < 1e-12);
        let published = of(Mode::AsPublished);
        assert_eq!(sunlight(2.0 * AU_KM, &published).flux, sunlight(AU_KM, &published).flux);
    }

    #[test]
    fn the_published_source_at_the_ground_loses_a_fifth_of_a_magnitude_in_v() {
        // 0.22 for the global spectrum, 0.36 for the direct one, by an evaluation that does not state its V band
        let sun = Spectrum::sun(SolarColumn::Extraterrestrial).unwrap();
        let v = Band::named("V").unwrap();
        assert!((of(Mode::AsPublished).source_dimming_mag - 0.22).abs() < 0.01);
        assert!((dimming_mag(&v, &sun, SolarColumn::Direct).unwrap() - 0.36).abs() < 0.02);
        assert_eq!(of(Mode::Corrected).source_dimming_mag, 0.0);
    }

    #[test]
    fn in_v_the_moon_has_no_colour_of_its_own() {
        let light_sources = of(Mode::Corrected);
        assert_eq!(light_sources.moon_minus_sun_colour_mag, 0.0);
        assert!((mag_of_flux(light_sources.moonlight_at_phase(0.0).flux).unwrap() + 12.73).abs() < 1e-12);
    }
}
