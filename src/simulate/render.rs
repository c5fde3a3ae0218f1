//! Expected electrons on the detector: stars, star trails and the satellite. Pixels, 0-based, electrons.

use ndarray::Array2;
use statrs::function::erf::erf;

use super::scenario::{Psf, PsfKind};
use crate::base::constants::FWHM_PER_SIGMA;

/// The PSF of one frame, in pixels.
#[derive(Debug, Clone, Copy)]
pub struct PixelPsf {
    /// Form.
    pub kind: PsfKind,
    /// FWHM \[px\].
    pub fwhm_px: f64,
    /// Moffat exponent.
    pub beta: f64,
}

impl PixelPsf {
    /// The scenario's PSF at a given pixel scale and airmass, `factor` times as wide.
    pub fn new(psf: &Psf, scale_arcsec: f64, airmass: f64, factor: f64) -> Self {
        // below the horizon nothing is seen
        let airmass = if airmass.is_finite() { airmass.powf(psf.airmass_exponent) } else { 1.0 };
        Self { kind: psf.kind, fwhm_px: psf.fwhm_arcsec / scale_arcsec * airmass * factor, beta: psf.moffat_beta }
    }

    fn sigma_px(&self) -> f64 {
        self.fwhm_px / FWHM_PER_SIGMA
    }

    /// Beyond this radius a star is not drawn \[px\]: 10⁻⁹ of a Gaussian, 10⁻⁴ of a β = 3.5 Moffat.
    fn reach_px(&self) -> f64 {
        match self.kind {
            PsfKind::Gaussian => 6.5 * self.sigma_px() + 1.0,
            PsfKind::Moffat => 12.0 * self.fwhm_px + 1.0,
        }
    }

    fn alpha_px(&self) -> f64 {
        self.fwhm_px / (2.0 * (2f64.powf(1.0 / self.beta) - 1.0).sqrt())
    }
}

/// Adds a point source of `flux_e` electrons, integrated over each pixel.
pub fn add_star(image: &mut Array2<f32>, psf: &PixelPsf, x_px: f64, y_px: f64, flux_e: f64) {
    let (ny, nx) = image.dim();
    let reach = psf.reach_px();
    let (Some((i0, i1)), Some((j0, j1))) = (span(x_px, reach, nx), span(y_px, reach, ny)) else { return };
    match psf.kind {
        PsfKind::Gaussian => {
            let share = |n0: usize, n1: usize, c: f64| -> Vec<f64> {
                let q = psf.sigma_px() * std::f64::consts::SQRT_2;
                (n0..=n1).map(|n| 0.5 * (erf((n as f64 + 0.5 - c) / q) - erf((n as f64 - 0.5 - c) / q))).collect()
            };
            let (gx, gy) = (share(i0, i1, x_px), share(j0, j1, y_px));
            for (j, gy) in (j0..=j1).zip(&gy) {
                for (i, gx) in (i0..=i1).zip(&gx) {
                    image[[j, i]] += (flux_e * gx * gy) as f32;
                }
            }
        }
        PsfKind::Moffat => {
            let alpha2 = psf.alpha_px().powi(2);
            let peak = flux_e * (psf.beta - 1.0) / (std::f64::consts::PI * alpha2);
            const SUB: usize = 5;
            for j in j0..=j1 {
                for i in i0..=i1 {
                    let mut sum = 0.0;
                    for s in 0..SUB * SUB {
                        let dx = i as f64 - x_px + ((s % SUB) as f64 + 0.5) / SUB as f64 - 0.5;
                        let dy = j as f64 - y_px + ((s / SUB) as f64 + 0.5) / SUB as f64 - 0.5;
                        sum += (1.0 + (dx * dx + dy * dy) / alpha2).powf(-psf.beta);
                    }
                    image[[j, i]] += (peak * sum / (SUB * SUB) as f64) as f32;
                }
            }
        }
    }
}

