//! The queries of each service: one address per query, the same query always at the same address.
//!
//! Degrees and Julian days. It does not cover whether it may be sent now ([`super::client`]).

use std::borrow::Cow;

use hifitime::Epoch;

use crate::base::foreign::without_user;
use crate::config::Fetch;

/// The service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Service {
    /// CelesTrak: current elements.
    CelesTrak,
    /// SatChecker of the IAU CPS: elements of past nights.
    SatChecker,
    /// VizieR of the CDS: APASS DR9.
    Vizier,
}

impl Service {
    /// Its name in messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Service::CelesTrak => "CelesTrak",
            Service::SatChecker => "SatChecker",
            Service::Vizier => "VizieR",
        }
    }

    /// Its name in the cache.
    pub(super) fn stem(self) -> &'static str {
        match self {
            Service::CelesTrak => "celestrak",
            Service::SatChecker => "satchecker",
            Service::Vizier => "vizier",
        }
    }

    /// The key of its address.
    pub(super) fn key(self) -> &'static str {
        match self {
            Service::CelesTrak => "fetch.celestrak_url",
            Service::SatChecker => "fetch.satchecker_url",
            Service::Vizier => "fetch.vizier_url",
        }
    }

    /// How long an answer is not requested again \[h\]: CelesTrak's update period; a day for the archive of elements;
    /// for ever for APASS DR9, which is a finished release.
    pub(super) fn keep_h(self, settings: &Fetch) -> f64 {
        match self {
            Service::CelesTrak => settings.update_h,
            Service::SatChecker => settings.update_h.max(24.0),
            Service::Vizier => f64::INFINITY,
        }
    }

    /// How long a refusal or "there is nothing" is remembered \[h\].
    pub(super) fn refusal_h(self, settings: &Fetch) -> f64 {
        settings.update_h
    }
}

/// One question.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Query {
    /// The service.
    pub service: Service,
    /// The whole address.
    pub url: String,
}

impl Query {
    /// The address for messages and notes: without the password it may hold.
    #[must_use]
    pub fn shown(&self) -> Cow<'_, str> {
        without_user(&self.url)
    }
}

/// Which object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Object {
    /// By its catalogue number.
    Number(u64),
    /// By its name.
    Name(String),
}

impl Object {
    /// Short text for messages.
    #[must_use]
    pub fn label(&self) -> String {
        match self {
            Object::Number(number) => format!("object {number}"),
            Object::Name(name) => format!("\"{name}\""),
        }
    }
}

/// Current elements of an object: `gp.php?CATNR=25544&FORMAT=JSON`, or `FORMAT=TLE`.
///
/// FORMAT is always said, for the service has changed its default. TLE omits objects above 99999.
///
/// # Source
/// CelesTrak, "How to Perform GP Queries".
#[must_use]
pub fn celestrak_query(settings: &Fetch, object: &Object, tle: bool) -> Query {
    let which = match object {
        Object::Number(number) => format!("CATNR={number}"),
        Object::Name(name) => format!("NAME={}", encoded(name)),
    };
    let format = if tle { "TLE" } else { "JSON" };
    Query { service: Service::CelesTrak, url: format!("{}?{which}&FORMAT={format}", settings.celestrak_url) }
}

/// The elements nearest to a moment: `get-nearest-tle/?id=25544&id_type=catalog&epoch=2460836.0`, or
/// `get-nearest-omm/`.
///
/// The moment is given to 0.01 d, so that the frames of one night send one query.
///
/// # Source
/// SatChecker, "Orbital Data Access".
#[must_use]
pub fn satchecker_query(settings: &Fetch, object: &Object, at: &Epoch, omm: bool) -> Query {
    let (id, id_type) = match object {
        Object::Number(number) => (number.to_string(), "catalog"),
        Object::Name(name) => (encoded(name), "name"),
    };
    let base = settings.satchecker_url.trim_end_matches('/');
    let endpoint = if omm { "get-nearest-omm" } else { "get-nearest-tle" };
    let jd = at.to_jde_utc_days();
    Query { service: Service::SatChecker, url: format!("{base}/{endpoint}/?id={id}&id_type={id_type}&epoch={jd:.2}") }
}

/// Most rows taken of one field; a field that has more is refused, never cut.
pub(super) const MOST_STARS: usize = 500_000;
/// Columns that are requested.
const COLUMNS: [&str; 16] = [
    "recno", "RAJ2000", "DEJ2000", "nobs", "Vmag", "e_Vmag", "B-V", "e_B-V", "Bmag", "e_Bmag", "g'mag", "e_g'mag",
    "r'mag", "e_r'mag", "i'mag", "e_i'mag",
];

/// APASS DR9 (II/336/apass9) within `radius_deg` of a place (J2000).
///
/// # Source
/// CDS, "Summary of ASU qualifications for VizieR".
#[must_use]
pub fn apass_query(settings: &Fetch, ra_deg: f64, dec_deg: f64, radius_deg: f64) -> Query {
    let place = encoded(&format!("{ra_deg:.4} {dec_deg:+.4}"));
    let columns: String = COLUMNS.iter().map(|c| format!("&-out={}", encoded(c))).collect();
    let url = format!(
        "{}?-source=II/336/apass9&-c={place}&-c.eq=J2000&-c.r={radius_deg:.3}&-c.u=deg&-out.max={MOST_STARS}{columns}",
        settings.vizier_url
    );
    Query { service: Service::Vizier, url }
}

/// A value of an address: every byte but letters, digits and `-_.~` as `%XX`.
fn encoded(text: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-_.~".contains(&b);
    text.trim().bytes().map(|b| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_addresses_are_those_of_the_services_documentation() {
        let settings = Fetch::default();
        let iss = Object::Number(25544);
        assert_eq!(
            celestrak_query(&settings, &iss, false).url,
            "https://celestrak.org/NORAD/elements/gp.php?CATNR=25544&FORMAT=JSON"
        );
        let named = Object::Name("ISS (ZARYA)".into());
        assert!(celestrak_query(&settings, &named, true).url.ends_with("?NAME=ISS%20%28ZARYA%29&FORMAT=TLE"));
        // JD 2460000.0 is 2023-02-24T12:00 UTC
        let noon = Epoch::from_gregorian_utc_hms(2023, 2, 24, 12, 0, 0);
        assert_eq!(
            satchecker_query(&settings, &iss, &noon, false).url,
            "https://satchecker.cps.iau.org/tools/get-nearest-tle/?id=25544&id_type=catalog&epoch=2460000.00"
        );
        assert!(
            satchecker_query(&settings, &named, &noon, true).url.contains("/get-nearest-omm/?id=ISS%20%28ZARYA%29")
        );
        let url = apass_query(&settings, 174.5, 20.75, 0.5).url;
        assert!(url.starts_with("https://vizier.cds.unistra.fr/viz-bin/asu-tsv?-source=II/336/apass9&"), "{url}");
        assert!(url.contains("&-c=174.5000%20%2B20.7500&-c.eq=J2000&-c.r=0.500&-c.u=deg&"), "{url}");
        assert!(url.contains("&-out=g%27mag"), "{url}");
    }
}
