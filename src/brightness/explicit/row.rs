//! A row of a file of explicit geometries: named cells in, a [`Case`] out, or the reason why not.
//!
//! Lengths in m, elevations and discs in degrees, as in the file. Columns in any order; columns that are not needed are
//! ignored. A cell that cannot be used is named with its column, its value and what is accepted.

pub(crate) use super::case::STARLINK;
use csv::StringRecord;

use super::case::Case;
use super::case::RADIUS_KM;
use super::case::Scattering;
use crate::base::vector::{Itrs, Vector};
use crate::brightness::brdf::Brdf;

/// The columns a file must have.
pub const COLUMNS: [&str; 18] = [
    "id",
    "height_m",
    "src_elev_deg",
    "obs_x_m",
    "obs_y_m",
    "obs_z_m",
    "nx",
    "ny",
    "nz",
    "area_m2",
    "brdf",
    "p1",
    "p2",
    "p3",
    "earth_brdf",
    "ep1",
    "ep2",
    "ep3",
];

/// The scattering laws of the column `brdf`, with their parameters, for messages.
const LAWS: &str = "lambertian (albedo), phong (kd, ks, n), gaussian (A, sigma), abg (A, B, g), \
                    binomial_starlink_v15_chassis, binomial_starlink_v15_solar, mirror (rho, alpha in deg)";
/// The laws of the column `earth_brdf`.
const EARTH_LAWS: &str = "lambertian (albedo), phong (kd, ks, n)";
/// A normal this far from unit length is said to be so.
const UNIT_TOLERANCE: f64 = 1e-9;
/// An observer this far from the sphere \[km\] is said to be so.
const SPHERE_TOLERANCE_KM: f64 = 0.1;

/// Where each of [`COLUMNS`] is in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    at: [usize; COLUMNS.len()],
    width: usize,
}

impl Header {
    /// From the first line of the file.
    ///
    /// # Errors
    /// A sentence that names the columns that are missing or there twice.
    pub fn new(names: &StringRecord) -> Result<Self, String> {
        let places = |wanted: &str| -> Vec<usize> {
            names.iter().enumerate().filter(|(_, n)| n.trim() == wanted).map(|(i, _)| i).collect()
        };
        let listed = |of: &dyn Fn(usize) -> bool| {
            COLUMNS.iter().filter(|c| of(places(c).len())).copied().collect::<Vec<_>>().join(", ")
        };
        let (missing, twice) = (listed(&|n| n == 0), listed(&|n| n > 1));
        if !missing.is_empty() {
            return Err(format!("missing column: {missing}. The columns are {}, in any order", COLUMNS.join(", ")));
        }
        if !twice.is_empty() {
            return Err(format!("column given twice: {twice}"));
        }
        Ok(Self { at: COLUMNS.map(|c| places(c).first().copied().unwrap_or(0)), width: names.len() })
    }

    /// The identifier of a row.
    #[must_use]
    pub fn id<'a>(&self, record: &'a StringRecord) -> &'a str {
        self.cell(record, "id")
    }

    /// The trimmed text of a cell; empty where the row ends early.
    fn cell<'a>(&self, record: &'a StringRecord, column: &str) -> &'a str {
        let at = COLUMNS.iter().position(|c| *c == column).map(|i| self.at[i]);
        at.and_then(|i| record.get(i)).unwrap_or("").trim()
    }

    /// A finite number that `accepted` takes.
    fn number(
        &self,
        record: &StringRecord,
        column: &str,
        meaning: &str,
        accepted: impl Fn(f64) -> bool,
    ) -> Result<f64, String> {
        let text = self.cell(record, column);
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() && accepted(value) => Ok(value),
            _ if text.is_empty() => Err(format!("{column} is empty; accepted is {meaning}")),
            _ => Err(format!("{column} = {text}; accepted is {meaning}")),
        }
    }
}

/// A case, and what is odd about it without being wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What to compute.
    pub case: Case,
    /// `energy` for a surface that returns more light than it receives; a normal that was not of unit length; …
    pub warnings: Vec<String>,
}

