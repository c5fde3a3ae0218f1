//! Faintest magnitudes: of a telescope that tracks, of streaks, of a mirror's beam.
//!
//! Missing numbers are `None`; a satellite without light has no magnitude.

use serde::{Deserialize, Serialize};

use super::define::table;

table! {
    LIMITS = "limits.ecsv", "One row per sky, signal-to-noise ratio and thing detected of `limits tracked`.";
    /// One limit.
    #[derive(Debug, Clone, Default, PartialEq, Serialize)]
    pub struct LimitRow {
        /// which sky
        sky: String,
        /// phase angle of the Moon, 0 = full
        moon_phase_deg: Option<f64> => "deg" ["pos.phaseAng"],
        /// altitude of the Moon, where the sky is computed from it
        moon_alt_deg: Option<f64> => "deg" ["pos.az.alt"],
        /// brightness of the sky in the band
        sky_mag_arcsec2: f64 => "mag / arcsec2",
        /// the same in electrons per second and pixel
        sky_e_s_px: f64 => "electron / (pix s)",
        /// exposure time, all exposures together
        exptime_s: f64 => "s" ["time.duration;obs.exposure"],
        /// number of exposures it is split into
        n_sub: i64,
        /// signal-to-noise ratio of the limit
        snr: f64 => ["stat.snr"],
        /// what is detected: one pixel, one arcsec2, point source or extended target
        limit_of: String,
        /// area over which light is summed
        summed_arcsec2: f64 => "arcsec2",
        /// the same in pixels
        n_px: f64 => "pix",
        /// variance in that area without the target
        noise_var_e2: f64 => "electron2",
        /// faintest magnitude, all light of the target
        limit_mag: Option<f64> => "mag",
        /// faintest mean surface brightness
        mu_limit_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// magnitude at which one exposure saturates the brightest pixel
        saturation_mag: Option<f64> => "mag",
        /// 1 = at the limit a pixel is saturated, by the sky or the target
        saturated: i64,
        /// requested magnitude
        mag: Option<f64> => "mag",
        /// its signal-to-noise ratio in exptime_s
        mag_snr: Option<f64>,
        /// exposure time in which it reaches snr, all exposures together
        mag_exptime_s: Option<f64> => "s",
        /// number of exposures that takes, none of them saturated
        mag_n_sub: Option<i64>,
        /// why mag_exptime_s is missing
        reason: String => ["meta.note"],
    }
}

table! {
    STREAK = "streak.ecsv", "One row per satellite and choice of its magnitude of `limits streak`.";
    /// One satellite before one survey.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct StreakRow {
        /// name of the satellite
        object_name: String => ["meta.id;meta.main"],
        /// where v_mag is from
        mag_source: String,
        /// area of the satellite
        area_m2: f64 => "m2",
        /// height of the orbit
        height_km: Option<f64> => "km",
        /// distance from the observer
        range_km: f64 => "km" ["pos.distance"],
        /// angular rate against the stars
        rate_deg_s: f64 => "deg / s" ["phys.veloc.ang"],
        /// where rate_deg_s is from
        rate_source: String,
        /// V magnitude, tracked
        v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V"],
        /// mean surface brightness while tracked, v_mag + 2.5 log10 of the solid angle
        mu_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// diameter of a disc of area_m2
        diameter_m: f64 => "m",
        /// its angle
        satellite_arcsec: f64 => "arcsec",
        /// angle of the telescope's mirror seen from the satellite
        defocus_arcsec: f64 => "arcsec",
        /// full width at half maximum of the seeing
        fwhm_arcsec: f64 => "arcsec",
        /// width of the trail: the three before in quadrature
        trail_width_arcsec: f64 => "arcsec",
        /// length of the trail in the field
        trail_length_arcsec: f64 => "arcsec",
        /// exposure time
        exptime_s: f64 => "s" ["time.duration;obs.exposure"],
        /// time the satellite is in the field, at most the exposure
        in_field_s: f64 => "s",
        /// trail_width_arcsec over the rate, at most the exposure
        t_eff_s: f64 => "s",
        /// 2 sqrt(A/pi (R+h)/GM), in the zenith
        t_eff_simple_s: Option<f64> => "s",
        /// effective surface brightness in V as published
        nu_published_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// effective surface brightness in V, corrected
        nu_corrected_mag_arcsec2: Option<f64> => "mag / arcsec2",
        /// pass band of the survey
        filter: String => ["meta.id;instr.filter"],
        /// magnitude in that band (AB) less V (Vega), added to nu_corrected before it is compared
        colour_mag: f64 => "mag",
        /// 5-sigma limit of a point, the paper's
        limit_point_mag: f64 => "mag",
        /// 5-sigma limit over one square arcsecond
        limit_mag_arcsec2: f64 => "mag / arcsec2",
        /// 5-sigma limit over one pixel
        limit_pixel_mag_arcsec2: f64 => "mag / arcsec2",
        /// 5-sigma limit over the whole trail, summed
        limit_trail_mag_arcsec2: f64 => "mag / arcsec2",
        /// nu_published brighter than limit_point_mag, as the paper compares
        detected_published: String,
        /// nu_corrected + colour_mag brighter than limit_mag_arcsec2
        detected_corrected: String,
        /// nu_corrected + colour_mag brighter than limit_trail_mag_arcsec2
        detected_trail: String,
        /// electrons of the satellite in the brightest pixel of the trail
        peak_pixel_e: Option<f64> => "electron",
        /// those and the sky's over the full well
        peak_frac_sat: Option<f64> => ["instr.saturation;arith.ratio"],
        /// yes where peak_frac_sat is above 1
        saturated: String,
    }
    not written {
        /// Whether that is the model.
        is_modelled: bool,
    }
}

table! {
    FOOTPRINT = "footprint.ecsv", "One row per nearest approach of a mirror's beam to the site of `limits footprint`.";
    /// One nearest approach.
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    pub struct FootprintRow {
        /// sun or moon: whose light the beam is
        lamp: String,
        /// UTC of the nearest approach, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// altitude of the mirror above the horizon of the site
        alt_deg: f64 => "deg" ["pos.az.alt"],
        /// distance of the mirror from the site
        range_km: f64 => "km" ["pos.distance"],
        /// angle at the mirror between the middle of the beam and the site
        offset_deg: f64 => "deg",
        /// distance of the site from the middle line of the beam
        miss_km: f64 => "km",
        /// longest diameter of the spot on the ground
        spot_along_km: Option<f64> => "km",
        /// shortest diameter of the spot on the ground
        spot_across_km: Option<f64> => "km",
        /// angle of the beam from the vertical of its spot
        incidence_deg: Option<f64> => "deg",
        /// share of the light source's disc the mirror sees past the Earth
        lit_frac: f64,
        /// first moment in the beam, UTC; empty if the beam misses the site
        in_beam_from: String,
        /// time in the beam
        in_beam_s: Option<f64> => "s",
        /// V magnitude in the beam
        v_mag: Option<f64> => "mag" ["phot.mag;em.opt.V"],
    }
}
