//! Which column of a table of observations is what: as the user names it, else by the names of SCORE, SatChecker, MMT-9, Pomenis
//! and satphot.
//!
//! Degrees, km, s, mag: units of the table are converted. Two columns that can be meant are an error, never a choice.

use std::collections::BTreeMap;

use super::number::Number;
use super::time::TimeColumn;
use crate::base::error::{Error, Result};
use crate::tables::guess::{ColumnGuesser, Given, Quantity, factor_of, given, keys, unknown_key};
use crate::tables::read::Table;
use crate::tables::unit::unit_in_name;

/// What is looked for, by the keys of argument `column`; satphot's own name is the first.
const KNOWN: [Quantity; 27] = [
    Quantity::named(
        "time",
        "date_mid mjd_mid_d observation_time_utc obs_time_utc observation_time obs_time time_utc utc_time datetime_utc \
         datetime utc timestamp mjd_utc mjd_mid mjd jd_utc jd date_avg date-avg time epoch date",
    ),
    Quantity::named(
        "start_time",
        "start_time_utc start_utc utc_start start_time time_start date_obs date-obs mjd_obs mjd-obs",
    ),
    Quantity::named("local_time", "local_time time_local date_local datetime_local local_datetime"),
    Quantity::named("exptime_s", "exptime_s exptime exposure_s exposure_time_s exposure_time exposure texp"),
    Quantity::named(
        "norad_cat_id",
        "norad_cat_id norad_id norad norad_number satellite_number sat_number satnum sat_id catalog_number catalogue_number",
    ),
    Quantity::named("object_name", "object_name satellite_name sat_name satellite object target sat name"),
    Quantity::named("tle_line1", "tle_line1 tle_line_1 line1 tle1"),
    Quantity::named("tle_line2", "tle_line2 tle_line_2 line2 tle2"),
    Quantity::named(
        "site_lat_deg",
        "site_lat_deg observer_latitude_deg obs_lat_deg observer_latitude latitude_deg lat_deg latitude site_lat obs_lat lat",
    ),
    Quantity::named(
        "site_lon_deg",
        "site_lon_deg observer_longitude_deg obs_long_deg obs_lon_deg observer_longitude longitude_deg lon_deg longitude \
         site_lon obs_lon lon",
    ),
    Quantity::named(
        "site_alt_m",
        "site_alt_m observer_altitude_m obs_alt_m observer_height_m site_height_m site_elevation_m observer_altitude",
    ),
    Quantity::named(
        "alt_deg",
        "alt_deg sat_alt_deg satellite_alt_deg satellite_altitude_deg alt_deg_satchecker satellite_altitude sat_altitude sat_alt \
         alt_rad sat_alt_rad elevation_deg el_deg altitude_deg elevation altitude alt el",
    ),
    Quantity::named(
        "az_deg",
        "az_deg sat_az_deg satellite_az_deg satellite_azimuth_deg az_deg_satchecker satellite_azimuth sat_azimuth sat_az \
         az_rad sat_az_rad azimuth_deg azimuth az",
    ),
    Quantity::named(
        "sun_alt_deg",
        "sun_alt_deg sun_altitude_deg sun_elevation_deg sun_el_deg sun_altitude sun_elevation solar_altitude sun_alt_rad sun_alt",
    ),
    Quantity::named("sun_alt_sat_deg", "sun_alt_sat_deg sun_elev_sat_deg sun_elevation_at_satellite_deg"),
    Quantity::named("sun_az_deg", "sun_az_deg sun_azimuth_deg sun_azimuth solar_azimuth sun_az_rad sun_az"),
    Quantity::named(
        "moon_alt_deg",
        "moon_alt_deg moon_altitude_deg moon_altitude moon_elevation moon_alt_rad moon_alt",
    ),
    Quantity::named("moon_az_deg", "moon_az_deg moon_azimuth_deg moon_azimuth moon_az_rad moon_az"),
    Quantity::named(
        "height_km",
        "height_km sat_height_km satellite_height_km orbit_height_km sat_altitude_km_satchecker sat_altitude_km height_m \
         sat_height_m satellite_height_m satellite_height orbit_height sat_height height",
    ),
    Quantity::named(
        "range_km",
        "range_km range_to_satellite_km range_to_sat_km_satchecker sat_range_km slant_range_km distance_km km_distance range_m \
         slant_range range distance",
    ),
    Quantity::named("phase_angle_deg", "phase_angle_deg phase_angle_deg_satchecker phase_deg phase_angle phase"),
    Quantity::named(
        "v_mag",
        "v_mag apparent_magnitude apparent_mag app_mag obs_mag observed_mag observed_magnitude ab_magnitude ab_mag {}_mag {}mag \
         calibed_mags calibrated_mag magnitude mag vmag {}",
    ),
    Quantity::named(
        "v_mag_err",
        "v_mag_err apparent_magnitude_uncertainty apparent_mag_uncert mag_uncertainty mag_error mag_err magerr e_mag",
    ),
    Quantity::named("limit_v_mag", "limit_v_mag limiting_magnitude limiting_mag limit_mag mag_limit"),
    Quantity::named("filter", "filter observing_filter obs_filter passband band filt"),
    Quantity::named("verdict", "verdict"),
    Quantity::named("status", "status"),
];

