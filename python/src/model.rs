//! The model of a satellite: magnitudes of many satellites at many moments, or of geometries given as vectors.

use hifitime::Epoch;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use pyo3::types::PyList;
use rayon::prelude::*;
use satphot::base::time::mjd_utc;
use satphot::brightness::scene::local_radius_km;
use satphot::brightness::{Catalogue, ToleranceOf, catalogue_names};
use satphot::config;
use satphot::config::EarthRadius;
use satphot::orbit::{EarthOrientation, SkyBodies, bodies};
use satphot::tables::PREDICTION;
use satphot::{Brightness, Geometry, Illum, ModelSettings, Satellite, Scene, Vector};

use crate::elements::{Tracked, Watch};
use crate::errors::{bad, raise};
use crate::interrupt::{Stopped, interrupted, interruptible};
use crate::table::{Columns, Data};
use crate::times::{epoch, epochs, unix_ns};

/// Rows computed at a time: what is between a row and its columns stays small.
const BLOCK: usize = 16_384;

/// Most rows of one call; their columns are 40 GB.
const MOST_ROWS: usize = 200_000_000;

/// So few rows that no signal is looked for.
const FEW: usize = 64;

/// The columns of where everything is.
const GEOMETRY: [(&str, &str); 15] = [
    ("alt_deg", ""),
    ("az_deg", ""),
    ("range_km", ""),
    ("height_km", "geodetic height of the satellite"),
    ("rate_deg_s", ""),
    ("airmass", ""),
    ("phase_angle_deg", ""),
    ("sun_alt_deg", ""),
    ("sun_az_deg", "azimuth of the Sun from north through east"),
    ("moon_alt_deg", ""),
    ("moon_az_deg", "azimuth of the Moon from north through east"),
    ("moon_phase_deg", ""),
    ("moon_illum_pct", ""),
    ("moon_sep_deg", ""),
    ("tle_age_d", "moment of the row minus epoch of the elements"),
];

/// The columns of light.
const LIGHT: [(&str, &str); 9] = [
    ("sun_visible_frac", "share of the Sun's light that gets past the Earth to the satellite"),
    ("model_v_mag", ""),
    ("sun_v_mag", ""),
    ("earthshine_v_mag", ""),
    ("moon_v_mag", ""),
    ("lunar_earthshine_v_mag", ""),
    ("model_err_mag", ""),
    ("v_pred_err_mag", ""),
    ("mu_mean_mag_arcsec2", "mean surface brightness of the model over the satellite's area, seen in projection"),
];

fn geometry_cells(g: &Geometry) -> [f64; GEOMETRY.len()] {
    [
        g.alt_rad.to_degrees(),
        g.az_rad.to_degrees(),
        g.range_km,
        g.height_km,
        g.rate_rad_s.to_degrees(),
        g.airmass.unwrap_or(f64::NAN),
        g.phase_angle_rad.to_degrees(),
        g.sun_alt_rad.to_degrees(),
        g.sun_az_rad.to_degrees(),
        g.moon_alt_rad.to_degrees(),
        g.moon_az_rad.to_degrees(),
        g.moon_phase_rad.to_degrees(),
        100.0 * g.moon_illum_frac,
        g.moon_sep_rad.to_degrees(),
        g.tle_age_d,
    ]
}

/// Light that is not there is no magnitude: NaN.
fn light_cells(b: &Brightness) -> [f64; LIGHT.len()] {
    let mag = |value: Option<f64>| value.unwrap_or(f64::NAN);
    [
        b.sun_visible_frac,
        mag(b.total_v_mag),
        mag(b.sun.v_mag),
        mag(b.earthshine.v_mag),
        mag(b.moon.v_mag),
        mag(b.lunar_earthshine.v_mag),
        mag(b.total_v_mag.map(|_| b.err_mag)),
        mag(b.v_pred_err_mag),
        mag(b.mu_mean_mag_arcsec2),
    ]
}

fn illum_code(illum: Illum) -> u8 {
    Illum::ALL.iter().position(|one| *one == illum).map_or(0, |place| place as u8)
}

fn illum_names() -> Vec<String> {
    Illum::ALL.iter().map(|one| one.as_str().to_owned()).collect()
}

/// Columns of numbers under construction.
struct Numbers<const N: usize>([Vec<f64>; N]);

impl<const N: usize> Numbers<N> {
    /// Room for so many rows.
    ///
    /// # Errors
    /// [`satphot::Error::Argument`] where the memory has no such room.
    fn with_capacity(rows: usize) -> Answer<Self> {
        let mut columns = std::array::from_fn(|_| Vec::new());
        for column in &mut columns {
            column.try_reserve_exact(rows).map_err(|_| too_many(rows))?;
        }
        Ok(Self(columns))
    }

