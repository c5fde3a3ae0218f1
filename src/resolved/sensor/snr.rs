//! Signal over noise of a satellite in an exposure, light by light: of its brightest pixel, of its pixels summed, at best.
//!
//! e⁻. `S/√(S + N)` with `N = sky + dark + RN²` per pixel, once for each light or set of lights, as if it were the only one.

use ndarray::Array2;

use super::exposure::Exposure;
use crate::resolved::image::Light;

/// Share of the light that the summed pixels hold.
const SUMMED_SHARE: f64 = 0.9;

/// Signal over noise of some lights of one exposure.
#[derive(Debug, Clone, PartialEq)]
pub struct Snr {
    /// The lights that shine.
    pub lights: Vec<Light>,
    /// Electrons of these lights, all of them.
    pub signal_e: f64,
    /// Variance of a pixel without the satellite \[e⁻²\].
    pub variance_e2_px: f64,
    /// Of the brightest pixel.
    pub pixel: f64,
    /// Of the sum over [`Snr::n_px`] pixels, the fewest that hold 90 % of the light of all lights: one mask for every row.
    pub summed: f64,
    /// How many those are.
    pub n_px: usize,
    /// Of pixels weighted by the expected picture: `√ Σ S²/(S + N)`, the most that can be had.
    pub matched: f64,
}

/// Signal over noise for each set of lights; a light the exposure lacks counts as dark.
#[must_use]
pub fn signal_to_noise(exposure: &Exposure, read_noise_e: f64, sets: &[Vec<Light>]) -> Vec<Snr> {
    let variance = exposure.sky_e_px + exposure.dark_e_px + read_noise_e * read_noise_e;
    let all = exposure.stamp.total();
    let mut order: Vec<(usize, usize)> = all.indexed_iter().map(|(at, _)| at).collect();
    order.sort_by(|a, b| all[*b].total_cmp(&all[*a]));
    let wanted = SUMMED_SHARE * all.sum();
    let mut held = 0.0;
    let n_px = order.iter().take_while(|at| {
        let more = held < wanted;
        held += all[**at];
        more
    });
    let n_px = n_px.count();
    let row = |lights: &Vec<Light>| {
        let planes = exposure.stamp.planes.iter().filter(|(light, _)| lights.contains(light));
        let signal: Array2<f64> = planes
            .fold(Array2::zeros(all.dim()), |sum, (_, p)| sum + p)
            .mapv(|v: f64| (v * exposure.e_per_w_m2).max(0.0));
        let ratio = |s: f64, n: f64| if s > 0.0 { s / (s + n).sqrt() } else { 0.0 };
        let summed: f64 = order[..n_px].iter().map(|at| signal[*at]).sum();
        Snr {
            lights: lights.clone(),
            signal_e: signal.sum(),
            variance_e2_px: variance,
            pixel: ratio(signal.iter().copied().fold(0.0, f64::max), variance),
            summed: ratio(summed, n_px as f64 * variance),
            n_px,
            matched: signal.iter().map(|s| ratio(*s, variance).powi(2)).sum::<f64>().sqrt(),
        }
    };
    sets.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resolved::sensor::Stamp;

    fn exposure(planes: Vec<(Light, Array2<f64>)>, sky_e_px: f64) -> Exposure {
        Exposure {
            exptime_s: 30.0,
            expected_e: Array2::zeros((2, 2)),
            stamp: Stamp { x0: 0, y0: 0, planes },
            e_per_w_m2: 1.0,
            sky_e_px,
            dark_e_px: 0.0,
            outside_frac: 0.0,
        }
    }

    #[test]
    fn an_even_picture_without_background_is_photon_noise_by_every_definition() {
        let picture = Array2::from_elem((10, 10), 4.0);
        let got = &signal_to_noise(&exposure(vec![(Light::Sun, picture)], 0.0), 0.0, &[vec![Light::Sun]])[0];
        assert!((got.pixel - 2.0).abs() < 1e-12);
        assert!((got.matched - 20.0).abs() < 1e-12); // √400
        assert_eq!(got.n_px, 90);
        assert!((got.summed - 360f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn the_matched_ratio_is_the_best_and_every_ratio_grows_slower_than_the_light() {
        let picture = Array2::from_shape_fn((20, 20), |(j, i)| {
            100.0 * (-((j as f64 - 9.0).powi(2) + (i as f64 - 11.0).powi(2)) / 20.0).exp()
        });
        let planes = vec![(Light::Moon, picture.clone()), (Light::Starlight, &picture / 294.0)];
        for sky in [0.0, 10.0, 1e4] {
            let got =
                signal_to_noise(&exposure(planes.clone(), sky), 1.4, &[vec![Light::Moon], vec![Light::Starlight]]);
            assert!(got.iter().all(|r| r.matched >= r.summed && r.matched >= r.pixel));
            for ratio in [got[0].pixel / got[1].pixel, got[0].summed / got[1].summed, got[0].matched / got[1].matched] {
                // between photon noise of both and background noise of both
                assert!(ratio > 294f64.sqrt() && ratio <= 294.0 * (1.0 + 1e-9), "{ratio}");
            }
        }
    }

    #[test]
    fn no_light_has_no_signal() {
        let got = signal_to_noise(
            &exposure(vec![(Light::Sun, Array2::zeros((3, 3)))], 1.0),
            1.0,
            &[vec![Light::Sun], vec![Light::Moon]],
        );
        assert!(got.iter().all(|r| r.pixel == 0.0 && r.summed == 0.0 && r.matched == 0.0));
    }
}
