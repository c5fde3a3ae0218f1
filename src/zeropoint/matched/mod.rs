//! A zeropoint from a table of matched stars, made by whatever measured them: no frames, no configuration needed.
//!
//! Magnitudes; V = V_inst − ZP − k X − C (B−V) with the instrumental magnitudes as the table has them. A column that is not
//! there (airmass, colour, errors) costs its term, not the fit. The table is never changed.

mod columns;
mod names;
mod odd_rows;
mod text;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::bands::Band;
use crate::bands::Meaning;
use crate::bands::filter_meaning;
use crate::base::error::{Error, Result};
use crate::config::{Config, Pin};
use crate::orbit::Atmosphere;
use crate::tables::StarRow;
use crate::tables::read::{Row, Table};
use crate::tables::words::Status;
use crate::zeropoint::fit::Zeropoint;
use crate::zeropoint::star_identity;
use crate::zeropoint::stars::fit_stars;
use columns::Columns;
use names::Finder;

/// A pause this long between measurements begins another night [d].
const NIGHT_GAP_D: f64 = 0.3;

/// A table of matched stars and how to read it.
#[derive(Debug, Clone)]
pub struct Request<'a> {
    /// The table: CSV, TSV, ECSV, VOTable, FITS (`FILE[EXTENSION]` where it has several tables) or what else [`Table`] reads.
    pub table: &'a Path,
    /// Names of columns, or numbers for all rows, by key: `inst_mag`, `flux`, `v_mag`, `b_v_mag`, `airmass`, ...
    pub columns: BTreeMap<String, String>,
    /// The band of the catalogue magnitudes, `V` as a rule.
    pub band: &'a str,
    /// Subtracted from the instrumental magnitudes \[mag\]: the arbitrary 25 or 30 some tables add.
    pub inst_constant_mag: f64,
}

/// The fit to a matched table.
#[derive(Debug)]
pub struct Matched {
    /// Every row of the table with its weight and residual, or why it was excluded.
    pub rows: Vec<StarRow>,
    /// The fit, or why there is none.
    pub zeropoint: std::result::Result<Zeropoint, String>,
    /// The source of each quantity.
    pub taken: Vec<(String, String)>,
    /// The unit of the instrumental magnitudes.
    pub inst_unit: String,
    /// The colour of the term C.
    pub colour: String,
    /// The band.
    pub band: String,
    /// Rows excluded before the fit, by reason.
    pub excluded: BTreeMap<String, usize>,
    /// Notes for the observer.
    pub notes: Vec<String>,
    pub(crate) table: String,
}

/// A configuration for a table alone: no cuts but those that `sets` (`stars.bv_range_mag=[0.2, 0.9]`) request.
///
/// # Errors
/// [`Error::Config`] for a wrong setting.
pub fn without_config(sets: &[String]) -> Result<Config> {
    const TEXT: &str = "preset = \"macquarie-cdk24\"\n[night]\nname = \"matched\"\ninput = []\noutput = \".\"\n\
        [stars]\ncatalogue = \"none\"\nbv_range_mag = [-20.0, 20.0]\nv_range_mag = [-90.0, 90.0]\n\
        airmass_range = [0.9, 100.0]\nv_err_max_mag = 10.0\nmin_snr = 0.0\n";
    Config::from_text(TEXT, sets)
}

