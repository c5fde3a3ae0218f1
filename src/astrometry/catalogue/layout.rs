//! Where each quantity stands in a catalogue, and one of its rows to a star.
//!
//! Magnitudes and degrees. The configuration wins over names, names over descriptors.

use std::collections::BTreeMap;

use super::angle::Angle;
use super::names::{B_MAG, GAIA, KNOWN, N_OBS, PLACES, TYCHO, TYCHO_ID};
use super::star::CatalogueStar;
use super::transform;
use super::transform::{Johnson, Pair, Value};
use crate::bands::{Band, ColourIndex, GaiaRelation, column_band};
use crate::tables::guess::ColumnGuesser;
use crate::tables::read::{Column, Row, Table};

/// Epoch of the positions of Gaia DR3 \[Julian year\].
const GAIA_EPOCH_JYEAR: f64 = 2016.0;
/// Twice the proper motion of Barnard's star; more is not a measurement \[mas/yr\].
const LARGEST_MOTION_MAS_YR: f64 = 2e4;

/// A cell, or the difference of two.
#[derive(Debug, Clone, Copy)]
enum Cell {
    One(usize),
    Difference(usize, usize),
}

/// The source of the magnitudes.
#[derive(Debug)]
enum Source {
    /// A column of magnitudes and one of errors.
    Own { v: usize, v_err: Option<usize> },
    /// BT, its error, VT, its error.
    Tycho([Option<usize>; 4]),
    /// G, BP, RP, each with its error.
    Gaia([Option<usize>; 6]),
    /// As before, for a band other than V.
    GaiaBand([Option<usize>; 6], Band, GaiaRelation),
    /// Two magnitudes of another set of filters, each with its error, and the third that the relation begins with.
    Pair([Option<usize>; 6], Pair),
}

impl Source {
    fn notes(&self) -> Vec<String> {
        match self {
            Source::Own { .. } => Vec::new(),
            Source::Tycho(_) => vec![
                "V and B-V made from BT and VT of Tycho (ESA 1997: 0.015 and 0.05 mag, -0.2 < BT-VT < 1.8, not M stars)"
                    .to_owned(),
            ],
            Source::Gaia(_) => vec![
                "V made from G, BP and RP of Gaia (DR3 documentation, table 5.9: 0.03 mag), B-V by way of BT and VT \
                 (0.1 mag)"
                    .to_owned(),
            ],
            Source::GaiaBand(_, band, relation) => vec![format!(
                "{band} made from G, BP and RP of Gaia (DR3 documentation, section 5.5.1: {:.2} mag), the colour is BP-RP",
                relation.scatter_mag
            )],
            Source::Pair(_, pair) => {
                vec![format!("{} made from {} ({:.2} mag)", pair.band, pair.source, pair.scatter_mag)]
            }
        }
    }
}

/// Where each quantity stands.
#[derive(Debug)]
pub struct Layout {
    ra: (usize, Angle),
    dec: (usize, Angle),
    source: Source,
    b_v: Option<Cell>,
    /// Which colour index it is; `None` where the name of its column does not tell.
    pub colour: Option<ColourIndex>,
    /// Error of the colour; of a difference those of both.
    b_v_err: [Option<usize>; 2],
    /// B with its error, and the V that is subtracted from it with its error.
    b_minus_v: Option<[Option<usize>; 4]>,
    id: Vec<usize>,
    n_obs: Option<usize>,
    /// Columns of the proper motion, and what makes mas/yr of them.
    motion: Option<([usize; 2], f64)>,
    epoch: Option<usize>,
    epoch_jyear: Option<f64>,
    /// Notes on how values are made.
    pub notes: Vec<String>,
}

type Found<T> = Result<T, String>;

