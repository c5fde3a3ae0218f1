//! One orbit in every format and dress, and what no format states: sets that contradict each other, and decayed ones.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::io::Write;
use std::path::{Path, PathBuf};

use hifitime::{Duration, Epoch};
use satphot::orbit::{EarthOrientation, Elements, Propagator, Site, Tracker, read_elements};

const L1: &str = "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996";
const L2: &str = "2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748";

/// The same elements as CCSDS names them.
const KEYS: [(&str, &str); 17] = [
    ("OBJECT_NAME", "ISS (ZARYA)"),
    ("OBJECT_ID", "1998-067A"),
    ("EPOCH", "2025-06-08T01:41:33.544896"),
    ("MEAN_MOTION", "15.50064259"),
    ("ECCENTRICITY", ".0001632"),
    ("INCLINATION", "51.6400"),
    ("RA_OF_ASC_NODE", "352.2516"),
    ("ARG_OF_PERICENTER", "195.4618"),
    ("MEAN_ANOMALY", "310.3088"),
    ("EPHEMERIS_TYPE", "0"),
    ("CLASSIFICATION_TYPE", "U"),
    ("NORAD_CAT_ID", "25544"),
    ("ELEMENT_SET_NO", "999"),
    ("REV_AT_EPOCH", "51374"),
    ("BSTAR", ".15816E-3"),
    ("MEAN_MOTION_DOT", ".8601E-4"),
    ("MEAN_MOTION_DDOT", "0"),
];

fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/orbits")).join(name);
    if !path.exists() {
        println!("skipped: ../shared/data/orbits/{name} not present");
        return None;
    }
    Some(path)
}

fn read_bytes(bytes: &[u8]) -> Result<Vec<Elements>, String> {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(bytes).unwrap();
    read_elements(file.path()).map_err(|e| e.to_string())
}

fn read_text(text: &str) -> Result<Vec<Elements>, String> {
    read_bytes(text.as_bytes())
}

/// [`KEYS`] with `changes`; an empty value takes the key away.
fn keys(changes: &[(&str, &str)]) -> Vec<(String, String)> {
    let mut keys: Vec<(String, String)> = KEYS.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    for (key, value) in changes {
        keys.retain(|(k, _)| k != key);
        if !value.is_empty() {
            keys.push(((*key).to_owned(), (*value).to_owned()));
        }
    }
    keys
}

fn kvn(keys: &[(String, String)]) -> String {
    let lines: String = keys.iter().map(|(k, v)| format!("{k:<20}= {v}\n")).collect();
    format!("CCSDS_OMM_VERS = 3.0\nCOMMENT by hand\nORIGINATOR = X\n\n{lines}USER_DEFINED_COLOUR = red\n")
}

fn csv(keys: &[(String, String)]) -> String {
    let join = |f: fn(&(String, String)) -> &str| keys.iter().map(f).collect::<Vec<_>>().join(",");
    format!("{}\n{}\n", join(|k| &k.0), join(|k| &k.1))
}

fn json(keys: &[(String, String)]) -> String {
    let fields: Vec<String> = keys.iter().map(|(k, v)| format!("\"{k}\": \"{v}\"")).collect();
    format!("{{{}}}", fields.join(", "))
}

fn xml_message(keys: &[(String, String)]) -> String {
    let data: String = keys.iter().map(|(k, v)| format!("<{k}>{v}</{k}>\n")).collect();
    format!(
        "<omm id=\"CCSDS_OMM_VERS\" version=\"3.0\"><header><CREATION_DATE/><ORIGINATOR/></header><body><segment>\n\
         <metadata><CENTER_NAME>EARTH</CENTER_NAME><REF_FRAME>TEME</REF_FRAME></metadata><data><meanElements>\n{data}\
         </meanElements><userDefinedParameters><USER_DEFINED parameter=\"A\">1</USER_DEFINED>\
         <USER_DEFINED parameter=\"B\">2</USER_DEFINED></userDefinedParameters></data></segment></body></omm>\n"
    )
}

fn xml(keys: &[(String, String)]) -> String {
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- by hand -->\n<ndm>{}</ndm>\n", xml_message(keys))
}

const FORMATS: [(&str, fn(&[(String, String)]) -> String); 4] =
    [("OMM KVN", kvn), ("OMM CSV", csv), ("OMM JSON", json), ("OMM XML", xml)];

