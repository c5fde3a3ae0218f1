//! Cells against plain loops over every pixel, to the bit.

use super::*;

/// Numbers without a pattern, some of them NaN.
fn image((ny, nx): (usize, usize), bad_every: usize) -> Array2<f32> {
    Array2::from_shape_fn((ny, nx), |(j, i)| {
        let k = (j * 7919 + i * 104_729 + j * i * 31) % 1013;
        if k % bad_every == 0 { f32::NAN } else { k as f32 * 0.37 - 40.0 }
    })
}

#[test]
fn a_cell_is_the_mean_of_its_good_pixels_and_bad_where_fewer_than_half_are() {
    for (fwhm_px, bad_every) in [(2.5, 5), (8.1, 3), (10.0, 2), (17.0, 2)] {
        let pixels = image((45, 67), bad_every);
        let cells = Cells::of_lines(pixels.dim(), fwhm_px, |j, out| out.copy_from_slice(row_of(&pixels, j)));
        let bin = cells.bin;
        assert_eq!(cells.mean.dim(), (45 / bin, 67 / bin));
        for ((j, i), got) in cells.mean.indexed_iter() {
            let square = pixels.slice(ndarray::s![j * bin..(j + 1) * bin, i * bin..(i + 1) * bin]);
            let (sum, n) = square.iter().filter(|v| v.is_finite()).fold((0f32, 0), |(s, n), v| (s + v, n + 1));
            let wanted = if 2 * n >= bin * bin { sum / n as f32 } else { f32::NAN };
            assert_eq!(got.to_bits(), wanted.to_bits(), "{bin} {j} {i}");
        }
    }
}

#[test]
fn squares_sum_what_is_seen() {
    let layers = Layers { value: image((37, 53), 4), variance: image((37, 53), 2000), uncertainty: None };
    let hidden = layers.variance.mapv(|v| v > 200.0);
    for rebin in [1, 2, 3, 4, 8] {
        let per = (rebin * rebin) as f32;
        for hidden in [None, Some(&hidden)] {
            for ((j, i), got) in layers.squares(&layers.variance, per, rebin, hidden).indexed_iter() {
                let mut wanted = 0f32;
                for y in j * rebin..((j + 1) * rebin).min(37) {
                    let columns = i * rebin..((i + 1) * rebin).min(53);
                    let seen = |x: usize| layers.value[[y, x]].is_finite() && hidden.is_none_or(|h| !h[[y, x]]);
                    wanted += columns.map(|x| if seen(x) { layers.variance[[y, x]] } else { 0.0 }).sum::<f32>() / per;
                }
                assert_eq!(*got, wanted, "{rebin} {j} {i}");
            }
        }
    }
}

#[test]
fn a_filter_is_the_weighted_sum_of_what_lies_around_and_nothing_beyond_the_edge() {
    let image = image((23, 41), 2000).mapv(|v| if v.is_finite() { v } else { 0.0 });
    let taps = elongated_taps(14.0, 4.0, 0.6);
    for ((j, i), got) in filtered(&image, &taps).indexed_iter() {
        let mut wanted = 0f32;
        for &(dj, di, w) in &taps {
            let (y, x) = (j as isize + dj, i as isize + di);
            if (0..23).contains(&y) && (0..41).contains(&x) {
                wanted += w * image[[y as usize, x as usize]];
            }
        }
        assert_eq!(*got, wanted, "{j} {i}");
    }
}

#[test]
fn a_cell_grows_into_a_square() {
    for sparse in [3, 40, 400] {
        let image = image((31, 47), 2000).mapv(|v| (v * 100.0) as i32 % sparse == 0);
        for by in [0, 1, 2, 5, 40] {
            for ((j, i), got) in grown(&image, by).indexed_iter() {
                let (rows, columns) =
                    (j.saturating_sub(by)..(j + by + 1).min(31), i.saturating_sub(by)..(i + by + 1).min(47));
                assert_eq!(*got, image.slice(ndarray::s![rows, columns]).iter().any(|v| *v), "{sparse} {by} {j} {i}");
            }
        }
    }
    assert_eq!(grown(&Array2::from_elem((0, 0), true), 3).dim(), (0, 0));
}
