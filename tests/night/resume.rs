//! A night that is stopped, killed or run again: what was measured is kept, what changed is measured again, and the results
//! are those of an undisturbed run, byte for byte.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use satphot::base::progress::Progress;
use satphot::base::stop::Stop;
use satphot::pipeline::run::run;
use support::{Night, TARGETS, simulated};

/// What a run leaves behind that holds data.
const DATA: [&str; 5] = ["photometry.ecsv", "residuals.ecsv", "stars.ecsv", "zeropoint.toml", "master_flat.fits"];

fn data(night: &Night) -> Vec<Vec<u8>> {
    DATA.iter().map(|name| std::fs::read(night.result(name)).unwrap()).collect()
}

fn same(a: &[Vec<u8>], b: &[Vec<u8>], when: &str) {
    for ((a, b), name) in a.iter().zip(b).zip(DATA) {
        assert!(a == b, "{name} differs: {when}");
    }
}

/// How many star and target frames the last run kept of an earlier one, and of how many; by its manifest.
fn kept(night: &Night) -> Option<(usize, usize)> {
    let manifest = night.manifest();
    let number = |key: &str| manifest["kept"][key].as_u64().unwrap() as usize;
    (number("frames") > 0).then(|| (number("frames"), number("of")))
}

/// Asks to stop after a number of frames.
struct StopAfter {
    frames: usize,
    seen: AtomicUsize,
    stop: Stop,
}

impl Progress for StopAfter {
    fn stage(&self, _: &str, _: usize) {}
    fn tick(&self) {
        if self.seen.fetch_add(1, Ordering::SeqCst) + 1 == self.frames {
            self.stop.flag().store(15, Ordering::SeqCst);
        }
    }
    fn done(&self) {}
    fn elapsed_s(&self) -> f64 {
        0.0
    }
}

#[test]
fn a_night_stopped_anywhere_ends_with_the_bytes_of_an_undisturbed_one() {
    let original = simulated("resume_stopped", &[]);
    let undisturbed = Night::copy_of(&original);
    undisturbed.run().unwrap();
    let want = data(&undisturbed);
    assert_eq!(kept(&undisturbed), None);
    // 9 star frames, then 6 of the target
    for (frames, message) in [
        (1, "1 of 9 star frames kept"),
        (8, "8 of 9 star frames kept"),
        (10, "1 of 6 target frames kept"),
        (14, "5 of 6 target frames kept"),
    ] {
        let mut night = Night::copy_of(&original);
        night.options.jobs = 1;
        let stop = Stop::default();
        let listener = StopAfter { frames, seen: AtomicUsize::new(0), stop: stop.clone() };
        let options = satphot::pipeline::options::Options { stop, ..night.options.clone() };
        let error = run(&night.config().unwrap(), &options, &listener).unwrap_err();
        assert_eq!(error.exit_code(), 143);
        let text = error.to_string();
        assert!(text.contains(message) && text.contains("run the same line again"), "{frames}: {text}");
        assert!(!night.result("photometry.ecsv").exists(), "half a night must not look like a whole one");
        night.run().unwrap();
        assert_eq!(kept(&night), Some((frames, 15)));
        same(&data(&night), &want, &format!("stopped after {frames} frames"));
    }
}

#[test]
fn what_changed_is_measured_again_and_nothing_else() {
    let night = Night::copy_of(&simulated("resume_changed", &[]));
    let append = |name: &str, text: &str| {
        let path = night.path(name);
        let old = std::fs::read_to_string(&path).unwrap();
        std::fs::write(path, old + text).unwrap();
    };
    night.run().unwrap();
    let first = data(&night);
    night.run().unwrap();
    assert_eq!(kept(&night), Some((15, 15)), "nothing has changed");
    same(&data(&night), &first, "run again");

    // one pixel of one frame, far from the target: its own row alone
    let mut bytes = std::fs::read(night.path(TARGETS[2])).unwrap();
    let last = bytes.len() - 2_880;
    bytes[last] ^= 1;
    std::fs::write(night.path(TARGETS[2]), bytes).unwrap();
    night.run().unwrap();
    assert_eq!(kept(&night), Some((14, 15)), "one frame");

    // a blank line changes the file and no orbit; another set of hashes, the same zeropoint
    let elements = night.config().unwrap().orbit.unwrap().elements;
    append(elements.file_name().unwrap().to_str().unwrap(), "\n");
    night.run().unwrap();
    assert_eq!(kept(&night), Some((9, 15)), "the elements: target frames");
    append("catalogue.csv", "\n");
    night.run().unwrap();
    assert_eq!(kept(&night), Some((6, 15)), "the catalogue: star frames, and the zeropoint is the same");

    let before = data(&night);
    let night = night.set("photometry.aper_r_fwhm=1.9");
    night.run().unwrap();
    assert_eq!(kept(&night), None, "the configuration: every frame");
    assert!(data(&night) != before, "another aperture gives other numbers");
    let mut night = night;
    night.sets.clear();
    night.options.redo = true;
    night.run().unwrap();
    assert_eq!(kept(&night), None, "a recomputation was requested");
    same(&data(&night), &before, "recomputed");

    // a flat that was changed reaches every frame
    night.options.redo = false;
    support::fill(&night.path("flat_001.fits"), 27_000);
    night.run().unwrap();
    assert_eq!(kept(&night), None, "the flat: every frame");
    assert!(data(&night) != before);
}

