//! zeropoint.toml: a fit written for people and read back for another night.
//!
//! States the sign convention and the unit of V_inst. Weights and residuals of single stars stay in stars.ecsv.

use std::fmt::Write as _;
use std::path::Path;

use serde::Deserialize;

use super::Pointing;
use super::solve::{Matrix, N};
use super::zeropoint::Zeropoint;
use super::zeropoint::{equation, predicted};
use crate::bands::{Band, ColourIndex, Light};
use crate::base::error::{Error, Result};

/// How the file of a night without a zeropoint begins.
pub const NO_ZEROPOINT: &str = "# This night has no zeropoint";

/// What a zeropoint.toml may hold; only the three terms and their errors are needed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// Band of the catalogue magnitudes; absent in files of older versions.
    band: Option<Band>,
    /// Filter of the star frames; absent in files of older versions and of matched tables.
    filter: Option<String>,
    /// Index of the colours; absent where it is B−V.
    colour_index: Option<String>,
    convention: Option<String>,
    inst_mag_unit: Option<String>,
    zp_mag: f64,
    zp_err_mag: Option<f64>,
    k_mag_airmass: f64,
    k_err_mag_airmass: Option<f64>,
    c_mag_mag: f64,
    c_err_mag_mag: Option<f64>,
    k2_mag: Option<f64>,
    k2_err_mag: Option<f64>,
    /// Of (ZP, k, C), or of (ZP, k, C, k'').
    covariance: Option<Vec<Vec<f64>>>,
    /// Written for the reader and computed again from the covariance, as are the three below.
    #[serde(rename = "correlation")]
    _correlation: Option<toml::Value>,
    #[serde(rename = "err_as_published_mag")]
    _err_as_published_mag: Option<f64>,
    #[serde(rename = "err_propagated_mag")]
    _err_propagated_mag: Option<f64>,
    #[serde(rename = "predictions")]
    _predictions: Option<toml::Value>,
    covariance_95: Option<Vec<Vec<f64>>>,
    /// Computed again from the two covariances.
    #[serde(rename = "multiplier_95")]
    _multiplier_95: Option<toml::Value>,
    covariance_model: Option<Vec<Vec<f64>>>,
    covariance_star_jackknife: Option<Vec<Vec<f64>>>,
    covariance_pointing_jackknife: Option<Vec<Vec<f64>>>,
    #[serde(default)]
    estimator: String,
    #[serde(default)]
    n_used: usize,
    #[serde(default)]
    n_stars: usize,
    #[serde(default)]
    n_rejected: usize,
    #[serde(default)]
    n_pointings: usize,
    rms_mag: Option<f64>,
    robust_sigma_mag: Option<f64>,
    intrinsic_mag: Option<f64>,
    star_scatter_mag: Option<f64>,
    pointing_scatter_mag: Option<f64>,
    line_of_sight_mag: Option<f64>,
    colour_share: Option<f64>,
    pointing_chi2_dof: Option<f64>,
    pointing_p_value: Option<f64>,
    chi2_dof: Option<f64>,
    p_value: Option<f64>,
    condition: Option<f64>,
    rank: Option<usize>,
    mjd_mean_d: Option<f64>,
    target_b_v_mag: Option<[f64; 2]>,
    airmass_mean: Option<f64>,
    b_v_mean_mag: Option<f64>,
    airmass_range: Option<[f64; 2]>,
    b_v_range_mag: Option<[f64; 2]>,
    #[serde(default)]
    k_note: String,
    #[serde(default)]
    c_note: String,
    #[serde(default)]
    k2_note: String,
    #[serde(default)]
    cov_note: String,
    #[serde(default)]
    warnings: Vec<String>,
    #[serde(default)]
    notes: Vec<String>,
    #[serde(default)]
    pointings: Vec<PointingTable>,
}

/// One pointing of the file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PointingTable {
    number: usize,
    n_used: usize,
    n_rejected: usize,
    airmass_mean: f64,
    offset_mag: f64,
    offset_err_mag: f64,
}

