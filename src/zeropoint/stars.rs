//! From star rows to the zeropoint: the cuts of the configuration, each named in its row, then the fit.

use std::collections::BTreeMap;
use std::fmt;

use crate::bands::ColourIndex;
use crate::base::error::{Error, Result};
use crate::config::{self, Config};
use crate::photometry::Flags;
use crate::tables::StarRow;
use crate::tables::words::Status;
use crate::zeropoint::fit::{StarMeasurement, Zeropoint, fit_among};
use crate::zeropoint::star_identity;

/// Flags that keep a star out of the fit.
const TAINTED: Flags = Flags(
    Flags::SATURATED.0
        | Flags::MASKED.0
        | Flags::EDGE.0
        | Flags::CLIP_EDGE.0
        | Flags::NEGATIVE.0
        | Flags::NEIGHBOUR.0
        | Flags::NO_ANNULUS.0,
);

/// A quantity with a range of its own in the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Ranged {
    /// V of the catalogue \[mag\].
    V,
    /// Colour of the catalogue \[mag\].
    Colour,
    /// Airmass.
    Airmass,
}

impl fmt::Display for Ranged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Ranged::V => "V",
            Ranged::Colour => "colour",
            Ranged::Airmass => "airmass",
        })
    }
}

/// Why a star does not enter the fit; as text, what stands in its row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cut {
    /// These flags.
    Flags(Flags),
    /// No flux, a negative one, or no exposure time.
    NoFlux,
    /// No detection near the place of the catalogue \[arcsec\].
    NoDetection(f64),
    /// S/N below this.
    Snr(f64),
    /// Error of the catalogue above this \[mag\].
    CatalogueErr(f64),
    /// A value that is needed is missing.
    Without(Ranged),
    /// A value outside of its range.
    Outside {
        /// Which.
        what: Ranged,
        /// The star's.
        value: f64,
        /// Smallest and largest allowed.
        range: [f64; 2],
    },
    /// Two detections of one frame claim the same star of the catalogue.
    Twice,
}

impl Cut {
    /// The same for all stars that the same cut takes: without the value of the one star.
    #[must_use]
    pub fn of_all(&self) -> String {
        match self {
            Cut::Outside { what, range: [lo, hi], .. } => format!("{what} outside {lo} to {hi}"),
            other => other.to_string(),
        }
    }
}

impl fmt::Display for Cut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cut::Flags(flags) => write!(f, "flags {flags}"),
            Cut::NoFlux => write!(f, "no positive flux"),
            Cut::NoDetection(arcsec) => write!(f, "no detection within {arcsec} arcsec"),
            Cut::Snr(least) => write!(f, "snr below {least}"),
            Cut::CatalogueErr(most) => write!(f, "catalogue error above {most} mag"),
            Cut::Without(what) => write!(f, "no {what}"),
            Cut::Outside { what, value, range: [lo, hi] } => write!(f, "{what} {value:.3} outside {lo} to {hi}"),
            Cut::Twice => write!(f, "two detections matched to this catalogue star"),
        }
    }
}

/// Why a star does not enter the fit; `None` if it does. A colour is needed unless the colour term is pinned to 0.
#[must_use]
pub fn cut(row: &StarRow, stars: &config::Stars, zeropoint: &config::Zeropoint) -> Option<Cut> {
    let outside = |value: Option<f64>, range: [f64; 2], what: Ranged| match value {
        None => Some(Cut::Without(what)),
        Some(v) if v >= range[0] && v <= range[1] => None,
        Some(value) => Some(Cut::Outside { what, value, range }),
    };
    let flags = Flags(row.flags);
    if flags.any(TAINTED) {
        return Some(Cut::Flags(Flags(flags.0 & TAINTED.0)));
    }
    if !row.inst_mag.is_some_and(f64::is_finite) || row.inst_mag_err.is_none() {
        return Some(Cut::NoFlux);
    }
    if row.match_arcsec.is_none() {
        return Some(Cut::NoDetection(stars.match_radius_arcsec));
    }
    if row.snr.is_none_or(|snr| snr < stars.min_snr) {
        return Some(Cut::Snr(stars.min_snr));
    }
    if row.catalogue_v_mag_err.is_some_and(|e| e > stars.v_err_max_mag) {
        return Some(Cut::CatalogueErr(stars.v_err_max_mag));
    }
    let colourless = zeropoint.pin_c.is_some_and(|pin| pin.value == 0.0 && pin.err == 0.0) && !zeropoint.second_order;
    outside(row.catalogue_v_mag, stars.v_range_mag, Ranged::V)
        .or_else(|| {
            let unneeded = colourless && row.catalogue_b_v_mag.is_none();
            if unneeded { None } else { outside(row.catalogue_b_v_mag, stars.bv_range_mag, Ranged::Colour) }
        })
        .or_else(|| {
            // Kasten & Young give 0.9997 at the zenith
            let [lo, hi] = stars.airmass_range;
            outside(row.airmass, [if lo == 1.0 { 0.999 } else { lo }, hi], Ranged::Airmass)
        })
}

