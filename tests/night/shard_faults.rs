//! Shards of a night that are damaged, changed or measured by the wrong line: nothing of it is lost, trusted or hidden.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use support::{Night, RunOutput, TARGETS, fill, simulated};

/// Plans, makes flat and zeropoint, measures shards of `per` frames and merges into night/.
fn in_pieces(night: &Night, per: usize) -> RunOutput {
    let (per, plan) = (per.to_string(), "night/plan.json");
    night.satphot(&["plan", "-q", "--frames-per-shard", &per, "-o", plan]).expect(0, &[]);
    night.satphot(&["flat", "-q", "--plan", plan, "-o", "night/master_flat.fits"]);
    night.satphot(&["zeropoint", "-q", "--plan", plan, "-o", "night/zeropoint.toml"]);
    let text = std::fs::read_to_string(night.path(plan)).unwrap();
    let shards = serde_json::from_str::<serde_json::Value>(&text).unwrap()["shards"].as_array().unwrap().len();
    let tables: Vec<String> = (0..shards).map(|n| format!("night/shards/{n}.ecsv")).collect();
    for (n, table) in tables.iter().enumerate() {
        measure(night, n, table).expect(0, &[]);
    }
    merge(night, &tables)
}

fn measure(night: &Night, shard: usize, table: &str) -> RunOutput {
    let shard = shard.to_string();
    let plan = ["measure", "-q", "--plan", "night/plan.json", "--shard", &shard];
    night.satphot(&[&plan[..], &["--zeropoint", "night/zeropoint.toml", "--out", table]].concat())
}

fn merge(night: &Night, tables: &[String]) -> RunOutput {
    let tables: Vec<&str> = tables.iter().map(String::as_str).collect();
    night.satphot(&[&["merge", "-q", "--plan", "night/plan.json", "-o", "night/photometry.ecsv"][..], &tables].concat())
}

fn merged(night: &Night) -> Vec<u8> {
    std::fs::read(night.path("night/photometry.ecsv")).unwrap_or_default()
}

#[test]
fn damaged_frames_of_one_name_in_two_folders_are_rows_of_their_own() {
    let night = Night::copy_of(&simulated("pieces_names", &["target.n=4", "pointings.n=2"]));
    for (folder, empty, cut) in [("a", TARGETS[0], TARGETS[1]), ("b", TARGETS[0], TARGETS[2])] {
        std::fs::create_dir_all(night.path(folder)).unwrap();
        std::fs::write(night.path(folder).join(empty), b"").unwrap();
        std::fs::write(night.path(folder).join(cut), &std::fs::read(night.path(cut)).unwrap()[..5_000]).unwrap();
    }
    night.satphot(&["run", "-q", "--no-figures"]).expect(0, &[]);
    let want = std::fs::read(night.result("photometry.ecsv")).unwrap();
    assert_eq!(night.rows().iter().filter(|r| r.status == "failed").count(), 4);
    in_pieces(&night, 2).expect(0, &[]);
    assert!(merged(&night) == want, "the merged table is not that of the run");
}

#[test]
fn a_table_that_was_changed_is_measured_again_and_never_merged() {
    let night = Night::copy_of(&simulated("pieces_changed", &["pointings.n=2"]));
    in_pieces(&night, 3).expect(0, &[]);
    let (want, table) = (merged(&night), night.path("night/shards/1.ecsv"));
    let good = std::fs::read_to_string(&table).unwrap();
    let tables = ["night/shards/0.ecsv".to_string(), "night/shards/1.ecsv".to_string()];
    // a row lost; a flux and a name changed in the last one
    let (rest, last) = good.trim_end().rsplit_once('\n').unwrap();
    let columns: Vec<&str> = good.lines().find(|l| l.starts_with("frame,")).unwrap().split(',').collect();
    let with = |column: &str, value: &str| {
        let at = columns.iter().position(|c| *c == column).unwrap();
        let cells = last.split(',').enumerate().map(|(k, cell)| if k == at { value } else { cell });
        format!("{rest}\n{}\n", cells.collect::<Vec<_>>().join(","))
    };
    let (flux, name) = (with("flux_e", "12345.0"), with("frame", "target_0099.fits"));
    for bad in [&format!("{rest}\n"), &flux, &name] {
        std::fs::write(&table, bad).unwrap();
        merge(&night, &tables).expect(6, &["1.ecsv: was changed after it was written (rows_sha256)", "--force"]);
        measure(&night, 1, "night/shards/1.ecsv").expect(0, &[]);
        assert_eq!(std::fs::read_to_string(&table).unwrap(), good, "measured again, not trusted");
    }
    // a changed copy with a hash of its own contradicts the table it is of, in either order
    let forged = |text: &str| {
        let path = night.path("copy.ecsv");
        std::fs::write(&path, text).unwrap();
        let (rows, meta) = satphot::tables::read_photometry(&path).unwrap();
        satphot::tables::write_photometry(&path, &rows, &meta).unwrap();
    };
    forged(&flux);
    let mut with_copy = [&tables[..], &["copy.ecsv".to_string()]].concat();
    merge(&night, &with_copy).expect(6, &["do not agree on it"]);
    with_copy.reverse();
    merge(&night, &with_copy).expect(6, &["do not agree on it"]);
    forged(&name);
    merge(&night, &with_copy).expect(6, &["target_0099.fits", "is not a frame of the plan"]);
    merge(&night, &tables).expect(0, &[]);
    assert_eq!(merged(&night), want);
}

