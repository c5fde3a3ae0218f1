//! A radiance image on the pixels of a detector, blurred: the piece of the frame the satellite's light falls on.
//!
//! W m⁻² per detector pixel; x to the right is west, y up is north, as in the radiance image. Not included: distortion,
//! a camera turned against north.

use ndarray::{Array2, s};

use super::blur::{Blur, sinc};
use super::fourier::{convolve, spread};
use super::resample::{Ruler, bin, resample};
use crate::base::constants::ARCSEC_PER_RAD;
use crate::base::error::{Error, Result};
use crate::resolved::image::{Light, RadianceImage};

/// Most pixels along a side of the grid on which the picture is blurred.
const MAX_SIDE: usize = 8_192;

/// How finely a picture is blurred.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// Steps of the grid per FWHM of a star, at least; detector pixels are divided until there are so many.
    pub steps_per_fwhm: f64,
    /// Half the side of the star's image, in its FWHM; light that spreads further is folded back into it.
    pub reach_fwhm: f64,
}

impl Default for Sampling {
    fn default() -> Self {
        Self { steps_per_fwhm: 4.0, reach_fwhm: 12.0 }
    }
}

/// The light of a satellite on detector pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Stamp {
    /// Column of the frame that the first column is; may be negative.
    pub x0: i64,
    /// Row of the frame that the first row is; may be negative.
    pub y0: i64,
    /// Irradiance at the aperture \[W m⁻²\] whose light falls on a pixel, by light.
    pub planes: Vec<(Light, Array2<f64>)>,
}

impl Stamp {
    /// All lights together \[W m⁻²\] per pixel.
    #[must_use]
    pub fn total(&self) -> Array2<f64> {
        let shape = self.planes.first().map_or((0, 0), |(_, p)| p.dim());
        self.planes.iter().fold(Array2::zeros(shape), |sum, (_, plane)| sum + plane)
    }

    /// Adds `factor` times a picture of this stamp's shape to a frame; what lies outside the frame is excluded, and its
    /// share returned.
    pub fn paint(&self, picture: &Array2<f64>, factor: f64, frame: &mut Array2<f32>) -> f64 {
        let (mut inside, all) = (0.0, picture.sum());
        for ((j, i), value) in picture.indexed_iter() {
            let at = (self.y0 + j as i64, self.x0 + i as i64);
            let pixel = usize::try_from(at.0).ok().zip(usize::try_from(at.1).ok()).and_then(|at| frame.get_mut(at));
            if let Some(pixel) = pixel {
                *pixel += (factor * value) as f32;
                inside += value;
            }
        }
        if all > 0.0 { (1.0 - inside / all).max(0.0) } else { 0.0 }
    }
}