const UNIT: &str = "-2.5 log10(electrons per second)";
/// Airmasses at which the file states the error.
const TOLD_AIRMASS: [f64; 4] = [1.0, 1.4, 2.0, 3.0];

impl Zeropoint {
    /// The fit as TOML; `notes` (night, catalogue, camera) are kept as they are.
    #[must_use]
    pub fn to_toml(&self, notes: &[String]) -> String {
        let errs = self.errs();
        let mut out = String::from(
            "# Zeropoint, extinction and colour term; X is the airmass, V_inst is of electrons, not ADU.\n\
             # All in mag, k in mag per airmass, C in mag per mag, k2 in mag per airmass and mag.\n",
        );
        let mut line = |key: &str, value: String| {
            let _ = writeln!(out, "{key} = {value}");
        };
        line("convention", text(&self.equation()));
        if let Some(band) = self.band {
            let how = self.band_text().filter(|t| t != band.name()).map(|t| format!(" # {t}")).unwrap_or_default();
            line("band", text(band.name()) + &how);
        }
        if let Some(colour) = self.colour.filter(|c| *c != ColourIndex::B_V) {
            line("colour_index", format!("{} # all that is named b_v here is of it", text(&colour.to_string())));
        }
        if let Some(light) = &self.light {
            line("filter", text(&light.filter));
        }
        line("inst_mag_unit", text(UNIT));
        line("zp_mag", number(self.zp_mag));
        line("zp_err_mag", number(errs[0]));
        line("k_mag_airmass", number(self.k_mag_airmass));
        line("k_err_mag_airmass", number(errs[1]));
        line("c_mag_mag", number(self.c_mag_mag));
        line("c_err_mag_mag", number(errs[2]));
        let terms = if self.second_order() {
            line("k2_mag", number(self.k2_mag));
            line("k2_err_mag", number(self.cov[3][3].max(0.0).sqrt()));
            "(ZP, k, C, k2)"
        } else {
            "(ZP, k, C)"
        };
        let n = self.covariance().len();
        line("covariance", format!("{} # of {terms}", rows(&self.cov, n)));
        line("correlation", rows(&correlation(&self.cov), n));
        line("cov_note", text(&self.cov_note));
        let [zp, k, c] = self.multipliers_95().map(|m| number((1e4 * m).round() / 1e4));
        line("multiplier_95", format!("[{zp}, {k}, {c}] # of the errors of ZP, k, C, for 95 % of nights"));
        line("covariance_95", format!("{} # holds the truth in 95 % of nights", rows(&self.cov_95, n)));
        for (key, cov) in [
            ("covariance_star_jackknife", self.cov_star_jackknife),
            ("covariance_pointing_jackknife", self.cov_pointing_jackknife),
            ("covariance_model", Some(self.cov_model)),
        ] {
            if let Some(cov) = cov {
                line(key, rows(&cov, n));
            }
        }
        // the paper adds the three errors in quadrature, without airmass, colour or covariance: shown for comparison
        line(
            "err_as_published_mag",
            format!("{} # quadrature sum, as in the paper", number(self.err_as_published_mag())),
        );
        if self.airmass_mean.is_finite() && self.b_v_mean_mag.is_finite() {
            let err = number(self.err_mag(self.airmass_mean, self.b_v_mean_mag, 0.0));
            line("err_propagated_mag", format!("{err} # at airmass_mean and b_v_mean_mag"));
        }
        line("estimator", text(&self.estimator));
        line("n_used", self.n_used.to_string());
        line("n_stars", format!("{} # different stars among them", self.n_stars));
        line("n_rejected", self.n_rejected.to_string());
        line("n_pointings", self.n_pointings.to_string());
        line("rms_mag", number(self.rms_mag));
        line("robust_sigma_mag", number(self.robust_sigma_mag));
        line("intrinsic_mag", format!("{} # of single stars beyond their errors", number(self.intrinsic_mag)));
        line("star_scatter_mag", format!("{} # of a star, shared by its visits", number(self.star_scatter_mag)));
        line(
            "line_of_sight_mag",
            format!("{} # of one line of sight, in err_one_pointing_mag", number(self.line_of_sight_mag)),
        );
        line(
            "colour_share",
            format!("{} # of the variance of the colours that is not their error", number(self.colour_share)),
        );
        line("pointing_scatter_mag", format!("{} # of the pointings' own offsets", number(self.pointing_scatter_mag)));
        let mut known = |key: &str, value: Option<f64>, comment: &str| {
            if let Some(v) = value {
                line(key, number(v) + comment);
            }
        };
        known("pointing_chi2_dof", self.pointing_chi2_dof, " # cloud test: offsets against the errors of their stars");
        known("pointing_p_value", self.pointing_p_value, "");
        known("chi2_dof", self.chi2_dof, " # with the stated errors alone");
        known("p_value", self.p_value, "");
        known("mjd_mean_d", self.mjd_mean_d, " # of the measurements, UTC");
        line("condition", format!("{} # of the centred matrix, columns of equal length", number(self.condition)));
        line("rank", self.rank.to_string());
        line("airmass_mean", number(self.airmass_mean));
        line("airmass_range", list(&self.airmass_range));
        line("b_v_mean_mag", number(self.b_v_mean_mag));
        line("b_v_range_mag", list(&self.b_v_range_mag));
        line("target_b_v_mag", format!("{} # and its error", list(&self.target_b_v_mag)));
        line("k_note", text(&self.k_note));
        line("c_note", text(&self.c_note));
        line("k2_note", text(&self.k2_note));
        line("warnings", texts(&self.warnings));
        line("notes", texts(notes));
        self.write_predictions(&mut out);
        for p in &self.pointings {
            let _ = write!(
                out,
                "\n[[pointings]]\nnumber = {}\nn_used = {}\nn_rejected = {}\nairmass_mean = {}\noffset_mag = {}\noffset_err_mag = {}\n",
                p.number,
                p.n_used,
                p.n_rejected,
                number(p.airmass_mean),
                number(p.offset_mag),
                number(p.offset_err_mag)
            );
        }
        out
    }

