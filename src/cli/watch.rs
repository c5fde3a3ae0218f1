//! `satphot watch`: a night while its frames arrive.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use clap::Args;
use notify::event::{AccessKind, AccessMode};
use notify::{EventKind, RecommendedWatcher, RecursiveMode, Watcher};
use satphot::base::hash::KnownHashes;
use satphot::base::progress::Silent;
use satphot::base::stop::Stop;
use satphot::config::Config;
use satphot::pipeline::arrivals::Arrivals;
use satphot::pipeline::groups::{Night, run_night};
use satphot::pipeline::options::Options;
use satphot::pipeline::prepared::Prepared;
use satphot::pipeline::products::summary::Summary;
use satphot::tables::{PhotometryRow, read_photometry};

use super::{Common, print, run, tell};

const AFTER_HELP: &str = "\
The folders of night.input are watched by the events of the file system; folders on network disks, which report no events of
other machines, are listed every few seconds instead (--poll does so everywhere). A frame is reduced once it is written
completely. Each new frame is a line; after new star frames the zeropoint is fitted again, and the tables and report.html hold
all frames so far. report.html loads itself again in the browser.

Ctrl-C ends it: the night is then reduced as `satphot run` does, with the same results to the byte. Frames measured already
are not measured again, also after a crash.

Examples:
  satphot watch night.toml
  satphot watch night.toml --idle 30     ends by itself 30 min after the last frame
  satphot watch night.toml --poll 5      a disk that reports no events";

/// A file that was open for writing is closed.
const WRITTEN: EventKind = EventKind::Access(AccessKind::Close(AccessMode::Write));
/// How long to wait between two looks while a file is being written.
const PENDING: Duration = Duration::from_millis(300);
/// How long to wait for an event before the folders are listed anyway.
const IDLE: Duration = Duration::from_secs(60);
/// How often the folders are listed where there are no events \[s\].
const LISTED_S: u64 = 5;
/// How often a request to stop is looked for.
const STOP: Duration = Duration::from_millis(500);
/// How often the report loads itself again \[s\].
const REFRESH_S: u32 = 15;

/// Reduces a night while its frames arrive, and writes the results of `run` in the end.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct Watch {
    /// Configuration of the night (instead of -c)
    #[arg(value_name = "PIPELINE_TOML")]
    night: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
    /// Folder of the results (night.output)
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// List the folders every SECONDS instead of waiting for events
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..=3600))]
    poll: Option<u64>,
    /// End when no frame has arrived for MINUTES
    #[arg(long, value_name = "MINUTES", value_parser = clap::value_parser!(u64).range(1..=1440))]
    idle: Option<u64>,
}

impl Watch {
    pub fn execute(mut self) -> anyhow::Result<()> {
        if let Some(night) = self.night.take() {
            self.common.config = night;
        }
        let mut config = self.common.load()?;
        if let Some(out) = self.out.take() {
            config.night.output = out;
        }
        Prepared::prepare(&config)?; // what is missing is said now, not with the first frame
        let options = self.common.options();
        let events = self.events(&config);
        let folders: Vec<String> = config.night.input.iter().map(|p| p.display().to_string()).collect();
        self.note(&format!("watching {}; Ctrl-C ends the night", folders.join(", ")));
        let mut printed = Printed::default();
        self.follow(&config, &options, &events, &mut printed)?;
        self.note("the night ends: all frames are reduced as `satphot run` does");
        // the signal that ended the watch does not end this; a second one ends the program at once
        let last = Options { stop: Stop::default(), ..options };
        let night = run_night(&config, &last, &self.common.progress())?;
        printed.show(&night, self.common.json)?;
        run::NightPrinter { common: &self.common, verbose: false }.night(night)
    }

