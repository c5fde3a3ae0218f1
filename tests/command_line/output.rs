//! Standard output and the terminal: what cannot be written is an error, a closed pipe is none, and nothing that others
//! wrote commands the terminal or passes on a password.
#![cfg(unix)]

use std::fs::File;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use satphot::config::Fetch;

const TLE: &str = "ISS\n1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996\n\
                   2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748\n";

fn satphot(folder: &Path, arguments: &[&str], out: Stdio) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_satphot"));
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).stdout(out).stderr(Stdio::piped());
    command.spawn().unwrap().wait_with_output().unwrap()
}

/// A folder with elements, a case of geometry, and a table to export.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("iss.tle", TLE);
    write(
        "cases.csv",
        "id,height_m,src_elev_deg,obs_x_m,obs_y_m,obs_z_m,nx,ny,nz,area_m2,brdf,p1,p2,p3,earth_brdf,ep1,ep2,ep3\n\
         =1+1,550000,-20,200000,0,-500000,0,0,-1,1,lambertian,0.5,,,lambertian,0.3,,\n",
    );
    satphot::tables::write_photometry(&folder.path().join("photometry.ecsv"), &[], &satphot::tables::Meta::default())
        .unwrap();
    folder
}

const LISTINGS: [&[&str]; 8] = [
    &["satellites"],
    &["--help"],
    &["completions", "bash"],
    &["man"],
    &["inspect", "iss.tle"],
    &["passes", "--elements", "iss.tle", "--site", "10,10,0", "--start", "2025-06-09", "--hours", "12"],
    &["predict", "geometry", "cases.csv", "--tolerance", "0.1"],
    &["export", "photometry.ecsv", "--to", "csv", "-o", "-"],
];

#[test]
fn a_listing_that_does_not_fit_is_an_error_and_a_closed_pipe_is_none() {
    let folder = folder();
    for arguments in LISTINGS {
        let whole = satphot(folder.path(), arguments, Stdio::piped());
        assert!(!whole.stdout.is_empty(), "{arguments:?}");
        if Path::new("/dev/full").exists() {
            let full = satphot(folder.path(), arguments, File::options().write(true).open("/dev/full").unwrap().into());
            let message = String::from_utf8_lossy(&full.stderr).into_owned();
            assert!(full.status.code() == Some(4) && message.contains("standard output"), "{arguments:?}: {message}");
        }
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let closed = satphot(folder.path(), arguments, writer.into());
        let message = String::from_utf8_lossy(&closed.stderr).into_owned();
        assert!(closed.status.code() == whole.status.code() && !message.contains("pipe"), "{arguments:?}: {message}");
    }
}

#[test]
fn a_table_exported_to_standard_output_is_added_to_a_file_that_is_open() {
    let folder = folder();
    let log = folder.path().join("log");
    std::fs::write(&log, "before\n").unwrap();
    let out = File::options().append(true).open(&log).unwrap();
    let done = satphot(folder.path(), LISTINGS[7], out.into());
    let text = std::fs::read_to_string(&log).unwrap();
    assert!(done.status.success() && text.starts_with("before\nframe,"), "{text}");
}

#[test]
fn a_file_larger_than_the_limit_is_an_error_with_its_remedy() {
    let folder = folder();
    let line = format!("ulimit -f 0; exec '{}' man -o pages", env!("CARGO_BIN_EXE_satphot"));
    let done = Command::new("sh").args(["-c", &line]).current_dir(folder.path()).output().unwrap();
    let message = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.code() == Some(4) && message.contains("ulimit -f"), "{:?} {message}", done.status);
}