/// Fits the zeropoint of a table of matched stars: `V = V_inst − ZP − k X − C (B−V)`.
///
/// The table is CSV, TSV, ECSV, VOTable, FITS or columns of text. Columns are known by the names that SExtractor, photutils,
/// STDPipe and VizieR give them; `columns` names others by key (`inst_mag`, `v_mag`, `b_v_mag`, `airmass`, ...) or gives
/// one number for all rows. Magnitudes in mag, of electrons per second where exposure and e⁻/ADU are known. The estimator is
/// robust against outliers; a term that the stars do not determine is held, and the zeropoint says so.
///
/// # Errors
/// [`Error::Table`] or [`Error::Config`] when a column that is needed is missing, with those present;
/// [`Error::Zeropoint`] when too few stars are left.
///
/// ```
/// # fn main() -> satphot::Result<()> {
/// let mut table = String::from("inst_mag,inst_mag_err,v_mag,b_v_mag,airmass\n");
/// for i in 0..60 {
///     let (v, b_v, x) = (10.0 + 0.05 * f64::from(i), 0.3 + 0.01 * f64::from(i * 7 % 60), 1.0 + 0.01 * f64::from(i * 13 % 60));
///     table += &format!("{},0.01,{v},{b_v},{x}\n", v - 23.4 + 0.12 * x + 0.08 * b_v);
/// }
/// # let folder = tempfile::tempdir().unwrap();
/// # let path = folder.path().join("stars.csv");
/// std::fs::write(&path, table).unwrap();
///
/// let zeropoint = satphot::fit_zeropoint(&path, &[])?;
/// assert!((zeropoint.zp_mag - -23.4).abs() < 1e-3);
/// assert!((zeropoint.k_mag_airmass - 0.12).abs() < 1e-3);
/// assert!((zeropoint.v_mag(-12.0, 1.2, 0.6) - 11.208).abs() < 1e-3);
/// # Ok(())
/// # }
/// ```
pub fn fit_zeropoint(table: &Path, columns: &[(&str, &str)]) -> Result<Zeropoint> {
    let columns = columns.iter().map(|(key, name)| ((*key).to_owned(), (*name).to_owned())).collect();
    let request = Request { table, columns, band: "V", inst_constant_mag: 0.0 };
    fit_matched(&without_config(&[])?, &request)?.zeropoint.map_err(|problem| Error::Zeropoint { problem })
}

/// Fits the zeropoint to a table of matched stars.
///
/// # Errors
/// [`Error::Table`] or [`Error::Config`] when a column that is needed is missing, with those present; a fit that fails is
/// reported in [`Matched::zeropoint`].
pub fn fit_matched(config: &Config, request: &Request) -> Result<Matched> {
    names::check_keys(&request.columns)?;
    let is_matched = |table: &Table| {
        let find = Finder { table, columns: &request.columns, band: request.band };
        Columns::find(&find, request.inst_constant_mag).is_ok()
    };
    let mut table = Table::open_where(request.table, &is_matched)?;
    let find = Finder { table: &table, columns: &request.columns, band: request.band };
    let columns = Columns::find(&find, request.inst_constant_mag)?;
    check_band(&columns, &table, request)?;
    let mut config = config.clone();
    if config.stars.is_none() {
        config.stars = without_config(&[])?.stars;
    }
    let mut out = Matched {
        rows: Vec::new(),
        zeropoint: Err(String::new()),
        taken: columns.taken.clone(),
        inst_unit: columns.unit.clone(),
        colour: columns.colour_name.clone(),
        band: request.band.to_owned(),
        excluded: BTreeMap::new(),
        notes: table.notes.iter().chain(&columns.notes).cloned().collect(),
        table: request.table.display().to_string(),
    };
    let atmosphere = Atmosphere::at_height_m(config.site.alt_m);
    let (mut usable, mut lost) = (Vec::new(), Vec::new());
    let mut leave_out = |line: usize, star: StarRow, reason: &str| {
        *out.excluded.entry(reason.to_owned()).or_default() += 1;
        lost.push((line, StarRow { status: Status::Rejected.into(), reason: reason.into(), ..star }));
    };
    let (mut row, mut n_rows, mut seen, mut n_again) = (Row::default(), 0, odd_rows::Seen::default(), 0);
    while table.read(&mut row)? {
        n_rows += 1;
        odd_rows::no_decimal_comma(&row, &columns, &table)?;
        match table.check(&row) {
            Err(_) => {
                let star = StarRow { star_id: table.place(&row), ..StarRow::default() };
                leave_out(row.line, star, "damaged row");
            }
            Ok(()) => match columns.star(&row, &table, &atmosphere) {
                (star, Err(reason)) => leave_out(row.line, star, reason),
                (star, Ok(())) if seen.again(&row, &star, &columns, &table) => {
                    n_again += 1;
                    leave_out(row.line, star, "exact duplicate");
                }
                (star, Ok(())) => {
                    let filter = columns.filter.map_or("", |i| row.get(i)).to_owned();
                    usable.push((row.line, star, filter));
                }
            },
        }
    }
    odd_rows::some_rows(n_rows, &table)?;
    out.notes.extend(odd_rows::repeated_note(n_again));
    let keep = one_filter(&usable, request)?;
    let (mut lines, mut stars) = (Vec::new(), Vec::new());
    for (line, star, filter) in usable {
        if keep.as_ref().is_none_or(|keep| keep.contains(&filter)) {
            lines.push(line);
            stars.push(star);
        } else {
            leave_out(line, star, "other filter");
        }
    }
    if let Some(note) = number_pointings(&mut stars) {
        out.notes.push(note);
    }
    out.notes.extend(exposures_differ(&stars, &columns));
    let mut cuts = BTreeMap::new();
    let zeropoint = fitted(&mut stars, &mut config, &columns, Band::declared(request.band), &mut cuts);
    for (cut, n) in cuts {
        *out.excluded.entry(cut).or_default() += n;
    }
    out.zeropoint = match zeropoint {
        Ok(zeropoint) => Ok(zeropoint),
        Err(error @ Error::Zeropoint { .. }) => Err(error.to_string()),
        Err(error) => return Err(error),
    };
    lost.extend(lines.into_iter().zip(stars));
    lost.sort_by_key(|(line, _)| *line);
    out.rows = lost.into_iter().map(|(_, star)| star).collect();
    Ok(out)
}