    /// The events of the folders, and how long to wait for one.
    fn events(&self, config: &Config) -> Events {
        let (sender, receiver) = channel();
        let notifier = sender.clone();
        let listed = |seconds| Events { _watcher: None, _sender: sender, receiver, wait: Duration::from_secs(seconds) };
        if let Some(seconds) = self.poll {
            return listed(seconds);
        }
        if let Some(remote) = config.night.input.iter().find(|folder| is_remote(folder)) {
            self.note(&format!("{} is on a network disk: it is listed every {LISTED_S} s", remote.display()));
            return listed(LISTED_S);
        }
        let mut watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            // that a file was read is no news: reading it would cause the next look, for ever
            if event.map_or(true, |event| !event.kind.is_access() || event.kind == WRITTEN) {
                let _ = notifier.send(()); // whatever it was, the folders are scanned
            }
        });
        let watched = watcher.as_mut().map_err(|e| e.to_string()).and_then(|watcher| {
            let mut all = config.night.input.iter();
            all.try_for_each(|path| watcher.watch(path, RecursiveMode::Recursive)).map_err(|e| e.to_string())
        });
        match (watched, watcher) {
            (Ok(()), Ok(watcher)) => Events { _watcher: Some(watcher), wait: IDLE, ..listed(0) },
            (watched, _) => {
                let why = watched.err().unwrap_or_default();
                self.note(&format!("no events of the file system ({why}): the folders are listed every {LISTED_S} s"));
                listed(LISTED_S)
            }
        }
    }

    /// Reduces whatever is complete, again and again, until a stop is requested or nothing arrives any more.
    fn follow(&self, config: &Config, options: &Options, events: &Events, printed: &mut Printed) -> anyhow::Result<()> {
        let (clock, mut arrivals) = (Instant::now(), Arrivals::default());
        let known_hashes = Some(KnownHashes::default());
        let mut last_news = Instant::now();
        loop {
            let news = arrivals.scan(config, clock.elapsed())?;
            if news > 0 {
                last_news = Instant::now();
                let files = arrivals.complete();
                let own = Options { files, known_hashes: known_hashes.clone(), ..options.clone() };
                match run_night(config, &own, &Silent) {
                    Ok(night) => {
                        pages(&night).iter().for_each(|page| refreshing(page));
                        printed.show(&night, self.common.json)?;
                    }
                    Err(satphot::Error::Interrupted { .. }) => return Ok(()),
                    // what is missing may arrive yet
                    Err(error) => printed.waiting(&error.to_string(), self),
                }
            }
            let ends = self.idle.is_some_and(|minutes| last_news.elapsed() > Duration::from_secs(60 * minutes));
            if ends || options.stop.requested().is_some() {
                return Ok(());
            }
            if news == 0 {
                let pause = if arrivals.n_awaited() > 0 { PENDING } else { events.wait };
                if pause_until(pause, events, options) {
                    return Ok(());
                }
            }
        }
    }

    fn note(&self, text: &str) {
        if !self.common.quiet {
            tell(&format!("note: {text}"));
        }
    }
}

/// How news of the folders comes.
struct Events {
    /// Works as long as it lives.
    _watcher: Option<RecommendedWatcher>,
    /// Keeps the channel open where nobody else has it.
    _sender: Sender<()>,
    receiver: Receiver<()>,
    /// How long to wait for an event before the folders are listed anyway.
    wait: Duration,
}

/// Waits for an event, at most so long; says whether a stop is requested.
fn pause_until(longest: Duration, events: &Events, options: &Options) -> bool {
    let until = Instant::now() + longest;
    loop {
        if options.stop.requested().is_some() {
            return true;
        }
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return false;
        }
        if events.receiver.recv_timeout(left.min(STOP)).is_ok() {
            while events.receiver.try_recv().is_ok() {} // one look answers all of them
            return false;
        }
    }
}

/// What was printed already.
#[derive(Debug, Default)]
struct Printed {
    /// Folder and frame of each row.
    rows: BTreeSet<(PathBuf, String)>,
    zeropoints: BTreeMap<PathBuf, String>,
    waiting: BTreeSet<String>,
}

impl Printed {
    /// The rows that are new, as lines, and each zeropoint that changed.
    fn show(&mut self, night: &Night, json: bool) -> anyhow::Result<()> {
        let summaries: Vec<&Summary> = match night {
            Night::Single(summary) => vec![summary],
            Night::Groups(groups) => groups.reduced.iter().filter_map(|r| r.summary.as_ref().ok()).collect(),
        };
        for summary in &summaries {
            self.zeropoint(summary, json);
            let table = summary.folder.join("photometry.ecsv");
            for row in read_photometry(&table)?.0 {
                if self.rows.is_empty() && !json {
                    print(&format!("{}\n", header()));
                }
                if self.rows.insert((summary.folder.clone(), row.frame.clone())) {
                    print(&if json { format!("{}\n", of_json(&row)) } else { format!("{}\n", line(&row)) });
                }
            }
        }
        Ok(())
    }

