//! World coordinates in every form satphot reads, against astropy; and those it refuses.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::HashMap;

use satphot::astrometry::wcs::Wcs;

/// Headers and places by astropy 8.0.2, written by scripts/make_wcs_vectors.py.
const VECTORS: &str = include_str!("../data/wcs_vectors.txt");

struct Case {
    name: String,
    cards: HashMap<String, String>,
    /// x, y (0-based), RA, Dec \[deg\].
    places: Vec<[f64; 4]>,
}

fn cases() -> Vec<Case> {
    let mut cases: Vec<Case> = Vec::new();
    for line in VECTORS.lines().filter(|l| !l.starts_with('#')) {
        if let Some(name) = line.strip_prefix("case ") {
            cases.push(Case { name: name.into(), cards: HashMap::new(), places: Vec::new() });
        } else if let Some(numbers) = line.strip_prefix("at ") {
            let v: Vec<f64> = numbers.split(' ').map(|n| n.parse().unwrap()).collect();
            cases.last_mut().unwrap().places.push([v[0], v[1], v[2], v[3]]);
        } else {
            let (key, value) = line.split_once(" = ").unwrap();
            cases.last_mut().unwrap().cards.insert(key.into(), value.trim_matches('\'').into());
        }
    }
    cases
}

fn read(cards: &HashMap<String, String>) -> Result<Option<Wcs>, String> {
    Wcs::from_keys(&|k| cards.get(k)?.parse().ok(), &|k| cards.get(k).cloned())
}

/// Distance on the sky \[arcsec\].
fn apart_arcsec(a: (f64, f64), b: (f64, f64)) -> f64 {
    let (d1, d2) = (a.1.to_radians(), b.1.to_radians());
    let dra = (a.0 - b.0).to_radians();
    let hav = ((d1 - d2) / 2.0).sin().powi(2) + d1.cos() * d2.cos() * (dra / 2.0).sin().powi(2);
    (2.0 * hav.sqrt().asin()).to_degrees() * 3_600.0
}

#[test]
fn every_form_gives_the_places_of_astropy_and_the_pixels_back() {
    let cases = cases();
    assert!(cases.len() >= 21);
    let (mut worst_arcsec, mut worst_px) = (0.0_f64, 0.0_f64);
    for case in &cases {
        let wcs = read(&case.cards).unwrap_or_else(|e| panic!("{}: {e}", case.name)).unwrap();
        assert_eq!(case.places.len(), 6);
        for [x, y, ra, dec] in &case.places {
            let off = apart_arcsec(wcs.pixel_to_sky(*x, *y), (*ra, *dec));
            // 12 decimals of a degree are 4e-9 arcsec; Newton's inverse and the plane cost a little more
            assert!(off < 1e-7, "{}: at {x} {y} off by {off} arcsec", case.name);
            let (bx, by) = wcs.sky_to_pixel(*ra, *dec).unwrap_or_else(|| panic!("{}: no pixel", case.name));
            let off_px = (bx - x).hypot(by - y);
            assert!(off_px < 1e-6, "{}: at {x} {y} back by {off_px} px", case.name);
            worst_arcsec = worst_arcsec.max(off);
            worst_px = worst_px.max(off_px);
        }
    }
    println!("{} forms: worst {worst_arcsec:.1e} arcsec, {worst_px:.1e} px", cases.len());
}

#[test]
fn leaving_out_a_distortion_or_the_pole_would_be_noticed() {
    for (name, prefix) in [("TPV", "PV"), ("TAN-SIP", "A_"), ("LONPOLE 90", "LONPOLE"), ("CDELT and CROTA2", "CROTA")] {
        let case = cases().into_iter().find(|c| c.name == name).unwrap();
        let mut cards = case.cards.clone();
        cards.retain(|k, _| !k.starts_with(prefix));
        let wcs = read(&cards).unwrap().unwrap();
        let worst = case
            .places
            .iter()
            .map(|[x, y, ra, dec]| apart_arcsec(wcs.pixel_to_sky(*x, *y), (*ra, *dec)))
            .fold(0.0, f64::max);
        assert!(worst > 0.1, "{name}: {worst} arcsec");
    }
}

#[test]
fn tpv_without_terms_is_the_plain_plane() {
    // astropy takes the absent PVi_1 for 0 and puts every pixel on CRVAL: no reading anyone could mean
    let case = cases().into_iter().find(|c| c.name == "CD").unwrap();
    let mut cards = case.cards.clone();
    cards.extend([("CTYPE1", "RA---TPV"), ("CTYPE2", "DEC--TPV")].map(|(k, v)| (k.to_string(), v.to_string())));
    let wcs = read(&cards).unwrap().unwrap();
    let [x, y, ra, dec] = case.places[0];
    assert!(apart_arcsec(wcs.pixel_to_sky(x, y), (ra, dec)) < 1e-7);
}

#[test]
fn pixinsights_zeros_for_the_native_place_are_the_pole_of_the_projection() {
    let case = cases().into_iter().find(|c| c.name == "CD").unwrap();
    let mut cards = case.cards.clone();
    cards.extend([("PV1_1".to_string(), "0".to_string()), ("PV1_2".to_string(), "0".to_string())]);
    let wcs = read(&cards).unwrap().unwrap();
    let [x, y, ra, dec] = case.places[0];
    assert!(apart_arcsec(wcs.pixel_to_sky(x, y), (ra, dec)) < 1e-7);
}

#[test]
fn what_would_be_half_used_is_refused_by_keyword_with_the_remedy() {
    let base = cases().into_iter().find(|c| c.name == "CD").unwrap().cards;
    let with = |extra: &[(&str, &str)]| {
        let mut cards = base.clone();
        cards.extend(extra.iter().map(|(k, v)| ((*k).to_string(), (*v).to_string())));
        read(&cards).err().unwrap_or_else(|| panic!("{extra:?} is accepted"))
    };
    for (extra, words) in [
        (vec![("CTYPE1", "RA---ZPN"), ("CTYPE2", "DEC--ZPN")], "only RA and Dec in TAN"),
        (vec![("CTYPE1", "RA---TNX"), ("CTYPE2", "DEC--TNX")], "CTYPE1"),
        (vec![("CTYPE1", "RA---TPV")], "one axis is TPV"),
        (vec![("PV2_1", "0.9996")], "PV2_1"),
        (vec![("PV1_7", "0.1")], "PV1_7"),
        (vec![("CTYPE1", "RA---TPV"), ("CTYPE2", "DEC--TPV"), ("PV1_4", "0.1")], "PV1_1 is missing"),
        (vec![("CTYPE1", "RA---TPV"), ("CTYPE2", "DEC--TPV"), ("A_ORDER", "2")], "two distortions"),
        (vec![("PV1_1", "10"), ("PV1_2", "80")], "off its own pole"),
        (vec![("CUNIT1", "rad")], "CUNIT1"),
        (vec![("RADESYS", "FK4")], "FK4"),
        (vec![("EQUINOX", "1950.0")], "EQUINOX"),
    ] {
        let message = with(&extra);
        assert!(message.contains(words), "{extra:?}: {message}");
    }
    let mut crota = base.clone();
    crota.retain(|k, _| !k.starts_with("CD"));
    crota.extend(
        [("CDELT1", "-2e-4"), ("CDELT2", "2e-4"), ("CROTA1", "20")].map(|(k, v)| (k.to_string(), v.to_string())),
    );
    assert!(read(&crota).unwrap_err().contains("CROTA1"));
}
