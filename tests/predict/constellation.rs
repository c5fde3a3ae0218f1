//! `satphot predict constellation`: placement against geometry, single satellites against the model, shards, threads.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use std::collections::HashMap;
use std::path::Path;

use support::{RunOutput, satphot};

const SITE: &str = "-33.7703,151.1113,70";
const SMALL: [&str; 15] = [
    "predict",
    "constellation",
    "--satellite",
    "bluebird-fm1",
    "--count",
    "3000",
    "--site",
    SITE,
    "--start",
    "2025-06-11T08:00:00",
    "--steps",
    "4",
    "--step-min",
    "120",
    "-q",
];

fn run(folder: &Path, more: &[&str]) -> RunOutput {
    satphot(folder, &[&SMALL[..], more].concat())
}

fn rows(text: &str) -> Vec<HashMap<String, String>> {
    csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(text.as_bytes())
        .deserialize()
        .map(Result::unwrap)
        .collect()
}

fn number(row: &HashMap<String, String>, name: &str) -> f64 {
    row[name].parse().unwrap_or(f64::NAN)
}

#[test]
fn shards_add_up_to_the_whole_and_their_rows_are_its_rows() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let whole = run(folder.path(), &["--csv", "-o", "whole.ecsv", "--rows", "whole.csv"]).expect(0, &[]);
    let mut lines: Vec<String> = Vec::new();
    for i in 1..=3 {
        let (shard, table, seen) = (format!("{i}/3"), format!("p{i}.ecsv"), format!("p{i}.csv"));
        run(folder.path(), &["--shard", &shard, "-o", &table, "--rows", &seen]).expect(0, &[]);
        lines.extend(at(&seen).lines().skip(1).map(str::to_string));
    }
    let merge = ["predict", "constellation", "--merge", "p3.ecsv", "p1.ecsv", "p2.ecsv", "--csv", "-q"];
    let merged = satphot(folder.path(), &merge).expect(0, &[]);
    assert_eq!(merged.out, whole.out);
    let mut all: Vec<String> = at("whole.csv").lines().skip(1).map(str::to_string).collect();
    all.sort();
    lines.sort();
    assert_eq!(all, lines);
    // what the rows say is what the table counts
    let counted = rows(&whole.out);
    let seen = rows(&at("whole.csv"));
    for moment in &counted {
        let own: Vec<f64> =
            seen.iter().filter(|r| r["date_mid"] == moment["date_mid"]).map(|r| number(r, "model_v_mag")).collect();
        assert_eq!(number(moment, "n_above_min_alt") as usize, own.len());
        assert_eq!(number(moment, "n_lit") as usize, own.iter().filter(|v| v.is_finite()).count());
        assert_eq!(number(moment, "n_brighter_10") as usize, own.iter().filter(|v| **v < 10.0).count());
        let mut lit: Vec<f64> = own.into_iter().filter(|v| v.is_finite()).collect();
        lit.sort_by(f64::total_cmp);
        let median = lit[lit.len().div_ceil(2) - 1];
        // half a step of the histogram, two digits of the table
        assert!((number(moment, "model_v_mag") - median).abs() < 0.02, "{median}");
    }
}

#[test]
fn threads_change_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let with = |jobs: &str| {
        let (table, seen) = (format!("t{jobs}.ecsv"), format!("t{jobs}.csv"));
        run(folder.path(), &["-j", jobs, "-o", &table, "--rows", &seen]).expect(0, &[]);
        let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
        (read(&table), read(&seen))
    };
    assert_eq!(with("1"), with("3"));
}

