//! Camera, filter and pixel scale as a header states them.
//!
//! Scales in arcsec/px, pixels in µm with the binning, focal lengths in mm. It does not cover the configuration, which
//! wins.

use super::names::{Aliases, find, keywords};
use super::sourced::Sourced;
use crate::fits::cards::Header;

/// The camera and the optics as a header states them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Optics {
    /// The camera.
    pub camera: Option<Sourced<String>>,
    /// Pixel scale \[arcsec/px\].
    pub scale_arcsec: Option<Sourced<f64>>,
    /// Offset (black level) setting of the camera.
    pub offset: Option<Sourced<f64>>,
    /// Temperature of the sensor \[°C\].
    pub temperature_c: Option<Sourced<f64>>,
    /// Read noise \[e⁻\].
    pub read_noise_e: Option<Sourced<f64>>,
    /// Warnings.
    pub warnings: Vec<String>,
}

/// The text of FILTER and its synonyms; `None` where it is absent. [`filter_meaning`] returns its meaning.
///
/// FWHEEL is not a synonym: N.I.N.A. and Sequence Generator Pro write the name of the wheel there.
///
/// [`filter_meaning`]: crate::bands::filter_meaning
#[must_use]
pub fn filter(header: &Header, aliases: &Aliases) -> Option<Sourced<String>> {
    let key = find(header, aliases, "filter")?;
    header.text(&key).map(|value| Sourced::new(value, key))
}

/// Camera, scale and the like.
#[must_use]
pub fn optics(header: &Header, aliases: &Aliases) -> Optics {
    let text = |q: &str| find(header, aliases, q).and_then(|k| Some(Sourced::new(header.text(&k)?, k)));
    let first = |keys: &[&str]| keys.iter().find_map(|k| Some(Sourced::new(header.number(k)?, *k)));
    let positive = |keys: &[&str]| first(keys).filter(|t| t.value > 0.0);
    let mut warnings = Vec::new();
    let pixel_um = positive(&["XPIXSZ", "PIXSIZE1", "PIXSZ"]);
    let focal_mm = positive(&["FOCALLEN", "FOCAL"]);
    let computed = pixel_um
        .as_ref()
        .zip(focal_mm.as_ref())
        .map(|(p, f)| Sourced::new(pixel_scale_arcsec(p.value, 1, f.value), format!("{}/{}", p.source, f.source)));
    let written = positive(&keywords(aliases, "pix_scale"));
    if let (Some(w), Some(c)) = (&written, &computed)
        && (w.value / c.value - 1.0).abs() > 0.1
    {
        warnings.push(format!(
            "{} = {:.4} arcsec/px, {} give {:.4}: XPIXSZ holds the binning in most programs, not in all",
            w.source, w.value, c.source, c.value
        ));
    }
    Optics {
        camera: text("camera"),
        scale_arcsec: written.or(computed),
        offset: first(&keywords(aliases, "offset")),
        temperature_c: first(&["CCD-TEMP", "CCDTEMP", "CCDATEMP", "CAMTEMP", "SET-TEMP"]),
        read_noise_e: positive(&keywords(aliases, "read_noise")),
        warnings,
    }
}

/// Angle of one pixel on the sky \[arcsec\], for a pixel pitch \[µm\], binning and focal length \[mm\].
///
/// s = atan(p b / f).
#[must_use]
pub fn pixel_scale_arcsec(pixel_um: f64, binning: u32, focal_length_mm: f64) -> f64 {
    (pixel_um * 1e-3 * f64::from(binning) / focal_length_mm).atan().to_degrees() * 3_600.0
}
