//! The Earth's picture as FITS, and places in words.
//!
//! W m⁻² sr⁻¹, W m⁻², deg, km. Results only.

use std::path::Path;

use crate::base::error::Result;
use crate::brightness::earth_view::EarthPicture;
use crate::fits::{card, write_f32};
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
    let cards = [
        card("OBJECT", "Earth", "what is shown"),
        card("BUNIT", "W m-2 sr-1", "radiance"),
        card("DATE-OBS", row.date.trim_end_matches('Z'), "UTC"),
        card("LAMP", row.lamp.as_str(), "what lights the Earth"),
        card("LAMPE", row.lamp_w_m2, "[W m-2] irradiance of the source in the band"),
        card("LAMPLON", row.lamp_lon_deg, "[deg] longitude of the subsource point"),
        card("LAMPLAT", row.lamp_lat_deg, "[deg] latitude of the subsource point"),
        card("VIEWLON", row.view_lon_deg, "[deg] longitude under the viewpoint"),
        card("VIEWLAT", row.view_lat_deg, "[deg] latitude under the viewpoint"),
        card("VIEWH", row.view_height_km, "[km] height of the viewpoint"),
        card("PIXSR", picture.pixel_sr(), "[sr] solid angle of a pixel"),
        card("PROJ", "azimuthal equal-area about nadir", "north up, east right"),
        card("SWCREATE", concat!("satphot ", env!("CARGO_PKG_VERSION"), " plot earth"), "computed"),
    ];
    write_f32(path, &picture.radiance.mapv(|v| v as f32), &cards)
}
