//! Observations for SCORE, the repository of the IAU's centre for dark skies: 27 columns of CSV.
//!
//! Times to the millisecond UTC, magnitudes to 1 mmag with random and systematic error in quadrature, place in degrees
//! and metres. The position is given where star trails measured it; range and range rate stay blank: they are for measured
//! values alone.
//! Source: score.cps.iau.org, "Data format", and the server's own checks ([`super::score_check`]).

use super::score_form::HEADER;
use super::score_form::refused_below_deg;
use std::path::Path;

use super::facts::{DataMode, Facts, argument, needed, said, wrong};
use super::score_check::check_score;
use super::select::{ExportedRow, rounded, total_err_mag};
use crate::bands::Band;
use crate::bands::Meaning;
use crate::bands::filter_meaning;
use crate::base::error::{Error, Result};
use crate::base::utc::Utc;
use crate::photometry::Flags;
use crate::photometry::flux::detectable_e;
use crate::tables::PhotometryRow;
use crate::tables::words::{Status, Verdict};

/// Warnings reported at once.
const MOST_WARNINGS: usize = 5;

/// A file for SCORE and what its sender should know.
#[derive(Debug)]
pub struct Scored {
    /// The file.
    pub text: String,
    /// What the server may stumble over.
    pub warnings: Vec<String>,
}