/// Names of magnitudes that are not apparent: reduced to a distance, or to a distance and a phase.
const REDUCED: [&str; 15] = [
    "stdmag",
    "std_mag",
    "standard_mag",
    "standard_magnitude",
    "mag_std",
    "m1000",
    "mag1000",
    "mag_1000",
    "mag_1000km",
    "m_1000km",
    "mag_550km",
    "h550",
    "standard_v_mag",
    "v_mag_1000km",
    "v_mag_550km",
];
/// Keys for which the first of several names is taken: a table holds its time and its satellite in several forms.
const FIRST_COUNTS: [&str; 4] = ["time", "start_time", "object_name", "norad_cat_id"];

/// The columns of a table of observations, as far as they are there.
#[derive(Debug, Default)]
#[allow(missing_docs)] // the keys above
pub struct Columns {
    pub time: Option<TimeColumn>,
    pub norad_cat_id: Option<usize>,
    pub object_name: Option<usize>,
    pub tle_lines: Option<[usize; 2]>,
    /// Latitude, longitude, height.
    pub site: Option<[Number; 3]>,
    pub alt_az_deg: Option<[Number; 2]>,
    pub sun_alt_az_deg: Option<[Number; 2]>,
    pub moon_alt_az_deg: Option<[Number; 2]>,
    pub height_km: Option<Number>,
    pub range_km: Option<Number>,
    pub phase_angle_deg: Option<Number>,
    /// Altitude of the Sun at the satellite.
    pub sun_alt_sat_deg: Option<Number>,
    pub v_mag: Option<Number>,
    pub v_mag_err: Option<Number>,
    pub limit_v_mag: Option<Number>,
    pub filter: Option<usize>,
    pub verdict: Option<usize>,
    pub status: Option<usize>,
    /// A column of magnitudes that are not apparent.
    pub reduced_mag: Option<usize>,
    /// Quantity and column, for the reader.
    pub taken: Vec<(&'static str, String)>,
}

impl Columns {
    /// Finds the columns.
    ///
    /// # Errors
    /// [`Error::Argument`] for a key that is none, or a column the user names that is not there; [`Error::Table`] for two
    /// columns that can be meant, and for a unit of something else.
    pub fn find(table: &Table, columns: &BTreeMap<String, String>, band: &str) -> Result<Columns> {
        if let Some(key) = unknown_key(&KNOWN, columns) {
            return Err(Error::Argument {
                name: format!("column {key}"),
                problem: format!("is not a quantity of a table of observations; known: {}", keys(&KNOWN)),
            });
        }
        let mut find = Finder { table, columns, band, taken: Vec::new() };
        let pair = |a: Option<Number>, b: Option<Number>| a.zip(b).map(|(a, b)| [a, b]);
        let (lat, lon, height) =
            (find.number("site_lat_deg")?, find.number("site_lon_deg")?, find.number("site_alt_m")?);
        let site = match (lat, lon) {
            (Some(lat), Some(lon)) => Some([lat, lon, height.unwrap_or(Number::of_constant(0.0))]),
            (None, None) => None,
            (a, _) => {
                let (there, missing) =
                    if a.is_some() { ("site_lat_deg", "site_lon_deg") } else { ("site_lon_deg", "site_lat_deg") };
                return Err(find.wrong(format!(
                    "has a column of {there} and none of {missing}; present: {}; argument `column {missing}=NAME` names it",
                    table.names()
                )));
            }
        };
        let lines = find.column("tle_line1")?.zip(find.column("tle_line2")?).map(|(a, b)| [a, b]);
        let time = find.time()?;
        let found = Columns {
            time,
            norad_cat_id: find.column("norad_cat_id")?,
            object_name: find.column("object_name")?,
            tle_lines: lines,
            site,
            alt_az_deg: pair(find.number("alt_deg")?, find.number("az_deg")?),
            sun_alt_az_deg: pair(find.number("sun_alt_deg")?, find.number("sun_az_deg")?),
            moon_alt_az_deg: pair(find.number("moon_alt_deg")?, find.number("moon_az_deg")?),
            height_km: find.number("height_km")?,
            range_km: find.number("range_km")?,
            phase_angle_deg: find.number("phase_angle_deg")?,
            sun_alt_sat_deg: find.number("sun_alt_sat_deg")?,
            v_mag: find.number("v_mag")?,
            v_mag_err: find.number("v_mag_err")?,
            limit_v_mag: find.number("limit_v_mag")?,
            filter: find.column("filter")?,
            verdict: find.column("verdict")?,
            status: find.column("status")?,
            reduced_mag: REDUCED.iter().find_map(|name| table.column(name)),
            taken: Vec::new(),
        };
        Ok(Columns { taken: find.taken, ..found })
    }
}

struct Finder<'a> {
    table: &'a Table,
    columns: &'a BTreeMap<String, String>,
    band: &'a str,
    taken: Vec<(&'static str, String)>,
}

impl Finder<'_> {
    fn wrong(&self, problem: String) -> Error {
        Error::Table { path: self.table.path.clone(), line: None, problem }
    }

