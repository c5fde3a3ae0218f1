//! `[fetch]`: which services `satphot fetch` queries, how long it waits and where it keeps answers. Nothing here changes a
//! magnitude.
//!
//! Seconds, hours and megabytes, as the keys say.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::layers::read_layers;
use super::range;
use crate::base::error::{Error, Result};
use crate::base::foreign::without_user;

/// Addresses, patience and cache of `satphot fetch`; every key has a default.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Fetch {
    /// Page or e-mail address sent to the services, so that they can write before they block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<String>,
    /// Folder of the answers; `$XDG_CACHE_HOME/satphot` or `~/.cache/satphot` if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cache: Option<PathBuf>,
    /// Current elements.
    #[serde(serialize_with = "public")]
    pub celestrak_url: String,
    /// Elements of past nights; `get-nearest-tle/` and `get-nearest-omm/` are put behind it.
    #[serde(serialize_with = "public")]
    pub satchecker_url: String,
    /// Stars: an ASU service of VizieR that answers tab-separated values.
    #[serde(serialize_with = "public")]
    pub vizier_url: String,
    /// Longest wait for a connection \[s\].
    pub connect_timeout_s: f64,
    /// Longest wait for a whole answer \[s\].
    pub timeout_s: f64,
    /// How often a query is repeated after a server error (5xx), a timeout or a broken connection.
    pub retries: u32,
    /// Wait before the first repetition \[s\]; doubled each time.
    pub backoff_s: f64,
    /// Longest wait requested by a server (Retry-After) that is waited for \[s\].
    pub max_wait_s: f64,
    /// Largest answer taken \[MB\].
    pub max_mb: f64,
    /// Current elements younger than this are not requested again \[h\]; CelesTrak renews them every 2 h.
    pub update_h: f64,
}

/// Addresses are written to files that are passed on: without the password they may hold.
fn public<S: serde::Serializer>(url: &str, out: S) -> std::result::Result<S::Ok, S::Error> {
    out.serialize_str(&without_user(url))
}

impl Default for Fetch {
    fn default() -> Self {
        Self {
            contact: None,
            cache: None,
            celestrak_url: "https://celestrak.org/NORAD/elements/gp.php".into(),
            satchecker_url: "https://satchecker.cps.iau.org/tools/".into(),
            vizier_url: "https://vizier.cds.unistra.fr/viz-bin/asu-tsv".into(),
            connect_timeout_s: 15.0,
            timeout_s: 120.0,
            retries: 2,
            backoff_s: 3.0,
            max_wait_s: 60.0,
            max_mb: 64.0,
            update_h: 2.0,
        }
    }
}

/// The table alone, for settings without a pipeline.toml.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Alone {
    fetch: Fetch,
}

impl Fetch {
    /// The defaults with `fetch.key=value` settings on top, where there is no pipeline.toml.
    ///
    /// # Errors
    /// [`Error::Config`] for a key outside of `[fetch]` or a value out of range.
    pub fn from_sets(sets: &[String]) -> Result<Self> {
        let alone: Alone = read_layers("", sets)?;
        alone.fetch.check()?;
        Ok(alone.fetch)
    }

    /// Whether nothing is said.
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Checks every value.
    ///
    /// # Errors
    /// [`Error::Config`] with the key, the value and what is accepted.
    pub fn check(&self) -> Result<()> {
        let bad = |key: &str, problem: String| Error::Config { key: format!("fetch.{key}"), problem };
        for (key, url) in [
            ("celestrak_url", &self.celestrak_url),
            ("satchecker_url", &self.satchecker_url),
            ("vizier_url", &self.vizier_url),
        ] {
            let host = url.strip_prefix("https://").or_else(|| url.strip_prefix("http://")).unwrap_or_default();
            let plain = url.bytes().all(|b| b.is_ascii_graphic()) && !url.contains(['?', '#', '"', '<', '>']);
            if host.trim_start_matches('/').is_empty() || !plain {
                return Err(bad(
                    key,
                    format!("\"{}\" is not an address such as https://example.org/path", without_user(url)),
                ));
            }
        }
        if let Some(contact) = &self.contact
            && (contact.trim().is_empty() || !contact.bytes().all(|b| b.is_ascii_graphic() && b != b'(' && b != b')'))
        {
            return Err(bad("contact", format!("\"{contact}\" is not an address in plain letters without blanks")));
        }
        range("fetch.connect_timeout_s", self.connect_timeout_s, 0.01, 600.0, "s")?;
        range("fetch.timeout_s", self.timeout_s, 0.01, 3_600.0, "s")?;
        range("fetch.retries", f64::from(self.retries), 0.0, 5.0, "")?;
        range("fetch.backoff_s", self.backoff_s, 0.0, 600.0, "s")?;
        range("fetch.max_wait_s", self.max_wait_s, 0.0, 3_600.0, "s")?;
        range("fetch.max_mb", self.max_mb, 0.001, 4_000.0, "MB")?;
        range("fetch.update_h", self.update_h, 2.0, 8_760.0, "h; CelesTrak renews its data every 2 h")
    }
}
