//! The program as a user meets it: exit codes, messages that name file, key, value and remedy, results on standard
//! output alone, and single verbs that give the numbers of `run`.
#![allow(clippy::unwrap_used)]

use crate::support;

use std::path::PathBuf;
use std::sync::OnceLock;

use satphot::tables::{PhotometryRow, read_photometry, read_residuals};
use support::{Night, TARGETS, hashes, satphot, simulated};

fn original() -> &'static PathBuf {
    static NIGHT: OnceLock<PathBuf> = OnceLock::new();
    NIGHT.get_or_init(|| simulated("cli", &[]))
}

fn night() -> Night {
    Night::copy_of(original())
}

const SITE: &str = "-33.7703,151.1113,70";
const PASSES: [&str; 7] =
    ["passes", "--elements", "iss-2025-june.tle", "--site", SITE, "--start", "2025-06-09T00:00:00"];

/// `satphot passes` on the embedded elements with more arguments.
fn passes(more: &[&str]) -> support::RunOutput {
    night().satphot(&[&PASSES, more].concat())
}

// ---------------------------------------------------------------- run

#[test]
fn run_prints_its_results_and_nothing_else_on_standard_output() {
    let n = night();
    let output = n.satphot(&["run"]).expect(0, &[]);
    for word in ["Night tiny", "Frames     19 files", "Zeropoint  ZP -23", "6 ok", "ISS (ZARYA)", "Results in"] {
        assert!(output.out.contains(word), "{word}\n{}", output.out);
    }
    assert!(!output.out.contains("MB/s"), "only -v prints time and memory\n{}", output.out);
    assert!(
        !output.out.contains("note:")
            && output.err.lines().all(|l| l.starts_with("note: ") || l.starts_with("skipped: "))
    );
    for name in [
        "photometry.ecsv",
        "stars.ecsv",
        "residuals.ecsv",
        "zeropoint.toml",
        "master_flat.fits",
        "effective.toml",
        "manifest.json",
        "satphot.log",
        "figures/light_curve.svg",
        "figures/residuals_altitude.svg",
        "figures/zeropoint.svg",
        "figures/sky.svg",
        "figures/distribution.svg",
        "figures/phase.svg",
    ] {
        assert!(std::fs::metadata(n.result(name)).unwrap().len() > 100, "{name}");
    }
    let quiet = n.satphot(&["run", "pipeline.toml", "-q"]).expect(0, &[]);
    assert_eq!(quiet.err, "");
    // the configuration that was saved gives the same night
    n.satphot(&["run", "satphot-out/tiny/effective.toml", "-o", "again"]).expect(0, &[]);
    let first = read_photometry(&n.result("photometry.ecsv")).unwrap().0;
    assert_eq!(read_photometry(&n.path("again/tiny/photometry.ecsv")).unwrap().0, first);
}

#[test]
fn run_gives_the_same_bytes_twice_and_on_one_and_two_threads_and_leaves_its_inputs_alone() {
    let n = night();
    let before = hashes(&n.path(""));
    let mut seen = Vec::new();
    for jobs in ["1", "2", "2"] {
        n.satphot(&["run", "-q", "--no-figures", "-j", jobs]).expect(0, &[]);
        let names = ["photometry.ecsv", "stars.ecsv", "residuals.ecsv", "zeropoint.toml"];
        seen.push(names.map(|name| std::fs::read(n.result(name)).unwrap()));
    }
    assert!(seen[0] == seen[1] && seen[1] == seen[2]);
    assert_eq!(hashes(&n.path("")), before);
}

#[test]
fn a_missing_configuration_says_how_to_get_one() {
    let empty = tempfile::tempdir().unwrap();
    satphot(empty.path(), &["run"]).expect(4, &["pipeline.toml", "satphot init", "-c"]).without_results();
    satphot(empty.path(), &["measure", "-c", "n.toml"]).expect(4, &["n.toml", "satphot init"]).without_results();
}

