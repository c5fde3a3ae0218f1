//! One question over the network: timeouts, size, redirections, proxy, and patience with what passes.
//!
//! Repeated are server errors (5xx), timeouts and broken connections, at most `fetch.retries` times; a refusal (4xx)
//! never. Seconds and bytes. Of the environment: ALL_PROXY, HTTPS_PROXY or HTTP_PROXY, less NO_PROXY; SSL_CERT_FILE.

use std::io::Read;
use std::path::PathBuf;
use std::time::Duration;

use hifitime::Epoch;
use sgp4::chrono::DateTime;
use ureq::http::HeaderMap;
use ureq::tls::{PemItem, RootCerts, TlsConfig, parse_pem};

use crate::base::error::{Error, Result};
use crate::config::Fetch;

/// Redirections followed.
const REDIRECTS: u32 = 4;
/// Variables that name a proxy, in the order in which they are looked at.
const PROXIES: [&str; 6] = ["ALL_PROXY", "all_proxy", "HTTPS_PROXY", "https_proxy", "HTTP_PROXY", "http_proxy"];

/// What a server answered.
#[derive(Debug)]
pub struct Reply {
    /// HTTP status.
    pub status: u16,
    /// The answer, whole.
    pub body: Vec<u8>,
    /// Whether the server said how long the answer is, so that a cut would have been seen.
    pub framed: bool,
    /// How long the server asks to wait \[s\].
    pub retry_after_s: Option<f64>,
}

/// Why there is no answer.
#[derive(Debug)]
pub struct FetchError {
    /// A sentence.
    pub words: String,
    /// How long the server asks to be left alone \[s\], where that is too long to wait for.
    pub asked_s: Option<f64>,
}

/// The way out.
pub struct Link {
    agent: ureq::Agent,
    proxy: Option<ureq::Proxy>,
    settings: Fetch,
}

/// Why one try failed, and whether another may help.
struct Failure {
    words: String,
    passing: bool,
    wait_s: Option<f64>,
}

impl Link {
    /// With the patience of `[fetch]`, and with proxy and certificates of the `environment`.
    ///
    /// # Errors
    /// [`Error::Config`] for a proxy that is no address and a file without certificates; [`Error::Io`].
    pub fn new(settings: &Fetch, environment: bool) -> Result<Self> {
        for variable in PROXIES.into_iter().filter(|_| environment) {
            let Ok(value) = std::env::var(variable) else { continue };
            if !value.trim().is_empty() && ureq::Proxy::new(&value).is_err() {
                let problem = "is not a usable proxy; give http://HOST:PORT".into();
                return Err(Error::Config { key: format!("{variable} of the environment"), problem });
            }
        }
        let proxy = environment.then(ureq::Proxy::try_from_env).flatten();
        let roots = if environment { root_certificates()? } else { RootCerts::WebPki };
        let about = settings.contact.as_ref().map(|contact| format!(" (+{contact})")).unwrap_or_default();
        let agent = ureq::Agent::config_builder()
            .http_status_as_error(false)
            .user_agent(format!("satphot/{}{about}", env!("CARGO_PKG_VERSION")))
            .max_redirects(REDIRECTS)
            .timeout_resolve(Some(Duration::from_secs_f64(settings.connect_timeout_s)))
            .timeout_connect(Some(Duration::from_secs_f64(settings.connect_timeout_s)))
            .timeout_global(Some(Duration::from_secs_f64(settings.timeout_s)))
            .tls_config(TlsConfig::builder().root_certs(roots).build())
            .proxy(proxy.clone())
            .build()
            .into();
        Ok(Self { agent, proxy, settings: settings.clone() })
    }

    /// The answer at `url`; `now` is for dates the server names, `wait` is called between tries, `say` reports them.
    ///
    /// # Errors
    /// What went wrong and how often it was tried, and how long the server asks to wait where that is longer than
    /// `fetch.max_wait_s`.
    pub fn get(
        &self,
        url: &str,
        now: &Epoch,
        wait: &dyn Fn(Duration),
        say: &dyn Fn(&str),
    ) -> std::result::Result<Reply, FetchError> {
        let tries = self.settings.retries + 1;
        for k in 1..=tries {
            let failure = match self.once(url, now) {
                Ok(reply) if reply.status < 500 => return Ok(reply),
                Ok(reply) => Failure {
                    words: format!("HTTP {} of the server", reply.status),
                    passing: true,
                    wait_s: reply.retry_after_s,
                },
                Err(failure) => failure,
            };
            let asked_s = failure.wait_s.unwrap_or(0.0);
            let too_long = asked_s > self.settings.max_wait_s;
            if !failure.passing || k == tries || too_long {
                let times = if k > 1 { format!(" ({k} tries)") } else { String::new() };
                let words = format!("{}{times}{}", failure.words, self.by_proxy(url));
                return Err(FetchError { words, asked_s: too_long.then_some(asked_s) });
            }
            let pause_s = asked_s.max(self.settings.backoff_s * f64::from(1 << (k - 1)));
            say(&format!("{}; trying again in {pause_s:.0} s", failure.words));
            wait(Duration::from_secs_f64(pause_s));
        }
        Err(FetchError { words: "not tried".into(), asked_s: None })
    }

