//! Filters and satellites that do not belong together: every wrong but plausible twin of a night is refused, set aside or
//! named, and never becomes a V magnitude.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::Path;

use satphot::base::progress::Silent;
use satphot::pipeline::groups::{Night as Reduced, run_night};
use satphot::tables::{MetaValue, read_meta};

use crate::support::{Night, simulated};

const ALL: [&str; 3] = ["flat", "field", "target"];

/// Puts a card before the END of a header that has room for it, or changes the one that is there.
pub(super) fn put_card(path: &Path, keyword: &str, value: &str) {
    let mut bytes = fs::read(path).unwrap();
    let card = format!("{:<80}", format!("{keyword:<8}= '{value:<8}'"));
    let same = |at: usize| bytes[at..at + 80].starts_with(format!("{keyword:<8}=").as_bytes());
    let places: Vec<usize> = (0..).map(|k| k * 80).take_while(|at| !bytes[*at..].starts_with(b"END     ")).collect();
    if let Some(at) = places.iter().copied().find(|at| same(*at)) {
        bytes[at..at + 80].copy_from_slice(card.as_bytes());
    } else {
        let end = places.len() * 80;
        if (end + 160).div_ceil(2880) == (end + 80).div_ceil(2880) {
            bytes.copy_within(end..end + 80, end + 80);
            bytes[end..end + 80].copy_from_slice(card.as_bytes());
        } else {
            let block = [card.into_bytes(), vec![b' '; 2800]].concat();
            let mut grown = bytes[..end].to_vec();
            grown.extend(&block[..80]);
            grown.extend(format!("{:<80}", "END").as_bytes());
            grown.resize(grown.len().div_ceil(2880) * 2880, b' ');
            grown.extend(&bytes[(end + 80).div_ceil(2880) * 2880..]);
            bytes = grown;
        }
    }
    fs::write(path, bytes).unwrap();
}

/// The tiny night with the text of FILTER in its flats, star frames and target frames; `-` leaves the card out.
fn night(name: &str, filters: [&str; 3]) -> Night {
    let night = Night::copy_of(&simulated(name, &[]));
    for (prefix, filter) in ALL.iter().zip(filters).filter(|(_, f)| *f != "-") {
        night.frames(prefix).iter().for_each(|path| put_card(path, "FILTER", filter));
    }
    night
}

fn meta(night: &Night, key: &str) -> String {
    match read_meta(&night.result("photometry.ecsv")).unwrap().get(key) {
        Some(MetaValue::Text(text)) => text.clone(),
        other => format!("{other:?}"),
    }
}

/// The catalogue of the night with its column of magnitudes called otherwise.
fn renamed_column(night: Night, name: &str) -> Night {
    let text = fs::read_to_string(night.path("catalogue.csv")).unwrap();
    let text = text.replacen("Vmag,e_Vmag", &format!("{name},e_{name}"), 1);
    let columns = format!("stars.columns={{ v_mag = \"{name}\" }}");
    night.file("catalogue.csv", text).set(&columns)
}

#[test]
fn stars_and_targets_of_different_filters_are_refused_with_counts_and_the_line_to_write() {
    for (stars, targets) in [("R", "V"), ("B", "V"), ("Rc", "-"), ("g'", "V"), ("Ha", "V")] {
        let (code, message) = night("filter_mixed", [targets, stars, targets]).refusal();
        assert_eq!(code, 2, "{message}");
        for words in ["input.filter", "4 flats", "9 star frames", "6 target frames", "[input]\nfilter = "] {
            assert!(message.contains(words), "{stars} and {targets}: \"{words}\" is not in {message}");
        }
    }
}

#[test]
fn spellings_of_one_filter_are_one_filter_and_the_result_is_in_its_band() {
    let n = night("filter_spellings", ["Bessell V", "Johnson_V", "V"]);
    let summary = n.run().unwrap();
    assert_eq!((summary.counts.flats, summary.counts.other_filter), (4, 0));
    assert_eq!((meta(&n, "band"), meta(&n, "calibration")), ("V".into(), "V".into()));
    assert!(n.rows().iter().any(|r| r.residual_mag.is_some()));
}

