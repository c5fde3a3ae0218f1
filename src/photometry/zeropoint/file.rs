//! zeropoint.toml: a fit written for people and read back for another night.
//!
//! States the sign convention and the unit of V_inst. Weights and residuals of single stars stay in stars.ecsv.

use std::fmt::Write as _;
use std::path::Path;

use serde::Deserialize;

use super::Zeropoint;
use crate::error::{Error, Result};

/// What a zeropoint.toml may hold; only the three terms and their errors are needed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    convention: Option<String>,
    inst_mag_unit: Option<String>,
    zp_mag: f64,
    zp_err_mag: Option<f64>,
    k_mag_airmass: f64,
    k_err_mag_airmass: Option<f64>,
    c_mag_mag: f64,
    c_err_mag_mag: Option<f64>,
    covariance: Option<[[f64; 3]; 3]>,
    /// Told for the reader, made anew from the covariance.
    #[serde(rename = "err_as_published_mag")]
    _err_as_published_mag: Option<f64>,
    /// Likewise.
    #[serde(rename = "err_propagated_mag")]
    _err_propagated_mag: Option<f64>,
    #[serde(default)]
    estimator: String,
    #[serde(default)]
    n_used: usize,
    #[serde(default)]
    n_rejected: usize,
    #[serde(default)]
    n_pointings: usize,
    rms_mag: Option<f64>,
    robust_sigma_mag: Option<f64>,
    intrinsic_mag: Option<f64>,
    chi2_dof: Option<f64>,
    p_value: Option<f64>,
    condition: Option<f64>,
    airmass_mean: Option<f64>,
    b_v_mean_mag: Option<f64>,
    airmass_range: Option<[f64; 2]>,
    b_v_range_mag: Option<[f64; 2]>,
    #[serde(default)]
    k_note: String,
    #[serde(default)]
    c_note: String,
    #[serde(default)]
    cov_note: String,
    #[serde(default)]
    warnings: Vec<String>,
    #[serde(default)]
    notes: Vec<String>,
}

const CONVENTION: &str = "V = V_inst - ZP - k X - C (B-V)";
const UNIT: &str = "-2.5 log10(electrons per second)";

impl Zeropoint {
    /// The fit as TOML; `notes` (night, catalogue, camera) are kept as they are.
    #[must_use]
    pub fn to_toml(&self, notes: &[String]) -> String {
        let errs = self.errs();
        let text = |s: &str| toml::Value::String(s.to_owned()).to_string();
        let list = |v: &[String]| toml::Value::Array(v.iter().cloned().map(toml::Value::String).collect()).to_string();
        let pair = |v: [f64; 2]| format!("[{}, {}]", number(v[0]), number(v[1]));
        let mut out = String::from(
            "# Zeropoint, extinction and colour term; X is the airmass, V_inst is of electrons, not ADU.\n",
        );
        let mut line = |key: &str, value: String| {
            let _ = writeln!(out, "{key} = {value}");
        };
        line("convention", text(CONVENTION));
        line("inst_mag_unit", text(UNIT));
        line("zp_mag", number(self.zp_mag));
        line("zp_err_mag", number(errs[0]));
        line("k_mag_airmass", number(self.k_mag_airmass));
        line("k_err_mag_airmass", number(errs[1]));
        line("c_mag_mag", number(self.c_mag_mag));
        line("c_err_mag_mag", number(errs[2]));
        let rows = self.cov.map(|r| format!("[{}, {}, {}]", number(r[0]), number(r[1]), number(r[2])));
        line("covariance", format!("[{}] # of (ZP, k, C)", rows.join(", ")));
        line("cov_note", text(&self.cov_note));
        // the paper adds the three errors in quadrature, without airmass, colour or covariance: shown for comparison
        line("err_as_published_mag", number(self.err_as_published_mag()));
        if self.airmass_mean.is_finite() && self.b_v_mean_mag.is_finite() {
            let err = number(self.err_mag(self.airmass_mean, self.b_v_mean_mag, 0.0));
            line("err_propagated_mag", format!("{err} # at airmass_mean and b_v_mean_mag"));
        }
        line("estimator", text(&self.estimator));
        line("n_used", self.n_used.to_string());
        line("n_rejected", self.n_rejected.to_string());
        line("n_pointings", self.n_pointings.to_string());
        line("rms_mag", number(self.rms_mag));
        line("robust_sigma_mag", number(self.robust_sigma_mag));
        line("intrinsic_mag", number(self.intrinsic_mag));
        if let Some(v) = self.chi2_dof {
            line("chi2_dof", format!("{} # with the stated errors alone", number(v)));
        }
        if let Some(v) = self.p_value {
            line("p_value", number(v));
        }
        line("condition", number(self.condition));
        line("airmass_mean", number(self.airmass_mean));
        line("airmass_range", pair(self.airmass_range));
        line("b_v_mean_mag", number(self.b_v_mean_mag));
        line("b_v_range_mag", pair(self.b_v_range_mag));
        line("k_note", text(&self.k_note));
        line("c_note", text(&self.c_note));
        line("warnings", list(&self.warnings));
        line("notes", list(notes));
        out
    }

