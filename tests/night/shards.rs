//! A night in shards: in whatever number, order and grouping they are measured and merged, on however many
//! threads, with shards lost, doubled and stopped, the tables are those of the run on one machine, byte for byte.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::path::PathBuf;

use support::{Night, RunOutput, TARGETS, simulated};

const TABLES: [&str; 4] = ["photometry.ecsv", "residuals.ecsv", "stars.ecsv", "zeropoint.toml"];

/// A night that was run, and its tables.
fn run_once(night: &Night) -> Vec<Vec<u8>> {
    night.satphot(&["run", "-q", "--no-figures"]);
    TABLES.iter().map(|name| std::fs::read(night.result(name)).unwrap_or_default()).collect()
}

fn plan(night: &Night, frames_per_shard: usize) -> usize {
    let per = frames_per_shard.to_string();
    night.satphot(&["plan", "-q", "--frames-per-shard", &per, "-o", "plan.json"]).expect(0, &[]);
    let text = std::fs::read_to_string(night.path("plan.json")).unwrap();
    let plan: serde_json::Value = serde_json::from_str(&text).unwrap();
    plan["shards"].as_array().unwrap().len()
}

fn stars(night: &Night) {
    night.satphot(&["flat", "-q", "--plan", "plan.json", "-o", "night/master_flat.fits"]).expect(0, &[]);
    night.satphot(&["zeropoint", "-q", "--plan", "plan.json", "-o", "night/zeropoint.toml"]).expect(0, &[]);
}

fn measure(night: &Night, shard: usize, more: &[&str]) -> RunOutput {
    let (number, out) = (shard.to_string(), table(shard));
    let args = ["measure", "--plan", "plan.json", "--shard", &number, "--out", &out];
    night.satphot(&[&args[..], &["--zeropoint", "night/zeropoint.toml"], more].concat())
}

fn table(shard: usize) -> String {
    format!("night/shards/{shard}.ecsv")
}

fn merge(night: &Night, tables: &[String], more: &[&str]) -> RunOutput {
    let tables: Vec<&str> = tables.iter().map(String::as_str).collect();
    night.satphot(&[&["merge", "--plan", "plan.json"][..], &tables, more].concat())
}

/// The merged tables are those of the run.
fn same_as(night: &Night, want: &[Vec<u8>], when: &str) {
    for (name, want) in TABLES.iter().zip(want) {
        let got = std::fs::read(night.path(&format!("night/{name}"))).unwrap_or_default();
        assert!(got == *want, "{name} is not that of the run: {when}");
    }
}

#[test]
fn one_three_and_six_shards_make_the_tables_of_the_run() {
    let night = Night::copy_of(&simulated("shards_numbers", &[]));
    let want = run_once(&night);
    let of_run = std::fs::read(night.result("pass_stack.ecsv")).unwrap();
    for (per, shards) in [(100, 1), (2, 3), (1, 6)] {
        std::fs::remove_dir_all(night.path("night")).ok();
        assert_eq!(plan(&night, per), shards);
        stars(&night);
        assert_eq!(std::fs::read(night.path("night/master_flat.fits")).unwrap(), {
            std::fs::read(night.result("master_flat.fits")).unwrap()
        });
        (0..shards).rev().for_each(|shard| _ = measure(&night, shard, &["-q"]).expect(0, &[]));
        let mut tables: Vec<String> = (0..shards).map(table).collect();
        tables.rotate_left(shards / 2);
        let stack = ["-o", "night/photometry.ecsv", "--stack", "--zeropoint", "night/zeropoint.toml"];
        merge(&night, &tables, &stack).expect(0, &[]);
        let stacked = std::fs::read(night.path("night/pass_stack.ecsv")).unwrap_or_default();
        assert!(!stacked.is_empty() && stacked == of_run, "pass_stack.ecsv is not that of the run: {shards} shards");
        same_as(&night, &want, &format!("{shards} shards"));
    }
}

