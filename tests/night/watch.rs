//! A night while its frames arrive: each becomes a line once it is complete, and in the end the results are those of `run`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use crate::support::{Night, simulated};

/// A longer wait means that the frame was never noticed; how fast it is belongs to docs/speed.md.
const LONG: Duration = Duration::from_secs(60);

/// The tiny night without its frames, and the frames in another folder.
fn empty_night(name: &str) -> (Night, tempfile::TempDir, Vec<PathBuf>) {
    let night = Night::copy_of(&simulated(name, &["target.n=6"]));
    let camera = tempfile::tempdir().unwrap();
    let mut frames = Vec::new();
    for kind in ["flat", "field", "target"] {
        for path in night.frames(kind) {
            let moved = camera.path().join(path.file_name().unwrap());
            std::fs::copy(&path, &moved).unwrap();
            std::fs::remove_file(&path).unwrap();
            frames.push(moved);
        }
    }
    (night, camera, frames)
}

struct Watching {
    child: Child,
    lines: Receiver<String>,
}

impl Watching {
    fn start(night: &Night, more: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_satphot"))
            .args(["watch", "-j", "2", "-q"])
            .args(more)
            .current_dir(night.path("."))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let (send, lines) = channel();
        let out = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || out.lines().map_while(Result::ok).try_for_each(|line| send.send(line)));
        Self { child, lines }
    }

    /// Waits for a line that holds these words.
    fn expect(&self, words: &str) -> String {
        loop {
            let line = self.lines.recv_timeout(LONG).unwrap_or_else(|e| panic!("no line with {words}: {e}"));
            if line.contains(words) {
                return line;
            }
        }
    }

    /// CPU time so far \[s\], where the system tells it: fields 14 and 15 of proc_pid_stat(5), in ticks of 10 ms.
    fn cpu_s(&self) -> Option<f64> {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id())).ok()?;
        let ticks = stat.rsplit_once(')')?.1.split_whitespace().skip(11).take(2).filter_map(|t| t.parse::<f64>().ok());
        Some(ticks.sum::<f64>() / 100.0)
    }

    fn signal(&self, name: &str) {
        assert!(Command::new("kill").args([name, &self.child.id().to_string()]).status().unwrap().success());
    }
}

/// The frame arrives in two parts, as a camera program writes it.
fn arrive(night: &Night, frame: &Path) {
    let bytes = std::fs::read(frame).unwrap();
    let path = night.path(frame.file_name().unwrap().to_str().unwrap());
    let mut file = std::fs::File::create(path).unwrap();
    file.write_all(&bytes[..bytes.len() / 3]).unwrap();
    file.flush().unwrap();
    std::thread::sleep(Duration::from_millis(400));
    file.write_all(&bytes[bytes.len() / 3..]).unwrap();
}

fn products(night: &Night) -> Vec<(String, Vec<u8>)> {
    let names =
        ["photometry.ecsv", "stars.ecsv", "residuals.ecsv", "zeropoint.toml", "master_flat.fits", "report.html"];
    names.iter().map(|name| ((*name).to_owned(), std::fs::read(night.result(name)).unwrap())).collect()
}

#[test]
fn frames_are_reduced_as_they_arrive_and_the_results_are_those_of_run() {
    let (night, _camera, frames) = empty_night("watch");
    let (targets, others): (Vec<&PathBuf>, Vec<&PathBuf>) =
        frames.iter().partition(|p| p.file_name().unwrap().to_string_lossy().starts_with("target"));
    let mut watching = Watching::start(&night, &[]);
    others
        .iter()
        .for_each(|frame| drop(std::fs::copy(frame, night.path(frame.file_name().unwrap().to_str().unwrap()))));
    arrive(&night, targets[0]);
    let line = watching.expect("target_0000.fits");
    assert!(line.contains("use") || line.contains("caution"), "{line}");
    let page = std::fs::read_to_string(night.result("report.html"));
    assert!(page.is_ok_and(|page| page.contains("http-equiv=\"refresh\"")) || cfg!(not(feature = "report")));
    arrive(&night, targets[1]);
    watching.expect("target_0001.fits");
    if let Some(before_s) = watching.cpu_s() {
        // its own results are in a folder beside the frames, and it reads frames: neither is news
        let waited = Duration::from_secs(4);
        std::thread::sleep(waited);
        let share = (watching.cpu_s().unwrap() - before_s) / waited.as_secs_f64();
        assert!(share < 0.25, "{:.0} % of a core while nothing arrives", 100.0 * share);
    }
    // it is killed, frames arrive meanwhile, one of them cut; it is started again
    watching.signal("-9");
    watching.child.wait().unwrap();
    arrive(&night, targets[2]);
    let mut watching = Watching::start(&night, &["--poll", "1"]);
    watching.expect("target_0002.fits");
    targets[3..].iter().for_each(|frame| arrive(&night, frame));
    watching.expect("target_0005.fits");
    watching.signal("-INT");
    watching.expect("Results in");
    assert!(watching.child.wait().unwrap().success());
    let watched = products(&night);
    assert!(!String::from_utf8_lossy(&watched[5].1).contains("http-equiv=\"refresh\""));
    std::fs::remove_dir_all(night.path("satphot-out")).unwrap();
    night.satphot(&["run", "-q"]).expect(0, &[]);
    for ((name, by_watch), (_, by_run)) in watched.iter().zip(products(&night)) {
        if name == "report.html" {
            continue; // it states its own run time
        }
        assert!(*by_watch == by_run, "{name} differs");
    }
}

#[test]
fn what_is_missing_is_said_before_the_first_frame() {
    let (night, _camera, _frames) = empty_night("watch_missing");
    std::fs::remove_file(night.path("catalogue.csv")).unwrap();
    night.satphot(&["watch"]).expect(5, &["catalogue.csv", "fetch stars"]);
}
