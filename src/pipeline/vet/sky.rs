//! The background against the neighbouring frames: something in the beam, or an exposure time that belongs to another frame.
//!
//! Levels as the logarithm of electrons per pixel and second, so that gain and exposure time drop out; shape as
//! `sky_corner_ratio`. It does not cover levels below the read noise, where the pedestal decides.

use super::Finding;
use super::neighbours::Series;
use crate::config::Vetting;
use crate::photometry::Flags;
use crate::tables::PhotometryRow;

/// A change of exposure time by less than this factor changes the sky by less than the weather does.
const LEAST_RATIO: f64 = 1.35;
/// How well the sky must show the ratio of the exposure times: share of its logarithm.
const RATIO_ACCURACY: f64 = 0.3;
/// And at most this much of its logarithm.
const MOST_OFF: f64 = 0.5;
/// Frames after a change of exposure time that may still hold old data.
const LATE_FRAMES: usize = 3;
/// Error of the zero level of a frame, in units of its read noise: drifts of the pedestal.
const PEDESTAL_ERR_RN: f64 = 0.5;
/// Read noise taken where the row has none \[e⁻\].
const READ_NOISE_E: f64 = 3.0;

/// Steps of the background. `doubted`: frames whose exposure time, and so the level per second, is known to be uncertain.
pub(super) fn findings(rows: &[&PhotometryRow], t: &Vetting, doubted: &[usize]) -> Vec<(usize, Finding)> {
    let late: Vec<(usize, f64, f64)> = late_exposures(rows, doubted);
    let mut found: Vec<(usize, Finding)> = late
        .iter()
        .map(|(k, old_s, factor)| {
            let words = format!(
                "sky per second is {factor:.2} of the neighbouring frames', as of an exposure of {old_s} s and not {} s: \
                 old data under a new EXPTIME? (exptime_doubted)",
                rows[*k].exptime_s.unwrap_or(f64::NAN)
            );
            (*k, Finding::caution(Flags::EXPTIME_DOUBTED, words))
        })
        .collect();
    let is_late = |k: usize| doubted.contains(&k) || late.iter().any(|l| l.0 == k);
    let levels = levels(rows, is_late);
    let dips = dips(rows, t, &levels);
    for (k, departure) in &dips {
        let words = format!(
            "sky {:.0} % below that of the neighbouring frames, something in the beam (vignetted): lower_limit",
            100.0 * (1.0 - departure.exp())
        );
        found.push((*k, Finding::caution(Flags::VIGNETTED | Flags::LOWER_LIMIT, words)));
    }
    if t.corner_ratio_dev > 0.0 {
        // a sky fainter than the read noise has no shape that could be measured
        let steps = Series::of(rows, |r| level(r).and(r.sky_corner_ratio)).steps(|_, d| d.abs() > t.corner_ratio_dev);
        for (k, departure) in steps {
            let dropped = levels.departures(k, k + 1).iter().any(|d| *d < -t.corner_ratio_dev);
            let flags = if dropped { Flags::VIGNETTED | Flags::LOWER_LIMIT } else { Flags::VIGNETTED };
            let ratio = rows[k].sky_corner_ratio.unwrap_or(f64::NAN);
            let words = format!(
                "background at the edge of the field over the centre is {ratio:.2}, {:.2} {} than in the neighbouring frames \
                 (vignetted){}",
                departure.abs(),
                if departure < 0.0 { "less" } else { "more" },
                if dropped { ": lower_limit" } else { "" }
            );
            found.push((k, Finding::caution(flags, words)));
        }
    }
    found
}

/// ln of the sky in e⁻/px/s; `None` where it is not above the read noise.
fn level(row: &PhotometryRow) -> Option<f64> {
    let (sky_e, exptime_s) = (row.sky_e_px?, row.exptime_s.filter(|e| *e > 0.0)?);
    (sky_e > row.read_noise_e.unwrap_or(READ_NOISE_E)).then(|| (sky_e / exptime_s).ln())
}

/// Error of [`level`] by the pedestal.
fn level_err(row: &PhotometryRow) -> f64 {
    PEDESTAL_ERR_RN * row.read_noise_e.unwrap_or(READ_NOISE_E) / row.sky_e_px.unwrap_or(f64::NAN)
}

/// The levels, without those of frames whose exposure time is uncertain.
fn levels(rows: &[&PhotometryRow], doubted: impl Fn(usize) -> bool) -> Series {
    let mut series = Series::of(rows, level);
    (0..rows.len()).filter(|k| doubted(*k)).for_each(|k| series.values[k] = None);
    series
}

/// Frames whose level drops below that of their neighbours, with ln of the ratio.
fn dips(rows: &[&PhotometryRow], t: &Vetting, levels: &Series) -> Vec<(usize, f64)> {
    if t.sky_drop_frac <= 0.0 {
        return Vec::new();
    }
    let limit = -(1.0 - t.sky_drop_frac).ln();
    levels.clone().steps(|k, departure| departure < -(limit + 3.0 * level_err(rows[k])))
}

/// The first frames after a change of exposure time whose sky per second is wrong by the ratio of the two times: the new
/// EXPTIME on old data. The frame, the old time \[s\], and sky per second over that of the neighbours.
fn late_exposures(rows: &[&PhotometryRow], doubted: &[usize]) -> Vec<(usize, f64, f64)> {
    let levels = levels(rows, |k| doubted.contains(&k));
    let mut found = Vec::new();
    for since in 1..rows.len() {
        let (Some(old_s), Some(new_s)) = (rows[since - 1].exptime_s, rows[since].exptime_s) else { continue };
        let expected = (old_s / new_s).ln();
        if !(expected.abs() >= LEAST_RATIO.ln() && expected.is_finite()) {
            continue;
        }
        let same = rows[since..].iter().take(LATE_FRAMES).take_while(|r| r.exptime_s == Some(new_s)).count();
        let allowed = |k: usize| (RATIO_ACCURACY * expected.abs()).min(MOST_OFF) - level_err(rows[k]);
        // as many in a row as fit
        let late = (1..=same).map(|many| levels.departures(since, since + many)).rfind(|departures| {
            let fits = |(k, d): (usize, &f64)| (d - expected).abs() < allowed(since + k);
            !departures.is_empty() && departures.iter().enumerate().all(fits)
        });
        found.extend(late.into_iter().flatten().enumerate().map(|(k, d)| (since + k, old_s, d.exp())));
    }
    found
}
