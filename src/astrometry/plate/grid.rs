//! Points of a plane sorted into square cells, so that those near a place are found without looking at the others.

/// Points by cell.
#[derive(Debug)]
pub(super) struct Grid {
    cell: f64,
    origin: (f64, f64),
    columns: usize,
    rows: usize,
    /// First item of each cell, and the end.
    start: Vec<u32>,
    /// (x, y, index of the point), cell by cell.
    items: Vec<(f64, f64, u32)>,
}

impl Grid {
    /// Sorts finite points into cells of at least `cell`, larger where there would be more than four cells to a point.
    pub fn new(points: &[(f64, f64)], cell: f64) -> Grid {
        let span = |f: fn(&(f64, f64)) -> f64| {
            points.iter().map(f).fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)))
        };
        let ((x0, x1), (y0, y1)) = (span(|p| p.0), span(|p| p.1));
        let (wide, high) = ((x1 - x0).max(0.0), (y1 - y0).max(0.0));
        let most = (4 * points.len() + 16) as f64;
        let cell = cell.max((wide * high / most).sqrt()).max((wide + high) / most).max(f64::MIN_POSITIVE);
        let count = |length: f64| (length / cell).floor().min(most) as usize + 1;
        let (columns, rows) = (count(wide), count(high));
        let mut grid =
            Grid { cell, origin: (x0, y0), columns, rows, start: vec![0; columns * rows + 1], items: Vec::new() };
        let at: Vec<usize> = points.iter().map(|p| grid.row(p.1) * columns + grid.column(p.0)).collect();
        for &c in &at {
            grid.start[c + 1] += 1;
        }
        for c in 0..columns * rows {
            grid.start[c + 1] += grid.start[c];
        }
        let mut next = grid.start.clone();
        grid.items = vec![(0.0, 0.0, 0); points.len()];
        for (i, (&c, p)) in at.iter().zip(points).enumerate() {
            grid.items[next[c] as usize] = (p.0, p.1, i as u32);
            next[c] += 1;
        }
        grid
    }

    // a float cast saturates: below the grid is its first cell, beyond it the last
    fn column(&self, x: f64) -> usize {
        (((x - self.origin.0) / self.cell) as usize).min(self.columns - 1)
    }
    fn row(&self, y: f64) -> usize {
        (((y - self.origin.1) / self.cell) as usize).min(self.rows - 1)
    }

    /// (index, squared distance) of the points within `r` of a place, in an order that depends on the points alone.
    pub fn near(&self, x: f64, y: f64, r: f64) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (left, right) = (self.column(x - r), self.column(x + r));
        (self.row(y - r)..=self.row(y + r)).flat_map(move |row| {
            let cells = row * self.columns + left..row * self.columns + right + 1;
            let items = self.start[cells.start] as usize..self.start[cells.end] as usize;
            self.items[items].iter().filter_map(move |&(px, py, i)| {
                let d2 = (px - x) * (px - x) + (py - y) * (py - y);
                (d2 <= r * r).then_some((i as usize, d2))
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    #[test]
    fn the_grid_finds_the_points_that_looking_at_all_of_them_finds() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let mut points: Vec<(f64, f64)> =
            (0..500).map(|_| (rng.random_range(-50.0..70.0), rng.random_range(3.0..9.0))).collect();
        points.push((1e9, -1e9)); // one far away must not cost memory
        for cell in [0.01, 1.0, 1000.0] {
            let grid = Grid::new(&points, cell);
            for _ in 0..200 {
                let (x, y, r) =
                    (rng.random_range(-80.0..90.0), rng.random_range(0.0..12.0), rng.random_range(0.0..9.0));
                let mut found: Vec<usize> = grid.near(x, y, r).map(|f| f.0).collect();
                found.sort_unstable();
                let all = |i: &usize| (points[*i].0 - x).powi(2) + (points[*i].1 - y).powi(2) <= r * r;
                assert_eq!(found, (0..points.len()).filter(all).collect::<Vec<_>>());
            }
        }
        assert_eq!(Grid::new(&[], 1.0).near(0.0, 0.0, 5.0).count(), 0);
        assert_eq!(Grid::new(&[(1.0, 1.0)], 1.0).near(0.0, 0.0, 5.0).next(), Some((0, 2.0)));
    }
}