/// Puts a radiance image on detector pixels of `pixel_arcsec`, its middle at `centre_px`, and blurs it.
///
/// The picture is resampled by shared areas to a grid `s` times as fine as the detector, convolved there with the point
/// spread function (its transfer times that of a grid cell), and summed over `s × s`. The sum of a plane is the
/// irradiance of its light to 1e-9: nothing wraps, and what a star spreads beyond `reach_fwhm` is folded back.
///
/// # Errors
/// [`Error::Model`] for a pixel, blur or sampling that makes no sense, radiances that are negative or no numbers, and a
/// picture too large for the grid.
pub fn stamp(
    image: &RadianceImage,
    blur: &Blur,
    pixel_arcsec: f64,
    centre_px: (f64, f64),
    sampling: &Sampling,
) -> Result<Stamp> {
    let fault = |problem: String| Err(Error::Model { problem });
    blur.check()?;
    let source_arcsec = image.pixel_rad * ARCSEC_PER_RAD;
    for (name, value) in [("pixel of the detector", pixel_arcsec), ("pixel of the picture", source_arcsec)] {
        if !(value > 0.0 && value.is_finite()) {
            return fault(format!("{name} {value} arcsec is not above 0"));
        }
    }
    if !((1.0..=64.0).contains(&sampling.steps_per_fwhm) && (2.0..=1_000.0).contains(&sampling.reach_fwhm)) {
        return fault(format!(
            "sampling: {} steps per FWHM and a reach of {} FWHM; accepted are 1 to 64 and 2 to 1000",
            sampling.steps_per_fwhm, sampling.reach_fwhm
        ));
    }
    if !(centre_px.0.abs() < 1e9 && centre_px.1.abs() < 1e9) {
        return fault(format!("the picture's place {centre_px:?} px is not on a detector"));
    }
    let Some((ny, nx)) = image.planes.first().map(|(_, p)| p.dim()) else {
        return fault("the picture has no light: no plane was computed".into());
    };
    for (light, plane) in &image.planes {
        if plane.dim() != (ny, nx) || nx * ny == 0 {
            return fault(format!("the planes of the picture differ in size: {} is {:?}", light.name(), plane.dim()));
        }
        if let Some(bad) = plane.iter().find(|v| !(**v >= 0.0 && v.is_finite())) {
            return fault(format!("a radiance of {} is {bad} W/m2/sr", light.name()));
        }
    }
    let fwhm = blur.fwhm_arcsec();
    let wanted = if fwhm > 0.0 { sampling.steps_per_fwhm * pixel_arcsec / fwhm } else { 1.0 };
    let sub = wanted.ceil().clamp(1.0, 64.0) as usize;
    let step = pixel_arcsec / sub as f64;
    let drift = blur.drift_arcsec.0.abs().max(blur.drift_arcsec.1.abs());
    let reach_px = ((sampling.reach_fwhm * fwhm + 0.5 * drift) / pixel_arcsec).ceil() + 1.0;
    // whole detector pixels around picture and blur
    let axis = |n: usize, centre: f64| {
        let half = 0.5 * n as f64 * source_arcsec / pixel_arcsec;
        let first = (centre - half + 0.5).floor() - reach_px;
        let last = (centre + half + 0.5).floor() + reach_px;
        (first as i64, (last - first) as usize + 1)
    };
    let ((x0, wide), (y0, high)) = (axis(nx, centre_px.0), axis(ny, centre_px.1));
    if wide.max(high) * sub > MAX_SIDE {
        return fault(format!(
            "{wide} x {high} detector pixels in {sub} x {sub} parts each are too many to blur (at most {MAX_SIDE} parts along a \
             side): the picture is too large or the detector's pixels too small for it"
        ));
    }
    let inner = |first: i64, n: usize| {
        let reach = reach_px as i64;
        Ruler { start: ((first + reach) as f64 - 0.5) * pixel_arcsec, step, n: (n - 2 * reach as usize) * sub }
    };
    let source = |n: usize, centre: f64| Ruler {
        start: centre * pixel_arcsec - 0.5 * n as f64 * source_arcsec,
        step: source_arcsec,
        n,
    };
    let (from, to) = ((source(nx, centre_px.0), source(ny, centre_px.1)), (inner(x0, wide), inner(y0, high)));
    let sr = image.pixel_sr();
    let fine: Vec<Array2<f64>> = image.planes.iter().map(|(_, plane)| resample(plane, from, to) * sr).collect();
    let kernel = kernel(blur, step, 2 * reach_px as usize * sub + 1);
    let full = convolve(&fine.iter().collect::<Vec<_>>(), &kernel);
    // rounding leaves amounts of 1e-16 of the brightest below zero; they stay, so that sums stay
    let planes = image
        .planes
        .iter()
        .zip(full)
        .map(|((light, _), picture)| (*light, bin(&picture.slice(s![..high * sub, ..wide * sub]).to_owned(), sub)));
    Ok(Stamp { x0, y0, planes: planes.collect() })
}

/// The image of a star on grid cells, its sum 1: the transfer of the blur times that of a cell.
fn kernel(blur: &Blur, step_arcsec: f64, n: usize) -> Array2<f64> {
    if blur.fwhm_arcsec() == 0.0 && blur.drift_arcsec == (0.0, 0.0) {
        return Array2::from_shape_fn((n, n), |at| if at == (n / 2, n / 2) { 1.0 } else { 0.0 });
    }
    let transfer = blur.transfer();
    let mut kernel = spread(n, |fx, fy| transfer.at(fx / step_arcsec, fy / step_arcsec) * sinc(fx) * sinc(fy));
    // what is cut off at the highest frequency rings below zero: no light is negative
    kernel.mapv_inplace(|v| v.max(0.0));
    let sum = kernel.sum();
    kernel / sum
}
