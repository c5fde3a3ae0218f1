//! A read-out exposure as a FITS file with the headers a reduction needs, and what it was made of.
//!
//! Times UTC, DATE-OBS the start of the exposure. The provenance cards are HIERARCH-free: eight letters each.

use std::path::Path;

use hifitime::{Duration, Epoch, Unit};
use ndarray::Array2;

use super::exposure::Exposure;
use super::exposure::Sensor;
use super::signal_to_noise;
use crate::base::error::Result;
use crate::config;
use crate::fits::{CardValue, write_u16};
use crate::resolved::image::{Light, RadianceImage};

/// What a file states about its frame besides the sensor.
#[derive(Debug, Clone)]
pub struct FrameFacts {
    /// Name of the satellite, as its elements have it: the reduction knows the target by it.
    pub object: String,
    /// Catalogue number of the satellite.
    pub norad_cat_id: Option<u64>,
    /// Where the telescope stands.
    pub site: config::Site,
    /// V of the satellite outside the atmosphere; `None` without light.
    pub v_mag: Option<f64>,
    /// Middle of the exposure.
    pub mid: Epoch,
    /// Altitude of the satellite \[deg\].
    pub alt_deg: f64,
    /// Azimuth of the satellite \[deg\].
    pub az_deg: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// What else should be known of the picture, a line each.
    pub history: Vec<String>,
}

/// Writes counts with their cards; a name ending in `.fz` is Rice-compressed.
///
/// # Errors
/// [`crate::Error::Fits`], [`crate::Error::Io`].
pub fn write_frame(
    path: &Path,
    counts: &Array2<u16>,
    sensor: &Sensor,
    exposure: &Exposure,
    image: &RadianceImage,
    facts: &FrameFacts,
) -> Result<()> {
    let compress = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("fz"));
    write_u16(path, counts, &cards(counts, sensor, exposure, image, facts), compress)
}

fn cards(
    counts: &Array2<u16>,
    sensor: &Sensor,
    exposure: &Exposure,
    image: &RadianceImage,
    facts: &FrameFacts,
) -> Vec<(String, CardValue, String)> {
    let s = sensor.settings();
    let lights: Vec<Light> = exposure.stamp.planes.iter().map(|(light, _)| *light).collect();
    let snr = signal_to_noise(exposure, sensor.gain.read_noise_e, &[lights]).into_iter().next();
    let start = facts.mid - 0.5 * exposure.exptime_s * Unit::Second;
    let mut cards = Vec::new();
    let mut put = |key: &str, value: CardValue, comment: &str| cards.push((key.into(), value, comment.to_owned()));
    let text = |value: &str| CardValue::Text(value.to_owned());
    let real = CardValue::Real;
    let integer = |value: i64| CardValue::Integer(value);
    put("IMAGETYP", text("Light Frame"), "type of exposure");
    put("OBJECT", text(&facts.object), "target of the exposure");
    if let Some(number) = facts.norad_cat_id {
        put("NORADID", integer(number as i64), "catalogue number of the target");
    }
    put("EXPTIME", real(exposure.exptime_s), "[s] exposure time");
    put("DATE-OBS", text(&iso_us(start)), "UTC start of exposure");
    put("TIMESYS", text("UTC"), "time scale");
    put("GAIN", integer(s.frame.gain_setting), "[0.1 dB] camera gain setting");
    put("EGAIN", real(sensor.gain.e_per_adu.0), "[e-/ADU] electrons per ADU");
    put("RDNOISE", real(sensor.gain.read_noise_e), "[e-] read noise");
    put("INSTRUME", text(&s.detector.camera), "camera");
    put("TELESCOP", text(&s.telescope.name), "telescope");
    put("FILTER", text(&s.optics.filter), "filter");
    put("XBINNING", integer(i64::from(s.frame.binning)), "binning in x");
    put("YBINNING", integer(i64::from(s.frame.binning)), "binning in y");
    put("XPIXSZ", real(s.detector.pixel_um * f64::from(s.frame.binning)), "[um] pixel size, binned");
    put("YPIXSZ", real(s.detector.pixel_um * f64::from(s.frame.binning)), "[um] pixel size, binned");
    put("FOCALLEN", real(s.telescope.focal_length_mm), "[mm] focal length");
    put("APTDIA", real(1e3 * s.telescope.aperture_m), "[mm] diameter of the aperture");
    put("SITELAT", real(facts.site.lat_deg), "[deg] latitude, north positive");
    put("SITELONG", real(facts.site.lon_deg), "[deg] longitude, east positive");
    put("SITEELEV", real(facts.site.alt_m), "[m] elevation");
    put("CENTALT", real(facts.alt_deg), "[deg] altitude at mid-exposure");
    put("CENTAZ", real(facts.az_deg), "[deg] azimuth at mid-exposure");
    put("SWCREATE", text(concat!("satphot ", env!("CARGO_PKG_VERSION"), " render")), "simulated data");
    put("SIMSEED", text(&facts.seed.to_string()), "seed of the noise");
    put("SIMRANGE", real(image.range_km), "[km] distance of the satellite");
    put("SIMBANDL", real(image.band_um.0), "[um] band of the radiances, from");
    put("SIMBANDH", real(image.band_um.1), "[um] band of the radiances, to");
    put("SIMZP", real(sensor.zp_mag), &format!("[mag] {}, of 1 e-/s, air left out", sensor.zp_band));
    if let Some(v_mag) = facts.v_mag {
        put("SIMVMAG", real(v_mag), "[mag] V, Vega, of the satellite above the air");
    }
    put("SIMSKY", real(exposure.sky_e_px), "[e-] sky in a pixel");
    put("SIMDARK", real(exposure.dark_e_px), "[e-] dark current in a pixel");
    put("SIMFLUX", real(exposure.satellite_e()), "[e-] all light of the satellite, without noise");
    put("SATURATE", real(sensor.gain.saturation_adu), "[ADU] pixels from here up are saturated");
    put("SIMNSAT", integer(sensor.n_saturated(counts) as i64), "[px] saturated pixels");
    put("SIMLOST", real(exposure.beside_frac), "share of that outside the frame");
    for (key, light) in ["SIMSUN", "SIMEARTH", "SIMMOON", "SIMLUNAR", "SIMSTARS"].iter().zip(Light::ALL) {
        put(key, real(exposure.light_e(light)), &format!("[e-] {}", light.name()));
    }
    if let Some(snr) = snr {
        put("SIMSNRPX", real(snr.pixel), "S/N of all light, brightest pixel");
        put("SIMSNRSM", real(snr.summed), "S/N of all light, fewest pixels with 90 %");
        put("SIMSNRMT", real(snr.matched), "S/N of all light, best weights");
    }
    for line in &facts.history {
        put("HISTORY", text(line), "");
    }
    if exposure.beside_frac > 0.0 {
        let line = format!("{:.3} % of the light fell outside the frame", 100.0 * exposure.beside_frac);
        put("HISTORY", text(&line), "");
    }
    cards
}

/// `2025-06-09T10:33:02.500000`, rounded to the microsecond.
fn iso_us(epoch: Epoch) -> String {
    let (y, mo, d, h, mi, s, ns) = (epoch + Duration::from_total_nanoseconds(500)).to_gregorian_utc();
    format!("{y:04}-{mo:02}-{d:02}T{h:02}:{mi:02}:{s:02}.{:06}", ns / 1_000)
}
