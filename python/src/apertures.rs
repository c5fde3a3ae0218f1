//! Sums of pixels in apertures, each of many positions at once.

use numpy::{Element, IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;
use satphot::Aperture;
use satphot::ndarray::ArrayView2;
use satphot::photometry::aperture::{Bounds, for_each_pixel};

use crate::errors::bad;
use crate::interrupt::{Stopped, interruptible};

/// The most that an aperture may measure \[px\]: beyond it no image reaches.
const MOST_PX: f64 = 1e9;

/// So few apertures that no signal is looked for.
const FEW: usize = 16;

/// An image as it was given.
#[derive(FromPyObject)]
pub enum Image<'py> {
    /// Single precision.
    Single(PyReadonlyArray2<'py, f32>),
    /// Double precision.
    Double(PyReadonlyArray2<'py, f64>),
}

/// What is summed besides the pixels.
#[derive(Clone, Copy)]
struct Extra<'a> {
    /// Error of each pixel.
    error: Option<ArrayView2<'a, f64>>,
    /// Pixels to exclude.
    mask: Option<ArrayView2<'a, bool>>,
    /// Electrons per unit of the image, for the noise of the light itself.
    e_per_unit: Option<f64>,
}

/// Sum, its error (NaN where nothing is known of it) and the area that was summed.
type Sums = (f64, f64, f64);

/// Sum, error and area \[px²\] at every position.
#[pyfunction]
#[pyo3(signature = (image, x_px, y_px, shape, a_px, b_px, theta_rad, error, mask, e_per_unit, threads))]
#[allow(clippy::too_many_arguments)] // columns
pub fn sum_apertures<'py>(
    py: Python<'py>,
    image: Image<'py>,
    x_px: PyReadonlyArray1<'py, f64>,
    y_px: PyReadonlyArray1<'py, f64>,
    shape: &str,
    a_px: PyReadonlyArray1<'py, f64>,
    b_px: PyReadonlyArray1<'py, f64>,
    theta_rad: PyReadonlyArray1<'py, f64>,
    error: Option<PyReadonlyArray2<'py, f64>>,
    mask: Option<PyReadonlyArray2<'py, bool>>,
    e_per_unit: Option<f64>,
    threads: usize,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    if let Some(value) = e_per_unit.filter(|v| !(*v > 0.0 && v.is_finite())) {
        return Err(bad("e_per_unit", format!("{value} is not a finite number above 0")));
    }
    let (x, y) = (x_px.as_slice()?, y_px.as_slice()?);
    let (a, b, theta) = (a_px.as_slice()?, b_px.as_slice()?, theta_rad.as_slice()?);
    let shapes = shapes(shape, a, b, theta)?;
    if shapes.len() != x.len() || y.len() != x.len() {
        return Err(bad("x_px", format!("{} x, {} y and {} shapes do not fit", x.len(), y.len(), shapes.len())));
    }
    let extra =
        Extra { error: error.as_ref().map(|e| e.as_array()), mask: mask.as_ref().map(|m| m.as_array()), e_per_unit };
    let positions: Vec<(f64, f64)> = x.iter().copied().zip(y.iter().copied()).collect();
    let sums = match &image {
        Image::Single(pixels) => sums(py, pixels.as_array(), &positions, &shapes, extra, threads),
        Image::Double(pixels) => sums(py, pixels.as_array(), &positions, &shapes, extra, threads),
    }?;
    let column = |value: fn(&Sums) -> f64| sums.iter().map(value).collect::<Vec<f64>>().into_pyarray(py);
    Ok((column(|s| s.0), column(|s| s.1), column(|s| s.2)))
}

fn shapes(shape: &str, a: &[f64], b: &[f64], theta: &[f64]) -> PyResult<Vec<Aperture>> {
    let mut shapes = Vec::with_capacity(a.len());
    for ((a_px, b_px), theta_rad) in a.iter().zip(b).zip(theta) {
        let (a_px, b_px, theta_rad) = (*a_px, *b_px, *theta_rad);
        for (name, axis) in [("a_px", a_px), ("b_px", b_px)] {
            if !(axis > 0.0 && axis <= MOST_PX) {
                return Err(bad(name, format!("{axis} px is not above 0 and at most {MOST_PX:e} px")));
            }
        }
        if !theta_rad.is_finite() {
            return Err(bad("theta_rad", format!("{theta_rad} is not a number")));
        }
        shapes.push(match shape {
            "circle" => Aperture::Circle { r_px: a_px },
            "ellipse" => Aperture::Ellipse { a_px, b_px, theta_rad },
            "rectangle" => Aperture::Rectangle { a_px, b_px, theta_rad },
            "pill" => Aperture::Pill { a_px, b_px, theta_rad },
            other => {
                let problem = format!("\"{other}\" is not one of circle, ellipse, rectangle, pill");
                return Err(bad("shape", problem));
            }
        });
    }
    Ok(shapes)
}

fn sums<T: Element + Copy + Into<f64> + Sync>(
    py: Python<'_>,
    pixels: ArrayView2<'_, T>,
    positions: &[(f64, f64)],
    shapes: &[Aperture],
    extra: Extra<'_>,
    threads: usize,
) -> PyResult<Vec<Sums>> {
    let (ny, nx) = pixels.dim();
    let fits = |dim: (usize, usize), name: &str| match dim == (ny, nx) {
        true => Ok(()),
        false => Err(bad(name, format!("{} x {} is not the shape of the image, {ny} x {nx}", dim.0, dim.1))),
    };
    extra.error.map_or(Ok(()), |error| fits(error.dim(), "error"))?;
    extra.mask.map_or(Ok(()), |mask| fits(mask.dim(), "mask"))?;
    let bounds = Bounds { x0: 0, x1: nx, y0: 0, y1: ny };
    let one = |((x, y), shape): (&(f64, f64), &Aperture)| -> Sums {
        let (mut sum, mut variance, mut area_px) = (0.0, 0.0, 0.0);
        for_each_pixel(shape, *x, *y, bounds, |i, j, fraction| {
            if extra.mask.is_some_and(|mask| mask[[j, i]]) {
                return;
            }
            sum += fraction * pixels[[j, i]].into();
            variance += extra.error.map_or(0.0, |error| fraction * error[[j, i]] * error[[j, i]]);
            area_px += fraction;
        });
        let poisson = extra.e_per_unit.map_or(0.0, |e_per_unit| sum.max(0.0) / e_per_unit);
        let is_known = extra.error.is_some() || extra.e_per_unit.is_some();
        (sum, if is_known { (variance + poisson).sqrt() } else { f64::NAN }, area_px)
    };
    let work = |stopped: Stopped| {
        let each = positions.par_iter().zip(shapes);
        each.map(|at| if stopped() { (f64::NAN, f64::NAN, f64::NAN) } else { one(at) }).collect()
    };
    interruptible(py, threads, positions.len() <= FEW, work)
}
