//! What is asked of a table of observations, and how its rows say where everything is.

use std::collections::BTreeMap;
use std::path::Path;

use super::columns::Columns;
use crate::bands::Band;
use crate::base::error::{Error, Result};
use crate::base::stop::Stop;
use crate::brightness::{ModelSettings, Satellite};
use crate::config;
use crate::orbit::Site;
use crate::tables::read::Table;

/// What is asked of a table of observations.
#[derive(Debug)]
pub struct Request<'a> {
    /// The table: CSV, ECSV, VOTable, FITS or what else [`Table`] reads.
    pub table: &'a Path,
    /// Names of columns, or numbers for all rows, by key: `alt_deg`, `height_km`, `v_mag`, ...
    pub columns: BTreeMap<String, String>,
    /// Elements of the satellites; rows may have their own.
    pub orbit: Option<&'a config::Orbit>,
    /// The site of rows that state none.
    pub site: Option<Site>,
    /// Whether that site is used whatever the rows state.
    pub site_replaces: bool,
    /// The type of satellite they all are.
    pub satellite: &'a Satellite,
    /// How the model is evaluated.
    pub settings: &'a ModelSettings,
    /// Azimuth in which satellites of a geometry move \[rad\].
    pub track_az_rad: f64,
    /// Compare magnitudes; `None` predicts alone.
    pub magnitudes: Option<Magnitudes>,
    /// A request to stop.
    pub stop: &'a Stop,
}

/// How the magnitudes of a table are meant.
#[derive(Debug, Clone, Copy)]
pub struct Magnitudes {
    /// The band of the model, which they must be of.
    pub band: Band,
    /// They are reduced to this range, which is undone: m = m_reduced + 5 lg(range / this) \[km\].
    pub reduced_to_km: Option<f64>,
}

/// How the rows of a table say where everything is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Places {
    /// Time, satellite, site.
    Orbit,
    /// Altitude and azimuth of Sun and satellite, and its height or range; for want of those of the Sun time and site.
    Geometry,
}

/// What is wrong with a table as a whole.
pub(super) fn wrong(table: &Table, problem: String) -> Error {
    Error::Table { path: table.path.clone(), line: None, problem }
}

impl Request<'_> {
    /// How the rows say where everything is: by elements where there are any, else as a geometry.
    pub(super) fn places(&self, columns: &Columns, table: &Table) -> Result<Places> {
        let has_elements = self.orbit.is_some() || columns.tle_lines.is_some();
        let has_site = self.site.is_some() || columns.site.is_some();
        if columns.time.is_some() && has_elements && has_site {
            return Ok(Places::Orbit);
        }
        let height = columns.height_km.or(columns.range_km);
        // elements of the configuration are no reason to refuse a table without times
        let orbit_is_meant = has_elements && columns.time.is_some();
        let sun_is_known = columns.sun_alt_az_deg.is_some() || (columns.time.is_some() && has_site);
        if sun_is_known && columns.alt_az_deg.is_some() && height.is_some() && !orbit_is_meant {
            return Ok(Places::Geometry);
        }
        let mut by_orbit = Vec::new();
        for (there, what) in [
            (columns.time.is_some(), "a column of times (argument `column time=NAME`)"),
            (has_elements, "elements (argument `elements`, or columns tle_line1 and tle_line2)"),
            (has_site, "a site (argument `site`, or columns site_lat_deg, site_lon_deg, site_alt_m)"),
        ] {
            by_orbit.extend((!there).then_some(what));
        }
        let mut by_geometry = Vec::new();
        for (there, what) in [
            (sun_is_known, "sun_alt_deg and sun_az_deg (or times and a site)"),
            (columns.alt_az_deg.is_some(), "alt_deg and az_deg of the satellite"),
            (height.is_some(), "height_km or range_km"),
        ] {
            by_geometry.extend((!there).then_some(what));
        }
        let of_geometry = if has_elements {
            String::new()
        } else {
            format!(", or as a geometry for want of {}", by_geometry.join(", "))
        };
        Err(wrong(
            table,
            format!(
                "cannot be computed for want of {}{of_geometry}; present: {}; argument `column KEY=NAME` names a column",
                by_orbit.join(", "),
                table.names()
            ),
        ))
    }
}
