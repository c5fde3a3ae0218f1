//! A server on the loopback that answers as CelesTrak, SatChecker and VizieR do, on good days and on bad ones.
//!
//! Answers are written after the services' documentation; the elements and stars in them are published ones.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, dead_code)]

pub mod client;

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

/// A request as it came.
#[derive(Debug, Clone)]
pub struct Request {
    /// Path with its query.
    pub path: String,
    /// Value of User-Agent.
    pub agent: String,
    /// HOST:PORT a proxy was asked to connect to.
    pub through: Option<String>,
}

/// What is sent back.
#[derive(Debug, Clone)]
pub struct Reply {
    head: String,
    body: Vec<u8>,
    /// Content-Length, where it is not the truth.
    claims: Option<usize>,
    /// Before the answer.
    delay: Duration,
    /// Sent instead of HTTP.
    raw: bool,
}

impl Reply {
    pub fn status(status: &str, body: impl Into<Vec<u8>>) -> Self {
        let head = format!("HTTP/1.1 {status}\r\nConnection: close\r\n");
        Self { head, body: body.into(), claims: None, delay: Duration::ZERO, raw: false }
    }
    pub fn ok(body: impl Into<Vec<u8>>) -> Self {
        Self::status("200 OK", body)
    }
    pub fn header(mut self, line: &str) -> Self {
        self.head += &format!("{line}\r\n");
        self
    }
    /// Says that more is to come than comes.
    pub fn cut(mut self) -> Self {
        self.claims = Some(self.body.len() + 1_000);
        self
    }
    pub fn after(mut self, delay: Duration) -> Self {
        self.delay = delay;
        self
    }
    /// Bytes that are no HTTP.
    pub fn raw(bytes: &[u8]) -> Self {
        Self { raw: true, ..Self::ok(bytes) }
    }
    fn send(&self, stream: &mut TcpStream) {
        thread::sleep(self.delay);
        let length = self.claims.unwrap_or(self.body.len());
        let head = if self.raw { String::new() } else { format!("{}Content-Length: {length}\r\n\r\n", self.head) };
        // a client that has gone away is what some tests are about
        let _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(&self.body));
    }
}

/// The server; it counts and keeps what it was asked.
pub struct Server {
    port: u16,
    requests: Arc<Mutex<Vec<Request>>>,
    stop: Arc<AtomicBool>,
}

impl Server {
    /// `answer` gets a request and its number, from 0.
    pub fn new(answer: impl Fn(&Request, usize) -> Reply + Send + Sync + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let requests = Arc::new(Mutex::new(Vec::new()));
        let stop = Arc::new(AtomicBool::new(false));
        let (answer, kept, stopped) = (Arc::new(answer), Arc::clone(&requests), Arc::clone(&stop));
        thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                if stopped.load(Ordering::Relaxed) {
                    break;
                }
                let (answer, kept) = (Arc::clone(&answer), Arc::clone(&kept));
                thread::spawn(move || serve(stream, &*answer, &kept));
            }
        });
        Self { port, requests, stop }
    }

    /// A server that gives one answer to everything.
    pub fn always(reply: Reply) -> Self {
        Self::new(move |_, _| reply.clone())
    }

    pub fn url(&self, path: &str) -> String {
        format!("http://127.0.0.1:{}/{path}", self.port)
    }
    pub fn address(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }
    pub fn requests(&self) -> Vec<Request> {
        self.requests.lock().unwrap().clone()
    }
    pub fn count(&self) -> usize {
        self.requests().len()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = TcpStream::connect(("127.0.0.1", self.port)); // wakes the listener
    }
}

fn serve(mut stream: TcpStream, answer: &dyn Fn(&Request, usize) -> Reply, kept: &Mutex<Vec<Request>>) {
    let mut through = None;
    loop {
        let mut head = Vec::new();
        let mut byte = [0];
        while !head.ends_with(b"\r\n\r\n") {
            match stream.read(&mut byte) {
                Ok(1) => head.push(byte[0]),
                _ => return,
            }
        }
        let head = String::from_utf8_lossy(&head).into_owned();
        let target = head.split_whitespace().nth(1).unwrap_or_default().to_owned();
        if head.starts_with("CONNECT ") {
            through = Some(target);
            stream.write_all(b"HTTP/1.1 200 Connection established\r\n\r\n").unwrap();
            continue;
        }
        let agent =
            head.lines().find_map(|l| l.strip_prefix("user-agent: ").or_else(|| l.strip_prefix("User-Agent: ")));
        let request = Request { path: target, agent: agent.unwrap_or_default().to_owned(), through: through.clone() };
        let n = {
            let mut kept = kept.lock().unwrap();
            kept.push(request.clone());
            kept.len() - 1
        };
        answer(&request, n).send(&mut stream);
        return;
    }
}

/// The ISS as CelesTrak's FORMAT=JSON writes it, at an epoch of one's own.
pub fn iss_omm(epoch: &str) -> String {
    format!(
        "[{{\"OBJECT_NAME\":\"ISS (ZARYA)\",\"OBJECT_ID\":\"1998-067A\",\"EPOCH\":\"{epoch}\",\"MEAN_MOTION\":15.48947664,\
         \"ECCENTRICITY\":0.00066697,\"INCLINATION\":51.6304,\"RA_OF_ASC_NODE\":193.4497,\"ARG_OF_PERICENTER\":272.1743,\
         \"MEAN_ANOMALY\":87.8481,\"EPHEMERIS_TYPE\":0,\"CLASSIFICATION_TYPE\":\"U\",\"NORAD_CAT_ID\":25544,\
         \"ELEMENT_SET_NO\":999,\"REV_AT_EPOCH\":57509,\"BSTAR\":0.00010370434,\"MEAN_MOTION_DOT\":5.258e-5,\
         \"MEAN_MOTION_DDOT\":0}}]"
    )
}

