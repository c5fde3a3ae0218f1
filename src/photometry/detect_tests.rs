//! Detection tile by tile against the same recipe on the whole frame, written plainly.

use std::path::PathBuf;

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal};

use super::*;
use crate::frames::{ElectronsPerAdu, Gain};
use crate::photometry::background::background;
use crate::photometry::label::runs_of_part;

fn frame(pixels: Array2<f32>) -> Frame<Electrons> {
    let gain = Gain {
        setting: None,
        e_per_adu: ElectronsPerAdu(1.0),
        source: "test".into(),
        read_noise_e: 0.0,
        pedestal_adu: 0.0,
        saturation_adu: 1e9,
    };
    Frame::from_electrons(PathBuf::from("test.fits"), pixels, gain)
}

/// Stars of any brightness, also across the edges, on a sloping sky with Gaussian noise.
fn field(ny: usize, nx: usize, stars: usize, fwhm: f64, seed: u64) -> Frame<Electrons> {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, 7.0).unwrap();
    let mut pixels = Array2::from_shape_fn((ny, nx), |(j, i)| {
        (56.0 + 0.004 * i as f64 - 0.003 * j as f64 + noise.sample(&mut rng)) as f32
    });
    let sigma = fwhm / FWHM_PER_SIGMA;
    for _ in 0..stars {
        let (x, y) = (rng.random_range(0.0..nx as f64), rng.random_range(0.0..ny as f64));
        let peak = 7.0 * 10f64.powf(rng.random_range(-0.7..2.5));
        let near = |c: f64, n: usize| (c - 5.0 * fwhm).max(0.0) as usize..((c + 5.0 * fwhm) as usize).min(n);
        for j in near(y, ny) {
            for i in near(x, nx) {
                let r2 = (i as f64 - x).powi(2) + (j as f64 - y).powi(2);
                pixels[[j, i]] += (peak * (-0.5 * r2 / (sigma * sigma)).exp()) as f32;
            }
        }
    }
    frame(pixels)
}

/// The frame less the sky, filtered with sums of f64 from the first tap to the last; runs; flood of the runs.
fn plain(frame: &Frame<Electrons>, sky: &Background, threshold_sigma: f64, fwhm: f64) -> Vec<Source> {
    let (ny, nx) = frame.pixels.dim();
    let offset_e = level_offset(frame, sky);
    let kernel = Kernel::gaussian(fwhm);
    let (taps, r) = (kernel.taps(), kernel.radius());
    let mut net = Array2::<f32>::zeros((ny, nx));
    let mut level = vec![0f32; nx];
    for j in 0..ny {
        sky.level_row(frame.origin_px.1 + j, frame.origin_px.0, &mut level);
        for i in 0..nx {
            let v = frame.pixels[[j, i]];
            if frame.mask[[j, i]] & (mask::BAD | mask::CLIPPED) == 0 && v.is_finite() {
                net[[j, i]] = v - level[i] - offset_e;
            }
        }
    }
    let at = |map: &Array2<f64>, j: Option<usize>, i: Option<usize>| {
        j.zip(i).and_then(|at| map.get(at)).copied().unwrap_or(0.0)
    };
    let wide = net.mapv(f64::from);
    let weigh =
        |value: &dyn Fn(usize) -> f64| taps.iter().enumerate().map(|(t, k)| f64::from(*k) * value(t)).sum::<f64>();
    let rows = Array2::from_shape_fn((ny, nx), |(j, i)| weigh(&|t| at(&wide, Some(j), (i + t).checked_sub(r))));
    let mut runs = Vec::new();
    let mut rms = vec![0f32; nx];
    for j in 0..ny {
        sky.rms_row(frame.origin_px.1 + j, frame.origin_px.0, &mut rms);
        let smooth = (0..nx).map(|i| weigh(&|t| at(&rows, (j + t).checked_sub(r), Some(i))));
        let per_rms = threshold_sigma * kernel.noise_factor();
        runs_of_part(j, 0, smooth.zip(&rms).map(|(v, r)| v > per_rms * f64::from(*r) && v > 0.0), &mut runs);
    }
    let (labels, n) = label(&runs);
    let whole = Net::new(frame, sky, offset_e);
    let mut sums: Vec<Option<Sums>> = vec![None; n];
    for (run, &k) in runs.iter().zip(&labels) {
        let sum = sums[k].get_or_insert_with(|| Sums::at(run.columns.start as f64, run.row as f64));
        let pixels = net.row(run.row).to_vec();
        sum.add(run, &pixels[run.columns.clone()], &whole, (ny, nx));
    }
    let mut sources: Vec<Source> = sums.into_iter().flatten().map(|s| s.source(frame.origin_px)).collect();
    sources.sort_by(|p, q| q.flux_e.total_cmp(&p.flux_e));
    sources
}

