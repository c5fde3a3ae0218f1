//! A radiance image as FITS: the sum of the lights in the primary HDU, one IMAGE extension for each light.
//!
//! W m⁻² sr⁻¹ as 64-bit floats; first row south, first column east. Orientation and scale are stated as cards, not as a
//! celestial WCS: a moving satellite has no fixed place. Source: FITS Standard 4.0.

use std::path::Path;

use ndarray::Array2;

use crate::base::error::Result;
use crate::fits::card_value::{CardLine, card};
use crate::fits::raw::{NewFits, Pixels};
use crate::fits::write::write_hdus;
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
/// [`crate::Error::Io`], [`crate::Error::Fits`].
pub fn write_picture(path: &Path, image: &RadianceImage, facts: &PictureFacts) -> Result<()> {
    let (ny, nx) = image.planes.first().map_or((0, 0), |(_, plane)| plane.dim());
    let mut sum = Array2::zeros((ny, nx));
    image.planes.iter().for_each(|(_, plane)| sum += plane);
    write_hdus(path, |file| {
        let mut head = vec![
            card("ORIGIN", "satphot", ""),
            card("OBJECT", facts.object.as_str(), ""),
            card("LIGHT", "total", "sum of the lights"),
        ];
        head.extend(common(image, facts));
        head.extend(facts.comments.iter().map(|line| card("COMMENT", line.as_str(), "")));
        append(file, &head, &sum)?;
        image.planes.iter().try_for_each(|(light, plane)| {
            let name = light.name().to_uppercase();
            let mut head = vec![card("EXTNAME", name.as_str(), ""), card("LIGHT", light.name(), "")];
            head.extend(common(image, facts));
            append(file, &head, plane)
        })
    })
}

fn append(file: &mut NewFits, head: &[CardLine], plane: &Array2<f64>) -> Result<()> {
    let (ny, nx) = plane.dim();
    let plane = plane.as_standard_layout();
    file.image(&Pixels::F64(plane.as_slice().unwrap_or(&[])), (nx, ny), head, false)?;
    file.checksum()
}

fn common(image: &RadianceImage, facts: &PictureFacts) -> Vec<CardLine> {
    let mut head = vec![
        card("BUNIT", "W m-2 sr-1", "radiance in band at the entrance aperture"),
        card("DATE-OBS", facts.date_mid.trim_end_matches('Z'), "UTC"),
        card("TIMESYS", "UTC", ""),
        card("PIXSCALE", image.pixel_rad.to_degrees() * 3600.0, "[arcsec] side of a pixel"),
        card("PIXSIZE", image.pixel_rad * image.range_km * 1e3, "[m] side of a pixel at the satellite"),
        card("RANGE", image.range_km, "[km] observer to satellite"),
        card("BANDLOW", image.band_um.0, "[um]"),
        card("BANDHIGH", image.band_um.1, "[um]"),
        card("WAVELEN", image.wavelength_um, "[um] mean of sunlight in the band"),
        card("ORIENT", "north up, east left", "rows to the north, columns to the west"),
        card("WHOLE", !facts.part, "the picture holds the whole satellite"),
    ];
    head.extend(facts.v_mag.map(|v| match facts.part {
        true => card("VMAGPART", v, "[mag] V of the part in the picture, all lights"),
        false => card("VMAG", v, "[mag] all lights, Vega, no atmosphere"),
    }));
    head.extend(facts.norad_cat_id.map(|number| card("NORADID", number as i64, "catalogue number")));
    if let Some([lat_deg, lon_deg, alt_m]) = facts.site {
        head.push(card("SITELAT", lat_deg, "[deg] latitude of the observer, north positive"));
        head.push(card("SITELONG", lon_deg, "[deg] longitude, east positive"));
        head.push(card("SITEELEV", alt_m, "[m] elevation"));
    }
    if let Some((alt, az)) = facts.alt_az_deg {
        head.push(card("SATALT", alt, "[deg] altitude of the satellite"));
        head.push(card("SATAZ", az, "[deg] azimuth, north through east"));
    }
    head
}
