//! The columns of a matched table and what becomes of them: instrumental magnitudes, catalogue magnitudes, colour, airmass.
//!
//! A flux becomes −2.5 log₁₀(flux); per second where the exposure is known, of electrons where e⁻/ADU is.

use crate::bands::Band;
use crate::bands::column_band;
use crate::base::constants::MAG_PER_LN;
use crate::base::error::{Error, Result};
use crate::base::time::{mjd_utc, parse_utc};
use crate::orbit::airmass::{Atmosphere, airmass};
use crate::tables::StarRow;
use crate::tables::guess::factor_of;
use crate::tables::read::{Column, Row, Table};
use crate::tables::unit::Measure;

use super::names::{Cell, Finder};

/// The unit a zeropoint of the night has.
pub const PER_SECOND_UNIT: &str = "-2.5 log10(electrons per second)";
/// MJD = JD − 2400000.5.
const MJD_OF_JD: f64 = 2_400_000.5;

/// The source of the instrumental magnitude.
#[derive(Debug, Clone, Copy)]
enum Inst {
    Mag(Cell),
    /// A flux; whether it is of electrons, and whether it is per second already.
    Flux {
        cell: Cell,
        electrons: bool,
        per_second: bool,
    },
}

/// The columns that are taken.
#[derive(Debug)]
pub struct Columns {
    inst: Inst,
    /// Subtracted from it [mag].
    inst_constant_mag: f64,
    inst_err: Option<Cell>,
    /// Whether `inst_err` is of a flux.
    err_of_flux: bool,
    snr: Option<Cell>,
    v: Cell,
    v_err: Option<Cell>,
    colour: Option<Cell>,
    colour_err: Option<Cell>,
    airmass: Option<Cell>,
    altitude: Option<Cell>,
    pointing: Option<usize>,
    exptime: Option<Cell>,
    e_per_adu: Option<Cell>,
    mjd: Option<usize>,
    place: Option<(Cell, Cell)>,
    id: Option<usize>,
    include: Option<usize>,
    /// What the numbers of each column of the table are multiplied by, which their units make.
    factors: Vec<f64>,
    /// The filter of each row.
    pub filter: Option<usize>,
    /// The name of the colour.
    pub colour_name: String,
    /// The source of each, for the reader.
    pub taken: Vec<(String, String)>,
    /// The unit of the instrumental magnitudes.
    pub unit: String,
    /// Notes for the observer.
    pub notes: Vec<String>,
}

impl Columns {
    /// Finds the columns.
    ///
    /// # Errors
    /// [`Error::Config`] for a column the user names that is not there; [`Error::Table`] when there is no instrumental or no
    /// catalogue magnitude, with the columns present and the option that helps.
    pub fn find(find: &Finder, inst_constant_mag: f64) -> Result<Columns> {
        let table = find.table;
        let missing = |what: &str, key: &str| Error::Table {
            path: table.path.clone(),
            line: None,
            problem: format!(
                "no column of {what}; present: {}; name it with argument `column` {key}=NAME",
                table.names()
            ),
        };
        // a column called just `mag` is what is missing of the two
        let plain = table.column("mag").map(Cell::One);
        let (own_mag, own_flux) = (find.own("inst_mag")?, find.own("flux")?);
        let flux = own_flux.or_else(|| find.known("flux").map(Cell::One));
        let mag = own_mag.or_else(|| find.known("inst_mag").map(Cell::One));
        let (mag, flux) = if own_mag.is_none() && own_flux.is_some() { (None, flux) } else { (mag, flux) };
        let mut v = find.find("v_mag")?;
        if v.is_none() && (mag.is_some() || flux.is_some()) {
            v = plain;
        }
        let v = v.ok_or_else(|| {
            missing(&format!("catalogue magnitudes of band {} (argument `band` names another)", find.band), "v_mag")
        })?;
        let mag = mag.or_else(|| plain.filter(|p| flux.is_none() && *p != v));
        let inst = match (mag, flux) {
            (Some(cell), _) => Inst::Mag(cell),
            (None, Some(cell)) => flux_of(table, cell),
            (None, None) => return Err(missing("instrumental magnitudes or fluxes", "inst_mag")),
        };
        let inst_cell = match inst {
            Inst::Mag(cell) | Inst::Flux { cell, .. } => cell,
        };
        if inst_cell == v {
            let problem = format!("`{}` is taken for both magnitudes; name one with argument `column`", v.text(table));
            return Err(Error::Argument { name: "column inst_mag, v_mag".into(), problem });
        }
        let (inst_err, err_of_flux) = Self::inst_errors(find, inst)?;
        let colour = find.colour(v)?;
        let colour_err = match &colour {
            Some((cell, _)) => find.colour_errors(*cell)?,
            None => None,
        };
        let column = |key: &str| -> Result<Option<usize>> {
            match find.find(key)? {
                Some(Cell::One(i)) => Ok(Some(i)),
                None => Ok(None),
                Some(cell) => Err(Error::Argument {
                    name: format!("column {key}={}", cell.text(table)),
                    problem: "a column is needed here".into(),
                }),
            }
        };
        let airmass = find.airmass()?;
        let mut columns = Columns {
            inst,
            inst_constant_mag,
            inst_err,
            err_of_flux,
            snr: find.find("snr")?,
            v,
            v_err: find.errors_of(v, "v_mag_err")?,
            colour: colour.as_ref().map(|c| c.0),
            colour_err,
            airmass,
            altitude: if airmass.is_some() { None } else { find.find("alt_deg")? },
            pointing: column("pointing")?,
            exptime: find.find("exptime_s")?,
            e_per_adu: find.find("e_per_adu")?,
            mjd: column("mjd_mid_d")?,
            place: find.find("ra_deg")?.zip(find.find("dec_deg")?),
            id: column("id")?,
            include: column("include")?,
            factors: vec![1.0; table.columns.len()],
            filter: column("filter")?,
            colour_name: colour.map_or_else(|| "B-V".to_owned(), |c| c.1),
            taken: Vec::new(),
            unit: String::new(),
            notes: Vec::new(),
        };
        columns.convert(table)?;
        columns.describe(find);
        Ok(columns)
    }