impl Layout {
    /// Finds the columns, those of magnitudes of `band`; of V where the table has none of it.
    ///
    /// # Errors
    /// A column that is missing, with those present and the key that helps; a unit or an equinox that is not read.
    pub fn find(table: &Table, columns: &BTreeMap<String, String>, band: Band) -> Found<Layout> {
        let guess = ColumnGuesser { table, quantities: &KNOWN, band: Band::V.name() };
        let find = Finder { table, columns, guess };
        let (ra, dec) = find.place()?;
        let own_v = find.optional("v_mag")?;
        let any = |names: &[&str]| guess.first_of(names.iter().copied());
        let all = |names: &[&[&str]]| names.iter().map(|n| any(n)).collect::<Vec<_>>();
        let (tycho, gaia) = (all(&TYCHO), all(&GAIA));
        let of_gaia: Option<[Option<usize>; 6]> = match &gaia[..] {
            [Some(_), _, Some(_), _, Some(_), _] => gaia.clone().try_into().ok(),
            _ => None,
        };
        let of_band = if columns.contains_key("v_mag") { None } else { find.of_band(band, of_gaia) };
        let source = if let Some(source) = of_band {
            source
        } else if let Some(v) = own_v {
            Source::Own { v, v_err: find.error_of(v, "v_mag", "v_mag_err")? }
        } else if let ([Some(_), _, Some(_), _], Ok(at)) = (&tycho[..], tycho.clone().try_into()) {
            Source::Tycho(at)
        } else if let Some(at) = of_gaia {
            Source::Gaia(at)
        } else if let Some(at) = find.sloan_pair(Band::V) {
            at
        } else {
            return Err(
                find.missing("v_mag", "Vmag") + "; or give BTmag and VTmag (Tycho-2), or Gmag, BPmag and RPmag (Gaia)"
            );
        };
        let of_source = match &source {
            Source::Own { v, .. } if columns.contains_key("v_mag") => {
                column_band(&table.columns[*v].name).unwrap_or(band)
            }
            Source::Own { v, .. } => column_band(&table.columns[*v].name).unwrap_or(Band::V),
            Source::GaiaBand(_, band, _) => *band,
            Source::Pair(_, pair) => pair.band,
            Source::Tycho(_) | Source::Gaia(_) => Band::V,
        };
        let (b_v, colour) = match &source {
            Source::GaiaBand(at, ..) if !columns.contains_key("b_v_mag") => {
                (at[2].zip(at[4]).map(|(bp, rp)| Cell::Difference(bp, rp)), Some(ColourIndex::BP_RP))
            }
            source => find.colour(of_source, matches!(source, Source::Tycho(_) | Source::Gaia(_)))?,
        };
        let b_v_err = match b_v {
            Some(Cell::One(i)) if colour != Some(ColourIndex::B_V) && !columns.contains_key("b_v_err_mag") => {
                [guess.errors_of(i), None]
            }
            Some(Cell::One(i)) => [find.error_of(i, "b_v_mag", "b_v_err_mag")?, None],
            Some(Cell::Difference(i, j)) => match find.own("b_v_err_mag")? {
                Some(own) => [Some(own), None],
                None => [guess.errors_of(i), guess.errors_of(j)],
            },
            None => [None, None],
        };
        // B−V of B and V only where both are the catalogue's own Johnson magnitudes
        let johnson_v = guess.by_name("v_mag");
        let b_minus_v = any(B_MAG[0])
            .zip(johnson_v)
            .filter(|_| colour == Some(ColourIndex::B_V))
            .map(|(b, v)| [Some(b), any(B_MAG[1]), Some(v), guess.by_name("v_mag_err")]);
        // VizieR's and the archive's own columns of places are of the epoch of the data release
        let place = table.columns[ra.0].name.as_str();
        let is_gaia = any(GAIA[0]).is_some() && matches!(place, "RA_ICRS" | "ra");
        let mut notes = source.notes();
        let motion = find.motion(&mut notes)?;
        Ok(Layout {
            ra,
            dec,
            source,
            b_v,
            colour,
            b_v_err,
            b_minus_v,
            id: find.id()?,
            n_obs: any(N_OBS),
            motion,
            notes,
            epoch: find.optional("epoch_jyear")?,
            epoch_jyear: is_gaia.then_some(GAIA_EPOCH_JYEAR),
        })
    }