    fn push(&mut self, cells: &[f64; N]) {
        for (column, cell) in self.0.iter_mut().zip(cells) {
            column.push(*cell);
        }
    }

    fn into_columns(self, names: &[(&str, &str); N], columns: &mut Columns) {
        for (values, (name, about)) in self.0.into_iter().zip(names) {
            if about.is_empty() {
                columns.of(&PREDICTION, name, Data::Float(values));
            } else {
                columns.own(name, unit_of(name), about, Data::Float(values));
            }
        }
    }
}

/// The unit in a name.
fn unit_of(name: &str) -> &'static str {
    let ends = [("_mag_arcsec2", "mag / arcsec2"), ("_deg", "deg"), ("_km", "km"), ("_d", "d"), ("_mag", "mag")];
    ends.into_iter().find(|(end, _)| name.ends_with(end)).map_or("", |(_, unit)| unit)
}

type Light = ([f64; LIGHT.len()], Illum);

/// The light of many rows.
struct Lights {
    numbers: Numbers<{ LIGHT.len() }>,
    illum: Vec<u8>,
}

impl Lights {
    fn with_capacity(rows: usize) -> Answer<Self> {
        Ok(Self { numbers: Numbers::with_capacity(rows)?, illum: Vec::with_capacity(rows) })
    }

    fn push(&mut self, light: Option<&Light>) {
        let (cells, illum) = light.map_or(([f64::NAN; LIGHT.len()], Illum::None), |light| *light);
        self.numbers.push(&cells);
        self.illum.push(illum_code(illum));
    }

    fn into_columns(self, columns: &mut Columns) {
        columns.of(&PREDICTION, "illum", Data::Code(self.illum, illum_names()));
        self.numbers.into_columns(&LIGHT, columns);
    }
}

/// What is computed of a row, or the sentence why not.
type Answer<T> = Result<T, satphot::Error>;

/// A satellite under settings.
#[pyclass(frozen, module = "satphot._satphot")]
pub struct Model {
    pub(crate) config: config::Model,
    pub(crate) satellite: Satellite,
    pub(crate) settings: ModelSettings,
    model: satphot::Model,
}

#[pymethods]
impl Model {
    /// From the table `[model]` of a configuration, as JSON.
    #[new]
    fn new(json: &str) -> PyResult<Self> {
        let mut reader = serde_json::Deserializer::from_str(json);
        let config: config::Model = serde_path_to_error::deserialize(&mut reader).map_err(|error| {
            let path = error.path().to_string();
            let key = if path == "." { "model".into() } else { format!("model.{path}") };
            let problem = error.into_inner().to_string();
            let problem = problem.split(" at line ").next().unwrap_or_default().to_owned();
            raise(satphot::Error::Config { key, problem })
        })?;
        let satellite = Satellite::from_config(&config).map_err(raise)?;
        let settings = ModelSettings::try_from(&config).map_err(raise)?;
        let model = satphot::Model::new(&satellite, &settings).map_err(raise)?;
        Ok(Self { config, satellite, settings, model })
    }

    /// The name of the satellite.
    #[getter]
    fn name(&self) -> &str {
        &self.satellite.name
    }

    /// What observations say of the model of this satellite.
    #[getter]
    fn standing(&self) -> String {
        self.satellite.standing.text()
    }

    /// Area of all surfaces [m2].
    #[getter]
    fn area_m2(&self) -> f64 {
        self.satellite.surfaces.iter().map(|s| s.area_m2).sum()
    }