/// Adds the trail of a star that moves by (`dx_px`, `dy_px`) during the exposure, centred on (x, y).
///
/// Line of `flux_e / L` electrons per pixel of length, Gaussian across, sampled at pixel centres.
pub fn add_trail(image: &mut Array2<f32>, psf: &PixelPsf, centre: (f64, f64), (dx_px, dy_px): (f64, f64), flux_e: f64) {
    let length = dx_px.hypot(dy_px);
    if length < psf.fwhm_px * 0.1 {
        add_star(image, psf, centre.0, centre.1, flux_e);
        return;
    }
    let (ny, nx) = image.dim();
    let (ux, uy) = (dx_px / length, dy_px / length);
    let (sigma, reach) = (psf.sigma_px(), psf.reach_px());
    let q = sigma * std::f64::consts::SQRT_2;
    let peak = flux_e / length / (sigma * (2.0 * std::f64::consts::PI).sqrt());
    let y_reach = 0.5 * dy_px.abs() + reach;
    let Some((j0, j1)) = span(centre.1, y_reach, ny) else { return };
    for j in j0..=j1 {
        // columns where |across| <= reach: across = −uy (x − cx) + ux (y − cy)
        let dy = j as f64 - centre.1;
        let Some((i0, i1)) = (if uy.abs() > 1e-9 {
            span(centre.0 + ux * dy / uy, reach / uy.abs(), nx)
        } else {
            span(centre.0, 0.5 * length + reach, nx)
        }) else {
            continue;
        };
        for i in i0..=i1 {
            let dx = i as f64 - centre.0;
            let (along, across) = (ux * dx + uy * dy, -uy * dx + ux * dy);
            let ends = 0.5 * (erf((along + 0.5 * length) / q) - erf((along - 0.5 * length) / q));
            image[[j, i]] += (peak * ends * (-0.5 * (across / sigma).powi(2)).exp()) as f32;
        }
    }
}

/// The satellite as it lies in one frame.
#[derive(Debug, Clone, Copy)]
pub struct Body {
    /// Centre \[px\].
    pub x_px: f64,
    /// Centre \[px\].
    pub y_px: f64,
    /// Length and width \[px\].
    pub size_px: (f64, f64),
    /// Angle of the long axis at mid-exposure \[rad\].
    pub angle_rad: f64,
    /// Turn during the exposure \[rad\].
    pub turn_rad: f64,
    /// Smear during the exposure \[px\].
    pub smear_px: (f64, f64),
    /// Electrons of the whole object.
    pub flux_e: f64,
}

/// Parts of a station in units of its length and width: centre, half sizes, brightness.
/// A truss, eight array blankets and a pressurised body, as in Caddy et al. Fig. 1; the brightness is ours.
const PARTS: [(f64, f64, f64, f64, f64); 10] = [
    (0.0, 0.0, 0.5, 0.03, 1.0),
    (0.0, 0.0, 0.05, 0.35, 2.5),
    (-0.45, 0.28, 0.045, 0.22, 0.9),
    (-0.45, -0.28, 0.045, 0.22, 0.9),
    (-0.32, 0.28, 0.045, 0.22, 0.9),
    (-0.32, -0.28, 0.045, 0.22, 0.9),
    (0.32, 0.28, 0.045, 0.22, 0.9),
    (0.32, -0.28, 0.045, 0.22, 0.9),
    (0.45, 0.28, 0.045, 0.22, 0.9),
    (0.45, -0.28, 0.045, 0.22, 0.9),
];

/// Adds the satellite: its parts sampled at a third of the FWHM, turned and smeared over five moments of the exposure.
pub fn add_body(image: &mut Array2<f32>, psf: &PixelPsf, body: &Body) {
    const MOMENTS: usize = 5;
    let step = (psf.fwhm_px / 3.0).max(0.25);
    let mut points = Vec::new();
    for (cx, cy, hx, hy, brightness) in PARTS {
        let (cx, cy) = (cx * body.size_px.0, cy * body.size_px.1);
        let (hx, hy) = (hx * body.size_px.0, hy * body.size_px.1);
        let (nx, ny) = (((2.0 * hx / step).ceil() as usize).max(1), ((2.0 * hy / step).ceil() as usize).max(1));
        let weight = brightness * hx * hy / (nx * ny) as f64;
        for k in 0..nx * ny {
            let x = cx - hx + 2.0 * hx * ((k % nx) as f64 + 0.5) / nx as f64;
            let y = cy - hy + 2.0 * hy * ((k / nx) as f64 + 0.5) / ny as f64;
            points.push((x, y, weight));
        }
    }
    let total: f64 = points.iter().map(|p| p.2).sum();
    for moment in 0..MOMENTS {
        let t = (moment as f64 + 0.5) / MOMENTS as f64 - 0.5;
        let (sin, cos) = (body.angle_rad + t * body.turn_rad).sin_cos();
        for (x, y, weight) in &points {
            let px = body.x_px + cos * x - sin * y + t * body.smear_px.0;
            let py = body.y_px + sin * x + cos * y + t * body.smear_px.1;
            add_star(image, psf, px, py, body.flux_e * weight / total / MOMENTS as f64);
        }
    }
}

