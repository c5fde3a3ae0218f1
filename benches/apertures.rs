//! How long apertures take: the exact overlap against subpixels with its error, and 2000 stars with their skies on a frame.
//!
//! `cargo bench --bench apertures`. First a table of error against CPU time on a flat field of 1, then the kernels. CPU
//! times are those the scheduler counts for one thread; elsewhere than on Linux they are wall times.
#![allow(clippy::unwrap_used)]

use std::path::PathBuf;
use std::sync::LazyLock;
use std::time::Instant;

use divan::{Bencher, black_box};
use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use satphot::frames::{Electrons, ElectronsPerAdu, Frame, Gain};
use satphot::photometry::aperture::{Bounds, Shape, for_each_pixel, shape_sum};
use satphot::photometry::background::{Background, background};
use satphot::photometry::flux::{measure, measure_all};

fn main() {
    print_error_against_run_time();
    print_stars();
    divan::main();
}

/// CPU time of this thread \[s\].
fn cpu_s(start: &Instant) -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok())
        .map_or_else(|| start.elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

const SHAPES: [(&str, Shape); 3] = [
    ("circle r = 5", Shape::Circle { r_px: 5.0 }),
    ("circle r = 20", Shape::Circle { r_px: 20.0 }),
    ("ellipse 60x15", Shape::Ellipse { a_px: 60.0, b_px: 15.0, theta_rad: 0.6 }),
];

/// The sum of a shape by counting `n` × `n` points in every pixel of its outline, written as quick as it plainly can be.
fn subpixel_sum(pixels: &Array2<f64>, shape: &Shape, (x, y): (f64, f64), n: usize) -> f64 {
    let (a, b, theta) = shape.axes();
    let (sin, cos) = theta.sin_cos();
    let (s, t) = (1.0 / (a * a), 1.0 / (b * b));
    let (p, q, r) = (cos * cos * s + sin * sin * t, sin * cos * (s - t), sin * sin * s + cos * cos * t);
    let inside = |dx: f64, dy: f64| p * dx * dx + 2.0 * q * dx * dy + r * dy * dy <= 1.0;
    let points: Vec<f64> = (0..n).map(|k| (k as f64 + 0.5) / n as f64 - 0.5).collect();
    let (top, reach) = ((p * a * a * b * b).sqrt(), 0.75);
    let mut sum = 0.0;
    for j in (y - top).floor() as usize..=(y + top).ceil() as usize {
        let dy = j as f64 - y;
        // the chords of the row within which every, and without which no pixel is inside
        let chord = |dy: f64| {
            let root = (q * q - p * r) * dy * dy + p;
            (root > 0.0).then(|| ((-q * dy - root.sqrt()) / p, (-q * dy + root.sqrt()) / p))
        };
        let (low, high) = (chord(dy - 0.5), chord(dy + 0.5));
        let ends = [low, high, chord(dy)].into_iter().flatten().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let Some((left, right)) = ends else { continue };
        let whole = low.zip(high).map_or((0.0, 0.0), |(l, h)| (l.0.max(h.0) + 0.5, l.1.min(h.1) - 0.5));
        for i in (x + left - reach).floor() as usize..=(x + right + reach).ceil() as usize {
            let dx = i as f64 - x;
            if dx >= whole.0 && dx <= whole.1 {
                sum += pixels[[j, i]];
                continue;
            }
            let mut count = 0;
            for v in &points {
                for u in &points {
                    count += i32::from(inside(dx + u, dy + v));
                }
            }
            sum += pixels[[j, i]] * f64::from(count) / (n * n) as f64;
        }
    }
    sum
}

/// Relative error and CPU time of the sum over a field of 1 at 2000 random centres.
fn print_error_against_run_time() {
    let ones = Array2::from_elem((400, 400), 1.0);
    let mut rng = ChaCha12Rng::seed_from_u64(5);
    let centres: Vec<(f64, f64)> =
        (0..2000).map(|_| (rng.random_range(120.0..280.0), rng.random_range(120.0..280.0))).collect();
    println!("shape          method       rms rel. error  max rel. error  CPU us per aperture");
    for (name, shape) in SHAPES {
        for n in [0, 1, 3, 5, 10] {
            let sum = |at: &(f64, f64)| {
                if n == 0 { shape_sum(&ones, &shape, at.0, at.1) } else { subpixel_sum(&ones, &shape, *at, n) }
            };
            let errors: Vec<f64> = centres.iter().map(|at| sum(at) / shape.area_px() - 1.0).collect();
            let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
            let max = errors.iter().fold(0f64, |m, e| m.max(e.abs()));
            let (start, mut passes) = (Instant::now(), 0);
            let from = cpu_s(&start);
            // the scheduler counts in steps of some ms: half a second is 1 % of it
            while start.elapsed().as_secs_f64() < 0.5 {
                black_box(centres.iter().map(|at| sum(black_box(at))).sum::<f64>());
                passes += 1;
            }
            let us = (cpu_s(&start) - from) / f64::from(passes) / centres.len() as f64 * 1e6;
            let method = if n == 0 { "exact".to_owned() } else { format!("subpixel {n}") };
            println!("{name:<14} {method:<12} {rms:>14.1e} {max:>15.1e} {us:>20.2}");
        }
    }
}

/// CPU time of 2000 stars r = 20 with annuli 30 to 40 on a full frame.
fn print_stars() {
    let f = &*FIELD;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let (start, mut passes) = (Instant::now(), 0);
        let from = cpu_s(&start);
        while start.elapsed().as_secs_f64() < 2.0 {
            black_box(measure_all(&f.frame, &f.sky, &f.places, STAR, (30.0, 40.0), 3.0, &[]));
            passes += 1;
        }
        let cpu = (cpu_s(&start) - from) / f64::from(passes);
        println!("2000 stars r = 20, annuli 30 to 40: {cpu:.4} CPU s, {:.1} us per star", cpu / 2000.0 * 1e6);
    });
}

