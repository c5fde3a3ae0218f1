//! `satphot export` as a user meets it: a simulated night, a table that is damaged, options that are missing.
#![allow(clippy::unwrap_used)]

use crate::support;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use support::{Night, satphot, simulated};

/// Folder of the results of a tiny simulated night, made once.
fn results() -> &'static PathBuf {
    static RESULTS: OnceLock<PathBuf> = OnceLock::new();
    RESULTS.get_or_init(|| {
        let folder = simulated("export", &[]);
        let night = Night::copy_of(&folder);
        night.run().unwrap();
        let kept = folder.join("results");
        std::fs::create_dir_all(&kept).unwrap();
        for name in ["photometry.ecsv", "stars.ecsv", "residuals.ecsv", "effective.toml", "manifest.json"] {
            std::fs::copy(night.result(name), kept.join(name)).unwrap();
        }
        kept
    })
}

/// A copy of the results whose photometry is changed.
fn changed(change: impl Fn(String) -> String) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(results()).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
    }
    let table = folder.path().join("photometry.ecsv");
    std::fs::write(&table, change(std::fs::read_to_string(&table).unwrap())).unwrap();
    folder
}

/// As if the frames were real, and every measured row usable.
fn real(text: String) -> String {
    text.replace("{data_mode: SIMULATED}", "{data_mode: REAL}").replace(",ok,caution,", ",ok,use,")
}

const WHO: [&str; 8] = [
    "--email",
    "me@example.org",
    "--orcid",
    "0000-0002-1825-0097",
    "--observing-mode",
    "CMOS",
    "--organisation",
    "MY_OBS",
];

fn export(folder: &Path, args: &[&str]) -> support::RunOutput {
    satphot(folder, &[&["export"], args].concat())
}

#[test]
fn a_folder_becomes_tables_and_nothing_is_said_on_standard_output() {
    let folder = changed(|t| t);
    for format in ["fits", "votable", "csv"] {
        let out = format!("night.{format}");
        let output =
            export(folder.path(), &[".", "--to", format, "-o", &out]).expect(0, &["rows of photometry", "wrote"]);
        output.without_results();
        assert!(std::fs::metadata(folder.path().join(&out)).unwrap().len() > 1000);
    }
    let fits = std::fs::read(folder.path().join("night.fits")).unwrap();
    let text = String::from_utf8_lossy(&fits);
    assert!(
        ["PHOTOMETRY", "ZEROPOINT", "PROVENANCE", "config.night.name", "manifest.inputs.0"]
            .iter()
            .all(|w| text.contains(w))
    );
    export(folder.path(), &["stars.ecsv", "--to", "votable", "-o", "s.vot"]).expect(0, &["rows of stars"]);
    export(folder.path(), &["residuals.ecsv", "--to", "csv", "-o", "r.csv"]).expect(0, &["rows of residuals"]);
    export(folder.path(), &[".", "--to", "csv", "-o", "q.csv", "-q"]).expect(0, &[]);
}

#[test]
fn simulated_frames_mark_their_table_and_are_refused_for_score() {
    let folder = changed(|t| t);
    let args = [&[".", "--to", "score", "-o", "s.csv"], &WHO[..]].concat();
    export(folder.path(), &args).expect(2, &["SIMULATED", "SCORE"]).without_results();
    assert!(!folder.path().join("s.csv").exists());
    let forced = [&args[..], &["--data-mode", "real"]].concat();
    export(folder.path(), &forced).expect(2, &["--data-mode", "not real"]);
    let args = [&[".", "--to", "udl", "-o", "u.json", "--verdicts", "use,caution"], &WHO[..]].concat();
    export(folder.path(), &args).expect(0, &["SIMULATED"]);
    let text = std::fs::read_to_string(folder.path().join("u.json")).unwrap();
    assert!(text.contains("\"dataMode\":\"SIMULATED\""), "{text}");
    // a table that does not say is asked about
    let silent = changed(|t| t.replace("# - {data_mode: SIMULATED}\n", ""));
    let args = [&[".", "--to", "score", "-o", "s.csv"], &WHO[..]].concat();
    export(silent.path(), &args).expect(2, &["--data-mode"]);
}

#[test]
fn real_data_go_to_every_archive_and_pass_the_check() {
    let folder = changed(real);
    let args = [&[".", "--to", "score", "-o", "s.csv"], &WHO[..]].concat();
    export(folder.path(), &args).expect(0, &["observations", "wrote"]).without_results();
    let output = export(folder.path(), &["--check", "s.csv"]).expect(0, &[]);
    assert!(output.out.contains("rules hold"), "{}", output.out);
    let args = [&[".", "--to", "tdm", "-o", "n.tdm"], &WHO[..]].concat();
    export(folder.path(), &args).expect(0, &[]);
    export(folder.path(), &[".", "--to", "iod", "-o", "n.iod", "--iod-station", "8000"]).expect(0, &[]);
    for name in ["s.csv", "n.tdm", "n.iod"] {
        assert!(std::fs::metadata(folder.path().join(name)).unwrap().len() > 70, "{name}");
    }
    // the same from [reporter] of a configuration
    let effective = std::fs::read_to_string(folder.path().join("effective.toml")).unwrap();
    let reporter = "\n[reporter]\norganisation = \"MY_OBS\"\nemail = \"me@example.org\"\n\
                    orcid = [\"0000-0002-1825-0097\"]\nobserving_mode = \"CMOS\"\n";
    std::fs::write(folder.path().join("effective.toml"), effective + reporter).unwrap();
    export(folder.path(), &[".", "--to", "score", "-o", "s2.csv"]).expect(0, &[]);
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("s.csv"), read("s2.csv"));
}

