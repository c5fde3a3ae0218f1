//! SGP4 against the verification set of Vallado et al. 2006 (AIAA 2006-6753).

#![allow(clippy::unwrap_used, missing_docs)] // helpers of tests

use std::collections::BTreeMap;

use satphot::orbit::{Elements, Propagator};

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared");

/// Sets that are not propagated, with what the refusal says.
const REFUSED: [(u64, &str); 4] = [
    (11801, "Parsing an integer field failed"), // blank element number
    (33333, "checksum is '4', expected 2"),
    (33334, "checksum is '9', expected 6"),
    (33335, "checksum is '0', expected 3"),
];
/// Sets that are propagated but not to the common tolerance \[km\]: Lyddane's choice at low inclination.
const LOOSE: [(u64, f64); 1] = [(23599, 1.0)];
/// Rows at which the satellite is inside the Earth: refused here, given by the reference.
const DECAYED: [(u64, usize); 0] = [];
/// Near-Earth orbits (period below 225 min) \[km\]: the reference prints 1e-8 km.
const NEAR_EARTH_KM: f64 = 1e-6;
/// Deep-space orbits \[km\]: the epoch enters through the sidereal time, and is kept to 1 ns.
const DEEP_SPACE_KM: f64 = 1e-5;

/// One set: its lines and where propagation starts, stops and steps.
fn sets(text: &str) -> Vec<(String, String)> {
    let lines: Vec<&str> = text.lines().filter(|l| l.starts_with("1 ") || l.starts_with("2 ")).collect();
    lines.chunks(2).map(|w| (w[0][..69.min(w[0].len())].to_owned(), w[1][..69].to_owned())).collect()
}

/// Blocks of (number, rows of minutes and position) in file order.
fn reference(text: &str) -> Vec<(u64, Vec<[f64; 7]>)> {
    let mut blocks: Vec<(u64, Vec<[f64; 7]>)> = Vec::new();
    for line in text.lines() {
        if let Some(number) = line.trim().strip_suffix(" xx") {
            blocks.push((number.trim().parse().unwrap(), Vec::new()));
        } else if let Some((_, rows)) = blocks.last_mut() {
            let v: Vec<f64> = line.split_whitespace().take(7).map(|w| w.parse().unwrap()).collect();
            rows.push(v.try_into().unwrap());
        }
    }
    blocks
}

#[test]
fn every_set_of_the_verification_file_matches_or_is_listed_with_its_reason() {
    let read = |name: &str| std::fs::read_to_string(format!("{SHARED}/data/orbits/{name}"));
    let (Ok(tle), Ok(out)) = (read("SGP4-VER.TLE"), read("tcppver.out")) else {
        println!("skipped: ../shared/data/orbits not present");
        return;
    };
    let (sets, blocks) = (sets(&tle), reference(&out));
    assert_eq!(sets.len(), blocks.len());
    let (mut refused, mut decayed, mut near_sets, mut near_worst_km) = (BTreeMap::new(), BTreeMap::new(), 0, 0.0_f64);
    let mut points = 0;
    for ((line1, line2), (number, rows)) in sets.iter().zip(&blocks) {
        let elements = match Elements::from_tle("", line1, line2) {
            Ok(elements) => elements,
            Err(e) => {
                refused.insert(*number, e.to_string());
                continue;
            }
        };
        assert_eq!(elements.norad_cat_id(), *number);
        let propagator = Propagator::new(&elements).unwrap();
        let (mut worst_km, mut worst_km_s) = (0.0_f64, 0.0_f64);
        for [minutes, x, y, z, vx, vy, vz] in rows {
            match propagator.state_after(*minutes) {
                Ok((r, v)) => {
                    points += 1;
                    worst_km = worst_km.max((r.x() - x).abs()).max((r.y() - y).abs()).max((r.z() - z).abs());
                    worst_km_s = worst_km_s.max((v.x() - vx).abs()).max((v.y() - vy).abs()).max((v.z() - vz).abs());
                }
                Err(e) => {
                    assert!(e.to_string().contains("decayed"), "{number} at {minutes} min: {e}");
                    *decayed.entry(*number).or_insert(0_usize) += 1;
                }
            }
        }
        let near = elements.period_min() < 225.0;
        if near {
            (near_sets, near_worst_km) = (near_sets + 1, near_worst_km.max(worst_km));
        }
        let loose = LOOSE.iter().find(|l| l.0 == *number);
        let tolerance_km = loose.map_or(if near { NEAR_EARTH_KM } else { DEEP_SPACE_KM }, |l| l.1);
        println!("{number:6} {} {worst_km:.1e} km {worst_km_s:.1e} km/s", if near { "near" } else { "deep" });
        assert!(worst_km < tolerance_km, "{number}: {worst_km} km");
        assert!(loose.is_some() || worst_km_s < 1e-8, "{number}: {worst_km_s} km/s"); // the reference prints 1e-9
        // A set that is listed as loose must still need it, and says so to the user.
        assert!(loose.is_none() || (worst_km > DEEP_SPACE_KM && propagator.caveat().is_some()), "{number}");
    }
    println!("{points} states; {near_sets} near-Earth sets, worst {near_worst_km:.1e} km; refused {refused:#?}");
    assert!(near_sets >= 8 && points >= 583);
    assert_eq!(refused.len(), REFUSED.len(), "{refused:?}");
    for (number, reason) in REFUSED {
        assert!(refused[&number].contains(reason), "{number}: {}", refused[&number]);
    }
    assert_eq!(decayed, BTreeMap::from(DECAYED));
}

#[test]
fn a_satellite_below_the_ground_is_called_decayed_and_not_given_a_place() {
    let elements = Elements::from_tle(
        "ISS (ZARYA)",
        "1 25544U 98067A   25159.07052714  .00008601  00000+0  15816-3 0  9996",
        "2 25544  51.6400 352.2516 0001632 195.4618 310.3088 15.50064259513748",
    )
    .unwrap();
    let message = Propagator::new(&elements).unwrap().state_after(5_000.0 * 1_440.0).unwrap_err().to_string();
    assert!(message.contains("decayed") && message.contains("ISS"), "{message}");
    assert!(Propagator::new(&elements).unwrap().state_after(f64::NAN).is_err());
}
