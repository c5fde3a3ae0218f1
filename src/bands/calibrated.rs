//! The band of a result: what the filter of the frames, the catalogue and the user say of it, and whether they agree.
//!
//! It does not cover which filter of a night is reduced ([`crate::pipeline::survey::filters`]).

use serde::{Deserialize, Serialize};

use super::Meaning;
use super::filter_meaning;
use crate::bands::Band;
use crate::base::error::{Error, Result};

/// The filter the frames of a run were taken through.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Light {
    /// In words: the band's name, `no filter`, or the text of FILTER.
    pub filter: String,
    /// What it means.
    pub meaning: Meaning,
}

/// How magnitudes came into their band.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum How {
    /// The filter is of the band.
    OwnFilter,
    /// Without a filter, transformed into the band by the colour term.
    Unfiltered,
    /// Through another filter or an unknown one, because the user declares the band.
    Declared,
}

/// The band of calibrated magnitudes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CalibratedBand {
    /// The band.
    pub band: Band,
    /// The filter of the frames.
    pub light: Light,
    /// How the one became the other.
    pub how: How,
}

impl Light {
    /// No filter.
    #[must_use]
    pub fn unfiltered() -> Self {
        Self { filter: "no filter".into(), meaning: Meaning::Unfiltered }
    }

    /// The filter that a file of an earlier run names.
    #[must_use]
    pub fn named(filter: &str) -> Self {
        let meaning = Band::named(filter).map_or_else(|| filter_meaning(filter), Meaning::Band);
        Self { filter: filter.to_owned(), meaning }
    }
}

impl CalibratedBand {
    /// V of frames without a filter, as in Caddy et al.
    #[must_use]
    pub fn unfiltered_v() -> Self {
        Self { band: Band::V, light: Light::unfiltered(), how: How::Unfiltered }
    }

    /// The band of magnitudes measured through `light` and calibrated to `reference` (`from` names where that is from,
    /// e.g.
    /// "column `Vmag`"), with what the user declares in `photometry.band`.
    ///
    /// # Errors
    /// [`Error::Config`] naming `photometry.band` when the three contradict each other or the band cannot be reported.
    pub fn of(light: &Light, (reference, from): (Option<Band>, &str), declared: Option<Band>) -> Result<Self> {
        let refuse = |problem: String| Error::Config { key: "photometry.band".into(), problem };
        let made = |band: Band, how: How| Ok(Self { band, light: light.clone(), how });
        if light.meaning == Meaning::NoBand {
            return Err(refuse(format!(
                "the frames were taken through {}, a filter for which no catalogue has magnitudes, so they cannot be \
                 calibrated; remove [stars] and zeropoint.previous to keep instrumental magnitudes, or reduce the frames of \
                 another filter with input.filter",
                light.filter
            )));
        }
        let filter = &light.filter;
        if let Some(band) = declared {
            let fits = reference.is_none_or(|known| known == band || known == band.reference());
            if !fits {
                let known = reference.unwrap_or(band);
                if light.meaning == Meaning::Band(band) {
                    return Err(refuse(other_band(light, from, known)));
                }
                return Err(refuse(format!(
                    "\"{band}\" is declared, but {from} holds magnitudes of band {known}; name a column of {band} in \
                     stars.columns.v_mag, or declare\n[photometry]\nband = \"{known}\""
                )));
            }
            return match &light.meaning {
                Meaning::Unfiltered => made(band, How::Unfiltered),
                Meaning::Unknown => made(band, How::Declared),
                meaning if meaning.may_be(band) => {
                    let light = Light { filter: band.name().to_owned(), meaning: Meaning::Band(band) };
                    Ok(Self { band, light, how: How::OwnFilter })
                }
                _ => made(band, How::Declared),
            };
        }
        let Some(known) = reference else {
            return Err(refuse(format!(
                "{from} does not say in its name of which band its magnitudes are; declare it\n[photometry]\nband = \"V\""
            )));
        };
        let other = || refuse(other_band(light, from, known));
        match light.meaning {
            Meaning::Unfiltered => made(known, How::Unfiltered),
            Meaning::Band(band) if band == known || band.reference() == known => made(band, How::OwnFilter),
            Meaning::Either(a, b) if [a, b, a.reference(), b.reference()].contains(&known) => Err(refuse(format!(
                "FILTER = '{filter}' may be {a} or {b} (of a set of filters for colour imaging), and the other filters of \
                 the night do not tell; declare which\n[photometry]\nband = \"{a}\""
            ))),
            Meaning::Band(_) | Meaning::Either(..) | Meaning::NoBand => Err(other()),
            Meaning::Unknown => Err(refuse(format!(
                "FILTER = '{filter}' is not a filter satphot knows, and {from} holds magnitudes of band {known}; if the \
                 frames are of that band, declare it\n[photometry]\nband = \"{known}\""
            ))),
        }
    }

    /// Magnitudes of `band` through `light`, as a file of an earlier run states them.
    #[must_use]
    pub fn known(band: Band, light: Light) -> Self {
        let how = match &light.meaning {
            Meaning::Unfiltered => How::Unfiltered,
            Meaning::Band(own) if *own == band => How::OwnFilter,
            _ => How::Declared,
        };
        Self { band, light, how }
    }

    /// In words: `V`, or `V, unfiltered, colour-transformed`.
    #[must_use]
    pub fn text(&self) -> String {
        match self.how {
            How::OwnFilter => self.band.to_string(),
            How::Unfiltered => format!("{}, unfiltered, colour-transformed", self.band),
            How::Declared => format!("{}, declared for filter {}, colour-transformed", self.band, self.light.filter),
        }
    }
}

/// Frames of one band and stars of another, in words.
fn other_band(light: &Light, from: &str, known: Band) -> String {
    format!(
        "the frames were taken through {}, but {from} holds magnitudes of band {known}: the result would be neither; name a \
         column of the filter's own band in stars.columns.v_mag, or declare that the colour term shall carry them to {known} \
         all the same\n[photometry]\nband = \"{known}\"",
        light.filter
    )
}