    /// The column or the number of a key.
    fn find(&mut self, key: &'static str) -> Result<Option<Given>> {
        let own = given(self.table, self.columns, key)?;
        let found = match own {
            Some(given) => Some(given),
            None => self.known(key)?.map(Given::Column),
        };
        if let Some(given) = found {
            let name = match given {
                Given::Column(i) => self.table.columns[i].name.clone(),
                Given::Constant(v) => v.to_string(),
            };
            self.taken.push((key, name));
        }
        Ok(found)
    }

    /// The column of a key by the names known for it.
    fn known(&self, key: &str) -> Result<Option<usize>> {
        let guess = ColumnGuesser { table: self.table, quantities: &KNOWN, band: self.band };
        let mut found: Vec<usize> = Vec::new();
        for i in guess.names(key).filter_map(|name| guess.first_of([name])) {
            if !found.contains(&i) {
                found.push(i);
            }
        }
        let own = guess.names(key).next().and_then(|name| self.table.column(name));
        match found.as_slice() {
            [] => Ok(None),
            [one] => Ok(Some(*one)),
            [first, ..] if own == Some(*first) || FIRST_COUNTS.contains(&key) => Ok(Some(*first)),
            [a, b, ..] => {
                let name = |i: &usize| &self.table.columns[*i].name;
                Err(self.wrong(format!(
                    "columns `{}` and `{}` can both be {key}: argument `column {key}=NAME` says which is",
                    name(a),
                    name(b)
                )))
            }
        }
    }

    fn number(&mut self, key: &'static str) -> Result<Option<Number>> {
        let Some(from) = self.find(key)? else { return Ok(None) };
        Ok(Some(match from {
            Given::Constant(value) => Number::of_constant(value),
            Given::Column(i) => {
                let column = &self.table.columns[i];
                let unit_is_stated = !column.unit.trim().is_empty() || !unit_in_name(&column.name).is_empty();
                Number { from, factor: factor_of(self.table, key, i)?, unit_is_stated }
            }
        }))
    }

    fn column(&mut self, key: &'static str) -> Result<Option<usize>> {
        match self.find(key)? {
            None => Ok(None),
            Some(Given::Column(i)) => Ok(Some(i)),
            Some(Given::Constant(v)) => {
                Err(Error::Argument { name: format!("column {key}={v}"), problem: "a column is needed here".into() })
            }
        }
    }

    /// The time: of mid-exposure, or of the start with half the exposure added.
    fn time(&mut self) -> Result<Option<TimeColumn>> {
        let own_start = self.columns.contains_key("start_time");
        let mid = if own_start { None } else { self.column("time")? };
        let start = if mid.is_none() { self.column("start_time")? } else { None };
        let local = if mid.or(start).is_none() { self.column("local_time")? } else { None };
        let Some(at) = mid.or(start).or(local) else { return Ok(None) };
        // a date beside the time of day, as MMT-9 writes them
        let is = |i: usize, name: &str| self.table.columns[i].name.eq_ignore_ascii_case(name);
        let date = if is(at, "time") { self.table.column("date").filter(|i| *i != at) } else { None };
        let exptime_s = if start.is_some() { self.number("exptime_s")? } else { None };
        let column = &self.table.columns[at];
        TimeColumn::new(column, at, date, (start.is_some(), exptime_s), local.is_some())
            .map(Some)
            .map_err(|p| self.wrong(p))
    }
}
