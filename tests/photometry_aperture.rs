//! Exact overlap of apertures with pixels: against photutils and sep, and against geometry.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use ndarray::Array2;
use satphot::photometry::aperture::{Bounds, Shape, circle_sum, for_each_pixel, shape_sum};

/// The image of scripts/make_aperture_vectors.py.
fn formula_image() -> Array2<f64> {
    Array2::from_shape_fn((120, 160), |(j, i)| {
        let wave = (0.37 * i as f64).sin() * (0.23 * j as f64).cos();
        (1000.0 * (1.5 + wave + ((7 * i + 13 * j) % 17) as f64 / 17.0)).floor()
    })
}

#[test]
fn sums_are_those_of_photutils_and_sep_exact() {
    let image = formula_image();
    let (mut n_photutils, mut n_sep, mut worst) = (0, 0, 0f64);
    for line in include_str!("data/aperture_vectors.csv").lines().skip(2) {
        let cell: Vec<&str> = line.split(',').collect();
        let number = |k: usize| -> f64 { cell[k].parse().unwrap() };
        let shape = match cell[0] {
            "circle" => Shape::Circle { r_px: number(3) },
            _ => Shape::Ellipse { a_px: number(3), b_px: number(4), theta_rad: number(5) },
        };
        let sum = shape_sum(&image, &shape, number(1), number(2));
        let difference = (sum / number(6) - 1.0).abs();
        worst = worst.max(difference);
        assert!(difference < 1e-8, "{line}: {sum}");
        n_photutils += 1;
        if !cell[7].is_empty() {
            assert!((sum / number(7) - 1.0).abs() < 1e-8, "sep: {line}: {sum}");
            n_sep += 1;
        }
    }
    println!("{n_photutils} sums, worst |ours/photutils - 1| = {worst:.1e}");
    assert!(n_photutils >= 200 && n_sep >= 190, "{n_photutils} {n_sep}");
}

#[test]
fn a_flat_field_of_one_sums_to_the_area() {
    let ones = Array2::from_elem((300, 300), 1.0);
    for k in 0..2000 {
        // a low-discrepancy walk over centres, radii and shapes
        let f = |a: f64| (f64::from(k) * a).fract();
        let (x, y) = (150.0 + 40.0 * (f(0.618_033_988_7) - 0.5), 150.0 + 40.0 * (f(0.754_877_666_2) - 0.5));
        let r = 0.01 + 100.0 * f(0.569_840_291).powi(3);
        let circle = Shape::Circle { r_px: r };
        assert!((circle_sum(&ones, x, y, r) / circle.area_px() - 1.0).abs() < 1e-11, "r {r} at {x} {y}"); // rounding
        let (b_px, theta_rad) = (r * (0.02 + 0.98 * f(0.414_213_56)), 7.0 * f(0.732_050_8) - 3.5);
        let ellipse = Shape::Ellipse { a_px: r, b_px, theta_rad };
        assert!((shape_sum(&ones, &ellipse, x, y) / ellipse.area_px() - 1.0).abs() < 1e-10, "{ellipse:?} at {x} {y}");
    }
}

#[test]
fn fractions_are_within_0_and_1_and_each_pixel_comes_once_in_order() {
    let shape = Shape::Ellipse { a_px: 17.3, b_px: 3.1, theta_rad: 0.6 };
    let mut last = None;
    let mut whole = 0;
    for_each_pixel(&shape, 40.2, 41.7, Bounds { x0: 0, x1: 100, y0: 0, y1: 100 }, |i, j, fraction| {
        assert!(fraction > 0.0 && fraction <= 1.0);
        assert!(last < Some((j, i)), "{j} {i} after {last:?}");
        last = Some((j, i));
        if fraction == 1.0 {
            whole += 1;
            for (u, v) in [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)] {
                assert!(shape.contains(i as f64 + u - 40.2, j as f64 + v - 41.7));
            }
        }
    });
    assert!(whole > 80, "{whole}");
}

#[test]
fn the_share_of_a_pixel_agrees_with_counting_points() {
    // 400² points: the count is right to about the perimeter over 400, 1e-2 at the very worst
    for (dx, dy, shape) in [
        (0.0, 0.0, Shape::Circle { r_px: 0.4 }),
        (0.3, 0.2, Shape::Circle { r_px: 0.6 }),
        (4.9, 0.3, Shape::Circle { r_px: 5.0 }),
        (3.4, 3.6, Shape::Circle { r_px: 5.0 }),
        (0.1, 0.2, Shape::Ellipse { a_px: 3.0, b_px: 0.1, theta_rad: 0.9 }),
        (0.0, 0.4, Shape::Ellipse { a_px: 0.45, b_px: 0.05, theta_rad: 1.5 }),
        (9.5, 0.1, Shape::Ellipse { a_px: 10.0, b_px: 4.0, theta_rad: 0.0 }),
    ] {
        let inside = (0..160_000)
            .filter(|k| {
                let (u, v) = ((f64::from(k % 400) + 0.5) / 400.0 - 0.5, (f64::from(k / 400) + 0.5) / 400.0 - 0.5);
                shape.contains(dx + u, dy + v)
            })
            .count();
        let share = shape.pixel_fraction(dx, dy);
        assert!((share - inside as f64 / 160_000.0).abs() < 5e-3, "{shape:?} at {dx} {dy}: {share}");
    }
}

#[test]
fn off_the_frame_or_without_area_nothing_is_visited() {
    let bounds = Bounds { x0: 10, x1: 20, y0: 10, y1: 20 };
    let count = |shape: Shape, x: f64, y: f64| {
        let mut n = 0;
        for_each_pixel(&shape, x, y, bounds, |i, j, _| {
            assert!((10..20).contains(&i) && (10..20).contains(&j));
            n += 1;
        });
        n
    };
    let circle = Shape::Circle { r_px: 3.0 };
    assert_eq!(count(circle, -50.0, 15.0), 0);
    assert_eq!(count(circle, 15.0, 1e12), 0);
    assert_eq!(count(circle, f64::NAN, 15.0), 0);
    assert_eq!(count(Shape::Circle { r_px: 0.0 }, 15.0, 15.0), 0);
    assert_eq!(count(Shape::Circle { r_px: f64::NAN }, 15.0, 15.0), 0);
    assert_eq!(count(Shape::Ellipse { a_px: -2.0, b_px: 1.0, theta_rad: 0.0 }, 15.0, 15.0), 0);
    assert_eq!(count(Shape::Circle { r_px: 1e6 }, 15.0, 15.0), 100);
    assert!(count(circle, 9.0, 9.0) > 0);
}