/// A full frame of sky noise, its background, and 2000 places on it.
struct Field {
    frame: Frame<Electrons>,
    sky: Background,
    places: Vec<(f64, f64)>,
}

static FIELD: LazyLock<Field> = LazyLock::new(|| {
    let mut rng = ChaCha12Rng::seed_from_u64(1);
    // nearly Gaussian: the sum of four uniform numbers; sky 100 ± 10 e⁻
    let pixels = Array2::from_shape_simple_fn((6388, 9576), || {
        let bits: u64 = rng.random();
        let sum: f32 = (0..4).map(|k| ((bits >> (16 * k)) & 0xFFFF) as f32 / 65_536.0).sum();
        100.0 + 10.0 * 1.732_050_8 * (sum - 2.0)
    });
    let gain = Gain {
        setting: None,
        e_per_adu: ElectronsPerAdu(1.0),
        source: "bench".into(),
        read_noise_e: 1.5,
        pedestal_adu: 0.0,
        saturation_adu: 65_535.0,
    };
    let frame = Frame::from_electrons(PathBuf::from("bench.fits"), pixels, gain);
    let sky = background(&frame, 64, 3.0).unwrap();
    let mut place = || (rng.random_range(60.0..9516.0), rng.random_range(60.0..6328.0));
    let places = (0..2000).map(|_| place()).collect();
    Field { frame, sky, places }
});

const STAR: Shape = Shape::Circle { r_px: 20.0 };

#[divan::bench(sample_count = 30, sample_size = 1)]
fn stars_2000_one_by_one(bencher: Bencher) {
    let f = &*FIELD;
    bencher.bench_local(|| {
        f.places.iter().map(|&(x, y)| measure(&f.frame, &f.sky, x, y, STAR, 30.0, 40.0, 3.0).flux_e).sum::<f64>()
    });
}

#[divan::bench(args = [1, 2], sample_count = 30, sample_size = 1)]
fn stars_2000_at_once(bencher: Bencher, threads: usize) {
    let f = &*FIELD;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    bencher.bench_local(|| {
        pool.install(|| measure_all(&f.frame, &f.sky, &f.places, STAR, (30.0, 40.0), 3.0, &[]))
            .iter()
            .map(|s| s.flux_e)
            .sum::<f64>()
    });
}

#[divan::bench(args = [0, 1, 2])]
fn overlap_alone(bencher: Bencher, shape: usize) {
    let shape = SHAPES[shape].1;
    let bounds = Bounds { x0: 0, x1: 400, y0: 0, y1: 400 };
    bencher.bench_local(|| {
        let mut area = 0.0;
        for_each_pixel(black_box(&shape), 200.3, 199.6, bounds, |_, _, fraction| area += fraction);
        area
    });
}
