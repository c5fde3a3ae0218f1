//! The sky mesh and detection on frames of 9576x6388 px and inside the circle of 2500 px.
//!
//! `cargo bench --bench sky` prints CPU seconds of each stage on one thread, then error against run time of the mesh
//! size, of f32 sums and of the reach of the filter. CPU time is that of all threads, as the kernel accounts for it;
//! other processes do not count.
#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use divan::black_box;
use ndarray::Array2;
use satphot::frames::{Electrons, ElectronsPerAdu, Frame, Gain, mask};
use satphot::photometry::background::{Background, background};
use satphot::photometry::detect::{detect, stellar_fwhm};

const FULL: (usize, usize) = (9576, 6388);
const CIRCLE: (usize, usize) = (5001, 5001);
const SKY_E: f64 = 56.0;
const STAR_FWHM_PX: f64 = 10.0;

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    let full = scene(FULL, SKY_E);
    println!("CPU seconds, one thread, median of 5");
    stages("full frame, 9576x6388", &full);
    drop(full);
    let circle = clipped(scene(CIRCLE, SKY_E), 2500.0);
    stages("circle of 2500 px in 5001x5001", &circle);
    drop(circle);
    meshes();
    sums();
    reaches();
    divan::main();
}

/// What is read inside a clip circle: nothing outside it.
fn clipped(mut frame: Frame<Electrons>, radius_px: f64) -> Frame<Electrons> {
    let (ny, nx) = frame.pixels.dim();
    let (cx, cy) = ((nx as f64 - 1.0) / 2.0, (ny as f64 - 1.0) / 2.0);
    for ((j, i), bits) in frame.mask.indexed_iter_mut() {
        if (i as f64 - cx).hypot(j as f64 - cy) > radius_px {
            *bits = mask::CLIPPED;
            frame.pixels[[j, i]] = f32::NAN;
        }
    }
    frame
}

fn stages(name: &str, frame: &Frame<Electrons>) {
    let sky = background(frame, 64, 3.0).unwrap();
    let sources = detect(frame, &sky, 5.0, Some(STAR_FWHM_PX));
    println!("\n{name}, {} sources", sources.len());
    println!("  background, 64 px mesh  {:.4}", cpu(5, || background(frame, 64, 3.0).unwrap()));
    println!("  level of every pixel    {:.4}", cpu(5, || every_row(frame, &sky)));
    for fwhm in [3.0, 5.0, STAR_FWHM_PX, 20.0] {
        println!("  detect, FWHM {fwhm:4.0} px     {:.4}", cpu(5, || detect(frame, &sky, 5.0, Some(fwhm)).len()));
    }
    println!("  FWHM of the stars       {:.4}", cpu(5, || stellar_fwhm(frame, &sky, &sources)));
}

fn every_row(frame: &Frame<Electrons>, sky: &Background) -> f32 {
    let mut row = vec![0f32; frame.pixels.ncols()];
    (0..frame.pixels.nrows()).fold(0.0, |sum, j| {
        sky.level_row(j, 0, &mut row);
        sum + row[j % row.len()]
    })
}

/// Level of the true sky: a vignetted field with a gradient, in units of `sky_e`.
fn true_sky(i: usize, j: usize, (nx, ny): (usize, usize)) -> f64 {
    let (x, y) = (i as f64 / nx as f64 - 0.5, j as f64 / ny as f64 - 0.5);
    1.0 - 0.3 * (x * x + y * y) + 0.1 * x
}

/// The sky with Gaussian noise of its Poisson scatter, and 2000 stars.
fn scene((nx, ny): (usize, usize), sky_e: f64) -> Frame<Electrons> {
    let mut pixels = Array2::from_shape_fn((ny, nx), |(j, i)| {
        let level = sky_e * true_sky(i, j, (nx, ny));
        (level + level.sqrt() * noise((j * nx + i) as u64)) as f32
    });
    let sigma = STAR_FWHM_PX / 2.354_820_045;
    for k in 0..2000usize {
        let (x, y) = (60 + (k * 2477) % (nx - 120), 60 + (k * 1889) % (ny - 120));
        // peaks from 0.3 to 300 sigma of the sky
        let peak = sky_e.sqrt() * 0.3 * 1000f64.powf((k * 761 % 2000) as f64 / 2000.0);
        for j in y - 25..=y + 25 {
            for i in x - 25..=x + 25 {
                let r2 = (i as f64 - x as f64).powi(2) + (j as f64 - y as f64).powi(2);
                pixels[[j, i]] += (peak * (-0.5 * r2 / (sigma * sigma)).exp()) as f32;
            }
        }
    }
    frame(pixels)
}

