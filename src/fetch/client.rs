//! One query, sent only if it must be: first the cache, then the network; an answer is checked before it is kept.
//!
//! Within a service's update period an answer, a "nothing" and a refusal are not requested again. After a refusal (403,
//! 429) the whole service is left alone for that long. Hours. It does not cover which queries there are
//! ([`super::query`]).

use std::time::Duration;

use hifitime::Epoch;

use super::answers::{Content, words};
use super::cache::{Cache, CachedAnswer, Found};
use super::http::{HttpClient, Reply};
use super::query::{Query, Service};
use crate::base::error::{Error, Result};
use crate::base::time::{iso_utc, seconds_between, shifted};
use crate::config::Fetch;

/// A clock that runs back by less than this is a clock that was set \[s\].
const CLOCK_SLACK_S: f64 = 300.0;

/// What the program lends: how to wait, and whom to tell.
pub struct Hooks<'a> {
    /// Waits between tries.
    pub wait: &'a dyn Fn(Duration),
    /// Progress: each request before it is made, each wait.
    pub say: &'a dyn Fn(&str),
    /// Whether proxies and certificates of the environment are used.
    pub environment: bool,
}

/// What was found out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer {
    /// A checked answer.
    Data(Vec<u8>),
    /// The service has nothing; its words.
    Nothing(String),
}

/// Asks politely.
pub struct Client<'a> {
    settings: Fetch,
    cache: Cache,
    http: HttpClient,
    now: Epoch,
    offline: bool,
    outside: Hooks<'a>,
}

impl<'a> Client<'a> {
    /// A desk at the moment `now`; `offline`: the cache alone answers.
    ///
    /// # Errors
    /// [`Error::Config`] for a proxy or a file of certificates of the environment that cannot be used.
    pub fn new(settings: &Fetch, cache: Cache, now: Epoch, offline: bool, outside: Hooks<'a>) -> Result<Self> {
        Ok(Self {
            settings: settings.clone(),
            cache,
            http: HttpClient::new(settings, outside.environment)?,
            now,
            offline,
            outside,
        })
    }

    /// The moment.
    #[must_use]
    pub fn now(&self) -> &Epoch {
        &self.now
    }

    /// The answer to a query; `check` says what a reply with status 200 holds.
    ///
    /// # Errors
    /// [`Error::Temporary`] for everything that may pass: no connection, a server in trouble, a refusal, an answer that
    /// is not what was requested; offline [`Error::Orbit`] or [`Error::Catalogue`] for what the cache does not hold.
    pub fn fetch(
        &self,
        query: &Query,
        check: &dyn Fn(&[u8], bool) -> std::result::Result<Content, String>,
    ) -> Result<Answer> {
        // one process at a time: the second finds the answer of the first
        let _lock = if self.offline { None } else { self.cache.lock(query.service) };
        let kept = match self.cache.find(query) {
            Found::Missing => None,
            Found::Damaged(problem) => {
                self.tell(&format!("the cache is damaged, its answer is not used: {problem}"));
                None
            }
            Found::CachedAnswer(kept) => Some(kept),
        };
        if let Some(kept) = &kept
            && (self.offline || self.is_fresh(query, kept))
        {
            self.tell(&format!("{} of {} from the cache", query.service.name(), iso_utc(kept.fetched, 0)));
            return Ok(answer_of(kept));
        }
        if self.offline {
            let url = query.shown();
            let problem = format!("are not in the cache; without argument `offline` they are fetched: {url}");
            return Err(match query.service {
                Service::Vizier => Error::Catalogue {
                    path: self.cache.folder().to_owned(),
                    problem: format!("the requested stars {problem}"),
                },
                _ => Error::Orbit {
                    problem: format!("the requested elements {problem} (cache: {})", self.cache.folder().display()),
                },
            });
        }
        if let Some((until, why)) = self.cache.refusal(query.service, &self.now) {
            return Err(self.later(query, &why, &until));
        }
        (self.outside.say)(&format!("requesting {}: {}", query.service.name(), query.shown()));
        let reply = self.http.get(&query.url, &self.now, self.outside.wait, self.outside.say).map_err(|t| {
            match t.retry_after_s {
                Some(_) => self.refused(query, &t.words, t.retry_after_s),
                None => self.trouble(query, &t.words, kept.as_ref()),
            }
        })?;
        self.judge(query, &reply, kept, check)
    }

