//! Signal, noise and their ratio in some pixels, and the same solved for the signal and for the time.
//!
//! e⁻, e⁻/s, s. The noise is that of the pixels summed; the target's own noise is counted everywhere.

use crate::base::error::{Error, Result};

/// What the pixels that are summed hold besides the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Sky \[e⁻/s\].
    pub sky_e_s: f64,
    /// Dark current \[e⁻/s\].
    pub dark_e_s: f64,
    /// Read noise of one readout of all of them \[e⁻\].
    pub read_noise_e: f64,
}

impl Noise {
    /// The noise of `n_px` such pixels: rates times n, read noise times √n.
    #[must_use]
    pub fn over(self, n_px: f64) -> Self {
        Self {
            sky_e_s: self.sky_e_s * n_px,
            dark_e_s: self.dark_e_s * n_px,
            read_noise_e: self.read_noise_e * n_px.sqrt(),
        }
    }

    /// Variance without the target \[e⁻²\] of a time in all, split into `n_sub` exposures:
    /// `N = (sky + dark) t + n_sub RN²`.
    #[must_use]
    pub fn variance_e2(&self, exptime_s: f64, n_sub: u32) -> f64 {
        (self.sky_e_s + self.dark_e_s) * exptime_s + f64::from(n_sub) * self.read_noise_e.powi(2)
    }

    fn check(&self) -> Result<()> {
        let parts = [("sky", self.sky_e_s), ("dark current", self.dark_e_s), ("read noise", self.read_noise_e)];
        match parts.into_iter().find(|(_, v)| !(*v >= 0.0 && v.is_finite())) {
            Some((name, value)) => Err(fault(format!("{name} {value} is not a number from 0 up"))),
            None => Ok(()),
        }
    }
}

fn fault(problem: String) -> Error {
    Error::Model { problem }
}

fn positive(name: &str, value: f64) -> Result<()> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(fault(format!("{name} {value} is not above 0"))) }
}

fn some_exposures(n_sub: u32) -> Result<()> {
    if n_sub > 0 { Ok(()) } else { Err(fault("no exposures: their number is 0".into())) }
}

/// The signal \[e⁻\] whose ratio to its noise is `snr` above a variance N \[e⁻²\] without it:
/// `S = (k² + √(k⁴ + 4 k² N)) / 2`, from `k = S/√(S + N)`.
#[must_use]
pub fn signal_for_snr(snr: f64, variance_e2: f64) -> f64 {
    // k⁴ would overflow where k² does not
    0.5 * snr * (snr + snr.hypot(2.0 * variance_e2.sqrt()))
}

/// Ratio of a target of `rate_e_s` to the noise, in a time in all split into `n_sub` exposures: `S/√(S + N)`, S = r t.
///
/// # Errors
/// [`Error::Model`] for a time that is not above 0, no exposures, a negative rate or noise, and what is not a number.
pub fn snr(rate_e_s: f64, noise: &Noise, exptime_s: f64, n_sub: u32) -> Result<f64> {
    positive("exposure time", exptime_s)?;
    some_exposures(n_sub)?;
    noise.check()?;
    if !(rate_e_s >= 0.0 && rate_e_s.is_finite()) {
        return Err(fault(format!("rate {rate_e_s} e-/s is not a number from 0 up")));
    }
    let signal = rate_e_s * exptime_s;
    let variance = signal + noise.variance_e2(exptime_s, n_sub);
    Ok(if signal > 0.0 { signal / variance.sqrt() } else { 0.0 })
}

