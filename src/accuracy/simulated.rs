//! Frames that sweeps and extreme cases are made of: electrons of a scene, with noise or without, in a detector that adds nothing.
//!
//! Electrons per pixel. It does not cover raw frames ([`crate::simulate`]).

use ndarray::Array2;
use rand::Rng;
use rand_distr::StandardNormal;

use crate::frames::{Electrons, ElectronsPerAdu, Frame, Gain};

/// A detector of one electron per ADU without read noise.
pub(super) fn ideal_gain(saturation_adu: f64) -> Gain {
    Gain {
        setting: None,
        e_per_adu: ElectronsPerAdu(1.0),
        source: "simulated".into(),
        read_noise_e: 0.0,
        pedestal_adu: 0.0,
        saturation_adu,
    }
}

/// The frame of these electrons.
pub(super) fn frame_of(electrons: Array2<f32>) -> Frame<Electrons> {
    Frame::from_electrons("simulated".into(), electrons, ideal_gain(f64::INFINITY))
}

/// The same with Gaussian noise of Poisson's variance: what is measured is the method, not the noise.
pub(super) fn noisy_frame(electrons: &Array2<f64>, rng: &mut impl Rng) -> Frame<Electrons> {
    frame_of(electrons.mapv(|e| (e + e.sqrt() * rng.sample::<f64, _>(StandardNormal)) as f32))
}
