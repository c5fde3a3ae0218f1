//! A shift, a turn and a scale of the plane.

use nalgebra::Complex;

pub(super) type C = Complex<f64>;

/// w = m z + b, or w = m z̄ + b: pixels from the frame's centre to arcseconds on the tangent plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Similarity {
    pub(super) m: C,
    pub(super) b: C,
    pub(super) conjugate: bool,
}

impl Similarity {
    /// Where a pixel is on the plane \[arcsec\].
    pub fn apply(&self, at: (f64, f64)) -> (f64, f64) {
        let z = C::new(at.0, if self.conjugate { -at.1 } else { at.1 });
        let w = self.m * z + self.b;
        (w.re, w.im)
    }
    /// Scale \[arcsec/px\].
    pub fn scale(&self) -> f64 {
        self.m.norm()
    }

    /// Least squares on three pairs: m = Σ z̄ w / Σ |z|² about the means.
    pub(super) fn of(pixels: [C; 3], places: [C; 3], conjugate: bool) -> Similarity {
        let z = pixels.map(|p| if conjugate { p.conj() } else { p });
        let (zc, wc) = ((z[0] + z[1] + z[2]) / 3.0, (places[0] + places[1] + places[2]) / 3.0);
        let (mut sum, mut norm) = (C::new(0.0, 0.0), 0.0);
        for (z, w) in z.iter().zip(&places) {
            sum += (z - zc).conj() * (w - wc);
            norm += (z - zc).norm_sqr();
        }
        let m = sum / norm;
        Similarity { m, b: wc - m * zc, conjugate }
    }
}