    fn once(&self, url: &str, now: &Epoch) -> std::result::Result<Reply, Failure> {
        let request = self.agent.get(url).config().https_only(url.starts_with("https://")).build();
        let mut response = request.call().map_err(|e| self.failure(e))?;
        let headers = response.headers();
        let framed = headers.contains_key("content-length") || headers.contains_key("transfer-encoding");
        let retry_after_s = retry_after_s(headers, now);
        let status = response.status().as_u16();
        let most = (self.settings.max_mb * 1e6) as u64;
        let mut body = Vec::new();
        let read = response.body_mut().as_reader().take(most + 1).read_to_end(&mut body);
        read.map_err(|e| self.failure(ureq::Error::from(e)))?;
        if body.len() as u64 > most {
            let words = format!(
                "the answer is larger than fetch.max_mb = {} MB and was not accepted; raise it or request less (for stars a \
                 smaller argument `radius_deg`)",
                self.settings.max_mb
            );
            return Err(Failure { words, passing: false, wait_s: None });
        }
        Ok(Reply { status, body, framed, retry_after_s })
    }

    fn failure(&self, error: ureq::Error) -> Failure {
        use std::io::ErrorKind;
        let (words, passing) = match error {
            ureq::Error::Timeout(what) => {
                let (key, limit_s) = match what {
                    ureq::Timeout::Resolve | ureq::Timeout::Connect => {
                        ("fetch.connect_timeout_s", self.settings.connect_timeout_s)
                    }
                    _ => ("fetch.timeout_s", self.settings.timeout_s),
                };
                (format!("no answer within {key} = {limit_s} s"), true)
            }
            ureq::Error::HostNotFound => ("the host is not found: is there a network?".into(), true),
            ureq::Error::Io(e) if e.kind() == ErrorKind::UnexpectedEof => {
                ("the connection ended in the middle of the answer".into(), true)
            }
            ureq::Error::Io(e) if e.kind() == ErrorKind::InvalidData => {
                (format!("{e}; behind a proxy that opens TLS SSL_CERT_FILE names its certificates"), false)
            }
            ureq::Error::Io(e) => (format!("no connection: {e}"), true),
            ureq::Error::ConnectionFailed => ("no connection".into(), true),
            ureq::Error::Protocol(e) => (format!("the answer is not HTTP: {e}"), true),
            ureq::Error::TooManyRedirects => (format!("more than {REDIRECTS} redirections"), false),
            ureq::Error::RequireHttpsOnly(to) => (format!("sent on from https to {to}, which is not followed"), false),
            ureq::Error::ConnectProxyFailed(e) => (format!("the proxy does not let it through: {e}"), false),
            other => (other.to_string(), false),
        };
        Failure { words, passing, wait_s: None }
    }

    /// Names the proxy, without the password it may hold.
    fn by_proxy(&self, url: &str) -> String {
        let Some(proxy) = &self.proxy else { return String::new() };
        if url.parse().is_ok_and(|uri| proxy.is_no_proxy(&uri)) {
            return String::new();
        }
        format!(" (by the proxy {}:{} of the environment)", proxy.host(), proxy.port())
    }
}

/// Mozilla's roots, or those of SSL_CERT_FILE: behind a proxy that opens TLS its own are needed.
fn root_certificates() -> Result<RootCerts> {
    let Some(path) = std::env::var_os("SSL_CERT_FILE").filter(|v| !v.is_empty()).map(PathBuf::from) else {
        return Ok(RootCerts::WebPki);
    };
    let pem = std::fs::read(&path).map_err(|e| Error::io(&path, e))?;
    let certificates: Vec<_> = parse_pem(&pem)
        .filter_map(|item| match item {
            Ok(PemItem::Certificate(certificate)) => Some(certificate),
            _ => None,
        })
        .collect();
    if certificates.is_empty() {
        let problem = format!("{} holds no certificates in PEM", path.display());
        return Err(Error::Config { key: "SSL_CERT_FILE of the environment".into(), problem });
    }
    Ok(RootCerts::new_with_certs(&certificates))
}

/// Retry-After: seconds, or a date as HTTP writes it \[s from `now`\].
fn retry_after_s(headers: &HeaderMap, now: &Epoch) -> Option<f64> {
    let text = headers.get("retry-after")?.to_str().ok()?.trim();
    let seconds = match text.parse::<u32>() {
        Ok(seconds) => f64::from(seconds),
        Err(_) => DateTime::parse_from_rfc2822(text).ok()?.timestamp() as f64 - now.to_unix_seconds(),
    };
    Some(seconds.max(0.0))
}