/// Faintest magnitude at a ratio to the noise: `m = ZP − 2.5 lg (S_k/t)`.
///
/// `zp_mag` is the magnitude of 1 e⁻/s in the pixels the noise is of; a surface brightness of 1 e⁻/s in their area
/// gives the limit as a surface brightness.
///
/// # Errors
/// [`Error::Model`] for a time or a ratio that is not above 0, no exposures, negative noise, and what is not a number.
pub fn limit_mag(zp_mag: f64, noise: &Noise, exptime_s: f64, n_sub: u32, snr: f64) -> Result<f64> {
    positive("exposure time", exptime_s)?;
    positive("signal-to-noise ratio", snr)?;
    some_exposures(n_sub)?;
    noise.check()?;
    if !zp_mag.is_finite() {
        return Err(fault(format!("zeropoint {zp_mag} is not a number")));
    }
    Ok(zp_mag - 2.5 * (signal_for_snr(snr, noise.variance_e2(exptime_s, n_sub)) / exptime_s).log10())
}

/// Time in all \[s\], split into `n_sub` exposures, in which a target of `rate_e_s` reaches a ratio k to the noise.
///
/// `t = (k² (r + b) + √(k⁴ (r + b)² + 4 r² k² n RN²)) / (2 r²)` with b the rate of sky and dark current.
///
/// # Errors
/// [`Error::Model`] for a rate or ratio that is not above 0 (no time is long enough), no exposures, negative noise, and
/// what is not a number.
pub fn exposure_for_snr(rate_e_s: f64, noise: &Noise, n_sub: u32, snr: f64) -> Result<f64> {
    positive("signal-to-noise ratio", snr)?;
    positive("rate of the target", rate_e_s)?;
    some_exposures(n_sub)?;
    noise.check()?;
    // in units of the target's own time k²/r, so that neither square overflows
    let linear = snr * snr / rate_e_s * (1.0 + (noise.sky_e_s + noise.dark_e_s) / rate_e_s);
    let read = 2.0 * snr / rate_e_s * noise.read_noise_e * f64::from(n_sub).sqrt();
    let time = 0.5 * (linear + linear.hypot(read));
    if time.is_finite() { Ok(time) } else { Err(fault(format!("a target of {rate_e_s} e-/s needs endless time"))) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(sky: f64, dark: f64, read: f64) -> Noise {
        Noise { sky_e_s: sky, dark_e_s: dark, read_noise_e: read }
    }

    /// A sky without noise of its own beyond the variance stated.
    fn of_variance(variance_e2: f64) -> Noise {
        noise(0.0, 0.0, variance_e2.sqrt())
    }

    #[test]
    fn the_published_limits_of_the_telescope_come_out_of_the_pixel_formula() {
        // pixel zeropoint 21.62, 10 s: N = 84.6 e² at full Moon, 13.6 e² at new Moon
        for (variance, snr, published, exact) in [
            (84.6, 1.0, 21.65, Some(21.651_794_725_918_26)),
            (84.6, 5.0, 19.67, Some(19.671_773_147_070_855)),
            (13.6, 1.0, 22.56, None),
            (13.6, 5.0, 20.27, None),
        ] {
            let limit = limit_mag(21.62, &of_variance(variance), 10.0, 1, snr).unwrap();
            assert!((limit - published).abs() < 0.005, "{limit}");
            assert!(exact.is_none_or(|exact| (limit - exact).abs() < 1e-12), "{limit}");
        }
    }

    #[test]
    fn the_ratio_at_the_limit_is_the_one_requested() {
        for (sky, read, t, n_sub) in
            [(7.7, 1.45, 10.0, 1), (1e9, 0.0, 1e4, 30), (0.0, 3.5, 1e-3, 1), (0.0, 0.0, 1.0, 7)]
        {
            for k in [1e-3, 1.0, 5.0, 1e4] {
                let noise = noise(sky, 0.011, read);
                let limit = limit_mag(24.0, &noise, t, n_sub, k).unwrap();
                let back = snr(10f64.powf(-0.4 * (limit - 24.0)), &noise, t, n_sub).unwrap();
                assert!((back / k - 1.0).abs() < 1e-10, "{sky} {t} {k}: {back}");
            }
        }
    }

    #[test]
    fn limits_deepen_with_the_square_root_of_time_under_sky_and_with_time_under_read_noise() {
        // over a decade in time: 1.25 mag where the sky limits, 2.5 mag where the readout or the target itself does
        let gain = |noise: &Noise, t: f64, k: f64| {
            limit_mag(0.0, noise, 10.0 * t, 1, k).unwrap() - limit_mag(0.0, noise, t, 1, k).unwrap()
        };
        assert!((gain(&noise(1e6, 0.0, 0.0), 1e3, 5.0) - 1.25).abs() < 1e-3);
        assert!((gain(&noise(0.0, 0.0, 1e4), 1.0, 5.0) - 2.5).abs() < 1e-9);
        assert!((gain(&noise(0.0, 0.0, 0.0), 1.0, 5.0) - 2.5).abs() < 1e-9);
    }

    #[test]
    fn splitting_a_time_never_helps() {
        for noise in [noise(7.7, 0.011, 1.45), noise(0.0, 0.0, 9.0), noise(1e4, 0.0, 0.0)] {
            let limits: Vec<f64> = (1..50).map(|n| limit_mag(24.0, &noise, 60.0, n, 5.0).unwrap()).collect();
            assert!(limits.windows(2).all(|w| w[1] <= w[0]), "{limits:?}");
        }
    }

    #[test]
    fn the_time_for_a_ratio_gives_that_ratio_over_twelve_decades() {
        for decade in -6..=6 {
            let rate = 3.0 * 10f64.powi(decade);
            for noise in
                [noise(0.586, 0.011, 1.45), noise(7.73, 0.0, 9.3), noise(0.0, 0.0, 0.0), noise(1e9, 1.0, 100.0)]
            {
                for (k, n_sub) in [(1.0, 1), (5.0, 6), (300.0, 1)] {
                    let t = exposure_for_snr(rate, &noise, n_sub, k).unwrap();
                    let back = snr(rate, &noise, t, n_sub).unwrap();
                    assert!((back / k - 1.0).abs() < 1e-10, "{rate} {k}: {t} {back}");
                }
            }
        }
    }

    #[test]
    fn a_sky_of_a_billion_electrons_leaves_its_exact_square_root() {
        let limit = limit_mag(0.0, &noise(1e9, 0.0, 0.0), 1.0, 1, 1e-6).unwrap();
        assert!((limit + 2.5 * (1e-6 * 1e9f64.sqrt()).log10()).abs() < 1e-9, "{limit}");
    }

    #[test]
    fn pixels_add_their_electrons_and_the_squares_of_their_read_noise() {
        let (one, many) = (noise(2.0, 0.1, 1.5), noise(2.0, 0.1, 1.5).over(26.1));
        assert!((many.variance_e2(12.0, 3) - 26.1 * one.variance_e2(12.0, 3)).abs() < 1e-9);
    }

    #[test]
    fn senseless_questions_are_refused_with_what_is_wrong() {
        let good = noise(1.0, 0.0, 1.0);
        for (t, n_sub, k, said) in [
            (0.0, 1, 5.0, "exposure time 0"),
            (-1.0, 1, 5.0, "exposure time -1"),
            (f64::NAN, 1, 5.0, "exposure time NaN"),
            (10.0, 1, 0.0, "ratio 0"),
            (10.0, 0, 5.0, "number is 0"),
        ] {
            let error = limit_mag(24.0, &good, t, n_sub, k).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
        for bad in [noise(-1.0, 0.0, 1.0), noise(1.0, f64::NAN, 1.0), noise(1.0, 0.0, f64::INFINITY)] {
            assert!(limit_mag(24.0, &bad, 10.0, 1, 5.0).is_err() && snr(1.0, &bad, 10.0, 1).is_err());
        }
        assert!(limit_mag(f64::NAN, &good, 10.0, 1, 5.0).is_err());
        for rate in [0.0, -1.0, f64::NAN] {
            assert!(exposure_for_snr(rate, &good, 1, 5.0).is_err());
        }
        assert_eq!(snr(0.0, &noise(0.0, 0.0, 0.0), 1.0, 1).unwrap(), 0.0);
    }
}
