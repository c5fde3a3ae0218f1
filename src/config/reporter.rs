//! `[reporter]`: who reports and with what, for files sent to archives. Nothing here changes a magnitude.

use serde::{Deserialize, Serialize};

/// Who reports. All of it can be given to `satphot export` as options, which win.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Reporter {
    /// Organisation that sends the file: ORIGINATOR of a TDM, `source` of the UDL.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub organisation: Option<String>,
    /// Name of the station: PARTICIPANT_1 of a TDM, `origSensorId` of the UDL; the name of the site if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub station: Option<String>,
    /// E-mail address of the observer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub email: Option<String>,
    /// ORCID of each observer, `0000-0002-1825-0097`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub orcid: Vec<String>,
    /// Telescope and camera in words; telescope.name and detector.camera if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instrument: Option<String>,
    /// VISUAL, BINOCULARS, CCD, CMOS or OTHER.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub observing_mode: Option<String>,
    /// Filter in words; from the header and the band of the magnitudes if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filter: Option<String>,
    /// Observatory code of the Minor Planet Center.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mpc_code: Option<String>,
    /// Where the frames can be had (URL).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub data_archive_link: Option<String>,
    /// Four-digit station number of the visual observers (IOD).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iod_station: Option<String>,
}

impl Reporter {
    /// Whether nothing is said.
    pub(super) fn is_silent(&self) -> bool {
        *self == Self::default()
    }

    /// This reporter, filled from `other` where it says nothing.
    #[must_use]
    pub fn or(self, other: &Reporter) -> Self {
        let either = |own: Option<String>, other: &Option<String>| own.or_else(|| other.clone());
        Self {
            organisation: either(self.organisation, &other.organisation),
            station: either(self.station, &other.station),
            email: either(self.email, &other.email),
            orcid: if self.orcid.is_empty() { other.orcid.clone() } else { self.orcid },
            instrument: either(self.instrument, &other.instrument),
            observing_mode: either(self.observing_mode, &other.observing_mode),
            filter: either(self.filter, &other.filter),
            mpc_code: either(self.mpc_code, &other.mpc_code),
            data_archive_link: either(self.data_archive_link, &other.data_archive_link),
            iod_station: either(self.iod_station, &other.iod_station),
        }
    }
}
