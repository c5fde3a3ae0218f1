//! One stamp of time in a header, before it is chosen.

use hifitime::{Duration, Epoch, Unit};

use crate::tables::words::TimeStamp;

/// Which kind of stamp a time is from, the most trusted first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TimeKind {
    /// A keyword named in the configuration, or DATE-OBS as `time.date_obs_means` says.
    Configured,
    /// Shutter times of a GPS receiver.
    Gps,
    /// Start and end.
    StartEnd,
    /// The middle itself.
    Middle,
    /// Start (or end) and the exposure time.
    Start,
}

impl TimeKind {
    /// One word for tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            TimeKind::Configured => "configured",
            TimeKind::Gps => "gps",
            TimeKind::StartEnd => "start_end",
            TimeKind::Middle => "middle",
            TimeKind::Start => "start",
        }
    }
}

/// One way to the middle of the exposure.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub(super) mid: Epoch,
    pub(super) source: String,
    pub(super) kind: TimeKind,
    pub(super) stamp: TimeStamp,
    pub(super) err_s: f64,
}

/// A difference of whole quarters of an hour looks like a time zone.
pub(super) fn zone_hint(off_s: f64) -> String {
    let quarters = (off_s / 900.0).round();
    if quarters == 0.0 || (off_s - 900.0 * quarters).abs() > 60.0 || quarters.abs() > 14.0 * 4.0 {
        return String::new();
    }
    format!(": {:+} h, is one of them local time?", quarters / 4.0)
}

pub(super) fn seconds(s: f64) -> Duration {
    s * Unit::Second
}