#[test]
fn a_wrong_configuration_names_key_value_and_file() {
    let text = std::fs::read_to_string(original().join("pipeline.toml")).unwrap();
    let typo = night().file("pipeline.toml", text.replace("mesh_px", "mesh_pix"));
    typo.satphot(&["run"])
        .expect(2, &["photometry.mesh_pix", "did you mean \"mesh_px\"", "pipeline.toml"])
        .without_results();
    let broken = night().file("pipeline.toml", text.replace("lat_deg = ", "lat_deg = south "));
    broken.satphot(&["run"]).expect(2, &["pipeline.toml", "line"]).without_results();
    for (set, words) in [
        ("photometry.mesh_px", ["--set", "key=value"]),
        ("=3", ["--set", "no key"]),
        ("photometry.mesh_px=abc", ["photometry.mesh_px", "abc"]),
        ("photometry.mesh_px=3", ["photometry.mesh_px: 3", "8 to 4096 px"]),
        ("photometry.mesh=32", ["photometry.mesh", "did you mean \"mesh_px\""]),
        ("site.lat_deg=-100", ["site.lat_deg: -100", "-90 to 90 deg"]),
        ("detector.camera=asi1600", ["asi1600", "detector.e_per_adu"]),
        ("model.satellite=isss", ["isss", "did you mean \"iss\""]),
    ] {
        night().satphot(&["run", "--set", set]).expect(2, &words).without_results();
    }
    for args in [
        &["run", "--max-failed-frac", "1.5"][..],
        &["run", "--max-failed-frac", "many"],
        &["run", "-j", "-1"],
        &["run", "-j", "100000"],
        &["run", "--max-memory", "600"],
        &["run", "--max-memory", "lots"],
        &["run", "--max-memory", "10MB"],
        &["measure", "--max-memory", "10MB"],
        &["run", "--fast"],
        &["reduce"],
        &[],
    ] {
        night().satphot(args).expect(2, &[]).without_results();
    }
}

#[test]
fn what_is_missing_before_work_begins_has_its_code_and_leaves_no_results() {
    let cases: [(&[&str], i32, &[&str]); 6] = [
        (&["--set", "night.input=[\"nowhere\"]"], 4, &["nowhere"]),
        (&["--set", "orbit.elements=none.tle"], 5, &["none.tle", "satphot fetch elements"]),
        (&["--set", "orbit.norad_cat_id=1"], 5, &["catalogue number 1 "]),
        (&["--set", "stars.catalogue=none.csv"], 5, &["none.csv", "APASS"]),
        (&["--set", "zeropoint.previous=none.toml"], 4, &["none.toml"]),
        (&["-o", "pipeline.toml/results"], 4, &["pipeline.toml/results", "night.output"]),
    ];
    for (args, code, words) in cases {
        let n = night();
        let output = n.satphot(&[&["run"], args].concat()).expect(code, words).without_results();
        assert!(output.err.matches("os error").count() <= 1, "said twice: {}", output.err);
        assert!(output.err.starts_with("error: "), "{}", output.err);
        assert!(!n.result("photometry.ecsv").exists());
    }
    let gain = night().card("", "GAIN", Some("123"));
    gain.satphot(&["run"]).expect(5, &["target_0000.fits", "123", "[detector.e_per_adu]"]).without_results();
    let flats = night();
    flats.frames("flat").iter().for_each(|p| support::fill(p, 500));
    flats.satphot(&["run"]).expect(5, &["0 of 4 flats", "flat.master", "frames.ignore"]).without_results();
}

