//! What a sky's surface gets wrong along the trails: with many of them, no surface can be fitted through the gaps.
//!
//! Electrons per pixel; u along the trails, v across, in cells of a cutout. A trail adds the same to all of its line, so
//! how the blocks of one line differ among themselves is sky alone, however many trails there are. What changes across
//! the trails only stays in the levels of the lines. It does not cover trails that end, but for a clip.

use nalgebra::Vector3;
use ndarray::Array2;

use crate::photometry::target::sky::parabola;
use crate::photometry::trails::direction::Turned;

/// a U + b U² + c U V with U = u/h, V = v/h, h half the diagonal of the cutout.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bend {
    pub(super) turned: Turned,
    pub(super) half: f64,
    pub(super) terms: Vector3<f64>,
}

impl Bend {
    pub(super) fn terms_at(&self, u: f64, v: f64) -> Vector3<f64> {
        let (u, v) = (u / self.half, v / self.half);
        Vector3::new(u, u * u, u * v)
    }

    /// Its value at a place along and across the trails \[e⁻/px\].
    pub fn at_uv(&self, u: f64, v: f64) -> f64 {
        self.terms.dot(&self.terms_at(u, v))
    }

    /// Its value at a cell \[e⁻/px\].
    pub fn at(&self, x: f64, y: f64) -> f64 {
        let (u, v) = self.turned.uv(x, y);
        self.at_uv(u, v)
    }

    /// Subtracts it from an image of cells.
    pub fn subtract_from(&self, image: &mut Array2<f32>) {
        let (ny, nx) = image.dim();
        let mut bend = vec![0f32; nx];
        for j in 0..ny {
            // a parabola along each row, from three of its cells
            let y = j as f64;
            let (a, p, m) = (self.at(0.0, y), self.at(1.0, y), self.at(-1.0, y));
            parabola([a, 0.5 * (p - m), 0.5 * (p + m) - a], 0.0, 1.0, &mut bend);
            image.row_mut(j).iter_mut().zip(&bend).for_each(|(v, b)| *v -= b);
        }
    }
}
