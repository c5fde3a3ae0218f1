//! Share of a pixel in an aperture: exact, or by counting points, which is what the knob of most programs does.
//!
//! A field of 1, so that the sum is the area: the truth is known. Errors relative to it.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::base::error::Result;
use crate::photometry::aperture::{Bounds, Shape, for_each_pixel};

/// Points along each side of a pixel; 0 is the exact share.
const SUBPIXELS: [usize; 5] = [1, 3, 5, 10, 0];

/// An aperture on a field of 1: pixels wholly inside, and where the others are, from its centre.
struct Placed {
    inside: f64,
    outline: Vec<(f64, f64)>,
}

impl Placed {
    fn at(shape: &Shape, (x, y): (f64, f64)) -> Self {
        let reach = shape.bounding_radius_px().ceil() as usize + 2;
        let side = 2 * reach + 1;
        let (x, y) = (reach as f64 + x, reach as f64 + y);
        let mut placed = Self { inside: 0.0, outline: Vec::new() };
        for_each_pixel(shape, x, y, Bounds { x0: 0, x1: side, y0: 0, y1: side }, |i, j, share| {
            if share < 1.0 {
                placed.outline.push((i as f64 - x, j as f64 - y));
            } else {
                placed.inside += 1.0;
            }
        });
        placed
    }

    /// Area of the outline's pixels; 0 subpixels is the exact share.
    fn outline_area(&self, shape: &Shape, subpixels: usize) -> f64 {
        let share = |(dx, dy): &(f64, f64)| match subpixels {
            0 => shape.pixel_fraction(*dx, *dy),
            n => shape.subpixel_fraction(*dx, *dy, n),
        };
        self.outline.iter().map(share).sum()
    }
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let shapes = [
        ("circle r = 5 px", Shape::Circle { r_px: 5.0 }),
        ("circle r = 20 px", Shape::Circle { r_px: 20.0 }),
        ("ellipse 60 x 15 px", Shape::Ellipse { a_px: 60.0, b_px: 15.0, theta_rad: 0.5 }),
        ("pill 60 x 15 px", Shape::Pill { a_px: 60.0, b_px: 15.0, theta_rad: 0.5 }),
    ];
    let mut rng = ChaCha12Rng::seed_from_u64(stopwatch.seed(5));
    let places: Vec<(f64, f64)> = (0..stopwatch.effort.of(100, 2000))
        .map(|_| (rng.random_range(-0.5..0.5), rng.random_range(-0.5..0.5)))
        .collect();
    let series = shapes.into_iter().map(|(label, shape)| {
        let placed: Vec<Placed> = places.iter().map(|at| Placed::at(&shape, *at)).collect();
        let point = |subpixels: usize| {
            let area = |p: &Placed| p.inside + p.outline_area(&shape, subpixels);
            let off: Vec<f64> = placed.iter().map(|p| area(p) / shape.area_px() - 1.0).collect();
            let all_us = cpu_us(stopwatch, || {
                for p in &placed {
                    std::hint::black_box(p.outline_area(&shape, subpixels));
                }
            });
            Errors::of(&off).map(|errors| SweepPoint {
                setting: if subpixels == 0 { "exact".into() } else { subpixels.to_string() },
                errors,
                cpu_us: all_us / places.len() as f64,
                memory_kb: None,
                is_default: subpixels == 0,
            })
        };
        Series { label: label.into(), points: SUBPIXELS.into_iter().filter_map(point).collect() }
    });
    Ok(Sweep {
        knob: "subpixels",
        work: "the outline of one aperture",
        error: "relative",
        reference: "the area of the shape",
        default_because: "exact costs no more than a few subpixels and leaves no error to think about",
        series: series.collect(),
    })
}