    /// The band of the magnitudes, if the name or descriptor of their column states it, and the column in words.
    pub fn band(&self, table: &Table) -> (Option<Band>, String) {
        match &self.source {
            Source::Own { v, .. } => {
                let column = &table.columns[*v];
                let of_ucd = || {
                    let ucd = column.ucd.to_ascii_uppercase();
                    (ucd.contains("EM.OPT.V") || ucd == "PHOT_JHN_V").then_some(Band::V)
                };
                (column_band(&column.name).or_else(of_ucd), format!("column `{}`", column.name))
            }
            Source::Tycho(_) => (Some(Band::V), "V made from BT and VT".to_owned()),
            Source::Gaia(_) => (Some(Band::V), "V made from G, BP and RP".to_owned()),
            Source::GaiaBand(_, band, _) => (Some(*band), format!("{band} made from G, BP and RP")),
            Source::Pair(_, pair) => (Some(pair.band), format!("{} made from {}", pair.band, pair.source)),
        }
    }

    /// Whether one star may have several entries: Gaia's are all different ones, however close.
    pub fn may_hold_duplicates(&self) -> bool {
        !matches!(self.source, Source::Gaia(_) | Source::GaiaBand(..))
    }

    /// One row.
    ///
    /// # Errors
    /// No place or no magnitude, with what stands there.
    pub fn star(&self, row: &Row, table: &Table) -> Found<CatalogueStar> {
        let angle = |(i, angle): (usize, Angle), hours: bool, name: &str| {
            angle.degrees(row.get(i), hours).ok_or_else(|| format!("no {name} (`{}`)", row.get(i)))
        };
        let ra_deg = angle(self.ra, true, "right ascension")?;
        let dec_deg = angle(self.dec, false, "declination")?;
        if !(-360.0..=360.0).contains(&ra_deg) || !(-90.0..=90.0).contains(&dec_deg) {
            return Err(format!("position {ra_deg} {dec_deg} deg is not on the sky"));
        }
        let johnson = self.johnson(row)?;
        let colour = self.colour(row).or(johnson.b_v);
        let id = self.id.iter().map(|i| row.get(*i)).filter(|t| !t.is_empty()).collect::<Vec<_>>().join("-");
        let motion = self.motion.and_then(|(at, factor)| {
            let value = |i: usize| row.number(i).map(|v| v * factor).filter(|v| v.abs() < LARGEST_MOTION_MAS_YR);
            value(at[0]).zip(value(at[1]))
        });
        let epoch = self.epoch.and_then(|i| row.number(i)).filter(|e| (1800.0..2200.0).contains(e));
        Ok(CatalogueStar {
            id: if id.is_empty() { table.place(row) } else { id },
            ra_deg: ra_deg.rem_euclid(360.0),
            dec_deg,
            v_mag: johnson.v.0,
            v_err_mag: johnson.v.1,
            b_v_mag: colour.map(|c| c.0),
            b_v_err_mag: colour.and_then(|c| c.1),
            n_obs: self.n_obs.and_then(|i| row.number(i)).filter(|n| *n >= 0.0 && *n < 1e9).map(|n| n as u32),
            pm_ra_mas_yr: motion.map(|m| m.0),
            pm_dec_mas_yr: motion.map(|m| m.1),
            epoch_jyear: epoch.or(self.epoch_jyear),
            ..CatalogueStar::default()
        })
    }