#[test]
fn a_text_of_filter_means_what_the_configuration_says() {
    let night = night("own_names", ["Slot 3", "Slot 3", "visual"]);
    let (code, problem) = night.refusal();
    assert!(code == 2 && problem.contains("Slot 3"), "{problem}");
    let night = night.set("input.filters={ \"Slot 3\" = \"V\", visual = \"Johnson V\" }");
    night.run().unwrap();
    assert_eq!((meta(&night, "filter"), meta(&night, "band")), ("V".into(), "V".into()));
    // a filter that is none is refused, with the key
    let (code, problem) = night.set("input.filters={ \"Slot 3\" = \"green glass\" }").refusal();
    assert!(code == 2 && problem.contains("input.filters") && problem.contains("green glass"), "{problem}");
}

#[test]
fn unfiltered_frames_are_carried_to_v_and_said_to_be() {
    for filter in ["-", "Clear", "L"] {
        let n = night("filter_none", [filter; 3]);
        let summary = n.run().unwrap();
        assert_eq!(meta(&n, "calibration"), "V, unfiltered, colour-transformed", "{filter}");
        assert!(summary.notes.iter().any(|note| note.contains("V, unfiltered, colour-transformed")));
        assert!(n.text("zeropoint.toml").contains("filter = \"no filter\""));
    }
}

#[test]
fn flats_of_another_filter_never_flatten() {
    for (flats, lights) in [("L", "V"), ("Ha", "V"), ("V", "-"), ("-", "V")] {
        let (code, message) = night("filter_flats", [flats, lights, lights]).refusal();
        assert!(code == 2 && message.contains("flats are of another filter"), "{flats}: {message}");
        // with the key the night is reduced without them
        let requested = if lights == "-" { "none" } else { lights };
        let n = night("filter_flats", [flats, lights, lights]).set(&format!("input.filter={requested:?}"));
        let summary = n.run().unwrap();
        assert_eq!((summary.counts.flats, summary.counts.other_filter), (0, 4), "{flats}");
        assert!(summary.text().contains("set aside: 4 of another filter"), "{}", summary.text());
        assert!(summary.notes.iter().any(|note| note.starts_with("4 frames with ") && note.contains("not used")));
    }
    // flats of two filters: those of the frames are used
    let n = night("filter_flats_two", ["V", "V", "V"]);
    n.frames("flat").iter().take(1).for_each(|path| put_card(path, "FILTER", "Ha"));
    let summary = n.run().unwrap();
    assert_eq!((summary.counts.flats, summary.counts.other_filter), (3, 1));
}

#[test]
fn a_filter_requested_excludes_the_frames_of_others() {
    let n = night("filter_asked", ["V", "V", "V"]).set("input.filter=\"Johnson V\"");
    n.frames("field00").iter().chain(&n.frames("target_0005")).for_each(|path| put_card(path, "FILTER", "Rc"));
    let summary = n.run().unwrap();
    assert_eq!((summary.counts.stars, summary.counts.targets, summary.counts.other_filter), (6, 5, 4));
    assert!(n.rows().iter().all(|r| r.frame != "target_0005.fits" && r.filter == "V"));
    let (code, message) = night("filter_absent", ["V"; 3]).set("input.filter=\"B\"").refusal();
    assert!(code == 2 && message.contains("no star or target frame") && message.contains("V: 4 flats"), "{message}");
}

#[test]
fn frames_of_another_band_than_the_catalogue_are_v_only_by_declaration() {
    for filter in ["Rc", "Johnson B", "gp", "R", "7"] {
        let (code, message) = night("filter_r", [filter; 3]).refusal();
        assert!(code == 2 && message.contains("photometry.band"), "{filter}: {message}");
    }
    let n = night("filter_declared", ["Rc"; 3]).set("photometry.band=\"V\"");
    n.run().unwrap();
    assert_eq!(meta(&n, "calibration"), "V, declared for filter R, colour-transformed");
    // nothing declares Ha to be V
    let (code, message) = night("filter_ha", ["Ha"; 3]).set("photometry.band=\"V\"").refusal();
    assert!(code == 2 && message.contains("no catalogue has magnitudes"), "{message}");
}

