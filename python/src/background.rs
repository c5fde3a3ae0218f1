//! The background of an image: its level and its scatter, on a mesh joined by a spline.

use std::path::PathBuf;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;
use satphot::frames::{Electrons, Frame};
use satphot::frames::{ElectronsPerAdu, Gain, mask};
use satphot::ndarray::{Array2, Zip};
use satphot::photometry::background::background;

use crate::apertures::Image;
use crate::errors::{bad, raise};
use crate::interrupt::interruptible;

/// Level and scatter of the background, a smooth function of position.
#[pyclass(frozen, module = "satphot._satphot")]
pub struct Background {
    of: satphot::photometry::background::Background,
    shape: (usize, usize),
}

#[pymethods]
impl Background {
    /// Measures an image, without the pixels of the mask and those that are not finite.
    #[new]
    #[pyo3(signature = (image, masked, mesh_px, clip_sigma, threads))]
    fn new(
        py: Python<'_>,
        image: Image<'_>,
        masked: Option<PyReadonlyArray2<'_, bool>>,
        mesh_px: usize,
        clip_sigma: f64,
        threads: usize,
    ) -> PyResult<Self> {
        let pixels: Array2<f32> = match &image {
            Image::Single(pixels) => pixels.as_array().to_owned(),
            Image::Double(pixels) => pixels.as_array().mapv(|value| value as f32),
        };
        let (ny, nx) = pixels.dim();
        if nx == 0 || ny == 0 {
            return Err(bad("image", format!("{ny} x {nx} pixels are none")));
        }
        let mut bits = pixels.mapv(|value| if value.is_finite() { 0 } else { mask::BAD });
        if let Some(masked) = masked {
            let masked = masked.as_array();
            if masked.dim() != (ny, nx) {
                let (my, mx) = masked.dim();
                return Err(bad("mask", format!("{my} x {mx} is not the shape of the image, {ny} x {nx}")));
            }
            Zip::from(&mut bits).and(&masked).for_each(|bits, masked| *bits |= if *masked { mask::BAD } else { 0 });
        }
        let unit = Gain {
            setting: None,
            e_per_adu: ElectronsPerAdu(1.0),
            source: "unit of the image".into(),
            read_noise_e: 0.0,
            pedestal_adu: 0.0,
            saturation_adu: f64::INFINITY,
        };
        let mut frame = Frame::<Electrons>::from_electrons(PathBuf::from("image"), pixels, unit);
        frame.mask = bits;
        let of = interruptible(py, threads, false, |_| background(&frame, mesh_px, clip_sigma))?.map_err(raise)?;
        Ok(Self { of, shape: (ny, nx) })
    }

    /// Median level over the mesh [unit of the image].
    #[getter]
    fn global_level(&self) -> f64 {
        self.of.global_level()
    }

    /// Median scatter over the mesh [unit of the image].
    #[getter]
    fn global_rms(&self) -> f64 {
        self.of.global_rms()
    }

    /// The level of every pixel.
    fn level<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.map(py, |y, row| self.of.level_row(y, 0, row))
    }

    /// The scatter of every pixel.
    fn rms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.map(py, |y, row| self.of.rms_row(y, 0, row))
    }

    /// Level, its error and scatter at positions.
    #[pyo3(signature = (x_px, y_px))]
    fn at<'py>(
        &self,
        py: Python<'py>,
        x_px: PyReadonlyArray1<'py, f64>,
        y_px: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
        let (x, y) = (x_px.as_slice()?, y_px.as_slice()?);
        if x.len() != y.len() {
            return Err(bad("x_px", format!("{} x and {} y do not fit", x.len(), y.len())));
        }
        let column = |value: &dyn Fn(f64, f64) -> f64| {
            x.iter().zip(y).map(|(x, y)| value(*x, *y)).collect::<Vec<f64>>().into_pyarray(py)
        };
        let (level, err, rms) = (
            column(&|x, y| self.of.level(x, y)),
            column(&|x, y| self.of.level_err(x, y)),
            column(&|x, y| self.of.rms(x, y)),
        );
        Ok((level, err, rms))
    }
}

impl Background {
    fn map<'py>(
        &self,
        py: Python<'py>,
        fill: impl Fn(usize, &mut [f32]) + Sync + Send,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let (ny, nx) = self.shape;
        let pixels = interruptible(py, 0, false, |stopped| {
            let mut pixels = vec![0.0f32; ny * nx];
            pixels.par_chunks_mut(nx).enumerate().filter(|_| !stopped()).for_each(|(y, row)| fill(y, row));
            pixels
        })?;
        let map = Array2::from_shape_vec((ny, nx), pixels).map_err(|error| bad("image", error.to_string()))?;
        Ok(map.into_pyarray(py))
    }
}