#[test]
fn hot_pixels_by_the_star_frames_are_those_of_the_run_in_every_shard() {
    let night = crate::zero_level::with_hot_pixels(Night::copy_of(&simulated("shards_hot_pixels", &[])));
    let want = run_once(&night);
    let photometry = String::from_utf8_lossy(&want[0]);
    assert!(photometry.contains("pedestal, hot pixels of "), "{photometry}");
    let shards = plan(&night, 3);
    stars(&night);
    (0..shards).for_each(|shard| _ = measure(&night, shard, &["-q"]).expect(0, &[]));
    merge(&night, &(0..shards).map(table).collect::<Vec<_>>(), &["-o", "night/photometry.ecsv"]);
    same_as(&night, &want, "hot pixels");
    // a shard where the star frames are not
    std::fs::remove_dir_all(night.path("night/shards")).unwrap();
    std::fs::remove_file(&night.frames("field")[0]).unwrap();
    measure(&night, 0, &["-q"]).expect(4, &["is in the plan but cannot be read here"]);
}

#[test]
fn frames_between_pilots_are_looked_at_in_the_same_place_in_every_shard() {
    let night = Night::copy_of(&simulated("shards_pilots", crate::pilots::PASSES));
    // a copy counts once, and moves no number
    std::fs::copy(night.path("target_0003.fits"), night.path("target_0003_copy.fits")).unwrap();
    let want = run_once(&night);
    let radius_px: Vec<f64> = night.rows().iter().filter_map(|row| row.search_radius_px).collect();
    let whole_px = radius_px.iter().copied().fold(0.0, f64::max);
    assert!(radius_px.iter().filter(|r| **r < 0.5 * whole_px).count() > 15, "{radius_px:?}");
    for per in [4, 13] {
        std::fs::remove_dir_all(night.path("night")).ok();
        let shards = plan(&night, per);
        stars(&night);
        (0..shards).for_each(|shard| _ = measure(&night, shard, &["-q"]).expect(0, &[]));
        merge(&night, &(0..shards).map(table).collect::<Vec<_>>(), &["-o", "night/photometry.ecsv"]).expect(0, &[]);
        same_as(&night, &want, &format!("{per} frames per shard"));
    }
}

#[test]
fn shards_lost_doubled_and_summed_by_parts_make_one_table() {
    let night =
        Night::copy_of(&simulated("shards_lost", &["target.n=7", "target.offset_mag=2.5", "target.scatter_mag=1.5"]));
    let want = run_once(&night);
    assert_eq!(plan(&night, 2), 4);
    stars(&night);
    (0..4).for_each(|shard| _ = measure(&night, shard, &["-q"]).expect(0, &[]));
    let all: Vec<String> = (0..4).map(table).collect();

    std::fs::remove_file(night.path(&all[2])).unwrap();
    let out = ["-o", "night/photometry.ecsv"];
    let output = merge(&night, &[all[0].clone(), all[1].clone(), all[3].clone()], &out);
    output.expect(3, &["2 frames of 1 of 4 shards are missing", "shard 2: target_0004.fits", "--allow-missing"]);
    assert!(!night.path("night/photometry.ecsv").exists(), "nothing is written when frames are missing");

    let half = |tables: &[usize], name: &str| {
        let tables: Vec<String> = tables.iter().map(|t| table(*t)).collect();
        merge(&night, &tables, &["--allow-missing", "-o", name]).expect(0, &["are missing"]);
        name.to_string()
    };
    let (a, b) = (half(&[3, 0], "night/a.ecsv"), half(&[1, 3], "night/b.ecsv"));
    let ab = "night/ab.ecsv".to_string();
    merge(&night, &[b, a], &["--allow-missing", "-o", &ab]).expect(0, &["frames are in more than one table"]);
    measure(&night, 2, &["-q"]).expect(0, &[]);
    merge(&night, &[ab, all[2].clone()], &out).expect(0, &[]);
    same_as(&night, &want, "a sum of sums");

    // a whole night among the tables is the whole night; every shard twice
    merge(&night, &["night/photometry.ecsv".into(), all[1].clone()], &["-o", "night/again.ecsv"]).expect(0, &[]);
    assert_eq!(std::fs::read(night.path("night/again.ecsv")).unwrap(), want[0]);
    merge(&night, &[all.clone(), all].concat(), &out).expect(0, &["7 frames are in more than one table"]);
    same_as(&night, &want, "every shard twice");
}