/// The file: header and one line per observation; every rule of the server holds for it. `names` writes the names of
/// the satellites next to their numbers.
///
/// # Errors
/// [`Error::Config`] for simulated data and for what nobody said; [`Error::Table`] for a row without what SCORE needs,
/// and for a line that the server would refuse.
pub fn score_text(path: &Path, observations: &[ExportedRow<'_>], facts: &Facts, names: bool) -> Result<Scored> {
    match facts.data_mode()? {
        DataMode::Real => {}
        mode => {
            let problem = format!(
                "the data of {} are {}: SCORE takes real observations alone; argument `to` tdm, udl or a table takes these",
                path.display(),
                mode.name()
            );
            return Err(wrong("data_mode", problem));
        }
    }
    let [lat, lon, alt_m] = facts.site()?;
    let shared = SharedFields::of(facts)?;
    let mut writer = csv::Writer::from_writer(Vec::new());
    let broken = |e: csv::Error| Error::Table { path: path.into(), line: None, problem: e.to_string() };
    writer.write_record(HEADER).map_err(broken)?;
    for kept in observations {
        let row = kept.row();
        let lacks = |column: &str, remedy: &str| Error::Table {
            path: path.into(),
            line: None,
            problem: format!("{}: SCORE needs {column}, and the row has none; {remedy}", row.frame),
        };
        let number = row.norad_cat_id.ok_or_else(|| lacks("norad_cat_id", "give argument `norad_cat_id`"))?;
        let utc = Utc::read(&row.date_mid).ok_or_else(|| lacks("date_mid", "write the time as UTC"))?;
        let time_err = row.time_err_s.ok_or_else(|| lacks("time_err_s", "set time.err_s and measure again"))?;
        let limit = limit_v_mag(row, facts)
            .ok_or_else(|| lacks("limit_v_mag, or v_mag, flux_e and flux_err_e", "measure the frame again"))?;
        let (mag, err, comment) = match kept {
            ExportedRow::Limit(_) => (String::new(), String::new(), comment_of_limit(row)),
            ExportedRow::Magnitude(_) => {
                let (Some(mag), Some(err)) = (row.v_mag, total_err_mag(row)) else {
                    return Err(lacks("v_mag and v_mag_err", "measure the frame again"));
                };
                (rounded(mag, 3).to_string(), error_text(err), comment(row))
            }
        };
        let mut line: Vec<String> = vec![String::new(); HEADER.len()];
        let mut put = |column: &str, value: String| {
            if let Some(i) = HEADER.iter().position(|h| *h == column) {
                line[i] = value;
            }
        };
        if names {
            put("satellite_name", one_line(&row.object_name.to_uppercase()));
        }
        put("norad_cat_id", number.to_string());
        put("observation_time_utc", utc.iso(3) + "Z");
        put("observation_time_uncertainty_sec", time_err.to_string());
        put("apparent_magnitude", mag);
        put("apparent_magnitude_uncertainty", err);
        put("observer_latitude_deg", lat.to_string());
        put("observer_longitude_deg", lon.to_string());
        put("observer_altitude_m", alt_m.to_string());
        put("limiting_magnitude", rounded(limit, 3).to_string());
        put("instrument", shared.instrument.clone());
        put("observing_mode", shared.mode.clone());
        put("observing_filter", shared.filter.clone().unwrap_or_else(|| filter(&row.filter, &facts.band)));
        put("observer_email", shared.email.clone());
        put("observer_orcid", shared.orcid.clone());
        if let (Some(ra_deg), Some(dec_deg)) = (row.ra_deg, row.dec_deg) {
            put("satellite_right_ascension_deg", format!("{ra_deg:.6}"));
            put("satellite_declination_deg", format!("{dec_deg:.6}"));
            let square = |err: Option<f64>| err.map_or(String::new(), |e| format!("{:.4}", e * e));
            put("sigma_2_ra", square(row.ra_err_arcsec));
            put("sigma_2_dec", square(row.dec_err_arcsec));
        }
        put("comments", comment);
        put("data_archive_link", shared.link.clone());
        put("mpc_code", shared.mpc_code.clone());
        writer.write_record(&line).map_err(broken)?;
    }
    let bytes = writer.into_inner().map_err(|e| Error::io(path, e.into_error()))?;
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let (refused, warned): (Vec<_>, Vec<_>) = check_score(&text).into_iter().partition(|f| !f.warning);
    if let Some(first) = refused.first() {
        // what was said on the command line or in [reporter] is no fault of the table
        if let Some((_, option)) = OPTIONS.iter().find(|(column, _)| *column == first.column) {
            return Err(argument(option, format!("\"{}\" {}", first.value, first.problem)));
        }
        let problem = format!("SCORE would refuse the file: {first} ({} in all)", refused.len());
        return Err(Error::Table { path: path.into(), line: None, problem });
    }
    let mut warnings: Vec<String> = warned.iter().take(MOST_WARNINGS).map(ToString::to_string).collect();
    if warned.len() > MOST_WARNINGS {
        warnings
            .push(format!("{} more warnings; a check of the exported file lists all", warned.len() - MOST_WARNINGS));
    }
    warnings.extend(too_low(observations, alt_m));
    Ok(Scored { text, warnings })
}

/// Columns that are reported once for all rows, and who gives them.
const OPTIONS: [(&str, &str); 6] = [
    ("observer_email", "email (reporter.email)"),
    ("observer_orcid", "orcid (reporter.orcid)"),
    ("observing_mode", "observing_mode (reporter.observing_mode)"),
    ("instrument", "instrument (reporter.instrument)"),
    ("data_archive_link", "archive_link (reporter.data_archive_link)"),
    ("mpc_code", "mpc_code (reporter.mpc_code)"),
];

/// V magnitude at which 95 % of targets are detected: the row's own, or, in tables of an older satphot, which have none
/// for detections, that at the threshold of its noise: `V − 2.5 log10(t/F)`, t of [`detectable_e`].
fn limit_v_mag(row: &PhotometryRow, facts: &Facts) -> Option<f64> {
    let of_noise = || {
        let (v, flux_e, err_e) = (row.v_mag?, row.flux_e.filter(|f| *f > 0.0)?, row.flux_err_e?);
        Some(v - 2.5 * (detectable_e(flux_e, err_e, facts.detect_sigma) / flux_e).log10())
    };
    row.limit_v_mag.or_else(of_noise)
}

fn too_low(observations: &[ExportedRow<'_>], alt_m: f64) -> Option<String> {
    let limit = refused_below_deg(alt_m);
    let n = observations.iter().filter(|k| k.row().alt_deg.is_some_and(|alt| alt < limit)).count();
    (n > 0).then(|| {
        format!(
            "{n} observations below {limit:.0} deg altitude may be refused as below the horizon: SCORE seems to read the \
             {alt_m} m of the site as km; the data are right as they are"
        )
    })
}

/// What all lines share.
struct SharedFields {
    instrument: String,
    mode: String,
    filter: Option<String>,
    email: String,
    orcid: String,
    link: String,
    mpc_code: String,
}

impl SharedFields {
    fn of(facts: &Facts) -> Result<Self> {
        let r = &facts.reporter;
        let instrument = match (said(&r.instrument), said(&facts.telescope), said(&facts.camera)) {
            (Some(words), ..) => words.to_owned(),
            (None, Some(telescope), Some(camera)) => format!("{camera} on {telescope}"),
            (None, Some(telescope), None) => telescope.to_owned(),
            _ => return Err(needed("the instrument", "instrument", "reporter.instrument")),
        };
        let mode = said(&r.observing_mode).ok_or_else(|| {
            needed("VISUAL, BINOCULARS, CCD, CMOS or OTHER", "observing_mode", "reporter.observing_mode")
        })?;
        let email =
            said(&r.email).ok_or_else(|| needed("the e-mail address of the observer", "email", "reporter.email"))?;
        if r.orcid.iter().all(|o| o.trim().is_empty()) {
            return Err(needed("the ORCID of the observer", "orcid", "reporter.orcid"));
        }
        Ok(Self {
            instrument: one_line(&instrument),
            mode: mode.to_uppercase(),
            filter: said(&r.filter).map(one_line),
            email: email.to_owned(),
            orcid: r.orcid.iter().map(|o| o.trim()).collect::<Vec<_>>().join(", "),
            link: said(&r.data_archive_link).unwrap_or_default().to_owned(),
            mpc_code: said(&r.mpc_code).unwrap_or_default().to_owned(),
        })
    }
}

/// The filter in words: what stood in the beam, and the band the magnitudes were transformed to.
fn filter(of_header: &str, band: &str) -> String {
    let own = Band::named(band);
    match filter_meaning(of_header) {
        Meaning::Unfiltered => format!("{band} (unfiltered colour-transformed)"),
        Meaning::Band(_) | Meaning::Either(..) if own.is_some_and(|own| filter_meaning(of_header).may_be(own)) => {
            band.to_owned()
        }
        _ => format!("{band} (from {} colour-transformed)", one_line(of_header.trim())),
    }
}

/// An error with three decimals, or two digits where that is less.
fn error_text(err_mag: f64) -> String {
    let decimals = if err_mag >= 0.01 || err_mag <= 0.0 { 3 } else { (1.0 - err_mag.log10().floor()) as i32 };
    rounded(err_mag, decimals.min(9)).to_string()
}

/// Of a non-detection: what its limit is.
fn comment_of_limit(row: &PhotometryRow) -> String {
    let mut parts = vec![
        "non-detection".to_owned(),
        "limiting_magnitude: 95 % of targets as bright are detected in this frame".to_owned(),
    ];
    parts.extend(old_elements(row));
    one_line(&parts.join("; "))
}

/// What is said of elements more than 2 days old.
fn old_elements(row: &PhotometryRow) -> Option<String> {
    let age = row.tle_age_d.map(|d| format!(" ({:.1} d)", d.abs())).unwrap_or_default();
    let spoilt = if row.status == Status::Nondetection {
        "target may be outside the field searched"
    } else {
        "magnitude is not affected"
    };
    Flags(row.flags).has(Flags::OLD_ELEMENTS).then(|| format!("orbital elements older than 2 d{age}: {spoilt}"))
}

fn comment(row: &PhotometryRow) -> String {
    let mut parts = vec!["tracked".to_owned()];
    if !row.illum.is_empty() {
        parts.push(format!("illumination={}", row.illum));
    }
    if let Some(exptime_s) = row.exptime_s {
        parts.push(format!("exposure {exptime_s} s"));
    }
    if let (Some(random), Some(systematic)) = (row.v_mag_err, row.v_mag_err_sys) {
        parts.push(format!("random error {} mag", error_text(random)));
        parts.push(format!("systematic error {} mag", error_text(systematic)));
    } else {
        parts.push("random error alone, the systematic one is not known".to_owned());
    }
    parts.extend(old_elements(row));
    if row.verdict == Verdict::Caution || row.verdict == Verdict::Reject {
        parts.push(format!("{}: {}", row.verdict, Flags(row.flags)));
    }
    one_line(&parts.join("; "))
}

/// A line of the file is a line: control characters become blanks.
fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}
