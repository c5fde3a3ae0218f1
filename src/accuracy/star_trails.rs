//! The zeropoint of a tracked frame by its star trails: error and cost of the number of trails that are fitted.
//!
//! Frames of 300 px with a sky of 60 e⁻ and stars of 3.5 px FWHM, 2500 per square degree, that trail by a third of the frame or
//! across all of it. Magnitudes; the reference is the cloud put in. The catalogue is exact: what is measured is the fit.

use std::f64::consts::FRAC_PI_2;

use ndarray::Array2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;

use super::effort::Stopwatch;
use super::simulated::noisy_frame;
use super::sweep::{Errors, Series, Sweep, SweepPoint, cpu_us};
use crate::astrometry::trailed::align::{Beforehand, MOST_TRAILS, align};
use crate::astrometry::trailed::image::TrailImage;
use crate::astrometry::trailed::path::SkyPath;
use crate::base::constants::FWHM_PER_SIGMA;
use crate::base::error::Result;
use crate::photometry::background::background;
use crate::zeropoint::frame_offset::{StarRatio, frame_offset};

const SIDE_PX: usize = 300;
const SKY_E: f64 = 60.0;
const FWHM_PX: f64 = 3.5;
const SCALE_ARCSEC: f64 = 1.9;
const RATE_DEG_S: f64 = 0.5;
const STARS_PER_DEG2: f64 = 2500.0;
/// Electrons per second of the faintest star; numbers grow by 10^0.32 per magnitude.
const FAINTEST_E_S: f64 = 300.0;
/// The catalogue ends so much earlier \[mag\].
const CATALOGUE_MAG: f64 = 1.2;
/// Numbers of trails that are fitted.
const TRAILS: [usize; 5] = [10, 20, 40, MOST_TRAILS, 2 * MOST_TRAILS];

/// A frame on the equator, north up, east left, with its stars: RA and Dec \[deg\] and light \[e⁻/s\].
struct Simulated {
    image: TrailImage,
    stars: Vec<((f64, f64), f64)>,
    cloud_mag: f64,
    exptime_s: f64,
}

fn path(exptime_s: f64, ahead_s: f64) -> Option<SkyPath> {
    let at = |k: u32| {
        let t_s = exptime_s * (f64::from(k) / 8.0 - 0.5);
        (t_s, 90.0 + RATE_DEG_S * (t_s + ahead_s), 0.0)
    };
    SkyPath::new(&(0..9).map(at).collect::<Vec<_>>())
}

fn simulated(exptime_s: f64, rng: &mut ChaCha12Rng) -> Result<Simulated> {
    let px_per_deg = 3600.0 / SCALE_ARCSEC;
    let side = SIDE_PX as f64;
    let middle = 0.5 * side;
    // as wide as the trails are looked for
    let wide_px = side + px_per_deg * RATE_DEG_S * (exptime_s + 1.2);
    let high_px = side + 200.0;
    let n = (STARS_PER_DEG2 * wide_px * high_px / px_per_deg.powi(2)) as usize;
    let cloud_mag = rng.random_range(0.0..0.5);
    let sigma2 = (FWHM_PX / FWHM_PER_SIGMA).powi(2);
    let mut light = Array2::from_elem((SIDE_PX, SIDE_PX), SKY_E);
    let mut stars = Vec::new();
    for _ in 0..n {
        let (x, y) = ((rng.random::<f64>() - 0.5) * wide_px, (rng.random::<f64>() - 0.5) * high_px);
        let brighter_mag = -(1.0 - rng.random::<f64>()).log10() / 0.32;
        let e_s = FAINTEST_E_S * 10f64.powf(0.4 * brighter_mag.min(8.0));
        if brighter_mag > CATALOGUE_MAG {
            stars.push(((90.0 - x / px_per_deg, y / px_per_deg), e_s));
        }
        let length_px = px_per_deg * RATE_DEG_S * exptime_s;
        let steps = (2.0 * length_px).ceil() as usize;
        let e = e_s * exptime_s * 10f64.powf(-0.4 * cloud_mag) / steps as f64 / (std::f64::consts::TAU * sigma2);
        let rows = pixels_about(middle + y);
        for k in 0..steps {
            // east is left: stars drift to the right
            let at = middle + x + length_px * ((k as f64 + 0.5) / steps as f64 - 0.5);
            for j in rows.clone() {
                for i in pixels_about(at) {
                    let r2 = (i as f64 - at).powi(2) + (j as f64 - middle - y).powi(2);
                    light[[j, i]] += e * (-0.5 * r2 / sigma2).exp();
                }
            }
        }
    }
    let frame = noisy_frame(&light, rng);
    let sky = background(&frame, 64, 3.0)?;
    let image = TrailImage::new(&frame, &sky, (middle, middle), &[(middle, middle, 12.0)], FWHM_PX);
    Ok(Simulated { image, stars, cloud_mag, exptime_s })
}