    fn johnson(&self, row: &Row) -> Found<Johnson> {
        let value = |at: &[Option<usize>]| -> Option<Value> {
            Some((magnitude(row, at[0]?)?, at[1].and_then(|i| error(row, i))))
        };
        match &self.source {
            Source::Own { v, v_err } => match value(&[Some(*v), *v_err]) {
                Some(v) => Ok(Johnson { v, b_v: None }),
                None => Err(format!("no V magnitude (`{}`)", row.get(*v))),
            },
            Source::Tycho(at) => match (value(&at[..2]), value(&at[2..])) {
                (Some(bt), Some(vt)) => transform::tycho(bt, vt)
                    .ok_or_else(|| format!("BT-VT {:.3} outside {:?}", bt.0 - vt.0, transform::TYCHO_RANGE_MAG)),
                _ => Err("no V magnitude (BT or VT is missing)".to_owned()),
            },
            Source::Gaia(at) => match (value(&at[..2]), value(&at[2..4]), value(&at[4..])) {
                (Some(g), Some(bp), Some(rp)) => transform::gaia(g, bp, rp)
                    .ok_or_else(|| format!("BP-RP {:.3} outside {:?}", bp.0 - rp.0, transform::GAIA_RANGE_MAG)),
                _ => Err("no V magnitude (G, BP or RP is missing)".to_owned()),
            },
            Source::GaiaBand(at, band, relation) => match (value(&at[..2]), value(&at[2..4]), value(&at[4..])) {
                (Some(g), Some(bp), Some(rp)) => transform::gaia_band(relation, g, bp, rp)
                    .map(|v| Johnson { v, b_v: None })
                    .ok_or_else(|| format!("BP-RP {:.3} outside {:?}", bp.0 - rp.0, relation.range_mag)),
                _ => Err(format!("no {band} magnitude (G, BP or RP is missing)")),
            },
            Source::Pair(at, pair) => match (value(&at[..2]), value(&at[2..4]), value(&at[4..])) {
                (Some(blue), Some(red), Some(base)) => pair
                    .magnitude(blue, red, base)
                    .map(|v| Johnson { v, b_v: None })
                    .ok_or_else(|| format!("colour {:.3} outside {:?}", blue.0 - red.0, Pair::RANGE_MAG)),
                _ => Err(format!("no {} magnitude (a magnitude of {} is missing)", pair.band, pair.source)),
            },
        }
    }

    /// B−V and its error: the table's own, else from B and V.
    fn colour(&self, row: &Row) -> Option<Value> {
        let err = match self.b_v_err {
            [Some(i), Some(j)] => error(row, i).zip(error(row, j)).map(|(a, b)| a.hypot(b)),
            [one, other] => one.or(other).and_then(|i| error(row, i)),
        };
        let known_errors = self.b_v_err.iter().any(Option::is_some);
        let own = match self.b_v {
            Some(Cell::One(i)) => row.number(i),
            Some(Cell::Difference(i, j)) => magnitude(row, i).zip(magnitude(row, j)).map(|(a, b)| a - b),
            None => None,
        };
        // 9.999 is unknown; 0.0 next to a column of errors that holds none is too, and not an A0 star
        let own = own.filter(|c| c.abs() < 9.99 && (*c != 0.0 || !known_errors || err.is_some()));
        if let Some(own) = own {
            return Some((own, err));
        }
        let [b, b_err, v, v_err] = self.b_minus_v?;
        let err = |at: Option<usize>| at.and_then(|i| error(row, i));
        Some((magnitude(row, b?)? - magnitude(row, v?)?, err(b_err).zip(err(v_err)).map(|(b, v)| b.hypot(v))))
    }
}

/// Looks for columns: those that the configuration names, else by guess.
struct Finder<'a> {
    table: &'a Table,
    columns: &'a BTreeMap<String, String>,
    guess: ColumnGuesser<'a>,
}

