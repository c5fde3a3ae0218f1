//! How long reading takes: counts of a file to flattened electrons, whole and inside a circle, plain and compressed.
//!
//! `cargo bench --bench reading`. Frames of 4096 x 4096 px (34 MB), in memory of the system after the first pass; divide by
//! 16.8 Mpx. The peer is scripts/bench_peers.sh.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use ndarray::Array2;
use satphot::config::Config;
use satphot::fits::{CardValue, write_f32, write_u16};
use satphot::frames::flat::MasterFlat;
use satphot::frames::{Buffers, ElectronsPerAdu, Exposure, FrameReader, Gain, classify, read};

fn main() {
    divan::main();
}

const SIDE: usize = 4096;

/// A frame with noise, plain or compressed, and a master flat.
fn files(compress: bool) -> (tempfile::TempDir, Exposure, MasterFlat) {
    let dir = tempfile::tempdir().unwrap();
    let mut state = 1u64;
    let pixels = Array2::from_shape_fn((SIDE, SIDE), |_| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        1_000 + (state >> 57) as u16
    });
    let text = |k: &str, v: &str| (k.to_string(), CardValue::Text(v.into()), String::new());
    let cards = [
        text("IMAGETYP", "LIGHT"),
        text("OBJECT", "ISS"),
        text("DATE-OBS", "2025-06-09T10:33:00.500"),
        ("EXPTIME".into(), CardValue::Real(5.0), String::new()),
    ];
    let path: PathBuf = dir.path().join(if compress { "frame.fits.fz" } else { "frame.fits" });
    write_u16(&path, &pixels, &cards, compress).unwrap();
    let night = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\"i\"]\noutput = \"o\"\n";
    let config = Config::from_text(night, &[]).unwrap();
    let flat: &Path = &dir.path().join("master.fits");
    write_f32(flat, &Array2::from_elem((SIDE, SIDE), 1.1), &[]).unwrap();
    let flat = MasterFlat::read(flat, None, &config.flat).unwrap();
    let exposure = classify(&path, &config, &[]).unwrap();
    (dir, exposure, flat)
}

fn gain() -> Gain {
    Gain {
        setting: None,
        e_per_adu: ElectronsPerAdu(0.78),
        source: String::new(),
        read_noise_e: 3.5,
        pedestal_adu: 500.0,
        saturation_adu: 65_000.0,
    }
}

fn reading(bencher: Bencher, threads: usize, compress: bool, radius_px: Option<f64>) {
    let (_dir, exposure, flat) = files(compress);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let buffers = Buffers::default();
    bencher.counter(ItemsCount::new(SIDE * SIDE)).bench_local(|| {
        pool.install(|| black_box(read(&exposure, gain(), radius_px, Some(&flat), &buffers).unwrap().pixels[[0, 0]]))
    });
}

#[divan::bench(args = [1, 2])]
fn plain_whole(bencher: Bencher, threads: usize) {
    reading(bencher, threads, false, None);
}

#[divan::bench(args = [1, 2])]
fn plain_circle_of_2000_px(bencher: Bencher, threads: usize) {
    reading(bencher, threads, false, Some(2000.0));
}

#[divan::bench(args = [1, 2], sample_count = 10)]
fn compressed_whole(bencher: Bencher, threads: usize) {
    reading(bencher, threads, true, None);
}

/// What memory that is fresh each time costs.
#[divan::bench]
fn plain_whole_in_fresh_memory(bencher: Bencher) {
    let (_dir, exposure, flat) = files(false);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    bencher.counter(ItemsCount::new(SIDE * SIDE)).bench_local(|| {
        let buffers = Buffers::default();
        pool.install(|| black_box(read(&exposure, gain(), None, Some(&flat), &buffers).unwrap().pixels[[0, 0]]))
    });
}

/// A target's window alone.
#[divan::bench]
fn plain_part_of_1700_px(bencher: Bencher) {
    let (_dir, exposure, flat) = files(false);
    let reader = FrameReader::open(&exposure, gain(), None, Some(&flat)).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let buffers = Buffers::default();
    bencher.counter(ItemsCount::new(1700_usize * 1700)).bench_local(|| {
        pool.install(|| black_box(reader.part(1000..2700, 1000..2700, &buffers).unwrap().pixels[[0, 0]]))
    });
}
