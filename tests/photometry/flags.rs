//! What taints a flux: NaN, masks, edges, no annulus. Where peers disagree, our answer is pinned here.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene;

use ndarray::Array2;
use photometry_scene::{Scene, frame};
use satphot::frames::{Electrons, Frame, mask};
use satphot::photometry::Flags;
use satphot::photometry::aperture::Shape;
use satphot::photometry::background::background;
use satphot::photometry::flux::{Flux, measure};

/// A noiseless star of 10 000 e⁻ on a sky of 100 e⁻ at the centre of 81 × 81 pixels.
fn star() -> Frame<Electrons> {
    let mut scene = Scene::new(81, 81, 100.0);
    scene.star(40.0, 40.0, 10_000.0, 4.0);
    frame(scene.mean.mapv(|v| v as f32), 2.0)
}

fn at(frame: &Frame<Electrons>, x: f64, y: f64) -> Flux {
    let sky = background(&star(), 40, 3.0).unwrap();
    measure(frame, &sky, x, y, Shape::Circle { r_px: 8.0 }, 12.0, 20.0, 3.0)
}

#[test]
fn a_clean_star_has_no_flag() {
    let got = at(&star(), 40.0, 40.0);
    assert_eq!(got.flags, Flags::default(), "{}", got.flags);
    assert!((got.flux_e - 10_000.0).abs() < 1.0); // e⁻; 1.5e-5 of the light is outside 2 FWHM
}

#[test]
fn a_nan_pixel_is_filled_and_flagged_and_never_makes_a_nan() {
    let mut f = star();
    f.pixels[[46, 40]] = f32::NAN; // not even masked
    let got = at(&f, 40.0, 40.0);
    assert_eq!(got.flags, Flags::MASKED);
    // one of 201 px, in the faint part: filled with the mean of the others
    assert!((got.flux_e / 10_000.0 - 1.0).abs() < 0.01, "{}", got.flux_e);
    assert!(got.flux_err_e > at(&star(), 40.0, 40.0).flux_err_e);
}

#[test]
fn a_masked_pixel_in_the_core_is_filled_from_its_neighbours_within_the_error_it_adds() {
    for (fwhm_px, worst_frac, least_share) in [(2.5, 0.05, 0.10), (4.0, 0.004, 0.04), (8.0, 0.0005, 0.01)] {
        let mut scene = Scene::new(81, 81, 100.0);
        scene.star(40.3, 39.8, 10_000.0, fwhm_px);
        let whole = frame(scene.mean.mapv(|v| v as f32), 2.0);
        let clean = at(&whole, 40.3, 39.8);
        assert_eq!(clean.masked_frac, 0.0);
        for (j, i) in [(40, 40), (39, 40), (40, 41), (38, 39), (42, 40), (40, 43)] {
            let mut f = whole.clone();
            f.mask[[j, i]] = mask::BAD;
            f.pixels[[j, i]] = 50_000.0;
            let got = at(&f, 40.3, 39.8);
            let off = (got.flux_e - clean.flux_e).abs();
            let added = (got.flux_err_e.powi(2) - clean.flux_err_e.powi(2)).max(0.0).sqrt();
            assert!(off < worst_frac * clean.flux_e, "FWHM {fwhm_px}, ({i}, {j}): {off}");
            assert!(off < 2.0 * added + 1e-4 * clean.flux_e, "FWHM {fwhm_px}, ({i}, {j}): off {off}, error {added}");
            assert!(got.flags.has(Flags::MASKED));
        }
        let mut f = whole.clone();
        f.mask[[40, 40]] = mask::BAD;
        let share = at(&f, 40.3, 39.8).masked_frac;
        assert!(share > least_share && share < 4.0 * least_share, "FWHM {fwhm_px}: {share}");
        // with a bad neighbour nothing but the share of the area is known
        f.mask[[40, 41]] = mask::BAD;
        let area = Shape::Circle { r_px: 8.0 }.area_px();
        assert!((at(&f, 40.3, 39.8).masked_frac - 2.0 / area).abs() < 1e-9);
    }
}

#[test]
fn a_masked_value_has_no_influence() {
    let mut f = star();
    f.mask[[45, 40]] = mask::BAD;
    let before = at(&f, 40.0, 40.0);
    f.pixels[[45, 40]] = 1e9;
    assert_eq!(at(&f, 40.0, 40.0), before);
    assert_eq!(before.flags, Flags::MASKED);
}

#[test]
fn filling_a_flat_field_is_exact() {
    let mut f = frame(Array2::from_elem((81, 81), 100.0), 2.0);
    for (j, i) in [(40, 40), (41, 40), (44, 37), (33, 40)] {
        f.mask[[j, i]] = mask::BAD;
        f.pixels[[j, i]] = f32::NAN;
    }
    let got = at(&f, 40.0, 40.0);
    assert!(got.flux_e.abs() < 1e-9 && got.flags.has(Flags::MASKED), "{got:?}");
}

