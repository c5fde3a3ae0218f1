//! Observations as EOObservation records of the Unified Data Library: a JSON array, one object per line.
//!
//! Degrees, km (the height of the sensor too), seconds, magnitudes. Magnitudes are V, so each record carries the tag
//! BAND_V: the library means Gaia G where nothing is said. Azimuth, elevation and range follow from the elements and are marked
//! as not measured; right ascension and declination are there where star trails measured them. Source: unifieddatalibrary.com, `eo_observation_create` (2025). It does not cover the upload.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::facts::{Facts, argument};
use super::select::{ExportedRow, total_err_mag};
use crate::base::error::{Error, Result};
use crate::base::utc::Utc;
use crate::brightness::Illum;
use crate::brightness::light_class::{PaperLabel, SkyClass};
use crate::tables::PhotometryRow;
use crate::tables::row_passes::passes;

/// What is the same in every record and not in the table.
#[derive(Debug, Clone)]
pub struct UdlNames {
    /// Classification marking, `U` for unclassified.
    pub classification: String,
}

impl Default for UdlNames {
    fn default() -> Self {
        Self { classification: "U".into() }
    }
}

/// The array. Non-detections are not part of it: the record has no field for a limit.
///
/// # Errors
/// [`Error::Config`] for what nobody said; [`Error::Table`] for a row without a time.
pub fn udl_text(
    path: &Path,
    rows: &[PhotometryRow],
    kept: &[ExportedRow<'_>],
    facts: &Facts,
    names: &UdlNames,
) -> Result<String> {
    if names.classification.trim().is_empty() {
        return Err(argument("classification", "is empty; U stands for unclassified".into()));
    }
    let tracks = tracks(rows);
    let mut text = String::from("[");
    let mut first = true;
    for kept in kept {
        let ExportedRow::Magnitude(row) = kept else { continue };
        let track = tracks.get(&std::ptr::from_ref(*row)).map(String::as_str);
        let record = Value::Object(record(path, row, track, facts, names)?);
        // Writing to a String cannot fail.
        let _ = write!(text, "{}\n{record}", if first { "" } else { "," });
        first = false;
    }
    if first {
        let problem = "no magnitude to report; see what was skipped, and argument `verdicts`".into();
        return Err(Error::NoInput { path: path.into(), problem });
    }
    Ok(text + "\n]\n")
}

/// The name of the pass of each row: start and satellite.
fn tracks(rows: &[PhotometryRow]) -> HashMap<*const PhotometryRow, String> {
    let mut named = HashMap::new();
    for pass in passes(rows) {
        let Some(start) = pass.first().and_then(|r| Utc::read(&r.date_mid)) else { continue };
        let satellite = pass[0].norad_cat_id.map_or_else(|| pass[0].object_name.clone(), |n| n.to_string());
        let id = format!("{}-{satellite}", start.compact());
        named.extend(pass.into_iter().map(|row| (std::ptr::from_ref(row), id.clone())));
    }
    named
}

fn record(
    path: &Path,
    row: &PhotometryRow,
    track: Option<&str>,
    facts: &Facts,
    names: &UdlNames,
) -> Result<Map<String, Value>> {
    let utc = Utc::read(&row.date_mid).ok_or_else(|| Error::Table {
        path: path.into(),
        line: None,
        problem: format!(
            "{}: date_mid `{}` is not a UTC time; write it as 2025-06-09T10:33:02.500Z",
            row.frame, row.date_mid
        ),
    })?;
    let [lat, lon, alt_m] = facts.site()?;
    let (data_mode, source) = (facts.data_mode()?.name(), facts.organisation()?);
    let text = |t: &str| (!t.is_empty()).then(|| json!(t));
    let number = |v: Option<f64>| v.map(|v| json!(v));
    let zeropoint = facts.zeropoint;
    let place = row.ra_deg.zip(row.dec_deg);
    let [umbra, penumbra] = shadow(row).map(|known| known.map(|b| json!(b)));
    let details = filled([
        ("gain", number(row.e_per_adu)),
        ("magInstrumental", number(row.inst_mag)),
        ("snrEst", number(row.snr)),
        ("ccdObjPosX", number(row.x_px)),
        ("ccdObjPosY", number(row.y_px)),
        ("pcalNumStars", zeropoint.and_then(|z| z.n_used).map(|n| json!(n as i64))),
        ("distFromStreakCenter", row.mu_mean_mag_arcsec2.map(|_| json!([0.0]))),
        ("surfBrightness", row.mu_mean_mag_arcsec2.map(|mu| json!([mu]))),
        ("solarDiskFrac", umbra.as_ref().filter(|u| **u == json!(true)).map(|_| json!(0.0))),
        ("timesUnc", number(row.time_err_s)),
        ("sunElevation", number(row.sun_alt_deg)),
    ]);
    let known = |there: bool| there.then_some(json!(false));
    Ok(filled([
        ("classificationMarking", Some(json!(names.classification.trim()))),
        ("dataMode", Some(json!(data_mode))),
        ("obTime", Some(json!(utc.iso(6) + "Z"))),
        ("source", Some(json!(source))),
        ("satNo", row.norad_cat_id.map(|n| json!(n))),
        ("origObjectId", text(&row.object_id)),
        ("origSensorId", Some(json!(facts.station()?))),
        ("senlat", Some(json!(lat))),
        ("senlon", Some(json!(lon))),
        ("senalt", Some(json!(alt_m / 1000.0))),
        ("azimuth", number(row.az_deg.map(|az| az.rem_euclid(360.0)))),
        ("azimuthMeasured", known(row.az_deg.is_some())),
        ("elevation", number(row.alt_deg)),
        ("elevationMeasured", known(row.alt_deg.is_some())),
        ("ra", number(place.map(|p| p.0))),
        ("raUnc", number(place.and(row.ra_err_arcsec).map(|e| e / 3600.0))),
        ("raMeasured", place.map(|_| json!(true))),
        ("declination", number(place.map(|p| p.1))),
        ("declinationUnc", number(place.and(row.dec_err_arcsec).map(|e| e / 3600.0))),
        ("declinationMeasured", place.map(|_| json!(true))),
        ("range", number(row.range_km)),
        ("rangeMeasured", known(row.range_km.is_some())),
        ("expDuration", number(row.exptime_s)),
        ("mag", number(row.v_mag)),
        ("magUnc", number(total_err_mag(row))),
        ("magNormRange", number(mag_1000km(row))),
        ("tags", Some(json!([format!("BAND_{}", facts.band)]))),
        (
            "descriptor",
            Some(json!(format!(
                "{} magnitude ({}), apparent, outside the atmosphere; magNormRange at 1000 km; {}",
                facts.calibration, facts.mag_system, facts.tool
            ))),
        ),
        ("zeroptd", zeropoint.map(|z| json!(-z.zp_mag))),
        ("zeroPtdUnc", number(zeropoint.and_then(|z| z.zp_err_mag))),
        ("primaryExtinction", zeropoint.map(|z| json!(z.k_mag_airmass))),
        ("primaryExtinctionUnc", number(zeropoint.and_then(|z| z.k_err_mag_airmass))),
        ("skyBkgrnd", number(zeropoint.and_then(|z| sky_mag_arcsec2(row, z.zp_mag)))),
        ("solarPhaseAngle", number(row.phase_angle_deg)),
        ("umbra", umbra),
        ("penumbra", penumbra),
        ("trackId", track.map(|t| json!(t))),
        ("collectMethod", Some(json!("RATE TRACK"))),
        ("rawFileURI", text(&row.frame)),
        ("eoobservationDetails", (!details.is_empty()).then_some(Value::Object(details))),
    ]))
}

/// The magnitude reduced to 1000 km: m − 5 lg(range / 1 000 000 m), as the library defines `magNormRange`.
fn mag_1000km(row: &PhotometryRow) -> Option<f64> {
    let range_km = row.range_km.filter(|km| *km > 0.0)?;
    Some(row.v_mag? - 5.0 * (range_km / 1000.0).log10())
}

/// Brightness of the sky under the aperture as it arrives, without extinction subtracted \[mag/arcsec²\]:
/// `μ = −2.5 log10(e⁻/px/s) − ZP + 5 log10(arcsec/px)`.
fn sky_mag_arcsec2(row: &PhotometryRow, zp_mag: f64) -> Option<f64> {
    let rate = row.sky_e_px? / row.exptime_s?;
    (rate > 0.0).then_some(())?;
    Some(-2.5 * rate.log10() - zp_mag + 5.0 * row.pix_scale_arcsec?.log10()).filter(|mu| mu.is_finite())
}

/// The fields that have a value: nothing is ever null.
fn filled<const N: usize>(fields: [(&str, Option<Value>); N]) -> Map<String, Value> {
    fields.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?))).collect()
}

/// Whether the satellite is in the umbra, and in the penumbra, as far as the row knows.
///
/// The largest light is sunlight only where sunlit sides are seen: a sunlit satellite may show Earthshine or nothing,
/// so these alone do not say that it is in the umbra. In a night sky the paper's label does: it is `night` in the
/// umbra.
fn shadow(row: &PhotometryRow) -> [Option<bool>; 2] {
    let night_sky = row.sky_class == SkyClass::Night.to_string();
    match (Illum::from_cell(&row.illum), PaperLabel::from_text(&row.paper_label)) {
        (None, _) => [None, None],
        (Some(Illum::Sun), _) => [Some(false), Some(false)],
        (Some(Illum::Penumbra), _) => [Some(false), Some(true)],
        (_, Some(PaperLabel::Night)) | (Some(Illum::Moon | Illum::LunarEarthshine), None) => [Some(true), Some(false)],
        (_, Some(PaperLabel::Twilight)) if night_sky => [Some(false), None],
        (_, _) => [None, None],
    }
}
