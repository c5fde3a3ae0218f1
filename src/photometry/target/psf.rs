//! The point-spread function of a frame as pixels see it, for a point and for discs of up to 3 FWHM.
//!
//! Pixels; shares of the whole light per pixel. Tabled over the radius once per frame, integrated over each pixel by
//! Gauss and Legendre. It does not cover elongated images: tracking that smears stars is not known to the target's frame.

use crate::photometry::growth::{Radial, StarProfile};

/// Steps of the tables per FWHM; linear between them, which is right to 1e-4 of the peak.
const STEPS_PER_FWHM: f64 = 80.0;
/// Radius of the circle of pixels that carry weight \[FWHM\]: beyond it a point gains less than 1 %.
pub(crate) const REACH_FWHM: f64 = 2.0;
/// Diameter of the disc \[FWHM\]: with it and the point, the light of discs of 0 to 1 FWHM is right to 0.4 %.
pub(crate) const DISC_FWHM: f64 = 1.0;
/// Diameters of the discs \[FWHM\] with which the light of discs of 1 to 3 FWHM is right to 0.9 % and that of bars as long to 1.3 %, for
/// Gaussians and Moffat profiles of β = 2.5 to 4.5; and the radius of the circle of pixels for that \[FWHM\].
pub(crate) const WIDE_FWHM: [f64; 3] = [1.1, 2.0, 2.9];
pub(crate) const WIDE_REACH_FWHM: f64 = 3.0;
/// Steps of their tables per FWHM: they are smoother.
const WIDE_STEPS_PER_FWHM: f64 = 20.0;
/// Below this FWHM \[px\] a pixel needs three nodes to a side, which are right to 1e-4 at 1.5 px; above, two.
const SHARP_FWHM_PX: f64 = 4.0;
/// Nodes and weights on −½ to ½ (Abramowitz & Stegun 1964, table 25.4).
const TWO: [(f64, f64); 2] = [(-0.288_675_134_594_812_9, 0.5), (0.288_675_134_594_812_9, 0.5)];
const THREE: [(f64, f64); 3] =
    [(-0.387_298_334_620_741_7, 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.387_298_334_620_741_7, 5.0 / 18.0)];
/// Rings of equal area and directions a disc is sampled at.
const DISC_RINGS: usize = 6;
const DISC_DIRECTIONS: usize = 12;

/// The point-spread function of a frame.
#[derive(Debug, Clone)]
pub(crate) struct Psf {
    pub fwhm_px: f64,
    reach_fwhm: f64,
    radial: Radial,
    point: Table,
    disc: Table,
}

/// Discs of [`WIDE_FWHM`] as pixels see them: made only where a source is so wide.
#[derive(Debug)]
pub(crate) struct WideDiscs([Table; 3]);

/// Light per px² at radii a step apart.
#[derive(Debug, Clone)]
struct Table {
    per_px: f64,
    values: Vec<f64>,
}

impl Table {
    fn of(per_px: f64, reach_px: f64, density: impl Fn(f64) -> f64) -> Self {
        let n = (reach_px * per_px).ceil() as usize + 2;
        Self { per_px, values: (0..n).map(|k| density(k as f64 / per_px)).collect() }
    }

    /// The value at a radius, and its slope.
    fn at(&self, r_px: f64) -> (f64, f64) {
        let place = r_px * self.per_px;
        let k = (place as usize).min(self.values.len() - 2);
        let step = self.values[k + 1] - self.values[k];
        (self.values[k] + (place - k as f64) * step, step * self.per_px)
    }
}

/// What a pixel holds of sources of light 1.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Share {
    /// Of a point.
    pub point: f64,
    /// Of a disc of [`DISC_FWHM`].
    pub disc: f64,
    /// Change of that of the point where the source moves by a pixel along x and y.
    pub by_place: [f64; 2],
}

impl Psf {
    /// The star profile at a width; a Gaussian where the night gives no profile.
    pub fn new(profile: Option<&StarProfile>, fwhm_px: f64) -> Self {
        let radial = profile.map_or_else(|| Radial::new(0.0, fwhm_px), |p| p.radial(fwhm_px));
        let point = Table::of(STEPS_PER_FWHM / fwhm_px, corner_px(REACH_FWHM, fwhm_px), |r| radial.density(r));
        let disc = disc_table(&radial, fwhm_px, DISC_FWHM, (STEPS_PER_FWHM, REACH_FWHM));
        Self { fwhm_px, reach_fwhm: REACH_FWHM, radial, point, disc }
    }

