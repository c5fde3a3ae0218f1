//! Observed against modelled: fills the model columns of photometry rows, makes residual rows and passes.

use hifitime::Epoch;

use crate::bands::Band;
use crate::base::error::{Error, Result};
use crate::config::{self, Mode, Source};
use crate::photometry::Flags;
use crate::tables::row_passes::passes;
use crate::tables::words::Verdict;
use crate::tables::{PhotometryRow, ResidualRow};

/// Whether the model may be compared with magnitudes that are corrected for extinction, and the note if it is.
///
/// # Errors
/// [`Error::Config`] for a throughput, and for a source that includes extinction itself in corrected mode: it
/// would count twice.
pub fn comparable(model: &config::Model) -> Result<Option<String>> {
    if model.throughput.is_some() {
        return Err(Error::Config {
            key: "model.throughput".into(),
            problem:
                "observed magnitudes are those of a band outside the telescope, so the model's must be too: remove it \
                      (`predict` takes any band and throughput)"
                    .into(),
        });
    }
    let source = model.resolved_effects().source;
    let twice = "observed magnitudes are corrected for extinction, so a source that is dimmed by the air too counts it \
                 twice (0.21 mag in V, or k X)";
    match (source, model.mode) {
        (Source::ExoAtmospheric, _) => Ok(None),
        (_, Mode::AsPublished) => Ok(Some(format!("model: {twice}; done as published"))),
        (_, Mode::Corrected) => Err(Error::Config {
            key: "model.effects.source".into(),
            problem: format!("{twice}; use \"exo_atmospheric\", or model.mode = \"as_published\" to do it as printed"),
        }),
    }
}

/// Whether observed magnitudes of `observed` and those of the model are of one band, so that residuals can be formed; a word
/// on it if not.
///
/// # Errors
/// [`Error::Config`] where the configuration names another band of the model than V and than the one observed.
pub fn band_of_model(config: &config::Config, observed: Band) -> Result<Option<String>> {
    let Some(model) = config.model.as_ref().filter(|m| m.band != observed.name()) else { return Ok(None) };
    let known = config::Model::BANDS.contains(&observed.name());
    let remedy = if known {
        format!("set model.band = \"{observed}\" to compare them")
    } else {
        format!("the model knows {}", config::Model::BANDS.join(", "))
    };
    if model.band == Band::V.name() {
        return Ok(Some(format!(
            "observed magnitudes are of band {observed}, modelled ones of {}: no residuals are formed; {remedy}",
            model.band
        )));
    }
    Err(Error::Config {
        key: "model.band".into(),
        problem: format!(
            "\"{}\": observed magnitudes are {observed}, so the model's must be too; {remedy} (`predict` takes any band)",
            model.band
        ),
    })
}

/// The band that magnitudes of a table of observations must be of to be compared with a model: the model's.
///
/// # Errors
/// As [`comparable`]; [`Error::Config`] for a band that has no name.
pub fn band_of_observations(model: &config::Model) -> Result<(Band, Option<String>)> {
    let note = comparable(model)?;
    let band = Band::named(&model.band).ok_or_else(|| Error::Config {
        key: "model.band".into(),
        problem: format!(
            "\"{}\" is a file: observed magnitudes are of {}",
            model.band,
            config::Model::BANDS.join(", ")
        ),
    })?;
    Ok((band, note))
}

/// Number of the pass of each row (1-based); rows without a time belong to pass 0.
#[must_use]
pub fn pass_numbers(rows: &[PhotometryRow]) -> Vec<i64> {
    let mut numbers = vec![0; rows.len()];
    for (number, pass) in (1..).zip(passes(rows)) {
        for row in pass {
            if let Some(at) = rows.iter().position(|r| std::ptr::eq(r, row)) {
                numbers[at] = number;
            }
        }
    }
    numbers
}

/// The rows that have both an observed and a modelled magnitude.
#[must_use]
pub fn residual_rows(rows: &[PhotometryRow]) -> Vec<ResidualRow> {
    rows.iter()
        .zip(pass_numbers(rows))
        .filter(|(r, _)| r.residual_mag.is_some())
        .map(|(r, pass)| ResidualRow {
            frame: r.frame.clone(),
            norad_cat_id: r.norad_cat_id,
            object_name: r.object_name.clone(),
            pass: Some(pass),
            date_mid: r.date_mid.clone(),
            mjd_mid_d: r.mjd_mid_d,
            alt_deg: r.alt_deg,
            az_deg: r.az_deg,
            range_km: r.range_km,
            phase_angle_deg: r.phase_angle_deg,
            moon_sep_deg: r.moon_sep_deg,
            illum: r.illum.clone(),
            sky_class: r.sky_class.clone(),
            paper_label: r.paper_label.clone(),
            v_mag: r.v_mag,
            v_mag_err: r.v_mag_err,
            v_mag_err_sys: r.v_mag_err_sys,
            model_v_mag: r.model_v_mag,
            model_err_mag: r.model_err_mag,
            v_pred_err_mag: r.v_pred_err_mag,
            residual_mag: r.residual_mag,
            verdict: residual_verdict(r).into(),
            flags: r.flags,
        })
        .collect()
}

/// The verdict of a residual: that of the magnitude, and `caution` at best where old elements gave the geometry that the
/// model was computed for.
fn residual_verdict(row: &PhotometryRow) -> &str {
    let old = Flags(row.flags).has(Flags::OLD_ELEMENTS);
    if old && row.verdict == Verdict::Use { Verdict::Caution.as_str() } else { &row.verdict }
}

/// The epoch of a row, from its MJD.
#[must_use]
pub fn epoch_of(row: &PhotometryRow) -> Option<Epoch> {
    row.mjd_mid_d.map(crate::base::time::from_mjd_utc)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::words::Status;

    fn row(mjd_mid_d: f64, v: f64, model: f64) -> PhotometryRow {
        PhotometryRow {
            mjd_mid_d: Some(mjd_mid_d),
            v_mag: Some(v),
            model_v_mag: Some(model),
            residual_mag: Some(v - model),
            status: Status::Ok.into(),
            verdict: Verdict::Use.into(),
            illum: if v < 5.0 { "sun".into() } else { "moon".into() },
            ..PhotometryRow::default()
        }
    }

    #[test]
    fn passes_are_distinguished_by_gaps_whatever_the_order_of_the_rows() {
        let rows = [
            row(60_000.0, 12.0, 11.5),
            row(60_000.001, 2.0, 2.5),
            row(60_000.5, 12.5, 12.0),
            row(60_000.000_5, 3.0, 2.0),
        ];
        assert_eq!(pass_numbers(&rows), [1, 1, 2, 1]);
        assert_eq!(residual_rows(&rows)[2].residual_mag, Some(0.5));
    }

    #[test]
    fn old_elements_make_the_residual_one_to_be_cautious_with_and_leave_the_magnitude_as_it_is() {
        let mut rows = [row(60_000.0, 12.0, 11.5), row(60_000.001, 12.0, 11.5), row(60_000.002, 12.0, 11.5)];
        rows[1].flags = Flags::OLD_ELEMENTS.0;
        (rows[2].flags, rows[2].verdict) = (Flags::OLD_ELEMENTS.0, "reject".into());
        let verdicts: Vec<String> = residual_rows(&rows).into_iter().map(|r| r.verdict).collect();
        assert_eq!(verdicts, ["use", "caution", "reject"]);
        assert_eq!(rows[1].verdict, "use");
    }
}