#[test]
fn a_poor_night_prints_its_results_and_ends_with_code_3() {
    let n = night().file(TARGETS[0], "clouds");
    let output = n.satphot(&["run", "-q"]).expect(0, &[]);
    assert!(
        output.out.contains("failed: target_0000.fits") && output.out.contains("not a FITS file"),
        "{}",
        output.out
    );
    let strict = n.satphot(&["run", "-q", "--strict"]).expect(3, &["1 of 15 frames failed"]);
    assert!(strict.out.contains("Results in"));
    n.satphot(&["run", "-q", "--max-failed-frac", "0.01"]).expect(3, &["share of 0.01"]);
    let unsolved = night().card("field", "CTYPE1", None).card("field", "CTYPE2", None);
    let output = unsolved.satphot(&["run", "-q", "--set", "stars.solve=\"never\""]).expect(3, &["no star matched"]);
    assert!(output.out.contains("Zeropoint  none") && unsolved.result("photometry.ecsv").exists());
}

#[test]
fn a_dry_run_states_what_each_file_is_and_writes_nothing() {
    let n = night().file(TARGETS[0], "clouds");
    let output = n.satphot(&["run", "--dry-run"]).expect(0, &[]);
    for (word, count) in [("\nstars ", 9), ("\ntarget ", 5), ("flat ", 4), ("unreadable ", 1)] {
        assert!(output.out.matches(word).count() >= count, "{word}: {}", output.out);
    }
    assert!(output.out.contains("contains \"ISS (ZARYA)\""), "the reason is given: {}", output.out);
    assert!(!n.path("satphot-out").exists());
}

// ---------------------------------------------------------------- single stages

/// A row without what `measure` does not fill.
fn measured(row: &PhotometryRow) -> PhotometryRow {
    PhotometryRow {
        model_v_mag: None,
        sun_v_mag: None,
        earthshine_v_mag: None,
        moon_v_mag: None,
        lunar_earthshine_v_mag: None,
        model_err_mag: None,
        v_pred_err_mag: None,
        lit_array_cos: None,
        residual_mag: None,
        illum: String::new(),
        skipped: String::new(),
        ..row.clone()
    }
}

