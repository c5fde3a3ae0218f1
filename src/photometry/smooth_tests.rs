//! The filter against Σ k k · pixels written plainly.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::*;

#[test]
fn a_filtered_image_is_the_sum_over_both_axes_with_nothing_outside() {
    let mut rng = ChaCha12Rng::seed_from_u64(2);
    for (ny, nx, fwhm) in [(1, 1, 1.0), (3, 200, 2.5), (70, 63, 4.0), (64, 64, 10.0), (90, 129, 20.0), (5, 65, 60.0)] {
        let image = Array2::from_shape_fn((ny, nx), |_| rng.random_range(-1.0..1.0f32));
        let kernel = Kernel::gaussian(fwhm);
        let (taps, r) = (kernel.taps(), kernel.radius() as i64);
        let got = smooth_image(&image, &kernel);
        for ((j, i), v) in got.indexed_iter().step_by(7) {
            let mut want = 0.0;
            for (a, k) in (j as i64 - r..).zip(taps) {
                for (b, q) in (i as i64 - r..).zip(taps) {
                    if (0..ny as i64).contains(&a) && (0..nx as i64).contains(&b) {
                        want += f64::from(*k) * f64::from(*q) * f64::from(image[[a as usize, b as usize]]);
                    }
                }
            }
            // f32 sums of a few hundred terms below 1
            assert!((f64::from(*v) - want).abs() < 1e-6, "{ny}x{nx} FWHM {fwhm} at {j} {i}: {v} {want}");
        }
    }
}

#[test]
fn noise_is_scaled_by_the_noise_factor_and_a_flat_image_stays_flat_inside() {
    let kernel = Kernel::gaussian(10.0);
    let mut rng = ChaCha12Rng::seed_from_u64(3);
    let image = Array2::from_shape_fn((400, 400), |_| rng.random_range(-1.0..1.0f32));
    let inside = smooth_image(&image, &kernel).slice(ndarray::s![13..387, 13..387]).mapv(f64::from);
    let sd = (inside.mapv(|v| v * v).sum() / inside.len() as f64).sqrt();
    let want = kernel.noise_factor() / 3f64.sqrt();
    // about 1500 independent cells: 2 %
    assert!((sd / want - 1.0).abs() < 0.08, "{sd} {want}");
    let flat = smooth_image(&Array2::from_elem((60, 60), 7.0), &kernel);
    assert!((flat[[30, 30]] - 7.0).abs() < 1e-5);
}

#[test]
fn a_peak_is_the_highest_of_its_group() {
    let mut rng = ChaCha12Rng::seed_from_u64(5);
    let row: Vec<f32> = (0..3 * BLOCK).map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut peaks = vec![0f32; row.len() / GROUP];
    group_peaks(&row, &mut peaks);
    for (group, peak) in row.chunks(GROUP).zip(&peaks) {
        assert_eq!(group.iter().copied().fold(f32::MIN, f32::max), *peak);
    }
}