impl Finder<'_> {
    fn missing(&self, key: &str, usual: &str) -> String {
        format!(
            "column `{usual}` is missing; present: {}; name it with stars.columns.{key} = \"...\"",
            self.table.names()
        )
    }

    /// The column the configuration names.
    fn own(&self, key: &str) -> Found<Option<usize>> {
        let Some(name) = self.columns.get(key) else { return Ok(None) };
        let missing = || format!("column `{name}` (stars.columns.{key}) is missing; present: {}", self.table.names());
        self.table.column(name).map(Some).ok_or_else(missing)
    }

    /// By the configuration, by name, by descriptor.
    fn optional(&self, key: &str) -> Found<Option<usize>> {
        Ok(self.own(key)?.or_else(|| self.guess.column_of(key)))
    }

    /// The errors of column `at`, which is that of `key`: named for themselves, else after it. A column the
    /// configuration names never gets the errors of another.
    fn error_of(&self, at: usize, key: &str, err_key: &str) -> Found<Option<usize>> {
        if !self.columns.contains_key(key) || self.columns.contains_key(err_key) {
            return self.optional(err_key);
        }
        Ok(self.guess.errors_of(at))
    }

    /// The column of magnitudes of a band, by its name.
    fn magnitudes(&self, band: Band) -> Option<usize> {
        let is_error = |name: &str| name.starts_with("e_") || name.to_lowercase().contains("err");
        self.table.columns.iter().position(|c| !is_error(&c.name) && column_band(&c.name) == Some(band))
    }

    /// The source of magnitudes of a band other than V: its own column, else Gaia's, else those of g, r and i.
    fn of_band(&self, band: Band, gaia: Option<[Option<usize>; 6]>) -> Option<Source> {
        if band == Band::V {
            return None;
        }
        if let Some(v) = self.magnitudes(band) {
            return Some(Source::Own { v, v_err: self.guess.errors_of(v) });
        }
        let of_gaia = || Some(Source::GaiaBand(gaia?, band, GaiaRelation::of(band)?));
        self.sloan_pair(band).or_else(of_gaia)
    }

    /// A Johnson-Cousins band by way of g, r and i: those of SDSS where the names have a prime (APASS), of Pan-STARRS where the
    /// table is ATLAS-REFCAT2 or says PS1.
    fn sloan_pair(&self, band: Band) -> Option<Source> {
        let has = |name: &str| self.table.column(name).is_some();
        let names = |part: &str| self.table.columns.iter().any(|c| c.name.to_lowercase().contains(part));
        let pan_starrs = has("gcontrib") || (has("rp1") && has("r10")) || names("ps1") || has("gMeanPSFMag");
        let pair = Pair::of(band, pan_starrs).filter(|_| pan_starrs || has("g'mag"))?;
        let (blue, red, base) = (self.magnitudes(pair.blue)?, self.magnitudes(pair.red)?, self.magnitudes(pair.base)?);
        let err = |i| self.guess.errors_of(i);
        Some(Source::Pair([Some(blue), err(blue), Some(red), err(red), Some(base), err(base)], pair))
    }

    /// The colour and its index: what the configuration names (which may be a difference of two columns), else the first of
    /// the band's indices that the table has. `made` says that B−V comes with the magnitudes.
    fn colour(&self, band: Band, made: bool) -> Found<(Option<Cell>, Option<ColourIndex>)> {
        if let Some(name) = self.columns.get("b_v_mag") {
            let difference =
                name.split_once('-').and_then(|(a, b)| self.table.column(a.trim()).zip(self.table.column(b.trim())));
            let cell = match difference.filter(|_| self.table.column(name).is_none()) {
                Some((a, b)) => Cell::Difference(a, b),
                None => Cell::One(self.own("b_v_mag")?.unwrap_or_default()),
            };
            return Ok((Some(cell), ColourIndex::named(name)));
        }
        for index in ColourIndex::of_band(band) {
            if *index == ColourIndex::B_V {
                let own = self.optional("b_v_mag")?;
                let from_b = || self.guess.first_of(B_MAG[0].iter().copied()).zip(self.guess.by_name("v_mag"));
                if made || own.is_some() || from_b().is_some() {
                    return Ok((own.map(Cell::One), Some(*index)));
                }
                continue;
            }
            let of_name = |c: &Column| ColourIndex::named(&c.name) == Some(*index);
            if let Some(i) = self.table.columns.iter().position(of_name) {
                return Ok((Some(Cell::One(i)), Some(*index)));
            }
            if let (Some(blue), Some(red)) = (self.magnitudes(index.blue), self.magnitudes(index.red)) {
                return Ok((Some(Cell::Difference(blue, red)), Some(*index)));
            }
        }
        Ok((None, Some(ColourIndex::B_V)))
    }

    fn place(&self) -> Found<((usize, Angle), (usize, Angle))> {
        let (mut ra, mut dec) = (self.own("ra_deg")?, self.own("dec_deg")?);
        let pair = PLACES.iter().find_map(|(a, d)| self.table.column(a).zip(self.table.column(d)));
        if let Some((a, d)) = pair {
            (ra, dec) = (ra.or(Some(a)), dec.or(Some(d)));
        }
        let old = |c: &&Column| c.name.contains("1950") || c.name.contains("B1900");
        let other_equinox = || match self.table.columns.iter().find(old) {
            Some(c) => {
                format!("; `{}` is of another equinox; request J2000 (VizieR: -out.add=_RAJ2000,_DEJ2000)", c.name)
            }
            None => String::new(),
        };
        let ra = ra.or_else(|| self.guess.by_ucd("ra_deg").filter(|i| !old(&&self.table.columns[*i])));
        let dec = dec.or_else(|| self.guess.by_ucd("dec_deg").filter(|i| !old(&&self.table.columns[*i])));
        let ra = ra.ok_or_else(|| self.missing("ra_deg", PLACES[0].0) + &other_equinox())?;
        let dec = dec.ok_or_else(|| self.missing("dec_deg", PLACES[0].1) + &other_equinox())?;
        let angle = |i: usize| {
            let column = &self.table.columns[i];
            let system = column.system.to_ascii_uppercase();
            if old(&column) || system.contains("FK4") || system.contains("B1950") || system.contains("GALACTIC") {
                let system = if system.is_empty() { "B1950" } else { &column.system };
                return Err(format!(
                    "column `{}` is of {system}; J2000 (ICRS, FK5) is needed; request it (VizieR: \
                     -out.add=_RAJ2000,_DEJ2000)",
                    column.name
                ));
            }
            Angle::of(column).map(|angle| (i, angle))
        };
        Ok((angle(ra)?, angle(dec)?))
    }

    fn id(&self) -> Found<Vec<usize>> {
        let tycho: Option<Vec<usize>> = TYCHO_ID.iter().map(|n| self.table.column(n)).collect();
        match (self.own("id")?, tycho) {
            (Some(own), _) => Ok(vec![own]),
            (None, Some(three)) => Ok(three),
            (None, None) => Ok(self.optional("id")?.into_iter().collect()),
        }
    }

    /// The columns of the proper motion with what makes mas/yr of their unit; a unit that is not one of a motion is
    /// reported.
    fn motion(&self, notes: &mut Vec<String>) -> Found<Option<([usize; 2], f64)>> {
        let (Some(ra), Some(dec)) = (self.optional("pm_ra_mas_yr")?, self.optional("pm_dec_mas_yr")?) else {
            return Ok(None);
        };
        let factor = |i: usize| match self.table.columns[i].unit.to_ascii_lowercase().trim() {
            "" => Some(1.0),
            u if u.starts_with("mas") => Some(1.0),
            u if u.starts_with("arcsec") && u.ends_with(['r', '1']) => Some(1e3),
            _ => None,
        };
        if let (Some(a), Some(d)) = (factor(ra), factor(dec))
            && a == d
        {
            return Ok(Some(([ra, dec], a)));
        }
        let [a, d] = [ra, dec].map(|i| &self.table.columns[i]);
        notes.push(format!(
            "proper motions are not used: `{}` is in `{}`, `{}` in `{}`; mas/yr (right ascension with cos dec) is read",
            a.name, a.unit, d.name, d.unit
        ));
        Ok(None)
    }
}

/// A magnitude; 0.0, −99, 99.999 and their like are unknown.
fn magnitude(row: &Row, i: usize) -> Option<f64> {
    row.number(i).filter(|m| *m != 0.0 && (-9.0..60.0).contains(m))
}

/// An error; what is not positive, or 9.99 and above, is unknown.
fn error(row: &Row, i: usize) -> Option<f64> {
    row.number(i).filter(|e| *e > 0.0 && *e < 9.99)
}