/// Largest distance between two orbits within three days \[km\].
fn apart_km(a: &Elements, b: &Elements) -> f64 {
    let (pa, pb) = (Propagator::new(a).unwrap(), Propagator::new(b).unwrap());
    (-36..=36)
        .map(|h| {
            let epoch = b.epoch() + Duration::from_hours(2.0 * f64::from(h));
            (pa.state(&epoch).unwrap().0 - pb.state(&epoch).unwrap().0).norm()
        })
        .fold(0.0, f64::max)
}

#[test]
fn omm_in_json_csv_kvn_and_xml_gives_the_position_of_the_tle_to_a_metre() {
    let tle = &read_text(&format!("{L1}\n{L2}\n")).unwrap()[0];
    for (format, write) in FORMATS {
        let sets = read_text(&write(&keys(&[]))).unwrap();
        assert_eq!((sets.len(), sets[0].format(), sets[0].name()), (1, format, "ISS (ZARYA)"));
        assert_eq!((sets[0].norad_cat_id(), sets[0].object_id()), (25544, "1998-067A"));
        let km = apart_km(&sets[0], tle);
        println!("{format}: {:.1e} m from the TLE within three days", km * 1e3);
        assert!(km < 1e-6, "{format}: {km} km");
    }
    // the published pair rounds the eccentricity by 7e-8: 0.9 m
    let (Some(omm), Some(tle)) = (shared("iss_omm.json"), shared("iss_omm_same_elements.tle")) else { return };
    let (omm, tle) = (&read_elements(&omm).unwrap()[0], &read_elements(&tle).unwrap()[0]);
    let published: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(shared("iss_omm.json").unwrap()).unwrap()).unwrap();
    let at_epoch = |e: &Elements| Propagator::new(e).unwrap().state(&tle.epoch()).unwrap().0;
    assert!((at_epoch(omm) - at_epoch(tle)).norm() < 1e-3);
    let text = |v: &serde_json::Value| v.as_str().map_or_else(|| v.to_string(), str::to_owned);
    let keys: Vec<(String, String)> =
        published[0].as_object().unwrap().iter().map(|(k, v)| (k.clone(), text(v))).collect();
    for (format, write) in FORMATS {
        let same = read_text(&write(&keys)).unwrap();
        assert!((at_epoch(&same[0]) - at_epoch(omm)).norm() < 1e-9, "{format}");
    }
}

#[test]
fn what_makers_leave_out_or_write_otherwise_is_the_same_orbit_in_every_format() {
    let tle = &read_text(&format!("{L1}\n{L2}\n")).unwrap()[0];
    for (format, write) in FORMATS {
        for changes in [
            &[("EPOCH", "2025-06-08T01:41:33.544896Z")][..],
            &[("EPOCH", "2025-159T01:41:33.544896")],
            &[("EPOCH", "2025-06-08 01:41:33.544896+00:00")],
            &[("OBJECT_ID", ""), ("OBJECT_NAME", "")],
            &[("ELEMENT_SET_NO", ""), ("EPHEMERIS_TYPE", ""), ("CLASSIFICATION_TYPE", ""), ("REV_AT_EPOCH", "")],
            &[("CENTER_NAME", "EARTH"), ("REF_FRAME", "TEME"), ("TIME_SYSTEM", "UTC"), ("MEAN_ELEMENT_THEORY", "SGP4")],
            &[("ECCENTRICITY", "1.632e-04"), ("BSTAR", "0.00015816")],
        ] {
            // CENTER_NAME stands in the metadata of the XML already
            if format == "OMM XML" && changes[0].0 == "CENTER_NAME" {
                continue;
            }
            let sets = read_text(&write(&keys(changes))).unwrap_or_else(|e| panic!("{format} {changes:?}: {e}"));
            let km = apart_km(&sets[0], tle);
            assert!(km < 1e-6, "{format} {changes:?}: {km} km");
        }
        // no fraction of a second: another epoch, but one that is understood
        let whole = read_text(&write(&keys(&[("EPOCH", "2025-159T01:41:33")]))).unwrap();
        assert_eq!(whole[0].epoch(), Epoch::from_gregorian_utc_hms(2025, 6, 8, 1, 41, 33), "{format}");
        for number in ["100000", "339999", "799500123"] {
            let sets = read_text(&write(&keys(&[("NORAD_CAT_ID", number)]))).unwrap();
            assert_eq!(sets[0].norad_cat_id().to_string(), number, "{format}");
        }
        for (changes, word) in [
            ([("REF_FRAME", "GCRF")], "REF_FRAME"),
            ([("BSTAR", "")], "BSTAR is missing"),
            ([("EPOCH", "2025-366T00:00:00")], "EPOCH"),
            ([("EPOCH", "yesterday")], "EPOCH"),
            ([("MEAN_MOTION", "fast")], "MEAN_MOTION"),
            ([("ECCENTRICITY", "1.2")], "eccentricity 1.2"),
        ] {
            if format == "OMM XML" && word == "REF_FRAME" {
                continue;
            }
            let message = read_text(&write(&keys(&changes))).unwrap_err();
            assert!(message.contains(word), "{format}: {message}");
        }
    }
}

