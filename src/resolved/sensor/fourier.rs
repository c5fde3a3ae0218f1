//! Convolution in two dimensions by fast Fourier transforms: padded so that nothing wraps, two real pictures at a time.
//!
//! Pictures are `[y, x]`, any unit. It does not cover what is not needed here: kernels that change over the picture.

use ndarray::{Array2, Axis, s};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

/// Forward or backward transform of every row and every column, in place; backward is not divided by the size.
fn transform(field: &mut Array2<Complex64>, inverse: bool) {
    let mut planner = FftPlanner::new();
    for axis in [Axis(1), Axis(0)] {
        let n = field.len_of(axis);
        let fft = if inverse { planner.plan_fft_inverse(n) } else { planner.plan_fft_forward(n) };
        let mut line = vec![Complex64::default(); n];
        let mut scratch = vec![Complex64::default(); fft.get_inplace_scratch_len()];
        for mut lane in field.lanes_mut(axis) {
            line.iter_mut().zip(lane.iter()).for_each(|(a, b)| *a = *b);
            fft.process_with_scratch(&mut line, &mut scratch);
            lane.iter_mut().zip(&line).for_each(|(a, b)| *a = *b);
        }
    }
}

/// The smallest size from `n` up that is a product of 2, 3 and 5.
pub(super) fn good_size(n: usize) -> usize {
    let smooth = |mut m: usize| {
        for p in [2, 3, 5] {
            while m.is_multiple_of(p) {
                m /= p;
            }
        }
        m == 1
    };
    (n.max(1)..).find(|m| smooth(*m)).unwrap_or(n)
}

/// Values of a point spread function on a grid of n by n, its middle at `[n/2, n/2]`: the inverse transform of
/// `transfer`, which is evaluated at k/n cycles per grid step, k from −n/2.
///
/// The values sum to the transfer at 0. What spreads beyond the grid is folded back into it.
pub(super) fn spread(n: usize, transfer: impl Fn(f64, f64) -> f64) -> Array2<f64> {
    let half = n / 2;
    let signed = |k: usize| if k <= (n - 1) / 2 { k as f64 } else { k as f64 - n as f64 };
    let mut field = Array2::from_shape_fn((n, n), |(j, i)| {
        Complex64::new(transfer(signed(i) / n as f64, signed(j) / n as f64), 0.0)
    });
    transform(&mut field, true);
    let scale = 1.0 / (n * n) as f64;
    Array2::from_shape_fn((n, n), |(j, i)| field[[(j + n - half) % n, (i + n - half) % n]].re * scale)
}

/// Each picture convolved with the kernel, in full: `(ny + ky − 1, nx + kx − 1)`. The sum of a result is the product of
/// the sums, to rounding. All pictures have one shape.
pub(super) fn convolve(pictures: &[&Array2<f64>], kernel: &Array2<f64>) -> Vec<Array2<f64>> {
    let Some((ny, nx)) = pictures.first().map(|p| p.dim()) else { return Vec::new() };
    let (ky, kx) = kernel.dim();
    let (full_y, full_x) = (ny + ky - 1, nx + kx - 1);
    let size = (good_size(full_y), good_size(full_x));
    let mut filter = Array2::from_elem(size, Complex64::default());
    filter.slice_mut(s![..ky, ..kx]).assign(&kernel.mapv(|v| Complex64::new(v, 0.0)));
    transform(&mut filter, false);
    let scale = 1.0 / (size.0 * size.1) as f64;
    let mut out = Vec::with_capacity(pictures.len());
    for pair in pictures.chunks(2) {
        // a real kernel keeps real and imaginary part apart
        let mut field = Array2::from_elem(size, Complex64::default());
        for ((j, i), value) in pair[0].indexed_iter() {
            field[[j, i]] = Complex64::new(*value, pair.get(1).map_or(0.0, |second| second[[j, i]]));
        }
        transform(&mut field, false);
        field.zip_mut_with(&filter, |a, b| *a *= *b);
        transform(&mut field, true);
        let cut = field.slice(s![..full_y, ..full_x]);
        out.push(cut.mapv(|c| c.re * scale));
        if pair.len() == 2 {
            out.push(cut.mapv(|c| c.im * scale));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(ny: usize, nx: usize, seed: f64) -> Array2<f64> {
        Array2::from_shape_fn((ny, nx), |(j, i)| (seed + 1.7 * j as f64 + 0.9 * (i * i) as f64).sin().abs())
    }

    #[test]
    fn a_convolution_is_the_sum_over_all_pairs_and_nothing_wraps() {
        let (a, b, kernel) = (picture(9, 13, 0.3), picture(9, 13, 2.0), picture(6, 4, 1.0));
        let got = convolve(&[&a, &b, &a], &kernel);
        assert_eq!(got.len(), 3);
        for (picture, got) in [(&a, &got[0]), (&b, &got[1]), (&a, &got[2])] {
            assert_eq!(got.dim(), (14, 16));
            let direct = |j: usize, i: usize| {
                kernel
                    .indexed_iter()
                    .filter(|((v, u), _)| j >= *v && i >= *u && j - v < 9 && i - u < 13)
                    .map(|((v, u), k)| k * picture[[j - v, i - u]])
                    .sum::<f64>()
            };
            for ((j, i), value) in got.indexed_iter() {
                assert!((value - direct(j, i)).abs() < 1e-12, "{j} {i}");
            }
        }
    }

    #[test]
    fn a_gaussian_transfer_spreads_a_gaussian_of_sum_one_about_the_middle() {
        let sigma = 2.3f64;
        for n in [48, 49] {
            let psf = spread(n, |fx, fy| (-2.0 * (std::f64::consts::PI * sigma).powi(2) * (fx * fx + fy * fy)).exp());
            assert!((psf.sum() - 1.0).abs() < 1e-13);
            for ((j, i), value) in psf.indexed_iter() {
                let r2 = (j as f64 - (n / 2) as f64).powi(2) + (i as f64 - (n / 2) as f64).powi(2);
                let expected = (-0.5 * r2 / (sigma * sigma)).exp() / (std::f64::consts::TAU * sigma * sigma);
                assert!((value - expected).abs() < 1e-11, "{j} {i}"); // cut at the highest frequency: exp(−26)
            }
        }
    }

    #[test]
    fn sizes_are_products_of_small_primes() {
        assert_eq!([1, 7, 11, 97, 601, 1_024].map(good_size), [1, 8, 12, 100, 625, 1_024]);
    }
}