#[test]
fn names_of_files_objects_and_keys_do_not_command_the_terminal() {
    let folder = folder();
    let evil = "a\u{1b}[2J\u{202e}\u{9b}31m";
    std::fs::write(folder.path().join(format!("{evil}.fits")), "no FITS").unwrap();
    std::fs::write(folder.path().join("evil.tle"), TLE.replace("ISS", evil)).unwrap();
    std::fs::write(folder.path().join("evil.toml"), format!("\"{}\" = 1\n", evil.replace('\u{1b}', "\\u001b")))
        .unwrap();
    let elements = ["--site", "10,10,0", "--start", "2024-01-01", "--hours", "1"];
    let file = format!("{evil}.fits");
    for arguments in [
        vec!["inspect", &file],
        [vec!["passes", "--elements", "evil.tle"], elements.to_vec()].concat(),
        vec!["run", "-c", "evil.toml"],
        vec!["run", "-c", "evil.toml", "--json"],
        vec![evil],
    ] {
        let done = satphot(folder.path(), &arguments, Stdio::piped());
        let all = String::from_utf8([done.stdout, done.stderr].concat()).unwrap();
        let shown =
            all.chars().filter(|c| *c != '\n').all(|c| !c.is_control() && !('\u{202a}'..='\u{202e}').contains(&c));
        assert!(shown && all.contains("u001b"), "{arguments:?}: {all:?}");
    }
}

#[test]
fn a_password_in_an_address_is_used_and_never_written() {
    let sets =
        |url: &str| [format!("fetch.celestrak_url={url}"), "fetch.vizier_url=https://example.org/~a@b".to_owned()];
    let fetch = Fetch::from_sets(&sets("https://me:secret@example.org/gp.php")).unwrap();
    assert!(fetch.celestrak_url.contains("me:secret@"), "the query needs it");
    let written = toml::to_string(&fetch).unwrap();
    assert!(!written.contains("secret") && written.contains("\"https://example.org/gp.php\""), "{written}");
    assert!(written.contains("\"https://example.org/~a@b\""), "{written}");
    let wrong = Fetch::from_sets(&sets("https://me:secret@example.org/?x")).unwrap_err().to_string();
    assert!(wrong.contains("celestrak_url") && !wrong.contains("secret"), "{wrong}");
    // what is printed of a query
    let folder = tempfile::tempdir().unwrap();
    let address = "https://me:secret@example.org/gp.php";
    let arguments = ["fetch", "elements", "--norad", "25544", "-o", "a.tle", "--dry-run", "--celestrak-url", address];
    let done = satphot(folder.path(), &arguments, Stdio::piped());
    let all = String::from_utf8([done.stdout, done.stderr].concat()).unwrap();
    assert!(!all.contains("secret") && all.contains("https://example.org/gp.php?CATNR=25544"), "{all}");
}

#[test]
fn an_id_that_a_spreadsheet_would_compute_is_a_text() {
    let done = satphot(folder().path(), LISTINGS[6], Stdio::piped());
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(text.contains("\n'=1+1,"), "{text}");
}

#[test]
#[cfg(target_os = "linux")]
fn an_image_larger_than_the_memory_given_is_an_error_that_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.fits");
    let card = |key: &str, value: &str| format!("{:<80}", format!("{key:<8}= {value:>20}"));
    let mut header: String =
        [("SIMPLE", "T"), ("BITPIX", "16"), ("NAXIS", "2"), ("NAXIS1", "32768"), ("NAXIS2", "32768")]
            .map(|(key, value)| card(key, value))
            .concat();
    header += &format!("{:<80}", "END");
    let file = std::fs::File::create(&path).unwrap();
    std::io::Write::write_all(&mut &file, format!("{header:<2880}").as_bytes()).unwrap();
    file.set_len(2_880 + 2 * 32_768 * 32_768 + 2_752).unwrap(); // holes: it takes no room
    std::fs::write(folder.path().join("stars.csv"), "RAJ2000,DEJ2000,Vmag\n1,1,9\n").unwrap();
    let solve = "solve --catalogue stars.csv --ra 1 --dec 1 --scale 1 large.fits";
    let line = format!("ulimit -v 3000000; exec '{}' {solve}", env!("CARGO_BIN_EXE_satphot"));
    let done = Command::new("sh").args(["-c", &line]).current_dir(&folder).output().unwrap();
    let error = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.code() == Some(4) && error.contains("it needs 4.3 GB"), "{:?} {error}", done.status);
}