#[test]
fn files_of_many_objects_are_read_whole_and_cut_ones_are_refused() {
    let numbers = ["25544", "100001", "799500123"];
    let sets = |write: fn(&[(String, String)]) -> String| numbers.map(|n| write(&keys(&[("NORAD_CAT_ID", n)])));
    let csv_rows: Vec<String> = sets(csv).iter().map(|t| t.lines().nth(1).unwrap().to_owned()).collect();
    let header = csv(&keys(&[("NORAD_CAT_ID", "1")])).lines().next().unwrap().to_owned();
    for text in [
        sets(kvn).concat(),
        format!("[{}]", sets(json).join(",\n")),
        sets(json).join("\n"),
        format!("{header}\n{}\n", csv_rows.join("\n")),
        format!("# CelesTrak\n{}\r\n{}", header.to_lowercase(), csv_rows.join("\r\n")),
        format!("<?xml version=\"1.0\"?><ndm xmlns:xsi=\"x\">{}</ndm>", sets(xml_message).concat()),
        sets(kvn).concat().replace("CCSDS_OMM_VERS = 3.0\n", ""),
    ] {
        let got = read_text(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let found: Vec<String> = got.iter().map(|e| e.norad_cat_id().to_string()).collect();
        assert_eq!(found, numbers, "{text}");
        // the same with a byte-order mark, and with the line ends of Windows and of old Macs
        for dressed in
            [format!("\u{feff}{text}"), text.replace('\n', "\r\n"), text.replace("\r\n", "\n").replace('\n', "\r")]
        {
            assert_eq!(read_text(&dressed).unwrap().len(), 3, "{dressed:?}");
        }
    }
    let xml = xml(&keys(&[]));
    let lines = xml.lines().count();
    for part in [10, xml.len() / 2, xml.len() - 40] {
        let message = read_text(&xml[..part]).unwrap_err();
        assert!(message.contains("XML") || message.contains("cut"), "{part}: {message}");
    }
    let broken = xml.replace("</EPOCH>", "</EPOC>");
    let message = read_text(&broken).unwrap_err();
    assert!(message.contains("damaged XML") && (1..=lines).any(|n| message.contains(&format!(":{n}:"))), "{message}");
    let twice = xml.replace("<EPOCH>", "<EPOCH>2020-01-01T00:00:00</EPOCH><EPOCH>");
    assert!(read_text(&twice).unwrap_err().contains("EPOCH stands twice"));
    assert!(read_text("<html><body>Forbidden</body></html>").unwrap_err().contains("HTML"));
    assert!(read_text("No GP data found\n").unwrap_err().contains("FORMAT=json"));
}

/// A line with the checksum it should have.
fn summed(line: &str) -> String {
    let body = &line[..68];
    let sum: u32 = body.chars().map(|c| if c == '-' { 1 } else { c.to_digit(10).unwrap_or(0) }).sum();
    format!("{body}{}", sum % 10)
}

#[test]
fn tles_in_any_dress_are_read_and_damage_is_named_by_line() {
    for text in [
        format!("{L1}\r{L2}\r"),
        format!("\t{L1}\t\r\n  {L2}  \r\n\u{1a}"),
        format!("0 ISS (ZARYA)\n{L1}\n{L2}\n\n{L1}\n{L2}\nISS\n{L1}\n{L2}"),
        format!("# 2LE\n{L1}\n{L2}"),
    ] {
        let sets = read_text(&text).unwrap();
        assert!(sets.iter().all(|e| e.norad_cat_id() == 25544), "{text:?}");
    }
    for (alpha, number) in [("A0000", 100_000), ("J2931", 182_931), ("P4018", 234_018), ("Z9999", 339_999)] {
        let line = |l: &str| summed(&l.replace("25544", alpha));
        let sets = read_text(&format!("{}\n{}\n", line(L1), line(L2))).unwrap();
        assert_eq!(sets[0].norad_cat_id(), number);
    }
    // an accent in the name, of an old Windows
    let mut latin = b"CAF\xc9\n".to_vec();
    latin.extend(format!("{L1}\n{L2}\n").bytes());
    assert_eq!(read_bytes(&latin).unwrap()[0].name(), "CAF\u{c9}");
    let utf16: Vec<u8> = format!("{L1}\n{L2}\n").bytes().flat_map(|b| [b, 0]).collect();
    assert!(read_bytes(&utf16).unwrap_err().contains("UTF-16"));
    let tab = L1.replace("98067A   ", "98067A\t");
    for (text, line, word) in [
        (format!("{L1}\n{}\n", L2.replace("352.2516", "352.2517")), 2, "checksum is '8', expected 9"),
        (format!("NAME\n{}\n{L2}\n", L1.replace("15816", "15817")), 2, "fetch the set again"),
        (format!("{tab}\n{L2}\n"), 1, "holds a tab"),
        (format!("{L1}\n{}\n", &L2[..68]), 2, "68 characters, expected 69"),
    ] {
        let message = read_text(&text).unwrap_err();
        assert!(message.contains(&format!(":{line}:")) && message.contains(word), "{message}");
    }
}

fn tracker(sets: Vec<Elements>) -> Tracker {
    Tracker::new(sets, None, Site::new(-33.7703, 151.1113, 70.0).unwrap(), EarthOrientation::default()).unwrap()
}

#[test]
fn the_nearest_epoch_is_used_at_every_moment_of_a_night_with_many_sets() {
    let Some(path) = shared("iss_2025_june.tle") else { return };
    let tracker = tracker(read_elements(&path).unwrap());
    let epochs = [156.412, 159.071, 165.814];
    for hours in 0..24 * 14 {
        let day = 154.0 + f64::from(hours) / 24.0;
        let at = Epoch::from_gregorian_utc_hms(2025, 6, 3, 0, 0, 0) + Duration::from_hours(f64::from(hours));
        let best = epochs.iter().copied().min_by(|a: &f64, b| (a - day).abs().total_cmp(&(b - day).abs())).unwrap();
        let used = tracker.elements_at(&at).unwrap().epoch().day_of_year();
        assert!((used - best).abs() < 0.002, "day {day}: {used}, nearest {best}");
    }
}

#[test]
fn an_invented_set_among_true_ones_is_not_used_and_with_one_other_nothing_is() {
    let (Some(fabricated), Some(real)) = (shared("fabricated.tle"), shared("iss_2025_june.tle")) else { return };
    let text = std::fs::read_to_string(&fabricated).unwrap();
    let invented = read_text(&text.lines().skip(6).collect::<Vec<_>>().join("\n")).unwrap();
    let real = read_elements(&real).unwrap();
    let at = Epoch::from_gregorian_utc_hms(2025, 6, 17, 12, 0, 0);
    let with = |sets: &[Elements]| tracker(sets.iter().cloned().chain(invented.clone()).collect());
    let among = with(&real);
    assert_eq!(among.elements_at(&at).unwrap().epoch(), real[2].epoch(), "the nearest that is not refuted");
    let message = among.age_warning(&at).unwrap();
    assert!(message.contains("the first is not used") && message.contains("deg apart"), "{message}");
    assert!(among.age_warning(&Epoch::from_gregorian_utc_hms(2025, 6, 9, 0, 0, 0)).is_none());
    // against one other set nobody can tell which is wrong
    let alone = with(&real[2..]);
    let refusal = alone.at(&at).unwrap_err().to_string();
    assert!(refusal.contains("one of them is wrong") && refusal.contains("orbit.force_age"), "{refusal}");
    assert!(alone.age_warning(&at).unwrap().contains("one of them is wrong"));
    // true sets weeks apart, and true sets of the same days, agree
    let true_ones = tracker(real.clone());
    assert!(true_ones.at(&Epoch::from_gregorian_utc_hms(2025, 6, 14, 12, 0, 0)).is_ok());
}

#[test]
fn an_orbit_that_has_decayed_is_refused_with_its_height_and_a_low_perigee_is_reported() {
    // 113 km up (n = 16.6 rev/d) with heavy drag; and an ellipse whose perigee is at 71 km
    let low1 = summed(&L1.replace(" 15816-3", " 50000-2"));
    let low2 = summed(&L2.replace("15.50064259", "16.60000000"));
    let low = read_text(&format!("{low1}\n{low2}\n")).unwrap();
    assert!((low[0].perigee_height_km() - 112.0).abs() < 3.0, "{}", low[0].perigee_height_km());
    let ellipse = summed(&L2.replace("0001632", "2000000").replace("15.50064259", "12.00000000"));
    let ellipse = read_text(&format!("{L1}\n{ellipse}\n")).unwrap();
    let later = |sets: &[Elements], hours: f64| {
        let epoch = sets[0].epoch() + Duration::from_hours(hours);
        tracker(sets.to_vec()).at(&epoch).map(|g| g.height_km).map_err(|e| e.to_string())
    };
    let refusals: Vec<String> = (1..200).filter_map(|h| later(&low, f64::from(h)).err()).collect();
    assert!(refusals.len() > 150, "{} hours of 199 refused", refusals.len());
    assert!(refusals[0].contains("decayed") && refusals[0].contains("elements"), "{}", refusals[0]);
    let heights: Vec<f64> = (0..300).filter_map(|k| later(&ellipse, f64::from(k) * 0.01).ok()).collect();
    assert!(heights.iter().all(|h| *h > 70.0) && heights.len() < 300, "the part below 100 km is refused");
    let message = tracker(ellipse.clone()).age_warning(&ellipse[0].epoch()).unwrap();
    assert!(message.contains("perigee") && message.contains("decays"), "{message}");
    // the ISS is neither
    let iss = read_text(&format!("{L1}\n{L2}\n")).unwrap();
    assert!(later(&iss, 24.0 * 13.0).is_ok() && tracker(iss.clone()).age_warning(&iss[0].epoch()).is_none());
}

#[test]
fn thousands_of_mutated_element_files_are_read_or_refused_and_never_end_the_program() {
    use rand::{Rng, SeedableRng};
    const SIGNS: &[u8] = b"0123456789-+.eE<>&;,=\"{}[]\n\t";
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(25_544);
    let mut originals: Vec<Vec<u8>> = FORMATS.iter().map(|(_, write)| write(&keys(&[])).into_bytes()).collect();
    originals.push(format!("ISS (ZARYA)\n{L1}\n{L2}\n").into_bytes());
    let (mut fine, mut refused) = (0, 0);
    for round in 0..6_000 {
        let mut bytes = originals[round % originals.len()].clone();
        for _ in 0..rng.random_range(1..4) {
            let at = rng.random_range(0..bytes.len());
            match rng.random_range(0..5) {
                0 => bytes[at] = rng.random(),
                1 => bytes[at] = SIGNS[rng.random_range(0..SIGNS.len())],
                2 => drop(bytes.remove(at)),
                3 => bytes.truncate(at.max(1)),
                _ => bytes.insert(at, b'9'),
            }
            if bytes.is_empty() {
                bytes.push(b' ');
            }
        }
        match read_bytes(&bytes) {
            Err(_) => refused += 1,
            Ok(sets) => {
                fine += 1;
                for set in sets {
                    let epoch = set.epoch() + Duration::from_hours(5.0);
                    let _ = Propagator::new(&set).map(|p| p.state(&epoch).is_ok());
                }
            }
        }
    }
    println!("{fine} read, {refused} refused");
    assert!(fine > 500 && refused > 500, "{fine} read, {refused} refused: the mutations test nothing");
}

#[test]
fn a_name_of_a_megabyte_is_no_name_and_one_of_a_line_is() {
    let named = |name: &str| read_text(&format!("{name}\n{L1}\n{L2}\n"));
    let error = named(&"N".repeat(1_000_000)).unwrap_err();
    assert!(error.contains("1000000 letters") && error.len() < 300, "{error}");
    assert_eq!(named(&"N".repeat(100)).unwrap()[0].name().len(), 100);
    assert_eq!(named("A\u{1b}[2J").unwrap()[0].name(), "A\\u001b[2J");
}