#[test]
fn a_damaged_product_is_never_trusted() {
    let night = Night::copy_of(&simulated("resume_damaged", &[]));
    night.run().unwrap();
    let want = data(&night);
    let products: Vec<PathBuf> =
        std::fs::read_dir(night.result(".satphot")).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(products.len(), 18, "9 star frames, 6 of the target, the flat, hot pixels, the scale of one star frame");
    let damages: [(&str, fn(Vec<u8>) -> Vec<u8>); 5] = [
        ("cut in half", |b| b[..b.len() / 2].to_vec()),
        ("empty", |_| Vec::new()),
        ("one bit of the values", |mut b| {
            let at = b.len() - 3;
            b[at] ^= 4;
            b
        }),
        ("another key, as of another version", |mut b| {
            b[20] = if b[20] == b'a' { b'b' } else { b'a' };
            b
        }),
        ("zeros, as a crash of the machine leaves", |b| vec![0; b.len()]),
    ];
    for (what, damage) in damages {
        for path in &products {
            std::fs::write(path, damage(std::fs::read(path).unwrap())).unwrap();
        }
        night.run().unwrap();
        assert_eq!(kept(&night), None, "{what}");
        same(&data(&night), &want, what);
    }
}

#[test]
fn threads_and_the_order_and_place_of_the_inputs_do_not_reach_the_data() {
    let original = simulated("resume_order", &[]);
    let mut want: Option<Vec<Vec<u8>>> = None;
    for jobs in [1, 2, 7] {
        let mut night = Night::copy_of(&original);
        night.options.jobs = jobs;
        // the folder's own order, or every file by name in an order of its own
        if jobs > 1 {
            let mut files: Vec<PathBuf> = ["flat", "field", "target"].iter().flat_map(|p| night.frames(p)).collect();
            files.reverse();
            files.rotate_left(jobs);
            let names: Vec<String> = files.iter().map(|f| format!("{:?}", f.to_string_lossy())).collect();
            night = night.set(&format!("night.input=[{}]", names.join(",")));
        }
        night.run().unwrap();
        let got = data(&night);
        for (name, bytes) in DATA.iter().zip(&got).filter(|(name, _)| !name.ends_with(".fits")) {
            let text = String::from_utf8_lossy(bytes);
            let folder = night.path("");
            assert!(!text.contains(&*folder.to_string_lossy()), "{name} states where the night lies");
        }
        same(&got, want.get_or_insert_with(|| got.clone()), &format!("{jobs} threads"));
    }
}

#[test]
fn what_is_kept_of_frames_that_left_the_night_and_figures_half_written_are_cleared() {
    let night = Night::copy_of(&simulated("resume_left", &[]));
    night.run().unwrap();
    let products = |night: &Night| std::fs::read_dir(night.result(".satphot")).unwrap().count();
    let before = products(&night);
    std::fs::remove_file(night.path(TARGETS[0])).unwrap();
    // above the largest process number of Linux
    let half = night.result(&format!("figures/.sky.svg.tmp.{}.4999999", satphot::base::file::host()));
    std::fs::create_dir_all(half.parent().unwrap()).unwrap();
    std::fs::write(&half, "half").unwrap();
    night.run().unwrap();
    assert_eq!((products(&night), kept(&night)), (before - 1, Some((14, 14))));
    assert!(!half.exists() || !std::path::Path::new("/proc/self").exists());
}

#[test]
fn a_stop_before_the_first_header_ends_the_night_there_and_writes_nothing() {
    let night = Night::copy_of(&simulated("resume_survey", &[]));
    night.options.stop.flag().store(15, Ordering::SeqCst);
    let (code, message) = night.refusal();
    assert!(code == 143 && message.contains("headers"), "{code} {message}");
    assert!(!night.result("").exists());
    let plan = satphot::pipeline::groups::run_night(
        &night.config().unwrap(),
        &night.options,
        &satphot::base::progress::Silent,
    );
    assert_eq!(plan.map(drop).unwrap_err().exit_code(), 143);
}