/// The pixels within four σ of a place.
fn pixels_about(at: f64) -> std::ops::Range<usize> {
    let reach = 4.0 * FWHM_PX / FWHM_PER_SIGMA;
    let of = |at: f64| at.clamp(0.0, SIDE_PX as f64) as usize;
    of(at - reach)..of(at + reach + 1.0)
}

/// The offset of the zeropoint, if the trails give it.
fn offset_mag(frame: &Simulated, most_trails: usize) -> Option<f64> {
    let known = Beforehand {
        turn: Some((FRAC_PI_2, false, 0.004)),
        scale_arcsec: SCALE_ARCSEC,
        fwhm_px: Some(FWHM_PX),
        beta: f64::INFINITY,
        along_px: 0.6 * RATE_DEG_S * 3600.0 / SCALE_ARCSEC,
        across_px: 60.0,
        most_trails,
    };
    let path_at = |ahead_s: f64| path(frame.exptime_s, ahead_s);
    let aligned = align(&frame.image, &path_at, &frame.stars, known).ok()?;
    let ratio = |l: &crate::astrometry::trailed::fit::TrailLight| StarRatio {
        ratio: l.ratio,
        err: l.err,
        predicted_err_mag: 0.0,
    };
    Some(frame_offset(&aligned.lights().map(ratio).collect::<Vec<_>>(), 0.0, true).ok()?.offset_mag)
}

pub(super) fn sweep(stopwatch: &Stopwatch) -> Result<Sweep> {
    let n = stopwatch.effort.of(4, 24);
    let mut series = Vec::new();
    for (label, exptime_s) in [("trails of 100 px", 0.106), ("trails across the frame", 1.0)] {
        let mut rng = ChaCha12Rng::seed_from_u64(stopwatch.seed(31));
        let frames = (0..n).map(|_| simulated(exptime_s, &mut rng)).collect::<Result<Vec<_>>>()?;
        let mut points = Vec::new();
        for most_trails in TRAILS {
            let off: Vec<f64> = frames.iter().filter_map(|f| Some(offset_mag(f, most_trails)? - f.cloud_mag)).collect();
            let us = cpu_us(stopwatch, || {
                std::hint::black_box(offset_mag(&frames[0], most_trails));
            });
            points.extend(Errors::of(&off).map(|errors| SweepPoint {
                setting: format!("{most_trails} trails"),
                errors,
                cpu_us: us,
                memory_kb: None,
                is_default: most_trails == MOST_TRAILS,
            }));
        }
        series.push(Series { label: label.into(), points });
    }
    Ok(Sweep {
        knob: "trails that are fitted at once, the brightest first",
        work: "one frame",
        error: "mag",
        reference: "the cloud put in",
        default_because: "trails that overlap share their light only if both are fitted, and frames hold up to a hundred; the \
                          rest are too faint to matter",
        series,
    })
}
