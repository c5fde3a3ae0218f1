//! Tables of the Earth under a lamp and of a ground track, and the Earth's picture as FITS.
//!
//! W m⁻² sr⁻¹, W m⁻², deg, km. Results only.

use std::path::Path;

use serde::Serialize;

use crate::base::error::Result;
use crate::brightness::earth_view::EarthPicture;
use crate::fits::{CardValue, write_f32};
use crate::tables::columns::{Column, number, text};
use crate::tables::ecsv::write;
use crate::tables::meta::Meta;

/// A place in words, `151.1 E, 33.8 S`, from longitude east and latitude north \[deg\].
#[must_use]
pub fn place_text(lon_deg: f64, lat_deg: f64, decimals: usize) -> String {
    let side = |v: f64, [positive, negative]: [char; 2]| {
        format!("{:.decimals$} {}", v.abs(), if v < 0.0 { negative } else { positive })
    };
    format!("{}, {}", side(lon_deg, ['E', 'W']), side(lat_deg, ['N', 'S']))
}

/// Columns of [`EarthRow`].
pub const EARTH: &[Column] = &[
    text("date", "UTC"),
    text("lamp", "what lights the Earth"),
    number("view_lon_deg", "deg", "longitude under the viewpoint, east positive"),
    number("view_lat_deg", "deg", "geodetic latitude under the viewpoint"),
    number("view_height_km", "km", "height of the viewpoint above the ellipsoid"),
    number("lamp_lon_deg", "deg", "longitude under the lamp"),
    number("lamp_lat_deg", "deg", "geodetic latitude under the lamp"),
    number("lamp_w_m2", "W m-2", "irradiance of the lamp across its beam in the band"),
    number("moon_phase_deg", "deg", "phase angle of the Moon from the Earth's centre, 0 = full"),
    number("radiance_under_lamp_w_m2_sr", "W m-2 sr-1", "radiance straight up under the lamp, f(n, n, n) E"),
    number("radiance_max_w_m2_sr", "W m-2 sr-1", "brightest pixel of the picture"),
    number("radiance_max_w_cm2_sr_um", "W cm-2 sr-1 um-1", "the same, mean over the band"),
    number(
        "irradiance_w_m2",
        "W m-2",
        "irradiance of the whole Earth at the viewpoint, the sum of radiance times solid angle",
    ),
    number("lit_frac", "", "share of the disc's solid angle that is lit"),
];

/// The Earth under a lamp, in numbers.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(missing_docs)] // the columns say what each is
pub struct EarthRow {
    pub date: String,
    pub lamp: String,
    pub view_lon_deg: f64,
    pub view_lat_deg: f64,
    pub view_height_km: f64,
    pub lamp_lon_deg: f64,
    pub lamp_lat_deg: f64,
    pub lamp_w_m2: f64,
    pub moon_phase_deg: f64,
    pub radiance_under_lamp_w_m2_sr: f64,
    pub radiance_max_w_m2_sr: f64,
    pub radiance_max_w_cm2_sr_um: f64,
    pub irradiance_w_m2: f64,
    pub lit_frac: f64,
}

/// Columns of [`TrackRow`].
pub const TRACK: &[Column] = &[
    text("date", "UTC"),
    number("lon_deg", "deg", "longitude under the satellite, east positive"),
    number("lat_deg", "deg", "geodetic latitude under the satellite"),
    number("height_km", "km", "height of the satellite above the ellipsoid"),
    number("sun_alt_deg", "deg", "altitude of the Sun over the ground there, no refraction"),
    number("moon_alt_deg", "deg", "altitude of the Moon over the ground there, no refraction"),
];

/// One moment of a ground track.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(missing_docs)] // the columns say what each is
pub struct TrackRow {
    pub date: String,
    pub lon_deg: f64,
    pub lat_deg: f64,
    pub height_km: f64,
    pub sun_alt_deg: f64,
    pub moon_alt_deg: f64,
}

/// Writes the row of a picture.
///
/// # Errors
/// [`crate::Error::Table`] for a number that is not finite; [`crate::Error::Io`].
pub fn write_earth(path: &Path, row: &EarthRow, meta: &Meta) -> Result<()> {
    write(path, std::slice::from_ref(row), EARTH, meta)
}

/// Writes a ground track.
///
/// # Errors
/// As [`write_earth`].
pub fn write_track(path: &Path, rows: &[TrackRow], meta: &Meta) -> Result<()> {
    write(path, rows, TRACK, meta)
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
