//! Broken input, through the library: a clear message with its exit code, and one broken frame costs one row.
#![allow(clippy::unwrap_used)]

use crate::support;
use satphot::photometry::Flags;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use support::{Night, TARGETS, fill, fill_nan, hashes, shrink, simulated};

fn original() -> &'static PathBuf {
    static NIGHT: OnceLock<PathBuf> = OnceLock::new();
    NIGHT.get_or_init(|| simulated("night_broken", &[]))
}

fn night() -> Night {
    Night::copy_of(original())
}

/// The night is refused with this exit code, in a message that holds each word.
fn refused(night: &Night, code: u8, words: &[&str]) {
    let (got, message) = night.refusal();
    for word in words {
        assert!(message.contains(word), "\"{word}\" is not in: {message}");
    }
    assert_eq!(got, code, "{message}");
}

// ---------------------------------------------------------------- nothing to work on

#[test]
fn a_folder_without_fits_files_is_named_with_the_key_to_check() {
    let n = night();
    std::fs::create_dir(n.path("empty")).unwrap();
    std::fs::create_dir(n.path("texts")).unwrap();
    std::fs::write(n.path("texts/notes.txt"), "clouds").unwrap();
    refused(&n.set("night.input=[\"empty\"]"), 4, &["empty", "no FITS file", "night.input"]);
    let n = night();
    std::fs::create_dir(n.path("texts")).unwrap();
    std::fs::write(n.path("texts/notes.txt"), "clouds").unwrap();
    refused(&n.set("night.input=[\"texts\"]"), 4, &["texts", "no FITS file", "night.input"]);
    refused(&night().set("night.input=[\"nowhere\"]"), 4, &["nowhere"]);
}

#[test]
fn frames_of_no_use_are_distinguished_from_no_frames() {
    refused(&night().card("", "IMAGETYP", Some("'Bias Frame'")), 4, &["no flat, star or target frames", "IMAGETYP"]);
    let n = night();
    n.frames("").iter().for_each(|p| std::fs::write(p, "not FITS").unwrap());
    refused(&n, 4, &["none of the 19 files can be used", ".fits: not a FITS file"]);
}

// ---------------------------------------------------------------- elements

#[test]
fn elements_that_are_missing_or_damaged_are_named() {
    refused(&night().set("orbit.elements=none.tle"), 5, &["none.tle", "satphot fetch elements", "[orbit]"]);
    let tle = std::fs::read_to_string(original().join("iss-2025-june.tle")).unwrap();
    for (text, word) in [
        (String::new(), "no element sets"),
        ("hello world\n".into(), "hello world"),
        (tle[..200].to_string(), "without a line 2"),
        (tle.replace("51.6392", "51.6492"), "checksum"),
        ("[{\"OBJECT_NAME\": \"ISS\"}]".into(), "NORAD_CAT_ID"),
    ] {
        refused(&night().file("bad.tle", text).set("orbit.elements=bad.tle"), 4, &["bad.tle", word]);
    }
}

#[test]
fn elements_too_old_are_refused_unless_forced_and_then_flagged() {
    let old = night().set("orbit.max_age_d=0.5");
    refused(&old, 5, &["ISS (ZARYA) [25544]", "orbit.max_age_d = 0.5 d", "orbit.force_age"]);
    let forced = old.set("orbit.force_age=true");
    assert_eq!(forced.run().unwrap().counts.ok, 6);
    // elements of a month before the night are past the 2 d of the warning too
    let tle = std::fs::read_to_string(original().join("iss-2025-june.tle")).unwrap();
    let first: String = tle.lines().take(3).map(|l| format!("{l}\n")).collect();
    let stale = night().file("first.tle", first).set("orbit.elements=first.tle");
    let summary = stale.run().unwrap();
    assert!(summary.notes.iter().any(|n| n.contains("positions may be off")), "{:?}", summary.notes);
    // they taint geometry and residual of every row, not what was measured
    let rows = stale.rows();
    assert!(rows.iter().all(|r| Flags(r.flags).has(Flags::OLD_ELEMENTS)));
    assert!(rows.iter().any(|r| r.verdict == "use"), "{:?}", rows.iter().map(|r| &r.reason).collect::<Vec<_>>());
}

#[test]
fn a_number_that_is_not_in_the_file_of_elements_is_refused_with_what_is() {
    refused(&night().set("orbit.norad_cat_id=12345"), 5, &["12345", "it holds ISS (ZARYA) [25544]"]);
}

