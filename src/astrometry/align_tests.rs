//! Tests of `align`.

use super::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Points = Vec<(f64, f64)>;

/// What a synthetic field is made of.
struct Sky {
    common: usize,
    missing: usize,
    faked: usize,
    noise_px: f64,
    shift_px: f64,
    rotation_deg: f64,
    size: (f64, f64),
}

/// Predicted and detected positions, and which detection is which star.
fn field(sky: &Sky, seed: u64) -> (Points, Points, Vec<(usize, usize)>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let place = |rng: &mut ChaCha8Rng| (rng.random_range(0.0..sky.size.0), rng.random_range(0.0..sky.size.1));
    let n = sky.common + sky.missing;
    let predicted: Vec<(f64, f64)> = (0..n).map(|_| place(&mut rng)).collect();
    let (s, c) = sky.rotation_deg.to_radians().sin_cos();
    let angle = rng.random_range(0.0..std::f64::consts::TAU);
    let shift = (sky.shift_px * angle.cos(), sky.shift_px * angle.sin());
    let half = (sky.size.0 / 2.0, sky.size.1 / 2.0);
    // which stars are seen, and where fakes stand in the order of brightness, are mixed
    let mut kinds: Vec<Option<usize>> = (0..n).map(Some).collect();
    for i in (1..n).rev() {
        kinds.swap(i, rng.random_range(0..=i));
    }
    kinds.truncate(sky.common);
    kinds.extend(std::iter::repeat_n(None, sky.faked));
    for i in (1..kinds.len()).rev() {
        kinds.swap(i, rng.random_range(0..=i));
    }
    let mut truth = Vec::new();
    let mut detected = Vec::new();
    for kind in kinds {
        let Some(i) = kind else {
            detected.push(place(&mut rng));
            continue;
        };
        let (u, v) = (predicted[i].0 - half.0, predicted[i].1 - half.1);
        let mut noise = || sky.noise_px * rng.sample::<f64, _>(rand_distr::StandardNormal);
        truth.push((i, detected.len()));
        detected.push((half.0 + shift.0 + c * u - s * v + noise(), half.1 + shift.1 + s * u + c * v + noise()));
    }
    (predicted, detected, truth)
}

fn solved(sky: &Sky, seed: u64, match_radius: f64) -> (Option<Alignment>, usize) {
    let (p, d, truth) = field(sky, seed);
    let a = align(&p, &d, 300.0, match_radius);
    let right = a.as_ref().map_or(0, |a| a.pairs.iter().filter(|x| truth.contains(x)).count());
    (a, right)
}

const FULL: (f64, f64) = (9576.0, 6388.0);

#[test]
fn fields_turned_up_to_3_deg_and_shifted_up_to_200_px_are_matched_with_a_third_false_and_a_fifth_missing() {
    for (i, rotation_deg) in [0.0, 0.5, -1.0, 2.0, -3.0, 3.0].into_iter().enumerate() {
        for (j, shift_px) in [0.0, 40.0, 120.0, 200.0].into_iter().enumerate() {
            let sky = Sky { common: 40, missing: 10, faked: 17, noise_px: 0.3, shift_px, rotation_deg, size: FULL };
            let (a, right) = solved(&sky, (10 * i + j) as u64, 20.0);
            let a = a.unwrap_or_else(|| panic!("{rotation_deg} deg, {shift_px} px: no match"));
            assert!((a.rotation_rad.to_degrees() - rotation_deg).abs() < 0.01);
            assert!(right >= 36 && a.n - right <= 1, "{right} of 40 right, {} in all", a.n);
            assert!(a.rms_px < 0.8, "{}", a.rms_px); // 0.3 px in two axes, and one chance pair at most
        }
    }
}

#[test]
fn six_common_stars_among_sixty_predicted_and_forty_detected_are_enough() {
    for seed in 0..20 {
        let rotation_deg = [0.0, 1.0, -3.0, 3.0][seed as usize % 4];
        let sky = Sky { common: 6, missing: 54, faked: 34, noise_px: 0.3, shift_px: 150.0, rotation_deg, size: FULL };
        let (a, right) = solved(&sky, seed, 20.0);
        let a = a.unwrap_or_else(|| panic!("seed {seed}: no match"));
        assert!(right >= 5, "seed {seed}: {right} right of {}", a.n);
    }
}

#[test]
fn a_small_field_with_few_stars_and_a_good_header_is_matched() {
    for seed in 0..20 {
        let sky = Sky {
            common: 5,
            missing: 1,
            faked: 2,
            noise_px: 0.3,
            shift_px: 10.0,
            rotation_deg: 0.0,
            size: (600.0, 400.0),
        };
        let (a, right) = solved(&sky, seed, 6.0);
        assert!(a.is_some() && right >= 4, "seed {seed}: {right}");
    }
}

#[test]
fn a_wrong_field_is_refused() {
    let mut accepted = 0;
    for seed in 0..100 {
        let size = if seed % 2 == 0 { FULL } else { (800.0, 600.0) };
        let sky = Sky { common: 0, missing: 60, faked: 40, noise_px: 0.3, shift_px: 0.0, rotation_deg: 0.0, size };
        accepted += usize::from(solved(&sky, seed, if seed % 2 == 0 { 20.0 } else { 5.0 }).0.is_some());
    }
    assert_eq!(accepted, 0);
}

#[test]
fn two_stars_near_one_entry_and_two_entries_near_one_star_are_dropped() {
    let sky = Sky { common: 30, missing: 0, faked: 0, noise_px: 0.1, shift_px: 0.0, rotation_deg: 0.0, size: FULL };
    let (mut p, mut d, truth) = field(&sky, 3);
    let (i, j) = truth[0];
    d.push((d[j].0 + 3.0, d[j].1));
    let (k, _) = truth[1];
    p.push((p[k].0, p[k].1 + 3.0));
    let a = align(&p, &d, 300.0, 10.0).unwrap();
    assert!(a.pairs.iter().all(|x| x.0 != i && x.0 != k && x.0 != 30));
    assert_eq!(a.n, 28);
}

#[test]
fn nothing_to_match_is_none_and_broken_positions_are_passed_over() {
    assert!(align(&[], &[(1.0, 1.0)], 100.0, 5.0).is_none());
    assert!(align(&[(1.0, 1.0)], &[], 100.0, 5.0).is_none());
    assert!(align(&[(1.0, 1.0)], &[(1.0, 1.0)], 100.0, 5.0).is_none()); // one star proves nothing
    let sky = Sky { common: 30, missing: 0, faked: 0, noise_px: 0.1, shift_px: 5.0, rotation_deg: 0.0, size: FULL };
    let (mut p, mut d, _) = field(&sky, 4);
    p.insert(0, (f64::NAN, 1.0));
    d.insert(0, (f64::INFINITY, 1.0));
    let a = align(&p, &d, 300.0, 10.0).unwrap();
    assert_eq!(a.n, 30);
    assert!(a.pairs.iter().all(|(i, j)| *i > 0 && *j > 0)); // indices of the caller's lists
}
