//! SGP4/SDP4 in its AFSPC-compatible form only: WGS72 constants and the sidereal time the elements were fitted with.
//!
//! km, km/s and minutes, in TEME. The crate's default mode (WGS84, IAU sidereal time) is 218 m off after days and is
//! not used. Deep-space orbits below 11.5° inclination may be off by 1 km after hours ([`Propagator::caveat`]).

use hifitime::Epoch;
use sgp4::MinutesSinceEpoch;

use super::elements::Elements;
use super::time::{days_between, utc_text};
use crate::error::{Error, Result};
use crate::vector::{Teme, Vector};

/// Equatorial radius of WGS72, SGP4's Earth \[km\]: a state below it has decayed.
pub const SGP4_EARTH_RADIUS_KM: f64 = 6_378.135;

/// One element set, ready to give states.
pub struct Propagator {
    constants: sgp4::Constants,
    epoch: Epoch,
    label: String,
    lyddane: bool,
}

impl Propagator {
    /// Prepares the constants of one set.
    ///
    /// # Errors
    /// [`Error::Orbit`] if SGP4 refuses the elements.
    pub fn new(elements: &Elements) -> Result<Self> {
        let constants = sgp4::Constants::from_elements_afspc_compatibility_mode(&elements.inner)
            .map_err(|e| Error::Orbit { problem: format!("{}: SGP4 refuses the elements: {e}", elements.label()) })?;
        let lyddane = elements.period_min() > 225.0 && elements.inclination_deg() < 11.5;
        Ok(Self { constants, epoch: elements.epoch(), label: elements.label(), lyddane })
    }

    /// Position \[km\] and velocity \[km/s\] in TEME at `epoch`.
    ///
    /// # Errors
    /// [`Error::Orbit`] if SGP4 fails or the satellite has decayed.
    pub fn state(&self, epoch: &Epoch) -> Result<(Vector<Teme>, Vector<Teme>)> {
        self.state_after(days_between(&self.epoch, epoch) * 1_440.0).map_err(|e| match e {
            Error::Orbit { problem } => Error::Orbit { problem: format!("{problem} (at {})", utc_text(epoch)) },
            other => other,
        })
    }

    /// Position \[km\] and velocity \[km/s\] in TEME, `minutes` after the epoch of the elements.
    ///
    /// # Errors
    /// As [`Propagator::state`].
    pub fn state_after(&self, minutes: f64) -> Result<(Vector<Teme>, Vector<Teme>)> {
        let problem = |what: String| Error::Orbit { problem: format!("{}: {what}", self.label) };
        let p = self
            .constants
            .propagate_afspc_compatibility_mode(MinutesSinceEpoch(minutes))
            .map_err(|e| problem(format!("SGP4 failed: {e}")))?;
        let ([x, y, z], [vx, vy, vz]) = (p.position, p.velocity);
        let (position, velocity) = (Vector::new(x, y, z), Vector::new(vx, vy, vz));
        let r_km = position.norm();
        if !(r_km.is_finite() && velocity.norm().is_finite()) {
            return Err(problem(format!("SGP4 gives no finite state {minutes:.1} min after the elements")));
        }
        if r_km < SGP4_EARTH_RADIUS_KM {
            return Err(problem(format!(
                "decayed: {r_km:.0} km from the Earth's centre, below its radius, {:.1} d after the elements",
                minutes / 1_440.0
            )));
        }
        Ok((position, velocity))
    }

    /// A known weakness of the propagator for this orbit, in one sentence.
    #[must_use]
    pub fn caveat(&self) -> Option<String> {
        self.lyddane.then(|| {
            format!(
                "{}: deep-space orbit below 11.5 deg inclination, where this SGP4 may be off by 1 km after hours",
                self.label
            )
        })
    }
}

impl std::fmt::Debug for Propagator {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Propagator({} at {})", self.label, utc_text(&self.epoch))
    }
}
