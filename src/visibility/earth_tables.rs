//! The Earth's picture as FITS, and places in words.
//!
//! W m⁻² sr⁻¹, W m⁻², deg, km. Results only.

use std::path::Path;

use crate::base::error::Result;
use crate::brightness::earth_view::EarthPicture;
use crate::fits::{CardValue, write_f32};
use crate::tables::EarthRow;

/// A place in words, `151.1 E, 33.8 S`, from longitude east and latitude north \[deg\].
#[must_use]
pub fn place_text(lon_deg: f64, lat_deg: f64, decimals: usize) -> String {
    let side = |v: f64, [positive, negative]: [char; 2]| {
        format!("{:.decimals$} {}", v.abs(), if v < 0.0 { negative } else { positive })
    };
    format!("{}, {}", side(lon_deg, ['E', 'W']), side(lat_deg, ['N', 'S']))
}

/// Writes the radiances as 32-bit FITS: first row in the south, first column in the west.
///
/// # Errors
/// [`crate::Error::Fits`], [`crate::Error::Io`].
pub fn write_earth_fits(path: &Path, picture: &EarthPicture, row: &EarthRow) -> Result<()> {
    let text =
        |key: &str, value: &str, comment: &str| (key.to_owned(), CardValue::Text(value.into()), comment.to_owned());
    let real = |key: &str, value: f64, comment: &str| (key.to_owned(), CardValue::Real(value), comment.to_owned());
    let cards = [
        text("OBJECT", "Earth", "what is shown"),
        text("BUNIT", "W m-2 sr-1", "radiance"),
        text("DATE-OBS", row.date.trim_end_matches('Z'), "UTC"),
        text("LAMP", &row.lamp, "what lights the Earth"),
        real("LAMPE", row.lamp_w_m2, "[W m-2] irradiance of the lamp in the band"),
        real("LAMPLON", row.lamp_lon_deg, "[deg] longitude under the lamp"),
        real("LAMPLAT", row.lamp_lat_deg, "[deg] latitude under the lamp"),
        real("VIEWLON", row.view_lon_deg, "[deg] longitude under the viewpoint"),
        real("VIEWLAT", row.view_lat_deg, "[deg] latitude under the viewpoint"),
        real("VIEWH", row.view_height_km, "[km] height of the viewpoint"),
        real("PIXSR", picture.pixel_sr(), "[sr] solid angle of a pixel"),
        text("PROJ", "azimuthal equal-area about nadir", "north up, east right"),
        text("SWCREATE", concat!("satphot ", env!("CARGO_PKG_VERSION"), " plot earth"), "computed"),
    ];
    write_f32(path, &picture.radiance.mapv(|v| v as f32), &cards)
}
