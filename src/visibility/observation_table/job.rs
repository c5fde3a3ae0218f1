//! What every row of a table of observations needs: columns, satellites, models; and where a row is.

use hifitime::Epoch;

use super::columns::Columns;
use super::request::{Places, Request};
use super::satellites::{Satellites, Which};
use crate::base::error::{Error, Result};
use crate::brightness::settings::PUBLISHED_EARTH_RADIUS_KM;
use crate::brightness::{Attitude, Model, ModelSettings};
use crate::orbit::{Site, Tracker};
use crate::tables::read::{Row, Table};

/// The models of the rows: by elements, and of a geometry with and without a Moon.
pub struct Models {
    /// By elements.
    pub by_orbit: Model,
    /// Of a geometry without and with a Moon.
    pub geometry: Option<[Model; 2]>,
}

impl Models {
    /// Checks satellite and settings.
    ///
    /// # Errors
    /// Those of [`Model::new`]; [`Error::Argument`] for a surface fixed among the stars in a geometry.
    pub fn new(request: &Request, places: Places) -> Result<Self> {
        let by_orbit = Model::new(request.satellite, request.settings)?;
        if places == Places::Geometry {
            let fixed = request.satellite.surfaces.iter().find(|s| matches!(s.attitude, Attitude::Inertial { .. }));
            if let Some(surface) = fixed {
                let problem = format!("{} is fixed among the stars: give times, elements and a site", surface.name);
                return Err(Error::Argument { name: "satellite".into(), problem });
            }
            let model = |moon: bool| {
                let settings = ModelSettings {
                    earth_radius_km: Some(PUBLISHED_EARTH_RADIUS_KM),
                    moon: moon && request.settings.moon,
                    ..request.settings.clone()
                };
                Model::new(request.satellite, &settings)
            };
            return Ok(Self { by_orbit, geometry: Some([model(false)?, model(true)?]) });
        }
        Ok(Self { by_orbit, geometry: None })
    }
}

/// What every row needs.
pub struct Job<'a> {
    pub request: &'a Request<'a>,
    pub table: &'a Table,
    pub columns: &'a Columns,
    pub satellites: &'a Satellites,
    pub models: &'a Models,
    pub places: Places,
}

impl Job<'_> {
    /// The site of a row.
    pub fn site(&self, row: &Row) -> std::result::Result<Site, String> {
        match (&self.columns.site, &self.request.site) {
            (Some(_), Some(site)) if self.request.site_replaces => Ok(site.clone()),
            (Some([lat, lon, height]), _) => {
                let [lat, lon, height] =
                    [lat.needed(row, self.table)?, lon.needed(row, self.table)?, height.needed(row, self.table)?];
                Site::new(lat, lon, height).map_err(|e| e.to_string())
            }
            (None, Some(site)) => Ok(site.clone()),
            (None, None) => Err("no site".into()),
        }
    }

    /// Time, tracker and site of a row.
    ///
    /// # Errors
    /// Which of them is missing or wrong, in words.
    pub fn place(&self, row: &Row, which: &Which) -> std::result::Result<(Epoch, &Tracker, Site), String> {
        let time = self.columns.time.as_ref().ok_or("no column of times")?;
        let epoch = time.of(row)?;
        let tracker = self.satellites.get(which.clone()?).ok_or("no tracker")?;
        Ok((epoch, tracker, self.site(row)?))
    }
}
