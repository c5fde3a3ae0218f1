//! `satphot render` as a program: frames that `run` knows, files that go together, arguments refused before any work.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::Path;
use std::process::{Command, Output};

use satphot::tables::read_photometry;

const ELEMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/presets/iss_2025_june.tle");

fn satphot(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_satphot")).current_dir(folder).args(words).output().unwrap()
}

/// `satphot render` of the ISS over a site, coarse, with more words.
fn render(folder: &Path, more: &[&str]) -> Output {
    let coarse = ["--samples", "1", "--rays", "4"];
    let at = ["--elements", ELEMENTS, "--site=-35.3,149.0,770", "--time", "2025-06-09T10:33:12"];
    satphot(folder, &[&["render", "iss"], &at[..], &coarse[..], more].concat())
}

fn messages(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_frame_of_the_sensor_is_reduced_as_the_target_of_its_site_without_being_named() {
    let folder = tempfile::tempdir().unwrap();
    let more =
        ["--pixels", "64", "--sensor", "macquarie-cdk24", "--exptime-s", "0.5", "--sky-mag", "21", "-o", "a.fits"];
    let output = render(folder.path(), &more);
    assert!(output.status.success(), "{}", messages(&output));
    let night = format!(
        "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\".\"]\noutput = \"out\"\n\
         [site]\nname = \"other\"\nlat_deg = -35.3\nlon_deg = 149.0\nalt_m = 770.0\n[orbit]\nelements = {ELEMENTS:?}\n"
    );
    std::fs::write(folder.path().join("pipeline.toml"), night).unwrap();
    let output = satphot(folder.path(), &["run", "pipeline.toml", "--quiet"]);
    assert!(output.status.success(), "{}", messages(&output));
    let rows = read_photometry(&folder.path().join("out/n/photometry.ecsv")).unwrap().0;
    assert_eq!((rows.len(), rows[0].status.as_str()), (1, "ok"), "{rows:?}");
    assert!(rows[0].date_mid.starts_with("2025-06-09T10:33:12"), "{}", rows[0].date_mid);
}

#[test]
fn a_folder_gets_pictures_and_frame_and_csv_is_one_table() {
    let folder = tempfile::tempdir().unwrap();
    let more = ["--pixels", "48", "--sensor", "macquarie-cdk24", "--sky-mag", "21", "--csv", "-o", "all"];
    let output = render(folder.path(), &more);
    assert!(output.status.success(), "{}", messages(&output));
    let expected =
        ["iss.ecsv", "iss.fits", "iss.png", "iss_sensor.ecsv", "iss_sensor.fits", "iss_sensor.png"].map(String::from);
    assert_eq!(names(&folder.path().join("all")), expected);
    let table = String::from_utf8(output.stdout).unwrap();
    let columns: Vec<usize> = table.lines().map(|l| l.split(',').count()).collect();
    assert!(columns.len() > 5 && columns.iter().all(|n| *n == columns[0]), "{table}");
    let snr = std::fs::read_to_string(folder.path().join("all/iss_sensor.ecsv")).unwrap();
    assert!(snr.contains("saturated_px") && snr.contains("lunar_earthshine"), "{snr}");
    let header = std::fs::read(folder.path().join("all/iss_sensor.fits")).unwrap();
    let header = String::from_utf8_lossy(&header[..2880 * 3]).into_owned();
    for card in
        ["OBJECT  = 'ISS (ZARYA) [25544]'", "NORADID ", "SATURATE", "SIMNSAT ", "SIMVMAG ", "SIMSNRMT", "V, Vega"]
    {
        assert!(header.contains(card), "{card}: {header}");
    }
    let site = header.split("SITELAT =").nth(1).unwrap().split('/').next().unwrap();
    assert_eq!(site.trim().parse::<f64>().unwrap(), -35.3);
}

#[test]
fn what_cannot_be_is_refused_before_anything_is_written() {
    let sensor = ["--sensor", "macquarie-cdk24"];
    for (more, said) in [
        (&["--sensor", "nosuch", "-o", "late.png"][..], "nosuch"),
        (&[&sensor[..], &["--exptime-s", "0", "-o", "late.png"]].concat(), "--exptime-s"),
        (&[&sensor[..], &["--sensor-set", "frame.nx_px=1", "-o", "late.png"]].concat(), "frame.nx_px"),
        (&[&sensor[..], &["--csv", "-o", "late.png"]].concat(), ".ecsv"),
        (&[&sensor[..], &["--pixels", "64", "--pixel-arcsec", "0.05", "-o", "late.fits"]].concat(), "--pixel-arcsec"),
        (&["-o", "x.jpg", "-o", "late.png"], "x.jpg"),
        (&["-o", "pic.tif"], "pic.tif"),
        (&["--rays", "15", "-o", "late.png"], "--rays"),
        (&["--point", "w=Destiny@100,0,0", "-o", "late.png"], "Destiny"),
        (&["--pass", "--single", "-o", "late.png"], "--single"),
        (&["--pass", "--lights-png", "late.png"], "--lights-png"),
        (&["--pass", "--pixels", "64"], "--pixels"),
        (&["--pass", "--point", "w=Destiny"], "--point"),
        (&["--exptime-s", "3"], "--sensor"),
        (&["--sky-mag", "21"], "--sensor"),
        (&["--seed", "7"], "--sensor"),
        (&["--paper-case"], "--paper-case"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let more: Vec<&str> = more.iter().copied().filter(|w| !w.is_empty()).collect();
        let rays: &[&str] = if more.contains(&"--rays") { &[] } else { &["--rays", "4"] };
        let at = ["--elements", ELEMENTS, "--site=-35.3,149.0,770", "--time", "2025-06-09T10:33:12"];
        let output = satphot(folder.path(), &[&["render", "iss"], &at[..], rays, &more[..]].concat());
        assert_eq!(output.status.code(), Some(2), "{more:?}: {}", messages(&output));
        assert!(messages(&output).contains(said), "{more:?}: {}", messages(&output));
        assert!(names(folder.path()).is_empty(), "{more:?}: {:?}", names(folder.path()));
    }
    let folder = tempfile::tempdir().unwrap();
    let output = satphot(folder.path(), &["render", "css", "--paper-case"]);
    assert!(output.status.code() == Some(2) && messages(&output).contains("css"), "{}", messages(&output));
}

#[test]
fn a_pass_prints_csv_and_reports_its_single_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let more = ["--pass", "--frames", "3", "--frame-pixels", "32", "--single", "--one-scale", "--csv", "-o", "p/"];
    let output = render(folder.path(), &more);
    assert!(output.status.success(), "{}", messages(&output));
    let table = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(table.starts_with("date_mid,alt_deg,") && table.lines().count() == 4, "{table}");
    assert!(table.lines().skip(1).all(|l| l.ends_with(",yes")), "{table}");
    assert!(messages(&output).contains("wrote 3 pictures, p/iss_001.png to p/iss_003.png"), "{}", messages(&output));
    assert_eq!(names(&folder.path().join("p")), ["iss_001.png", "iss_002.png", "iss_003.png", "iss_pass.png"]);
}

#[test]
fn a_scenario_with_unknown_components_leaves_no_night_behind() {
    let folder = tempfile::tempdir().unwrap();
    let output = satphot(folder.path(), &["simulate", "-o", "night", "--set", "target.resolved=nosuch"]);
    assert!(output.status.code() == Some(2) && messages(&output).contains("target.resolved"), "{}", messages(&output));
    assert!(names(folder.path()).is_empty());
}