#[test]
fn a_broken_score_file_is_reported_row_by_row() {
    let folder = changed(real);
    let args = [&[".", "--to", "score", "-o", "s.csv"], &WHO[..]].concat();
    export(folder.path(), &args).expect(0, &[]);
    let text = std::fs::read_to_string(folder.path().join("s.csv")).unwrap();
    std::fs::write(folder.path().join("s.csv"), text.replacen(",25544,", ",ISS,", 1)).unwrap();
    let output = export(folder.path(), &["--check", "s.csv"]).expect(4, &["s.csv", "1 errors"]);
    assert!(output.out.contains("row 1 (line 2), norad_cat_id: `ISS`"), "{}", output.out);
    export(folder.path(), &["--check", "absent.csv"]).expect(4, &["absent.csv"]);
    std::fs::write(folder.path().join("latin.csv"), b"satellite_name\nm\xe9t\xe9ore\n").unwrap();
    export(folder.path(), &["--check", "latin.csv"]).expect(4, &["latin.csv:2", "UTF-8"]);
}

/// The meta block holds times too.
fn in_the_rows_an_hour_that_is_none(t: String) -> String {
    let rows = t.lines().take_while(|l| l.starts_with('#')).map(|l| l.len() + 1).sum();
    t[..rows].to_owned() + &t[rows..].replacen("T0", "TX", 1)
}

#[test]
fn a_damaged_table_is_named_with_file_row_and_remedy() {
    let cases: [(fn(String) -> String, &[&str]); 6] = [
        (|t| t.replacen(",25544,", ",25x44,", 1), &["photometry.ecsv:", "norad_cat_id", "25x44", "empty"]),
        (|t| t.replacen(",limit_v_mag,", ",limit,", 1), &["column limit_v_mag is missing", "write the table again"]),
        (|t| t.replace(",ok,", ",good,"), &["photometry.ecsv", "row ", "status", "good"]),
        (|t| t.trim_end().rsplit_once(',').unwrap().0.to_owned(), &["photometry.ecsv:", "fields"]),
        (|t| t.replacen("# %ECSV 1.0", "", 1), &["not an ECSV file"]),
        (in_the_rows_an_hour_that_is_none, &["date_mid", "not a UTC time"]),
    ];
    for (damage, words) in cases {
        let folder = changed(|t| damage(real(t)));
        let args = [&[".", "--to", "udl", "-o", "u.json"], &WHO[..]].concat();
        export(folder.path(), &args).expect(4, words).without_results();
        assert!(!folder.path().join("u.json").exists());
    }
}

#[test]
fn what_is_missing_is_named_with_its_option() {
    let folder = changed(real);
    export(folder.path(), &[".", "--to", "tdm", "-o", "n.tdm"]).expect(2, &["--organisation", "reporter.organisation"]);
    export(folder.path(), &[".", "--to", "score", "-o", "s.csv"]).expect(2, &["--observing-mode"]);
    export(folder.path(), &[".", "--to", "xlsx", "-o", "s"]).expect(2, &["must be one of", "votable"]);
    export(folder.path(), &[".", "--to", "csv"]).expect(2, &["--out"]);
    export(folder.path(), &["nowhere", "--to", "csv", "-o", "x"]).expect(4, &["nowhere"]);
    export(folder.path(), &["photometry.ecsv", "--to", "csv", "-o", "photometry.ecsv"])
        .expect(2, &["the table itself"]);
    export(folder.path(), &["stars.ecsv", "--to", "udl", "-o", "x"]).expect(2, &["stars", "photometry.ecsv"]);
    export(folder.path(), &[".", "--to", "csv", "-o", "x", "--verdicts", "good"]).expect(2, &["--verdicts", "good"]);
    let empty = tempfile::tempdir().unwrap();
    export(empty.path(), &[".", "--to", "csv", "-o", "x"]).expect(4, &["photometry.ecsv", "satphot run"]);
    export(empty.path(), &["--to", "csv", "-o", "x"]).expect(4, &["pipeline.toml"]);
    if cfg!(not(feature = "parquet")) {
        export(folder.path(), &[".", "--to", "parquet", "-o", "x"]).expect(2, &["--features parquet"]);
    }
}
