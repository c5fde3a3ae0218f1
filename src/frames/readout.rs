//! Electrons to raw counts, as a camera does it: photon noise, full well, read noise, converter.
//!
//! e⁻ and ADU. The random numbers are the caller's, so that the same stream gives the same counts. It does not cover
//! the response of pixels, blooming, linearity.

use rand::Rng;
use rand_distr::{Distribution, Normal, Poisson};

use super::frame::Gain;
use crate::config;

/// A camera at one gain setting.
#[derive(Debug, Clone, Copy)]
pub struct Camera<'a> {
    /// The detector at this frame's gain.
    pub gain: &'a Gain,
    /// What a pixel can hold \[e⁻\].
    pub full_well_e: f64,
    /// Largest count of the file \[ADU\].
    pub adc_max_adu: f64,
}

impl<'a> Camera<'a> {
    /// The camera of a configuration: the full well is the one behind the saturation level its reduction uses.
    #[must_use]
    pub fn at(gain: &'a Gain, detector: &config::Detector) -> Self {
        let top_adu = gain.saturation_adu / detector.saturation_frac;
        let full_well_e = (top_adu - gain.pedestal_adu) * gain.e_per_adu.0;
        Self { gain, full_well_e, adc_max_adu: detector.adc_max_adu }
    }

    /// Reads a row of pixels of these expected electrons out.
    ///
    /// N_adu = round(pedestal + (min(Poisson(λ), full well) + Normal(0, RN)) / (e⁻/ADU)), clipped to 0 … adc_max. A
    /// pixel whose expectation is not above 0 has no electrons.
    pub fn read_out<'c>(
        &self,
        expected_e: impl Iterator<Item = f32>,
        counts: impl Iterator<Item = &'c mut u16>,
        rng: &mut impl Rng,
    ) {
        let (e_per_adu, pedestal) = (self.gain.e_per_adu.0, self.gain.pedestal_adu);
        let top = self.adc_max_adu.min(65_535.0);
        let read = Normal::new(0.0, self.gain.read_noise_e).ok();
        for (lambda, count) in expected_e.zip(counts) {
            let electrons = Poisson::new(f64::from(lambda)).map_or(0.0, |p: Poisson<f64>| p.sample(rng));
            let noise = read.map_or(0.0, |r| r.sample(rng));
            let adu = pedestal + (electrons.min(self.full_well_e) + noise) / e_per_adu;
            *count = adu.round().clamp(0.0, top) as u16;
        }
    }
}