#[test]
fn single_stages_give_the_numbers_of_the_whole_night() {
    let n = night();
    n.satphot(&["run", "-q", "--no-figures"]).expect(0, &[]);
    let run_rows: Vec<PhotometryRow> = n.rows().iter().map(measured).collect();

    let output = n.satphot(&["flat", "-o", "f.fits"]).expect(0, &[]);
    assert!(output.out.contains("f.fits: median of 4 flats"), "{}", output.out);
    assert_eq!(std::fs::read(n.path("f.fits")).unwrap(), std::fs::read(n.result("master_flat.fits")).unwrap());
    n.satphot(&["flat", "-o", "g.fits", "flat_000.fits", "flat_001.fits", "flat_002.fits", "flat_003.fits"])
        .expect(0, &[]);
    assert_eq!(std::fs::read(n.path("g.fits")).unwrap(), std::fs::read(n.path("f.fits")).unwrap());

    // from the night, from named files with its flats, and from the star table
    let fields: Vec<String> = (0..9).map(|k| format!("field{:02}_{:02}.fits", k / 3, k % 3)).collect();
    let named: Vec<&str> =
        ["zeropoint", "-o", "z1.toml"].into_iter().chain(fields.iter().map(String::as_str)).collect();
    n.satphot(&["zeropoint", "-o", "z0.toml"]).expect(0, &[]);
    // a single stage does not read every input, so only the hash over them and the seed of the night are missing
    let of_night = |line: &str| line.contains("input_manifest_sha256") || line.contains("{seed: ");
    let stated_by_both = |text: String| -> Vec<String> {
        let lines = text.lines().filter(|l| !of_night(l) && !l.starts_with("# provenance: "));
        lines.map(str::to_string).collect()
    };
    let of_stars = stated_by_both(std::fs::read_to_string(n.path("stars.ecsv")).unwrap());
    assert!(of_stars == stated_by_both(n.text("stars.ecsv")), "stars.ecsv next to the zeropoint");
    n.satphot(&named).expect(0, &[]);
    n.satphot(&["zeropoint", "-o", "z2.toml", "--stars", "satphot-out/tiny/stars.ecsv"]).expect(0, &[]);
    for name in ["z0.toml", "z1.toml", "z2.toml"] {
        let text = std::fs::read_to_string(n.path(name)).unwrap();
        assert!(text.contains("# provenance: tool=satphot"), "{name}");
        assert_eq!(stated_by_both(text), stated_by_both(n.text("zeropoint.toml")), "{name}");
    }

    // from the night with a master flat made before, and one named file with the night's flats
    let zeropoint = ["--zeropoint", "satphot-out/tiny/zeropoint.toml"];
    n.satphot(&[&["measure", "-o", "p.ecsv", "--flat", "f.fits"][..], &zeropoint].concat()).expect(0, &[]);
    assert_eq!(read_photometry(&n.path("p.ecsv")).unwrap().0, run_rows);
    n.satphot(&[&["measure", "-o", "q.ecsv", TARGETS[2]][..], &zeropoint].concat()).expect(0, &[]);
    // one frame alone has none before it
    let alone = PhotometryRow { cadence_s: None, ..run_rows[2].clone() };
    assert_eq!(read_photometry(&n.path("q.ecsv")).unwrap().0, [alone]);

    // the time goes through MJD, 0.6 µs: 1e-6 mag is far above what that does to the model
    n.satphot(&["compare", "-o", "r.ecsv", "--photometry-out", "c.ecsv", "p.ecsv"]).expect(0, &[]);
    let (a, b) = (read_residuals(&n.path("r.ecsv")).unwrap().0, read_residuals(&n.result("residuals.ecsv")).unwrap().0);
    assert_eq!((a.len(), b.len()), (6, 6));
    for (x, y) in a.iter().zip(&b) {
        assert_eq!((&x.frame, &x.illum, x.pass, x.flags), (&y.frame, &y.illum, y.pass, y.flags));
        assert!((x.residual_mag.unwrap() - y.residual_mag.unwrap()).abs() < 1e-6, "{}", x.frame);
    }
    let zeropoint_line = |name: PathBuf| {
        let text = std::fs::read_to_string(name).unwrap();
        text.lines().find(|l| l.contains("{zeropoint:")).unwrap().to_string()
    };
    assert_eq!(zeropoint_line(n.path("c.ecsv")), zeropoint_line(n.result("photometry.ecsv")));
}

#[test]
fn single_stages_refuse_what_they_cannot_use() {
    let n = night();
    n.satphot(&["run", "-q", "--no-figures"]).expect(0, &[]);
    let cases: [(&[&str], i32, &[&str]); 8] = [
        (&["flat", "nope.fits"], 4, &["nope.fits"]),
        (&["flat", TARGETS[0]], 5, &["1 of 1 flats", "flat.min_flats = 3"]),
        (&["measure", "nope.fits"], 4, &["nope.fits"]),
        (&["measure", "--flat", "nope.fits"], 4, &["nope.fits"]),
        (&["zeropoint", "--stars", "catalogue.csv"], 4, &["catalogue.csv", "ECSV"]),
        (&["zeropoint", "--stars", "satphot-out/tiny/photometry.ecsv"], 4, &["column n_members is missing"]),
        (&["compare", "nope.ecsv"], 4, &["nope.ecsv"]),
        (&["compare"], 2, &["<TABLE>"]),
    ];
    for (args, code, words) in cases {
        n.satphot(args).expect(code, words).without_results();
    }
    let unmodelled = night().without_table("model").file("p.ecsv", n.text("photometry.ecsv"));
    unmodelled.satphot(&["compare", "p.ecsv"]).expect(2, &["model", "needed"]).without_results();
}