/// A row of the file as a case.
///
/// # Errors
/// A sentence that names column, value and what is accepted.
pub fn read_row(header: &Header, record: &StringRecord) -> Result<Row, String> {
    if record.len() > header.width {
        return Err(format!("the row has {} cells, the header {}", record.len(), header.width));
    }
    let any = |_: f64| true;
    let above_zero = |v: f64| v > 0.0;
    let number =
        |column: &str, meaning: &str, accepted: &dyn Fn(f64) -> bool| header.number(record, column, meaning, accepted);
    let vector = |columns: [&str; 3], meaning: &str| -> Result<Vector<Itrs>, String> {
        let [x, y, z] = columns;
        Ok(Vector::new(number(x, meaning, &any)?, number(y, meaning, &any)?, number(z, meaning, &any)?))
    };
    let mut warnings = Vec::new();

    let height_m = number("height_m", "a height above 0 [m]", &above_zero)?;
    let elevation_deg = number("src_elev_deg", "an elevation from -90 to 90 [deg]", &|v| v.abs() <= 90.0)?;
    let observer_km = vector(["obs_x_m", "obs_y_m", "obs_z_m"], "a finite number [m]")? * 1e-3;
    let off_km = observer_km.norm() - RADIUS_KM;
    if off_km.abs() > SPHERE_TOLERANCE_KM {
        warnings.push(format!("observer {off_km:.3} km above the sphere of {RADIUS_KM} km"));
    }
    let stated = vector(["nx", "ny", "nz"], "a finite number")?;
    let normal = stated.unit().ok_or_else(|| {
        let [x, y, z] = stated.to_array();
        format!("nx, ny, nz = {x}, {y}, {z}; accepted is a normal of a length above 0")
    })?;
    if (stated.norm() - 1.0).abs() > UNIT_TOLERANCE {
        warnings.push(format!("normal of length {} made unit", stated.norm()));
    }
    let area_m2 = number("area_m2", "an area above 0 [m2]", &above_zero)?;

    let scattering = match header.cell(record, "brdf") {
        "mirror" => Scattering::Mirror {
            reflectance: number("p1", "a reflectance rho from 0", &|v| v >= 0.0)?,
            disc_rad: number("p2", "a half angle alpha above 0, to 90 [deg]", &|v| v > 0.0 && v <= 90.0)?.to_radians(),
        },
        name => Scattering::Law(
            law(name, ["p1", "p2", "p3"], &number)?
                .ok_or_else(|| format!("brdf = {}; accepted is {LAWS}", said(name)))?,
        ),
    };
    let earth = match header.cell(record, "earth_brdf") {
        name @ ("lambertian" | "phong") => law(name, ["ep1", "ep2", "ep3"], &number)?,
        _ => None,
    };
    let earth = earth
        .ok_or_else(|| format!("earth_brdf = {}; accepted is {EARTH_LAWS}", said(header.cell(record, "earth_brdf"))))?;
    let surface_creates = match &scattering {
        // the measured ones are known not to
        Scattering::Law(Brdf::Binomial(_)) => false,
        Scattering::Law(brdf) => brdf.creates_light(),
        Scattering::Mirror { reflectance, .. } => *reflectance > 1.0,
    };
    // first, so that it is the whole cell when nothing else is odd
    if earth.creates_light() {
        warnings.insert(0, "earth energy".into());
    }
    if surface_creates {
        warnings.insert(0, "energy".into());
    }
    let case = Case {
        height_km: height_m * 1e-3,
        elevation_rad: elevation_deg.to_radians(),
        observer_km,
        normal,
        area_m2,
        scattering,
        earth,
    };
    Ok(Row { case, warnings })
}

fn said(text: &str) -> &str {
    if text.is_empty() { "(empty)" } else { text }
}