    /// Finds what makes satphot's units of those of the table.
    fn convert(&mut self, table: &Table) -> Result<()> {
        let inst = match self.inst {
            Inst::Mag(cell) => Some(cell),
            Inst::Flux { .. } => None,
        };
        let used = [
            ("inst_mag", inst),
            ("inst_mag_err", self.inst_err.filter(|_| !self.err_of_flux)),
            ("v_mag", Some(self.v)),
            ("v_mag_err", self.v_err),
            ("b_v_mag", self.colour),
            ("b_v_err_mag", self.colour_err),
            ("alt_deg", self.altitude),
            ("exptime_s", self.exptime),
        ];
        for (key, cell) in used.into_iter().filter_map(|(key, cell)| Some((key, cell?))) {
            for i in cell.columns() {
                self.factors[i] = factor_of(table, key, i)?;
                if self.factors[i] != 1.0 {
                    let Column { name, unit, .. } = &table.columns[i];
                    self.notes.push(format!("column `{name}` is in {unit} and converted to {key}"));
                }
            }
        }
        // hours, and degrees in parts, are no numbers here: the place only tells stars apart
        for i in self.place.iter().flat_map(|p| [p.0, p.1]).flat_map(Cell::columns) {
            self.factors[i] = Measure::AngleDeg.factor(&table.columns[i].unit).unwrap_or(1.0);
        }
        Ok(())
    }

    /// The errors of the instrumental magnitudes, and whether they are those of a flux.
    fn inst_errors(find: &Finder, inst: Inst) -> Result<(Option<Cell>, bool)> {
        let own = find.own("inst_mag_err")?;
        match inst {
            Inst::Mag(_) if find.own("flux_err")?.is_some() => Err(Error::Argument {
                name: "column flux_err".into(),
                problem: "needs argument `column` flux: the instrumental magnitudes are from a column of magnitudes"
                    .into(),
            }),
            Inst::Mag(cell) => Ok((find.errors_of(cell, "inst_mag_err")?, false)),
            Inst::Flux { .. } if own.is_some() => Ok((own, false)),
            Inst::Flux { cell, .. } => match find.errors_of(cell, "flux_err")? {
                Some(errors) => Ok((Some(errors), true)),
                None => Ok((find.known("inst_mag_err").map(Cell::One), false)),
            },
        }
    }

