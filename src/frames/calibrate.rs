//! Counts to flattened electrons in one pass over a row: N = g (N_adu − pedestal) / F, and why a pixel cannot be
//! trusted.
//!
//! Small loops over slices that the compiler turns into vector instructions, compiled once for each width of the
//! machine and chosen when the program runs; every lane does the same operations in the same order, so the result is
//! the same on all. It does not cover where the rows come from and the clip circle ([`super::load`]).

use multiversion::multiversion;

use super::frame::{Gain, mask};
use crate::fits::stored::{PIXEL_BYTES, count};

/// Stored unsigned 16-bit pixels to ADU: exact in f32.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
pub(super) fn decode(bytes: &[[u8; PIXEL_BYTES]], adu: &mut [f32]) {
    for (to, from) in adu.iter_mut().zip(bytes) {
        *to = f32::from(count(*from));
    }
}

/// Stored unsigned 16-bit pixels to flattened electrons as [`calibrate`] does, and the bits of [`mask`]: what comes
/// from memory and goes there is touched once.
pub(super) fn calibrate_stored(
    bytes: &[[u8; PIXEL_BYTES]],
    pixels: &mut [f32],
    bits: &mut [u8],
    response: Option<&[f32]>,
    gain: &Gain,
) {
    let level = level(gain);
    match response {
        Some(response) => stored_flattened(bytes, pixels, bits, response, level),
        None => stored_electrons(bytes, pixels, bits, level),
    }
}

/// ADU to flattened electrons in place, and the bits of [`mask`]; `response` is the master flat over the same pixels.
///
/// A pixel that is NaN or infinite is NaN and BAD; one at or above the saturation level is SATURATED; one whose
/// response is NaN is BAD and keeps its electrons undivided. Electrons are computed in f64 and rounded once, then
/// divided in f32.
pub(super) fn calibrate(pixels: &mut [f32], bits: &mut [u8], response: Option<&[f32]>, gain: &Gain) {
    let level = level(gain);
    match response {
        Some(response) => flattened(pixels, bits, response, level),
        None => electrons(pixels, bits, level),
    }
}

/// Electrons per ADU, pedestal and saturation level \[ADU\].
type Level = (f64, f64, f32);

fn level(gain: &Gain) -> Level {
    (gain.e_per_adu.0, gain.pedestal_adu, gain.saturation_adu as f32)
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn stored_electrons(bytes: &[[u8; PIXEL_BYTES]], pixels: &mut [f32], bits: &mut [u8], level: Level) {
    for ((pixel, bit), bytes) in pixels.iter_mut().zip(bits).zip(bytes) {
        (*pixel, *bit) = electron(f32::from(count(*bytes)), level);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn stored_flattened(bytes: &[[u8; PIXEL_BYTES]], pixels: &mut [f32], bits: &mut [u8], response: &[f32], level: Level) {
    for (((pixel, bit), response), bytes) in pixels.iter_mut().zip(bits).zip(response).zip(bytes) {
        (*pixel, *bit) = flat_electron(f32::from(count(*bytes)), *response, level);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn electrons(pixels: &mut [f32], bits: &mut [u8], level: Level) {
    for (pixel, bit) in pixels.iter_mut().zip(bits) {
        (*pixel, *bit) = electron(*pixel, level);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2", "x86_64+sse4.1"))]
fn flattened(pixels: &mut [f32], bits: &mut [u8], response: &[f32], level: Level) {
    for ((pixel, bit), response) in pixels.iter_mut().zip(bits).zip(response) {
        (*pixel, *bit) = flat_electron(*pixel, *response, level);
    }
}

/// [`electron`] divided by the response, and what is wrong with it.
#[inline(always)]
fn flat_electron(n_adu: f32, response: f32, level: Level) -> (f32, u8) {
    let (n_e, seen) = electron(n_adu, level);
    let masked = response.is_nan();
    (if masked { n_e } else { n_e / response }, seen | if masked { mask::BAD } else { 0 })
}

/// N_e = g (N_adu − pedestal), and what is wrong with it.
#[inline(always)]
fn electron(n_adu: f32, (e_per_adu, pedestal_adu, saturation_adu): Level) -> (f32, u8) {
    let n_e = (e_per_adu * (f64::from(n_adu) - pedestal_adu)) as f32;
    let finite = n_adu.is_finite();
    let saturated = if n_adu >= saturation_adu { mask::SATURATED } else { 0 };
    (if finite { n_e } else { f32::NAN }, if finite { saturated } else { mask::BAD })
}
