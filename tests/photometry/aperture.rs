//! Exact overlap of apertures with pixels: against photutils, sep and shapely, and against geometry.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene;

use ndarray::Array2;
use satphot::photometry::aperture::{Bounds, Shape, circle_sum, for_each_pixel, shape_sum};

/// The image of scripts/make_aperture_vectors.py.
fn formula_image() -> Array2<f64> {
    Array2::from_shape_fn((120, 160), |(j, i)| {
        let wave = (0.37 * i as f64).sin() * (0.23 * j as f64).cos();
        (1000.0 * (1.5 + wave + ((7 * i + 13 * j) % 17) as f64 / 17.0)).floor()
    })
}

fn shape_named(name: &str, a_px: f64, b_px: f64, theta_rad: f64) -> Shape {
    match name {
        "circle" => Shape::Circle { r_px: a_px },
        "ellipse" => Shape::Ellipse { a_px, b_px, theta_rad },
        "rectangle" => Shape::Rectangle { a_px, b_px, theta_rad },
        "pill" => Shape::Pill { a_px, b_px, theta_rad },
        other => panic!("no shape {other}"),
    }
}

const NAMES: [&str; 4] = ["circle", "ellipse", "rectangle", "pill"];

#[test]
fn sums_are_those_of_photutils_sep_and_shapely() {
    let image = formula_image();
    let (mut n, mut worst) = ([0; 3], [0f64; 3]);
    for line in include_str!("../data/aperture_vectors.csv").lines().skip(2) {
        let cell: Vec<&str> = line.split(',').collect();
        let number = |k: usize| -> f64 { cell[k].parse().unwrap() };
        let shape = shape_named(cell[0], number(3), number(4), number(5));
        let sum = shape_sum(&image, &shape, number(1), number(2));
        for (k, column) in (6..9).enumerate() {
            if !cell[column].is_empty() {
                let difference = (sum / number(column) - 1.0).abs();
                worst[k] = worst[k].max(difference);
                n[k] += 1;
                // sep and shapely's caps are right to 1e-9
                assert!(difference < 1e-8, "peer {k}: {line}: {sum}");
            }
        }
    }
    println!("sums {n:?} of photutils, sep, shapely; worst |ours/theirs - 1| = {worst:?}");
    assert!(n[0] >= 200 && n[1] >= 190 && n[2] >= 100, "{n:?}");
}

#[test]
fn a_flat_field_of_one_sums_to_the_area() {
    let ones = Array2::from_elem((340, 340), 1.0);
    for k in 0..2000 {
        // a low-discrepancy walk over centres, radii and shapes
        let f = |a: f64| (f64::from(k) * a).fract();
        let (x, y) = (170.0 + 40.0 * (f(0.618_033_988_7) - 0.5), 170.0 + 40.0 * (f(0.754_877_666_2) - 0.5));
        let r = 0.01 + 100.0 * f(0.569_840_291).powi(3);
        let circle = Shape::Circle { r_px: r };
        assert!((circle_sum(&ones, x, y, r) / circle.area_px() - 1.0).abs() < 1e-11, "r {r} at {x} {y}"); // rounding
        let (b_px, theta_rad) = (r * (0.02 + 0.98 * f(0.414_213_56)), 7.0 * f(0.732_050_8) - 3.5);
        for name in &NAMES[1..] {
            let shape = shape_named(name, r, b_px, theta_rad);
            // 1e-12, but thin ellipses, mapped to the disc, lose a digit or two
            let tolerance = if *name == "ellipse" { 1e-10 } else { 2e-12 };
            let ratio = shape_sum(&ones, &shape, x, y) / shape.area_px();
            assert!((ratio - 1.0).abs() < tolerance, "{shape:?} at {x} {y}: {ratio:e}");
        }
    }
}