    /// Errors of a magnitude of the target at a few airmasses, each way of adding them by name.
    fn write_predictions(&self, out: &mut String) {
        let [b_v, b_v_err] = self.target_b_v_mag;
        if !b_v.is_finite() {
            return;
        }
        out.push_str(
            "\n# Error of the calibration of the target: quoted (covariance and colour of the target), with the scatter of one\n\
             # pointing added, by the jackknives of stars and of pointings, by the model, and as the paper adds it.\n",
        );
        for airmass in TOLD_AIRMASS {
            let _ = write!(
                out,
                "\n[[predictions]]\nairmass = {}\nb_v_mag = {}\nerr_mag = {}\nerr_95_mag = {}\nerr_one_pointing_mag = {}\n",
                number(airmass),
                number(b_v),
                number(self.err_mag(airmass, b_v, b_v_err)),
                number(self.err_95_mag(airmass, b_v, b_v_err)),
                number(self.err_one_pointing_mag(airmass, b_v, b_v_err))
            );
            let jackknives = [
                ("err_star_jackknife_mag", self.cov_star_jackknife),
                ("err_pointing_jackknife_mag", self.cov_pointing_jackknife),
                ("err_model_mag", Some(self.cov_model)),
            ];
            for (key, cov) in jackknives {
                if let Some(cov) = cov {
                    let _ = writeln!(
                        out,
                        "{key} = {}",
                        number(predicted(&cov, airmass, b_v).hypot(self.colour_slope(airmass) * b_v_err))
                    );
                }
            }
            let _ = writeln!(out, "err_as_published_mag = {}", number(self.err_as_published_mag()));
        }
    }

    /// Reads a zeropoint.toml. Needed are `zp_mag`, `k_mag_airmass`, `c_mag_mag` and either `covariance` or the three errors
    /// (then without correlation, which a warning says). What the file does not say is NaN or empty.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Table`] naming the key, another sign convention or unit, or an invalid covariance.
    pub fn read(path: &Path) -> Result<Zeropoint> {
        Self::parse(path, &std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?)
    }

