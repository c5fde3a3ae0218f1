//! Tests of `wcs`.

use super::*;
use std::collections::HashMap;

fn read(cards: &[(&str, f64)], ctype: [&str; 2]) -> Result<Option<Wcs>, String> {
    let numbers: HashMap<String, f64> = cards.iter().map(|(k, v)| ((*k).to_owned(), *v)).collect();
    Wcs::from_keys(&|k| numbers.get(k).copied(), &|k| match k {
        "CTYPE1" => Some(ctype[0].to_owned()),
        "CTYPE2" => Some(ctype[1].to_owned()),
        _ => None,
    })
}
const TAN: [&str; 2] = ["RA---TAN", "DEC--TAN"];
const PLACE: [(&str, f64); 4] = [("CRVAL1", 10.0), ("CRVAL2", -30.0), ("CRPIX1", 500.0), ("CRPIX2", 400.0)];

fn with(extra: &[(&'static str, f64)]) -> Vec<(&'static str, f64)> {
    PLACE.iter().copied().chain(extra.iter().copied()).collect()
}

#[test]
fn cd_pc_and_crota_describe_the_same_sky() {
    let (d, rot) = (0.25 / 3600.0, 20.0_f64.to_radians());
    let (s, c) = rot.sin_cos();
    let crota = read(&with(&[("CDELT1", -d), ("CDELT2", d), ("CROTA2", 20.0)]), TAN).unwrap().unwrap();
    let pc = [("CDELT1", -d), ("CDELT2", d), ("PC1_1", c), ("PC1_2", s), ("PC2_1", -s), ("PC2_2", c)];
    let pc = read(&with(&pc), TAN).unwrap().unwrap();
    let cd = [("CD1_1", -d * c), ("CD1_2", -d * s), ("CD2_1", -d * s), ("CD2_2", d * c)];
    let cd = read(&with(&cd), TAN).unwrap().unwrap();
    for w in [&pc, &cd] {
        let (a, b) = (crota.pixel_to_sky(0.0, 900.0), w.pixel_to_sky(0.0, 900.0));
        assert!((a.0 - b.0).abs() < 1e-12 && (a.1 - b.1).abs() < 1e-12); // rounding of two products
    }
    assert!((cd.scale_arcsec() - 0.25).abs() < 1e-12);
}

#[test]
fn the_constructed_system_puts_north_up_and_east_left_unless_mirrored() {
    for (mirrored, sign) in [(false, -1.0), (true, 1.0)] {
        let w = Wcs::tan(100.0, 60.0, 50.0, 70.0, 1.0, 0.0, mirrored);
        let north = w.sky_to_pixel(100.0, 60.0 + 10.0 / 3600.0).unwrap();
        let east = w.sky_to_pixel(100.0 + 10.0 / 3600.0 / 60.0_f64.to_radians().cos(), 60.0).unwrap();
        assert!((north.0 - 50.0).abs() < 1e-6 && (north.1 - 80.0).abs() < 1e-6);
        assert!((east.0 - 50.0 - sign * 10.0).abs() < 1e-3 && (east.1 - 70.0).abs() < 1e-3); // curvature of the parallel
    }
    let turned = Wcs::tan(100.0, 60.0, 0.0, 0.0, 1.0, 90.0, false).sky_to_pixel(100.0, 60.0 + 10.0 / 3600.0).unwrap();
    assert!((turned.0 + 10.0).abs() < 1e-6 && turned.1.abs() < 1e-6); // north went from +y to −x
}

#[test]
fn pixel_to_sky_and_back_returns_the_pixel_also_at_the_poles_and_across_zero_hours() {
    for dec in [-90.0, -89.999, -30.0, 0.0, 45.0, 90.0] {
        for ra in [0.0, 0.01, 180.0, 359.99] {
            let w = Wcs::tan(ra, dec, 4788.0, 3194.0, 0.194, 33.0, false);
            for (x, y) in [(0.0, 0.0), (9575.0, 10.0), (4788.0, 3194.0), (100.0, 6387.0)] {
                let (r, d) = w.pixel_to_sky(x, y);
                let (bx, by) = w.sky_to_pixel(r, d).unwrap();
                assert!((bx - x).hypot(by - y) < 1e-6, "{ra} {dec} {x} {y}: {bx} {by}");
            }
        }
    }
}

#[test]
fn a_point_behind_the_tangent_plane_has_no_pixel() {
    let w = Wcs::tan(10.0, 20.0, 0.0, 0.0, 1.0, 0.0, false);
    assert!(w.sky_to_pixel(190.0, -20.0).is_none());
    assert!(w.sky_to_pixel(10.0, 20.0 - 90.0).is_none());
    assert!(w.sky_to_pixel(f64::NAN, 0.0).is_none());
}

#[test]
fn the_cards_read_back_as_the_same_system() {
    let sip =
        [("CD1_1", -1e-4), ("CD2_2", 1e-4), ("A_ORDER", 3.0), ("A_3_0", 1e-10), ("B_ORDER", 2.0), ("B_1_1", 2e-7)];
    let w = read(&with(&sip), TAN).unwrap().unwrap();
    let cards = w.cards();
    let find = |k: &str| cards.iter().find(|c| c.0 == k).map(|c| c.1.clone());
    let back =
        Wcs::from_keys(&|k| find(k).and_then(|v| if let WcsValue::Real(r) = v { Some(r) } else { None }), &|k| {
            find(k).and_then(|v| if let WcsValue::Text(t) = v { Some(t) } else { None })
        })
        .unwrap()
        .unwrap();
    assert_eq!(w.pixel_to_sky(10.0, 20.0), back.pixel_to_sky(10.0, 20.0));
    assert!(cards.iter().any(|c| c.1 == WcsValue::Text("RA---TAN-SIP".into())));
}

#[test]
fn swapped_axes_are_read() {
    let cd = [("CD1_1", 0.0), ("CD1_2", 1e-4), ("CD2_1", -1e-4), ("CD2_2", 0.0)];
    let place = [("CRVAL1", -30.0), ("CRVAL2", 10.0), ("CRPIX1", 500.0), ("CRPIX2", 400.0)];
    let cards: Vec<_> = place.iter().chain(&cd).copied().collect();
    let w = read(&cards, ["DEC--TAN", "RA---TAN"]).unwrap().unwrap();
    let (ra, dec) = w.pixel_to_sky(499.0, 409.0); // ten pixels along y, which is the declination here
    assert!((ra - 10.0).abs() < 1e-12 && (dec + 30.0 - 1e-3).abs() < 1e-9);
}

#[test]
fn unusable_headers_name_the_keyword() {
    assert!(read(&[], ["", ""]).unwrap().is_none());
    assert!(read(&[], ["LINEAR", "LINEAR"]).unwrap().is_none());
    let cd = [("CD1_1", 1e-4), ("CD2_2", 1e-4)];
    let cases = [
        (with(&cd), ["RA---ZPN", "DEC--ZPN"], "CTYPE1"),
        (with(&cd), ["RA---TAN", "RA---TAN"], "CTYPE"),
        (with(&cd), ["GLON-TAN", "GLAT-TAN"], "CTYPE1"),
        (with(&[]), TAN, "CDELT1"),
        (cd.to_vec(), TAN, "CRVAL1"),
        (with(&[("CD1_1", 1e-4), ("CD1_2", 1e-4), ("CD2_1", 1e-4), ("CD2_2", 1e-4)]), TAN, "singular"),
        (with(&[("CD1_1", 1e-4), ("CD2_2", 1e-4), ("EQUINOX", 1950.0)]), TAN, "EQUINOX"),
        (with(&[("CD1_1", 1e-4), ("CD2_2", 1e-4), ("PV2_1", 1.0)]), TAN, "PV2_1"),
    ];
    for (cards, ctype, keyword) in cases {
        let message = read(&cards, ctype).unwrap_err();
        assert!(message.contains(keyword), "{message}");
    }
}

#[test]
fn a_folded_distortion_gives_no_pixel_instead_of_a_wrong_one() {
    let sip = [("CD1_1", -1e-4), ("CD2_2", 1e-4), ("A_ORDER", 2.0), ("A_2_0", -1e-3)];
    let w = read(&with(&sip), TAN).unwrap().unwrap();
    // u − 1e-3 u² never exceeds 250 px
    let far = Wcs { sip: [None, None], ..w.clone() }.pixel_to_sky(499.0 + 600.0, 399.0);
    assert!(w.sky_to_pixel(far.0, far.1).is_none());
    let near = Wcs { sip: [None, None], ..w.clone() }.pixel_to_sky(499.0 + 90.0, 399.0);
    let (x, _) = w.sky_to_pixel(near.0, near.1).unwrap();
    assert!((x - 599.0).abs() < 1e-6); // 100 − 1e-3·100² = 90
}