    /// Says what is taken for what, and in which unit the instrumental magnitudes are.
    fn describe(&mut self, find: &Finder) {
        let table = find.table;
        let mut electrons_per_second;
        let mut inst = match self.inst {
            Inst::Mag(cell) => {
                // satphot's own column
                electrons_per_second = matches!(cell, Cell::One(i) if table.columns[i].name == "inst_mag");
                cell.text(table)
            }
            Inst::Flux { cell, electrons, per_second } => {
                let (e_per_adu, exptime) =
                    (self.e_per_adu.filter(|_| !electrons), self.exptime.filter(|_| !per_second));
                let times = e_per_adu.map(|e| format!(" * {}", e.text(table))).unwrap_or_default();
                let over = exptime.map(|t| format!(" / {}", t.text(table))).unwrap_or_default();
                if !electrons && e_per_adu.is_none() {
                    self.notes.push(
                        "fluxes are not known to be in electrons: argument `column e_per_adu=NAME` or a number".into(),
                    );
                }
                if !per_second && exptime.is_none() {
                    self.notes.push(
                        "no exposure time, fluxes are taken as they are: argument `column exptime_s=NAME` or a number"
                            .into(),
                    );
                }
                electrons_per_second = (electrons || e_per_adu.is_some()) && (per_second || exptime.is_some());
                format!("-2.5 log10({}{times}{over})", cell.text(table))
            }
        };
        if self.inst_constant_mag != 0.0 {
            electrons_per_second = false;
            inst = format!("{inst} - {}", self.inst_constant_mag);
        }
        self.unit = if electrons_per_second {
            PER_SECOND_UNIT.to_owned()
        } else {
            format!("{inst} of {}", table.path.file_name().unwrap_or_default().to_string_lossy())
        };
        let of = |cell: Option<Cell>| cell.map(|c| c.text(table));
        let said = [
            ("inst".to_owned(), Some(inst)),
            ("its error".to_owned(), of(self.inst_err)),
            ("S/N".to_owned(), of(self.snr.filter(|_| self.inst_err.is_none()))),
            (find.band.to_owned(), of(Some(self.v))),
            ("its error".to_owned(), of(self.v_err)),
            (self.colour_name.clone(), of(self.colour)),
            ("its error".to_owned(), of(self.colour_err)),
            ("airmass".to_owned(), of(self.airmass)),
            ("altitude".to_owned(), of(self.altitude)),
            ("pointing".to_owned(), of(self.pointing.map(Cell::One))),
            ("include".to_owned(), of(self.include.map(Cell::One))),
            ("filter".to_owned(), of(self.filter.map(Cell::One))),
        ];
        self.taken = said.into_iter().filter_map(|(what, from)| Some((what, from?))).collect();
        if !find.bears_band(self.v) {
            let name = self.v.text(table);
            self.notes
                .push(format!("`{name}` is taken as a magnitude of band {}; argument `band` names another", find.band));
        }
    }

    /// Whether there is an airmass, or an altitude to make it from.
    pub fn has_airmass(&self) -> bool {
        self.airmass.is_some() || self.altitude.is_some()
    }

    /// The column of the catalogue magnitudes and its band, if its name states it.
    pub fn catalogue_band(&self, table: &Table) -> Option<(String, Band)> {
        let Cell::One(i) = self.v else { return None };
        let name = table.columns[i].name.clone();
        column_band(&name).map(|band| (name, band))
    }

    /// Whether instrumental magnitudes are made from fluxes.
    pub fn of_flux(&self) -> bool {
        matches!(self.inst, Inst::Flux { .. })
    }

    /// Whether the stars have names.
    pub fn has_names(&self) -> bool {
        self.id.is_some()
    }

    /// The columns that must hold numbers.
    pub fn numbers(&self) -> Vec<usize> {
        let inst = match self.inst {
            Inst::Mag(cell) | Inst::Flux { cell, .. } => cell,
        };
        let others = [self.inst_err, self.snr, self.v_err, self.colour, self.colour_err, self.airmass, self.altitude];
        let cells = [Some(inst), Some(self.v), self.exptime, self.e_per_adu].into_iter().chain(others).flatten();
        cells.flat_map(Cell::columns).collect()
    }

    /// Whether there is a colour.
    pub fn has_colour(&self) -> bool {
        self.colour.is_some()
    }