    fn zeropoint(&mut self, summary: &Summary, json: bool) {
        let Some(z) = &summary.zeropoint else { return };
        let [zp, k, c] = z.errs();
        let text = format!(
            "Zeropoint {} of {} pointings: ZP {:.4} +- {zp:.4}  k {:.4} +- {k:.4}  C {:.4} +- {c:.4}",
            summary.night, z.n_pointings, z.zp_mag, z.k_mag_airmass, z.c_mag_mag
        );
        if self.zeropoints.insert(summary.folder.clone(), text.clone()).as_ref() != Some(&text) {
            if json {
                let z = serde_json::json!({ "zeropoint": summary.night, "zp_mag": z.zp_mag, "zp_err_mag": zp,
                    "k_mag_airmass": z.k_mag_airmass, "c_mag_mag": z.c_mag_mag, "n_pointings": z.n_pointings });
                print(&format!("{z}\n"));
            } else {
                print(&format!("{text}\n"));
            }
        }
    }

    /// Why nothing can be reduced yet, each reason once.
    fn waiting(&mut self, why: &str, watch: &Watch) {
        if self.waiting.insert(why.to_owned()) {
            watch.note(&format!("waiting for more frames: {why}"));
        }
    }
}

fn header() -> String {
    format!(
        "{:<19} {:<28} {:<16} {:<8} {:>7} {:>6} {:>8}  reason",
        "UTC", "frame", "object", "verdict", "mag", "error", "residual"
    )
}

/// One row of the table on the terminal.
fn line(row: &PhotometryRow) -> String {
    let number = |v: Option<f64>, digits: usize| v.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    let error = row.v_mag_err.zip(row.v_mag_err_sys).map(|(a, b)| a.hypot(b));
    let verdict = if row.verdict.is_empty() { row.status.clone() } else { row.verdict.clone() };
    let (mag, sign) = match (row.v_mag, row.limit_v_mag) {
        (None, Some(limit)) => (Some(limit), ">"),
        (mag, _) => (mag, ""),
    };
    let date: String = row.date_mid.chars().take(19).collect();
    format!(
        "{date:<19} {:<28} {:<16} {verdict:<8} {:>7} {:>6} {:>8}  {}",
        row.frame,
        row.object_name,
        format!("{sign}{}", number(mag, 3)),
        number(error, 3),
        number(row.residual_mag, 3),
        row.reason
    )
    .trim_end()
    .to_owned()
}

fn of_json(row: &PhotometryRow) -> serde_json::Value {
    serde_json::json!({
        "frame": row.frame, "object_name": row.object_name, "date_mid": row.date_mid, "status": row.status,
        "verdict": row.verdict, "v_mag": row.v_mag, "v_mag_err": row.v_mag_err,
        "v_mag_err_sys": row.v_mag_err_sys, "limit_v_mag": row.limit_v_mag, "residual_mag": row.residual_mag,
        "reason": row.reason,
    })
}

/// The report pages of a night.
fn pages(night: &Night) -> Vec<PathBuf> {
    let (over_all, of_each): (Option<&Path>, Vec<&Path>) = match night {
        Night::Single(summary) => (None, vec![&summary.folder]),
        Night::Groups(groups) => {
            let summaries = groups.reduced.iter().filter_map(|r| r.summary.as_ref().ok());
            (Some(&groups.folder), summaries.map(|s| s.folder.as_path()).collect())
        }
    };
    over_all.into_iter().chain(of_each).map(|folder| folder.join("report.html")).collect()
}

/// Makes a page load itself again every few seconds; a page that is not there is none.
fn refreshing(page: &Path) {
    let Ok(text) = std::fs::read_to_string(page) else { return };
    let tag = format!("<head><meta http-equiv=\"refresh\" content=\"{REFRESH_S}\">");
    let _ = satphot::base::file::write_atomic(page, text.replacen("<head>", &tag, 1).as_bytes());
}

/// Whether a folder is on a file system that other machines write to without events here.
#[cfg(target_os = "linux")]
fn is_remote(folder: &Path) -> bool {
    // NFS, SMB 1, CIFS, SMB 2, FUSE (sshfs), 9P, AFS, Ceph: include/uapi/linux/magic.h
    const REMOTE: [u32; 8] =
        [0x6969, 0x517B, 0xFF53_4D42, 0xFE53_4D42, 0x6573_5546, 0x0102_1997, 0x5346_414F, 0x00C3_6400];
    rustix::fs::statfs(folder).is_ok_and(|stat| REMOTE.contains(&(stat.f_type as u32)))
}

#[cfg(not(target_os = "linux"))]
fn is_remote(_: &Path) -> bool {
    false
}