#[test]
fn a_shard_is_measured_once_and_its_bytes_tell_nothing_of_the_worker() {
    let night = Night::copy_of(&simulated("shards_once", &[]));
    assert_eq!(plan(&night, 3), 2);
    stars(&night);
    measure(&night, 1, &["-j", "1"]).expect(0, &[]);
    let file = night.path(&table(1));
    let (bytes, time) = (std::fs::read(&file).unwrap(), file.metadata().unwrap().modified().unwrap());
    assert!(measure(&night, 1, &[]).expect(0, &[]).out.contains("was there already"));
    assert_eq!(file.metadata().unwrap().modified().unwrap(), time, "left as it was");
    assert!(!measure(&night, 1, &["--force", "-j", "7"]).expect(0, &[]).out.contains("already"));
    assert_eq!(std::fs::read(&file).unwrap(), bytes, "7 threads");
    // half a table, as a copy that was cut off leaves it
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    assert!(!measure(&night, 1, &[]).expect(0, &[]).out.contains("already"));
    assert_eq!(std::fs::read(&file).unwrap(), bytes);
    let side: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(night.path("night/shards/1.json")).unwrap()).unwrap();
    assert_eq!((side["shard"].as_u64(), side["frames"].as_u64()), (Some(1), Some(3)));
    assert!(side["wall_s"].is_number() && side["bytes"].as_u64().unwrap() > 100_000, "{side}");
    let left: Vec<PathBuf> =
        std::fs::read_dir(night.path("night/shards/.satphot")).unwrap().map(|e| e.unwrap().path()).collect();
    assert!(left.is_empty(), "frames kept for another try are of no use once the shard is whole: {left:?}");

    // the same plan elsewhere: the same bytes
    let other = Night::copy_of(&simulated("shards_once_more", &[]));
    plan(&other, 3);
    stars(&other);
    measure(&other, 1, &[]).expect(0, &[]);
    assert_eq!(std::fs::read(other.path(&table(1))).unwrap(), bytes, "another folder");
}

#[test]
fn files_that_are_not_those_of_the_plan_are_refused_before_anything_is_written() {
    let night = Night::copy_of(&simulated("shards_refused", &[]));
    plan(&night, 3);
    measure(&night, 0, &[]).expect(4, &["zeropoint.stars.toml", "`zeropoint` with --plan"]);
    stars(&night);
    measure(&night, 2, &[]).expect(2, &["--shard", "0 to 1"]);
    let frame = night.path(TARGETS[4]);
    let good = std::fs::read(&frame).unwrap();
    let mut bad = good.clone();
    let last = bad.len() - 2_880;
    bad[last] ^= 1;
    std::fs::write(&frame, bad).unwrap();
    measure(&night, 1, &[]).expect(6, &[TARGETS[4], "plan again"]).without_results();
    std::fs::remove_file(&frame).unwrap();
    measure(&night, 1, &[]).expect(4, &[TARGETS[4], "in the plan"]).without_results();
    assert!(!night.path(&table(1)).exists());
    std::fs::write(&frame, good).unwrap();
    measure(&night, 1, &[]).expect(0, &[]);
    measure(&night, 0, &[]).expect(0, &[]);
    // another configuration, another plan: its shards do not go with these
    night.satphot(&["plan", "-q", "-o", "plan.json", "--set", "photometry.aper_r_fwhm=1.9"]).expect(0, &[]);
    merge(&night, &[table(0), table(1)], &[]).expect(6, &["config_sha256"]).without_results();
    measure(&night, 0, &[]).expect(6, &["zeropoint.stars.toml", "another plan"]).without_results();
}

