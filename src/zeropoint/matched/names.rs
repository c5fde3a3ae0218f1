//! Which column of a matched table is what: by `--column`, else by the names that SExtractor, photutils, STDPipe, VizieR and
//! satphot give theirs.

use std::collections::BTreeMap;

use crate::base::error::{Error, Result};
use crate::tables::guess::{ColumnGuesser, Given, Quantity, given, keys, unknown_key};
use crate::tables::read::{Row, Table};

/// What is looked for, by the keys of `--column`.
const KNOWN: [Quantity; 22] = [
    Quantity::named(
        "inst_mag",
        "inst_mag mag_inst m_inst minst instmag instrumental_mag mag_instrumental MAG_AUTO MAG_APER MAG_BEST MAG_PSF \
         MAG_ISO MAG_MODEL aperture_mag aper_mag mag_aper instrumental_magnitude {}_inst {}inst inst_{} inst_mag_{} {l}",
    ),
    Quantity::named("inst_mag_err", "inst_mag_err inst_err_mag mag_inst_err magerr mag_err mag_error e_mag merr"),
    Quantity::named(
        "flux",
        "flux_e flux_e_s flux net_flux flux_adu FLUX_AUTO FLUX_APER FLUX_BEST FLUX_PSF FLUX_ISO aperture_sum_bkgsub \
         aper_sum_bkgsub aperture_sum flux_fit aperture_net_flux aperture_net_cnts net_counts counts source_sum instFlux",
    ),
    Quantity::named("flux_err", "flux_err_e flux_err fluxerr flux_error flux_unc aperture_sum_err noise_electrons"),
    Quantity::named("snr", "snr s_n SNR_WIN"),
    Quantity::named(
        "v_mag",
        "{}_mag catalogue_{}_mag cat_{}_mag {}mag {}'mag Johnson_{} Cousins_{} Sloan_{} mag_{} {}_cat {}cat cat_{} {}_std \
         {}std {}_psf {}MeanPSFMag phot_{l}_mean_mag cat_mag mag_cat catalog_mag catalogue_mag catmag mcat m_cat ref_mag mag_ref refmag \
         std_mag mag_std standard_mag lit_mag mag_lit mag_true true_mag {}",
    ),
    Quantity::named(
        "v_mag_err",
        "{}_mag_err catalogue_{}_mag_err {}_err_mag e_{}mag {}err e_{} cat_magerr cat_mag_err",
    ),
    Quantity::named("b_v_mag", "b_v_mag catalogue_b_v_mag cat_b_v_mag B-V B_V BV (B-V)"),
    Quantity::named("b_v_err_mag", "b_v_err_mag b_v_mag_err catalogue_b_v_mag_err e_B-V e_B_V BVerr"),
    Quantity::named("b_mag", "b_mag catalogue_b_mag cat_b_mag Bmag Johnson_B B"),
    Quantity::named("b_mag_err", ""),
    Quantity::named("airmass", "airmass air_mass amass secz sec_z"),
    Quantity::named("alt_deg", "alt_deg altitude alt elevation objctalt centalt"),
    Quantity::named(
        "pointing",
        "pointing pointing_id field_id frame image filename file frame_id image_id visit night",
    ),
    Quantity::named("exptime_s", "exptime_s exptime exposure_time exposure_s exposure texp t_exp"),
    Quantity::named("e_per_adu", "e_per_adu egain"),
    Quantity::named("mjd_mid_d", "mjd_mid_d mjd mjd_mid mjd_obs MJD-OBS jd jd_utc date_mid date-obs"),
    Quantity::named("id", "star_id id name star number source_id object_id recno label"),
    Quantity::named(
        "ra_deg",
        "ra_deg ra catalogue_ra_deg RAJ2000 RA_ICRS ra_j2000 ALPHA_J2000 ALPHAWIN_J2000 _RAJ2000 RADEG",
    ),
    Quantity::named(
        "dec_deg",
        "dec_deg dec catalogue_dec_deg DEJ2000 DE_ICRS dec_j2000 DELTA_J2000 DELTAWIN_J2000 _DEJ2000 DECDEG DEDEG",
    ),
    Quantity::named("include", "include incl in_fit"),
    Quantity::named("filter", "filter passband band filt"),
];
/// Colours that are not B−V, taken where there is none.
const OTHER_COLOURS: &str =
    "color colour cat_color cat_colour color_cat colour_cat color_index g-r g_r bp_rp BP-RP V-R V-I r-i";

