//! Rows of the spline against cubics evaluated point by point, and the floor under them.

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::*;

fn curvature(values: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; values.len()];
    natural_curvature(ndarray::aview1(values), &mut out, &mut Vec::new());
    out
}

fn cubic(values: &[f64], curvature: &[f64], position: f64) -> f64 {
    if values.len() == 1 {
        return values[0];
    }
    let (k, t) = interval(position, values.len());
    let u = 1.0 - t;
    u * values[k] + t * values[k + 1] + ((u * u * u - u) * curvature[k] + (t * t * t - t) * curvature[k + 1]) / 6.0
}

/// Natural splines along y through every column of nodes, then one along x through what they give.
fn plain(nodes: &Array2<f64>, x: f64, y: f64) -> f64 {
    let row: Vec<f64> = nodes
        .columns()
        .into_iter()
        .map(|c| {
            let column = c.to_vec();
            cubic(&column, &curvature(&column), y)
        })
        .collect();
    cubic(&row, &curvature(&row), x)
}

fn mesh(ny: usize, nx: usize, level: f64, seed: u64) -> Array2<f64> {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    Array2::from_shape_fn((ny, nx), |_| level * rng.random_range(0.8..1.2))
}

#[test]
fn rows_are_the_natural_splines_taken_point_by_point() {
    for (round, (ny, nx)) in [(7, 9), (1, 1), (1, 5), (5, 1), (2, 2), (3, 2), (12, 40)].into_iter().enumerate() {
        for level in [1e-3, 100.0, 1e12] {
            let nodes = mesh(ny, nx, level, round as u64);
            let spline = Spline::through(&nodes);
            for mesh_px in [8.0, 64.0, 100.0] {
                let mut row = vec![0f32; (nx as f64 * mesh_px) as usize];
                for y in [-0.5 + 0.5 / mesh_px, 0.0, 0.37, ny as f64 - 1.0, ny as f64 - 0.5] {
                    let x0 = -0.5 + 0.5 / mesh_px;
                    spline.row(y, x0, 1.0 / mesh_px, &mut row);
                    for (i, got) in row.iter().enumerate().step_by(3) {
                        let want = plain(&nodes, x0 + i as f64 / mesh_px, y);
                        // one rounding to f32
                        assert!((f64::from(*got) - want).abs() < 7e-8 * level * 1.5, "{ny}x{nx} {y} {i}: {got} {want}");
                        let point = spline.at(x0 + i as f64 / mesh_px, y);
                        assert!((point - want).abs() < 1e-12 * level, "{ny}x{nx} {y} {i}: {point} {want}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_part_of_a_row_holds_the_values_of_the_whole() {
    let spline = Spline::through(&mesh(6, 11, 50.0, 3));
    let step = 1.0 / 64.0;
    let mut whole = vec![0f32; 700];
    spline.row(2.2, -0.5, step, &mut whole);
    for (first, n) in [(0, 1), (31, 40), (32, 1), (95, 2), (96, 70), (600, 100)] {
        let mut part = vec![0f32; n];
        spline.row(2.2, -0.5 + first as f64 * step, step, &mut part);
        assert_eq!(part, whole[first..first + n]);
    }
}

#[test]
fn nothing_lies_below_the_floor_and_the_floor_is_near() {
    for (seed, (ny, nx)) in [(10, 15), (1, 1), (2, 3), (1, 8), (9, 1)].into_iter().enumerate() {
        let nodes = mesh(ny, nx, 10.0, seed as u64);
        let spline = Spline::through(&nodes);
        let (top, right) = (ny as f64 - 0.5, nx as f64 - 0.5);
        for (ys, xs) in [(-0.5..=top, -0.5..=right), (0.0..=0.5 * top, 0.2..=0.3), (top - 0.7..=top, -0.5..=0.4)] {
            let floor = spline.floor_over(xs.clone(), ys.clone());
            let mut least = f64::INFINITY;
            for a in 0..=60 {
                for b in 0..=60 {
                    let (y, x) = (
                        ys.start() + (ys.end() - ys.start()) * f64::from(a) / 60.0,
                        xs.start() + (xs.end() - xs.start()) * f64::from(b) / 60.0,
                    );
                    least = least.min(plain(&nodes, x, y));
                }
            }
            assert!(floor <= least + 1e-9, "{ny}x{nx}: {floor} {least}");
        }
    }
    // scatter of 2 % from box to box, as in a frame
    let even = Spline::through(&mesh(9, 9, 10.0, 1).mapv(|v| 10.0 + 0.1 * (v - 10.0)));
    assert!(even.floor_over(2.0..=6.0, 2.0..=6.0) > 9.0);
    assert!(even.floor_over(-0.5..=6.0, -0.5..=6.0) > 5.0);
}
