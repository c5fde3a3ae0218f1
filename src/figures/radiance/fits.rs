//! A radiance image as FITS: the sum of the lights in the primary HDU, one IMAGE extension for each light.
//!
//! W m⁻² sr⁻¹ as 64-bit floats; first row south, first column east. Orientation and scale are stated as cards, not as a
//! celestial WCS: a moving satellite has no fixed place. Source: FITS Standard 4.0.

use std::io::Write;
use std::path::Path;

use ndarray::Array2;

use crate::base::error::Result;
use crate::base::file::write_streamed;
use crate::fits::card_out::{BLOCK, Cards, Sum};
use crate::resolved::RadianceImage;

/// What a file states about its picture besides the picture itself.
#[derive(Debug, Clone, Default)]
pub struct PictureFacts {
    /// Name of the satellite, as its elements have it.
    pub object: String,
    /// Its catalogue number.
    pub norad_cat_id: Option<u64>,
    /// Latitude, longitude \[deg\] and height \[m\] of the observer.
    pub site: Option<[f64; 3]>,
    /// The instant, UTC, ISO 8601.
    pub date_mid: String,
    /// V magnitude of the sum.
    pub v_mag: Option<f64>,
    /// The picture does not hold the whole satellite: `v_mag` is that of the part in it.
    pub part: bool,
    /// Altitude and azimuth \[deg\], if they are known.
    pub alt_az_deg: Option<(f64, f64)>,
    /// What a reader should know, a line each.
    pub comments: Vec<String>,
}

/// Writes the picture.
///
/// # Errors
/// [`crate::Error::Io`].
pub fn write_picture(path: &Path, image: &RadianceImage, facts: &PictureFacts) -> Result<()> {
    let (ny, nx) = image.planes.first().map_or((0, 0), |(_, plane)| plane.dim());
    let mut sum = Array2::zeros((ny, nx));
    image.planes.iter().for_each(|(_, plane)| sum += plane);
    write_streamed(path, |out| {
        let mut head = Cards::default();
        head.value("SIMPLE", "T", "FITS 4.0");
        shape(&mut head, (nx, ny));
        head.value("EXTEND", "T", "one image for each light follows")
            .text("ORIGIN", "satphot", "")
            .text("OBJECT", &facts.object, "")
            .text("LIGHT", "total", "sum of the lights");
        common(&mut head, image, facts);
        facts.comments.iter().for_each(|line| {
            head.comment(line);
        });
        write_image(out, head, &sum)?;
        for (light, plane) in &image.planes {
            let mut head = Cards::default();
            head.text("XTENSION", "IMAGE", "");
            shape(&mut head, (nx, ny));
            head.value("PCOUNT", "0", "").value("GCOUNT", "1", "").text("EXTNAME", &light.name().to_uppercase(), "");
            head.text("LIGHT", light.name(), "");
            common(&mut head, image, facts);
            write_image(out, head, plane)?;
        }
        Ok(())
    })
}

fn shape(head: &mut Cards, (nx, ny): (usize, usize)) {
    head.value("BITPIX", "-64", "").value("NAXIS", "2", "");
    head.value("NAXIS1", &nx.to_string(), "").value("NAXIS2", &ny.to_string(), "");
}

fn common(head: &mut Cards, image: &RadianceImage, facts: &PictureFacts) {
    let real = |x: f64| format!("{x:.12E}");
    head.text("BUNIT", "W m-2 sr-1", "radiance in band at the entrance aperture")
        .text("DATE-OBS", facts.date_mid.trim_end_matches('Z'), "UTC")
        .text("TIMESYS", "UTC", "")
        .value("PIXSCALE", &real(image.pixel_rad.to_degrees() * 3600.0), "[arcsec] side of a pixel")
        .value("PIXSIZE", &real(image.pixel_rad * image.range_km * 1e3), "[m] side of a pixel at the satellite")
        .value("RANGE", &real(image.range_km), "[km] observer to satellite")
        .value("BANDLOW", &real(image.band_um.0), "[um]")
        .value("BANDHIGH", &real(image.band_um.1), "[um]")
        .value("WAVELEN", &real(image.wavelength_um), "[um] mean of sunlight in the band")
        .text("ORIENT", "north up, east left", "rows to the north, columns to the west");
    head.value("WHOLE", if facts.part { "F" } else { "T" }, "the picture holds the whole satellite");
    match facts.v_mag {
        Some(v) if facts.part => head.value("VMAGPART", &real(v), "[mag] V of the part in the picture, all lights"),
        Some(v) => head.value("VMAG", &real(v), "[mag] all lights, Vega, no atmosphere"),
        None => head,
    };
    if let Some(number) = facts.norad_cat_id {
        head.value("NORADID", &number.to_string(), "catalogue number");
    }
    if let Some([lat_deg, lon_deg, alt_m]) = facts.site {
        head.value("SITELAT", &real(lat_deg), "[deg] latitude of the observer, north positive");
        head.value("SITELONG", &real(lon_deg), "[deg] longitude, east positive");
        head.value("SITEELEV", &real(alt_m), "[m] elevation");
    }
    if let Some((alt, az)) = facts.alt_az_deg {
        head.value("SATALT", &real(alt), "[deg] altitude of the satellite");
        head.value("SATAZ", &real(az), "[deg] azimuth, north through east");
    }
}

fn write_image(out: &mut impl Write, head: Cards, plane: &Array2<f64>) -> std::io::Result<()> {
    let mut bytes: Vec<u8> = plane.iter().flat_map(|v| v.to_be_bytes()).collect();
    bytes.resize(bytes.len().div_ceil(BLOCK) * BLOCK, 0);
    let mut sum = Sum::default();
    sum.add(&bytes);
    out.write_all(&head.finished(sum.total()))?;
    out.write_all(&bytes)
}