/// Where a number is from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell {
    /// A column.
    One(usize),
    /// The difference of two columns.
    Difference(usize, usize),
    /// The errors of two columns in quadrature.
    Quadrature(usize, usize),
    /// The same for all rows, given by the user.
    Constant(f64),
}

impl Cell {
    /// The number in a row, each column times its factor, which its unit makes.
    pub fn number(self, row: &Row, factors: &[f64]) -> Option<f64> {
        let number = |i: usize| Some(row.number(i)? * factors.get(i).copied().unwrap_or(1.0));
        match self {
            Cell::One(i) => number(i),
            Cell::Difference(i, j) => Some(number(i)? - number(j)?),
            Cell::Quadrature(i, j) => Some(number(i)?.hypot(number(j)?)),
            Cell::Constant(v) => Some(v),
        }
    }

    /// The columns it is from.
    pub fn columns(self) -> Vec<usize> {
        match self {
            Cell::One(i) => vec![i],
            Cell::Difference(i, j) | Cell::Quadrature(i, j) => vec![i, j],
            Cell::Constant(_) => Vec::new(),
        }
    }

    /// In words.
    pub fn text(self, table: &Table) -> String {
        match self {
            Cell::One(i) => table.columns[i].name.clone(),
            Cell::Difference(i, j) => format!("{} - {}", table.columns[i].name, table.columns[j].name),
            Cell::Quadrature(i, j) => format!("{} and {}", table.columns[i].name, table.columns[j].name),
            Cell::Constant(v) => v.to_string(),
        }
    }
}

/// Refuses unknown keys of `--column`.
pub fn check_keys(columns: &BTreeMap<String, String>) -> Result<()> {
    match unknown_key(&KNOWN, columns) {
        None => Ok(()),
        Some(key) => Err(Error::Argument {
            name: format!("column {key}"),
            problem: format!("is not a quantity that satphot reads from a matched table; known: {}", keys(&KNOWN)),
        }),
    }
}

/// Looks for the columns of one table.
pub struct Finder<'a> {
    /// The table.
    pub table: &'a Table,
    /// `--column`: key and name.
    pub columns: &'a BTreeMap<String, String>,
    /// The band of the magnitudes.
    pub band: &'a str,
}