#[test]
fn a_column_of_g_gives_g_in_every_product_and_no_residual_to_a_model_in_v() {
    let n = renamed_column(night("filter_g", ["-"; 3]), "gmag");
    let summary = n.run().unwrap();
    assert_eq!((meta(&n, "band"), meta(&n, "mag_system")), ("g".into(), "AB".into()));
    assert_eq!(meta(&n, "calibration"), "g, unfiltered, colour-transformed");
    assert!(summary.text().contains("g = g_inst - ZP"), "{}", summary.text());
    assert!(n.rows().iter().all(|r| r.residual_mag.is_none()) && n.rows().iter().any(|r| r.v_mag.is_some()));
    assert!(summary.notes.iter().any(|note| note.contains("no residuals") && note.contains("model.band = \"g\"")));
    let header = n.text("photometry.ecsv");
    assert!(header.contains("apparent g magnitude") && !header.contains("apparent V magnitude"));
    let zeropoint = n.text("zeropoint.toml");
    assert!(zeropoint.contains("convention = \"g = g_inst") && zeropoint.contains("band = \"g\""), "{zeropoint}");
    // compared with a model in g, and declared V it is refused
    let same = renamed_column(night("filter_g", ["-"; 3]), "gmag").set("model.band=\"g\"");
    same.run().unwrap();
    assert!(same.rows().iter().any(|r| r.residual_mag.is_some()));
    let (code, message) = renamed_column(night("filter_g", ["-"; 3]), "gmag").set("photometry.band=\"V\"").refusal();
    assert!(code == 2 && message.contains("`gmag`") && message.contains("band g"), "{message}");
    let (code, message) = renamed_column(night("filter_g", ["-"; 3]), "mymag").refusal();
    assert!(code == 2 && message.contains("`mymag`") && message.contains("[photometry]\nband"), "{message}");
}

