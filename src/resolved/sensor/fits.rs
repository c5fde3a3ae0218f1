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
use crate::fits::{CardLine, card, write_u16};
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
) -> Vec<CardLine> {
    let s = sensor.settings();
    let lights: Vec<Light> = exposure.stamp.planes.iter().map(|(light, _)| *light).collect();
    let snr = signal_to_noise(exposure, sensor.gain.read_noise_e, &[lights]).into_iter().next();
    let start = facts.mid - 0.5 * exposure.exptime_s * Unit::Second;
    let mut cards = Vec::new();
    cards.push(card("IMAGETYP", "Light Frame", "type of exposure"));
    cards.push(card("OBJECT", &facts.object, "target of the exposure"));
    if let Some(number) = facts.norad_cat_id {
        cards.push(card("NORADID", number as i64, "catalogue number of the target"));
    }
    cards.push(card("EXPTIME", exposure.exptime_s, "[s] exposure time"));
    cards.push(card("DATE-OBS", &iso_us(start), "UTC start of exposure"));
    cards.push(card("TIMESYS", "UTC", "time scale"));
    cards.push(card("GAIN", s.frame.gain_setting, "[0.1 dB] camera gain setting"));
    cards.push(card("EGAIN", sensor.gain.e_per_adu.0, "[e-/ADU] electrons per ADU"));
    cards.push(card("RDNOISE", sensor.gain.read_noise_e, "[e-] read noise"));
    cards.push(card("INSTRUME", &s.detector.camera, "camera"));
    cards.push(card("TELESCOP", &s.telescope.name, "telescope"));
    cards.push(card("FILTER", &s.optics.filter, "filter"));
    cards.push(card("XBINNING", i64::from(s.frame.binning), "binning in x"));
    cards.push(card("YBINNING", i64::from(s.frame.binning), "binning in y"));
    cards.push(card("XPIXSZ", s.detector.pixel_um * f64::from(s.frame.binning), "[um] pixel size, binned"));
    cards.push(card("YPIXSZ", s.detector.pixel_um * f64::from(s.frame.binning), "[um] pixel size, binned"));
    cards.push(card("FOCALLEN", s.telescope.focal_length_mm, "[mm] focal length"));
    cards.push(card("APTDIA", 1e3 * s.telescope.aperture_m, "[mm] diameter of the aperture"));
    cards.push(card("SITELAT", facts.site.lat_deg, "[deg] latitude, north positive"));
    cards.push(card("SITELONG", facts.site.lon_deg, "[deg] longitude, east positive"));
    cards.push(card("SITEELEV", facts.site.alt_m, "[m] elevation"));
    cards.push(card("CENTALT", facts.alt_deg, "[deg] altitude at mid-exposure"));
    cards.push(card("CENTAZ", facts.az_deg, "[deg] azimuth at mid-exposure"));
    cards.push(card("SWCREATE", concat!("satphot ", env!("CARGO_PKG_VERSION"), " render"), "simulated data"));
    cards.push(card("SIMSEED", &facts.seed.to_string(), "seed of the noise"));
    cards.push(card("SIMRANGE", image.range_km, "[km] distance of the satellite"));
    cards.push(card("SIMBANDL", image.band_um.0, "[um] band of the radiances, from"));
    cards.push(card("SIMBANDH", image.band_um.1, "[um] band of the radiances, to"));
    cards.push(card("SIMZP", sensor.zp_mag, &format!("[mag] {}, of 1 e-/s, without air", sensor.zp_band)));
    if let Some(v_mag) = facts.v_mag {
        cards.push(card("SIMVMAG", v_mag, "[mag] V, Vega, of the satellite above the air"));
    }
    cards.push(card("SIMSKY", exposure.sky_e_px, "[e-] sky in a pixel"));
    cards.push(card("SIMDARK", exposure.dark_e_px, "[e-] dark current in a pixel"));
    cards.push(card("SIMFLUX", exposure.satellite_e(), "[e-] all light of the satellite, without noise"));
    cards.push(card("SATURATE", sensor.gain.saturation_adu, "[ADU] pixels from here up are saturated"));
    cards.push(card("SIMNSAT", sensor.n_saturated(counts) as i64, "[px] saturated pixels"));
    cards.push(card("SIMLOST", exposure.outside_frac, "share of that outside the frame"));
    for (key, light) in ["SIMSUN", "SIMEARTH", "SIMMOON", "SIMLUNAR", "SIMSTARS"].iter().zip(Light::ALL) {
        cards.push(card(key, exposure.light_e(light), &format!("[e-] {}", light.name())));
    }
    if let Some(snr) = snr {
        cards.push(card("SIMSNRPX", snr.pixel, "S/N of all light, brightest pixel"));
        cards.push(card("SIMSNRSM", snr.summed, "S/N of all light, fewest pixels with 90 %"));
        cards.push(card("SIMSNRMT", snr.matched, "S/N of all light, best weights"));
    }
    for line in &facts.history {
        cards.push(card("HISTORY", line, ""));
    }
    if exposure.outside_frac > 0.0 {
        let line = format!("{:.3} % of the light fell outside the frame", 100.0 * exposure.outside_frac);
        cards.push(card("HISTORY", &line, ""));
    }
    cards
}

/// `2025-06-09T10:33:02.500000`, rounded to the microsecond.
fn iso_us(epoch: Epoch) -> String {
    let (y, mo, d, h, mi, s, ns) = (epoch + Duration::from_total_nanoseconds(500)).to_gregorian_utc();
    format!("{y:04}-{mo:02}-{d:02}T{h:02}:{mi:02}:{s:02}.{:06}", ns / 1_000)
}