impl Finder<'_> {
    /// What the user names for `key`: a column, a number for all rows, or a difference of two columns.
    ///
    /// # Errors
    /// [`Error::Argument`] if it is none of these, with the columns present.
    pub fn own(&self, key: &str) -> Result<Option<Cell>> {
        let difference = || {
            let (a, b) = self.columns.get(key)?.split_once('-')?;
            Some(Cell::Difference(self.table.column(a.trim())?, self.table.column(b.trim())?))
        };
        match given(self.table, self.columns, key) {
            Ok(Some(Given::Column(i))) => Ok(Some(Cell::One(i))),
            Ok(Some(Given::Constant(v))) => Ok(Some(Cell::Constant(v))),
            Ok(None) => Ok(None),
            Err(error) => difference().map(Some).ok_or(error),
        }
    }

    fn guess(&self) -> ColumnGuesser<'_> {
        ColumnGuesser { table: self.table, quantities: &KNOWN, band: self.band }
    }

    /// The column of `key` by the names known for it.
    pub fn known(&self, key: &str) -> Option<usize> {
        self.guess().column_of(key)
    }

    /// The airmass; a column X is taken for it only if there is no column Y.
    ///
    /// # Errors
    /// As [`Finder::own`].
    pub fn airmass(&self) -> Result<Option<Cell>> {
        let x = || self.table.column("X").filter(|_| self.table.column("Y").is_none()).map(Cell::One);
        Ok(self.find("airmass")?.or_else(x))
    }

    /// As the user names it, else by known names.
    ///
    /// # Errors
    /// As [`Finder::own`].
    pub fn find(&self, key: &str) -> Result<Option<Cell>> {
        Ok(self.own(key)?.or_else(|| self.known(key).map(Cell::One)))
    }

    /// The errors of column `cell`: as the user names them, else by the name of the column (`MAGERR_AUTO` of `MAG_AUTO`,
    /// `e_Vmag` of `Vmag`, `flux_err` of `flux`), else by known names.
    ///
    /// # Errors
    /// As [`Finder::own`].
    pub fn errors_of(&self, cell: Cell, err_key: &str) -> Result<Option<Cell>> {
        if let Some(own) = self.own(err_key)? {
            return Ok(Some(own));
        }
        let Cell::One(i) = cell else { return Ok(None) };
        let known = || self.known(err_key).filter(|j| *j != i);
        Ok(self.guess().errors_of(i).or_else(known).map(Cell::One))
    }

    /// The errors of a colour: as the user names them, of a difference those of both magnitudes, else by name.
    ///
    /// # Errors
    /// As [`Finder::own`].
    pub fn colour_errors(&self, colour: Cell) -> Result<Option<Cell>> {
        match (self.own("b_v_err_mag")?, colour) {
            (Some(own), _) => Ok(Some(own)),
            (None, Cell::Difference(b, v)) => {
                let b_err = match self.own("b_mag_err")? {
                    Some(Cell::One(i)) => Some(i),
                    _ => self.guess().errors_of(b),
                };
                Ok(b_err.zip(self.guess().errors_of(v)).map(|(b, v)| Cell::Quadrature(b, v)))
            }
            (None, _) => self.errors_of(colour, "b_v_err_mag"),
        }
    }

    /// The colour and how it is called: B−V, the difference of B and V, else another colour.
    ///
    /// # Errors
    /// As [`Finder::own`].
    pub fn colour(&self, v_mag: Cell) -> Result<Option<(Cell, String)>> {
        let b_v = || "B-V".to_owned();
        if let Some(own) = self.own("b_v_mag")? {
            let name = self.columns.get("b_v_mag").cloned().unwrap_or_default();
            let is_b_v = self.known("b_v_mag").map(Cell::One) == Some(own);
            return Ok(Some((own, if is_b_v { b_v() } else { name })));
        }
        let v = match (self.band, v_mag) {
            ("V", Cell::One(i)) => Some(i),
            _ => Finder { band: "V", ..*self }.v_alone(),
        };
        match (self.own("b_mag")?, v) {
            (Some(Cell::One(b)), Some(v)) => return Ok(Some((Cell::Difference(b, v), b_v()))),
            (Some(_), _) => {
                let problem = "a colour of B and V needs columns of both magnitudes".to_owned();
                return Err(Error::Argument { name: "column b_mag".into(), problem });
            }
            (None, _) => {}
        }
        if let Some(i) = self.known("b_v_mag") {
            return Ok(Some((Cell::One(i), b_v())));
        }
        if let (Some(b), Some(v)) = (self.known("b_mag"), v) {
            return Ok(Some((Cell::Difference(b, v), b_v())));
        }
        let other = self.guess().first_of(OTHER_COLOURS.split_whitespace());
        Ok(other.map(|i| (Cell::One(i), self.table.columns[i].name.clone())))
    }

    /// A column of the band's magnitudes that bears the band in its name.
    fn v_alone(&self) -> Option<usize> {
        let guess = self.guess();
        guess.first_of(guess.names("v_mag").filter(|name| name.contains("{}")))
    }

    /// Whether the catalogue magnitudes are in a column that bears the band in its name.
    pub fn bears_band(&self, cell: Cell) -> bool {
        matches!(cell, Cell::One(i) if self.v_alone() == Some(i))
    }
}
