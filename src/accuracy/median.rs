//! The median of a stack of frames, pixel by pixel: cost of a sorting network, of selection and of a plain sort.
//!
//! Stored 16-bit counts, and 32-bit levels as they are after scaling. All three are exact: time and memory are what is
//! compared. One thread and the instructions every processor has; the master flat also uses wider lanes where there are.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::error::Result;
use crate::frames::flat::{LANES, Lanes, Network, middle};

/// Frames in a stack.
const FRAMES: [usize; 3] = [9, 25, 42];

/// A block of lanes: one per frame.
fn block<T: Copy + Default>(n: usize, mut value: impl FnMut() -> T) -> Vec<Lanes<T>> {
    (0..n)
        .map(|_| {
            let mut lanes = Lanes([T::default(); LANES]);
            lanes.0.iter_mut().for_each(|v| *v = value());
            lanes
        })
        .collect()
}

/// The mean of the two middle values of one pixel, by `order`, which brings them into place.
fn one_by_one<T: Copy + Default + Into<f64>>(
    block: &[Lanes<T>],
    scratch: &mut Vec<T>,
    order: impl Fn(&mut [T], usize, usize),
) -> [f64; LANES] {
    let (lo, hi) = middle(block.len());
    std::array::from_fn(|i| {
        scratch.clear();
        scratch.extend(block.iter().map(|lanes| lanes.0[i]));
        order(scratch, lo, hi);
        0.5 * (scratch[lo].into() + scratch[hi].into())
    })
}

/// The same by the network.
fn by_network<T: Copy + PartialOrd + Into<f64>>(
    network: &Network,
    block: &[Lanes<T>],
    rows: &mut Vec<Lanes<T>>,
) -> [f64; LANES] {
    let (lo, hi) = middle(block.len());
    rows.clear();
    rows.extend_from_slice(block);
    network.run(rows);
    std::array::from_fn(|i| 0.5 * (rows[lo].0[i].into() + rows[hi].0[i].into()))
}

/// A method on blocks, and the medians of each.
type Method<'a, T> = (&'static str, Box<dyn FnMut(&[Lanes<T>]) -> [f64; LANES] + 'a>);

/// Largest difference of network and sort over `blocks` blocks of 25 frames of either kind.
pub(super) fn worst_difference(blocks: usize) -> (f64, usize) {
    let mut rng = ChaCha12Rng::seed_from_u64(27);
    let (mut worst, mut n) = (0.0f64, 0);
    for frames in FRAMES {
        let network = Network::new(frames);
        for _ in 0..blocks {
            let counts = block(frames, || rng.random_range(0..=u16::MAX));
            let sorted = one_by_one(&counts, &mut Vec::new(), |v, _, _| v.sort_unstable());
            let fast = by_network(&network, &counts, &mut Vec::new());
            let levels = block(frames, || rng.random_range(0.5f32..1.5));
            let sorted_levels = one_by_one(&levels, &mut Vec::new(), |v, _, _| v.sort_unstable_by(f32::total_cmp));
            let fast_levels = by_network(&network, &levels, &mut Vec::new());
            for (a, b) in sorted.iter().zip(fast).chain(sorted_levels.iter().zip(fast_levels)) {
                worst = worst.max((a - b).abs());
                n += 1;
            }
        }
    }
    (worst, n)
}

fn series<T: Copy + Default + Into<f64>>(
    stopwatch: &Stopwatch,
    label: String,
    blocks: &[Vec<Lanes<T>>],
    mut methods: Vec<Method<T>>,
) -> Series {
    let frames = blocks.first().map_or(0, Vec::len);
    let exact: Vec<[f64; LANES]> = match methods.last_mut() {
        Some((_, sort)) => blocks.iter().map(|b| sort(b)).collect(),
        None => Vec::new(),
    };
    let mut points = Vec::new();
    for (setting, mut medians) in methods {
        let off: Vec<f64> = (blocks.iter().zip(&exact))
            .flat_map(|(b, exact)| {
                medians(b).into_iter().zip(*exact).map(|(got, exact)| got - exact).collect::<Vec<_>>()
            })
            .collect();
        let us = cpu_us(stopwatch, || {
            blocks.iter().for_each(|b| {
                std::hint::black_box(medians(b));
            });
        });
        let at_once = if setting == "network" { LANES } else { 1 };
        points.extend(Errors::of(&off).map(|errors| SweepPoint {
            setting: setting.into(),
            errors,
            cpu_us: us * 1000.0 / (blocks.len() * LANES) as f64,
            memory_kb: Some((frames * at_once * size_of::<T>()) as f64 / 1024.0),
            is_default: setting == "network",
        }));
    }
    Series { label, points }
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let n = stopwatch.effort.of(8, 64);
    let mut rng = ChaCha12Rng::seed_from_u64(stopwatch.seed(26));
    let mut all = Vec::new();
    for frames in FRAMES {
        let network = Network::new(frames);
        let counts: Vec<_> = (0..n).map(|_| block(frames, || rng.random_range(20_000u16..40_000))).collect();
        let (mut rows, mut a, mut b) = (Vec::new(), Vec::new(), Vec::new());
        let methods: Vec<Method<u16>> = vec![
            ("network", Box::new(|c| by_network(&network, c, &mut rows))),
            (
                "select",
                Box::new(|c| {
                    one_by_one(c, &mut a, |v, lo, hi| {
                        v.select_nth_unstable(hi);
                        v[..=hi.max(lo)].select_nth_unstable(lo);
                    })
                }),
            ),
            ("sort", Box::new(|c| one_by_one(c, &mut b, |v, _, _| v.sort_unstable()))),
        ];
        all.push(series(stopwatch, format!("{frames} frames, 16-bit counts"), &counts, methods));
        let levels: Vec<_> = (0..n).map(|_| block(frames, || rng.random_range(0.8f32..1.2))).collect();
        let (mut rows, mut a, mut b) = (Vec::new(), Vec::new(), Vec::new());
        let methods: Vec<Method<f32>> = vec![
            ("network", Box::new(|c| by_network(&network, c, &mut rows))),
            (
                "select",
                Box::new(|c| {
                    one_by_one(c, &mut a, |v, lo, hi| {
                        v.select_nth_unstable_by(hi, f32::total_cmp);
                        v[..=hi.max(lo)].select_nth_unstable_by(lo, f32::total_cmp);
                    })
                }),
            ),
            ("sort", Box::new(|c| one_by_one(c, &mut b, |v, _, _| v.sort_unstable_by(f32::total_cmp)))),
        ];
        all.push(series(stopwatch, format!("{frames} frames, 32-bit levels"), &levels, methods));
    }
    Ok(Sweep {
        knob: "algorithm",
        work: "1000 pixels",
        error: "stored units",
        reference: "a plain sort",
        default_because: "all are exact; the network does the same steps for every pixel, so a processor does many at once",
        series: all,
    })
}