    /// As [`Zeropoint::read`], of a text; `path` is for messages.
    ///
    /// # Errors
    /// [`Error::Table`] as there.
    #[doc(hidden)]
    pub fn parse(path: &Path, text: &str) -> Result<Zeropoint> {
        let bad = |problem: String| Error::Table { path: path.to_owned(), line: None, problem };
        let file: File = toml::from_str(text).map_err(|e| {
            let line = e.span().map(|s| text[..s.start.min(text.len())].matches('\n').count() + 1);
            Error::Table { path: path.to_owned(), line, problem: e.message().to_owned() }
        })?;
        let colour = match &file.colour_index {
            Some(name) => Some(ColourIndex::named(name).ok_or_else(|| {
                bad(format!("colour_index = \"{name}\" must be the difference of two bands, such as \"g-r\""))
            })?),
            None => None,
        };
        let colour_name = colour.unwrap_or(ColourIndex::B_V).to_string();
        let convention = equation(Band::or_v(file.band).name(), &colour_name, file.k2_mag.is_some());
        for (key, value, want) in
            [("convention", &file.convention, convention.as_str()), ("inst_mag_unit", &file.inst_mag_unit, UNIT)]
        {
            if let Some(v) = value.as_ref().filter(|v| *v != want) {
                return Err(bad(format!("{key} = \"{v}\"; only \"{want}\" is read: convert the numbers")));
            }
        }
        let mut warnings = file.warnings;
        let square = |rows: Vec<Vec<f64>>| {
            padded(&rows).ok_or_else(|| bad(format!("covariance {rows:?} has neither 3 nor 4 rows of as many numbers")))
        };
        let cov = match (file.covariance, file.zp_err_mag, file.k_err_mag_airmass, file.c_err_mag_mag) {
            (Some(cov), ..) => square(cov)?,
            (None, Some(z), Some(k), Some(c)) => {
                warnings.push(format!(
                    "{}: no covariance, so errors of ZP, k and C are taken as independent",
                    path.display()
                ));
                let errs = [z, k, c, file.k2_err_mag.unwrap_or(0.0)];
                std::array::from_fn(|i| std::array::from_fn(|j| if i == j { errs[i] * errs[i] } else { 0.0 }))
            }
            _ => return Err(bad("give covariance, or zp_err_mag, k_err_mag_airmass and c_err_mag_mag".into())),
        };
        let k2_mag = file.k2_mag.unwrap_or(0.0);
        // a file of satphot holds the warning already
        let negative = super::zeropoint::negative_k(file.k_mag_airmass, cov[1][1].max(0.0).sqrt());
        warnings.extend(negative.filter(|_| file.estimator.is_empty()));
        for (key, v) in [
            ("zp_mag", file.zp_mag),
            ("k_mag_airmass", file.k_mag_airmass),
            ("c_mag_mag", file.c_mag_mag),
            ("k2_mag", k2_mag),
        ] {
            if !v.is_finite() {
                return Err(bad(format!("{key} = {v} is not a finite number")));
            }
        }
        check_covariance(&cov).map_err(bad)?;
        warnings.extend(file.notes);
        let nan2 = [f64::NAN; 2];
        Ok(Zeropoint {
            zp_mag: file.zp_mag,
            k_mag_airmass: file.k_mag_airmass,
            c_mag_mag: file.c_mag_mag,
            k2_mag,
            cov,
            cov_95: match file.covariance_95 {
                Some(cov) => square(cov)?,
                None => super::marginal::Quoted::of(cov, f64::INFINITY).cov_95,
            },
            cov_model: file.covariance_model.map_or(Ok(cov), square)?,
            cov_star_jackknife: file.covariance_star_jackknife.map(square).transpose()?,
            cov_pointing_jackknife: file.covariance_pointing_jackknife.map(square).transpose()?,
            estimator: file.estimator,
            n_used: file.n_used,
            n_stars: file.n_stars,
            n_rejected: file.n_rejected,
            n_pointings: file.n_pointings,
            rms_mag: file.rms_mag.unwrap_or(f64::NAN),
            robust_sigma_mag: file.robust_sigma_mag.unwrap_or(f64::NAN),
            intrinsic_mag: file.intrinsic_mag.unwrap_or(f64::NAN),
            star_scatter_mag: file.star_scatter_mag.unwrap_or(f64::NAN),
            line_of_sight_mag: file.line_of_sight_mag.unwrap_or(f64::NAN),
            colour_share: file.colour_share.unwrap_or(1.0),
            pointing_scatter_mag: file.pointing_scatter_mag.unwrap_or(f64::NAN),
            pointing_chi2_dof: file.pointing_chi2_dof,
            pointing_p_value: file.pointing_p_value,
            chi2_dof: file.chi2_dof,
            p_value: file.p_value,
            condition: file.condition.unwrap_or(f64::NAN),
            rank: file.rank.unwrap_or(0),
            band: file.band,
            colour,
            light: file.filter.as_deref().map(Light::named),
            mjd_mean_d: file.mjd_mean_d.filter(|d| d.is_finite()),
            target_b_v_mag: file.target_b_v_mag.unwrap_or(nan2),
            airmass_mean: file.airmass_mean.unwrap_or(f64::NAN),
            b_v_mean_mag: file.b_v_mean_mag.unwrap_or(f64::NAN),
            airmass_range: file.airmass_range.unwrap_or(nan2),
            b_v_range_mag: file.b_v_range_mag.unwrap_or(nan2),
            k_note: file.k_note,
            c_note: file.c_note,
            k2_note: file.k2_note,
            cov_note: file.cov_note,
            pointings: file.pointings.into_iter().map(Pointing::from).collect(),
            warnings,
            weights: Vec::new(),
            residuals_mag: Vec::new(),
            leverage: Vec::new(),
        })
    }
}