    /// The discs that a wide source is a sum of.
    pub fn wide_discs(&self) -> WideDiscs {
        let grid = (WIDE_STEPS_PER_FWHM, WIDE_REACH_FWHM);
        WideDiscs(WIDE_FWHM.map(|diameter| disc_table(&self.radial, self.fwhm_px, diameter, grid)))
    }

    /// A disc of this diameter seen through it, in the place of the point: where a wide source is.
    pub fn of_disc(&self, diameter_fwhm: f64) -> Self {
        let point = disc_table(&self.radial, self.fwhm_px, diameter_fwhm, (WIDE_STEPS_PER_FWHM, WIDE_REACH_FWHM));
        Self { point, reach_fwhm: WIDE_REACH_FWHM, ..self.clone() }
    }

    /// Radius of the circle that carries weight \[px\].
    pub fn reach_px(&self) -> f64 {
        self.reach_fwhm * self.fwhm_px
    }

    /// Shares of the pixel whose centre is (`dx`, `dy`) from the source \[px\].
    pub fn share(&self, dx: f64, dy: f64) -> Share {
        if self.fwhm_px < SHARP_FWHM_PX { self.integrated(&THREE, dx, dy) } else { self.integrated(&TWO, dx, dy) }
    }

    fn integrated(&self, nodes: &[(f64, f64)], dx: f64, dy: f64) -> Share {
        let mut share = Share::default();
        for &(v, b) in nodes {
            for &(u, a) in nodes {
                let (x, y, weight) = (dx + u, dy + v, a * b);
                let r = x.hypot(y);
                let (value, slope) = self.point.at(r);
                share.point += weight * value;
                share.disc += weight * self.disc.at(r).0;
                if r > 0.0 {
                    share.by_place[0] -= weight * slope * x / r;
                    share.by_place[1] -= weight * slope * y / r;
                }
            }
        }
        share
    }

    /// Mean light per pixel between two radii about a point.
    pub fn mean_between(&self, inner_px: f64, outer_px: f64) -> f64 {
        if outer_px > inner_px { self.radial.mean_between(inner_px, outer_px) } else { 0.0 }
    }
}

impl WideDiscs {
    /// What the pixel whose centre is (`dx`, `dy`) from the source holds of each \[px\].
    pub fn share(&self, dx: f64, dy: f64) -> [f64; 3] {
        let mut share = [0.0; 3];
        for (v, b) in TWO {
            for (u, a) in TWO {
                let r = (dx + u).hypot(dy + v);
                share.iter_mut().zip(&self.0).for_each(|(s, table)| *s += a * b * table.at(r).0);
            }
        }
        share
    }
}

/// How far the corner of a square of pixels around a circle is from its middle \[px\].
fn corner_px(reach_fwhm: f64, fwhm_px: f64) -> f64 {
    std::f64::consts::SQRT_2 * (reach_fwhm * fwhm_px + 2.0)
}

/// A disc seen through the point-spread function.
fn disc_table(radial: &Radial, fwhm_px: f64, diameter_fwhm: f64, (steps_per_fwhm, reach_fwhm): (f64, f64)) -> Table {
    let points = disc_points(0.5 * diameter_fwhm * fwhm_px);
    let blurred = |r: f64| points.iter().map(|(x, y)| radial.density((r - x).hypot(*y))).sum::<f64>();
    Table::of(steps_per_fwhm / fwhm_px, corner_px(reach_fwhm, fwhm_px), |r| blurred(r) / points.len() as f64)
}