// ---------------------------------------------------------------- gain

#[test]
fn an_unknown_gain_setting_in_every_frame_names_the_table_to_extend() {
    let n = night().card("", "GAIN", Some("123"));
    refused(&n, 5, &["123", "asi6200mm", "[detector.e_per_adu]", "target_0000.fits"]);
    let helped = n.set("detector.e_per_adu.123=0.08").set("detector.read_noise_e.123=1.5");
    assert_eq!(helped.run().unwrap().counts.failed, 0);
}

#[test]
fn frames_without_a_gain_setting_name_the_keyword_and_both_remedies() {
    let n = night().card("", "GAIN", None);
    refused(&n, 4, &["header GAIN", "header.aliases.gain", "detector.use_header_egain"]);
    let helped = n.set("detector.use_header_egain=true").set("detector.read_noise_e.0=1.5");
    let message = helped.run().map(|s| s.counts.ok).map_err(|e| e.to_string());
    assert!(message.is_ok(), "EGAIN is there and asked for: {message:?}");
}

// ---------------------------------------------------------------- catalogue and stars

#[test]
fn a_catalogue_that_is_missing_empty_or_of_other_columns_is_named() {
    refused(&night().set("stars.catalogue=none.csv"), 5, &["none.csv", "APASS", "zeropoint.previous"]);
    refused(&night().file("catalogue.csv", ""), 5, &["catalogue.csv", "empty"]);
    let text = std::fs::read_to_string(original().join("catalogue.csv")).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    refused(&night().file("catalogue.csv", format!("{header}\n")), 5, &["catalogue.csv", "no rows"]);
    let other = format!("a,b,c,d,e,f,g\n{rows}");
    refused(&night().file("catalogue.csv", other), 5, &["RAJ2000", "present: a, b, c", "stars.columns"]);
}

/// The catalogue with the right ascensions changed by `shift`, and only the stars `keep` lets through.
fn catalogue(shift_deg: f64, keep: impl Fn(usize) -> bool) -> String {
    let text = std::fs::read_to_string(original().join("catalogue.csv")).unwrap();
    let mut lines = text.lines();
    let mut out = format!("{}\n", lines.next().unwrap());
    for (_, line) in lines.enumerate().filter(|(k, _)| keep(*k)) {
        let mut fields: Vec<String> = line.split(',').map(str::to_string).collect();
        let ra: f64 = fields[1].parse().unwrap();
        fields[1] = format!("{:.7}", (ra + shift_deg).rem_euclid(360.0));
        out.push_str(&(fields.join(",") + "\n"));
    }
    out
}

#[test]
fn a_night_whose_stars_match_nothing_writes_its_tables_and_ends_with_code_3() {
    let n = night().file("catalogue.csv", catalogue(40.0, |_| true));
    let summary = n.run().unwrap();
    let error = summary.poor_error().expect("no star matched");
    assert_eq!(error.exit_code(), 3);
    let message = error.to_string();
    for word in ["no star matched", "9 star frames", "field00_00.fits", "pointing_err_arcsec"] {
        assert!(message.contains(word), "{word}: {message}");
    }
    // without stars the FWHM is assumed: too narrow here, so that the faintest target may be a limit
    assert_eq!((summary.counts.ok + summary.counts.nondetection, summary.counts.failed), (6, 9));
    assert!(summary.counts.ok >= 5);
    assert!(summary.zeropoint.is_none() && !n.result("zeropoint.toml").exists());
    assert!(n.rows().iter().all(|r| r.v_mag.is_none()), "no zeropoint, no magnitudes");
    assert!(TARGETS.iter().all(|t| n.row(t).flux_e.is_some()));
}

#[test]
fn one_star_or_two_are_too_few_to_fit_and_the_message_counts_them() {
    for stars in [1, 2] {
        let n = night().file("catalogue.csv", catalogue(0.0, |k| k < stars));
        let summary = n.run().unwrap();
        let error = summary.poor_error().expect("too few stars");
        assert_eq!(error.exit_code(), 3, "{error}");
        assert!(summary.zeropoint.is_none());
        let measured = summary.counts.ok + summary.counts.nondetection;
        assert_eq!(measured, 6, "the target is measured all the same: {error}");
        let message = error.to_string();
        assert!(message.contains("no star matched") || message.contains("need 5"), "{message}");
    }
}