fn compare(frame: &Frame<Electrons>, threshold_sigma: f64, fwhm: f64, at_least: usize) {
    let sky = background(frame, 64, 3.0).unwrap();
    let (got, want) = (detect(frame, &sky, threshold_sigma, Some(fwhm)), plain(frame, &sky, threshold_sigma, fwhm));
    assert_eq!(got.len(), want.len());
    assert!(got.len() >= at_least, "{}", got.len());
    for (g, w) in got.iter().zip(&want) {
        assert_eq!((g.npix, g.flags), (w.npix, w.flags));
        assert_eq!((g.x_px, g.y_px, g.flux_e, g.peak_e), (w.x_px, w.y_px, w.flux_e, w.peak_e));
    }
}

#[test]
fn the_sources_are_those_of_the_whole_frame_filtered_plainly() {
    // sizes below, at and above a tile; the runs are the same, so the moments are, to the bit
    for (ny, nx, fwhm) in
        [(300, 600, 3.0), (256, 512, 10.0), (257, 513, 10.0), (90, 1100, 20.0), (40, 30, 4.0), (9, 700, 6.0)]
    {
        compare(&field(ny, nx, (ny * nx / 2000).max(4), fwhm, 7), 3.0, fwhm, 1);
    }
    compare(&field(600, 1200, 400, 5.0, 8), 1.5, 5.0, 100);
}

#[test]
fn clipped_corners_bad_columns_and_nan_leave_the_other_sources_as_they_are() {
    let mut frame = field(700, 1100, 300, 6.0, 9);
    frame.origin_px = (1000, 500);
    frame.full_size_px = (3100, 1700);
    for ((j, i), bits) in frame.mask.indexed_iter_mut() {
        if (i as f64 - 550.0).hypot(j as f64 - 350.0) > 340.0 {
            *bits |= mask::CLIPPED;
        }
    }
    frame.pixels.column_mut(500).fill(f32::NAN);
    frame.pixels.column_mut(620).fill(f32::INFINITY);
    frame.mask.column_mut(501).fill(mask::BAD);
    compare(&frame, 4.0, 6.0, 20);
}

#[test]
fn a_star_on_the_edge_of_the_frame_or_of_the_circle_is_found_and_flagged() {
    let mut frame = field(600, 600, 0, 6.0, 10);
    let mut star = |x: i64, y: i64| {
        for (j, i) in (-20..=20).flat_map(|j| (-20..=20).map(move |i| (j, i))) {
            if let Some(v) = frame.pixels.get_mut(((y + j) as usize, (x + i) as usize)) {
                *v += 2000.0 * (-((i * i + j * j) as f32) / 13.0).exp();
            }
        }
    };
    for (x, y) in [(0, 300), (599, 200), (300, 0), (200, 599), (511, 256), (447, 447)] {
        star(x, y);
    }
    for ((j, i), bits) in frame.mask.indexed_iter_mut() {
        if (i as f64).hypot(j as f64) > 634.0 {
            *bits |= mask::CLIPPED;
        }
    }
    let sky = background(&frame, 64, 3.0).unwrap();
    let sources = detect(&frame, &sky, 5.0, Some(6.0));
    assert_eq!(sources.len(), 6);
    let at = |x: f64, y: f64| sources.iter().find(|s| (s.x_px - x).hypot(s.y_px - y) < 3.0).map(|s| s.flags);
    for (x, y) in [(1.0, 300.0), (598.0, 200.0), (300.0, 1.0)] {
        assert!(at(x, y).is_some_and(|f| f.has(Flags::EDGE)), "{x} {y}");
    }
    assert_eq!(at(511.0, 256.0), Some(Flags::default())); // where four tiles meet
    assert!(at(446.0, 446.0).is_some_and(|f| f.has(Flags::CLIP_EDGE)));
}