    /// Columns of every satellite at every moment, their names, and what is to be known of the elements.
    #[pyo3(signature = (watch, times_ns, is_tai, raise_errors, threads))]
    fn magnitudes<'py>(
        &self,
        py: Python<'py>,
        watch: Watch,
        times_ns: PyReadonlyArray1<'py, i64>,
        is_tai: bool,
        raise_errors: bool,
        threads: usize,
    ) -> PyResult<(Bound<'py, PyList>, Vec<String>, Vec<String>)> {
        let times_ns = times_ns.as_slice()?;
        let satellites = watch.satellites()?;
        let warnings = match times_ns.get(times_ns.len() / 2) {
            Some(middle) => warnings(&satellites, &epoch(*middle, is_tai)?),
            None => Vec::new(),
        };
        let is_quick = satellites.len().saturating_mul(times_ns.len()) <= FEW;
        let rows = interruptible(py, threads, is_quick, |stopped| {
            let moments = epochs(times_ns, is_tai, stopped)?;
            self.rows(&satellites, &moments, raise_errors, stopped).map_err(raise)
        })??;
        let names = satellites.into_iter().map(|s| s.name).collect();
        Ok((rows.into_py(py)?, names, warnings))
    }

    /// Columns of light of geometries: geocentric Earth-fixed vectors, three numbers a row.
    #[pyo3(signature = (satellite_km, velocity_km_s, observer_km, sun_km, moon_km, sidereal_rad, raise_errors, threads))]
    #[allow(clippy::too_many_arguments)] // the fields of a scene
    fn magnitudes_of_vectors<'py>(
        &self,
        py: Python<'py>,
        satellite_km: PyReadonlyArray1<'py, f64>,
        velocity_km_s: PyReadonlyArray1<'py, f64>,
        observer_km: PyReadonlyArray1<'py, f64>,
        sun_km: PyReadonlyArray1<'py, f64>,
        moon_km: PyReadonlyArray1<'py, f64>,
        sidereal_rad: PyReadonlyArray1<'py, f64>,
        raise_errors: bool,
        threads: usize,
    ) -> PyResult<Bound<'py, PyList>> {
        let sidereal_rad = sidereal_rad.as_slice()?;
        let n = sidereal_rad.len();
        let vectors = [
            ("satellite_km", satellite_km.as_slice()?),
            ("velocity_km_s", velocity_km_s.as_slice()?),
            ("observer_km", observer_km.as_slice()?),
            ("sun_km", sun_km.as_slice()?),
            ("moon_km", moon_km.as_slice()?),
        ];
        for (name, vector) in vectors {
            if vector.len() != 3 * n {
                return Err(bad(name, format!("{} numbers are not three for each of {n} rows", vector.len())));
            }
        }
        let [satellite, velocity, observer, sun, moon] = vectors.map(|(_, vector)| vector);
        let scene = |row: usize| Scene {
            satellite_km: vector(satellite, row),
            velocity_km_s: vector(velocity, row),
            observer_km: vector(observer, row),
            sun_km: vector(sun, row),
            moon_km: vector(moon, row),
            sidereal_rad: sidereal_rad.get(row).copied().unwrap_or(f64::NAN),
        };
        let one = |row: usize| self.light(&scene(row));
        let work = |stopped: Stopped| {
            let mut lights = Lights::with_capacity(n)?;
            let mut problems = Problems::new(raise_errors);
            blocks(n, stopped, one, |answer| {
                lights.push(problems.keep(answer)?.as_ref());
                Ok(())
            })?;
            let mut columns = Columns::default();
            lights.into_columns(&mut columns);
            problems.into_columns(&mut columns);
            Ok(columns)
        };
        interruptible(py, threads, n <= FEW, work)?.map_err(raise)?.into_py(py)
    }
}

impl Model {
    fn light(&self, scene: &Scene) -> Answer<Light> {
        self.model.brightness(scene).map(|b| (light_cells(&b), b.illum))
    }

    fn rows(&self, satellites: &[Tracked], moments: &[Epoch], raise_errors: bool, stopped: Stopped) -> Answer<Columns> {
        let n = satellites.len().saturating_mul(moments.len());
        if n > MOST_ROWS {
            return Err(too_many(n));
        }
        let skies = skies(satellites.len(), moments, stopped);
        let one = |row: usize| -> Answer<([f64; GEOMETRY.len()], Light)> {
            let (satellite, moment) = (&satellites[row / moments.len()], row % moments.len());
            let geometry = match skies.get(moment) {
                Some(Some(sky)) => satellite.tracker.at_under(&moments[moment], sky),
                _ => satellite.tracker.at(&moments[moment]),
            }?;
            Ok((geometry_cells(&geometry), self.light(&Scene::from(&geometry))?))
        };
        let mut geometries = Numbers::with_capacity(n)?;
        let mut lights = Lights::with_capacity(n)?;
        let mut problems = Problems::new(raise_errors);
        blocks(n, stopped, one, |answer| {
            let row = problems.keep(answer)?;
            geometries.push(row.as_ref().map_or(&[f64::NAN; GEOMETRY.len()], |row| &row.0));
            lights.push(row.as_ref().map(|row| &row.1));
            Ok(())
        })?;

        let mut columns = Columns::default();
        let each_satellite = |value: &dyn Fn(usize) -> i64| {
            Data::Int((0..satellites.len()).flat_map(|s| std::iter::repeat_n(value(s), moments.len())).collect())
        };
        let number = |s: usize| i64::try_from(satellites[s].norad_cat_id).unwrap_or(0);
        let times: Vec<i64> = moments.iter().map(|epoch| unix_ns(*epoch)).collect();
        let days: Vec<f64> = moments.iter().map(|epoch| mjd_utc(*epoch)).collect();
        columns.own("satellite", "", "place of the satellite among those given, from 0", each_satellite(&|s| s as i64));
        columns.own("norad_cat_id", "", "catalogue number of the satellite", each_satellite(&number));
        columns.own("time", "", "moment of the row, UTC", Data::Time(times.repeat(satellites.len())));
        columns.own("mjd_mid_d", "d", "moment of the row, MJD (UTC)", Data::Float(days.repeat(satellites.len())));
        geometries.into_columns(&GEOMETRY, &mut columns);
        lights.into_columns(&mut columns);
        problems.into_columns(&mut columns);
        Ok(columns)
    }