#[test]
fn a_night_full_of_trouble_is_the_same_in_shards() {
    let original = simulated("shards_trouble", &["target.n=8", "flats.n=5"]);
    let night = Night::copy_of(&original);
    support::fill(&night.path("flat_001.fits"), 65_535); // saturated: rejected
    support::fill(&night.path("field01_01.fits"), 1_000); // no star: failed
    support::fill_nan(&night.path("target_0001.fits")); // no usable pixel: failed
    support::set_card(&night.path("target_0003.fits"), "DATE-OBS", None); // no time: unreadable
    std::fs::copy(night.path("target_0005.fits"), night.path("target_0005_copy.fits")).unwrap();
    let want = run_once(&night);
    let rows = night.rows();
    let n = |status: &str| rows.iter().filter(|r| r.status == status).count();
    assert!(n("failed") == 3 && n("rejected") >= 1, "{:?}", rows.iter().map(|r| &r.status).collect::<Vec<_>>());
    assert_eq!(rows.iter().filter(|r| r.frame.starts_with("target_0005")).count(), 1, "an exposure counts once");
    assert!(rows.iter().all(|r| !r.reason.contains('/')), "reasons name files, not folders");
    let shards = plan(&night, 2);
    stars(&night);
    (0..shards).for_each(|shard| _ = measure(&night, shard, &["-q"]).expect(0, &[]));
    merge(&night, &(0..shards).map(table).collect::<Vec<_>>(), &["-o", "night/photometry.ecsv"]).expect(0, &[]);
    same_as(&night, &want, "with frames that failed");

    // neither stars nor flats: instrumental magnitudes, and the same
    let night = Night::copy_of(&original).without_table("stars").remove("flat");
    let want = run_once(&night);
    let shards = plan(&night, 3);
    night.satphot(&["zeropoint", "-q", "--plan", "plan.json", "-o", "night/zeropoint.toml"]).expect(0, &[]);
    (0..shards).for_each(|shard| _ = measure(&night, shard, &["-q"]).expect(0, &[]));
    merge(&night, &(0..shards).map(table).collect::<Vec<_>>(), &["-o", "night/photometry.ecsv"]).expect(0, &[]);
    same_as(&night, &[want[0].clone(), want[1].clone()], "without stars and flats");
}

#[test]
fn shards_of_a_sky_and_of_a_constellation_sum_to_the_table_of_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let satphot = |args: &[&str]| support::satphot(folder.path(), args);
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    let place = ["--site=-33.7703,151.1113,70", "-q"];
    let sky = ["predict", "sky", "--satellite", "starlink-v1.5", "--height-km", "550", "--grid", "5x8"];
    let sky = [&sky[..], &["--time", "2025-06-09T08:30:00"], &place].concat();
    let counts = ["predict", "constellation", "--satellite", "starlink-v1.5", "--count", "60", "--steps", "2"];
    let counts = [&counts[..], &["--inclination-deg", "53"]].concat();
    let counts = [&counts[..], &["--start", "2025-06-09T08:30:00"], &place].concat();
    for (verb, args) in [("sky", sky), ("constellation", counts)] {
        satphot(&[&args[..], &["-o", "whole.ecsv"]].concat()).expect(0, &[]);
        for i in 1..=3 {
            let (shard, out) = (format!("{i}/3"), format!("{i}.ecsv"));
            satphot(&[&args[..], &["--shard", &shard, "-o", &out]].concat()).expect(0, &[]);
        }
        let sum = |tables: &[&str], out: &str| {
            satphot(&[&["predict", verb, "-q", "-o", out, "--merge"][..], tables].concat())
        };
        sum(&["3.ecsv", "1.ecsv", "2.ecsv", "1.ecsv"], "sum.ecsv").expect(0, &[]);
        assert!(bytes("sum.ecsv") == bytes("whole.ecsv"), "{verb}: any order, one twice");
        sum(&["3.ecsv", "1.ecsv"], "part.ecsv").expect(3, &["shards 2 of 3 are missing"]);
        sum(&["2.ecsv", "part.ecsv"], "sum.ecsv").expect(0, &[]);
        assert!(bytes("sum.ecsv") == bytes("whole.ecsv"), "{verb}: a sum of sums");
    }
    satphot(&["predict", "constellation", "--merge", "1.ecsv", "whole.ecsv"]).expect(6, &["of one prediction"]);
}