    /// What a reply means, and what is kept of it.
    fn judge(
        &self,
        query: &Query,
        reply: &Reply,
        kept: Option<CachedAnswer>,
        check: &dyn Fn(&[u8], bool) -> std::result::Result<Content, String>,
    ) -> Result<Answer> {
        let content = match reply.status {
            200 => check(&reply.body, reply.framed),
            // CelesTrak says so with 403 as with 200
            403 if Content::not_updated(&reply.body) => Ok(Content::NotUpdated),
            404 => Ok(Content::Nothing(format!("HTTP 404, {}", words(&reply.body)))),
            status => Err(format!("HTTP {status}, {}", words(&reply.body))),
        };
        match content {
            Ok(Content::Data) => {
                self.noted(self.cache.keep(query, &reply.body, None, &self.now));
                Ok(Answer::Data(reply.body.clone()))
            }
            Ok(Content::Nothing(said)) => {
                self.noted(self.cache.keep(query, b"", Some(&said), &self.now));
                Ok(Answer::Nothing(said))
            }
            Ok(Content::NotUpdated) => match kept {
                Some(kept) => {
                    self.noted(self.cache.still_current(query, &kept, &self.now));
                    self.tell(&format!("nothing newer than the answer of {} in the cache", iso_utc(kept.fetched, 0)));
                    Ok(answer_of(&kept))
                }
                None => {
                    let why = format!("it gave this answer to someone at this address before: {}", words(&reply.body));
                    Err(self.refused(query, &why, None))
                }
            },
            Err(why) if matches!(reply.status, 403 | 429) => Err(self.refused(query, &why, reply.retry_after_s)),
            Err(why) => Err(self.trouble(query, &why, kept.as_ref())),
        }
    }

    /// Leaves the service alone from now on, for as long as it requests or its data live.
    fn refused(&self, query: &Query, why: &str, retry_after_s: Option<f64>) -> Error {
        // a day at most: a server that requires more is broken or means that a person should look
        let hours = retry_after_s.map_or(query.service.refusal_h(&self.settings), |s| (s / 3600.0).min(24.0));
        let until = shifted(self.now, 3600.0 * hours);
        self.noted(self.cache.refuse(query.service, &until, why));
        self.later(query, why, &until)
    }

    fn later(&self, query: &Query, why: &str, until: &Epoch) -> Error {
        let (name, until) = (query.service.name(), iso_utc(*until, 0));
        Error::Temporary {
            problem: format!("{name} refuses: {why}; it is left alone until {until}: try again after that"),
        }
    }

    fn trouble(&self, query: &Query, why: &str, kept: Option<&CachedAnswer>) -> Error {
        let old =
            kept.map(|k| format!("; argument `offline` uses the answer of {} in the cache", iso_utc(k.fetched, 0)));
        let name = query.service.name();
        let (url, key) = (query.shown(), query.service.key());
        let problem =
            format!("{name}: {why}, at {url} ({key}); nothing was changed, try again later{}", old.unwrap_or_default());
        Error::Temporary { problem }
    }

    fn is_fresh(&self, query: &Query, kept: &CachedAnswer) -> bool {
        let keep_h = match kept.nothing {
            Some(_) => query.service.refusal_h(&self.settings),
            None => query.service.keep_h(&self.settings),
        };
        (-CLOCK_SLACK_S..3600.0 * keep_h).contains(&seconds_between(kept.checked, self.now))
    }

    /// A cache that cannot be written is a pity, not an error.
    fn noted(&self, written: Result<()>) {
        if let Err(error) = written {
            self.tell(&format!("the answer is not kept in the cache ({error}); argument `cache` names another folder"));
        }
    }

    fn tell(&self, text: &str) {
        (self.outside.say)(&format!("note: {text}"));
    }
}

fn answer_of(kept: &CachedAnswer) -> Answer {
    match &kept.nothing {
        Some(said) => Answer::Nothing(said.clone()),
        None => Answer::Data(kept.bytes.clone()),
    }
}