/// The example of SatChecker's documentation: the ISS of 2024-01-30.
pub const NEAREST_TLE: &str = r#"[{"source": "IAU CPS SatChecker", "orbital_data": [{"data_source": "spacetrack",
 "date_collected": "2024-06-04 19:16:53 UTC", "epoch": "2024-01-30 02:26:07 UTC", "satellite_id": 25544,
 "satellite_name": "ISS (ZARYA)",
 "tle_line1": "1 25544U 98067A   24030.10147156  .00014904  00000-0  27473-3 0  9998",
 "tle_line2": "2 25544  51.6414 284.5574 0002475 176.3471 287.7672 15.49357173436989"}], "version": "1.X.x"}]"#;

/// SatChecker where it has no such object.
pub const NEAREST_NONE: &str = r#"[{"source": "IAU CPS SatChecker", "orbital_data": [], "version": "1.X.x"}]"#;

/// SatChecker's other archive: the same envelope around the keys of an OMM.
pub fn nearest_omm(epoch: &str) -> String {
    let omm = iss_omm(epoch);
    let elements = omm.trim_matches(['[', ']']);
    format!(
        "[{{\"orbital_data\": [{{\"data_source\": \"celestrak\", \"epoch\": \"2026-07-13 02:00:00 UTC\", \"satellite_id\": 25544, \
         \"satellite_name\": \"ISS (ZARYA)\", \"orbital_elements\": {elements}}}], \"version\": \"1.7.0\"}}]"
    )
}

/// CelesTrak's words for a question repeated within its update period.
pub const NOT_UPDATED: &str = "GP data has not updated since your last successful\ndownload of CATNR=25544 at 2026-08-31 \
                               15:13:07 UTC.\nData is updated once every 2 hours.\n";

/// A gateway's error page.
pub const HTML: &str = "<!DOCTYPE html>\n<html><head><title>502 Bad Gateway</title></head><body>nginx</body></html>\n";

/// Stars of APASS DR9 (recno, RA, Dec, V, its error, B-V, its error), the last without V.
pub const STARS: [[&str; 7]; 4] = [
    ["16572870", "0.345154", "-0.907018", "13.399", "0.075", "1.418", "0.090"],
    ["16572916", "0.419892", "-0.842144", "15.166", "0.080", "0.957", "0.081"],
    ["16572917", "0.421000", "-0.850000", "12.020", "", "", ""],
    ["16572918", "0.422000", "-0.860000", "", "", "", ""],
];

/// A field as VizieR's asu-tsv writes it.
pub fn apass(stars: &[[&str; 7]]) -> String {
    let mut text = String::from(
        "#\n#   VizieR Astronomical Server vizier.cds.unistra.fr\n#    Date: 2026-11-22T07:00:00 [V1.99+ (14-Oct-2013)]\n\
         #   In case of problem, please report to:\tcds-question@unistra.fr\n#\n#INFO\t-out.max=500000\n\n\
         #RESOURCE=yCat_2336\n#Name: II/336\n#Title: AAVSO Photometric All Sky Survey (APASS) DR9 (Henden+, 2016)\n\
         #Table\tII_336_apass9:\n#Name: II/336/apass9\n#Title: The APASS catalog\n\
         #Column\trecno\t(I8)\tRecord number assigned by the VizieR team. Should Not be used for identification.\t[ucd=meta.record]\n\
         #Column\tRAJ2000\t(F10.6)\tRight ascension in decimal degrees (J2000)\t[ucd=pos.eq.ra;meta.main]\n\
         #Column\tDEJ2000\t(F10.6)\tDeclination in decimal degrees (J2000)\t[ucd=pos.eq.dec;meta.main]\n\
         #Column\tVmag\t(F6.3)\t[5.5/27.4]? Johnson V-band magnitude\t[ucd=phot.mag;em.opt.V]\n\
         #Column\te_Vmag\t(F6.3)\t[0/7]? Vmag uncertainty\t[ucd=stat.error;phot.mag;em.opt.V]\n\
         #Column\tB-V\t(F6.3)\t[-7.5/13]? B-V color index\t[ucd=phot.color;em.opt.B;em.opt.V]\n\
         #Column\te_B-V\t(F6.3)\t[0/10.1]? B-V uncertainty\t[ucd=stat.error;phot.color;em.opt.B]\n",
    );
    if !stars.is_empty() {
        text += "recno\tRAJ2000\tDEJ2000\tVmag\te_Vmag\tB-V\te_B-V\n \tdeg\tdeg\tmag\tmag\tmag\tmag\n";
        text += "--------\t----------\t----------\t------\t------\t------\t------\n";
        for s in stars {
            text += &format!(
                "{:>8}\t{:>10}\t{:>10}\t{:>6}\t{:>6}\t{:>6}\t{:>6}\n",
                s[0], s[1], s[2], s[3], s[4], s[5], s[6]
            );
        }
    }
    text + "\n#END#\n"
}
