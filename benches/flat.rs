//! How long a master flat takes: levels and medians of flats of 1024 x 1024 px, plain and compressed.
//!
//! `cargo bench --bench flat`. Files in memory of the system after the first pass; one thread. With it what the same
//! stack costs where each pixel's flats are sorted: the plainest way. The peers are in scripts/bench_peers.sh.
#![allow(clippy::unwrap_used)]

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use ndarray::Array2;
use satphot::config::Config;
use satphot::fits::{CardValue, write_u16};
use satphot::frames::flat::{BAND_BYTES, MasterFlat};
use satphot::frames::{Detector, Exposure, classify};

fn main() {
    divan::main();
}

const SIDE: usize = 1024;

fn config(scale: &str) -> Config {
    let night = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\"i\"]\noutput = \"o\"\n";
    Config::from_text(night, &[format!("flat.scale=\"{scale}\"")]).unwrap()
}

/// Noisy counts of a flat whose level falls from one to the next.
fn counts(k: usize) -> Array2<u16> {
    let mut state = k as u64 + 1;
    Array2::from_shape_fn((SIDE, SIDE), |_| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        26_000 - 130 * k as u16 + (state >> 55) as u16
    })
}

fn flats(n: usize, compress: bool, config: &Config) -> (tempfile::TempDir, Vec<Exposure>) {
    let dir = tempfile::tempdir().unwrap();
    let cards = [
        ("IMAGETYP".into(), CardValue::Text("FLAT".into()), String::new()),
        ("EXPTIME".into(), CardValue::Real(1.0), String::new()),
        ("GAIN".into(), CardValue::Integer(200), String::new()),
    ];
    let exposures = (0..n).map(|k| {
        let path = dir.path().join(format!("flat_{k:02}.fits{}", if compress { ".fz" } else { "" }));
        write_u16(&path, &counts(k), &cards, compress).unwrap();
        classify(&path, config, &[]).unwrap()
    });
    let exposures = exposures.collect();
    (dir, exposures)
}

fn master(bencher: Bencher, n: usize, compress: bool, scale: &str) {
    let config = config(scale);
    let detector = Detector::from_config(&config.detector).unwrap();
    let (_dir, exposures) = flats(n, compress, &config);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    bencher.counter(ItemsCount::new(n * SIDE * SIDE)).bench_local(|| {
        pool.install(|| {
            black_box(MasterFlat::make(&exposures, &detector, &config.flat, None, BAND_BYTES).unwrap().masked_frac)
        })
    });
}

#[divan::bench(args = [5, 11, 42])]
fn levels_scaled(bencher: Bencher, n: usize) {
    master(bencher, n, false, "level");
}

#[divan::bench(args = [5, 11, 42])]
fn stored_values(bencher: Bencher, n: usize) {
    master(bencher, n, false, "none");
}

#[divan::bench(args = [11], sample_count = 10)]
fn compressed(bencher: Bencher, n: usize) {
    master(bencher, n, true, "level");
}

/// The counts in memory, every pixel's sorted.
#[divan::bench(args = [11, 42], sample_count = 3)]
fn a_sort_per_pixel(bencher: Bencher, n: usize) {
    let stack: Vec<Vec<u16>> = (0..n).map(|k| counts(k).into_raw_vec_and_offset().0).collect();
    let mut column = vec![0u16; n];
    bencher.counter(ItemsCount::new(n * SIDE * SIDE)).bench_local(|| {
        let mut sum = 0.0;
        for i in 0..SIDE * SIDE {
            column.iter_mut().zip(&stack).for_each(|(c, flat)| *c = flat[i]);
            column.sort_unstable();
            sum += 0.5 * (f64::from(column[(n - 1) / 2]) + f64::from(column[n / 2]));
        }
        black_box(sum)
    });
}