#[test]
fn an_aperture_with_no_good_pixel_is_nan_and_says_why() {
    let mut f = star();
    for ((j, i), m) in f.mask.indexed_iter_mut() {
        if (i as f64 - 40.0).hypot(j as f64 - 40.0) < 10.0 {
            *m = mask::BAD;
        }
    }
    let got = at(&f, 40.0, 40.0);
    assert!(got.flux_e.is_nan() && got.flux_err_e.is_nan() && got.snr.is_nan() && got.peak_e.is_nan());
    assert!(got.flags.has(Flags::MASKED));
    assert!((got.sky_e_px - 100.0).abs() < 1e-3);
}

#[test]
fn off_the_frame_and_nan_positions_are_nan_with_the_edge_flag() {
    for (x, y) in [(-100.0, 40.0), (f64::NAN, 40.0), (40.0, f64::INFINITY), (1e300, 40.0)] {
        let got = at(&star(), x, y);
        assert!(got.flux_e.is_nan() && got.flags.has(Flags::EDGE | Flags::NO_ANNULUS), "{x} {y}: {got:?}");
    }
}

#[test]
fn over_the_edge_only_the_part_on_the_frame_is_summed() {
    let got = at(&star(), 3.0, 40.0);
    assert!(got.flags.has(Flags::EDGE));
    assert!(got.area_px < Shape::Circle { r_px: 8.0 }.area_px());
    assert!(got.flux_e.abs() < 0.1);
    // an aperture that just touches the outermost pixel's edge is not over it
    assert!(!at(&star(), 7.5, 40.0).flags.has(Flags::EDGE));
    assert!(at(&star(), 7.49, 40.0).flags.has(Flags::EDGE));
}

#[test]
fn a_saturated_pixel_is_flagged_in_the_aperture_and_excluded_from_the_sky() {
    let mut f = star();
    f.mask[[40, 41]] = mask::SATURATED;
    let got = at(&f, 40.0, 40.0);
    assert_eq!((got.flags, got.flux_e), (Flags::SATURATED, at(&star(), 40.0, 40.0).flux_e));
    let mut f = star();
    f.mask[[40, 56]] = mask::SATURATED;
    f.pixels[[40, 56]] = 65_000.0;
    assert_eq!(at(&f, 40.0, 40.0).flags, Flags::default());
}

#[test]
fn the_clip_circle_is_flagged_in_the_aperture_and_in_the_annulus() {
    let mut f = star();
    for j in 0..81 {
        for i in 55..81 {
            f.mask[[j, i]] = mask::CLIPPED;
            f.pixels[[j, i]] = 0.0;
        }
    }
    let got = at(&f, 40.0, 40.0);
    assert_eq!(got.flags, Flags::CLIP_EDGE);
    assert!((got.sky_e_px - 100.0).abs() < 1e-3);
    assert!(at(&f, 50.0, 40.0).flags.has(Flags::CLIP_EDGE | Flags::MASKED));
}

#[test]
fn without_an_annulus_the_mesh_gives_the_sky() {
    let mut f = star();
    for ((j, i), m) in f.mask.indexed_iter_mut() {
        if (i as f64 - 40.0).hypot(j as f64 - 40.0) > 11.0 {
            *m = mask::BAD;
        }
    }
    let got = at(&f, 40.0, 40.0);
    assert_eq!((got.flags, got.n_sky), (Flags::NO_ANNULUS, 0));
    assert!((got.flux_e - 10_000.0).abs() < 20.0, "{}", got.flux_e); // the mesh sees a little of the star
    assert!(got.flux_err_e.is_finite());
}

#[test]
fn a_negative_flux_is_kept_and_flagged() {
    let mut f = frame(Array2::from_elem((81, 81), 100.0), 2.0);
    f.pixels[[40, 40]] = 60.0;
    let got = at(&f, 40.0, 40.0);
    assert!((got.flux_e + 40.0).abs() < 1e-6 && got.flags == Flags::NEGATIVE && got.flux_err_e > 0.0);
}

#[test]
fn a_sky_of_a_billion_electrons_keeps_its_digits() {
    // physics.md: sky 1e9 e⁻, tiny target; f32 holds 64 e⁻ steps there, so the target is a multiple
    let mut f = frame(Array2::from_elem((81, 81), 1e9), 2.0);
    f.pixels[[40, 40]] += 6400.0;
    let got = at(&f, 40.0, 40.0);
    assert!((got.flux_e - 6400.0).abs() < 1e-6, "{}", got.flux_e);
    assert!((got.flux_err_e.powi(2) / (201.06 * 1e9) - 1.0).abs() < 1e-3);
}

#[test]
fn one_bad_star_does_not_spoil_the_next() {
    let mut f = star();
    f.pixels.row_mut(2).fill(f32::NAN);
    assert_eq!(at(&f, 40.0, 40.0), at(&star(), 40.0, 40.0));
}

#[test]
fn positions_are_of_the_full_frame() {
    let whole = star();
    let mut part = star();
    part.origin_px = (3000, 500);
    let sky = background(&part, 40, 3.0).unwrap();
    let got = measure(&part, &sky, 3040.0, 540.0, Shape::Circle { r_px: 8.0 }, 12.0, 20.0, 3.0);
    assert_eq!(got, at(&whole, 40.0, 40.0));
}
