//! Run time of the room on a frame of the clip circle's size; prints, and fails only when something is badly wrong.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests, too

use crate::photometry_scene;

use std::time::Instant;

use ndarray::Array2;
use satphot::photometry::aperture::Shape;
use satphot::photometry::background::background;
use satphot::photometry::detect::{detect, stellar_fwhm};
use satphot::photometry::flux::measure;

#[test]
fn a_frame_of_5000_px_squared_takes_seconds_not_minutes() {
    // a cheap deterministic noise: what is timed does not depend on it being Poisson
    let noise = |k: u64| {
        let h = k.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let h = (h ^ (h >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((h >> 40) as f32) / 16_777_216.0 - 0.5
    };
    let mut pixels = Array2::from_shape_fn((5000, 5000), |(j, i)| 100.0 + 35.0 * noise((j * 5000 + i) as u64));
    for k in 0..2000usize {
        let (x, y) = (60 + (k * 2477) % 4880, 60 + (k * 1889) % 4880);
        for j in y - 12..=y + 12 {
            for i in x - 12..=x + 12 {
                let r2 = (i as f32 - x as f32).powi(2) + (j as f32 - y as f32).powi(2);
                pixels[[j, i]] += 2000.0 * (-r2 / 6.0).exp();
            }
        }
    }
    let frame = photometry_scene::frame(pixels, 2.0);
    let start = Instant::now();
    let sky = background(&frame, 64, 3.0).unwrap();
    println!("background {:.2?}", start.elapsed());
    let t = Instant::now();
    let sources = detect(&frame, &sky, 5.0, Some(4.0));
    println!("detection of {} sources {:.2?}", sources.len(), t.elapsed());
    let t = Instant::now();
    let fwhm = stellar_fwhm(&frame, &sky, &sources).unwrap();
    println!("fwhm {fwhm:.2} px {:.2?}", t.elapsed());
    let t = Instant::now();
    let total: f64 = sources
        .iter()
        .map(|s| measure(&frame, &sky, s.x_px, s.y_px, Shape::Circle { r_px: 8.0 }, 12.0, 20.0, 3.0).flux_e)
        .sum();
    println!("{} apertures {:.2?}", sources.len(), t.elapsed());
    assert!(total.is_finite() && sources.len() > 1500);
}