// ---------------------------------------------------------------- flats

#[test]
fn flats_of_which_none_can_be_used_stop_the_night_with_their_levels() {
    for (adu, why) in [
        (500, "every pixel is 500 ADU: the file was never filled"),
        (65_535, "1.000 of full scale, outside flat.level_range_frac"),
    ] {
        let n = night();
        n.frames("flat").iter().for_each(|p| fill(p, adu));
        refused(&n, 5, &["0 of 4 flats are usable", "flat_000.fits", why]);
    }
    let n = night();
    n.frames("flat").iter().for_each(|p| fill_nan(p));
    refused(&n, 5, &["0 of 4 flats are usable", "no finite pixel"]);
}

#[test]
fn one_bad_flat_is_a_rejected_row_and_the_others_make_the_master() {
    let zero: fn(&Path) = |p| fill(p, 500);
    for damage in [zero, |p| fill_nan(p), |p| shrink(p)] {
        let n = night();
        damage(&n.path("flat_002.fits"));
        let summary = n.run().unwrap();
        assert_eq!((summary.counts.ok, summary.counts.rejected, summary.counts.failed), (6, 1, 0));
        let row = n.row("flat_002.fits");
        assert_eq!((row.status.as_str(), row.verdict.as_str()), ("rejected", "reject"));
        assert!(row.reason.starts_with("flat: "), "{}", row.reason);
        let without = night().remove("flat_002");
        without.run().unwrap();
        n.same_tables_but_for(&["flat_002.fits"], &without);
    }
}

// ---------------------------------------------------------------- one broken frame

/// Damages one frame; the night must hold one row for it, with this status and reason, and everything else must be
/// what the night without that frame gives, to the byte.
fn costs_one_row(frame: &str, status: &str, words: &[&str], damage: impl Fn(&Night)) {
    let n = night();
    damage(&n);
    let summary = n.run().unwrap();
    assert!(summary.poor_error().is_none(), "{frame}: {:?}", summary.poor);
    let row = n.row(frame);
    assert_eq!((row.status.as_str(), row.verdict.as_str()), (status, "reject"), "{frame}: {}", row.reason);
    assert!((row.v_mag, row.flux_e, row.residual_mag) == (None, None, None), "{frame} was measured");
    for word in words {
        assert!(row.reason.contains(word), "{frame}: \"{word}\" is not in: {}", row.reason);
    }
    assert_eq!(summary.failures.len(), 1);
    let without = night().remove(frame.trim_end_matches(".fits"));
    without.run().unwrap();
    n.same_tables_but_for(&[frame], &without);
    assert_eq!(n.rows().len(), without.rows().len() + 1);
}

#[test]
fn one_target_frame_with_a_broken_file_costs_one_row() {
    let frame = TARGETS[3];
    costs_one_row(frame, "failed", &["truncated"], |n| {
        let bytes = std::fs::read(n.path(frame)).unwrap();
        std::fs::write(n.path(frame), &bytes[..20_000]).unwrap();
    });
    costs_one_row(frame, "failed", &["empty"], |n| std::fs::write(n.path(frame), "").unwrap());
    costs_one_row(frame, "failed", &["not a FITS file"], |n| std::fs::write(n.path(frame), "clouds").unwrap());
    costs_one_row(frame, "failed", &["no usable pixel", "NaN"], |n| fill_nan(&n.path(frame)));
    costs_one_row(frame, "rejected", &["80x60", "160x120"], |n| shrink(&n.path(frame)));
    let card = |keyword: &'static str, value: &'static str| {
        move |n: &Night| support::set_card(&n.path(frame), keyword, Some(value))
    };
    costs_one_row(frame, "failed", &["NAXIS1 = -160 is negative"], card("NAXIS1", "-160"));
    costs_one_row(frame, "failed", &["truncated", "promises"], card("NAXIS2", "777777701"));
    costs_one_row(frame, "failed", &["BITPIX = 13"], card("BITPIX", "13"));
    costs_one_row(frame, "failed", &["BZERO = 'high'"], card("BZERO", "'high'"));
    costs_one_row(frame, "failed", &["BSCALE = 0"], card("BSCALE", "0"));
    // Rice tiles under the same name: whole they are the frame, cut in a tile they are a row
    costs_one_row(frame, "failed", &["tile 61 of 120"], |n| damage_a_tile(&n.path(frame)));
}