#[test]
fn a_plan_whose_shards_are_not_the_target_frames_once_each_is_refused() {
    let night = Night::copy_of(&simulated("pieces_plan", &["pointings.n=2"]));
    night.satphot(&["plan", "-q", "-o", "night/plan.json"]).expect(0, &[]);
    let plan: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(night.path("night/plan.json")).unwrap()).unwrap();
    let first = plan["shards"][0][0].clone();
    for shards in [serde_json::json!([]), serde_json::json!([[]]), serde_json::json!([[first, first]])] {
        let mut bad = plan.clone();
        bad["shards"] = shards;
        std::fs::write(night.path("bad.json"), bad.to_string()).unwrap();
        night.satphot(&["verify", "bad.json"]).expect(6, &["was changed by hand; plan again"]);
    }
}

#[test]
fn a_shard_without_a_plan_is_a_wrong_line() {
    let night = Night::copy_of(&simulated("pieces_line", &["pointings.n=2"]));
    let output = night.satphot(&["measure", "--shard", "1", "-c", "pipeline.toml"]);
    output.expect(2, &["--shard", "--plan"]);
    assert!(!night.path("photometry.ecsv").exists());
}

#[test]
fn a_night_in_shards_without_a_zeropoint_has_its_report_and_one_with_it_is_verified() {
    let night = Night::copy_of(&simulated("pieces_report", &["pointings.n=2"]));
    in_pieces(&night, 4).expect(0, &[]);
    night.satphot(&["report", "night"]).expect(0, &[]);
    night.satphot(&["verify", "night"]).expect(0, &[]);
    let page = std::fs::read_to_string(night.path("night/report.html")).unwrap();
    assert!(!page.contains("no readable manifest.json"));
    let table = std::fs::read_to_string(night.path("night/stars.ecsv")).unwrap();
    std::fs::write(night.path("night/stars.ecsv"), table.replacen('1', "2", 1)).unwrap();
    night.satphot(&["verify", "night"]).expect(6, &["stars.ecsv"]);

    let night = night.remove("field");
    std::fs::remove_dir_all(night.path("night")).unwrap();
    in_pieces(&night, 4).expect(0, &[]);
    night.satphot(&["report", "night"]).expect(0, &[]);
}

#[test]
fn the_flat_of_a_plan_is_that_of_the_run_and_the_zeropoint_leaves_it_alone() {
    let night = Night::copy_of(&simulated("pieces_flat", &["pointings.n=2"]));
    night.satphot(&["run", "-q", "--no-figures"]).expect(0, &[]);
    night.satphot(&["plan", "-q", "-o", "night/plan.json"]).expect(0, &[]);
    night.satphot(&["flat", "-q", "--plan", "night/plan.json", "-o", "night/master_flat.fits"]).expect(0, &[]);
    let flat = night.path("night/master_flat.fits");
    assert!(std::fs::read(&flat).unwrap() == std::fs::read(night.result("master_flat.fits")).unwrap());
    let made = flat.metadata().unwrap().modified().unwrap();
    night.satphot(&["zeropoint", "-q", "--plan", "night/plan.json", "-o", "night/zeropoint.toml"]).expect(0, &[]);
    assert_eq!(flat.metadata().unwrap().modified().unwrap(), made);
}

#[test]
fn a_frame_that_was_never_filled_is_a_row_with_that_reason_and_such_a_flat_is_skipped() {
    let night = Night::copy_of(&simulated("pieces_filled", &["pointings.n=2"]));
    let why = "every pixel is 700 ADU: the file was never filled";
    fill(&night.path(TARGETS[2]), 700);
    fill(&night.path("flat_001.fits"), 700);
    night.satphot(&["run", "-q", "--no-figures"]).expect(0, &[]);
    let row = night.row(TARGETS[2]);
    assert!(row.status == "failed" && row.reason.ends_with(why) && row.v_mag.is_none(), "{}", row.reason);
    let manifest = night.manifest();
    let flats = manifest["flats"].as_array().unwrap();
    let filled = |f: &&serde_json::Value| !f["reason"].as_str().unwrap().contains("never filled");
    assert_eq!(flats.iter().filter(filled).count(), flats.len() - 1, "{flats:?}");
}

#[test]
#[cfg(unix)]
fn a_device_or_a_pipe_among_the_frames_is_a_row_and_not_the_end_of_time() {
    let night = Night::copy_of(&simulated("pieces_device", &["pointings.n=2"]));
    std::os::unix::fs::symlink("/dev/zero", night.path("zero.fits")).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(night.path("pipe.fits")).status().is_ok_and(|s| s.success()));
    for line in [&["run", "-q", "--no-figures"][..], &["plan", "-q", "-o", "night/plan.json"]] {
        night.satphot(line).expect(0, &[]);
    }
    for name in ["zero.fits", "pipe.fits"] {
        let row = night.row(name);
        assert!(row.status == "failed" && row.reason.contains("not a regular file"), "{}", row.reason);
    }
}
