//! Levels along trails against the sum written out for every block.

use super::*;

/// A cutout with two trails, a bad corner and a bright object.
fn cutout() -> Array2<f32> {
    Array2::from_shape_fn((180, 230), |(j, i)| {
        let noise = ((j * 7919 + i * 104_729 + j * i * 31) % 1013) as f32 / 1013.0;
        let v = j as f32 - 0.3 * i as f32;
        let trail = if (v - 40.0).abs() < 4.0 || ((v - 80.0).abs() < 4.0 && i > 90) { 12.0 } else { 0.0 };
        let object = if (80..100).contains(&j) && (100..130).contains(&i) { 300.0 } else { 0.0 };
        if i + j < 50 { f32::NAN } else { noise + trail + object }
    })
}

#[test]
fn the_level_of_a_block_is_the_mean_near_the_median_of_its_neighbours_outside_the_exclusions() {
    let trail_background = TrailBackground::new(&cutout(), 0.3f64.atan(), 3.0, 0.3, 4.0);
    let exclusion =
        trail_background.exclusion((115.0, 90.0), Shape::Ellipse { a_px: 25.0, b_px: 15.0, theta_rad: 0.4 });
    for exclusions in [vec![], vec![exclusion]] {
        let (level, ..) = trail_background.levels(&exclusions);
        let (lines, blocks) = trail_background.mean.dim();
        let mut n_levels = 0;
        for q in 0..lines {
            let chords: Vec<_> = exclusions.iter().filter_map(|h| h.chord(q as f64 - trail_background.half)).collect();
            let free = |p: &usize| {
                let (from, to) = trail_background.range(*p);
                trail_background.mean[[q, *p]].is_finite() && !chords.iter().any(|c| to > c.0 && from < c.1)
            };
            let valid: Vec<usize> = (0..blocks).filter(free).collect();
            for p in 0..blocks {
                if valid.len() < 2 {
                    assert!(level[[q, p]].is_nan());
                    continue;
                }
                let before = valid.iter().filter(|k| **k < p).count();
                let own = usize::from(valid.contains(&p));
                let after = valid.len() - before - own;
                let side = if own == 1 { before.min(after).clamp(EDGE_BLOCKS, SIDE_BLOCKS) } else { SIDE_BLOCKS };
                let near = &valid[before - before.min(side)..before + own + after.min(side)];
                let mut values: Vec<f64> = near.iter().map(|k| f64::from(trail_background.mean[[q, *k]])).collect();
                let median = stats::median(&mut values).unwrap();
                let limit = CLIP_SIGMA * (trail_background.variance(median) / trail_background.block as f64).sqrt();
                values.retain(|x| (x - median).abs() <= limit);
                let wanted =
                    if values.is_empty() { median } else { values.iter().sum::<f64>() / values.len() as f64 } as f32;
                // sums in another order
                assert!((level[[q, p]] - wanted).abs() <= 1e-6 * wanted.abs(), "{q} {p} {} {wanted}", level[[q, p]]);
                n_levels += 1;
            }
        }
        assert!(n_levels > 5000, "{n_levels}");
    }
}
