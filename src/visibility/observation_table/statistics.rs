//! Residuals in numbers: median, mean, scatter, and the error of the mean from passes.
//!
//! Magnitudes, observed minus modelled. The rows of a pass are not independent (one attitude, one night's zeropoint): the error of
//! the mean is that of the means of passes.

use crate::base::stats::{mad_sigma, mean_and_sd, median, quantile};
use crate::tables::PhotometryRow;
use crate::tables::row_passes::passes;
use crate::tables::words::Verdict;

/// Residuals in numbers \[mag\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualStatistics {
    /// Residuals.
    pub n: usize,
    /// Passes they are of; 0 where the rows have no times.
    pub n_passes: usize,
    /// Their median.
    pub median_mag: f64,
    /// Their mean.
    pub mean_mag: f64,
    /// 1.4826 times the median deviation from the median.
    pub sigma_mag: f64,
    /// √ of the mean square.
    pub rms_mag: f64,
    /// 16 % are below.
    pub p16_mag: f64,
    /// 84 % are below.
    pub p84_mag: f64,
    /// Standard error of the mean of the passes' means; `None` of fewer than two passes.
    pub mean_err_mag: Option<f64>,
}

impl ResidualStatistics {
    /// Of the rows that have a residual and are not rejected.
    #[must_use]
    pub fn of<'a>(rows: impl Iterator<Item = &'a PhotometryRow>) -> Option<Self> {
        let rows: Vec<PhotometryRow> =
            rows.filter(|r| r.residual_mag.is_some() && r.verdict != Verdict::Reject).cloned().collect();
        let mut residuals: Vec<f64> = rows.iter().filter_map(|r| r.residual_mag).collect();
        let n = residuals.len();
        let (mean_mag, _) = mean_and_sd(&residuals);
        let rms_mag = (residuals.iter().map(|r| r * r).sum::<f64>() / n as f64).sqrt();
        let means: Vec<f64> = passes(&rows)
            .iter()
            .map(|pass| mean_and_sd(&pass.iter().filter_map(|r| r.residual_mag).collect::<Vec<_>>()).0)
            .collect();
        Some(Self {
            n,
            n_passes: means.len(),
            median_mag: median(&mut residuals)?,
            mean_mag,
            sigma_mag: mad_sigma(&mut residuals).unwrap_or(0.0),
            rms_mag,
            p16_mag: quantile(&mut residuals, 0.16)?,
            p84_mag: quantile(&mut residuals, 0.84)?,
            mean_err_mag: (means.len() > 1).then(|| mean_and_sd(&means).1 / (means.len() as f64).sqrt()),
        })
    }
}

/// The statistics of each satellite, in order of catalogue number and name.
#[must_use]
pub fn by_satellite(rows: &[PhotometryRow]) -> Vec<(String, ResidualStatistics)> {
    let mut groups: std::collections::BTreeMap<(Option<i64>, &str), Vec<&PhotometryRow>> = Default::default();
    for row in rows {
        groups.entry((row.norad_cat_id, row.object_name.as_str())).or_default().push(row);
    }
    let label = |(number, name): (Option<i64>, &str)| match (number, name) {
        (Some(number), "") => number.to_string(),
        (Some(number), name) => format!("{name} [{number}]"),
        (None, name) => name.to_owned(),
    };
    groups.into_iter().filter_map(|(key, rows)| Some((label(key), ResidualStatistics::of(rows.into_iter())?))).collect()
}
