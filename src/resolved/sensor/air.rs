//! The air of an exposure from the geometry: the sky behind the satellite, and what is lost on the way.
//!
//! mag and mag/arcsec² in V or the filter's band. Moonlight by Krisciunas & Schaefer, twilight by Patat et al.

use super::SkyConditions;
use super::exposure::Sensor;
use crate::base::error::{Error, Result};
use crate::orbit::Geometry;
use crate::visibility::sky_brightness::{
    MoonInSky, moonlit_sky_v_mag_arcsec2, nl_of_v_mag_arcsec2, twilight_nl, v_mag_arcsec2_of_nl,
};
use crate::visibility::sky_brightness_table::sky_of_v;

impl Sensor {
    /// Sky and extinction where the satellite stands: dark sky, moonlight and twilight; k X of the settings.
    ///
    /// # Errors
    /// [`Error::Model`] for a satellite below the horizon, a Sun above −5° (give the sky itself), and a filter whose sky is
    /// not known.
    pub fn air(&self, geometry: &Geometry) -> Result<SkyConditions> {
        let sky = &self.settings.sky;
        let airmass = geometry.airmass.ok_or_else(|| Error::Model {
            problem: format!("the satellite is {:.1} deg below the horizon", -geometry.alt_rad.to_degrees()),
        })?;
        let moon = MoonInSky {
            alt_rad: geometry.moon_alt_rad,
            phase_rad: geometry.moon_phase_rad,
            sep_rad: geometry.moon_sep_rad,
        };
        let night = moonlit_sky_v_mag_arcsec2(sky.dark_v_mag_arcsec2, sky.k_mag_airmass, geometry.alt_rad, Some(moon));
        let v = v_mag_arcsec2_of_nl(nl_of_v_mag_arcsec2(night) + twilight_nl(geometry.sun_alt_rad)?);
        let sky_mag_arcsec2 = match self.settings.filter()? {
            None => v,
            Some(band) if band.name() == "V" => v,
            Some(band) => sky_of_v(band.name(), v)?,
        };
        Ok(SkyConditions { sky_mag_arcsec2, extinction_mag: sky.k_mag_airmass * airmass })
    }
}