/// Packs a frame into Rice tiles, one per row, and lies about where the 61st begins.
fn damage_a_tile(path: &Path) {
    let header = satphot::fits::Header::read(path).unwrap();
    let value = |c: &satphot::fits::Card| match (c.is_text, c.value.parse::<f64>()) {
        (false, Ok(number)) => satphot::fits::CardValue::Real(number),
        _ => satphot::fits::CardValue::Text(c.value.clone()),
    };
    let structure =
        ["SIMPLE", "BITPIX", "NAXIS", "NAXIS1", "NAXIS2", "BZERO", "BSCALE", "EXTEND", "COMMENT", "HISTORY"];
    let cards: Vec<_> = header
        .cards()
        .iter()
        .filter(|c| !structure.contains(&c.keyword.as_str()))
        .map(|c| (c.keyword.clone(), value(c), c.comment.clone()))
        .collect();
    std::fs::remove_file(path).unwrap();
    satphot::fits::write_u16(path, &ndarray::Array2::from_elem((120, 160), 1_000), &cards, true).unwrap();
    let mut bytes = std::fs::read(path).unwrap();
    let begin = bytes.windows(8).rposition(|w| w == b"XTENSION").unwrap();
    let end = bytes[begin..].chunks(80).position(|c| c.starts_with(b"END     ")).unwrap() * 80 + begin;
    let row = (end + 80).div_ceil(2880) * 2880 + 60 * 8;
    bytes[row + 4..row + 8].copy_from_slice(&i32::MAX.to_be_bytes());
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn a_frame_that_was_changed_after_it_was_written_is_measured_and_reported() {
    let n = night();
    let frame = n.path(TARGETS[2]);
    let mut bytes = std::fs::read(&frame).unwrap();
    let end = bytes.chunks(80).position(|c| c.starts_with(b"END     ")).unwrap() * 80;
    assert_ne!(end % 2880, 2800, "there must be room for one more card");
    let cards = format!("{:<80}{:<80}", "DATASUM = '1234567 '", "END");
    bytes[end..end + 160].copy_from_slice(cards.as_bytes());
    std::fs::write(&frame, bytes).unwrap();
    let summary = n.run().unwrap();
    assert_eq!(summary.counts.ok, 6);
    let is_reported = |s: &String| s.contains(TARGETS[2]) && s.contains("DATASUM = '1234567'");
    assert_eq!(summary.notes.iter().filter(|s| is_reported(s)).count(), 1, "{:?}", summary.notes);
}

#[test]
fn one_target_frame_with_a_broken_header_costs_one_row() {
    let frame = TARGETS[3];
    let card = |keyword: &'static str, value: Option<&'static str>| {
        move |n: &Night| support::set_card(&n.path(frame), keyword, value)
    };
    costs_one_row(frame, "failed", &["123", "[detector.e_per_adu]"], card("GAIN", Some("123")));
    costs_one_row(frame, "failed", &["header GAIN", "header.aliases.gain"], card("GAIN", None));
    costs_one_row(frame, "failed", &["header GAIN"], card("GAIN", Some("'high'")));
    costs_one_row(frame, "failed", &["DATE-OBS", "header.aliases.date_obs"], card("DATE-OBS", None));
    costs_one_row(frame, "failed", &["DATE-OBS", "yesterday"], card("DATE-OBS", Some("'yesterday'")));
    costs_one_row(frame, "failed", &["EXPTIME", "0 s"], card("EXPTIME", Some("0.0")));
    costs_one_row(frame, "failed", &["EXPTIME", "-1 s"], card("EXPTIME", Some("-1.0")));
    costs_one_row(frame, "failed", &["EXPTIME", "header.aliases.exptime"], card("EXPTIME", None));
}

#[test]
fn one_target_frame_at_an_impossible_time_is_rejected_with_the_reason() {
    let frame = TARGETS[3];
    let at = |when: &'static str| move |n: &Night| support::set_card(&n.path(frame), "DATE-OBS", Some(when));
    costs_one_row(frame, "rejected", &["below the horizon", "check the clock"], at("'2025-06-09T12:56:13'"));
    let late = night();
    support::set_card(&late.path(frame), "DATE-OBS", Some("'2020-06-09T10:35:00'"));
    let summary = late.run().unwrap();
    assert_eq!((summary.counts.ok, summary.counts.rejected), (5, 1));
    assert!(late.row(frame).reason.contains("orbit.max_age_d"), "{}", late.row(frame).reason);
}

#[test]
fn one_star_frame_that_is_broken_costs_one_row() {
    let frame = "field01_01.fits";
    let card = |keyword: &'static str, value: Option<&'static str>| {
        move |n: &Night| support::set_card(&n.path(frame), keyword, value)
    };
    costs_one_row(frame, "failed", &["no usable pixel"], |n| fill_nan(&n.path(frame)));
    costs_one_row(frame, "rejected", &["80x60"], |n| shrink(&n.path(frame)));
    costs_one_row(frame, "failed", &["123", "[detector.e_per_adu]"], card("GAIN", Some("123")));
    costs_one_row(frame, "failed", &["DATE-OBS"], card("DATE-OBS", None));
    costs_one_row(frame, "failed", &["EXPTIME"], card("EXPTIME", Some("0.0")));
}

#[test]
fn star_frames_without_coordinates_are_matched_or_where_that_is_forbidden_ask_for_it() {
    let without = || night().card("field", "CTYPE1", None).card("field", "CTYPE2", None);
    let never = without().set("stars.solve=\"never\"");
    let error = never.run().unwrap().poor_error().unwrap();
    assert_eq!(error.exit_code(), 3);
    assert!(error.to_string().contains("stars.solve"), "{error}");
    // most of these fields of a few stars can be matched all the same, and every row says so
    let matched = without();
    let summary = matched.run().unwrap();
    assert!(summary.zeropoint.is_some() && summary.counts.failed < 4, "{:?}", summary.failures);
    let replaced = satphot::photometry::Flags::WCS_REPLACED;
    let (rows, _) = satphot::tables::read_stars(&matched.result("stars.ecsv")).unwrap();
    assert!(rows.iter().all(|r| satphot::photometry::Flags(r.flags).has(replaced)));
}

#[test]
fn too_many_failures_are_code_3_and_strict_allows_none() {
    let broken = |frames: &[&str]| {
        let n = night();
        frames.iter().for_each(|f| std::fs::write(n.path(f), "clouds").unwrap());
        n
    };
    let mut one = broken(&TARGETS[..1]);
    assert!(one.run().unwrap().poor_error().is_none());
    one.options.strict = true;
    let error = one.run().unwrap().poor_error().unwrap();
    assert_eq!((error.exit_code(), error.to_string().contains("1 of 15 frames failed")), (3, true), "{error}");
    let few = broken(&TARGETS[..2]).set("night.max_failed_frac=0.1");
    assert_eq!(few.run().unwrap().poor_error().unwrap().exit_code(), 3);
    assert_eq!(few.rows().len(), 6, "the tables are written all the same");
    let allowed = broken(&TARGETS[..2]).set("night.max_failed_frac=0.2");
    assert!(allowed.run().unwrap().poor_error().is_none());
}

// ---------------------------------------------------------------- order, threads, inputs

#[test]
fn the_same_night_gives_the_same_bytes_again_and_on_any_number_of_threads() {
    let mut n = night();
    let mut seen = Vec::new();
    for jobs in [1, 2, 2, 3] {
        n.options.jobs = jobs;
        n.run().unwrap();
        let names = ["photometry.ecsv", "stars.ecsv", "residuals.ecsv", "zeropoint.toml", "master_flat.fits"];
        seen.push(names.map(|name| std::fs::read(n.result(name)).unwrap()));
    }
    assert!(seen.iter().all(|s| *s == seen[0]));
}

#[test]
fn inputs_are_never_modified() {
    let n = night();
    std::fs::write(n.path(TARGETS[0]), "clouds").unwrap();
    let before = hashes(n.path("").as_path());
    n.run().unwrap();
    assert_eq!(hashes(n.path("").as_path()), before);
}

#[test]
fn results_of_an_earlier_run_inside_the_input_folder_are_not_inputs() {
    let n = night();
    let first = n.run().unwrap().counts;
    assert_eq!(first.files, 19);
    assert_eq!(n.run().unwrap().counts, first);
    // results that went elsewhere under the input folder are no flats either
    std::fs::rename(n.path("satphot-out"), n.path("kept")).unwrap();
    let after = n.run().unwrap().counts;
    assert_eq!(
        (after.flats, after.stars, after.targets, after.ok),
        (first.flats, first.stars, first.targets, first.ok)
    );
}

#[test]
fn an_output_folder_that_cannot_be_made_is_named() {
    refused(&night().set("night.output=pipeline.toml"), 4, &["pipeline.toml"]);
    refused(&night().set("night.output=/proc/nowhere"), 4, &["/proc/nowhere"]);
}

#[test]
fn results_may_go_into_the_folder_of_the_frames() {
    let n = night().set("night.output=.");
    for _ in 0..2 {
        let counts = n.run().unwrap().counts;
        assert_eq!((counts.files, counts.ok + counts.nondetection), (19, 6));
    }
    assert!(n.path("tiny/photometry.ecsv").exists());
    refused(&night().set("night.name=.."), 2, &["night.name", "plain folder name"]);
    refused(&night().set("night.input=[]"), 2, &["night.input", "empty"]);
}

#[test]
fn a_clock_that_puts_every_frame_below_the_horizon_is_code_3_with_the_reason() {
    let n = night().set("time.offset_s=14400");
    let summary = n.run().unwrap();
    assert_eq!((summary.counts.rejected, summary.counts.ok), (6, 0));
    let error = summary.poor_error().unwrap();
    assert_eq!(error.exit_code(), 3);
    assert!(error.to_string().contains("none of 6 target frames") && error.to_string().contains("clock"), "{error}");
}

#[test]
fn files_of_one_name_in_two_folders_keep_their_own_hashes() {
    let n = night();
    std::fs::create_dir(n.path("later")).unwrap();
    std::fs::rename(n.path(TARGETS[5]), n.path("later").join(TARGETS[4])).unwrap();
    assert_eq!(n.run().unwrap().counts.targets, 6);
    let manifest = n.manifest();
    for input in manifest["inputs"].as_array().unwrap() {
        let path = PathBuf::from(input["path"].as_str().unwrap());
        assert_eq!(input["sha256"], satphot::base::hash::sha256_16(&path).unwrap(), "{}", path.display());
    }
}

/// The program as a user whom permissions stop: as it is, or as `nobody` where the tests are root's. `None` where nobody cannot be
/// had.
#[cfg(unix)]
fn as_user(folder: &Path, args: &[&str]) -> Option<std::process::Output> {
    use std::os::unix::fs::PermissionsExt;
    use std::process::Command;
    let id = Command::new("id").arg("-u").output().ok()?;
    if id.stdout.trim_ascii() != b"0" {
        return Command::new(env!("CARGO_BIN_EXE_satphot")).args(args).current_dir(folder).output().ok();
    }
    // the folder of the build may be closed to nobody
    let program = folder.join("satphot-of-nobody");
    std::fs::copy(env!("CARGO_BIN_EXE_satphot"), &program).unwrap();
    std::fs::set_permissions(folder, std::fs::Permissions::from_mode(0o777)).unwrap();
    let nobody = ["--reuid=65534", "--regid=65534", "--clear-groups"];
    let output = Command::new("setpriv").args(nobody).arg(&program).args(args).current_dir(folder).output().ok()?;
    (!String::from_utf8_lossy(&output.stderr).starts_with("setpriv:")).then_some(output)
}

#[cfg(unix)]
#[test]
fn a_folder_within_the_night_that_cannot_be_read_is_a_row_and_the_night_goes_on() {
    use std::os::unix::fs::PermissionsExt;
    let night = night();
    let closed = night.path("lost+found");
    std::fs::create_dir(&closed).unwrap();
    std::fs::copy(night.path(TARGETS[0]), closed.join("hidden.fits")).unwrap();
    std::fs::set_permissions(&closed, std::fs::Permissions::from_mode(0o000)).unwrap();
    let output = as_user(&night.path("."), &["run", "-q"]);
    std::fs::set_permissions(&closed, std::fs::Permissions::from_mode(0o755)).unwrap();
    let Some(output) = output else {
        eprintln!("skipped: the tests are root's, and there is no setpriv to become nobody");
        return;
    };
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let measured = night.rows().into_iter().filter(|r| TARGETS.contains(&r.frame.as_str()) && r.v_mag.is_some());
    assert!(measured.count() >= 5, "{said}");
    let manifest = night.manifest().to_string();
    assert!(manifest.contains("lost+found") && manifest.contains("lost+found: permission denied"), "{manifest}");
}