/// A scattering law by its name in the file, its parameters from three columns; `None` for a name that is not known.
fn law(
    name: &str,
    [p1, p2, p3]: [&str; 3],
    number: &dyn Fn(&str, &str, &dyn Fn(f64) -> bool) -> Result<f64, String>,
) -> Result<Option<Brdf>, String> {
    let not_negative = |v: f64| v >= 0.0;
    let above_zero = |v: f64| v > 0.0;
    Ok(Some(match name {
        "lambertian" => Brdf::Lambert { albedo: number(p1, "an albedo from 0", &not_negative)? },
        "phong" => Brdf::Phong {
            kd: number(p1, "kd from 0", &not_negative)?,
            ks: number(p2, "ks from 0", &not_negative)?,
            n: number(p3, "an exponent n from 0", &not_negative)?,
        },
        "gaussian" => Brdf::Gaussian {
            peak_per_sr: number(p1, "a peak A from 0 [1/sr]", &not_negative)?,
            sigma: number(p2, "a width sigma above 0", &above_zero)?,
        },
        "abg" => Brdf::Abg {
            a: number(p1, "A from 0", &not_negative)?,
            b: number(p2, "B above 0", &above_zero)?,
            g: number(p3, "g from 0", &not_negative)?,
        },
        _ => match STARLINK.iter().find(|(column, _)| *column == name) {
            Some((_, known)) => Brdf::named(known).map_err(|e| e.to_string())?,
            None => return Ok(None),
        },
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLATE: &str = "a,550000,30,0,0,6378000,0,0,-1,2,lambertian,0.5,,,lambertian,0.3,,";

    fn row(line: &str) -> Result<Row, String> {
        let header = Header::new(&StringRecord::from(COLUMNS.to_vec())).unwrap();
        read_row(&header, &StringRecord::from(line.split(',').collect::<Vec<_>>()))
    }

    #[test]
    fn a_row_becomes_the_case_it_states() {
        let Row { case, warnings } = row(PLATE).unwrap();
        assert!(warnings.is_empty());
        assert_eq!((case.height_km, case.area_m2), (550.0, 2.0));
        assert!((case.elevation_rad.sin() - 0.5).abs() < 1e-15);
        assert_eq!(case.scattering, Scattering::Law(Brdf::Lambert { albedo: 0.5 }));
    }

    #[test]
    fn a_bad_cell_is_named_with_its_column_its_value_and_what_is_accepted() {
        for (was, is, words) in [
            ("550000", "-3", ["height_m", "-3", "above 0"]),
            ("550000", "nan", ["height_m", "nan", "above 0"]),
            ("550000", "", ["height_m", "empty", "above 0"]),
            (",30,", ",91,", ["src_elev_deg", "91", "-90 to 90"]),
            ("0,0,-1,2", "0,0,0,2", ["nx, ny, nz", "0, 0, 0", "above 0"]),
            ("-1,2", "-1,-2", ["area_m2", "-2", "above 0"]),
            ("lambertian,0.5", "velvet,0.5", ["brdf", "velvet", "lambertian"]),
            ("lambertian,0.5", "lambertian,", ["p1", "empty", "albedo"]),
            ("lambertian,0.5,", "mirror,0.5,0", ["p2", "0", "above 0"]),
            ("lambertian,0.3", "abg,0.3", ["earth_brdf", "abg", "phong"]),
            ("lambertian,0.3", "phong,0.3", ["ep2", "empty", "ks"]),
        ] {
            let message = row(&PLATE.replacen(was, is, 1)).unwrap_err();
            for word in words {
                assert!(message.contains(word), "{word}: {message}");
            }
        }
    }

    #[test]
    fn a_surface_that_creates_light_is_computed_and_said_to_be_so() {
        for (law, warnings) in [
            ("lambertian,1.2,,", vec!["energy"]),
            ("phong,0.7,0.6,5", vec!["energy"]),
            ("mirror,1.01,0.27,", vec!["energy"]),
            ("mirror,1,0.27,", vec![]),
        ] {
            assert_eq!(row(&PLATE.replace("lambertian,0.5,,", law)).unwrap().warnings, warnings, "{law}");
        }
        assert_eq!(row(&PLATE.replace("lambertian,0.3", "lambertian,1.3")).unwrap().warnings, ["earth energy"]);
    }

    #[test]
    fn the_starlink_chassis_has_its_published_values() {
        let Scattering::Law(brdf) =
            row(&PLATE.replace("lambertian,0.5", "binomial_starlink_v15_chassis,")).unwrap().case.scattering
        else {
            panic!("a law")
        };
        let up = Vector::<Itrs>::new(0.0, 0.0, 1.0);
        let at = |d: f64| brdf.value(&up, &up, &Vector::new(d, 0.0, (1.0 - d * d).sqrt()));
        for (d, f) in [(0.0, 2_187.761_623_949_552), (0.1, 0.992_197_649_448_187_6), (0.5, 0.034_952_094_985_581_876)] {
            assert!((at(d) / f - 1.0).abs() < 1e-9, "{d}: {}", at(d));
        }
    }

    #[test]
    fn missing_columns_are_listed() {
        let message = Header::new(&StringRecord::from(vec!["id", "height_m"])).unwrap_err();
        assert!(message.contains("missing column: src_elev_deg, obs_x_m"), "{message}");
        let mut names = COLUMNS.to_vec();
        names.push("p1");
        assert!(Header::new(&StringRecord::from(names)).unwrap_err().contains("twice: p1"));
    }
}