#[test]
fn a_frame_measured_without_a_zeropoint_stays_instrumental() {
    let n = night();
    n.satphot(&["measure", "-o", "p.ecsv"]).expect(0, &[]);
    let rows = read_photometry(&n.path("p.ecsv")).unwrap().0;
    assert!(rows.iter().all(|r| r.inst_mag.is_some() && r.v_mag.is_none() && r.reason.contains("no zeropoint")));
}

// ---------------------------------------------------------------- passes

#[test]
fn passes_need_no_configuration_when_site_and_elements_are_given() {
    let empty = tempfile::tempdir().unwrap();
    std::fs::copy(original().join("iss-2025-june.tle"), empty.path().join("iss-2025-june.tle")).unwrap();
    let table = satphot(empty.path(), &PASSES).expect(0, &[]);
    // the pass of the paper: culmination 2025-06-09 10:33:12 UTC, 32.1 deg, 748.7 km
    let line = table.out.lines().find(|l| l.contains("2025-06-09T10:33:12Z")).unwrap();
    assert!(line.contains(" 32.1 ") && line.contains(" 748.7 "), "{line}");
    let csv = satphot(empty.path(), &[&PASSES[..], &["--csv"]].concat()).expect(0, &[]);
    let widths: Vec<usize> = csv.out.lines().map(|l| l.split(',').count()).collect();
    assert_eq!(widths, [16; 5], "{}", csv.out);
    let from_config = night().satphot(&["passes", "--start", "2025-06-09T00:00:00"]).expect(0, &[]);
    assert_eq!(from_config.out, table.out);
    satphot(empty.path(), &["passes", "--start", "2025-06-09T00:00:00"])
        .expect(2, &["pipeline.toml", "--elements and --site"])
        .without_results();
}

#[test]
fn no_pass_is_a_result_and_not_an_error() {
    let output = passes(&["--min-alt", "80"]).expect(0, &[]);
    assert!(output.out.contains("no pass above 80 deg"), "{}", output.out);
    let csv = passes(&["--min-alt", "80", "--csv"]).expect(0, &[]);
    assert_eq!(csv.out.lines().count(), 1, "the header alone");
}

#[test]
fn bad_arguments_of_passes_are_named_with_their_range() {
    let head = ["passes", "--elements", "iss-2025-june.tle"];
    let with = |site: &str, start: &str, more: &[&str]| {
        let args = [&head[..], &["--site", site, "--start", start], more].concat();
        night().satphot(&args)
    };
    let noon = "2025-06-09T00:00:00";
    for (site, start, more, code, word) in [
        ("-33.77,151.11", noon, &[][..], 2, "latitude,longitude,altitude"),
        ("-133.77,151.11,70", noon, &[], 2, "site.lat_deg: -133.77"),
        ("-33.77,1510,70", noon, &[], 2, "site.lon_deg: 1510"),
        ("nan,151.11,70", noon, &[], 2, "--site: NaN"),
        ("a,b,c", noon, &[], 2, "--site"),
        (SITE, "today", &[], 2, "\"today\" is not a time: "),
        (SITE, "2025-06", &[], 2, "2025-06"),
        (SITE, noon, &["--min-alt", "95"], 2, "--min-alt: 95"),
        (SITE, noon, &["--hours", "-1"], 2, "--hours: -1"),
        (SITE, noon, &["--hours", "nan"], 2, "--hours"),
        (SITE, noon, &["--norad", "5"], 5, "catalogue number 5 "),
        (SITE, noon, &["--set", "site.alt_m=3"], 2, "--set"),
        (SITE, "2025-09-09T00:00:00", &[], 5, "orbit.max_age_d = 14 d"),
    ] {
        with(site, start, more).expect(code, &[word]).without_results();
    }
    let missing = ["passes", "--elements", "none.tle", "--site", SITE, "--start", noon];
    night().satphot(&missing).expect(5, &["none.tle"]).without_results();
    let forced = with(SITE, "2025-09-09T00:00:00", &["--force-age"]).expect(0, &["positions may be off"]);
    assert!(forced.out.contains("2025-09-09T"));
}

