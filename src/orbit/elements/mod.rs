//! Mean orbital elements of one object at one epoch.
//!
//! Days, minutes, degrees. Reading is in `read`, `orbit::tle`, `orbit::omm` and `xml`; which set fits an epoch in
//! `select`; sets that contradict each other in `neighbours`; propagation in `orbit::propagate`.

pub(super) mod neighbours;
mod read;
mod select;
pub(crate) mod set;
mod xml;

pub use set::Elements;

pub use read::elements_from_bytes;
pub use read::read_elements;
pub use read::read_elements_file;
pub use read::read_elements_for;
pub(super) use select::only_object;
pub use select::{check_age, element_names, nearest};
pub use set::DamagedSet;
pub use set::ElementsFile;

use hifitime::Epoch;
use sgp4::chrono::{Datelike, Timelike};

use super::time::days_between;
use super::tle;
use crate::base::error::{Error, Result};
use crate::base::foreign::shown;

/// Longest name of an object \[bytes\]: elements have 24, messages a line.
const MOST_LETTERS: usize = 200;

impl Elements {
    /// Wraps what the parser made, after checking the ranges SGP4 does not check. The problem is a sentence.
    pub(super) fn new(inner: sgp4::Elements, format: &'static str) -> std::result::Result<Self, String> {
        for (what, value, lo, hi, unit) in [
            ("eccentricity", inner.eccentricity, 0.0, 1.0 - 1e-9, ""),
            ("inclination", inner.inclination, 0.0, 180.0, " deg"),
            ("right ascension of the node", inner.right_ascension, -360.0, 360.0, " deg"),
            ("argument of perigee", inner.argument_of_perigee, -360.0, 360.0, " deg"),
            ("mean anomaly", inner.mean_anomaly, -360.0, 360.0, " deg"),
            ("mean motion", inner.mean_motion, 1e-6, 20.0, " revolutions per day"),
            ("B*", inner.drag_term, -10.0, 10.0, " per Earth radius"),
        ] {
            if !(lo..=hi).contains(&value) {
                return Err(format!("{what} {value}{unit} is outside {lo} to {hi}"));
            }
        }
        let letters = inner.object_name.as_deref().unwrap_or("").len();
        if letters > MOST_LETTERS {
            return Err(format!("the name has {letters} letters, more than {MOST_LETTERS}: this is not a name"));
        }
        let t = inner.datetime;
        if !(1957..=2200).contains(&t.year()) {
            return Err(format!("epoch {t} is outside the years 1957 to 2200"));
        }
        // chrono writes a leap second as nanosecond >= 10⁹ of second 59.
        let (second, ns) = if t.nanosecond() >= 1_000_000_000 {
            (60, t.nanosecond() - 1_000_000_000)
        } else {
            (t.second(), t.nanosecond())
        };
        let epoch = Epoch::maybe_from_gregorian_utc(
            t.year(),
            t.month() as u8,
            t.day() as u8,
            t.hour() as u8,
            t.minute() as u8,
            second as u8,
            ns,
        )
        .map_err(|e| format!("epoch {t}: {e}"))?;
        let trimmed = |s: &Option<String>| shown(s.as_deref().unwrap_or("").trim()).into_owned();
        let (name, object_id) = (trimmed(&inner.object_name), trimmed(&inner.international_designator));
        Ok(Self { inner, name, object_id, epoch, format })
    }

    /// One set from its two lines of 69 characters and a name (empty for none).
    ///
    /// # Errors
    /// [`Error::Orbit`] with the field that is wrong; for a checksum, the one that was expected.
    pub fn from_tle(name: &str, line1: &str, line2: &str) -> Result<Self> {
        tle::parse_set(name, line1, line2).map_err(|(_, problem)| Error::Orbit { problem })
    }

    /// Name of the object; empty if the file has none.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }
    /// Catalogue number.
    #[must_use]
    pub fn norad_cat_id(&self) -> u64 {
        self.inner.norad_id
    }
    /// International designator in COSPAR form, `1998-067A`; empty if the set has none.
    #[must_use]
    pub fn object_id(&self) -> &str {
        &self.object_id
    }
    /// Epoch of the elements.
    #[must_use]
    pub fn epoch(&self) -> Epoch {
        self.epoch
    }
    /// Format the set was read from: `TLE`, `3LE`, `OMM JSON`, `OMM KVN`, `OMM CSV` or `OMM XML`.
    #[must_use]
    pub fn format(&self) -> &str {
        self.format
    }
    /// Period from the (Kozai) mean motion \[min\].
    #[must_use]
    pub fn period_min(&self) -> f64 {
        1_440.0 / self.inner.mean_motion
    }
    /// Eccentricity.
    #[must_use]
    pub fn eccentricity(&self) -> f64 {
        self.inner.eccentricity
    }
    /// Inclination \[deg\].
    #[must_use]
    pub fn inclination_deg(&self) -> f64 {
        self.inner.inclination
    }

    /// Height of the perigee above the equatorial radius \[km\]: a (1 − e) − R with a = (GM/n²)^⅓, of WGS72 as in SGP4.
    #[must_use]
    pub fn perigee_height_km(&self) -> f64 {
        const GM_KM3_S2: f64 = 398_600.8;
        let n_rad_s = std::f64::consts::TAU / (self.period_min() * 60.0);
        let a_km = (GM_KM3_S2 / (n_rad_s * n_rad_s)).cbrt();
        a_km * (1.0 - self.eccentricity()) - crate::base::constants::SGP4_EARTH_RADIUS_KM
    }

    /// Age at `epoch` \[d\]: positive when the elements are older than the epoch, negative when newer.
    #[must_use]
    pub fn age_d(&self, epoch: &Epoch) -> f64 {
        days_between(&self.epoch, epoch)
    }

    /// Short text for messages: `ISS (ZARYA) [25544]`.
    #[must_use]
    pub fn label(&self) -> String {
        if self.name.is_empty() {
            format!("[{}]", self.norad_cat_id())
        } else {
            format!("{} [{}]", self.name, self.norad_cat_id())
        }
    }
}