/// The sum of twelve even deviates less six: a Gaussian to the third decimal, without a table.
fn noise(k: u64) -> f64 {
    let mut sum = 0.0;
    for part in 0..3 {
        let h = (4 * k + part).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let h = (h ^ (h >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let h = h ^ (h >> 32);
        sum += [h & 0xffff, (h >> 16) & 0xffff, (h >> 32) & 0xffff, h >> 48].iter().map(|v| *v as f64).sum::<f64>();
    }
    sum / 65_536.0 - 6.0
}

fn frame(pixels: Array2<f32>) -> Frame<Electrons> {
    let gain = Gain {
        setting: None,
        e_per_adu: ElectronsPerAdu(1.0),
        source: "bench".into(),
        read_noise_e: 1.5,
        pedestal_adu: 0.0,
        saturation_adu: 1e9,
    };
    Frame::from_electrons(PathBuf::from("bench.fits"), pixels, gain)
}

/// Error of the level against the true sky, by mesh size.
fn meshes() {
    let size = (3200, 2400);
    let frame = scene(size, SKY_E);
    println!("\nmesh [px]   rms error [sigma of a pixel]   mean error [sigma]   CPU [s], 3200x2400, 2000 stars");
    for mesh_px in [16, 32, 64, 128, 256] {
        let sky = background(&frame, mesh_px, 3.0).unwrap();
        let (mut sum, mut square, mut n) = (0.0, 0.0, 0.0);
        for j in (0..size.1).step_by(7) {
            for i in (0..size.0).step_by(7) {
                let error = (sky.level(i as f64, j as f64) - SKY_E * true_sky(i, j, size)) / SKY_E.sqrt();
                (sum, square, n) = (sum + error, square + error * error, n + 1.0);
            }
        }
        let time = cpu(5, || background(&frame, mesh_px, 3.0).unwrap());
        println!("{mesh_px:9}   {:28.4}   {:18.4}   {time:.4}", f64::sqrt(square / n), sum / n);
    }
}

/// Relative error of mean and standard deviation of a box of 64x64 px: f64 about a local zero as here, and f32.
fn sums() {
    println!("\nsky [e-]   mean: f32, f32 local zero, f64 local zero   sigma: f32, f32 local zero, f64 local zero");
    for sky_e in [1e-3, 56.0, 1e5, 1e9, 1e12] {
        let values: Vec<f32> = (0..4096).map(|k| (sky_e * (1.0 + 0.003 * noise(k))) as f32).collect();
        let exact = f64::from(values[0]);
        let truth = two_pass(&values);
        let zero = values[0];
        let plain = in_f32(values.iter().copied());
        let local = in_f32(values.iter().map(|v| v - zero));
        let wide = in_f64(values.iter().map(|v| f64::from(*v) - exact));
        let means = [plain.0, f64::from(zero) + local.0, exact + wide.0].map(|m| (m / truth.0 - 1.0).abs());
        let sigmas = [plain.1, local.1, wide.1].map(|s| (s / truth.1 - 1.0).abs());
        println!(
            "{sky_e:8.0e}   {:.0e} {:.0e} {:.0e}   {:.0e} {:.0e} {:.0e}",
            means[0], means[1], means[2], sigmas[0], sigmas[1], sigmas[2]
        );
    }
}

fn two_pass(values: &[f32]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
    (mean, (values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / n).sqrt())
}

fn in_f32(values: impl Iterator<Item = f32>) -> (f64, f64) {
    let (n, sum, square) = values.fold((0f32, 0f32, 0f32), |(n, s, q), v| (n + 1.0, s + v, q + v * v));
    let mean = sum / n;
    (f64::from(mean), f64::from((square / n - mean * mean).max(0.0).sqrt()))
}

fn in_f64(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (n, sum, square) = values.fold((0f64, 0f64, 0f64), |(n, s, q), v| (n + 1.0, s + v, q + v * v));
    let mean = sum / n;
    (mean, (square / n - mean * mean).max(0.0).sqrt())
}

/// What a filter cut off at so many σ keeps of the signal-to-noise of a star; its cost goes with its taps.
fn reaches() {
    let sigma = STAR_FWHM_PX / 2.354_820_045;
    let gauss = |i: i64| (-0.5 * (i as f64 / sigma).powi(2)).exp();
    let square = |r: i64| (-r..=r).map(|i| gauss(i).powi(2)).sum::<f64>();
    println!("\nreach [sigma]   taps per axis   signal-to-noise lost, FWHM {STAR_FWHM_PX} px (3 sigma is built in)");
    for reach in [2.0, 3.0, 4.0] {
        let r = (reach * sigma).ceil() as i64;
        // a matched filter has the signal-to-noise √Σg² along each axis
        println!("{reach:13.0}   {:13}   {:.1e}", 2 * r + 1, 1.0 - square(r) / square(100));
    }
}

/// Median CPU time of a call \[s\], after one that warms up.
fn cpu<T>(times: usize, mut call: impl FnMut() -> T) -> f64 {
    black_box(call());
    let mut seconds: Vec<f64> = (0..times)
        .map(|_| {
            let start = cpu_now();
            black_box(call());
            cpu_now() - start
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[times / 2]
}

/// CPU time of all threads of this process so far \[s\], as Linux accounts for it; wall time elsewhere.
fn cpu_now() -> f64 {
    use std::time::{SystemTime, UNIX_EPOCH};
    let of_thread = |path: PathBuf| -> Option<f64> {
        std::fs::read_to_string(path.join("schedstat")).ok()?.split(' ').next()?.parse().ok()
    };
    match std::fs::read_dir("/proc/self/task") {
        Ok(threads) => 1e-9 * threads.flatten().filter_map(|t| of_thread(t.path())).sum::<f64>(),
        Err(_) => SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |t| t.as_secs_f64()),
    }
}

#[divan::bench(args = [32, 64, 128], sample_count = 10, sample_size = 1)]
fn background_1000x1000(bencher: divan::Bencher, mesh_px: usize) {
    let frame = scene((1000, 1000), SKY_E);
    bencher.bench_local(|| background(&frame, mesh_px, 3.0).unwrap());
}

#[divan::bench(args = [3.0, 10.0, 20.0], sample_count = 10, sample_size = 1)]
fn detect_1000x1000(bencher: divan::Bencher, fwhm_px: f64) {
    let frame = scene((1000, 1000), SKY_E);
    let sky = background(&frame, 64, 3.0).unwrap();
    bencher.bench_local(|| detect(&frame, &sky, 5.0, Some(fwhm_px)).len());
}
