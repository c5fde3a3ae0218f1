//! SGP4/SDP4 in its AFSPC-compatible form only: WGS72 constants and the sidereal time the elements were fitted with.
//!
//! km, km/s and minutes, in TEME. The crate's default mode (WGS84, IAU sidereal time) is 218 m off after days and is
//! not used. Deep-space orbits below 11.5° inclination may be off by 1 km after hours ([`Propagator::caveat`]).

use crate::base::constants::SGP4_EARTH_RADIUS_KM;
use hifitime::Epoch;
use sgp4::MinutesSinceEpoch;

use super::elements::Elements;
use super::time::{days_between, utc_text};
use crate::base::error::{Error, Result};
use crate::base::vector::{Teme, Vector};

/// Below this height nothing stays in orbit \[km\]: drag takes it down within the revolution.
pub const DECAYED_BELOW_KM: f64 = 100.0;

/// One element set, ready to give states.
pub struct Propagator {
    constants: sgp4::Constants,
    epoch: Epoch,
    label: String,
    lyddane: bool,
    perigee_km: f64,
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
        Ok(Self {
            constants,
            epoch: elements.epoch(),
            label: elements.label(),
            lyddane,
            perigee_km: elements.perigee_height_km(),
        })
    }

    /// Position \[km\] and velocity \[km/s\] in TEME at `epoch`.
    ///
    /// # Errors
    /// [`Error::Orbit`] if SGP4 fails or the satellite has decayed: it would be lower than [`DECAYED_BELOW_KM`].
    pub fn state(&self, epoch: &Epoch) -> Result<(Vector<Teme>, Vector<Teme>)> {
        let at_epoch = |problem: String| Error::Orbit { problem: format!("{problem} (at {})", utc_text(epoch)) };
        let minutes = days_between(&self.epoch, epoch) * 1_440.0;
        let state = self.state_after(minutes).map_err(|e| match e {
            Error::Orbit { problem } => at_epoch(problem),
            other => other,
        })?;
        let height_km = state.0.norm() - SGP4_EARTH_RADIUS_KM;
        if height_km < DECAYED_BELOW_KM {
            return Err(at_epoch(format!(
                "{}: decayed: it would be {height_km:.0} km above the Earth's radius, where nothing stays in orbit, {:.1} d \
                 after its elements; take elements nearer to the time, or another satellite",
                self.label,
                minutes / 1_440.0
            )));
        }
        Ok(state)
    }

    /// Position \[km\] and velocity \[km/s\] in TEME, `minutes` after the epoch of the elements.
    ///
    /// # Errors
    /// As [`Propagator::state`].
    pub fn state_after(&self, minutes: f64) -> Result<(Vector<Teme>, Vector<Teme>)> {
        let problem = |what: String| Error::Orbit { problem: format!("{}: {what}", self.label) };
        let p = self.constants.propagate_afspc_compatibility_mode(MinutesSinceEpoch(minutes)).map_err(|e| {
            // the model of drag ends so before the satellite does
            let decayed = "; its perigee is so low that it has decayed: take elements nearer to the time";
            let low = if self.perigee_km < 200.0 { decayed } else { "" };
            problem(format!("SGP4 failed: {e}{low}"))
        })?;
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

    /// What to know about this orbit or the propagator's weakness for it, in one sentence.
    #[must_use]
    pub fn caveat(&self) -> Option<String> {
        if self.perigee_km < DECAYED_BELOW_KM {
            return Some(format!(
                "{}: the perigee of these elements is {:.0} km above the Earth's radius: it decays, or the set is wrong",
                self.label, self.perigee_km
            ));
        }
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
