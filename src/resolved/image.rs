//! The picture of a satellite before any telescope: radiance per pixel, kept apart by light.

use ndarray::Array2;

/// Where the light of a picture comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Light {
    /// The Sun, direct.
    Sun,
    /// The Sun by way of the Earth.
    Earthshine,
    /// The Moon, direct.
    Moon,
    /// The Moon by way of the Earth.
    LunarEarthshine,
    /// Stars, zodiacal light and airglow from all sides.
    Starlight,
}

impl Light {
    /// Every light, in the order of the tables.
    pub const ALL: [Light; 5] = [Light::Sun, Light::Earthshine, Light::Moon, Light::LunarEarthshine, Light::Starlight];

    /// Name in tables and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Light::Sun => "sunlight",
            Light::Earthshine => "earthshine",
            Light::Moon => "moonlight",
            Light::LunarEarthshine => "lunar_earthshine",
            Light::Starlight => "starlight",
        }
    }

    /// Name in words, for captions.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Light::Sun => "Sunlight",
            Light::Earthshine => "Earthshine",
            Light::Moon => "Moonlight",
            Light::LunarEarthshine => "Lunar-Earthshine",
            Light::Starlight => "Starlight",
        }
    }
}

/// Radiance of a satellite at the entrance aperture, one plane per light.
///
/// Planes are `[y, x]` with north up (y grows to the north) and east to the left (x grows to the west), each value the
/// mean of its pixel, so that the sum over pixels times [`RadianceImage::pixel_sr`] is the irradiance of that light.
#[derive(Debug, Clone)]
pub struct RadianceImage {
    /// Side of a pixel \[rad\].
    pub pixel_rad: f64,
    /// Distance of the satellite \[km\].
    pub range_km: f64,
    /// Radiance in band \[W m⁻² sr⁻¹\] of every light that was computed.
    pub planes: Vec<(Light, Array2<f64>)>,
    /// Wavelength at the middle of the band, weighted by the light of the Sun \[µm\]: turns energy into photons.
    pub wavelength_um: f64,
    /// Lower and upper end of the band \[µm\].
    pub band_um: (f64, f64),
}

impl RadianceImage {
    /// Solid angle of a pixel \[sr\].
    #[must_use]
    pub fn pixel_sr(&self) -> f64 {
        self.pixel_rad * self.pixel_rad
    }

    /// Irradiance of one light at the entrance aperture: E = Σ L Δω \[W m⁻²\].
    #[must_use]
    pub fn irradiance_w_m2(&self, light: Light) -> f64 {
        self.planes.iter().filter(|(of, _)| *of == light).map(|(_, plane)| plane.sum()).sum::<f64>() * self.pixel_sr()
    }
}
