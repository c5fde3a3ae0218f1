//! Sessions at moments of our choosing: what was said, how long was waited, what came of it.

use std::cell::RefCell;
use std::path::Path;
use std::time::Duration;

use hifitime::Epoch;
use satphot::Error;
use satphot::base::time::parse_utc;
use satphot::config::Fetch;
use satphot::fetch::{Cache, Client, FetchedElements, Hooks, Object, Wanted, WhichService, fetch_elements};

use super::Server;

pub fn utc(text: &str) -> Epoch {
    parse_utc("t", text).unwrap()
}

/// Settings that ask `server` alone.
pub fn settings(server: &Server) -> Fetch {
    Fetch {
        celestrak_url: server.url("gp.php"),
        satchecker_url: server.url("tools/"),
        vizier_url: server.url("viz-bin/asu-tsv"),
        timeout_s: 20.0,
        retries: 2,
        backoff_s: 3.0,
        ..Fetch::default()
    }
}

/// One session: what was said, how long was waited, and the outcome.
pub struct Session {
    pub said: Vec<String>,
    pub waits_s: Vec<f64>,
    pub outcome: Result<FetchedElements, Error>,
}

impl Session {
    pub fn error(&self) -> &Error {
        self.outcome.as_ref().unwrap_err()
    }
    pub fn says(&self, words: &[&str]) {
        let text = format!(
            "{}\n{}",
            self.said.join("\n"),
            self.outcome.as_ref().err().map_or(String::new(), ToString::to_string)
        );
        assert!(words.iter().all(|w| text.contains(w)), "{words:?} not in:\n{text}");
    }
}

pub fn with_client<T>(
    settings: &Fetch,
    cache: &Path,
    now: &str,
    offline: bool,
    work: impl FnOnce(&Client) -> T,
) -> (T, Vec<String>, Vec<f64>) {
    let (said, waits) = (RefCell::new(Vec::new()), RefCell::new(Vec::new()));
    let wait = |d: Duration| waits.borrow_mut().push(d.as_secs_f64());
    let say = |t: &str| said.borrow_mut().push(t.to_owned());
    let outside = Hooks { wait: &wait, say: &say, environment: false };
    let client = Client::new(settings, Cache::new(cache), utc(now), offline, outside).unwrap();
    let value = work(&client);
    drop(client);
    (value, said.into_inner(), waits.into_inner())
}

pub fn session(settings: &Fetch, cache: &Path, now: &str, wanted: &Wanted) -> Session {
    let (outcome, said, waits_s) =
        with_client(settings, cache, now, false, |client| fetch_elements(client, wanted, settings));
    Session { said, waits_s, outcome }
}

pub fn iss(at: &str) -> Wanted {
    Wanted { object: Object::Number(25544), at: utc(at), service: WhichService::Auto, tle: false, max_age_d: 14.0 }
}

/// Fetches current elements of the ISS at `now`.
pub fn current(server: &Server, cache: &Path, now: &str) -> Session {
    session(&settings(server), cache, now, &iss(now))
}