// ---------------------------------------------------------------- init, satellites, simulate, help

#[test]
fn the_file_init_writes_is_a_configuration_and_is_not_overwritten() {
    let n = night();
    let output = n.satphot(&["init", "mine.toml"]).expect(0, &["mine.toml", "satphot run"]).without_results();
    assert!(!output.err.contains("overwrite"));
    satphot::config::Config::load(&n.path("mine.toml"), &[]).unwrap();
    let printed = n.satphot(&["init", "-"]).expect(0, &[]).out;
    assert_eq!(printed, std::fs::read_to_string(n.path("mine.toml")).unwrap());
    n.satphot(&["init", "mine.toml"]).expect(2, &["mine.toml", "--force"]);
    n.satphot(&["init", "mine.toml", "--force"]).expect(0, &[]);
    n.satphot(&["init", "nowhere/mine.toml"]).expect(4, &["nowhere/mine.toml"]);
    // with the observer's own names in place the night runs
    let own = ["stars.catalogue=catalogue.csv", "orbit.elements=iss-2025-june.tle", "night.name=tiny"];
    let mut args = vec!["run", "mine.toml", "-q", "--no-figures"];
    own.iter().for_each(|set| args.extend(["--set", set]));
    let output = n.satphot(&args).expect(0, &[]);
    assert!(output.out.contains("6 ok"), "{}", output.out);
}

/// The lines of a commented template with the comment signs of its optional keys taken away.
fn uncommented(text: &str) -> String {
    let keep = |line: &str| {
        let optional = line.strip_prefix("# ").filter(|l| l.starts_with('[') || l.contains(" = "));
        optional.unwrap_or(line).to_string() + "\n"
    };
    text.lines().skip(2).map(keep).collect()
}

#[test]
fn every_optional_line_of_the_file_init_writes_is_a_known_key() {
    let n = night();
    let text = uncommented(&n.satphot(&["init", "-"]).expect(0, &[]).out);
    assert!(text.contains("\n[frames]") && text.contains("\nmax_age_d"), "{text}");
    if let Err(error) = satphot::config::Config::from_text(&text, &[]) {
        panic!("{error}\n{text}");
    }
}

#[test]
fn satellites_are_listed_and_an_unknown_one_names_those_there_are() {
    let n = night();
    let all = n.satphot(&["satellites"]).expect(0, &[]).out;
    assert!(all.lines().any(|l| l.starts_with("iss ")) && all.contains("starlink-v2"), "{all}");
    let iss = n.satphot(&["satellites", "iss"]).expect(0, &[]).out;
    assert!(iss.contains("chassis") && iss.contains("array"), "{iss}");
    n.satphot(&["satellites", "mir"]).expect(2, &["mir", "known: iss"]).without_results();
}

#[test]
fn a_scenario_that_cannot_be_simulated_is_refused_with_the_key() {
    let empty = tempfile::tempdir().unwrap();
    for (args, code, word) in [
        (&["--set", "target.n=many"][..], 2, "target.n"),
        (&["--set", "target.nn=3"], 2, "did you mean \"n\""),
        (&["--set", "start_utc=now"], 2, "start_utc"),
        (&["--set", "end_utc=2025-06-09T08:00:01"], 2, "later than start_utc"),
        (&["--set", "end_utc=2025-06-13T07:00:01"], 2, "no pass above 15 deg"),
        (&["--set", "target.satellite=mir"], 2, "mir"),
        (&["--set", "pointings.gain_settings=[123]"], 2, "123"),
        (&["none.toml"], 4, "none.toml"),
    ] {
        satphot(empty.path(), &[&["simulate", "-o", "s"][..], args].concat()).expect(code, &[word]).without_results();
    }
    satphot(empty.path(), &["simulate", "-o", "/proc/nowhere"]).expect(4, &["/proc/nowhere"]).without_results();
    let scenario = satphot(empty.path(), &["simulate", "--print-scenario", "--seed", "7"]).expect(0, &[]).out;
    std::fs::write(empty.path().join("s.toml"), &scenario).unwrap();
    let again = satphot(empty.path(), &["simulate", "s.toml", "--print-scenario"]).expect(0, &[]).out;
    assert!(scenario.contains("seed = 7") && again == scenario, "{again}");
}

