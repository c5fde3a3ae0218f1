//! Reads a table of measured reflectances: phi_i, theta_i, phi_o, theta_o \[deg\], BRDF \[1/sr\].
//!
//! phi is the angle from the normal, theta the azimuth, as lumos-sat reads them. Whitespace or commas, one line of
//! column names, `#` begins a comment. A line that cannot be read stops with its number: nothing is skipped silently.

use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};
use crate::base::vector::{Enu, Vector};
use crate::brightness::brdf::law::Brdf;
use crate::brightness::brdf::tangential;

/// Largest f a table may hold \[1/sr\]: nothing scatters into less than a square microradian.
const BRDF_MAX_PER_SR: f64 = 1e12;

/// One measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Line in the file, from 1.
    pub line: usize,
    /// Angle of incidence from the normal \[deg\].
    pub phi_i_deg: f64,
    /// Azimuth of the incident light \[deg\].
    pub theta_i_deg: f64,
    /// Angle of the outgoing light from the normal \[deg\].
    pub phi_o_deg: f64,
    /// Azimuth of the outgoing light \[deg\].
    pub theta_o_deg: f64,
    /// Measured f \[1/sr\].
    pub brdf_per_sr: f64,
}

/// A table of measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredTable {
    /// Its file.
    pub path: PathBuf,
    /// Its rows, in their order.
    pub rows: Vec<Measurement>,
    /// Rows with more than five columns, of which the rest was ignored.
    pub wide_rows: usize,
}

impl MeasuredTable {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Table`] naming the line for fewer than five columns, for what is not a number or not
    /// finite, for an angle beyond ±360 deg, and for a file without rows.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
        let text = String::from_utf8(bytes).map_err(|_| Error::Table {
            path: path.into(),
            line: None,
            problem: "is not text; expected columns phi_i, theta_i, phi_o, theta_o, BRDF".into(),
        })?;
        Self::parse(path, &text)
    }

    /// Reads text; `path` is for messages.
    ///
    /// # Errors
    /// As [`MeasuredTable::read`], but for I/O.
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        let mut table = Self { path: path.into(), rows: Vec::new(), wide_rows: 0 };
        let mut first = true;
        for (at, whole) in text.trim_start_matches('\u{feff}').lines().enumerate() {
            let line = at + 1;
            let content = whole.split('#').next().unwrap_or_default().trim();
            if content.is_empty() {
                continue;
            }
            let cells = cells(content);
            let names = first && cells.first().is_some_and(|cell| cell.parse::<f64>().is_err());
            first = false;
            if names {
                continue;
            }
            table.push(line, &cells)?;
        }
        if table.rows.is_empty() {
            return Err(table.error(None, "holds no row; expected phi_i, theta_i, phi_o, theta_o, BRDF".into()));
        }
        Ok(table)
    }

    fn push(&mut self, line: usize, cells: &[&str]) -> Result<()> {
        const NAMES: [&str; 5] = ["phi_i", "theta_i", "phi_o", "theta_o", "BRDF"];
        if cells.len() < NAMES.len() {
            let problem = format!("{} columns; expected five: {}", cells.len(), NAMES.join(", "));
            return Err(self.error(Some(line), problem));
        }
        self.wide_rows += usize::from(cells.len() > NAMES.len());
        let mut values = [0.0; 5];
        for ((value, cell), name) in values.iter_mut().zip(cells).zip(NAMES) {
            *value = match cell.parse::<f64>() {
                Ok(v) if v.is_finite() => v,
                _ => return Err(self.error(Some(line), format!("{name} = \"{cell}\" is not a finite number"))),
            };
            if name != "BRDF" && value.abs() > 360.0 {
                return Err(self.error(Some(line), format!("{name} = {value}; accepted is -360 to 360 deg")));
            }
        }
        let [phi_i_deg, theta_i_deg, phi_o_deg, theta_o_deg, brdf_per_sr] = values;
        if brdf_per_sr.abs() > BRDF_MAX_PER_SR {
            let problem = format!("BRDF = {brdf_per_sr}; accepted is up to {BRDF_MAX_PER_SR:e} 1/sr");
            return Err(self.error(Some(line), problem));
        }
        self.rows.push(Measurement { line, phi_i_deg, theta_i_deg, phi_o_deg, theta_o_deg, brdf_per_sr });
        Ok(())
    }

    fn error(&self, line: Option<usize>, problem: String) -> Error {
        Error::Table { path: self.path.clone(), line, problem }
    }
}

/// Columns: separated by commas if there is one, else by blanks and tabs.
fn cells(line: &str) -> Vec<&str> {
    if line.contains(',') { line.split(',').map(str::trim).collect() } else { line.split_whitespace().collect() }
}

/// A measurement as the laws see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Geometry {
    /// 1 − r·o.
    pub off_mirror: f64,
    /// D.
    pub d: f64,
    /// V.
    pub v: f64,
}

impl Measurement {
    /// `None` where light or observer is not above the surface.
    pub(super) fn geometry(&self) -> Option<Geometry> {
        let up = Vector::<Enu>::new(0.0, 0.0, 1.0);
        let unit = |phi_deg: f64, theta_deg: f64| {
            let ((sin_phi, cos_phi), (sin, cos)) = (phi_deg.to_radians().sin_cos(), theta_deg.to_radians().sin_cos());
            Vector::new(sin_phi * cos, sin_phi * sin, cos_phi)
        };
        let (i, o) = (unit(self.phi_i_deg, self.theta_i_deg), unit(self.phi_o_deg, self.theta_o_deg));
        let (cos_i, cos_o) = (up.dot(&i), up.dot(&o));
        // 1e-12: at 90 deg the cosine is not 0 but 6e-17
        if !(cos_i > 1e-12 && cos_o > 1e-12) {
            return None;
        }
        let apart = up * (2.0 * cos_i) - i - o;
        Some(Geometry {
            off_mirror: 0.5 * apart.dot(&apart),
            d: tangential(&i, &up, cos_i, &o, cos_o).norm(),
            v: cos_i * cos_o - i.dot(&o),
        })
    }

    /// Angle between the outgoing light and the mirror direction \[deg\]; `None` below the surface.
    #[must_use]
    pub fn off_mirror_deg(&self) -> Option<f64> {
        self.geometry().map(|g| 2.0 * (0.5 * g.off_mirror).sqrt().min(1.0).asin().to_degrees())
    }

    /// f of a law at this geometry \[1/sr\]; `None` below the surface.
    #[must_use]
    pub fn of(&self, brdf: &Brdf) -> Option<f64> {
        self.geometry().map(|g| g.value(brdf))
    }
}

impl Geometry {
    /// f of a law \[1/sr\].
    pub(super) fn value(&self, brdf: &Brdf) -> f64 {
        match brdf {
            Brdf::Lambert { .. } | Brdf::Phong { .. } | Brdf::Gaussian { .. } => brdf.off_mirror(self.off_mirror),
            Brdf::Abg { a, b, g } => a / (b + self.d.powf(*g)),
            Brdf::Binomial(law) => law.value(self.d, self.v),
            Brdf::Mirror { .. } => 0.0,
        }
    }
}