/// First and last pixel within `reach` of `centre`, cut to the frame; `None` if it misses the frame.
fn span(centre: f64, reach: f64, n: usize) -> Option<(usize, usize)> {
    let lo = (centre - reach).floor().max(0.0);
    let hi = (centre + reach).ceil().min(n as f64 - 1.0);
    (lo <= hi).then_some((lo as usize, hi as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of a point source inside a circle of radius r.
    ///
    /// Gaussian: 1 − exp(−r²/2σ²). Moffat: 1 − (1 + r²/α²)^(1−β), α = FWHM / (2 sqrt(2^(1/β) − 1)).
    fn enclosed(psf: &PixelPsf, r_px: f64) -> f64 {
        match psf.kind {
            PsfKind::Gaussian => 1.0 - (-0.5 * (r_px / psf.sigma_px()).powi(2)).exp(),
            PsfKind::Moffat => 1.0 - (1.0 + (r_px / psf.alpha_px()).powi(2)).powf(1.0 - psf.beta),
        }
    }

    fn psf(kind: PsfKind) -> PixelPsf {
        PixelPsf { kind, fwhm_px: 3.5, beta: 3.5 }
    }

    #[test]
    fn a_star_keeps_its_electrons() {
        let mut gaussian = Array2::zeros((101, 101));
        add_star(&mut gaussian, &psf(PsfKind::Gaussian), 50.3, 49.6, 1e5);
        assert!((f64::from(gaussian.sum()) / 1e5 - 1.0).abs() < 1e-5);
        let mut moffat = Array2::zeros((101, 101));
        add_star(&mut moffat, &psf(PsfKind::Moffat), 50.3, 49.6, 1e5);
        // wings beyond the drawn square
        let lost = 1.0 - enclosed(&psf(PsfKind::Moffat), 42.0);
        assert!((f64::from(moffat.sum()) / 1e5 - 1.0).abs() < lost + 1e-3);
    }

    #[test]
    fn a_trail_inside_the_frame_keeps_its_electrons() {
        for (dx, dy) in [(60.0, 0.0), (0.0, 60.0), (40.0, -40.0), (3.0, 55.0)] {
            let mut image = Array2::zeros((141, 141));
            add_trail(&mut image, &psf(PsfKind::Gaussian), (70.2, 69.7), (dx, dy), 1e5);
            assert!((f64::from(image.sum()) / 1e5 - 1.0).abs() < 2e-3, "{dx} {dy} {}", image.sum());
        }
    }

    #[test]
    fn the_satellite_keeps_its_electrons_while_it_turns_and_smears() {
        let mut image = Array2::zeros((201, 201));
        let body = Body {
            x_px: 100.0,
            y_px: 101.0,
            size_px: (40.0, 25.0),
            angle_rad: 0.7,
            turn_rad: 0.3,
            smear_px: (4.0, -3.0),
            flux_e: 2e5,
        };
        add_body(&mut image, &psf(PsfKind::Gaussian), &body);
        assert!((f64::from(image.sum()) / 2e5 - 1.0).abs() < 1e-4);
    }

    #[test]
    fn drawing_outside_the_frame_is_harmless() {
        let mut image = Array2::zeros((20, 20));
        add_star(&mut image, &psf(PsfKind::Gaussian), -500.0, 1e9, 1e5);
        add_trail(&mut image, &psf(PsfKind::Gaussian), (-4000.0, 10.0), (20.0, 0.0), 1e5);
        assert_eq!(image.sum(), 0.0);
    }
}