#[test]
fn help_is_there_for_every_verb_and_states_the_exit_codes() {
    let empty = tempfile::tempdir().unwrap();
    let help = satphot(empty.path(), &["--help"]).expect(0, &[]).out;
    for code in ["  0  ", "  1  ", "  2  ", "  3  ", "  4  ", "  5  "] {
        assert!(help.contains(code), "{help}");
    }
    for verb in ["run", "init", "flat", "zeropoint", "measure", "compare", "passes", "simulate", "satellites"] {
        assert!(help.contains(&format!("  {verb} ")), "{verb}");
        let own = satphot(empty.path(), &[verb, "--help"]).expect(0, &[]).out;
        assert!(own.contains("Usage: satphot") && own.lines().all(|l| l.len() <= 120), "{own}");
    }
    assert!(satphot(empty.path(), &["--version"]).expect(0, &[]).out.starts_with("satphot "));
}

#[test]
fn nobody_listening_is_not_a_crash() {
    let n = night();
    for args in [&["run", "-c", "none.toml"][..], &["run", "--no-figures"], &["satellites"]] {
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_satphot"))
            .args(args)
            .current_dir(n.path(""))
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        drop((child.stdout.take(), child.stderr.take()));
        let code = child.wait().unwrap().code();
        assert_eq!(code, Some(if args.contains(&"none.toml") { 4 } else { 0 }), "{args:?}");
    }
}

// ---------------------------------------------------------------- manners

#[test]
fn what_init_is_given_stands_in_the_file_and_what_is_no_site_or_satellite_is_refused() {
    let n = night();
    let args =
        ["init", "-", "--site=-24.627,-70.404,2635", "--site-name", "A \"B\"", "--night", "n1", "--input", "raw/n1"];
    let text = n.satphot(&[&args[..], &["--satellite", "starlink-v2"]].concat()).expect(0, &[]).out;
    let config = satphot::config::Config::from_text(&text, &[]).unwrap();
    assert_eq!((config.site.lat_deg, config.site.lon_deg, config.site.alt_m), (-24.627, -70.404, 2635.0));
    assert_eq!((config.site.name.as_str(), config.night.name.as_str()), ("A \"B\"", "n1"));
    assert_eq!(config.night.input, [std::path::PathBuf::from("raw/n1")]);
    assert_eq!(config.model.unwrap().satellite, "starlink-v2");
    assert!(text.contains("# results go to") && text.contains("name = \"PlaneWave CDK24 f/6.5\""));
    for (site, word) in [("1,2", "latitude,longitude,altitude"), ("91,0,0", "lat_deg"), ("a,b,c", "\"a,b,c\"")] {
        n.satphot(&["init", "-", &format!("--site={site}")]).expect(2, &[word]).without_results();
    }
    n.satphot(&["init", "-", "--satellite", "isss"]).expect(2, &["did you mean \"iss\""]).without_results();
}

#[test]
fn a_dry_run_says_what_would_be_made_and_makes_nothing() {
    let n = night();
    let output = n.satphot(&["run", "--dry-run"]).expect(0, &[]).out;
    for line in ["flat       of ", "zeropoint  of ", "model      iss", "MB to read, about ", "results    would go to "]
    {
        assert!(output.contains(line), "\"{line}\" is not in\n{output}");
    }
    let alone = n.satphot(&["run", "--dry-run", "--set", "zeropoint.previous=zp.toml"]);
    assert!(alone.out.contains("zeropoint  zp.toml") || alone.err.contains("zp.toml"), "{alone:#?}");
}