impl From<PointingTable> for Pointing {
    fn from(p: PointingTable) -> Self {
        let PointingTable { number, n_used, n_rejected, airmass_mean, offset_mag, offset_err_mag } = p;
        Pointing { number, n_used, n_rejected, airmass_mean, offset_mag, offset_err_mag }
    }
}

/// A number TOML reads back to the same bits.
fn number(v: f64) -> String {
    toml::Value::Float(v).to_string()
}

fn text(s: &str) -> String {
    toml::Value::String(s.to_owned()).to_string()
}

fn texts(v: &[String]) -> String {
    toml::Value::Array(v.iter().cloned().map(toml::Value::String).collect()).to_string()
}

fn list(v: &[f64]) -> String {
    format!("[{}]", v.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", "))
}

/// The first `n` rows and columns.
fn rows(m: &Matrix, n: usize) -> String {
    format!("[{}]", m[..n].iter().map(|row| list(&row[..n])).collect::<Vec<_>>().join(", "))
}

/// c_ij / √(c_ii c_jj); 0 for a term that is held.
fn correlation(cov: &Matrix) -> Matrix {
    let scale = |i: usize| if cov[i][i] > 0.0 { cov[i][i].sqrt().recip() } else { 0.0 };
    std::array::from_fn(|i| std::array::from_fn(|j| cov[i][j] * scale(i) * scale(j)))
}

/// Three or four rows as a full matrix; `None` for anything else.
fn padded(rows: &[Vec<f64>]) -> Option<Matrix> {
    let n = rows.len();
    if !(n == 3 || n == 4) || rows.iter().any(|row| row.len() != n) {
        return None;
    }
    Some(std::array::from_fn(|i| std::array::from_fn(|j| if i < n && j < n { rows[i][j] } else { 0.0 })))
}

/// Finite, symmetric, no negative variance, no correlation beyond 1.
fn check_covariance(cov: &Matrix) -> std::result::Result<(), String> {
    for i in 0..N {
        for j in 0..N {
            let limit = (cov[i][i] * cov[j][j]).sqrt() * (1.0 + 1e-9);
            let symmetric = (cov[i][j] - cov[j][i]).abs() <= 1e-9 * limit;
            // also false for NaN
            if !(cov[i][i] >= 0.0 && cov[i][j].abs() <= limit && limit.is_finite() && symmetric) {
                return Err(format!(
                    "covariance {cov:?} is not valid: it must be symmetric, |c_ij| <= sqrt(c_ii c_jj)"
                ));
            }
        }
    }
    Ok(())
}
