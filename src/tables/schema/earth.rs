//! The Earth under a light source, ground tracks, and the laws of the Moon's brightness.

use serde::Serialize;

use super::define::table;

table! {
    EARTH = "earth.ecsv", "The row of a picture of `plot earth`.";
    /// The Earth under a light source, in numbers.
    #[derive(Debug, Clone, Default, PartialEq, Serialize)]
    pub struct EarthRow {
        /// UTC
        date: String,
        /// what lights the Earth
        lamp: String,
        /// longitude under the viewpoint, east positive
        view_lon_deg: f64 => "deg",
        /// geodetic latitude under the viewpoint
        view_lat_deg: f64 => "deg",
        /// height of the viewpoint above the ellipsoid
        view_height_km: f64 => "km",
        /// longitude under the light source
        lamp_lon_deg: f64 => "deg",
        /// geodetic latitude under the light source
        lamp_lat_deg: f64 => "deg",
        /// irradiance of the light source across its beam in the band
        lamp_w_m2: f64 => "W m-2",
        /// phase angle of the Moon from the Earth's centre, 0 = full
        moon_phase_deg: f64 => "deg" ["pos.phaseAng"],
        /// radiance straight up under the light source, f(n, n, n) E
        radiance_under_lamp_w_m2_sr: f64 => "W m-2 sr-1",
        /// brightest pixel of the picture
        radiance_max_w_m2_sr: f64 => "W m-2 sr-1",
        /// the same, mean over the band
        radiance_max_w_cm2_sr_um: f64 => "W cm-2 sr-1 um-1",
        /// irradiance of the whole Earth at the viewpoint, the sum of radiance times solid angle
        irradiance_w_m2: f64 => "W m-2",
        /// share of the disc's solid angle that is lit
        lit_frac: f64,
    }
}

table! {
    TRACK = "ground.ecsv", "One row per moment of `plot ground`.";
    /// One moment of a ground track.
    #[derive(Debug, Clone, Default, PartialEq, Serialize)]
    pub struct TrackRow {
        /// UTC
        date: String,
        /// longitude under the satellite, east positive
        lon_deg: f64 => "deg" ["pos.earth.lon"],
        /// geodetic latitude under the satellite
        lat_deg: f64 => "deg" ["pos.earth.lat"],
        /// height of the satellite above the ellipsoid
        height_km: f64 => "km",
        /// altitude of the Sun over the ground there, no refraction
        sun_alt_deg: f64 => "deg" ["pos.az.alt"],
        /// altitude of the Moon over the ground there, no refraction
        moon_alt_deg: f64 => "deg" ["pos.az.alt"],
    }
}

table! {
    MOON_LAWS = "moon.ecsv", "One row per phase angle of `plot moon`.";
    /// One phase angle.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
    pub struct MoonLawRow {
        /// phase angle of the Moon, 0 = full, 180 = new
        phase_deg: f64 => "deg",
        /// share of the disc that is lit, (1 + cos phase)/2
        illum_frac: f64,
        /// V by Cox 2002 as printed, no surge; tapered to no light past 150 deg
        cox_v_mag: Option<f64> => "mag",
        /// 1 = beyond where the law is valid, 0 to 150 deg
        cox_extrapolated: i64,
        /// the same with the surge below 7 deg of Krisciunas & Schaefer 1991
        ks_v_mag: Option<f64> => "mag",
        /// 1 = beyond 0 to 150 deg
        ks_extrapolated: i64,
        /// V by ROLO (Kieffer & Stone 2005), zero libration, waxing as waning
        rolo_v_mag: Option<f64> => "mag",
        /// 1 = beyond what it was fitted to, 1.55 to 97 deg
        rolo_extrapolated: i64,
        /// ks_v_mag - cox_v_mag; negative is brighter than Cox
        ks_minus_cox_mag: Option<f64> => "mag",
        /// rolo_v_mag - cox_v_mag; negative is brighter than Cox
        rolo_minus_cox_mag: Option<f64> => "mag",
        /// the polynomial of Cox at every phase, as published: 180 deg is no dark Moon
        cox_polynomial_v_mag: f64 => "mag",
    }
}
