//! Constants used in more than one room: value, unit, source, and where each stops being true.

/// Speed of light in vacuum \[km/s\], exact (SI).
pub const SPEED_OF_LIGHT_KM_S: f64 = 299_792.458;
/// Astronomical unit \[km\], exact (IAU 2012 Resolution B2).
pub const AU_KM: f64 = 149_597_870.7;
/// Equatorial radius of the WGS84 ellipsoid \[km\] (NIMA TR8350.2).
pub const WGS84_A_KM: f64 = 6_378.137;
/// Flattening of the WGS84 ellipsoid (NIMA TR8350.2).
pub const WGS84_F: f64 = 1.0 / 298.257_223_563;
/// Nominal solar radius \[km\] (IAU 2015 Resolution B3).
pub const SUN_RADIUS_KM: f64 = 695_700.0;
/// Mean lunar radius \[km\] (IAU WGCCRE 2015, Archinal et al. 2018).
pub const MOON_RADIUS_KM: f64 = 1_737.4;
/// Rotation rate of the Earth \[rad/s\] (WGS84).
pub const EARTH_ROTATION_RAD_S: f64 = 7.292_115e-5;
/// Ratio of FWHM to σ of a Gaussian, 2·sqrt(2 ln 2).
pub const FWHM_PER_SIGMA: f64 = 2.354_820_045_030_949_3;
/// Standard deviation of a Gaussian per median absolute deviation, 1/Φ⁻¹(3/4).
pub const SIGMA_PER_MAD: f64 = 1.482_602_218_505_602;
/// Magnitudes per unit of natural logarithm of flux, 2.5/ln 10.
pub const MAG_PER_LN: f64 = 1.085_736_204_758_129_6;

/// Equatorial radius of WGS72, SGP4's Earth \[km\]: a state below it has decayed.
pub const SGP4_EARTH_RADIUS_KM: f64 = 6_378.135;

/// Seconds of arc in a radian, 180·3600/π.
pub const ARCSEC_PER_RAD: f64 = 206_264.806_247_096_36;

/// Square seconds of arc in a steradian.
pub const ARCSEC2_PER_SR: f64 = ARCSEC_PER_RAD * ARCSEC_PER_RAD;