/// The configuration with the cut on B−V as one on another colour index.
#[must_use]
pub fn in_index(config: &Config, index: Option<ColourIndex>) -> Config {
    let mut own = config.clone();
    if let (Some(stars), Some(index)) = (&mut own.stars, index) {
        stars.bv_range_mag = stars.bv_range_mag.map(|b_v| index.of_b_v(b_v));
    }
    own
}

/// Fits the zeropoint to the rows that pass the cuts and writes status, reason, weight and residual into each row.
///
/// # Errors
/// [`Error::Zeropoint`] naming how many stars each cut left.
pub fn fit_rows(rows: &mut [StarRow], config: &Config) -> Result<Zeropoint> {
    let stars = star_identity::stars(rows, true);
    fit_stars(rows, &stars, config, &mut BTreeMap::new())
}

/// As [`fit_rows`], with the star of each row known; `cuts` counts how many stars each cut took, by [`Cut::of_all`].
///
/// # Errors
/// As [`fit_rows`].
pub fn fit_stars(
    rows: &mut [StarRow],
    identities: &[Option<usize>],
    config: &Config,
    cuts: &mut BTreeMap<String, usize>,
) -> Result<Zeropoint> {
    let Some(stars) = &config.stars else {
        return Err(Error::Config { key: "stars".into(), problem: "is needed to fit a zeropoint".into() });
    };
    let mut chosen = Vec::new();
    let mut measurements = Vec::new();
    let twice = matched_twice(rows);
    for (k, row) in rows.iter_mut().enumerate() {
        row.fit_weight = None;
        row.fit_residual_mag = None;
        row.fit_leverage = None;
        let duplicate = twice[k].then_some(Cut::Twice);
        match cut(row, stars, &config.zeropoint).or(duplicate) {
            Some(reason) => {
                row.status = Status::Rejected.into();
                row.reason = reason.to_string();
                *cuts.entry(reason.of_all()).or_default() += 1;
            }
            None => {
                row.status = Status::Ok.into();
                row.reason.clear();
                chosen.push(k);
                measurements.push(measurement(row, identities.get(k).copied().flatten()));
            }
        }
    }
    if measurements.len() < config.zeropoint.min_stars {
        return Err(Error::Zeropoint {
            problem: too_few(rows.len(), measurements.len(), config.zeropoint.min_stars, cuts),
        });
    }
    let population = colours_before_the_cut(rows, identities, stars, &config.zeropoint);
    let mut zeropoint = fit_among(&measurements, &population, &config.zeropoint)?;
    if rows.iter().any(|row| Flags(row.flags).has(Flags::NO_FLAT)) {
        zeropoint.warnings.push(format!(
            "star frames without flats: {} mag of vignetting (zeropoint.no_flat_err_mag) are added to v_mag_err_sys of \
             frames without flats",
            config.zeropoint.no_flat_err_mag
        ));
    }
    zeropoint.mjd_mean_d = mean_time(rows, &chosen, &zeropoint.weights);
    for (slot, &k) in chosen.iter().enumerate() {
        let row = &mut rows[k];
        row.fit_weight = Some(zeropoint.weights[slot]).filter(|w| w.is_finite());
        row.fit_residual_mag = Some(zeropoint.residuals_mag[slot]).filter(|r| r.is_finite());
        row.fit_leverage = Some(zeropoint.leverage[slot]).filter(|h| h.is_finite());
        if zeropoint.weights[slot] == 0.0 {
            row.status = Status::Rejected.into();
            row.reason = "outlier of the fit".into();
        }
    }
    Ok(zeropoint)
}