    /// One row as a star measurement, and the text that names its pointing.
    ///
    /// # Errors
    /// Why the row cannot enter the fit, without numbers, so that it can be counted.
    pub fn star(
        &self,
        row: &Row,
        table: &Table,
        atmosphere: &Atmosphere,
    ) -> (StarRow, std::result::Result<(), &'static str>) {
        let value = |cell: Option<Cell>| cell.and_then(|c| c.number(row, &self.factors));
        let error = |cell: Option<Cell>| value(cell).filter(|e| *e > 0.0 && *e < 9.99);
        let mag = |cell: Cell| cell.number(row, &self.factors).filter(|m| m.abs() < 90.0);
        let id = self.id.map(|i| row.get(i)).filter(|t| !t.is_empty());
        let mut star = StarRow {
            n_members: Some(1),
            star_id: id.map_or_else(|| table.place(row), str::to_owned),
            object_name: self.pointing.map(|i| row.get(i).to_owned()).unwrap_or_default(),
            mjd_mid_d: self.mjd.and_then(|i| mjd(row.get(i))),
            exptime_s: value(self.exptime).filter(|t| *t > 0.0),
            e_per_adu: value(self.e_per_adu).filter(|e| *e > 0.0),
            catalogue_v_mag: mag(self.v).filter(|m| *m != 0.0 && *m > -50.0),
            catalogue_v_mag_err: error(self.v_err),
            catalogue_b_v_mag: value(self.colour).filter(|c| c.abs() < 9.99),
            catalogue_b_v_mag_err: error(self.colour_err),
            snr: value(self.snr).filter(|s| *s > 0.0),
            ra_deg: value(self.place.map(|p| p.0)).filter(|ra| (-360.0..=360.0).contains(ra)),
            dec_deg: value(self.place.map(|p| p.1)).filter(|dec| (-90.0..=90.0).contains(dec)),
            ..StarRow::default()
        };
        star.alt_deg = value(self.altitude).filter(|a| (0.0..=90.0).contains(a));
        star.airmass =
            value(self.airmass).filter(|x| *x < 100.0).or_else(|| airmass(star.alt_deg?.to_radians(), atmosphere));
        let inst_err = value(self.inst_err).filter(|e| *e > 0.0);
        let mut problem = Ok(());
        match self.inst {
            Inst::Mag(cell) => {
                star.inst_mag = mag(cell);
                star.inst_mag_err = inst_err.filter(|e| *e < 9.99);
                if star.inst_mag.is_none() {
                    problem = Err("no instrumental magnitude");
                }
            }
            Inst::Flux { cell, electrons, per_second } => {
                let flux = cell.number(row, &self.factors);
                let e_per_adu = if electrons || self.e_per_adu.is_none() { Some(1.0) } else { star.e_per_adu };
                let time_s = if per_second || self.exptime.is_none() { Some(1.0) } else { star.exptime_s };
                match (flux.filter(|f| *f > 0.0), e_per_adu, time_s) {
                    (Some(flux), Some(e_per_adu), Some(time_s)) => {
                        star.inst_mag = Some(-2.5 * (flux * e_per_adu / time_s).log10());
                        // σ_m = 2.5 / ln 10 · σ_F / F
                        let factor = if self.err_of_flux { MAG_PER_LN / flux } else { 1.0 };
                        star.inst_mag_err = inst_err.map(|e| factor * e);
                    }
                    (Some(_), None, _) => problem = Err("no e-/ADU"),
                    (Some(_), _, None) => problem = Err("no exposure time"),
                    (None, ..) if flux.is_none() => problem = Err("no flux"),
                    (None, ..) => problem = Err("flux not positive"),
                }
            }
        }
        star.inst_mag = star.inst_mag.map(|m| m - self.inst_constant_mag);
        star.inst_mag_err = star.inst_mag_err.or_else(|| star.snr.map(|snr| MAG_PER_LN / snr));
        star.snr = star.snr.or_else(|| star.inst_mag_err.map(|e| MAG_PER_LN / e));
        let excluded = |i: usize| matches!(row.get(i).to_ascii_lowercase().as_str(), "f" | "false" | "0" | "no" | "n");
        if self.include.is_some_and(excluded) {
            problem = Err("not to be included");
        }
        (star, problem)
    }
}

/// Whether a flux is of electrons, and whether it is per second already, by its name and unit.
fn flux_of(table: &Table, cell: Cell) -> Inst {
    let (name, unit) = match cell {
        Cell::One(i) => (table.columns[i].name.to_ascii_lowercase(), table.columns[i].unit.to_ascii_lowercase()),
        _ => (String::new(), String::new()),
    };
    let per_second = name.ends_with("_e_s") || unit.contains("/s") || unit.contains("s-1") || unit.contains("s**-1");
    let electrons =
        name.ends_with("_e") || name.ends_with("_e_s") || unit.starts_with("electron") || unit.starts_with("e-");
    Inst::Flux { cell, electrons, per_second }
}

/// MJD of a cell that holds an MJD, a JD or a date.
fn mjd(cell: &str) -> Option<f64> {
    match crate::tables::read::number(cell) {
        Some(jd) if jd > 1e6 => Some(jd - MJD_OF_JD),
        Some(mjd) => Some(mjd),
        None if cell.is_empty() => None,
        None => parse_utc("mjd_mid_d", cell).ok().map(mjd_utc),
    }
}
