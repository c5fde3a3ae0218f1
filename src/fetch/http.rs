//! One question over the network: timeouts, size, redirections, proxy, and patience with what passes.
//!
//! Repeated are server errors (5xx), timeouts and broken connections, at most `fetch.retries` times; a refusal (4xx)
//! never. Seconds and bytes. Of the environment: ALL_PROXY, HTTPS_PROXY or HTTP_PROXY, less NO_PROXY; SSL_CERT_FILE.

use std::io::Read;
use std::net::{IpAddr, ToSocketAddrs};
use std::path::PathBuf;
use std::time::Duration;

use hifitime::Epoch;
use sgp4::chrono::DateTime;
use ureq::http::{HeaderMap, Uri};
use ureq::tls::{PemItem, RootCerts, TlsConfig, parse_pem};

use crate::base::error::{Error, Result};
use crate::base::foreign::without_user;
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
    /// How long the server requests to wait \[s\].
    pub retry_after_s: Option<f64>,
}

/// Why there is no answer.
#[derive(Debug)]
pub struct FetchError {
    /// A sentence.
    pub words: String,
    /// How long the server requests to be left alone \[s\], where that is too long to wait for.
    pub retry_after_s: Option<f64>,
}

/// The HTTP client.
pub struct HttpClient {
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

impl HttpClient {
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
            .max_redirects(0)
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
    /// What went wrong and how often it was tried, and how long the server requests to wait where that is longer than
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
            let retry_after_s = failure.wait_s.unwrap_or(0.0);
            let too_long = retry_after_s > self.settings.max_wait_s;
            if !failure.passing || k == tries || too_long {
                let times = if k > 1 { format!(" ({k} tries)") } else { String::new() };
                let words = format!("{}{times}{}", failure.words, self.by_proxy(url));
                return Err(FetchError { words, retry_after_s: too_long.then_some(retry_after_s) });
            }
            let pause_s = retry_after_s.max(self.settings.backoff_s * f64::from(1 << (k - 1)));
            say(&format!("{}; trying again in {pause_s:.0} s", failure.words));
            wait(Duration::from_secs_f64(pause_s));
        }
        Err(FetchError { words: "not tried".into(), retry_after_s: None })
    }

    fn once(&self, url: &str, now: &Epoch) -> std::result::Result<Reply, Failure> {
        let mut address = url.to_owned();
        let mut response = self.agent.get(&address).call().map_err(|e| self.failure(e))?;
        for followed in 0.. {
            let to = response.headers().get("location").filter(|_| response.status().is_redirection());
            let Some(to) = to else { break };
            let refused = |words: String| Failure { words, passing: false, wait_s: None };
            if followed == REDIRECTS {
                return Err(refused(format!("more than {REDIRECTS} redirections")));
            }
            address = redirected(&address, &String::from_utf8_lossy(to.as_bytes()))
                .map_err(|why| refused(format!("{why}, which is not followed")))?;
            response = self.agent.get(&address).call().map_err(|e| self.failure(e))?;
        }
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

/// Where a server sends on to from `address`.
///
/// # Errors
/// In words, for an address that is none, one without TLS after one with it, and one of this machine that does not come
/// from there: a server outside has no business with what listens here.
fn redirected(address: &str, to: &str) -> std::result::Result<String, String> {
    let shown = without_user(to).chars().take(200).collect::<String>();
    let no_address = || format!("sent on to {shown}, no address");
    let from: Uri = address.parse().map_err(|_| no_address())?;
    let (scheme, authority) = (from.scheme_str().unwrap_or("https"), from.authority().map_or("", |a| a.as_str()));
    let folder = from.path().rsplit_once('/').map_or("", |(folder, _)| folder);
    let target = match to {
        _ if to.contains("://") => to.to_owned(),
        _ if to.starts_with("//") => format!("{scheme}:{to}"),
        _ if to.starts_with('/') => format!("{scheme}://{authority}{to}"),
        _ => format!("{scheme}://{authority}{folder}/{to}"),
    };
    let uri: Uri = target.parse().map_err(|_| no_address())?;
    let host = uri.host().ok_or_else(no_address)?;
    match uri.scheme_str() {
        Some("https") => {}
        Some("http") if scheme == "http" => {}
        Some("http") => return Err(format!("sent on from https to plain HTTP ({shown})")),
        _ => return Err(no_address()),
    }
    if is_of_this_machine(host) && !from.host().is_some_and(is_of_this_machine) {
        return Err(format!("sent on to this machine ({shown})"));
    }
    Ok(target)
}

/// Whether a host is this machine itself, by its number or by what its name stands for.
fn is_of_this_machine(host: &str) -> bool {
    let local = |ip: IpAddr| match ip.to_canonical() {
        IpAddr::V4(ip) => ip.is_loopback() || ip.is_unspecified() || ip.is_link_local(),
        IpAddr::V6(ip) => ip.is_loopback() || ip.is_unspecified() || ip.is_unicast_link_local(),
    };
    let bare = host.trim_matches(['[', ']']);
    match bare.parse::<IpAddr>() {
        Ok(ip) => local(ip),
        // no network, no answer: the connection fails by itself
        Err(_) => (bare, 0).to_socket_addrs().is_ok_and(|mut all| all.any(|a| local(a.ip()))),
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

#[cfg(test)]
mod redirections {
    use super::redirected;

    #[test]
    fn an_address_is_followed_unless_it_leaves_tls_or_leads_to_this_machine() {
        let from = "https://192.0.2.7:444/a/b?c=d";
        for (to, target) in [
            ("https://198.51.100.1/x", "https://198.51.100.1/x"),
            ("//198.51.100.1/x", "https://198.51.100.1/x"),
            ("/x?y", "https://192.0.2.7:444/x?y"),
            ("x", "https://192.0.2.7:444/a/x"),
        ] {
            assert_eq!(redirected(from, to).unwrap(), target);
        }
        for (from, to, word) in [
            (from, "http://198.51.100.1/x", "plain HTTP"),
            (from, "https://127.0.0.1/x", "this machine"),
            (from, "https://localhost:8080/x", "this machine"),
            (from, "https://[::1]/", "this machine"),
            (from, "https://[::ffff:127.0.0.1]/", "this machine"),
            (from, "https://0.0.0.0/", "this machine"),
            (from, "https://169.254.169.254/latest", "this machine"),
            ("http://192.0.2.7/", "http://127.0.0.9/", "this machine"),
            (from, "file:///etc/passwd", "no address"),
            (from, "ftp://198.51.100.1/", "no address"),
            (from, "https://user:secret@[/", "no address"),
        ] {
            let message = redirected(from, to).unwrap_err();
            assert!(message.contains(word) && !message.contains("secret"), "{to}: {message}");
        }
        // a server of this machine may send on to itself: a proxy, a test
        assert!(redirected("http://127.0.0.1:80/a", "http://127.0.0.1:81/b").is_ok());
        assert!(redirected("http://127.0.0.1:80/a", "https://192.0.2.1/b").is_ok());
    }
}
