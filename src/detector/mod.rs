//! Photon transfer: gain, read noise, converter steps and saturation from flats and biases.

pub(crate) mod adc;
pub(crate) mod flat_pairs;
pub mod measure;
pub(crate) mod transfer;

pub use adc::{Counts, Pile, Step, converter_bits, count_values};
pub use flat_pairs::{BlockPoint, MAX_FLAT_RATIO, PairPoints, Refusal, compare_flats};
pub use transfer::{DarkNoise, GainEstimate, Transfer, fit_transfer};
