//! A night that cannot be lost: signals, two runs in one folder, folders that cannot be written, results that were changed.
//!
//! Tiny simulated nights through the program. Full disks and read-only folders need a file system of their own: where the
//! system refuses to mount one the test says so.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;

use sha2::{Digest, Sha256};
use support::{Night, RunOutput, simulated};

fn original() -> &'static Path {
    static NIGHT: OnceLock<PathBuf> = OnceLock::new();
    NIGHT.get_or_init(|| simulated("interrupts", &["target.n=12"]))
}

fn night() -> Night {
    Night::copy_of(original())
}

fn run(night: &Night) -> RunOutput {
    night.satphot(&["run", "--no-figures", "-q", "-j", "2"])
}

/// Hash of every data product of a finished night, by name.
fn products(night: &Night) -> Vec<(String, String)> {
    let names = ["photometry.ecsv", "stars.ecsv", "residuals.ecsv", "zeropoint.toml", "master_flat.fits"];
    let more = ["effective.toml", "detector.toml"];
    let hash = |name: &&str| {
        let bytes = std::fs::read(night.result(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        ((*name).to_string(), format!("{:x}", Sha256::digest(bytes)))
    };
    names.iter().chain(&more).map(hash).collect()
}

/// The program at work on a night, past its first frames.
fn begun(night: &Night) -> Child {
    let mut child = Command::new(env!("CARGO_BIN_EXE_satphot"))
        .args(["run", "--no-figures", "-j", "1", "--progress", "json"])
        .current_dir(night.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let mut rest = lines.map_while(Result::ok);
    assert!(rest.any(|line| line.contains("\"event\":\"stage\"")), "it ended before it began");
    // what it says later must not fill the pipe
    std::thread::spawn(move || rest.for_each(drop));
    child
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([name, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

#[test]
fn a_terminated_run_ends_with_143_and_the_next_one_with_the_bytes_of_an_undisturbed_one() {
    let undisturbed = night();
    run(&undisturbed).expect(0, &[]);
    let wanted = products(&undisturbed);
    for (name, code) in [("-TERM", 143), ("-INT", 130), ("-KILL", -1)] {
        let disturbed = night();
        let mut child = begun(&disturbed);
        signal(&child, name);
        let status = child.wait().unwrap();
        // a machine may be so quick that the night is finished before the signal comes
        assert!([code, 0].contains(&status.code().unwrap_or(-1)), "{name}: {status}");
        run(&disturbed).expect(0, &[]);
        assert_eq!(products(&disturbed), wanted, "after {name}");
        let left = std::fs::read_dir(disturbed.result("")).unwrap().filter(|e| {
            let name = e.as_ref().unwrap().file_name().to_string_lossy().into_owned();
            name.contains(".tmp.") || name == ".satphot.lock"
        });
        assert_eq!(left.count(), 0, "leftovers after {name}");
    }
}

#[test]
fn a_stop_while_a_large_catalogue_is_read_ends_the_run_at_once() {
    let n = night();
    let rows = "1.0,1.0,9.5,0.6\n".repeat(1 << 16);
    let mut file = std::fs::File::create(n.path("catalogue.csv")).unwrap();
    std::io::Write::write_all(&mut file, b"RAJ2000,DEJ2000,Vmag,B-V\n").unwrap();
    (0..160).for_each(|_| std::io::Write::write_all(&mut file, rows.as_bytes()).unwrap());
    let child = Command::new(env!("CARGO_BIN_EXE_satphot"))
        .args(["run", "--no-figures"])
        .current_dir(n.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(700));
    signal(&child, "-TERM");
    let sent = std::time::Instant::now();
    let done = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.code() == Some(143) && said.contains("while the inputs were read"), "{:?} {said}", done.status);
    assert!(sent.elapsed().as_secs_f64() < 1.0, "{:?}", sent.elapsed());
    assert!(!n.result("").exists(), "something was written");
}

#[test]
fn the_second_run_in_a_folder_is_refused_with_75_and_harms_nothing() {
    let n = night();
    std::fs::create_dir_all(n.result("")).unwrap();
    let held = satphot::pipeline::products::lock::lock(&n.result("")).unwrap();
    run(&n).expect(75, &["another run", &format!("pid {}", std::process::id()), "tiny"]).without_results();
    assert!(!n.result("photometry.ecsv").exists());
    drop(held);
    run(&n).expect(0, &[]);
}

/// A file system of `bytes` in memory, or why there is none.
struct Mounted(tempfile::TempDir);

impl Mounted {
    fn new(options: &str) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let mount = Command::new("mount").args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(folder.path()).output();
        if !mount.is_ok_and(|o| o.status.success()) {
            println!("skipped: this system lets nobody mount a file system here");
            return None;
        }
        Some(Self(folder))
    }
    fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Drop for Mounted {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0.path()).status();
    }
}

fn set_output(folder: &Path) -> String {
    format!("night.output={}", folder.display())
}

#[test]
fn a_full_disk_is_one_clear_error_and_nothing_is_half_written() {
    let Some(disk) = Mounted::new("size=64k") else { return };
    let n = night();
    let set = set_output(disk.path());
    n.satphot(&["run", "--no-figures", "-q", "--set", &set]).expect(4, &["disk full", "bytes needed", "run again"]);
    for entry in std::fs::read_dir(disk.path().join("tiny")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(!name.contains(".tmp."), "{name}");
        assert!(path.is_dir() || std::fs::metadata(&path).unwrap().len() > 0, "{name} is empty");
    }
}

#[test]
fn a_read_only_folder_and_one_that_vanishes_are_reported_by_name() {
    let n = night();
    if let Some(disk) = Mounted::new("size=1m,ro") {
        n.satphot(&["run", "-q", "--set", &set_output(disk.path())]).expect(4, &["read-only", "choose another folder"]);
    }
    n.satphot(&["run", "-q", "--set", "night.output=pipeline.toml"]).expect(4, &["pipeline.toml", "folder is needed"]);
    let gone = n.path("gone/table.ecsv");
    let error = satphot::base::file::write_atomic(&gone, b"x").unwrap_err();
    assert!(error.to_string().contains("not there") && error.exit_code() == 4, "{error}");
}

#[test]
fn no_name_of_a_night_leads_out_of_the_folder_of_the_results() {
    let n = night();
    for name in ["../../out", "/etc/x", "..", "a/b", "", ".hidden", "a\u{7}b"] {
        let set = format!("night.name={}", toml::Value::String(name.into()));
        n.satphot(&["run", "-q", "--set", &set]).expect(2, &["night.name", "plain folder name"]);
        let set = format!("name={}", toml::Value::String(name.into()));
        let output = n.satphot(&["simulate", "-o", "other", "--set", &set]);
        output.expect(2, &["name", "plain folder name"]);
    }
    assert!(!n.path("satphot-out").exists() && !n.path("other").exists());
}

#[test]
fn verify_passes_a_finished_night_from_anywhere_and_names_whatever_was_changed() {
    let n = night();
    n.satphot(&["run", "-q"]).expect(0, &[]);
    let folder = n.result("");
    let folder = folder.to_str().unwrap();
    let good = n.satphot(&["verify", "--inputs", folder]).expect(0, &[]);
    assert!(good.out.contains("all as recorded"), "{}", good.out);
    let elsewhere = tempfile::tempdir().unwrap();
    support::satphot(elsewhere.path(), &["verify", "--inputs", folder]).expect(0, &[]);

    let spoil = |name: &str, words: &[&str]| {
        let path = n.result(name);
        let bytes = std::fs::read(&path).unwrap();
        let mut other = bytes.clone();
        let middle = other.len() / 2;
        other[middle] ^= 1;
        std::fs::write(&path, other).unwrap();
        n.satphot(&["verify", folder]).expect(6, words).without_results();
        std::fs::write(&path, bytes).unwrap();
    };
    spoil("photometry.ecsv", &["photometry.ecsv: changed"]);
    spoil("master_flat.fits", &["master_flat.fits: changed"]);
    spoil("figures/light_curve.svg", &["light_curve.svg: changed"]);
    std::fs::rename(n.result("stars.ecsv"), n.path("aside")).unwrap();
    n.satphot(&["verify", folder]).expect(6, &["stars.ecsv: is missing"]);
    std::fs::rename(n.path("aside"), n.result("stars.ecsv")).unwrap();

    // an input that changed, and one that is gone
    let frame = n.path(support::TARGETS[0]);
    let bytes = std::fs::read(&frame).unwrap();
    std::fs::write(&frame, &bytes[..bytes.len() - 1]).unwrap();
    n.satphot(&["verify", folder]).expect(6, &[support::TARGETS[0], "changed since the run"]);
    std::fs::remove_file(&frame).unwrap();
    n.satphot(&["verify", folder]).expect(0, &["is gone"]);
    n.satphot(&["verify", "--inputs", folder]).expect(6, &["is gone"]);
    n.satphot(&["verify", "nowhere"]).expect(4, &["manifest.json"]);
}

#[test]
fn no_product_knows_the_folder_it_was_made_in_and_the_manifest_states_what_each_stage_took() {
    let (a, b) = (night(), night());
    for n in [&a, &b] {
        n.satphot(&["run", "-q"]).expect(0, &[]);
    }
    assert_eq!(products(&a), products(&b));
    let here = a.path("").display().to_string();
    let manifest = a.manifest();
    let outputs = manifest["outputs"].as_array().unwrap();
    for output in outputs.iter().filter(|o| o["path"] != "plan.json") {
        let name = output["path"].as_str().unwrap();
        let text = String::from_utf8_lossy(&std::fs::read(a.result(name)).unwrap()).into_owned();
        assert!(!text.contains(here.trim_end_matches('/')), "{name} states the folder of this machine");
    }
    for stage in manifest["stages"].as_array().unwrap() {
        for key in ["wall_s", "cpu_s", "end_s", "bytes_read", "peak_memory_mb"] {
            assert!(stage.get(key).is_some(), "{key} of {stage}");
        }
    }
    let log = a.text("satphot.log.jsonl");
    let lines: Vec<serde_json::Value> = log.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let frames = lines.iter().filter(|l| l["event"] == "frame").count();
    assert_eq!(frames, a.rows().len());
    assert_eq!(lines.last().unwrap()["event"], "end");
}