#[test]
fn as_many_satellites_are_up_as_the_share_of_their_shell_in_view() {
    // polar orbits, even in node: from the equator the share of time a satellite at height h is up follows from its circle
    // of visibility, theta = acos(R/(R+h)), and the time spent there; averaged over the day and a dense pattern
    let folder = tempfile::tempdir().unwrap();
    let args = [
        "predict",
        "constellation",
        "--satellite",
        "bluebird-fm1",
        "--count",
        "40000",
        "--height-km",
        "550",
        "--inclination-deg",
        "90",
        "--planes",
        "200",
        "--site",
        "0,0,0",
        "--start",
        "2025-03-20T00:00:00",
        "--steps",
        "3",
        "--step-min",
        "480",
        "--min-alt",
        "89",
        "--csv",
        "-q",
    ];
    let output = satphot(folder.path(), &args).expect(0, &[]);
    let theta = (6378.137_f64 / 6928.137).acos();
    // density of polar orbits per solid angle at latitude b: 1/(2 pi^2 cos b); over the cap around the equator
    let n = 2000;
    let share: f64 = (0..n)
        .map(|k| {
            let b = theta * (2.0 * (f64::from(k) + 0.5) / f64::from(n) - 1.0);
            let half = (theta.cos() / b.cos()).acos();
            2.0 * half * (2.0 * theta / f64::from(n)) / (2.0 * std::f64::consts::PI.powi(2))
        })
        .sum();
    for row in rows(&output.out) {
        let up = number(&row, "n_above_horizon");
        // the pattern is a lattice: its count in a cap scatters by its edge
        assert!((up / (40_000.0 * share) - 1.0).abs() < 0.03, "{up} {}", 40_000.0 * share);
        assert!(number(&row, "n_above_min_alt") < 0.01 * up);
    }
}

#[test]
fn elements_of_a_file_are_where_predict_pass_puts_them() {
    let elements = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/night/iss-2025-june.tle");
    let folder = tempfile::tempdir().unwrap();
    let (time, end) = ("2025-06-09T10:33:00", "2025-06-09T10:33:01");
    let args =
        ["predict", "constellation", "--elements", elements, "--satellite", "iss", "--site", SITE, "--start", time];
    let more = ["--steps", "1", "--rows", "seen.csv", "--tolerance", "1e-4", "-q"];
    satphot(folder.path(), &[&args[..], &more].concat()).expect(0, &[]);
    let seen = rows(&std::fs::read_to_string(folder.path().join("seen.csv")).unwrap()).remove(0);
    let pass = [
        "predict",
        "pass",
        "--elements",
        elements,
        "--satellite",
        "iss",
        "--site",
        SITE,
        "--start",
        time,
        "--end",
        end,
    ];
    let pass = satphot(folder.path(), &[&pass[..], &["--step-s", "1", "--csv", "-q"]].concat()).expect(0, &[]);
    let pass = rows(&pass.out).remove(0);
    assert_eq!(seen["number"], pass["norad_cat_id"]);
    for (name, off) in [("alt_deg", 1e-4), ("az_deg", 1e-4), ("range_km", 1e-3), ("model_v_mag", 2e-4)] {
        assert!((number(&seen, name) - number(&pass, name)).abs() < off, "{name}: {} {}", seen[name], pass[name]);
    }
}

#[test]
fn what_cannot_be_computed_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("empty.tle"), "").unwrap();
    for (more, word) in [
        (&["--shard", "4/3"][..], "--shard"),
        (&["--steps", "0"], "--steps"),
        (&["--min-alt", "95"], "--min-alt"),
        (&["--height-km", "40", "--inclination-deg", "50"], "--height-km"),
        (&["--planes", "3", "--inclination-deg", "190"], "--inclination-deg"),
        (&["-o", "counts.csv"], "ECSV"),
    ] {
        let output = run(folder.path(), more).without_results();
        assert!(output.code == 2 && output.err.contains(word), "{more:?}: {output:?}");
    }
    // starlink-v2 flies in several inclinations: which is asked for
    let args =
        ["predict", "constellation", "--satellite", "starlink-v2", "--site", SITE, "--start", "2025-06-11T08:00:00"];
    satphot(folder.path(), &args).expect(2, &["--inclination-deg"]).without_results();
    let elements = ["--elements", "empty.tle", "--steps", "1"];
    satphot(folder.path(), &[&args[..], &elements].concat()).expect(4, &["empty.tle"]).without_results();
    std::fs::write(folder.path().join("other.ecsv"), "# %ECSV 1.0\na,b\n1,2\n").unwrap();
    let merge = ["predict", "constellation", "--merge", "other.ecsv"];
    satphot(folder.path(), &merge).expect(4, &["other.ecsv", "missing"]).without_results();
}
