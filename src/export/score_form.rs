//! The form of a SCORE file: its columns, and what it refuses by altitude.

/// The columns, in the order the server counts them.
pub const HEADER: [&str; 27] = [
    "satellite_name",
    "norad_cat_id",
    "observation_time_utc",
    "observation_time_uncertainty_sec",
    "apparent_magnitude",
    "apparent_magnitude_uncertainty",
    "observer_latitude_deg",
    "observer_longitude_deg",
    "observer_altitude_m",
    "limiting_magnitude",
    "instrument",
    "observing_mode",
    "observing_filter",
    "observer_email",
    "observer_orcid",
    "satellite_right_ascension_deg",
    "satellite_declination_deg",
    "sigma_2_ra",
    "sigma_ra_sigma_dec",
    "sigma_2_dec",
    "range_to_satellite_km",
    "range_to_satellite_uncertainty_km",
    "range_rate_of_satellite_km_per_sec",
    "range_rate_of_satellite_uncertainty_km_per_sec",
    "comments",
    "data_archive_link",
    "mpc_code",
];

/// Altitude below which the server may take a satellite for set, because it reads metres as kilometres \[deg\].
///
/// `acos(R/(R + h)) − 5°` with h in km where m are meant and −5° the lowest altitude the server takes: 27° for a site
/// 1165 m high, 40° for 2663 m.
#[must_use]
pub(super) fn refused_below_deg(alt_m: f64) -> f64 {
    const R_KM: f64 = 6371.0;
    (R_KM / (R_KM + alt_m.max(0.0))).acos().to_degrees() - 5.0
}