#[test]
fn fractions_are_within_0_and_1_and_each_pixel_comes_once_in_order() {
    for name in NAMES {
        let shape = shape_named(name, 17.3, 3.1, 0.6);
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
        assert!(whole > 80, "{name} {whole}");
    }
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
        (0.1, 0.2, Shape::Rectangle { a_px: 3.0, b_px: 0.1, theta_rad: 0.9 }),
        (0.0, 0.1, Shape::Rectangle { a_px: 0.45, b_px: 0.2, theta_rad: 0.7 }),
        (6.9, 4.2, Shape::Rectangle { a_px: 8.0, b_px: 0.8, theta_rad: 0.55 }),
        (0.1, 0.2, Shape::Pill { a_px: 3.0, b_px: 0.1, theta_rad: 0.9 }),
        (0.2, 0.1, Shape::Pill { a_px: 0.45, b_px: 0.2, theta_rad: 0.7 }),
        (6.9, 4.2, Shape::Pill { a_px: 8.0, b_px: 0.8, theta_rad: 0.55 }),
        (-9.0, 2.0, Shape::Pill { a_px: 10.0, b_px: 3.0, theta_rad: -0.1 }),
    ] {
        let (share, counted) = (shape.pixel_fraction(dx, dy), shape.subpixel_fraction(dx, dy, 400));
        assert!((share - counted).abs() < 5e-3, "{shape:?} at {dx} {dy}: {share} {counted}");
    }
}

#[test]
fn counting_subpixels_converges_to_the_exact_share_for_every_shape() {
    // rms over 2000 pixels of the outline; by points the error falls at least as 1/n (n = 4 to 64: a factor 16)
    for name in NAMES {
        let shape = shape_named(name, 9.0, 3.5, 0.4);
        let rms = |n: usize| -> f64 {
            let square: f64 = (0..2000)
                .map(|k| {
                    let f = |a: f64| (f64::from(k) * a).fract();
                    let (dx, dy) = (22.0 * (f(0.618_033_988_7) - 0.5), 22.0 * (f(0.754_877_666_2) - 0.5));
                    (shape.subpixel_fraction(dx, dy, n) - shape.pixel_fraction(dx, dy)).powi(2)
                })
                .sum();
            (square / 2000.0).sqrt()
        };
        let (coarse, fine) = (rms(4), rms(64));
        assert!(fine < coarse / 16.0 && fine < 1e-3 && coarse > 1e-3, "{name}: {coarse:e} {fine:e}");
    }
}

/// Sum over the formula image turned by 90° about (60, 60) of the square 0..=120.
fn turned_image(turn: bool) -> Array2<f64> {
    let image = |i: usize, j: usize| ((i * 37 + j * 101 + i * j) % 211) as f64;
    Array2::from_shape_fn((121, 121), |(j, i)| if turn { image(j, 120 - i) } else { image(i, j) })
}

#[test]
fn turning_image_and_shape_by_90_degrees_or_moving_both_changes_nothing() {
    let (image, turned) = (turned_image(false), turned_image(true));
    for name in NAMES {
        for k in 0..200 {
            let f = |a: f64| (f64::from(k) * a).fract();
            let (dx, dy) = (30.0 * (f(0.618_033_988_7) - 0.5), 30.0 * (f(0.754_877_666_2) - 0.5));
            let (a, b, theta) =
                (0.2 + 30.0 * f(0.569_840_291), 0.1 + 8.0 * f(0.414_213_56), 6.0 * f(0.732_050_8) - 3.0);
            let here = shape_sum(&image, &shape_named(name, a, b, theta), 60.0 + dx, 60.0 + dy);
            let quarter = theta + std::f64::consts::FRAC_PI_2;
            let there = shape_sum(&turned, &shape_named(name, a, b, quarter), 60.0 - dy, 60.0 + dx);
            assert!((here / there - 1.0).abs() < 1e-10, "{name} {a} {b} {theta}: {here} {there}");
        }
        // moved by whole pixels, bit for bit where the position has digits to spare
        let shape = shape_named(name, 9.5, 2.25, 0.4);
        let row = |x: f64, y: f64, x0: usize| {
            let mut all = Vec::new();
            let bounds = Bounds { x0, x1: x0 + 100, y0: 2 * x0, y1: 2 * x0 + 100 };
            for_each_pixel(&shape, x, y, bounds, |i, j, fraction| all.push((i - x0, j - 2 * x0, fraction)));
            all
        };
        assert_eq!(row(50.25, 48.5, 0), row(50.25 + 512.0, 48.5 + 1024.0, 512), "{name}");
    }
}