#[test]
fn a_night_in_g_finds_its_magnitudes_its_colour_index_and_its_model_by_itself() {
    let demo = |filter: &str| {
        let night = Night::copy_of(&Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/night"));
        ALL.iter().flat_map(|kind| night.frames(kind)).for_each(|path| put_card(&path, "FILTER", filter));
        night.set("night.name=\"tiny\"")
    };
    let v = demo("V");
    v.run().unwrap();
    // g as V was, and r so that g - r goes with B - V as Jester et al. 2005 have it
    let n = demo("gp");
    let text = fs::read_to_string(n.path("catalogue.csv")).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let mut made = String::from("recno,RAJ2000,DEJ2000,g'mag,e_g'mag,r'mag,e_r'mag\n");
    for line in lines {
        let cell: Vec<&str> = line.split(',').collect();
        let number = |name: &str| cell[at(name)].parse::<f64>().unwrap();
        let (g, colour) = (number("Vmag"), (number("B-V") - 0.22) / 0.98);
        let [id, ra, dec, err] = ["recno", "RAJ2000", "DEJ2000", "e_Vmag"].map(|name| cell[at(name)]);
        made += &format!("{id},{ra},{dec},{g},{err},{:.4},0.001\n", g - colour);
    }
    let n = n.file("catalogue.csv", made);
    let reduced = run_night(&n.config().unwrap(), &n.options, &Silent).unwrap();
    let Reduced::Single(summary) = reduced else { panic!("several groups") };
    assert_eq!(
        (meta(&n, "band"), meta(&n, "colour_index"), meta(&n, "model_band")),
        ("g".into(), "g-r".into(), "g".into())
    );
    assert!(summary.text().contains("C (g-r)"), "{}", summary.text());
    assert!(n.text("zeropoint.toml").contains("colour_index = \"g-r\""));
    assert!(n.text("stars.ecsv").contains("colour g-r of the catalogue"));
    let zeropoint = satphot::zeropoint::fit::Zeropoint::read(&n.result("zeropoint.toml")).unwrap();
    let [colour, err] = zeropoint.target_b_v_mag;
    assert!((colour - 0.46).abs() < 1e-9 && err == 0.1, "the Sun's g - r: {colour} {err}");
    // the same light: the same numbers, but for C times what 0.02 mag of colour are; in sunlight, which the first pass is in, the
    // model in g is the Sun's V - g away
    let (mut compared, sun) = (0, -26.76 + 26.47);
    for (a, b) in v.rows().iter().zip(n.rows()).take(5) {
        if let (Some(of_v), Some(of_g)) = (a.v_mag, b.v_mag) {
            assert!((of_v - of_g).abs() < 0.02, "{}: {of_v} {of_g}", a.frame);
        }
        if let (Some(of_v), Some(of_g)) = (a.residual_mag, b.residual_mag) {
            assert!((of_g - of_v - sun).abs() < 0.05, "{}: {of_v} {of_g}", a.frame);
            compared += 1;
        }
    }
    assert!(compared > 2, "{compared}");
}

#[test]
fn exports_of_a_night_in_g_never_say_v() {
    let n = renamed_column(night("filter_g_exports", ["gp"; 3]), "gmag").set("model.band=\"g\"");
    n.run().unwrap();
    let table = n.result("photometry.ecsv").display().to_string();
    let who = ["--organisation", "X", "--station", "S", "--verdicts", "use,caution"];
    for (format, right, wrong) in [
        ("tdm", "RECEIVE_BAND = g", "RECEIVE_BAND = V"),
        ("udl", "BAND_g", "BAND_V"),
        ("votable", "phot.mag;em.opt.B", "em.opt.V\""),
    ] {
        let out = n.path(&format!("out.{format}")).display().to_string();
        let mut args = vec!["export", &table, "--to", format, "-o", &out];
        args.extend(if format == "votable" { &who[..0] } else { &who[..] });
        n.satphot(&args).expect(0, &[]);
        let text = fs::read_to_string(&out).unwrap();
        assert!(text.contains(right), "{format}: no {right} in {text}");
        // the colour B-V of stars is in no table of photometry
        assert!(!text.contains(wrong), "{format}: {wrong}");
    }
}

#[test]
fn a_zeropoint_and_a_master_flat_hold_for_their_own_filter() {
    let made = night("filter_previous", ["V"; 3]);
    made.run().unwrap();
    let (zeropoint, master) = (made.text("zeropoint.toml"), fs::read(made.result("master_flat.fits")).unwrap());
    assert!(zeropoint.contains("band = \"V\"") && zeropoint.contains("filter = \"V\""), "{zeropoint}");
    let with = |filter: &str, zeropoint: &str| {
        let n = night("filter_previous", [filter; 3]).file("zp.toml", zeropoint);
        n.set("zeropoint.previous=zp.toml").set("photometry.fwhm_px=3.0")
    };
    with("Johnson V", &zeropoint).run().unwrap();
    let (code, message) = with("Rc", &zeropoint).refusal();
    assert!(code == 2 && message.contains("zeropoint.previous") && message.contains("zp.toml"), "{message}");
    let (code, message) = with("Clear", &zeropoint).refusal();
    assert!(code == 2 && message.contains("no filter"), "{message}");
    // a file of an older version says neither
    let old: String = zeropoint
        .lines()
        .filter(|l| !l.starts_with("band = ") && !l.starts_with("filter = "))
        .map(|l| l.to_owned() + "\n")
        .collect();
    let summary = with("V", &old).run().unwrap();
    assert!(summary.notes.iter().any(|note| note.contains("does not say its band and filter")));
    let (code, message) = with("Rc", &old).refusal();
    assert!(code == 2 && message.contains("photometry.band"), "{message}");
    // the flat: the very file of V in a night of R
    let of_flat = |filter: &str| {
        let n = night("filter_previous", [filter; 3]).file("flat_v.fits.master", &master);
        n.set("flat.master=flat_v.fits.master").set("photometry.band=V")
    };
    of_flat("V").run().unwrap();
    let (code, message) = of_flat("Rc").refusal();
    assert!(code == 2 && message.contains("flat.master") && message.contains("FILTER = 'V'"), "{message}");
}

#[test]
fn red_green_and_blue_mean_what_the_other_filters_imply() {
    let lettered = |other_filter: &str| {
        let n = night("filter_letters", ["R"; 3]).set("input.filter=\"R\"").set("zeropoint.pin_c={ value = 0.0 }");
        put_card(&n.frames("flat")[0], "FILTER", other_filter);
        renamed_column(n, "Rmag")
    };
    let band = |other_filter: &str| {
        let n = lettered(other_filter);
        n.run().map(|_| meta(&n, "band")).map_err(|e| e.to_string())
    };
    assert_eq!(band("L").unwrap(), "TR");
    assert_eq!(band("V").unwrap(), "R");
    assert!(band("R").unwrap_err().contains("may be R or TR"));
}

#[test]
fn the_name_of_the_wheel_is_no_filter() {
    let n = night("filter_wheel", ["-"; 3]);
    ALL.iter().flat_map(|p| n.frames(p)).for_each(|path| put_card(&path, "FWHEEL", "ZWO EFW"));
    n.run().unwrap();
    assert!(n.rows().iter().all(|r| r.filter.is_empty()));
    assert_eq!(meta(&n, "calibration"), "V, unfiltered, colour-transformed");
}

#[test]
fn frames_of_a_second_satellite_are_set_aside_and_never_become_star_frames() {
    let other = "STARLINK-1007\n\
        1 44713U 19074A   25160.50000000  .00001000  00000-0  80000-4 0  9990\n\
        2 44713  53.0500 100.0000 0001400  90.0000 270.0000 15.06400000300000\n";
    let checksum = |line: &str| {
        let sum: u32 = line[..68].chars().map(|c| c.to_digit(10).unwrap_or(u32::from(c == '-'))).sum();
        format!("{}{}", &line[..68], sum % 10)
    };
    let other: String =
        other.lines().map(|l| if l.len() == 69 { checksum(l) + "\n" } else { l.to_owned() + "\n" }).collect();
    let n = Night::copy_of(&simulated("second_satellite", &[])).set("orbit.norad_cat_id=25544");
    let elements = n.config().unwrap().orbit.unwrap().elements;
    fs::write(&elements, fs::read_to_string(&elements).unwrap() + &other).unwrap();
    let targets = n.frames("target");
    for (path, object) in targets.iter().zip(["STARLINK-1007", "44713", "2019-074A", "Starlink 1007 pass 2"]) {
        put_card(path, "OBJECT", object);
    }
    let summary = n.run().unwrap();
    let c = &summary.counts;
    assert_eq!((c.stars, c.targets, c.other_target, c.failed), (9, 2, 4, 0), "{c:?}");
    assert!(summary.text().contains("set aside: 4 of another target"), "{}", summary.text());
    let message = n.satphot(&["run", "pipeline.toml", "--dry-run", "--set", "orbit.norad_cat_id=25544"]);
    assert_eq!(
        message.out.matches("\nother target ").count() + usize::from(message.out.starts_with("other target ")),
        4,
        "{message:#?}"
    );
    // one that no file of elements holds is a satellite all the same
    let n = Night::copy_of(&simulated("second_satellite", &[]));
    put_card(&n.frames("target")[0], "OBJECT", "STARLINK-30001");
    assert_eq!(n.run().unwrap().counts.other_target, 1);
}

#[test]
fn the_model_is_named_and_another_satellites_is_warned_of() {
    let message = |satellite: &str| {
        let n = Night::copy_of(&simulated("which_model", &[])).set(&format!("model.satellite={satellite}"));
        n.run().unwrap().notes
    };
    let has = |notes: &[String], words: &[&str]| notes.iter().any(|n| words.iter().all(|w| n.contains(w)));
    let right = message("iss");
    assert!(has(&right, &["ISS (ZARYA) [25544] is compared with the model iss"]), "{right:?}");
    assert!(!has(&right, &["warning"]), "{right:?}");
    let wrong = message("starlink-v1.5");
    assert!(
        has(&wrong, &["warning", "[25544]", "not a satellite of the model starlink-v1.5", "one of iss"]),
        "{wrong:?}"
    );
}