    /// The radius of the sphere on which an observer stands under a map of the sky \[km\].
    pub(crate) fn radius_km(&self, site: &satphot::Site) -> f64 {
        match self.settings.effects.earth_radius {
            EarthRadius::Local => local_radius_km(&site.position()),
            EarthRadius::Published => satphot::brightness::explicit::RADIUS_KM,
        }
    }

    /// The settings with the tolerance of the sum of all lights, which maps use.
    pub(crate) fn map_settings(&self) -> ModelSettings {
        ModelSettings { tolerance_of: ToleranceOf::Total, ..self.settings.clone() }
    }

    /// The middle of the heights of the satellite's orbits, where the catalogue knows one \[km\].
    pub(crate) fn height_km(&self) -> PyResult<Option<f64>> {
        let known = Catalogue::load(self.config.satellites.as_deref()).map_err(raise)?;
        let entry = known.find(&self.config.satellite).ok().filter(|_| self.config.surfaces.is_empty());
        let shell = entry.and_then(|e| e.orbits.first()).map(|shell| shell.height_km.bounds());
        Ok(shell.map(|[low, high]| 0.5 * (low + high)))
    }
}

fn vector<F>(numbers: &[f64], row: usize) -> Vector<F> {
    let at = |k: usize| numbers.get(3 * row + k).copied().unwrap_or(f64::NAN);
    Vector::new(at(0), at(1), at(2))
}

/// Sun and Moon of every moment, where several satellites share them; nothing where one does not, and where they fail.
fn skies(satellites: usize, moments: &[Epoch], stopped: Stopped) -> Vec<Option<SkyBodies>> {
    if satellites < 2 {
        return Vec::new();
    }
    let eop = EarthOrientation::default();
    moments.par_iter().map(|epoch| if stopped() { None } else { bodies(epoch, &eop).ok() }).collect()
}

/// Computes rows in parallel and hands them over in order, a block at a time.
///
/// # Errors
/// Those of `keep`; [`satphot::Error::Interrupted`] when it is stopped.
fn blocks<T: Send>(
    n: usize,
    stopped: Stopped,
    one: impl Fn(usize) -> Answer<T> + Sync,
    mut keep: impl FnMut(Answer<T>) -> Answer<()>,
) -> Answer<()> {
    for first in (0..n).step_by(BLOCK) {
        let rows = first..n.min(first + BLOCK);
        let row = |i: usize| if stopped() { None } else { Some(one(i)) };
        let Some(block) = rows.into_par_iter().map(row).collect::<Option<Vec<_>>>() else { return Err(interrupted()) };
        block.into_iter().try_for_each(&mut keep)?;
    }
    Ok(())
}

/// The refusal of more rows than memory holds.
fn too_many(rows: usize) -> satphot::Error {
    let problem = format!("{rows} rows are more than {MOST_ROWS}, or than the memory holds; split the moments");
    satphot::Error::Argument { name: "times".into(), problem }
}

/// Rows that cannot be computed: the first is an error, or all are listed.
struct Problems {
    raise: bool,
    texts: Vec<String>,
}

impl Problems {
    fn new(raise: bool) -> Self {
        Self { raise, texts: Vec::new() }
    }

    fn keep<T>(&mut self, answer: Answer<T>) -> Answer<Option<T>> {
        match answer {
            Ok(row) => {
                if !self.raise {
                    self.texts.push(String::new());
                }
                Ok(Some(row))
            }
            Err(error) if self.raise => Err(error),
            Err(error) => {
                self.texts.push(error.to_string());
                Ok(None)
            }
        }
    }

    fn into_columns(self, columns: &mut Columns) {
        if !self.raise {
            columns.own("problem", "", "why the row has no numbers; empty where it has", Data::Text(self.texts));
        }
    }
}

/// What is to be known of the elements of each satellite at a moment.
fn warnings(satellites: &[Tracked], moment: &Epoch) -> Vec<String> {
    let one = |s: &Tracked| Some(format!("{} {}: {}", s.norad_cat_id, s.name, s.tracker.age_warning(moment)?));
    satellites.iter().filter_map(one).collect()
}

/// The names of the satellites that come with satphot.
#[pyfunction]
pub fn satellite_names() -> Vec<&'static str> {
    catalogue_names()
}