#[test]
fn a_pill_without_a_core_is_a_circle_and_shapes_without_width_are_nothing() {
    let image = formula_image();
    for (x, y, r) in [(80.0, 60.0, 0.3), (80.3, 60.9, 5.0), (71.1, 44.4, 33.0), (-3.0, 2.0, 12.0)] {
        let circle = shape_sum(&image, &Shape::Circle { r_px: r }, x, y);
        for (b_px, theta_rad) in [(r, 0.0), (r, 1.1), (2.0 * r, 0.3)] {
            let pill = shape_sum(&image, &Shape::Pill { a_px: r, b_px, theta_rad }, x, y);
            assert!((pill / circle - 1.0).abs() < 1e-12, "{r} {b_px} {theta_rad}: {pill} {circle}");
        }
        // an upright square over whole pixels is their plain sum
        let square = Shape::Rectangle { a_px: 2.5, b_px: 1.5, theta_rad: 0.0 };
        let plain: f64 = (58..63).map(|i| (39..42).map(|j| image[[j, i]]).sum::<f64>()).sum();
        assert!((shape_sum(&image, &square, 60.0, 40.0) - plain).abs() < 1e-9);
    }
    for name in ["rectangle", "pill", "ellipse"] {
        assert_eq!(shape_sum(&image, &shape_named(name, 10.0, 0.0, 0.3), 80.0, 60.0), 0.0);
        assert_eq!(shape_sum(&image, &shape_named(name, 10.0, f64::NAN, 0.3), 80.0, 60.0), 0.0);
        assert_eq!(shape_sum(&image, &shape_named(name, f64::INFINITY, 1.0, 0.3), 80.0, 60.0), 0.0);
        assert_eq!(shape_sum(&image, &shape_named(name, 10.0, 3.0, f64::NAN), 80.0, 60.0), 0.0);
    }
}

#[test]
fn a_shape_inside_another_covers_no_more_of_any_pixel() {
    for (a, b, theta) in [(12.0, 4.0, 0.3), (0.8, 0.3, 1.2), (40.0, 0.4, -0.9), (7.0, 7.0, 0.0)] {
        // ellipse ⊂ pill ⊂ rectangle ⊂ grown rectangle; every shape ⊂ itself grown ⊂ its bounding circle
        let nested = ["ellipse", "pill", "rectangle"].map(|name| shape_named(name, a, b, theta));
        let mut pairs = vec![(nested[0], nested[1]), (nested[1], nested[2])];
        for shape in nested {
            pairs.push((shape, shape.grown(0.37)));
            pairs.push((shape, Shape::Circle { r_px: shape.bounding_radius_px() }));
            pairs.push((shape.grown(-0.1), shape));
        }
        for (small, large) in pairs {
            for k in 0..3000 {
                let f = |a: f64| (f64::from(k) * a).fract();
                let reach = 2.2 * a + 3.0;
                let (dx, dy) = (reach * (f(0.618_033_988_7) - 0.5), reach * (f(0.754_877_666_2) - 0.5));
                let (inner, outer) = (small.pixel_fraction(dx, dy), large.pixel_fraction(dx, dy));
                assert!(inner <= outer + 1e-12, "{small:?} in {large:?} at {dx} {dy}: {inner} {outer}");
            }
        }
    }
}

#[test]
fn shapes_ten_thousand_pixels_long_or_a_thousandth_wide_keep_their_area() {
    let bounds = Bounds { x0: 0, x1: 25_000, y0: 0, y1: 25_000 };
    for (a, b) in [(1e4, 1e-3), (1e4, 0.7), (1e4, 30.0), (300.0, 1e-6), (1e-3, 1e-4), (0.2, 0.1)] {
        for theta in [0.0, 1e-7, 0.3, std::f64::consts::FRAC_PI_4, std::f64::consts::FRAC_PI_2, -1.4] {
            for name in ["rectangle", "pill"] {
                let shape = shape_named(name, a, b, theta);
                let mut sum = 0.0;
                for_each_pixel(&shape, 12_500.3, 12_499.6, bounds, |_, _, fraction| sum += fraction);
                // a position of 1e4 px is known to 2e-12 px: that over the width, and rounding
                let tolerance = 1e-11 + 4e-12 / b;
                assert!((sum / shape.area_px() - 1.0).abs() < tolerance, "{shape:?}: {sum} {}", shape.area_px());
            }
        }
    }
}

