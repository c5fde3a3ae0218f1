//! One satellite over one site: from an epoch to the whole [`Geometry`].
//!
//! Holds every element set of the object, ready to propagate, and uses the nearest in time. Radians and km.

use std::path::Path;

use hifitime::Epoch;

use super::earth::{EarthOrientation, Site, alt_az, teme_to_itrs};
use super::elements::neighbours::{Standing, standings};
use super::elements::{Elements, check_age, element_names, elements_from_bytes, only_object, read_elements_for};
use super::geometry::{Geometry, alt_az_range, geometry};
use super::propagate::Propagator;
use super::sky::{SkyBodies, altaz_to_icrs, bodies, topocentric};
use crate::base::constants::SPEED_OF_LIGHT_KM_S;
use crate::base::error::{Error, Result};
use crate::config;

/// One satellite over one site.
///
/// ```
/// use satphot::{Site, Tracker};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let elements = "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996
/// 2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748";
/// let tracker = Tracker::from_text(elements, Site::new(-33.7703, 151.1113, 70.0)?)?;
/// let geometry = tracker.at(&"2025-06-09T10:33:12 UTC".parse()?)?;
/// assert!((geometry.range_km - 748.7).abs() < 0.1);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Tracker {
    /// Of one object, in order of epoch; without those that their neighbours refute.
    sets: Vec<Elements>,
    propagators: Vec<Propagator>,
    standings: Vec<Standing>,
    /// What is known about the sets that are not used: their epoch and why.
    refuted: Vec<(Epoch, String)>,
    /// Names of the other objects of the file.
    others: Vec<String>,
    site: Site,
    eop: EarthOrientation,
    max_age_d: f64,
    force_age: bool,
    /// Damaged sets of other objects in the file.
    file_warnings: Vec<String>,
}

impl Tracker {
    /// From `[orbit]` and `[site]`.
    ///
    /// # Errors
    /// Those of [`read_elements_for`]; [`Error::Orbit`] for several objects and no number, or elements SGP4 refuses.
    #[doc(hidden)]
    pub fn from_config(orbit: &config::Orbit, site: &config::Site) -> Result<Self> {
        let (sets, warnings) = read_elements_for(&orbit.elements, orbit.norad_cat_id)?;
        let eop = EarthOrientation::from_config(orbit);
        let tracker = Self::new(sets, orbit.norad_cat_id, Site::from_config(site)?, eop)?;
        Ok(Self { max_age_d: orbit.max_age_d, force_age: orbit.force_age, file_warnings: warnings, ..tracker })
    }

    /// From element sets; elements older than 14 d are refused.
    ///
    /// # Errors
    /// As [`Tracker::from_config`].
    #[doc(hidden)]
    pub fn new(sets: Vec<Elements>, norad: Option<u64>, site: Site, eop: EarthOrientation) -> Result<Self> {
        only_object(&sets, norad)?;
        let (mut sets, others): (Vec<_>, Vec<_>) =
            sets.into_iter().partition(|e| norad.is_none_or(|n| n == e.norad_cat_id()));
        sets.sort_by_key(Elements::epoch);
        let propagators = sets.iter().map(Propagator::new).collect::<Result<Vec<_>>>()?;
        let standings = standings(&sets, &propagators);
        let mut tracker = Self {
            sets: Vec::new(),
            propagators: Vec::new(),
            standings: Vec::new(),
            refuted: Vec::new(),
            others: element_names(&others),
            site,
            eop,
            max_age_d: 14.0,
            force_age: false,
            file_warnings: Vec::new(),
        };
        for ((set, propagator), standing) in sets.into_iter().zip(propagators).zip(standings) {
            if let Standing::Refuted(why) = standing {
                tracker.refuted.push((set.epoch(), why));
                continue;
            }
            tracker.sets.push(set);
            tracker.propagators.push(propagator);
            tracker.standings.push(standing);
        }
        Ok(tracker)
    }