/// B−V and its error of every star that passes all cuts but the one on B−V: how far errors of the colours mislead the fit
/// depends on the stars that were there before it.
fn colours_before_the_cut(
    rows: &[StarRow],
    identities: &[Option<usize>],
    stars: &config::Stars,
    zeropoint: &config::Zeropoint,
) -> Vec<[f64; 2]> {
    let every = config::Stars { bv_range_mag: [-20.0, 20.0], ..stars.clone() };
    let mut seen = std::collections::HashSet::new();
    let mut out = Vec::new();
    for (k, row) in rows.iter().enumerate() {
        let Some(b_v) = row.catalogue_b_v_mag.filter(|b_v| b_v.is_finite()) else { continue };
        let new = identities.get(k).copied().flatten().is_none_or(|star| seen.insert(star));
        if new && cut(row, &every, zeropoint).is_none() {
            out.push([b_v, row.catalogue_b_v_mag_err.filter(|e| e.is_finite()).unwrap_or(0.0)]);
        }
    }
    out
}

/// Whether another row of the same frame claims the same catalogue star: then nobody knows which of the two it is.
fn matched_twice(rows: &[StarRow]) -> Vec<bool> {
    let mut count = BTreeMap::<(&str, Option<i64>, &str), usize>::new();
    for row in rows.iter().filter(|r| !r.star_id.is_empty() && r.match_arcsec.is_some()) {
        *count.entry((&row.frame, row.pointing, &row.star_id)).or_default() += 1;
    }
    let several = |r: &StarRow| count.get(&(&*r.frame, r.pointing, &*r.star_id)).is_some_and(|n| *n > 1);
    rows.iter().map(several).collect()
}

/// Mean mid-exposure time of the rows the fit used, MJD (UTC) \[d\].
fn mean_time(rows: &[StarRow], chosen: &[usize], weights: &[f64]) -> Option<f64> {
    let used = chosen.iter().zip(weights).filter(|(_, w)| **w > 0.0);
    let times: Vec<f64> = used.filter_map(|(k, _)| rows[*k].mjd_mid_d).filter(|t| t.is_finite()).collect();
    (!times.is_empty()).then(|| times.iter().sum::<f64>() / times.len() as f64)
}

fn measurement(row: &StarRow, star: Option<usize>) -> StarMeasurement {
    // `cut` has made sure of every value that is needed; an unknown catalogue error counts as 0 and the fit's own
    // scatter estimate takes its place
    StarMeasurement {
        inst_mag: row.inst_mag.unwrap_or(f64::NAN),
        inst_err_mag: row.inst_mag_err.unwrap_or(f64::NAN),
        v_mag: row.catalogue_v_mag.unwrap_or(f64::NAN),
        v_err_mag: row.catalogue_v_mag_err.unwrap_or(0.0),
        b_v_mag: row.catalogue_b_v_mag.unwrap_or(f64::NAN),
        b_v_err_mag: row.catalogue_b_v_mag_err.unwrap_or(0.0),
        airmass: row.airmass.unwrap_or(f64::NAN),
        pointing: row.pointing.unwrap_or(0).max(0) as usize,
        star,
    }
}

/// The sentence that says where the stars went.
fn too_few(n: usize, kept: usize, need: usize, cuts: &BTreeMap<String, usize>) -> String {
    let lost: Vec<String> = cuts.iter().map(|(cut, n)| format!("{n} {cut}")).collect();
    let lost = if lost.is_empty() { String::new() } else { format!(" ({})", lost.join(", ")) };
    format!(
        "{kept} of {n} star measurements left by the cuts, need {need}{lost}; take more stars, widen [stars], \
         lower zeropoint.min_stars, or give zeropoint.previous"
    )
}