#[test]
fn shares_from_areas_under_the_arc_are_those_of_polygons_clipped_by_the_disc() {
    let bounds = Bounds { x0: 0, x1: 2500, y0: 0, y1: 2500 };
    for k in 0..400 {
        let f = |a: f64| (f64::from(k) * a).fract();
        let b_px = 2.0 + 30.0 * f(0.569_840_291).powi(2);
        let a_px = b_px * if k % 4 == 0 { 1.0 } else { 1.0 + 20.0 * f(0.414_213_56).powi(3) };
        let shape = if a_px == b_px {
            Shape::Circle { r_px: a_px }
        } else {
            // every fifth along an axis
            let theta_rad = if k % 5 == 0 { std::f64::consts::FRAC_PI_2 } else { 7.0 * f(0.732_050_8) - 3.5 };
            Shape::Ellipse { a_px, b_px, theta_rad }
        };
        // every third centre on a corner or an edge of the grid, where arcs touch it
        let centre = |a: f64| 1200.0 + if k % 3 == 0 { (2.0 * f(a)).floor() * 0.5 } else { f(a) };
        let (x, y) = (centre(0.618_033_988_7), centre(0.754_877_666_2));
        // the polygon's sectors are right to rounding of the whole area, ours to that of a row
        let tolerance = 1e-14 + 1e-15 * a_px * b_px;
        let (mut area, mut last) = (0.0, None);
        for_each_pixel(&shape, x, y, bounds, |i, j, fraction| {
            let polygon = shape.pixel_fraction(i as f64 - x, j as f64 - y);
            assert!((fraction - polygon).abs() < tolerance, "{shape:?} at {x} {y}, {i} {j}: {fraction} {polygon}");
            assert!(last < Some((j, i)));
            last = Some((j, i));
            area += fraction;
        });
        assert!((area / shape.area_px() - 1.0).abs() < 1e-13, "{shape:?} at {x} {y}: {area}");
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
    for name in NAMES {
        let shape = |theta| shape_named(name, 3.0, 2.0, theta);
        assert_eq!(count(shape(0.4), -50.0, 15.0), 0, "{name}");
        assert_eq!(count(shape(0.4), 15.0, -1e12), 0, "{name}");
        assert_eq!(count(shape(0.4), 15.0, f64::NAN), 0, "{name}");
        assert!(count(shape(0.4), 9.0, 9.0) > 0, "{name}");
        assert_eq!(count(shape_named(name, 1e6, 1e6, 1.0), 15.0, 15.0), 100, "{name}");
    }
    assert!(count(circle, 9.0, 9.0) > 0);
}

#[test]
fn one_neighbour_of_350_px_in_the_annulus_leaves_its_sky_within_1_percent() {
    // where a mean annulus is wrong by 71 000 e⁻ in the aperture: 350 px at +3000 on a sky of 100 ± 10
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use satphot::photometry::background::background;
    use satphot::photometry::flux::measure;
    let noise = Normal::new(100.0, 10.0).unwrap();
    for seed in 0..10 {
        let mut rng = rand_chacha::ChaCha12Rng::seed_from_u64(seed);
        let mut pixels = Array2::from_shape_fn((400, 400), |_| noise.sample(&mut rng) as f32);
        for j in 195..230 {
            for i in 215..225 {
                pixels[[j, i]] += 3000.0;
            }
        }
        let frame = photometry_scene::frame(pixels, 0.0);
        let sky = background(&frame, 64, 3.0).unwrap();
        let got = measure(&frame, &sky, 200.0, 200.0, Shape::Circle { r_px: 8.0 }, 12.0, 30.0, 3.0);
        assert!((got.sky_e_px - 100.0).abs() < 1.0, "seed {seed}: {}", got.sky_e_px);
        assert!(got.flags.has(satphot::photometry::Flags::CROWDED_ANNULUS));
    }
}
