//! Tests of the fit and of the parts of a wide search; the matching itself is tested in `tests/plate_*.rs`.

use super::fit::{Match, Model, fit, fit_best};
use super::*;
use crate::astrometry::catalogue::separation_deg;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const SIZE: (f64, f64) = (4000.0, 3000.0);
const CENTRE: (f64, f64) = (1999.5, 1499.5);

fn matches(truth: &Wcs, n: usize, noise_px: f64, seed: u64) -> Vec<Match> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, noise_px).unwrap();
    (0..n)
        .map(|_| {
            let (x, y) = (rng.random_range(0.0..SIZE.0), rng.random_range(0.0..SIZE.1));
            let at_px = (x + noise.sample(&mut rng), y + noise.sample(&mut rng));
            Match { sky_deg: truth.pixel_to_sky(x, y), at_px }
        })
        .collect()
}

fn distorted(mirrored: bool) -> Wcs {
    let s = 0.5 / 3600.0;
    let east = if mirrored { s } else { -s };
    let terms = [vec![(2, 0, 2e-7), (1, 1, -1e-7), (3, 0, 4e-11)], vec![(0, 2, 3e-7), (1, 2, -5e-11)]];
    Wcs::from_terms([359.9, 80.0], CENTRE, [[east * 0.8, east * 0.6], [-s * 0.6, s * 0.8]], terms).unwrap()
}

#[test]
fn exact_positions_give_back_the_system_they_were_made_with() {
    for (truth, model) in [
        (Wcs::tan(10.0, 89.99, CENTRE.0, CENTRE.1, 0.5, 77.0, false), Model::Similarity),
        (Wcs::tan(0.0, -30.0, CENTRE.0, CENTRE.1, 0.5, -120.0, true), Model::Similarity),
        (distorted(false), Model::Sip3),
        (distorted(true), Model::Sip3),
    ] {
        let found = fit(&matches(&truth, 60, 0.0, 1), SIZE, (355.0, 79.0), model);
        // a start 5 degrees away at the pole of another frame does not matter
        let found = found.or_else(|| fit(&matches(&truth, 60, 0.0, 1), SIZE, (0.0, -30.0), model)).unwrap();
        assert_eq!(found.wcs.mirrored(), truth.mirrored());
        assert!((found.wcs.rotation_deg() - truth.rotation_deg()).abs() < 1e-6);
        for (x, y) in [(0.0, 0.0), (3999.0, 0.0), (50.0, 2999.0), CENTRE] {
            let (a, b) = (found.wcs.pixel_to_sky(x, y), truth.pixel_to_sky(x, y));
            assert!(separation_deg(a.0, a.1, b.0, b.1) * 3600.0 < 1e-6, "{model:?} {x} {y}");
        }
    }
}

#[test]
fn rotation_is_read_back_for_any_angle_and_parity() {
    for mirrored in [false, true] {
        for deg in [-179.0, -90.0, -10.0, 0.0, 33.0, 90.0, 150.0] {
            let wcs = Wcs::tan(200.0, 40.0, 1.0, 2.0, 1.3, deg, mirrored);
            assert!((wcs.rotation_deg() - deg).abs() < 1e-9 && wcs.mirrored() == mirrored);
        }
    }
}

#[test]
fn a_plain_field_is_not_given_a_distortion_and_a_distorted_one_is() {
    let plain = Wcs::tan(200.0, 40.0, CENTRE.0, CENTRE.1, 0.5, 12.0, false);
    let richer = (0..200).filter(|seed| {
        fit_best(&matches(&plain, 40, 0.3, *seed), SIZE, (200.0, 40.0)).unwrap().model != Model::Similarity
    });
    // three tests at 1e-4 each: in 200 fields 0.06 are expected
    assert!(richer.count() <= 1);
    for seed in 0..20 {
        // the terms bend the corners by a pixel; noise is 0.1 px
        let best = fit_best(&matches(&distorted(false), 60, 0.1, seed), SIZE, (359.0, 79.5)).unwrap();
        assert!(best.model >= Model::Sip2, "{:?}", best.model);
        // rms of two coordinates, less the freedom of the fit
        assert!((best.rms_arcsec() / 0.5 - 0.1 * 2f64.sqrt()).abs() < 0.04, "{}", best.rms_arcsec());
    }
}

#[test]
fn more_terms_than_stars_are_never_fitted() {
    let truth = distorted(false);
    for n in 0..30 {
        let found = fit_best(&matches(&truth, n, 0.1, 3), SIZE, (359.0, 79.5));
        assert_eq!(found.is_some(), n >= 3);
        assert!(found.is_none_or(|f| 2 * n >= f.model.parameters() + 6 || f.model == Model::Similarity));
    }
    // all stars in one place determine nothing
    let same = vec![matches(&truth, 1, 0.0, 1)[0]; 9];
    assert!(fit_best(&same, SIZE, (359.0, 79.5)).is_none());
}

#[test]
fn a_solution_is_written_as_a_header_that_reads_back() {
    let wcs = distorted(true);
    let bytes = wcs.header_file((4000, 3000));
    assert_eq!(bytes.len() % 2880, 0);
    let text = String::from_utf8(bytes).unwrap();
    let lines: Vec<&str> = (0..text.len() / 80).map(|i| &text[80 * i..80 * i + 80]).collect();
    assert!(lines.iter().any(|l| l.trim_end() == "END"));
    let header = crate::fits::Header::from_text(&lines.join("\n"));
    let back = Wcs::from_keys(&|k| header.number(k), &|k| header.text(k)).unwrap().unwrap();
    assert_eq!(back.pixel_to_sky(3.0, 2950.0), wcs.pixel_to_sky(3.0, 2950.0));
}

#[test]
fn the_circles_of_a_wide_search_leave_no_gap() {
    let hint = Hint {
        ra_deg: 100.0,
        dec_deg: 40.0,
        radius_deg: 7.0,
        scale_arcsec: 1.0,
        scale_search_frac: 0.1,
        mirrored: None,
    };
    let tiles = tiles(&hint);
    let plane = Wcs::tan(100.0, 40.0, 0.0, 0.0, 3600.0, 0.0, true);
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..2000 {
        let (r, a) = (7.0 * rng.random::<f64>().sqrt(), rng.random_range(0.0..std::f64::consts::TAU));
        let (ra, dec) = plane.pixel_to_sky(r * a.cos(), r * a.sin());
        let covered = |t: &Hint| separation_deg(ra, dec, t.ra_deg, t.dec_deg) <= t.radius_deg;
        assert!(tiles.iter().any(covered), "{r} {a}");
    }
    assert_eq!((tiles[0].ra_deg, tiles[0].dec_deg), (100.0, 40.0));
}