#[test]
fn a_dry_run_lists_all_that_is_missing_and_ends_as_the_run_would() {
    let n = night();
    let gone = ["orbit.elements=gone.tle", "stars.catalogue=gone.csv", "flat.master=gone.fits"];
    let sets = gone.iter().flat_map(|set| ["--set", set]);
    let args: Vec<&str> = ["run", "--dry-run"].into_iter().chain(sets).collect();
    // as the run, which misses the elements first
    let output = n.satphot(&args).expect(5, &["gone.tle", "gone.csv", "gone.fits"]);
    let run: Vec<&str> = ["run"].into_iter().chain(args[2..].iter().copied()).collect();
    assert_eq!(n.satphot(&run).expect(5, &[]).err, output.err);
    let missing: Vec<&str> = output.out.lines().filter(|l| l.starts_with("missing ")).collect();
    for name in ["gone.tle", "gone.csv", "gone.fits"] {
        assert!(missing.iter().any(|l| l.contains(name)), "{name} is not in\n{}", output.out);
    }
    assert_eq!(output.out.lines().filter(|l| l.starts_with("target ")).count(), 6, "{}", output.out);
    n.satphot(&["run", "--dry-run", "--set", "orbit.elements=gone.tle"]).expect(5, &["satphot fetch elements"]);
}

#[test]
fn with_json_every_line_on_standard_error_is_an_object_with_its_event() {
    let n = night();
    let output = n.satphot(&["run", "--json", "--no-figures", "-o", "json-out"]).expect(0, &[]);
    let events: Vec<serde_json::Value> = output.err.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let with = |event: &str| events.iter().filter(|e| e["event"] == event).count();
    let summary: serde_json::Value = serde_json::from_str(&output.out).unwrap();
    assert_eq!((&summary["night"], &summary["counts"]["ok"]), (&"tiny".into(), &6.into()), "{}", output.out);
    assert!(
        summary["zeropoint"]["zp_mag"].as_f64().unwrap() < -22.0 && summary["passes"].as_array().unwrap().len() == 3
    );
    assert!(summary["files"].as_array().unwrap().iter().any(|f| f.as_str().unwrap().ends_with("photometry.ecsv")));
    assert!(with("stage") >= 2 && with("done") >= 2 && with("progress") >= 2, "{}", output.err);
    let wrong = n.satphot(&["run", "--json", "--set", "night.output=/proc/no"]);
    let last: serde_json::Value = serde_json::from_str(wrong.err.lines().last().unwrap()).unwrap();
    assert_eq!(last["event"], "error");
}

#[test]
fn shells_and_man_know_every_verb() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        let text = satphot(folder.path(), &["completions", shell]).expect(0, &[]).out;
        assert!(["run", "predict", "report", "zeropoint"].iter().all(|verb| text.contains(verb)), "{shell}");
    }
    satphot(folder.path(), &["man", "-o", "pages"]).expect(0, &["pages"]);
    let page = std::fs::read_to_string(folder.path().join("pages/satphot-predict-sky.1")).unwrap();
    assert!(page.contains("satphot\\-predict\\-sky") || page.contains("satphot-predict-sky"), "{page}");
    assert!(satphot(folder.path(), &["man"]).expect(0, &[]).out.starts_with(".ie"));
}

#[test]
fn what_is_missing_is_reported_with_the_line_that_fetches_it() {
    let n = night();
    let stars = ["solve", "field00_00.fits", "--catalogue", "none.csv", "--ra", "10", "--dec", "10"];
    n.satphot(&stars).expect(5, &["none.csv", "satphot fetch stars", "-o none.csv"]);
    let elements = ["passes", "--elements", "none.tle", "--site", SITE, "--start", "2025-06-10T06:00:00"];
    n.satphot(&elements).expect(5, &["satphot fetch elements --norad NUMBER --date YYYY-MM-DD -o none.tle"]);
}