/// The fit, with the terms refused that have no column.
///
/// The cuts of a night need an error, an S/N, an airmass and a match; a table may lack them: 0 stands for an unknown error
/// while the fit runs, and is taken out again. A star that is in the table twice was measured twice: the name that would make
/// two detections of it in one frame is held back.
fn fitted(
    stars: &mut [StarRow],
    config: &mut Config,
    columns: &Columns,
    band: Option<Band>,
    cuts: &mut BTreeMap<String, usize>,
) -> Result<Zeropoint> {
    let none = Some(Pin { value: 0.0, err: 0.0 });
    let refused = |key: &str, what: &str| Error::Config {
        key: format!("zeropoint.{key}"),
        problem: format!("a term of {what} needs a column of it: name it with argument `column`"),
    };
    if !columns.has_colour() {
        if config.zeropoint.pin_c.is_some_and(|pin| pin.value != 0.0) {
            return Err(refused("pin_c", "colour"));
        }
        config.zeropoint.pin_c = none;
    }
    if !columns.has_airmass() {
        if config.zeropoint.pin_k.is_some_and(|pin| pin.value != 0.0) {
            return Err(refused("pin_k", "airmass"));
        }
        config.zeropoint.pin_k = none;
        if let Some(cuts) = &mut config.stars {
            cuts.airmass_range = [0.9, 1.1];
        }
    }
    let identities = star_identity::stars(stars, columns.has_names());
    let had: Vec<(String, [bool; 2])> = stars
        .iter_mut()
        .map(|s| (std::mem::take(&mut s.star_id), [s.inst_mag_err.is_some(), s.snr.is_some()]))
        .collect();
    for star in stars.iter_mut() {
        star.inst_mag_err = star.inst_mag_err.or(Some(0.0));
        star.snr = star.snr.or(Some(f64::MAX));
        star.match_arcsec = Some(0.0);
        if !columns.has_airmass() {
            star.airmass = Some(1.0);
        }
    }
    let zeropoint = fit_stars(stars, &identities, config, cuts);
    for (star, (star_id, had)) in stars.iter_mut().zip(had) {
        star.star_id = star_id;
        star.inst_mag_err = star.inst_mag_err.filter(|_| had[0]);
        star.snr = star.snr.filter(|_| had[1]);
        star.match_arcsec = None;
        if !columns.has_airmass() {
            star.airmass = None;
        }
    }
    let mut zeropoint = zeropoint?;
    zeropoint.band = band;
    if !columns.has_airmass() {
        zeropoint.k_note = "refused: no airmass column".to_owned();
        zeropoint.airmass_mean = f64::NAN;
        zeropoint.airmass_range = [f64::NAN; 2];
        zeropoint.warnings.push(
            "k refused: no airmass column; taken as 0, so the zeropoint holds the extinction of these frames (argument `column` \
             airmass=NAME, or a number)"
                .to_owned(),
        );
    }
    if !columns.has_colour() {
        zeropoint.c_note = "refused: no colour column".to_owned();
        zeropoint.warnings.push(
            "C refused: no colour column; taken as 0, so the zeropoint holds for the mean colour of these stars (argument `column` \
             b_v_mag=NAME, or b_mag=NAME)"
                .to_owned(),
        );
    }
    Ok(zeropoint)
}