    /// From the text of a file of elements: TLE, 3LE, OMM (JSON, KVN, CSV, XML), of one object.
    ///
    /// Elements older than 14 d are refused; Earth orientation is that of the embedded table.
    ///
    /// # Errors
    /// [`Error::Table`] for a damaged set; [`Error::Orbit`] for several objects, or elements SGP4 refuses.
    pub fn from_text(elements: &str, site: Site) -> Result<Self> {
        let sets = elements_from_bytes(elements.as_bytes().to_vec(), Path::new("elements"))?;
        Self::new(sets, None, site, EarthOrientation::default())
    }

    /// The same with another limit to the age of the elements \[d\]; `force` uses older ones all the same.
    #[doc(hidden)]
    #[must_use]
    pub fn with_age_limit(self, max_age_d: f64, force: bool) -> Self {
        Self { max_age_d, force_age: force, ..self }
    }

    /// Every way a header may name the satellite.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        element_names(&self.sets)
    }

    /// Every way a header may name the other satellites of the file of elements.
    #[doc(hidden)]
    #[must_use]
    pub fn others(&self) -> &[String] {
        &self.others
    }

    /// Name (empty for none) and catalogue number of the satellite.
    #[must_use]
    pub fn object(&self) -> (&str, u64) {
        let named = self.sets.iter().find(|e| !e.name().is_empty()).or_else(|| self.sets.first());
        named.map_or(("", 0), |e| (e.name(), e.norad_cat_id()))
    }

    /// The site.
    #[must_use]
    pub fn site(&self) -> &Site {
        &self.site
    }

    /// The Earth orientation in use.
    #[doc(hidden)]
    #[must_use]
    pub fn earth_orientation(&self) -> &EarthOrientation {
        &self.eop
    }

    /// The elements used at `epoch`: the nearest in time.
    ///
    /// # Errors
    /// [`Error::Orbit`] if they are too old, or another set of the same days lies in another plane, and neither is
    /// forced.
    #[doc(hidden)]
    pub fn elements_at(&self, epoch: &Epoch) -> Result<&Elements> {
        self.index_at(epoch).map(|i| &self.sets[i])
    }

    /// The whole geometry at `epoch`.
    ///
    /// # Errors
    /// [`Error::Orbit`] if the elements are too old, SGP4 fails, or the satellite has decayed.
    pub fn at(&self, epoch: &Epoch) -> Result<Geometry> {
        self.at_under(epoch, &bodies(epoch, &self.eop)?)
    }

    /// The same with the Sun and the Moon of that moment, for many satellites at one moment.
    ///
    /// # Errors
    /// As [`Tracker::at`].
    #[doc(hidden)]
    pub fn at_under(&self, epoch: &Epoch, sky: &SkyBodies) -> Result<Geometry> {
        let i = self.index_at(epoch)?;
        let state = self.propagators[i].state(epoch)?;
        geometry(&self.site, &self.eop, epoch, &state, sky, self.sets[i].age_d(epoch))
    }

    /// Where the satellite stands among the stars \[deg\]: ICRS right ascension and declination as a catalogue of stars gives
    /// them, topocentric, with the time its light takes: `r(t − τ)`, τ = range/c, without aberration.
    ///
    /// # Errors
    /// As [`Tracker::at`].
    pub fn icrs_at(&self, epoch: &Epoch) -> Result<(f64, f64)> {
        let (position_km, velocity_km_s) = self.propagators[self.index_at(epoch)?].state(epoch)?;
        let (_, _, range_km) = alt_az_range(&self.site, &self.eop, epoch, &position_km);
        let then_km = position_km - velocity_km_s * (range_km / SPEED_OF_LIGHT_KM_S);
        let line = topocentric(&self.site, &teme_to_itrs(epoch, &self.eop).apply(&then_km));
        let (alt_rad, az_rad) = alt_az(&self.site.to_enu(&line));
        Ok(altaz_to_icrs(&self.site, &self.eop, epoch, alt_rad, az_rad))
    }

    /// The same from another site, with the Sun and the Moon of that moment.
    ///
    /// # Errors
    /// As [`Tracker::at`].
    #[doc(hidden)]
    pub fn at_from(&self, site: &Site, epoch: &Epoch) -> Result<Geometry> {
        let i = self.index_at(epoch)?;
        let state = self.propagators[i].state(epoch)?;
        geometry(site, &self.eop, epoch, &state, &bodies(epoch, &self.eop)?, self.sets[i].age_d(epoch))
    }

    /// Altitude \[rad\] alone: a hundred times cheaper than [`Tracker::at`].
    ///
    /// # Errors
    /// As [`Tracker::at`].
    pub fn altitude_at(&self, epoch: &Epoch) -> Result<f64> {
        let i = self.index_at(epoch)?;
        let (position_km, _) = self.propagators[i].state(epoch)?;
        Ok(alt_az_range(&self.site, &self.eop, epoch, &position_km).0)
    }

    /// What to tell the observer about the elements used at `epoch`: old, contradicted by a neighbour, or of an orbit
    /// the propagator is weak in. `None` when all is well.
    #[must_use]
    pub fn age_warning(&self, epoch: &Epoch) -> Option<String> {
        let i = self.nearest_index(epoch)?;
        // too old ones are refused with the same words
        let age = check_age(&self.sets[i], epoch, self.max_age_d, self.force_age).ok().flatten();
        let contradiction = match &self.standings[i] {
            Standing::Doubted(why) => {
                Some(format!("{why}: the satellite has burnt its engines, or one of them is wrong"))
            }
            Standing::Disputed(why) => Some(format!("{why}: one of them is wrong")),
            Standing::Good | Standing::Refuted(_) => None,
        };
        // Reported where the refuted set would have been the nearest.
        let age_d = self.sets[i].age_d(epoch).abs();
        let nearer = |at: &Epoch| super::time::days_between(at, epoch).abs() <= age_d;
        let refuted = self.refuted.iter().find(|(at, _)| nearer(at)).map(|(_, why)| {
            format!("{why}: the first is not used, its neighbours agree with each other and not with it")
        });
        let of_file = self.file_warnings.iter().cloned();
        let warnings: Vec<String> =
            [age, contradiction, refuted, self.propagators[i].caveat(), self.eop.warning(epoch)]
                .into_iter()
                .flatten()
                .chain(of_file)
                .collect();
        (!warnings.is_empty()).then(|| warnings.join("; "))
    }

    /// Smallest step in which the satellite's altitude has no hidden turn \[s\]: a share of the period, smaller for
    /// eccentric orbits, whose perigee passes quickly.
    pub(super) fn safe_step_s(&self) -> f64 {
        let fastest = |e: &Elements| e.period_min() * 60.0 / 120.0 * (1.0 - e.eccentricity()).powf(1.5);
        self.sets.iter().map(fastest).fold(f64::INFINITY, f64::min).clamp(1.0, 300.0)
    }

    /// The longest period of the sets \[s\].
    pub(super) fn longest_period_s(&self) -> f64 {
        self.sets.iter().map(|e| 60.0 * e.period_min()).fold(0.0, f64::max)
    }

    fn nearest_index(&self, epoch: &Epoch) -> Option<usize> {
        let after = self.sets.partition_point(|e| e.epoch() <= *epoch);
        [after.wrapping_sub(1), after]
            .into_iter()
            .filter(|&i| i < self.sets.len())
            .min_by(|&a, &b| self.sets[a].age_d(epoch).abs().total_cmp(&self.sets[b].age_d(epoch).abs()))
    }

    fn index_at(&self, epoch: &Epoch) -> Result<usize> {
        let i = self
            .nearest_index(epoch)
            .ok_or_else(|| Error::Orbit { problem: "no element sets; give a file in orbit.elements".to_owned() })?;
        check_age(&self.sets[i], epoch, self.max_age_d, self.force_age)?;
        match &self.standings[i] {
            Standing::Disputed(why) if !self.force_age => Err(Error::Orbit {
                problem: format!(
                    "{why}: one of them is wrong; take the wrong one out of the file, or set orbit.force_age = true to use \
                     the nearest"
                ),
            }),
            _ => Ok(i),
        }
    }
}
