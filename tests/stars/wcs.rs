//! The tangent plane with SIP against astropy: the header of a real frame whose CTYPE forgets `-SIP`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::HashMap;

use satphot::astrometry::wcs::Wcs;

const VECTORS: &str = include_str!("../data/wcs_sip_vectors.csv");

/// The header numbers of the vector file's comment lines.
fn header(text: &str) -> HashMap<String, f64> {
    let pair =
        |l: &str| l.strip_prefix("# ")?.split_once(" = ").and_then(|(k, v)| Some((k.to_owned(), v.parse().ok()?)));
    text.lines().filter_map(pair).collect()
}

fn wcs(numbers: &HashMap<String, f64>) -> Wcs {
    let text = |k: &str| match k {
        "CTYPE1" => Some("RA---TAN".to_owned()),
        "CTYPE2" => Some("DEC--TAN".to_owned()),
        _ => None,
    };
    Wcs::from_keys(&|k| numbers.get(k).copied(), &text).unwrap().unwrap()
}

fn rows(text: &str) -> Vec<[f64; 4]> {
    let numbers = |l: &str| l.split(',').map(|v| v.parse().ok()).collect::<Option<Vec<f64>>>();
    text.lines().filter(|l| !l.starts_with('#')).filter_map(numbers).map(|v| [v[0], v[1], v[2], v[3]]).collect()
}

#[test]
fn sip_terms_are_applied_without_the_suffix_and_agree_with_astropy_to_a_millionth_of_a_pixel() {
    let w = wcs(&header(VECTORS));
    let rows = rows(VECTORS);
    assert!(rows.len() >= 30);
    for [x, y, ra, dec] in rows {
        let (r, d) = w.pixel_to_sky(x, y);
        // 1e-6 px of 1.26 arcsec = 3.5e-10 deg
        let east = (r - ra + 180.0).rem_euclid(360.0) - 180.0;
        assert!((east * dec.to_radians().cos()).hypot(d - dec) < 3.5e-10, "{x} {y}: {r} {d}, want {ra} {dec}");
        let (bx, by) = w.sky_to_pixel(ra, dec).unwrap();
        assert!((bx - x).hypot(by - y) < 1e-6, "{x} {y}: {bx} {by}");
    }
}

#[test]
fn leaving_out_the_sip_terms_would_be_noticed() {
    let mut numbers = header(VECTORS);
    numbers.retain(|k, _| !k.starts_with("A_") && !k.starts_with("B_"));
    let w = wcs(&numbers);
    let worst = rows(VECTORS).into_iter().map(|[x, y, ra, dec]| {
        let (bx, by) = w.sky_to_pixel(ra, dec).unwrap();
        (bx - x).hypot(by - y)
    });
    assert!(worst.fold(0.0, f64::max) > 0.05);
}