/// Points of equal weight spread evenly over a disc.
fn disc_points(r_px: f64) -> Vec<(f64, f64)> {
    (0..DISC_RINGS)
        .flat_map(|ring| {
            let rho = r_px * ((ring as f64 + 0.5) / DISC_RINGS as f64).sqrt();
            (0..DISC_DIRECTIONS).map(move |k| {
                let angle = std::f64::consts::TAU * (k as f64 + 0.5 * (ring % 2) as f64) / DISC_DIRECTIONS as f64;
                (rho * angle.cos(), rho * angle.sin())
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pixels of a square about the source, off the middle of a pixel.
    fn sum(psf: &Psf, half: i32, of: impl Fn(&Share, f64, f64) -> f64) -> f64 {
        let (x, y) = (0.3, -0.2);
        let at = |i: i32, j: i32| (f64::from(i) - x, f64::from(j) - y);
        let pixels = (-half..=half).flat_map(|j| (-half..=half).map(move |i| at(i, j)));
        pixels.map(|(dx, dy)| of(&psf.share(dx, dy), dx, dy)).sum()
    }

    #[test]
    fn pixels_hold_all_light_and_their_moments_are_those_of_star_disc_and_pixel() {
        for fwhm in [1.5, 2.5, 4.0, 8.0] {
            let psf = Psf::new(None, fwhm);
            let half = (3.0 * fwhm) as i32;
            let sigma2 = (fwhm / crate::base::constants::FWHM_PER_SIGMA).powi(2);
            let point = sum(&psf, half, |s, _, _| s.point);
            let disc = sum(&psf, half, |s, _, _| s.disc);
            assert!((point - 1.0).abs() < 1e-3 && (disc - 1.0).abs() < 1e-3, "{fwhm}: {point} {disc}");
            let xx = |of: &dyn Fn(&Share) -> f64| sum(&psf, half, |s, dx, _| of(s) * dx * dx);
            let (own, wider) = (xx(&|s| s.point), xx(&|s| s.disc));
            // the nodes move the pixel's own 1/12 as little as the light
            assert!((own / (sigma2 + 1.0 / 12.0) - 1.0).abs() < 3e-3, "{fwhm}: {own}");
            // of an even disc: D²/16 along each axis
            assert!(((wider - own) / (fwhm * fwhm / 16.0) - 1.0).abs() < 0.01, "{fwhm}: {}", wider - own);
        }
    }

    #[test]
    fn three_profiles_hold_the_light_of_discs_and_bars_up_to_three_widths() {
        use nalgebra::{SMatrix, SVector};
        for profile in [None, Some(StarProfile::moffat(3.0))] {
            let psf = Psf::new(profile.as_ref(), 5.0);
            let discs = psf.wide_discs();
            // of a point, further out than its own table reaches
            let far = Table::of(STEPS_PER_FWHM / 5.0, 40.0, |r| psf.radial.density(r));
            let point = |dx: f64, dy: f64| {
                let at = |(u, a): (f64, f64), (v, b): (f64, f64)| a * b * far.at((dx + u).hypot(dy + v)).0;
                TWO.iter().flat_map(|u| TWO.iter().map(move |v| at(*u, *v))).sum::<f64>()
            };
            let reach = WIDE_REACH_FWHM * psf.fwhm_px;
            let half = reach as i32 + 1;
            let places = (-half..=half).flat_map(|j| (-half..=half).map(move |i| (f64::from(i), f64::from(j))));
            let places: Vec<(f64, f64)> = places.filter(|(x, y)| x.hypot(*y) <= reach).collect();
            let shares: Vec<SVector<f64, 3>> = places.iter().map(|(x, y)| SVector::from(discs.share(*x, *y))).collect();
            let normal = shares.iter().fold(SMatrix::<f64, 3, 3>::zeros(), |n, s| n + s * s.transpose());
            let weights = normal.cholesky().unwrap().inverse() * SVector::repeat(1.0);
            // sources as sums of points
            let light = |points: &[(f64, f64)]| -> f64 {
                let of = |(x, y): &(f64, f64)| points.iter().map(|(u, v)| point(x - u, y - v)).sum::<f64>();
                places.iter().zip(&shares).map(|(at, s)| weights.dot(s) * of(at)).sum::<f64>() / points.len() as f64
            };
            for diameter in [1.0, 1.25, 1.5, 2.0, 2.5, 3.0] {
                let off = light(&disc_points(0.5 * diameter * psf.fwhm_px)) - 1.0;
                assert!(off.abs() < 0.009, "disc {diameter}: {off}");
            }
            for length in [1.0, 2.0, 3.0] {
                let bar: Vec<_> =
                    (0..40).map(|k| (psf.fwhm_px * length * ((f64::from(k) + 0.5) / 40.0 - 0.5), 0.0)).collect();
                let off = light(&bar) - 1.0;
                assert!(off.abs() < 0.015, "bar {length}: {off}");
            }
        }
    }

    #[test]
    fn the_derivative_by_place_is_that_of_the_shares() {
        let psf = Psf::new(Some(&StarProfile::moffat(3.0)), 3.0);
        for (dx, dy) in [(0.4, 0.1), (1.3, -2.0), (4.0, 3.0)] {
            let at = |ex: f64, ey: f64| psf.share(dx - ex, dy - ey).point;
            let by = psf.share(dx, dy).by_place;
            let (x, y) = ((at(0.05, 0.0) - at(-0.05, 0.0)) / 0.1, (at(0.0, 0.05) - at(0.0, -0.05)) / 0.1);
            assert!((by[0] - x).abs() < 2e-3 && (by[1] - y).abs() < 2e-3, "{by:?} {x} {y}");
        }
    }
}
