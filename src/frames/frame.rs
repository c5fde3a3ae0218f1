//! A frame: pixels that travel with their mask, saturation level, gain and header facts.

use std::marker::PhantomData;
use std::path::PathBuf;

use ndarray::Array2;
use serde::{Deserialize, Serialize};

/// Photo-electrons.
#[derive(Debug, Clone, Copy)]
pub enum Electrons {}

/// The camera's gain setting \[0.1 dB\], as the header's GAIN of amateur software writes it. Never electrons per ADU.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct GainSetting(pub i64);

/// Electrons per ADU.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct ElectronsPerAdu(pub f64);

/// The detector at the gain of one frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gain {
    /// The setting, where the header has one.
    pub setting: Option<GainSetting>,
    /// Conversion factor.
    pub e_per_adu: ElectronsPerAdu,
    /// Where the factor is from, e.g. `asi6200mm table: full_well_e/65535`, `pipeline.toml`, `header EGAIN`.
    pub source: String,
    /// Read noise \[e⁻\].
    pub read_noise_e: f64,
    /// Bias level \[ADU\].
    pub pedestal_adu: f64,
    /// Raw level from which a pixel counts as saturated \[ADU\], pedestal included.
    pub saturation_adu: f64,
}

/// Bits of a pixel's mask.
pub mod mask {
    /// NaN or infinite in the file, or the flat is zero, low or NaN here.
    pub const BAD: u8 = 1;
    /// At or above the saturation level of this frame's own gain.
    pub const SATURATED: u8 = 2;
    /// Outside the clip circle: not read, the pixel is NaN.
    pub const CLIPPED: u8 = 4;
}

/// One exposure, or the part of it that was read. `U` says what the pixels are: [`Electrons`], flattened if there is a
/// master flat.
///
/// Pixel `[[j, i]]` is the full frame's pixel (x = `origin_px.0` + i, y = `origin_px.1` + j). All positions
/// elsewhere in satphot are in full-frame coordinates.
#[derive(Debug, Clone)]
pub struct Frame<U> {
    /// The file.
    pub path: PathBuf,
    /// Pixel values, shape (ny, nx).
    pub pixels: Array2<f32>,
    /// Bits of [`mask`], same shape; 0 = good.
    pub mask: Array2<u8>,
    /// Full-frame (x, y) of `pixels[[0, 0]]` \[px\].
    pub origin_px: (usize, usize),
    /// Full-frame size (nx, ny) \[px\].
    pub full_size_px: (usize, usize),
    /// The detector at this frame's gain.
    pub gain: Gain,
    pub(crate) unit: PhantomData<U>,
}

impl Frame<Electrons> {
    /// A frame of electrons made from pixels, for tests and simulation: nothing masked, whole frame.
    #[must_use]
    pub fn from_electrons(path: PathBuf, pixels: Array2<f32>, gain: Gain) -> Self {
        let (ny, nx) = pixels.dim();
        let mask = Array2::zeros((ny, nx));
        Self { path, pixels, mask, origin_px: (0, 0), full_size_px: (nx, ny), gain, unit: PhantomData }
    }

    /// Whether no pixel can be used: all are BAD or CLIPPED.
    #[must_use]
    pub fn all_bad(&self) -> bool {
        self.mask.iter().all(|bits| bits & (mask::BAD | mask::CLIPPED) != 0)
    }
}