/// The filters to keep of a table of several, by their spellings; `None` where all rows are kept.
fn one_filter(rows: &[(usize, StarRow, String)], request: &Request) -> Result<Option<BTreeSet<String>>> {
    let filters: BTreeSet<&str> = rows.iter().map(|r| r.2.as_str()).collect();
    let band = Band::declared(request.band);
    let is_own = |text: &&&str| {
        let of_band = |band: Band| match filter_meaning(text) {
            meaning @ (Meaning::Band(_) | Meaning::Either(..)) => meaning.may_be(band),
            _ => false,
        };
        **text == request.band || band.is_some_and(of_band)
    };
    let own: BTreeSet<String> = filters.iter().filter(is_own).map(|t| (*t).to_owned()).collect();
    if !own.is_empty() {
        return Ok((own.len() < filters.len()).then_some(own));
    }
    let all: Vec<&str> = filters.iter().copied().collect();
    let refuse = |what: String| {
        let problem = format!("{} holds measurements {what}", request.table.display());
        Err(Error::Argument { name: format!("band {}", request.band), problem })
    };
    match all.as_slice() {
        [] => Ok(None),
        // a place in a wheel, or no filter: the band is the user's word
        [one] if matches!(filter_meaning(one), Meaning::Unfiltered | Meaning::Unknown) => Ok(None),
        [one] => refuse(format!(
            "through the filter {one}: name its band with argument `band`, and its catalogue magnitudes with argument `column` v_mag"
        )),
        _ => refuse(format!("in several filters, {}: name one of them with argument `band`", all.join(", "))),
    }
}

/// Refuses catalogue magnitudes of another band than the requested one.
fn check_band(columns: &Columns, table: &Table, request: &Request) -> Result<()> {
    let Some((name, band)) = columns.catalogue_band(table) else { return Ok(()) };
    // `r_mag` may be Cousins's R in a table that has small letters alone
    let same = Band::declared(request.band).is_none_or(|requested| requested.name().eq_ignore_ascii_case(band.name()));
    if same {
        return Ok(());
    }
    Err(Error::Argument {
        name: format!("band {}", request.band),
        problem: format!(
            "the catalogue magnitudes are those of column `{name}`, which is of band {band}: say argument `band {band}`"
        ),
    })
}

/// Numbers pointings in the order of the table; without a column of them the rows of one time are one pointing where times
/// repeat, else every night is one. With what should be known of that.
fn number_pointings(stars: &mut [StarRow]) -> Option<String> {
    const NAME_IT: &str = "name the column with argument `column pointing=NAME` (FIELD, OBJECT, ...)";
    let mut numbers = BTreeMap::new();
    if stars.iter().any(|s| !s.object_name.is_empty()) {
        for star in stars {
            let next = numbers.len() as i64;
            star.pointing = Some(*numbers.entry(star.object_name.clone()).or_insert(next));
        }
        return None;
    }
    let mut times: Vec<f64> = stars.iter().filter_map(|s| s.mjd_mid_d).collect();
    times.sort_by(f64::total_cmp);
    let mut different = times.clone();
    different.dedup();
    if times.len() == stars.len() && different.len() > 1 && 2 * different.len() <= times.len() {
        for star in stars {
            star.pointing = star.mjd_mid_d.map(|t| different.partition_point(|d| *d < t) as i64);
        }
        return Some(format!(
            "no column of pointings: the rows of one time are taken as one pointing, {} of them; {NAME_IT}",
            different.len()
        ));
    }
    let begins: Vec<f64> = times.windows(2).filter(|w| w[1] - w[0] > NIGHT_GAP_D).map(|w| w[1]).collect();
    for star in stars {
        let night = star.mjd_mid_d.map_or(0, |t| begins.partition_point(|b| *b <= t));
        star.pointing = Some(night as i64);
    }
    Some(format!(
        "no column of pointings: the stars of a night count as one, and how much pointings scatter is not measured but \
         taken from zeropoint.pointing_scatter_prior_mag; {NAME_IT}"
    ))
}

/// A warning when magnitudes of different exposures stand side by side.
fn exposures_differ(stars: &[StarRow], columns: &Columns) -> Option<String> {
    let mut times = stars.iter().filter_map(|s| s.exptime_s);
    let first = times.next()?;
    let differ = !columns.of_flux() && times.any(|t| (t - first).abs() > 1e-6 * first);
    differ.then(|| {
        "exposure times differ, and instrumental magnitudes are taken as they are: if they are not per second, give the \
         flux (argument `column flux=NAME`)"
            .to_owned()
    })
}