    /// Reads a zeropoint.toml. Needed are `zp_mag`, `k_mag_airmass`, `c_mag_mag` and either `covariance` or the three errors
    /// (then without correlation, which a warning says). What the file does not say is NaN or empty.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Table`] naming the key, another sign convention or unit, or a covariance that is none.
    pub fn read(path: &Path) -> Result<Zeropoint> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        let bad = |problem: String| Error::Table { path: path.to_owned(), line: None, problem };
        let file: File = toml::from_str(&text).map_err(|e| {
            let line = e.span().map(|s| text[..s.start.min(text.len())].matches('\n').count() + 1);
            Error::Table { path: path.to_owned(), line, problem: e.message().to_owned() }
        })?;
        for (key, value, want) in
            [("convention", &file.convention, CONVENTION), ("inst_mag_unit", &file.inst_mag_unit, UNIT)]
        {
            if let Some(v) = value.as_ref().filter(|v| *v != want) {
                return Err(bad(format!("{key} = \"{v}\"; only \"{want}\" is read: convert the numbers")));
            }
        }
        let mut warnings = file.warnings;
        let cov = match (file.covariance, file.zp_err_mag, file.k_err_mag_airmass, file.c_err_mag_mag) {
            (Some(cov), ..) => cov,
            (None, Some(z), Some(k), Some(c)) => {
                warnings.push(format!(
                    "{}: no covariance, so errors of ZP, k and C are taken as independent",
                    path.display()
                ));
                [[z * z, 0.0, 0.0], [0.0, k * k, 0.0], [0.0, 0.0, c * c]]
            }
            _ => return Err(bad("give covariance, or zp_err_mag, k_err_mag_airmass and c_err_mag_mag".into())),
        };
        for (key, v) in [("zp_mag", file.zp_mag), ("k_mag_airmass", file.k_mag_airmass), ("c_mag_mag", file.c_mag_mag)]
        {
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
            cov,
            estimator: file.estimator,
            n_used: file.n_used,
            n_rejected: file.n_rejected,
            n_pointings: file.n_pointings,
            rms_mag: file.rms_mag.unwrap_or(f64::NAN),
            robust_sigma_mag: file.robust_sigma_mag.unwrap_or(f64::NAN),
            intrinsic_mag: file.intrinsic_mag.unwrap_or(f64::NAN),
            chi2_dof: file.chi2_dof,
            p_value: file.p_value,
            condition: file.condition.unwrap_or(f64::NAN),
            airmass_mean: file.airmass_mean.unwrap_or(f64::NAN),
            b_v_mean_mag: file.b_v_mean_mag.unwrap_or(f64::NAN),
            airmass_range: file.airmass_range.unwrap_or(nan2),
            b_v_range_mag: file.b_v_range_mag.unwrap_or(nan2),
            k_note: file.k_note,
            c_note: file.c_note,
            cov_note: file.cov_note,
            warnings,
            weights: Vec::new(),
            residuals_mag: Vec::new(),
        })
    }
}

/// A number TOML reads back to the same bits.
fn number(v: f64) -> String {
    toml::Value::Float(v).to_string()
}

/// Finite, symmetric, no negative variance, no correlation beyond 1.
fn check_covariance(cov: &[[f64; 3]; 3]) -> std::result::Result<(), String> {
    for i in 0..3 {
        for j in 0..3 {
            let limit = (cov[i][i] * cov[j][j]).sqrt() * (1.0 + 1e-9);
            let symmetric = (cov[i][j] - cov[j][i]).abs() <= 1e-9 * limit;
            // also false for NaN
            if !(cov[i][i] >= 0.0 && cov[i][j].abs() <= limit && limit.is_finite() && symmetric) {
                return Err(format!(
                    "covariance {cov:?} is no covariance: it must be symmetric, |c_ij| <= sqrt(c_ii c_jj)"
                ));
            }
        }
    }
    Ok(())
}
